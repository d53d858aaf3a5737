//! Divides kinds by an attribute, where what is done to their objects differs by it.
//!
//! What is done to an object is where it ends: beside which fixed object, at which place of another object, or in which region, or that
//! it stays. An attribute
//! decides if it predicts this without exception: each word has one outcome, or numbers below a threshold have another outcome than
//! those above. That must be less likely by chance than one in twenty, whatever attribute and outcome are compared.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};

use crate::robot::Pose;
use crate::task::domain::{SubKind, SubKinds};
use crate::task::recording::{Attribute, Attributes, ObjectAttributes, Recording};

use super::remark::Remark;

/// Least probability at which a difference is taken for chance, as for places.
const CHANCE: f64 = 0.05;
/// Distance beyond which an object was moved, in metres. A knock is less.
const MOVED_M: f64 = 0.02;
/// Least gap between two regions in which objects end, in metres, and least ratio to the next gap.
const GAP: (f64, f64) = (0.08, 2.0);
/// Least gap between two places on an object, in metres, and least ratio to the next gap.
const SLOT_GAP: (f64, f64) = (0.015, 3.0);
/// Greatest number of objects whose places are looked at: each is compared with each.
const MOST_PLACED: usize = 500;
/// Greatest number of outcomes that are told apart.
const MOST_OUTCOMES: usize = 6;

/// An object in a demonstration.
struct Case<'r> {
    demo: usize,
    /// Number of the demonstration, as recorded.
    number: u64,
    id: &'r str,
    kind: &'r Arc<str>,
    attributes: Option<&'r ObjectAttributes>,
    moved: bool,
    end: Vector3<f64>,
    turn: UnitQuaternion<f64>,
    /// Index of the nearest object of a kind that never moves, where this one was put.
    near: Option<usize>,
}

/// An attribute that predicts outcomes: the probability by chance, and the parts.
struct Division {
    chance: f64,
    attribute: String,
    parts: Vec<(String, SubKind)>,
}

/// The parts of a kind, each with its home, the part of a fixed kind to which its objects go: red socks with red baskets.
pub(super) type Family = BTreeMap<String, String>;

/// The kinds to divide.
#[derive(Default)]
pub(super) struct Divisions {
    pub kinds: Vec<SubKinds>,
    /// The families of at least two parts.
    pub families: Vec<Family>,
    /// A remark on each kind that would be divided but for some of its objects.
    pub remarks: Vec<Remark>,
}

/// Returns the kinds to divide, and how. Without attributes there are none.
pub fn divide(recording: &Recording, attributes: &Attributes) -> Vec<SubKinds> {
    divisions(recording, attributes).kinds
}

