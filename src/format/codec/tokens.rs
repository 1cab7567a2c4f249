//! Blocks of small integers, mostly zero, as bytes that zstd takes well.
//!
//! A token says how many zeros come before the next number that is none, and how many bits that
//! number has: `run · 16 + size`. Its sign and its bits below the highest, which nothing predicts, go
//! into a stream of their own. `0` ends a block, and `0xF0` is sixteen zeros.
//!
//! What a token is likely to be depends on the one before it. Tokens may be kept in three streams: the
//! first of each block, those after a token of no more than one bit, and the others.

use super::bytes::Fields;
use super::{PartError, compress, compressed_bound, damaged, decompress};
use crate::format::FormatError;

/// Most bits of a number.
const MOST_BITS: u32 = 15;
/// Largest magnitude of a number.
pub const MOST: i32 = (1 << MOST_BITS) - 1;
const END: u8 = 0;
const SIXTEEN_ZEROS: u8 = 0xF0;

/// Streams of tokens where they are told apart by what comes before.
const CLASSES: usize = 3;

/// The stream of the token after this one; none comes before the first.
fn class(before: Option<u8>) -> usize {
    match before {
        None => 0,
        Some(token) if token & 15 <= 1 => 1,
        Some(_) => 2,
    }
}

/// Most bytes of blocks of so many tokens: each has up to fifteen bits.
pub fn bound(tokens: u64) -> u64 {
    let head = 1 + 8 * CLASSES as u64;
    head + CLASSES as u64 * compressed_bound(0) + compressed_bound(tokens) + 2 * tokens
}

/// Blocks on their way into a file.
#[derive(Debug, Default)]
pub struct Writer {
    /// All of them, and the same by class: which takes less is known at the end.
    tokens: Vec<u8>,
    streams: [Vec<u8>; CLASSES],
    bits: Vec<u8>,
    /// Bits not yet in `bits`, the first the lowest.
    pending: u32,
    count: u32,
}

impl Writer {
    /// Writes one block; magnitudes above [`MOST`] become that.
    pub fn block(&mut self, block: &[i32]) {
        let (mut before, mut zeros) = (None, 0);
        let mut put = |token: u8| {
            self.tokens.push(token);
            self.streams[class(before)].push(token);
            before = Some(token);
        };
        for &number in block {
            if number == 0 {
                zeros += 1;
                continue;
            }
            while zeros > 15 {
                put(SIXTEEN_ZEROS);
                zeros -= 16;
            }
            let magnitude = number.unsigned_abs().min(MOST as u32);
            let size = u32::BITS - magnitude.leading_zeros();
            put((zeros << 4 | size) as u8);
            let below_highest = magnitude ^ 1 << (size - 1);
            self.pending |= (below_highest << 1 | u32::from(number < 0)) << self.count;
            self.count += size;
            while self.count >= 8 {
                self.bits.push(self.pending as u8);
                self.pending >>= 8;
                self.count -= 8;
            }
            zeros = 0;
        }
        if zeros > 0 {
            put(END);
        }
    }

    /// The blocks as in a file, and how many tokens they have.
    pub fn finish(mut self) -> Result<(Vec<u8>, u32), FormatError> {
        if self.count > 0 {
            self.bits.push(self.pending as u8);
        }
        let count = self.tokens.len() as u32; // a chunk's tokens are few
        let (apart, together) = (pack(&self.streams)?, pack(&[self.tokens])?);
        // Few tokens are better together.
        let mut bytes = match together.len() <= apart.len() {
            true => together,
            false => apart,
        };
        bytes.extend(self.bits);
        Ok((bytes, count))
    }
}

/// How many streams, for each how many tokens and how many bytes they take, and these bytes.
fn pack(streams: &[Vec<u8>]) -> Result<Vec<u8>, FormatError> {
    let mut bytes = vec![streams.len() as u8];
    let mut frames = Vec::new();
    for tokens in streams {
        let frame = match tokens.is_empty() {
            true => Vec::new(),
            false => compress(tokens)?,
        };
        bytes.extend((tokens.len() as u32).to_le_bytes());
        bytes.extend((frame.len() as u32).to_le_bytes());
        frames.extend(frame);
    }
    bytes.extend(frames);
    Ok(bytes)
}

/// Reads blocks.
#[derive(Debug)]
pub struct Reader<'a> {
    streams: [Vec<u8>; CLASSES],
    /// Places in the streams.
    places: [usize; CLASSES],
    apart: bool,
    bits: std::slice::Iter<'a, u8>,
    pending: u32,
    count: u32,
}

impl<'a> Reader<'a> {
    /// A reader of blocks of at most `most` tokens.
    pub fn new(bytes: &'a [u8], most: usize) -> Result<Self, PartError> {
        let mut fields = Fields(bytes);
        let count = match fields.bytes(1)? {
            [1] => 1,
            [3] => CLASSES,
            _ => return Err(damaged("it has a number of streams that cannot be")),
        };
        let mut lengths = [[0; 2]; CLASSES];
        for length in &mut lengths[..count] {
            *length = [fields.length()?, fields.length()?];
        }
        let tokens = lengths
            .iter()
            .map(|[tokens, _]| *tokens as u64)
            .sum::<u64>();
        if tokens > most as u64 {
            return Err(damaged("it has more tokens than it says"));
        }
        let mut streams = [const { Vec::new() }; CLASSES];
        for (stream, [tokens, frame]) in streams.iter_mut().zip(lengths) {
            let frame = fields.bytes(frame)?;
            if !frame.is_empty() || tokens > 0 {
                *stream = decompress(frame, tokens)?;
            }
        }
        Ok(Self {
            streams,
            places: [0; CLASSES],
            apart: count > 1,
            bits: fields.0.iter(),
            pending: 0,
            count: 0,
        })
    }

