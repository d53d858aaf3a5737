//! Folders of planning problems in PDDL, as the experiment `ipc` finds them.

#![allow(clippy::expect_used)]

use std::path::Path;

use symbolt::study::catalogue::{Options, find};
use symbolt::task::TaskError;

const DOMAIN: &str = "(define (domain door) (:predicates (open))
    (:action push :parameters () :precondition (not (open)) :effect (open)))";
const PROBLEM: &str = "(define (problem leave) (:domain door) (:init) (:goal (open)))";

fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, text).expect("a file");
    }
    folder
}

/// Returns the problems in a folder: group, name, and a number that tells the text of both files.
fn problems_in(place: &Path) -> Result<Vec<String>, TaskError> {
    let options = Options { problems: Some(place.into()), ..Options::default() };
    let settings = find("ipc", &options)?.about().settings;
    let files = settings["files"].as_array().expect("a list").iter();
    Ok(files.map(|file| file.as_str().expect("text").to_owned()).collect())
}

/// Returns the problems in a folder: group, name, and the action of the domain that was found for it.
fn with_actions(place: &Path) -> Vec<String> {
    let known = ["push", "pull", "lift"].map(|action| {
        let domain = DOMAIN.replace("push", action);
        let alone = folder(&[("domain.pddl", &domain), ("task.pddl", PROBLEM)]);
        let found = problems_in(alone.path()).expect("a problem").swap_remove(0);
        (found.rsplit(' ').next().expect("a number").to_owned(), action)
    });
    let named = |file: String| {
        let (problem, number) = file.rsplit_once(' ').expect("a number");
        let action = known.iter().find(|(known, _)| known == number).expect("a domain").1;
        format!("{problem} {action}")
    };
    problems_in(place).expect("problems").into_iter().map(named).collect()
}

/// Files of the outermost folder are in the group of their domain's name.
#[test]
fn two_problems_of_one_name_do_not_share_one_result() {
    let place = folder(&[
        ("domain.pddl", DOMAIN),
        ("task01.pddl", PROBLEM),
        ("door/domain.pddl", DOMAIN),
        ("door/task01.pddl", PROBLEM),
    ]);
    let Err(fault) = problems_in(place.path()) else { panic!("one result for two problems") };
    assert!(fault.to_string().contains("two problems `task01` in `door`"), "{fault}");
}

#[test]
fn domains_are_found_beside_their_problems() {
    let other = DOMAIN.replace("push", "pull");
    let place = folder(&[
        ("a/domain.pddl", DOMAIN),
        ("a/task02.pddl", PROBLEM),
        ("a/task01.pddl", PROBLEM),
        ("b/domain01.pddl", DOMAIN),
        ("b/domain02.pddl", &other),
        ("b/problem01.pddl", PROBLEM),
        ("b/problem02.pddl", PROBLEM),
        ("b/c/p03-domain.pddl", DOMAIN),
        ("b/c/p03.PDDL", PROBLEM),
        ("door.pddl", PROBLEM),
        ("the_domain.pddl", &other),
        ("readme.txt", "no PDDL"),
    ]);
    assert_eq!(
        with_actions(place.path()),
        [
            "a task01 push",
            "a task02 push",
            "b problem01 push",
            "b problem02 pull",
            "b/c p03 push",
            "door door pull"
        ]
    );
}

#[cfg(unix)]
#[test]
fn a_link_to_a_folder_does_not_add_its_problems_again() {
    let files = [("domain.pddl", DOMAIN), ("task01.pddl", PROBLEM)];
    let (place, elsewhere) = (folder(&files), folder(&files));
    let link = |target: &Path, name: &str| {
        std::os::unix::fs::symlink(target, place.path().join(name)).expect("a link");
    };
    link(place.path(), "loop");
    link(elsewhere.path(), "elsewhere");
    link(&elsewhere.path().join("task01.pddl"), "task02.pddl");
    assert_eq!(with_actions(place.path()), ["door task01 push", "door task02 push"]);
    // The folder itself may be a link.
    let found = problems_in(&place.path().join("elsewhere")).expect("problems");
    assert_eq!(found.len(), 1);
    std::fs::remove_file(place.path().join("task01.pddl")).expect("removed");
    std::fs::remove_file(place.path().join("task02.pddl")).expect("removed");
    let fault = problems_in(place.path()).expect_err("only links").to_string();
    assert!(fault.contains("links to folders are not followed"), "{fault}");
}

#[test]
fn a_problem_is_not_lost_among_too_many_entries() {
    let place = folder(&[("big/domain.pddl", DOMAIN), ("big/task01.pddl", PROBLEM)]);
    let big = place.path().join("big");
    for i in 0..20_000 - 2 {
        std::fs::File::create(big.join(i.to_string())).expect("a file");
    }
    assert_eq!(problems_in(place.path()).expect("just as many as allowed").len(), 1);
    std::fs::write(big.join("task02.pddl"), PROBLEM).expect("a file");
    let fault = problems_in(place.path()).expect_err("one too many").to_string();
    assert!(fault.contains("big has more than 20000 entries"), "{fault}");
}

#[test]
fn task01_belongs_to_domain1() {
    let other = DOMAIN.replace("push", "pull");
    let third = DOMAIN.replace("push", "lift");
    let place = folder(&[
        ("a/domain1.pddl", DOMAIN),
        ("a/domain2.pddl", &other),
        ("a/task01.pddl", PROBLEM),
        ("a/task2.pddl", PROBLEM),
        ("a/task002.pddl", PROBLEM),
        // The same digits come first.
        ("b/domain01.pddl", DOMAIN),
        ("b/domain1.pddl", &other),
        ("b/task01.pddl", PROBLEM),
        ("b/task1.pddl", PROBLEM),
        ("c/domain0.pddl", DOMAIN),
        ("c/domain12.pddl", &other),
        ("c/domain.pddl", &third),
        ("c/leave.pddl", PROBLEM),
        ("c/task00.pddl", PROBLEM),
        ("c/task1-2.pddl", PROBLEM),
    ]);
    assert_eq!(
        with_actions(place.path()),
        [
            "a task002 pull",
            "a task01 push",
            "a task2 pull",
            "b task01 push",
            "b task1 pull",
            "c leave lift",
            "c task00 push",
            "c task1-2 lift"
        ]
    );
}

#[test]
fn faults_name_the_file() {
    for (files, named) in [
        (
            vec![("task01.pddl", PROBLEM)],
            "task01.pddl has no domain; expected domain.pddl or domain01.pddl beside it",
        ),
        (vec![("t.pddl", PROBLEM)], "t.pddl has no domain; expected domain.pddl beside it"),
        (vec![("domain.pddl", DOMAIN)], "has no problems"),
        (
            vec![("a/b/c/d/domain.pddl", DOMAIN), ("a/b/c/d/t.pddl", PROBLEM)],
            "has no problems; expected domain.pddl and task01.pddl, or folders with such files (at most 3 deep;",
        ),
        (vec![("domain.pddl", "(define"), ("t.pddl", PROBLEM)], "domain.pddl"),
        (vec![("domain.pddl", DOMAIN), ("t.pddl", "(define (problem")], "t.pddl"),
    ] {
        let place = folder(&files);
        let fault = problems_in(place.path()).expect_err("a fault").to_string();
        assert!(fault.contains(named), "{fault}");
    }
    let missing = problems_in(Path::new("/no/such/folder")).expect_err("a fault");
    assert!(missing.to_string().contains("/no/such/folder"), "{missing}");
}
