//! Textures checked texel by texel against the rules that the shaders read them by.

use super::*;
use crate::transport::{
    Basis, CameraPixel, Correspondence, FunctionCodes, Tile, Window, end_pixel, entry_slot,
};

const WEBGL2_MINIMUM: TextureLimits = TextureLimits {
    max_side: 2048,
    max_layers: 256,
};

fn geometry(camera: (u32, u32), window: u32) -> Geometry {
    Geometry {
        camera: Extent::new(camera.0, camera.1),
        light: Extent::new(20, 10),
        window: Window::new(window).unwrap(),
        correspondence: Correspondence::from_affine([[0.12, 0.0, -0.75], [0.0, 0.06, 1.0]]),
        tile_side: 16,
    }
}

/// The slots of a pixel that have codes: none of every fifth pixel.
fn slots(pixel: CameraPixel, area: usize) -> impl Iterator<Item = usize> {
    let first = (pixel.x % 5) as usize;
    (first..area)
        .step_by(7)
        .skip(if first == 4 { area } else { 0 })
}

/// Codes that name their pixel and slot, or their pixel, channel and quad. Every third tile has no functions, every
/// fourth no coefficients.
fn transport(geometry: Geometry, rank: usize) -> Transport {
    let area = geometry.window.area();
    let tiles = geometry.tiles().enumerate().map(|(i, rect)| {
        let mut tile = Tile::dark(rect);
        tile.functions.step = [1.0, 2.0, rect.x as f32];
        if i % 3 != 2 {
            let entries = &mut tile.functions.entries;
            for pixel in rect.pixels() {
                for s in slots(pixel, area) {
                    entries.push([pixel.x as i16, pixel.y as i16, s as i16 + 1, s as i16]);
                }
                end_pixel(entries);
            }
        }
        if i % 4 != 3 && rank > 0 {
            let plane = Tile::plane(rect);
            let mut codes = vec![[0; 4]; Tile::texels(rect, rank)];
            for (i, codes) in codes.chunks_exact_mut(plane).enumerate() {
                for (p, code) in rect.pixels().zip(codes) {
                    *code = [p.x as i16, p.y as i16, i as i16, 7];
                }
            }
            tile.coefficients.codes = codes;
        }
        tile
    });
    Transport {
        geometry,
        basis: Basis {
            kernels: vec![vec![1.0; area]; rank],
        },
        tiles: tiles.collect(),
    }
}

#[test]
fn each_code_is_where_the_shader_reads_it() {
    // In the first case the texels fill more than one layer.
    let small = TextureLimits {
        max_side: 160,
        max_layers: 32,
    };
    for (camera, window, limits) in [
        ((150, 141), 15, small),
        ((37, 23), 3, WEBGL2_MINIMUM),
        ((8, 1), 1, WEBGL2_MINIMUM),
    ] {
        let geometry = geometry(camera, window);
        let transport = transport(geometry.clone(), 0);
        let layout = TextureLayout::new(&transport, limits).unwrap();
        let TextureDescriptor { extent, layers, .. } = layout.textures[binding::CODES];
        let mut texture: Vec<[i16; 4]> = Vec::new();
        layout
            .for_each_code_region(&transport, &mut |region| {
                let [column, row, layer] = region.origin;
                let before = layer as usize * extent.area();
                assert_eq!(texture.len(), before + (row * extent.width) as usize);
                assert_eq!((column, region.extent.width), (0, extent.width));
                assert_eq!(region.texels.len(), 8 * region.extent.area());
                texture.extend_from_slice(bytemuck::cast_slice(region.texels));
                Ok::<_, ()>(())
            })
            .unwrap();
        assert_eq!(texture.len(), extent.area() * layers.unwrap() as usize);
        assert_eq!(layers > Some(1), limits.max_side == 160);
        let mut ranges = vec![[0u32; 2]; geometry.camera.area()];
        let Ok(()) = layout.for_each_function_region(&transport, &mut |region| {
            assert_eq!(layout.textures[binding::FUNCTIONS].extent, geometry.camera);
            let [left, top, layer] = region.origin;
            assert_eq!((region.binding, layer), (binding::FUNCTIONS, 0));
            let texels: &[[u32; 2]] = bytemuck::cast_slice(region.texels);
            for ((x, y), range) in region.extent.cells().zip(texels) {
                ranges[((top + y) * camera.0 + left + x) as usize] = *range;
            }
            Ok::<_, std::convert::Infallible>(())
        });
        let origins = layout.origin_texels();
        let steps = layout.step_texels(&transport);
        for y in 0..camera.1 {
            for x in 0..camera.0 {
                let [u, v] = origins[(y * camera.0 + x) as usize].map(i32::from);
                let origin = geometry.window_origin(CameraPixel { x, y });
                assert_eq!((u, v), (origin.u, origin.v));
                let tile = (y / 16 * camera.0.div_ceil(16) + x / 16) as usize;
                let tiles = transport.tiles.len();
                assert_eq!(steps[tiles + tile][2], (x / 16 * 16) as f32);
                let pixel = CameraPixel { x, y };
                let [first, end] = ranges[(y * camera.0 + x) as usize];
                if transport.tiles[tile].functions.is_dark() {
                    assert_eq!(first, end);
                    continue;
                }
                let found = texture[first as usize..end as usize]
                    .iter()
                    .map(|entry| ([entry[0], entry[1], entry[2]], entry_slot(entry)));
                let (x, y) = (x as i16, y as i16);
                let mut want: Vec<_> = slots(pixel, geometry.window.area())
                    .map(|s| ([x, y, s as i16 + 1], s))
                    .collect();
                if want.is_empty() {
                    want.push(([0; 3], 0));
                }
                assert!(found.eq(want), "{x}, {y}");
            }
        }
    }
}

