//! Tasks: everything that is specific to one task, each task in its own folder.
//!
//! A [`Task`] describes a scene, the grasps for its parts, a demonstrator and a judge. Scene, skills, recorder,
//! learner, planner, closed loop and report use only these descriptions and depend on no particular task.
//!
//! | task | goal |
//! |---|---|
//! | [`nuts_and_bolts`] | puts a nut and a bolt into a jig, then the bolt through the nut |
//! | [`drawer`] | opens a drawer, puts blocks into it and closes it |
//! | [`cup`] | turns over a cup and puts a cube into it |
//! | `table-setting` | lays a fork, a knife and a cup at each plate |
//! | `tower` | builds a tower of three blocks on a pad |
//! | `flange` | puts four bolts into a flange, then a cover on top |
//! | `sorting` | sorts a heap into two bins |
//!
//! The synthetic demonstrations of [`nuts_and_bolts`] need no physics. Everything else here needs the feature
//! `physics`.
//!
//! The last four are [task files](mod@file): data that describe scene, grasps, goal and perturbations. Write such a file
//! for a task of your own, if its goal can be said in relations.
//!
//! # Adding a task in code
//!
//! 1. Write a type with the task's settings. Give it `Default`, `Serialize` and `Deserialize`.
//! 2. Implement [`Task`] for it. `scene` draws a [`SceneSpec`](crate::task::scene::SceneSpec) from a seed.
//!    `grasps` lists the [`Grasp`](crate::task::skill::Grasp)s for a part, the best first. `judge` says
//!    whether the task is solved.
//! 3. Implement [`Demonstrator`]. It looks at the scene and returns the next [`Step`]: a part and its target.
//! 4. Read the settings with [`parse_settings`], so that errors name the file and the line or field.
//! 5. Run [`demonstrate`](crate::task::execute::demonstrate()) and
//!    [`EpisodeSpec::of`](crate::task::execute::EpisodeSpec::of) with your type. To offer the task on the command line,
//!    add it to [`all`].
//!
//! `tests/task/second_task.rs` in the repository is a complete example.

#[cfg(feature = "physics")]
pub mod cup;
#[cfg(feature = "physics")]
pub mod drawer;
#[cfg(feature = "physics")]
pub mod file;
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
    use super::cup::Cup;
    use super::drawer::Drawer;
    use super::file::DataTask;
    use super::nuts_and_bolts::{MovableJig, NutsAndBolts};
    use crate::task::error::TaskError;

    /// Returns the default task, which is used if no task is named.
    pub fn default() -> Arc<dyn Task> {
        Arc::new(NutsAndBolts::default())
    }

    /// Names and texts of the tasks that are task files.
    const FILES: [(&str, &str); 4] = [
        ("table-setting.json", include_str!("files/table-setting.json")),
        ("tower.json", include_str!("files/tower.json")),
        ("flange.json", include_str!("files/flange.json")),
        ("sorting.json", include_str!("files/sorting.json")),
    ];

    /// Returns every task with its default settings. The default task is first.
    pub fn all() -> Vec<Arc<dyn Task>> {
        // These files are part of the program, and a test reads them all.
        let read =
            FILES.iter().filter_map(|(name, text)| DataTask::parse(text.as_bytes(), name).ok());
        let read = read.map(|task| Arc::new(task) as Arc<dyn Task>);
        let coded: [Arc<dyn Task>; 4] = [
            default(),
            Arc::new(MovableJig::default()),
            Arc::new(Drawer::default()),
            Arc::new(Cup::default()),
        ];
        coded.into_iter().chain(read).collect()
    }

    /// Returns the task with this name and its default settings.
    ///
    /// # Errors
    /// [`TaskError::UnknownTask`], which lists the tasks.
    pub fn by_name(name: &str) -> Result<Arc<dyn Task>, TaskError> {
        let all = all();
        match all.iter().find(|task| task.name() == name) {
            Some(task) => Ok(task.clone()),
            None => Err(TaskError::UnknownTask {
                name: name.into(),
                choices: all
                    .iter()
                    .map(|task| (task.name().into(), task.description().into()))
                    .collect(),
            }),
        }
    }
}
