//! Several workers of a page as one group of processes.

use std::cell::RefCell;
use std::ops::Range;

use js_sys::{Array, Uint8Array};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::job_executor::{Cancelled, Executor, share_of_jobs};
use crate::web::progress::ReportingExecutor;

#[wasm_bindgen]
extern "C" {
    /// This worker's place in a group of workers, and its connections to the others.
    #[wasm_bindgen(typescript_type = "ProcessGroup")]
    #[derive(Clone, Debug)]
    pub type ProcessGroup;

    #[wasm_bindgen(method, getter)]
    fn rank(this: &ProcessGroup) -> usize;

    #[wasm_bindgen(method, getter)]
    fn size(this: &ProcessGroup) -> usize;

    #[wasm_bindgen(method, catch)]
    async fn exchange(this: &ProcessGroup, own: Array) -> Result<JsValue, JsValue>;
}

#[wasm_bindgen(typescript_custom_section)]
const TYPESCRIPT: &str = "
/** This worker's place in a group of workers that run one algorithm together, and its connections to the others. */
export interface ProcessGroup {
  /** Number of this worker, from 0 on. */
  readonly rank: number;
  /** Number of workers. */
  readonly size: number;
  /** Sends `own` to the other workers; resolves with the messages of all, in the order of their ranks. */
  exchange(own: Uint8Array[]): Promise<Uint8Array[]>;
}";

thread_local! {
    /// Executors are `Sync`, which JavaScript's objects are not: it is kept beside.
    static GROUP: RefCell<Option<ProcessGroup>> = const { RefCell::new(None) };
}

/// Runs its share of a group's jobs one after the other and reports them.
#[derive(Debug)]
pub(super) struct GroupExecutor {
    rank: usize,
    size: usize,
}

impl GroupExecutor {
    /// The executor of a worker in `group`, or of one without a group.
    pub fn join(group: Option<ProcessGroup>) -> Self {
        let [rank, size] = match &group {
            Some(group) => [group.rank(), group.size()],
            None => [0, 1],
        };
        GROUP.set(group);
        Self { rank, size }
    }
}

impl Drop for GroupExecutor {
    fn drop(&mut self) {
        GROUP.set(None);
    }
}

impl Executor for GroupExecutor {
    fn map<T: Send>(&self, count: usize, job: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        ReportingExecutor.map(count, job)
    }

    fn own_jobs(&self, count: usize) -> Range<usize> {
        share_of_jobs(count, self.rank, self.size)
    }

    async fn exchange(&self, own: Vec<Vec<u8>>) -> Result<Vec<Vec<u8>>, Cancelled> {
        let Some(group) = GROUP.with_borrow(Clone::clone) else {
            return Ok(own);
        };
        let messages = own.iter().map(|message| Uint8Array::from(&message[..]));
        let all = group.exchange(messages.collect()).await;
        let all = all.map_err(|_| Cancelled)?;
        let all = Array::from(&all);
        Ok(all
            .iter()
            .map(|message| Uint8Array::new(&message).to_vec())
            .collect())
    }
}
