//! The `.ltm` file: the reader gives what the encoder was given, and refuses every damaged file.
#![allow(clippy::unwrap_used)] // a failed test should panic

mod common;

use common::{Noise, functions, geometry, sealed};
use proptest::prelude::*;
use relightable_photo::format::{
    self, ChunkId, ChunkSelection, ChunkStore, CodingPlan, DistortionMetric, EncodedFile,
    EncoderInput, EncodingTarget, FormatError, FormatExtension, HEADER_BYTES, Limits, LtmReader,
    Metadata, ProgressiveScan, ScanCoding, SectionName, TextModeDamage, TileEncoder, TileSample,
};
use relightable_photo::job_executor::{Executor, SequentialExecutor};
use relightable_photo::transport::{
    Basis, CHANNELS, Decibels, Extent, FloatTile, Geometry, SnrAccumulator, Tile, TileRect,
    TileTransportFunctions, Transport,
};

/// A recovered light transport.
#[derive(Clone)]
struct Recovered {
    geometry: Geometry,
    basis: Option<Basis>,
    tiles: Vec<FloatTile>,
}

// Brief, for the messages of failed cases.
impl std::fmt::Debug for Recovered {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let rank = self.basis.as_ref().map(Basis::rank);
        write!(f, "rank {rank:?} on {:?}", self.geometry)
    }
}

impl Recovered {
    /// Direct tiles; the first is dark.
    fn direct(geometry: Geometry, seed: u64) -> Self {
        let tiles = functions(geometry.clone(), seed)
            .into_iter()
            .map(FloatTile::from);
        Self {
            geometry,
            basis: None,
            tiles: tiles.collect(),
        }
    }

    /// Direct tiles, with every other tile factored over basis functions of unit norm. The last component is zero, and so
    /// is one factored tile.
    fn mixed(geometry: Geometry, rank: usize, seed: u64) -> Self {
        let mut recovered = Self::direct(geometry.clone(), seed);
        let mut noise = Noise(seed);
        let kernel = |_| {
            let elements = (0..geometry.window.area()).map(|_| noise.next() as f32 - 0.4);
            let kernel: Vec<f32> = elements.collect();
            let norm = kernel.iter().map(|v| v * v).sum::<f32>().sqrt();
            kernel.into_iter().map(|v| v / norm).collect()
        };
        recovered.basis = Some(Basis {
            kernels: (0..rank).map(kernel).collect(),
        });
        for (i, rect) in geometry.tiles().enumerate().skip(1).step_by(2) {
            let coefficient = |j: usize| {
                let (k, last) = (j % rank, rank - 1);
                let size = if i == 3 || k == last && k > 0 {
                    0.0
                } else {
                    (1.0 + k as f32).powi(-2)
                };
                [1.0, 0.5, 2.0].map(|c| c * size * (noise.next() as f32 - 0.3))
            };
            recovered.tiles[i] = FloatTile {
                coefficients: (0..rect.extent.area() * rank).map(coefficient).collect(),
                ..FloatTile::dark(rect)
            };
        }
        recovered
    }

    fn encode(&self, quality: EncodingTarget<'_>) -> Result<EncodedFile, FormatError> {
        self.encode_by(quality, &SequentialExecutor, metadata(), Vec::new())
    }

    fn encode_by(
        &self,
        quality: EncodingTarget<'_>,
        executor: &impl Executor,
        metadata: Metadata,
        extensions: Vec<FormatExtension>,
    ) -> Result<EncodedFile, FormatError> {
        let source = EncoderInput {
            geometry: self.geometry.clone(),
            basis: self.basis.as_ref(),
            tile: &|i| Ok(self.tiles[i].clone()),
            metadata,
            extensions,
        };
        EncodedFile::new(source, quality, executor)
    }

    /// Plans the file from a square of `side` pixels of each of the tiles `sampled`, and encodes its tiles from the last to the first.
    fn encode_planned(
        &self,
        quality: EncodingTarget<'_>,
        side: u32,
        sampled: fn(&FloatTile) -> bool,
    ) -> EncodedFile {
        let square = |tile: &FloatTile| {
            let Extent { width, height } = tile.rect.extent;
            tile.crop(TileRect {
                extent: Extent::new(side.min(width), side.min(height)),
                ..tile.rect
            })
        };
        let sample = TileSample {
            geometry: &self.geometry,
            basis: self.basis.as_ref(),
            tiles: self
                .tiles
                .iter()
                .filter(|tile| sampled(tile))
                .map(square)
                .collect(),
            may_have_functions: self.tiles.iter().any(|tile| !tile.functions.is_empty()),
            max_measurement: 10.0,
        };
        let plan = CodingPlan::new(sample, quality, &SequentialExecutor).unwrap();
        // As a file of several machines has it.
        let plan = serde_json::to_vec(&plan).unwrap();
        let plan: CodingPlan = serde_json::from_slice(&plan).unwrap();
        let encoder = TileEncoder::new(&plan, &self.geometry, self.basis.as_ref()).unwrap();
        let mut store = Vec::<Vec<u8>>::new();
        let count = self.tiles.len();
        let encode = |(i, tile): (usize, &FloatTile)| {
            let encoded = encoder.encode(tile.clone()).unwrap();
            let chunks = encoded.chunks.into_iter();
            store.put_tile(i, count, chunks).unwrap();
            encoded.head
        };
        let heads: Vec<_> = self.tiles.iter().enumerate().rev().map(encode).collect();
        let heads = heads.iter().rev();
        EncodedFile::of_tiles(&plan, self.geometry.clone(), heads, store, &metadata()).unwrap()
    }

    fn file(&self, quality: EncodingTarget<'_>) -> Vec<u8> {
        bytes(&self.encode(quality).unwrap())
    }

    /// Light transport functions of tile `i`.
    fn functions(&self, i: usize) -> TileTransportFunctions {
        self.tiles[i].functions(&self.geometry, self.basis.as_ref())
    }

    /// The share of all windows' slots that lie on the light plane.
    fn share_on_plane(&self) -> f64 {
        let Geometry { light, window, .. } = self.geometry;
        let origins = self
            .geometry
            .tiles()
            .flat_map(|tile| tile.pixels().collect::<Vec<_>>());
        let origins = origins.map(|pixel| self.geometry.window_origin(pixel));
        let lit = origins.map(|origin| {
            let lit = |&s: &usize| window.element(origin, s).index_in(light).is_some();
            (0..window.area()).filter(lit).count()
        });
        lit.sum::<usize>() as f64 / (self.geometry.camera.area() * window.area()) as f64
    }

    /// The error of a decoded transport against this one.
    fn error(&self, decoded: &Transport) -> SnrAccumulator {
        let mut error = SnrAccumulator::default();
        for (i, tile) in decoded.tiles.iter().enumerate() {
            let got = tile.functions(&decoded.geometry, &decoded.basis).tau;
            for (got, want) in got.iter().zip(self.functions(i).tau) {
                for c in 0..CHANNELS {
                    error.add(f64::from(want[c]), f64::from(got[c]));
                }
            }
        }
        error
    }
}

fn bytes(file: &EncodedFile) -> Vec<u8> {
    let mut bytes = Vec::new();
    file.write(&mut bytes).unwrap();
    assert_eq!(bytes.len() as u64, file.bytes());
    bytes
}

