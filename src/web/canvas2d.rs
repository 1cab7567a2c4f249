//! The CPU backend of a page: relights on this thread and writes the pixels into a canvas.

use std::sync::Arc;

use js_sys::{Object, Reflect};
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::{Clamped, JsCast, JsValue};
use web_sys::{CanvasRenderingContext2d, HtmlCanvasElement};

use super::drawing::output_transform::parse_gamut;
use super::{CanvasRelighter, CodedError, Photo};
use crate::job_executor::SequentialExecutor;
use crate::relight::backend::{Backend, BackendError, FrameRequest};
use crate::relight::canvas2d_context::{CanvasMemoryLocation, open_2d};
use crate::relight::cpu::{self, EncodedRelighter};
use crate::relight::{Gamut, Rgba8Picture};
use crate::transport::{Extent, Transport};

#[wasm_bindgen]
extern "C" {
    /// `ImageData`, whose constructor in web-sys lacks the settings.
    #[wasm_bindgen(js_name = ImageData, extends = web_sys::ImageData)]
    type ImageDataWithSettings;
    #[wasm_bindgen(constructor, catch, js_class = "ImageData")]
    fn new(
        data: Clamped<&[u8]>,
        width: u32,
        height: u32,
        settings: &Object,
    ) -> Result<ImageDataWithSettings, JsValue>;
}

/// Relights on the CPU and writes the pixels into a canvas.
#[derive(Debug)]
struct Canvas2dBackend {
    relighter: EncodedRelighter,
    picture: Rgba8Picture,
    context: CanvasRenderingContext2d,
    gamut: Gamut,
    /// Settings of the `ImageData`: its colour space.
    settings: Object,
}

impl Canvas2dBackend {
    fn new(
        transport: Arc<Transport>,
        canvas: &HtmlCanvasElement,
        gamut: Gamut,
    ) -> Result<Self, BackendError> {
        let camera = transport.geometry.camera;
        let (context, gamut) = open_2d(canvas, camera, gamut, CanvasMemoryLocation::MainMemory)?;
        let settings = Object::new();
        let space = gamut.color_space().into();
        Reflect::set(&settings, &"colorSpace".into(), &space).map_err(lost)?;
        Ok(Self {
            relighter: EncodedRelighter::new(transport),
            picture: Rgba8Picture::filled(camera, [0, 0, 0, 255]),
            context,
            gamut,
            settings,
        })
    }
}

#[wasm_bindgen]
impl CanvasRelighter {
    /// A relighter on this thread. Each `CanvasRelighter` needs a new canvas, also after a failure.
    ///
    /// # Errors
    /// Code `backend-unavailable`.
    #[wasm_bindgen(constructor)]
    pub fn new(
        photo: &Photo,
        canvas: HtmlCanvasElement,
        #[wasm_bindgen(unchecked_param_type = "\"srgb\" | \"display-p3\"")] gamut: &str,
    ) -> Result<CanvasRelighter, CodedError> {
        let gamut = parse_gamut(gamut)?;
        let backend = Canvas2dBackend::new(photo.transport(), &canvas, gamut)?;
        Ok(Self {
            backend: Box::new(backend),
            kernel: cpu::KERNEL.into(),
            light: photo.geometry().light,
        })
    }
}

impl Backend for Canvas2dBackend {
    fn gamut(&self) -> Gamut {
        self.gamut
    }

    fn render(&mut self, frame: &FrameRequest<'_>) -> Result<(), BackendError> {
        self.relighter.set_quality(frame.quality);
        self.relighter.set_output(&frame.output);
        // This backend takes no light images, so frames have a light.
        if let Some(light) = frame.light {
            self.relighter.relight(light, &SequentialExecutor);
        }
        let rows = 0..self.picture.extent.height;
        self.relighter.copy_rows(rows, &mut self.picture.pixels);
        let bytes = Clamped(self.picture.pixels.as_flattened());
        let Extent { width, height } = self.picture.extent;
        let image =
            ImageDataWithSettings::new(bytes, width, height, &self.settings).map_err(lost)?;
        let put = self.context.put_image_data(image.unchecked_ref(), 0.0, 0.0);
        put.map_err(lost)
    }
}

fn lost(thrown: JsValue) -> BackendError {
    BackendError::Lost(format!("{thrown:?}"))
}
