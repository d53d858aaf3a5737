//! PDDL: reads and writes it, compiles problems to STRIPS over facts, validates plans and reads trajectories.
//!
//! | module | contents |
//! |---|---|
//! | `pddl`, `formula` | [`Domain`], [`Problem`], literals of actions; other conditions, effects and numbers |
//! | `lists`, `read`, `conditions`, `numbers`, `durative`, `problem` | the readers of domains and problems |
//! | `write`, `names`, `requirements` | the printer, names that PDDL allows, and requirements of what is used |
//! | `strata` | which derived predicates need which |
//! | `ground` | [`Grounded`]: the fluents and operators that a problem can reach |
//! | `sets` | sets of fluents as words of bits |
//! | `shorten` | [`shorten`](shorten()): takes detours out of a plan |
//! | `truth` | whether conditions hold in a state, by their meaning |
//! | `validate` | [`validate`](validate()): carries out a plan and says where it fails |
//! | `trace` | [`Trajectory`]: states and actions of one run |
//!
//! ```
//! use symbolt::plan::model::{Rule, learn};
//! use symbolt::plan::strips::{Bodies, Domain, Trajectory};
//!
//! let domain = b"(define (domain door) (:predicates (open) (shut)) (:action open-it :parameters ()))";
//! let trace = b"(:trajectory (:state (shut)) (:action (open-it)) (:state (open)))";
//! let domain = Domain::parse(domain, "door.pddl", Bodies::Skip)?;
//! let traces = Trajectory::parse(trace, "trace", &domain)?;
//! let learned = learn(&domain, &traces, Rule::Evidence)?;
//! let text = learned.domain().to_string();
//! assert!(text.contains(":precondition (and\n      (shut))"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod conditions;
mod durative;
mod formula;
mod ground;
mod lists;
mod names;
mod numbers;
mod pddl;
mod problem;
mod read;
mod requirements;
mod sets;
mod sexpr;
mod shorten;
mod strata;
mod trace;
mod truth;
mod validate;
mod write;

pub use formula::{
    Comparison, Condition, ConditionalEffect, Derived, Expression, Function, Increase, Number,
    Operation,
};
pub(crate) use formula::{FALSE, TRUE, all, any, not, quantified, same};
pub use ground::{Fluent, GroundFault, GroundOperator, Grounded};
pub(crate) use names::{Names, variable};
pub use pddl::{
    Action, Atom, Domain, EQUAL, Fact, Literal, OBJECT, Predicate, Problem, Term, Typed, Types,
};
pub use read::{Bodies, MAX_ACTIONS};
pub(crate) use sets::{Bits, bits, contains};
pub use sexpr::PddlFault;
pub use shorten::shorten;
pub use trace::{GroundAtom, Step, TraceObject, Trajectory};
pub use validate::{PlanFault, validate};
pub use write::Shown;
