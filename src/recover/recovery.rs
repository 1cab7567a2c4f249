//! Recovery of a whole transport, tile by tile, by any of the methods.

use std::fmt::Write;

use serde::Serialize;
use thiserror::Error;

use super::holdout::HoldoutSplit;
use super::holdout_validation::HoldoutValidation;
use super::learned::LearnedRecovery;
use super::pixelwise::PixelwiseRecovery;
use super::pooled;
use super::{CommonMode, MIN_PATTERNS, SparsityBasis};
use crate::capture::Measurements;
use crate::executor::{Cancelled, Executor};
use crate::transport::{Basis, Geometry, GeometryError, RecoveredTile, TileRect, Window};

/// How light transport functions are recovered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(into = "&'static str")]
pub enum Method {
    /// A Gaussian prior learned from the measurements themselves, and the posterior under it; blended
    /// with least squares in tiles where a blend predicts patterns held out better.
    Learned,
    /// Non-negative least squares, each pixel and channel on its own (paper, section 3, case (a)).
    Nnls,
    /// Basis pursuit denoising: of all functions that explain a pixel's measurements to within noise
    /// the sparsest in this basis (paper, section 3, case (b)).
    Bpdn(SparsityBasis),
}

impl From<Method> for &'static str {
    fn from(method: Method) -> Self {
        method.name()
    }
}

impl Method {
    /// Every method there is.
    pub const ALL: &[Self] = &[
        Self::Learned,
        Self::Nnls,
        Self::Bpdn(SparsityBasis::Identity),
        Self::Bpdn(SparsityBasis::Dct),
        Self::Bpdn(SparsityBasis::Haar),
    ];

    /// About the most memory that preparing a recovery takes beside the measurements, in bytes.
    pub fn preparation_bytes(self, window: Window) -> usize {
        let own = match self {
            Self::Learned => LearnedRecovery::preparation_bytes(window),
            Self::Nnls | Self::Bpdn(_) => 0,
        };
        own.max(pooled::bytes(window))
    }

    /// About the most memory that recovering one tile takes beside the measurements and the tile's
    /// functions, in bytes.
    pub fn tile_bytes(self, window: Window, patterns: usize) -> usize {
        let direct = PixelwiseRecovery::tile_bytes(window, patterns);
        match self {
            // Tiles may be blended with least squares.
            Self::Learned => direct.max(LearnedRecovery::tile_bytes(window)),
            Self::Nnls | Self::Bpdn(_) => direct,
        }
    }

    /// The most components that tiles may be combined from.
    pub fn max_rank(self, window: Window) -> usize {
        match self {
            Self::Learned => LearnedRecovery::max_rank(window),
            Self::Nnls | Self::Bpdn(_) => 0,
        }
    }

    /// The most camera pixels around a tile whose measurements may go into it.
    pub fn max_halo(self) -> u32 {
        match self {
            Self::Learned => LearnedRecovery::MAX_HALO,
            Self::Nnls | Self::Bpdn(_) => 0,
        }
    }

    /// The basis of [`Bpdn`](Self::Bpdn).
    pub fn basis(self) -> Option<SparsityBasis> {
        match self {
            Self::Bpdn(basis) => Some(basis),
            Self::Learned | Self::Nnls => None,
        }
    }

    /// The name by which options, reports and files call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Learned => "learned",
            Self::Nnls => "nnls",
            Self::Bpdn(_) => "bpdn",
        }
    }
}

/// What is asked of a recovery.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// How.
    pub method: Method,
    /// What a camera pixel may see.
    pub window: Window,
}

/// Why a recovery cannot start.
#[derive(Debug, Error)]
pub enum RecoverError {
    /// Too few patterns.
    #[error(
        "{0} patterns are too few; recovery needs at least {MIN_PATTERNS}, and about 80 to be good"
    )]
    TooFewPatterns(usize),
    /// The window does not fit.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// The correspondence misses the display.
    #[error(
        "no camera pixel looks at the light plane; check \"correspondence\" and \"light\" in the capture's manifest"
    )]
    CorrespondenceOffLightPlane,
    /// Nothing in the photographs stands out of their noise.
    #[error(
        "the photographs show no light from the display; check \"camera.black\", the exposure, and that photographs are listed with the patterns they show"
    )]
    NoSignal,
    /// Patterns do not tell what photographs show.
    #[error(
        "what the photographs show does not follow from the patterns; check that each is listed with the pattern it shows, \"correspondence\" in the capture's manifest, and the exposure"
    )]
    UncorrelatedPatterns,
    /// Some patterns do not tell what their photographs show, as others do: which, among the
    /// measurements'.
    #[error("what the photographs of {} of the patterns show is not of them", .0.len())]
    MismatchedPatterns(Vec<usize>),
    /// No pixel looked at can be learned from.
    #[error(
        "too many pixels are saturated in too many photographs; photograph with less exposure, or add shots with less (\"exposure\" in capture.json)"
    )]
    Overexposed,
    /// The caller cancelled the recovery.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// The crc32c of what is written.
