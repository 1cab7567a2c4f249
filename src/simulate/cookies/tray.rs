//! The tray and the cookies: height, colour and gloss of the surface as a function of unit coordinates.

use std::f64::consts::{PI, TAU};

use crate::simulate::gradient_noise::{cell_hash, layered_noise};
use crate::simulate::signed_distance::{circle, fold, heart, segment, smooth_union, star, vesica};
use crate::simulate::vec2::{Vec2, mix, mix3, smoothstep, vec2};
use crate::transport::CHANNELS;

/// The surface at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Surface {
    /// Height over the tray; the tallest cookie has about 1.
    pub height: f64,
    /// Diffuse albedo, RGB.
    pub albedo: [f64; CHANNELS],
    /// Strength of the highlight; 0 for a matt surface.
    pub gloss: f64,
}

#[derive(Clone, Copy, Debug)]
enum CookieVariety {
    ChocolateChip,
    DarkChocolate,
    Star,
    JamHeart,
    Ring,
    Gingerbread,
    JamFlower,
    Pinwheel,
    SmallStar,
    Leaf,
}

/// The cookies: kind, middle, size, and rotation in radians.
const COOKIES: [(CookieVariety, Vec2, f64, f64); 13] = [
    (CookieVariety::ChocolateChip, vec2(-0.56, -0.57), 0.31, 0.0),
    (CookieVariety::Star, vec2(0.08, -0.62), 0.30, 0.2),
    (CookieVariety::JamHeart, vec2(0.62, -0.60), 0.29, -0.25),
    (CookieVariety::Ring, vec2(-0.63, 0.10), 0.25, 0.5),
    (CookieVariety::Gingerbread, vec2(-0.02, 0.16), 0.46, 0.12),
    (CookieVariety::DarkChocolate, vec2(0.62, 0.04), 0.28, 1.0),
    (CookieVariety::JamFlower, vec2(-0.55, 0.66), 0.27, 0.3),
    (CookieVariety::Pinwheel, vec2(0.60, 0.63), 0.29, 2.2),
    (CookieVariety::SmallStar, vec2(0.09, 0.80), 0.13, -0.3),
    (CookieVariety::Leaf, vec2(-0.20, -0.30), 0.13, 0.7),
    (CookieVariety::Leaf, vec2(0.33, -0.27), 0.11, 2.5),
    (CookieVariety::SmallStar, vec2(0.31, 0.33), 0.085, 0.5),
    (CookieVariety::SmallStar, vec2(-0.17, 0.83), 0.085, 1.1),
];

const TRAY: [f64; 3] = [0.23, 0.38, 0.44];
const RIM: [f64; 3] = [0.66, 0.62, 0.52];
const BUTTER: [f64; 3] = [0.86, 0.64, 0.34];
const BROWN: [f64; 3] = [0.66, 0.40, 0.19];
const SPICE: [f64; 3] = [0.52, 0.27, 0.12];
const COCOA: [f64; 3] = [0.20, 0.105, 0.06];
const CHIP: [f64; 3] = [0.15, 0.075, 0.045];
const ICING: [f64; 3] = [0.93, 0.91, 0.88];
const CHERRY: [f64; 3] = [0.70, 0.06, 0.08];
const APRICOT: [f64; 3] = [0.93, 0.46, 0.08];

/// The surface at `p`.
pub(super) fn surface_at(p: Vec2) -> Surface {
    let mut surface = tray(p);
    for (kind, middle, size, angle) in COOKIES {
        let q = p - middle;
        // No outline exceeds 1.25 times the nominal size.
        if q.length() < 1.25 * size
            && let Some(cookie) = cookie_surface(kind, size, q.rotated(-angle), p)
            && cookie.height > surface.height
        {
            surface = cookie;
        }
    }
    surface
}

