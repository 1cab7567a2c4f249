//! Who does the work: nothing below the command line knows of threads.

/// Runs independent pieces of work, in any order and on as many threads as it likes.
pub trait Workers: Sync {
    /// `work(0)` to `work(count - 1)`, results in that order.
    fn map<T: Send>(&self, count: usize, work: impl Fn(usize) -> T + Sync + Send) -> Vec<T>;

    /// Whether the work is no longer wanted. Asked between stages of a few seconds.
    fn stopped(&self) -> bool {
        false
    }
}

/// One piece after the other, on the caller's thread.
#[derive(Clone, Copy, Debug)]
pub struct OneThread;

impl Workers for OneThread {
    fn map<T: Send>(&self, count: usize, work: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        (0..count).map(work).collect()
    }
}
