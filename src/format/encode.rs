//! From tiles as they were recovered to a file.

use std::fmt;
use std::io::{self, Write};

use super::codec::{basis, checksum, direct, halves, transform};
use super::extension::Extension;
use super::head::Head;
use super::quality::{Rounding, step_for};
use super::turn::{Turn, moment};
use super::{Chunk, ChunkEntry, Coding, FormatError, Header, Metadata, Scan};
use crate::executor::Executor;
use crate::transport::{
    BandTile, Basis, CHANNELS, Decibels, Extent, FactoredTile, Geometry, TileRect,
    TransportFunctions,
};

/// What a file is made of.
pub struct Source<'a> {
    /// Grids, band and the file's tiling.
    pub geometry: Geometry,
    /// Functions that coefficients are of, if any tile has any.
    pub basis: Option<&'a Basis>,
    /// Each tile by its number. Asked for several times.
    pub tile: &'a (dyn Fn(usize) -> io::Result<BandTile> + Sync),
    /// Where it came from.
    pub metadata: Metadata,
    /// What else is to be in the file.
    pub extensions: Vec<Extension>,
}

/// Who can tell how much of light transport's accuracy is lost in a file. What is recovered is not
/// exact, and part of what a file leaves out is noise: SNR against it tells too little.
pub trait Judge: Sync {
    /// Tiles, of any place and size, by which to judge; their coefficients are over the source's basis.
    fn tiles(&self) -> Vec<BandTile>;

    /// About how much SNR against the object's light transport is lost where these functions stand for
    /// the tiles.
    fn loss(&self, functions: &[TransportFunctions]) -> Decibels;
}

/// How good, or how small, a file is to be.
#[derive(Clone, Copy)]
pub enum Quality<'a> {
    /// Most SNR against the object's light transport that may be lost, to a judge.
    Loss(Decibels, &'a dyn Judge),
    /// SNR against what it is made of.
    Snr(Decibels),
    /// Most bytes.
    Bytes(u64),
    /// Eleven bits of every coefficient, for archives.
    Lossless,
}

impl fmt::Debug for Quality<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Loss(most, _) => write!(f, "Loss({most})"),
            Self::Snr(snr) => write!(f, "Snr({snr})"),
            Self::Bytes(most) => write!(f, "Bytes({most})"),
            Self::Lossless => f.write_str("Lossless"),
        }
    }
}

/// Tiles encoded side by side.
const AT_ONCE: usize = 64;
/// Tiles by a part of which the step is chosen, spread over the picture, and the most memory that all
/// parts may take.
const SAMPLE: usize = 64;
const SAMPLE_BYTES: usize = 48 << 20;
/// The side of a part is a multiple of this, so that blocks are whole.
const PART_SIDE: u32 = 8;
/// The step of the first scan, which a picture is first seen by, in steps of the last.
const FIRST_STEP: f32 = 8.0;
/// The same where functions come element by element, and most elements are small.
const FIRST_DIRECT_STEP: f32 = 16.0;
/// Parts of the step for the first component: under a flat light it alone is the picture.
const FLAT_PARTS: f32 = 2.0;
/// Shares of the error that rounding the basis, and leaving out components, may add.
const BASIS_SHARE: f64 = 0.02;
const CUT_SHARE: f64 = 0.01;
/// Share of `energy` that half-precision floats leave as error on the whole: 74 dB. Of few values it can
/// be nothing, or six times as much; it is not said to be less, nor is the basis kept finer than that.
const HALVES_SHARE: f64 = 4e-8;
/// Range of steps in which that is looked for by which a certain SNR against the object is lost, as powers
/// of two, and how often it is halved: to half a hundredth.
const STEPS_FOR_LOSS: [f32; 2] = [-20.0, 0.0];
const LOSS_TRIALS: usize = 12;
/// Range in which a step is looked for that gives a file of a certain size.
const SNR_FOR_SIZE: [f64; 2] = [3.0, 75.0];
/// How often.
const SIZE_TRIALS: usize = 9;

