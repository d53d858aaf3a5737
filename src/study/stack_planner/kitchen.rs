//! Kitchens: what there is, what each action needs and does, and what the planner is told about it.

use crate::plan::goal_sets::StripsWorld;
use crate::plan::strips::{Fact, Fluent, GroundOperator, Grounded, Number};
use crate::sim::SimDuration;
use crate::task::TaskError;

/// Time for which the motor is locked after an action has begun, in milliseconds.
const LOCK_MS: u64 = 100;

/// Least and greatest number of actions of the kettle's kitchen.
const KETTLE: [usize; 2] = [2, 5];
/// Least and greatest number of actions of a chain.
const CHAIN: [usize; 2] = [2, 12];

/// A thing with the places where it is found and the goals that it serves.
pub(super) struct Thing {
    pub name: &'static str,
    pub places: &'static [&'static str],
    /// Whether it serves the goal. The others serve another one.
    pub useful: bool,
}

/// The things of every kitchen. The last one is of no use.
pub(super) const THINGS: [Thing; 3] = [
    Thing { name: "KETTLE", places: &["KITCHEN", "STAFF_LOUNGE", "HOME_DEPOT"], useful: true },
    Thing { name: "TAP", places: &["KITCHEN", "STAFF_LOUNGE"], useful: true },
    Thing { name: "DRILL", places: &["GARAGE", "HOME_DEPOT"], useful: false },
];

/// The goal of the thing that is of no use.
pub(super) const OTHER_GOAL: &str = "HOLE_MADE";

/// The place that the planner is told.
pub(super) const PLACE: &str = "KITCHEN";

/// An action. Numbers are positions of fluents.
pub(super) struct Action {
    pub name: String,
    /// Position of its thing in [`THINGS`].
    pub thing: usize,
    /// What must hold in the world. Otherwise the action does nothing.
    pub needs: Vec<usize>,
    pub adds: usize,
    pub deletes: Vec<usize>,
    /// The preconditions that the planner recalls, with their weights. Their order in time is in the weights.
    pub recalled: Vec<(usize, f32)>,
    /// What must hold before the sensor calls the action ready.
    pub held_until: Vec<usize>,
}

/// A kitchen: fluents, actions, and the state at the start. The last fluent is the goal.
pub struct Kitchen {
    pub(super) fluents: Vec<String>,
    pub(super) actions: Vec<Action>,
    pub(super) start: Vec<usize>,
    steps: usize,
}

fn within(name: &'static str, steps: usize, [least, most]: [usize; 2]) -> Result<(), TaskError> {
    if (least..=most).contains(&steps) {
        return Ok(());
    }
    let range = (steps as f64, least as f64, most as f64);
    Err(TaskError::Range { name, value: range.0, least: range.1, most: range.2 })
}

impl Kitchen {
    /// Makes the kitchen of Blouw, Eliasmith and Tripp (2016): a kettle is to be boiled. `actions`, from 2 to 5, are still
    /// to be done; the others have been done.
    ///
    /// The model cannot find the order of the last three actions: boiling needs the kettle plugged in, and filling needs it
    /// unplugged. The order is in the weights of the preconditions and in what holds the sensor back.
    ///
    /// # Errors
    /// [`TaskError::Range`] for another number of actions.
    pub fn kettle(actions: usize) -> Result<Self, TaskError> {
        within("actions", actions, KETTLE)?;
        let [plugged, unplugged, under_tap, full, boiled] = [0, 1, 2, 3, 4];
        let fluents = [
            "KETTLE_PLUGGED_IN",
            "KETTLE_UNPLUGGED",
            "KETTLE_UNDER_TAP",
            "WATER_IN_KETTLE",
            "WATER_BOILED",
        ];
        type Fluents<'a> = &'a [usize];
        // What is deleted, what must hold in the world, and what the sensor waits for.
        let action = |name: &str, thing, adds, [deletes, needs, held_until]: [Fluents<'_>; 3]| {
            let (deletes, needs, held_until) = (deletes.into(), needs.into(), held_until.into());
            let recalled = vec![];
            Action { name: name.into(), thing, needs, adds, deletes, recalled, held_until }
        };
        let mut all = vec![
            action("UNPLUG_KETTLE", 0, unplugged, [&[plugged], &[], &[plugged]]),
            action("PUT_KETTLE_UNDER_TAP", 0, under_tap, [&[], &[unplugged], &[unplugged]]),
            action("FILL_KETTLE_FROM_TAP", 1, full, [&[], &[under_tap], &[under_tap]]),
            action("PLUG_IN_KETTLE", 0, plugged, [&[unplugged], &[], &[full]]),
            action("BOIL_KETTLE", 0, boiled, [&[], &[plugged, full], &[plugged, full]]),
        ];
        all[1].recalled = vec![(unplugged, 1.0)];
        all[2].recalled = vec![(under_tap, 1.0)];
        all[4].recalled = vec![(full, 0.4), (plugged, 0.6)];
        let start = match actions {
            5 => vec![plugged],
            4 => vec![unplugged],
            3 => vec![unplugged, under_tap],
            _ => vec![unplugged, under_tap, full],
        };
        let fluents = fluents.map(String::from).to_vec();
        Ok(Self { fluents, actions: all, start, steps: actions })
    }

    /// Makes a kitchen in which `actions`, from 2 to 12, follow each other: each needs what the one before it does.
    ///
    /// # Errors
    /// [`TaskError::Range`] for another number of actions.
    pub fn chain(actions: usize) -> Result<Self, TaskError> {
        within("actions", actions, CHAIN)?;
        let fluents = (0..=actions).map(|step| format!("STEP_{step}_DONE")).collect();
        let action = |step: usize| Action {
            name: format!("DO_STEP_{step}"),
            thing: step % 2,
            needs: vec![step - 1],
            adds: step,
            deletes: vec![],
            recalled: if step > 1 { vec![(step - 1, 1.0)] } else { vec![] },
            held_until: vec![step - 1],
        };
        let all = (1..=actions).map(action).collect();
        Ok(Self { fluents, actions: all, start: vec![0], steps: actions })
    }

    /// Returns the number of actions of the shortest plan.
    pub fn steps(&self) -> usize {
        self.steps
    }

    /// Returns the names of the actions.
    pub fn names(&self) -> Vec<&str> {
        self.actions.iter().map(|action| action.name.as_str()).collect()
    }

    /// Returns the name of the goal.
    pub(super) fn goal(&self) -> &str {
        self.fluents.last().map_or("", String::as_str)
    }

    /// Returns the world, which begins an action as the motor of the original does.
    pub(super) fn world(&self) -> StripsWorld {
        let fluents = self.fluents.iter();
        let operators = self.actions.iter().enumerate().map(|(at, action)| GroundOperator {
            action: at,
            name: format!("({})", action.name.to_lowercase()),
            preconditions: action.needs.clone(),
            adds: vec![action.adds],
            deletes: action.deletes.clone(),
            cost: Number::default(),
        });
        let problem = Grounded {
            fluents: fluents
                .map(|name| Fluent {
                    fact: Fact { predicate: name.to_lowercase(), arguments: vec![] },
                    holds: true,
                })
                .collect(),
            operators: operators.collect(),
            start: self.start.clone(),
            goal: self.fluents.len().checked_sub(1).into_iter().collect(),
            warnings: Vec::new(),
        };
        StripsWorld::new(&problem, SimDuration::from_millis(LOCK_MS))
    }
}
