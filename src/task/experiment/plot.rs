//! Figures as SVG: lines or points with error bars over labelled axes.

use plotters::prelude::*;

use crate::task::error::TaskError;

/// An axis of a figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// What stands along it, with its unit.
    pub label: String,
    /// From where to where; from the data if not given.
    pub range: Option<[f64; 2]>,
    /// What stands at 0, 1, 2 and so on from the bottom, on a vertical axis of things instead of numbers.
    pub names: Vec<String>,
}

impl Axis {
    /// An axis as long as the data.
    pub fn new(label: &str) -> Self {
        Self { label: label.into(), range: None, names: Vec::new() }
    }

    /// An axis from `low` to `high`.
    pub fn from_to(label: &str, low: f64, high: f64) -> Self {
        Self { label: label.into(), range: Some([low, high]), names: Vec::new() }
    }

    /// A vertical axis of named things, from the bottom.
    pub fn named(names: Vec<String>) -> Self {
        let range = Some([-0.5, names.len() as f64 - 0.5]);
        Self { label: String::new(), range, names }
    }
}

/// A point with the interval of its number: of its height, or along the x axis where the vertical one has names.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mark {
    /// Place along the x axis.
    pub x: f64,
    /// Place along the y axis.
    pub y: f64,
    /// Ends of the error bar.
    pub bar: Option<[f64; 2]>,
}

/// Points that belong together.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// Its points.
    pub marks: Vec<Mark>,
    /// Whether a line joins them.
    pub joined: bool,
    /// Whether it is drawn dashed and without points, as a prediction.
    pub dashed: bool,
}

/// A picture of results.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// What it shows.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// What is drawn.
    pub series: Vec<Series>,
}

/// Colours that the colour-blind can tell apart (Okabe and Ito 2008).
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(60, 60, 60),
];
const SIZE: (u32, u32) = (720, 460);
/// Height of the row of a named thing, and of what stands above and below all of them.
const ROW: (u32, u32) = (19, 120);

/// A number beside an axis.
fn number(value: f64) -> String {
    let rounded = (value * 1e6).round() / 1e6;
    if rounded == 0.0 { "0".into() } else { rounded.to_string() }
}

impl Figure {
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

    /// The figure as an SVG document.
    ///
    /// # Errors
    /// [`TaskError::Figure`] if it cannot be drawn.
    pub fn to_svg(&self) -> Result<String, TaskError> {
        let mut svg = String::new();
        self.draw(&mut svg).map_err(|reason| TaskError::Figure { reason })?;
        Ok(svg)
    }

    fn draw(&self, svg: &mut String) -> Result<(), String> {
        let names = &self.y.names;
        let along = |number: f64, bar: Option<[f64; 2]>| {
            let [low, high] = bar.unwrap_or([number; 2]);
            vec![number, low, high]
        };
        let barred = |m: &Mark| along(m.x, m.bar.filter(|_| !names.is_empty()));
        let [left, right] = self.range(&self.x, barred);
        let [mut bottom, top] = self.range(&self.y, |m| along(m.y, m.bar));
        // Below named things there is room for the legend.
        let unnamed = self.series.iter().all(|s| s.name.is_empty());
        if !names.is_empty() && !unnamed {
            bottom -= self.series.len() as f64 + 0.8;
        }
        let said = |error: &dyn std::fmt::Display| error.to_string();
        let longest = names.iter().map(|name| name.chars().count()).max();
        let (height, beside) = match longest {
            Some(longest) => {
                (((top - bottom) * f64::from(ROW.0)) as u32 + ROW.1, 7 * longest as u32 + 12)
            }
            None => (SIZE.1, 64),
        };
        let area = SVGBackend::with_string(svg, (SIZE.0, height)).into_drawing_area();
        area.fill(&WHITE).map_err(|e| said(&e))?;
        let font = |size: i32| ("sans-serif", size).into_font();
        let mut chart = ChartBuilder::on(&area)
            .caption(&self.title, font(17))
            .margin(14)
            .margin_right(26)
            .x_label_area_size(48)
            .y_label_area_size(beside)
            .build_cartesian_2d(left..right, bottom..top)
            .map_err(|e| said(&e))?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(BLACK.mix(0.12))
            .x_desc(&self.x.label)
            .y_desc(&self.y.label)
            .axis_desc_style(font(15))
            .label_style(font(13))
            .y_labels(if names.is_empty() { 10 } else { 2 * (top - bottom) as usize })
            .y_label_formatter(&|y| match (names.is_empty(), y.round()) {
                (true, _) => number(*y),
                (false, at) if (at - y).abs() > 0.01 || at < 0.0 => String::new(),
                (false, at) => names.get(at as usize).cloned().unwrap_or_default(),
            })
            .draw()
            .map_err(|e| said(&e))?;
        for (index, series) in self.series.iter().enumerate() {
            let colour = COLOURS[index % COLOURS.len()];
            let points: Vec<(f64, f64)> =
                series.marks.iter().map(|m| (m.x, m.y)).filter(|p| p.1.is_finite()).collect();
            let style = colour.stroke_width(2);
            if series.dashed {
                chart
                    .draw_series(DashedLineSeries::new(points.clone(), 6, 4, style))
                    .map_err(|e| said(&e))?
                    .label(&series.name)
                    .legend(move |(x, y)| {
                        plotters::element::DashedPathElement::new(
                            [(x, y), (x + 19, y)],
                            5,
                            3,
                            style,
                        )
                    });
                continue;
            }
            if series.joined {
                chart.draw_series(LineSeries::new(points.clone(), style)).map_err(|e| said(&e))?;
            }
            chart
                .draw_series(series.marks.iter().filter_map(|m| {
                    let ends = if names.is_empty() {
                        m.bar?.map(|v| (m.x, v.clamp(bottom, top)))
                    } else {
                        m.bar?.map(|v| (v.clamp(left, right), m.y))
                    };
                    Some(PathElement::new(ends, colour.stroke_width(1)))
                }))
                .map_err(|e| said(&e))?;
            chart
                .draw_series(points.iter().map(|p| Circle::new(*p, 3, colour.filled())))
                .map_err(|e| said(&e))?
                .label(&series.name)
                .legend(move |(x, y)| Circle::new((x + 9, y), 4, colour.filled()));
        }
        if unnamed {
            return area.present().map_err(|e| said(&e));
        }
        // The corner with the fewest points.
        let crowd = |x_side: f64, y_side: f64| -> usize {
            let near = |m: &&Mark| {
                let (x, y) = ((m.x - left) / (right - left), (m.y - bottom) / (top - bottom));
                (x - x_side).abs() < 0.4 && (y - y_side).abs() < 0.5
            };
            self.series.iter().flat_map(|s| &s.marks).filter(near).count()
        };
        let corners = [
            (crowd(1.0, 1.0), SeriesLabelPosition::UpperRight),
            (crowd(0.0, 0.0), SeriesLabelPosition::LowerLeft),
            (crowd(1.0, 0.0), SeriesLabelPosition::LowerRight),
            (crowd(0.0, 1.0), SeriesLabelPosition::UpperLeft),
        ];
        let corner = match names.is_empty() {
            true => corners.into_iter().min_by_key(|c| c.0).map(|c| c.1),
            false => Some(SeriesLabelPosition::LowerRight),
        };
        chart
            .configure_series_labels()
            .position(corner.unwrap_or(SeriesLabelPosition::UpperRight))
            .background_style(WHITE.mix(0.85))
            .border_style(BLACK.mix(0.25))
            .label_font(font(13))
            .draw()
            .map_err(|e| said(&e))?;
        area.present().map_err(|e| said(&e))
    }
}
