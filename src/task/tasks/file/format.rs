//! The fields of a task file.

use serde::{Deserialize, Serialize};

use crate::robot::arm::{ArmSpec, GripperSpec};
use crate::robot::scene::TableSpec;

/// A task as data: the contents of a task file. See the [module](super) for an example.
///
/// Lengths and positions are in metres, angles in degrees.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TaskFile {
    /// Always [`FORMAT`](super::FORMAT).
    pub format: String,
    /// Always [`VERSION`](super::VERSION).
    pub version: u32,
    /// Name of the task: lower case, with hyphens.
    pub name: String,
    /// Description of the task in one line.
    pub description: String,
    /// Kinds of movable parts.
    pub parts: Vec<PartKind>,
    /// Kinds of things that the robot does not move, and marks on the table.
    #[serde(default)]
    pub references: Vec<Reference>,
    /// Relations that must all hold at the end. Their order is the order in which `judge` names them; `after` says
    /// what must be done before what.
    pub goal: Vec<Relation>,
    /// Relations that need not hold at the end, but while others are brought about: those that name them in
    /// [`Relation::needs`]. An open drawer is such a condition.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub conditions: Vec<Relation>,
    /// Area of the table in which the demonstrator puts down parts that are in the way: the corner with the smaller
    /// coordinates first.
    pub aside: [[f64; 2]; 2],
    /// Changes that another hand may make during an episode. An episode draws at most one of them.
    #[serde(default)]
    pub perturbations: Vec<Meddling>,
    /// The table.
    #[serde(default)]
    pub table: TableSpec,
    /// The gripper.
    #[serde(default)]
    pub gripper: GripperSpec,
    /// The arm.
    #[serde(default)]
    pub arm: ArmSpec,
    /// Duration of one physics step, in milliseconds (1, 2 or 4).
    #[serde(default = "step_ms")]
    pub step_ms: u64,
}

/// A kind of movable part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PartKind {
    /// Name of the kind in recordings.
    pub kind: String,
    /// Convex pieces, in the body's frame.
    pub shape: Vec<Shape>,
    /// Density, in kilograms per cubic metre.
    pub density: f64,
    /// Coefficient of friction.
    #[serde(default = "friction")]
    pub friction: f64,
    /// How the robot puts the part down.
    pub handling: HandlingData,
    /// Colours in pictures.
    pub look: LookData,
    /// Ways to grasp the part, the best first.
    pub grasps: Vec<GraspData>,
    /// Where parts of this kind start, and how many there are.
    pub starts: Vec<Start>,
    /// The guide along which parts of this kind slide, like a drawer; parts without one move freely.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slider: Option<SliderData>,
}

/// A straight guide. The robot takes a part on it and slides it; the part neither turns nor leaves the guide. See
/// [`Slider`](crate::robot::scene::Slider).
///
/// The part starts at coordinate 0, with its origin exactly at the place that is drawn in the region. If the region lies
/// in the frame of a movable reference with a shape, this reference carries the guide. Otherwise the table does.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SliderData {
    /// Direction of positive coordinates, in the part's frame.
    pub axis: [f64; 3],
    /// Least and greatest coordinate: at most 0 and at least 0.
    pub range_m: [f64; 2],
    /// Friction of the guide, in newtons.
    pub friction_n: f64,
}

/// A convex piece of a body, or several that form a ring.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape {
    /// A box along the axes of the body.
    Box {
        /// Middle of the box.
        middle: [f64; 3],
        /// Length of its sides.
        size_m: [f64; 3],
    },
    /// An upright prism, or a cylinder with many sides. One side faces the x axis.
    Prism {
        /// Middle of the lower face.
        base: [f64; 3],
        /// Distance of the sides from the axis.
        radius_m: f64,
        /// Distance of the sides from the axis at the upper face; `radius_m` if it is left out.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        top_radius_m: Option<f64>,
        /// Height.
        height_m: f64,
        /// Number of sides: 3 to 48.
        sides: u32,
    },
    /// An upright tube, made of one piece for each side. One side faces the x axis.
    Ring {
        /// Middle of the lower face.
        base: [f64; 3],
        /// Distance of the inner sides from the axis.
        inner_m: f64,
        /// Distance of the outer sides from the axis.
        outer_m: f64,
        /// Height.
        height_m: f64,
        /// Width of a chamfer at the upper inner edge.
        #[serde(default)]
        chamfer_m: f64,
        /// Number of sides: 3 to 48.
        sides: u32,
    },
    /// The convex hull of points.
    Hull {
        /// At least four points that enclose a volume.
        points: Vec<[f64; 3]>,
    },
}

