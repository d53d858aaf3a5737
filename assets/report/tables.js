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
  const data = (content, index) => {
    const element = cell("td", content, index);
    // On a narrow page each cell stands on a line of its own, behind the name of its column.
    element.dataset.column = columns[index].replace(">", "");
    return element;
  };
  const body = rows.map((row) => make("tr", null, ...row.map(data)));
  const filled = make("tbody");
  // One by one: a long list cannot be spread over the arguments of a function.
  for (const row of body) filled.append(row);
  return make("table", null, make("thead", null, make("tr", null, ...head)), filled);
}

// Calls `act` for a click on a row or for Enter. Space plays the episode.
function pressable(row, act) {
  row.tabIndex = 0;
  row.addEventListener("click", act);
  row.addEventListener("keydown", (event) => {
    if (event.key !== "Enter") return;
    event.preventDefault();
    act();
  });
}

// A symbol in words, with the symbol below if they differ.
function named(symbol, names) {
  const words = names.sayState(symbol);
  if (words === symbol) return symbol;
  const small = make("div", symbol);
  small.className = "symbol";
  return make("div", null, make("div", capital(words)), small);
}

// The states of a domain, one row for each place.
function statesTable(domain, names) {
  const rows = domain.states.flatMap((state) => state.places.map((place, i) => {
    const first = (text) => (i === 0 ? text : "");
    return [
      first(named(state.name, names)), first(state.kind), first(state.frame), first(String(state.count)), first(state.origin),
      place.position, place.spread, first(state.orientation),
    ];
  }));
  const spread = ">standard deviation, mm";
  return table(["state", "kind", "frame", ">poses", "origin", ">position in the frame, mm", spread, "orientation"], rows);
}

// The actions of a domain. Each condition stands on a line of its own, with its reason.
function operatorsTable(domain, names) {
  const lines = (texts) => make("div", null, ...(texts.length ? texts : ["–"]).map((text) => make("div", text)));
  const rows = domain.operators.map((operator) => [
    named(operator.name, names), String(operator.instances), operator.from.map((state) => names.sayState(state)).join(" or "),
    names.words.size ? names.sayState(operator.to) : operator.target,
    lines(operator.conditions), lines(operator.side_effects),
  ]);
  return table(["action", ">instances", "from", "to", "conditions before it", "side effects"], rows);
}

// A value of `--json` as text.
function inWords(value) {
  if (Array.isArray(value)) return value.length ? value.map(inWords).join("; ") : "none";
  if (value === null) return "–";
  if (typeof value === "number" && !Number.isInteger(value)) return String(Number(value.toPrecision(6)));
  if (typeof value === "object") return Object.keys(value).length === 0 ? "none" : Object.entries(value).map(([k, v]) => `${k} ${inWords(v)}`).join(", ");
  return String(value);
}

// The settings in JSON as pairs of a key and a text. The keys of what they stand in come before, as in `scene.table.rim`.
function settingsOf(value, key = "") {
  const within = (name) => (key ? `${key}.${name}` : name);
  if (Array.isArray(value) && value.some((item) => item !== null && typeof item === "object" && !Array.isArray(item))) {
    return value.flatMap((item, i) => settingsOf(item, `${key}[${i}]`));
  }
  if (value !== null && typeof value === "object" && !Array.isArray(value) && Object.keys(value).length) {
    return Object.entries(value).flatMap(([name, item]) => settingsOf(item, within(name)));
  }
  const rounded = (_, item) => (typeof item === "number" ? Number(item.toPrecision(6)) : item);
  return [[key, typeof value === "string" ? value : JSON.stringify(value, rounded).replaceAll(",", ", ")]];
}

// Clearer words for some figures of the summary, in the words of `symbolt run` where it prints them.
const FIGURES = {
  assembled: "episodes solved",
  minimum_steps: "episodes solved in the fewest possible steps",
  least_steps: "fewest possible steps without help",
  false_goals: "goals wrongly taken as met",
  unclaimed: "solved, but not taken as met",
  unsolved: "neither solved nor taken as met",
  picks: "grasps",
  drops: "parts that fell from the gripper",
  lost: "parts that fell off the table",
  physics_steps: "steps of the physics",
  method: "way of learning",
  demonstrations_assembled: "demonstrations that solved the task",
  states: "learned states",
  operators: "learned actions",
  recoveries: "how the robot went on when something was wrong",
  replans: "steps that broke off",
  replans_after: "which steps broke off",
  strays: "parts that ended up in no state",
  ended_with_strays: "episodes with such parts at the end",
  meddled: "episodes in which another hand moved something",
  displaced: "what another hand did",
  off_place: "steps whose part is not where it was to go",
  decision_ms: "time of a decision, simulated ms",
  interventions: "interventions made while the recorded episode ran",
  saturated: "layers whose neurons saturate where exact maths does not",
  slip_mm: "largest slip in the gripper, mm",
};

function figuresTable(summary) {
  const rough = summary.few_trials === true ? " (rough: few episodes)" : "";
  const rows = Object.entries(summary).filter(([name]) => name !== "few_trials").map(([name, value]) => {
    if (name === "failures" && Array.isArray(value)) {
      // Files count episodes from 0.
      const failed = value.map(({ episode, reason }) => `episode ${episode + 1}: ${inWords(reason)}`);
      return ["episodes that failed", failed.length ? failed.join("; ") : "none"];
    }
    if (name === "replans_after" && Array.isArray(value)) {
      const steps = value.map(({ words, action, outcome, times }) => `${words ?? action}: ${outcome}${times > 1 ? `, ${times} times` : ""}`);
      return [FIGURES[name], steps.length ? steps.join("; ") : "none"];
    }
    if (name === "recoveries") {
      const times = Object.entries(value ?? {}).map(([kind, count]) => `${recoveryOf(kind, kind === "part" ? "another part" : "a part")}, ${plural(count, "time")}`);
      return [FIGURES[name], times.length ? times.join("; ") : "nothing"];
    }
    if (name === "displaced" && Array.isArray(value)) {
      const hands = value.map(({ episode, t, words }) => `episode ${episode + 1}, at ${seconds(t)}: ${words}`);
      return [FIGURES[name], hands.length ? hands.join("; ") : "nothing"];
    }
    if (name === "off_place" && Array.isArray(value)) {
      const steps = value.map(({ episode, words, ...where }) => `episode ${episode + 1}, “${words}”: ${landedInWords({ words: where.landed, ...where })}`);
      return [FIGURES[name], steps.length ? steps.join("; ") : "none"];
    }
    if (name === "saturated" && Array.isArray(value)) {
      const layers = value.map(({ layer, share, greatest }) => `${nameOf(layer)}: ${(100 * share).toFixed(0)}% of its values, up to ${greatest.toFixed(1)} times the radius`);
      return [FIGURES[name], layers.length ? layers.join("; ") : "none"];
    }
    if (name === "method") return [FIGURES[name], value === "paper" ? "as the paper does, in the world" : "in the frames of objects"];
    if (name === "interval95" && Array.isArray(value)) return [`share solved, 95% interval${rough}`, value.map((v) => `${(100 * v).toFixed(1)}%`).join(" to ")];
    return [FIGURES[name] ?? name.replaceAll("_", " "), inWords(value)];
  });
  return table(["figure", "value"], rows);
}

