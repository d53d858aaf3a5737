// The page of a run: replay, time axis, decisions and tables, all following one moment.

class RunPage {
  constructor(data, main) {
    this.data = data;
    main.append(byId("run-page").content.cloneNode(true));
    this.recorded = data.filmed;
    this.events = (data.events ?? []).filter((line) => line.episode === this.recorded);
    this.frames = this.unpackFrames();
    this.touches = this.events.flatMap((line) => line.touch ?? []);
    this.acts = this.decisionsAndActs();
    const ends = [this.frames.t.at(-1), ...this.acts.map((act) => act.until), this.times().at(-1), 0.1];
    // A long list cannot be spread over the arguments of a function.
    this.duration = ends.filter(Number.isFinite).reduce((most, end) => Math.max(most, end), 0);
    this.time = 0;
    this.playing = false;
    this.decisionRows = [];
    const { episodes = 1 } = data.run?.summary ?? {};
    if (this.recorded === null) byId("episode").textContent = "An episode of unknown number";
    else if (episodes > 1) byId("episode").textContent = `Episode ${this.recorded + 1} of ${episodes}`;
    shielded("replay", () => this.buildReplay());
    shielded("timeline", () => this.buildThinking());
    shielded("decisions", () => this.buildDecisions());
    shielded("learned", () => this.buildLearned());
    shielded("settings", () => this.buildSettings());
    this.buildControls();
    listenToKeys(this);
    this.seek(0);
  }

  // The part between the fingers at a moment.
  heldAt(time) {
    const last = this.touches.findLast((touch) => touch.t <= time);
    return last?.contact ? last.part : undefined;
  }

  // Why an episode failed, as `run.json` has it.
  reason(episode) {
    return this.data.run?.summary?.failures?.find((failure) => failure.episode === episode)?.reason;
  }

  // A part's kind and its number among those of its kind.
  partName(index) {
    const { kinds = [], parts = [] } = this.data.outline ?? {};
    const kind = parts[index];
    if (kind === undefined) return `part ${index + 1}`;
    return `${kinds[kind].name} ${parts.slice(0, index + 1).filter((other) => other === kind).length}`;
  }

  unpackFrames() {
    const frames = this.data.arrays?.frames;
    if (!frames) return { count: 0, parts: 0, t: new Float32Array() };
    const unpacked = Object.fromEntries(["t", "angles", "fingers", "poses"].map((k) => [k, singles(frames[k])]));
    return { ...frames, ...unpacked };
  }

  times() {
    return this.data.arrays ? singles(this.data.arrays.modules.t) : new Float32Array();
  }

  // Every decision of the recorded episode, with its action and the moment at which the action ended.
  decisionsAndActs() {
    const decisions = this.events.flatMap((line) => line.decision ?? []);
    const end = this.events.flatMap((line) => line.end ?? [])[0];
    const last = end?.simulated_s ?? this.frames.t.at(-1) ?? 0;
    return decisions.map((decision, i) => {
      const outcome = decision.begun ? decision.skill?.outcome ?? "cut short" : "not begun";
      const decided = decision.asked_s + decision.took_ms / 1000;
      const action = detour(decision) ?? decision.action;
      return {
        asked: decision.asked_s, decided, holds: decision.holds, action,
        until: decisions[i + 1]?.asked_s ?? Math.max(last, decided), outcome: action ? outcome : null,
        took: decision.took_ms, recovery: recoveryInWords(decision.recovery),
      };
    });
  }

  buildReplay() {
    const view = document.querySelector("#replay .view");
    const { outline, domain } = this.data;
    if (!outline || this.frames.count === 0) {
      view.replaceChildren(make("p", "There is nothing to replay: the frames or the shapes of the scene are missing."));
      return;
    }
    try {
      this.replay = new Replay(view, outline, this.frames, domain?.drawn ?? domain?.states ?? []);
      this.replay.held = () => this.heldAt(this.time);
    } catch (error) {
      view.replaceChildren(make("p", `This browser cannot draw the 3-D view (${error.message}).`));
    }
  }

  buildThinking() {
    this.thinking = new Thinking(this);
    this.timeline = this.thinking.timeline;
  }

  chooseModule(index) {
    this.thinking.choose(index);
  }

