//! Valid files of every format that the program reads, how they are mutated, and their readers.

use std::io::Write;
use std::path::Path;

use ndarray::{Ix1, Ix2, Ix3};
use rand::RngExt;
use serde_json::{Value, json};
use symbolt::files::npz::{NpzReader, NpzWriter};
use symbolt::neurons::SolvedModel;
use symbolt::plan::strips::{self, Bodies, Problem, Trajectory};
use symbolt::report::{Arrays, RunFacts, report, trace};
use symbolt::sim::Seed;
use symbolt::study::experiment::Origin;
use symbolt::study::standard::{Model, Standard};
use symbolt::task::classify::Classifier;
use symbolt::task::compile;
use symbolt::task::domain::RelationalDomain;
use symbolt::task::learn::{Settings, learn};
use symbolt::task::planner::PlannerBuild;
use symbolt::task::tasks;
use symbolt::task::tasks::file::DataTask;
use symbolt::task::tasks::nuts_and_bolts::{NutsAndBolts, SyntheticDemonstrations};
use symbolt::task::{Recording, Snapshot};

use crate::mutate::Mutator;

type Make = Box<dyn Fn(&mut Mutator, &[u8], &[u8]) -> Vec<u8>>;
type Read = Box<dyn Fn(&[u8]) -> bool>;

pub struct Format {
    pub name: &'static str,
    pub seeds: Vec<Vec<u8>>,
    /// Whether the seeds are accepted as they are.
    pub sound: bool,
    /// Mutates a seed with pieces of another.
    pub make: Make,
    /// Reads the bytes; returns whether they are accepted.
    pub read: Read,
    /// Number of inputs of this format in proportion to the others.
    pub share: u64,
}

fn format(
    name: &'static str,
    share: u64,
    seeds: Vec<Vec<u8>>,
    read: impl Fn(&[u8]) -> bool + 'static,
) -> Format {
    let make: Make = Box::new(|mutator, seed, other| mutator.mutate(seed, other));
    Format { name, seeds, sound: true, make, read: Box::new(read), share }
}

/// Packs members into an archive with correct lengths and checksums, stored or deflated.
fn zipped(members: &[(String, Vec<u8>)], deflated: bool) -> Vec<u8> {
    let (mut bytes, mut directory) = (Vec::new(), Vec::new());
    for (name, content) in members {
        let at = bytes.len() as u32;
        let packed = if deflated {
            let level = flate2::Compression::fast();
            let mut encoder = flate2::write::DeflateEncoder::new(Vec::new(), level);
            encoder.write_all(content).unwrap();
            encoder.finish().unwrap()
        } else {
            content.clone()
        };
        let method: u16 = if deflated { 8 } else { 0 };
        let mut common = Vec::new();
        common.extend([20, 0, 0, 0]);
        common.extend(method.to_le_bytes());
        common.extend([0; 4]);
        common.extend(crc32fast::hash(content).to_le_bytes());
        common.extend((packed.len() as u32).to_le_bytes());
        common.extend((content.len() as u32).to_le_bytes());
        common.extend((name.len() as u16).to_le_bytes());
        common.extend([0, 0]);
        bytes.extend(b"PK\x03\x04");
        bytes.extend(&common);
        bytes.extend(name.bytes());
        bytes.extend(packed);
        directory.extend(b"PK\x01\x02\x14\x00");
        directory.extend(common);
        directory.extend([0; 10]);
        directory.extend(at.to_le_bytes());
        directory.extend(name.bytes());
    }
    let (start, length, count) = (bytes.len(), directory.len(), members.len() as u16);
    bytes.extend(directory);
    bytes.extend(b"PK\x05\x06\x00\x00\x00\x00");
    bytes.extend([count.to_le_bytes(), count.to_le_bytes()].concat());
    bytes.extend((length as u32).to_le_bytes());
    bytes.extend((start as u32).to_le_bytes());
    bytes.extend([0, 0]);
    bytes
}

