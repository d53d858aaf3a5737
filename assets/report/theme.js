// Light and dark: what the reader chose, and the colours that canvases and the scene take from it.

// Line colours that colour-blind readers can tell apart (Okabe and Ito 2008), darkened or lightened for each ground.
const LINES = {
  light: ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#906c30", "#2a93d5", "#3c3c3c"],
  dark: ["#56b4e9", "#ff8a3d", "#2fd0a2", "#e6a3c8", "#fcd848", "#8fd0ff", "#e4e4e4"],
};
// Names beyond the last colour repeat the colours with these dashes.
const DASHES = [[], [6, 3], [2, 3]];

class Theme {
  constructor() {
    this.system = matchMedia("(prefers-color-scheme: dark)");
    this.listeners = [];
    this.choice = "system";
    this.system.addEventListener("change", () => this.apply());
    this.apply();
  }

  get dark() {
    return this.choice === "dark" || (this.choice === "system" && this.system.matches);
  }

  choose(choice) {
    this.choice = choice;
    this.apply();
  }

  apply() {
    document.documentElement.dataset.theme = this.dark ? "dark" : "light";
    const style = getComputedStyle(document.documentElement);
    const names = ["ink", "soft", "line", "paper", "wash", "band", "decide", "done", "failed", "touch", "leave", "sky", "floor", "now", "mark"];
    this.colours = Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
    this.listeners.forEach((listen) => listen());
  }

  line(index) {
    const lines = LINES[this.dark ? "dark" : "light"];
    return lines[index % lines.length];
  }

  dash(index) {
    return DASHES[Math.floor(index / LINES.light.length) % DASHES.length];
  }
}

const theme = new Theme();

