//! The layout of a table: the index of each column that is used.

use std::collections::BTreeMap;

use super::columns::{Field, Unit, names_a_hand, recognise, without_unit};
use super::mapping::{
    Angle, Length, Mapping, PoseColumns, QuaternionOrder, Rotation, TableMap, TimeUnit,
};
use super::streams::Guess;
use crate::sim::{few, meant, nearest_first};
use crate::task::error::InputFault;
use crate::task::recording::{FIT_NAME, unfit};

/// How a body's orientation is given, by columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Turn {
    None,
    /// x, y, z, w.
    Quaternion([usize; 4]),
    /// Three numbers: angles about fixed axes, or a rotation vector.
    Three([usize; 3], Rotation),
    Matrix([usize; 9]),
}

/// The columns of one body. In a table with a column of ids, of the row's body.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Body {
    pub id: String,
    pub position: [usize; 3],
    pub turn: Turn,
}

/// The columns of a table.
#[derive(Debug, Clone, Default)]
pub(super) struct Layout {
    /// Columns whose sum is the time, with the unit that the name gives.
    pub time: Vec<(usize, Option<TimeUnit>)>,
    pub id: Option<usize>,
    pub kind: Option<usize>,
    pub session: Option<usize>,
    pub bodies: Vec<Body>,
    pub width: Option<usize>,
    pub grasp: Option<usize>,
    /// Columns of contact flags, by object; the object is empty for the row's object, or for any.
    pub contacts: Vec<(String, usize)>,
    /// Unit of positions that the names of columns give.
    pub length: Option<Length>,
    /// Unit of angles that the names of columns give.
    pub angle: Option<Angle>,
    /// Names of columns that are not used.
    pub unused: Vec<String>,
}

impl Layout {
    /// Returns the part of a mapping that says the same.
    pub fn described(&self, header: &[String], mapping: &Mapping) -> TableMap {
        let name = |index: &usize| header[*index].clone();
        let body = |body: &Body| {
            let rotation = match &body.turn {
                Turn::None => Vec::new(),
                Turn::Quaternion([x, y, z, w]) => match mapping.quaternion {
                    Some(QuaternionOrder::Wxyz) => [w, x, y, z].map(name).to_vec(),
                    _ => [x, y, z, w].map(name).to_vec(),
                },
                Turn::Three(columns, _) => columns.iter().map(name).collect(),
                Turn::Matrix(columns) => columns.iter().map(name).collect(),
            };
            (
                body.id.clone(),
                PoseColumns { position: body.position.each_ref().map(name), rotation },
            )
        };
        let contact = |(object, index): &(String, usize)| {
            (if object.is_empty() { "*".into() } else { object.clone() }, name(index))
        };
        TableMap {
            // The sum of two columns is found by their names again.
            time: (self.time.len() == 1).then(|| name(&self.time[0].0)),
            id: self.id.as_ref().map(name),
            kind: self.kind.as_ref().map(name),
            objects: self.bodies.iter().map(body).collect(),
            width: self.width.as_ref().map(name),
            grasp: self.grasp.as_ref().map(name),
            contact: self.contacts.iter().map(contact).collect(),
            length: self.length.filter(|_| mapping.length.is_none()),
            ..TableMap::default()
        }
    }
}

/// The columns of one body while they are collected.
#[derive(Default)]
struct Found {
    position: [Option<(usize, u8)>; 3],
    quaternion: [Option<usize>; 4],
    component: BTreeMap<usize, usize>,
    three: [Option<usize>; 3],
    angles: Option<bool>,
    matrix: BTreeMap<usize, usize>,
}

fn all<T: Copy, const N: usize>(found: [Option<T>; N]) -> Option<[T; N]> {
    let present: Vec<T> = found.iter().flatten().copied().collect();
    present.try_into().ok()
}

/// Finds the columns of a table by the mapping or, where it says nothing, by their names.
pub(super) struct Finder<'a> {
    pub header: &'a [String],
    pub file: &'a str,
    /// Whether each column counts the rows.
    pub counts: &'a [bool],
    /// The line of the header.
    pub line: usize,
    pub mapping: &'a Mapping,
    pub table: &'a TableMap,
    /// The session's column in the tables before.
    pub session: Option<&'a str>,
    pub guesses: &'a mut Vec<Guess>,
}

