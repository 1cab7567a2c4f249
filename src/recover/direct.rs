//! Recovery window by window, each on its own: what the paper does.

use std::collections::BTreeMap;

use super::design::Design;
use super::{CommonMode, FEWEST_PATTERNS, Nnls, RecoverError};
use crate::capture::Measurements;
use crate::transport::{
    CameraPx, Decibels, Element, Geometry, TileRect, TransportError, TransportFunctions,
};

/// Every how many patterns one is held out while the common mode's weight is chosen.
const HOLD_OUT_EVERY: usize = 10;
/// Windows the choice is made on, spread over the picture: enough that pixels tell candidates apart
/// by hundredths of a decibel, few enough to cost a second.
const SAMPLE_WINDOWS: usize = 48;

/// A solver of single windows, with what it chose on patterns held out.
#[derive(Clone, Copy, Debug)]
pub(super) struct Direct {
    geometry: Geometry,
    common_mode: CommonMode,
}

impl Direct {
    /// Chooses how far the common mode is trusted, on patterns held out.
    pub fn new(measurements: &Measurements, geometry: Geometry) -> Result<Self, RecoverError> {
        let mut direct = Self {
            geometry,
            common_mode: CommonMode::FULL,
        };
        direct.common_mode = direct.choose_common_mode(measurements)?;
        Ok(direct)
    }

    /// The weight chosen for the common mode.
    pub fn common_mode(&self) -> CommonMode {
        self.common_mode
    }

    /// Recovers the light transport functions of one tile.
    pub fn tile(&self, measurements: &Measurements, rect: TileRect) -> TransportFunctions {
        let area = self.geometry.window.area();
        let mut functions = TransportFunctions::zeros(rect, area);
        let rows: Vec<usize> = (0..measurements.patterns.len()).collect();
        for (origin, pixels) in self.windows(rect) {
            self.window(
                measurements,
                origin,
                &pixels,
                &rows,
                self.common_mode,
                |p, c, slots, x| {
                    for (&slot, &x) in slots.iter().zip(x) {
                        functions.tau[p * area + slot][c] = x as f32;
                    }
                },
            );
        }
        functions
    }

    /// All pixels of a tile by their common window: (number in the tile, pixel).
    fn windows(&self, rect: TileRect) -> BTreeMap<Element, Vec<(usize, CameraPx)>> {
        let mut windows: BTreeMap<_, Vec<_>> = BTreeMap::new();
        for (p, pixel) in rect.pixels().enumerate() {
            let origin = self.geometry.window_origin(pixel);
            windows.entry(origin).or_default().push((p, pixel));
        }
        windows
    }

    /// Solves for all pixels of one window from the patterns numbered `rows`; `take` gets each
    /// pixel's number, channel, and solution on the window slots.
    fn window(
        &self,
        measurements: &Measurements,
        origin: Element,
        pixels: &[(usize, CameraPx)],
        rows: &[usize],
        common_mode: CommonMode,
        mut take: impl FnMut(usize, usize, &[usize], &[f64]),
    ) {
        let design = |rows: &[usize], channel| {
            Design::new(
                &measurements.patterns,
                rows,
                channel,
                self.geometry.light,
                self.geometry.window,
                origin,
                common_mode,
            )
        };
        // Grey patterns drive all channels alike: one design for all of them.
        let groups: &[&[usize]] = match measurements.grey() {
            true => &[&[0, 1, 2]],
            false => &[&[0], &[1], &[2]],
        };
        for channels in groups {
            let shared = design(rows, channels[0]);
            let mut solver = Nnls::new(&shared.gram, shared.unknowns());
            for &(p, pixel) in pixels {
                for &c in *channels {
                    let usable: Vec<usize> = rows
                        .iter()
                        .copied()
                        .filter(|&l| measurements.sample(l, pixel, c).is_finite())
                        .collect();
                    if usable.len() == rows.len() || usable.len() < FEWEST_PATTERNS {
                        // Of a pixel saturated nearly always, all that is known is that it is at
                        // least white: it is shown so, not black.
                        let y: Vec<f64> = rows
                            .iter()
                            .map(|&l| match measurements.sample(l, pixel, c) {
                                y if y.is_finite() => y,
                                _ => f64::from(measurements.full_scale[l]),
                            })
                            .collect();
                        let x = solver.solve(&shared.right_hand_side(&y));
                        take(p, c, &shared.slots, &x);
                    } else {
                        // Saturated samples drop out, and with them the shared equations.
                        let own = design(&usable, c);
                        let y: Vec<f64> = usable
                            .iter()
                            .map(|&l| measurements.sample(l, pixel, c))
                            .collect();
                        let x =
                            Nnls::new(&own.gram, own.unknowns()).solve(&own.right_hand_side(&y));
                        take(p, c, &own.slots, &x);
                    }
                }
            }
        }
    }

