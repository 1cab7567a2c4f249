//! The pixels that a relighter keeps: linear light, for figures, or codes, for canvases.

use std::fmt::Debug;
use std::ops::Range;

use crate::relight::OutputTransform;
use crate::relight::output_transform::TabulatedOutputTransform;
use crate::transport::{CHANNELS, CameraPixel};

/// Linear RGB, in units of the measurement.
pub type LinearPixel = [f32; CHANNELS];

/// RGBA after an output transform.
pub type EncodedPixel = [u8; 4];

/// A pixel as a relighter keeps it.
pub trait StoredPixel: Copy + Debug + Send + Sync {
    /// What turns linear pixels into these.
    type Encoder: Debug + Default + Send + Sync;
    /// A pixel without light.
    const DARK: Self;

    /// Where to compute the linear pixels of `stored`: in place, or in `scratch`.
    fn linear<'a>(
        stored: &'a mut [Self],
        scratch: &'a mut Vec<LinearPixel>,
    ) -> &'a mut [LinearPixel];

    /// Stores linear pixels that were computed in `scratch`. `spans` gives where each begins, and which ones are side by side.
    fn store(
        encoder: &Self::Encoder,
        scratch: &[LinearPixel],
        spans: impl Iterator<Item = (CameraPixel, Range<usize>)>,
        stored: &mut [Self],
    );
}

impl StoredPixel for LinearPixel {
    type Encoder = ();
    const DARK: Self = [0.0; CHANNELS];

    #[inline(always)]
    fn linear<'a>(stored: &'a mut [Self], _: &'a mut Vec<LinearPixel>) -> &'a mut [LinearPixel] {
        stored
    }

    fn store(
        (): &(),
        _: &[LinearPixel],
        _: impl Iterator<Item = (CameraPixel, Range<usize>)>,
        _: &mut [Self],
    ) {
    }
}

/// An output transform and its table.
#[derive(Debug)]
pub struct PixelEncoder {
    output: OutputTransform,
    table: TabulatedOutputTransform,
}

impl PixelEncoder {
    /// Replaces the encoder if `output` is another transform than before; gives whether it is.
    pub fn set(encoder: &mut Option<Self>, output: &OutputTransform) -> bool {
        let is_new = encoder.as_ref().is_none_or(|old| old.output != *output);
        if is_new {
            *encoder = Some(Self {
                output: *output,
                table: TabulatedOutputTransform::new(output),
            });
        }
        is_new
    }
}

impl StoredPixel for EncodedPixel {
    type Encoder = Option<PixelEncoder>;
    const DARK: Self = [0, 0, 0, 255];

    fn linear<'a>(
        stored: &'a mut [Self],
        scratch: &'a mut Vec<LinearPixel>,
    ) -> &'a mut [LinearPixel] {
        *scratch = vec![LinearPixel::DARK; stored.len()];
        scratch
    }

    #[inline(never)]
    fn store(
        encoder: &Option<PixelEncoder>,
        scratch: &[LinearPixel],
        spans: impl Iterator<Item = (CameraPixel, Range<usize>)>,
        stored: &mut [Self],
    ) {
        let Some(encoder) = encoder else { return };
        for (at, range) in spans {
            let stored = &mut stored[range.clone()];
            encoder.table.encode(&scratch[range], at, stored);
        }
    }
}
