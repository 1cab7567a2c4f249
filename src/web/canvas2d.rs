//! The CPU back end's way into a canvas.

use std::sync::Arc;

use js_sys::{Object, Reflect};
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::{Clamped, JsCast, JsValue};
use web_sys::{CanvasRenderingContext2d, HtmlCanvasElement};

use super::drawing::display::parse_gamut;
use super::{CodedError, Photo, Relighter};
use crate::executor::SequentialExecutor;
use crate::relight::backend::{Backend, BackendError, Frame};
use crate::relight::canvas2d::{Keep, open_2d};
use crate::relight::{Gamut, Rgba8Picture, cpu};
use crate::transport::{Extent, Transport};

#[wasm_bindgen]
extern "C" {
    /// With settings that web-sys does not have.
    #[wasm_bindgen(js_name = ImageData, extends = web_sys::ImageData)]
    type Image;
    #[wasm_bindgen(constructor, catch, js_class = "ImageData")]
    fn new(
        data: Clamped<&[u8]>,
        width: u32,
        height: u32,
        settings: &Object,
    ) -> Result<Image, JsValue>;
}

/// Relights on the CPU and puts the pixels into a canvas as they are.
#[derive(Debug)]
pub struct Canvas2d {
    relighter: cpu::Relighter,
    picture: Rgba8Picture,
    context: CanvasRenderingContext2d,
    gamut: Gamut,
    /// Of the pixels.
    settings: Object,
}

impl Canvas2d {
    pub fn new(
        transport: Arc<Transport>,
        canvas: &HtmlCanvasElement,
        gamut: Gamut,
    ) -> Result<Self, BackendError> {
        let camera = transport.geometry.camera;
        let (context, gamut) = open_2d(canvas, camera, gamut, Keep::InMemory)?;
        let settings = Object::new();
        let space = gamut.color_space().into();
        Reflect::set(&settings, &"colorSpace".into(), &space).map_err(lost)?;
        Ok(Self {
            relighter: cpu::Relighter::new(transport),
            picture: Rgba8Picture::black(camera),
            context,
            gamut,
            settings,
        })
    }
}

#[wasm_bindgen]
impl Relighter {
    /// One that draws on this thread. A canvas serves one `Relighter` only: give the next, also after a
    /// failure, a new one.
    #[wasm_bindgen(constructor)]
    pub fn new(
        photo: &Photo,
        canvas: HtmlCanvasElement,
        #[wasm_bindgen(unchecked_param_type = "\"srgb\" | \"display-p3\"")] gamut: &str,
    ) -> Result<Relighter, CodedError> {
        let gamut = parse_gamut(gamut)?;
        let backend = Canvas2d::new(photo.transport(), &canvas, gamut)?;
        Ok(Self::of(Box::new(backend), photo.geometry().light))
    }
}

impl Backend for Canvas2d {
    fn name(&self) -> &'static str {
        "cpu"
    }

    fn kernel(&self) -> String {
        cpu::KERNEL.into()
    }

    fn gamut(&self) -> Gamut {
        self.gamut
    }

    fn render(&mut self, frame: &Frame<'_>) -> Result<(), BackendError> {
        self.relighter.set_detail(frame.detail);
        // It takes no pictures, so there is one.
        if let Some(light) = frame.light {
            self.relighter.relight(light, &SequentialExecutor);
        }
        let rows = 0..self.picture.extent.height;
        let pixels = &mut self.picture.pixels;
        self.relighter
            .show(&frame.display, rows, pixels, &SequentialExecutor);
        let bytes = Clamped(self.picture.pixels.as_flattened());
        let Extent { width, height } = self.picture.extent;
        let image = Image::new(bytes, width, height, &self.settings).map_err(lost)?;
        let put = self.context.put_image_data(image.unchecked_ref(), 0.0, 0.0);
        put.map_err(lost)
    }
}

fn lost(thrown: JsValue) -> BackendError {
    BackendError::Lost(format!("{thrown:?}"))
}
