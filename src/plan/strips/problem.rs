//! Reads problems.

use std::cell::RefCell;
use std::collections::{BTreeSet, HashMap, HashSet};

use super::conditions::{Scope, split};
use super::formula::{Condition, Expression, Number};
use super::lists::tail;
use super::numbers::{Numbers, TOTAL_COST};
use super::pddl::{Domain, EQUAL, Fact, Literal, Problem, Term, Typed, Types};
use super::sexpr::{Node, Notes, PddlFault, Place, Source, short};

impl Problem {
    /// Reads a problem of `domain` from PDDL. `file` names the text in errors and warnings. If the text has a domain beside
    /// the problem, the domain is skipped.
    ///
    /// # Errors
    /// The first fault, with its place, what was found and what was expected. A text has at most 64 MiB, 3 million words and
    /// parentheses, and lists in 64 others; a typed list at most 500,000 types of all its names.
    pub fn parse(bytes: &[u8], file: &str, domain: &Domain) -> Result<Self, PddlFault> {
        let notes = Notes::default();
        let source = Source { file, notes: &notes };
        let nodes = source.nodes(bytes)?;
        let (name, sections) = source.defined(&nodes, "problem")?;
        let mut problem = Self { name, domain: domain.name.clone(), ..Self::default() };
        for section in sections.iter().filter(|s| s.head() == Some(":domain")) {
            if tail(section).first().and_then(Node::word) != Some(&domain.name) {
                let what =
                    format!("the problem names another domain than `{}`", short(&domain.name));
                source.warn(section.place, what);
            }
        }
        // The objects are needed to check all other sections.
        let mut objects = domain.constants.clone();
        for section in sections.iter().filter(|s| s.head() == Some(":objects")) {
            let declared = source.typed(tail(section), &domain.types)?;
            source.declare(&mut objects, declared, &domain.types)?;
        }
        let types = objects.iter().map(|o| (o.name.clone(), o.types.clone())).collect();
        problem.objects = objects.split_off(domain.constants.len());
        let narrowed = objects.into_iter().zip(&domain.constants).filter(|(own, c)| own != *c);
        problem.objects.extend(narrowed.map(|(own, _)| own));
        source.warn_of_repeated(sections, &[":objects", ":init"]);
        let reader = ProblemReader { source, domain, types: &types };
        for section in sections {
            reader.section(section, &mut problem)?;
        }
        reader.one_goal(&problem.name, sections)?;
        if !sections.iter().any(|section| section.head() == Some(":init")) {
            let what = format!(
                "the problem `{}` has no (:init ...): nothing holds at first",
                short(&problem.name)
            );
            source.warn(Place { line: 1, column: 1 }, what);
        }
        problem.add_facts_of_types(domain);
        let increased = domain.actions.iter().flat_map(|action| &action.increases);
        if problem.metric.is_none() && increased.clone().any(|i| i.function.predicate == TOTAL_COST)
        {
            let predicate = TOTAL_COST.to_owned();
            problem.metric = Some(Fact { predicate, arguments: Vec::new() });
        }
        problem.warnings = notes.into_warnings();
        Ok(problem)
    }

    /// Adds the facts of predicates that are the names of types.
    fn add_facts_of_types(&mut self, domain: &Domain) {
        let known: HashSet<Fact> = match domain.predicates.iter().any(|p| p.of_type) {
            true => self.init.iter().cloned().collect(),
            false => return,
        };
        for predicate in domain.predicates.iter().filter(|p| p.of_type) {
            let kind = std::slice::from_ref(&predicate.name);
            let objects = self.all_objects(domain).into_iter();
            let of_kind = objects.filter(|o| domain.types.may_be(&o.types, kind));
            let facts: Vec<Fact> = of_kind
                .map(|o| Fact {
                    predicate: predicate.name.clone(),
                    arguments: vec![o.name.clone()],
                })
                .collect();
            self.init.extend(facts.into_iter().filter(|fact| !known.contains(fact)));
        }
    }
}

/// Reads the sections of a problem whose objects are known.
struct ProblemReader<'a> {
    source: Source<'a>,
    domain: &'a Domain,
    types: &'a HashMap<String, Vec<String>>,
}

