/**
 * Runs in the page. Draws a frame as RTI viewers do for PTM, HSH and PCA with nine basis functions: each pixel has nine
 * coefficients for red, green and blue, stored as 27 bytes in seven RGBA8 layers with a scale and a bias each. The light's
 * direction gives nine weights; the picture is sRGB.
 *
 * This is written from the equations. It omits tile pyramids, zooming, mipmap interpolation, specular enhancement and
 * normals, none of which our element draws in this benchmark either.
 */

const FUNCTIONS = 9;
const LAYERS = 7;
/** Number of vectors of the uniforms: one for each layer, and the padded weights. */
const UNIFORMS = 4 * (LAYERS + LAYERS + 3);
const FRAMES = 4;
const FEWEST = 5;
const MOST = 200;

/**
 * Computes the hemispherical harmonics (HSH) of a direction.
 *
 * @param {number} x
 * @param {number} y
 */
function weights(x, y) {
  const z = Math.sqrt(Math.max(0, 1 - x * x - y * y));
  return [1, y, 2 * z - 1, x, x * y, y * z, 6 * z * z - 6 * z + 1, x * z, x * x - y * y];
}

/** Computes scales, biases and the weights of a frame's direction. @param {number} frame */
function uniforms(frame) {
  const values = new Float32Array(UNIFORMS);
  values.fill(0.1, 0, 4 * LAYERS);
  values.fill(-0.03, 4 * LAYERS, 8 * LAYERS);
  const angle = (2 * Math.PI * (frame % FRAMES)) / FRAMES;
  values.set(weights(0.5 * Math.cos(angle), 0.5 * Math.sin(angle)), 8 * LAYERS);
  return values;
}

/** Makes a layer of arbitrary bytes. @param {number} side */
function layer(side) {
  const bytes = new Uint8Array(4 * side * side);
  for (let at = 0; at < bytes.length; at += 1 << 16) {
    crypto.getRandomValues(bytes.subarray(at, at + (1 << 16)));
  }
  return bytes;
}

/** Writes the sum over basis functions; value 3 k + c belongs to function k and channel c. */
const sums = (/** @type {string} */ weight) =>
  [0, 1, 2]
    .map((c) =>
      Array.from({ length: FUNCTIONS }, (_, k) => {
        const value = 3 * k + c;
        return `${weight}[${k >> 2}].${'xyzw'[k & 3]} * v${value >> 2}.${'xyzw'[value & 3]}`;
      }).join(' + '),
    )
    .join(', ');

const each = (/** @type {(layer: number) => string} */ write) =>
  Array.from({ length: LAYERS }, (_, i) => write(i)).join('\n  ');

const GLSL = {
  vertex: `#version 300 es
void main() {
  gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0);
}`,
  fragment: `#version 300 es
precision highp float;
precision highp sampler2DArray;
uniform sampler2DArray planes;
uniform vec4 u[${UNIFORMS / 4}];
out vec4 colour;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  ${each((i) => `vec4 v${i} = texelFetch(planes, ivec3(at, ${i}), 0) * u[${i}] + u[${LAYERS + i}];`)}
  vec4 w[3] = vec4[3](u[${2 * LAYERS}], u[${2 * LAYERS + 1}], u[${2 * LAYERS + 2}]);
  vec3 light = clamp(vec3(${sums('w')}), 0.0, 1.0);
  vec3 curve = 1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055;
  colour = vec4(mix(curve, 12.92 * light, lessThanEqual(light, vec3(0.0031308))), 1.0);
}`,
};

const WGSL = `
@group(0) @binding(0) var planes: texture_2d_array<f32>;
@group(0) @binding(1) var<uniform> u: array<vec4f, ${UNIFORMS / 4}>;
@vertex fn cover(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
  return vec4f(vec2f(vec2u(i & 1, i >> 1)) * 4.0 - 1.0, 0.0, 1.0);
}
@fragment fn relight(@builtin(position) position: vec4f) -> @location(0) vec4f {
  let at = vec2i(position.xy);
  ${each((i) => `let v${i} = textureLoad(planes, at, ${i}, 0) * u[${i}] + u[${LAYERS + i}];`)}
  let w = array(u[${2 * LAYERS}], u[${2 * LAYERS + 1}], u[${2 * LAYERS + 2}]);
  let light = clamp(vec3f(${sums('w')}), vec3f(0.0), vec3f(1.0));
  let curve = 1.055 * pow(light, vec3f(1.0 / 2.4)) - 0.055;
  return vec4f(select(curve, 12.92 * light, light <= vec3f(0.0031308)), 1.0);
}`;

/**
 * @typedef {object} Peer
 * @property {string} adapter
 * @property {(frame: number) => void} draw
 * @property {() => unknown} finished returns or resolves when the picture is complete
 */

