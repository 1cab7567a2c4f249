//! Relighting by WebGL2, through web-sys.

mod context;
mod pictures;
mod scene;

use std::rc::Rc;

use wasm_bindgen::JsValue;
use web_sys::{CanvasRenderingContext2d, HtmlCanvasElement};

pub use context::Context;

use super::Gamut;
use super::backend::{Backend, BackendError, Frame};
use super::canvas2d::{Keep, open_2d};
use crate::transport::{Extent, Transport};
use scene::Scene;

/// A photograph on a canvas, drawn in a context that others use too.
#[derive(Debug)]
pub struct WebGl2 {
    scene: Scene,
    out: CanvasRenderingContext2d,
    gamut: Gamut,
}

impl WebGl2 {
    /// Uploads a transport.
    pub fn new(
        context: Rc<Context>,
        transport: &Transport,
        canvas: &HtmlCanvasElement,
        gamut: Gamut,
    ) -> Result<Self, BackendError> {
        let scene = Scene::new(context, transport)?;
        let gamut = match scene.context.shows(gamut) {
            true => gamut,
            false => Gamut::Srgb,
        };
        let (out, gamut) = open_2d(canvas, scene.extent(), gamut, Keep::Anywhere)?;
        scene.context.aim(scene.extent(), gamut)?;
        Ok(Self { scene, out, gamut })
    }
}

impl Backend for WebGl2 {
    fn name(&self) -> &'static str {
        "webgl2"
    }

    fn kernel(&self) -> String {
        self.scene.context.kernel().into()
    }

    fn gamut(&self) -> Gamut {
        self.gamut
    }

    fn take_picture(&mut self, picture: &JsValue, extent: Extent) -> Result<bool, JsValue> {
        self.scene.take_picture(picture, extent)
    }

    fn render(&mut self, frame: &Frame<'_>) -> Result<(), BackendError> {
        let context = self.scene.context.clone();
        let (extent, gamut) = (self.scene.extent(), self.gamut);
        self.scene.draw(frame, || context.aim(extent, gamut))?;
        let Extent { width, height } = extent;
        let [width, height] = [width, height].map(f64::from);
        let canvas = &context.canvas;
        self.out
            .draw_image_with_html_canvas_element_and_sw_and_sh_and_dx_and_dy_and_dw_and_dh(
                canvas, 0.0, 0.0, width, height, 0.0, 0.0, width, height,
            )
            .map_err(|e| BackendError::Lost(format!("its picture could not be copied: {e:?}")))
    }
}
