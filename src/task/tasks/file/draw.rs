//! Draws where references and parts start.

use std::cell::Cell;
use std::f64::consts::TAU;

use rand::{Rng, RngExt};

use super::format::{Reference, Region, Start, TaskFile};
use super::shape;
use crate::robot::arm::level::{Level, arc};
use crate::robot::arm::{BodyFrame, Turn, reaches_table};
use crate::robot::scene::Piece;
use crate::robot::scene::extent::Extent;
use crate::sim::Seed;

/// A task file and its shapes.
#[derive(Debug, PartialEq)]
pub(super) struct Inner {
    pub file: TaskFile,
    pub shapes: Shapes,
}

/// Shapes of a task file, ready for use.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Shapes {
    /// Pieces of each kind of part.
    pub parts: Vec<Vec<Piece>>,
    /// Corners of each kind of part.
    pub corners: Vec<Vec<[f64; 3]>>,
    /// Pieces of each kind of reference.
    pub references: Vec<Vec<Piece>>,
}

impl Shapes {
    pub fn of(file: &TaskFile) -> Self {
        let parts: Vec<Vec<Piece>> =
            file.parts.iter().map(|part| shape::pieces(&part.shape)).collect();
        let corners = parts.iter().map(|pieces| pieces.concat()).collect();
        let references = file.references.iter().map(|r| shape::pieces(&r.shape)).collect();
        Self { parts, corners, references }
    }

    /// Returns the space that is kept free for a reference at `frame`.
    pub fn room(&self, index: usize, reference: &Reference, frame: &BodyFrame) -> Option<Extent> {
        let mut corners = self.references[index].concat();
        let top = corners.iter().map(|c| c[2]).fold(0.0, f64::max);
        if let Some([low, high]) = reference.room {
            corners = vec![[low[0], low[1], 0.0], [high[0], high[1], top]];
            corners.extend([[low[0], high[1], 0.0], [high[0], low[1], top]]);
        }
        (!corners.is_empty()).then(|| Extent::of(&corners, frame))
    }
}

/// Where everything starts.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Layout {
    /// Frames of the instances of each kind of reference.
    pub references: Vec<Vec<BodyFrame>>,
    /// Kind and frame of each part, in the order of the file.
    pub parts: Vec<(usize, BodyFrame)>,
}

/// Attempts to draw a whole layout, and attempts to draw one place in it.
const LAYOUTS: usize = 400;
const PLACES: usize = 300;
/// Distance from the rim that is kept free, in metres.
const RIM_M: f64 = 0.01;

/// Cost of the search for a layout, in corners and distances that are computed. A scene of a few dozen parts needs a
/// thousandth of it; without a limit, a file with as many parts and corners as possible would be searched for hours.
const BUDGET: usize = 20_000_000;

/// Draws a layout. If there is no room, says for what.
pub(super) fn layout(file: &TaskFile, shapes: &Shapes, seed: Seed) -> Result<Layout, String> {
    let mut rng = seed.derive("scene", "layout").rng();
    let left = Cell::new(BUDGET);
    // The first places can leave no room for the last. In that case, start again.
    let mut layouts = (0..LAYOUTS).map_while(|_| (left.get() > 0).then_some(()));
    let mut missing = String::new();
    layouts
        .find_map(|()| {
            let mut drawing = Drawing::new(file, shapes, &left);
            let layout = drawing.draw(&mut rng);
            missing = std::mem::take(&mut drawing.missing);
            layout
        })
        .ok_or(missing)
}

/// A part or reference whose place is to be drawn.
struct Item<'f> {
    kind: usize,
    /// Position among all parts.
    index: usize,
    start: &'f Start,
}

/// What has been drawn so far.
struct Drawing<'f> {
    file: &'f TaskFile,
    shapes: &'f Shapes,
    references: Vec<Vec<BodyFrame>>,
    rooms: Vec<(usize, Extent)>,
    parts: Vec<Option<BodyFrame>>,
    kinds: Vec<usize>,
    taken: Vec<Extent>,
    heap: Vec<Extent>,
    /// What is left of the [`BUDGET`].
    left: &'f Cell<usize>,
    /// For what there was no place, and why.
    missing: String,
}

