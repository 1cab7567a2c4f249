//! Photographs to relight, sequences of lights, and the time of a frame.

use std::sync::Arc;
use std::time::Instant;

use rayon::prelude::*;
use relightable_photo::job_executor::{Executor, SequentialExecutor};
use relightable_photo::relight::cpu::LinearRelighter;
use relightable_photo::relight::{Light, OutputTransform, Rgba8Picture, TorchSpot};
use relightable_photo::transport::{Extent, LightPosition, Tile, Transport};

use crate::synthetic_photo::{self, RayonExecutor, noise, square};

/// Lights of a sequence, which repeats.
const SEQUENCE_LIGHTS: usize = 4;

/// How the light changes from frame to frame.
#[derive(Clone, Copy)]
pub enum LightSequence {
    Video,
    Torch,
    Static,
}

pub const LIGHT_SEQUENCES: [LightSequence; 3] = [
    LightSequence::Video,
    LightSequence::Torch,
    LightSequence::Static,
];

impl LightSequence {
    pub fn name(self) -> &'static str {
        match self {
            Self::Video => "video",
            Self::Torch => "torch",
            Self::Static => "static",
        }
    }

    pub fn lights(self, extent: Extent) -> Vec<Light> {
        match self {
            Self::Video => (0..SEQUENCE_LIGHTS).map(|i| video(extent, i)).collect(),
            Self::Torch => (0..SEQUENCE_LIGHTS).map(|i| torch(extent, i)).collect(),
            Self::Static => vec![video(extent, 0)],
        }
    }
}

/// Milliseconds of a frame.
#[derive(Clone, Copy)]
pub struct FrameTime {
    /// Up to the picture in linear light.
    pub linear: f64,
    /// With the output transform.
    pub total: f64,
}

impl FrameTime {
    pub const INFINITE: Self = Self {
        linear: f64::INFINITY,
        total: f64::INFINITY,
    };

    pub fn min(self, other: Self) -> Self {
        Self {
            linear: self.linear.min(other.linear),
            total: self.total.min(other.total),
        }
    }
}

/// A photograph under a sequence of lights.
pub struct AnimatedPhoto {
    pub relighter: LinearRelighter,
    pub lights: Vec<Light>,
    /// Frames drawn since the light sequence began.
    frame: usize,
    picture: Rgba8Picture,
}

impl AnimatedPhoto {
    pub fn new(side: u32, rank: usize) -> Self {
        Self {
            relighter: LinearRelighter::new(Arc::new(transport(side, rank))),
            lights: Vec::new(),
            frame: 0,
            picture: Rgba8Picture::filled(square(side), [0, 0, 0, 255]),
        }
    }

    /// Takes other lights, and shows the first.
    pub fn load(&mut self, sequence: LightSequence) {
        self.lights = sequence.lights(self.relighter.transport().geometry.light);
        self.frame = 0;
        self.render_frame(&RayonExecutor);
    }

    fn render_frame(&mut self, executor: &impl Executor) -> FrameTime {
        let light = &self.lights[self.frame % self.lights.len()];
        self.frame += 1;
        let start = Instant::now();
        self.relighter.relight(light, executor);
        let linear = start.elapsed();
        let rows = 0..self.picture.extent.height;
        let pixels = &mut self.picture.pixels;
        self.relighter
            .encode_rows(&OutputTransform::srgb(1.0), rows, pixels, executor);
        let [linear, total] = [linear, start.elapsed()].map(|time| time.as_secs_f64() * 1e3);
        FrameTime { linear, total }
    }

    /// The fastest frames on one thread and on all cores, measured for so many seconds.
    pub fn fastest(&mut self, seconds: f64) -> [FrameTime; 2] {
        let (start, mut best, mut frames) = (Instant::now(), [FrameTime::INFINITE; 2], 0);
        while frames < 5 || frames < 200 && start.elapsed().as_secs_f64() < seconds {
            best[0] = best[0].min(self.render_frame(&SequentialExecutor));
            best[1] = best[1].min(self.render_frame(&RayonExecutor));
            frames += 1;
        }
        best
    }
}

/// Seconds of the fastest run.
pub fn fastest_seconds(runs: usize, mut work: impl FnMut()) -> f64 {
    let times = (0..runs).map(|_| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    });
    times.fold(f64::INFINITY, f64::min)
}

pub fn transport(side: u32, rank: usize) -> Transport {
    let geometry = synthetic_photo::geometry(side);
    let tile = |t: usize| Tile::quantise(&synthetic_photo::tile(&geometry, rank, t), rank);
    let tiles = (0..geometry.tile_grid().area()).into_par_iter();
    Transport {
        tiles: tiles.map(tile).collect(),
        basis: synthetic_photo::basis(&geometry, rank),
        geometry,
    }
}

fn video(extent: Extent, frame: usize) -> Light {
    let values = 3 * extent.area();
    let values: Vec<f32> = (0..values).map(|i| noise(i + frame * values)).collect();
    Light::from_linear_rgb(extent, &values).unwrap()
}

fn torch(extent: Extent, frame: usize) -> Light {
    let u = f64::from(extent.width) * (0.3 + 0.04 * frame as f64);
    let pose = TorchSpot::central(extent);
    let centre = LightPosition { u, ..pose.centre };
    Light::torch(extent, TorchSpot { centre, ..pose })
}
