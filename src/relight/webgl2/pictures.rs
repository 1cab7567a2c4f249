//! Pictures that the browser has, as light: decoded, then averaged by area, without leaving the device.

use js_sys::{Function, Reflect};
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{
    WebGl2RenderingContext as Gl, WebGlBuffer, WebGlFramebuffer, WebGlProgram, WebGlTexture,
};

use super::context::{PICTURE, SHRINK, texture, uniforms};
use crate::transport::Extent;

/// Room for pictures of one size, on their way to one light.
#[derive(Debug)]
pub(super) struct Pictures {
    gl: Gl,
    extent: Extent,
    picture: WebGlTexture,
    /// Means of columns.
    narrow: WebGlTexture,
    steps: [Step; 2],
}

/// From one texture to the next.
#[derive(Debug)]
struct Step {
    into: WebGlFramebuffer,
    size: Extent,
    /// How many columns, or rows, there are to be.
    to: WebGlBuffer,
}

impl Pictures {
    /// For pictures of this extent, and a light's texture. `None` where the context has no room.
    pub fn new(
        gl: &Gl,
        extent: Extent,
        light: Option<&WebGlTexture>,
        display: Extent,
    ) -> Option<Self> {
        let columns = Extent {
            width: display.width,
            height: extent.height,
        };
        let room = |internal, extent| {
            let (_, texture) = texture(gl, PICTURE, internal, extent, None)?;
            Some(texture)
        };
        let narrow = room(Gl::RGBA32F, columns)?;
        Some(Self {
            gl: gl.clone(),
            extent,
            picture: room(Gl::RGBA8, extent)?,
            steps: [
                Step::new(gl, Some(&narrow), columns, columns.width)?,
                Step::new(gl, light, display, display.height)?,
            ],
            narrow,
        })
    }

    /// The pictures' extent.
    pub fn extent(&self) -> Extent {
        self.extent
    }

    /// Takes a picture.
    pub fn copy(&self, picture: &JsValue) -> Result<(), JsValue> {
        let gl = &self.gl;
        self.bind(&self.picture);
        // By name, as there is one for each kind of picture. Colours come apart from alpha, in sRGB.
        let upload: Function = Reflect::get(gl, &"texSubImage2D".into())?.dyn_into()?;
        let numbers = [Gl::TEXTURE_2D, 0, 0, 0, Gl::RGBA, Gl::UNSIGNED_BYTE];
        let arguments = numbers.iter().map(|number| JsValue::from(*number));
        upload.apply(gl, &arguments.chain([picture.clone()]).collect())?;
        Ok(())
    }

    /// Makes it the light.
    pub fn shrink(&self, programs: &[WebGlProgram; 2]) {
        let gl = &self.gl;
        for ((step, program), from) in self
            .steps
            .iter()
            .zip(programs)
            .zip([&self.picture, &self.narrow])
        {
            gl.use_program(Some(program));
            self.bind(from);
            gl.bind_buffer_base(Gl::UNIFORM_BUFFER, SHRINK, Some(&step.to));
            gl.bind_framebuffer(Gl::FRAMEBUFFER, Some(&step.into));
            gl.viewport(0, 0, step.size.width as i32, step.size.height as i32);
            gl.draw_arrays(Gl::TRIANGLES, 0, 3);
        }
        gl.bind_framebuffer(Gl::FRAMEBUFFER, None);
    }

    fn bind(&self, texture: &WebGlTexture) {
        self.gl.active_texture(Gl::TEXTURE0 + PICTURE);
        self.gl.bind_texture(Gl::TEXTURE_2D, Some(texture));
    }
}

impl Step {
    fn new(gl: &Gl, into: Option<&WebGlTexture>, size: Extent, to: u32) -> Option<Self> {
        let framebuffer = gl.create_framebuffer()?;
        gl.bind_framebuffer(Gl::FRAMEBUFFER, Some(&framebuffer));
        let (target, attachment) = (Gl::FRAMEBUFFER, Gl::COLOR_ATTACHMENT0);
        gl.framebuffer_texture_2d(target, attachment, Gl::TEXTURE_2D, into, 0);
        gl.bind_framebuffer(Gl::FRAMEBUFFER, None);
        let to = uniforms(gl, bytemuck::cast_slice(&[to as i32, 0, 0, 0]))?;
        Some(Self {
            into: framebuffer,
            size,
            to,
        })
    }
}

impl Drop for Pictures {
    fn drop(&mut self) {
        for texture in [&self.picture, &self.narrow] {
            self.gl.delete_texture(Some(texture));
        }
        for Step { into, to, .. } in &self.steps {
            self.gl.delete_framebuffer(Some(into));
            self.gl.delete_buffer(Some(to));
        }
    }
}
