'use strict';
const data = JSON.parse(document.getElementById('data').textContent);
const byId = (id) => document.getElementById(id);
const colours = ['#2a78d6', '#d1493f', '#2f9e5b', '#b8860b', '#8e5bd0', '#0f9aa8', '#d06aa5', '#7a7f87', '#8b5a2b', '#5b7f1f'];
const svgName = 'http://www.w3.org/2000/svg';

function element(name, text, className) {
  const made = document.createElement(name);
  if (text !== undefined) made.textContent = text;
  if (className) made.className = className;
  return made;
}

function drawn(parent, name, attributes, text) {
  const made = document.createElementNS(svgName, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  parent.append(made);
  return made;
}

const state = { session: 0, part: 0, t: 0, turn: 0.7, tilt: 0.55, zoom: 1 };
const part = () => data.sessions[state.session].parts[state.part];
const events = () => data.events.filter((e) => e.session === state.session && e.part === state.part);
const ids = [...new Set(data.sessions.flatMap((s) => s.parts.flatMap((p) => p.tracks.map((t) => t.id))))];
const colour = (id) => (id === null ? 'currentColor' : colours[ids.indexOf(id) % colours.length]);

// Carries: each contact with the release behind it.
function carries() {
  const found = [];
  for (const e of events()) {
    if (e.event === 'contact') found.push({ object: e.object, with: e.with, from: e.t, to: part().to });
    const open = found.findLast((c) => c.object === e.object);
    if (e.event === 'release' && open) open.to = e.t;
  }
  return found;
}

function strip(title, curves, held, low, high, unit) {
  const [from, to] = [part().from, part().to];
  const [width, height, left] = [1000, 110, 60];
  const x = (t) => left + ((t - from) / Math.max(to - from, 1e-9)) * (width - left - 10);
  const y = (v) => height - 18 - ((v - low) / Math.max(high - low, 1e-9)) * (height - 46);
  const box = element('div', undefined, 'strip');
  const svg = drawn(box, 'svg', { viewBox: `0 0 ${width} ${height}`, role: 'img', 'aria-label': title });
  for (const c of held) {
    drawn(svg, 'rect', { x: x(c.from), y: 22, width: Math.max(1, x(c.to) - x(c.from)), height: height - 40, fill: 'var(--held)' });
  }
  drawn(svg, 'line', { x1: left, x2: width - 10, y1: height - 18, y2: height - 18, stroke: 'var(--faint)' });
  drawn(svg, 'text', { x: left, y: 14 }, title);
  drawn(svg, 'text', { x: left - 4, y: height - 20, 'text-anchor': 'end' }, low.toFixed(2));
  drawn(svg, 'text', { x: left - 4, y: 32, 'text-anchor': 'end' }, `${high.toFixed(2)} ${unit}`);
  for (const [index, curve] of curves.entries()) {
    const points = curve.points.map(([t, v]) => `${x(t).toFixed(1)},${y(v).toFixed(1)}`).join(' ');
    const dash = ['', '6 3', '2 3'][index % 3];
    drawn(svg, 'polyline', { points, fill: 'none', stroke: curve.colour, 'stroke-width': 1.4, 'stroke-dasharray': dash });
    if (curve.points.length < 40) {
      for (const [t, v] of curve.points) drawn(svg, 'circle', { cx: x(t), cy: y(v), r: 2.2, fill: curve.colour });
    }
  }
  for (const e of events()) {
    const own = held.some((c) => c.from === e.t || c.to === e.t);
    if (!own) continue;
    const line = drawn(svg, 'line', { x1: x(e.t), x2: x(e.t), y1: 22, y2: height - 18, stroke: e.event === 'contact' ? '#2f9e5b' : '#d1493f', 'stroke-width': 1.5 });
    drawn(line, 'title', {}, `${e.event} of ${e.object} at ${e.t.toFixed(2)} s: ${e.evidence}`);
  }
  for (let i = 0; i <= 8; i += 1) {
    const t = from + ((to - from) * i) / 8;
    drawn(svg, 'text', { x: x(t), y: height - 5, 'text-anchor': i === 8 ? 'end' : 'middle' }, t.toFixed(1));
  }
  svg.cursor = drawn(svg, 'line', { y1: 22, y2: height - 18, stroke: 'currentColor', 'stroke-width': 1, opacity: 0.6 });
  svg.place = x;
  svg.addEventListener('click', (click) => {
    const at = ((click.clientX - svg.getBoundingClientRect().left) / svg.getBoundingClientRect().width) * width;
    moveTo(from + ((at - left) / (width - left - 10)) * (to - from));
  });
  return box;
}

function strips() {
  const place = byId('strips');
  place.replaceChildren();
  const all = carries();
  const tracks = [...part().tracks].sort((a, b) => all.filter((c) => c.object === b.id).length - all.filter((c) => c.object === a.id).length);
  for (const track of tracks) {
    const held = all.filter((c) => c.object === track.id || c.with.includes(track.id));
    const values = track.p.flat();
    const curves = [0, 1, 2].map((axis) => ({ colour: colour(track.id), points: track.t.map((t, i) => [t, track.p[i][axis]]) }));
    const low = values.reduce((a, b) => Math.min(a, b), Infinity);
    const high = values.reduce((a, b) => Math.max(a, b), -Infinity);
    place.append(strip(track.id, curves, held, low, high, 'm'));
  }
  for (const signal of part().signals) {
    const values = signal.v;
    const low = values.reduce((a, b) => Math.min(a, b), Infinity);
    const high = values.reduce((a, b) => Math.max(a, b), -Infinity);
    place.append(strip(signal.name, [{ colour: 'currentColor', points: signal.t.map((t, i) => [t, values[i]]) }], all, low, high, ''));
  }
}

// The pose of a track at a time: of its last sample before.
function at(track, t) {
  let low = 0;
  let high = track.t.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (track.t[middle] <= t) low = middle; else high = middle - 1;
  }
  return track.p[low];
}

