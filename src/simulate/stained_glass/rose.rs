//! The design of the rose window: glass, lead, stone and paint as a function of unit coordinates.
//!
//! A rose in Gothic tracery. From the centre outwards: a sun, twelve lancets with roundels in their heads,
//! twenty-four narrower lancets, eyelets between the heads, a ring of pearls; then quatrefoils in the corners
//! of the square, and its frame. A picture that is not square shows diamond quarries beside the square.

use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

use super::glass::GlassColour::{
    self, Amber, Aqua, Azure, Cobalt, Emerald, Gold, Moss, Opal, Pale, Rose, Ruby, Violet,
};
use crate::simulate::gradient_noise::{cell_hash, noise};
use crate::simulate::signed_distance::{circle, fold, segment, smooth_union, star, vesica};
use crate::simulate::vec2::{Vec2, smoothstep, vec2};

/// Half the width of stone bars, of leads between large parts, and of fine leads.
const STONE_HALF_WIDTH: f64 = 0.0076;
const BOLD_HALF_WIDTH: f64 = 0.0060;
const FINE_HALF_WIDTH: f64 = 0.0039;
/// Radius of the solder where leads meet.
const SOLDER_RADIUS: f64 = 0.005;

/// The window at one point.
#[derive(Clone, Copy, Debug)]
pub(super) struct GlassSample {
    /// Identifier of the piece of glass.
    pub piece: u32,
    pub glass: GlassColour,
    /// Signed distance to the nearest edge of lead; negative within lead.
    pub clearance: f64,
    /// Density of brown paint, 0 to 1.
    pub paint: f64,
}

impl GlassSample {
    fn new(piece: u32, glass: GlassColour) -> Self {
        Self {
            piece,
            glass,
            clearance: 1.0,
            paint: 0.0,
        }
    }

    /// Adds a lead along a line at `distance`, soldered to the other leads.
    fn lead(mut self, distance: f64, half_width: f64) -> Self {
        let edge = distance.abs() - half_width;
        self.clearance = smooth_union(self.clearance, edge, SOLDER_RADIUS);
        self
    }

    /// Inserts `piece` into the shape with signed distance `d`, with a lead around it.
    fn inlay(mut self, d: f64, half_width: f64, piece: u32, glass: GlassColour) -> Self {
        if d < 0.0 {
            self = Self::new(piece, glass);
        }
        self.lead(d, half_width)
    }

    /// Covers everything outside an opening with signed distance `d`.
    fn within(mut self, d: f64) -> Self {
        self.clearance = self.clearance.min(-d);
        self
    }

    /// Adds paint of the given density.
    fn painted(mut self, density: f64) -> Self {
        self.paint = self.paint.max(density.clamp(0.0, 1.0));
        self
    }

    /// Adds paint of the given density inside the shape with signed distance `d`.
    fn painted_inside(self, d: f64, density: f64) -> Self {
        if d < 0.0 { self.painted(density) } else { self }
    }
}

/// Density of a painted line at `distance`.
fn stroke(distance: f64, half_width: f64) -> f64 {
    1.0 - smoothstep(0.5 * half_width, 1.5 * half_width, distance.abs())
}

/// Density of a painted diaper: lozenges with a dot in each.
fn diaper(p: Vec2, side: f64) -> f64 {
    let (a, b) = ((p.x + p.y) / side, (p.x - p.y) / side);
    let (a, b) = (a - a.round(), b - b.round());
    let line = stroke(a.abs().min(b.abs()) * side, 0.0020);
    let dot = stroke((0.5 - a.abs()).hypot(0.5 - b.abs()) * side, 0.0034);
    0.34 * line.max(dot)
}

/// Density of painted leaves, in pairs along a stem on the x axis.
fn foliage(p: Vec2, spacing: f64) -> f64 {
    let place = (p.x / spacing).round() * spacing;
    let q = vec2(p.x - place, p.y.abs()).rotated(-0.85);
    let leaf = vesica(q - vec2(0.55 * spacing, 0.0), 0.5 * spacing, 0.17 * spacing);
    0.55 * stroke(p.y, 0.0026).max(stroke(leaf, 0.0024))
}