/// Returns the kinds to divide, and what follows from it.
pub(super) fn divisions(recording: &Recording, attributes: &Attributes) -> Divisions {
    let mut remarks = Vec::new();
    if attributes.is_empty() {
        return Divisions::default();
    }
    let mut cases = cases(recording, attributes);
    let moving: BTreeSet<&str> = cases.iter().filter(|c| c.moved).map(|c| &**c.kind).collect();
    let near: Vec<Option<usize>> = cases.iter().map(|c| nearest(c, &cases, &moving)).collect();
    cases.iter_mut().zip(near).for_each(|(case, near)| case.near = near);
    let mut kinds: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (index, case) in cases.iter().enumerate() {
        kinds.entry(&**case.kind).or_default().push(index);
    }
    let mut names: BTreeSet<String> = cases.iter().map(|c| c.kind.to_string()).collect();
    let mut all: Vec<SubKinds> = Vec::new();
    for kind in &moving {
        let own: Vec<&Case<'_>> = kinds[kind].iter().map(|index| &cases[*index]).collect();
        let outcomes = outcomes(&own, &cases);
        all.extend(best(kind, &own, &outcomes, &mut names, &mut remarks));
    }
    // What is done to a fixed object is what is put beside it: of all kinds, or of one of them.
    let part = |all: &[SubKinds], case: &Case<'_>| {
        let divided = all.iter().find(|s| *s.kind == **case.kind)?;
        let value = case.attributes?.get(&divided.attribute)?;
        divided.of.iter().find(|part| part.has(value)).map(|part| part.name.clone())
    };
    let mut put: BTreeMap<usize, Vec<(&str, Option<String>)>> = BTreeMap::new();
    for case in &cases {
        if let Some(near) = case.near {
            put.entry(near).or_default().push((&**case.kind, part(&all, case)));
        }
    }
    let divided = || all.iter().map(|divided| Some(divided.kind.as_str()));
    let mut more = Vec::new();
    for (kind, own) in kinds.iter().filter(|(kind, _)| !moving.contains(*kind)) {
        let received = |to: &usize, of: Option<&str>| {
            let counted = put.get(to)?.iter().filter(|(kind, _)| of.is_none_or(|of| of == *kind));
            let parts: BTreeSet<&Option<String>> = counted.map(|(_, part)| part).collect();
            match parts.into_iter().collect::<Vec<_>>()[..] {
                [part] => part.clone(),
                _ => None,
            }
        };
        let ways = std::iter::once(None).chain(divided());
        let mut outcomes: Vec<Vec<Option<String>>> = Vec::new();
        for of in ways {
            let outcome = own.iter().map(|to| received(to, of)).collect();
            if !outcomes.contains(&outcome) {
                outcomes.push(outcome);
            }
        }
        let own: Vec<&Case<'_>> = own.iter().map(|index| &cases[*index]).collect();
        more.extend(best(kind, &own, &outcomes, &mut names, &mut remarks));
    }
    let mut beside: BTreeMap<String, BTreeSet<Option<String>>> = BTreeMap::new();
    for case in &cases {
        if let Some((near, own)) = case.near.zip(part(&all, case)) {
            beside.entry(own).or_default().insert(part(&more, &cases[near]));
        }
    }
    let home = |part: &SubKind| {
        let mut to = beside.get(&part.name)?.iter();
        let first = to.next().cloned().flatten();
        first.filter(|_| to.next().is_none()).map(|to| (part.name.clone(), to))
    };
    let families = all.iter().map(|divided| divided.of.iter().filter_map(home).collect());
    let families = families.filter(|family: &Family| family.len() > 1).collect();
    all.extend(more);
    Divisions { kinds: all, families, remarks }
}

fn cases<'r>(recording: &'r Recording, attributes: &'r Attributes) -> Vec<Case<'r>> {
    let mut all = Vec::new();
    for (demo, demonstration) in recording.demos.iter().enumerate() {
        let mut ends: BTreeMap<&str, (&Arc<str>, [&Pose; 2])> = BTreeMap::new();
        for object in demonstration.snapshots.iter().flat_map(|s| &s.objects) {
            let pose = &object.pose;
            ends.entry(&object.id).or_insert((&object.kind, [pose; 2])).1[1] = pose;
        }
        all.extend(ends.into_iter().map(|(id, (kind, [start, end]))| {
            let (attributes, moved) = (attributes.get(demo, id), end.distance(start) > MOVED_M);
            Case {
                demo,
                number: demonstration.number,
                id,
                kind,
                attributes,
                moved,
                end: end.position.into(),
                turn: end.rotation(),
                near: None,
            }
        }));
    }
    all
}

/// Returns the nearest object of a kind that never moves, where an object was put; `None` for one that stayed. The cases are in
/// order of the demonstrations.
fn nearest(of: &Case<'_>, cases: &[Case<'_>], moving: &BTreeSet<&str>) -> Option<usize> {
    let from = cases.partition_point(|c| c.demo < of.demo);
    let own = cases[from..].iter().take_while(|c| c.demo == of.demo && of.moved);
    let fixed = own.zip(from..).filter(|(c, _)| !moving.contains(&**c.kind));
    let far = |c: &Case<'_>| (c.end - of.end).norm();
    fixed.min_by(|a, b| far(a.0).total_cmp(&far(b.0))).map(|(_, index)| index)
}

