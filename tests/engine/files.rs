//! Whole files, written at once, and folders of results that one run holds.

#![allow(clippy::expect_used)]

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use symbolt::files::{
    FileError, Limit, Overwrite, ResultFolder, check_output, read_beginning, read_file,
    read_regular_file, write_atomic,
};

use symbolt::prelude::*;
use symbolt::record::{RecordingFiles, RowFiles};

fn names(folder: &Path) -> Vec<String> {
    let entries = folder.read_dir().expect("a folder").flatten();
    let mut names: Vec<String> =
        entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn temporary_files_of_killed_processes_are_removed_and_no_others() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let (stale, used) = (".symbolt-0123456789abcdeF.tmp", ".symbolt-0123456789abcdeG.tmp");
    let others = [
        ".symbolt-config",
        ".symbolt-0123456789abcde.tmp",
        ".symbolt-0123456789abcd_F.tmp",
        ".symbolt-0123456789abcdeF",
        "symbolt-0123456789abcdeF.tmp",
    ];
    for name in others.iter().chain([&stale, &used]) {
        std::fs::write(path(name), "x").expect("writes");
    }
    let folder_of_that_name = ".symbolt-0123456789abcdeH.tmp";
    std::fs::create_dir(path(folder_of_that_name)).expect("makes");
    let running = OpenOptions::new().write(true).open(path(used)).expect("opens");
    running.lock().expect("locks");
    write_atomic(&path("file"), "new", Overwrite::Never).expect("writes");
    let mut left = others.to_vec();
    left.extend([used, folder_of_that_name, "file"]);
    left.sort_unstable();
    assert_eq!(names(folder.path()), left);
    drop(running);
    write_atomic(&path("file"), "newer", Overwrite::Allowed).expect("writes");
    assert!(!path(used).exists(), "its process is gone");
}

#[test]
fn many_threads_that_write_and_tidy_up_do_not_disturb_each_other() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |thread: usize| {
        (0..40).all(|round| {
            let path = folder.path().join(format!("{}", (thread + round) % 3));
            write_atomic(&path, thread.to_string(), Overwrite::Allowed).is_ok()
        })
    };
    let all = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..8).map(|thread| scope.spawn(move || write(thread))).collect();
        threads.into_iter().filter_map(|thread| thread.join().ok()).filter(|ok| *ok).count()
    });
    assert_eq!((all, names(folder.path())), (8, vec!["0".into(), "1".into(), "2".into()]));
}

#[test]
#[cfg(unix)]
fn a_link_is_followed_and_never_replaced_even_if_it_points_nowhere() {
    use std::os::unix::fs::symlink;
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    std::fs::create_dir(path("deep")).expect("makes");
    symlink("deep/other", path("link")).expect("links");
    symlink("../file", path("deep/other")).expect("links");
    let refused = write_atomic(&path("link"), "new", Overwrite::Never);
    assert!(matches!(refused, Err(FileError::Exists { .. })), "{refused:?}");
    for content in ["one", "two"] {
        write_atomic(&path("link"), content, Overwrite::Allowed).expect("writes");
        assert_eq!(std::fs::read_to_string(path("file")).expect("a file"), content);
    }
    assert_eq!(path("link").read_link().expect("a link"), Path::new("deep/other"));
    symlink("no/such/folder/file", path("nowhere")).expect("links");
    symlink("circle", path("circle")).expect("links");
    for name in ["nowhere", "circle"] {
        let check = check_output(&path(name), Overwrite::Allowed);
        assert!(matches!(check, Err(FileError::Io { what: "write", .. })), "{check:?}");
        assert!(write_atomic(&path(name), "new", Overwrite::Allowed).is_err());
        assert!(path(name).symlink_metadata().expect("there").is_symlink());
    }
    assert_eq!(names(folder.path()), ["circle", "deep", "file", "link", "nowhere"]);
}

