//! The log of a live run as a file that grows with it: at every moment it holds what has been changed so far.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::Path;

use crate::sim::Logged;

/// See the module.
pub(super) struct LogFile {
    file: File,
    /// The entries in the file, each with the byte at which its line ends.
    lines: Vec<(Logged, u64)>,
}

impl LogFile {
    pub fn create(path: &Path) -> io::Result<Self> {
        Ok(Self { file: File::create(path)?, lines: Vec::new() })
    }

    /// Writes what was changed since the last call. What is no longer in the log, because the run went back, is cut off.
    pub fn keep(&mut self, made: &[Logged]) -> io::Result<()> {
        let same = self.lines.iter().zip(made).take_while(|((own, _), new)| own == *new).count();
        let mut end = same.checked_sub(1).map_or(0, |last| self.lines[last].1);
        if same < self.lines.len() {
            self.lines.truncate(same);
            self.file.set_len(end)?;
            self.file.seek(SeekFrom::Start(end))?;
        }
        for entry in &made[same..] {
            let line = serde_json::to_string(entry)? + "\n";
            self.file.write_all(line.as_bytes())?;
            end += line.len() as u64;
            self.lines.push((entry.clone(), end));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::{Intervention, InterventionLog};

    #[test]
    fn a_killed_session_has_its_log_up_to_the_last_command() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("log.jsonl");
        let mut kept = LogFile::create(&path).expect("a file");
        let entry = |tick, at: &str| Logged { tick, what: Intervention::Silence { at: at.into() } };
        let (one, two, three) = (entry(1, "one"), entry(20, "two"), entry(5, "three"));
        let logs = [
            vec![one.clone()],
            vec![one.clone(), two],
            vec![one.clone(), three],
            vec![],
            vec![one],
        ];
        for made in logs {
            kept.keep(&made).expect("written");
            let read = InterventionLog::read(&path).expect("a whole log at every moment");
            assert_eq!(read.entries(), made);
        }
    }
}
