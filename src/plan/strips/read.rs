//! Reads domains.
//!
//! What is sloppy but clear is read with a warning. Names are folded to lower case, because PDDL does not distinguish
//! case.

use std::cell::RefCell;
use std::collections::{BTreeSet, HashMap};

use super::conditions::Scope;
use super::formula::{Derived, Function};
use super::lists::{MAX_NAMES, tail};
use super::numbers::Numbers;
use super::pddl::{Action, Domain, EQUAL, OBJECT, Predicate, Typed, Types};
use super::sexpr::{Node, Notes, PddlFault, Place, Source, short};
use super::strata::Strata;
use crate::sim::{meant, nearest_first};

/// Requirements whose features are read.
const REQUIREMENTS: [&str; 14] = [
    ":strips",
    ":typing",
    ":negative-preconditions",
    ":equality",
    ":adl",
    ":disjunctive-preconditions",
    ":existential-preconditions",
    ":universal-preconditions",
    ":quantified-preconditions",
    ":conditional-effects",
    ":derived-predicates",
    ":action-costs",
    ":durative-actions",
    ":preferences",
];

/// Greatest number of constants.
const MAX_CONSTANTS: usize = 100_000;

/// Greatest number of actions of a domain.
pub const MAX_ACTIONS: usize = 4_096;

/// Greatest number of parameters of all predicates and actions.
const MAX_PARAMETERS: usize = 20_000;

/// Whether the preconditions and effects of a domain's actions are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bodies {
    /// Read them. A warning says that durative actions are read as instant ones.
    Read,
    /// Read them. Durative actions are meant to be instant.
    Instant,
    /// Skip them, as well as functions and derived predicates. Actions have neither preconditions nor effects.
    Skip,
}

impl Domain {
    /// Reads a domain from PDDL: `:adl`, derived predicates, and action costs. A durative action is read as one without
    /// duration. `file` names the text in errors and warnings. If the text has a problem beside the domain,
    /// the problem is skipped.
    ///
    /// # Errors
    /// The first fault, with its place, what was found and what was expected. A text has at most 64 MiB, 3 million words and
    /// parentheses, and lists in 64 others; a domain at most 1,024 types, predicates and functions each, 100,000 constants,
    /// 4,096 actions and as many rules for derived predicates, 20,000 parameters, and 1,024 variables at any place.
    pub fn parse(bytes: &[u8], file: &str, bodies: Bodies) -> Result<Self, PddlFault> {
        let notes = Notes::default();
        let source = Source { file, notes: &notes };
        let nodes = source.nodes(bytes)?;
        let (name, sections) = source.defined(&nodes, "domain")?;
        let mut domain = DomainReader { source, bodies, domain: Self { name, ..Self::default() } }
            .read(sections)?;
        domain.warnings = notes.into_warnings();
        Ok(domain)
    }
}

struct DomainReader<'a> {
    source: Source<'a>,
    bodies: Bodies,
    domain: Domain,
}

/// Sections of a domain, in the order in which they are read: what a section names is declared before it.
const SECTIONS: [&str; 9] = [
    ":requirements",
    ":types",
    ":constants",
    ":objects",
    ":predicates",
    ":functions",
    ":derived",
    ":action",
    ":durative-action",
];

