//! Tasks as data: the built-in task files are demonstrated and judged, and bad files are refused by field.

#![allow(clippy::unwrap_used, clippy::expect_used)]
#![cfg(feature = "physics")]

use symbolt::robot::Pose;
use symbolt::robot::SkillReport;
use symbolt::robot::scene::{BodyId, Scene};
use symbolt::sim::Seed;
use symbolt::task::demonstrate;
use symbolt::task::execute::EpisodeSpec;
use symbolt::task::tasks::file::{DataTask, TaskFile};
use symbolt::task::tasks::{self, Task};

const CUP: &str = include_str!("../../src/task/tasks/files/cup.json");
const DRAWER: &str = include_str!("../../src/task/tasks/files/drawer.json");
const JIG: &str = include_str!("../../src/task/tasks/files/movable-jig.json");
const TOWER: &str = include_str!("../../src/task/tasks/files/tower.json");
const TABLE: &str = include_str!("../../src/task/tasks/files/table-setting.json");
const FLANGE: &str = include_str!("../../src/task/tasks/files/flange.json");
const SORTING: &str = include_str!("../../src/task/tasks/files/sorting.json");

// Written without a look at the code: a lid that slides, and a cabinet with two drawers.
const LID: &str = include_str!("../fixtures/tasks/box-with-lid.json");
const DRAWERS: &str = include_str!("../fixtures/tasks/two-drawers.json");

fn task(text: &str) -> DataTask {
    DataTask::parse(text.as_bytes(), "task.json").expect("it is valid")
}

fn scene(task: &DataTask, seed: u64) -> Scene {
    Scene::new(task.scene(Seed::new(seed)).expect("drawn")).expect("built")
}

#[test]
fn all_tasks_are_listed_and_the_files_say_what_they_are() {
    let all = tasks::all().expect("all are valid");
    let names: Vec<&str> = all.iter().map(|task| task.name()).collect();
    assert_eq!(names[0], "nuts-and-bolts");
    let files =
        ["movable-jig", "drawer", "cup", "table-setting", "tower", "flange", "sorting", "packing"];
    assert_eq!(names[1..], files);
    let of = [
        (JIG, 3, 6),
        (DRAWER, 3, 2),
        (CUP, 2, 2),
        (TABLE, 6, 6),
        (TOWER, 4, 3),
        (FLANGE, 5, 7),
        (SORTING, 8, 8),
    ];
    for (text, actions, parts) in of {
        let task = task(text);
        assert_eq!(task.min_actions(), actions, "{}", task.name());
        assert_eq!(task.scene(Seed::new(1)).expect("drawn").parts.len(), parts);
    }
}

