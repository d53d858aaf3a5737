//! The rules for task files.

use std::collections::BTreeSet;

use super::WORLD;
use super::format::{
    GraspData, LookData, Meddling, Orientation, PartKind, Place, Quantity, Reference, Region,
    Relation, Shape, SliderData, Start, TaskFile,
};
use crate::robot::arm::level::dot;
use crate::robot::arm::reaches_table;
use crate::robot::arm::vector::unit;
use crate::sim::{few, is_plain};

/// A fault: the field, what was found and what was expected.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Fault {
    pub field: String,
    pub problem: String,
    pub expected: String,
}

type Checked = Result<(), Fault>;

/// Greatest coordinate of a place, in metres. No arm reaches farther, and scenes are drawn in vain for long.
const FAR_M: f64 = 100.0;

/// Returns a fault unless `fine`.
fn demand(
    fine: bool,
    field: impl Into<String>,
    problem: impl std::fmt::Debug,
    expected: impl Into<String>,
) -> Checked {
    let fault = || Fault {
        field: field.into(),
        problem: format!("{problem:?}"),
        expected: expected.into(),
    };
    if fine { Ok(()) } else { Err(fault()) }
}

fn in_range(field: String, value: f64, [least, most]: [f64; 2]) -> Checked {
    demand((least..=most).contains(&value), field, value, format!("{least} to {most}"))
}

fn listed<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    few(names.into_iter().map(|name| format!("`{name}`")))
}

fn one_of(field: String, name: &str, choices: &[&str]) -> Checked {
    let expected = format!("one of {}", listed(choices.iter().copied()));
    demand(choices.contains(&name), field, name, expected)
}

fn is_direction(field: String, axis: [f64; 3]) -> Checked {
    let fine = unit(axis).iter().all(|v| v.is_finite());
    demand(fine, field, axis, "a direction: three numbers, not all of them 0")
}

fn are_perpendicular(field: String, a: [f64; 3], b: [f64; 3], other: &str) -> Checked {
    let fine = dot(unit(a), unit(b)).abs() < 1e-3;
    demand(fine, field, a, format!("a direction perpendicular to `{other}`"))
}

fn distinct<'a>(field: &str, names: impl IntoIterator<Item = &'a str>) -> Checked {
    let mut seen = BTreeSet::from([WORLD]);
    for name in names {
        demand(
            (1..=LONGEST_NAME).contains(&name.chars().count()) && is_plain(name),
            field,
            name,
            "1 to 190 characters, none of them a control character",
        )?;
        demand(seen.insert(name), field, name, "a name that nothing else has")?;
    }
    Ok(())
}

/// Greatest length of a name, in characters. In a recording, ids are longer than their kind, and have at most 200
/// characters.
const LONGEST_NAME: usize = 190;

fn at_most(field: String, count: usize, most: usize) -> Checked {
    let expected = format!("at most {most}");
    demand(count <= most, field, format_args!("{count} entries"), expected)
}

impl TaskFile {
    /// Checks the lengths of all lists, on which the cost of every other check depends.
    fn check_sizes(&self) -> Checked {
        let starts = |starts: &[Start]| starts.iter().map(|s| s.count.min(1000)).sum::<usize>();
        let lists = [
            ("parts", self.parts.len(), 64),
            ("references", self.references.len(), 64),
            ("goal", self.goal.len(), 64),
            ("conditions", self.conditions.len(), 64),
            ("perturbations", self.perturbations.len(), 64),
            ("parts[].starts", self.parts.iter().map(|p| starts(&p.starts)).sum(), 128),
            ("references[].starts", self.references.iter().map(|r| starts(&r.starts)).sum(), 128),
        ];
        lists
            .into_iter()
            .try_for_each(|(field, count, most)| at_most(field.into(), count, most))?;
        let shapes = self.parts.iter().map(|p| &p.shape);
        for (i, shape) in shapes.chain(self.references.iter().map(|r| &r.shape)).enumerate() {
            let field = match i.checked_sub(self.parts.len()) {
                None => format!("parts[{i}].shape"),
                Some(i) => format!("references[{i}].shape"),
            };
            at_most(field.clone(), shape.len(), 64)?;
            for piece in shape {
                if let Shape::Hull { points } = piece {
                    at_most(format!("{field}[].hull.points"), points.len(), 256)?;
                }
            }
        }
        for (i, part) in self.parts.iter().enumerate() {
            let grasps = format!("parts[{i}].grasps");
            at_most(grasps.clone(), part.grasps.len(), 64)?;
            for grasp in &part.grasps {
                at_most(format!("{grasps}[].openings_m"), grasp.openings_m.len(), 16)?;
                at_most(format!("{grasps}[].tilts_deg"), grasp.tilts_deg.len(), 16)?;
            }
        }
        for (i, reference) in self.references.iter().enumerate() {
            at_most(format!("references[{i}].landmarks"), reference.landmarks.len(), 64)?;
        }
        for (at, relation) in self.named_relations() {
            at_most(format!("{at}.places"), relation.places.len(), 256)?;
            at_most(format!("{at}.after"), relation.after.len(), 64)?;
            at_most(format!("{at}.needs"), relation.needs.len(), 64)?;
        }
        Ok(())
    }

