//! The cartoon of the window: which piece of glass lies where, and where the lead.
//!
//! From the middle outwards: a rosette, a ring of beads, twelve petals, twelve medallions, a
//! jewelled border; then the corners of the square and its frame. A picture that is not square
//! shows diamond quarries beside it. Unit coordinates throughout.

use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

use super::glass::Glass;
use crate::simulate::plane::{Vec2, smoothstep, vec2};
use crate::simulate::shapes::{circle, fold, segment, vesica};
use crate::simulate::texture::cell_hash;

/// Half the width of the leads that hold the large parts together, and of the fine ones.
const BOLD: f64 = 0.0120;
const FINE: f64 = 0.0080;

/// What is at a point of the window.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    /// Number of the piece; the same everywhere on it.
    pub piece: u32,
    /// Its glass.
    pub glass: Glass,
    /// Distance to the nearest lead's edge; negative within the lead.
    pub clearance: f64,
    /// Density of the painter's brown, 0 to 1.
    pub paint: f64,
}

impl Spot {
    fn new(piece: u32, glass: Glass) -> Self {
        Self {
            piece,
            glass,
            clearance: f64::INFINITY,
            paint: 0.0,
        }
    }

    /// A lead along the line from which the point is `distance` away.
    fn lead(mut self, distance: f64, half_width: f64) -> Self {
        self.clearance = self.clearance.min(distance.abs() - half_width);
        self
    }

    /// Cuts a shape out, of signed distance `d`, and leads `piece` into it.
    fn inlay(mut self, d: f64, half_width: f64, piece: u32, glass: Glass) -> Self {
        if d < 0.0 {
            self = Self::new(piece, glass);
        }
        self.lead(d, half_width)
    }

    /// Paints with the given density.
    fn painted(mut self, density: f64) -> Self {
        self.paint = self.paint.max(density.clamp(0.0, 1.0));
        self
    }
}

/// Density of a painted line that is `distance` away.
fn stroke(distance: f64, half_width: f64) -> f64 {
    1.0 - smoothstep(0.5 * half_width, 1.5 * half_width, distance.abs())
}

/// Radius of the whole rose, of the circles within it and the half side of the frame's inside.
const ROSE: f64 = 0.885;
const BORDER: f64 = 0.795;
const MEDALLIONS: f64 = 0.50;
const PETALS: f64 = 0.185;
const ROSETTE: f64 = 0.135;
const FRAME: f64 = 0.915;

/// What is at `p`. Pieces are numbered by part, hundreds, and place in it.
pub(super) fn spot(p: Vec2) -> Spot {
    let r = p.length();
    let square = p.x.abs().max(p.y.abs());
    if square > 1.0 {
        quarries(p).lead(square - 1.0, BOLD)
    } else if square > FRAME {
        frame(p).lead(square - FRAME, FINE).lead(square - 1.0, BOLD)
    } else if r > ROSE {
        corner(p).lead(r - ROSE, BOLD).lead(square - FRAME, FINE)
    } else if r > BORDER {
        border(p, r).lead(r - ROSE, BOLD).lead(r - BORDER, BOLD)
    } else if r > MEDALLIONS {
        medallions(p, r)
            .lead(r - BORDER, BOLD)
            .lead(r - MEDALLIONS, FINE)
    } else if r > PETALS {
        petals(p, r)
            .lead(r - MEDALLIONS, FINE)
            .lead(r - PETALS, FINE)
    } else if r > ROSETTE {
        beads(p, r).lead(r - PETALS, FINE).lead(r - ROSETTE, FINE)
    } else {
        rosette(p).lead(r - ROSETTE, FINE)
    }
}

fn rosette(p: Vec2) -> Spot {
    let (k, q) = fold(p, 6, PI / 6.0);
    let petal = vesica(q - vec2(0.082, 0.0), 0.058, 0.036);
    Spot::new(10, Glass::Cobalt)
        .inlay(petal, 0.6 * FINE, 20 + k, Glass::Rose)
        .inlay(circle(p, 0.042), 0.8 * FINE, 11, Glass::Gold)
        .painted(0.55 * stroke(circle(p, 0.018), 0.004))
}

fn beads(p: Vec2, r: f64) -> Spot {
    let (k, q) = fold(p, 12, 0.0);
    let (k2, _) = fold(p, 24, 0.0);
    let half = PI / 12.0;
    let glass = if k2 % 2 == 0 {
        Glass::Gold
    } else {
        Glass::Emerald
    };
    let across = (q.y.atan2(q.x).abs() - half / 2.0) * r;
    Spot::new(100 + if k2 % 2 == 0 { k } else { 50 + k2 }, glass).lead(across, 0.7 * FINE)
}