/// A file ready to be written.
#[derive(Clone, Debug)]
pub struct EncodedFile {
    head: Head,
    head_bytes: Vec<u8>,
    /// In the order of the file.
    parts: Vec<Vec<u8>>,
}

impl EncodedFile {
    /// Encodes a whole file. The same source gives the same bytes, however many workers there are.
    ///
    /// # Panics
    /// If a tile's parts or a kernel do not have the length that the geometry and basis give them.
    pub fn new(
        source: Source<'_>,
        quality: Quality<'_>,
        executor: &impl Executor,
    ) -> Result<Self, FormatError> {
        let encoder = Encoder::new(source, executor)?;
        match quality {
            Quality::Loss(most, judge) => encoder.of_loss(most, judge, executor),
            Quality::Snr(snr) => encoder.of_quality(snr, executor),
            Quality::Bytes(most) => encoder.of_size(most, executor),
            Quality::Lossless => encoder.lossless(executor),
        }
    }

    /// All that comes before the first chunk.
    pub fn head(&self) -> &Head {
        &self.head
    }

    /// Length of the file.
    pub fn bytes(&self) -> u64 {
        self.head.header.file_bytes
    }

    /// SNR against what it was made of.
    pub fn snr(&self) -> Option<Decibels> {
        self.head.scans.last().map(|scan| scan.snr)
    }

    /// Writes the file.
    pub fn write(&self, out: &mut impl Write) -> Result<(), FormatError> {
        let mut parts = std::iter::once(&self.head_bytes).chain(&self.parts);
        parts
            .try_for_each(|part| out.write_all(part))
            .map_err(FormatError::Write)
    }
}

/// What is known of a source once all its tiles have been looked at.
struct Encoder<'a> {
    source: Source<'a>,
    turn: Option<Turn>,
    has_functions: bool,
    /// Squared elements of the transport, and the largest coefficient or element there may be.
    energy: f64,
    peak: f32,
    coefficient_energy: f64,
    order: Vec<u16>,
    /// Numbers of the tiles from which light comes.
    lit: Vec<usize>,
}

/// What one look at a tile tells.
struct Look {
    moment: Vec<f64>,
    functions: f64,
    peak: f32,
}

impl<'a> Encoder<'a> {
    fn new(source: Source<'a>, executor: &impl Executor) -> Result<Self, FormatError> {
        let rank = source.basis.map_or(0, Basis::rank);
        let area = source.geometry.window.area();
        if let Some(basis) = source.basis {
            let fits = basis.kernels.iter().all(|kernel| kernel.len() == area);
            assert!(fits, "kernels of the window's area");
        }
        let look = |tile: BandTile| -> Look {
            let pixels = tile.rect.extent.area();
            let fits = |length: usize, each: usize| length == 0 || length == pixels * each;
            assert!(
                fits(tile.coefficients.len(), rank) && fits(tile.functions.len(), area),
                "one value of each"
            );
            let finite = |v: &&f32| v.is_finite();
            let squares = tile.functions.iter().flatten().filter(finite);
            let values = tile.coefficients.iter().chain(&tile.functions).flatten();
            let peak = values
                .filter(finite)
                .fold(0.0f32, |peak, v| peak.max(v.abs()));
            Look {
                moment: moment(&tile, rank),
                functions: squares.map(|v| f64::from(*v).powi(2)).sum(),
                peak,
            }
        };
        let mut all = Look {
            moment: vec![0.0; rank * rank],
            functions: 0.0,
            peak: 0.0,
        };
        let mut lit = Vec::new();
        for_tiles(&source, executor, look, |i, of_tile| {
            if of_tile.peak > 0.0 {
                lit.push(i);
            }
            for (sum, m) in all.moment.iter_mut().zip(of_tile.moment) {
                *sum += m;
            }
            all.functions += of_tile.functions;
            all.peak = all.peak.max(of_tile.peak);
            Ok(())
        })?;
        let has_coefficients = all.moment.iter().any(|m| *m != 0.0);
        let turn = source.basis.filter(|_| has_coefficients);
        let turn = turn.map(|basis| Turn::new(basis, &all.moment));
        let turn = turn.filter(|turn| turn.rank() > 0);
        let coefficient_energy = turn.as_ref().map_or(0.0, Turn::energy);
        Ok(Self {
            order: direct::order(source.geometry.window),
            coefficient_energy,
            energy: coefficient_energy + all.functions,
            // No turned coefficient is larger than all it was turned from together.
            peak: all.peak
                * turn
                    .as_ref()
                    .map_or(1.0, Turn::gain)
                    .max((rank as f32).sqrt()),
            source,
            turn,
            has_functions: all.functions > 0.0,
            lit,
        })
    }

