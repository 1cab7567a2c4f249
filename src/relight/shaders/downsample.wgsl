// Area resampling of a light image to the light plane, along one axis: columns first, then rows. Each target pixel is
// the mean of the source pixels that it covers, weighted by the share of it that each covers.

struct DownsampleUniforms {
    // (1, 0) for columns, (0, 1) for rows.
    axis: vec2<i32>,
    // The target's size along the axis.
    size: i32,
}

// For columns the light image, in sRGB codes with straight alpha; for rows the linear result of the columns.
@group(0) @binding(10) var image: texture_2d<f32>;
@group(0) @binding(11) var<uniform> downsampling: DownsampleUniforms;

@fragment
fn downsample(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let axis = downsampling.axis;
    let size = downsampling.size;
    let pixel = vec2<i32>(position.xy);
    let across = pixel * (vec2<i32>(1) - axis);
    let count = along(axis, vec2<i32>(textureDimensions(image)));
    // In units of 1/(size · count), in which all edges are whole numbers: rounding loses no light.
    let cell_begin = along(axis, pixel) * count;
    let cell_end = cell_begin + count;
    let last = (cell_end - 1) / size;
    var sum = vec3<f32>(0.0);
    for (var i = cell_begin / size; i <= last; i++) {
        let texel = textureLoad(image, across + axis * i, 0);
        let overlap = min(cell_end, (i + 1) * size) - max(cell_begin, i * size);
        let weight = f32(overlap) / f32(count);
        if axis.x > 0 {
            sum += weight * texel.a * srgb_decode(texel.rgb);
        } else {
            sum += weight * texel.rgb;
        }
    }
    return vec4<f32>(sum, 0.0);
}

fn along(axis: vec2<i32>, value: vec2<i32>) -> i32 {
    return axis.x * value.x + axis.y * value.y;
}

// IEC 61966-2-1.
fn srgb_decode(code: vec3<f32>) -> vec3<f32> {
    let curve = pow((code + 0.055) / 1.055, vec3<f32>(2.4));
    return select(curve, code / 12.92, code <= vec3<f32>(0.04045));
}
