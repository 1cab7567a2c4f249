//! From a browser, as it is.

mod bindings;

use bindings as js;
use bindings::{Dictionary, dictionary, list};
use js_sys::Promise;
use wasm_bindgen::{JsCast, JsValue, prelude::Closure};
use wasm_bindgen_futures::{JsFuture, spawn_local};
use web_sys::HtmlCanvasElement;

use super::{API, Adapter, Loss, Resource, TextureDescriptor, TextureFormat, usage};
use crate::relight::Gamut;
use crate::relight::backend::BackendError;
use crate::relight::texture_layout::TextureLimits;
use crate::transport::Extent;

/// What a buffer is for.
const UNIFORM: u32 = 64;
const COPY_DST: u32 = 8;

/// A device and its queue.
#[derive(Debug)]
pub struct Gpu {
    device: js::Device,
    queue: js::Queue,
    pub loss: Loss,
}

/// A texture, and all of it as a view. The device's memory is freed when it is dropped: the garbage collector
/// does not know how much there is.
#[derive(Debug)]
pub struct Texture {
    texture: js::Resource,
    pub view: View,
}

/// What is drawn into.
pub type View = JsValue;

/// A small buffer that shaders read.
#[derive(Debug)]
pub struct Uniforms(js::Resource);

/// Shaders.
pub struct Module(JsValue);

#[derive(Debug)]
pub struct ComputePipeline(js::Pipeline);

#[derive(Debug)]
pub struct RenderPipeline(js::Pipeline);

/// What a pipeline's bindings stand for.
#[derive(Debug)]
pub struct Bindings(JsValue);

/// What the device is to do.
pub struct Commands(js::Encoder);

/// A canvas that a device draws into.
#[derive(Debug)]
pub struct Canvas(js::CanvasContext);

impl Gpu {
    /// The device that the browser prefers.
    pub async fn open() -> Result<(Self, Adapter), BackendError> {
        let error = |thrown| BackendError::Device {
            api: API,
            reason: reason(&thrown),
        };
        let entry = js::GPU.with(Option::clone);
        let entry = entry.ok_or(BackendError::Missing(API))?;
        let options = dictionary(&[("powerPreference", "high-performance".into())]);
        let adapter = entry.request_adapter(&options).await.map_err(error)?;
        if adapter.is_null() {
            return Err(BackendError::Missing(API));
        }
        let adapter: js::Adapter = adapter.unchecked_into();
        let offered = adapter.limits();
        let limits = TextureLimits {
            side: offered.side(),
            layers: offered.layers(),
        };
        let required = dictionary(&[
            ("maxTextureDimension2D", limits.side.into()),
            ("maxTextureArrayLayers", limits.layers.into()),
        ]);
        let described = dictionary(&[("requiredLimits", required.into())]);
        let device = adapter.request_device(&described).await.map_err(error)?;
        let device: js::Device = device.unchecked_into();
        let info = adapter.info();
        let name = match info.as_ref().and_then(js::AdapterInfo::description) {
            Some(name) if !name.is_empty() => name,
            _ => {
                let fields = info
                    .iter()
                    .flat_map(|info| [info.vendor(), info.architecture()]);
                fields.flatten().collect::<Vec<_>>().join(" ")
            }
        };
        let adapter = Adapter { limits, name };
        let gpu = Self {
            queue: device.queue(),
            loss: watch(&device),
            device,
        };
        Ok((gpu, adapter))
    }

    /// Frees all that is on the device, whoever holds it still.
    pub fn destroy(&self) {
        self.device.destroy();
    }

    /// Settles, with an object that has a `message`, when the device goes away.
    pub fn lost(&self) -> Promise {
        self.device.lost()
    }

    /// Runs `work`; what the device has against it, if anything.
    pub async fn attempt<T>(&self, work: impl FnOnce() -> T) -> Result<T, String> {
        self.device.push_error_scope("validation");
        self.device.push_error_scope("out-of-memory");
        let done = work();
        // Both before anything is waited for, as others may use the device meanwhile; innermost first.
        let scopes = [self.device.pop_error_scope(), self.device.pop_error_scope()];
        let mut refused = None;
        for scope in scopes {
            // Scopes fail with the device, which is told in another way.
            let error = JsFuture::from(scope).await.ok();
            refused = refused.or(error.filter(JsValue::is_object));
        }
        match refused {
            Some(error) => Err(error.unchecked_into::<js::Told>().message()),
            None => Ok(done),
        }
    }

