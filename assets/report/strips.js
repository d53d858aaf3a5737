// The strips of the time axis: decisions and contacts, one module's values, spikes, and the scale.

const SIZES = { decide: 20, act: 22, touch: 20, plot: 118, band: 13, row: 2.2, name: 13, scale: 24, pad: 5 };
const FONT = "12px system-ui, sans-serif";
const SMALL = "11px system-ui, sans-serif";
// Number of seconds before the moment over which spikes are counted.
const RECENT_S = 0.05;

// A strip: a canvas with a line at the moment and one at the pointer.
class Strip {
  constructor(axis, label) {
    this.axis = axis;
    this.canvas = make("canvas");
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `${label}. Arrow keys move the moment and show the values there`);
    this.moment = make("i");
    this.moment.className = "moment";
    this.cursor = make("i");
    this.cursor.className = "cursor";
    this.box = make("div", null, this.canvas, this.cursor, this.moment);
    this.box.className = "lane";
  }

  paint() {
    const { canvas } = this;
    const width = canvas.clientWidth;
    if (!width) return;
    const height = this.height();
    const ratio = Math.min(window.devicePixelRatio, 2);
    canvas.style.height = `${height}px`;
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    const pen = canvas.getContext("2d");
    pen.scale(ratio, ratio);
    pen.font = FONT;
    pen.textBaseline = "middle";
    this.draw(pen, width, height);
  }

  // Draws only right of the gutter.
  within(pen, width, height, draw) {
    pen.save();
    pen.beginPath();
    pen.rect(this.axis.left, 0, width - this.axis.left - this.axis.right, height);
    pen.clip();
    draw();
    pen.restore();
  }

  title(pen, text, y) {
    pen.fillStyle = theme.colours.soft;
    pen.textAlign = "left";
    pen.fillText(text, 4, y);
  }
}

class Lanes extends Strip {
  constructor(axis, content) {
    super(axis, "Decisions, actions and contacts over simulated time");
    this.content = content;
  }

  height() {
    return SIZES.decide + SIZES.act + SIZES.touch + 2 * SIZES.pad;
  }

  draw(pen, width, height) {
    const rows = [SIZES.pad, SIZES.pad + SIZES.decide, SIZES.pad + SIZES.decide + SIZES.act];
    ["decides", "acts", "contacts"].forEach((name, i) => this.title(pen, name, rows[i] + 9));
    this.within(pen, width, height, () => {
      this.content.acts.forEach((act) => this.drawAct(pen, act, rows));
      this.content.touches.forEach((touch) => this.drawTouch(pen, touch, rows[2] + 10));
    });
  }

  drawAct(pen, act, rows) {
    const x = (time) => this.axis.x(time);
    const block = (from, to, row, fill) => {
      pen.fillStyle = fill;
      pen.fillRect(x(from), row, Math.max(x(to) - x(from), 1.5), 17);
    };
    block(act.asked, act.decided, rows[0], theme.colours.decide);
    if (!act.action) return;
    block(act.decided, act.until, rows[1], act.outcome === "placed" ? theme.colours.done : theme.colours.failed);
    pen.fillStyle = theme.colours.ink;
    pen.textAlign = "left";
    const from = Math.max(x(act.decided), this.axis.left);
    // Show as much text as there is room for. The outcome comes before the action.
    const texts = [`${act.action}: ${act.outcome}`, act.outcome, act.outcome[0]];
    const text = texts.find((text) => pen.measureText(text).width < x(act.until) - from - 8);
    if (text) pen.fillText(text, from + 4, rows[1] + 9);
  }

  drawTouch(pen, touch, y) {
    const x = this.axis.x(touch.t);
    const tip = touch.contact ? 5 : -5;
    pen.fillStyle = touch.contact ? theme.colours.touch : theme.colours.leave;
    pen.beginPath();
    pen.moveTo(x - 5, y - tip);
    pen.lineTo(x + 5, y - tip);
    pen.lineTo(x, y + tip);
    pen.fill();
    pen.textAlign = "left";
    pen.fillText(touch.name, x + 7, y);
  }

