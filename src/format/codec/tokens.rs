//! Token strings: runs of small integers, mostly zero, as tokens, zstd frames and bits.
//!
//! A token is a byte `zeros · 16 + size`: the number of zeros before the next non-zero number, and the
//! number of bits of its magnitude. The sign and the bits below the highest are close to random and go
//! into a bit stream. `0` ends a run; `0xF0` stands for sixteen zeros.
//!
//! The distribution of a token depends on the token before it. A token string has one stream for all tokens or one for
//! each of three contexts: the first token of a run, a token after 0xF0 or a one-bit number, and any other.

use std::ops::Range;

use super::zstd_frame::{compress, compressed_bound, decompress};
use crate::format::chunk::EncodedChunk;
use crate::format::error::{FormatError, SectionError, damaged};
use crate::format::fields::FieldReader;
use crate::format::memory_budget::MemoryBudget;

/// Largest magnitude of a number.
pub const MAX_MAGNITUDE: i32 = (1 << 15) - 1;
const END_OF_RUN: u8 = 0;
const SIXTEEN_ZEROS: u8 = 0xF0;

/// Number of contexts.
pub const CONTEXTS: usize = 3;

/// The context of a token, by the token before it in its run.
fn context(before: Option<u8>) -> usize {
    match before {
        None => 0,
        Some(token) if token & 15 <= 1 => 1,
        Some(_) => 2,
    }
}

/// Maximum bytes of a string of `tokens` tokens, each with up to fifteen bits.
pub fn max_bytes(tokens: u64) -> u64 {
    let header = 1 + 8 * CONTEXTS as u64;
    header + CONTEXTS as u64 * compressed_bound(0) + compressed_bound(tokens) + 2 * tokens
}

/// A run of a codec, quantised. An item is a component or a slot.
#[derive(Debug)]
pub struct QuantisedRun<'a> {
    /// The token string that it belongs to: 0 main, 1 side.
    pub string: usize,
    pub first_item: usize,
    pub values_per_item: usize,
    pub values: &'a [f32],
    /// What quantisation leaves of the values.
    pub residuals: &'a [f32],
    pub numbers: &'a [i32],
}

/// Values that a codec writes as runs.
pub trait EncodableRuns {
    /// Calls `visit` with each run of `items`, quantised to `step`.
    fn for_runs(&self, items: Range<usize>, step: f32, visit: &mut dyn FnMut(QuantisedRun<'_>));
}

/// Bytes of the token strings of `items` of some tiles, as if they were one.
///
/// # Errors
/// [`FormatError::Compress`].
pub fn compressed_bytes<'a>(
    tiles: impl Iterator<Item = &'a dyn EncodableRuns>,
    items: Range<usize>,
    step: f32,
) -> Result<usize, FormatError> {
    let mut tiles = tiles.peekable();
    if tiles.peek().is_none() {
        return Ok(0);
    }
    let mut strings = [TokenWriter::default(), TokenWriter::default()];
    for runs in tiles {
        runs.for_runs(items.clone(), step, &mut |run| {
            strings[run.string].write_run(run.numbers);
        });
    }
    let [main, side] = strings.map(TokenWriter::finish);
    Ok(main?.bytes.len() + side?.bytes.len())
}

/// Calls `visit` with the tokens of a run: the index of the number that each ends at, its context, the token
/// and the number, clipped to [`MAX_MAGNITUDE`], or 0.
pub fn for_tokens(run: &[i32], mut visit: impl FnMut(usize, usize, u8, i32)) {
    let (mut before, mut zeros) = (None, 0);
    let mut put = |at: usize, token: u8, number: i32| {
        visit(at, context(before), token, number);
        before = Some(token);
    };
    for (at, &number) in run.iter().enumerate() {
        if number == 0 {
            zeros += 1;
            continue;
        }
        while zeros > 15 {
            put(at, SIXTEEN_ZEROS, 0);
            zeros -= 16;
        }
        let number = number.clamp(-MAX_MAGNITUDE, MAX_MAGNITUDE);
        let size = u32::BITS - number.unsigned_abs().leading_zeros();
        put(at, (zeros << 4 | size) as u8, number);
        zeros = 0;
    }
    if zeros > 0 {
        put(run.len() - zeros as usize, END_OF_RUN, 0);
    }
}

/// Writes runs into a token string.
#[derive(Debug, Default)]
pub struct TokenWriter {
    /// All tokens, and the same by context: the shorter is written.
    tokens: Vec<u8>,
    streams: [Vec<u8>; CONTEXTS],
    bits: Vec<u8>,
    /// Bits not yet in `bits`, the first one lowest.
    pending: u32,
    pending_count: u32,
}

impl TokenWriter {
    /// Writes one run; magnitudes are clipped to [`MAX_MAGNITUDE`].
    pub fn write_run(&mut self, run: &[i32]) {
        for_tokens(run, |_, context, token, number| {
            self.tokens.push(token);
            self.streams[context].push(token);
            let size = u32::from(token & 15);
            if size == 0 {
                return;
            }
            let below_highest = number.unsigned_abs() ^ 1 << (size - 1);
            self.pending |= (below_highest << 1 | u32::from(number < 0)) << self.pending_count;
            self.pending_count += size;
            while self.pending_count >= 8 {
                self.bits.push(self.pending as u8);
                self.pending >>= 8;
                self.pending_count -= 8;
            }
        });
    }

