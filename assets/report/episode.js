// One episode: its decisions with their reasons, contacts, frames, and what holds at each moment.

// What came of a step, where the word for it says too little.
const OUTCOMES = {
  placed: "done",
  unreachable: "the arm found no way to the target",
  missed: "missed: the hand closed, but did not hold it",
  occupied: "something was in the way at the target, so the robot put the part back",
};
// What came of it if the hand had lifted the part before.
const LIFTED = { unreachable: "the robot lifted the part, but found no way from there to the target" };

// What came of it if another hand moved the part afterwards.
const TAKEN = "put down, but another hand moved it";

// Distance from a target within which something that another hand put down may be in the way, in metres.
const NEAR_M = 0.1;

class Episode {
  constructor(data, number, names) {
    this.number = number;
    this.names = names;
    this.domain = data.domain;
    this.outline = data.outline;
    this.film = (data.films ?? []).find((film) => film.episode === number);
    const lines = (data.events ?? []).filter((line) => line.episode === number);
    this.touches = lines.flatMap((line) => line.touch ?? []);
    this.displaced = lines.flatMap((line) => line.displaced ?? []);
    this.end = lines.flatMap((line) => line.end ?? [])[0];
    this.frames = unpackFrames(this.film?.frames);
    this.reason = data.run?.summary?.failures?.find((failure) => failure.episode === number)?.reason;
    this.acts = this.join(lines.filter((line) => line.decision));
    this.goals = new Set(this.acts.flatMap((act) => [...act.unmet, ...(act.goal ? [act.goal] : [])]));
    this.recorded = number === data.filmed;
    this.times = this.recorded && data.arrays ? singles(data.arrays.modules.t) : new Float32Array();
    const ends = [this.frames.t.at(-1), ...this.acts.map((act) => act.until), this.times.at(-1), this.end?.simulated_s, 0.1];
    // A long list cannot be spread over the arguments of a function.
    this.duration = ends.filter(Number.isFinite).reduce((most, end) => Math.max(most, end), 0);
  }

  // Every decision with its outcome and the moment at which its action ended.
  join(decisions) {
    const last = this.end?.simulated_s ?? this.frames.t.at(-1) ?? 0;
    let steps = 0;
    return decisions.map(({ decision, came = null }, i) => {
      const decided = decision.asked_s + decision.took_ms / 1000;
      const detour = detourInWords(decision.recovery, this.names);
      const action = detour ?? decision.action;
      const outcome = !action ? null : decision.begun ? decision.skill?.outcome ?? "cut short" : "not begun";
      const { landed = null } = decision;
      const off = outcome === "placed" && landed?.as_planned === false;
      const until = decisions[i + 1]?.decision.asked_s ?? Math.max(last, decided);
      // Only what the robot began is a step.
      const step = action && outcome !== "not begun" ? ++steps : null;
      return {
        step, asked: decision.asked_s, decided, took: decision.took_ms, action, symbol: decision.action,
        words: detour ?? decision.words ?? (action && this.names.say(action)), instead: detour && decision.words, outcome, landed,
        // What came of it in a few words, and whether that was the plan.
        came: off && this.handled(decision.chosen?.object, decided, until) ? TAKEN : (decision.skill?.picked && LIFTED[came]) || (OUTCOMES[came] ?? came),
        well: outcome === "placed" && !off,
        until, chosen: decision.chosen ?? null, moved: detour ? decision.recovery.object : null,
        holds: decision.holds ?? [], unmet: decision.unmet ?? [], gives: detour ? [] : decision.gives ?? [],
        needs: detour ? [] : decision.needs ?? this.learnedNeeds(decision), undecided: decision.undecided ?? [],
        goal: decision.chosen?.goal,
        strays: decision.in_no_state ?? [], recoveryKind: decision.recovery?.kind, recovery: recoveryInWords(decision.recovery, this.names), why: decision.recovery?.why?.replace(/^it\b/, this.names.say(decision.recovery.object)),
      };
    });
  }

  // Whether another hand moved an object between two moments.
  handled(id, from, to) {
    return this.displaced.some(({ t, object }) => object === id && t >= from && t <= to);
  }

  // What an older trace does not have: the conditions of the learned action.
  learnedNeeds({ action, chosen }) {
    return this.domain?.operators?.find(({ name }) => name === (chosen?.operator ?? action))?.preconditions ?? [];
  }

  // What a decision brings about, in words: goals that it reaches, and the next step that needs it.
  bringsAbout(index) {
    const act = this.acts[index];
    const fresh = act.gives.filter((fact) => !act.holds.includes(fact));
    const said = (facts) => [...new Set(this.names.shown(facts).map((fact) => this.names.say(fact)))];
    const goals = said(fresh.filter((fact) => this.goals.has(fact)));
    const later = this.acts.find((other, i) => i > index && other.step && other.symbol !== act.symbol
      && other.needs.some((need) => fresh.includes(need) && !this.names.hidden.has(need)));
    const needed = later ? said(later.needs.filter((need) => fresh.includes(need))).slice(0, 3) : [];
    // Of a term that counts objects, one step brings one.
    const brought = (words) => (countsObjects(words) ? `one more towards “${words}”` : words);
    const lines = goals.map((words) => `${brought(words)}, a part of the goal`);
    const open = later && fresh.filter((fact) => later.needs.includes(fact)).every((fact) => later.undecided.some((one) => one.fact === fact));
    const asks = later && `step ${later.step} ${open ? "may need" : "needs"}`;
    // A goal says "a block" where the need says "the block".
    const same = (need) => goals.includes(need.replace(/^the /, "a ").replace(/^a (?=[aeiou])/, "an "));
    const others = needed.filter((need) => !same(need) && !goals.includes(need));
    if (needed.length && !others.length) lines[0] += `, which ${asks} as well (${later.words})`;
    else if (others.length) lines.push(`${others.map(brought).join("; ")}, which ${asks} (${later.words})`);
    return (lines.length ? lines : said(fresh).slice(0, 3)).join("; and ");
  }