struct Checksum(u32);

impl Write for Checksum {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        self.0 = crc32c::crc32c_append(self.0, text.as_bytes());
        Ok(())
    }
}

/// A recovery ready to run: what has been learned or chosen from the measurements as a whole, by
/// which tiles can then be recovered one by one, in any order.
#[derive(Debug)]
pub struct Recovery {
    geometry: Geometry,
    solver: Solver,
    holdout_validation: Option<HoldoutValidation>,
}

#[derive(Debug)]
enum Solver {
    Learned(Box<LearnedRecovery>),
    Direct(PixelwiseRecovery),
}

impl Recovery {
    /// Learns and chooses from `measurements` whatever the method asks for. They may hold strips of
    /// the picture instead of all of it, and are then looked at where tiles are
    /// [covered](Measurements::covers).
    pub fn prepare(
        measurements: &Measurements,
        settings: Settings,
        executor: &impl Executor,
    ) -> Result<Self, RecoverError> {
        let geometry = Geometry {
            camera: measurements.camera,
            light: measurements.light,
            window: settings.window,
            correspondence: measurements.correspondence,
            tile_side: Geometry::DEFAULT_TILE_SIDE,
        }
        .validate()?;
        if measurements.patterns.len() < MIN_PATTERNS {
            return Err(RecoverError::TooFewPatterns(measurements.patterns.len()));
        }
        let split = HoldoutSplit::new(measurements);
        let mean = pooled::mean_function(measurements, &geometry, &split, executor)?;
        let solver = match settings.method {
            Method::Learned => {
                let learned =
                    LearnedRecovery::new(measurements, geometry, split.clone(), &mean, executor)?;
                Solver::Learned(Box::new(learned))
            }
            Method::Nnls => Solver::Direct(PixelwiseRecovery::least_squares(
                measurements,
                geometry,
                &split,
                executor,
            )?),
            Method::Bpdn(basis) => Solver::Direct(PixelwiseRecovery::denoising(
                measurements,
                geometry,
                basis,
                &split,
                executor,
            )?),
        };
        let mut recovery = Self {
            geometry,
            solver,
            holdout_validation: None,
        };
        let training_tile = |rect: TileRect| match &recovery.solver {
            Solver::Learned(learned) => learned.training_tile(measurements, rect),
            Solver::Direct(direct) => {
                RecoveredTile::Direct(direct.tile_from(measurements, &split.training, rect))
            }
        };
        let setting = (&geometry, recovery.basis());
        recovery.holdout_validation =
            HoldoutValidation::new(measurements, setting, &split, executor, training_tile)?;
        Ok(recovery)
    }

    /// Grids, band and tiling of the answer.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// Tells one preparation from another: tiles are of one file only if these are equal.
    pub fn fingerprint(&self) -> u32 {
        // All of it as text, in which numbers are exact.
        let mut sum = Checksum(0);
        let written = write!(sum, "{:?} {:?}", self.geometry, self.solver);
        debug_assert!(written.is_ok(), "a checksum takes everything");
        sum.0
    }

    /// The functions that factored tiles are combined from, if there are such tiles.
    pub fn basis(&self) -> Option<&Basis> {
        match &self.solver {
            Solver::Learned(learned) => Some(learned.basis()),
            Solver::Direct(_) => None,
        }
    }

    /// Weight that least squares or denoising gives the patterns' common mode, where either goes into
    /// the answer.
    pub fn common_mode(&self) -> Option<CommonMode> {
        match &self.solver {
            Solver::Learned(learned) => learned.common_mode(),
            Solver::Direct(direct) => Some(direct.common_mode()),
        }
    }

    /// How well it does on patterns held out; none where there are too few to hold any out.
    pub fn holdout_validation(&self) -> Option<&HoldoutValidation> {
        self.holdout_validation.as_ref()
    }

    /// Camera pixels around a tile whose measurements go into it.
    pub fn halo(&self) -> u32 {
        match &self.solver {
            Solver::Learned(learned) => learned.halo(),
            Solver::Direct(_) => 0,
        }
    }

    /// Recovers one tile. `measurements` are those the recovery was prepared from, or other rows of
    /// the same: they cover the tile and [`halo`](Self::halo) rows around it, as far as there are any.
    pub fn tile(&self, measurements: &Measurements, rect: TileRect) -> RecoveredTile {
        match &self.solver {
            Solver::Learned(learned) => learned.tile(measurements, rect),
            Solver::Direct(direct) => RecoveredTile::Direct(direct.tile(measurements, rect)),
        }
    }
}
