//! Whether a photograph shows its pattern, in the middle of a session: by the brightness of a few parts of the picture.
//!
//! Gray code and flood photograph say which light elements light which part of the picture. A pattern's light on a part is
//! then known up to what the object scatters: by a blur of the pattern, whose width is that which fits best.

use std::collections::BTreeMap;

use crate::transport::{CameraPixel, Correspondence, Extent};

/// Radii of the blur, in light elements.
const BLUR_RADII: [u32; 5] = [0, 1, 2, 4, 7];
/// Parts darker than this under the flood, relative to the brightest, say nothing.
const MIN_FLOOD: f64 = 0.05;
/// Fewer parts do not tell patterns apart.
const MIN_PARTS: usize = 40;
/// Least correlation of a photograph with its pattern.
const MIN_CORRELATION: f64 = 0.3;
/// By how much the correlation with another pattern must be higher.
const MIN_LEAD: f64 = 0.2;
/// Share of the light of the picture before, above which a photograph is a blend.
const MIN_BLEND: f64 = 0.1;
/// Standard errors by which that share must be above zero.
const MIN_SIGNIFICANCE: f64 = 4.0;
/// Brightness, relative to the expected one, that is no change of the exposure: lamps drift, displays dim bright pictures, and
/// objects scatter light out of the picture.
const BRIGHTNESS: std::ops::RangeInclusive<f64> = 0.7..=1.4;

/// Which light elements light which part of the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct PatternPrediction {
    light: Extent,
    /// Elements with their light in the flood photograph, one list for each part.
    parts: Vec<Vec<(usize, f64)>>,
    /// Light of each part in the flood photograph: the sum of the above.
    flood: Vec<f64>,
}

/// What a photograph shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ShownPattern {
    /// Its pattern, or too little is known.
    Own,
    /// The pattern of this index.
    Other(usize),
    /// No pattern of the list: this is the correlation with its own.
    Unknown(f64),
    /// Its own, with this share of the light from the picture that was shown before.
    Blend(f64),
    /// Its own, this many times as bright as the flood photograph lets expect.
    Exposure(f64),
}

impl PatternPrediction {
    /// From the light of camera pixels in the flood photograph; `part` is that of a pixel.
    pub fn new(
        light: Extent,
        correspondence: &Correspondence,
        camera: Extent,
        part: impl Fn(u32, u32) -> usize,
        flood: impl Fn(u32, u32) -> f64,
    ) -> Self {
        let mut parts: Vec<BTreeMap<usize, f64>> = Vec::new();
        for (x, y) in camera.cells() {
            let at = correspondence.at(CameraPixel { x, y });
            let (u, v) = (at.u.floor(), at.v.floor());
            let is_inside = (0.0..f64::from(light.width)).contains(&u)
                && (0.0..f64::from(light.height)).contains(&v);
            let part = part(x, y);
            if parts.len() <= part {
                parts.resize_with(part + 1, BTreeMap::new);
            }
            if is_inside {
                let element = v as usize * light.width as usize + u as usize;
                *parts[part].entry(element).or_default() += flood(x, y).max(0.0);
            }
        }
        let parts: Vec<Vec<(usize, f64)>> = parts
            .into_iter()
            .map(|part| part.into_iter().collect())
            .collect();
        let sum = |part: &Vec<(usize, f64)>| part.iter().map(|(_, light)| light).sum();
        Self {
            light,
            flood: parts.iter().map(sum).collect(),
            parts,
        }
    }

    /// Each part's light under `emissions`, `[M]`, blurred by `radius`, as a share of its light under the flood.
    fn shares(&self, emissions: &[f32], radius: u32) -> Vec<f64> {
        let emissions = &blurred(emissions, self.light, radius)[..];
        let light = |part: &Vec<(usize, f64)>| -> f64 {
            let lit = part
                .iter()
                .map(|(element, light)| light * f64::from(emissions[*element]));
            lit.sum()
        };
        let shares = self.parts.iter().zip(&self.flood);
        shares
            .map(|(part, flood)| light(part) / flood.max(f64::MIN_POSITIVE))
            .collect()
    }

