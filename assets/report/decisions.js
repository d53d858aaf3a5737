// The decisions of an episode: what, why, and how it went. A press on a row goes to its moment.

// Facts of the goal and conditions that are listed before "and so many more".
const REASONS_SHOWN = 4;

function decisionsTable(episode, open) {
  const { acts } = episode;
  const own = acts.map((act, i) => ({ time: act.asked, act, row: [act.asked.toFixed(2), reasoned(episode, act, i), outcomeOf(episode, act, i)] }));
  const others = episode.displaced.map((one) => ({ time: one.t, row: [one.t.toFixed(2), displaced(episode, one), null] }));
  const entries = [...own, ...others].sort((a, b) => a.time - b.time);
  const grid = table([">at, s", "decision and why", "outcome"], entries.map(({ row }) => row));
  grid.classList.add("decisions");
  const pressed = [...grid.querySelectorAll("tbody tr")].filter((_, i) => entries[i].act);
  pressed.forEach((row, i) => {
    row.setAttribute("aria-label", `${acts[i].step ? `Step ${acts[i].step}` : "Decision"}: ${acts[i].words ?? "nothing"}`);
    pressable(row, () => open(acts[i]));
  });
  return { grid, rows: pressed };
}

// The decision as a sentence, and a line for each reason.
function reasoned(episode, act, index) {
  const { names } = episode;
  const lines = [];
  const line = (label, text) => { if (text) lines.push(make("li", null, make("b", `${label}: `), text)); };
  line("Not yet reached", names.list(names.shown(act.unmet), REASONS_SHOWN));
  // Another part or another place than decided on.
  const reference = names.words.get(act.chosen?.reference);
  const other = act.action && !act.instead && reference && act.words?.includes(reference) && act.symbol && !names.say(act.symbol).includes(reference);
  const planned = other || (act.recovery && !act.instead && ["part", "place"].includes(act.recoveryKind)) ? names.say(act.symbol) : null;
  // The places of a state are numbered nowhere on the page.
  line("The planner had decided to", (act.instead ?? planned)?.replace(/, (at place|leaving at least) \d+( where it was)?/g, ""));
  const needs = names.shown(act.needs);
  const known = act.holds.length > 0 && needs.some((need) => act.holds.includes(need));
  const mark = (need) => (!act.holds.includes(need) ? "(not yet)" : takenAsSo(episode, act, need) ? `(assumed, since ${outOfPlace(episode, act)} in no state)` : `✓${looseToo(episode, act, need)}`);
  const marked = (need) => (known ? `${names.say(need)} ${mark(need)}` : names.say(need));
  const reasons = new Map(act.undecided.map(({ fact, held, of }) => [fact, `held before ${held} of ${of} demonstrated moves`]));
  const [open, decided] = [needs.filter((need) => reasons.has(need)), needs.filter((need) => !reasons.has(need))];
  line(planned ? "That needs" : "It needs", decided.slice(0, REASONS_SHOWN).map(marked).join("; "));
  line("Perhaps needed, undecided", open.slice(0, REASONS_SHOWN).map((need) => `${marked(need)} (${reasons.get(need)})`).join("; "));
  if (act.action) line("It brings about", episode.bringsAbout(index));
  line("Why so", act.recovery);
  const next = episode.acts[index + 1];
  if (act.action && !act.step) line("Why not", next?.why);
  if (act.action && !act.well) line("Meanwhile", episode.meddled(act));
  act.strays.forEach(({ object, nearest, off }) => line("Out of place", `${names.say(object)}, nearest to “${names.sayState(nearest)}”: ${off}`));
  const what = act.step ? `${act.step}. ${capital(act.words)}.` : act.action ? `Not begun: ${act.words}.` : idleInWords(episode, act, index);
  const list = make("ul", null, ...lines);
  list.className = "why";
  return make("div", null, make("strong", what), ...(lines.length ? [list] : []));
}

