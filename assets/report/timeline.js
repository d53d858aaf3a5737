// The time axis: strips that share one span of simulated time, the moment, and the values at the pointer.

const GUTTER = { least: 62, share: 0.24, right: 10 };

class Timeline {
  constructor(box, content, seek) {
    this.box = box;
    this.content = content;
    this.seek = seek;
    this.time = 0;
    this.pointer = null;
    this.view = [0, content.duration];
    this.right = GUTTER.right;
    this.left = GUTTER.least;
    this.tip = box.querySelector(".tip");
    // Without a robot there are no decisions and no contacts.
    this.lanes = content.acts ? new Lanes(this, content) : null;
    this.raster = null;
    this.scale = new Scale(this);
    this.panels = [];
    if (this.lanes) byId("lanes").append(this.lanes.box);
    byId("scale").append(this.scale.box);
    [...(this.lanes ? [this.lanes] : []), this.scale].forEach((strip) => this.listen(strip));
    theme.listeners.push(() => this.draw());
    new ResizeObserver(() => this.draw()).observe(box);
  }

  // Takes over content that has changed, and shows all of it.
  refill() {
    const { content } = this;
    this.pointer = null;
    this.raster = content.rows > 0 ? new Raster(this, content) : null;
    const head = make("div", null, make("span", "Spikes, folded by module: press a name to unfold it"),
      ...exportButtons("the spikes", () => this.raster, () => this.raster.csv()));
    head.className = "controls";
    byId("raster").replaceChildren(...(this.raster ? [head, this.raster.box] : []));
    if (this.raster) this.listen(this.raster);
    this.look(0, content.duration);
  }

  get strips() {
    return [...(this.lanes ? [this.lanes] : []), ...this.panels, ...(this.raster ? [this.raster] : []), this.scale];
  }

  get width() {
    return this.scale.canvas.clientWidth;
  }

  addPanel(index) {
    const panel = new Panel(this, this.content, index);
    this.panels.push(panel);
    this.listen(panel);
    return panel;
  }

  removePanel(panel) {
    this.panels = this.panels.filter((other) => other !== panel);
  }

  x(time) {
    const [from, to] = this.view;
    return this.left + ((time - from) / (to - from)) * (this.width - this.left - this.right);
  }

  timeAt(x) {
    const [from, to] = this.view;
    return from + ((x - this.left) / Math.max(this.width - this.left - this.right, 1)) * (to - from);
  }

  // Shows the span between two moments, at least 20 ms and within the episode.
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

  // Moves the span along if the moment is no longer in it.
  at(time) {
    this.time = time;
    const [from, to] = this.view;
    if (time < from || time > to) {
      const begin = time < from ? time - 0.9 * (to - from) : time - 0.1 * (to - from);
      this.look(begin, begin + to - from);
    } else {
      this.mark();
    }
  }

  draw() {
    const { width } = this;
    if (!width) return;
    const names = this.raster?.nameWidth() ?? 0;
    this.namesAbove = names > Math.max(GUTTER.share * width, GUTTER.least);
    this.left = this.namesAbove ? GUTTER.least : Math.max(names, GUTTER.least);
    this.strips.forEach((strip) => strip.paint());
    this.mark();
  }

  // Puts the lines at the moment and at the pointer, and the values beside them.
  mark() {
    const put = (line, time) => {
      const x = time === null ? -1 : this.x(time);
      line.hidden = x < this.left - 0.5 || x > this.width - this.right + 0.5;
      line.style.transform = `translateX(${x}px)`;
    };
    for (const strip of this.strips) {
      put(strip.moment, this.time);
      put(strip.cursor, this.pointer?.time ?? null);
    }
    this.tellTip();
    this.content.valued?.();
  }

  // The moment whose values are shown: at the pointer, or else the page's own.
  get asked() {
    return this.pointer?.time ?? this.time;
  }

  tellTip() {
    const focused = this.strips.find((strip) => strip.canvas === document.activeElement && strip.keyed);
    const strip = this.pointer?.strip ?? focused;
    const lines = strip ? strip.tell(this.asked, this.pointer?.y) : [];
    this.tip.hidden = lines.length === 0;
    if (this.tip.hidden) return;
    this.tip.replaceChildren(...[seconds(this.asked, 3), ...lines].map((line) => make("div", line)));
    const x = this.x(this.asked);
    const { offsetWidth: wide, offsetHeight: tall } = this.tip;
    const left = x + 14 + wide <= this.width ? x + 14 : x - 14 - wide;
    const top = strip.box.offsetTop + Math.min(this.pointer?.y ?? 4, Math.max(strip.canvas.clientHeight - tall, 0));
    this.tip.style.transform = `translate(${clamp(left, 0, Math.max(this.width - wide, 0))}px, ${top}px)`;
  }

  listen(strip) {
    const { canvas } = strip;
    let start = null;
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button !== 0 || !event.isPrimary) return;
      strip.keyed = false;
      start = { x: event.offsetX, view: this.view.slice(), moved: false };
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!event.isPrimary) return;
      const time = this.timeAt(event.offsetX);
      const [from, to] = this.view;
      this.pointer = time >= from && time <= to ? { strip, time, y: event.offsetY } : null;
      const by = start ? event.offsetX - start.x : 0;
      if (start) start.moved ||= Math.abs(by) > 4;
      if (start?.moved) {
        const shift = (by / (this.width - this.left - this.right)) * (start.view[1] - start.view[0]);
        this.look(start.view[0] - shift, start.view[1] - shift);
      } else {
        this.mark();
      }
    });
    canvas.addEventListener("pointerup", (event) => {
      if (!event.isPrimary) return;
      const pressed = start && !start.moved;
      start = null;
      const name = this.namesAbove ? event.pointerType === "touch" : event.offsetX < this.left;
      if (pressed && name && strip.toggle?.(event.offsetY)) this.draw();
      else if (pressed) this.seek(this.timeAt(event.offsetX));
    });
    const leave = () => {
      start = null;
      this.pointer = null;
      this.mark();
    };
    canvas.addEventListener("pointercancel", leave);
    canvas.addEventListener("pointerleave", leave);
    canvas.addEventListener("keydown", () => { strip.keyed = true; });
    canvas.addEventListener("blur", () => { strip.keyed = false; this.mark(); });
    // The wheel scrolls the page until the reader has clicked the strip.
    canvas.addEventListener("wheel", (event) => {
      if (event.deltaY === 0 || !(event.ctrlKey || document.activeElement === canvas)) return;
      event.preventDefault();
      this.zoom(event.deltaY > 0 ? 1.25 : 0.8, this.timeAt(event.offsetX));
    }, { passive: false });
  }
}

