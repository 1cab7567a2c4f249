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
struct BasisFunctionUniforms {
vec4 quads[1024];
};
struct ResponseQuads {
vec4 first;
vec4 second;
};
struct ChannelUniforms {
vec4 weights;
};
uniform highp sampler2D _group_0_binding_5_fs;
layout(std140) uniform FrameUniforms_block_0Fragment { FrameUniforms _group_0_binding_7_fs; };
layout(std140) uniform BasisFunctionUniforms_block_1Fragment { BasisFunctionUniforms _group_0_binding_8_fs; };
layout(std140) uniform ChannelUniforms_block_2Fragment { ChannelUniforms _group_0_binding_9_fs; };
layout(location = 0) out vec4 _fs2p_location0;
layout(location = 1) out vec4 _fs2p_location1;
void main() {
vec4 position = gl_FragCoord;
ResponseQuads response = ResponseQuads(vec4(0.0), vec4(0.0));
int v = 0;
int u = 0;
int _e5 = _group_0_binding_7_fs.window;
ivec2 origin = (ivec2(position.xy) - ivec2(_e5));
int _e13 = _group_0_binding_7_fs.window;
ivec2 begin = min(max(-(origin), ivec2(0)), ivec2(_e13));
ivec2 plane = ivec2(uvec2(textureSize(_group_0_binding_5_fs, 0).xy));
int _e24 = _group_0_binding_7_fs.window;
ivec2 end = min(max((plane - origin), ivec2(0)), ivec2(_e24));
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
vec4 emission = texelFetch(_group_0_binding_5_fs, (origin + ivec2(_e44, _e45)), 0);
vec4 _e53 = _group_0_binding_9_fs.weights;
float value = dot(emission.xyz, _e53.xyz);
int _e56 = v;
int _e59 = _group_0_binding_7_fs.window;
int _e61 = u;
int slot = ((_e56 * _e59) + _e61);
vec4 _e64 = response.first;
vec4 _e70 = _group_0_binding_8_fs.quads[(2 * slot)];
response.first = (_e64 + (value * _e70));
vec4 _e74 = response.second;
vec4 _e82 = _group_0_binding_8_fs.quads[((2 * slot) + 1)];
response.second = (_e74 + (value * _e82));
}
}
}
}
ResponseQuads _e91 = response;
_fs2p_location0 = _e91.first;
_fs2p_location1 = _e91.second;
return;
}