#[test]
#[cfg(unix)]
fn a_place_that_cannot_be_written_is_found_by_the_check_and_by_the_write() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("file"), "old").expect("writes");
    let long = "x".repeat(300);
    let cases = [
        ("", "the name is empty"),
        ("new/", "the name is that of a folder"),
        ("..", "it is a folder"),
        (".", "it is a folder"),
        ("no/file", "No such file"),
        ("file/file", "Not a directory"),
        (&long, "too long"),
        ("/dev/full", "it is not a regular file"),
        ("/proc/file", ""),
    ];
    for (name, why) in cases {
        let path = if name.is_empty() { PathBuf::new() } else { folder.path().join(name) };
        let check = check_output(&path, Overwrite::Never).expect_err(name);
        let write = write_atomic(&path, "new", Overwrite::Never).expect_err(name);
        for error in [check, write] {
            let FileError::Io { what: "write", source, .. } = error else { panic!("{error}") };
            let said = source.to_string();
            assert!(said.contains(why) && !said.contains("at path"), "{name}: {said}");
        }
    }
    check_output(&folder.path().join("new"), Overwrite::Never).expect("it can be written");
    assert_eq!(names(folder.path()), ["file"]);
}

#[test]
fn a_file_is_replaced_only_if_that_is_allowed_and_nothing_else_is_left_in_its_folder() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("file");
    write_atomic(&path, "one", Overwrite::Never).expect("it is new");
    let refused = write_atomic(&path, "two", Overwrite::Never);
    assert!(matches!(refused, Err(FileError::Exists { .. })), "{refused:?}");
    assert_eq!(std::fs::read(&path).expect("a file"), b"one");
    write_atomic(&path, "three", Overwrite::Allowed).expect("it may be replaced");
    assert_eq!(std::fs::read(&path).expect("a file"), b"three");
    assert_eq!(folder.path().read_dir().expect("a folder").count(), 1);
}

fn place() -> tempfile::TempDir {
    tempfile::tempdir().expect("a folder")
}

fn entries(folder: &Path) -> usize {
    folder.read_dir().expect("a folder").count()
}

#[test]
fn a_folder_keeps_others_out_until_it_is_dropped() {
    let folder = place();
    let held = ResultFolder::open(folder.path()).expect("it is free");
    assert_eq!(held.warning(), None);
    let refused = ResultFolder::open(folder.path()).expect_err("it is held");
    let said = refused.to_string();
    assert!(said.contains("another run is writing to ") && said.contains("; choose"), "{said}");
    drop(held);
    drop(ResultFolder::open(folder.path()).expect("it is free again"));
    assert_eq!(entries(folder.path()), usize::from(!cfg!(unix)), "the lock file is gone");
}

#[test]
fn a_folder_made_for_nothing_is_removed_and_one_with_results_stays() {
    let place = place();
    let root = place.path().join("a");
    let path = root.join("b/c");
    drop(ResultFolder::open_if::<FileError>(&path, Some(&root), |_| Ok(())).expect("opens"));
    assert_eq!(entries(place.path()), 0);
    let refused = ResultFolder::open_if(&path, Some(&root), |path| match path.exists() {
        false => Ok(()),
        true => Err(FileError::Exists { path: path.into() }),
    });
    assert!(matches!(refused, Err(FileError::Exists { .. })), "asked again under the lock");
    assert_eq!(entries(place.path()), 0);
    let folder = ResultFolder::open_if::<FileError>(&path, Some(&root), |_| Ok(()));
    let folder = folder.expect("opens");
    std::fs::write(folder.path().join("result"), "1").expect("writes");
    drop(folder);
    let ignore = std::fs::read_to_string(root.join(".gitignore")).expect("there");
    assert!(ignore.ends_with("\n*\n"), "{ignore}");
    assert!(path.join("result").exists());
    // A folder that was there before is neither hidden from git nor removed.
    let old = place.path().join("old");
    std::fs::create_dir(&old).expect("makes");
    drop(ResultFolder::open_if::<FileError>(&old, Some(&old), |_| Ok(())).expect("opens"));
    assert_eq!(entries(&old), usize::from(!cfg!(unix)));
}

