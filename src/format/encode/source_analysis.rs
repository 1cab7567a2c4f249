//! The encoder's view of a source: the rotated basis, energies and peaks, from one pass over all tiles or from a sample.

use std::ops::Range;

use super::basis_rotation::{BasisRotation, coefficient_moments};
use super::encoder_input::EncoderInput;
use crate::format::codec::{direct_functions, transform};
use crate::format::constants::MAX_RANK;
use crate::format::error::FormatError;
use crate::format::memory_budget::MemoryBudget;
use crate::job_executor::Executor;
use crate::transport::{Basis, CHANNELS, FloatTile, Geometry};

/// Number of tiles that are encoded at a time.
const BATCH_TILES: usize = 64;

/// A source whose tiles have been analysed.
pub struct AnalysedSource<'a, E> {
    pub geometry: &'a Geometry,
    /// The basis of the source's coefficients.
    pub basis: Option<&'a Basis>,
    pub executor: &'a E,
    /// The rotation to the file's basis; `None` if there are no coefficients.
    pub rotation: Option<BasisRotation>,
    pub has_functions: bool,
    /// Sum of squared coefficients over the orthonormal basis and of squared direct functions.
    pub energy: f64,
    pub coefficient_energy: f64,
    /// Largest magnitude of an input coefficient, and of a value of a direct function.
    pub coefficient_peak: f32,
    pub function_peak: f32,
    /// The centre-out order of slots.
    pub order: Vec<u16>,
    /// Numbers of the tiles that are not dark.
    pub lit_tiles: Vec<usize>,
    /// If the statistics are a sample's: the largest magnitudes that are expected in the picture, `[component]`.
    pub expected_peaks: Option<Vec<f32>>,
}

/// Sums and peaks of tiles.
#[derive(Default)]
pub struct SourceStatistics {
    /// Of coefficients, `[rank, rank]`.
    pub moments: Vec<f64>,
    pub function_energy: f64,
    pub coefficient_peak: f32,
    pub function_peak: f32,
}

impl SourceStatistics {
    /// Those of one tile with coefficients over `rank` functions of `area` slots.
    ///
    /// # Panics
    /// If the tile has the wrong length.
    pub fn of_tile(tile: &FloatTile, rank: usize, area: usize) -> Self {
        let pixels = tile.rect.extent.area();
        let fits = |length: usize, columns: usize| length == 0 || length == pixels * columns;
        assert!(
            fits(tile.coefficients.len(), rank) && fits(tile.functions.len(), area),
            "a value for each pixel and component or slot"
        );
        Self {
            moments: coefficient_moments(tile, rank),
            function_energy: energy(tile.functions.as_flattened()),
            coefficient_peak: peak(tile.coefficients.iter()),
            function_peak: peak(tile.functions.iter()),
        }
    }

    /// Multiplies the sums: those of a sample, by the number of pixels that each of its pixels stands for.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn scale(&mut self, factor: f64) {
        self.moments.iter_mut().for_each(|m| *m *= factor);
        self.function_energy *= factor;
    }

    /// Adds those of another tile.
    pub fn add(&mut self, tile: &Self) {
        self.moments.resize(tile.moments.len(), 0.0);
        for (sum, m) in self.moments.iter_mut().zip(&tile.moments) {
            *sum += m;
        }
        self.function_energy += tile.function_energy;
        self.coefficient_peak = self.coefficient_peak.max(tile.coefficient_peak);
        self.function_peak = self.function_peak.max(tile.function_peak);
    }
}

/// The values, if there are some.
pub fn non_empty<T>(values: &[T]) -> Option<&[T]> {
    (!values.is_empty()).then_some(values)
}

/// Sum of squares of the finite values.
pub fn energy(values: &[f32]) -> f64 {
    let finite = values.iter().filter(|v| v.is_finite());
    finite.map(|v| f64::from(*v).powi(2)).sum()
}

/// Largest magnitude of the finite values.
pub fn peak<'a>(values: impl Iterator<Item = &'a [f32; CHANNELS]>) -> f32 {
    let finite = values.flatten().filter(|v| v.is_finite());
    finite.fold(0.0, |peak, v| peak.max(v.abs()))
}

impl<'a, E: Executor> AnalysedSource<'a, E> {
    /// Analyses all tiles of a source.
    ///
    /// # Errors
    /// Those of [`unlit`](Self::unlit), and [`FormatError::Source`] if a tile cannot be read.
    ///
    /// # Panics
    /// If a tile or a basis function has the wrong length.
    pub fn new(source: &'a EncoderInput<'a>, executor: &'a E) -> Result<Self, FormatError> {
        let mut analysed = Self::unlit(&source.geometry, source.basis, executor)?;
        let (rank, area) = (
            source.basis.map_or(0, Basis::rank),
            source.geometry.window.area(),
        );
        let mut sums = SourceStatistics::default();
        let analyse = |tile: FloatTile| SourceStatistics::of_tile(&tile, rank, area);
        let lit_tiles = &mut analysed.lit_tiles;
        for_tiles(source, executor, analyse, |i, tile| {
            if tile.coefficient_peak.max(tile.function_peak) > 0.0 {
                lit_tiles.push(i);
            }
            sums.add(&tile);
            Ok(())
        })?;
        analysed.set_statistics(&sums);
        Ok(analysed)
    }

