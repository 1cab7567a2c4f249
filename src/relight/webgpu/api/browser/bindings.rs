//! The browser's interfaces of <https://www.w3.org/TR/webgpu/>, as far as they are used.

use js_sys::{Array, Object, Promise};
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::{JsCast, JsValue};

#[wasm_bindgen]
extern "C" {
    /// `GPU`.
    #[derive(Clone)]
    pub type GpuEntryPoint;
    #[wasm_bindgen(thread_local_v2, js_namespace = navigator, js_name = gpu)]
    pub static GPU: Option<GpuEntryPoint>;
    #[wasm_bindgen(method, catch, js_name = requestAdapter)]
    pub async fn request_adapter(
        this: &GpuEntryPoint,
        options: &WebIdlDictionary,
    ) -> Result<JsValue, JsValue>;
    #[wasm_bindgen(method, js_name = getPreferredCanvasFormat)]
    pub fn get_preferred_canvas_format(this: &GpuEntryPoint) -> String;

    pub type GpuAdapter;
    #[wasm_bindgen(method, getter)]
    pub fn limits(this: &GpuAdapter) -> WebIdlDictionary;
    #[wasm_bindgen(method, getter)]
    pub fn info(this: &GpuAdapter) -> Option<WebIdlDictionary>;
    #[wasm_bindgen(method, catch, js_name = requestDevice)]
    pub async fn request_device(
        this: &GpuAdapter,
        descriptor: &WebIdlDictionary,
    ) -> Result<JsValue, JsValue>;

    #[derive(Clone, Debug)]
    pub type GpuDevice;
    #[wasm_bindgen(method, getter)]
    pub fn queue(this: &GpuDevice) -> GpuQueue;
    #[wasm_bindgen(method, getter)]
    pub fn lost(this: &GpuDevice) -> Promise;
    #[wasm_bindgen(method, setter, js_name = onuncapturederror)]
    pub fn set_onuncapturederror(this: &GpuDevice, listener: &JsValue);
    #[wasm_bindgen(method)]
    pub fn destroy(this: &GpuDevice);
    #[wasm_bindgen(method, js_name = pushErrorScope)]
    pub fn push_error_scope(this: &GpuDevice, filter: &str);
    #[wasm_bindgen(method, js_name = popErrorScope)]
    pub fn pop_error_scope(this: &GpuDevice) -> Promise;
    #[wasm_bindgen(method, js_name = createShaderModule)]
    pub fn create_shader_module(this: &GpuDevice, descriptor: &WebIdlDictionary) -> JsValue;
    #[wasm_bindgen(method, js_name = createComputePipeline)]
    pub fn create_compute_pipeline(this: &GpuDevice, descriptor: &WebIdlDictionary) -> GpuPipeline;
    #[wasm_bindgen(method, js_name = createRenderPipeline)]
    pub fn create_render_pipeline(this: &GpuDevice, descriptor: &WebIdlDictionary) -> GpuPipeline;
    #[wasm_bindgen(method, js_name = createTexture)]
    pub fn create_texture(this: &GpuDevice, descriptor: &WebIdlDictionary) -> GpuBufferOrTexture;
    #[wasm_bindgen(method, js_name = createBuffer)]
    pub fn create_buffer(this: &GpuDevice, descriptor: &WebIdlDictionary) -> GpuBufferOrTexture;
    #[wasm_bindgen(method, js_name = createBindGroup)]
    pub fn create_bind_group(this: &GpuDevice, descriptor: &WebIdlDictionary) -> JsValue;
    #[wasm_bindgen(method, js_name = createCommandEncoder)]
    pub fn create_command_encoder(this: &GpuDevice) -> GpuCommandEncoder;

    #[derive(Clone, Debug)]
    pub type GpuQueue;
    #[wasm_bindgen(method, js_name = writeTexture)]
    pub fn write_texture(
        this: &GpuQueue,
        to: &WebIdlDictionary,
        texels: &[u8],
        layout: &WebIdlDictionary,
        size: &JsValue,
    );
    #[wasm_bindgen(method, catch, js_name = copyExternalImageToTexture)]
    pub fn copy_external_image_to_texture(
        this: &GpuQueue,
        source: &WebIdlDictionary,
        to: &WebIdlDictionary,
        size: &JsValue,
    ) -> Result<(), JsValue>;
    #[wasm_bindgen(method, js_name = writeBuffer)]
    pub fn write_buffer(this: &GpuQueue, buffer: &GpuBufferOrTexture, offset: u32, contents: &[u8]);
    #[wasm_bindgen(method)]
    pub fn submit(this: &GpuQueue, commands: &JsValue);

    /// `GPUTexture` or `GPUBuffer`.
    #[derive(Clone, Debug)]
    pub type GpuBufferOrTexture;
    #[wasm_bindgen(method, js_name = createView)]
    pub fn create_view(this: &GpuBufferOrTexture, descriptor: &WebIdlDictionary) -> JsValue;
    #[wasm_bindgen(method)]
    pub fn destroy(this: &GpuBufferOrTexture);

    /// `GPUComputePipeline` or `GPURenderPipeline`.
    #[derive(Clone, Debug)]
    pub type GpuPipeline;
    #[wasm_bindgen(method, js_name = getBindGroupLayout)]
    pub fn get_bind_group_layout(this: &GpuPipeline, group: u32) -> JsValue;

    pub type GpuCommandEncoder;
    #[wasm_bindgen(method, js_name = beginComputePass)]
    pub fn begin_compute_pass(this: &GpuCommandEncoder) -> GpuPassEncoder;
    #[wasm_bindgen(method, js_name = beginRenderPass)]
    pub fn begin_render_pass(
        this: &GpuCommandEncoder,
        descriptor: &WebIdlDictionary,
    ) -> GpuPassEncoder;
    #[wasm_bindgen(method)]
    pub fn finish(this: &GpuCommandEncoder) -> JsValue;

    /// `GPUComputePassEncoder` or `GPURenderPassEncoder`.
    pub type GpuPassEncoder;
    #[wasm_bindgen(method, js_name = setPipeline)]
    pub fn set_pipeline(this: &GpuPassEncoder, pipeline: &GpuPipeline);
    #[wasm_bindgen(method, js_name = setBindGroup)]
    pub fn set_bind_group(this: &GpuPassEncoder, group: u32, bind_group: &JsValue);
    #[wasm_bindgen(method, js_name = dispatchWorkgroups)]
    pub fn dispatch_workgroups(this: &GpuPassEncoder, x: u32, y: u32);
    #[wasm_bindgen(method)]
    pub fn draw(this: &GpuPassEncoder, vertices: u32);
    #[wasm_bindgen(method)]
    pub fn end(this: &GpuPassEncoder);

    #[derive(Clone, Debug)]
    pub type GpuCanvasContext;
    #[wasm_bindgen(method, catch)]
    pub fn configure(
        this: &GpuCanvasContext,
        configuration: &WebIdlDictionary,
    ) -> Result<(), JsValue>;
    #[wasm_bindgen(method, catch, js_name = getCurrentTexture)]
    pub fn get_current_texture(this: &GpuCanvasContext) -> Result<GpuBufferOrTexture, JsValue>;

    /// An object of options or of read-only values.
    pub type WebIdlDictionary;
    #[wasm_bindgen(method, indexing_getter)]
    pub fn get(this: &WebIdlDictionary, name: &str) -> JsValue;
    #[wasm_bindgen(method, indexing_setter)]
    pub fn set(this: &WebIdlDictionary, name: &str, value: &JsValue);

    /// JavaScript's conversion to a string.
    #[wasm_bindgen(js_name = String)]
    pub fn string(value: &JsValue) -> String;
}

/// A JavaScript object with these fields.
pub fn dictionary(fields: &[(&str, JsValue)]) -> WebIdlDictionary {
    let dictionary: WebIdlDictionary = Object::new().unchecked_into();
    for (name, value) in fields {
        dictionary.set(name, value);
    }
    dictionary
}

/// A JavaScript array.
pub fn list(values: impl IntoIterator<Item = JsValue>) -> JsValue {
    Array::from_iter(values).into()
}
