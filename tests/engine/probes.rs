//! Probes by path, recorded spikes, and their export.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::ops::ControlFlow;

use symbolt::files::npz::NpzReader;
use symbolt::prelude::*;

symbolt::vocabulary!(Things = "things": RED, BLUE);

fn lif() -> PopulationPlan {
    PopulationPlan::lif()
}

fn ms(ms: u64) -> SimDuration {
    SimDuration::from_millis(ms)
}

/// A state that sees RED.
fn describe() -> GraphBuilder {
    let things = Things::vocabulary(32, Seed::new(1)).unwrap();
    let mut graph = GraphBuilder::new();
    let seen = graph.add("seen", things.stimulus([(0, "RED")]).unwrap());
    let state = graph.add("state", State::new(&things));
    graph.route(&seen >> &state);
    graph
}

#[test]
fn a_probe_by_path_has_the_samples_of_a_probe_by_handle() {
    let things = Things::vocabulary(32, Seed::new(1)).unwrap();
    let mut graph = GraphBuilder::new();
    let seen = graph.add("seen", things.stimulus([(0, "RED")]).unwrap());
    let state = graph.add("state", State::new(&things));
    graph.route(&seen >> &state);
    let probes = [
        graph.probe(&state.output, ProbeSpec::default()),
        graph.probe_at::<Pointer<Things>>("state.output", ProbeSpec::default()),
        graph.probe_at("state", ProbeSpec::default()),
        graph.probe_at("state/output.out", ProbeSpec::default()),
        graph.probe_at("seen", ProbeSpec::default()),
    ];
    let sim = graph.run(&lif(), Seed::new(1), ms(30)).unwrap();
    let all = probes.map(|probe| {
        sim.samples(&probe).iter().map(|(_, value)| value.to_vec()).collect::<Vec<_>>()
    });
    assert_eq!(all[0].len(), 30);
    assert!(all[1..4].iter().all(|other| *other == all[0]));
    assert!(all[4] != all[0]);
    let names: Vec<String> = sim.recordings().values().map(|(name, _)| name.to_owned()).collect();
    assert_eq!(names[..2], ["state.output", "state.output-2"]);
    assert_eq!(names[4], "seen.out");
}

#[test]
fn faults_of_probes_list_what_there_is() {
    let mut graph = describe();
    graph.probe_at::<Pointer<Things>>("stat", ProbeSpec::default());
    graph.probe_at::<Scalar>("state", ProbeSpec::default());
    graph.probe_spikes("state/populatoin");
    graph.probe_spikes("seen");
    let error = graph.build(Timebase::default(), &lif(), Seed::new(1)).err().unwrap();
    let text = error.to_string();
    for expected in [
        "there is no output `stat` of kind pointer of things; the outputs are: `state.output: pointer of things`",
        "there is no output `state` of kind scalar; the outputs are: `state.output: pointer of things`",
        "there is no layer `state/populatoin`; the layers are: `state/population`",
        "there is no layer `seen`; the layers are: `state/population`",
    ] {
        assert!(text.contains(expected), "{expected}\nis not in\n{text}");
    }
}

/// A node with three units, of which one has an event in each tick.
struct Clock;

impl symbolt::sim::Node for Clock {
    fn declare(&self, ports: &mut symbolt::sim::PortDecl) {
        ports.output("out", symbolt::sim::OutputSpec::scalar());
    }

    fn fingerprint(&self, _hash: &mut symbolt::sim::Fingerprint) {}

    fn emit(&self, cx: &symbolt::sim::StepCx<'_>, io: &mut symbolt::sim::EmitIo<'_>) {
        io.outputs.set(0, cx.tick() as f32);
    }

    fn units(&self) -> usize {
        3
    }

    fn event(&self, _state: &symbolt::sim::StateRef<'_>, unit: usize) -> bool {
        unit == 1
    }
}

