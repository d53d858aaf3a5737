//! The scene's dimensions, materials and motors, all in one place, in SI units.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::shapes::neck_radius;
use crate::files::read_file;
use crate::sim::Seed;
use crate::task::error::{InputFault, TaskError, json_problem};
use crate::task::robot::{ArmSpec, GripperSpec};

/// Hex nuts and hex-head bolts without threads. Lengths in metres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PartSpec {
    /// Distance between opposing flats of nuts and of bolt heads.
    pub across_flats_m: f64,
    /// Height of a nut.
    pub nut_height_m: f64,
    /// Radius of a nut's hole.
    pub nut_hole_m: f64,
    /// Height of a bolt's head.
    pub head_height_m: f64,
    /// Radius of a bolt's shaft.
    pub shaft_radius_m: f64,
    /// Length of a bolt's shaft.
    pub shaft_length_m: f64,
    /// Width of the chamfer of a shaft's tip.
    pub tip_chamfer_m: f64,
    /// Kilograms a cubic metre (steel: 7,800).
    pub density: f64,
    /// Coefficient of friction of parts, table and jig. Between pad and part the greater of theirs counts: the grip
    /// fails only if [`GripperSpec::friction`] is small too.
    pub friction: f64,
}

impl Default for PartSpec {
    fn default() -> Self {
        Self {
            across_flats_m: 0.030,
            nut_height_m: 0.016,
            nut_hole_m: 0.0096,
            head_height_m: 0.012,
            shaft_radius_m: 0.008,
            shaft_length_m: 0.050,
            tip_chamfer_m: 0.003,
            density: 7800.0,
            friction: 0.5,
        }
    }
}

/// The jig: a round pocket for a nut and a hole for a bolt, each in a block of its own that stands on
/// the table. Lengths in metres, positions on the table.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct JigSpec {
    /// Where the nut's pocket is.
    pub pocket: [f64; 2],
    /// Where the bolt's hole is.
    pub hole: [f64; 2],
    /// Height of the pocket's floor.
    pub pocket_floor_m: f64,
    /// How deep the pocket is.
    pub pocket_depth_m: f64,
    /// What the pocket's radius exceeds a nut's corners by.
    pub pocket_clearance_m: f64,
    /// Height of the hole's upper edge, on which a bolt's head rests.
    pub hole_top_m: f64,
    /// What the hole's radius exceeds a shaft by.
    pub hole_clearance_m: f64,
    /// Width of the chamfer at both entries.
    pub chamfer_m: f64,
    /// Thickness of the walls.
    pub wall_m: f64,
}

impl Default for JigSpec {
    fn default() -> Self {
        Self {
            pocket: [0.42, -0.22],
            hole: [0.52, -0.10],
            pocket_floor_m: 0.042,
            pocket_depth_m: 0.008,
            pocket_clearance_m: 0.0007,
            hole_top_m: 0.062,
            hole_clearance_m: 0.0008,
            chamfer_m: 0.003,
            wall_m: 0.010,
        }
    }
}

/// The table and where parts are dropped on it. Metres and degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TableSpec {
    /// The inner corners of the rim.
    pub rim: [[f64; 2]; 2],
    /// Height of the rim.
    pub rim_height_m: f64,
    /// The corners of the area in which parts begin.
    pub drop: [[f64; 2]; 2],
    /// From how high they are dropped.
    pub drop_height_m: f64,
    /// Greatest tilt, from lying, with which they are dropped.
    pub drop_tilt_deg: f64,
    /// Least distance between parts when they are dropped.
    pub spacing_m: f64,
}

impl Default for TableSpec {
    fn default() -> Self {
        Self {
            rim: [[0.30, -0.33], [0.66, 0.36]],
            rim_height_m: 0.015,
            drop: [[0.38, 0.03], [0.58, 0.29]],
            drop_height_m: 0.03,
            drop_tilt_deg: 25.0,
            spacing_m: 0.085,
        }
    }
}

