//! A learned domain as tables and as JSON.

use std::fmt::Write as _;

use serde_json::{Map, Value, json};
use symbolt::task::Origin;
use symbolt::task::domain::{
    Before, Coordinate, FrameState, GoalTerm, Need, NeedVerdict, Place, Quantity, RelationalDomain,
    RelationalOperator, Role,
};

use super::output::keys;
use super::table::{Grid, counted, note, section, unbroken, wrapped};

/// Returns tables of the states, the operators with their conditions and side effects, and the goal.
pub(crate) fn domain_tables(domain: &RelationalDomain) -> String {
    let mut text = String::new();
    let mut grid = Grid::new(&["kind", "attribute", "values", "kind in the domain", ">objects"]);
    for divided in &domain.sub_kinds {
        for part in &divided.of {
            let (kind, attribute) = (divided.kind.clone(), divided.attribute.clone());
            grid.row([kind, attribute, part.values(), part.name.clone(), part.count.to_string()]);
        }
    }
    if !grid.is_empty() {
        section(&mut text, "Kinds divided by an attribute", &grid);
    }
    for divided in domain.sub_kinds.iter().filter(|divided| !divided.also.is_empty()) {
        let (kind, also) = (&divided.kind, divided.also.join(", "));
        let note =
            format!("{also} divides `{kind}` in the same way; more demonstrations would tell.");
        let _ = writeln!(text, "{}\n", wrapped(&note, 0));
    }
    let states = domain.states.iter().enumerate();
    let states = states.map(|(i, state)| (&state.name, domain.state_in_words(i)));
    let operators = domain.operators.iter().map(|o| (&o.name, domain.operator_in_words(o)));
    let mut grid = Grid::new(&["name", "in words"]);
    states.chain(operators).for_each(|(name, words)| grid.row([name.clone(), words.into_owned()]));
    if !grid.is_empty() {
        section(&mut text, NAMES, &grid);
    }
    let title =
        format!("{}, positions in metres in their frame", counted(domain.states.len(), "state"));
    section(&mut text, &title, &state_table(domain));
    section(
        &mut text,
        "Number and standard deviation of the poses in each state",
        &spread_table(domain),
    );
    section(&mut text, &counted(domain.operators.len(), "action"), &action_table(domain));
    let needs = need_table(domain);
    if !needs.is_empty() {
        section(&mut text, NEEDS, &needs);
    }
    let changes = change_table(domain);
    if !changes.is_empty() {
        section(&mut text, "Side effects", &changes);
    }
    let mut grid = Grid::new(&[">order", "goal", "held at the end of"]);
    for (index, goal) in domain.goals.iter().enumerate() {
        let held = format!("{} of {} demonstrations", goal.held, goal.of);
        grid.row([(index + 1).to_string(), domain.goal_in_words(goal), unbroken(&held)]);
    }
    if !grid.is_empty() {
        section(&mut text, "Goal of the demonstrations", &grid);
    }
    if let Some(others) = other_goals(domain) {
        let _ = writeln!(text, "{}\n", wrapped(&note(&others), 0));
    }
    text
}

/// Returns in a sentence the states that some demonstrations may have been for instead; `None` if there are none.
pub(crate) fn other_goals(domain: &RelationalDomain) -> Option<String> {
    let others = domain.other_goals();
    let shown = |state: &usize| {
        let own = domain.operators.iter().filter(|o| o.to == *state);
        format!(
            "{} ({}, {} times)",
            domain.states[*state].name,
            domain.state_in_words(*state),
            own.map(|o| o.instances).sum::<usize>()
        )
    };
    let names: Vec<String> = others.iter().map(shown).collect();
    (!names.is_empty()).then(|| {
        format!(
            "the demonstrations end differently: {} were reached, and neither the goal nor another action needs them; \
             `plan --goal STATE` plans for one of them",
            names.join(" and ")
        )
    })
}

/// The title of the names.
const NAMES: &str = "Names of states and actions (`symbolt rename` changes both columns)";

/// The title of the conditions.
const NEEDS: &str = "Conditions before each action (undecided ones are kept where possible)";

/// Returns the states with their frames and places, one row for each place.
fn state_table(domain: &RelationalDomain) -> Grid {
    let mut grid = Grid::new(&["state", "kind", "frame", ">x", ">y", ">z"]);
    for state in &domain.states {
        for (index, place) in state.places.iter().enumerate() {
            let first = |text: &str| if index == 0 { text.to_owned() } else { String::new() };
            let mut row = vec![first(&state.name), first(&state.kind), first(state.frame.name())];
            row.extend(place.coordinates.iter().map(coordinate));
            grid.row(row);
        }
    }
    grid
}

fn coordinate(coordinate: &Coordinate) -> String {
    match *coordinate {
        Coordinate::Tight { mean, .. } => metres(mean, 3),
        Coordinate::Open { low, high } => format!("{} to {}", metres(low, 2), metres(high, 2)),
    }
}