impl<'f> Drawing<'f> {
    fn new(file: &'f TaskFile, shapes: &'f Shapes, left: &'f Cell<usize>) -> Self {
        Self {
            file,
            shapes,
            references: vec![Vec::new(); file.references.len()],
            rooms: Vec::new(),
            parts: Vec::new(),
            kinds: Vec::new(),
            taken: Vec::new(),
            heap: Vec::new(),
            left,
            missing: String::new(),
        }
    }

    /// Notes for what there is no place, and whether all its places are out of reach.
    fn misses(&mut self, name: &str, in_reach: bool) -> Option<()> {
        self.missing = match in_reach {
            true => format!("too narrow for a `{name}` beside everything else"),
            false => format!("out of reach for a `{name}`"),
        };
        None
    }

    /// Spends the cost of an attempt to draw a place; `None` if nothing is left.
    fn spend(&self, corners: usize) -> Option<()> {
        let others = self.taken.len() + self.rooms.len() + self.heap.len();
        let left = self.left.get().saturating_sub(2 * corners + others + 10);
        self.left.set(left);
        (left > 0).then_some(())
    }

    fn draw(&mut self, rng: &mut impl Rng) -> Option<Layout> {
        for kind in 0..self.file.references.len() {
            for start in &self.file.references[kind].starts {
                for _ in 0..start.count {
                    self.draw_reference(kind, start, rng)?;
                }
            }
        }
        let mut items = Vec::new();
        for (kind, part) in self.file.parts.iter().enumerate() {
            for start in &part.starts {
                for _ in 0..start.count {
                    items.push(Item { kind, index: items.len(), start });
                }
            }
        }
        self.kinds = items.iter().map(|item| item.kind).collect();
        self.parts = vec![None; items.len()];
        // Parts in heaps fall on the table in a drawn order; parts on others come last.
        let mut keyed: Vec<(u8, f64, Item)> = (items.into_iter())
            .map(|item| match item.start {
                Start { on: Some(_), .. } => (2, 0.0, item),
                Start { heap: true, .. } => (1, rng.random(), item),
                _ => (0, 0.0, item),
            })
            .collect();
        keyed.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        for (_, _, item) in &keyed {
            let frame = self.draw_part(item, rng)?;
            self.parts[item.index] = Some(frame);
        }
        let parts = self.kinds.iter().copied().zip(self.parts.iter().flatten().copied());
        Some(Layout { references: self.references.clone(), parts: parts.collect() })
    }

    fn draw_reference(&mut self, kind: usize, start: &Start, rng: &mut impl Rng) -> Option<()> {
        let region = start.region.as_ref()?;
        let reference = &self.file.references[kind];
        let places: usize = self.file.relations().map(|relation| relation.places.len()).sum();
        let corners = self.shapes.references[kind].iter().map(Vec::len).sum::<usize>();
        let in_reach = Cell::new(false);
        let drawn = (0..PLACES).find_map(|_| {
            self.spend(corners + places)?;
            let base = self.base(&region.of)?;
            let mut frame = draw_in(region, &base, &[], 1, rng);
            frame.position[2] = base.position[2] + region.z_m;
            if !self.goal_is_in_reach(&reference.name, &frame) {
                return None;
            }
            in_reach.set(true);
            let room = self.shapes.room(kind, reference, &frame);
            let free = room.is_none_or(|room| {
                self.is_inside(&room)
                    && !self.rooms.iter().any(|(_, other)| room.near(other, start.gap_m))
            });
            free.then_some((frame, room))
        });
        let Some((frame, room)) = drawn else {
            return self.misses(&reference.name, in_reach.get());
        };
        self.references[kind].push(frame);
        self.rooms.extend(room.map(|room| (kind, room)));
        Some(())
    }

