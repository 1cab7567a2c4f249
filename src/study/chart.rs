//! Line charts with a logarithmic horizontal axis, as SVG.

use std::ops::Range;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::error::{ChartError, StudyError};

const SIZE_PX: (u32, u32) = (960, 500);
/// Width of the legend, to the right of the plot.
const LEGEND_WIDTH_PX: u32 = 210;
/// Colours that are distinct with every kind of colour vision (Okabe & Ito 2008).
const COLOURS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(90, 90, 90),
    RGBColor(190, 180, 20),
];
const FONT: &str = "Helvetica, Arial, sans-serif";
/// A line with at most so many points has a marker at each.
const MAX_MARKERS: usize = 16;

pub(super) struct ChartSeries {
    pub name: String,
    /// By ascending x; every x is positive.
    pub points: Vec<(f64, f64)>,
}

pub(super) struct LineChart<'a> {
    pub title: &'a str,
    pub x_label: &'a str,
    pub y_label: &'a str,
    pub x_ticks: Vec<f64>,
    /// Label and factor of a second horizontal axis at the top, with the values `x · factor`.
    pub top: Option<(&'a str, f64)>,
    pub y: Range<f64>,
    /// A reference value on the y axis, and its name.
    pub reference: Option<(f64, &'a str)>,
    pub series: Vec<ChartSeries>,
}

impl LineChart<'_> {
    pub fn svg(&self) -> Result<String, StudyError> {
        let mut svg = String::new();
        let area = SVGBackend::with_string(&mut svg, SIZE_PX).into_drawing_area();
        self.draw(&area)?;
        area.present()?;
        drop(area);
        Ok(svg)
    }

    fn draw(&self, area: &DrawingArea<SVGBackend, Shift>) -> Result<(), ChartError> {
        let x = self.x_range();
        area.fill(&WHITE)?;
        let title = TextStyle::from((FONT, 20).into_font()).color(&RGBColor(30, 30, 30));
        let area = area.titled(self.title, title)?;
        let mut builder = ChartBuilder::on(&area);
        builder
            .margin(12)
            .margin_right(LEGEND_WIDTH_PX)
            .x_label_area_size(52)
            .y_label_area_size(64);
        if self.top.is_some() {
            builder.top_x_label_area_size(48);
        }
        let factor = self.top.map_or(1.0, |(_, factor)| factor);
        let bottom_x = x.clone().log_scale();
        let bottom_x = bottom_x.with_key_points(self.x_ticks.clone());
        let top_x = (x.start * factor..x.end * factor).log_scale();
        let top_x = top_x.with_key_points(self.x_ticks.iter().map(|x| x * factor).collect());
        let mut chart = builder
            .build_cartesian_2d(bottom_x, self.y.clone())?
            .set_secondary_coord(top_x, self.y.clone());
        let label = (FONT, 14);
        chart
            .configure_mesh()
            .x_labels(self.x_ticks.len().max(2))
            .y_labels(9)
            .light_line_style(TRANSPARENT)
            .bold_line_style(RGBColor(225, 225, 225))
            .axis_style(RGBColor(90, 90, 90))
            .x_desc(self.x_label)
            .y_desc(self.y_label)
            .x_label_formatter(&|x| format_number(*x))
            .y_label_formatter(&|y| format_number(*y))
            .label_style(label)
            .axis_desc_style((FONT, 16))
            .draw()?;
        if let Some((top_label, _)) = self.top {
            chart
                .configure_secondary_axes()
                .x_labels(self.x_ticks.len())
                .x_desc(top_label)
                .x_label_formatter(&|x| format_number(*x))
                .label_style(label)
                .axis_desc_style((FONT, 16))
                .axis_style(RGBColor(90, 90, 90))
                .draw()?;
        }
        let left = (area.dim_in_pixel().0 - LEGEND_WIDTH_PX + 16) as i32;
        if let Some((value, name)) = self.reference {
            let grey = RGBColor(120, 120, 120);
            let ends = [(x.start, value), (x.end, value)];
            chart.draw_series(DashedLineSeries::new(ends, 6, 5, grey.stroke_width(1)))?;
            let y = 72 + 24 * self.series.len() as i32;
            for x in [left, left + 13] {
                let dash = PathElement::new([(x, y), (x + 8, y)], grey.stroke_width(1));
                area.draw(&dash)?;
            }
            area.draw(&legend_label(name, left, y))?;
        }
        for (i, series) in self.series.iter().enumerate() {
            let colour = COLOURS[i % COLOURS.len()];
            let line = LineSeries::new(series.points.iter().copied(), colour.stroke_width(2));
            chart.draw_series(line)?;
            if series.points.len() <= MAX_MARKERS {
                let points = series.points.iter();
                chart.draw_series(points.map(|&p| Circle::new(p, 4, colour.filled())))?;
            }
            let y = 72 + 24 * i as i32;
            let line = PathElement::new([(left, y), (left + 22, y)], colour.stroke_width(3));
            area.draw(&line)?;
            area.draw(&legend_label(&series.name, left, y))?;
        }
        Ok(())
    }

    /// From the smallest x to the largest, with a margin.
    fn x_range(&self) -> Range<f64> {
        let xs = || self.series.iter().flat_map(|s| &s.points).map(|p| p.0);
        let (min, max) = (xs().fold(f64::MAX, f64::min), xs().fold(0.0, f64::max));
        match min < max {
            true => min / 1.08..max * 1.08,
            false => 0.5 * max.max(1.0)..2.0 * max.max(1.0),
        }
    }
}

/// A name in the legend, to the right of its line, which begins at `left`.
fn legend_label(name: &str, left: i32, y: i32) -> Text<'static, (i32, i32), String> {
    let style = TextStyle::from((FONT, 14).into_font());
    let style = style.pos(Pos::new(HPos::Left, VPos::Center));
    Text::new(name.to_owned(), (left + 30, y), style)
}

/// A range that contains zero, `min_top` and `values`, and ends on multiples of 5.
pub(super) fn axis_range(values: impl Iterator<Item = f64>, min_top: f64) -> Range<f64> {
    let (low, high) = values.fold((0.0f64, min_top), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    let step = 5.0;
    (low / step).floor() * step..(high / step).ceil() * step
}

/// A number with up to three significant digits, without trailing zeros.
fn format_number(x: f64) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    let decimals = (2 - x.abs().log10().floor() as i32).clamp(0, 8) as usize;
    let text = format!("{x:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_significant_digits() {
        for (x, text) in [
            (0.0, "0"),
            (0.00122, "0.00122"),
            (0.5, "0.5"),
            (25.0, "25"),
            (320.0, "320"),
            (-5.0, "-5"),
        ] {
            assert_eq!(format_number(x), text);
        }
    }

    #[test]
    fn a_chart_has_labels_and_markers() {
        let chart = LineChart {
            title: "Title",
            x_label: "across",
            y_label: "up (dB)",
            x_ticks: vec![1.0, 10.0],
            top: Some(("twice", 2.0)),
            y: axis_range([-3.0, 31.0].into_iter(), 25.0),
            reference: Some((25.0, "25 dB")),
            series: vec![ChartSeries {
                name: "nnls".to_owned(),
                points: vec![(1.0, -3.0), (10.0, 31.0)],
            }],
        };
        assert_eq!(chart.y, -5.0..35.0);
        let svg = chart.svg().unwrap();
        for word in [
            "Title", "across", "up (dB)", "twice", "25 dB", "nnls", "<circle",
        ] {
            assert!(svg.contains(word), "no {word:?}");
        }
    }
}