impl ProblemReader<'_> {
    fn section(&self, section: &Node, problem: &mut Problem) -> Result<(), PddlFault> {
        let source = self.source;
        match section.head() {
            Some(":init") => {
                for node in tail(section) {
                    self.initial(node, problem)?;
                }
                self.warn_of_both(tail(section), problem)?;
            }
            Some(":goal") => {
                let [node] = tail(section) else {
                    let problem = "the goal is not a single condition";
                    return Err(source.fault(section.place, problem, "(:goal (and ...))"));
                };
                let (numbers, mut kinds) = (RefCell::new(Numbers::default()), BTreeSet::new());
                let mut scope = Scope::new(source, self.domain, self.types, &numbers, &mut kinds);
                let condition = scope.condition(node)?;
                let condition = of_kinds(condition, &kinds, 0);
                let mut literals = Vec::new();
                split(condition, &mut |literal| literals.push(literal), &mut problem.conditions);
                for literal in literals {
                    match (&literal.atom.predicate[..], fact(&literal)) {
                        (name, Some(fact)) if name != EQUAL => {
                            problem.goal.push((literal.positive, fact));
                        }
                        _ => problem.conditions.push(Condition::Literal(literal)),
                    }
                }
            }
            Some(":metric") => self.metric(section, problem),
            Some(":requirements") => {
                let words = tail(section).iter().filter_map(Node::word);
                problem.requirements.extend(words.map(str::to_owned));
            }
            Some(":domain" | ":objects") => {}
            Some(":length" | ":situation" | ":documentation") => {
                let what =
                    format!("{} says nothing about the plan and is ignored", section.shown());
                source.warn(section.place, what);
            }
            Some(":constraints") => {
                let problem = "`(:constraints ...)` needs constraints on the states along a plan, which this planner does not have";
                return Err(source.fault(section.place, problem, "a goal alone"));
            }
            Some(":htn") => {
                let problem =
                    "`(:htn ...)` needs hierarchical tasks, which this planner does not have";
                return Err(source.fault(section.place, problem, "a goal"));
            }
            _ => {
                let expected = ":domain, :objects, :requirements, :init, :goal or :metric";
                return Err(source.unexpected(section, "section of a problem", expected));
            }
        }
        Ok(())
    }

    /// Warns of facts that hold at first and are also said not to.
    fn warn_of_both(&self, nodes: &[Node], problem: &Problem) -> Result<(), PddlFault> {
        let mut denied = nodes.iter().filter(|node| node.head() == Some("not")).peekable();
        if denied.peek().is_none() {
            return Ok(());
        }
        let holds: HashSet<&Fact> = problem.init.iter().collect();
        for node in denied {
            if let [inner] = tail(node) {
                let fact = self.fact(inner)?;
                if holds.contains(&fact) {
                    let what = format!("`{fact}` is said to hold at first and not to; it holds");
                    self.source.warn(node.place, what);
                }
            }
        }
        Ok(())
    }

    /// Reads a fact of the initial state, or the value of a function. What does not hold says nothing.
    fn initial(&self, node: &Node, problem: &mut Problem) -> Result<(), PddlFault> {
        let source = self.source;
        let rest = tail(node);
        let known = |name: &str| self.domain.predicate(name).is_some();
        match (node.head(), rest) {
            (Some("and"), _) if !known("and") => {
                source.warn(node.place, "the initial state has an `and`");
                return rest.iter().try_for_each(|part| self.initial(part, problem));
            }
            (Some("not"), [inner]) => {
                self.fact(inner)?;
                return Ok(());
            }
            (Some(EQUAL), [function, value]) if function.list().is_some() => {
                return self.value(function, value, problem);
            }
            (Some("at"), [time, inner])
                if inner.list().is_some()
                    && time.word().is_some_and(|t| t.parse::<f64>().is_ok()) =>
            {
                let problem = "a fact that becomes true at a certain time (a timed initial literal) needs time, which this planner does not have";
                return Err(source.fault(node.place, problem, "facts that hold at first"));
            }
            (Some(uncertain @ ("oneof" | "unknown" | "or" | "probabilistic")), _)
                if !known(uncertain) =>
            {
                let problem = format!(
                    "`({uncertain} ...)` makes the initial state uncertain, and this planner needs one that is certain"
                );
                return Err(source.fault(node.place, problem, "facts that hold at first"));
            }
            (Some(compound @ ("forall" | "exists" | "imply" | "when")), _) if !known(compound) => {
                let problem = format!("`({compound} ...)` is no fact");
                let expected = "each fact that holds at first, one by one";
                return Err(source.fault(node.place, problem, expected));
            }
            (Some(kind), [object])
                if !known(kind) && self.domain.types.contains(kind) && object.word().is_some() =>
            {
                source
                    .warn(node.place, format!("the type `{}` is used as a predicate", short(kind)));
                return Ok(());
            }
            _ => {}
        }
        let fact = self.fact(node)?;
        if self.domain.derived.iter().any(|rule| {
            rule.predicate == fact.predicate && rule.parameters.len() == fact.arguments.len()
        }) {
            let what = format!("`{}` is derived; it is ignored in :init", short(&fact.predicate));
            source.warn(node.place, what);
        } else {
            problem.init.push(fact);
        }
        Ok(())
    }

    /// Reads the value of a function.
    fn value(&self, function: &Node, value: &Node, problem: &mut Problem) -> Result<(), PddlFault> {
        let Some(name) = function.head() else {
            return Err(self.source.unexpected(function, "function", "(FUNCTION OBJECT ...)"));
        };
        let Some(number) = value.word().and_then(|word| word.parse().ok()).and_then(Number::new)
        else {
            let what = "number (object fluents are not read)";
            return Err(self.source.unexpected(value, what, "a number such as 3 or 0.5"));
        };
        let words = tail(function).iter().map(|node| self.source.word(node, "object"));
        let arguments: Vec<String> =
            words.map(|word| word.map(str::to_owned)).collect::<Result<_, _>>()?;
        let known = self.domain.functions.iter().find(|f| f.name == name);
        match known {
            Some(known) if known.parameters.len() != arguments.len() => {
                return Err(self.source.arity(function, arguments.len(), known.parameters.len()));
            }
            Some(_) => {
                for (node, word) in tail(function).iter().zip(&arguments) {
                    self.object(node, word)?;
                }
            }
            // Nothing that is read of the domain names it.
            None if self.domain.functions.is_empty() => {}
            None => {
                let what =
                    format!("the domain has no function `{}`; its values are ignored", short(name));
                self.source.warn(function.place, what);
            }
        }
        problem.numbers.push((Fact { predicate: name.to_owned(), arguments }, number));
        Ok(())
    }

    fn object(&self, node: &Node, word: &str) -> Result<&Vec<String>, PddlFault> {
        self.types.get(word).ok_or_else(|| self.source.no_object(node, word, self.types))
    }

    fn fact(&self, node: &Node) -> Result<Fact, PddlFault> {
        let index = self.source.applied(node, self.domain)?;
        let mut arguments = Vec::new();
        for (argument, wanted) in tail(node).iter().zip(&self.domain.predicates[index].parameters) {
            let word = self.source.word(argument, "object")?;
            let types = self.object(argument, word)?;
            self.source.fitting(argument, types, &wanted.types, &self.domain.types)?;
            arguments.push(word.to_owned());
        }
        Ok(Fact { predicate: self.domain.predicates[index].name.clone(), arguments })
    }

    /// Reads what is to be minimised. All that is not the value of one function is ignored.
    fn metric(&self, section: &Node, problem: &mut Problem) {
        let (numbers, mut kinds) = (RefCell::new(Numbers::default()), BTreeSet::new());
        let mut scope = Scope::new(self.source, self.domain, self.types, &numbers, &mut kinds);
        if let [sense, value] = tail(section)
            && sense.word() == Some("minimize")
        {
            let of_time = |node: &Node| matches!(node.head().or(node.word()), Some("total-time"));
            if of_time(value) {
                return;
            }
            if let Ok(Expression::Function(atom)) = scope.expression(value) {
                problem.metric = fact(&Literal { positive: true, atom });
                return;
            }
        }
        let named = tail(section).get(1).and_then(Node::head);
        let named = named.filter(|name| !["+", "-", "*", "/"].contains(name));
        let unknown = named.filter(|name| !self.domain.functions.iter().any(|f| f.name == *name));
        let why = unknown.map(|name| format!("the domain has no function `{}`: ", short(name)));
        let what = "the metric is ignored; only (minimize (FUNCTION OBJECT ...)) is read";
        let what = why.unwrap_or_default() + what;
        self.source.warn(section.place, what);
    }

    /// Refuses a problem without goal, or with two.
    fn one_goal(&self, name: &str, sections: &[Node]) -> Result<(), PddlFault> {
        let mut goals = sections.iter().filter(|section| section.head() == Some(":goal"));
        match (goals.next(), goals.next()) {
            (Some(_), None) => Ok(()),
            (found, second) => {
                let start = Place { line: 1, column: 1 };
                let place = second.or(found).map_or(start, |section| section.place);
                let problem = match second {
                    Some(_) => format!("the problem `{}` has a second goal", short(name)),
                    None => format!("the problem `{}` has no goal", short(name)),
                };
                Err(self.source.fault(place, problem, "one (:goal (and ...))"))
            }
        }
    }
}

