//! Recorded numbers over simulated time as a table, CSV or a chart.

use std::borrow::Cow;
use std::fmt::{self, Write as _};
use std::ops::Range;

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use crate::sim::{Kind, Real, Samples, Spikes};

/// Columns of numbers over simulated time, such as similarities
/// ([`Vocabulary::similarities`](crate::spa::Vocabulary::similarities)) or the components of an output
/// ([`Samples::series`]).
///
/// It displays as a table of at most 20 rows.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeSeries {
    columns: Vec<String>,
    times_s: Vec<f64>,
    /// Row-major, one row per sample.
    values: Vec<Real>,
    /// Name of the numbers, and the range that a chart covers at least.
    axis: (&'static str, [Real; 2]),
}

/// Greatest number of rows of the table, of points of a curve, and of neurons of a raster.
const ROWS: usize = 20;
const POINTS: usize = 2_000;
const NEURONS: usize = 100;

/// Colours that colour-blind readers can tell apart (Okabe and Ito 2008).
pub(crate) const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(60, 60, 60),
];

impl<K: Kind> Samples<'_, K> {
    /// Returns the samples as columns, one for each component. The names are those of the components in their order; a
    /// component beyond the last name is called by its index.
    ///
    /// ```
    /// # use symbolt::prelude::*;
    /// # use symbolt::sim::Signal;
    /// let mut graph = GraphBuilder::new();
    /// let lines = |t: f64, out: &mut [f32]| out.copy_from_slice(&[t as f32, 1.0 - t as f32]);
    /// let input = graph.add("input", Signal::vector(2, lines));
    /// let probe = graph.probe(&input, ProbeSpec::default());
    /// let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), SimDuration::from_millis(1000))?;
    /// let series = sim.samples(&probe).series(["rising", "falling"]);
    /// assert_eq!(series.best(0.2).map(|best| best.0), Some("falling"));
    /// assert_eq!(series.switches(0.0).len(), 2);
    /// assert!(series.to_svg("Two lines").starts_with("<svg"));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn series(&self, names: impl IntoIterator<Item = impl Into<String>>) -> TimeSeries {
        let names = names.into_iter().map(Into::into).map(Some).chain(std::iter::repeat(None));
        let named = (0..self.width()).zip(names);
        let columns = named.map(|(i, name)| name.unwrap_or_else(|| i.to_string())).collect();
        let mut series = TimeSeries::new(columns, ("value", [0.0, 1e-3]));
        for (time_s, row) in self.iter() {
            series.push(time_s, row.iter().copied());
        }
        series
    }
}

impl TimeSeries {
    /// Starts without samples. `axis` is the name of the numbers and the range that a chart covers at least.
    pub(crate) fn new(columns: Vec<String>, axis: (&'static str, [Real; 2])) -> Self {
        Self { columns, times_s: Vec::new(), values: Vec::new(), axis }
    }

    /// Adds a row, which has one number for each column.
    pub(crate) fn push(&mut self, time_s: f64, row: impl Iterator<Item = Real>) {
        self.times_s.push(time_s);
        self.values.extend(row.take(self.columns.len()));
    }

    /// Returns the names of the columns.
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    /// Returns the simulated time of each sample, in seconds.
    pub fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// Returns the numbers of one column, one for each sample; `None` if there is no such column.
    pub fn column(&self, name: &str) -> Option<impl Iterator<Item = Real> + '_> {
        let at = self.columns.iter().position(|own| own == name)?;
        Some(self.values.iter().skip(at).step_by(self.columns.len()).copied())
    }

    /// Returns the last number of one column; `None` without samples or such a column.
    pub fn last(&self, name: &str) -> Option<Real> {
        self.column(name)?.last()
    }

