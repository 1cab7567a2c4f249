#version 300 es
// naga made this of relight.wgsl: change that one.

precision highp float;
precision highp int;

struct Params {
    int window;
    float exposure;
    vec2 reserved;
};
struct Covering {
    vec4 clip;
    vec2 picture;
};
uniform highp isampler2DArray _group_0_binding_0_fs;

uniform highp isampler2D _group_0_binding_1_fs;

uniform highp sampler2D _group_0_binding_2_fs;

uniform highp sampler2D _group_0_binding_3_fs;

layout(std140) uniform Params_block_0Fragment { Params _group_0_binding_4_fs; };

smooth in vec2 _vs2fs_location0;
layout(location = 0) out vec4 _fs2p_location0;

vec3 windowed_sum(ivec2 origin, int first_code) {
    vec3 sum = vec3(0.0);
    int v = 0;
    ivec2 texel = ivec2(0);
    int layer = 0;
    int u = 0;
    ivec2 fold = ivec2(uvec2(textureSize(_group_0_binding_0_fs, 0).xy));
    int _e10 = _group_0_binding_4_fs.window;
    ivec2 begin = min(max(-(origin), ivec2(0)), ivec2(_e10));
    ivec2 display = ivec2(uvec2(textureSize(_group_0_binding_3_fs, 0).xy));
    int _e21 = _group_0_binding_4_fs.window;
    ivec2 end = min(max((display - origin), ivec2(0)), ivec2(_e21));
    v = begin.y;
    bool loop_init = true;
    while(true) {
        if (!loop_init) {
            int _e101 = v;
            v = (_e101 + 1);
        }
        loop_init = false;
        int _e29 = v;
        if ((_e29 < end.y)) {
        } else {
            break;
        }
        {
            int _e32 = v;
            int _e35 = _group_0_binding_4_fs.window;
            int code = ((first_code + (_e32 * _e35)) + begin.x);
            int line = (code / fold.x);
            texel = ivec2((code % fold.x), (line % fold.y));
            layer = (line / fold.y);
            u = begin.x;
            bool loop_init_1 = true;
            while(true) {
                if (!loop_init_1) {
                    int _e98 = u;
                    u = (_e98 + 1);
                }
                loop_init_1 = false;
                int _e53 = u;
                if ((_e53 < end.x)) {
                } else {
                    break;
                }
                {
                    int _e57 = u;
                    int _e58 = v;
                    vec4 emitted = texelFetch(_group_0_binding_3_fs, (origin + ivec2(_e57, _e58)), 0);
                    vec3 _e63 = sum;
                    ivec2 _e65 = texel;
                    int _e66 = layer;
                    ivec4 _e68 = texelFetch(_group_0_binding_0_fs, ivec3(_e65, _e66), 0);
                    sum = (_e63 + (vec3(_e68.xyz) * emitted.xyz));
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
    vec3 _e103 = sum;
    return _e103;
}

vec3 srgb_encode(vec3 linear) {
    vec3 y = clamp(linear, vec3(0.0), vec3(1.0));
    vec3 curve = ((1.055 * pow(y, vec3(0.41666666))) - vec3(0.055));
    return mix(curve, (12.92 * y), lessThanEqual(y, vec3(0.0031308)));
}

void main() {
    Covering in_ = Covering(gl_FragCoord, _vs2fs_location0);
    ivec2 camera = ivec2(uvec2(textureSize(_group_0_binding_1_fs, 0).xy));
    ivec2 at = min(max(ivec2((in_.picture * vec2(camera))), ivec2(0)), (camera - ivec2(1)));
    ivec4 pixel = texelFetch(_group_0_binding_1_fs, at, 0);
    int tiles_across = int(uvec2(textureSize(_group_0_binding_2_fs, 0).xy).x);
    vec4 step_ = texelFetch(_group_0_binding_2_fs, ivec2((pixel.w % tiles_across), (pixel.w / tiles_across)), 0);
    float _e31 = _group_0_binding_4_fs.exposure;
    vec3 _e35 = windowed_sum(pixel.xy, pixel.z);
    vec3 linear_1 = (_e31 * (step_.xyz * _e35));
    vec3 _e38 = srgb_encode(linear_1);
    _fs2p_location0 = vec4(_e38, 1.0);
    return;
}

