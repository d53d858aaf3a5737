// The time axis: decisions and actions, touches, one module's numbers, spikes.

const LANES = { left: 78, right: 12, axis: 26, acts: 46, touches: 26, plot: 170, gap: 10, row: 2.2 };

class Timeline {
  constructor(canvas, content, seek) {
    this.canvas = canvas;
    this.content = content;
    this.seek = seek;
    this.chosen = 0;
    this.hidden = new Set();
    this.time = 0;
    this.view = [0, content.duration];
    this.listen();
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  get rasterHeight() {
    return this.content.rows > 0 ? this.content.rows * LANES.row + LANES.gap : 0;
  }

  get height() {
    return LANES.acts + LANES.touches + LANES.plot + this.rasterHeight + LANES.axis + 2 * LANES.gap;
  }

  x(time) {
    const [from, to] = this.view;
    return LANES.left + ((time - from) / (to - from)) * (this.width - LANES.left - LANES.right);
  }

  timeAt(x) {
    const [from, to] = this.view;
    return from + ((x - LANES.left) / (this.width - LANES.left - LANES.right)) * (to - from);
  }

  // Shows from one moment to another, at least 20 ms and within the episode.
  look(from, to) {
    const all = this.content.duration;
    const length = clamp(to - from, Math.min(0.02, all), all);
    const begin = clamp((from + to - length) / 2, 0, all - length);
    this.view = [begin, begin + length];
    this.draw();
  }

  zoom(factor, about = this.time) {
    const [from, to] = this.view;
    const middle = clamp(about, from, to);
    this.look(middle - (middle - from) * factor, middle + (to - middle) * factor);
  }

  // Moves the picture along if the moment is no longer in it.
  at(time) {
    this.time = time;
    const [from, to] = this.view;
    if (time < from || time > to) {
      const begin = time < from ? time - 0.9 * (to - from) : time - 0.1 * (to - from);
      this.look(begin, begin + to - from);
    } else {
      this.draw();
    }
  }

  listen() {
    const { canvas } = this;
    let start = null;
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button !== 0 || !event.isPrimary) return;
      start = { x: event.offsetX, view: this.view.slice(), moved: false };
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!start || !event.isPrimary) return;
      const by = event.offsetX - start.x;
      start.moved ||= Math.abs(by) > 4;
      if (!start.moved) return;
      const [from, to] = start.view;
      const shift = (by / (this.width - LANES.left - LANES.right)) * (to - from);
      this.look(from - shift, to - shift);
    });
    canvas.addEventListener("pointerup", (event) => {
      if (!event.isPrimary) return;
      if (start && !start.moved) this.seek(this.timeAt(event.offsetX));
      start = null;
    });
    canvas.addEventListener("pointercancel", () => { start = null; });
    // Over a picture that nobody has taken hold of, the wheel scrolls the page.
    canvas.addEventListener("wheel", (event) => {
      if (event.deltaY === 0 || !(event.ctrlKey || document.activeElement === canvas)) return;
      event.preventDefault();
      this.zoom(event.deltaY > 0 ? 1.25 : 0.8, this.timeAt(event.offsetX));
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      const way = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (!way) return;
      event.preventDefault();
      this.seek(this.time + (way * (this.view[1] - this.view[0])) / 50);
    });
  }

  draw() {
    const { canvas } = this;
    this.width = canvas.clientWidth;
    if (!this.width) return;
    const ratio = Math.min(window.devicePixelRatio, 2);
    canvas.style.height = `${this.height}px`;
    canvas.width = Math.round(this.width * ratio);
    canvas.height = Math.round(this.height * ratio);
    const pen = canvas.getContext("2d");
    pen.scale(ratio, ratio);
    pen.font = "12px system-ui, sans-serif";
    pen.textBaseline = "middle";
    let y = LANES.gap;
    this.drawActs(pen, y);
    y += LANES.acts;
    this.drawTouches(pen, y);
    y += LANES.touches;
    this.drawPlot(pen, y);
    y += LANES.plot + LANES.gap;
    if (this.rasterHeight) this.drawSpikes(pen, y);
    y += this.rasterHeight;
    this.drawAxis(pen, y);
    const x = this.x(this.time);
    if (x >= LANES.left) {
      pen.fillStyle = "#d55e00";
      pen.fillRect(x - 0.75, 0, 1.5, y);
    }
  }

  // Draws only right of the lanes' names.
  within(pen, y, height, draw) {
    pen.save();
    pen.beginPath();
    pen.rect(LANES.left, y, this.width - LANES.left - LANES.right, height);
    pen.clip();
    draw();
    pen.restore();
  }

  title(pen, text, y) {
    pen.fillStyle = "#5a6675";
    pen.textAlign = "left";
    pen.fillText(text, 6, y);
  }

  drawActs(pen, y) {
    this.title(pen, "decides", y + 9);
    this.title(pen, "acts", y + 29);
    this.within(pen, y, LANES.acts, () => {
      for (const act of this.content.acts) {
        const block = (from, to, row, fill) => {
          pen.fillStyle = fill;
          pen.fillRect(this.x(from), y + row, Math.max(this.x(to) - this.x(from), 1.5), 17);
        };
        block(act.asked, act.decided, 0, "#1c2430");
        if (!act.action) continue;
        block(act.decided, act.until, 20, act.outcome === "placed" ? "#bfe3d3" : "#f3cdb8");
        pen.fillStyle = "#1c2430";
        pen.textAlign = "left";
        const room = this.x(act.until) - Math.max(this.x(act.decided), LANES.left) - 8;
        // As much as there is room for; what came of it before what it was.
        const said = [`${act.action}: ${act.outcome}`, act.outcome, act.outcome[0]];
        const text = said.find((text) => pen.measureText(text).width < room);
        if (text) pen.fillText(text, Math.max(this.x(act.decided), LANES.left) + 4, y + 29);
      }
    });
  }

  drawTouches(pen, y) {
    this.title(pen, "touches", y + 9);
    this.within(pen, y, LANES.touches, () => {
      for (const touch of this.content.touches) {
        const x = this.x(touch.t);
        pen.fillStyle = touch.contact ? "#009e73" : "#cc79a7";
        pen.beginPath();
        const tip = touch.contact ? 1 : -1;
        pen.moveTo(x - 5, y + 9 - 5 * tip);
        pen.lineTo(x + 5, y + 9 - 5 * tip);
        pen.lineTo(x, y + 9 + 5 * tip);
        pen.fill();
        pen.textAlign = "left";
        pen.fillText(touch.name, x + 7, y + 9);
      }
    });
  }

  drawPlot(pen, y) {
    const module = this.content.modules[this.chosen];
    const [low, high] = module?.range ?? [-0.1, 1.1];
    const height = LANES.plot;
    const at = (value) => y + height - ((value - low) / (high - low)) * height;
    pen.textAlign = "right";
    for (const value of [0, 0.5, 1]) {
      pen.fillStyle = "#e3e7ec";
      pen.fillRect(LANES.left, at(value), this.width - LANES.left - LANES.right, 1);
      pen.fillStyle = "#5a6675";
      pen.fillText(String(value), LANES.left - 6, at(value));
    }
    this.title(pen, module ? (module.shows === "activities" ? "activity" : "cosine") : "no data", at(0.75));
    if (!module) return;
    const { times } = this.content;
    const columns = module.names.length;
    const first = Math.max(countUpTo(times, this.view[0]) - 1, 0);
    const last = Math.min(countUpTo(times, this.view[1]) + 1, times.length);
    this.within(pen, y, height, () => {
      for (let column = 0; column < columns; column++) {
        if (this.hidden.has(module.names[column])) continue;
        pen.strokeStyle = colour(column);
        pen.lineWidth = 1.5;
        pen.beginPath();
        // Of samples that share a pixel, the least and the greatest.
        let pixel = null;
        let least = 0;
        let greatest = 0;
        for (let i = first; i < last; i++) {
          const x = Math.round(this.x(times[i]) * 2) / 2;
          const value = module.values[i * columns + column];
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
      }
    });
  }

  drawSpikes(pen, y) {
    const { spikes, populations } = this.content;
    let row = 0;
    pen.font = "10px system-ui, sans-serif";
    for (const [index, population] of populations.entries()) {
      const top = y + row * LANES.row;
      const name = population.path.split("/").slice(1).join("/");
      if (population.rows * LANES.row > 9) this.title(pen, name.length > 13 ? `${name.slice(0, 12)}…` : name, top + 6);
      pen.fillStyle = index % 2 ? "#f4f6f8" : "#ffffff";
      pen.fillRect(LANES.left, top, this.width - LANES.left - LANES.right, population.rows * LANES.row);
      row += population.rows;
    }
    pen.font = "12px system-ui, sans-serif";
    const first = countUpTo(spikes.t, this.view[0]);
    const last = countUpTo(spikes.t, this.view[1]);
    pen.fillStyle = "#1c2430";
    this.within(pen, y, this.rasterHeight, () => {
      for (let i = first; i < last; i++) {
        pen.fillRect(this.x(spikes.t[i]) - 0.5, y + spikes.row[i] * LANES.row, 1, LANES.row);
      }
    });
  }

  drawAxis(pen, y) {
    const [from, to] = this.view;
    const rough = ((to - from) * 90) / Math.max(this.width - LANES.left, 90);
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((n) => n * power).find((s) => s >= rough);
    const digits = Math.max(0, -Math.floor(Math.log10(step)));
    pen.fillStyle = "#5a6675";
    pen.textAlign = "center";
    for (let tick = Math.ceil(from / step); tick * step <= to; tick++) {
      pen.fillRect(this.x(tick * step), y, 1, 5);
      pen.fillText((tick * step).toFixed(digits), this.x(tick * step), y + 14);
    }
    this.title(pen, "time, s", y + 14);
  }
}

