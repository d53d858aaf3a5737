//! README and `docs`: length, links, and their blocks, tables and figures against the program, the sources and other tests.

#![allow(clippy::unwrap_used, clippy::expect_used)]
#![cfg(feature = "cli")]

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::Value;
use symbolt::prelude::*;
use symbolt::study::catalogue;
use symbolt::task::planner::PlanEnd;
use symbolt::task::tasks::nuts_and_bolts::NutsAndBolts;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn read(file: &str) -> String {
    fs::read_to_string(root().join(file)).unwrap_or_else(|error| panic!("{file}: {error}"))
}

/// README, CONTRIBUTING and the pages of `docs`, by their paths.
fn pages() -> Vec<String> {
    let files = fs::read_dir(root().join("docs")).expect("a folder");
    let names = files.filter_map(|file| file.ok()?.file_name().into_string().ok());
    let pages = names.filter(|name| name.ends_with(".md")).map(|name| format!("docs/{name}"));
    let mut pages: Vec<String> =
        pages.chain(["README.md", "CONTRIBUTING.md"].map(str::to_owned)).collect();
    pages.sort();
    pages
}

fn symbolt(folder: &Path, args: &[&str]) -> String {
    let mut program = Command::cargo_bin("symbolt").expect("the program was built");
    let output = program.current_dir(folder).args(args).output().expect("it starts");
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The cells of each row of the tables in a page, without headings.
fn rows(page: &str) -> Vec<Vec<String>> {
    let lines: Vec<&str> = page.lines().collect();
    let is_row = |line: &str| line.starts_with("| ");
    let is_rule = |line: &&str| line.starts_with("|---");
    let all = lines
        .iter()
        .enumerate()
        .filter(|(at, line)| is_row(line) && !lines.get(at + 1).is_some_and(is_rule));
    let cells = |line: &str| {
        let cells = line.trim_matches('|').split(" | ");
        cells.map(|cell| cell.trim().to_owned()).collect()
    };
    all.map(|(_, line)| cells(line)).collect()
}

/// The texts between back-quotes.
fn quoted(text: &str) -> Vec<&str> {
    text.split('`').skip(1).step_by(2).collect()
}

#[test]
fn the_readme_has_at_most_1200_words_and_no_gaps() {
    let readme = read("README.md");
    assert!(!readme.contains("@@"), "a figure is missing");
    let words = readme.split_whitespace().count();
    assert!(words <= 1_200, "{words} words");
}

/// The targets of a page's links and images.
fn targets(page: &str) -> Vec<String> {
    let inline = page.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    let defined = page.lines().filter(|line| line.starts_with('['));
    let defined = defined.filter_map(|line| line.split_once("]: ")).map(|(_, target)| target);
    inline.chain(defined).map(str::to_owned).collect()
}

/// A heading as a link refers to it.
fn anchor(heading: &str) -> String {
    let heading = heading.trim_start_matches('#').trim().to_lowercase().replace(' ', "-");
    heading.chars().filter(|c| c.is_alphanumeric() || *c == '-').collect()
}

#[test]
fn every_relative_link_and_image_leads_somewhere() {
    let mut checked = 0;
    for page in pages() {
        let text = read(&page);
        for target in targets(&text) {
            if target.starts_with("http") {
                continue;
            }
            let (file, part) = target.split_once('#').unwrap_or((&target, ""));
            let folder = root().join(&page).parent().expect("a folder").to_path_buf();
            let path = if file.is_empty() { root().join(&page) } else { folder.join(file) };
            assert!(path.exists(), "{page}: {target}");
            if !part.is_empty() {
                let text = fs::read_to_string(&path).expect("text");
                let mut headings = text.lines().filter(|line| line.starts_with('#'));
                assert!(headings.any(|heading| anchor(heading) == part), "{page}: {target}");
            }
            checked += 1;
        }
        // A link by reference without a definition shows its brackets.
        let prose: String = text.split("```").step_by(2).collect();
        for name in prose.split("][").skip(1).filter_map(|rest| rest.split(']').next()) {
            assert!(text.contains(&format!("\n[{name}]: ")), "{page}: [{name}]");
        }
    }
    assert!(checked > 40, "{checked}");
}

/// Blocks of the README that follow `<!-- lines of: symbolt ... -->`: the command and its lines.
fn shown_in_the_readme() -> Vec<(Vec<&'static str>, Vec<&'static str>)> {
    let readme = include_str!("../../README.md");
    let mut lines = readme.lines();
    let mut shown = Vec::new();
    while let Some(line) = lines.next() {
        let Some(command) = line.strip_prefix("<!-- lines of: symbolt ") else { continue };
        let command = command.trim_end_matches(" -->").split(' ').collect();
        assert_eq!(lines.next(), Some("```text"));
        let block = lines.by_ref().take_while(|l| *l != "```").filter(|l| !l.is_empty()).collect();
        shown.push((command, block));
    }
    shown
}

/// Whether a printed line is the shown one. In spikes, numbers differ by some percent from machine to machine.
fn is_shown(printed: &str, shown: &str, in_spikes: bool) -> bool {
    let near = |a: &str, b: &str| match (a.parse::<f64>(), b.parse::<f64>()) {
        (Ok(a), Ok(b)) => in_spikes && (a - b).abs() <= 0.15 * b,
        _ => a == b,
    };
    let (words, others) = (printed.split_whitespace(), shown.split_whitespace());
    printed == shown
        || words.clone().count() == others.clone().count()
            && words.zip(others).all(|(a, b)| near(a, b))
}

#[test]
fn the_readme_shows_what_the_program_prints_and_the_commands_page_what_it_writes() {
    assert!(is_shown("  500 ms  (fill)", "  512 ms  (fill)", true));
    for (printed, in_spikes) in
        [("  400 ms  (fill)", true), ("  512 ms  (boil)", true), ("  500 ms  (fill)", false)]
    {
        assert!(!is_shown(printed, "  512 ms  (fill)", in_spikes), "{printed}");
    }
    let shown = shown_in_the_readme();
    assert_eq!(shown.len(), 2);
    let mut listed = 0;
    for (command, block) in shown {
        let folder = tempfile::tempdir().expect("a folder");
        fs::create_dir(folder.path().join("examples")).expect("a folder");
        for file in command.iter().filter(|file| file.ends_with(".pddl")) {
            fs::copy(root().join(file), folder.path().join(file)).expect("an example");
        }
        let printed = symbolt(folder.path(), &command);
        let mut rest = printed.lines();
        assert!(block.len() > 5);
        for line in block {
            let found = rest.any(|l| is_shown(l, line, command.contains(&"lif")));
            assert!(found, "not printed, or not in this order: {line}");
        }
        let Ok(written) = fs::read_dir(folder.path().join("out")) else { continue };
        let written: BTreeSet<String> =
            written.filter_map(|file| file.ok()?.file_name().into_string().ok()).collect();
        let page = read("docs/commands.md");
        let files = page.split_once("## The files of a run").expect("a heading").1;
        let named: BTreeSet<String> =
            rows(files).iter().map(|row| row[0].trim_matches('`').to_owned()).collect();
        assert_eq!(named, written);
        listed += 1;
    }
    assert_eq!(listed, 1);
}

/// The files of a folder of `tests`, by their stems, with their texts.
fn tests_in(group: &str) -> Vec<(String, String)> {
    let files = fs::read_dir(root().join("tests").join(group)).expect("a folder");
    let paths = files.filter_map(|file| Some(file.ok()?.path()));
    let sources = paths.filter(|path| path.extension().is_some_and(|e| e == "rs"));
    let stem = |path: &Path| path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    sources.map(|path| (stem(&path), fs::read_to_string(&path).expect("text"))).collect()
}

#[test]
fn the_commands_for_ignored_tests_run_the_long_statistics_and_the_longer_ones_apart() {
    let (mut long, mut longer) = (BTreeSet::new(), BTreeSet::new());
    for group in fs::read_dir(root().join("tests")).expect("a folder").filter_map(Result::ok) {
        let name = group.file_name().to_string_lossy().into_owned();
        if !group.path().join("main.rs").exists() {
            continue;
        }
        for (file, text) in tests_in(&name) {
            // This file only looks for the mark.
            for mark in text.split("#[ignore = \"").skip(1).filter(|_| file != "docs") {
                let long_statistics = mark.starts_with("long statistics")
                    || mark.starts_with("long: two simulated hours");
                if long_statistics { &mut long } else { &mut longer }.insert(name.clone());
            }
        }
    }
    assert!(long.is_disjoint(&longer), "{long:?} {longer:?}");
    let command = |groups: &BTreeSet<String>| {
        let names: String = groups.iter().map(|name| format!(" --test {name}")).collect();
        format!("cargo test{names} -- --ignored")
    };
    for page in ["CONTRIBUTING.md", "docs/verification.md"] {
        assert!(read(page).contains(&(command(&long) + "\n")), "{page} lacks {}", command(&long));
    }
    let (ci, apart) = (read(".ci/run"), format!("`{}`", command(&longer)));
    let programs: Vec<&str> = long.iter().map(String::as_str).collect();
    let in_ci = format!("for program in {}; do long \"$program\"; done", programs.join(" "));
    assert!(ci.contains(&in_ci), "CI");
    assert!(read("docs/verification.md").contains(&apart), "docs/verification.md lacks {apart}");
}

/// Figures of `docs/verification.md` and `docs/experiments.md`, and the test that asserts each in these words.
const ASSERTED: &[(&str, &str, &str, &str)] = &[
    (
        "verification",
        "the next merge at 1.171 mm",
        "needs/recordings.rs",
        "(next[\"bolt\"] - 0.001171).abs() < 5e-7",
    ),
    ("verification", "means within 0.1 mm", "needs/recordings.rs", "worst < 1e-4"),
    ("verification", "40 of 40 episodes", "task/scene.rs", "for seed in 0..40"),
    ("verification", "slip less than a millimetre", "task/scene.rs", "slip_m < 1e-3"),
    ("verification", "320 of 320 answers", "engine/populations.rs", "of 320 accepted"),
    (
        "verification",
        "within 8 points of the paper",
        "cli/experiments.rs",
        "(ours - paper).abs() < 8.0",
    ),
    ("verification", "our decoder exceeds 99.9%", "cli/experiments.rs", "best >= 99.9"),
    (
        "verification",
        "as predicted in 68 cells",
        "cli/experiments.rs",
        "(off.len(), gain.len()), (68, 68)",
    ),
    (
        "verification",
        "10,000 and 1,000 trials a cell",
        "cli/experiments.rs",
        "\"--trials\", \"1000\"",
    ),
    ("verification", "signal 9 at 50 random moments", "cli/experiments.rs", "killed(50)"),
    (
        "experiments",
        "| 98.8 | 98.3 | 96.9 | 94.6 | 80.5 |",
        "cli/experiments.rs",
        "[98.8, 98.3, 96.9, 94.6, 80.5]",
    ),
    ("experiments", "In 68 cells", "cli/experiments.rs", "(68, 68)"),
    (
        "speed",
        "after 41 ms (median of 10 seeds)",
        "engine/populations.rs",
        "(Unbinding::Products, 65.0)",
    ),
];

#[test]
fn figures_of_long_tests_stand_in_the_tests() {
    for (page, shown, test, asserted) in ASSERTED {
        let text = read(&format!("docs/{page}.md")).to_lowercase();
        assert!(text.contains(&shown.to_lowercase()), "docs/{page}.md lacks: {shown}");
        assert!(read(&format!("tests/{test}")).contains(asserted), "tests/{test}: {asserted}");
    }
    let page = read("docs/verification.md");
    let tests = rows(page.split("## Measured by hand").next().expect("a part"));
    assert!(tests.len() > 15);
    for row in tests {
        for path in quoted(&row[2]) {
            assert!(root().join(path).exists(), "{path}");
        }
    }
}

#[test]
fn the_simulated_ms_are_those_of_the_planner() {
    let domain = DomainBuilder::of_the_paper().build().expect("valid");
    let planner = Planner::new(&domain, PlannerSpec::default(), Seed::new(1)).expect("builds");
    let goal = domain.state("BOLT_ASSEMBLED").expect("there");
    let scene = domain.counts(["NUT_ON_TABLE", "BOLT_ON_TABLE"]).expect("states");
    let plan = planner.plan(&scene, goal).expect("plans");
    assert_eq!(plan.end, PlanEnd::Met);
    let times: Vec<f64> = plan.steps.iter().map(|step| step.decision.time_ms).collect();
    let (first, whole) = (times[0], times.iter().sum::<f64>());
    let experiments = read("docs/experiments.md");
    assert!(experiments.contains(&format!("first decision {first} ms in direct mode")), "{first}");
    assert!(experiments.contains(&format!("a plan of three steps {whole} ms")), "{whole}");
    let speed = read("docs/speed.md");
    assert!(speed.contains(&format!("of {whole} simulated ms")), "{whole}");
}

/// What a line of the account says whatever the figures are: the first cell of a table's row and the number of cells, or a
/// sentence without numbers and the name of the machine.
fn shape_of_a_line(line: &str) -> String {
    if line.starts_with('|') {
        let cells: Vec<&str> = line.split(" | ").collect();
        return format!("{} {}", cells.len(), cells[0]);
    }
    let words = line.split(" on: ").next().unwrap_or_default();
    let words = words.replace(|c: char| c.is_ascii_digit() || ".,-".contains(c), "");
    words.replace("runs", "run").replace("threads", "thread")
}

#[test]
fn the_account_of_speed_has_the_shape_that_the_command_prints() {
    let args = ["--neurons-scale", "0.1", "--dimensions", "64", "--sim-seconds", "0.3"];
    let printed = [&["bench", "--account", "--quiet", "--runs", "1"], &args[..]].concat();
    let printed = symbolt(&root(), &printed);
    let page = read("docs/speed.md");
    let shown = page.split_once("Measured on ").and_then(|(_, rest)| rest.split_once("\n## What"));
    let shown = format!("Measured on {}", shown.expect("an account").0);
    let of = |text: &str| -> Vec<String> {
        text.lines().filter(|line| !line.is_empty()).map(shape_of_a_line).collect()
    };
    let (shown, printed) = (of(&shown), of(&printed));
    assert!(shown.len() > 30, "{shown:?}");
    assert_eq!(shown, printed);
}

#[test]
fn the_experiments_page_has_every_experiment_and_no_other() {
    let page = read("docs/experiments.md");
    for (name, _) in catalogue::all() {
        assert!(page.contains(&format!("`{name}`")), "{name}");
    }
    let known: Vec<&str> = catalogue::all().into_iter().map(|(name, _)| name).collect();
    let (table, _) = page.split_once("`table-4`, correct").expect("a second table");
    for row in rows(table) {
        assert!(quoted(&row[0]).iter().all(|name| known.contains(name)), "{row:?}");
    }
}

#[test]
fn the_commands_page_has_every_command_and_no_other() {
    let page = read("docs/commands.md");
    let listed = rows(page.split("| exit code").next().expect("a part"));
    let listed: BTreeSet<String> = listed
        .iter()
        .filter_map(|row| quoted(&row[0])[0].split(' ').nth(1).map(str::to_owned))
        .collect();
    let help = symbolt(&root(), &["--help"]);
    let commands = help.split_once("Commands:\n").expect("a list").1;
    let commands = commands.lines().take_while(|line| line.starts_with("  "));
    let commands: BTreeSet<String> = commands
        .filter(|line| !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next().map(str::to_owned))
        .filter(|name| name != "help")
        .collect();
    assert_eq!(listed, commands);
}

#[test]
fn the_architecture_page_has_every_room_and_no_other() {
    let page = read("docs/architecture.md");
    let listed: BTreeSet<String> = rows(&page)
        .iter()
        .flat_map(|row| quoted(&row[0]).into_iter().map(str::to_owned).collect::<Vec<_>>())
        .collect();
    for path in &listed {
        assert!(root().join(path).exists(), "{path}");
    }
    for folder in ["src", "src/task"] {
        for room in fs::read_dir(root().join(folder)).expect("a folder").filter_map(Result::ok) {
            let room = format!("{folder}/{}", room.file_name().to_string_lossy());
            assert!(!root().join(&room).is_dir() || listed.contains(&room), "{room}");
        }
    }
}

/// All sources as one text.
fn sources(folder: &Path, into: &mut String) {
    for entry in fs::read_dir(folder).expect("a folder").filter_map(Result::ok) {
        let path = entry.path();
        if path.is_dir() {
            sources(&path, into);
        } else {
            into.push_str(&fs::read_to_string(&path).unwrap_or_default());
        }
    }
}

/// Checks that the names in the second column of a page's tables are declared in the sources. Returns their number.
fn declared_names(page: &str, sources: &str) -> usize {
    let mut checked = 0;
    for row in rows(page).iter().filter(|row| row.len() > 1 && !row[0].starts_with("---")) {
        for name in
            quoted(&row[1]).into_iter().flat_map(|code| code.split(['(', ')', '&', ':', '.']))
        {
            if name.len() > 4 && name.chars().all(|c| c.is_alphanumeric() || c == '_') {
                let public = ["struct", "enum", "fn", "const fn", "const", "trait"];
                let mut forms: Vec<String> =
                    public.iter().map(|kind| format!("pub {kind} {name}")).collect();
                let inside = ["fn {}(", "fn {}<", "{}(", "{},", "pub {}: "];
                forms.extend(inside.map(|form| format!("    {}", form.replace("{}", name))));
                forms.push(format!("macro_rules! {name} "));
                let declared = forms.iter().any(|form| sources.contains(form));
                assert!(declared, "{name}");
                checked += 1;
            }
        }
    }
    checked
}

#[test]
fn names_in_the_tables_for_users_of_nengo_and_torchhd_exist() {
    let mut all = String::new();
    sources(&root().join("src"), &mut all);
    let readme = read("README.md");
    let table = readme.split_once("## Coming from nengo_spa").expect("a heading").1;
    let table = table.split("\n## ").next().expect("a part");
    let checked = declared_names(table, &all);
    assert!(checked > 20, "{checked}");
    let checked = declared_names(&read("docs/comparison.md"), &all);
    assert!(checked > 100, "{checked}");
}

/// The classes of the front end of Nengo 4.1 and nengo_spa 2.0, without those of their parameters, errors and warnings.
const CLASSES: &str = "\
Network Config Ensemble Node Connection Probe Simulator Process \
NeuronType RatesToSpikesNeuronType LIF LIFRate AdaptiveLIF AdaptiveLIFRate Direct Izhikevich RectifiedLinear \
SpikingRectifiedLinear Sigmoid Tanh RegularSpiking StochasticSpiking PoissonSpiking \
LearningRuleType PES RLS BCM Oja Voja \
Lowpass Alpha Triangle LinearFilter \
WhiteNoise FilteredNoise BrownNoise WhiteSignal PresentInput Piecewise \
Lstsq LstsqNoise LstsqMultNoise LstsqL2 LstsqL2nz LstsqL1 LstsqDrop Nnls NnlsL2 NnlsL2nz NoSolver \
Distribution Uniform Choice Samples Gaussian Exponential PDF SqrtBeta SubvectorLength CosineSimilarity \
UniformHypersphere ScatteredHypersphere QuasirandomSequence \
Dense Sparse SparseMatrix NoTransform Convolution ConvolutionTranspose Conv ConvTranspose ChannelShape \
ThresholdingEnsembles EnsembleArray Product Integrator Oscillator InputGatedMemory AssociativeMemory BasalGanglia \
Thalamus CircularConvolution \
ActionSelection Bind Compare IAAssocMem Scalar State Superposition ThresholdingAssocMem Transcode WTAAssocMem \
IdentityEnsembleArray MatrixMult VTB TVTB IA Thresholding WTA \
SemanticPointer Vocabulary VocabularyMap AxisAlignedVectors EquallySpacedPositiveUnitaryHrrVectors \
ExpectedUnitLengthVectors OrthonormalVectors UnitaryVectors UnitLengthVectors VectorsWithProperties \
AbstractAlgebra CommonProperties ElementSidedness HrrAlgebra HrrProperties TvtbAlgebra TvtbProperties VtbAlgebra \
VtbProperties";

#[test]
fn every_class_of_nengo_and_nengo_spa_has_a_counterpart_or_a_reason() {
    let page = read("docs/comparison.md");
    let rows: Vec<_> = rows(&page).into_iter().filter(|row| row.len() == 3).collect();
    let names = |row: &Vec<String>, class: &str| {
        let words = row[0].split(|c: char| !c.is_alphanumeric());
        words.chain(row[2].split('`')).any(|word| word == class)
    };
    let of = |class: &str| rows.iter().filter(|row| names(row, class)).count();
    let missing: Vec<&str> = CLASSES.split_whitespace().filter(|class| of(class) == 0).collect();
    assert_eq!(missing, Vec::<&str>::new(), "without a row");
    assert_eq!(of("Chimera"), 0);
    for row in &rows {
        assert!(row[1] != "none" || !row[2].is_empty(), "neither counterpart nor reason: {row:?}");
    }
    assert_eq!(CLASSES.split_whitespace().count(), 118);
}

/// The numbers in a value or a text, in order.
fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(all) => all.iter().flat_map(numbers).collect(),
        Value::Number(number) => number.as_f64().into_iter().collect(),
        Value::String(text) => {
            let text = text.replace(';', ",");
            let words = text.split(", ").map(|word| word.trim().replace(',', ""));
            words.filter_map(|word| word.parse().ok()).collect()
        }
        _ => Vec::new(),
    }
}

