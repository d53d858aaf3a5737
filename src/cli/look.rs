//! A scene as a learned domain sees it: what the commands on scenes share.

use std::collections::BTreeSet;
use std::path::Path;

use anyhow::Error;
use serde_json::{Value, json};
use symbolt::doubt::{Doubt, DoubtKind, doubts};
use symbolt::files::Limit;
use symbolt::sim::{few, meant};
use symbolt::task::classify::Layout;
use symbolt::task::compile::TargetPose;
use symbolt::task::domain::{GoalTerm, Quantity, RelationalDomain};
use symbolt::task::{Recording, Snapshot};

use super::domain_tables::{metres, other_goals};
use super::end::BadArgument;
use super::kind::{Given, Kind, parsed};
use super::options::GroundingArgs;
use super::output::{not_both_standard_input, warn};
use super::table::listed;

/// Extent of a scene in metres from which its lengths must be in another unit: not even a robot that drives goes so far.
const WIDEST_M: f64 = 50.0;

/// Reads a domain and a scene, not both from standard input.
pub(crate) fn read(domain: &Path, scene: &Path) -> Result<(RelationalDomain, Snapshot), Error> {
    not_both_standard_input(("domain", domain), ("scene", scene))?;
    let domain = Given { path: domain, takes: &[Kind::Domain] };
    let scene = Given { path: scene, takes: &[Kind::Scene] };
    let domain = parsed(domain, Limit::DOMAIN, &[scene], RelationalDomain::parse)?;
    let (mut scene, attributes) = parsed(scene, Limit::SCENE, &[], Snapshot::parse_attributed)?;
    domain.divide(&mut scene, &attributes).iter().for_each(|left| warn(&left.to_string()));
    Ok((domain, scene))
}

/// Returns the goal with a name, or the goal of the demonstrations.
pub(crate) fn wanted(
    domain: &RelationalDomain,
    name: Option<&str>,
) -> Result<Vec<GoalTerm>, Error> {
    match name {
        Some(goal) => Ok(vec![domain.goal(goal)?]),
        None if domain.goals.is_empty() => {
            let others =
                other_goals(domain).map_or_else(String::new, |others| format!(": {others}"));
            let problem = format!("the domain has no goal; name one with --goal STATE{others}");
            Err(BadArgument(problem).into())
        }
        None => {
            other_goals(domain).iter().for_each(|others| warn(others));
            Ok(domain.goals.clone())
        }
    }
}

/// Says of which kinds a goal asks for more objects than the scene has.
pub(crate) fn fewer(
    domain: &RelationalDomain,
    scene: &Snapshot,
    goals: &[GoalTerm],
) -> Vec<String> {
    let said = goals.iter().filter_map(|goal| {
        let Quantity::AtLeast(least) = goal.quantity else { return None };
        let kind = &domain.states[goal.state].kind;
        let present = scene.objects.iter().filter(|object| *object.kind == **kind).count();
        (1..least).contains(&present).then(|| {
            let words = domain.goal_in_words(goal);
            format!(
                "\"{words}\": the scene has {present} of the kind {kind}, and all of them will do"
            )
        })
    });
    said.collect()
}

/// Finds the state of every object, and warns of objects that are equally near to two references.
pub(crate) fn look(
    grounding: &GroundingArgs,
    domain: &RelationalDomain,
    scene: &Snapshot,
) -> Result<Layout, Error> {
    known(domain, scene.objects.iter().map(|object| &*object.kind))?;
    let classifier = grounding.classifier(domain)?;
    let layout = classifier.classify(scene);
    if layout.located.iter().all(|located| located.fact.is_none()) {
        // Then a unit or an axis is probably another one.
        in_metres(scene)?.iter().for_each(|doubt| warn(&doubt.to_string()));
    }
    let names = layout.object_names();
    for (index, located) in layout.located.iter().enumerate().filter(|(_, l)| l.ambiguous) {
        let Some(fact) = located.fact else { continue };
        let Some(reference) = fact.reference else { continue };
        // Without this reference, the object is found at the other one.
        let mut others = scene.clone();
        others.object = None;
        others.objects.remove(reference);
        let own = if reference < index { index - 1 } else { index };
        let other = classifier.classify_object(&others, own).fact.and_then(|fact| fact.reference);
        let other = other.and_then(|o| layout.object(&others.objects[o].id));
        let other = other.map_or("another one", |o| &names[o]);
        let words = domain.fact_in_words(&fact, index, &names);
        let taken = &names[reference];
        warn(&format!("{words}, or at {other}, which is equally near; {taken} is taken"));
    }
    Ok(layout)
}