    pub fn module(&self, wgsl: &'static str) -> Module {
        let described = dictionary(&[("code", wgsl.into())]);
        Module(self.device.create_shader_module(&described))
    }

    pub fn compute_pipeline(&self, module: &Module, entry_point: &str) -> ComputePipeline {
        let described = dictionary(&[
            ("layout", "auto".into()),
            ("compute", stage(module, entry_point).into()),
        ]);
        ComputePipeline(self.device.create_compute_pipeline(&described))
    }

    /// Runs a vertex shader, then a fragment shader for a target of a format.
    pub fn render_pipeline(
        &self,
        module: &Module,
        vertex: &str,
        fragment: &str,
        format: TextureFormat,
    ) -> RenderPipeline {
        let target = dictionary(&[("format", name(format).into())]);
        let fragment = stage(module, fragment);
        fragment.set("targets", &list([target.into()]));
        let described = dictionary(&[
            ("layout", "auto".into()),
            ("vertex", stage(module, vertex).into()),
            ("fragment", fragment.into()),
        ]);
        RenderPipeline(self.device.create_render_pipeline(&described))
    }

    pub fn texture(&self, described: &TextureDescriptor) -> Texture {
        let texture = self.device.create_texture(&dictionary(&[
            ("label", described.label.into()),
            (
                "size",
                size(described.extent, described.layers.unwrap_or(1)),
            ),
            ("format", name(described.format).into()),
            ("usage", described.usage.into()),
        ]));
        let dimension = match described.layers {
            Some(_) => "2d-array",
            None => "2d",
        };
        let view = texture.create_view(&dictionary(&[("dimension", dimension.into())]));
        Texture { texture, view }
    }

    /// Writes a rectangle of one layer, from column, row and layer `at` on.
    pub fn write_texture(&self, texture: &Texture, texels: &[u8], at: [u32; 3], extent: Extent) {
        let to = dictionary(&[
            ("texture", texture.texture.clone().into()),
            ("origin", list(at.map(JsValue::from))),
        ]);
        let row = texels.len() as u32 / extent.height;
        let layout = dictionary(&[("bytesPerRow", row.into())]);
        self.queue
            .write_texture(&to, texels, &layout, &size(extent, 1));
    }

    /// Writes a picture that the browser has, all of it: colours apart from alpha, in sRGB.
    ///
    /// # Errors
    /// What the browser throws, as for pictures of another origin.
    pub fn write_picture(
        &self,
        texture: &Texture,
        picture: &JsValue,
        extent: Extent,
    ) -> Result<(), JsValue> {
        let source = dictionary(&[("source", picture.clone())]);
        let to = dictionary(&[("texture", texture.texture.clone().into())]);
        self.queue
            .copy_external_image_to_texture(&source, &to, &size(extent, 1))
    }

    pub fn uniforms(&self, contents: &[u8]) -> Uniforms {
        let uniforms = Uniforms(self.device.create_buffer(&dictionary(&[
            ("size", (contents.len() as u32).into()),
            ("usage", (UNIFORM | COPY_DST).into()),
        ])));
        self.write_uniforms(&uniforms, contents);
        uniforms
    }

    pub fn write_uniforms(&self, uniforms: &Uniforms, contents: &[u8]) {
        self.queue.write_buffer(&uniforms.0, 0, contents);
    }

    pub fn commands(&self) -> Commands {
        Commands(self.device.create_command_encoder())
    }

    pub fn submit(&self, commands: Commands) {
        self.queue.submit(&list([commands.0.finish()]));
    }

