//! Tuning curves of an ensemble as a chart, and what it was built with.
//!
//! `cargo run --example tuning_curves -- FOLDER`

use std::error::Error;
use std::path::{Path, PathBuf};

use ndarray::Array;
use symbolt::files::{Overwrite, write_atomic};
use symbolt::neurons::{BuiltLayer, Encoders, Ensemble, Values};
use symbolt::prelude::*;
use symbolt::record::Curves;

/// Writes `tuning_curves.svg` into a folder. Returns the number of neurons and the error of the decoded square.
pub fn run(folder: &Path) -> Result<(usize, f64), Box<dyn Error>> {
    let mut graph = GraphBuilder::new();
    let given = graph.add("given", Constant::vector(&[0.5]));
    let tuned = Ensemble::new(1)
        .encoders(Encoders::choice([[1.0], [-1.0]]))
        .intercepts(Values::between(-0.8, 0.8))
        .max_rates(Values::between(100.0, 120.0))
        .size(0.12)
        .decode("square", 1, |x, out| out[0] = x[0] * x[0]);
    let a = graph.add("a", tuned);
    graph.route(&given >> &a.input);
    let plan = PopulationPlan::lif();
    let graph = graph.build(Timebase::default(), &plan, Seed::new(1))?;

    let built = BuiltLayer::of(&graph, "a")?.ensemble(0)?;
    let values = Array::linspace(-1.0, 1.0, 201);
    let rates = built.tuning_curves(values.view().insert_axis(ndarray::Axis(1)))?;
    let curves = Curves { title: "Tuning curves", x: "value", y: "rate (Hz)" };
    let svg = curves.to_svg(values.view(), rates.view());
    write_atomic(&folder.join("tuning_curves.svg"), svg, Overwrite::Allowed)?;
    Ok((rates.ncols(), built.error("square")?))
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1).map_or_else(|| PathBuf::from("."), PathBuf::from);
    let (neurons, error) = run(&folder)?;
    println!(
        "Curves of {neurons} neurons are in {}; the square's error is {error:.3}.",
        folder.display()
    );
    Ok(())
}
