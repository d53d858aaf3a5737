//! Worlds in which objects are stacked.

use super::spec::{Count, Kind, Quota, Rule, Spec, Start, anywhere, area, at, on_table, spot};
use super::truth::{Need, Turn};

/// A block rests on another object, aligned with it.
fn on_top(name: &'static str, kind: &'static str, below: &'static str, height: f64) -> Rule {
    spot(name, kind, below, &[at(0.0, 0.0, height)]).turn(Turn::Full).tolerance(7.0, 6.0)
}

/// A tower of three blocks on a base; `clear` adds needs of the lowest block.
fn tower(name: &'static str, count: Count, clear: &[Need]) -> Spec {
    let block = |kind, state| Kind::part(kind, count, Start::In(state));
    Spec::new(name)
        .kinds([
            Kind::fixture("base", anywhere([0.3, 0.6], [-0.3, 0.3], 0.01)),
            block("red", "RED_ON_TABLE"),
            block("green", "GREEN_ON_TABLE"),
            block("blue", "BLUE_ON_TABLE"),
        ])
        .states([
            on_table("RED_ON_TABLE", "red", 0.02),
            on_table("GREEN_ON_TABLE", "green", 0.02),
            on_table("BLUE_ON_TABLE", "blue", 0.02),
            on_top("RED_ON_BASE", "red", "base", 0.03).needs(clear),
            on_top("GREEN_ON_RED", "green", "red", 0.04).needs(&[Need::Reference("RED_ON_BASE")]),
            on_top("BLUE_ON_GREEN", "blue", "green", 0.04)
                .needs(&[Need::Reference("GREEN_ON_RED")]),
        ])
        .job("RED_ON_BASE", Quota::Total(1))
        .job("GREEN_ON_RED", Quota::Total(1))
        .job("BLUE_ON_GREEN", Quota::Total(1))
        .goal("BLUE_ON_GREEN", 1)
}

fn tower_blocked() -> Spec {
    tower("tower_blocked", Count::Any(1, 1), &[Need::Clear("YELLOW_ON_BASE")])
        .kinds([Kind::part(
            "yellow",
            Count::Any(1, 1),
            Start::Either("YELLOW_ON_BASE", "YELLOW_ON_TABLE"),
        )])
        .states([
            on_table("YELLOW_ON_TABLE", "yellow", 0.02),
            on_top("YELLOW_ON_BASE", "yellow", "base", 0.03),
        ])
        .job("YELLOW_ON_TABLE", Quota::Empty("YELLOW_ON_BASE"))
}

/// Three equal cups are stacked, so object and reference have one kind.
fn cup_stack() -> Spec {
    Spec::new("cup_stack")
        .kinds([Kind::part("cup", Count::Any(3, 3), Start::In("CUP_ON_TABLE")).radius(0.045)])
        .states([
            area("CUP_ON_TABLE", "cup", at(0.1, 0.1, 0.05), [0.3, 0.3]).turn(Turn::Axis),
            spot("CUP_ON_CUP", "cup", "cup", &[at(0.0, 0.0, 0.02)]),
        ])
        .job("CUP_ON_CUP", Quota::Total(2))
        .goal("CUP_ON_CUP", 2)
}

pub(super) fn worlds() -> Vec<Spec> {
    vec![tower("tower", Count::Any(1, 2), &[]), tower_blocked(), cup_stack()]
}
