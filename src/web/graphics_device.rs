//! A graphics device that the photographs of a page share.

use std::rc::Rc;

use js_sys::Promise;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen_futures::future_to_promise;
use web_sys::HtmlCanvasElement;

use super::drawing::output_transform::parse_gamut;
use super::{CanvasRelighter, CodedError, Photo};
use crate::relight::backend::Backend;
#[cfg(feature = "webgl2")]
use crate::relight::webgl2::{GlContext, WebGl2Backend};
#[cfg(feature = "webgpu")]
use crate::relight::webgpu::{GpuContext, WebGpuBackend};

/// A WebGPU device or a WebGL2 context. Freeing a device frees everything on it, also for relighters that still use it;
/// a context is freed with its last relighter.
#[wasm_bindgen]
#[derive(Debug)]
pub struct GraphicsDevice(DeviceHandle);

#[derive(Clone, Debug)]
enum DeviceHandle {
    #[cfg(feature = "webgpu")]
    WebGpu(Rc<GpuContext>),
    #[cfg(feature = "webgl2")]
    WebGl2(Rc<GlContext>),
}

#[wasm_bindgen]
impl GraphicsDevice {
    /// Opens a WebGPU device.
    #[cfg(feature = "webgpu")]
    #[wasm_bindgen(unchecked_return_type = "Promise<GraphicsDevice>")]
    pub fn webgpu() -> Promise {
        future_to_promise(async {
            let device = GpuContext::for_canvases().await.map_err(CodedError::from)?;
            Ok(Self(DeviceHandle::WebGpu(Rc::new(device))).into())
        })
    }

    /// Opens a WebGL2 context on a canvas of its own, which need not be in the page. The canvas fires
    /// `webglcontextlost` when the context is lost.
    ///
    /// # Errors
    /// Code `backend-unavailable`.
    #[cfg(feature = "webgl2")]
    pub fn webgl2(canvas: HtmlCanvasElement) -> Result<GraphicsDevice, CodedError> {
        Ok(Self(DeviceHandle::WebGl2(Rc::new(GlContext::new(canvas)?))))
    }

    /// The device's name.
    #[wasm_bindgen(getter)]
    pub fn kernel(&self) -> String {
        match &self.0 {
            #[cfg(feature = "webgpu")]
            DeviceHandle::WebGpu(device) => device.kernel().into(),
            #[cfg(feature = "webgl2")]
            DeviceHandle::WebGl2(context) => context.kernel.clone(),
        }
    }

    /// Settles when a WebGPU device is lost and cannot draw any more.
    #[wasm_bindgen(
        getter,
        unchecked_return_type = "Promise<{ readonly message: string }> | undefined"
    )]
    pub fn lost(&self) -> Option<Promise> {
        match &self.0 {
            #[cfg(feature = "webgpu")]
            DeviceHandle::WebGpu(device) => Some(device.lost()),
            #[cfg(feature = "webgl2")]
            DeviceHandle::WebGl2(_) => None,
        }
    }

    /// Uploads a photograph, to be drawn into a canvas, which is resized. `photo` may be freed afterwards. Each
    /// `CanvasRelighter` needs a new canvas, also after a failure.
    #[wasm_bindgen(unchecked_return_type = "Promise<CanvasRelighter>")]
    pub fn draw(
        &self,
        photo: &Photo,
        canvas: HtmlCanvasElement,
        #[wasm_bindgen(unchecked_param_type = "\"srgb\" | \"display-p3\"")] gamut: String,
    ) -> Promise {
        let (device, transport, kernel) = (self.0.clone(), photo.transport(), self.kernel());
        future_to_promise(async move {
            let gamut = parse_gamut(&gamut)?;
            let light = transport.geometry.light;
            let backend: Result<Box<dyn Backend>, _> = match device {
                #[cfg(feature = "webgpu")]
                DeviceHandle::WebGpu(device) => {
                    WebGpuBackend::new(device, &transport, &canvas, gamut)
                        .await
                        .map(|backend| Box::new(backend) as _)
                }
                #[cfg(feature = "webgl2")]
                DeviceHandle::WebGl2(context) => {
                    WebGl2Backend::new(context, &transport, &canvas, gamut)
                        .map(|backend| Box::new(backend) as _)
                }
            };
            let backend = backend.map_err(CodedError::from)?;
            Ok(JsValue::from(CanvasRelighter {
                backend,
                kernel,
                light,
            }))
        })
    }
}

impl Drop for GraphicsDevice {
    fn drop(&mut self) {
        match &self.0 {
            #[cfg(feature = "webgpu")]
            DeviceHandle::WebGpu(device) => device.destroy(),
            #[cfg(feature = "webgl2")]
            DeviceHandle::WebGl2(_) => {}
        }
    }
}
