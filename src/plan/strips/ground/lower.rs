//! Conditions and effects by number: objects, predicates and variables in place of their names, negations at the atoms.

use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use crate::plan::strips::formula::{Comparison, Condition, Expression, Number};
use crate::plan::strips::pddl::{self, Domain, EQUAL, Fact, Literal, Problem, Term, Typed};

/// A variable that is not bound.
pub(super) const UNBOUND: u32 = u32::MAX;

/// A predicate with objects, both by number.
pub(super) type Ground = (u32, Box<[u32]>);

/// An argument: a variable by its slot, or an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Argument {
    Slot(usize),
    Object(u32),
}

impl Argument {
    /// Returns the object; [`UNBOUND`] if the variable is not bound.
    pub fn object(self, bound: &[u32]) -> u32 {
        match self {
            Self::Slot(slot) => bound[slot],
            Self::Object(object) => object,
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Atom {
    pub predicate: u32,
    pub arguments: Vec<Argument>,
}

impl Atom {
    pub fn has_slots(&self) -> bool {
        self.arguments.iter().any(|argument| matches!(argument, Argument::Slot(_)))
    }

    /// Returns the objects; `None` if a variable is not bound.
    pub fn ground(&self, bound: &[u32]) -> Option<Ground> {
        let objects = self.arguments.iter().map(|argument| argument.object(bound));
        let objects: Box<[u32]> = objects.collect();
        (!objects.contains(&UNBOUND)).then_some((self.predicate, objects))
    }
}

/// A condition with negations at its atoms alone.
#[derive(Debug, Clone)]
pub(super) enum Formula {
    Fact(Atom, bool),
    Same(Argument, Argument, bool),
    /// A comparison that must hold or not, and the slots of its parameters.
    Compare(Box<(Comparison, Expression, Expression)>, bool, Vec<usize>),
    All(Vec<Formula>),
    Any(Vec<Formula>),
    /// For all choices of objects for the slots, or for some.
    Each {
        all: bool,
        slots: Vec<usize>,
        inner: Box<Formula>,
    },
}

impl Formula {
    /// Returns the number of atoms.
    pub fn size(&self) -> usize {
        match self {
            Self::Fact(..) | Self::Same(..) | Self::Compare(..) => 1,
            Self::All(parts) | Self::Any(parts) => parts.iter().map(Self::size).sum(),
            Self::Each { inner, .. } => inner.size(),
        }
    }
}

impl Formula {
    /// Collects the slots that are named.
    fn slots(&self, used: &mut HashSet<usize>) {
        let mut see = |argument: &Argument| {
            if let Argument::Slot(slot) = argument {
                used.insert(*slot);
            }
        };
        match self {
            Self::Fact(atom, _) => atom.arguments.iter().for_each(see),
            Self::Same(left, right, _) => [left, right].into_iter().for_each(&mut see),
            Self::Compare(_, _, slots) => used.extend(slots),
            Self::All(parts) | Self::Any(parts) => parts.iter().for_each(|part| part.slots(used)),
            Self::Each { inner, .. } => inner.slots(used),
        }
    }
}

/// Objects that fit some types.
pub(super) struct Fitting {
    pub list: Vec<u32>,
    pub fits: Vec<bool>,
}

/// What all conditions of a problem are about.
pub(super) struct Base<'a> {
    pub domain: &'a Domain,
    pub objects: Vec<&'a Typed>,
    positions: HashMap<&'a str, u32>,
    predicates: HashMap<(&'a str, usize), u32>,
    /// Whether some action changes each predicate.
    pub changing: Vec<bool>,
    pub derived: Vec<bool>,
    /// Whether reached facts choose the objects that must exist.
    pub joins: bool,
    /// Facts of the initial state.
    pub start: HashSet<Ground>,
    numbers: HashMap<(&'a str, Vec<u32>), Number>,
}

impl<'a> Base<'a> {
    pub fn new(domain: &'a Domain, problem: &'a Problem, joins: bool) -> Self {
        let objects = problem.all_objects(domain);
        let numbered = objects.iter().zip(0..);
        let positions = numbered.map(|(object, at)| (object.name.as_str(), at)).collect();
        let named = domain.predicates.iter().zip(0..);
        let predicates = named.map(|(p, at)| ((p.name.as_str(), p.parameters.len()), at)).collect();
        let mut base = Self {
            domain,
            objects,
            positions,
            predicates,
            changing: vec![false; domain.predicates.len()],
            derived: vec![false; domain.predicates.len()],
            joins,
            start: HashSet::new(),
            numbers: HashMap::new(),
        };
        for action in &domain.actions {
            let conditional = action.conditional.iter().flat_map(|effect| &effect.effects);
            for effect in action.effects.iter().chain(conditional) {
                if let Some(predicate) = base.predicate(&effect.atom) {
                    base.changing[predicate as usize] = true;
                }
            }
        }
        for rule in &domain.derived {
            let key = (rule.predicate.as_str(), rule.parameters.len());
            if let Some(predicate) = base.predicates.get(&key) {
                base.derived[*predicate as usize] = true;
            }
        }
        let start = problem.init.iter().filter_map(|fact| base.ground(fact)).collect();
        base.start = start;
        for (function, value) in &problem.numbers {
            if let Some(objects) = base.all_objects(&function.arguments) {
                base.numbers.insert((&function.predicate, objects), *value);
            }
        }
        base
    }

    fn predicate(&self, atom: &pddl::Atom) -> Option<u32> {
        self.predicates.get(&(atom.predicate.as_str(), atom.arguments.len())).copied()
    }

    fn all_objects(&self, names: &[String]) -> Option<Vec<u32>> {
        names.iter().map(|name| self.positions.get(name.as_str()).copied()).collect()
    }

    pub fn ground(&self, fact: &Fact) -> Option<Ground> {
        let objects = self.all_objects(&fact.arguments)?;
        let key = (fact.predicate.as_str(), objects.len());
        Some((*self.predicates.get(&key)?, objects.into()))
    }

    pub fn fact(&self, (predicate, objects): &Ground) -> Fact {
        Fact {
            predicate: self.domain.predicates[*predicate as usize].name.clone(),
            arguments: objects.iter().map(|o| self.objects[*o as usize].name.clone()).collect(),
        }
    }

    /// Returns the value of an expression. `slots` are those of its parameters.
    pub fn value(&self, of: &Expression, slots: &[usize], bound: &[u32]) -> Option<Number> {
        of.value(&|atom: &pddl::Atom| {
            let object = |term: &Term| match term {
                Term::Parameter(position) => Some(bound[*slots.get(*position)?]),
                Term::Constant(name) => self.positions.get(name.as_str()).copied(),
            };
            let objects = atom.arguments.iter().map(object).collect::<Option<Vec<u32>>>()?;
            self.numbers.get(&(atom.predicate.as_str(), objects)).copied()
        })
    }
}

/// Lowers what belongs to one action, rule or goal. Each variable has a slot of its own.
pub(super) struct Lower<'b, 'a> {
    pub base: &'b Base<'a>,
    cache: &'b mut HashMap<Vec<String>, Rc<Fitting>>,
    /// Objects that fit each slot.
    pub fitting: Vec<Rc<Fitting>>,
    /// The slots of the parameters and quantified variables that may be named now.
    pub scope: Vec<usize>,
}

impl<'b, 'a> Lower<'b, 'a> {
    pub fn new(
        base: &'b Base<'a>,
        cache: &'b mut HashMap<Vec<String>, Rc<Fitting>>,
        parameters: &[Typed],
    ) -> Self {
        let mut lower = Self { base, cache, fitting: Vec::new(), scope: Vec::new() };
        lower.open(parameters);
        lower
    }

    /// Adds variables. Returns their slots.
    pub fn open(&mut self, variables: &[Typed]) -> Vec<usize> {
        let base = self.base;
        let slots: Vec<usize> = (self.fitting.len()..).take(variables.len()).collect();
        for variable in variables {
            let fitting = self.cache.entry(variable.types.clone()).or_insert_with(|| {
                let types = &base.domain.types;
                let fit = |object: &&Typed| types.may_be(&object.types, &variable.types);
                let fits: Vec<bool> = base.objects.iter().map(fit).collect();
                let list = (0..).zip(&fits).filter(|(_, fits)| **fits).map(|(at, _)| at).collect();
                Rc::new(Fitting { list, fits })
            });
            self.fitting.push(Rc::clone(fitting));
        }
        self.scope.extend(&slots);
        slots
    }

    fn argument(&self, term: &Term) -> Argument {
        match term {
            Term::Parameter(position) => match self.scope.get(*position) {
                Some(slot) => Argument::Slot(*slot),
                None => Argument::Object(UNBOUND),
            },
            Term::Constant(name) => {
                let known = self.base.positions.get(name.as_str());
                Argument::Object(known.copied().unwrap_or(UNBOUND))
            }
        }
    }

    /// Returns the atom; `None` if the domain has no such predicate.
    pub fn atom(&self, atom: &pddl::Atom) -> Option<Atom> {
        let arguments = atom.arguments.iter().map(|term| self.argument(term)).collect();
        Some(Atom { predicate: self.base.predicate(atom)?, arguments })
    }

    pub fn literal(&self, literal: &Literal, positive: bool) -> Formula {
        let holds = literal.positive == positive;
        if literal.atom.predicate == EQUAL
            && let [left, right] = literal.atom.arguments.as_slice()
        {
            return Formula::Same(self.argument(left), self.argument(right), holds);
        }
        match self.atom(&literal.atom) {
            Some(atom) => Formula::Fact(atom, holds),
            None if holds => Formula::Any(Vec::new()),
            None => Formula::All(Vec::new()),
        }
    }

    /// Lowers a condition, or its negation if not `positive`.
    pub fn condition(&mut self, condition: &Condition, positive: bool) -> Formula {
        match condition {
            Condition::Literal(literal) => self.literal(literal, positive),
            Condition::Compare(comparison, left, right) => {
                let sides = (*comparison, left.clone(), right.clone());
                Formula::Compare(Box::new(sides), positive, self.scope.clone())
            }
            Condition::Not(inner) => self.condition(inner, !positive),
            Condition::All(parts) | Condition::Any(parts) => {
                let lowered = parts.iter().map(|part| self.condition(part, positive)).collect();
                match matches!(condition, Condition::All(_)) == positive {
                    true => Formula::All(lowered),
                    false => Formula::Any(lowered),
                }
            }
            Condition::Exists(variables, inner) | Condition::Forall(variables, inner) => {
                let depth = self.scope.len();
                let slots = self.open(variables);
                let inner = Box::new(self.condition(inner, positive));
                self.scope.truncate(depth);
                let all = matches!(condition, Condition::Forall(..)) == positive;
                if slots.iter().any(|slot| self.fitting[*slot].list.is_empty()) {
                    return if all { Formula::All(Vec::new()) } else { Formula::Any(Vec::new()) };
                }
                let mut used = HashSet::new();
                inner.slots(&mut used);
                // A variable that nothing names says nothing.
                let slots = slots.into_iter().filter(|slot| used.contains(slot)).collect();
                Formula::Each { all, slots, inner }
            }
        }
    }

    /// Returns how often the parts of a formula are judged at most, for one choice of its other variables.
    pub fn choices(&self, formula: &Formula) -> u128 {
        match formula {
            Formula::Fact(..) | Formula::Same(..) | Formula::Compare(..) => 1,
            Formula::All(parts) | Formula::Any(parts) => {
                parts.iter().fold(0, |sum, part| self.choices(part).saturating_add(sum))
            }
            Formula::Each { slots, inner, .. } => {
                self.sizes(slots).saturating_mul(self.choices(inner))
            }
        }
    }

    /// Returns the number of choices of objects for slots.
    pub fn sizes(&self, slots: &[usize]) -> u128 {
        let sizes = slots.iter().map(|slot| self.fitting[*slot].list.len() as u128);
        sizes.fold(1, u128::saturating_mul)
    }
}