    /// Returns the column with the greatest number in the last sample until `time_s` (in seconds), with that number: the
    /// first of equals, and `None` if there is no such sample or column.
    ///
    /// ```
    /// # use symbolt::prelude::*;
    /// symbolt::vocabulary!(Parts = "parts": NUT, BOLT);
    ///
    /// let parts = Parts::vocabulary(64, Seed::new(1))?;
    /// let mut graph = GraphBuilder::new();
    /// let seen = graph.add("seen", parts.stimulus([(0, "NUT"), (100, "BOLT")])?);
    /// let probe = graph.probe(&seen, ProbeSpec::default());
    /// let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), SimDuration::from_millis(200))?;
    /// let seen = parts.similarities(sim.samples(&probe), Parts::NAMES)?;
    /// assert_eq!(seen.best(0.05).map(|best| best.0), Some("NUT"));
    /// assert_eq!(seen.best(0.2).map(|best| best.0), Some("BOLT"));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn best(&self, time_s: f64) -> Option<(&str, Real)> {
        // Sample times are sums of ticks.
        let until = self.times_s.partition_point(|time| *time <= time_s + 1e-9);
        let (_, row) = self.rows().nth(until.checked_sub(1)?)?;
        self.greatest(row)
    }

    /// Returns the first of the greatest numbers of a row with its column; `None` without a number.
    fn greatest(&self, row: &[Real]) -> Option<(&str, Real)> {
        let named = self.columns.iter().map(String::as_str).zip(row.iter().copied());
        named.rev().filter(|(_, value)| !value.is_nan()).max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Returns the times in seconds at which the column with the greatest number changes, with the new one. Samples in
    /// which no number reaches `least` change nothing.
    pub fn switches(&self, least: Real) -> Vec<(f64, &str)> {
        let mut switches: Vec<(f64, &str)> = Vec::new();
        for (time, row) in self.rows() {
            let Some((name, greatest)) = self.greatest(row) else { continue };
            if greatest >= least && switches.last().is_none_or(|(_, last)| *last != name) {
                switches.push((time, name));
            }
        }
        switches
    }

    /// Returns all numbers as CSV, with a header: the time in seconds, then the columns.
    pub fn to_csv(&self) -> String {
        let names: Vec<_> = self.columns.iter().map(|name| csv_field(name)).collect();
        let mut text = format!("time_s,{}\n", names.join(","));
        for (time, row) in self.rows() {
            let row: Vec<String> = row.iter().map(Real::to_string).collect();
            text += &format!("{time},{}\n", row.join(","));
        }
        text
    }

    /// Returns a chart over simulated time as SVG: one curve of at most 2,000 points for each column. Empty if it cannot
    /// be drawn.
    pub fn to_svg(&self, title: &str) -> String {
        let (label, [start, end]) = self.axis;
        let finite = || self.values.iter().copied().filter(|value| value.is_finite());
        let range = finite().fold(start, Real::min).into()..finite().fold(end, Real::max).into();
        let until_s = self.times_s.last().copied().unwrap_or(1.0);
        chart(title, time_axis(until_s), (label, range), |chart| {
            let step = self.times_s.len().div_ceil(POINTS).max(1);
            for (index, name) in self.columns.iter().enumerate() {
                let colour = COLOURS[index % COLOURS.len()];
                let points = self.rows().step_by(step);
                let points = points.map(|(time, row)| (time, f64::from(row[index])));
                let curve = chart.draw_series(LineSeries::new(points, colour.stroke_width(2)))?;
                curve.label(name.as_str()).legend(move |(x, y)| {
                    PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2))
                });
            }
            if self.columns.len() > 1 {
                let labels = &mut chart.configure_series_labels();
                labels.background_style(WHITE.mix(0.85)).border_style(BLACK.mix(0.25)).draw()?;
            }
            Ok(())
        })
    }

    /// Name of the numbers.
    pub(super) fn unit(&self) -> &'static str {
        self.axis.0
    }

    pub(super) fn rows(&self) -> impl Iterator<Item = (f64, &[Real])> {
        self.times_s.iter().copied().zip(self.values.chunks(self.columns.len().max(1)))
    }
}

type Chart<'svg> =
    ChartContext<'svg, SVGBackend<'svg>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
type Drawn<'svg> =
    Result<(), DrawingAreaErrorKind<<SVGBackend<'svg> as DrawingBackend>::ErrorType>>;

/// The axis of simulated time until `until_s`.
fn time_axis(until_s: f64) -> (&'static str, Range<f64>) {
    ("simulated time (s)", 0.0..until_s.max(1e-3))
}

/// Draws axes as SVG, each with a name and a range, to the right and upward; and what `draw` adds. Empty if it cannot be
/// drawn.
pub(super) fn chart(
    title: &str,
    across: (&str, Range<f64>),
    (label, range): (&str, Range<f64>),
    draw: impl for<'svg> FnOnce(&mut Chart<'svg>) -> Drawn<'svg>,
) -> String {
    fn on<'svg>(
        svg: &'svg mut String,
        title: &str,
        (across, span): (&str, Range<f64>),
        (label, range): (&str, Range<f64>),
        draw: impl FnOnce(&mut Chart<'svg>) -> Drawn<'svg>,
    ) -> Drawn<'svg> {
        let area = SVGBackend::with_string(svg, (720, 400)).into_drawing_area();
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&area)
            .caption(title, ("sans-serif", 17))
            .margin(14)
            .x_label_area_size(44)
            .y_label_area_size(56)
            .build_cartesian_2d(span, range)?;
        let number = |value: &f64| ((1e6 * value).round() / 1e6).to_string();
        let mesh = &mut chart.configure_mesh();
        mesh.x_label_formatter(&number).y_label_formatter(&number);
        mesh.x_desc(across).y_desc(label).light_line_style(TRANSPARENT).draw()?;
        draw(&mut chart)?;
        area.present()
    }
    let mut svg = String::new();
    match on(&mut svg, title, across, (label, range), draw) {
        Ok(()) => svg,
        Err(_) => String::new(),
    }
}

