// y = pT, then exposure and the sRGB curve, for the camera pixel under each fragment.
//
// The one shader source of both GPU back ends; the .glsl files beside it are translated from it
// (tests/shaders.rs). Only textures and small uniforms: WebGL2 has no storage buffers. What the
// textures hold and where is laid out in texture_layout.rs.

struct Params {
    // Elements along a window's side.
    window: i32,
    exposure: f32,
    // Layers of a channel of the coefficients; 0 for none.
    quads: i32,
    // Layers from one channel of what is seen to the next; 0 where the light has one tint.
    seen_quads: i32,
    // What a channel is of the light's tint.
    tint: vec4<f32>,
}

// Two quads of the basis, slot by slot.
struct Basis {
    quads: array<vec4<f32>, 1024>,
}

// 1 for the channel that is seen.
struct Channel {
    share: vec4<f32>,
}

// Coefficients as signed 16-bit codes, [channel, quad] of four components.
@group(0) @binding(0) var coefficients: texture_2d_array<i32>;
// The light through the basis from each window origin, the first of which is (-window, -window).
@group(0) @binding(1) var seen: texture_2d_array<f32>;
// τ as signed 16-bit codes: a pixel's window, row by row, from the texel that `pixels` names.
@group(0) @binding(2) var codes: texture_2d_array<i32>;
// For each camera pixel: its window's first element (u, v), its first code or -1, its tile.
@group(0) @binding(3) var pixels: texture_2d<i32>;
// Value of one code, per tile and channel: of coefficients, and below that of τ.
@group(0) @binding(4) var steps: texture_2d<f32>;
// Linear emission of each light element.
@group(0) @binding(5) var light: texture_2d<f32>;
@group(0) @binding(6) var<uniform> params: Params;
@group(0) @binding(7) var<uniform> basis: Basis;
@group(0) @binding(8) var<uniform> channel: Channel;

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

struct Pair {
    @location(0) first: vec4<f32>,
    @location(1) second: vec4<f32>,
}

// One channel of the light through eight functions of the basis, from one window origin. Rows of a
// texture are counted alike everywhere.
@fragment
fn see(@builtin(position) at: vec4<f32>) -> Pair {
    let origin = vec2<i32>(at.xy) - params.window;
    let begin = clamp(-origin, vec2<i32>(0), vec2<i32>(params.window));
    let display = vec2<i32>(textureDimensions(light));
    let end = clamp(display - origin, vec2<i32>(0), vec2<i32>(params.window));
    var pair = Pair(vec4<f32>(0.0), vec4<f32>(0.0));
    for (var v = begin.y; v < end.y; v++) {
        for (var u = begin.x; u < end.x; u++) {
            let emitted = textureLoad(light, origin + vec2<i32>(u, v), 0);
            let one = dot(emitted.rgb, channel.share.rgb);
            let slot = v * params.window + u;
            pair.first += one * basis.quads[2 * slot];
            pair.second += one * basis.quads[2 * slot + 1];
        }
    }
    return pair;
}

@fragment
fn relight(in: Covering) -> @location(0) vec4<f32> {
    let camera = vec2<i32>(textureDimensions(pixels));
    // A fragment's centre lies half a pixel from the nearest edge: rounding can't reach it.
    let at = clamp(vec2<i32>(in.picture * vec2<f32>(camera)), vec2<i32>(0), camera - 1);
    let pixel = textureLoad(pixels, at, 0);
    let grid = vec2<i32>(textureDimensions(steps)) / vec2<i32>(1, 2);
    let tile = vec2<i32>(pixel.w % grid.x, pixel.w / grid.x);
    var linear = vec3<f32>(0.0);
    if params.quads > 0 {
        let step = textureLoad(steps, tile, 0);
        linear += step.rgb * params.tint.rgb * combined(at, pixel.xy + params.window);
    }
    if pixel.z >= 0 {
        let step = textureLoad(steps, tile + vec2<i32>(0, grid.y), 0);
        linear += step.rgb * windowed_sum(pixel.xy, pixel.z);
    }
    return vec4<f32>(srgb_encode(params.exposure * linear), 1.0);
}

// Σ coefficient · what is seen through its component.
fn combined(at: vec2<i32>, origin: vec2<i32>) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    for (var q = 0; q < params.quads; q++) {
        let red = textureLoad(seen, origin, q, 0);
        var green = red;
        var blue = red;
        if params.seen_quads > 0 {
            green = textureLoad(seen, origin, q + params.seen_quads, 0);
            blue = textureLoad(seen, origin, q + 2 * params.seen_quads, 0);
        }
        sum += vec3<f32>(
            dot(vec4<f32>(textureLoad(coefficients, at, q, 0)), red),
            dot(vec4<f32>(textureLoad(coefficients, at, q + params.quads, 0)), green),
            dot(vec4<f32>(textureLoad(coefficients, at, q + 2 * params.quads, 0)), blue),
        );
    }
    return sum;
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
