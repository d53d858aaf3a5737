//! Reads conditions and effects.

use std::cell::RefCell;
use std::collections::{BTreeSet, HashMap};
use std::rc::Rc;

use super::formula::{Comparison, Condition, ConditionalEffect, Expression, not};
use super::lists::{MAX_NAMES, tail};
use super::numbers::Numbers;
use super::pddl::{Action, Atom, Domain, EQUAL, Literal, Term, Typed};
use super::sexpr::{Node, PddlFault, Source, short};
use crate::sim::{meant, nearest_first};

/// Conditions on trajectories, which PDDL 3 has.
const MODAL: [&str; 9] = [
    "always",
    "sometime",
    "within",
    "at-most-once",
    "sometime-after",
    "sometime-before",
    "always-within",
    "hold-during",
    "hold-after",
];

/// Greatest number of parts of all conditions and expressions of an action that are written once and stand in several
/// places.
pub(super) const MAX_COPIED: usize = 200_000;

/// What is around an effect.
#[derive(Clone)]
struct Under {
    /// Number of variables that are not quantified.
    own: usize,
    conditions: Vec<Rc<Condition>>,
    /// The conditional effect that further literals belong to.
    open: Option<usize>,
}

/// The names that a condition or effect may use.
pub(super) struct Scope<'a> {
    pub source: Source<'a>,
    pub domain: &'a Domain,
    /// Types of the constants and objects.
    objects: &'a HashMap<String, Vec<String>>,
    /// Parameters and quantified variables, from the outermost.
    pub variables: Vec<Typed>,
    /// The value of `?duration`.
    pub duration: Option<Rc<Expression>>,
    pub numbers: &'a RefCell<Numbers>,
    /// Types that are used as predicates.
    kinds: &'a mut BTreeSet<String>,
    /// Number of parts of the conditions of effects, and of the durations in expressions.
    pub copied: usize,
    /// Number of preferences that were left out.
    preferences: usize,
}

impl<'a> Scope<'a> {
    pub fn new(
        source: Source<'a>,
        domain: &'a Domain,
        objects: &'a HashMap<String, Vec<String>>,
        numbers: &'a RefCell<Numbers>,
        kinds: &'a mut BTreeSet<String>,
    ) -> Self {
        Self {
            source,
            domain,
            objects,
            variables: Vec::new(),
            duration: None,
            numbers,
            kinds,
            copied: 0,
            preferences: 0,
        }
    }

    /// Reads the precondition of an action.
    pub fn preconditions(&mut self, node: &Node, action: &mut Action) -> Result<(), PddlFault> {
        let condition = self.condition(node)?;
        split(condition, &mut |literal| action.preconditions.push(literal), &mut action.conditions);
        Ok(())
    }

    /// Reads a condition.
    pub fn condition(&mut self, node: &Node) -> Result<Condition, PddlFault> {
        let rest = tail(node);
        let head = match (node.list(), node.head()) {
            (Some([]), _) => return Ok(Condition::All(Vec::new())),
            (_, head) => head.unwrap_or_default(),
        };
        let known = self.domain.predicate(head).is_some();
        // Some domains have a predicate `<` of their own.
        let of_objects = |left, right| self.is_object(left) && self.is_object(right);
        if let (Some(comparison), [left, right]) = (Comparison::of(head), rest)
            && !((known || head == EQUAL) && of_objects(left, right))
        {
            return self.compare(comparison, left, right);
        }
        match (head, rest) {
            ("and", _) => {
                let parts = rest.iter().map(|part| self.condition(part));
                Ok(Condition::All(parts.collect::<Result<_, _>>()?))
            }
            ("or", _) => Ok(Condition::Any(self.each_hard(rest)?)),
            ("not", [inner]) => Ok(not(self.hard(inner)?)),
            ("imply", [from, to]) => {
                let from = self.hard(from)?;
                Ok(Condition::Any(vec![not(from), self.hard(to)?]))
            }
            ("preference", [inner] | [_, inner]) if !known => {
                self.condition(inner)?;
                if self.preferences == 0 {
                    let what = "preferences are left out: a plan need not meet them";
                    self.source.warn(node.place, what);
                }
                self.preferences += 1;
                Ok(Condition::All(Vec::new()))
            }
            ("exists" | "forall", [variables, body @ ..]) if !body.is_empty() => {
                let depth = self.quantify(variables)?;
                let inner = match (head, body) {
                    ("forall", [inner]) => self.condition(inner),
                    (_, [inner]) => self.hard(inner),
                    // Some leave out the `and`.
                    (_, several) => self.each_hard(several).map(Condition::All),
                };
                let variables = self.variables.split_off(depth);
                let inner = Box::new(inner?);
                Ok(match head {
                    "exists" => Condition::Exists(variables, inner),
                    _ => Condition::Forall(variables, inner),
                })
            }
            ("not" | "imply" | "exists" | "forall", _) => {
                let expected = match head {
                    "not" => "(not CONDITION)",
                    "imply" => "(imply CONDITION CONDITION)",
                    _ => "(forall (?VARIABLE - TYPE ...) CONDITION)",
                };
                Err(self.source.unexpected(node, "complete condition", expected))
            }
            ("when", _) if !known => {
                let expected = "(imply CONDITION CONDITION)";
                Err(self.source.unexpected(node, "condition: `when` is for effects", expected))
            }
            (modal, _) if !known && MODAL.contains(&modal) => {
                let problem = format!(
                    "`({modal} ...)` is a constraint on the states along a plan, which this planner does not have"
                );
                Err(self.source.fault(node.place, problem, "conditions on one state"))
            }
            _ => Ok(Condition::Literal(self.atom(node, true)?)),
        }
    }