    /// A source without light.
    ///
    /// # Errors
    /// [`FormatError::InvalidGeometry`], and [`FormatError::TooMany`] basis functions.
    ///
    /// # Panics
    /// If a basis function has the wrong length.
    pub fn unlit(
        geometry: &'a Geometry,
        basis: Option<&'a Basis>,
        executor: &'a E,
    ) -> Result<Self, FormatError> {
        geometry.check().map_err(FormatError::InvalidGeometry)?;
        let rank = basis.map_or(0, Basis::rank);
        if rank > usize::from(MAX_RANK) {
            return Err(FormatError::TooMany {
                quantity: "basis functions",
                value: rank as u32,
                limit: MAX_RANK.into(),
            });
        }
        if let Some(basis) = basis {
            let area = geometry.window.area();
            let fits = basis.kernels.iter().all(|kernel| kernel.len() == area);
            assert!(fits, "basis functions of the window's area");
        }
        let order = direct_functions::centre_out_order(geometry.window, &MemoryBudget::unlimited());
        Ok(Self {
            geometry,
            basis,
            executor,
            rotation: None,
            has_functions: false,
            energy: 0.0,
            coefficient_energy: 0.0,
            coefficient_peak: 0.0,
            function_peak: 0.0,
            order: order?,
            lit_tiles: Vec::new(),
            expected_peaks: None,
        })
    }

    /// Rotates the basis, and takes energies and peaks.
    pub fn set_statistics(&mut self, sums: &SourceStatistics) {
        let basis = self
            .basis
            .filter(|_| sums.moments.iter().any(|m| *m != 0.0));
        self.rotation = basis.and_then(|basis| BasisRotation::new(basis, &sums.moments));
        self.coefficient_energy = self.rotation.as_ref().map_or(0.0, BasisRotation::energy);
        self.energy = self.coefficient_energy + sums.function_energy;
        self.has_functions = sums.function_energy > 0.0;
        self.coefficient_peak = sums.coefficient_peak;
        self.function_peak = sums.function_peak;
    }

    /// Number of components of the file.
    pub fn rank(&self) -> usize {
        self.rotation.as_ref().map_or(0, BasisRotation::rank)
    }

    /// Number of slots that scans of direct functions cover: all, or none.
    pub fn slots(&self) -> usize {
        usize::from(self.has_functions) * self.order.len()
    }

    /// The tile over the file's basis, without functions if the file has none.
    pub fn rotated(&self, mut tile: FloatTile) -> FloatTile {
        let rotation = self.rotation.as_ref();
        tile.coefficients = rotation.map_or(Vec::new(), |r| r.coefficients(&tile));
        if !self.has_functions {
            tile.functions.clear();
        }
        tile
    }

    /// The finest step of component `k` whose numbers do not overflow: from the largest coefficient there can
    /// be, or from the component's whole energy.
    pub fn finest_step(&self, k: usize) -> f32 {
        self.rotation.as_ref().map_or(0.0, |rotation| {
            if let Some(peaks) = &self.expected_peaks {
                return transform::finest_step(peaks[k], f64::INFINITY);
            }
            let peak = f64::from(self.coefficient_peak) * rotation.gain(k);
            let padding = transform::padding_factor(self.geometry);
            transform::finest_step(peak as f32, padding * rotation.energies[k])
        })
    }
}

/// Reads each tile, works on it, and takes the results in order.
///
/// # Errors
/// [`FormatError::Source`] if a tile cannot be read, and the errors of `take`.
pub fn for_tiles<T: Send>(
    source: &EncoderInput<'_>,
    executor: &impl Executor,
    work: impl Fn(FloatTile) -> T + Sync + Send,
    take: impl FnMut(usize, T) -> Result<(), FormatError>,
) -> Result<(), FormatError> {
    let tiles = 0..source.geometry.tile_grid().area();
    let work = |i| (source.tile)(i).map(&work).map_err(FormatError::Source);
    in_batches(tiles, executor, work, take)
}

/// Works on each of some `tiles`, and takes the results in order.
///
/// # Errors
/// Those of `work` and `take`.
pub fn in_batches<T: Send, E: From<FormatError>>(
    tiles: Range<usize>,
    executor: &impl Executor,
    work: impl Fn(usize) -> Result<T, FormatError> + Sync + Send,
    mut take: impl FnMut(usize, T) -> Result<(), E>,
) -> Result<(), E> {
    for first in tiles.clone().step_by(BATCH_TILES) {
        let count = BATCH_TILES.min(tiles.end - first);
        let results = executor.map(count, |i| work(first + i));
        for (i, result) in results.into_iter().enumerate() {
            take(first + i, result?)?;
        }
    }
    Ok(())
}
