//! Figures as SVG: lines or points with error bars over labelled axes.

use plotters::prelude::*;

use crate::task::TaskError;

/// An axis of a figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// What stands along it, with its unit.
    pub label: String,
    /// From where to where; from the data if not given.
    pub range: Option<[f64; 2]>,
    /// What stands at 0, 1, 2 and so on from the bottom, on a vertical axis of things instead of numbers.
    pub names: Vec<String>,
    /// The base whose powers stand along it, where its numbers are logarithms.
    pub base: Option<f64>,
}

impl Axis {
    /// An axis as long as the data.
    pub fn new(label: &str) -> Self {
        Self { label: label.into(), range: None, names: Vec::new(), base: None }
    }

    /// An axis from `low` to `high`.
    pub fn from_to(label: &str, low: f64, high: f64) -> Self {
        Self { label: label.into(), range: Some([low, high]), names: Vec::new(), base: None }
    }

    /// An axis of logarithms, labelled with the powers of `base` that they stand for.
    pub fn logarithmic(label: &str, base: f64) -> Self {
        Self { base: Some(base), ..Self::new(label) }
    }

    /// What stands beside a tick.
    fn tick(&self, value: f64) -> String {
        match self.base {
            None => number(value),
            Some(base) if (value - value.round()).abs() < 0.01 => number(base.powf(value.round())),
            Some(_) => String::new(),
        }
    }

    /// A vertical axis of named things, from the bottom.
    pub fn named(names: Vec<String>) -> Self {
        let range = Some([-0.5, names.len() as f64 - 0.5]);
        Self { label: String::new(), range, names, base: None }
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

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// Points alone.
    Points,
    /// Points that a line joins.
    Line,
    /// Rings that a line joins.
    Rings,
    /// A dashed line without points, as for a prediction.
    Dashed,
    /// A dotted line without points.
    Dotted,
}

/// Points that belong together.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// Its points.
    pub marks: Vec<Mark>,
    /// How it is drawn.
    pub style: Style,
    /// Which colour it has; that of its place among the series if not given.
    pub colour: Option<usize>,
}

impl Series {
    /// A series in the colour of its place.
    pub fn new(name: impl Into<String>, marks: Vec<Mark>, style: Style) -> Self {
        Self { name: name.into(), marks, style, colour: None }
    }
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
            .x_label_formatter(&|x| self.x.tick(*x))
            .y_label_formatter(&|y| match (names.is_empty(), y.round()) {
                (true, _) => self.y.tick(*y),
                (false, at) if (at - y).abs() > 0.01 || at < 0.0 => String::new(),
                (false, at) => names.get(at as usize).cloned().unwrap_or_default(),
            })
            .draw()
            .map_err(|e| said(&e))?;
        for (index, series) in self.series.iter().enumerate() {
            let colour = COLOURS[series.colour.unwrap_or(index) % COLOURS.len()];
            let points: Vec<(f64, f64)> =
                series.marks.iter().map(|m| (m.x, m.y)).filter(|p| p.1.is_finite()).collect();
            let style = colour.stroke_width(2);
            // The box is measured for small letters: capitals want more room.
            let capitals = series.name.chars().filter(|c| c.is_uppercase()).count();
            let label = format!("{}{}", series.name, "\u{a0}".repeat(capitals / 4));
            let gaps = match series.style {
                Style::Dashed => Some((6, 4)),
                Style::Dotted => Some((2, 4)),
                _ => None,
            };
            if let Some((dash, gap)) = gaps {
                chart
                    .draw_series(DashedLineSeries::new(points.clone(), dash, gap, style))
                    .map_err(|e| said(&e))?
                    .label(&label)
                    .legend(move |(x, y)| {
                        let ends = [(x, y), (x + 19, y)];
                        plotters::element::DashedPathElement::new(ends, dash, gap, style)
                    });
                continue;
            }
            if series.style != Style::Points {
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
            let (inside, ring) = match series.style {
                Style::Rings => (WHITE.filled(), true),
                _ => (colour.filled(), false),
            };
            chart
                .draw_series(points.iter().map(|p| Circle::new(*p, 3, inside)))
                .map_err(|e| said(&e))?
                .label(&label)
                .legend(move |(x, y)| {
                    let drawn = if ring { colour.stroke_width(2) } else { colour.filled() };
                    Circle::new((x + 9, y), 4, drawn)
                });
            if ring {
                let outline = points.iter().map(|p| Circle::new(*p, 3, colour.stroke_width(1)));
                chart.draw_series(outline).map_err(|e| said(&e))?;
            }
        }
        if unnamed {
            return area.present().map_err(|e| said(&e));
        }
        // The corner whose box would hide the fewest points, of lines too.
        let letters = self.series.iter().map(|s| s.name.chars().count()).max().unwrap_or(0);
        let box_px = [7.5 * letters as f64 + 60.0, 19.0 * self.series.len() as f64 + 20.0];
        let area_px = [f64::from(SIZE.0 - 40 - beside), f64::from(height - 14 - 14 - 48 - 25)];
        let [wide, high] = [box_px[0] / area_px[0], box_px[1] / area_px[1]];
        let crowd = |x_side: f64, y_side: f64| -> usize {
            let hidden = |&(x, y): &(f64, f64)| {
                let (x, y) = ((x - left) / (right - left), (y - bottom) / (top - bottom));
                (x - x_side).abs() < wide && (y - y_side).abs() < high
            };
            let of = |series: &Series| -> usize {
                let points: Vec<(f64, f64)> = series
                    .marks
                    .iter()
                    .flat_map(|m| {
                        let bar = m.bar.filter(|_| names.is_empty()).unwrap_or([m.y; 2]);
                        [(m.x, m.y), (m.x, bar[0]), (m.x, bar[1])]
                    })
                    .collect();
                let lines = series.marks.windows(2).filter(|_| series.style != Style::Points);
                let between = lines.flat_map(|pair| {
                    (1..10).map(|i| {
                        let part = |a: f64, b: f64| a + (b - a) * f64::from(i) / 10.0;
                        (part(pair[0].x, pair[1].x), part(pair[0].y, pair[1].y))
                    })
                });
                points.into_iter().chain(between).filter(hidden).count()
            };
            self.series.iter().map(of).sum()
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
            .margin(12)
            .background_style(WHITE.mix(0.85))
            .border_style(BLACK.mix(0.25))
            .label_font(font(13))
            .draw()
            .map_err(|e| said(&e))?;
        area.present().map_err(|e| said(&e))
    }
}
