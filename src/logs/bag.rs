//! Reads MCAP logs: their records, channels and messages, and what the messages say, by topic.

use std::collections::HashMap;
use std::sync::Arc;

use ::mcap::records::{ChunkHeader, Record, op};
use ::mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use ::mcap::{MAGIC, McapError, parse_record};

use super::cdr::{Form, Schema, Value, decode};
use super::frames::{Frames, Item, NO_FRAME, Names, What};
use super::messages::{Reading, Shape, read};
use super::topics::{Asked, Topic};
use super::{Fault, Take, unit, words};
use crate::robot::Pose;

/// Greatest number of bytes of a record in a chunk, which may be an image or a cloud of points that is not used, and of all
/// records together once they are decompressed.
const MOST_RECORD: usize = 256 << 20;
const MOST_BYTES: u64 = 8 << 30;
/// Greatest number of bytes of a message that is used, and of a schema.
const MOST_MESSAGE: usize = 16 << 20;
const MOST_SCHEMA: usize = 1 << 20;
/// Greatest number of frames, of objects and of topics.
const MOST_FRAMES: usize = 2_000;
const MOST_OBJECTS: usize = 20_000;
const MOST_TOPICS: usize = 10_000;
/// Greatest number of poses.
const MOST_POSES: u64 = 20_000_000;
/// Number of messages of which the clocks are compared.
const LOOK: usize = 10_000;

/// Time since 1970, in nanoseconds, before which a clock began with the log.
const SMALL: i64 = 86_400_000_000_000;

/// Time by which a clock that starts again goes back at least, in nanoseconds, and the number of messages that show it.
/// Single messages may be late by any time.
const RESET: i64 = 1_000_000_000;
const RESET_MESSAGES: u32 = 5;

/// The stamps of a topic.
#[derive(Default)]
struct Stamps {
    /// The least and the greatest so far.
    span: Option<(i64, i64)>,
    /// Number of messages one after the other by which the clock has gone back.
    back: u32,
    /// The first that is not zero.
    first: Option<i64>,
    /// Places, among the items or in the signal, of what was stamped zero before that one.
    zeros: Vec<usize>,
}

impl Stamps {
    /// Notes the stamp of a message. Returns what the clock goes back from if it starts again.
    fn tick(&mut self, t: i64) -> Option<i64> {
        let (first, last) = self.span.unwrap_or((t, t));
        let gone = last.saturating_sub(t);
        let back = gone > RESET && gone > last.saturating_sub(first) / 2;
        self.back = if back { self.back + 1 } else { 0 };
        if !back {
            self.span = Some((first.min(t), last.max(t)));
        }
        (self.back >= RESET_MESSAGES).then_some(last)
    }

    /// Returns whether the clock began with the log, so that zero is a time.
    fn small(&self) -> bool {
        self.first.is_some_and(|first| first < SMALL)
    }
}

/// How the messages of a channel are read.
#[derive(Clone)]
enum Coding {
    Bytes(Arc<Schema>, Form),
    Json,
}

struct Channel {
    topic: usize,
    coding: Option<Coding>,
}

fn fault(field: &str, problem: impl Into<String>, expected: &str) -> Fault {
    Fault { field: field.into(), problem: problem.into(), expected: expected.into() }
}

/// What the messages of a log say.
pub(crate) struct Bag {
    pub topics: Vec<Topic>,
    pub frame_names: Names,
    /// Objects as their messages name them; [`Topic::id`] makes the id.
    pub objects: Names,
    pub frames: Frames,
    pub items: Vec<Item>,
    /// What the time of the log is ahead of that of the messages, in nanoseconds.
    pub ahead: Vec<i64>,
    schemas: HashMap<u16, (String, String, Vec<u8>)>,
    parsed: HashMap<u16, Arc<Schema>>,
    channels: HashMap<u16, Channel>,
    stamps: HashMap<usize, Stamps>,
    bytes: u64,
    values: u64,
}

