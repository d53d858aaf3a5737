//! The events that observers receive from demonstrations, learning, episodes and experiments.
#![cfg(feature = "physics")]

use std::sync::Arc;

use serde_json::Value;
use symbolt::files::ResultFolder;
use symbolt::robot::scene::{Scene, SceneSpec, Sensed};
use symbolt::robot::skill::{Grasp, Target};
use symbolt::robot::{SkillOutcome, SkillReport};
use symbolt::sim::Seed;
use symbolt::study::catalogue::{Options, find};
use symbolt::study::experiment::{Run, Shard};
use symbolt::task::TaskError;
use symbolt::task::event::Event;
use symbolt::task::execute::{
    EpisodeSpec, demonstrate, demonstrate_observed, episode, episode_observed,
};
use symbolt::task::learn::{Settings, learn, learn_observed};
use symbolt::task::planner::{PlannerBuild, PlannerKind};
use symbolt::task::tasks::nuts_and_bolts::NutsAndBolts;
use symbolt::task::tasks::{Demonstrator, Judgement, Step, Task};

/// Returns the name of an event's variant.
fn name(event: &Event<'_>) -> &'static str {
    match event {
        Event::Learning(_) => "learning",
        Event::DemonstrationBegan { .. } => "demonstration began",
        Event::DemonstrationEnded { .. } => "demonstration ended",
        Event::Stepped { .. } => "stepped",
        Event::Touched(_) => "touched",
        Event::SkillBegan { .. } => "skill began",
        Event::SkillEnded { .. } => "skill ended",
        Event::EpisodeBegan { .. } => "episode began",
        Event::Ticked { .. } => "ticked",
        Event::Decided(_) => "decided",
        Event::Framed(_) => "framed",
        Event::EpisodeEnded(_) => "episode ended",
        Event::Trials { .. } => "trials",
        _ => "another",
    }
}

#[test]
fn demonstrations_learning_and_an_episode_are_told_in_order_and_come_out_as_if_nobody_listened() {
    let (scene, seed) = (NutsAndBolts::default(), Seed::new(1));
    let mut told = Vec::new();
    let mut skills: Vec<SkillReport> = Vec::new();
    let shown = demonstrate_observed(&scene, 2, seed, &mut |event: &Event<'_>| {
        if let Event::SkillEnded { report, decision, .. } = event {
            assert!(decision.is_none(), "a demonstrator does not decide");
            skills.push(**report);
        }
        if !matches!(event, Event::Stepped { .. }) {
            told.push(name(event));
        }
    })
    .expect("it can be shown");
    assert_eq!(shown, demonstrate(&scene, 2, seed).expect("it can be shown"));
    assert_eq!(skills, shown.skills.concat());
    let one = ["skill began", "touched", "touched", "skill ended"];
    let whole = [&["demonstration began"], &one[..], &one, &one, &["demonstration ended"]].concat();
    assert_eq!(told, [whole.clone(), whole].concat());

    let mut told = Vec::new();
    let mut listen = |event: &Event<'_>| told.push(name(event));
    let learned =
        learn_observed(&shown.recording, &Settings::paper(), &mut listen).expect("learns");
    assert_eq!(learned, learn(&shown.recording, &Settings::paper()).expect("learns"));
    // One event for tracking, one for clustering each of the two kinds, and one for deciding.
    assert_eq!(told, ["learning"; 4]);

    let domain = learned.domain;
    let build = PlannerBuild { kind: PlannerKind::Chain, ..PlannerBuild::default() };
    let spec = EpisodeSpec { drop_rate: 0.5, frame_ms: Some(400), ..EpisodeSpec::default() };
    let (mut told, mut owned, mut frames) = (Vec::new(), 0, 0);
    let mut last_s = 0.0;
    let listen = &mut |event: &Event<'_>| {
        match event {
            Event::SkillEnded { report, decision, .. } => {
                let decision = decision.expect("the planner decided it");
                assert_eq!(decision.skill.as_ref(), Some(*report));
                owned += 1;
            }
            Event::Stepped { time_s } => {
                assert!(*time_s > last_s, "time goes on");
                last_s = *time_s;
            }
            Event::Framed(_) => frames += 1,
            _ => {}
        }
        if !matches!(event, Event::Stepped { .. } | Event::Ticked { .. } | Event::Framed(_)) {
            told.push(name(event));
        }
    };
    let seed = Seed::new(4);
    let over = episode_observed(&domain, &build, &spec, seed, listen).expect("it runs");
    let alone = episode(&domain, &build, &spec, seed).expect("it runs");
    assert_eq!(over.report, alone.report);
    assert!(over.report.drops() > 0, "{:?}", over.report);
    assert_eq!((owned, frames), (over.report.skills().count(), over.frames.len()));
    assert!(frames > 10);
    assert_eq!((told.first(), told.last()), (Some(&"episode began"), Some(&"episode ended")));
    // Every skill begins right after its decision and ends before the next one.
    let acts: Vec<&str> = told.iter().copied().filter(|n| *n != "touched").collect();
    let mut begun = 0;
    for (index, name) in acts.iter().enumerate().filter(|(_, n)| **n == "skill began") {
        assert_eq!(
            (acts[index - 1], *name, acts[index + 1]),
            ("decided", "skill began", "skill ended")
        );
        begun += 1;
    }
    assert!(begun >= 4 && begun == owned, "{told:?}");
    assert_eq!(over.report.touches.len(), told.iter().filter(|n| **n == "touched").count());
}

