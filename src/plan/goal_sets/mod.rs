//! A planner made of neurons alone: regression of goal sets over a grounded STRIPS problem.
//!
//! A goal set is a set of fluents that must hold. The planner begins with the goal. Again and again it takes an operator
//! that achieves one of the goals and threatens none, and puts its preconditions in place of what it adds, until the goal
//! set holds. Then it acts, and walks the goal sets back, from what holds to the goal. Which goals an operator achieves and
//! threatens, and which fluents exclude each other, is compiled into the weights of synapses ([`Regression`]). Everything
//! else is computed by units: what a fluent costs, which operator is worth most, which goal sets were visited, what
//! phase comes next, and when to plan anew. Only the senses, the motor and the world have no neurons.
//!
//! | file | contents |
//! |---|---|
//! | `mutex`, `rules` | pairs of fluents that exclude each other; what each operator achieves and threatens |
//! | `wiring` | groups of units, and links between them |
//! | `control` | phases and signals, and the table of transitions |
//! | `costs` | the wave from what holds; how far each fluent is |
//! | `choice` | relevance, veto, utilities, chance after a search that failed, and the race |
//! | `memory` | slots for goal sets; which operators lead to visited ones |
//! | `retreat` | the slot to go on with after a dead end |
//! | `graph` | all parts as one module |
//! | `moments` | what the planner did when, read from its phases |
//! | `world`, `plan` | a world by the rules of the problem; planning and acting in it |
//! | `search` | the same rules without neurons |
//!
//! The method is that of goal regression with costs from the present state (Bonet and Geffner, "Planning as heuristic
//! search", 2001). Three things are new here. All visited goal sets veto all operators at once, so no time is lost with
//! operators that lead back. A goal that hinders the operators for an unmet one is blamed, and operators that achieve it
//! count more. And what was found stays in slots, not in a sum of bound pointers: sums of fifteen pointers in 512
//! dimensions read back wrongly in one plan of fifty, latches do not.
//!
//! ```
//! use symbolt::sim::{Seed, SimDuration};
//! use symbolt::plan::goal_sets::{GoalSetSpec, StripsWorld, pursue};
//! use symbolt::plan::strips::{Bodies, Domain, Grounded, Problem};
//!
//! let domain = b"(define (domain kettle) (:predicates (plugged) (full) (boiled))
//!     (:action unplug :parameters () :precondition (plugged) :effect (not (plugged)))
//!     (:action plug-in :parameters () :precondition (not (plugged)) :effect (plugged))
//!     (:action fill :parameters () :precondition (not (plugged)) :effect (full))
//!     (:action boil :parameters () :precondition (and (plugged) (full)) :effect (boiled)))";
//! let problem = b"(define (problem tea) (:domain kettle) (:init (plugged)) (:goal (boiled)))";
//! let domain = Domain::parse(domain, "kettle.pddl", Bodies::Read)?;
//! let problem = Problem::parse(problem, "tea.pddl", &domain)?;
//! let grounded = Grounded::new(&domain, &problem)?;
//!
//! let world = StripsWorld::new(&grounded, SimDuration::from_millis(100));
//! let course = pursue(&grounded, world, &GoalSetSpec::default(), Seed::new(1))?;
//! let plan: Vec<&str> = course.plan().map(|a| grounded.operators[a].name.as_str()).collect();
//! assert_eq!(plan, ["(unplug)", "(fill)", "(plug-in)", "(boil)"]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod both;
mod choice;
mod control;
mod costs;
mod forward;
mod graph;
mod machine;
mod memory;
mod moments;
mod motor;
mod mutex;
mod plan;
mod race;
mod rules;
mod search;
mod synapses;
mod tree;
mod wiring;
mod world;

pub use both::{Directions, PlannerGraph, PlannerPorts};
pub use forward::{ForwardGraph, ForwardPorts, Progression};
pub use graph::{GoalSetGraph, GoalSetPorts, phase_names};
pub(crate) use moments::Moments;
pub use moments::{Moment, Step};
pub use mutex::Mutexes;
pub(crate) use plan::check_units;
pub use plan::{Course, GoalSetError, GoalSetSpec, MAX_UNITS, populations, pursue, slots};
pub use rules::{Regressed, Regression};
pub use search::{Found, costs, search};
pub use world::{Begun, StripsWorld};
