//! Domains and problems in memory, and the atoms that both consist of.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use super::formula::{Condition, ConditionalEffect, Derived, Function, Increase, Number};

/// Name of the type that every other type belongs to.
pub const OBJECT: &str = "object";

/// Name of the predicate that compares two terms.
pub const EQUAL: &str = "=";

/// A typed name: a parameter, an object, a constant, or a type with its supertypes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Typed {
    /// Name, in lower case. The name of a parameter includes its question mark.
    pub name: String,
    /// Names of the types. More than one stands for `(either ...)`. Never empty.
    pub types: Vec<String>,
}

/// The hierarchy of types.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Types {
    declared: Vec<Typed>,
    /// Every supertype of each declared type, the type itself and `object` included.
    above: BTreeMap<String, BTreeSet<String>>,
}

impl Types {
    /// Builds the hierarchy from declared types and their supertypes. A supertype that is not declared itself is added.
    /// A type that is declared twice has all supertypes of both declarations. That a type is its own direct supertype says
    /// nothing.
    ///
    /// # Errors
    /// The name of a type that would be its own supertype.
    pub fn new(mut declared: Vec<Typed>) -> Result<Self, String> {
        for typed in &mut declared {
            typed.types.retain(|above| *above != typed.name);
            if typed.types.is_empty() {
                typed.types.push(OBJECT.into());
            }
        }
        declared.retain(|typed| typed.name != OBJECT || typed.types != [OBJECT]);
        let mut parents: BTreeMap<String, Vec<String>> = BTreeMap::new();
        for typed in &declared {
            parents.entry(typed.name.clone()).or_default().extend(typed.types.iter().cloned());
        }
        for parent in declared.iter().flat_map(|t| t.types.clone()).collect::<Vec<_>>() {
            if parent != OBJECT && !parents.contains_key(&parent) {
                parents.insert(parent.clone(), vec![OBJECT.into()]);
                declared.push(Typed { name: parent, types: vec![OBJECT.into()] });
            }
        }
        let mut above = BTreeMap::new();
        for (name, direct) in &parents {
            let mut found = BTreeSet::from([OBJECT.to_owned()]);
            let mut open: Vec<&String> = direct.iter().collect();
            while let Some(next) = open.pop() {
                if next == name && next != OBJECT {
                    return Err(next.clone());
                }
                if found.insert(next.clone()) {
                    open.extend(parents.get(next).into_iter().flatten());
                }
            }
            found.insert(name.clone());
            above.insert(name.clone(), found);
        }
        Ok(Self { declared, above })
    }

    /// Returns the declared types with their direct supertypes, in the order of declaration.
    pub fn declared(&self) -> &[Typed] {
        &self.declared
    }

    /// Returns whether a type is declared. `object` always is.
    pub fn contains(&self, name: &str) -> bool {
        name == OBJECT || self.above.contains_key(name)
    }

    /// Returns whether every `kind` is a `wanted`: they are equal or `wanted` is a supertype.
    fn is_a(&self, kind: &str, wanted: &str) -> bool {
        kind == wanted
            || wanted == OBJECT
            || self.above.get(kind).is_some_and(|a| a.contains(wanted))
    }

    /// Returns whether a term of any of the types `kinds` may stand where one of the types `wanted` is expected.
    pub fn fits(&self, kinds: &[String], wanted: &[String]) -> bool {
        kinds.iter().all(|kind| wanted.iter().any(|wanted| self.is_a(kind, wanted)))
    }

    /// Returns whether an object of the types `kinds`, one of which it has, may be one of the types `wanted`.
    pub fn may_be(&self, kinds: &[String], wanted: &[String]) -> bool {
        kinds.iter().any(|kind| wanted.iter().any(|wanted| self.is_a(kind, wanted)))
    }

    /// Returns whether an object can be of one of the types `kinds` and of one of the types `wanted`.
    pub(super) fn overlap(&self, kinds: &[String], wanted: &[String]) -> bool {
        let both = |below: &str| {
            let one_of = |types: &[String]| types.iter().any(|above| self.is_a(below, above));
            one_of(kinds) && one_of(wanted)
        };
        kinds.iter().chain(wanted).any(|kind| both(kind))
            || self.above.keys().any(|kind| both(kind))
    }
}

/// A predicate and the types of its arguments.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Predicate {
    /// Name, in lower case.
    pub name: String,
    /// Parameters, in order.
    pub parameters: Vec<Typed>,
    /// Whether the predicate is not declared, but the name of a type, and holds for the objects of that type.
    pub of_type: bool,
}

/// An argument of an atom in an action.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Term {
    /// Parameter of the action, as its position.
    Parameter(usize),
    /// Constant of the domain, as its name.
    Constant(String),
}

/// A predicate applied to terms.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Atom {
    /// Name of the predicate, or [`EQUAL`].
    pub predicate: String,
    /// Arguments, in order.
    pub arguments: Vec<Term>,
}

/// An atom or its negation.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Literal {
    /// Whether the atom is required or made true; otherwise false.
    pub positive: bool,
    /// The atom.
    pub atom: Atom,
}

