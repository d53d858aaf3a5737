// The network: modules folded by path, as boxes in the order of the flow, lit by their activity.

const SVG = "http://www.w3.org/2000/svg";
const BOX = { width: 128, height: 34, across: 56, down: 18 };
// With more boxes than this a drawing leaves out those that only hand on; a column, or a row on a narrow screen, has at most so many boxes.
const MANY = { boxes: 60, column: 14, row: 3 };

function drawn(tag, attributes, ...children) {
  const element = document.createElementNS(SVG, tag);
  Object.entries(attributes).forEach(([name, value]) => element.setAttribute(name, value));
  element.append(...children);
  return element;
}

// The lines of a name in a box: at most two, cut in the middle where they are too long.
function linesOf(name) {
  const short = (text) => (text.length > 20 ? `${text.slice(0, 9)}…${text.slice(-9)}` : text);
  if (name.length <= 17) return [name];
  const spaces = [...name.matchAll(/ /g)].map(({ index }) => index);
  if (!spaces.length) return [short(name)];
  const at = spaces.reduce((best, one) => (Math.abs(one - name.length / 2) < Math.abs(best - name.length / 2) ? one : best));
  return [short(name.slice(0, at)), short(name.slice(at + 1))];
}

// A change of the share of the brightness that can be seen.
const SEEN = 0.08;

// Draws an element anew only if its share of the brightness has changed so far, or fallen to nothing.
function steadily(element, share, draw) {
  if (Math.abs(share - element.steady) < SEEN && (share > 0 || element.steady === 0)) return;
  element.steady = share;
  draw(element, share);
}

class Network {
  constructor(place, choose) {
    Object.assign(this, { place, choose, open: new Set(), chosen: null, held: new Set() });
    this.svg = drawn("svg", { role: "group", "aria-label": "Network" });
    place.replaceChildren(this.svg);
    this.listen();
  }

  begin(graph) {
    this.graph = graph;
    this.most = new Float32Array(graph.nodes.length).fill(1e-6);
    this.open.clear();
    // A few boxes say more than one.
    while (this.boxes().size < 4) {
      const many = [...this.boxes()].filter(([, nodes]) => nodes.length > 1);
      if (!many.length) break;
      const opened = new Set(graph.nodes.map(({ path }) => path.split("/").slice(0, many[0][0].split("/").length + 1).join("/")));
      if (opened.size > MANY.boxes) break;
      many.forEach(([path]) => this.open.add(path));
    }
    this.firstOpen = [...this.open];
    this.build();
  }

  // The path of the box in which a node is drawn.
  boxOf(path) {
    const parts = path.split("/");
    for (let depth = 1; depth < parts.length; depth++) {
      const above = parts.slice(0, depth).join("/");
      if (!this.open.has(above)) return above;
    }
    return path;
  }

  // The boxes with the indices of their nodes.
  boxes() {
    const boxes = new Map();
    this.graph.nodes.forEach(({ path }, index) => {
      const box = this.boxOf(path);
      boxes.set(box, [...(boxes.get(box) ?? []), index]);
    });
    return boxes;
  }