/// Returns the members of an array file, as numpy writes them.
fn members() -> Vec<(String, Vec<u8>)> {
    let array = |descr: &str, shape: &str, numbers: Vec<u8>| {
        let dict =
            format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({shape}), }}\n");
        let length = (dict.len() as u16).to_le_bytes();
        [b"\x93NUMPY\x01\x00", &length[..], dict.as_bytes(), &numbers].concat()
    };
    let doubles = |count: usize| (0..count).flat_map(|i| (i as f64).to_le_bytes()).collect();
    let singles = |count: usize| (0..count).flat_map(|i| (i as f32).to_le_bytes()).collect();
    let arrays: [(&str, Vec<u8>); 8] = [
        ("frames_t", array("<f8", "3,", doubles(3))),
        ("frames_angles", array("<f4", "3, 7", singles(21))),
        ("frames_fingers", array("<f4", "3, 2", singles(6))),
        ("frames_parts", array("<f4", "3, 2, 7", singles(42))),
        ("modules_t", array("<f8", "3,", doubles(3))),
        ("module_goal", array("<f4", "3, 2", singles(6))),
        ("spikes_t", array("<f8", "2,", doubles(2))),
        ("spikes_row", array("<u4", "2,", vec![0; 8])),
    ];
    arrays.map(|(name, bytes)| (format!("{name}.npy"), bytes)).into()
}

fn read_arrays(bytes: &[u8]) -> bool {
    let Ok(mut npz) = NpzReader::new(bytes) else { return false };
    for name in npz.names() {
        let _ = npz.read::<u8, Ix1>(&name);
        let _ = npz.read::<f64, Ix3>(&name);
    }
    let Ok((arrays, odd)) = Arrays::from_npz(bytes) else { return false };
    let (fitting, others) = arrays.fitting(&facts(), Some(2));
    let (_, more) = fitting.lasting(2.0);
    odd.len() + others.len() + more.len() == 0
}

fn facts_json() -> Value {
    json!({
        "format": "symbolt-run", "version": 1, "symbolt": "0.1.0", "command": "symbolt run", "seed": 1,
        "goal": "BOLT_AT_NUT_POCKET", "mode": "direct", "planner": {"dimensions": 256},
        "task": "nuts-and-bolts", "scene": NutsAndBolts::default(), "scene_seed": 7, "filmed": 0,
        "summary": {"episodes": 1, "assembled": 1, "demonstrations": 2, "states": 5, "operators": 3},
        "modules": [{"name": "goal", "names": ["A", "B"], "shows": "similarities"}],
        "populations": [{"path": "goal/gate", "rows": 12, "neurons": 50}],
    })
}

fn facts() -> RunFacts {
    serde_json::from_value(facts_json()).expect("sound")
}

const TRACE: &str = r#"{"episode":0,"decision":{"asked_s":0.0,"took_ms":3.0,"holds":["A","B"],"action":"PUT","begun":false}}
{"episode":0,"decision":{"asked_s":1.0,"took_ms":3.0,"holds":["A"],"action":"PUT","begun":true,"skill":{"part":1,"outcome":"placed","picked":true,"slip_m":0.001}}}
{"episode":0,"decision":{"asked_s":2.0,"took_ms":3.0,"holds":["A"],"action":"PUT","begun":true}}
{"episode":0,"skill":{"part":1,"outcome":"dropped","picked":true,"slip_m":0.001}}
{"episode":0,"touch":{"t":1.5,"part":1,"contact":true}}
{"episode":0,"end":{"ended":"GoalMet","assembled":true,"simulated_s":2.0}}
"#;

const RESULTS: &str = r#"{"name":"x","question":"Why?","settings":{"seed":1},"cells":[
{"a":1,"rate":0.5,"successes":1,"trials":2,"interval95":[0.1,0.9]},{"a":2,"mean":1.5,"sd":null,"n":3,"interval95":null}]}"#;

const PROBLEM: &str = "(define (problem two) (:domain blocks) (:objects a b - block)
  (:init (clear a) (clear b) (on-table a) (on-table b) (hand-empty) (= (total-cost) 0))
  (:goal (and (on a b) (not (clear b)))))";

const TRAJECTORIES: [&str; 2] = [
    "(:trajectory (:state (clear a) (clear b) (on-table a) (on-table b) (hand-empty)) (:action (pick-up a))
  (:state (holding a) (clear b) (on-table b)) (:action (stack a b)) (:transition_status (success))
  (:state (clear a) (on a b) (on-table b) (hand-empty)))",
    "((:objects a b - block) (:init (clear a) (on-table a) (hand-empty)) ; two
  (operator: (pick-up a)) (:state (holding a)) (:action (put-down a)) (:transition_status (failure))
  (:state (holding a)))",
];

