//! Photographs before those of the session: they find the exposure time, and how long the display takes to change.

use std::time::Duration;

use anyhow::{Context, Result, bail};

use super::camera::Exposure;
use super::photographer::{FailedAttempt, Photographer, Taken};
use super::session_store::SessionStore;
use crate::acquisition::{ExposureSearch, ExposureStep, MAX_FLOOD, MIN_FLOOD, PictureRole};
use crate::cli::assemble::PhotographLevels;

/// Share of the flood's light that may be left when the dark picture is photographed.
const MAX_AFTERGLOW: f64 = 0.005;
/// Light of the flood, as a share of white, from which an afterglow can be measured.
const MIN_FLOOD_LIGHT: f64 = 0.01;
/// Longest wait that is tried.
const MAX_SETTLE: Duration = Duration::from_secs(5);
/// Least wait after a doubling.
const MIN_SETTLE: Duration = Duration::from_millis(100);
/// A display has changed after so many waits, if it has nearly changed after one.
const LATE_WAITS: u32 = 3;

/// What the exposure that was chosen leads to.
pub struct ChosenExposure {
    /// Brightness of the brightest part of the flood, as a share of white.
    pub flood_brightness: f64,
    /// Whether the operator goes on although it is saturated.
    pub is_saturation_accepted: bool,
}

