//! 16-bit numbers as two planes of bytes, which zstd compresses better than pairs.

/// All low bytes, then all high bytes.
pub fn split(numbers: impl ExactSizeIterator<Item = u16>) -> Vec<u8> {
    let count = numbers.len();
    let mut planes = vec![0u8; 2 * count];
    let (low, high) = planes.split_at_mut(count);
    for (i, number) in numbers.enumerate() {
        [low[i], high[i]] = number.to_le_bytes();
    }
    planes
}

/// The inverse of [`split`].
pub fn join(planes: &[u8]) -> impl ExactSizeIterator<Item = u16> {
    let (low, high) = planes.split_at(planes.len() / 2);
    let pairs = low.iter().zip(high);
    pairs.map(|(&low, &high)| u16::from_le_bytes([low, high]))
}

/// 0, -1, 1, -2, 2, … as 0, 1, 2, 3, 4, …, so that the high bytes of small numbers are zero.
pub fn zigzag(number: i16) -> u16 {
    ((number << 1) ^ (number >> 15)) as u16
}

/// The inverse of [`zigzag`].
pub fn unzigzag(code: u16) -> i16 {
    (code >> 1) as i16 ^ -((code & 1) as i16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zigzag_is_invertible_for_every_number() {
        for number in i16::MIN..=i16::MAX {
            assert_eq!(unzigzag(zigzag(number)), number);
        }
        assert_eq!([0, -1, 1, -2, 2].map(zigzag), [0, 1, 2, 3, 4]);
    }

    #[test]
    fn split_and_join_are_inverse() {
        let planes = split([0x0102, 0x0304, 5].into_iter());
        assert_eq!(planes, [2, 4, 5, 1, 3, 0]);
        assert_eq!(join(&planes).collect::<Vec<_>>(), [0x0102, 0x0304, 5]);
    }
}
