//! Words in messages: few names, those first that are most like what was written, and no character that a terminal obeys.

use std::borrow::Cow;

/// Greatest number of names in a message.
const MOST: usize = 10;

/// Greatest number of characters of all names in a message, and of a single one.
const LONG: [usize; 2] = [400, 100];

/// Length up to which names are compared, in bytes: the steps are the product of the lengths.
const LONGEST: usize = 100;

/// Greatest number of names that are compared.
const COMPARED: usize = 5_000;

/// Returns the first ten names, separated by commas, and how many more there are.
///
/// ```
/// use symbolt::sim::few;
///
/// assert_eq!(few(["a", "b"]), "a, b");
/// let many: Vec<String> = (0..2_000).map(|n| n.to_string()).collect();
/// assert_eq!(few(&many), "0, 1, 2, 3, 4, 5, 6, 7, 8, 9 and 1990 more");
/// ```
pub fn few<S: AsRef<str>>(names: impl IntoIterator<Item = S>) -> String {
    let mut names = names.into_iter();
    let (mut text, mut count) = (String::new(), 0);
    for name in names.by_ref() {
        let name = name.as_ref();
        let room = count < MOST && text.len() + name.len().min(LONG[1]) <= LONG[0];
        if count > 0 && !room {
            let more = 1 + names.count();
            return format!("{text} and {more} more");
        }
        if count > 0 {
            text.push_str(", ");
        }
        count += 1;
        text += &cut(name, LONG[1]);
    }
    text
}

/// Cuts off a text after so many characters.
pub(crate) fn cut(text: &str, most: usize) -> Cow<'_, str> {
    match text.char_indices().nth(most) {
        Some((at, _)) => format!("{}...", &text[..at]).into(),
        None => text.into(),
    }
}

/// Returns whether a terminal shows every character of a text and obeys none: no control character, and none that turns the
/// direction of a text, breaks a line or takes no room.
///
/// ```
/// assert!(symbolt::sim::is_plain("bolt_1 häß 物"));
/// assert!(!symbolt::sim::is_plain("bolt\u{1b}[31m"));
/// assert!(!symbolt::sim::is_plain("nut\u{202e}"));
/// ```
pub fn is_plain(text: &str) -> bool {
    !text.contains(is_obeyed)
}

fn is_obeyed(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}'
            | '\u{2060}'..='\u{206f}' | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}')
}

/// Escapes the characters that a terminal would obey, as in `\u{1b}`.
pub fn plain(text: &str) -> Cow<'_, str> {
    if is_plain(text) {
        return text.into();
    }
    let escape = |c: char| match is_obeyed(c) {
        true => c.escape_default().to_string(),
        false => c.into(),
    };
    text.chars().map(escape).collect::<String>().into()
}

/// As [`few`], but of more than ten names those come first that are most like `written`.
///
/// ```
/// use symbolt::sim::nearest_first;
///
/// let many: Vec<String> = (0..2_000).map(|n| format!("STATE_{n}")).collect();
/// let shown = nearest_first("STAT_1999", many.iter().map(String::as_str));
/// assert!(shown.starts_with("STATE_1999, "));
/// ```
pub fn nearest_first<'n>(written: &str, names: impl IntoIterator<Item = &'n str>) -> String {
    list_by_distance(written, names.into_iter().collect())
}

fn list_by_distance(written: &str, mut names: Vec<&str>) -> String {
    if names.len() > MOST {
        let compared = names.len().min(COMPARED);
        names[..compared].sort_by_cached_key(|name| apart(written, name));
    }
    few(names)
}

/// Returns the ten names that are most like `written`, those first that are most like it.
pub(crate) fn nearest(written: &str, names: impl IntoIterator<Item = String>) -> Vec<String> {
    sort_by_distance(written, names.into_iter().take(COMPARED).collect())
}

fn sort_by_distance(written: &str, names: Vec<String>) -> Vec<String> {
    let names = names.into_iter();
    let mut ranked: Vec<_> = names.map(|name| (apart(written, &name), name)).collect();
    ranked.sort();
    ranked.dedup();
    ranked.into_iter().map(|(_, name)| name).take(MOST).collect()
}

/// Returns how far a name is from what was written. One that contains it is near.
pub(crate) fn apart(written: &str, name: &str) -> usize {
    // `FORK` is nearer to `FORK_AT_PLATE` than to `CUP`.
    let lower = written.to_lowercase();
    let inside = !lower.is_empty() && name.to_lowercase().contains(&lower);
    edits(written, name).map_or(usize::MAX, |edits| if inside { edits.min(1) } else { edits })
}

