//! A harness for tests that need something that may be missing, such as a browser.

use std::process::ExitCode;

use libtest_mimic::{Arguments, Trial};

/// Runs the named tests if `present`; otherwise they count as ignored, and fail if `--ignored` runs them. The list of
/// tests shows `need` beside each name, such as `[needs Chromium]`.
pub fn run_if(present: bool, need: &str, tests: &[(&'static str, fn())]) -> ExitCode {
    let trial = |(name, test): &(&'static str, fn())| {
        let (test, reason) = (*test, need.to_owned());
        let run = move || {
            if !present {
                return Err(reason.into());
            }
            test();
            Ok(())
        };
        Trial::test(*name, run).with_kind(need).with_ignored_flag(!present)
    };
    libtest_mimic::run(&Arguments::from_args(), tests.iter().map(trial).collect()).exit_code()
}

/// Makes a list of test functions with their names.
macro_rules! named {
    ($($test:ident),* $(,)?) => { &[$((stringify!($test), $test as fn())),*] };
}
pub(crate) use named;
