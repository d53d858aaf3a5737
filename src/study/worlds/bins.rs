//! Worlds in which parts lie in heaps whose heights vary by centimetres.

use super::spec::{Count, Kind, Lie, Quota, Rule, Spec, Start, anywhere, area, at};

/// Parts lie anywhere in a container, in a heap of up to `depth_m` metres.
fn in_bin(name: &'static str, kind: &'static str, bin: &'static str, depth_m: f64) -> Rule {
    area(name, kind, at(0.0, 0.0, 0.015), [0.11, 0.09]).of(bin).depth(depth_m)
}

/// A heap of screws and washers is sorted into two bins.
fn sorting() -> Spec {
    let bin = |name| Kind::fixture(name, anywhere([0.3, 0.9], [-0.5, 0.5], 0.02)).radius(0.16);
    let part = |name, state| {
        let count = Count::Differs { shown: (2, 4), test: (3, 5) };
        Kind::part(name, count, Start::In(state)).lie(Lie::Tumbled)
    };
    Spec::new("sorting")
        .kinds([
            Kind::fixture("tray", anywhere([-0.3, 0.0], [-0.3, 0.3], 0.02)).radius(0.16),
            bin("screw_bin"),
            bin("washer_bin"),
            part("screw", "SCREW_IN_TRAY"),
            part("washer", "WASHER_IN_TRAY"),
        ])
        .states([
            in_bin("SCREW_IN_TRAY", "screw", "tray", 0.05),
            in_bin("WASHER_IN_TRAY", "washer", "tray", 0.05),
            in_bin("SCREW_IN_SCREW_BIN", "screw", "screw_bin", 0.04),
            in_bin("WASHER_IN_WASHER_BIN", "washer", "washer_bin", 0.04),
            // Only mistakes reach these.
            in_bin("SCREW_IN_WASHER_BIN", "screw", "washer_bin", 0.04),
            in_bin("WASHER_IN_SCREW_BIN", "washer", "screw_bin", 0.04),
        ])
        .job("SCREW_IN_SCREW_BIN", Quota::EachObject)
        .job("WASHER_IN_WASHER_BIN", Quota::EachObject)
        .goal_each("SCREW_IN_SCREW_BIN", "screw")
        .goal_each("WASHER_IN_WASHER_BIN", "washer")
}

/// Two kinds in one bin are moved to another bin. The bins are not recorded as objects, as in recordings of real bin
/// picking.
fn bins() -> Spec {
    let origin = |name, kind| area(name, kind, at(0.45, -0.25, 0.02), [0.2, 0.15]).depth(0.06);
    let target = |name, kind| area(name, kind, at(0.45, 0.2, 0.02), [0.2, 0.15]).depth(0.05);
    let part = |name, state| Kind::part(name, Count::Any(1, 3), Start::In(state)).lie(Lie::Tumbled);
    Spec::new("bins")
        .kinds([part("gear", "GEAR_IN_ORIGIN"), part("ring", "RING_IN_ORIGIN")])
        .states([
            origin("GEAR_IN_ORIGIN", "gear"),
            origin("RING_IN_ORIGIN", "ring"),
            target("GEAR_IN_TARGET", "gear"),
            target("RING_IN_TARGET", "ring"),
        ])
        .job("GEAR_IN_TARGET", Quota::EachObject)
        .job("RING_IN_TARGET", Quota::EachObject)
        .goal_each("GEAR_IN_TARGET", "gear")
        .goal_each("RING_IN_TARGET", "ring")
}

pub(super) fn worlds() -> Vec<Spec> {
    vec![sorting(), bins()]
}
