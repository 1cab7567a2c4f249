//! Synthetic problems with known properties.

use crate::capture::{CameraPixelSet, Measurements, NoiseModel, Pattern};
use crate::transport::{
    CHANNELS, Correspondence, Extent, Geometry, TileRect, TileTransportFunctions, Window,
};

/// Numbers uniform in [−½, ½), the same for each seed.
pub(super) fn uniform(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed | 1;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    }
}

/// A least-squares problem: `A`, `[rows, k]`, and several measurements `y`, `[rows]`.
pub(super) struct Problem {
    pub k: usize,
    pub matrix: Vec<f64>,
    pub measurements: Vec<Vec<f64>>,
}

impl Problem {
    /// Entries of A are uniform around `offset`, of y around half of it.
    pub fn random(k: usize, rows: usize, seed: u64, offset: f64) -> Self {
        let mut next = uniform(seed);
        Self {
            k,
            matrix: (0..rows * k).map(|_| next() + offset).collect(),
            measurements: (0..4)
                .map(|_| (0..rows).map(|_| next() + 0.5 * offset).collect())
                .collect(),
        }
    }

    fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.matrix.chunks_exact(self.k)
    }

    /// `AᵀA`.
    pub fn gram(&self) -> Vec<f64> {
        let k = self.k;
        let entry = |ij: usize| self.rows().map(|r| r[ij / k] * r[ij % k]).sum();
        (0..k * k).map(entry).collect()
    }

    /// `Aᵀy`.
    pub fn right_hand_side(&self, y: &[f64]) -> Vec<f64> {
        let entry = |j: usize| self.rows().zip(y).map(|(r, y)| r[j] * y).sum();
        (0..self.k).map(entry).collect()
    }

    /// `‖y‖²`.
    pub fn energy(y: &[f64]) -> f64 {
        y.iter().map(|y| y * y).sum()
    }

    fn differences(&self, x: &[f64], y: &[f64]) -> Vec<f64> {
        let product = |r: &[f64]| r.iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
        self.rows().zip(y).map(|(r, y)| y - product(r)).collect()
    }

    /// `‖y − Ax‖`.
    pub fn residual(&self, x: &[f64], y: &[f64]) -> f64 {
        Self::energy(&self.differences(x, y)).sqrt()
    }

    /// `Aᵀ(y − Ax)`.
    pub fn correlation(&self, x: &[f64], y: &[f64]) -> Vec<f64> {
        self.right_hand_side(&self.differences(x, y))
    }
}

/// The window of a [`SyntheticCapture`].
const WINDOW: Window = match Window::new(5) {
    Ok(window) => window,
    Err(_) => panic!("5 is odd"),
};

/// Noiseless measurements of pixels that all have one light transport function, or nearly, times a brightness of their
/// own.
pub(crate) struct SyntheticCapture {
    pub geometry: Geometry,
    /// The function, of sum 1, `[slot]`.
    pub function: Vec<f64>,
    pub measurements: Measurements,
    /// Standard deviation of every element of a pixel's function, relative to the element of `function`.
    variation: f64,
    /// Brightness of each pixel.
    brightness: fn(usize) -> f64,
}

impl SyntheticCapture {
    pub fn new(patterns: usize) -> Self {
        Self::with_variation(patterns, 0.0)
    }

    /// The same with functions that vary from pixel to pixel.
    pub fn with_variation(patterns: usize, variation: f64) -> Self {
        Self::with_brightness(patterns, variation, |n| 0.1 + 0.02 * (n * 37 % 29) as f64)
    }

    /// Pixels that all have one function, with a brightness that varies smoothly over the picture.
    pub fn smooth(patterns: usize) -> Self {
        Self::with_brightness(patterns, 0.0, |n| {
            let (x, y) = ((n % 32) as f64, (n / 32) as f64);
            0.4 + 0.2 * (0.9 * x).sin() * (0.7 * y).cos() + 0.1 * (0.5 * x + 0.8 * y).sin()
        })
    }

    fn with_brightness(patterns: usize, variation: f64, brightness: fn(usize) -> f64) -> Self {
        let square = |side| Extent::new(side, side);
        let geometry = Geometry {
            camera: square(32),
            light: square(16),
            window: WINDOW,
            correspondence: Correspondence::from_affine([[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]]),
            tile_side: 32,
        };
        let weights: Vec<f64> = (0..25)
            .map(|s| f64::from(2 * (s % 5) + s / 5 % 3))
            .collect();
        let sum: f64 = weights.iter().sum();
        let mut next = uniform(7);
        let area = geometry.light.area();
        let patterns = (0..patterns).map(|_| (0..area).map(|_| (next() + 0.5) as f32).collect());
        let patterns: Vec<Pattern> = patterns.map(Pattern::Grey).collect();
        let mut capture = Self {
            geometry: geometry.clone(),
            variation,
            brightness,
            function: weights.iter().map(|w| w / sum).collect(),
            measurements: Measurements {
                camera: geometry.camera,
                light: geometry.light,
                correspondence: geometry.correspondence.clone(),
                full_scale: vec![1.0; patterns.len()],
                patterns,
                loaded: CameraPixelSet::all(geometry.camera),
                photos: Vec::new(),
                flood: None,
                noise: NoiseModel {
                    gain: [0.0; CHANNELS],
                    floor: [0.0; CHANNELS],
                },
            },
        };
        let picture = capture.functions(1.0);
        let y = super::prediction::predictions(&geometry, &capture.measurements.patterns, &picture);
        let (count, pixels) = (capture.measurements.patterns.len(), geometry.camera.area());
        capture.measurements.photos = (0..count)
            .map(|l| {
                (0..pixels)
                    .map(|n| [0, 1, 2].map(|c| y[(n * count + l) * CHANNELS + c] as f32))
                    .collect()
            })
            .collect();
        capture
    }

    /// The true functions of the picture, times `factor`.
    pub fn functions(&self, factor: f64) -> TileTransportFunctions {
        let extent = self.geometry.camera;
        let mut functions =
            TileTransportFunctions::zeros(TileRect { x: 0, y: 0, extent }, self.function.len());
        let mut next = uniform(13);
        for (i, tau) in functions.tau.iter_mut().enumerate() {
            let (n, slot) = (i / self.function.len(), i % self.function.len());
            let brightness = (self.brightness)(n);
            let variation = 1.0 + self.variation * 12f64.sqrt() * next();
            let value = factor * brightness * variation * self.function[slot];
            *tau = [1.0, 0.8, 0.5].map(|c| (c * value) as f32);
        }
        functions
    }
}
