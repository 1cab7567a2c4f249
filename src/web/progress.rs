//! Progress of a call, told to the page while the call runs.

use std::cell::{Cell, RefCell};

use js_sys::Function;
use wasm_bindgen::JsValue;

use crate::job_executor::Executor;

thread_local! {
    /// Gets the number of jobs done since the call began.
    static CALLBACK: RefCell<Option<Function>> = const { RefCell::new(None) };
    static JOBS_DONE: Cell<u32> = const { Cell::new(0) };
}

/// Runs jobs one after the other and counts them. Executors are `Sync`, which callbacks are not: it is kept beside.
#[derive(Clone, Copy, Debug)]
pub struct ReportingExecutor;

impl ReportingExecutor {
    /// Runs `work`, which reports to `callback`.
    pub fn run<R>(callback: &Function, work: impl FnOnce(&Self) -> R) -> R {
        CALLBACK.set(Some(callback.clone()));
        JOBS_DONE.set(0);
        let result = work(&Self);
        CALLBACK.set(None);
        result
    }
}

#[cfg(feature = "recovery")]
/// Awaits `work`, whose executor counts its jobs by [`report_job`].
pub async fn report_jobs_of<R>(callback: &Function, work: impl Future<Output = R>) -> R {
    CALLBACK.set(Some(callback.clone()));
    JOBS_DONE.set(0);
    let result = work.await;
    CALLBACK.set(None);
    result
}

impl Executor for ReportingExecutor {
    fn map<T: Send>(&self, count: usize, job: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        let run = |i| {
            let result = job(i);
            report_job();
            result
        };
        (0..count).map(run).collect()
    }
}

/// Counts a job as done.
pub fn report_job() {
    let done = JOBS_DONE.get() + 1;
    JOBS_DONE.set(done);
    CALLBACK.with_borrow(|callback| {
        if let Some(callback) = callback {
            // Progress that nobody can receive is no reason to fail.
            let _ = callback.call1(&JsValue::NULL, &done.into());
        }
    });
}
