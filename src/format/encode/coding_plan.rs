//! The coding plan: all that the encoder decides about a file, from a sample of its tiles. Tiles are then encoded one by one,
//! in any order and on any machine.

use std::io;
use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::assembly::{
    EncodedFile, HALVES_ERROR_RATIO, RoundedBasis, TileChunks, add_errors, chunk_entry,
    lossless_scans, set_snrs,
};
use super::basis_rotation::BasisRotation;
use super::encoder_input::EncodingTarget;
use super::rate_control::RateController;
use super::rate_control_sample::SampledTilePart;
use super::scan_costs::RateDistortionModel;
use super::scan_plan;
use super::source_analysis::{AnalysedSource, SourceStatistics, energy, in_batches, peak};
use crate::format::chunk::ChunkEntry;
use crate::format::chunk_store::ChunkStore;
use crate::format::codec::direct_functions;
use crate::format::error::FormatError;
use crate::format::memory_budget::MemoryBudget;
use crate::format::metadata::{Metadata, MetadataText};
use crate::format::scan::ProgressiveScan;
use crate::job_executor::Executor;
use crate::transport::{Basis, CHANNELS, FloatTile, Geometry};

/// Largest value that is expected, relative to the largest in the sample, and to what the camera can measure under one light
/// element. Steps are so coarse that their numbers reach as far.
const SAMPLE_PEAK_RATIO: f32 = 32.0;
const MEASURED_PEAK_RATIO: f32 = 4.0;
/// At least this ratio of a value to the largest in the sample can be coded.
const MIN_SAMPLE_PEAK_RATIO: f32 = 8.0;
/// The step of a sample without light, relative to the largest value that is expected.
const UNLIT_STEP_RATIO: f32 = 1.0 / 4096.0;

/// A sample of a picture's tiles.
pub struct TileSample<'a> {
    /// Grids, window, correspondence and the file's tiling.
    pub geometry: &'a Geometry,
    /// The basis of the coefficients, if a tile of the picture has any.
    pub basis: Option<&'a Basis>,
    /// Parts of the picture of any size, spread evenly.
    pub tiles: Vec<FloatTile>,
    /// Whether tiles of the picture may have direct functions.
    pub may_have_functions: bool,
    /// The brightest that the camera can measure, in units of the measurements.
    pub max_measurement: f32,
}

/// The rotation to the file's basis, and the scans. Serialised, it encodes the same tiles in another process.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct CodingPlan {
    scans: Vec<ProgressiveScan>,
    /// The rotation to all components, of which the first `rank` are coded; `None` if there are no coefficients.
    rotation: Option<BasisRotation>,
    rank: usize,
    basis: Option<RoundedBasis>,
    has_functions: bool,
}

/// A tile as it is in the file.
#[derive(Clone, Debug)]
pub struct EncodedTile {
    /// What the file's index needs of it.
    pub head: EncodedTileHead,
    /// `[scan]`; empty if all values are zero.
    pub chunks: Vec<Vec<u8>>,
}

/// What the file's index needs of a tile.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EncodedTileHead {
    /// Lengths and checksums of the chunks, `[scan]`.
    pub entries: Vec<ChunkEntry>,
    /// Sum of squared values.
    pub signal: f64,
    /// Squared error after each scan.
    pub errors: Vec<f64>,
    /// Whether a value is larger than the plan's numbers reach: far above all of the sample. Components that the plan leaves
    /// out do not count.
    pub is_clipped: bool,
}

