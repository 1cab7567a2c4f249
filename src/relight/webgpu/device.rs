//! The graphics device, and the programs that run on it.

use super::gpu::{API, ComputePipeline, Gpu, RenderPipeline, TextureFormat};
use super::shader::SHADER;
use crate::relight::backend::BackendError;
use crate::relight::texture_layout::TextureLimits;

/// A device that any number of photographs share.
#[derive(Debug)]
pub struct Device {
    pub(super) gpu: Gpu,
    /// Of what is drawn last.
    pub(super) format: TextureFormat,
    pub(super) pipelines: Pipelines,
    pub(super) limits: TextureLimits,
    kernel: String,
    #[cfg(not(target_arch = "wasm32"))]
    software: bool,
}

impl Device {
    /// The device that the system prefers, to draw into targets of a format.
    pub(super) async fn of(format: TextureFormat) -> Result<Self, BackendError> {
        let (gpu, adapter) = Gpu::open().await?;
        let pipelines = gpu.attempt(|| Pipelines::new(&gpu, format)).await;
        let pipelines = pipelines.map_err(|reason| {
            // Who asks again gets another.
            gpu.destroy();
            BackendError::Device { api: API, reason }
        })?;
        let kernel = match adapter.name.trim() {
            "" => API,
            name => name,
        };
        Ok(Self {
            #[cfg(not(target_arch = "wasm32"))]
            software: adapter.fallback,
            kernel: kernel.into(),
            gpu,
            format,
            pipelines,
            limits: adapter.limits,
        })
    }

    /// The adapter, by name.
    pub fn kernel(&self) -> &str {
        &self.kernel
    }

    /// Whether it is a program that makes up for a missing graphics processor. Pages ask browsers themselves.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn is_software(&self) -> bool {
        self.software
    }

    /// Frees all that is on the device, whoever holds it still.
    pub fn destroy(&self) {
        self.gpu.destroy();
    }

    /// Fails once the device no longer works.
    pub(super) fn check(&self) -> Result<(), BackendError> {
        match self.gpu.loss.reason() {
            Some(reason) => Err(BackendError::Lost(reason.into())),
            None => Ok(()),
        }
    }

    /// Runs `work`, and fails where the device refuses any of it.
    pub(super) async fn attempt<T>(&self, work: impl FnOnce() -> T) -> Result<T, BackendError> {
        let done = self.gpu.attempt(work).await;
        done.map_err(BackendError::Upload)
    }
}

#[derive(Debug)]
pub(super) struct Pipelines {
    pub see: ComputePipeline,
    pub relight: RenderPipeline,
    /// A picture to the light's columns, then to its rows.
    #[cfg(target_arch = "wasm32")]
    pub shrink: [RenderPipeline; 2],
}

impl Pipelines {
    fn new(gpu: &Gpu, format: TextureFormat) -> Self {
        let module = gpu.module(SHADER);
        let covered =
            |entry_point, format| gpu.render_pipeline(&module, "cover", entry_point, format);
        Self {
            see: gpu.compute_pipeline(&module, "see_together"),
            relight: covered("relight", format),
            #[cfg(target_arch = "wasm32")]
            shrink: ["across", "down"]
                .map(|entry_point| covered(entry_point, TextureFormat::Rgba32Float)),
        }
    }
}
