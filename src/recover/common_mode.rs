//! The patterns' common mode, and how far to trust it.

/// Weight of the equation `mean(y) = mean(P̂)τ` against one that says nothing beyond noise.
///
/// Patterns are non-negative, so every equation shares one large direction: their mean over all
/// patterns. HoldoutSplit off, `‖y − P̂τ‖² = ‖y_c − P̂_c τ‖² + L (ȳ − p̄τ)²`, where the first term is
/// centred over patterns. Noise is all that disturbs the centred equations; the mean row is
/// disturbed by every constant offset as well, which averaging does not lower: light from beyond
/// the window, a dark frame's own noise, a black level that drifts. So it is kept, but with a
/// weight, chosen on patterns held out: 1 is plain least squares.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[serde(transparent)]
pub struct CommonMode(f64);

impl CommonMode {
    /// Plain least squares.
    pub const FULL: Self = Self(1.0);

    /// Weights to choose from. Zero is not among them: the mean row is all that ties down the total.
    pub const CANDIDATES: [Self; 5] = [Self(1.0), Self(0.5), Self(0.25), Self(0.1), Self(0.03)];

    /// The factor on the mean row's residual.
    pub fn weight(self) -> f64 {
        self.0
    }
}