  tell(time) {
    return this.content.says(time);
  }
}

class Panel extends Strip {
  constructor(axis, content, chosen) {
    super(axis, "Values of a module over simulated time");
    this.content = content;
    this.chosen = chosen;
    this.hidden = new Set();
  }

  get module() {
    return this.content.modules[this.chosen];
  }

  height() {
    return SIZES.plot;
  }

  // The last sample at or before a moment: a value for each name.
  values(time) {
    const { module } = this;
    const sample = countUpTo(this.content.times, time) - 1;
    if (!module || sample < 0) return [];
    return module.names.map((_, column) => module.values[sample * module.names.length + column]);
  }

  draw(pen, width, height) {
    const { module } = this;
    const [low, high] = module?.range ?? [-0.1, 1.1];
    const at = (value) => height - SIZES.pad - ((value - low) / (high - low)) * (height - 2 * SIZES.pad);
    for (const value of [0, 0.5, 1]) {
      pen.fillStyle = theme.colours.line;
      pen.fillRect(this.axis.left, at(value), width - this.axis.left - this.axis.right, 1);
      pen.fillStyle = theme.colours.soft;
      pen.textAlign = "right";
      pen.fillText(String(value), this.axis.left - 6, at(value));
    }
    this.title(pen, module ? (module.shows === "activities" ? "activity" : "cosine") : "no data", at(0.75));
    if (!module) return;
    this.within(pen, width, height, () => {
      module.names.forEach((name, column) => {
        if (!this.hidden.has(name)) this.drawLine(pen, module, column, at);
      });
    });
  }

  drawLine(pen, module, column, at) {
    const { times } = this.content;
    const [from, to] = this.axis.view;
    const first = Math.max(countUpTo(times, from) - 1, 0);
    const last = Math.min(countUpTo(times, to) + 1, times.length);
    pen.strokeStyle = theme.line(column);
    pen.setLineDash(theme.dash(column));
    pen.lineWidth = 1.6;
    pen.beginPath();
    // Of samples that share a pixel, draw only the least and the greatest.
    let pixel = null;
    let least = 0;
    let greatest = 0;
    for (let i = first; i < last; i++) {
      const x = Math.round(this.axis.x(times[i]) * 2) / 2;
      const value = module.values[i * module.names.length + column];
      if (x === pixel) {
        if (value < least) pen.lineTo(x, at((least = value)));
        if (value > greatest) pen.lineTo(x, at((greatest = value)));
        continue;
      }
      if (pixel === null) pen.moveTo(x, at(value));
      else pen.lineTo(x, at(value));
      [pixel, least, greatest] = [x, value, value];
    }
    pen.stroke();
    pen.setLineDash([]);
  }

  tell(time) {
    const { module } = this;
    const values = this.values(time);
    if (!values.length) return ["no values here"];
    const order = values.map((value, i) => [value, module.names[i]])
      .filter(([, name]) => !this.hidden.has(name)).sort((a, b) => b[0] - a[0]);
    return [module.name, ...order.slice(0, 8).map(([value, name]) => `${name} ${value.toFixed(2)}`)];
  }
}

class Raster extends Strip {
  constructor(axis, content) {
    super(axis, "Spikes over simulated time");
    this.content = content;
    const paths = content.populations.map(({ path }) => path.split("/"));
    // The first name of the paths is left out where all share it.
    const shared = paths.length > 1 && paths.every((path) => path.length > 1 && path[0] === paths[0][0]);
    let row = 0;
    this.bands = content.populations.map((population, i) => {
      const band = { ...population, name: paths[i].slice(shared ? 1 : 0).join("/"), first: row };
      row += population.rows;
      return band;
    });
  }

