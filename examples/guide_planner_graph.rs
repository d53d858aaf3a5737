//! The guide `docs/planner_graph.md` as a program.
//!
//! `cargo run --example guide_planner_graph`

use std::error::Error;
use std::sync::Arc;

use symbolt::prelude::*;
use symbolt::task::planner::PlanningGraph;
use symbolt::task::{Encoded, Obstacle};

fn tea() -> Result<Domain, TaskError> {
    DomainBuilder::new()
        .action("BOIL_WATER", ["KETTLE_FULL"], ["WATER_HOT"])
        .action("BREW_TEA", ["WATER_HOT", "LEAVES_IN_POT"], ["TEA_READY"])
        .build()
}

fn ask() -> Result<(), TaskError> {
    let domain = tea()?;
    let names: Vec<&str> = domain.states().iter().map(|state| state.name.as_str()).collect();
    println!("states: {}", names.join(", "));

    let planner = Planner::new(&domain, PlannerSpec::default(), Seed::new(1))?;
    let goal = domain.state("TEA_READY")?;
    for holds in [vec!["KETTLE_FULL", "LEAVES_IN_POT"], vec!["KETTLE_FULL"], vec!["TEA_READY"]] {
        let world = domain.world(holds.iter().copied())?;
        let decision = planner.decide(&world, goal)?;
        let answer = match decision.verdict {
            Verdict::Act(action) => format!("do {}", domain[action].name),
            Verdict::Met => "the goal holds".to_owned(),
            Verdict::Stuck(Obstacle::NothingCauses { state }) => {
                format!("stuck: no action causes {}", domain[state].name)
            }
            Verdict::Stuck(other) => format!("stuck: {other:?}"),
        };
        println!("{}: {answer} ({} simulated ms)", holds.join(" + "), decision.time_ms);
    }
    Ok(())
}

fn choose() -> Result<(), TaskError> {
    let domain = DomainBuilder::new()
        .action("BREW_TEA", ["WATER_HOT", "LEAVES_IN_POT"], ["TEA_READY"])
        .action("BOIL_WATER", ["KETTLE_FULL"], ["WATER_HOT"])
        .action("HEAT_IN_MACHINE", ["MACHINE_ON"], ["WATER_HOT"])
        .build()?;
    let planner = Planner::new(&domain, PlannerSpec::default(), Seed::new(1))?;
    let world = domain.world(["MACHINE_ON", "LEAVES_IN_POT"])?;
    let decision = planner.decide(&world, domain.state("TEA_READY")?)?;
    if let Some(choice) = decision.choices.first() {
        let (state, action) = (&domain[choice.state].name, &domain[choice.action].name);
        println!("{state}: {action} of {} causes, {:?}", choice.among, choice.why);
    }
    Ok(())
}

fn embed() -> Result<(), Box<dyn Error>> {
    let domain = tea()?;
    let spec = PlannerSpec::default();
    let encoded = Encoded::new(&domain, spec.dimensions, spec.max_similarity, Seed::new(1))?;
    let encoded = Arc::new(encoded);
    let (states, actions) = (&encoded.states, &encoded.actions);
    let ms = SimDuration::from_millis;

    let mut graph = GraphBuilder::new();
    let planner = graph.add("planner", PlanningGraph::new(&domain, encoded.clone(), spec)?);
    let tea_ready = Constant::pointer(states.space(), &states.get("TEA_READY")?);
    let goal = graph.add("goal", tea_ready);
    let water_hot = Stimulus::vector(&[1.0, 0.0, 1.0, 0.0]).from(ms(300), &[0.0, 1.0, 1.0, 0.0]);
    let present = graph.add("present", water_hot);
    // A `ready` of 0 makes the graph forget its last answer.
    let asked = Stimulus::scalar(1.0).from(ms(300), &[0.0]).from(ms(350), &[1.0]);
    let ready = graph.add("ready", asked);
    graph.connect(&goal, &planner.goal, Synapse::None);
    graph.connect(&present, &planner.present, Synapse::None);
    graph.connect(&ready, &planner.ready, Synapse::None);
    let held = graph.probe(&planner.goal_buffer, ProbeSpec::every(ms(10)));
    let acted = graph.probe(&planner.action, ProbeSpec::every(ms(10)));

    let graph = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))?;
    let mut sim = Simulator::new(graph.into(), RunConfig::default())?;
    sim.run_for(ms(600))?;

    let (mut last_held, mut last_action) = ("", "");
    for ((time_s, held), (_, action)) in sim.samples(&held).iter().zip(sim.samples(&acted).iter()) {
        for name in ["TEA_READY", "WATER_HOT"] {
            if last_held != name && cosine(&held, &states.get(name)?) > 0.9 {
                println!("{:>3.0} ms: the goal buffer holds {name}", 1e3 * time_s);
                last_held = name;
            }
        }
        for name in ["BOIL_WATER", "BREW_TEA"] {
            if last_action != name && cosine(&action, &actions.get(name)?) > 0.99 {
                println!("{:>3.0} ms: the planner does {name}", 1e3 * time_s);
                last_action = name;
            }
        }
    }
    Ok(())
}

struct States;
impl VocabTag for States {
    const NAME: &'static str = "states";
}
struct Actions;
impl VocabTag for Actions {
    const NAME: &'static str = "actions";
}

fn rebuild() -> Result<(), Box<dyn Error>> {
    let names = ["KETTLE_FULL", "WATER_HOT", "LEAVES_IN_POT", "TEA_READY"];
    // A unitary role can be unbound exactly.
    let states = VocabularyBuilder::<States>::new(256, Seed::new(1));
    let states = states.unitary("NEEDS").pointers(names).build()?;
    let actions = VocabularyBuilder::<Actions>::new(256, Seed::new(1));
    let actions = actions.pointers(["BOIL", "BREW"]).build()?;

    let best = SelectRule::WinnerTakeAll { level: 0.5 };
    let every = SelectRule::Threshold { level: 0.5 };
    let causes = [("WATER_HOT", "BOIL"), ("TEA_READY", "BREW")];
    let needs = [("BOIL", "NEEDS * KETTLE_FULL"), ("BREW", "NEEDS * (WATER_HOT + LEAVES_IN_POT)")];

    let mut graph = GraphBuilder::new();
    let goal = graph.add("goal", Constant::pointer(states.space(), &states.get("TEA_READY")?));
    let cause = graph.add("cause", AssociativeMemory::new(&states, &actions, causes, best)?);
    let deep = graph.add("deep", AssociativeMemory::new(&actions, &states, needs, best)?);
    let unbind = graph.add("unbind", Linear::unbind(&states, "NEEDS")?);
    let required = graph.add("required", CleanupMemory::new(&states, names, every)?);
    graph.connect(&goal, &cause.input, Synapse::None);
    graph.connect(&cause.output, &deep.input, Synapse::None);
    graph.connect(&deep.output, &unbind.input, Synapse::None);
    graph.connect(&unbind.output, &required.input, Synapse::None);
    let active = graph.probe(&required.items, ProbeSpec::default());

    let graph = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))?;
    let mut sim = Simulator::new(graph.into(), RunConfig::default())?;
    sim.run_for(SimDuration::from_millis(60))?;
    for (index, name) in names.iter().enumerate() {
        let on = sim.samples(&active).iter().find(|(_, items)| items[index] > 0.5);
        if let Some((time_s, _)) = on {
            println!("needs {name}, known after {:.0} ms", 1e3 * time_s);
        }
    }
    Ok(())
}

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    ask()?;
    choose()?;
    embed()?;
    rebuild()
}
