// The spikes of all populations, folded by module: a folded module is one row that is darker where it fires more.

// Number of seconds before the moment over which spikes are counted.
const RECENT_S = 0.05;
// So many populations are shown with a row for each neuron from the beginning; of more, the busiest modules are shown, folded.
const FEW = 8;
const BUSIEST = 16;

class Raster extends Strip {
  constructor(axis, content) {
    super(axis, "Spikes over simulated time");
    this.content = content;
    const paths = content.populations.map(({ path }) => path.split("/"));
    // The first name of the paths is left out where all share it.
    const shared = paths.length > 1 && paths.every((path) => path.length > 1 && path[0] === paths[0][0]) ? 1 : 0;
    const groups = new Map();
    let row = 0;
    this.bands = content.populations.map((population, i) => {
      const parts = partsOf(population.path);
      const last = parts.at(-1);
      const band = { ...population, name: NOTES[last.path] ? last.name : parts.slice(shared).map(({ name }) => name).join("/"), first: row };
      row += population.rows;
      const top = paths[i].slice(0, shared + 1).join("/");
      groups.set(top, [...(groups.get(top) ?? []), band]);
      return band;
    });
    const open = this.bands.length <= FEW;
    // A module with one layer goes by the name of the module.
    for (const [top, [only, ...others]] of groups) if (!others.length && only.path.split("/").length === shared + 2) only.name = partOf(top);
    this.groups = [...groups].map(([top, bands]) => ({ path: top, name: bands.length === 1 ? bands[0].name : partOf(top), bands, open, spikes: 0 }));
    this.ofRow = this.groups.reduce((of, group, i) => {
      for (const { first, rows } of group.bands) of.fill(i, first, first + rows);
      return of;
    }, new Uint16Array(row));
    for (const neuron of content.spikes.row) this.groups[this.ofRow[neuron]].spikes += 1;
    this.all = this.groups.length <= BUSIEST;
  }

  // The modules that are shown: all, or the busiest.
  get seen() {
    if (this.all) return this.groups;
    const busiest = new Set([...this.groups].sort((a, b) => b.spikes - a.spikes).slice(0, BUSIEST));
    return this.groups.filter((group) => busiest.has(group));
  }

  // Unfolds all modules, or folds them all.
  unfold(open) {
    this.groups.forEach((group) => { group.open = open; });
    this.all = open || this.groups.length <= BUSIEST;
  }

  // Width that the names need beside the bands.
  nameWidth() {
    const pen = this.canvas.getContext("2d");
    pen.font = SMALL;
    return Math.max(...this.groups.flatMap(({ name, bands }) => [name, ...bands.map((band) => band.name)])
      .map((name) => pen.measureText(`▸ ${name}`).width)) + 12;
  }

  // The rows from the top; names stand above them where the gutter is too narrow.
  laid() {
    const above = this.axis.namesAbove ? SIZES.name : 0;
    let y = SIZES.pad;
    const lay = (group, band, name, size) => {
      const top = y + above;
      const height = Math.max(size, above ? 0 : SIZES.band);
      y = top + height + 2;
      return { group, band, name, top, height, name_y: above ? top - 6 : top + height / 2 };
    };
    return this.seen.flatMap((group) => (group.open
      ? group.bands.map((band) => lay(group, band, band.name, band.rows * SIZES.row))
      : [lay(group, null, group.name, SIZES.band)]));
  }

  height() {
    const last = this.laid().at(-1);
    return last.top + last.height + SIZES.pad;
  }

  // Unfolds or folds the module at a height. Returns whether there is one.
  toggle(y) {
    const row = this.laid().findLast(({ top, name_y: name }) => Math.min(top, name) - 6 <= y);
    if (row) row.group.open = !row.group.open;
    return Boolean(row);
  }

  draw(pen, width, height) {
    const rows = this.laid();
    const places = new Float32Array(this.ofRow.length).fill(NaN);
    const folded = new Map();
    pen.font = SMALL;
    for (const { group, band, name, top, height: tall, name_y: nameY } of rows) {
      this.title(pen, `${group.open ? "▾" : "▸"} ${name}`, nameY);
      pen.fillStyle = theme.colours.band;
      pen.fillRect(this.axis.left, top, width - this.axis.left - this.axis.right, tall);
      if (band) for (let i = 0; i < band.rows; i++) places[band.first + i] = top + i * SIZES.row;
      else folded.set(this.groups.indexOf(group), { top, tall, counts: new Uint32Array(Math.ceil(width) + 1) });
    }
    const { spikes } = this.content;
    const [from, to] = this.axis.view;
    const last = countUpTo(spikes.t, to);
    pen.fillStyle = theme.colours.ink;
    this.within(pen, width, height, () => {
      for (let i = countUpTo(spikes.t, from); i < last; i++) {
        const x = this.axis.x(spikes.t[i]);
        const y = places[spikes.row[i]];
        if (y === y) pen.fillRect(x - 0.5, y, 1, SIZES.row);
        else {
          const row = folded.get(this.ofRow[spikes.row[i]]);
          if (row) row.counts[Math.max(Math.round(x), 0)] += 1;
        }
      }
      for (const { top, tall, counts } of folded.values()) {
        const most = counts.reduce((most, count) => Math.max(most, count), 1);
        counts.forEach((count, x) => {
          if (count === 0) return;
          pen.globalAlpha = 0.25 + 0.75 * (count / most);
          pen.fillRect(x - 0.5, top, 1, tall);
        });
      }
      pen.globalAlpha = 1;
    });
  }

  // All spikes as a table.
  csv() {
    const { spikes } = this.content;
    const rows = ["time_s,layer,row"];
    for (let i = 0; i < spikes.t.length; i++) {
      const band = this.bands.findLast(({ first }) => first <= spikes.row[i]);
      rows.push(`${spikes.t[i].toFixed(4)},${csvField(band.path)},${spikes.row[i] - band.first}`);
    }
    return `${rows.join("\n")}\n`;
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

  // What a module in words is, and its path, which scripts use.
  about(path) {
    return meaningOf(path) ? [meaningOf(path), `in scripts: ${path}`] : [];
  }

  tell(time, y) {
    const counts = this.counts(time);
    const span = `spikes in the last ${1000 * RECENT_S} ms`;
    if (y === undefined) {
      const busy = this.bands.map(({ name }, i) => [name, counts[i]]).filter(([, count]) => count > 0)
        .sort((a, b) => b[1] - a[1]).slice(0, BUSIEST);
      return [span, ...(busy.length ? busy.map(([name, count]) => `${name} ${count}`) : ["none"])];
    }
    const rows = this.laid();
    const index = Math.max(rows.findLastIndex(({ top, name_y: name }) => Math.min(top, name) - 6 <= y), 0);
    const { group, band, name, top } = rows[index];
    if (!band) {
      const count = group.bands.reduce((sum, own) => sum + counts[this.bands.indexOf(own)], 0);
      const all = group.bands.reduce((sum, { neurons }) => sum + neurons, 0);
      return [name, ...this.about(group.path), `${plural(group.bands.length, "population")}, ${all} neurons, folded`, `${span}: ${count}`];
    }
    const neuron = clamp(Math.floor((y - top) / SIZES.row), 0, band.rows - 1) + 1;
    return [name, ...this.about(band.path), `row ${neuron} of ${band.rows}, from ${band.neurons} neurons`, `${span}: ${counts[this.bands.indexOf(band)]}`];
  }
}