type Visit<'v> = dyn FnMut(u8, &[u8]) -> Result<(), Fault> + 'v;

/// Calls `visit` with the records of a log, one after the other, chunks opened. `base` is where the bytes begin in the file.
fn records(bytes: &[u8], base: Option<usize>, visit: &mut Visit<'_>) -> Result<bool, Fault> {
    let mut at = 0;
    let mut ended = false;
    while at < bytes.len() {
        let place = base.map_or("in a chunk".into(), |base| format!("at byte {}", base + at));
        let head = bytes.get(at..at + 9).and_then(|head| head.split_first());
        let Some((own, length)) = head else {
            if ended {
                break;
            }
            return Err(cut(&format!("it ends inside a record {place}")));
        };
        let length = length.try_into().map_or(u64::MAX, u64::from_le_bytes);
        let end = usize::try_from(length).ok().and_then(|length| (at + 9).checked_add(length));
        let Some(body) = end.and_then(|end| bytes.get(at + 9..end)) else {
            let left = bytes.len() - at - 9;
            let problem = format!("the record {place} has {length} bytes, and {left} are left");
            return Err(cut(&problem));
        };
        let broken = |error: McapError| {
            let problem = format!("the record {place} cannot be read: {}", words(&error));
            fault("", problem, "a whole MCAP log")
        };
        if *own == op::CHUNK && base.is_some() {
            match parse_record(op::CHUNK, body).map_err(broken)? {
                Record::Chunk { header, data } if header.compression.is_empty() => {
                    let crc = header.uncompressed_crc;
                    if crc != 0 && crc32fast::hash(&data) != crc {
                        let problem =
                            format!("the chunk {place} has another checksum than its bytes");
                        return Err(fault("", problem, "a whole MCAP log"));
                    }
                    records(&data, None, visit)?;
                }
                Record::Chunk { header, .. } => {
                    let whole = &bytes[at..at + 9 + body.len()];
                    chunk(whole, &header, &place, visit)?;
                }
                _ => {}
            }
        } else {
            visit(*own, body)?;
        }
        at += 9 + body.len();
        if matches!(*own, op::DATA_END | op::FOOTER) {
            ended = true;
            if *own == op::FOOTER {
                break;
            }
        }
    }
    Ok(ended)
}

fn cut(problem: &str) -> Fault {
    fault("", problem, "a whole MCAP log; `mcap recover` saves what a cut one holds")
}

/// Opens a compressed chunk. `whole` is its record.
fn chunk(
    whole: &[u8],
    header: &ChunkHeader,
    place: &str,
    visit: &mut Visit<'_>,
) -> Result<(), Fault> {
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_validate_chunk_crcs(true)
        .with_record_length_limit(MOST_RECORD);
    let mut reader = LinearReader::new_with_options(options);
    let mut rest = whole;
    while let Some(event) = reader.next_event() {
        match event {
            Ok(LinearReadEvent::ReadRequest(wanted)) => {
                let size = wanted.min(rest.len());
                let (taken, behind) = rest.split_at(size);
                reader.insert(size).copy_from_slice(taken);
                reader.notify_read(size);
                rest = behind;
            }
            Ok(LinearReadEvent::Record { data, opcode }) => visit(opcode, data)?,
            Err(McapError::UnsupportedCompression(name)) => {
                let problem = format!("the chunk {place} is compressed by `{name}`");
                return Err(fault("", problem, "chunks compressed by zstd or lz4, or not"));
            }
            Err(error) => {
                let compression = &header.compression;
                let problem = format!(
                    "the chunk {place}, compressed by {compression}, cannot be read: {}",
                    words(&error)
                );
                return Err(fault("", problem, "a whole MCAP log"));
            }
        }
    }
    Ok(())
}

