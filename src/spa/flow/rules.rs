//! Action rules: "if vision resembles WRITE, route vision to verb".
//!
//! Each rule has a name, a utility and any number of routes. Basal ganglia choose the rule of greatest utility, and the
//! thalamus opens its routes; those of all other rules are silent. An open route takes one synapse (5 ms), whether its
//! source is constant or not.
//!
//! The gates of pointers are fully open from half the activity of a chosen rule on, because this activity is about 0.9 in
//! neurons. Constants and numbers are scaled by the activity. The synapse of [`Route::via`] follows the gate of a
//! pointer; for a constant it takes the place of the 5 ms.

use super::expression::{Flow, IntoFlow};
use super::kinds::Gates;
use super::lower::Lowerer;
use super::route::{Opening, Route};
use crate::sim::{
    EmitIo, Fingerprint, In, InputSpec, Module, Node, Out, OutputSpec, PortDecl, Real, Scalar,
    Scope, StepCx, Synapse, Vector,
};
use crate::spa::modules::{BasalGanglia, FEED_FORWARD, Slice};

/// A set of action rules.
///
/// ```
/// use symbolt::prelude::*;
///
/// struct Words;
/// impl VocabTag for Words { const NAME: &'static str = "words"; }
///
/// let words = VocabularyBuilder::<Words>::new(128, Seed::new(1)).pointers(["WRITE", "ONE"]).build()?;
/// let mut graph = GraphBuilder::new();
/// let vision = graph.add("vision", Constant::pointer(words.space(), &words.get("WRITE")?));
/// let verb = graph.add("verb", State::new(&words));
/// let noun = graph.add("noun", State::new(&words));
/// let (write, one) = (words.get("WRITE")?, words.get("ONE")?);
/// let rules = Rules::new()
///     .rule("see_verb", vision.dot(write), [&vision >> &verb])
///     .rule("see_noun", vision.dot(one), [&vision >> &noun])
///     .otherwise("wait", 0.4, []);
/// let rules = graph.add("rules", rules);
///
/// let graph = graph.build(Timebase::default(), &PopulationPlan::direct(), Seed::new(1))?;
/// let mut sim = Simulator::new(graph.into(), RunConfig::default())?;
/// sim.run_for(SimDuration::from_millis(200))?;
/// assert!(cosine(&sim.value(&verb.output), &write) > 0.9);
/// assert!(sim.value(&rules.chosen)[0] > 0.9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use = "rules do nothing until they are added to a graph"]
pub struct Rules {
    rules: Vec<Rule>,
    gates: Gates,
}

impl Default for Rules {
    fn default() -> Self {
        let gates = Gates { radius: 1.0, synapse: FEED_FORWARD, inhibition: 1.0 };
        Self { rules: Vec::new(), gates }
    }
}

/// One action rule, for a set that is [collected](Iterator::collect) from data.
///
/// ```
/// use symbolt::prelude::*;
/// use symbolt::spa::Rule;
///
/// symbolt::vocabulary!(States = "states": A, B, C);
///
/// let table = [("first", "A", "B"), ("second", "B", "C"), ("third", "C", "A")];
/// let states = States::vocabulary(64, Seed::new(1))?;
/// let mut graph = GraphBuilder::new();
/// let state = graph.add("state", State::new(&states));
/// let rules: Rules = table
///     .iter()
///     .map(|(name, from, to)| {
///         let (from, to) = (states.parse(from)?, states.parse(to)?);
///         Ok(Rule::new(*name, state.dot(&from), [&to >> &state]))
///     })
///     .collect::<Result<_, symbolt::spa::VocabError>>()?;
/// let rules = graph.add("rules", rules);
/// assert_eq!(rules.names(), ["first", "second", "third"]);
/// # Ok::<(), symbolt::spa::VocabError>(())
/// ```
#[must_use = "a rule does nothing until it is part of a set"]
pub struct Rule {
    name: String,
    utility: Flow<Scalar>,
    routes: Vec<Route>,
}

impl Rule {
    /// Makes a rule, as [`Rules::rule`] does.
    pub fn new(
        name: impl Into<String>,
        utility: impl IntoFlow<Kind = Scalar>,
        routes: impl IntoIterator<Item = Route>,
    ) -> Self {
        let (name, routes) = (name.into(), routes.into_iter().collect());
        Self { name, utility: utility.into_flow(), routes }
    }
}

impl FromIterator<Rule> for Rules {
    fn from_iter<I: IntoIterator<Item = Rule>>(rules: I) -> Self {
        Self { rules: rules.into_iter().collect(), ..Self::default() }
    }
}

/// Ports of [`Rules`].
pub struct RulesPorts {
    /// Utilities in the order of the rules.
    pub utilities: Out<Vector>,
    /// Activity of each rule: about 1 if it is chosen with a clear lead, less with a small one ([`Rules::rule`]), else 0.
    pub chosen: Out<Vector>,
    names: Vec<String>,
}

impl RulesPorts {
    /// Returns the names of the rules, in their order.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Returns the index of a rule; `None` if there is no such rule.
    pub fn position(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|own| own == name)
    }
}

