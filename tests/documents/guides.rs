//! Checks that the guides' code equals the examples, and that the guides show what these and the command line print.

#![allow(clippy::unwrap_used, clippy::expect_used)]
#![cfg(feature = "cli")]

use std::cell::RefCell;
use std::fs;
use std::path::Path;
use std::sync::Mutex;

use assert_cmd::Command;

thread_local! {
    static PRINTED: RefCell<String> = const { RefCell::new(String::new()) };
}

// Replaces `println!` in the modules below, so that the tests read what an example prints.
macro_rules! println {
    ($($arguments:tt)*) => {
        $crate::guides::PRINTED.with_borrow_mut(|text| {
            text.push_str(&format!($($arguments)*));
            text.push('\n');
        })
    };
}

#[path = "../../examples/assembly_scene.rs"]
mod assembly_scene;
#[path = "../../examples/guide_ablation.rs"]
mod guide_ablation;
#[path = "../../examples/guide_expressions.rs"]
mod guide_expressions;
#[path = "../../examples/guide_nef.rs"]
mod guide_nef;
#[path = "../../examples/guide_own_module.rs"]
mod guide_own_module;
#[path = "../../examples/guide_own_task.rs"]
mod guide_own_task;
#[path = "../../examples/guide_planner_graph.rs"]
mod guide_planner_graph;
#[path = "../../examples/guide_timing.rs"]
mod guide_timing;

/// A guide and its example.
struct Guide {
    text: &'static str,
    example: &'static str,
    main: fn() -> Result<(), Box<dyn std::error::Error>>,
}

static CURRENT: Mutex<()> = Mutex::new(());

/// Runs `test` while a new folder is the current one: some examples write files.
fn in_folder(test: impl FnOnce(&Path)) {
    let _guard = CURRENT.lock().unwrap_or_else(|error| error.into_inner());
    let folder = tempfile::tempdir().expect("a folder");
    std::env::set_current_dir(folder.path()).expect("it can be entered");
    test(folder.path());
    std::env::set_current_dir(env!("CARGO_MANIFEST_DIR")).expect("it is still there");
}

/// The blocks of `text` that are fenced as `kind`.
fn blocks<'t>(text: &'t str, kind: &str) -> Vec<&'t str> {
    let fence = format!("```{kind}\n");
    let parts = text.split(fence.as_str()).skip(1);
    parts.map(|rest| rest.split("```").next().expect("a part")).collect()
}

impl Guide {
    /// Compares the guide's code with the example, and its output with what the example prints.
    fn check(&self) {
        let code = self.example.split_once("\n\n").expect("a heading").1;
        let code = code.replace("\npub(crate) fn main()", "\nfn main()");
        assert_eq!(blocks(self.text, "rust").join("\n"), code, "the guide is not the example");
        PRINTED.take();
        (self.main)().expect("the example runs");
        let printed = PRINTED.take();
        let shown = blocks(self.text, "text").into_iter().filter(|block| !block.starts_with('$'));
        let (shown, mut expected) = (shown.collect::<String>(), printed.lines());
        for line in shown.lines() {
            let expected = expected.next().unwrap_or_default();
            assert!(alike(line, expected), "shown: {line}\nprinted: {expected}\nall:\n{printed}");
        }
        assert_eq!(expected.next(), None, "not shown; all that was printed:\n{printed}");
    }
}

/// Returns whether two lines are equal. In lines about spiking neurons numbers may differ a little, because processors
/// round differently.
fn alike(shown: &str, printed: &str) -> bool {
    let number = |word: &str| word.parse::<f64>().ok();
    let spiking = ["spiking", "lif"].iter().any(|mode| shown.starts_with(mode));
    let near = |(a, b): (&str, &str)| match (number(a), number(b)) {
        (Some(a), Some(b)) if spiking => (a - b).abs() <= if a < 2.0 { 0.2 } else { 20.0 },
        _ => a == b,
    };
    shown.split(' ').count() == printed.split(' ').count()
        && shown.split(' ').zip(printed.split(' ')).all(near)
}

