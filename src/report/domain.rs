//! Domains as the page reads them.

use serde_json::{Value, json};

use crate::task::classify::Classifier;
use crate::task::domain::{
    Coordinate, FrameState, NeedVerdict, Place, RelationalDomain, RelationalOperator, Role,
};

/// Returns a domain as the page reads it: tables in words, and the places of the 3-D view.
pub(super) fn to_page(domain: &RelationalDomain) -> Value {
    let classifier = Classifier::new(domain);
    json!({
        "provenance": domain.provenance,
        "goal": domain.goals_in_words().unwrap_or_default(),
        "words": domain.words,
        "states": domain.states.iter().map(|s| state(domain, s)).collect::<Vec<_>>(),
        "operators": domain.operators.iter().map(|o| operator(domain, o)).collect::<Vec<_>>(),
        "drawn": (0..domain.states.len()).flat_map(|state| drawn(domain, &classifier, state)).collect::<Vec<_>>(),
    })
}

fn state(domain: &RelationalDomain, state: &FrameState) -> Value {
    // Adding 0 leaves no minus before a zero.
    let mm = |metres: f64| format!("{:.1}", (metres * 1e4).round() / 10.0 + 0.0);
    let places = state.places.iter().map(|place| {
        let position = place.coordinates.map(|c| match c {
            Coordinate::Tight { mean, .. } => mm(mean),
            Coordinate::Open { low, high } => format!("{} to {}", mm(low), mm(high)),
        });
        let spread = place.coordinates.map(|c| match c {
            Coordinate::Tight { sd, .. } => format!("{:.2}", sd * 1e3),
            Coordinate::Open { .. } => "open".into(),
        });
        json!({"position": position.join(", "), "spread": spread.join(", ")})
    });
    json!({
        "name": state.name, "words": domain.in_words(&state.name), "kind": state.kind, "frame": state.frame.name(), "count": state.count,
        "origin": state.origin, "orientation": state.turn_in_words(),
        "places": places.collect::<Vec<_>>(),
    })
}

/// Returns the places of a state in their frame, with how far from its middle each accepts an object.
fn drawn(domain: &RelationalDomain, classifier: &Classifier, index: usize) -> Vec<Value> {
    let state = &domain.states[index];
    let goal = domain.goals.iter().any(|goal| goal.states().any(|state| state == index));
    let place = |(number, place): (usize, &Place)| {
        json!({
            "name": state.name, "kind": state.kind, "count": place.count, "origin": state.origin,
            "frame": state.frame.kind(), "goal": goal, "mean": place.pose(),
            "reach": classifier.reach(index, number),
            "area": place.coordinates.iter().any(|c| c.is_open()),
        })
    };
    state.places.iter().enumerate().map(place).collect()
}

fn operator(domain: &RelationalDomain, operator: &RelationalOperator) -> Value {
    let names = |verdict: NeedVerdict| -> Vec<String> {
        let needs = operator.needs_with(verdict);
        needs.map(|need| domain.need_in_words(operator, need)).collect()
    };
    let verdicts = [NeedVerdict::Required, NeedVerdict::Absent, NeedVerdict::Undecided];
    let conditions = verdicts.into_iter().flat_map(|verdict| {
        operator.needs_with(verdict).map(move |need| {
            let word = if verdict == NeedVerdict::Undecided { "undecided" } else { "required" };
            format!("{}: {word}, {}", domain.need_in_words(operator, need), need.reason())
        })
    });
    let order = operator.order.iter();
    let order = order.map(|before| {
        format!("{}: required, it was always so", domain.order_in_words(operator, before))
    });
    let conditions = conditions.chain(order);
    let side_effects = operator.side_effects.iter().map(|effect| {
        let words = domain.side_effect_in_words(operator, effect);
        format!("{words} ({} of {})", effect.changed, effect.of)
    });
    let to = &domain.states[operator.to].name;
    let target = match domain.role_kind(operator, Role::Target) {
        Some(kind) => format!("{to} of a {kind}"),
        None => to.clone(),
    };
    let from = domain.names(&operator.from);
    json!({
        "name": operator.name, "words": domain.operator_in_words(operator), "kind": domain.states[operator.to].kind, "from": from, "to": to,
        "target": target, "instances": operator.instances,
        "preconditions": names(NeedVerdict::Required), "absent": names(NeedVerdict::Absent),
        "effects": [to], "conditions": conditions.collect::<Vec<_>>(),
        "side_effects": side_effects.collect::<Vec<_>>(),
    })
}
