// Reads a frame. Its layout stands in docs/live.md.

function readFrame(buffer) {
  const data = new DataView(buffer);
  let at = 0;
  const next = (kind, size) => { const value = data[`get${kind}`](at, true); at += size; return value; };
  const byte = () => next("Uint8", 1);
  const short = () => next("Uint16", 2);
  const word = () => next("Uint32", 4);
  const single = () => next("Float32", 4);
  const double = () => next("Float64", 8);
  const many = (count, read) => Array.from({ length: count }, read);
  if (byte() !== 1) throw new Error("the frame has another layout than this page: load it again");
  const frame = { mode: byte() };
  const plots = short();
  frame.epoch = word();
  Object.assign(frame, { tick: double(), time: double(), earliest: double() });
  Object.assign(frame, { speed: single(), spikes: single(), arrivals: single() });
  Object.assign(frame, { logged: word(), ahead: word(), events: word() });
  const [nodes, poses] = [short(), short()];
  frame.activity = many(nodes, single);
  frame.poses = many(poses, single);
  frame.plots = many(plots, () => {
    const [id, rows, width] = [word(), word(), word()];
    return { id, width, ticks: many(rows, double), values: many(rows * Math.max(width, 1), single) };
  });
  return frame;
}
