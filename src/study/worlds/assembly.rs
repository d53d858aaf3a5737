//! Worlds in which parts are fitted into fixtures and into each other.

use super::spec::{
    Count, Kind, Lie, Quota, Spec, Start, anywhere, area, at, on_table, spot, turned,
};
use super::truth::{Need, Turn};

const UP: [f64; 3] = [0.0, 0.0, 1.0];

/// Fixed places for a nut and a bolt, or one jig with both.
enum Jig {
    Fixed,
    Anywhere,
}

fn nuts(name: &'static str, count: Count, jig: Jig) -> Spec {
    let spec = Spec::new(name);
    let (spec, pocket, hole) = match jig {
        Jig::Fixed => {
            let pocket = Kind::fixture("nut_pocket", Start::Fixed(at(0.31, -0.22, 0.044)));
            let hole = Kind::fixture("bolt_hole", Start::Fixed(at(0.44, -0.06, 0.044)));
            let pocket_state = spot("NUT_IN_POCKET", "nut", "nut_pocket", &[at(0.0, 0.0, 0.0082)]);
            let hole_state = spot("BOLT_IN_HOLE", "bolt", "bolt_hole", &[at(0.0, 0.0, 0.02)]);
            (spec.kinds([pocket, hole]), pocket_state, hole_state)
        }
        Jig::Anywhere => {
            let jig = Kind::fixture("jig", anywhere([0.3, 0.6], [-0.3, 0.1], 0.044)).radius(0.14);
            let pocket_state = spot("NUT_IN_POCKET", "nut", "jig", &[at(-0.07, 0.02, 0.0082)]);
            let hole_state = spot("BOLT_IN_HOLE", "bolt", "jig", &[at(0.08, -0.03, 0.02)]);
            (spec.kinds([jig]), pocket_state, hole_state)
        }
    };
    spec.kinds([
        Kind::part("nut", count, Start::In("NUT_ON_TABLE")),
        Kind::part("bolt", count, Start::In("BOLT_ON_TABLE")).lie(Lie::Side),
    ])
    .states([
        on_table("NUT_ON_TABLE", "nut", 0.008),
        on_table("BOLT_ON_TABLE", "bolt", 0.015),
        pocket,
        hole,
        spot("BOLT_IN_NUT", "bolt", "nut", &[at(0.0, 0.0, 0.0104)])
            .needs(&[Need::Object("BOLT_IN_HOLE"), Need::Reference("NUT_IN_POCKET")]),
    ])
    .job("NUT_IN_POCKET", Quota::Total(1))
    .job("BOLT_IN_HOLE", Quota::Total(1))
    .job("BOLT_IN_NUT", Quota::Total(1))
    .goal("BOLT_IN_NUT", 1)
}

/// Four bolts go into a flange that stands anywhere; a cover needs all four.
fn flange() -> Spec {
    let holes = [[0.06, 0.06], [-0.06, 0.06], [-0.06, -0.06], [0.06, -0.06]];
    Spec::new("flange")
        .kinds([
            Kind::fixture("flange", anywhere([0.3, 0.6], [-0.3, 0.3], 0.05)).radius(0.14),
            Kind::part(
                "bolt",
                Count::Differs { shown: (4, 6), test: (4, 5) },
                Start::In("BOLT_ON_TABLE"),
            )
            .lie(Lie::Side),
            Kind::part("cover", Count::Any(1, 1), Start::In("COVER_ON_TABLE")).radius(0.08),
        ])
        .states([
            on_table("BOLT_ON_TABLE", "bolt", 0.015),
            on_table("COVER_ON_TABLE", "cover", 0.01),
            spot("BOLT_IN_FLANGE", "bolt", "flange", &holes.map(|[x, y]| at(x, y, 0.02))),
            spot("COVER_ON_FLANGE", "cover", "flange", &[at(0.0, 0.0, 0.05)])
                .needs(&[Need::Holds { state: "BOLT_IN_FLANGE", at_least: 4 }]),
        ])
        .job("BOLT_IN_FLANGE", Quota::Total(4))
        .job("COVER_ON_FLANGE", Quota::Total(1))
        .goal("COVER_ON_FLANGE", 1)
}

/// A keyed peg fits into a holder in one orientation only, and then takes a keyed cap.
fn keyed_peg() -> Spec {
    Spec::new("keyed_peg")
        .kinds([
            Kind::fixture("holder", anywhere([0.3, 0.6], [-0.3, 0.3], 0.03)).radius(0.1),
            Kind::part("peg", Count::Any(1, 2), Start::In("PEG_ON_TABLE")).lie(Lie::Side),
            Kind::part("cap", Count::Any(1, 2), Start::In("CAP_ON_TABLE")),
        ])
        .states([
            on_table("PEG_ON_TABLE", "peg", 0.02),
            on_table("CAP_ON_TABLE", "cap", 0.01),
            spot("PEG_IN_HOLDER", "peg", "holder", &[turned(at(0.02, -0.01, 0.04), UP, 35.0)])
                .turn(Turn::Full),
            spot("CAP_ON_PEG", "cap", "peg", &[turned(at(0.0, 0.0, 0.05), UP, 90.0)])
                .turn(Turn::Full)
                .needs(&[Need::Reference("PEG_IN_HOLDER")]),
        ])
        .job("PEG_IN_HOLDER", Quota::Total(1))
        .job("CAP_ON_PEG", Quota::Total(1))
        .goal("CAP_ON_PEG", 1)
}

/// Three parts go from a conveyor that stands anywhere into a pallet.
fn conveyor() -> Spec {
    let seats = [at(-0.08, 0.0, 0.02), at(0.0, 0.0, 0.02), at(0.08, 0.0, 0.02)];
    Spec::new("conveyor")
        .kinds([
            Kind::fixture("conveyor", anywhere([-0.2, 0.0], [0.2, 0.4], 0.1)).radius(0.35),
            Kind::fixture("pallet", Start::Fixed(at(0.6, -0.3, 0.02))).radius(0.15),
            Kind::part(
                "part",
                Count::Differs { shown: (3, 5), test: (3, 4) },
                Start::In("PART_ON_CONVEYOR"),
            ),
        ])
        .states([
            area("PART_ON_CONVEYOR", "part", at(0.0, 0.0, 0.03), [0.3, 0.008])
                .of("conveyor")
                .turn(Turn::Axis),
            spot("PART_IN_PALLET", "part", "pallet", &seats),
        ])
        .job("PART_IN_PALLET", Quota::Total(3))
        .goal("PART_IN_PALLET", 3)
}

pub(super) fn worlds() -> Vec<Spec> {
    let first = nuts("nuts_nut_first", Count::Any(1, 1), Jig::Fixed);
    vec![
        nuts("nuts", Count::Any(1, 1), Jig::Fixed),
        nuts("nuts_distractors", Count::Differs { shown: (3, 3), test: (1, 1) }, Jig::Fixed),
        nuts("nuts_jig_anywhere", Count::Any(1, 2), Jig::Anywhere),
        first.habit("NUT_IN_POCKET", "BOLT_IN_HOLE"),
        flange(),
        keyed_peg(),
        conveyor(),
    ]
}
