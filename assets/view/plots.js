// Plots of values, similarities and spikes: drawn while the run goes on, and exported as CSV and SVG.

const KEPT = { samples: 20000, spikes: 50000 };
// Dashes of the curves of branches, by their number.
const BRANCH_DASHES = [[7, 4], [2, 3], [9, 3, 2, 3], [1, 4]];
const BRANCH_LINES = ["dashed", "dotted", "dashes and dots", "thinly dotted"];
const MARGIN = { left: 46, right: 8, top: 6, bottom: 20 };

// What is plotted of the whole network: the number of a frame, and its title.
const ENERGY = [["arrivals", "synaptic events a second"], ["spikes", "spikes a second"]];

// How the spikes of all branches are drawn.
const BRANCH_SPIKES = "paler, half as high";

// What a plot is drawn on: a canvas, or the text of an SVG file.
class CanvasPaper {
  constructor(canvas) {
    const scale = Math.min(window.devicePixelRatio, 2);
    [this.width, this.height] = [canvas.clientWidth, canvas.clientHeight];
    canvas.width = Math.round(this.width * scale);
    canvas.height = Math.round(this.height * scale);
    this.context = canvas.getContext("2d");
    this.context.scale(scale, scale);
    this.context.font = "11px system-ui, sans-serif";
  }

  line(points, colour, dash = [], width = 1.5) {
    const { context } = this;
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.setLineDash(dash);
    context.beginPath();
    points.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
    context.stroke();
  }

  dots(points, colour, size) {
    this.context.fillStyle = colour;
    for (const [x, y] of points) this.context.fillRect(x, y, 1.5, size);
  }

  text(words, x, y, colour, anchor) {
    this.context.fillStyle = colour;
    this.context.textAlign = anchor === "end" ? "right" : anchor === "middle" ? "center" : "left";
    this.context.fillText(words, x, y);
  }
}

class SvgPaper {
  constructor(width, height, ground) {
    Object.assign(this, { width, height });
    this.body = [`<rect width="${width}" height="${height}" fill="${ground}"/>`];
  }

