//! Small light transports with arbitrary values, for the encoder.

use std::ops::RangeInclusive;

use relightable_photo::format::{
    DistortionMetric, EncodedFile, EncoderInput, EncodingTarget, FormatError, FormatExtension,
    Metadata,
};
use relightable_photo::job_executor::{Executor, SequentialExecutor};
use relightable_photo::transport::{
    Basis, CHANNELS, Correspondence, Decibels, Extent, FloatTile, Geometry, TileRect,
    TileTransportFunctions, Window,
};

use crate::choices::Choices;

/// Values for which arithmetic often fails.
const SPECIAL_VALUES: [f32; 16] = [
    0.0,
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::MAX,
    f32::MIN,
    f32::MIN_POSITIVE,
    -0.0,
    1e-45,
    -1e-40,
    1e-20,
    1e20,
    -3e38,
    1.0,
    -1.0,
    65504.0,
];
/// Magnitudes for which arithmetic does not fail.
const MODERATE_MAGNITUDES: RangeInclusive<f32> = 1e-4..=1e4;

/// A geometry of few tiles.
pub fn geometry(choices: &mut Choices<'_>) -> Geometry {
    let side = |choices: &mut Choices<'_>| 1 + u32::from(choices.below(40));
    let camera = Extent {
        width: side(choices),
        height: side(choices),
    };
    let tile_side = choices.of([8, 8, 9, 16, 32]);
    let window = choices.of([1, 3, 5, 7]);
    let offset = match choices.below(4) {
        // All windows lie on a light plane of 64 x 64 elements.
        0..=2 => 16.0,
        _ => choices.of([-30.0, 0.0, 60.0, 1e9, -1e300, f64::MAX]),
    };
    let [width, height] = match offset == 16.0 {
        true => [64; 2],
        false => [side(choices), side(choices)],
    };
    Geometry {
        camera,
        light: Extent { width, height },
        window: Window::new(window).expect("an odd side"),
        correspondence: Correspondence::from_affine([[0.5, 0.01, offset], [-0.02, 0.5, offset]]),
        tile_side,
    }
    .validate()
    .expect("all fields are in their ranges")
}

/// The geometry with as many rows as `slots` allows, at least one.
fn cropped(mut geometry: Geometry, slots: usize) -> Geometry {
    let slots_of_row = geometry.camera.width as usize * geometry.window.area();
    let rows = u32::try_from(slots / slots_of_row).unwrap_or(u32::MAX);
    geometry.camera.height = geometry.camera.height.min(rows.max(1));
    geometry
}

/// The input of the encoder.
pub struct ArbitraryInput {
    pub geometry: Geometry,
    pub basis: Option<Basis>,
    pub tiles: Vec<FloatTile>,
    pub metadata: Metadata,
    pub extensions: Vec<FormatExtension>,
    /// Whether all values are 0 or of moderate magnitude, and not all 0.
    pub is_moderate: bool,
}

impl std::fmt::Debug for ArbitraryInput {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let rank = self.basis.as_ref().map(Basis::rank);
        write!(
            f,
            "rank {rank:?}, moderate {}, {:?}",
            self.is_moderate, self.geometry
        )
    }
}

impl ArbitraryInput {
    /// Light transport of at most so many `slots` of windows.
    pub fn new(choices: &mut Choices<'_>, slots: usize) -> Self {
        let mut input = Self {
            geometry: cropped(geometry(choices), slots),
            basis: None,
            tiles: Vec::new(),
            metadata: Metadata::default(),
            extensions: Vec::new(),
            is_moderate: true,
        };
        let area = input.geometry.window.area();
        let rank = match choices.chance(192) {
            true => usize::from(choices.below(9)),
            false => 0,
        };
        if rank > 0 || choices.rarely() {
            let kernels = (0..rank).map(|_| input.values(choices, area)).collect();
            input.basis = Some(Basis { kernels });
        }
        for rect in input.geometry.tiles() {
            let tile = input.tile(choices, rect, rank, area);
            input.tiles.push(tile);
        }
        if choices.chance(32) {
            let text = choices.up_to(40);
            input.metadata.title = String::from_utf8_lossy(text).into_owned();
            input.metadata.shots_used = vec![choices.u32() as usize; choices.byte().into()];
        }
        if choices.chance(32) {
            input.extensions.push(FormatExtension {
                tag: choices.bytes(),
                must_understand: false,
                data: choices.fill(3),
            });
        }
        input
    }

