//! WebGPU in browsers.

mod bindings;

use bindings as js;
pub use bindings::{
    GpuCommandEncoder as CommandEncoder, GpuPipeline as ComputePipeline,
    GpuPipeline as RenderPipeline,
};
use bindings::{WebIdlDictionary, dictionary, list};
use wasm_bindgen::{JsCast, JsValue, prelude::Closure};
use wasm_bindgen_futures::{JsFuture, spawn_local};
use web_sys::HtmlCanvasElement;

use super::{API, BindingResource, DeviceLoss, usage};
use crate::relight::Gamut;
use crate::relight::backend::BackendError;
use crate::relight::texture_layout::{TextureDescriptor, TextureFormat, TextureLimits};
use crate::transport::Extent;

/// `GPUBufferUsage`.
const UNIFORM: u32 = 64;
const COPY_DST: u32 = 8;

/// A device and its queue.
#[derive(Debug)]
pub struct DeviceAndQueue {
    pub device: js::GpuDevice,
    queue: js::GpuQueue,
    pub limits: TextureLimits,
    /// The adapter's description, or vendor and architecture; may be empty.
    pub name: String,
    pub loss: DeviceLoss,
}

/// A texture and a view of all of it. Dropping it frees the device's memory, of which the garbage collector does not
/// know.
#[derive(Debug)]
pub struct WebGpuTexture {
    texture: js::GpuBufferOrTexture,
    pub view: TextureView,
}

pub type TextureView = JsValue;
pub type BindGroup = JsValue;

#[derive(Debug)]
pub struct UniformBuffer(js::GpuBufferOrTexture);

#[derive(Debug)]
pub struct CanvasContext(js::GpuCanvasContext);

impl DeviceAndQueue {
    /// The browser's preferred device.
    ///
    /// # Errors
    /// [`BackendError::Missing`] or [`BackendError::Device`] if there is none.
    pub async fn open() -> Result<Self, BackendError> {
        let error = |thrown| BackendError::Device(API, js::string(&thrown));
        let gpu = js::GPU.with(Option::clone);
        let gpu = gpu.ok_or(BackendError::Missing(API))?;
        let options = dictionary(&[("powerPreference", "high-performance".into())]);
        let adapter = gpu.request_adapter(&options).await.map_err(error)?;
        if adapter.is_null() {
            return Err(BackendError::Missing(API));
        }
        let adapter: js::GpuAdapter = adapter.unchecked_into();
        let offered = adapter.limits();
        let limit = |name| offered.get(name).as_f64().unwrap_or_default() as u32;
        let limits = TextureLimits {
            max_side: limit("maxTextureDimension2D"),
            max_layers: limit("maxTextureArrayLayers"),
        };
        let required = dictionary(&[
            ("maxTextureDimension2D", limits.max_side.into()),
            ("maxTextureArrayLayers", limits.max_layers.into()),
        ]);
        let descriptor = dictionary(&[("requiredLimits", required.into())]);
        let device = adapter.request_device(&descriptor).await.map_err(error)?;
        let device: js::GpuDevice = device.unchecked_into();
        let info = adapter.info();
        let field = |name| info.as_ref().and_then(|info| info.get(name).as_string());
        let name = match field("description") {
            Some(name) if !name.is_empty() => name,
            _ => [field("vendor"), field("architecture")]
                .map(Option::unwrap_or_default)
                .join(" "),
        };
        Ok(Self {
            queue: device.queue(),
            loss: watch_loss(&device),
            device,
            limits,
            name,
        })
    }

    /// Runs `work`.
    ///
    /// # Errors
    /// The message of the first error that its calls raise.
    pub async fn catch_errors<T>(&self, work: impl FnOnce() -> T) -> Result<T, String> {
        self.device.push_error_scope("validation");
        self.device.push_error_scope("out-of-memory");
        let done = work();
        // Both scopes are popped, the inner one first, before either is awaited: others may use the device meanwhile.
        let scopes = [self.device.pop_error_scope(), self.device.pop_error_scope()];
        let mut first = None;
        for scope in scopes {
            // A scope of a lost device rejects; the loss is reported elsewhere.
            let error = JsFuture::from(scope).await.ok();
            first = first.or(error.filter(JsValue::is_object));
        }
        match first {
            Some(error) => Err(message(error.unchecked_ref())),
            None => Ok(done),
        }
    }

    pub fn create_shader_module(&self, wgsl: &'static str) -> JsValue {
        let descriptor = dictionary(&[("code", wgsl.into())]);
        self.device.create_shader_module(&descriptor)
    }

