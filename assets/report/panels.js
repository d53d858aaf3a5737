// The panels of a time axis: in each the values of one module, which the reader chooses, with a legend and exports.

class Panels {
  constructor(content, seek) {
    this.heads = new Map();
    this.content = content;
    content.valued = () => this.showValues();
    this.timeline = new Timeline(byId("strips"), content, seek);
    theme.listeners.push(() => this.refresh());
    byId("more").addEventListener("click", () => this.addNext().focus());
    byId("fold").addEventListener("click", () => this.fold());
    byId("nearer").addEventListener("click", () => this.timeline.zoom(0.5));
    byId("farther").addEventListener("click", () => this.timeline.zoom(2));
    byId("whole").addEventListener("click", () => this.timeline.look(0, content.duration));
  }

  // Takes over content that has changed, with panels for its first modules.
  refill(count) {
    for (const panel of [...this.heads.keys()]) this.remove(panel);
    this.timeline.refill();
    byId("fold").hidden = !this.timeline.raster;
    this.foldName();
    this.content.modules.slice(0, count).forEach((_, i) => this.add(i));
    this.refresh();
  }

  fold() {
    const { raster } = this.timeline;
    const open = !raster.groups.every((group) => group.open);
    raster.unfold(open);
    this.foldName();
    this.timeline.draw();
  }

  foldName() {
    const open = this.timeline.raster?.groups.every((group) => group.open);
    byId("fold").textContent = open ? "Fold all spikes" : "Unfold all spikes";
  }

  // What a module is, in a sentence; and more about it, folded.
  meaning() { return ""; }

  more() { return []; }

  addNext() {
    const shown = new Set(this.timeline.panels.map(({ chosen }) => chosen));
    const next = this.content.modules.findIndex((_, i) => !shown.has(i));
    return this.add(Math.max(next, 0));
  }

  // Adds a panel with its head: the module's selector, and the names with their values. Returns the selector.
  add(index) {
    const panel = this.timeline.addPanel(index);
    const options = this.content.modules.map(({ name, title }, i) => new Option(title ?? name, String(i)));
    const select = make("select", null, ...options);
    if (!byId("module")) select.id = "module";
    select.value = String(index);
    select.addEventListener("change", () => this.choose(Number(select.value), panel));
    const remove = make("button", "Remove");
    remove.type = "button";
    remove.setAttribute("aria-label", "Remove this module");
    remove.addEventListener("click", () => {
      this.remove(panel);
      this.refresh();
      byId("more").focus();
    });
    const box = make("div", null, make("label", `${this.content.word} `, select));
    const head = { select, remove, box, names: make("div"), meaning: make("p"), more: make("div"), exports: make("span"), outputs: [] };
    box.append(head.exports);
    head.exports.append(remove);
    head.exports.className = "group";
    head.box.className = "controls";
    head.names.className = "names";
    head.names.tabIndex = 0;
    head.names.setAttribute("role", "group");
    head.meaning.className = "note";
    head.whole = make("div", null, head.box, head.meaning, head.more, head.names, panel.box);
    head.whole.className = "panel";
    byId("panels").append(head.whole);
    this.heads.set(panel, head);
    this.choose(index, panel);
    return select;
  }

  remove(panel) {
    this.timeline.removePanel(panel);
    this.heads.get(panel).whole.remove();
    this.heads.delete(panel);
  }

  choose(index, panel = this.timeline.panels[0]) {
    const head = this.heads.get(panel);
    if (!head) return;
    panel.chosen = index;
    head.select.value = String(index);
    const { module } = panel;
    const name = module?.title ?? module?.name ?? "no module";
    head.meaning.textContent = this.meaning(module);
    head.more.replaceChildren(...this.more(module));
    head.names.setAttribute("aria-label", `Curves of ${name}`);
    head.exports.replaceChildren(...exportButtons(name, () => panel, () => panel.csv()), head.remove);
    panel.canvas.setAttribute("aria-label", `Values of ${name} over simulated time. Arrow keys move the moment and show the values there`);
    this.refresh();
  }

  refresh() {
    const { panels } = this.timeline;
    for (const [panel, head] of this.heads) {
      head.remove.hidden = panels.length < 2;
      head.outputs = [];
      head.names.classList.toggle("many", (panel.module?.names.length ?? 0) > 40);
      head.names.replaceChildren(...(panel.module?.names ?? []).map((name, i) => this.legend(panel, head, name, i)));
    }
    byId("more").hidden = panels.length >= this.content.modules.length;
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
    const { colour, dash } = panel.look(index);
    const line = make("i");
    line.style.borderTop = `3px ${dash.length ? "dashed" : "solid"} ${colour}`;
    const value = make("output");
    head.outputs.push(value);
    return make("label", null, box, line, this.content.say(name), value);
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
    byId("counts").textContent = raster ? raster.tell(asked).join(", ") : "";
  }
}