    fn of_quality(
        mut self,
        snr: Decibels,
        executor: &impl Executor,
    ) -> Result<EncodedFile, FormatError> {
        let sample = self.sample()?;
        self.at_snr(snr, &sample, executor)
    }

    /// The file whose numbers keep this SNR, by a sample of them. Leaves components out.
    fn at_snr(
        &mut self,
        snr: Decibels,
        sample: &[Sampled],
        executor: &impl Executor,
    ) -> Result<EncodedFile, FormatError> {
        let step = step_for(snr, |step| self.rounding(sample, step, executor));
        self.cut(step.unwrap_or(1.0), sample, executor);
        self.encode(step, executor)
    }

    /// The coarsest file by which no more is lost than `most`.
    fn of_loss(
        mut self,
        most: Decibels,
        judge: &dyn Judge,
        executor: &impl Executor,
    ) -> Result<EncodedFile, FormatError> {
        let tiles = self.coded_alike(judge.tiles());
        // What few of them are recovered element by element tells the step of the others as well.
        let has_functions = self.has_functions;
        self.has_functions |= tiles.iter().any(|tile| !tile.functions.is_empty());
        // Steps from which nothing is left to those that lose nothing.
        let pixels = self.source.geometry.camera.area() as f64;
        let coarsest = 16.0 * (self.energy / pixels).sqrt() as f32;
        if !coarsest.is_normal() {
            return self.encode(None, executor);
        }
        let [mut fine, mut coarse] = STEPS_FOR_LOSS;
        for _ in 0..LOSS_TRIALS {
            let middle = 0.5 * (fine + coarse);
            let scans = self.plan(coarsest * middle.exp2());
            let decoded = executor.map(tiles.len(), |i| self.decoded(&tiles[i], &scans));
            match judge.loss(&decoded).0 <= most.0 {
                true => fine = middle,
                false => coarse = middle,
            }
        }
        self.has_functions = has_functions;
        let step = coarsest * fine.exp2();
        self.cut(step, &self.sample()?, executor);
        self.encode(Some(step), executor)
    }

    /// A judge's tiles as the file would have them: where it has no components, element by element.
    fn coded_alike(&self, mut tiles: Vec<BandTile>) -> Vec<BandTile> {
        if self.turn.is_none()
            && let Some(basis) = self.source.basis
        {
            for tile in &mut tiles {
                let functions = std::mem::replace(tile, BandTile::dark(tile.rect))
                    .functions(&self.source.geometry, basis);
                tile.functions = functions.tau;
            }
        }
        tiles
    }

    /// The functions of a tile as a reader will have them.
    fn decoded(&self, tile: &BandTile, scans: &[Scan]) -> TransportFunctions {
        let numbers = self.numbers(tile, scans, true);
        let extent = tile.rect.extent;
        let coefficients = numbers.coefficients.as_ref().map(|n| n.decoded(extent));
        let functions = numbers.functions.as_ref();
        let decoded = BandTile {
            rect: tile.rect,
            coefficients: coefficients.and_then(Result::ok).unwrap_or_default(),
            functions: functions
                .map(|n| n.decoded(&tile.functions, &self.order))
                .unwrap_or_default(),
        };
        let basis = Basis {
            kernels: self
                .turn
                .as_ref()
                .map_or(Vec::new(), |turn| turn.functions.clone()),
        };
        decoded.functions(&self.source.geometry, &basis)
    }