    /// Reads a condition without preferences. Left out, they would mean that it always holds, or never.
    pub fn hard(&mut self, node: &Node) -> Result<Condition, PddlFault> {
        let before = self.preferences;
        let condition = self.condition(node)?;
        if self.preferences > before {
            let problem = "a preference stands where it would decide whether something else holds";
            let expected =
                "preferences in preconditions and goals, alone, in (and ...) or in (forall ...)";
            return Err(self.source.fault(node.place, problem, expected));
        }
        Ok(condition)
    }

    /// Returns whether a node names an object or a variable, and no number.
    fn is_object(&self, node: &Node) -> bool {
        let named = |word: &str| self.objects.contains_key(word) || word.parse::<f64>().is_err();
        node.word().is_some_and(|word| named(word) && word != "?duration")
    }

    fn each_hard(&mut self, nodes: &[Node]) -> Result<Vec<Condition>, PddlFault> {
        nodes.iter().map(|node| self.hard(node)).collect()
    }

    /// Adds the variables of a quantifier. Returns how many there were before.
    fn quantify(&mut self, node: &Node) -> Result<usize, PddlFault> {
        let Some(nodes) = node.list() else {
            return Err(self.source.unexpected(
                node,
                "list of variables",
                "(?VARIABLE - TYPE ...)",
            ));
        };
        let variables = self.source.variables(nodes, &self.domain.types, false)?;
        let depth = self.variables.len();
        self.variables.extend(variables);
        if self.variables.len() > MAX_NAMES {
            let expected = format!("at most {MAX_NAMES}, with those around it");
            return Err(self.source.fault(node.place, "there are too many variables", expected));
        }
        Ok(depth)
    }

    /// Reads an atom. Only conditions may compare objects.
    fn atom(&mut self, node: &Node, condition: bool) -> Result<Literal, PddlFault> {
        let Some(name) = node.head() else {
            let expected = match node.list() {
                Some([_, _, ..]) => "(and (PREDICATE ...) ...) around several",
                _ => "(PREDICATE ...) or (not (PREDICATE ...))",
            };
            return Err(self.source.unexpected(node, "literal", expected));
        };
        let nodes = tail(node);
        let domain = self.domain;
        if name == "not" && domain.predicate(name).is_none() {
            let problem = format!("`(not ...)` has {} parts", nodes.len());
            return Err(self.source.fault(node.place, problem, "one, as (not (PREDICATE ...))"));
        }
        let kind = condition && nodes.len() == 1 && domain.predicate(name).is_none();
        let wanted: Option<&[Typed]> = if name == EQUAL && condition {
            if nodes.len() != 2 {
                return Err(self.source.arity(node, nodes.len(), 2));
            }
            None
        } else if kind && domain.types.contains(name) {
            self.source
                .warn(node.place, format!("the type `{}` is used as a predicate", short(name)));
            self.kinds.insert(name.to_owned());
            None
        } else {
            let index = self.source.applied(node, domain)?;
            Some(&domain.predicates[index].parameters)
        };
        let arguments = self.terms(nodes, wanted)?;
        Ok(Literal { positive: true, atom: Atom { predicate: name.to_owned(), arguments } })
    }

    /// Reads variables and objects, and checks their types.
    pub fn terms(&self, nodes: &[Node], wanted: Option<&[Typed]>) -> Result<Vec<Term>, PddlFault> {
        let mut terms = Vec::new();
        for (index, argument) in nodes.iter().enumerate() {
            let word = self.source.word(argument, "argument")?;
            // The innermost variable of a name counts.
            let variable = self.variables.iter().rposition(|p| p.name == word);
            let (term, kinds) = match (variable, self.objects.get(word)) {
                (Some(position), _) => (Term::Parameter(position), &self.variables[position].types),
                (None, Some(types)) => (Term::Constant(word.to_owned()), types),
                (None, None) => return Err(self.unknown(argument, word)),
            };
            if let Some(wanted) = wanted.and_then(|wanted| wanted.get(index)) {
                self.source.fitting(argument, kinds, &wanted.types, &self.domain.types)?;
            }
            terms.push(term);
        }
        Ok(terms)
    }

