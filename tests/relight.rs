//! The CPU path gives the picture that the paper's equation gives in double precision.
#![cfg(not(target_arch = "wasm32"))]

mod common;

use std::ops::Range;
use std::sync::Arc;

use common::relit::{self, Kind};
use common::tiled;
use proptest::prelude::*;
use relightable_photo::executor::SequentialExecutor;
use relightable_photo::relight::{Display, Light, TorchPose, cpu, reference};
use relightable_photo::transport::{Geometry, LightPx, MAX_WINDOW, Tile};

/// Grids, windows and tiles of all shapes, with correspondences that turn, mirror and shift the
/// picture until windows hang over the display's edges, or miss it.
fn geometries() -> impl Strategy<Value = Geometry> {
    let sides = |most: u32| [1..=most, 1..=most];
    let window = prop_oneof![Just(1), Just(3), Just(15), Just(17), Just(MAX_WINDOW)];
    let row = || (-1.5..1.5, -1.5..1.5, -30.0..40.0).prop_map(|(a, b, c)| [a, b, c]);
    (sides(21), sides(19), window, 8u32..=24, row(), row()).prop_map(
        |(camera, light, window, tile_side, u, v)| tiled(camera, light, window, tile_side, [u, v]),
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn cpu_is_within_one_code_of_the_reference(
        geometry in geometries(),
        seed: u64,
        exposure in 0.0..8.0f32,
    ) {
        let kind = [Kind::Direct, Kind::Factored, Kind::Mixed][seed as usize % 3];
        let transport = Arc::new(relit::asymmetric_transport(geometry, kind, seed));
        // One for all lights: what is left of the last must not show.
        let mut relighter = cpu::Relighter::new(transport.clone());
        for (name, light) in relit::lights(geometry.light) {
            relighter.relight(&light, &SequentialExecutor);
            let display = relit::displays(exposure)[seed as usize / 3 % 4];
            let got = relighter.picture(&display, &SequentialExecutor);
            let want = reference::picture(&transport, &light, &display);
            relit::assert_within_one_code(&got, &want, name);
        }
    }
}

#[test]
fn a_window_off_the_display_sees_nothing() {
    for shift in [1e300, -1e300, 5e9, -2_147_483_648.0, 2_147_483_647.0] {
        let affine = [[0.5, 0.0, shift], [0.0, 0.5, 0.0]];
        let geometry = tiled([9, 8], [8, 8], 17, 8, affine);
        let transport = Arc::new(relit::asymmetric_transport(geometry, Kind::Mixed, 1));
        let mut relighter = cpu::Relighter::new(transport);
        for (name, light) in relit::lights(geometry.light) {
            relighter.relight(&light, &SequentialExecutor);
            let picture = relighter.picture(&Display::srgb(1.0), &SequentialExecutor);
            assert!(
                picture.pixels.iter().all(|p| *p == [0, 0, 0, 255]),
                "{name}, {shift}"
            );
        }
    }
}

#[test]
fn a_light_that_moves_leaves_nothing_behind() {
    let geometry = tiled(
        [90, 70],
        [140, 110],
        15,
        32,
        [[1.5, 0.02, 1.0], [0.0, 1.5, -2.0]],
    );
    let transport = Arc::new(relit::asymmetric_transport(geometry, Kind::Mixed, 3));
    let mut moved = cpu::Relighter::new(transport.clone());
    for step in 0..6 {
        let centre = LightPx {
            u: 20.0 * f64::from(step),
            v: 100.0 - 15.0 * f64::from(step),
        };
        let pose = TorchPose {
            centre,
            radius: 2.0,
        };
        let mut elements = Vec::new();
        for [r, g, b, _] in Light::torch(geometry.light, pose).elements() {
            // Dark where it hardly shines, so that most of the light stays as it is.
            elements.extend([r, g, b].map(|c| if *c < 1e-3 { 0.0 } else { *c }));
        }
        let light = Light::from_linear_rgb(geometry.light, &elements).unwrap();
        moved.relight(&light, &SequentialExecutor);
        let mut anew = cpu::Relighter::new(transport.clone());
        anew.relight(&light, &SequentialExecutor);
        assert_eq!(moved.linear(), anew.linear(), "step {step}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn tiles_shared_out_give_the_same_picture_to_the_bit(geometry in geometries(), seed: u64) {
        let kind = [Kind::Direct, Kind::Factored, Kind::Mixed][seed as usize % 3];
        let transport = relit::asymmetric_transport(geometry, kind, seed);
        let extent = geometry.camera;
        let middle = (geometry.tile_grid().height / 2 * geometry.tile_side).min(extent.height);
        let mut parts = [0..middle, middle..extent.height].map(|rows| {
            let mut part = transport.clone();
            for tile in &mut part.tiles {
                if !rows.contains(&tile.rect().y) {
                    *tile = Tile::dark(tile.rect());
                }
            }
            (cpu::Relighter::new(Arc::new(part)), rows)
        });
        let mut whole = cpu::Relighter::new(Arc::new(transport));
        let display = relit::displays(1.0)[seed as usize / 3 % 4];
        for (name, light) in relit::lights(geometry.light) {
            whole.relight(&light, &SequentialExecutor);
            let mut shared = Vec::new();
            for (relighter, rows) in &mut parts {
                let seen = RowsSeen { light: &light, rows: relighter.light_rows() };
                relighter.relight_rows(seen, &SequentialExecutor);
                let mut out = vec![[0; 4]; rows.len() * extent.width as usize];
                relighter.show(&display, rows.clone(), &mut out, &SequentialExecutor);
                shared.append(&mut out);
                let [start, end] = [rows.start, rows.end].map(|row| (row * extent.width) as usize);
                let (part, whole) = (relighter.linear(), whole.linear());
                prop_assert!(part.pixels[start..end] == whole.pixels[start..end], "{name}");
            }
            prop_assert!(whole.picture(&display, &SequentialExecutor).pixels == shared, "{name}");
        }
    }
}

#[test]
fn less_detail_is_the_first_components_and_goes_as_it_came() {
    let geometry = tiled(
        [70, 50],
        [35, 25],
        15,
        32,
        [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]],
    );
    let transport = Arc::new(relit::asymmetric_transport(geometry, Kind::Mixed, 5));
    let mut relighter = cpu::Relighter::new(transport.clone());
    for (name, light) in relit::lights(geometry.light) {
        relighter.set_detail(1.0);
        relighter.relight(&light, &SequentialExecutor);
        let whole = relighter.linear();
        // One quad of three, then two.
        for (share, quads) in [(0.0, 1), (0.3, 1), (0.34, 2)] {
            let display = Display::srgb(1.0);
            relighter.set_detail(share);
            relighter.relight(&light, &SequentialExecutor);
            let want = reference::picture(&relit::first_quads(&transport, quads), &light, &display);
            relit::assert_within_one_code(
                &relighter.picture(&display, &SequentialExecutor),
                &want,
                name,
            );
            // The same under the light that is there.
            let less = relighter.linear();
            relighter.set_detail(1.0);
            relighter.update(&SequentialExecutor);
            assert_eq!(relighter.linear(), whole, "{name}");
            relighter.update(&SequentialExecutor);
            assert_eq!(relighter.linear(), whole, "{name}");
            relighter.set_detail(share);
            relighter.update(&SequentialExecutor);
            assert_eq!(relighter.linear(), less, "{name}");
        }
        relighter.set_detail(1.0);
        relighter.relight(&light, &SequentialExecutor);
        assert_eq!(relighter.linear(), whole, "{name}");
    }
}

/// A light of which no other rows may be asked for.
struct RowsSeen<'a> {
    light: &'a Light,
    rows: Range<u32>,
}

impl cpu::LightRows for RowsSeen<'_> {
    fn row(&mut self, v: u32) -> &[[f32; 4]] {
        assert_eq!(v, self.rows.start);
        self.rows.start += 1;
        let width = self.light.extent().width;
        &self.light.elements()[(v * width) as usize..((v + 1) * width) as usize]
    }
}
