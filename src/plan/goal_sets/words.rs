//! What the modules of the planner are called for people, and what each does.
//!
//! Both searches use many of the names. A set is a goal set in the search backward, and a state in the search forward.

/// Name of a module, its name for people, and what it does.
const WORDS: &[[&str; 3]] = &[
    // What the planner is told.
    ["ready", "plan wanted", "Active while a plan is asked for."],
    ["busy", "robot at work", "Active while the robot carries out the action that it was shown."],
    ["holds", "facts that hold", "The facts that hold now."],
    ["goal", "goal", "The facts that are to hold in the end."],
    ["unasked", "no plan wanted", "Stops the planner while no plan is asked for."],
    // Its phases.
    [
        "phases",
        "phase",
        "The step of its work that the planner is at. One phase is active at a time, and two while one gives way to the next.",
    ],
    ["signals", "conditions", "What the planner finds at each step; the next phase depends on it."],
    ["recent", "time in the phase", "How long each phase has lasted, up to a tenth of a second."],
    ["elapsed", "phase has had its time", "The phases that have lasted for their time."],
    ["lasts", "phase without the robot", "The phase, unless it waits for the robot."],
    ["slow", "time in the phase, slow", "How long each phase has lasted, up to a second."],
    ["long", "phase lasts too long", "The phases that have lasted so long that they are given up."],
    ["before", "time of the conditions", "How long each condition has held."],
    ["lasting", "lasting conditions", "The conditions that have held long enough to count."],
    [
        "enter",
        "change of phase",
        "The change from one phase to the next, at the moment when it happens.",
    ],
    [
        "restless",
        "last search failed",
        "Active after a search that found no plan, so that the next one takes another way.",
    ],
    [
        "stale",
        "costs out of date",
        "Active when the planned state has changed since the costs were found.",
    ],
    [
        "returned",
        "back in an earlier state",
        "Active when the search has come back to an earlier state.",
    ],
    [
        "anew",
        "new relaxed plan",
        "Active when the search is back in an earlier state while all actions are tried: a new relaxed plan is made.",
    ],
    [
        "wide",
        "all actions tried",
        "Active while actions outside the relaxed plan are tried as well.",
    ],
    // Facts and goals.
    [
        "goals",
        "goal set",
        "The facts that must hold before the next action of the plan, worked back from the goal.",
    ],
    [
        "state",
        "planned state",
        "The facts that will hold after the actions that are planned so far.",
    ],
    [
        "open",
        "facts that do not hold",
        "The facts of the goal set, or of the planned state, that do not hold now.",
    ],
    ["absent", "facts not in the state", "The facts that are not in the planned state."],
    ["unmet", "goals not met", "The goals that are not in the planned state."],
    ["wanted", "goals pursued now", "The goals that are not met and wait for no other goal."],
    [
        "first_goals",
        "goals that come first",
        "The goals that are not met and that others wait for.",
    ],
    ["agenda", "goals that wait", "The goals that wait for others, because these would undo them."],
    [
        "not_goals",
        "facts that are no goals",
        "The facts that are not in the goal set. An action that needs one adds a goal.",
    ],
    // Costs.
    [
        "reached",
        "facts with a cost",
        "The facts whose cost is known, as if no action undid anything.",
    ],
    ["pending", "facts without a cost", "The facts whose cost is not known yet."],
    ["enabled", "actions with a cost", "The actions whose preconditions all have a cost."],
    ["unreached", "goals without a cost", "The goals whose cost is not known yet."],
    [
        "reachable",
        "facts within reach",
        "The facts that can be reached, as if no action undid anything.",
    ],
    [
        "out_of_reach",
        "facts out of reach",
        "The facts that cannot be reached so far, even if no action undid anything.",
    ],
    ["possible", "actions within reach", "The actions whose preconditions can all be reached."],
    ["beyond", "goals out of reach", "The goals that cannot be reached so far."],
    ["newly_reachable", "facts just reached", "The facts that have just come within reach."],
    ["tick", "next cost", "The next level of cost that the clock counts."],
    ["clock", "cost clock", "Counts levels of cost while the costs of the facts are found."],
    ["ticks", "levels counted", "How many levels of cost the clock has counted."],
    ["count", "cost counters", "Add a level to the cost of each fact that has none yet."],
    [
        "costs",
        "cost of each fact",
        "How many steps each fact is away, from what holds now or from the planned state.",
    ],
    ["cost", "cost, summed", "The cost of each fact as one number."],
    [
        "early",
        "actions that wait",
        "The actions that wait until as much is counted as their preconditions cost.",
    ],
    // The relaxed plan of the search forward.
    ["supports", "first ways to a fact", "For each fact, the actions that reach it first."],
    [
        "later",
        "further ways to a fact",
        "The actions that reach a fact at the same time as another one, which counts.",
    ],
    ["support_rows", "first ways, summed", "The first ways to a fact, summed in rows."],
    [
        "needed",
        "facts needed",
        "The facts that the relaxed plan needs and that are not in the state.",
    ],
    ["newly_needed", "facts just needed", "The facts that have just become needed."],
    ["via", "ways used", "The first ways to the facts that are needed."],
    [
        "used",
        "relaxed plan",
        "The actions of the relaxed plan: of a plan that would lead to the goal if no action undid anything.",
    ],
    ["claims", "demand for each fact", "How many actions of the relaxed plan need each fact."],
    ["far", "actions far from possible", "The actions that lack two facts or more."],
    [
        "near",
        "actions nearly possible",
        "The actions of the relaxed plan that lack one fact at most.",
    ],
    [
        "last",
        "last facts needed",
        "The facts that alone are lacking for an action of the relaxed plan.",
    ],
    // The choice.
    ["irrelevant", "irrelevant actions", "The actions that achieve nothing of the goal set."],
    [
        "veto",
        "actions against a goal",
        "The actions that would undo a fact of the goal set, or exclude it.",
    ],
    [
        "pairs",
        "pairs of goals",
        "Two facts of the goal set that exclude a condition of some action.",
    ],
    [
        "lacks",
        "impossible actions",
        "The actions with a precondition that the planned state lacks.",
    ],
    ["strays", "other actions", "The actions outside the relaxed plan, when all are tried."],
    ["eligible", "candidate actions", "The actions that may be chosen."],
    ["barred", "excluded actions", "The actions that may not be chosen."],
    [
        "hindrance",
        "facts in the way",
        "The facts that an action for an unmet goal would undo, or exclude.",
    ],
    ["blamed", "goals in the way", "The facts in the way that are goals themselves."],
    [
        "helps",
        "helpful actions",
        "The actions that achieve an unmet goal, or a goal that stands in the way of one.",
    ],
    [
        "shares",
        "actions that serve twice",
        "The actions with a precondition that serves another unmet goal as well.",
    ],
    ["gains", "costs of the goals", "The costs of the facts of the goal set, level by level."],
    [
        "gain",
        "costs of the goals, summed",
        "The cost that would be saved with each fact of the goal set.",
    ],
    [
        "utilities",
        "utility",
        "How well each action suits the present goal set or planned state. The best one wins the race.",
    ],
    ["urgency", "urgency", "Makes the race easier to win from step to step."],
    ["impatience", "impatience", "Makes the race easier to win the longer it lasts."],
    ["chance", "chance", "Noise that decides, after a search in vain, which actions are favoured."],
    [
        "stir",
        "actions favoured by chance",
        "The actions that are favoured by chance, after a search in vain.",
    ],
    ["race", "race", "The actions compete: the first to reach a bound wins."],
    ["rest", "race at rest", "Keeps the race silent outside its phase."],
    ["winner", "winner", "The action that has won the race."],
    ["rivals", "number of winners", "The sum of all winners, which holds the other actions down."],
    ["own", "winner itself", "Keeps the winner from being held down by itself."],
    ["winner_rows", "winners, summed", "The winners, summed in rows."],
    ["give_way", "second winners", "Of several winners, those that give way to the first."],
    ["forbid", "winner to exclude", "The winner, when it leads back to where the search has been."],
    [
        "tabu",
        "actions that lead back",
        "The actions that are excluded because they lead back to where the search has been.",
    ],
    // Memory.
    [
        "slot",
        "place in memory",
        "The place in memory of the present goal set or state: one for each step of the plan.",
    ],
    ["next", "next place in memory", "The place in memory to move to."],
    ["free", "free place in memory", "The next place in memory that is free."],
    ["count_slot", "count the places", "Moves on to the next free place."],
    ["take_slot", "take a free place", "Chooses the free place as the next one."],
    ["shift_slot", "move to the next place", "Makes the next place the present one."],
    ["slot_before", "place before", "The place in memory from which the present one was reached."],
    [
        "child",
        "new set",
        "The goal set before the winner in the search backward, the state after it in the search forward, as it is written to memory.",
    ],
    ["write", "write to memory", "The place in memory that is written to."],
    [
        "synapses",
        "memory of the search",
        "Keeps the goal set or state of each step in its synapses, and the action that led there.",
    ],
    ["asked", "place asked for", "The place in memory whose action is asked for."],
    [
        "ask_before",
        "ask for the step before",
        "The present place, when the one before it is asked for.",
    ],
    ["ask_action", "ask for the action", "The next place, when its action is asked for."],
    [
        "shows",
        "time to show an action",
        "Active in the phases in which the action of the next place is asked for.",
    ],
    ["forgets", "forget everything", "Clears the memory when the search begins."],
    [
        "compared",
        "compare with memory",
        "What is compared with all goal sets or states that were visited.",
    ],
    [
        "recalled",
        "recalled from memory",
        "The goal set or state, the action and the place before, as they are recalled.",
    ],
    [
        "missing",
        "difference from memory",
        "How much each place in memory differs from the new set.",
    ],
    ["kin", "steps from here", "The places in memory that were reached from the present one."],
    ["marks", "places in use", "The places in memory that are written."],
    ["same", "visited before", "The places in memory to which the winner would lead back."],
    ["shown", "action of the step", "The action that led to the place in memory."],
    ["notes", "time to note", "Active when it is noted which action was tried."],
    ["note", "gate of the notes", "Lets it be noted which action was tried."],
    [
        "tried_synapses",
        "memory of tried actions",
        "Keeps in its synapses which actions were tried at each step.",
    ],
    ["tried", "actions tried before", "The actions that were tried at the present step."],
    ["leave_slot", "give the place up", "The present place, when it turns out to be a dead end."],
    ["dead", "dead ends", "The places in memory from which no action leads on."],
    [
        "left",
        "places left",
        "The places in memory in use that are no dead ends, but for the present one.",
    ],
    ["gone", "places not left", "The places in memory from which the planner does not go on."],
    [
        "far_sets",
        "sets far from the start",
        "Up to three facts of the goal set before an action that hold together only after some actions.",
    ],
    ["height", "distance", "How far the goal set before an action is from what holds at first."],
    ["going_back", "compare distances", "While it goes back, the planner compares distances."],
    [
        "rows_compared",
        "sets or distances",
        "What is compared with memory: sets, and distances while the planner goes back.",
    ],
    [
        "within_height",
        "places no farther",
        "For each distance, the places left whose set is no farther.",
    ],
    ["some_within_height", "distances met", "The distances that some place left does not exceed."],
    [
        "above_height",
        "places farther than others",
        "For each distance that some place left does not exceed, the places that do.",
    ],
    ["low", "nearest places", "The places left that are nearest to what holds at first."],
    ["found", "nearest place found", "The nearest places have had time to be found."],
    ["seeks", "seek the nearest place", "Holds the phase until the nearest places are found."],
    ["left_rows", "places left, summed", "The places left, summed in rows."],
    [
        "retreat",
        "place to go back to",
        "The latest place that is no dead end, or of the nearest ones.",
    ],
    ["path", "steps of the plan", "The places in memory that lead to the goal."],
    ["mark_path", "mark a step", "The place that is marked as a step of the plan."],
    ["off_path", "steps aside", "The places in memory that are not on the way to the goal."],
    [
        "child_of_slot",
        "step after this one",
        "The step of the plan that comes after the present one.",
    ],
    [
        "follow",
        "go to the next step",
        "The next step of the plan, when the planner moves on to it.",
    ],
    [
        "begin_set",
        "facts of the beginning",
        "The facts that are taken over when the search begins.",
    ],
    [
        "begin_reset",
        "facts not of the beginning",
        "The facts that are dropped when the search begins.",
    ],
    [
        "commit_set",
        "facts of the next step",
        "The facts that are taken over with the chosen action.",
    ],
    [
        "commit_reset",
        "facts not of the next step",
        "The facts that are dropped with the chosen action.",
    ],
    ["recall_set", "facts from memory", "The facts that are taken over from memory."],
    [
        "recall_reset",
        "facts not in memory",
        "The facts that are dropped when a step is loaded from memory.",
    ],
    // Acting.
    ["lacking", "actions not ready", "The actions with a precondition that does not hold now."],
    ["done", "actions already done", "The actions whose effects all hold now."],
    ["acting", "time to act", "Active while the plan is carried out."],
    ["motor", "action to do", "The action that the robot carries out."],
    // Both searches together.
    ["actions", "action to do", "The action of the search that has found a plan."],
    ["backward", "search backward", "Searches from the goal, through goal sets."],
    [
        "forward",
        "search forward",
        "Searches from what holds, through states, led by relaxed plans.",
    ],
    ["asked_backward", "search backward wanted", "Active while the search backward is to go on."],
    ["asked_forward", "search forward wanted", "Active while the search forward is to go on."],
    [
        "shown_backward",
        "action from the search backward",
        "The action that the search backward shows.",
    ],
    [
        "shown_forward",
        "action from the search forward",
        "The action that the search forward shows.",
    ],
    [
        "backward_phases",
        "phase of the search backward",
        "The phase that the search backward is in.",
    ],
    ["forward_phases", "phase of the search forward", "The phase that the search forward is in."],
    [
        "backward_acts",
        "search backward acts",
        "Active while the plan of the search backward is carried out.",
    ],
    [
        "forward_acts",
        "search forward acts",
        "Active while the plan of the search forward is carried out.",
    ],
];

