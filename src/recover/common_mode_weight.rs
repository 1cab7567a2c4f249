//! The weight of the patterns' common mode in every least-squares problem of the recovery.

/// Factor ω on the residual of the equation `mean(y) = mean(P̂)τ`, means over the patterns.
///
/// Patterns are non-negative, so their equations share one large direction, the mean over all patterns. With it split
/// off, `‖y − P̂τ‖² = ‖y_c − P̂_c τ‖² + L (ȳ − p̄τ)²`, where `y_c` and `P̂_c` are centred over the L patterns. Only
/// noise disturbs the centred equations. Every constant offset disturbs the mean as well, and averaging does not lower
/// it: light from beyond the window, the dark frame's own noise, a black level that drifts. The second term is
/// therefore weighted by ω².
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(transparent)]
pub struct CommonModeWeight(f64);

impl CommonModeWeight {
    /// Plain least squares.
    pub const FULL: Self = Self(1.0);

    /// The weight in estimates from many pixels, which are made before any can be chosen.
    pub(super) const POOLED: Self = Self(0.3);

    /// Centred equations only: for estimates that do not need the total light.
    pub(super) const EXCLUDED: Self = Self(0.0);

    /// The weights to choose from. Zero is not among them: only the mean fixes the total light.
    pub const CANDIDATES: [Self; 5] = [Self(1.0), Self(0.5), Self(0.25), Self(0.1), Self(0.03)];

    /// ω.
    pub fn weight(self) -> f64 {
        self.0
    }
}
