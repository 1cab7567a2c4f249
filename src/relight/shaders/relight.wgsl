// The last pass: y_n = Σ_k c_nk C_k(o_n) + Σ_s τ_n(s) p(o_n + s) for the camera pixel n under each fragment, then the
// output transform. Textures and small uniforms only, as WebGL2 has no storage buffers.

// Coefficients as signed 16-bit codes: layers [channel, quad], four components a texel.
@group(0) @binding(0) var coefficients: texture_2d_array<i32>;
// The basis response C: layers [channel, quad], a texel for each window origin from (-window, -window) on.
@group(0) @binding(1) var basis_response: texture_2d_array<f32>;
// Direct functions without zeros, as signed 16-bit codes: R, G, B of a slot, and in twelve bits the slot. Tile by tile,
// pixel by pixel, folded into rows and layers.
@group(0) @binding(2) var codes: texture_2d_array<i32>;
// The window origin of each camera pixel.
@group(0) @binding(3) var origins: texture_2d<i32>;
// The value of one code in each channel, tile by tile: of coefficients, and below them of τ.
@group(0) @binding(4) var steps: texture_2d<f32>;
// For each camera pixel the index of its first texel of codes, and one past its last; a single texel of zeros if there are
// no direct functions.
@group(0) @binding(6) var functions: texture_2d<i32>;

@fragment
fn relight(@location(0) position: vec2<f32>) -> @location(0) vec4<f32> {
    let camera = vec2<i32>(textureDimensions(origins));
    // A fragment's centre is half a pixel from the nearest edge: rounding cannot reach it.
    let pixel = clamp(vec2<i32>(position * vec2<f32>(camera)), vec2<i32>(0), camera - 1);
    let origin = textureLoad(origins, pixel, 0).xy;
    let tile = pixel / frame.tile_side;
    var linear = vec3<f32>(0.0);
    if frame.used_quads > 0 {
        let step = textureLoad(steps, tile, 0);
        linear += step.rgb * frame.chroma.rgb * factored_sum(pixel, origin + frame.window);
    }
    let range = textureLoad(functions, min(pixel, vec2<i32>(textureDimensions(functions)) - 1), 0).xy;
    if range.x < range.y {
        let below = vec2<i32>(0, i32(textureDimensions(steps).y) / 2);
        linear += textureLoad(steps, tile + below, 0).rgb * windowed_sum(origin, range);
    }
    return vec4<f32>(output_transform(linear, pixel), 1.0);
}

// Σ_k code_nk C_k, four components at once; `at` is the origin's texel.
fn factored_sum(pixel: vec2<i32>, at: vec2<i32>) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    for (var q = 0; q < frame.used_quads; q++) {
        let red = textureLoad(basis_response, at, q, 0);
        var green = red;
        var blue = red;
        if frame.response_stride > 0 {
            green = textureLoad(basis_response, at, q + frame.response_stride, 0);
            blue = textureLoad(basis_response, at, q + 2 * frame.response_stride, 0);
        }
        sum += vec3<f32>(
            dot(vec4<f32>(textureLoad(coefficients, pixel, q, 0)), red),
            dot(vec4<f32>(textureLoad(coefficients, pixel, q + frame.coefficient_stride, 0)), green),
            dot(vec4<f32>(textureLoad(coefficients, pixel, q + 2 * frame.coefficient_stride, 0)), blue),
        );
    }
    return sum;
}

// Σ_s code(s) p(o + s) over a range of codes, for the slots that lie on the light plane.
fn windowed_sum(origin: vec2<i32>, range: vec2<i32>) -> vec3<f32> {
    let fold = vec2<i32>(textureDimensions(codes));
    let plane = vec2<i32>(textureDimensions(light));
    let line = range.x / fold.x;
    var texel = vec2<i32>(range.x % fold.x, line % fold.y);
    var layer = line / fold.y;
    var sum = vec3<f32>(0.0);
    for (var i = range.x; i < range.y; i++) {
        let code = textureLoad(codes, texel, layer, 0);
        let slot = code.w & 0xfff;
        let element = origin + vec2<i32>(slot % frame.window, slot / frame.window);
        if all(element >= vec2<i32>(0)) && all(element < plane) {
            sum += vec3<f32>(code.rgb) * textureLoad(light, element, 0).rgb;
        }
        texel.x++;
        if texel.x == fold.x {
            texel = vec2<i32>(0, texel.y + 1);
            if texel.y == fold.y {
                texel.y = 0;
                layer++;
            }
        }
    }
    return sum;
}

// From linear light to codes of 0 to 1, as output_transform.rs.
fn output_transform(linear: vec3<f32>, pixel: vec2<i32>) -> vec3<f32> {
    let exposed = vec3<f32>(
        dot(frame.output_matrix[0].xyz, linear),
        dot(frame.output_matrix[1].xyz, linear),
        dot(frame.output_matrix[2].xyz, linear),
    );
    var y = clamp(exposed, vec3<f32>(0.0), vec3<f32>(1.0));
    if frame.filmic > 0 {
        let toned = hable(2.0 * clamp(exposed, vec3<f32>(0.0), vec3<f32>(5.6)));
        y = clamp(toned / hable(vec3<f32>(11.2)), vec3<f32>(0.0), vec3<f32>(1.0));
    }
    // IEC 61966-2-1.
    let curve = 1.055 * pow(y, vec3<f32>(1.0 / 2.4)) - 0.055;
    var encoded = select(curve, 12.92 * y, y <= vec3<f32>(0.0031308));
    if frame.dither > 0 {
        // The target rounds to the nearest code.
        encoded += ((f32(bayer(pixel)) + 0.5) / 64.0 - 0.5) / 255.0;
    }
    return encoded;
}

fn hable(x: vec3<f32>) -> vec3<f32> {
    let above = x * (0.15 * x + 0.05) + 0.004;
    let below = x * (0.15 * x + 0.5) + 0.06;
    return above / below - 0.02 / 0.3;
}

fn bayer(pixel: vec2<i32>) -> i32 {
    let n = vec2<i32>(pixel.x ^ pixel.y, pixel.y);
    let bits = ((n & vec2<i32>(1)) << vec2<u32>(4u)) | ((n & vec2<i32>(2)) << vec2<u32>(1u)) | ((n & vec2<i32>(4)) >> vec2<u32>(2u));
    return (bits.x << 1u) | bits.y;
}
