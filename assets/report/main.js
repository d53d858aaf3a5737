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
    const { task, run } = DATA;
    byId("title").textContent = task?.name ?? run?.task ?? "A run of symbolt";
    byId("summary").textContent = task?.description ? `${capital(task.description)}.` : "";
    page = new RunPage(DATA, main);
  } else {
    byId("title").textContent = "symbolt experiments";
    experimentsPage(DATA, main);
  }
  document.title = [byId("title").textContent, byId("summary").textContent].filter(Boolean).join(": ");
  // For the tests of the page.
  window.symbolt = { page };
  document.documentElement.dataset.ready = "yes";
}

begin();
