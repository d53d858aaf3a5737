//! A domain as semantic pointers: its vocabularies and the expressions that its memories store.
//!
//! Every state has a random pointer. Every action has two pointers: a random *shallow* pointer in the space of actions,
//! and a *deep* pointer in the space of states. The deep pointer is PRECONDITION bound to the sum of the action's
//! preconditions (section II.E of the paper). PRECONDITION is unitary, so unbinding it is exact. The deep pointer of an
//! action without preconditions is `PRECONDITION * NOTHING`. States that must be absent are kept in a second deep
//! pointer, `ABSENT * (...)`; in the first they would only add noise.
//!
//! # Pointers with roles
//!
//! The states and actions of a ground problem have parameters: which object, at which reference, at which place. Their
//! pointers are built from roles bound to identities ([`Encoded::composed`]):
//!
//! ```text
//! KNIFE_1_AT_PLATE_2      = KNIFE_AT_PLATE * OBJECT * KNIFE_1 * REFERENCE * ~PLATE_2
//! PUT_BOLT_AT_FLANGE_1_P3 = PUT_BOLT_AT_FLANGE * REFERENCE * ~FLANGE_1 * PLACE * P3 * FROM * BOLT_AT_START
//! ```
//!
//! * Roles, identities and symbols are unitary, so the product is unitary too. Unbinding all other factors gives the
//!   remaining one exactly.
//! * The factors are multiplied, not added. Two pointers that differ in one identity are as dissimilar as the two
//!   identities. In a sum they would share most of their length, and a cleanup memory could not separate them. Sums of
//!   sums are ambiguous as well: "cup at start and lid at tray" would equal "lid at start and cup at tray".
//! * Binding is commutative. The reference is therefore inverted, the origin is bound twice, and so on, so that "red on
//!   blue" differs from "blue on red".
//!
//! # Capacity
//!
//! A cleanup memory recognises an item at a similarity of 0.5. The deep pointer of an action with k preconditions is
//! the sum of k pointers. After unbinding, the similarity of a state that is not among them is a sum of k random
//! similarities, each with a standard deviation of 1/sqrt(D). The largest of them over S states and A actions is about
//! `sqrt(2 ln(2 S A) k / D)`. It must stay below 0.5 by a margin of 0.05, which gives
//! `D >= 2 ln(2 S A) k / 0.45^2` ([`Encoded::dimensions_for`]). The drawn pointers are then checked one by one.

use std::collections::BTreeSet;

use crate::sim::{Real, Seed, VocabTag};
use crate::spa::{PointerValue, Vocabulary, VocabularyBuilder, dot};
use crate::task::error::TaskError;
use crate::task::propositional::{Composition, Domain, Operator, Part};

/// The vocabulary space of states and roles.
#[derive(Debug, Clone, Copy)]
pub enum StateSpace {}

/// The vocabulary space of actions.
#[derive(Debug, Clone, Copy)]
pub enum ActionSpace {}

impl VocabTag for StateSpace {
    const NAME: &'static str = "states";
}

impl VocabTag for ActionSpace {
    const NAME: &'static str = "actions";
}

/// Name of the role for preconditions.
pub const PRECONDITION: &str = "PRECONDITION";
/// Name of the role for states that must be absent.
pub const ABSENT: &str = "ABSENT";
/// Name of the item that stands for "no precondition".
pub const NOTHING: &str = "NOTHING";

/// A domain's vocabularies.
#[derive(Debug)]
pub struct Encoded {
    /// Pointers of all states, of [`NOTHING`] and of the roles.
    pub states: Vocabulary<StateSpace>,
    /// Shallow pointers of all actions.
    pub actions: Vocabulary<ActionSpace>,
    /// Pointers that the states' pointers are built from: roles such as `REFERENCE`, `SYMBOL_...` for states,
    /// `IDENTITY_...` for objects and `NUMBER_...` for places and counts. `None` if the states' pointers are random.
    pub atoms: Option<Vocabulary<StateSpace>>,
}

impl Encoded {
    /// Draws the pointers of `domain` from `seed`, with `dim` dimensions. No two pointers of a vocabulary
    /// have a cosine outside `-ceiling..=ceiling`.
    ///
    /// # Errors
    /// [`TaskError::Vocabulary`] if `dim` is invalid or too small for this ceiling, or if `ceiling` is out of range.
    pub fn new(domain: &Domain, dim: usize, ceiling: Real, seed: Seed) -> Result<Self, TaskError> {
        let states = VocabularyBuilder::new(dim, seed)
            .max_similarity(ceiling)
            .unitary(PRECONDITION)
            .unitary(ABSENT)
            .pointer(NOTHING)
            .pointers(domain.states().iter().map(|s| s.name.as_str()))
            .build()?;
        let actions = VocabularyBuilder::new(dim, seed)
            .max_similarity(ceiling)
            .pointers(domain.operators().iter().map(|o| o.name.as_str()))
            .build()?;
        Ok(Self { states, actions, atoms: None })
    }
}

/// Powers with which the filler of each part is bound. They differ, so fillers of two parts cannot be exchanged.
fn power(part: Part) -> (bool, usize) {
    match part {
        Part::Symbol | Part::Object | Part::Place | Part::Count => (false, 1),
        Part::Reference => (true, 1),
        Part::Origin => (false, 2),
        Part::From => (true, 2),
        Part::Except => (false, 3),
    }
}

/// Greatest similarity that the capacity formula leaves for crosstalk.
const CROSSTALK: f64 = 0.45;
/// Greatest number of dimensions that [`Encoded::dimensions_for`] returns.
pub(in crate::task::planner) const MOST_DIMENSIONS: usize = 8192;

/// Named factors and fillers of pointers.
type Atoms<V> = Vec<(String, PointerValue<V>)>;

