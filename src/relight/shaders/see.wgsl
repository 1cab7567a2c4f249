// What WebGPU does where WebGL2 has the fragment shader `see`; it follows relight.wgsl in one module.

// What a dispatch sees, and where it goes.
struct Part {
    // 1 for the channel that is seen where the light has one tint.
    share: vec4<f32>,
    // The first of its two layers.
    layer: i32,
}

// What is seen, to be written.
@group(0) @binding(12) var seen_there: texture_storage_2d_array<rgba32float, write>;
@group(0) @binding(13) var<uniform> part: Part;

// Window origins that are seen together, and elements that they see, at most: windows that uniforms have
// room for are 21 wide. Origins of one row are as many as processors usually take in step, which then
// never ask one bank of the memory they share for two words.
const GROUP: vec2<u32> = vec2<u32>(32u, 4u);
const PATCH: vec2<u32> = vec2<u32>(52u, 24u);
var<workgroup> patch_red: array<f32, 1248>;
var<workgroup> patch_green: array<f32, 1248>;
var<workgroup> patch_blue: array<f32, 1248>;

// As `see`, for all channels at once: elements are fetched once for all origins of a group.
@compute @workgroup_size(32, 4)
fn see_together(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    let window = u32(params.window);
    let corner = vec2<i32>(group.xy * GROUP) - params.window;
    let display = vec2<i32>(textureDimensions(light));
    for (var y = local.y; y < GROUP.y + window - 1u; y += GROUP.y) {
        for (var x = local.x; x < GROUP.x + window - 1u; x += GROUP.x) {
            let element = corner + vec2<i32>(vec2<u32>(x, y));
            var emitted = vec3<f32>(0.0);
            if all(element >= vec2<i32>(0)) && all(element < display) {
                emitted = textureLoad(light, element, 0).rgb;
            }
            let i = y * PATCH.x + x;
            if params.seen_quads > 0 {
                patch_red[i] = emitted.r;
                patch_green[i] = emitted.g;
                patch_blue[i] = emitted.b;
            } else {
                patch_red[i] = dot(emitted, part.share.rgb);
            }
        }
    }
    workgroupBarrier();
    let at = vec2<i32>(group.xy * GROUP + local.xy);
    let inside = all(at < vec2<i32>(textureDimensions(seen_there)));
    var red = Pair(vec4<f32>(0.0), vec4<f32>(0.0));
    if params.seen_quads == 0 {
        for (var v = 0u; v < window; v++) {
            for (var u = 0u; u < window; u++) {
                let slot = v * window + u;
                let i = (local.y + v) * PATCH.x + local.x + u;
                red.first += patch_red[i] * basis.quads[2u * slot];
                red.second += patch_red[i] * basis.quads[2u * slot + 1u];
            }
        }
        if inside {
            put(at, part.layer, red);
        }
        return;
    }
    var green = red;
    var blue = red;
    for (var v = 0u; v < window; v++) {
        for (var u = 0u; u < window; u++) {
            let slot = v * window + u;
            let first = basis.quads[2u * slot];
            let second = basis.quads[2u * slot + 1u];
            let i = (local.y + v) * PATCH.x + local.x + u;
            red.first += patch_red[i] * first;
            red.second += patch_red[i] * second;
            green.first += patch_green[i] * first;
            green.second += patch_green[i] * second;
            blue.first += patch_blue[i] * first;
            blue.second += patch_blue[i] * second;
        }
    }
    if inside {
        put(at, part.layer, red);
        put(at, part.layer + params.seen_quads, green);
        put(at, part.layer + 2 * params.seen_quads, blue);
    }
}

fn put(at: vec2<i32>, layer: i32, pair: Pair) {
    textureStore(seen_there, at, layer, pair.first);
    textureStore(seen_there, at, layer + 1, pair.second);
}
