//! `ltm-export import`: makes a capture folder of pictures and photographs of another program's session.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use image::{ExtendedColorType, ImageReader, Limits};
use rayon::prelude::*;

use super::assemble::{
    DevelopArgs, DevelopSettings, check_cancelled, develop_all, fit_gray_code, photographs,
    raw_color_matrix, warn_of_clipping,
};
use super::calibrate::{IMPLAUSIBLE_FIT, is_implausible};
use super::capture_writer::write_png;
use super::process_resources::InterruptibleCores;
use super::{advice, output_folder, progress};
use crate::acquisition::{DisplayedPicture, DisplayedRole};
use crate::calibrate::{GrayCodeFit, LightPlaneAxis};
use crate::capture::{
    CaptureFolder, GrayCodeShot, MANIFEST_NAME, Manifest, ManifestCamera, ManifestLight, Shot,
};
use crate::simulate::GrayCodePattern;
use crate::transport::{CHANNELS, Extent};

/// Folders of a capture.
const FOLDERS: [&str; 3] = ["photos", "graycode", "patterns"];
/// Memory that decoding a picture of the display may take.
const MAX_PICTURE_BYTES: u64 = 1 << 30;
/// Largest side of a light element in display pixels.
const MAX_ELEMENT: u32 = 256;
/// Camera pixels that a light element should have along a side: finer ones are not resolved.
const MIN_PIXELS: f64 = 2.0;

/// Make a capture folder of the pictures and photographs of another program's session
#[derive(Debug, Args)]
pub struct ImportArgs {
    /// Folder to write; must be new or empty
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// What the display showed, in order: PNG or TIFF files, or folders of them, which are sorted by the numbers in their
    /// names. Black, white and Gray code (as OpenCV draws it) are recognised; all others are patterns
    #[arg(long, value_name = "PATH", num_args = 1.., required = true)]
    patterns: Vec<PathBuf>,
    /// Photographs of these pictures in the same order, likewise: a camera's raw files, or PNG, TIFF or OpenEXR
    #[arg(long, value_name = "PATH", num_args = 1.., required = true)]
    photos: Vec<PathBuf>,
    /// Side of a light element in display pixels [default: the smallest that the Gray code numbers; without other patterns,
    /// also at least two camera pixels wide]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_ELEMENT)))]
    element: Option<u32>,
    /// The display emits (code / 255)^GAMMA
    #[arg(long, value_name = "GAMMA", default_value = "2.2", value_parser = parse_gamma)]
    gamma: f64,
    #[command(flatten)]
    develop: DevelopArgs,
}

fn parse_gamma(text: &str) -> Result<f64, String> {
    let gamma = text
        .parse()
        .ok()
        .filter(|gamma| (0.1..=10.0).contains(gamma));
    gamma.ok_or_else(|| "it must be a number from 0.1 to 10".to_owned())
}

/// Roles of the pictures, and the display's size.
struct Roles {
    roles: Vec<DisplayedRole>,
    display: Extent,
}

/// A pattern of light elements for each picture; none for black and white, and for pictures with detail within an element.
type Patterns = Vec<Option<Vec<[u8; CHANNELS]>>>;

