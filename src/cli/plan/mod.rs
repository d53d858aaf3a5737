//! `symbolt plan`: plans in a scene of a learned domain, or for a problem in PDDL.

mod args;
mod pddl;
mod scene;

use anyhow::Error;

pub(super) use self::args::PlanArgs;
use super::end::{Outcome, sentence};
use super::output::{emit, use_threads};

/// Returns what `--json` prints of a command line that could not be read, for this reason. `args` stands for it.
pub(crate) fn unread(args: &PlanArgs, fault: &str) -> String {
    pddl::unread(args, fault)
}

pub(crate) fn plan(args: &PlanArgs) -> Result<Outcome, Error> {
    let out = args.out.place();
    if let Err(error) = &out
        && args.common.json
        && args.scene.is_none()
    {
        emit(unread(args, &sentence(error)))?;
    }
    let out = out?;
    use_threads(&args.common)?;
    match &args.scene {
        Some(scene) => scene::plan(args, scene, &out),
        None => pddl::plan(args, &out),
    }
}