/// Text without its line breaks and runs of spaces: guides wrap long lines.
fn flat(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Runs the commands in a guide's blocks, and looks for each paragraph that the guide shows in their output. Returns the
/// number of commands.
fn run_blocks(guide: &str, folder: &Path) -> usize {
    let mut ran = 0;
    for command in blocks(guide, "text").into_iter().flat_map(|block| block.split("$ ").skip(1)) {
        let (line, expected) = command.split_once('\n').expect("a command ends its line");
        if let Some((text, file)) = line.strip_prefix("echo '").and_then(|l| l.split_once("' > ")) {
            fs::write(folder.join(file), text).expect("writes");
            continue;
        }
        let args = line.strip_prefix("symbolt ").expect("a command of ours").split(' ');
        let mut program = Command::cargo_bin("symbolt").expect("the program was built");
        let output = program.current_dir(folder).args(args).output().expect("it starts");
        let said = [output.stdout, output.stderr]
            .map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
        let said = flat(&said.concat());
        for paragraph in expected.split("\n\n").map(flat).filter(|p| !p.is_empty()) {
            assert!(
                said.contains(&paragraph),
                "`{line}` should say\n{paragraph}\nand says\n{said}"
            );
        }
        ran += 1;
    }
    ran
}

macro_rules! guide {
    ($text:literal, $example:ident) => {
        Guide {
            text: include_str!(concat!("../../docs/", $text, ".md")),
            example: include_str!(concat!("../../examples/", stringify!($example), ".rs")),
            main: $example::main,
        }
    };
}

#[test]
fn the_guide_to_planner_graphs_shows_what_its_program_prints() {
    guide!("planner_graph", guide_planner_graph).check();
}

#[test]
fn the_guide_to_modules_shows_what_its_program_prints() {
    guide!("own_module", guide_own_module).check();
}

#[test]
fn the_guide_to_the_neural_engineering_framework_shows_what_its_program_prints() {
    guide!("nef", guide_nef).check();
}

#[test]
fn the_guide_to_expressions_shows_what_its_program_prints() {
    guide!("expressions", guide_expressions).check();
}

#[test]
fn the_guide_to_ablations_shows_what_its_program_prints() {
    in_folder(|_| guide!("ablation", guide_ablation).check());
}

#[test]
fn the_guide_to_timing_shows_what_its_program_and_the_command_print() {
    let guide = guide!("timing", guide_timing);
    guide.check();
    let folder = tempfile::tempdir().expect("a folder");
    assert_eq!(run_direct_lines(guide.text, folder.path()), 9);
}

/// Runs the guide's experiment, and looks for each line that the guide shows before the spiking mode. Returns the number
/// of lines.
fn run_direct_lines(guide: &str, folder: &Path) -> usize {
    let block = blocks(guide, "text").into_iter().find(|block| block.starts_with("$ symbolt"));
    let (command, shown) = block.and_then(|b| b.split_once('\n')).expect("a command");
    let args = command.trim_start_matches("$ symbolt ").split(' ');
    let mut program = Command::cargo_bin("symbolt").expect("the program was built");
    let output = program.current_dir(folder).args(args).output().expect("it starts");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let (exact, _) = shown.split_once("mode = lif").expect("a second table");
    let exact = exact.lines().filter(|line| !line.is_empty());
    exact.map(|line| assert!(said.lines().any(|l| l == line), "{line} in {said}")).count()
}

#[test]
fn the_guide_to_your_own_task_shows_what_its_program_and_the_commands_print() {
    let guide = guide!("own_task", guide_own_task);
    in_folder(|folder| {
        guide.check();
        let text = fs::read_to_string(folder.join("packing.csv")).expect("the example wrote it");
        let bad = text.replacen(",box_1,", ",box_1,?", 1);
        assert_ne!(text, bad);
        fs::write(folder.join("bad.csv"), bad).expect("writes");
        assert_eq!(run_blocks(guide.text, folder), 7);
    });
}

#[test]
fn the_guide_to_the_scene_shows_what_its_program_and_the_commands_print() {
    let guide = guide!("scene", assembly_scene);
    guide.check();
    let folder = tempfile::tempdir().expect("a folder");
    assert_eq!(run_blocks(guide.text, folder.path()), 2);
}

#[test]
fn the_guide_to_task_files_shows_a_file_that_runs_and_what_the_command_prints() {
    let guide = include_str!("../../docs/task_file.md");
    let folder = tempfile::tempdir().expect("a folder");
    let [file, ..] = blocks(guide, "json")[..] else { panic!("a file") };
    fs::write(folder.path().join("mat.json"), file).expect("writes");
    assert_eq!(run_blocks(guide, folder.path()), 1);
}
