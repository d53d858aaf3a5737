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
/// problems, and PDDL that is not read.
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