fn read(file: &[u8], piece: usize) -> Result<LtmReader, FormatError> {
    let mut reader = LtmReader::new(Limits::default());
    let mut offset = 0;
    for piece in file.chunks(piece.max(1)) {
        reader.feed(offset, piece)?;
        offset += piece.len() as u64;
    }
    Ok(reader)
}

fn decode(file: &[u8], piece: usize) -> Result<(Transport, Metadata), FormatError> {
    let (transport, metadata) = read(file, piece)?.finish()?;
    Ok((transport, metadata.read()?))
}

fn metadata() -> Metadata {
    Metadata {
        title: "A window".to_owned(),
        writer: "test".to_owned(),
        method: "nnls".to_owned(),
        shots_used: vec![0, 2, 5],
        color_matrix: Some([
            [1.9, -0.7, -0.0001],
            [-0.2, 1000.0, -1000.0],
            [0.0, -0.6, 1.6],
        ]),
        ..Metadata::default()
    }
}

const QUALITY: EncodingTarget<'static> = EncodingTarget::Snr(Decibels(30.0));

/// Six tiles of 8 x 8 pixels and less.
fn small_geometry() -> Geometry {
    geometry([17, 9], [8, 6], 3, [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]])
}

/// Tiles 0 and 3 dark, 1 and 5 factored, 2 and 4 direct.
fn mixed() -> Recovered {
    Recovered::mixed(small_geometry(), 4, 1)
}

/// Files with all codings: quantised and as half floats, direct and mixed.
fn small_files() -> Vec<Vec<u8>> {
    let mut files = Vec::new();
    for recovered in [mixed(), Recovered::direct(small_geometry(), 1)] {
        files.extend([QUALITY, EncodingTarget::Lossless].map(|quality| recovered.file(quality)));
    }
    files
}

/// Arbitrary transports with arbitrary geometries.
fn any_recovered() -> impl Strategy<Value = Recovered> {
    let sides = ([1u32..40, 1u32..40], [1u32..20, 1u32..20], 0u32..4);
    let others = (-30.0f64..30.0, 0usize..20, any::<u64>());
    (sides, others).prop_map(|((camera, light, half), (offset, rank, seed))| {
        let affine = [[0.5, 0.01, offset], [-0.02, 0.5, 0.25]];
        let geometry = geometry(camera, light, 2 * half + 1, affine);
        match rank {
            0 => Recovered::direct(geometry, seed),
            rank => Recovered::mixed(geometry, rank, seed),
        }
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn lossless_files_keep_eleven_bits(recovered in any_recovered(), piece in 1usize..5000) {
        let (decoded, meta) = decode(&recovered.file(EncodingTarget::Lossless), piece).unwrap();
        prop_assert_eq!(meta, metadata());
        prop_assert_eq!(&decoded.geometry, &recovered.geometry);
        let snr = recovered.error(&decoded).snr();
        prop_assert!(snr.is_none_or(|snr| snr.0 > 55.0), "{:?}", snr);
    }

    #[test]
    fn files_reach_the_target_snr(
        recovered in any_recovered(), quality in 15.0f64..60.0, piece in 1usize..5000,
    ) {
        let encoded = recovered.encode(EncodingTarget::Snr(Decibels(quality))).unwrap();
        let (decoded, _) = decode(&bytes(&encoded), piece).unwrap();
        let snr = recovered.error(&decoded).snr();
        // The encoder also counts values off the light plane; and rounding to twelve bits adds noise.
        let snr = snr.filter(|_| recovered.share_on_plane() > 0.8);
        prop_assert!(snr.is_none_or(|snr| snr.0 > quality.min(52.0) - 3.0), "{:?}", snr);
        if let Some(declared) = encoded.snr() {
            prop_assert!(declared.0 > quality - 0.3, "{}", declared.0);
        }
    }

    #[test]
    fn chunks_may_come_in_any_order(recovered in any_recovered(), seed in any::<u64>()) {
        let file = recovered.file(QUALITY);
        let want = decode(&file, file.len()).unwrap();
        let mut reader = LtmReader::new(Limits::default());
        let mut noise = Noise(seed);
        while let Some(ranges) = Some(reader.wants(&ChunkSelection::default())).filter(|r| !r.is_empty()) {
            let range = ranges[(noise.next() * ranges.len() as f64) as usize].clone();
            let mut range = range.start as usize..file.len().min(range.end as usize);
            if let Some(index) = reader.index() && noise.next() < 0.7 {
                // One chunk from the wanted range.
                let chunks: Vec<_> = index
                    .chunks()
                    .map(|chunk| index.range(chunk))
                    .filter(|chunk| chunk.start as usize >= range.start && chunk.end as usize <= range.end)
                    .collect();
                if !chunks.is_empty() {
                    let chunk = &chunks[(noise.next() * chunks.len() as f64) as usize];
                    range = chunk.start as usize..chunk.end as usize;
                }
            }
            let length = (noise.next() * 2.0 * range.len() as f64) as usize;
            range.end = range.end.min(range.start + length.max(1));
            reader.feed(range.start as u64, &file[range]).unwrap();
        }
        prop_assert_eq!(reader.progress().tiles, want.0.tiles.len());
        prop_assert_eq!(reader.progress().bytes, file.len() as u64);
        let (transport, metadata) = reader.finish().unwrap();
        prop_assert!((transport, metadata.read().unwrap()) == want);
    }
}

/// An executor that runs jobs in reverse order.
struct ReversedExecutor;

impl Executor for ReversedExecutor {
    fn map<T: Send>(&self, count: usize, work: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        let mut results: Vec<T> = (0..count).rev().map(work).collect();
        results.reverse();
        results
    }
}

#[test]
fn the_same_transport_gives_the_same_bytes() {
    for quality in [
        QUALITY,
        EncodingTarget::Bytes(6000),
        EncodingTarget::Lossless,
    ] {
        let first = mixed().file(quality);
        let again = mixed()
            .encode_by(quality, &ReversedExecutor, metadata(), Vec::new())
            .unwrap();
        assert!(first == bytes(&again), "{quality:?}");
    }
}

#[test]
fn metadata_do_not_change_how_transport_is_coded() {
    let affine = [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]];
    let recovered = Recovered::mixed(common::tiled([128, 128], [64, 64], 5, 64, affine), 8, 5);
    let quality = EncodingTarget::Snr(Decibels(35.0));
    let short = recovered.encode(quality).unwrap();
    let metadata = Metadata {
        // More than the share of a file that the index may take with the first layer.
        rights: "-".repeat(short.bytes() as usize / 5),
        ..metadata()
    };
    let long = recovered
        .encode_by(quality, &SequentialExecutor, metadata, Vec::new())
        .unwrap();
    assert_eq!(long.index().scans, short.index().scans);
    let chunks =
        |file: &EncodedFile| bytes(file).split_off(file.index().header.index_bytes() as usize);
    assert!(chunks(&long) == chunks(&short));
}

#[test]
fn every_scan_raises_the_snr_as_declared() {
    let geometry = geometry([70, 50], [40, 30], 7, [[0.5, 0.0, 2.0], [0.0, 0.5, 2.0]]);
    for (recovered, quality) in [
        (
            Recovered::mixed(geometry.clone(), 12, 3),
            EncodingTarget::Snr(Decibels(35.0)),
        ),
        (
            Recovered::mixed(geometry.clone(), 12, 3),
            EncodingTarget::Lossless,
        ),
        (
            Recovered::direct(geometry, 3),
            EncodingTarget::Snr(Decibels(35.0)),
        ),
    ] {
        let file = recovered.file(quality);
        let index = read(&file, file.len()).unwrap().index().unwrap().clone();
        let mut before = 0.0;
        for (s, scan) in index.scans.iter().enumerate() {
            let end = index.scan_range(s).end as usize;
            let mut reader = read(&file[..end], 3000).unwrap();
            assert!(reader.progress().scans > s); // later scans may have no chunks
            assert!(
                reader
                    .wants(&ChunkSelection::default())
                    .iter()
                    .all(|r| r.start >= end as u64)
            );
            let enough = ChunkSelection {
                snr: Some(Decibels(scan.snr.0)),
                viewport: None,
            };
            assert!(reader.wants(&enough).is_empty(), "scan {s}");
            reader.feed(3, &file[3..end]).unwrap(); // known bytes change nothing
            let scans = reader.progress().scans;
            let preview = reader.preview().unwrap();
            assert_eq!(preview.is_none(), scans == index.scans.len());
            let (transport, _) = reader.finish_early().unwrap();
            let snr = recovered.error(&transport).snr().unwrap().0;
            if let Some(preview) = preview {
                // A preview has the values of the prefix, and no memory for later components.
                let error = recovered.error(&preview).snr().unwrap().0;
                assert!(
                    (error - snr).abs() < 0.05,
                    "scan {s}: {error} dB, not {snr}"
                );
                let ends = index.scans[..scans]
                    .iter()
                    .filter(|scan| !scan.coding.is_direct());
                let rank = ends.map(|scan| scan.end()).max().unwrap_or(0);
                assert_eq!(preview.basis.rank(), rank);
                let bytes = |t: &Transport| t.tiles.iter().map(Tile::bytes).sum::<usize>();
                assert!(bytes(&preview) <= bytes(&transport));
            }
            // Preliminary reflections and rounding to twelve bits add errors.
            let [snr, declared] = [snr, scan.snr.0].map(|snr| snr.min(55.0));
            assert!(
                (snr - declared).abs() < 2.5,
                "scan {s}: {snr} dB, declared {declared}"
            );
            assert!(snr > before - 0.01, "scan {s}: {snr} dB after {before}");
            before = snr;
        }
    }
}

#[test]
fn files_stay_within_the_target_size() {
    let affine = [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]];
    let geometry = common::tiled([128, 128], [64, 64], 5, 64, affine);
    let recovered = Recovered::mixed(geometry, 8, 5);
    let mut before = 0.0;
    for limit in [30_000, 60_000, 120_000] {
        let file = recovered.encode(EncodingTarget::Bytes(limit)).unwrap();
        assert!(
            (limit * 9 / 10..=limit).contains(&file.bytes()),
            "{} of {limit} bytes",
            file.bytes()
        );
        let snr = file.snr().unwrap().0;
        assert!(snr > before + 1.0, "{snr} dB in {limit} bytes");
        before = snr;
    }
    let error = recovered.encode(EncodingTarget::Bytes(300)).unwrap_err();
    assert!(
        matches!(error, FormatError::TooLarge { limit: 300, smallest } if smallest > 300),
        "{error}"
    );
}