  buildDecisions() {
    const all = (this.data.events ?? []).filter((line) => line.decision);
    const many = all.some((line) => line.episode > 0);
    const operators = new Map((this.data.domain?.operators ?? []).map((o) => [o.name, o]));
    const needs = (action) => listed(operators.get(action)?.preconditions);
    const ends = new Map((this.data.events ?? []).filter((line) => line.end).map((line) => [line.episode, line.end]));
    const recovered = all.some(({ decision }) => decision.recovery);
    const rows = all.map(({ episode, decision }, i) => {
      const last = all[i + 1]?.episode !== episode;
      const how = endInWords(ends.get(episode), this.data.domain, this.reason(episode));
      const outcome = decision.begun ? decision.skill?.outcome ?? "cut short" : last ? how : "not begun";
      return [
        ...(many ? [String(episode + 1)] : []), decision.asked_s.toFixed(2), decision.took_ms.toFixed(0),
        listed(decision.holds), detour(decision) ?? decision.action ?? "nothing", decision.action ? needs(decision.action) : "–",
        outcome, ...(recovered ? [recoveryInWords(decision.recovery) ?? ""] : []),
      ];
    });
    const columns = [">at, s", ">took, ms", "states that hold", "decision", "its preconditions", "outcome"];
    const grid = table([...(many ? [">episode"] : []), ...columns, ...(recovered ? ["recovery, and why"] : [])], rows);
    const of = many ? ` of episode ${this.recorded + 1} (marked at the left)` : "";
    const others = many ? " The option --record-episode chooses the episode that is recorded." : "";
    byId("clicking").textContent = this.recorded === null
      ? "The number of the recorded episode is not known."
      : `Click a decision${of}, or select it and press Enter, to go to its moment.${others}`;
    grid.querySelectorAll("tbody tr").forEach((row, i) => {
      if (all[i].episode !== this.recorded) return;
      const act = this.acts[this.decisionRows.length];
      this.decisionRows.push(row);
      row.setAttribute("aria-label", `Decision ${this.decisionRows.length}: ${act.action ?? "nothing"}`);
      pressable(row, () => {
        this.open(act);
        byId("replay").scrollIntoView({ behavior: "smooth" });
      });
    });
    const box = document.querySelector("#decisions .scroll");
    box.classList.toggle("long", all.length > 24);
    box.append(grid);
    this.bringIntoBox(this.decisionRows[0]);
  }

  // Goes to a decision and shows it closely.
  open(act) {
    this.pause();
    this.timeline.look(act.asked - 0.05, act.decided + 0.1);
    this.seek(act.asked);
  }

  // Opens the decision after the moment, or before it.
  openDecision(way) {
    const later = this.acts.find((act) => act.asked > this.time + 1e-6);
    const earlier = this.acts.findLast((act) => act.asked < this.time - 1e-6);
    const act = way > 0 ? later : earlier;
    if (act) this.open(act);
  }

  // Scrolls the table of decisions, and not the page, to one of its rows.
  bringIntoBox(row) {
    const box = document.querySelector("#decisions .scroll");
    if (!row || !box.classList.contains("long")) return;
    box.scrollTop += row.getBoundingClientRect().top - box.getBoundingClientRect().top - box.clientHeight / 3;
  }

  buildLearned() {
    const { domain, recording } = this.data;
    if (!domain) throw new Error("the domain is missing");
    byId("states").append(statesTable(domain));
    byId("operators").append(operatorsTable(domain));
    const from = recording && domain.provenance
      ? `Learned from ${recording.demonstrations} demonstrations with ${recording.snapshots} snapshots. `
      : "";
    const drawn = domain.framed ? "each place of a state in the world frame" : "each state";
    byId("taught").textContent = `${from}In the 3-D view ${drawn} is an ellipsoid of two standard deviations about its `
      + "mean, with half axes of at least 4 mm.";
    if (domain.framed) byId("brackets").textContent = "A required condition must hold. An undecided condition always "
      + "held, perhaps by chance: the planner meets it if that is possible.";
  }

  buildSettings() {
    const { run } = this.data;
    if (!run) throw new Error("the settings of the run are missing");
    byId("command").textContent = run.command;
    byId("made").textContent = `Written by symbolt ${run.symbolt}, seed ${run.seed}, mode ${run.mode}. `
      + "On the same machine the same command writes the same files, bit for bit.";
    shielded("figures", () => byId("figures").append(figuresTable(run.summary)));
    byId("all").textContent = JSON.stringify({ planner: run.planner, task: run.task, scene: run.scene }, null, 2);
  }

  buildControls() {
    const scrub = byId("scrub");
    if (!scrub) return;
    // In whole milliseconds.
    scrub.max = (Math.ceil(1000 * this.duration - 1e-3) / 1000).toFixed(3);
    scrub.addEventListener("input", () => { this.pause(); this.seek(Number(scrub.value)); });
    const on = (id, act) => byId(id)?.addEventListener("click", act);
    on("play", () => (this.playing ? this.pause() : this.play()));
    on("earlier", () => this.openDecision(-1));
    on("later", () => this.openDecision(1));
    byId("gaussians")?.addEventListener("change", (event) => this.replay?.showStates(event.target.checked));
    byId("names-shown")?.addEventListener("change", (event) => this.replay?.showLabels(event.target.checked));
    Object.keys(VIEWS).forEach((view) => on(`view-${view}`, () => this.chooseView(view)));
    on("nearer", () => this.timeline.zoom(0.5));
    on("farther", () => this.timeline.zoom(2));
    on("whole", () => this.timeline.look(0, this.duration));
  }

  chooseView(view) {
    this.replay?.choose(view);
    Object.keys(VIEWS).forEach((other) => byId(`view-${other}`)?.setAttribute("aria-pressed", String(other === view)));
  }