impl DomainReader<'_> {
    fn read(mut self, sections: &[Node]) -> Result<Domain, PddlFault> {
        let named = |section: &Node| section.head().is_some_and(|name| SECTIONS.contains(&name));
        for section in sections.iter().filter(|section| !named(section)) {
            self.unread(section)?;
        }
        let once =
            [":requirements", ":types", ":constants", ":objects", ":predicates", ":functions"];
        self.source.warn_of_repeated(sections, &once);
        let of = |name: &'static str| sections.iter().filter(move |s| s.head() == Some(name));
        of(":requirements").try_for_each(|section| self.requirements(section))?;
        self.types(sections)?;
        of(":constants").chain(of(":objects")).try_for_each(|section| self.constants(section))?;
        of(":predicates").try_for_each(|section| self.predicates(section))?;
        if self.bodies != Bodies::Skip {
            of(":functions").try_for_each(|section| self.functions(section))?;
            of(":derived").try_for_each(|section| self.derived_signature(section))?;
        }
        let numbers = RefCell::new(Numbers::default());
        let constants = self.domain.constants.iter();
        let constants: HashMap<String, Vec<String>> =
            constants.map(|c| (c.name.clone(), c.types.clone())).collect();
        let mut kinds = BTreeSet::new();
        if self.bodies != Bodies::Skip {
            for section in of(":derived") {
                if self.domain.derived.len() == MAX_ACTIONS {
                    let problem = "there are too many rules for derived predicates";
                    let expected = format!("at most {MAX_ACTIONS}");
                    return Err(self.source.fault(section.place, problem, expected));
                }
                let scope = Scope::new(self.source, &self.domain, &constants, &numbers, &mut kinds);
                if let [head, body] = tail(section) {
                    let derived = derived(scope, head, body)?;
                    self.domain.derived.push(derived);
                }
            }
            self.order_derived(sections)?;
        }
        let actions = sections
            .iter()
            .filter(|s| s.head() == Some(":action") || s.head() == Some(":durative-action"));
        for section in actions {
            let action = self.action(section, &constants, &numbers, &mut kinds)?;
            self.domain.instant |= section.head() == Some(":durative-action");
            self.domain.actions.push(action);
        }
        for kind in kinds {
            let parameter = Typed { name: "?object".into(), types: vec![OBJECT.into()] };
            let (parameters, of_type) = (vec![parameter], true);
            self.domain.predicates.push(Predicate { name: kind, parameters, of_type });
        }
        numbers.into_inner().finish(self.source, &mut self.domain)?;
        Ok(self.domain)
    }

    /// Refuses or skips a section that is not read.
    fn unread(&self, section: &Node) -> Result<(), PddlFault> {
        let why = match (section.head(), self.bodies) {
            (Some(":axiom" | ":constraints"), Bodies::Skip) => return Ok(()),
            (Some(":length" | ":documentation" | ":addl"), _) => {
                let what =
                    format!("{} says nothing about the actions and is ignored", section.shown());
                self.source.warn(section.place, what);
                return Ok(());
            }
            (Some(":process" | ":event"), _) => "processes and events, which go on by themselves",
            (Some(":constraints"), _) => "constraints on the states along a plan",
            (Some(":task" | ":method" | ":tasks" | ":htn"), _) => "hierarchical tasks and methods",
            (Some(":axiom"), _) => "axioms in the notation before PDDL 2.2 (write :derived)",
            (Some(":observe" | ":sensing-action"), _) => "sensing",
            _ => {
                let near = meant(section.head().unwrap_or_default(), SECTIONS);
                let expected = format!(
                    "{}{near}",
                    nearest_first(section.head().unwrap_or_default(), SECTIONS)
                );
                return Err(self.source.unexpected(section, "section of a domain", &expected));
            }
        };
        let problem = format!("{} needs {why}, which this planner does not have", section.shown());
        Err(self.source.fault(section.place, problem, "actions, and predicates that they change"))
    }

    fn requirements(&mut self, section: &Node) -> Result<(), PddlFault> {
        for node in tail(section) {
            let word = self.source.word(node, "requirement")?;
            if self.bodies != Bodies::Skip && !REQUIREMENTS.contains(&word) {
                let what = match word {
                    ":fluents" | ":numeric-fluents" => {
                        "is read in part: numbers that no condition needs changed"
                    }
                    _ if REQUIREMENTS.iter().any(|known| known[1..] == *word) => {
                        "has no colon, and is read as if it had"
                    }
                    _ => "is ignored; what is used of it is refused",
                };
                let word = short(word);
                self.source.warn(node.place, format!("the requirement `{word}` {what}"));
            }
            self.domain.requirements.push(word.to_owned());
        }
        Ok(())
    }

    fn types(&mut self, sections: &[Node]) -> Result<(), PddlFault> {
        let mut declared = Vec::new();
        let sections = sections.iter().filter(|section| section.head() == Some(":types"));
        let mut place = Place { line: 1, column: 1 };
        for section in sections {
            self.source.few(section)?;
            place = section.place;
            for (place, typed) in self.source.untyped(tail(section), |_| false)? {
                if typed.types.contains(&typed.name) {
                    let what =
                        format!("the type `{}` is declared as its own supertype", typed.name);
                    self.source.warn(place, what);
                }
                declared.push(typed);
            }
        }
        self.domain.types = Types::new(declared).map_err(|name| {
            let problem = format!("the type `{name}` is its own supertype");
            self.source.fault(place, problem, "a hierarchy without circles")
        })?;
        Ok(())
    }

    fn constants(&mut self, section: &Node) -> Result<(), PddlFault> {
        if tail(section).len() > MAX_CONSTANTS {
            let problem = format!("{} has {} entries", section.shown(), tail(section).len());
            return Err(self.source.fault(
                section.place,
                problem,
                format!("at most {MAX_CONSTANTS}"),
            ));
        }
        if section.head() == Some(":objects") {
            self.source
                .warn(section.place, "the domain has `:objects`; they are read as constants");
        }
        let constants = self.source.typed(tail(section), &self.domain.types)?;
        self.source.declare(&mut self.domain.constants, constants, &self.domain.types)
    }

    fn predicates(&mut self, section: &Node) -> Result<(), PddlFault> {
        self.source.few(section)?;
        for node in tail(section) {
            if node.head() == Some(EQUAL) {
                self.source.warn(node.place, "`=` compares objects without a declaration");
                continue;
            }
            let expected = "(NAME ?PARAMETER - TYPE ...)";
            let Some(name) = node.head() else {
                return Err(self.source.unexpected(node, "declaration of a predicate", expected));
            };
            let parameters = self.parameters(tail(node), true)?;
            self.predicate(node.place, name, parameters)?;
        }
        Ok(())
    }

    /// Declares a predicate. A predicate with another number of arguments is another one.
    fn predicate(
        &mut self,
        place: Place,
        name: &str,
        parameters: Vec<Typed>,
    ) -> Result<(), PddlFault> {
        if let Some(known) = self.domain.predicate_of(name, parameters.len()) {
            self.source.warn(place, format!("the predicate `{}` is declared twice", short(name)));
            // An argument may be of the types of both declarations.
            for (known, other) in
                self.domain.predicates[known].parameters.iter_mut().zip(parameters)
            {
                let new = other.types.into_iter().filter(|t| !known.types.contains(t));
                known.types.extend(new.collect::<Vec<_>>());
            }
            return Ok(());
        }
        if self.domain.predicates.len() == MAX_NAMES {
            let expected = format!("at most {MAX_NAMES}");
            return Err(self.source.fault(place, "there are too many predicates", expected));
        }
        if self.domain.predicate(name).is_some() {
            let what = format!(
                "the predicate `{}` is declared with several numbers of arguments",
                short(name)
            );
            self.source.warn(place, what);
        }
        let name = name.to_owned();
        self.domain.predicates.push(Predicate { name, parameters, of_type: false });
        Ok(())
    }

    fn functions(&mut self, section: &Node) -> Result<(), PddlFault> {
        self.source.few(section)?;
        let mut nodes = tail(section).iter();
        while let Some(node) = nodes.next() {
            if node.word() == Some("-") {
                // The type of a function is `number`. A function of another type is refused where it is used.
                nodes.next();
                continue;
            }
            let Some(name) = node.head() else {
                let expected = "(NAME ?PARAMETER - TYPE ...) - number";
                return Err(self.source.unexpected(node, "declaration of a function", expected));
            };
            if self.domain.functions.iter().any(|f| f.name == name) {
                self.source
                    .warn(node.place, format!("the function `{}` is declared twice", short(name)));
                continue;
            }
            let (name, parameters) = (name.to_owned(), self.parameters(tail(node), true)?);
            self.domain.functions.push(Function { name, parameters, changes: false });
        }
        Ok(())
    }

    /// Reads parameters. Each begins with `?`. No two are equal, except in a declaration, where names mean nothing.
    fn parameters(&self, nodes: &[Node], declared: bool) -> Result<Vec<Typed>, PddlFault> {
        let lists = self.domain.predicates.iter().map(|p| &p.parameters);
        let lists = lists.chain(self.domain.actions.iter().map(|a| &a.parameters));
        let lists = lists.chain(self.domain.functions.iter().map(|f| &f.parameters));
        let known: usize = lists.map(Vec::len).sum();
        let most = MAX_NAMES.min(MAX_PARAMETERS.saturating_sub(known));
        if let Some(node) = nodes.get(most) {
            return Err(self.source.fault(node.place, "there are too many parameters", "fewer"));
        }
        self.source.variables(nodes, &self.domain.types, declared)
    }

    /// Declares the predicate of a rule that derives it, if it is not declared.
    fn derived_signature(&mut self, section: &Node) -> Result<(), PddlFault> {
        let [head, _] = tail(section) else {
            let expected = "(:derived (NAME ?PARAMETER - TYPE ...) CONDITION)";
            return Err(self.source.unexpected(section, "rule for a derived predicate", expected));
        };
        let Some(name) = head.head().filter(|name| *name != EQUAL) else {
            return Err(self.source.unexpected(head, "predicate", "(NAME ?PARAMETER - TYPE ...)"));
        };
        if self.domain.predicate_of(name, count_variables(tail(head))).is_none() {
            let what =
                format!("the derived predicate `{}` is not declared in :predicates", short(name));
            self.source.warn(head.place, what);
            let parameters = self.parameters(tail(head), false)?;
            self.predicate(head.place, name, parameters)?;
        }
        Ok(())
    }

    /// Sorts the rules so that each follows those of the predicates in its condition that do not need its own.
    fn order_derived(&mut self, sections: &[Node]) -> Result<(), PddlFault> {
        let rules = std::mem::take(&mut self.domain.derived);
        let strata = Strata::new(&rules);
        if !strata.opposed.is_empty() {
            let mut of_rules = sections.iter().filter(|s| s.head() == Some(":derived"));
            let opposed = |name: &str| strata.opposed.contains(&name);
            let named = |s: &&Node| tail(s).first().and_then(Node::head).is_some_and(opposed);
            let place = of_rules.find(named).map_or(Place { line: 1, column: 1 }, |s| s.place);
            let names = strata.opposed.iter().take(5).map(|n| format!("`{}`", short(n)));
            let names: Vec<String> = names.collect();
            let problem = format!("{} is derived by way of its own opposite", names.join(" or "));
            let expected = "derived predicates that do not need their opposites";
            return Err(self.source.fault(place, problem, expected));
        }
        let of = |rule: &Derived| strata.stratum(&rule.predicate, rule.parameters.len());
        let mut order: Vec<usize> = (0..rules.len()).collect();
        order.sort_by_key(|at| of(&rules[*at]));
        self.domain.derived = order.into_iter().map(|at| rules[at].clone()).collect();
        Ok(())
    }

    fn action(
        &self,
        section: &Node,
        constants: &HashMap<String, Vec<String>>,
        numbers: &RefCell<Numbers>,
        kinds: &mut BTreeSet<String>,
    ) -> Result<Action, PddlFault> {
        let durative = section.head() == Some(":durative-action");
        let expected = match durative {
            false => "(:action NAME :parameters (...) :precondition (...) :effect (...))",
            true => {
                "(:durative-action NAME :parameters (...) :duration (...) :condition (...) :effect (...))"
            }
        };
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
        let mut action = Action { name: name.to_owned(), ..Action::default() };
        let mut parts = tail(section)[1..].iter().peekable();
        let (mut before, mut after, mut duration) = (None, None, None);
        let mut keys = BTreeSet::new();
        while let Some(key) = parts.next() {
            if key.word().is_none() {
                if keys.is_empty() {
                    return Err(self.source.unexpected(key, "part of an action", expected));
                }
                let problem = format!("{} follows a complete part of the action", key.shown());
                return Err(self.source.fault(key.place, problem, "several in one (and ...)"));
            }
            if !keys.insert(key.word()) {
                let problem = format!("the action `{name}` has a second {}", key.shown());
                return Err(self.source.fault(key.place, problem, "each part once"));
            }
            let empty = |next: &&&Node| next.word().is_some_and(|word| word.starts_with(':'));
            let known = matches!(
                key.word(),
                Some(":parameters" | ":precondition" | ":condition" | ":effect")
            );
            if known && parts.peek().is_none_or(|next| empty(&next)) {
                self.source
                    .warn(key.place, format!("{} of `{}` is empty", key.shown(), short(name)));
                continue;
            }
            let Some(value) = parts.next() else {
                return Err(self.source.unexpected(key, "complete part of an action", expected));
            };
            match (key.word(), durative) {
                (Some(":parameters"), _) => {
                    let Some(list) = value.list() else {
                        let expected = "(?PARAMETER - TYPE ...)";
                        return Err(self.source.unexpected(value, "list of parameters", expected));
                    };
                    action.parameters = self.parameters(list, false)?;
                }
                (Some(":precondition"), false) => before = Some(value),
                (Some(":precondition" | ":condition"), true) => before = Some(value),
                (Some(":duration"), true) => duration = Some(value),
                (Some(":effect"), _) => after = Some(value),
                (word, _) => {
                    let parts = expected.split_ascii_whitespace().filter(|w| w.starts_with(':'));
                    let near = meant(word.unwrap_or_default(), parts);
                    let expected = format!("{expected}{near}");
                    return Err(self.source.unexpected(key, "part of an action", &expected));
                }
            }
        }
        if self.bodies == Bodies::Skip {
            return Ok(action);
        }
        let mut scope = Scope::new(self.source, &self.domain, constants, numbers, kinds);
        scope.variables.clone_from(&action.parameters);
        if durative {
            if self.bodies == Bodies::Read {
                let what = "durative actions are read as instant ones: durations, and what goes on at the same time, are lost";
                self.source.warn(section.place, what);
            }
            scope.durative(&mut action, [duration, before, after])?;
            return Ok(action);
        }
        if let Some(node) = before {
            scope.preconditions(node, &mut action)?;
        }
        if let Some(node) = after {
            scope.effects(node, &mut action)?;
        }
        Ok(action)
    }
}

/// Returns the number of variables of a typed list.
fn count_variables(nodes: &[Node]) -> usize {
    nodes.iter().filter(|node| node.word().is_some_and(|word| word.starts_with('?'))).count()
}

/// Reads a rule for a derived predicate.
fn derived(mut scope: Scope<'_>, head: &Node, body: &Node) -> Result<Derived, PddlFault> {
    let predicate = head.head().unwrap_or_default().to_owned();
    let mut parameters = scope.source.variables(tail(head), &scope.domain.types, false)?;
    // Types may stand in the declaration alone.
    if let Some(declared) = scope.domain.predicate_of(&predicate, parameters.len()) {
        let declared = &scope.domain.predicates[declared].parameters;
        for (own, declared) in parameters.iter_mut().zip(declared) {
            if own.types == [OBJECT] {
                own.types.clone_from(&declared.types);
            }
        }
    }
    scope.variables.clone_from(&parameters);
    let condition = scope.hard(body)?;
    Ok(Derived { predicate, parameters, condition })
}
