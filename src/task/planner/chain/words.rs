//! What the modules of the planner graph are called for people, and what each does.

use crate::sim::Scope;

/// Path of a module, its name for people, and what it does.
const WORDS: &[[&str; 3]] = &[
    [
        "",
        "planner",
        "Asks, one state after the other, which action brings it about and what that needs.",
    ],
    ["present", "states that hold", "The states that hold now."],
    ["goal", "goal", "The goal, as the nearest state that the planner knows."],
    [
        "executive",
        "executive",
        "Takes the decisions: which state is examined next, and when to act.",
    ],
    ["next", "next state", "The state that is loaded into the goal buffer next."],
    [
        "goal_buffer",
        "goal buffer",
        "The state that the planner examines now. While the buffer takes up a new state it overshoots: the old state shows as \
         negative for about 50 ms.",
    ],
    ["goal_buffer/gate", "input of the goal buffer", "Lets the next state into the goal buffer."],
    ["focus", "examined state", "The state in the goal buffer, after cleanup."],
    ["cause", "cause", "The action that brings about the state in the goal buffer."],
    ["caused", "cause by number", "The same action, as one number for each action."],
    [
        "alternatives",
        "choice of a cause",
        "Of several actions that bring about the state, the one that lacks least.",
    ],
    [
        "alternatives/which",
        "state with several causes",
        "The examined state, if several actions bring it about.",
    ],
    ["alternatives/causes", "its causes", "The actions that bring about the examined state."],
    [
        "alternatives/support",
        "support of a cause",
        "How far the preconditions of each of these actions hold.",
    ],
    [
        "alternatives/contest",
        "contest of causes",
        "The actions compete: the one that lacks least wins.",
    ],
    ["alternatives/pointer", "winning cause", "The action that has won the contest."],
    [
        "alternatives/rest",
        "contest at rest",
        "Keeps out of the contest what does not bring about the state.",
    ],
    ["recalled", "cause", "The action that brings about the state in the goal buffer."],
    ["recalled_items", "cause by number", "The same action, as one number for each action."],
    [
        "deep",
        "pointer of the action",
        "What is known of the action: its preconditions, bound to their role.",
    ],
    ["precondition", "role of preconditions", "The role to which preconditions are bound."],
    ["unbind", "unbinding", "Unbinds the preconditions from the pointer of the action."],
    [
        "unbound",
        "preconditions, unbound",
        "The preconditions of the action, with noise from the other contents of its pointer.",
    ],
    ["required", "preconditions", "The preconditions after cleanup."],
    [
        "open",
        "unmet preconditions",
        "The preconditions that neither hold nor are known to be reachable.",
    ],
    ["chosen", "precondition to examine", "The unmet precondition that the planner examines next."],
    ["deep_absent", "bound absences", "What must be absent before the action, bound to its role."],
    [
        "forbidden",
        "states that must be absent",
        "The states that must not hold before the action, after cleanup.",
    ],
    ["barred", "states in the way", "The states that hold and must not."],
    ["motor_gate", "motor gate", "The action that passes the gate once the planner has decided."],
    ["motor", "action to do", "The action that the robot carries out."],
];

/// Describes all of them.
pub(super) fn describe(scope: &mut Scope<'_>) {
    for [path, name, meaning] in WORDS {
        scope.describe_if_there(path, name, meaning);
    }
}
