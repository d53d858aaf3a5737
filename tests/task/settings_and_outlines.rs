//! Settings of the cell with nuts and bolts, and the surfaces that a page draws.

#![allow(clippy::expect_used)]
#![cfg(feature = "physics")]

use nalgebra::Vector3;
use symbolt::robot::arm::BodyFrame;
use symbolt::robot::scene::{
    BodyKind, Fixture, Handling, Look, Mesh, Outline, Part, SceneSpec, Symmetry, cuboid,
};
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
