//! `ltm-export patterns`: the pictures that a display shows in a session, and the plan of the session.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use image::ExtendedColorType;
use rayon::prelude::*;

use super::capture_writer::write_png;
use super::report::print_line;
use super::value_parsers::{parse_extent, parse_number};
use super::{output_folder, progress};
use crate::acquisition::{
    DisplayLayout, PatternSequence, PictureRole, SEQUENCE_NAME, SequenceSettings, SessionPlan,
    SessionSetup,
};
use crate::simulate::{PatternEnsemble, PatternImage};
use crate::transport::{Extent, MAX_SIDE};

const DISPLAY_SIDES: RangeInclusive<u32> = 16..=16_384;
const LIGHT_SIDES: RangeInclusive<u32> = 4..=2048;
const CAMERA_SIDES: RangeInclusive<u32> = 8..=MAX_SIDE;
/// The pattern player.
const PLAYER_NAME: &str = "player.html";
/// File names have four digits.
const MAX_PATTERNS: i64 = 5_000;

/// Write the pictures that a display shows while an object is photographed, and plan the session
#[derive(Debug, Args)]
pub struct PatternsArgs {
    /// Folder to write; must be new or empty. Later it becomes the capture folder
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Pixels of the display
    #[arg(long, value_name = "WxH", value_parser = |text: &str| parse_extent(text, DISPLAY_SIDES))]
    screen: Extent,
    /// Light elements
    #[arg(long, value_name = "WxH", value_parser = |text: &str| parse_extent(text, LIGHT_SIDES))]
    light: Extent,
    /// Side of a light element in display pixels [default: the largest that fits]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    element: Option<u32>,
    /// Number of random patterns; a recovery takes 80, and the others test it
    #[arg(long, value_name = "N", default_value_t = 88,
          value_parser = clap::value_parser!(u32).range(1..=MAX_PATTERNS))]
    patterns: u32,
    /// Distribution of the random patterns
    #[arg(long, value_enum, default_value = "bernoulli")]
    ensemble: PatternEnsemble,
    /// Seed of the random patterns; the same seed writes the same bytes
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// For the plan: width of the display's picture in millimetres
    #[arg(long, value_name = "MM", value_parser = |text: &str| parse_number(text, 1.0, 100_000.0))]
    screen_width: Option<f32>,
    /// For the plan: how far light spreads in the object, and by its distance from the display, in millimetres
    #[arg(long, value_name = "MM", value_parser = |text: &str| parse_number(text, 0.0, 10_000.0))]
    spread: Option<f32>,
    /// For the plan: camera pixels that show the light plane
    #[arg(long, value_name = "WxH", value_parser = |text: &str| parse_extent(text, CAMERA_SIDES))]
    camera: Option<Extent>,
    /// For the plan: seconds from one photograph to the next
    #[arg(long, value_name = "SECONDS", default_value_t = 3.0, value_parser = |text: &str| parse_number(text, 0.01, 3600.0))]
    interval: f32,
}

pub fn run(args: &PatternsArgs) -> Result<()> {
    let layout = DisplayLayout::new(args.screen, args.light, args.element)?;
    let (sequence, codes) = PatternSequence::draw(&SequenceSettings {
        layout,
        patterns: args.patterns,
        ensemble: args.ensemble,
        seed: args.seed,
    });
    output_folder::write_atomically(&args.output, |root| write(&sequence, &codes, root))?;
    let setup = SessionSetup {
        display_width_mm: args.screen_width.map(f64::from),
        spread_mm: args.spread.map(f64::from),
        camera: args.camera,
        interval_seconds: f64::from(args.interval),
    };
    let plan = SessionPlan::new(layout, setup, sequence.pictures.len());
    for line in plan.lines() {
        print_line(&line)?;
    }
    eprintln!(
        "{0}: {1} pictures; `ltm-export shoot` photographs them; or open {0}/{PLAYER_NAME} in a browser, photograph each by \
         hand, and run `ltm-export assemble`",
        args.output.display(),
        sequence.pictures.len()
    );
    Ok(())
}

/// The page that shows the sequence `json`, in one file.
fn player(json: &str) -> String {
    const PAGE: &str = include_str!("../../www/player/player.html");
    const STYLES: &str = include_str!("../../www/player/player.css");
    const SCRIPT: &str = include_str!("../../www/player/player.js");
    // No text in JSON ends the script element.
    let json = json.replace("</", "<\\/");
    PAGE.replace("/* player.css */", STYLES)
        .replace("/* player.js */", SCRIPT)
        .replace(">{}</script>", &format!(">{json}</script>"))
}

/// The same page under the control of the server that it comes from.
pub fn served_player(json: &str) -> String {
    player(json).replacen("<html ", "<html data-remote ", 1)
}

/// Writes the sequence, its pictures and the player into the folder `root`; `codes` are those of the light elements in each.
fn write(sequence: &PatternSequence, codes: &[PatternImage], root: &Path) -> Result<()> {
    for folder in ["display", "patterns"] {
        std::fs::create_dir(root.join(folder)).context(folder)?;
    }
    let json = serde_json::to_string_pretty(sequence)?;
    std::fs::write(root.join(PLAYER_NAME), player(&json)).context(PLAYER_NAME)?;
    std::fs::write(root.join(SEQUENCE_NAME), json + "\n").context(SEQUENCE_NAME)?;
    let DisplayLayout { display, light, .. } = sequence.layout;
    let bar = progress::bar("drawing", codes.len());
    let pictures = sequence.pictures.par_iter().zip(codes);
    pictures.try_for_each(|(picture, codes)| {
        let path = root.join(&picture.picture);
        let layout = &sequence.layout;
        match codes {
            PatternImage::Grey(codes) => {
                write_png(
                    &path,
                    display,
                    &layout.picture(codes),
                    ExtendedColorType::L8,
                )?;
            }
            PatternImage::Rgb(codes) => {
                let pixels = layout.picture(codes);
                write_png(
                    &path,
                    display,
                    pixels.as_flattened(),
                    ExtendedColorType::Rgb8,
                )?;
            }
        }
        if let (PictureRole::Pattern { pattern }, PatternImage::Grey(codes)) =
            (&picture.role, codes)
        {
            write_png(&root.join(pattern), light, codes, ExtendedColorType::L8)?;
        }
        bar.inc(1);
        Ok(())
    })
}
