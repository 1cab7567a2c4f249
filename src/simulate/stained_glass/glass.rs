//! The kinds of glass in the window, and their optical properties.

use crate::simulate::gradient_noise::{cell_hash, layered_noise, unit_hash};
use crate::simulate::vec2::{Vec2, smoothstep, vec2};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum GlassColour {
    Cobalt,
    Azure,
    Ruby,
    Rose,
    Amber,
    Gold,
    Emerald,
    Moss,
    Violet,
    Aqua,
    Pale,
    Opal,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct GlassOptics {
    /// Transmittance at the nominal thickness, RGB.
    pub transmittance: [f64; 3],
    /// Share of the light that is not scattered.
    pub ballistic: f64,
    /// Standard deviation of the ballistic peak, from fine roughness, in elements.
    pub peak: f64,
    /// Root mean square displacement by the rough faces, in elements.
    pub ripple: f64,
    /// Length scale of the rough faces, in unit coordinates.
    pub grain: f64,
    /// Standard deviation of the tail's wide part for green, in elements.
    pub tail: f64,
    /// Relative variation of the thickness in streaks.
    pub streaks: f64,
}

impl GlassColour {
    /// The sheet's optical properties. Roughness and scattering are those of glass types on the market: antique
    /// glass is clear and wavy, hammered glass rough, opalescent glass milky.
    pub fn optics(self) -> GlassOptics {
        let sheet = |transmittance, [ballistic, peak, ripple, grain, tail, streaks]: [f64; 6]| {
            GlassOptics {
                transmittance,
                ballistic,
                peak,
                ripple,
                grain,
                tail,
                streaks,
            }
        };
        const ANTIQUE: [f64; 6] = [0.72, 0.42, 0.75, 0.26, 1.7, 0.30];
        const HAMMERED: [f64; 6] = [0.62, 0.55, 1.25, 0.13, 1.9, 0.16];
        const STREAKY: [f64; 6] = [0.45, 0.60, 0.70, 0.22, 2.0, 0.55];
        const SATIN: [f64; 6] = [0.25, 0.80, 0.55, 0.18, 2.1, 0.20];
        const OPALESCENT: [f64; 6] = [0.10, 0.95, 0.35, 0.24, 2.3, 0.28];
        match self {
            Self::Cobalt => sheet([0.055, 0.15, 0.74], ANTIQUE),
            Self::Azure => sheet([0.13, 0.40, 0.91], STREAKY),
            Self::Ruby => sheet([0.90, 0.038, 0.060], ANTIQUE),
            Self::Rose => sheet([0.95, 0.34, 0.42], STREAKY),
            Self::Amber => sheet([0.97, 0.47, 0.045], HAMMERED),
            Self::Gold => sheet([0.98, 0.74, 0.15], SATIN),
            Self::Emerald => sheet([0.060, 0.54, 0.21], HAMMERED),
            Self::Moss => sheet([0.30, 0.58, 0.10], STREAKY),
            Self::Violet => sheet([0.40, 0.105, 0.64], ANTIQUE),
            Self::Aqua => sheet([0.42, 0.78, 0.76], HAMMERED),
            Self::Pale => sheet([0.97, 0.94, 0.82], HAMMERED),
            Self::Opal => sheet([0.97, 0.95, 0.89], OPALESCENT),
        }
    }
}

/// Transmittance of piece `piece` at `p`: the Beer–Lambert law for a sheet whose thickness and colour vary
/// between pieces and, in streaks, within each; minus the dark rims of bubbles.
pub(super) fn transmittance(optics: &GlassOptics, piece: u32, p: Vec2) -> [f64; 3] {
    let jitter = 0.76 + 0.42 * unit_hash(piece, 31);
    // The colour varies between pieces.
    let warm = 0.16 * (unit_hash(piece, 35) - 0.5);
    let melt = [1.0 - warm, 1.0, 1.0 + warm];
    // Streaks run along the direction in which the sheet was drawn, which differs between pieces.
    let along = p.rotated(unit_hash(piece, 32) * std::f64::consts::TAU);
    let along = along + vec2(17.0, 29.0) * unit_hash(piece, 33);
    let streak = layered_noise(vec2(along.x * 3.0, along.y * 14.0), 3, 34);
    let thickness = jitter * (1.0 + 1.6 * optics.streaks * streak).max(0.2);
    let clear = 1.0 - 0.5 * bubble_rim(along);
    std::array::from_fn(|c| optics.transmittance[c].powf(thickness * melt[c]) * clear)
}

/// 0 in plain glass, up to 1 on the rim of a bubble.
fn bubble_rim(p: Vec2) -> f64 {
    const CELL: f64 = 0.07;
    let (i, j) = ((p.x / CELL).floor(), (p.y / CELL).floor());
    let random = |seed| cell_hash(i as i32, j as i32, seed);
    if random(41) > 0.16 {
        return 0.0;
    }
    let radius = CELL * (0.07 + 0.10 * random(42));
    let place = |i: f64, seed| (i + 0.3 + 0.4 * random(seed)) * CELL;
    // Bubbles are elongated along the drawing direction.
    let q = p - vec2(place(i, 43), place(j, 44));
    let distance = vec2(q.x / 1.6, q.y).length() / radius;
    smoothstep(0.35, 0.85, distance) * (1.0 - smoothstep(0.95, 1.25, distance))
}
