//! Recovery of a light transport matrix, tile by tile, by any of the methods.

use serde::{Deserialize, Serialize};

use super::common_mode_weight::CommonModeWeight;
use super::error::RecoverError;
use super::holdout_split::HoldoutSplit;
use super::holdout_validation::HoldoutValidation;
use super::learned::LearnedRecovery;
use super::mean_function;
use super::method::Method;
use super::pattern_check;
use super::photometry::{
    self, CalibratedMeasurements, Flicker, FloodShortfall, PhotographCorrection, PhotographFault,
    Photometry, ResampledPhotographs, ResponseHypothesis,
};
use super::pixelwise::PixelwiseRecovery;
use super::preparation_input::{self, RecoveryPreparationInput};
use super::sampling::{self, MIN_PATTERNS};
use crate::capture::Measurements;
use crate::job_executor::Executor;
#[cfg(not(target_arch = "wasm32"))]
use crate::transport::CHANNELS;
use crate::transport::{Basis, FloatTile, Geometry, TileRect, Window};

/// The same as [`PreparedRecovery::response`], for measurements that no recovery can be prepared from: their photographs
/// hardly follow from their patterns.
///
/// # Errors
/// If the geometry is out of range, if the photographs are dark or overexposed, and if the executor is cancelled.
pub async fn find_response(
    measurements: &Measurements,
    window: Window,
    flood_white: f64,
    executor: &impl Executor,
) -> Result<Vec<ResponseHypothesis>, RecoverError> {
    let geometry = preparation_input::geometry(measurements, window)?;
    let split = HoldoutSplit::new(&measurements.patterns);
    let preparation = RecoveryPreparationInput {
        measurements: &CalibratedMeasurements::uncorrected(measurements),
        geometry: geometry.clone(),
        split: &split,
        executor,
    };
    let mean = mean_function::mean_function(&preparation).await?;
    let mean = mean_function::smooth(&mean, window.side() as usize);
    Ok(photometry::find_response(
        measurements,
        &geometry,
        &mean,
        &split.all,
        flood_white,
        executor,
    )?)
}

/// Root mean square shift, in camera pixels, that costs accuracy although it is corrected.
const MIN_TREMBLING: f64 = 0.05;

/// Memory for the functions of sampled squares: of wide windows there are fewer squares, but at least so many.
#[cfg(not(target_arch = "wasm32"))]
const MAX_SAMPLE_BYTES: usize = 48 << 20;
#[cfg(not(target_arch = "wasm32"))]
const MIN_SAMPLED_SQUARES: usize = 8;

/// The options of a recovery.
#[derive(Clone, Copy, Debug)]
pub struct RecoverySettings {
    /// How light transport functions are recovered.
    pub method: Method,
    /// The light elements around a pixel's correspondence that may light it.
    pub window: Window,
    /// Whether shifts between photographs are estimated and corrected.
    pub is_registered: bool,
}

/// A recovery that is ready to run. All that depends on the measurements as a whole has been learned or chosen; tiles
/// can then be recovered one by one, in any order. Serialised, without its validation, it recovers the same tiles in
/// another process.
#[derive(Debug, Serialize, Deserialize)]
pub struct PreparedRecovery {
    geometry: Geometry,
    split: HoldoutSplit,
    photometry: Photometry,
    solver: TileSolver,
    /// Not needed to recover tiles elsewhere; [`restore`](Self::restore) gives it back.
    #[serde(skip)]
    holdout_validation: Option<HoldoutValidation>,
}

#[derive(Debug, Serialize, Deserialize)]
enum TileSolver {
    Learned(Box<LearnedRecovery>),
    Pixelwise(PixelwiseRecovery),
}