#[test]
fn a_folder_has_one_holder_at_a_time_however_many_try() {
    let place = place();
    let path = place.path().join("results");
    let holders = std::sync::atomic::AtomicUsize::new(0);
    let try_often = || {
        let mut opened = 0;
        for _ in 0..800 {
            match ResultFolder::open(&path) {
                Ok(folder) => {
                    let before = holders.fetch_add(1, std::sync::atomic::Ordering::SeqCst);
                    assert_eq!(before, 0, "two runs hold the folder");
                    std::thread::yield_now();
                    holders.fetch_sub(1, std::sync::atomic::Ordering::SeqCst);
                    drop(folder);
                    opened += 1;
                }
                Err(error) => assert!(matches!(error, FileError::Busy { .. }), "{error:?}"),
            }
        }
        opened
    };
    let opened: usize = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4).map(|_| scope.spawn(try_often)).collect();
        threads.into_iter().map(|thread| thread.join().expect("no panic")).sum()
    });
    assert!(opened > 0);
    // A run that ended between another run's attempts may have left the folder, but nothing in it.
    assert!(!path.exists() || entries(&path) == 0);
}

#[test]
#[cfg(unix)]
fn a_lock_file_that_is_something_else_is_neither_used_nor_removed() {
    let folder = place();
    let lock = folder.path().join(".symbolt-lock");
    std::fs::write(&lock, "a person's file").expect("writes");
    drop(ResultFolder::open(folder.path()).expect("opens"));
    assert_eq!(std::fs::read_to_string(&lock).expect("there"), "a person's file");
    std::fs::remove_file(&lock).expect("removes");
    std::os::unix::fs::symlink("elsewhere", &lock).expect("links");
    let refused = ResultFolder::open(folder.path());
    assert!(matches!(refused, Err(FileError::Io { what: "write to", .. })), "{refused:?}");
    assert!(!folder.path().join("elsewhere").exists());
}

const SMALL: Limit = Limit { what: "a note", max_bytes: 10 };

#[cfg(unix)]
#[test]
fn a_device_that_never_ends_is_refused_instead_of_read() {
    for read in [read_file, read_regular_file] {
        let refused = read(Path::new("/dev/zero"), Limit::ANY);
        assert!(matches!(refused, Err(FileError::Io { what: "read", .. })), "{refused:?}");
    }
}

#[test]
fn a_file_over_the_limit_is_refused_with_its_size_and_the_limit() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("note");
    std::fs::write(&path, [b'a'; 10]).expect("written");
    assert_eq!(read_file(&path, SMALL).expect("it fits").len(), 10);
    std::fs::write(&path, [b'a'; 11]).expect("written");
    assert_eq!(read_beginning(&path, 3).expect("a file"), b"aaa");
    for read in [read_file, read_regular_file] {
        let refused = read(&path, SMALL).expect_err("too large").to_string();
        let expected =
            format!("{} has 11 bytes; expected at most 10 bytes for a note", path.display());
        assert_eq!(refused, expected);
    }
    // A sparse file of a terabyte takes no time.
    let file = File::create(&path).expect("made");
    if file.set_len(1 << 40).is_ok() {
        assert!(matches!(read_file(&path, SMALL), Err(FileError::TooLarge { .. })));
    }
}

