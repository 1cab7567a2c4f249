// What several passes of a frame read: the light and the uniforms. The Rust side is texture_layout/.

struct FrameUniforms {
    // From the photograph's linear RGB to that of the canvas's gamut, row by row, with exposure and white balance.
    output_matrix: array<vec4<f32>, 3>,
    // Each channel of a light of uniform chroma, relative to its base channel; else 1.
    chroma: vec4<f32>,
    // 1 for the base channel of a light of uniform chroma, 0 for the others.
    base_channel: vec4<f32>,
    // Light elements along a window's side.
    window: i32,
    // Camera pixels along a tile's side.
    tile_side: i32,
    // Quads of components in use; 0 if no tile is factored.
    used_quads: i32,
    // Layers from one channel of the coefficients to the next.
    coefficient_stride: i32,
    // Layers from one channel of the basis response to the next; 0 for a light of uniform chroma, with one channel.
    response_stride: i32,
    // 1 for the filmic tone curve, 0 for none.
    filmic: i32,
    // 1 to dither.
    dither: i32,
}

// Linear emission of each light element.
@group(0) @binding(5) var light: texture_2d<f32>;
@group(0) @binding(7) var<uniform> frame: FrameUniforms;
