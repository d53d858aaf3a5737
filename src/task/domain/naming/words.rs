//! Sentences for states, actions, conditions, side effects and goals, and how a person changes names.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use super::nouns::{is_only, noun};
use super::statement::{MAX_SENTENCE, Statement, with_object, with_reference};
use super::states::{Described, IN_START_AREA, describe, named_landmark};
use crate::robot::Pose;
use crate::sim::is_plain;
use crate::task::domain::relative;
use crate::task::domain::state::{Coordinate, ROOMY_M, Turn};
use crate::task::domain::{
    Before, Condition, Fact, Frame, FrameState, GoalTerm, Need, NeedVerdict, Origin, Place,
    Quantity, RelationalDomain, RelationalOperator, Role, SideEffect, Subject,
};
use crate::task::error::TaskError;
use crate::task::propositional::{Fault, find};
use crate::task::recording::ObjectPose;

/// Distance from a place, along each coordinate, up to which an object in another orientation lies wrongly there, in metres.
const WRONGLY_M: f64 = 0.025;

/// Returns whether a position is in a place but for a distance: along coordinates with room for several objects, and along the others.
fn is_within(place: &Place, position: [f64; 3], [room_m, tight_m]: [f64; 2]) -> bool {
    let mut all = place.coordinates.iter().zip(position);
    all.all(|(coordinate, x)| match coordinate.room() {
        Some((low, high)) => (low - room_m..=high + room_m).contains(&x),
        None => (x - coordinate.middle()).abs() <= tight_m,
    })
}

impl RelationalDomain {
    /// Returns the index of the state called `name`.
    ///
    /// # Errors
    /// [`TaskError::Unknown`] if there is no such state; the error lists all states.
    pub fn state(&self, name: &str) -> Result<usize, TaskError> {
        find(name, "state", self.states.iter().map(|s| s.name.as_str()))
    }

    /// Returns the goal that one object is in the state called `name`. If the demonstrations had a goal about this state that
    /// counts only some references, so does this one.
    ///
    /// # Errors
    /// As [`RelationalDomain::state`].
    pub fn goal(&self, name: &str) -> Result<GoalTerm, TaskError> {
        let (state, quantity) = (self.state(name)?, Quantity::AtLeast(1));
        let own = self.goals.iter().find(|goal| goal.state == state);
        let reference = own.and_then(|goal| goal.reference);
        Ok(GoalTerm { state, or: Vec::new(), quantity, reference, held: 0, of: 0 })
    }

    /// Returns the goal of the demonstrations in words; `None` if there is none.
    pub fn goals_in_words(&self) -> Option<String> {
        let terms: Vec<String> = self.goals.iter().map(|goal| self.goal_in_words(goal)).collect();
        (!terms.is_empty()).then(|| terms.join(", and "))
    }

    /// Returns the names of `states`, in the same order.
    pub fn names(&self, states: &[usize]) -> Vec<&str> {
        states.iter().map(|s| self.states[*s].name.as_str()).collect()
    }

    /// Returns the goal of the demonstrations in symbols, such as `KNIFE_AT_PLATE at each plate, CUP_PLACED`; empty if there is
    /// none.
    pub fn goals_in_symbols(&self) -> String {
        let terms: Vec<String> = self.goals.iter().map(|goal| self.goal_in_symbols(goal)).collect();
        terms.join(", ")
    }

    /// Returns a term of a goal in symbols, such as `KNIFE_AT_PLATE at each plate`.
    pub fn goal_in_symbols(&self, goal: &GoalTerm) -> String {
        let (state, kind) = (&self.states[goal.state], self.states[goal.state].frame.name());
        let many = |n: usize| if n == 1 { String::new() } else { format!("{n} x ") };
        let within = goal.reference.map(|r| format!(" at a {kind} in {}", self.states[r].name));
        match goal.quantity {
            Quantity::AtLeast(n) => many(n) + &state.name + &within.unwrap_or_default(),
            Quantity::EachReference(n) => format!("{}{} at each {kind}", many(n), state.name),
            Quantity::EachObject => {
                let names: Vec<&str> = goal.states().map(|s| &*self.states[s].name).collect();
                format!("{} for each {}", names.join(" or "), state.kind)
            }
        }
    }