/// Draws the factors of the named pointers, and returns them with each pointer and its name.
fn compose<V: VocabTag>(
    names: &[&str],
    composition: &Composition,
    dim: usize,
    seed: Seed,
) -> Result<(Vocabulary<V>, Atoms<V>), TaskError> {
    let mut roles: BTreeSet<&str> = BTreeSet::new();
    let mut fillers: BTreeSet<String> = BTreeSet::new();
    let filler = |part: Part, name: &str| match part {
        Part::Symbol | Part::From => format!("SYMBOL_{name}"),
        Part::Place | Part::Count => format!("NUMBER_{name}"),
        Part::Object | Part::Reference | Part::Origin | Part::Except => format!("IDENTITY_{name}"),
    };
    for name in names {
        for factor in composition.factors(name) {
            roles.insert(factor.part.role());
            fillers.insert(filler(factor.part, &factor.filler));
        }
    }
    let mut atoms = VocabularyBuilder::<V>::new(dim, seed).any_similarity();
    for name in roles.iter().map(|r| (*r).to_owned()).chain(fillers) {
        atoms = atoms.unitary(name);
    }
    let atoms = atoms.build()?;
    let mut all = Vec::with_capacity(names.len());
    for name in names {
        let mut product: Vec<String> = Vec::new();
        for factor in composition.factors(name) {
            let (inverted, times) = power(factor.part);
            let own = filler(factor.part, &factor.filler);
            let own = if inverted { format!("~{own}") } else { own };
            if factor.part != Part::Symbol {
                product.push(factor.part.role().into());
            }
            product.extend(std::iter::repeat_n(own, times));
        }
        all.push(((*name).to_owned(), atoms.parse(&product.join(" * "))?));
    }
    Ok((atoms, all))
}

/// Refuses pointers of which two are so similar that a memory recognises one as the other.
fn check_apart<V: VocabTag>(
    all: &[(String, PointerValue<V>)],
    dimensions: usize,
) -> Result<(), TaskError> {
    for (i, (name, pointer)) in all.iter().enumerate() {
        for (other, value) in &all[..i] {
            if f64::from(dot(pointer, value).abs()) > CROSSTALK {
                let (action, other) = (name.clone(), other.clone());
                return Err(TaskError::TooFewDimensions { dimensions, action, states: 1, other });
            }
        }
    }
    Ok(())
}

impl Encoded {
    /// Builds the pointers of `domain` from roles bound to identities, with `dim` dimensions. States and actions that
    /// the composition does not know are refused.
    ///
    /// # Errors
    /// [`TaskError::Vocabulary`] if `dim` is invalid or a state or action has no composition;
    /// [`TaskError::TooFewDimensions`] if two pointers are too similar.
    pub fn composed(
        domain: &Domain,
        composition: &Composition,
        dim: usize,
        seed: Seed,
    ) -> Result<Self, TaskError> {
        let states: Vec<&str> = domain.states().iter().map(|s| s.name.as_str()).collect();
        let actions: Vec<&str> = domain.operators().iter().map(|o| o.name.as_str()).collect();
        let (atoms, of_states) = compose::<StateSpace>(&states, composition, dim, seed)?;
        let (_, of_actions) = compose::<ActionSpace>(&actions, composition, dim, seed)?;
        check_apart(&of_states, dim)?;
        check_apart(&of_actions, dim)?;
        let mut states = VocabularyBuilder::new(dim, seed)
            .any_similarity()
            .unitary(PRECONDITION)
            .unitary(ABSENT)
            .pointer(NOTHING);
        for (name, pointer) in &of_states {
            states = states.vector(name.clone(), pointer);
        }
        let mut actions = VocabularyBuilder::new(dim, seed).any_similarity();
        for (name, pointer) in &of_actions {
            actions = actions.vector(name.clone(), pointer);
        }
        Ok(Self { states: states.build()?, actions: actions.build()?, atoms: Some(atoms) })
    }

    /// Returns the number of dimensions that the capacity formula asks for: a power of two, at least `least`, at most
    /// 8192. With it, random pointers can be decoded from the deep pointers of `domain`.
    pub fn dimensions_for(domain: &Domain, least: usize) -> usize {
        let (states, actions) = (domain.states().len() + 1, domain.operators().len().max(1));
        let bound = domain.operators().iter().map(|o| o.preconditions.len()).max().unwrap_or(1);
        let tail = 2.0 * (2.0 * states as f64 * actions as f64).ln();
        let wanted = tail * bound.max(1) as f64 / (CROSSTALK * CROSSTALK);
        (wanted.ceil() as usize).next_power_of_two().clamp(least, MOST_DIMENSIONS.max(least))
    }
}

/// Returns the expression of the deep pointer for an action with these preconditions.
///
/// ```
/// use symbolt::task::deep_preconditions;
/// assert_eq!(deep_preconditions(["NUT_IN_JIG", "BOLT_IN_JIG"]),
///            "PRECONDITION * (NUT_IN_JIG + BOLT_IN_JIG)");
/// assert_eq!(deep_preconditions([]), "PRECONDITION * (NOTHING)");
/// ```
pub fn deep_preconditions<'n>(names: impl IntoIterator<Item = &'n str>) -> String {
    let names: Vec<&str> = names.into_iter().collect();
    let sum = if names.is_empty() { NOTHING.to_owned() } else { names.join(" + ") };
    format!("{PRECONDITION} * ({sum})")
}

/// Returns the expression of the deep pointer for the states that must be absent before an action; `None` if
/// there are none.
pub(crate) fn deep_absent(domain: &Domain, operator: &Operator) -> Option<String> {
    let absent = domain.names(&operator.absent);
    (!absent.is_empty()).then(|| format!("{ABSENT} * ({})", absent.join(" + ")))
}
