//! Which camera pixels the preparation of a recovery reads.
//!
//! A recovery is prepared from small squares that are spread over the picture. Of a large picture they are a small part, so
//! that photographs that do not fit in memory need not be loaded whole. The squares depend on the camera grid alone: a
//! recovery is the same whatever else is loaded.

use super::learned;
use super::method::Method;
use super::photometry::{BLOCK_SIDE, GRADIENT_MARGIN, HALO};
use super::sampling::{MAX_SMALL_PICTURE, with_margin};
use super::{holdout_validation, mean_function, window_size};
use crate::capture::{CameraPixelSet, DEFECT_MARGIN, noise_sample_squares};
use crate::transport::{Extent, TileRect, Window};

/// The pixels of a `camera` grid that preparing a recovery by `method` reads, those that fill their defective pixels
/// included; `window` is `None` if it is estimated. Small pictures are read whole.
pub fn preparation_pixels(
    camera: Extent,
    method: Method,
    window: Option<Window>,
) -> CameraPixelSet {
    if camera.area() <= MAX_SMALL_PICTURE {
        return CameraPixelSet::all(camera);
    }
    // Shifted photographs are resampled in blocks, from what is around each block.
    let resampled = |rect: TileRect, margin: u32| {
        let blocks = blocks_of(camera, with_margin(camera, rect, margin));
        with_margin(camera, blocks, HALO)
    };
    let mut rects: Vec<TileRect> = noise_sample_squares(camera).collect();
    if window.is_none() {
        rects.extend(window_size::sample_squares(camera));
    }
    let squares = mean_function::sample_squares(camera).into_iter();
    rects.extend(squares.map(|square| resampled(square, GRADIENT_MARGIN)));
    let halo = method.max_solver_halo();
    let squares = holdout_validation::sample_squares(camera).into_iter();
    rects.extend(squares.map(|square| resampled(square, halo)));
    if method == Method::Learned {
        let regions = learned::sample_regions(camera).into_iter();
        rects.extend(regions.map(|region| resampled(region, halo)));
    }
    // Defective pixels are filled from neighbours in the row.
    let with_neighbours = |rect: &TileRect| {
        let wider = with_margin(camera, *rect, DEFECT_MARGIN);
        let extent = Extent::new(wider.extent.width, rect.extent.height);
        TileRect {
            x: wider.x,
            extent,
            ..*rect
        }
    };
    let rects: Vec<TileRect> = rects.iter().map(with_neighbours).collect();
    CameraPixelSet::union(camera, &rects)
}

/// The pixels of all blocks that have pixels of `rect`.
fn blocks_of(camera: Extent, rect: TileRect) -> TileRect {
    let first = |start: u32| start / BLOCK_SIDE * BLOCK_SIDE;
    let end = |end: u32, side: u32| end.next_multiple_of(BLOCK_SIDE).min(side);
    let (x, y) = (first(rect.x), first(rect.y));
    TileRect {
        x,
        y,
        extent: Extent::new(
            end(rect.x + rect.extent.width, camera.width) - x,
            end(rect.y + rect.extent.height, camera.height) - y,
        ),
    }
}

#[cfg(feature = "capture")]
#[cfg(test)]
mod tests {
    use super::super::test_problems::uniform;
    use super::super::{
        PreparedRecovery, RecoverySettings, SparsityBasis, WindowSizeEstimate, diagnose,
    };
    use super::*;
    use crate::capture::{LinearPhoto, Measurements, NoiseModel, Pattern};
    use crate::job_executor::SequentialExecutor;
    use crate::transport::{CHANNELS, CameraPixel, Correspondence};

    /// Just above a small picture, and not a multiple of any square.
    const CAMERA: Extent = Extent::new(805, 652);
    const LIGHT: Extent = Extent::new(51, 41);
    const PATTERNS: usize = 30;
    const WINDOW: u32 = 5;
    /// Distance of two codes.
    const QUANTUM: f64 = 1e-4;