    /// Returns the symbols of all states, then of all actions.
    fn symbols(&self) -> impl Iterator<Item = &str> + Clone {
        let states = self.states.iter().map(|s| s.name.as_str());
        states.chain(self.operators.iter().map(|o| o.name.as_str()))
    }

    /// Returns a copy of the domain with new names for some states and actions, given as pairs of old and new name.
    /// All renames apply at once, so two names can be swapped. Sentences stay as they are.
    ///
    /// # Errors
    /// [`TaskError::Unknown`] if an old name is neither a state nor an action; [`TaskError::BadDomain`] if an old name
    /// is given twice or a new name is invalid or already used.
    pub fn rename(&self, renames: &[(String, String)]) -> Result<Self, TaskError> {
        self.check_renamed(renames, "name")?;
        let mut renamed = self.clone();
        let new = |old: &str| renames.iter().find(|(o, _)| o == old).map(|(_, new)| new.clone());
        let states = renamed.states.iter_mut().map(|s| &mut s.name);
        for name in states.chain(renamed.operators.iter_mut().map(|o| &mut o.name)) {
            *name = new(name).unwrap_or_else(|| std::mem::take(name));
        }
        let words = self.words.iter();
        renamed.words = words
            .map(|(name, words)| (new(name).unwrap_or_else(|| name.clone()), words.clone()))
            .collect();
        renamed.check().map(|()| renamed)
    }

    /// Returns a copy of the domain with new sentences for some states and actions, given as pairs of symbol and sentence.
    ///
    /// # Errors
    /// As [`RelationalDomain::rename`].
    pub fn reword(&self, sentences: &[(String, String)]) -> Result<Self, TaskError> {
        self.check_renamed(sentences, "sentence")?;
        let mut reworded = self.clone();
        reworded.words.extend(sentences.iter().cloned());
        reworded.check().map(|()| reworded)
    }

    /// Refuses a new name or sentence for something unknown, and two for one thing.
    fn check_renamed(&self, renames: &[(String, String)], what: &str) -> Result<(), TaskError> {
        for (index, (old, _)) in renames.iter().enumerate() {
            find(old, "state or action", self.symbols())?;
            if renames[..index].iter().any(|(earlier, _)| earlier == old) {
                let reason =
                    format!("`{old}` is renamed twice; expected one new {what} for each old name");
                return Err(TaskError::BadDomain { reason });
            }
        }
        Ok(())
    }