/// An enamelled tray with a raised rim, which extends beyond the unit square.
fn tray(p: Vec2) -> Surface {
    let edge = p.x.abs().max(p.y.abs());
    let rim = smoothstep(0.93, 0.975, edge);
    let speck = cell_hash((p.x * 90.0).floor() as i32, (p.y * 90.0).floor() as i32, 71);
    let speckled = if speck > 0.975 { 1.35 } else { 1.0 };
    let worn = 1.0 + 0.25 * layered_noise(p * 3.0, 4, 72);
    let line = 1.0 - smoothstep(0.006, 0.012, (edge - 0.90).abs());
    Surface {
        height: 0.22 * rim,
        albedo: mix3(TRAY.map(|a| a * speckled * worn), RIM, rim.max(0.8 * line)),
        gloss: 0.0,
    }
}

/// The profile of a rounded edge: 0 at the outline, 1 at the distance `bevel` inside.
fn rounded(d: f64, bevel: f64) -> f64 {
    let t = (-d / bevel).clamp(0.0, 1.0);
    (1.0 - (1.0 - t) * (1.0 - t)).sqrt()
}

/// Dough with an outline at signed distance `d`: grainy, and darker at its thin edge.
fn dough(d: f64, bevel: f64, height: f64, colour: [f64; 3], p: Vec2) -> Surface {
    let grain = layered_noise(p * 16.0, 3, 73);
    let crust = 1.0 - 0.35 * (1.0 - smoothstep(0.0, 0.05, -d));
    Surface {
        height: height * rounded(d, bevel) * (1.0 + 0.055 * grain),
        albedo: colour.map(|a| a * crust * (1.0 + 0.30 * grain)),
        gloss: 0.0,
    }
}

impl Surface {
    /// Adds a topping with an outline at signed distance `d`.
    fn topped(self, d: f64, thickness: f64, colour: [f64; 3]) -> Self {
        if d >= 0.0 {
            return self;
        }
        Self {
            height: self.height + thickness * rounded(d, 0.02),
            albedo: mix3(self.albedo, colour, smoothstep(0.0, 0.004, -d)),
            gloss: 0.12,
        }
    }

    /// Adds grains of sugar in the share `share` of the cells of a grid.
    fn sugared(self, p: Vec2, share: f64) -> Self {
        const GRAIN: f64 = 0.016;
        let (i, j) = ((p.x / GRAIN).floor(), (p.y / GRAIN).floor());
        if cell_hash(i as i32, j as i32, 74) > share {
            return self;
        }
        let off = |seed| 0.36 + 0.28 * cell_hash(i as i32, j as i32, seed);
        let middle = vec2((i + off(79)) * GRAIN, (j + off(80)) * GRAIN);
        self.topped((p - middle).length() - 0.36 * GRAIN, 0.03, ICING)
    }
}

