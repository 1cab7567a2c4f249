//! `ltm-export shoot`: shows the pictures of a sequence, photographs each, checks it at once, and makes a capture folder.
//!
//! A page in a browser shows the pictures ([`player_server`]); a command or a tethering program takes the photographs
//! ([`camera`]). Trial photographs find the exposure time and the display's delay ([`trial_photographs`]); every photograph is checked
//! against those before ([`photograph_check`]) and kept ([`session_store`]).

mod camera;
mod photograph_check;
mod photographer;
mod player_server;
mod session_store;
mod trial_photographs;

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Error, Result, bail, ensure};
use clap::Args;

use self::camera::CameraSource;
pub use self::camera::Exposure;
use self::photographer::{Photographer, ShootingSettings};
use self::player_server::PlayerServer;
pub use self::session_store::LOG_NAME;
use self::session_store::{SessionSettings, SessionStore};
use super::assemble::{DevelopArgs, is_photograph, read_sequence};
use super::patterns::served_player;
use super::process_resources::{Interrupted, InterruptibleCores};
use super::progress;
use super::value_parsers::{UsageError, parse_number};

/// Until a photograph has to be there: from a program, and from an operator who releases the shutter.
const COMMAND_TIMEOUT: Duration = Duration::from_secs(60);
const OPERATOR_TIMEOUT: Duration = Duration::from_secs(600);
/// The page learns that the session has ended within this time.
const FAREWELL: Duration = Duration::from_secs(2);

/// Photograph a sequence: show each picture, take its photograph, check it at once, and make a capture folder of them
#[derive(Debug, Args)]
pub struct ShootArgs {
    /// Folder that `ltm-export patterns` wrote
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Takes a photograph: gphoto2, libcamera, v4l2, watch:FOLDER for a program that writes photographs into a folder, or a command with
    /// {file}, the file to write, or {stem}, the same without extension. Also replaced: {exposure} and {microseconds}, the exposure time;
    /// {number} and {picture}, number and file of the picture that is shown; {photograph}, a number that no other photograph of the session has
    #[arg(long, value_name = "CAMERA")]
    camera: String,
    /// Extension of {file}: it says how the photograph is read
    #[arg(long, value_name = "EXT", default_value = "png")]
    extension: String,
    /// Exposure times that the camera has, in seconds: the longest that does not saturate is taken. The command needs {exposure} or
    /// {microseconds}
    #[arg(long, value_name = "TIME", value_delimiter = ',', value_parser = Exposure::parse)]
    exposures: Vec<Exposure>,
    /// Seconds between a picture and its photograph, at least: the display's delay. More, if its afterglow takes longer
    #[arg(long, value_name = "SECONDS", default_value_t = 0.3, value_parser = |text: &str| parse_number(text, 0.0, 60.0))]
    settle: f32,
    /// Seconds until a photograph has to be there [default: 60, with watch:FOLDER 600]
    #[arg(long, value_name = "SECONDS", value_parser = |text: &str| parse_number(text, 0.1, 86_400.0))]
    timeout: Option<f32>,
    /// Photographs of a picture until one is right
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=100))]
    attempts: u32,
    /// Keep photographs that are still wrong then
    #[arg(long)]
    force: bool,
    /// Port on this computer at which the player is; 0 for any
    #[arg(long, value_name = "N", default_value_t = 8766)]
    port: u16,
    #[command(flatten)]
    develop: DevelopArgs,
}

pub fn run(args: &ShootArgs) -> Result<()> {
    let settings = shooting_settings(args)?;
    let sequence = read_sequence(&args.folder)?;
    for picture in &sequence.pictures {
        let path = args.folder.join(&picture.picture);
        ensure!(
            path.is_file(),
            "{}: is missing; copy it from a new folder that `ltm-export patterns` writes with the same options",
            path.display()
        );
    }
    let mut store = SessionStore::open(&args.folder, sequence)?;
    if let Some(begun) = store.settings()? {
        check_settings(&begun, &settings, &store)?;
    }
    let cores = InterruptibleCores::listen()?;
    let server = start_server(args, &store)?;
    let count = store.sequence.pictures.len();
    eprintln!(
        "open {} in a browser, and show the pictures on the display ({} of {count} photographs are missing)",
        server.url,
        store.missing().len()
    );
    let mut photographer = Photographer {
        settings: &settings,
        server: &server,
        cores: &cores,
        folder: args.folder.clone(),
        bar: progress::bar("photographs", count),
        exposure: None,
        settle: settings.settle,
        photographs: 0,
    };
    let shot = shoot(args, &mut photographer, &mut store);
    photographer.bar.finish_and_clear();
    let session_settings = match shot {
        Ok(settings) => settings,
        Err(error) => {
            let error = resumable(error, &store);
            farewell(&server, false, &format!("{error:#}"));
            return Err(error);
        }
    };
    farewell(
        &server,
        true,
        "All photographs are taken. This page can be closed.",
    );
    let session = store.session().context("a photograph is missing")?;
    for fault in session.check_pairing(true)? {
        eprintln!("warning: {fault}");
    }
    store.write_log(&session_settings)?;
    session.complete(&args.folder)?;
    store.clear()
}