#[test]
fn the_scene_guide_has_the_defaults_of_the_scene() {
    let defaults = serde_json::json!(NutsAndBolts::default());
    let page = read("docs/scene.md");
    let table = page.split_once("| setting |").expect("a table").1;
    let table = table.split("\n\n").next().expect("a part");
    let table: Vec<_> = rows(table).into_iter().filter(|row| row.len() == 3).collect();
    assert!(table.len() > 15);
    for row in table {
        let settings = quoted(&row[0]);
        let pointer = |setting: &&str| format!("/{}", setting.replace('.', "/"));
        let values = settings.iter().map(pointer).map(|at| defaults.pointer(&at).cloned());
        let values: Vec<Value> = values.collect::<Option<_>>().unwrap_or_else(|| panic!("{row:?}"));
        let shown = numbers(&Value::String(row[2].clone()));
        let expected: Vec<f64> = values.iter().flat_map(numbers).collect();
        let same =
            settings.len() > 1 && shown.len() == 1 && expected.iter().all(|e| *e == shown[0]);
        assert!(same || shown == expected, "{row:?}: {expected:?}");
        for value in values.iter().filter_map(Value::as_str) {
            assert!(row[2].contains(value), "{row:?}: {value}");
        }
    }
}

#[test]
fn the_planner_guides_have_the_defaults_of_the_planner() {
    let spec = PlannerSpec::default();
    let ms = |span: SimDuration| format!("{} ms", span.as_millis_f64());
    let timing = spec.timing;
    let waits = [timing.load, timing.settle, timing.hold, timing.patience];
    let listed = waits.map(|wait| wait.as_millis_f64().to_string()).join(", ");
    let (planner, timings) = (read("docs/planner_graph.md"), read("docs/timing.md"));
    let expected = [
        ("dimensions", spec.dimensions.to_string()),
        ("max_similarity", spec.max_similarity.to_string()),
        ("commitment", format!("`{:?}`", spec.commitment)),
        ("absent", if spec.absent { "yes" } else { "no" }.to_owned()),
        ("unbinding", format!("`{:?}`", spec.unbinding)),
        ("synapse", ms(spec.synapse)),
        ("retention", spec.retention.to_string()),
        ("timing", format!("{listed} ms")),
        ("without", if spec.without.is_none() { "none" } else { "some" }.to_owned()),
    ];
    let table = rows(&planner);
    for (name, default) in expected {
        let row = table.iter().find(|row| row[0] == format!("`{name}`")).expect(name);
        assert_eq!(row[2], default, "{name}");
    }
    for (name, wait) in ["load", "settle", "hold", "patience"].into_iter().zip(waits) {
        let row = rows(&timings).into_iter().find(|row| row[0] == format!("`{name}`"));
        assert_eq!(row.expect(name)[1], ms(wait), "{name}");
    }
    let lif = Tuning::default();
    let numbers = format!(
        "`per_dimension` ({}), `per_item` ({}), `per_product` ({}) and `per_function` ({})",
        lif.per_dimension, lif.per_item, lif.per_product, lif.per_function
    );
    let ablation = read("docs/ablation.md").replace('\n', " ");
    assert!(ablation.contains(&numbers), "{numbers}");
}

#[test]
fn build_profiles_are_the_same_in_the_readme_and_in_the_crates_front_page() {
    let readme = read("README.md");
    let snippet = readme.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next());
    let front: String = snippet.expect("a snippet").lines().map(|l| format!("//! {l}\n")).collect();
    assert!(read("src/lib.rs").contains(&front), "{front}");
}

#[test]
fn every_recovery_of_the_folder_stands_in_the_ladder() {
    let entries = fs::read_dir(root().join("src/task/execute/recovery")).expect("a folder");
    let names = entries.map(|e| e.expect("readable").file_name().into_string().expect("text"));
    let rest =
        ["mod", "attempts", "begin", "places", "plight", "rung"].map(|name| format!("{name}.rs"));
    let text = read("src/task/execute/recovery/mod.rs");
    let ladder = text.split("const LADDER").nth(1).and_then(|t| t.split("];").next());
    let ladder = ladder.expect("there is a ladder");
    let mut count = 0;
    for name in names.filter(|name| !rest.contains(name)) {
        let own = name.strip_suffix(".rs").expect("a file of Rust");
        assert!(ladder.contains(&format!("&{own}::")), "{own} is in no rung");
        count += 1;
    }
    assert_eq!(count, 6);
}
