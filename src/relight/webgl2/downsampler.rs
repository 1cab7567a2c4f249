//! Light images on the device: decoded, then resampled by area along columns and along rows, without leaving it.

use js_sys::{Function, Reflect};
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{WebGl2RenderingContext as Gl, WebGlProgram};

use super::context::{DOWNSAMPLING, LIGHT_IMAGE};
use super::resources::{Framebuffer, RGBA8_UNORM, RGBA32_FLOAT, Texture, UniformBuffer};
use crate::relight::backend::BackendError;
use crate::transport::Extent;

/// Textures for light images of one extent.
#[derive(Debug)]
pub(super) struct Downsampler {
    gl: Gl,
    extent: Extent,
    image: Texture,
    /// The image resampled along columns.
    columns: Texture,
    /// Along columns, then along rows.
    passes: [DownsamplePass; 2],
}

#[derive(Debug)]
struct DownsamplePass {
    target: Framebuffer,
    target_extent: Extent,
    uniforms: UniformBuffer,
}

impl Downsampler {
    /// From light images of that extent to the light's texture.
    ///
    /// # Errors
    /// [`BackendError::Device`] if the context is lost.
    pub fn new(
        gl: &Gl,
        extent: Extent,
        light: &Texture,
        light_extent: Extent,
    ) -> Result<Self, BackendError> {
        let columns_extent = Extent {
            width: light_extent.width,
            height: extent.height,
        };
        let texture = |format, extent| Texture::new(gl, LIGHT_IMAGE, format, extent, None);
        let columns = texture(RGBA32_FLOAT, columns_extent)?;
        // `DownsampleUniforms` of the WGSL.
        let pass = |target, target_extent, uniforms: [u32; 4]| {
            Ok::<_, BackendError>(DownsamplePass {
                target: Framebuffer::of_texture(gl, target)?,
                target_extent,
                uniforms: UniformBuffer::new(gl, bytemuck::cast_slice(&uniforms))?,
            })
        };
        Ok(Self {
            gl: gl.clone(),
            extent,
            image: texture(RGBA8_UNORM, extent)?,
            passes: [
                pass(&columns, columns_extent, [1, 0, light_extent.width, 0])?,
                pass(light, light_extent, [0, 1, light_extent.height, 0])?,
            ],
            columns,
        })
    }

    /// Extent of the light images.
    pub fn extent(&self) -> Extent {
        self.extent
    }

    /// Uploads a light image.
    ///
    /// # Errors
    /// What the browser throws, for instance for pictures of another origin.
    pub fn upload(&self, image: &JsValue) -> Result<(), JsValue> {
        self.image.bind();
        // Called by name, as web-sys has a method for each kind of picture. By default, pictures are in sRGB with
        // straight alpha.
        let upload: Function = Reflect::get(&self.gl, &"texSubImage2D".into())?.dyn_into()?;
        let numbers = [Gl::TEXTURE_2D, 0, 0, 0, Gl::RGBA, Gl::UNSIGNED_BYTE];
        let arguments = numbers.iter().map(|number| JsValue::from(*number));
        upload.apply(&self.gl, &arguments.chain([image.clone()]).collect())?;
        Ok(())
    }

    /// Writes the last light image into the light's texture.
    pub fn downsample(&self, program: &WebGlProgram) {
        let gl = &self.gl;
        gl.use_program(Some(program));
        for (pass, source) in self.passes.iter().zip([&self.image, &self.columns]) {
            source.bind();
            pass.uniforms.bind(DOWNSAMPLING);
            pass.target.bind();
            let Extent { width, height } = pass.target_extent;
            gl.viewport(0, 0, width as i32, height as i32);
            gl.draw_arrays(Gl::TRIANGLES, 0, 3);
        }
        gl.bind_framebuffer(Gl::FRAMEBUFFER, None);
    }
}