    fn draw_part(&mut self, item: &Item<'_>, rng: &mut impl Rng) -> Option<BodyFrame> {
        let corners = &self.shapes.corners[item.kind];
        if let Some(on) = &item.start.on {
            let below = self.file.parts.iter().position(|p| p.kind == *on)?;
            let index = self.kinds.iter().position(|kind| *kind == below)?;
            let frame = self.parts[index]?;
            let top = Extent::of(&self.shapes.corners[below], &frame).z[1];
            let mut frame = BodyFrame { position: frame.position, turn: upright(&frame) };
            let low = Extent::of(corners, &frame).z[0];
            frame.position[2] += top + 1e-3 - low;
            return Some(frame);
        }
        let region = item.start.region.as_ref()?;
        if self.file.parts[item.kind].slider.is_some() {
            // It belongs to its reference, which keeps the distances.
            let frame = draw_in(region, &self.base(&region.of)?, &[], 1, rng);
            self.taken.push(Extent::of(corners, &frame));
            return Some(frame);
        }
        let turns = self.file.parts[item.kind].handling.turns;
        let own = self.file.references.iter().position(|r| r.name == region.of);
        let mut in_reach = false;
        for _ in 0..PLACES {
            if self.spend(corners.len()).is_none() {
                break;
            }
            let mut frame = draw_in(region, &self.base(&region.of)?, corners, turns, rng);
            let mut extent = Extent::of(corners, &frame);
            if item.start.heap {
                let under = self.heap.iter().filter(|other| extent.near(other, 0.0));
                let rise = under.map(|other| other.z[1]).fold(0.0, f64::max);
                frame.position[2] += rise;
                extent.z = extent.z.map(|z| z + rise);
            }
            let rooms = self.rooms.iter().filter(|(kind, _)| Some(*kind) != own);
            let mut others = rooms.map(|(_, room)| room).chain(&self.taken);
            let inside =
                self.is_inside(&extent) && reaches_table([frame.position[0], frame.position[1]]);
            in_reach |= inside;
            if inside && !others.any(|other| extent.near(other, item.start.gap_m)) {
                if item.start.heap {
                    self.heap.push(extent)
                } else {
                    self.taken.push(extent)
                }
                return Some(frame);
            }
        }
        self.misses(&self.file.parts[item.kind].kind, in_reach)?;
        None
    }

    /// Returns the frame in which a region lies.
    fn base(&self, name: &str) -> Option<BodyFrame> {
        if name == super::WORLD {
            return Some(BodyFrame::at([0.0; 3]));
        }
        let kind = self.file.references.iter().position(|r| r.name == name)?;
        self.references[kind].first().copied()
    }

    fn is_inside(&self, extent: &Extent) -> bool {
        let [low, high] = self.file.table.rim;
        let inside =
            |at: [f64; 2]| (0..2).all(|i| at[i] > low[i] + RIM_M && at[i] < high[i] - RIM_M);
        extent.corners().into_iter().all(inside)
    }

    /// Returns whether the arm reaches all places of the goal in the frame of this reference.
    fn goal_is_in_reach(&self, name: &str, frame: &BodyFrame) -> bool {
        let level = Level::of(frame);
        let relations = self.file.relations().filter(|relation| relation.reference == name);
        relations.flat_map(|relation| &relation.places).all(|place| {
            let [x, y, _] = level.point(place.position);
            reaches_table([x, y])
        })
    }
}

fn upright(frame: &BodyFrame) -> Turn {
    let z = frame.turn.apply([0.0, 0.0, 1.0]);
    arc(z, [0.0, 0.0, z[2].signum()]) * frame.turn
}

/// Draws a frame in a region that lies in the frame `base`. The lowest of `corners` is at the height from which the
/// part falls.
pub(super) fn draw_in(
    region: &Region,
    base: &BodyFrame,
    corners: &[[f64; 3]],
    turns: u32,
    rng: &mut impl Rng,
) -> BodyFrame {
    let (low, high) = (region.low, region.high.unwrap_or(region.low));
    let [x, y] = [0, 1].map(|i| low[i] + (high[i] - low[i]) * rng.random::<f64>());
    let [least, most] = region.yaw_deg;
    let yaw = (least + (most - least) * rng.random::<f64>()).to_radians();
    let tilt = region.tilt_deg.to_radians() * rng.random::<f64>();
    let towards = TAU * rng.random::<f64>();
    // A part may lie on any of its equal sides.
    let roll = f64::from(rng.random_range(0..turns.max(1))) * TAU / f64::from(turns.max(1));
    let lying = arc([0.0, 0.0, 1.0], region.z_axis) * Turn::about_z(roll);
    let tilted = Turn::about([towards.cos(), towards.sin(), 0.0], tilt);
    let turn = base.turn * tilted * Turn::about_z(yaw) * lying;
    let mut frame = BodyFrame { position: Level::of(base).point([x, y, region.z_m]), turn };
    if !corners.is_empty() {
        let lowest = Extent::of(corners, &frame).z[0];
        frame.position[2] += frame.position[2] + region.drop_m - lowest;
    }
    frame
}