#[test]
fn photographs_without_functions_have_a_single_texel_for_them() {
    let mut transport = transport(geometry((37, 23), 3), 4);
    for tile in &mut transport.tiles {
        tile.functions = FunctionCodes::dark(tile.rect());
    }
    let layout = TextureLayout::new(&transport, WEBGL2_MINIMUM).unwrap();
    for binding in [binding::FUNCTIONS, binding::CODES] {
        assert_eq!(layout.textures[binding].extent, TEXEL);
    }
    let written = layout.for_each_function_region(&transport, &mut |_| Err(()));
    assert_eq!(written, Ok(()));
}

#[test]
fn each_coefficient_is_where_the_shader_reads_it() {
    let geometry = geometry((37, 23), 3);
    for rank in [1, 4, 9, 16] {
        let transport = transport(geometry.clone(), rank);
        let layout = TextureLayout::new(&transport, WEBGL2_MINIMUM).unwrap();
        let (quads, pairs) = (rank.div_ceil(4) as u32, rank.div_ceil(8) as u32);
        assert_eq!(layout.quad_pairs(), pairs);
        let TextureDescriptor { extent, layers, .. } = layout.textures[binding::COEFFICIENTS];
        assert_eq!((extent, layers), (geometry.camera, Some(3 * quads)));
        let mut found = 0;
        let Ok(()) = layout.for_each_coefficient_region(&transport, &mut |region| {
            let (channel, quad) = (region.origin[2] / quads, region.origin[2] % quads);
            let texels: &[[i16; 4]] = bytemuck::cast_slice(region.texels);
            assert!(channel < 3 && texels.len() == region.extent.area());
            for (i, texel) in texels.iter().enumerate() {
                let (x, y) = (
                    i as u32 % region.extent.width,
                    i as u32 / region.extent.width,
                );
                let at = [(region.origin[0] + x) as i16, (region.origin[1] + y) as i16];
                assert_eq!(*texel, [at[0], at[1], (channel * quads + quad) as i16, 7]);
                found += 1;
            }
            Ok::<_, std::convert::Infallible>(())
        });
        let tiles = transport
            .tiles
            .iter()
            .filter(|tile| !tile.coefficients.is_dark());
        let pixels: usize = tiles.map(|tile| tile.rect().extent.area()).sum();
        assert_eq!(found, pixels * 3 * quads as usize);
        let layers = layout.textures[binding::BASIS_RESPONSE].layers;
        assert_eq!(layers, Some(3 * 2 * pairs));
        let used = rank.div_ceil(4).div_ceil(2).div_ceil(2); // half the quads, in pairs
        let pairs = pairs as usize;
        let passes: Vec<_> = layout.correlation_passes(&[0, 1, 2], 1.0).collect();
        let filled = passes.iter().map(|&[_, _, layers]| layers);
        assert!(filled.eq(0..3 * pairs));
        let one = layout.correlation_passes(&[1], 1.0);
        assert!(one.eq((0..pairs).map(|i| [1, i, i])));
        let first = passes.iter().filter(|&&[_, pair, _]| pair < used);
        let less: Vec<_> = layout.correlation_passes(&[0, 1, 2], 0.5).collect();
        assert!(less.len() == 3 * used && less.iter().eq(first));
    }
}

#[test]
fn origins_far_off_the_light_plane_are_clamped() {
    for (shift, expected) in [(1e300, [20, 10]), (-1e300, [-15, -15])] {
        let mut geometry = geometry((8, 8), 15);
        geometry.correspondence.affine = [[0.0, 0.0, shift]; 2];
        let transport = transport(geometry.clone(), 0);
        let layout = TextureLayout::new(&transport, WEBGL2_MINIMUM).unwrap();
        for [u, v] in layout.origin_texels() {
            assert_eq!([u, v], expected);
        }
    }
}

#[test]
fn photographs_beyond_the_limits_are_errors() {
    let error = |camera, window, rank, limits| {
        let transport = transport(geometry(camera, window), rank);
        TextureLayout::new(&transport, limits).unwrap_err()
    };
    let exceeds = |quantity, need, limit| TextureLayoutError {
        quantity,
        need,
        limit,
    };
    assert_eq!(
        error((2049, 8), 1, 0, WEBGL2_MINIMUM),
        exceeds("columns or rows of camera pixels", 2049, 2048)
    );
    let small = TextureLimits {
        max_side: 64,
        max_layers: 2,
    };
    let direct = transport(geometry((64, 64), 15), 0);
    let values = direct.tiles.iter().map(|tile| tile.functions.entries.len());
    assert_eq!(
        error((64, 64), 15, 0, small),
        exceeds(
            "direct transport values",
            values.sum::<usize>() as u64,
            2 * 64 * 64
        )
    );
    assert_eq!(
        error((8, 8), 1, 1, small),
        exceeds("layers of components", 6, 2)
    );
    let mut wide = transport(geometry((8, 8), 1), 64);
    wide.geometry.light = Extent::new(1500, 1500);
    assert_eq!(
        TextureLayout::new(&wide, WEBGL2_MINIMUM).unwrap_err(),
        exceeds(
            "bytes for the basis response",
            1502 * 1502 * 48 * 16,
            256 << 20
        )
    );
    assert_eq!(
        error((8, 8), 25, 1, WEBGL2_MINIMUM),
        exceeds("slots in a window", 625, 512)
    );
    let large = transport(geometry((512, 512), 15), 0);
    let fits = TextureLayout::new(&large, WEBGL2_MINIMUM).unwrap();
    assert!(fits.textures[binding::CODES].layers <= Some(256));
}
