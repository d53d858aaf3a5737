//! Tests that need something that may be missing, such as a browser.

use libtest_mimic::Trial;

/// Returns the named tests. Unless `present` they count as ignored, and fail if `--ignored` runs them. The list of tests
/// shows `need` beside each name, such as `[needs Chromium]`.
pub fn only_if(present: bool, need: &str, tests: &[(&'static str, fn())]) -> Vec<Trial> {
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
    tests.iter().map(trial).collect()
}

/// Makes a list of test functions with their names.
macro_rules! named {
    ($($test:ident),* $(,)?) => {
        &[$((concat!(module_path!(), "::", stringify!($test)), $test as fn())),*]
    };
}
pub(crate) use named;
