//! Frames that hang on one another: which is that of reference, which are objects, and the poses of these over time.

use std::collections::{BTreeMap, HashMap};

use nalgebra::{UnitQuaternion, Vector3};

use crate::robot::Pose;
use crate::robot::pose::quaternion_array;

/// Names with numbers.
#[derive(Debug, Default)]
pub(crate) struct Names {
    pub list: Vec<String>,
    index: HashMap<String, u32>,
}

impl Names {
    pub fn number(&mut self, name: &str) -> u32 {
        if let Some(number) = self.index.get(name) {
            return *number;
        }
        let number = self.list.len() as u32;
        self.list.push(name.into());
        self.index.insert(name.into(), number);
        number
    }

    pub fn find(&self, name: &str) -> Option<u32> {
        self.index.get(name).copied()
    }
}

/// The pose of a frame in its parent, or of an object in a frame, at a time in nanoseconds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Item {
    pub t: i64,
    pub topic: u32,
    pub what: What,
    pub pose: Pose,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum What {
    Edge { child: u32, parent: u32, fixed: bool },
    Pose { object: u32, frame: u32 },
}

/// The frame of a pose that names none.
pub(crate) const NO_FRAME: u32 = 0;

/// Greatest number of steps from frame to frame.
const MOST_STEPS: u64 = 1_000_000_000;
/// Greatest number of frames from an object to the root.
const DEEPEST: usize = 256;
/// Time between the poses of a frame that never moves, and the greatest number of these.
const STILL_NS: i64 = 100_000_000;
const MOST_STILL: i64 = 10_000;

/// Returns whether two poses are the same but for rounding.
fn alike(one: &Pose, other: &Pose) -> bool {
    let near = |(a, b): (f64, f64)| (a - b).abs() < 1e-6;
    one.position.into_iter().zip(other.position).all(near)
        && one.rotation().angle_to(&other.rotation()) < 1e-4
}

fn inverse(pose: &Pose) -> Pose {
    let turn: UnitQuaternion<f64> = pose.rotation().inverse();
    let position = -(turn * Vector3::from(pose.position));
    Pose { position: position.into(), orientation: quaternion_array(&turn) }
}

/// How frames hang together over the whole log.
#[derive(Debug, Default)]
pub(crate) struct Frames {
    /// Parents of each frame in the order in which they were.
    pub parents: Vec<Vec<u32>>,
    /// Whether the transform to its parent may change.
    pub moves: Vec<bool>,
    /// Number of poses that are given in each frame.
    pub uses: Vec<u64>,
}

impl Frames {
    fn grow(&mut self, frame: u32) {
        let size = self.parents.len().max(frame as usize + 1);
        self.parents.resize(size, Vec::new());
        self.moves.resize(size, false);
        self.uses.resize(size, 0);
    }

    pub fn edge(&mut self, child: u32, parent: u32, fixed: bool) {
        self.grow(child.max(parent));
        self.moves[child as usize] |= !fixed;
        let parents = &mut self.parents[child as usize];
        if parents.last() != Some(&parent) && !parents.contains(&parent) {
            parents.push(parent);
        }
    }

    pub fn used(&mut self, frame: u32) {
        self.grow(frame);
        self.uses[frame as usize] += 1;
    }

    /// Returns the frames from one to its root by the first parents, itself first.
    pub fn up(&self, frame: u32) -> Vec<u32> {
        let mut path = vec![frame];
        while let Some(parent) =
            self.parents.get(path[path.len() - 1] as usize).and_then(|p| p.first())
        {
            if path.contains(parent) || path.len() >= DEEPEST {
                break;
            }
            path.push(*parent);
        }
        path
    }

