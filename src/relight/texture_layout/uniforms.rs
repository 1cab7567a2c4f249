//! The shaders' uniforms, field by field as in the WGSL.

use super::{MAX_SLOTS, TextureLayout};
use crate::relight::{LightChroma, OutputTransform, ToneCurve};
use crate::transport::{Basis, CHANNELS, TEXEL_COMPONENTS};

/// `BasisFunctionUniforms` of the WGSL: a pair of quads of basis functions, slot by slot.
pub type BasisFunctionUniforms = [[[f32; TEXEL_COMPONENTS]; 2]; MAX_SLOTS];

/// `FrameUniforms` of the WGSL.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct FrameUniforms {
    output_matrix: [[f32; 4]; CHANNELS],
    chroma: [f32; 4],
    base_channel: [f32; 4],
    window: i32,
    tile_side: i32,
    used_quads: i32,
    coefficient_stride: i32,
    response_stride: i32,
    filmic: i32,
    dither: i32,
    padding: i32,
}

impl TextureLayout {
    /// `ChannelUniforms` of the WGSL for each channel.
    pub const CHANNEL_WEIGHTS: [[f32; 4]; CHANNELS] = [
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
    ];

    /// The basis, pair by pair.
    pub fn basis_uniforms(&self, basis: &Basis) -> Vec<BasisFunctionUniforms> {
        let pair = |functions: &[Vec<f32>]| {
            let mut pair = [[[0.0; TEXEL_COMPONENTS]; 2]; MAX_SLOTS];
            for (k, function) in functions.iter().enumerate() {
                for (slot, value) in pair.iter_mut().zip(function) {
                    slot[k / TEXEL_COMPONENTS][k % TEXEL_COMPONENTS] = *value;
                }
            }
            pair
        };
        let pairs = basis.kernels.chunks(2 * TEXEL_COMPONENTS);
        let count = self.quad_pairs() as usize;
        pairs.take(count).map(pair).collect()
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
        FrameUniforms {
            output_matrix: output.gamut_matrix().map(|[r, g, b]| [r, g, b, 0.0]),
            chroma: [r, g, b, 0.0],
            base_channel: Self::CHANNEL_WEIGHTS[chroma.channels()[0]],
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