/// Replaces types that are used as predicates, which the domain does not have: `(box ?x)` becomes
/// `(exists (?a-box - box) (= ?x ?a-box))`. `depth` is the number of variables around the condition.
fn of_kinds(condition: Condition, kinds: &BTreeSet<String>, depth: usize) -> Condition {
    let all = |parts: Vec<Condition>| -> Vec<Condition> {
        parts.into_iter().map(|part| of_kinds(part, kinds, depth)).collect()
    };
    match condition {
        Condition::Literal(mut literal) if kinds.contains(&literal.atom.predicate) => {
            let kind = std::mem::replace(&mut literal.atom.predicate, EQUAL.to_owned());
            literal.atom.arguments.push(Term::Parameter(depth));
            let positive = std::mem::replace(&mut literal.positive, true);
            let variable = Typed { name: format!("?a-{kind}"), types: vec![kind] };
            let inner = Box::new(Condition::Literal(literal));
            let found = Condition::Exists(vec![variable], inner);
            if positive { found } else { Condition::Not(Box::new(found)) }
        }
        Condition::Literal(_) | Condition::Compare(..) => condition,
        Condition::Not(inner) => Condition::Not(Box::new(of_kinds(*inner, kinds, depth))),
        Condition::All(parts) => Condition::All(all(parts)),
        Condition::Any(parts) => Condition::Any(all(parts)),
        Condition::Exists(variables, inner) => {
            let inner = of_kinds(*inner, kinds, depth + variables.len());
            Condition::Exists(variables, Box::new(inner))
        }
        Condition::Forall(variables, inner) => {
            let inner = of_kinds(*inner, kinds, depth + variables.len());
            Condition::Forall(variables, Box::new(inner))
        }
    }
}

/// Returns the fact of a literal whose arguments are objects.
fn fact(literal: &Literal) -> Option<Fact> {
    let object = |term: &Term| match term {
        Term::Constant(name) => Some(name.clone()),
        Term::Parameter(_) => None,
    };
    let arguments = literal.atom.arguments.iter().map(object).collect::<Option<_>>()?;
    Some(Fact { predicate: literal.atom.predicate.clone(), arguments })
}

impl Source<'_> {
    /// Refuses a term whose types are not those that are wanted, and warns if they need not be.
    pub fn fitting(
        &self,
        node: &Node,
        kinds: &[String],
        wanted: &[String],
        types: &Types,
    ) -> Result<(), PddlFault> {
        // What is `(either ...)` is meant to fit in one of its types.
        if types.may_be(kinds, wanted) {
            return Ok(());
        }
        if !types.overlap(kinds, wanted) {
            return Err(self.mistyped(node, kinds, wanted));
        }
        let (kinds, wanted) = (kinds.join(" or "), wanted.join(" or "));
        self.warn(
            node.place,
            format!("{} is of type {kinds} where {wanted} is expected", node.shown()),
        );
        Ok(())
    }
}