function space() {
  const canvas = byId('space');
  const scale = window.devicePixelRatio || 1;
  canvas.width = canvas.clientWidth * scale;
  canvas.height = canvas.clientHeight * scale;
  const pen = canvas.getContext('2d');
  const tracks = part().tracks;
  const shown = [...tracks, ...(part().hand ? [{ ...part().hand, hand: true }] : [])];
  const points = shown.flatMap((track) => track.p);
  if (!points.length) return;
  const low = [0, 1, 2].map((axis) => points.reduce((least, p) => Math.min(least, p[axis]), Infinity));
  const high = [0, 1, 2].map((axis) => points.reduce((most, p) => Math.max(most, p[axis]), -Infinity));
  const middle = low.map((v, axis) => (v + high[axis]) / 2);
  const size = Math.max(...low.map((v, axis) => high[axis] - v), 1e-3);
  const zoom = (state.zoom * Math.min(canvas.width, canvas.height * 1.5)) / size / 2;
  const [ct, st, ci, si] = [Math.cos(state.turn), Math.sin(state.turn), Math.cos(state.tilt), Math.sin(state.tilt)];
  const flat = (p) => {
    const [x, y, z] = p.map((v, axis) => v - middle[axis]);
    const [across, away] = [ct * x + st * y, -st * x + ct * y];
    return [canvas.width / 2 + zoom * across, canvas.height / 2 - zoom * (ci * z + si * away)];
  };
  const ink = getComputedStyle(document.body).color;
  const line = (list, stroke, width, alpha) => {
    pen.beginPath();
    list.forEach((p, i) => (i ? pen.lineTo(...flat(p)) : pen.moveTo(...flat(p))));
    pen.strokeStyle = stroke;
    pen.lineWidth = width * scale;
    pen.globalAlpha = alpha;
    pen.stroke();
    pen.globalAlpha = 1;
  };
  const floor = low[2];
  for (let i = 0; i <= 10; i += 1) {
    const [x, y] = [0, 1].map((axis) => low[axis] + ((high[axis] - low[axis]) * i) / 10);
    line([[x, low[1], floor], [x, high[1], floor]], ink, 0.5, 0.25);
    line([[low[0], y, floor], [high[0], y, floor]], ink, 0.5, 0.25);
  }
  const all = carries();
  for (const track of shown) {
    const stroke = track.hand ? ink : colour(track.id);
    line(track.p, stroke, track.hand ? 0.7 : 0.9, track.hand ? 0.35 : 0.6);
    for (const c of all.filter((c) => !track.hand && (c.object === track.id || c.with.includes(track.id)))) {
      line(track.p.filter((_, i) => track.t[i] >= c.from && track.t[i] <= c.to), stroke, 2.6, 1);
    }
  }
  const dot = (p, fill, radius) => {
    pen.beginPath();
    pen.arc(...flat(p), radius * scale, 0, 7);
    pen.fillStyle = fill;
    pen.fill();
  };
  for (const e of events()) dot(e.p, e.event === 'contact' ? '#2f9e5b' : '#d1493f', 3.5);
  pen.font = `${12 * scale}px system-ui, sans-serif`;
  for (const track of shown) {
    if (!track.t.length) continue;
    const p = at(track, state.t);
    dot(p, track.hand ? ink : colour(track.id), 5);
    pen.fillStyle = ink;
    const [x, y] = flat(p);
    pen.fillText(track.id, x + 7 * scale, y - 5 * scale);
  }
}

