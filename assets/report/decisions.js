// The decisions of an episode: what, why, and how it went. A press on a row goes to its moment.

// Facts of the goal and conditions that are listed before "and so many more".
const REASONS_SHOWN = 4;

function decisionsTable(episode, open) {
  const { acts } = episode;
  const rows = acts.map((act, i) => [act.asked.toFixed(2), reasoned(episode, act, i), outcomeOf(episode, act, i)]);
  const grid = table([">at, s", "decision and why", "outcome"], rows);
  grid.classList.add("decisions");
  const pressed = [...grid.querySelectorAll("tbody tr")];
  pressed.forEach((row, i) => {
    row.setAttribute("aria-label", `Decision ${i + 1}: ${acts[i].words ?? "nothing"}`);
    pressable(row, () => open(acts[i]));
  });
  return { grid, rows: pressed };
}

// The decision as a sentence, and a line for each reason.
function reasoned(episode, act, index) {
  const { names } = episode;
  const lines = [];
  const line = (label, text) => { if (text) lines.push(make("li", null, make("b", `${label}: `), text)); };
  if (act.action) line("Not yet reached", names.list(names.shown(act.unmet), REASONS_SHOWN));
  const needs = names.shown(act.needs);
  const marked = needs.map((need) => `${names.say(need)} ${act.holds.includes(need) ? "✓" : "(not yet)"}`);
  const known = act.holds.length > 0 && needs.some((need) => act.holds.includes(need));
  line("It needs", (known ? marked : needs.map((need) => names.say(need))).slice(0, REASONS_SHOWN).join("; "));
  if (act.action) line("It leads to", episode.leadsTo(index));
  line("After a failure", act.recovery);
  act.strays.forEach(({ object, nearest, off }) => line("Out of place", `${names.say(object)}, nearest to “${names.say(nearest)}”: ${off}`));
  const last = index === episode.acts.length - 1;
  const what = act.action ? `${capital(act.words)}.` : last ? `Nothing: ${episode.outcome()}.` : "Nothing: it found no way, and looked again.";
  const list = make("ul", null, ...lines);
  list.className = "why";
  return make("div", null, make("strong", what), ...(lines.length ? [list] : []));
}

function outcomeOf(episode, act, index) {
  if (!act.action) return index === episode.acts.length - 1 ? episode.outcome() : "looked again";
  const word = make("span", act.outcome);
  word.className = act.outcome === "placed" ? "good" : "bad";
  return make("div", null, word, make("div", `until ${seconds(act.until)}`), make("div", `thought ${act.took.toFixed(0)} ms`));
}
