//! A test harness for tests that need something which not every machine has.

use std::process::ExitCode;

use libtest_mimic::{Arguments, Trial};

/// Runs the named tests. Without `present` they count as ignored. Every test is listed with its need, such as
/// `[needs Chromium]`; a test that is run nevertheless, by `--ignored`, fails.
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

/// The functions with their names.
macro_rules! named {
    ($($test:ident),* $(,)?) => { &[$((stringify!($test), $test as fn())),*] };
}
pub(crate) use named;