/// Everything there is to know before a scene is built.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SceneSpec {
    /// How many nuts (1 to [`MOST_PARTS`]).
    pub nuts: usize,
    /// How many bolts (1 to [`MOST_PARTS`]).
    pub bolts: usize,
    /// What the recorder calls a nut.
    pub nut_kind: String,
    /// What the recorder calls a bolt.
    pub bolt_kind: String,
    /// The parts.
    pub part: PartSpec,
    /// The jig.
    pub jig: JigSpec,
    /// The table.
    pub table: TableSpec,
    /// The gripper.
    pub gripper: GripperSpec,
    /// The arm.
    pub arm: ArmSpec,
    /// Milliseconds of one step of the physics (1, 2 or 4).
    pub step_ms: u64,
}

impl Default for SceneSpec {
    fn default() -> Self {
        Self {
            nuts: 1,
            bolts: 1,
            nut_kind: "nut".into(),
            bolt_kind: "bolt".into(),
            part: PartSpec::default(),
            jig: JigSpec::default(),
            table: TableSpec::default(),
            gripper: GripperSpec::default(),
            arm: ArmSpec::default(),
            step_ms: 4,
        }
    }
}

/// Most parts of one kind in a scene: more do not fit the table.
pub const MOST_PARTS: usize = 4;

/// How far a shoulder of the arm stands above the table, in metres.
const SHOULDER_M: f64 = 0.333;
/// How far the tool can be from the shoulder when it points down, in metres.
const REACH_M: f64 = 0.72;

impl SceneSpec {
    /// Reads settings from JSON; what is not there keeps its default.
    ///
    /// # Errors
    /// [`TaskError::File`] if the file cannot be read; as [`SceneSpec::parse`].
    pub fn read(path: &Path) -> Result<Self, TaskError> {
        Self::parse(&read_file(path)?, &path.display().to_string())
    }

    /// Settings from JSON text that came from `name`.
    ///
    /// # Errors
    /// [`TaskError::Input`], with the line for what is no such JSON and with the field for a value that
    /// [`SceneSpec::check`] refuses.
    pub fn parse(text: &[u8], name: &str) -> Result<Self, TaskError> {
        let fault = |line, field: &str, problem: String, expected: &str| InputFault {
            file: name.into(),
            line,
            field: field.into(),
            problem,
            expected: expected.into(),
        };
        // Serde would take a list of values in order.
        if text.trim_ascii_start().first() != Some(&b'{') {
            let expected = "an object of a scene's settings, as `symbolt config` prints them";
            return Err(fault(Some(1), "", "it is no JSON object".into(), expected).into());
        }
        let spec: Self = serde_json::from_slice(text).map_err(|error| {
            let line = (error.line() > 0).then(|| error.line());
            fault(
                line,
                "",
                json_problem(&error),
                "a scene's settings, as `symbolt config` prints them",
            )
        })?;
        match spec.check() {
            Err(TaskError::Setting { name: field, value, expected }) => {
                Err(fault(None, field, value, expected).into())
            }
            Err(TaskError::Range { name: field, value, least, most }) => {
                let expected = format!("{least} to {most}");
                Err(fault(None, field, value.to_string(), &expected).into())
            }
            other => other.map(|()| spec),
        }
    }

    /// The scene seen in a mirror: left and right of the arm change places.
    pub fn mirrored(mut self) -> Self {
        let flip = |[low, high]: [[f64; 2]; 2]| [[low[0], -high[1]], [high[0], -low[1]]];
        self.jig.pocket[1] = -self.jig.pocket[1];
        self.jig.hole[1] = -self.jig.hole[1];
        self.table.rim = flip(self.table.rim);
        self.table.drop = flip(self.table.drop);
        self
    }

    /// Height of a seated bolt's head's underside less that of an assembled one, in metres.
    pub fn sink_m(&self) -> f64 {
        let assembled = self.jig.pocket_floor_m + self.part.nut_height_m;
        self.jig.hole_top_m - assembled
    }

