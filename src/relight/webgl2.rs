//! Relighting by WebGL2, through web-sys: a tenth of the size of wgpu's own WebGL.

use js_sys::{Float32Array, Int16Array, Int32Array, Object};
use wasm_bindgen::JsCast;
use web_sys::{
    HtmlCanvasElement, WebGl2RenderingContext as Gl, WebGlBuffer, WebGlContextAttributes,
    WebGlProgram, WebGlShader, WebGlTexture, WebglLoseContext,
};

use super::Light;
use super::backend::{Backend, BackendError};
use super::texture_layout::{TextureLayout, TextureLimits};
use crate::transport::{Extent, Geometry, Transport};

const API: &str = "WebGL2";
const VERTEX_SHADER: &str = include_str!("shaders/relight.vert.glsl");
const FRAGMENT_SHADER: &str = include_str!("shaders/relight.frag.glsl");

/// Texture units, which are naga's binding numbers too.
const CODES: u32 = 0;
const PIXELS: u32 = 1;
const STEPS: u32 = 2;
const LIGHT: u32 = 3;

/// A transport in a WebGL2 context.
pub struct WebGl2 {
    layout: TextureLayout,
    context: Context,
    /// The light as the context takes it, kept to spare an allocation a frame.
    light: Float32Array,
    kernel: String,
}

/// The context and all that was made in it.
struct Context {
    gl: Gl,
    program: Option<WebGlProgram>,
    textures: Vec<WebGlTexture>,
    params: Option<WebGlBuffer>,
}

impl WebGl2 {
    /// Uploads a transport. Whatever comes of it, no other kind of back end can have the canvas
    /// afterwards: a context has to be made to learn what the device can do.
    pub fn new(transport: &Transport, canvas: &HtmlCanvasElement) -> Result<Self, BackendError> {
        let Geometry { camera, light, .. } = transport.geometry;
        let mut context = open(canvas, camera)?;
        let layout = TextureLayout::new(transport.geometry, limits(&context.gl))?;
        let kernel = describe(&context.gl);
        context.link()?;
        context.upload(&layout, transport)?;
        let gl = &context.gl;
        gl.disable(Gl::DITHER); // on unless switched off
        gl.viewport(0, 0, camera.width as i32, camera.height as i32);
        context.check()?;
        Ok(Self {
            layout,
            light: Float32Array::new_with_length(4 * light.area() as u32),
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
        let Context { gl, .. } = &self.context;
        self.light.copy_from(light.elements().as_flattened());
        gl.active_texture(Gl::TEXTURE0 + LIGHT);
        let written = write_rows(gl, self.layout.light(), FLOATS, &self.light);
        let params = self.layout.params(exposure);
        gl.buffer_sub_data_with_i32_and_u8_array(
            Gl::UNIFORM_BUFFER,
            0,
            bytemuck::bytes_of(&params),
        );
        gl.draw_arrays(Gl::TRIANGLES, 0, 3);
        // To a lost context all calls are no-ops. Asking for other errors would wait for the
        // device, and a draw that was good once has none.
        if gl.is_context_lost() {
            return Err(BackendError::Lost("the browser took its context".into()));
        }
        written
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
        program: None,
        textures: Vec::new(),
        params: None,
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
    fn link(&mut self) -> Result<(), BackendError> {
        let gl = &self.gl;
        let shaders = [
            compile(gl, Gl::VERTEX_SHADER, "vertex shader", VERTEX_SHADER)?,
            compile(gl, Gl::FRAGMENT_SHADER, "fragment shader", FRAGMENT_SHADER)?,
        ];
        let refused = |log| BackendError::Shader {
            stage: "program",
            log,
        };
        let program = gl.create_program();
        let program = self.program.insert(program.ok_or_else(|| self.lost())?);
        for shader in &shaders {
            gl.attach_shader(program, shader);
        }
        gl.link_program(program);
        for shader in &shaders {
            gl.delete_shader(Some(shader)); // the program keeps it
        }
        if gl.get_program_parameter(program, Gl::LINK_STATUS) != true {
            return Err(refused(
                gl.get_program_info_log(program).unwrap_or_default(),
            ));
        }
        gl.use_program(Some(program));
        for unit in [CODES, PIXELS, STEPS, LIGHT] {
            let name = format!("_group_0_binding_{unit}_fs");
            let location = gl.get_uniform_location(program, &name);
            let location = location.ok_or_else(|| refused(format!("{name} is missing")))?;
            gl.uniform1i(Some(&location), unit as i32);
        }
        let block = gl.get_uniform_block_index(program, "Params_block_0Fragment");
        gl.uniform_block_binding(program, block, 0);
        let params = self
            .params
            .insert(gl.create_buffer().ok_or_else(|| self.lost())?);
        gl.bind_buffer_base(Gl::UNIFORM_BUFFER, 0, Some(params));
        gl.buffer_data_with_i32(
            Gl::UNIFORM_BUFFER,
            size_of::<super::texture_layout::Params>() as i32,
            Gl::DYNAMIC_DRAW,
        );
        Ok(())
    }

    /// Fills all textures but the light's, which every frame brings anew.
    fn upload(
        &mut self,
        layout: &TextureLayout,
        transport: &Transport,
    ) -> Result<(), BackendError> {
        let codes = layout.codes();
        self.add_texture(CODES, CODES16, codes.extent, Some(codes.layers))?;
        // Out of memory shows here, before the long work.
        self.check()?;
        let mut staging = Int16Array::new_with_length(0);
        layout.for_each_code_block(transport, |block| {
            let components = block.texels.as_flattened();
            if staging.length() as usize != components.len() {
                staging = Int16Array::new_with_length(components.len() as u32);
            }
            staging.copy_from(components);
            self.gl
                .tex_sub_image_3d_with_opt_array_buffer_view(
                    Gl::TEXTURE_2D_ARRAY,
                    0,
                    0,
                    block.row as i32,
                    block.layer as i32,
                    codes.extent.width as i32,
                    block.rows as i32,
                    1,
                    CODES16.format,
                    CODES16.component,
                    Some(&staging),
                )
                .map_err(upload_error)
        })?;
        self.add_texture(PIXELS, INTEGERS, layout.pixels(), None)?;
        let pixels = layout.pixel_texels();
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
        self.gl.delete_buffer(self.params.as_ref());
        self.gl.delete_program(self.program.as_ref());
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

fn upload_error(thrown: wasm_bindgen::JsValue) -> BackendError {
    BackendError::Upload(format!("{thrown:?}"))
}
