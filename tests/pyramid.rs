//! Files of several levels: level 0 is the picture, and each other one its average.
#![cfg(not(target_arch = "wasm32"))]
#![allow(clippy::unwrap_used)] // a failed test should panic

mod common;

use std::io::Cursor;
use std::ops::Range;

use common::{Noise, functions, tiled};
use relightable_photo::format::{
    ChunkId, EncodedFile, EncoderInput, EncodingTarget, FileIndex, FormatError, Limits, LtmReader,
    Metadata, ShardId, Spool, decode_tile,
};
use relightable_photo::job_executor::SequentialExecutor;
use relightable_photo::pyramid::{
    FetchShard, LevelShares, PyramidLayout, PyramidReader, PyramidSource, make_coarser_shards,
    no_shard, write_pyramid,
};
use relightable_photo::relight::{Light, reference};
use relightable_photo::transport::{
    Basis, CHANNELS, CameraPixel, Decibels, DisplacementGrid, Extent, FloatTile, Geometry,
    LightPosition, LightRegion, TileRect,
};

const TILE: u32 = 16;
const SHARD: u32 = 256;

/// A file of one level.
struct Flat {
    bytes: Vec<u8>,
    index: FileIndex,
}

impl Flat {
    /// Noisy transport; with `rank`, every other tile is factored.
    fn new(geometry: Geometry, rank: usize, target: EncodingTarget<'_>) -> Self {
        let mut noise = Noise(3);
        let area = geometry.window.area();
        let kernel = |_| (0..area).map(|_| noise.next() as f32 - 0.3).collect();
        let basis = Basis {
            kernels: (0..rank).map(kernel).collect(),
        };
        let mut tiles: Vec<_> = functions(geometry.clone(), 5)
            .into_iter()
            .map(FloatTile::from)
            .collect();
        for tile in tiles
            .iter_mut()
            .skip(1)
            .step_by(if rank > 0 { 2 } else { usize::MAX })
        {
            let coefficient = |_| std::array::from_fn(|_| noise.next() as f32);
            tile.coefficients = (0..tile.rect.extent.area() * rank)
                .map(coefficient)
                .collect();
            tile.functions.clear();
        }
        let input = EncoderInput {
            geometry,
            basis: (rank > 0).then_some(&basis),
            tile: &|i| Ok(tiles[i].clone()),
            metadata: Metadata {
                title: "A wall".to_owned(),
                units: "lux".to_owned(),
                ..Metadata::default()
            },
            extensions: Vec::new(),
        };
        let file = EncodedFile::new(input, target, &SequentialExecutor).unwrap();
        let mut bytes = Vec::new();
        file.write(&mut bytes).unwrap();
        let index = file.index().clone();
        Self { bytes, index }
    }

    fn chunk(&self, chunk: ChunkId) -> Vec<u8> {
        bytes_at(&self.bytes, self.index.range(chunk))
    }

    /// The same as a file of several levels.
    fn with_levels(&self, levels: u32) -> Vec<u8> {
        self.with_shards(levels, &no_shard)
    }

    /// The same as a file of several levels, with shards that are made already.
    fn with_shards(&self, levels: u32, made: &FetchShard<'_>) -> Vec<u8> {
        let (mut file, fetch) = (Vec::new(), |chunk| Ok(self.chunk(chunk)));
        let source = PyramidSource {
            index: &self.index,
            fetch: &fetch,
        };
        let executor = SequentialExecutor;
        write_pyramid(source, made, layout(levels), spools(), &executor, &mut file).unwrap();
        file
    }

    /// The shards of coarser levels that each of several processes makes, by their numbers.
    fn shards_of(&self, shares: &LevelShares, processes: usize) -> Vec<Vec<u8>> {
        let geometry = &self.index.header.geometry;
        let mut files = Vec::new();
        for process in 0..processes {
            let rows = shares.rows(process);
            let fetch = |chunk: ChunkId| {
                let tile = chunk.tile.map(|tile| geometry.tile(tile));
                assert!(tile.is_none_or(|tile| rows.contains(&tile.y)));
                Ok(self.chunk(chunk))
            };
            let source = PyramidSource {
                index: &self.index,
                fetch: &fetch,
            };
            let take = |number, file| {
                assert_eq!(number, files.len());
                files.push(file);
                Ok::<_, FormatError>(())
            };
            let executor = SequentialExecutor;
            make_coarser_shards(source, shares, process, spools(), &executor, take).unwrap();
        }
        files
    }
}