#[test]
fn spikes_are_found_by_module_and_events_of_own_nodes_are_recorded() {
    let mut graph = describe();
    graph.node("clock", Clock);
    let [whole, module] = ["state/population", "state"].map(|path| graph.probe_spikes(path));
    let clock = graph.probe_spikes("clock");
    let sim = graph.run(&lif(), Seed::new(1), ms(20)).unwrap();
    let [whole, module] =
        [whole, module].map(|probe| sim.spikes(&probe).iter().collect::<Vec<_>>());
    assert!(whole.len() > 100 && whole == module);
    assert_eq!(sim.spikes(&clock).iter().map(|(_, unit)| unit).collect::<Vec<_>>(), [1; 20]);
}

#[test]
fn functions_of_an_ensemble_are_found_by_name() {
    let mut graph = GraphBuilder::new();
    let twice = |x: &[f32], out: &mut [f32]| out[0] = 2.0 * x[0];
    let point = graph.add("point", Ensemble::new(1).identity("same").decode("twice", 1, twice));
    let half = graph.add("half", Constant::vector(&[0.5]));
    graph.route(&half >> &point.input);
    let probe = graph.probe_at::<Vector>("point.twice", ProbeSpec::default());
    let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), ms(2)).unwrap();
    assert_eq!(sim.samples(&probe).last().unwrap().1[0], 1.0);
    for name in ["point.twice", "point/neurons.twice"] {
        assert_eq!(sim.value_of(sim.graph().output(name).unwrap()), [1.0]);
    }
}

#[test]
fn recorded_spikes_are_those_of_the_neurons() {
    let mut graph = describe();
    let probe = graph.probe_spikes("state/population");
    let mut sim = graph.start(&lif(), Seed::new(1)).unwrap();
    let (path, source) = {
        let (path, source) = sim.graph().event_sources().next().unwrap();
        (path.to_owned(), source)
    };
    assert_eq!(path, "state/population");
    let mut expected = Vec::new();
    sim.run_until(ms(100), |view| {
        for unit in (0..source.units).filter(|unit| view.event(source, *unit)) {
            expected.push((view.tick() as f64 * 1e-3, unit));
        }
        ControlFlow::Continue(())
    })
    .unwrap();
    let spikes = sim.spikes(&probe);
    assert_eq!(spikes.neurons(), 1_600);
    assert!(expected.len() > 1_000, "{}", expected.len());
    assert_eq!(spikes.iter().collect::<Vec<_>>(), expected);
    assert_eq!(spikes.count(), expected.len());
    let rate = expected.len() as f64 / 0.1 / 1_600.0;
    assert!((spikes.mean_rate_hz() - rate).abs() < 1e-9);
    sim.reset().unwrap();
    assert_eq!(sim.spikes(&probe).count(), 0);
    // Without spiking neurons there is nothing to record.
    let mut graph = describe();
    let other = graph.probe_spikes("state/population");
    let direct = graph.run(&PopulationPlan::direct(), Seed::new(1), ms(20)).unwrap();
    assert_eq!((direct.spikes(&other).neurons(), direct.spikes(&other).count()), (0, 0));
    assert_eq!(direct.spikes(&probe).count(), 0, "a handle of another graph");
}

