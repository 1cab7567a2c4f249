//! Relighting by WebGPU, through wgpu.

mod textures;

use std::sync::{Arc, OnceLock};

use js_sys::{Promise, Reflect};
use wasm_bindgen::JsCast;
use wgpu::util::is_browser_webgpu_supported;

use super::backend::{Backend, BackendError};
use super::texture_layout::{Pass, TextureLayout, TextureLimits};
use super::{Light, SHADER};
use crate::transport::{CHANNELS, Extent, Transport};
use textures::{Textures, write_texture};

const API: &str = "WebGPU";

/// A transport on a WebGPU device, and the canvas it is drawn into.
pub struct WebGpu {
    layout: TextureLayout,
    device: wgpu::Device,
    queue: wgpu::Queue,
    surface: wgpu::Surface<'static>,
    see: Passes,
    relight: wgpu::RenderPipeline,
    bindings: wgpu::BindGroup,
    textures: Textures,
    /// The light that is seen.
    lit: Option<Light>,
    kernel: String,
    /// Why the device no longer works, once it does not.
    lost: Arc<OnceLock<String>>,
}

/// What sees the light through the basis.
struct Passes {
    pipeline: wgpu::RenderPipeline,
    /// `[channel][pair]`.
    bindings: [Vec<wgpu::BindGroup>; CHANNELS],
    layers: Vec<wgpu::TextureView>,
}

impl WebGpu {
    /// Uploads a transport. The canvas is touched last, so that after most failures another back
    /// end can still have it.
    pub async fn new(
        transport: &Transport,
        canvas: &web_sys::HtmlCanvasElement,
    ) -> Result<Self, BackendError> {
        let device_error = |reason: String| BackendError::Device { api: API, reason };
        if !is_browser_webgpu_supported().await {
            return Err(BackendError::Missing(API));
        }
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::BROWSER_WEBGPU,
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let adapter = instance
            .request_adapter(&wgpu::RequestAdapterOptions::default())
            .await
            .map_err(|e| device_error(e.to_string()))?;
        let offered = adapter.limits();
        let layout = TextureLayout::new(
            transport,
            TextureLimits {
                side: offered.max_texture_dimension_2d,
                layers: offered.max_texture_array_layers,
            },
        )?;
        let (device, queue) = adapter
            .request_device(&wgpu::DeviceDescriptor {
                required_limits: wgpu::Limits {
                    max_texture_dimension_2d: offered.max_texture_dimension_2d,
                    max_texture_array_layers: offered.max_texture_array_layers,
                    ..wgpu::Limits::downlevel_webgl2_defaults()
                },
                ..Default::default()
            })
            .await
            .map_err(|e| device_error(e.to_string()))?;
        let lost = watch(&device);

        let invalid = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let out_of_memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let surface = instance
            .create_surface(wgpu::SurfaceTarget::Canvas(canvas.clone()))
            .map_err(|e| BackendError::Canvas {
                api: API,
                reason: e.to_string(),
            });
        let built = surface.map(|surface| {
            // The browser's preferred 8-bit format. Not an sRGB one: the shader encodes.
            let formats = surface.get_capabilities(&adapter).formats;
            let format = formats
                .first()
                .copied()
                .unwrap_or(wgpu::TextureFormat::Bgra8Unorm);
            let [see, relight] = pipelines(&device, format);
            let textures = Textures::new(&device, &layout, &transport.basis);
            textures.upload(&queue, &layout, transport);
            let bindings = textures.bind(&device, &relight);
            let see = Passes {
                bindings: textures.bind_passes(&device, &see),
                layers: textures.layers(),
                pipeline: see,
            };
            configure(&surface, &device, format, transport.geometry.camera);
            (surface, see, relight, bindings, textures)
        });
        // Scopes are popped on every path, innermost first.
        let errors = [out_of_memory.pop().await, invalid.pop().await];
        let built = built.and_then(|parts| match errors.into_iter().flatten().next() {
            Some(error) => Err(BackendError::Upload(error.to_string())),
            None => Ok(parts),
        });
        // Not left to the garbage collector, which does not know how much the device holds.
        let (surface, see, relight, bindings, textures) =
            built.inspect_err(|_| device.destroy())?;
        Ok(Self {
            layout,
            queue,
            surface,
            see,
            relight,
            bindings,
            textures,
            lit: None,
            kernel: describe(&adapter.get_info(), &device),
            lost,
            device,
        })
    }
}