    /// Returns the root under which there are most frames and, among equals, in which most poses are given; with the
    /// number of frames under it and of all that have a parent.
    pub fn root(&self) -> Option<(u32, usize, usize)> {
        let mut counts: HashMap<u32, (usize, u64)> = HashMap::new();
        for frame in 0..self.parents.len() as u32 {
            let hangs = !self.parents[frame as usize].is_empty();
            let uses = self.uses[frame as usize];
            if frame != NO_FRAME && (hangs || uses > 0) {
                let root = *self.up(frame).last().unwrap_or(&frame);
                let count = counts.entry(root).or_default();
                *count = (count.0 + usize::from(hangs), count.1 + uses);
            }
        }
        let all = self.parents.iter().filter(|parents| !parents.is_empty()).count();
        let best =
            counts.into_iter().max_by_key(|(root, count)| (*count, std::cmp::Reverse(*root)));
        best.map(|(root, (under, _))| (root, under, all))
    }

    /// Returns whether a frame is part of what hangs on `top`, whatever its parent was at any time.
    pub fn always_under(&self, frame: u32, top: u32) -> bool {
        let mut left = vec![frame];
        let mut seen = Vec::new();
        while let Some(own) = left.pop() {
            if own == top || seen.contains(&own) {
                continue;
            }
            let parents = &self.parents[own as usize];
            if parents.is_empty() || seen.len() >= DEEPEST {
                return false;
            }
            seen.push(own);
            left.extend(parents);
        }
        true
    }

    /// Returns whether a frame never moves in its root.
    pub fn still(&self, frame: u32) -> bool {
        self.up(frame).iter().all(|own| !self.moves[*own as usize])
    }
}

/// How frames hang together at one time.
struct Now<'a> {
    parent: Vec<Option<(u32, Pose)>>,
    children: Vec<Vec<u32>>,
    reference: u32,
    steps: &'a mut u64,
}

impl Now<'_> {
    /// Hangs a frame on its parent. Returns whether it did not hang there in the same pose before.
    fn hang(&mut self, child: u32, parent: u32, pose: Pose) -> bool {
        let old = self.parent[child as usize].replace((parent, pose));
        let before = old.map(|(before, _)| before);
        if before != Some(parent) {
            if let Some(before) = before {
                self.children[before as usize].retain(|own| *own != child);
            }
            self.children[parent as usize].push(child);
        }
        before != Some(parent) || old.is_none_or(|(_, old)| !alike(&old, &pose))
    }

    /// Returns the pose of a frame in the frame of reference or, if it does not hang on that, in its root.
    fn up(&mut self, frame: u32) -> (u32, Option<Pose>) {
        let (mut at, mut pose) = (frame, None);
        for _ in 0..DEEPEST {
            if at == self.reference {
                break;
            }
            let Some((parent, own)) = self.parent[at as usize] else { break };
            pose = Some(pose.map_or(own, |pose| own.after(&pose)));
            at = parent;
            *self.steps += 1;
        }
        (at, pose)
    }

    /// Returns the pose of a frame in the frame of reference; the inner `None` stands for no change.
    fn seen(&mut self, frame: u32) -> Option<Option<Pose>> {
        let (top, pose) = self.up(frame);
        if top == self.reference {
            return Some(pose);
        }
        let reference = std::mem::replace(&mut self.reference, u32::MAX);
        let (root, own) = self.up(reference);
        self.reference = reference;
        let own = own.filter(|_| root == top)?;
        let back = inverse(&own);
        Some(Some(pose.map_or(back, |pose| back.after(&pose))))
    }
}

/// An object with a pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Who {
    Frame(u32),
    Object { object: u32, topic: u32 },
}

/// What became of the items.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Lost {
    /// Number of poses in each frame that did not hang on the frame of reference at that time.
    pub unconnected: HashMap<u32, u64>,
    /// Number of transforms of each frame that another of the same time replaced by another pose.
    pub replaced: BTreeMap<u32, u64>,
    /// Number of fixed transforms of each frame that a later one replaced by another pose.
    pub fixed_again: BTreeMap<u32, u64>,
    /// Whether there were too many steps.
    pub endless: bool,
}

