//! The command line, as a user and a script meet it.

#![allow(clippy::unwrap_used, clippy::expect_used)]
#![cfg(feature = "cli")]

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Output;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use assert_cmd::Command;
use serde_json::Value;
use symbolt::sim::{Real, RunConfig, Seed, SimDuration, Simulator, World, WorldError, WorldSave};
use symbolt::task::domain::RelationalDomain;
use symbolt::task::planner::{Decider, Planner, PlannerSpec};

use crate::propositional::propositional;

fn symbolt(folder: &Path, args: &[&str]) -> Output {
    Command::cargo_bin("symbolt")
        .expect("the program was built")
        .current_dir(folder)
        .args(args)
        .output()
        .expect("it starts")
}

struct Ran {
    code: i32,
    out: String,
    err: String,
}

fn run(folder: &Path, args: &[&str]) -> Ran {
    let output = symbolt(folder, args);
    Ran {
        code: output.status.code().unwrap_or(-1),
        out: String::from_utf8_lossy(&output.stdout).into(),
        err: String::from_utf8_lossy(&output.stderr).into(),
    }
}

fn ok(folder: &Path, args: &[&str]) -> String {
    let ran = run(folder, args);
    assert_eq!(ran.code, 0, "{args:?}: {}", ran.err);
    ran.out
}

fn json(folder: &Path, args: &[&str]) -> Value {
    serde_json::from_str(&ok(folder, args)).expect("one JSON object")
}

fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .expect("a folder")
        .filter_map(|e| e.ok()?.file_name().into_string().ok())
        .collect();
    names.sort();
    names
}

#[test]
fn a_scene_that_cannot_be_is_refused_before_anything_is_done() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    ok(here, &["config", "--out", "cell.json"]);
    let cell = std::fs::read_to_string(here.join("cell.json")).expect("written");
    let wide = cell.replace("\"shaft_radius_m\": 0.008", "\"shaft_radius_m\": 0.02");
    assert_ne!(wide, cell);
    std::fs::write(here.join("wide.json"), wide).expect("written");
    let cases: [(&[&str], &str); 6] = [
        (&["run", "--config", "wide.json"], "wide.json, field `part.nut_hole_m`"),
        (&["record", "--config", "nowhere.json"], "cannot read nowhere.json"),
        (&["run", "--config", "cell.json", "--nuts", "100"], "symbolt: --nuts 100: must be 1 to 4"),
        (&["run", "--nuts", "0"], "--nuts 0: must be 1 to 4"),
        (&["run", "--demo-bolts", "9"], "--demo-bolts 9: must be 1 to 4"),
        (&["run", "--drop-rate", "2"], "--drop-rate 2: must be 0 to 1"),
    ];
    for (args, message) in cases {
        let ran = run(here, args);
        assert_eq!(ran.code, 2, "{args:?}: {}", ran.err);
        assert!(ran.err.contains(message), "{args:?}: {}", ran.err);
    }
    assert_eq!(files(here), ["cell.json", "wide.json"]);
    let scene = ok(here, &["record", "--scene", "--config", "cell.json"]);
    assert_eq!(scene, ok(here, &["record", "--scene"]));
}

/// A folder with a recording, a scene, and the domains of both learners.
fn prepared() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    ok(
        folder.path(),
        &["record", "--kinematic", "--demos", "3", "--out", "demos.jsonl", "--quiet"],
    );
    ok(
        folder.path(),
        &["record", "--kinematic", "--scene", "--seed", "9", "--out", "scene.json", "--quiet"],
    );
    ok(folder.path(), &["learn", "demos.jsonl", "--out", "domain.json", "--quiet"]);
    let paper = ["learn", "demos.jsonl", "--method", "paper", "--out", "paper.json", "--quiet"];
    ok(folder.path(), &paper);
    folder
}

