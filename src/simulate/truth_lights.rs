//! The lights of a simulated capture's `truth/` folder, under which relit pictures are evaluated. Recovery
//! never uses them.

use super::gradient_noise::layered_noise;
use super::pattern_image::{PatternImage, code_for};
use super::vec2::{Vec2, mix3, smoothstep, vec2};
use crate::transport::Extent;

/// The lights by their names NAME in `light_NAME.png` and `relit_NAME.png`; all RGB.
pub fn truth_lights(light: Extent) -> [(&'static str, PatternImage); 5] {
    let white = |on: bool| [if on { 255 } else { 0 }; 3];
    // Sixteen squares along the shorter side, and sixteen periods across.
    let square = (light.width.min(light.height) / 16).max(1);
    let checker = |u: u32, v: u32| white((u / square + v / square) % 2 == 1);
    let stripe = (light.width / 32).max(1);
    let codes = |code: &dyn Fn(u32, u32) -> [u8; 3]| {
        PatternImage::Rgb(light.cells().map(|(u, v)| code(u, v)).collect())
    };
    let centre = |u: u32, v: u32| {
        let share = |x: u32, side: u32| (f64::from(x) + 0.5) / f64::from(side);
        vec2(share(u, light.width), share(v, light.height))
    };
    [
        ("flood", codes(&|_, _| white(true))),
        ("checker", codes(&checker)),
        ("stripes", codes(&|u, _| white(u / stripe % 2 == 1))),
        ("colour", codes(&|u, v| corners(centre(u, v)).map(code_for))),
        ("fire", codes(&|u, v| flame(centre(u, v)).map(code_for))),
    ]
}

/// Linear RGB on the unit square, bilinear between four corners.
fn corners(p: Vec2) -> [f64; 3] {
    let top = mix3([0.02, 0.0, 1.0], [1.0, 0.0, 0.08], p.x);
    let bottom = mix3([0.0, 1.0, 1.0], [1.0, 0.9, 0.0], p.x);
    mix3(top, bottom, p.y)
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
        let all = truth_lights(light);
        for (i, (name, codes)) in all.iter().enumerate() {
            let PatternImage::Rgb(rgb) = codes else {
                panic!("a truth light is always RGB")
            };
            assert_eq!(rgb.len(), light.area());
            let brightest = rgb.iter().flatten().max();
            assert!(brightest > Some(&200), "{name} is dim");
            assert!(all[..i].iter().all(|(_, other)| other != codes));
        }
    }
}