    /// The best file that is small enough, or nearly that.
    fn of_size(mut self, most: u64, executor: &impl Executor) -> Result<EncodedFile, FormatError> {
        let sample = self.sample()?;
        let turn = self.turn.clone();
        let mut try_snr = |snr: f64| {
            self.turn.clone_from(&turn);
            self.at_snr(Decibels(snr), &sample, executor)
        };
        let [mut low, mut high] = SNR_FOR_SIZE;
        let mut best = try_snr(low)?;
        if best.bytes() > most {
            return Err(FormatError::TooLarge {
                most,
                least: best.bytes(),
            });
        }
        for _ in 0..SIZE_TRIALS {
            let middle = 0.5 * (low + high);
            let file = try_snr(middle)?;
            match file.bytes() <= most {
                true => (low, best) = (middle, file),
                false => high = middle,
            }
        }
        Ok(best)
    }

    fn lossless(self, executor: &impl Executor) -> Result<EncodedFile, FormatError> {
        let step = halves::step_for(self.peak);
        let most = direct::most_slots(self.source.geometry.tile_side) as usize;
        let mut scans: Vec<Scan> = components(self.rank(), most)
            .map(|(first, count)| Scan::new(Coding::Halves, first, count, step))
            .collect();
        let slots = self.slots();
        scans.extend(
            slots.map(|(first, count)| Scan::new(Coding::DirectHalves, first, count, step)),
        );
        let encode = |tile: BandTile| -> Result<EncodedTile, FormatError> {
            let coefficients = self.coefficients(&tile);
            let mut encoded = EncodedTile::default();
            let mut squares = Vec::with_capacity(scans.len());
            let mut rounding = Vec::with_capacity(scans.len());
            for scan in &scans {
                let (values, each) = match scan.coding.is_direct() {
                    true => (&tile.functions, self.order.len()),
                    false => (&coefficients, self.rank()),
                };
                let values = halves::gather(values, each, &self.places(scan));
                let square = values.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>();
                squares.push(square);
                rounding.push(halves::error(&values, step).max(HALVES_SHARE * square));
                encoded.chunks.push(match values.iter().all(|v| *v == 0.0) {
                    true => None,
                    false => Some(Chunk {
                        plain: halves::plain_bytes(values.len()) as u32,
                        bytes: halves::encode(&values, step)?,
                    }),
                });
            }
            let (mut rounded, mut missing) = (0.0, squares.iter().sum::<f64>());
            for (square, rounding) in squares.iter().zip(rounding) {
                (rounded, missing) = (rounded + rounding, missing - square);
                encoded.errors.push(rounded + missing.max(0.0));
            }
            Ok(encoded)
        };
        self.assemble(scans.clone(), encode, executor)
    }

    fn rank(&self) -> usize {
        self.turn.as_ref().map_or(0, Turn::rank)
    }

    fn coefficients(&self, tile: &BandTile) -> Vec<[f32; CHANNELS]> {
        self.turn
            .as_ref()
            .map_or(Vec::new(), |turn| turn.coefficients(tile))
    }

    /// Components or slots of a scan.
    fn places(&self, scan: &Scan) -> Vec<u16> {
        match scan.coding.is_direct() {
            true => self.order[usize::from(scan.first)..scan.end()].to_vec(),
            false => (scan.first..).take(scan.count.into()).collect(),
        }
    }

