// The page of a live run: what comes from the run is kept, and drawn at most once a picture.

import { session } from "./session.js";

const counted = (count) => (count === 1 ? "1 change" : `${count} changes`);

class LivePage {
  constructor() {
    Object.assign(this, { frame: null, scene: null, dirty: false });
    this.session = session;
    this.plots = new Plots(byId("plots"), this.session);
    this.touch = new Touch(this.session, this.plots);
    this.network = new Network(document.querySelector("#network .drawing"), (path) => this.choose(path));
    this.listen();
    session.listen({
      hello: (hello) => this.begin(hello), frame: (frame) => this.take(frame), standing: (standing) => this.stand(standing),
      events: (events) => this.list(events), log: (log) => this.log(log), branches: (branches) => this.branch(branches), refused: (why, answer) => this.refuse(why, answer?.plot), plotted: (plotted) => this.plots.begun(plotted),
      sent: () => this.refusal(""), saved: (text) => download("interventions.jsonl", "application/jsonl", text), closed: (why) => this.closed(why),
    });
  }

  listen() {
    const { session, network } = this;
    const on = (id, act) => byId(id).addEventListener("click", act);
    byId("theme").addEventListener("change", (event) => theme.choose(event.target.value));
    theme.listeners.push(() => this.draw());
    on("play", () => this.play());
    on("until", () => session.send("until"));
    byId("tick").addEventListener("change", ({ target }) => {
      const tick = target.value.trim() === "" ? NaN : Number(target.value);
      if (Number.isInteger(tick) && tick >= 0) session.send("seek", { tick });
      target.value = "";
    });
    on("save", () => session.send("log"));
    on("forget", () => session.send("forget"));
    on("end", () => { if (confirm("End the run for all windows?")) session.send("end"); });
    on("nearer", () => network.zoom(1 / 1.25));
    on("farther", () => network.zoom(1.25));
    on("fold", () => network.foldAll());
    on("read", () => {
      const name = byId("reading").value;
      this.plots.add(name, { reading: { name } });
    });
    on("energy", () => this.plots.addEnergy());
    byId("speed").addEventListener("change", () => { if (this.frame?.mode === 1) this.run(); });
    byId("last").addEventListener("change", () => this.draw());
    byId("search").addEventListener("change", (event) => this.search(event.target.value));
    for (const name of ["step", "back"]) {
      document.querySelectorAll(`[data-${name}]`).forEach((button) => button.addEventListener("click", () => this.by(name, Number(button.dataset[name]))));
    }
    addEventListener("keydown", (event) => this.key(event));
    new ResizeObserver(() => this.draw()).observe(byId("plots"));
  }

  key(event) {
    const pressed = event.target.closest?.("button") && (event.key === " " || event.key === "Enter");
    const typing = pressed || event.target.closest?.("input, select, textarea, canvas");
    if (event.ctrlKey || event.metaKey || event.altKey || typing) return;
    const many = event.shiftKey ? 10 : 1;
    const acts = {
      " ": () => this.play(), ArrowRight: () => this.by("step", many), ArrowLeft: () => this.by("back", many),
      n: () => this.session.send("until"), "/": () => byId("search").focus(),
    };
    const act = acts[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act || (this.hello?.read_only && event.key !== "/")) return;
    event.preventDefault();
    act();
  }

  play() {
    if (this.frame?.mode === 1) this.session.send("pause");
    else this.run();
  }

  run() {
    const speed = byId("speed").value;
    this.session.send("run", speed === "" ? {} : { speed: Number(speed) });
  }

  by(name, ticks) {
    if (name === "step") this.session.send(name, { ticks });
    // Near the start it goes back as far as it can. A run that failed in its first tick goes back to where it stands.
    else if (this.canGoBack()) this.session.send("seek", { tick: Math.max(this.frame.tick - ticks, this.frame.earliest) });
  }

  canGoBack() {
    return this.frame !== null && (this.frame.tick > this.frame.earliest || Boolean(this.halted));
  }

  begin(hello) {
    this.hello = hello;
    const { graph, pointers, readings, scene } = hello;
    byId("title").textContent = `symbolt view: ${hello.title}`;
    document.title = byId("title").textContent;
    const neurons = graph.nodes.reduce((sum, node) => sum + node.neurons, 0);
    byId("summary").textContent = `${graph.nodes.length} nodes, ${graph.edges.length} connections, ${neurons} spiking neurons, ticks of `
      + `${shortNumber(1000 * graph.dt_s)} ms.${hello.read_only ? " Read-only: the run can be watched, not changed." : ""}`;
    const changing = "#bar button, #bar input, #bar select, #changes button, #clamp, #set, #end, #forget, #grab, #move, #remove";
    document.querySelectorAll(changing).forEach((button) => { button.disabled = hello.read_only; });
    Object.keys(NOTES).forEach((path) => delete NOTES[path]);
    Object.assign(NOTES, graph.notes);
    this.network.begin(graph);
    this.touch.begin(graph, pointers);
    byId("offered").hidden = readings.length === 0;
    byId("reading").replaceChildren(...readings.map((name) => make("option", name)));
    this.modules = new Set(graph.nodes.flatMap(({ path }) => around(path)));
    const outputs = graph.nodes.flatMap((node) => node.outputs.map(({ name }) => name));
    byId("found").replaceChildren(...[...this.modules, ...outputs].slice(0, 2000).map((path) => new Option(nameOf(path), path)));
    byId("scene").hidden = !scene;
    if (scene && !this.scene) this.scene = new LiveScene(byId("scene"), scene, this.session);
    byId("until").hidden = !hello.events;
    byId("energy").hidden = neurons === 0;
    byId("events").hidden = !hello.listed;
    this.plots.again();
    document.documentElement.dataset.ready = "yes";
  }