impl Finder<'_> {
    fn fault(&self, field: &str, problem: String, expected: String) -> InputFault {
        let (file, field) = (self.file.to_owned(), field.to_owned());
        InputFault { file, line: Some(self.line), field, problem, expected }
    }

    /// Returns the index of a column.
    fn column(&self, name: &str) -> Result<usize, InputFault> {
        self.header.iter().position(|own| own == name).ok_or_else(|| {
            let known = || self.header.iter().map(String::as_str);
            let expected =
                format!("one of: {}{}", nearest_first(name, known()), meant(name, known()));
            self.fault(name, "there is no such column".into(), expected)
        })
    }

    fn columns<const N: usize>(&self, names: &[String]) -> Result<[usize; N], InputFault> {
        let found = names.iter().map(|name| self.column(name)).collect::<Result<Vec<_>, _>>()?;
        found.try_into().map_err(|found: Vec<usize>| {
            self.fault("", format!("{} columns are named", found.len()), format!("{N} columns"))
        })
    }

    fn guess(&mut self, what: &str, value: &str, reason: String) {
        let file = self.file.to_owned();
        self.guesses.push(Guess { what: what.into(), value: value.into(), reason, file });
    }

    pub fn find(mut self) -> Result<Layout, InputFault> {
        let mut layout = Layout::default();
        let mut bodies: BTreeMap<String, Found> = BTreeMap::new();
        let mut used = vec![false; self.header.len()];
        let table = self.table;
        let given = |name: &Option<String>, own: &Self| {
            name.as_ref().map(|name| own.column(name)).transpose()
        };
        layout.id = given(&table.id, &self)?;
        layout.kind = given(&table.kind, &self)?;
        // A table without the session's column goes to sessions by its times.
        let session = self.mapping.session.as_deref().or(self.session);
        layout.session = session.and_then(|name| self.header.iter().position(|own| own == name));
        layout.width = given(&table.width, &self)?;
        layout.grasp = given(&table.grasp, &self)?;
        let time = given(&table.time, &self)?;
        for (object, name) in &table.contact {
            let object = if object == "*" { String::new() } else { object.clone() };
            layout.contacts.push((object, self.column(name)?));
        }
        // What the mapping or an option names is nothing else.
        let named = [layout.id, layout.kind, layout.session, layout.width, layout.grasp];
        let contacts = layout.contacts.iter().map(|(_, index)| *index);
        let named: Vec<usize> = named.into_iter().flatten().chain(contacts).collect();
        for (index, name) in self.header.iter().enumerate() {
            if named.contains(&index) || self.mapping.ignores(name) {
                used[index] = true;
                continue;
            }
            let column = recognise(name);
            if time == Some(index) {
                let unit = column.and_then(|column| match column.unit {
                    Some(Unit::Time(unit)) => Some(unit),
                    _ => None,
                });
                layout.time.push((index, unit));
                used[index] = true;
                continue;
            }
            let Some(column) = column else { continue };
            let slot = match column.field {
                Field::Id if self.counts[index] => continue,
                Field::Id if table.objects.is_empty() => &mut layout.id,
                Field::Kind => &mut layout.kind,
                Field::Session if self.mapping.session.is_none() => &mut layout.session,
                Field::Session => continue,
                Field::Width => &mut layout.width,
                Field::Grasp => &mut layout.grasp,
                Field::Time => {
                    let unit = match column.unit {
                        Some(Unit::Time(unit)) => Some(unit),
                        _ => None,
                    };
                    // Seconds and nanoseconds of one time are added.
                    let more = match layout.time[..] {
                        [] => true,
                        [(before, of)] => {
                            let nano = |unit| unit == Some(TimeUnit::Nanosecond);
                            let whole = |unit| matches!(unit, None | Some(TimeUnit::Second));
                            (nano(unit) && whole(of) || whole(unit) && nano(of))
                                && without_unit(name) == without_unit(&self.header[before])
                        }
                        _ => false,
                    };
                    if time.is_none() && more {
                        layout.time.push((index, unit));
                        used[index] = true;
                    }
                    continue;
                }
                Field::Contact => {
                    if table.contact.is_empty() {
                        layout.contacts.push((column.object.clone(), index));
                        used[index] = true;
                    }
                    continue;
                }
                _ => {
                    match column.unit {
                        Some(Unit::Length(unit)) => layout.length = Some(unit),
                        Some(Unit::Angle(unit)) => layout.angle = Some(unit),
                        _ => {}
                    }
                    if table.objects.is_empty() {
                        let body = bodies.entry(column.object.clone()).or_default();
                        used[index] = note(body, index, &column);
                    }
                    continue;
                }
            };
            if slot.is_none() {
                *slot = Some(index);
                used[index] = true;
            }
        }
        if layout.time.is_empty() && table.row_of.is_none() {
            let expected = "a column named time, t, stamp or timestamp, or `time` in the mapping";
            return Err(self.fault("", "there is no column of time".into(), expected.into()));
        }
        for (id, columns) in &table.objects {
            let body = self.named(id, columns)?;
            layout.bodies.push(body);
        }
        let grips = layout.width.is_some() || layout.grasp.is_some();
        for (prefix, found) in bodies {
            let Some(position) = all(found.position) else { continue };
            let position = position.map(|(index, _)| index);
            let turn = self.turn(&prefix, &found)?;
            let id = if layout.id.is_some() && prefix.is_empty() {
                "*".to_owned()
            } else if prefix.is_empty() {
                self.alone(grips)
            } else {
                prefix
            };
            if !self.mapping.ignores(&id) {
                layout.bodies.push(Body { id, position, turn });
            }
        }
        // A body without a name of its own takes it from a column of ids.
        let named = layout.bodies.iter().filter(|body| !body.id.is_empty());
        if let Some(problem) = named.map(|body| unfit(&body.id)).find_map(|problem| problem) {
            return Err(self.fault("", format!("an object's name: {problem}"), FIT_NAME.into()));
        }
        // A column of ids applies to bodies without a name of their own.
        if !layout.bodies.is_empty() && layout.bodies.iter().all(|body| body.id != "*") {
            layout.id = table.id.as_ref().and(layout.id);
        }
        for body in &layout.bodies {
            mark(&mut used, body);
        }
        for index in [layout.id, layout.kind, layout.session, layout.width, layout.grasp] {
            index.into_iter().for_each(|index| used[index] = true);
        }
        if table.row_of.is_some() {
            used[0] = true;
        }
        let unused = self.header.iter().zip(&used).filter(|(_, used)| !**used);
        layout.unused = unused.map(|(name, _)| name.clone()).collect();
        if layout.bodies.is_empty() && !grips && layout.contacts.is_empty() {
            let problem =
                format!("no columns of a position are recognised among {}", few(self.header));
            let expected =
                "columns such as x, y, z or NAME.x, NAME.y, NAME.z, or `objects` in the mapping";
            return Err(self.fault("", problem, expected.into()));
        }
        Ok(layout)
    }

    /// Returns the id of the only body of a table without ids.
    fn alone(&mut self, grips: bool) -> String {
        let stem = self.file.rsplit(['/', '\\']).next().unwrap_or_default();
        let stem = stem.split('.').next().unwrap_or_default();
        let hand = grips || names_a_hand(stem);
        let id = if hand { "hand".to_owned() } else { stem.to_owned() };
        let reason = match (grips, hand) {
            (true, _) => "its table has the gripper's columns, and x, y, z without a name",
            (_, true) => "its file has the name of a hand, and x, y, z without a name",
            _ => "x, y, z have no name, so the object has that of its file",
        };
        self.guess("id", &id, reason.into());
        id
    }

    /// Returns the body of columns that the mapping names.
    fn named(&self, id: &str, columns: &PoseColumns) -> Result<Body, InputFault> {
        let position = self.columns(&columns.position)?;
        let turn = match columns.rotation.len() {
            0 => Turn::None,
            3 => Turn::Three(
                self.columns(&columns.rotation)?,
                self.mapping.rotation.unwrap_or(Rotation::Euler),
            ),
            4 => {
                let [a, b, c, d] = self.columns(&columns.rotation)?;
                match self.mapping.quaternion.unwrap_or(QuaternionOrder::Xyzw) {
                    QuaternionOrder::Xyzw => Turn::Quaternion([a, b, c, d]),
                    QuaternionOrder::Wxyz => Turn::Quaternion([b, c, d, a]),
                }
            }
            _ => Turn::Matrix(self.columns(&columns.rotation)?),
        };
        Ok(Body { id: id.into(), position, turn })
    }

    fn turn(&mut self, prefix: &str, found: &Found) -> Result<Turn, InputFault> {
        if let Some(columns) = all(found.quaternion) {
            return Ok(Turn::Quaternion(columns));
        }
        if found.component.len() == 4 {
            let columns: Vec<usize> = found.component.values().copied().collect();
            let [a, b, c, d] = [columns[0], columns[1], columns[2], columns[3]];
            let order = self.mapping.quaternion.unwrap_or_else(|| {
                let reason = "q0 is the real part by custom; `quaternion` says otherwise";
                self.guess("quaternion", QuaternionOrder::Wxyz.name(), reason.into());
                QuaternionOrder::Wxyz
            });
            return Ok(Turn::Quaternion(match order {
                QuaternionOrder::Wxyz => [b, c, d, a],
                QuaternionOrder::Xyzw => [a, b, c, d],
            }));
        }
        if found.matrix.len() == 9 {
            let columns: Vec<usize> = found.matrix.values().copied().collect();
            if let Ok(columns) = columns.try_into() {
                return Ok(Turn::Matrix(columns));
            }
        }
        if let Some(columns) = all(found.three) {
            let rotation = match (self.mapping.rotation, found.angles) {
                (Some(rotation), _) => rotation,
                (None, Some(true)) => Rotation::Euler,
                (None, Some(false)) => Rotation::Vector,
                (None, None) => {
                    let reason = format!("{} may be either", self.header[columns[0]]);
                    self.guess("rotation", Rotation::Vector.name(), reason);
                    Rotation::Vector
                }
            };
            return Ok(Turn::Three(columns, rotation));
        }
        let some = found.quaternion.iter().flatten().count();
        if some > 0 {
            let which = ["x", "y", "z", "w"].iter().zip(&found.quaternion);
            let missing: Vec<&str> = which.filter(|(_, c)| c.is_none()).map(|(n, _)| *n).collect();
            let problem = format!("the quaternion of `{prefix}` has no {}", missing.join(", "));
            return Err(self.fault("", problem, "columns of x, y, z and w, or none".into()));
        }
        Ok(Turn::None)
    }
}