    fn tile(
        &mut self,
        choices: &mut Choices<'_>,
        rect: TileRect,
        rank: usize,
        area: usize,
    ) -> FloatTile {
        let mut tile = FloatTile::dark(rect);
        let pixels = rect.extent.area();
        let parts = choices.below(8);
        let colours = |values: Vec<f32>| {
            let (colours, _) = values.as_chunks::<CHANNELS>();
            colours.to_vec()
        };
        if parts & 1 != 0 && rank > 0 {
            tile.coefficients = colours(self.values(choices, pixels * rank * CHANNELS));
        }
        if parts & 6 == 6 || parts & 3 == 2 {
            tile.functions = colours(self.values(choices, pixels * area * CHANNELS));
        }
        tile
    }

    /// `count` values from few decisions.
    fn values(&mut self, choices: &mut Choices<'_>, count: usize) -> Vec<f32> {
        let mut noise = choices.noise();
        let values: Vec<f32> = match choices.below(8) {
            0 => vec![choices.of(SPECIAL_VALUES); count],
            1 => {
                let pattern: [f32; 3] = std::array::from_fn(|_| choices.of(SPECIAL_VALUES));
                pattern.into_iter().cycle().take(count).collect()
            }
            // Noise of one magnitude.
            2 => {
                let magnitude = f32::from(choices.byte() as i8).exp2();
                (0..count).map(|_| noise.signed() * magnitude).collect()
            }
            // Arbitrary bits.
            3 => (0..count).map(|_| f32::from_bits(noise.next())).collect(),
            // Noise and one arbitrary value.
            4 => {
                let mut values: Vec<f32> = (0..count).map(|_| noise.signed()).collect();
                let at = usize::from(choices.u16()) % count;
                values[at] = match choices.chance(128) {
                    true => choices.f32(),
                    false => choices.of(SPECIAL_VALUES),
                };
                values
            }
            // Sparse.
            5 => (0..count)
                .map(|_| {
                    if noise.next() % 16 == 0 {
                        noise.signed()
                    } else {
                        0.0
                    }
                })
                .collect(),
            // Smooth.
            6 => {
                let (start, slope) = (noise.signed(), noise.signed() * 0.05);
                (0..count)
                    .map(|i| start + slope * (i % 64) as f32)
                    .collect()
            }
            _ => (0..count).map(|_| noise.signed()).collect(),
        };
        let is_moderate = |v: &f32| *v == 0.0 || MODERATE_MAGNITUDES.contains(&v.abs());
        self.is_moderate &= values
            .iter()
            .all(|v| is_moderate(v) || v.abs() < 1.0 && v.abs() > 1e-9);
        self.is_moderate &= values.iter().fold(0.0, |peak: f32, v| peak.max(v.abs())) != 0.0;
        values
    }

    pub fn encode(
        &self,
        target: EncodingTarget<'_>,
        executor: &impl Executor,
    ) -> Result<EncodedFile, FormatError> {
        let source = EncoderInput {
            geometry: self.geometry.clone(),
            basis: self.basis.as_ref(),
            tile: &|i| Ok(self.tiles[i].clone()),
            metadata: self.metadata.clone(),
            extensions: self.extensions.clone(),
        };
        EncodedFile::new(source, target, executor)
    }

    /// Light transport functions of tile `i`.
    pub fn functions(&self, i: usize) -> TileTransportFunctions {
        self.tiles[i].functions(&self.geometry, self.basis.as_ref())
    }

