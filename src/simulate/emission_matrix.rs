//! y = pT under many lights at once, while a tile's transport is in memory.

use super::pattern_image::{PatternImage, emission};
use crate::transport::{CHANNELS, Extent, Geometry, TileTransportFunctions};

/// Emissions under many lights, `[M, columns]`: one column for each grey light, three for each RGB light. The
/// emissions of one element are contiguous, so that the sums over elements are vector operations.
#[derive(Clone, Debug)]
pub struct EmissionMatrix {
    light: Extent,
    columns: usize,
    emissions: Vec<f32>,
    /// The column of each light and camera channel.
    channels: Vec<[usize; CHANNELS]>,
}

impl EmissionMatrix {
    /// The emissions of `lights`, each of `light.area()` elements.
    pub fn new(light: Extent, lights: &[PatternImage]) -> Self {
        let mut channels = Vec::with_capacity(lights.len());
        let mut columns = 0;
        for codes in lights {
            match codes {
                PatternImage::Grey(_) => channels.push([columns; CHANNELS]),
                PatternImage::Rgb(_) => channels.push([columns, columns + 1, columns + 2]),
            }
            columns = channels.last().map_or(0, |c| c[CHANNELS - 1]) + 1;
        }
        let table: [f32; 256] = std::array::from_fn(|code| emission(code as u8) as f32);
        let mut emissions = vec![0.0; light.area() * columns];
        for (codes, channels) in lights.iter().zip(&channels) {
            for m in 0..light.area() {
                let row = &mut emissions[m * columns..(m + 1) * columns];
                let codes = match codes {
                    PatternImage::Grey(grey) => [grey[m]; CHANNELS],
                    PatternImage::Rgb(rgb) => rgb[m],
                };
                for (column, code) in channels.iter().zip(codes) {
                    row[*column] = table[usize::from(code)];
                }
            }
        }
        Self {
            light,
            columns,
            emissions,
            channels,
        }
    }

    /// A tile's pictures under every light, `[light][pixel]`, in units of the measurement.
    pub fn pictures(
        &self,
        geometry: &Geometry,
        functions: &TileTransportFunctions,
    ) -> Vec<Vec<[f32; CHANNELS]>> {
        let pixels = functions.rect.extent.area();
        let area = geometry.window.area();
        let mut pictures = vec![vec![[0.0; CHANNELS]; pixels]; self.channels.len()];
        let mut sums = vec![0.0f32; CHANNELS * self.columns];
        for (p, pixel) in functions.rect.pixels().enumerate() {
            sums.fill(0.0);
            let origin = geometry.window_origin(pixel);
            for (s, tau) in functions.tau[p * area..(p + 1) * area].iter().enumerate() {
                if *tau == [0.0; CHANNELS] {
                    continue;
                }
                let element = geometry.window.element(origin, s);
                if let Some(m) = element.index_in(self.light) {
                    let emissions = &self.emissions[m * self.columns..(m + 1) * self.columns];
                    for (sums, tau) in sums.chunks_exact_mut(self.columns).zip(tau) {
                        for (sum, e) in sums.iter_mut().zip(emissions) {
                            *sum += tau * e;
                        }
                    }
                }
            }
            for (picture, columns) in pictures.iter_mut().zip(&self.channels) {
                picture[p] = std::array::from_fn(|c| sums[c * self.columns + columns[c]]);
            }
        }
        pictures
    }
}
