//! Pictures of the CPU backend are those of the double precision reference, to within one code.
#![cfg(not(target_arch = "wasm32"))]

mod common;

use std::sync::Arc;

use common::relit::{self, TileContents};
use common::{bent, tiled};
use proptest::prelude::*;
use relightable_photo::job_executor::SequentialExecutor;
use relightable_photo::relight::cpu::{EncodedRelighter, LinearRelighter};
use relightable_photo::relight::{BuiltinLight, Light, OutputTransform, TorchSpot, reference};
use relightable_photo::transport::{
    CameraPixel, Extent, Geometry, LightPosition, LightRegion, MAX_WINDOW, Tile, TileRect,
};

/// Grids, windows and tiles of all shapes, with correspondences that rotate, mirror and shift the picture until windows
/// hang over the light plane's edges, or miss it, and bend.
fn geometries() -> impl Strategy<Value = Geometry> {
    let sides = |most: u32| [1..=most, 1..=most];
    let window = prop_oneof![Just(1), Just(3), Just(15), Just(17), Just(MAX_WINDOW)];
    let row = || (-1.5..1.5, -1.5..1.5, -30.0..40.0).prop_map(|(a, b, c)| [a, b, c]);
    (
        sides(21),
        sides(19),
        window,
        8u32..=24,
        row(),
        row(),
        any::<bool>(),
    )
        .prop_map(|(camera, light, window, tile_side, u, v, bends)| {
            let geometry = tiled(camera, light, window, tile_side, [u, v]);
            if bends { bent(geometry) } else { geometry }
        })
}