/// A distortion metric with a known transport: the loss is how far the SNR is below 30 dB.
struct KnownTransportMetric<'a> {
    geometry: Geometry,
    basis: &'a Basis,
    tiles: Vec<FloatTile>,
}

impl DistortionMetric for KnownTransportMetric<'_> {
    fn tiles(&self) -> Vec<FloatTile> {
        self.tiles.clone()
    }

    fn loss(&self, functions: &[TileTransportFunctions]) -> Decibels {
        let mut error = SnrAccumulator::default();
        for (got, tile) in functions.iter().zip(self.tiles()) {
            let want = tile.functions(&self.geometry, Some(self.basis));
            for (got, want) in got.tau.iter().zip(&want.tau) {
                (0..CHANNELS).for_each(|c| error.add(f64::from(want[c]), f64::from(got[c])));
            }
        }
        Decibels(30.0 - error.snr().unwrap().0)
    }
}

#[test]
fn a_metric_may_have_tiles_of_another_kind_than_the_file() {
    let mixed = Recovered::mixed(small_geometry(), 4, 3);
    let basis = mixed.basis.as_ref().unwrap();
    let only = |kind: &dyn Fn(&FloatTile) -> bool| -> Vec<FloatTile> {
        let of_kind = |tile: &FloatTile| match kind(tile) {
            true => tile.clone(),
            false => FloatTile::dark(tile.rect),
        };
        mixed.tiles.iter().map(of_kind).collect()
    };
    let direct = only(&|tile| tile.coefficients.is_empty());
    let factored = only(&|tile| tile.functions.is_empty());
    for (tiles, metric_tiles) in [(&direct, &factored), (&factored, &direct)] {
        let recovered = Recovered {
            tiles: tiles.clone(),
            ..mixed.clone()
        };
        let metric = KnownTransportMetric {
            geometry: mixed.geometry.clone(),
            basis,
            tiles: metric_tiles.clone(),
        };
        let quality = EncodingTarget::Loss(Decibels(0.0), &metric);
        let snr = recovered.encode(quality).unwrap().snr().unwrap();
        // The same step gives different errors in factored and direct tiles.
        assert!((20.0..40.0).contains(&snr.0), "{snr}");
    }
}

#[test]
fn only_visible_tiles_are_wanted() {
    let geometry = geometry([64, 48], [32, 24], 5, [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]]);
    let file = Recovered::mixed(geometry, 6, 2).file(QUALITY);
    let mut reader = LtmReader::new(Limits::default());
    let first = reader.wants(&ChunkSelection::default());
    assert_eq!((first.len(), &first[0]), (1, &(0..format::FIRST_BYTES)));
    let index_bytes = read(&file, file.len()).unwrap().index_bytes().unwrap();
    reader.feed(0, &file[..200]).unwrap();
    let then = reader.wants(&ChunkSelection::default());
    assert_eq!((then.len(), &then[0]), (1, &(200..index_bytes)));
    reader.feed(200, &file[200..index_bytes as usize]).unwrap();
    let selection = ChunkSelection {
        viewport: Some((20..33, 9..16)),
        snr: None,
    };
    // Tiles 2, 3 and 4 of the second row of eight.
    let index = reader.index().unwrap().clone();
    let visible = [10, 11, 12];
    for range in reader.wants(&selection) {
        let chunk = index
            .chunks()
            .find(|chunk| index.range(*chunk).start == range.start)
            .unwrap();
        assert!(
            chunk.tile.is_none_or(|tile| visible.contains(&tile)),
            "{chunk:?}"
        );
        reader
            .feed(range.start, &file[range.start as usize..range.end as usize])
            .unwrap();
    }
    assert!(reader.wants(&selection).is_empty());
    let rest: u64 = reader
        .wants(&ChunkSelection::default())
        .iter()
        .map(|r| r.end - r.start)
        .sum();
    let others = index
        .chunks()
        .filter(|chunk| chunk.tile.is_some_and(|tile| !visible.contains(&tile)));
    let others: u64 = others
        .map(|chunk| index.range(chunk).end - index.range(chunk).start)
        .sum();
    assert_eq!(rest, others);
    let (whole, _) = decode(&file, file.len()).unwrap();
    let (visible_part, _) = reader.finish_early().unwrap();
    for tile in visible {
        assert_eq!(visible_part.tiles[tile], whole.tiles[tile]);
    }
    assert!(visible_part.tiles[20].is_dark() && !whole.tiles[20].is_dark());
}

