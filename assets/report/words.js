// Sentences for what the data name by a word: modules, ends of episodes, obstacles.

const MEANING = {
  goal_buffer: "The state that the planner examines now. While the buffer takes up a new state it overshoots: the old "
    + "state shows as negative for about 50 ms.",
  cause: "The action that brings about the state in the goal buffer.",
  unbind: "The preconditions of that action as unbound from its pointer, with noise from the pointer's other contents.",
  required: "The preconditions after cleanup.",
  open: "Preconditions that do not hold and are not examined yet.",
  chosen: "The open precondition that the planner examines next.",
  motor_gate: "The action that passes to the motor module once the planner has decided.",
  motor: "The action that the robot carries out.",
};

// How an episode ended. Actions and states have the domain's names.
function endInWords(end, domain) {
  if (!end) return "how the episode ended is not known";
  const [kind, detail] = typeof end.ended === "object" ? Object.entries(end.ended)[0] : [end.ended, null];
  const action = detail?.action ?? "an action";
  const words = {
    GoalMet: "the goal holds",
    Stuck: "the goal cannot be reached",
    NoWay: `no part could be grasped and placed for ${action}`,
    Occupied: `the target of ${action} is occupied`,
    GaveUp: "the limit on time or skills was reached",
  };
  const why = kind === "Stuck" && detail && typeof detail === "object" ? obstacleInWords(detail, domain) : "";
  return (words[kind] ?? kind) + why;
}

function obstacleInWords(obstacle, domain) {
  const [kind, at] = Object.entries(obstacle)[0] ?? [];
  const state = domain?.states[at?.state]?.name ?? "a state";
  const action = domain?.operators[at?.action]?.name ?? "an action";
  const words = {
    NothingCauses: `${state} does not hold and no action brings it about`,
    MustBeAbsent: `${action} needs ${state} to be absent, but it holds`,
    NeedsItself: `${state} is needed before it can be brought about`,
  };
  return `: ${words[kind] ?? inWords(obstacle)}`;
}

