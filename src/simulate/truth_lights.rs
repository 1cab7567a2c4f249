//! The lights of a simulated capture's `truth/` folder, under which relit pictures are evaluated. Recovery
//! never uses them.

use super::coordinates::{Vec2, mix3, smoothstep, vec2};
use super::gradient_noise::layered_noise;
use super::light_codes::{LightCodes, code_for};
use crate::transport::Extent;

/// The light in `truth/light_NAME.png`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TruthLight {
    /// All elements at full brightness.
    Flood,
    /// Black and white squares, sixteen along the shorter side.
    Checker,
    /// Vertical black and white stripes, sixteen periods across.
    Stripes,
    /// A gradient between four coloured corners.
    Colour,
    /// A flame.
    Fire,
}

impl TruthLight {
    /// All lights.
    pub const ALL: [Self; 5] = [
        Self::Flood,
        Self::Checker,
        Self::Stripes,
        Self::Colour,
        Self::Fire,
    ];

    /// NAME in `light_NAME.png` and `relit_NAME.png`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Flood => "flood",
            Self::Checker => "checker",
            Self::Stripes => "stripes",
            Self::Colour => "colour",
            Self::Fire => "fire",
        }
    }

    /// The codes of the light, always RGB.
    pub fn codes(self, light: Extent) -> LightCodes {
        let shorter = light.width.min(light.height);
        let white = |on: bool| [if on { 255 } else { 0 }; 3];
        let mut codes = Vec::with_capacity(light.area());
        for v in 0..light.height {
            for u in 0..light.width {
                let x = (f64::from(u) + 0.5) / f64::from(light.width);
                let y = (f64::from(v) + 0.5) / f64::from(light.height);
                codes.push(match self {
                    Self::Flood => white(true),
                    Self::Checker => {
                        let square = (shorter / 16).max(1);
                        white((u / square + v / square) % 2 == 1)
                    }
                    Self::Stripes => white(u / (light.width / 32).max(1) % 2 == 1),
                    Self::Colour => corners(x, y).map(code_for),
                    Self::Fire => flame(vec2(x, y)).map(code_for),
                });
            }
        }
        LightCodes::Rgb(codes)
    }
}

/// Linear RGB, bilinear between four corners.
fn corners(x: f64, y: f64) -> [f64; 3] {
    let top = mix3([0.02, 0.0, 1.0], [1.0, 0.0, 0.08], x);
    let bottom = mix3([0.0, 1.0, 1.0], [1.0, 0.9, 0.0], x);
    mix3(top, bottom, y)
}

/// The linear RGB of a flame on the unit square: glowing gas that cools as it rises.
fn flame(p: Vec2) -> [f64; 3] {
    let height = 1.0 - p.y;
    // The horizontal displacement grows with the height.
    let sway = layered_noise(vec2(p.x * 1.5, p.y * 2.2 + 3.0), 3, 11) * 0.9 * height;
    let x = p.x - 0.5 + sway;
    let width = 0.36 * (1.0 - height).max(0.0).powf(0.7) * smoothstep(-0.25, 0.22, height);
    let body = 1.0 - (x.abs() / width.max(1e-3)).powi(2);
    let tongues = layered_noise(vec2(p.x * 6.0, p.y * 3.5 + 8.0), 4, 23);
    let heat = (body + 1.3 * tongues * (0.4 + height)).clamp(0.0, 1.0);
    // Approximate black body colours: red, then yellow, and white in the core.
    let glow = |from: f64, to: f64| smoothstep(from, to, heat);
    let halo = 0.06 * (-8.0 * (x * x + (height - 0.35).powi(2))).exp();
    [
        glow(0.0, 0.55) + halo,
        0.75 * glow(0.12, 0.95) + 0.35 * halo,
        0.35 * glow(0.55, 1.2) + 0.05 * halo,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lights_are_bright_and_different() {
        let light = Extent::new(64, 48);
        let all = TruthLight::ALL.map(|l| l.codes(light));
        for (i, codes) in all.iter().enumerate() {
            let LightCodes::Rgb(rgb) = codes else {
                panic!("a truth light is always RGB")
            };
            assert_eq!(rgb.len(), light.area());
            let brightest = rgb.iter().flatten().max();
            assert!(brightest > Some(&200), "{:?} is dim", TruthLight::ALL[i]);
            assert!(all[..i].iter().all(|other| other != codes));
        }
    }
}