/// Outer radii of the sun, of the first and the second ring of lancets and of the ring of pearls; half the
/// side of the square inside the frame.
const SUN_RADIUS: f64 = 0.160;
const FIRST_LANCETS_RADIUS: f64 = 0.545;
const SECOND_LANCETS_RADIUS: f64 = 0.868;
const PEARLS_RADIUS: f64 = 0.914;
const FRAME_HALF_SIDE: f64 = 0.940;

/// The window at `p`. The identifier of a piece is its part in hundreds plus its index there.
pub(super) fn glass_at(p: Vec2) -> GlassSample {
    // Irregular, as if drawn by hand.
    let p = p + vec2(noise(p * 6.0, 52).0, noise(p * 6.0, 53).0) * 0.005;
    let r = p.length();
    let square = p.x.abs().max(p.y.abs());
    if square > 1.0 {
        quarries(p).lead(square - 1.0, BOLD_HALF_WIDTH)
    } else if square > FRAME_HALF_SIDE {
        frame(p)
            .lead(square - FRAME_HALF_SIDE, BOLD_HALF_WIDTH)
            .lead(square - 1.0, BOLD_HALF_WIDTH)
    } else if r > PEARLS_RADIUS {
        corner(p)
            .lead(r - PEARLS_RADIUS, BOLD_HALF_WIDTH)
            .lead(square - FRAME_HALF_SIDE, BOLD_HALF_WIDTH)
    } else if r > SECOND_LANCETS_RADIUS {
        pearls(p, r)
            .lead(r - PEARLS_RADIUS, BOLD_HALF_WIDTH)
            .lead(r - SECOND_LANCETS_RADIUS, STONE_HALF_WIDTH)
    } else if r > FIRST_LANCETS_RADIUS {
        second_lancets(p).within(r - SECOND_LANCETS_RADIUS + STONE_HALF_WIDTH)
    } else if r > SUN_RADIUS {
        first_lancets(p)
    } else {
        sun(p).lead(r - SUN_RADIUS, STONE_HALF_WIDTH)
    }
}

/// A star with twelve points around six petals.
fn sun(p: Vec2) -> GlassSample {
    let (k, q) = fold(p, 12, 0.0);
    let (gap, _) = fold(p, 12, PI / 12.0);
    let rays = star(vec2(p.y, -p.x), 12, 0.146, 0.082);
    let (petal, l) = fold(p, 6, PI / 6.0);
    let petals = vesica(l - vec2(0.046, 0.0), 0.026, 0.017);
    let glass = [Amber, Gold][(k % 2) as usize];
    GlassSample::new(10 + gap, Cobalt)
        .inlay(rays, FINE_HALF_WIDTH, 30 + k, glass)
        .painted(0.5 * stroke(q.y, 0.0028) * smoothstep(0.0, 0.01, -rays))
        .inlay(circle(p, 0.080), FINE_HALF_WIDTH, 50, Ruby)
        .inlay(petals, 0.7 * FINE_HALF_WIDTH, 60 + petal, Opal)
        .painted(0.5 * stroke(l.y, 0.002) * smoothstep(0.0, 0.006, -petals))
        .inlay(circle(p, 0.022), 0.8 * FINE_HALF_WIDTH, 51, Gold)
}

/// Signed distance to the opening of a lancet between stone bars. Its sides are radial, at the angle
/// `half_angle` from its axis; its head is a circle around `(head, 0)`.
fn lancet(q: Vec2, half_angle: f64, head: f64, foot: f64) -> f64 {
    let (s, c) = half_angle.sin_cos();
    let y = q.y.abs();
    let d = if q.x * c + y * s > head * c {
        circle(q - vec2(head, 0.0), head * s - STONE_HALF_WIDTH)
    } else {
        y * c - q.x * s + STONE_HALF_WIDTH
    };
    d.max(foot + STONE_HALF_WIDTH - q.length())
}

