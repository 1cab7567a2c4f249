//! Graphics devices, which the photographs of a page share.

use std::rc::Rc;

use js_sys::Promise;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen_futures::future_to_promise;
use web_sys::HtmlCanvasElement;

use super::display::parse_gamut;
use super::{CodedError, Photo, Relighter};
use crate::relight::backend::Backend;
use crate::relight::webgl2::{Context, WebGl2};
use crate::relight::webgpu::{Device, WebGpu};

/// A WebGPU device, or a WebGL2 context. Freeing it frees all that is on a device, whatever still draws
/// there; a context goes with the last that does.
#[wasm_bindgen]
#[derive(Debug)]
pub struct Graphics(Kind);

#[derive(Clone, Debug)]
enum Kind {
    WebGpu(Rc<Device>),
    WebGl2(Rc<Context>),
}

#[wasm_bindgen]
impl Graphics {
    /// A WebGPU device.
    #[wasm_bindgen(unchecked_return_type = "Promise<Graphics>")]
    pub fn webgpu() -> Promise {
        future_to_promise(async {
            let device = Device::for_canvases().await.map_err(CodedError::from)?;
            Ok(Self(Kind::WebGpu(Rc::new(device))).into())
        })
    }

    /// A WebGL2 context, on a canvas that is for it alone and need not be seen. The canvas tells when
    /// the context is lost.
    pub fn webgl2(canvas: HtmlCanvasElement) -> Result<Graphics, CodedError> {
        Ok(Self(Kind::WebGl2(Rc::new(Context::new(canvas)?))))
    }

    /// The device, by name.
    #[wasm_bindgen(getter)]
    pub fn kernel(&self) -> String {
        match &self.0 {
            Kind::WebGpu(device) => device.kernel().into(),
            Kind::WebGl2(context) => context.kernel().into(),
        }
    }

    /// Whether it is a program that makes up for a missing graphics processor.
    #[wasm_bindgen(getter)]
    pub fn software(&self) -> bool {
        match &self.0 {
            Kind::WebGpu(device) => device.is_software(),
            Kind::WebGl2(context) => context.is_software(),
        }
    }

    /// Settles when a WebGPU device goes away, after which nothing can be drawn.
    #[wasm_bindgen(
        getter,
        unchecked_return_type = "Promise<{ readonly message: string }> | undefined"
    )]
    pub fn lost(&self) -> Option<Promise> {
        match &self.0 {
            Kind::WebGpu(device) => device.lost(),
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
                Kind::WebGpu(device) => WebGpu::new(device, &transport, &canvas, gamut)
                    .await
                    .map(|backend| Box::new(backend) as _),
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
        if let Kind::WebGpu(device) = &self.0 {
            device.destroy();
        }
    }
}
