//! Figures: lines or points with error bars and labelled axes, drawn as SVG.

mod draw;

use crate::task::TaskError;

/// An axis of a figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Label with the unit.
    pub label: String,
    /// Lower and upper end; `None` for the range of the data.
    pub range: Option<[f64; 2]>,
    /// Categories at 0, 1, 2 and so on, from the bottom, for a vertical axis without numbers.
    pub names: Vec<String>,
    /// Base of a logarithmic axis. The data are logarithms; the ticks are labelled with powers.
    pub base: Option<f64>,
}

impl Axis {
    /// Creates an axis with the range of the data.
    pub fn new(label: &str) -> Self {
        Self { label: label.into(), range: None, names: Vec::new(), base: None }
    }

    /// Creates an axis from `low` to `high`.
    pub fn from_to(label: &str, low: f64, high: f64) -> Self {
        Self { label: label.into(), range: Some([low, high]), names: Vec::new(), base: None }
    }

    /// Creates a logarithmic axis, labelled with powers of `base`.
    pub fn logarithmic(label: &str, base: f64) -> Self {
        Self { base: Some(base), ..Self::new(label) }
    }

    /// Returns the label of a tick.
    fn tick(&self, value: f64) -> String {
        match self.base {
            None => number(value),
            Some(base) if (value - value.round()).abs() < 0.01 => number(base.powf(value.round())),
            Some(_) => String::new(),
        }
    }

    /// Creates a vertical axis of categories, listed from the bottom.
    pub fn named(names: Vec<String>) -> Self {
        let range = Some([-0.5, names.len() as f64 - 0.5]);
        Self { label: String::new(), range, names, base: None }
    }
}

/// A point with an error bar. The bar is vertical, or horizontal if the vertical axis has categories.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mark {
    /// Position along the x axis.
    pub x: f64,
    /// Position along the y axis.
    pub y: f64,
    /// Lower and upper end of the error bar.
    pub bar: Option<[f64; 2]>,
}

impl Mark {
    /// Returns the point with its coordinates exchanged, for a vertical axis of categories.
    pub fn across(self) -> Self {
        Self { x: self.y, y: self.x, ..self }
    }
}

/// The style in which a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// Points alone.
    Points,
    /// Points joined by a line.
    Line,
    /// Rings joined by a line.
    Rings,
    /// A dashed line without points, such as for a prediction.
    Dashed,
    /// A dotted line without points.
    Dotted,
}

/// A named set of points with a common style.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Points.
    pub marks: Vec<Mark>,
    /// Style of the points.
    pub style: Style,
    /// Index of the colour; `None` for the index of the series.
    pub colour: Option<usize>,
}

impl Series {
    /// Creates a series. Its colour follows from its index among the series.
    pub fn new(name: impl Into<String>, marks: Vec<Mark>, style: Style) -> Self {
        Self { name: name.into(), marks, style, colour: None }
    }
}

/// A figure of an experiment's results.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Title.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Data.
    pub series: Vec<Series>,
}

impl Figure {
    /// Draws the figure as an SVG document.
    ///
    /// # Errors
    /// [`TaskError::Figure`] if the figure cannot be drawn.
    pub fn to_svg(&self) -> Result<String, TaskError> {
        let mut svg = String::new();
        self.draw(&mut svg).map_err(|reason| TaskError::Figure { reason })?;
        Ok(svg)
    }
}

/// Formats a number as the label of a tick.
fn number(value: f64) -> String {
    let rounded = (value * 1e6).round() / 1e6;
    if rounded == 0.0 { "0".into() } else { rounded.to_string() }
}