impl PreparedRecovery {
    /// Learns and chooses from `measurements` what the method needs. Of large pictures, only some pixels have to be loaded:
    /// the same that [`preparation_pixels`](super::preparation_pixels) lists are used in any case.
    ///
    /// # Errors
    /// If there are too few patterns, if the geometry is out of range or no pixel sees the light plane, if the
    /// photographs are dark, overexposed or do not match their patterns, and if the executor is cancelled.
    pub async fn prepare(
        measurements: &Measurements,
        settings: RecoverySettings,
        executor: &impl Executor,
    ) -> Result<Self, RecoverError> {
        let geometry = preparation_input::geometry(measurements, settings.window)?;
        let patterns = measurements.patterns.len();
        if patterns < MIN_PATTERNS {
            return Err(RecoverError::TooFewPatterns(patterns));
        }
        let split = HoldoutSplit::new(&measurements.patterns);
        let preparation = RecoveryPreparationInput {
            measurements: &CalibratedMeasurements::uncorrected(measurements),
            geometry: geometry.clone(),
            split: &split,
            executor,
        };
        let mut mean = mean_function::mean_function(&preparation).await?;
        let photometry = photometry::estimate(&preparation, &mean, settings.is_registered).await?;
        let is_left_out = |l: usize| photometry.faults.iter().any(|fault| fault.0 == l);
        let split = HoldoutSplit::without(&measurements.patterns, is_left_out);
        let input = photometry.resampling_input(measurements, &geometry, &split.all);
        let resampled = ResampledPhotographs::of_picture(input);
        let preparation = RecoveryPreparationInput {
            measurements: &input.calibrated(resampled.as_ref()),
            split: &split,
            ..preparation
        };
        if photometry.has_changes() {
            mean = mean_function::mean_function(&preparation).await?;
        }
        pattern_check::check_patterns(&preparation, &mean).await?;
        let solver = match settings.method {
            Method::Learned => {
                TileSolver::Learned(Box::new(LearnedRecovery::new(&preparation, &mean).await?))
            }
            Method::Nnls => {
                TileSolver::Pixelwise(PixelwiseRecovery::least_squares(&preparation).await?)
            }
            Method::Bpdn(basis) => {
                TileSolver::Pixelwise(PixelwiseRecovery::denoising(&preparation, basis).await?)
            }
        };
        let mut recovery = Self {
            geometry: geometry.clone(),
            split: split.clone(),
            photometry: photometry.clone(),
            solver,
            holdout_validation: None,
        };
        let measurements = preparation.measurements;
        let training_tile = |rect: TileRect| match &recovery.solver {
            TileSolver::Learned(learned) => learned.training_tile(measurements, &split, rect),
            TileSolver::Pixelwise(solver) => {
                FloatTile::from(solver.tile(measurements, &split.training, rect))
            }
        };
        recovery.holdout_validation =
            HoldoutValidation::new(&preparation, recovery.basis(), training_tile).await?;
        Ok(recovery)
    }

    /// Grids, window and tiling of the result.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// The basis functions that factored tiles share, if there are such tiles.
    pub fn basis(&self) -> Option<&Basis> {
        match &self.solver {
            TileSolver::Learned(learned) => Some(learned.basis()),
            TileSolver::Pixelwise(_) => None,
        }
    }

    /// The weight of the patterns' common mode in least squares or denoising, if tiles depend on either.
    pub fn common_mode(&self) -> Option<CommonModeWeight> {
        match &self.solver {
            TileSolver::Learned(learned) => learned.common_mode(),
            TileSolver::Pixelwise(solver) => Some(solver.common_mode),
        }
    }

