//! Processes under `mpirun`: the same bits for any number of ranks, and one end for all. Needs the feature `mpi`.

#![allow(clippy::expect_used)]

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::Duration;

use symbolt::neurons::{Ensemble, PopulationPlan};
use symbolt::sim::{
    Constant, Failure, GraphBuilder, MpiSession, Ranks, RunConfig, Seed, Signal, SimDuration,
    Simulator, Synapse, Timebase,
};

/// A command that runs `program` on so many ranks. More ranks than cores are allowed.
fn mpirun(ranks: usize, program: &Path) -> Command {
    let mut command = Command::new("mpirun");
    command
        .args(["--timeout", "600", "--oversubscribe", "-n", &ranks.to_string()])
        .arg(program)
        .env("OMPI_ALLOW_RUN_AS_ROOT", "1")
        .env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1");
    command
}

fn symbolt(ranks: usize, args: &[&str]) -> Command {
    let mut command = mpirun(ranks, Path::new(env!("CARGO_BIN_EXE_symbolt")));
    command.args(args);
    command
}

fn output(mut command: Command) -> Output {
    command.output().expect("mpirun can be started")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn standard_networks_measure_the_same_quality_on_one_to_three_ranks() {
    for model in ["bind", "state", "memory", "select", "channel", "planner", "large"] {
        let quality = |ranks: usize| {
            let args = ["bench", model, "--neurons-scale", "0.2", "--dimensions", "64"];
            let mut command = symbolt(ranks, &args);
            command.args(["--sim-seconds", "0.3", "--runs", "1", "--json", "--quiet"]);
            let output = output(command);
            let line = text(&output.stdout);
            assert!(output.status.success(), "{model} on {ranks}: {}", text(&output.stderr));
            let json: serde_json::Value = serde_json::from_str(&line).expect("one line of JSON");
            assert_eq!(json["ranks"], ranks);
            assert!(json["neurons"].as_u64() > Some(0));
            json["quality"].to_string()
        };
        let alone = quality(1);
        for ranks in [2, 3] {
            assert_eq!(quality(ranks), alone, "{model} on {ranks} ranks");
        }
    }
}

/// Runs the program in physics and in spikes, and returns the files that depend on no wall clock.
fn closed_loop(ranks: usize, folder: &Path) -> Vec<Vec<u8>> {
    let out = folder.join(format!("ranks-{ranks}"));
    let out_text = out.to_str().expect("UTF-8");
    let args =
        ["run", "--seed", "3", "--demos", "2", "--mode", "lif", "--quiet", "--out", out_text];
    let output = output(symbolt(ranks, &args));
    assert!(output.status.success(), "{ranks}: {}", text(&output.stderr));
    let files = ["recording.jsonl", "domain.json", "scene.json", "trace.jsonl", "arrays.npz"];
    files.map(|file| fs::read(out.join(file)).expect("written")).into()
}

#[test]
fn a_run_in_spikes_writes_the_same_files_on_one_and_two_ranks() {
    let folder = tempfile::tempdir().expect("a folder");
    let alone = closed_loop(1, folder.path());
    assert!(alone.iter().all(|file| file.len() > 100));
    let together = closed_loop(2, folder.path());
    for (index, (a, b)) in alone.iter().zip(&together).enumerate() {
        assert!(a == b, "file {index}");
    }
}

fn example() -> PathBuf {
    // Examples lie beside the program.
    Path::new(env!("CARGO_BIN_EXE_symbolt")).with_file_name("examples").join("ranks")
}

#[test]
fn a_checkpoint_of_three_ranks_resumes_on_one_and_two() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = |ranks: usize, resume: Option<&Path>| {
        let mut command = mpirun(ranks, &example());
        command.env("TMPDIR", folder.path()).args(resume);
        let output = output(command);
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&output.stdout)
    };
    let file = folder.path().join("symbolt-ranks.json");
    let alone = run(1, None);
    let of_one = fs::read(&file).expect("written");
    let three = run(3, None);
    assert!(fs::read(&file).expect("written") == of_one, "the checkpoints differ");
    assert_eq!(alone, three);
    let last = |text: &str| text.lines().last().map(String::from);
    assert!(last(&alone).is_some_and(|line| line.starts_with("similarity to CUP at 0.2 s: 0.9")));
    for ranks in [1, 2] {
        assert_eq!(last(&run(ranks, Some(&file))), last(&alone), "{ranks}");
    }
}

