// The vertex shader of all passes: one triangle that covers the target.

struct FullscreenVertex {
    @builtin(position) clip: vec4<f32>,
    // Position in the target, 0 to 1, y down. Fragment coordinates would not do: WebGPU counts rows from the top and
    // WebGL from the bottom.
    @location(0) position: vec2<f32>,
}

// Vertices (0, 0), (2, 0) and (0, 2): twice the target's size.
@vertex
fn fullscreen(@builtin(vertex_index) vertex: u32) -> FullscreenVertex {
    let position = vec2<f32>(f32(vertex & 1u), f32(vertex >> 1u)) * 2.0;
    let clip = vec2<f32>(2.0 * position.x - 1.0, 1.0 - 2.0 * position.y);
    return FullscreenVertex(vec4<f32>(clip, 0.0, 1.0), position);
}