/// For viewers with little memory.
#[test]
fn a_limited_reader_has_the_first_components_and_wants_no_others() {
    let mixed = Recovered::mixed(small_geometry(), 12, 3);
    let mut factored = Recovered::mixed(small_geometry(), 12, 4);
    for tile in factored.tiles.iter_mut().step_by(2) {
        *tile = FloatTile::dark(tile.rect);
    }
    for recovered in [mixed, factored] {
        let file = recovered.file(EncodingTarget::Snr(Decibels(35.0)));
        let (whole, _) = decode(&file, file.len()).unwrap();
        let mut reader = LtmReader::new(Limits::default());
        reader.limit_tiles(1);
        let mut fed = 0;
        while let Some(range) = reader.wants(&ChunkSelection::default()).first() {
            let end = file.len().min(range.end as usize);
            let bytes = &file[range.start as usize..end];
            reader.feed(range.start, bytes).unwrap();
            fed = fed.max(end);
        }
        let progress = reader.progress();
        assert_eq!(progress.tiles, whole.tiles.len());
        let index = read(&file, file.len()).unwrap().index().unwrap().clone();
        let is_needed = |scan: &ProgressiveScan| scan.coding.is_direct() || scan.first < 4;
        let last = index.scans.iter().rposition(is_needed).unwrap();
        assert_eq!(progress.file_bytes.unwrap(), index.scan_range(last).end);
        // A server may send the whole file.
        reader.feed(fed as u64, &file[fed..]).unwrap();
        let (part, _) = reader.finish().unwrap();
        let (rank, of) = (part.basis.rank(), whole.basis.rank());
        assert!(rank == 4 && of > 4, "{rank} of {of}");
        assert_eq!(part.basis.kernels, whole.basis.kernels[..rank]);
        for (part, whole) in part.tiles.iter().zip(&whole.tiles) {
            assert_eq!(part.functions, whole.functions);
            let pixels = 0..part.rect().extent.area();
            for (p, k) in pixels.flat_map(|p| (0..rank).map(move |k| (p, k))) {
                let pairs = part.coefficient(rank, p, k).into_iter();
                for (c, (a, b)) in pairs.zip(whole.coefficient(of, p, k)).enumerate() {
                    let step = part.coefficients.step[c].max(whole.coefficients.step[c]);
                    assert!((a - b).abs() <= 1.01 * step, "{a}, not {b}");
                }
            }
        }
    }
}

#[test]
fn dark_tiles_take_no_bytes() {
    let geometry = geometry(
        [320, 320],
        [160, 160],
        3,
        [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]],
    );
    let mut recovered = Recovered::direct(geometry, 1);
    for tile in &mut recovered.tiles[2..] {
        *tile = FloatTile::dark(tile.rect);
    }
    let file = recovered.file(QUALITY);
    let mut one = recovered.clone();
    one.geometry.camera.width = 16;
    one.geometry.camera.height = 8;
    one.tiles.truncate(2);
    let alone = one.file(QUALITY);
    assert!(
        file.len() < alone.len() + 60,
        "{} {}",
        file.len(),
        alone.len()
    );
    let (transport, _) = decode(&file, 999).unwrap();
    assert!(transport.tiles[2..].iter().all(Tile::is_dark));
    for tile in &mut recovered.tiles {
        *tile = FloatTile::dark(tile.rect);
    }
    for quality in [
        QUALITY,
        EncodingTarget::Bytes(1000),
        EncodingTarget::Lossless,
    ] {
        let (transport, _) = decode(&recovered.file(quality), 7).unwrap();
        assert!(transport.tiles.iter().all(Tile::is_dark));
    }
}

#[test]
fn a_transport_with_one_lit_tile_reaches_the_target_snr() {
    let affine = [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]];
    let geometry = geometry([112, 112], [56, 56], 3, affine);
    let mut recovered = Recovered::mixed(geometry, 4, 9);
    let dark = recovered.tiles.len() - 1;
    for tile in &mut recovered.tiles[..dark] {
        *tile = FloatTile::dark(tile.rect);
    }
    let file = recovered.file(QUALITY);
    let decoded = decode(&file, 500).unwrap().0;
    let snr = recovered.error(&decoded).snr().unwrap();
    assert!((29.0..33.0).contains(&snr.0), "{snr}");
}

/// Errors at the borders of tiles are no larger than inside, for smooth light transport under a uniform light and under
/// the edge of a shadow.
#[test]
fn tiles_have_no_seams() {
    let side = 64;
    let affine = [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]];
    let geometry = common::tiled([128, 128], [64, 64], 7, side, affine);
    let area = geometry.window.area();
    let kernel = |k: usize| -> Vec<f32> {
        (0..area)
            .map(|s| ((s * (k + 1)) as f32 * 0.11).cos() + 0.3)
            .collect()
    };
    let mut noise = Noise(4);
    let mut recovered = Recovered {
        geometry: geometry.clone(),
        basis: Some(Basis {
            kernels: (0..6).map(kernel).collect(),
        }),
        tiles: Vec::new(),
    };
    for rect in geometry.tiles() {
        let mut tile = FloatTile::dark(rect);
        let coefficients = rect.pixels().flat_map(|pixel| {
            let (x, y) = (pixel.x as f32 / 20.0, pixel.y as f32 / 27.0);
            let value =
                |k: usize| ((x + k as f32).sin() * (y - k as f32).cos() + 1.1) / (k + 1) as f32;
            (0..6).map(value).collect::<Vec<_>>()
        });
        let coefficients = coefficients
            .map(|value| [0.9, 0.6, 0.3].map(|c| c * value + 0.02 * (noise.next() as f32 - 0.5)));
        tile.coefficients = coefficients.collect();
        recovered.tiles.push(tile);
    }
    let file = recovered.file(EncodingTarget::Snr(Decibels(28.0)));
    let (decoded, _) = decode(&file, file.len()).unwrap();
    let window = geometry.window;
    for edge in [64.0, 31.3] {
        let (mut border, mut inside) = ([0.0, 0.0], [0.0, 0.0]);
        for (i, tile) in decoded.tiles.iter().enumerate() {
            let want = recovered.functions(i);
            let got = tile.functions(&geometry, &decoded.basis);
            for (p, pixel) in tile.rect().pixels().enumerate() {
                let origin = geometry.window_origin(pixel);
                let mut off = 0.0;
                for s in 0..area {
                    let element = window.element(origin, s);
                    if element.index_in(geometry.light).is_some() && f64::from(element.u) < edge {
                        off += f64::from(got.tau[p * area + s][1] - want.tau[p * area + s][1]);
                    }
                }
                let at_border = |x: u32| x == side - 1 || x == side;
                let sums = match at_border(pixel.x) || at_border(pixel.y) {
                    true => &mut border,
                    false => &mut inside,
                };
                sums[0] += off * off;
                sums[1] += 1.0;
            }
        }
        let [border, inside] = [border, inside].map(|[squares, count]| squares / count);
        assert!(
            inside > 0.0 && border < 1.6 * inside,
            "edge {edge}: squared error {border} at borders, {inside} inside"
        );
    }
}

#[test]
fn every_truncated_file_is_refused_and_gives_the_transport_of_its_chunks() {
    for file in small_files() {
        let index_bytes = read(&file, file.len()).unwrap().index_bytes().unwrap();
        for length in 0..file.len() {
            let error = decode(&file[..length], 97).unwrap_err();
            assert!(
                matches!(error, FormatError::Truncated { got, .. } if got == length as u64),
                "cut to {length}: {error}"
            );
            let early = read(&file[..length], 97).unwrap().finish_early();
            assert_eq!(
                early.is_ok(),
                length as u64 >= index_bytes,
                "cut to {length}"
            );
        }
    }
}