    /// Checks everything that needs no scene.
    pub(super) fn faults(&self) -> Checked {
        self.check_sizes()?;
        let simple = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        let fine = (1..=LONGEST_NAME).contains(&self.name.len()) && self.name.chars().all(simple);
        demand(fine, "name", &self.name, "lower-case letters, digits and hyphens, at most 190")?;
        demand(!self.parts.is_empty(), "parts", "an empty list", "at least one kind of part")?;
        let kinds = self.parts.iter().map(|part| part.kind.as_str());
        let names = self.references.iter().map(|r| r.name.as_str());
        distinct("parts and references", kinds.chain(names))?;
        for (i, part) in self.parts.iter().enumerate() {
            self.check_part(part, &format!("parts[{i}]"))?;
        }
        for (i, reference) in self.references.iter().enumerate() {
            self.check_reference(reference, i, &format!("references[{i}]"))?;
        }
        demand(!self.goal.is_empty(), "goal", "an empty list", "at least one relation")?;
        distinct("goal[].name", self.relations().map(|relation| relation.name.as_str()))?;
        for (at, relation) in self.named_relations() {
            self.check_relation(relation, &at)?;
        }
        self.check_orders()?;
        let [low, high] = self.table.rim;
        let inside = |i: usize| low[i] < high[i] && low[i] > -10.0 && high[i] < 10.0;
        let expected = "the rim's lower corner first, both within 10 m";
        demand((0..2).all(inside), "table.rim", self.table.rim, expected)?;
        let corners = self.aside;
        let fine = (0..2).all(|i| corners[0][i] <= corners[1][i])
            && corners.into_iter().any(reaches_table);
        demand(fine, "aside", corners, "an area within the arm's reach, the lower corner first")?;
        for (i, meddling) in self.perturbations.iter().enumerate() {
            self.check_meddling(meddling, &format!("perturbations[{i}]"))?;
        }
        Ok(())
    }

    /// Returns all relations, each with its place in the file.
    fn named_relations(&self) -> impl Iterator<Item = (String, &Relation)> {
        let goal = self.goal.iter().enumerate().map(|(i, r)| (format!("goal[{i}]"), r));
        let conditions = self.conditions.iter().enumerate();
        goal.chain(conditions.map(|(i, r)| (format!("conditions[{i}]"), r)))
    }

    fn check_part(&self, part: &PartKind, at: &str) -> Checked {
        demand(
            !part.shape.is_empty(),
            format!("{at}.shape"),
            "an empty list",
            "at least one piece",
        )?;
        check_body(&part.shape, &part.look, at)?;
        in_range(format!("{at}.density"), part.density, [1.0, 30_000.0])?;
        in_range(format!("{at}.friction"), part.friction, [1e-3, 10.0])?;
        let handling = &part.handling;
        in_range(format!("{at}.handling.turns"), f64::from(handling.turns), [1.0, 360.0])?;
        in_range(format!("{at}.handling.fold"), f64::from(handling.fold), [1.0, 360.0])?;
        in_range(format!("{at}.handling.fall_m"), handling.fall_m, [0.0, 1.0])?;
        in_range(format!("{at}.handling.rise_m"), handling.rise_m, [0.0, 1.0])?;
        in_range(format!("{at}.handling.clear_m"), handling.clear_m, [0.0, 1.0])?;
        in_range(format!("{at}.handling.in_the_way_m"), handling.in_the_way_m, [0.0, 1.0])?;
        let stroke = [0.0, self.gripper.stroke_m];
        in_range(format!("{at}.handling.release_m"), handling.release_m, stroke)?;
        demand(
            !part.grasps.is_empty(),
            format!("{at}.grasps"),
            "an empty list",
            "at least one grasp",
        )?;
        for (i, grasp) in part.grasps.iter().enumerate() {
            check_grasp(grasp, stroke, &format!("{at}.grasps[{i}]"))?;
        }
        let starts = format!("{at}.starts");
        demand(!part.starts.is_empty(), &starts, "an empty list", "at least one start")?;
        if let Some(slider) = &part.slider {
            check_slider(slider, &format!("{at}.slider"))?;
        }
        for (i, start) in part.starts.iter().enumerate() {
            self.check_start(start, self.references.len(), &format!("{starts}[{i}]"))?;
            let alone = part.slider.is_none() || (start.on.is_none() && !start.heap);
            let expected = "a `region` without `heap` for a part that slides";
            demand(alone, format!("{starts}[{i}]"), "a start on others", expected)?;
            if let Some(on) = &start.on {
                let fine = |p: &&PartKind| p.starts.first().is_some_and(|s| s.region.is_some());
                let below = self.parts.iter().filter(fine).map(|p| p.kind.as_str());
                let below: Vec<&str> = below.filter(|kind| *kind != part.kind).collect();
                one_of(format!("{starts}[{i}].on"), on, &below)?;
            }
        }
        Ok(())
    }