#[test]
fn without_a_command_the_main_job_runs_and_can_be_repeated() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = ok(folder.path(), &["--demos", "2"]);
    for part in [
        "states, positions in metres",
        "3 actions:",
        "goal met",
        "1 of 1",
        "Wrote out/recording.jsonl",
    ] {
        assert!(text.contains(part), "{part} in {text}");
    }
    let domain = folder.path().join("out/domain.json");
    fits(&text, &names(&domain));
    let left = [
        "arrays.npz",
        "domain.json",
        "recording.jsonl",
        "report.html",
        "run.json",
        "scene.json",
        "trace.jsonl",
    ];
    let out = files(&folder.path().join("out"));
    assert_eq!((out[0].as_str(), &out[1..]), (".gitignore", &left.map(String::from)[..]));
    let bytes = |name: &str| std::fs::read(folder.path().join("out").join(name)).expect("there");
    let before = left.map(bytes);
    // A folder that was named is not written over unasked.
    let refused = run(folder.path(), &["run", "--out", "out"]);
    assert_eq!(refused.code, 2);
    assert!(refused.err.contains("exists already; choose another name or add --force"));
    // A file of the user's own in the folder stays.
    std::fs::write(folder.path().join("out/notes.txt"), "mine").expect("writes");
    let found = json(folder.path(), &["--demos", "2", "--quiet", "--json", "--threads", "1"]);
    assert_eq!(left.map(bytes), before, "the same seed gives the same files in another process");
    for key in ["interval95", "minimum_steps", "false_goals", "drops", "replans", "failures"] {
        assert!(!found[key].is_null(), "{key} in {found}");
    }
    assert_eq!((&found["episodes"], &found["assembled"]), (&1.into(), &1.into()));
    assert_eq!(found["few_trials"], true, "the interval of one episode says little");
    for key in ["real_time_factor", "physics_real_time_factor"] {
        assert!(found[key].as_f64().is_some_and(|f| f > 0.0), "{key} in {found}");
    }
    for key in ["median", "p95"] {
        assert!(found["decision_ms"][key].as_f64().is_some_and(|ms| ms > 0.0), "{found}");
    }
    let mut kinds = BTreeSet::new();
    for line in String::from_utf8(bytes("trace.jsonl")).expect("text").lines() {
        let line: Value = serde_json::from_str(line).expect("JSON");
        kinds.extend(line.as_object().expect("an object").keys().cloned());
        if let Some(decision) = line.get("decision").filter(|d| d["begun"] == true) {
            assert_eq!(decision["skill"]["outcome"], "placed", "a decision owns its skill");
        }
    }
    let expected = ["decision", "end", "episode", "touch"].map(String::from);
    assert_eq!(kinds, BTreeSet::from(expected));
    assert_eq!(bytes("notes.txt"), b"mine");

    // A plan counts from the moment at which the goal is told; a run's planner knows it when it is asked.
    let plan = ["plan", "out/domain.json", "--scene", "out/scene.json", "--json", "--quiet"];
    let plan = json(folder.path(), &plan);
    let from_rest = plan["decision_ms"].as_f64().expect("a number");
    let trace = String::from_utf8(bytes("trace.jsonl")).expect("text");
    let first: Value = serde_json::from_str(trace.lines().next().expect("a line")).expect("JSON");
    let goal_known = first["decision"]["took_ms"].as_f64().expect("a number");
    assert!((8.0..40.0).contains(&(from_rest - goal_known)), "{from_rest} {goal_known}");
    assert_eq!(first["decision"]["chosen"]["operator"], plan["action"]);
    assert_eq!(first["decision"]["chosen"]["object"], plan["object"]);
    assert!(text.replace('\n', " ").contains("prints a little more: there the planner"), "{text}");
}

/// The names of all states and actions of a domain file.
fn names(domain: &Path) -> BTreeSet<String> {
    let text = std::fs::read_to_string(domain).expect("there");
    let domain: Value = serde_json::from_str(&text).expect("JSON");
    let lists = [&domain["states"], &domain["operators"]];
    let entries = lists.into_iter().flat_map(|list| list.as_array().expect("a list"));
    entries.map(|entry| entry["name"].as_str().expect("a name").to_owned()).collect()
}

/// Checks that no line has more than 80 columns and that no name is broken.
fn fits(text: &str, names: &BTreeSet<String>) {
    for line in text.lines() {
        assert!(line.chars().count() <= 80, "{line}\nin\n{text}");
    }
    let like_a_name = |word: &&str| {
        word.contains('_') && word.chars().all(|c| c.is_ascii_uppercase() || c == '_')
    };
    let words = text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
    for word in words.filter(like_a_name) {
        assert!(names.contains(word), "{word} is no name, in\n{text}");
    }
}

