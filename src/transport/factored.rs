//! Tiles whose light transport functions are combinations of a few shared ones.

use super::{CHANNELS, Geometry, TileRect, TransportFunctions};

/// Light transport functions that others are combined from: `τ_n ≈ Σ_k c_nk v_k`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Basis {
    /// `v_k` as `[rank, element]`, window rows (v) then columns (u), the most important first.
    pub kernels: Vec<Vec<f32>>,
}

impl Basis {
    /// Number of functions, `r`.
    pub fn rank(&self) -> usize {
        self.kernels.len()
    }
}

/// A tile kept as coefficients over a [`Basis`].
#[derive(Clone, Debug, PartialEq)]
pub struct FactoredTile {
    /// The pixels covered.
    pub rect: TileRect,
    /// `c_nk` as `[pixel, component, channel]`, pixels row by row; in units of the measurement.
    pub coefficients: Vec<[f32; CHANNELS]>,
}

impl FactoredTile {
    /// The light transport functions themselves: elements off the display send nothing, and what
    /// the combination leaves below zero is zero.
    pub fn expand(&self, geometry: &Geometry, basis: &Basis) -> TransportFunctions {
        let (area, rank) = (geometry.window.area(), basis.rank());
        let mut functions = TransportFunctions::zeros(self.rect, area);
        for (p, pixel) in self.rect.pixels().enumerate() {
            let origin = geometry.window_origin(pixel);
            let tau = &mut functions.tau[p * area..(p + 1) * area];
            let coefficients = &self.coefficients[p * rank..(p + 1) * rank];
            for (c, kernel) in coefficients.iter().zip(&basis.kernels) {
                for (tau, v) in tau.iter_mut().zip(kernel) {
                    for channel in 0..CHANNELS {
                        tau[channel] += c[channel] * v;
                    }
                }
            }
            for (slot, tau) in tau.iter_mut().enumerate() {
                let element = geometry.window.element(origin, slot);
                *tau = match element.index_in(geometry.light) {
                    Some(_) => tau.map(|t| t.max(0.0)),
                    None => [0.0; CHANNELS],
                };
            }
        }
        functions
    }
}

/// A tile as a solver yields it.
#[derive(Clone, Debug)]
pub enum RecoveredTile {
    /// Every element of every function.
    Direct(TransportFunctions),
    /// Coefficients over the basis that goes with the whole transport.
    Factored(FactoredTile),
}

impl RecoveredTile {
    /// The light transport functions themselves.
    pub fn functions(self, geometry: &Geometry, basis: Option<&Basis>) -> TransportFunctions {
        match (self, basis) {
            (Self::Direct(functions), _) => functions,
            (Self::Factored(tile), Some(basis)) => tile.expand(geometry, basis),
            (Self::Factored(tile), None) => {
                TransportFunctions::zeros(tile.rect, geometry.window.area())
            }
        }
    }
}
