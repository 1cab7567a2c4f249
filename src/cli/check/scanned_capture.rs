//! A capture whose photographs are decoded once: the codes of sampled pixels stay in memory, so that they can be read by
//! other manifests and in other selections.

use anyhow::{Context, Result};
use rayon::prelude::*;

use crate::capture::{
    CameraPixelSet, CameraRowSet, CaptureError, CaptureFolder, DarkFrame, LinearPhoto,
    ListedPhotograph, Manifest, ManifestCamera, PhotographRole, PhotographScan,
};
use crate::cli::measurement_reader::ReadSample;
use crate::cli::process_resources::InterruptibleCores;
use crate::cli::progress;
use crate::cli::recover::capture_sample::{CaptureSample, PhotographSource};
use crate::job_executor::{Cancelled, Executor};
use crate::recover::{Method, preparation_pixels};
use crate::transport::{CHANNELS, Correspondence, TileRect, Window};

/// Memory for shots that are loaded whole, and for the sampled rows of the Gray code.
const WHOLE_SHOTS_BYTES: usize = 560 << 20;
const GRAY_CODE_BYTES: usize = 128 << 20;
/// A pixel of a photograph in memory: its codes and its measurements.
const PIXEL_BYTES: usize = CHANNELS * (size_of::<u16>() + size_of::<f32>());

/// The codes of the sampled pixels, and statistics of all.
pub struct ScannedCapture<'a> {
    cores: &'a InterruptibleCores,
    sampled: SampledPixels,
    dark: Option<PhotographScan>,
    flood: Option<PhotographScan>,
    shots: Vec<Option<PhotographScan>>,
    gray_code: Vec<Option<PhotographScan>>,
    /// As decoded from the Gray code, if the manifest does not give it.
    pub correspondence: Option<Correspondence>,
    /// Of bits 0 and 1 of the Gray code, see [`PhotographSource::finest_contrasts`].
    pub contrasts: Option<[f32; 2]>,
}

/// The camera pixels whose codes are kept.
struct SampledPixels {
    /// Those that the noise floor is estimated from, as the recovery does.
    noise: CameraPixelSet,
    shots: CameraPixelSet,
    /// Whole rows.
    gray_code: CameraPixelSet,
    /// Both.
    dark: CameraPixelSet,
}

impl SampledPixels {
    fn new(manifest: &Manifest, window: Option<Window>) -> Self {
        let camera = manifest.camera.extent();
        let bytes = |photographs: usize| (photographs * PIXEL_BYTES).max(1);
        let is_small = camera.area() * bytes(manifest.shots.len() + 1) <= WHOLE_SHOTS_BYTES;
        // The fallback reads more than least squares.
        let prepared = preparation_pixels(camera, Method::Learned, window);
        let shots = match is_small {
            true => CameraPixelSet::all(camera),
            false => prepared.clone(),
        };
        let row_bytes = bytes(manifest.graycode.len()) * camera.width as usize;
        let max_rows = (GRAY_CODE_BYTES / row_bytes).max(1);
        let step = (camera.height as usize).div_ceil(max_rows);
        let single = (0..camera.height).step_by(step).map(|y| y..y + 1);
        let gray_code = CameraPixelSet::of_rows(CameraRowSet::from_strips(single), camera.width);
        let rects: Vec<TileRect> = shots.rects().chain(gray_code.rects()).collect();
        Self {
            dark: CameraPixelSet::union(camera, &rects),
            noise: prepared,
            shots,
            gray_code,
        }
    }

    fn of(&self, role: PhotographRole) -> &CameraPixelSet {
        match role {
            PhotographRole::Dark => &self.dark,
            PhotographRole::Flood | PhotographRole::Shot(_) => &self.shots,
            PhotographRole::GrayCode(_) => &self.gray_code,
        }
    }
}