/// Calls `tell` with the poses of frames and objects in the frame of reference, in the order of time. A transform holds until
/// the next one; fixed ones hold always. `taken` says which frames are objects, `as_is` which topics give poses in a frame of
/// their own. Costs a step for each frame between one that moves and those that hang on it.
pub(crate) fn compose<E>(
    items: &mut [Item],
    frames: &Frames,
    reference: u32,
    taken: &[bool],
    as_is: &dyn Fn(u32) -> bool,
    tell: &mut dyn FnMut(i64, Who, &Pose) -> Result<(), E>,
) -> Result<Lost, E> {
    items.sort_by_key(|item| item.t);
    let (count, mut steps, mut lost) = (frames.parents.len(), 0, Lost::default());
    let (parent, children) = (vec![None; count], vec![Vec::new(); count]);
    let mut now = Now { parent, children, reference, steps: &mut steps };
    let fixed = |item: &&Item| matches!(item.what, What::Edge { fixed: true, .. });
    for item in items.iter().filter(fixed) {
        if let What::Edge { child, parent, .. } = item.what {
            let known = now.parent[child as usize].is_some();
            if now.hang(child, parent, item.pose) && known {
                *lost.fixed_again.entry(child).or_default() += 1;
            }
        }
    }
    let live: Vec<&Item> = items.iter().filter(|item| !fixed(item)).collect();
    let (mut seen, mut stamp) = (vec![0u32; count], 0u32);
    let (mut dirty, mut stack) = (Vec::new(), Vec::new());
    let mut told = vec![0u32; count];
    for group in live.chunk_by(|a, b| a.t == b.t) {
        let t = group[0].t;
        stamp += 1;
        dirty.clear();
        for item in group {
            if let What::Edge { child, parent, .. } = item.what {
                let known = std::mem::replace(&mut told[child as usize], stamp) == stamp;
                if now.hang(child, parent, item.pose) && known {
                    *lost.replaced.entry(child).or_default() += 1;
                }
                stack.push(child);
            }
        }
        stack.reverse();
        while let Some(frame) = stack.pop() {
            if std::mem::replace(&mut seen[frame as usize], stamp) != stamp {
                dirty.push(frame);
                *now.steps += 1;
                stack.extend(now.children[frame as usize].iter().rev());
            }
        }
        if seen.get(reference as usize) == Some(&stamp) {
            // Everything moves where the frame of reference does.
            dirty = (1..count as u32).collect();
        }
        for frame in &dirty {
            if taken[*frame as usize] {
                match now.seen(*frame) {
                    Some(pose) => tell(t, Who::Frame(*frame), &pose.unwrap_or(Pose::at([0.0; 3])))?,
                    None => *lost.unconnected.entry(*frame).or_default() += 1,
                }
            }
        }
        for item in group {
            let What::Pose { object, frame } = item.what else { continue };
            let who = Who::Object { object, topic: item.topic };
            if frame == NO_FRAME || frame == reference || as_is(item.topic) {
                tell(t, who, &item.pose)?;
                continue;
            }
            match now.seen(frame) {
                Some(Some(outer)) => tell(t, who, &outer.after(&item.pose))?,
                Some(None) => tell(t, who, &item.pose)?,
                None => *lost.unconnected.entry(frame).or_default() += 1,
            }
        }
        if *now.steps > MOST_STEPS {
            lost.endless = true;
            return Ok(lost);
        }
    }
    let (Some(first), Some(last)) = (live.first(), live.last()) else { return Ok(lost) };
    let (first, last) = (first.t, last.t);
    let still = frames.parents.get(reference as usize).is_none() || frames.still(reference);
    let step = STILL_NS.max(last.saturating_sub(first) / MOST_STILL);
    for frame in 1..count as u32 {
        if taken[frame as usize]
            && frames.still(frame)
            && still
            && !frames.parents[frame as usize].is_empty()
        {
            let Some(pose) = now.seen(frame) else {
                *lost.unconnected.entry(frame).or_default() += 1;
                continue;
            };
            let pose = pose.unwrap_or(Pose::at([0.0; 3]));
            let mut t = first;
            while t < last {
                tell(t, Who::Frame(frame), &pose)?;
                t = t.saturating_add(step);
            }
            tell(last, Who::Frame(frame), &pose)?;
        }
    }
    Ok(lost)
}
