//! The graph of the stack planner: memories, associative memories, rules, and the link to the kitchen.

use super::Part;
use super::kitchen::{Kitchen, PLACE, THINGS};
use super::symbols::{Acts, Base, Control, INDEX, Signals, Symbols};
use crate::neurons::{Layers, Represent, SelectRule};
use crate::sim::Ports;
use crate::sim::{
    Add, Constant, GraphBuilder, In, InputSpec, Module, NodePorts, Out, OutputSpec, Pointer, Real,
    Scalar, Scope, Synapse, VocabTag, WorldLink,
};
use crate::spa::{
    AssociativeMemory, CleanupMemory, FEED_FORWARD, Flow, FlowExt, MemoryPorts, Multiply, Routes,
    Rules, RulesPorts, State, VocabError, Vocabulary,
};

/// Radius of memories and channels. With parts of 16 of 256 dimensions at a radius of 1, three times as large, rules follow each
/// other more slowly than the 37 ms of the original, and the motor repeats actions.
const RADIUS: Real = 1.0;
/// Inhibition of closed channels. In the original a fixed current closes them, which a pointer of many times the radius
/// overcomes: `10 push` reaches the stack while no rule sends it. Without this leak acting begins before the last action is on the
/// stack.
const INHIBITION: Real = 0.2;
/// Synapse behind the channels of the rules.
const CHANNEL: Synapse = Synapse::lowpass_ms(10);

const fn every(level: Real) -> SelectRule {
    SelectRule::Threshold { level }
}

const fn winner(level: Real) -> SelectRule {
    SelectRule::Hysteresis { level, margin: 1.0 }
}

/// Returns a memory with a synapse and a time constant in milliseconds. Without a time constant it keeps its value.
fn memory<V: VocabTag>(of: &Vocabulary<V>, synapse_ms: u32, tau_ms: Option<u32>) -> State<V> {
    let leak = tau_ms.map_or(0.0, |tau| synapse_ms as Real / tau as Real);
    let recurrent = Synapse::lowpass_ms(synapse_ms.into());
    State::new(of).radius(RADIUS).recurrent(recurrent).retention(1.0 - leak)
}

/// A number that keeps its value: the gate.
struct Kept;

/// Ports of a [`Kept`].
struct KeptPorts {
    input: In<Scalar>,
    output: Out<Scalar>,
}

impl Module for Kept {
    type Ports = KeptPorts;

    fn expand(self, scope: &mut Scope<'_>) -> KeptPorts {
        let layer = Represent::new::<Scalar>(InputSpec::scalar(), OutputSpec::scalar(), 1.0);
        let held: Ports<Scalar> = scope.represent("population", layer);
        let output = scope.add("output", Add::scalar());
        scope.connect(&held.output, &held.input, CHANNEL);
        scope.connect(&held.output, &output.input, FEED_FORWARD);
        KeptPorts {
            input: scope.input("input", held.input),
            output: scope.output("output", output.output),
        }
    }
}

/// The memories of the planner, by the names that the rules have for them.
struct Memories {
    ctrl: Ports<Pointer<Control>>,
    switch: Ports<Pointer<Signals>>,
    sig: Ports<Pointer<Signals>>,
    m_goal: Ports<Pointer<Base>>,
    i_goal: Ports<Pointer<Base>>,
    effect: Ports<Pointer<Base>>,
    precon: Ports<Pointer<Base>>,
    place: Ports<Pointer<Base>>,
    action: Ports<Pointer<Acts>>,
    get_precon: Ports<Pointer<Acts>>,
    push: Ports<Pointer<Acts>>,
    stack: Ports<Pointer<Acts>>,
    premotor: Ports<Pointer<Acts>>,
    gate: KeptPorts,
}

impl Memories {
    fn new(graph: &mut GraphBuilder, symbols: &Symbols) -> Self {
        let Symbols { base, acts, control, signals } = symbols;
        Self {
            ctrl: graph.add("ctrl", memory(control, 10, Some(50))),
            switch: graph.add("switch", memory(signals, 100, Some(150))),
            sig: graph.add("sig", memory(signals, 100, Some(650))),
            m_goal: graph.add("m_goal", memory(base, 10, None)),
            i_goal: graph.add("i_goal", memory(base, 5, Some(50))),
            effect: graph.add("effect", memory(base, 5, Some(50))),
            precon: graph.add("precon", memory(base, 5, Some(50))),
            place: graph.add("place", State::new(base).radius(RADIUS)),
            action: graph.add("action", memory(acts, 5, Some(30))),
            get_precon: graph.add("get_precon", State::new(acts).radius(RADIUS)),
            push: graph.add("push", memory(acts, 5, Some(50))),
            stack: graph.add("stack", memory(acts, 5, Some(500))),
            premotor: graph.add("premotor", memory(acts, 5, Some(30))),
            gate: graph.add("gate", Kept),
        }
    }
}