/// Returns a question about the name that was probably meant, as a part of a sentence; empty if no name is near.
///
/// ```
/// use symbolt::sim::meant;
///
/// assert_eq!(meant("towr", ["tower", "drawer"]), " (did you mean `tower`?)");
/// assert_eq!(meant("castle", ["tower", "drawer"]), "");
/// ```
pub fn meant<'n>(written: &str, names: impl IntoIterator<Item = &'n str>) -> String {
    question(nearest_name(written, names).as_deref())
}

/// As [`meant`], about this name.
pub(crate) fn question(nearest: Option<&str>) -> String {
    nearest.map_or_else(String::new, |name| format!(" (did you mean `{name}`?)"))
}

/// Returns the name that differs from `written` by the fewest edits, capitals aside. Returns `None` if that many edits are
/// unlikely to be a typing error.
pub(crate) fn nearest_name<'n>(
    written: &str,
    names: impl IntoIterator<Item = &'n str>,
) -> Option<String> {
    probable(written, &mut names.into_iter().take(COMPARED))
}

fn probable(written: &str, others: &mut dyn Iterator<Item = &str>) -> Option<String> {
    let length = written.chars().count();
    let most = if length > 3 { 2.max(length / 4) } else { 1 };
    // `p1` is not meant where `p2` is written.
    let without = |name: &str| name.chars().filter(|c| !c.is_ascii_digit()).collect::<String>();
    let numbered = |name: &str| {
        without(written) == without(name) && written.chars().count() == name.chars().count()
    };
    let near = others.filter(|name| !numbered(name) || *name == written).filter_map(|name| {
        // A single letter is near to every other.
        edits(written, name).filter(|edits| *edits <= most && *edits < length).map(|e| (e, name))
    });
    near.min_by_key(|(edits, _)| *edits).map(|(_, name)| name.to_owned())
}

/// Returns the number of letters that are changed, added, left out or swapped with the next, capitals aside; `None` for
/// names too long to compare.
fn edits(a: &str, b: &str) -> Option<usize> {
    if a.len().max(b.len()) > LONGEST {
        return None;
    }
    let [a, b] = [a, b].map(|name| name.to_lowercase().chars().collect::<Vec<char>>());
    let mut before: Vec<usize> = Vec::new();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.iter().enumerate() {
        let mut next = vec![i + 1];
        for (j, y) in b.iter().enumerate() {
            let mut least = (row[j] + usize::from(x != y)).min(next[j] + 1).min(row[j + 1] + 1);
            if i > 0 && j > 0 && *x == b[j - 1] && a[i - 1] == *y {
                least = least.min(before[j - 1] + 1);
            }
            next.push(least);
        }
        before = std::mem::replace(&mut row, next);
    }
    row.last().copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_a_message_are_few_and_short() {
        assert_eq!(few([""; 0]), "");
        let long = "x".repeat(5_000);
        assert_eq!(few([&long, &long, &long]).len(), 3 * 103 + 4);
        let many = vec!["N".repeat(100); 3_000];
        let shown = few(&many);
        assert!(shown.len() < 700 && shown.ends_with(" more"), "{shown}");
    }

    #[test]
    fn the_nearest_names_come_first() {
        let many: Vec<String> = (0..50).map(|n| format!("CUP_{n}")).collect();
        let all = || many.iter().map(String::as_str).chain(["FORK_AT_PLATE"]);
        assert!(
            nearest_first("fork", all()).starts_with("FORK_AT_PLATE, CUP_0"),
            "{}",
            nearest_first("fork", all())
        );
        assert_eq!(nearest_first("b", ["c", "a"]), "c, a", "ten names keep their order");
        assert_eq!(meant("fork_at_plaet", all()), " (did you mean `FORK_AT_PLATE`?)");
        assert_eq!(meant("rn", ["run", "rename"]), " (did you mean `run`?)");
        assert_eq!(meant("lfi", ["direct", "rate", "lif"]), " (did you mean `lif`?)");
        for (written, name) in [("a", "b"), ("", "b"), ("ab", "cd"), ("table-5", "table-4")] {
            assert_eq!(meant(written, [name]), "", "{written}");
        }
        assert_eq!(meant(&"x".repeat(1_000), all()), "");
    }
}
