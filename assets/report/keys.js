// The keys of the page: play, move the moment, open decisions, change the view.

// A step of an arrow key in seconds: plain, with Shift, and of the page keys.
const STEPS = { plain: 0.01, shift: 0.001, page: 1 };
const VIEW_KEYS = { 1: "overview", 2: "top", 3: "follow" };

// Whether the element handles the key itself.
function ownKey(target, key) {
  if (!(target instanceof Element)) return false;
  if (target.closest("select, textarea, [contenteditable]")) return true;
  if (key === " ") return Boolean(target.closest("button, summary, input[type=checkbox]"));
  if (key.startsWith("Arrow")) return Boolean(target.closest(".scroll, pre"));
  return false;
}

function listenToKeys(page) {
  const moves = {
    ArrowLeft: (step) => page.time - step, ArrowRight: (step) => page.time + step,
    PageUp: () => page.time - STEPS.page, PageDown: () => page.time + STEPS.page,
    Home: () => 0, End: () => page.duration,
  };
  const acts = {
    " ": () => (page.playing ? page.pause() : page.play()),
    n: () => page.openDecision(1), p: () => page.openDecision(-1),
    l: () => byId("names-shown")?.click(), s: () => byId("gaussians")?.click(),
    "+": () => page.timeline?.zoom(0.5), "=": () => page.timeline?.zoom(0.5), "-": () => page.timeline?.zoom(2),
  };
  // After a click with the pointer, Space plays again instead of repeating the click.
  document.addEventListener("click", (event) => {
    if (event.detail > 0) event.target.closest("button, input[type=checkbox]")?.blur();
  });
  document.addEventListener("keydown", (event) => {
    const { key, target } = event;
    if (event.ctrlKey || event.altKey || event.metaKey || event.defaultPrevented || ownKey(target, key)) return;
    // Page keys scroll the page unless the slider or a strip has the focus.
    const axis = target instanceof Element && target.closest("#scrub, .lane");
    const far = ["PageUp", "PageDown", "Home", "End"].includes(key);
    const move = far && !axis ? undefined : moves[key];
    const view = VIEW_KEYS[key];
    const act = acts[key.toLowerCase()] ?? (view && (() => page.chooseView(view)));
    if (!move && !act) return;
    event.preventDefault();
    if (act) {
      act();
      return;
    }
    page.pause();
    page.seek(move(event.shiftKey ? STEPS.shift : STEPS.plain));
  });
}