    /// Parts of some tiles, spread over the picture; light comes from each.
    fn sample(&self) -> Result<Vec<Sampled>, FormatError> {
        let values = self.rank() + usize::from(self.has_functions) * self.order.len();
        let pixel = (values * CHANNELS * size_of::<f32>()).max(1);
        let smallest = PART_SIDE.pow(2) as usize * pixel;
        let most = SAMPLE.min(SAMPLE_BYTES / smallest).max(1);
        let count = self.lit.len().min(most);
        let tile_side = self.source.geometry.tile_side;
        let side = (SAMPLE_BYTES / (count.max(1) * pixel)).isqrt() as u32;
        let side = match side >= tile_side {
            true => tile_side,
            false => (side / PART_SIDE * PART_SIDE).max(PART_SIDE),
        };
        let part = |n: usize| -> io::Result<Sampled> {
            // One of each of `count` equal groups; which one follows no grid.
            let [from, to] = [n, n + 1].map(|n| n * self.lit.len() / count);
            let tile = self.lit[from + scattered(n) % (to - from)];
            let (tile, parts) = lit_part((self.source.tile)(tile)?, side, scattered(n + SAMPLE));
            Ok(Sampled {
                tile,
                weight: (parts * (to - from)) as f64,
            })
        };
        (0..count)
            .map(part)
            .collect::<io::Result<_>>()
            .map_err(FormatError::Source)
    }

    /// What rounding to `step` does to some tiles.
    fn rounding(&self, sample: &[Sampled], step: f32, executor: &impl Executor) -> Rounding {
        let scans = self.plan(step);
        let each = executor.map(sample.len(), |i| {
            let Sampled { tile, weight } = &sample[i];
            self.numbers(tile, &scans, false).rounding().times(*weight)
        });
        // In order: sums must not depend on threads.
        each.into_iter().fold(Rounding::default(), Rounding::and)
    }

    /// Leaves out the components that matter little against what rounding to `step` does.
    fn cut(&mut self, step: f32, sample: &[Sampled], executor: &impl Executor) {
        let Rounding { energy, error } = self.rounding(sample, step, executor);
        let allowed = CUT_SHARE * self.energy * error / energy.max(f64::MIN_POSITIVE);
        if let Some(turn) = &mut self.turn {
            let mut left_out = 0.0;
            let small = turn.energies.iter().rev().take_while(|energy| {
                left_out += **energy;
                left_out <= allowed
            });
            let rank = turn.rank() - small.count();
            turn.cut(rank.max(1));
        }
    }

    /// The scans: everything coarsely first, then better component by component.
    fn plan(&self, step: f32) -> Vec<Scan> {
        let side = self.source.geometry.tile_side;
        let transform =
            |(first, count), step: f32| Scan::new(Coding::Transform, first, count, step);
        let of_slots = |(first, count), step: f32| Scan::new(Coding::Direct, first, count, step);
        let rank = self.rank();
        let most = transform::most_components(side) as usize;
        let mut scans = Vec::new();
        // No number may be too large: where the step is very fine, it takes a coarse one for all.
        let finest = transform::finest_step(self.peak);
        if rank > 0 {
            let two = (0, rank.min(2) as u16);
            scans.push(transform(two, finest.max(FIRST_STEP * step)));
        }
        if finest > step {
            let others = groups(2.min(rank), rank, most, usize::MAX);
            scans.extend(others.map(|group| transform(group, finest)));
        }
        let first_step = direct::finest_step(self.peak).max(FIRST_DIRECT_STEP * step);
        scans.extend(self.slots().map(|group| of_slots(group, first_step)));
        if rank > 0 {
            scans.push(transform((0, 1), step / FLAT_PARTS));
        }
        if rank > 1 {
            scans.push(transform((1, 1), step));
        }
        let later = groups(2.min(rank), rank, most, 3);
        scans.extend(later.map(|group| transform(group, step)));
        scans.extend(self.slots().map(|group| of_slots(group, step)));
        scans
    }

    /// Slots in groups; none where there are no functions.
    fn slots(&self) -> impl Iterator<Item = (u16, u16)> {
        let most = direct::most_slots(self.source.geometry.tile_side) as usize;
        let count = usize::from(self.has_functions) * self.order.len();
        groups(0, count, most, usize::MAX)
    }

