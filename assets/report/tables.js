// Tables of the page.

// A table; columns that begin with `>` hold numbers. Cells are text or elements.
function table(columns, rows) {
  const numeric = columns.map((name) => name.startsWith(">"));
  const cell = (tag, content, index) => {
    const element = make(tag);
    element.append(content ?? "");
    if (numeric[index]) element.className = "number";
    return element;
  };
  const head = columns.map((name, i) => cell("th", name.replace(">", ""), i));
  const body = rows.map((row) => make("tr", null, ...row.map((content, i) => cell("td", content, i))));
  return make("table", null, make("thead", null, make("tr", null, ...head)), make("tbody", null, ...body));
}

// Calls `act` for a click on a row, or Enter or space.
function pressable(row, act) {
  row.tabIndex = 0;
  row.addEventListener("click", act);
  row.addEventListener("keydown", (event) => {
    if (event.key !== "Enter" && event.key !== " ") return;
    event.preventDefault();
    act();
  });
}

const listed = (names) => (names && names.length ? names.join(", ") : "–");

function statesTable(domain) {
  const rows = domain.states.map((state) => {
    const spread = [0, 1, 2].map((i) => Math.sqrt(Math.max(state.covariance[i][i], 0)));
    return [
      state.name, state.kind, String(state.count), state.origin,
      state.mean.position.map((v) => millimetres(v, 1)).join(", "),
      spread.map((v) => millimetres(v)).join(", "),
    ];
  });
  const columns = ["state", "kind", ">poses", "parts were", ">mean position, mm", ">spread (SD), mm"];
  return table(columns, rows);
}

function operatorsTable(domain) {
  const index = new Map(domain.states.map((state, i) => [state.name, i]));
  const rows = domain.operators.map((operator) => {
    const { instances, before } = operator.evidence;
    const counted = (names) => listed(names.map((n) => `${n} (${before[index.get(n)] ?? 0}/${instances})`));
    return [
      operator.name, String(instances), counted(operator.preconditions), listed(operator.effects),
      counted(operator.absent),
    ];
  });
  return table(["action", ">times seen", "needs", "brings about", "never held before"], rows);
}

// A value of `--json` in words.
function inWords(value) {
  if (Array.isArray(value)) return value.length ? value.map(inWords).join("; ") : "none";
  if (value === null) return "–";
  if (typeof value === "number" && !Number.isInteger(value)) return String(Number(value.toPrecision(6)));
  if (typeof value === "object") return Object.entries(value).map(([k, v]) => `${k} ${inWords(v)}`).join(", ");
  return String(value);
}

// Figures whose names say too little.
const FIGURES = {
  assembled: "episodes solved",
  minimum_steps: "episodes in the least number of steps",
  least_steps: "the least number of steps",
  false_goals: "goals taken to be met that were not",
  replans: "plans made anew after a failed step",
  replans_after: "which failed",
  strays: "parts that came to be in no state",
  ended_with_strays: "episodes that ended with such parts",
  meddled: "episodes in which a person put a part somewhere",
  decision_ms: "decision, simulated ms",
  slip_mm: "greatest slip in the hand, mm",
};

function figuresTable(summary) {
  const rows = Object.entries(summary).map(([name, value]) => {
    if (name === "failures" && Array.isArray(value)) {
      // Files count episodes from 0.
      const failed = value.map(({ episode, reason }) => `episode ${episode + 1}: ${inWords(reason)}`);
      return [name, failed.length ? failed.join("; ") : "none"];
    }
    if (name === "interval95" && Array.isArray(value)) return ["share solved, 95% interval", value.map((v) => `${(100 * v).toFixed(1)}%`).join(" to ")];
    return [FIGURES[name] ?? name.replaceAll("_", " "), inWords(value)];
  });
  return table(["figure", "value"], rows);
}