/// Formats a length given in metres as millimetres, without the unit.
pub(crate) fn mm(metres: f64) -> String {
    format!("{:.3}", metres * 1e3)
}

/// Formats a length in metres, without the sign of a zero.
pub(crate) fn metres(length: f64, digits: usize) -> String {
    let text = format!("{length:.digits$}");
    let zero = text.trim_start_matches('-').chars().all(|c| matches!(c, '0' | '.'));
    if zero { text.trim_start_matches('-').to_owned() } else { text }
}

/// Returns the number and the spread of the poses in each state, one row for each place.
fn spread_table(domain: &RelationalDomain) -> Grid {
    let mut grid =
        Grid::new(&["state", "origin", ">poses", ">x mm", ">y mm", ">z mm", "axes fixed"]);
    for state in &domain.states {
        let one = state.places.len() == 1;
        for (index, place) in state.places.iter().enumerate() {
            let first = |text: String| if index == 0 { text } else { String::new() };
            let poses = if one { state.count } else { place.count };
            let origin = if state.origin == Origin::Found { "found" } else { "placed" };
            let mut row = vec![first(state.name.clone()), first(origin.into()), poses.to_string()];
            row.extend(place.coordinates.iter().map(|c| match c {
                Coordinate::Tight { sd, .. } => mm(*sd),
                Coordinate::Open { .. } => "open".into(),
            }));
            row.push(first(state.turn_in_words()));
            grid.row(row);
        }
    }
    grid
}

/// Returns the actions: the states that the object leaves and enters.
fn action_table(domain: &RelationalDomain) -> Grid {
    let mut grid = Grid::new(&["action", "from", "to", ">instances"]);
    for operator in &domain.operators {
        let from = domain.names(&operator.from).join(" or ");
        let to = domain.states[operator.to].name.clone();
        grid.row([operator.name.clone(), from, to, operator.instances.to_string()]);
    }
    grid
}

/// Returns the conditions before each action with their verdicts and reasons.
fn need_table(domain: &RelationalDomain) -> Grid {
    let mut grid = Grid::new(&["action", "condition", "verdict", "because it"]);
    for operator in &domain.operators {
        let mut name = operator.name.as_str();
        for verdict in [NeedVerdict::Required, NeedVerdict::Absent, NeedVerdict::Undecided] {
            for need in operator.needs_with(verdict) {
                let condition = domain.need_in_words(operator, need);
                let word = if verdict == NeedVerdict::Undecided { "undecided" } else { "required" };
                grid.row([name.into(), condition, word.into(), need.reason()]);
                name = "";
            }
        }
        for before in &operator.order {
            let condition = domain.order_in_words(operator, before);
            grid.row([name.into(), condition, "required".into(), "it was always so".into()]);
            name = "";
        }
    }
    grid
}

/// Mean movement below which an object stays where it is, in metres. `--json` has all movements.
const NOISE_M: f64 = 1e-3;

/// Returns the side effects of each action, and how it moves its object in open coordinates.
fn change_table(domain: &RelationalDomain) -> Grid {
    let mut grid = Grid::new(&["action", "change", "seen in"]);
    for operator in &domain.operators {
        let mut name = operator.name.clone();
        for effect in &operator.side_effects {
            let seen = unbroken(&format!("{} of {}", effect.changed, effect.of));
            let change = domain.side_effect_in_words(operator, effect);
            grid.row([std::mem::take(&mut name), change, seen]);
        }
        if let Some(displacement) = &operator.displacement {
            let open = |axis: usize| {
                let places = &domain.states[operator.to].places;
                places.iter().any(|place| place.coordinates[axis].is_open())
            };
            let moves = |axis: usize| displacement.mean[axis].abs() >= NOISE_M && open(axis);
            let along = ["x", "y", "z"].iter().enumerate().filter(|(axis, _)| moves(*axis));
            let along: Vec<String> = along
                .map(|(axis, name)| format!("{} mm along {name}", mm(displacement.mean[axis])))
                .map(|text| unbroken(&text))
                .collect();
            if !along.is_empty() {
                let change = format!("the object moves by {}", along.join(", "));
                let seen = unbroken(&format!("{0} of {0}", operator.instances));
                grid.row([std::mem::take(&mut name), change, seen]);
            }
        }
    }
    grid
}

/// Returns the keys of `symbolt learn --json` that describe a domain.
pub(crate) fn summary(domain: &RelationalDomain) -> Map<String, Value> {
    keys(json!({
        "states": domain.states.iter().map(|s| state(domain, s)).collect::<Vec<_>>(),
        "operators": domain.operators.iter().map(|o| action(domain, o)).collect::<Vec<_>>(),
        "goals": domain.goals.iter().map(|g| term(domain, g)).collect::<Vec<_>>(),
        "other_goals": domain.names(&domain.other_goals()),
        "goal_words": domain.goals_in_words(),
        "goal": domain.goals.last().map(|goal| &domain.states[goal.state].name),
        "noise_m": domain.noise_m,
        "noise_rad": domain.noise_rad,
        "sub_kinds": domain.sub_kinds,
    }))
}

