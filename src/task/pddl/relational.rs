//! Relational problems as PDDL.

use std::collections::{BTreeMap, BTreeSet};

use super::conditions::{At, Possible, Way};
use super::goals::{Counted, terms};
use super::{Names, WriteFault, Written};
use crate::plan::strips::{
    self, Action, Atom, Domain, Literal, MAX_ACTIONS, OBJECT, Predicate, Term, Typed, Types,
};
use crate::task::compile::{Move, Problem};
use crate::task::domain::{Fact, Frame, Situation};

/// Writes a relational problem with a situation and the problem's goal.
///
/// The objects of the scene are constants of the domain. Needs in `dropped`, pairs of operator and need, do not count; take
/// [`Problem::dropped`] or that of the ground problem. Goals that count objects are met by further actions: `finish` ends
/// the moves, and then one action counts each object.
///
/// Costs O(moves x states to leave x ways to meet the conditions).
///
/// # Errors
/// [`WriteFault`] if there are more than [`MAX_ACTIONS`] actions, or if it is not certain what an action changes.
///
/// # Panics
/// If `now` does not have one entry for each object of the problem.
pub fn of_relational(
    problem: &Problem<'_>,
    dropped: &[(usize, usize)],
    now: &Situation,
    name: &str,
) -> Result<Written, WriteFault> {
    let possible = Possible::new(problem, dropped.iter().copied().collect());
    let mut text = Text::new(problem);
    let terms = terms(&possible);
    let counted = terms.iter().any(|term| !term.each_certain());
    let (mut actions, mut moves) = (Vec::new(), Vec::new());
    for m in all_moves(&possible) {
        for from in &possible.facts[m.object] {
            let operator = &problem.domain().operators[m.operator];
            let same = from.state == operator.to && from.reference == m.reference;
            if same || !operator.from.contains(&from.state) {
                continue;
            }
            for way in possible.ways(&m, from, MAX_ACTIONS)? {
                if actions.len() >= MAX_ACTIONS {
                    return Err(WriteFault::TooLarge);
                }
                actions.push(text.action(&m, &way, counted));
                moves.push(Some(m));
            }
        }
    }
    let mut goal = Vec::new();
    if counted {
        actions.push(text.finish());
    }
    for (t, term) in terms.iter().enumerate() {
        if term.each_certain() {
            goal.extend(term.candidates.iter().flatten().map(|at| (true, text.fact(at))));
        } else {
            actions.extend(text.count(t, term));
            goal.push((
                true,
                strips::Fact { predicate: text.counter(t, term.least), arguments: Vec::new() },
            ));
        }
    }
    moves.resize(actions.len(), None);
    let mut init: Vec<strips::Fact> = Vec::new();
    for (i, fact) in now.iter().enumerate() {
        init.extend(fact.map(|fact| text.fact(&(i, fact))));
    }
    if counted {
        init.push(strips::Fact { predicate: text.moving.clone(), arguments: Vec::new() });
        let counted = terms.iter().enumerate().filter(|(_, term)| !term.each_certain());
        let zeros = counted.map(|(t, _)| text.counter(t, 0)).collect::<Vec<_>>();
        init.extend(
            zeros.into_iter().map(|predicate| strips::Fact { predicate, arguments: Vec::new() }),
        );
    }
    Ok(text.finished(name, actions, moves, (init, goal)))
}

/// Returns all moves of a problem, whatever the situation.
fn all_moves(possible: &Possible<'_>) -> Vec<Move> {
    let problem = possible.problem;
    let mut moves = Vec::new();
    for (operator, described) in problem.domain().operators.iter().enumerate() {
        for (object, facts) in possible.facts.iter().enumerate() {
            let to = facts.iter().filter(|fact| fact.state == described.to);
            moves.extend(to.map(|fact| Move {
                operator,
                object,
                reference: fact.reference,
                place: fact.place,
            }));
        }
    }
    moves
}

/// The names of a problem, and what is written with them.
struct Text<'p> {
    problem: &'p Problem<'p>,
    names: Names,
    calls: Names,
    types: Names,
    /// Type of each object.
    kinds: Vec<String>,
    objects: Vec<String>,
    /// Name of the predicate of each place of each state.
    places: Vec<Vec<String>>,
    moving: String,
    /// Predicates of the domain.
    predicates: Vec<Predicate>,
}

fn call(predicate: &str, arguments: &[&String], positive: bool) -> Literal {
    let arguments = arguments.iter().map(|name| Term::Constant((*name).clone())).collect();
    Literal { positive, atom: Atom { predicate: predicate.to_owned(), arguments } }
}

impl<'p> Text<'p> {
    fn new(problem: &'p Problem<'p>) -> Self {
        let mut names = Names::new();
        let domain = problem.domain();
        let states = domain.states.iter().map(|state| {
            let first = names.of(&state.name);
            let further = (1..state.places.len())
                .map(|place| names.fresh(&format!("{}-place-{}", state.name, place + 1)))
                .collect::<Vec<_>>();
            [vec![first], further].concat()
        });
        let places = states.collect();
        let objects: Vec<String> = problem.objects().iter().map(|o| names.of(&o.id)).collect();
        let mut types = Names::new();
        let own = problem.objects().iter().map(|o| &*o.kind);
        let described = domain.states.iter().flat_map(|s| [Some(s.kind.as_str()), s.frame.kind()]);
        let of_kinds: BTreeMap<&str, String> =
            own.chain(described.flatten()).map(|kind| (kind, types.of(kind))).collect();
        let kinds = problem.objects().iter().map(|o| of_kinds[&*o.kind].clone()).collect();
        let moving = names.fresh("moving");
        let mut text = Self {
            problem,
            names,
            calls: Names::new(),
            types,
            kinds,
            objects,
            places,
            moving,
            predicates: Vec::new(),
        };
        for (s, state) in domain.states.iter().enumerate() {
            let typed = |name: &str, kind: &str| Typed {
                name: name.to_owned(),
                types: vec![of_kinds[kind].clone()],
            };
            let mut parameters = vec![typed("?object", &state.kind)];
            if let Frame::Kind(kind) = &state.frame {
                parameters.push(typed("?reference", kind));
            }
            for name in &text.places[s] {
                text.predicates.push(Predicate {
                    name: name.clone(),
                    parameters: parameters.clone(),
                    of_type: false,
                });
            }
        }
        text
    }

