//! The WebGL2 context with the programs that run on it.

use std::cell::Cell;

use js_sys::Reflect;
use wasm_bindgen::JsCast;
use web_sys::{
    HtmlCanvasElement, WebGl2RenderingContext as Gl, WebGlContextAttributes, WebGlProgram,
    WebglLoseContext,
};

use crate::relight::Gamut;
use crate::relight::backend::BackendError;
use crate::relight::texture_layout::{TEXTURES, TextureLimits, binding};
use crate::transport::Extent;

/// The interface's name in errors.
pub(super) const API: &str = "WebGL2";
const VERTEX_SHADER: &str = include_str!("../shaders/fullscreen.vert.glsl");
const CORRELATE_SHADER: &str = include_str!("../shaders/correlate.frag.glsl");
const DOWNSAMPLE_SHADER: &str = include_str!("../shaders/downsample.frag.glsl");
const RELIGHT_SHADER: &str = include_str!("../shaders/relight.frag.glsl");

/// The texture unit of light images. Texture units are the binding numbers of the WGSL, from which naga names samplers.
pub(super) const LIGHT_IMAGE: u32 = 10;

/// naga's names for the uniform blocks, by uniform buffer binding.
const UNIFORM_BLOCKS: [&str; 4] = [
    "FrameUniforms_block_0Fragment",
    "BasisFunctionUniforms_block_1Fragment",
    "ChannelUniforms_block_2Fragment",
    "DownsampleUniforms_block_0Fragment",
];
pub(super) const FRAME: u32 = 0;
pub(super) const BASIS: u32 = 1;
pub(super) const CHANNEL: u32 = 2;
pub(super) const DOWNSAMPLING: u32 = 3;

/// A context that any number of photographs share. Browsers limit the contexts of a page, in Chromium to sixteen; a
/// further one makes them drop the oldest.
#[derive(Debug)]
pub struct GlContext {
    pub(super) gl: Gl,
    pub(super) canvas: HtmlCanvasElement,
    /// `None` where the device cannot draw into floating-point textures.
    pub(super) float_programs: Option<FloatPrograms>,
    pub(super) relight: WebGlProgram,
    pub(super) limits: TextureLimits,
    /// The renderer's name.
    pub kernel: String,
    /// The gamut of the pixels.
    gamut: Cell<Gamut>,
}

/// The programs that draw into floating-point textures.
#[derive(Debug)]
pub(super) struct FloatPrograms {
    pub correlate: WebGlProgram,
    pub downsample: WebGlProgram,
}

impl GlContext {
    /// Creates the context on a canvas of its own.
    ///
    /// # Errors
    /// [`BackendError::Canvas`] or [`BackendError::Shader`].
    pub fn new(canvas: HtmlCanvasElement) -> Result<Self, BackendError> {
        let attributes = WebGlContextAttributes::new();
        attributes.set_alpha(false);
        attributes.set_antialias(false);
        attributes.set_depth(false);
        let gl = canvas
            .get_context_with_context_options("webgl2", &attributes)
            .map_err(|e| canvas_error(&format!("{e:?}")))?
            .and_then(|context| context.dyn_into::<Gl>().ok())
            .ok_or_else(|| {
                canvas_error("WebGL2 is missing, switched off, or all contexts are in use")
            })?;
        Self::with_programs(&gl, &canvas).inspect_err(|_| lose_context(&gl))
    }

    fn with_programs(gl: &Gl, canvas: &HtmlCanvasElement) -> Result<Self, BackendError> {
        if gl.is_context_lost() {
            return Err(canvas_error("the context is lost"));
        }
        let float_programs = match gl.get_extension("EXT_color_buffer_float") {
            Ok(Some(_)) => Some(FloatPrograms {
                correlate: link(gl, CORRELATE_SHADER, [binding::LIGHT as u32])?,
                downsample: link(gl, DOWNSAMPLE_SHADER, [LIGHT_IMAGE])?,
            }),
            _ => None,
        };
        let relight = link(gl, RELIGHT_SHADER, 0..TEXTURES as u32)?;
        gl.disable(Gl::DITHER); // on by default
        Ok(Self {
            float_programs,
            relight,
            limits: limits(gl),
            kernel: describe(gl),
            gamut: Cell::new(Gamut::Srgb),
            gl: gl.clone(),
            canvas: canvas.clone(),
        })
    }

    /// Whether the browser supports a gamut.
    pub(super) fn has_gamut(&self, gamut: Gamut) -> bool {
        gamut == Gamut::Srgb || Reflect::has(&self.gl, &COLOR_SPACE.into()).unwrap_or(false)
    }

    /// Prepares the canvas for a picture in its upper left corner.
    ///
    /// # Errors
    /// [`BackendError::Upload`] if the canvas cannot be as large.
    pub(super) fn set_target(&self, extent: Extent, gamut: Gamut) -> Result<(), BackendError> {
        let gl = &self.gl;
        let before = self.size();
        // If possible large enough for all photographs, so that it is rarely resized.
        let largest = Extent::new(
            before.width.max(extent.width),
            before.height.max(extent.height),
        );
        if !self.try_resize(largest) && !self.try_resize(extent) {
            self.try_resize(before);
            return Err(BackendError::Upload(format!(
                "a picture of {extent} pixels exceeds the browser's limit for {API}"
            )));
        }
        if self.gamut.replace(gamut) != gamut {
            let space = gamut.color_space().into();
            // `has_gamut` has checked that it can be set.
            let _ = Reflect::set(gl, &COLOR_SPACE.into(), &space);
            // Chromium applies it to copies only after the canvas is reallocated.
            self.canvas.set_width(self.canvas.width());
        }
        let [width, height] = [extent.width, extent.height].map(|side| side as i32);
        gl.viewport(0, gl.drawing_buffer_height() - height, width, height);
        Ok(())
    }

