//! Scores the relational learner in a world: what it learned against the truth, and its plans move by move.

use super::episode::{Outcome, carry_out};
use super::explore::explore;
use super::score::{NeedScore, Rates, SaidState, StateScore, score_needs, score_states};
use super::{Need, Planning, Stage, World};
use crate::sim::Seed;
use crate::task::TaskError;
use crate::task::classify::{Classifier, Layout};
use crate::task::compile::Problem;
use crate::task::domain::{
    GoalTerm, NeedVerdict, Quantity, RelationalDomain, RelationalOperator, Role, Subject,
};
use crate::task::learn::{Settings, learn};
use crate::task::recording::Sensing;
use crate::task::recording::Snapshot;

/// Settings of an evaluation.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Number of demonstrations.
    pub demos: usize,
    /// Number of test scenes.
    pub episodes: usize,
    /// Planner of the tests.
    pub planner: Planning,
    /// Errors of the poses, in the demonstrations and in the tests.
    pub sensing: Sensing,
    /// Seed of the demonstrations, the tests and the sensing.
    pub seed: Seed,
}

/// What an evaluation found.
#[derive(Debug, Clone, Default)]
pub struct Evaluation {
    /// Outcome of each episode.
    pub outcomes: Vec<Outcome>,
    /// Score of the states and poses.
    pub states: StateScore,
    /// Score of the needs of every action that was learned or had to be learned.
    pub needs: Rates,
    /// Required needs that the world does not demand, by the state that the object enters.
    pub wrong: Vec<(&'static str, Need)>,
    /// Needs that were not found, by the state that the object enters.
    pub missed: Vec<(&'static str, Need)>,
    /// Why nothing was learned, or no plan was found.
    pub trouble: Vec<String>,
}

impl Evaluation {
    /// Returns the number of episodes in which the goal was reached and recognised.
    pub fn done(&self) -> usize {
        self.outcomes.iter().filter(|o| o.done()).count()
    }

    /// Returns the number of episodes in which the goal was reached.
    pub fn solved(&self) -> usize {
        self.outcomes.iter().filter(|o| o.solved).count()
    }

    /// Returns the number of episodes in which the goal was held for reached and was not.
    pub fn false_goals(&self) -> usize {
        self.outcomes.iter().filter(|o| o.met && !o.solved).count()
    }
}

/// Moves that an episode may take.
pub(crate) const MOST_MOVES: usize = 60;

/// Learns from demonstrations in a world, scores what was learned, and plans in test scenes.
///
/// # Errors
/// As [`Sensing::check`].
pub fn evaluate(world: &World, trial: &Trial) -> Result<Evaluation, TaskError> {
    trial.sensing.check()?;
    let shown = world.show(trial.demos, trial.seed);
    let recording = trial.sensing.apply_recording(&shown.recording, trial.seed);
    let mut out = Evaluation::default();
    let learned = match learn(&recording, &Settings::default()) {
        Ok(learned) => learned,
        Err(error) => {
            out.trouble.push(error.to_string());
            out.outcomes = vec![Outcome::default(); trial.episodes];
            return Ok(out);
        }
    };
    let domain = &learned.domain;
    let classifier = Classifier::new(domain);
    let said: Vec<Vec<Vec<Option<SaidState>>>> = shown
        .recording
        .demos
        .iter()
        .map(|demo| {
            let mut last: Option<Layout> = None;
            let layouts = demo.snapshots.iter().map(|snapshot| {
                let layout = seen(&classifier, last.as_ref(), snapshot);
                let said = said(domain, &layout);
                last = Some(layout);
                said
            });
            layouts.collect()
        })
        .collect();
    out.states = score_states(&shown, &said);
    score_operators(world, domain, &mut out);
    let mut planned = domain.clone();
    // Where demonstrations end differently, the user takes the first of the goals that are offered and that he means.
    let meant = |state: &usize| {
        let name = out.states.names.get(&domain.states[*state].name);
        let goals = || world.0.goal.iter().chain(&world.0.or_goal);
        !world.0.or_goal.is_empty() && name.is_some_and(|n| goals().any(|goal| goal.state == *n))
    };
    if let Some(state) = domain.other_goals().into_iter().find(meant) {
        let (quantity, of) = (Quantity::AtLeast(1), trial.demos);
        planned.goals =
            vec![GoalTerm { state, or: Vec::new(), quantity, reference: None, held: 0, of }];
    }
    let (outcomes, trouble) = episodes(world, &planned, trial);
    out.outcomes = outcomes;
    out.trouble = trouble;
    Ok(out)
}

/// Plans in test scenes of a world and carries out the plans move by move, with a new plan after each move. Returns the
/// outcomes, and why episodes failed.
pub fn episodes(
    world: &World,
    domain: &RelationalDomain,
    trial: &Trial,
) -> (Vec<Outcome>, Vec<String>) {
    let classifier = Classifier::new(domain);
    let (mut outcomes, mut troubles) = (Vec::new(), Vec::new());
    for episode in 0..trial.episodes {
        let seed = trial.seed.derive_index("test", episode as u64);
        let mut run = world.begin(seed, Stage::Test);
        let mut last: Option<Layout> = None;
        let mut tried: Vec<(usize, usize)> = Vec::new();
        let (outcome, trouble) = carry_out(&mut run, MOST_MOVES, &trial.sensing, seed, |scene| {
            let layout = seen(&classifier, last.as_ref(), scene);
            let step = next(domain, &layout, &mut tried, trial);
            last = Some(layout);
            step
        });
        if !outcome.done() {
            let why = trouble.unwrap_or_else(|| format!("{outcome:?}"));
            troubles.push(format!("episode {episode}: {why}"));
        }
        outcomes.push(outcome);
    }
    (outcomes, troubles)
}

/// Classifies with hysteresis after the first scene.
fn seen(classifier: &Classifier, last: Option<&Layout>, scene: &Snapshot) -> Layout {
    let after = |before| classifier.classify_after(before, scene);
    last.map_or_else(|| classifier.classify(scene), after)
}

fn said(domain: &RelationalDomain, layout: &Layout) -> Vec<Option<SaidState>> {
    let state = |fact: crate::task::domain::Fact| SaidState {
        state: domain.states[fact.state].name.clone(),
        reference: fact.reference.map(|r| layout.objects[r].id.to_string()),
    };
    layout.located.iter().map(|l| l.fact.map(state)).collect()
}

type Step = Option<(String, crate::robot::Pose)>;

/// Returns the next move, as an object's id and a target pose. `tried` counts the objects that were moved.
fn next(
    domain: &RelationalDomain,
    layout: &Layout,
    tried: &mut Vec<(usize, usize)>,
    trial: &Trial,
) -> Result<Step, String> {
    let problem = Problem::new(domain, layout).map_err(|e| e.to_string())?;
    let avoid: Vec<usize> = tried.iter().filter(|(_, n)| *n >= 2).map(|(i, _)| *i).collect();
    let first = trial.planner.first(&problem, layout, &avoid, trial.seed)?;
    let Some(m) = first else { return Ok(None) };
    match tried.iter_mut().find(|(i, _)| *i == m.object) {
        Some((_, n)) => *n += 1,
        None => tried.push((m.object, 1)),
    }
    let target = problem.target(&m, layout);
    Ok(Some((layout.objects[m.object].id.to_string(), target.pose)))
}

fn score_operators(world: &World, domain: &RelationalDomain, out: &mut Evaluation) {
    let name = |state: usize| out.states.names.get(&domain.states[state].name).copied();
    for (job, always) in world.0.jobs.iter().zip(explore(&world.0)) {
        let own = domain.operators.iter().find(|o| name(o.to) == Some(job.to));
        let (required, undecided) = match own {
            Some(operator) => stated(operator, &name),
            None => (Vec::new(), Vec::new()),
        };
        let demanded: Vec<Need> = world.0.needs_of(job.to).collect();
        let NeedScore { rates, wrong, missed } =
            score_needs(&demanded, &always, &required, &undecided);
        out.needs = out.needs.plus(&rates);
        out.wrong.extend(wrong.into_iter().map(|n| (job.to, n)));
        out.missed.extend(missed.into_iter().map(|n| (job.to, n)));
    }
}

/// Returns an operator's required and undecided needs, in the true states' names.
fn stated(
    operator: &RelationalOperator,
    name: &dyn Fn(usize) -> Option<&'static str>,
) -> (Vec<Need>, Vec<Need>) {
    let (mut required, mut undecided) = (Vec::new(), Vec::new());
    if let [from] = operator.from[..]
        && let Some(state) = name(from)
    {
        // The state that the object leaves is a parameter's range, not an assertion that no other will do.
        undecided.push(Need::Object(state));
    }
    // A condition that several states fulfil demands none of them.
    for need in operator.needs.iter().filter(|need| need.or.is_empty()) {
        let Some(state) = name(need.condition.state) else { continue };
        let said = match (need.condition.subject, need.holds) {
            (Subject::Is(Role::Target), true) => Need::Reference(state),
            (Subject::At(Role::Target), true) => Need::Holds { state, at_least: need.least },
            (Subject::Any, true) => Need::Somewhere(state),
            (Subject::At(Role::Target), false) => Need::Clear(state),
            (Subject::Any, false) => Need::Nowhere(state),
            _ => continue,
        };
        match need.verdict {
            NeedVerdict::Undecided => undecided.push(said),
            NeedVerdict::Required | NeedVerdict::Absent => required.push(said),
        }
    }
    (required, undecided)
}
