// The page of a run: one episode at a time, with everything on the page at the same moment.

// The number of moments at which the panel beside the picture is measured.
const MOMENTS_FITTED = 60;

class RunPage {
  constructor(data, main) {
    this.data = data;
    this.names = new Names(data.run, data.domain);
    main.append(byId("run-page").content.cloneNode(true));
    this.time = 0;
    this.playing = false;
    this.episode = new Episode(data, data.filmed, this.names);
    shielded("timeline", () => { this.thinking = new Thinking(this); });
    shielded("learned", () => this.buildLearned());
    shielded("settings", () => this.buildSettings());
    shielded("episodes", () => this.buildEpisodes());
    this.buildControls();
    listenToKeys(this);
    this.show();
    const beside = document.querySelector(".beside");
    // The section may have been replaced by what went wrong in it.
    if (!beside) return;
    let width = beside.clientWidth;
    new ResizeObserver(() => {
      if (beside.clientWidth === width) return;
      width = beside.clientWidth;
      this.fitNow();
    }).observe(beside);
  }

  get acts() { return this.episode.acts; }

  get frames() { return this.episode.frames; }

  get duration() { return this.episode.duration; }

  get timeline() { return this.thinking?.timeline; }

  // Shows another episode from its beginning.
  choose(number) {
    this.pause();
    this.episode = new Episode(this.data, number, this.names);
    this.show();
    byId("replay").scrollIntoView();
  }

  // Fills all parts of the page with the chosen episode.
  show() {
    const { episode, data } = this;
    const { episodes = 1 } = data.run?.summary ?? {};
    byId("episode").textContent = episode.number === null
      ? "An episode of unknown number" : episodes > 1 ? `Episode ${episode.number + 1} of ${episodes}` : "The episode";
    for (const [number, button] of this.buttons ?? []) button.setAttribute("aria-pressed", String(number === episode.number));
    shielded("replay", () => this.showFilm());
    this.thinking?.show(episode);
    shielded("decisions", () => this.showDecisions());
    shielded("failures", () => showFailures(byId("failures"), episode, this.replay, (time) => this.goTo(time)));
    shielded("story", () => showStory(byId("story").querySelector("ol"), data, episode));
    const scrub = byId("scrub");
    // In whole milliseconds.
    if (scrub) scrub.max = (Math.ceil(1000 * this.duration - 1e-3) / 1000).toFixed(3);
    this.fitNow();
    this.seek(0);
  }

  // Shows the film of the episode, or says why there is none.
  showFilm() {
    const { film, frames } = this.episode;
    const view = document.querySelector("#replay .view");
    const { outline, domain, films } = this.data;
    const there = frames.count > 0;
    byId("unfilmed").hidden = there || !this.replay;
    byId("unfilmed").textContent = `This page has no pictures of this episode. The option --record-episode ${(this.episode.number ?? 0) + 1} makes them.`;
    if (!outline || !(films ?? []).some((other) => other.frames.count > 0)) {
      view.replaceChildren(make("p", "There is nothing to replay: the frames or the shapes of the scene are missing."));
      return;
    }
    view.hidden = !there && Boolean(this.replay);
    if (!there || this.undrawable) return;
    const shown = [withMeshes(outline, film.outline), frames, domain?.drawn ?? [], film.objects];
    if (this.replay) {
      this.replay.load(...shown);
      return;
    }
    try {
      this.replay = new Replay(view, ...shown, this.names);
      this.replay.held = () => this.episode.heldAt(this.time);
      this.replay.aim = () => this.acts[this.episode.at(this.time)]?.chosen?.target?.position;
      this.replay.named = (part) => this.episode.part(part);
    } catch (error) {
      this.undrawable = true;
      view.replaceChildren(make("p", `This browser cannot draw the 3-D view (${error.message}).`));
    }
  }

  chooseModule(index) {
    this.thinking.choose(index);
  }

  buildEpisodes() {
    const { grid, buttons } = episodesList(this.data, (number) => this.choose(number));
    this.buttons = buttons;
    byId("episodes").hidden = buttons.size < 2;
    byId("episode-list").append(grid);
  }

  showDecisions() {
    const { grid, rows } = decisionsTable(this.episode, (act) => {
      this.open(act);
      byId("replay").scrollIntoView({ behavior: "smooth" });
    });
    this.decisionRows = rows;
    this.shown = undefined;
    const box = document.querySelector("#decisions .scroll");
    box.classList.toggle("long", rows.length > 12);
    box.replaceChildren(rows.length ? grid : make("p", "No decisions of this episode are on this page."));
  }

  // Goes to a decision and shows it closely.
  open(act) {
    this.pause();
    this.timeline?.look(act.asked - 0.05, act.decided + 0.1);
    this.seek(act.asked);
  }

  goTo(time) {
    this.pause();
    this.seek(time);
    byId("replay").scrollIntoView({ behavior: "smooth" });
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
    byId("states").append(statesTable(domain, this.names));
    byId("operators").append(operatorsTable(domain, this.names));
    byId("taught").textContent = `${recording ? `Learned from ${plural(recording.demonstrations, "demonstration")} with `
      + `${plural(recording.snapshots, "snapshot")}. ` : ""}The 3-D view shows where an object must lie to be in a state, at `
      + "least 8 mm wide: a place as an ellipsoid, and an area as a sheet. An area of the table is as large as the demonstrations showed it; what lies "
      + "beyond is in it as well, if it lies as high and as upright. A place of the goal has a ring.";
  }

  buildSettings() {
    const { run } = this.data;
    if (!run) throw new Error("the settings of the run are missing");
    byId("command").textContent = run.command;
    byId("made").textContent = `Written by symbolt ${run.symbolt}, seed ${run.seed}, mode ${run.mode}. `
      + "On the same machine the same command writes the same files, bit for bit.";
    shielded("figures", () => byId("figures").append(figuresTable(run.summary)));
    shielded("all", () => this.buildAllSettings());
  }

