//! Planning domains with known truth, trajectories in them, and scores of learned models.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap, HashMap, HashSet};
use std::fmt::Write as _;

use rand::{Rng, RngExt};
use symbolt::plan::strips::{
    Action, Bodies, Domain, Fact, Literal, Problem, Term, Trajectory, Typed,
};
use symbolt::sim::Seed;

/// Objects with their types and the facts that hold at first.
#[derive(Default)]
pub struct Instance {
    pub objects: Vec<(String, &'static str)>,
    pub init: Vec<String>,
}

impl Instance {
    /// Adds `count` objects and returns their names.
    fn objects(&mut self, count: usize, kind: &'static str) -> Vec<String> {
        let names: Vec<String> = (0..count).map(|i| format!("{kind}{i}")).collect();
        self.objects.extend(names.iter().map(|name| (name.clone(), kind)));
        names
    }

    fn fact(&mut self, words: &[&str]) {
        self.init.push(format!("({})", words.join(" ")));
    }
}

/// A planning domain, and a function that draws an instance.
pub struct Case {
    pub name: &'static str,
    pub text: &'static str,
    draw: fn(&mut Instance, &mut dyn Rng),
}

macro_rules! cases {
    ($($name:ident),* $(,)?) => {
        /// The domains.
        pub fn cases() -> Vec<Case> {
            vec![$(Case {
                name: stringify!($name),
                text: include_str!(concat!("../fixtures/strips/", stringify!($name), ".pddl")),
                draw: $name,
            }),*]
        }
    };
}

cases!(
    blocks, gripper, logistics, ferry, hanoi, satellite, rovers, depots, miconic, sokoban, spanner,
    transport, market, snack, cleaner,
);

fn upto(rng: &mut dyn Rng, least: usize, most: usize) -> usize {
    rng.random_range(least..=most)
}

fn one<'a>(rng: &mut dyn Rng, from: &'a [String]) -> &'a str {
    &from[rng.random_range(0..from.len())]
}

fn chance(rng: &mut dyn Rng, rate: f64) -> bool {
    rng.random_range(0.0..1.0) < rate
}

fn shuffled(rng: &mut dyn Rng, mut names: Vec<String>) -> Vec<String> {
    for index in (1..names.len()).rev() {
        names.swap(index, rng.random_range(0..=index));
    }
    names
}

/// Draws the edges of a connected graph: a random tree and some more edges, in both directions.
fn roads(rng: &mut dyn Rng, places: &[String]) -> BTreeSet<(String, String)> {
    let mut roads = BTreeSet::new();
    let mut join = |a: &String, b: &String| {
        roads.insert((a.clone(), b.clone()));
        roads.insert((b.clone(), a.clone()));
    };
    for index in 1..places.len() {
        join(&places[index], &places[rng.random_range(0..index)]);
    }
    for _ in 0..places.len() / 2 {
        let (a, b) = (rng.random_range(0..places.len()), rng.random_range(0..places.len()));
        if a != b {
            join(&places[a], &places[b]);
        }
    }
    roads
}

fn blocks(i: &mut Instance, rng: &mut dyn Rng) {
    let number = upto(rng, 3, 6);
    let names = i.objects(number, "block");
    i.fact(&["hand-empty"]);
    let mut tops: Vec<String> = Vec::new();
    for block in shuffled(rng, names) {
        if tops.is_empty() || chance(rng, 0.4) {
            i.fact(&["on-table", &block]);
            tops.push(block);
        } else {
            let tower = rng.random_range(0..tops.len());
            i.fact(&["on", &block, &tops[tower]]);
            tops[tower] = block;
        }
    }
    tops.iter().for_each(|top| i.fact(&["clear", top]));
}

fn gripper(i: &mut Instance, rng: &mut dyn Rng) {
    let (rooms, balls) = (upto(rng, 2, 4), upto(rng, 2, 5));
    let (rooms, balls) = (i.objects(rooms, "room"), i.objects(balls, "ball"));
    let number = upto(rng, 1, 2);
    let (robots, grippers) = (i.objects(number, "robot"), i.objects(2, "gripper"));
    for robot in &robots {
        i.fact(&["at-robot", robot, one(rng, &rooms)]);
        grippers.iter().for_each(|gripper| i.fact(&["free", robot, gripper]));
    }
    balls.iter().for_each(|ball| i.fact(&["at", ball, one(rng, &rooms)]));
}

