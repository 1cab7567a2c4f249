//! Runs independent jobs, on one thread, on many, or in several processes, until the caller cancels.
//!
//! No algorithm of this library starts a thread. It divides its work into independent jobs and gives these to an
//! [`Executor`]: the command line's uses all cores, a browser's the thread that calls.
//!
//! A group of processes without common memory, as the workers of a page are, can run one algorithm together. All run it
//! on the same input, each does its share of the jobs, and [`all_gather`](Executor::all_gather) and
//! [`all_reduce`](Executor::all_reduce) give every process the results of all, as the operations of MPI with these names
//! do. Sums have the same bits in groups of every size. Where functions are `async`, they wait for the other processes;
//! with an executor without a group they never wait.

use std::future::{Future, ready};
use std::ops::Range;

use bytemuck::{Pod, pod_collect_to_vec};
use thiserror::Error;

use crate::linalg::add_scaled;

/// Number of jobs whose results [`all_reduce`](Executor::all_reduce) sums. Fixed, so that rounding does not depend on
/// the number of threads or processes.
pub const PARTS: usize = 8;

/// Runs independent jobs in any order and on any number of threads.
pub trait Executor: Sync {
    /// Runs `job(0)` to `job(count - 1)` in this process and returns their results in this order.
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

    /// This process's share of `count` jobs: all, unless there is a group.
    fn own_jobs(&self, count: usize) -> Range<usize> {
        0..count
    }

    /// Sends `own` to the other processes of the group; returns what all have sent, in their order.
    ///
    /// # Errors
    /// [`Cancelled`] if another process is lost.
    fn exchange(&self, own: Vec<Vec<u8>>) -> impl Future<Output = Result<Vec<Vec<u8>>, Cancelled>> {
        ready(Ok(own))
    }

    /// Runs `job(0)` to `job(count - 1)`, divided among the processes of the group; every process gets all results, in
    /// this order.
    ///
    /// # Errors
    /// Those of [`exchange`](Self::exchange).
    fn all_gather<T: Pod + Send>(
        &self,
        count: usize,
        job: impl Fn(usize) -> Vec<T> + Sync + Send,
    ) -> impl Future<Output = Result<Vec<Vec<T>>, Cancelled>> {
        async move {
            let own = self.own_jobs(count);
            let results = self.map(own.len(), |i| pod_collect_to_vec(&job(own.start + i)));
            let all = self.exchange(results).await?;
            Ok(all
                .iter()
                .map(|result| pod_collect_to_vec(result))
                .collect())
        }
    }

    /// Adds `job(0)` to `job(PARTS - 1)`, divided among the processes of the group, to sums that are zero at first; every
    /// process gets the total. Results of jobs are added in pairs, then pairs of pairs.
    ///
    /// # Errors
    /// Those of [`exchange`](Self::exchange).
    fn all_reduce<T: Sums>(
        &self,
        zeros: impl Fn() -> T + Sync + Send,
        job: impl Fn(usize, &mut T) + Sync + Send,
    ) -> impl Future<Output = Result<T, Cancelled>> {
        async move {
            let own = self.own_jobs(PARTS);
            let leaves = self.map(own.len(), |i| {
                let mut sums = zeros();
                job(own.start + i, &mut sums);
                PartialSum {
                    level: 0,
                    index: own.start + i,
                    values: values(&mut sums),
                }
            });
            let own = add_pairs(leaves).into_iter().map(PartialSum::into_message);
            let all = self.exchange(own.collect()).await?;
            let all = all.iter().map(|message| PartialSum::from_message(message));
            let total = add_pairs(all.collect()).pop().ok_or(Cancelled)?;
            let mut sums = zeros();
            set_values(&mut sums, &total.values);
            Ok(sums)
        }
    }
}

/// Of `count` jobs, the share of process number `rank` in a group of `size`.
pub fn share_of_jobs(count: usize, rank: usize, size: usize) -> Range<usize> {
    rank * count / size..(rank + 1) * count / size
}

/// Sums, which can be added to others of the same lengths.
pub trait Sums {
    /// Visits all, in the same order each time.
    fn visit(&mut self, visitor: &mut dyn FnMut(&mut [f64]));
}

impl<T: Sums> Sums for Vec<T> {
    fn visit(&mut self, visitor: &mut dyn FnMut(&mut [f64])) {
        self.iter_mut().for_each(|sums| sums.visit(visitor));
    }
}

/// All sums in one list.
pub fn values(sums: &mut dyn Sums) -> Vec<f64> {
    let mut values = Vec::new();
    sums.visit(&mut |slice| values.extend_from_slice(slice));
    values
}

/// Sets all sums to those of a list of the same length.
pub fn set_values(sums: &mut dyn Sums, values: &[f64]) {
    let mut values = values.iter();
    sums.visit(&mut |slice| {
        let pairs = slice.iter_mut().zip(&mut values);
        pairs.for_each(|(sum, value)| *sum = *value);
    });
}

/// Adds `other` to `sums`.
pub fn add(sums: &mut dyn Sums, other: &mut dyn Sums) {
    let others = values(other);
    let mut others = others.iter();
    sums.visit(&mut |slice| {
        let pairs = slice.iter_mut().zip(&mut others);
        pairs.for_each(|(sum, other)| *sum += *other);
    });
}

