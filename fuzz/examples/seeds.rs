//! Writes the seeds of the targets that take files: one small file in each coding, and one small photograph in each format.
//!
//! Run `cargo run --manifest-path fuzz/Cargo.toml --example seeds` after a change of the format.

use std::io::Cursor;
use std::path::Path;

use fuzzing::choices::Choices;
use fuzzing::source::ArbitraryInput;
use image::{DynamicImage, ImageFormat};
use relightable_photo::format::{EncodingTarget, FormatError, Metadata, Spool};
use relightable_photo::job_executor::SequentialExecutor;
use relightable_photo::pyramid::{PyramidLayout, PyramidSource, no_shard, write_pyramid};
use relightable_photo::transport::{
    Basis, Correspondence, Decibels, Extent, FloatTile, Geometry, Window,
};

/// Two tiles of at most 8 x 8 pixels: the first factored if `rank` is not 0, the other direct.
fn input(rank: usize) -> ArbitraryInput {
    let geometry = Geometry {
        camera: Extent {
            width: 10,
            height: 8,
        },
        light: Extent {
            width: 5,
            height: 4,
        },
        window: Window::new(3).expect("an odd side"),
        correspondence: Correspondence::from_affine([[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]]),
        tile_side: 8,
    };
    let mut noise = Choices(&[7]).noise();
    let mut colours = |count: usize| -> Vec<[f32; 3]> {
        (0..count)
            .map(|i| [1.0, 0.7, 0.3].map(|c| c / (1 + i % 9) as f32 + 0.03 * noise.signed()))
            .collect()
    };
    let area = geometry.window.area();
    let tiles = geometry.tiles().enumerate().map(|(i, rect)| {
        let (pixels, mut tile) = (rect.extent.area(), FloatTile::dark(rect));
        match i < 1 && rank > 0 {
            true => tile.coefficients = colours(pixels * rank),
            false => tile.functions = colours(pixels * area),
        }
        tile
    });
    let kernel = |k: usize| (0..area).map(|s| ((s * k) as f32).cos()).collect();
    ArbitraryInput {
        geometry,
        tiles: tiles.collect(),
        basis: (rank > 0).then(|| Basis {
            kernels: (0..rank).map(kernel).collect(),
        }),
        metadata: Metadata::default(),
        extensions: Vec::new(),
        is_moderate: true,
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let seeds = Path::new(env!("CARGO_MANIFEST_DIR")).join("seeds");
    let snr = EncodingTarget::Snr(Decibels(20.0));
    for (name, rank, quality) in [
        ("transform", 3, snr),
        ("halves", 2, EncodingTarget::Lossless),
        ("direct", 0, snr),
        ("direct-halves", 0, EncodingTarget::Lossless),
    ] {
        let file = input(rank).encode(quality, &SequentialExecutor)?;
        let mut bytes = Vec::new();
        file.write(&mut bytes)?;
        let index = file.index().header.index_bytes() as usize;
        println!("{name}: {} bytes, {index} of them file index", bytes.len());
        for (target, seed) in [
            ("open", bytes[..index].to_vec()),
            ("decode", bytes.clone()),
            ("chunked", [&bytes[..], &[0; 64]].concat()),
        ] {
            let folder = seeds.join(target);
            std::fs::create_dir_all(&folder)?;
            std::fs::write(folder.join(name), seed)?;
        }
    }
    let folder = seeds.join("levels");
    std::fs::create_dir_all(&folder)?;
    std::fs::write(folder.join("direct"), levels()?)?;
    write_photographs(&seeds.join("photo_file"))
}

/// A file of two levels in three shards, dark but for a direct tile of 8 x 8 pixels.
fn levels() -> Result<Vec<u8>, FormatError> {
    let mut input = input(0);
    input.geometry.camera.width = 264;
    input.geometry.light.width = 132;
    input.geometry.tile_side = 256;
    let lit = input.tiles.swap_remove(0).functions;
    input.tiles = input.geometry.tiles().map(FloatTile::dark).collect();
    input.tiles[1].functions = lit;
    let encoded = input.encode(EncodingTarget::Snr(Decibels(20.0)), &SequentialExecutor)?;
    let mut flat = Vec::new();
    encoded.write(&mut flat)?;
    let index = encoded.index();
    let fetch = |chunk| {
        let range = index.range(chunk);
        Ok(flat[range.start as usize..range.end as usize].to_vec())
    };
    let layout = PyramidLayout {
        shard_side: 256,
        ..PyramidLayout::of_levels(2)
    };
    let spools = [(); 2].map(|()| Spool::new(Cursor::new(Vec::new())));
    let mut file = Vec::new();
    let source = PyramidSource {
        index,
        fetch: &fetch,
    };
    write_pyramid(
        source,
        &no_shard,
        layout,
        spools,
        &SequentialExecutor,
        &mut file,
    )?;
    println!("levels: {} bytes", file.len());
    Ok(file)
}

/// Photographs of 5 x 4 pixels.
fn write_photographs(folder: &Path) -> Result<(), Box<dyn std::error::Error>> {
    const SIZE: (u32, u32) = (5, 4);
    std::fs::create_dir_all(folder)?;
    let code = |x: u32, y: u32| (9000 * x + 700 * y) as u16;
    let rgb = image::ImageBuffer::from_fn(SIZE.0, SIZE.1, |x, y| {
        image::Rgb([code(x, y), code(y, x), code(x, x)])
    });
    let sixteen = DynamicImage::ImageRgb16(rgb);
    let eight = DynamicImage::ImageLumaA8(sixteen.to_luma_alpha8());
    let float = DynamicImage::ImageRgb32F(sixteen.to_rgb32f());
    for (name, image, format) in [
        ("png-rgb-16", &sixteen, ImageFormat::Png),
        ("png-grey-alpha-8", &eight, ImageFormat::Png),
        ("tiff-rgb-16", &sixteen, ImageFormat::Tiff),
        ("tiff-rgb-float", &float, ImageFormat::Tiff),
    ] {
        let mut bytes = Cursor::new(Vec::new());
        image.write_to(&mut bytes, format)?;
        std::fs::write(folder.join(name), bytes.into_inner())?;
    }
    let [width, height] = [SIZE.0 as usize, SIZE.1 as usize];
    let pixel = |x: usize, y: usize| (x as f32 / 4.0, y as f32 / 3.0, -0.01f32);
    exr::prelude::write_rgb_file(folder.join("exr-rgb-float"), width, height, pixel)?;
    Ok(())
}