/// Refuses a scene of objects in no state that is so wide that its lengths must be in another unit. Otherwise returns the doubts
/// about it.
fn in_metres(scene: &Snapshot) -> Result<Vec<Doubt>, BadArgument> {
    let side = |axis: usize| {
        let values = scene.objects.iter().map(|object| object.pose.position[axis]);
        values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
    };
    let wide = side(0).max(side(1)).max(side(2)) >= WIDEST_M;
    let doubts = doubts(&Recording::of_scene(scene.clone()));
    let of_all = |doubt: &&Doubt| doubt.kind == DoubtKind::LengthUnit && doubt.place.is_empty();
    match doubts.iter().find(of_all).filter(|_| wide) {
        Some(doubt) => Err(BadArgument(doubt.to_string())),
        None => Ok(doubts),
    }
}

/// Refuses objects if the domain knows none of their kinds, and warns of kinds that are probably misspelt.
pub(crate) fn known<'s>(
    domain: &RelationalDomain,
    kinds: impl Iterator<Item = &'s str>,
) -> Result<(), BadArgument> {
    let of_states: BTreeSet<&str> = domain.states.iter().map(|state| &*state.kind).collect();
    let frames = domain.states.iter().filter_map(|state| state.frame.kind());
    let known: BTreeSet<&str> = frames.chain(of_states.iter().copied()).collect();
    let seen: BTreeSet<&str> = kinds.collect();
    let foreign: Vec<&str> = seen.difference(&known).copied().collect();
    if foreign.is_empty() {
        return Ok(());
    }
    let have = format!("it has states of: {}", few(&of_states));
    if foreign.len() == seen.len() {
        let kinds = few(&foreign);
        return Err(BadArgument(format!(
            "the domain knows no object of this scene: {kinds}; {have}"
        )));
    }
    // What stands about needs no state, but a kind may be misspelt.
    for kind in foreign {
        let absent = of_states.iter().filter(|own| !seen.contains(**own)).copied();
        let meant = meant(kind, absent);
        if !meant.is_empty() {
            warn(&format!("the domain knows no kind `{kind}`{meant}; {have}"));
        }
    }
    Ok(())
}

/// Returns a line with the objects in no state whose kind has states; `None` if there are none.
pub(crate) fn loose(domain: &RelationalDomain, layout: &Layout) -> Option<String> {
    let loose = misses(domain, layout);
    (!loose.is_empty()).then(|| listed("In no state: ", &loose))
}

/// Returns the objects in no state whose kind has states, and by how much they miss the nearest.
pub(crate) fn misses(domain: &RelationalDomain, layout: &Layout) -> Vec<String> {
    let known = |kind: &str| domain.states.iter().any(|state| state.kind == kind);
    let names = layout.object_names();
    let all = layout.objects.iter().zip(&layout.located).enumerate();
    let loose = all.filter(|(_, (o, l))| l.fact.is_none() && known(&o.kind));
    let loose = loose.map(|(index, (_, l))| match l.miss {
        None => names[index].clone(),
        Some(miss) => {
            let nearest = domain.fact_in_words(&miss.nearest, index, &names);
            format!("{} (nearest: {nearest}, {})", names[index], miss.offset.in_words())
        }
    });
    loose.collect()
}

/// Returns the coordinates of a target in words, in metres.
pub(crate) fn position(target: &TargetPose) -> String {
    target.pose.position.map(|v| metres(v, 3)).join(", ")
}

pub(crate) fn target_json(target: &TargetPose) -> Value {
    json!({
        "position": target.pose.position, "orientation": target.pose.orientation,
        "turn": target.turn.name(),
    })
}