#[test]
fn a_program_of_ones_own_that_fails_on_one_rank_ends_on_all() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("taken");
    fs::write(&file, "not a folder").expect("written");
    // The first rank alone writes there; the other would wait for it forever.
    let mut command = mpirun(2, Path::new("env"));
    command.arg(format!("TMPDIR={}", file.join("out").display())).arg(example());
    let output = output(command);
    let said = text(&output.stderr);
    assert!(!output.status.success(), "{said}");
    assert!(said.contains("error: rank 0: cannot"), "{said}");
    assert!(said.contains("symbolt-ranks.json: Not a directory"), "{said}");
    assert_eq!(fs::read_dir(folder.path()).expect("there").count(), 1, "nothing is written");
}

#[test]
fn an_error_that_all_share_is_told_once() {
    for (args, sentence) in [
        (["--mode", "nope"], "there is no mode `nope`"),
        (["--nope", "1"], "unexpected argument '--nope' found"),
    ] {
        let output = output(symbolt(3, &[&["bench", "bind"], &args[..]].concat()));
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert_eq!(said.matches(sentence).count(), 1, "{said}");
    }
}

#[test]
fn ranks_with_other_arguments_are_refused() {
    let program = env!("CARGO_BIN_EXE_symbolt");
    let mut command = symbolt(1, &["bench", "bind"]);
    command.args([":", "-n", "1", program, "bench", "bind", "--seed", "2"]);
    let output = output(command);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("symbolt: rank 1 has other arguments than this one"), "{said}");
}

#[test]
fn an_error_of_one_rank_ends_all_and_names_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("taken");
    fs::write(&file, "not a folder").expect("written");
    let out = file.join("out");
    let args = ["run", "--quiet", "--out", out.to_str().expect("UTF-8")];
    // The first rank alone opens the folder. The others would go on for much longer.
    let output = output(symbolt(2, &args));
    let said = text(&output.stderr);
    assert!(!output.status.success());
    assert!(said.contains("symbolt: rank 0: cannot"), "{said}");
    assert_eq!(fs::read_dir(folder.path()).expect("there").count(), 1, "nothing else is written");
}

#[test]
fn a_killed_rank_ends_all_and_is_named() {
    let args = ["bench", "channel", "--sim-seconds", "3600", "--threads", "1", "--quiet"];
    let mut command = symbolt(2, &args);
    let child = command
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("mpirun can be started");
    // The ranks are the children of `mpirun`.
    let ranks = || {
        let of = child.id().to_string();
        let list = Command::new("ps").args(["-o", "pid=", "--ppid", &of]).output();
        let pids = text(&list.expect("ps").stdout);
        pids.split_whitespace().map(String::from).collect::<Vec<_>>()
    };
    let mut pids = ranks();
    for _ in 0..600 {
        if pids.len() == 2 {
            break;
        }
        std::thread::sleep(Duration::from_millis(50));
        pids = ranks();
    }
    assert_eq!(pids.len(), 2, "two ranks have started");
    // Long enough for MPI to start.
    std::thread::sleep(Duration::from_secs(2));
    let killed = Command::new("kill").args(["-9", &pids[1]]).status().expect("kill");
    assert!(killed.success());
    // Without an end the test would wait for an hour of simulated time.
    let output = child.wait_with_output().expect("it ends");
    let said = text(&output.stderr) + &text(&output.stdout);
    assert!(!output.status.success());
    assert!(said.contains("rank 1") && said.contains("signal 9"), "{said}");
}

