//! `ltm-export recover`: a capture folder to an `.ltm` file.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail};
use clap::{Args, ValueEnum};
use indicatif::ProgressBar;
use rayon::prelude::*;
use serde::Serialize;

use super::checkpoint::{Checkpoint, Contents, Recipe};
use super::encode::{self, QualityArgs};
use super::memory::{self, Plan};
use super::photographs::Photographs;
use super::process::{Interrupt, Interrupted};
use super::recovery_remedy::recovery_remedy;
use super::{Usage, files, process, report, tile_record};
use crate::capture::{self, CaptureFolder, DarkFrame, Measurements, Noise, Rows, Shot};
use crate::format::{CaptureNote, FormatError, Metadata};
use crate::recover::{
    self, BandwidthEstimate, HoldoutValidation, Method, RecoverError, Recovery, Settings,
    SparsityBasis, WindowEstimate,
};
use crate::transport::{Basis, CHANNELS, Decibels, Window};

/// Every how many shots one is kept from recovery, for `evaluate` to hold against the result.
const HOLD_OUT_EVERY: usize = 10;

/// SNR of a recovery below which something may be wrong with the photographs, in dB.
const POOR: f64 = 13.0;

/// How many of a kind a message names one by one.
const MOST_NAMED: usize = 4;

/// Percentage of saturated samples past which a wrong manifest is likelier than a few highlights.
const MUCH_SATURATED: f64 = 2.0;

/// Recover the light transport of an object from a folder of photographs
#[derive(Debug, Args)]
pub struct RecoverArgs {
    /// Capture folder: capture.json and the pictures it names
    capture: PathBuf,
    /// File to write
    #[arg(short, long, value_name = "FILE.ltm")]
    output: PathBuf,
    /// How each light transport function is recovered
    #[arg(long, value_enum, default_value_t = MethodName::Learned)]
    method: MethodName,
    /// With --method bpdn: where light transport functions are sparse [default: identity]
    #[arg(long, value_enum)]
    basis: Option<BasisName>,
    /// Side of the window of light elements each camera pixel may see; odd, or "auto" to estimate it
    #[arg(long, value_name = "W", default_value = "15", value_parser = parse_window)]
    window: WindowChoice,
    /// Use the first K shots only [default: all but every tenth, which are held out]
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..))]
    patterns: Option<u32>,
    #[command(flatten)]
    quality: QualityArgs,
    /// Memory to stay within: photographs of many megapixels are then read by strips
    #[arg(long, value_name = "BYTES", default_value = memory::Bytes::DEFAULT, value_parser = memory::Bytes::parse)]
    memory: memory::Bytes,
    /// Go on with a recovery that was interrupted, from FILE.ltm.checkpoint
    #[arg(long)]
    resume: bool,
    /// Print one JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// The window asked for.
#[derive(Clone, Copy, Debug)]
enum WindowChoice {
    Auto,
    Fixed(Window),
}

impl WindowChoice {
    /// The largest window that it may come to.
    fn most(self) -> Window {
        match self {
            Self::Auto => WindowEstimate::MAX_WINDOW,
            Self::Fixed(window) => window,
        }
    }

    fn name(self) -> String {
        match self {
            Self::Auto => "auto".to_owned(),
            Self::Fixed(window) => window.side().to_string(),
        }
    }
}

fn parse_window(text: &str) -> Result<WindowChoice, String> {
    if text == "auto" {
        return Ok(WindowChoice::Auto);
    }
    let odd = "give an odd number of light elements, or auto";
    let side = text.parse::<u32>().map_err(|e| format!("{e}; {odd}"))?;
    let window = Window::new(side).map_err(|e| e.to_string())?;
    Ok(WindowChoice::Fixed(window))
}

/// Recovery methods by name.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum MethodName {
    /// A prior learned from the photographs themselves
    Learned,
    /// Non-negative least squares
    Nnls,
    /// Basis pursuit denoising: the sparsest function that explains the photographs
    Bpdn,
}