/// A cookie of size `s` at `q`, in its own coordinates; `p` is the same point on the tray. `None` beside the cookie.
fn cookie_surface(kind: CookieVariety, s: f64, q: Vec2, p: Vec2) -> Option<Surface> {
    let surface = match kind {
        CookieVariety::ChocolateChip => {
            let d = circle(q, s) + 0.02 * layered_noise(q * 6.0, 2, 75);
            chips(dough(d, 0.12, 0.72, BROWN, p), q, s, CHIP)
        }
        CookieVariety::DarkChocolate => {
            let d = circle(q, s) + 0.02 * layered_noise(q * 6.0, 2, 76);
            chips(dough(d, 0.13, 0.70, COCOA, p), q, s, ICING)
        }
        CookieVariety::Star => {
            let d = star(q, 6, s, 0.60 * s) - 0.012;
            dough(d, 0.07, 0.60, BUTTER, p).sugared(p, if d < -0.03 { 0.4 } else { 0.0 })
        }
        CookieVariety::SmallStar => {
            let d = star(q, 5, s, 0.50 * s) - 0.010;
            dough(d, 0.04, 0.42, BROWN, p).topped(d + 0.016, 0.08, ICING)
        }
        CookieVariety::JamHeart => {
            let d = scalloped(q, s, 16);
            let filling = heart(q - vec2(0.0, 0.01), 0.52 * s);
            filled(dough(d, 0.06, 0.66, BUTTER, p), filling, CHERRY, q)
        }
        CookieVariety::JamFlower => {
            let d = scalloped(q, s, 8);
            let filling = circle(q, 0.42 * s);
            filled(dough(d, 0.06, 0.64, BUTTER, p), filling, APRICOT, q)
        }
        CookieVariety::Ring => {
            let d = (q.length() - 0.63 * s).abs() - 0.37 * s;
            let wave = 0.018 * (q.y.atan2(q.x) * 7.0).sin();
            let icing = (q.length() - 0.63 * s).abs() - 0.27 * s + wave;
            let ring = dough(d, 0.085, 0.86, BROWN, p).topped(icing, 0.06, [0.92, 0.55, 0.62]);
            sprinkled(ring, q, icing)
        }
        CookieVariety::Gingerbread => return gingerbread(q * (1.0 / s), s, p),
        CookieVariety::Pinwheel => {
            let d = circle(q, s);
            let angle = q.y.atan2(q.x) / TAU;
            let spiral = (q.length() / (0.24 * s) - angle).rem_euclid(1.0);
            let dark = smoothstep(0.02, 0.10, spiral) * (1.0 - smoothstep(0.48, 0.56, spiral));
            let groove = 1.0 - 0.12 * (1.0 - (spiral * TAU * 2.0).cos()) / 2.0;
            let colour = mix3(BUTTER, COCOA.map(|a| a * 1.35), dark);
            let mut wheel = dough(d, 0.07, 0.62, colour, p);
            wheel.height *= groove;
            wheel
        }
        CookieVariety::Leaf => {
            let d = vesica(q, s, 0.42 * s);
            let rib = segment(q, vec2(-0.8 * s, 0.0), vec2(0.8 * s, 0.0));
            let slant = (q.x - 1.4 * q.y.abs()).rem_euclid(0.042) - 0.021;
            let line = rib.min(slant.abs()) - 0.004;
            let mut leaf = dough(d, 0.04, 0.40, [0.56, 0.62, 0.26], p);
            leaf.height -= 0.06 * (1.0 - smoothstep(0.0, 0.008, line));
            leaf
        }
    };
    (surface.height > 0.0).then_some(surface)
}

/// Signed distance to a disc with a scalloped outline.
fn scalloped(q: Vec2, size: f64, lobes: u32) -> f64 {
    let (_, l) = fold(q, lobes, 0.0);
    let lobe = size * (PI / f64::from(lobes)).sin() * 1.05;
    let scallops = circle(l - vec2(size - lobe, 0.0), lobe);
    smooth_union(circle(q, size - lobe), scallops, 0.02)
}

/// Replaces the dough inside the outline at signed distance `d` by jam.
fn filled(dough: Surface, d: f64, jam: [f64; 3], q: Vec2) -> Surface {
    let inside = smoothstep(-0.006, 0.006, -d);
    let level = 0.34 + 0.05 * layered_noise(q * 9.0, 2, 77);
    let lit = 1.0 + 0.35 * layered_noise(q * 11.0, 2, 78);
    Surface {
        height: mix(dough.height, level, inside),
        albedo: mix3(dough.albedo, jam.map(|a| (a * lit).min(0.93)), inside),
        gloss: 0.9 * inside,
    }
}

/// Adds chips to a round cookie, at most one in each cell of a jittered grid.
fn chips(dough: Surface, q: Vec2, size: f64, colour: [f64; 3]) -> Surface {
    const CELL: f64 = 0.112;
    let (i0, j0) = ((q.x / CELL).floor() as i32, (q.y / CELL).floor() as i32);
    let mut topped = dough;
    for j in j0 - 1..=j0 + 1 {
        for i in i0 - 1..=i0 + 1 {
            let random = |seed| cell_hash(i, j, seed);
            let middle = vec2(
                (f64::from(i) + 0.25 + 0.5 * random(81)) * CELL,
                (f64::from(j) + 0.25 + 0.5 * random(82)) * CELL,
            );
            let radius = 0.027 + 0.014 * random(83);
            let d = (q - middle).length() - radius;
            if random(84) < 0.93 && middle.length() < size - 0.065 && d < 0.0 {
                topped = Surface {
                    height: dough.height + 0.26 * rounded(d, radius),
                    albedo: mix3(dough.albedo, colour, smoothstep(0.0, 0.004, -d)),
                    gloss: 0.35,
                };
            }
        }
    }
    topped
}

