//! Reads durative actions as actions without duration.
//!
//! What must hold at the start, over all, or at the end must hold before the action, unless the effects at its start make
//! it true. Where the effects at the end concern the same atoms as those at the start, they count.

use std::collections::HashSet;
use std::rc::Rc;

use super::conditions::Scope;
use super::lists::tail;
use super::pddl::{Action, Atom, Literal};
use super::sexpr::{Content, Node, PddlFault, short};

/// When a part of a durative action is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Time {
    Start,
    All,
    End,
}

/// Returns the time and the part of `(at start X)`, `(over all X)` and `(at end X)`.
fn timed(node: &Node) -> Option<(Time, &Node)> {
    let [word, inner] = tail(node) else { return None };
    inner.list()?;
    match (node.head()?, word.word()?) {
        ("at", "start") => Some((Time::Start, inner)),
        ("over", "all") => Some((Time::All, inner)),
        ("at", "end") => Some((Time::End, inner)),
        _ => None,
    }
}

/// Returns the node without times.
fn untimed(node: &Node) -> Node {
    match (timed(node), node.list()) {
        (Some((_, inner)), _) => untimed(inner),
        (None, Some(nodes)) => {
            let content = Content::List(nodes.iter().map(untimed).collect());
            Node { place: node.place, content }
        }
        (None, None) => node.clone(),
    }
}

/// Returns the first time that a node names.
fn time_of(node: &Node) -> Option<Time> {
    let own = timed(node).map(|(time, _)| time);
    own.or_else(|| node.list().into_iter().flatten().find_map(time_of))
}

/// Returns the parts of a conjunction with their times. A part without a time is at the end if `effect`, otherwise at the
/// start.
fn parts(node: &Node, effect: bool) -> Vec<(Time, Node)> {
    match (node.head(), timed(node)) {
        (_, Some((time, inner))) => vec![(time, untimed(inner))],
        (Some("and"), _) => tail(node).iter().flat_map(|part| parts(part, effect)).collect(),
        (Some("forall"), _) if tail(node).len() > 1 => {
            let (variables, body) = (&tail(node)[0], &tail(node)[1..]);
            let inner = body.iter().flat_map(|part| parts(part, effect));
            let word = |word: &str| Node { place: node.place, content: Content::Word(word.into()) };
            let quantified = |inner: Node| Node {
                place: node.place,
                content: Content::List(vec![word("forall"), variables.clone(), inner]),
            };
            inner.map(|(time, inner)| (time, quantified(inner))).collect()
        }
        (head, _) => {
            // The time of `(when (at start C) (at end E))` is that of the effect.
            let of = match head {
                Some("when") => tail(node).last().unwrap_or(node),
                _ => node,
            };
            let other = if effect { Time::End } else { Time::Start };
            vec![(time_of(of).unwrap_or(other), untimed(node))]
        }
    }
}

/// Returns the predicate of an effect at the start that one at the end may undo, if one of the two is under a condition.
///
/// Of instant effects, those that make true are the last.
fn undone<'a>(start: &'a Action, end: &'a Action) -> Option<&'a str> {
    let key =
        |literal: &'a Literal| (literal.atom.predicate.as_str(), literal.atom.arguments.len());
    let conditional = |action: &'a Action| action.conditional.iter().flat_map(|c| &c.effects);
    let falsified = |l: &&'a Literal| !l.positive;
    let perhaps: HashSet<_> = conditional(end).filter(falsified).map(key).collect();
    let surely: HashSet<_> = end.effects.iter().filter(falsified).map(key).collect();
    let early = start.effects.iter().map(|l| (l, false));
    let mut early = early.chain(conditional(start).map(|l| (l, true))).filter(|(l, _)| l.positive);
    let undone = early.find(|(l, conditional)| {
        perhaps.contains(&key(l)) || *conditional && surely.contains(&key(l))
    });
    undone.map(|(literal, _)| literal.atom.predicate.as_str())
}

impl Scope<'_> {
    /// Reads the duration, condition and effect of a durative action.
    pub fn durative(
        &mut self,
        action: &mut Action,
        [duration, condition, effect]: [Option<&Node>; 3],
    ) -> Result<(), PddlFault> {
        if let Some(node) = duration
            && let (Some("=" | "<=" | ">="), [_, value]) = (node.head(), tail(node))
        {
            // Only costs may name the duration, and a fault in it is theirs.
            self.duration = self.expression(value).ok().map(Rc::new);
        }
        let mut start = Action { parameters: action.parameters.clone(), ..Action::default() };
        let mut end = start.clone();
        for (time, part) in effect.map(|node| parts(node, true)).unwrap_or_default() {
            self.effects(&part, if time == Time::End { &mut end } else { &mut start })?;
        }
        let (early, mut known) = (start.effects.iter().collect::<HashSet<_>>(), HashSet::new());
        for (time, part) in condition.map(|node| parts(node, false)).unwrap_or_default() {
            let mut read = Action::default();
            self.preconditions(&part, &mut read)?;
            if time != Time::Start {
                // It holds since the start of the action.
                read.preconditions.retain(|literal| !early.contains(literal));
            }
            read.preconditions.retain(|literal| known.insert(literal.clone()));
            action.preconditions.extend(read.preconditions);
            action.conditions.extend(read.conditions);
        }
        let late: HashSet<&Atom> = end.effects.iter().map(|late| &late.atom).collect();
        start.effects.retain(|early| !late.contains(&early.atom));
        if let (Some(node), Some(name)) = (effect, undone(&start, &end)) {
            let problem = format!(
                "effects at the start and at the end of `{}` on `{}` under conditions cannot be read as instant",
                short(&action.name),
                short(name)
            );
            let expected = "effects on it without conditions, or at one time";
            return Err(self.source.fault(node.place, problem, expected));
        }
        action.effects = [start.effects, end.effects].concat();
        action.conditional = [start.conditional, end.conditional].concat();
        action.increases = [start.increases, end.increases].concat();
        Ok(())
    }
}
