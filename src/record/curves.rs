//! Curves over any number as a chart, such as tuning curves.

use ndarray::{ArrayView1, ArrayView2};
use plotters::prelude::*;

use super::COLOURS;
use super::series::chart;

/// A chart of curves, with its title and the names of its axes.
///
/// ```
/// use ndarray::array;
/// use symbolt::record::Curves;
/// let curves = Curves { title: "Two curves", x: "value", y: "rate (Hz)" };
/// let svg = curves.to_svg(array![0.0, 1.0].view(), array![[0.0, 2.0], [1.0, 0.0]].view());
/// assert!(svg.starts_with("<svg") && svg.contains("rate (Hz)"));
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Curves<'a> {
    /// Title.
    pub title: &'a str,
    /// Name of the axis to the right.
    pub x: &'a str,
    /// Name of the axis upward.
    pub y: &'a str,
}

impl Curves<'_> {
    /// Draws one curve for each column of `curves`, whose rows belong to the numbers `at`. As SVG; empty if it cannot
    /// be drawn, such as without numbers.
    pub fn to_svg(&self, at: ArrayView1<'_, f64>, curves: ArrayView2<'_, f64>) -> String {
        let range = |values: &mut dyn Iterator<Item = f64>| {
            let all = values.filter(|value| value.is_finite());
            let ends = all.fold(None, |ends: Option<(f64, f64)>, value| {
                Some(ends.map_or((value, value), |(low, high)| (low.min(value), high.max(value))))
            });
            ends.map(|(low, high)| low..high.max(low + 1e-9))
        };
        let (across, up) = (range(&mut at.iter().copied()), range(&mut curves.iter().copied()));
        let (Some(across), Some(up)) = (across, up) else { return String::new() };
        chart(self.title, (self.x, across), (self.y, up), |chart| {
            for (index, column) in curves.columns().into_iter().enumerate() {
                let points = at.iter().copied().zip(column.iter().copied());
                let colour = COLOURS[index % COLOURS.len()].stroke_width(1);
                chart.draw_series(LineSeries::new(points, colour))?;
            }
            Ok(())
        })
    }
}