fn petals(p: Vec2, r: f64) -> Spot {
    let (k, q) = fold(p, 12, 0.0);
    let (gap, g) = fold(p, 12, PI / 12.0);
    let even = k % 2 == 0;
    // Between the petals: ruby flames above, a deep blue root below.
    let mut spot = Spot::new(200 + gap, Glass::Ruby);
    let root = r - 0.335;
    if root < 0.0 {
        spot = Spot::new(220 + gap, Glass::Violet);
    }
    let spot = spot.lead(root, 0.8 * FINE);
    let spot = spot.painted(0.4 * stroke(g.y, 0.004) * smoothstep(0.36, 0.42, r));
    let centre = q - vec2(0.345, 0.0);
    let petal = vesica(centre, 0.155, if even { 0.072 } else { 0.066 });
    let glass = if even { Glass::Amber } else { Glass::Pale };
    let spot = spot.inlay(petal, FINE, 240 + k, glass);
    if petal > 0.0 {
        return spot;
    }
    // A bright heart in each petal, veins painted from it.
    let heart = vesica(centre + vec2(0.035, 0.0), 0.07, 0.026);
    let inner = if even { Glass::Opal } else { Glass::Azure };
    let rib = segment(centre, vec2(-0.12, 0.0), vec2(0.14, 0.0));
    let slant = (centre.x - 2.0 * centre.y.abs()).rem_euclid(0.034) - 0.017;
    let veins = 0.5 * stroke(slant, 0.0028) * smoothstep(0.0, 0.02, -petal - 0.008);
    spot.painted(0.65 * stroke(rib, 0.004))
        .painted(veins)
        .inlay(heart, 0.6 * FINE, 270 + k, inner)
}

fn medallions(p: Vec2, r: f64) -> Spot {
    const MIDDLE: f64 = 0.648;
    let (k, q) = fold(p, 12, PI / 12.0);
    let (gap, g) = fold(p, 12, 0.0);
    // Fields between the medallions, leaded along the circle through their middles.
    let outer = r > MIDDLE;
    let field = match (outer, gap % 2) {
        (true, _) => Spot::new(300 + gap, Glass::Cobalt),
        (false, _) => Spot::new(320 + gap, Glass::Azure),
    };
    let field = field.lead(r - MIDDLE, FINE).lead(q.y, FINE);
    // A leaf in the upper field.
    let leaf = vesica(vec2(g.x - 0.735, g.y), 0.05, 0.026);
    let field = field.inlay(leaf, 0.7 * FINE, 340 + gap, Glass::Moss);
    let c = q - vec2(MIDDLE, 0.0);
    let ring = circle(c, 0.123);
    let (rim, flower) = match k % 3 {
        0 => (Glass::Ruby, Glass::Gold),
        1 => (Glass::Emerald, Glass::Opal),
        _ => (Glass::Violet, Glass::Rose),
    };
    let spot = field.inlay(ring, BOLD * 0.85, 400 + k, rim);
    if ring > 0.0 {
        return spot;
    }
    // Quatrefoil within, cut from the rim by its own lead.
    let (_, l) = fold(c, 4, 0.0);
    let foil = circle(l - vec2(0.041, 0.0), 0.037);
    let (_, rays) = fold(c, 16, 0.0);
    let spot = spot.painted(0.45 * stroke(rays.y, 0.003) * smoothstep(0.075, 0.09, c.length()));
    spot.inlay(foil, 0.7 * FINE, 420 + k, flower)
        .painted(if foil < 0.0 {
            0.5 * stroke(circle(l - vec2(0.041, 0.0), 0.018), 0.003)
        } else {
            0.0
        })
        .inlay(circle(c, 0.024), 0.7 * FINE, 480 + k, Glass::Amber)
}

fn border(p: Vec2, r: f64) -> Spot {
    // Long ruby stones, short golden ones between them.
    let (k, q) = fold(p, 24, PI / 24.0);
    let angle = q.y.atan2(q.x).abs();
    let edge = PI / 24.0 - 0.038;
    let across = (angle - edge) * r;
    let middle = 0.5 * (ROSE + BORDER);
    if across < 0.0 {
        let glass = if k % 2 == 0 {
            Glass::Ruby
        } else {
            Glass::Cobalt
        };
        let jewel = stroke(circle(vec2((q.x - middle) * 1.0, q.y * 0.55), 0.020), 0.004);
        Spot::new(500 + k, glass)
            .lead(across, FINE)
            .painted(0.5 * jewel)
    } else {
        let (gap, g) = fold(p, 24, 0.0);
        let dot = stroke(circle(vec2(g.x - middle, g.y), 0.006), 0.005);
        Spot::new(540 + gap, Glass::Gold)
            .lead(across, FINE)
            .painted(0.55 * dot)
    }
}

