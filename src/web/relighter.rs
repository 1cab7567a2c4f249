//! One photograph on one canvas.

use js_sys::Promise;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen_futures::future_to_promise;
use web_sys::HtmlCanvasElement;

use super::canvas2d::Canvas2d;
use super::{CodedError, Light, Photo};
use crate::relight::LightError;
use crate::relight::backend::Backend;
use crate::relight::webgl2::WebGl2;
use crate::relight::webgpu::WebGpu;
use crate::transport::Extent;

/// Draws a photograph into a canvas, by one back end.
#[wasm_bindgen]
pub struct Relighter {
    backend: Box<dyn Backend>,
    light: Extent,
}

#[wasm_bindgen]
impl Relighter {
    /// Sets a back end up, and the canvas to the picture's size. `photo` may be freed afterwards.
    /// A canvas serves one `Relighter` only: give the next, also after a failure, a new one.
    #[wasm_bindgen(unchecked_return_type = "Promise<Relighter>")]
    pub fn create(
        #[wasm_bindgen(unchecked_param_type = "\"webgpu\" | \"webgl2\" | \"cpu\"")] backend: String,
        photo: &Photo,
        canvas: HtmlCanvasElement,
    ) -> Promise {
        let (transport, light) = (photo.transport(), photo.geometry().light);
        future_to_promise(async move {
            let error = |e| JsValue::from(CodedError::from(e));
            let backend: Box<dyn Backend> = match backend.as_str() {
                "webgpu" => Box::new(WebGpu::new(&transport, &canvas).await.map_err(error)?),
                "webgl2" => Box::new(WebGl2::new(&transport, &canvas).map_err(error)?),
                "cpu" => Box::new(Canvas2d::new(transport, &canvas).map_err(error)?),
                name => {
                    return Err(JsValue::from(CodedError::new(
                        "backend-unavailable",
                        format!("there is no back end '{name}'; there are webgpu, webgl2 and cpu"),
                    )));
                }
            };
            Ok(Self { backend, light }.into())
        })
    }

    /// The back end's name.
    #[wasm_bindgen(getter)]
    pub fn backend(&self) -> String {
        self.backend.name().into()
    }

    /// What does the work: `simd128` or `scalar`, or the graphics device by name.
    #[wasm_bindgen(getter)]
    pub fn kernel(&self) -> String {
        self.backend.kernel()
    }

    /// Settles when the graphics device goes away, after which nothing can be drawn. A WebGL2 canvas
    /// tells by an event of its own, and a CPU does not go away.
    #[wasm_bindgen(
        getter,
        unchecked_return_type = "Promise<{ readonly message: string }> | undefined"
    )]
    pub fn lost(&self) -> Option<Promise> {
        self.backend.lost()
    }

    /// Draws the picture under `light`, scaled by `exposure`, before it returns. The canvas can be
    /// read until the end of the current task.
    pub fn render(&mut self, light: &Light, exposure: f64) -> Result<(), CodedError> {
        if !(exposure >= 0.0 && exposure <= f64::from(f32::MAX)) {
            return Err(CodedError::new(
                "light-value",
                format!("the exposure is {exposure}; it must be a number from 0 to 3.4e38"),
            ));
        }
        let light = light.inner();
        if light.extent() != self.light {
            return Err(LightError::Length {
                got: light.elements().len() * 3,
                need: self.light.area() * 3,
                extent: self.light,
            }
            .into());
        }
        Ok(self.backend.render(light, exposure as f32)?)
    }
}