    /// A tile as numbers; `keep` says whether they are to be decoded.
    fn numbers(&self, tile: &BandTile, scans: &[Scan], keep: bool) -> Numbers {
        let (transform_scans, direct_scans) = (scans_of(scans, false), scans_of(scans, true));
        let coefficients = self.coefficients(tile);
        let coefficients = (!coefficients.is_empty()).then(|| {
            let tile = FactoredTile {
                rect: tile.rect,
                coefficients,
            };
            transform::Numbers::new(&tile, &transform_scans, keep)
        });
        let functions = (!tile.functions.is_empty() && !direct_scans.is_empty())
            .then(|| direct::Numbers::new(&tile.functions, &self.order, &direct_scans));
        Numbers {
            coefficients,
            functions,
        }
    }

    /// Encodes all tiles; where there is no step there is no light.
    fn encode(
        &self,
        step: Option<f32>,
        executor: &impl Executor,
    ) -> Result<EncodedFile, FormatError> {
        let scans = step.map_or(Vec::new(), |step| self.plan(step));
        let encode = |tile: BandTile| self.numbers(&tile, &scans, false).encode(&scans);
        self.assemble(scans.clone(), encode, executor)
    }

    /// Encodes all tiles, and puts the file together.
    fn assemble(
        &self,
        mut scans: Vec<Scan>,
        encode: impl Fn(BandTile) -> Result<EncodedTile, FormatError> + Sync + Send,
        executor: &impl Executor,
    ) -> Result<EncodedFile, FormatError> {
        let geometry = self.source.geometry;
        let (tiles, area) = (geometry.tile_grid().area(), geometry.window.area());
        let mut chunks: Vec<Vec<Option<Chunk>>> = vec![Vec::with_capacity(tiles); scans.len()];
        // Components that were left out are missing throughout.
        let kept = self.turn.as_ref().map_or(0.0, Turn::energy);
        let left_out = (self.coefficient_energy - kept).max(0.0);
        let mut errors = vec![left_out; scans.len()];
        for_tiles(&self.source, executor, encode, |_, tile| {
            let tile = tile?;
            for (sum, error) in errors.iter_mut().zip(&tile.errors) {
                *sum += error;
            }
            for (chunks, chunk) in chunks.iter_mut().zip(tile.chunks) {
                chunks.push(chunk);
            }
            Ok(())
        })?;
        let error = errors.last().copied().unwrap_or(0.0);
        let rounded = self.turn.as_ref().map(|turn| {
            let steps = turn.energies.iter().map(|energy| {
                let share = BASIS_SHARE * error / turn.rank() as f64;
                (12.0 * share / (area as f64 * energy.max(f64::MIN_POSITIVE))).sqrt() as f32
            });
            basis::Rounded::new(&turn.functions, &steps.collect::<Vec<_>>())
        });
        let mut known = 0;
        let mut of_basis = 0.0;
        let mut parts = Vec::new();
        let mut entries = Vec::with_capacity(scans.len() * tiles);
        for ((scan, chunks), error) in scans.iter_mut().zip(chunks).zip(errors) {
            let brings = scan.brings(known);
            if let (Some(rounded), Some(turn)) = (&rounded, &self.turn)
                && brings > 0
            {
                let bytes = rounded.encode(known, brings, area)?;
                for k in known..known + brings {
                    of_basis += turn.energies[k] * rounded.error(k, &turn.functions[k]);
                }
                known += brings;
                scan.basis_bytes = bytes.len() as u32; // at most MOST_PLAIN, about
                scan.basis_crc = checksum(&bytes);
                parts.push(bytes);
            }
            let rounding = Rounding {
                energy: self.energy,
                error: error + of_basis,
            };
            scan.snr = Decibels(f64::from(rounding.snr().0 as f32));
            for chunk in chunks {
                entries.push(
                    chunk
                        .as_ref()
                        .map_or(ChunkEntry::default(), |chunk| ChunkEntry {
                            bytes: chunk.bytes.len() as u32, // a chunk is below some times MOST_PLAIN
                            plain: chunk.plain,
                            crc: checksum(&chunk.bytes),
                        }),
                );
                parts.extend(chunk.map(|chunk| chunk.bytes));
            }
        }
        let rank = u16::try_from(known).map_err(|_| FormatError::Rank(known as u64))?;
        let header = Header {
            geometry,
            file_bytes: 0,
            rank,
            scans: 0,
            directory_bytes: 0,
            directory_crc: 0,
            extension_bytes: 0,
            extension_crc: 0,
            metadata_bytes: 0,
            metadata_crc: 0,
        };
        let (extensions, metadata) = (&self.source.extensions, &self.source.metadata);
        let (head, head_bytes) = Head::new(header, scans, entries, extensions.clone(), metadata)?;
        debug_assert!(head.parts().count() == parts.len());
        Ok(EncodedFile {
            head,
            head_bytes,
            parts,
        })
    }
}