    /// The token string.
    ///
    /// # Errors
    /// [`FormatError::Compress`].
    pub fn finish(mut self) -> Result<EncodedChunk, FormatError> {
        if self.pending_count > 0 {
            self.bits.push(self.pending as u8);
        }
        let content_bytes = self.tokens.len() as u32; // a chunk has less than 2^23
        let (three, one) = (pack(&self.streams)?, pack(&[self.tokens])?);
        let mut bytes = match one.len() <= three.len() {
            true => one,
            false => three,
        };
        bytes.extend(self.bits);
        Ok(EncodedChunk {
            bytes,
            content_bytes,
        })
    }
}

/// The number of streams, the numbers of tokens and bytes of each, and their frames.
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

/// Reads runs from a token string.
#[derive(Debug)]
pub struct EntropyTokenReader<'a> {
    streams: [Vec<u8>; CONTEXTS],
    /// Index of the next token of each stream.
    next: [usize; CONTEXTS],
    has_contexts: bool,
    bits: std::slice::Iter<'a, u8>,
    /// Bits taken from `bits`, the next one lowest.
    pending: u32,
    pending_count: u32,
}

impl<'a> EntropyTokenReader<'a> {
    /// Decompresses the tokens of a string, at most `max_tokens`.
    ///
    /// # Errors
    /// [`SectionError`] if the string is damaged, or the budget refuses memory.
    pub fn new(
        bytes: &'a [u8],
        max_tokens: usize,
        budget: &MemoryBudget,
    ) -> Result<Self, SectionError> {
        let mut fields = FieldReader(bytes);
        let count = match fields.try_bytes(1) {
            Some([1]) => 1,
            Some([3]) => CONTEXTS,
            _ => return Err(damaged("it does not have one or three token streams")),
        };
        let mut lengths = [[0; 2]; CONTEXTS];
        for length in lengths[..count].as_flattened_mut() {
            *length = fields.try_length().ok_or_else(too_short)?;
        }
        let tokens: u64 = lengths.iter().map(|[tokens, _]| *tokens as u64).sum();
        if tokens > max_tokens as u64 {
            return Err(damaged("it has more tokens than its entry says"));
        }
        let mut streams = [const { Vec::new() }; CONTEXTS];
        for (stream, [tokens, frame]) in streams.iter_mut().zip(lengths) {
            let frame = fields.try_bytes(frame).ok_or_else(too_short)?;
            if !frame.is_empty() || tokens > 0 {
                *stream = decompress(frame, tokens, budget)?;
            }
        }
        Ok(Self {
            streams,
            next: [0; CONTEXTS],
            has_contexts: count > 1,
            bits: fields.0.iter(),
            pending: 0,
            pending_count: 0,
        })
    }

    /// Number of tokens.
    pub fn tokens(&self) -> usize {
        self.streams.iter().map(Vec::len).sum()
    }

