// The basis response by WebGPU: C_k(o) = Σ_s v_k(s) p(o + s) for eight functions v_k, at all window origins o, for all
// channels p of the light at once. A workgroup takes 32 × 4 origins and loads the light under them once.

struct DispatchUniforms {
    // The first of the two layers that are written.
    layer: i32,
}

// C, two layers for each channel.
@group(0) @binding(12) var basis_response_out: texture_storage_2d_array<rgba32float, write>;
@group(0) @binding(13) var<uniform> dispatch: DispatchUniforms;

// Window origins of a workgroup, and the light elements under them for the largest window that the uniforms hold, of
// side 21. A row has as many origins as most GPUs run in lockstep; their accesses to workgroup memory never hit one
// bank twice.
const GROUP: vec2<u32> = vec2<u32>(32u, 4u);
const FOOTPRINT: vec2<u32> = vec2<u32>(52u, 24u);
var<workgroup> light_red: array<f32, 1248>;
var<workgroup> light_green: array<f32, 1248>;
var<workgroup> light_blue: array<f32, 1248>;

@compute @workgroup_size(32, 4)
fn correlate_group(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    let window = u32(frame.window);
    let corner = vec2<i32>(group.xy * GROUP) - frame.window;
    let plane = vec2<i32>(textureDimensions(light));
    for (var y = local.y; y < GROUP.y + window - 1u; y += GROUP.y) {
        for (var x = local.x; x < GROUP.x + window - 1u; x += GROUP.x) {
            let element = corner + vec2<i32>(vec2<u32>(x, y));
            var emission = vec3<f32>(0.0);
            if all(element >= vec2<i32>(0)) && all(element < plane) {
                emission = textureLoad(light, element, 0).rgb;
            }
            let i = y * FOOTPRINT.x + x;
            if frame.response_stride > 0 {
                light_red[i] = emission.r;
                light_green[i] = emission.g;
                light_blue[i] = emission.b;
            } else {
                light_red[i] = dot(emission, frame.base_channel.rgb);
            }
        }
    }
    workgroupBarrier();
    let at = vec2<i32>(group.xy * GROUP + local.xy);
    let is_inside = all(at < vec2<i32>(textureDimensions(basis_response_out)));
    var red = ResponseQuads(vec4<f32>(0.0), vec4<f32>(0.0));
    if frame.response_stride == 0 {
        for (var v = 0u; v < window; v++) {
            for (var u = 0u; u < window; u++) {
                let slot = v * window + u;
                let i = (local.y + v) * FOOTPRINT.x + local.x + u;
                red.first += light_red[i] * basis.quads[2u * slot];
                red.second += light_red[i] * basis.quads[2u * slot + 1u];
            }
        }
        if is_inside {
            store(at, dispatch.layer, red);
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
            let i = (local.y + v) * FOOTPRINT.x + local.x + u;
            red.first += light_red[i] * first;
            red.second += light_red[i] * second;
            green.first += light_green[i] * first;
            green.second += light_green[i] * second;
            blue.first += light_blue[i] * first;
            blue.second += light_blue[i] * second;
        }
    }
    if is_inside {
        store(at, dispatch.layer, red);
        store(at, dispatch.layer + frame.response_stride, green);
        store(at, dispatch.layer + 2 * frame.response_stride, blue);
    }
}

fn store(at: vec2<i32>, layer: i32, response: ResponseQuads) {
    textureStore(basis_response_out, at, layer, response.first);
    textureStore(basis_response_out, at, layer + 1, response.second);
}
