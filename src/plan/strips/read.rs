//! Reads domains.
//!
//! The subset is typed STRIPS: `:strips`, `:typing`, `:negative-preconditions` and `:equality`. Names are folded to
//! lower case, because PDDL does not distinguish case.

use std::collections::BTreeSet;

use super::pddl::{Action, Atom, Domain, EQUAL, Literal, OBJECT, Predicate, Term, Typed, Types};
use super::sexpr::{Node, PddlFault, Place, Source};

/// Requirements that a domain may name.
const REQUIREMENTS: [&str; 4] = [":strips", ":typing", ":negative-preconditions", ":equality"];

/// Greatest number of types, of constants, of predicates, of actions, and of parameters of each.
const MAX_NAMES: usize = 1_024;

/// Greatest number of actions of a domain.
pub const MAX_ACTIONS: usize = 4_096;

/// Greatest number of parameters of all predicates and actions.
const MAX_PARAMETERS: usize = 20_000;

/// Greatest number of types in `(either ...)`.
const MAX_EITHER: usize = 64;

/// Greatest number of types of all names of a typed list.
const MAX_TYPED: usize = 500_000;

/// Whether the preconditions and effects of a domain's actions are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bodies {
    /// Read them. The domain must be typed STRIPS.
    Read,
    /// Skip them, as well as functions, axioms and requirements beyond typed STRIPS. Actions have neither
    /// preconditions nor effects.
    Skip,
}

impl Domain {
    /// Reads a domain from PDDL. `file` names the text in errors.
    ///
    /// # Errors
    /// The first fault, with its place, what was found and what was expected.
    pub fn parse(bytes: &[u8], file: &str, bodies: Bodies) -> Result<Self, PddlFault> {
        let source = Source { file };
        let nodes = source.nodes(bytes)?;
        let (name, sections) = source.defined(&nodes, "domain")?;
        DomainReader { source, bodies, domain: Self { name, ..Self::default() } }.read(sections)
    }
}

/// Returns the elements of a list after its first.
pub(super) fn tail(node: &Node) -> &[Node] {
    node.list().and_then(|nodes| nodes.get(1..)).unwrap_or(&[])
}

/// Returns the conditions of `(and ...)`, of `()`, or the single condition.
pub(super) fn conjuncts(node: &Node) -> Vec<&Node> {
    match node.list() {
        Some([]) => Vec::new(),
        Some(_) if node.head() == Some("and") => tail(node).iter().collect(),
        _ => vec![node],
    }
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
        let [define] = nodes else {
            let problem = match nodes.first() {
                None => "the text is empty".to_owned(),
                Some(_) => format!("the text is {} lists or words", nodes.len()),
            };
            return Err(self.fault(start, problem, expected));
        };
        if let (Some("define"), [named, sections @ ..]) = (define.head(), tail(define))
            && named.head() == Some(what)
            && let [name] = tail(named)
            && let Some(name) = name.word()
        {
            return Ok((name.to_owned(), sections));
        }
        Err(self.fault(start, format!("{} is no {what}", define.shown()), expected))
    }

    pub fn unexpected(&self, node: &Node, what: &str, expected: &str) -> PddlFault {
        self.fault(node.place, format!("{} is no {what}", node.shown()), expected)
    }

    pub fn word<'n>(&self, node: &'n Node, what: &str) -> Result<&'n str, PddlFault> {
        node.word().ok_or_else(|| self.unexpected(node, what, "a name"))
    }

    /// Reads `a b - t c - (either t u) d`. Names without a type are of type `object`.
    pub fn typed(&self, nodes: &[Node], types: &Types) -> Result<Vec<(Place, Typed)>, PddlFault> {
        let read = self.untyped(nodes)?;
        for (node, typed) in &read {
            if let Some(unknown) = typed.types.iter().find(|t| !types.contains(t)) {
                let known: Vec<&str> = types.declared().iter().map(|t| t.name.as_str()).collect();
                let known = format!("one of: {OBJECT}, {}", known.join(", "));
                let problem = format!("`{}` has the unknown type `{unknown}`", typed.name);
                return Err(self.fault(*node, problem, known.trim_end_matches(", ")));
            }
        }
        Ok(read)
    }

    /// Reads a typed list without checking that its types exist.
    fn untyped(&self, nodes: &[Node]) -> Result<Vec<(Place, Typed)>, PddlFault> {
        let mut read: Vec<(Place, Typed)> = Vec::new();
        let (mut first_without, mut typed) = (0, 0);
        let mut nodes = nodes.iter();
        while let Some(node) = nodes.next() {
            let word = self.word(node, "name")?;
            if word != "-" {
                let typed = Typed { name: word.to_owned(), types: vec![OBJECT.into()] };
                read.push((node.place, typed));
                continue;
            }
            let Some(kind) = nodes.next() else {
                return Err(self.fault(node.place, "no type follows `-`", "the name of a type"));
            };
            let types: Vec<String> = if kind.head() == Some("either") {
                let names = tail(kind).iter().map(|n| self.word(n, "type").map(str::to_owned));
                names.collect::<Result<_, _>>()?
            } else {
                vec![self.word(kind, "type")?.to_owned()]
            };
            if !(1..=MAX_EITHER).contains(&types.len()) {
                let expected = format!("(either TYPE ...) with 1 to {MAX_EITHER} types");
                return Err(self.unexpected(kind, "type", &expected));
            }
            typed += types.len() * (read.len() - first_without);
            if typed > MAX_TYPED {
                let expected = format!("at most {MAX_TYPED} types of all names together");
                return Err(self.fault(kind.place, "the list has too many names", expected));
            }
            for (_, name) in &mut read[first_without..] {
                name.types.clone_from(&types);
            }
            first_without = read.len();
        }
        Ok(read)
    }
}

