//! Patterns of names: `*` for any text, and names in braces for text that is kept.

/// Fits a pattern to a whole name and returns the text of each `{name}`. A wildcard ends where the text behind it
/// first occurs; at the end of the pattern, where it last occurs. Costs the length of the name for each wildcard.
pub(crate) fn captured<'n>(pattern: &str, name: &'n str) -> Option<Vec<(String, &'n str)>> {
    let mut found = Vec::new();
    let (mut rest, mut left) = (pattern, name);
    let mut open: Option<Option<String>> = None;
    loop {
        let (literal, wildcard, behind) = next(rest);
        let at = match (&open, wildcard.is_some()) {
            (None, _) => left.starts_with(literal).then_some(0),
            (Some(_), true) => left.find(literal),
            (Some(_), false) => left.ends_with(literal).then(|| left.len() - literal.len()),
        }?;
        if let Some(Some(key)) = open.take() {
            found.push((key, &left[..at]));
        }
        left = &left[at + literal.len()..];
        rest = behind;
        match wildcard {
            Some(key) => open = Some(key),
            None => return left.is_empty().then_some(found),
        }
    }
}

/// Splits a pattern at its first wildcard: the text before it, the wildcard with its name, and the rest.
fn next(pattern: &str) -> (&str, Option<Option<String>>, &str) {
    let star = pattern.find('*').map(|at| (at, at + 1, None));
    let brace = pattern.find('{').and_then(|at| {
        let end = at + pattern[at..].find('}')?;
        Some((at, end + 1, Some(pattern[at + 1..end].to_owned())))
    });
    let first = match (star, brace) {
        (Some(star), Some(brace)) => Some(if star.0 < brace.0 { star } else { brace }),
        (star, brace) => star.or(brace),
    };
    match first {
        Some((at, end, key)) => (&pattern[..at], Some(key), &pattern[end..]),
        None => (pattern, None, ""),
    }
}

/// Returns whether a pattern fits a whole name; `*` stands for any text.
///
/// ```
/// assert!(symbolt::task::import::fits("cup_*", "cup_3"));
/// ```
pub fn fits(pattern: &str, name: &str) -> bool {
    captured(pattern, name).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_fit_whole_names_and_keep_named_text() {
        for (pattern, name, expected) in [
            ("cup_*", "cup_3", true),
            ("cup_*", "a_cup_3", false),
            ("*_a.csv", "x_a.csv_a.csv", true),
            ("*", "", true),
            ("a*b*c", "a--b--c", true),
            ("a*b*c", "a--c", false),
            ("ab", "abc", false),
        ] {
            assert_eq!(fits(pattern, name), expected, "{pattern} {name}");
        }
        let found = captured("{session}_action_{part}_*.csv", "17_action_2_robot.csv");
        let found = found.unwrap_or_default();
        assert_eq!(found, [("session".to_owned(), "17"), ("part".to_owned(), "2")]);
    }
}