    fn arguments(&self, (object, fact): &At) -> Vec<&String> {
        [Some(*object), fact.reference].into_iter().flatten().map(|i| &self.objects[i]).collect()
    }

    fn predicate(&self, fact: &Fact) -> &str {
        &self.places[fact.state][fact.place]
    }

    fn fact(&self, at: &At) -> strips::Fact {
        let arguments = self.arguments(at).into_iter().cloned().collect();
        strips::Fact { predicate: self.predicate(&at.1).to_owned(), arguments }
    }

    fn literal(&self, at: &At, positive: bool) -> Literal {
        call(self.predicate(&at.1), &self.arguments(at), positive)
    }

    fn action(&mut self, m: &Move, way: &Way, counted: bool) -> Action {
        let mut name = self.problem.domain().operators[m.operator].name.clone();
        for i in [Some(m.object), m.reference].into_iter().flatten() {
            name = format!("{name}_{}", self.objects[i]);
        }
        let literals = |list: &BTreeSet<At>, positive: bool| {
            list.iter().map(|at| self.literal(at, positive)).collect::<Vec<_>>()
        };
        let mut preconditions = literals(&way.holds, true);
        if counted {
            preconditions.push(call(&self.moving, &[], true));
        }
        preconditions.extend(literals(&way.lacks, false));
        let ends = way.ends.difference(&way.begins).copied().collect();
        let effects = [literals(&ends, false), literals(&way.begins, true)].concat();
        Action { name: self.calls.fresh(&name), preconditions, effects, ..Action::default() }
    }

    /// Returns the action that ends the moves.
    fn finish(&mut self) -> Action {
        let moving = self.moving.clone();
        self.predicates.push(Predicate { name: moving.clone(), ..Predicate::default() });
        Action {
            name: self.calls.fresh("finish"),
            preconditions: vec![call(&moving, &[], true)],
            effects: vec![call(&moving, &[], false)],
            ..Action::default()
        }
    }

    /// Returns the name of the predicate that says that at least so many objects were counted for a part of the goal.
    fn counter(&mut self, term: usize, count: usize) -> String {
        self.names.of(&format!("goal-{}-counted-{count}", term + 1))
    }

    /// Returns the actions that count objects for a part of the goal.
    fn count(&mut self, t: usize, term: &Counted) -> Vec<Action> {
        let counters: Vec<String> = (0..=term.least).map(|k| self.counter(t, k)).collect();
        let done = self.names.fresh(&format!("goal-{}-has", t + 1));
        let plain = |name: &String| Predicate { name: name.clone(), ..Predicate::default() };
        self.predicates.extend(counters.iter().map(plain));
        let any = Typed { name: "?object".into(), types: vec![OBJECT.into()] };
        self.predicates.push(Predicate {
            name: done.clone(),
            parameters: vec![any],
            of_type: false,
        });
        let mut actions = Vec::new();
        for pair in counters.windows(2) {
            for facts in &term.candidates {
                let object = self.objects[facts[0].0].clone();
                let name = self.calls.fresh(&format!("count_{object}"));
                let mut preconditions: Vec<Literal> =
                    facts.iter().map(|at| self.literal(at, true)).collect();
                preconditions.extend([
                    call(&pair[0], &[], true),
                    call(&self.moving, &[], false),
                    call(&done, &[&object], false),
                ]);
                let effects = vec![
                    call(&pair[0], &[], false),
                    call(&pair[1], &[], true),
                    call(&done, &[&object], true),
                ];
                actions.push(Action { name, preconditions, effects, ..Action::default() });
            }
        }
        actions
    }

    fn finished(
        mut self,
        name: &str,
        actions: Vec<Action>,
        moves: Vec<Option<Move>>,
        (init, goal): (Vec<strips::Fact>, Vec<(bool, strips::Fact)>),
    ) -> Written {
        let name = self.names.fresh(name);
        let types = self.types.names().map(str::to_owned);
        let types = types.map(|name| Typed { name, types: vec![OBJECT.into()] });
        let constants = self.objects.iter().zip(&self.kinds);
        let constants = constants
            .map(|(name, kind)| Typed { name: name.clone(), types: vec![kind.clone()] })
            .collect();
        let domain = Domain {
            name: name.clone(),
            requirements: [":strips", ":typing", ":negative-preconditions"]
                .map(str::to_owned)
                .into(),
            // Types without supertypes are in no circle.
            types: Types::new(types.collect()).unwrap_or_default(),
            constants,
            predicates: self.predicates,
            actions,
            ..Domain::default()
        };
        let problem = strips::Problem {
            name: format!("{name}-problem"),
            domain: name,
            objects: Vec::new(),
            init,
            goal,
            ..strips::Problem::default()
        };
        let mut renamed = self.names.renamed();
        renamed.extend(self.types.renamed());
        let notes = vec![
            "Facts say where an object is. An action has the name of its operator, the object that it moves and".into(),
            "the object at which it puts it; a number tells apart what it needs. Actions that count check the goal.".into(),
        ];
        Written { domain, problem, moves, renamed, notes }
    }
}
