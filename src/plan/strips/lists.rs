//! Reads what all files have: definitions, typed lists, and the use of declared names.

use std::collections::{BTreeSet, HashMap};

use super::pddl::{Domain, OBJECT, Typed, Types};
use super::sexpr::{Node, PddlFault, Place, Source, short};
use crate::sim::{meant, nearest_first};

/// Greatest number of types, of predicates, of functions, and of parameters of each.
pub(super) const MAX_NAMES: usize = 1_024;

/// Greatest number of types in `(either ...)`.
const MAX_EITHER: usize = 64;

const NO_TYPE: &str = "no type follows `-`";

/// Greatest number of types of all names of a typed list.
const MAX_TYPED: usize = 500_000;

/// Returns the elements of a list after its first.
pub(super) fn tail(node: &Node) -> &[Node] {
    node.list().and_then(|nodes| nodes.get(1..)).unwrap_or(&[])
}

impl Source<'_> {
    /// Returns the name and the sections of `(define (domain NAME) ...)`.
    pub fn defined<'n>(
        &self,
        nodes: &'n [Node],
        what: &str,
    ) -> Result<(String, &'n [Node]), PddlFault> {
        let expected = format!("(define ({what} NAME) ...)");
        let start = nodes.first().map_or(Place { line: 1, column: 1 }, |n| n.place);
        // The word after `define`, such as `domain`.
        let kind = |node: &Node| match (node.head(), tail(node)) {
            (Some("define"), [named, ..]) => named.head().map(str::to_owned),
            _ => None,
        };
        let mut wanted = nodes.iter().filter(|node| kind(node).as_deref() == Some(what));
        let Some(define) = wanted.next() else {
            let problem = match nodes {
                [] => "the text is empty".to_owned(),
                [node, ..] => match (kind(node), node.word(), node.head()) {
                    (Some(kind), ..) => format!("`(define ({} ...)` is no {what}", short(&kind)),
                    (_, Some(word), _) if word.starts_with(['{', '[']) => {
                        format!("this seems to be JSON and is no {what}")
                    }
                    (_, _, Some(":trajectory")) => format!("a trajectory is no {what}"),
                    _ if node
                        .list()
                        .and_then(|list| list.first()?.head())
                        .is_some_and(|head| matches!(head, ":objects" | ":init" | ":state")) =>
                    {
                        format!("a trajectory is no {what}")
                    }
                    _ => format!("{} is no {what}", node.shown()),
                },
            };
            return Err(self.fault(start, problem, expected));
        };
        if let Some(second) = wanted.next() {
            let problem = format!("the text has a second {what}");
            return Err(self.fault(second.place, problem, format!("one {expected}")));
        }
        if let Some(other) = nodes.iter().find(|node| kind(node).is_none()) {
            self.warn(other.place, format!("{} is outside of `define` and ignored", other.shown()));
        }
        if let [named, sections @ ..] = tail(define)
            && let [name] = tail(named)
            && let Some(name) = name.word()
        {
            return Ok((name.to_owned(), sections));
        }
        Err(self.fault(define.place, format!("the {what} has no name of one word"), expected))
    }

    pub fn unexpected(&self, node: &Node, what: &str, expected: &str) -> PddlFault {
        self.fault(node.place, format!("{} is no {what}", node.shown()), expected)
    }

    /// Refuses the name of an object that `known` does not have.
    pub fn no_object(
        &self,
        node: &Node,
        word: &str,
        known: &HashMap<String, Vec<String>>,
    ) -> PddlFault {
        let mut known: Vec<&str> = known.keys().map(String::as_str).collect();
        known.sort_unstable();
        let near = meant(word, known);
        let expected = format!("an object of :objects or :constants{near}");
        self.unexpected(node, "object", &expected)
    }

    pub fn word<'n>(&self, node: &'n Node, what: &str) -> Result<&'n str, PddlFault> {
        node.word().ok_or_else(|| self.unexpected(node, what, "a name"))
    }

    /// Reads `a b - t c - (either t u) d`. Names without a type are of type `object`.
    pub fn typed(&self, nodes: &[Node], types: &Types) -> Result<Vec<(Place, Typed)>, PddlFault> {
        let read = self.untyped(nodes, |name| types.contains(name))?;
        for (node, typed) in &read {
            if let Some(unknown) = typed.types.iter().find(|t| !types.contains(t)) {
                let known: Vec<&str> = types.declared().iter().map(|t| t.name.as_str()).collect();
                let near = meant(unknown, known.iter().copied());
                let known = nearest_first(unknown, [OBJECT].into_iter().chain(known));
                let problem = format!(
                    "`{}` has the unknown type `{}`{near}",
                    short(&typed.name),
                    short(unknown)
                );
                return Err(self.fault(*node, problem, format!("one of: {known}")));
            }
        }
        Ok(read)
    }

    /// Reads a typed list without checking that its types exist. `is_type` tells types apart from other names where a
    /// hyphen sticks to a name.
    pub fn untyped(
        &self,
        nodes: &[Node],
        is_type: impl Fn(&str) -> bool,
    ) -> Result<Vec<(Place, Typed)>, PddlFault> {
        let mut read: Vec<(Place, Typed)> = Vec::new();
        let (mut first_without, mut typed) = (0, 0);
        let mut nodes = nodes.iter().peekable();
        while let Some(node) = nodes.next() {
            let word = self.word(node, "name")?;
            let mut name = |name: &str| {
                read.push((
                    node.place,
                    Typed { name: name.to_owned(), types: vec![OBJECT.into()] },
                ));
            };
            let next = nodes.peek().and_then(|next| next.word().or_else(|| next.head()));
            let types: Vec<String> = if let Some(kind) =
                word.strip_prefix('-').filter(|kind| !kind.is_empty())
            {
                if kind.starts_with('-') {
                    return Err(self.fault(node.place, NO_TYPE, "the name of a type"));
                }
                self.warn(node.place, format!("a space is missing after `-` in `{}`", short(word)));
                vec![kind.to_owned()]
            } else if let Some(before) = word.strip_suffix('-').filter(|before| !before.is_empty())
                && next.is_some_and(|next| next == "either" || is_type(next))
            {
                self.warn(
                    node.place,
                    format!("a space is missing before `-` in `{}`", short(word)),
                );
                name(before);
                self.kinds(nodes.next(), node)?
            } else if word == "-" {
                self.kinds(nodes.next(), node)?
            } else {
                name(word);
                continue;
            };
            typed += types.len() * (read.len() - first_without);
            if typed > MAX_TYPED {
                let expected = format!("at most {MAX_TYPED} types of all names together");
                return Err(self.fault(node.place, "the list has too many names", expected));
            }
            for (_, name) in &mut read[first_without..] {
                name.types.clone_from(&types);
            }
            first_without = read.len();
        }
        Ok(read)
    }

    /// Reads the type or types behind a hyphen.
    fn kinds(&self, kind: Option<&Node>, hyphen: &Node) -> Result<Vec<String>, PddlFault> {
        let Some(kind) = kind else {
            return Err(self.fault(hyphen.place, NO_TYPE, "the name of a type"));
        };
        let types: Vec<String> = if kind.head() == Some("either") {
            let names = tail(kind).iter().map(|n| self.word(n, "type").map(str::to_owned));
            names.collect::<Result<_, _>>()?
        } else {
            vec![self.word(kind, "type")?.to_owned()]
        };
        if types.iter().any(|name| name.starts_with('-')) {
            return Err(self.fault(kind.place, NO_TYPE, "the name of a type"));
        }
        if !(1..=MAX_EITHER).contains(&types.len()) {
            let expected = format!("(either TYPE ...) with 1 to {MAX_EITHER} types");
            return Err(self.unexpected(kind, "type", &expected));
        }
        Ok(types)
    }
}

