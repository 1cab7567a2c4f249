//! Small transports of any values at all, to encode.

use std::ops::RangeInclusive;

use relightable_photo::executor::{Executor, SequentialExecutor};
use relightable_photo::format::{
    DistortionMetric, EncodedFile, Extension, FormatError, Metadata, RateTarget, Source,
};
use relightable_photo::transport::{
    BandTile, Basis, CHANNELS, Correspondence, Decibels, Extent, Geometry, TileRect,
    TransportFunctions, Window,
};

use crate::choices::Choices;

/// Numbers that arithmetic stumbles over.
const ODD: [f32; 16] = [
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
/// Magnitudes of numbers that nothing stumbles over.
const TAME: RangeInclusive<f32> = 1e-4..=1e4;

/// Grids of a few tiles.
pub fn geometry(choices: &mut Choices<'_>) -> Geometry {
    let side = |choices: &mut Choices<'_>| 1 + u32::from(choices.below(40));
    let camera = Extent {
        width: side(choices),
        height: side(choices),
    };
    let tile_side = choices.of([8, 8, 9, 16, 32]);
    let window = choices.of([1, 3, 5, 7]);
    let offset = match choices.below(4) {
        // Wholly on a display of 64 by 64 elements.
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
        correspondence: Correspondence {
            affine: [[0.5, 0.01, offset], [-0.02, 0.5, offset]],
        },
        tile_side,
    }
    .validate()
    .expect("all of it is in range")
}

/// What is to be encoded, and how.
pub struct Given {
    pub geometry: Geometry,
    pub basis: Option<Basis>,
    pub tiles: Vec<BandTile>,
    pub metadata: Metadata,
    pub extensions: Vec<Extension>,
    /// All numbers are zero or about as large as numbers are, and so is the range they span.
    pub tame: bool,
}

impl std::fmt::Debug for Given {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let rank = self.basis.as_ref().map(Basis::rank);
        write!(f, "rank {rank:?}, tame {}, {:?}", self.tame, self.geometry)
    }
}

impl Given {
    pub fn new(choices: &mut Choices<'_>) -> Self {
        let mut given = Self {
            geometry: geometry(choices),
            basis: None,
            tiles: Vec::new(),
            metadata: Metadata::default(),
            extensions: Vec::new(),
            tame: true,
        };
        let area = given.geometry.window.area();
        let rank = match choices.chance(192) {
            true => usize::from(choices.below(9)),
            false => 0,
        };
        if rank > 0 || choices.rarely() {
            let kernels = (0..rank).map(|_| given.numbers(choices, area)).collect();
            given.basis = Some(Basis { kernels });
        }
        for rect in given.geometry.tiles() {
            let tile = given.tile(choices, rect, rank, area);
            given.tiles.push(tile);
        }
        if choices.chance(32) {
            let text = choices.up_to(40);
            given.metadata.title = String::from_utf8_lossy(text).into_owned();
            given.metadata.shots_used = vec![choices.u32() as usize; choices.byte().into()];
        }
        if choices.chance(32) {
            given.extensions.push(Extension {
                tag: choices.bytes(),
                must_understand: false,
                data: choices.fill(3),
            });
        }
        given
    }

    fn tile(
        &mut self,
        choices: &mut Choices<'_>,
        rect: TileRect,
        rank: usize,
        area: usize,
    ) -> BandTile {
        let mut tile = BandTile::dark(rect);
        let pixels = rect.extent.area();
        let what = choices.below(8);
        let colours = |numbers: Vec<f32>| {
            let (colours, _) = numbers.as_chunks::<CHANNELS>();
            colours.to_vec()
        };
        if what & 1 != 0 && rank > 0 {
            tile.coefficients = colours(self.numbers(choices, pixels * rank * CHANNELS));
        }
        if what & 6 == 6 || what & 3 == 2 {
            tile.functions = colours(self.numbers(choices, pixels * area * CHANNELS));
        }
        tile
    }

