//! Warnings of levels that do not fit a session's photographs: saturation, and samples below black.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::photograph_file::DevelopedPhotograph;

/// Share of the samples of a photograph that may be too far below black for a code.
const MAX_CLIPPED: f64 = 0.001;
/// Share of the samples of the flood photograph that may be saturated.
const MAX_SATURATED: f64 = 0.001;

/// What a photograph says of the levels.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct PhotographLevels {
    /// Share of the samples that are saturated.
    pub saturated_share: f64,
    /// Share of the samples that are too far below black for a code.
    pub clipped_share: f64,
    /// The sample below white at which many pile up.
    pub pile: Option<f64>,
}

impl PhotographLevels {
    pub fn of(photo: &DevelopedPhotograph) -> Self {
        Self {
            saturated_share: photo.saturated_share,
            clipped_share: photo.clipped_share,
            pile: photo.pile,
        }
    }

    /// Whether the photograph has more saturated samples than a flood photograph should have.
    pub fn is_saturated(&self) -> bool {
        self.saturated_share > MAX_SATURATED
    }

    /// Warns of the saturation of a flood photograph.
    pub fn warn_of_flood(&self, path: &Path) {
        if self.is_saturated() {
            eprintln!(
                "warning: {:.1} % of the samples of {} are saturated; expose less, unless --white is wrong",
                100.0 * self.saturated_share,
                path.display()
            );
        }
        if let Some(pile) = self.pile {
            eprintln!(
                "warning: many samples of {} are exactly {pile}, as if the camera saturated there: then --white is {pile}",
                path.display()
            );
        }
    }
}

/// Warns of the photograph with most samples too far below black, if they are many.
pub fn warn_of_clipping<'a>(photos: impl Iterator<Item = (&'a PhotographLevels, &'a Path)>) {
    let most = photos.max_by(|a, b| a.0.clipped_share.total_cmp(&b.0.clipped_share));
    if let Some((levels, path)) = most
        && levels.clipped_share > MAX_CLIPPED
    {
        eprintln!(
            "warning: {:.1} % of the samples of {} are below black by more than 3 % of white, and are clipped; is --black right?",
            100.0 * levels.clipped_share,
            path.display()
        );
    }
}
