//! A planner made of neurons alone: two searches over a grounded STRIPS problem that run at once.
//!
//! Backward, a goal set is a set of fluents that must hold. The search begins with the goal. Again and again it takes an
//! operator that achieves one of the goals and threatens none, and puts its preconditions in place of what it adds, until the
//! goal set holds. Forward ([`ForwardGraph`]), it applies operators of relaxed plans to a state until the goal is in it. The first that finds a plan
//! acts ([`PlannerGraph`]). Which goals an operator achieves and threatens, which fluents exclude each other, and in small problems how far sets of up
//! to three of them are from the start, is compiled into the weights of synapses ([`Regression`], [`Progression`]). Everything else is computed by
//! units: what a fluent costs, what a relaxed plan has, which operator is worth most, what was visited, what phase comes next, and when to plan anew. Only the senses, the motor and the world have no neurons.
//!
//! | file | contents |
//! |---|---|
//! | `mutex`, `triples`, `useless`, `rules` | pairs and triples of fluents that exclude each other, and their distances; operators that are in no plan; what each operator achieves and threatens |
//! | `wiring` | groups of units, and links between them |
//! | `machine`, `control` | phases and signals, and the table of transitions |
//! | `costs` | the wave from what holds; how far each fluent is |
//! | `choice`, `race` | relevance, veto, utilities, chance after a search that failed, and the race |
//! | `synapses`, `tried`, `tree`, `memory` | plastic synapses; slots for sets, what was tried in each, and the way back |
//! | `retreat` | the slot to go on with after a dead end |
//! | `senses` | what a planner is told |
//! | `motor` | what a set takes over; the units that show an action |
//! | `graph` | all parts of the search backward as one module |
//! | `forward` | the search forward |
//! | `both` | both searches as one planner |
//! | `spikes` | spikes and synaptic events, counted |
//! | `moments` | what the planner did when, read from its phases |
//! | `world`, `plan` | a world by the rules of the problem; planning and acting in it |
//! | `search` | the rules of the search backward without neurons |
//!
//! The method backward is that of goal regression with costs from the present state (Bonet and Geffner, "Planning as heuristic
//! search", 2001). A goal that hinders the operators for an unmet one is blamed, and operators that achieve it
//! count more. What was found stays in slots, not in a sum of bound pointers: sums of fifteen pointers in 512
//! dimensions read back wrongly in one plan of fifty, synapses of their own do not.
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
mod retreat;
mod rules;
mod search;
mod senses;
mod spikes;
mod synapses;
mod tree;
mod tried;
mod triples;
mod useless;
mod wiring;
mod words;
mod world;

pub use both::{Directions, PlannerGraph, PlannerPorts};
pub use forward::{ForwardGraph, ForwardPorts, Progression};
pub use graph::{GoalSetGraph, GoalSetPorts, phase_names};
pub(crate) use moments::Moments;
pub use moments::{Moment, Step};
pub use mutex::Mutexes;
pub use plan::{Course, GoalSetError, GoalSetSpec, MAX_UNITS, populations, pursue, slots};
pub(crate) use plan::{check_units, pursue_with};
pub use rules::{Regressed, Regression};
pub use search::{Found, costs, search};
pub use spikes::SpikeCount;
pub use world::{Begun, StripsWorld};
