//! Guides, one for each kind of user; their code is compiled and run as tests.
//!
//! | for whom | guide |
//! |---|---|
//! | modellers of cognition | [`planner_graph`]: a planner graph in code; [`timing`]: when each step of a plan is reached; [`ablation`]: what a part is for |
//! | engineers | [`own_module`]: a module, a node or a world of one's own |
//! | roboticists | [`own_task`]: a task of one's own from recordings; `scene`: other sizes, places and motors (feature `physics`) |

#[doc = include_str!("../docs/ablation.md")]
pub mod ablation {}

#[doc = include_str!("../docs/own_module.md")]
pub mod own_module {}

#[doc = include_str!("../docs/own_task.md")]
pub mod own_task {}

#[doc = include_str!("../docs/planner_graph.md")]
pub mod planner_graph {}

#[cfg(feature = "physics")]
#[doc = include_str!("../docs/scene.md")]
pub mod scene {}

#[doc = include_str!("../docs/timing.md")]
pub mod timing {}