/// How the robot puts down a part. See [`Handling`](crate::robot::scene::Handling).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HandlingData {
    /// Number of equally spaced turns about the part's z axis that are tried where only the direction of this axis
    /// matters, 1 to 360.
    pub turns: u32,
    /// Number of equal turns about the z axis after which the part looks the same, 1 to 360: 4 for a square block.
    /// They are equivalent where the whole orientation matters.
    #[serde(default = "fold")]
    pub fold: u32,
    /// Whether the part may also be put down upside down.
    #[serde(default)]
    pub flips: bool,
    /// Height above its place from which the part is lowered straight down.
    #[serde(default = "rise_m")]
    pub rise_m: f64,
    /// Distance of each finger from the middle of the gripper when the hand lets go.
    pub release_m: f64,
    /// Horizontal distance within which another part of this kind blocks a place.
    #[serde(default = "in_the_way_m")]
    pub in_the_way_m: f64,
    /// Greatest height above its place from which the part may fall if the hand cannot reach lower.
    #[serde(default)]
    pub fall_m: f64,
    /// Distance that the arm keeps from everything else on its way, where it finds such a way: for parts that a touch
    /// would push over.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub clear_m: f64,
}

/// Colours in pictures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LookData {
    /// Colour, such as `#e69f00`.
    pub colour: String,
    /// Colour of text about the body on white; `colour` if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ink: Option<String>,
    /// Roughness, from 0 (mirror) to 1 (chalk).
    #[serde(default = "roughness")]
    pub roughness: f64,
}

/// A family of grasps in the body's frame. The gripper may be turned by half a turn, so each grasp is tried with both
/// senses of `closing`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GraspData {
    /// Point to which the tips of the fingers go.
    pub at: [f64; 3],
    /// Distance by which the tips go beyond `at` along `approach`.
    #[serde(default)]
    pub beyond_m: f64,
    /// Direction in which the hand points.
    pub approach: [f64; 3],
    /// Direction along which the fingers close, perpendicular to `approach`.
    pub closing: [f64; 3],
    /// Distances of each finger from the middle of the gripper on the way to the part, the best first. A narrower
    /// opening fits where other bodies are near.
    pub openings_m: Vec<f64>,
    /// Turns of `approach` about `closing` that are tried, in this order.
    #[serde(default = "untilted")]
    pub tilts_deg: Vec<f64>,
    /// Greatest angle between the direction in which the hand points and straight down. With more than 60 degrees the
    /// hand may also come from the side, but not from behind the part.
    #[serde(default = "steep_deg", skip_serializing_if = "is_steep")]
    pub most_deg: f64,
    /// Repetition about an axis; no repetition if it is left out. Turns at which the fingers close on nothing are left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub around: Option<Around>,
}

/// A repetition about an axis through the body's origin.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Around {
    /// Direction of the axis, which goes through the origin of the body's frame.
    pub axis: [f64; 3],
    /// Number of equally spaced turns, 1 to 48.
    pub times: u32,
}

/// Where parts or references start: in `region`, or on top of another part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Start {
    /// How many start here.
    #[serde(default = "one")]
    pub count: usize,
    /// Area in which they start.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub region: Option<Region>,
    /// Kind of part on which they start: the first part of that kind.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub on: Option<String>,
    /// Least distance from everything that was placed before.
    #[serde(default = "gap_m")]
    pub gap_m: f64,
    /// Whether these parts fall on each other, without regard to `gap_m`, to form a heap.
    #[serde(default)]
    pub heap: bool,
}

/// An area in the scene or in a reference's frame, and the poses that are drawn in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Reference in whose frame the area lies: its first instance, or `world`.
    #[serde(default = "world")]
    pub of: String,
    /// Corner with the smaller coordinates.
    pub low: [f64; 2],
    /// Corner with the greater coordinates; `low` if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub high: Option<[f64; 2]>,
    /// Height of the area.
    #[serde(default)]
    pub z_m: f64,
    /// Direction of the body's z axis before `yaw_deg` and `tilt_deg` are applied.
    #[serde(default = "up")]
    pub z_axis: [f64; 3],
    /// Least and greatest turn about the vertical.
    #[serde(default)]
    pub yaw_deg: [f64; 2],
    /// Greatest tilt in any direction.
    #[serde(default)]
    pub tilt_deg: f64,
    /// Height from which a part falls, measured at its lowest point.
    #[serde(default = "drop_m")]
    pub drop_m: f64,
}

