//! Warns once if the crate was compiled without optimisation, as a plain `cargo run` in another crate does.

/// Prints a warning to standard error, once per process: the crate is slow as compiled, and lines for `Cargo.toml`
/// make it fast. Does nothing in an optimised build.
pub(crate) fn warn() {
    #[cfg(unoptimised)]
    {
        static ONCE: std::sync::Once = std::sync::Once::new();
        ONCE.call_once(|| eprintln!("{WARNING}"));
    }
}

#[cfg(any(unoptimised, test))]
const WARNING: &str = "\
warning: symbolt is compiled without optimisation and runs about 30 times slower than it can.
Use `cargo run --release`, or add to the Cargo.toml of your program:
    [profile.dev.package.\"*\"]
    opt-level = 3";

#[cfg(test)]
mod tests {
    use super::WARNING;

    #[test]
    fn the_front_page_gives_the_same_lines_for_cargo_toml() {
        let page = include_str!("../../README.md");
        let lines: Vec<&str> = WARNING.lines().skip(2).map(str::trim).collect();
        assert_eq!(lines.len(), 2);
        assert!(page.contains(&lines.join("\n")), "README.md lacks\n{}", lines.join("\n"));
    }
}
