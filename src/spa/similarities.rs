//! The similarities of a recorded output with the names of a vocabulary, as a table, CSV or a chart.

use std::fmt;
use std::ops::Range;

use plotters::prelude::*;

use super::vocabulary::Vocabulary;
use crate::sim::{Pointer, Real, Samples, VocabTag};
use crate::spa::algebra::dot;
use crate::spa::error::VocabError;

/// Similarities over simulated time. [`Vocabulary::similarities`] computes them.
///
/// It displays as a table of at most 20 rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Similarities {
    columns: Vec<String>,
    times_s: Vec<f64>,
    /// Row-major, one row per sample, one column per expression.
    values: Vec<Real>,
}

/// Greatest number of rows of the table, and of points of a curve.
const ROWS: usize = 20;
const POINTS: usize = 2_000;

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

impl<V: VocabTag> Vocabulary<V> {
    /// Returns the similarity (dot product) of every sample with every expression, such as `NUT` or `JIG * NUT`. Costs
    /// O(samples x expressions x D).
    ///
    /// ```
    /// # use symbolt::prelude::*;
    /// symbolt::vocabulary!(Parts = "parts": NUT, BOLT);
    ///
    /// let parts = Parts::vocabulary(64, Seed::new(1))?;
    /// let mut graph = GraphBuilder::new();
    /// let seen = graph.add("seen", State::new(&parts));
    /// graph.route(Parts::NUT >> &seen);
    /// let probe = graph.probe(&seen.output, ProbeSpec::default());
    /// let mut sim = graph.start(&PopulationPlan::direct(), Seed::new(1))?;
    /// sim.run_for(SimDuration::from_millis(100))?;
    ///
    /// let seen = parts.similarities(sim.samples(&probe), ["NUT", "BOLT"])?;
    /// println!("{seen}");
    /// assert!(seen.last("NUT").is_some_and(|similarity| similarity > 0.99));
    /// assert!(seen.to_svg("What is seen").starts_with("<svg"));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As for [`Vocabulary::parse`].
    pub fn similarities<'e>(
        &self,
        samples: Samples<'_, Pointer<V>>,
        expressions: impl IntoIterator<Item = &'e str>,
    ) -> Result<Similarities, VocabError> {
        let columns: Vec<String> = expressions.into_iter().map(String::from).collect();
        let pointers = columns.iter().map(|text| self.parse(text));
        let pointers = pointers.collect::<Result<Vec<_>, _>>()?;
        let (mut times_s, mut values) = (Vec::new(), Vec::new());
        for (time, sample) in samples.iter() {
            times_s.push(time);
            values.extend(pointers.iter().map(|pointer| dot(&sample, pointer)));
        }
        Ok(Similarities { columns, times_s, values })
    }
}