impl Bag {
    /// Reads an MCAP log. Costs a few microseconds a message that is taken, and what its chunks cost to open.
    ///
    /// # Errors
    /// [`Fault`] with the topic and the message, or the place in the file, of the first fault.
    pub fn read(bytes: &[u8], asked: &Asked<'_>) -> Result<Self, Fault> {
        let mut bag = Self {
            topics: Vec::new(),
            frame_names: Names::default(),
            objects: Names::default(),
            frames: Frames::default(),
            items: Vec::new(),
            ahead: Vec::new(),
            schemas: HashMap::new(),
            parsed: HashMap::new(),
            channels: HashMap::new(),
            stamps: HashMap::new(),
            bytes: 0,
            values: 0,
        };
        bag.frame_names.number("");
        bag.frames.used(NO_FRAME);
        let start = MAGIC.len();
        let mut visit = |own: u8, body: &[u8]| bag.record(asked, own, body);
        let ended = records(bytes.get(start..).unwrap_or_default(), Some(start), &mut visit)?;
        if !ended {
            return Err(cut("it has no end"));
        }
        for (topic, stamps) in std::mem::take(&mut bag.stamps) {
            let topic = &mut bag.topics[topic];
            for at in stamps.zeros.iter().filter(|_| stamps.small()) {
                match topic.meaning {
                    Some(Take::Poses) => bag.items[*at].t = 0,
                    _ => topic.signal[*at].0 = 0,
                }
            }
        }
        Ok(bag)
    }

    /// Returns the id of an object of a topic.
    pub fn id(&self, topic: u32, object: u32) -> String {
        self.topics[topic as usize].id(&self.objects.list[object as usize])
    }

    fn record(&mut self, asked: &Asked<'_>, own: u8, body: &[u8]) -> Result<(), Fault> {
        self.bytes += body.len() as u64 + 9;
        if self.bytes > MOST_BYTES {
            let problem = "it has more than 8 GiB of records";
            return Err(fault("", problem, "a log with fewer topics or a shorter one"));
        }
        if !matches!(own, op::SCHEMA | op::CHANNEL | op::MESSAGE) {
            return Ok(());
        }
        let record = parse_record(own, body).map_err(|error| {
            let problem = format!("a record cannot be read: {}", words(&error));
            fault("", problem, "a whole MCAP log")
        })?;
        match record {
            Record::Schema { header, data } => {
                let schema = (header.name, header.encoding, data.into_owned());
                match self.schemas.get(&header.id) {
                    Some(known) if *known != schema => {
                        let problem = format!("two schemas have the number {}", header.id);
                        return Err(fault("", problem, "one schema for each number"));
                    }
                    Some(_) => {}
                    None => drop(self.schemas.insert(header.id, schema)),
                }
                Ok(())
            }
            Record::Channel(channel) => {
                if let Some(known) = self.channels.get(&channel.id) {
                    if self.topics[known.topic].name != channel.topic {
                        let problem = format!("two channels have the number {}", channel.id);
                        return Err(fault(&channel.topic, problem, "one channel for each number"));
                    }
                    return Ok(());
                }
                let (id, encoding) = (channel.id, channel.message_encoding);
                self.channel(asked, id, channel.schema_id, &channel.topic, &encoding)
            }
            Record::Message { header, data } => {
                let Some(channel) = self.channels.get(&header.channel_id) else {
                    let problem =
                        format!("a message is of the unknown channel {}", header.channel_id);
                    return Err(fault("", problem, "a channel before its messages"));
                };
                let topic = channel.topic;
                self.topics[topic].count += 1;
                match channel.coding.clone() {
                    Some(coding) => self.message(topic, &coding, header.log_time, &data),
                    None => Ok(()),
                }
            }
            _ => Ok(()),
        }
    }