#[test]
fn every_flipped_bit_is_refused() {
    for file in small_files() {
        for byte in 0..file.len() {
            let mut damaged = file.clone();
            for bit in 0..8 {
                damaged[byte] = file[byte] ^ (1 << bit);
                assert!(
                    decode(&damaged, 1 << 20).is_err(),
                    "bit {bit} of byte {byte}"
                );
            }
        }
    }
}

/// The mutated files have correct checksums, so that decoders see the mutations. They give errors or finite values.
#[test]
fn ten_thousand_mutations_give_errors_or_finite_values() {
    let limits = Limits {
        decoded_bytes: 64 << 20,
    };
    let files = small_files();
    let mut noise = Noise(11);
    let mut outcomes = [0, 0];
    for round in 0..10_000 {
        let mut file = files[round % files.len()].clone();
        for _ in 0..1 + (noise.next() * 4.0) as usize {
            let at = (noise.next() * file.len() as f64) as usize;
            match (noise.next() * 4.0) as u32 {
                0 => file[at] ^= 1 << (noise.next() * 8.0) as u32,
                1 => file[at] = (noise.next() * 256.0) as u8,
                2 => file[at] = [0, 0xFF, 0x7F, 0x80][(noise.next() * 4.0) as usize],
                _ => {
                    let from = (noise.next() * file.len() as f64) as usize;
                    file[at] = file[from];
                }
            }
        }
        let file = sealed(file, |_| {});
        let mut reader = LtmReader::new(limits);
        let result = reader.feed(0, &file).and_then(|()| reader.finish());
        if let Ok((transport, _)) = &result {
            assert!(steps(transport).all(f32::is_finite), "round {round}");
        }
        outcomes[usize::from(result.is_ok())] += 1;
    }
    // Both are common: the test covers both paths.
    assert!(
        outcomes.iter().all(|count| *count > 500),
        "refused and read: {outcomes:?}"
    );
}

#[test]
fn error_messages_name_the_fault() {
    let file = mixed().file(QUALITY);
    let message = |edit: &dyn Fn(&mut Vec<u8>)| {
        let mut file = file.clone();
        edit(&mut file);
        decode(&file, 1 << 20).unwrap_err().to_string()
    };
    assert!(message(&|f| f[..5].copy_from_slice(b"<html")).contains("not an .ltm file"));
    assert!(
        message(&|f| {
            f.remove(9);
        })
        .contains("line ends were converted")
    );
    assert!(message(&|f| f.iter_mut().for_each(|b| *b &= 0x7F)).contains("highest bit"));
    let utf8 = |f: &mut Vec<u8>| *f = f.iter().map(|&b| char::from(b)).collect::<String>().into();
    assert!(message(&utf8).contains("in UTF-8"));
    assert!(message(&|f| f[..4].copy_from_slice(b"\x89PNG")).contains("PNG picture"));
    let mangled = [&file[..8], b"\n\x1A\n"].concat();
    let error = decode(&mangled, 1).unwrap_err();
    let line_ends = FormatError::TextModeTransfer(TextModeDamage::LineEnds);
    assert_eq!(error.to_string(), line_ends.to_string());
    // Versions in the magic number and in the field.
    assert!(message(&|f| f[5..7].copy_from_slice(b"01")).contains("version 0.1"));
    assert!(message(&|f| f[12] = 2).contains("version 2.0"));
    assert!(message(&|f| f[20] ^= 1).contains("header is damaged"));
    assert!(message(&|f| f[HEADER_BYTES + 9] ^= 1).contains("directory is damaged"));
    let last = message(&|f| *f.last_mut().unwrap() ^= 1);
    assert!(last.contains("tile 4) is damaged"), "{last}");
    assert!(message(&|f| f.push(0)).contains("goes on after its end"));
    assert!(message(&|f| f.truncate(50)).contains("cut short"));
}

#[test]
fn other_minor_versions_and_unknown_extensions_are_read_unless_they_must_be_understood() {
    let extension = |must_understand| FormatExtension {
        tag: *b"TEST",
        must_understand,
        data: vec![1, 2, 3],
    };
    let recovered = mixed();
    let plain = decode(&recovered.file(QUALITY), 100).unwrap();
    let encode = |extensions| {
        bytes(
            &recovered
                .encode_by(QUALITY, &SequentialExecutor, metadata(), extensions)
                .unwrap(),
        )
    };
    let file = encode(vec![extension(false), extension(false)]);
    assert!(decode(&file, 100).unwrap() == plain);
    let kept = read(&file, 100)
        .unwrap()
        .index()
        .unwrap()
        .extensions
        .clone();
    assert_eq!(kept, [extension(false), extension(false)]);
    let newer = sealed(file, |f| f[14] = 7);
    assert!(decode(&newer, 100).unwrap() == plain);
    let error = decode(&encode(vec![extension(true)]), 100).unwrap_err();
    assert!(
        matches!(error, FormatError::UnknownExtension(tag) if &tag == b"TEST"),
        "{error}"
    );
}

#[test]
fn invalid_displacements_are_refused() {
    let mut recovered = mixed();
    recovered.geometry = common::bent(recovered.geometry);
    let other = FormatExtension {
        tag: *b"TEST",
        must_understand: false,
        data: vec![0; 8],
    };
    let encode =
        |extensions| recovered.encode_by(QUALITY, &SequentialExecutor, metadata(), extensions);
    let file = bytes(&encode(vec![other.clone()]).unwrap());
    let (transport, _) = decode(&file, 100).unwrap();
    assert_eq!(transport.geometry, recovered.geometry);
    let at = |tag: &[u8]| file.windows(4).position(|bytes| bytes == tag).unwrap();
    let (record, second) = (at(b"DISP"), at(b"TEST"));
    let data = record + 12;
    let refused = |at: usize, value: &[u8], part: &str| {
        let edit = |f: &mut Vec<u8>| f[at..at + value.len()].copy_from_slice(value);
        let error = decode(&sealed(file.clone(), edit), 100)
            .unwrap_err()
            .to_string();
        assert!(error.contains(part), "{value:?}: {error}");
    };
    for spacing in [0u16, 7, 4097, u16::MAX] {
        refused(data, &spacing.to_le_bytes(), "displacement");
    }
    // Another spacing has another number of control points.
    refused(data, &9u16.to_le_bytes(), "extensions");
    for step in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        refused(data + 4, &step.to_le_bytes(), "displacement");
    }
    refused(data + 8, b"no frame", "extensions");
    refused(second, b"DISP", "two displacements");
    refused(record, b"OTHR", "OTHR");
    let foreign = FormatExtension {
        tag: *b"DISP",
        ..other
    };
    let error = encode(vec![foreign]).unwrap_err().to_string();
    assert!(error.contains("DISP"), "{error}");
}

/// Offsets of the header's fields.
mod field {
    pub const RANK: usize = 96;
    pub const SCANS: usize = 100;
    pub const DIRECTORY_BYTES: usize = 104;
    pub const EXTENSION_BYTES: usize = 112;
    pub const METADATA_BYTES: usize = 120;
    // Of a scan record in the decompressed directory.
    pub const CODING: usize = 0;
    pub const FIRST: usize = 2;
    pub const COUNT: usize = 4;
    pub const STEP: usize = 8;
    pub const BASIS_BYTES: usize = 16;
    pub const SCAN_RECORD_BYTES: usize = 24;
}

