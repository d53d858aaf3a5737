//! How demonstrations are cut into attempts, and which object each of them is taken to have moved.

use symbolt::robot::Pose;
use symbolt::task::learn::{Settings, learn};
use symbolt::task::recording::{Demonstration, ObjectPose};
use symbolt::task::{Recording, Snapshot, SnapshotEvent};

fn snapshot(event: Option<SnapshotEvent>, object: Option<usize>, xs: &[f64]) -> Snapshot {
    let part = |(i, x): (usize, &f64)| ObjectPose {
        id: format!("part_{i}").into(),
        kind: "part".into(),
        pose: Pose::at([*x, 0.0, 0.0]),
    };
    let objects = xs.iter().enumerate().map(part).collect();
    Snapshot { event, object, objects, ..Snapshot::default() }
}

/// The snapshots before and after each attempt, and its object.
fn cut_all(mut snapshots: Vec<Snapshot>) -> Vec<(u64, u64, Option<String>)> {
    snapshots.iter_mut().zip(0..).for_each(|(snapshot, number)| snapshot.number = number);
    let recording = Recording { demos: vec![Demonstration { number: 0, snapshots }] };
    let report = learn(&recording, &Settings::paper()).expect("it can be learned").report;
    report.attempts.into_iter().map(|t| (t.before, t.after, t.object)).collect()
}

fn part(number: usize) -> Option<String> {
    Some(format!("part_{number}"))
}

#[test]
fn without_events_every_step_is_an_attempt_with_the_part_that_moved_most() {
    let attempts = cut_all(vec![
        snapshot(None, None, &[0.0, 1.0]),
        snapshot(None, None, &[0.01, 1.5]),
        snapshot(None, None, &[0.01, 1.5]),
    ]);
    assert_eq!(attempts, [(0, 1, part(1)), (1, 2, None)]);
}

#[test]
fn with_events_an_attempt_lasts_from_contact_to_the_snapshot_after_the_release() {
    use SnapshotEvent::{Contact, End, Release, Start};
    let attempts = cut_all(vec![
        snapshot(Some(Start), None, &[0.0, 1.0]),
        snapshot(Some(Contact), Some(0), &[0.0, 1.0]),
        snapshot(Some(Release), Some(0), &[0.5, 1.0]),
        snapshot(Some(Contact), Some(1), &[0.4, 1.0]),
        snapshot(Some(Release), Some(1), &[0.4, 2.0]),
        snapshot(Some(End), None, &[0.4, 2.0]),
    ]);
    assert_eq!(attempts, [(1, 3, part(0)), (3, 5, part(1))]);
}

#[test]
fn a_part_that_slips_away_without_a_release_ends_its_attempt_at_the_next_contact() {
    use SnapshotEvent::{Contact, Release};
    let attempts = cut_all(vec![
        snapshot(Some(Contact), Some(0), &[0.0, 1.0]),
        snapshot(Some(Contact), Some(1), &[0.2, 1.0]),
        snapshot(Some(Release), Some(1), &[0.2, 2.0]),
    ]);
    assert_eq!(attempts, [(0, 1, part(0)), (1, 2, part(1))]);
}

#[test]
fn two_contacts_with_one_part_are_two_attempts_if_it_moved_between() {
    use SnapshotEvent::Contact;
    let attempts = cut_all(vec![
        snapshot(Some(Contact), Some(0), &[0.0, 1.0]),
        snapshot(Some(Contact), Some(0), &[0.5, 1.0]),
        snapshot(Some(Contact), Some(0), &[0.5, 1.0]),
        snapshot(None, None, &[0.9, 1.0]),
    ]);
    assert_eq!(attempts, [(0, 1, part(0)), (1, 3, part(0))]);
}

#[test]
fn events_without_objects_still_cut_attempts() {
    use SnapshotEvent::{Contact, Release};
    let attempts = cut_all(vec![
        snapshot(Some(Contact), None, &[0.0, 1.0]),
        snapshot(Some(Release), None, &[0.5, 1.0]),
        snapshot(Some(Contact), Some(1), &[0.5, 1.0]),
        snapshot(Some(Release), None, &[0.5, 2.0]),
        snapshot(None, None, &[0.5, 2.0]),
    ]);
    assert_eq!(attempts, [(0, 2, part(0)), (2, 4, part(1))]);
}