    /// Checks that such a scene can be built and the task be done in it.
    ///
    /// # Errors
    /// [`TaskError::Setting`], naming the setting, its value and what is possible.
    pub fn check(&self) -> Result<(), TaskError> {
        let (part, jig, table) = (&self.part, &self.jig, &self.table);
        let refuse = |name: &'static str, value: String, expected: &'static str| {
            Err(TaskError::Setting { name, value, expected })
        };
        let gain = 1e3 / self.step_ms.max(1) as f64;
        for (name, value, least, most) in [
            ("part.across_flats_m", part.across_flats_m, 5e-3, 0.1),
            ("part.nut_height_m", part.nut_height_m, 2e-3, 0.1),
            ("part.nut_hole_m", part.nut_hole_m, 1e-3, 0.1),
            ("part.head_height_m", part.head_height_m, 2e-3, 0.1),
            ("part.shaft_radius_m", part.shaft_radius_m, 1e-3, 0.1),
            ("part.shaft_length_m", part.shaft_length_m, 5e-3, 0.2),
            ("part.tip_chamfer_m", part.tip_chamfer_m, 1e-4, 0.1),
            ("part.density", part.density, 100.0, 30_000.0),
            ("part.friction", part.friction, 1e-3, 10.0),
            ("jig.pocket_floor_m", jig.pocket_floor_m, 5e-3, 0.3),
            ("jig.pocket_depth_m", jig.pocket_depth_m, 1e-3, 0.1),
            ("jig.pocket_clearance_m", jig.pocket_clearance_m, 1e-5, 0.02),
            ("jig.hole_top_m", jig.hole_top_m, 5e-3, 0.3),
            ("jig.hole_clearance_m", jig.hole_clearance_m, 1e-5, 0.02),
            ("jig.chamfer_m", jig.chamfer_m, 1e-4, 0.02),
            ("jig.wall_m", jig.wall_m, 1e-3, 0.05),
            ("table.rim_height_m", table.rim_height_m, 1e-3, 0.1),
            ("table.drop_height_m", table.drop_height_m, 0.02, 0.5),
            ("table.spacing_m", table.spacing_m, 0.03, 1.0),
            ("gripper.force_n", self.gripper.force_n, 0.1, 1e3),
            ("gripper.friction", self.gripper.friction, 1e-3, 10.0),
            ("gripper.stroke_m", self.gripper.stroke_m, 5e-3, 0.06),
            ("gripper.frequency", self.gripper.frequency, 1.0, 5e3),
            ("arm.position_gain", self.arm.position_gain, 1.0, gain),
            ("arm.velocity_gain", self.arm.velocity_gain, 1.0, 1e5),
            ("arm.armature", self.arm.armature, 0.0, 100.0),
            ("arm.speed", self.arm.speed, 0.05, 10.0),
            ("arm.carry_speed", self.arm.carry_speed, 0.05, 10.0),
            ("arm.carry_m_s", self.arm.carry_m_s, 0.05, 10.0),
            ("arm.acceleration", self.arm.acceleration[0], 0.1, 1e3),
            ("arm.acceleration", self.arm.acceleration[1], 0.1, 1e3),
            ("arm.approach_m_s", self.arm.approach_m_s, 0.01, 2.0),
            ("arm.alarm_m", self.arm.alarm_m, 1e-3, 0.1),
        ] {
            if !(least..=most).contains(&value) {
                return Err(TaskError::Range { name, value, least, most });
            }
        }
        if let Some(bad) = self.arm.torque_nm.iter().find(|t| !(0.0..=1e4).contains(*t)) {
            return refuse("arm.torque_nm", bad.to_string(), "0 to 10000 for each joint");
        }
        for (name, count) in [("nuts", self.nuts), ("bolts", self.bolts)] {
            if count == 0 || count > MOST_PARTS {
                return refuse(name, count.to_string(), "1 to 4");
            }
        }
        let fixed = [format!("{}_pocket", self.nut_kind), format!("{}_hole", self.bolt_kind)];
        let clash = |kind: &String| kind.is_empty() || fixed.contains(kind);
        if self.nut_kind == self.bolt_kind || clash(&self.nut_kind) || clash(&self.bolt_kind) {
            let kinds = format!("`{}` and `{}`", self.nut_kind, self.bolt_kind);
            return refuse(
                "nut_kind and bolt_kind",
                kinds,
                "two names, different from the jig's too",
            );
        }
        if ![1, 2, 4].contains(&self.step_ms) {
            return refuse("step_ms", self.step_ms.to_string(), "1, 2 or 4");
        }
        if part.nut_hole_m < part.shaft_radius_m + 2e-4 {
            let expected = "more than part.shaft_radius_m by at least 0.2 mm";
            return refuse("part.nut_hole_m", part.nut_hole_m.to_string(), expected);
        }
        if 2.0 * part.nut_hole_m > part.across_flats_m - 4e-3 {
            let expected = "a hole that leaves 2 mm of wall";
            return refuse("part.nut_hole_m", part.nut_hole_m.to_string(), expected);
        }
        if part.tip_chamfer_m >= part.shaft_radius_m {
            let expected = "less than part.shaft_radius_m";
            return refuse("part.tip_chamfer_m", part.tip_chamfer_m.to_string(), expected);
        }
        if part.tip_chamfer_m >= part.shaft_length_m {
            let expected = "less than part.shaft_length_m";
            return refuse("part.tip_chamfer_m", part.tip_chamfer_m.to_string(), expected);
        }
        if part.across_flats_m + 8e-3 > 2.0 * self.gripper.stroke_m {
            let expected = "4 mm a finger less than the gripper's stroke";
            return refuse("part.across_flats_m", part.across_flats_m.to_string(), expected);
        }
        if jig.hole_top_m < part.shaft_length_m + 5e-3 {
            let expected = "more than part.shaft_length_m by 5 mm, so that the shaft hangs free";
            return refuse("jig.hole_top_m", jig.hole_top_m.to_string(), expected);
        }
        let edge = part.shaft_radius_m + jig.hole_clearance_m + jig.chamfer_m;
        if edge + 1e-3 > neck_radius(part) {
            let expected = "a hole and chamfer that leave 1 mm of edge under the head";
            return refuse("jig.chamfer_m", jig.chamfer_m.to_string(), expected);
        }
        if jig.pocket_floor_m + part.nut_height_m < part.shaft_length_m + 5e-3 {
            let expected = "high enough for the shaft below a seated nut";
            return refuse("jig.pocket_floor_m", jig.pocket_floor_m.to_string(), expected);
        }
        if jig.pocket_depth_m > part.nut_height_m - 7.5e-3 {
            let expected = "a depth that leaves 7.5 mm of the nut to hold";
            return refuse("jig.pocket_depth_m", jig.pocket_depth_m.to_string(), expected);
        }
        if self.sink_m().abs() < 1e-3 {
            let value = format!("{:.1} mm apart", 1e3 * self.sink_m());
            let expected = "heights of `in jig` and `assembled` that differ by at least 1 mm";
            return refuse("jig.hole_top_m", value, expected);
        }
        let inside = |[x, y]: [f64; 2], [low, high]: [[f64; 2]; 2], by: f64| {
            x > low[0] + by && x < high[0] - by && y > low[1] + by && y < high[1] - by
        };
        for (name, at) in [("jig.pocket", jig.pocket), ("jig.hole", jig.hole)] {
            if !inside(at, table.rim, 0.03) || !reachable(at) {
                let expected = "a place inside the rim, 3 cm from it, within the arm's reach";
                return refuse(name, format!("{at:?}"), expected);
            }
        }
        for corner in table.drop {
            if !inside(corner, table.rim, 0.0) || !reachable(corner) {
                let expected = "corners inside the rim and within the arm's reach";
                return refuse("table.drop", format!("{corner:?}"), expected);
            }
        }
        if (0..2).any(|i| table.drop[0][i] > table.drop[1][i]) {
            return refuse("table.drop", format!("{:?}", table.drop), "the lower corner first");
        }
        // A lying bolt's length around both blocks.
        let around = part.across_flats_m + jig.wall_m + part.shaft_length_m + part.head_height_m;
        for [x, y] in [jig.pocket, jig.hole] {
            let [low, high] = table.drop;
            let off = |v: f64, i: usize| (low[i] - v).max(v - high[i]).max(0.0);
            if off(x, 0).hypot(off(y, 1)) < around {
                let expected = "an area that leaves room for a lying bolt beside the jig";
                return refuse("table.drop", format!("{:?}", table.drop), expected);
            }
        }
        if !(0.0..=90.0).contains(&table.drop_tilt_deg) {
            return refuse("table.drop_tilt_deg", table.drop_tilt_deg.to_string(), "0 to 90");
        }
        let apart = (jig.pocket[0] - jig.hole[0]).hypot(jig.pocket[1] - jig.hole[1]);
        if apart < 0.09 {
            let expected = "at least 9 cm from the pocket";
            return refuse("jig.hole", format!("{:.1} mm away", 1e3 * apart), expected);
        }
        super::drops::places(self, Seed::new(0)).map(|_| ())
    }
}

