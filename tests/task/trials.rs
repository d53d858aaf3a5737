//! Shards that launchers number, cells, and the state of an experiment whose trials are missing.

#![allow(clippy::expect_used)]

use serde_json::json;
use symbolt::sim::Seed;
use symbolt::study::experiment::{Cell, Plan, Shard, ShardChoice, ShardError, Status};

const HQ_TASK_ID: &str = "HQ_TASK_ID";
const ARRAY_ID: &str = "SLURM_ARRAY_TASK_ID";
const ARRAY_MIN: &str = "SLURM_ARRAY_TASK_MIN";
const ARRAY_MAX: &str = "SLURM_ARRAY_TASK_MAX";
const ARRAY_COUNT: &str = "SLURM_ARRAY_TASK_COUNT";
const ARRAY_STEP: &str = "SLURM_ARRAY_TASK_STEP";
const MPI_RANK: &str = "OMPI_COMM_WORLD_RANK";
const MPI_SIZE: &str = "OMPI_COMM_WORLD_SIZE";
const STEP_RANK: &str = "SLURM_PROCID";
const STEP_TASKS: &str = "SLURM_STEP_NUM_TASKS";

/// Resolves `choice` with variables written as `NAME=VALUE NAME=VALUE`.
fn chosen(choice: &str, text: &str) -> Result<(Shard, Option<&'static str>), ShardError> {
    let pairs = text.split_whitespace().filter_map(|pair| pair.split_once('='));
    let variables = pairs.map(|(name, value)| (name.to_owned(), value.to_owned())).collect();
    choice.parse::<ShardChoice>().expect("a choice").resolve(&variables)
}

fn shard(choice: &str, text: &str) -> String {
    chosen(choice, text).expect("a shard").0.to_string()
}

fn refused(choice: &str, text: &str) -> String {
    chosen(choice, text).expect_err(text).to_string()
}

fn array_of(id: u64, [min, max, count, step]: [u64; 4]) -> String {
    format!(
        "{ARRAY_ID}={id} {ARRAY_MIN}={min} {ARRAY_MAX}={max} {ARRAY_COUNT}={count} {ARRAY_STEP}={step}"
    )
}

#[test]
fn choices_are_read_and_others_refused() {
    for text in ["", "auto/", "auto/0", "auto/x", "autos", "auto/1/2", "0/3", "4/3", "1", "a/b"] {
        let problem = text.parse::<ShardChoice>().expect_err(text).to_string();
        assert!(problem.contains("auto/N"), "{text}: {problem}");
    }
    assert_eq!(
        "2/4".parse::<ShardChoice>().ok(),
        Some(ShardChoice::Fixed(Shard { index: 1, of: 4 }))
    );
    assert_eq!(chosen("2/4", "SLURM_ARRAY_TASK_ID=x"), Ok((Shard { index: 1, of: 4 }, None)));
}

#[test]
fn arrays_begin_anywhere_and_have_a_step() {
    for (shape, ids) in [
        ([0, 7, 8, 1], [0, 1, 2, 3, 4, 5, 6, 7]),
        ([1, 8, 8, 1], [1, 2, 3, 4, 5, 6, 7, 8]),
        ([1, 22, 8, 3], [1, 4, 7, 10, 13, 16, 19, 22]),
    ] {
        for (at, id) in ids.into_iter().enumerate() {
            assert_eq!(shard("auto", &array_of(id, shape)), format!("{}/8", at + 1));
        }
    }
    // Slurm versions without some of the variables, and an array of one task.
    let few = format!("{ARRAY_ID}=4 {ARRAY_MIN}=1 {ARRAY_MAX}=8");
    assert_eq!(shard("auto", &few), "4/8");
    assert_eq!(shard("auto", &array_of(1, [1, 1, 1, 1])), "1/1");
    // A step of one process inside a task of the array changes nothing.
    let inside = format!("{} {STEP_RANK}=0 {STEP_TASKS}=1", array_of(2, [0, 3, 4, 1]));
    assert_eq!(chosen("auto", &inside), Ok((Shard { index: 2, of: 4 }, Some(ARRAY_ID))));
}