/// Returns what is done to each object, as seen in several ways; `None` for an object that a way says nothing of.
fn outcomes(own: &[&Case<'_>], cases: &[Case<'_>]) -> Vec<Vec<Option<String>>> {
    let near: Vec<Option<&Case<'_>>> =
        own.iter().map(|c| c.near.map(|index| &cases[index])).collect();
    let of = |label: &dyn Fn(&Case<'_>) -> Option<String>| -> Vec<Option<String>> {
        near.iter().map(|n| n.and_then(label)).collect()
    };
    let mut all = vec![
        own.iter().map(|c| Some(c.moved.to_string())).collect(),
        of(&|n| Some(n.kind.to_string())),
        of(&|n| Some(n.id.to_string())),
    ];
    let named = near.iter().flatten().filter_map(|n| n.attributes).flat_map(|a| a.keys());
    for name in named.collect::<BTreeSet<_>>() {
        all.push(of(&|n| match n.attributes?.get(name)? {
            Attribute::Word(word) => Some(word.clone()),
            Attribute::Number(number) => Some(number.to_string()),
        }));
    }
    for axis in 0..3 {
        let mut ends: Vec<f64> = own.iter().filter(|c| c.moved).map(|c| c.end[axis]).collect();
        ends.sort_by(f64::total_cmp);
        let mut gaps: Vec<(f64, f64)> =
            ends.windows(2).map(|e| (e[1] - e[0], 0.5 * (e[0] + e[1]))).collect();
        gaps.sort_by(|a, b| b.0.total_cmp(&a.0));
        let next = gaps.get(1).map_or(0.0, |gap| gap.0);
        if let Some((_, cut)) = gaps.first().filter(|g| g.0 > GAP.0 && g.0 > GAP.1 * next) {
            let side = |c: &&Case<'_>| c.moved.then(|| (c.end[axis] < *cut).to_string());
            all.push(own.iter().map(side).collect());
        }
    }
    let kinds: BTreeSet<&str> = cases.iter().map(|c| &**c.kind).collect();
    all.extend(kinds.into_iter().flat_map(|frame| places(own, cases, frame)));
    all
}

/// Returns the place on the nearest object of another kind at which each object was put, for each number of places that lie apart
/// from each other: rings lie on two pegs, and on each at three heights.
fn places(own: &[&Case<'_>], cases: &[Case<'_>], frame: &str) -> Vec<Vec<Option<String>>> {
    let within = |case: &&Case<'_>| {
        let from = cases.partition_point(|c| c.demo < case.demo);
        let demo = cases[from..].iter().take_while(|c| c.demo == case.demo);
        let others = demo.filter(|c| **c.kind == *frame && c.kind != case.kind && case.moved);
        let far = |c: &Case<'_>| (c.end - case.end).norm();
        let on = others.min_by(|a, b| far(a).total_cmp(&far(b)))?;
        Some(on.turn.inverse() * (case.end - on.end))
    };
    let mut at: Vec<Option<Vector3<f64>>> = own.iter().map(within).collect();
    let placed: Vec<usize> = (0..at.len()).filter(|i| at[*i].is_some()).collect();
    placed.iter().skip(MOST_PLACED).for_each(|i| at[*i] = None);
    let points: Vec<Vector3<f64>> = at.iter().copied().flatten().collect();
    let labelled = |labels: Vec<usize>| {
        let mut labels = labels.into_iter();
        at.iter().map(|at| at.and_then(|_| labels.next()).map(|l| l.to_string())).collect()
    };
    apart(&points).into_iter().map(labelled).collect()
}

