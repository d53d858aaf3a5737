// The section on the planner: the time axis with the modules that the reader chooses, and the values in words.

// Modules as the strips draw them, in the order of `run.json`.
function unpackModules(run, arrays) {
  const known = new Map((run?.modules ?? []).map((module) => [module.name, module]));
  const order = [...known.keys()];
  return (arrays?.modules.of ?? [])
    .filter(({ name }) => known.has(name))
    .sort((a, b) => order.indexOf(a.name) - order.indexOf(b.name))
    .map(({ name, steps, values }) => {
      const numbers = Float32Array.from(small(values), (v) => v / steps);
      const [low, high] = numbers.reduce(([low, high], v) => [Math.min(low, v), Math.max(high, v)], [-0.05, 1.05]);
      return { ...known.get(name), values: numbers, range: [low - 0.05, high + 0.05] };
    });
}

class Thinking {
  constructor(page) {
    const { run, arrays } = page.data;
    const populations = run?.populations ?? [];
    const spikes = { t: singles(arrays?.spikes.t ?? ""), row: singles(arrays?.spikes.row ?? "") };
    const touches = page.touches.map((touch) => ({ ...touch, name: page.partName(touch.part) }));
    this.content = {
      duration: page.duration, acts: page.acts, touches, times: page.times(), modules: unpackModules(run, arrays),
      spikes, populations, rows: spikes.t.length ? populations.reduce((sum, p) => sum + p.rows, 0) : 0,
      says: (time) => page.saysAt(time), valued: () => this.showValues(),
    };
    this.timeline = new Timeline(byId("strips"), this.content, (time) => page.seek(time));
    byId("thinking").textContent = [
      `Goal: ${run?.goal ?? "unknown"}.`,
      "Each panel shows the values of one module: one sample every 2 ms while the planner decides, every 40 ms while the robot acts.",
      this.content.rows ? "The spikes at the bottom are from a few neurons of each population, kept while the planner decides." : "",
    ].join(" ");
    this.heads = new Map();
    const { modules } = this.content;
    modules.slice(0, 2).forEach((_, i) => this.add(i));
    if (modules.length === 0) this.add(0);
    theme.listeners.push(() => this.refresh());
    byId("more").addEventListener("click", () => this.addNext().focus());
    const [first] = page.acts;
    if (first) this.timeline.look(0, Math.min(page.duration, first.decided + 0.1));
  }

  addNext() {
    const shown = new Set(this.timeline.panels.map(({ chosen }) => chosen));
    const next = this.content.modules.findIndex((_, i) => !shown.has(i));
    return this.add(Math.max(next, 0));
  }

  // Adds a panel with its head: the module's selector, and the names with their values. Returns the selector.
  add(index) {
    const panel = this.timeline.addPanel(index);
    const select = make("select", null, ...this.content.modules.map(({ name }, i) => new Option(name, String(i))));
    if (this.heads.size === 0) select.id = "module";
    select.value = String(index);
    select.addEventListener("change", () => this.choose(Number(select.value), panel));
    const remove = make("button", "Remove");
    remove.type = "button";
    remove.setAttribute("aria-label", "Remove this module");
    const head = {
      select, remove, names: make("span"), meaning: make("p"), outputs: [],
      box: make("div", null, make("label", "Module ", select), remove),
    };
    head.box.className = "controls";
    head.names.className = "names";
    head.meaning.className = "note";
    const whole = make("div", null, head.box, head.meaning, head.names, panel.box);
    whole.className = "panel";
    remove.addEventListener("click", () => {
      this.timeline.removePanel(panel);
      this.heads.delete(panel);
      whole.remove();
      this.refresh();
      byId("more").focus();
    });
    byId("panels").append(whole);
    this.heads.set(panel, head);
    this.choose(index, panel);
    return select;
  }

  choose(index, panel = this.timeline.panels[0]) {
    const head = this.heads.get(panel);
    if (!head) return;
    panel.chosen = index;
    head.select.value = String(index);
    head.meaning.textContent = MEANING[panel.module?.name] ?? "";
    panel.canvas.setAttribute("aria-label", `Values of ${panel.module?.name ?? "no module"} over simulated time. `
      + "Arrow keys move the moment and show the values there");
    this.refresh();
  }

  refresh() {
    const { panels } = this.timeline;
    for (const [panel, head] of this.heads) {
      head.remove.hidden = panels.length < 2;
      head.outputs = [];
      head.names.replaceChildren(...(panel.module?.names ?? []).map((name, i) => this.legend(panel, head, name, i)));
    }
    byId("more").disabled = panels.length >= this.content.modules.length;
    this.timeline.draw();
  }

  legend(panel, head, name, index) {
    const box = make("input");
    box.type = "checkbox";
    box.checked = !panel.hidden.has(name);
    box.addEventListener("change", () => {
      if (box.checked) panel.hidden.delete(name);
      else panel.hidden.add(name);
      this.timeline.draw();
    });
    const line = make("i");
    line.style.borderTop = `3px ${theme.dash(index).length ? "dashed" : "solid"} ${theme.line(index)}`;
    const value = make("output");
    head.outputs.push(value);
    return make("label", null, box, line, name, value);
  }

  // Values at the pointer, or at the moment: in the heads of the panels and in a sentence.
  showValues() {
    const { asked, pointer, raster } = this.timeline;
    for (const [panel, { outputs }] of this.heads) {
      const values = panel.values(asked);
      outputs.forEach((output, i) => { output.textContent = values[i] === undefined ? "–" : values[i].toFixed(2); });
    }
    const said = [`${pointer ? "Pointer" : "Moment"} at ${seconds(asked, 3)}`, ...this.content.says(asked)];
    byId("reading").textContent = `${said.join("; ")}.`;
    if (raster) byId("counts").textContent = raster.tell(asked).join(", ");
  }
}