/// A disc of glass, piece `disc`, in the pale ground between the heads of lancets, piece `ground`.
fn eyelet(p: Vec2, radius: f64, [ground, disc]: [u32; 2], glass: GlassColour) -> GlassSample {
    let ring = stroke(circle(p, 0.45 * radius), 0.003);
    let edge = circle(p, radius);
    GlassSample::new(ground, Pale)
        .inlay(edge, FINE_HALF_WIDTH, disc, glass)
        .painted_inside(edge, 0.5 * ring)
}

fn first_lancets(p: Vec2) -> GlassSample {
    const HEAD: f64 = 0.428;
    let (gap, g) = fold(p, 12, PI / 12.0);
    let (k, q) = fold(p, 12, 0.0);
    let light = lancet(q, PI / 12.0, HEAD, SUN_RADIUS);
    if light > 0.0 {
        let eye = g - vec2(0.505, 0.0);
        let glass = [Amber, Ruby][(gap % 2) as usize];
        return eyelet(eye, 0.024, [200 + gap, 212 + gap], glass)
            .within(2.0 * STONE_HALF_WIDTH - light)
            .lead(p.length() - FIRST_LANCETS_RADIUS, STONE_HALF_WIDTH);
    }
    let even = k % 2 == 0;
    let (ground, edge) = if even { (Cobalt, Ruby) } else { (Ruby, Cobalt) };
    let c = q - vec2(HEAD, 0.0);
    // A narrow border of alternating colours.
    let step = (q.x / 0.058).floor();
    let side = u32::from(q.y > 0.0);
    let border = [edge, Pale][step.rem_euclid(2.0) as usize];
    let joint = (q.x / 0.058 - (q.x / 0.058).round()) * 0.058;
    let border = GlassSample::new(220 + 40 * k + 2 * (step as u32) + side, border)
        .lead(joint, 0.7 * FINE_HALF_WIDTH)
        .lead(q.y, 0.7 * FINE_HALF_WIDTH);
    let field = light + 0.021;
    let mut spot = border.inlay(field, FINE_HALF_WIDTH, 800 + k, ground);
    if field < 0.0 {
        // A stem of leaves below the roundel.
        let stem = segment(q, vec2(0.2, 0.0), vec2(0.35, 0.0));
        let leaves = vesica(q - vec2(0.290, 0.0), 0.080, 0.030);
        let glass = [Emerald, Moss][usize::from(even)];
        spot = spot
            .painted(diaper(q, 0.020))
            .lead(stem, 0.6 * FINE_HALF_WIDTH)
            .inlay(leaves, 0.9 * FINE_HALF_WIDTH, 820 + k, glass)
            .painted_inside(leaves, foliage(q - vec2(0.22, 0.0), 0.026));
    }
    let medallion = circle(c, 0.070);
    let (rim, flower) = if even { (Violet, Opal) } else { (Azure, Amber) };
    spot = spot.inlay(medallion, 0.8 * BOLD_HALF_WIDTH, 840 + k, rim);
    if medallion > 0.0 {
        return spot.within(light);
    }
    // Six petals, or a star with eight points.
    let (petal, l) = fold(c, 6, 0.0);
    let petals = vesica(l - vec2(0.037, 0.0), 0.026, 0.0185);
    let (figure, piece, heart) = match even {
        true => (petals, 1000 + 10 * k + petal, Gold),
        false => (star(c, 8, 0.059, 0.033), 880 + k, Ruby),
    };
    spot.painted(0.45 * stroke(circle(c, 0.056), 0.0022))
        .inlay(figure, 0.7 * FINE_HALF_WIDTH, piece, flower)
        .painted(0.45 * stroke(l.y, 0.002) * smoothstep(0.0, 0.005, -figure))
        .inlay(circle(c, 0.0155), 0.6 * FINE_HALF_WIDTH, 860 + k, heart)
        .within(light)
}