    /// Returns the sentence of a state, such as `a cup is in a drawer`.
    ///
    /// # Panics
    /// If there is no such state.
    pub fn state_in_words(&self, state: usize) -> Cow<'_, str> {
        match self.words.get(&self.states[state].name) {
            Some(words) => words.into(),
            None => describe(&self.states, &self.operators, &self.goals, named_landmark)[state]
                .statement()
                .into(),
        }
    }

    /// Returns the sentence of an operator, such as `put a cup in a drawer`.
    pub fn operator_in_words<'d>(&'d self, operator: &RelationalOperator) -> Cow<'d, str> {
        match self.words.get(&operator.name) {
            Some(words) => words.into(),
            None => describe(&self.states, &self.operators, &self.goals, named_landmark)
                [operator.to]
                .order()
                .into(),
        }
    }

    /// Returns the statement that an object is in a state, such as `cup 0 is in the drawer`. `objects` are the names of
    /// the scene's objects.
    ///
    /// # Panics
    /// If there is no such object or state.
    pub fn fact_in_words(&self, fact: &Fact, object: usize, objects: &[String]) -> String {
        let state = &self.states[fact.state];
        let statement = Statement::new(&self.state_in_words(fact.state), &state.kind);
        let statement = match fact.reference {
            // As in an order: what opens does not name what it belongs to, unless there are several.
            Some(reference)
                if statement.names(state.frame.kind()) || !is_only(&objects[reference]) =>
            {
                statement.at(state.frame.kind(), &objects[reference])
            }
            _ => statement,
        };
        statement.about(&objects[object])
    }

    /// Returns where an object is: the statement that it is in a state, as [`fact_in_words`](Self::fact_in_words) says it. What lies outside
    /// the area in which objects of its kind were found still counts as found there if it lies as high: then it is said to lie
    /// wrongly where it should be put, or to be loose. `all` are the objects, and `first` is the pose in which it was first
    /// seen.
    ///
    /// # Panics
    /// If there is no such object or state.
    #[cfg_attr(not(feature = "physics"), allow(dead_code))] // Episodes and their pages ask.
    pub(crate) fn whereabouts(
        &self,
        fact: &Fact,
        object: usize,
        names: &[String],
        all: &[ObjectPose],
        first: &Pose,
    ) -> String {
        let words = self.fact_in_words(fact, object, names);
        let (state, pose) = (&self.states[fact.state], &all[object].pose);
        let found = state.origin == Origin::Found && state.frame == Frame::World;
        let area = [ROOMY_M, f64::INFINITY];
        let within = |place: &Place| is_within(place, pose.position, area);
        // The demonstrations seldom show all of the area: where it stood at first is in it.
        if !found || first.distance(pose) <= ROOMY_M || state.places.iter().any(within) {
            return words;
        }
        match self.lies_wrongly(&state.kind, pose, all) {
            Some(place) => {
                let there = self.fact_in_words(&place, object, names);
                format!("{there}, but lies wrongly there")
            }
            None => words.replacen(IN_START_AREA, &format!("loose, not {IN_START_AREA}"), 1),
        }
    }

    /// Returns where an object of a kind is that lies where one is put, whatever its orientation.
    fn lies_wrongly(&self, kind: &str, pose: &Pose, all: &[ObjectPose]) -> Option<Fact> {
        let references = all.iter().enumerate();
        let mut facts = references.flat_map(|(reference, object)| {
            let own = relative(&object.pose, pose);
            let placed = self.states.iter().enumerate().filter(|(_, state)| {
                state.kind == kind
                    && state.origin == Origin::Placed
                    && state.frame.kind() == Some(&*object.kind)
            });
            placed.filter_map(move |(state, model)| {
                let near = |place: &Place| is_within(place, own.position, [WRONGLY_M; 2]);
                let place = model.places.iter().position(near)?;
                Some(Fact { state, place, reference: Some(reference) })
            })
        });
        facts.next()
    }

    /// Returns that so many objects are in a state, such as `2 cups are in a drawer`.
    ///
    /// # Panics
    /// If there is no such state.
    pub fn count_in_words(&self, state: usize, count: usize) -> String {
        let statement = Statement::new(&self.state_in_words(state), &self.states[state].kind);
        match count {
            0 => statement.about_none(""),
            1 => statement.about_any(""),
            count => statement.about_some(&count.to_string(), ""),
        }
    }

    /// Returns the sentence of the state or action of this symbol; the symbol itself if it is neither.
    pub fn in_words<'d>(&'d self, symbol: &'d str) -> Cow<'d, str> {
        match self.words.get(symbol) {
            Some(words) => words.into(),
            None => {
                let state = self.states.iter().position(|s| s.name == symbol);
                let operator = || self.operators.iter().find(|o| o.name == symbol);
                match state {
                    Some(state) => self.state_in_words(state),
                    None => operator().map_or(symbol.into(), |o| self.operator_in_words(o)),
                }
            }
        }
    }

    /// Adds the sentences that are missing in [`RelationalDomain::words`].
    pub(crate) fn complete_words(&mut self) {
        let described = describe(&self.states, &self.operators, &self.goals, named_landmark);
        let mut taken: BTreeSet<String> = self.words.values().cloned().collect();
        let states = self.states.iter().zip(&described).map(|(s, own)| (&s.name, own.statement()));
        let of = |o: &RelationalOperator| described.get(o.to).map(Described::order);
        let operators = self.operators.iter().filter_map(|o| Some((&o.name, of(o)?)));
        for (name, mut words) in states.chain(operators) {
            if self.words.contains_key(name) {
                continue;
            }
            // Two operators can bring about one state, and a person can have given the sentence to another.
            let (wanted, mut number) = (words.clone(), 1);
            while taken.contains(&words) {
                number += 1;
                words = format!("{wanted} ({number})");
            }
            taken.insert(words.clone());
            self.words.insert(name.clone(), words);
        }
    }

    /// Returns what is wrong with the sentences, if anything is.
    pub(in crate::task::domain) fn fault_of_words(&self) -> Option<Fault> {
        let mut of: BTreeMap<&str, &str> = BTreeMap::new();
        for symbol in self.symbols() {
            let Some(words) = self.words.get(symbol) else { continue };
            let length = words.chars().count();
            if !is_plain(words) || words.trim().is_empty() || length > MAX_SENTENCE {
                let problem =
                    format!("the sentence of `{symbol}` cannot be printed or is too long");
                let expected = format!("1 to {MAX_SENTENCE} characters, no control character");
                return Some(Fault::new(problem, expected));
            }
            if let Some(other) = of.insert(words, symbol) {
                let problem = format!("`{other}` and `{symbol}` have the same sentence, `{words}`");
                return Some(Fault::new(problem, "another sentence for each state and action"));
            }
        }
        None
    }

    /// Returns a copy of the domain in which no action may begin while a state holds that never held before it. With few
    /// demonstrations, a state can be absent by coincidence.
    pub fn with_unseen_absent(&self) -> Self {
        let mut domain = self.clone();
        for operator in &mut domain.operators {
            let of = operator.instances;
            let subject = Subject::Any;
            let unseen = operator.never_seen.iter().map(|state| Need {
                condition: Condition { state: *state, subject },
                or: Vec::new(),
                verdict: NeedVerdict::Absent,
                holds: false,
                least: 1,
                every: false,
                held: 0,
                of,
            });
            operator.needs.extend(unseen);
        }
        domain
    }

    /// Returns the kind of the object that a role of an operator stands for; `None` if there is no such object, or if it
    /// differs between the states that the object may leave.
    pub fn role_kind(&self, operator: &RelationalOperator, role: Role) -> Option<&str> {
        let to = &self.states[operator.to];
        match role {
            Role::Object => Some(&to.kind),
            Role::Target => to.frame.kind(),
            Role::Origin => {
                let mut kinds = operator.from.iter().map(|s| self.states[*s].frame.kind());
                let first = kinds.next()??;
                kinds.all(|kind| kind == Some(first)).then_some(first)
            }
        }
    }

    /// Returns what has to be filled before a place in words, with places counted from 1, such as `of the places where a book is on
    /// the shelf, place 2 comes after place 1`.
    pub fn order_in_words(&self, operator: &RelationalOperator, before: &Before) -> String {
        let own = self.state_in_words(operator.to);
        let place = |(state, place): &(usize, usize)| match *state == operator.to {
            true => format!("place {}", place + 1),
            false => format!("place {} where {}", place + 1, self.state_in_words(*state)),
        };
        let one_of: Vec<String> = before.one_of.iter().map(place).collect();
        let place = before.place + 1;
        format!("of the places where {own}, place {place} comes after {}", one_of.join(" or "))
    }

    /// Returns a condition before an action in words, such as `at least 4 chairs are at the table`.
    pub fn need_in_words(&self, operator: &RelationalOperator, need: &Need) -> String {
        let subject = need.condition.subject;
        let least = format!("at least {}", need.least);
        let of = |state: usize| {
            let (statement, who) = self.statement(operator, Condition { state, subject });
            match (need.is_positive(), who) {
                (true, Some(object)) => statement.about(&object),
                (false, Some(object)) => statement.not_about(&object),
                (false, None) => statement.about_none(""),
                (true, None) if need.every => statement
                    .about(&format!("every {}", noun(&self.states[need.condition.state].kind))),
                (true, None) if need.least > 1 => statement.about_some(&least, ""),
                (true, None) => statement.about_any(""),
            }
        };
        let all: Vec<String> = need.states().map(of).collect();
        all.join(if need.is_positive() { " or " } else { " and " })
    }

    /// Returns a change of another object's state in words, such as `a cup is no longer in the drawer`.
    pub fn side_effect_in_words(
        &self,
        operator: &RelationalOperator,
        effect: &SideEffect,
    ) -> String {
        let (statement, who) = self.statement(operator, effect.condition);
        let words = match who {
            Some(object) => statement.about(&object),
            None => statement.about_any(""),
        };
        match (effect.begins, words.split_once(" is ")) {
            (true, _) => words,
            (false, Some((object, rest))) => format!("{object} is no longer {rest}"),
            (false, None) => format!("no longer: {words}"),
        }
    }

    /// Returns the statement of a condition of an operator, and the object that it is about; `None` for any other object.
    fn statement(
        &self,
        operator: &RelationalOperator,
        condition: Condition,
    ) -> (Statement, Option<String>) {
        let state = &self.states[condition.state];
        let statement = Statement::new(&self.state_in_words(condition.state), &state.kind);
        match condition.subject {
            Subject::Is(role) => (statement, Some(self.role_in_words(operator, role))),
            Subject::At(role) => {
                let reference = self.role_in_words(operator, role);
                let own = state.kind == self.states[operator.to].kind;
                let statement = if own { statement.other() } else { statement };
                (statement.at(state.frame.kind(), &reference), None)
            }
            Subject::Any => {
                let roles = [Role::Object, Role::Origin, Role::Target];
                let own = roles.iter().any(|r| self.role_kind(operator, *r) == Some(&state.kind));
                (if own { statement.other() } else { statement }, None)
            }
        }
    }

    /// Returns what a role of an operator is called, such as `the cup`, or `the moved block` where another role has the same
    /// kind.
    fn role_in_words(&self, operator: &RelationalOperator, role: Role) -> String {
        let roles = [Role::Object, Role::Origin, Role::Target];
        let Some(kind) = self.role_kind(operator, role) else {
            return match role {
                Role::Object => "what is moved",
                Role::Origin => "what it leaves",
                Role::Target => "what it goes to",
            }
            .into();
        };
        let same = roles.iter().filter(|r| self.role_kind(operator, **r) == Some(kind)).count();
        let which = match role {
            _ if same == 1 => "",
            Role::Object => "moved ",
            Role::Origin => "former ",
            Role::Target => "target ",
        };
        format!("the {which}{}", noun(kind))
    }

    /// Returns a term of the goal in words, such as `a fork is beside each plate`.
    pub fn goal_in_words(&self, goal: &GoalTerm) -> String {
        let state = &self.states[goal.state];
        let sentence = self.state_in_words(goal.state);
        let statement = Statement::new(&sentence, &state.kind);
        let many = |n: usize, statement: &Statement, how: &str| match n {
            1 => statement.about_any(""),
            n => statement.about_some(&format!("{how}{n}"), ""),
        };
        match goal.quantity {
            Quantity::AtLeast(n) => {
                let within = goal.reference.zip(state.frame.kind()).map(|(reference, kind)| {
                    let of = Statement::new(&self.state_in_words(reference), kind);
                    (kind, of.as_description())
                });
                let statement = match within {
                    Some((kind, reference)) => statement.at(Some(kind), &reference),
                    None => statement,
                };
                many(n, &statement, "at least ")
            }
            Quantity::EachReference(n) => {
                let kind = state.frame.kind().unwrap_or("reference");
                let each = format!("each {}", noun(kind));
                many(n, &statement.at(Some(kind), &each), "")
            }
            Quantity::EachObject => {
                let every = statement.about(&format!("every {}", noun(&state.kind)));
                let others = goal.or.iter().map(|other| {
                    Statement::new(&self.state_in_words(*other), &state.kind).rest().to_owned()
                });
                [every].into_iter().chain(others).collect::<Vec<_>>().join(" or ")
            }
        }
    }

    /// Returns the sentence of an action with its objects, such as `put cup 0 in the drawer`. `objects` are the names of the
    /// moved object and of its target; `None` stands for any.
    pub fn move_in_words(
        &self,
        operator: &RelationalOperator,
        object: Option<&str>,
        target: Option<&str>,
    ) -> String {
        let to = &self.states[operator.to];
        let mut words = self.operator_in_words(operator).into_owned();
        if let Some((kind, target)) = to.frame.kind().zip(target) {
            // An order about a thing that opens does not name what it belongs to, unless there are several.
            words = match with_reference(&words, kind, target) {
                Some(words) => words,
                None if is_only(target) => words,
                None => format!("{words} at {target}"),
            };
        }
        match object {
            Some(object) => with_object(&words, &to.kind, object),
            None => words,
        }
    }
}

