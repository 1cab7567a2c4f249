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
uniform highp sampler2D _group_0_binding_5_fs;
layout(std140) uniform Params_block_0Fragment { Params _group_0_binding_7_fs; };
layout(std140) uniform Basis_block_1Fragment { Basis _group_0_binding_8_fs; };
layout(std140) uniform Channel_block_2Fragment { Channel _group_0_binding_9_fs; };
layout(location = 0) out vec4 _fs2p_location0;
layout(location = 1) out vec4 _fs2p_location1;
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
vec3 shown(vec3 linear_1, ivec2 at_5) {
vec3 y_1 = vec3(0.0);
vec3 signal = vec3(0.0);
vec4 _e5 = _group_0_binding_7_fs.display[0];
vec4 _e11 = _group_0_binding_7_fs.display[1];
vec4 _e17 = _group_0_binding_7_fs.display[2];
vec3 given = vec3(dot(_e5.xyz, linear_1), dot(_e11.xyz, linear_1), dot(_e17.xyz, linear_1));
y_1 = clamp(given, vec3(0.0), vec3(1.0));
int _e29 = _group_0_binding_7_fs.filmic;
if ((_e29 > 0)) {
vec3 _e39 = hable((2.0 * clamp(given, vec3(0.0), vec3(5.6))));
vec3 _e42 = hable(vec3(11.2));
y_1 = clamp((_e39 / _e42), vec3(0.0), vec3(1.0));
}
vec3 _e49 = y_1;
vec3 curve_1 = ((1.055 * pow(_e49, vec3(0.41666666))) - vec3(0.055));
vec3 _e58 = y_1;
vec3 _e61 = y_1;
signal = mix(curve_1, (12.92 * _e58), lessThanEqual(_e61, vec3(0.0031308)));
int _e69 = _group_0_binding_7_fs.dither;
if ((_e69 > 0)) {
vec3 _e72 = signal;
int _e73 = bayer(at_5);
signal = (_e72 + vec3(((((float(_e73) + 0.5) / 64.0) - 0.5) / 255.0)));
}
vec3 _e85 = signal;
return _e85;
}
void main() {
vec4 at = gl_FragCoord;
Pair pair = Pair(vec4(0.0), vec4(0.0));
int v = 0;
int u = 0;
int _e5 = _group_0_binding_7_fs.window;
ivec2 origin_2 = (ivec2(at.xy) - ivec2(_e5));
int _e13 = _group_0_binding_7_fs.window;
ivec2 begin = min(max(-(origin_2), ivec2(0)), ivec2(_e13));
ivec2 display = ivec2(uvec2(textureSize(_group_0_binding_5_fs, 0).xy));
int _e24 = _group_0_binding_7_fs.window;
ivec2 end = min(max((display - origin_2), ivec2(0)), ivec2(_e24));
v = begin.y;
bool loop_init = true;
while(true) {
if (!loop_init) {
int _e89 = v;
v = (_e89 + 1);
}
loop_init = false;
int _e35 = v;
if ((_e35 < end.y)) {
} else {
break;
}
{
u = begin.x;
bool loop_init_1 = true;
while(true) {
if (!loop_init_1) {
int _e86 = u;
u = (_e86 + 1);
}
loop_init_1 = false;
int _e40 = u;
if ((_e40 < end.x)) {
} else {
break;
}
{
int _e44 = u;
int _e45 = v;
vec4 emitted = texelFetch(_group_0_binding_5_fs, (origin_2 + ivec2(_e44, _e45)), 0);
vec4 _e53 = _group_0_binding_9_fs.share;
float one = dot(emitted.xyz, _e53.xyz);
int _e56 = v;
int _e59 = _group_0_binding_7_fs.window;
int _e61 = u;
int slot = ((_e56 * _e59) + _e61);
vec4 _e64 = pair.first;
vec4 _e70 = _group_0_binding_8_fs.quads[(2 * slot)];
pair.first = (_e64 + (one * _e70));
vec4 _e74 = pair.second;
vec4 _e82 = _group_0_binding_8_fs.quads[((2 * slot) + 1)];
pair.second = (_e74 + (one * _e82));
}
}
}
}
Pair _e91 = pair;
_fs2p_location0 = _e91.first;
_fs2p_location1 = _e91.second;
return;
}
