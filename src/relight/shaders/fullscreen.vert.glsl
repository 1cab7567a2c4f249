#version 300 es
// Translated from WGSL by tests/shaders.rs; do not edit.
precision highp float;
precision highp int;
struct FullscreenVertex {
vec4 clip;
vec2 position;
};
smooth out vec2 _vs2fs_location0;
void main() {
uint vertex = uint(gl_VertexID);
vec2 position = (vec2(float((vertex & 1u)), float((vertex >> 1u))) * 2.0);
vec2 clip = vec2(((2.0 * position.x) - 1.0), (1.0 - (2.0 * position.y)));
FullscreenVertex _tmp_return = FullscreenVertex(vec4(clip, 0.0, 1.0), position);
gl_Position = _tmp_return.clip;
_vs2fs_location0 = _tmp_return.position;
return;
}