  play() {
    if (!byId("play")) return;
    if (this.time >= this.duration) this.seek(0);
    this.playing = true;
    byId("play").textContent = "Pause";
    byId("reading")?.setAttribute("aria-live", "off");
    // The span is wide enough to be read while the moment moves through it.
    const speed = () => Number(byId("speed").value);
    const wide = 8 * speed();
    const [from, to] = this.timeline?.view ?? [0, wide];
    if (to - from < wide) this.timeline.look(this.time - 0.1 * wide, this.time + 0.9 * wide);
    let before = performance.now();
    const step = (now) => {
      // When the browser itself has paused, the episode continues at the moment it had reached.
      this.seek(this.time + Math.min(Math.max(now - before, 0), 100) / 1000 * speed());
      before = now;
      if (this.time >= this.duration) this.pause();
      else this.next = requestAnimationFrame(step);
    };
    this.next = requestAnimationFrame(step);
  }

  pause() {
    this.playing = false;
    cancelAnimationFrame(this.next);
    if (byId("play")) byId("play").textContent = "Play";
    byId("reading")?.setAttribute("aria-live", "polite");
  }

  seek(time) {
    this.time = clamp(time, 0, this.duration);
    const scrub = byId("scrub");
    if (scrub) {
      scrub.value = this.time.toFixed(3);
      scrub.setAttribute("aria-valuetext", [seconds(this.time, 3), ...this.saysAt(this.time)].join(", "));
    }
    if (byId("clock")) byId("clock").textContent = `${seconds(this.time, 3)} of ${seconds(this.duration)}`;
    this.replay?.show(this.time);
    this.timeline?.at(this.time);
    if (byId("now")) this.showNow();
  }

  // The decision that is being made or carried out at a moment.
  current(time = this.time) {
    return this.acts.findLastIndex((act) => act.asked <= time);
  }

  // A moment in words: the decision and the part in the hand.
  saysAt(time) {
    const index = this.current(time);
    const act = this.acts[index];
    const held = this.heldAt(time);
    const hand = held === undefined ? [] : [`in the hand: ${this.partName(held)}`];
    if (!act) return ["no decision yet", ...hand];
    const name = `decision ${index + 1}`;
    if (time < act.decided) return [`${name}: deciding since ${seconds(act.asked, 3)}, takes ${act.took.toFixed(0)} ms`, ...hand];
    if (!act.action) return [`${name}: nothing to do`, ...hand];
    return [`${name}: ${act.action}, ${act.outcome} at ${seconds(act.until, 3)}`, ...hand];
  }

  showNow() {
    const index = this.current();
    const act = this.acts[index];
    this.decisionRows.forEach((row, i) => {
      row.classList.toggle("current", i === index);
      row.setAttribute("aria-current", String(i === index));
    });
    if (index !== this.shown) this.bringIntoBox(this.decisionRows[index]);
    this.shown = index;
    const end = this.events.find((line) => line.end)?.end;
    const entries = [];
    if (!act) {
      entries.push(["now", this.acts.length ? "looking at the scene" : "no decisions are known"]);
    } else if (this.time < act.decided) {
      entries.push(["now", `deciding, for ${((this.time - act.asked) * 1000).toFixed(0)} of ${act.took.toFixed(0)} ms`]);
    } else if (act.action) {
      const over = act.outcome && this.time >= act.until - 1e-6 ? `, ${act.outcome}` : "";
      entries.push(["now", `doing ${act.action}${over}`]);
      if (act.recovery) entries.push(["recovery", act.recovery]);
    } else {
      entries.push(["now", `done: ${endInWords(end, this.data.domain, this.reason(this.recorded))}`]);
    }
    if (act?.action && end && this.time >= this.duration - 1e-6) {
      entries.push(["at the end", endInWords(end, this.data.domain, this.reason(this.recorded))]);
    }
    const held = this.heldAt(this.time);
    entries.push(["in the hand", held === undefined ? "nothing" : this.partName(held)]);
    if (act) {
      entries.push(["states that hold", listed(act.holds)]);
      const operator = this.data.domain?.operators.find((o) => o.name === act.action);
      if (operator && this.time >= act.decided) {
        entries.push([`preconditions of ${act.action}`, listed(operator.preconditions)]);
        entries.push(["its effects", listed(operator.effects)]);
      }
    }
    entries.push(["goal", this.data.run?.goal ?? "unknown"]);
    byId("now").replaceChildren(...entries.flatMap(([name, text]) => [make("dt", name), make("dd", text)]));
  }

  // What the page shows, as data: for the tests.
  state() {
    const panels = this.timeline?.panels ?? [];
    const shown = panels.map((panel) => ({ module: panel.module?.name, names: panel.module?.names, values: panel.values(this.time) }));
    return {
      time: this.time, decision: this.current(), now: byId("now")?.innerText, module: shown[0]?.module,
      names: shown[0]?.names, sample: shown[0]?.values ?? [], shown, playing: this.playing,
      view: this.timeline?.view, places: this.replay?.places(),
    };
  }
}

