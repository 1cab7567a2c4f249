//! The search for an exposure time: the longest at which the flood photograph stays below saturation.

/// Brightness of the brightest part of the flood photograph, as a share of white, that an exposure may reach: half a stop
/// below saturation, for objects that are brighter under a pattern's neighbours than expected, and for lamps that drift.
pub const MAX_FLOOD: f64 = 0.7;
/// Brightness of the brightest part below which the longest exposure is too dark: noise is twice as high as it could be.
pub const MIN_FLOOD: f64 = 0.2;

/// Exposure times of a camera, and how bright the flood photograph is at each.
#[derive(Clone, Debug, PartialEq)]
pub struct ExposureSearch {
    /// Seconds, rising.
    seconds: Vec<f64>,
    /// Brightness of the brightest part as a share of white; infinite if it is saturated, `None` if it is not measured.
    brightest: Vec<Option<f64>>,
}

/// What the search needs next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ExposureStep {
    /// A flood photograph with the exposure time of this index.
    Photograph(usize),
    /// Nothing: this exposure time suits.
    Found(usize),
    /// Even the shortest time is too bright.
    TooBright,
    /// Even the longest time, of this index, is too dark: its flood photograph has this brightness.
    TooDark(usize, f64),
}

impl ExposureSearch {
    /// Of these exposure times in seconds, which rise.
    pub fn new(seconds: Vec<f64>) -> Self {
        Self {
            brightest: vec![None; seconds.len()],
            seconds,
        }
    }

    /// Adds what a flood photograph with the exposure time of index `i` shows.
    pub fn add(&mut self, i: usize, brightest: f64, is_saturated: bool) {
        self.brightest[i] = Some(if is_saturated {
            f64::INFINITY
        } else {
            brightest
        });
    }

    /// The next step. Ends after as many photographs as there are exposure times, at most.
    pub fn step(&self) -> ExposureStep {
        let last = self.seconds.len() - 1;
        let measured = |i: &usize| self.brightest[*i].is_some_and(f64::is_finite);
        let Some(known) = (0..=last).rev().find(measured) else {
            let saturated = (0..=last).find(|&i| self.brightest[i].is_some());
            return match saturated {
                None => ExposureStep::Photograph(last / 2),
                Some(0) => ExposureStep::TooBright,
                Some(i) => ExposureStep::Photograph(self.near(self.seconds[i] / 4.0).min(i - 1)),
            };
        };
        let at_known = self.brightest[known].unwrap_or(f64::INFINITY);
        let predicted = |i: usize| {
            let scaled = at_known * self.seconds[i] / self.seconds[known];
            self.brightest[i].unwrap_or(scaled)
        };
        let Some(best) = (0..=last).rev().find(|&i| predicted(i) <= MAX_FLOOD) else {
            return match self.brightest[0] {
                None => ExposureStep::Photograph(0),
                Some(_) => ExposureStep::TooBright,
            };
        };
        match self.brightest[best] {
            None => ExposureStep::Photograph(best),
            Some(brightest) if best == last && brightest < MIN_FLOOD => {
                ExposureStep::TooDark(best, brightest)
            }
            Some(_) => ExposureStep::Found(best),
        }
    }

    /// The longest time that is not longer than `seconds`.
    fn near(&self, seconds: f64) -> usize {
        self.seconds
            .partition_point(|s| *s <= seconds)
            .saturating_sub(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMES: [f64; 7] = [0.002, 0.004, 0.008, 0.017, 0.033, 0.067, 0.125];

    /// Runs a search whose flood photograph has a brightness of `rate` a second, and saturates from 1 on. Returns the last
    /// step and the number of photographs.
    fn search(rate: f64) -> (ExposureStep, usize) {
        let mut search = ExposureSearch::new(TIMES.to_vec());
        for photographs in 0..=TIMES.len() {
            match search.step() {
                ExposureStep::Photograph(i) => {
                    assert_eq!(search.brightest[i], None, "photographed again");
                    search.add(i, rate * TIMES[i], rate * TIMES[i] >= 1.0);
                }
                end => return (end, photographs),
            }
        }
        panic!("{rate}: does not end");
    }

    #[test]
    fn the_longest_time_below_saturation_is_found_with_few_photographs() {
        for rate in [3.0, 5.0, 9.0, 20.0, 41.0, 80.0, 170.0, 340.0] {
            let (step, photographs) = search(rate);
            let expected = TIMES.iter().rposition(|s| rate * s <= MAX_FLOOD).unwrap();
            assert_eq!(step, ExposureStep::Found(expected), "{rate}");
            assert!(photographs <= 4, "{rate}: {photographs}");
        }
    }

    #[test]
    fn light_beyond_all_times_is_told() {
        assert_eq!(search(1000.0).0, ExposureStep::TooBright);
        assert_eq!(search(400.0).0, ExposureStep::TooBright);
        let (step, _) = search(0.8);
        assert!(
            matches!(step, ExposureStep::TooDark(6, brightest) if (brightest - 0.1).abs() < 1e-9)
        );
    }

    #[test]
    fn one_time_is_judged() {
        let mut search = ExposureSearch::new(vec![0.1]);
        assert_eq!(search.step(), ExposureStep::Photograph(0));
        search.add(0, 0.5, false);
        assert_eq!(search.step(), ExposureStep::Found(0));
        search.add(0, 0.9, false);
        assert_eq!(search.step(), ExposureStep::TooBright);
    }
}