    fn check_reference(&self, reference: &Reference, index: usize, at: &str) -> Checked {
        check_body(&reference.shape, &reference.look, at)?;
        in_range(format!("{at}.friction"), reference.friction, [1e-3, 10.0])?;
        let starts = format!("{at}.starts");
        demand(!reference.starts.is_empty(), &starts, "an empty list", "at least one start")?;
        for (i, start) in reference.starts.iter().enumerate() {
            self.check_start(start, index, &format!("{starts}[{i}]"))?;
            let region = format!("{starts}[{i}].on");
            demand(
                start.on.is_none(),
                region,
                &start.on,
                "a `region`: references stand on nothing",
            )?;
        }
        let fine = !(reference.movable && reference.shape.is_empty());
        demand(
            fine,
            format!("{at}.movable"),
            true,
            "false: a reference without a shape does not move",
        )?;
        if let Some(room) = reference.room {
            let fine = (0..2).all(|i| room[0][i] < room[1][i]);
            demand(fine, format!("{at}.room"), room, "two corners, the lower one first")?;
        }
        let kinds: Vec<&str> = self.parts.iter().map(|p| p.kind.as_str()).collect();
        for (i, mark) in reference.landmarks.iter().enumerate() {
            let length = (1..=LONGEST_NAME).contains(&mark.name.chars().count());
            let fine = length && is_plain(&mark.name) && !kinds.contains(&mark.name.as_str());
            let field = format!("{at}.landmarks[{i}].name");
            demand(
                fine,
                field,
                &mark.name,
                "a name of 1 to 190 characters that no kind of part has",
            )?;
        }
        Ok(())
    }

    /// Checks a start. A region may lie in the frame of one of the first `known` references.
    fn check_start(&self, start: &Start, known: usize, at: &str) -> Checked {
        demand((1..=64).contains(&start.count), format!("{at}.count"), start.count, "1 to 64")?;
        in_range(format!("{at}.gap_m"), start.gap_m, [-1.0, 1.0])?;
        let one = start.region.is_some() != start.on.is_some();
        demand(one, at, "a start with both or neither", "either `region` or `on`")?;
        match &start.region {
            Some(region) => self.check_region(region, known, &format!("{at}.region")),
            None => Ok(()),
        }
    }

    fn check_region(&self, region: &Region, known: usize, at: &str) -> Checked {
        let names = self.references.iter().take(known).map(|r| r.name.as_str());
        let choices: Vec<&str> = [WORLD].into_iter().chain(names).collect();
        one_of(format!("{at}.of"), &region.of, &choices)?;
        let (low, high) = (region.low, region.high.unwrap_or(region.low));
        let fine = (0..2).all(|i| low[i] <= high[i] && low[i].is_finite() && high[i].is_finite());
        demand(fine, format!("{at}.low"), [low, high], "the corner with the smaller coordinates")?;
        is_direction(format!("{at}.z_axis"), region.z_axis)?;
        let [least, most] = region.yaw_deg;
        let fine = least <= most && most - least <= 360.0;
        demand(fine, format!("{at}.yaw_deg"), region.yaw_deg, "the smaller angle first")?;
        in_range(format!("{at}.tilt_deg"), region.tilt_deg, [0.0, 180.0])?;
        in_range(format!("{at}.z_m"), region.z_m, [0.0, 0.5])?;
        in_range(format!("{at}.drop_m"), region.drop_m, [0.0, 0.5])
    }

