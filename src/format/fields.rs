//! Little-endian fields.

/// Reads fields from the front of some bytes.
#[derive(Debug)]
pub struct FieldReader<'a>(pub &'a [u8]);

impl<'a> FieldReader<'a> {
    /// The next `count` bytes, if there are so many.
    pub fn try_bytes(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    /// The next four bytes as a length, if they are there.
    pub fn try_length(&mut self) -> Option<usize> {
        let (field, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(u32::from_le_bytes(*field) as usize)
    }

    /// The next bytes of a record whose length the caller has checked.
    fn take<const K: usize>(&mut self) -> [u8; K] {
        let (field, rest) = self.0.split_at(K);
        self.0 = rest;
        std::array::from_fn(|i| field[i])
    }

    pub fn u16s<const K: usize>(&mut self) -> [u16; K] {
        std::array::from_fn(|_| u16::from_le_bytes(self.take()))
    }

    pub fn u32s<const K: usize>(&mut self) -> [u32; K] {
        std::array::from_fn(|_| u32::from_le_bytes(self.take()))
    }

    pub fn u64(&mut self) -> u64 {
        u64::from_le_bytes(self.take())
    }

    pub fn f64(&mut self) -> f64 {
        f64::from_bits(self.u64())
    }
}