#[test]
fn every_table_fits_80_columns_and_breaks_no_name() {
    let folder = prepared();
    let path = folder.path();
    let domain = names(&path.join("domain.json"));
    let noisy = ["record", "--kinematic", "--demos", "6", "--demo-nuts", "3", "--demo-bolts", "3"];
    let noisy = [&noisy[..], &["--fail-rate", "0.4", "--out", "noisy.jsonl"]].concat();
    fits(&ok(path, &noisy), &domain);
    let learned = ok(path, &["learn", "noisy.jsonl", "--out", "noisy.json"]);
    assert!(learned.contains("attempts failed:"), "{learned}");
    assert!(learned.contains("Conditions before each action"), "{learned}");
    let noisy = ["learn", "noisy.jsonl", "--method", "paper", "--out", "noisy_paper.json"];
    let learned = ok(path, &noisy);
    for part in ["attempts failed:", "Conditions before each action", "Clustering thresholds"] {
        assert!(learned.contains(part), "{learned}");
    }
    fits(&learned, &names(&path.join("noisy_paper.json")));
    fits(&ok(path, &["learn", "noisy.jsonl"]), &names(&path.join("noisy.json")));
    let paper = names(&path.join("paper.json"));
    fits(&ok(path, &["learn", "demos.jsonl", "--method", "paper"]), &paper);
    for args in [
        &["learn", "demos.jsonl"][..],
        &["classify", "domain.json", "demos.jsonl"],
        &["actions", "domain.json", "--scene", "scene.json"],
        &["config", "--task"],
        &["check", "domain.json"],
        &["experiment"],
        &["bench", "select", "--sim-seconds", "0.3", "--runs", "1", "--neurons-scale", "0.2"],
    ] {
        fits(&ok(path, args), &domain);
    }
    // A plan also names the facts and actions of its scene.
    let planned = |file: &str, known: &BTreeSet<String>| {
        let args = ["plan", file, "--scene", "scene.json"];
        let whole = ok(path, &[&args[..], &["--json"]].concat());
        let words = whole.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
        let own = words.map(str::to_owned).chain(known.iter().cloned()).collect();
        fits(&ok(path, &args), &own);
    };
    planned("domain.json", &domain);
    planned("paper.json", &paper);
    // Longer names of a user's own, up to some that fit no table.
    for long in ["THE_BOLT_STANDS_IN_ITS_HOLE", "THE_BOLT_STANDS_UPRIGHT_IN_THE_HOLE_OF_THE_JIG"] {
        let action = format!("BOLT_AT_BOLT_HOLE={long}");
        let renames = ["rename", "domain.json", &action, "--out", "long.json", "--force"];
        let printed = ok(path, &renames);
        assert!(printed.contains(long), "{printed}");
        let all = names(&path.join("long.json"));
        fits(&printed, &all);
        planned("long.json", &all);
        fits(&ok(path, &["actions", "long.json", "--scene", "scene.json"]), &all);
        fits(&ok(path, &["classify", "long.json", "demos.jsonl"]), &all);
    }
}