    fn unknown(&self, node: &Node, word: &str) -> PddlFault {
        if self.variables.is_empty() {
            return self.source.no_object(node, word, self.objects);
        }
        let mut objects: Vec<&str> = self.objects.keys().map(String::as_str).collect();
        objects.sort_unstable();
        let variables = self.variables.iter().map(|v| v.name.as_str());
        let named: Vec<&str> = variables.chain(objects).collect();
        let near = meant(word, named.iter().copied());
        let expected = format!("one of: {}{near}", nearest_first(word, named));
        self.source.unexpected(node, "parameter or constant", &expected)
    }

    /// Reads the effect of an action.
    pub fn effects(&mut self, node: &Node, action: &mut Action) -> Result<(), PddlFault> {
        let under = &mut Under { own: self.variables.len(), conditions: Vec::new(), open: None };
        self.effect(node, under, action)
    }

    fn effect(
        &mut self,
        node: &Node,
        under: &mut Under,
        action: &mut Action,
    ) -> Result<(), PddlFault> {
        let rest = tail(node);
        let head = match (node.list(), node.head()) {
            (Some([]), _) => return Ok(()),
            (_, head) => head.unwrap_or_default(),
        };
        let known = self.domain.predicate(head).is_some();
        match (head, rest) {
            ("and", _) => rest.iter().try_for_each(|part| self.effect(part, under, action)),
            ("forall", [variables, body @ ..]) if !body.is_empty() => {
                let depth = self.quantify(variables)?;
                let mut under = Under { open: None, ..under.clone() };
                let mut parts = body.iter();
                let read = parts.try_for_each(|part| self.effect(part, &mut under, action));
                self.variables.truncate(depth);
                read
            }
            ("when", [condition, effect]) => {
                let condition = self.hard(condition)?;
                let mut under = Under { open: None, ..under.clone() };
                under.conditions.push(Rc::new(condition));
                self.effect(effect, &mut under, action)
            }
            ("forall" | "when", _) => {
                let expected = "(when CONDITION EFFECT) or (forall (?VARIABLE - TYPE ...) EFFECT)";
                Err(self.source.unexpected(node, "complete effect", expected))
            }
            (
                "increase" | "decrease" | "assign" | "scale-up" | "scale-down",
                [function, amount],
            ) if !known => {
                let alone = under.conditions.is_empty() && self.variables.len() == under.own;
                self.change(node, [function, amount], alone, action)
            }
            ("probabilistic" | "oneof" | "unknown" | "or" | "exists" | "imply", _) if !known => {
                let problem = format!(
                    "`({head} ...)` makes the effect uncertain, and this planner needs effects that are certain"
                );
                Err(self.source.fault(
                    node.place,
                    problem,
                    "(PREDICATE ...), (not (PREDICATE ...)) or (when CONDITION EFFECT)",
                ))
            }
            _ => self.literal_effect(node, under, action),
        }
    }

    fn literal_effect(
        &mut self,
        node: &Node,
        under: &mut Under,
        action: &mut Action,
    ) -> Result<(), PddlFault> {
        let (positive, node) = match (node.head(), tail(node)) {
            (Some("not"), [inner]) => (false, inner),
            _ => (true, node),
        };
        let literal = Literal { positive, ..self.atom(node, false)? };
        let (name, arguments) = (&literal.atom.predicate, literal.atom.arguments.len());
        let rule = |d: &super::Derived| d.predicate == *name && d.parameters.len() == arguments;
        if self.domain.derived.iter().any(rule) {
            let problem = format!("an action changes the derived predicate `{}`", short(name));
            return Err(self.source.fault(node.place, problem, "an effect on another predicate"));
        }
        if under.conditions.is_empty() && self.variables.len() == under.own {
            action.effects.push(literal);
            return Ok(());
        }
        if let Some(open) = under.open {
            action.conditional[open].effects.push(literal);
            return Ok(());
        }
        let size: usize = under.conditions.iter().map(|condition| condition.size()).sum();
        self.copy(
            node,
            size + self.variables.len() - under.own,
            "the conditional effects are too large",
        )?;
        let mut conditions: Vec<Condition> =
            under.conditions.iter().map(|condition| Condition::clone(condition)).collect();
        let condition = match conditions.len() {
            1 => conditions.swap_remove(0),
            _ => Condition::All(conditions),
        };
        under.open = Some(action.conditional.len());
        let (variables, effects) = (self.variables[under.own..].to_vec(), vec![literal]);
        action.conditional.push(ConditionalEffect { variables, condition, effects });
        Ok(())
    }

    /// Counts the parts of what stands in a further place. Refuses too many.
    pub fn copy(&mut self, node: &Node, size: usize, problem: &str) -> Result<(), PddlFault> {
        self.copied += size;
        if self.copied <= MAX_COPIED {
            return Ok(());
        }
        let expected = format!("at most {MAX_COPIED} parts of conditions and expressions");
        Err(self.source.fault(node.place, problem, expected))
    }
}

/// Splits a conjunction into its literals and other conditions.
pub(super) fn split(
    condition: Condition,
    literal: &mut impl FnMut(Literal),
    others: &mut Vec<Condition>,
) {
    match condition {
        Condition::Literal(l) => literal(l),
        Condition::All(parts) => parts.into_iter().for_each(|part| split(part, literal, others)),
        other => others.push(other),
    }
}