/// Divides points into groups that lie apart, in all ways in which the gaps between groups are much wider than those within: the group
/// of each point.
fn apart(points: &[Vector3<f64>]) -> Vec<Vec<usize>> {
    // The shortest tree that joins all points, by Prim's algorithm: of each point that of the tree which it joins.
    let mut near = vec![(f64::INFINITY, 0); points.len()];
    let mut left: BTreeSet<usize> = (1..points.len()).collect();
    let mut joined = Vec::new();
    let mut last = 0;
    while !left.is_empty() {
        for i in &left {
            let far = (points[*i] - points[last]).norm();
            if far < near[*i].0 {
                near[*i] = (far, last);
            }
        }
        let next = left.iter().copied().min_by(|a, b| near[*a].0.total_cmp(&near[*b].0));
        last = next.unwrap_or(last);
        left.remove(&last);
        joined.push(last);
    }
    let mut gaps: Vec<f64> = joined.iter().map(|i| near[*i].0).collect();
    gaps.sort_by(|a, b| b.total_cmp(a));
    let wide = |groups: &usize| {
        let next = gaps.get(groups - 1).copied().unwrap_or(0.0);
        gaps[groups - 2] > SLOT_GAP.0.max(SLOT_GAP.1 * next)
    };
    let grouped = |groups: usize| {
        let (mut group, mut count) = (vec![0; points.len()], 0);
        for i in &joined {
            let (far, to) = near[*i];
            group[*i] = group[to];
            if far >= gaps[groups - 2] {
                count += 1;
                group[*i] = count;
            }
        }
        group
    };
    (2..=MOST_OUTCOMES.min(points.len())).filter(wide).map(grouped).collect()
}

/// Returns the division of a kind that is least likely by chance, if any is unlikely enough.
fn best<'r>(
    kind: &str,
    own: &[&Case<'r>],
    outcomes: &[Vec<Option<String>>],
    names: &mut BTreeSet<String>,
    remarks: &mut Vec<Remark>,
) -> Option<SubKinds> {
    let known = own.iter().filter_map(|c| c.attributes).flat_map(|a| a.keys());
    let attributes: BTreeSet<&String> = known.collect();
    let tests = (attributes.len() * outcomes.len()) as f64;
    let mut found: Vec<Division> = Vec::new();
    let mut would: Vec<(f64, Remark)> = Vec::new();
    for attribute in attributes {
        let value = |case: &Case<'r>| case.attributes?.get(attribute);
        let lacking: Vec<&Case<'r>> = own.iter().copied().filter(|c| value(c).is_none()).collect();
        let but = |case: &Case<'r>, more: usize, lacks: bool| Remark::WouldDivide {
            kind: kind.into(),
            attribute: attribute.clone(),
            id: case.id.into(),
            demo: case.number,
            more,
            lacks,
        };
        for outcome in outcomes {
            let (who, mut shown): (Vec<&Case<'r>>, Vec<(&Attribute, &str)>) = (own.iter())
                .zip(outcome)
                .filter_map(|(case, outcome)| Some((*case, (value(case)?, outcome.as_deref()?))))
                .unzip();
            // An object without the attribute could belong anywhere, and so could those like an exception.
            match (division(attribute, &shown), lacking.first()) {
                (Some(division), None) => found.push(division),
                (Some(division), Some(first)) => {
                    would.push((division.chance, but(first, lacking.len() - 1, true)));
                }
                (None, None) => {
                    let Some(odd) = exception(&shown) else { continue };
                    shown.remove(odd);
                    // Any of them could have been it.
                    let choices = own.len() as f64;
                    would.extend(
                        division(attribute, &shown)
                            .map(|division| (choices * division.chance, but(who[odd], 0, false))),
                    );
                }
                (None, Some(_)) => {}
            }
        }
    }
    found.retain(|d| d.chance * tests < CHANCE);
    would.retain(|(chance, _)| found.is_empty() && chance * tests < CHANCE);
    would.sort_by(|a, b| a.0.total_cmp(&b.0));
    remarks.extend(would.into_iter().next().map(|(_, remark)| remark));
    found.sort_by(|a, b| a.chance.total_cmp(&b.chance));
    let mut found = found.into_iter();
    let Division { attribute, parts, .. } = found.next()?;
    let also: BTreeSet<String> = found.map(|d| d.attribute).filter(|a| *a != attribute).collect();
    let of = parts.into_iter().map(|(ending, part)| {
        let mut name = format!("{kind}_{ending}");
        while !names.insert(name.clone()) {
            name.push_str("_2");
        }
        SubKind { name, ..part }
    });
    Some(SubKinds {
        kind: kind.into(),
        attribute,
        of: of.collect(),
        also: also.into_iter().collect(),
    })
}

