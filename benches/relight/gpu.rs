//! Frames on a graphics device, if the machine has one.

use std::rc::Rc;
use std::time::Instant;

use pollster::block_on;
use relightable_photo::relight::backend::FrameRequest;
use relightable_photo::relight::webgpu::{GpuContext, HeadlessRenderer};
use relightable_photo::relight::{Light, OutputTransform};

use super::animated_photo::{self, LightSequence};
use super::{Figures, RANKS, synthetic_photo};

const SIDES: [u32; 2] = [512, 2048];
/// Bytes copied to measure the memory's bandwidth.
const COPY_BYTES: u64 = 256 << 20;

/// Milliseconds of a frame, in the fastest of five runs of many frames: under a video, and of the last pass alone, which
/// is all that a change of exposure needs.
pub fn frames(figures: &mut Figures) {
    let device = match block_on(GpuContext::offscreen()) {
        Ok(device) => Rc::new(device),
        Err(error) => {
            println!("\nNo graphics device: {error}");
            return;
        }
    };
    let label = match device.is_software() {
        true => "software",
        false => "gpu",
    };
    println!("\n{} ({label})", device.kernel());
    if device.is_software() {
        println!("A software renderer: these are no figures of a GPU.");
    }
    let copied = 2.0 * COPY_BYTES as f64 / copy_seconds(&device);
    figures.insert(format!("{label}_copy_bandwidth_gb_s"), copied / 1e9);
    println!("copies {:.1} GB/s, read and written\n", copied / 1e9);
    println!(
        "{:20} {:>10} {:>10} {:>12}",
        "", "video", "last pass", "of copying"
    );
    for side in SIDES {
        for rank in RANKS {
            let transport = animated_photo::transport(side, rank);
            let photo = block_on(HeadlessRenderer::new(device.clone(), &transport));
            let Ok(mut photo) = photo.inspect_err(|error| println!("{side}² rank {rank}: {error}"))
            else {
                continue;
            };
            let lights = LightSequence::Video.lights(transport.geometry.light);
            let video = frame_ms(&device, |i| {
                draw(&mut photo, &lights[i % lights.len()], 1.0);
            });
            let last = frame_ms(&device, |i| {
                draw(&mut photo, &lights[0], 1.0 + (i % 100) as f32 / 100.0);
            });
            let fraction = synthetic_photo::bytes(side, rank) as f64 / (last / 1e3) / copied;
            println!(
                "{:20} {video:10.3} {last:10.3} {:11.0}%",
                format!("{side}² rank {rank}"),
                100.0 * fraction
            );
            let key = |what: &str| format!("{label}_{side}_r{rank}_{what}");
            figures.insert(key("video_ms"), video);
            figures.insert(key("last_pass_ms"), last);
            figures.insert(key("last_pass_copy_fraction"), fraction);
        }
    }
}

fn draw(photo: &mut HeadlessRenderer, light: &Light, exposure: f32) {
    let frame = FrameRequest {
        light: Some(light),
        output: OutputTransform::srgb(exposure),
        quality: 1.0,
    };
    photo.draw(&frame).unwrap();
}

/// Seconds to copy [`COPY_BYTES`] within the device's memory, in the fastest of five runs.
fn copy_seconds(device: &GpuContext) -> f64 {
    const COPIES: u32 = 8;
    let (gpu, queue) = device.wgpu();
    let buffers = [(); 2].map(|()| {
        gpu.create_buffer(&wgpu::BufferDescriptor {
            label: Some("copy"),
            size: COPY_BYTES,
            usage: wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    });
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let start = Instant::now();
        let mut encoder = gpu.create_command_encoder(&Default::default());
        for _ in 0..COPIES {
            encoder.copy_buffer_to_buffer(&buffers[0], 0, &buffers[1], 0, COPY_BYTES);
        }
        queue.submit([encoder.finish()]);
        device.wait().unwrap();
        best = best.min(start.elapsed().as_secs_f64() / f64::from(COPIES));
    }
    best
}

/// Milliseconds of one of many consecutive frames.
fn frame_ms(device: &GpuContext, mut draw: impl FnMut(usize)) -> f64 {
    let mut best = f64::INFINITY;
    // Counted on from run to run, so that even runs of a single frame draw different ones.
    let mut next = 0..;
    let mut run = |frames: usize| {
        let start = Instant::now();
        next.by_ref().take(frames).for_each(&mut draw);
        device.wait().unwrap();
        start.elapsed().as_secs_f64() * 1e3 / frames as f64
    };
    // As many as fit a tenth of a second.
    let frames = (100.0 / run(1).min(run(2))).clamp(1.0, 300.0) as usize;
    for _ in 0..5 {
        best = best.min(run(frames));
    }
    best
}
