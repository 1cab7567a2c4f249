//! Little-endian fields of fixed places.

/// Takes fields from the front. The caller knows that there are enough bytes.
#[derive(Debug)]
pub struct Fields<'a>(pub &'a [u8]);

impl Fields<'_> {
    fn take<const K: usize>(&mut self) -> [u8; K] {
        let (field, rest) = self.0.split_at(K);
        self.0 = rest;
        std::array::from_fn(|i| field[i])
    }

    pub fn u16(&mut self) -> u16 {
        u16::from_le_bytes(self.take())
    }

    pub fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }

    pub fn u64(&mut self) -> u64 {
        u64::from_le_bytes(self.take())
    }

    pub fn f32(&mut self) -> f32 {
        f32::from_le_bytes(self.take())
    }

    pub fn f64(&mut self) -> f64 {
        f64::from_le_bytes(self.take())
    }
}