#[test]
fn recordings_are_written_for_numpy_and_as_tables() {
    let mut graph = describe();
    let state = graph.probe_at::<Pointer<Things>>("state", ProbeSpec::every(ms(2)));
    let seen = ProbeSpec::every(ms(5)).last(3);
    graph.probe_at::<Pointer<Things>>("seen", seen);
    let spikes = graph.probe_spikes("state/population");
    let sim = graph.run(&lif(), Seed::new(1), ms(30)).unwrap();
    let bytes = sim.recordings().to_npz().unwrap();
    let mut archive = NpzReader::new(&bytes).unwrap();
    assert_eq!(archive.names().len(), 6);
    let times: ndarray::Array1<f64> = archive.read("state.output.time_s").unwrap();
    let values: ndarray::Array2<f32> = archive.read("state.output.values").unwrap();
    assert_eq!((times.len(), values.dim()), (15, (15, 32)));
    let (time, last) = sim.samples(&state).last().unwrap();
    assert_eq!(times[14], time);
    assert_eq!(values.row(14).to_vec(), last.to_vec());
    let late: ndarray::Array1<f64> = archive.read("seen.out.time_s").unwrap();
    assert_eq!(late.to_vec(), [0.02, 0.025, 0.03]);
    let neurons: ndarray::Array1<u32> = archive.read("state/population.spike_neuron").unwrap();
    assert_eq!(neurons.len(), sim.spikes(&spikes).count());
    assert!(neurons.len() > 100);

    let recordings = sim.recordings();
    let table = recordings.values_csv();
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    // Every even millisecond, and 25 ms; 20 and 30 ms are in both.
    assert_eq!((rows.len(), rows[0].len()), (1 + 15 + 1, 1 + 32 + 32));
    assert!(rows.iter().all(|row| row.len() == 65));
    let at = |time: &str| rows.iter().find(|row| row[0] == time).unwrap();
    assert!(at("0.02")[1..].iter().all(|cell| !cell.is_empty()));
    assert!(at("0.025")[1..33].iter().all(|cell| cell.is_empty()));
    assert!(at("0.025")[33..].iter().all(|cell| !cell.is_empty()));
    assert!(at("0.002")[33..].iter().all(|cell| cell.is_empty()));
    assert_eq!(recordings.spikes_csv().lines().count(), 1 + neurons.len());
    let nothing = describe().run(&lif(), Seed::new(1), ms(2)).unwrap();
    assert_eq!(nothing.recordings().values_csv(), "time_s\n");
}

#[test]
fn a_page_shows_any_graph() {
    use symbolt::record::RunPage;
    let things = Things::vocabulary(32, Seed::new(1)).unwrap();
    let mut graph = describe();
    let similarity = graph.add("similarity", Add::scalar());
    graph.probe_spikes("state/population");
    let state = graph.probe_at::<Pointer<Things>>("state", ProbeSpec::default());
    graph.probe(&similarity.output, ProbeSpec::default());
    let one = graph.add("one", Constant::scalar(0.5));
    graph.route(&one >> &similarity);
    let sim = graph.run(&lif(), Seed::new(1), ms(60)).unwrap();
    let seen = things.similarities(sim.samples(&state), Things::NAMES).unwrap();
    let page = RunPage::new("<RED>", &sim).chart("what is seen", &seen);
    let page = page.against("seen again", &seen, &seen).html();
    assert!(!page.contains("<RED>") && page.len() < 1_000_000, "{}", page.len());
    let begin = page.find("id=\"data\">").unwrap() + "id=\"data\">".len();
    let end = begin + page[begin..].find("</script>").unwrap();
    let data: serde_json::Value = serde_json::from_str(&page[begin..end]).unwrap();
    assert_eq!(data["title"], "<RED>");
    let told = |plot: &serde_json::Value| {
        let names = plot["curves"]["names"].as_array().unwrap().len();
        (plot["kind"].as_str().unwrap().to_owned(), names, plot["curves"]["unit"].to_string())
    };
    let told: Vec<_> = data["plots"].as_array().unwrap().iter().map(told).collect();
    let many = Things::NAMES.len();
    let expected = [
        ("chart", many, "similarity"),
        ("chart", many, "similarity"),
        ("output", 1, "norm"),
        ("output", 1, "value"),
        ("rate", 1, "spikes per second"),
    ];
    assert_eq!(told, expected.map(|(kind, n, unit)| (kind.to_owned(), n, format!("\"{unit}\""))));
    assert_eq!(
        (&data["plots"][0]["rms"], &data["plots"][1]["rms"]),
        (&serde_json::Value::Null, &0.0.into())
    );
    let spikes = &data["spikes"]["populations"][0];
    assert_eq!((&spikes["path"], &spikes["neurons"]), (&"state/population".into(), &1600.into()));
    assert_eq!(spikes["rows"], 100, "evenly spaced neurons");
    let graph = &data["graph"];
    let nodes = graph["nodes"].as_array().unwrap();
    assert_eq!(nodes.len(), sim.graph().node_count());
    let population = serde_json::json!({"path": "state/population", "neurons": 1600, "source": false, "outputs": [{"name": "state/population.out", "width": 32}]});
    assert!(nodes.contains(&population), "{graph}");
    let edges = graph["edges"].as_array().unwrap();
    assert_eq!(edges.len(), sim.graph().edge_count());
    assert!(
        edges.iter().any(|edge| edge["synapse"].as_str().is_some_and(|via| via.ends_with("ms"))),
        "{graph}"
    );
    assert_eq!(data["simulated_s"], 0.06);
    let raster = sim.recordings().spikes().map(|(_, spikes)| spikes.to_svg("S")).next().unwrap();
    let marks = raster.rsplit("<path").next().unwrap().matches('M').count();
    assert!((50..5_000).contains(&marks), "{marks} marks of some 100 neurons");
    let silent = graph_without_spikes();
    assert!(silent.starts_with("<svg") && silent.contains("d=\"\""));
}

