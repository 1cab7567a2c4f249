//! The reader's memory budget: every allocation of the reader is reserved here first.
//!
//! Lengths in a file are claims, so a reservation fails before memory is taken ([`FormatError::Limit`]), and an
//! allocation that the system refuses is an error too ([`FormatError::Memory`]): a WebAssembly module must not abort.
//! Tables of zstd (about 160 kB) and error messages are not counted.

use std::cell::Cell;

use bytemuck::Zeroable;

use super::error::FormatError;

/// Memory limits for files from untrusted sources.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Bytes that a reader may hold at a time: the index, all tiles, the working memory of one tile,
    /// and for relighting a light and a picture.
    pub decoded_bytes: u64,
}

impl Default for Limits {
    /// 2 GiB: as much as a 32-bit WebAssembly module can hold. Direct tiles of 512 x 512 pixels with a
    /// window of 15 take a quarter of it if no value is zero.
    fn default() -> Self {
        Self {
            decoded_bytes: 2 << 30,
        }
    }
}

/// Bytes that a reader may still reserve, and the fallible allocations that reserve them. They fail with
/// [`FormatError::Limit`] beyond the limit, and with [`FormatError::Memory`] if the system refuses memory.
#[derive(Debug)]
pub struct MemoryBudget {
    limit: u64,
    reserved: Cell<u64>,
}

impl MemoryBudget {
    /// A budget with nothing reserved.
    pub fn new(limits: Limits) -> Self {
        Self {
            limit: limits.decoded_bytes,
            reserved: Cell::new(0),
        }
    }

    /// A budget for files whose index has passed the limits of a [`LtmReader`](super::LtmReader).
    pub fn unlimited() -> Self {
        let decoded_bytes = u64::MAX;
        Self::new(Limits { decoded_bytes })
    }

    pub(super) fn reserve(&self, bytes: u64) -> Result<(), FormatError> {
        let need = self.reserved.get().saturating_add(bytes);
        self.check(need)?;
        self.reserved.set(need);
        Ok(())
    }

    /// Checks that the whole budget covers `need` bytes.
    pub(super) fn check(&self, need: u64) -> Result<(), FormatError> {
        match self.limit {
            limit if need > limit => Err(FormatError::Limit { need, limit }),
            _ => Ok(()),
        }
    }

    pub fn release(&self, bytes: u64) {
        self.reserved.set(self.reserved.get().saturating_sub(bytes));
    }

    /// Drops a vector and releases its bytes.
    pub fn release_vec<T>(&self, values: Vec<T>) {
        self.release(vec_bytes(&values));
    }

    /// Starts a scope: dropping the guard releases all bytes reserved since.
    pub fn scratch(&self) -> ScratchReservation<'_> {
        ScratchReservation {
            budget: self,
            reserved_after: self.reserved.get(),
        }
    }

    /// An empty vector with room for `length` values.
    pub(super) fn try_with_capacity<T>(&self, length: usize) -> Result<Vec<T>, FormatError> {
        let mut values = Vec::new();
        self.try_grow(&mut values, length)?;
        Ok(values)
    }

    pub(super) fn try_zeroed<T: Zeroable + Clone>(
        &self,
        length: usize,
    ) -> Result<Vec<T>, FormatError> {
        let mut values = self.try_with_capacity(length)?;
        values.resize(length, T::zeroed());
        Ok(values)
    }

    pub(super) fn try_copy<T: Copy>(&self, values: &[T]) -> Result<Vec<T>, FormatError> {
        let mut copy = self.try_with_capacity(values.len())?;
        copy.extend_from_slice(values);
        Ok(copy)
    }

    /// Appends a value, with twice the capacity when `values` is full.
    pub(super) fn try_push<T>(&self, values: &mut Vec<T>, value: T) -> Result<(), FormatError> {
        if values.len() == values.capacity() {
            self.try_grow(values, 2 * values.len() + 1)?;
        }
        values.push(value);
        Ok(())
    }

    /// Appends `more` to `values`, whose capacity at least doubles when it grows, up to `final_length`.
    pub(super) fn try_extend(
        &self,
        values: &mut Vec<u8>,
        more: &[u8],
        final_length: usize,
    ) -> Result<(), FormatError> {
        let need = values.len() + more.len();
        if need > values.capacity() {
            let capacity = need.max((2 * values.capacity()).min(final_length));
            self.try_grow(values, capacity)?;
        }
        values.extend_from_slice(more);
        Ok(())
    }

    /// Grows the capacity to `capacity` values.
    fn try_grow<T>(&self, values: &mut Vec<T>, capacity: usize) -> Result<(), FormatError> {
        let before = vec_bytes(values);
        let need = (capacity as u64).saturating_mul(size_of::<T>() as u64);
        // While a vector grows, both allocations are held.
        self.reserve(need)?;
        let reserved = values.try_reserve_exact(capacity - values.len());
        self.release(if reserved.is_ok() { before } else { need });
        reserved.map_err(|_| FormatError::Memory(need))
    }
}

