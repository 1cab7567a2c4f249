//! Simulated photographs of a scene, in memory.

use super::camera::{Camera, RandomStreamId};
use super::emission_matrix::EmissionMatrix;
use super::pattern_image::{PatternEnsemble, PatternImage, emission};
use super::simulated_scene::SimulatedScene;
use crate::capture::{CameraPixelSet, LinearPhoto, Measurements, NoiseModel, Pattern};
use crate::job_executor::Executor;
use crate::transport::{CHANNELS, CameraPixel, Geometry, KnownTransport};

/// Photographs that noise is added to at once; bounds the memory for copies.
const NOISE_BATCH: usize = 16;

/// A simulated camera in front of a scene, whose transport is known.
#[derive(Clone, Copy)]
pub struct SimulatedCapture<'a> {
    /// The scene.
    pub scene: &'a dyn SimulatedScene,
    /// Electrons of the measurement 1.
    pub electrons: f64,
    /// Seed of patterns and noise.
    pub seed: u64,
}

impl KnownTransport for SimulatedCapture<'_> {
    fn geometry(&self) -> &Geometry {
        self.scene.geometry()
    }

    fn transport_function(&self, pixel: CameraPixel, tau: &mut [[f32; CHANNELS]]) {
        tau.fill([0.0; CHANNELS]);
        self.scene.transport_function(pixel, tau);
    }
}

impl SimulatedCapture<'_> {
    /// Photographs the scene under `count` random patterns.
    pub fn measure(
        &self,
        ensemble: PatternEnsemble,
        count: usize,
        executor: &impl Executor,
    ) -> Measurements {
        let geometry = self.scene.geometry();
        let codes = self.pattern_codes(ensemble, count);
        let code = 1.0 / (Camera::WHITE - Camera::BLACK);
        let mut measurements = Measurements {
            camera: geometry.camera,
            light: geometry.light,
            correspondence: geometry.correspondence.clone(),
            patterns: codes.iter().map(emitted_pattern).collect(),
            full_scale: vec![1.0; count],
            loaded: CameraPixelSet::all(geometry.camera),
            photos: self.photographs(&codes, executor),
            flood: None,
            noise: NoiseModel::from_dark(&self.dark(), geometry.camera.width, code),
        };
        measurements.noise = NoiseModel::with_gain_from(&measurements);
        measurements
    }

    /// Random patterns; those of a larger `count` begin with those of a smaller one.
    pub(crate) fn pattern_codes(
        &self,
        ensemble: PatternEnsemble,
        count: usize,
    ) -> Vec<PatternImage> {
        let draw = |i| {
            let mut stream = RandomStreamId::Pattern(i).start(self.seed);
            ensemble.draw(self.scene.geometry().light, &mut stream)
        };
        (0..count as u32).map(draw).collect()
    }

    /// A photograph under no light.
    pub(crate) fn dark(&self) -> LinearPhoto {
        let black = vec![[0.0; CHANNELS]; self.scene.geometry().camera.area()];
        self.add_noise(&black, 0)
    }

    /// One photograph for each light, in units of the measurement, minus a dark photograph; saturated samples are NaN.
    pub(crate) fn photographs(
        &self,
        lights: &[PatternImage],
        executor: &impl Executor,
    ) -> Vec<LinearPhoto> {
        let mut photographs = self.raw_photographs(lights, executor);
        let dark = self.dark();
        for photograph in &mut photographs {
            for (y, dark) in photograph.iter_mut().zip(&dark) {
                *y = std::array::from_fn(|c| y[c] - dark[c]);
            }
        }
        photographs
    }

    /// One photograph for each light, in units of the measurement; saturated samples are NaN.
    pub(crate) fn raw_photographs(
        &self,
        lights: &[PatternImage],
        executor: &impl Executor,
    ) -> Vec<LinearPhoto> {
        let mut pictures = self.pictures(lights, executor);
        for (number, batch) in pictures.chunks_mut(NOISE_BATCH).enumerate() {
            let first = 1 + number * NOISE_BATCH;
            let noisy = executor.map(batch.len(), |i| {
                self.add_noise(&batch[i], (first + i) as u32)
            });
            batch
                .iter_mut()
                .zip(noisy)
                .for_each(|(picture, noisy)| *picture = noisy);
        }
        pictures
    }

    /// A photograph of `picture` with the noise of the photograph number `index`.
    pub(crate) fn add_noise(&self, picture: &LinearPhoto, index: u32) -> LinearPhoto {
        let mut noise = RandomStreamId::Photograph(index).start(self.seed);
        let electrons = self.electrons;
        let codes = Camera { electrons }.photograph(picture, &mut noise);
        let linear = |code: u16| match f64::from(code) - Camera::BLACK {
            light if light >= Camera::WHITE - Camera::BLACK => f32::NAN,
            light => (light / (Camera::WHITE - Camera::BLACK)) as f32,
        };
        codes.into_iter().map(|codes| codes.map(linear)).collect()
    }

    /// The pictures of the scene under each light, without noise.
    fn pictures(&self, lights: &[PatternImage], executor: &impl Executor) -> Vec<LinearPhoto> {
        let geometry = self.scene.geometry();
        let emissions = EmissionMatrix::new(geometry.light, lights);
        let mut pictures = vec![vec![[0.0; CHANNELS]; geometry.camera.area()]; lights.len()];
        let tiles: Vec<_> = geometry.tiles().collect();
        // One row of tiles at a time, to bound the memory.
        for row in tiles.chunks(geometry.tile_grid().width as usize) {
            let tiles = executor.map(row.len(), |i| {
                emissions.pictures(geometry, &self.scene.tile(row[i]))
            });
            for (rect, tile) in row.iter().zip(tiles) {
                for (picture, tile) in pictures.iter_mut().zip(tile) {
                    for (pixel, y) in rect.pixels().zip(tile) {
                        picture[geometry.camera.index(pixel)] = y;
                    }
                }
            }
        }
        pictures
    }
}

/// The pattern that the monitor emits for `codes`.
pub fn emitted_pattern(codes: &PatternImage) -> Pattern {
    let linear = |code: &u8| emission(*code) as f32;
    match codes {
        PatternImage::Grey(codes) => Pattern::Grey(codes.iter().map(linear).collect()),
        PatternImage::Rgb(codes) => Pattern::Rgb(std::array::from_fn(|c| {
            codes.iter().map(|code| linear(&code[c])).collect()
        })),
    }
}

/// The first `count` shots of `measurements`, with a noise model estimated from them alone.
pub fn first_shots(measurements: &Measurements, count: usize) -> Measurements {
    let count = count.min(measurements.patterns.len());
    let mut first = Measurements {
        patterns: measurements.patterns[..count].to_vec(),
        full_scale: measurements.full_scale[..count].to_vec(),
        loaded: measurements.loaded.clone(),
        photos: measurements.photos[..count].to_vec(),
        flood: measurements.flood.clone(),
        correspondence: measurements.correspondence.clone(),
        ..*measurements
    };
    first.noise = NoiseModel::with_gain_from(&first);
    first
}