fn shooting_settings(args: &ShootArgs) -> Result<ShootingSettings> {
    let camera = CameraSource::parse(&args.camera).context("--camera")?;
    let is_plain = args.extension.chars().all(|c| c.is_ascii_alphanumeric());
    let example = format!("photograph.{}", args.extension);
    ensure!(
        is_plain && is_photograph(Path::new(&example)),
        "--extension {}: is of no photograph that can be read; give png, tif, exr or the extension of the camera's raw files",
        args.extension
    );
    if camera.sets_exposure() && args.exposures.is_empty() {
        bail!(UsageError(
            "--camera sets an exposure time: list the camera's in --exposures"
        ));
    }
    if !args.exposures.is_empty() && !camera.sets_exposure() {
        bail!(UsageError(
            "--exposures needs a --camera with {exposure} or {microseconds}"
        ));
    }
    let default = match camera {
        CameraSource::Command(_) => COMMAND_TIMEOUT,
        CameraSource::Folder(_) => OPERATOR_TIMEOUT,
    };
    Ok(ShootingSettings {
        camera,
        extension: args.extension.clone(),
        settle: Duration::from_secs_f32(args.settle),
        timeout: args.timeout.map_or(default, Duration::from_secs_f32),
        attempts: args.attempts,
        force: args.force,
        develop: args.develop.settings()?,
    })
}

fn start_server(args: &ShootArgs, store: &SessionStore) -> Result<PlayerServer> {
    let json = serde_json::to_string(&store.sequence)?;
    let pictures = store.sequence.pictures.iter();
    let pictures: HashSet<String> = pictures.map(|picture| picture.picture.clone()).collect();
    let server = PlayerServer::start(
        served_player(&json),
        &args.folder,
        pictures,
        store.sequence_sha256()?,
        args.port,
    );
    server.with_context(|| {
        format!(
            "port {} of this computer cannot be used; give another --port",
            args.port
        )
    })
}

/// Refuses to go on with a session whose photographs would differ.
fn check_settings(
    begun: &SessionSettings,
    now: &ShootingSettings,
    store: &SessionStore,
) -> Result<()> {
    let begin_again = format!("or delete {} to begin again", store.work().display());
    let (was, is) = (&begun.develop, &now.develop);
    let differences = [
        (
            "--response",
            was.response != is.response,
            format!("{:?}", was.response),
        ),
        ("--black", was.black != is.black, format!("{:?}", was.black)),
        ("--white", was.white != is.white, format!("{:?}", was.white)),
        ("--bin", was.bin != is.bin, was.bin.to_string()),
        (
            "--undistort",
            was.undistort != is.undistort,
            was.undistort
                .map_or_else(|| "none".to_owned(), |lens| lens.to_string()),
        ),
        ("--crop", was.crop != is.crop, format!("{:?}", was.crop)),
        (
            "--rotate",
            was.rotate != is.rotate,
            was.rotate.degrees().to_string(),
        ),
    ];
    if let Some((option, _, was)) = differences.iter().find(|(_, differs, _)| *differs) {
        bail!("the session was begun with another {option}, {was}; give the same, {begin_again}");
    }
    ensure!(
        begun.sequence_sha256 == store.sequence_sha256()?,
        "the session was begun with other pictures; restore sequence.json, {begin_again}"
    );
    match (&begun.exposure, now.camera.sets_exposure()) {
        (None, true) => bail!(
            "the session was begun without --exposures; leave {{exposure}} out of --camera, {begin_again}"
        ),
        (Some(name), false) => bail!(
            "the session was begun with an exposure time of {name} s; give a --camera with {{exposure}} and --exposures, {begin_again}"
        ),
        _ => Ok(()),
    }
}

/// Takes all photographs, with an exposure time that is found first. Returns the settings of the session.
fn shoot(
    args: &ShootArgs,
    photographer: &mut Photographer,
    store: &mut SessionStore,
) -> Result<SessionSettings> {
    let settings = match store.settings()? {
        Some(begun) => begun,
        None => {
            let mut exposures = args.exposures.clone();
            exposures.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
            let chosen = photographer.find_exposure(store, &exposures)?;
            // An operator is slower than a display.
            if matches!(photographer.settings.camera, CameraSource::Command(_)) {
                photographer.find_settle(store)?;
            }
            let exposure = photographer.exposure.as_ref();
            let settings = SessionSettings {
                develop: photographer.settings.develop.clone(),
                sequence_sha256: store.sequence_sha256()?,
                exposure: exposure.map(|exposure| exposure.name.clone()),
                flood_brightness: chosen.flood_brightness,
                is_saturation_accepted: chosen.is_saturation_accepted,
                settle_seconds: photographer.settle.as_secs_f32(),
            };
            store.write_settings(&settings)?;
            settings
        }
    };
    photographer.exposure = match &settings.exposure {
        Some(name) => Some(Exposure::parse(name).map_err(Error::msg)?),
        None => None,
    };
    let begun_with = Duration::from_secs_f32(settings.settle_seconds);
    if begun_with > photographer.settle {
        photographer.settle = begun_with;
        photographer.say(&format!(
            "photographs wait for {:.2} seconds, as was found when the session was begun",
            settings.settle_seconds
        ));
    }
    photographer.run(store, &settings)?;
    Ok(SessionSettings {
        settle_seconds: photographer.settle.as_secs_f32(),
        ..settings
    })
}

/// Lets the page say how the session ended; if it is not complete, the page waits for the next run.
fn farewell(server: &PlayerServer, is_complete: bool, message: &str) {
    server.update(|state| {
        state.finished = is_complete;
        state.question = None;
        state.message = message.to_owned();
    });
    let end = Instant::now() + FAREWELL;
    while !server.is_fetched() && Instant::now() < end {
        thread::sleep(Duration::from_millis(20));
    }
}

/// An interruption says what remains.
fn resumable(error: Error, store: &SessionStore) -> Error {
    if !error.is::<Interrupted>() {
        return error;
    }
    let missing = store.missing().len();
    let count = store.sequence.pictures.len();
    let text = format!(
        "interrupted: {} of {count} photographs are kept; the same command goes on, and `{LOG_NAME}` is written in the end",
        count - missing
    );
    Interrupted(text).into()
}