  search(text) {
    const output = this.hello.graph.nodes.flatMap((node) => node.outputs.map(({ name }) => [name, node.path])).find(([name]) => name === text);
    // A module may be meant by its name in words, or by one of its outputs' other names.
    const inWords = () => [...this.modules].find((path) => [nameOf(path), partOf(path)].some((name) => name.toLowerCase() === text.trim().toLowerCase()));
    const path = output?.[1] ?? [text, text.split(".")[0]].find((name) => this.modules.has(name)) ?? inWords();
    if (!path) {
      if (text !== "") this.refuse("nothing has this name");
      return;
    }
    this.refusal("");
    this.network.find(path);
    this.choose(path);
    if (output) {
      byId("output").value = text;
      this.touch.showOutput();
    }
  }

  choose(path) {
    this.network.chosen = path;
    this.network.mark();
    this.touch.show(path);
  }

  take(frame) {
    this.wentBack = this.frame !== null && frame.epoch !== this.frame.epoch;
    this.frame = frame;
    this.plots.take(frame, this.wentBack);
    this.scene?.take(frame);
    this.draw();
  }

  draw() {
    if (this.dirty) return;
    this.dirty = true;
    requestAnimationFrame(() => {
      this.dirty = false;
      if (this.frame && this.hello) this.show();
    });
  }

  show() {
    const { frame, hello } = this;
    byId("play").textContent = frame.mode === 1 ? "Pause" : "Play";
    const energy = Number.isNaN(frame.spikes) ? "" : ` · ${shortNumber(frame.spikes)} spikes/s · ${shortNumber(frame.arrivals)} synaptic events/s`;
    const ahead = frame.ahead > 0 ? ` · ${counted(frame.ahead)} ahead` : "";
    const speed = frame.mode === 1 ? ` · ${shortNumber(frame.speed)} × real time` : "";
    byId("clock").textContent = `tick ${frame.tick} · ${seconds(frame.time, 3)}${speed}${energy}${ahead}`;
    byId("forget").hidden = frame.ahead === 0;
    byId("reach").hidden = frame.earliest === 0;
    byId("reach").textContent = `The run can go back to tick ${frame.earliest} at the earliest.`;
    this.network.show(frame);
    this.plots.show(hello.graph.dt_s, frame.tick, Number(byId("last").value));
    this.scene?.show();
    document.querySelectorAll("[data-back]").forEach((button) => { button.disabled = hello.read_only || !this.canGoBack(); });
  }

  stand({ doing, halted, faults }) {
    this.halted = halted;
    const back = this.hello?.read_only ? "" : " Go back to go on.";
    byId("said").textContent = [halted ? `Stopped: ${halted}.${back}` : doing, ...faults.map((fault) => `Warning: ${fault}.`)].join(" ");
    this.draw();
  }

  // The latest event first.
  list(events) {
    byId("events").querySelector("ul").replaceChildren(...events.toReversed().map((text) => make("li", text)));
  }

  log({ count, last }) {
    const rows = last.map((entry) => {
      const tick = make("td", String(entry.tick));
      tick.className = "number";
      const change = make("td", changeInWords(entry.do));
      change.title = entry.do;
      return make("tr", null, tick, change);
    });
    document.querySelector("#log tbody").replaceChildren(...rows.reverse());
    const all = count > last.length ? ` The last ${last.length} are shown.` : "";
    byId("counted").textContent = count === 0 ? "Nothing was changed." : `${counted(count)} in the log.${all}`;
    // What is clamped or silenced, as far as the page knows the log.
    const held = new Set();
    for (const { do: text } of last) {
      let what = {};
      try { what = JSON.parse(text); } catch { /* A long entry is cut. */ }
      const at = what.silence?.at ?? what.clamp?.output ?? text.match(/^\{"clamp":\{"output":"([^"]+)"/)?.[1];
      if (at) held.add(at);
      if (what.release) held.forEach((one) => { if (one === what.release.at || one.startsWith(`${what.release.at}/`) || one.startsWith(`${what.release.at}.`)) held.delete(one); });
    }
    this.network.held = held;
    if (this.hello) this.network.mark();
  }

  branch(branches) {
    this.plots.branch(branches);
    byId("branches").hidden = branches.all.length === 0;
    byId("branches").querySelector("ul").replaceChildren(...branches.all.map(({ id, parted, end, changes }) => {
      const go = make("button", `Go to branch ${id}`);
      go.type = "button";
      go.disabled = Boolean(this.hello?.read_only);
      go.addEventListener("click", () => this.session.send("branch", { id }));
      return make("li", null, go, ` parts from this run at tick ${parted} and ends at tick ${end}, with ${counted(changes)}`);
    }));
    this.draw();
  }

  // Says what was refused, until the next command.
  refusal(text) {
    byId("refusal").textContent = text;
  }

  refuse(why, plot) {
    if (plot !== undefined && plot !== null) this.plots.refused(plot);
    this.refusal(`Not possible: ${why}`);
  }

  closed(why) {
    this.refusal(`${capital(why)}.`);
    document.querySelectorAll("#bar button, #bar input, #touch button, #log button").forEach((button) => { button.disabled = true; });
  }
}

// For the tests of the page.
window.symbolt = { page: new LivePage() };