fn layout(levels: u32) -> PyramidLayout {
    PyramidLayout {
        shard_side: SHARD,
        ..PyramidLayout::of_levels(levels)
    }
}

fn spools() -> [Spool<Cursor<Vec<u8>>>; 2] {
    [(); 2].map(|()| Spool::new(Cursor::new(Vec::new())))
}

fn bytes_at(file: &[u8], range: Range<u64>) -> Vec<u8> {
    let end = file.len().min(range.end as usize);
    file[(range.start as usize).min(end)..end].to_vec()
}

fn index_of(file: &[u8]) -> Result<FileIndex, FormatError> {
    let mut reader = LtmReader::new(Limits::default());
    let mut at = 0;
    while reader.index().is_none() && at < file.len() {
        reader.feed(at as u64, &file[at..=at])?;
        at += 1;
    }
    reader.index().cloned().ok_or_else(|| reader.truncated())
}

fn open(file: &[u8]) -> Result<PyramidReader, FormatError> {
    let index = index_of(file)?;
    Ok(PyramidReader::new(index, Limits::default())?.unwrap())
}

/// The picture of a level under a light on its light plane.
fn relit(file: &[u8], level: u32, light: &Light) -> Vec<[f64; CHANNELS]> {
    let reader = open(file).unwrap();
    let camera = reader.table().camera(level);
    assert_eq!(light.extent(), reader.table().light(level));
    let whole = TileRect {
        x: 0,
        y: 0,
        extent: camera,
    };
    let mut picture = vec![[0.0; CHANNELS]; camera.area()];
    for id in reader.shards_in(level, whole) {
        let fetch = |range| Ok::<_, FormatError>(bytes_at(file, range));
        let shard = reader.shard(id, whole, fetch).unwrap();
        let light = cropped(light, shard.transport.geometry.light_region());
        let pixels = reference::relight(&shard.transport, &light);
        for (pixel, value) in shard.rect.pixels().zip(pixels) {
            picture[camera.index(pixel)] = value;
        }
    }
    picture
}

/// The elements of a region.
fn cropped(light: &Light, region: LightRegion) -> Light {
    assert_eq!(light.extent(), region.plane);
    let values: Vec<f32> = region
        .centres()
        .flat_map(|LightPosition { u, v }| {
            let element = light.elements()[v as usize * region.plane.width as usize + u as usize];
            [element[0], element[1], element[2]]
        })
        .collect();
    Light::from_linear_rgb(region.extent, &values).unwrap()
}

/// Each pixel's mean over the pixels that it stands for.
fn averaged(picture: &[[f64; CHANNELS]], camera: Extent, level: u32) -> Vec<[f64; CHANNELS]> {
    let side = 1 << level;
    let small = Extent::new(camera.width.div_ceil(side), camera.height.div_ceil(side));
    let mut picture = picture.to_vec();
    let mut camera = camera;
    // By halves, so that pixels at the border count as in the file.
    while camera != small {
        let half = Extent::new(camera.width.div_ceil(2), camera.height.div_ceil(2));
        picture = half
            .cells()
            .map(|(x, y)| {
                let (mut sum, mut count) = ([0.0; CHANNELS], 0.0);
                for y in 2 * y..(2 * y + 2).min(camera.height) {
                    for x in 2 * x..(2 * x + 2).min(camera.width) {
                        let value = picture[camera.index(CameraPixel { x, y })];
                        (0..CHANNELS).for_each(|c| sum[c] += value[c]);
                        count += 1.0;
                    }
                }
                sum.map(|s| s / count)
            })
            .collect();
        camera = half;
    }
    picture
}

/// A random light, constant on the blocks of elements that are one element of `level`: on that level, and on level 0.
fn lights(light: Extent, level: u32) -> [Light; 2] {
    let side = 1 << level;
    let coarse = Extent::new(light.width.div_ceil(side), light.height.div_ceil(side));
    let mut noise = Noise(11);
    let values: Vec<[f32; 3]> = (0..coarse.area())
        .map(|_| [(); 3].map(|()| noise.next() as f32))
        .collect();
    let value = |(u, v): (u32, u32)| values[(v / side * coarse.width + u / side) as usize];
    let fine: Vec<f32> = light.cells().flat_map(value).collect();
    [
        Light::from_linear_rgb(coarse, values.as_flattened()).unwrap(),
        Light::from_linear_rgb(light, &fine).unwrap(),
    ]
}