fn reachable([x, y]: [f64; 2]) -> bool {
    let far = x.hypot(y);
    far > 0.25 && far.hypot(SHOULDER_M - 0.2) < REACH_M
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(change: impl FnOnce(&mut SceneSpec)) -> String {
        let mut spec = SceneSpec::default();
        change(&mut spec);
        spec.check().map_or_else(|e| e.to_string(), |()| "accepted".into())
    }

    #[test]
    fn the_default_and_its_mirror_image_are_sound() {
        assert!(SceneSpec::default().check().is_ok());
        assert!(SceneSpec::default().mirrored().check().is_ok());
        assert!(SceneSpec::default().sink_m() >= 1e-3);
    }

    #[test]
    fn settings_are_read_from_json_and_what_is_missing_has_its_default() {
        let text = br#"{"jig": {"hole_clearance_m": 0.001}, "arm": {"carry_m_s": 0.1}}"#;
        let spec = SceneSpec::parse(text, "cell.json").expect("sound");
        let mut expected = SceneSpec::default();
        expected.jig.hole_clearance_m = 0.001;
        expected.arm.carry_m_s = 0.1;
        assert_eq!(spec, expected);
        let whole = serde_json::to_vec(&expected).expect("it is plain data");
        assert_eq!(SceneSpec::parse(&whole, "whole").expect("sound"), expected);
    }

    #[test]
    fn what_cannot_be_read_or_built_is_refused_with_file_and_line_or_field() {
        let said = |text: &str| {
            let refused = SceneSpec::parse(text.as_bytes(), "cell.json").expect_err("unsound");
            refused.to_string()
        };
        let shaft = said(r#"{"part": {"shaft_radius_m": 0.02}}"#);
        assert!(shaft.starts_with("cell.json, field `part.nut_hole_m`: 0.0096"), "{shaft}");
        let typo = said("{\n\"part\": {\"fricton\": 0.3}}");
        assert!(typo.starts_with("cell.json, line 2: unknown field `fricton`"), "{typo}");
        for text in ["", "[]", "{", "3", r#"{"nuts": -1}"#, r#"{"nuts": 1e400}"#] {
            let message = said(text);
            assert!(message.starts_with("cell.json, line "), "{text}: {message}");
        }
    }

    #[test]
    fn impossible_scenes_are_refused_by_the_setting_that_is_wrong() {
        let cases: [(&str, String); 9] = [
            ("part.nut_hole_m", refused(|s| s.part.shaft_radius_m = 0.0097)),
            ("part.friction", refused(|s| s.part.friction = 0.0)),
            ("part.density", refused(|s| s.part.density = f64::NAN)),
            ("nuts", refused(|s| s.nuts = 0)),
            ("bolts", refused(|s| s.bolts = 100)),
            ("jig.pocket", refused(|s| s.jig.pocket = [0.9, 0.0])),
            ("table.drop", refused(|s| s.table.drop[1] = [2.0, 0.2])),
            ("jig.hole_top_m", refused(|s| s.jig.hole_top_m = 0.0585)),
            ("step_ms", refused(|s| s.step_ms = 3)),
        ];
        for (name, message) in cases {
            assert!(message.contains(name), "{name}: {message}");
        }
    }
}
