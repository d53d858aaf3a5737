// The page of experiments: figure, table and settings of each.

function experimentsPage(data, main) {
  const link = (name, i) => {
    const a = make("a", name);
    a.href = `#experiment-${i}`;
    return a;
  };
  if (data.experiments.length > 1) main.append(make("nav", null, ...data.experiments.map((e, i) => link(e.folder, i))));
  data.experiments.forEach(({ folder, results, figure }, i) => {
    const section = make("section", null, make("h2", results?.name ?? folder));
    section.id = `experiment-${i}`;
    section.append(make("p", results?.question ?? "The trials are not finished."));
    if (figure) {
      const image = make("img");
      image.src = `data:image/svg+xml;base64,${figure}`;
      image.alt = `Figure of ${folder}`;
      image.className = "figure";
      section.append(image);
    }
    main.append(section);
    if (results) shielded(section.id, () => section.append(resultsTable(results), ...fewTrials(results), ...again(results)));
  });
}

// The command that repeats the experiment, and its settings.
function again(results) {
  const settings = make("details", null, make("summary", "Settings"));
  settings.append(make("pre", JSON.stringify(results.settings, null, 2)));
  const trials = results.settings?.trials ?? 0;
  const how = `symbolt experiment ${results.name} --seed ${results.settings?.seed ?? 1}`;
  return [make("pre", trials > 0 ? `${how} --trials ${trials}` : how), settings];
}

// The number of trials of a rate. For correlated trials, also the number of independent trials with the same precision.
function counted({ trials, effective_trials: effective }) {
  if (effective === null || effective === undefined || Math.round(effective) >= trials) return String(trials);
  return `${trials} (as ${effective < 0.95 ? "less than 1" : Math.round(effective)})`;
}

// Whether all or only some intervals are from few independent trials.
function ofFewTrials(cells) {
  const few = cells.filter((cell) => cell.few_trials).length;
  return { all: few > 0 && few === cells.length, some: few > 0 && few < cells.length };
}

// The warning below a table with intervals from few trials. The program prints the same sentences.
function fewTrials(results) {
  const { all, some } = ofFewTrials(Array.isArray(results.cells) ? results.cells : []);
  if (!all && !some) return [];
  const note = make("p", `${all ? "All intervals are" : "* Intervals"} from fewer than 10 independent trials. Take them as a rough guide: so few trials hardly show how much the results vary.`);
  note.className = "note";
  return [note];
}

// One row for each cell: its settings, its value with interval, its number of trials.
function resultsTable(results) {
  const own = new Set(["successes", "trials", "effective_trials", "rate", "interval95", "mean", "sd", "n", "quantiles",
    "few_trials"]);
  const cells = Array.isArray(results.cells) ? results.cells : [];
  const settings = [...new Set(cells.flatMap((cell) => Object.keys(cell).filter((key) => !own.has(key))))];
  const percent = (share) => (100 * share).toFixed(2);
  const number = (value) => (value === null || value === undefined ? "–" : String(Number(value.toPrecision(5))));
  const { some } = ofFewTrials(cells);
  const rows = cells.map((cell) => {
    const rate = cell.rate !== undefined && cell.rate !== null;
    const show = rate ? percent : number;
    const mark = some && cell.few_trials ? " *" : "";
    const ends = (cell.interval95 ?? []).map(show).join(" to ") + (rate ? " %" : "") + mark;
    const quantiles = cell.quantiles ? `${number(cell.quantiles["5"])} to ${number(cell.quantiles["95"])}` : "";
    return [
      ...settings.map((key) => (cell[key] === undefined ? "" : inWords(cell[key]))),
      rate ? `${percent(cell.rate)} %` : number(cell.mean), ends, rate ? "" : number(cell.sd), quantiles,
      rate ? counted(cell) : String(cell.n),
    ];
  });
  const scroll = make("div", null, table([...settings, ">value", ">95% interval", ">SD", ">5 to 95%", ">trials"], rows));
  scroll.className = "scroll";
  return scroll;
}