#[test]
fn an_experiment_tells_of_every_trial_that_is_done_and_last_of_all_of_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let options = Options { trials: Some(5), ..Default::default() };
    let experiment = find("figure-1a", &options).expect("there is one");
    let results = ResultFolder::open(folder.path()).expect("opens");
    let run =
        Run::new(&*experiment, Seed::new(1), Shard::default(), results).with_trials(options.trials);
    let mut told = Vec::new();
    let results = run.go(&mut |event: &Event<'_>| {
        if let Event::Trials { done, of } = event {
            told.push((*done, *of));
        }
    });
    assert!(results.expect("it runs").is_some());
    let all = run.trials();
    assert!(all > 0 && told.first() == Some(&(0, all)) && told.last() == Some(&(all, all)));
}

/// The nuts-and-bolts task with a demonstrator that first tries a target out of reach.
#[derive(Debug)]
struct Overreaching(NutsAndBolts);

/// Tries a target out of reach once, then follows the inner demonstrator.
struct Reaching(Box<dyn Demonstrator>);

impl Demonstrator for Reaching {
    fn next(&mut self, scene: &Scene, so_far: &[SkillReport]) -> Option<Step> {
        let target = Target::upright([9.0, 0.0, 9.0]);
        if so_far.is_empty() {
            return Some(Step { part: 0, target });
        }
        self.0.next(scene, &[])
    }
}

impl Task for Overreaching {
    fn name(&self) -> &'static str {
        "overreaching"
    }
    fn description(&self) -> &'static str {
        "nuts and bolts, with a first target out of reach"
    }
    fn settings(&self) -> Value {
        self.0.settings()
    }
    fn with_settings(&self, text: &[u8], file: &str) -> Result<Arc<dyn Task>, TaskError> {
        self.0.with_settings(text, file)
    }
    fn scene(&self, seed: Seed) -> Result<SceneSpec, TaskError> {
        self.0.scene(seed)
    }
    fn grasps(&self, scene: &Sensed<'_>, part: usize) -> Vec<Grasp> {
        self.0.grasps(scene, part)
    }
    fn demonstrator(&self, seed: Seed, demo: usize) -> Box<dyn Demonstrator> {
        Box::new(Reaching(self.0.demonstrator(seed, demo)))
    }
    fn judge(&self, scene: &Scene) -> Judgement {
        self.0.judge(scene)
    }
    fn min_actions(&self) -> usize {
        self.0.min_actions()
    }
}

#[test]
fn a_skill_that_cannot_begin_is_told_as_ended() {
    let task = Overreaching(NutsAndBolts::default());
    let (mut begun, mut ended) = (0, Vec::new());
    let shown =
        demonstrate_observed(&task, 1, Seed::new(1), &mut |event: &Event<'_>| match event {
            Event::SkillBegan { .. } => begun += 1,
            Event::SkillEnded { report, .. } => ended.push(**report),
            _ => {}
        });
    assert_eq!(ended, shown.expect("it can be shown").skills[0]);
    assert_eq!((begun, ended.len()), (3, 4));
    assert_eq!(ended[0].outcome, SkillOutcome::Unreachable);
}
