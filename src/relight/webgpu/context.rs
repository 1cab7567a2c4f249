//! A graphics device with the pipelines that run on it.

use super::api::{API, ComputePipeline, DeviceAndQueue, RenderPipeline};
use super::shader::SHADER;
use crate::relight::backend::BackendError;
use crate::relight::texture_layout::TextureFormat;

/// A device that any number of photographs share.
#[derive(Debug)]
pub struct GpuContext {
    pub(super) gpu: DeviceAndQueue,
    /// Format of the pictures.
    pub(super) format: TextureFormat,
    pub(super) pipelines: Pipelines,
}

impl GpuContext {
    /// The system's preferred device, for pictures of a format.
    pub(super) async fn open(format: TextureFormat) -> Result<Self, BackendError> {
        let gpu = DeviceAndQueue::open().await?;
        let pipelines = gpu.catch_errors(|| Pipelines::new(&gpu, format)).await;
        let pipelines = pipelines.map_err(|reason| {
            gpu.device.destroy();
            BackendError::Device(API, reason)
        })?;
        Ok(Self {
            gpu,
            format,
            pipelines,
        })
    }

    /// The adapter's name.
    pub fn kernel(&self) -> &str {
        match self.gpu.name.trim() {
            "" => API,
            name => name,
        }
    }

    /// Whether it is a software renderer. In browsers, pages find out themselves.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn is_software(&self) -> bool {
        self.gpu.is_software
    }

    /// Frees everything on the device, also for photographs that still use it.
    pub fn destroy(&self) {
        self.gpu.device.destroy();
    }

    /// Fails once the device is lost.
    pub(super) fn check(&self) -> Result<(), BackendError> {
        match self.gpu.loss.get() {
            Some(reason) => Err(BackendError::Lost(reason.clone())),
            None => Ok(()),
        }
    }

    /// Runs `work`. Fails if the device rejects any of its calls.
    pub(super) async fn try_upload<T>(&self, work: impl FnOnce() -> T) -> Result<T, BackendError> {
        let done = self.gpu.catch_errors(work).await;
        done.map_err(BackendError::Upload)
    }
}

#[derive(Debug)]
pub(super) struct Pipelines {
    pub correlate: ComputePipeline,
    pub relight: RenderPipeline,
    #[cfg(target_arch = "wasm32")]
    pub downsample: RenderPipeline,
}

impl Pipelines {
    fn new(gpu: &DeviceAndQueue, format: TextureFormat) -> Self {
        let module = gpu.create_shader_module(SHADER);
        let fullscreen = |entry_point, format| {
            gpu.create_render_pipeline(&module, "fullscreen", entry_point, format)
        };
        Self {
            correlate: gpu.create_compute_pipeline(&module, "correlate_group"),
            relight: fullscreen("relight", format),
            #[cfg(target_arch = "wasm32")]
            downsample: fullscreen("downsample", TextureFormat::Rgba32Float),
        }
    }
}