  // Width that the names need beside the bands.
  nameWidth() {
    const pen = this.canvas.getContext("2d");
    pen.font = SMALL;
    return Math.max(...this.bands.map(({ name }) => pen.measureText(name).width)) + 12;
  }

  // The bands from the top; names stand above them where the gutter is too narrow.
  laid() {
    const above = this.axis.namesAbove ? SIZES.name : 0;
    let y = SIZES.pad;
    return this.bands.map((band) => {
      const top = y + above;
      const height = Math.max(band.rows * SIZES.row, above ? 0 : SIZES.band);
      y = top + height + 2;
      return { ...band, top, height, name_y: above ? top - 6 : top + height / 2 };
    });
  }

  height() {
    const last = this.laid().at(-1);
    return last.top + last.height + SIZES.pad;
  }

  draw(pen, width, height) {
    const bands = this.laid();
    const places = new Float32Array(bands.reduce((sum, { rows }) => sum + rows, 0));
    pen.font = SMALL;
    for (const band of bands) {
      this.title(pen, band.name, band.name_y);
      pen.fillStyle = theme.colours.band;
      pen.fillRect(this.axis.left, band.top, width - this.axis.left - this.axis.right, band.height);
      for (let i = 0; i < band.rows; i++) places[band.first + i] = band.top + i * SIZES.row;
    }
    const { spikes } = this.content;
    const [from, to] = this.axis.view;
    const last = countUpTo(spikes.t, to);
    pen.fillStyle = theme.colours.ink;
    this.within(pen, width, height, () => {
      for (let i = countUpTo(spikes.t, from); i < last; i++) {
        pen.fillRect(this.axis.x(spikes.t[i]) - 0.5, places[spikes.row[i]], 1, SIZES.row);
      }
    });
  }

  // Spikes of each population in the time up to a moment.
  counts(time) {
    const { spikes } = this.content;
    const counts = this.bands.map(() => 0);
    for (let i = countUpTo(spikes.t, time - RECENT_S); i < spikes.t.length && spikes.t[i] <= time; i++) {
      const band = this.bands.findLastIndex(({ first }) => first <= spikes.row[i]);
      if (band >= 0) counts[band] += 1;
    }
    return counts;
  }

  tell(time, y) {
    const counts = this.counts(time);
    const said = ({ name }, i) => `${name} ${counts[i]}`;
    const span = `spikes in the last ${1000 * RECENT_S} ms`;
    if (y === undefined) return [span, ...this.bands.map(said)];
    const bands = this.laid();
    const index = Math.max(bands.findLastIndex(({ top, name_y: name }) => Math.min(top, name) - 6 <= y), 0);
    const { name, rows, neurons, top } = bands[index];
    const neuron = clamp(Math.floor((y - top) / SIZES.row), 0, rows - 1) + 1;
    return [name, `row ${neuron} of ${rows}, from ${neurons} neurons`, `${span}: ${counts[index]}`];
  }
}

class Scale extends Strip {
  constructor(axis) {
    super(axis, "Simulated time in seconds");
    this.canvas.tabIndex = -1;
  }

  height() {
    return SIZES.scale;
  }

  draw(pen, width) {
    const [from, to] = this.axis.view;
    const rough = ((to - from) * 90) / Math.max(width - this.axis.left, 90);
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((n) => n * power).find((s) => s >= rough) ?? 10 * power;
    const digits = Math.max(0, -Math.floor(Math.log10(step)));
    pen.fillStyle = theme.colours.soft;
    for (let tick = Math.ceil(from / step); tick * step <= to; tick++) {
      const x = this.axis.x(tick * step);
      const text = (tick * step).toFixed(digits);
      const half = pen.measureText(text).width / 2;
      pen.fillRect(x, 0, 1, 5);
      pen.textAlign = "center";
      pen.fillText(text, Math.min(x, width - half - 1), 14);
    }
    this.title(pen, "time, s", 14);
  }

  tell() {
    return [];
  }
}