/// A tile as numbers of both kinds.
struct Numbers {
    coefficients: Option<transform::Numbers>,
    functions: Option<direct::Numbers>,
}

/// A tile's chunks, one a scan, and squared errors that are left after each.
#[derive(Default)]
struct EncodedTile {
    chunks: Vec<Option<Chunk>>,
    errors: Vec<f64>,
}

impl Numbers {
    /// What is left at the end.
    fn rounding(&self) -> Rounding {
        let last = |errors: &[f64]| errors.last().copied().unwrap_or(0.0);
        let of_coefficients = self.coefficients.as_ref().map(|n| Rounding {
            energy: n.energy,
            error: last(&n.errors),
        });
        let of_functions = self.functions.as_ref().map(|n| Rounding {
            energy: n.energy,
            error: last(&n.errors),
        });
        of_coefficients
            .unwrap_or_default()
            .and(of_functions.unwrap_or_default())
    }

    fn encode(&self, scans: &[Scan]) -> Result<EncodedTile, FormatError> {
        // Of both kinds of scans: what is to come, and the squared error until then.
        let (mut coming, mut left) = ([Vec::new(), Vec::new()], [0.0; 2]);
        if let Some(numbers) = &self.coefficients {
            let chunks = numbers.chunks(&scans_of(scans, false))?.into_iter();
            coming[0] = chunks.zip(numbers.errors.iter().copied()).collect();
            left[0] = numbers.energy;
        }
        if let Some(numbers) = &self.functions {
            let chunks = numbers.chunks(&scans_of(scans, true))?.into_iter();
            coming[1] = chunks.zip(numbers.errors.iter().copied()).collect();
            left[1] = numbers.energy;
        }
        let mut coming = coming.map(Vec::into_iter);
        let of_palette = self.coefficients.as_ref().map_or(0.0, |n| n.of_palette);
        let mut encoded = EncodedTile::default();
        for scan in scans {
            let kind = usize::from(scan.coding.is_direct());
            let mut chunk = None;
            if let Some(next) = coming[kind].next() {
                (chunk, left[kind]) = next;
            }
            encoded.chunks.push(chunk);
            encoded.errors.push(left.iter().sum::<f64>() + of_palette);
        }
        Ok(encoded)
    }
}

/// Scans of direct tiles, or of factored ones.
fn scans_of(scans: &[Scan], direct: bool) -> Vec<&Scan> {
    let of_kind = scans
        .iter()
        .filter(|scan| scan.coding.is_direct() == direct);
    of_kind.collect()
}

/// A part of a tile, and how many such it stands for.
struct Sampled {
    tile: BandTile,
    weight: f64,
}

