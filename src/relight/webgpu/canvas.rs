//! Drawing into a page's canvases.

use std::rc::Rc;

use js_sys::{Promise, Reflect};
use wasm_bindgen::{JsCast, JsValue};
use wgpu::util::is_browser_webgpu_supported;

use super::device::{API, Device};
use super::scene::Scene;
use crate::relight::Gamut;
use crate::relight::backend::{Backend, BackendError, Frame};
use crate::transport::{Extent, Transport};

impl Device {
    /// A device that draws into canvases.
    pub async fn for_canvases() -> Result<Self, BackendError> {
        if !is_browser_webgpu_supported().await {
            return Err(BackendError::Missing(API));
        }
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::BROWSER_WEBGPU,
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        // The browser's preferred 8-bit format. Not an sRGB one: the shader encodes.
        Self::of(instance, preferred_format()).await
    }

    /// Settles, with an object that has a `message`, when the device goes away.
    pub fn lost(&self) -> Option<Promise> {
        let lost = Reflect::get(self.device.as_webgpu()?, &"lost".into());
        lost.ok()?.dyn_into().ok()
    }
}

/// A photograph on a canvas.
#[derive(Debug)]
pub struct WebGpu {
    scene: Scene,
    surface: wgpu::Surface<'static>,
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
            let target = wgpu::SurfaceTarget::Canvas(canvas.clone());
            let surface = device.instance.create_surface(target);
            let surface = surface.map_err(|e| refused(e.to_string()))?;
            let camera = transport.geometry.camera;
            let configuration = |gamut| wgpu::SurfaceConfiguration {
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
                format: device.format,
                color_space: match gamut {
                    Gamut::Srgb => wgpu::SurfaceColorSpace::Srgb,
                    Gamut::DisplayP3 => wgpu::SurfaceColorSpace::DisplayP3,
                },
                width: camera.width,
                height: camera.height,
                present_mode: wgpu::PresentMode::Fifo,
                desired_maximum_frame_latency: 1,
                alpha_mode: wgpu::CompositeAlphaMode::Opaque,
                view_formats: Vec::new(),
            };
            // Whether the browser takes it shows at the first picture.
            for gamut in [gamut, Gamut::Srgb] {
                surface.configure(&device.device, &configuration(gamut));
                if picture(&surface).is_ok() {
                    return Ok((surface, gamut));
                }
            }
            Err(refused("it takes no configuration".into()))
        });
        let (surface, gamut) = configured.await??;
        Ok(Self {
            scene,
            surface,
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
        let target = picture(&self.surface).map_err(BackendError::Lost)?;
        let view = target.texture.create_view(&Default::default());
        self.scene.draw(frame, view);
        self.scene.device().queue.present(target);
        Ok(())
    }
}

/// What the canvas shows next.
fn picture(surface: &wgpu::Surface<'_>) -> Result<wgpu::SurfaceTexture, String> {
    match surface.get_current_texture() {
        wgpu::CurrentSurfaceTexture::Success(picture)
        | wgpu::CurrentSurfaceTexture::Suboptimal(picture) => Ok(picture),
        other => Err(format!("its canvas gives no picture: {other:?}")),
    }
}

/// What canvases show without a conversion.
fn preferred_format() -> wgpu::TextureFormat {
    let navigator = Reflect::get(&js_sys::global(), &"navigator".into());
    let gpu = navigator.and_then(|navigator| Reflect::get(&navigator, &"gpu".into()));
    let format = gpu.and_then(|gpu| {
        let ask = Reflect::get(&gpu, &"getPreferredCanvasFormat".into())?;
        ask.dyn_into::<js_sys::Function>()?.call0(&gpu)
    });
    match format.ok().and_then(|format| format.as_string()).as_deref() {
        Some("rgba8unorm") => wgpu::TextureFormat::Rgba8Unorm,
        _ => wgpu::TextureFormat::Bgra8Unorm,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relight::{BuiltinLight, Display};
    use crate::transport::{Basis, Correspondence, Geometry, Tile, Window};
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
        let lost = device.lost().unwrap();
        device.destroy();
        // The browser tells in a task of its own.
        JsFuture::from(lost).await.unwrap();
        let error = webgpu.render(&frame).unwrap_err();
        assert!(error.is_loss(), "{error}");
    }
}
