// The plots of a run of any graph: curves, decoded against ideal, spikes per second and spikes, over one moment.

// Number of plots that are shown from the beginning.
const SHOWN = 6;
const KINDS = { chart: "", output: "output ", rate: "spikes per second of " };

// The curves of a plot as a panel draws them. Ideal values are dashed curves in the colour of their decoded ones.
function unpackPlot({ title, kind, curves, ideal, rms }) {
  const times = singles(curves.t);
  const own = singles(curves.values);
  const { names } = curves;
  const target = ideal ? { times: singles(ideal.t), values: singles(ideal.values), names: ideal.names } : null;
  const match = target ? names.map((name, i) => { const at = target.names.indexOf(name); return at >= 0 ? at : i < target.names.length ? i : -1; }) : [];
  const paired = match.map((at, i) => [at, i]).filter(([at]) => at >= 0);
  const all = [...names, ...paired.map(([, i]) => `${names[i]}, ideal`)];
  const values = target ? new Float32Array(times.length * all.length) : own;
  for (let s = 0; target && s < times.length; s++) {
    const sample = Math.max(countUpTo(target.times, times[s] + 1e-6) - 1, 0);
    names.forEach((_, i) => { values[s * all.length + i] = own[s * names.length + i]; });
    paired.forEach(([at], k) => { values[s * all.length + names.length + k] = target.values[sample * target.names.length + at]; });
  }
  const [low, high] = values.reduce(([low, high], v) => [Math.min(low, v), Math.max(high, v)], [0, 1e-3]);
  const pad = 0.05 * (high - low);
  return {
    name: title, title: KINDS[kind] + (kind === "chart" ? title : nameOf(title)), names: all, times, values,
    range: [low - pad, high + pad], shows: curves.unit, rms, every: curves.every,
    look: target ? (column) => {
      const of = column < names.length ? column : paired[column - names.length][1];
      return { colour: theme.line(of), dash: column < names.length ? [] : [6, 4] };
    } : undefined,
  };
}

class Plots extends Panels {
  constructor(data, page) {
    const modules = data.plots.map(unpackPlot);
    const { populations } = data.spikes;
    const spikes = { t: singles(data.spikes.t), row: singles(data.spikes.row) };
    super({
      duration: data.simulated_s, modules, spikes, populations, rows: populations.reduce((sum, { rows }) => sum + rows, 0),
      times: new Float32Array(), word: "Plot", says: () => [], say: (name) => name,
    }, (time) => page.seek(time));
    this.refill(SHOWN);
  }

  meaning(module) {
    if (!module) return "";
    const said = [];
    if (module.rms !== null && module.rms !== undefined) said.push(`Root mean square of decoded minus ideal: ${Number(module.rms.toPrecision(3))}.`);
    if (module.every > 1) said.push(`One of ${module.every} samples is shown.`);
    return said.join(" ");
  }
}

// The keys that move the moment and zoom.
function timeKeys(page) {
  document.addEventListener("keydown", (event) => {
    const { key, target, shiftKey } = event;
    if (event.ctrlKey || event.altKey || event.metaKey || event.defaultPrevented) return;
    if (target instanceof Element && target.closest("select, .scroll, pre, .drawing")) return;
    const step = page.duration / (shiftKey ? 2000 : 200);
    const acts = {
      ArrowLeft: () => page.seek(page.time - step), ArrowRight: () => page.seek(page.time + step),
      "+": () => page.plots.timeline.zoom(0.5), "=": () => page.plots.timeline.zoom(0.5), "-": () => page.plots.timeline.zoom(2),
    };
    if (!acts[key]) return;
    event.preventDefault();
    acts[key]();
  });
}