/// Returns the only object whose outcome is another than that of the objects with like values; `None` if there are several.
fn exception(shown: &[(&Attribute, &str)]) -> Option<usize> {
    let mut order: Vec<usize> = (0..shown.len()).collect();
    let number = |i: usize| match shown[i].0 {
        Attribute::Number(number) => Some(*number),
        Attribute::Word(_) => None,
    };
    let odd: Vec<usize> = if order.iter().all(|i| number(*i).is_some()) {
        order.sort_by(|a, b| number(*a).partial_cmp(&number(*b)).unwrap_or(Ordering::Equal));
        let outcomes: Vec<&str> = order.iter().map(|i| shown[*i].1).collect();
        let alone =
            |i: &usize| outcomes[i - 1] == outcomes[i + 1] && outcomes[*i] != outcomes[i - 1];
        // Where outcomes take turns, each is alone, and so none is the exception.
        (1..order.len().saturating_sub(1)).filter(alone).map(|i| order[i]).collect()
    } else {
        let mut words: BTreeMap<&str, BTreeMap<&str, Vec<usize>>> = BTreeMap::new();
        for (i, (value, outcome)) in shown.iter().enumerate() {
            let Attribute::Word(word) = value else { return None };
            words.entry(word).or_default().entry(outcome).or_default().push(i);
        }
        let usual = |outcomes: &BTreeMap<&str, Vec<usize>>| outcomes.values().map(Vec::len).max();
        let others = words.values().flat_map(|outcomes| {
            let usual = usual(outcomes);
            let mut others = outcomes.values().collect::<Vec<_>>();
            let most = others.iter().position(|own| Some(own.len()) == usual);
            most.map(|most| others.remove(most));
            others.into_iter().flatten().copied()
        });
        others.collect()
    };
    (odd.len() == 1).then(|| odd[0])
}

