// Names of the states at free places along the left and right rim of the picture, each with a line to its state.

// A narrow picture has room for a few names only; where the table and the arm leave none, for `least` that lie over them.
const RIM = { margin: 6, gap: 3, clear: 7, stay: 60, narrow: 600, few: 3, least: 2 };

const touching = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;

class Labels {
  constructor(overlay, anchors) {
    this.overlay = overlay;
    overlay.replaceChildren();
    this.lines = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    overlay.append(this.lines);
    this.labels = anchors.map(({ name, colour, at, goal }) => {
      const label = make("span", null, make("i"), name);
      label.title = name;
      label.firstChild.style.background = `#${colour.toString(16).padStart(6, "0")}`;
      const line = document.createElementNS("http://www.w3.org/2000/svg", "line");
      this.lines.append(line);
      overlay.append(label);
      return { label, line, at, goal };
    });
    this.shown = true;
  }

  measure(width, height) {
    this.width = width;
    this.height = height;
    for (const one of this.labels) {
      one.label.hidden = false;
      one.size = [one.label.offsetWidth, one.label.offsetHeight];
      one.place = null;
    }
  }

  get narrow() {
    return this.width < RIM.narrow;
  }

  show(visible) {
    this.shown = visible;
    this.overlay.hidden = !visible;
    // Hidden labels have no size.
    if (visible && this.width) this.measure(this.width, this.height);
  }

  // Puts every label where it covers nothing of `solid` (gripper and parts) and, if it can, nothing of `soft` (arm and
  // fixtures). A label stays at its place while the place is free. A state outside the picture has no label. A narrow picture has few
  // labels, those nearest to `focus` in the scene, and none over the `table` or the arm while there is room elsewhere. Without a
  // focus, those of goals and of what is near come first.
  place(camera, solid, soft, table, focus) {
    if (!this.shown || !this.width) return;
    const { narrow } = this;
    const seen = this.labels.map((one) => {
      const at = one.at();
      const apart = focus && at.distanceTo(focus);
      const { x, y, z } = at.project(camera);
      const omitted = z > 1 || Math.abs(x) > 1 || Math.abs(y) > 1;
      return { one, x: ((x + 1) / 2) * this.width, y: ((1 - y) / 2) * this.height, rank: apart ?? z - (one.goal ? 2 : 0), omitted };
    });
    seen.sort((a, b) => a.omitted - b.omitted || a.rank - b.rank);
    const only = (most) => seen.forEach((each, i) => { each.omitted ||= narrow && i >= most; });
    only(RIM.few);
    this.put(seen, narrow ? [...solid, ...table, ...soft] : solid, soft);
    if (!narrow || seen.some(({ one }) => one.place)) return;
    only(RIM.least);
    this.put(seen, solid, soft);
  }

  // Puts labels from top to bottom, so that few lines cross.
  put(seen, solid, soft) {
    const taken = [];
    for (const { one, x, y, omitted } of seen.toSorted((a, b) => a.y - b.y)) {
      one.place = omitted ? null : this.best(one, x, y, solid, soft, taken);
      one.label.hidden = !one.place;
      one.line.style.visibility = one.place ? "visible" : "hidden";
      if (!one.place) continue;
      const { left, right, top, bottom } = one.place;
      taken.push({ left, right, top: top - RIM.gap, bottom: bottom + RIM.gap });
      one.label.style.transform = `translate(${left}px, ${top}px)`;
      const end = clamp(x, left, right);
      for (const [key, value] of [["x1", end], ["y1", (top + bottom) / 2], ["x2", x], ["y2", y]]) {
        one.line.setAttribute(key, value.toFixed(1));
      }
    }
  }

  best(one, x, y, solid, soft, taken) {
    const [wide, tall] = one.size;
    let best = null;
    let least = Infinity;
    for (const left of [RIM.margin, this.width - RIM.margin - wide]) {
      for (let top = RIM.margin; top + tall + RIM.margin <= this.height; top += tall + RIM.gap) {
        const place = { left, top, right: left + wide, bottom: top + tall };
        const grown = {
          left: left - RIM.clear, right: place.right + RIM.clear, top: top - RIM.clear, bottom: place.bottom + RIM.clear,
        };
        if (solid.some((other) => touching(grown, other)) || taken.some((other) => touching(place, other))) continue;
        const same = one.place && one.place.left === left && one.place.top === top;
        const cost = Math.abs(x - clamp(x, place.left, place.right)) + 1.5 * Math.abs(y - (top + place.bottom) / 2)
          + (soft.some((other) => touching(place, other)) ? 150 : 0) - (same ? RIM.stay : 0);
        if (cost < least) [best, least] = [place, cost];
      }
    }
    return best;
  }

  // The labels' rectangles in the picture: for tests of the page.
  rectangles() {
    if (!this.shown) return [];
    return this.labels.filter((one) => one.place).map((one) => ({ ...one.place, name: one.label.title }));
  }
}