    /// Whether enough parts of the picture are lit to tell patterns apart.
    pub fn is_conclusive(&self) -> bool {
        self.weights()
            .iter()
            .filter(|weight| **weight > 0.0)
            .count()
            >= MIN_PARTS
    }

    /// The parts' light under the flood; zero of those that are too dark.
    fn weights(&self) -> Vec<f64> {
        let brightest = self.flood.iter().copied().fold(0.0, f64::max);
        let weight = |flood: &f64| match *flood > MIN_FLOOD * brightest {
            true => *flood,
            false => 0.0,
        };
        self.flood.iter().map(weight).collect()
    }

    /// What a photograph shows whose parts have `measured` of the light that they have in the flood photograph.
    /// `patterns` are the emissions `[M]` of all patterns, `own` is the index of its own, and `before` are the emissions of
    /// the picture that was shown before.
    pub fn judge(
        &self,
        measured: &[f64],
        patterns: &[impl AsRef<[f32]>],
        own: usize,
        before: Option<&[f32]>,
    ) -> ShownPattern {
        if !self.is_conclusive() {
            return ShownPattern::Own;
        }
        let weights = self.weights();
        let sum = |values: &[f64]| -> f64 {
            let weighted = values.iter().zip(&weights);
            weighted.map(|(value, weight)| value * weight).sum()
        };
        let unblurred = self.shares(patterns[own].as_ref(), 0);
        let brightness = sum(measured) / sum(&unblurred).max(f64::MIN_POSITIVE);
        let centred = |values: &[f64]| centred(values, &weights);
        let measured = centred(measured);
        let dot = |a: &[f64], b: &[f64]| -> f64 {
            let products = a.iter().zip(b).zip(&weights);
            products.map(|((a, b), weight)| weight * a * b).sum()
        };
        let correlation = |other: &[f64]| {
            let norm = (dot(&measured, &measured) * dot(other, other)).sqrt();
            dot(&measured, other) / norm.max(f64::MIN_POSITIVE)
        };
        let predicted = |emissions: &[f32], radius: u32| centred(&self.shares(emissions, radius));
        let candidates =
            BLUR_RADII.map(|radius| (radius, predicted(patterns[own].as_ref(), radius)));
        let fits = candidates.into_iter().max_by(|a, b| {
            let [a, b] = [a, b].map(|(_, expected)| correlation(expected));
            a.total_cmp(&b)
        });
        let (radius, expected) = fits.unwrap_or_default();
        let own_correlation = correlation(&expected);
        let others = (0..patterns.len()).filter(|&i| i != own);
        let others = others.map(|i| (i, correlation(&predicted(patterns[i].as_ref(), radius))));
        let best = others.max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((other, lead)) = best
            && lead > own_correlation + MIN_LEAD
        {
            return ShownPattern::Other(other);
        }
        if own_correlation < MIN_CORRELATION {
            return ShownPattern::Unknown(own_correlation);
        }
        if !BRIGHTNESS.contains(&brightness) {
            return ShownPattern::Exposure(brightness);
        }
        let Some(before) = before.map(|before| predicted(before, radius)) else {
            return ShownPattern::Own;
        };
        // Least squares: measured = a expected + b before.
        let (xx, xz, zz) = (
            dot(&expected, &expected),
            dot(&expected, &before),
            dot(&before, &before),
        );
        let (xy, zy) = (dot(&expected, &measured), dot(&before, &measured));
        let determinant = xx * zz - xz * xz;
        // The picture before is dark, the flood, or the same.
        if determinant < 0.1 * xx * zz || zz < 0.1 * xx {
            return ShownPattern::Own;
        }
        let a = (zz * xy - xz * zy) / determinant;
        let b = (xx * zy - xz * xy) / determinant;
        let left = dot(&measured, &measured) - a * xy - b * zy;
        let count = weights.iter().filter(|weight| **weight > 0.0).count() as f64;
        let error = (left.max(0.0) / (count - 2.0) * xx / determinant).sqrt();
        let share = b / (a + b);
        match share > MIN_BLEND && b > MIN_SIGNIFICANCE * error {
            true => ShownPattern::Blend(share),
            false => ShownPattern::Own,
        }
    }
}

