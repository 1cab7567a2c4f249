//! Drawing into a page's canvases.

use std::rc::Rc;

use js_sys::Promise;
use wasm_bindgen::JsValue;

use super::device::Device;
use super::gpu::{API, Canvas};
use super::scene::Scene;
use crate::relight::Gamut;
use crate::relight::backend::{Backend, BackendError, Frame};
use crate::transport::{Extent, Transport};

impl Device {
    /// A device that draws into canvases.
    pub async fn for_canvases() -> Result<Self, BackendError> {
        Self::of(Canvas::preferred_format()).await
    }

    /// Settles, with an object that has a `message`, when the device goes away.
    pub fn lost(&self) -> Promise {
        self.gpu.lost()
    }
}

/// A photograph on a canvas.
#[derive(Debug)]
pub struct WebGpu {
    scene: Scene,
    canvas: Canvas,
    gamut: Gamut,
}

impl WebGpu {
    /// Uploads a transport. The canvas is touched last, so that after most failures another back
    /// end can still have it.
    pub async fn new(
        device: Rc<Device>,
        transport: &Transport,
        canvas: &web_sys::HtmlCanvasElement,
        gamut: Gamut,
    ) -> Result<Self, BackendError> {
        let scene = Scene::new(device.clone(), transport).await?;
        let refused = |reason| BackendError::Canvas { api: API, reason };
        let configured = device.attempt(|| {
            let camera = transport.geometry.camera;
            canvas.set_width(camera.width);
            canvas.set_height(camera.height);
            let canvas = Canvas::of(canvas).map_err(refused)?;
            // Whether the browser takes it shows at the first picture.
            let show = |gamut| {
                canvas.configure(&device.gpu, device.format, gamut)?;
                canvas.view().map(|_| gamut)
            };
            let shown = show(gamut).or_else(|_| show(Gamut::Srgb));
            shown.map(|gamut| (canvas, gamut)).map_err(refused)
        });
        let (canvas, gamut) = configured.await??;
        Ok(Self {
            scene,
            canvas,
            gamut,
        })
    }
}

impl Backend for WebGpu {
    fn name(&self) -> &'static str {
        "webgpu"
    }

    fn kernel(&self) -> String {
        self.scene.device().kernel().into()
    }

    fn gamut(&self) -> Gamut {
        self.gamut
    }

    fn take_picture(&mut self, picture: &JsValue, extent: Extent) -> Result<bool, JsValue> {
        self.scene.take_picture(picture, extent)
    }

    fn render(&mut self, frame: &Frame<'_>) -> Result<(), BackendError> {
        self.scene.device().check()?;
        let lost = |reason| BackendError::Lost(format!("its canvas gives no picture: {reason}"));
        let view = self.canvas.view().map_err(lost)?;
        self.scene.draw(frame, &view);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relight::{BuiltinLight, Display};
    use crate::transport::{Basis, Correspondence, Geometry, Tile, Window};
    use wasm_bindgen::JsCast;
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
        let device = Rc::new(Device::for_canvases().await.unwrap());
        let webgpu = WebGpu::new(device.clone(), &transport, &canvas, Gamut::Srgb).await;
        let mut webgpu = webgpu.unwrap();
        let frame = Frame {
            light: Some(&BuiltinLight::Flood.render(extent)),
            display: Display::srgb(1.0),
            detail: 1.0,
        };
        webgpu.render(&frame).unwrap();
        let lost = device.lost();
        device.destroy();
        // The browser tells in a task of its own.
        JsFuture::from(lost).await.unwrap();
        let error = webgpu.render(&frame).unwrap_err();
        assert!(error.is_loss(), "{error}");
    }
}
