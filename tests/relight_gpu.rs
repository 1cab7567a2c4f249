//! Graphics devices give the picture that the paper's equation gives in double precision. Needs one:
//! a software renderer does.
#![cfg(not(target_arch = "wasm32"))]
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use std::rc::Rc;

use common::relit::{self, Kind};
use common::tiled;
use pollster::block_on;
use relightable_photo::relight::backend::{BackendError, Frame};
use relightable_photo::relight::webgpu::{Device, Offscreen};
use relightable_photo::relight::{Display, Light, reference};
use relightable_photo::transport::Transport;

fn device() -> Rc<Device> {
    Rc::new(block_on(Device::offscreen()).expect("a graphics device, if only in software"))
}

fn frame(light: &Light, display: Display) -> Frame<'_> {
    Frame {
        light: Some(light),
        display,
        detail: 1.0,
    }
}

fn transports() -> Vec<Transport> {
    let turned = [[0.02, 0.5, -1.0], [-0.5, 0.03, 20.0]];
    let straight = [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]];
    let shapes = [
        (tiled([70, 50], [35, 25], 15, 32, straight), Kind::Factored),
        (tiled([40, 44], [24, 21], 7, 16, turned), Kind::Mixed),
        (tiled([21, 33], [12, 18], 3, 8, straight), Kind::Direct),
        (tiled([1, 1], [1, 1], 1, 8, straight), Kind::Factored),
    ];
    let made = (1..).zip(shapes);
    made.map(|(seed, (geometry, kind))| relit::asymmetric_transport(geometry, kind, seed))
        .collect()
}

#[test]
fn every_light_on_every_display_is_within_one_code_of_the_reference() {
    let device = device();
    for (i, transport) in transports().into_iter().enumerate() {
        let mut photo = block_on(Offscreen::new(device.clone(), &transport)).unwrap();
        for (name, light) in relit::lights(transport.geometry.light) {
            for (j, display) in relit::displays(1.0).into_iter().enumerate() {
                photo.draw(&frame(&light, display)).unwrap();
                let want = reference::picture(&transport, &light, &display);
                let what = format!("{} transport {i}, display {j}, {name}", device.kernel());
                relit::assert_within_one_code(&photo.read().unwrap(), &want, &what);
            }
        }
    }
}

#[test]
fn a_light_looks_the_same_whatever_came_before_and_in_whatever_order() {
    let device = device();
    let transport = &transports()[1];
    let lights = relit::lights(transport.geometry.light);
    let mut photo = block_on(Offscreen::new(device.clone(), transport)).unwrap();
    let mut draw = |i: usize, detail: f32| {
        let light = &lights[i].1;
        photo
            .draw(&Frame {
                light: Some(light),
                display: Display::srgb(1.0),
                detail,
            })
            .unwrap();
        photo.read().unwrap().pixels
    };
    let forth: Vec<_> = (0..lights.len()).map(|i| draw(i, 1.0)).collect();
    for i in (0..lights.len()).rev() {
        assert!(draw(i, 1.0) == forth[i], "{}", lights[i].0);
        // The same again draws what is seen already; in less detail it is another picture.
        assert!(draw(i, 1.0) == forth[i], "{}", lights[i].0);
        assert!(draw(i, 0.3) != forth[i], "{}", lights[i].0);
        assert!(draw(i, 1.0) == forth[i], "{}", lights[i].0);
    }
}

#[test]
fn less_detail_is_the_first_components() {
    let device = device();
    for transport in &transports()[..2] {
        let mut photo = block_on(Offscreen::new(device.clone(), transport)).unwrap();
        for (name, light) in &relit::lights(transport.geometry.light) {
            for (detail, quads) in [(0.0, 1), (0.2, 1), (0.5, 2)] {
                let display = Display::srgb(1.0);
                photo
                    .draw(&Frame {
                        light: Some(light),
                        display,
                        detail,
                    })
                    .unwrap();
                let want =
                    reference::picture(&relit::first_quads(transport, quads), light, &display);
                relit::assert_within_one_code(&photo.read().unwrap(), &want, name);
            }
        }
    }
}

#[test]
fn a_lost_device_is_reported_to_all_that_share_it() {
    let device = device();
    let transport = &transports()[3];
    let (_, light) = &relit::lights(transport.geometry.light)[0];
    let photos = [(); 2].map(|()| block_on(Offscreen::new(device.clone(), transport)).unwrap());
    device.destroy();
    let _ = device.wait(); // the loss is told while waiting
    for mut photo in photos {
        let error = photo.draw(&frame(light, Display::srgb(1.0))).unwrap_err();
        assert!(matches!(error, BackendError::Lost(_)), "{error}");
    }
}
