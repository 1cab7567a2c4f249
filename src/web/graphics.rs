//! Graphics devices, which the photographs of a page share.

use std::rc::Rc;

use js_sys::Promise;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen_futures::future_to_promise;
use web_sys::HtmlCanvasElement;

use super::drawing::display::parse_gamut;
use super::{CodedError, Photo, Relighter};
use crate::relight::backend::Backend;
#[cfg(feature = "webgl2")]
use crate::relight::webgl2::{Context, WebGl2};
#[cfg(feature = "webgpu")]
use crate::relight::webgpu::{Device, WebGpu};

/// A WebGPU device, or a WebGL2 context. Freeing it frees all that is on a device, whatever still draws
/// there; a context goes with the last that does.
#[wasm_bindgen]
#[derive(Debug)]
pub struct Graphics(Kind);

#[derive(Clone, Debug)]
enum Kind {
    #[cfg(feature = "webgpu")]
    WebGpu(Rc<Device>),
    #[cfg(feature = "webgl2")]
    WebGl2(Rc<Context>),
}

#[wasm_bindgen]
impl Graphics {
    /// A WebGPU device.
    #[cfg(feature = "webgpu")]
    #[wasm_bindgen(unchecked_return_type = "Promise<Graphics>")]
    pub fn webgpu() -> Promise {
        future_to_promise(async {
            let device = Device::for_canvases().await.map_err(CodedError::from)?;
            Ok(Self(Kind::WebGpu(Rc::new(device))).into())
        })
    }

    /// A WebGL2 context, on a canvas that is for it alone and need not be seen. The canvas tells when
    /// the context is lost.
    #[cfg(feature = "webgl2")]
    pub fn webgl2(canvas: HtmlCanvasElement) -> Result<Graphics, CodedError> {
        Ok(Self(Kind::WebGl2(Rc::new(Context::new(canvas)?))))
    }

    /// The device, by name.
    #[wasm_bindgen(getter)]
    pub fn kernel(&self) -> String {
        match &self.0 {
            #[cfg(feature = "webgpu")]
            Kind::WebGpu(device) => device.kernel().into(),
            #[cfg(feature = "webgl2")]
            Kind::WebGl2(context) => context.kernel().into(),
        }
    }

    /// Settles when a WebGPU device goes away, after which nothing can be drawn.
    #[wasm_bindgen(
        getter,
        unchecked_return_type = "Promise<{ readonly message: string }> | undefined"
    )]
    pub fn lost(&self) -> Option<Promise> {
        match &self.0 {
            #[cfg(feature = "webgpu")]
            Kind::WebGpu(device) => Some(device.lost()),
            #[cfg(feature = "webgl2")]
            Kind::WebGl2(_) => None,
        }
    }

    /// Brings a photograph to the device, to be drawn into a canvas, which gets the picture's size.
    /// `photo` may be freed afterwards. A canvas serves one `Relighter` only: give the next, also after
    /// a failure, a new one.
    #[wasm_bindgen(unchecked_return_type = "Promise<Relighter>")]
    pub fn draw(
        &self,
        photo: &Photo,
        canvas: HtmlCanvasElement,
        #[wasm_bindgen(unchecked_param_type = "\"srgb\" | \"display-p3\"")] gamut: String,
    ) -> Promise {
        let (kind, transport) = (self.0.clone(), photo.transport());
        future_to_promise(async move {
            let gamut = parse_gamut(&gamut)?;
            let light = transport.geometry.light;
            let backend: Result<Box<dyn Backend>, _> = match kind {
                #[cfg(feature = "webgpu")]
                Kind::WebGpu(device) => WebGpu::new(device, &transport, &canvas, gamut)
                    .await
                    .map(|backend| Box::new(backend) as _),
                #[cfg(feature = "webgl2")]
                Kind::WebGl2(context) => WebGl2::new(context, &transport, &canvas, gamut)
                    .map(|backend| Box::new(backend) as _),
            };
            let backend = backend.map_err(CodedError::from)?;
            Ok(JsValue::from(Relighter::of(backend, light)))
        })
    }
}

impl Drop for Graphics {
    fn drop(&mut self) {
        match &self.0 {
            #[cfg(feature = "webgpu")]
            Kind::WebGpu(device) => device.destroy(),
            #[cfg(feature = "webgl2")]
            Kind::WebGl2(_) => {}
        }
    }
}