fn logistics(i: &mut Instance, rng: &mut dyn Rng) {
    let number = upto(rng, 2, 3);
    let (cities, airports) = (i.objects(number, "city"), i.objects(number, "airport"));
    let mut places = airports.clone();
    for (city, airport) in cities.iter().zip(&airports) {
        i.fact(&["in-city", airport, city]);
    }
    let number = upto(rng, cities.len(), 5);
    for (index, place) in i.objects(number, "location").into_iter().enumerate() {
        i.fact(&["in-city", &place, &cities[index % cities.len()]]);
        places.push(place);
    }
    for (truck, airport) in i.objects(cities.len(), "truck").iter().zip(&airports) {
        i.fact(&["at", truck, airport]);
    }
    let (planes, packages) = (upto(rng, 1, 2), upto(rng, 2, 4));
    for plane in i.objects(planes, "airplane") {
        i.fact(&["at", &plane, one(rng, &airports)]);
    }
    for package in i.objects(packages, "package") {
        i.fact(&["at", &package, one(rng, &places)]);
    }
}

fn ferry(i: &mut Instance, rng: &mut dyn Rng) {
    let (places, cars) = (upto(rng, 3, 5), upto(rng, 2, 5));
    let (places, cars) = (i.objects(places, "location"), i.objects(cars, "car"));
    for a in &places {
        places.iter().filter(|b| a != *b).for_each(|b| i.fact(&["other", a, b]));
    }
    i.fact(&["at-ferry", one(rng, &places)]);
    i.fact(&["empty-ferry"]);
    cars.iter().for_each(|car| i.fact(&["at", car, one(rng, &places)]));
}

fn hanoi(i: &mut Instance, rng: &mut dyn Rng) {
    let (discs, pegs) = (upto(rng, 3, 5), upto(rng, 3, 4));
    let (discs, pegs) = (i.objects(discs, "disc"), i.objects(pegs, "peg"));
    for (size, disc) in discs.iter().enumerate() {
        pegs.iter().for_each(|peg| i.fact(&["smaller", peg, disc]));
        discs[size + 1..].iter().for_each(|larger| i.fact(&["smaller", larger, disc]));
    }
    let mut tops = pegs.clone();
    for disc in discs.iter().rev() {
        let peg = rng.random_range(0..tops.len());
        i.fact(&["on", disc, &tops[peg]]);
        tops[peg].clone_from(disc);
    }
    tops.iter().for_each(|top| i.fact(&["clear", top]));
}

fn satellite(i: &mut Instance, rng: &mut dyn Rng) {
    let (satellites, directions) = (upto(rng, 1, 3), upto(rng, 3, 5));
    let satellites = i.objects(satellites, "satellite");
    let (directions, modes) = (i.objects(directions, "direction"), i.objects(3, "mode"));
    for satellite in &satellites {
        i.fact(&["pointing", satellite, one(rng, &directions)]);
        i.fact(&["power-available", satellite]);
    }
    let number = upto(rng, satellites.len(), satellites.len() + 2);
    for (index, instrument) in i.objects(number, "instrument").iter().enumerate() {
        i.fact(&["on-board", instrument, &satellites[index % satellites.len()]]);
        i.fact(&["calibration-target", instrument, one(rng, &directions)]);
        let first = rng.random_range(0..modes.len());
        i.fact(&["supports", instrument, &modes[first]]);
        if chance(rng, 0.5) {
            i.fact(&["supports", instrument, &modes[(first + 1) % modes.len()]]);
        }
    }
}

