// Sentences for phases, ends of episodes and obstacles, which the data name by a word.

// The phases of the searches backward and forward. A planner has those of one of them, or of both.
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

// Why an episode ended. A trace of an older version does not say it in words, and `run.json` only of failures.
function endInWords(end, reason) {
  const older = "the trace is of an older version, which does not say why the episode ended";
  const unseen = end?.assembled && end.ended !== "GoalMet" ? "; the task was solved all the same, but the robot did not see that" : "";
  return (end?.words ?? reason ?? (end ? older : "the end of the episode is unknown")) + unseen;
}

// What the executor changed after a failure, and why.
function recoveryInWords(recovery, names) {
  if (!recovery) return null;
  const { kind, why, attempt, object } = recovery;
  const before = attempt > 1 && !detourInWords(recovery, names) ? `; ${names.say(object)} had been taken ${["", "once", "twice"][attempt - 1] ?? `${attempt - 1} times`} before` : "";
  return `${recoveryOf(kind, names.say(object))}: ${why}${before}`;
}

// What a recovery does with an object.
function recoveryOf(kind, object) {
  const does = {
    again: `takes ${object} again`,
    part: `takes ${object} this time`,
    grasp: `takes ${object} by another grasp`,
    place: `puts ${object} at another place than before`,
    order: `takes ${object} first`,
    regrasp: `lays ${object} at a free place, to take it anew`,
    reseat: `takes ${object} from where it lies, and lays it at a free place`,
    clear: `moves ${object} out of the way`,
    push: `pushes ${object}`,
  };
  return does[kind] ?? kind;
}

// What the robot does in place of the decided action, as an order; undefined if it carries out the action itself.
function detourInWords(recovery, names) {
  const object = recovery && names.say(recovery.object);
  const orders = {
    regrasp: `lay ${object} at a free place, to take it anew`,
    reseat: `take ${object} from where it lies, and lay it at a free place`,
    clear: `move ${object} out of the way`,
    push: `push ${object}`,
  };
  return orders[recovery?.kind];
}

// Whether a term of a goal, in words, counts objects.
const countsObjects = (term) => /^(every|at least) | each /.test(term);

// A term of a goal, with the number of objects that it lacks if it counts them.
const openTerm = ({ term, lacking }) => term + (lacking > 0 && countsObjects(term) ? ` (${lacking} lacking)` : "");
