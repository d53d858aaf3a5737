// Places boxes in layers so that most arrows lead onward, and tells which lead back.

const GAP = { layer: 78, box: 44 };

// The arrows that close a loop: in a search from the boxes without an arrow into them, those to a box on the way.
function backward(count, arrows) {
  const next = Array.from({ length: count }, () => []);
  const into = new Array(count).fill(0);
  arrows.forEach(([from, to], i) => {
    if (from === to) return;
    next[from].push([to, i]);
    into[to] += 1;
  });
  const state = new Uint8Array(count);
  const back = new Set();
  const order = [...Array(count).keys()].sort((a, b) => (into[a] > 0) - (into[b] > 0));
  for (const root of order) {
    if (state[root]) continue;
    const stack = [[root, 0]];
    state[root] = 1;
    while (stack.length) {
      const top = stack.at(-1);
      const step = next[top[0]][top[1]];
      top[1] += 1;
      if (!step) {
        state[top[0]] = 2;
        stack.pop();
      } else if (state[step[0]] === 1) back.add(step[1]);
      else if (state[step[0]] === 0) {
        state[step[0]] = 1;
        stack.push([step[0], 0]);
      }
    }
  }
  return back;
}

// The number of the loop that each box is on: boxes that lead to one another have the same; -1 for those on none.
function loops(count, arrows) {
  const next = Array.from({ length: count }, () => []);
  const own = new Set();
  for (const [from, to] of arrows) {
    if (from === to) own.add(from);
    else next[from].push(to);
  }
  const [index, low, of] = [new Int32Array(count).fill(-1), new Int32Array(count), new Int32Array(count).fill(-1)];
  const held = new Uint8Array(count);
  const path = [];
  let seen = 0;
  let found = 0;
  // Tarjan 1972, without recursion.
  for (let root = 0; root < count; root++) {
    if (index[root] >= 0) continue;
    const stack = [[root, 0]];
    while (stack.length) {
      const top = stack.at(-1);
      const [box] = top;
      if (top[1] === 0) {
        index[box] = low[box] = seen++;
        path.push(box);
        held[box] = 1;
      }
      const to = next[box][top[1]++];
      if (to !== undefined) {
        if (index[to] < 0) stack.push([to, 0]);
        else if (held[to]) low[box] = Math.min(low[box], index[to]);
        continue;
      }
      stack.pop();
      if (stack.length) low[stack.at(-1)[0]] = Math.min(low[stack.at(-1)[0]], low[box]);
      if (low[box] !== index[box]) continue;
      const members = path.splice(path.lastIndexOf(box));
      members.forEach((member) => { held[member] = 0; });
      if (members.length > 1 || own.has(box)) members.forEach((member) => { of[member] = found; });
      found += 1;
    }
  }
  return of;
}

// Boxes with `width` and `height` get `x` and `y`. `down` puts the layers below one another. Returns the size of all, and
// the set of the arrows that lead back.
function lay(boxes, arrows, down) {
  const back = backward(boxes.length, arrows);
  const onward = arrows.filter(([from, to], i) => from !== to && !back.has(i));
  const layer = new Array(boxes.length).fill(0);
  for (let changed = true, round = 0; changed && round <= boxes.length; round++) {
    changed = false;
    for (const [from, to] of onward) {
      if (layer[to] >= layer[from] + 1) continue;
      layer[to] = layer[from] + 1;
      changed = true;
    }
  }
  const layers = [];
  boxes.forEach((_, i) => { (layers[layer[i]] ??= []).push(i); });
  const place = new Array(boxes.length).fill(0);
  const settle = () => layers.forEach((own) => own.forEach((box, i) => { place[box] = i - (own.length - 1) / 2; }));
  settle();
  for (let sweep = 0; sweep < 8; sweep++) {
    const side = sweep % 2 ? 0 : 1;
    for (const own of layers) {
      const middle = new Map(own.map((box) => {
        const near = onward.filter((arrow) => arrow[side] === box).map((arrow) => place[arrow[1 - side]]);
        return [box, near.length ? near.reduce((a, b) => a + b, 0) / near.length : place[box]];
      }));
      own.sort((a, b) => middle.get(a) - middle.get(b));
    }
    settle();
  }
  const [along, across] = down ? ["height", "width"] : ["width", "height"];
  const [first, second] = down ? ["y", "x"] : ["x", "y"];
  const long = layers.map((own) => own.reduce((sum, box) => sum + boxes[box][across] + GAP.box, -GAP.box));
  const widest = Math.max(...long);
  let at = 0;
  layers.forEach((own, i) => {
    const deep = Math.max(...own.map((box) => boxes[box][along]));
    let beside = (widest - long[i]) / 2;
    for (const box of own) {
      boxes[box][first] = at + (deep - boxes[box][along]) / 2;
      boxes[box][second] = beside;
      beside += boxes[box][across] + GAP.box;
    }
    at += deep + GAP.layer;
  });
  return { back, size: { [along]: Math.max(at - GAP.layer, 0), [across]: widest } };
}
