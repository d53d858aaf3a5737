//! Unit tests of `src/task/execute/recovery/attempts.rs`.

use super::*;

fn what() -> Intent {
    Intent { action: "PUT".into(), part: 0, reference: Some("slot_0".into()), place: 0 }
}

fn tried(attempts: &mut Attempts, index: usize, outcome: SkillOutcome, effect: bool) {
    attempts.begin(Attempt::begun(what(), Means::Task(index), Pose::at([0.0; 3]), false));
    attempts.end(outcome, |_| None);
    attempts.settle(|_| effect);
}

#[test]
fn a_grasp_that_failed_the_same_way_twice_is_left_out() {
    let mut attempts = Attempts::default();
    let (here, there) = (Pose::at([0.0; 3]), Pose::at([0.1, 0.0, 0.0]));
    let usable = |a: &Attempts, at: &Pose| a.usable(&what(), at, 3, Means::Task);
    tried(&mut attempts, 0, SkillOutcome::Missed, false);
    assert_eq!(usable(&attempts, &here), [1, 2, 0], "unused grasps come first");
    tried(&mut attempts, 0, SkillOutcome::Dropped, false);
    assert_eq!(usable(&attempts, &here), [1, 2, 0], "it failed in two ways");
    tried(&mut attempts, 0, SkillOutcome::Missed, false);
    assert_eq!(usable(&attempts, &here), [1, 2]);
    assert_eq!(usable(&attempts, &there), [0, 1, 2], "the part lies elsewhere now");
    assert_eq!(attempts.usable(&what(), &here, 3, Means::Any), [0, 1, 2]);
}

#[test]
fn an_action_without_effect_is_not_tried_a_third_time_until_something_changes() {
    let mut attempts = Attempts::default();
    tried(&mut attempts, 0, SkillOutcome::Placed, false);
    assert_eq!(attempts.worn_out(&what(), Means::Task), None);
    tried(&mut attempts, 1, SkillOutcome::Placed, false);
    assert_eq!(attempts.worn_out(&what(), Means::Task), Some(AttemptEnd::NoEffect));
    let other = Intent { place: 1, ..what() };
    assert_eq!(attempts.worn_out(&other, Means::Any), None);
    let clear = Intent::detour(RecoveryKind::Clear, 1);
    for (effect, worn) in [(false, Some(AttemptEnd::NoEffect)), (true, None)] {
        let means = Means::Task(0);
        attempts.begin(Attempt::begun(clear.clone(), means, Pose::at([0.0; 3]), true));
        attempts.end(SkillOutcome::Placed, |_| None);
        attempts.settle(|_| effect);
        assert_eq!(attempts.worn_out(&what(), Means::Task), worn);
    }
    assert_eq!(attempts.detours(), 2);
}

#[test]
fn an_action_that_another_hand_spoilt_or_whose_part_was_laid_anew_is_tried_again() {
    let here = Pose::at([0.0; 3]);
    let put = |attempts: &mut Attempts, meddled: Option<Meddled>| {
        attempts.begin(Attempt::begun(what(), Means::Task(0), here, false));
        attempts.end(SkillOutcome::Placed, |_| None);
        attempts.unsettled().expect("its end is not known").meddled = meddled;
        attempts.settle(|_| false);
        attempts.worn_out(&what(), Means::Task)
    };
    let mut attempts = Attempts::default();
    let worn = Some(AttemptEnd::NoEffect);
    assert_eq!(put(&mut attempts, Some(Meddled::Part)), None);
    assert_eq!(put(&mut attempts, None), None, "it failed once by itself");
    assert_eq!(put(&mut attempts, None), worn);
    let regrasp = Intent::detour(RecoveryKind::Regrasp, 0);
    attempts.begin(Attempt::begun(regrasp, Means::Task(0), here, true));
    attempts.end(SkillOutcome::Placed, |_| None);
    attempts.settle(|_| true);
    assert_eq!(attempts.worn_out(&what(), Means::Task), None);
    assert_eq!(put(&mut attempts, Some(Meddled::Part)), worn, "not for ever");
}

