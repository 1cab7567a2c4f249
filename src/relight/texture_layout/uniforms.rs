//! The shaders' uniforms, field by field as in the WGSL, and the passes that read them.

use super::{MAX_SLOTS, TextureLayout};
use crate::relight::{LightChroma, OutputTransform, ToneCurve};
use crate::transport::{Basis, CHANNELS, QUAD};

/// `BasisUniforms` of the WGSL: a pair of quads of basis functions, slot by slot.
pub type BasisUniforms = [[[f32; QUAD]; 2]; MAX_SLOTS];

/// `FrameUniforms` of the WGSL.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct FrameUniforms {
    output_matrix: [[f32; 4]; CHANNELS],
    chroma: [f32; 4],
    window: i32,
    tile_side: i32,
    used_quads: i32,
    coefficient_stride: i32,
    response_stride: i32,
    filmic: i32,
    dither: i32,
    padding: i32,
}

/// `DispatchUniforms` of the WGSL.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct DispatchUniforms {
    channel: [f32; 4],
    layer: i32,
    padding: [i32; 3],
}

/// A pass of WebGL2 that fills two layers of the basis response.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CorrelationPass {
    /// The light's channel.
    pub channel: usize,
    /// The pair of quads.
    pub pair: usize,
    /// The first of the two layers.
    pub layer: u32,
}

impl TextureLayout {
    /// `ChannelUniforms` of the WGSL for each channel.
    pub const CHANNEL_WEIGHTS: [[f32; 4]; CHANNELS] = [
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
    ];

    /// The basis, pair by pair.
    pub fn basis_uniforms(&self, basis: &Basis) -> Vec<BasisUniforms> {
        let pair = |functions: &[Vec<f32>]| {
            let mut pair = [[[0.0; QUAD]; 2]; MAX_SLOTS];
            for (k, function) in functions.iter().enumerate() {
                for (slot, value) in pair.iter_mut().zip(function) {
                    slot[k / QUAD][k % QUAD] = *value;
                }
            }
            pair
        };
        let pairs = basis.kernels.chunks(2 * QUAD);
        let count = self.quad_pairs() as usize;
        pairs.take(count).map(pair).collect()
    }

    /// The uniforms of each dispatch of WebGPU, pair by pair: for a light of uniform chroma with that base channel, and
    /// with any for a light of varying chroma.
    pub fn dispatch_uniforms(&self, channel: usize) -> impl Iterator<Item = DispatchUniforms> {
        (0..self.quad_pairs() as i32).map(move |pair| DispatchUniforms {
            channel: Self::CHANNEL_WEIGHTS[channel],
            layer: 2 * pair,
            padding: [0; 3],
        })
    }

    /// The passes of WebGL2 for a light.
    pub fn correlation_passes(&self, chroma: LightChroma, quality: f32) -> Vec<CorrelationPass> {
        let channels = (0..).zip(chroma.channels());
        let (pairs, used) = (self.quad_pairs(), self.used_quad_pairs(quality));
        let passes = channels.flat_map(|(i, &channel)| {
            (0..used).map(move |pair| CorrelationPass {
                channel,
                pair,
                layer: 2 * (i * pairs + pair as u32),
            })
        });
        passes.collect()
    }

    /// The uniforms of a frame.
    pub fn frame_uniforms(
        &self,
        chroma: LightChroma,
        output: &OutputTransform,
        quality: f32,
    ) -> FrameUniforms {
        let (response_stride, [r, g, b]) = match chroma {
            LightChroma::Uniform { factors, .. } => (0, factors),
            LightChroma::Varying => (2 * self.quad_pairs() as i32, [1.0; CHANNELS]),
        };
        let [red, green, blue] = output.gains;
        let row = |row: [f32; CHANNELS]| [row[0] * red, row[1] * green, row[2] * blue, 0.0];
        FrameUniforms {
            output_matrix: output.gamut.from_srgb().map(row),
            chroma: [r, g, b, 0.0],
            window: self.geometry.window.side() as i32,
            tile_side: self.geometry.tile_side as i32,
            used_quads: self.used_quads(quality) as i32,
            coefficient_stride: self.quads as i32,
            response_stride,
            filmic: (output.curve == ToneCurve::Filmic).into(),
            dither: output.dither.into(),
            padding: 0,
        }
    }
}