fn rovers(i: &mut Instance, rng: &mut dyn Rng) {
    let (points, rovers, goals) = (upto(rng, 4, 6), upto(rng, 1, 2), upto(rng, 1, 3));
    let (points, rovers) = (i.objects(points, "waypoint"), i.objects(rovers, "rover"));
    let (stores, cameras) =
        (i.objects(rovers.len(), "store"), i.objects(rovers.len() + 1, "camera"));
    let (modes, goals) = (i.objects(2, "mode"), i.objects(goals, "objective"));
    let lander = i.objects(1, "lander").remove(0);
    i.fact(&["at-lander", &lander, one(rng, &points)]);
    i.fact(&["channel-free", &lander]);
    let visible = roads(rng, &points);
    visible.iter().for_each(|(a, b)| i.fact(&["visible", a, b]));
    for (index, (rover, store)) in rovers.iter().zip(&stores).enumerate() {
        i.fact(&["at", rover, one(rng, &points)]);
        i.fact(&["available", rover]);
        i.fact(&["store-of", store, rover]);
        i.fact(&["empty", store]);
        for (a, b) in &visible {
            // Roads are the same both ways.
            if a < b && chance(rng, 0.8) {
                i.fact(&["can-traverse", rover, a, b]);
                i.fact(&["can-traverse", rover, b, a]);
            }
        }
        if index == 0 || chance(rng, 0.5) {
            i.fact(&["equipped-for-sampling", rover]);
        }
        if index == 0 || chance(rng, 0.5) {
            i.fact(&["equipped-for-imaging", rover]);
        }
    }
    for (index, camera) in cameras.iter().enumerate() {
        i.fact(&["on-board", camera, &rovers[index % rovers.len()]]);
        i.fact(&["supports", camera, one(rng, &modes)]);
        i.fact(&["calibration-target", camera, one(rng, &goals)]);
    }
    for point in &points {
        if chance(rng, 0.6) {
            i.fact(&["at-sample", point]);
        }
        for goal in &goals {
            if chance(rng, 0.5) {
                i.fact(&["visible-from", goal, point]);
            }
        }
    }
}

fn depots(i: &mut Instance, rng: &mut dyn Rng) {
    let (depots, distributors) = (upto(rng, 1, 2), upto(rng, 1, 2));
    let mut places = i.objects(depots, "depot");
    places.extend(i.objects(distributors, "distributor"));
    let number = places.len();
    let (pallets, hoists) = (i.objects(number, "pallet"), i.objects(number, "hoist"));
    let mut tops = Vec::new();
    for ((place, pallet), hoist) in places.iter().zip(&pallets).zip(&hoists) {
        i.fact(&["at", pallet, place]);
        i.fact(&["at", hoist, place]);
        i.fact(&["available", hoist]);
        tops.push(pallet.clone());
    }
    let (trucks, crates) = (upto(rng, 1, 2), upto(rng, 2, 5));
    for truck in i.objects(trucks, "truck") {
        i.fact(&["at", &truck, one(rng, &places)]);
    }
    for name in i.objects(crates, "crate") {
        let place = rng.random_range(0..number);
        i.fact(&["at", &name, &places[place]]);
        i.fact(&["on", &name, &tops[place]]);
        tops[place] = name;
    }
    tops.iter().for_each(|top| i.fact(&["clear", top]));
}

fn miconic(i: &mut Instance, rng: &mut dyn Rng) {
    let (floors, people) = (upto(rng, 3, 6), upto(rng, 2, 5));
    let (floors, people) = (i.objects(floors, "floor"), i.objects(people, "passenger"));
    for (index, low) in floors.iter().enumerate() {
        floors[index + 1..].iter().for_each(|high| i.fact(&["above", low, high]));
    }
    i.fact(&["lift-at", one(rng, &floors)]);
    for person in &people {
        let from = one(rng, &floors).to_owned();
        let others: Vec<String> = floors.iter().filter(|f| **f != from).cloned().collect();
        i.fact(&["origin", person, &from]);
        i.fact(&["destination", person, one(rng, &others)]);
    }
}

/// Adds the places of a grid and returns them with their columns and rows.
fn grid(i: &mut Instance, rng: &mut dyn Rng) -> Vec<(String, usize, usize)> {
    let (columns, rows) = (upto(rng, 3, 5), upto(rng, 3, 4));
    let places = i.objects(columns * rows, "place");
    let at = |(index, name): (usize, String)| (name, index % columns, index / columns);
    places.into_iter().enumerate().map(at).collect()
}

fn sokoban(i: &mut Instance, rng: &mut dyn Rng) {
    let places = grid(i, rng);
    for direction in ["left", "right", "up", "down"] {
        i.objects.push((direction.into(), "direction"));
    }
    for (a, ax, ay) in &places {
        for (b, bx, by) in &places {
            let direction = match (bx.wrapping_sub(*ax), by.wrapping_sub(*ay)) {
                (1, 0) => "right",
                (usize::MAX, 0) => "left",
                (0, 1) => "down",
                (0, usize::MAX) => "up",
                _ => continue,
            };
            i.fact(&["next-to", a, b, direction]);
        }
    }
    let number = upto(rng, 1, 3);
    let boxes = i.objects(number, "box");
    let order = shuffled(rng, places.into_iter().map(|(name, ..)| name).collect());
    boxes.iter().zip(&order).for_each(|(name, place)| i.fact(&["at", name, place]));
    order[boxes.len()..].iter().for_each(|place| i.fact(&["clear", place]));
    i.fact(&["keeper-at", one(rng, &order[boxes.len()..])]);
}