#[test]
fn a_folder_that_no_run_wrote_is_kept_unless_forced() {
    let folder = tempfile::tempdir().expect("a folder");
    let (path, out) = (folder.path(), folder.path().join("out"));
    std::fs::create_dir(&out).expect("makes");
    let refused = |message: &str| {
        let before = files(&out);
        let ran = run(path, &["--demos", "1"]);
        assert_eq!((ran.code, ran.out.as_str()), (2, ""), "{}", ran.err);
        assert!(ran.err.contains(message), "{}", ran.err);
        assert!(ran.err.contains("choose another folder with --out, or add --force"));
        assert_eq!(ran.err.lines().count(), 1, "refused before any work: {}", ran.err);
        assert_eq!(files(&out), before);
    };
    std::fs::write(out.join("index.html"), "mine").expect("writes");
    refused("the folder out holds files but no run.json");
    std::fs::write(out.join("run.json"), r#"{"format": "other"}"#).expect("writes");
    refused("out/run.json was not written by `symbolt run`");
    // More of everything, so that each part of the text is printed.
    let many = ["--demos", "1", "--episodes", "2", "--nuts", "2", "--bolts", "2"];
    let more = ["--drop-rate", "0.5", "--force", "--quiet", "--method", "paper"];
    let ran = run(path, &[&many[..], &more].concat());
    assert!(ran.out.contains("2 episodes. Their goal: "), "{} {}", ran.out, ran.err);
    assert!(ran.out.contains("step that broke off"), "{}", ran.out);
    fits(&ran.out, &names(&out.join("domain.json")));
    assert_eq!(std::fs::read_to_string(out.join("index.html")).expect("there"), "mine");
    let facts = std::fs::read_to_string(out.join("run.json")).expect("there");
    assert!(facts.contains("symbolt-run"));
}

#[test]
fn a_threshold_has_a_unit_and_an_absurd_one_is_explained() {
    let folder = prepared();
    let learn = |threshold: &str| {
        run(folder.path(), &["learn", "demos.jsonl", "--quiet", "--threshold", threshold])
    };
    let metres = learn("0.001169");
    assert_eq!((metres.code, metres.err.as_str()), (0, ""));
    assert!(metres.out.contains("|        1.169 |"), "{}", metres.out);
    for same in ["1.169mm", "0.001169m", "1.169 mm", "0.1169cm", "1169um", "1169µm"] {
        assert_eq!(learn(same).out, metres.out, "{same}");
    }
    for never in ["-1", "0", "0mm", "nan", "inf", "mm", "", "1 inch", "1e999", "1.1.1mm"] {
        let refused = learn(never);
        assert_eq!(refused.code, 2, "{never}");
        assert!(refused.err.contains("must be a length above 0"), "{never}: {}", refused.err);
    }
    let mistaken = learn("1.169");
    assert_eq!((mistaken.code, mistaken.out.as_str()), (2, ""));
    assert!(mistaken.err.contains("for millimetres write 1.169mm"), "{}", mistaken.err);
    let meant = learn("1.169m");
    assert_eq!(meant.code, 1);
    for kind in ["bolt", "nut"] {
        let warning = format!(
            "symbolt: warning: no state was found for `{kind}`: the threshold of 1169.000 mm is \
             probably too large"
        );
        assert!(meant.err.contains(&warning), "{}", meant.err);
    }
    assert!(meant.out.contains("1169.000"), "{}", meant.out);
}

/// A world that shows a planner graph its goal at first and the scene and the question later.
struct Asking {
    senses: [Vec<Real>; 2],
    period_ms: u64,
    asked: u64,
    step: u64,
    actions: usize,
    answered: Arc<AtomicU64>,
}

impl World for Asking {
    fn period(&self) -> SimDuration {
        SimDuration::from_millis(self.period_ms)
    }

    fn sense_width(&self) -> usize {
        self.senses[0].len()
    }

    fn command_width(&self) -> usize {
        self.actions + 5
    }

    fn sense(&self, out: &mut [Real]) {
        out.copy_from_slice(&self.senses[usize::from(self.step >= self.asked)]);
    }

    fn advance(&mut self, command: &[Real]) -> Result<(), WorldError> {
        self.step += 1;
        if command[..self.actions].iter().any(|a| *a > 0.5) {
            let took = (self.step - self.asked) * self.period_ms;
            let _ = self.answered.compare_exchange(0, took, Ordering::Relaxed, Ordering::Relaxed);
        }
        Ok(())
    }

    fn reset(&mut self, _seed: Seed) -> Result<(), WorldError> {
        self.step = 0;
        Ok(())
    }

    fn save(&self) -> Result<WorldSave, WorldError> {
        Err(WorldError::new("not needed"))
    }

    fn restore(&mut self, _saved: &WorldSave) -> Result<(), WorldError> {
        Err(WorldError::new("not needed"))
    }
}

#[test]
fn a_planner_that_knows_its_goal_decides_sooner() {
    let folder = prepared();
    let learned = RelationalDomain::read(&folder.path().join("paper.json")).expect("valid");
    let domain = propositional(&learned);
    let planner = Planner::new(&domain, PlannerSpec::default(), Seed::new(1)).expect("builds");
    let world = domain.world(["NUT_AT_START", "BOLT_AT_START"]).expect("states");
    let goal = domain.state("BOLT_AT_NUT_POCKET").expect("a state");
    let took = |goal_shown_ms: u64, period_ms: u64| {
        let pointer = planner.encoded().states.get("BOLT_AT_NUT_POCKET").expect("a pointer");
        let sense = |asked: bool| {
            let flags = world.flags().iter().map(|holds| Real::from(*holds && asked));
            let goal = pointer.iter().copied();
            std::iter::once(Real::from(asked)).chain(flags).chain(goal).collect()
        };
        let answered = Arc::new(AtomicU64::new(0));
        let asking = Asking {
            senses: [sense(false), sense(true)],
            period_ms,
            asked: goal_shown_ms / period_ms,
            step: 0,
            actions: domain.operators().len(),
            answered: answered.clone(),
        };
        let config = RunConfig::default().in_world(asking);
        let mut sim = Simulator::new(planner.graph().clone(), config).expect("fits");
        sim.run_for(SimDuration::from_millis(500)).expect("runs");
        answered.load(Ordering::Relaxed)
    };
    let from_rest = planner.decide(&world, goal).expect("decides").time_ms;
    assert_eq!((from_rest, took(0, 1)), (324.0, 324));
    assert_eq!(took(24, 1), 310, "the goal was recognised before the question");
    assert_eq!(took(24, 4), 312, "as in a run: in whole steps of the physics");
}

#[test]
fn learn_gives_the_promised_keys() {
    let folder = prepared();
    let found = json(folder.path(), &["learn", "demos.jsonl", "--json"]);
    let nothing = serde_json::json!({});
    let states = found["states"].as_array().expect("states");
    assert_eq!(states.len(), 5);
    for state in states {
        assert!(state["name"].is_string() && state["kind"].is_string() && state["count"].is_u64());
        assert_eq!(state["position"].as_array().map(Vec::len), Some(3));
        assert_eq!(state["spread"].as_array().map(Vec::len), Some(3));
    }
    // It found no clusters, so it has no thresholds.
    assert_eq!((&found["next_merge_m"], &found["threshold_m"]), (&nothing, &nothing));
    let operators = found["operators"].as_array().expect("operators");
    assert_eq!(operators.len(), 3);
    for key in ["name", "preconditions", "effects", "absent"] {
        assert!(operators.iter().all(|o| !o[key].is_null()), "{key}");
    }
    // The paper's learner has one for each kind.
    let paper = json(folder.path(), &["learn", "demos.jsonl", "--method", "paper", "--json"]);
    let next = paper["next_merge_m"]["bolt"].as_f64().expect("metres");
    assert!((0.0010..0.0016).contains(&next), "{next}");
    // Given a threshold, as in the paper; from standard input.
    let text = std::fs::read(folder.path().join("demos.jsonl")).expect("there");
    let output = Command::cargo_bin("symbolt")
        .expect("built")
        .args(["learn", "-", "--threshold", "0.001", "--json", "--quiet"])
        .write_stdin(text)
        .output()
        .expect("starts");
    let found: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(found["threshold_m"]["nut"], 0.001);
}

#[test]
fn classify_gives_a_line_for_every_object_of_a_recording_or_a_scene() {
    let folder = prepared();
    let text = ok(folder.path(), &["classify", "domain.json", "demos.jsonl", "--json"]);
    let lines: Vec<Value> = text.lines().map(|l| serde_json::from_str(l).expect("JSON")).collect();
    assert_eq!(lines.len(), 3 * 8 * 4);
    assert_eq!(lines[0]["demo"], 0);
    assert_eq!(lines[0]["snapshot"], 0);
    assert!(lines.iter().filter(|l| l["kind"] == "nut").all(|l| l["state"].is_string()));
    assert!(
        lines
            .iter()
            .filter(|l| l["kind"] == "bolt_hole")
            .all(|l| l["state"].is_null() && l["distance"].is_null())
    );
    let scene = ok(folder.path(), &["classify", "domain.json", "scene.json"]);
    assert!(scene.contains("the nut is in its") && scene.contains("none"), "{scene}");
}

#[test]
fn plan_says_what_to_do_and_when_it_knew() {
    let folder = prepared();
    let plan = json(folder.path(), &["plan", "paper.json", "--scene", "scene.json", "--json"]);
    assert_eq!(plan["status"], "act");
    assert_eq!(plan["plan"].as_array().map(Vec::len), Some(3));
    assert_eq!(plan["plan"][0], plan["action"]);
    assert_eq!(plan["plan"][2], "PUT_BOLT_AT_NUT_POCKET");
    assert!(plan["reason"].is_null());
    assert_eq!(plan["choices"], serde_json::json!([]));
    let chain = ["plan", "paper.json", "--scene", "scene.json", "--planner", "chain", "--json"];
    let asked = json(folder.path(), &chain);
    for (plan, planner, counted, least, known) in [
        (&plan, "goal-sets", "goal_sets", 6, "01 costs "),
        (&asked, "chain", "questions", 10, "01 preconditions "),
    ] {
        assert_eq!(plan["planner"], planner);
        assert!(plan[counted].as_u64().is_some_and(|count| count >= 3), "{plan}");
        let milestones = plan["milestones_ms"].as_object().expect("milestones");
        assert!(milestones.len() >= least, "{milestones:?}");
        assert!(milestones.keys().any(|name| name.starts_with(known)), "{milestones:?}");
        let mut times: Vec<f64> = milestones.values().filter_map(Value::as_f64).collect();
        times.sort_by(f64::total_cmp);
        assert_eq!(plan["decision_ms"].as_f64(), times.last().copied());
        assert_eq!(plan["plan"].as_array().map(Vec::len), Some(3));
    }

    let met = ["plan", "paper.json", "--scene", "scene.json", "--goal", "NUT_AT_START", "--json"];
    for planner in ["goal-sets", "chain"] {
        let args = [&met[..], &["--planner", planner]].concat();
        assert_eq!(json(folder.path(), &args)["status"], "met");
    }

    // With a second way of doing it, the choice is told.
    let text = std::fs::read_to_string(folder.path().join("paper.json")).expect("there");
    let mut domain: Value = serde_json::from_str(&text).expect("JSON");
    let mut other = domain["operators"][0].clone();
    other["name"] = "ANOTHER_WAY".into();
    domain["operators"].as_array_mut().expect("operators").push(other);
    std::fs::write(folder.path().join("two_ways.json"), domain.to_string()).expect("writes");
    let args = ["plan", "two_ways.json", "--scene", "scene.json", "--planner", "chain", "--json"];
    let choices = &json(folder.path(), &args)["choices"];
    assert!(choices[0]["state"].is_string() && choices[0]["action"].is_string(), "{choices}");
    assert!(choices[0]["among"].as_u64().is_some_and(|among| among >= 2), "{choices}");
    assert!(choices[0]["why"].as_str().is_some_and(|why| why.contains("preferred")));
    assert!(ok(folder.path(), &args[..6]).contains("Choices among several causes:"));

    // Without its bolt the scene is stuck: said in one sentence, and 1 returned.
    let text = std::fs::read_to_string(folder.path().join("scene.json")).expect("there");
    let mut scene: Value = serde_json::from_str(&text).expect("JSON");
    scene["objects"].as_array_mut().expect("objects").retain(|o| o["kind"] != "bolt");
    std::fs::write(folder.path().join("poor.json"), scene.to_string()).expect("writes");
    for planner in ["goal-sets", "chain"] {
        let poor = ["plan", "paper.json", "--scene", "poor.json", "--json", "--quiet", "--planner"];
        let stuck = run(folder.path(), &[&poor[..], &[planner]].concat());
        assert_eq!(stuck.code, 1);
        let plan: Value = serde_json::from_str(&stuck.out).expect("JSON");
        assert_eq!(plan["status"], "stuck");
        assert_eq!(
            stuck.err.trim_end(),
            "symbolt: stuck: the goal asks for 1 of BOLT_AT_NUT_POCKET, and the scene has 0 \
             objects of kind `bolt`"
        );
    }
}

#[test]
fn one_file_and_one_scene_give_plan_actions_and_classify_one_answer() {
    let folder = prepared();
    let path = folder.path();
    let text = std::fs::read_to_string(path.join("scene.json")).expect("there");
    let mut scene: Value = serde_json::from_str(&text).expect("JSON");
    let objects = scene["objects"].as_array_mut().expect("objects");
    let nut = objects.iter_mut().find(|o| o["kind"] == "nut").expect("a nut");
    let (id, ground) = (nut["id"].clone(), nut["position"][2].as_f64().expect("metres"));
    for above_mm in [0.0, 5.0, 7.0, 9.0, 60.0] {
        let objects = scene["objects"].as_array_mut().expect("objects");
        let nut = objects.iter_mut().find(|o| o["kind"] == "nut").expect("a nut");
        nut["position"][2] = (ground + above_mm / 1e3).into();
        std::fs::write(path.join("above.json"), scene.to_string()).expect("writes");
        for domain in ["paper.json", "domain.json"] {
            let args = ["classify", domain, "above.json", "--json"];
            let lines = ok(path, &args);
            let mut lines = lines.lines().map(|l| serde_json::from_str::<Value>(l).expect("JSON"));
            let found = lines.find(|l| l["id"] == id).expect("the nut");
            let known = found["state"] == "NUT_AT_START";
            match above_mm {
                0.0 => assert!(known, "{domain}: {found}"),
                60.0 => assert!(!known, "{domain}: {found}"),
                _ => {}
            }
            let args = [domain, "--scene", "above.json", "--json", "--quiet"];
            let planned = run(path, &[&["plan"], &args[..]].concat());
            let plan: Value = serde_json::from_str(&planned.out).expect("JSON");
            let moved = |moves: &Value| {
                moves.as_array().is_some_and(|moves| moves.iter().any(|m| m["object"] == id))
            };
            assert_eq!((planned.code == 0, moved(&plan["steps"])), (known, known), "{plan}");
            let listed = run(path, &[&["actions"], &args[..]].concat());
            let lines = listed.out.lines().map(|l| serde_json::from_str::<Value>(l).expect("JSON"));
            assert_eq!(moved(&lines.collect()), known, "{domain}, {above_mm} mm: {}", listed.out);
        }
    }
}

#[test]
fn a_plan_made_by_spiking_neurons_says_that_its_mode_is_lif() {
    let folder = prepared();
    for (domain, mode) in [
        ("paper.json", "direct"),
        ("paper.json", "rate"),
        ("paper.json", "lif"),
        ("domain.json", "direct"),
        ("domain.json", "lif"),
    ] {
        let args = ["plan", domain, "--scene", "scene.json", "--json", "--mode"];
        let plan = json(folder.path(), &[&args[..], &[mode]].concat());
        assert_eq!((plan["mode"].as_str(), plan["status"].as_str()), (Some(mode), Some("act")));
    }
}

#[test]
fn rename_and_check_serve_a_person() {
    let folder = prepared();
    let text = ok(
        folder.path(),
        &["rename", "domain.json", "NUT_AT_START=NUT_ON_TABLE", "--out", "named.json"],
    );
    assert!(text.contains("NUT_ON_TABLE"));
    assert!(ok(folder.path(), &["check", "named.json"]).contains("a valid domain"));
    assert!(ok(folder.path(), &["check", "demos.jsonl"]).contains("a valid recording"));
    assert!(ok(folder.path(), &["check", "scene.json"]).contains("a valid scene"));
    // In place.
    ok(folder.path(), &["rename", "named.json", "NUT_ON_TABLE=NUT_FREE", "--quiet"]);
    let named = std::fs::read_to_string(folder.path().join("named.json")).expect("there");
    assert!(named.contains("NUT_FREE") && !named.contains("NUT_ON_TABLE"));
    // The sentence stays unless it is changed, too.
    assert!(named.contains("a nut is in its start area"));
    let reworded = ["rename", "named.json", "--words", "NUT_FREE=a nut lies about", "--quiet"];
    ok(folder.path(), &reworded);
    let shown = ok(folder.path(), &["plan", "named.json", "--scene", "scene.json", "--quiet"]);
    assert!(shown.contains("a nut lies about"), "{shown}");
    let refused = run(folder.path(), &["rename", "named.json", "NUT_FREE"]);
    assert_eq!(refused.code, 2);
    assert!(refused.err.contains("`NUT_FREE` is not of the form OLD=NEW"));
}

#[test]
fn bad_usage_and_bad_input_return_2_and_leave_nothing_behind() {
    let folder = prepared();
    let path = folder.path();
    let before = files(path);
    let write = |name: &str, text: &[u8]| std::fs::write(path.join(name), text).expect("writes");
    let good = std::fs::read(path.join("demos.jsonl")).expect("there");
    write("cut.jsonl", &good[..good.len() - 40]);
    write("bytes.jsonl", &[0xFF, 0xFE, 0x00]);
    write(
        "old.json",
        &std::fs::read_to_string(path.join("domain.json"))
            .expect("there")
            .replace("\"version\": 3", "\"version\": 7")
            .into_bytes(),
    );
    let cases: [(&[&str], &str); 55] = [
        (&["learn", "missing.jsonl", "--out", "x.json"], "missing.jsonl"),
        (&["learn", "cut.jsonl", "--out", "x.json"], "cut.jsonl, line 24"),
        (&["learn", "bytes.jsonl", "--out", "x.json"], "not UTF-8"),
        (
            &["learn", "scene.json", "--out", "x.json"],
            "scene.json is a scene; expected a recording",
        ),
        (
            &["learn", "demos.jsonl", "--p", "0", "--out", "x.json"],
            "--p 0: must be a finite number",
        ),
        (
            &["learn", "demos.jsonl", "--threshold=-1", "--out", "x.json"],
            "--threshold -1: must be a length above 0",
        ),
        (&["learn", "demos.jsonl", "--out", "domain.json"], "exists already"),
        (&["plan", "old.json", "--scene", "scene.json"], "it is 7"),
        (
            &["plan", "domain.json", "--scene", "demos.jsonl"],
            "demos.jsonl is a recording; expected a scene",
        ),
        (
            &["plan", "domain.json", "--scene", "scene.json", "--goal", "NUT"],
            "it has: BOLT_AT_START",
        ),
        (
            &["plan", "a", "--scene", "b", "--dimensions", "0", "--planner", "chain"],
            "--dimensions 0: must be",
        ),
        (
            &["plan", "domain.json", "--scene", "scene.json", "--dimensions", "512"],
            "--dimensions has no effect on the planner goal-sets; leave it out, or add --planner",
        ),
        (
            &["plan", "domain.json", "--scene", "scene.json", "--slots", "9"],
            "--slots is for a problem in PDDL",
        ),
        (
            &["plan", "domain.json", "--scene", "scene.json", "--mode", "liff"],
            "the modes are: direct",
        ),
        (&["run", "--demos", "0", "--out", "new"], "--demos 0: must be 1 to 1000"),
        (
            &["run", "--film", "2", "--out", "new"],
            "--record-episode 2: must be 1, the number of --episodes",
        ),
        (&["run", "--nuts", "100", "--out", "new"], "--nuts 100: must be 1 to 4"),
        (&["run", "--drop-rate", "2", "--out", "new"], "--drop-rate 2: must be 0 to 1"),
        (
            &["classify", "domain.json", "demos.jsonl", "--limit", "0"],
            "--limit 0: must be a finite number above 0",
        ),
        (&["record", "--kinematic", "--demo-nuts", "60"], "--demo-nuts 60: must be 1 to 50"),
        (&["record", "--kinematic", "--fail-rate", "1"], "--fail-rate 1: must be 0 to 0.9"),
        (&["record", "--kinematic", "--knock-rate", "2"], "--knock-rate 2: must be 0 to 1"),
        (&["record", "--demos", "0"], "--demos 0: must be 1 to 1000"),
        (&["record", "--labels"], "--labels needs --kinematic"),
        (&["learn", "demos.jsonl", "--threads", "9999"], "--threads 9999: must be 0 to 1024"),
        (&["plan", "-", "--scene", "-"], "cannot both come from standard input"),
        (&["classify", "-", "-"], "cannot both come from standard input"),
        (&["bench", "bind", "--sim-seconds", "0"], "--sim-seconds 0: must be 0.3 to 3600"),
        (&["bench", "bind", "--runs", "0"], "--runs 0: must be 1 to 1000"),
        (&["bench", "bind", "--neurons-scale", "0"], "--neurons-scale 0: must be more than 0"),
        (&["run", "--mode", "liff", "--out", "new"], "the modes are: direct"),
        (
            &["run", "--planner", "chain", "--dimensions", "0", "--out", "new"],
            "--dimensions 0: must be",
        ),
        (&["run", "--drop-rate", "-1", "--out", "new"], "--drop-rate -1: must be 0 to 1"),
        (&["run", "--nuts", "many"], "--nuts many: must be a whole number"),
        (&["experiment", "table-5"], "there is no experiment `table-5`"),
        (&["experiment", "table-4", "--shard", "3/2"], "--shard 3/2: must be I/N"),
        (&["experiment", "table-4", "--trials", "0"], "--trials 0: must be 1 to 100000"),
        (&["bench", "bind", "--load", "domain.json"], "expected a model of solved populations"),
        (&["bench", "bind", "--mode", "direct", "--save", "new"], "direct mode has no neurons"),
        (&["bench", "select", "--save", "domain.json"], "exists already"),
        (
            &["learn", "demos.jsonl", "--method", "relational", "--threshold", "1mm"],
            "--threshold needs --method paper",
        ),
        (&["learn", "demos.jsonl", "--method", "guess"], "invalid value 'guess'"),
        (&["actions", "-", "--scene", "-"], "cannot both come from standard input"),
        (
            &["actions", "domain.json", "--scene", "demos.jsonl"],
            "demos.jsonl is a recording; expected a scene",
        ),
        (&["actions", "old.json", "--scene", "scene.json"], "it is 7; expected 1 to 3"),
        (&["run", "--task", "teapot"], "there is no task `teapot`; the tasks are: nuts-and-bolts"),
        (&["config", "--task", "teapot"], "there is no task `teapot`"),
        (
            &["run", "--task", "drawer", "--nuts", "2"],
            "--nuts belongs to the task nuts-and-bolts; the task drawer has",
        ),
        (
            &["record", "--task", "drawer", "--demo-bolts", "2"],
            "--demo-bolts belongs to the task nuts-and-bolts",
        ),
        (
            &["record", "--kinematic", "--task", "drawer"],
            "--kinematic generates only nuts and bolts",
        ),
        (&["record", "--task-file", "demos.jsonl"], "demos.jsonl"),
        (&["record", "--kinematic", "--pose-noise", "1"], "--pose-noise 1: must be MM,DEG"),
        (&["run", "--outliers", "2", "--out", "new"], "--outliers 2: must be 0 to 1"),
        (&["record", "--kinematic", "--swaps", "-1"], "--swaps -1: must be 0 to 1"),
        (
            &["bench", "bind", "--unbinding", "guess"],
            "--unbinding guess: must be one of products, fixed",
        ),
    ];
    for (args, part) in cases {
        let ran = run(path, args);
        assert_eq!(ran.code, 2, "{args:?}: {} {}", ran.out, ran.err);
        assert!(ran.err.contains(part), "{args:?}: {part} in {}", ran.err);
    }
    let mut after = files(path);
    after.retain(|f| !["cut.jsonl", "bytes.jsonl", "old.json"].contains(&f.as_str()));
    assert_eq!(after, before);
}

#[test]
fn an_output_that_cannot_be_written_fails_with_1_and_leaves_nothing() {
    let folder = prepared();
    let ran =
        run(folder.path(), &["learn", "demos.jsonl", "--out", "no/such/folder/x.json", "--quiet"]);
    assert_eq!(ran.code, 1, "{}", ran.err);
    assert!(ran.err.contains("cannot write no/such/folder/x.json"), "{}", ran.err);
    assert!(!folder.path().join("no").exists());
}

#[test]
fn progress_goes_to_standard_error_and_can_be_turned_off() {
    let folder = prepared();
    let loud = run(folder.path(), &["learn", "demos.jsonl", "--json"]);
    assert!(loud.err.contains("inferring states") && !loud.out.contains("inferring states"));
    let quiet =
        run(folder.path(), &["learn", "demos.jsonl", "--json", "--quiet", "--threads", "1"]);
    assert_eq!(quiet.err, "");
    assert_eq!(quiet.out, loud.out, "threads change nothing");
}

#[test]
fn help_version_and_completions_are_there() {
    let folder = tempfile::tempdir().expect("a folder");
    assert!(ok(folder.path(), &["--version"]).starts_with("symbolt "));
    let help = ok(folder.path(), &["--help"]);
    assert!(help.lines().all(|line| line.chars().count() <= 80), "{help}");
    for part in ["classify", "symbolt [OPTIONS OF run]", "Without a command, `symbolt` does what"] {
        assert!(help.contains(part), "{part} in {help}");
    }
    let help = ok(folder.path(), &["run", "--help"]);
    for default in ["1", "5", "256", "direct", "as in --config, or 1"] {
        assert!(help.contains(&format!("[default: {default}]")), "{default} in {help}");
    }
    assert!(help.contains("[default: out, where an earlier run is replaced]"), "{help}");
    for hidden in ["--film", "--meddle"] {
        assert!(!help.contains(hidden), "{hidden} in {help}");
    }
    for command in [
        "run",
        "record",
        "learn",
        "classify",
        "plan",
        "actions",
        "rename",
        "check",
        "bench",
        "report",
        "experiment",
        "merge",
        "config",
        "completions",
        "man",
    ] {
        let help = ok(folder.path(), &[command, "--help"]);
        assert!(help.lines().all(|line| line.chars().count() <= 80), "{help}");
        let page = ok(folder.path(), &["man", command]);
        let title = format!(".TH symbolt-{command} 1 ");
        assert!(page.contains(&title) && page.contains("\n.SH OPTIONS\n"), "{page}");
    }
    let page = ok(folder.path(), &["man"]);
    assert!(
        page.contains(".TH symbolt 1 ") && page.contains("symbolt\\-learn\\-model(1)"),
        "{page}"
    );
    let help = ok(folder.path(), &["rename", "--help"]);
    assert!(
        help.contains("in place") && help.contains("[default: the domain file itself"),
        "{help}"
    );
    let help = ok(folder.path(), &["learn", "--help"]);
    assert!(help.contains("1.169mm") && help.contains("without a unit in metres"), "{help}");
    assert!(ok(folder.path(), &["completions", "bash"]).contains("_symbolt"));
    assert!(files(folder.path()).is_empty());
}