    pub fn create_compute_pipeline(&self, module: &JsValue, entry_point: &str) -> ComputePipeline {
        self.device.create_compute_pipeline(&dictionary(&[
            ("layout", "auto".into()),
            ("compute", stage(module, entry_point).into()),
        ]))
    }

    /// A pipeline of a vertex and a fragment shader, for one target.
    pub fn create_render_pipeline(
        &self,
        module: &JsValue,
        vertex: &str,
        fragment: &str,
        format: TextureFormat,
    ) -> RenderPipeline {
        let target = dictionary(&[("format", name(format).into())]);
        let fragment = stage(module, fragment);
        fragment.set("targets", &list([target.into()]));
        self.device.create_render_pipeline(&dictionary(&[
            ("layout", "auto".into()),
            ("vertex", stage(module, vertex).into()),
            ("fragment", fragment.into()),
        ]))
    }

    /// Creates a texture for these bits of [`usage`].
    pub fn create_texture(&self, descriptor: &TextureDescriptor, usage: u32) -> WebGpuTexture {
        let layers = descriptor.layers.unwrap_or(1);
        let texture = self.device.create_texture(&dictionary(&[
            ("label", descriptor.label.into()),
            ("size", size(descriptor.extent, layers)),
            ("format", name(descriptor.format).into()),
            ("usage", usage.into()),
        ]));
        let dimension = match descriptor.layers {
            Some(_) => "2d-array",
            None => "2d",
        };
        let view = texture.create_view(&dictionary(&[("dimension", dimension.into())]));
        WebGpuTexture { texture, view }
    }

    /// Writes a rectangle of one layer, from that column, row and layer on.
    pub fn write_texture(
        &self,
        texture: &WebGpuTexture,
        texels: &[u8],
        at: [u32; 3],
        extent: Extent,
    ) {
        let to = dictionary(&[
            ("texture", texture.texture.clone().into()),
            ("origin", list(at.map(JsValue::from))),
        ]);
        let row = (texels.len() / extent.height as usize) as u32;
        let layout = dictionary(&[("bytesPerRow", row.into())]);
        self.queue
            .write_texture(&to, texels, &layout, &size(extent, 1));
    }

    /// Copies a picture of the browser's into a texture, in sRGB with straight alpha.
    ///
    /// # Errors
    /// What the browser throws, for instance for pictures of another origin.
    pub fn write_image(
        &self,
        texture: &WebGpuTexture,
        image: &JsValue,
        extent: Extent,
    ) -> Result<(), JsValue> {
        let source = dictionary(&[("source", image.clone())]);
        let to = dictionary(&[("texture", texture.texture.clone().into())]);
        self.queue
            .copy_external_image_to_texture(&source, &to, &size(extent, 1))
    }

    pub fn create_uniforms(&self, contents: &[u8]) -> UniformBuffer {
        let uniforms = UniformBuffer(self.device.create_buffer(&dictionary(&[
            ("size", (contents.len() as u32).into()),
            ("usage", (UNIFORM | COPY_DST).into()),
        ])));
        self.write_uniforms(&uniforms, contents);
        uniforms
    }

    pub fn write_uniforms(&self, uniforms: &UniformBuffer, contents: &[u8]) {
        self.queue.write_buffer(&uniforms.0, 0, contents);
    }

    pub fn create_bind_group(
        &self,
        layout: &JsValue,
        resources: &[(u32, BindingResource<'_>)],
    ) -> BindGroup {
        let entry = |(binding, resource): &(u32, BindingResource<'_>)| {
            let resource = match resource {
                BindingResource::Texture(texture) => texture.view.clone(),
                BindingResource::Uniforms(UniformBuffer(buffer)) => {
                    dictionary(&[("buffer", buffer.clone().into())]).into()
                }
            };
            dictionary(&[("binding", (*binding).into()), ("resource", resource)]).into()
        };
        self.device.create_bind_group(&dictionary(&[
            ("layout", layout.clone()),
            ("entries", list(resources.iter().map(entry))),
        ]))
    }

    /// Submits the commands that `record` records.
    pub fn submit(&self, record: impl FnOnce(&mut CommandEncoder)) {
        let mut commands = self.device.create_command_encoder();
        record(&mut commands);
        self.queue.submit(&list([commands.finish()]));
    }
}

/// Dispatches a compute pipeline once for each bind group.
pub fn record_dispatches(
    commands: &mut CommandEncoder,
    pipeline: &ComputePipeline,
    bind_groups: &[BindGroup],
    [columns, rows]: [u32; 2],
) {
    let pass = commands.begin_compute_pass();
    pass.set_pipeline(pipeline);
    for bind_group in bind_groups {
        pass.set_bind_group(0, bind_group);
        pass.dispatch_workgroups(columns, rows);
    }
    pass.end();
}

/// Clears a target and draws one triangle into it.
pub fn record_draw(
    commands: &mut CommandEncoder,
    pipeline: &RenderPipeline,
    bind_group: &BindGroup,
    target: &TextureView,
) {
    let attachment = dictionary(&[
        ("view", target.clone()),
        ("loadOp", "clear".into()),
        ("storeOp", "store".into()),
    ]);
    let descriptor = dictionary(&[("colorAttachments", list([attachment.into()]))]);
    let pass = commands.begin_render_pass(&descriptor);
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, bind_group);
    pass.draw(3);
    pass.end();
}

impl CanvasContext {
    /// The format that canvases show without a conversion. Not an sRGB format, as the shader encodes.
    pub fn preferred_format() -> TextureFormat {
        let gpu = js::GPU.with(Option::clone);
        match gpu.map(|gpu| gpu.get_preferred_canvas_format()).as_deref() {
            Some("rgba8unorm") => TextureFormat::Rgba8Unorm,
            _ => TextureFormat::Bgra8Unorm,
        }
    }

