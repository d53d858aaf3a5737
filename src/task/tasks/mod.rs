//! Tasks: what is true of one task alone, each in a folder of its own.
//!
//! A [`Task`] says what a scene is made of, how its parts can be taken hold of, how it is demonstrated and when it is
//! solved. Everything else (scene, skills, recorder, learner, planner, closed loop, report) works from that and knows
//! no task. To add one, implement [`Task`], and name it in [`all`] if the command line should find it.
//!
//! Of these, [`nuts_and_bolts`]' synthetic demonstrations need no physics.

pub mod nuts_and_bolts;
#[cfg(feature = "physics")]
mod settings;
#[cfg(feature = "physics")]
mod task;

#[cfg(feature = "physics")]
pub use registry::{all, by_name, default};
#[cfg(feature = "physics")]
pub use settings::parse_settings;
#[cfg(feature = "physics")]
pub use task::{Demonstrator, Judgement, Perturbation, Step, Task};

#[cfg(feature = "physics")]
mod registry {
    use std::sync::Arc;

    use super::Task;
    use super::nuts_and_bolts::NutsAndBolts;
    use crate::task::error::TaskError;

    /// The task that is meant where none is named.
    pub fn default() -> Arc<dyn Task> {
        Arc::new(NutsAndBolts::default())
    }

    /// Every task, with its default settings, the default task first.
    pub fn all() -> Vec<Arc<dyn Task>> {
        vec![default()]
    }

    /// A task, with its default settings.
    ///
    /// # Errors
    /// [`TaskError::UnknownTask`], listing those there are.
    pub fn by_name(name: &str) -> Result<Arc<dyn Task>, TaskError> {
        let all = all();
        match all.iter().find(|task| task.name() == name) {
            Some(task) => Ok(task.clone()),
            None => Err(TaskError::UnknownTask {
                name: name.into(),
                choices: all.iter().map(|task| (task.name(), task.description())).collect(),
            }),
        }
    }
}