/// Mutates the first line or a record of a journal. All records have correct checksums.
fn journal(mutator: &mut Mutator, seed: &[u8], other: &[u8]) -> Vec<u8> {
    let end = seed.iter().position(|b| *b == b'\n').unwrap_or(0);
    let (line, records) = seed.split_at(end);
    match mutator.below(3) {
        0 => [mutator.mutate(line, other), records.to_vec()].concat(),
        1 => mutator.mutate(seed, other),
        _ => {
            let mut bytes = line.to_vec();
            bytes.push(b'\n');
            for _ in 0..mutator.below(6) {
                let record: [u8; 28] = mutator.rng.random();
                bytes.extend(record);
                bytes.extend(crc32fast::hash(&record).to_le_bytes());
            }
            bytes
        }
    }
}

fn journal_seed() -> Vec<u8> {
    let header = json!({
        "format": "symbolt-trials", "version": 1, "experiment": "x", "seed": 1,
        "settings": {"experiment": {"a": 1}, "revision": 1, "cells": [{"cell": {"b": 2}, "trials": 3}]},
        "shard": [0, 1], "width": 2,
    });
    let mut bytes = header.to_string().into_bytes();
    bytes.push(b'\n');
    for trial in 0..3u64 {
        let record = [&[0; 4][..], &trial.to_le_bytes(), &[0; 16]].concat();
        bytes.extend(&record);
        bytes.extend(crc32fast::hash(&record).to_le_bytes());
    }
    bytes
}

/// Mutates a model of solved populations. Half of the mutations get a correct checksum.
fn solved(mutator: &mut Mutator, seed: &[u8], other: &[u8]) -> Vec<u8> {
    let end = seed.iter().position(|b| *b == b'\n').unwrap_or(0);
    let (line, payload) = seed.split_at(end);
    let (mut line, mut payload) = (line.to_vec(), payload[1..].to_vec());
    match mutator.below(3) {
        0 => line = mutator.mutate(&line, other),
        1 => payload = mutator.mutate(&payload, other),
        _ => return mutator.mutate(seed, other),
    }
    if mutator.rng.random::<bool>()
        && let Ok(mut header) = serde_json::from_slice::<Value>(&line)
    {
        let mut hasher = crc32fast::Hasher::new();
        hasher.update(header["layers"].to_string().as_bytes());
        hasher.update(&payload);
        if let Some(header) = header.as_object_mut() {
            header.insert("checksum".into(), hasher.finalize().into());
        }
        line = header.to_string().into_bytes();
    }
    [line, vec![b'\n'], payload].concat()
}

fn strips_domain() -> strips::Domain {
    let text = include_bytes!("../fixtures/strips/blocks.pddl");
    strips::Domain::parse(text, "blocks", Bodies::Read).expect("sound")
}

fn recording() -> SyntheticDemonstrations {
    SyntheticDemonstrations { demos: 2, ..SyntheticDemonstrations::default() }
}

fn texts() -> Vec<Format> {
    let made = recording().record(Seed::new(1)).expect("sound");
    let labelled = made.recording.to_jsonl(Some(&made.labels)).expect("plain data");
    let failing = SyntheticDemonstrations { fail_rate: 0.4, nuts: 2, ..recording() };
    let failing = failing.record(Seed::new(2)).expect("sound").recording;
    let lines = failing.to_jsonl(None).expect("plain data");
    let scene = recording().scene(Seed::new(3)).expect("sound").to_json().expect("plain data");
    let plain = learn(&made.recording, &Settings::paper()).expect("it teaches").domain;
    let framed = learn(&made.recording, &Settings::default()).expect("it teaches").domain;
    let old = include_bytes!("../fixtures/domain_v1.json").to_vec();
    let plain = plain.to_json().expect("plain data").into_bytes();
    let framed = framed.to_json().expect("plain data").into_bytes();
    let recordings = vec![labelled.into_bytes(), lines.into_bytes()];
    vec![
        format("recording", 40, recordings, |bytes| Recording::parse(bytes, "x").is_ok()),
        format("scene", 20, vec![scene.into_bytes()], |bytes| Snapshot::parse(bytes, "x").is_ok()),
        format("domain", 60, vec![framed, plain, old], |bytes| {
            RelationalDomain::parse(bytes, "x").is_ok_and(|domain| {
                let _ = Classifier::new(&domain);
                domain.to_json().is_ok()
            })
        }),
    ]
}

