//! Textures, framebuffers and uniform buffers of a context, freed when they are dropped: the garbage collector does
//! not know how much of the device's memory they hold.

use js_sys::{Array, Float32Array, Int16Array, Int32Array, Object, Uint8Array};
use wasm_bindgen::JsValue;
use web_sys::{WebGl2RenderingContext as Gl, WebGlBuffer, WebGlFramebuffer, WebGlTexture};

use super::context::context_lost;
use crate::relight::backend::BackendError;
use crate::relight::texture_layout::{TextureDescriptor, TextureFormat};
use crate::transport::Extent;

/// Internal format, format and type of a texel.
fn texel_format(format: TextureFormat) -> [u32; 3] {
    match format {
        TextureFormat::Rg16Sint => [Gl::RG16I, Gl::RG_INTEGER, Gl::SHORT],
        TextureFormat::Rgba16Sint => [Gl::RGBA16I, Gl::RGBA_INTEGER, Gl::SHORT],
        TextureFormat::Rg32Sint => [Gl::RG32I, Gl::RG_INTEGER, Gl::INT],
        TextureFormat::Rgba32Float => [Gl::RGBA32F, Gl::RGBA, Gl::FLOAT],
        // Only canvases of WebGPU have the other order.
        TextureFormat::Rgba8Unorm | TextureFormat::Bgra8Unorm => {
            [Gl::RGBA8, Gl::RGBA, Gl::UNSIGNED_BYTE]
        }
    }
}

/// Memory for texels on their way to the context, kept to save allocations.
#[derive(Debug, Default)]
pub(super) struct Staging(Uint8Array);

impl Staging {
    /// Copies texels. Returns an array of the elements that WebGL requires for their type.
    fn copy(&mut self, component: u32, texels: &[u8]) -> Object {
        if self.0.length() as usize != texels.len() {
            self.0 = Uint8Array::new_with_length(texels.len() as u32);
        }
        self.0.copy_from(texels);
        let buffer = self.0.buffer();
        match component {
            Gl::SHORT => Int16Array::new(&buffer).into(),
            Gl::INT => Int32Array::new(&buffer).into(),
            Gl::FLOAT => Float32Array::new(&buffer).into(),
            _ => self.0.clone().into(),
        }
    }
}

/// A texture, or a texture array.
#[derive(Debug)]
pub(super) struct GlTexture {
    gl: Gl,
    texture: WebGlTexture,
    unit: u32,
    target: u32,
    descriptor: TextureDescriptor,
}

impl GlTexture {
    /// Creates a texture and binds it to a unit.
    pub fn new(gl: &Gl, unit: u32, descriptor: TextureDescriptor) -> Result<Self, BackendError> {
        let [internal, ..] = texel_format(descriptor.format);
        let Extent { width, height } = descriptor.extent;
        let (width, height) = (width as i32, height as i32);
        let target = match descriptor.layers {
            Some(_) => Gl::TEXTURE_2D_ARRAY,
            None => Gl::TEXTURE_2D,
        };
        let created = Self {
            gl: gl.clone(),
            texture: gl.create_texture().ok_or_else(context_lost)?,
            unit,
            target,
            descriptor,
        };
        created.bind();
        match created.descriptor.layers {
            Some(n) => gl.tex_storage_3d(target, 1, internal, width, height, n as i32),
            None => gl.tex_storage_2d(target, 1, internal, width, height),
        }
        // Neither integers nor 32-bit floats can be filtered.
        for filter in [Gl::TEXTURE_MIN_FILTER, Gl::TEXTURE_MAG_FILTER] {
            gl.tex_parameteri(target, filter, Gl::NEAREST as i32);
        }
        Ok(created)
    }

    pub fn extent(&self) -> Extent {
        self.descriptor.extent
    }

    pub fn layers(&self) -> u32 {
        self.descriptor.layers.unwrap_or(1)
    }

    pub fn bind(&self) {
        self.bind_as(Some(&self.texture));
    }

    pub fn unbind(&self) {
        self.bind_as(None);
    }

    fn bind_as(&self, texture: Option<&WebGlTexture>) {
        self.gl.active_texture(Gl::TEXTURE0 + self.unit);
        self.gl.bind_texture(self.target, texture);
    }

    pub fn set_viewport(&self) {
        let Extent { width, height } = self.extent();
        self.gl.viewport(0, 0, width as i32, height as i32);
    }