  // Those that differ from the default stand open; the others are made when they are first unfolded.
  buildAllSettings() {
    const { run, defaults } = this.data;
    const [own, usual] = [{ planner: run.planner, scene: run.scene }, defaults ?? {}].map((all) => new Map(settingsOf(all)));
    const known = (name) => Boolean(name.startsWith("planner.") ? defaults?.planner : defaults?.scene);
    const names = [...new Set([...own.keys(), ...usual.keys()])];
    const changed = names.filter((name) => known(name) && own.get(name) !== usual.get(name)).map((name) => [name, own.get(name) ?? "–"]);
    byId("changed").hidden = changed.length === 0;
    byId("changed").append(table(["setting", "in this run", "default"], changed.map(([name, value]) => [name, value, usual.get(name) ?? "–"])));
    const usualOnes = defaults?.scene ? "The planner and the scene have their defaults." : "The planner has its defaults.";
    byId("made").append(changed.length ? " These settings differ from the default:" : ` ${usualOnes}`);
    const others = byId("others");
    others.addEventListener("toggle", () => {
      const rest = [...own].filter(([name]) => !changed.some(([other]) => other === name));
      byId("all").replaceChildren(table(["setting", "value"], rest));
    }, { once: true });
  }

  buildControls() {
    const scrub = byId("scrub");
    if (!scrub) return;
    scrub.addEventListener("input", () => { this.pause(); this.seek(Number(scrub.value)); });
    const on = (id, act) => byId(id)?.addEventListener("click", act);
    on("play", () => (this.playing ? this.pause() : this.play()));
    on("earlier", () => this.openDecision(-1));
    on("later", () => this.openDecision(1));
    byId("gaussians")?.addEventListener("change", (event) => this.replay?.showStates(event.target.checked));
    byId("names-shown")?.addEventListener("change", (event) => this.replay?.showLabels(event.target.checked));
    byId("facts").addEventListener("toggle", () => this.showFacts());
    Object.keys(VIEWS).forEach((view) => on(`view-${view}`, () => this.chooseView(view)));
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
    if (this.frames.count > 0) this.replay?.show(this.time);
    this.timeline?.at(this.time);
    if (byId("now")) this.showNow();
  }

  // A moment in words: the decision and the part in the hand.
  saysAt(time) {
    const { episode } = this;
    const index = episode.at(time);
    const act = episode.acts[index];
    const held = episode.heldAt(time);
    const hand = held === undefined ? [] : [`in the hand: ${episode.part(held)}`];
    if (!act) return ["no decision yet", ...hand];
    const name = act.step ? `step ${act.step}` : "decision";
    if (time < act.decided) return [`${name}: deciding since ${seconds(act.asked, 3)}, takes ${act.took.toFixed(0)} ms`, ...hand];
    if (!act.action) return [`${name}: nothing to do`, ...hand];
    return [`${name}: ${act.words}, ${act.came}; it ended at ${seconds(act.until, 3)}`, ...hand];
  }

  showNow() {
    const index = this.episode.at(this.time);
    if (index !== this.shown) {
      this.decisionRows?.forEach((row, i) => {
        row.classList.toggle("current", i === index);
        row.setAttribute("aria-current", String(i === index));
      });
      this.bringIntoBox(this.decisionRows?.[index]);
      this.shown = index;
      this.showFacts();
    }
    showNow(byId("now"), nowEntries(this.episode, this.time, this.goalWords));
  }

  // Gives the panel the height of the fullest of the moments that are measured. A fuller one scrolls.
  fitNow() {
    const box = byId("now");
    if (!box) return;
    const { acts, displaced, duration } = this.episode;
    const all = [0, duration, ...displaced.flatMap(({ t }) => [t, t + TOLD_S / 2, t + TOLD_S - 0.01]), ...acts.flatMap(({ asked, decided, until }) => [asked, (decided + until) / 2, until])];
    const every = Math.ceil(all.length / MOMENTS_FITTED);
    box.style.height = "auto";
    const heights = all.filter((_, i) => i % every === 0).map((time) => {
      showNow(box, nowEntries(this.episode, time, this.goalWords));
      return Math.ceil(box.getBoundingClientRect().height);
    });
    box.style.height = `${heights.reduce((most, height) => Math.max(most, height), 0)}px`;
    showNow(box, nowEntries(this.episode, this.time, this.goalWords));
  }

  get goalWords() {
    return this.data.run?.goal_words ?? this.data.run?.goal;
  }

  showFacts() {
    if (byId("facts").open) showFacts(byId("facts").querySelector("ul"), this.episode, this.time);
  }

  // What the page shows, as data: for the tests.
  state() {
    const panels = this.timeline?.panels ?? [];
    const shown = panels.map((panel) => ({ module: panel.module?.name, names: panel.module?.names, values: panel.values(this.time) }));
    return {
      time: this.time, decision: this.episode.at(this.time), now: byId("now")?.innerText, module: shown[0]?.module,
      names: shown[0]?.names, sample: shown[0]?.values ?? [], shown, playing: this.playing,
      view: this.timeline?.view, places: this.frames.count > 0 ? this.replay?.places() : undefined,
    };
  }
}

// The shapes of a scene in which some bodies stand elsewhere than in the recorded episode's.
function withMeshes(outline, others) {
  if (!others?.length) return outline;
  const key = ({ body }) => JSON.stringify(body);
  const changed = new Map(others.map((mesh) => [key(mesh), mesh]));
  return { ...outline, meshes: outline.meshes.map((mesh) => changed.get(key(mesh)) ?? mesh) };
}