fn spanner(i: &mut Instance, rng: &mut dyn Rng) {
    let (places, spanners, nuts) = (upto(rng, 3, 6), upto(rng, 3, 5), upto(rng, 1, 3));
    let places = i.objects(places, "location");
    places.windows(2).for_each(|pair| i.fact(&["path", &pair[0], &pair[1]]));
    let worker = i.objects(1, "worker").remove(0);
    i.fact(&["at", &worker, &places[0]]);
    for spanner in i.objects(spanners, "spanner") {
        i.fact(&["at", &spanner, one(rng, &places)]);
        i.fact(&["usable", &spanner]);
    }
    for nut in i.objects(nuts, "nut") {
        i.fact(&["at", &nut, &places[places.len() - 1]]);
        i.fact(&["loose", &nut]);
    }
}

fn transport(i: &mut Instance, rng: &mut dyn Rng) {
    let (places, trucks, packages) = (upto(rng, 3, 6), upto(rng, 1, 3), upto(rng, 2, 4));
    let places = i.objects(places, "place");
    roads(rng, &places).iter().for_each(|(a, b)| i.fact(&["road", a, b]));
    let sizes = i.objects(4, "size");
    sizes.windows(2).for_each(|pair| i.fact(&["before", &pair[0], &pair[1]]));
    for truck in i.objects(trucks, "truck") {
        i.fact(&["at", &truck, one(rng, &places)]);
        i.fact(&["capacity", &truck, one(rng, &sizes[1..])]);
    }
    for package in i.objects(packages, "package") {
        i.fact(&["at", &package, one(rng, &places)]);
    }
}

fn market(i: &mut Instance, rng: &mut dyn Rng) {
    let (markets, depots, goods) = (upto(rng, 1, 3), upto(rng, 1, 2), upto(rng, 1, 3));
    let (markets, depots) = (i.objects(markets, "market"), i.objects(depots, "depot"));
    let places = [markets.clone(), depots].concat();
    roads(rng, &places).iter().for_each(|(a, b)| i.fact(&["connected", a, b]));
    let (goods, levels) = (i.objects(goods, "good"), i.objects(4, "level"));
    levels.windows(2).for_each(|pair| i.fact(&["next", &pair[1], &pair[0]]));
    let number = upto(rng, 1, 2);
    for truck in i.objects(number, "truck") {
        i.fact(&["at", &truck, one(rng, &places)]);
        goods.iter().for_each(|good| i.fact(&["loaded", good, &truck, &levels[0]]));
    }
    for good in &goods {
        i.fact(&["stored", good, &levels[0]]);
        markets.iter().for_each(|m| i.fact(&["on-sale", good, m, one(rng, &levels)]));
    }
}

fn snack(i: &mut Instance, rng: &mut dyn Rng) {
    let (children, trays, tables) = (upto(rng, 2, 4), upto(rng, 1, 2), upto(rng, 2, 3));
    let (children, tables) = (i.objects(children, "child"), i.objects(tables, "place"));
    for bread in i.objects(children.len(), "bread") {
        i.fact(&["in-kitchen", &bread]);
    }
    for sandwich in i.objects(children.len(), "sandwich") {
        i.fact(&["not-made", &sandwich]);
    }
    children.iter().for_each(|child| i.fact(&["waiting", child, one(rng, &tables)]));
    for tray in i.objects(trays, "tray") {
        i.fact(&["at", &tray, if chance(rng, 0.7) { "kitchen" } else { one(rng, &tables) }]);
    }
}

fn cleaner(i: &mut Instance, rng: &mut dyn Rng) {
    let places = grid(i, rng);
    for (a, ax, ay) in &places {
        for (b, bx, by) in &places {
            if ax.abs_diff(*bx) + ay.abs_diff(*by) == 1 {
                i.fact(&["link", a, b]);
            }
        }
    }
    let number = upto(rng, 2, 4);
    let order = shuffled(rng, places.into_iter().map(|(name, ..)| name).collect());
    for (robot, place) in i.objects(number, "robot").iter().zip(&order) {
        i.fact(&["at", robot, place]);
        i.fact(&["taken", place]);
    }
    order.iter().skip(1).step_by(4).for_each(|place| i.fact(&["bin", place]));
}