impl CodingPlan {
    /// Plans a file of this quality. The result does not depend on the number of threads.
    ///
    /// # Errors
    /// [`FormatError::InvalidGeometry`], [`FormatError::TooMany`] basis functions, [`FormatError::Compress`].
    ///
    /// # Panics
    /// If a tile or a basis function does not have the length that geometry and basis give it, and for
    /// [`EncodingTarget::Bytes`]: only the whole file has a size.
    pub fn new(
        sample: TileSample<'_>,
        target: EncodingTarget<'_>,
        executor: &impl Executor,
    ) -> Result<Self, FormatError> {
        assert!(!matches!(target, EncodingTarget::Bytes(_)));
        let TileSample {
            geometry,
            basis,
            tiles,
            may_have_functions,
            max_measurement,
        } = sample;
        let mut analysed = AnalysedSource::unlit(geometry, basis, executor)?;
        let pixels: usize = tiles.iter().map(|tile| tile.rect.extent.area()).sum();
        let weight = geometry.camera.area() as f64 / pixels.max(1) as f64;
        let (rank, area) = (basis.map_or(0, Basis::rank), geometry.window.area());
        let mut sums = SourceStatistics::default();
        for tile in &tiles {
            sums.add(&SourceStatistics::of_tile(tile, rank, area));
        }
        sums.scale(weight);
        analysed.set_statistics(&sums);
        // Without coefficients in the sample, those of other tiles are expanded.
        analysed.has_functions |=
            may_have_functions || basis.is_some() && analysed.rotation.is_none();
        let rotated = |tile| SampledTilePart {
            tile: analysed.rotated(tile),
            weight,
        };
        let parts: Vec<SampledTilePart> = tiles.into_iter().map(rotated).collect();
        let components = analysed.rank();
        let component_peak = |k: usize| {
            let coefficients = parts.iter().flat_map(|part| &part.tile.coefficients);
            let of_component = coefficients.skip(k).step_by(components);
            expected_peak(peak(of_component), max_measurement)
        };
        let peaks: Vec<f32> = (0..components).map(component_peak).collect();
        analysed.coefficient_peak = peaks.iter().copied().fold(0.0, f32::max);
        analysed.expected_peaks = Some(peaks);
        let functions = parts.iter().flat_map(|part| &part.tile.functions);
        analysed.function_peak = expected_peak(peak(functions), max_measurement);
        let whole = analysed.rotation.clone();
        let mut controller = RateController {
            analysed,
            sample: parts,
        };
        let (scans, error) = plan_scans(&mut controller, target)?;
        let analysed = &controller.analysed;
        let rotation = analysed.rotation.as_ref();
        let dropped = analysed.coefficient_energy - rotation.map_or(0.0, BasisRotation::energy);
        let basis = rotation.map(|rotation| RoundedBasis::new(rotation, error + dropped.max(0.0)));
        Ok(Self {
            scans,
            rank: analysed.rank(),
            rotation: whole,
            basis,
            has_functions: analysed.has_functions,
        })
    }

    /// Number of scans.
    pub fn scans(&self) -> usize {
        self.scans.len()
    }

    /// Squared coefficients of a tile over all components, `[component]`.
    fn energies(&self, coefficients: &[[f32; CHANNELS]]) -> Vec<f64> {
        let components = self.rotation.as_ref().map_or(0, BasisRotation::rank);
        let mut energies = vec![0.0; components];
        for pixel in coefficients.chunks_exact(components.max(1)) {
            for (sum, value) in energies.iter_mut().zip(pixel) {
                *sum += energy(value);
            }
        }
        energies
    }
}

/// The largest magnitude that is expected of values whose largest in the sample is `peak`.
fn expected_peak(peak: f32, max_measurement: f32) -> f32 {
    let measured = MEASURED_PEAK_RATIO * max_measurement;
    match peak > 0.0 {
        true => (SAMPLE_PEAK_RATIO * peak)
            .min(measured)
            .max(MIN_SAMPLE_PEAK_RATIO * peak),
        false => measured,
    }
}

/// The scans for a target, and the squared error after the last.
fn plan_scans(
    controller: &mut RateController<'_, impl Executor>,
    target: EncodingTarget<'_>,
) -> Result<(Vec<ProgressiveScan>, f64), FormatError> {
    if let EncodingTarget::Lossless = target {
        let analysed = &controller.analysed;
        let error = HALVES_ERROR_RATIO * analysed.energy;
        return Ok((lossless_scans(analysed), error));
    }
    let Some(step) = controller.step(target)? else {
        let peak = controller.analysed.function_peak;
        let scans = scan_plan::trial(&controller.analysed, UNLIT_STEP_RATIO * peak);
        return Ok((scans, 0.0));
    };
    let expected = controller.drop_weak_components(step);
    let model = RateDistortionModel::of_squares(&controller.analysed, &controller.sample);
    let scans = controller.plan(&model, step, expected.error, 1.0)?.scans;
    let error = controller.error_of(&scans).error;
    Ok((scans, error))
}

/// Encodes the tiles of a file by its plan.
pub struct TileEncoder<'a> {
    plan: &'a CodingPlan,
    geometry: &'a Geometry,
    basis: Option<&'a Basis>,
    /// The centre-out order of slots.
    order: Vec<u16>,
}

impl<'a> TileEncoder<'a> {
    /// For the file of this `geometry`; `basis` is that of the plan's sample.
    ///
    /// # Errors
    /// [`FormatError::Memory`].
    pub fn new(
        plan: &'a CodingPlan,
        geometry: &'a Geometry,
        basis: Option<&'a Basis>,
    ) -> Result<Self, FormatError> {
        let budget = MemoryBudget::unlimited();
        Ok(Self {
            plan,
            geometry,
            basis,
            order: direct_functions::centre_out_order(geometry.window, &budget)?,
        })
    }

