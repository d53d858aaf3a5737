//! The modules that expressions are made of, wired by hand, beside the expressions.
//!
//! `cargo run --example wired_by_hand`

use std::error::Error;

use symbolt::prelude::*;
use symbolt::spa::{Compare, Multiply, Rule, Weigh};

symbolt::vocabulary!(Parts = "parts": NUT, BOLT, JIG);

/// Runs a graph that computes everything twice. Returns pairs that should be equal: by expression and by hand.
pub fn run(plan: &PopulationPlan, seed: Seed) -> Result<Vec<[f32; 2]>, Box<dyn Error>> {
    let parts = Parts::vocabulary(64, seed)?;
    let mut graph = GraphBuilder::new();
    let a = graph.add("a", parts.stimulus([(0, "0.6 * NUT + 0.6 * BOLT")])?);
    let b = graph.add("b", parts.stimulus([(0, "0.8 * NUT + 0.2 * JIG")])?);

    // A product of two outputs weighs a sum.
    let [short, long] = ["short", "long"].map(|name| graph.add(name, State::new(&parts)));
    graph.route(a.dot(&b) * (0.5 * &a + 0.5 * &b) >> &short);
    let compare = graph.add("compare", Compare::new(&parts));
    let sum = graph.add("sum", Superpose::new(&parts, &[0.5, 0.5]));
    let weigh = graph.add("weigh", Weigh::pointer(&parts));
    graph.connect(&a, &compare.a, Synapse::None);
    graph.connect(&b, &compare.b, Synapse::None);
    graph.connect(&a, &sum.inputs[0], Synapse::None);
    graph.connect(&b, &sum.inputs[1], Synapse::None);
    graph.connect(&compare.output, &weigh.weight, Synapse::None);
    graph.connect(&sum.output, &weigh.value, Synapse::None);
    graph.connect(&weigh.output, &long.input, Synapse::None);

    // Numbers.
    let [x, y] = [0.5, -0.8].map(|x| graph.add(&format!("x{x}"), Constant::scalar(x)));
    let xy = graph.add("xy", Add::scalar());
    graph.route(&x * &y >> &xy);
    let product = graph.add("product", Multiply::new());
    graph.connect(&x, &product.a, Synapse::None);
    graph.connect(&y, &product.b, Synapse::None);

    // A choice: rules collected from a table, and basal ganglia with utilities that are led there one by one.
    let table = [("like_nut", "NUT"), ("like_bolt", "BOLT"), ("like_jig", "JIG")];
    let rule = |(name, part): (&str, &str)| Ok(Rule::new(name, b.dot(parts.get(part)?), []));
    let rules: Result<Rules, symbolt::spa::VocabError> = table.into_iter().map(rule).collect();
    let rules = graph.add("rules", rules?);
    let choice = graph.add("choice", BasalGanglia::new(table.len()));
    for (index, (_, part)) in table.into_iter().enumerate() {
        let mut column = [[0.0]; 3];
        column[index] = [1.0];
        graph.route(b.dot(parts.get(part)?).transform(column) >> &choice.utilities);
    }

    let sim = graph.run(plan, seed, SimDuration::from_millis(200))?;
    let nut = parts.get("NUT")?;
    let mut pairs = vec![
        [&short, &long].map(|state| dot(&sim.value(&state.output), &nut)),
        [sim.value(&xy.output)[0], sim.value(&product.output)[0]],
    ];
    let chosen = [&rules.chosen, &choice.chosen].map(|chosen| sim.value(chosen));
    pairs.extend((0..table.len()).map(|index| chosen.map(|chosen| chosen[index])));
    Ok(pairs)
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    for [expression, by_hand] in run(&PopulationPlan::direct(), Seed::new(1))? {
        println!("{expression:.3} by expression, {by_hand:.3} by hand");
    }
    Ok(())
}