fn settings() -> Vec<Format> {
    let files = [
        &include_bytes!("../../src/task/tasks/files/cup.json")[..],
        include_bytes!("../../src/task/tasks/files/drawer.json"),
        include_bytes!("../../src/task/tasks/files/flange.json"),
        include_bytes!("../../src/task/tasks/files/movable-jig.json"),
        include_bytes!("../../src/task/tasks/files/sorting.json"),
        include_bytes!("../../src/task/tasks/files/table-setting.json"),
        include_bytes!("../../src/task/tasks/files/tower.json"),
    ];
    let files = files.map(<[u8]>::to_vec).to_vec();
    let tasks = tasks::all().expect("all are valid");
    let plain: Vec<String> = tasks.iter().map(|task| task.settings().to_string()).collect();
    let plain = plain.into_iter().map(String::into_bytes).collect();
    let nuts = json!(NutsAndBolts::default()).to_string().into_bytes();
    let mut any = format("settings", 2, plain, move |bytes| {
        tasks.iter().filter(|task| task.with_settings(bytes, "x").is_ok()).count() > 0
    });
    any.sound = false;
    vec![
        format("task file", 7, files, |bytes| DataTask::parse(bytes, "x").is_ok()),
        format("nuts and bolts", 12, vec![nuts], |bytes| NutsAndBolts::parse(bytes, "x").is_ok()),
        any,
    ]
}

fn results() -> Vec<Format> {
    let facts = facts_json().to_string().into_bytes();
    let raw = vec![zipped(&members(), false), zipped(&members(), true), {
        let mut npz = NpzWriter::new();
        npz.add("frames_t", &ndarray::array![0.0f64, 1.0]).expect("added");
        npz.add("module_a", &ndarray::Array2::<f32>::zeros((2, 3))).expect("added");
        let _: Option<(Ix2, Ix3)> = None;
        npz.finish().expect("finished")
    }];
    let mut arrays = format("archive", 40, raw, read_arrays);
    arrays.sound = false;
    // The mutations reach the reader of headers: the archive around them is sound.
    let mut inner = format("array", 60, vec![zipped(&members(), false)], read_arrays);
    inner.make = Box::new(|mutator, _, _| {
        let mut members = members();
        for _ in 0..1 + mutator.below(2) {
            let (at, other) = (mutator.below(members.len()), mutator.below(members.len()));
            let other = members[other].1.clone();
            let header = members[at].1.len().min(90);
            members[at].1 = match mutator.below(3) {
                0 => mutator.mutate(&members[at].1, &other),
                _ if header < 10 => continue,
                // Only the dictionary, with a correct length.
                _ => {
                    let (head, numbers) = members[at].1.split_at(header);
                    let dict = mutator.mutate(&head[10..], &other);
                    let length = (dict.len().min(65_535) as u16).to_le_bytes();
                    [&head[..8], &length, &dict, numbers].concat()
                }
            };
        }
        let deflated = mutator.rng.random();
        zipped(&members, deflated)
    });
    vec![
        arrays,
        inner,
        format("trace", 30, vec![TRACE.into()], |bytes| trace::read(bytes).1.is_none()),
        format("run", 6, vec![facts], |bytes| {
            serde_json::from_slice::<RunFacts>(bytes)
                .is_ok_and(|facts| facts.draw_scene(facts.scene_seed).is_ok())
        }),
    ]
}

fn formal() -> Vec<Format> {
    let blocks = include_bytes!("../fixtures/strips/blocks.pddl").to_vec();
    let ferry = include_bytes!("../fixtures/strips/ferry.pddl").to_vec();
    let (domain, other) = (strips_domain(), strips_domain());
    vec![
        format("PDDL domain", 30, vec![blocks, ferry], |bytes| {
            let skipped = strips::Domain::parse(bytes, "x", Bodies::Skip).is_ok();
            strips::Domain::parse(bytes, "x", Bodies::Read).is_ok() && skipped
        }),
        format("PDDL problem", 20, vec![PROBLEM.into()], move |bytes| {
            Problem::parse(bytes, "x", &domain).is_ok()
        }),
        format("trajectory", 30, TRAJECTORIES.map(|t| t.into()).to_vec(), move |bytes| {
            Trajectory::parse(bytes, "x", &other).is_ok()
        }),
    ]
}

