// The drawing of the graph: modules as boxes, folded by the parts of their paths; a press opens one.

const SVG = "http://www.w3.org/2000/svg";
const BOX = { letter: 7.6, pad: 14, tall: 44, margin: 60, narrow: 600 };
// Greatest numbers of boxes and arrows that can be read.
const LEGIBLE = { boxes: 150, arrows: 400 };

function shape(tag, attributes, text) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  if (text !== undefined) element.textContent = text;
  return element;
}

class Drawing {
  constructor(box, graph) {
    this.box = box;
    this.graph = graph;
    this.open = new Set();
    this.zoom = 1;
    this.middle = null;
    // With a single module around everything, that one is opened.
    const tops = new Set(graph.nodes.map(({ path }) => path.split("/")[0]));
    if (tops.size === 1 && graph.nodes.length > 1) this.open.add([...tops][0]);
    this.listen();
    this.draw();
    let narrow = this.narrow;
    new ResizeObserver(() => { if (this.narrow !== narrow) { narrow = this.narrow; this.draw(); } }).observe(box);
  }

  get narrow() {
    return this.box.clientWidth < BOX.narrow;
  }

  // The part of a path that is a box now: its first part, and one more for each that is open.
  boxOf(path) {
    const parts = path.split("/");
    let own = parts[0];
    for (let i = 1; i < parts.length && this.open.has(own); i++) own += `/${parts[i]}`;
    return own;
  }

  // Boxes with what they hold, and arrows with their synapses and weights. Routes become arrows.
  folded() {
    const { nodes, edges } = this.graph;
    const boxes = new Map();
    nodes.forEach(({ path, neurons: units, outputs }) => {
      const width = outputs.reduce((sum, output) => sum + output.width, 0);
      const name = this.boxOf(path);
      const box = boxes.get(name) ?? { path: name, nodes: 0, units: 0, width: 0, inner: false };
      boxes.set(name, { ...box, nodes: box.nodes + 1, units: box.units + units, width, inner: box.inner || path !== name });
    });
    let arrows = new Map();
    const join = (into, from, to, label) => {
      const key = `${from}\n${to}`;
      const arrow = into.get(key) ?? { from, to, labels: new Map() };
      arrow.labels.set(label, (arrow.labels.get(label) ?? 0) + 1);
      into.set(key, arrow);
    };
    // Inside a module only its loops count, by their synapses.
    const owner = nodes.map(({ path }) => this.boxOf(path));
    const inside = loops(nodes.length, edges.filter(({ from, to }) => owner[from] === owner[to]).map(({ from, to }) => [from, to]));
    for (const { from, to, synapse: via, weight = 1 } of edges) {
      const [a, b] = [owner[from], owner[to]];
      if (a === b && (inside[from] < 0 || inside[from] !== inside[to] || !via)) continue;
      join(arrows, a, b, [via, weight === 1 ? "" : `× ${Number(weight.toPrecision(3))}`].filter(Boolean).join(", "));
    }
    for (const name of [...boxes.keys()]) {
      if (!isRoute(name)) continue;
      const all = [...arrows.values()];
      const [ins, outs] = [all.filter(({ to, from }) => to === name && from !== name), all.filter(({ from, to }) => from === name && to !== name)];
      if (!ins.length || !outs.length) continue;
      boxes.delete(name);
      arrows = new Map([...arrows].filter(([, { from, to }]) => from !== name && to !== name));
      for (const a of ins) for (const b of outs) {
        for (const one of a.labels.keys()) for (const two of b.labels.keys()) join(arrows, a.from, b.to, [two, one].filter(Boolean).join(", "));
      }
    }
    return { boxes: [...boxes.values()], arrows: [...arrows.values()] };
  }