fn second_lancets(p: Vec2) -> GlassSample {
    const HEAD: f64 = 0.754;
    let (gap, g) = fold(p, 24, 0.0);
    let (k, q) = fold(p, 24, PI / 24.0);
    let light = lancet(q, PI / 24.0, HEAD, FIRST_LANCETS_RADIUS);
    if light > 0.0 {
        let eye = g - vec2(0.830, 0.0);
        let glass = [Ruby, Cobalt, Emerald][(gap % 3) as usize];
        return eyelet(eye, 0.020, [1200 + gap, 1600 + gap], glass)
            .within(2.0 * STONE_HALF_WIDTH - light);
    }
    let (ground, bar) = [
        (Cobalt, Ruby),
        (Azure, Amber),
        (Cobalt, Emerald),
        (Azure, Violet),
    ][(k % 4) as usize];
    // Three panels along the radius, with leads between them.
    let panel = (((q.x - 0.562) / 0.0600).floor().clamp(0.0, 2.0)) as u32;
    let level = 0.562 + 0.0600 * ((q.x - 0.562) / 0.0600).round().clamp(1.0, 2.0);
    let foot = GlassSample::new(1230 + 4 * k + panel, ground)
        .lead(q.x - level, 0.8 * FINE_HALF_WIDTH)
        .painted(diaper(q, 0.0175));
    // A lozenge in each of the two inner panels.
    let middle = 0.562 + 0.0600 * (f64::from(panel.min(1)) + 0.5);
    let l = q - vec2(middle, 0.0);
    let lozenge = (l.x.abs() + 0.62 * l.y.abs() - 0.0280) * 0.81;
    let spot = if panel < 2 {
        let glass = if panel == 0 { bar } else { Pale };
        foot.inlay(lozenge, 0.8 * FINE_HALF_WIDTH, 1340 + 2 * k + panel, glass)
            .painted_inside(lozenge, 0.55 * stroke(circle(l, 0.007), 0.0026))
    } else {
        foot
    };
    let c = q - vec2(HEAD, 0.0);
    let medallion = circle(c, 0.068);
    let spot = spot.inlay(medallion, 0.8 * BOLD_HALF_WIDTH, 1400 + k, bar);
    if medallion > 0.0 {
        return spot.within(light);
    }
    let (_, l) = fold(c, 4, 0.0);
    let (_, rays) = fold(c, 16, PI / 16.0);
    let figure = circle(l - vec2(0.0310, 0.0), 0.0270).min(circle(c, 0.030));
    let glass = [Opal, Gold, Rose, Pale][(k % 4) as usize];
    let heart = [Cobalt, Ruby][(k % 2) as usize];
    let ring = stroke(circle(l - vec2(0.035, 0.0), 0.011), 0.0022);
    spot.painted(0.45 * stroke(rays.y, 0.0022))
        .inlay(figure, 0.8 * FINE_HALF_WIDTH, 1430 + k, glass)
        .painted_inside(figure, 0.5 * ring)
        .inlay(circle(c, 0.0155), 0.6 * FINE_HALF_WIDTH, 1460 + k, heart)
        .within(light)
}

fn pearls(p: Vec2, r: f64) -> GlassSample {
    const MIDDLE: f64 = 0.5 * (PEARLS_RADIUS + SECOND_LANCETS_RADIUS) + 0.002;
    let (k, q) = fold(p, 36, 0.0);
    let (gap, g) = fold(p, 36, PI / 36.0);
    let glass = [Ruby, Cobalt][(gap % 2) as usize];
    let leaf = stroke(vesica(vec2(g.y, r - MIDDLE), 0.028, 0.008), 0.0028);
    let pearl = circle(q - vec2(MIDDLE, 0.0), 0.0185);
    GlassSample::new(1500 + gap, glass)
        .painted(0.5 * leaf)
        .lead(q.y, 0.8 * FINE_HALF_WIDTH)
        .inlay(pearl, 0.7 * FINE_HALF_WIDTH, 1540 + k, Opal)
}

