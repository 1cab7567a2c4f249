// Eight functions of the basis, which one pass correlates with the light.

struct BasisFunctionUniforms {
    // Two quads for each slot of the window.
    quads: array<vec4<f32>, 1024>,
}

@group(0) @binding(8) var<uniform> basis: BasisFunctionUniforms;

// The response of the eight functions at one window origin.
struct ResponseQuads {
    @location(0) first: vec4<f32>,
    @location(1) second: vec4<f32>,
}