/// Returns what the module of a name is called for people, and a sentence on what it does; `None` if nobody has said so.
pub(super) fn of(name: &str) -> Option<[String; 2]> {
    if let Some([_, words, meaning]) = WORDS.iter().find(|[own, ..]| *own == name) {
        return Some([(*words).into(), (*meaning).into()]);
    }
    let words = |name| of(name).map(|[words, _]| words);
    if let Some((from, to)) = name.split_once("_to_") {
        let (from, to) = (words(from)?, words(to)?);
        return Some([format!("{from} → {to}"), format!("The weights from “{from}” to “{to}”.")]);
    }
    if let Some(of) = name.strip_prefix("bias_of_").and_then(words) {
        return Some([format!("bias of {of}"), format!("A constant input of “{of}”.")]);
    }
    if let Some(of) = name.strip_prefix("any_").and_then(words) {
        return Some([format!("any: {of}"), format!("Whether anything of “{of}” is active.")]);
    }
    let of = name.strip_suffix("_before").and_then(words)?;
    Some([format!("{of}, a moment ago"), format!("“{of}” as it was a moment ago.")])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_name_has_one_line_and_no_two_have_the_same_words() {
        for (i, [name, words, meaning]) in WORDS.iter().enumerate() {
            assert!(words.len() <= 32 && !words.contains('_'), "{name}: {words}");
            assert!(meaning.ends_with('.') && meaning.len() <= 130, "{name}: {meaning}");
            let twin = WORDS[..i].iter().find(|[other, own, _]| own == words || other == name);
            // One is a module of a search, the other one of both together.
            let allowed = matches!(twin, Some(["motor", ..]) if *name == "actions");
            assert!(twin.is_none() || allowed, "{name}: {twin:?}");
        }
        let [words, meaning] = of("hindrance_to_any_retreat").expect("words of a link");
        assert_eq!(words, "facts in the way → any: place to go back to");
        assert_eq!(meaning, "The weights from “facts in the way” to “any: place to go back to”.");
        assert_eq!(of("hindrance_to_nothing"), None);
    }
}