/// The associative memories that the rules read and write.
struct Recall {
    candidate: MemoryPorts<Base, Acts>,
    top: MemoryPorts<Acts, Acts>,
}

/// Adds the associative memories and their connections, which no rule opens.
fn recall(
    graph: &mut GraphBuilder,
    kitchen: &Kitchen,
    symbols: &Symbols,
    memories: &Memories,
) -> Result<Recall, VocabError> {
    let Symbols { base, acts, .. } = symbols;
    let goal = kitchen.goal();
    let things = THINGS.iter().map(|thing| Ok((symbols.thing(thing, goal)?, thing.name)));
    let things: Vec<_> = things.collect::<Result<_, VocabError>>()?;
    let things = things.iter().map(|(pointer, name)| (pointer.as_str(), *name));
    let objects = graph.add("objects", AssociativeMemory::new(base, base, things, every(0.5))?);
    let actions = kitchen.actions.iter();
    let pointers = actions.clone().map(|action| symbols.action(action, kitchen));
    let pointers: Vec<String> = pointers.collect::<Result<_, VocabError>>()?;
    let known = pointers.iter().map(String::as_str).zip(kitchen.names());
    let candidate = AssociativeMemory::new(base, acts, known, winner(0.9))?;
    let candidate = graph.add("candidate", candidate);
    let caused =
        actions.clone().map(|action| (action.name.as_str(), &*kitchen.fluents[action.adds]));
    let cause = graph.add("cause", AssociativeMemory::new(acts, base, caused, winner(0.3))?);
    let recalled = actions.filter(|action| !action.recalled.is_empty()).map(|action| {
        let parts = action.recalled.iter();
        let parts =
            parts.map(|(fluent, weight)| format!("{weight} * {}", kitchen.fluents[*fluent]));
        (action.name.as_str(), parts.collect::<Vec<_>>().join(" + "))
    });
    let recalled: Vec<(&str, String)> = recalled.collect();
    let recalled = recalled.iter().map(|(name, sum)| (*name, sum.as_str()));
    let needs = graph.add("needs", AssociativeMemory::new(acts, base, recalled, every(0.3))?);
    let all = acts.names().iter().map(String::as_str);
    let top = graph.add("top", CleanupMemory::new(acts, all, winner(0.15))?);
    let Memories { m_goal, i_goal, effect, precon, place, action, get_precon, premotor, .. } =
        memories;
    let [location, role, object, effects] =
        [base.get("LOCATION")?, base.get("GOAL")?, base.get("OBJECT")?, base.get("EFFECTS")?];
    graph.route(place * location + m_goal * role >> &objects);
    graph.route(&objects * object + i_goal * effects >> &candidate);
    graph.route(action >> &cause);
    graph.route(&cause >> effect);
    graph.route(get_precon >> &needs);
    graph.route(&needs >> precon);
    graph.route(&top >> premotor);
    Ok(Recall { candidate, top })
}

/// Adds the inputs, and the link through which the planner moves and senses.
fn surroundings(
    graph: &mut GraphBuilder,
    kitchen: &Kitchen,
    symbols: &Symbols,
    memories: &Memories,
) -> Result<(), VocabError> {
    let Symbols { base, acts, control, signals } = symbols;
    let goal = graph.add("goal", Constant::pointer(base.space(), &base.get(kitchen.goal())?));
    graph.route(&goal >> &memories.m_goal);
    let here = graph.add("here", Constant::pointer(base.space(), &base.get(PLACE)?));
    graph.route(&here >> &memories.place);
    let begin = graph.add("begin", control.stimulus([(30, "PLAN"), (70, "0")])?);
    graph.route(&begin >> &memories.ctrl);

    let link = WorldLink::new()
        .sense("ready", OutputSpec::scalar())
        .sense("done", OutputSpec::scalar())
        .command("motor", InputSpec::pointer(acts.space()))
        .command("pushed", InputSpec::pointer(acts.space()))
        .command("goal", InputSpec::pointer(base.space()));
    let world: NodePorts = graph.world("kitchen", link);
    let [ready, done] = ["ready", "done"].map(|name| world.output::<Scalar>(name));
    graph.route(&memories.premotor >> &world.input::<Pointer<Acts>>("motor"));
    graph.route(&memories.push >> &world.input::<Pointer<Acts>>("pushed"));
    graph.route(&memories.m_goal >> &world.input::<Pointer<Base>>("goal"));
    graph.route((&ready * (0.6 * signals.get("ACT")?) >> &memories.switch).via(FEED_FORWARD));
    graph.route((&done * signals.get("DONE")? >> &memories.switch).via(FEED_FORWARD));
    // The gate charges `sig` through a product with a constant 1, as in the original.
    let one = graph.add("one", Constant::scalar(1.0));
    let charge = graph.add("charge", Multiply::new());
    graph.route(&one >> &charge.a);
    graph.route(&memories.gate.output >> &charge.b);
    graph.route(&charge * (0.4 * signals.get("PLAN")?) >> &memories.sig);
    Ok(())
}

