//! Nouns for kinds, names for objects, and parts of symbols.

use std::collections::BTreeMap;

/// Greatest length of a kind in a symbol, in characters.
const LONGEST: usize = 60;

/// Returns `text` in upper case with `_` for everything that is no ASCII letter or digit.
pub(crate) fn upper(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_uppercase() } else { '_' })
        .collect()
}

/// Turns a kind into a valid part of a symbol: upper-case ASCII letters and digits, with `_` for everything else.
pub(crate) fn symbol(kind: &str) -> String {
    let mut name = upper(kind);
    if !name.starts_with(|c: char| c.is_ascii_uppercase()) {
        name.insert_str(0, "KIND_");
    }
    name.truncate(LONGEST);
    name
}

/// Returns a kind as a noun, such as `coffee cup` for `coffee_cup`.
pub(crate) fn noun(kind: &str) -> String {
    let words: Vec<&str> = kind.split(['_', ' ']).filter(|word| !word.is_empty()).collect();
    if words.is_empty() { kind.into() } else { words.join(" ").to_lowercase() }
}

/// Returns a noun with its article, such as `a cup` or `an arm`.
pub(crate) fn a(noun: &str) -> String {
    let vowel = noun.starts_with(['a', 'e', 'i', 'o', 'u']);
    format!("{} {noun}", if vowel { "an" } else { "a" })
}

/// Returns the plural of a noun.
pub(super) fn plural(noun: &str) -> String {
    let before = |ending: &str| noun.strip_suffix(ending);
    let consonant = |stem: &str| !stem.ends_with(['a', 'e', 'i', 'o', 'u']) && !stem.is_empty();
    if let Some(stem) = before("y").filter(|stem| consonant(stem)) {
        return format!("{stem}ies");
    }
    if let Some(stem) = before("ife") {
        return format!("{stem}ives");
    }
    if let Some(stem) = before("lf") {
        return format!("{stem}lves");
    }
    let hisses = ["s", "x", "z", "ch", "sh"].iter().any(|ending| noun.ends_with(ending));
    format!("{noun}{}", if hisses { "es" } else { "s" })
}

/// Returns the names of the objects of a scene, given as pairs of id and kind: `the cup` for the only one of its kind,
/// `cup 0` for one of several. An id that does not begin with the kind is its own name.
pub(crate) fn object_names<'o>(
    objects: impl Iterator<Item = (&'o str, &'o str)> + Clone,
) -> Vec<String> {
    let mut of_kind: BTreeMap<&str, usize> = BTreeMap::new();
    objects.clone().for_each(|(_, kind)| *of_kind.entry(kind).or_default() += 1);
    let name = |(id, kind): (&str, &str)| {
        let number = id.strip_prefix(kind).map(|rest| rest.trim_matches(['_', ' ', '-']));
        match number.filter(|number| number.chars().all(|c| c.is_ascii_digit())) {
            Some(_) if of_kind.get(kind) == Some(&1) => format!("the {}", noun(kind)),
            Some(number) if !number.is_empty() => format!("{} {number}", noun(kind)),
            _ => id.replace('_', " "),
        }
    };
    let mut names: Vec<String> = objects.clone().map(name).collect();
    let mut count: BTreeMap<String, usize> = BTreeMap::new();
    names.iter().for_each(|name| *count.entry(name.clone()).or_default() += 1);
    for (name, (id, _)) in names.iter_mut().zip(objects) {
        if count[name] > 1 {
            *name = id.to_owned();
        }
    }
    names
}

/// Returns whether a name of [`object_names`] is that of the only object of its kind.
pub(crate) fn is_only(name: &str) -> bool {
    name.starts_with("the ")
}
