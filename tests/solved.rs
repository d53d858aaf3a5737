//! Files of solved populations: they give the same bits; damaged files and files of other networks are refused.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use symbolt::neurons::{PopulationPlan, SelectRule, SolvedError, SolvedModel};
use symbolt::sim::{BuildErrors, Constant, Graph, GraphBuilder, Real, Seed, Synapse, Timebase};
use symbolt::spa::{BasalGanglia, CleanupMemory};
use symbolt::study::standard::{Model, Standard};

#[path = "support/things.rs"]
mod support;

use support::{lif, rate, vocabulary};

fn choice(plan: &PopulationPlan, seed: u64, actions: usize) -> Result<Graph, BuildErrors> {
    let mut graph = GraphBuilder::new();
    let utilities: Vec<Real> = (0..actions).map(|i| if i == 1 { 0.8 } else { 0.3 }).collect();
    let given = graph.add("given", Constant::vector(&utilities));
    let choice = graph.add("choice", BasalGanglia::new(actions));
    graph.connect(&given, &choice.utilities, Synapse::None);
    graph.build(Timebase::default(), plan, Seed::new(seed))
}

#[test]
fn a_saved_and_loaded_model_has_the_same_bits() {
    for (name, model) in Model::ALL {
        let spec = Standard { dimensions: 32, sim_ms: 300, ..Standard::default() };
        let built = spec.build(model).expect("builds");
        let bytes = built.solved().encode().expect("plain data");
        let solved = SolvedModel::decode(&bytes).expect("sound");
        assert_eq!(solved, built.solved(), "{name}");
        assert_eq!(solved.encode().as_ref(), Ok(&bytes), "{name}");
        let again = spec.build_from(model, solved).expect("it fits");
        let (first, second) = (built.run().expect("runs"), again.run().expect("runs"));
        assert_eq!(first.quality, second.quality, "{name}");
        assert!(first.neurons > 1_000 && first.neurons == second.neurons, "{name}");
    }
}

#[test]
fn a_model_of_another_seed_size_or_mode_is_refused_with_the_layers_path() {
    let solved = SolvedModel::of(&choice(&lif(), 1, 4).expect("builds"));
    assert!(choice(&lif().solved(solved.clone()), 1, 4).is_ok());
    let wrong = [
        choice(&lif().solved(solved.clone()), 2, 4),
        choice(&lif().solved(solved.clone()), 1, 5),
        choice(&rate().solved(solved.clone()), 1, 4),
    ];
    for refused in wrong {
        let said = refused.err().map(|e| e.to_string()).unwrap_or_default();
        assert!(said.contains("choice/gpi") && said.contains("another seed"), "{said}");
    }
    let missing = two_modules_from(&lif().solved(solved));
    assert!(missing.contains("memory/select") && missing.contains("no such layer"), "{missing}");
}

/// Builds two modules with the populations of another graph. Returns the error.
fn two_modules_from(plan: &PopulationPlan) -> String {
    let parts = vocabulary(64);
    let mut graph = GraphBuilder::new();
    let rule = SelectRule::WinnerTakeAll { level: 0.5 };
    let memory = CleanupMemory::new(&parts, ["A", "B"], rule).expect("sound");
    let memory = graph.add("memory", memory);
    let value = parts.get("A").expect("there");
    let given = graph.add("given", Constant::pointer(parts.space(), &value));
    graph.connect(&given, &memory.input, Synapse::None);
    let built = graph.build(Timebase::default(), plan, Seed::new(1));
    built.err().map(|e| e.to_string()).unwrap_or_default()
}

#[test]
fn a_file_of_version_1_is_read() {
    let solved = SolvedModel::of(&choice(&lif(), 1, 3).expect("builds"));
    let bytes = solved.encode().expect("plain data");
    let line = bytes.iter().position(|b| *b == b'\n').expect("a first line");
    let payload = &bytes[line + 1..];
    let mut header: serde_json::Value = serde_json::from_slice(&bytes[..line]).expect("JSON");
    let constants = serde_json::json!({
        "dt": 0.001, "per_tau": 50.0, "tau_rc": 0.02, "tau_ref": 0.002
    });
    for entry in header["layers"].as_object_mut().expect("layers").values_mut() {
        for one in entry.as_array_mut().expect("populations") {
            *one = serde_json::json!({
                "fingerprint": one["fingerprint"], "shape": one["shape"], "firing": "spikes",
                "silencing": one["silencing"], "quiet": one["quiet"], "constants": constants,
            });
        }
    }
    let mut checked = serde_json::to_vec(&header["layers"]).expect("JSON");
    checked.extend(payload);
    (header["version"], header["checksum"]) = (1.into(), crc32fast::hash(&checked).into());
    let mut old = serde_json::to_vec(&header).expect("JSON");
    old.push(b'\n');
    old.extend(payload);
    assert_eq!(SolvedModel::decode(&old), Ok(solved));
}

#[test]
fn a_model_file_cut_short_damaged_or_of_another_version_is_refused() {
    let bytes =
        SolvedModel::of(&choice(&lif(), 1, 3).expect("builds")).encode().expect("plain data");
    assert!(SolvedModel::recognises(&bytes) && SolvedModel::decode(&bytes).is_ok());
    let line = bytes.iter().position(|b| *b == b'\n').expect("a first line");
    for cut in [0, 1, line / 2, line, line + 1, bytes.len() / 2, bytes.len() - 1] {
        let error = SolvedModel::decode(&bytes[..cut]).expect_err("cut short").to_string();
        assert!(error.contains("expected"), "{cut}: {error}");
    }
    let cut = SolvedModel::decode(&bytes[..bytes.len() - 4]);
    assert!(matches!(cut, Err(SolvedError::Length { .. })), "{cut:?}");
    let mut longer = bytes.clone();
    longer.push(0);
    assert!(matches!(SolvedModel::decode(&longer), Err(SolvedError::Length { .. })));
    let mut damaged = bytes.clone();
    damaged[line + 100] ^= 4;
    assert!(matches!(SolvedModel::decode(&damaged), Err(SolvedError::Damaged)));
    let head = String::from_utf8_lossy(&bytes[..line]).into_owned();
    let with = |from: &str, to: &str| {
        let mut changed = head.replacen(from, to, 1).into_bytes();
        assert_ne!(changed, bytes[..line], "{from}");
        changed.extend(&bytes[line..]);
        SolvedModel::decode(&changed)
    };
    let newer = with("\"version\":2", "\"version\":3");
    assert!(matches!(newer, Err(SolvedError::Version { found: 3 })), "{newer:?}");
    assert!(matches!(with("symbolt-solved", "nengo"), Err(SolvedError::Format { .. })));
    // A header that fits the length of the file but not the network.
    for (from, to) in
        [("\"outputs\":1", "\"outputs\":2"), ("\"fingerprint\":1", "\"fingerprint\":2")]
    {
        assert!(with(from, to).is_err(), "{from}");
    }
    for neurons in ["0", "18446744073709551615", "10001"] {
        let huge = with("\"neurons\":100", &format!("\"neurons\":{neurons}"));
        assert!(matches!(huge, Err(SolvedError::Shape { .. })), "{neurons}: {huge:?}");
    }
    let many = with("\"ensembles\":3", "\"ensembles\":18446744073709551615");
    assert!(matches!(many, Err(SolvedError::Shape { .. })), "{many:?}");
}