pub fn run(args: &ImportArgs) -> Result<()> {
    let settings = args.develop.settings()?;
    let pictures = photographs(&args.patterns)?;
    let paths = photographs(&args.photos)?;
    ensure!(
        pictures.len() == paths.len(),
        "--photos names {} photographs, but --patterns {} pictures; give one photograph for each picture, in the same order",
        paths.len(),
        pictures.len()
    );
    let cores = InterruptibleCores::listen()?;
    let roles = Roles::read(&pictures)?;
    if !roles.has_gray_code() {
        // Photographs have noise and edges, so that none is recognised.
        let photos = Roles::read(&paths);
        ensure!(
            !photos.is_ok_and(|photos| photos.has_gray_code()),
            "--photos names Gray code as a display shows it, and --patterns none: are they exchanged?"
        );
    }
    let light = ManifestLight::of_gamma(args.gamma);
    let mut summary = String::new();
    output_folder::write_atomically(&args.output, |folder| {
        for name in FOLDERS {
            std::fs::create_dir(folder.join(name)).context(name)?;
        }
        let mut session = Session::new(roles, light, &pictures)?;
        if let Some(element) = args.element {
            session.element = element;
            session.check_element(&pictures)?;
        }
        session.camera = session.write_photographs(folder, &paths, &settings, &cores)?;
        if args.element.is_none() {
            session.element = session.suitable_element(folder);
        }
        let patterns = session.read_patterns(&pictures)?;
        check_cancelled(&cores)?;
        session.write_patterns(folder, &patterns)?;
        check_cancelled(&cores)?;
        session.remove_unused(folder, &patterns)?;
        write_manifest(folder, &session.manifest(&patterns))?;
        summary = session.summary(&patterns);
        Ok(())
    })?;
    let output = args.output.display();
    let manifest = CaptureFolder::open(&args.output)?;
    if manifest.manifest().graycode.is_empty() {
        eprintln!(
            "{output}: {summary}. There is no Gray code among them: give \"correspondence\" in capture.json"
        );
        return Ok(());
    }
    match fit_gray_code(&args.output) {
        Ok(fit) if is_implausible(&fit) => {
            eprintln!("warning: {IMPLAUSIBLE_FIT}");
            eprintln!("{output}: {summary}");
        }
        Ok(_) => eprintln!("{output}: {summary}; `ltm-export recover` takes this folder"),
        Err(error) => {
            eprintln!("warning: {}", advice::error_with_remedy(&error));
            eprintln!(
                "{output}: {summary}; it cannot be recovered without \"correspondence\". Are pictures and photographs in the same \
                 order, and --black, --white, --bin, --crop and --undistort right?"
            );
        }
    }
    Ok(())
}

fn read_picture(path: &Path) -> Result<DisplayedPicture> {
    let read = || -> Result<DisplayedPicture> {
        let mut limits = Limits::default();
        limits.max_alloc = Some(MAX_PICTURE_BYTES);
        let mut reader = ImageReader::open(path)?.with_guessed_format()?;
        reader.limits(limits);
        let picture = reader
            .decode()
            .context("cannot be decoded as PNG or TIFF")?
            .into_rgb8();
        let (width, height) = picture.dimensions();
        Ok(DisplayedPicture {
            extent: Extent::new(width, height),
            codes: picture.pixels().map(|pixel| pixel.0).collect(),
        })
    };
    read().with_context(|| path.display().to_string())
}

fn write_manifest(folder: &Path, manifest: &Manifest) -> Result<()> {
    let json = serde_json::to_string_pretty(manifest)?;
    std::fs::write(folder.join(MANIFEST_NAME), json + "\n").context(MANIFEST_NAME)
}

impl Roles {
    fn read(pictures: &[PathBuf]) -> Result<Self> {
        let bar = progress::bar("reading pictures", pictures.len());
        let read = pictures
            .par_iter()
            .map(|path| -> Result<(DisplayedRole, Extent)> {
                let picture = read_picture(path)?;
                bar.inc(1);
                Ok((picture.role(), picture.extent))
            });
        let (roles, extents): (Vec<_>, Vec<_>) =
            read.collect::<Result<Vec<_>>>()?.into_iter().unzip();
        let display = *extents.first().context("--patterns names no picture")?;
        if let Some(i) = extents.iter().position(|extent| *extent != display) {
            bail!(
                "{}: has {} pixels, but {} has {display}; the pictures of one session have one size",
                pictures[i].display(),
                extents[i],
                pictures[0].display()
            );
        }
        Ok(Self { roles, display })
    }

    fn has_gray_code(&self) -> bool {
        let is_gray_code = |role: &DisplayedRole| matches!(role, DisplayedRole::GrayCode(_));
        self.roles.iter().any(is_gray_code)
    }

    fn number_of(&self, role: DisplayedRole) -> Option<usize> {
        self.roles.iter().position(|other| *other == role)
    }
}

/// What a capture folder is made from. Numbers are those of pictures and their photographs.
struct Session {
    display: Extent,
    roles: Vec<DisplayedRole>,
    light: ManifestLight,
    camera: ManifestCamera,
    dark: Option<usize>,
    flood: Option<usize>,
    /// Bits of display pixels, each once.
    gray_code: Vec<(usize, GrayCodePattern)>,
    /// Side of a light element in display pixels.
    element: u32,
}