impl<'a> ScannedCapture<'a> {
    /// Decodes all photographs in parallel, for a recovery in `window`, which is `None` if it is estimated. Returns those that
    /// cannot be read as well.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn read(
        folder: &CaptureFolder,
        window: Option<Window>,
        cores: &'a InterruptibleCores,
    ) -> Result<(Self, Vec<(PhotographRole, CaptureError)>), Cancelled> {
        let manifest = folder.manifest();
        let listed = manifest.photographs();
        let sampled = SampledPixels::new(manifest, window);
        let bar = progress::bar("reading", listed.len());
        let scan = |photograph: &ListedPhotograph<'_>| {
            cores.check_cancelled()?;
            let scan = folder.scan(*photograph, sampled.of(photograph.role));
            bar.inc(1);
            Ok((photograph.role, scan))
        };
        let scans = listed.par_iter().map(scan);
        let scans = scans.collect::<Result<Vec<_>, Cancelled>>()?;
        drop(bar);
        let mut capture = Self {
            cores,
            sampled,
            dark: None,
            flood: None,
            shots: vec![None; manifest.shots.len()],
            gray_code: vec![None; manifest.graycode.len()],
            correspondence: None,
            contrasts: None,
        };
        let mut errors = Vec::new();
        for (role, scan) in scans {
            match (role, scan) {
                (_, Err(error)) => errors.push((role, error)),
                (PhotographRole::Dark, Ok(scan)) => capture.dark = Some(scan),
                (PhotographRole::Flood, Ok(scan)) => capture.flood = Some(scan),
                (PhotographRole::Shot(i), Ok(scan)) => capture.shots[i] = Some(scan),
                (PhotographRole::GrayCode(i), Ok(scan)) => capture.gray_code[i] = Some(scan),
            }
        }
        Ok((capture, errors))
    }

    /// The statistics of a photograph; `None` if it is not listed, or cannot be read.
    pub fn scan(&self, role: PhotographRole) -> Option<&PhotographScan> {
        match role {
            PhotographRole::Dark => self.dark.as_ref(),
            PhotographRole::Flood => self.flood.as_ref(),
            PhotographRole::Shot(i) => self.shots.get(i)?.as_ref(),
            PhotographRole::GrayCode(i) => self.gray_code.get(i)?.as_ref(),
        }
    }

    /// Whether the correspondence is declared or decoded.
    pub fn has_correspondence(&self, folder: &CaptureFolder) -> bool {
        folder.manifest().correspondence.is_some() || self.correspondence.is_some()
    }

    /// The camera pixels that are kept of shots.
    pub fn shot_pixels(&self) -> &CameraPixelSet {
        &self.sampled.shots
    }

    /// The camera rows that are kept of Gray code.
    pub fn gray_code_rows(&self) -> &CameraRowSet {
        self.sampled.gray_code.rows()
    }

    /// The dark frame as measurements in the pixels that are kept of photographs of this role; zeros if there is none.
    pub fn dark_of(&self, role: PhotographRole, camera: &ManifestCamera) -> LinearPhoto {
        let pixels = self.sampled.of(role);
        let Some(dark) = &self.dark else {
            return vec![[0.0; CHANNELS]; pixels.count()];
        };
        let pixels = pixels.rects().flat_map(TileRect::pixels);
        let indices = pixels.filter_map(|pixel| self.sampled.dark.index_of(pixel));
        let codes = indices.map(|n| &dark.pixels[n]);
        let linear = |codes: &[u16; CHANNELS]| codes.map(|code| camera.linear(code, 1.0));
        codes.map(linear).collect()
    }

    /// Measurements of `shots`, which were read, by the manifest of `folder`.
    ///
    /// # Errors
    /// If a pattern cannot be read any more.
    pub fn sample(&self, folder: CaptureFolder, shots: Vec<usize>) -> Result<CaptureSample> {
        let manifest = folder.manifest();
        let camera = &manifest.camera;
        let light = self.dark_of(PhotographRole::Flood, camera);
        let dark = DarkFrame::new(self.sampled.shots.clone(), light, camera);
        let code = (camera.white - camera.black).recip();
        let noise = dark.noise(&self.sampled.noise);
        let patterns = shots.par_iter().map(|&i| folder.read_pattern(i));
        let patterns = patterns.collect::<Result<Vec<_>, _>>()?;
        let declared = manifest.correspondence.as_ref();
        let correspondence = declared.or(self.correspondence.as_ref()).cloned();
        let correspondence = correspondence.context("the correspondence is unknown")?;
        let measure = |scan: &PhotographScan, exposure: f64| -> LinearPhoto {
            camera
                .measure(&scan.pixels, exposure, dark.light())
                .collect()
        };
        let scans = shots.iter().map(|&i| self.scan(PhotographRole::Shot(i)));
        let scans = scans.collect::<Option<Vec<_>>>();
        let scans = scans.context("a photograph has not been read")?;
        let photos = scans.par_iter().zip(&shots);
        let photos = photos.map(|(scan, &i)| measure(scan, folder.exposure(i)));
        let photos = photos.collect();
        let flood = self.flood.as_ref().filter(|_| manifest.flood.is_some());
        let brightness = 1.0 - manifest.light.dimming.unwrap_or(0.0);
        let flood_photo = flood.map(|scan| measure(scan, brightness));
        let mut measurements = folder.empty_measurements(&shots, patterns, correspondence, noise);
        measurements.loaded = self.sampled.shots.clone();
        measurements.photos = photos;
        measurements.flood = flood_photo;
        let codes = |scan: &PhotographScan| scan.codes.with_saturation(camera.saturated_from());
        let codes_by_shot = scans.iter().map(|scan| codes(scan)).collect();
        let mut read = ReadSample::new(&mut measurements, codes_by_shot, code);
        read.flood_codes = flood.map(codes);
        Ok(CaptureSample {
            folder,
            shots,
            measurements,
            read,
        })
    }
}

impl PhotographSource for &ScannedCapture<'_> {
    fn cores(&self) -> &InterruptibleCores {
        self.cores
    }

    fn read_shots(
        &self,
        sample: CaptureSample,
        shots: Vec<usize>,
        manifest: Manifest,
    ) -> Result<CaptureSample> {
        let folder = sample.folder.with_manifest(manifest);
        drop(sample);
        self.sample(folder, shots)
    }

    fn finest_contrasts(&self, _: &CaptureSample) -> Option<[f32; 2]> {
        self.contrasts
    }
}
