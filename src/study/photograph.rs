//! Photographs of a scene in memory.

use super::{Picture, StudyError};
use crate::capture::{Measurements, Noise, Pattern, Rows};
use crate::executor::Executor;
use crate::simulate::{
    Camera, EmissionMatrix, Ensemble, LightCodes, RandomStream, SimulatedScene, emission,
};
use crate::transport::CHANNELS;

/// Photographs whose noise is drawn at once, while those before and after it are without.
const BATCH: usize = 16;

/// A camera before a scene, with the noise of one session.
#[derive(Clone, Copy)]
pub struct Photographer<'a> {
    /// What is photographed.
    pub scene: &'a dyn SimulatedScene,
    /// Electrons at full scale.
    pub electrons: f64,
    /// Seed of patterns and noise.
    pub seed: u64,
}

impl Photographer<'_> {
    /// The camera of `ltm-export simulate`.
    pub(super) fn camera(&self) -> Camera {
        Camera {
            black: 512.0,
            white: 60_000.0,
            electrons: self.electrons,
            read_noise: 8.0,
        }
    }

    /// Photographs the scene under `count` patterns.
    pub fn measure(
        &self,
        ensemble: Ensemble,
        count: usize,
        executor: &impl Executor,
    ) -> Result<Measurements, StudyError> {
        let geometry = self.scene.geometry();
        let codes = (0..count)
            .map(|i| {
                ensemble.draw(
                    geometry.light,
                    &mut RandomStream::Pattern(i as u32).start(self.seed),
                )
            })
            .collect::<Result<Vec<_>, _>>()?;
        let pictures = self.photographs(&codes, executor)?;
        let camera = self.camera();
        let code = 1.0 / (camera.white - camera.black);
        let mut measurements = Measurements {
            camera: geometry.camera,
            light: geometry.light,
            correspondence: geometry.correspondence,
            patterns: codes.iter().map(emitted).collect(),
            full_scale: vec![1.0; count],
            rows: Rows::all(geometry.camera.height),
            pictures,
            noise: Noise::from_dark(&self.dark()?, geometry.camera.width, code),
        };
        measurements.noise = Noise::with_gain_from(&measurements);
        Ok(measurements)
    }

    /// What the camera sees in the dark.
    fn dark(&self) -> Result<Picture, StudyError> {
        let black = vec![[0.0; CHANNELS]; self.scene.geometry().camera.area()];
        self.noisy(&black, 0)
    }

    /// One photograph for each light, in units of the measurement, less a dark photograph; NaN
    /// where saturated.
    pub(super) fn photographs(
        &self,
        lights: &[LightCodes],
        executor: &impl Executor,
    ) -> Result<Vec<Picture>, StudyError> {
        let mut pictures = self.pictures(lights, executor);
        let dark = self.dark()?;
        let mut done = 0;
        for batch in pictures.chunks_mut(BATCH) {
            let noisy = executor.map(batch.len(), |i| {
                self.noisy(&batch[i], (1 + done + i) as u32)
            });
            done += batch.len();
            for (picture, noisy) in batch.iter_mut().zip(noisy) {
                *picture = noisy?;
                for (y, dark) in picture.iter_mut().zip(&dark) {
                    *y = std::array::from_fn(|c| y[c] - dark[c]);
                }
            }
        }
        Ok(pictures)
    }

    /// Photograph number `number` of `picture`, with noise.
    pub(super) fn noisy(&self, picture: &Picture, number: u32) -> Result<Picture, StudyError> {
        let camera = self.camera();
        let mut noise = RandomStream::Photograph(number).start(self.seed);
        let codes = camera.photograph(picture, &mut noise)?;
        let linear = |code: u16| match f64::from(code) >= camera.white {
            true => f32::NAN,
            false => ((f64::from(code) - camera.black) / (camera.white - camera.black)) as f32,
        };
        Ok(codes.into_iter().map(|codes| codes.map(linear)).collect())
    }

    /// The scene under each light, without noise.
    fn pictures(&self, lights: &[LightCodes], executor: &impl Executor) -> Vec<Picture> {
        let geometry = self.scene.geometry();
        let emissions = EmissionMatrix::new(geometry.light, lights);
        let mut pictures = vec![vec![[0.0; CHANNELS]; geometry.camera.area()]; lights.len()];
        let across = geometry.tile_grid().width as usize;
        let tiles: Vec<_> = geometry.tiles().collect();
        // A row of tiles at a time bounds the memory.
        for row in tiles.chunks(across) {
            let seen = executor.map(row.len(), |i| {
                emissions.pictures(geometry, &self.scene.tile(row[i]))
            });
            for (rect, seen) in row.iter().zip(seen) {
                for (picture, seen) in pictures.iter_mut().zip(seen) {
                    for (pixel, y) in rect.pixels().zip(seen) {
                        picture[geometry.camera.index(pixel)] = y;
                    }
                }
            }
        }
        pictures
    }
}

fn emitted(codes: &LightCodes) -> Pattern {
    let linear = |code: &u8| emission(*code) as f32;
    match codes {
        LightCodes::Grey(codes) => Pattern::Grey(codes.iter().map(linear).collect()),
        LightCodes::Rgb(codes) => Pattern::Rgb(std::array::from_fn(|c| {
            codes.iter().map(|code| linear(&code[c])).collect()
        })),
    }
}

/// The first `count` shots of `measurements`, as if no others had been taken.
pub fn first_shots(measurements: &Measurements, count: usize) -> Measurements {
    let count = count.min(measurements.patterns.len());
    let mut first = Measurements {
        camera: measurements.camera,
        light: measurements.light,
        correspondence: measurements.correspondence,
        patterns: measurements.patterns[..count].to_vec(),
        full_scale: measurements.full_scale[..count].to_vec(),
        rows: measurements.rows.clone(),
        pictures: measurements.pictures[..count].to_vec(),
        noise: measurements.noise,
    };
    first.noise = Noise::with_gain_from(&first);
    first
}