/// One of the squares of `side` that a tile consists of, of those from which light comes, and how many
/// of these there are. Which one follows from `chance`.
fn lit_part(tile: BandTile, side: u32, chance: usize) -> (BandTile, usize) {
    let Extent { width, height } = tile.rect.extent;
    let (across, down) = (width.div_ceil(side), height.div_ceil(side));
    if across * down == 1 {
        return (tile, 1);
    }
    let parts = (0..across * down).map(|i| {
        let (left, top) = (i % across * side, i / across * side);
        tile.crop(TileRect {
            x: tile.rect.x + left,
            y: tile.rect.y + top,
            extent: Extent {
                width: side.min(width - left),
                height: side.min(height - top),
            },
        })
    });
    let mut lit: Vec<BandTile> = parts.filter(is_lit).collect();
    match lit.len() {
        0 => (BandTile::dark(tile.rect), 0),
        count => (lit.swap_remove(chance % count), count),
    }
}

fn is_lit(tile: &BandTile) -> bool {
    let mut values = tile.coefficients.iter().chain(&tile.functions).flatten();
    values.any(|v| v.is_finite() && *v != 0.0)
}

/// A number that has nothing to do with `n`, but is always the same.
fn scattered(n: usize) -> usize {
    (n as u32).wrapping_mul(0x9E37_79B9).rotate_left(16) as usize
}

/// Fetches each tile, works on it, and takes the results in order.
fn for_tiles<T: Send>(
    source: &Source<'_>,
    executor: &impl Executor,
    work: impl Fn(BandTile) -> T + Sync + Send,
    mut take: impl FnMut(usize, T) -> Result<(), FormatError>,
) -> Result<(), FormatError> {
    let count = source.geometry.tile_grid().area();
    for first in (0..count).step_by(AT_ONCE) {
        let results = executor.map(AT_ONCE.min(count - first), |i| {
            (source.tile)(first + i).map(&work)
        });
        for (i, result) in results.into_iter().enumerate() {
            take(first + i, result.map_err(FormatError::Source)?)?;
        }
    }
    Ok(())
}

/// Components in groups, the first two by themselves.
fn components(rank: usize, most: usize) -> impl Iterator<Item = (u16, u16)> {
    groups(0, rank.min(2), most, usize::MAX).chain(groups(2.min(rank), rank, most, 3))
}

/// `from..to` in groups that grow from `size`, to `most` at most, as first and count.
fn groups(from: usize, to: usize, most: usize, size: usize) -> impl Iterator<Item = (u16, u16)> {
    let (mut next, mut size) = (from, size);
    std::iter::from_fn(move || {
        let count = size.min(most.max(1)).min(to - next);
        let group = (next as u16, count as u16); // ranks and slots are below 2^16
        next += count;
        size = size.saturating_mul(2).saturating_add(1);
        (count > 0).then_some(group)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_lit_and_tells_how_many_are() {
        let rect = TileRect {
            x: 32,
            y: 16,
            extent: Extent {
                width: 20,
                height: 13,
            },
        };
        let with_light_at = |pixels: &[usize]| {
            let mut tile = BandTile::dark(rect);
            tile.functions = vec![[0.0; CHANNELS]; rect.extent.area() * 9];
            for p in pixels {
                tile.functions[p * 9 + 4][1] = 1.0;
            }
            tile
        };
        for chance in 0..7 {
            // The last pixel, alone in a part of four by five.
            let (part, count) = lit_part(with_light_at(&[259]), 8, chance);
            assert_eq!(count, 1);
            assert_eq!((part.rect.x, part.rect.y), (48, 24));
            assert_eq!((part.rect.extent.width, part.rect.extent.height), (4, 5));
            assert!(is_lit(&part));
            // The first, one beside it, and the last.
            let (part, count) = lit_part(with_light_at(&[0, 3, 259]), 8, chance);
            assert_eq!(count, 2);
            assert_eq!(part.rect.x, [32, 48][chance % 2]);
            assert_eq!(lit_part(with_light_at(&[]), 8, chance).1, 0);
            let (whole, count) = lit_part(with_light_at(&[7]), 24, chance);
            assert_eq!((whole.rect, count), (rect, 1));
        }
    }
}