/// The facts that hold, as bits: a search makes thousands of states.
#[derive(Clone, Default, PartialEq, Eq, Hash)]
struct State(Vec<u64>);

impl State {
    const WORD: usize = u64::BITS as usize;

    fn contains(&self, fact: usize) -> bool {
        self.0.get(fact / Self::WORD).is_some_and(|word| word >> (fact % Self::WORD) & 1 == 1)
    }

    /// Makes room for so many facts. States of one world have room for the same.
    fn make_room(&mut self, facts: usize) {
        self.0.resize(facts.div_ceil(Self::WORD).max(self.0.len()), 0);
    }

    fn insert(&mut self, fact: usize) {
        self.0[fact / Self::WORD] |= 1 << (fact % Self::WORD);
    }

    fn remove(&mut self, fact: usize) {
        self.0[fact / Self::WORD] &= !(1 << (fact % Self::WORD));
    }

    /// Returns the facts in rising order.
    fn facts(&self) -> impl Iterator<Item = usize> {
        (0..self.0.len() * Self::WORD).filter(|fact| self.contains(*fact))
    }
}

/// An action over objects. Facts are numbers.
struct Call {
    action: usize,
    text: String,
    before: Vec<(bool, usize)>,
    add: Vec<usize>,
    delete: Vec<usize>,
}

impl Call {
    /// Returns the state after the action, or `None` if it is not allowed or changes nothing.
    fn apply(&self, state: &State) -> Option<State> {
        if self.before.iter().any(|(holds, fact)| state.contains(*fact) != *holds) {
            return None;
        }
        let mut after = state.clone();
        self.delete.iter().for_each(|fact| after.remove(*fact));
        self.add.iter().for_each(|fact| after.insert(*fact));
        (after != *state).then_some(after)
    }
}

/// A problem with all its actions.
struct World {
    facts: Vec<String>,
    numbers: HashMap<Fact, usize>,
    calls: Vec<Call>,
    start: State,
}

impl World {
    fn new(domain: &Domain, problem: &Problem) -> Self {
        let mut world = Self {
            facts: Vec::new(),
            numbers: HashMap::new(),
            calls: Vec::new(),
            start: State::default(),
        };
        for fact in &problem.init {
            let number = world.number(fact.clone());
            world.start.make_room(number + 1);
            world.start.insert(number);
        }
        let objects: Vec<&Typed> = domain.constants.iter().chain(&problem.objects).collect();
        let touched: BTreeSet<&str> = domain
            .actions
            .iter()
            .flat_map(|a| &a.effects)
            .map(|l| l.atom.predicate.as_str())
            .collect();
        for (index, action) in domain.actions.iter().enumerate() {
            world.bind((domain, &touched), (index, action), &objects, &mut Vec::new());
        }
        world.start.make_room(world.facts.len());
        world
    }

    fn number(&mut self, fact: Fact) -> usize {
        let next = self.facts.len();
        let number = *self.numbers.entry(fact.clone()).or_insert(next);
        if number == next {
            self.facts.push(fact.to_string());
        }
        number
    }

