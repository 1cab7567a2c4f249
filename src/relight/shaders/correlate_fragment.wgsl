// The basis response by WebGL2, which has no compute shaders: C_k(o) = Σ_s v_k(s) p(o + s) for eight functions v_k and
// one channel p of the light. Each fragment is a window origin o; the first is (-window, -window).

struct ChannelUniforms {
    // 1 for the channel that is correlated, 0 for the others.
    weights: vec4<f32>,
}

@group(0) @binding(9) var<uniform> channel: ChannelUniforms;

@fragment
fn correlate(@builtin(position) position: vec4<f32>) -> ResponseQuads {
    // Rows of a texture are counted the same way in WebGL and WebGPU.
    let origin = vec2<i32>(position.xy) - frame.window;
    // The part of the window that lies on the light plane.
    let begin = clamp(-origin, vec2<i32>(0), vec2<i32>(frame.window));
    let plane = vec2<i32>(textureDimensions(light));
    let end = clamp(plane - origin, vec2<i32>(0), vec2<i32>(frame.window));
    var response = ResponseQuads(vec4<f32>(0.0), vec4<f32>(0.0));
    for (var v = begin.y; v < end.y; v++) {
        for (var u = begin.x; u < end.x; u++) {
            let emission = textureLoad(light, origin + vec2<i32>(u, v), 0);
            let value = dot(emission.rgb, channel.weights.rgb);
            let slot = v * frame.window + u;
            response.first += value * basis.quads[2 * slot];
            response.second += value * basis.quads[2 * slot + 1];
        }
    }
    return response;
}