#[test]
fn what_was_occupied_is_tried_again_once_what_lay_there_is_gone() {
    let [target, beside, far] = [0.0, 0.05, 0.3].map(|x| Pose::at([x, 0.0, 0.0]));
    let occupied = SkillOutcome::Occupied;
    // A part taken from `from` by whatever action, and left at `to`.
    let worn = |part: usize, from: Pose, to: Pose, outcome: SkillOutcome| {
        let mut attempts = Attempts::default();
        for index in 0..4 {
            let begun = Attempt::begun(what(), Means::Task(index), far, false);
            attempts.begin(Attempt { at: Some(target.position), ..begun });
            attempts.end(occupied, |_| Some(far));
            attempts.settle(|_| false);
        }
        assert!(attempts.worn_out(&what(), Means::Task).is_some());
        let other = Intent { part, reference: Some("slot_1".into()), ..what() };
        let begun = Attempt::begun(other, Means::Task(0), from, false);
        attempts.begin(Attempt { at: Some(to.position), ..begun });
        attempts.end(outcome, |_| Some(to));
        attempts.settle(|_| true);
        attempts.worn_out(&what(), Means::Task)
    };
    assert_eq!(worn(1, beside, far, SkillOutcome::Placed), None);
    assert_eq!(worn(1, beside, far, SkillOutcome::Dropped), None, "it is away as well");
    let still = Some(AttemptEnd::Failed(occupied));
    assert_eq!(worn(1, far, Pose::at([0.5, 0.0, 0.0]), SkillOutcome::Placed), still);
    assert_eq!(worn(1, beside, target, SkillOutcome::Placed), still, "it has not gone far");
    assert_eq!(worn(0, beside, far, SkillOutcome::Placed), still, "it is the part itself");
}

#[test]
fn a_detour_that_failed_the_same_way_twice_is_not_repeated_from_the_same_pose() {
    let mut attempts = Attempts::default();
    let (here, there) = (Pose::at([0.0; 3]), Pose::at([0.1, 0.0, 0.0]));
    let push = Intent::detour(RecoveryKind::Push, 3);
    for _ in 0..2 {
        assert!(attempts.may_detour(&push, &here));
        attempts.begin(Attempt::begun(push.clone(), Means::Push(0), here, true));
        attempts.end(SkillOutcome::Blocked, |_| None);
        attempts.settle(|_| false);
    }
    assert!(!attempts.may_detour(&push, &here));
    assert!(attempts.may_detour(&push, &there));
    assert!(attempts.may_detour(&Intent::detour(RecoveryKind::Regrasp, 3), &here));
}

#[test]
fn a_part_that_another_hand_took_is_not_said_to_have_missed_its_state() {
    let [here, there] = [0.0, 0.05].map(|x| Pose::at([x, 0.0, 0.0]));
    let told = |outcome, part: &Pose, target: &Pose| {
        let mut attempts = Attempts::default();
        let attempt = Attempt::begun(what(), Means::Task(0), here, false);
        attempts.begin(Attempt { target: Some(here), ..attempt });
        assert_eq!(attempts.unsettled(), None);
        attempts.end(outcome, |_| Some(here));
        let attempt = attempts.unsettled().expect("its end is not known");
        attempt.meddled = attempt.meddled(Some(part), Some(target));
        attempts.settle(|_| false);
        attempts.last().and_then(Attempt::failure_in_words).expect("it failed")
    };
    let placed = SkillOutcome::Placed;
    assert_eq!(told(placed, &there, &here), "was put down; it moved after the robot had let go");
    assert_eq!(told(placed, &here, &there), "was put down; its target had moved meanwhile");
    let missed = "was put down but did not get into the intended state";
    assert_eq!(told(placed, &here, &here), missed);
    // What was dropped may still roll.
    assert_eq!(told(SkillOutcome::Dropped, &there, &here), "was dropped");
}