  // What another hand did after a step was decided and before it ended. Another part than those of the step counts only if it
  // may have come in the way.
  meddled(act) {
    const { decided, until, chosen, outcome } = act;
    const lost = outcome === "dropped" ? this.lostAt(act) : undefined;
    const when = (t) => (t >= lost ? "after the drop" : "after this was decided");
    const parts = (this.film?.objects?.parts ?? []).map(({ id }) => id);
    const own = [chosen?.object, chosen?.reference].filter((id) => id !== undefined && id !== null);
    // Of a step whose part is not known, any may be it.
    const all = own.length === 0 || !["dropped", "missed"].includes(outcome);
    const at = chosen?.target?.position;
    const near = ({ to }) => Boolean(at && to) && Math.hypot(to.position[0] - at[0], to.position[1] - at[1]) < NEAR_M;
    const during = this.displaced.filter((one) => one.t >= decided && one.t <= until
      && (all || own.includes(one.object) || !parts.includes(one.object) || near(one)));
    return during.map((one) => {
      const gone = one.object === chosen?.reference && ["dropped", "blocked", "occupied", "missed"].includes(outcome) && one.t < (lost ?? until);
      const where = gone ? ", but the robot went on to where that had been" : !own.includes(one.object) && near(one) ? ", near to where the robot went" : "";
      return `at ${seconds(one.t, 1)}, ${when(one.t)}, ${one.words.replace(", not the robot,", "")}${where}`;
    }).join("; ");
  }

  // Where a part was after its step. Its distance from the target says nothing of the step if another hand had moved it.
  landedInWords({ decided, until, chosen, landed }) {
    if (this.handled(chosen?.object, decided, until)) return `${landed.words.replace(/; it moved after.*$/, "")}, where another hand had put it`;
    // How far it is from a place says how far it is from its target.
    return landed.as_planned || landed.words.startsWith("in no state") ? landed.words : landedInWords(landed);
  }

  // When the fingers lost the part of a decision; undefined if they never held it.
  lostAt({ decided, until }) {
    return this.touches.findLast((touch) => !touch.contact && touch.t > decided && touch.t <= until)?.t;
  }

  // The part between the fingers at a moment.
  heldAt(time) {
    const last = this.touches.findLast((touch) => touch.t <= time);
    return last?.contact ? last.part : undefined;
  }

  // The decision that is being made or carried out at a moment.
  at(time) {
    return this.acts.findLastIndex((act) => act.asked <= time);
  }

  // An object's name by its index among the parts of the scene.
  part(index) {
    const id = this.film?.objects?.parts[index]?.id;
    if (id) return this.names.say(id);
    // A fixture that can be moved has no id of its own.
    const { parts = [], kinds = [] } = this.outline ?? {};
    const kind = kinds[parts[index]]?.name.replaceAll("_", " ");
    const alike = (until) => parts.slice(0, until).filter((other) => other === parts[index]).length;
    if (!kind) return `part ${index + 1}`;
    return alike(parts.length) > 1 ? `${kind} ${alike(index)}` : `the ${kind}`;
  }

  // Where each object is at a moment, as statements; null if that is not known.
  places(time) {
    if (!this.film?.held) return null;
    return this.film.held.objects.map(({ id, name, part, changes }) => {
      const [, , words] = changes.findLast(([t]) => t <= time + 1e-6) ?? changes[0] ?? [0, null, null];
      return { id, words: this.heldAt(time) === part ? `${name} is in the hand` : words ?? `${name} is in no known state` };
    });
  }

  // What another hand did, as a sentence, and where the object was before and afterwards.
  displacement({ t, object, words }) {
    const at = (time) => this.places(time)?.find(({ id }) => id === object)?.words;
    const [before, after] = [at(Math.max(t - 0.1, 0)), at(t + 0.5)];
    return { words: `${capital(words)}.`, before, after };
  }

  // The terms of the goal at a moment, each with the number of objects that it lacks; null if that is not known. What is in the hand
  // is lacking, also while it is held near to its target.
  goalAt(time) {
    if (!this.film?.held) return null;
    const last = this.touches.findLast((touch) => touch.t <= time);
    const from = last?.contact && time < this.duration - 1e-6 ? last.t : time;
    return this.film.held.goal.map(({ term, changes }) => {
      const [, begun] = changes.findLast(([t]) => t <= from + 1e-6) ?? changes[0] ?? [0, null];
      const since = changes.filter(([t]) => t > from + 1e-6 && t <= time + 1e-6).map(([, lacking]) => lacking);
      return { term, lacking: begun === null ? since.at(-1) ?? null : Math.max(begun, ...since) };
    });
  }

  // How the episode ended, in words.
  outcome() {
    return endInWords(this.end, this.reason);
  }
}

function unpackFrames(frames) {
  if (!frames) return { count: 0, parts: 0, t: new Float32Array() };
  const unpacked = Object.fromEntries(["t", "angles", "fingers", "poses"].map((k) => [k, singles(frames[k])]));
  return { ...frames, ...unpacked };
}
