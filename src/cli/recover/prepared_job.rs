//! A recovery that is ready to run, in this process or in another one.

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};

use super::capture_sample::{CaptureSample, SampleSource};
use super::findings::Findings;
use super::inputs::RecoveryInputs;
use super::origin::{FileOrigin, OriginInput};
use super::preparation::{CapturePreparation, PreparationSettings, PreparedCapture};
use crate::capture::{CaptureFolder, CodeStatistics, Manifest, Measurements, NoiseModel};
use crate::export::{self, Provenance};
use crate::format::{CodingPlan, Metadata};
use crate::job_executor::Executor;
use crate::recover::{HoldoutValidation, Method, PreparedRecovery, TailEstimate};
use crate::transport::{Basis, Correspondence, Decibels, Geometry};

/// What is learned from a capture: all that its tiles and its file depend on beside the photographs.
#[derive(Serialize, Deserialize)]
pub struct PreparedJob {
    pub recovery: PreparedRecovery,
    /// Share of light from outside the window, if the window was estimated.
    pub leak: Option<f64>,
    /// As the photographs are read by: the capture's own, or with what is estimated instead.
    pub manifest: Manifest,
    /// Indices of the shots that the recovery uses.
    pub shots: Vec<usize>,
    pub correspondence: Correspondence,
    pub noise: NoiseModel,
    /// Of the codes of all photographs.
    pub codes: CodeStatistics,
    pub findings: Findings,
    pub origin: FileOrigin,
    /// `None` if all tiles are analysed before the file is encoded.
    pub coding: Option<CodingPlan>,
}

impl PreparedJob {
    /// Prepares a recovery. Returns the photographs that it is prepared from, too. Calls `opened` once all files are opened,
    /// and `ready` once the recovery is prepared, before all files are hashed; an error of either ends it.
    ///
    /// # Errors
    /// Those of [`SampleSource::read`] and [`CapturePreparation::run`].
    pub fn learn(
        inputs: &RecoveryInputs<'_>,
        source: SampleSource<'_>,
        opened: impl FnOnce() -> Result<()>,
        ready: impl FnOnce(&PreparedRecovery) -> Result<()>,
    ) -> Result<(Self, CaptureSample)> {
        let sample = source.read(inputs.folder.clone(), inputs.shots.clone(), opened)?;
        let preparation = CapturePreparation {
            settings: PreparationSettings::of(inputs.options),
            folder: inputs.folder,
            source,
        };
        let PreparedCapture {
            sample,
            prepared,
            findings,
        } = preparation.run(sample, inputs.options)?;
        ready(&prepared.recovery)?;
        let expected_snr_db = prepared.expected_snr();
        let (recovery, measurements) = (prepared.recovery, &sample.measurements);
        source.cores.check_cancelled()?;
        let quality = inputs.options.quality();
        let coding = export::plan_file(&recovery, measurements, quality, source.cores)
            .context("the file cannot be planned")?;
        source.cores.check_cancelled()?;
        let origin = FileOrigin::new(
            &OriginInput {
                folder: inputs.folder,
                shots: &inputs.shots,
                window: recovery.geometry().window.side(),
                noise: measurements.noise,
                expected_snr_db,
            },
            source.cores,
        )?;
        let job = Self {
            recovery,
            leak: match prepared.band {
                Some(TailEstimate::Bounded { tail_fraction }) => Some(tail_fraction),
                _ => None,
            },
            manifest: sample.folder.manifest().clone(),
            shots: sample.shots.clone(),
            correspondence: measurements.correspondence.clone(),
            noise: measurements.noise,
            codes: sample.read.codes,
            findings,
            origin,
            coding,
        };
        Ok((job, sample))
    }

    /// The SNR of the recovered transport, estimated on held-out patterns.
    pub fn expected_snr(&self) -> Option<Decibels> {
        let validation = self.recovery.holdout_validation();
        validation.and_then(HoldoutValidation::snr)
    }

    /// Number of components of factored tiles, if there are such tiles.
    pub fn rank(&self) -> Option<usize> {
        self.recovery.basis().map(Basis::rank)
    }

    /// The measurements that tiles are recovered from, without camera pixels yet.
    pub fn empty_measurements(&self, folder: &CaptureFolder) -> Result<Measurements> {
        let patterns = self.shots.iter().map(|&i| folder.read_pattern(i));
        let patterns = patterns.collect::<Result<Vec<_>, _>>()?;
        let correspondence = self.correspondence.clone();
        Ok(folder.empty_measurements(&self.shots, patterns, correspondence, self.noise))
    }

    /// The metadata of the file; `shots` are those that the capture was to be recovered from.
    pub fn metadata(&self, shots: &[usize], method: Method) -> Result<Metadata> {
        let provenance = Provenance::new(&self.manifest, shots);
        let mut metadata = export::metadata(&provenance, method);
        metadata.origin = Some(serde_json::to_value(&self.origin)?);
        Ok(metadata)
    }

    /// Whether the job is one of `inputs`: its grids are those of the capture, and its shots among those to recover from.
    pub fn is_of(&self, inputs: &RecoveryInputs<'_>) -> bool {
        let (declared, geometry) = (inputs.folder.manifest(), self.recovery.geometry());
        let extents = |manifest: &Manifest| (manifest.camera.extent(), manifest.light.extent());
        geometry.clone().validate().is_ok()
            && geometry.tile_side == Geometry::DEFAULT_TILE_SIDE
            && (geometry.camera, geometry.light) == extents(declared)
            && extents(&self.manifest) == extents(declared)
            && self.manifest.shots.len() == declared.shots.len()
            && self.shots.iter().all(|shot| inputs.shots.contains(shot))
    }

    /// The bytes that [`from_bytes`](Self::from_bytes) reads, as MessagePack: numbers keep all of their bits.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let (validation, faults) = (self.recovery.holdout_validation(), self.recovery.faults());
        rmp_serde::to_vec_named(&(self, validation, faults))
            .context("what was learned cannot be stored")
    }

    /// # Errors
    /// If the bytes are of another version of this program.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, rmp_serde::decode::Error> {
        let (mut job, validation, faults): (Self, _, _) = rmp_serde::from_slice(bytes)?;
        job.recovery.restore(validation, faults);
        Ok(job)
    }
}