/// Releases on drop all bytes reserved since [`MemoryBudget::scratch`], except those that [`keep`](Self::keep) names.
#[derive(Debug)]
pub struct ScratchReservation<'a> {
    budget: &'a MemoryBudget,
    reserved_after: u64,
}

impl ScratchReservation<'_> {
    /// Ends the scope; `bytes` stay reserved.
    pub fn keep(mut self, bytes: u64) {
        self.reserved_after += bytes;
    }
}

impl Drop for ScratchReservation<'_> {
    fn drop(&mut self) {
        self.budget.reserved.set(self.reserved_after);
    }
}

/// Bytes that a vector has allocated.
pub fn vec_bytes<T>(values: &Vec<T>) -> u64 {
    (values.capacity() * size_of::<T>()) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn budget(decoded_bytes: u64) -> MemoryBudget {
        MemoryBudget::new(Limits { decoded_bytes })
    }

    #[test]
    fn allocations_beyond_the_limit_are_refused_and_reserve_nothing() {
        let budget = budget(100);
        let held = budget.try_zeroed::<u32>(20).unwrap();
        let error = budget.try_zeroed::<u32>(6).unwrap_err();
        assert!(matches!(
            error,
            FormatError::Limit {
                need: 104,
                limit: 100
            }
        ));
        budget.release_vec(held);
        assert_eq!(budget.try_zeroed::<u32>(25).unwrap(), [0; 25]);
    }

    #[test]
    fn memory_that_the_system_refuses_is_an_error() {
        let budget = budget(u64::MAX);
        let error = budget.try_zeroed::<u8>(usize::MAX / 2 + 1).unwrap_err();
        assert!(matches!(error, FormatError::Memory { .. }), "{error}");
        budget.try_zeroed::<u8>(10).unwrap();
        assert_eq!(budget.reserved.get(), 10);
    }

    #[test]
    fn scratch_memory_is_released_except_for_kept_bytes() {
        let budget = budget(100);
        budget.reserve(10).unwrap();
        let scratch = budget.scratch();
        budget.reserve(50).unwrap();
        scratch.keep(20);
        assert_eq!(budget.reserved.get(), 30);
        drop((budget.reserve(70), budget.scratch()));
        assert_eq!(budget.reserved.get(), 100);
    }

    #[test]
    fn a_buffer_that_grows_reserves_its_capacity_and_no_more_than_its_final_length() {
        let budget = budget(1000);
        let mut buffer = Vec::new();
        for _ in 0..30 {
            budget.try_extend(&mut buffer, &[1, 2, 3], 90).unwrap();
            assert_eq!(budget.reserved.get(), buffer.capacity() as u64);
        }
        assert_eq!((buffer.len(), buffer.capacity()), (90, 90));
        budget.release_vec(buffer);
        assert_eq!(budget.reserved.get(), 0);
    }
}