  draw() {
    const { boxes, arrows } = this.folded();
    this.told(boxes, arrows);
    if (boxes.length > LEGIBLE.boxes || arrows.length > LEGIBLE.arrows || boxes.length === 0) {
      this.box.replaceChildren();
      return;
    }
    const down = this.narrow;
    for (const box of boxes) {
      box.title = around(box.path).map(partOf).join(" › ");
      box.note = box.units ? `${box.units} neurons` : box.inner ? plural(box.nodes, "node") : `width ${box.width}`;
      box.width = Math.max(box.title.length, box.note.length * 0.85, 4) * BOX.letter + 2 * BOX.pad;
      box.height = BOX.tall;
    }
    const index = new Map(boxes.map((box, i) => [box.path, i]));
    const ends = arrows.map(({ from, to }) => [index.get(from), index.get(to)]);
    const { back, size } = lay(boxes, ends, down);
    this.size = { width: size.width + 2 * BOX.margin, height: size.height + 2 * BOX.margin };
    this.svg = shape("svg", { xmlns: SVG, role: "presentation" });
    this.svg.append(shape("style", {}, strokes()));
    const tip = shape("marker", { id: "tip", viewBox: "0 0 8 8", refX: 7, refY: 4, markerWidth: 7, markerHeight: 7, orient: "auto-start-reverse" });
    tip.append(shape("path", { d: "M0 0L8 4L0 8z", class: "head" }));
    this.svg.append(tip);
    const plane = shape("g", { transform: `translate(${BOX.margin} ${BOX.margin})` });
    arrows.forEach((arrow, i) => plane.append(this.arrow(boxes[ends[i][0]], boxes[ends[i][1]], arrow, back.has(i), down)));
    boxes.forEach((box) => plane.append(this.module(box)));
    // Labels stand above the boxes.
    plane.append(...plane.querySelectorAll(".label"));
    this.svg.append(plane);
    this.box.replaceChildren(this.svg);
    this.look();
    this.openList();
  }

  told(boxes, arrows) {
    const { nodes, edges, connections } = this.graph;
    const many = boxes.length > LEGIBLE.boxes || arrows.length > LEGIBLE.arrows;
    byId("drawn").textContent = edges.length < connections || many
      ? `${boxes.length} modules and ${connections} connections are too many for a drawing.`
      : `${plural(nodes.length, "node")} and ${plural(connections, "connection")}. An arrow shows its synapse and weight; a loop is drawn as a loop. `
        + "Press a module to open it; drag to move, and after a press the wheel zooms.";
  }

  module(box) {
    const group = shape("g", { class: box.inner ? "module folded" : "module", transform: `translate(${box.x.toFixed(1)} ${box.y.toFixed(1)})` });
    const label = `${box.title}, ${box.note}`;
    if (box.inner) {
      const toggle = () => this.toggle(box.path);
      for (const [name, value] of [["tabindex", "0"], ["role", "button"], ["aria-label", `Open ${label}`]]) group.setAttribute(name, value);
      group.addEventListener("click", () => { if (!this.dragged) toggle(); });
      group.addEventListener("keydown", (event) => {
        if (event.key !== "Enter" && event.key !== " ") return;
        event.preventDefault();
        toggle();
      });
    }
    group.append(
      shape("title", {}, `${[box.path, box.note, meaningOf(box.path)].filter(Boolean).join(": ")}${box.inner ? "; press to open" : ""}`),
      shape("rect", { width: box.width.toFixed(1), height: box.height, rx: 7 }),
      shape("text", { x: (box.width / 2).toFixed(1), y: 17, "text-anchor": "middle", class: "name" }, box.title),
      shape("text", { x: (box.width / 2).toFixed(1), y: 34, "text-anchor": "middle", class: "note" }, box.note),
    );
    return group;
  }

  // A curve from box to box; to the same box or to an earlier one it is a loop.
  arrow(from, to, { labels }, back, down) {
    const said = [...labels.keys()].filter(Boolean);
    const text = said.length > 2 ? `${said.length} kinds` : said.join("; ");
    const all = [...labels].map(([label, count]) => `${label || "no synapse"}${count > 1 ? ` (${count} times)` : ""}`).join("; ");
    const group = shape("g", { class: back || from === to ? "arrow loop" : "arrow" });
    const along = (box, share) => (down ? [box.x + box.width / 2, box.y + share * box.height] : [box.x + share * box.width, box.y + box.height / 2]);
    let path;
    let at;
    if (from === to) {
      const [x, y] = [from.x + from.width / 2, from.y];
      path = `M${x - 14} ${y}C${x - 34} ${y - 40} ${x + 34} ${y - 40} ${x + 14} ${y}`;
      at = [x, y - 34];
    } else {
      const [[x, y], [u, v]] = [along(from, 1), along(to, 0)];
      const bow = back ? 46 : Math.max(Math.abs(down ? v - y : u - x) / 2, 24);
      // A curve that leads back goes around the boxes.
      const aside = back ? (down ? Math.max(from.width, to.width) / 2 + 40 : from.height / 2 + 46) : 0;
      const [dx, dy] = down ? [aside, bow] : [bow, aside];
      const [sx, sy] = down ? [aside, -bow] : [-bow, aside];
      path = `M${x.toFixed(1)} ${y.toFixed(1)}C${(x + dx).toFixed(1)} ${(y + dy).toFixed(1)} ${(u + sx).toFixed(1)} ${(v + sy).toFixed(1)} ${u.toFixed(1)} ${v.toFixed(1)}`;
      // The middle of the curve.
      at = [(x + 3 * (x + dx) + 3 * (u + sx) + u) / 8, (y + 3 * (y + dy) + 3 * (v + sy) + v) / 8 - 5];
    }
    group.append(
      shape("title", {}, `${nameOf(from.path)} to ${nameOf(to.path)}: ${all}`),
      shape("path", { d: path, class: "wide" }), shape("path", { d: path, "marker-end": "url(#tip)" }),
      shape("text", { x: at[0].toFixed(1), y: at[1].toFixed(1), "text-anchor": "middle", class: "label" }, text),
    );
    return group;
  }

