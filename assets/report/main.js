// Which page it is, and what it begins with.

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
    if (results) section.append(make("p", results.question));
    if (figure) {
      const image = make("img");
      image.src = `data:image/svg+xml;base64,${figure}`;
      image.alt = `Figure of ${folder}`;
      image.className = "figure";
      section.append(image);
    }
    if (results) section.append(resultsTable(results));
    if (results) {
      const settings = make("details", null, make("summary", "Settings"));
      settings.append(make("pre", JSON.stringify(results.settings, null, 2)));
      section.append(settings);
    }
    main.append(section);
  });
}

// Settings of each cell, then its value with interval and number of trials.
function resultsTable(results) {
  const own = new Set(["successes", "trials", "rate", "interval95", "mean", "sd", "n"]);
  const cells = Array.isArray(results.cells) ? results.cells : [];
  const settings = [...new Set(cells.flatMap((cell) => Object.keys(cell).filter((key) => !own.has(key))))];
  const percent = (share) => (100 * share).toFixed(2);
  const number = (value) => (value === null || value === undefined ? "–" : String(Number(value.toPrecision(5))));
  const rows = cells.map((cell) => {
    const rate = cell.rate !== undefined;
    const show = rate ? percent : number;
    const ends = (cell.interval95 ?? []).map(show).join(" to ");
    return [
      ...settings.map((key) => (cell[key] === undefined ? "" : inWords(cell[key]))),
      rate ? `${percent(cell.rate)} %` : number(cell.mean), ends, rate ? "" : number(cell.sd),
      String(rate ? cell.trials : cell.n),
    ];
  });
  const scroll = make("div", null, table([...settings, ">value", ">95% interval", ">SD", ">trials"], rows));
  scroll.className = "scroll";
  return scroll;
}

function begin() {
  const main = byId("main");
  if (DATA.missing.length) {
    byId("missing").hidden = false;
    byId("missing").querySelector("ul").append(...DATA.missing.map((why) => make("li", why)));
  }
  let page = null;
  if (DATA.kind === "run") {
    const summary = DATA.run?.summary;
    byId("title").textContent = `symbolt run: ${DATA.run?.goal ?? "goal unknown"}`;
    if (summary) {
      byId("summary").textContent = `${summary.assembled} of ${summary.episodes} episodes assembled, `
        + `${summary.demonstrations} demonstrations, ${summary.states} states and ${summary.operators} actions learned.`;
    }
    page = new RunPage(DATA, main);
  } else {
    byId("title").textContent = "symbolt experiments";
    experimentsPage(DATA, main);
  }
  document.title = byId("title").textContent;
  // For tests of the page.
  window.symbolt = { page };
  document.documentElement.dataset.ready = "yes";
}

begin();
