//! The CPU path gives the picture that the paper's equation gives in double precision.
#![cfg(not(target_arch = "wasm32"))]

mod common;

use common::{relit, tiled};
use proptest::prelude::*;
use relightable_photo::relight::{cpu, reference};
use relightable_photo::transport::{Geometry, MAX_WINDOW};

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
        let transport = relit::asymmetric_transport(geometry, seed);
        for (name, light) in relit::lights(geometry.light) {
            let got = cpu::relight(&transport, &light).tone_map(exposure);
            let want = reference::relight_srgb8(&transport, &light, f64::from(exposure));
            relit::assert_within_one_code(&got, &want, name);
        }
    }
}

#[test]
fn a_window_off_the_display_sees_nothing() {
    for shift in [1e300, -1e300, 5e9, -2_147_483_648.0, 2_147_483_647.0] {
        let affine = [[0.5, 0.0, shift], [0.0, 0.5, 0.0]];
        let geometry = tiled([9, 8], [8, 8], 17, 8, affine);
        let transport = relit::asymmetric_transport(geometry, 1);
        for (name, light) in relit::lights(geometry.light) {
            let picture = cpu::relight(&transport, &light).tone_map(1.0);
            assert!(
                picture.pixels.iter().all(|p| *p == [0, 0, 0, 255]),
                "{name}, {shift}"
            );
        }
    }
}
