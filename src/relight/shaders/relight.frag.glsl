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
uniform highp isampler2DArray _group_0_binding_0_fs;

uniform highp sampler2DArray _group_0_binding_1_fs;

uniform highp isampler2DArray _group_0_binding_2_fs;

uniform highp isampler2D _group_0_binding_3_fs;

uniform highp sampler2D _group_0_binding_4_fs;

uniform highp sampler2D _group_0_binding_5_fs;

layout(std140) uniform Params_block_0Fragment { Params _group_0_binding_6_fs; };

smooth in vec2 _vs2fs_location0;
layout(location = 0) out vec4 _fs2p_location0;

vec3 combined(ivec2 at_1, ivec2 origin) {
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
        int _e10 = _group_0_binding_6_fs.quads;
        if ((_e7 < _e10)) {
        } else {
            break;
        }
        {
            int _e13 = q;
            vec4 red = texelFetch(_group_0_binding_1_fs, ivec3(origin, _e13), 0);
            green = red;
            blue = red;
            int _e20 = _group_0_binding_6_fs.seen_quads;
            if ((_e20 > 0)) {
                int _e24 = q;
                int _e27 = _group_0_binding_6_fs.seen_quads;
                vec4 _e30 = texelFetch(_group_0_binding_1_fs, ivec3(origin, (_e24 + _e27)), 0);
                green = _e30;
                int _e32 = q;
                int _e35 = _group_0_binding_6_fs.seen_quads;
                vec4 _e40 = texelFetch(_group_0_binding_1_fs, ivec3(origin, (_e32 + (2 * _e35))), 0);
                blue = _e40;
            }
            vec3 _e41 = sum;
            int _e43 = q;
            ivec4 _e45 = texelFetch(_group_0_binding_0_fs, ivec3(at_1, _e43), 0);
            int _e49 = q;
            int _e52 = _group_0_binding_6_fs.quads;
            ivec4 _e55 = texelFetch(_group_0_binding_0_fs, ivec3(at_1, (_e49 + _e52)), 0);
            vec4 _e57 = green;
            int _e60 = q;
            int _e63 = _group_0_binding_6_fs.quads;
            ivec4 _e68 = texelFetch(_group_0_binding_0_fs, ivec3(at_1, (_e60 + (2 * _e63))), 0);
            vec4 _e70 = blue;
            sum = (_e41 + vec3(dot(vec4(_e45), red), dot(vec4(_e55), _e57), dot(vec4(_e68), _e70)));
        }
    }
    vec3 _e77 = sum;
    return _e77;
}

vec3 windowed_sum(ivec2 origin_1, int first_code) {
    vec3 sum_1 = vec3(0.0);
    int v_1 = 0;
    ivec2 texel = ivec2(0);
    int layer = 0;
    int u_1 = 0;
    ivec2 fold = ivec2(uvec2(textureSize(_group_0_binding_2_fs, 0).xy));
    int _e10 = _group_0_binding_6_fs.window;
    ivec2 begin = min(max(-(origin_1), ivec2(0)), ivec2(_e10));
    ivec2 display = ivec2(uvec2(textureSize(_group_0_binding_5_fs, 0).xy));
    int _e21 = _group_0_binding_6_fs.window;
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
            int _e35 = _group_0_binding_6_fs.window;
            int code = ((first_code + (_e32 * _e35)) + begin.x);
            int line = (code / fold.x);
            texel = ivec2((code % fold.x), (line % fold.y));
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
                    vec3 _e63 = sum_1;
                    ivec2 _e65 = texel;
                    int _e66 = layer;
                    ivec4 _e68 = texelFetch(_group_0_binding_2_fs, ivec3(_e65, _e66), 0);
                    sum_1 = (_e63 + (vec3(_e68.xyz) * emitted.xyz));
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
    vec3 _e103 = sum_1;
    return _e103;
}

vec3 srgb_encode(vec3 linear_1) {
    vec3 y = clamp(linear_1, vec3(0.0), vec3(1.0));
    vec3 curve = ((1.055 * pow(y, vec3(0.41666666))) - vec3(0.055));
    return mix(curve, (12.92 * y), lessThanEqual(y, vec3(0.0031308)));
}

void main() {
    Covering in_ = Covering(gl_FragCoord, _vs2fs_location0);
    vec3 linear = vec3(0.0);
    ivec2 camera = ivec2(uvec2(textureSize(_group_0_binding_3_fs, 0).xy));
    ivec2 at_2 = min(max(ivec2((in_.picture * vec2(camera))), ivec2(0)), (camera - ivec2(1)));
    ivec4 pixel = texelFetch(_group_0_binding_3_fs, at_2, 0);
    ivec2 grid = (ivec2(uvec2(textureSize(_group_0_binding_4_fs, 0).xy)) / ivec2(1, 2));
    ivec2 tile = ivec2((pixel.w % grid.x), (pixel.w / grid.x));
    int _e36 = _group_0_binding_6_fs.quads;
    if ((_e36 > 0)) {
        vec4 step_ = texelFetch(_group_0_binding_4_fs, tile, 0);
        vec3 _e42 = linear;
        vec4 _e46 = _group_0_binding_6_fs.tint;
        int _e52 = _group_0_binding_6_fs.window;
        vec3 _e55 = combined(at_2, (pixel.xy + ivec2(_e52)));
        linear = (_e42 + ((step_.xyz * _e46.xyz) * _e55));
    }
    if ((pixel.z >= 0)) {
        vec4 step_1 = texelFetch(_group_0_binding_4_fs, (tile + ivec2(0, grid.y)), 0);
        vec3 _e68 = linear;
        vec3 _e72 = windowed_sum(pixel.xy, pixel.z);
        linear = (_e68 + (step_1.xyz * _e72));
    }
    float _e77 = _group_0_binding_6_fs.exposure;
    vec3 _e78 = linear;
    vec3 _e80 = srgb_encode((_e77 * _e78));
    _fs2p_location0 = vec4(_e80, 1.0);
    return;
}

