// The page of a run: replay, time axis, decisions and tables, all following one moment.

// What the modules on the way of a decision are for.
const MEANING = {
  goal_buffer: "The goal buffer holds the state that is looked into now. While it takes up the next one it is driven "
    + "there so hard that it overshoots: the last one shows as negative for some 50 ms.",
  cause: "The action that causes the state in the goal buffer.",
  unbind: "That action's preconditions, as they are unbound from its deep pointer: with the noise of what else is in it.",
  required: "The preconditions, cleaned up.",
  open: "Which of these do not hold and have not been looked into.",
  chosen: "The one of these that is looked into next.",
  motor_gate: "What comes through to the motors once the planner commits.",
  motor: "The action that is done.",
};

// How an episode came to its end, in words; states and actions by the domain's names.
function endInWords(end, domain) {
  if (!end) return "how it ended is not known";
  const [kind, detail] = typeof end.ended === "object" ? Object.entries(end.ended)[0] : [end.ended, null];
  const action = detail?.action ?? "an action";
  const words = {
    GoalMet: "the goal holds",
    Stuck: "the goal cannot be had",
    NoWay: `no part could be taken and put as ${action} wants`,
    Occupied: `something lies where ${action} puts its part`,
    GaveUp: "time or skills were used up",
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
    MustBeAbsent: `${state} must be absent before ${action}, and holds`,
    NeedsItself: `${state} is needed to bring itself about`,
  };
  return `: ${words[kind] ?? inWords(obstacle)}`;
}