    /// Encodes a tile of the file, with coefficients over the basis.
    ///
    /// # Errors
    /// [`FormatError::Compress`].
    pub fn encode(&self, mut tile: FloatTile) -> Result<EncodedTile, FormatError> {
        let plan = self.plan;
        if let Some(rotation) = &plan.rotation {
            tile.coefficients = rotation.coefficients(&tile);
        } else if !tile.coefficients.is_empty() {
            tile = tile.functions(self.geometry, self.basis).into();
        }
        let energies = plan.energies(&tile.coefficients);
        // What the plan leaves out is an error of every scan.
        let (mut signal, mut missing): (f64, f64) =
            (energies.iter().sum(), energies[plan.rank..].iter().sum());
        let function_energy = energy(tile.functions.as_flattened());
        signal += function_energy;
        if !plan.has_functions {
            missing += function_energy;
            tile.functions.clear();
        }
        let TileChunks {
            chunks,
            mut errors,
            is_clipped,
        } = TileChunks::new(&tile, plan.rank, &self.order, &plan.scans)?;
        errors.iter_mut().for_each(|error| *error += missing);
        if let Some(basis) = &plan.basis {
            add_errors(&mut errors, &basis.errors(&energies, &plan.scans));
        }
        Ok(EncodedTile {
            head: EncodedTileHead {
                entries: chunks.iter().map(chunk_entry).collect(),
                signal,
                errors,
                is_clipped,
            },
            chunks: chunks.into_iter().map(|chunk| chunk.bytes).collect(),
        })
    }

    /// Encodes these `tiles`, which `tile` gives, and gives them to `take` in order.
    ///
    /// # Errors
    /// [`FormatError::Source`] if a tile cannot be read, [`FormatError::Compress`], and those of `take`.
    pub fn encode_each<E: From<FormatError>>(
        &self,
        tiles: Range<usize>,
        tile: impl Fn(usize) -> io::Result<FloatTile> + Sync + Send,
        executor: &impl Executor,
        take: impl FnMut(usize, EncodedTile) -> Result<(), E>,
    ) -> Result<(), E> {
        let encode = |i| self.encode(tile(i).map_err(FormatError::Source)?);
        in_batches(tiles, executor, encode, take)
    }
}

impl EncodedTileHead {
    /// That of a tile whose values are all zero.
    pub fn dark(plan: &CodingPlan) -> Self {
        Self {
            entries: vec![ChunkEntry::default(); plan.scans()],
            signal: 0.0,
            errors: vec![0.0; plan.scans()],
            is_clipped: false,
        }
    }

    /// Whether it has an entry and an error for each scan of a plan.
    pub fn is_of(&self, plan: &CodingPlan) -> bool {
        self.entries.len() == plan.scans() && self.errors.len() == plan.scans()
    }
}

impl<S: ChunkStore> EncodedFile<S> {
    /// A file of tiles that are encoded by `plan`; `heads` are those of all tiles of `geometry`, row by row, and `store` has
    /// their chunks already.
    ///
    /// # Errors
    /// Those of `store`, [`FormatError::Compress`], and those of writing metadata.
    ///
    /// # Panics
    /// If there are not as many, or if one is of another plan.
    pub fn of_tiles<'a>(
        plan: &CodingPlan,
        geometry: Geometry,
        heads: impl Iterator<Item = &'a EncodedTileHead>,
        mut store: S,
        metadata: &Metadata,
    ) -> Result<Self, FormatError> {
        let tiles = geometry.tile_grid().area();
        let mut scans = plan.scans.clone();
        let mut entries = vec![ChunkEntry::default(); scans.len() * tiles];
        let (mut signal, mut errors) = (0.0, vec![0.0; scans.len()]);
        let (mut count, mut clipped_tiles) = (0, 0);
        for head in heads {
            assert!(head.is_of(plan) && count < tiles, "a tile of the plan");
            for (scan, entry) in head.entries.iter().enumerate() {
                entries[scan * tiles + count] = *entry;
            }
            signal += head.signal;
            add_errors(&mut errors, &head.errors);
            count += 1;
            clipped_tiles += usize::from(head.is_clipped);
        }
        assert_eq!(count, tiles, "a head for each tile");
        if let Some(basis) = &plan.basis {
            basis.put_chunks(&geometry, &mut scans, &mut store)?;
        }
        set_snrs(&mut scans, signal, &errors);
        let metadata = MetadataText::encode(metadata)?;
        let file = Self::indexed(geometry, scans, entries, Vec::new(), metadata, store)?;
        Ok(Self {
            clipped_tiles,
            ..file
        })
    }
}