#[test]
fn a_file_goes_to_json_and_back() {
    for text in [LID, DRAWERS, JIG, DRAWER, CUP, TABLE, TOWER, FLANGE, SORTING] {
        let task = task(text);
        let again = TaskFile::parse(task.file().to_json().as_bytes(), "again").expect("valid");
        assert_eq!(&again, task.file());
        let same = task.with_settings(task.settings().to_string().as_bytes(), "run.json");
        assert_eq!(same.expect("valid").settings(), task.settings());
    }
    // Some fields replace the task's own.
    let slow = task(TOWER).with_settings(br#"{"arm": {"carry_m_s": 0.1}}"#, "mine.json");
    let settings = slow.expect("valid").settings();
    assert_eq!(settings["arm"]["carry_m_s"], 0.1);
    assert_eq!(settings["parts"].as_array().map(Vec::len), Some(3));
}

/// Demonstrates a task in one scene.
fn shown_once(text: &str, seed: u64) {
    let task = task(text);
    let shown = demonstrate(&task, 1, Seed::new(seed)).expect("it can be shown");
    assert_eq!(shown.solved, 1, "{}: {:?}", task.name(), shown.skills);
    assert!(shown.skills[0].len() >= task.min_actions(), "{:?}", shown.skills);
}

#[test]
fn the_table_is_set() {
    shown_once(TABLE, 1);
}

#[test]
fn the_tower_is_built() {
    shown_once(TOWER, 1);
}

#[test]
fn the_flange_is_closed() {
    shown_once(FLANGE, 2);
}

#[test]
fn the_heap_is_sorted() {
    shown_once(SORTING, 2);
}

#[test]
fn two_drawers_are_opened_filled_and_closed() {
    shown_once(DRAWERS, 1);
}

#[test]
fn grasps_that_close_on_nothing_are_told_and_left_out() {
    // Its handle is off the origin of its frame, about which `around` turns.
    let drawers = task(DRAWERS);
    let told = drawers.empty_grasps().expect("a scene");
    let [told] = &told[..] else { panic!("{told:?}") };
    assert!(told.starts_with("parts[0].grasps[0]: 3 of 4 grasps close on nothing"), "{told}");
    assert!(told.contains("`around`"), "{told}");
    let seen = scene(&drawers, 1);
    let grasps = drawers.grasps(&seen.sensed(), 0);
    let [x, y, _] = seen.part(0).expect("a drawer").position;
    let far = grasps.iter().map(|grasp| (grasp.at[0] - x).hypot(grasp.at[1] - y));
    assert_eq!(far.clone().count(), 2, "one grasp, with either sense of closing");
    assert!(far.into_iter().all(|m| (m - 0.075).abs() < 1e-9));
    for text in [LID, DRAWER, CUP, JIG, TABLE, TOWER, FLANGE, SORTING] {
        assert_eq!(task(text).empty_grasps().expect("a scene"), [""; 0]);
    }
}

#[test]
fn a_cup_is_turned_over_where_it_stands() {
    let cup = task(CUP);
    for seed in 0..3 {
        let scene = scene(&cup, seed);
        let first = cup.demonstrator(Seed::new(seed), 0).next(&scene, &[]).expect("a step");
        let [x, y, z] = scene.part(0).expect("the cup").position;
        assert_eq!(first.part, 0);
        let off = [first.target.position[0] - x, first.target.position[1] - y];
        assert!(off.iter().all(|v| v.abs() < 1e-9), "{off:?}");
        assert!((z - first.target.position[2]).abs() < 1e-3, "as high as it stood");
    }
}

#[test]
fn a_drawer_is_opened_first_and_a_bolt_goes_by_way_of_the_hole() {
    let drawer = task(DRAWER);
    let mut seen = scene(&drawer, 1);
    let step = |task: &DataTask, scene: &Scene| {
        task.demonstrator(Seed::new(1), 0).next(scene, &[]).expect("a step")
    };
    let slid = |scene: &Scene| {
        let at = step(&drawer, scene);
        let by: f64 = (at.target.position.iter().zip(scene.part(0).expect("there").position))
            .map(|(to, from)| (to - from).powi(2))
            .sum();
        (at.part, by.sqrt())
    };
    let (part, by) = slid(&seen);
    assert!(part == 0 && (by - 0.105).abs() < 1e-3, "{by}");
    // Closed with the block in it, there is nothing to do.
    let [x, y, z] = seen.part(0).expect("there").position;
    seen.disturb(1, &Pose::at([x, y, z + 0.016]));
    assert_eq!(drawer.demonstrator(Seed::new(1), 0).next(&seen, &[]), None);
    let jig = task(JIG);
    let mut scene = scene(&jig, 1);
    let hole = scene.landmark(1).expect("the hole");
    let pocket = scene.landmark(0).expect("the pocket");
    let [x, y, z] = pocket.position;
    scene.disturb(0, &Pose { position: [x, y, z + 0.008], ..pocket });
    let first = step(&jig, &scene);
    let near = |a: [f64; 3], b: [f64; 3]| (0..3).all(|i| (a[i] - b[i]).abs() < 1e-6);
    assert!(
        [2, 3].contains(&first.part) && near(first.target.position, hole.position),
        "{first:?}"
    );
    // The bolt in the hole goes through the nut, not the other bolt.
    scene.disturb(3, &hole);
    let second = step(&jig, &scene);
    assert!(second.part == 3 && near(second.target.position, [x, y, z + 0.016]), "{second:?}");
}

#[test]
fn bad_sliders_and_conditions_are_refused_by_field() {
    let cases = [
        (
            "[0, 0.11]",
            "[0.11, 0]",
            "field `parts[0].slider.range_m`: [0.11, 0.0]; expected -1 to 0",
        ),
        (r#""friction_n": 2"#, r#""friction_n": -2"#, "field `parts[0].slider.friction_n`: -2.0"),
        (
            r#"["drawer open"]"#,
            r#"["open"]"#,
            "field `goal[0].needs`: \"open\"; expected one of `drawer",
        ),
        (
            r#"["block in the drawer"]"#,
            r#"["drawer open"]"#,
            "field `goal[1].after`: \"drawer open\"",
        ),
        (
            r#""moves": "block""#,
            r#""moves": "drawer""#,
            "field `perturbations[0].moves`: \"drawer\"",
        ),
        (r#""within_m": [0.01,"#, r#""within_m": [0,"#, "field `conditions[0].within_m`"),
        (
            r#""name": "drawer open""#,
            r#""needs": ["drawer open"], "name": "drawer open""#,
            "wait for",
        ),
    ];
    for (from, to, expected) in cases {
        assert!(DRAWER.contains(from), "{from}");
        let bad = DRAWER.replacen(from, to, 1);
        let refused = DataTask::parse(bad.as_bytes(), "mine.json").map(|_| ());
        let message = refused.expect_err("it is refused").to_string();
        assert!(message.contains(expected), "{to}: {message}");
    }
}

#[test]
fn the_same_seed_gives_the_same_scene_and_another_seed_another() {
    for text in [TABLE, TOWER, FLANGE, SORTING] {
        let task = task(text);
        let draw = |seed| task.scene(Seed::new(seed)).expect("drawn");
        assert_eq!(draw(3), draw(3));
        assert_ne!(draw(3).parts, draw(4).parts);
        assert_ne!(draw(3).fixtures, draw(4).fixtures, "{}", task.name());
    }
}

#[test]
fn what_is_in_the_way_is_moved_first_and_orders_that_are_free_vary() {
    let tower = task(TOWER);
    for seed in 0..4 {
        let scene = scene(&tower, seed);
        let kind = |part: usize| scene.kind(part).expect("there").name.clone();
        let first = tower.demonstrator(Seed::new(seed), 0).next(&scene, &[]).expect("a step");
        assert_eq!(kind(first.part), "blue_block", "it lies on the red one");
        assert!(first.target.position[2] < 0.02, "it is put on the table: {first:?}");
    }
    let table = task(TABLE);
    let scene = scene(&table, 1);
    let none: [SkillReport; 0] = [];
    let first = |demo| table.demonstrator(Seed::new(1), demo).next(&scene, &none);
    let mut kinds: Vec<usize> = (0..12)
        .map(|demo| scene.kinds().nth(first(demo).expect("a step").part).expect("a part"))
        .collect();
    assert_eq!(first(0), first(0), "the seed decides");
    kinds.sort_unstable();
    kinds.dedup();
    assert_eq!(kinds, [0, 1, 2], "each kind comes first in some demonstration");
}

/// Returns the scene of the tower with its blocks moved to heights above the pad and shifted sideways.
fn stacked(shift: [[f64; 3]; 3]) -> (DataTask, Scene) {
    let task = task(TOWER);
    let mut scene = scene(&task, 1);
    let pad = scene.landmark(0).expect("the pad").position;
    for (part, by) in shift.into_iter().enumerate() {
        let z = 0.013 + 0.026 * part as f64;
        let at = [pad[0] + by[0], pad[1] + by[1], pad[2] + z + by[2]];
        scene.disturb(part, &Pose::at(at));
    }
    (task, scene)
}

#[test]
fn the_judge_refuses_near_misses_of_a_tower() {
    let judged = |shift| {
        let (task, scene) = stacked(shift);
        task.judge(&scene)
    };
    let zero = [0.0; 3];
    let right = judged([zero; 3]);
    assert!(right.solved && right.achieved.len() == 3, "{right:?}");
    assert!(judged([[0.008, 0.0, 0.0]; 3]).solved, "a tower near the middle of the pad");
    for wrong in [
        [[0.02, 0.0, 0.0]; 3],
        [zero, [0.0, 0.018, 0.0], [0.0, 0.018, 0.0]],
        [zero, zero, [0.0, 0.0, 0.003]],
        // Green and blue have changed places.
        [zero, [0.0, 0.0, 0.026], [0.0, 0.0, -0.026]],
    ] {
        assert!(!judged(wrong).solved, "{wrong:?}");
    }
    let (task, mut scene) = stacked([zero; 3]);
    let at = scene.part(2).expect("blue").position;
    let tilted = Pose { position: at, orientation: [0.1, 0.0, 0.0, 0.99f64.sqrt()] };
    scene.disturb(2, &tilted);
    assert!(!task.judge(&scene).solved, "a tilted block does not stand");
}

#[test]
fn the_judge_looks_at_the_frame_of_each_plate() {
    let task = task(TABLE);
    let mut scene = scene(&task, 2);
    let marks = 0..scene.spec().landmarks.len();
    let plates: Vec<Pose> = marks
        .filter(|i| scene.spec().landmarks[*i].kind == "plate")
        .map(|i| scene.landmark(i).expect("there"))
        .collect();
    assert_eq!(plates.len(), 2);
    // Puts fork, knife and cup at a plate. The cutlery is turned by an additional angle.
    let lay = |scene: &mut Scene, plate: usize, turn: f64| {
        let Pose { position: [x, y, _], orientation: [_, _, s, c] } = plates[plate];
        let yaw = 2.0 * s.atan2(c);
        let at = |along: f64, ahead: f64, z: f64| {
            let (sin, cos) = yaw.sin_cos();
            [x + along * cos - ahead * sin, y + along * sin + ahead * cos, z]
        };
        // The z axis of the cutlery points ahead: -90 degrees about x, then the turn about the vertical.
        let (half, lying) = ((yaw + turn) / 2.0, std::f64::consts::FRAC_1_SQRT_2);
        let (s, c) = half.sin_cos();
        let orientation = [-lying * c, -lying * s, lying * s, lying * c];
        scene.disturb(plate, &Pose { position: at(-0.06, 0.0, 0.006), orientation });
        scene.disturb(2 + plate, &Pose { position: at(0.06, 0.0, 0.006), orientation });
        scene.disturb(4 + plate, &Pose::at(at(0.0, 0.07, 0.018)));
    };
    lay(&mut scene, 0, 0.0);
    let half = task.judge(&scene);
    assert!(!half.solved && half.achieved.len() == 3, "{half:?}");
    lay(&mut scene, 1, 0.0);
    let whole = task.judge(&scene);
    assert!(whole.solved && whole.achieved.len() == 6, "{whole:?}");
    lay(&mut scene, 1, 0.15);
    let askew = task.judge(&scene);
    assert!(!askew.solved && askew.achieved.len() == 4, "9 degrees are too many: {askew:?}");
}

#[test]
fn another_hand_moves_parts_and_movable_references() {
    let mut moved = Vec::new();
    for text in [JIG, DRAWER, CUP, TABLE, TOWER, FLANGE, SORTING] {
        let task = task(text);
        for seed in 0..30 {
            let perturbation = task.perturbation(Seed::new(seed)).expect("one is offered");
            assert_eq!(Some(perturbation), task.perturbation(Seed::new(seed)));
            if seed == 0 {
                let perturbation = Some(perturbation);
                let spec = EpisodeSpec { perturbation, ..EpisodeSpec::of(task.clone()) };
                spec.check().expect("the body exists and moves");
            }
            moved.push(matches!(perturbation.body, BodyId::Fixture(_)));
        }
    }
    assert!(moved.contains(&true) && moved.contains(&false), "{moved:?}");
}

#[test]
fn bad_files_are_refused_by_file_and_line_or_field() {
    let said = |from: &str, to: &str| {
        assert!(TOWER.contains(from), "{from}");
        let text = TOWER.replacen(from, to, 1);
        let refused = DataTask::parse(text.as_bytes(), "mine.json").map(|_| ());
        refused.expect_err("it is refused").to_string()
    };
    let cases = [
        (r#""symbolt-task""#, r#""symbolt-domain""#, "mine.json, field `format`: `symbolt-domain`"),
        (r#""version": 1"#, r#""version": 2"#, "mine.json, field `version`: 2; expected 1"),
        (r#""density""#, r#""densty""#, "mine.json, line 10: unknown field `densty`"),
        (r#"{"box": "#, r#"{"bocks": "#, "unknown variant `bocks`, expected one of `box`, `prism`"),
        (
            r#""name": "tower""#,
            r#""name": "My Tower""#,
            "field `name`: \"My Tower\"; expected lower-case",
        ),
        (
            r#""density": 700"#,
            r#""density": 0"#,
            "field `parts[0].density`: 0.0; expected 1 to 30000",
        ),
        (
            r#""openings_m": [0.026]"#,
            r#""openings_m": [0.06]"#,
            "field `parts[0].grasps[0].openings_m`",
        ),
        (
            r#""closing": [1, 0, 0]"#,
            r#""closing": [0, 0, 1]"#,
            "field `parts[0].grasps[0].closing`",
        ),
        (r##""#d55e00""##, r#""red""#, "field `parts[0].look.colour`: \"red\"; expected a colour"),
        (r#""on": "red_block""#, r#""on": "red""#, "expected one of `red_block`, `green_block`"),
        (
            r#""reference": "pad""#,
            r#""reference": "mat""#,
            "field `goal[0].reference`: \"mat\"; expected one of `world`, `pad`",
        ),
        (r#""part": "green_block""#, r#""part": "green""#, "field `goal[1].part`: \"green\""),
        (r#""for": "one""#, r#""for": {"at_least": 2}"#, "field `goal[0].for`: 2; expected 1 to 1"),
        (
            r#""after": ["red block on the pad"]"#,
            r#""after": ["red"]"#,
            "field `goal[1].after`: \"red\"",
        ),
        (
            r#""after": ["red block on the pad"]"#,
            r#""after": ["blue block on the green block"]"#,
            "relations that do not wait for this one",
        ),
        (r#""moves": "red_block""#, r#""moves": "table""#, "field `perturbations[0].moves`"),
        (r#""step_ms": 4"#, r#""step_ms": 3"#, "field `step_ms`: 3"),
    ];
    for (from, to, expected) in cases {
        let message = said(from, to);
        assert!(message.contains(expected), "{to}: {message}");
        assert!(message.starts_with("mine.json"), "{message}");
    }
    // A table without room for everything.
    let narrow =
        said(r#""step_ms": 4"#, r#""step_ms": 4, "table": {"rim": [[0.5, 0.0], [0.55, 0.05]]}"#);
    assert!(narrow.starts_with("mine.json, field `starts`"), "{narrow}");
    for text in ["", "[]", "{", "3"] {
        let refused = DataTask::parse(text.as_bytes(), "mine.json").map(|_| ());
        let message = refused.expect_err("it is refused").to_string();
        assert!(message.starts_with("mine.json"), "{text}: {message}");
    }
}

#[test]
#[ignore = "long statistics: 84 demonstrations"]
fn nearly_every_demonstration_solves_its_task() {
    for text in [JIG, DRAWER, CUP, TABLE, TOWER, FLANGE, SORTING] {
        let task = task(text);
        let shown = demonstrate(&task, 12, Seed::new(7)).expect("it can be shown");
        assert!(shown.solved >= 11, "{}: {} of 12", task.name(), shown.solved);
    }
}