/// Adds coloured sprinkles to icing with an outline at signed distance `icing`.
fn sprinkled(iced: Surface, q: Vec2, icing: f64) -> Surface {
    const CELL: f64 = 0.046;
    const COLOURS: [[f64; 3]; 4] = [
        [0.90, 0.72, 0.12],
        [0.20, 0.45, 0.75],
        [0.92, 0.90, 0.86],
        [0.25, 0.60, 0.28],
    ];
    let (i, j) = ((q.x / CELL).floor(), (q.y / CELL).floor());
    let random = |seed| cell_hash(i as i32, j as i32, seed);
    if icing > -0.016 || random(85) > 0.6 {
        return iced;
    }
    let middle = vec2((i + 0.5) * CELL, (j + 0.5) * CELL);
    let half = vec2(0.013, 0.0).rotated(random(86) * PI);
    let d = segment(q - middle, half * -1.0, half) - 0.0055;
    iced.topped(d, 0.05, COLOURS[(random(87) * 4.0) as usize % 4])
}

/// A gingerbread man of unit size, scaled by `s`.
fn gingerbread(g: Vec2, s: f64, p: Vec2) -> Option<Surface> {
    let m = vec2(g.x.abs(), g.y);
    let head = circle(m - vec2(0.0, -0.60), 0.30);
    let arm = segment(m, vec2(0.0, -0.12), vec2(0.52, -0.24)) - 0.155;
    let body = segment(m, vec2(0.0, -0.15), vec2(0.0, 0.25)) - 0.24;
    let leg = segment(m, vec2(0.08, 0.25), vec2(0.30, 0.78)) - 0.17;
    let limbs = smooth_union(smooth_union(body, arm, 0.12), leg, 0.12);
    let d = smooth_union(limbs, head, 0.14) * s;
    if d >= 0.0 {
        return None;
    }
    let zigzag = |t: f64| 0.026 * (TAU * t * 9.0).sin();
    // Icing: cuffs, a smile, eyes and buttons.
    let cuff = segment(m, vec2(0.47, -0.40), vec2(0.53, -0.06)) + zigzag(m.y) * 0.6;
    let sock = segment(m, vec2(0.12, 0.73), vec2(0.45, 0.62)) + zigzag(m.x) * 0.6;
    let smile = if m.y > -0.56 {
        circle(m - vec2(0.0, -0.62), 0.14).abs()
    } else {
        1.0
    };
    let line = cuff.min(sock).min(smile.max(m.x - 0.13)) - 0.022;
    let eye = circle(m - vec2(0.105, -0.67), 0.038);
    let button = circle(m - vec2(0.0, -0.12), 0.048).min(circle(m - vec2(0.0, 0.10), 0.048));
    Some(
        dough(d, 0.05, 0.62, SPICE, p)
            .topped(line.min(eye) * s, 0.09, ICING)
            .topped(button * s, 0.12, CHERRY),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_and_albedos_are_in_range() {
        let mut highest = 0.0f64;
        for j in 0..300 {
            for i in 0..300 {
                let p = vec2(f64::from(i) / 150.0 - 1.0, f64::from(j) / 150.0 - 1.0);
                let Surface { height, albedo, .. } = surface_at(p);
                assert!((0.0..=1.05).contains(&height), "height {height} at {p:?}");
                assert!(
                    albedo.iter().all(|a| (0.0..1.2).contains(a)),
                    "{albedo:?} at {p:?}"
                );
                highest = highest.max(height);
            }
        }
        assert!(highest > 0.85, "highest {highest}");
    }
}
