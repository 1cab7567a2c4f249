//! Textures, framebuffers and uniform buffers of a context, freed when they are dropped: the garbage collector does
//! not know how much of the device's memory they hold.

use js_sys::{Array, Object};
use wasm_bindgen::JsValue;
use web_sys::{WebGl2RenderingContext as Gl, WebGlBuffer, WebGlFramebuffer, WebGlTexture};

use super::context::context_lost;
use crate::relight::backend::BackendError;
use crate::transport::Extent;

/// A texel's format: WebGL's internal format, format and type.
#[derive(Clone, Copy)]
pub(super) struct TexelFormat {
    internal: u32,
    format: u32,
    component: u32,
}

const fn texel_format(internal: u32, format: u32, component: u32) -> TexelFormat {
    TexelFormat {
        internal,
        format,
        component,
    }
}

pub(super) const RGBA16_SINT: TexelFormat = texel_format(Gl::RGBA16I, Gl::RGBA_INTEGER, Gl::SHORT);
pub(super) const RG16_SINT: TexelFormat = texel_format(Gl::RG16I, Gl::RG_INTEGER, Gl::SHORT);
pub(super) const RGBA32_SINT: TexelFormat = texel_format(Gl::RGBA32I, Gl::RGBA_INTEGER, Gl::INT);
pub(super) const RGBA32_FLOAT: TexelFormat = texel_format(Gl::RGBA32F, Gl::RGBA, Gl::FLOAT);
pub(super) const RGBA8_UNORM: TexelFormat = texel_format(Gl::RGBA8, Gl::RGBA, Gl::UNSIGNED_BYTE);

/// A texture, or a texture array.
#[derive(Debug)]
pub(super) struct Texture {
    gl: Gl,
    texture: WebGlTexture,
    unit: u32,
    target: u32,
}

impl Texture {
    /// Creates a texture, an array if it has `layers`, and binds it to a unit.
    pub fn new(
        gl: &Gl,
        unit: u32,
        format: TexelFormat,
        extent: Extent,
        layers: Option<u32>,
    ) -> Result<Self, BackendError> {
        let (width, height) = (extent.width as i32, extent.height as i32);
        let target = match layers {
            Some(_) => Gl::TEXTURE_2D_ARRAY,
            None => Gl::TEXTURE_2D,
        };
        let created = Self {
            gl: gl.clone(),
            texture: gl.create_texture().ok_or_else(context_lost)?,
            unit,
            target,
        };
        created.bind();
        match layers {
            Some(n) => gl.tex_storage_3d(target, 1, format.internal, width, height, n as i32),
            None => gl.tex_storage_2d(target, 1, format.internal, width, height),
        }
        // Neither integers nor 32-bit floats can be filtered.
        for filter in [Gl::TEXTURE_MIN_FILTER, Gl::TEXTURE_MAG_FILTER] {
            gl.tex_parameteri(target, filter, Gl::NEAREST as i32);
        }
        Ok(created)
    }

    /// Binds it to its unit.
    pub fn bind(&self) {
        self.bind_as(Some(&self.texture));
    }

    /// Leaves its unit without a texture.
    pub fn unbind(&self) {
        self.bind_as(None);
    }

    fn bind_as(&self, texture: Option<&WebGlTexture>) {
        self.gl.active_texture(Gl::TEXTURE0 + self.unit);
        self.gl.bind_texture(self.target, texture);
    }

    /// Writes all texels of a 2D texture.
    pub fn write(
        &self,
        format: TexelFormat,
        extent: Extent,
        texels: &Object,
    ) -> Result<(), BackendError> {
        self.bind();
        self.gl
            .tex_sub_image_2d_with_i32_and_i32_and_u32_and_type_and_opt_array_buffer_view(
                self.target,
                0,
                0,
                0,
                extent.width as i32,
                extent.height as i32,
                format.format,
                format.component,
                Some(texels),
            )
            .map_err(upload_error)
    }

    /// Writes a rectangle of one layer of a bound array, from that column, row and layer on.
    pub fn write_layer(
        &self,
        format: TexelFormat,
        [x, y, z]: [u32; 3],
        extent: Extent,
        texels: &Object,
    ) -> Result<(), BackendError> {
        self.gl
            .tex_sub_image_3d_with_opt_array_buffer_view(
                self.target,
                0,
                x as i32,
                y as i32,
                z as i32,
                extent.width as i32,
                extent.height as i32,
                1,
                format.format,
                format.component,
                Some(texels),
            )
            .map_err(upload_error)
    }
}

impl Drop for Texture {
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
    pub fn of_texture(gl: &Gl, texture: &Texture) -> Result<Self, BackendError> {
        let created = Self::new(gl)?;
        let (target, attachment) = (Gl::FRAMEBUFFER, Gl::COLOR_ATTACHMENT0);
        gl.framebuffer_texture_2d(
            target,
            attachment,
            texture.target,
            Some(&texture.texture),
            0,
        );
        gl.bind_framebuffer(Gl::FRAMEBUFFER, None);
        Ok(created)
    }

    /// Draws into two layers of a texture array.
    pub fn of_two_layers(gl: &Gl, array: &Texture, first: u32) -> Result<Self, BackendError> {
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

    /// Makes it the target of draws.
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

/// A uniform buffer.
#[derive(Debug)]
pub(super) struct UniformBuffer {
    gl: Gl,
    buffer: WebGlBuffer,
}

impl UniformBuffer {
    /// Creates a buffer with these bytes.
    pub fn new(gl: &Gl, bytes: &[u8]) -> Result<Self, BackendError> {
        let created = Self {
            gl: gl.clone(),
            buffer: gl.create_buffer().ok_or_else(context_lost)?,
        };
        gl.bind_buffer(Gl::UNIFORM_BUFFER, Some(&created.buffer));
        gl.buffer_data_with_u8_array(Gl::UNIFORM_BUFFER, bytes, Gl::DYNAMIC_DRAW);
        Ok(created)
    }

    /// Replaces its bytes.
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

impl Drop for UniformBuffer {
    fn drop(&mut self) {
        self.gl.delete_buffer(Some(&self.buffer));
    }
}

fn upload_error(thrown: JsValue) -> BackendError {
    BackendError::Upload(format!("{thrown:?}"))
}