impl Source<'_> {
    /// Refuses a section with more entries than anybody writes by hand.
    pub fn few(&self, section: &Node) -> Result<(), PddlFault> {
        let found = tail(section).len();
        if found <= MAX_NAMES {
            return Ok(());
        }
        let problem = format!("{} has {found} entries", section.shown());
        Err(self.fault(section.place, problem, format!("at most {MAX_NAMES}")))
    }

    /// Refuses a second declaration of a name.
    pub fn twice(&self, place: Place, what: &str, name: &str, expected: &str) -> PddlFault {
        self.fault(place, format!("the {what} `{name}` is declared twice"), expected)
    }

    /// Reads variables. Each begins with `?`, and no two are equal where `declared` is false.
    pub fn variables(
        &self,
        nodes: &[Node],
        types: &Types,
        declared: bool,
    ) -> Result<Vec<Typed>, PddlFault> {
        let read = self.typed(nodes, types)?;
        let mut seen = BTreeSet::new();
        for (place, typed) in &read {
            if !typed.name.starts_with('?') {
                let name = short(&typed.name);
                let problem = format!("the parameter `{name}` has no question mark");
                return Err(self.fault(*place, problem, format!("`?{name}`")));
            }
            if !seen.insert(&typed.name) {
                if !declared {
                    return Err(self.twice(*place, "parameter", &typed.name, "another name"));
                }
                self.warn(
                    *place,
                    format!("the parameter `{}` is declared twice", short(&typed.name)),
                );
            }
        }
        Ok(read.into_iter().map(|(_, typed)| typed).collect())
    }

    /// Adds declared objects to those that are known. The same object again is no fault.
    pub fn declare(
        &self,
        known: &mut Vec<Typed>,
        declared: Vec<(Place, Typed)>,
        types: &Types,
    ) -> Result<(), PddlFault> {
        let mut places: HashMap<String, usize> =
            known.iter().enumerate().map(|(at, object)| (object.name.clone(), at)).collect();
        for (place, object) in declared {
            let Some(at) = places.get(&object.name) else {
                places.insert(object.name.clone(), known.len());
                known.push(object);
                continue;
            };
            let known = &mut known[*at];
            if types.fits(&object.types, &known.types) {
                known.types = object.types;
            } else if !types.fits(&known.types, &object.types) {
                return Err(self.twice(
                    place,
                    "object",
                    &object.name,
                    "one declaration of each object",
                ));
            }
            self.warn(place, format!("the object `{}` is declared twice", short(&object.name)));
        }
        Ok(())
    }

    pub fn arity(&self, node: &Node, found: usize, wanted: usize) -> PddlFault {
        let s = if found == 1 { "" } else { "s" };
        let problem = format!("{} has {found} argument{s}", node.shown());
        self.fault(node.place, problem, format!("{wanted}"))
    }

    pub fn mistyped(&self, node: &Node, kinds: &[String], wanted: &[String]) -> PddlFault {
        let problem = format!("{} is of type {}", node.shown(), kinds.join(" or "));
        self.fault(node.place, problem, wanted.join(" or "))
    }

    /// Returns the position of the predicate of an atom with the right number of arguments.
    pub fn applied(&self, node: &Node, domain: &Domain) -> Result<usize, PddlFault> {
        if node.head().is_none() {
            return Err(self.unexpected(node, "fact", "(PREDICATE OBJECT ...)"));
        }
        let known = domain.predicates.iter().map(|p| (p.name.as_str(), p.parameters.len()));
        self.applied_to(node, "predicate", known)
    }

    /// Returns the position of the action of a call with the right number of arguments.
    pub fn called(&self, node: &Node, domain: &Domain) -> Result<usize, PddlFault> {
        if node.head().is_none() {
            return Err(self.unexpected(node, "action", "(ACTION OBJECT ...)"));
        }
        let known = domain.actions.iter().map(|a| (a.name.as_str(), a.parameters.len()));
        self.applied_to(node, "action", known)
    }

    /// Returns the position of the name at the head of a node, and refuses another number of arguments. `known` has all
    /// names and their numbers of arguments.
    pub fn applied_to<'d>(
        &self,
        node: &Node,
        what: &str,
        known: impl Iterator<Item = (&'d str, usize)> + Clone,
    ) -> Result<usize, PddlFault> {
        let (name, given) = (node.head().unwrap_or_default(), tail(node).len());
        if let Some(index) =
            known.clone().position(|(known, count)| known == name && count == given)
        {
            return Ok(index);
        }
        let counts: Vec<String> =
            known.clone().filter(|(known, _)| *known == name).map(|(_, n)| n.to_string()).collect();
        if counts.is_empty() {
            let near = meant(name, known.clone().map(|(name, _)| name));
            let names: Vec<&str> = known.map(|(name, _)| name).collect();
            let expected = match names.is_empty() {
                true => format!("one of: none, as no {what} is declared"),
                false => format!("one of: {}{near}", nearest_first(name, names)),
            };
            return Err(self.unexpected(node, what, &expected));
        }
        let s = if given == 1 { "" } else { "s" };
        let problem = format!("{} has {given} argument{s}", node.shown());
        Err(self.fault(node.place, problem, counts.join(" or ")))
    }
}