struct DomainReader<'a> {
    source: Source<'a>,
    bodies: Bodies,
    domain: Domain,
}

impl DomainReader<'_> {
    fn read(mut self, sections: &[Node]) -> Result<Domain, PddlFault> {
        // Declarations first: their order in the file does not matter.
        for order in [":requirements", ":types", ":constants", ":predicates", ":action"] {
            for section in sections.iter().filter(|s| s.head() == Some(order)) {
                match order {
                    ":requirements" => self.requirements(section)?,
                    ":types" => {
                        self.source.few(section)?;
                        let types = self.source.untyped(tail(section))?;
                        let types = types.into_iter().map(|(_, typed)| typed).collect();
                        self.domain.types = Types::new(types).map_err(|name| {
                            let problem = format!("the type `{name}` is its own supertype");
                            let expected = "a hierarchy without circles";
                            self.source.fault(section.place, problem, expected)
                        })?;
                    }
                    ":constants" => {
                        self.source.few(section)?;
                        let constants = self.source.typed(tail(section), &self.domain.types)?;
                        self.domain.constants.extend(constants.into_iter().map(|(_, typed)| typed));
                    }
                    ":predicates" => self.predicates(section)?,
                    _ => self.action(section)?,
                }
            }
        }
        for section in sections {
            match (section.head(), self.bodies) {
                (Some(":requirements" | ":types" | ":constants" | ":predicates"), _)
                | (Some(":action"), _)
                | (Some(":functions" | ":derived" | ":axiom" | ":constraints"), Bodies::Skip) => {}
                _ => {
                    let expected =
                        ":requirements, :types, :constants, :predicates or :action (typed STRIPS)";
                    let what = "section of a domain";
                    return Err(self.source.unexpected(section, what, expected));
                }
            }
        }
        Ok(self.domain)
    }

    fn requirements(&mut self, section: &Node) -> Result<(), PddlFault> {
        for node in tail(section) {
            let word = self.source.word(node, "requirement")?;
            if self.bodies == Bodies::Read && !REQUIREMENTS.contains(&word) {
                let problem = format!("the requirement `{word}` is not supported");
                let expected = format!("one of: {}", REQUIREMENTS.join(", "));
                return Err(self.source.fault(node.place, problem, expected));
            }
            self.domain.requirements.push(word.to_owned());
        }
        Ok(())
    }

    fn predicates(&mut self, section: &Node) -> Result<(), PddlFault> {
        self.source.few(section)?;
        for node in tail(section) {
            let expected = "(NAME ?PARAMETER - TYPE ...)";
            let Some(name) = node.head().filter(|name| *name != EQUAL) else {
                return Err(self.source.unexpected(node, "declaration of a predicate", expected));
            };
            if self.domain.predicate(name).is_some() {
                return Err(self.source.twice(node.place, "predicate", name, "another name"));
            }
            let parameters = self.parameters(tail(node))?;
            self.domain.predicates.push(Predicate { name: name.to_owned(), parameters });
        }
        Ok(())
    }

    /// Reads parameters. Each begins with `?`, and no two are equal.
    fn parameters(&self, nodes: &[Node]) -> Result<Vec<Typed>, PddlFault> {
        let lists = self.domain.predicates.iter().map(|p| &p.parameters);
        let lists = lists.chain(self.domain.actions.iter().map(|a| &a.parameters));
        let known: usize = lists.map(Vec::len).sum();
        let most = MAX_NAMES.min(MAX_PARAMETERS.saturating_sub(known));
        if let Some(node) = nodes.get(most) {
            return Err(self.source.fault(node.place, "there are too many parameters", "fewer"));
        }
        let read = self.source.typed(nodes, &self.domain.types)?;
        let mut seen = BTreeSet::new();
        for (place, typed) in &read {
            if !typed.name.starts_with('?') {
                let problem = format!("the parameter `{}` has no question mark", typed.name);
                return Err(self.source.fault(*place, problem, format!("`?{}`", typed.name)));
            }
            if !seen.insert(&typed.name) {
                return Err(self.source.twice(*place, "parameter", &typed.name, "another name"));
            }
        }
        Ok(read.into_iter().map(|(_, typed)| typed).collect())
    }

    fn action(&mut self, section: &Node) -> Result<(), PddlFault> {
        let expected = "(:action NAME :parameters (...) :precondition (...) :effect (...))";
        let Some(name) = tail(section).first().and_then(Node::word) else {
            return Err(self.source.unexpected(section, "action", expected));
        };
        if self.domain.actions.len() == MAX_ACTIONS {
            let expected = format!("at most {MAX_ACTIONS}");
            return Err(self.source.fault(section.place, "there are too many actions", expected));
        }
        if self.domain.action(name).is_some() {
            return Err(self.source.twice(section.place, "action", name, "another name"));
        }
        let mut action = Action {
            name: name.to_owned(),
            parameters: Vec::new(),
            preconditions: Vec::new(),
            effects: Vec::new(),
        };
        let mut parts = tail(section)[1..].iter();
        let (mut before, mut after) = (None, None);
        let mut keys = BTreeSet::new();
        while let Some(key) = parts.next() {
            let Some(value) = parts.next() else {
                return Err(self.source.unexpected(key, "complete part of an action", expected));
            };
            if !keys.insert(key.word()) {
                let problem = format!("the action `{name}` has a second {}", key.shown());
                return Err(self.source.fault(key.place, problem, "each part once"));
            }
            match key.word() {
                Some(":parameters") if value.list().is_some() => {
                    action.parameters = self.parameters(value.list().unwrap_or(&[]))?;
                }
                Some(":precondition") => before = Some(value),
                Some(":effect") => after = Some(value),
                _ => return Err(self.source.unexpected(key, "part of an action", expected)),
            }
        }
        if self.bodies == Bodies::Read {
            for node in before.map(conjuncts).unwrap_or_default() {
                action.preconditions.push(self.literal(node, &action.parameters, true)?);
            }
            for node in after.map(conjuncts).unwrap_or_default() {
                action.effects.push(self.literal(node, &action.parameters, false)?);
            }
        }
        self.domain.actions.push(action);
        Ok(())
    }

    fn literal(
        &self,
        node: &Node,
        parameters: &[Typed],
        condition: bool,
    ) -> Result<Literal, PddlFault> {
        let (positive, node) = match (node.head(), tail(node)) {
            (Some("not"), [inner]) => (false, inner),
            _ => (true, node),
        };
        let Some(name) = node.head() else {
            let expected = "(PREDICATE ...) or (not (PREDICATE ...))";
            return Err(self.source.unexpected(node, "literal", expected));
        };
        let nodes = tail(node);
        let wanted = match name == EQUAL && condition {
            true if nodes.len() != 2 => return Err(self.source.arity(node, nodes.len(), 2)),
            true => None,
            false => {
                let index = self.source.applied(node, &self.domain)?;
                Some(&self.domain.predicates[index].parameters)
            }
        };
        let mut arguments = Vec::new();
        for (index, argument) in nodes.iter().enumerate() {
            let word = self.source.word(argument, "argument")?;
            let parameter = parameters.iter().position(|p| p.name == word);
            let constant = self.domain.constants.iter().find(|c| c.name == word);
            let (term, kinds) = match (parameter, constant) {
                (Some(position), _) => (Term::Parameter(position), &parameters[position].types),
                (None, Some(constant)) => (Term::Constant(word.to_owned()), &constant.types),
                (None, None) => {
                    let named = parameters.iter().chain(&self.domain.constants);
                    let named: Vec<&str> = named.map(|t| t.name.as_str()).collect();
                    let expected = format!("one of: {}", named.join(", "));
                    let what = "parameter or constant";
                    return Err(self.source.unexpected(argument, what, &expected));
                }
            };
            if let Some(wanted) = wanted.map(|w| &w[index].types)
                && !self.domain.types.fits(kinds, wanted)
            {
                return Err(self.source.mistyped(argument, kinds, wanted));
            }
            arguments.push(term);
        }
        Ok(Literal { positive, atom: Atom { predicate: name.to_owned(), arguments } })
    }
}