/// The caller has cancelled the work, or a process of the group is lost.
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

/// A node of the binary tree by which the results of [`PARTS`] jobs are added.
struct PartialSum {
    /// Height above the leaves.
    level: usize,
    /// Number among the nodes of its level.
    index: usize,
    values: Vec<f64>,
}

impl PartialSum {
    /// Whether both are children of one node.
    fn is_left_of(&self, right: &Self) -> bool {
        self.level == right.level && self.index.is_multiple_of(2) && self.index + 1 == right.index
    }

    fn into_message(self) -> Vec<u8> {
        let mut values = self.values;
        values.extend([self.level as f64, self.index as f64]);
        pod_collect_to_vec(&values)
    }

    fn from_message(message: &[u8]) -> Self {
        let mut values: Vec<f64> = pod_collect_to_vec(message);
        let mut pop = || values.pop().unwrap_or_default() as usize;
        let [index, level] = [pop(), pop()];
        Self {
            level,
            index,
            values,
        }
    }
}

/// Adds neighbours that are children of one node, until none are left.
fn add_pairs(nodes: Vec<PartialSum>) -> Vec<PartialSum> {
    let mut added: Vec<PartialSum> = Vec::new();
    for mut right in nodes {
        while let Some(mut left) = added.pop_if(|left| left.is_left_of(&right)) {
            add_scaled(&mut left.values, 1.0, &right.values);
            right = PartialSum {
                level: left.level + 1,
                index: left.index / 2,
                values: left.values,
            };
        }
        added.push(right);
    }
    added
}

#[cfg(test)]
pub(crate) mod test_group {
    use std::sync::{Barrier, Mutex};

    use super::*;

    /// One of several processes that work together; here they are threads.
    pub(crate) struct ThreadOfGroup<'a> {
        rank: usize,
        size: usize,
        barrier: &'a Barrier,
        /// By rank.
        messages: &'a Mutex<Vec<Vec<Vec<u8>>>>,
    }

    impl Executor for ThreadOfGroup<'_> {
        fn map<T: Send>(&self, count: usize, job: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
            SequentialExecutor.map(count, job)
        }

        fn own_jobs(&self, count: usize) -> Range<usize> {
            share_of_jobs(count, self.rank, self.size)
        }

        async fn exchange(&self, own: Vec<Vec<u8>>) -> Result<Vec<Vec<u8>>, Cancelled> {
            self.messages.lock().unwrap()[self.rank] = own;
            self.barrier.wait();
            let all = self.messages.lock().unwrap().concat();
            self.barrier.wait();
            Ok(all)
        }
    }

    /// Runs `work` in a group of `size` processes; returns the result of each.
    pub(crate) fn run_in_group<R: Send>(
        size: usize,
        work: impl Fn(&ThreadOfGroup<'_>) -> R + Sync,
    ) -> Vec<R> {
        let (barrier, messages) = (Barrier::new(size), Mutex::new(vec![Vec::new(); size]));
        std::thread::scope(|scope| {
            let run = |rank| {
                let (barrier, messages, work) = (&barrier, &messages, &work);
                scope.spawn(move || {
                    work(&ThreadOfGroup {
                        rank,
                        size,
                        barrier,
                        messages,
                    })
                })
            };
            let threads: Vec<_> = (0..size).map(run).collect();
            let results = threads.into_iter().map(|thread| thread.join().unwrap());
            results.collect()
        })
    }

    #[test]
    fn results_are_gathered_in_order_and_summed_to_the_same_bits() {
        let values = |part: usize| [0.1, 1e16, -1e16].map(|x| x / (part + 1) as f64);
        let total = |executor: &ThreadOfGroup<'_>| {
            let zeros = || TwoLists([0.0; 2], vec![0.0]);
            let job = |part: usize, sums: &mut TwoLists| {
                let [a, b, c] = values(part);
                sums.0 = [a, b];
                sums.1 = vec![c];
            };
            let sums = pollster::block_on(executor.all_reduce(zeros, job)).unwrap();
            let squares = executor.all_gather(11, |i| vec![i as f64; i % 3]);
            let squares = pollster::block_on(squares).unwrap();
            ([sums.0[0], sums.0[1], sums.1[0]].map(f64::to_bits), squares)
        };
        let alone = run_in_group(1, total).remove(0);
        let gathered: Vec<_> = (0..11).map(|i| vec![i as f64; i % 3]).collect();
        assert_eq!(alone.1, gathered);
        let first = (0..PARTS).map(|part| values(part)[0]).sum::<f64>();
        assert!((f64::from_bits(alone.0[0]) - first).abs() < 1e-12);
        for size in 2..=11 {
            let group = run_in_group(size, total);
            assert!(group.iter().all(|one| *one == alone), "{size} processes");
        }
    }

    struct TwoLists([f64; 2], Vec<f64>);

    impl Sums for TwoLists {
        fn visit(&mut self, visitor: &mut dyn FnMut(&mut [f64])) {
            visitor(&mut self.0);
            visitor(&mut self.1);
        }
    }
}