/// Means of squares of `2 radius + 1` light elements, taken twice, so that those in the middle weigh most.
fn blurred(emissions: &[f32], light: Extent, radius: u32) -> Vec<f32> {
    if radius == 0 {
        return emissions.to_vec();
    }
    let [width, height] = [light.width, light.height].map(|side| side as usize);
    let mut plane = emissions.to_vec();
    for _ in 0..2 {
        let rows = plane.chunks_exact(width);
        let across: Vec<f32> = rows
            .flat_map(|row| box_means(row.iter().copied(), radius))
            .collect();
        for u in 0..width {
            let column = (0..height).map(|v| across[v * width + u]);
            for (v, mean) in box_means(column, radius).into_iter().enumerate() {
                plane[v * width + u] = mean;
            }
        }
    }
    plane
}

/// Means of the neighbours up to `radius` away that there are: as shares of the flood's, which lacks the others as well.
fn box_means(values: impl Iterator<Item = f32>, radius: u32) -> Vec<f32> {
    let radius = radius as usize;
    let mut sums = vec![0.0f64];
    for value in values {
        sums.push(sums[sums.len() - 1] + f64::from(value));
    }
    let count = sums.len() - 1;
    let mean = |i: usize| {
        let (first, end) = (i.saturating_sub(radius), (i + radius + 1).min(count));
        ((sums[end] - sums[first]) / (end - first) as f64) as f32
    };
    (0..count).map(mean).collect()
}