    fn check_relation(&self, relation: &Relation, at: &str) -> Checked {
        let kinds: Vec<&str> = self.parts.iter().map(|part| part.kind.as_str()).collect();
        one_of(format!("{at}.part"), &relation.part, &kinds)?;
        let fixed = self.references.iter().map(|r| r.name.as_str());
        let frames: Vec<&str> = [WORLD].into_iter().chain(fixed).chain(kinds).collect();
        one_of(format!("{at}.reference"), &relation.reference, &frames)?;
        let places = format!("{at}.places");
        demand(!relation.places.is_empty(), &places, "an empty list", "at least one place")?;
        for (i, place) in relation.places.iter().enumerate() {
            check_place(place, relation.orientation, &format!("{places}[{i}]"))?;
        }
        let fine = relation.within_m.iter().flatten().all(|v| (1e-5..=1.0).contains(v));
        let expected = "0.00001 to 1, or null, for each axis";
        demand(fine, format!("{at}.within_m"), relation.within_m, expected)?;
        in_range(format!("{at}.within_deg"), relation.within_deg, [0.1, 180.0])?;
        let starts = |named: &[Start]| named.iter().map(|start| start.count).sum::<usize>();
        let parts = self.parts.iter().filter(|part| part.kind == relation.part);
        let count: usize = parts.map(|part| starts(&part.starts)).sum();
        let named = self.references.iter().filter(|r| r.name == relation.reference);
        let instances: usize = named.map(|r| starts(&r.starts)).sum();
        let asked = match relation.quantity {
            Quantity::Each => instances.max(1),
            Quantity::One => 1,
            Quantity::AtLeast(least) => least,
        };
        let expected = format!("1 to {count}: there are so many parts of this kind");
        demand((1..=count).contains(&asked), format!("{at}.for"), asked, expected)
    }

    /// Checks that `after` names relations of the goal and `needs` conditions, and that they lead in no circle.
    fn check_orders(&self) -> Checked {
        let names = |of: &'_ [Relation]| of.iter().map(|r| r.name.clone()).collect::<Vec<_>>();
        let (goals, conditions) = (names(&self.goal), names(&self.conditions));
        for (at, relation) in self.named_relations() {
            for (field, given, choices) in
                [("after", &relation.after, &goals), ("needs", &relation.needs, &conditions)]
            {
                let choices: Vec<&str> = choices.iter().map(String::as_str).collect();
                given
                    .iter()
                    .try_for_each(|name| one_of(format!("{at}.{field}"), name, &choices))?;
            }
        }
        let mut done: BTreeSet<&str> = BTreeSet::new();
        for _ in self.relations() {
            let ready = |r: &&Relation| {
                r.after.iter().chain(&r.needs).all(|name| done.contains(name.as_str()))
            };
            let now: Vec<&str> = self.relations().filter(ready).map(|r| r.name.as_str()).collect();
            done.extend(now);
        }
        let stuck = self.named_relations().find(|(_, r)| !done.contains(r.name.as_str()));
        stuck.map_or(Ok(()), |(at, relation)| {
            let (field, given) = match relation.after.is_empty() {
                true => ("needs", &relation.needs),
                false => ("after", &relation.after),
            };
            let expected = "relations that do not wait for this one";
            demand(false, format!("{at}.{field}"), given, expected)
        })
    }

    fn check_meddling(&self, meddling: &Meddling, at: &str) -> Checked {
        // Another hand takes no part off its guide.
        let free = self.parts.iter().filter(|part| part.slider.is_none());
        let kinds: Vec<&str> = free.map(|part| part.kind.as_str()).collect();
        let movable = self.references.iter().filter(|r| r.movable).map(|r| r.name.as_str());
        let choices: Vec<&str> = kinds.into_iter().chain(movable).collect();
        one_of(format!("{at}.moves"), &meddling.moves, &choices)?;
        self.check_region(&meddling.to, self.references.len(), &format!("{at}.to"))?;
        let [from, to] = meddling.between_s;
        let fine = 0.0 <= from && from <= to && to.is_finite();
        demand(
            fine,
            format!("{at}.between_s"),
            meddling.between_s,
            "the earlier time first, in seconds",
        )
    }
}

fn check_body(shapes: &[Shape], look: &LookData, at: &str) -> Checked {
    for (i, shape) in shapes.iter().enumerate() {
        check_shape(shape, &format!("{at}.shape[{i}]"))?;
    }
    in_range(format!("{at}.look.roughness"), look.roughness, [0.0, 1.0])?;
    let colours = [("colour", Some(&look.colour)), ("ink", look.ink.as_ref())];
    for (name, colour) in colours.into_iter().filter_map(|(n, c)| c.map(|c| (n, c))) {
        let fine = LookData::number(colour).is_some();
        demand(fine, format!("{at}.look.{name}"), colour, "a colour such as #e69f00")?;
    }
    Ok(())
}