    /// Photographs of a camera that trembles, with hot and dead pixels that are not filled yet.
    fn trembling_capture() -> Measurements {
        let mut random = uniform(5);
        let mut random = || random() + 0.5;
        let patterns: Vec<Vec<f32>> = (0..PATTERNS)
            .map(|_| (0..LIGHT.area()).map(|_| random() as f32).collect())
            .collect();
        let correspondence = Correspondence::from_affine([
            [f64::from(LIGHT.width) / f64::from(CAMERA.width), 0.0, 0.0],
            [0.0, f64::from(LIGHT.height) / f64::from(CAMERA.height), 0.0],
        ]);
        // A function with one peak, whose place and brightness vary over the picture.
        let mut photos = vec![LinearPhoto::new(); PATTERNS];
        for (x, y) in CAMERA.cells() {
            let place = correspondence.at(CameraPixel { x, y });
            let (fx, fy) = (f64::from(x), f64::from(y));
            let brightness = 0.3 + 0.1 * (0.8 * fx).sin() * (0.6 * fy).cos();
            let centre = [
                place.u - 0.5 + 0.7 * (0.013 * fx).sin(),
                place.v - 0.5 + 0.7 * (0.017 * fy).cos(),
            ];
            let mut elements = Vec::with_capacity(25);
            for v in (centre[1] as i64 - 2)..=(centre[1] as i64 + 2) {
                for u in (centre[0] as i64 - 2)..=(centre[0] as i64 + 2) {
                    let (du, dv) = (u as f64 - centre[0], v as f64 - centre[1]);
                    let is_in = (0..i64::from(LIGHT.width)).contains(&u)
                        && (0..i64::from(LIGHT.height)).contains(&v);
                    if is_in {
                        let m = v as usize * LIGHT.width as usize + u as usize;
                        elements.push((m, 0.3 * libm::exp(-du * du - dv * dv)));
                    }
                }
            }
            for (photo, pattern) in photos.iter_mut().zip(&patterns) {
                let light = elements.iter().map(|&(m, h)| h * f64::from(pattern[m]));
                let light = brightness * light.sum::<f64>();
                photo.push([1.0, 0.8, 0.5].map(|c| (c * light) as f32));
            }
        }
        let flood =
            photos
                .iter()
                .fold(vec![[0.0f32; CHANNELS]; CAMERA.area()], |mut sum, photo| {
                    let pixels = sum.as_flattened_mut().iter_mut().zip(photo.as_flattened());
                    pixels.for_each(|(sum, y)| *sum += y / 12.0);
                    sum
                });
        // Shifted to the left by part of a pixel, and rounded to codes with the noise that rounds them fairly.
        let mut noise = uniform(9);
        for photo in &mut photos {
            let shift = 0.3 * random() as f32;
            for n in 0..CAMERA.area() - 1 {
                let next = photo[n + 1];
                for c in 0..CHANNELS {
                    let y = f64::from(photo[n][c] + shift * (next[c] - photo[n][c]));
                    let code = (y / QUANTUM + noise()).round();
                    photo[n][c] = (code * QUANTUM) as f32;
                }
            }
            for n in (0..CAMERA.area()).step_by(397) {
                photo[n] = [f32::NAN; CHANNELS];
            }
            for n in (0..CAMERA.area()).step_by(419) {
                photo[n] = [0.0; CHANNELS];
            }
        }
        Measurements {
            camera: CAMERA,
            light: LIGHT,
            correspondence,
            patterns: patterns.into_iter().map(Pattern::Grey).collect(),
            full_scale: vec![1.0; PATTERNS],
            loaded: CameraPixelSet::all(CAMERA),
            photos,
            flood: Some(flood),
            noise: NoiseModel {
                gain: [0.0; CHANNELS],
                floor: [0.5 * QUANTUM * QUANTUM; CHANNELS],
            },
        }
    }

    /// The measurements with only these pixels loaded.
    fn loaded(measurements: &Measurements, pixels: &CameraPixelSet) -> Measurements {
        let crop = |photo: &LinearPhoto| -> LinearPhoto {
            let rects = pixels.rects().flat_map(TileRect::pixels);
            rects.map(|pixel| photo[CAMERA.index(pixel)]).collect()
        };
        Measurements {
            loaded: pixels.clone(),
            photos: measurements.photos.iter().map(crop).collect(),
            flood: measurements.flood.as_ref().map(crop),
            patterns: measurements.patterns.clone(),
            correspondence: measurements.correspondence.clone(),
            full_scale: measurements.full_scale.clone(),
            ..*measurements
        }
    }

    /// All that is learned, chosen and found, as text.
    fn prepare(mut measurements: Measurements, method: Method, window: Option<Window>) -> String {
        let executor = &SequentialExecutor;
        measurements.fill_defective_pixels(0..u32::MAX, QUANTUM);
        measurements.noise = NoiseModel::with_gain_from(&measurements);
        pollster::block_on(async {
            let estimate = match window {
                Some(_) => None,
                None => WindowSizeEstimate::from_measurements(&measurements, executor)
                    .await
                    .ok(),
            };
            let settings = RecoverySettings {
                method,
                window: Window::new(WINDOW).unwrap(),
                is_registered: true,
            };
            let recovery = PreparedRecovery::prepare(&measurements, settings, executor).await;
            let recovery = recovery.unwrap_or_else(|error| panic!("{method:?}: {error}"));
            assert!(recovery.corrections().iter().any(|c| c.is_shifted()));
            let validation = recovery.holdout_validation().unwrap();
            let tiles: Vec<_> = validation.tiles().collect();
            let shots: Vec<usize> = (0..PATTERNS).collect();
            let diagnosis = diagnose(&measurements, settings.window, &shots, &[], executor);
            format!(
                "{} {:?} {:?} {:?} {:?} {estimate:?} {:?} {:?} {:?} {diagnosis:?}",
                serde_json::to_string(&recovery).unwrap(),
                measurements.noise,
                validation.snr(),
                tiles,
                recovery.sample_tiles(&measurements, executor),
                recovery.flicker(&measurements, executor),
                recovery.flood_shortfall(&measurements, 1.0, executor),
                recovery.response(&measurements, 1.0, executor).await,
            )
        })
    }

    #[test]
    fn a_preparation_reads_no_other_pixels() {
        let all = trembling_capture();
        // Estimating the window reads more.
        let estimated = (Method::Bpdn(SparsityBasis::Identity), None);
        for (method, window) in [(Method::Learned, Window::new(WINDOW).ok()), estimated] {
            let pixels = preparation_pixels(CAMERA, method, window);
            assert!(pixels.count() < CAMERA.area() * 3 / 4);
            let sample = loaded(&all, &pixels);
            assert!(
                prepare(sample, method, window) == prepare(all.clone(), method, window),
                "{method:?} depends on what is loaded"
            );
        }
    }

    #[test]
    fn only_parts_of_large_pictures_are_read() {
        let small = Extent::new(724, 724);
        let pixels = |camera| preparation_pixels(camera, Method::Learned, None);
        assert_eq!(pixels(small), CameraPixelSet::all(small));
        assert!(pixels(CAMERA).count() < CAMERA.area());
        let nnls = preparation_pixels(CAMERA, Method::Nnls, None);
        assert!(2 * nnls.count() < CAMERA.area());
        // Their number does not grow with the picture.
        let [large, larger] = [4000, 16_000].map(|side| pixels(Extent::new(side, side)).count());
        assert!(large < 560_000 && larger < 560_000, "{large} {larger}");
    }
}
