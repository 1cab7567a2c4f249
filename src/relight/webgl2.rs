//! Relighting by WebGL2, through web-sys: a tenth of the size of wgpu's own WebGL.

use js_sys::{Float32Array, Int16Array, Int32Array, Object};
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{
    HtmlCanvasElement, WebGl2RenderingContext as Gl, WebGlBuffer, WebGlContextAttributes,
    WebGlFramebuffer, WebGlProgram, WebGlShader, WebGlTexture, WebglLoseContext,
};

use super::backend::{Backend, BackendError};
use super::texture_layout::{Fold, Params, Pass, TextureLayout, TextureLimits};
use super::{Light, Tint};
use crate::transport::{Extent, Geometry, Transport};

const API: &str = "WebGL2";
const VERTEX_SHADER: &str = include_str!("shaders/relight.vert.glsl");
const SEE_SHADER: &str = include_str!("shaders/see.frag.glsl");
const RELIGHT_SHADER: &str = include_str!("shaders/relight.frag.glsl");

/// Texture units, which are naga's binding numbers too.
const COEFFICIENTS: u32 = 0;
const SEEN: u32 = 1;
const CODES: u32 = 2;
const PIXELS: u32 = 3;
const STEPS: u32 = 4;
const LIGHT: u32 = 5;

/// Points that uniforms are bound to, and naga's names for them.
const UNIFORMS: [(u32, &str); 3] = [
    (PARAMS, "Params_block_0Fragment"),
    (BASIS, "Basis_block_1Fragment"),
    (CHANNEL, "Channel_block_2Fragment"),
];
const PARAMS: u32 = 0;
const BASIS: u32 = 1;
const CHANNEL: u32 = 2;

/// A transport in a WebGL2 context.
pub struct WebGl2 {
    layout: TextureLayout,
    context: Context,
    /// The light as the context takes it, kept to spare an allocation a frame.
    light: Float32Array,
    /// The light that is seen.
    lit: Option<Light>,
    kernel: String,
}

/// The context and all that was made in it.
struct Context {
    gl: Gl,
    programs: Vec<WebGlProgram>,
    textures: Vec<WebGlTexture>,
    buffers: Vec<WebGlBuffer>,
    /// Each of two layers of what is seen.
    framebuffers: Vec<WebGlFramebuffer>,
    see: Option<WebGlProgram>,
    relight: Option<WebGlProgram>,
    params: Option<WebGlBuffer>,
    /// Pair by pair.
    basis: Vec<WebGlBuffer>,
    channels: Vec<WebGlBuffer>,
}

impl WebGl2 {
    /// Uploads a transport. Whatever comes of it, no other kind of back end can have the canvas
    /// afterwards: a context has to be made to learn what the device can do.
    pub fn new(transport: &Transport, canvas: &HtmlCanvasElement) -> Result<Self, BackendError> {
        let Geometry { camera, light, .. } = transport.geometry;
        let mut context = open(canvas, camera)?;
        let layout = TextureLayout::new(transport, limits(&context.gl))?;
        let kernel = describe(&context.gl);
        if layout.pairs() > 0 {
            // To draw into floats.
            let extension = context.gl.get_extension("EXT_color_buffer_float");
            if !matches!(extension, Ok(Some(_))) {
                return Err(BackendError::Device {
                    api: API,
                    reason: "it does not draw into floating-point textures".into(),
                });
            }
            context.see = Some(context.link(SEE_SHADER, &[LIGHT])?);
        }
        let all = [COEFFICIENTS, SEEN, CODES, PIXELS, STEPS, LIGHT];
        context.relight = Some(context.link(RELIGHT_SHADER, &all)?);
        context.upload(&layout, transport)?;
        context.gl.disable(Gl::DITHER); // on unless switched off
        context.check()?;
        Ok(Self {
            layout,
            light: Float32Array::new_with_length(4 * light.area() as u32),
            lit: None,
            kernel,
            context,
        })
    }
}