  line(points, colour, dash = [], width = 1.5) {
    const path = points.map(([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`).join(" ");
    const dashes = dash.length ? ` stroke-dasharray="${dash.join(" ")}"` : "";
    this.body.push(`<polyline points="${path}" fill="none" stroke="${colour}" stroke-width="${width}"${dashes}/>`);
  }

  dots(points, colour, size) {
    const path = points.map(([x, y]) => `M${x.toFixed(1)} ${y.toFixed(1)}v${size.toFixed(1)}`).join("");
    this.body.push(`<path d="${path}" stroke="${colour}" stroke-width="1.5"/>`);
  }

  text(words, x, y, colour, anchor = "start") {
    const escaped = words.replaceAll("&", "&amp;").replaceAll("<", "&lt;");
    this.body.push(`<text x="${x}" y="${y}" fill="${colour}" text-anchor="${anchor}">${escaped}</text>`);
  }

  file() {
    return `<svg xmlns="http://www.w3.org/2000/svg" width="${this.width}" height="${this.height}" `
      + `font-family="system-ui, sans-serif" font-size="11">${this.body.join("")}</svg>\n`;
  }
}

// Three digits; of large numbers with `k`, `M` or `G` for thousands, millions and thousands of millions.
function shortNumber(value) {
  const units = [[1e9, 1e9, "\u202fG"], [1e6, 1e6, "\u202fM"], [1e4, 1e3, "\u202fk"]];
  const [, size, unit] = units.find(([from]) => Math.abs(value) >= from) ?? [0, 1, ""];
  return Number((value / size).toPrecision(3)) + unit;
}
// The path of a run of which a plot has nothing.
const UNPLOTTED = { from: null, end: null, ticks: [], rows: [] };
const isPlotted = ({ from, end }) => end !== null && end > from;
// A field of a CSV file.
const quoted = (text) => (/[",\n\r]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);

function download(name, kind, text) {
  const link = make("a");
  link.href = URL.createObjectURL(new Blob([text], { type: kind }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

class Plot {
  // `what` is the request, as the run takes it.
  constructor(title, what, remove) {
    Object.assign(this, { title, what, id: null, names: [], ticks: [], rows: [], from: null, end: null, tail: null, branches: new Map() });
    this.spiking = "spikes" in what;
    this.canvas = make("canvas");
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", title);
    this.legend = make("div");
    this.legend.className = "names";
    this.compared = make("p");
    this.compared.className = "note";
    const button = (text, act) => {
      const made = make("button", text);
      made.type = "button";
      made.addEventListener("click", act);
      return made;
    };
    const file = title.replace(/[^\w.-]+/g, "_");
    const controls = make("div", null,
      button("CSV", () => download(`${file}.csv`, "text/csv", this.csv())),
      button("SVG", () => download(`${file}.svg`, "image/svg+xml", this.svg())),
      button("Remove", remove));
    controls.className = "controls";
    this.element = make("div", null, make("h3", title), this.canvas, this.legend, this.compared, controls);
    this.element.className = "plot";
  }

  // Gets its number and the names of its values.
  begin({ id, names }) {
    const named = names.map((name, i) => (this.spiking || names.length > 24 ? null : make("label", null, this.swatch(i), name, make("output"))));
    Object.assign(this, { id, names });
    this.legend.replaceChildren(...named.filter(Boolean));
  }

  swatch() {
    const mark = make("i");
    mark.className = "swatch";
    return mark;
  }

  colour(index) {
    return theme.line(index);
  }

  forget() {
    [this.ticks, this.rows, this.from, this.end, this.tail] = [[], [], null, null, null];
    this.branches.clear();
  }

  // The run is plotted up to a tick. It is from the tick after `from` to `end`, also where no neuron fired.
  reach(tick) {
    this.from ??= tick;
    this.end = Math.max(this.end ?? tick, tick);
  }

  // Takes away what lies after a tick: the run has gone back. It is kept, for it may become a branch.
  cut(tick) {
    this.branches.forEach((branch) => { branch.found = null; });
    const left = this.after(tick);
    const tail = { from: Math.max(this.from, tick), end: this.end, ticks: this.ticks.splice(left), rows: this.rows.splice(left) };
    if (!isPlotted(tail)) return;
    [this.from, this.end] = [Math.min(this.from, tick), tick];
    if (!this.tail || this.tail.end <= tail.end) {
      this.tail = tail;
      return;
    }
    // After a longer way back, the earlier part belongs to it as well.
    const { from, end, ticks, rows } = this.tail;
    const before = countUpTo(tail.ticks, from);
    this.tail = {
      from: tail.end >= from ? tail.from : from, end,
      ticks: [...tail.ticks.slice(0, before), ...ticks], rows: [...tail.rows.slice(0, before), ...rows],
    };
  }

  // The index of the first sample after a tick.
  after(tick) {
    return countUpTo(this.ticks, tick);
  }

  // Keeps what the run had done before it went back as a branch, which parts from it at a tick.
  keep(id, parted) {
    // The frame in which the run went back may still be on its way.
    this.cut(parted);
    const { from, end, ticks, rows } = this.tail ?? UNPLOTTED;
    const first = countUpTo(ticks, parted);
    this.branches.set(id, { parted, from: Math.max(from, parted), end, ticks: ticks.slice(first), rows: rows.slice(first) });
    this.tail = null;
  }

  // The run has returned to a branch: that becomes the present, and the present becomes the branch. A plot that was added
  // after the branch was kept knows only of the present.
  turn(id, parted) {
    const branch = this.branches.get(id) ?? { parted, ...UNPLOTTED };
    const first = this.after(branch.parted);
    const left = { from: Math.max(this.from, branch.parted), end: this.end, ticks: this.ticks.splice(first), rows: this.rows.splice(first) };
    for (const [other, one] of this.branches) {
      if (other === id || one.parted <= branch.parted) continue;
      // It went on from the path that is left now.
      const shared = countUpTo(left.ticks, one.parted);
      one.ticks.unshift(...left.ticks.slice(0, shared));
      one.rows.unshift(...left.rows.slice(0, shared));
      const from = one.from <= one.parted && left.end >= one.parted ? left.from : one.from;
      Object.assign(one, { parted: branch.parted, from, found: null });
    }
    this.ticks.push(...branch.ticks);
    this.rows.push(...branch.rows);
    if (!isPlotted(branch)) [this.from, this.end] = [null, null];
    else [this.from, this.end] = [branch.from > branch.parted ? branch.from : Math.min(this.from, branch.parted), branch.end];
    this.branches.set(id, { parted: branch.parted, ...left });
    this.tail = null;
  }

  // Where a branch and the present first differ: the tick, and the last one before at which both were sampled and were the same.
  // Null if they do not differ as far as both are known.
  differs(branch) {
    if (this.spiking) return this.firstSpikeApart(branch);
    const { parted, ticks, rows } = branch;
    let [same, at] = [parted, this.after(parted)];
    for (let i = 0; i < ticks.length; i += 1) {
      while (at < this.ticks.length && this.ticks[at] < ticks[i]) at += 1;
      if (this.ticks[at] !== ticks[i]) continue;
      if (rows[i].some((value, column) => value !== this.rows[at][column])) return { tick: ticks[i], same };
      same = ticks[i];
    }
    return null;
  }

  // The same for spikes: a spike on one side only is a difference, where both are plotted.
  firstSpikeApart({ from, end, ticks, rows }) {
    const [begin, last] = [Math.max(from, this.from), Math.min(end, this.end)];
    const [ends, most] = [countUpTo(ticks, last), this.after(last)];
    for (let [i, at] = [countUpTo(ticks, begin), this.after(begin)]; i < ends || at < most; i += 1, at += 1) {
      const tick = Math.min(i < ends ? ticks[i] : Infinity, at < most ? this.ticks[at] : Infinity);
      if (ticks[i] !== this.ticks[at] || rows[i] !== this.rows[at]) return { tick, same: tick - 1 };
    }
    return null;
  }

  // The branches in words.
  compare() {
    const said = [...this.branches].map(([id, branch]) => {
      branch.found ??= this.differs(branch);
      const { found } = branch;
      const where = !isPlotted(branch) ? "was not plotted" : !found ? "does not differ so far"
        : found.tick === found.same + 1 ? `differs from tick ${found.tick}` : `differs from a tick between ${found.same + 1} and ${found.tick}`;
      const drawn = this.spiking ? BRANCH_SPIKES : BRANCH_LINES[(id - 1) % BRANCH_LINES.length];
      return `Branch ${id} (${drawn}) ${where}.`;
    });
    const text = said.join(" ");
    if (this.compared.textContent !== text) this.compared.textContent = text;
  }

  take({ width, ticks, values }) {
    ticks.forEach((tick, i) => {
      if (!this.spiking && tick === this.ticks.at(-1)) return;
      this.ticks.push(tick);
      this.rows.push(this.spiking ? values[i] : values.slice(i * width, (i + 1) * width));
    });
    if (ticks.length) {
      this.from ??= ticks[0] - 1;
      this.reach(ticks.at(-1));
    }
    const most = this.spiking ? KEPT.spikes : KEPT.samples;
    if (this.ticks.length > 1.1 * most) {
      this.ticks.splice(0, this.ticks.length - most);
      this.rows.splice(0, this.rows.length - most);
      [this.from] = this.ticks;
    }
  }

  // Draws on a paper the times from `begin` to `end`, in seconds.
  draw(paper, dt, begin, end) {
    const { ink, soft, line } = theme.colours;
    const [right, bottom] = [paper.width - MARGIN.right, paper.height - MARGIN.bottom];
    const x = (tick) => MARGIN.left + ((tick * dt - begin) / (end - begin)) * (right - MARGIN.left);
    const first = Math.max(countUpTo(this.ticks, begin / dt - 1e-9) - 1, 0);
    // Of branches only what is in view, so that the rest does not stretch the axis.
    const branches = [...this.branches].map(([id, { ticks, rows }]) => {
      const range = [Math.max(countUpTo(ticks, begin / dt - 1e-9) - 1, 0), countUpTo(ticks, end / dt + 1e-9)];
      return { id, ticks: ticks.slice(...range), rows: rows.slice(...range) };
    });
    let [low, high] = [0, 1];
    if (this.spiking) {
      const { from, count } = this.what.spikes;
      [low, high] = [from, from + count];
    } else {
      for (const [rows, from] of [[this.rows, first], ...branches.map((branch) => [branch.rows, 0])]) {
        for (let i = from; i < rows.length; i++) {
          for (const value of rows[i]) [low, high] = [Math.min(low, value), Math.max(high, value)];
        }
      }
    }
    const y = (value) => bottom - ((value - low) / (high - low || 1)) * (bottom - MARGIN.top);
    paper.line([[MARGIN.left, bottom], [right, bottom]], line, [], 1);
    paper.line([[MARGIN.left, y(0)], [right, y(0)]].filter(() => low < 0), line, [2, 3], 1);
    paper.text(shortNumber(high), MARGIN.left - 4, MARGIN.top + 9, soft, "end");
    paper.text(shortNumber(low), MARGIN.left - 4, bottom, soft, "end");
    paper.text(seconds(begin, 3), MARGIN.left, paper.height - 6, soft, "start");
    paper.text(seconds(end, 3), right, paper.height - 6, soft, "end");
    if (this.spiking) {
      const size = Math.max((bottom - MARGIN.top) / (high - low) - 1, 1);
      const points = (ticks, rows) => ticks.map((tick, i) => [x(tick), y(rows[i] + 1)]).filter(([at]) => at >= MARGIN.left && at <= right);
      for (const { ticks, rows } of branches) paper.dots(points(ticks, rows), soft, size / 2);
      paper.dots(points(this.ticks.slice(first), this.rows.slice(first)), ink, size);
      return;
    }
    for (const { id, ticks, rows } of branches) {
      this.names.forEach((_, column) => {
        const points = ticks.map((tick, i) => [Math.max(x(tick), MARGIN.left), y(rows[i][column])]);
        paper.line(points, this.colour(column), BRANCH_DASHES[(id - 1) % BRANCH_DASHES.length], 1);
      });
    }
    this.names.forEach((_, column) => {
      const points = [];
      for (let i = first; i < this.ticks.length; i++) points.push([Math.max(x(this.ticks[i]), MARGIN.left), y(this.rows[i][column])]);
      paper.line(points, this.colour(column), theme.dash(column), this.branches.size ? 2.2 : 1.5);
    });
  }

  show(dt, tick, last) {
    // With branches the axis goes on to their ends, up to half its length.
    const ends = [...this.branches.values()].map(({ ticks }) => ticks.at(-1) ?? 0);
    const end = Math.min(Math.max(tick, ...ends), tick + last / dt / 2) * dt;
    this.range = [dt, Math.max(end - last, 0), Math.max(end, last)];
    this.compare();
    this.draw(new CanvasPaper(this.canvas), ...this.range);
    const now = this.rows.at(-1);
    [...this.legend.children].forEach((label, i) => {
      const value = now?.[i];
      label.querySelector("i").style.borderTop = `3px ${theme.dash(i).length ? "dashed" : "solid"} ${this.colour(i)}`;
      label.querySelector("output").textContent = value === undefined ? "" : Math.abs(value) < 1000 ? value.toFixed(2) : shortNumber(value);
    });
  }

  csv() {
    const dt = this.range?.[0] ?? 1;
    const several = this.branches.size > 0;
    const head = [...(several ? ["run"] : []), "time_s", ...(this.spiking ? ["neuron"] : this.names)].map(quoted).join(",");
    // A number that the run counts in single precision, without the digits of double precision.
    const lines = (run, { ticks, rows }) => rows.map((row, i) => [...(several ? [run] : []), (ticks[i] * dt).toFixed(6),
      ...[row].flat().map((value) => Math.fround(value).toPrecision(9) * 1)].join(","));
    const branches = [...this.branches].flatMap(([id, branch]) => lines(`branch ${id}`, branch));
    return `${[head, ...lines("now", this), ...branches].join("\n")}\n`;
  }

  svg() {
    const paper = new SvgPaper(720, 240, theme.colours.paper);
    this.draw(paper, ...(this.range ?? [1, 0, 1]));
    if (!this.spiking) {
      this.names.slice(0, 24).forEach((name, i) => paper.text(name, MARGIN.left + 6, 18 + 13 * i, this.colour(i)));
    }
    return paper.file();
  }
}

// All plots of this window.
class Plots {
  constructor(place, session) {
    Object.assign(this, { place, session, all: [], next: 1, known: new Map(), turns: null });
    this.none = place.firstElementChild;
  }

  add(title, what) {
    const plot = new Plot(title, what, () => this.remove(plot));
    this.all.push(plot);
    this.none.hidden = true;
    this.place.prepend(plot.element);
    this.ask(plot);
  }

  // What the frames say of the whole network, so the run is not asked.
  addEnergy() {
    for (const [of, name] of ENERGY) {
      if (this.all.some((plot) => plot.what.energy === of)) continue;
      const plot = new Plot(`Whole network, ${name}`, { energy: of }, () => this.drop(plot));
      this.all.push(plot);
      this.none.hidden = true;
      this.place.prepend(plot.element);
      plot.begin({ id: of, names: [name] });
    }
  }

  ask(plot) {
    if (plot.what.energy) return;
    plot.key = this.next;
    this.next += 1;
    plot.id = null;
    this.session.send("plot", { key: plot.key, what: plot.what });
  }

  // Takes over what branches the run has: new ones, those that were dropped, and a return to one.
  branch({ all, turns, last }) {
    const parted = this.known.get(last) ?? all.find(({ id }) => id === last)?.parted;
    if (this.turns !== null && turns !== this.turns && parted !== undefined) this.all.forEach((plot) => plot.turn(last, parted));
    this.turns = turns;
    const ids = new Set(all.map(({ id }) => id));
    for (const { id, parted } of all) {
      if (!this.known.has(id)) this.all.forEach((plot) => plot.keep(id, parted));
      this.known.set(id, parted);
    }
    for (const id of [...this.known.keys()].filter((own) => !ids.has(own))) {
      this.known.delete(id);
      this.all.forEach((plot) => plot.branches.delete(id));
    }
  }

  // The run has another graph: its plots are asked for again.
  again() {
    [this.known, this.turns] = [new Map(), null];
    for (const plot of this.all) {
      plot.forget();
      this.ask(plot);
    }
  }

  begun({ key, id, names }) {
    const plot = this.all.find((one) => one.key === key);
    if (plot) plot.begin({ id, names });
    // It was removed before the answer came.
    else this.session.send("unplot", { id });
  }

  refused(key) {
    const plot = this.all.find((one) => one.key === key);
    if (plot) this.drop(plot);
  }

  remove(plot) {
    if (plot.id !== null) this.session.send("unplot", { id: plot.id });
    this.drop(plot);
  }

  drop(plot) {
    plot.element.remove();
    this.all = this.all.filter((one) => one !== plot);
    this.none.hidden = this.all.length > 0;
  }

  take(frame, wentBack) {
    if (wentBack) this.all.forEach((plot) => plot.cut(frame.tick));
    for (const plot of this.all.filter(({ what }) => what.energy)) plot.take({ width: 1, ticks: [frame.tick], values: [frame[plot.what.energy]] });
    for (const samples of frame.plots) this.all.find((plot) => plot.id === samples.id)?.take(samples);
    this.all.filter(({ id }) => id !== null).forEach((plot) => plot.reach(frame.tick));
  }

  show(dt, tick, last) {
    this.all.forEach((plot) => plot.show(dt, tick, last));
  }
}
