//! What a stranger reads first: version, date, citation, oldest compiler, and what the checks cost.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use symbolt::prelude::*;

use crate::examples::plan_tea;
use crate::models::question_answering;

fn read(file: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{file}: {error}"))
}

/// The value of `key = "value"` or `key: value` on a line of its own.
fn value<'t>(text: &'t str, key: &str) -> Option<&'t str> {
    let rest = |line: &'t str| line.strip_prefix(key)?.trim_start().strip_prefix(['=', ':']);
    text.lines().find_map(rest).map(|value| value.trim().trim_matches('"'))
}

/// Why version, date and citation do not belong together, if they do not.
fn fault_of_version(manifest: &str, changelog: &str, citation: &str) -> Option<String> {
    let version = value(manifest, "version").unwrap_or("a version that is missing");
    let Some(entry) = changelog.lines().find_map(|l| l.strip_prefix(&format!("## {version} - ")))
    else {
        return Some(format!("the changelog has no dated entry for {version}"));
    };
    for (key, expected) in [("version", version), ("date-released", entry)] {
        if value(citation, key) != Some(expected) {
            return Some(format!("`{key}` in CITATION.cff is not {expected}"));
        }
    }
    let dated = entry.len() == 10 && entry.bytes().filter(u8::is_ascii_digit).count() == 8;
    (!dated).then(|| format!("{entry} is no date"))
}

#[test]
fn version_changelog_and_citation_belong_together() {
    let [manifest, changelog, citation] = ["Cargo.toml", "CHANGELOG.md", "CITATION.cff"].map(read);
    assert_eq!(value(&manifest, "version"), Some(env!("CARGO_PKG_VERSION")));
    assert_eq!(fault_of_version(&manifest, &changelog, &citation), None);
    let other = manifest.replace("version = \"", "version = \"9.");
    assert!(fault_of_version(&other, &changelog, &citation).is_some());
    let older = citation.replace("date-released: 2", "date-released: 1");
    assert!(fault_of_version(&manifest, &changelog, &older).is_some());
    // Keys of the format 1.2.0 that are required, and some of those that it knows.
    for key in ["cff-version", "message", "title", "authors"] {
        assert!(value(&citation, key).is_some(), "{key}");
    }
    let known = [
        "abstract",
        "authors",
        "cff-version",
        "date-released",
        "keywords",
        "license",
        "message",
        "references",
        "title",
        "type",
        "version",
    ];
    let keys = citation.lines().filter(|line| line.starts_with(|c: char| c.is_alphabetic()));
    for key in keys.filter_map(|line| line.split(':').next()) {
        assert!(known.contains(&key), "{key}");
    }
}

#[test]
fn the_oldest_compiler_is_said_alike() {
    let manifest = read("Cargo.toml");
    let oldest = value(&manifest, "rust-version").expect("there");
    assert_eq!(value(&read("benches/Cargo.toml"), "rust-version"), Some(oldest));
    assert!(read("README.md").contains(&format!("Rust {oldest} or later")));
    let contributing = read("CONTRIBUTING.md");
    assert!(contributing.contains(&format!("`rust-version` in `Cargo.toml`, {oldest}.")));
    assert!(contributing.contains(&format!("`cargo +{oldest}.0 check` compiled")));
}

#[test]
fn every_step_of_the_checks_has_its_cost() {
    let script = read(".ci/run");
    let steps: BTreeSet<&str> =
        script.lines().filter_map(|line| line.strip_prefix("step \"")?.strip_suffix('"')).collect();
    assert!(steps.len() > 10);
    let contributing = read("CONTRIBUTING.md");
    let table = contributing.split_once("| step |").expect("a table").1;
    let table = table.split("\n\n").next().expect("a part");
    let rows = table.lines().filter_map(|line| line.strip_prefix("| ")?.split(" |").next());
    assert_eq!(rows.collect::<BTreeSet<_>>(), steps);
}

/// The points of each curve of a chart, as numbers of pixels. Axes and their ticks are black.
fn curves(svg: &str) -> Vec<Vec<f64>> {
    let lines = svg.split("<polyline").skip(1).map(|rest| rest.split('>').next().unwrap_or(""));
    let points = |line: &str| {
        let (_, points) = line.split_once("points=\"")?;
        let points = points.split('"').next()?.split([' ', ',']);
        Some(points.filter_map(|number| number.parse().ok()).collect())
    };
    lines.filter(|line| !line.contains("#000000")).filter_map(points).collect()
}

/// Whether two charts have the same curves, but for what spikes differ from machine to machine.
fn alike(one: &[Vec<f64>], other: &[Vec<f64>]) -> bool {
    let difference = |(a, b): (&Vec<f64>, &Vec<f64>)| {
        let sum: f64 = a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum();
        a.len() == b.len() && sum / (a.len() as f64) < 6.0
    };
    !one.is_empty() && one.len() == other.len() && one.iter().zip(other).all(difference)
}

/// With `SYMBOLT_WRITE_DOCS` the pictures are made anew.
#[test]
fn the_charts_of_the_readme_are_those_of_the_examples() {
    let spikes = PopulationPlan::lif();
    let answers = question_answering::run(&spikes, Seed::new(1)).expect("runs");
    let commands = plan_tea::run().expect("runs");
    let charts = [
        ("answers", answers.to_svg("What is red? A circle? Blue? A square?")),
        ("tea", commands.to_svg("Commands of the planner, in spikes")),
    ];
    for (name, made) in &charts {
        let file = format!("docs/images/{name}.svg");
        if std::env::var_os("SYMBOLT_WRITE_DOCS").is_some() {
            fs::write(Path::new(env!("CARGO_MANIFEST_DIR")).join(&file), made).expect("written");
        }
        let (made, mut shown) = (curves(made), curves(&read(&file)));
        assert!(alike(&made, &shown), "{file} shows something else");
        shown.reverse();
        assert!(!alike(&made, &shown));
    }
    let order: Vec<&str> = commands.switches(0.4).into_iter().map(|(_, action)| action).collect();
    let expected = [
        "unplug-kettle",
        "put-kettle-under-tap",
        "plug-in-kettle",
        "fill-kettle-from-tap",
        "boil-kettle",
    ];
    assert_eq!(order, expected);
}
