//! Pictures of a graphics device are those of the double precision reference, to within one code. Needs a device; a
//! software renderer will do.
#![cfg(not(target_arch = "wasm32"))]
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use std::rc::Rc;

use common::relit::{self, TileContents};
use common::{bent, tiled};
use pollster::block_on;
use relightable_photo::relight::backend::{BackendError, FrameRequest};
use relightable_photo::relight::webgpu::{GpuContext, HeadlessRenderer};
use relightable_photo::relight::{Light, OutputTransform, reference};
use relightable_photo::transport::Transport;

fn device() -> Rc<GpuContext> {
    Rc::new(block_on(GpuContext::offscreen()).expect("a graphics device, if only in software"))
}

fn frame(light: &Light, output: OutputTransform) -> FrameRequest<'_> {
    FrameRequest {
        light: Some(light),
        output,
        quality: 1.0,
    }
}

fn transports() -> Vec<Transport> {
    let rotated = [[0.02, 0.5, -1.0], [-0.5, 0.03, 20.0]];
    let straight = [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]];
    let shapes = [
        (
            tiled([70, 50], [35, 25], 15, 32, straight),
            TileContents::Factored,
        ),
        (
            bent(tiled([40, 44], [24, 21], 7, 16, rotated)),
            TileContents::Mixed,
        ),
        (
            tiled([21, 33], [12, 18], 3, 8, straight),
            TileContents::Direct,
        ),
        (
            tiled([1, 1], [1, 1], 1, 8, straight),
            TileContents::Factored,
        ),
    ];
    let made = (1..).zip(shapes);
    made.map(|(seed, (geometry, contents))| relit::asymmetric_transport(geometry, contents, seed))
        .collect()
}

#[test]
fn all_lights_and_output_transforms_are_within_one_code_of_the_reference() {
    let device = device();
    for (i, transport) in transports().into_iter().enumerate() {
        let mut photo = block_on(HeadlessRenderer::new(device.clone(), &transport)).unwrap();
        for (name, light) in relit::lights(transport.geometry.light) {
            for (j, output) in relit::output_transforms(1.0).into_iter().enumerate() {
                photo.draw(&frame(&light, output)).unwrap();
                let want = reference::picture(&transport, &light, &output);
                let context = format!("{} transport {i}, output {j}, {name}", device.kernel());
                relit::assert_within_one_code(&photo.read().unwrap(), &want, &context);
            }
        }
    }
}

#[test]
fn a_picture_does_not_depend_on_the_frames_before() {
    let device = device();
    let transport = &transports()[1];
    let lights = relit::lights(transport.geometry.light);
    let mut photo = block_on(HeadlessRenderer::new(device.clone(), transport)).unwrap();
    let mut draw = |i: usize, quality: f32| {
        let light = &lights[i].1;
        photo
            .draw(&FrameRequest {
                light: Some(light),
                output: OutputTransform::srgb(1.0),
                quality,
            })
            .unwrap();
        photo.read().unwrap().pixels
    };
    let pictures: Vec<_> = (0..lights.len()).map(|i| draw(i, 1.0)).collect();
    for i in (0..lights.len()).rev() {
        assert!(draw(i, 1.0) == pictures[i], "{}", lights[i].0);
        // Again with the cached basis response, then in lower quality, and back.
        assert!(draw(i, 1.0) == pictures[i], "{}", lights[i].0);
        assert!(draw(i, 0.3) != pictures[i], "{}", lights[i].0);
        assert!(draw(i, 1.0) == pictures[i], "{}", lights[i].0);
    }
}

#[test]
fn lower_quality_is_the_first_components() {
    let device = device();
    for transport in &transports()[..2] {
        let mut photo = block_on(HeadlessRenderer::new(device.clone(), transport)).unwrap();
        for (name, light) in &relit::lights(transport.geometry.light) {
            for (quality, quads) in [(0.0, 1), (0.2, 1), (0.5, 2)] {
                let output = OutputTransform::srgb(1.0);
                photo
                    .draw(&FrameRequest {
                        light: Some(light),
                        output,
                        quality,
                    })
                    .unwrap();
                let want =
                    reference::picture(&relit::first_quads(transport, quads), light, &output);
                relit::assert_within_one_code(&photo.read().unwrap(), &want, name);
            }
        }
    }
}

#[test]
fn a_lost_device_is_reported_to_all_its_renderers() {
    let device = device();
    let transport = &transports()[3];
    let (_, light) = &relit::lights(transport.geometry.light)[0];
    let photos =
        [(); 2].map(|()| block_on(HeadlessRenderer::new(device.clone(), transport)).unwrap());
    device.destroy();
    let _ = device.wait(); // the loss is reported while waiting
    for mut photo in photos {
        let error = photo
            .draw(&frame(light, OutputTransform::srgb(1.0)))
            .unwrap_err();
        assert!(matches!(error, BackendError::Lost(_)), "{error}");
    }
}
