//! The rules for settings: the scene can be built, and the task can be done in it.

use super::settings::{MAX_OF_A_KIND, NutsAndBolts};
use super::shapes::neck_radius;
use super::start;
use crate::robot::arm::reaches_table;
use crate::sim::Seed;
use crate::sim::is_plain;
use crate::task::error::TaskError;

/// Name, getter, least and greatest value of a setting.
type Range = (&'static str, fn(&NutsAndBolts) -> f64, f64, f64);

const RANGES: [Range; 19] = [
    ("part.across_flats_m", |s| s.part.across_flats_m, 5e-3, 0.1),
    ("part.nut_height_m", |s| s.part.nut_height_m, 2e-3, 0.1),
    ("part.nut_hole_m", |s| s.part.nut_hole_m, 1e-3, 0.1),
    ("part.head_height_m", |s| s.part.head_height_m, 2e-3, 0.1),
    ("part.shaft_radius_m", |s| s.part.shaft_radius_m, 1e-3, 0.1),
    ("part.shaft_length_m", |s| s.part.shaft_length_m, 5e-3, 0.2),
    ("part.tip_chamfer_m", |s| s.part.tip_chamfer_m, 1e-4, 0.1),
    ("part.density", |s| s.part.density, 100.0, 30_000.0),
    ("part.friction", |s| s.part.friction, 1e-3, 10.0),
    ("jig.pocket_floor_m", |s| s.jig.pocket_floor_m, 5e-3, 0.3),
    ("jig.pocket_depth_m", |s| s.jig.pocket_depth_m, 1e-3, 0.1),
    ("jig.pocket_clearance_m", |s| s.jig.pocket_clearance_m, 1e-5, 0.02),
    ("jig.hole_top_m", |s| s.jig.hole_top_m, 5e-3, 0.3),
    ("jig.hole_clearance_m", |s| s.jig.hole_clearance_m, 1e-5, 0.02),
    ("jig.chamfer_m", |s| s.jig.chamfer_m, 1e-4, 0.02),
    ("jig.wall_m", |s| s.jig.wall_m, 1e-3, 0.05),
    ("table.rim_height_m", |s| s.table.rim_height_m, 1e-3, 0.1),
    ("table.drop_height_m", |s| s.table.drop_height_m, 0.02, 0.5),
    ("table.spacing_m", |s| s.table.spacing_m, 0.03, 1.0),
];

/// Maximum length of a kind, in characters. In a recording, ids and places of the jig have longer names than their kind,
/// and a name has at most 200 characters.
const LONGEST_KIND: usize = 190;

/// A condition that relates settings: the setting's name, its value in messages, what is expected, and the
/// test.
struct Rule {
    name: &'static str,
    value: fn(&NutsAndBolts) -> String,
    expected: &'static str,
    holds: fn(&NutsAndBolts) -> bool,
}

const COUNTS: [Rule; 3] = [
    Rule {
        name: "nuts",
        value: |s| s.nuts.to_string(),
        expected: "1 to 4",
        holds: |s| (1..=MAX_OF_A_KIND).contains(&s.nuts),
    },
    Rule {
        name: "bolts",
        value: |s| s.bolts.to_string(),
        expected: "1 to 4",
        holds: |s| (1..=MAX_OF_A_KIND).contains(&s.bolts),
    },
    Rule {
        name: "nut_kind and bolt_kind",
        value: |s| format!("`{}` and `{}`", s.nut_kind, s.bolt_kind),
        expected: "two different names of 1 to 190 characters without control characters, none of them the name of a \
                   place of the jig",
        holds: |s| {
            let places = s.places();
            let length = |kind: &String| (1..=LONGEST_KIND).contains(&kind.chars().count());
            let clean = |kind: &String| is_plain(kind);
            let free = |kind: &String| length(kind) && clean(kind) && !places.contains(kind);
            s.nut_kind != s.bolt_kind && free(&s.nut_kind) && free(&s.bolt_kind)
        },
    },
];

const SIZES: [Rule; 10] = [
    Rule {
        name: "part.nut_hole_m",
        value: |s| s.part.nut_hole_m.to_string(),
        expected: "at least 0.2 mm more than part.shaft_radius_m",
        holds: |s| s.part.nut_hole_m >= s.part.shaft_radius_m + 2e-4,
    },
    Rule {
        name: "part.nut_hole_m",
        value: |s| s.part.nut_hole_m.to_string(),
        expected: "a hole that leaves at least 2 mm of wall on each side",
        holds: |s| 2.0 * s.part.nut_hole_m <= s.part.across_flats_m - 4e-3,
    },
    Rule {
        name: "part.tip_chamfer_m",
        value: |s| s.part.tip_chamfer_m.to_string(),
        expected: "less than part.shaft_radius_m",
        holds: |s| s.part.tip_chamfer_m < s.part.shaft_radius_m,
    },
    Rule {
        name: "part.tip_chamfer_m",
        value: |s| s.part.tip_chamfer_m.to_string(),
        expected: "less than part.shaft_length_m",
        holds: |s| s.part.tip_chamfer_m < s.part.shaft_length_m,
    },
    Rule {
        name: "part.across_flats_m",
        value: |s| s.part.across_flats_m.to_string(),
        expected: "at least 8 mm less than twice gripper.stroke_m",
        holds: |s| s.part.across_flats_m + 8e-3 <= 2.0 * s.gripper.stroke_m,
    },
    Rule {
        name: "jig.hole_top_m",
        value: |s| s.jig.hole_top_m.to_string(),
        expected: "at least 5 mm more than part.shaft_length_m, so that the shaft hangs free",
        holds: |s| s.jig.hole_top_m >= s.part.shaft_length_m + 5e-3,
    },
    Rule {
        name: "jig.chamfer_m",
        value: |s| s.jig.chamfer_m.to_string(),
        expected: "a chamfer that leaves at least 1 mm of edge under a bolt's head",
        holds: |s| {
            let edge = s.part.shaft_radius_m + s.jig.hole_clearance_m + s.jig.chamfer_m;
            edge + 1e-3 <= neck_radius(&s.part)
        },
    },
    Rule {
        name: "jig.pocket_floor_m",
        value: |s| s.jig.pocket_floor_m.to_string(),
        expected: "a floor that keeps an assembled bolt's tip at least 5 mm above the table",
        holds: |s| s.jig.pocket_floor_m + s.part.nut_height_m >= s.part.shaft_length_m + 5e-3,
    },
    Rule {
        name: "jig.pocket_depth_m",
        value: |s| s.jig.pocket_depth_m.to_string(),
        expected: "a depth that leaves at least 7.5 mm of the nut to grasp",
        holds: |s| s.jig.pocket_depth_m <= s.part.nut_height_m - 7.5e-3,
    },
    Rule {
        name: "jig.hole_top_m",
        value: |s| {
            let (top, above) = (s.jig.hole_top_m, 1e3 * s.sink_m());
            format!("{top}, which puts a bolt in the hole {above:.1} mm above its assembled place")
        },
        expected: "a difference in height of at least 1 mm",
        holds: |s| s.sink_m().abs() >= 1e-3,
    },
];

const PLACES: [Rule; 7] = [
    Rule {
        name: "jig.pocket",
        value: |s| format!("{:?}", s.jig.pocket),
        expected: "a place at least 3 cm inside the rim and within the arm's reach",
        holds: |s| inside(s.jig.pocket, s.table.rim, 0.03) && reaches_table(s.jig.pocket),
    },
    Rule {
        name: "jig.hole",
        value: |s| format!("{:?}", s.jig.hole),
        expected: "a place at least 3 cm inside the rim and within the arm's reach",
        holds: |s| inside(s.jig.hole, s.table.rim, 0.03) && reaches_table(s.jig.hole),
    },
    Rule {
        name: "table.drop",
        value: |s| format!("{:?}", s.table.drop),
        expected: "corners inside the rim and within the arm's reach",
        holds: |s| {
            s.table.drop.iter().all(|at| inside(*at, s.table.rim, 0.0) && reaches_table(*at))
        },
    },
    Rule {
        name: "table.drop",
        value: |s| format!("{:?}", s.table.drop),
        expected: "the lower corner first",
        holds: |s| (0..2).all(|i| s.table.drop[0][i] <= s.table.drop[1][i]),
    },
    Rule {
        name: "table.drop",
        value: |s| format!("{:?}", s.table.drop),
        expected: "an area that leaves room for a lying bolt beside the jig",
        holds: leaves_room,
    },
    Rule {
        name: "table.drop_tilt_deg",
        value: |s| s.table.drop_tilt_deg.to_string(),
        expected: "0 to 90",
        holds: |s| (0.0..=90.0).contains(&s.table.drop_tilt_deg),
    },
    Rule {
        name: "jig.hole",
        value: |s| format!("{:.1} mm from jig.pocket", 1e3 * apart(s)),
        expected: "at least 90 mm",
        holds: |s| apart(s) >= 0.09,
    },
];

fn inside([x, y]: [f64; 2], [low, high]: [[f64; 2]; 2], by: f64) -> bool {
    x > low[0] + by && x < high[0] - by && y > low[1] + by && y < high[1] - by
}

fn apart(s: &NutsAndBolts) -> f64 {
    (s.jig.pocket[0] - s.jig.hole[0]).hypot(s.jig.pocket[1] - s.jig.hole[1])
}

/// Returns whether a lying bolt has room around both blocks.
fn leaves_room(s: &NutsAndBolts) -> bool {
    has_room_around(s, [s.jig.pocket, s.jig.hole])
}

fn has_room_around(s: &NutsAndBolts, places: [[f64; 2]; 2]) -> bool {
    let part = &s.part;
    let around = part.across_flats_m + s.jig.wall_m + part.shaft_length_m + part.head_height_m;
    let [low, high] = s.table.drop;
    places.into_iter().all(|[x, y]| {
        let off = |v: f64, i: usize| (low[i] - v).max(v - high[i]).max(0.0);
        off(x, 0).hypot(off(y, 1)) >= around
    })
}

impl NutsAndBolts {
    /// Checks that the scene can be built and that the task can be done in it.
    ///
    /// # Errors
    /// [`TaskError::Setting`] or [`TaskError::Range`], with the setting, its value and what is expected.
    pub fn check(&self) -> Result<(), TaskError> {
        for (name, number, least, most) in RANGES {
            let value = number(self);
            if !(least..=most).contains(&value) {
                return Err(TaskError::Range { name, value, least, most });
            }
        }
        self.gripper.check()?;
        if ![1, 2, 4].contains(&self.step_ms) {
            let value = self.step_ms.to_string();
            return Err(TaskError::Setting { name: "step_ms", value, expected: "1, 2 or 4" });
        }
        self.arm.check(self.step_ms)?;
        let mut rules = COUNTS.iter().chain(&SIZES).chain(&PLACES);
        if let Some(rule) = rules.find(|rule| !(rule.holds)(self)) {
            let Rule { name, value, expected, .. } = *rule;
            return Err(TaskError::Setting { name, value: value(self), expected });
        }
        start::parts(self, Seed::new(0)).map(|_| ())
    }
}
