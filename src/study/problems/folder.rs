//! Problems in a folder of PDDL files.

use std::path::{Path, PathBuf};

use super::{PlanningProblem, read, refused};
use crate::files::{FileError, Limit, read_regular_file};
use crate::plan::strips::{Domain, Problem};
use crate::sim::Seed;
use crate::task::TaskError;

/// Greatest number of problems in a folder.
const MAX_PROBLEMS: usize = 2_000;
/// Folders within folders that are looked at. Messages and documentation name it.
const DEPTH: usize = 3;
/// Greatest number of entries of a folder.
const MAX_ENTRIES: usize = 20_000;

/// A problem in two files, as they were read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProblemFiles {
    /// Name of the folder, such as `blocks`; of the domain for files in the outermost folder.
    pub group: String,
    /// Name of the problem's file without its ending, such as `task01`.
    pub name: String,
    /// The domain.
    pub domain: Domain,
    /// The problem.
    pub problem: Problem,
    /// A number that changes with the text of the files.
    pub fingerprint: u64,
}

impl ProblemFiles {
    /// Grounds the problem.
    ///
    /// # Errors
    /// As [`PlanningProblem::new`].
    pub fn grounded(&self) -> Result<PlanningProblem, TaskError> {
        PlanningProblem::new(self.domain.clone(), self.problem.clone())
    }
}

/// Reads all problems in a folder and in the folders in it, up to three deep, sorted by folder and name.
///
/// A domain is a file whose name contains `domain` and ends in `.pddl`; every other such file is a problem. The domain of
/// `task07.pddl` is the one beside it with the same number, such as `domain07.pddl` or `task07-domain.pddl`; otherwise it
/// is `domain.pddl`, or the only domain there. `domain7.pddl` has the same number too; equal digits come first.
///
/// Links to files are read; links to folders are not followed.
///
/// # Errors
/// [`TaskError::File`] for a folder or file that cannot be read, or for a folder of more than 20,000 entries;
/// [`TaskError::Problem`] beyond [`MAX_PROBLEMS`], for two problems of one name, a problem without domain, a folder without
/// problems, and PDDL that is no typed STRIPS.
pub fn problems_in(folder: &Path) -> Result<Vec<ProblemFiles>, TaskError> {
    let mut found = Vec::new();
    search(folder, String::new(), DEPTH, &mut found)?;
    if found.is_empty() {
        let reason = format!(
            "{} has no problems; expected domain.pddl and task01.pddl, or folders with such files (at most {DEPTH} deep; links to folders are not followed)",
            folder.display()
        );
        return Err(refused(reason));
    }
    found.sort_by(|a, b| (&a.group, &a.name).cmp(&(&b.group, &b.name)));
    // Results are kept by these names, so two problems of one name would share one result.
    let same =
        |pair: &&[ProblemFiles]| (&pair[0].group, &pair[0].name) == (&pair[1].group, &pair[1].name);
    if let Some([twice, ..]) = found.windows(2).find(same) {
        let reason = format!(
            "{} has two problems `{}` in `{}`; expected one problem of each name in folders of different names",
            folder.display(),
            twice.name,
            twice.group
        );
        return Err(refused(reason));
    }
    Ok(found)
}

/// Returns the entries of a folder, sorted: the folders, and the files that end in `.pddl`. A link to a folder is neither,
/// since it could lead back here.
fn entries(folder: &Path) -> Result<(Vec<PathBuf>, Vec<PathBuf>), TaskError> {
    let failed = FileError::io("read", folder);
    let (mut folders, mut files) = (Vec::new(), Vec::new());
    for (at, entry) in std::fs::read_dir(folder).map_err(&failed)?.enumerate() {
        if at >= MAX_ENTRIES {
            let folder = folder.into();
            return Err(FileError::TooManyEntries { folder, max_entries: MAX_ENTRIES }.into());
        }
        let entry = entry.map_err(&failed)?;
        let (path, kind) = (entry.path(), entry.file_type().map_err(&failed)?);
        if kind.is_dir() {
            folders.push(path);
        } else if path.extension().is_some_and(|end| end.eq_ignore_ascii_case("pddl"))
            && !(kind.is_symlink() && path.is_dir())
        {
            files.push(path);
        }
    }
    folders.sort();
    files.sort();
    Ok((folders, files))
}

/// Returns the name of a file without its ending, in lower case.
fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().to_lowercase()
}

/// Returns the numbers in the name of a file, as digits.
fn numbers(path: &Path) -> Vec<String> {
    let name = stem(path);
    let parts = name.split(|c: char| !c.is_ascii_digit()).filter(|part| !part.is_empty());
    parts.map(str::to_owned).collect()
}