/// Bases of `--method bpdn` by name.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum BasisName {
    /// Light elements themselves, for opaque objects
    Identity,
    /// Discrete cosine transform, for translucent ones
    Dct,
    /// Haar wavelets
    Haar,
}

impl RecoverArgs {
    fn method(&self) -> Method {
        match self.method {
            MethodName::Learned => Method::Learned,
            MethodName::Nnls => Method::Nnls,
            MethodName::Bpdn => Method::Bpdn(match self.basis {
                Some(BasisName::Identity) | None => SparsityBasis::Identity,
                Some(BasisName::Dct) => SparsityBasis::Dct,
                Some(BasisName::Haar) => SparsityBasis::Haar,
            }),
        }
    }
}

#[derive(Serialize)]
struct Report {
    seconds: f64,
    peak_rss_bytes: Option<u64>,
    method: Method,
    /// With bpdn: where the functions were sought sparse.
    basis: Option<SparsityBasis>,
    window: u32,
    /// With --window auto: estimated share of a pixel's light that comes from outside the window.
    leak: Option<f64>,
    /// None: every tile is direct.
    rank: Option<usize>,
    patterns: usize,
    /// More than patterns where some were photographed at several exposures.
    photographs: usize,
    /// About the SNR of what was recovered against the object, where the method can tell.
    expected_snr_db: Option<Decibels>,
    /// SNR of the file against what was recovered.
    file_snr_db: Option<Decibels>,
    common_mode: Option<crate::recover::CommonMode>,
    noise: Noise,
    /// Parts in which the photographs were read to stay within the memory given; 1 is whole.
    strips: usize,
    saturated_samples: usize,
    /// Pixels of which nothing but white is known.
    overexposed_pixels: usize,
    file_bytes: u64,
}

pub fn run(args: &RecoverArgs) -> Result<()> {
    let start = Instant::now();
    if args.basis.is_some() && !matches!(args.method, MethodName::Bpdn) {
        bail!(Usage("--basis is for --method bpdn"));
    }
    let interrupt = Interrupt::listen()?;
    // Whether it can be written is better known before than after.
    drop(files::Output::create(&args.output, files::Kind::Ltm)?);
    let folder = CaptureFolder::open(&args.capture)?;
    let manifest = folder.manifest();
    if !manifest.unknown.is_empty() {
        eprintln!(
            "note: {}: ignored, as no field has such a name: {}",
            folder.manifest_path().display(),
            named(manifest.unknown.iter().cloned())
        );
    }
    let shots = choose_shots(&manifest.shots, args.patterns)?;
    if shots.len() < recover::MIN_PATTERNS {
        let manifest = folder.manifest_path().display().to_string();
        return Err(RecoverError::TooFewPatterns {
            count: shots.len(),
            min: recover::MIN_PATTERNS,
        })
        .context(manifest);
    }
    let threads = rayon::current_num_threads();
    let plan = Plan::new(
        args.memory,
        manifest,
        shots.len(),
        args.method(),
        args.window.most(),
        threads,
    )?;
    if let WindowChoice::Fixed(window) = args.window {
        plan.encoders(window, args.method().max_rank(window))?;
    }
    let mut report =
        pool(plan.tiles_at_once)?.install(|| recover(args, &folder, &shots, &plan, &interrupt))?;
    report.seconds = start.elapsed().as_secs_f64();
    report.peak_rss_bytes = process::peak_rss_bytes();
    if args.json {
        return report::print_json(&report);
    }
    report::print_line(&format!(
        "{}: {} camera pixels, {} light elements, window {}, from {} in {:.1} s, {}",
        args.output.display(),
        manifest.camera.extent(),
        manifest.light.extent(),
        report.window,
        report::shots(report.patterns, report.photographs),
        report.seconds,
        report::bytes(report.file_bytes),
    ))?;
    if let Some(snr) = report.expected_snr_db {
        report::print_line(&format!(
            "recovered to about {snr} of SNR against the object, as patterns held out tell"
        ))?;
    }
    if let Some(snr) = report.file_snr_db {
        report::print_line(&format!("kept to {snr} of SNR against what was recovered"))?;
    }
    Ok(())
}