#[test]
fn a_crafted_file_is_refused_with_its_fault() {
    let file = mixed().file(QUALITY);
    let header = |at: usize, value: u32| {
        let edit = |f: &mut Vec<u8>| f[at..at + 4].copy_from_slice(&value.to_le_bytes());
        decode(&sealed(file.clone(), edit), 1 << 20).unwrap_err()
    };
    let error = header(field::RANK, u32::MAX);
    assert!(
        matches!(
            error,
            FormatError::TooMany {
                quantity: "basis functions",
                value: u32::MAX,
                ..
            }
        ),
        "{error}"
    );
    let sides = |camera: [u32; 2], light: [u32; 2]| {
        let sides = [camera, light, [9, 8]];
        let edit = |f: &mut Vec<u8>| {
            for (i, side) in sides.as_flattened().iter().enumerate() {
                f[16 + 4 * i..][..4].copy_from_slice(&side.to_le_bytes());
            }
        };
        decode(&sealed(file.clone(), edit), 1 << 20).unwrap_err()
    };
    let error = sides([(1 << 20) + 1, 1], [1, 1]);
    assert!(
        error.to_string().contains("camera width is 1048577"),
        "{error}"
    );
    for (camera, light) in [
        ([1 << 20, (1 << 16) + 1], [1, 1]),
        ([1, 1], [1 << 20, (1 << 16) + 1]),
    ] {
        let error = sides(camera, light);
        assert!(matches!(error, FormatError::InvalidGeometry(_)), "{error}");
    }
    let error = sides([1 << 20, 1 << 16], [1, 1]);
    assert!(
        matches!(
            error,
            FormatError::TooMany {
                quantity: "tiles",
                ..
            }
        ),
        "{error}"
    );
    // A file of a few kilobytes has a long light plane: a program must not allocate its border.
    let error = sides([8, 8], [1 << 20, 1]);
    assert!(matches!(error, FormatError::Limit { .. }), "{error}");
    let error = header(field::RANK, 3);
    assert!(matches!(error, FormatError::InvalidScan { .. }), "{error}");
    let error = header(field::SCANS, 5000);
    assert!(
        matches!(
            error,
            FormatError::TooMany {
                quantity: "scans",
                value: 5000,
                ..
            }
        ),
        "{error}"
    );
    let error = header(field::SCANS, 2);
    assert!(
        error.to_string().contains("directory does not decompress"),
        "{error}"
    );
    let error = header(field::DIRECTORY_BYTES, 1 << 30);
    assert!(
        matches!(error, FormatError::IndexBeyondEnd { .. }),
        "{error}"
    );
    let error = header(field::EXTENSION_BYTES, 1 << 30);
    assert!(
        matches!(
            error,
            FormatError::TooMany {
                quantity: "bytes of extensions",
                ..
            }
        ),
        "{error}"
    );
    let error = header(field::METADATA_BYTES, 1 << 30);
    assert!(
        matches!(
            error,
            FormatError::TooMany {
                quantity: "bytes of metadata",
                ..
            }
        ),
        "{error}"
    );

    // Arrays in place of objects.
    for json in [&b"[\"a\"]"[..], b"{\"capture\":[5,80]}"] {
        let listed = sealed(file.clone(), |f| {
            let length = |at: usize| u32::from_le_bytes(f[at..at + 4].try_into().unwrap()) as usize;
            let start =
                HEADER_BYTES + length(field::DIRECTORY_BYTES) + length(field::EXTENSION_BYTES);
            let end = start + length(field::METADATA_BYTES);
            f[start..end].fill(b' ');
            f[start..start + json.len()].copy_from_slice(json);
        });
        let error = decode(&listed, 1 << 20).unwrap_err();
        assert!(error.to_string().contains("expected an object"), "{error}");
    }

    let directory = |at: usize, value: &[u8]| {
        let edit = |d: &mut Vec<u8>| d[at..at + value.len()].copy_from_slice(value);
        let crafted = common::with_directory(&file, edit);
        let error = decode(&crafted, 1 << 20).map(|_| ());
        error.expect_err(&format!("byte {at} of the directory"))
    };
    for (at, value) in [
        (field::CODING, &[0, 0][..]),
        (field::CODING, &[5, 0]),
        (field::CODING, &[3, 0]),
        (field::FIRST, &[1, 0]),
        (field::COUNT, &[0, 0]),
        (field::COUNT, &[200, 0]),
        (field::STEP, &f32::NAN.to_le_bytes()),
        (field::STEP, &0.0f32.to_le_bytes()),
        (field::STEP, &f32::INFINITY.to_le_bytes()),
        (field::BASIS_BYTES, &[0, 0, 0, 0]),
        (field::BASIS_BYTES, &[0, 0, 1, 0]),
    ] {
        let error = directory(at, value);
        assert!(
            matches!(error, FormatError::InvalidScan(0)),
            "{at}: {error}"
        );
    }
    let scans = read(&file, 1000).unwrap().index().unwrap().scans.len();
    let lengths = scans * field::SCAN_RECORD_BYTES;
    let contents = lengths + 4 * 6 * scans;
    // The first scan has no chunk for tile 0, and one for tile 1.
    for (at, value) in [
        (lengths + 4, 0u32),
        (lengths + 4, u32::MAX),
        (contents + 4, 0),
        (contents + 4, u32::MAX),
        (contents, 1),
    ] {
        let error = directory(at, &value.to_le_bytes());
        assert!(
            matches!(
                error,
                FormatError::InvalidChunkEntry(ChunkId { scan: 0, .. })
            ),
            "{at}: {error}"
        );
    }
    let error = directory(lengths, &1u32.to_le_bytes());
    assert!(
        matches!(
            error,
            FormatError::InvalidChunkEntry(ChunkId {
                scan: 0,
                tile: Some(0)
            })
        ),
        "{error}"
    );
    let longer = |d: &mut Vec<u8>| d[lengths + 4] += 1;
    let error = decode(&common::with_directory(&file, longer), 1 << 20).unwrap_err();
    assert!(
        matches!(error, FormatError::LengthMismatch { .. }),
        "{error}"
    );
}

#[test]
fn checking_chunks_one_by_one_agrees_with_reading() {
    for file in small_files() {
        let index = read(&file, file.len()).unwrap().index().unwrap().clone();
        for chunk in index.chunks() {
            let range = index.range(chunk);
            let bytes = &file[range.start as usize..range.end as usize];
            format::check(&index, chunk, bytes).unwrap();
            let mut damaged = bytes.to_vec();
            damaged[bytes.len() / 2] ^= 1;
            let error = format::check(&index, chunk, &damaged).unwrap_err();
            assert!(
                matches!(error, FormatError::ChecksumMismatch(section) if section == SectionName::Chunk(chunk))
            );
            assert!(format::check(&index, chunk, &bytes[1..]).is_err());
        }
    }
}

#[test]
fn values_near_the_limits_of_single_precision_are_written_and_read() {
    for size in [1e37, f32::MAX, 1e-37, f32::MIN_POSITIVE, 1e-45] {
        let mut recovered = mixed();
        for tile in &mut recovered.tiles {
            for values in [&mut tile.coefficients, &mut tile.functions] {
                for value in values.iter_mut().flatten() {
                    *value *= size;
                }
            }
        }
        for quality in [0.0, 30.0, 60.0].map(|snr| EncodingTarget::Snr(Decibels(snr))) {
            let (transport, _) = decode(&recovered.file(quality), 1000).unwrap();
            assert!(steps(&transport).all(f32::is_finite), "{size:e}");
        }
        decode(&recovered.file(EncodingTarget::Lossless), 1000).unwrap();
    }
}

