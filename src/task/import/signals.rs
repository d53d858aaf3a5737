//! When the gripper held something, by its own signals: contacts, a flag, or its width.

use super::finish::median;
use super::streams::Part;

/// A stretch in which something was held, in seconds.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Hold {
    pub from: f64,
    pub to: f64,
    /// Id of the object, if the signal says it.
    pub object: Option<String>,
    /// The evidence, in words.
    pub evidence: String,
}

/// Flags that change for less than this are taken for flicker, in seconds.
const FLICKER: f64 = 0.12;

/// Returns when the gripper held something; `None` if no signal says so.
pub(super) fn holds(part: &Part) -> Option<Vec<Hold>> {
    let mut holds: Vec<Hold> = Vec::new();
    for (id, flags) in &part.contacts {
        let object = (!id.is_empty()).then(|| id.clone());
        let what = if id.is_empty() { "contact flag".into() } else { format!("contact with {id}") };
        holds.extend(stretches(flags).map(|(from, to)| Hold {
            from,
            to,
            object: object.clone(),
            evidence: what.clone(),
        }));
    }
    if holds.is_empty() {
        let evidence = "grasp flag".to_owned();
        let own = stretches(&part.grasp);
        holds = own
            .map(|(from, to)| Hold { from, to, object: None, evidence: evidence.clone() })
            .collect();
    }
    if holds.is_empty() {
        holds = by_width(&part.width);
    }
    holds.sort_by(|a, b| a.from.total_cmp(&b.from));
    (!holds.is_empty()).then_some(holds)
}

/// Returns the stretches in which a flag is set, without flicker.
fn stretches(flags: &[(f64, bool)]) -> impl Iterator<Item = (f64, f64)> {
    let mut found: Vec<(f64, f64)> = Vec::new();
    let mut open: Option<f64> = None;
    for (t, set) in flags {
        match (*set, open) {
            (true, None) => match found.last() {
                Some((_, end)) if t - end < FLICKER => open = found.pop().map(|(from, _)| from),
                _ => open = Some(*t),
            },
            (false, Some(from)) => {
                found.push((from, *t));
                open = None;
            }
            _ => {}
        }
    }
    if let (Some(from), Some((last, _))) = (open, flags.last()) {
        found.push((from, *last));
    }
    // A glitch is one sample of many; a log of changes alone has one for each stretch.
    let changes = flags.windows(2).all(|two| two[0].1 != two[1].1);
    let single = |from: f64, to: f64| {
        let later = flags[flags.partition_point(|(t, _)| *t <= from)..].iter();
        !later.take_while(|(t, _)| *t <= to).any(|(_, set)| *set)
    };
    found.retain(|(from, to)| to - from >= FLICKER && (changes || !single(*from, *to)));
    found.into_iter()
}

/// Returns when the gripper was closed: from where its width stops falling to where it begins to rise.
fn by_width(width: &[(f64, f64)]) -> Vec<Hold> {
    let mut sorted: Vec<f64> = width.iter().map(|(_, w)| *w).collect();
    if sorted.len() < 8 {
        return Vec::new();
    }
    sorted.sort_by(f64::total_cmp);
    let at = |share: f64| sorted[((sorted.len() - 1) as f64 * share) as usize];
    let (low, high) = (at(0.02), at(0.98));
    let mut bends: Vec<f64> =
        width.windows(3).map(|w| (w[0].1 - 2.0 * w[1].1 + w[2].1).abs()).collect();
    let noise = median(&mut bends).unwrap_or(0.0) / 0.6745 / 6f64.sqrt();
    let range = high - low;
    if range <= (12.0 * noise).max(0.05 * high.abs()) {
        return Vec::new();
    }
    let limit = high - (0.1 * range).max(5.0 * noise);
    let closed: Vec<(f64, bool)> = width.iter().map(|(t, w)| (*t, *w < limit)).collect();
    let held = |(from, to): (f64, f64)| {
        let inside: Vec<(f64, f64)> =
            width.iter().filter(|(t, _)| (from..=to).contains(t)).copied().collect();
        let mut own: Vec<f64> = inside.iter().map(|(_, w)| *w).collect();
        let level = median(&mut own)?;
        let near = |w: f64| w <= level + (0.06 * (high - level)).max(4.0 * noise);
        let first = inside.iter().find(|(_, w)| near(*w))?.0;
        let last = inside.iter().rev().find(|(_, w)| near(*w))?.0;
        let evidence = format!("width {level:.3} of {high:.3}");
        Some(Hold { from: first, to: last, object: None, evidence })
    };
    stretches(&closed).filter_map(held).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_flicker_and_widths_fall_and_rise() {
        let flags: Vec<(f64, bool)> = (0..100)
            .map(|i| (f64::from(i) * 0.05, (20..60).contains(&i) && i != 40 || i == 80))
            .collect();
        assert_eq!(stretches(&flags).collect::<Vec<_>>(), [(1.0, 3.0)]);
        // A glitch of one slow sample, before a stretch.
        let slow: Vec<(f64, bool)> =
            (0..50).map(|i| (f64::from(i) * 0.2, i == 3 || (10..20).contains(&i))).collect();
        assert_eq!(stretches(&slow).collect::<Vec<_>>(), [(2.0, 4.0)]);
        let changes = [(0.0, false), (1.0, true), (2.0, false), (5.0, true), (9.0, false)];
        assert_eq!(stretches(&changes).collect::<Vec<_>>(), [(1.0, 2.0), (5.0, 9.0)]);
        let width: Vec<(f64, f64)> = (0..200)
            .map(|i| {
                let t = f64::from(i) * 0.05;
                let w = if t < 3.0 {
                    80.0
                } else if t < 4.0 {
                    80.0 - 50.0 * (t - 3.0)
                } else if t < 7.0 {
                    30.0
                } else {
                    (30.0 + 50.0 * (t - 7.0)).min(80.0)
                };
                (t, w + f64::from(i % 3) * 0.1)
            })
            .collect();
        let holds = by_width(&width);
        assert_eq!(holds.len(), 1);
        assert!(
            (holds[0].from - 4.0).abs() < 0.11 && (holds[0].to - 7.0).abs() < 0.11,
            "{holds:?}"
        );
        assert!(by_width(&width[..50]).is_empty(), "an open gripper holds nothing");
    }
}