/// Differences from the weighted mean; zero where the weight is.
fn centred(values: &[f64], weights: &[f64]) -> Vec<f64> {
    let total: f64 = weights.iter().sum();
    let weighted = values.iter().zip(weights);
    let mean = weighted.map(|(value, weight)| value * weight).sum::<f64>() / total;
    let difference = |(value, weight): (&f64, &f64)| match *weight > 0.0 {
        true => value - mean,
        false => 0.0,
    };
    values.iter().zip(weights).map(difference).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::RandomStreamId;
    use rand_distr::{Distribution, StandardUniform};

    const LIGHT: Extent = Extent::new(32, 24);
    const CAMERA: Extent = Extent::new(96, 80);

    /// Part of a pixel, of 8 × 8 of them.
    fn part(x: u32, y: u32) -> usize {
        (y * 8 / CAMERA.height * 8 + x * 8 / CAMERA.width) as usize
    }

    /// A camera that sees the light plane from a third of a pixel an element.
    fn correspondence() -> Correspondence {
        Correspondence::from_affine([[0.3, 0.02, 0.5], [-0.01, 0.28, 0.4]])
    }

    fn flood(x: u32, y: u32) -> f64 {
        1.0 + 0.5 * f64::from(x % 7) + 0.1 * f64::from(y % 5)
    }

    /// Random patterns, and the parts' light under each as a share of that under the flood, scattered over 5 × 5 elements.
    fn patterns() -> (Vec<Vec<f32>>, Vec<Vec<f64>>) {
        let mut random = RandomStreamId::Fault.start(2);
        let mut draw = || {
            let share: f64 = StandardUniform.sample(&mut random);
            f32::from(u8::from(share < 0.5))
        };
        let patterns: Vec<Vec<f32>> = (0..12)
            .map(|_| (0..LIGHT.area()).map(|_| draw()).collect())
            .collect();
        let scattered = |pattern: &Vec<f32>, u: i64, v: i64| -> f64 {
            let range = |n: i64| (n - 2)..=(n + 2);
            let lit = range(v).flat_map(|v| range(u).map(move |u| (u, v)));
            let inside = lit.filter(|(u, v)| (0..32).contains(u) && (0..24).contains(v));
            let emitted = inside.map(|(u, v)| f64::from(pattern[(v * 32 + u) as usize]));
            emitted.sum()
        };
        let ones = vec![1.0; LIGHT.area()];
        let measured = |pattern: &Vec<f32>| {
            let (mut lit, mut full) = (vec![0.0; 64], vec![0.0; 64]);
            for (x, y) in CAMERA.cells() {
                let at = correspondence().at(CameraPixel { x, y });
                let light = flood(x, y);
                lit[part(x, y)] += light * scattered(pattern, at.u as i64, at.v as i64);
                full[part(x, y)] += light * scattered(&ones, at.u as i64, at.v as i64);
            }
            lit.iter()
                .zip(&full)
                .map(|(lit, full)| lit / full)
                .collect()
        };
        let measured = patterns.iter().map(measured).collect();
        (patterns, measured)
    }

    fn prediction() -> PatternPrediction {
        PatternPrediction::new(LIGHT, &correspondence(), CAMERA, part, flood)
    }

    #[test]
    fn photographs_of_their_patterns_pass() {
        let (patterns, measured) = patterns();
        for own in 1..patterns.len() {
            // A lamp that has become darker changes nothing.
            let dimmed: Vec<f64> = measured[own].iter().map(|share| 0.8 * share).collect();
            let before = Some(&patterns[own - 1][..]);
            let shown = prediction().judge(&dimmed, &patterns, own, before);
            assert_eq!(shown, ShownPattern::Own, "{own}");
        }
    }

    #[test]
    fn other_patterns_are_named() {
        let (patterns, measured) = patterns();
        let judge = |measured: &[f64]| prediction().judge(measured, &patterns, 5, None);
        assert_eq!(judge(&measured[4]), ShownPattern::Other(4));
        assert_eq!(judge(&measured[9]), ShownPattern::Other(9));
        let reversed: Vec<f64> = measured[5].iter().rev().copied().collect();
        assert!(matches!(
            judge(&reversed),
            ShownPattern::Unknown(_) | ShownPattern::Other(_)
        ));
    }

    #[test]
    fn another_exposure_is_measured() {
        let (patterns, measured) = patterns();
        let darker: Vec<f64> = measured[3].iter().map(|share| 0.5 * share).collect();
        let shown = prediction().judge(&darker, &patterns, 3, None);
        assert!(
            matches!(shown, ShownPattern::Exposure(gain) if (gain - 0.5).abs() < 0.05),
            "{shown:?}"
        );
    }

    #[test]
    fn a_blend_of_two_patterns_is_measured() {
        let (patterns, measured) = patterns();
        let blend: Vec<f64> = (measured[6].iter().zip(&measured[5]))
            .map(|(own, before)| 0.7 * own + 0.3 * before)
            .collect();
        let shown = prediction().judge(&blend, &patterns, 6, Some(&patterns[5]));
        assert!(
            matches!(shown, ShownPattern::Blend(share) if (share - 0.3).abs() < 0.1),
            "{shown:?}"
        );
        let flood = vec![1.0; LIGHT.area()];
        let shown = prediction().judge(&measured[6], &patterns, 6, Some(&flood));
        assert_eq!(shown, ShownPattern::Own);
    }

    #[test]
    fn too_few_parts_say_nothing() {
        let one = |_: u32, _: u32| 0;
        let prediction = PatternPrediction::new(LIGHT, &correspondence(), CAMERA, one, flood);
        let patterns = vec![vec![0.0; LIGHT.area()]; 2];
        assert!(!prediction.is_conclusive());
        let shown = prediction.judge(&[0.3], &patterns, 0, None);
        assert_eq!(shown, ShownPattern::Own);
    }
}
