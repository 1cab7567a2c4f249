//! The one context, on a canvas that nobody sees, and the programs that run on it.

use std::cell::Cell;

use js_sys::Reflect;
use wasm_bindgen::JsCast;
use web_sys::{
    HtmlCanvasElement, WebGl2RenderingContext as Gl, WebGlBuffer, WebGlContextAttributes,
    WebGlProgram, WebGlShader, WebGlTexture, WebglLoseContext,
};

use crate::relight::Gamut;
use crate::relight::backend::BackendError;
use crate::relight::texture_layout::TextureLimits;
use crate::transport::Extent;

/// What errors call the interface.
pub(super) const API: &str = "WebGL2";
const VERTEX_SHADER: &str = include_str!("../shaders/relight.vert.glsl");
const SEE_SHADER: &str = include_str!("../shaders/see.frag.glsl");
const ACROSS_SHADER: &str = include_str!("../shaders/across.frag.glsl");
const DOWN_SHADER: &str = include_str!("../shaders/down.frag.glsl");
const RELIGHT_SHADER: &str = include_str!("../shaders/relight.frag.glsl");

/// Texture units, which are naga's binding numbers too.
pub(super) const COEFFICIENTS: u32 = 0;
pub(super) const SEEN: u32 = 1;
pub(super) const CODES: u32 = 2;
pub(super) const ORIGINS: u32 = 3;
pub(super) const STEPS: u32 = 4;
pub(super) const LIGHT: u32 = 5;
pub(super) const TILES: u32 = 6;
pub(super) const PICTURE: u32 = 10;

/// Points that uniforms are bound to, and naga's names for them.
const UNIFORMS: [(u32, &str); 4] = [
    (PARAMS, "Params_block_0Fragment"),
    (BASIS, "Basis_block_1Fragment"),
    (CHANNEL, "Channel_block_2Fragment"),
    (SHRINK, "Shrink_block_0Fragment"),
];
pub(super) const PARAMS: u32 = 0;
pub(super) const BASIS: u32 = 1;
pub(super) const CHANNEL: u32 = 2;
pub(super) const SHRINK: u32 = 3;

/// A context that any number of photographs share. Browsers allow a page only so many, sixteen in
/// Chromium, and at the next one take away the oldest.
#[derive(Debug)]
pub struct Context {
    pub(super) gl: Gl,
    pub(super) canvas: HtmlCanvasElement,
    /// None where the device does not draw into floating-point textures.
    pub(super) floats: Option<FloatPrograms>,
    pub(super) relight: WebGlProgram,
    pub(super) limits: TextureLimits,
    kernel: String,
    /// What its pixels are taken for.
    gamut: Cell<Gamut>,
}

/// What draws into floating-point textures.
#[derive(Debug)]
pub(super) struct FloatPrograms {
    pub see: WebGlProgram,
    /// A picture to the light's columns, then to its rows.
    pub shrink: [WebGlProgram; 2],
}

impl FloatPrograms {
    fn link(gl: &Gl) -> Result<Self, BackendError> {
        Ok(Self {
            see: link(gl, SEE_SHADER, &[LIGHT])?,
            shrink: [
                link(gl, ACROSS_SHADER, &[PICTURE])?,
                link(gl, DOWN_SHADER, &[PICTURE])?,
            ],
        })
    }
}

impl Context {
    /// Makes a context on a canvas that is for it alone: opaque, without antialiasing.
    pub fn new(canvas: HtmlCanvasElement) -> Result<Self, BackendError> {
        let attributes = WebGlContextAttributes::new();
        attributes.set_alpha(false);
        attributes.set_antialias(false);
        attributes.set_depth(false);
        attributes.set_stencil(false);
        // Pictures are taken out in the task that draws them.
        attributes.set_preserve_drawing_buffer(false);
        let gl = canvas
            .get_context_with_context_options("webgl2", &attributes)
            .map_err(|e| canvas_error(&format!("{e:?}")))?
            .and_then(|context| context.dyn_into::<Gl>().ok())
            .ok_or_else(|| canvas_error("WebGL2 is missing, switched off or out of contexts"))?;
        let made = Self::in_context(&gl, &canvas);
        // Whatever went wrong, the context is given back.
        made.inspect_err(|_| give_back(&gl))
    }

    fn in_context(gl: &Gl, canvas: &HtmlCanvasElement) -> Result<Self, BackendError> {
        if gl.is_context_lost() {
            return Err(canvas_error("the context is lost"));
        }
        // To draw into floats.
        let draws_floats = matches!(gl.get_extension("EXT_color_buffer_float"), Ok(Some(_)));
        let floats = draws_floats.then(|| FloatPrograms::link(gl));
        let all = [COEFFICIENTS, SEEN, CODES, ORIGINS, STEPS, LIGHT, TILES];
        let relight = link(gl, RELIGHT_SHADER, &all)?;
        gl.disable(Gl::DITHER); // on unless switched off
        Ok(Self {
            floats: floats.transpose()?,
            relight,
            limits: limits(gl),
            kernel: describe(gl),
            gamut: Cell::new(Gamut::Srgb),
            gl: gl.clone(),
            canvas: canvas.clone(),
        })
    }

    /// The renderer, by name.
    pub fn kernel(&self) -> &str {
        &self.kernel
    }

    /// Whether pixels can be of that gamut.
    pub(super) fn shows(&self, gamut: Gamut) -> bool {
        gamut == Gamut::Srgb || Reflect::has(&self.gl, &COLOR_SPACE.into()).unwrap_or(false)
    }