/// Notes a column of a body. Returns whether it is used.
fn note(body: &mut Found, index: usize, column: &super::columns::Column) -> bool {
    fn take(slot: &mut Option<usize>, index: usize) -> bool {
        let free = slot.is_none();
        slot.get_or_insert(index);
        free
    }
    match column.field {
        Field::Position(axis) => {
            let slot = &mut body.position[axis];
            let better = slot.is_none_or(|(_, doubt)| column.doubt < doubt);
            if better {
                *slot = Some((index, column.doubt));
            }
        }
        Field::Quaternion(axis) => drop(take(&mut body.quaternion[axis], index)),
        Field::Component(number) => drop(body.component.insert(number, index)),
        Field::Turn(axis, angles) => {
            take(&mut body.three[axis], index);
            body.angles = body.angles.or(angles);
        }
        Field::Matrix(entry) => drop(body.matrix.insert(entry, index)),
        _ => {}
    }
    // Whether the body uses it is known once all its columns are.
    false
}

fn mark(used: &mut [bool], body: &Body) {
    let turn: &[usize] = match &body.turn {
        Turn::None => &[],
        Turn::Quaternion(columns) => columns,
        Turn::Three(columns, _) => columns,
        Turn::Matrix(columns) => columns,
    };
    body.position.iter().chain(turn).for_each(|index| used[*index] = true);
}
