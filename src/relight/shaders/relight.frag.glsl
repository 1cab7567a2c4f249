#version 300 es
// Translated from WGSL by tests/shaders.rs; do not edit.
precision highp float;
precision highp int;
struct FrameUniforms {
vec4 output_matrix[3];
vec4 chroma;
vec4 base_channel;
int window;
int tile_side;
int used_quads;
int coefficient_stride;
int response_stride;
int filmic;
int dither;
};
uniform highp sampler2D _group_0_binding_5_fs;
layout(std140) uniform FrameUniforms_block_0Fragment { FrameUniforms _group_0_binding_7_fs; };
uniform highp isampler2DArray _group_0_binding_0_fs;
uniform highp sampler2DArray _group_0_binding_1_fs;
uniform highp isampler2DArray _group_0_binding_2_fs;
uniform highp isampler2D _group_0_binding_3_fs;
uniform highp sampler2D _group_0_binding_4_fs;
uniform highp isampler2D _group_0_binding_6_fs;
smooth in vec2 _vs2fs_location0;
layout(location = 0) out vec4 _fs2p_location0;
vec3 factored_sum(ivec2 pixel, ivec2 at) {
vec3 sum = vec3(0.0);
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
int _e10 = _group_0_binding_7_fs.used_quads;
if ((_e7 < _e10)) {
} else {
break;
}
{
int _e13 = q;
vec4 red = texelFetch(_group_0_binding_1_fs, ivec3(at, _e13), 0);
green = red;
blue = red;
int _e20 = _group_0_binding_7_fs.response_stride;
if ((_e20 > 0)) {
int _e24 = q;
int _e27 = _group_0_binding_7_fs.response_stride;
vec4 _e30 = texelFetch(_group_0_binding_1_fs, ivec3(at, (_e24 + _e27)), 0);
green = _e30;
int _e32 = q;
int _e35 = _group_0_binding_7_fs.response_stride;
vec4 _e40 = texelFetch(_group_0_binding_1_fs, ivec3(at, (_e32 + (2 * _e35))), 0);
blue = _e40;
}
vec3 _e41 = sum;
int _e43 = q;
ivec4 _e45 = texelFetch(_group_0_binding_0_fs, ivec3(pixel, _e43), 0);
int _e49 = q;
int _e52 = _group_0_binding_7_fs.coefficient_stride;
ivec4 _e55 = texelFetch(_group_0_binding_0_fs, ivec3(pixel, (_e49 + _e52)), 0);
vec4 _e57 = green;
int _e60 = q;
int _e63 = _group_0_binding_7_fs.coefficient_stride;
ivec4 _e68 = texelFetch(_group_0_binding_0_fs, ivec3(pixel, (_e60 + (2 * _e63))), 0);
vec4 _e70 = blue;
sum = (_e41 + vec3(dot(vec4(_e45), red), dot(vec4(_e55), _e57), dot(vec4(_e68), _e70)));
}
}
vec3 _e77 = sum;
return _e77;
}
vec3 windowed_sum(ivec2 origin, ivec2 range) {
ivec2 texel = ivec2(0);
int layer = 0;
vec3 sum_1 = vec3(0.0);
int i = 0;
bool local = false;
ivec2 fold = ivec2(uvec2(textureSize(_group_0_binding_2_fs, 0).xy));
ivec2 plane = ivec2(uvec2(textureSize(_group_0_binding_5_fs, 0).xy));
int line = (range.x / fold.x);
texel = ivec2((range.x % fold.x), (line % fold.y));
layer = (line / fold.y);
i = range.x;
bool loop_init_1 = true;
while(true) {
if (!loop_init_1) {
int _e90 = i;
i = (_e90 + 1);
}
loop_init_1 = false;
int _e26 = i;
if ((_e26 < range.y)) {
} else {
break;
}
{
ivec2 _e30 = texel;
int _e31 = layer;
ivec4 code = texelFetch(_group_0_binding_2_fs, ivec3(_e30, _e31), 0);
int slot = (code.w & 4095);
int _e39 = _group_0_binding_7_fs.window;
int _e43 = _group_0_binding_7_fs.window;
ivec2 element = (origin + ivec2((slot % _e39), (slot / _e43)));
if (all(greaterThanEqual(element, ivec2(0)))) {
local = all(lessThan(element, plane));
} else {
local = false;
}
bool _e56 = local;
if (_e56) {
vec3 _e57 = sum_1;
vec4 _e62 = texelFetch(_group_0_binding_5_fs, element, 0);
sum_1 = (_e57 + (vec3(code.xyz) * _e62.xyz));
}
int _e68 = texel.x;
texel.x = (_e68 + 1);
int _e71 = texel.x;
if ((_e71 == fold.x)) {
int _e75 = texel.y;
texel = ivec2(0, (_e75 + 1));
int _e81 = texel.y;
if ((_e81 == fold.y)) {
texel.y = 0;
int _e87 = layer;
layer = (_e87 + 1);
}
}
}
}
vec3 _e92 = sum_1;
return _e92;
}
vec3 hable(vec3 x) {
vec3 above = ((x * ((0.15 * x) + vec3(0.05))) + vec3(0.004));
vec3 below = ((x * ((0.15 * x) + vec3(0.5))) + vec3(0.06));
return ((above / below) - vec3(0.06666667));
}
int bayer(ivec2 pixel_1) {
ivec2 n = ivec2((pixel_1.x ^ pixel_1.y), pixel_1.y);
ivec2 bits = ((((n & ivec2(1)) << uvec2(4u)) | ((n & ivec2(2)) << uvec2(1u))) | ((n & ivec2(4)) >> uvec2(2u)));
return ((bits.x << 1u) | bits.y);
}
vec3 output_transform(vec3 linear_1, ivec2 pixel_2) {
vec3 y = vec3(0.0);
vec3 encoded = vec3(0.0);
vec4 _e5 = _group_0_binding_7_fs.output_matrix[0];
vec4 _e11 = _group_0_binding_7_fs.output_matrix[1];
vec4 _e17 = _group_0_binding_7_fs.output_matrix[2];
vec3 exposed = vec3(dot(_e5.xyz, linear_1), dot(_e11.xyz, linear_1), dot(_e17.xyz, linear_1));
y = clamp(exposed, vec3(0.0), vec3(1.0));
int _e29 = _group_0_binding_7_fs.filmic;
if ((_e29 > 0)) {
vec3 _e39 = hable((2.0 * clamp(exposed, vec3(0.0), vec3(5.6))));
vec3 _e42 = hable(vec3(11.2));
y = clamp((_e39 / _e42), vec3(0.0), vec3(1.0));
}
vec3 _e49 = y;
vec3 curve = ((1.055 * pow(_e49, vec3(0.41666666))) - vec3(0.055));
vec3 _e58 = y;
vec3 _e61 = y;
encoded = mix(curve, (12.92 * _e58), lessThanEqual(_e61, vec3(0.0031308)));
int _e69 = _group_0_binding_7_fs.dither;
if ((_e69 > 0)) {
vec3 _e72 = encoded;
int _e73 = bayer(pixel_2);
encoded = (_e72 + vec3(((((float(_e73) + 0.5) / 64.0) - 0.5) / 255.0)));
}
vec3 _e85 = encoded;
return _e85;
}
void main() {
vec2 position = _vs2fs_location0;
vec3 linear = vec3(0.0);
ivec2 camera = ivec2(uvec2(textureSize(_group_0_binding_3_fs, 0).xy));
ivec2 pixel_3 = min(max(ivec2((position * vec2(camera))), ivec2(0)), (camera - ivec2(1)));
ivec4 _e15 = texelFetch(_group_0_binding_3_fs, pixel_3, 0);
ivec2 origin_1 = _e15.xy;
int _e19 = _group_0_binding_7_fs.tile_side;
ivec2 tile = (pixel_3 / ivec2(_e19));
int _e27 = _group_0_binding_7_fs.used_quads;
if ((_e27 > 0)) {
vec4 step_ = texelFetch(_group_0_binding_4_fs, tile, 0);
vec3 _e33 = linear;
vec4 _e37 = _group_0_binding_7_fs.chroma;
int _e42 = _group_0_binding_7_fs.window;
vec3 _e45 = factored_sum(pixel_3, (origin_1 + ivec2(_e42)));
linear = (_e33 + ((step_.xyz * _e37.xyz) * _e45));
}
ivec4 _e57 = texelFetch(_group_0_binding_6_fs, min(pixel_3, (ivec2(uvec2(textureSize(_group_0_binding_6_fs, 0).xy)) - ivec2(1))), 0);
ivec2 range_1 = _e57.xy;
if ((range_1.x < range_1.y)) {
ivec2 below_1 = ivec2(0, (int(uvec2(textureSize(_group_0_binding_4_fs, 0).xy).y) / 2));
vec3 _e70 = linear;
vec4 _e74 = texelFetch(_group_0_binding_4_fs, (tile + below_1), 0);
vec3 _e76 = windowed_sum(origin_1, range_1);
linear = (_e70 + (_e74.xyz * _e76));
}
vec3 _e79 = linear;
vec3 _e80 = output_transform(_e79, pixel_3);
_fs2p_location0 = vec4(_e80, 1.0);
return;
}