impl Session {
    fn new(roles: Roles, light: ManifestLight, pictures: &[PathBuf]) -> Result<Self> {
        let (mut gray_code, mut seen) = (Vec::new(), HashSet::new());
        for (i, role) in roles.roles.iter().enumerate() {
            if let DisplayedRole::GrayCode(pattern) = *role
                && seen.insert(pattern.shot().photo)
            {
                gray_code.push((i, pattern));
            }
        }
        let is_pattern =
            |role: &DisplayedRole| !matches!(role, DisplayedRole::Dark | DisplayedRole::Flood);
        ensure!(
            roles.roles.iter().any(is_pattern),
            "{}: all pictures are black or white; give the patterns that the photographs show",
            pictures[0].display()
        );
        Ok(Self {
            display: roles.display,
            dark: roles.number_of(DisplayedRole::Dark),
            flood: roles.number_of(DisplayedRole::Flood),
            roles: roles.roles,
            light,
            camera: ManifestCamera::default(),
            gray_code,
            element: 1,
        })
    }

    /// The file that a photograph becomes.
    fn photo(&self, i: usize) -> String {
        let bit = self.gray_code.iter().find(|(number, _)| *number == i);
        match bit {
            Some((_, pattern)) => pattern.shot().photo,
            None if self.dark == Some(i) => "photos/dark.png".to_owned(),
            None if self.flood == Some(i) => "photos/flood.png".to_owned(),
            None => format!("photos/{i:04}.png"),
        }
    }

    /// Develops the photographs; returns their size and levels.
    fn write_photographs(
        &self,
        folder: &Path,
        paths: &[PathBuf],
        settings: &DevelopSettings,
        cores: &InterruptibleCores,
    ) -> Result<ManifestCamera> {
        let name = |i: usize| Some(self.photo(i));
        let photos = develop_all(paths, settings, folder, name, cores)?;
        warn_of_clipping(photos.levels.iter().zip(paths.iter().map(PathBuf::as_path)));
        if let Some(i) = self.flood {
            photos.levels[i].warn_of_flood(&paths[i]);
        }
        let color_matrix = paths
            .first()
            .and_then(|path| raw_color_matrix(path, folder));
        Ok(ManifestCamera {
            color_matrix,
            ..photos.camera
        })
    }

    /// The side of the smallest element that the Gray code numbers along both axes; `None` without Gray code.
    fn finest_element(&self) -> Option<u32> {
        let finest_bit = |axis: LightPlaneAxis| {
            let bits = self
                .gray_code
                .iter()
                .filter(|(_, pattern)| pattern.axis == axis);
            bits.map(|(_, pattern)| pattern.bit).min()
        };
        let [x, y] = [LightPlaneAxis::X, LightPlaneAxis::Y].map(finest_bit);
        Some(1 << x?.max(y?))
    }

    /// The smallest side that the Gray code numbers; and, where Gray code is all there is, that gives an element
    /// [`MIN_PIXELS`] camera pixels along a side. 1 without Gray code.
    fn suitable_element(&mut self, folder: &Path) -> u32 {
        let Some(finest) = self.finest_element() else {
            return 1;
        };
        self.element = finest;
        // Other patterns have elements of their own.
        if self.roles.contains(&DisplayedRole::Pattern) {
            return self.element;
        }
        let fitted = || -> Result<GrayCodeFit> {
            let any: Patterns = vec![Some(Vec::new()); self.roles.len()];
            write_manifest(folder, &self.manifest(&any))?;
            fit_gray_code(folder)
        };
        // Gray code that is not clear is reported at the end.
        let Ok(GrayCodeFit { correspondence, .. }) = fitted() else {
            return self.element;
        };
        let [[a, b, _], [c, d, _]] = correspondence.affine;
        let mut pixels = (a * d - b * c).abs().sqrt().recip();
        let mut element = self.element;
        while pixels < MIN_PIXELS && element < MAX_ELEMENT {
            (pixels, element) = (2.0 * pixels, 2 * element);
        }
        element
    }

    /// The Gray code of a number without its last bits is that of its first bits: elements are powers of two, and not smaller
    /// than its finest bit tells apart.
    fn check_element(&self, pictures: &[PathBuf]) -> Result<()> {
        let (Some((i, _)), Some(finest)) = (self.gray_code.first(), self.finest_element()) else {
            return Ok(());
        };
        ensure!(
            self.element.is_power_of_two() && self.element >= finest,
            "--element {}: {} and others are Gray code that numbers elements of {finest}, {}, {}, … display pixels only; give one \
             of these",
            self.element,
            pictures[*i].display(),
            2 * finest,
            4 * finest
        );
        Ok(())
    }

