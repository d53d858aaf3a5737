// The run in four short paragraphs: what was shown, learned, decided and done.

// What the demonstrations took in the hand, one after another.
function taken({ moved, alike, demonstrations }) {
  if (!moved?.length) return [];
  const kinds = moved.map((kind) => kind.replaceAll("_", " ")).join(", ");
  return [demonstrations > 1 && !alike ? `The first one took in turn: ${kinds}.` : `In turn the hand took: ${kinds}.`];
}

// Each paragraph is a heading and lines of text.
function story({ run, domain, recording }, episode) {
  const { summary = {} } = run ?? {};
  const goal = run?.goal_words ?? domain?.goal ?? run?.goal;
  const acts = episode.acts.filter((act) => act.step);
  const well = acts.filter((act) => act.well).length;
  const { episodes = 1 } = summary;
  const shown = recording
    ? [`${plural(recording.demonstrations, "demonstration")} with ${plural(recording.snapshots, "snapshot")} of where everything was.`,
      ...taken(recording)]
    : ["Nothing is known about the demonstrations."];
  const learned = domain
    ? [`The goal: ${goal || "unknown"}.`, `${plural(domain.states.length, "state")} and ${plural(domain.operators.length, "action")}:`]
    : ["The learned domain is missing."];
  const actions = (domain?.operators ?? []).map((operator, i) => [i + 1, episode.names.begin(operator.name)]);
  const longest = episode.acts.reduce((most, act) => Math.max(most, act.took), 0);
  const decided = episode.acts.length
    ? [`${plural(acts.length, "step")}, decided one at a time. The longest decision took ${longest.toFixed(0)} ms of simulated time.`]
    : ["No decisions are known."];
  const steps = acts.map((act) => [act.step, `${capital(act.words)}${act.well ? "" : ` (${act.came})`}`]);
  const inPlace = acts.filter((act) => !act.well && act.landed?.as_planned && !episode.meddled(act)).length;
  const also = inPlace ? `, and ${inPlace} more, though dropped, left the part in its place` : "";
  const failed = acts.length - well - inPlace;
  const anew = `; after the other${failed > 1 ? "s" : ""} it decided anew`;
  const unlike = acts.filter((act) => !act.well && act.landed && !act.landed.as_planned);
  const missed = unlike.slice(0, 3).map((act) => `“${capital(act.words)}” went otherwise (${act.came}): ${episode.landedInWords(act)}.`);
  const others = failed - missed.length;
  if (others > 0) missed.push(`And ${others} more: see “What went wrong”.`);
  const done = [`${well || "None"} of ${plural(acts.length, "step")} ended as planned${also}${failed ? anew : ""}.`, ...missed,
    episode.end ? `After ${seconds(episode.end.simulated_s, 1)}: ${episode.outcome()}.` : "The end of the episode is unknown."];
  const { interventions } = summary;
  if (interventions && episode.recorded) decided.push(`${plural(interventions, "intervention")} of a log changed the run as it went on, so this is not what it does by itself.`);
  const hands = episode.displaced.map((one) => `At ${seconds(one.t, 1)} ${one.words}.`);
  done.splice(1 + missed.length, 0, ...hands.slice(0, 3), ...(hands.length > 3 ? [`And ${hands.length - 3} times more.`] : []));
  if (episodes > 1) done.push(`In all, ${summary.assembled} of ${episodes} episodes were solved.`);
  return [["Shown", shown], ["Learned", learned, actions], ["Decided", decided, steps], ["Done", done]];
}

function showStory(box, data, episode) {
  box.replaceChildren(...story(data, episode).map(([heading, lines, steps]) => {
    const item = make("li", null, make("h2", heading), ...lines.map((line) => make("p", line)));
    if (steps?.length) item.append(make("ol", null, ...steps.slice(0, STEPS_SHOWN).map(([number, step]) => Object.assign(make("li", step), { value: number }))));
    if (steps?.length > STEPS_SHOWN) item.append(make("p", `And ${steps.length - STEPS_SHOWN} more: see below.`));
    return item;
  }));
}

const STEPS_SHOWN = 8;