    fn bind(&self, pipeline: &js::Pipeline, resources: &[(u32, Resource<'_>)]) -> Bindings {
        let entry = |(binding, resource): &(u32, Resource<'_>)| {
            let resource = match resource {
                Resource::Texture(texture) => texture.view.clone(),
                Resource::Uniforms(Uniforms(buffer)) => {
                    dictionary(&[("buffer", buffer.clone().into())]).into()
                }
            };
            dictionary(&[("binding", (*binding).into()), ("resource", resource)]).into()
        };
        Bindings(self.device.create_bind_group(&dictionary(&[
            ("layout", pipeline.get_bind_group_layout(0)),
            ("entries", list(resources.iter().map(entry))),
        ])))
    }
}

impl ComputePipeline {
    pub fn bind(&self, gpu: &Gpu, resources: &[(u32, Resource<'_>)]) -> Bindings {
        gpu.bind(&self.0, resources)
    }
}

impl RenderPipeline {
    pub fn bind(&self, gpu: &Gpu, resources: &[(u32, Resource<'_>)]) -> Bindings {
        gpu.bind(&self.0, resources)
    }
}

impl Commands {
    /// Runs a compute shader by so many groups, once for each of the bindings.
    pub fn dispatch(&mut self, pipeline: &ComputePipeline, each: &[Bindings], groups: [u32; 2]) {
        let pass = self.0.begin_compute_pass();
        pass.set_pipeline(&pipeline.0);
        for Bindings(bindings) in each {
            pass.set_bind_group(0, bindings);
            pass.dispatch_workgroups(groups[0], groups[1]);
        }
        pass.end();
    }

    /// Draws one triangle into a target that was cleared.
    pub fn draw(&mut self, pipeline: &RenderPipeline, bindings: &Bindings, target: &View) {
        let attachment = dictionary(&[
            ("view", target.clone()),
            ("loadOp", "clear".into()),
            ("storeOp", "store".into()),
        ]);
        let described = dictionary(&[("colorAttachments", list([attachment.into()]))]);
        let pass = self.0.begin_render_pass(&described);
        pass.set_pipeline(&pipeline.0);
        pass.set_bind_group(0, &bindings.0);
        pass.draw(3);
        pass.end();
    }
}

impl Canvas {
    /// What canvases show without a conversion. Not an sRGB format: the shader encodes.
    pub fn preferred_format() -> TextureFormat {
        let entry = js::GPU.with(Option::clone);
        match entry
            .map(|entry| entry.get_preferred_canvas_format())
            .as_deref()
        {
            Some("rgba8unorm") => TextureFormat::Rgba8Unorm,
            _ => TextureFormat::Bgra8Unorm,
        }
    }

    /// The canvas's context, if it gives one.
    pub fn of(canvas: &HtmlCanvasElement) -> Result<Self, String> {
        match canvas.get_context("webgpu") {
            Ok(Some(context)) => Ok(Self(context.unchecked_into())),
            Ok(None) => Err("getContext returned null".into()),
            Err(thrown) => Err(reason(&thrown)),
        }
    }

    /// Prepares it for pictures of a device.
    pub fn configure(&self, gpu: &Gpu, format: TextureFormat, gamut: Gamut) -> Result<(), String> {
        let configuration = dictionary(&[
            ("device", gpu.device.clone().into()),
            ("format", name(format).into()),
            ("usage", usage::RENDER_ATTACHMENT.into()),
            ("colorSpace", gamut.color_space().into()),
            ("alphaMode", "opaque".into()),
        ]);
        self.0.configure(&configuration).map_err(|e| reason(&e))
    }

    /// What it shows next.
    pub fn view(&self) -> Result<View, String> {
        let texture = self.0.get_current_texture().map_err(|e| reason(&e))?;
        Ok(texture.create_view(&dictionary(&[])))
    }
}

impl Drop for Texture {
    fn drop(&mut self) {
        self.texture.destroy();
    }
}

impl Drop for Uniforms {
    fn drop(&mut self) {
        self.0.destroy();
    }
}

/// Notes the first thing that stops a device from working.
fn watch(device: &js::Device) -> Loss {
    let loss = Loss::default();
    let (note, lost) = (loss.clone(), device.lost());
    spawn_local(async move {
        if let Ok(told) = JsFuture::from(lost).await {
            let told: js::Told = told.unchecked_into();
            note.note([told.reason().unwrap_or_default(), told.message()].join(" "));
        }
    });
    let note = loss.clone();
    let listener = Closure::<dyn FnMut(js::ErrorEvent)>::new(move |event: js::ErrorEvent| {
        note.note(event.error().message());
    });
    device.set_onuncapturederror(&listener.into_js_value());
    loss
}

fn stage(Module(module): &Module, entry_point: &str) -> Dictionary {
    dictionary(&[
        ("module", module.clone()),
        ("entryPoint", entry_point.into()),
    ])
}

fn size(extent: Extent, layers: u32) -> JsValue {
    list([extent.width, extent.height, layers].map(JsValue::from))
}

/// What was thrown, for people.
fn reason(thrown: &JsValue) -> String {
    js::string(thrown)
}

fn name(format: TextureFormat) -> &'static str {
    match format {
        TextureFormat::Rgba8Unorm => "rgba8unorm",
        TextureFormat::Bgra8Unorm => "bgra8unorm",
        TextureFormat::Rg16Sint => "rg16sint",
        TextureFormat::Rgba16Sint => "rgba16sint",
        TextureFormat::Rgba32Sint => "rgba32sint",
        TextureFormat::Rgba32Float => "rgba32float",
    }
}