/// Returns how an attribute divides objects with these values and outcomes; `None` if it does not predict the outcome.
fn division(attribute: &str, shown: &[(&Attribute, &str)]) -> Option<Division> {
    let mut sizes: BTreeMap<&str, usize> = BTreeMap::new();
    shown.iter().for_each(|(_, outcome)| *sizes.entry(outcome).or_default() += 1);
    if !(2..=MOST_OUTCOMES).contains(&sizes.len()) {
        return None;
    }
    let part = |words: Vec<String>, from, below, count| SubKind {
        name: String::new(),
        words,
        from,
        below,
        count,
    };
    let words: Option<Vec<(&str, &str)>> = (shown.iter())
        .map(|(value, outcome)| match value {
            Attribute::Word(word) => Some((word.as_str(), *outcome)),
            Attribute::Number(_) => None,
        })
        .collect();
    if let Some(words) = words {
        let mut of: BTreeMap<&str, (&str, usize)> = BTreeMap::new();
        for (word, outcome) in words {
            let entry = of.entry(word).or_insert((outcome, 0));
            if entry.0 != outcome {
                return None;
            }
            entry.1 += 1;
        }
        let counts: Vec<usize> = of.values().map(|(_, count)| *count).collect();
        let parts = sizes.iter().map(|(outcome, count)| {
            let own: Vec<String> =
                of.iter().filter(|(_, (o, _))| o == outcome).map(|(w, _)| (*w).into()).collect();
            let ending = match own.len() {
                1 | 2 => own.join("_or_"),
                more => format!("{attribute}_{}_and_{}_more", own[0], more - 1),
            };
            (ending, part(own, None, None, *count))
        });
        let sizes: Vec<usize> = sizes.values().copied().collect();
        let chance = by_words(&counts, &sizes);
        let mut parts: Vec<(String, SubKind)> = parts.collect();
        parts.sort_by(|a, b| a.0.cmp(&b.0));
        return Some(Division { chance, attribute: attribute.into(), parts });
    }
    let numbers: Option<Vec<(f64, &str)>> = (shown.iter())
        .map(|(value, outcome)| match value {
            Attribute::Number(number) => Some((*number, *outcome)),
            Attribute::Word(_) => None,
        })
        .collect();
    let mut numbers = numbers?;
    numbers.sort_by(|a, b| a.0.total_cmp(&b.0));
    let runs: Vec<&[(f64, &str)]> = numbers.chunk_by(|a, b| a.1 == b.1).collect();
    let apart = runs.windows(2).all(|r| r[0][r[0].len() - 1].0 < r[1][0].0);
    if runs.len() != sizes.len() || !apart {
        return None;
    }
    // Of all orders of the outcomes along the numbers, as many have each in one run as there are orders of the runs.
    let mut chance: f64 = (1..=runs.len()).map(|i| i as f64).product();
    let mut left = numbers.len();
    for run in &runs {
        chance /= choose(left, run.len());
        left -= run.len();
    }
    let cut = |i: usize| {
        let (low, high) = (runs[i][runs[i].len() - 1].0, runs[i + 1][0].0);
        rounded(low, high)
    };
    let last = runs.len() - 1;
    let parts = (0..=last).map(|i| {
        let (least, most) = (runs[i][0].0, runs[i][runs[i].len() - 1].0);
        let ending = match (i, last) {
            // Of three or more parts, one number says more than "middle".
            (_, 2..) if least == most && least >= 0.0 && least.fract() == 0.0 => {
                format!("{attribute}_{least}")
            }
            (0, _) => format!("low_{attribute}"),
            (i, last) if i == last => format!("high_{attribute}"),
            (i, _) => format!("middle_{attribute}_{i}"),
        };
        let from = (i > 0).then(|| cut(i - 1));
        let below = (i < last).then(|| cut(i));
        (ending, part(Vec::new(), from, below, runs[i].len()))
    });
    Some(Division { chance, attribute: attribute.into(), parts: parts.collect() })
}

/// Returns the middle of a gap between numbers, with as few digits as tell it from both.
fn rounded(low: f64, high: f64) -> f64 {
    let middle = low + 0.5 * (high - low);
    let mut step = 10f64.powf((high - low).log10().floor() - 1.0);
    if !(step.is_finite() && step > 0.0) {
        return middle;
    }
    step = 1.0 / step;
    let near = (middle * step).round() / step;
    if near.is_finite() && low < near && near <= high { near } else { middle }
}

/// Returns a bound on the probability that words would predict the outcome, were the outcomes dealt out at random to as many objects:
/// the words have these counts, and the outcomes these. For two words and two outcomes it is Fisher's exact test.
fn by_words(counts: &[usize], sizes: &[usize]) -> f64 {
    // In how many ways whole words make up an outcome.
    let ways = |size: usize| {
        let mut ways = vec![0.0; size + 1];
        ways[0] = 1.0;
        for count in counts {
            for sum in (*count..=size).rev() {
                ways[sum] += ways[sum - count];
            }
        }
        ways[size]
    };
    let mut all: Vec<(f64, usize)> = sizes.iter().map(|size| (ways(*size), *size)).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut chance, mut left) = (1.0_f64, counts.iter().sum::<usize>());
    // What is left is the last outcome.
    for (ways, size) in &all[..all.len().saturating_sub(1)] {
        let all = choose(left, *size);
        // Beyond the range of numbers, nothing is known.
        if ways.is_finite() && all.is_finite() {
            chance *= ways / all;
        }
        left -= size;
    }
    chance.min(1.0)
}

/// The number of ways to choose some of all.
fn choose(all: usize, some: usize) -> f64 {
    (0..some).map(|i| (all - i) as f64 / (i + 1) as f64).product()
}
