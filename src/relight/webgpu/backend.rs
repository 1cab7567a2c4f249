//! The WebGPU backend of a page: draws into canvases.

use std::rc::Rc;

use js_sys::Promise;
use wasm_bindgen::JsValue;

use super::api::{API, CanvasContext};
use super::context::GpuContext;
use super::downsampler::Downsampler;
use super::photo_renderer::WebGpuRenderer;
use crate::relight::Gamut;
use crate::relight::backend::{Backend, BackendError, FrameRequest, UploadedLight};
use crate::relight::texture_layout::binding;
use crate::transport::{Extent, Transport};

impl GpuContext {
    /// A device for canvases.
    ///
    /// # Errors
    /// [`BackendError::Missing`] or [`BackendError::Device`] if the browser gives no device.
    pub async fn for_canvases() -> Result<Self, BackendError> {
        Self::open(CanvasContext::preferred_format()).await
    }

    /// A promise of an object with a `message`, which settles when the device is lost.
    pub fn lost(&self) -> Promise {
        self.gpu.device.lost()
    }
}

/// Draws one photograph into one canvas.
#[derive(Debug)]
pub struct WebGpuBackend {
    renderer: WebGpuRenderer,
    /// `None` unless the light is a light image.
    downsampler: Option<Downsampler>,
    canvas: CanvasContext,
    gamut: Gamut,
}

impl WebGpuBackend {
    /// Uploads a transport. The canvas is used last, so that most failures leave it to another backend.
    ///
    /// # Errors
    /// [`BackendError`] if the device cannot hold the transport or the canvas gives no context.
    pub async fn new(
        device: Rc<GpuContext>,
        transport: &Transport,
        canvas: &web_sys::HtmlCanvasElement,
        gamut: Gamut,
    ) -> Result<Self, BackendError> {
        let renderer = WebGpuRenderer::new(device.clone(), transport).await?;
        let canvas_error = |reason| BackendError::Canvas(API, reason);
        let configured = device.try_upload(|| {
            let camera = transport.geometry.camera;
            canvas.set_width(camera.width);
            canvas.set_height(camera.height);
            let canvas = CanvasContext::open(canvas).map_err(canvas_error)?;
            // An unsupported gamut may fail at the first view only.
            let try_gamut = |gamut| {
                canvas.configure(&device.gpu, device.format, gamut)?;
                canvas.view().map(|_| gamut)
            };
            let gamut = try_gamut(gamut).or_else(|_| try_gamut(Gamut::Srgb));
            gamut.map(|gamut| (canvas, gamut)).map_err(canvas_error)
        });
        let (canvas, gamut) = configured.await??;
        Ok(Self {
            renderer,
            downsampler: None,
            canvas,
            gamut,
        })
    }
}

impl Backend for WebGpuBackend {
    fn gamut(&self) -> Gamut {
        self.gamut
    }

    fn set_light_image(&mut self, image: &JsValue, extent: Extent) -> Result<bool, JsValue> {
        let WebGpuRenderer {
            device,
            layout,
            textures,
            light,
        } = &mut self.renderer;
        if !layout.is_light_image_allowed(extent, device.gpu.limits) {
            return Ok(false);
        }
        let fits = |downsampler: &Downsampler| downsampler.extent == extent;
        let downsampler = match self.downsampler.take().filter(fits) {
            Some(downsampler) => downsampler,
            None => Downsampler::new(device, extent, layout.textures[binding::LIGHT].extent),
        };
        let downsampler = self.downsampler.insert(downsampler);
        downsampler.downsample(device, image, textures.light())?;
        *light = UploadedLight::default();
        Ok(true)
    }

    fn render(&mut self, frame: &FrameRequest<'_>) -> Result<(), BackendError> {
        self.renderer.device.check()?;
        let lost = |reason| BackendError::Lost(format!("the canvas gives no texture: {reason}"));
        let view = self.canvas.view().map_err(lost)?;
        if frame.light.is_some() {
            self.downsampler = None;
        }
        self.renderer.draw(frame, &view);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relight::{BuiltinLight, OutputTransform};
    use crate::transport::{Basis, Correspondence, Geometry, Tile, Window};
    use wasm_bindgen::JsCast;
    use wasm_bindgen_futures::JsFuture;
    use wasm_bindgen_test::wasm_bindgen_test;

    #[wasm_bindgen_test]
    async fn a_lost_device_is_reported() {
        let extent = Extent::new(8, 8);
        let geometry = Geometry {
            camera: extent,
            light: extent,
            window: Window::new(3).unwrap(),
            correspondence: Correspondence::from_affine([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
            tile_side: 8,
        };
        let transport = Transport {
            tiles: vec![Tile::dark(geometry.tile(0))],
            basis: Basis::default(),
            geometry,
        };
        let document = web_sys::window().unwrap().document().unwrap();
        let canvas = document.create_element("canvas").unwrap().unchecked_into();
        let device = Rc::new(GpuContext::for_canvases().await.unwrap());
        let webgpu = WebGpuBackend::new(device.clone(), &transport, &canvas, Gamut::Srgb).await;
        let mut webgpu = webgpu.unwrap();
        let frame = FrameRequest {
            light: Some(&BuiltinLight::Flood.render(extent)),
            output: OutputTransform::srgb(1.0),
            quality: 1.0,
        };
        webgpu.render(&frame).unwrap();
        let lost = device.lost();
        device.destroy();
        // The browser reports the loss in another task.
        JsFuture::from(lost).await.unwrap();
        let error = webgpu.render(&frame).unwrap_err();
        assert!(matches!(error, BackendError::Lost(_)), "{error}");
    }
}