/** @param {HTMLCanvasElement} canvas @param {number} side @returns {Peer} */
function webgl2(canvas, side) {
  const gl = /** @type {WebGL2RenderingContext} */ (
    canvas.getContext('webgl2', { alpha: false, antialias: false, depth: false })
  );
  const program = /** @type {WebGLProgram} */ (gl.createProgram());
  for (const [type, text] of /** @type {const} */ ([
    [gl.VERTEX_SHADER, GLSL.vertex],
    [gl.FRAGMENT_SHADER, GLSL.fragment],
  ])) {
    const shader = /** @type {WebGLShader} */ (gl.createShader(type));
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
    throw new Error(gl.getProgramInfoLog(program) ?? 'the peer does not link');
  }
  gl.useProgram(program);
  gl.bindTexture(gl.TEXTURE_2D_ARRAY, gl.createTexture());
  gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, gl.RGBA8, side, side, LAYERS);
  gl.texParameteri(gl.TEXTURE_2D_ARRAY, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D_ARRAY, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  for (let i = 0; i < LAYERS; i += 1) {
    const target = gl.TEXTURE_2D_ARRAY;
    const bytes = layer(side);
    gl.texSubImage3D(target, 0, 0, 0, i, side, side, 1, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
  }
  gl.viewport(0, 0, side, side);
  const place = gl.getUniformLocation(program, 'u');
  const pixel = new Uint8Array(4);
  const named = gl.getExtension('WEBGL_debug_renderer_info');
  return {
    adapter: gl.getParameter(named?.UNMASKED_RENDERER_WEBGL ?? gl.RENDERER),
    draw(frame) {
      gl.uniform4fv(place, uniforms(frame));
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    },
    finished: () => gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel),
  };
}

// TypeScript does not know them yet.
const { GPUBufferUsage, GPUTextureUsage } = /** @type {any} */ (globalThis);

/** @param {HTMLCanvasElement} canvas @param {number} side @returns {Promise<Peer>} */
async function webgpu(canvas, side) {
  const adapter = await navigator.gpu.requestAdapter();
  if (!adapter) throw new Error('no adapter');
  const device = await adapter.requestDevice();
  const format = navigator.gpu.getPreferredCanvasFormat();
  const context = /** @type {GPUCanvasContext} */ (canvas.getContext('webgpu'));
  context.configure({ device, format });
  const module = device.createShaderModule({ code: WGSL });
  const pipeline = await device.createRenderPipelineAsync({
    layout: 'auto',
    vertex: { module },
    fragment: { module, targets: [{ format }] },
  });
  const planes = device.createTexture({
    size: [side, side, LAYERS],
    format: 'rgba8unorm',
    usage: GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.COPY_DST,
  });
  for (let i = 0; i < LAYERS; i += 1) {
    const layout = { bytesPerRow: 4 * side };
    const target = { texture: planes, origin: [0, 0, i] };
    device.queue.writeTexture(target, layer(side), layout, [side, side]);
  }
  const buffer = device.createBuffer({
    size: 4 * UNIFORMS,
    usage: GPUBufferUsage.UNIFORM | GPUBufferUsage.COPY_DST,
  });
  const group = device.createBindGroup({
    layout: pipeline.getBindGroupLayout(0),
    entries: [
      { binding: 0, resource: planes.createView({ dimension: '2d-array' }) },
      { binding: 1, resource: { buffer } },
    ],
  });
  return {
    adapter: `${adapter.info.vendor} ${adapter.info.architecture}`,
    draw(frame) {
      device.queue.writeBuffer(buffer, 0, uniforms(frame));
      const encoder = device.createCommandEncoder();
      const view = context.getCurrentTexture().createView();
      const pass = encoder.beginRenderPass({
        colorAttachments: [{ view, loadOp: 'clear', storeOp: 'store' }],
      });
      pass.setPipeline(pipeline);
      pass.setBindGroup(0, group);
      pass.draw(3);
      pass.end();
      device.queue.submit([encoder.finish()]);
    },
    finished: () => device.queue.onSubmittedWorkDone(),
  };
}

/**
 * Milliseconds of frames, each under another direction, until the picture is there.
 *
 * @param {'webgl2' | 'webgpu'} backend
 * @param {number} side
 * @param {number} seconds
 */
export async function timePeer(backend, side, seconds) {
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = side;
  canvas.style.width = '256px';
  document.body.append(canvas);
  const peer = await { webgl2, webgpu }[backend](canvas, side);
  const done = [];
  const start = performance.now();
  for (let i = 0; i < MOST; i += 1) {
    if (i >= FEWEST && performance.now() - start > 1000 * seconds) break;
    const turn = new Promise((resolve) => setTimeout(resolve));
    await turn;
    const began = performance.now();
    peer.draw(i);
    await peer.finished();
    if (i > 0) done.push(performance.now() - began);
  }
  return { adapter: peer.adapter, done };
}
