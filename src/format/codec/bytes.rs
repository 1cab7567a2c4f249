//! 16-bit numbers as bytes that zstd takes well, and fields of chunks.

use super::{PartError, damaged};

/// All low bytes, then all high ones: what is alike stands together.
pub fn split(numbers: impl ExactSizeIterator<Item = u16>) -> Vec<u8> {
    let count = numbers.len();
    let mut planes = vec![0u8; 2 * count];
    let (low, high) = planes.split_at_mut(count);
    for (i, number) in numbers.enumerate() {
        [low[i], high[i]] = number.to_le_bytes();
    }
    planes
}

/// The numbers that [`split`] made `planes` of.
pub fn join(planes: &[u8]) -> impl ExactSizeIterator<Item = u16> {
    let (low, high) = planes.split_at(planes.len() / 2);
    let pairs = low.iter().zip(high);
    pairs.map(|(&low, &high)| u16::from_le_bytes([low, high]))
}

/// 0, -1, 1, -2, 2, … as 0, 1, 2, 3, 4, …: high bytes of small numbers are then all zero.
pub fn zigzag(number: i16) -> u16 {
    ((number << 1) ^ (number >> 15)) as u16
}

/// The number that [`zigzag`] made `code` of.
pub fn unzigzag(code: u16) -> i16 {
    (code >> 1) as i16 ^ -((code & 1) as i16)
}

/// Takes fields from the front of a chunk.
#[derive(Debug)]
pub struct Fields<'a>(pub &'a [u8]);

impl<'a> Fields<'a> {
    /// The next `count` bytes.
    pub fn bytes(&mut self, count: usize) -> Result<&'a [u8], PartError> {
        let (taken, rest) = self
            .0
            .split_at_checked(count)
            .ok_or_else(|| damaged("it is shorter than it says"))?;
        self.0 = rest;
        Ok(taken)
    }

    /// The next four bytes, as a length.
    pub fn length(&mut self) -> Result<usize, PartError> {
        let bytes = self.bytes(4)?;
        let mut field = [0; 4];
        field.copy_from_slice(bytes);
        Ok(u32::from_le_bytes(field) as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zigzag_takes_every_number_there_and_back() {
        for number in i16::MIN..=i16::MAX {
            assert_eq!(unzigzag(zigzag(number)), number);
        }
        assert_eq!([0, -1, 1, -2, 2].map(zigzag), [0, 1, 2, 3, 4]);
    }

    #[test]
    fn planes_are_taken_apart_and_put_together() {
        let planes = split([0x0102, 0x0304, 5].into_iter());
        assert_eq!(planes, [2, 4, 5, 1, 3, 0]);
        assert_eq!(join(&planes).collect::<Vec<_>>(), [0x0102, 0x0304, 5]);
    }
}