    /// Reads a run into `run`, which is all zero. Returns one past the index of its last non-zero number.
    ///
    /// # Errors
    /// [`SectionError`] if tokens or bits are missing or invalid.
    pub fn read_run(&mut self, run: &mut [i32]) -> Result<usize, SectionError> {
        let (mut at, mut end, mut before) = (0, 0, None);
        while at < run.len() {
            let stream = if self.has_contexts {
                context(before)
            } else {
                0
            };
            let next = &mut self.next[stream];
            let &token = self.streams[stream].get(*next).ok_or_else(too_short)?;
            *next += 1;
            before = Some(token);
            match token {
                END_OF_RUN => break,
                SIXTEEN_ZEROS => at += 16,
                token => {
                    at += usize::from(token >> 4);
                    let size = u32::from(token & 15);
                    if size == 0 || at >= run.len() {
                        return Err(damaged("it has an invalid token"));
                    }
                    let bits = self.take_bits(size)?;
                    let magnitude = (1 << (size - 1) | bits >> 1) as i32;
                    run[at] = if bits & 1 == 0 { magnitude } else { -magnitude };
                    at += 1;
                    end = at;
                }
            }
        }
        Ok(end)
    }

    fn take_bits(&mut self, count: u32) -> Result<u32, SectionError> {
        while self.pending_count < count {
            let &byte = self.bits.next().ok_or_else(too_short)?;
            self.pending |= u32::from(byte) << self.pending_count;
            self.pending_count += 8;
        }
        let bits = self.pending & ((1 << count) - 1);
        self.pending >>= count;
        self.pending_count -= count;
        Ok(bits)
    }

    /// Checks that all tokens and bits have been read.
    ///
    /// # Errors
    /// [`SectionError`] if some are left.
    pub fn finish(mut self) -> Result<(), SectionError> {
        let read = self.next.iter().sum::<usize>() == self.tokens();
        match read && self.bits.next().is_none() && self.pending == 0 {
            true => Ok(()),
            false => Err(damaged("it has bytes after its last run")),
        }
    }
}

fn too_short() -> SectionError {
    damaged("it is shorter than it says")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn round_trip(runs: &[Vec<i32>]) {
        let mut writer = TokenWriter::default();
        runs.iter().for_each(|run| writer.write_run(run));
        let chunk = writer.finish().unwrap();
        let (bytes, tokens) = (chunk.bytes, chunk.content_bytes);
        assert!(bytes.len() as u64 <= max_bytes(tokens.into()));
        let read = |bytes: &[u8]| {
            let mut reader =
                EntropyTokenReader::new(bytes, tokens as usize, &MemoryBudget::unlimited())?;
            assert_eq!(reader.tokens(), tokens as usize);
            for run in runs {
                let mut read = vec![0; run.len()];
                let end = reader.read_run(&mut read)?;
                assert_eq!(&read, run);
                let last = run.iter().rposition(|&n| n != 0);
                assert_eq!(end, last.map_or(0, |at| at + 1));
            }
            reader.finish()
        };
        read(&bytes).unwrap();
        for length in 0..bytes.len() {
            assert!(read(&bytes[..length]).is_err());
        }
        assert!(read(&[&bytes[..], &[0]].concat()).is_err());
        assert!(
            EntropyTokenReader::new(&bytes, tokens as usize - 1, &MemoryBudget::unlimited())
                .is_err()
        );
    }

    fn sparse(every: usize, length: usize) -> Vec<i32> {
        let number = |i: usize| ((i * 7919) % 31) as i32 - 15;
        let at = |i: usize| {
            if i.is_multiple_of(every) {
                number(i)
            } else {
                0
            }
        };
        (0..length).map(at).collect()
    }

    #[test]
    fn runs_are_read_as_written() {
        round_trip(&[
            vec![0; 64],
            sparse(1, 64),
            sparse(3, 64),
            sparse(17, 225),
            vec![0; 5],
        ]);
        round_trip(&[
            vec![MAX_MAGNITUDE, -MAX_MAGNITUDE, 1, -1, 0, 0, 2],
            [vec![0; 63], vec![-3]].concat(),
        ]);
        round_trip(&[[vec![0; 32], vec![1], vec![0; 16]].concat()]);
    }

    #[test]
    fn many_tokens_get_a_stream_for_each_context() {
        let mut state = 1u32;
        let mut noise = |below: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((state >> 8) % below) as i32
        };
        let mut run = || -> Vec<i32> {
            let first = (1 << (5 + noise(4))) + noise(30);
            let rest = (1..16).map(|_| [0, 0, 1, -1][noise(4) as usize]);
            [first].into_iter().chain(rest).collect()
        };
        let runs: Vec<_> = (0..600).map(|_| run()).collect();
        let mut writer = TokenWriter::default();
        runs.iter().for_each(|run| writer.write_run(run));
        assert_eq!(writer.finish().unwrap().bytes[0], 3);
    }
}
