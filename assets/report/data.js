// The data of the page, and small helpers to read and show it. Text only ever becomes text nodes.
const DATA = JSON.parse(document.getElementById("data").textContent);

function bytes(text) {
  const raw = atob(text);
  return Uint8Array.from(raw, (c) => c.charCodeAt(0));
}
const singles = (text) => new Float32Array(bytes(text).buffer);
const small = (text) => new Int8Array(bytes(text).buffer);

const byId = (id) => document.getElementById(id);

// An element with text (never markup) and children.
function make(tag, text, ...children) {
  const element = document.createElement(tag);
  if (text !== undefined && text !== null) element.textContent = text;
  element.append(...children);
  return element;
}

// Builds one part of the page. An error is shown in that part, and the other parts are still built.
function shielded(id, act) {
  try {
    act();
  } catch (error) {
    const said = make("p", `This part cannot be shown: ${error.message}.`);
    said.className = "warning";
    byId(id).replaceChildren(...[...byId(id).querySelectorAll("h2")].slice(0, 1), said);
  }
}

// The number of values in an ascending list that are at most `value`.
function countUpTo(numbers, value) {
  let low = 0;
  let high = numbers.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (numbers[middle] <= value) low = middle + 1;
    else high = middle;
  }
  return low;
}

const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);
const plural = (count, word) => `${count} ${word}${count === 1 ? "" : "s"}`;
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
const seconds = (value, digits = 2) => `${value.toFixed(digits)} s`;
const millimetres = (metres, digits = 2) => (1000 * metres).toFixed(digits);

