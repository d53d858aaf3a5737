//! The kinds of doubt, each with its name, and the reading and the way to ask for it that most doubts of the kind have.

use serde::{Serialize, Serializer};

/// What is doubtful.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum DoubtKind {
    /// Lengths have another unit than metres: everywhere, for one kind of object, or in one demonstration.
    LengthUnit,
    /// Times have another unit than seconds.
    TimeUnit,
    /// Quaternions have another order than x, y, z, w.
    QuaternionOrder,
    /// Angles have another unit than was taken for theirs.
    AngleUnit,
    /// Another axis than z points up.
    UpAxis,
    /// The axis that points up has the wrong sign.
    UpsideDown,
    /// The frame is not upright, as that of a tilted camera.
    TiltedFrame,
    /// All objects move together, as seen by a moving camera.
    MovingCamera,
    /// Positions and orientations have different handedness.
    LeftHanded,
    /// A demonstration is the mirror image of the others.
    Mirrored,
    /// All objects of a demonstration are elsewhere by the same distance, or in another frame.
    Shifted,
    /// The named object did not move while another did.
    WrongObject,
    /// Two objects have each other's id.
    SwappedIds,
    /// An object is elsewhere all at once, and nothing carried it.
    Jump,
    /// A time occurs twice, or a snapshot is repeated.
    DuplicateTime,
    /// No object moves, or a kind of object that is touched never does.
    NothingMoves,
    /// A pose stays the same to the bit, although poses are noisy.
    Frozen,
    /// Two objects are in the same place.
    SamePlace,
    /// An object is below everything else.
    BelowTable,
    /// A demonstration begins where the others end.
    Disagreement,
    /// There is one demonstration alone.
    FewDemonstrations,
}

impl DoubtKind {
    /// Returns the name, in snake case.
    pub fn name(self) -> &'static str {
        self.words().0
    }

    /// Returns the name, the usual reading, and how to ask for it. Where these are empty, each doubt has its own.
    pub(super) fn words(self) -> (&'static str, &'static str, &'static str) {
        match self {
            Self::LengthUnit => ("length_unit", "", ""),
            Self::TimeUnit => (
                "time_unit",
                "the times have a greater unit than seconds, such as minutes",
                "give the unit to `symbolt import` as `time_unit`, or multiply `t`",
            ),
            Self::QuaternionOrder => (
                "quaternion_order",
                "the quaternions are probably w, x, y, z",
                "import the log with `quaternion` set to `wxyz`, or move the first number of \
                 `orientation` to the end",
            ),
            Self::AngleUnit => ("angle_unit", "", ""),
            Self::UpAxis => (
                "up_axis",
                "its axes are probably in another order than those of the others",
                "import its session with an `up` of its own, or exchange the columns",
            ),
            Self::UpsideDown => {
                ("upside_down", "z points down in it", "import its session with `up` set to `-z`")
            }
            Self::TiltedFrame => (
                "tilted_frame",
                "poses are probably in the frame of a camera, or the world is tilted",
                "give the pose of the camera to `symbolt import` as `frame`",
            ),
            Self::MovingCamera => (
                "moving_camera",
                "poses are probably in the frame of a moving camera or hand",
                "transform them into the world before `symbolt import`",
            ),
            Self::LeftHanded => (
                "left_handed",
                "the positions are probably left-handed (one axis reversed, or two exchanged), or the \
                 orientations inverted",
                "import the log with `handed` set to `left`, or reverse one axis",
            ),
            Self::Mirrored => ("mirrored", "", ""),
            Self::Shifted => (
                "shifted",
                "the table, the camera or the origin was probably moved",
                "import its session with a `frame` of its own, or leave it out",
            ),
            Self::WrongObject => ("wrong_object", "", ""),
            Self::SwappedIds => {
                ("swapped_ids", "their ids or kinds are probably exchanged in it", "")
            }
            Self::Jump => {
                ("jump", "the tracker probably lost it for a moment, or took another for it", "")
            }
            Self::DuplicateTime => (
                "duplicate_time",
                "the line is probably recorded twice",
                "leave the repeated line out",
            ),
            Self::NothingMoves => (
                "nothing_moves",
                "its poses were probably not updated, or another object was meant",
                "check the columns of this object in the log",
            ),
            Self::Frozen => (
                "frozen",
                "the stream of poses has probably stopped",
                "leave the rest of the demonstration out",
            ),
            Self::SamePlace => ("same_place", "they are probably one object under two ids", ""),
            Self::BelowTable => (
                "below_table",
                "it lies on the floor, or its height is wrong",
                "leave it out, or correct its height",
            ),
            Self::Disagreement => (
                "disagreement",
                "it shows the opposite task, or is played backwards",
                "leave it out, or learn from it by itself",
            ),
            Self::FewDemonstrations => (
                "few_demonstrations",
                "it cannot tell what is needed from what happened to be so",
                "record more, with the objects elsewhere at the start",
            ),
        }
    }
}

impl Serialize for DoubtKind {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}