    /// Writes a rectangle of one layer, from that column, row and layer on.
    pub fn write(
        &self,
        origin: [u32; 3],
        extent: Extent,
        texels: &[u8],
        staging: &mut Staging,
    ) -> Result<(), BackendError> {
        let [_, format, component] = texel_format(self.descriptor.format);
        let [x, y, z] = origin.map(|at| at as i32);
        let [width, height] = [extent.width, extent.height].map(|side| side as i32);
        let texels = &staging.copy(component, texels);
        self.bind();
        let written = match self.descriptor.layers {
            Some(_) => self.gl.tex_sub_image_3d_with_opt_array_buffer_view(
                self.target,
                0,
                x,
                y,
                z,
                width,
                height,
                1,
                format,
                component,
                Some(texels),
            ),
            None => self
                .gl
                .tex_sub_image_2d_with_i32_and_i32_and_u32_and_type_and_opt_array_buffer_view(
                    self.target,
                    0,
                    x,
                    y,
                    width,
                    height,
                    format,
                    component,
                    Some(texels),
                ),
        };
        written.map_err(|thrown| BackendError::Upload(format!("{thrown:?}")))
    }
}

impl Drop for GlTexture {
    fn drop(&mut self) {
        self.gl.delete_texture(Some(&self.texture));
    }
}

/// A framebuffer over whole textures or layers.
#[derive(Debug)]
pub(super) struct Framebuffer {
    gl: Gl,
    framebuffer: WebGlFramebuffer,
}

impl Framebuffer {
    /// Draws into a 2D texture.
    pub fn of_texture(gl: &Gl, texture: &GlTexture) -> Result<Self, BackendError> {
        let created = Self::new(gl)?;
        let (target, attachment) = (Gl::FRAMEBUFFER, Gl::COLOR_ATTACHMENT0);
        let attached = Some(&texture.texture);
        gl.framebuffer_texture_2d(target, attachment, Gl::TEXTURE_2D, attached, 0);
        gl.bind_framebuffer(Gl::FRAMEBUFFER, None);
        Ok(created)
    }

    /// Draws into two layers of a texture array.
    pub fn of_two_layers(gl: &Gl, array: &GlTexture, first: u32) -> Result<Self, BackendError> {
        let created = Self::new(gl)?;
        let targets = [Gl::COLOR_ATTACHMENT0, Gl::COLOR_ATTACHMENT1];
        for (layer, target) in (first as i32..).zip(targets) {
            gl.framebuffer_texture_layer(Gl::FRAMEBUFFER, target, Some(&array.texture), 0, layer);
        }
        gl.draw_buffers(&Array::from_iter(targets.map(JsValue::from)));
        let status = gl.check_framebuffer_status(Gl::FRAMEBUFFER);
        gl.bind_framebuffer(Gl::FRAMEBUFFER, None);
        match status {
            Gl::FRAMEBUFFER_COMPLETE => Ok(created),
            _ => Err(BackendError::Upload(format!(
                "a framebuffer of floats is incomplete: {status:#06x}"
            ))),
        }
    }

    fn new(gl: &Gl) -> Result<Self, BackendError> {
        let created = Self {
            gl: gl.clone(),
            framebuffer: gl.create_framebuffer().ok_or_else(context_lost)?,
        };
        created.bind();
        Ok(created)
    }

    pub fn bind(&self) {
        let framebuffer = Some(&self.framebuffer);
        self.gl.bind_framebuffer(Gl::FRAMEBUFFER, framebuffer);
    }
}

impl Drop for Framebuffer {
    fn drop(&mut self) {
        self.gl.delete_framebuffer(Some(&self.framebuffer));
    }
}

#[derive(Debug)]
pub(super) struct GlUniformBuffer {
    gl: Gl,
    buffer: WebGlBuffer,
}

impl GlUniformBuffer {
    pub fn new(gl: &Gl, bytes: &[u8]) -> Result<Self, BackendError> {
        let created = Self {
            gl: gl.clone(),
            buffer: gl.create_buffer().ok_or_else(context_lost)?,
        };
        gl.bind_buffer(Gl::UNIFORM_BUFFER, Some(&created.buffer));
        gl.buffer_data_with_u8_array(Gl::UNIFORM_BUFFER, bytes, Gl::DYNAMIC_DRAW);
        Ok(created)
    }

    pub fn write(&self, bytes: &[u8]) {
        let gl = &self.gl;
        gl.bind_buffer(Gl::UNIFORM_BUFFER, Some(&self.buffer));
        gl.buffer_sub_data_with_i32_and_u8_array(Gl::UNIFORM_BUFFER, 0, bytes);
    }

    /// Binds it to a binding of the programs.
    pub fn bind(&self, binding: u32) {
        let buffer = Some(&self.buffer);
        self.gl
            .bind_buffer_base(Gl::UNIFORM_BUFFER, binding, buffer);
    }
}

impl Drop for GlUniformBuffer {
    fn drop(&mut self) {
        self.gl.delete_buffer(Some(&self.buffer));
    }
}
