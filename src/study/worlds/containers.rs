//! Worlds with mechanisms and containers: a drawer, a gate, a lever, a crate, shelves.

use super::spec::{
    Count, Kind, Quota, Rule, Spec, Start, Trigger, anywhere, area, at, spot, turned,
};
use super::truth::{Need, Turn};

fn on_table(name: &'static str, kind: &'static str, height: f64) -> Rule {
    area(name, kind, at(-0.2, 0.3, height), [0.2, 0.25])
}

/// A drawer is opened, filled and closed; its content moves with it.
fn drawer() -> Spec {
    let open = Need::Reference("DRAWER_OPEN");
    Spec::new("drawer")
        .kinds([
            Kind::fixture("cabinet", anywhere([0.6, 0.9], [-0.2, 0.2], 0.1)).radius(0.25),
            Kind::part("drawer", Count::Any(1, 1), Start::In("DRAWER_CLOSED"))
                .radius(0.15)
                .carries(),
            Kind::part(
                "box",
                Count::Differs { shown: (1, 3), test: (2, 3) },
                Start::In("BOX_ON_TABLE"),
            ),
        ])
        .states([
            spot("DRAWER_CLOSED", "drawer", "cabinet", &[at(0.0, 0.0, 0.05)])
                .turn(Turn::Full)
                .tolerance(5.0, 5.0),
            spot("DRAWER_OPEN", "drawer", "cabinet", &[at(0.24, 0.0, 0.05)])
                .turn(Turn::Full)
                .tolerance(5.0, 5.0),
            on_table("BOX_ON_TABLE", "box", 0.02),
            area("BOX_IN_DRAWER", "box", at(0.0, 0.0, -0.01), [0.07, 0.12])
                .of("drawer")
                .reach(&[open]),
        ])
        .job("DRAWER_OPEN", Quota::Total(1))
        .job("BOX_IN_DRAWER", Quota::EachObject)
        .job("DRAWER_CLOSED", Quota::Total(1))
        .after(&["DRAWER_OPEN", "BOX_IN_DRAWER"])
        .goal_each("BOX_IN_DRAWER", "box")
        .goal("DRAWER_CLOSED", 1)
}

/// A weight on a button lifts a gate that no hand moves; a parcel goes behind it.
fn gate() -> Spec {
    Spec::new("gate")
        .kinds([
            Kind::fixture("doorway", anywhere([0.5, 0.8], [-0.3, 0.0], 0.0)).radius(0.2),
            Kind::fixture("button", anywhere([0.1, 0.4], [-0.3, 0.3], 0.02)),
            Kind::fixture("gate", Start::In("GATE_DOWN")).radius(0.1),
            Kind::part("weight", Count::Any(1, 1), Start::In("WEIGHT_ON_TABLE")),
            Kind::part("parcel", Count::Any(1, 2), Start::In("PARCEL_ON_TABLE")),
        ])
        .states([
            spot("GATE_DOWN", "gate", "doorway", &[at(0.0, 0.0, 0.1)]).turn(Turn::Full),
            spot("GATE_UP", "gate", "doorway", &[at(0.0, 0.0, 0.3)]).turn(Turn::Full),
            on_table("WEIGHT_ON_TABLE", "weight", 0.03),
            on_table("PARCEL_ON_TABLE", "parcel", 0.02),
            spot("WEIGHT_ON_BUTTON", "weight", "button", &[at(0.0, 0.0, 0.035)])
                .tolerance(8.0, 5.0),
            spot("PARCEL_BEHIND_GATE", "parcel", "doorway", &[at(0.0, 0.18, 0.02)])
                .turn(Turn::Full)
                .tolerance(10.0, 8.0)
                .reach(&[Need::Somewhere("GATE_UP")]),
        ])
        .trigger(Trigger { when: "WEIGHT_ON_BUTTON", then: "GATE_UP", otherwise: "GATE_DOWN" })
        .job("WEIGHT_ON_BUTTON", Quota::Total(1))
        .job("PARCEL_BEHIND_GATE", Quota::Total(1))
        .goal("PARCEL_BEHIND_GATE", 1)
}

