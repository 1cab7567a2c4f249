//! The accuracy of one acquisition method by the number of photographs.

use super::accuracy::AccuracyPoint;
use super::chart::ChartSeries;

/// The points of one method, by ascending number of photographs.
pub(super) struct MethodCurve {
    pub name: String,
    pub points: Vec<AccuracyPoint>,
}

impl MethodCurve {
    /// The accuracy with this number of photographs.
    pub fn at(&self, photographs: usize) -> Option<&AccuracyPoint> {
        let mut points = self.points.iter();
        points.find(|point| point.photographs == photographs)
    }

    /// The line of the curve in a chart of SNR by `x(photographs)`.
    pub fn series(&self, has_markers: bool, x: impl Fn(usize) -> f64) -> ChartSeries {
        let points = self.points.iter();
        ChartSeries {
            name: self.name.clone(),
            points: points
                .filter_map(|p| Some((x(p.photographs), p.snr?.0)))
                .collect(),
            has_markers,
        }
    }
}
