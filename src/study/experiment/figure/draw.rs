//! Draws figures with `plotters`.

use std::fmt::Display;

use plotters::coord::types::RangedCoordf64;
use plotters::element::DashedPathElement;
use plotters::prelude::*;

use super::{Axis, Figure, Mark, Series, Style};
use crate::record::COLOURS;

/// Width and height of a figure with a numeric vertical axis, in pixels.
const SIZE: (u32, u32) = (720, 460);
/// Height of a category's row, and total height of everything above and below the rows, in pixels.
const ROW: (u32, u32) = (19, 120);
/// Width of the tick labels of a numeric vertical axis, in pixels.
const TICKS: u32 = 64;

type Chart<'c, 's> = ChartContext<'c, SVGBackend<'s>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

fn text(error: impl Display) -> String {
    error.to_string()
}

fn font(size: i32) -> FontDesc<'static> {
    ("sans-serif", size).into_font()
}

/// Size and axis ranges of a figure, computed from its data.
struct Layout {
    left: f64,
    right: f64,
    bottom: f64,
    top: f64,
    /// Height of the figure, in pixels.
    height: u32,
    /// Width of the tick labels of the vertical axis, in pixels.
    beside: u32,
}

impl Figure {
    /// Draws the figure into an SVG document.
    pub(super) fn draw(&self, svg: &mut String) -> Result<(), String> {
        let layout = self.layout();
        let area = SVGBackend::with_string(svg, (SIZE.0, layout.height)).into_drawing_area();
        area.fill(&WHITE).map_err(text)?;
        let mut chart = ChartBuilder::on(&area)
            .caption(&self.title, font(17))
            .margin(14)
            .margin_right(26)
            .x_label_area_size(48)
            .y_label_area_size(layout.beside)
            .build_cartesian_2d(layout.left..layout.right, layout.bottom..layout.top)
            .map_err(text)?;
        self.draw_axes(&mut chart, &layout)?;
        for (index, series) in self.series.iter().enumerate() {
            let colour = COLOURS[series.colour.unwrap_or(index) % COLOURS.len()];
            match series.style {
                Style::Dashed => draw_dashes(&mut chart, series, (6, 4), colour)?,
                Style::Dotted => draw_dashes(&mut chart, series, (2, 4), colour)?,
                _ => self.draw_points(&mut chart, &layout, series, colour)?,
            }
        }
        if self.has_legend() {
            chart
                .configure_series_labels()
                .position(self.legend(&layout))
                .margin(12)
                .background_style(WHITE.mix(0.85))
                .border_style(BLACK.mix(0.25))
                .label_font(font(13))
                .draw()
                .map_err(text)?;
        }
        area.present().map_err(text)
    }

    fn has_legend(&self) -> bool {
        self.series.iter().any(|series| !series.name.is_empty())
    }

    /// Whether the vertical axis has categories instead of numbers.
    fn has_categories(&self) -> bool {
        !self.y.names.is_empty()
    }

    fn layout(&self) -> Layout {
        let with_bar = |number: f64, bar: Option<[f64; 2]>| {
            let [low, high] = bar.unwrap_or([number; 2]);
            vec![number, low, high]
        };
        let across = |m: &Mark| with_bar(m.x, m.bar.filter(|_| self.has_categories()));
        let [left, right] = self.range(&self.x, across);
        let [mut bottom, top] = self.range(&self.y, |m| with_bar(m.y, m.bar));
        // The legend is below the categories.
        if self.has_categories() && self.has_legend() {
            bottom -= self.series.len() as f64 + 0.8;
        }
        let longest = self.y.names.iter().map(|name| name.chars().count()).max();
        let (height, beside) = match longest {
            Some(longest) => {
                (((top - bottom) * f64::from(ROW.0)) as u32 + ROW.1, 7 * longest as u32 + 12)
            }
            None => (SIZE.1, TICKS),
        };
        Layout { left, right, bottom, top, height, beside }
    }