    fn channel(
        &mut self,
        asked: &Asked<'_>,
        id: u16,
        schema: u16,
        name: &str,
        encoding: &str,
    ) -> Result<(), Fault> {
        let (kind, language, text) = self
            .schemas
            .get(&schema)
            .map_or(("", "", &[][..]), |s| (s.0.as_str(), s.1.as_str(), &*s.2));
        let at = self.topics.iter().position(|topic| topic.name == name && topic.kind == kind);
        let at = at.unwrap_or_else(|| {
            let mut topic = Topic::of(name, kind, asked);
            // Whichever topic comes first, the ids are the same.
            for known in &mut self.topics {
                if known.sounds_like(&topic) {
                    known.spell_out();
                    topic.spell_out();
                }
            }
            self.topics.push(topic);
            self.topics.len() - 1
        });
        if self.topics.len() > MOST_TOPICS {
            return Err(fault(name, "it has too many topics", "at most 10,000"));
        }
        let topic = &mut self.topics[at];
        let mut coding = None;
        if topic.meaning.is_some() {
            let form = match (encoding, language) {
                ("cdr", "ros2msg") => Some(Form::Cdr),
                ("ros1", "ros1msg") => Some(Form::Ros1),
                _ => None,
            };
            match (form, encoding) {
                (Some(form), _) => {
                    let parsed = match self.parsed.get(&schema) {
                        Some(parsed) => parsed.clone(),
                        None => {
                            let parsed = match text.len() > MOST_SCHEMA {
                                true => Err("its schema has more than 1 MiB".into()),
                                false => Schema::parse(kind, &String::from_utf8_lossy(text)),
                            };
                            let expected = "a definition of the message in ros2msg";
                            Arc::new(parsed.map_err(|why| fault(name, why, expected))?)
                        }
                    };
                    self.parsed.insert(schema, parsed.clone());
                    coding = Some(Coding::Bytes(parsed, form));
                }
                (None, "json") => coding = Some(Coding::Json),
                (None, _) => {
                    let problem = format!(
                        "its messages are written as `{encoding}` with a schema in `{language}`"
                    );
                    let expected =
                        "cdr with ros2msg, ros1 with ros1msg or json, or the topic under `ignore`";
                    return Err(fault(name, problem, expected));
                }
            }
        }
        self.channels.insert(id, Channel { topic: at, coding });
        Ok(())
    }