fn pool(threads: usize) -> Result<rayon::ThreadPool> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.context("threads cannot be started")
}

/// Recovers and writes the file; what it took is left for the caller to report.
fn recover(
    args: &RecoverArgs,
    folder: &CaptureFolder,
    shots: &[usize],
    plan: &Plan,
    interrupt: &Interrupt,
) -> Result<Report> {
    let dark = folder.read_dark()?;
    folder.flood(&dark)?; // `evaluate` will want it: better known now that it is not there.
    let gray_code_rows = plan.gray_code_rows(folder.manifest().graycode.len());
    let mut measurements = no_rows(folder, &dark, shots, &gray_code_rows)?;
    let mut photographs = Photographs::open(folder, &dark, shots)?;
    // Before the long work: a checkpoint that does not fit is better known now.
    let recipe = recipe(args, folder, shots, plan, interrupt)?;
    let mut checkpoint = Checkpoint::open(&args.output, &recipe, args.resume)?;
    announce(&checkpoint, args.resume);
    let bar = process::progress("reading", shots.len());
    let read = photographs.advance(&mut measurements, &plan.sample(), || {
        bar.inc(1);
        !interrupt.told()
    })?;
    bar.finish_and_clear();
    if !read {
        return Err(interrupted(&checkpoint));
    }
    let saturated = photographs.finish()?;
    measurements.noise = Noise::with_gain_from(&measurements);
    warn_of_saturation(saturated, &measurements);
    let failed = |error| match error {
        RecoverError::Cancelled(_) => interrupted(&checkpoint),
        RecoverError::MismatchedPatterns { pattern_indices } => {
            astray(folder, pattern_indices.iter().map(|&l| shots[l]))
        }
        other => match recovery_remedy(&other) {
            Some(remedy) => anyhow!("{}: {other}; {remedy}", args.capture.display()),
            None => anyhow::Error::new(other).context(args.capture.display().to_string()),
        },
    };
    let band = match args.window {
        WindowChoice::Auto => Some(
            WindowEstimate::from_measurements(&measurements, &interrupt.cores()).map_err(failed)?,
        ),
        WindowChoice::Fixed(_) => None,
    };
    match band {
        Some(WindowEstimate {
            window,
            bandwidth: BandwidthEstimate::Unbounded,
        }) => eprintln!(
            "warning: the band is at least as wide as the window of {0}x{0} light elements that was \
             looked at; a wider one can be asked for with --window",
            window.side()
        ),
        Some(WindowEstimate {
            window,
            bandwidth: BandwidthEstimate::Undetermined,
        }) => eprintln!(
            "warning: these photographs do not tell how wide the band is; {0}x{0} light elements are \
             taken for it, and another number can be given with --window",
            window.side()
        ),
        _ => {}
    }
    let settings = Settings {
        method: args.method(),
        window: band.map_or(args.window.most(), |band| band.window),
    };
    let spinner = process::spinner("learning");
    let recovery =
        Recovery::prepare(&measurements, settings, &interrupt.cores()).map_err(failed)?;
    spinner.finish_and_clear();
    check_holdout_validation(folder, &recovery)?;
    let rank = recovery.basis().map(Basis::rank);
    let encoders = plan.encoders(settings.window, rank.unwrap_or(0))?;
    checkpoint.prepared(recovery.fingerprint())?;
    let bar = process::progress("recovering", recipe.tiles);
    bar.set_position(checkpoint.count() as u64);
    bar.reset_eta(); // The tiles that are there took no time.
    let run = Run {
        interrupt,
        recovery: &recovery,
        bar,
        checkpoint: Mutex::new(checkpoint),
    };
    let mut overexposed = 0;
    let mut photographs = match plan.whole() {
        true => None,
        false => Some(Photographs::open(folder, &dark, shots)?),
    };
    if photographs.is_some() {
        measurements.forget_rows();
    }
    let strips = plan.strips(recovery.halo());
    for (tile_rows, rows) in &strips {
        if let Some(photographs) = &mut photographs
            && !photographs.advance(&mut measurements, rows, || !interrupt.told())?
        {
            return Err(run.interrupted());
        }
        overexposed += run.tiles(&measurements, tile_rows.clone(), saturated > 0)?;
    }
    run.bar.finish_and_clear();
    if overexposed > 0 {
        eprintln!(
            "warning: {overexposed} pixels are saturated in nearly all photographs and will be \
             white under any light; photograph with less exposure"
        );
    }
    let noise = measurements.noise;
    drop((measurements, photographs));
    drop(dark);
    let manifest = folder.manifest();
    let patterns = shots.iter().map(|&i| &manifest.shots[i].pattern);
    let patterns = capture::distinct(&capture::numbers(patterns));
    let metadata = Metadata {
        title: manifest.title.clone(),
        creator: manifest.creator.clone(),
        rights: manifest.rights.clone(),
        capture: CaptureNote {
            patterns,
            photographs: shots.len(),
        },
        writer: PROGRAM.to_owned(),
        method: settings.method.name().to_owned(),
        units: UNITS.to_owned(),
        shots_used: shots.to_vec(),
    };
    let spinner = process::spinner("compressing");
    let file = pool(encoders)?.install(|| {
        encode::file(
            &args.quality,
            &run.checkpoint,
            &recovery,
            metadata,
            interrupt,
        )
    });
    spinner.finish_and_clear();
    let file = file.map_err(|error| match error {
        FormatError::Source(e) if e.kind() == ErrorKind::Interrupted => run.interrupted(),
        FormatError::TooLarge { .. } => anyhow::Error::new(error).context(format!(
            "{}: cannot be written; nothing that was recovered is lost: give the same command with \
             --resume and more --max-bytes, or without --max-bytes",
            args.output.display()
        )),
        other => anyhow::Error::new(other).context(args.output.display().to_string()),
    })?;
    let output = files::Output::create(&args.output, files::Kind::Ltm)?;
    let file_bytes = output.finish(|out| Ok(file.write(out)?))?;
    let checkpoint = run.checkpoint.into_inner();
    checkpoint.unwrap_or_else(PoisonError::into_inner).done();
    Ok(Report {
        seconds: 0.0,
        peak_rss_bytes: None,
        method: settings.method,
        basis: settings.method.basis(),
        window: settings.window.side(),
        leak: band.and_then(|band| match band.bandwidth {
            BandwidthEstimate::Bounded { tail_fraction } => Some(tail_fraction),
            BandwidthEstimate::Unbounded | BandwidthEstimate::Undetermined => None,
        }),
        rank,
        patterns,
        photographs: shots.len(),
        expected_snr_db: recovery
            .holdout_validation()
            .and_then(HoldoutValidation::snr),
        file_snr_db: file.snr(),
        common_mode: recovery.common_mode(),
        noise,
        strips: strips.len(),
        saturated_samples: saturated,
        overexposed_pixels: overexposed,
        file_bytes,
    })
}