  build() {
    const boxes = this.boxes();
    const names = [...boxes.keys()];
    const at = new Map(names.map((name, i) => [name, i]));
    const of = this.graph.nodes.map(({ path }) => at.get(this.boxOf(path)));
    const edges = new Map();
    for (const edge of this.graph.edges) {
      const [from, to] = [of[edge.from], of[edge.to]];
      if (from === to) continue;
      const key = `${from} ${to}`;
      const label = `${nameOf(this.graph.nodes[edge.from].outputs[edge.output].name)} → ${nameOf(this.graph.nodes[edge.to].path)}: ${edge.input}${edge.synapse && ` (${edge.synapse})`}`;
      const known = edges.get(key) ?? { from, to, labels: [] };
      known.labels.push(label);
      edges.set(key, known);
    }
    const { list, hidden } = this.joined(names, boxes, [...edges.values()]);
    const layers = this.layers(names.length, list);
    const byLayer = [];
    layers.forEach((layer, box) => { if (!hidden.has(box)) (byLayer[layer] ??= []).push(box); });
    const tall = this.place.clientWidth < 560;
    const most = tall ? MANY.row : MANY.column;
    // A long column is broken into several.
    const columns = byLayer.filter(Boolean).flatMap((column) => {
      const size = Math.ceil(column.length / Math.ceil(column.length / most));
      return Array.from({ length: Math.ceil(column.length / size) }, (_, i) => column.slice(i * size, (i + 1) * size));
    });
    const [along, across] = tall ? [BOX.height + 34, BOX.width + BOX.down] : [BOX.width + BOX.across, BOX.height + BOX.down];
    const widest = Math.max(...columns.map((column) => column.length));
    const places = [];
    columns.forEach((column, i) => column.forEach((box, j) => {
      const [a, b] = [i * along, (j + (widest - column.length) / 2) * across];
      places[box] = tall ? { x: b, y: a } : { x: a, y: b };
    }));
    const [x, y] = ["x", "y"].map((axis) => Math.max(...places.filter(Boolean).map((place) => place[axis]), 0));
    // A few boxes are not drawn larger than they are.
    const [drawnWide, drawnTall] = [x + BOX.width + 24, y + BOX.height + 24];
    const [wide, high] = [Math.max(drawnWide, this.place.clientWidth), Math.max(drawnTall, 120)];
    // On a narrow screen the drawing is as high as it needs to be.
    this.svg.style.height = tall ? `${Math.min((high * this.place.clientWidth) / wide, 0.75 * innerHeight)}px` : "";
    this.whole = [-12 - (wide - drawnWide) / 2, -12 - (high - drawnTall) / 2, wide, high];
    const arrow = drawn("marker", { id: "arrow", viewBox: "0 0 6 6", refX: 6, refY: 3, markerWidth: 6, markerHeight: 6, orient: "auto" },
      drawn("path", { d: "M0 0L6 3L0 6z" }));
    const lines = list.map((edge) => {
      const path = drawn("path", { d: this.curve(places[edge.from], places[edge.to], tall), "marker-end": "url(#arrow)" },
        drawn("title", {}, edge.labels.slice(0, 12).join("\n")));
      return { path, from: names[edge.from] };
    });
    this.lines = lines;
    this.drawn = names.flatMap((path, i) => (hidden.has(i) ? [] : [this.box(path, boxes.get(path), places[i])]));
    this.svg.replaceChildren(drawn("defs", {}, arrow), ...lines.map(({ path }) => path), ...this.drawn.map(({ group }) => group));
    this.look(this.whole);
    this.mark();
  }

  // In a large drawing, nodes with one connection to and at most one from other boxes are left out, and their connections joined.
  joined(names, boxes, list) {
    const hidden = new Set();
    if (names.length <= MANY.boxes) return { list, hidden };
    const edges = new Set(list);
    names.forEach((path, box) => {
      if (boxes.get(path).length > 1 || path === this.shown) return;
      const into = [...edges].filter(({ to }) => to === box);
      const out = [...edges].filter(({ from }) => from === box);
      if (out.length !== 1 || into.length > 1) return;
      hidden.add(box);
      edges.delete(out[0]);
      into.forEach((edge) => {
        edges.delete(edge);
        if (edge.from !== out[0].to) edges.add({ from: edge.from, to: out[0].to, labels: [...edge.labels, ...out[0].labels] });
      });
    });
    return { list: [...edges], hidden };
  }

  // The column of each box: behind all boxes that lead to it, loops left out.
  layers(count, edges) {
    const next = Array.from({ length: count }, () => []);
    const entered = new Array(count).fill(0);
    edges.forEach(({ from, to }) => { next[from].push(to); entered[to] += 1; });
    const layer = new Array(count).fill(0);
    const left = new Set(Array.from({ length: count }, (_, i) => i));
    while (left.size) {
      // Without a box that nothing enters there is a loop: it is opened where the least enters.
      const box = [...left].reduce((best, one) => (entered[one] < entered[best] ? one : best));
      left.delete(box);
      for (const to of next[box]) {
        entered[to] -= 1;
        if (left.has(to)) layer[to] = Math.max(layer[to], layer[box] + 1);
      }
    }
    return layer;
  }

  curve(from, to, tall) {
    const { width, height } = BOX;
    if (tall) {
      const [x1, y1, x2, y2] = [from.x + width / 2, from.y + height, to.x + width / 2, to.y];
      const bend = Math.max(Math.abs(y2 - y1) / 2, 24);
      return `M${x1} ${y1}C${x1} ${y1 + bend} ${x2} ${y2 - bend} ${x2} ${y2}`;
    }
    const [x1, y1, x2, y2] = [from.x + width, from.y + height / 2, to.x, to.y + height / 2];
    const bend = Math.max(Math.abs(x2 - x1) / 2, 30);
    return `M${x1} ${y1}C${x1 + bend} ${y1} ${x2 - bend} ${y2} ${x2} ${y2}`;
  }

