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
uniform highp isampler2DArray _group_0_binding_0_fs;
uniform highp sampler2DArray _group_0_binding_1_fs;
uniform highp isampler2DArray _group_0_binding_2_fs;
uniform highp isampler2D _group_0_binding_3_fs;
uniform highp sampler2D _group_0_binding_4_fs;
uniform highp sampler2D _group_0_binding_5_fs;
uniform highp isampler2D _group_0_binding_6_fs;
layout(std140) uniform Params_block_0Fragment { Params _group_0_binding_7_fs; };
smooth in vec2 _vs2fs_location0;
layout(location = 0) out vec4 _fs2p_location0;
vec3 srgb_decode(vec3 code) {
vec3 curve = pow(((code + vec3(0.055)) / vec3(1.055)), vec3(2.4));
return mix(curve, (code / vec3(12.92)), lessThanEqual(code, vec3(0.04045)));
}
vec3 combined(ivec2 at_3, ivec2 origin) {
vec3 sum_2 = vec3(0.0);
int q = 0;
vec4 green = vec4(0.0);
vec4 blue = vec4(0.0);
bool loop_init = true;
while(true) {
if (!loop_init) {
int _e75 = q;
q = (_e75 + 1);
}
loop_init = false;
int _e7 = q;
int _e10 = _group_0_binding_7_fs.quads;
if ((_e7 < _e10)) {
} else {
break;
}
{
int _e13 = q;
vec4 red = texelFetch(_group_0_binding_1_fs, ivec3(origin, _e13), 0);
green = red;
blue = red;
int _e20 = _group_0_binding_7_fs.seen_quads;
if ((_e20 > 0)) {
int _e24 = q;
int _e27 = _group_0_binding_7_fs.seen_quads;
vec4 _e30 = texelFetch(_group_0_binding_1_fs, ivec3(origin, (_e24 + _e27)), 0);
green = _e30;
int _e32 = q;
int _e35 = _group_0_binding_7_fs.seen_quads;
vec4 _e40 = texelFetch(_group_0_binding_1_fs, ivec3(origin, (_e32 + (2 * _e35))), 0);
blue = _e40;
}
vec3 _e41 = sum_2;
int _e43 = q;
ivec4 _e45 = texelFetch(_group_0_binding_0_fs, ivec3(at_3, _e43), 0);
int _e49 = q;
int _e52 = _group_0_binding_7_fs.channel_quads;
ivec4 _e55 = texelFetch(_group_0_binding_0_fs, ivec3(at_3, (_e49 + _e52)), 0);
vec4 _e57 = green;
int _e60 = q;
int _e63 = _group_0_binding_7_fs.channel_quads;
ivec4 _e68 = texelFetch(_group_0_binding_0_fs, ivec3(at_3, (_e60 + (2 * _e63))), 0);
vec4 _e70 = blue;
sum_2 = (_e41 + vec3(dot(vec4(_e45), red), dot(vec4(_e55), _e57), dot(vec4(_e68), _e70)));
}
}
vec3 _e77 = sum_2;
return _e77;
}
vec3 windowed_sum(ivec2 origin_1, int first_code) {
vec3 sum_3 = vec3(0.0);
int v_1 = 0;
ivec2 texel = ivec2(0);
int layer = 0;
int u_1 = 0;
ivec2 fold = ivec2(uvec2(textureSize(_group_0_binding_2_fs, 0).xy));
int _e10 = _group_0_binding_7_fs.window;
ivec2 begin = min(max(-(origin_1), ivec2(0)), ivec2(_e10));
ivec2 display = ivec2(uvec2(textureSize(_group_0_binding_5_fs, 0).xy));
int _e21 = _group_0_binding_7_fs.window;
ivec2 end = min(max((display - origin_1), ivec2(0)), ivec2(_e21));
v_1 = begin.y;
bool loop_init_1 = true;
while(true) {
if (!loop_init_1) {
int _e101 = v_1;
v_1 = (_e101 + 1);
}
loop_init_1 = false;
int _e29 = v_1;
if ((_e29 < end.y)) {
} else {
break;
}
{
int _e32 = v_1;
int _e35 = _group_0_binding_7_fs.window;
int code_1 = ((first_code + (_e32 * _e35)) + begin.x);
int line = (code_1 / fold.x);
texel = ivec2((code_1 % fold.x), (line % fold.y));
layer = (line / fold.y);
u_1 = begin.x;
bool loop_init_2 = true;
while(true) {
if (!loop_init_2) {
int _e98 = u_1;
u_1 = (_e98 + 1);
}
loop_init_2 = false;
int _e53 = u_1;
if ((_e53 < end.x)) {
} else {
break;
}
{
int _e57 = u_1;
int _e58 = v_1;
vec4 emitted = texelFetch(_group_0_binding_5_fs, (origin_1 + ivec2(_e57, _e58)), 0);
vec3 _e63 = sum_3;
ivec2 _e65 = texel;
int _e66 = layer;
ivec4 _e68 = texelFetch(_group_0_binding_2_fs, ivec3(_e65, _e66), 0);
sum_3 = (_e63 + (vec3(_e68.xyz) * emitted.xyz));
int _e76 = texel.x;
texel.x = (_e76 + 1);
int _e79 = texel.x;
if ((_e79 == fold.x)) {
int _e83 = texel.y;
texel = ivec2(0, (_e83 + 1));
int _e89 = texel.y;
if ((_e89 == fold.y)) {
texel.y = 0;
int _e95 = layer;
layer = (_e95 + 1);
}
}
}
}
}
}
vec3 _e103 = sum_3;
return _e103;
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
Covering in_ = Covering(gl_FragCoord, _vs2fs_location0);
vec3 linear = vec3(0.0);
ivec2 camera = ivec2(uvec2(textureSize(_group_0_binding_3_fs, 0).xy));
ivec2 at_6 = min(max(ivec2((in_.picture * vec2(camera))), ivec2(0)), (camera - ivec2(1)));
ivec4 _e16 = texelFetch(_group_0_binding_3_fs, at_6, 0);
ivec2 origin_2 = _e16.xy;
int _e20 = _group_0_binding_7_fs.tile_side;
ivec2 tile = (at_6 / ivec2(_e20));
int _e28 = _group_0_binding_7_fs.quads;
if ((_e28 > 0)) {
vec4 step_ = texelFetch(_group_0_binding_4_fs, tile, 0);
vec3 _e34 = linear;
vec4 _e38 = _group_0_binding_7_fs.tint;
int _e43 = _group_0_binding_7_fs.window;
vec3 _e46 = combined(at_6, (origin_2 + ivec2(_e43)));
linear = (_e34 + ((step_.xyz * _e38.xyz) * _e46));
}
ivec4 first = texelFetch(_group_0_binding_6_fs, tile, 0);
if ((first.x >= 0)) {
ivec2 in_tile = (at_6 - first.yz);
int pixel = ((in_tile.y * first.w) + in_tile.x);
ivec2 below_1 = ivec2(0, (int(uvec2(textureSize(_group_0_binding_4_fs, 0).xy).y) / 2));
vec4 step_1 = texelFetch(_group_0_binding_4_fs, (tile + below_1), 0);
int _e77 = _group_0_binding_7_fs.window;
int _e81 = _group_0_binding_7_fs.window;
int code_2 = (first.x + ((pixel * _e77) * _e81));
vec3 _e84 = linear;
vec3 _e86 = windowed_sum(origin_2, code_2);
linear = (_e84 + (step_1.xyz * _e86));
}
vec3 _e89 = linear;
vec3 _e90 = shown(_e89, at_6);
_fs2p_location0 = vec4(_e90, 1.0);
return;
}
