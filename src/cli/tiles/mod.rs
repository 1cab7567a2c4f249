//! `ltm-export tiles`: a picture under one light as static tiles, for viewers such as OpenSeadragon.

mod image_pyramid;
mod tile_layout;

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::{Args, ValueEnum};
use image::RgbImage;
use image::codecs::jpeg::JpegEncoder;

use self::image_pyramid::ImagePyramid;
use self::tile_layout::TileLayout;
use super::output_file::InputError;
use super::output_folder::write_atomically;
use super::relit_picture::{PictureArgs, PicturePart, RelitPicture};
use super::report::print_line;
use super::value_parsers::UsageError;

/// Relight an object and write the picture as static tiles, for viewers such as OpenSeadragon
#[derive(Debug, Args)]
pub struct TilesArgs {
    #[command(flatten)]
    picture: PictureArgs,
    /// How the tiles are described and named
    #[arg(long, value_enum, default_value_t = TileFormat::DeepZoom)]
    format: TileFormat,
    /// Address at which the folder will be served, for --format iiif
    #[arg(long, value_name = "URL", value_parser = parse_address)]
    id: Option<String>,
    /// Quality of the JPEG tiles
    #[arg(long, value_name = "1-100", default_value_t = 90, value_parser = clap::value_parser!(u8).range(1..=100))]
    quality: u8,
    /// Folder to write; must be new or empty
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum TileFormat {
    /// Deep Zoom: DIR/picture.dzi and DIR/picture_files
    DeepZoom,
    /// Tiles of IIIF Image API 3, level 0: DIR/info.json and those that it describes
    Iiif,
}

fn parse_address(text: &str) -> Result<String, String> {
    let address = text.trim_end_matches('/');
    let host = ["https://", "http://"]
        .iter()
        .find_map(|scheme| address.strip_prefix(scheme));
    let is_plain = |host: &str| {
        !host.is_empty() && !host.contains(|c: char| c.is_whitespace() || "?#".contains(c))
    };
    match host.is_some_and(is_plain) && !address.ends_with("/info.json") {
        true => Ok(address.to_owned()),
        false => {
            Err("give the folder's address, as in https://museum.example/iiif/window".to_owned())
        }
    }
}

pub fn run(args: &TilesArgs) -> Result<()> {
    args.picture.check()?;
    if args.id.is_some() != (args.format == TileFormat::Iiif) {
        return Err(UsageError("--format iiif needs --id, which goes with no other format").into());
    }
    let mut tiles = 0;
    let written = write_atomically(&args.output, |folder| {
        tiles = write(args, folder)?;
        Ok(())
    });
    written.map_err(InputError::without_output)?;
    print_line(&format!("{}: {tiles} tiles", args.output.display()))
}

/// Writes the tiles and their description into `folder`; returns their number.
fn write(args: &TilesArgs, folder: &Path) -> Result<usize> {
    let picture = RelitPicture::open(&args.picture, &PicturePart::default()).map_err(InputError)?;
    let layout = match &args.id {
        None => TileLayout::deep_zoom(picture.extent()),
        Some(id) => TileLayout::iiif(picture.extent(), id),
    };
    let (name, description) = layout.description();
    std::fs::write(folder.join(&name), description).with_context(|| name.clone())?;
    let mut tiles = 0;
    let mut write_tile = |number: usize, cell: [u32; 2], tile: &RgbImage| -> Result<()> {
        let path = layout.path(number, cell);
        tiles += 1;
        write_jpeg(&folder.join(&path), tile, args.quality).with_context(|| path)
    };
    let mut pyramid = ImagePyramid::new(layout.sizes(), &mut write_tile);
    picture.draw(&mut |row| pyramid.add_row(row))?;
    Ok(tiles)
}

fn write_jpeg(path: &Path, tile: &RgbImage, quality: u8) -> Result<()> {
    if let Some(parent) = path.parent() {
        std::fs::create_dir_all(parent)?;
    }
    let mut out = BufWriter::new(File::create(path)?);
    JpegEncoder::new_with_quality(&mut out, quality).encode_image(tile)?;
    Ok(std::io::Write::flush(&mut out)?)
}