/// What there is to say of photographs that are not of the patterns they are listed with.
fn astray(folder: &CaptureFolder, shots: impl ExactSizeIterator<Item = usize>) -> anyhow::Error {
    let listed = &folder.manifest().shots;
    let name = |i: usize| format!("shots[{i}] ({}, {})", listed[i].photo, listed[i].pattern);
    anyhow!(
        "{}: photographs do not show the patterns they are listed with, as others do: {}; correct \
         these, or take them out; if there are many, see whether the correspondence is mirrored",
        folder.manifest_path().display(),
        named(shots.map(name))
    )
}

/// Says so where the photographs tell little, and refuses those that tell nothing.
fn check_holdout_validation(folder: &CaptureFolder, recovery: &Recovery) -> Result<()> {
    let Some(validation) = recovery.holdout_validation() else {
        return Ok(());
    };
    if !validation.has_signal() {
        bail!(
            "{}: photographs do not differ from pattern to pattern by more than their noise; check \
             that each of \"shots\" names a photo of its own, and that the display was on",
            folder.manifest_path().display()
        );
    }
    if let Some(snr) = validation.snr().filter(|snr| snr.0 < POOR) {
        eprintln!(
            "warning: patterns held out are predicted badly, to {snr} of SNR: are the photographs \
             linear, was the light steady, does the correspondence fit? With few patterns, or by \
             another method than learned, it may be no better"
        );
    }
    Ok(())
}