    /// Number of tokens.
    pub fn tokens(&self) -> usize {
        self.streams.iter().map(Vec::len).sum()
    }

    /// Reads a block into `block`, which is all zero. Returns one more than the place of its last
    /// number that is not zero.
    pub fn block(&mut self, block: &mut [i32]) -> Result<usize, PartError> {
        let (mut at, mut end, mut before) = (0, 0, None);
        while at < block.len() {
            let class = if self.apart { class(before) } else { 0 };
            let place = &mut self.places[class];
            let &token = self.streams[class].get(*place).ok_or_else(cut)?;
            *place += 1;
            before = Some(token);
            match token {
                END => break,
                SIXTEEN_ZEROS => at += 16,
                token => {
                    at += usize::from(token >> 4);
                    let size = u32::from(token & 15);
                    if size == 0 || at >= block.len() {
                        return Err(damaged("it has a token that cannot be"));
                    }
                    let bits = self.take(size)?;
                    let magnitude = (1 << (size - 1) | bits >> 1) as i32;
                    block[at] = if bits & 1 == 0 { magnitude } else { -magnitude };
                    at += 1;
                    end = at;
                }
            }
        }
        Ok(end)
    }

    fn take(&mut self, count: u32) -> Result<u32, PartError> {
        while self.count < count {
            let &byte = self.bits.next().ok_or_else(cut)?;
            self.pending |= u32::from(byte) << self.count;
            self.count += 8;
        }
        let bits = self.pending & ((1 << count) - 1);
        self.pending >>= count;
        self.count -= count;
        Ok(bits)
    }

    /// An error if anything is left.
    pub fn finish(mut self) -> Result<(), PartError> {
        let read = self.places.iter().sum::<usize>() == self.tokens();
        match read && self.bits.next().is_none() && self.pending == 0 {
            true => Ok(()),
            false => Err(damaged("it has more than its blocks")),
        }
    }
}

fn cut() -> PartError {
    damaged("it ends within a block")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn round_trip(blocks: &[Vec<i32>]) {
        let mut writer = Writer::default();
        blocks.iter().for_each(|block| writer.block(block));
        let (bytes, tokens) = writer.finish().unwrap();
        assert!(bytes.len() as u64 <= bound(tokens.into()));
        let read = |bytes: &[u8]| {
            let mut reader = Reader::new(bytes, tokens as usize)?;
            assert_eq!(reader.tokens(), tokens as usize);
            for block in blocks {
                let mut read = vec![0; block.len()];
                let end = reader.block(&mut read)?;
                assert_eq!(&read, block);
                let last = block.iter().rposition(|&n| n != 0);
                assert_eq!(end, last.map_or(0, |at| at + 1));
            }
            reader.finish()
        };
        read(&bytes).unwrap();
        // Cut anywhere, or with more after it, it is an error and nothing worse.
        for cut in 0..bytes.len() {
            assert!(read(&bytes[..cut]).is_err());
        }
        assert!(read(&[&bytes[..], &[0]].concat()).is_err());
        assert!(Reader::new(&bytes, tokens as usize - 1).is_err());
    }

    fn sparse(every: usize, length: usize) -> Vec<i32> {
        let number = |i: usize| ((i * 7919) % 31) as i32 - 15;
        let place = |i: usize| {
            if i.is_multiple_of(every) {
                number(i)
            } else {
                0
            }
        };
        (0..length).map(place).collect()
    }

    #[test]
    fn blocks_come_back() {
        round_trip(&[
            vec![0; 64],
            sparse(1, 64),
            sparse(3, 64),
            sparse(17, 225),
            vec![0; 5],
        ]);
        round_trip(&[
            vec![MOST, -MOST, 1, -1, 0, 0, 2],
            [vec![0; 63], vec![-3]].concat(),
        ]);
        round_trip(&[[vec![0; 32], vec![1], vec![0; 16]].concat()]);
    }

    #[test]
    fn many_tokens_are_kept_apart() {
        // What comes first is of another kind than what follows.
        let mut state = 1u32;
        let mut noise = |below: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((state >> 8) % below) as i32
        };
        let mut block = || -> Vec<i32> {
            let first = (1 << (5 + noise(4))) + noise(30);
            let rest = (1..16).map(|_| [0, 0, 1, -1][noise(4) as usize]);
            [first].into_iter().chain(rest).collect()
        };
        let blocks: Vec<_> = (0..600).map(|_| block()).collect();
        let mut writer = Writer::default();
        blocks.iter().for_each(|block| writer.block(block));
        assert_eq!(writer.finish().unwrap().0[0], 3);
    }
}
