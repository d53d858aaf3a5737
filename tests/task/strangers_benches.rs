//! Workplaces that others thought of: what a tool carries, what may stay in a drawer, how a pile stands, and what stands in the way.

use symbolt::robot::Pose;
use symbolt::task::classify::Classifier;
use symbolt::task::compile::Problem;
use symbolt::task::domain::{Need, NeedVerdict, RelationalDomain, Role, Subject};
use symbolt::task::planner::{PlannerBuild, SceneEnd, SceneMove, ScenePlan};
use symbolt::task::{Demonstration, Snapshot};

use super::modes::{Draw, acted, recording, shown};
use super::several_places::{flat, learned, noisy, objects, on};

pub(super) type Things = Vec<(&'static str, Pose)>;
pub(super) type Moves = Vec<Vec<(usize, Pose)>>;

pub(super) fn planned(domain: &RelationalDomain, things: &Things) -> ScenePlan {
    let scene = Snapshot { objects: objects(things), ..Snapshot::default() };
    let layout = Classifier::new(domain).classify(&scene);
    let problem = Problem::new(domain, &layout).expect("a problem");
    PlannerBuild::default().plan(&problem, &layout, PlannerBuild::LIMIT).expect("a plan")
}

/// Patties on a grill are carried to plates on a spatula, which lives in a holder.
fn grill(draw: &mut Draw, patties: usize) -> (Things, Moves) {
    let grill = flat(draw.within(-0.2, 0.2), 0.35, 0.03, draw.yaw());
    let holder = flat(draw.within(-0.3, 0.3), -0.4, 0.0, draw.yaw());
    let home = on(&holder, &flat(0.0, 0.0, 0.06, 0.0));
    let mut things = vec![("grill", grill), ("holder", holder), ("spatula", home)];
    let mut moves = Vec::new();
    let plates: Vec<Pose> = (0..patties)
        .map(|k| flat(-0.2 + 0.4 * k as f64, draw.within(-0.1, 0.1), 0.0, draw.yaw()))
        .collect();
    things.extend(plates.iter().map(|plate| ("plate", *plate)));
    for (k, plate) in plates.iter().enumerate() {
        let lies = flat(draw.within(-0.03, 0.03), -0.08 + 0.16 * k as f64, 0.04, draw.yaw());
        let patty = on(&grill, &lies);
        things.push(("patty", patty));
        let (object, served) = (3 + patties + k, on(plate, &flat(0.0, 0.0, 0.023, 0.0)));
        let below = flat(-0.12, 0.0, -0.012, 0.0);
        moves.push(vec![(2, on(&patty, &below))]);
        moves.push(vec![(2, on(&served, &below)), (object, served)]);
        moves.push(vec![(2, home)]);
    }
    (things, moves)
}

#[test]
fn what_a_tool_carries_comes_to_the_plate_over_which_the_tool_is_held() {
    let mut draw = Draw(3);
    let shown = recording([1, 2, 1, 2, 2].into_iter().map(|patties| {
        let (things, moves) = grill(&mut draw, patties);
        acted(objects(&things), &moves)
    }));
    for mm_deg in [0.0, 1.0] {
        let domain = learned(&noisy(&shown, mm_deg, 5));
        let plan = planned(&domain, &grill(&mut Draw(31), 2).0);
        assert_eq!(plan.end, SceneEnd::Met, "{mm_deg} mm: {:?}", plan.moves);
        let over: Vec<&str> = plan
            .moves
            .iter()
            .filter_map(|m| m.onto.as_deref())
            .filter(|id| id.starts_with("plate"))
            .collect();
        assert_eq!(over.len(), 2, "{mm_deg} mm: {over:?}");
        assert_ne!(over[0], over[1], "one plate for each patty");
    }
}

/// Parts go into a drawer that is opened and closed. Those `within` lie in it already, and it is closed at first.
fn drawer(draw: &mut Draw, parts: &[&'static str], within: usize) -> (Things, Moves) {
    let cabinet = draw.fixture(0.0);
    let shut = on(&cabinet, &flat(0.0, 0.0, 0.05, 0.0));
    let open = on(&cabinet, &flat(0.2, 0.0, 0.05, 0.0));
    let mut things = vec![("cabinet", cabinet), ("drawer", shut)];
    let place = |k: usize| flat(-0.06 + 0.06 * k as f64, 0.0, 0.01, 0.0);
    let (mut opens, mut puts, mut closes) = (vec![(1, open)], Vec::new(), vec![(1, shut)]);
    for (k, part) in parts.iter().enumerate() {
        if k < within {
            things.push((part, on(&shut, &place(k))));
            opens.push((2 + k, on(&open, &place(k))));
        } else {
            things.push((part, draw.lying(0.01)));
            puts.push(vec![(2 + k, on(&open, &place(k)))]);
        }
        closes.push((2 + k, on(&shut, &place(k))));
    }
    let moves = [vec![opens], puts, vec![closes]].concat();
    (things, moves)
}

#[test]
fn a_drawer_that_was_closed_with_a_part_in_it_is_opened_with_one_in_it() {
    const PARTS: [&str; 3] = ["pen", "clip", "stamp"];
    let mut draw = Draw(17);
    let domain = learned(&recording((0..5).map(|_| {
        let (things, moves) = drawer(&mut draw, &PARTS, 0);
        acted(objects(&things), &moves)
    })));
    // It was always empty when it was opened.
    let plan = planned(&domain, &drawer(&mut Draw(71), &PARTS, 1).0);
    assert_eq!(plan.end, SceneEnd::Met, "{:?}", plan.moves);
    let moved: Vec<&str> = plan.moves.iter().map(|m| &*m.object).collect();
    assert_eq!((moved.len(), moved[0], moved[3]), (4, "drawer_1", "drawer_1"), "{moved:?}");
}

/// A vase stands on a pile of boxes on a dock, or on the window sill, where it belongs.
fn pile(draw: &mut Draw, boxes: usize, on_top: bool) -> (Things, Vec<(usize, Pose)>) {
    let (dock, sill) = (draw.fixture(0.0), flat(draw.within(-0.3, 0.3), -0.5, 0.0, draw.yaw()));
    let mut things = vec![("dock", dock), ("sill", sill)];
    let mut below = dock;
    for _ in 0..boxes {
        below = on(&below, &flat(0.0, 0.0, 0.03, 0.0));
        things.push(("box", below));
    }
    let right = on(&sill, &flat(0.0, 0.0, 0.1, draw.yaw()));
    things
        .push(("vase", if on_top { on(&below, &flat(0.0, 0.0, 0.08, draw.yaw())) } else { right }));
    let vase = things.len() - 1;
    (things, if on_top { vec![(vase, right)] } else { Vec::new() })
}

#[test]
fn how_a_pile_stood_three_times_is_not_needed_to_take_from_it() {
    let mut draw = Draw(23);
    let domain = learned(&recording([2, 0, 3, 0, 2].into_iter().map(|boxes| {
        let (things, moves) = pile(&mut draw, boxes.max(1), boxes > 0);
        shown(objects(&things), &moves)
    })));
    let needs = &domain.operators[0].needs;
    let origin = |n: &&Need| matches!(n.condition.subject, Subject::Is(_));
    assert!(needs.iter().filter(origin).all(|n| n.verdict == NeedVerdict::Undecided), "{needs:?}");
    let plan = planned(&domain, &pile(&mut Draw(32), 1, true).0);
    assert_eq!((plan.end, plan.moves.len()), (SceneEnd::Met, 1));
}

/// Books go onto a shelf. Where a bust stands before the books, it goes to the end of the shelf first.
fn shelf(draw: &mut Draw, before: Option<[f64; 2]>) -> (Things, Vec<(usize, Pose)>) {
    let shelf = draw.fixture(0.0);
    let end = on(&shelf, &flat(0.3, 0.0, 0.08, draw.yaw()));
    let stands = before.map(|[x, y]| on(&shelf, &flat(x, y, 0.08, draw.yaw())));
    let (a, b) = (draw.lying(0.012), draw.lying(0.018));
    let things =
        vec![("shelf", shelf), ("bust", stands.unwrap_or(end)), ("atlas", a), ("bible", b)];
    let place = |x: f64| on(&shelf, &flat(x, 0.0, 0.12, 0.0));
    let mut moves: Vec<(usize, Pose)> = before.map(|_| (1, end)).into_iter().collect();
    moves.extend([(2, place(0.02)), (3, place(0.06))]);
    (things, moves)
}

#[test]
fn what_stands_in_the_way_a_little_beside_where_it_was_seen_is_moved_as_well() {
    let mut draw = Draw(29);
    let starts = [None, Some([0.07, 0.016]), None, Some([0.1, 0.017]), None];
    let demos = starts.map(|before| -> Demonstration {
        let (things, moves) = shelf(&mut draw, before);
        shown(objects(&things), &moves)
    });
    let domain = learned(&noisy(&recording(demos.into_iter()), 0.2, 4));
    let plan = planned(&domain, &shelf(&mut Draw(92), Some([0.08, -0.012])).0);
    let moved: Vec<&str> = plan.moves.iter().map(|m| &*m.object).collect();
    assert_eq!((plan.end, &moved[..]), (SceneEnd::Met, &["bust_1", "atlas_2", "bible_3"][..]));
    assert_eq!(plan.assumed.iter().map(|id| &**id).collect::<Vec<_>>(), ["bust_1"]);
    // Nothing is taken for what it is not where nothing is in the way.
    let plan = planned(&domain, &shelf(&mut Draw(93), None).0);
    assert_eq!((plan.end, plan.moves.len(), plan.assumed.len()), (SceneEnd::Met, 2, 0));
}

/// Bottles get a cork or a cap, whichever is at hand, and go into a crate.
fn bottles(draw: &mut Draw, corks: &[bool]) -> (Things, Moves) {
    let crate_ = draw.fixture(0.0);
    let mut things = vec![("crate", crate_)];
    let mut moves = Vec::new();
    let first = draw.within(0.0, 3.0) as usize;
    for k in 0..corks.len() {
        things.push((
            "bottle",
            flat(-0.3 + 0.15 * k as f64, draw.within(-0.2, 0.0), 0.08, draw.yaw()),
        ));
    }
    for (k, cork) in corks.iter().enumerate() {
        let closure = flat(-0.3 + 0.15 * k as f64, draw.within(-0.4, -0.3), 0.01, draw.yaw());
        things.push((if *cork { "cork" } else { "cap" }, closure));
        let (bottle, own) = (1 + k, 1 + corks.len() + k);
        let on_it = |at: &Pose| on(at, &flat(0.0, 0.0, if *cork { 0.1 } else { 0.09 }, 0.0));
        let cell = on(&crate_, &flat(-0.07 + 0.07 * ((k + first) % 3) as f64, 0.0, 0.1, 0.0));
        moves.push(vec![(own, on_it(&things[bottle].1))]);
        moves.push(vec![(bottle, cell), (own, on_it(&cell))]);
    }
    (things, moves)
}

#[test]
fn a_bottle_gets_a_cork_or_a_cap_before_it_goes_into_the_crate() {
    let mut draw = Draw(41);
    let shown = [&[true, false][..], &[false, true, true], &[true, true, false], &[false, true]];
    let domain = learned(&recording(shown.into_iter().map(|corks| {
        let (things, moves) = bottles(&mut draw, corks);
        acted(objects(&things), &moves)
    })));
    let into = domain.operators.iter().find(|o| domain.states[o.to].kind == "bottle").unwrap();
    let either = |n: &&Need| n.or.len() == 1 && n.condition.subject == Subject::At(Role::Object);
    assert_eq!(into.needs.iter().filter(either).count(), 1, "{into:?} {:?}", domain.states);
    let plan = planned(&domain, &bottles(&mut Draw(14), &[true, false, true]).0);
    let moved: Vec<&str> = plan.moves.iter().map(|m| &*m.object).collect();
    assert_eq!((plan.end, moved.len()), (SceneEnd::Met, 6), "{moved:?}");
    for (at, step) in plan.moves.iter().enumerate() {
        let closed = |m: &&SceneMove| m.onto.as_deref() == Some(&*step.object);
        let bottle = step.object.starts_with("bottle");
        assert!(!bottle || plan.moves[..at].iter().any(|m| closed(&m)), "open: {moved:?}");
    }
}

/// A plank goes into a vice, whose jaw is closed upon it: where it stops depends on the plank.
fn vice(draw: &mut Draw, thick: bool) -> (Things, Vec<(usize, Pose)>) {
    let vice = draw.fixture(0.0);
    let jaw = |x: f64| on(&vice, &flat(x, 0.0, 0.07, 0.0));
    let (kind, half) = if thick { ("thick_plank", 0.022) } else { ("thin_plank", 0.010) };
    let things = vec![("vice", vice), ("jaw", jaw(0.12)), (kind, draw.lying(half))];
    let within = on(&vice, &flat(half, 0.0, 0.08, 0.0));
    (things, vec![(2, within), (1, jaw(2.0 * half + 0.012))])
}

#[test]
fn where_the_jaw_of_a_vice_stops_depends_on_the_plank() {
    let mut draw = Draw(47);
    let domain = learned(&recording([false, true, false, true, false].into_iter().map(|thick| {
        let (things, moves) = vice(&mut draw, thick);
        shown(objects(&things), &moves)
    })));
    for thick in [false, true] {
        let (things, moves) = vice(&mut Draw(74), thick);
        let plan = planned(&domain, &things);
        assert_eq!((plan.end, plan.moves.len()), (SceneEnd::Met, 2), "{thick}");
        let off = plan.moves[1].target.pose.distance(&moves[1].1);
        assert!(off < 1e-3, "{thick}: {off} m from where the jaw stops");
    }
}