  toggle(path) {
    if (this.open.has(path)) for (const own of [...this.open]) { if (own === path || own.startsWith(`${path}/`)) this.open.delete(own); }
    else this.open.add(path);
    this.zoom = 1;
    this.middle = null;
    this.draw();
  }

  // Buttons that fold the open modules again.
  openList() {
    byId("open-modules").replaceChildren(...[...this.open].map((path) => {
      const button = make("button", `Fold ${nameOf(path)}`);
      button.type = "button";
      button.addEventListener("click", () => this.toggle(path));
      return button;
    }));
  }

  // Shows the part around the middle, at the present zoom.
  look() {
    if (!this.svg) return;
    const { width, height } = this.size;
    const [w, h] = [width / this.zoom, height / this.zoom];
    const [x, y] = this.middle ?? [width / 2, height / 2];
    this.middle = [clamp(x, w / 2, Math.max(width - w / 2, w / 2)), clamp(y, h / 2, Math.max(height - h / 2, h / 2))];
    this.svg.setAttribute("viewBox", [this.middle[0] - w / 2, this.middle[1] - h / 2, w, h].map((v) => v.toFixed(1)).join(" "));
    // No larger than twice the size of the text, and as tall as its share.
    const tall = Math.min((this.box.clientWidth / width) * height, height * 1.3, 620);
    this.svg.style.height = `${Math.max(tall, 120)}px`;
  }

  scale(factor) {
    this.zoom = clamp(this.zoom * factor, 1, 12);
    this.look();
  }

  listen() {
    let start = null;
    this.box.addEventListener("pointerdown", (event) => { start = { x: event.clientX, y: event.clientY, middle: this.middle }; this.dragged = false; });
    this.box.addEventListener("pointermove", (event) => {
      if (!start || !this.middle || this.zoom === 1) return;
      const [dx, dy] = [event.clientX - start.x, event.clientY - start.y];
      if (Math.hypot(dx, dy) > 4) this.dragged = true;
      const share = this.size.width / this.zoom / Math.max(this.svg.clientWidth, 1);
      this.middle = [start.middle[0] - dx * share, start.middle[1] - dy * share];
      this.look();
    });
    for (const over of ["pointerup", "pointercancel", "pointerleave"]) this.box.addEventListener(over, () => { start = null; });
    this.box.addEventListener("wheel", (event) => {
      if (event.deltaY === 0 || !(event.ctrlKey || this.box.contains(document.activeElement))) return;
      event.preventDefault();
      this.scale(event.deltaY > 0 ? 0.8 : 1.25);
    }, { passive: false });
    byId("larger").addEventListener("click", () => this.scale(1.5));
    byId("smaller").addEventListener("click", () => this.scale(1 / 1.5));
    byId("fit").addEventListener("click", () => { this.zoom = 1; this.middle = null; this.look(); });
    byId("save-drawing").addEventListener("click", () => {
      if (this.svg) save("modules.svg", `${new XMLSerializer().serializeToString(this.svg)}\n`, "image/svg+xml");
    });
    theme.listeners.push(() => this.draw());
  }
}

// The colours of the drawing, also in a file.
function strokes() {
  const { ink, soft, line, wash, paper, now, mark } = theme.colours;
  return `.module rect { fill: ${wash}; stroke: ${line}; } .module.folded rect { stroke: ${mark}; cursor: pointer; }
    .module:hover rect, .module:focus-visible rect { stroke-width: 2.5; }
    .module text { fill: ${ink}; font: 13px system-ui, sans-serif; pointer-events: none; } .module .note { fill: ${soft}; font-size: 11px; }
    .arrow path { fill: none; stroke: ${soft}; stroke-width: 1.4; } .arrow .wide { stroke: transparent; stroke-width: 12; }
    .arrow.loop path:not(.wide) { stroke: ${now}; } .head { fill: ${soft}; stroke: none; }
    .arrow:hover path:not(.wide) { stroke-width: 3; }
    .label { fill: ${ink}; font: 11px system-ui, sans-serif; paint-order: stroke; stroke: ${paper}; stroke-width: 3px; }`;
}
