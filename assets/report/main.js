// Starts the page: a run or experiments.

function begin() {
  const main = byId("main");
  if (DATA.missing.length) {
    byId("missing").hidden = false;
    byId("missing").querySelector("ul").append(...DATA.missing.map((why) => make("li", why)));
  }
  byId("theme").addEventListener("change", (event) => theme.choose(event.target.value));
  let page = null;
  if (DATA.kind === "run") {
    const summary = DATA.run?.summary;
    byId("title").textContent = `symbolt run: ${DATA.run?.goal ?? "goal unknown"}`;
    if (summary) {
      const { assembled, episodes, demonstrations, states, operators } = summary;
      const learned = demonstrations > 0 ? ` learned from ${demonstrations} demonstrations` : "";
      byId("summary").textContent = `${assembled} of ${episodes} ${episodes === 1 ? "episode" : "episodes"} solved with `
        + `${states} states and ${operators} actions${learned}.`;
    }
    page = new RunPage(DATA, main);
  } else {
    byId("title").textContent = "symbolt experiments";
    experimentsPage(DATA, main);
  }
  document.title = byId("title").textContent;
  // For the tests of the page.
  window.symbolt = { page };
  document.documentElement.dataset.ready = "yes";
}

begin();