    fn bind<'a>(
        &mut self,
        (domain, touched): (&Domain, &BTreeSet<&str>),
        (index, action): (usize, &Action),
        objects: &[&'a Typed],
        bound: &mut Vec<&'a str>,
    ) {
        let ground = |literal: &Literal| Fact {
            predicate: literal.atom.predicate.clone(),
            arguments: literal
                .atom
                .arguments
                .iter()
                .map(|term| match term {
                    Term::Parameter(p) => bound[*p].to_owned(),
                    Term::Constant(name) => name.clone(),
                })
                .collect(),
        };
        // A relation that never changes and does not hold now will never hold.
        let complete = |literal: &&Literal| {
            let mut terms = literal.atom.arguments.iter();
            terms.all(|term| !matches!(term, Term::Parameter(p) if *p >= bound.len()))
        };
        let fixed = |literal: &&Literal| !touched.contains(literal.atom.predicate.as_str());
        let impossible = |literal: &Literal| {
            let number = self.numbers.get(&ground(literal));
            number.is_some_and(|n| self.start.contains(*n)) != literal.positive
        };
        if action.preconditions.iter().filter(complete).filter(fixed).any(impossible) {
            return;
        }
        if let Some(parameter) = action.parameters.get(bound.len()) {
            for object in objects {
                if domain.types.fits(&object.types, &parameter.types) {
                    bound.push(&object.name);
                    self.bind((domain, touched), (index, action), objects, bound);
                    bound.pop();
                }
            }
            return;
        }
        let before: Vec<(bool, Fact)> =
            action.preconditions.iter().map(|l| (l.positive, ground(l))).collect();
        let (add, delete): (Vec<_>, Vec<_>) = action.effects.iter().partition(|l| l.positive);
        let (add, delete): (Vec<Fact>, Vec<Fact>) =
            (add.into_iter().map(ground).collect(), delete.into_iter().map(ground).collect());
        let mut text = format!("({}", action.name);
        bound.iter().for_each(|object| text.extend([" ", object]));
        let call = Call {
            action: index,
            text: text + ")",
            before: before.into_iter().map(|(holds, fact)| (holds, self.number(fact))).collect(),
            add: add.into_iter().map(|fact| self.number(fact)).collect(),
            delete: delete.into_iter().map(|fact| self.number(fact)).collect(),
        };
        self.calls.push(call);
    }

    /// Returns a random next action: first the schema, then the objects.
    fn random(&self, state: &State, rng: &mut dyn Rng) -> Option<(usize, State)> {
        let mut by_action: BTreeMap<usize, Vec<(usize, State)>> = BTreeMap::new();
        for (index, call) in self.calls.iter().enumerate() {
            if let Some(after) = call.apply(state) {
                by_action.entry(call.action).or_default().push((index, after));
            }
        }
        let mut choices = by_action.into_values().collect::<Vec<_>>();
        if choices.is_empty() {
            return None;
        }
        let mut calls = choices.swap_remove(rng.random_range(0..choices.len()));
        Some(calls.swap_remove(rng.random_range(0..calls.len())))
    }

    /// Plans by greedy best-first search on the number of open goals.
    fn plan(&self, state: &State, goal: &[usize]) -> Option<Vec<usize>> {
        let open = |state: &State| goal.iter().filter(|fact| !state.contains(**fact)).count();
        let mut nodes: Vec<(State, Option<(usize, usize)>)> = vec![(state.clone(), None)];
        let mut seen: HashSet<State> = HashSet::from([state.clone()]);
        let mut queue = BinaryHeap::from([Reverse((open(state), 0))]);
        while let Some(Reverse((left, index))) = queue.pop() {
            if left == 0 {
                let mut plan = Vec::new();
                let mut at = index;
                while let Some((parent, call)) = nodes[at].1 {
                    plan.push(call);
                    at = parent;
                }
                plan.reverse();
                return Some(plan);
            }
            if nodes.len() > 2_000 {
                return None;
            }
            let here = nodes[index].0.clone();
            for (number, call) in self.calls.iter().enumerate() {
                if let Some(after) = call.apply(&here)
                    && seen.insert(after.clone())
                {
                    queue.push(Reverse((open(&after), nodes.len())));
                    nodes.push((after, Some((index, number))));
                }
            }
        }
        None
    }

    /// Draws a goal: up to three facts that a random walk made true.
    fn goal(&self, state: &State, rng: &mut dyn Rng) -> Vec<usize> {
        let mut end = state.clone();
        for _ in 0..25 {
            let Some((_, after)) = self.random(&end, rng) else { break };
            end = after;
        }
        let mut new: Vec<usize> = end.facts().filter(|fact| !state.contains(*fact)).collect();
        while new.len() > 3 {
            new.swap_remove(rng.random_range(0..new.len()));
        }
        new
    }

    /// Walks towards random goals. One action in five is random.
    fn walk(&self, steps: usize, rng: &mut dyn Rng) -> Vec<(usize, State)> {
        let mut state = self.start.clone();
        let mut walked = Vec::new();
        let mut plan: Vec<usize> = Vec::new();
        let mut goal = Vec::new();
        while walked.len() < steps {
            let random = chance(rng, 0.2);
            let idle = random || plan.is_empty();
            if idle && goal.iter().all(|fact| state.contains(*fact)) {
                goal = self.goal(&state, rng);
            }
            let planned =
                plan.first().and_then(|call| Some((*call, self.calls[*call].apply(&state)?)));
            let next = match planned.filter(|_| !random) {
                Some(next) => {
                    plan.remove(0);
                    Some(next)
                }
                None => self.random(&state, rng),
            };
            let Some((call, after)) = next else { break };
            state.clone_from(&after);
            walked.push((call, after));
            if random || plan.is_empty() {
                plan = self.plan(&state, &goal).unwrap_or_default();
            }
        }
        walked
    }