    /// Tries every candidate on a spread of windows and keeps the one that predicts held-out
    /// patterns best.
    fn choose_common_mode(&self, measurements: &Measurements) -> Result<CommonMode, RecoverError> {
        let mut windows = BTreeMap::new();
        let covered = self
            .geometry
            .tiles()
            .filter(|&tile| measurements.covers(tile));
        for rect in covered {
            let lit = self.windows(rect).into_iter();
            for (origin, mut pixels) in lit.filter(|&(origin, _)| !self.dark(origin)) {
                pixels.truncate(1); // One pixel a window is enough to choose by.
                windows.insert(origin, pixels);
            }
        }
        if windows.is_empty() {
            return Err(RecoverError::NoLight);
        }
        let every = windows.len().div_ceil(SAMPLE_WINDOWS);
        let (held, rows): (Vec<usize>, Vec<usize>) = (0..measurements.patterns.len())
            .partition(|l| l % HOLD_OUT_EVERY == HOLD_OUT_EVERY / 2);
        if held.is_empty() || rows.len() < FEWEST_PATTERNS {
            return Ok(CommonMode::FULL);
        }
        let mut best: Option<(Decibels, CommonMode)> = None;
        for candidate in CommonMode::CANDIDATES {
            let mut error = TransportError::default();
            for (&origin, pixels) in windows.iter().step_by(every) {
                self.window(
                    measurements,
                    origin,
                    pixels,
                    &rows,
                    candidate,
                    |_, c, slots, x| {
                        for &l in &held {
                            let y = measurements.sample(l, pixels[0].1, c);
                            if y.is_finite() {
                                error.add(y, self.predict(measurements, l, c, origin, slots, x));
                            }
                        }
                    },
                );
            }
            if let Some(snr) = error.snr()
                && best.is_none_or(|(most, _)| snr > most)
            {
                best = Some((snr, candidate));
            }
        }
        Ok(best.map_or(CommonMode::FULL, |(_, candidate)| candidate))
    }

    /// What solution `x` says a pixel of the window sees under pattern `l`.
    fn predict(
        &self,
        measurements: &Measurements,
        l: usize,
        c: usize,
        origin: Element,
        slots: &[usize],
        x: &[f64],
    ) -> f64 {
        let plane = measurements.patterns[l].plane(c);
        let terms = slots.iter().zip(x).filter_map(|(&slot, &x)| {
            let element = self.geometry.window.element(origin, slot);
            let m = element.index_in(self.geometry.light)?;
            Some(f64::from(plane[m]) * x)
        });
        terms.sum()
    }

    /// Whether all of the window lies off the display.
    fn dark(&self, origin: Element) -> bool {
        let side = i64::from(self.geometry.window.side());
        let misses =
            |at: i32, length: u32| i64::from(at) + side <= 0 || i64::from(at) >= i64::from(length);
        misses(origin.u, self.geometry.light.width) || misses(origin.v, self.geometry.light.height)
    }
}
