// Names for people: what a module was called in words, or else in its path, without the parts that the engine adds inside it.

// Parts of paths that modules of a kind have inside, never at the top. A plot or a row leaves those of `INNER` out; a drawing of what is
// inside shows all.
const PARTS = {
  analog: "neurons",
  back: "inverse transform",
  bind: "binding",
  difference: "difference",
  drive: "input",
  held: "what is held",
  inverse: "inverse",
  items: "items",
  left: "transform of the first",
  logic: "neurons",
  memory: "memory",
  output: "output",
  population: "neurons",
  products: "products",
  race: "neurons",
  recall: "pointer of the item",
  right: "transform of the second",
  select: "neurons",
  similarity: "similarities",
  slice: "part",
};
const INNER = new Set(["population", "output", "out", "logic", "analog", "race", "select"]);

// What paths are called in words and what is there. The page fills it.
const NOTES = Object.create(null);

// A module that carries an expression to another one is called `to.` and the name of its target.
const isRoute = (path) => /^to\.[^/]*$/.test(path);

// The name of the last part of a path.
function partOf(path) {
  const last = path.slice(path.lastIndexOf("/") + 1);
  if (NOTES[path]) return NOTES[path].name;
  if (!last.startsWith("to.")) return last !== path && Object.hasOwn(PARTS, last) ? PARTS[last] : last;
  const target = last.slice(3).split(".");
  const known = target.map((_, i) => NOTES[target.slice(0, i + 1).join("/")]).findLast(Boolean);
  return `to ${known?.name ?? target.join(" ")}`;
}

// The paths of a module and of the modules around it, the outermost first.
const around = (path) => path.split("/").map((_, i, parts) => parts.slice(0, i + 1).join("/"));

// The modules around a node or output and itself, the outermost first: of each its path, its name and the part of the path.
function partsOf(path) {
  const at = path.startsWith("to.") ? -1 : path.lastIndexOf(".");
  const node = at > path.lastIndexOf("/") ? path.slice(0, at) : path;
  const all = around(node).map((one) => ({ path: one, part: one.slice(one.lastIndexOf("/") + 1), name: partOf(one) }));
  if (node !== path) all.push({ path, part: path.slice(at + 1), name: path.slice(at + 1) });
  while (all.length > 1 && INNER.has(all.at(-1).part) && !NOTES[all.at(-1).path]) all.pop();
  return all;
}

// The name of a node or output, such as `memory` for `memory/population` and for `memory.output`.
const nameOf = (path) => partsOf(path).map(({ name }) => name).join(" › ");

// What the module at a path does, in a sentence: its own, or that of the nearest one around it.
const meaningOf = (path) => NOTES[around(path).findLast((one) => NOTES[one])]?.meaning ?? "";
