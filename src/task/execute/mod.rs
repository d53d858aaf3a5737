//! Runs tasks in the scene: demonstrations, and episodes in which the planner graph controls the robot.
//!
//! | to | use |
//! |---|---|
//! | record demonstrations | [`demonstrate()`], or [`Recorder`] for single snapshots |
//! | run an episode | [`episode`] with [`EpisodeSpec`], or [`PreparedEpisode`] |
//! | follow an episode while it runs | [`episode_observed`], with an [`Observer`](crate::task::event::Observer) such as [`ActivityRecorder`] |
//! | run the scene as the world of your own simulator | [`PreparedEpisode::into_world`] |
//!
//! # The closed loop
//!
//! The scene is the planner graph's world, so planning and physics share the same simulated time. While the
//! graph decides, parts rest or keep rolling. While the arm moves, the graph idles. The *executor*, a part of
//! [`EpisodeWorld`], connects the two. It repeats these steps:
//!
//! 1. *Rest*: `ready` is 0 for a few steps, and the graph forgets its last answer.
//! 2. *Look*: the recorder takes a snapshot, and the classifier finds the state of every object. Together the
//!    states are the world state.
//! 3. *Ask*: `ready` is 1, and the graph decides.
//! 4. *Check*: if the verdict is met or stuck, the episode ends. Otherwise the executor looks again. If the
//!    world state has changed, it returns to step 1.
//! 5. *Choose*: the action says which parts can be moved, to which reference and place. The target is
//!    [`Problem::target`](crate::task::compile::Problem::target).
//! 6. *Act*: the robot runs the skill. However the skill ends, the loop returns to step 1. A drop or a person's
//!    intervention therefore leads to a new decision (a re-plan).
//!
//! # Failures
//!
//! The executor remembers every attempt: the action, the part, the reference, the place, the grasp and the part's pose,
//! and how it ended. A skill that placed its part counts as failed if the part is not in the intended state at the next
//! look. An attempt that failed the same way twice is not made a third time unchanged. If the action cannot be carried
//! out, the executor goes down a ladder (`recovery`, one recovery a file); each step is a
//! [`Recovery`](crate::task::event::Recovery) in the trace:
//!
//! | recovery | the robot |
//! |---|---|
//! | again | carries out the action once more; a dropped part, for example, lies elsewhere now |
//! | part, place | carries out the action with another part, or at another place or reference |
//! | grasp | takes the part by a grasp of the task that has not failed, then by any grasp that its shape allows |
//! | reseat | takes out a part in no state that lies at the target, or the reference itself |
//! | order | carries out another action first: the graph is asked as if the decided action were done |
//! | regrasp | puts the part down at a free place, as parts of its kind lay when they were found |
//! | push | tilts the part over or shoves it |
//! | clear | moves away a part near the target, beside the part, or in a state that forbids a fact |
//!
//! If the planner is stuck, parts that forbid a fact or that are put together out of place are taken apart, and parts in
//! no state are put down anew or pushed. A detour that worked gives earlier attempts
//! another chance. The number of detours is limited, in all and for each part, so that every episode ends; it ends at
//! once when nothing is left to try. A part off the table is lost: it is left out, and if the goal cannot be reached
//! without it, the episode ends with [`Ended::Lost`](crate::task::event::Ended::Lost).
//!
//! # Compilation
//!
//! [`PreparedEpisode`] finds the objects of the first look, compiles the problem over them
//! ([`Problem::ground`](crate::task::compile::Problem::ground)), and builds the planner graph. At each look, the
//! goal is the first fact of the goal that does not hold.
//!
//! * An object that rests keeps its state, even if its pose is noisy.
//! * If the graph is stuck, the problem is compiled anew from the present situation. Undecided needs that cannot be met
//!   any more are dropped.
//! * If there is nothing to drop, objects in no state, such as a dropped part, are taken to be where an action can take
//!   them; the reference planner ([`Problem::plan`](crate::task::compile::Problem::plan)) says where. Such a guess
//!   never counts as reaching the goal.
//! * If an object appears that the graph does not know, the problem is compiled anew.
//! * If the graph is stuck at the end, the reference planner says whether it still finds a plan
//!   ([`Episode::reference_moves`]).
//!
//! [`Ended`](crate::task::event::Ended) lists the ways in which an episode ends. The executor knows the learned domain and, from the
//! task, the grasps. It knows nothing else about the task. What it does goes by what the robot senses
//! ([`Sensed`](crate::robot::scene::Sensed)); where the bodies are in truth is for the physics and the judge alone.

mod act;
mod activity;
mod cell;
mod demonstrate;
mod episode;
mod hand;
mod live;
mod log;
mod model;
mod recorder;
mod recovery;
mod reporter;
mod senses;
mod world;

use std::sync::Arc;