impl Rules {
    /// Starts an empty set.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a rule. Its utility, between 0.3 and 1 if the rule should be chosen, is an expression or a number. The name
    /// becomes a part of the paths of its nodes. A name that another rule has, `choice` and `utilities` are faults when the
    /// graph is built.
    ///
    /// How active the winner is depends on its lead: 0.9 or more with a lead of 0.3, about 0.76 with a utility of 0.8
    /// against 0.7, and 0.74 in exact maths with 0.4 against nothing. With utilities 0.01 apart nothing is chosen.
    /// Utilities above 1 exceed the range of the neurons: at 5 the winner's activity is 0.3 there, but 1 in exact maths.
    pub fn rule(
        mut self,
        name: impl Into<String>,
        utility: impl IntoFlow<Kind = Scalar>,
        routes: impl IntoIterator<Item = Route>,
    ) -> Self {
        self.rules.push(Rule::new(name, utility, routes));
        self
    }

    /// Sets the radius of the gates: the greatest norm of a pointer that passes unchanged (default 1).
    ///
    /// Anything but a finite number above 0 is a fault when the graph is built.
    pub fn radius(mut self, radius: Real) -> Self {
        self.gates.radius = radius;
        self
    }

    /// Replaces the synapse behind a gate, which constants and numbers have too (default 5 ms).
    pub fn synapse(mut self, synapse: Synapse) -> Self {
        self.gates.synapse = synapse;
        self
    }

    /// Sets the current that closes the gates, as a share (0 to 1) of the default, which silences every neuron for pointers
    /// of up to the radius. With less, a pointer far beyond the radius leaks through a closed gate. In direct mode all
    /// gates close. A number outside the range is a fault when the graph is built.
    pub fn inhibition(mut self, share: Real) -> Self {
        self.gates.inhibition = share;
        self
    }

    /// Adds the default: the rule that is chosen while no other utility exceeds `utility`.
    pub fn otherwise(
        self,
        name: impl Into<String>,
        utility: Real,
        routes: impl IntoIterator<Item = Route>,
    ) -> Self {
        self.rule(name, utility, routes)
    }
}

impl Module for Rules {
    type Ports = RulesPorts;

    fn expand(self, scope: &mut Scope<'_>) -> RulesPorts {
        let count = self.rules.len();
        if count == 0 {
            scope.refuse("there are no rules; expected at least one");
        }
        let choice = scope.add("choice", BasalGanglia::new(count.max(1)));
        let utilities = scope.node("utilities", Collected(count.max(1)));
        let all: Out<Vector> = utilities.output("out");
        scope.connect(&all, &choice.utilities, Synapse::None);
        let mut names: Vec<String> = Vec::new();
        for (index, rule) in self.rules.into_iter().enumerate() {
            let name = rule.name.clone();
            let taken = match name.as_str() {
                "choice" | "utilities" => "a part of every set of rules has this name",
                _ if names.contains(&name) => "another rule has this name",
                _ => "",
            };
            names.push(name.clone());
            if !taken.is_empty() {
                scope.refuse(format!("the rule `{name}`: {taken}; choose another name"));
                continue;
            }
            let lowered = LoweredRule {
                rule,
                index,
                count,
                utility: utilities.input(&format!("in{index}")),
                chosen: choice.chosen.clone(),
                gates: self.gates,
            };
            scope.add(&name, lowered);
        }
        RulesPorts {
            utilities: scope.output("utilities", all),
            chosen: scope.output("chosen", choice.chosen),
            names,
        }
    }
}

/// One rule inside its set.
struct LoweredRule {
    rule: Rule,
    index: usize,
    count: usize,
    utility: In<Scalar>,
    chosen: Out<Vector>,
    gates: Gates,
}

impl Module for LoweredRule {
    type Ports = ();

    fn expand(self, scope: &mut Scope<'_>) {
        let Self { rule, index, count, utility, chosen, gates } = self;
        let mut cx = Lowerer::new(scope, &rule.utility.text);
        let sum = (rule.utility.lower)(&mut cx, &());
        let own = cx.one(&(), sum);
        cx.connect(&own, &utility);
        if rule.routes.is_empty() {
            return;
        }
        let specs = (InputSpec::vector(count), OutputSpec::scalar());
        let map = Box::new(Slice { from: count, range: index..index + 1 });
        let by = cx.linear("chosen", &chosen, specs, map);
        let open = Opening { by, gates };
        for route in rule.routes {
            let name = scope.free_name(&route.name);
            scope.add(&name, Gated { route, open: open.clone() });
        }
    }
}

/// Collects so many numbers into a vector. Costs no tick.
struct Collected(usize);

impl Node for Collected {
    fn declare(&self, ports: &mut PortDecl) {
        for index in 0..self.0 {
            ports.input(&format!("in{index}"), InputSpec::scalar().optional());
        }
        ports.output("out", OutputSpec::vector(self.0));
    }

    fn fingerprint(&self, _hash: &mut Fingerprint) {}

    fn emit(&self, _cx: &StepCx<'_>, io: &mut EmitIo<'_>) {
        for (index, out) in io.outputs.get_mut(0).iter_mut().enumerate() {
            *out = io.inputs.get(index)[0];
        }
    }
}

/// A route that a rule opens.
struct Gated {
    route: Route,
    open: Opening,
}

impl Module for Gated {
    type Ports = ();

    fn expand(self, scope: &mut Scope<'_>) {
        self.route.lower(scope, Some(&self.open));
    }
}