/// Shards side by side must be under one light.
#[test]
fn a_light_on_a_part_of_a_light_plane_is_that_part_of_the_light() {
    let plane = Extent::new(250, 130);
    let image = Extent::new(90, 201);
    let values: Vec<f32> = (0..3 * image.area())
        .map(|i| (i * 31 % 97) as f32)
        .collect();
    let codes: Vec<u8> = (0..4 * image.area())
        .map(|i| (i * 89 % 256) as u8)
        .collect();
    let spot = TorchSpot {
        centre: LightPosition { u: 70.3, v: -4.0 },
        radius: 20.0,
    };
    let make = |region: LightRegion| {
        let mut lights = BuiltinLight::BY_NAME
            .map(|(_, light)| light.render(region))
            .to_vec();
        lights.push(Light::torch(region, spot));
        lights.push(Light::fire(region, 12.5));
        let linear = Light::from_linear_rows(region, image, |y, row| {
            row.copy_from_slice(&values[y * row.len()..][..row.len()]);
        });
        lights.push(linear.unwrap());
        let srgb = Light::from_srgb_rows(region, image, |y, row| {
            row.copy_from_slice(&codes[y * row.len()..][..row.len()]);
        });
        lights.push(srgb.unwrap());
        lights
    };
    let whole = make(plane.into());
    for (first, extent) in [
        ([0, 0], Extent::new(250, 130)),
        ([17, 33], Extent::new(64, 70)),
        ([249, 129], Extent::new(1, 1)),
        ([101, 0], Extent::new(149, 2)),
    ] {
        let region = LightRegion {
            plane,
            first,
            extent,
        };
        for (part, whole) in make(region).iter().zip(&whole) {
            assert_eq!(part.extent(), extent);
            let columns = |v: u32| {
                let start = (v * plane.width + first[0]) as usize;
                &whole.elements()[start..start + extent.width as usize]
            };
            let cropped: Vec<_> = region.rows().flat_map(columns).copied().collect();
            assert_eq!(part.elements(), cropped);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn cpu_is_within_one_code_of_the_reference(
        geometry in geometries(),
        seed: u64,
        exposure in 0.0..8.0f32,
    ) {
        let contents = [TileContents::Direct, TileContents::Factored, TileContents::Mixed][seed as usize % 3];
        let transport = Arc::new(relit::asymmetric_transport(geometry.clone(), contents, seed));
        // One relighter for all lights: the last light must leave nothing behind.
        let mut relighter = LinearRelighter::new(transport.clone());
        for (name, light) in relit::lights(geometry.light) {
            relighter.relight(&light, &SequentialExecutor);
            let output = relit::output_transforms(exposure)[seed as usize / 3 % 4];
            let got = relighter.picture(&output, &SequentialExecutor);
            let want = reference::picture(&transport, &light, &output);
            relit::assert_within_one_code(&got, &want, name);
        }
    }
}

#[test]
fn windows_off_the_light_plane_are_dark() {
    for shift in [1e300, -1e300, 5e9, -2_147_483_648.0, 2_147_483_647.0] {
        let affine = [[0.5, 0.0, shift], [0.0, 0.5, 0.0]];
        let geometry = tiled([9, 8], [8, 8], 17, 8, affine);
        let transport = Arc::new(relit::asymmetric_transport(
            geometry.clone(),
            TileContents::Mixed,
            1,
        ));
        let mut relighter = LinearRelighter::new(transport);
        for (name, light) in relit::lights(geometry.light) {
            relighter.relight(&light, &SequentialExecutor);
            let picture = relighter.picture(&OutputTransform::srgb(1.0), &SequentialExecutor);
            assert!(
                picture.pixels.iter().all(|p| *p == [0, 0, 0, 255]),
                "{name}, {shift}"
            );
        }
    }
}

#[test]
fn a_moving_light_leaves_nothing_behind() {
    let geometry = tiled(
        [90, 70],
        [140, 110],
        15,
        32,
        [[1.5, 0.02, 1.0], [0.0, 1.5, -2.0]],
    );
    let transport = Arc::new(relit::asymmetric_transport(
        geometry.clone(),
        TileContents::Mixed,
        3,
    ));
    let mut moved = LinearRelighter::new(transport.clone());
    for step in 0..6 {
        let centre = LightPosition {
            u: 20.0 * f64::from(step),
            v: 100.0 - 15.0 * f64::from(step),
        };
        let pose = TorchSpot {
            centre,
            radius: 2.0,
        };
        let mut elements = Vec::new();
        for [r, g, b, _] in Light::torch(geometry.light, pose).elements() {
            // Dim elements are made dark, so that most of the light does not change.
            elements.extend([r, g, b].map(|c| if *c < 1e-3 { 0.0 } else { *c }));
        }
        let light = Light::from_linear_rgb(geometry.light, &elements).unwrap();
        moved.relight(&light, &SequentialExecutor);
        let mut fresh = LinearRelighter::new(transport.clone());
        fresh.relight(&light, &SequentialExecutor);
        assert_eq!(moved.linear(), fresh.linear(), "step {step}");
    }
}

#[test]
fn pixels_out_of_view_follow_once_they_are_in_view() {
    let affine = [[1.5, 0.02, 1.0], [0.0, 1.5, -2.0]];
    let geometry = tiled([90, 70], [140, 110], 15, 32, affine);
    let transport = relit::asymmetric_transport(geometry.clone(), TileContents::Mixed, 3);
    let transport = Arc::new(transport);
    let view = |x: u32, y: u32, width: u32, height: u32| TileRect {
        x,
        y,
        extent: Extent::new(width, height),
    };
    let mut relighter = LinearRelighter::new(transport.clone());
    let mut encoded = EncodedRelighter::new(transport.clone());
    let outputs = relit::output_transforms(1.5);
    let views = [
        view(0, 0, 90, 70),
        view(20, 10, 30, 20),
        view(60, 40, 30, 30),
        view(0, 0, 0, 0),
        view(89, 69, 1, 1),
        view(0, 0, 90, 70),
    ];
    let lights = relit::lights(geometry.light);
    for (i, view) in views.into_iter().enumerate() {
        relighter.set_view(view);
        // Under the last view, the light stays.
        let (name, light) = &lights[i.min(views.len() - 2) % lights.len()];
        relighter.set_quality([1.0, 0.5][i % 2]);
        relighter.relight(light, &SequentialExecutor);
        let output = outputs[i % 3];
        encoded.set_view(view);
        encoded.set_quality([1.0, 0.5][i % 2]);
        encoded.set_output(&output);
        encoded.relight(light, &SequentialExecutor);
        let mut codes = vec![[0; 4]; geometry.camera.area()];
        encoded.copy_rows(0..70, &mut codes);
        let mut fresh = LinearRelighter::new(transport.clone());
        fresh.set_quality([1.0, 0.5][i % 2]);
        fresh.relight(light, &SequentialExecutor);
        let (got, want) = (
            relighter.picture(&output, &SequentialExecutor),
            fresh.picture(&output, &SequentialExecutor),
        );
        for y in 0..70 {
            for x in 0..90 {
                let is_in = (view.x..view.x + view.extent.width).contains(&x)
                    && (view.y..view.y + view.extent.height).contains(&y);
                let at = geometry.camera.index(CameraPixel { x, y });
                if is_in {
                    assert_eq!(got.pixels[at], want.pixels[at], "{name}: {x}, {y}");
                    assert_eq!(codes[at], want.pixels[at], "{name}: {x}, {y}");
                }
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn row_ranges_give_the_same_picture_to_the_bit(geometry in geometries(), seed: u64) {
        let contents = [TileContents::Direct, TileContents::Factored, TileContents::Mixed][seed as usize % 3];
        let transport = relit::asymmetric_transport(geometry.clone(), contents, seed);
        let extent = geometry.camera;
        let middle = (geometry.tile_grid().height / 2 * geometry.tile_side).min(extent.height);
        let mut parts = [0..middle, middle..extent.height].map(|rows| {
            let mut part = transport.clone();
            for tile in &mut part.tiles {
                if !rows.contains(&tile.rect().y) {
                    *tile = Tile::dark(tile.rect());
                }
            }
            (LinearRelighter::new(Arc::new(part)), rows)
        });
        let mut whole = LinearRelighter::new(Arc::new(transport));
        let output = relit::output_transforms(1.0)[seed as usize / 3 % 4];
        for (name, light) in relit::lights(geometry.light) {
            whole.relight(&light, &SequentialExecutor);
            let mut joined = Vec::new();
            for (relighter, rows) in &mut parts {
                let width = geometry.light.width as usize;
                for v in relighter.light_rows() {
                    let row = &light.elements()[v as usize * width..][..width];
                    relighter.set_light_row(v, row);
                }
                relighter.update(&SequentialExecutor);
                let mut out = vec![[0; 4]; rows.len() * extent.width as usize];
                relighter.encode_rows(&output, rows.clone(), &mut out, &SequentialExecutor);
                joined.append(&mut out);
                let [start, end] = [rows.start, rows.end].map(|row| (row * extent.width) as usize);
                let (part, whole) = (relighter.linear(), whole.linear());
                prop_assert!(part.pixels[start..end] == whole.pixels[start..end], "{name}");
            }
            prop_assert!(whole.picture(&output, &SequentialExecutor).pixels == joined, "{name}");
        }
    }
}

#[test]
fn kept_codes_are_those_of_the_linear_picture() {
    let affine = [[1.5, 0.02, 1.0], [0.0, 1.5, -2.0]];
    let geometry = tiled([90, 70], [140, 110], 15, 32, affine);
    let transport = relit::asymmetric_transport(geometry.clone(), TileContents::Mixed, 3);
    let transport = Arc::new(transport);
    let mut linear = LinearRelighter::new(transport.clone());
    let mut encoded = EncodedRelighter::new(transport);
    let outputs = relit::output_transforms(1.5);
    for (i, (name, light)) in relit::lights(geometry.light).into_iter().enumerate() {
        linear.relight(&light, &SequentialExecutor);
        encoded.relight(&light, &SequentialExecutor);
        // The light stays while the output transform changes, and once both stay.
        for output in [outputs[i % 4], outputs[(i + 1) % 4], outputs[(i + 1) % 4]] {
            encoded.set_output(&output);
            encoded.update(&SequentialExecutor);
            let want = linear.picture(&output, &SequentialExecutor).pixels;
            let mut got = vec![[9; 4]; want.len()];
            encoded.copy_rows(0..70, &mut got);
            assert_eq!(got, want, "{name}");
            encoded.copy_rows(33..40, &mut got[..7 * 90]);
            assert_eq!(got[..7 * 90], want[33 * 90..40 * 90], "{name}");
        }
    }
}

#[test]
fn lower_quality_is_the_first_components_and_can_be_undone() {
    let geometry = tiled(
        [70, 50],
        [35, 25],
        15,
        32,
        [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]],
    );
    let transport = Arc::new(relit::asymmetric_transport(
        geometry.clone(),
        TileContents::Mixed,
        5,
    ));
    let mut relighter = LinearRelighter::new(transport.clone());
    for (name, light) in relit::lights(geometry.light) {
        relighter.set_quality(1.0);
        relighter.relight(&light, &SequentialExecutor);
        let whole = relighter.linear();
        // One of three quads, then two.
        for (quality, quads) in [(0.0, 1), (0.3, 1), (0.34, 2)] {
            let output = OutputTransform::srgb(1.0);
            relighter.set_quality(quality);
            relighter.relight(&light, &SequentialExecutor);
            let want = reference::picture(&relit::first_quads(&transport, quads), &light, &output);
            relit::assert_within_one_code(
                &relighter.picture(&output, &SequentialExecutor),
                &want,
                name,
            );
            // The same with the light left as it is.
            let coarse = relighter.linear();
            relighter.set_quality(1.0);
            relighter.update(&SequentialExecutor);
            assert_eq!(relighter.linear(), whole, "{name}");
            relighter.update(&SequentialExecutor);
            assert_eq!(relighter.linear(), whole, "{name}");
            relighter.set_quality(quality);
            relighter.update(&SequentialExecutor);
            assert_eq!(relighter.linear(), coarse, "{name}");
        }
        relighter.set_quality(1.0);
        relighter.relight(&light, &SequentialExecutor);
        assert_eq!(relighter.linear(), whole, "{name}");
    }
}
