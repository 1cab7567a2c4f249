//! Runs independent jobs, on one thread or on many, until the caller cancels.
//!
//! No algorithm of this library starts a thread. It divides its work into independent jobs and gives these to an
//! [`Executor`]: the command line's uses all cores, a browser's the thread that calls.

use thiserror::Error;

/// Runs independent jobs in any order and on any number of threads.
pub trait Executor: Sync {
    /// Runs `job(0)` to `job(count - 1)` and returns their results in this order.
    fn map<T: Send>(&self, count: usize, job: impl Fn(usize) -> T + Sync + Send) -> Vec<T>;

    /// Whether the caller has cancelled the work. Algorithms ask between stages of a few seconds.
    fn is_cancelled(&self) -> bool {
        false
    }

    /// Lets an algorithm return early with `?`.
    ///
    /// # Errors
    /// [`Cancelled`] if [`is_cancelled`](Self::is_cancelled).
    fn check_cancelled(&self) -> Result<(), Cancelled> {
        match self.is_cancelled() {
            true => Err(Cancelled),
            false => Ok(()),
        }
    }
}

/// The caller has cancelled the work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("the work was cancelled")]
pub struct Cancelled;

/// Runs one job after the other on the calling thread.
#[derive(Clone, Copy, Debug)]
pub struct SequentialExecutor;

impl Executor for SequentialExecutor {
    fn map<T: Send>(&self, count: usize, job: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        (0..count).map(job).collect()
    }
}
