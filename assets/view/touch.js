// The chosen module: what it is, and what can be plotted and changed there.

class Touch {
  constructor(session, plots) {
    Object.assign(this, { session, plots, path: null });
    const on = (id, act) => byId(id).addEventListener("click", act);
    const change = (what) => session.send("do", what);
    on("silence", () => change({ silence: { at: this.path } }));
    on("release", () => change({ release: { at: this.path } }));
    on("noisy", () => {
      const scale = byId("noise").value;
      if (scale === "") session.listeners.refused("the noise needs a number");
      else change({ noise: { at: this.path, scale: Number(scale) } });
    });
    on("values", () => {
      const output = this.output();
      const count = Math.min(output.width, 64);
      plots.add(`${nameOf(output.name)}${count < output.width ? `, first ${count} of ${output.width}` : ""}`, { values: { output: output.name, count } });
    });
    on("similar", () => {
      const to = byId("expression").value.split(",").map((text) => text.trim()).filter(Boolean);
      const output = this.output().name;
      // Without an expression, all names of the vocabulary.
      const wanted = to.length ? to : (this.pointers[output] ?? []).slice(0, 64);
      plots.add(`${nameOf(output)}, similarity${to.length ? ` to ${to.join(", ")}` : ""}`, { similar: { output, to: wanted } });
    });
    on("clamp", () => this.value("clamp"));
    on("set", () => this.value("set"));
    on("spikes", () => {
      const [from, count] = [Number(byId("from").value), Number(byId("count").value)];
      const layer = byId("layer").value;
      plots.add(`Spikes of ${nameOf(layer)}, neurons ${from} to ${from + count - 1}`, { spikes: { layer, from, count } });
    });
    byId("output").addEventListener("change", () => this.showOutput());
    byId("layer").addEventListener("change", () => this.showLayer());
  }

  begin(graph, pointers) {
    Object.assign(this, { graph, pointers });
    if (this.path) this.show(this.path);
  }

  output() {
    const name = byId("output").value;
    return this.outputs.find((output) => output.name === name);
  }

  // Clamps or sets the output to numbers, or to an expression over its vocabulary.
  value(how) {
    const text = byId("expression").value.trim();
    const output = this.output().name;
    const numbers = text.split(/[\s,]+/).map(Number);
    const typed = text !== "" && numbers.every(Number.isFinite);
    if (typed && !(output in this.pointers && numbers.length === 1 && numbers[0] === 0)) {
      this.session.send("do", { [how]: { output, values: numbers } });
    } else {
      this.session.send("point", { output, to: text, how });
    }
  }

  show(path) {
    this.path = path;
    const nodes = this.graph.nodes.filter((node) => node.path === path || node.path.startsWith(`${path}/`));
    this.outputs = nodes.flatMap((node) => node.outputs.map((output) => ({ ...output, source: node.source })));
    const neurons = nodes.reduce((sum, node) => sum + node.neurons, 0);
    const name = nameOf(path);
    byId("chosen").textContent = name;
    const counts = `${nodes.length === 1 ? "1 node" : `${nodes.length} nodes`}, ${neurons} spiking neurons.`;
    byId("meaning").textContent = [meaningOf(path), counts, name === path ? "" : `In scripts and logs: ${path}.`].filter(Boolean).join(" ");
    byId("handles").hidden = false;
    // Names that the module has for its outputs come first.
    const inner = ({ name }) => (name.startsWith(`${path}.`) ? 0 : 1);
    this.outputs.sort((a, b) => inner(a) - inner(b));
    byId("output").replaceChildren(...this.outputs.slice(0, 500).map(({ name }) => new Option(this.inside(name), name)));
    const spiking = nodes.filter((node) => node.neurons > 0);
    byId("layer").replaceChildren(...spiking.slice(0, 500).map((node) => new Option(this.inside(node.path), node.path)));
    byId("layers").hidden = spiking.length === 0;
    this.showOutput();
    this.showLayer();
  }

  // The name of an output or layer inside the chosen module.
  inside(path) {
    const at = path.lastIndexOf(".");
    const node = at > path.lastIndexOf("/") ? path.slice(0, at) : path;
    const own = around(node).filter((one) => one.startsWith(`${this.path}/`)).map(partOf);
    return [...own, ...(node === path ? [] : [path.slice(at + 1)])].join(" › ") || partOf(this.path);
  }

  showOutput() {
    const output = this.output();
    for (const id of ["values", "similar", "clamp", "set"]) byId(id).disabled = !output;
    if (!output) return;
    const names = this.pointers[output.name];
    byId("similar").disabled = !names;
    byId("set").disabled = !output.source;
    byId("set").title = output.source ? "" : "Only outputs of sources can be set: this one is computed from inputs.";
    byId("pointers").replaceChildren(...(names ?? []).slice(0, 500).map((name) => make("option", name)));
    byId("expression").placeholder = names ? names.slice(0, 3).join(", ") : (output.width === 1 ? "a number" : `${output.width} numbers`);
  }

  showLayer() {
    const layer = this.graph.nodes.find((node) => node.path === byId("layer").value);
    if (layer) byId("count").value = Math.min(layer.neurons, 32);
  }
}

// A change of the log as an order, and the whole of it as the log has it. Long ones were cut, and are no JSON.
function changeInWords(text) {
  let what;
  try { what = JSON.parse(text); } catch {
    const [, kind, output] = text.match(/^\{"(clamp|set)":\{"output":"([^"]+)"/) ?? [];
    return kind ? `${kind} ${nameOf(output)}` : text;
  }
  const [[kind, of]] = Object.entries(what);
  const scene = ({ move, remove }) => {
    const part = (move ?? remove)?.object?.replaceAll("_", " ");
    if (remove) return `take ${part} away`;
    return move ? `move ${part} to ${move.position.map((m) => (1000 * m).toFixed(0)).join(", ")} mm${move.orientation ? ", turned" : ""}` : text;
  };
  const values = (list) => (list.length > 4 ? `${list.length} values` : list.map((value) => shortNumber(value)).join(", "));
  const orders = {
    silence: () => `silence ${nameOf(of.at)}`,
    release: () => `release ${nameOf(of.at)}`,
    clamp: () => `clamp ${nameOf(of.output)} to ${values(of.values)}`,
    set: () => `set ${nameOf(of.output)} to ${values(of.values)}`,
    noise: () => `set the noise of ${of.at ? nameOf(of.at) : "the run"} to ${shortNumber(of.scale)} times its own`,
    world: () => scene(of),
  };
  return orders[kind]?.() ?? text;
}