impl Photographer<'_> {
    /// Finds the exposure time of the flood among `exposures`, which rise, or asks the operator for it if there are none.
    ///
    /// # Errors
    /// If even the shortest is too bright, or no photograph can be taken.
    pub fn find_exposure(
        &mut self,
        store: &SessionStore,
        exposures: &[Exposure],
    ) -> Result<ChosenExposure> {
        let flood = store.sequence.position(&PictureRole::Flood);
        let flood = flood.context("the sequence has no flood")?;
        if exposures.is_empty() {
            return self.ask_for_exposure(store, flood);
        }
        let mut search =
            ExposureSearch::new(exposures.iter().map(|exposure| exposure.seconds).collect());
        let mut measured = vec![0.0; exposures.len()];
        let chosen = |flood_brightness: f64| ChosenExposure {
            flood_brightness,
            is_saturation_accepted: false,
        };
        loop {
            match search.step() {
                ExposureStep::Photograph(i) => {
                    self.exposure = Some(exposures[i].clone());
                    let (brightest, is_saturated) = self.brightness(store, flood)?;
                    self.say(&format!(
                        "exposure {} s: {}",
                        exposures[i].name,
                        brightness_text(brightest, is_saturated)
                    ));
                    search.add(i, brightest, is_saturated);
                    measured[i] = brightest;
                }
                ExposureStep::Found(i) => {
                    self.exposure = Some(exposures[i].clone());
                    return Ok(chosen(measured[i]));
                }
                ExposureStep::TooDark(i, brightest) => {
                    self.exposure = Some(exposures[i].clone());
                    self.say(&format!(
                        "warning: with {} s, the longest of --exposures, {}; longer ones would lower the noise",
                        exposures[i].name,
                        brightness_text(brightest, false)
                    ));
                    return Ok(chosen(brightest));
                }
                ExposureStep::TooBright => bail!(
                    "with {} s, the shortest of --exposures, the flood is too bright; close the aperture, lower the sensitivity, or give \
                     shorter times",
                    exposures[0].name
                ),
            }
        }
    }

    fn ask_for_exposure(&mut self, store: &SessionStore, flood: usize) -> Result<ChosenExposure> {
        loop {
            let (brightest, is_saturated) = self.brightness(store, flood)?;
            let found = brightness_text(brightest, is_saturated);
            if !is_saturated && (MIN_FLOOD..=MAX_FLOOD * 1.3).contains(&brightest) {
                self.say(&format!("exposure: {found}"));
                return Ok(ChosenExposure {
                    flood_brightness: brightest,
                    is_saturation_accepted: false,
                });
            }
            let advice = match is_saturated {
                true => "expose a quarter as long".to_owned(),
                false => format!(
                    "expose about {:.1} times as long",
                    MAX_FLOOD / brightest.max(0.01)
                ),
            };
            let question = format!(
                "Under the flood, {found}: {advice}, then photograph again; or go on as it is."
            );
            self.say(&format!(
                "{question} The page of the player has the buttons."
            ));
            if !self.ask(&question)? {
                return Ok(ChosenExposure {
                    flood_brightness: brightest,
                    is_saturation_accepted: is_saturated,
                });
            }
        }
    }

    /// The brightest part of the flood, and whether it is saturated.
    fn brightness(&mut self, store: &SessionStore, flood: usize) -> Result<(f64, bool)> {
        let taken = self.take_with_retries(store, flood, 1)?;
        let levels = PhotographLevels::of(&taken.developed);
        Ok((taken.statistics.brightest, levels.is_saturated()))
    }

    /// Finds the time between a picture and its photograph after which nothing is left of the picture before: until the dark
    /// picture after the flood is as dark as it stays. The check of a pattern detects the afterglow of another pattern, but not that
    /// of a uniform picture.
    ///
    /// # Errors
    /// If no photograph can be taken.
    pub fn find_settle(&mut self, store: &SessionStore) -> Result<()> {
        let position = |role: PictureRole| store.sequence.position(&role);
        let (Some(dark), Some(flood)) = (position(PictureRole::Dark), position(PictureRole::Flood))
        else {
            return Ok(());
        };
        let given = self.settle;
        let mut first = None;
        loop {
            let lit = self.mean(store, flood, LATE_WAITS)?;
            let early = self.mean(store, dark, 1)?;
            let late = self.mean(store, dark, LATE_WAITS)?;
            if lit - late < MIN_FLOOD_LIGHT {
                self.say("note: the picture is too dark on average to find how long the display takes to change");
                return Ok(());
            }
            let afterglow = ((early - late) / (lit - late)).abs();
            if afterglow <= MAX_AFTERGLOW {
                return Ok(());
            }
            let percent = 100.0 * afterglow;
            let seconds = self.settle.as_secs_f32();
            let first = *first.get_or_insert(afterglow);
            let next = (2 * self.settle).max(MIN_SETTLE);
            if next > MAX_SETTLE {
                // An afterglow would have faded.
                let cause = match afterglow > first / 2.0 {
                    true => {
                        self.settle = given;
                        "does room light change?"
                    }
                    false => "is the display slow? A longer --settle may help.",
                };
                self.say(&format!(
                    "warning: {seconds:.2} seconds after the flood, the dark picture still differs from a later one by {percent:.1} % of the \
                     flood's light: {cause} Photographs wait for {:.2} seconds",
                    self.settle.as_secs_f32()
                ));
                return Ok(());
            }
            self.settle = next;
            self.say(&format!(
                "note: {seconds:.2} seconds after the flood, the dark picture has {percent:.1} % of its light left: photographs wait for {:.2} \
                 seconds from now on",
                self.settle.as_secs_f32()
            ));
        }
    }

    /// Mean measurement of a photograph of picture `i`, taken after `waits` times the wait for the display.
    fn mean(&mut self, store: &SessionStore, i: usize, waits: u32) -> Result<f64> {
        let taken = self.take_with_retries(store, i, waits)?;
        let parts = &taken.developed.thumbnail;
        Ok(parts.iter().sum::<f64>() / parts.len() as f64)
    }

    /// Photographs picture `i` until a photograph is there, after `waits` times the wait for the display.
    fn take_with_retries(&mut self, store: &SessionStore, i: usize, waits: u32) -> Result<Taken> {
        let mut failures = 0;
        loop {
            match self.take(store, i, waits + failures) {
                Err(error)
                    if error.is::<FailedAttempt>() && failures + 1 < self.settings.attempts =>
                {
                    failures += 1;
                    self.say(&format!("{error}; photographed again"));
                }
                taken => return taken,
            }
        }
    }
}

fn brightness_text(brightest: f64, is_saturated: bool) -> String {
    match is_saturated {
        true => "the brightest part is saturated".to_owned(),
        false => format!(
            "the brightest part is at {:.0} % of white",
            100.0 * brightest
        ),
    }
}
