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
uniform highp sampler2D _group_0_binding_5_fs;

layout(std140) uniform Params_block_0Fragment { Params _group_0_binding_6_fs; };

layout(std140) uniform Basis_block_1Fragment { Basis _group_0_binding_7_fs; };

layout(std140) uniform Channel_block_2Fragment { Channel _group_0_binding_8_fs; };

layout(location = 0) out vec4 _fs2p_location0;
layout(location = 1) out vec4 _fs2p_location1;

vec3 srgb_encode(vec3 linear_1) {
    vec3 y = clamp(linear_1, vec3(0.0), vec3(1.0));
    vec3 curve = ((1.055 * pow(y, vec3(0.41666666))) - vec3(0.055));
    return mix(curve, (12.92 * y), lessThanEqual(y, vec3(0.0031308)));
}

void main() {
    vec4 at = gl_FragCoord;
    Pair pair = Pair(vec4(0.0), vec4(0.0));
    int v = 0;
    int u = 0;
    int _e5 = _group_0_binding_6_fs.window;
    ivec2 origin_2 = (ivec2(at.xy) - ivec2(_e5));
    int _e13 = _group_0_binding_6_fs.window;
    ivec2 begin = min(max(-(origin_2), ivec2(0)), ivec2(_e13));
    ivec2 display = ivec2(uvec2(textureSize(_group_0_binding_5_fs, 0).xy));
    int _e24 = _group_0_binding_6_fs.window;
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
                    vec4 _e53 = _group_0_binding_8_fs.share;
                    float one = dot(emitted.xyz, _e53.xyz);
                    int _e56 = v;
                    int _e59 = _group_0_binding_6_fs.window;
                    int _e61 = u;
                    int slot = ((_e56 * _e59) + _e61);
                    vec4 _e64 = pair.first;
                    vec4 _e70 = _group_0_binding_7_fs.quads[(2 * slot)];
                    pair.first = (_e64 + (one * _e70));
                    vec4 _e74 = pair.second;
                    vec4 _e82 = _group_0_binding_7_fs.quads[((2 * slot) + 1)];
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

