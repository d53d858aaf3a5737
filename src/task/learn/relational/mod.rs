//! States in frames, operators with parameters, and a goal: the default method.

mod carried;
mod cluster;
mod following;
mod frames;
mod goals;
mod layers;
mod level;
mod likelihood;
mod means;
mod models;
mod motion;
mod noise;
mod operators;
mod places;
mod rows;
mod shared;
mod sides;
mod single;
mod states;
mod taken;
mod together;
mod views;

use super::attributes::Family;
use super::summary::{AttemptReport, LearnReport, UnexplainedPoses};
use super::{Learned, Remark, Settings, nothing, remark};
use crate::robot::Pose;
use crate::task::domain::RelationalDomain;
use crate::task::domain::naming::{landmarks, name_all};
use crate::task::error::TaskError;
use crate::task::event::{Event, LearningStep, Observer};
use crate::task::propositional::ActionId;
use crate::task::recording::Recording;
use motion::Motion;
use views::Shifted;

/// Greatest number of things that are seen elsewhere in some demonstrations.
const MOST_SHIFTED: usize = 8;

/// Learns from a recording whose settings were checked. `families` is [`Motion::families`].
pub(super) fn learn(
    recording: &Recording,
    families: &[Family],
    settings: &Settings,
    observer: &mut dyn Observer,
) -> Result<Learned, TaskError> {
    if recording.demos.len() < 2 {
        let mut learned = single::learn(recording, settings, observer)?;
        let (domain, noise) = (&mut learned.domain, noise::noise(recording));
        (domain.noise_m, domain.noise_rad) = (noise.position_m, noise.angle_rad);
        // One demonstration does not tell an effect from a coincidence.
        domain.operators.iter_mut().for_each(|operator| operator.side_effects.clear());
        domain.goals = single::goals(domain, recording);
        learned.unsure_frames = single::unsure_frames(domain, recording);
        for (state, kind) in &learned.unsure_frames {
            let warning = format!(
                "one demonstration does not tell whether `{state}` is a place in the world or beside a `{kind}`; it was \
                 learned in the world, and fails if the `{kind}` stands elsewhere"
            );
            observer.observe(&Event::Warned(&warning));
        }
        return Ok(learned);
    }
    let snapshots = recording.snapshot_count();
    observer.observe(&Event::Learning(LearningStep::Following { snapshots }));
    let mut motion = Motion::of(recording, settings.p);
    motion.families = families.to_vec();
    if motion.attempts.iter().all(|a| a.track.is_none()) {
        let moved = motion.rests.iter().any(|r| r.came != motion::Came::Found);
        return Err(nothing(if moved {
            "no object was picked up and released; expected at least one attempt"
        } else {
            "no object moved; expected at least one object to move by 1 mm or more"
        }));
    }
    let mut level = level::level(&mut motion);
    let mut found = states::find(&motion);
    let mut shifted = Vec::new();
    while shifted.len() < MOST_SHIFTED
        && let Some(one) = views::shifted(&motion, &found)
    {
        one.correct(&mut motion, &found);
        found = states::find(&motion);
        shifted.push(one);
    }
    observer.observe(&Event::Learning(LearningStep::Deciding));
    let mut built = operators::find(&motion, &found);
    let fixed = |kind: &str| found.fixed.iter().any(|own| own == kind);
    let marks = landmarks(recording, fixed);
    let goals::Goals { terms: goals, unachieved, missed } =
        goals::goals(&motion, &found, &built.operators);
    let words = name_all(&mut found.states, &mut built.operators, &goals, &marks);
    let no_goal = goals.is_empty().then(|| goals::lacking(&motion, &found, &built.operators));
    let unachieved: Vec<String> =
        unachieved.into_iter().map(|state| found.states[state].name.clone()).collect();
    for state in &unachieved {
        let warning = format!(
            "`{state}` held at the end of the demonstrations, but no action that achieves it was learned; it is not part \
             of the goal"
        );
        observer.observe(&Event::Warned(&warning));
    }
    let report = report(&motion, &found, &built);
    // What nothing lies on says nothing.
    level.retain(|kind, _| found.states.iter().any(|state| state.frame.kind() == Some(kind)));
    let domain = RelationalDomain {
        states: found.states,
        operators: built.operators,
        goals,
        noise_m: motion.noise.position_m,
        noise_rad: motion.noise.angle_rad,
        level,
        provenance: settings.provenance(recording),
        sub_kinds: Vec::new(),
        words,
    };
    domain.check()?;
    let mut remarks = Vec::new();
    remarks.extend(motion.views.map(|(kind, off_m)| Remark::ViewsDiffer { kind, off_m }));
    remarks.extend(shifted.into_iter().map(|Shifted { own, reference, demos, by }| {
        let demos = demos.into_iter().map(|d| recording.demos[d].number).collect();
        let off_m = by.iter().map(|v| v * v).sum::<f64>().sqrt();
        Remark::DemonstrationsDiffer { kind: own, reference, demos, off_m }
    }));
    remarks.extend(found.moved_by_others.into_iter().map(|kind| Remark::MovedByOthers { kind }));
    let missed = missed.into_iter().filter(|_| no_goal.is_none());
    remarks.extend(missed.map(|(state, held)| {
        let (kind, state) = (domain.states[state].kind.clone(), domain.states[state].name.clone());
        Remark::NotInGoal { kind, state, held, of: recording.demos.len() }
    }));
    remarks.extend(no_goal.map(Remark::NoGoal));
    remarks.extend(remark::alike(&domain));
    let (outliers, unsure_frames) = (motion.outliers, Vec::new());
    Ok(Learned { domain, report, outliers, unachieved, unsure_frames, remarks })
}

fn report(
    motion: &Motion<'_>,
    found: &states::States,
    built: &operators::Operators,
) -> LearnReport {
    let attempts = motion.attempts.iter().zip(&built.judged).map(|(attempt, judged)| {
        let (demo, tracks) = (motion.demo(attempt.demo), &motion.tracks[attempt.demo]);
        AttemptReport::new(attempt, demo, tracks, judged.map(ActionId::new))
    });
    let unexplained = found.unexplained.iter().filter_map(|u| {
        let poses: Vec<Pose> = u.rests.iter().map(|r| motion.rests[*r].pose).collect();
        let seen = u.rests.iter().map(|r| (motion.rests[*r].demo, motion.rests[*r].first));
        UnexplainedPoses::new(&u.kind, &poses, seen, motion.recording)
    });
    LearnReport {
        attempts: attempts.collect(),
        unexplained: unexplained.collect(),
        fixed_kinds: found.fixed.clone(),
    }
}