/// An action schema.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Action {
    /// Name, in lower case.
    pub name: String,
    /// Parameters, in order.
    pub parameters: Vec<Typed>,
    /// Conjunction of literals that must hold before the action.
    pub preconditions: Vec<Literal>,
    /// Further conditions that must hold before the action.
    pub conditions: Vec<Condition>,
    /// Literals that the action makes true (positive) or false (negative). Atoms made false come first if an atom is in
    /// both lists, so that it is true afterwards.
    pub effects: Vec<Literal>,
    /// Effects under a condition or for all objects of a type.
    pub conditional: Vec<ConditionalEffect>,
    /// Comments that are printed above the action. They are not read.
    pub comments: Vec<String>,
    /// Functions that the action increases. Those that the problem minimises are its cost.
    pub increases: Vec<Increase>,
}

impl Action {
    /// Adds a condition that must hold before the action, if it is new.
    pub(crate) fn require(&mut self, condition: Condition) {
        match condition {
            Condition::All(parts) => parts.into_iter().for_each(|part| self.require(part)),
            Condition::Literal(l) if self.preconditions.contains(&l) => {}
            Condition::Literal(l) => self.preconditions.push(l),
            other if self.conditions.contains(&other) => {}
            other => self.conditions.push(other),
        }
    }
}

/// A planning domain.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Domain {
    /// Name, in lower case.
    pub name: String,
    /// Requirements with their colon, such as `:typing`.
    pub requirements: Vec<String>,
    /// The hierarchy of types.
    pub types: Types,
    /// Objects that every problem has.
    pub constants: Vec<Typed>,
    /// Predicates, in the order of declaration. Several have the same name if their numbers of arguments differ.
    pub predicates: Vec<Predicate>,
    /// Numeric functions.
    pub functions: Vec<Function>,
    /// Rules for derived predicates, each after those of the predicates in its condition that do not need its own. A
    /// predicate may need itself, but not its opposite. No action changes a derived predicate.
    pub derived: Vec<Derived>,
    /// Action schemas, in the order of declaration.
    pub actions: Vec<Action>,
    /// Whether durative actions were read as instant ones: what needs actions that go on at the same time is out of reach.
    pub instant: bool,
    /// Comments that are printed first. They are not read.
    pub comments: Vec<String>,
    /// What the text has that is sloppy or that is ignored, a sentence each.
    pub warnings: Vec<String>,
}

impl Domain {
    /// Returns the position of a predicate.
    pub fn predicate(&self, name: &str) -> Option<usize> {
        self.predicates.iter().position(|p| p.name == name)
    }

    /// Returns the position of the predicate with a name and a number of arguments.
    pub fn predicate_of(&self, name: &str, arguments: usize) -> Option<usize> {
        self.predicates.iter().position(|p| p.name == name && p.parameters.len() == arguments)
    }

    /// Returns the position of an action.
    pub fn action(&self, name: &str) -> Option<usize> {
        self.actions.iter().position(|a| a.name == name)
    }

    /// Returns whether preconditions may be negative: the domain requires `:negative-preconditions` or `:adl`.
    pub(crate) fn allows_negative_preconditions(&self) -> bool {
        self.requirements.iter().any(|r| r == ":negative-preconditions" || r == ":adl")
    }
}

/// An atom over objects.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Fact {
    /// Name of the predicate.
    pub predicate: String,
    /// Names of the objects, in order.
    pub arguments: Vec<String>,
}

/// A planning problem of a domain.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Problem {
    /// Name, in lower case.
    pub name: String,
    /// Name of the domain.
    pub domain: String,
    /// Requirements with their colon, such as `:universal-preconditions` for the goal.
    pub requirements: Vec<String>,
    /// Objects, without the constants of the domain, except those of a narrower type in this problem.
    pub objects: Vec<Typed>,
    /// Facts that hold at first. All others do not.
    pub init: Vec<Fact>,
    /// Facts that must hold (`true`) or must not hold (`false`) at the end.
    pub goal: Vec<(bool, Fact)>,
    /// Further conditions that must hold at the end.
    pub conditions: Vec<Condition>,
    /// Values of functions at first.
    pub numbers: Vec<(Fact, Number)>,
    /// The function that is to be minimised, the plan's cost: that of `:metric`, or `(total-cost)` if an action increases it.
    pub metric: Option<Fact>,
    /// Comments that are printed first. They are not read.
    pub comments: Vec<String>,
    /// What the text has that is sloppy or that is ignored, a sentence each.
    pub warnings: Vec<String>,
}

impl Problem {
    /// Returns the constants of the domain, with their types in this problem, and the other objects.
    pub fn all_objects<'a>(&'a self, domain: &'a Domain) -> Vec<&'a Typed> {
        let own: HashMap<&str, &Typed> = self.objects.iter().map(|o| (&*o.name, o)).collect();
        let constants: HashSet<&str> = domain.constants.iter().map(|c| &*c.name).collect();
        let narrowed = domain.constants.iter().map(|c| own.get(&*c.name).copied().unwrap_or(c));
        let others = self.objects.iter().filter(|o| !constants.contains(&*o.name));
        narrowed.chain(others).collect()
    }
}