#[test]
fn an_array_with_gaps_needs_the_number_of_shards() {
    for (id, shape) in [(3, [0, 7, 3, 1]), (0, [0, 7, 3, 3]), (1, [0, 6, 3, 3]), (7, [1, 7, 5, 2])]
    {
        let text = refused("auto", &array_of(id, shape));
        assert!(text.contains("leave gaps") && text.contains("auto/N"), "{text}");
    }
    // A part that happens to have no gaps, as in `--array=3-5` and `--array=5`.
    for (id, shape) in [(4, [3, 5, 3, 1]), (5, [5, 5, 1, 1])] {
        let text = refused("auto", &array_of(id, shape));
        assert!(text.contains(&format!("MIN is {}; expected 0 or 1", shape[0])), "{text}");
    }
    // The same tasks under their own numbers.
    for id in [2, 5, 7] {
        assert_eq!(shard("auto/8", &array_of(id, [2, 7, 3, 1])), format!("{id}/8"));
    }
    for id in [0, 9] {
        let text = refused("auto/8", &array_of(id, [0, 9, 2, 9]));
        assert!(text.contains(&format!("{ARRAY_ID} is {id}; expected 1 to 8")), "{text}");
    }
}

#[test]
fn ranks_of_steps_and_of_open_mpi_count_from_0() {
    let job = "SLURM_JOB_ID=7 SLURM_NTASKS=8";
    assert_eq!(
        chosen("auto", &format!("{job} {STEP_RANK}=2 {STEP_TASKS}=4")),
        Ok((Shard { index: 2, of: 4 }, Some(STEP_RANK)))
    );
    assert_eq!(shard("auto", "SLURM_PROCID=0 SLURM_NTASKS=3"), "1/3");
    assert_eq!(shard("auto", "SLURM_JOB_ID=7 SLURM_PROCID=0 SLURM_NTASKS=1"), "1/1");
    // The script of a job with several tasks is not one of them.
    let script = refused("auto", &format!("{job} {STEP_RANK}=0"));
    assert!(script.contains("a job's script and not one of its 8 tasks"), "{script}");
    assert_eq!(
        chosen("auto", &format!("{MPI_RANK}=7 {MPI_SIZE}=8")),
        Ok((Shard { index: 7, of: 8 }, Some(MPI_RANK)))
    );
    assert_eq!(shard("auto/8", &format!("{MPI_RANK}=7 {MPI_SIZE}=8")), "8/8");
    let other = refused("auto/9", &format!("{MPI_RANK}=7 {MPI_SIZE}=8"));
    assert!(other.starts_with("--shard auto/9: OMPI_COMM_WORLD_SIZE is 8; expected 9"), "{other}");
}

#[test]
fn the_innermost_launcher_counts_and_shared_tasks_are_refused() {
    let step = format!("SLURM_JOB_ID=7 {STEP_RANK}=0 {STEP_TASKS}=2");
    let mpi = format!("{MPI_RANK}=3 {MPI_SIZE}=4");
    let array = array_of(1, [0, 3, 4, 1]);
    assert_eq!(shard("auto", &format!("{step} {mpi}")), "4/4");
    for (inner, variable) in [(&mpi, MPI_SIZE), (&step, STEP_TASKS)] {
        let text = refused("auto", &format!("{array} {inner}"));
        assert!(text.contains(&format!("{ARRAY_ID} is set and {variable} is ")), "{text}");
    }
    let hq = format!("{HQ_TASK_ID}=3 {array} {step} {mpi}");
    assert_eq!(chosen("auto/8", &hq), Ok((Shard { index: 2, of: 8 }, Some(HQ_TASK_ID))));
    assert!(refused("auto", &hq).contains("HyperQueue does not give the number of tasks"));
    for id in [0, 9] {
        let text = refused("auto/8", &format!("{HQ_TASK_ID}={id}"));
        assert!(text.contains(&format!("is {id}; expected 1 to 8, as `hq submit")), "{text}");
    }
}

