//! Tasks: everything that is specific to one task, each task in a file or a folder.
//!
//! A [`Task`] describes a scene, the grasps for its parts, a demonstrator and a judge. Scene, skills, recorder,
//! learner, planner, closed loop and report use only these descriptions and depend on no particular task.
//!
//! | task | goal |
//! |---|---|
//! | [`nuts_and_bolts`] | puts a nut and a bolt into a jig, then the bolt through the nut |
//! | `movable-jig` | does the same in a jig that stands anywhere and may be moved, among spare parts |
//! | `drawer` | opens a drawer, puts a block into it and closes it |
//! | `cup` | turns over a cup and puts a cube into it |
//! | `table-setting` | lays a fork, a knife and a cup at each plate |
//! | `tower` | builds a tower of three blocks on a pad |
//! | `flange` | puts four bolts into a flange, then a cover on top |
//! | `sorting` | sorts a heap into two bins |
//! | `packing` | packs three kinds of parts into either of two equal boxes |
//!
//! The synthetic demonstrations of [`nuts_and_bolts`] need no physics. Everything else here needs the feature
//! `physics`.
//!
//! All but the first are [task files](mod@file): data that describe scene, grasps, goal and perturbations. Write such a
//! file for a task of your own, if its goal can be said in relations. To build it in, put it into
//! `src/task/tasks/files` and add its name to the list in this module.
//!
//! # Adding a task in code
//!
//! 1. Write a type with the task's settings. Give it `Default`, `Serialize` and `Deserialize`.
//! 2. Implement [`Task`] for it. `scene` draws a [`SceneSpec`](crate::robot::scene::SceneSpec) from a seed.
//!    `grasps` lists the [`Grasp`](crate::robot::skill::Grasp)s for a part, the best first. `judge` says
//!    whether the task is solved.
//! 3. Implement [`Demonstrator`]. It looks at the scene and returns the next [`Step`]: a part and its target.
//! 4. Read the settings with [`parse_settings`], so that errors name the file and the line or field.
//! 5. Run [`demonstrate`](crate::task::execute::demonstrate()) and
//!    [`EpisodeSpec::of`](crate::task::execute::EpisodeSpec::of) with your type. To offer the task on the command line,
//!    add it to `all`.
//!
//! `tests/task/second_task.rs` in the repository is a complete example.

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
    use super::file::DataTask;
    use super::nuts_and_bolts::NutsAndBolts;
    use crate::task::error::TaskError;

    /// Returns the default task, which is used if no task is named.
    pub fn default() -> Arc<dyn Task> {
        Arc::new(NutsAndBolts::default())
    }

    /// Lists task files of the folder `files` with their texts. A file has the name of its task.
    macro_rules! files {
        ($($name:literal)*) => {
            &[$(($name, include_str!(concat!("files/", $name, ".json")))),*]
        };
    }

    /// The tasks that are task files. To add one, write its file and name it here.
    pub(super) const FILES: &[(&str, &str)] =
        files!["movable-jig" "drawer" "cup" "table-setting" "tower" "flange" "sorting" "packing"];

    pub(super) fn read(&(name, text): &(&str, &str)) -> Result<Arc<dyn Task>, TaskError> {
        Ok(Arc::new(DataTask::parse(text.as_bytes(), &format!("{name}.json"))?))
    }

    /// Returns every task with its default settings. The default task is first.
    ///
    /// # Errors
    /// [`TaskError::Input`] if a task file of the program itself is not valid.
    pub fn all() -> Result<Vec<Arc<dyn Task>>, TaskError> {
        std::iter::once(Ok(default())).chain(FILES.iter().map(read)).collect()
    }

    /// Returns the task with this name and its default settings.
    ///
    /// # Errors
    /// [`TaskError::UnknownTask`], which lists the tasks; as [`all`].
    pub fn by_name(name: &str) -> Result<Arc<dyn Task>, TaskError> {
        if let Some(file) = FILES.iter().find(|(own, _)| *own == name) {
            return read(file);
        }
        let all = all()?;
        all.iter().find(|task| task.name() == name).cloned().ok_or_else(|| {
            let choices = all.iter().map(|task| (task.name().into(), task.description().into()));
            TaskError::UnknownTask { name: name.into(), choices: choices.collect() }
        })
    }
}

#[cfg(all(test, feature = "physics"))]
mod tests {
    use std::collections::BTreeSet;

    use super::registry::{FILES, read};
    use super::*;

    #[test]
    fn a_file_that_is_not_listed_or_has_another_name_than_its_task_is_found() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/src/task/tasks/files");
        let entries = std::fs::read_dir(folder).expect("the folder is there");
        let names = entries.map(|e| e.expect("readable").file_name().into_string().expect("text"));
        let listed = FILES.iter().map(|(name, _)| format!("{name}.json"));
        assert_eq!(names.collect::<BTreeSet<_>>(), listed.collect());
        for file in FILES {
            assert_eq!(read(file).expect("it is valid").name(), file.0);
            assert_eq!(by_name(file.0).expect("it is valid").name(), file.0);
        }
        assert_eq!(all().expect("all are valid").len(), 1 + FILES.len());
    }

    #[test]
    fn a_built_in_file_that_is_not_valid_is_not_dropped_silently() {
        let (name, text) = FILES[0];
        let bad = text.replacen("\"density\": 7800", "\"density\": 0", 1);
        let error = read(&(name, &bad)).map(|_| ()).expect_err("it is refused").to_string();
        assert!(error.starts_with("movable-jig.json, field `parts[0].density`"), "{error}");
    }
}
