//! The side of the Fourier transforms and of the origin blocks.
//!
//! A transform of side `n` correlates a block of `(n + 1 - w)²` window origins with a window of side `w`. A larger
//! `n` spends less of its work on elements that blocks share, but takes more memory.

use crate::transport::CHANNELS;

/// Sides to choose from. The largest holds a window of 63 and as many origins again, three times over.
const FFT_SIDES: [usize; 4] = [32, 64, 128, 256];

/// Bytes of the basis's spectra and of a block's basis response. Both should stay in the CPU's cache.
const MAX_CACHED_BYTES: u64 = 16 << 20;

/// The side of transforms with the least work over `columns × rows` window origins, among those within the memory
/// limit; the smallest side that holds the window where none is.
pub fn fft_side(rank: usize, window: usize, columns: usize, rows: usize) -> usize {
    let block_side = |n: usize| (n + 1).saturating_sub(window) as u64;
    let bytes = |n: usize| {
        let values = (n * n) as u64 + CHANNELS as u64 * block_side(n).pow(2);
        values * rank as u64 * size_of::<f32>() as u64
    };
    let work = |n: usize| {
        let blocks =
            (columns as u64).div_ceil(block_side(n)) * (rows as u64).div_ceil(block_side(n));
        blocks.saturating_mul((n * n) as u64 * u64::from(n.ilog2()))
    };
    let mut possible = FFT_SIDES.into_iter().filter(|n| block_side(*n) > 0);
    let smallest = possible.next().unwrap_or(FFT_SIDES[FFT_SIDES.len() - 1]);
    let larger = possible.filter(|n| bytes(*n) <= MAX_CACHED_BYTES);
    larger.fold(
        smallest,
        |best, n| if work(n) < work(best) { n } else { best },
    )
}

/// The smallest block side that covers each span with no more blocks than `max_side` does.
pub fn even_block_side(max_side: usize, spans: [usize; 2]) -> usize {
    let even = |span: usize| span.div_ceil(span.div_ceil(max_side).max(1));
    spans.map(even).into_iter().fold(1, usize::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_take_little_work_and_memory() {
        assert_eq!(fft_side(16, 15, 270, 270), 64);
        assert_eq!(fft_side(16, 15, 12, 12), 32);
        // With a side of 64, blocks of two origins a side would take 2^32 operations.
        assert_eq!(fft_side(9, 63, 838, 836), 256);
        for rank in [1, 1024] {
            for window in (1..=63).step_by(2) {
                let n = fft_side(rank, window, 32_768 + window, 32_768 + window);
                assert!(n >= window);
                assert!(rank == 1 || n <= 64, "{window}: {n}");
            }
        }
    }
}