/// The first of `names`, and how many more there are.
fn named(names: impl ExactSizeIterator<Item = String>) -> String {
    let more = names.len().saturating_sub(MOST_NAMED);
    let mut first: Vec<String> = names.take(MOST_NAMED).collect();
    if more > 0 {
        first.push(format!("and {more} more"));
    }
    first.join(", ")
}

/// What there is to say of a recovery that was told to stop.
fn interrupted(checkpoint: &Checkpoint) -> anyhow::Error {
    match checkpoint.interrupted() {
        Ok(kept) => Interrupted(kept).into(),
        Err(error) => error,
    }
}

/// Says what is there already.
fn announce(checkpoint: &Checkpoint, resume: bool) {
    let (count, tiles) = (checkpoint.count(), checkpoint.tiles());
    match count {
        0 if resume && checkpoint.found() => {
            eprintln!("note: the checkpoint is damaged, or has no tile yet; starting anew");
        }
        0 if resume => eprintln!("note: there is no checkpoint to resume from; starting anew"),
        0 => {}
        _ => eprintln!("resuming with {count} of {tiles} tiles"),
    }
}

/// Tiles on their way into the checkpoint.
struct Run<'a> {
    interrupt: &'a Interrupt,
    recovery: &'a Recovery,
    bar: ProgressBar,
    checkpoint: Mutex<Checkpoint>,
}

impl Run<'_> {
    /// What there is to say where it was told to stop.
    fn interrupted(&self) -> anyhow::Error {
        self.bar.finish_and_clear();
        let checkpoint = self.checkpoint.lock();
        interrupted(&checkpoint.unwrap_or_else(PoisonError::into_inner))
    }

    /// Recovers the rows of tiles `tile_rows`, except what is kept already. Returns the number of
    /// their pixels that are saturated in nearly all photographs, if there is anything `saturated`.
    fn tiles(
        &self,
        measurements: &Measurements,
        tile_rows: Range<u32>,
        saturated: bool,
    ) -> Result<usize> {
        let geometry = self.recovery.geometry();
        let across = geometry.tile_grid().width;
        let tiles = (tile_rows.start * across) as usize..(tile_rows.end * across) as usize;
        let lock = || {
            self.checkpoint
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
        };
        let overexposed = tiles.into_par_iter().map(|i| -> Result<usize> {
            let rect = geometry.tile(i);
            if !lock().has(i) {
                if self.interrupt.told() {
                    bail!(Interrupted(String::new()));
                }
                let tile = self.recovery.tile(measurements, rect);
                let record = tile_record::encode(&tile).context("a tile cannot be kept")?;
                lock().add(i, &record)?;
                self.bar.inc(1);
            }
            Ok(match saturated {
                true => measurements.overexposed_pixels(rect, recover::MIN_PATTERNS),
                false => 0,
            })
        });
        let overexposed = overexposed.try_reduce(|| 0, |a, b| Ok(a + b));
        match overexposed {
            Err(e) if e.is::<Interrupted>() => Err(self.interrupted()),
            other => other,
        }
    }
}

/// What light transport is in units of.
const UNITS: &str =
    "camera value where camera.black is 0 and camera.white is 1, per light element at full code";