#[cfg(unix)]
#[test]
fn a_pipe_without_a_writer_is_refused_and_one_with_a_writer_is_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("pipe");
    let made = std::process::Command::new("mkfifo").arg(&path).status();
    if !made.is_ok_and(|status| status.success()) {
        return;
    }
    let refused = read_regular_file(&path, SMALL).expect_err("a pipe");
    assert!(matches!(refused, FileError::Io { what: "read", .. }), "{refused:?}");
    let refused = read_file(&path, SMALL).expect_err("no writer");
    let FileError::Io { source, .. } = &refused else { panic!("{refused:?}") };
    assert_eq!(source.to_string(), "it is a pipe, and nothing writes to it");
    // The thread that still opens the first pipe would take the bytes of a writer.
    let path = folder.path().join("other");
    std::process::Command::new("mkfifo").arg(&path).status().expect("made");
    for (text, fits) in [(&b"short"[..], true), (b"far too long", false)] {
        let other = path.clone();
        let writer = std::thread::spawn(move || {
            use std::io::Write;
            let mut pipe = OpenOptions::new().write(true).open(other)?;
            pipe.write_all(text)
        });
        let read = read_file(&path, SMALL);
        assert_eq!(read.is_ok(), fits, "{read:?}");
        writer.join().expect("joined").expect("written");
    }
}

#[test]
fn recordings_stream_to_the_files_of_their_run_and_of_no_other() {
    let run = |values: &[f32]| {
        let mut graph = GraphBuilder::new();
        graph.add("some", Constant::vector(values));
        graph.probe_at::<Vector>("some", ProbeSpec::default());
        graph.start(&PopulationPlan::direct(), Seed::new(1)).expect("a run")
    };
    let folder = tempfile::tempdir().expect("a folder");
    let (mut sim, mut wide) = (run(&[0.5, -2.0]), run(&[1.0, 2.0, 3.0]));
    let mut files = RecordingFiles::create(folder.path(), &sim).expect("files");
    let path = folder.path().join("some.out.values.npy");
    for taken in 1..=3u64 {
        sim.run_for(SimDuration::from_millis(10)).expect("runs");
        // A call before wrote half a row and failed.
        let mut file = OpenOptions::new().append(true).open(&path).expect("a file");
        file.write_all(&[7; 5]).expect("writes");
        files.take(&mut sim).expect("takes");
        let bytes = std::fs::read(&path).expect("reads");
        let head = String::from_utf8_lossy(&bytes[10..128]).into_owned();
        assert!(head.contains(&format!("'shape': ({:<20}, 2)", 10 * taken)), "{head}");
        let rows =
            bytes[128..].chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().expect("4")));
        let rows: Vec<f32> = rows.take(20 * taken as usize).collect();
        assert_eq!(rows, [0.5, -2.0].repeat(10 * taken as usize));
    }
    wide.run_for(SimDuration::from_millis(10)).expect("runs");
    let refused = files.take(&mut wide).expect_err("another width");
    assert_eq!(refused.to_string(), "these files belong to a run with other probes");
    assert_eq!(
        wide.recordings().values().map(|(_, samples)| samples.iter().count()).sum::<usize>(),
        10
    );
    assert!(RecordingFiles::create(folder.path(), &sim).is_err(), "files are not overwritten");
}

#[test]
fn rows_of_a_program_stream_to_files_and_an_earlier_time_takes_later_rows_away() {
    let folder = tempfile::tempdir().expect("a folder");
    let lists = [("one", 1), ("a/b", 3)];
    let mut files = RowFiles::create(folder.path(), lists).expect("files");
    // More than is held in memory.
    for tick in (1..=20_000_u16).chain(9_000..=12_000).chain(12_000..=12_000) {
        let time_s = f64::from(tick) / 1e3;
        files.push(time_s, &[f32::from(tick), 1.0, 2.0, 3.0]).expect("writes");
    }
    files.cut(11.999).expect("cuts");
    let read = |name: &str| std::fs::read(folder.path().join(name)).expect("reads");
    let times = read("one.time_s.npy");
    assert_eq!(times.len(), 128 + 8 * 11_999);
    assert_eq!(times[times.len() - 8..], 11.999_f64.to_le_bytes());
    let ones: Vec<u8> = (1..=11_999_u16).flat_map(|tick| f32::from(tick).to_le_bytes()).collect();
    assert!(read("one.values.npy")[128..] == ones);
    assert_eq!(read("a.b.values.npy").len(), 128 + 12 * 11_999);
    assert!(RowFiles::create(folder.path(), lists).is_err(), "files are not overwritten");
}