fn corner(p: Vec2) -> GlassSample {
    let place = u32::from(p.x > 0.0) + 2 * u32::from(p.y > 0.0);
    let q = vec2(p.x.abs(), p.y.abs());
    let half = 2 * place + u32::from(q.x > q.y);
    // Coordinates in one half of the corner.
    let h = vec2(q.x.min(q.y), q.x.max(q.y));
    // A great circle that touches the rose and the frame, and a small one on each side of it.
    let c = q - vec2(0.7715, 0.7715);
    let small = h - vec2(0.537, 0.857);
    let great = circle(c, 0.158);
    // Foliage between the small circle and the axis, with a jewel.
    let tail = h.x - 0.40;
    let jewel = h - vec2(0.345, 0.896);
    let gem = circle(jewel, 0.029);
    let stars = star(h - vec2(0.645, 0.917), 4, 0.017, 0.006);
    let ground = if tail < 0.0 {
        GlassSample::new(1880 + half, Gold)
            .painted(foliage(vec2(h.x, h.y - 0.920), 0.036))
            .lead(h.x, FINE_HALF_WIDTH)
            .inlay(gem, 0.8 * FINE_HALF_WIDTH, 1890 + half, Ruby)
            .painted(0.55 * stroke(circle(jewel, 0.014), 0.003))
    } else {
        GlassSample::new(1860 + half, Cobalt)
            .lead(q.x - q.y, FINE_HALF_WIDTH)
            .lead(h.x, FINE_HALF_WIDTH)
            .painted(diaper(q, 0.024))
            .inlay(stars, 0.6 * FINE_HALF_WIDTH, 1870 + half, Pale)
    };
    let rim = circle(small, 0.068);
    let ground = ground.lead(tail, FINE_HALF_WIDTH);
    let mut ground = ground.inlay(rim, BOLD_HALF_WIDTH, 1640 + half, Violet);
    if rim < 0.0 {
        let (petal, l) = fold(small, 5, 0.3);
        let petals = circle(l - vec2(0.038, 0.0), 0.0225);
        let heart = circle(small, 0.017);
        ground = ground
            .inlay(petals, 0.7 * FINE_HALF_WIDTH, 1660 + 5 * half + petal, Opal)
            .painted(0.5 * stroke(l.y, 0.002) * smoothstep(0.0, 0.008, -petals))
            .inlay(heart, 0.7 * FINE_HALF_WIDTH, 1710 + half, Gold);
    }
    if great > BOLD_HALF_WIDTH {
        return ground.lead(great, BOLD_HALF_WIDTH);
    }
    // A quatrefoil in stone, with a leaf in each foil.
    let (foil, l) = fold(c, 4, 0.0);
    let opening = circle(l - vec2(0.074, 0.0), 0.072)
        .max(great + 2.0 * BOLD_HALF_WIDTH)
        .min(circle(c, 0.056));
    if opening > 0.0 {
        // Between the foils.
        let (between, _) = fold(c, 4, PI / 4.0);
        return GlassSample::new(1800 + 4 * place + between, Azure)
            .within((2.0 * BOLD_HALF_WIDTH - opening).max(great + BOLD_HALF_WIDTH));
    }
    let leaf = vesica(l - vec2(0.092, 0.0), 0.046, 0.025);
    let (medallion, rays) = (circle(c, 0.050), star(c, 8, 0.040, 0.022));
    let number = 4 * place + foil;
    GlassSample::new(1730 + number, Ruby)
        .lead((l.y.abs() - l.x) * FRAC_1_SQRT_2, FINE_HALF_WIDTH)
        .painted(diaper(c, 0.018))
        .inlay(leaf, 0.8 * FINE_HALF_WIDTH, 1750 + number, Emerald)
        .painted_inside(leaf, foliage(l - vec2(0.05, 0.0), 0.018))
        .inlay(medallion, 0.8 * BOLD_HALF_WIDTH, 1770 + place, Cobalt)
        .inlay(rays, 0.6 * FINE_HALF_WIDTH, 1780 + place, Gold)
        .within(opening)
}

