//! How objects are followed and demonstrations cut into attempts, as the learner reports it.

#![allow(clippy::expect_used)]

use symbolt::robot::Pose;
use symbolt::task::learn::{Settings, learn};
use symbolt::task::{Demonstration, ObjectPose, Recording, Snapshot, SnapshotEvent};

/// A snapshot of parts on a line.
fn snapshot(event: Option<SnapshotEvent>, object: Option<usize>, xs: &[f64]) -> Snapshot {
    let part = |(i, x): (usize, &f64)| ObjectPose {
        id: format!("part_{i}").into(),
        kind: "part".into(),
        pose: Pose::at([*x, 0.0, 0.0]),
    };
    Snapshot {
        event,
        object,
        objects: xs.iter().enumerate().map(part).collect(),
        ..Snapshot::default()
    }
}

/// The attempts of a demonstration: the snapshots before and after, the part, and whether it was inferred.
fn cut(mut snapshots: Vec<Snapshot>) -> Vec<(u64, u64, Option<String>, bool)> {
    snapshots.iter_mut().zip(0..).for_each(|(snapshot, number)| snapshot.number = number);
    let recording = Recording { demos: vec![Demonstration { number: 0, snapshots }] };
    let learned = learn(&recording, &Settings::paper()).expect("something moves");
    let attempts = learned.report.attempts.into_iter();
    attempts.map(|a| (a.before, a.after, a.object, a.inferred)).collect()
}

fn part(number: usize) -> Option<String> {
    Some(format!("part_{number}"))
}

#[test]
fn without_events_every_step_is_an_attempt_with_the_part_that_moved_most() {
    let attempts = cut(vec![
        snapshot(None, None, &[0.0, 1.0]),
        snapshot(None, None, &[0.01, 1.5]),
        snapshot(None, None, &[0.01, 1.5]),
    ]);
    assert_eq!(attempts, [(0, 1, part(1), true), (1, 2, None, true)]);
}

#[test]
fn with_events_an_attempt_lasts_from_contact_to_the_snapshot_after_the_release() {
    use SnapshotEvent::{Contact, End, Release, Start};
    let attempts = cut(vec![
        snapshot(Some(Start), None, &[0.0, 1.0]),
        snapshot(Some(Contact), Some(0), &[0.0, 1.0]),
        snapshot(Some(Release), Some(0), &[0.5, 1.0]),
        snapshot(Some(Contact), Some(1), &[0.4, 1.0]),
        snapshot(Some(Release), Some(1), &[0.4, 2.0]),
        snapshot(Some(End), None, &[0.4, 2.0]),
    ]);
    assert_eq!(attempts, [(1, 3, part(0), false), (3, 5, part(1), false)]);
}

#[test]
fn a_part_that_slips_away_without_a_release_ends_its_attempt_at_the_next_contact() {
    use SnapshotEvent::{Contact, Release};
    let attempts = cut(vec![
        snapshot(Some(Contact), Some(0), &[0.0, 1.0]),
        snapshot(Some(Contact), Some(1), &[0.2, 1.0]),
        snapshot(Some(Release), Some(1), &[0.2, 2.0]),
    ]);
    assert_eq!(attempts, [(0, 1, part(0), false), (1, 2, part(1), false)]);
}

#[test]
fn two_contacts_with_one_part_are_two_attempts_if_it_moved_between() {
    use SnapshotEvent::Contact;
    let attempts = cut(vec![
        snapshot(Some(Contact), Some(0), &[0.0, 1.0]),
        snapshot(Some(Contact), Some(0), &[0.5, 1.0]),
        snapshot(Some(Contact), Some(0), &[0.5, 1.0]),
        snapshot(None, None, &[0.9, 1.0]),
    ]);
    assert_eq!(attempts, [(0, 1, part(0), false), (1, 3, part(0), false)]);
}

#[test]
fn events_without_objects_still_cut_attempts() {
    use SnapshotEvent::{Contact, Release};
    let attempts = cut(vec![
        snapshot(Some(Contact), None, &[0.0, 1.0]),
        snapshot(Some(Release), None, &[0.5, 1.0]),
        snapshot(Some(Contact), Some(1), &[0.5, 1.0]),
        snapshot(Some(Release), None, &[0.5, 2.0]),
        snapshot(None, None, &[0.5, 2.0]),
    ]);
    let ends: Vec<_> = attempts.iter().map(|(before, after, ..)| (*before, *after)).collect();
    assert_eq!(ends, [(0, 2), (2, 4)]);
}

/// A snapshot of nuts with these ids on a line.
fn nuts(objects: &[(&str, f64)]) -> Snapshot {
    let object = |(id, x): &(&str, f64)| ObjectPose {
        id: (*id).into(),
        kind: "nut".into(),
        pose: Pose::at([*x, 0.0, 0.0]),
    };
    Snapshot { objects: objects.iter().map(object).collect(), ..Snapshot::default() }
}

#[test]
fn ids_are_identities_while_their_number_stays() {
    // If objects were followed by position, none would have moved.
    let attempts = cut(vec![nuts(&[("a", 0.0), ("b", 1.0)]), nuts(&[("b", 0.0), ("a", 1.0)])]);
    assert_eq!(attempts, [(0, 1, Some("a".into()), true)]);
}

#[test]
fn a_lost_part_ends_its_track_and_shifted_ids_do_not_confuse_the_others() {
    let attempts = cut(vec![
        nuts(&[("nut_0", 0.0), ("nut_1", 1.0), ("nut_2", 2.0)]),
        nuts(&[("nut_0", 1.0), ("nut_1", 2.0005)]),
        nuts(&[("nut_0", 1.0), ("nut_1", 5.0)]),
    ]);
    // The first is lost, and the last, now called `nut_1`, is moved.
    let object = |id: &str| Some(id.to_owned());
    assert_eq!(attempts, [(0, 1, object("nut_0"), true), (1, 2, object("nut_1"), true)]);
}