    fn read_patterns(&self, pictures: &[PathBuf]) -> Result<Patterns> {
        let emission = self.light.emission();
        let read = |(i, path): (usize, &PathBuf)| match self.roles[i] {
            DisplayedRole::Dark | DisplayedRole::Flood => Ok(None),
            _ => Ok(read_picture(path)?.element_codes(self.element, &emission)),
        };
        let patterns = pictures.par_iter().enumerate().map(read);
        let patterns: Patterns = patterns.collect::<Result<_>>()?;
        ensure!(
            patterns.iter().any(Option::is_some),
            "{}: none of the pictures is a pattern of light elements of {} pixels; give a smaller --element",
            pictures[0].display(),
            self.element
        );
        Ok(patterns)
    }

    fn light_plane(&self) -> Extent {
        let Extent { width, height } = self.display;
        Extent::new(width.div_ceil(self.element), height.div_ceil(self.element))
    }

    fn write_patterns(&self, folder: &Path, patterns: &Patterns) -> Result<()> {
        let write = |(i, codes): (usize, &Option<Vec<[u8; CHANNELS]>>)| match codes {
            None => Ok(()),
            Some(codes) => {
                let path = folder.join(pattern_name(i));
                write_png(
                    &path,
                    self.light_plane(),
                    codes.as_flattened(),
                    ExtendedColorType::Rgb8,
                )
            }
        };
        patterns.par_iter().enumerate().map(write).collect()
    }

    /// The Gray code's bits of light elements.
    fn element_bits(&self) -> impl Iterator<Item = (usize, GrayCodePattern)> {
        self.gray_code.iter().filter_map(|&(i, pattern)| {
            let bit = pattern.bit.checked_sub(self.element.ilog2())?;
            Some((i, GrayCodePattern { bit, ..pattern }))
        })
    }

    /// Removes photographs that the manifest does not name.
    fn remove_unused(&self, folder: &Path, patterns: &Patterns) -> Result<()> {
        for (i, pattern) in patterns.iter().enumerate() {
            let is_used = pattern.is_some()
                || [self.dark, self.flood].contains(&Some(i))
                || self.element_bits().any(|(number, _)| number == i);
            if !is_used {
                let path = folder.join(self.photo(i));
                std::fs::remove_file(&path).with_context(|| path.display().to_string())?;
            }
        }
        Ok(())
    }

    fn manifest(&self, patterns: &Patterns) -> Manifest {
        let shot = |(i, pattern): (usize, &Option<Vec<[u8; CHANNELS]>>)| {
            pattern.is_some().then(|| Shot {
                pattern: pattern_name(i),
                photo: self.photo(i),
                exposure: None,
            })
        };
        let bit = |(i, pattern): (usize, GrayCodePattern)| GrayCodeShot {
            photo: self.photo(i),
            ..pattern.shot()
        };
        let Extent { width, height } = self.light_plane();
        Manifest {
            version: 1,
            light: ManifestLight {
                width,
                height,
                ..self.light.clone()
            },
            camera: self.camera.clone(),
            dark: self.dark.map(|i| self.photo(i)),
            flood: self.flood.map(|i| self.photo(i)),
            shots: patterns.iter().enumerate().filter_map(shot).collect(),
            graycode: self.element_bits().map(bit).collect(),
            ..Manifest::default()
        }
    }

    /// For instance "40 shots of 1024x768 light elements of 1 display pixel, 40 photographs of Gray code, a dark frame".
    fn summary(&self, patterns: &Patterns) -> String {
        let shots = patterns.iter().flatten().count();
        let mut parts = vec![format!(
            "{shots} shots of {} light elements of {1}x{1} display pixels",
            self.light_plane(),
            self.element
        )];
        let bits = self.element_bits().count();
        if bits > 0 {
            parts.push(format!("{bits} photographs of Gray code"));
        }
        let single = [
            (self.dark, "a dark frame"),
            (self.flood, "a flood photograph"),
        ];
        let single = single.iter().filter(|(i, _)| i.is_some());
        parts.extend(single.map(|(_, name)| (*name).to_owned()));
        let is_pattern =
            |role: &&DisplayedRole| !matches!(role, DisplayedRole::Dark | DisplayedRole::Flood);
        let too_fine = self.roles.iter().filter(is_pattern).count() - shots;
        if too_fine > 0 {
            parts.push(format!(
                "{too_fine} pictures left out, which have detail within an element"
            ));
        }
        parts.join(", ")
    }
}

fn pattern_name(i: usize) -> String {
    format!("patterns/{i:04}.png")
}