/// The largest difference of two pictures, relative to the largest value.
fn difference(a: &[[f64; CHANNELS]], b: &[[f64; CHANNELS]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    let peak = a.as_flattened().iter().copied().fold(0.0, f64::max);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / peak
}

fn geometries() -> [Geometry; 2] {
    // Odd sides on every level, windows beyond the light plane, and positions on borders of elements. The displacement's
    // control points lie beside the shards' borders.
    let affine = [[0.5, 0.03, 2.0], [-0.02, 0.48, 3.5]];
    let straight = tiled([601, 299], [297, 141], 5, TILE, affine);
    let mut bent = straight.clone();
    let points = DisplacementGrid::points_over(bent.camera, 24);
    let code = |(i, j): (u32, u32)| [(i % 7) as i16 - 3, 2 * (j % 3) as i16 - (i % 2) as i16];
    let codes = points.cells().map(code).collect();
    let grid = DisplacementGrid::new(24, 0.25, points, codes).unwrap();
    bent.correspondence.displacement = Some(grid.into());
    [straight, bent.validate().unwrap()]
}

#[test]
fn the_finest_level_decodes_to_the_same_values() {
    for geometry in geometries() {
        let flat = Flat::new(geometry, 3, EncodingTarget::Snr(Decibels(30.0)));
        let file = flat.with_levels(3);
        let reader = open(&file).unwrap();
        assert_eq!(reader.file_bytes(), file.len() as u64);
        let camera = flat.index.header.geometry.camera;
        let whole = TileRect {
            x: 0,
            y: 0,
            extent: camera,
        };
        for id in reader.shards_in(0, whole) {
            let fetch = |range| Ok::<_, FormatError>(bytes_at(&file, range));
            let index = reader.index(id, fetch).unwrap();
            let origin = index.header.geometry.correspondence.origin.camera;
            let start = reader.range(id).unwrap().start;
            for (i, rect) in index.header.geometry.tiles().enumerate() {
                let [x, y] = [rect.x + origin[0], rect.y + origin[1]];
                let grid = flat.index.header.geometry.tile_grid();
                let same = (y / TILE * grid.width + x / TILE) as usize;
                let fetch = |chunk| {
                    let Range {
                        start: from,
                        end: to,
                    } = index.range(chunk);
                    Ok::<_, FormatError>(bytes_at(&file, start + from..start + to))
                };
                let got = decode_tile(&index, i, fetch).unwrap();
                let fetch = |chunk| Ok::<_, FormatError>(flat.chunk(chunk));
                let expected = decode_tile(&flat.index, same, fetch).unwrap();
                assert_eq!(got.coefficients, expected.coefficients);
                assert_eq!(got.functions, expected.functions);
                for pixel in rect.pixels() {
                    let of_shard = index.header.geometry.window_origin(pixel);
                    let of_file = flat.index.header.geometry.window_origin(CameraPixel {
                        x: pixel.x + origin[0],
                        y: pixel.y + origin[1],
                    });
                    let [u, v] = index.header.geometry.correspondence.origin.light;
                    let moved = [of_shard.u + u as i32, of_shard.v + v as i32];
                    assert_eq!(moved, [of_file.u, of_file.v]);
                }
            }
        }
        assert_eq!(reader.root().metadata, flat.index.metadata);
    }
}

#[test]
fn a_level_is_the_average_for_lights_that_are_constant_on_its_elements() {
    // Direct tiles, and factored ones among them.
    for (geometry, rank) in geometries().into_iter().zip([0, 3]) {
        let flat = Flat::new(geometry.clone(), rank, EncodingTarget::Lossless);
        let file = flat.with_levels(3);
        for level in 0..3 {
            let [coarse, fine] = lights(geometry.light, level);
            let picture = relit(&file, 0, &fine);
            let expected = averaged(&picture, geometry.camera, level);
            let got = relit(&file, level, &coarse);
            let difference = difference(&expected, &got);
            assert!(
                difference < 2e-3,
                "level {level}, rank {rank}: {difference}"
            );
        }
    }
}

#[test]
fn quantised_levels_are_as_accurate_as_the_finest() {
    let [geometry, _] = geometries();
    let flat = Flat::new(geometry.clone(), 3, EncodingTarget::Snr(Decibels(30.0)));
    let file = flat.with_levels(3);
    for level in 1..3 {
        let [coarse, fine] = lights(geometry.light, level);
        let expected = averaged(&relit(&file, 0, &fine), geometry.camera, level);
        let difference = difference(&expected, &relit(&file, level, &coarse));
        assert!(difference < 0.05, "level {level}: {difference}");
    }
}

#[test]
fn several_processes_make_the_shards_of_one() {
    let affine = [[0.5, 0.03, 2.0], [-0.02, 0.48, 3.5]];
    let wide = tiled([1100, 40], [540, 30], 5, TILE, affine);
    let tall = tiled([70, 530], [40, 260], 5, TILE, affine);
    let snr = EncodingTarget::Snr(Decibels(30.0));
    for (geometry, levels, target, all_processes) in [
        (tall, 3, EncodingTarget::Lossless, &[2][..]),
        (wide.clone(), 4, snr, &[1, 7]),
    ] {
        let table = layout(levels).table(&geometry).unwrap();
        let flat = Flat::new(geometry, 3, target);
        let expected = flat.with_levels(levels);
        for &processes in all_processes {
            let shares = LevelShares::new(table.clone(), processes);
            let files = flat.shards_of(&shares, processes);
            assert_eq!(files.len(), shares.shards().len());
            let made = |shard| Ok(shares.number(shard).map(|number| files[number].clone()));
            assert!(flat.with_shards(levels, &made) == expected);
            let odd = |shard| shares.number(shard).filter(|number| number % 2 == 1);
            let made = |shard| Ok(odd(shard).map(|number| files[number].clone()));
            assert!(flat.with_shards(levels, &made) == expected);
        }
    }
    // The writer copies shards that other processes made.
    let coarse = Flat::new(wide.clone(), 3, EncodingTarget::Snr(Decibels(20.0)));
    let flat = Flat::new(wide.clone(), 3, snr);
    let shares = LevelShares::new(layout(4).table(&wide).unwrap(), 1);
    let files = coarse.shards_of(&shares, 1);
    let made = |shard| Ok(shares.number(shard).map(|number| files[number].clone()));
    let file = flat.with_shards(4, &made);
    let reader = open(&file).unwrap();
    for (id, shard) in shares.shards().iter().zip(&files) {
        assert!(bytes_at(&file, reader.range(*id).unwrap()) == *shard);
    }
    // A shard of another place is told.
    let misplaced = |shard| Ok(shares.number(shard).map(|_| files[0].clone()));
    let source = PyramidSource {
        index: &flat.index,
        fetch: &|chunk| Ok(flat.chunk(chunk)),
    };
    let (executor, mut out) = (SequentialExecutor, Vec::new());
    let file = write_pyramid(source, &misplaced, layout(4), spools(), &executor, &mut out);
    assert!(
        matches!(file, Err(FormatError::DamagedSection { .. })),
        "{file:?}"
    );
}

#[test]
fn damaged_tables_and_shards_are_refused() {
    let [geometry, _] = geometries();
    let flat = Flat::new(geometry, 0, EncodingTarget::Snr(Decibels(20.0)));
    let file = flat.with_levels(3);
    let reader = open(&file).unwrap();
    let shard = |level, x, y| ShardId { level, x, y };
    let rect = TileRect {
        x: 0,
        y: 0,
        extent: Extent::new(600, 299),
    };
    // The place of another shard, a cut file, and a damaged header.
    let read = |file: &[u8], id| {
        let fetch = |range| Ok::<_, FormatError>(bytes_at(file, range));
        reader.shard(id, rect, fetch).map(drop)
    };
    let [first, second] = [(0, 0), (1, 0)].map(|(x, y)| reader.range(shard(0, x, y)).unwrap());
    let swapped = |range: Range<u64>| {
        let moved = second.start - first.start;
        Ok::<_, FormatError>(bytes_at(&file, range.start + moved..range.end + moved))
    };
    let error = reader.shard(shard(0, 0, 0), rect, swapped).unwrap_err();
    assert!(
        error.to_string().contains("shard 0, 0 of level 0"),
        "{error}"
    );
    let Range { start, end } = reader.range(shard(0, 2, 1)).unwrap();
    assert_eq!(end, file.len() as u64);
    let error = read(&file[..end as usize - 1], shard(0, 2, 1)).unwrap_err();
    assert!(matches!(error, FormatError::Truncated { .. }), "{error}");
    let mut damaged = file.clone();
    damaged[start as usize + 50] ^= 1; // in its header
    let error = read(&damaged, shard(0, 2, 1)).unwrap_err();
    assert!(matches!(error, FormatError::ChecksumMismatch(_)), "{error}");
    assert!(read(&file, shard(0, 2, 1)).is_ok());
    for id in [shard(0, 3, 0), shard(2, 1, 0), shard(3, 0, 0)] {
        assert!(read(&file, id).is_err(), "{id}");
    }
}
