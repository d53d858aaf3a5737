//! Settings of the cell with nuts and bolts, and the surfaces that a page draws.

#![allow(clippy::expect_used)]
#![cfg(feature = "physics")]

use nalgebra::Vector3;
use symbolt::robot::arm::BodyFrame;
use symbolt::robot::arm::vector::cross;
use symbolt::robot::scene::{
    Body, BodyKind, Fixture, Handling, Look, Mesh, Outline, Part, SceneSpec, Symmetry, cuboid,
};
use symbolt::sim::Seed;
use symbolt::task::tasks::Task;
use symbolt::task::tasks::nuts_and_bolts::NutsAndBolts;

/// Links of the arm that move.
const JOINTS: usize = 7;

#[test]
fn settings_are_read_from_json_and_what_is_missing_has_its_default() {
    let text = br#"{"jig": {"hole_clearance_m": 0.001}, "arm": {"carry_m_s": 0.1}}"#;
    let spec = NutsAndBolts::parse(text, "cell.json").expect("valid");
    let mut expected = NutsAndBolts::default();
    expected.jig.hole_clearance_m = 0.001;
    expected.arm.carry_m_s = 0.1;
    assert_eq!(spec, expected);
    let whole = serde_json::to_vec(&expected).expect("it is plain data");
    assert_eq!(NutsAndBolts::parse(&whole, "whole").expect("valid"), expected);
}

#[test]
fn what_cannot_be_read_or_built_is_refused_with_file_and_line_or_field() {
    let said = |text: &str| {
        let refused = NutsAndBolts::parse(text.as_bytes(), "cell.json").expect_err("invalid");
        refused.to_string()
    };
    let shaft = said(r#"{"part": {"shaft_radius_m": 0.02}}"#);
    assert!(shaft.starts_with("cell.json, field `part.nut_hole_m`: 0.0096"), "{shaft}");
    let typo = said("{\n\"part\": {\"fricton\": 0.3}}");
    assert!(typo.starts_with("cell.json, line 2: unknown field `fricton`"), "{typo}");
    for text in ["", "[]", "{", "3", r#"{"nuts": -1}"#, r#"{"nuts": 1e400}"#] {
        let message = said(text);
        assert!(message.starts_with("cell.json, line "), "{text}: {message}");
    }
}

/// Returns the volume inside a closed surface, by the divergence theorem.
fn volume(mesh: &Mesh) -> f64 {
    let at = |corner: u32| Vector3::from(mesh.vertices[corner as usize].map(f64::from));
    let of = |t: &[u32; 3]| at(t[0]).dot(&at(t[1]).cross(&at(t[2]))) / 6.0;
    mesh.triangles.iter().map(of).sum()
}

#[test]
fn every_body_has_a_closed_surface_that_faces_outwards() {
    let look = Look { colour: 0x0072b2, ink: 0x0072b2, roughness: 0.5 };
    let pieces = vec![cuboid([0.0, 0.0, 0.1], [0.01, 0.02, 0.03])];
    let handling = Handling {
        symmetry: Symmetry { turns: 4, fold: 4, flips: true },
        rise_m: 0.05,
        release_m: 0.02,
        in_the_way_m: 0.02,
        fall_m: 0.0,
        clear_m: 0.0,
    };
    let spec = SceneSpec {
        kinds: vec![BodyKind {
            name: "block".into(),
            pieces: pieces.clone(),
            density: 500.0,
            friction: 0.5,
            handling,
            look,
        }],
        parts: vec![Part::free(0, BodyFrame::at([0.5, 0.0, 0.1])); 2],
        fixtures: vec![Fixture {
            frame: BodyFrame::at([0.4, 0.0, 0.0]),
            pieces,
            friction: 0.5,
            look,
            movable: None,
        }],
        ..SceneSpec::default()
    };
    assert!(spec.check().is_ok());
    let outline = Outline::of(&spec);
    assert_eq!(outline.meshes.len(), 3 + JOINTS + 2);
    for mesh in &outline.meshes {
        assert!(!mesh.triangles.is_empty() && volume(mesh) > 1e-6, "{:?}", mesh.body);
    }
    for mesh in &outline.meshes[1..3] {
        assert!((volume(mesh) - 4.8e-5).abs() < 1e-9, "{:?}", mesh.body);
    }
    assert_eq!((outline.parts, outline.kinds.len()), (vec![0, 0], 1));
}

fn refused(change: impl FnOnce(&mut NutsAndBolts)) -> String {
    let mut spec = NutsAndBolts::default();
    change(&mut spec);
    spec.check().map_or_else(|e| e.to_string(), |()| "accepted".into())
}

#[test]
fn the_default_and_its_mirror_image_are_sound() {
    assert!(NutsAndBolts::default().check().is_ok());
    assert!(NutsAndBolts::default().mirrored().check().is_ok());
    assert!(NutsAndBolts::default().sink_m() >= 1e-3);
}

#[test]
fn impossible_scenes_are_refused_by_the_setting_that_is_wrong() {
    let cases: [(&str, String); 11] = [
        ("part.nut_hole_m", refused(|s| s.part.shaft_radius_m = 0.0097)),
        ("part.friction", refused(|s| s.part.friction = 0.0)),
        ("part.density", refused(|s| s.part.density = f64::NAN)),
        ("nuts", refused(|s| s.nuts = 0)),
        ("bolts", refused(|s| s.bolts = 100)),
        ("nut_kind", refused(|s| s.nut_kind = "n".repeat(191))),
        ("nut_kind", refused(|s| s.nut_kind = "a\nb".into())),
        ("jig.pocket", refused(|s| s.jig.pocket = [0.9, 0.0])),
        ("table.drop", refused(|s| s.table.drop[1] = [2.0, 0.2])),
        ("jig.hole_top_m", refused(|s| s.jig.hole_top_m = 0.0585)),
        ("step_ms", refused(|s| s.step_ms = 3)),
    ];
    for (name, message) in cases {
        assert!(message.contains(name), "{name}: {message}");
    }
}

#[test]
fn the_surface_of_a_nut_has_the_volume_of_a_hexagon_with_a_hole() {
    let settings = NutsAndBolts::default();
    let spec = settings.scene(Seed::new(1)).expect("it can be drawn");
    assert!(spec.check().is_ok());
    let outline = Outline::of(&spec);
    let nut = outline.meshes.iter().find(|m| m.body == Body::Kind(0)).expect("there");
    let at = |corner: u32| nut.vertices[corner as usize].map(f64::from);
    let volume: f64 = (nut.triangles.iter())
        .map(|triangle| {
            let [a, b, c] = triangle.map(at);
            let [x, y, z] = cross(b, c);
            (a[0] * x + a[1] * y + a[2] * z) / 6.0
        })
        .sum();
    // 30 mm across flats outside, 19.2 mm inside, 16 mm high.
    let expected = 3f64.sqrt() / 2.0 * (0.030f64.powi(2) - 0.0192f64.powi(2)) * 0.016;
    assert!((volume - expected).abs() < 1e-3 * expected, "{volume} {expected}");
}

#[test]
fn the_same_seed_gives_the_same_scene_and_another_seed_another() {
    let draw = |seed| NutsAndBolts::default().scene(Seed::new(seed)).expect("it can be drawn");
    assert_eq!(draw(1), draw(1));
    assert_ne!(draw(1).parts, draw(2).parts);
}
