// What went wrong in an episode: the moment, the number that ruled it out, and a picture.

const PICTURE = { width: 240, height: 160 };

// The failed steps and a failed end, each with its moment, a title and what is known of it: numbers, or what was tried.
function failuresOf(episode) {
  const came = (act) => {
    const lost = act.outcome === "dropped" ? episode.lostAt(act) : undefined;
    return lost === undefined ? act.came : act.came.replace("dropped", `dropped at ${seconds(lost, 1)}`);
  };
  const found = episode.acts.filter((act) => act.action && !act.well && act.outcome !== "not begun").map((act) => ({
    time: act.until, lost: act.outcome === "dropped" ? episode.lostAt(act) : undefined, title: `${capital(act.words)}: ${came(act)}`, text: missedBy(episode, act) || landedOrTried(episode, act),
  }));
  const { end } = episode;
  if (end && (end.ended !== "GoalMet" || !end.assembled)) {
    const strays = episode.acts.at(-1)?.strays ?? [];
    const off = strays.map((stray) => `${episode.names.say(stray.object)}: ${stray.off}`).join("; ");
    const lacking = (episode.goalAt(end.simulated_s) ?? []).filter((term) => term.lacking > 0);
    const open = lacking.length ? `Not reached: ${lacking.map(openTerm).join("; ")}` : "";
    const last = episode.acts.findLast((act) => act.words);
    const tried = last && !last.well ? `The last that it tried: ${last.words} (${last.came})` : "";
    // What ended the episode comes first.
    found.unshift({ time: end.simulated_s, title: `The end: ${episode.outcome()}`, text: [open, off, tried].filter(Boolean).join(". ") });
  }
  return found;
}

// Where a part was after its step if there are no pictures; of a step without a target, what was tried and why.
function landedOrTried(episode, act) {
  const { landed, instead, recovery } = act;
  if (landed) return episode.landedInWords(act);
  return [instead && `The planner had decided to ${instead}`, recovery && capital(recovery)].filter(Boolean).join(". ");
}

// How far a part is from its target when its step has ended, and what is nearest to the target.
function missedBy(episode, act) {
  const { chosen, until } = act;
  if (!chosen?.target || episode.frames.count === 0) return "";
  const parts = episode.film?.objects?.parts ?? [];
  const [x, y, z] = chosen.target.position;
  // Where it is before another hand moves it.
  const moved = episode.displaced.find(({ t, object }) => object === chosen.object && t > act.decided && t <= until)?.t;
  const apart = parts.map(({ id }, index) => {
    const [px, py, pz] = positionAt(episode.frames, index, moved === undefined ? until : moved - 0.1);
    return { id, across: Math.hypot(px - x, py - y), above: pz - z, all: Math.hypot(px - x, py - y, pz - z) };
  });
  const own = apart.find(({ id }) => id === chosen.object);
  if (!own) return "";
  const height = Math.abs(own.above) < 5e-4 ? "at its height" : `${millimetres(Math.abs(own.above), 0)} mm ${own.above > 0 ? "above" : "below"} it`;
  const name = episode.names.say(own.id);
  const meddled = episode.meddled(act);
  if (act.landed && !act.landed.as_planned && act.outcome === "placed") return [capital(episode.landedInWords(act)), meddled].filter(Boolean).join("; ");
  // What was dropped may have fallen to where it belongs.
  const there = own.across < 1e-3 && Math.abs(own.above) < 1e-3;
  const said = [there
    ? `${name} slipped from the fingers, and came to rest at its target all the same`
    : `${name} is ${millimetres(own.across, 0)} mm beside its target and ${height}`];
  const near = apart.filter(({ id }) => id !== own.id && id !== chosen.reference).sort((a, b) => a.all - b.all)[0];
  if (act.outcome === "occupied" && near) said.push(`${episode.names.say(near.id)} is ${millimetres(near.all, 0)} mm from that target`);
  if (meddled) said.push(meddled);
  return said.join("; ");
}

function positionAt({ t, poses, parts, count }, index, time) {
  const frame = clamp(countUpTo(t, time) - 1, 0, count - 1);
  return [0, 1, 2].map((axis) => poses[(frame * parts + index) * 7 + axis]);
}

function showFailures(section, episode, replay, seek) {
  const found = failuresOf(episode);
  section.hidden = found.length === 0;
  const cards = found.map(({ time, lost, title, text: known }) => {
    // A second before what was dropped fell.
    const from = lost === undefined ? time : Math.max(lost - 1, 0);
    const go = make("button", `Go to ${seconds(from)}`);
    go.type = "button";
    go.setAttribute("aria-label", `Go to ${seconds(from)}: ${title}`);
    go.addEventListener("click", () => seek(from));
    const text = make("div", null, make("h3", title), ...(known ? [make("p", capital(known))] : []), go);
    const card = make("li", null, ...(replay ? [picture(replay, time, title)] : []), text);
    return card;
  });
  section.querySelector("ul").replaceChildren(...cards);
}

// A picture of a moment, drawn when it comes near to the window.
function picture(replay, time, title) {
  const canvas = make("canvas");
  Object.assign(canvas, PICTURE);
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", `The scene at ${seconds(time)}: ${title}`);
  const watch = new IntersectionObserver((seen) => {
    if (!seen.some(({ isIntersecting }) => isIntersecting)) return;
    watch.disconnect();
    replay.copyTo(canvas, time);
  });
  watch.observe(canvas);
  return canvas;
}