impl Backend for WebGl2 {
    fn name(&self) -> &'static str {
        "webgl2"
    }

    fn kernel(&self) -> String {
        self.kernel.clone()
    }

    fn render(&mut self, light: &Light, exposure: f32) -> Result<(), BackendError> {
        let context = &self.context;
        let gl = &context.gl;
        let tint = light.tint();
        let params = self.layout.params(tint, exposure);
        gl.bind_buffer(Gl::UNIFORM_BUFFER, context.params.as_ref());
        let bytes = bytemuck::bytes_of(&params);
        gl.buffer_sub_data_with_i32_and_u8_array(Gl::UNIFORM_BUFFER, 0, bytes);
        // What is seen depends on the light alone.
        if self.lit.as_ref() != Some(light) {
            self.light.copy_from(light.elements().as_flattened());
            gl.active_texture(Gl::TEXTURE0 + LIGHT);
            self.lit = None;
            write_rows(gl, self.layout.light(), FLOATS, &self.light)?;
            context.see(&self.layout, tint);
            self.lit = Some(light.clone());
        }
        let Extent { width, height } = self.layout.pixels();
        gl.viewport(0, 0, width as i32, height as i32);
        gl.use_program(context.relight.as_ref());
        gl.draw_arrays(Gl::TRIANGLES, 0, 3);
        // To a lost context all calls are no-ops. Asking for other errors would wait for the
        // device, and a draw that was good once has none.
        if gl.is_context_lost() {
            return Err(BackendError::Lost("the browser took its context".into()));
        }
        Ok(())
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

/// A context whose pixels are the picture's bytes and nothing else: opaque, no antialiasing.
fn open(canvas: &HtmlCanvasElement, camera: Extent) -> Result<Context, BackendError> {
    let canvas_error = |reason: &str| BackendError::Canvas {
        api: API,
        reason: reason.into(),
    };
    canvas.set_width(camera.width);
    canvas.set_height(camera.height);
    let attributes = WebGlContextAttributes::new();
    attributes.set_alpha(false);
    attributes.set_antialias(false);
    attributes.set_depth(false);
    attributes.set_stencil(false);
    // The browser may swap the picture out rather than copy it. It stays on display, and can be
    // read in the task that drew it; WebGPU canvases keep no longer either.
    attributes.set_preserve_drawing_buffer(false);
    let gl = canvas
        .get_context_with_context_options("webgl2", &attributes)
        .map_err(|e| canvas_error(&format!("{e:?}")))?
        .and_then(|context| context.dyn_into::<Gl>().ok())
        .ok_or_else(|| canvas_error("WebGL2 is missing, switched off or out of contexts"))?;
    // From here on, whatever goes wrong gives the context back.
    let context = Context {
        gl,
        programs: Vec::new(),
        textures: Vec::new(),
        buffers: Vec::new(),
        framebuffers: Vec::new(),
        see: None,
        relight: None,
        params: None,
        basis: Vec::new(),
        channels: Vec::new(),
    };
    let gl = &context.gl;
    if gl.is_context_lost() {
        return Err(canvas_error("the context is lost"));
    }
    let given = (gl.drawing_buffer_width(), gl.drawing_buffer_height());
    if given == (camera.width as i32, camera.height as i32) {
        Ok(context)
    } else {
        Err(canvas_error(&format!(
            "{camera} pixels were asked for, {}x{} given",
            given.0, given.1
        )))
    }
}

fn limits(gl: &Gl) -> TextureLimits {
    let limit = |name| {
        let value = gl.get_parameter(name).ok().and_then(|v| v.as_f64());
        value.unwrap_or(0.0) as u32
    };
    TextureLimits {
        side: limit(Gl::MAX_TEXTURE_SIZE),
        layers: limit(Gl::MAX_ARRAY_TEXTURE_LAYERS),
    }
}

/// The renderer's name. Chromium and Safari tell it only under the name of an extension, which
/// Firefox deprecates.
fn describe(gl: &Gl) -> String {
    const UNMASKED_RENDERER: u32 = 0x9246;
    let name = |parameter| gl.get_parameter(parameter).ok()?.as_string();
    match name(Gl::RENDERER) {
        Some(masked) if masked.starts_with("WebKit") => gl
            .get_extension("WEBGL_debug_renderer_info")
            .ok()
            .flatten()
            .and_then(|_| name(UNMASKED_RENDERER))
            .unwrap_or(masked),
        renderer => renderer.unwrap_or_else(|| API.into()),
    }
}

impl Context {
    /// A program that reads these textures.
    fn link(&mut self, fragment: &str, textures: &[u32]) -> Result<WebGlProgram, BackendError> {
        let gl = &self.gl;
        let shaders = [
            compile(gl, Gl::VERTEX_SHADER, "vertex shader", VERTEX_SHADER)?,
            compile(gl, Gl::FRAGMENT_SHADER, "fragment shader", fragment)?,
        ];
        let refused = |log| BackendError::Shader {
            stage: "program",
            log,
        };
        let program = gl.create_program().ok_or_else(|| self.lost())?;
        self.programs.push(program.clone());
        for shader in &shaders {
            gl.attach_shader(&program, shader);
        }
        gl.link_program(&program);
        for shader in &shaders {
            gl.delete_shader(Some(shader)); // the program keeps it
        }
        if gl.get_program_parameter(&program, Gl::LINK_STATUS) != true {
            return Err(refused(
                gl.get_program_info_log(&program).unwrap_or_default(),
            ));
        }
        gl.use_program(Some(&program));
        for unit in textures {
            let name = format!("_group_0_binding_{unit}_fs");
            let location = gl.get_uniform_location(&program, &name);
            let location = location.ok_or_else(|| refused(format!("{name} is missing")))?;
            gl.uniform1i(Some(&location), *unit as i32);
        }
        for (point, name) in UNIFORMS {
            let block = gl.get_uniform_block_index(&program, name);
            if block != Gl::INVALID_INDEX {
                gl.uniform_block_binding(&program, block, point);
            }
        }
        Ok(program)
    }

    /// Uniforms with these bytes.
    fn add_uniforms(&mut self, bytes: &[u8]) -> Result<WebGlBuffer, BackendError> {
        let gl = &self.gl;
        let buffer = gl.create_buffer().ok_or_else(|| self.lost())?;
        gl.bind_buffer(Gl::UNIFORM_BUFFER, Some(&buffer));
        gl.buffer_data_with_u8_array(Gl::UNIFORM_BUFFER, bytes, Gl::DYNAMIC_DRAW);
        self.buffers.push(buffer.clone());
        Ok(buffer)
    }

    /// Fills what is seen of the light by the basis.
    fn see(&self, layout: &TextureLayout, tint: Tint) {
        let gl = &self.gl;
        let Extent { width, height } = layout.seen().extent;
        gl.viewport(0, 0, width as i32, height as i32);
        gl.use_program(self.see.as_ref());
        // It is not read while it is written.
        gl.active_texture(Gl::TEXTURE0 + SEEN);
        gl.bind_texture(Gl::TEXTURE_2D_ARRAY, None);
        for Pass {
            channel,
            pair,
            layer,
        } in layout.passes(tint)
        {
            gl.bind_framebuffer(Gl::FRAMEBUFFER, self.framebuffers.get(layer as usize / 2));
            gl.bind_buffer_base(Gl::UNIFORM_BUFFER, BASIS, self.basis.get(pair));
            gl.bind_buffer_base(Gl::UNIFORM_BUFFER, CHANNEL, self.channels.get(channel));
            gl.draw_arrays(Gl::TRIANGLES, 0, 3);
        }
        gl.bind_framebuffer(Gl::FRAMEBUFFER, None);
        gl.bind_texture(Gl::TEXTURE_2D_ARRAY, self.textures.get(SEEN as usize));
    }

    /// Framebuffers of each two layers of what is seen.
    fn add_framebuffers(&mut self, layers: u32) -> Result<(), BackendError> {
        for first in (0..layers).step_by(2) {
            let gl = &self.gl;
            let framebuffer = gl.create_framebuffer().ok_or_else(|| self.lost())?;
            gl.bind_framebuffer(Gl::FRAMEBUFFER, Some(&framebuffer));
            let targets = [Gl::COLOR_ATTACHMENT0, Gl::COLOR_ATTACHMENT1];
            for (layer, target) in (first as i32..).zip(targets) {
                let seen = self.textures.get(SEEN as usize);
                gl.framebuffer_texture_layer(Gl::FRAMEBUFFER, target, seen, 0, layer);
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

    /// Fills all textures but the light's, which every frame brings anew.
    fn upload(
        &mut self,
        layout: &TextureLayout,
        transport: &Transport,
    ) -> Result<(), BackendError> {
        let Fold { extent, layers } = layout.coefficients();
        self.add_texture(COEFFICIENTS, CODES16, extent, Some(layers))?;
        let Fold { extent, layers } = layout.seen();
        self.add_texture(SEEN, FLOATS, extent, Some(layers))?;
        let codes = layout.codes();
        self.add_texture(CODES, CODES16, codes.extent, Some(codes.layers))?;
        // Out of memory shows here, before the long work.
        self.check()?;
        if layout.pairs() > 0 {
            self.add_framebuffers(layers)?;
        }
        for pair in layout.basis(&transport.basis) {
            let basis = self.add_uniforms(bytemuck::cast_slice(&pair))?;
            self.basis.push(basis);
        }
        for channel in TextureLayout::CHANNELS {
            let channel = self.add_uniforms(bytemuck::cast_slice(&channel))?;
            self.channels.push(channel);
        }
        let params = self.add_uniforms(&[0; size_of::<Params>()])?;
        self.gl
            .bind_buffer_base(Gl::UNIFORM_BUFFER, PARAMS, Some(&params));
        self.params = Some(params);
        let write_codes = |gl: &Gl, [x, y, z]: [u32; 3], extent: Extent, texels: &Int16Array| {
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
        self.gl.active_texture(Gl::TEXTURE0 + COEFFICIENTS);
        layout.for_each_coefficient_block(transport, |block| {
            let texels = Int16Array::from(block.texels.as_flattened());
            let [x, y] = block.at;
            write_codes(&self.gl, [x, y, block.layer], block.extent, &texels)
        })?;
        self.gl.active_texture(Gl::TEXTURE0 + CODES);
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
            write_codes(&self.gl, [0, block.row, block.layer], rows, &staging)
        })?;
        self.add_texture(PIXELS, INTEGERS, layout.pixels(), None)?;
        let pixels = layout.pixel_texels(transport);
        let pixels = Int32Array::from(pixels.as_flattened());
        write_rows(&self.gl, layout.pixels(), INTEGERS, &pixels)?;
        self.add_texture(STEPS, FLOATS, layout.steps(), None)?;
        let steps = layout.step_texels(transport);
        let steps = Float32Array::from(steps.as_flattened());
        write_rows(&self.gl, layout.steps(), FLOATS, &steps)?;
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
        let gl = &self.gl;
        let (width, height) = (extent.width as i32, extent.height as i32);
        let texture = gl.create_texture().ok_or_else(|| self.lost())?;
        let target = match layers {
            Some(_) => Gl::TEXTURE_2D_ARRAY,
            None => Gl::TEXTURE_2D,
        };
        gl.active_texture(Gl::TEXTURE0 + unit);
        gl.bind_texture(target, Some(&texture));
        match layers {
            Some(n) => gl.tex_storage_3d(target, 1, texel.internal, width, height, n as i32),
            None => gl.tex_storage_2d(target, 1, texel.internal, width, height),
        }
        // Neither integers nor 32-bit floats can be filtered.
        for filter in [Gl::TEXTURE_MIN_FILTER, Gl::TEXTURE_MAG_FILTER] {
            gl.tex_parameteri(target, filter, Gl::NEAREST as i32);
        }
        self.textures.push(texture);
        Ok(())
    }

    /// The first error since the last call. Waits for the device.
    fn check(&self) -> Result<(), BackendError> {
        match self.gl.get_error() {
            Gl::NO_ERROR => Ok(()),
            Gl::OUT_OF_MEMORY => Err(BackendError::Upload("it is out of memory".into())),
            Gl::CONTEXT_LOST_WEBGL => Err(self.lost()),
            code => Err(BackendError::Upload(format!("WebGL error {code:#06x}"))),
        }
    }

    fn lost(&self) -> BackendError {
        BackendError::Device {
            api: API,
            reason: "the context was lost while it was being set up".into(),
        }
    }
}

impl Drop for Context {
    /// Frees the device's memory now; the garbage collector does not know how much there is.
    fn drop(&mut self) {
        for texture in &self.textures {
            self.gl.delete_texture(Some(texture));
        }
        for framebuffer in &self.framebuffers {
            self.gl.delete_framebuffer(Some(framebuffer));
        }
        for buffer in &self.buffers {
            self.gl.delete_buffer(Some(buffer));
        }
        for program in &self.programs {
            self.gl.delete_program(Some(program));
        }
        // The context itself too: browsers allow a page only so many, sixteen in Chromium, and at the
        // next one take away the oldest, which may be another photograph's.
        if let Ok(Some(extension)) = self.gl.get_extension("WEBGL_lose_context") {
            // Browsers do not show this interface's constructor, so there is no type to check.
            extension
                .unchecked_into::<WebglLoseContext>()
                .lose_context();
        }
    }
}

fn compile(
    gl: &Gl,
    kind: u32,
    stage: &'static str,
    source: &str,
) -> Result<WebGlShader, BackendError> {
    let refused = |log| BackendError::Shader { stage, log };
    let shader = gl
        .create_shader(kind)
        .ok_or_else(|| refused("the context was lost".into()))?;
    gl.shader_source(&shader, source);
    gl.compile_shader(&shader);
    if gl.get_shader_parameter(&shader, Gl::COMPILE_STATUS) == true {
        Ok(shader)
    } else {
        Err(refused(gl.get_shader_info_log(&shader).unwrap_or_default()))
    }
}

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
