//! Trajectories: the states and actions of one run each.
//!
//! Two notations are read, those of SAM's library and of AMLGym:
//!
//! ```text
//! ((:objects a b - block) (:init (clear a) ...) (operator: (pick-up a)) (:state (holding a) ...) ...)
//! (:trajectory (:state (clear a) ...) (:action (pick-up a)) (:state (holding a) ...) ...)
//! ```
//!
//! States list all facts that hold. `(:objects ...)` may be missing: an object then has the types of the places where it
//! is used. `(:transition_status (failure))` after an action marks it as refused. Numeric fluents `(= (...) NUMBER)` and
//! negated facts are skipped.

use std::collections::{BTreeMap, BTreeSet};

use super::lists::tail;
use super::pddl::{Domain, EQUAL};
use super::sexpr::{Node, Notes, PddlFault, Place, Source};

/// A predicate applied to objects of a trajectory.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct GroundAtom {
    /// Position of the predicate in the domain.
    pub predicate: usize,
    /// Positions of the objects in the trajectory.
    pub arguments: Vec<usize>,
}

/// An object of a trajectory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TraceObject {
    /// Name, in lower case.
    pub name: String,
    /// The types that the object is known to have, each as alternatives of an `(either ...)`: the declared type, or one
    /// for each place where the object is used.
    pub types: Vec<Vec<String>>,
}

/// An action of a trajectory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Step {
    /// Position of the action in the domain.
    pub action: usize,
    /// Positions of the objects in the trajectory.
    pub arguments: Vec<usize>,
    /// Whether the action was done. A refused action proves that one of its preconditions did not hold.
    pub succeeded: bool,
}

/// The states and actions of one run. Before and after each action there is a state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Trajectory {
    /// Objects. The constants of the domain come first.
    pub objects: Vec<TraceObject>,
    /// The facts of each state.
    pub states: Vec<BTreeSet<GroundAtom>>,
    /// The actions. Action `i` leads from state `i` to state `i + 1`.
    pub steps: Vec<Step>,
}

impl Trajectory {
    /// Reads all trajectories of a text. `file` names the text in errors.
    ///
    /// # Errors
    /// The first fault, with its place, what was found and what was expected.
    pub fn parse(bytes: &[u8], file: &str, domain: &Domain) -> Result<Vec<Self>, PddlFault> {
        let notes = Notes::default();
        let source = Source { file, notes: &notes };
        let nodes = source.nodes(bytes)?;
        if nodes.is_empty() {
            let place = Place { line: 1, column: 1 };
            let expected = "(:trajectory (:state ...) (:action (...)) (:state ...) ...)";
            return Err(source.fault(place, "the text has no trajectory", expected));
        }
        nodes.iter().map(|node| TraceReader::new(source, domain).read(node)).collect()
    }

    /// Returns whether an object is known to be of one of the types `wanted`.
    pub(crate) fn object_is(&self, domain: &Domain, object: usize, wanted: &[String]) -> bool {
        self.objects[object].types.iter().any(|types| domain.types.fits(types, wanted))
    }
}

/// Greatest number of different lists of types that the places of an undeclared object may want.
const MAX_USES: usize = 100;

struct TraceReader<'a> {
    source: Source<'a>,
    domain: &'a Domain,
    trajectory: Trajectory,
    ids: BTreeMap<String, usize>,
    declared: bool,
}

impl<'a> TraceReader<'a> {
    fn new(source: Source<'a>, domain: &'a Domain) -> Self {
        let objects: Vec<TraceObject> = domain
            .constants
            .iter()
            .map(|c| TraceObject { name: c.name.clone(), types: vec![c.types.clone()] })
            .collect();
        let ids = objects.iter().enumerate().map(|(i, o)| (o.name.clone(), i)).collect();
        let trajectory = Trajectory { objects, states: Vec::new(), steps: Vec::new() };
        Self { source, domain, trajectory, ids, declared: false }
    }

    fn read(mut self, node: &Node) -> Result<Trajectory, PddlFault> {
        let Some(nodes) = node.list() else {
            let expected = "a list with states and actions";
            return Err(self.source.unexpected(node, "trajectory", expected));
        };
        let named = nodes.first().and_then(Node::word).is_some();
        let entries = if named { &nodes[1..] } else { nodes };
        for entry in entries {
            self.entry(entry)?;
        }
        if self.trajectory.states.len() != self.trajectory.steps.len() + 1 {
            let problem = match self.trajectory.states.is_empty() {
                true => "the trajectory has no state",
                false => "the trajectory ends with an action",
            };
            return Err(self.source.fault(node.place, problem, "(:state ...)"));
        }
        Ok(self.trajectory)
    }