impl Spikes<'_> {
    /// Returns a raster as SVG: simulated time to the right until the last recorded tick, one row of marks for each
    /// neuron. Of a layer of more than 100 neurons it shows evenly spaced ones. Empty if it cannot be drawn.
    pub fn to_svg(&self, title: &str) -> String {
        let until_s = self.recording.ticks.last().map_or(1.0, |tick| *tick as f64 * self.dt_s);
        let step = self.neurons().div_ceil(NEURONS).max(1);
        let mut marks = String::new();
        let axes = chart(
            title,
            time_axis(until_s),
            ("neuron", 0.0..self.neurons().max(1) as f64),
            |chart| {
                let (across, down) = chart.plotting_area().get_pixel_range();
                let (width, rows) = (across.len(), self.neurons().div_ceil(step));
                let mut drawn = vec![false; width * rows];
                for (time, neuron) in self.iter().filter(|(_, neuron)| neuron.is_multiple_of(step))
                {
                    let (x, row) = (time / until_s * width as f64, neuron / step);
                    let x = (x as usize).min(width.saturating_sub(1));
                    // One mark per pixel, so that long runs do not make long files.
                    if !std::mem::replace(&mut drawn[row * width + x], true) {
                        let height = down.len() as f64 / rows as f64;
                        let (x, y) = (across.start as f64 + x as f64, height * (row + 1) as f64);
                        let y = f64::from(down.end) - y;
                        let _ = write!(marks, "M{x:.0}.5 {y:.1}v{:.1}", 0.8 * height);
                    }
                }
                Ok(())
            },
        );
        // As one path: an element for each mark would be ten times as long.
        let path = format!("<path d=\"{marks}\" stroke=\"#0072b2\"/>\n</svg>");
        axes.replace("</svg>", &path)
    }
}

impl fmt::Display for TimeSeries {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let widths: Vec<usize> = self.columns.iter().map(|c| c.chars().count().max(5)).collect();
        write!(f, "{:>9}", "time (ms)")?;
        for (name, width) in self.columns.iter().zip(&widths) {
            write!(f, "  {name:>width$}")?;
        }
        let step = self.times_s.len().div_ceil(ROWS).max(1);
        // The last sample is always shown.
        let first = self.times_s.len().saturating_sub(1) % step;
        for (time, row) in self.rows().skip(first).step_by(step) {
            write!(f, "\n{:>9.1}", 1e3 * time)?;
            for (value, width) in row.iter().zip(&widths) {
                write!(f, "  {value:>width$.2}")?;
            }
        }
        Ok(())
    }
}

/// Returns a field of a table in CSV: in quotes if it needs them (RFC 4180).
pub(crate) fn csv_field(text: &str) -> Cow<'_, str> {
    match text.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")).into(),
        false => text.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_has_at_most_twenty_rows_and_the_last_sample() {
        let similarities = TimeSeries {
            columns: vec!["NUT".into(), "LONG_NAME".into()],
            times_s: (1..=45).map(|i| f64::from(i) / 1e3).collect(),
            values: (0..90).map(|i| i as Real / 90.0).collect(),
            axis: ("similarity", [-0.2, 1.05]),
        };
        let text = similarities.to_string();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 1 + 15);
        assert_eq!(lines[0], "time (ms)    NUT  LONG_NAME");
        assert_eq!(lines[15], "     45.0   0.98       0.99");
        assert_eq!(similarities.to_csv().lines().count(), 46);
        assert_eq!(similarities.column("LONG_NAME").map(Iterator::count), Some(45));
        assert!(similarities.last("BOLT").is_none());
        let svg = similarities.to_svg("A <title>");
        assert_eq!(svg.matches("stroke-width=\"2\"").count(), 2 + 2, "curves and their legend");
        assert!(svg.contains("A &lt;title&gt;"));
        let rows = TimeSeries {
            columns: vec!["NUT".into(), "BOLT".into()],
            times_s: vec![0.1, 0.2, 0.3],
            values: vec![0.0, 0.0, Real::NAN, 2.0, 0.4, 0.4],
            axis: ("similarity", [-0.2, 1.05]),
        };
        let best = [0.05, 0.1, 0.25, 9.0].map(|time| rows.best(time));
        assert_eq!(best, [None, Some(("NUT", 0.0)), Some(("BOLT", 2.0)), Some(("NUT", 0.4))]);
        assert_eq!(rows.switches(0.4), [(0.2, "BOLT"), (0.3, "NUT")]);
        assert!(rows.to_svg("Above 1").starts_with("<svg"));
        let empty = TimeSeries::new(vec![], ("value", [0.0, 1.0]));
        assert!(empty.to_svg("Empty").starts_with("<svg") && empty.to_string() == "time (ms)");
    }
}
