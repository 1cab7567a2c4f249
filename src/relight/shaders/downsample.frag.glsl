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
uniform highp sampler2D _group_0_binding_10_fs;
layout(std140) uniform Shrink_block_0Fragment { Shrink _group_0_binding_11_fs; };
layout(location = 0) out vec4 _fs2p_location0;
ivec2 covered(int i, int count) {
int _e12 = _group_0_binding_11_fs.to.x;
return (ivec2((i * count), (((i + 1) * count) - 1)) / ivec2(_e12));
}
float share(int i_1, int j, int count_1) {
int _e7 = _group_0_binding_11_fs.to.x;
int begin = max((i_1 * count_1), (j * _e7));
int _e18 = _group_0_binding_11_fs.to.x;
int end = min(((i_1 + 1) * count_1), ((j + 1) * _e18));
return (float((end - begin)) / float(count_1));
}
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
vec4 at_1 = gl_FragCoord;
vec3 sum = vec3(0.0);
int x = 0;
int count_2 = int(uvec2(textureSize(_group_0_binding_10_fs, 0).xy).x);
ivec2 _e7 = covered(int(at_1.x), count_2);
x = _e7.x;
bool loop_init = true;
while(true) {
if (!loop_init) {
int _e35 = x;
x = (_e35 + 1);
}
loop_init = false;
int _e13 = x;
if ((_e13 <= _e7.y)) {
} else {
break;
}
{
int _e17 = x;
vec4 code_1 = texelFetch(_group_0_binding_10_fs, ivec2(_e17, int(at_1.y)), 0);
vec3 _e23 = sum;
int _e26 = x;
float _e27 = share(int(at_1.x), _e26, count_2);
vec3 _e31 = srgb_decode(code_1.xyz);
sum = (_e23 + ((_e27 * code_1.w) * _e31));
}
}
vec3 _e37 = sum;
_fs2p_location0 = vec4(_e37, 0.0);
return;
}