#[test]
fn faults_name_the_variable_and_the_valid_values() {
    let text = |variables: &str| refused("auto", variables);
    assert!(text("HOME=x").contains("none of the variables HQ_TASK_ID, SLURM_ARRAY_TASK_ID"));
    for (variables, named) in [
        (
            "SLURM_ARRAY_TASK_ID=",
            "SLURM_ARRAY_TASK_ID is ``; expected a whole number of at least 0",
        ),
        ("SLURM_ARRAY_TASK_ID=-1", "SLURM_ARRAY_TASK_ID is `-1`"),
        ("SLURM_ARRAY_TASK_ID=2", "SLURM_ARRAY_TASK_ID is set and SLURM_ARRAY_TASK_MIN is not"),
        (&array_of(9, [1, 8, 8, 1]), "SLURM_ARRAY_TASK_ID is 9; expected 1 to 8"),
        (
            &array_of(3, [1, 8, 8, 0]),
            "SLURM_ARRAY_TASK_STEP is `0`; expected a whole number of at least 1",
        ),
        ("SLURM_PROCID=0", "SLURM_PROCID is set and SLURM_NTASKS is not"),
        ("SLURM_PROCID=8 SLURM_NTASKS=8", "SLURM_PROCID is 8; expected 0 to 7"),
        ("SLURM_PROCID=1 SLURM_NTASKS=many", "SLURM_NTASKS is `many`"),
        ("OMPI_COMM_WORLD_RANK=1.5 OMPI_COMM_WORLD_SIZE=2", "OMPI_COMM_WORLD_RANK is `1.5`"),
        ("OMPI_COMM_WORLD_RANK=1", "OMPI_COMM_WORLD_RANK is set and OMPI_COMM_WORLD_SIZE is not"),
        (
            "OMPI_COMM_WORLD_RANK=2 OMPI_COMM_WORLD_SIZE=2",
            "OMPI_COMM_WORLD_RANK is 2; expected 0 to 1",
        ),
        ("OMPI_COMM_WORLD_RANK=0 OMPI_COMM_WORLD_SIZE=0", "OMPI_COMM_WORLD_SIZE is `0`"),
    ] {
        assert!(text(variables).contains(named), "{variables}: {}", text(variables));
    }
    // The greatest numbers do not overflow.
    let most = format!("{ARRAY_ID}={0} {ARRAY_MIN}=1 {ARRAY_MAX}={0}", u64::MAX);
    assert_eq!(shard("auto", &most), format!("{0}/{0}", u64::MAX));
}

#[test]
fn a_cell_is_named_by_its_settings_and_says_which_one_it_lacks() {
    let cell = Cell::new(json!({"gate": "out", "noise": 0.5}), 1, vec![]);
    assert_eq!(cell.to_string(), "gate = out, noise = 0.5");
    assert_eq!(Cell::new(json!({}), 1, vec![]).to_string(), "without settings");
    assert_eq!(cell.choice("gate", &[("in", 1), ("out", 2)]).ok(), Some(2));
    assert_eq!(cell.number("noise").ok(), Some(0.5));
    let faults = [
        cell.choice("gate", &[("in", 1), ("shut", 2)]).err(),
        cell.choice("noise", &[("in", 1)]).err(),
        cell.number("gate").err(),
        cell.number("sigma").err(),
    ];
    let faults = faults.map(|fault| fault.map(|error| error.to_string()).unwrap_or_default());
    let of_cell = "of the cell `gate = out, noise = 0.5` that is";
    assert_eq!(
        faults,
        [
            format!("`gate` is not a setting {of_cell} one of `in`, `shut`"),
            format!("`noise` is not a setting {of_cell} one of `in`"),
            format!("`gate` is not a setting {of_cell} a number"),
            format!("`sigma` is not a setting {of_cell} a number"),
        ]
    );
}

#[test]
fn without_any_journal_all_trials_of_the_plan_are_missing() {
    let plan = || {
        let cells =
            vec![Cell::new(json!({"a": 1}), 5, vec![]), Cell::new(json!({"a": 2}), 2, vec![])];
        Ok(Plan { seed: Seed::new(3), trials: None, cells })
    };
    let folders = ["none/x-2-of-3".into(), "none/y".into()];
    let status = Status::read("coin", &folders, plan).expect("a status");
    assert_eq!((status.done(), status.trials(), status.is_complete()), (0, 7, false));
    let shards: Vec<Option<String>> =
        status.shards.iter().map(|shard| shard.shard.map(|shard| shard.to_string())).collect();
    assert_eq!(shards, [Some("1/3".into()), Some("2/3".into()), Some("3/3".into()), None]);
    let of_second: Vec<&[u64]> =
        status.shards[1].missing.iter().map(|missing| &missing.trials[..]).collect();
    assert_eq!(of_second, [&[1, 4][..], &[1]]);
    assert_eq!(status.cells[1].missing, [0, 1]);
    assert_eq!(status.rerun().expect("a common number").len(), 3);
    assert_eq!(status.to_json()["rerun"], json!([1, 2, 3]));
}