/// A lever is turned to open a clamp, a part is put in, and the lever turned back.
fn lever() -> Spec {
    let pivot = at(0.0, 0.12, 0.08);
    Spec::new("lever")
        .kinds([
            Kind::fixture("clamp", anywhere([0.4, 0.7], [-0.3, 0.3], 0.03)).radius(0.18),
            Kind::part("lever", Count::Any(1, 1), Start::In("LEVER_CLOSED")),
            Kind::part("part", Count::Any(1, 2), Start::In("PART_ON_TABLE")),
        ])
        .states([
            spot("LEVER_CLOSED", "lever", "clamp", &[pivot]).turn(Turn::Full).tolerance(4.0, 8.0),
            spot("LEVER_OPEN", "lever", "clamp", &[turned(pivot, [1.0, 0.0, 0.0], 60.0)])
                .turn(Turn::Full)
                .tolerance(4.0, 8.0),
            on_table("PART_ON_TABLE", "part", 0.02),
            spot("PART_IN_CLAMP", "part", "clamp", &[at(0.0, -0.05, 0.03)])
                .turn(Turn::Full)
                .reach(&[Need::Somewhere("LEVER_OPEN")]),
        ])
        .job("LEVER_OPEN", Quota::Total(1))
        .job("PART_IN_CLAMP", Quota::Total(1))
        .job("LEVER_CLOSED", Quota::Total(1))
        .after(&["LEVER_OPEN", "PART_IN_CLAMP"])
        .goal("PART_IN_CLAMP", 1)
        .goal("LEVER_CLOSED", 1)
}

/// At least two bottles go into a crate with four places.
fn at_least_two() -> Spec {
    let seats = [[0.05, 0.05], [-0.05, 0.05], [-0.05, -0.05], [0.05, -0.05]];
    Spec::new("at_least_two")
        .kinds([
            Kind::fixture("crate", anywhere([0.4, 0.7], [-0.3, 0.3], 0.02)).radius(0.15),
            Kind::part(
                "bottle",
                Count::Differs { shown: (4, 5), test: (2, 4) },
                Start::In("BOTTLE_ON_TABLE"),
            )
            .radius(0.04),
        ])
        .states([
            on_table("BOTTLE_ON_TABLE", "bottle", 0.1),
            spot("BOTTLE_IN_CRATE", "bottle", "crate", &seats.map(|[x, y]| at(x, y, 0.1))),
        ])
        .job("BOTTLE_IN_CRATE", Quota::Drawn(2, 3))
        .goal("BOTTLE_IN_CRATE", 2)
}

/// Every book goes onto one of two equal shelves; either is fine.
fn two_shelves() -> Spec {
    let shelf = Kind::fixture("shelf", anywhere([0.4, 1.0], [-0.5, 0.5], 0.2));
    Spec::new("two_shelves")
        .kinds([
            shelf.count(Count::Any(2, 2)).radius(0.25),
            Kind::part(
                "book",
                Count::Differs { shown: (2, 3), test: (1, 3) },
                Start::In("BOOK_ON_TABLE"),
            )
            .radius(0.035),
        ])
        .states([
            on_table("BOOK_ON_TABLE", "book", 0.02),
            area("BOOK_ON_SHELF", "book", at(0.0, 0.0, 0.12), [0.18, 0.01])
                .of("shelf")
                .turn(Turn::Full),
        ])
        .job("BOOK_ON_SHELF", Quota::EachObject)
        .goal_each("BOOK_ON_SHELF", "book")
}

pub(super) fn worlds() -> Vec<Spec> {
    vec![drawer(), gate(), lever(), at_least_two(), two_shelves()]
}