/// What made a file or a checkpoint.
const PROGRAM: &str = concat!("ltm-export ", env!("CARGO_PKG_VERSION"));

/// All that decides what the tiles are.
fn recipe(
    args: &RecoverArgs,
    folder: &CaptureFolder,
    shots: &[usize],
    plan: &Plan,
    interrupt: &Interrupt,
) -> Result<Recipe> {
    let gray_code = plan.gray_code_rows(folder.manifest().graycode.len());
    let whole = plan.whole() && gray_code == Rows::all(folder.manifest().camera.height);
    let memory = match whole {
        true => "enough for all photographs".to_owned(),
        false => args.memory.0.to_string(),
    };
    let none = || "not given".to_owned();
    let options = [
        ("--method", args.method().name().to_owned()),
        (
            "--basis",
            args.method()
                .basis()
                .map_or_else(none, |basis| basis.name().to_owned()),
        ),
        ("--window", args.window.name()),
        (
            "--patterns",
            args.patterns.map_or_else(none, |k| k.to_string()),
        ),
        ("--memory", memory),
    ];
    let contents = |(name, path): (&str, PathBuf)| -> Result<(String, Contents)> {
        if interrupt.told() {
            bail!(Interrupted(
                "interrupted before anything was read".to_owned()
            ));
        }
        let contents = Contents::of(&path).with_context(|| path.display().to_string())?;
        Ok((name.to_owned(), contents))
    };
    let files = folder.files(shots).into_par_iter().map(contents);
    Ok(Recipe {
        program: PROGRAM.to_owned(),
        options: options.map(|(name, is)| (name.to_owned(), is)).into(),
        files: files.collect::<Result<BTreeMap<_, _>>>()?,
        tiles: plan.tiles(),
    })
}

fn warn_of_saturation(saturated: usize, measurements: &Measurements) {
    if saturated == 0 {
        return;
    }
    let samples = measurements.pictures.len() * measurements.camera.area() * CHANNELS;
    let percent = 100.0 * saturated as f64 / samples as f64;
    eprintln!("note: {saturated} saturated samples ({percent:.1} %) are left out");
    // Of several exposures the longest are meant to saturate.
    let exposures = &measurements.full_scale;
    let alike = exposures.iter().all(|exposure| *exposure == exposures[0]);
    if alike && percent > MUCH_SATURATED {
        eprintln!(
            "warning: that is much; check \"camera.white\" in the manifest, or photograph with \
             less exposure"
        );
    }
}

/// Which of `available` shots to recover from.
fn choose_shots(shots: &[Shot], first: Option<u32>) -> Result<Vec<usize>> {
    let available = shots.len();
    match first.map(|k| k as usize) {
        Some(k) if k > available => {
            bail!("--patterns is {k}, but the capture has {available} shots")
        }
        Some(k) => Ok((0..k).collect()),
        None => {
            // Shots of one pattern, by several exposures, are held out together.
            let numbers = capture::numbers(shots.iter().map(|shot| &shot.pattern));
            let used = |l: &usize| numbers[*l] % HOLD_OUT_EVERY != HOLD_OUT_EVERY - 1;
            Ok((0..available).filter(used).collect())
        }
    }
}

/// Reads all there is to measurements but their rows. Gray code, where it is needed, is read in
/// `gray_code_rows`.
pub(super) fn no_rows(
    folder: &CaptureFolder,
    dark: &DarkFrame,
    shots: &[usize],
    gray_code_rows: &Rows,
) -> Result<Measurements> {
    let correspondence = match folder.correspondence() {
        Some(given) => given,
        None => folder
            .read_gray_code(dark, gray_code_rows)?
            .correspondence(folder.manifest().camera.extent())
            .with_context(|| folder.manifest_path().display().to_string())?,
    };
    let patterns = shots.par_iter().map(|&i| folder.read_pattern(i));
    let patterns = patterns.collect::<Result<Vec<_>, _>>()?;
    Ok(folder.no_rows(shots, patterns, correspondence, dark))
}