    /// Whether tiles may be direct.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn may_have_functions(&self) -> bool {
        match &self.solver {
            TileSolver::Learned(learned) => learned.common_mode().is_some(),
            TileSolver::Pixelwise(_) => true,
        }
    }

    /// Corrections of the photographs, one for each; none at all if no photograph needs one.
    pub fn corrections(&self) -> &[PhotographCorrection] {
        &self.photometry.corrections
    }

    /// Root mean square of the shifts between the photographs that are used, in camera pixels; `None` if none is worth a
    /// warning.
    pub fn trembling(&self) -> Option<f64> {
        let shifts = self
            .split
            .all
            .iter()
            .filter_map(|&l| self.photometry.corrections.get(l));
        let squares = shifts.map(|correction| {
            let [x, y] = correction.shift;
            x * x + y * y
        });
        let shift = (squares.sum::<f64>() / self.split.all.len() as f64).sqrt();
        (shift > MIN_TREMBLING).then_some(shift)
    }

    /// The photographs that are left out, by their indices in the measurements, with the fault that each looks like.
    pub fn faults(&self) -> &[(usize, PhotographFault)] {
        &self.photometry.faults
    }

    /// Why the flood photograph is darker than the patterns predict. `None` if it is not, or if there is no such photograph.
    /// `measurements` are those that the recovery was prepared from, and `flood_white` the one at which the flood
    /// photograph is white.
    pub fn flood_shortfall(
        &self,
        measurements: &Measurements,
        flood_white: f64,
        executor: &impl Executor,
    ) -> Option<FloodShortfall> {
        let used = &self.split.all;
        let input = (self.photometry).resampling_input(measurements, &self.geometry, used);
        photometry::find_flood_shortfall(input, flood_white, executor)
    }

    /// Bands of exposure that differ from photograph to photograph, as lamps that flicker cause. `None` if there are none, or
    /// too little is measured to tell. `measurements` are those that the recovery was prepared from.
    pub fn flicker(
        &self,
        measurements: &Measurements,
        executor: &impl Executor,
    ) -> Option<Flicker> {
        let used = &self.split.all;
        let input = (self.photometry).resampling_input(measurements, &self.geometry, used);
        photometry::find_flicker(input, executor)
    }

    /// Responses of display or camera with which the photographs predict one another better than with the declared one, the
    /// best first. Empty if there is none, or too little is measured to tell. `measurements` are those that the recovery was
    /// prepared from.
    ///
    /// # Errors
    /// Those of [`find_response`].
    pub async fn response(
        &self,
        measurements: &Measurements,
        flood_white: f64,
        executor: &impl Executor,
    ) -> Result<Vec<ResponseHypothesis>, RecoverError> {
        let mean_function = &self.photometry.mean_function;
        // Photometry found the photographs too different from what their patterns predict.
        if mean_function.is_empty() {
            let window = self.geometry.window;
            return find_response(measurements, window, flood_white, executor).await;
        }
        let used = &self.split.all;
        let found = photometry::find_response(
            measurements,
            &self.geometry,
            mean_function,
            used,
            flood_white,
            executor,
        );
        Ok(found?)
    }

    /// The validation on held-out patterns; `None` if there are too few patterns to hold any out.
    pub fn holdout_validation(&self) -> Option<&HoldoutValidation> {
        self.holdout_validation.as_ref()
    }

    /// Gives back what a recovery was serialised without: its validation, and the photographs that are left out with their
    /// [faults](Self::faults).
    pub fn restore(
        &mut self,
        validation: Option<HoldoutValidation>,
        faults: Vec<(usize, PhotographFault)>,
    ) {
        self.holdout_validation = validation;
        self.photometry.faults = faults;
    }

    /// Distance from a tile, in camera pixels, of the measurements that the tile depends on.
    pub fn halo(&self) -> u32 {
        let has_shifts = self.photometry.corrections.iter().any(|c| c.is_shifted());
        self.solver_halo() + if has_shifts { photometry::HALO } else { 0 }
    }

    fn solver_halo(&self) -> u32 {
        match &self.solver {
            TileSolver::Learned(learned) => learned.halo(),
            TileSolver::Pixelwise(_) => 0,
        }
    }

    /// Upper estimate of the memory that [`sample_tiles`](Self::sample_tiles) and a plan of a file from them take, in bytes:
    /// their functions twice.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn sample_bytes(window: Window) -> usize {
        let pixels = super::learned::REGION_SIDE_PX.pow(2) as usize;
        let square = pixels * window.area() * CHANNELS * size_of::<f32>();
        let all = super::learned::MAX_REGIONS * square;
        2 * all.min(MAX_SAMPLE_BYTES.max(MIN_SAMPLED_SQUARES * square))
    }

    /// Recovers squares of the picture, spread evenly, from all patterns. `measurements` are those that the recovery was
    /// prepared from. A basis that is rotated to the squares' own axes suits others less: they are not those of the
    /// [validation](Self::holdout_validation), if there is a basis.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn sample_tiles(
        &self,
        measurements: &Measurements,
        executor: &impl Executor,
    ) -> Vec<FloatTile> {
        let camera = self.geometry.camera;
        let mut squares = match &self.solver {
            TileSolver::Learned(_) => super::learned::sample_regions(camera),
            TileSolver::Pixelwise(_) => super::holdout_validation::sample_squares(camera),
        };
        let values = match self.may_have_functions() {
            true => self.geometry.window.area(),
            false => self.basis().map_or(0, Basis::rank),
        };
        let square = squares.first().map_or(0, |square| square.extent.area());
        let bytes = square * values * CHANNELS * size_of::<f32>();
        squares.truncate((MAX_SAMPLE_BYTES / bytes.max(1)).max(MIN_SAMPLED_SQUARES));
        executor.map(squares.len(), |i| self.tile(measurements, squares[i]))
    }

    /// Recovers one tile. `measurements` are those that the recovery was prepared from, or other pixels of the same
    /// capture: they cover the tile and [`halo`](Self::halo) rows around it, within the picture.
    pub fn tile(&self, measurements: &Measurements, rect: TileRect) -> FloatTile {
        let used = &self.split.all;
        let input = (self.photometry).resampling_input(measurements, &self.geometry, used);
        let region = sampling::with_margin(measurements.camera, rect, self.solver_halo());
        let resampled = ResampledPhotographs::of_region(input, region);
        let measurements = &input.calibrated(resampled.as_ref());
        match &self.solver {
            TileSolver::Learned(learned) => learned.tile(measurements, &self.split, rect),
            TileSolver::Pixelwise(solver) => {
                FloatTile::from(solver.tile(measurements, &self.split.all, rect))
            }
        }
    }
}