impl Source<'_> {
    /// Refuses a section with more entries than anybody writes by hand.
    fn few(&self, section: &Node) -> Result<(), PddlFault> {
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

    fn arity(&self, node: &Node, found: usize, wanted: usize) -> PddlFault {
        let s = if found == 1 { "" } else { "s" };
        let problem = format!("{} has {found} argument{s}", node.shown());
        self.fault(node.place, problem, format!("{wanted}"))
    }

    pub fn mistyped(&self, node: &Node, kinds: &[String], wanted: &[String]) -> PddlFault {
        let problem = format!("{} is of type {}", node.shown(), kinds.join(" or "));
        self.fault(node.place, problem, wanted.join(" or "))
    }

    /// Returns the position of the name at the head of a node, and refuses another number of arguments. `known` has all names
    /// and their numbers of arguments.
    fn applied_to<'d>(
        &self,
        node: &Node,
        what: &str,
        known: impl Iterator<Item = (&'d str, usize)> + Clone,
    ) -> Result<usize, PddlFault> {
        let found = known.clone().enumerate().find(|(_, (name, _))| node.head() == Some(name));
        let Some((index, (_, wanted))) = found else {
            let names: Vec<&str> = known.map(|(name, _)| name).collect();
            return Err(self.unexpected(node, what, &format!("one of: {}", names.join(", "))));
        };
        match tail(node).len() {
            found if found == wanted => Ok(index),
            found => Err(self.arity(node, found, wanted)),
        }
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
}