    /// Opens the canvas's context.
    ///
    /// # Errors
    /// The reason why the canvas gives none.
    pub fn open(canvas: &HtmlCanvasElement) -> Result<Self, String> {
        match canvas.get_context("webgpu") {
            Ok(Some(context)) => Ok(Self(context.unchecked_into())),
            Ok(None) => Err("getContext returned null".into()),
            Err(thrown) => Err(js::string(&thrown)),
        }
    }

    /// Configures the canvas for a device.
    ///
    /// # Errors
    /// What the browser throws.
    pub fn configure(
        &self,
        gpu: &DeviceAndQueue,
        format: TextureFormat,
        gamut: Gamut,
    ) -> Result<(), String> {
        let configuration = dictionary(&[
            ("device", gpu.device.clone().into()),
            ("format", name(format).into()),
            ("usage", usage::RENDER_ATTACHMENT.into()),
            ("colorSpace", gamut.color_space().into()),
            ("alphaMode", "opaque".into()),
        ]);
        self.0.configure(&configuration).map_err(|e| js::string(&e))
    }

    /// The texture that is shown next.
    ///
    /// # Errors
    /// What the browser throws.
    pub fn view(&self) -> Result<TextureView, String> {
        let texture = self.0.get_current_texture().map_err(|e| js::string(&e))?;
        Ok(texture.create_view(&dictionary(&[])))
    }
}

impl Drop for WebGpuTexture {
    fn drop(&mut self) {
        self.texture.destroy();
    }
}

impl Drop for UniformBuffer {
    fn drop(&mut self) {
        self.0.destroy();
    }
}

/// Records the loss of a device or its first uncaught error.
fn watch_loss(device: &js::GpuDevice) -> DeviceLoss {
    let loss = DeviceLoss::default();
    let (recorder, lost) = (loss.clone(), device.lost());
    spawn_local(async move {
        if let Ok(info) = JsFuture::from(lost).await {
            let info: WebIdlDictionary = info.unchecked_into();
            let reason = info.get("reason").as_string().unwrap_or_default();
            let _ = recorder.set([reason, message(&info)].join(" "));
        }
    });
    let recorder = loss.clone();
    let listener = Closure::<dyn FnMut(WebIdlDictionary)>::new(move |event: WebIdlDictionary| {
        let _ = recorder.set(message(event.get("error").unchecked_ref()));
    });
    device.set_onuncapturederror(&listener.into_js_value());
    loss
}

/// The message of a `GPUError` or `GPUDeviceLostInfo`.
fn message(info: &WebIdlDictionary) -> String {
    info.get("message").as_string().unwrap_or_default()
}

fn stage(module: &JsValue, entry_point: &str) -> WebIdlDictionary {
    dictionary(&[
        ("module", module.clone()),
        ("entryPoint", entry_point.into()),
    ])
}

fn size(extent: Extent, layers: u32) -> JsValue {
    list([extent.width, extent.height, layers].map(JsValue::from))
}

fn name(format: TextureFormat) -> &'static str {
    match format {
        TextureFormat::Rgba8Unorm => "rgba8unorm",
        TextureFormat::Bgra8Unorm => "bgra8unorm",
        TextureFormat::Rg16Sint => "rg16sint",
        TextureFormat::Rgba16Sint => "rgba16sint",
        TextureFormat::Rg32Sint => "rg32sint",
        TextureFormat::Rgba32Float => "rgba32float",
    }
}
