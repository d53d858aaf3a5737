// The panel beside the picture: what happens at the moment, where everything is, and how far the goal is reached.

const DONE = "✓ ";
const OPEN = "○ ";
// For how long the panel says what another hand did, in seconds.
const TOLD_S = 3;

function nowEntries(episode, time, goalWords) {
  const { names } = episode;
  const index = episode.at(time);
  const act = episode.acts[index];
  const entries = [];
  const add = (name, ...lines) => entries.push([name, lines.map(capital)]);
  if (!act) {
    add("Now", episode.acts.length ? "looking at the scene" : "no decisions are known");
  } else if (time < act.decided) {
    add("Now", `deciding, for ${((time - act.asked) * 1000).toFixed(0)} of ${act.took.toFixed(0)} ms`);
  } else if (act.action) {
    const over = time >= act.until - 1e-6 ? `, ${act.came}` : "";
    const lost = act.outcome === "dropped" ? episode.lostAt(act) : undefined;
    add("Now", lost !== undefined && time >= lost && !over ? `dropped what it carried; it was to ${act.words}` : `doing: ${act.words}${over}`);
    if (act.recovery) add("Why so", act.recovery);
  } else {
    add("Now", index === episode.acts.length - 1 ? `${episode.end?.ended === "GoalMet" ? "done" : "over"}: ${episode.outcome()}` : "looking again: it knew no way");
  }
  if (act?.action && episode.end && time >= episode.duration - 1e-6) add("At the end", episode.outcome());
  const other = episode.displaced.findLast(({ t }) => t <= time && time < t + TOLD_S);
  if (other) add("Not the robot", other.words);
  const held = episode.heldAt(time);
  add("In the hand", held === undefined ? "nothing" : episode.part(held));
  const terms = episode.goalAt(time);
  if (terms?.length) add("Goal", ...terms.map((term) => (term.lacking === 0 ? DONE : OPEN) + openTerm(term)));
  else add("Goal", goalWords ?? "unknown");
  const places = episode.places(time);
  if (places) add("Where things are now", ...places.map(({ words }) => words));
  else if (act) add(`At its look at ${seconds(act.asked)}`, ...names.shown(act.holds).map((fact) => names.say(fact)));
  return entries;
}

function showNow(box, entries) {
  box.replaceChildren(...entries.flatMap(([name, lines]) => [make("dt", name), ...lines.map((line) => make("dd", line))]));
}

// What the planner was told at the decision of a moment: all facts, also those that only the planner needs.
function showFacts(box, episode, time) {
  const act = episode.acts[episode.at(time)];
  const list = (facts) => (facts.length ? facts.map((fact) => make("li", episode.names.say(fact))) : [make("li", "none")]);
  box.replaceChildren(...(act ? list(act.holds) : list([])));
}
