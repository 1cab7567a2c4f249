//! The names of <https://www.w3.org/TR/webgpu/>, as far as they are called.

use js_sys::{Array, Object, Promise};
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::{JsCast, JsValue};

#[wasm_bindgen]
extern "C" {
    #[derive(Clone)]
    pub type Entry;
    #[wasm_bindgen(thread_local_v2, js_namespace = navigator, js_name = gpu)]
    pub static GPU: Option<Entry>;
    #[wasm_bindgen(method, catch, js_name = requestAdapter)]
    pub async fn request_adapter(this: &Entry, options: &Dictionary) -> Result<JsValue, JsValue>;
    #[wasm_bindgen(method, js_name = getPreferredCanvasFormat)]
    pub fn get_preferred_canvas_format(this: &Entry) -> String;

    pub type Adapter;
    #[wasm_bindgen(method, getter)]
    pub fn limits(this: &Adapter) -> Limits;
    #[wasm_bindgen(method, getter)]
    pub fn info(this: &Adapter) -> Option<AdapterInfo>;
    #[wasm_bindgen(method, catch, js_name = requestDevice)]
    pub async fn request_device(this: &Adapter, described: &Dictionary)
    -> Result<JsValue, JsValue>;

    pub type Limits;
    #[wasm_bindgen(method, getter, js_name = maxTextureDimension2D)]
    pub fn side(this: &Limits) -> u32;
    #[wasm_bindgen(method, getter, js_name = maxTextureArrayLayers)]
    pub fn layers(this: &Limits) -> u32;

    pub type AdapterInfo;
    #[wasm_bindgen(method, getter)]
    pub fn description(this: &AdapterInfo) -> Option<String>;
    #[wasm_bindgen(method, getter)]
    pub fn vendor(this: &AdapterInfo) -> Option<String>;
    #[wasm_bindgen(method, getter)]
    pub fn architecture(this: &AdapterInfo) -> Option<String>;

    #[derive(Clone, Debug)]
    pub type Device;
    #[wasm_bindgen(method, getter)]
    pub fn queue(this: &Device) -> Queue;
    #[wasm_bindgen(method, getter)]
    pub fn lost(this: &Device) -> Promise;
    #[wasm_bindgen(method, setter, js_name = onuncapturederror)]
    pub fn set_onuncapturederror(this: &Device, listener: &JsValue);
    #[wasm_bindgen(method)]
    pub fn destroy(this: &Device);
    #[wasm_bindgen(method, js_name = pushErrorScope)]
    pub fn push_error_scope(this: &Device, filter: &str);
    #[wasm_bindgen(method, js_name = popErrorScope)]
    pub fn pop_error_scope(this: &Device) -> Promise;
    #[wasm_bindgen(method, js_name = createShaderModule)]
    pub fn create_shader_module(this: &Device, described: &Dictionary) -> JsValue;
    #[wasm_bindgen(method, js_name = createComputePipeline)]
    pub fn create_compute_pipeline(this: &Device, described: &Dictionary) -> Pipeline;
    #[wasm_bindgen(method, js_name = createRenderPipeline)]
    pub fn create_render_pipeline(this: &Device, described: &Dictionary) -> Pipeline;
    #[wasm_bindgen(method, js_name = createTexture)]
    pub fn create_texture(this: &Device, described: &Dictionary) -> Resource;
    #[wasm_bindgen(method, js_name = createBuffer)]
    pub fn create_buffer(this: &Device, described: &Dictionary) -> Resource;
    #[wasm_bindgen(method, js_name = createBindGroup)]
    pub fn create_bind_group(this: &Device, described: &Dictionary) -> JsValue;
    #[wasm_bindgen(method, js_name = createCommandEncoder)]
    pub fn create_command_encoder(this: &Device) -> Encoder;

    #[derive(Clone, Debug)]
    pub type Queue;
    #[wasm_bindgen(method, js_name = writeTexture)]
    pub fn write_texture(
        this: &Queue,
        to: &Dictionary,
        texels: &[u8],
        layout: &Dictionary,
        size: &JsValue,
    );
    #[wasm_bindgen(method, catch, js_name = copyExternalImageToTexture)]
    pub fn copy_external_image_to_texture(
        this: &Queue,
        source: &Dictionary,
        to: &Dictionary,
        size: &JsValue,
    ) -> Result<(), JsValue>;
    #[wasm_bindgen(method, js_name = writeBuffer)]
    pub fn write_buffer(this: &Queue, buffer: &Resource, offset: u32, contents: &[u8]);
    #[wasm_bindgen(method)]
    pub fn submit(this: &Queue, commands: &JsValue);

    /// A texture or a buffer.
    #[derive(Clone, Debug)]
    pub type Resource;
    #[wasm_bindgen(method, js_name = createView)]
    pub fn create_view(this: &Resource, described: &Dictionary) -> JsValue;
    #[wasm_bindgen(method)]
    pub fn destroy(this: &Resource);

    #[derive(Clone, Debug)]
    pub type Pipeline;
    #[wasm_bindgen(method, js_name = getBindGroupLayout)]
    pub fn get_bind_group_layout(this: &Pipeline, group: u32) -> JsValue;

    pub type Encoder;
    #[wasm_bindgen(method, js_name = beginComputePass)]
    pub fn begin_compute_pass(this: &Encoder) -> Pass;
    #[wasm_bindgen(method, js_name = beginRenderPass)]
    pub fn begin_render_pass(this: &Encoder, described: &Dictionary) -> Pass;
    #[wasm_bindgen(method)]
    pub fn finish(this: &Encoder) -> JsValue;

    /// One that computes, or one that draws.
    pub type Pass;
    #[wasm_bindgen(method, js_name = setPipeline)]
    pub fn set_pipeline(this: &Pass, pipeline: &Pipeline);
    #[wasm_bindgen(method, js_name = setBindGroup)]
    pub fn set_bind_group(this: &Pass, group: u32, bindings: &JsValue);
    #[wasm_bindgen(method, js_name = dispatchWorkgroups)]
    pub fn dispatch_workgroups(this: &Pass, x: u32, y: u32);
    #[wasm_bindgen(method)]
    pub fn draw(this: &Pass, vertices: u32);
    #[wasm_bindgen(method)]
    pub fn end(this: &Pass);

    #[derive(Clone, Debug)]
    pub type CanvasContext;
    #[wasm_bindgen(method, catch)]
    pub fn configure(this: &CanvasContext, configuration: &Dictionary) -> Result<(), JsValue>;
    #[wasm_bindgen(method, catch, js_name = getCurrentTexture)]
    pub fn get_current_texture(this: &CanvasContext) -> Result<Resource, JsValue>;

    /// An error, or why a device was lost.
    pub type Told;
    #[wasm_bindgen(method, getter)]
    pub fn reason(this: &Told) -> Option<String>;
    #[wasm_bindgen(method, getter)]
    pub fn message(this: &Told) -> String;

    pub type ErrorEvent;
    #[wasm_bindgen(method, getter)]
    pub fn error(this: &ErrorEvent) -> Told;

    pub type Dictionary;
    #[wasm_bindgen(method, indexing_setter)]
    pub fn set(this: &Dictionary, name: &str, value: &JsValue);

    /// Any value, as text.
    #[wasm_bindgen(js_name = String)]
    pub fn string(value: &JsValue) -> String;
}

pub fn dictionary(fields: &[(&str, JsValue)]) -> Dictionary {
    let dictionary: Dictionary = Object::new().unchecked_into();
    for (name, value) in fields {
        dictionary.set(name, value);
    }
    dictionary
}

pub fn list(values: impl IntoIterator<Item = JsValue>) -> JsValue {
    let list = Array::new();
    for value in values {
        list.push(&value);
    }
    list.into()
}