fn check_shape(shape: &Shape, at: &str) -> Checked {
    let size = |name: &str, value: f64| in_range(format!("{at}.{name}"), value, [1e-4, 2.0]);
    let place = |name: &str, place: [f64; 3]| {
        place.iter().try_for_each(|v| in_range(format!("{at}.{name}"), *v, [-2.0, 2.0]))
    };
    match shape {
        Shape::Box { middle, .. } => place("box.middle", *middle)?,
        Shape::Prism { base, .. } => place("prism.base", *base)?,
        Shape::Ring { base, .. } => place("ring.base", *base)?,
        Shape::Hull { .. } => {}
    }
    match shape {
        Shape::Box { size_m, .. } => size_m.iter().try_for_each(|v| size("box.size_m", *v)),
        Shape::Prism { radius_m, top_radius_m, height_m, sides, .. } => {
            in_range(format!("{at}.prism.sides"), f64::from(*sides), [3.0, 48.0])?;
            size("prism.radius_m", *radius_m)?;
            size("prism.top_radius_m", top_radius_m.unwrap_or(*radius_m))?;
            size("prism.height_m", *height_m)
        }
        Shape::Ring { inner_m, outer_m, height_m, chamfer_m, sides, .. } => {
            in_range(format!("{at}.ring.sides"), f64::from(*sides), [3.0, 48.0])?;
            size("ring.inner_m", *inner_m)?;
            size("ring.height_m", *height_m)?;
            in_range(format!("{at}.ring.outer_m"), *outer_m, [inner_m + chamfer_m + 1e-4, 2.0])?;
            in_range(format!("{at}.ring.chamfer_m"), *chamfer_m, [0.0, height_m - 1e-4])
        }
        Shape::Hull { points } => {
            let fine = points.len() >= 4 && points.iter().flatten().all(|v| v.abs() <= 2.0);
            let expected = "at least four points, at most 2 m from the origin along each axis";
            demand(fine, format!("{at}.hull.points"), points, expected)
        }
    }
}

fn check_slider(slider: &SliderData, at: &str) -> Checked {
    is_direction(format!("{at}.axis"), slider.axis)?;
    let [least, most] = slider.range_m;
    let fine = (-1.0..=0.0).contains(&least) && (0.0..=1.0).contains(&most) && least < most;
    let expected = "-1 to 0, then 0 to 1, and not both 0";
    demand(fine, format!("{at}.range_m"), slider.range_m, expected)?;
    in_range(format!("{at}.friction_n"), slider.friction_n, [0.0, 1e3])
}

fn check_grasp(grasp: &GraspData, stroke: [f64; 2], at: &str) -> Checked {
    is_direction(format!("{at}.approach"), grasp.approach)?;
    is_direction(format!("{at}.closing"), grasp.closing)?;
    are_perpendicular(format!("{at}.closing"), grasp.closing, grasp.approach, "approach")?;
    let openings = format!("{at}.openings_m");
    demand(!grasp.openings_m.is_empty(), &openings, "an empty list", "at least one opening")?;
    for opening in &grasp.openings_m {
        in_range(openings.clone(), *opening, stroke)?;
    }
    in_range(format!("{at}.beyond_m"), grasp.beyond_m, [-0.1, 0.1])?;
    in_range(format!("{at}.most_deg"), grasp.most_deg, [0.0, 180.0])?;
    let fine = !grasp.tilts_deg.is_empty() && grasp.tilts_deg.iter().all(|t| t.abs() <= 90.0);
    demand(
        fine,
        format!("{at}.tilts_deg"),
        &grasp.tilts_deg,
        "at least one angle, each -90 to 90",
    )?;
    if let Some(around) = grasp.around {
        is_direction(format!("{at}.around.axis"), around.axis)?;
        in_range(format!("{at}.around.times"), f64::from(around.times), [1.0, 48.0])?;
    }
    Ok(())
}

fn check_place(place: &Place, orientation: Orientation, at: &str) -> Checked {
    let fine = place.position.iter().all(|v| v.abs() <= FAR_M);
    let expected = "three numbers, at most 100 m from the origin along each axis";
    demand(fine, format!("{at}.position"), place.position, expected)?;
    is_direction(format!("{at}.z_axis"), place.z_axis)?;
    is_direction(format!("{at}.x_axis"), place.x_axis)?;
    if orientation == Orientation::Full {
        are_perpendicular(format!("{at}.x_axis"), place.x_axis, place.z_axis, "z_axis")?;
    }
    Ok(())
}
