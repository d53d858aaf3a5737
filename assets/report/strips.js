// The strips of the time axis: decisions and contacts, one module's values, and the scale.

const SIZES = { decide: 20, act: 22, touch: 20, plot: 118, band: 14, row: 2.2, name: 13, scale: 24, pad: 5 };
const FONT = "12px system-ui, sans-serif";
const SMALL = "11px system-ui, sans-serif";

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
      const { touches } = this.content;
      touches.forEach((touch, i) => this.drawTouch(pen, touch, rows[2] + 10, touches[i + 1]));
      for (const { t } of this.content.displaced) this.drawHand(pen, this.axis.x(t), rows[2] + 10);
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
    block(act.decided, act.until, rows[1], act.well ? theme.colours.done : theme.colours.failed);
    pen.fillStyle = theme.colours.ink;
    pen.textAlign = "left";
    const from = Math.max(x(act.decided), this.axis.left);
    // Show as much text as there is room for. The outcome comes before the action.
    const texts = [`${act.words}: ${act.came}`, act.words, act.came];
    const text = texts.find((text) => pen.measureText(text).width < x(act.until) - from - 8);
    if (text) pen.fillText(text, from + 4, rows[1] + 9);
  }

  // What another hand did: a diamond.
  drawHand(pen, x, y) {
    pen.fillStyle = theme.colours.now;
    pen.beginPath();
    pen.moveTo(x, y - 7);
    pen.lineTo(x + 6, y);
    pen.lineTo(x, y + 7);
    pen.lineTo(x - 6, y);
    pen.fill();
  }

  // The name stands beside the mark if there is room before the next one.
  drawTouch(pen, touch, y, next) {
    const x = this.axis.x(touch.t);
    const tip = touch.contact ? 5 : -5;
    pen.fillStyle = touch.contact ? theme.colours.touch : theme.colours.leave;
    pen.beginPath();
    pen.moveTo(x - 5, y - tip);
    pen.lineTo(x + 5, y - tip);
    pen.lineTo(x, y + tip);
    pen.fill();
    const room = (next ? this.axis.x(next.t) - 11 : this.axis.width - this.axis.right) - x - 7;
    if (pen.measureText(touch.name).width > room) return;
    pen.textAlign = "left";
    pen.fillText(touch.name, x + 7, y);
  }

  tell(time) {
    return this.content.says(time);
  }
}

// What the numbers of a module are.
const UNITS = { activities: "activity", similarities: "cosine" };

// Round numbers between two, about three of them.
function rounds(low, high) {
  const rough = (high - low) / 3;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((n) => n * power).find((s) => s >= rough) ?? 10 * power;
  const first = Math.ceil(low / step);
  return Array.from({ length: Math.floor(high / step) - first + 1 }, (_, i) => Number(((first + i) * step).toPrecision(6)));
}

// For how long a sample holds if none follows, or if one follows only after a gap, in seconds.
const HOLDS_S = 0.1;
const NO_GAPS = new Set();

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

  // When the module's values were sampled.
  get times() {
    return this.module?.times ?? this.content.times;
  }

  // The samples before which some are missing: no line leads to them.
  get gaps() {
    return this.module?.times ? NO_GAPS : this.content.gaps ?? NO_GAPS;
  }

  // Colour and dashes of a curve.
  look(column) {
    return this.module?.look?.(column) ?? { colour: theme.line(column), dash: theme.dash(column) };
  }

  // The samples as a table.
  csv() {
    const { module, times } = this;
    const rows = [["time_s", ...module.names.map(csvField)].join(",")];
    for (let i = 0; i < times.length; i++) {
      const own = module.values.subarray(i * module.names.length, (i + 1) * module.names.length);
      rows.push([times[i].toFixed(4), ...Array.from(own, (v) => Number(v.toPrecision(6)))].join(","));
    }
    return `${rows.join("\n")}\n`;
  }

  height() {
    return SIZES.plot;
  }

  // The last sample at or before a moment: a value for each name.
  values(time) {
    const { module } = this;
    if (!module) return [];
    const sample = countUpTo(this.times, time) - 1;
    const last = sample + 1 === this.times.length || this.gaps.has(sample + 1);
    if (sample < 0 || (last && time - this.times[sample] > HOLDS_S)) return [];
    return module.names.map((_, column) => module.values[sample * module.names.length + column]);
  }

  draw(pen, width, height) {
    const { module } = this;
    const [low, high] = module?.range ?? [-0.1, 1.1];
    const at = (value) => height - SIZES.pad - ((value - low) / (high - low)) * (height - 2 * SIZES.pad);
    for (const value of rounds(low, high)) {
      pen.fillStyle = theme.colours.line;
      pen.fillRect(this.axis.left, at(value), width - this.axis.left - this.axis.right, 1);
      pen.fillStyle = theme.colours.soft;
      pen.textAlign = "right";
      pen.fillText(String(value), this.axis.left - 6, at(value));
    }
    // Between two numbers of the axis, where there is room.
    const unit = module ? UNITS[module.shows] ?? module.shows : "no data";
    const [one, two] = rounds(low, high).slice(-2);
    if (pen.measureText(unit).width < this.axis.left - 4) this.title(pen, unit, at(two === undefined ? high : (one + two) / 2));
    if (!module) return;
    this.within(pen, width, height, () => {
      module.names.forEach((name, column) => {
        if (!this.hidden.has(name)) this.drawLine(pen, module, column, at);
      });
    });
  }

  drawLine(pen, module, column, at) {
    const { times } = this;
    const { colour, dash } = this.look(column);
    const [from, to] = this.axis.view;
    const first = Math.max(countUpTo(times, from) - 1, 0);
    const last = Math.min(countUpTo(times, to) + 1, times.length);
    pen.strokeStyle = colour;
    pen.setLineDash(dash);
    pen.lineWidth = 1.6;
    pen.beginPath();
    // Of samples that share a pixel, draw only the least and the greatest.
    let pixel = null;
    let least = 0;
    let greatest = 0;
    let before = 0;
    for (let i = first; i < last; i++) {
      const x = Math.round(this.axis.x(times[i]) * 2) / 2;
      const value = module.values[i * module.names.length + column];
      const joined = i > first && !this.gaps.has(i);
      if (x === pixel && joined) {
        if (value < least) pen.lineTo(x, at((least = value)));
        if (value > greatest) pen.lineTo(x, at((greatest = value)));
        before = value;
        continue;
      }
      // The line leaves a pixel at its last value, not at the extreme that was drawn last.
      if (joined) {
        pen.lineTo(pixel, at(before));
        pen.lineTo(x, at(value));
      } else {
        pen.moveTo(x, at(value));
      }
      [pixel, least, greatest, before] = [x, value, value, value];
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
    return [module.title ?? module.name, ...order.slice(0, 8).map(([value, name]) => `${this.content.say(name)} ${value.toFixed(2)}`)];
  }
}

class Scale extends Strip {
  constructor(axis) {
    super(axis, "");
    this.canvas.removeAttribute("tabindex");
    this.canvas.setAttribute("aria-label", "Simulated time in seconds");
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

