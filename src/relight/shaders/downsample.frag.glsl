#version 300 es
// Translated from WGSL by tests/shaders.rs; do not edit.
precision highp float;
precision highp int;
struct DownsampleUniforms {
ivec2 axis;
int size;
};
uniform highp sampler2D _group_0_binding_10_fs;
layout(std140) uniform DownsampleUniforms_block_0Fragment { DownsampleUniforms _group_0_binding_11_fs; };
layout(location = 0) out vec4 _fs2p_location0;
int along(ivec2 axis, ivec2 value) {
return ((axis.x * value.x) + (axis.y * value.y));
}
vec3 srgb_decode(vec3 code) {
vec3 curve = pow(((code + vec3(0.055)) / vec3(1.055)), vec3(2.4));
return mix(curve, (code / vec3(12.92)), lessThanEqual(code, vec3(0.04045)));
}
void main() {
vec4 position = gl_FragCoord;
vec3 sum = vec3(0.0);
int i = 0;
ivec2 axis_1 = _group_0_binding_11_fs.axis;
int size = _group_0_binding_11_fs.size;
ivec2 pixel = ivec2(position.xy);
ivec2 across = (pixel * (ivec2(1) - axis_1));
int _e16 = along(axis_1, ivec2(uvec2(textureSize(_group_0_binding_10_fs, 0).xy)));
int _e17 = along(axis_1, pixel);
int cell_begin = (_e17 * _e16);
int cell_end = (cell_begin + _e16);
int last = ((cell_end - 1) / size);
i = (cell_begin / size);
bool loop_init = true;
while(true) {
if (!loop_init) {
int _e63 = i;
i = (_e63 + 1);
}
loop_init = false;
int _e28 = i;
if ((_e28 <= last)) {
} else {
break;
}
{
int _e31 = i;
vec4 texel = texelFetch(_group_0_binding_10_fs, (across + (axis_1 * _e31)), 0);
int _e36 = i;
int _e41 = i;
int overlap = (min(cell_end, ((_e36 + 1) * size)) - max(cell_begin, (_e41 * size)));
float weight = (float(overlap) / float(_e16));
if ((axis_1.x > 0)) {
vec3 _e51 = sum;
vec3 _e55 = srgb_decode(texel.xyz);
sum = (_e51 + ((weight * texel.w) * _e55));
} else {
vec3 _e58 = sum;
sum = (_e58 + (weight * texel.xyz));
}
}
}
vec3 _e65 = sum;
_fs2p_location0 = vec4(_e65, 0.0);
return;
}
