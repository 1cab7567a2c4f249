//! Light images on the device: decoded, then resampled by area along columns and along rows, without leaving it.

use js_sys::{Function, Reflect};
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{WebGl2RenderingContext as Gl, WebGlProgram};

use super::context::{DOWNSAMPLING, LIGHT_IMAGE};
use super::resources::{Framebuffer, GlTexture, GlUniformBuffer};
use crate::relight::backend::BackendError;
use crate::relight::texture_layout::{TextureDescriptor, TextureFormat};
use crate::transport::Extent;

/// Textures for light images of one extent.
#[derive(Debug)]
pub(super) struct GlDownsampler {
    gl: Gl,
    image: GlTexture,
    /// The image resampled along columns.
    columns: GlTexture,
    /// Along columns, then along rows.
    passes: [(Framebuffer, GlUniformBuffer); 2],
}

impl GlDownsampler {
    /// From light images of that extent to the light's texture.
    ///
    /// # Errors
    /// [`BackendError::Device`] if the context is lost.
    pub fn new(gl: &Gl, extent: Extent, light: &GlTexture) -> Result<Self, BackendError> {
        use TextureFormat::{Rgba8Unorm, Rgba32Float};
        let create = |label, format, extent| {
            let descriptor = TextureDescriptor::flat(label, format, extent);
            GlTexture::new(gl, LIGHT_IMAGE, descriptor)
        };
        let Extent { width, height } = light.extent();
        let columns_extent = Extent { width, ..extent };
        let columns = create("light image's columns", Rgba32Float, columns_extent)?;
        // `DownsampleUniforms` of the WGSL.
        let pass = |target, uniforms: [u32; 4]| {
            let framebuffer = Framebuffer::of_texture(gl, target)?;
            let uniforms = GlUniformBuffer::new(gl, bytemuck::cast_slice(&uniforms))?;
            Ok::<_, BackendError>((framebuffer, uniforms))
        };
        Ok(Self {
            gl: gl.clone(),
            image: create("light image", Rgba8Unorm, extent)?,
            passes: [
                pass(&columns, [1, 0, width, 0])?,
                pass(light, [0, 1, height, 0])?,
            ],
            columns,
        })
    }

    pub fn extent(&self) -> Extent {
        self.image.extent()
    }

    /// Uploads a light image and writes it into `light`, the texture of [`new`](Self::new).
    ///
    /// # Errors
    /// What the browser throws, for instance for pictures of another origin.
    pub fn downsample(
        &self,
        program: &WebGlProgram,
        image: &JsValue,
        light: &GlTexture,
    ) -> Result<(), JsValue> {
        let gl = &self.gl;
        self.image.bind();
        // Called by name, as web-sys has a method for each kind of picture. By default, pictures are in sRGB with
        // straight alpha.
        let upload: Function = Reflect::get(gl, &"texSubImage2D".into())?.dyn_into()?;
        let numbers = [Gl::TEXTURE_2D, 0, 0, 0, Gl::RGBA, Gl::UNSIGNED_BYTE];
        let arguments = numbers.iter().map(|number| JsValue::from(*number));
        upload.apply(gl, &arguments.chain([image.clone()]).collect())?;
        gl.use_program(Some(program));
        let textures = [(&self.image, &self.columns), (&self.columns, light)];
        for ((framebuffer, uniforms), (source, target)) in self.passes.iter().zip(textures) {
            source.bind();
            uniforms.bind(DOWNSAMPLING);
            framebuffer.bind();
            target.set_viewport();
            gl.draw_arrays(Gl::TRIANGLES, 0, 3);
        }
        gl.bind_framebuffer(Gl::FRAMEBUFFER, None);
        Ok(())
    }
}