fn frame(p: Vec2) -> GlassSample {
    const STONES: f64 = 12.0;
    let (along, side) = match (p.x.abs() > p.y.abs(), p.x > 0.0, p.y > 0.0) {
        (true, right, _) => (p.y, u32::from(right)),
        (false, _, below) => (p.x, 2 + u32::from(below)),
    };
    if along.abs() > FRAME_HALF_SIDE {
        let place = u32::from(p.x > 0.0) + 2 * u32::from(p.y > 0.0);
        return GlassSample::new(700 + place, Ruby)
            .lead(along.abs() - FRAME_HALF_SIDE, FINE_HALF_WIDTH);
    }
    // Long stones in two blues, with short golden ones between them.
    let length = 2.0 * FRAME_HALF_SIDE / STONES;
    let t = (along + FRAME_HALF_SIDE) / length;
    let from_joint = (t - t.round()) * length;
    let short = from_joint.abs() - 0.030;
    let middle = p.x.abs().max(p.y.abs()) - 0.5 * (1.0 + FRAME_HALF_SIDE);
    if short < 0.0 {
        let dot = 0.55 * stroke(circle(vec2(from_joint, middle), 0.008), 0.003);
        GlassSample::new(2000 + 20 * side + t.round() as u32, Gold).painted(dot)
    } else {
        let stone = (t.floor() as u32).min(STONES as u32 - 1);
        let glass = [Cobalt, Azure][(stone % 2) as usize];
        let centre = (t - t.floor() - 0.5) * length;
        let leaf = stroke(vesica(vec2(centre, middle), 0.045, 0.013), 0.0028);
        GlassSample::new(710 + 20 * side + stone, glass).painted(0.5 * leaf)
    }
    .lead(short, FINE_HALF_WIDTH)
}

fn quarries(p: Vec2) -> GlassSample {
    const SIDE: f64 = 0.2;
    let [a, b] = [p.x + p.y, p.x - p.y].map(|x| x * FRAC_1_SQRT_2 / SIDE);
    let (i, j) = (a.floor(), b.floor());
    let pick = cell_hash(i as i32, j as i32, 51);
    let glass = match (pick * 10.0) as u32 {
        0 => Azure,
        1 => Gold,
        2 => Aqua,
        _ => Pale,
    };
    let piece = 1000 + (pick * f64::from(u16::MAX)) as u32;
    let line = |t: f64| (t - t.round()) * SIDE;
    let (u, v) = (a - i - 0.5, b - j - 0.5);
    let (_, q) = fold(vec2(u, v), 4, TAU / 8.0);
    let flower = stroke(vesica(q - vec2(0.16, 0.0), 0.11, 0.05), 0.012);
    GlassSample::new(piece, glass)
        .painted(0.5 * flower)
        .lead(line(a), FINE_HALF_WIDTH)
        .lead(line(b), FINE_HALF_WIDTH)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lead_separates_different_pieces() {
        // Steps are much shorter than the width of a lead.
        let step = 0.2 * FINE_HALF_WIDTH;
        for row in 0..160 {
            let y = -1.06 + f64::from(row) * 0.01327;
            let mut before = glass_at(vec2(-1.2, y));
            for i in 1..(2.4 / step) as u32 {
                let here = glass_at(vec2(-1.2 + f64::from(i) * step, y));
                if here.piece != before.piece {
                    let lead = here.clearance.min(before.clearance);
                    assert!(lead < 0.0, "{before:?} meets {here:?} at y = {y}");
                }
                before = here;
            }
        }
    }
}