    /// Gets ready to draw a picture, from the canvas's upper left corner on.
    pub(super) fn aim(&self, extent: Extent, gamut: Gamut) -> Result<(), BackendError> {
        let gl = &self.gl;
        let before = self.size();
        // Large enough for photographs of several sizes, which take turns on it, if there can be so much;
        // browsers give less where it is too much.
        let [room, own] = [
            Extent {
                width: before.width.max(extent.width),
                height: before.height.max(extent.height),
            },
            extent,
        ];
        if !self.resize(room) && !self.resize(own) {
            self.resize(before);
            return Err(BackendError::Upload(format!(
                "its {extent} pixels are more than the browser draws by {API} at once"
            )));
        }
        if self.gamut.replace(gamut) != gamut {
            let space = gamut.color_space().into();
            // Where it cannot be set, `shows` has said so.
            let _ = Reflect::set(gl, &COLOR_SPACE.into(), &space);
            // Chromium tells what copies the canvas of it only once it has new memory.
            self.canvas.set_width(self.canvas.width());
        }
        let [width, height] = [extent.width, extent.height].map(|side| side as i32);
        gl.viewport(0, gl.drawing_buffer_height() - height, width, height);
        Ok(())
    }

    fn size(&self) -> Extent {
        Extent {
            width: self.canvas.width(),
            height: self.canvas.height(),
        }
    }

    /// Makes the canvas that large; whether what is drawn into is.
    fn resize(&self, extent: Extent) -> bool {
        let Extent { width, height } = self.size();
        if extent.width != width {
            self.canvas.set_width(extent.width);
        }
        if extent.height != height {
            self.canvas.set_height(extent.height);
        }
        let given = [
            self.gl.drawing_buffer_width(),
            self.gl.drawing_buffer_height(),
        ];
        given == [extent.width as i32, extent.height as i32]
    }

    /// Forgets errors of what other photographs did.
    pub(super) fn forget_errors(&self) {
        while !matches!(self.gl.get_error(), Gl::NO_ERROR | Gl::CONTEXT_LOST_WEBGL) {}
    }

    /// The first error since the last call. Waits for the device.
    pub(super) fn check(&self) -> Result<(), BackendError> {
        match self.gl.get_error() {
            Gl::NO_ERROR => Ok(()),
            Gl::OUT_OF_MEMORY => Err(BackendError::Upload("it is out of memory".into())),
            Gl::CONTEXT_LOST_WEBGL => Err(lost()),
            code => Err(BackendError::Upload(format!("WebGL error {code:#06x}"))),
        }
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        give_back(&self.gl);
    }
}

const COLOR_SPACE: &str = "drawingBufferColorSpace";

/// Frees a context and all that was made in it; the garbage collector does not know how much that is.
fn give_back(gl: &Gl) {
    if let Ok(Some(extension)) = gl.get_extension("WEBGL_lose_context") {
        // Browsers do not show this interface's constructor, so there is no type to check.
        extension
            .unchecked_into::<WebglLoseContext>()
            .lose_context();
    }
}

/// Makes a texture, an array if it has `layers`, and leaves it bound to a unit, as the target that it gives too.
pub(super) fn texture(
    gl: &Gl,
    unit: u32,
    internal: u32,
    extent: Extent,
    layers: Option<u32>,
) -> Option<(u32, WebGlTexture)> {
    let (width, height) = (extent.width as i32, extent.height as i32);
    let texture = gl.create_texture()?;
    let target = match layers {
        Some(_) => Gl::TEXTURE_2D_ARRAY,
        None => Gl::TEXTURE_2D,
    };
    gl.active_texture(Gl::TEXTURE0 + unit);
    gl.bind_texture(target, Some(&texture));
    match layers {
        Some(n) => gl.tex_storage_3d(target, 1, internal, width, height, n as i32),
        None => gl.tex_storage_2d(target, 1, internal, width, height),
    }
    // Neither integers nor 32-bit floats can be filtered.
    for filter in [Gl::TEXTURE_MIN_FILTER, Gl::TEXTURE_MAG_FILTER] {
        gl.tex_parameteri(target, filter, Gl::NEAREST as i32);
    }
    Some((target, texture))
}

/// Uniforms with these bytes.
pub(super) fn uniforms(gl: &Gl, bytes: &[u8]) -> Option<WebGlBuffer> {
    let buffer = gl.create_buffer()?;
    gl.bind_buffer(Gl::UNIFORM_BUFFER, Some(&buffer));
    gl.buffer_data_with_u8_array(Gl::UNIFORM_BUFFER, bytes, Gl::DYNAMIC_DRAW);
    Some(buffer)
}

pub(super) fn lost() -> BackendError {
    BackendError::Device {
        api: API,
        reason: "the context was lost while it was being set up".into(),
    }
}

fn canvas_error(reason: &str) -> BackendError {
    BackendError::Canvas {
        api: API,
        reason: reason.into(),
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

/// A program that reads these textures.
fn link(gl: &Gl, fragment: &str, textures: &[u32]) -> Result<WebGlProgram, BackendError> {
    let shaders = [
        compile(gl, Gl::VERTEX_SHADER, "vertex shader", VERTEX_SHADER)?,
        compile(gl, Gl::FRAGMENT_SHADER, "fragment shader", fragment)?,
    ];
    let refused = |log| BackendError::Shader {
        stage: "program",
        log,
    };
    let program = gl.create_program().ok_or_else(lost)?;
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
