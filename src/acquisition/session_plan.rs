//! What the numbers of a session mean for an object: sizes, the window that holds its light, and time.

use super::display_layout::DisplayLayout;
use crate::recover::WindowSizeEstimate;
use crate::transport::Extent;

/// Camera pixels an element of the light plane should have along each axis: fewer lose detail, more cost time and space.
const CAMERA_PIXELS: [f64; 2] = [1.5, 4.0];
/// The window that `recover` takes by default.
const DEFAULT_WINDOW: u32 = 15;
/// Least side of a light plane.
const MIN_LIGHT_SIDE: u32 = 4;
/// Channels times bytes of a sample of a photograph.
const BYTES_PER_PIXEL: u64 = 6;

/// A session beside its light plane; unknown sizes are left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SessionSetup {
    /// Width of the display's picture in millimetres.
    pub display_width_mm: Option<f64>,
    /// How far from where it enters light leaves the object, in millimetres.
    pub spread_mm: Option<f64>,
    /// The part of the camera's picture that shows the light plane, in pixels.
    pub camera: Option<Extent>,
    /// Seconds from one photograph to the next.
    pub interval_seconds: f64,
}

/// The numbers of a session.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SessionPlan {
    layout: DisplayLayout,
    setup: SessionSetup,
    pictures: usize,
}

impl SessionPlan {
    /// For a session of so many `pictures`.
    pub fn new(layout: DisplayLayout, setup: SessionSetup, pictures: usize) -> Self {
        Self {
            layout,
            setup,
            pictures,
        }
    }

    /// Side of a light element in millimetres.
    pub fn element_mm(&self) -> Option<f64> {
        let pixel = self.setup.display_width_mm? / f64::from(self.layout.display.width);
        Some(pixel * f64::from(self.layout.element_side))
    }

    /// Side of the window, in light elements, that holds the light of a camera pixel: as far as light spreads, to both sides
    /// of an element, and one for what lies between elements.
    pub fn window(&self) -> Option<u32> {
        let reach = (self.setup.spread_mm? / self.element_mm()?).ceil();
        Some(2 * (reach.min(1e6) as u32) + 3)
    }

    /// Camera pixels along the side of an element.
    pub fn camera_pixels(&self) -> Option<f64> {
        let (camera, light) = (self.setup.camera?, self.layout.light);
        let ratio = |camera: u32, light: u32| f64::from(camera) / f64::from(light);
        Some(ratio(camera.width, light.width).min(ratio(camera.height, light.height)))
    }

    /// The plan in sentences, with advice where numbers do not suit one another.
    pub fn lines(&self) -> Vec<String> {
        let DisplayLayout {
            display,
            light,
            element_side,
        } = self.layout;
        let [left, top] = self.layout.margin();
        let mut lines = vec![format!(
            "{light} light elements of {element_side} x {element_side} display pixels, on a display of {display} pixels with a \
             black margin of {left} at the left and {top} at the top"
        )];
        if let Some(side) = self.element_mm() {
            let [width, height] = [light.width, light.height].map(|n| side * f64::from(n));
            lines.push(format!(
                "an element is {side:.2} mm wide, the light plane {width:.0} x {height:.0} mm"
            ));
        }
        if let Some(window) = self.window() {
            lines.push(self.window_line(window));
        }
        if let (Some(pixels), Some(camera)) = (self.camera_pixels(), self.setup.camera) {
            let [least, most] = CAMERA_PIXELS;
            let advice = match pixels {
                pixels if pixels < least => {
                    ": fewer elements, or a longer lens, would show them".to_owned()
                }
                pixels if pixels > most => format!(
                    ": averaging {0} x {0} pixels of each photograph loses nothing that elements show",
                    (pixels / 2.0).floor()
                ),
                _ => String::new(),
            };
            let bytes = self.pictures as u64 * camera.area() as u64 * BYTES_PER_PIXEL;
            lines.push(format!(
                "an element has {pixels:.1} camera pixels along its side{advice}"
            ));
            lines.push(format!(
                "the photographs take {:.1} GB as 16-bit pictures",
                bytes as f64 / 1e9
            ));
        }
        let minutes = (self.pictures as f64 * self.setup.interval_seconds / 60.0).ceil();
        lines.push(format!(
            "{} photographs, one every {} seconds: {minutes:.0} minutes",
            self.pictures, self.setup.interval_seconds
        ));
        lines
    }

    fn window_line(&self, window: u32) -> String {
        let largest = WindowSizeEstimate::MAX_WINDOW.side();
        let spread = self.setup.spread_mm.unwrap_or_default();
        let needed = format!(
            "light that spreads by {spread} mm needs a window of {window} x {window} elements"
        );
        if window <= DEFAULT_WINDOW {
            return format!("{needed}; the default of `recover`, {DEFAULT_WINDOW}, holds it");
        }
        if window <= largest {
            return format!("{needed}: `recover --window {window}`");
        }
        let side = self.element_mm().unwrap_or_default() / f64::from(self.layout.element_side);
        // Elements of so many display pixels have the largest window.
        let least = (spread / (f64::from((largest - 3) / 2) * side)).ceil();
        let DisplayLayout { display, .. } = self.layout;
        let [width, height] =
            [display.width, display.height].map(|n| (f64::from(n) / least) as u32);
        match width.min(height) >= MIN_LIGHT_SIDE {
            true => format!(
                "{needed}, too many to recover well: choose at most --light {width}x{height}, or bring the object closer to the \
                 display"
            ),
            false => {
                format!("{needed}, too many to recover: the object is too far from this display")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(light: Extent, spread: f64, camera: Extent) -> SessionPlan {
        let layout = DisplayLayout::new(Extent::new(2560, 1440), light, None).unwrap();
        let setup = SessionSetup {
            display_width_mm: Some(600.0),
            spread_mm: Some(spread),
            camera: Some(camera),
            interval_seconds: 4.0,
        };
        SessionPlan::new(layout, setup, 150)
    }

    #[test]
    fn elements_have_sizes_and_light_a_window() {
        let plan = plan(Extent::new(128, 72), 20.0, Extent::new(384, 216));
        assert_eq!(plan.element_mm(), Some(4.6875));
        assert_eq!(plan.window(), Some(13));
        assert_eq!(plan.camera_pixels(), Some(3.0));
        let lines = plan.lines().join("\n");
        for part in [
            "20 x 20 display pixels",
            "4.69 mm wide",
            "of `recover`, 15, holds it",
            "10 minutes",
        ] {
            assert!(lines.contains(part), "no {part}: {lines}");
        }
    }

    #[test]
    fn numbers_that_do_not_suit_one_another_have_advice() {
        let fine = plan(Extent::new(512, 288), 20.0, Extent::new(400, 225))
            .lines()
            .join("\n");
        // 7 display pixels are 1.6 mm, over 13 of which light spreads.
        assert!(fine.contains("--light 365x205"), "{fine}");
        let advised = plan(Extent::new(365, 205), 20.0, Extent::new(400, 225));
        assert!(advised.window() <= Some(31), "{:?}", advised.window());
        let far = plan(Extent::new(64, 36), 5000.0, Extent::new(400, 225));
        assert!(far.lines().join(" ").contains("too far from this display"));
        assert!(fine.contains("fewer elements"), "{fine}");
        let large = plan(Extent::new(32, 18), 1.0, Extent::new(3200, 1800))
            .lines()
            .join("\n");
        assert!(large.contains("averaging 50 x 50 pixels"), "{large}");
    }
}