// Why there is no step: the end of the episode, or nothing is possible as long as parts lie where no action takes them.
function idleInWords(episode, act, index) {
  if (index === episode.acts.length - 1) return `The end: ${episode.outcome()}.`;
  const out = listed(act.strays.map(({ object }) => episode.names.say(object)));
  const none = `No step: it knew no way${out ? ` with ${out} out of place` : ""}`;
  return wentOn(episode, index) ? `${none}. It went on as if ${out} lay where such things start.` : `${none}, and looked again.`;
}

// Whether the next step rests on a guess about what is out of place.
function wentOn(episode, index) {
  const next = episode.acts[index + 1];
  return episode.acts[index].strays.length > 0 && Boolean(next?.action) && next.needs.some((need) => next.holds.includes(need) && takenAsSo(episode, next, need));
}

// What is out of place at a decision, as the subject of a sentence.
function outOfPlace(episode, act) {
  const out = act.strays.map(({ object }) => episode.names.say(object));
  return `${listed(out)} ${out.length > 1 ? "are" : "is"}`;
}

const listed = (names) => [names.slice(0, -1).join(", "), ...names.slice(-1)].filter(Boolean).join(" and ");

// Whether a fact that holds is a guess about a part in no state.
function takenAsSo({ domain }, act, need) {
  const kind = (state) => domain?.states?.find(({ name }) => name === state)?.kind;
  return act.strays.some(({ object, nearest }) => need.startsWith(`${object.toUpperCase()}_`)
    || (object === act.chosen?.object && kind(need) !== undefined && kind(need) === kind(nearest)));
}

// That a fact about the area in which things were found holds of what lies elsewhere, too, if some does at the look.
function looseToo(episode, act, need) {
  const words = episode.names.say(need);
  if (!words.includes(START_AREA)) return "";
  const ofKind = (text) => words.includes(text.replace(/^the /, "").split(" ")[0]);
  const named = ({ id }) => words.startsWith(`${episode.names.say(id)} `);
  const all = (episode.places(act.asked) ?? []).filter(({ words: text }) => ofKind(text));
  const own = all.some(named) ? all.filter(named) : all;
  const loose = own.filter(({ words: text }) => / loose, not | lies wrongly /.test(text));
  const inArea = own.filter((one) => one.words.includes(START_AREA) && !loose.includes(one));
  const needed = Number(/at least (\d+)/.exec(words)?.[1] ?? 1);
  if (!loose.length || inArea.length >= needed) return "";
  return ` (${listed(loose.map(({ id }) => episode.names.say(id)))}, which ${loose.length > 1 ? "lie" : "lies"} elsewhere, ${loose.length > 1 ? "count" : "counts"} too)`;
}

const START_AREA = "start area";

// What another hand did, and where the object was before and afterwards; once, if that is the same.
function displaced(episode, one) {
  const { words, before, after } = episode.displacement(one);
  const list = make("ul", null, ...(before === after ? [["Before and afterwards", after]] : [["Before", before], ["Afterwards", after]]).filter(([, text]) => text)
    .map(([label, text]) => make("li", null, make("b", `${label}: `), text)));
  list.className = "why";
  return make("div", null, make("strong", words.replace(", not the robot,", "")), list);
}

// Where a part was after its step.
function landedInWords({ words, off_mm: off }) {
  return off === null ? words : `${words}; ${off.toFixed(1)} mm from its target`;
}

function outcomeOf(episode, act, index) {
  if (!act.action) return index === episode.acts.length - 1 ? episode.outcome() : wentOn(episode, index) ? "went on" : "looked again";
  const word = make("span", act.came);
  word.className = act.well ? "good" : "bad";
  const where = act.well || !act.landed ? [] : [make("div", episode.landedInWords(act))];
  // Of what was only moved away, where it is now.
  const moved = act.well && act.moved ? episode.places(act.until)?.find(({ id }) => id === act.moved)?.words : null;
  if (moved) where.push(make("div", moved));
  return make("div", null, word, ...where, make("div", `until ${seconds(act.until)}`), make("div", `thought ${act.took.toFixed(0)} ms`));
}
