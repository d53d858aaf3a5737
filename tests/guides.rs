//! The guides' shell blocks print what the guides say; their Rust blocks are doctests.

#![allow(clippy::unwrap_used, clippy::expect_used)]
#![cfg(feature = "cli")]

use std::fs;
use std::path::Path;

use assert_cmd::Command;

/// The recording and the scene that `docs/own_task.md` makes in code, and a damaged recording.
fn packing(folder: &Path) {
    let objects = |boxed: [f64; 3], lid: [f64; 3]| {
        let object = |(id, kind, at): (&str, &str, [f64; 3])| {
            format!(r#"{{"id":"{id}","kind":"{kind}","position":{at:?},"orientation":[0,0,0,1]}}"#)
        };
        let all = [("b", "box", boxed), ("l", "lid", lid), ("s", "stand", [0.5, 0.0, 0.1])];
        format!(r#""objects":[{}]}}"#, all.map(object).join(","))
    };
    let mut text = String::new();
    for demo in 0..4 {
        let k = f64::from(demo);
        let found = [0.2 + 0.05 * k, 0.3 - 0.04 * k * k, 0.05];
        let lid = [0.1 + 0.03 * k, -0.3 + 0.07 * k, 0.01];
        let (stood, covered) = ([0.5, 0.0001 * k, 0.15], [0.5 - 0.0001 * k, 0.0, 0.21]);
        let steps = [
            (r#""start""#, found, lid),
            (r#""contact","object":"b""#, found, lid),
            (r#""release","object":"b""#, stood, lid),
            (r#""contact","object":"l""#, stood, lid),
            (r#""release","object":"l""#, stood, covered),
            (r#""end""#, stood, covered),
        ];
        for (number, (event, boxed, lid)) in steps.into_iter().enumerate() {
            let head = format!(r#"{{"demo":{demo},"snapshot":{number},"event":{event},"#);
            text += &(head + &objects(boxed, lid) + "\n");
        }
    }
    let scene = format!("{{{}", objects([0.33, 0.21, 0.05], [0.17, -0.13, 0.01]));
    fs::write(folder.join("bad.jsonl"), text.replace("[0.5, 0.0, 0.1]", "[0.5, 0.0]"))
        .expect("writes");
    fs::write(folder.join("packing.jsonl"), text).expect("writes");
    fs::write(folder.join("scene.json"), scene).expect("writes");
}

/// Text without its line breaks and runs of spaces: guides wrap long lines.
fn flat(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Runs the commands of a guide's shell blocks, each paragraph of whose output has to come; how many ran.
fn run_blocks(guide: &str, folder: &Path) -> usize {
    let blocks = guide.split("```text\n").skip(1).filter_map(|rest| rest.split("```").next());
    let mut ran = 0;
    for command in blocks.flat_map(|block| block.split("$ ").skip(1)) {
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

#[test]
fn the_guide_to_a_task_of_ones_own_shows_what_the_program_says() {
    let folder = tempfile::tempdir().expect("a folder");
    packing(folder.path());
    assert_eq!(run_blocks(include_str!("../docs/own_task.md"), folder.path()), 5);
}

#[test]
fn the_guide_to_the_scene_shows_what_the_program_says() {
    let folder = tempfile::tempdir().expect("a folder");
    assert_eq!(run_blocks(include_str!("../docs/scene.md"), folder.path()), 2);
}
