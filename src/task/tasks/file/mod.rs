//! Tasks as data: a task file describes parts, references, grasps, the goal and perturbations.
//!
//! [`DataTask`] makes a [`Task`](crate::task::tasks::Task) of a [`TaskFile`]: it draws scenes, computes grasps, judges
//! by geometry, demonstrates, and perturbs. The tasks in `src/task/tasks/files` are written in this way.
//!
//! # The file
//!
//! A task file is a JSON object. Unknown fields are refused. Lengths are in metres, angles in degrees.
//!
//! | field | contents |
//! |---|---|
//! | `format`, `version` | `"symbolt-task"` and `1` |
//! | `name`, `description` | name and one line about the task |
//! | `parts` | kinds of movable parts: shape, density, friction, handling, look, grasps and starts ([`PartKind`]) |
//! | `references` | kinds of things that stay where they are: shape, look and starts ([`Reference`]) |
//! | `goal` | relations between parts and references ([`Relation`]) |
//! | `conditions` | relations that must hold only while others are brought about |
//! | `aside` | area in which the demonstrator puts parts that are in the way |
//! | `perturbations` | what another hand may do ([`Meddling`]) |
//! | `table`, `gripper`, `arm`, `step_ms` | settings of the scene; those of nuts and bolts if they are left out |
//!
//! A **shape** is a list of convex pieces ([`Shape`]): `box`, `prism` (also for cylinders), `ring` (for holes and
//! cups) and `hull`.
//!
//! A **grasp** is data in the frame of the part ([`GraspData`]): the point to which the tips of the fingers go, the
//! direction in which the hand points, the direction along which the fingers close, and how far they open before.
//! `around` repeats it about an axis and `tilts_deg` tilts the hand. A grasp is used whenever the hand points downwards,
//! at most `most_deg` from straight down. Give grasps for each side on which the part can come to rest.
//!
//! A part with a **slider** ([`SliderData`]) moves along a straight guide, like a drawer or a sliding lid. Its states are
//! places along the guide: a relation says that the drawer is open. What the drawer must be only for a while is a
//! condition, which other relations name in `needs`.
//!
//! A **start** ([`Start`]) is an area of the table or of a reference, or the top of another part. A layout is drawn
//! anew until all parts and references keep their distances, lie inside the rim, and the arm reaches all places of the
//! goal.
//!
//! A **relation** ([`Relation`]) says that parts of one kind stand at places in the frame of a reference, of another
//! part or of the world, and for how many: for `each` reference, for `one`, or `{"at_least": 4}`. `after` names the
//! relations that must hold before. Relations that do not name each other may be brought about in any order. `z_axis`
//! and `x_axis` of a place turn the part over or lay it down; `null` in `within_m` leaves it where it is.
//!
//! ```
//! use symbolt::task::tasks::Task;
//! use symbolt::task::tasks::file::DataTask;
//!
//! let text = r##"{
//!   "format": "symbolt-task", "version": 1,
//!   "name": "block-on-mat", "description": "put a block on the mat",
//!   "parts": [{
//!     "kind": "block",
//!     "shape": [{"box": {"middle": [0, 0, 0], "size_m": [0.03, 0.03, 0.02]}}],
//!     "density": 700,
//!     "handling": {"turns": 4, "flips": true, "release_m": 0.022},
//!     "look": {"colour": "#009e73"},
//!     "grasps": [
//!       {"at": [0, 0, -0.008], "approach": [0, 0, -1], "closing": [1, 0, 0], "openings_m": [0.023],
//!        "around": {"axis": [0, 0, 1], "times": 4}}
//!     ],
//!     "starts": [{"count": 2, "region": {"low": [0.4, 0.05], "high": [0.55, 0.25], "yaw_deg": [-180, 180]}}]
//!   }],
//!   "references": [
//!     {"name": "mat", "look": {"colour": "#999999"},
//!      "starts": [{"region": {"low": [0.4, -0.2], "high": [0.5, -0.1]}}]}
//!   ],
//!   "goal": [
//!     {"name": "block on mat", "part": "block", "reference": "mat", "for": "one",
//!      "places": [{"position": [0, 0, 0.01]}], "within_m": [0.005, 0.005, 0.002]}
//!   ],
//!   "aside": [[0.4, 0.0], [0.5, 0.3]]
//! }"##;
//! let task = DataTask::parse(text.as_bytes(), "block.json")?;
//! assert_eq!((task.name(), task.min_actions()), ("block-on-mat", 1));
//! # Ok::<(), symbolt::task::TaskError>(())
//! ```

mod check;
mod demonstrator;
mod draw;
mod format;
mod grasps;
mod relation;
mod shape;
mod task;

use serde::Deserialize;
use serde_json::Value;

pub use format::{
    Around, GraspData, HandlingData, LandmarkData, LookData, Meddling, Orientation, PartKind,
    Place, Quantity, Reference, Region, Relation, Shape, SliderData, Start, TaskFile,
};
pub use task::DataTask;

use crate::task::error::{InputFault, TaskError, json_problem};

/// Value of [`TaskFile::format`].
pub const FORMAT: &str = "symbolt-task";
/// Value of [`TaskFile::version`].
pub const VERSION: u32 = 1;
/// Name of the frame of the scene, where a reference is expected.
const WORLD: &str = "world";
const EXPECTED: &str = "a task file";

/// The fields that say what a file is.
#[derive(Deserialize)]
struct Head {
    format: Option<String>,
    version: Option<u32>,
}

impl TaskFile {
    /// Parses the text of a task file. `name` is the name of the file in error messages.
    ///
    /// # Errors
    /// [`TaskError::Input`], which names the line or the field, and what was expected there.
    pub fn parse(text: &[u8], name: &str) -> Result<Self, TaskError> {
        Ok(DataTask::parse(text, name)?.file().clone())
    }

    /// Returns the file as JSON text.
    pub fn to_json(&self) -> String {
        format!("{:#}\n", serde_json::json!(self))
    }

    /// Reads the fields without checking them.
    fn read_json(text: &[u8], name: &str) -> Result<Self, TaskError> {
        let fault = |error: serde_json::Error| InputFault {
            file: name.into(),
            line: (error.line() > 0).then(|| error.line()),
            field: String::new(),
            problem: json_problem(&error),
            expected: EXPECTED.into(),
        };
        if text.trim_ascii_start().first() != Some(&b'{') {
            return Err(head_fault(name, "", "not a JSON object".into(), EXPECTED).into());
        }
        let Head { format, version } = serde_json::from_slice(text).map_err(fault)?;
        if format.as_deref() != Some(FORMAT) {
            let found = format.map_or("missing".into(), |format| format!("`{format}`"));
            return Err(head_fault(name, "format", found, "`symbolt-task`").into());
        }
        if version != Some(VERSION) {
            let found = version.map_or("missing".into(), |version| version.to_string());
            return Err(head_fault(name, "version", found, "1").into());
        }
        Ok(serde_json::from_slice(text).map_err(fault)?)
    }

    /// Reads the fields from a JSON value without checking them.
    fn of_value(value: Value, name: &str) -> Result<Self, TaskError> {
        // As text, as the files are: another source would compile all the readers once more.
        let read = serde_json::from_slice(value.to_string().as_bytes());
        Ok(read.map_err(|error| head_fault(name, "", json_problem(&error), EXPECTED))?)
    }
}

fn head_fault(file: &str, field: &str, problem: String, expected: &str) -> InputFault {
    let (file, field, expected) = (file.into(), field.into(), expected.into());
    InputFault { file, line: None, field, problem, expected }
}