/// Set for the processes that [`ending`] starts.
const ROLE: &str = "SYMBOLT_TEST_ROLE";

/// Starts this file's test `a_process_of_a_role` in several processes, and returns what the user is told. If they hang,
/// the launcher ends them with another exit code.
fn ending(ranks: usize, role: &str, folder: &Path) -> Vec<String> {
    let mut command = mpirun(ranks, &env::current_exe().expect("this test"));
    command.args(["--exact", "a_process_of_a_role", "--nocapture"]);
    command.env(ROLE, role).env("TMPDIR", folder);
    let output = output(command);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{said}");
    said.lines().filter_map(|line| line.strip_prefix("told: ")).map(String::from).collect()
}

#[test]
fn a_process_of_a_role() {
    let Ok(role) = env::var(ROLE) else { return };
    let session = MpiSession::start().expect("MPI starts");
    let ranks = session.ranks();
    let failure = act(&role, &ranks).err().map(|error| {
        let sentence = error.to_string();
        Failure { code: 3, sentence }
    });
    std::process::exit(i32::from(session.end(failure, |sentence| eprintln!("told: {sentence}"))));
}

fn act(role: &str, ranks: &Ranks) -> Result<(), Box<dyn std::error::Error>> {
    let (own, fails) = (ranks.rank(), role == "last tick");
    let mut graph = GraphBuilder::new();
    // Not a number after the exchange of the last tick, on one rank.
    let value =
        move |time_s: f64| if fails && own == 1 && time_s > 0.0185 { f32::NAN } else { 0.5 };
    graph.add("signal", Signal::scalar(value));
    let map = graph.add("map", Ensemble::new(1).copies(3).identity("same"));
    let input = graph.add("input", Constant::vector(&[0.5; 3]));
    graph.connect(&input, &map.input, Synapse::None);
    let plan = PopulationPlan::lif().shared(ranks);
    let graph = graph.build(Timebase::default(), &plan, Seed::new(1))?;
    let mut sim = Simulator::new(graph.into(), RunConfig::default())?;
    sim.run_for(SimDuration::from_millis(if role == "early" && own == 1 { 10 } else { 20 }))?;
    if role == "late" {
        if own == 0 {
            std::thread::sleep(Duration::from_secs(4));
            fs::write(env::temp_dir().join("written"), "all of it")?;
        }
        return Err("nothing was solved".into());
    }
    Ok(())
}

#[test]
fn a_rank_that_ends_early_is_named_and_does_not_hang_the_others() {
    let folder = tempfile::tempdir().expect("a folder");
    assert_eq!(ending(3, "early", folder.path()), ["rank 0: rank 1 has ended"]);
}

#[test]
fn a_fault_in_the_last_tick_of_a_program_ends_all() {
    let folder = tempfile::tempdir().expect("a folder");
    let told = ending(3, "last tick", folder.path());
    assert_eq!(told.len(), 1, "{told:?}");
    assert!(told[0].starts_with("rank 1: `signal.out` became NaN in tick 19"), "{told:?}");
}

#[test]
fn a_rank_that_still_writes_is_not_cut_off_by_a_failure_that_all_share() {
    let folder = tempfile::tempdir().expect("a folder");
    assert_eq!(ending(2, "late", folder.path()), ["nothing was solved"]);
    assert_eq!(fs::read(folder.path().join("written")).expect("written"), b"all of it");
}

#[test]
fn a_launcher_of_another_mpi_is_refused() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_symbolt"));
    command
        .args(["bench", "bind"])
        .env("OMPI_COMM_WORLD_RANK", "0")
        .env("OMPI_COMM_WORLD_SIZE", "2");
    let output = output(command);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("started 2 processes, but MPI joins 1 of them"), "{said}");
    assert!(output.stdout.is_empty());
}