impl Need {
    /// Returns why the condition has its verdict, in words, with the counts behind it.
    pub fn reason(&self) -> String {
        let Self { held, of, .. } = self;
        // The condition itself says that something is not so.
        let so = of.saturating_sub(*held);
        match (self.verdict, self.holds, self.condition.subject) {
            (NeedVerdict::Required, _, Subject::Is(_) | Subject::At(_)) => {
                format!("always held ({held} of {of}), and it is about an object of the action")
            }
            (NeedVerdict::Required, _, Subject::Any) => format!("held in {held} of {of}"),
            (NeedVerdict::Undecided, true, Subject::Any) => {
                format!("always held ({held} of {of}), but about another object")
            }
            (NeedVerdict::Undecided, true, _) => {
                format!("always held ({held} of {of}), but the other object may be there by chance")
            }
            (NeedVerdict::Undecided, false, _) => {
                format!("always so ({so} of {of}), but this may be by chance")
            }
            (NeedVerdict::Absent, ..) => {
                format!("always so ({so} of {of}), and it is about the object that moves")
            }
        }
    }
}

impl NeedVerdict {
    /// Returns `required`, `undecided` or `absent`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Required => "required",
            Self::Undecided => "undecided",
            Self::Absent => "absent",
        }
    }
}

impl FrameState {
    /// Returns how the orientation is constrained, in words, such as `one axis ±1.2°`, with the standard deviation.
    pub fn turn_in_words(&self) -> String {
        let fixed = |what: &str, sd: f64| {
            if sd > 0.0 { format!("{what} ±{:.1}°", sd.to_degrees()) } else { what.into() }
        };
        match self.turn {
            Turn::Free => "any".into(),
            Turn::Axis { sd, .. } => fixed("one axis", sd),
            Turn::Line { sd, .. } => fixed("one axis, either end ahead", sd),
            Turn::Full { sd } => fixed("all axes", sd),
            Turn::Sides { sd, sides, .. } => {
                fixed(&format!("all axes, alike from {sides} sides"), sd)
            }
        }
    }
}

impl Coordinate {
    /// Returns the standard deviation, in metres: of an open coordinate that of a uniform distribution over its range.
    pub fn spread(&self) -> f64 {
        match *self {
            Self::Tight { sd, .. } => sd,
            Self::Open { low, high } => (high - low) / 12f64.sqrt(),
        }
    }
}