    fn message(
        &mut self,
        at: usize,
        coding: &Coding,
        log_time: u64,
        data: &[u8],
    ) -> Result<(), Fault> {
        let (count, name) = (self.topics[at].count, self.topics[at].name.clone());
        let bad = |problem: String, expected: &str| {
            fault(&name, format!("message {count} {problem}"), expected)
        };
        if data.len() > MOST_MESSAGE {
            return Err(bad(format!("has {} bytes", data.len()), "at most 16 MiB"));
        }
        let json: serde_json::Value;
        let value = match coding {
            Coding::Bytes(schema, form) => decode(schema, *form, data)
                .map_err(|problem| bad(problem, "what its schema describes"))?,
            Coding::Json => {
                json = serde_json::from_slice(data)
                    .map_err(|error| bad(format!("is no JSON: {error}"), "an object in JSON"))?;
                Value::of_json(&json)
            }
        };
        let log_time = i64::try_from(log_time).unwrap_or(i64::MAX);
        let topic = &mut self.topics[at];
        let (Some(shape), Some(meaning)) = (topic.shape, topic.meaning) else { return Ok(()) };
        let (mut told, mut failed) = (0u64, None);
        let joints = &topic.map.joints;
        let joint = |name: &str| super::topics::is_finger(joints, name);
        let mut found_joints: Vec<String> = Vec::new();
        if shape == Shape::Joints && topic.joints.is_empty() {
            let names = value.get("name").map_or(&[][..], Value::list);
            let names = names.iter().filter_map(|name| Some(name.text()?.into_owned()));
            found_joints = names.filter(|name| joint(name)).collect();
        }
        let fixed = topic.fixed;
        let mut readings = Vec::new();
        read(shape, &value, &joint, &mut |stamp, reading| readings.push((stamp, reading)));
        let stamps = self.stamps.entry(at).or_default();
        let stamped = readings.iter().filter_map(|(stamp, _)| *stamp).find(|stamp| *stamp != 0);
        stamps.first = stamps.first.or(stamped);
        if let Some(t) = stamped.filter(|_| !fixed)
            && let Some(last) = stamps.tick(t)
        {
            let [from, to] = [last, t].map(|t| t as f64 / 1e9);
            let problem =
                format!("is stamped {to:.3} s after one of {from:.3} s: the clock starts again");
            return Err(bad(problem, "the log of one run, cut where its clock starts again"));
        }
        for (stamp, reading) in readings {
            // A stamp of zero is none, unless the clock of the topic began with the log.
            let zero = stamp == Some(0);
            let stamp = stamp.filter(|_| !zero || stamps.small());
            if let Some(stamp) = stamp
                && self.ahead.len() < LOOK
                && !fixed
            {
                self.ahead.push(log_time.saturating_sub(stamp));
            }
            let topic = &mut self.topics[at];
            topic.stamped |= stamp.is_some();
            let t = stamp.unwrap_or(log_time);
            let places = [self.items.len(), topic.signal.len()];
            let turned = |pose: Pose| -> Result<Pose, String> {
                Ok(Pose { orientation: unit(pose.orientation)?, ..pose })
            };
            told += 1;
            match reading {
                Reading::Signal(value) => {
                    if meaning != Take::Poses {
                        topic.signal.push((t, value));
                    }
                }
                Reading::Numbered => topic.numbered = true,
                Reading::Unseen => topic.unseen += 1,
                _ if meaning != Take::Poses => {}
                Reading::Edge { parent, child, pose } => {
                    let tree = shape == Shape::Transforms || topic.tree;
                    let (parent_text, child_text) = (parent, child);
                    match turned(pose) {
                        Ok(pose) if pose.orientation[3].is_nan() => topic.unseen += 1,
                        Ok(pose) => {
                            let parent = self.frame_names.number(parent_text);
                            let what = if tree {
                                let child = self.frame_names.number(child_text);
                                topic.frames.insert(child);
                                self.frames.edge(child, parent, fixed);
                                What::Edge { child, parent, fixed }
                            } else {
                                let object = self.objects.number(child_text);
                                self.frames.used(parent);
                                What::Pose { object, frame: parent }
                            };
                            self.items.push(Item { t, topic: at as u32, what, pose });
                        }
                        Err(problem) => failed = Some((child_text.to_owned(), problem)),
                    }
                }
                Reading::Pose { id, kind, frame, pose } => match turned(pose) {
                    Ok(pose) => {
                        let object = self.objects.number(&id);
                        if let Some(kind) = kind {
                            topic.kinds.entry(object).or_insert(kind);
                        }
                        let frame = self.frame_names.number(frame);
                        self.frames.used(frame);
                        let what = What::Pose { object, frame };
                        self.items.push(Item { t, topic: at as u32, what, pose });
                    }
                    Err(problem) => failed = Some((topic.id(&id), problem)),
                },
            }
            if zero && stamps.first.is_none() {
                let now = [self.items.len(), self.topics[at].signal.len()];
                let own = places.iter().zip(now).filter(|(place, now)| *place < now);
                stamps.zeros.extend(own.map(|(place, _)| *place));
            }
        }
        let topic = &mut self.topics[at];
        if topic.joints.is_empty() {
            topic.joints = found_joints;
        }
        if let Some((id, problem)) = failed {
            let problem = format!("gives `{id}` an orientation, and {problem}");
            return Err(bad(problem, "a unit quaternion x, y, z, w"));
        }
        self.values += told;
        let name = &self.topics[at].name;
        if self.values > MOST_POSES {
            return Err(fault(name, "the log has too many poses", "at most 20 million"));
        }
        if self.frame_names.list.len() > MOST_FRAMES {
            return Err(fault(name, "the log has too many frames", "at most 2,000"));
        }
        if self.objects.list.len() > MOST_OBJECTS {
            return Err(fault(name, "the log has too many objects", "at most 20,000"));
        }
        Ok(())
    }
}