  box(path, nodes, { x, y }) {
    const shape = { x, y, width: BOX.width, height: BOX.height, rx: 6 };
    const lit = drawn("rect", { ...shape, class: "lit" });
    const name = nameOf(path);
    const lines = linesOf(partOf(path));
    const text = drawn("text", {}, ...lines.map((line, i) => drawn("tspan", { x: x + BOX.width / 2, y: y + BOX.height / 2 + 4 + 13 * (i - (lines.length - 1) / 2) }, line)));
    const many = nodes.length > 1 || this.graph.nodes[nodes[0]].path !== path;
    const group = drawn("g", { class: many ? "box many" : "box", tabindex: 0, role: "button", "data-path": path },
      drawn("title", {}, [many ? `${name}, ${nodes.length} nodes` : name, meaningOf(path), name === path ? "" : path].filter(Boolean).join("\n")),
      drawn("rect", shape), lit, text);
    group.setAttribute("aria-label", name);
    const act = () => (this.chosen === path ? this.turn(path) : this.choose(path));
    group.addEventListener("click", () => { if (!this.dragged) act(); });
    group.addEventListener("keydown", (event) => {
      if (event.key !== "Enter") return;
      event.preventDefault();
      act();
    });
    return { path, nodes, group, lit };
  }

  // Opens or closes a module; a node closes the module around it.
  turn(path) {
    const many = this.graph.nodes.some((node) => node.path.startsWith(`${path}/`));
    const above = path.split("/").slice(0, -1).join("/");
    if (many) this.open.add(path);
    else if (above) this.close(above);
    this.build();
    this.svg.querySelector(`[data-path="${CSS.escape(many ? path : above)}"]`)?.focus();
  }

  close(path) {
    this.open.forEach((one) => { if (one === path || one.startsWith(`${path}/`)) this.open.delete(one); });
  }

  foldAll() {
    this.open = new Set(this.firstOpen);
    this.build();
  }

  // Shows a module or node, wherever it is folded.
  find(path) {
    this.shown = path;
    const parts = path.split("/");
    for (let depth = 1; depth < parts.length; depth++) this.open.add(parts.slice(0, depth).join("/"));
    this.build();
  }

  mark() {
    for (const { path, group } of this.drawn) {
      group.classList.toggle("chosen", path === this.chosen);
      const held = [...this.held].some((at) => at === path || path.startsWith(`${at}/`) || at.startsWith(`${path}/`) || at.startsWith(`${path}.`));
      group.classList.toggle("held", held);
    }
  }

  show({ activity }) {
    activity.forEach((value, i) => { this.most[i] = Math.max(this.most[i], value); });
    const bright = new Map();
    for (const { path, nodes, lit } of this.drawn) {
      const share = Math.max(...nodes.map((node) => (activity[node] ?? 0) / this.most[node]));
      bright.set(path, share);
      steadily(lit, share, ({ style }, share) => { style.fillOpacity = (0.75 * share).toFixed(2); });
    }
    for (const { path, from } of this.lines) {
      steadily(path, bright.get(from) ?? 0, ({ style }, share) => {
        style.strokeOpacity = (0.25 + 0.7 * share).toFixed(2);
        style.strokeWidth = (1 + 1.5 * share).toFixed(2);
      });
    }
  }

  look(view) {
    this.view = view;
    this.svg.setAttribute("viewBox", view.join(" "));
  }

  zoom(by) {
    const [x, y, width, height] = this.view;
    this.look([x + (width * (1 - by)) / 2, y + (height * (1 - by)) / 2, width * by, height * by]);
  }

  listen() {
    let from = null;
    this.svg.addEventListener("pointerdown", (event) => {
      from = { x: event.clientX, y: event.clientY, view: this.view };
      this.dragged = false;
    });
    addEventListener("pointermove", (event) => {
      if (!from) return;
      const [dx, dy] = [event.clientX - from.x, event.clientY - from.y];
      if (!this.dragged && Math.hypot(dx, dy) < 5) return;
      this.dragged = true;
      const [x, y, width, height] = from.view;
      const scale = Math.max(width / this.svg.clientWidth, height / this.svg.clientHeight);
      this.look([x - dx * scale, y - dy * scale, width, height]);
    });
    addEventListener("pointerup", () => { from = null; });
    this.svg.addEventListener("wheel", (event) => {
      // The wheel scrolls the page until the reader has clicked the drawing.
      if (!this.svg.contains(document.activeElement)) return;
      event.preventDefault();
      this.zoom(event.deltaY > 0 ? 1.1 : 1 / 1.1);
    }, { passive: false });
  }
}
