// The section on the planner: the time axis with the modules that the reader chooses, and the values in words.

// Modules as the strips draw them, in the order of `run.json`.
function unpackModules(run, arrays) {
  const known = new Map((run?.modules ?? []).map((module) => [module.name, module]));
  const order = [...known.keys()];
  return (arrays?.modules.of ?? [])
    .filter(({ name }) => known.has(name))
    .sort((a, b) => order.indexOf(a.name) - order.indexOf(b.name))
    .map(({ name, steps, values }) => {
      const numbers = Float32Array.from(small(values), (v) => v / steps);
      const [low, high] = numbers.reduce(([low, high], v) => [Math.min(low, v), Math.max(high, v)], [-0.05, 1.05]);
      const module = known.get(name);
      return { ...module, title: module.note?.name, values: numbers, range: [low - 0.05, high + 0.05] };
    });
}

// What each phase that this planner has is, in a line each.
function phasesList(names) {
  const own = names.filter((name) => PHASES[name]);
  const lines = own.flatMap((name) => [make("dt", name), make("dd", PHASES[name])]);
  const list = make("details", null, make("summary", "What the phases are"), make("dl", null, ...lines));
  list.className = "phases";
  return list;
}

class Thinking extends Panels {
  constructor(page) {
    super({
      duration: 0.1, acts: [], touches: [], displaced: [], times: new Float32Array(), modules: [], spikes: { t: [], row: [] }, populations: [],
      rows: 0, word: "Module", says: (time) => page.saysAt(time), say: (symbol) => page.names.say(symbol),
    }, (time) => page.seek(time));
    this.page = page;
  }

  // Shows an episode. Only of the recorded episode the activity of the network is known.
  show(episode) {
    const { run, arrays } = this.page.data;
    const populations = run?.populations ?? [];
    Object.assign(NOTES, run?.notes);
    const own = episode.recorded ? arrays : null;
    const spikes = { t: singles(own?.spikes.t ?? ""), row: singles(own?.spikes.row ?? "") };
    const touches = episode.touches.map((touch) => ({ ...touch, name: episode.part(touch.part) }));
    const rows = spikes.t.length ? populations.reduce((sum, p) => sum + p.rows, 0) : 0;
    Object.assign(this.content, {
      duration: episode.duration, acts: episode.acts, touches, displaced: episode.displaced, times: episode.times, modules: unpackModules(run, own), gaps: new Set(own?.modules.gaps),
      spikes, populations, rows,
    });
    byId("thinking").textContent = own || !arrays
      ? ["Each panel shows the values of one module: one sample every 2 ms while the planner decides, every 40 ms while the robot acts.",
        rows ? "The spikes are from a few neurons of each population, kept while the planner decides." : "",
        this.until(episode)].join(" ")
      : `The activity of the network was recorded in episode ${(this.page.data.filmed ?? 0) + 1} only.`;
    this.refill(2);
  }

  // A problem that is compiled anew has another network, which is not recorded.
  until({ times, duration }) {
    const last = times.at(-1) ?? duration;
    return last < duration - 0.2 ? `After ${seconds(last)} another network planned, because the problem had changed; its activity was not recorded.` : "";
  }

  meaning(module) {
    return module?.note?.meaning ?? "";
  }

  more(module) {
    return module?.name === "phase" ? [phasesList(module.names)] : [];
  }
}