#[test]
fn a_basis_of_zeros_is_written_and_read() {
    let mut recovered = mixed();
    recovered.basis = Some(Basis {
        kernels: vec![vec![0.0; 9]; 4],
    });
    for quality in [QUALITY, EncodingTarget::Lossless] {
        decode(&recovered.file(quality), 1000).unwrap();
    }
}

/// The quantisation steps of coefficients and direct functions of all tiles.
fn steps(transport: &Transport) -> impl Iterator<Item = f32> {
    let tiles = transport.tiles.iter();
    tiles.flat_map(|tile| [tile.coefficients.step, tile.functions.step].concat())
}

#[test]
fn values_that_are_not_finite_become_zero() {
    let mut recovered = mixed();
    recovered.tiles[1].coefficients[5] = [f32::NAN, f32::INFINITY, 0.1];
    recovered.tiles[2].functions[7] = [f32::NEG_INFINITY, 0.1, f32::NAN];
    for quality in [QUALITY, EncodingTarget::Lossless] {
        let (transport, _) = decode(&recovered.file(quality), 1000).unwrap();
        assert!(steps(&transport).all(f32::is_finite));
    }
}

#[test]
fn a_file_that_needs_too_much_memory_is_refused_before_allocation() {
    let file = mixed().file(QUALITY);
    let mut reader = LtmReader::new(Limits {
        decoded_bytes: 12_000,
    });
    let error = reader.feed(0, &file).unwrap_err();
    assert!(matches!(error, FormatError::Limit { limit: 12_000, need } if need > 17 * 9 * 9 * 8));
    assert!(reader.index().is_none());
}

#[test]
fn the_index_of_a_large_file_needs_memory_for_one_tile() {
    let affine = [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]];
    let file = Recovered::mixed(common::tiled([128, 128], [64, 64], 5, 16, affine), 8, 5);
    let file = file.file(QUALITY);
    let limits = Limits {
        decoded_bytes: smallest_limit(&file) / 2,
    };
    let mut reader = LtmReader::of_index(limits);
    reader.feed(0, &file[..HEADER_BYTES]).unwrap();
    let end = reader.index_bytes().unwrap() as usize;
    reader
        .feed(HEADER_BYTES as u64, &file[HEADER_BYTES..end])
        .unwrap();
    assert!(reader.index().is_some());
    let decoded_bytes = limits.decoded_bytes / 20;
    let refused = LtmReader::of_index(Limits { decoded_bytes }).feed(0, &file[..end]);
    assert!(matches!(refused, Err(FormatError::Limit { .. })));
}

/// The smallest memory limit under which a file opens.
fn smallest_limit(file: &[u8]) -> u64 {
    let mut decoded_bytes = 0;
    loop {
        match LtmReader::new(Limits { decoded_bytes }).feed(0, file) {
            Err(FormatError::Limit { need, .. }) if need > decoded_bytes => decoded_bytes = need,
            result => {
                result.unwrap();
                return decoded_bytes;
            }
        }
    }
}

#[test]
fn a_preview_stays_within_the_memory_limit() {
    let affine = [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]];
    let geometry = common::tiled([128, 128], [64, 64], 5, 32, affine);
    for recovered in [
        Recovered::mixed(geometry.clone(), 8, 5),
        Recovered::direct(geometry, 5),
    ] {
        let file = recovered.file(QUALITY);
        let limit = smallest_limit(&file);
        let index = read(&file, file.len()).unwrap().index().unwrap().clone();
        // A prefix with most components.
        let prefix = index.scan_range(index.scans.len() - 2).end as usize;
        for (decoded_bytes, has_preview) in [(limit, false), (2 * limit, true)] {
            let mut reader = LtmReader::new(Limits { decoded_bytes });
            reader.feed(0, &file[..prefix]).unwrap();
            assert_eq!(reader.preview().unwrap().is_some(), has_preview);
            reader.feed(prefix as u64, &file[prefix..]).unwrap();
            reader.finish().unwrap();
        }
    }
}

#[test]
fn a_file_is_read_with_the_memory_that_its_index_asks_for() {
    let affine = [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]];
    let geometry = common::tiled([64, 64], [32, 32], 5, 32, affine);
    for recovered in [
        Recovered::mixed(geometry.clone(), 8, 5),
        Recovered::direct(geometry, 5),
    ] {
        for target in [QUALITY, EncodingTarget::Lossless] {
            let file = recovered.file(target);
            let decoded_bytes = smallest_limit(&file);
            let mut reader = LtmReader::new(Limits { decoded_bytes });
            reader.feed(0, &file).unwrap();
            reader.finish().unwrap();
        }
    }
}

#[test]
fn scans_keep_their_shares_of_the_file() {
    let affine = [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]];
    let geometry = common::tiled([128, 128], [64, 64], 5, 64, affine);
    for (recovered, target) in [
        (
            Recovered::mixed(geometry.clone(), 8, 5),
            EncodingTarget::Snr(Decibels(35.0)),
        ),
        (
            Recovered::mixed(geometry.clone(), 2, 5),
            EncodingTarget::Snr(Decibels(45.0)),
        ),
        (
            Recovered::direct(geometry.clone(), 5),
            EncodingTarget::Snr(Decibels(35.0)),
        ),
        (Recovered::direct(geometry, 5), EncodingTarget::Lossless),
    ] {
        for encoded in [
            recovered.encode(target).unwrap(),
            recovered.encode_planned(target, 16, |_| true),
        ] {
            keeps_its_shares(&encoded, target);
        }
    }

    fn keeps_its_shares(encoded: &EncodedFile, target: EncodingTarget<'_>) {
        let index = encoded.index();
        let share = |bytes: u64| bytes as f64 / encoded.bytes() as f64;
        // The first layer ends where the first coding begins again.
        let coding = index.scans[0].coding;
        let again = |scan: &format::ProgressiveScan| scan.coding == coding && scan.first == 0;
        let later = index.scans[1..].iter().position(again);
        let later = later.map_or(1, |at| at + 1);
        let first = share(index.scan_range(later - 1).end);
        assert!(first <= 0.1, "first layer {first} for {target:?}");
        let mut snr = index.scans[later - 1].snr.0;
        for scan in later..index.scans.len() {
            let range = index.scan_range(scan);
            let share = share(range.end - range.start);
            assert!(share <= 0.25, "scan {scan}: {share} for {target:?}");
            assert!(index.scans[scan].snr.0 > snr, "scan {scan} for {target:?}");
            snr = index.scans[scan].snr.0;
        }
    }
}

