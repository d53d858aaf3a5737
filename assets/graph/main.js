// Starts the page of any graph.

class GraphPage {
  constructor(data) {
    this.duration = data.simulated_s;
    this.time = 0;
    byId("title").textContent = data.title;
    document.title = data.title;
    const { nodes, connections, notes } = data.graph;
    Object.assign(NOTES, notes);
    const neurons = nodes.reduce((sum, node) => sum + node.neurons, 0);
    byId("summary").textContent = `${(1000 * data.simulated_s).toFixed(0)} simulated ms, ${plural(nodes.length, "node")}, `
      + `${plural(connections, "connection")}, ${plural(neurons, "spiking neuron")}, build seed ${data.seed}.`;
    byId("theme").addEventListener("change", (event) => theme.choose(event.target.value));
    shielded("modules", () => { this.drawing = new Drawing(byId("drawing"), data.graph); });
    shielded("time", () => {
      this.plots = new Plots(data, this);
      byId("strips").hidden = this.plots.content.modules.length === 0 && !this.plots.timeline.raster;
    });
    shielded("listed", () => byId("table").append(modulesTable(data.graph)));
    byId("dot").textContent = data.dot;
    const scrub = byId("scrub");
    if (scrub) {
      scrub.max = this.duration.toFixed(3);
      scrub.addEventListener("input", () => this.seek(Number(scrub.value)));
    }
    timeKeys(this);
    this.seek(0);
  }

  seek(time) {
    this.time = clamp(time, 0, this.duration);
    byId("scrub").value = this.time.toFixed(3);
    byId("clock").textContent = `${seconds(this.time, 3)} of ${seconds(this.duration, 3)}`;
    this.plots?.timeline.at(this.time);
  }
}

// The modules that the user added, with their nodes and neurons.
function modulesTable({ nodes }) {
  const modules = new Map();
  for (const { path, neurons: units } of nodes) {
    const name = path.split("/")[0];
    const [count, neurons] = modules.get(name) ?? [0, 0];
    modules.set(name, [count + 1, neurons + units]);
  }
  const rows = [...modules].map(([name, [count, neurons]]) => [nameOf(name), String(count), String(neurons)]);
  return table(["name", ">nodes", ">spiking neurons"], rows);
}

function begin() {
  // For the tests of the page.
  window.symbolt = { page: new GraphPage(DATA) };
  document.documentElement.dataset.ready = "yes";
}

begin();
