//! A photograph in a context.

use std::rc::Rc;

use js_sys::{Float32Array, Int16Array, Int32Array, Object};
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{WebGl2RenderingContext as Gl, WebGlBuffer, WebGlFramebuffer, WebGlTexture};

use super::context::{
    API, BASIS, CHANNEL, CODES, COEFFICIENTS, Context, LIGHT, ORIGINS, PARAMS, SEEN, STEPS, TILES,
    lost, texture, uniforms,
};
use super::pictures::Pictures;
use crate::relight::Tint;
use crate::relight::backend::{BackendError, Frame, Lit};
use crate::relight::texture_layout::{Fold, Params, Pass, TextureLayout};
use crate::transport::{Extent, Transport};

/// A transport in a context's memory, and what is seen of the last light.
#[derive(Debug)]
pub(super) struct Scene {
    pub context: Rc<Context>,
    layout: TextureLayout,
    memory: Memory,
    /// The light as the context takes it, kept to spare an allocation a frame.
    light: Float32Array,
    /// The light that is there.
    lit: Lit,
    pictures: Option<Pictures>,
}

/// What was made in a context, and is deleted there.
#[derive(Debug)]
struct Memory {
    gl: Gl,
    /// Each with the unit it is bound to, and how.
    textures: Vec<(u32, u32, WebGlTexture)>,
    /// Each of two layers of what is seen.
    framebuffers: Vec<WebGlFramebuffer>,
    params: Option<WebGlBuffer>,
    /// Pair by pair.
    basis: Vec<WebGlBuffer>,
    channels: Vec<WebGlBuffer>,
}

impl Scene {
    /// Uploads a transport, or fails without leaving anything in the context.
    pub fn new(context: Rc<Context>, transport: &Transport) -> Result<Self, BackendError> {
        let layout = TextureLayout::new(transport, context.limits)?;
        context.forget_errors();
        if layout.pairs() > 0 && context.floats.is_none() {
            return Err(BackendError::Device {
                api: API,
                reason: "it does not draw into floating-point textures".into(),
            });
        }
        let mut memory = Memory {
            gl: context.gl.clone(),
            textures: Vec::new(),
            framebuffers: Vec::new(),
            params: None,
            basis: Vec::new(),
            channels: Vec::new(),
        };
        memory.upload(&context, &layout, transport)?;
        context.check()?;
        Ok(Self {
            light: Float32Array::new_with_length(4 * layout.light().area() as u32),
            lit: Lit::default(),
            pictures: None,
            context,
            layout,
            memory,
        })
    }

    /// The picture's extent.
    pub fn extent(&self) -> Extent {
        self.layout.origins()
    }

    /// Draws the picture where the context's viewport is.
    pub fn draw(
        &mut self,
        frame: &Frame<'_>,
        aim: impl FnOnce() -> Result<(), BackendError>,
    ) -> Result<(), BackendError> {
        let Frame {
            light,
            display,
            detail,
        } = frame;
        let (gl, memory) = (&self.context.gl, &self.memory);
        let check = || match gl.is_context_lost() {
            true => Err(BackendError::Lost("the browser took its context".into())),
            false => Ok(()),
        };
        check()?;
        memory.bind();
        let detail = *detail;
        if let Some(light) = light.filter(|light| !self.lit.is(light)) {
            self.lit = Lit::default();
            self.light.copy_from(light.elements().as_flattened());
            gl.active_texture(Gl::TEXTURE0 + LIGHT);
            write_rows(gl, self.layout.light(), FLOATS, &self.light)?;
            self.lit = Lit::of(light);
            self.pictures = None;
        }
        let tint = self.lit.tint();
        let params = self.layout.params(tint, display, detail);
        gl.bind_buffer(Gl::UNIFORM_BUFFER, memory.params.as_ref());
        let bytes = bytemuck::bytes_of(&params);
        gl.buffer_sub_data_with_i32_and_u8_array(Gl::UNIFORM_BUFFER, 0, bytes);
        if self.lit.look(detail) {
            memory.see(&self.context, &self.layout, tint, detail);
        }
        aim()?;
        gl.use_program(Some(&self.context.relight));
        gl.draw_arrays(Gl::TRIANGLES, 0, 3);
        // To a lost context all calls are no-ops. Asking for other errors would wait for the
        // device, and a draw that was good once has none.
        check()
    }

    /// Takes a picture as the light; `false` where the device cannot. Nothing changes where the browser
    /// refuses it.
    pub fn take_picture(&mut self, picture: &JsValue, extent: Extent) -> Result<bool, JsValue> {
        let context = &*self.context;
        let (Some(floats), true) = (
            &context.floats,
            self.layout.takes(extent, context.limits) && !is_bitmap(picture),
        ) else {
            return Ok(false);
        };
        let fits = |pictures: &Pictures| pictures.extent() == extent;
        let pictures = match self.pictures.take().filter(fits) {
            Some(pictures) => pictures,
            None => {
                let light = self.memory.texture(LIGHT);
                context.forget_errors();
                let made = Pictures::new(&context.gl, extent, light, self.layout.light());
                // There is no room, but for what is there already.
                let (Some(made), Ok(())) = (made, context.check()) else {
                    return Ok(false);
                };
                made
            }
        };
        let pictures = self.pictures.insert(pictures);
        pictures.copy(picture)?;
        pictures.shrink(&floats.shrink);
        self.lit = Lit::default();
        Ok(true)
    }
}