    fn shown(&self, state: &State) -> String {
        state.facts().map(|fact| format!(" {}", self.facts[fact])).collect()
    }
}

/// Draws trajectories of 5 to 30 steps, every second one in the notation of SAM's library.
pub fn traces(case: &Case, domain: &Domain, count: u64, seed: Seed) -> Vec<String> {
    (0..count)
        .map(|number| {
            let mut rng = seed.derive_index("trajectory", number).rng();
            let mut instance = Instance::default();
            (case.draw)(&mut instance, &mut rng);
            let mut text = format!("(define (problem p) (:domain {}) (:objects", case.name);
            for (name, kind) in &instance.objects {
                let _ = write!(text, " {name} - {kind}");
            }
            let _ = write!(text, ") (:init {}) (:goal (and)))", instance.init.join(" "));
            let problem =
                Problem::parse(text.as_bytes(), case.name, domain).expect("a sound problem");
            assert_eq!(problem.init.len(), instance.init.len());
            let world = World::new(domain, &problem);
            let steps = upto(&mut rng, 5, 30);
            written(&world, &instance, &world.walk(steps, &mut rng), number % 2 == 1)
        })
        .collect()
}

fn written(world: &World, instance: &Instance, walk: &[(usize, State)], typed: bool) -> String {
    let (first, action) = if typed { (":init", "operator:") } else { (":state", ":action") };
    let mut text = if typed { "((:objects" } else { "(:trajectory" }.to_owned();
    if typed {
        for (name, kind) in &instance.objects {
            let _ = write!(text, " {name} - {kind}");
        }
        text += ")";
    }
    let _ = write!(text, "\n({first}{})", world.shown(&world.start));
    for (call, state) in walk {
        let call = &world.calls[*call].text;
        let _ = write!(text, "\n({action} {call})\n(:state{})", world.shown(state));
    }
    text + ")\n"
}

/// Reads the domain of a case with its true actions.
pub fn truth(case: &Case) -> Domain {
    Domain::parse(case.text.as_bytes(), case.name, Bodies::Read).expect("a sound domain")
}

/// Reads the trajectories of a case.
pub fn read(texts: &[String], domain: &Domain) -> Vec<Trajectory> {
    let parse = |text: &String| Trajectory::parse(text.as_bytes(), "trace", domain).expect("sound");
    texts.iter().flat_map(parse).collect()
}

/// Names of the measures of [`score`].
pub const MEASURES: [&str; 8] =
    ["pre P", "pre R", "add P", "add R", "del P", "del R", "all P", "all R"];

/// Precision and recall of preconditions, add effects, delete effects and all literals: for each action, then averaged
/// over the actions, as AMLGym does. An action that was not learned has no literals.
pub fn score(truth: &Domain, learned: &Domain) -> [f64; 8] {
    let mut sums = [0.0; 8];
    for action in &truth.actions {
        let found = learned.action(&action.name).map(|index| &learned.actions[index]);
        let effects = |action: &Action, positive: bool| -> BTreeSet<Literal> {
            action.effects.iter().filter(|l| l.positive == positive).cloned().collect()
        };
        let parts = |action: &Action| -> [BTreeSet<Literal>; 3] {
            [
                action.preconditions.iter().cloned().collect(),
                effects(action, true),
                effects(action, false),
            ]
        };
        let (wanted, found) = (parts(action), found.map(parts).unwrap_or_default());
        let (mut right, mut all_found, mut all_wanted) = (0, 0, 0);
        let share = |right: usize, of: usize| if of == 0 { 1.0 } else { right as f64 / of as f64 };
        for (part, (wanted, found)) in wanted.iter().zip(&found).enumerate() {
            let both = wanted.intersection(found).count();
            sums[2 * part] += share(both, found.len());
            sums[2 * part + 1] += share(both, wanted.len());
            right += both;
            all_found += found.len();
            all_wanted += wanted.len();
        }
        sums[6] += share(right, all_found);
        sums[7] += share(right, all_wanted);
    }
    sums.map(|sum| sum / truth.actions.len() as f64)
}
