#version 300 es
// naga made this of relight.wgsl: change that one.

precision highp float;
precision highp int;

struct Params {
    int window;
    float exposure;
    int quads;
    int seen_quads;
    vec4 tint;
};
struct Basis {
    vec4 quads[1024];
};
struct Channel {
    vec4 share;
};
struct Covering {
    vec4 clip;
    vec2 picture;
};
struct Pair {
    vec4 first;
    vec4 second;
};
smooth out vec2 _vs2fs_location0;

vec3 srgb_encode(vec3 linear_1) {
    vec3 y = clamp(linear_1, vec3(0.0), vec3(1.0));
    vec3 curve = ((1.055 * pow(y, vec3(0.41666666))) - vec3(0.055));
    return mix(curve, (12.92 * y), lessThanEqual(y, vec3(0.0031308)));
}

void main() {
    uint vertex = uint(gl_VertexID);
    vec2 picture = (vec2(float((vertex & 1u)), float((vertex >> 1u))) * 2.0);
    vec2 clip = vec2(((2.0 * picture.x) - 1.0), (1.0 - (2.0 * picture.y)));
    Covering _tmp_return = Covering(vec4(clip, 0.0, 1.0), picture);
    gl_Position = _tmp_return.clip;
    _vs2fs_location0 = _tmp_return.picture;
    return;
}