class RunPage {
  constructor(data, main) {
    this.data = data;
    main.append(byId("run-page").content.cloneNode(true));
    this.recorded = data.filmed;
    this.events = (data.events ?? []).filter((line) => line.episode === this.recorded);
    this.frames = this.unpackFrames();
    this.acts = this.decisionsAndActs();
    const ends = [this.frames.t.at(-1), ...this.acts.map((act) => act.until), this.times().at(-1), 0.1];
    this.duration = Math.max(...ends.filter(Number.isFinite));
    this.time = 0;
    this.playing = false;
    this.decisionRows = [];
    const { episodes = 1 } = data.run?.summary ?? {};
    if (this.recorded === null) byId("episode").textContent = "An episode; which is not known";
    else if (episodes > 1) byId("episode").textContent = `Episode ${this.recorded + 1} of ${episodes}`;
    shielded("replay", () => this.buildReplay());
    shielded("timeline", () => this.buildTimeline());
    shielded("decisions", () => this.buildDecisions());
    shielded("learned", () => this.buildLearned());
    shielded("settings", () => this.buildSettings());
    this.buildControls();
    this.seek(0);
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

  // Every decision of the recorded episode, with the action that came of it and until when it was done.
  decisionsAndActs() {
    const decisions = this.events.flatMap((line) => line.decision ?? []);
    const end = this.events.flatMap((line) => line.end ?? [])[0];
    const last = end?.simulated_s ?? this.frames.t.at(-1) ?? 0;
    return decisions.map((decision, i) => {
      const outcome = decision.begun ? decision.skill?.outcome ?? "cut short" : "not begun";
      const decided = decision.asked_s + decision.took_ms / 1000;
      return {
        asked: decision.asked_s, decided, holds: decision.holds, action: decision.action,
        until: decisions[i + 1]?.asked_s ?? Math.max(last, decided), outcome: decision.action ? outcome : null,
        took: decision.took_ms,
      };
    });
  }

  buildReplay() {
    const view = document.querySelector("#replay .view");
    const { outline, domain } = this.data;
    if (!outline || this.frames.count === 0) {
      view.replaceChildren(make("p", "There is nothing to replay: the frames or the scene's shapes are missing."));
      return;
    }
    try {
      this.replay = new Replay(view, outline, this.frames, domain?.states ?? []);
    } catch (error) {
      view.replaceChildren(make("p", `This browser draws nothing in three dimensions (${error.message}).`));
    }
  }

  buildTimeline() {
    const { run, arrays } = this.data;
    const known = new Map((run?.modules ?? []).map((module) => [module.name, module]));
    const order = [...known.keys()];
    const modules = (arrays?.modules.of ?? [])
      .filter(({ name }) => known.has(name))
      .sort((a, b) => order.indexOf(a.name) - order.indexOf(b.name))
      .map(({ name, steps, values }) => {
        const numbers = Float32Array.from(small(values), (v) => v / steps);
        const [low, high] = numbers.reduce(([low, high], v) => [Math.min(low, v), Math.max(high, v)], [-0.05, 1.05]);
        return { ...known.get(name), values: numbers, range: [low - 0.05, high + 0.05] };
      });
    const populations = run?.populations ?? [];
    const spikes = { t: singles(arrays?.spikes.t ?? ""), row: singles(arrays?.spikes.row ?? "") };
    const touches = this.events.flatMap((line) => line.touch ?? [])
      .map((touch) => ({ ...touch, name: this.partName(touch.part) }));
    const content = {
      duration: this.duration, acts: this.acts, touches, times: this.times(), modules, spikes, populations,
      rows: spikes.t.length ? populations.reduce((sum, p) => sum + p.rows, 0) : 0,
    };
    this.timeline = new Timeline(document.querySelector("#timeline canvas"), content, (time) => this.seek(time));
    byId("thinking").textContent = [
      `Goal: ${run?.goal ?? "unknown"}.`,
      "Lines are the chosen module's numbers; modules are looked at every 2 ms while the graph decides, every 40 ms while the robot acts.",
      content.rows ? "Below, spikes of some neurons of each population, kept while the graph decides." : "",
    ].join(" ");
    const select = byId("module");
    modules.forEach((module, i) => select.append(new Option(module.name, String(i))));
    select.addEventListener("change", () => this.chooseModule(Number(select.value)));
    this.chooseModule(0);
    const first = this.acts[0];
    if (first) this.timeline.look(0, Math.min(this.duration, first.decided + 0.1));
  }

  chooseModule(index) {
    this.timeline.chosen = index;
    byId("meaning").textContent = MEANING[this.timeline.content.modules[index]?.name] ?? "";
    const names = this.timeline.content.modules[index]?.names ?? [];
    const boxes = names.map((name, i) => {
      const box = make("input");
      box.type = "checkbox";
      box.checked = !this.timeline.hidden.has(name);
      box.addEventListener("change", () => {
        if (box.checked) this.timeline.hidden.delete(name);
        else this.timeline.hidden.add(name);
        this.timeline.draw();
      });
      const line = make("i");
      line.style.background = colour(i);
      return make("label", null, box, line, name);
    });
    byId("names").replaceChildren(...boxes);
    this.timeline.draw();
  }

  buildDecisions() {
    const all = (this.data.events ?? []).filter((line) => line.decision);
    const many = all.some((line) => line.episode > 0);
    const operators = new Map((this.data.domain?.operators ?? []).map((o) => [o.name, o]));
    const needs = (action) => listed(operators.get(action)?.preconditions);
    const ends = new Map((this.data.events ?? []).filter((line) => line.end).map((line) => [line.episode, line.end]));
    const rows = all.map(({ episode, decision }, i) => {
      const last = all[i + 1]?.episode !== episode;
      const how = endInWords(ends.get(episode), this.data.domain);
      const outcome = decision.begun ? decision.skill?.outcome ?? "cut short" : last ? how : "not begun";
      return [
        ...(many ? [String(episode + 1)] : []), decision.asked_s.toFixed(2), decision.took_ms.toFixed(0),
        listed(decision.holds), decision.action ?? "nothing", decision.action ? needs(decision.action) : "–", outcome,
      ];
    });
    const columns = [">asked at, s", ">took, ms", "holds", "decided", "which needs", "outcome"];
    const grid = table([...(many ? [">episode"] : []), ...columns], rows);
    const of = many ? ` of episode ${this.recorded + 1}, marked at the left,` : "";
    const others = many ? "; the others were not recorded (the option --record-episode chooses)" : "";
    byId("clicking").textContent = this.recorded === null
      ? "Which episode was recorded is not known."
      : `Click one${of} to go to its moment${others}.`;
    grid.querySelectorAll("tbody tr").forEach((row, i) => {
      if (all[i].episode !== this.recorded) return;
      const act = this.acts[this.decisionRows.length];
      this.decisionRows.push(row);
      pressable(row, () => {
        this.pause();
        this.timeline.look(act.asked - 0.05, act.decided + 0.1);
        this.seek(act.asked);
        byId("replay").scrollIntoView({ behavior: "smooth" });
      });
    });
    const box = document.querySelector("#decisions .scroll");
    box.classList.toggle("long", all.length > 24);
    box.append(grid);
    this.bringIntoBox(this.decisionRows[0]);
  }

  // Scrolls the table of decisions, and not the page, to one of its rows.
  bringIntoBox(row) {
    const box = document.querySelector("#decisions .scroll");
    if (!row || !box.classList.contains("long")) return;
    box.scrollTop += row.getBoundingClientRect().top - box.getBoundingClientRect().top - box.clientHeight / 3;
  }

  buildLearned() {
    const { domain, recording } = this.data;
    if (!domain) throw new Error("the learned domain is missing");
    byId("states").append(statesTable(domain));
    byId("operators").append(operatorsTable(domain));
    const from = recording
      ? `From ${recording.demonstrations} demonstrations with ${recording.snapshots} snapshots. `
      : "";
    byId("taught").textContent = `${from}In the replay each is the ellipsoid of two standard deviations about its mean, `
      + "at least 4 mm.";
  }

  buildSettings() {
    const { run } = this.data;
    if (!run) throw new Error("the run's settings are missing");
    byId("command").textContent = run.command;
    byId("made").textContent = `Made by symbolt ${run.symbolt}, seed ${run.seed}, mode ${run.mode}. `
      + "The same command writes the same files, to the bit, on the same machine.";
    shielded("figures", () => byId("figures").append(figuresTable(run.summary)));
    byId("all").textContent = JSON.stringify({ planner: run.planner, task: run.task, scene: run.scene }, null, 2);
  }

  buildControls() {
    const scrub = byId("scrub");
    if (!scrub) return;
    scrub.max = String(this.duration);
    scrub.step = "any";
    scrub.addEventListener("input", () => { this.pause(); this.seek(Number(scrub.value)); });
    byId("play")?.addEventListener("click", () => (this.playing ? this.pause() : this.play()));
    byId("gaussians")?.addEventListener("change", (event) => this.replay?.showStates(event.target.checked));
    byId("camera")?.addEventListener("click", () => this.replay?.resetCamera());
    byId("nearer")?.addEventListener("click", () => this.timeline.zoom(0.5));
    byId("farther")?.addEventListener("click", () => this.timeline.zoom(2));
    byId("whole")?.addEventListener("click", () => this.timeline.look(0, this.duration));
  }

  play() {
    if (this.time >= this.duration) this.seek(0);
    this.playing = true;
    byId("play").textContent = "Pause";
    // Wide enough to be read while it goes by.
    const speed = () => Number(byId("speed").value);
    const wide = 8 * speed();
    const [from, to] = this.timeline.view;
    if (to - from < wide) this.timeline.look(this.time - 0.1 * wide, this.time + 0.9 * wide);
    let before = performance.now();
    const step = (now) => {
      // After a pause of the browser's own it goes on from where it was.
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
    byId("play").textContent = "Play";
  }

  seek(time) {
    this.time = clamp(time, 0, this.duration);
    if (byId("scrub")) byId("scrub").value = String(this.time);
    if (byId("clock")) byId("clock").textContent = `${seconds(this.time)} of ${seconds(this.duration)}`;
    this.replay?.show(this.time);
    this.timeline?.at(this.time);
    if (byId("now")) this.showNow();
  }

  // The decision that is being made or acted upon.
  current() {
    return this.acts.findLastIndex((act) => act.asked <= this.time);
  }

  showNow() {
    const index = this.current();
    const act = this.acts[index];
    this.decisionRows.forEach((row, i) => row.classList.toggle("current", i === index));
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
    } else {
      entries.push(["now", `done: ${endInWords(end, this.data.domain)}`]);
    }
    if (act?.action && end && this.time >= this.duration - 1e-6) {
      entries.push(["in the end", endInWords(end, this.data.domain)]);
    }
    if (act) {
      entries.push(["holds", listed(act.holds)]);
      const operator = this.data.domain?.operators.find((o) => o.name === act.action);
      if (operator && this.time >= act.decided) {
        entries.push([`${act.action} needs`, listed(operator.preconditions)]);
        entries.push(["and brings about", listed(operator.effects)]);
      }
    }
    entries.push(["goal", this.data.run?.goal ?? "unknown"]);
    byId("now").replaceChildren(...entries.flatMap(([name, text]) => [make("dt", name), make("dd", text)]));
  }

  // What the page shows, as data: for tests.
  state() {
    const { content, chosen } = this.timeline;
    const module = content.modules[chosen];
    const sample = Math.max(countUpTo(content.times, this.time) - 1, 0);
    const columns = module?.names.length ?? 0;
    return {
      time: this.time, decision: this.current(), now: byId("now").innerText, module: module?.name,
      names: module?.names, sample: Array.from(module?.values.slice(sample * columns, (sample + 1) * columns) ?? []),
      view: this.timeline.view, places: this.replay?.places(),
    };
  }
}

