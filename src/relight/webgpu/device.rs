//! The graphics device, and the programs that run on it.

use std::sync::{Arc, OnceLock};

use crate::relight::backend::BackendError;
use crate::relight::texture_layout::TextureLimits;

/// What errors call the interface.
pub(super) const API: &str = "WebGPU";
/// The module; the first file is WebGL2's source as well.
const SHADER: &str = concat!(
    include_str!("../shaders/relight.wgsl"),
    include_str!("../shaders/see.wgsl")
);

/// A device that any number of photographs share.
#[derive(Debug)]
pub struct Device {
    #[cfg(target_arch = "wasm32")]
    pub(super) instance: wgpu::Instance,
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    /// Of what is drawn last.
    pub(super) format: wgpu::TextureFormat,
    pub(super) see: wgpu::ComputePipeline,
    pub(super) relight: wgpu::RenderPipeline,
    #[cfg(target_arch = "wasm32")]
    pub(super) shrink: [wgpu::RenderPipeline; 2],
    pub(super) limits: TextureLimits,
    kernel: String,
    software: bool,
    /// Why it no longer works, once it does not.
    lost: Arc<OnceLock<String>>,
}

impl Device {
    /// The device that the system prefers, to draw into targets of a format.
    pub(super) async fn of(
        instance: wgpu::Instance,
        format: wgpu::TextureFormat,
    ) -> Result<Self, BackendError> {
        let error = |reason: String| BackendError::Device { api: API, reason };
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..Default::default()
        };
        let adapter = instance.request_adapter(&options).await;
        let adapter = adapter.map_err(|e| error(e.to_string()))?;
        let offered = adapter.limits();
        let limits = TextureLimits {
            side: offered.max_texture_dimension_2d,
            layers: offered.max_texture_array_layers,
        };
        let described = wgpu::DeviceDescriptor {
            required_limits: wgpu::Limits {
                max_texture_dimension_2d: limits.side,
                max_texture_array_layers: limits.layers,
                ..wgpu::Limits::downlevel_defaults()
            },
            ..Default::default()
        };
        let given = adapter.request_device(&described).await;
        let (device, queue) = given.map_err(|e| error(e.to_string()))?;
        let lost = watch(&device);
        let pipelines = attempt(&device, || Pipelines::new(&device, format)).await;
        let pipelines = pipelines.map_err(error)?;
        let info = adapter.get_info();
        let kernel = describe(&info, &device);
        Ok(Self {
            software: is_software(&info, &kernel),
            kernel,
            lost,
            #[cfg(target_arch = "wasm32")]
            instance,
            device,
            queue,
            format,
            see: pipelines.see,
            relight: pipelines.relight,
            #[cfg(target_arch = "wasm32")]
            shrink: pipelines.shrink,
            limits,
        })
    }

    /// The adapter, by name.
    pub fn kernel(&self) -> &str {
        &self.kernel
    }

    /// Whether it is a program that makes up for a missing graphics processor.
    pub fn is_software(&self) -> bool {
        self.software
    }

    /// Frees all that is on the device, whoever holds it still.
    pub fn destroy(&self) {
        self.device.destroy();
    }

    /// Fails once the device no longer works.
    pub(super) fn check(&self) -> Result<(), BackendError> {
        match self.lost.get() {
            Some(reason) => Err(BackendError::Lost(reason.clone())),
            None => Ok(()),
        }
    }

    /// Runs `work`, and fails where the device refuses any of it.
    pub(super) async fn attempt<T>(&self, work: impl FnOnce() -> T) -> Result<T, BackendError> {
        let done = attempt(&self.device, work).await;
        done.map_err(BackendError::Upload)
    }
}

/// Runs `work`; what the device has against it, if anything.
async fn attempt<T>(device: &wgpu::Device, work: impl FnOnce() -> T) -> Result<T, String> {
    let invalid = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let done = work();
    // Both before anything is waited for, as others may use the device meanwhile; innermost first.
    let (memory, invalid) = (memory.pop(), invalid.pop());
    let refused = [memory.await, invalid.await];
    match refused.into_iter().flatten().next() {
        Some(error) => Err(error.to_string()),
        None => Ok(done),
    }
}

/// Notes the first thing that stops a device from working. (wgpu panics at an error that nobody
/// listens for.)
fn watch(device: &wgpu::Device) -> Arc<OnceLock<String>> {
    let lost = Arc::new(OnceLock::new());
    let note = lost.clone();
    device.set_device_lost_callback(move |reason, message| {
        let _ = note.set(format!("{reason:?} {message}"));
    });
    let note = lost.clone();
    device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
        let _ = note.set(error.to_string());
    }));
    lost
}

/// The adapter as far as the system tells: in full, by vendor and architecture, or not at all.
#[cfg_attr(not(target_arch = "wasm32"), allow(unused_variables))]
fn describe(info: &wgpu::AdapterInfo, device: &wgpu::Device) -> String {
    #[cfg_attr(not(target_arch = "wasm32"), allow(unused_mut))]
    let mut name = info.name.clone();
    // In browsers wgpu leaves these two out.
    #[cfg(target_arch = "wasm32")]
    if name.is_empty()
        && let Some(device) = device.as_webgpu()
        && let Ok(info) = js_sys::Reflect::get(device, &"adapterInfo".into())
    {
        let field = |key: &str| js_sys::Reflect::get(&info, &key.into()).ok()?.as_string();
        let fields = [field("vendor"), field("architecture")];
        name = fields.into_iter().flatten().collect::<Vec<_>>().join(" ");
    }
    match name.trim() {
        "" => API.into(),
        name => name.into(),
    }
}

fn is_software(info: &wgpu::AdapterInfo, kernel: &str) -> bool {
    info.device_type == wgpu::DeviceType::Cpu || crate::relight::backend::names_software(kernel)
}

struct Pipelines {
    see: wgpu::ComputePipeline,
    relight: wgpu::RenderPipeline,
    /// A picture to the light's columns, then to its rows.
    #[cfg(target_arch = "wasm32")]
    shrink: [wgpu::RenderPipeline; 2],
}

impl Pipelines {
    fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("relight"),
            source: wgpu::ShaderSource::Wgsl(SHADER.into()),
        });
        let pipeline = |entry_point, targets: &[Option<wgpu::ColorTargetState>]| {
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(entry_point),
                layout: None,
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some("cover"),
                    compilation_options: Default::default(),
                    buffers: &[],
                },
                primitive: Default::default(),
                depth_stencil: None,
                multisample: Default::default(),
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some(entry_point),
                    compilation_options: Default::default(),
                    targets,
                }),
                multiview_mask: None,
                cache: None,
            })
        };
        #[cfg(target_arch = "wasm32")]
        let floats = Some(wgpu::TextureFormat::Rgba32Float.into());
        Self {
            see: device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some("see"),
                layout: None,
                module: &module,
                entry_point: Some("see_together"),
                compilation_options: Default::default(),
                cache: None,
            }),
            relight: pipeline("relight", &[Some(format.into())]),
            #[cfg(target_arch = "wasm32")]
            shrink: ["across", "down"]
                .map(|entry_point| pipeline(entry_point, std::slice::from_ref(&floats))),
        }
    }
}
