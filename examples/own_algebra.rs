//! An algebra of one's own: binding multiplies component by component (Gayler 2003), in exact maths and in neurons.
//!
//! `cargo run --example own_algebra`

use std::error::Error;

use symbolt::prelude::*;
use symbolt::sim::{Fingerprint, Scratch};
use symbolt::spa::{Algebra, LinearMap, ProductForm, VocabError, Workspace};

/// Binds by `sqrt(D) a_i b_i`, which keeps norms. A pointer is its own inverse; this is exact if all of its components
/// have the magnitude `1 / sqrt(D)`.
#[derive(Debug)]
struct Multiplication;

/// Multiplies each component by a number of its own.
struct Diagonal(Vec<f32>);

fn root(dim: usize) -> f32 {
    (dim as f32).sqrt()
}

impl LinearMap for Diagonal {
    fn input_width(&self) -> usize {
        self.0.len()
    }

    fn output_width(&self) -> usize {
        self.0.len()
    }

    fn fingerprint(&self, hash: &mut Fingerprint) {
        hash.text("own_algebra::Diagonal").reals(&self.0);
    }

    fn apply_into(&self, input: &[f32], out: &mut [f32], _scratch: &mut Scratch<'_>) {
        for ((out, input), factor) in out.iter_mut().zip(input).zip(&self.0) {
            *out = input * factor;
        }
    }
}

impl Algebra for Multiplication {
    fn name(&self) -> &'static str {
        "multiplication"
    }

    fn check_dim(&self, dim: usize) -> Result<(), VocabError> {
        let (min, max) = (4, 65_536);
        match (min..=max).contains(&dim) {
            true => Ok(()),
            false => Err(VocabError::Dimension { dim, min, max }),
        }
    }

    fn scratch(&self, _dim: usize) -> Workspace {
        Workspace::new(())
    }

    fn bind_into(&self, a: &[f32], b: &[f32], out: &mut [f32], _scratch: &mut Workspace) {
        let root = root(out.len());
        for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
            *out = root * a * b;
        }
    }

    fn inverse_into(&self, a: &[f32], out: &mut [f32]) {
        out.copy_from_slice(a);
    }

    fn identity_into(&self, out: &mut [f32]) {
        out.fill(root(out.len()).recip());
    }

    fn make_unitary(&self, a: &mut [f32], _scratch: &mut Workspace) {
        let magnitude = root(a.len()).recip();
        a.iter_mut().for_each(|a| *a = magnitude.copysign(*a));
    }

    fn product_form(&self, dim: usize) -> ProductForm {
        let diagonal = |factor| Box::new(Diagonal(vec![factor; dim]));
        ProductForm {
            pairs: dim,
            // 99% of a normal variable lie within 2.58 deviations, half a sum of two within 1.82.
            magnitude: 1.82 / root(dim),
            left: diagonal(1.0),
            right: diagonal(1.0),
            back: diagonal(root(dim)),
        }
    }

    fn bind_with(&self, fixed: &[f32]) -> Box<dyn LinearMap> {
        let root = root(fixed.len());
        Box::new(Diagonal(fixed.iter().map(|fixed| root * fixed).collect()))
    }
}

symbolt::vocabulary!(Words = "words": COLOUR, SHAPE, RED, SQUARE);

/// Asks a scene for the colour. Returns the similarity of the answer with RED and with SQUARE.
pub fn run(plan: &PopulationPlan, seed: Seed) -> Result<[f32; 2], Box<dyn Error>> {
    let words = VocabularyBuilder::<Words>::new(128, seed).algebra(Multiplication);
    let words = words.unitary("COLOUR").unitary("SHAPE").pointers(["RED", "SQUARE"]).build()?;
    let mut graph = GraphBuilder::new();
    let scene = graph.add("scene", words.stimulus([(0, "COLOUR * RED + SHAPE * SQUARE")])?);
    let question = graph.add("question", words.stimulus([(0, "COLOUR")])?);
    let answer = graph.add("answer", State::new(&words));
    // In neurons, one layer multiplies. The norm of the scene is about the root of 2.
    graph.route(0.7 * &scene * !&question >> &answer);
    let sim = graph.run(plan, seed, SimDuration::from_millis(100))?;
    let answer = sim.value(&answer.output);
    Ok([dot(&answer, &words.get("RED")?), dot(&answer, &words.get("SQUARE")?)])
}

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    let [red, square] = run(&PopulationPlan::direct(), Seed::new(1))?;
    println!("exact: RED {red:.2}, SQUARE {square:.2}");
    let spiking = PopulationPlan::lif();
    let [red, square] = run(&spiking, Seed::new(1))?;
    println!("in spikes: RED {red:.2}, SQUARE {square:.2}");
    Ok(())
}