impl Similarities {
    /// Returns the expressions, one for each column.
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    /// Returns the simulated time of each sample, in seconds.
    pub fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// Returns the similarities with one expression, one for each sample; `None` if there is no such column.
    pub fn column(&self, expression: &str) -> Option<impl Iterator<Item = Real> + '_> {
        let at = self.columns.iter().position(|own| own == expression)?;
        Some(self.values.iter().skip(at).step_by(self.columns.len()).copied())
    }

    /// Returns the similarity of the last sample with one expression; `None` without samples or such a column.
    pub fn last(&self, expression: &str) -> Option<Real> {
        self.column(expression)?.last()
    }

    /// Returns the expression that the last sample until `time_s` (in seconds) resembles most, with its similarity: the
    /// first of equals, and `None` if there is no such sample or no expression.
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

    /// Returns the first of the greatest similarities; `None` without a number.
    fn greatest(&self, row: &[Real]) -> Option<(&str, Real)> {
        let named = self.columns.iter().map(String::as_str).zip(row.iter().copied());
        named.rev().filter(|(_, value)| !value.is_nan()).max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Returns the times in seconds at which the expression of greatest similarity changes, with the new one. Samples in
    /// which no similarity reaches `least` change nothing.
    pub fn switches(&self, least: Real) -> Vec<(f64, &str)> {
        let mut switches: Vec<(f64, &str)> = Vec::new();
        for (time, row) in self.rows() {
            let Some((name, similarity)) = self.greatest(row) else { continue };
            if similarity >= least && switches.last().is_none_or(|(_, last)| *last != name) {
                switches.push((time, name));
            }
        }
        switches
    }

    /// Returns all numbers as CSV, with a header: the time in seconds, then one column for each expression.
    pub fn to_csv(&self) -> String {
        let mut text = format!("time_s,{}\n", self.columns.join(","));
        for (time, row) in self.rows() {
            let row: Vec<String> = row.iter().map(Real::to_string).collect();
            text += &format!("{time},{}\n", row.join(","));
        }
        text
    }

    /// Returns a chart of the similarities over simulated time as SVG: one curve for each expression, of at most 2,000
    /// points. Empty if it cannot be drawn.
    pub fn to_svg(&self, title: &str) -> String {
        self.chart(title, "similarity", -0.2..1.05)
    }

    /// Makes curves of other numbers, row-major, for a [chart](Self::chart).
    pub(super) fn of_values(columns: Vec<String>, times_s: Vec<f64>, values: Vec<Real>) -> Self {
        Self { columns, times_s, values }
    }

    /// Returns a chart as SVG with a vertical axis called `axis`, which covers at least `range`.
    pub(super) fn chart(&self, title: &str, axis: &str, range: Range<Real>) -> String {
        let mut svg = String::new();
        match self.draw(title, (axis, range), &mut svg) {
            Ok(()) => svg,
            Err(_) => String::new(),
        }
    }

    fn rows(&self) -> impl Iterator<Item = (f64, &[Real])> {
        self.times_s.iter().copied().zip(self.values.chunks(self.columns.len().max(1)))
    }

    fn draw(
        &self,
        title: &str,
        (axis, range): (&str, Range<Real>),
        svg: &mut String,
    ) -> Result<(), DrawingAreaErrorKind<<SVGBackend<'_> as DrawingBackend>::ErrorType>> {
        let area = SVGBackend::with_string(svg, (720, 400)).into_drawing_area();
        area.fill(&WHITE)?;
        let end = self.times_s.last().map_or(1.0, |end| end.max(1e-3));
        let finite = || self.values.iter().copied().filter(|value| value.is_finite());
        let (least, most) =
            (finite().fold(range.start, Real::min), finite().fold(range.end, Real::max));
        let mut chart = ChartBuilder::on(&area)
            .caption(title, ("sans-serif", 17))
            .margin(14)
            .x_label_area_size(44)
            .y_label_area_size(56)
            .build_cartesian_2d(0.0..end, f64::from(least)..f64::from(most))?;
        let mesh = &mut chart.configure_mesh();
        mesh.x_desc("simulated time (s)").y_desc(axis).light_line_style(TRANSPARENT).draw()?;
        let step = self.times_s.len().div_ceil(POINTS).max(1);
        for (index, name) in self.columns.iter().enumerate() {
            let colour = COLOURS[index % COLOURS.len()];
            let points = self.rows().step_by(step).map(|(time, row)| (time, f64::from(row[index])));
            let curve = chart.draw_series(LineSeries::new(points, colour.stroke_width(2)))?;
            curve.label(name.as_str()).legend(move |(x, y)| {
                PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2))
            });
        }
        if !self.columns.is_empty() {
            let labels = &mut chart.configure_series_labels();
            labels.background_style(WHITE.mix(0.85)).border_style(BLACK.mix(0.25)).draw()?;
        }
        area.present()
    }
}

impl fmt::Display for Similarities {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_has_at_most_twenty_rows_and_the_last_sample() {
        let similarities = Similarities {
            columns: vec!["NUT".into(), "LONG_NAME".into()],
            times_s: (1..=45).map(|i| f64::from(i) / 1e3).collect(),
            values: (0..90).map(|i| i as Real / 90.0).collect(),
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
        let rows = Similarities {
            columns: vec!["NUT".into(), "BOLT".into()],
            times_s: vec![0.1, 0.2, 0.3],
            values: vec![0.0, 0.0, Real::NAN, 2.0, 0.4, 0.4],
        };
        let best = [0.05, 0.1, 0.25, 9.0].map(|time| rows.best(time));
        assert_eq!(best, [None, Some(("NUT", 0.0)), Some(("BOLT", 2.0)), Some(("NUT", 0.4))]);
        assert_eq!(rows.switches(0.4), [(0.2, "BOLT"), (0.3, "NUT")]);
        assert!(rows.to_svg("Above 1").starts_with("<svg"));
        let empty = Similarities { columns: vec![], times_s: vec![], values: vec![] };
        assert!(empty.to_svg("Empty").starts_with("<svg") && empty.to_string() == "time (ms)");
    }
}
