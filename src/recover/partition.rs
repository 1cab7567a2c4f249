//! Items that a group of processes holds together.

use crate::job_executor::{Executor, PARTS};

/// Items in [`PARTS`] parts, of which each process of a group holds its own: those whose sums it forms in
/// [`all_reduce`](Executor::all_reduce). Item i is in part i mod [`PARTS`].
#[derive(Debug)]
pub(super) struct Partition<T> {
    /// Number of items in all parts.
    count: usize,
    /// Parts of other processes are empty.
    parts: Vec<Vec<T>>,
}

impl<T: Send> Partition<T> {
    /// Computes `item(0)` to `item(count - 1)`, as far as they belong to this process.
    pub fn new(
        executor: &impl Executor,
        count: usize,
        item: impl Fn(usize) -> T + Sync + Send,
    ) -> Self {
        let own = executor.own_jobs(PARTS);
        let indices = own.clone().map(|part| (part..count).step_by(PARTS));
        let own_indices: Vec<usize> = indices.clone().flatten().collect();
        let items = executor.map(own_indices.len(), |i| item(own_indices[i]));
        let mut items = items.into_iter();
        let mut parts: Vec<Vec<T>> = (0..PARTS).map(|_| Vec::new()).collect();
        for (part, indices) in parts[own].iter_mut().zip(indices) {
            part.extend(items.by_ref().take(indices.len()));
        }
        Self { count, parts }
    }

    /// Computes an item from each, with its number.
    pub fn map<'a, U: Send>(
        &'a self,
        executor: &impl Executor,
        item: impl Fn(usize, &'a T) -> U + Sync + Send,
    ) -> Partition<U>
    where
        T: Sync,
    {
        Partition::new(executor, self.count, |i| {
            item(i, &self.parts[i % PARTS][i / PARTS])
        })
    }

    /// One item, of a process without a group.
    #[cfg(test)]
    pub fn single(item: T) -> Self {
        let mut parts: Vec<Vec<T>> = (0..PARTS).map(|_| Vec::new()).collect();
        parts[0].push(item);
        Self { count: 1, parts }
    }

    /// The items of one part; none if another process holds it.
    pub fn part(&self, part: usize) -> &[T] {
        &self.parts[part]
    }
}
