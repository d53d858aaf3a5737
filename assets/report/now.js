// The panel beside the picture: what happens at the moment, where everything is, and how far the goal is reached.

const DONE = "✓ ";
const OPEN = "○ ";

function nowEntries(episode, time, goalWords) {
  const { names } = episode;
  const index = episode.at(time);
  const act = episode.acts[index];
  const entries = [];
  const add = (name, ...lines) => entries.push([name, lines]);
  if (!act) {
    add("now", episode.acts.length ? "looking at the scene" : "no decisions are known");
  } else if (time < act.decided) {
    add("now", `deciding, for ${((time - act.asked) * 1000).toFixed(0)} of ${act.took.toFixed(0)} ms`);
  } else if (act.action) {
    const over = time >= act.until - 1e-6 ? `, ${act.outcome}` : "";
    add("now", `doing: ${act.words}${over}`);
    if (act.recovery) add("why so", act.recovery);
  } else {
    add("now", index === episode.acts.length - 1 ? `done: ${episode.outcome()}` : "looking again: it found no way");
  }
  if (act?.action && episode.end && time >= episode.duration - 1e-6) add("at the end", episode.outcome());
  const held = episode.heldAt(time);
  add("in the hand", held === undefined ? "nothing" : episode.part(held));
  const terms = episode.goalAt(time);
  if (terms?.length) add("goal", ...terms.map(({ term, lacking }) => (lacking === 0 ? DONE : OPEN) + term + (lacking > 1 || (lacking === 1 && /^(every|at least) /.test(term)) ? ` (${lacking} lacking)` : "")));
  else add("goal", goalWords ?? "unknown");
  const places = episode.places(time);
  if (places) add("where things are now", ...places.map(({ name, words }) => `${name}: ${words}`));
  else if (act) add(`at its look at ${seconds(act.asked)}`, ...names.shown(act.holds).map((fact) => names.say(fact)));
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