/// The raster of a layer in direct mode, which has no neurons.
fn graph_without_spikes() -> String {
    let mut graph = describe();
    let spikes = graph.probe_spikes("state/population");
    let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), ms(5)).unwrap();
    sim.spikes(&spikes).to_svg("none")
}

#[test]
fn the_modules_are_drawn_up_to_a_limit() {
    let graph_of = |modules: usize| {
        let mut graph = GraphBuilder::new();
        for index in 0..modules {
            graph.add(&format!("m{index}"), Constant::scalar(0.0));
        }
        graph.start(&PopulationPlan::direct(), Seed::new(1)).unwrap().graph().to_svg()
    };
    assert_eq!(graph_of(41), None);
    let drawing = graph_of(40).unwrap();
    assert!((0..40).all(|index| drawing.contains(&format!(">m{index}<"))));
    let mut graph = describe();
    graph.add("other", Constant::scalar(0.0));
    let drawing = graph.start(&lif(), Seed::new(1)).unwrap().graph().to_svg().unwrap();
    assert_eq!(drawing.matches("<rect").count(), 3, "one box for each module");
    assert_eq!(drawing.matches("marker-end").count(), 1, "no arrow inside the module");
}

#[test]
fn names_in_tables_are_quoted_where_they_need_it() {
    let mut graph = GraphBuilder::new();
    let input = graph.add("input", Constant::vector(&[0.5, 1.0]));
    let probe = graph.probe(&input, ProbeSpec::default());
    let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), ms(1)).unwrap();
    let table = sim.recordings().values_csv();
    assert_eq!(table, "time_s,input.out[0],input.out[1]\n0.001,0.5,1\n");
    let series = sim.samples(&probe).series(["x, \"y\""]);
    assert_eq!(series.to_csv(), "time_s,\"x, \"\"y\"\"\",1\n0.001,0.5,1\n");
}

#[test]
fn an_output_that_two_modules_expose_is_found_by_both_names() {
    let things = Things::vocabulary(32, Seed::new(1)).unwrap();
    let mut graph = GraphBuilder::new();
    let seen = graph.add("seen", things.stimulus([(0, "RED")]).unwrap());
    let rules = Rules::new().rule("red", seen.dot(Things::RED), []).otherwise("wait", 0.5, []);
    graph.add("rules", rules);
    let probes = ["rules.chosen", "rules/choice.chosen"]
        .map(|name| graph.probe_at::<Vector>(name, ProbeSpec::default()));
    let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), ms(50)).unwrap();
    let [outer, inner] = probes.map(|probe| sim.samples(&probe).last().unwrap().1.to_vec());
    assert!(outer[0] > 0.9, "{outer:?}");
    assert_eq!(outer, inner);
    assert!(sim.graph().output("rules/choice.chosen").is_ok());
}

#[test]
fn the_name_that_was_meant_is_the_first_choice() {
    let mut graph = describe();
    for index in 0..20 {
        graph.add(&format!("a{index}"), Constant::scalar(0.0));
    }
    graph.probe_at::<Pointer<Things>>("satte.output", ProbeSpec::default());
    let error = graph.build(Timebase::default(), &lif(), Seed::new(1)).err().unwrap().to_string();
    assert!(error.contains("the outputs are: `state.output: pointer of things`"), "{error}");
}