    fn entry(&mut self, entry: &Node) -> Result<(), PddlFault> {
        let between = self.trajectory.states.len() == self.trajectory.steps.len();
        match entry.head() {
            Some(":objects") => self.objects(entry),
            Some(":init" | ":state") if between => self.state(entry),
            Some("operator:" | ":operator" | ":action") if !between => self.step(entry),
            Some(":transition_status") if between => self.status(entry),
            _ => {
                let expected = match between {
                    true => "(:state ...)",
                    false => "(:action (...)) or (operator: (...))",
                };
                Err(self.source.unexpected(entry, "next entry of the trajectory", expected))
            }
        }
    }

    fn objects(&mut self, entry: &Node) -> Result<(), PddlFault> {
        self.declared = true;
        for (place, typed) in self.source.typed(tail(entry), &self.domain.types)? {
            if self.ids.contains_key(&typed.name) {
                // Some programs list the constants of the domain again.
                if self.domain.constants.iter().any(|c| c.name == typed.name) {
                    continue;
                }
                let expected = "one declaration of each object";
                return Err(self.source.twice(place, "object", &typed.name, expected));
            }
            self.ids.insert(typed.name.clone(), self.trajectory.objects.len());
            let types = vec![typed.types];
            self.trajectory.objects.push(TraceObject { name: typed.name, types });
        }
        Ok(())
    }

    fn state(&mut self, entry: &Node) -> Result<(), PddlFault> {
        let mut facts = BTreeSet::new();
        for node in tail(entry) {
            let negated = node.head() == Some("not");
            let fluent = node.head() == Some(EQUAL)
                && tail(node).first().is_some_and(|first| first.list().is_some());
            if negated || fluent {
                continue;
            }
            let predicate = self.source.applied(node, self.domain)?;
            let domain = self.domain;
            let wanted = domain.predicates[predicate].parameters.iter().map(|p| &p.types);
            let arguments = self.arguments(tail(node), wanted)?;
            facts.insert(GroundAtom { predicate, arguments });
        }
        self.trajectory.states.push(facts);
        Ok(())
    }

    fn step(&mut self, entry: &Node) -> Result<(), PddlFault> {
        let [call] = tail(entry) else {
            return Err(self.source.unexpected(entry, "action", "(:action (NAME OBJECT ...))"));
        };
        let action = self.source.called(call, self.domain)?;
        let domain = self.domain;
        let wanted = domain.actions[action].parameters.iter().map(|p| &p.types);
        let arguments = self.arguments(tail(call), wanted)?;
        self.trajectory.steps.push(Step { action, arguments, succeeded: true });
        Ok(())
    }

    fn status(&mut self, entry: &Node) -> Result<(), PddlFault> {
        let word = match tail(entry) {
            [node] => node.word().or_else(|| node.head()),
            _ => None,
        };
        let succeeded = match word {
            Some("success") => true,
            Some("failure") => false,
            _ => {
                let expected = "(success) or (failure)";
                return Err(self.source.unexpected(entry, "status of an action", expected));
            }
        };
        if let Some(step) = self.trajectory.steps.last_mut() {
            step.succeeded = succeeded;
        }
        Ok(())
    }

    /// Returns the objects with these names. Without `(:objects ...)`, new names are new objects.
    fn arguments<'t>(
        &mut self,
        nodes: &[Node],
        wanted: impl Iterator<Item = &'t Vec<String>>,
    ) -> Result<Vec<usize>, PddlFault> {
        let mut arguments = Vec::with_capacity(nodes.len());
        for (node, wanted) in nodes.iter().zip(wanted) {
            let word = self.source.word(node, "object")?;
            let id = match self.ids.get(word) {
                Some(id) => *id,
                None if self.declared => {
                    let expected = "an object of :objects or a constant of the domain";
                    return Err(self.source.unexpected(node, "object", expected));
                }
                None => {
                    let id = self.trajectory.objects.len();
                    self.ids.insert(word.to_owned(), id);
                    let object = TraceObject { name: word.to_owned(), types: Vec::new() };
                    self.trajectory.objects.push(object);
                    id
                }
            };
            let types = &mut self.trajectory.objects[id].types;
            if self.declared || id < self.domain.constants.len() {
                if !types.iter().any(|types| self.domain.types.fits(types, wanted)) {
                    let types: Vec<String> = types.iter().map(|t| t.join(" or ")).collect();
                    let problem = format!("{} is of type {}", node.shown(), types.join(", "));
                    return Err(self.source.fault(node.place, problem, wanted.join(" or ")));
                }
            } else if !types.contains(wanted) {
                if types.len() == MAX_USES {
                    let problem = format!("{} is used where other types are wanted", node.shown());
                    let expected = format!("at most {MAX_USES} different lists of types");
                    return Err(self.source.fault(node.place, problem, expected));
                }
                types.push(wanted.clone());
            }
            arguments.push(id);
        }
        Ok(arguments)
    }
}