    /// So many numbers by few choices.
    fn numbers(&mut self, choices: &mut Choices<'_>, count: usize) -> Vec<f32> {
        let mut noise = choices.noise();
        let numbers: Vec<f32> = match choices.below(8) {
            0 => vec![choices.of(ODD); count],
            1 => {
                let odd: [f32; 3] = std::array::from_fn(|_| choices.of(ODD));
                odd.into_iter().cycle().take(count).collect()
            }
            // Of any size.
            2 => {
                let size = f32::from(choices.byte() as i8).exp2();
                (0..count).map(|_| noise.signed() * size).collect()
            }
            // Of every size.
            3 => (0..count).map(|_| f32::from_bits(noise.next())).collect(),
            // Noise, and one number that is none.
            4 => {
                let mut numbers: Vec<f32> = (0..count).map(|_| noise.signed()).collect();
                let at = usize::from(choices.u16()) % count;
                numbers[at] = match choices.chance(128) {
                    true => choices.f32(),
                    false => choices.of(ODD),
                };
                numbers
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
        let tame = |v: &f32| *v == 0.0 || TAME.contains(&v.abs());
        self.tame &= numbers
            .iter()
            .all(|v| tame(v) || v.abs() < 1.0 && v.abs() > 1e-9);
        self.tame &= numbers.iter().fold(0.0, |peak: f32, v| peak.max(v.abs())) != 0.0;
        numbers
    }

    pub fn encode(
        &self,
        quality: RateTarget<'_>,
        executor: &impl Executor,
    ) -> Result<EncodedFile, FormatError> {
        let source = Source {
            geometry: self.geometry,
            basis: self.basis.as_ref(),
            tile: &|i| Ok(self.tiles[i].clone()),
            metadata: self.metadata.clone(),
            extensions: self.extensions.clone(),
        };
        EncodedFile::new(source, quality, executor)
    }

    /// Light transport functions of tile `i`.
    pub fn functions(&self, i: usize) -> TransportFunctions {
        let basis = self.basis.clone().unwrap_or_default();
        self.tiles[i].clone().functions(&self.geometry, &basis)
    }

    /// Squared elements of tile `i`, of its coefficients and of its functions each by themselves: where they
    /// cancel, what is left of them is no measure of what is coded.
    pub fn energy(&self, i: usize) -> f64 {
        let basis = self.basis.clone().unwrap_or_default();
        let mut coefficients = self.tiles[i].clone();
        let functions = std::mem::take(&mut coefficients.functions);
        let of_coefficients = coefficients.functions(&self.geometry, &basis).tau;
        let elements = of_coefficients.iter().chain(&functions).flatten();
        elements.map(|v| f64::from(*v).powi(2)).sum()
    }

    /// Whether every window lies on the display whole.
    pub fn inside(&self) -> bool {
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

/// A worker who does the last first.
#[derive(Debug)]
pub struct Backwards;

impl Executor for Backwards {
    fn map<T: Send>(&self, count: usize, work: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        let mut results: Vec<T> = (0..count).rev().map(work).collect();
        results.reverse();
        results
    }
}

/// How good a file is to be, before it is asked of a judge.
#[derive(Clone, Copy, Debug)]
pub enum Wanted {
    Snr(Decibels),
    Bytes(u64),
    Lossless,
    Loss(Decibels),
}

impl Wanted {
    pub fn new(choices: &mut Choices<'_>) -> Self {
        match choices.below(8) {
            0 => Self::Lossless,
            1 => Self::Bytes(choices.u16().into()),
            2 => Self::Loss(Decibels(choices.of([0.1, 0.3, 3.0, 0.0, f64::NAN]))),
            3 => Self::Snr(Decibels(choices.f64())),
            _ => Self::Snr(Decibels(f64::from(choices.below(90)))),
        }
    }

    pub fn encode(self, given: &Given, opinions: &[u8]) -> Result<EncodedFile, FormatError> {
        let judge = Whim {
            given,
            opinions,
            asked: std::sync::atomic::AtomicUsize::new(0),
        };
        let quality = match self {
            Self::Snr(snr) => RateTarget::Snr(snr),
            Self::Bytes(most) => RateTarget::Bytes(most),
            Self::Lossless => RateTarget::Lossless,
            Self::Loss(most) => RateTarget::Loss(most, &judge),
        };
        given.encode(quality, &SequentialExecutor)
    }
}

/// A judge who says anything.
struct Whim<'a> {
    given: &'a Given,
    opinions: &'a [u8],
    asked: std::sync::atomic::AtomicUsize,
}

impl DistortionMetric for Whim<'_> {
    fn tiles(&self) -> Vec<BandTile> {
        let some = self.given.tiles.iter().step_by(3);
        some.take(3).cloned().collect()
    }

    fn loss(&self, functions: &[TransportFunctions]) -> Decibels {
        for (functions, tile) in functions.iter().zip(self.tiles()) {
            assert_eq!(functions.rect, tile.rect);
            let area = self.given.geometry.window.area();
            assert_eq!(functions.tau.len(), tile.rect.extent.area() * area);
        }
        let asked = self
            .asked
            .fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        match self.opinions.get(asked).copied().unwrap_or(0) {
            255 => Decibels(f64::NAN),
            opinion => Decibels(f64::from(opinion) / 100.0),
        }
    }
}
