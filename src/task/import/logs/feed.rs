//! From the messages of a log to streams: which topics and frames are taken, in which frame, and why.

use std::collections::{BTreeSet, HashMap, HashSet};

use crate::logs::bag::Bag;
use crate::logs::frames::{NO_FRAME, What, Who, compose};
use crate::logs::messages::Shape;
use crate::logs::topics::{Asked, Topic, commands, measures_width, names_a_part, opens};
use crate::logs::{Take, TopicMap, fits};
use crate::sim::few;
use crate::task::error::InputFault;
use crate::task::import::finish::{fault, median};
use crate::task::import::mapping::Length;
use crate::task::import::streams::{Dropped, Reading, Signal, Streams};

/// Difference of clocks from which it is no delay, in nanoseconds.
const ANOTHER_CLOCK: f64 = 1e9;
/// Greatest opening of a gripper, in metres. Joints that go farther turn.
const WIDEST: f64 = 0.3;

fn seconds(t: i64) -> f64 {
    t as f64 / 1e9
}

/// The frame of reference, and which frames are objects.
struct Choice {
    reference: u32,
    taken: Vec<bool>,
    /// Frames that are left out, and why.
    left: Vec<(u32, &'static str)>,
}

/// A log with the name of its file.
struct Feed<'a> {
    file: &'a str,
    bag: Bag,
}

impl Streams {
    /// Adds the messages of an MCAP log.
    ///
    /// # Errors
    /// [`InputFault`] with the topic and the message, or the place in the file, of the first fault.
    pub(super) fn add_mcap(&mut self, file: &str, bytes: &[u8]) -> Result<(), InputFault> {
        let mapping = &self.mapping;
        let ignores = |name: &str| mapping.ignores(name);
        let asked = Asked { ignores: &ignores, topics: &mapping.topics };
        let bag = Bag::read(bytes, &asked);
        let bag = bag.map_err(|own| fault(file, &own.field, own.problem, own.expected))?;
        Feed { file, bag }.feed(self)
    }
}

