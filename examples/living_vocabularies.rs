//! Vocabularies that grow, shrink and translate, powers, lists, and a second algebra.
//!
//! `cargo run --example living_vocabularies`

use std::error::Error;

use symbolt::prelude::*;
use symbolt::spa::{PointerValue, Vtb};

symbolt::vocabulary!(Parts = "parts": NUT, BOLT, JIG);
symbolt::vocabulary!(Teile = "Teile": NUT, BOLT);

/// Returns one line for each thing that a vocabulary can do.
pub fn run() -> Result<Vec<String>, Box<dyn Error>> {
    let mut lines = Vec::new();
    let parts = Parts::vocabulary(256, Seed::new(1))?;

    // A larger vocabulary has the same space: its pointers fit where those of the smaller one do.
    let more = parts.grow().pointer("WASHER").define("SEATED", "NUT * JIG").build()?;
    let few = more.subset(["NUT", "SEATED"])?;
    lines.push(format!("{} names, {} of them, {} of both", more.len(), few.len(), {
        parts.union(&few)?.len()
    }));

    // A pointer in words.
    let sum = more.parse("0.8 * NUT - 0.5 * WASHER")?;
    lines.push(more.subset(["NUT", "WASHER"])?.describe(&sum, 0.2));
    lines.push(more.describe(&more.zero(), 0.2));

    // Fractional powers need a pointer whose spectrum is nowhere negative, such as that of a square.
    let square = parts.parse("NUT * NUT")?;
    let half = parts.power(&square, 0.5)?;
    lines.push(format!("half bound to half: {:.2}", {
        cosine(&parts.value(&half * &half)?, &square)
    }));

    // A list, whose items are bound to powers of a position.
    let places = parts.grow().unitary("PLACE").build()?;
    let list = places.list("PLACE", ["BOLT", "NUT", "JIG"])?;
    let second = places.value(list * !places.power(&places.get("PLACE")?, 2.0)?)?;
    lines.push(format!("second of the list: {}", best(&parts, &second)?));

    // Without overlap, and in an algebra whose binding does not commute.
    let exact =
        VocabularyBuilder::<Teile>::new(64, Seed::new(1)).orthonormal(["NUT", "BOLT"]).build()?;
    lines.push(format!("similarity of orthonormal names: {:.2}", {
        dot(&exact.get("NUT")?, &exact.get("BOLT")?).abs()
    }));
    let matrices = VocabularyBuilder::<Teile>::new(64, Seed::new(1)).algebra(Vtb);
    let matrices = matrices.pointers(["NUT", "BOLT"]).build()?;
    let exchanged = cosine(&matrices.parse("NUT * BOLT")?, &matrices.parse("BOLT * NUT")?);
    lines.push(format!(
        "{}: exchanged factors differ: {}",
        matrices.algebra().name(),
        exchanged < 0.5
    ));

    // In a graph: a module translates what has a name in both. The other vector is only taken for one of the other space.
    let teile = Teile::vocabulary(256, Seed::new(2))?;
    let mut graph = GraphBuilder::new();
    let nut = graph.add("nut", parts.stimulus([(0, "NUT")])?);
    let [translated, taken] =
        ["translated", "taken"].map(|name| graph.add(name, State::new(&teile)));
    let translation = graph.add("translation", parts.translation(&teile)?);
    graph.route(&nut >> &translation.input);
    graph.route(&translation.output >> &translated);
    graph.route(nut.reinterpret(&teile) >> &taken);
    let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), SimDuration::from_millis(50))?;
    let [translated, taken] = [translated, taken].map(|state| sim.value(&state.output));
    let nut = teile.get("NUT")?;
    lines.push(format!("translated: {:.2}", cosine(&translated, &nut)));
    lines.push(format!("not translated: {:.2}", cosine(&taken, &nut)));
    Ok(lines)
}

/// Returns the name that resembles a pointer most.
fn best(
    parts: &Vocabulary<Parts>,
    pointer: &PointerValue<Parts>,
) -> Result<String, Box<dyn Error>> {
    let mut best = (f32::MIN, String::new());
    for name in parts.names() {
        let similarity = dot(pointer, &parts.get(name)?);
        if similarity > best.0 {
            best = (similarity, name.clone());
        }
    }
    Ok(best.1)
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    for line in run()? {
        println!("{line}");
    }
    Ok(())
}