/// Unlike other pictures, bitmaps are taken as they are, and nothing tells whether their colours have been
/// multiplied by alpha.
fn is_bitmap(picture: &JsValue) -> bool {
    picture.is_instance_of::<web_sys::ImageBitmap>()
}

impl Memory {
    /// Fills all textures but the light's, which every frame brings anew.
    fn upload(
        &mut self,
        context: &Context,
        layout: &TextureLayout,
        transport: &Transport,
    ) -> Result<(), BackendError> {
        let gl = self.gl.clone();
        let Fold { extent, layers } = layout.coefficients();
        self.add_texture(COEFFICIENTS, CODES16, extent, Some(layers))?;
        let Fold { extent, layers } = layout.seen();
        self.add_texture(SEEN, FLOATS, extent, Some(layers))?;
        let codes = layout.codes();
        self.add_texture(CODES, CODES16, codes.extent, Some(codes.layers))?;
        // Out of memory shows here, before the long work.
        context.check()?;
        if layout.pairs() > 0 {
            self.add_framebuffers(layers)?;
        }
        for pair in layout.basis(&transport.basis) {
            let basis = uniforms(&gl, bytemuck::cast_slice(&pair)).ok_or_else(lost)?;
            self.basis.push(basis);
        }
        for channel in TextureLayout::CHANNELS {
            let channel = uniforms(&gl, bytemuck::cast_slice(&channel)).ok_or_else(lost)?;
            self.channels.push(channel);
        }
        self.params = Some(uniforms(&gl, &[0; size_of::<Params>()]).ok_or_else(lost)?);
        let write_codes = |[x, y, z]: [u32; 3], extent: Extent, texels: &Int16Array| {
            gl.tex_sub_image_3d_with_opt_array_buffer_view(
                Gl::TEXTURE_2D_ARRAY,
                0,
                x as i32,
                y as i32,
                z as i32,
                extent.width as i32,
                extent.height as i32,
                1,
                CODES16.format,
                CODES16.component,
                Some(texels),
            )
            .map_err(upload_error)
        };
        gl.active_texture(Gl::TEXTURE0 + COEFFICIENTS);
        layout.for_each_coefficient_block(transport, |block| {
            let texels = Int16Array::from(block.texels.as_flattened());
            let [x, y] = block.at;
            write_codes([x, y, block.layer], block.extent, &texels)
        })?;
        gl.active_texture(Gl::TEXTURE0 + CODES);
        let mut staging = Int16Array::new_with_length(0);
        layout.for_each_code_block(transport, |block| {
            let components = block.texels.as_flattened();
            if staging.length() as usize != components.len() {
                staging = Int16Array::new_with_length(components.len() as u32);
            }
            staging.copy_from(components);
            let rows = Extent {
                width: codes.extent.width,
                height: block.rows,
            };
            write_codes([0, block.row, block.layer], rows, &staging)
        })?;
        self.add_texture(ORIGINS, PAIRS16, layout.origins(), None)?;
        let origins = layout.origin_texels();
        let origins = Int16Array::from(origins.as_flattened());
        write_rows(&gl, layout.origins(), PAIRS16, &origins)?;
        self.add_texture(STEPS, FLOATS, layout.steps(), None)?;
        let steps = layout.step_texels(transport);
        let steps = Float32Array::from(steps.as_flattened());
        write_rows(&gl, layout.steps(), FLOATS, &steps)?;
        self.add_texture(TILES, INTEGERS, layout.tiles(), None)?;
        let tiles = layout.tile_texels(transport);
        let tiles = Int32Array::from(tiles.as_flattened());
        write_rows(&gl, layout.tiles(), INTEGERS, &tiles)?;
        self.add_texture(LIGHT, FLOATS, layout.light(), None)
    }

    /// Makes a texture, an array if it has `layers`, and leaves it bound to its unit.
    fn add_texture(
        &mut self,
        unit: u32,
        texel: Texel,
        extent: Extent,
        layers: Option<u32>,
    ) -> Result<(), BackendError> {
        let (target, texture) =
            texture(&self.gl, unit, texel.internal, extent, layers).ok_or_else(lost)?;
        self.textures.push((unit, target, texture));
        Ok(())
    }

