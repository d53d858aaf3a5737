//! Worlds in which a table is set and cups are filled.

use super::spec::{Count, Kind, Lie, Quota, Rule, Spec, Start, anywhere, area, at, spot, turned};
use super::truth::{Need, Turn};

/// Part of the cart's top that holds cutlery and cups: half of its length and width, in metres.
const CART: [f64; 2] = [0.2, 0.16];

fn on_cart(name: &'static str, kind: &'static str, height: f64) -> Rule {
    area(name, kind, at(0.0, 0.0, height), CART).of("cart")
}

/// Each plate, wherever it stands, gets a fork, a knife and a cup.
fn table(name: &'static str) -> Spec {
    let part = |kind, state, radius_m| {
        Kind::part(kind, Count::Like { kind: "plate", more: 1 }, Start::In(state)).radius(radius_m)
    };
    let plates = Count::Differs { shown: (2, 3), test: (1, 4) };
    let plate = Kind::fixture("plate", anywhere([-0.3, 0.9], [-0.6, 0.6], 0.01));
    Spec::new(name)
        .kinds([
            Kind::fixture("cart", anywhere([-1.2, -0.9], [-0.4, 0.4], 0.3)).radius(0.3),
            plate.count(plates).radius(0.23),
            part("fork", "FORK_ON_CART", 0.02),
            part("knife", "KNIFE_ON_CART", 0.02),
            part("cup", "CUP_ON_CART", 0.03),
        ])
        .states([
            on_cart("FORK_ON_CART", "fork", 0.01),
            on_cart("KNIFE_ON_CART", "knife", 0.01),
            on_cart("CUP_ON_CART", "cup", 0.05),
            spot("FORK_LEFT", "fork", "plate", &[at(-0.16, 0.0, -0.005)])
                .turn(Turn::Full)
                .tolerance(15.0, 10.0),
            spot("KNIFE_RIGHT", "knife", "plate", &[at(0.16, 0.0, -0.005)])
                .turn(Turn::Full)
                .tolerance(15.0, 10.0),
            spot("CUP_BEHIND", "cup", "plate", &[at(0.1, 0.15, 0.035)]).tolerance(15.0, 5.0),
        ])
        .job("FORK_LEFT", Quota::EachReference)
        .job("KNIFE_RIGHT", Quota::EachReference)
        .job("CUP_BEHIND", Quota::EachReference)
        .goal_each("FORK_LEFT", "plate")
        .goal_each("KNIFE_RIGHT", "plate")
        .goal_each("CUP_BEHIND", "plate")
}

/// Cups are turned over where they stand, and then filled.
fn cup_turned() -> Spec {
    let centre = at(0.0, 0.2, 0.05);
    let table = [0.3, 0.25];
    Spec::new("cup_turned")
        .kinds([
            Kind::part("cup", Count::Any(1, 2), Start::In("CUP_UPSIDE_DOWN")).radius(0.045),
            Kind::part("ball", Count::Like { kind: "cup", more: 1 }, Start::In("BALL_ON_TABLE"))
                .lie(Lie::Tumbled),
        ])
        .states([
            area("CUP_UPSIDE_DOWN", "cup", turned(centre, [1.0, 0.0, 0.0], 180.0), table)
                .turn(Turn::Axis),
            area("CUP_UPRIGHT", "cup", centre, table).turn(Turn::Axis),
            area("BALL_ON_TABLE", "ball", at(0.6, 0.2, 0.015), [0.15, 0.25]),
            spot("BALL_IN_CUP", "ball", "cup", &[at(0.0, 0.0, -0.03)])
                .turn(Turn::Free)
                .tolerance(8.0, 5.0)
                .needs(&[Need::Reference("CUP_UPRIGHT")]),
        ])
        .job("CUP_UPRIGHT", Quota::EachObject)
        .in_place()
        .job("BALL_IN_CUP", Quota::EachReference)
        .goal_each("CUP_UPRIGHT", "cup")
        .goal_each("BALL_IN_CUP", "cup")
}

pub(super) fn worlds() -> Vec<Spec> {
    let knives = table("table_knife_first");
    vec![
        table("table"),
        knives.habit("KNIFE_RIGHT", "FORK_LEFT").habit("KNIFE_RIGHT", "CUP_BEHIND"),
        cup_turned(),
    ]
}