    fn size(&self) -> Extent {
        Extent::new(self.canvas.width(), self.canvas.height())
    }

    /// Resizes the canvas. Returns whether the drawing buffer follows: browsers give less beyond their limits.
    fn try_resize(&self, extent: Extent) -> bool {
        // Each assignment allocates the drawing buffer anew.
        if self.canvas.width() != extent.width {
            self.canvas.set_width(extent.width);
        }
        if self.canvas.height() != extent.height {
            self.canvas.set_height(extent.height);
        }
        self.gl.drawing_buffer_width() == extent.width as i32
            && self.gl.drawing_buffer_height() == extent.height as i32
    }

    /// Discards errors of earlier calls.
    pub(super) fn clear_errors(&self) {
        while !matches!(self.gl.get_error(), Gl::NO_ERROR | Gl::CONTEXT_LOST_WEBGL) {}
    }

    /// Waits for the device.
    ///
    /// # Errors
    /// The first error since the last check.
    pub(super) fn check(&self) -> Result<(), BackendError> {
        match self.gl.get_error() {
            Gl::NO_ERROR => Ok(()),
            Gl::OUT_OF_MEMORY => Err(BackendError::Upload("it is out of memory".into())),
            Gl::CONTEXT_LOST_WEBGL => Err(context_lost()),
            code => Err(BackendError::Upload(format!("WebGL error {code:#06x}"))),
        }
    }
}

impl Drop for GlContext {
    fn drop(&mut self) {
        lose_context(&self.gl);
    }
}

const COLOR_SPACE: &str = "drawingBufferColorSpace";

/// Frees a context and its resources, of whose size the garbage collector does not know.
fn lose_context(gl: &Gl) {
    if let Ok(Some(extension)) = gl.get_extension("WEBGL_lose_context") {
        // Browsers do not expose this interface, so its type cannot be checked.
        extension
            .unchecked_into::<WebglLoseContext>()
            .lose_context();
    }
}

pub(super) fn context_lost() -> BackendError {
    BackendError::Device(API, "the context was lost during set-up".into())
}

fn canvas_error(reason: &str) -> BackendError {
    BackendError::Canvas(API, reason.into())
}

fn limits(gl: &Gl) -> TextureLimits {
    let limit = |name| {
        let value = gl.get_parameter(name).ok().and_then(|v| v.as_f64());
        value.unwrap_or(0.0) as u32
    };
    TextureLimits {
        max_side: limit(Gl::MAX_TEXTURE_SIZE),
        max_layers: limit(Gl::MAX_ARRAY_TEXTURE_LAYERS),
    }
}

/// The renderer's name. Chromium and Safari report it by an extension only, which Firefox deprecates.
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

/// Links a program whose samplers read these texture units.
fn link(
    gl: &Gl,
    fragment: &str,
    units: impl IntoIterator<Item = u32>,
) -> Result<WebGlProgram, BackendError> {
    let compile = |kind, source| {
        let shader = gl.create_shader(kind).ok_or_else(context_lost)?;
        gl.shader_source(&shader, source);
        gl.compile_shader(&shader);
        Ok::<_, BackendError>(shader)
    };
    let vertex = compile(Gl::VERTEX_SHADER, VERTEX_SHADER)?;
    let shaders = [vertex, compile(Gl::FRAGMENT_SHADER, fragment)?];
    let program = gl.create_program().ok_or_else(context_lost)?;
    for shader in &shaders {
        gl.attach_shader(&program, shader);
    }
    gl.link_program(&program);
    // Asking earlier whether a shader compiles would wait for it.
    if gl.get_program_parameter(&program, Gl::LINK_STATUS) != true {
        let logs = shaders.iter().map(|shader| gl.get_shader_info_log(shader));
        let logs: Vec<_> = logs
            .chain([gl.get_program_info_log(&program)])
            .flatten()
            .collect();
        return Err(match gl.is_context_lost() {
            true => context_lost(),
            false => BackendError::Shader(logs.join("\n")),
        });
    }
    for shader in &shaders {
        gl.delete_shader(Some(shader)); // the program keeps it
    }
    gl.use_program(Some(&program));
    for unit in units {
        let name = format!("_group_0_binding_{unit}_fs");
        let location = gl.get_uniform_location(&program, &name);
        let location =
            location.ok_or_else(|| BackendError::Shader(format!("{name} is missing")))?;
        gl.uniform1i(Some(&location), unit as i32);
    }
    for (point, name) in (0..).zip(UNIFORM_BLOCKS) {
        let block = gl.get_uniform_block_index(&program, name);
        if block != Gl::INVALID_INDEX {
            gl.uniform_block_binding(&program, block, point);
        }
    }
    Ok(program)
}
