//! `pkg-scripts/bench relight`: how fast a picture is relit on the CPU.
#![allow(clippy::unwrap_used, clippy::expect_used)] // a bench that cannot go on should stop

use std::sync::Arc;
use std::time::Instant;

use rayon::prelude::*;
use relightable_photo::relight::{Light, Rgba8Picture, TorchPose, cpu};
use relightable_photo::transport::{
    BandTile, Basis, Correspondence, Extent, Geometry, LightPx, Tile, Transport, Window,
};
use relightable_photo::workers::{OneThread, Workers};

struct Cores;

impl Workers for Cores {
    fn map<T: Send>(&self, count: usize, work: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        (0..count).into_par_iter().map(work).collect()
    }
}

fn square(side: u32) -> Extent {
    Extent {
        width: side,
        height: side,
    }
}

fn noise(i: usize) -> f32 {
    let mut h = (i as u32).wrapping_mul(0x9e37_79b9);
    h = (h ^ (h >> 16)).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
    (h ^ (h >> 16)) as f32 / u32::MAX as f32
}

fn transport(side: u32, rank: usize) -> Transport {
    let geometry = Geometry {
        camera: square(side),
        light: square(side / 2),
        window: Window::new(15).unwrap(),
        correspondence: Correspondence {
            affine: [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]],
        },
        tile_side: 128,
    };
    let kernels = (0..rank).map(|k| (0..225).map(|s| noise(k * 225 + s) / 15.0).collect());
    let basis = Basis {
        kernels: kernels.collect(),
    };
    let tiles = geometry.tiles().enumerate().map(|(t, rect)| {
        let mut tile = BandTile::dark(rect);
        let values = rect.extent.area() * rank;
        let coefficient = |i| [0, 1, 2].map(|c| (noise(3 * (i + t * values) + c) - 0.3) * 0.02);
        tile.coefficients = (0..values).map(coefficient).collect();
        Tile::quantise(&tile, rank)
    });
    Transport {
        tiles: tiles.collect(),
        basis,
        geometry,
    }
}

fn video(extent: Extent, frame: usize) -> Light {
    let values: Vec<f32> = (0..3 * extent.area())
        .map(|i| noise(i + 3 * frame * extent.area()))
        .collect();
    Light::from_linear_rgb(extent, &values).unwrap()
}

fn torch(extent: Extent, frame: usize) -> Light {
    let at = f64::from(extent.width) * (0.3 + 0.04 * frame as f64);
    let pose = TorchPose {
        centre: LightPx { u: at, v: at },
        ..TorchPose::central(extent)
    };
    Light::torch(extent, pose)
}

fn main() {
    for side in [128, 512, 2048] {
        for rank in [8, 16, 32] {
            if side == 2048 && rank == 32 {
                continue;
            }
            let transport = Arc::new(transport(side, rank));
            let light = transport.geometry.light;
            let mut relighter = cpu::Relighter::new(transport);
            let mut picture = Rgba8Picture::black(square(side));
            for (name, lights) in [
                ("video", (0..4).map(|i| video(light, i)).collect::<Vec<_>>()),
                ("torch", (0..4).map(|i| torch(light, i)).collect()),
                ("static", vec![video(light, 9)]),
            ] {
                let mut best = [[f64::MAX; 2]; 2];
                for i in 0..9 {
                    let light = &lights[i % lights.len()];
                    for (t, best) in best.iter_mut().enumerate() {
                        let start = Instant::now();
                        if t == 0 {
                            // The other ran under this light.
                            relighter.relight(&lights[(i + 1) % lights.len()], &OneThread);
                        } else {
                            relighter.relight(light, &Cores);
                        }
                        best[0] = best[0].min(start.elapsed().as_secs_f64());
                        let start = Instant::now();
                        relighter.tone_map(1.0, &mut picture);
                        best[1] = best[1].min(start.elapsed().as_secs_f64());
                    }
                }
                let ms = |s: f64| s * 1e3;
                println!(
                    "{side} rank {rank} {name}: one thread {:.2} ms, all {:.2} ms, tone {:.2}",
                    ms(best[0][0]),
                    ms(best[1][0]),
                    ms(best[1][1])
                );
            }
        }
    }
}