/// Returns the domain that belongs to a problem.
fn domain_of<'a>(problem: &Path, domains: &'a [PathBuf]) -> Option<&'a PathBuf> {
    let wanted = numbers(problem);
    // Without zeros in front, digits are equal if their numbers are, however many there are.
    let values = |digits: &[String]| -> Vec<String> {
        digits.iter().map(|digits| digits.trim_start_matches('0').to_owned()).collect()
    };
    let same = |path: &&PathBuf| !wanted.is_empty() && numbers(path) == wanted;
    let equal = |path: &&PathBuf| !wanted.is_empty() && values(&numbers(path)) == values(&wanted);
    let plain = |path: &&PathBuf| stem(path) == "domain";
    let only = || domains.first().filter(|_| domains.len() == 1);
    let numbered = domains.iter().find(same).or_else(|| domains.iter().find(equal));
    numbered.or_else(|| domains.iter().find(plain)).or_else(only)
}

fn search(
    folder: &Path,
    group: String,
    depth: usize,
    found: &mut Vec<ProblemFiles>,
) -> Result<(), TaskError> {
    let (folders, files) = entries(folder)?;
    let (domains, problems): (Vec<PathBuf>, Vec<PathBuf>) =
        files.into_iter().partition(|path| stem(path).contains("domain"));
    for problem in problems {
        let Some(domain) = domain_of(&problem, &domains) else {
            let own = match numbers(&problem).join("-") {
                number if number.is_empty() => number,
                number => format!(" or domain{number}.pddl"),
            };
            let problem = problem.display();
            let reason = format!("{problem} has no domain; expected domain.pddl{own} beside it");
            return Err(refused(reason));
        };
        if found.len() >= MAX_PROBLEMS {
            let reason = "problems; name a folder with fewer";
            return Err(refused(format!("there are more than {MAX_PROBLEMS} {reason}")));
        }
        found.push(found_in(domain, &problem, &group)?);
    }
    for inner in folders.iter().filter(|_| depth > 0) {
        let name = inner.file_name().unwrap_or_default().to_string_lossy();
        let gap = if group.is_empty() { "" } else { "/" };
        search(inner, format!("{group}{gap}{name}"), depth - 1, found)?;
    }
    Ok(())
}

fn found_in(domain: &Path, problem: &Path, group: &str) -> Result<ProblemFiles, TaskError> {
    let paths = [domain, problem];
    let [domain_text, problem_text] = paths.map(|path| read_regular_file(path, Limit::PDDL));
    let (domain_text, problem_text) = (domain_text?, problem_text?);
    let hash = |seed: Seed, text: &[u8]| seed.derive(&String::from_utf8_lossy(text), "text");
    let fingerprint = hash(hash(Seed::new(0), &domain_text), &problem_text).value();
    let name = problem.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let [domain_name, problem_name] = paths.map(|path| path.display().to_string());
    let (domain, problem) = read([(&domain_name, &domain_text), (&problem_name, &problem_text)])?;
    let group = if group.is_empty() { domain.name.clone() } else { group.to_owned() };
    Ok(ProblemFiles { group, name, domain, problem, fingerprint })
}

#[cfg(test)]
mod tests {
    use super::*;

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

    /// The group, the name and the first action of each problem.
    fn names(found: &[ProblemFiles]) -> Vec<String> {
        let action = |p: &ProblemFiles| p.domain.actions[0].name.clone();
        found.iter().map(|p| format!("{} {} {}", p.group, p.name, action(p))).collect()
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
        let found = problems_in(place.path()).expect("problems");
        assert_eq!(
            names(&found),
            [
                "a task01 push",
                "a task02 push",
                "b problem01 push",
                "b problem02 pull",
                "b/c p03 push",
                "door door pull"
            ]
        );
        assert_eq!(found[0].fingerprint, found[1].fingerprint);
        assert_ne!(found[2].fingerprint, found[3].fingerprint);
        assert_eq!(found[0].grounded().expect("a problem").grounded.operators.len(), 1);
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
        let found = problems_in(place.path()).expect("problems");
        let names: Vec<_> = found.iter().map(|p| (p.group.as_str(), p.name.as_str())).collect();
        assert_eq!(names, [("door", "task01"), ("door", "task02")]);
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
        for i in 0..MAX_ENTRIES - 2 {
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
        let found = problems_in(place.path()).expect("problems");
        assert_eq!(
            names(&found),
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
}