function moveTo(t) {
  const { from, to } = part();
  state.t = Math.min(Math.max(t, from), to);
  byId('time').value = Math.round(((state.t - from) / Math.max(to - from, 1e-9)) * 1000);
  byId('clock').textContent = `${state.t.toFixed(2)} s`;
  for (const svg of byId('strips').querySelectorAll('svg')) {
    svg.cursor.setAttribute('x1', svg.place(state.t));
    svg.cursor.setAttribute('x2', svg.place(state.t));
  }
  for (const row of byId('events').children) row.classList.toggle('now', Math.abs(row.t - state.t) < 1e-9);
  space();
}

function show() {
  const session = data.sessions[state.session];
  byId('part').replaceChildren(...session.parts.map((p, i) => new Option(p.name || String(i), i)));
  byId('part').value = state.part;
  byId('part').parentElement.hidden = session.parts.length < 2;
  byId('legend').replaceChildren(...part().tracks.map((track) => {
    const item = element('span');
    const key = element('span', undefined, 'key');
    key.style.background = colour(track.id);
    item.append(key, track.id);
    return item;
  }));
  strips();
  byId('events').replaceChildren(...events().map((e) => {
    const row = element('tr', undefined, 'event');
    const withOthers = e.with.length ? `; with ${e.with.join(', ')}` : '';
    row.append(element('td', e.t.toFixed(2), 'n'), element('td', e.event), element('td', e.object), element('td', e.evidence + withOthers));
    row.t = e.t;
    row.tabIndex = 0;
    row.addEventListener('click', () => moveTo(e.t));
    row.addEventListener('keydown', (key) => key.key === 'Enter' && moveTo(e.t));
    return row;
  }));
  byId('objects').replaceChildren(...data.objects.filter((o) => o.session === state.session).map((o) => {
    const row = element('tr');
    const noise = o.noise_m === null ? '-' : (o.noise_m * 1000).toFixed(2);
    row.append(element('td', o.id), element('td', o.kind), element('td', o.poses, 'n'), element('td', o.rate_hz.toFixed(1), 'n'), element('td', noise, 'n'), element('td', o.carried, 'n'));
    return row;
  }));
  const first = events()[0];
  moveTo(first ? first.t : part().from);
}

byId('summary').textContent = `${data.sessions.length} sessions, ${data.events.length} events, ${data.rows} rows`;
byId('session').replaceChildren(...data.sessions.map((s, i) => new Option(s.name || String(i), i)));
byId('session').addEventListener('change', () => { state.session = Number(byId('session').value); state.part = 0; show(); });
byId('part').addEventListener('change', () => { state.part = Number(byId('part').value); show(); });
byId('time').addEventListener('input', () => moveTo(part().from + (byId('time').value / 1000) * (part().to - part().from)));
byId('notes').replaceChildren(...data.notes.map((note) => {
  const row = element('tr');
  row.append(element('td', note));
  return row;
}));
let held = null;
byId('space').addEventListener('pointerdown', (e) => { held = [e.clientX, e.clientY]; byId('space').setPointerCapture(e.pointerId); });
byId('space').addEventListener('pointermove', (e) => {
  if (!held) return;
  state.turn -= (e.clientX - held[0]) / 150;
  state.tilt = Math.min(1.57, Math.max(0, state.tilt + (e.clientY - held[1]) / 150));
  held = [e.clientX, e.clientY];
  space();
});
byId('space').addEventListener('pointerup', () => { held = null; });
byId('space').addEventListener('wheel', (e) => { state.zoom *= Math.exp(-e.deltaY / 800); space(); e.preventDefault(); }, { passive: false });
window.addEventListener('resize', space);
if (data.sessions.length) show();
