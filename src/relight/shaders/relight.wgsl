// y = pT, and what a display makes of it, for the camera pixel under each fragment.
//
// The shader source of both GPU back ends, which see.wgsl follows on WebGPU; the .glsl files beside it are translated from it
// (tests/shaders.rs). Only textures and small uniforms: WebGL2 has no storage buffers. What the
// textures hold and where is laid out in texture_layout.rs.

struct Params {
    // Linear RGB of the display's gamut from what is relit, row by row: exposure and white balance
    // are in it.
    display: array<vec4<f32>, 3>,
    // What a channel is of the light's tint.
    tint: vec4<f32>,
    // Elements along a window's side.
    window: i32,
    // Pixels along a tile's side.
    tile_side: i32,
    // Layers of a channel of the coefficients that are used; 0 for none.
    quads: i32,
    // Layers from one channel of the coefficients to the next.
    channel_quads: i32,
    // Layers from one channel of what is seen to the next; 0 where the light has one tint.
    seen_quads: i32,
    // 1 for the filmic curve, 0 to cut off at full brightness.
    filmic: i32,
    // 1 for codes that are dithered.
    dither: i32,
    unused: i32,
}

// Two quads of the basis, slot by slot.
struct Basis {
    quads: array<vec4<f32>, 1024>,
}

// 1 for the channel that is seen.
struct Channel {
    share: vec4<f32>,
}

// Columns, or rows, that a picture is made.
struct Shrink {
    to: vec4<i32>,
}

// Coefficients as signed 16-bit codes, [channel, quad] of four components.
@group(0) @binding(0) var coefficients: texture_2d_array<i32>;
// The light through the basis from each window origin, the first of which is (-window, -window).
@group(0) @binding(1) var seen: texture_2d_array<f32>;
// τ as signed 16-bit codes: window after window, row by row, of a tile's pixels.
@group(0) @binding(2) var codes: texture_2d_array<i32>;
// For each camera pixel: its window's first element.
@group(0) @binding(3) var origins: texture_2d<i32>;
// Value of one code, per tile and channel: of coefficients, and below that of τ.
@group(0) @binding(4) var steps: texture_2d<f32>;
// Linear emission of each light element.
@group(0) @binding(5) var light: texture_2d<f32>;
// For each tile: its first code or -1, its first column and row, its width.
@group(0) @binding(6) var tiles: texture_2d<i32>;
@group(0) @binding(7) var<uniform> params: Params;
@group(0) @binding(8) var<uniform> basis: Basis;
@group(0) @binding(9) var<uniform> channel: Channel;

// A picture that is to be the light: its codes as they came, or means of its columns.
@group(0) @binding(10) var picture: texture_2d<f32>;
@group(0) @binding(11) var<uniform> shrink: Shrink;

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

// As many means of columns of the picture's light as the display has columns.
@fragment
fn across(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let count = i32(textureDimensions(picture).x);
    let reach = covered(i32(at.x), count);
    var sum = vec3<f32>(0.0);
    for (var x = reach.x; x <= reach.y; x++) {
        let code = textureLoad(picture, vec2<i32>(x, i32(at.y)), 0);
        // What is transparent does not shine.
        sum += share(i32(at.x), x, count) * code.a * srgb_decode(code.rgb);
    }
    return vec4<f32>(sum, 0.0);
}

// Of these, as many means of rows as it has rows.
@fragment
fn down(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let count = i32(textureDimensions(picture).y);
    let reach = covered(i32(at.y), count);
    var sum = vec3<f32>(0.0);
    for (var y = reach.x; y <= reach.y; y++) {
        let mean = textureLoad(picture, vec2<i32>(i32(at.x), y), 0);
        sum += share(i32(at.y), y, count) * mean.rgb;
    }
    return vec4<f32>(sum, 0.0);
}

