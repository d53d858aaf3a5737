//! Reads problems.

use std::collections::{BTreeMap, BTreeSet};

use super::pddl::{Domain, EQUAL, Fact, Problem, Typed};
use super::read::{conjuncts, tail};
use super::sexpr::{Node, PddlFault, Place, Source};

impl Problem {
    /// Reads a problem of `domain` from PDDL. `file` names the text in errors.
    ///
    /// # Errors
    /// The first fault, with its place, what was found and what was expected.
    pub fn parse(bytes: &[u8], file: &str, domain: &Domain) -> Result<Self, PddlFault> {
        let source = Source { file };
        let nodes = source.nodes(bytes)?;
        let (name, sections) = source.defined(&nodes, "problem")?;
        let mut problem = Self {
            name,
            domain: domain.name.clone(),
            objects: Vec::new(),
            init: Vec::new(),
            goal: Vec::new(),
        };
        // The objects are needed to check all other sections.
        for section in sections.iter().filter(|s| s.head() == Some(":objects")) {
            let objects = source.typed(tail(section), &domain.types)?;
            problem.objects.extend(objects.into_iter().map(|(_, typed)| typed));
        }
        let objects: Vec<&Typed> = domain.constants.iter().chain(&problem.objects).collect();
        source.distinct(sections, &objects)?;
        let objects = objects.into_iter().map(|object| (object.name.as_str(), object)).collect();
        let facts = FactReader { source, domain, objects };
        let (mut init, mut goal) = (Vec::new(), Vec::new());
        for section in sections {
            match section.head() {
                Some(":domain") => {
                    let named = tail(section).first().and_then(Node::word);
                    if named != Some(&domain.name) {
                        let problem = "the problem belongs to another domain";
                        let expected = format!("(:domain {})", domain.name);
                        return Err(source.fault(section.place, problem, expected));
                    }
                }
                Some(":init") => {
                    for node in tail(section) {
                        init.extend(facts.literal(node)?.and_then(|(holds, f)| holds.then_some(f)));
                    }
                }
                Some(":goal") => {
                    let [node] = tail(section) else {
                        let problem = "the goal is not a single condition";
                        return Err(source.fault(section.place, problem, "(:goal (and ...))"));
                    };
                    for node in conjuncts(node) {
                        let Some(condition) = facts.literal(node)? else {
                            let what = "condition that can be met by actions";
                            let expected = "(PREDICATE OBJECT ...) or (not (PREDICATE OBJECT ...))";
                            return Err(source.unexpected(node, what, expected));
                        };
                        goal.push(condition);
                    }
                }
                Some(":objects" | ":requirements" | ":metric") => {}
                _ => {
                    let expected = ":domain, :objects, :requirements, :init, :goal or :metric";
                    return Err(source.unexpected(section, "section of a problem", expected));
                }
            }
        }
        let mut goals = sections.iter().filter(|section| section.head() == Some(":goal"));
        match (goals.next(), goals.next()) {
            (Some(_), None) => {}
            (found, second) => {
                let start = Place { line: 1, column: 1 };
                let place = second.or(found).map_or(start, |section| section.place);
                let problem = match second {
                    Some(_) => format!("the problem `{}` has a second goal", problem.name),
                    None => format!("the problem `{}` has no goal", problem.name),
                };
                return Err(source.fault(place, problem, "one (:goal (and ...))"));
            }
        }
        (problem.init, problem.goal) = (init, goal);
        Ok(problem)
    }
}

/// Reads facts over known objects.
struct FactReader<'a> {
    source: Source<'a>,
    domain: &'a Domain,
    objects: BTreeMap<&'a str, &'a Typed>,
}

impl FactReader<'_> {
    /// Reads a fact or its negation. A numeric fluent `(= (...) NUMBER)` is skipped: `None`.
    fn literal(&self, node: &Node) -> Result<Option<(bool, Fact)>, PddlFault> {
        if let (Some(EQUAL), [fluent, _]) = (node.head(), tail(node))
            && fluent.list().is_some()
        {
            return Ok(None);
        }
        let (holds, node) = match (node.head(), tail(node)) {
            (Some("not"), [inner]) => (false, inner),
            _ => (true, node),
        };
        let index = self.source.applied(node, self.domain)?;
        let mut arguments = Vec::new();
        for (argument, wanted) in tail(node).iter().zip(&self.domain.predicates[index].parameters) {
            let word = self.source.word(argument, "object")?;
            let Some(object) = self.objects.get(word) else {
                let problem = format!("`{word}` is no object");
                let expected = "an object of :objects or :constants";
                return Err(self.source.fault(argument.place, problem, expected));
            };
            if !self.domain.types.fits(&object.types, &wanted.types) {
                return Err(self.source.mistyped(argument, &object.types, &wanted.types));
            }
            arguments.push(word.to_owned());
        }
        let predicate = self.domain.predicates[index].name.clone();
        Ok(Some((holds, Fact { predicate, arguments })))
    }
}

impl Source<'_> {
    /// Refuses two objects with one name.
    fn distinct(&self, sections: &[Node], objects: &[&Typed]) -> Result<(), PddlFault> {
        let mut seen = BTreeSet::new();
        match objects.iter().find(|o| !seen.insert(&o.name)) {
            None => Ok(()),
            Some(twice) => {
                let mut places = sections.iter().filter(|s| s.head() == Some(":objects"));
                let place = places.next_back().map_or(Place { line: 1, column: 1 }, |s| s.place);
                Err(self.twice(place, "object", &twice.name, "one declaration of each object"))
            }
        }
    }
}
