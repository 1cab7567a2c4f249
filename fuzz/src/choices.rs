//! The fuzzer's bytes as decisions. Past the end all bytes are 0, so that every input is valid, and a change
//! of one byte changes one decision.

/// The bytes of an input that are not used yet.
#[derive(Debug)]
pub struct Choices<'a>(pub &'a [u8]);

impl<'a> Choices<'a> {
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub fn byte(&mut self) -> u8 {
        match self.0.split_first() {
            Some((&first, rest)) => {
                self.0 = rest;
                first
            }
            None => 0,
        }
    }

    pub fn bytes<const K: usize>(&mut self) -> [u8; K] {
        std::array::from_fn(|_| self.byte())
    }

    /// The next `count` bytes, or all that are left.
    pub fn up_to(&mut self, count: usize) -> &'a [u8] {
        let (taken, rest) = self.0.split_at(count.min(self.0.len()));
        self.0 = rest;
        taken
    }

    /// True for one byte value in 256, and false past the end of the input.
    pub fn rarely(&mut self) -> bool {
        self.byte() == 0xFF
    }

    /// True for the `of_256` largest byte values, and false past the end of the input.
    pub fn chance(&mut self, of_256: u8) -> bool {
        self.byte() > 255 - of_256
    }

    pub fn below(&mut self, end: u8) -> u8 {
        self.byte() % end
    }

    pub fn u16(&mut self) -> u16 {
        u16::from_le_bytes(self.bytes())
    }

    pub fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.bytes())
    }

    pub fn f32(&mut self) -> f32 {
        f32::from_le_bytes(self.bytes())
    }

    pub fn f64(&mut self) -> f64 {
        f64::from_le_bytes(self.bytes())
    }

    pub fn of<T: Copy, const K: usize>(&mut self, values: [T; K]) -> T {
        values[usize::from(self.byte()) % K]
    }

    /// `length` bytes from few decisions: a constant, a pattern, noise, or bytes of the input.
    pub fn fill(&mut self, length: usize) -> Vec<u8> {
        match self.below(4) {
            0 => vec![self.byte(); length],
            1 => {
                let pattern: [u8; 4] = self.bytes();
                pattern.into_iter().cycle().take(length).collect()
            }
            2 => {
                let mut noise = self.noise();
                (0..length).map(|_| (noise.next() >> 24) as u8).collect()
            }
            _ => {
                let mut bytes = self.up_to(length.min(64)).to_vec();
                bytes.resize(length, 0);
                bytes
            }
        }
    }

    pub fn noise(&mut self) -> Noise {
        Noise(u64::from(self.u16()) + 1)
    }
}

/// A linear congruential generator.
#[derive(Debug)]
pub struct Noise(u64);

impl Noise {
    pub fn next(&mut self) -> u32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 32) as u32
    }

    /// A number in -1..1.
    pub fn signed(&mut self) -> f32 {
        self.next() as i32 as f32 / (1u32 << 31) as f32
    }
}