/// Returns the rules. Each pointer that a rule routes has a channel of its own.
fn rules(
    symbols: &Symbols,
    memories: &Memories,
    recall: &Recall,
    part: Option<Part>,
) -> Result<Rules, VocabError> {
    let Symbols { acts, control, signals, .. } = symbols;
    let Memories { ctrl, switch, sig, m_goal, i_goal, effect, precon, action, .. } = memories;
    let Memories { get_precon, push, stack, premotor, gate, .. } = memories;
    // Constants have the synapse of the thalamus too, and are as fast as the original's with 5 ms.
    let next = |name| Ok::<_, VocabError>((control.get(name)? >> ctrl).via(FEED_FORWARD));
    let gated = |number| (Flow::number(number) >> &gate.input).via(FEED_FORWARD);
    let at = |name| Ok::<_, VocabError>(ctrl.dot(control.get(name)?));
    let index = acts.get(INDEX)?;
    let deeper = match part {
        Some(Part::Index) => 1.5 * stack,
        _ => 1.5 * (stack * index),
    };
    let higher = |pointer: &Ports<Pointer<Acts>>| match part {
        Some(Part::Index) => 1.0 * pointer,
        _ => pointer * !index,
    };
    Ok(Rules::new()
        .radius(RADIUS)
        .synapse(CHANNEL)
        .inhibition(INHIBITION)
        .rule("plan", at("PLAN")?, [m_goal >> i_goal, next("GET_ACTION")?])
        .rule("get_action", at("GET_ACTION")?, [&recall.candidate >> action, next("GET_PRECON")?])
        .rule(
            "get_precon",
            at("GET_PRECON")?,
            [2.0 * action >> get_precon, deeper >> push, 1.5 * action >> push, next("SET_GOAL")?],
        )
        .rule(
            "set_goal",
            at("SET_GOAL")?,
            [
                1.5 * i_goal >> i_goal,
                1.2 * precon >> i_goal,
                -effect >> i_goal,
                push >> stack,
                next("GET_ACTION")?,
            ],
        )
        .rule(
            "act",
            switch.dot(signals.get("ACT")?),
            [next("TOP")?, gated(1.0), (-signals.get("ACT")? >> switch).via(FEED_FORWARD)],
        )
        .rule("top", at("TOP")?, [stack >> &recall.top, next("POP")?])
        .rule("pop", at("POP")?, [higher(stack) >> push, -higher(premotor) >> push, next("SET")?])
        .rule("set", at("SET")?, [10.0 * push >> stack, next("TOP")?])
        .rule("plan_again", sig.dot(signals.get("PLAN")?), [next("PLAN")?, gated(-0.45)])
        .rule("done", switch.dot(signals.get("DONE")?), [next("DONE")?])
        .otherwise("wait", 0.5, []))
}

/// Describes the planner of a kitchen. Returns the graph, the ports of the rules and the output of the stack.
pub(super) fn describe(
    kitchen: &Kitchen,
    symbols: &Symbols,
    part: Option<Part>,
) -> Result<(GraphBuilder, RulesPorts, Out<Pointer<Acts>>), VocabError> {
    let mut graph = GraphBuilder::new();
    let memories = Memories::new(&mut graph, symbols);
    let recall = recall(&mut graph, kitchen, symbols, &memories)?;
    surroundings(&mut graph, kitchen, symbols, &memories)?;
    let rules = rules(symbols, &memories, &recall, part)?;
    let rules = graph.add("rules", rules);
    Ok((graph, rules, memories.stack.output))
}
