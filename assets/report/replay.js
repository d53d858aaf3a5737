// The 3-D view of the episode: poses at a moment, camera, labels.

const POSE = { position: 3, width: 7 };
// Height of the rows into which an outline is cut, in pixels.
const ROW = 12;

class Replay {
  // `objects` are the parts and landmarks by id and kind, `names` the words for states; both may be missing.
  constructor(view, outline, frames, states, objects = null, names = null) {
    this.view = view;
    this.names = names;
    this.canvas = view.querySelector("canvas");
    this.held = () => null;
    this.aim = () => null;
    this.named = () => "";
    this.tip = make("div");
    this.tip.className = "tip";
    view.append(this.tip);
    this.statesShown = true;
    this.renderer = new THREE.WebGLRenderer({ canvas: this.canvas, antialias: true });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.BasicShadowMap;
    // Shadows are drawn when something has moved, not when only the camera has.
    this.renderer.shadowMap.autoUpdate = false;
    this.camera = new THREE.PerspectiveCamera(34, 1.6, 0.05, 20);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, this.canvas);
    // As on the time axis, the wheel scrolls the page until the reader has clicked the picture.
    this.controls.enableZoom = false;
    this.canvas.addEventListener("focus", () => { this.controls.enableZoom = true; });
    this.canvas.addEventListener("blur", () => { this.controls.enableZoom = false; });
    this.canvas.addEventListener("pointerdown", () => this.canvas.focus({ preventScroll: true }));
    const point = (event) => {
      const dragged = event.type === "pointermove" && event.buttons > 0;
      this.pointer = dragged ? null : [event.offsetX, event.offsetY];
      this.touched = event.pointerType === "touch";
      this.tellPart();
    };
    ["pointermove", "pointerdown"].forEach((kind) => this.canvas.addEventListener(kind, point));
    this.canvas.addEventListener("pointerleave", (event) => {
      // A finger leaves when it is lifted: what it has touched stays named at that moment.
      if (event.pointerType === "touch") return;
      this.pointer = null;
      this.tellPart();
    });
    this.controls.addEventListener("change", () => { if (!this.following) this.render(); });
    theme.listeners.push(() => { this.bodies?.paint(); this.render(); });
    this.load(outline, frames, states, objects);
    new ResizeObserver(() => {
      const { clientWidth, clientHeight } = this.canvas;
      if (clientWidth !== this.labels.width || clientHeight !== this.labels.height) this.resize();
    }).observe(this.canvas);
  }

  // Shows other frames from their beginning.
  load(outline, frames, states, objects) {
    this.bodies?.dispose();
    // The first picture is drawn once, when all is in place.
    this.loading = true;
    this.frames = frames;
    this.bodies = new Bodies(outline, states, objects, this.names);
    this.labels = new Labels(this.view.querySelector(".labels"), this.bodies.anchors);
    const { parts, fixtures, fingers, links } = this.bodies;
    const measured = [this.bodies.table, ...parts, ...fixtures, ...fingers.map(({ mesh }) => mesh), links.at(-1)];
    this.extents = new Map(measured.map((body) => [body, corners(body)]));
    const points = framed(this.bodies, frames, (time) => this.pose(time));
    this.views?.forget();
    this.views = new Views(this.camera, this.controls, this.bodies, points, this.views?.name);
    this.bodies.paint();
    this.showStates(this.statesShown);
    this.resize();
    this.loading = false;
    this.show(0);
  }

  showStates(visible) {
    this.statesShown = visible;
    this.bodies.states.forEach((state) => { state.visible = visible; });
    this.render();
  }

  showLabels(visible) {
    this.labels.show(visible);
    this.render();
  }

  choose(view) {
    this.views.choose(view);
    this.render();
  }

  resize() {
    const { clientWidth, clientHeight } = this.canvas;
    if (!clientWidth || !clientHeight || !this.bodies) return;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    this.labels.measure(clientWidth, clientHeight);
    if (!this.views.moved) this.views.place();
    this.render();
  }

  show(time) {
    if (this.touched && time !== this.time) this.pointer = null;
    this.time = time;
    this.pose(time);
    this.bodies.scene.updateMatrixWorld(true);
    this.renderer.shadowMap.needsUpdate = true;
    this.following = true;
    this.views.follow();
    this.following = false;
    this.render();
  }

  // Puts everything where it was at a moment, between the two frames around it.
  pose(time) {
    const { t, angles, fingers, poses, parts, count } = this.frames;
    if (count === 0) return;
    const next = clamp(countUpTo(t, time), 0, count - 1);
    const last = Math.max(next - 1, 0);
    const share = next > last ? clamp((time - t[last]) / (t[next] - t[last]), 0, 1) : 0;
    const mix = (numbers, width, i) => numbers[last * width + i] * (1 - share) + numbers[next * width + i] * share;
    this.bodies.joints.forEach((joint, i) => { joint.rotation.z = mix(angles, 7, i); });
    this.bodies.fingers.forEach(({ mesh, along }, i) => mesh.position.copy(along).multiplyScalar(mix(fingers, 2, i)));
    const width = parts * POSE.width;
    const turn = new THREE.Quaternion();
    this.bodies.parts.slice(0, parts).forEach((part, index) => {
      const from = index * POSE.width;
      part.position.set(mix(poses, width, from), mix(poses, width, from + 1), mix(poses, width, from + 2));
      part.quaternion.fromArray(poses, last * width + from + POSE.position);
      part.quaternion.slerp(turn.fromArray(poses, next * width + from + POSE.position), share);
    });
  }

  // Draws a moment into another canvas, as the present view shows it and without labels.
  copyTo(canvas, time) {
    const now = this.time;
    this.pose(time);
    this.bodies.scene.updateMatrixWorld(true);
    this.renderer.shadowMap.needsUpdate = true;
    this.renderer.render(this.bodies.scene, this.camera);
    const { width, height } = this.renderer.domElement;
    const share = Math.min(width / canvas.width, height / canvas.height);
    const [wide, tall] = [share * canvas.width, share * canvas.height];
    canvas.getContext("2d").drawImage(this.renderer.domElement, (width - wide) / 2, (height - tall) / 2, wide, tall,
      0, 0, canvas.width, canvas.height);
    this.show(now);
  }

  render() {
    if (!this.bodies || this.loading) return;
    this.renderer.render(this.bodies.scene, this.camera);
    this.tellPart();
    if (!this.labels.shown) return;
    const { parts, fixtures, fingers, links, joints } = this.bodies;
    const hand = [...fingers.map(({ mesh }) => mesh), links.at(-1)];
    const solids = [this.around(hand), ...parts.map((part) => this.around([part]))];
    // The arm as points along its links.
    const at = [...joints, this.bodies.tool].map((joint) => this.project(joint.getWorldPosition(new THREE.Vector3())));
    const soft = at.slice(1).flatMap((to, i) => [0.25, 0.5, 0.75, 1].map((share) => {
      const [x, y] = [0, 1].map((axis) => at[i][axis] + share * (to[axis] - at[i][axis]));
      return { left: x - 18, right: x + 18, top: y - 18, bottom: y + 18 };
    }));
    this.labels.place(this.camera, solids, [...soft, ...fixtures.map((fixture) => this.around([fixture]))],
      this.labels.narrow ? this.rowsOf(this.bodies.table) : [], this.target());
  }

  // Where the part goes that the robot handles at the moment.
  target() {
    const at = this.aim();
    return at ? new THREE.Vector3(...at) : null;
  }

  project(point) {
    const { x, y } = point.clone().project(this.camera);
    return [((x + 1) / 2) * this.canvas.clientWidth, ((1 - y) / 2) * this.canvas.clientHeight];
  }

  // The rectangle of some bodies in the picture.
  around(bodies) {
    const seen = bodies.flatMap((body) => inWorld(body, this.extents.get(body))).map((point) => this.project(point));
    const [xs, ys] = [0, 1].map((axis) => seen.map((point) => point[axis]));
    return { left: Math.min(...xs), right: Math.max(...xs), top: Math.min(...ys), bottom: Math.max(...ys) };
  }

  // A body's own box in the picture, in rows that follow its outline.
  rowsOf(body) {
    const points = inWorld(body, this.extents.get(body)).map((point) => this.project(point));
    const ends = points.flatMap((a, i) => points.slice(i + 1).map((b) => [a, b]));
    const rows = [];
    for (let top = Math.max(Math.min(...points.map(([, y]) => y)), 0); top < this.canvas.clientHeight; top += ROW) {
      const middle = top + ROW / 2;
      const crossed = ends.filter(([[, a], [, b]]) => Math.min(a, b) <= middle && Math.max(a, b) >= middle && a !== b);
      const xs = crossed.map(([[x, y], [to, at]]) => x + ((middle - y) / (at - y)) * (to - x));
      if (xs.length) rows.push({ left: Math.min(...xs), right: Math.max(...xs), top, bottom: top + ROW });
    }
    return rows;
  }

  // The nearest body that a ray meets. The floor and the marks of states are none.
  firstHit(ray) {
    const { scene, states, floor, shade } = this.bodies;
    const solids = scene.children.filter((child) => ![floor, shade].includes(child));
    const marks = new Set(states.flatMap(({ children }) => children));
    return ray.intersectObjects(solids, true).find(({ object }) => object.isMesh && !marks.has(object));
  }

  // The ray from the camera through a point of the picture.
  ray(x, y) {
    const ray = new THREE.Raycaster();
    const { clientWidth, clientHeight } = this.canvas;
    ray.setFromCamera(new THREE.Vector2((2 * x) / clientWidth - 1, 1 - (2 * y) / clientHeight), this.camera);
    return ray;
  }

  // Names the part at the pointer, beside it.
  tellPart() {
    const { pointer, tip } = this;
    const part = pointer ? this.bodies.parts.indexOf(this.firstHit(this.ray(...pointer))?.object) : -1;
    tip.hidden = part < 0;
    if (tip.hidden) return;
    tip.textContent = this.named(part);
    const [x, y] = [pointer[0] + 14, pointer[1] - 14 - tip.offsetHeight];
    tip.style.transform = `translate(${clamp(x, 0, Math.max(this.canvas.clientWidth - tip.offsetWidth, 0))}px, ${Math.max(y, 0)}px)`;
  }

  // The share of a body's surface points facing the camera's way that nothing else hides.
  visible(bodies) {
    const ray = new THREE.Raycaster();
    const own = new Set(bodies);
    const seen = bodies.map((body) => {
      const { position } = body.geometry.attributes;
      const every = Math.max(Math.floor(position.count / 24), 1);
      let free = 0;
      let all = 0;
      for (let i = 0; i < position.count; i += every) {
        const at = new THREE.Vector3().fromBufferAttribute(position, i).applyMatrix4(body.matrixWorld);
        ray.set(this.camera.position, at.clone().sub(this.camera.position).normalize());
        const hit = this.firstHit(ray);
        all += 1;
        if (!hit || own.has(hit.object) || hit.distance > at.distanceTo(this.camera.position) - 1e-3) free += 1;
      }
      return free / all;
    });
    return Math.max(...seen);
  }

  // Where things are, in metres, and where they stand in the picture: for tests of the page.
  places() {
    this.bodies.scene.updateMatrixWorld(true);
    const of = (object) => object.getWorldPosition(new THREE.Vector3()).toArray();
    return { parts: this.bodies.parts.map(of), hand: of(this.bodies.joints.at(-1)) };
  }

  picture() {
    this.bodies.scene.updateMatrixWorld(true);
    const fingers = this.bodies.fingers.map(({ mesh }) => mesh);
    const body = (bodies) => ({ ...this.around(bodies), visible: this.visible(bodies) });
    const held = this.bodies.parts[this.held()];
    return {
      width: this.canvas.clientWidth, height: this.canvas.clientHeight, labels: this.labels.rectangles(),
      gripper: body(fingers), held: held ? body([held]) : null,
    };
  }
}