#[test]
fn tiles_encoded_one_by_one_have_the_snr_that_their_plan_is_for() {
    let affine = [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]];
    let geometry = common::tiled([120, 90], [64, 64], 5, 32, affine);
    for recovered in [
        Recovered::mixed(geometry.clone(), 8, 5),
        Recovered::direct(geometry, 7),
    ] {
        for quality in [20.0, 35.0, 55.0] {
            let target = EncodingTarget::Snr(Decibels(quality));
            let encoded = recovered.encode_planned(target, 8, |_| true);
            let (decoded, _) = decode(&bytes(&encoded), usize::MAX).unwrap();
            let (declared, snr) = (encoded.snr().unwrap().0, recovered.error(&decoded).snr());
            assert!((declared - quality).abs() < 1.0, "{declared} for {quality}");
            // The encoder also counts values off the light plane.
            let snr = snr.unwrap().0;
            assert!(
                (snr - declared).abs() < 1.0,
                "{snr}, declared as {declared}"
            );
            // Not much larger than the file that is planned from all tiles.
            let whole = recovered
                .encode(EncodingTarget::Snr(Decibels(declared)))
                .unwrap();
            let ratio = encoded.bytes() as f64 / whole.bytes() as f64;
            assert!(ratio < 1.06, "{ratio} at {quality} dB");
        }
        let encoded = recovered.encode_planned(EncodingTarget::Lossless, 8, |_| true);
        let (decoded, _) = decode(&bytes(&encoded), usize::MAX).unwrap();
        let snr = recovered.error(&decoded).snr();
        assert!(snr.unwrap().0 > 55.0, "{snr:?}");
    }
}

#[test]
fn tiles_may_be_of_a_kind_that_the_sample_lacks() {
    let affine = [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]];
    let geometry = common::tiled([120, 90], [64, 64], 5, 32, affine);
    let recovered = Recovered::mixed(geometry, 4, 5);
    let direct = |tile: &FloatTile| tile.coefficients.is_empty();
    let factored = |tile: &FloatTile| tile.functions.is_empty();
    for target in [QUALITY, EncodingTarget::Lossless] {
        for sampled in [direct, factored] {
            let encoded = recovered.encode_planned(target, 8, sampled);
            let (decoded, _) = decode(&bytes(&encoded), usize::MAX).unwrap();
            let snr = recovered.error(&decoded).snr().unwrap().0;
            // The other half of the tiles has another error for its energy, but is there.
            assert!(snr > 20.0, "{snr} for {target:?}");
            let declared = encoded.snr().unwrap().0.min(52.0);
            assert!(snr > declared - 1.0, "{snr}, declared as {declared}");
        }
    }
}

#[test]
fn tiles_may_be_brighter_than_all_of_the_sample() {
    let affine = [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]];
    let geometry = common::tiled([64, 64], [32, 32], 3, 16, affine);
    // A glint, in a corner that the sample does not have.
    let mut recovered = Recovered::mixed(geometry.clone(), 4, 5);
    for tile in &mut recovered.tiles {
        for values in [&mut tile.coefficients, &mut tile.functions] {
            let pixel = values.len() / 256;
            let first = 255 * pixel;
            values[first..]
                .iter_mut()
                .flatten()
                .for_each(|v| *v *= 30.0);
        }
    }
    // A sample without any light.
    let mut dark = Recovered::direct(geometry, 7);
    for tile in &mut dark.tiles {
        let pixel = tile.functions.len() / 256;
        tile.functions[..200 * pixel].fill([0.0; CHANNELS]);
    }
    for (recovered, quality) in [(recovered.clone(), 35.0), (recovered, 60.0), (dark, 40.0)] {
        let encoded = recovered.encode_planned(EncodingTarget::Snr(Decibels(quality)), 8, |_| true);
        assert_eq!(encoded.clipped_tiles(), 0);
        let (decoded, _) = decode(&bytes(&encoded), usize::MAX).unwrap();
        let snr = recovered.error(&decoded).snr().unwrap().0;
        assert!(snr > quality - 10.0, "{snr}");
        // Rounding to twelve bits adds noise.
        let declared = encoded.snr().unwrap().0;
        assert!(
            snr > declared.min(52.0) - 1.0,
            "{snr}, declared as {declared}"
        );
    }
}

#[test]
fn tiles_with_clipped_values_are_counted() {
    let affine = [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]];
    let geometry = common::tiled([64, 64], [32, 32], 3, 16, affine);
    let mut recovered = Recovered::mixed(geometry, 4, 5);
    // Glints far above all that the camera measures: in a direct tile, and in two factored ones.
    for i in [4, 5, 7] {
        let tile = &mut recovered.tiles[i];
        for values in [&mut tile.coefficients, &mut tile.functions] {
            let last = values.len().saturating_sub(1);
            values[last..].fill([1e5, 0.0, 0.0]);
        }
    }
    for target in [
        QUALITY,
        EncodingTarget::Snr(Decibels(60.0)),
        EncodingTarget::Lossless,
    ] {
        let encoded = recovered.encode_planned(target, 8, |_| true);
        assert_eq!(encoded.clipped_tiles(), 3, "{target:?}");
        // A plan from all tiles reaches them.
        let whole = recovered.encode(target).unwrap();
        assert_eq!(whole.clipped_tiles(), 0);
        let [clipped, reached] = [&encoded, &whole].map(|file| file.snr().unwrap().0);
        assert!(
            reached > clipped + 20.0,
            "{clipped} {reached} for {target:?}"
        );
    }
}

#[test]
fn bytes_after_a_gap_are_refused() {
    let file = mixed().file(QUALITY);
    let mut reader = LtmReader::new(Limits::default());
    let error = reader.feed(3, &[0]).unwrap_err();
    assert!(matches!(
        error,
        FormatError::Gap {
            got: 3,
            expected: 0
        }
    ));
    let mut reader = read(
        &file[..read(&file, 9).unwrap().index_bytes().unwrap() as usize],
        9,
    )
    .unwrap();
    let index = reader.index().unwrap().clone();
    let chunk = ChunkId {
        scan: 0,
        tile: Some(1),
    };
    let start = index.range(chunk).start;
    reader
        .feed(start, &file[start as usize..start as usize + 3])
        .unwrap();
    let error = reader
        .feed(start + 5, &file[start as usize + 5..start as usize + 7])
        .unwrap_err();
    assert!(matches!(error, FormatError::Gap { expected, .. } if expected == start + 3));
    assert_eq!(index.scans[0].coding, ScanCoding::Transform);
}

#[test]
fn a_chunk_that_does_not_decode_is_an_error_and_its_scan_is_never_complete() {
    for file in small_files() {
        let chunks: Vec<ChunkId> = read(&file, file.len())
            .unwrap()
            .index()
            .unwrap()
            .chunks()
            .collect();
        for chunk in chunks {
            // With a correct checksum, so that decoding alone can find the fault.
            let damaged = sealed(file.clone(), |f| {
                let index = read(f, f.len()).unwrap().index().unwrap().clone();
                let range = index.range(chunk);
                f[range.start as usize..range.end as usize].fill(0xff);
            });
            let mut reader = LtmReader::new(Limits::default());
            let mut errors = Vec::new();
            while let Some(range) = reader.wants(&ChunkSelection::default()).first() {
                let end = (damaged.len() as u64).min(range.end);
                let bytes = &damaged[range.start as usize..end as usize];
                errors.extend(reader.feed(range.start, bytes).err());
                assert!(errors.len() < 2, "{errors:?}");
            }
            let in_chunk = |error: &FormatError| matches!(error, FormatError::DamagedSection { section, .. } if *section == SectionName::Chunk(chunk));
            assert!(
                errors.iter().all(in_chunk) && errors.len() == 1,
                "{chunk:?}: {errors:?}"
            );
            assert!(reader.progress().scans <= chunk.scan, "{chunk:?}");
            let error = reader.finish().map(|_| ()).unwrap_err();
            assert!(in_chunk(&error), "{error}");
        }
    }
}
