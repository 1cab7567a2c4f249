//! Photographs to relight, lights that change, and the time that a frame takes.

use std::sync::Arc;
use std::time::Instant;

use rayon::prelude::*;
use relightable_photo::executor::{Executor, SequentialExecutor};
use relightable_photo::relight::{Display, Light, Rgba8Picture, TorchPose, cpu};
use relightable_photo::transport::{Extent, LightPx, Tile, Transport};

use crate::made_up::{self, Cores, noise, square};

/// Lights that frames take turns with.
const LIGHTS: usize = 4;

/// How the light changes from frame to frame.
#[derive(Clone, Copy)]
pub enum Kind {
    Video,
    Torch,
    Static,
}

pub const KINDS: [Kind; 3] = [Kind::Video, Kind::Torch, Kind::Static];

impl Kind {
    pub fn name(self) -> &'static str {
        match self {
            Self::Video => "video",
            Self::Torch => "torch",
            Self::Static => "static",
        }
    }

    pub fn lights(self, extent: Extent) -> Vec<Light> {
        match self {
            Self::Video => (0..LIGHTS).map(|i| video(extent, i)).collect(),
            Self::Torch => (0..LIGHTS).map(|i| torch(extent, i)).collect(),
            Self::Static => vec![video(extent, 0)],
        }
    }
}

/// Milliseconds of a frame.
#[derive(Clone, Copy)]
pub struct Time {
    /// Until there is a picture in linear light.
    pub linear: f64,
    /// Tone mapping too.
    pub whole: f64,
}

impl Time {
    pub const NEVER: Self = Self {
        linear: f64::INFINITY,
        whole: f64::INFINITY,
    };

    pub fn min(self, other: Self) -> Self {
        Self {
            linear: self.linear.min(other.linear),
            whole: self.whole.min(other.whole),
        }
    }
}

/// A photograph under lights that follow each other.
pub struct Film {
    pub relighter: cpu::Relighter,
    pub lights: Vec<Light>,
    shown: usize,
    picture: Rgba8Picture,
}

impl Film {
    pub fn new(side: u32, rank: usize) -> Self {
        Self {
            relighter: cpu::Relighter::new(Arc::new(transport(side, rank))),
            lights: Vec::new(),
            shown: 0,
            picture: Rgba8Picture::black(square(side)),
        }
    }

    /// Takes other lights, and shows the first.
    pub fn load(&mut self, kind: Kind) {
        self.lights = kind.lights(self.relighter.transport().geometry.light);
        self.shown = 0;
        self.show(&Cores);
    }

    fn show(&mut self, executor: &impl Executor) -> Time {
        let light = &self.lights[self.shown % self.lights.len()];
        self.shown += 1;
        let start = Instant::now();
        self.relighter.relight(light, executor);
        let linear = start.elapsed();
        let rows = 0..self.picture.extent.height;
        let pixels = &mut self.picture.pixels;
        self.relighter
            .show(&Display::srgb(1.0), rows, pixels, executor);
        let [linear, whole] = [linear, start.elapsed()].map(|time| time.as_secs_f64() * 1e3);
        Time { linear, whole }
    }

    /// The fastest frames on one thread and on all cores, in so many seconds.
    pub fn fastest(&mut self, seconds: f64) -> [Time; 2] {
        let (start, mut best, mut frames) = (Instant::now(), [Time::NEVER; 2], 0);
        while frames < 5 || frames < 200 && start.elapsed().as_secs_f64() < seconds {
            best[0] = best[0].min(self.show(&SequentialExecutor));
            best[1] = best[1].min(self.show(&Cores));
            frames += 1;
        }
        best
    }
}

/// Seconds of the fastest of a few runs.
pub fn fastest(runs: usize, mut work: impl FnMut()) -> f64 {
    let times = (0..runs).map(|_| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    });
    times.fold(f64::INFINITY, f64::min)
}

pub fn transport(side: u32, rank: usize) -> Transport {
    let geometry = made_up::geometry(side);
    let tile = |t: usize| Tile::quantise(&made_up::tile(&geometry, rank, t), rank);
    let tiles = (0..geometry.tile_grid().area()).into_par_iter();
    Transport {
        tiles: tiles.map(tile).collect(),
        basis: made_up::basis(&geometry, rank),
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
    let pose = TorchPose::central(extent);
    let centre = LightPx { u, ..pose.centre };
    Light::torch(extent, TorchPose { centre, ..pose })
}
