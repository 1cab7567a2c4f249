#version 300 es
// naga made this of relight.wgsl: change that one.
precision highp float;
precision highp int;
struct Params {
vec4 display[3];
vec4 tint;
int window;
int tile_side;
int quads;
int channel_quads;
int seen_quads;
int filmic;
int dither;
int unused;
};
struct Basis {
vec4 quads[1024];
};
struct Channel {
vec4 share;
};
struct Shrink {
ivec4 to;
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
vec3 srgb_decode(vec3 code) {
vec3 curve = pow(((code + vec3(0.055)) / vec3(1.055)), vec3(2.4));
return mix(curve, (code / vec3(12.92)), lessThanEqual(code, vec3(0.04045)));
}
vec3 hable(vec3 x_1) {
vec3 above = ((x_1 * ((0.15 * x_1) + vec3(0.05))) + vec3(0.004));
vec3 below = ((x_1 * ((0.15 * x_1) + vec3(0.5))) + vec3(0.06));
return ((above / below) - vec3(0.06666667));
}
int bayer(ivec2 at_4) {
ivec2 n = ivec2((at_4.x ^ at_4.y), at_4.y);
ivec2 bits = ((((n & ivec2(1)) << uvec2(4u)) | ((n & ivec2(2)) << uvec2(1u))) | ((n & ivec2(4)) >> uvec2(2u)));
return ((bits.x << 1u) | bits.y);
}
void main() {
uint vertex = uint(gl_VertexID);
vec2 picture_1 = (vec2(float((vertex & 1u)), float((vertex >> 1u))) * 2.0);
vec2 clip = vec2(((2.0 * picture_1.x) - 1.0), (1.0 - (2.0 * picture_1.y)));
Covering _tmp_return = Covering(vec4(clip, 0.0, 1.0), picture_1);
gl_Position = _tmp_return.clip;
_vs2fs_location0 = _tmp_return.picture;
return;
}