use crate::sim::{InterventionLog, Seed, SimDuration, Threads};
use crate::task::error::TaskError;
use crate::task::recording::Sensing;
pub use crate::task::tasks::Perturbation;
use crate::task::tasks::{self, Task};
pub use activity::{ActivityFiles, ActivityRecorder, ModuleSamples};
pub use demonstrate::{
    Demonstrated, FailedMove, Unsolved, demonstrate, demonstrate_observed, demonstrate_sensed,
};
pub use episode::{Driver, Episode, PreparedEpisode, RECOMPILE, episode, episode_observed};
pub use recorder::Recorder;
pub use world::EpisodeWorld;

/// Settings of an episode.
#[derive(Debug, Clone)]
pub struct EpisodeSpec {
    /// Task that draws the scene.
    pub task: Arc<dyn Task>,
    /// Probability, for each grasp, that the fingers open at a uniformly drawn moment of the carrying (0 to
    /// 1).
    pub drop_rate: f64,
    /// Simulated time after which an episode is given up, in seconds (above 0, at most 86,400). Each part after the
    /// second adds 15%.
    pub limit_s: f64,
    /// Number of skills after which an episode is given up. Each part after the second adds 15%.
    pub most_skills: usize,
    /// Change that a person makes to the scene during the episode, if any.
    pub perturbation: Option<Perturbation>,
    /// Simulated time between the frames kept for pictures, in milliseconds; `None` keeps none.
    pub frame_ms: Option<u64>,
    /// Threads that compute the planner graph's ticks. The episode has the same bits either way.
    pub threads: Threads,
    /// Errors of the robot's sensing. If there are any, each look takes 25 frames and their mean; an object is seen if it is
    /// in two of them. The part in the hand is followed by the mean of its last 45 frames.
    pub sensing: Sensing,
    /// Interventions in the planner graph over the first scene. Ticks count from the start of the episode.
    pub interventions: InterventionLog,
}

impl Default for EpisodeSpec {
    fn default() -> Self {
        Self {
            task: tasks::default(),
            drop_rate: 0.0,
            limit_s: 400.0,
            most_skills: 30,
            perturbation: None,
            frame_ms: None,
            threads: Threads::Auto,
            sensing: Sensing::default(),
            interventions: InterventionLog::default(),
        }
    }
}

impl EpisodeSpec {
    /// Returns settings for episodes of a task, without drops or perturbation.
    pub fn of(task: impl Task + 'static) -> Self {
        Self { task: Arc::new(task), ..Self::default() }
    }

    /// Returns the limits of an episode with this number of parts: simulated time in seconds, and number of skills.
    pub(super) fn limits(&self, parts: usize) -> (f64, usize) {
        let share = 1.0 + 0.15 * parts.saturating_sub(2) as f64;
        (self.limit_s * share, (self.most_skills as f64 * share).ceil() as usize)
    }

    /// Returns the simulated time after which the simulator stops an episode, whatever its world says.
    pub(super) fn safeguard(&self, parts: usize) -> SimDuration {
        SimDuration::from_millis((self.limits(parts).0 * 1e3) as u64 + 120_000)
    }

    /// Checks that all numbers are in range and that the task's scene can be built.
    ///
    /// # Errors
    /// [`TaskError::Setting`] for a rate or limit outside its range, or for a perturbation of a body that
    /// does not exist or move; as [`Task::scene`] and [`SceneSpec::check`](crate::robot::scene::SceneSpec::check).
    pub fn check(&self) -> Result<(), TaskError> {
        let scene = self.task.scene(Seed::new(0))?;
        scene.check()?;
        self.sensing.check()?;
        let refuse =
            |name, value: String, expected| Err(TaskError::Setting { name, value, expected });
        if !(0.0..=1.0).contains(&self.drop_rate) {
            return refuse("drop_rate", self.drop_rate.to_string(), "0 to 1");
        }
        if let Some(perturbation) = &self.perturbation {
            if !scene.moves(perturbation.body) {
                return refuse(
                    "perturbation.body",
                    format!("{:?}", perturbation.body),
                    "a part or a movable fixture of the scene, counted from 0",
                );
            }
            let turn: f64 = perturbation.pose.orientation.iter().map(|v| v * v).sum();
            let finite =
                perturbation.pose.position.iter().all(|v| v.is_finite()) && turn.is_finite();
            if !finite || turn < 1e-6 || !perturbation.at_s.is_finite() {
                return refuse(
                    "perturbation",
                    format!("{perturbation:?}"),
                    "finite numbers and an orientation that is not zero",
                );
            }
        }
        if !(self.limit_s > 0.0 && self.limit_s <= 86_400.0) {
            return refuse("limit_s", self.limit_s.to_string(), "more than 0, at most 86400");
        }
        Ok(())
    }
}
