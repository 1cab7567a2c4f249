//! The photographs that a recovery is prepared from.

use anyhow::Result;

use crate::calibrate::LightPlaneAxis;
use crate::capture::{CameraRowSet, CaptureFolder, Manifest, Measurements};
use crate::cli::measurement_reader::{
    MeasurementReader, ReadSample, read_patterns, read_sample_of,
};
use crate::cli::process_resources::InterruptibleCores;
use crate::export::MemoryPlan;

/// Camera rows from which the contrast of Gray code is measured.
const MAX_CONTRAST_ROWS: u32 = 128;
/// Axes of the light plane.
const AXES: [LightPlaneAxis; 2] = [LightPlaneAxis::X, LightPlaneAxis::Y];

/// Where a preparation gets its photographs from.
pub trait PhotographSource {
    /// What runs jobs, and may be cancelled.
    fn cores(&self) -> &InterruptibleCores;

    /// The same photographs by another manifest. They are not read again if they were read by that.
    fn read_by(&self, sample: CaptureSample, manifest: Manifest) -> Result<CaptureSample> {
        if *sample.folder.manifest() == manifest {
            return Ok(sample);
        }
        let shots = sample.shots.clone();
        self.read_shots(sample, shots, manifest)
    }

    /// The photographs of other shots by another manifest.
    fn read_shots(
        &self,
        sample: CaptureSample,
        shots: Vec<usize>,
        manifest: Manifest,
    ) -> Result<CaptureSample>;

    /// The contrasts of bits 0 and 1 of the Gray code in the sharpest camera pixels, each along the axis where it is lower.
    /// `None` if these photographs are missing, as nothing else needs them where the correspondence is declared.
    fn finest_contrasts(&self, sample: &CaptureSample) -> Option<[f32; 2]>;
}

/// Reads photographs whole if they fit in memory, otherwise the pixels that the preparation reads.
#[derive(Clone, Copy)]
pub struct SampleSource<'a> {
    pub plan: &'a MemoryPlan,
    pub cores: &'a InterruptibleCores,
}

/// Measurements of the pixels that a recovery is prepared from, or of all, as the manifest says.
pub struct CaptureSample {
    pub folder: CaptureFolder,
    /// Indices of the shots.
    pub shots: Vec<usize>,
    pub measurements: Measurements,
    pub read: ReadSample,
}

impl SampleSource<'_> {
    /// Opens all files of the folder, calls `opened`, and reads them.
    pub fn read(
        &self,
        folder: CaptureFolder,
        shots: Vec<usize>,
        opened: impl FnOnce() -> Result<()>,
    ) -> Result<CaptureSample> {
        let pixels = self.plan.sample();
        let dark = folder.read_dark(pixels)?;
        let flood = folder.open_flood()?;
        let gray_code_rows = self.plan.gray_code_rows();
        // The same whether all pixels are loaded or not.
        let noise = dark.noise(self.plan.prepared());
        let mut measurements = read_patterns(&folder, noise, &shots, gray_code_rows)?;
        let reader = MeasurementReader::open(&folder, &shots)?;
        opened()?;
        let mut read = reader.read_sample(&mut measurements, &dark, pixels, self.cores)?;
        if let Some(flood) = flood {
            let (samples, codes) = read_sample_of(flood, &dark, pixels)?;
            measurements.flood = Some(samples);
            read.flood_codes = Some(codes);
        }
        Ok(CaptureSample {
            folder,
            shots,
            measurements,
            read,
        })
    }
}

impl PhotographSource for SampleSource<'_> {
    fn cores(&self) -> &InterruptibleCores {
        self.cores
    }

    /// Reads them. Frees the memory of the others before.
    fn read_shots(
        &self,
        sample: CaptureSample,
        shots: Vec<usize>,
        manifest: Manifest,
    ) -> Result<CaptureSample> {
        let folder = sample.folder.with_manifest(manifest);
        drop(sample);
        self.read(folder, shots, || Ok(()))
    }

    fn finest_contrasts(&self, sample: &CaptureSample) -> Option<[f32; 2]> {
        // A few, as the photographs are in memory.
        let height = sample.measurements.camera.height;
        let step = height.div_ceil(MAX_CONTRAST_ROWS);
        let rows = (0..height).step_by(step as usize).map(|y| y..y + 1);
        let rows = CameraRowSet::from_strips(rows);
        let dark = sample.folder.read_dark_rows(&rows).ok()?;
        let contrast = |axis, bit| {
            let photos = sample.folder.read_gray_code_bit(&dark, &rows, axis, bit);
            photos.ok()?.best_contrast()
        };
        let lower = |bit| {
            let [x, y] = AXES.map(|axis| contrast(axis, bit));
            Some(x?.min(y?))
        };
        Some([lower(0)?, lower(1)?])
    }
}
