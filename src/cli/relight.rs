//! `ltm-export relight`: a picture of the object under a light, as a PNG.

use std::io::Write;
use std::num::ParseIntError;
use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;

use super::ltm_file::PrefixLength;
use super::output_file::{OutputFile, PNG};
use super::relit_picture::{PictureArgs, PicturePart, RelitPicture};
use crate::transport::{Extent, TileRect};

const CANNOT_ENCODE: &str = "cannot be encoded";

/// Relight an object and write the picture as an 8-bit sRGB PNG
#[derive(Debug, Args)]
pub struct RelightArgs {
    #[command(flatten)]
    picture: PictureArgs,
    /// Use only the first part of the file, as a page does while it loads: 20K, 10%
    #[arg(long, value_name = "BYTES|PERCENT", value_parser = PrefixLength::parse)]
    first: Option<PrefixLength>,
    /// Pixels of the level to write: column and row of the first, width and height [default: all]
    #[arg(long, value_name = "X,Y,W,H", value_parser = parse_region)]
    region: Option<TileRect>,
    /// PNG to write
    #[arg(short, long, value_name = "OUT.png")]
    output: PathBuf,
}

fn parse_region(text: &str) -> Result<TileRect, String> {
    let parts: Result<Vec<u32>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    match parts.map_err(|e: ParseIntError| e.to_string())?[..] {
        [x, y, width, height] if width > 0 && height > 0 => {
            let extent = Extent { width, height };
            Ok(TileRect { x, y, extent })
        }
        _ => Err("expected four whole numbers, as in 0,0,800,600".to_owned()),
    }
}

pub fn run(args: &RelightArgs) -> Result<()> {
    args.picture.check()?;
    let output = OutputFile::create(&args.output, &PNG)?;
    let part = PicturePart {
        region: args.region,
        first: args.first,
    };
    let picture = RelitPicture::open(&args.picture, &part)?;
    output.finish_from_input(|out| write_png(picture, out))?;
    Ok(())
}

fn write_png(picture: RelitPicture<'_>, out: &mut impl Write) -> Result<()> {
    let Extent { width, height } = picture.extent();
    let mut encoder = png::Encoder::new(out, width, height);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().context(CANNOT_ENCODE)?;
    let mut stream = writer.stream_writer().context(CANNOT_ENCODE)?;
    let mut row = Vec::with_capacity(3 * width as usize);
    picture.draw(&mut |pixels| {
        row.clear();
        row.extend(pixels.iter().flat_map(|&[r, g, b, _]| [r, g, b]));
        stream.write_all(&row).context(CANNOT_ENCODE)
    })?;
    stream.finish().context(CANNOT_ENCODE)
}