/// Formats whose readers take a folder.
fn folders() -> Vec<Format> {
    let place = tempfile::tempdir().expect("a folder");
    let write = |folder: &Path, name: &str, bytes: &[u8]| {
        std::fs::write(folder.join(name), bytes).expect("written");
    };
    let mut journal_format = format("journal", 4, vec![journal_seed()], move |bytes| {
        write(place.path(), "trials.bin", bytes);
        Origin::read(place.path()).is_ok()
    });
    journal_format.make = Box::new(journal);
    let [run, experiment] = [(), ()].map(|()| tempfile::tempdir().expect("a folder"));
    let seeds = vec![
        [b"r", facts_json().to_string().as_bytes()].concat(),
        [b"t", TRACE.as_bytes()].concat(),
        [&b"a"[..], &zipped(&members(), true)].concat(),
        [&b"d"[..], include_bytes!("../fixtures/domain_v1.json")].concat(),
        [&b"e"[..], RESULTS.as_bytes()].concat(),
    ];
    // The first byte says which file of the folder is mutated.
    let mut page = format("report", 1, seeds, move |bytes| {
        let Some((first, bytes)) = bytes.split_first() else { return false };
        if *first == b'e' {
            write(experiment.path(), "results.json", bytes);
            return report(experiment.path()).is_ok_and(|page| page.missing.is_empty());
        }
        write(run.path(), "run.json", facts_json().to_string().as_bytes());
        write(run.path(), "trace.jsonl", TRACE.as_bytes());
        write(run.path(), "arrays.npz", &zipped(&members(), true));
        write(run.path(), "domain.json", include_bytes!("../fixtures/domain_v1.json"));
        let name = match first {
            b'r' => "run.json",
            b't' => "trace.jsonl",
            b'a' => "arrays.npz",
            _ => "domain.json",
        };
        write(run.path(), name, bytes);
        report(run.path()).is_ok_and(|page| page.missing.len() == 1)
    });
    page.make = Box::new(|mutator, seed, other| {
        [seed[..1].to_vec(), mutator.mutate(&seed[1..], other)].concat()
    });
    page.sound = false;
    vec![journal_format, page]
}

/// Formats that are used after they are read.
fn used() -> Vec<Format> {
    let made = recording().record(Seed::new(1)).expect("sound").recording;
    let text = made.to_jsonl(None).expect("plain data").into_bytes();
    let scene = recording().scene(Seed::new(3)).expect("sound");
    let plain = learn(&made, &Settings::paper()).expect("it teaches").domain;
    let framed = learn(&made, &Settings::default()).expect("it teaches").domain;
    let plain = plain.to_json().expect("plain data").into_bytes();
    let framed = framed.to_json().expect("plain data").into_bytes();
    vec![
        format("learning", 4, vec![text], |bytes| {
            let Ok((recording, _)) = Recording::parse(bytes, "x") else { return false };
            let plain = learn(&recording, &Settings::paper()).is_ok();
            learn(&recording, &Settings::default()).is_ok() && plain
        }),
        format("problem", 4, vec![framed, plain], move |bytes| {
            let Ok(domain) = RelationalDomain::parse(bytes, "x") else { return false };
            let layout = Classifier::new(&domain).classify(&scene);
            let problem = compile::Problem::new(&domain, &layout);
            problem.is_ok_and(|problem| {
                let _ = problem.moves(&layout.situation());
                let build = PlannerBuild::default();
                build.plan(&problem, &layout, PlannerBuild::LIMIT).is_ok()
            })
        }),
    ]
}

/// Returns all formats.
pub fn formats() -> Vec<Format> {
    let spec = Standard { dimensions: 8, sim_ms: 300, ..Standard::default() };
    let (_, model) = Model::ALL[0];
    let solved_seed = spec.build(model).expect("it builds").solved().encode().expect("plain data");
    let mut models =
        format("model", 4, vec![solved_seed], |bytes| SolvedModel::decode(bytes).is_ok());
    models.make = Box::new(solved);
    let mut all = texts();
    all.extend(settings());
    all.extend(results());
    all.extend(formal());
    all.push(models);
    all.extend(folders());
    all.extend(used());
    all
}