// The first and the last of `count` things that number `i` of those they are made covers.
fn covered(i: i32, count: i32) -> vec2<i32> {
    return vec2<i32>(i * count, (i + 1) * count - 1) / shrink.to.x;
}

// The part of `i` that `j` makes up. Whole numbers, so that nothing is lost at edges.
fn share(i: i32, j: i32, count: i32) -> f32 {
    let begin = max(i * count, j * shrink.to.x);
    let end = min((i + 1) * count, (j + 1) * shrink.to.x);
    return f32(end - begin) / f32(count);
}

fn srgb_decode(code: vec3<f32>) -> vec3<f32> {
    let curve = pow((code + 0.055) / 1.055, vec3<f32>(2.4));
    return select(curve, code / 12.92, code <= vec3<f32>(0.04045));
}

@fragment
fn relight(in: Covering) -> @location(0) vec4<f32> {
    let camera = vec2<i32>(textureDimensions(origins));
    // A fragment's centre lies half a pixel from the nearest edge: rounding can't reach it.
    let at = clamp(vec2<i32>(in.picture * vec2<f32>(camera)), vec2<i32>(0), camera - 1);
    let origin = textureLoad(origins, at, 0).xy;
    let tile = at / params.tile_side;
    var linear = vec3<f32>(0.0);
    if params.quads > 0 {
        let step = textureLoad(steps, tile, 0);
        linear += step.rgb * params.tint.rgb * combined(at, origin + params.window);
    }
    let first = textureLoad(tiles, tile, 0);
    if first.x >= 0 {
        let in_tile = at - first.yz;
        let pixel = in_tile.y * first.w + in_tile.x;
        let below = vec2<i32>(0, i32(textureDimensions(steps).y) / 2);
        let step = textureLoad(steps, tile + below, 0);
        let code = first.x + pixel * params.window * params.window;
        linear += step.rgb * windowed_sum(origin, code);
    }
    return vec4<f32>(shown(linear, at), 1.0);
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
            dot(vec4<f32>(textureLoad(coefficients, at, q + params.channel_quads, 0)), green),
            dot(vec4<f32>(textureLoad(coefficients, at, q + 2 * params.channel_quads, 0)), blue),
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

// As display.rs.
fn shown(linear: vec3<f32>, at: vec2<i32>) -> vec3<f32> {
    let given = vec3<f32>(
        dot(params.display[0].xyz, linear),
        dot(params.display[1].xyz, linear),
        dot(params.display[2].xyz, linear),
    );
    var y = clamp(given, vec3<f32>(0.0), vec3<f32>(1.0));
    if params.filmic > 0 {
        let rolled = hable(2.0 * clamp(given, vec3<f32>(0.0), vec3<f32>(5.6)));
        y = clamp(rolled / hable(vec3<f32>(11.2)), vec3<f32>(0.0), vec3<f32>(1.0));
    }
    // IEC 61966-2-1.
    let curve = 1.055 * pow(y, vec3<f32>(1.0 / 2.4)) - 0.055;
    var signal = select(curve, 12.92 * y, y <= vec3<f32>(0.0031308));
    if params.dither > 0 {
        // The target rounds.
        signal += ((f32(bayer(at)) + 0.5) / 64.0 - 0.5) / 255.0;
    }
    return signal;
}

fn hable(x: vec3<f32>) -> vec3<f32> {
    let above = x * (0.15 * x + 0.05) + 0.004;
    let below = x * (0.15 * x + 0.5) + 0.06;
    return above / below - 0.02 / 0.3;
}

fn bayer(at: vec2<i32>) -> i32 {
    let n = vec2<i32>(at.x ^ at.y, at.y);
    let bits = ((n & vec2<i32>(1)) << vec2<u32>(4u)) | ((n & vec2<i32>(2)) << vec2<u32>(1u)) | ((n & vec2<i32>(4)) >> vec2<u32>(2u));
    return (bits.x << 1u) | bits.y;
}