fn corner(p: Vec2) -> Spot {
    let place = u32::from(p.x > 0.0) + 2 * u32::from(p.y > 0.0);
    let q = vec2(p.x.abs(), p.y.abs());
    // The circle that touches the rose and both sides of the frame, a little smaller.
    const MIDDLE: f64 = 0.748;
    const RADIUS: f64 = 0.135;
    let c = q - vec2(MIDDLE, MIDDLE);
    let beyond = (c.x + c.y) * FRAC_1_SQRT_2;
    let side = u32::from(q.x > q.y);
    let angle = q.y.atan2(q.x);
    let from_diagonal = (angle - PI / 4.0).abs();
    let tail = (from_diagonal - 0.42) * q.length();
    let spot = if beyond > 0.0 {
        Spot::new(600 + place, Glass::Violet).lead(beyond, FINE)
    } else if tail > 0.0 {
        // Two corners' tails meet on the axis.
        Spot::new(610 + 2 * place + side, Glass::Amber)
            .lead(tail, FINE)
            .lead(q.x.min(q.y), FINE)
    } else {
        Spot::new(620 + 2 * place + side, Glass::Azure)
            .lead(beyond, FINE)
            .lead(tail, FINE)
            .lead((q.x - q.y) * FRAC_1_SQRT_2, FINE)
    };
    let spot = spot.inlay(circle(c, RADIUS), BOLD * 0.85, 640 + place, Glass::Emerald);
    let (k, l) = fold(c, 8, PI / 8.0);
    let petal = vesica(l - vec2(0.072, 0.0), 0.048, 0.024);
    spot.inlay(
        petal,
        0.6 * FINE,
        650 + 8 * place + k,
        if k % 2 == 0 { Glass::Opal } else { Glass::Rose },
    )
    .inlay(circle(c, 0.034), 0.8 * FINE, 690 + place, Glass::Gold)
    .painted(0.5 * stroke(circle(c, 0.015), 0.004))
}

fn frame(p: Vec2) -> Spot {
    const STONES: f64 = 13.0;
    let (along, side) = match (p.x.abs() > p.y.abs(), p.x > 0.0, p.y > 0.0) {
        (true, right, _) => (p.y, u32::from(right)),
        (false, _, below) => (p.x, 2 + u32::from(below)),
    };
    if along.abs() > FRAME {
        let place = u32::from(p.x > 0.0) + 2 * u32::from(p.y > 0.0);
        return Spot::new(700 + place, Glass::Gold).lead(along.abs() - FRAME, FINE);
    }
    let length = 2.0 * FRAME / STONES;
    let t = (along + FRAME) / length;
    let stone = (t.floor() as u32).min(STONES as u32 - 1);
    let across = (t - t.round()) * length;
    let glass = match stone % 2 {
        0 => Glass::Cobalt,
        _ => Glass::Ruby,
    };
    Spot::new(710 + 20 * side + stone, glass).lead(across, FINE)
}

fn quarries(p: Vec2) -> Spot {
    const SIDE: f64 = 0.2;
    let (a, b) = (
        (p.x + p.y) * FRAC_1_SQRT_2 / SIDE,
        (p.x - p.y) * FRAC_1_SQRT_2 / SIDE,
    );
    let (i, j) = (a.floor(), b.floor());
    let pick = cell_hash(i as i32, j as i32, 51);
    let glass = match (pick * 10.0) as u32 {
        0 => Glass::Azure,
        1 => Glass::Gold,
        2 => Glass::Aqua,
        _ => Glass::Pale,
    };
    let piece = 1000 + (pick * f64::from(u16::MAX)) as u32;
    let line = |t: f64| (t - t.round()) * SIDE;
    let (u, v) = (a - i - 0.5, b - j - 0.5);
    let (_, q) = fold(vec2(u, v), 4, TAU / 8.0);
    let flower = stroke(vesica(q - vec2(0.16, 0.0), 0.11, 0.05), 0.012);
    Spot::new(piece, glass)
        .painted(0.5 * flower)
        .lead(line(a), FINE)
        .lead(line(b), FINE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn different_pieces_never_touch_without_lead_between() {
        // Walk the window in steps much shorter than a lead is wide.
        let step = 0.2 * FINE;
        for row in 0..160 {
            let y = -1.06 + f64::from(row) * 0.01327;
            let mut before = spot(vec2(-1.2, y));
            for i in 1..(2.4 / step) as u32 {
                let here = spot(vec2(-1.2 + f64::from(i) * step, y));
                if here.piece != before.piece {
                    let lead = here.clearance.min(before.clearance);
                    assert!(lead < 0.0, "{before:?} meets {here:?} at y = {y}");
                }
                before = here;
            }
        }
    }
}