impl Feed<'_> {
    fn fault(&self, topic: &str, problem: String, expected: &str) -> InputFault {
        fault(self.file, topic, problem, expected)
    }

    /// Puts what was read into the streams.
    fn feed(mut self, into: &mut Streams) -> Result<(), InputFault> {
        self.check_given(into)?;
        self.align_clocks(into);
        self.leave_out_markers();
        self.choose_signal(Take::Width, into);
        self.choose_signal(Take::Grasp, into);
        let mut items = std::mem::take(&mut self.bag.items);
        items.retain(|item| self.bag.topics[item.topic as usize].meaning == Some(Take::Poses));
        self.bag.items = items;
        let choice = self.choose_frames(into)?;
        let home = into.home(self.file)?;
        let part = into.part_of(&home, None);
        let sources: Vec<u32> =
            self.bag.topics.iter().map(|topic| into.source(self.file, topic.map.frame)).collect();
        for source in &sources {
            into.sources[*source as usize].length.get_or_insert(Length::Metre);
        }
        self.poses(into, part, &sources, &choice)?;
        let mut signals = false;
        for (topic, source) in self.bag.topics.iter().zip(&sources) {
            signals |= signal(topic, into, part, *source);
        }
        if !self.bag.topics.iter().any(|topic| topic.meaning.is_some()) && !signals {
            let known =
                self.bag.topics.iter().map(|topic| format!("{} ({})", topic.name, topic.kind));
            let known: Vec<String> = known.collect();
            let problem = match known.is_empty() {
                true => "it has no topics".to_owned(),
                false => format!("no topic is taken among {}", few(known.iter().map(|s| &**s))),
            };
            let expected = "poses, transforms or detections of ROS, or `topics` in the mapping";
            return Err(self.fault("", problem, expected));
        }
        self.tell(into, &choice);
        Ok(())
    }

    /// Refuses what the mapping asks for and the log does not hold.
    fn check_given(&self, into: &mut Streams) -> Result<(), InputFault> {
        for topic in self.bag.topics.iter().filter(|topic| topic.given && topic.meaning.is_some()) {
            let fits = topic.shape.is_some_and(|s| s.poses() == (topic.map.take == Take::Poses));
            if !fits {
                let problem = format!("its type is `{}`", topic.kind);
                let expected = match topic.map.take {
                    Take::Poses => "poses, transforms, detections or markers of ROS",
                    Take::Width => "a number, the state of joints or of a gripper",
                    Take::Grasp => "a flag or a number",
                };
                return Err(self.fault(&topic.name, problem, expected));
            }
        }
        let asked = &into.mapping.topics;
        let missing =
            |map: &&TopicMap| !self.bag.topics.iter().any(|topic| fits(&map.topic, &topic.name));
        let missing: Vec<String> = asked.iter().filter(missing).map(|m| m.topic.clone()).collect();
        if missing.len() == asked.len()
            && let Some(first) = missing.first()
        {
            let known = few(self.bag.topics.iter().map(|topic| &*topic.name));
            let problem = "there is no such topic".to_owned();
            return Err(self.fault(first, problem, &format!("one of: {known}")));
        }
        for topic in missing {
            into.drop_one(&format!("topic `{topic}`, which {} has not", self.file));
        }
        Ok(())
    }

    /// Puts topics without times of their own on the clock of the others.
    fn align_clocks(&mut self, into: &mut Streams) {
        let mut ahead: Vec<f64> = self.bag.ahead.iter().map(|ns| *ns as f64).collect();
        let Some(ahead) = median(&mut ahead).filter(|ahead| ahead.abs() > ANOTHER_CLOCK) else {
            return;
        };
        let alone: Vec<bool> = self.bag.topics.iter().map(|topic| !topic.stamped).collect();
        if !alone.iter().zip(&self.bag.topics).any(|(alone, t)| *alone && t.meaning.is_some()) {
            return;
        }
        let back = ahead as i64;
        for item in self.bag.items.iter_mut().filter(|item| alone[item.topic as usize]) {
            item.t = item.t.saturating_sub(back);
        }
        for topic in self.bag.topics.iter_mut().filter(|topic| !topic.stamped) {
            topic.signal.iter_mut().for_each(|(t, _)| *t = t.saturating_sub(back));
        }
        let reason = format!("the clock of the log is {:.1} s ahead of it", ahead / 1e9);
        into.suppose(self.file, "clock", "that of the stamps in messages", reason);
    }

    /// Leaves out markers where something else gives poses, which they show.
    fn leave_out_markers(&mut self) {
        let marker = |topic: &Topic| matches!(topic.shape, Some(Shape::Marker | Shape::Markers));
        let poses = |topic: &Topic| topic.meaning == Some(Take::Poses) && topic.count > 0;
        if self.bag.topics.iter().any(|topic| poses(topic) && !marker(topic)) {
            for topic in self.bag.topics.iter_mut().filter(|topic| marker(topic) && !topic.given) {
                topic.meaning = None;
                topic.why = Some("markers show what other topics give".into());
            }
        }
    }

    /// Takes one topic for a signal of the gripper: rather a state than a command, rather joints than numbers, and numbers of
    /// which the name says that they are a width.
    fn choose_signal(&mut self, take: Take, into: &mut Streams) {
        let rank = |topic: &Topic| {
            let shape = match topic.shape {
                Some(Shape::Joints) => 0,
                Some(Shape::Gripper) => 1,
                _ => 2,
            };
            (commands(&topic.name), shape, !measures_width(&topic.name))
        };
        let own = |topic: &&mut Topic| topic.meaning == Some(take) && !topic.given;
        for topic in self.bag.topics.iter_mut().filter(own) {
            if topic.signal.is_empty() {
                topic.meaning = None;
                let joints = topic.shape == Some(Shape::Joints) && topic.count > 0;
                topic.why = joints.then(|| "no joint is named finger or gripper".into());
            }
        }
        let found = self.bag.topics.iter().filter(|topic| topic.meaning == Some(take));
        let Some(best) = found.min_by_key(|topic| rank(topic)).map(|topic| topic.name.clone())
        else {
            return;
        };
        for topic in self.bag.topics.iter_mut().filter(own) {
            if topic.name != best {
                topic.meaning = None;
                topic.why = Some(format!("{best} is taken instead"));
            } else if topic.map.invert.is_none() {
                let greatest = topic.signal.iter().fold(0.0f64, |most, (_, v)| most.max(v.abs()));
                let turns = topic.shape == Some(Shape::Joints) && greatest > WIDEST;
                let open = take == Take::Grasp && opens(&topic.name);
                topic.map.invert = (turns || open).then_some(true);
                let reason = match (turns, open) {
                    (true, _) => {
                        format!("its joints reach {greatest:.2}, so they turn as it closes")
                    }
                    (_, true) => "its name says that the gripper is open".into(),
                    _ => continue,
                };
                into.suppose(self.file, "invert", &best, reason);
            }
        }
    }

    /// Chooses the frame of reference, and which frames are objects.
    fn choose_frames(&mut self, into: &mut Streams) -> Result<Choice, InputFault> {
        let names = &self.bag.frame_names;
        let name = |frame: u32| names.list[frame as usize].as_str();
        let hung = self.bag.items.iter().any(|item| matches!(item.what, What::Edge { .. }));
        let (mut own, mut known) = (Vec::new(), vec![false; names.list.len()]);
        for item in &self.bag.items {
            if let What::Pose { frame, .. } = item.what
                && frame != NO_FRAME
                && self.bag.topics[item.topic as usize].map.frame.is_none()
                && !std::mem::replace(&mut known[frame as usize], true)
            {
                own.push(frame);
            }
        }
        let asked = into.mapping.reference.clone();
        let reference = match asked.as_deref().map(|asked| (asked, asked.trim_start_matches('/'))) {
            Some((asked, plain)) => match names.find(plain) {
                Some(frame) => frame,
                None => {
                    let known = few((1..names.list.len() as u32).map(name));
                    let problem =
                        format!("`reference` is {asked}, and no such frame is in the log");
                    return Err(self.fault("", problem, &format!("one of: {known}")));
                }
            },
            None => match (hung, &*own) {
                (true, _) => match self.bag.frames.root() {
                    Some((root, under, all)) => {
                        let reason = format!("it is the root of {under} of {all} frames");
                        into.suppose(self.file, "reference", name(root), reason);
                        root
                    }
                    None => NO_FRAME,
                },
                (false, []) => NO_FRAME,
                (false, [alone]) => {
                    let reason = "all poses are in it".to_owned();
                    into.suppose(self.file, "reference", name(*alone), reason);
                    *alone
                }
                (false, [one, other, ..]) => {
                    let problem = format!(
                        "poses are in the frames {} and {}, which no transform connects",
                        name(*one),
                        name(*other)
                    );
                    let expected = "one frame, transforms between frames, or `frame` of each topic in the mapping";
                    return Err(self.fault("", problem, expected));
                }
            },
        };
        let count = self.bag.frames.parents.len();
        let (mut taken, mut left) = (vec![false; count], Vec::new());
        let hung = |frame: u32| !self.bag.frames.parents[frame as usize].is_empty();
        let of_hand = |id: &str| into.mapping.is_hand(id);
        let hands = (1..count as u32).filter(|frame| hung(*frame) && of_hand(name(*frame)));
        let hand = hands
            .min_by_key(|frame| (self.bag.frames.still(*frame), self.bag.frames.up(*frame).len()));
        let arm = hand.map(|hand| self.bag.frames.up(hand)).unwrap_or_default();
        let objects = self.bag.items.iter().filter_map(|item| match item.what {
            What::Pose { object, .. } => Some((item.topic, object)),
            What::Edge { .. } => None,
        });
        let objects: HashSet<(u32, u32)> = objects.collect();
        let elsewhere =
            objects.into_iter().any(|(topic, object)| of_hand(&self.bag.id(topic, object)));
        for frame in (1..count as u32).filter(|frame| hung(*frame)) {
            let mut topics = self.bag.topics.iter().filter(|t| t.frames.contains(&frame));
            let asked = topics.clone().any(|topic| !topic.map.objects.is_empty());
            let why = match () {
                () if into.mapping.ignores(name(frame)) => "is to be left out",
                () if asked => match topics
                    .any(|topic| !topic.map.objects.is_empty() && topic.takes(name(frame)))
                {
                    true => "",
                    false => "is not in the mapping",
                },
                () if Some(frame) == hand && elsewhere => "is the hand, which another topic gives",
                () if Some(frame) == hand => "",
                () if arm.contains(&frame) && self.bag.frames.moves[frame as usize] => {
                    "moves the hand"
                }
                () if hand.is_some_and(|hand| self.bag.frames.always_under(frame, hand)) => {
                    "is part of the hand"
                }
                () if frame == reference => "is the frame of reference",
                () if own.contains(&frame) => "is a frame in which poses are given",
                () if names_a_part(name(frame)) => "has the name of a part of a robot or sensor",
                () => "",
            };
            taken[frame as usize] = why.is_empty();
            if !why.is_empty() {
                left.push((frame, why));
            }
        }
        Ok(Choice { reference, taken, left })
    }

    /// Puts the poses into their tracks.
    fn poses(
        &mut self,
        into: &mut Streams,
        part: usize,
        sources: &[u32],
        choice: &Choice,
    ) -> Result<(), InputFault> {
        let mut items = std::mem::take(&mut self.bag.items);
        let (topics, file) = (&self.bag.topics, self.file);
        let of_tree = topics.iter().position(|topic| !topic.frames.is_empty()).unwrap_or(0);
        // The track of each frame and object, and the topic that gives it; `None` if it is not taken.
        let mut tracks: HashMap<Who, Option<usize>> = HashMap::new();
        let mut owners: HashMap<usize, Option<u32>> = HashMap::new();
        let mut repeated: HashMap<String, u64> = HashMap::new();
        let as_is = |topic: u32| topics[topic as usize].map.frame.is_some();
        let lost = compose(
            &mut items,
            &self.bag.frames,
            choice.reference,
            &choice.taken,
            &as_is,
            &mut |t, who, pose| {
                let topic = match who {
                    Who::Frame(_) => None,
                    Who::Object { topic, .. } => Some(topic),
                };
                let at = topic.map_or(of_tree, |topic| topic as usize);
                let track = match tracks.get(&who) {
                    Some(track) => *track,
                    None => {
                        let id = &match who {
                            Who::Frame(frame) => self.bag.frame_names.list[frame as usize].clone(),
                            Who::Object { object, topic } => self.bag.id(topic, object),
                        };
                        let left = into.mapping.ignores(id)
                            || topic.is_some_and(|topic| !topics[topic as usize].takes(id));
                        let track = match left {
                            true => None,
                            false => Some(into.named_track(part, id, file, &topics[at].name)?),
                        };
                        // One topic gives an object.
                        let track =
                            track.filter(|track| *owners.entry(*track).or_insert(topic) == topic);
                        if let (Some(_), Who::Object { object, .. }) = (track, who)
                            && let Some(kind) = topics[at].kinds.get(&object)
                        {
                            into.parts[part].kinds.insert(id.clone(), kind.clone());
                        }
                        if track.is_none() && !left {
                            let what = format!("pose of `{id}` by {}", topics[at].name);
                            repeated
                                .entry(format!("{what}, which another topic gives"))
                                .or_default();
                        }
                        tracks.insert(who, track);
                        track
                    }
                };
                match track {
                    Some(track) => into.push([part, track], sources[at], seconds(t), pose),
                    None => Ok(()),
                }
            },
        )?;
        if lost.endless {
            let problem = "too many frames hang on frames that move".to_owned();
            return Err(self.fault("", problem, "at most 1e9 steps from frame to frame"));
        }
        let name = |frame: u32| &*self.bag.frame_names.list[frame as usize];
        for (frame, count) in &lost.unconnected {
            let path = self.bag.frames.up(*frame);
            let reference = self.bag.frames.up(choice.reference);
            let given = self.bag.frames.uses[*frame as usize] > 0;
            if given && path.last() != reference.last() {
                let problem = format!(
                    "{count} poses are in the frame `{}`, which no transform connects to `{}`",
                    name(*frame),
                    name(choice.reference)
                );
                let expected = "transforms between them, `frame` of the topic, or another `reference` in the mapping";
                return Err(self.fault("", problem, expected));
            }
            let what = format!(
                "pose in or of the frame `{}` while it did not hang on `{}`",
                name(*frame),
                name(choice.reference)
            );
            into.dropped.push(Dropped { what, count: *count });
        }
        for (frames, why) in [
            (&lost.replaced, "which another of the same time replaces"),
            (&lost.fixed_again, "which a later fixed one replaces at all times"),
        ] {
            let count = frames.values().sum();
            let what = || format!("transform of {}, {why}", few(frames.keys().map(|f| name(*f))));
            into.dropped.extend((count > 0).then(|| Dropped { what: what(), count }));
        }
        let parents = self.bag.frames.parents.iter().zip(0u32..);
        for (parents, frame) in parents.filter(|(parents, _)| parents.len() > 1) {
            let what = format!("parent of {}", name(frame));
            let value = few(parents.iter().map(|parent| name(*parent)));
            let reason = "it has several, and hangs on that of its last transform".to_owned();
            into.suppose(file, &what, &value, reason);
        }
        for topic in self.bag.topics.iter().filter(|topic| topic.unseen > 0) {
            let what = format!("pose without numbers on {}", topic.name);
            into.dropped.push(Dropped { what, count: topic.unseen });
        }
        let repeated = repeated.into_keys();
        into.dropped.extend(repeated.map(|what| Dropped { what, count: 1 }));
        into.dropped.sort_by(|a, b| a.what.cmp(&b.what));
        self.bag.items = items;
        Ok(())
    }

    /// Says what was taken and what was not, and writes the mapping that takes the same.
    fn tell(&self, into: &mut Streams, choice: &Choice) {
        let name = |frame: &u32| &*self.bag.frame_names.list[*frame as usize];
        let mut unused: Vec<String> = Vec::new();
        let guessed = into.mapping.topics.is_empty();
        if into.mapping.length.is_none() {
            let reason = "ROS gives positions in metres (REP 103)".to_owned();
            into.suppose(self.file, "length", Length::Metre.name(), reason);
        }
        for topic in &self.bag.topics {
            let Some(take) = topic.meaning.filter(|_| topic.count > 0) else {
                let why = topic.why.as_ref().map_or(String::new(), |why| format!(": {why}"));
                unused.push(format!("{} ({}){why}", topic.name, topic.kind));
                continue;
            };
            if topic.numbered {
                let reason = format!("detections on {} have no ids", topic.name);
                into.suppose(self.file, "id", "the class and the place in a message", reason);
            }
            if !guessed {
                continue;
            }
            let mut map = TopicMap { topic: topic.name.clone(), take, ..topic.map.clone() };
            let (value, reason) = match take {
                Take::Poses if !topic.frames.is_empty() => {
                    let own: Vec<&str> = (topic.frames.iter())
                        .filter(|frame| choice.taken[**frame as usize])
                        .map(name)
                        .collect();
                    map.objects = own.iter().map(|name| (*name).to_owned()).collect();
                    if map.objects.is_empty() {
                        // No frame has an empty name.
                        map.objects.push(String::new());
                    }
                    let own = few(own);
                    let own = if own.is_empty() { "transforms alone".into() } else { own };
                    (own, format!("its type is {}", topic.kind))
                }
                Take::Poses => {
                    if matches!(topic.shape, Some(Shape::Pose | Shape::Poses)) {
                        map.object = Some(topic.base.clone());
                    }
                    ("poses".into(), format!("its type is {}", topic.kind))
                }
                Take::Width if topic.shape == Some(Shape::Joints) => {
                    map.joints = topic.joints.clone();
                    let joints = few(topic.joints.iter().map(|joint| &**joint));
                    (
                        format!("the width, from {joints}"),
                        "these joints are named finger or gripper".into(),
                    )
                }
                Take::Width => ("the width".into(), format!("its type is {}", topic.kind)),
                Take::Grasp => {
                    let reason = "its name has grip or grasp, and it is a flag".into();
                    ("whether the gripper holds something".into(), reason)
                }
            };
            into.suppose(self.file, &format!("topic {}", topic.name), &value, reason);
            let topics = &mut into.found.topics;
            match topics.iter_mut().find(|known| known.topic == map.topic) {
                Some(known) => {
                    let new = map.objects.into_iter().filter(|o| !known.objects.contains(o));
                    let new: Vec<String> = new.collect();
                    known.objects.extend(new);
                    let new = map.joints.into_iter().filter(|o| !known.joints.contains(o));
                    let new: Vec<String> = new.collect();
                    known.joints.extend(new);
                }
                None => topics.push(map),
            }
        }
        let reasons: BTreeSet<&str> = choice.left.iter().map(|(_, why)| *why).collect();
        for reason in reasons {
            let own = choice.left.iter().filter(|(_, why)| *why == reason);
            let own: Vec<&str> = own.map(|(frame, _)| name(frame)).collect();
            unused.push(format!(
                "{}, {} that {reason}",
                few(own.iter().copied()),
                match own.len() {
                    1 => "a frame",
                    _ => "frames",
                }
            ));
        }
        if choice.reference != NO_FRAME {
            let reference = name(&choice.reference).to_owned();
            if !into.found.references.contains(&reference) {
                into.found.references.push(reference);
            }
        }
        if !unused.is_empty() {
            into.unused.push((self.file.into(), unused));
        }
    }
}

/// Puts the topic's signal of the gripper into a part. Returns whether there is one.
fn signal(topic: &Topic, into: &mut Streams, part: usize, source: u32) -> bool {
    let inverted = topic.map.invert == Some(true);
    let sign = if inverted { -1.0 } else { 1.0 };
    let set = |value: f64| f64::from(u8::from((value > 0.5) != inverted));
    let (signal, value): (_, &dyn Fn(f64) -> f64) = match topic.meaning {
        Some(Take::Width) => (Signal::Width, &|value| sign * value),
        Some(Take::Grasp) => (Signal::Grasp, &set),
        _ => return false,
    };
    let readings = topic.signal.iter();
    let readings = readings.map(|(t, v)| Reading { t: seconds(*t), value: value(*v), source });
    into.parts[part].signals.entry(signal).or_default().extend(readings);
    into.sources[source as usize].rows += topic.signal.len() as u64;
    !topic.signal.is_empty()
}
