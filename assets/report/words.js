// Sentences for modules, ends of episodes and obstacles, which the data name by a word.

const MEANING = {
  goal_buffer: "The state that the planner examines now. While the buffer takes up a new state it overshoots: the old "
    + "state shows as negative for about 50 ms.",
  cause: "The action that brings about the state in the goal buffer.",
  unbind: "The preconditions of that action, as unbound from its pointer, with noise from the other contents of the "
    + "pointer.",
  required: "The preconditions after cleanup.",
  open: "The preconditions that neither hold nor are known to be reachable.",
  chosen: "The unmet precondition that the planner examines next.",
  motor_gate: "The action that passes the gate once the planner has decided.",
  motor: "The action that the robot carries out.",
  phase: "The step of its work that the planner is at. One phase is active at a time, and two while one gives way to the next.",
  goal_set: "The facts that must hold before the next action of the plan, worked back from the goal.",
  cost: "How far each fact is from what holds now: the more steps, the higher.",
  utility: "How well each action suits the present goal set. The best one wins the race.",
  winner: "The action that has won the race.",
  slot: "The place in memory of the present goal set: one for each step of the plan.",
};

// The phases of the planner of goal sets, backward and forward.
const PHASES = {
  Start: "Forgets everything, and takes the goal.",
  Wave: "Finds how far each fact is from what holds.",
  Write: "Writes the goal set to memory.",
  Settle: "Moves to that memory and waits until all is steady.",
  Look: "Forgets how far the facts were.",
  Race: "Actions compete; the one that suits best wins.",
  Check: "Waits until one winner is left, and finds what must hold before it.",
  Veto: "The winner leads back to where it has been: it is barred.",
  Back: "No action leads on: goes back to an earlier goal set.",
  Read: "Loads that goal set from memory.",
  Mark: "The goal is reached in the plan: marks the way to it.",
  Rest: "Lets the phase before end.",
  Up: "Moves to the memory before.",
  Begin: "The plan is found: shows its first action.",
  Step: "Looks up the next step of the plan.",
  Fetch: "Loads that step from memory.",
  Show: "Shows the action to the robot until it is done.",
  Next: "Moves on to the next step.",
  Done: "The goal holds.",
  Stuck: "Some part of the goal cannot be reached.",
  Tired: "Too many dead ends: begins anew.",
  Widen: "No way is left: tries all actions that are possible.",
};

// How an episode ended. Actions and states have the domain's names. In a domain with frames, an obstacle is about the
// objects of the scene, and `run.json` has the reason in words.
function endInWords(end, domain, reason, names) {
  if (domain?.framed && end?.ended?.Stuck && reason) return `the goal cannot be reached: ${reason}`;
  if (!end) return "the end of the episode is unknown";
  const [kind, detail] = typeof end.ended === "object" ? Object.entries(end.ended)[0] : [end.ended, null];
  const action = detail?.action ? `“${names.say(detail.action)}”` : "an action";
  const words = {
    GoalMet: "the goal holds",
    Stuck: "the goal cannot be reached",
    NoWay: `no part could be grasped and placed for ${action}`,
    Occupied: `another part lies where ${action} puts its part`,
    Lost: `${listed(detail?.objects?.map((id) => names.say(id)))} fell off the table, and the goal needs more parts`,
    GaveUp: "the limit on time or skills was reached",
    NoProblem: detail?.why ?? "the goal cannot be asked for",
  };
  const why = kind === "Stuck" && detail && typeof detail === "object" ? obstacleInWords(detail, domain) : "";
  return (words[kind] ?? kind) + why;
}

// What the executor changed after a failure, and why.
function recoveryInWords(recovery, names) {
  if (!recovery) return null;
  const { kind, why, attempt } = recovery;
  const object = names.say(recovery.object);
  const does = {
    again: `takes ${object} again`,
    part: `takes ${object} instead`,
    grasp: `takes ${object} by another grasp`,
    place: `puts ${object} elsewhere`,
    order: `takes ${object} first`,
    regrasp: `puts ${object} down to take it anew`,
    reseat: `takes ${object} out`,
    clear: `moves ${object} out of the way`,
    push: `pushes ${object}`,
  };
  return `${does[kind] ?? kind}: ${why} (try ${attempt})`;
}

// The name of a skill that is not the decided action; undefined if the action itself is carried out.
function detour(decision) {
  const { kind, object } = decision.recovery ?? {};
  return ["regrasp", "reseat", "clear", "push"].includes(kind) ? `${kind} ${object}` : undefined;
}

function obstacleInWords(obstacle, domain) {
  const [kind, at] = Object.entries(obstacle)[0] ?? [];
  const state = domain?.states[at?.state]?.name ?? "a state";
  const action = domain?.operators[at?.action]?.name ?? "an action";
  const words = {
    NothingCauses: `${state} does not hold and no action causes it`,
    MustBeAbsent: `${state} holds, but must be absent before ${action}`,
    NeedsItself: `every way to reach ${state} requires ${state} itself`,
    NoPlan: `no plan that reaches the goal was found`,
  };
  return `: ${words[kind] ?? inWords(obstacle)}`;
}

