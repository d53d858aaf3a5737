// Names for people: what the user called a module, without the parts that the engine adds inside it.

// Parts of paths that every module of a kind has inside.
const INNER = new Set(["population", "output", "out"]);

// A module that carries an expression to another one is called `to.` and the name of its target.
const isRoute = (path) => /^to\.[^/]*$/.test(path);

function inWordsOf(part) {
  return part.startsWith("to.") ? `to ${part.slice(3).replaceAll(".", " ")}` : part;
}

// The name of a node or output, such as `memory` for `memory/population` and for `memory.output`.
function nameOf(path) {
  const parts = path.split("/");
  const last = parts.pop().split(/\.(?=[^.]*$)/);
  const inner = last.length > 1 && !path.startsWith("to.") ? last : [last.join(".")];
  const all = [...parts, ...inner].map(inWordsOf);
  while (all.length > 1 && INNER.has(all.at(-1))) all.pop();
  return all.join(" › ");
}
