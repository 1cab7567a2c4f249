// y = pT, then exposure and the sRGB curve, for the camera pixel under each fragment.
//
// The one shader source of both GPU back ends; relight.{vert,frag}.glsl are translated from it
// (tests/shaders.rs). Only textures and one small uniform: WebGL2 has no storage buffers. What the
// textures hold and where is laid out in texture_layout.rs.

struct Params {
    // Elements along a window's side.
    window: i32,
    exposure: f32,
    // Uniform structs are multiples of 16 bytes.
    reserved: vec2<f32>,
}

// τ as signed 16-bit codes: a pixel's window, row by row, from the texel that `pixels` names.
@group(0) @binding(0) var codes: texture_2d_array<i32>;
// For each camera pixel: its window's first element (u, v), its first code, its tile.
@group(0) @binding(1) var pixels: texture_2d<i32>;
// Value of one code, per tile and channel.
@group(0) @binding(2) var steps: texture_2d<f32>;
// Linear emission of each light element.
@group(0) @binding(3) var light: texture_2d<f32>;
@group(0) @binding(4) var<uniform> params: Params;

struct Covering {
    @builtin(position) clip: vec4<f32>,
    // Position in the picture, 0..1, y down. Fragment coordinates would do, were they not counted
    // from the top in WebGPU and from the bottom in WebGL.
    @location(0) picture: vec2<f32>,
}

// One triangle, twice the picture's size, that covers it.
@vertex
fn cover(@builtin(vertex_index) vertex: u32) -> Covering {
    let picture = vec2<f32>(f32(vertex & 1u), f32(vertex >> 1u)) * 2.0;
    let clip = vec2<f32>(2.0 * picture.x - 1.0, 1.0 - 2.0 * picture.y);
    return Covering(vec4<f32>(clip, 0.0, 1.0), picture);
}

@fragment
fn relight(in: Covering) -> @location(0) vec4<f32> {
    let camera = vec2<i32>(textureDimensions(pixels));
    // A fragment's centre lies half a pixel from the nearest edge: rounding can't reach it.
    let at = clamp(vec2<i32>(in.picture * vec2<f32>(camera)), vec2<i32>(0), camera - 1);
    let pixel = textureLoad(pixels, at, 0);
    let tiles_across = i32(textureDimensions(steps).x);
    let step = textureLoad(steps, vec2<i32>(pixel.w % tiles_across, pixel.w / tiles_across), 0);
    let linear = params.exposure * (step.rgb * windowed_sum(pixel.xy, pixel.z));
    return vec4<f32>(srgb_encode(linear), 1.0);
}

// Σ code · light over the part of the window that is on the display.
fn windowed_sum(origin: vec2<i32>, first_code: i32) -> vec3<f32> {
    let fold = vec2<i32>(textureDimensions(codes));
    let begin = clamp(-origin, vec2<i32>(0), vec2<i32>(params.window));
    let display = vec2<i32>(textureDimensions(light));
    let end = clamp(display - origin, vec2<i32>(0), vec2<i32>(params.window));
    var sum = vec3<f32>(0.0);
    for (var v = begin.y; v < end.y; v++) {
        let code = first_code + v * params.window + begin.x;
        let line = code / fold.x;
        var texel = vec2<i32>(code % fold.x, line % fold.y);
        var layer = line / fold.y;
        for (var u = begin.x; u < end.x; u++) {
            let emitted = textureLoad(light, origin + vec2<i32>(u, v), 0);
            sum += vec3<f32>(textureLoad(codes, texel, layer, 0).rgb) * emitted.rgb;
            texel.x++;
            if texel.x == fold.x {
                texel = vec2<i32>(0, texel.y + 1);
                if texel.y == fold.y {
                    texel.y = 0;
                    layer++;
                }
            }
        }
    }
    return sum;
}

// IEC 61966-2-1, as tone.rs.
fn srgb_encode(linear: vec3<f32>) -> vec3<f32> {
    let y = clamp(linear, vec3<f32>(0.0), vec3<f32>(1.0));
    let curve = 1.055 * pow(y, vec3<f32>(1.0 / 2.4)) - 0.055;
    return select(curve, 12.92 * y, y <= vec3<f32>(0.0031308));
}
