// A strip as a drawing in SVG, a table as CSV, and files that the browser saves.

const csvField = (text) => (/[",\n\r]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
const xml = (text) => String(text).replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll('"', "&quot;");

// Takes the strokes that a strip makes on a canvas and writes them as SVG.
class SvgPen {
  constructor() {
    Object.assign(this, {
      parts: [], path: "", clips: 0, open: 0, measure: make("canvas").getContext("2d"), fillStyle: "#000000", strokeStyle: "#000000",
      lineWidth: 1, font: FONT, textAlign: "left", textBaseline: "middle", globalAlpha: 1, dash: [],
    });
  }

  fillRect(x, y, width, height) {
    this.parts.push(`<rect x="${x.toFixed(1)}" y="${y.toFixed(1)}" width="${width.toFixed(1)}" height="${height.toFixed(1)}" fill="${this.fillStyle}"`
      + `${this.globalAlpha < 1 ? ` opacity="${this.globalAlpha.toFixed(2)}"` : ""}/>`);
  }

  fillText(text, x, y) {
    const anchor = { left: "start", center: "middle", right: "end" }[this.textAlign];
    this.parts.push(`<text x="${x.toFixed(1)}" y="${y.toFixed(1)}" fill="${this.fillStyle}" text-anchor="${anchor}" `
      + `dominant-baseline="central" font-size="${parseFloat(this.font)}" font-family="system-ui, sans-serif">${xml(text)}</text>`);
  }

  measureText(text) {
    this.measure.font = this.font;
    return this.measure.measureText(text);
  }

  beginPath() { this.path = ""; }

  moveTo(x, y) { this.path += `M${x.toFixed(1)} ${y.toFixed(1)}`; }

  lineTo(x, y) { this.path += `${this.path ? "L" : "M"}${x.toFixed(1)} ${y.toFixed(1)}`; }

  rect(x, y, width, height) { this.path += `M${x} ${y}h${width}v${height}h${-width}z`; }

  setLineDash(dash) { this.dash = dash; }

  stroke() {
    const dash = this.dash.length ? ` stroke-dasharray="${this.dash.join(" ")}"` : "";
    this.parts.push(`<path d="${this.path}" fill="none" stroke="${this.strokeStyle}" stroke-width="${this.lineWidth}"${dash}/>`);
  }

  fill() { this.parts.push(`<path d="${this.path}" fill="${this.fillStyle}"/>`); }

  save() { this.open = 0; }

  clip() {
    this.clips += 1;
    this.open += 1;
    this.parts.push(`<clipPath id="c${this.clips}"><path d="${this.path}"/></clipPath><g clip-path="url(#c${this.clips})">`);
  }

  restore() {
    this.parts.push("</g>".repeat(this.open));
    this.open = 0;
  }
}

// A strip as the page shows it, with the scale of time below and a title above.
function svgOf(strip, title) {
  const { axis } = strip;
  const width = axis.width;
  const [tall, head] = [strip.height(), 24];
  const part = (own, height, top) => {
    const pen = new SvgPen();
    own.draw(pen, width, height);
    return `<g transform="translate(0 ${top})">${pen.parts.join("\n")}</g>`;
  };
  const names = strip.module ? strip.module.names.filter((name) => !strip.hidden.has(name)) : [];
  const legend = names.map((name, i) => {
    const { colour } = strip.look(strip.module.names.indexOf(name));
    const y = head + tall + SIZES.scale + 14 + 16 * i;
    return `<path d="M${axis.left} ${y}h20" stroke="${colour}" stroke-width="2"/><text x="${axis.left + 26}" y="${y}" fill="${theme.colours.ink}" `
      + `dominant-baseline="central" font-size="12" font-family="system-ui, sans-serif">${xml(strip.content.say(name))}</text>`;
  });
  const height = head + tall + SIZES.scale + 8 + 16 * names.length + (names.length ? 8 : 0);
  return `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}" viewBox="0 0 ${width} ${height}">`
    + `<rect width="${width}" height="${height}" fill="${theme.colours.paper}"/>`
    + `<text x="6" y="14" fill="${theme.colours.ink}" font-size="14" font-family="system-ui, sans-serif">${xml(title)}</text>`
    + `${part(strip, tall, head)}${part(axis.scale, SIZES.scale, head + tall)}${legend.join("")}</svg>\n`;
}

function save(name, text, type) {
  const link = make("a");
  link.href = URL.createObjectURL(new Blob([text], { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

// Two buttons that save a strip as SVG and its numbers as CSV.
function exportButtons(what, strip, table) {
  const file = (ending) => `${what.replace(/[^A-Za-z0-9._-]+/g, "-")}.${ending}`;
  const button = (text, act) => {
    const element = make("button", text);
    element.type = "button";
    element.setAttribute("aria-label", `Save ${what} as ${text}`);
    element.addEventListener("click", act);
    return element;
  };
  return [
    button("SVG", () => save(file("svg"), svgOf(strip(), what), "image/svg+xml")),
    button("CSV", () => save(file("csv"), table(), "text/csv")),
  ];
}