    /// The energy of tile `i`: of its coefficients and of its direct functions separately, as the encoder codes both
    /// even where they cancel.
    pub fn energy(&self, i: usize) -> f64 {
        let mut coefficients = self.tiles[i].clone();
        let functions = std::mem::take(&mut coefficients.functions);
        let factored = coefficients
            .functions(&self.geometry, self.basis.as_ref())
            .tau;
        let values = factored.iter().chain(&functions).flatten();
        values.map(|v| f64::from(*v).powi(2)).sum()
    }

    /// Whether all windows lie on the light plane.
    pub fn has_all_windows_on_plane(&self) -> bool {
        let side = i64::from(self.geometry.window.side());
        let fits = |at: i32, length: u32| at >= 0 && i64::from(at) + side <= length.into();
        self.geometry
            .tiles()
            .flat_map(TileRect::pixels)
            .all(|pixel| {
                let origin = self.geometry.window_origin(pixel);
                let light = self.geometry.light;
                fits(origin.u, light.width) && fits(origin.v, light.height)
            })
    }
}

/// An executor that runs jobs in reverse order.
#[derive(Debug)]
pub struct ReversedExecutor;

impl Executor for ReversedExecutor {
    fn map<T: Send>(&self, count: usize, work: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        let mut results: Vec<T> = (0..count).rev().map(work).collect();
        results.reverse();
        results
    }
}

/// A rate target, without the distortion metric.
#[derive(Clone, Copy, Debug)]
pub enum TargetChoice {
    Snr(Decibels),
    Bytes(u64),
    Lossless,
    Loss(Decibels),
}

impl TargetChoice {
    pub fn new(choices: &mut Choices<'_>) -> Self {
        match choices.below(8) {
            0 => Self::Lossless,
            1 => Self::Bytes(choices.u16().into()),
            2 => Self::Loss(Decibels(choices.of([0.1, 0.3, 3.0, 0.0, f64::NAN]))),
            3 => Self::Snr(Decibels(choices.f64())),
            _ => Self::Snr(Decibels(f64::from(choices.below(90)))),
        }
    }

    /// Slots of windows that are encoded in about two seconds with all checks of the fuzzer: a size takes ten attempts.
    pub fn max_slots(self) -> usize {
        match self {
            Self::Bytes(_) => 1_500,
            Self::Snr(_) | Self::Lossless | Self::Loss(_) => 8_000,
        }
    }

    /// Encodes `input`. A distortion metric returns `losses`, in hundredths of a decibel; 255 stands for NaN.
    ///
    /// # Errors
    /// The errors of the encoder.
    pub fn encode(self, input: &ArbitraryInput, losses: &[u8]) -> Result<EncodedFile, FormatError> {
        let metric = ArbitraryMetric {
            input,
            losses,
            calls: std::sync::atomic::AtomicUsize::new(0),
        };
        let target = match self {
            Self::Snr(snr) => EncodingTarget::Snr(snr),
            Self::Bytes(limit) => EncodingTarget::Bytes(limit),
            Self::Lossless => EncodingTarget::Lossless,
            Self::Loss(limit) => EncodingTarget::Loss(limit, &metric),
        };
        input.encode(target, &SequentialExecutor)
    }
}

/// A distortion metric with arbitrary results.
struct ArbitraryMetric<'a> {
    input: &'a ArbitraryInput,
    losses: &'a [u8],
    calls: std::sync::atomic::AtomicUsize,
}

impl DistortionMetric for ArbitraryMetric<'_> {
    fn tiles(&self) -> Vec<FloatTile> {
        let tiles = self.input.tiles.iter().step_by(3);
        tiles.take(3).cloned().collect()
    }

    fn loss(&self, functions: &[TileTransportFunctions]) -> Decibels {
        for (functions, tile) in functions.iter().zip(self.tiles()) {
            assert_eq!(functions.rect, tile.rect);
            let area = self.input.geometry.window.area();
            assert_eq!(functions.tau.len(), tile.rect.extent.area() * area);
        }
        let call = self
            .calls
            .fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        match self.losses.get(call).copied().unwrap_or(0) {
            255 => Decibels(f64::NAN),
            loss => Decibels(f64::from(loss) / 100.0),
        }
    }
}