fn state(domain: &RelationalDomain, state: &FrameState) -> Value {
    let first = state.places.first();
    let places: Vec<Value> = state.places.iter().map(place).collect();
    json!({
        "name": state.name, "words": domain.in_words(&state.name),
        "kind": state.kind, "count": state.count,
        "distinct": state.places.iter().map(|p| p.count).sum::<usize>(), "origin": state.origin,
        "position": first.map(|p| p.pose().position),
        "orientation": first.map(|p| p.orientation),
        "spread": first.map(|p| p.coordinates.map(|c| c.spread())),
        "frame": state.frame.name(), "places": places,
        "turn": state.turn.name(), "turn_matters": state.turn_matters,
    })
}

fn place(place: &Place) -> Value {
    let open = place.coordinates.map(|c| match c {
        Coordinate::Open { low, high } => Some([low, high]),
        Coordinate::Tight { .. } => None,
    });
    json!({
        "position": place.pose().position, "orientation": place.orientation, "count": place.count,
        "spread": place.coordinates.map(|c| c.spread()), "open": open,
    })
}

fn action(domain: &RelationalDomain, operator: &RelationalOperator) -> Value {
    let name = |state: usize| domain.states[state].name.as_str();
    // An operator with several states to leave requires none of them.
    let from = if let [from] = operator.from[..] { vec![name(from)] } else { Vec::new() };
    let with = |verdict: NeedVerdict, mut names: Vec<_>| {
        for need in operator.needs_with(verdict) {
            let state = name(need.condition.state);
            if !names.contains(&state) {
                names.push(state);
            }
        }
        names
    };
    let mut effects = vec![name(operator.to)];
    let mut removes = Vec::new();
    for effect in &operator.side_effects {
        let list = if effect.begins { &mut effects } else { &mut removes };
        let state = name(effect.condition.state);
        if !list.contains(&state) {
            list.push(state);
        }
    }
    let counts = operator.needs.iter().filter(|n| n.holds);
    let counts: Map<String, Value> =
        counts.map(|n| (name(n.condition.state).into(), json!(n.least))).collect();
    let roles = [Role::Object, Role::Origin, Role::Target];
    let parameters: Vec<Value> = roles
        .iter()
        .filter_map(|r| Some(json!({"name": r.name(), "kind": domain.role_kind(operator, *r)?})))
        .collect();
    let needs: Vec<Value> = operator.needs.iter().map(|n| need(domain, operator, n)).collect();
    let one_of = |before: &Before| -> Vec<Value> {
        let each = before.one_of.iter();
        each.map(|(state, place)| json!({"state": name(*state), "place": place})).collect()
    };
    let order = operator.order.iter();
    let order: Vec<Value> = order.map(|b| json!({"place": b.place, "one_of": one_of(b)})).collect();
    let side_effects: Vec<Value> = operator
        .side_effects
        .iter()
        .map(|e| {
            json!({
                "state": name(e.condition.state), "subject": e.condition.subject,
                "begins": e.begins, "changed": e.changed, "of": e.of,
                "words": domain.side_effect_in_words(operator, e),
            })
        })
        .collect();
    json!({
        "name": operator.name,
        "words": domain.operator_in_words(operator),
        "preconditions": with(NeedVerdict::Required, from),
        "effects": effects,
        "absent": with(NeedVerdict::Absent, Vec::new()),
        "removes": removes,
        "kind": domain.states[operator.to].kind,
        "from": operator.from.first().map(|s| name(*s)),
        "from_any": domain.names(&operator.from),
        "to": name(operator.to),
        "instances": operator.instances,
        "parameters": parameters,
        "undecided": with(NeedVerdict::Undecided, Vec::new()),
        "needs_count": counts,
        "needs": needs,
        "order": order,
        "side_effects": side_effects,
        "displacement": operator.displacement,
        "never_seen": domain.names(&operator.never_seen),
    })
}

fn need(domain: &RelationalDomain, operator: &RelationalOperator, need: &Need) -> Value {
    json!({
        "state": domain.states[need.condition.state].name, "or": domain.names(&need.or),
        "subject": need.condition.subject, "verdict": need.verdict, "holds": need.holds,
        "least": need.least, "every": need.every,
        "held": need.held, "of": need.of,
        "words": domain.need_in_words(operator, need), "reason": need.reason(),
    })
}

fn term(domain: &RelationalDomain, goal: &GoalTerm) -> Value {
    let state = &domain.states[goal.state];
    let (each, at_least) = match goal.quantity {
        Quantity::AtLeast(n) => (None, n),
        Quantity::EachReference(n) => (state.frame.kind(), n),
        Quantity::EachObject => (Some(state.kind.as_str()), 1),
    };
    json!({
        "state": state.name, "or": domain.names(&goal.or), "each": each, "at_least": at_least,
        "references_in": goal.reference.map(|r| &domain.states[r].name),
        "held": goal.held, "of": goal.of, "words": domain.goal_in_words(goal),
    })
}
