//! The graph as a picture: its modules as boxes, their connections as arrows.

use std::collections::BTreeSet;

use layout::backends::svg::SVGWriter;
use layout::core::base::Orientation;
use layout::core::geometry::Point;
use layout::core::style::StyleAttr;
use layout::std_shapes::shapes::{Arrow, Element, ShapeKind};
use layout::topo::layout::VisualGraph;

use crate::sim::Graph;

/// Greatest numbers of modules and of connections between them. The time for the layout grows with the cube; at this size
/// it takes a second.
const MODULES: usize = 40;
const CONNECTIONS: usize = 120;
/// Width of a character and height of a box, in pixels.
const CHARACTER: f64 = 9.0;
const HEIGHT: f64 = 34.0;

impl Graph {
    /// Draws the modules and their connections as SVG: one box for each first part of a path, one arrow for all
    /// connections from one module to another; those inside a module are not shown. `None` for a graph of no module, more than 40 modules or more than 120
    /// arrows; [`to_dot`](Self::to_dot) has no such limit and shows all nodes.
    ///
    /// ```
    /// # use symbolt::prelude::*;
    /// # symbolt::vocabulary!(Parts = "parts": NUT, BOLT);
    /// let parts = Parts::vocabulary(64, Seed::new(1))?;
    /// let mut graph = GraphBuilder::new();
    /// let seen = graph.add("seen", parts.stimulus([(0, "NUT")])?);
    /// let state = graph.add("state", State::new(&parts));
    /// graph.route(&seen >> &state);
    /// let sim = graph.start(&PopulationPlan::direct(), Seed::new(1))?;
    /// let drawing = sim.graph().to_svg().ok_or("too large")?;
    /// assert!(drawing.starts_with("<svg") && drawing.contains("state"));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn to_svg(&self) -> Option<String> {
        let module = |node: usize| self.nodes[node].path.split('/').next().unwrap_or_default();
        let mut modules: Vec<&str> = Vec::new();
        for node in 0..self.nodes.len() {
            if !modules.contains(&module(node)) {
                modules.push(module(node));
            }
        }
        let index = |node: usize| modules.iter().position(|name| *name == module(node));
        let arrows: BTreeSet<(usize, usize)> = self
            .edges
            .iter()
            .filter_map(|edge| Some((index(edge.from.0)?, index(edge.to.0)?)))
            .filter(|(from, to)| from != to)
            .collect();
        if modules.is_empty() || modules.len() > MODULES || arrows.len() > CONNECTIONS {
            return None;
        }
        let mut drawing = VisualGraph::new(Orientation::LeftToRight);
        let boxes: Vec<_> = modules
            .iter()
            .map(|name| {
                let size = Point::new(CHARACTER * name.chars().count() as f64 + 24.0, HEIGHT);
                let (shape, style) = (ShapeKind::new_box(name), StyleAttr::simple());
                drawing.add_node(Element::create(shape, style, Orientation::LeftToRight, size))
            })
            .collect();
        for (from, to) in arrows {
            drawing.add_edge(Arrow::simple(""), boxes[from], boxes[to]);
        }
        let mut svg = SVGWriter::new();
        drawing.do_it(false, false, false, &mut svg);
        let svg = svg.finalize();
        // Without the header of XML the picture can stand in a page.
        svg.find("<svg").map(|start| svg[start..].to_owned())
    }
}
