//! Figures: lines or points with error bars over labelled axes, drawn as SVG.

mod draw;

use crate::task::TaskError;

/// An axis of a figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// The label, with the unit.
    pub label: String,
    /// Its ends; those of the data if not given.
    pub range: Option<[f64; 2]>,
    /// The categories at 0, 1, 2 and so on from the bottom, on a vertical axis without numbers.
    pub names: Vec<String>,
    /// The base of a logarithmic axis, whose numbers are logarithms and whose ticks are powers.
    pub base: Option<f64>,
}

impl Axis {
    /// An axis with the range of the data.
    pub fn new(label: &str) -> Self {
        Self { label: label.into(), range: None, names: Vec::new(), base: None }
    }

    /// An axis from `low` to `high`.
    pub fn from_to(label: &str, low: f64, high: f64) -> Self {
        Self { label: label.into(), range: Some([low, high]), names: Vec::new(), base: None }
    }

    /// A logarithmic axis, labelled with powers of `base`.
    pub fn logarithmic(label: &str, base: f64) -> Self {
        Self { base: Some(base), ..Self::new(label) }
    }

    /// The label of a tick.
    fn tick(&self, value: f64) -> String {
        match self.base {
            None => number(value),
            Some(base) if (value - value.round()).abs() < 0.01 => number(base.powf(value.round())),
            Some(_) => String::new(),
        }
    }

    /// A vertical axis of categories, from the bottom.
    pub fn named(names: Vec<String>) -> Self {
        let range = Some([-0.5, names.len() as f64 - 0.5]);
        Self { label: String::new(), range, names, base: None }
    }
}

/// A point with an error bar: vertical, or horizontal where the vertical axis has categories.
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
    /// Points joined by a line.
    Line,
    /// Rings joined by a line.
    Rings,
    /// A dashed line without points, as for a prediction.
    Dashed,
    /// A dotted line without points.
    Dotted,
}

/// Points of one name and style.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// Its points.
    pub marks: Vec<Mark>,
    /// How it is drawn.
    pub style: Style,
    /// The number of its colour; its place among the series if not given.
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
    /// The data.
    pub series: Vec<Series>,
}

impl Figure {
    /// The figure as an SVG document.
    ///
    /// # Errors
    /// [`TaskError::Figure`] if it cannot be drawn.
    pub fn to_svg(&self) -> Result<String, TaskError> {
        let mut svg = String::new();
        self.draw(&mut svg).map_err(|reason| TaskError::Figure { reason })?;
        Ok(svg)
    }
}

/// A number as the label of a tick.
fn number(value: f64) -> String {
    let rounded = (value * 1e6).round() / 1e6;
    if rounded == 0.0 { "0".into() } else { rounded.to_string() }
}