    /// Framebuffers of each two layers of what is seen.
    fn add_framebuffers(&mut self, layers: u32) -> Result<(), BackendError> {
        for first in (0..layers).step_by(2) {
            let gl = &self.gl;
            let framebuffer = gl.create_framebuffer().ok_or_else(lost)?;
            gl.bind_framebuffer(Gl::FRAMEBUFFER, Some(&framebuffer));
            let targets = [Gl::COLOR_ATTACHMENT0, Gl::COLOR_ATTACHMENT1];
            for (layer, target) in (first as i32..).zip(targets) {
                gl.framebuffer_texture_layer(Gl::FRAMEBUFFER, target, self.texture(SEEN), 0, layer);
            }
            gl.draw_buffers(&js_sys::Array::from_iter(targets.map(JsValue::from)));
            let status = gl.check_framebuffer_status(Gl::FRAMEBUFFER);
            gl.bind_framebuffer(Gl::FRAMEBUFFER, None);
            self.framebuffers.push(framebuffer);
            if status != Gl::FRAMEBUFFER_COMPLETE {
                let reason = format!("a framebuffer of floats is incomplete: {status:#06x}");
                return Err(BackendError::Upload(reason));
            }
        }
        Ok(())
    }

    /// Takes the place of what another photograph has bound.
    fn bind(&self) {
        let gl = &self.gl;
        for (unit, target, texture) in &self.textures {
            gl.active_texture(Gl::TEXTURE0 + unit);
            gl.bind_texture(*target, Some(texture));
        }
        gl.bind_buffer_base(Gl::UNIFORM_BUFFER, PARAMS, self.params.as_ref());
    }

    /// The texture that is bound to a unit.
    fn texture(&self, of: u32) -> Option<&WebGlTexture> {
        let mut textures = self.textures.iter();
        let (_, _, texture) = textures.find(|(unit, ..)| *unit == of)?;
        Some(texture)
    }

    /// Fills what is seen of the light by the basis.
    fn see(&self, context: &Context, layout: &TextureLayout, tint: Tint, detail: f32) {
        let gl = &self.gl;
        let Extent { width, height } = layout.seen().extent;
        gl.viewport(0, 0, width as i32, height as i32);
        gl.use_program(context.floats.as_ref().map(|floats| &floats.see));
        // It is not read while it is written.
        gl.active_texture(Gl::TEXTURE0 + SEEN);
        gl.bind_texture(Gl::TEXTURE_2D_ARRAY, None);
        for Pass {
            channel,
            pair,
            layer,
        } in layout.passes(tint, detail)
        {
            gl.bind_framebuffer(Gl::FRAMEBUFFER, self.framebuffers.get(layer as usize / 2));
            gl.bind_buffer_base(Gl::UNIFORM_BUFFER, BASIS, self.basis.get(pair));
            gl.bind_buffer_base(Gl::UNIFORM_BUFFER, CHANNEL, self.channels.get(channel));
            gl.draw_arrays(Gl::TRIANGLES, 0, 3);
        }
        gl.bind_framebuffer(Gl::FRAMEBUFFER, None);
        gl.bind_texture(Gl::TEXTURE_2D_ARRAY, self.texture(SEEN));
    }
}

impl Drop for Memory {
    /// Frees the device's memory now; the garbage collector does not know how much there is.
    fn drop(&mut self) {
        for (_, _, texture) in &self.textures {
            self.gl.delete_texture(Some(texture));
        }
        for framebuffer in &self.framebuffers {
            self.gl.delete_framebuffer(Some(framebuffer));
        }
        for buffer in self.basis.iter().chain(&self.channels).chain(&self.params) {
            self.gl.delete_buffer(Some(buffer));
        }
    }
}

/// How texels look to WebGL.
#[derive(Clone, Copy)]
struct Texel {
    internal: u32,
    format: u32,
    component: u32,
}

const CODES16: Texel = Texel {
    internal: Gl::RGBA16I,
    format: Gl::RGBA_INTEGER,
    component: Gl::SHORT,
};
const PAIRS16: Texel = Texel {
    internal: Gl::RG16I,
    format: Gl::RG_INTEGER,
    component: Gl::SHORT,
};
const INTEGERS: Texel = Texel {
    internal: Gl::RGBA32I,
    format: Gl::RGBA_INTEGER,
    component: Gl::INT,
};
const FLOATS: Texel = Texel {
    internal: Gl::RGBA32F,
    format: Gl::RGBA,
    component: Gl::FLOAT,
};

/// Fills the 2D texture bound to the active unit.
fn write_rows(gl: &Gl, extent: Extent, texel: Texel, data: &Object) -> Result<(), BackendError> {
    gl.tex_sub_image_2d_with_i32_and_i32_and_u32_and_type_and_opt_array_buffer_view(
        Gl::TEXTURE_2D,
        0,
        0,
        0,
        extent.width as i32,
        extent.height as i32,
        texel.format,
        texel.component,
        Some(data),
    )
    .map_err(upload_error)
}

fn upload_error(thrown: JsValue) -> BackendError {
    BackendError::Upload(format!("{thrown:?}"))
}