/// A kind of thing that the robot does not move. Each has a frame whose z axis points up.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reference {
    /// Name of the kind.
    pub name: String,
    /// Convex pieces, in the body's frame; none for a mark on the table.
    #[serde(default)]
    pub shape: Vec<Shape>,
    /// Coefficient of friction.
    #[serde(default = "friction")]
    pub friction: f64,
    /// Colours in pictures.
    pub look: LookData,
    /// Whether another hand may move such a reference. It then takes along what lies on it.
    #[serde(default)]
    pub movable: bool,
    /// Where references of this kind stand, and how many there are.
    pub starts: Vec<Start>,
    /// Corners, in the body's frame, of the area that is kept free of everything placed later; the outline of the
    /// shape if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub room: Option<[[f64; 2]; 2]>,
    /// Places that recordings show; one with the name of the reference at its origin if they are left out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub landmarks: Vec<LandmarkData>,
}

/// A place of a reference that recordings show.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LandmarkData {
    /// Name of its kind in recordings.
    pub name: String,
    /// Position in the reference's frame.
    pub at: [f64; 3],
}

/// A relation of the goal: parts of one kind stand at places of a reference.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Relation {
    /// Name of the relation, such as `fork left of the plate`.
    pub name: String,
    /// Kind of the part.
    pub part: String,
    /// Name of a reference, a kind of part, or `world`. The frame of a part is levelled: its z axis points up, and its
    /// x axis follows the horizontal direction of the part's x axis (or y axis, if the x axis is vertical).
    pub reference: String,
    /// Places in the reference's frame, one of which the part takes.
    pub places: Vec<Place>,
    /// Greatest deviation of the part's origin from its place along each axis of the reference's frame; `null` where
    /// the position does not matter. There the demonstrator leaves the part where it is: a cup that need only stand
    /// upright is turned over in place.
    pub within_m: [Option<f64>; 3],
    /// Which directions of the part matter.
    #[serde(default)]
    pub orientation: Orientation,
    /// Greatest angle between a direction that matters and the direction of the place.
    #[serde(default = "within_deg")]
    pub within_deg: f64,
    /// How often the relation must hold.
    #[serde(rename = "for")]
    pub quantity: Quantity,
    /// Names of the relations that must hold before a part is brought here.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub after: Vec<String>,
    /// Names of the conditions that must hold while a part is brought here. If a condition is about parts of the same
    /// kind, only a part for which it holds is brought here.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub needs: Vec<String>,
}

impl TaskFile {
    /// Returns the relations of the goal, then the conditions.
    pub(super) fn relations(&self) -> impl Iterator<Item = &Relation> {
        self.goal.iter().chain(&self.conditions)
    }
}

/// A place in a reference's frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Place {
    /// Position of the part's origin.
    pub position: [f64; 3],
    /// Direction of the part's z axis.
    #[serde(default = "up")]
    pub z_axis: [f64; 3],
    /// Direction of the part's x axis, perpendicular to `z_axis`. It matters only if the orientation is `full`.
    #[serde(default = "ahead")]
    pub x_axis: [f64; 3],
}

/// The directions of a part that matter in a relation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Orientation {
    /// None.
    Free,
    /// The z axis. A part that may be put down upside down may point either way.
    #[default]
    Axis,
    /// The z axis and the x axis.
    Full,
}

/// How often a relation must hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// For each instance of the reference, at one of its places.
    Each,
    /// For at least one instance of the reference, at one of its places.
    One,
    /// For at least so many parts, at the places of all instances together.
    AtLeast(usize),
}

/// A change that another hand may make: it puts a part or a movable reference somewhere else.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Meddling {
    /// Kind of part, or name of a movable reference. The seed draws which of them.
    pub moves: String,
    /// Where the hand puts it.
    pub to: Region,
    /// Earliest and latest simulated time, in seconds.
    pub between_s: [f64; 2],
}

fn step_ms() -> u64 {
    4
}

fn friction() -> f64 {
    0.5
}

fn fold() -> u32 {
    1
}

fn rise_m() -> f64 {
    0.05
}

fn in_the_way_m() -> f64 {
    0.02
}

fn roughness() -> f64 {
    0.5
}

fn untilted() -> Vec<f64> {
    vec![0.0]
}

fn one() -> usize {
    1
}

fn gap_m() -> f64 {
    0.01
}

fn world() -> String {
    super::WORLD.into()
}

fn up() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

fn ahead() -> [f64; 3] {
    [1.0, 0.0, 0.0]
}

fn drop_m() -> f64 {
    0.004
}

fn within_deg() -> f64 {
    5.0
}

fn steep_deg() -> f64 {
    60.0
}

fn is_steep(most_deg: &f64) -> bool {
    *most_deg == steep_deg()
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}