impl Backend for WebGpu {
    fn name(&self) -> &'static str {
        "webgpu"
    }

    fn kernel(&self) -> String {
        self.kernel.clone()
    }

    fn render(&mut self, light: &Light, exposure: f32) -> Result<(), BackendError> {
        if let Some(reason) = self.lost.get() {
            return Err(BackendError::Lost(reason.clone()));
        }
        let frame = match self.surface.get_current_texture() {
            wgpu::CurrentSurfaceTexture::Success(frame)
            | wgpu::CurrentSurfaceTexture::Suboptimal(frame) => frame,
            other => return Err(BackendError::Lost(format!("no frame: {other:?}"))),
        };
        let tint = light.tint();
        let params = self.layout.params(tint, exposure);
        let bytes = bytemuck::bytes_of(&params);
        self.queue.write_buffer(&self.textures.params, 0, bytes);
        let mut encoder = self.device.create_command_encoder(&Default::default());
        // What is seen depends on the light alone.
        if self.lit.as_ref() != Some(light) {
            let elements = bytemuck::cast_slice(light.elements());
            let extent = self.layout.light();
            write_texture(&self.queue, &self.textures.light, elements, [0; 3], extent);
            for Pass {
                channel,
                pair,
                layer,
            } in self.layout.passes(tint)
            {
                let layers = &self.see.layers[layer as usize..][..2];
                let bindings = &self.see.bindings[channel][pair];
                draw(&mut encoder, &self.see.pipeline, bindings, layers);
            }
            self.lit = Some(light.clone());
        }
        let view = frame.texture.create_view(&Default::default());
        draw(&mut encoder, &self.relight, &self.bindings, &[view]);
        self.queue.submit([encoder.finish()]);
        self.queue.present(frame);
        Ok(())
    }

    fn lost(&self) -> Option<Promise> {
        let lost = Reflect::get(self.device.as_webgpu()?, &"lost".into());
        lost.ok()?.dyn_into().ok()
    }
}

impl Drop for WebGpu {
    /// Frees the device's memory now; the garbage collector does not know how much there is.
    fn drop(&mut self) {
        self.device.destroy();
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

/// The adapter as far as the browser tells: in full, by vendor and architecture, or not at all.
fn describe(info: &wgpu::AdapterInfo, device: &wgpu::Device) -> String {
    let mut name = info.name.clone();
    // wgpu leaves these two out.
    if name.is_empty()
        && let Some(device) = device.as_webgpu()
        && let Ok(info) = Reflect::get(device, &"adapterInfo".into())
    {
        let field = |key: &str| Reflect::get(&info, &key.into()).ok()?.as_string();
        let fields = [field("vendor"), field("architecture")];
        name = fields.into_iter().flatten().collect::<Vec<_>>().join(" ");
    }
    match name.trim() {
        "" => API.into(),
        name => name.into(),
    }
}

/// Covers the targets.
fn draw(
    encoder: &mut wgpu::CommandEncoder,
    pipeline: &wgpu::RenderPipeline,
    bindings: &wgpu::BindGroup,
    targets: &[wgpu::TextureView],
) {
    let attachment = |view| {
        Some(wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                store: wgpu::StoreOp::Store,
            },
        })
    };
    let attachments: Vec<_> = targets.iter().map(attachment).collect();
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &attachments,
        ..Default::default()
    });
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, bindings, &[]);
    pass.draw(0..3, 0..1);
}

/// Of the passes that see, and of the last one.
fn pipelines(device: &wgpu::Device, format: wgpu::TextureFormat) -> [wgpu::RenderPipeline; 2] {
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
    let seen = Some(wgpu::TextureFormat::Rgba32Float.into());
    [
        pipeline("see", &[seen.clone(), seen]),
        pipeline("relight", &[Some(format.into())]),
    ]
}

fn configure(
    surface: &wgpu::Surface<'_>,
    device: &wgpu::Device,
    format: wgpu::TextureFormat,
    camera: Extent,
) {
    let configuration = wgpu::SurfaceConfiguration {
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
        format,
        color_space: wgpu::SurfaceColorSpace::Srgb,
        width: camera.width,
        height: camera.height,
        present_mode: wgpu::PresentMode::Fifo,
        desired_maximum_frame_latency: 1,
        alpha_mode: wgpu::CompositeAlphaMode::Opaque,
        view_formats: Vec::new(),
    };
    surface.configure(device, &configuration);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relight::BuiltinLight;
    use crate::transport::{Basis, Correspondence, Geometry, Tile, Window};
    use wasm_bindgen_futures::JsFuture;
    use wasm_bindgen_test::wasm_bindgen_test;

    #[wasm_bindgen_test]
    async fn a_lost_device_is_reported() {
        let extent = Extent {
            width: 8,
            height: 8,
        };
        let geometry = Geometry {
            camera: extent,
            light: extent,
            window: Window::new(3).unwrap(),
            correspondence: Correspondence {
                affine: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            },
            tile_side: 8,
        };
        let transport = Transport {
            geometry,
            basis: Basis::default(),
            tiles: vec![Tile::dark(geometry.tile(0))],
        };
        let document = web_sys::window().unwrap().document().unwrap();
        let canvas = document.create_element("canvas").unwrap().unchecked_into();
        let mut webgpu = WebGpu::new(&transport, &canvas).await.unwrap();
        let light = BuiltinLight::Flood.render(extent);
        webgpu.render(&light, 1.0).unwrap();
        let lost = webgpu.lost().unwrap();
        webgpu.device.destroy();
        // The browser tells in a task of its own.
        JsFuture::from(lost).await.unwrap();
        let error = webgpu.render(&light, 1.0).unwrap_err();
        assert!(error.is_loss(), "{error}");
    }
}