    /// Returns the ends of an axis, with some room around the data.
    fn range(&self, axis: &Axis, of: impl Fn(&Mark) -> Vec<f64>) -> [f64; 2] {
        if let Some(range) = axis.range {
            return range;
        }
        let all = self.series.iter().flat_map(|s| &s.marks).flat_map(of);
        let (low, high) = all
            .filter(|v| v.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        if low > high {
            return [0.0, 1.0];
        }
        let room = 0.06 * (high - low).max(1e-9 + 1e-3 * high.abs());
        [low - room, high + room]
    }

    fn draw_axes(&self, chart: &mut Chart<'_, '_>, layout: &Layout) -> Result<(), String> {
        let names = &self.y.names;
        let rows = if names.is_empty() { 10 } else { 2 * (layout.top - layout.bottom) as usize };
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(BLACK.mix(0.12))
            .x_desc(&self.x.label)
            .y_desc(&self.y.label)
            .axis_desc_style(font(15))
            .label_style(font(13))
            .y_labels(rows)
            .x_label_formatter(&|x| self.x.tick(*x))
            .y_label_formatter(&|y| match (names.is_empty(), y.round()) {
                (true, _) => self.y.tick(*y),
                (false, at) if (at - y).abs() > 0.01 || at < 0.0 => String::new(),
                (false, at) => names.get(at as usize).cloned().unwrap_or_default(),
            })
            .draw()
            .map_err(text)
    }

    /// Draws points with their error bars, and the line that joins them if the style has one.
    fn draw_points(
        &self,
        chart: &mut Chart<'_, '_>,
        layout: &Layout,
        series: &Series,
        colour: RGBColor,
    ) -> Result<(), String> {
        let points = series.points();
        if series.style != Style::Points {
            let line = LineSeries::new(points.clone(), colour.stroke_width(2));
            chart.draw_series(line).map_err(text)?;
        }
        let bar = |m: &Mark| {
            let ends = if self.has_categories() {
                m.bar?.map(|v| (v.clamp(layout.left, layout.right), m.y))
            } else {
                m.bar?.map(|v| (m.x, v.clamp(layout.bottom, layout.top)))
            };
            Some(PathElement::new(ends, colour.stroke_width(1)))
        };
        chart.draw_series(series.marks.iter().filter_map(bar)).map_err(text)?;
        let ring = series.style == Style::Rings;
        let inside = if ring { WHITE.filled() } else { colour.filled() };
        chart
            .draw_series(points.iter().map(|p| Circle::new(*p, 3, inside)))
            .map_err(text)?
            .label(series.label())
            .legend(move |(x, y)| {
                let style = if ring { colour.stroke_width(2) } else { colour.filled() };
                Circle::new((x + 9, y), 4, style)
            });
        if ring {
            let outline = points.iter().map(|p| Circle::new(*p, 3, colour.stroke_width(1)));
            chart.draw_series(outline).map_err(text)?;
        }
        Ok(())
    }

    /// Returns the position of the legend: below categories, otherwise in the corner where it hides the least data.
    fn legend(&self, layout: &Layout) -> SeriesLabelPosition {
        if self.has_categories() {
            return SeriesLabelPosition::LowerRight;
        }
        let corners = [
            ([1.0, 1.0], SeriesLabelPosition::UpperRight),
            ([0.0, 0.0], SeriesLabelPosition::LowerLeft),
            ([1.0, 0.0], SeriesLabelPosition::LowerRight),
            ([0.0, 1.0], SeriesLabelPosition::UpperLeft),
        ];
        let corner = corners.into_iter().min_by_key(|(corner, _)| self.hidden(layout, *corner));
        corner.map_or(SeriesLabelPosition::UpperRight, |(_, position)| position)
    }

    /// Counts the points, and points on lines, that a legend in a corner would hide.
    fn hidden(&self, layout: &Layout, [x_side, y_side]: [f64; 2]) -> usize {
        let letters = self.series.iter().map(|s| s.name.chars().count()).max().unwrap_or(0);
        let box_px = [7.5 * letters as f64 + 60.0, 19.0 * self.series.len() as f64 + 20.0];
        let (width, height) = (SIZE.0 - 40 - layout.beside, layout.height - 14 - 14 - 48 - 25);
        let [wide, high] = [box_px[0] / f64::from(width), box_px[1] / f64::from(height)];
        let hidden = |&(x, y): &(f64, f64)| {
            let x = (x - layout.left) / (layout.right - layout.left);
            let y = (y - layout.bottom) / (layout.top - layout.bottom);
            (x - x_side).abs() < wide && (y - y_side).abs() < high
        };
        self.series.iter().map(|series| series.ink().iter().filter(|p| hidden(p)).count()).sum()
    }
}

impl Series {
    fn points(&self) -> Vec<(f64, f64)> {
        self.marks.iter().map(|m| (m.x, m.y)).filter(|p| p.1.is_finite()).collect()
    }

    /// Returns the name for the legend. `plotters` measures the legend's box for lower-case letters, so names with
    /// capitals are padded.
    fn label(&self) -> String {
        let capitals = self.name.chars().filter(|c| c.is_uppercase()).count();
        format!("{}{}", self.name, "\u{a0}".repeat(capitals / 4))
    }

    /// Returns the points, the ends of their vertical error bars, and nine points on each line between neighbours.
    fn ink(&self) -> Vec<(f64, f64)> {
        let ends = |m: &Mark| {
            let [low, high] = m.bar.unwrap_or([m.y; 2]);
            [(m.x, m.y), (m.x, low), (m.x, high)]
        };
        let mut ink: Vec<(f64, f64)> = self.marks.iter().flat_map(ends).collect();
        if self.style == Style::Points {
            return ink;
        }
        for pair in self.marks.windows(2) {
            let part = |a: f64, b: f64, tenths: f64| a + (b - a) * tenths / 10.0;
            let on_line = |i| {
                let tenths = f64::from(i);
                (part(pair[0].x, pair[1].x, tenths), part(pair[0].y, pair[1].y, tenths))
            };
            ink.extend((1..10).map(on_line));
        }
        ink
    }
}

/// Draws a dashed line without points. Lengths of dash and gap are in pixels.
fn draw_dashes(
    chart: &mut Chart<'_, '_>,
    series: &Series,
    (dash, gap): (i32, i32),
    colour: RGBColor,
) -> Result<(), String> {
    let style = colour.stroke_width(2);
    chart
        .draw_series(DashedLineSeries::new(series.points(), dash, gap, style))
        .map_err(text)?
        .label(series.label())
        .legend(move |(x, y)| DashedPathElement::new([(x, y), (x + 19, y)], dash, gap, style));
    Ok(())
}
