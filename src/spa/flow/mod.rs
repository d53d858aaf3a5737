//! Expressions over modules: `vision * !role >> state` instead of modules and connections.
//!
//! Every module with one output is an operand, and so are [outputs](crate::sim::Out) of every kind, such as `a.output("x")`,
//! pointers of a vocabulary and numbers. The operators build a [`Flow`]; `>>` routes it into an input, and [`Routes::route`] adds it to a graph.
//!
//! | expression | meaning | becomes |
//! |---|---|---|
//! | `&a * &b` | binding | [`Bind`](super::Bind); with a constant, a linear node |
//! | `&a + &b`, `&a - &b`, `-&a` | superposition | connections, or one linear node |
//! | `0.5 * &a` | scaling | a weight |
//! | `!&a` | approximate inverse, to unbind | a linear node |
//! | `a.dot(&b)` | scalar product | [`Compare`](super::Compare); with a constant, a linear node |
//! | `&s * &a` with a scalar `s` | weighting | [`Weigh`](super::Weigh) or [`Multiply`](super::Multiply) |
//! | `a.transform(matrix)` | a matrix times a vector or pointer | a linear node |
//! | `a.slice(0..2)`, `a.component(1)` | parts of a vector or pointer | a linear node |
//! | `a.reinterpret(&vocabulary)` | the same numbers as a pointer | a linear node |
//! | `a.translate(&vocabulary)` | the pointer of the same name in another vocabulary | a linear node |
//! | `flow >> &c` | routing into the input of `c`; a number also into a vector of width 1 | a connection |
//!
//! `>>` binds more loosely than `+` and `*`, so expressions need no parentheses in front of it. Clippy's style lint
//! `precedence` asks for them all the same; `#![allow(clippy::precedence)]` silences it. Constant parts are computed when
//! the graph is described. Linear nodes cost no tick; each layer costs one synapse of 5 ms, as in the modules.
//!
//! The output of a bare [layer](crate::neurons::Layers) needs a synapse. That of the route ([`Route::via`]) is applied to
//! it, 5 ms by default. If the expression has other outputs too and multiplies values that change, they get 5 ms in any case.
//!
//! Pointers of two vocabularies have different types, so an expression that mixes them does not compile:
//!
//! ```
//! # use symbolt::prelude::*;
//! # struct Parts;
//! # impl VocabTag for Parts { const NAME: &'static str = "parts"; }
//! # struct Verbs;
//! # impl VocabTag for Verbs { const NAME: &'static str = "verbs"; }
//! let parts = VocabularyBuilder::<Parts>::new(64, Seed::new(1)).pointers(["NUT", "ROLE"]).build()?;
//! let verbs = VocabularyBuilder::<Verbs>::new(64, Seed::new(1)).pointer("TAKE").build()?;
//! let mut graph = GraphBuilder::new();
//! let seen = graph.add("seen", State::new(&parts));
//! let filler = graph.add("filler", State::new(&parts));
//! graph.route(&seen * !parts.get("ROLE")? >> &filler);
//! # let _ = verbs;
//! # Ok::<(), symbolt::spa::VocabError>(())
//! ```
//!
//! ```compile_fail
//! # use symbolt::prelude::*;
//! # struct Parts;
//! # impl VocabTag for Parts { const NAME: &'static str = "parts"; }
//! # struct Verbs;
//! # impl VocabTag for Verbs { const NAME: &'static str = "verbs"; }
//! let parts = VocabularyBuilder::<Parts>::new(64, Seed::new(1)).pointers(["NUT", "ROLE"]).build()?;
//! let verbs = VocabularyBuilder::<Verbs>::new(64, Seed::new(1)).pointer("TAKE").build()?;
//! let mut graph = GraphBuilder::new();
//! let seen = graph.add("seen", State::new(&parts));
//! let filler = graph.add("filler", State::new(&parts));
//! graph.route(&seen * !verbs.get("TAKE")? >> &filler);
//! # Ok::<(), symbolt::spa::VocabError>(())
//! ```
//!
//! # Paths
//!
//! The nodes of a route lie in a scope that is named after its target: `to.filler.input`, and `to.filler.input-2` for
//! the second route into the same input. [`Route::named`] gives another name. In the scope, nodes are called after
//! their operator: `bind`, `inverse`, `dot`, `weigh`, `sum`, `constant`; the second of a kind is `bind-2`, and so on.

mod expression;
mod kinds;
mod lower;
mod operands;
mod operators;
mod route;
mod rules;
mod transforms;

pub use expression::{Flow, IntoFlow};
pub use kinds::FlowKind;
pub use operators::{Invertible, Times};
#[doc(hidden)]
pub use operators::{flow_operators, flow_ports};
pub use route::{FlowsInto, Route, Routes, Sink};
pub use rules::{Rule, Rules, RulesPorts};
#[doc(hidden)]
pub use transforms::Chained;
pub use transforms::FlowExt;
