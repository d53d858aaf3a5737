//! The task's settings: dimensions, materials, places and motors, in SI units. `symbolt config` prints them.

use serde::{Deserialize, Serialize};

use crate::robot::arm::{ArmSpec, GripperSpec};
use crate::task::error::TaskError;
use crate::task::tasks::parse_settings;

/// Indices of the kinds in the scene.
pub(super) const NUT: usize = 0;
pub(super) const BOLT: usize = 1;

/// Dimensions and material of hex nuts and hex-head bolts without threads. Lengths in metres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PartSpec {
    /// Distance between opposing flats of nuts and bolt heads.
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
    /// Width of the chamfer at the shaft's tip.
    pub tip_chamfer_m: f64,
    /// Density, in kilograms per cubic metre (steel: 7,800).
    pub density: f64,
    /// Coefficient of friction of parts, table and jig. Between pad and part, the greater of the two
    /// coefficients applies: a grasp slips only if [`GripperSpec::friction`] is small too.
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

/// The jig: a round pocket for a nut and a hole for a bolt, in two separate blocks on the table. Lengths and
/// positions in metres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct JigSpec {
    /// Position of the nut's pocket on the table.
    pub pocket: [f64; 2],
    /// Position of the bolt's hole on the table.
    pub hole: [f64; 2],
    /// Height of the pocket's floor.
    pub pocket_floor_m: f64,
    /// Depth of the pocket.
    pub pocket_depth_m: f64,
    /// Radius of the pocket minus the distance of a nut's corners from its centre.
    pub pocket_clearance_m: f64,
    /// Height of the hole's upper edge, on which a bolt's head rests.
    pub hole_top_m: f64,
    /// Radius of the hole minus the radius of a shaft.
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

/// The table and the area in which parts are dropped. Lengths in metres, angles in degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TableSettings {
    /// Inner corners of the rim, as `[x, y]`: first the corner with the smaller coordinates.
    pub rim: [[f64; 2]; 2],
    /// Height of the rim.
    pub rim_height_m: f64,
    /// Corners of the area in which parts are dropped, as `[x, y]`: first the corner with the smaller coordinates.
    pub drop: [[f64; 2]; 2],
    /// Height from which parts are dropped.
    pub drop_height_m: f64,
    /// Greatest tilt of a dropped part from its lying pose, 0 to 90 degrees.
    pub drop_tilt_deg: f64,
    /// Least distance between dropped parts.
    pub spacing_m: f64,
}

impl Default for TableSettings {
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

/// The nut-and-bolt task and its settings. The robot puts a nut and a bolt into the jig, then the bolt through the nut.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NutsAndBolts {
    /// Number of nuts (1 to [`MAX_OF_A_KIND`]).
    pub nuts: usize,
    /// Number of bolts (1 to [`MAX_OF_A_KIND`]).
    pub bolts: usize,
    /// Name of a nut's kind in recordings.
    pub nut_kind: String,
    /// Name of a bolt's kind in recordings.
    pub bolt_kind: String,
    /// Dimensions and material of nuts and bolts.
    pub part: PartSpec,
    /// Places and dimensions of the jig.
    pub jig: JigSpec,
    /// The table, and where parts are dropped.
    pub table: TableSettings,
    /// Force, stroke and friction of the gripper.
    pub gripper: GripperSpec,
    /// Motors and speeds of the arm.
    pub arm: ArmSpec,
    /// Duration of one physics step, in milliseconds (1, 2 or 4).
    pub step_ms: u64,
}

impl Default for NutsAndBolts {
    fn default() -> Self {
        Self {
            nuts: 1,
            bolts: 1,
            nut_kind: "nut".into(),
            bolt_kind: "bolt".into(),
            part: PartSpec::default(),
            jig: JigSpec::default(),
            table: TableSettings::default(),
            gripper: GripperSpec::default(),
            arm: ArmSpec::default(),
            step_ms: 4,
        }
    }
}

/// Greatest number of parts of one kind. More do not fit on the table.
pub const MAX_OF_A_KIND: usize = 4;

impl NutsAndBolts {
    /// Parses settings from JSON text. `name` is the name of the file in error messages.
    ///
    /// # Errors
    /// [`TaskError::Input`], which names the line if the text is not a JSON object of these settings, or the field if
    /// [`NutsAndBolts::check`] refuses its value.
    pub fn parse(text: &[u8], name: &str) -> Result<Self, TaskError> {
        parse_settings(text, name, Self::check)
    }

    /// Returns the mirror image of these settings: left and right of the arm change places.
    pub fn mirrored(mut self) -> Self {
        let flip = |[low, high]: [[f64; 2]; 2]| [[low[0], -high[1]], [high[0], -low[1]]];
        self.jig.pocket[1] = -self.jig.pocket[1];
        self.jig.hole[1] = -self.jig.hole[1];
        self.table.rim = flip(self.table.rim);
        self.table.drop = flip(self.table.drop);
        self
    }

    /// Returns the height of a bolt in the jig's hole above its height when assembled, in metres.
    pub fn sink_m(&self) -> f64 {
        let assembled = self.jig.pocket_floor_m + self.part.nut_height_m;
        self.jig.hole_top_m - assembled
    }

    /// Returns the names of the jig's places in recordings: the nut's pocket and the bolt's hole.
    pub fn places(&self) -> [String; 2] {
        [format!("{}_pocket", self.nut_kind), format!("{}_hole", self.bolt_kind)]
    }
}
