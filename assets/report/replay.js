// The scene in three dimensions: the shapes of the physics at the moments that were kept.

// What every scene has; how parts and fixtures look stands in the data.
const LOOKS = {
  table: { colour: 0xb9a78c, roughness: 0.9 }, link: { colour: 0xf2f3f5, roughness: 0.5 },
  hand: { colour: 0x3c4652, roughness: 0.6 },
};
const hex = (colour) => `#${colour.toString(16).padStart(6, "0")}`;
const FRAME = { position: 3, pose: 7 };

function geometry(mesh) {
  const corners = new Float32Array(mesh.triangles.flat().flatMap((corner) => mesh.vertices[corner]));
  const shape = new THREE.BufferGeometry();
  shape.setAttribute("position", new THREE.BufferAttribute(corners, 3));
  shape.computeVertexNormals();
  return shape;
}

function solid(mesh, look) {
  const { colour: color, roughness } = look;
  const material = new THREE.MeshStandardMaterial({ color, roughness, metalness: 0.1 });
  return new THREE.Mesh(geometry(mesh), material);
}

// Axes and lengths of a symmetric 3 x 3 matrix, by Jacobi's rotations.
function principal(matrix) {
  const a = matrix.map((row) => row.slice(0, 3));
  const v = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
  for (let sweep = 0; sweep < 12; sweep++) {
    for (const [p, q] of [[0, 1], [0, 2], [1, 2]]) {
      if (Math.abs(a[p][q]) < 1e-300) continue;
      const angle = 0.5 * Math.atan2(2 * a[p][q], a[q][q] - a[p][p]);
      const [c, s] = [Math.cos(angle), Math.sin(angle)];
      for (const m of [a, v]) {
        for (let k = 0; k < 3; k++) {
          const [x, y] = [m[k][p], m[k][q]];
          [m[k][p], m[k][q]] = [c * x - s * y, s * x + c * y];
        }
      }
      for (let k = 0; k < 3; k++) {
        const [x, y] = [a[p][k], a[q][k]];
        [a[p][k], a[q][k]] = [c * x - s * y, s * x + c * y];
      }
    }
  }
  return { variances: [a[0][0], a[1][1], a[2][2]], axes: v };
}

class Replay {
  constructor(view, outline, frames, states) {
    this.canvas = view.querySelector("canvas");
    this.overlay = view.querySelector(".labels");
    this.frames = frames;
    this.scene = new THREE.Scene();
    this.renderer = new THREE.WebGLRenderer({ canvas: this.canvas, antialias: true, alpha: true });
    this.camera = new THREE.PerspectiveCamera(34, 1.6, 0.05, 20);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, this.canvas);
    // As on the time axis: the wheel scrolls the page until the picture is taken hold of.
    this.controls.enableZoom = false;
    this.canvas.addEventListener("focus", () => { this.controls.enableZoom = true; });
    this.canvas.addEventListener("blur", () => { this.controls.enableZoom = false; });
    this.canvas.addEventListener("pointerdown", () => this.canvas.focus({ preventScroll: true }));
    this.controls.addEventListener("change", () => this.render());
    this.light();
    this.looks = new Map(outline.kinds.map((kind) => [kind.name, kind.look]));
    this.build(outline);
    this.gaussians = this.drawStates(states);
    this.resetCamera();
    new ResizeObserver(() => this.resize()).observe(this.canvas);
    this.resize();
  }

  light() {
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x9a8f80, 1.6));
    for (const [x, y, z, strength] of [[1.2, -1.0, 2.0, 1.6], [-0.6, 1.4, 1.0, 0.6]]) {
      const light = new THREE.DirectionalLight(0xffffff, strength);
      light.position.set(x, y, z);
      this.scene.add(light);
    }
  }

  build(outline) {
    const meshOf = (name) => outline.meshes.find((m) => JSON.stringify(m.body) === JSON.stringify(name));
    this.scene.add(solid(meshOf("table"), LOOKS.table));
    outline.fixtures.forEach((look, fixture) => this.scene.add(solid(meshOf({ fixture }), look)));
    this.parts = outline.parts.map((kind) => {
      const part = solid(meshOf({ kind }), outline.kinds[kind].look);
      this.scene.add(part);
      return part;
    });
    // What the arm stands on is not in the physics: nothing can come near it.
    const stand = new THREE.MeshStandardMaterial({ color: LOOKS.hand.colour, roughness: LOOKS.hand.roughness });
    const base = new THREE.Mesh(new THREE.CylinderGeometry(0.075, 0.095, 0.16, 32), stand);
    base.rotation.x = Math.PI / 2;
    base.position.z = 0.06;
    this.scene.add(base);
    // Each joint's frame hangs in the one before it and turns about its own z.
    let parent = this.scene;
    this.joints = outline.joints.map((pose, joint) => {
      const fixed = new THREE.Group();
      fixed.position.set(...pose.position);
      fixed.quaternion.set(...pose.orientation);
      const turning = new THREE.Group();
      turning.add(solid(meshOf({ link: joint }), joint === outline.joints.length - 1 ? LOOKS.hand : LOOKS.link));
      fixed.add(turning);
      parent.add(fixed);
      parent = turning;
      return turning;
    });
    const closing = new THREE.Vector3(...outline.closing);
    this.fingers = [0, 1].map((finger) => {
      const mesh = solid(meshOf({ finger }), LOOKS.hand);
      parent.add(mesh);
      return { mesh, along: closing.clone().multiplyScalar(finger === 0 ? 1 : -1) };
    });
  }

  // Each state as the ellipsoid of two standard deviations about its mean, at least 4 mm so that it is seen.
  drawStates(states) {
    const group = new THREE.Group();
    this.labels = [];
    for (const state of states) {
      const { variances, axes } = principal(state.covariance);
      const look = this.looks.get(state.kind) ?? { colour: 0x777777, ink: 0x333333 };
      const material = new THREE.MeshBasicMaterial({
        color: look.colour, transparent: true, opacity: 0.3, depthWrite: false,
      });
      const mesh = new THREE.Mesh(new THREE.SphereGeometry(1, 24, 16), material);
      const lengths = variances.map((v) => Math.max(2 * Math.sqrt(Math.max(v, 0)), 0.004));
      const columns = [0, 1, 2].map((i) => new THREE.Vector3(axes[0][i], axes[1][i], axes[2][i]));
      if (columns[0].clone().cross(columns[1]).dot(columns[2]) < 0) columns[2].negate();
      mesh.quaternion.setFromRotationMatrix(new THREE.Matrix4().makeBasis(...columns));
      mesh.scale.set(...lengths);
      mesh.position.set(...state.mean.position);
      group.add(mesh);
      const label = make("span", state.name);
      label.style.color = hex(look.ink);
      this.overlay.append(label);
      const above = Math.max(...lengths.map((length, i) => Math.abs(columns[i].z) * length));
      this.labels.push({ label, at: mesh.position.clone().add(new THREE.Vector3(0, 0, above + 0.012)) });
    }
    this.scene.add(group);
    return group;
  }

  showStates(visible) {
    this.gaussians.visible = visible;
    this.overlay.hidden = !visible;
    this.render();
  }

  resetCamera() {
    this.camera.position.set(1.62, -1.15, 0.95);
    this.controls.target.set(0.3, 0.0, 0.29);
    this.controls.update();
  }

  resize() {
    const { clientWidth, clientHeight } = this.canvas;
    if (!clientWidth || !clientHeight) return;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    this.render();
  }

  // Puts everything where it was at a moment, between the two frames around it.
  show(time) {
    const { t, angles, fingers, poses, parts, count } = this.frames;
    if (count > 0) {
      const next = clamp(countUpTo(t, time), 0, count - 1);
      const last = Math.max(next - 1, 0);
      const share = next > last ? clamp((time - t[last]) / (t[next] - t[last]), 0, 1) : 0;
      const mix = (numbers, width, i) =>
        numbers[last * width + i] * (1 - share) + numbers[next * width + i] * share;
      this.joints.forEach((joint, i) => { joint.rotation.z = mix(angles, 7, i); });
      this.fingers.forEach(({ mesh, along }, i) => mesh.position.copy(along).multiplyScalar(mix(fingers, 2, i)));
      const width = parts * FRAME.pose;
      const turn = new THREE.Quaternion();
      this.parts.slice(0, parts).forEach((part, index) => {
        const from = index * FRAME.pose;
        part.position.set(mix(poses, width, from), mix(poses, width, from + 1), mix(poses, width, from + 2));
        part.quaternion.fromArray(poses, last * width + from + FRAME.position);
        part.quaternion.slerp(turn.fromArray(poses, next * width + from + FRAME.position), share);
      });
    }
    this.render();
  }

  render() {
    this.renderer.render(this.scene, this.camera);
    if (this.overlay.hidden) return;
    const { clientWidth, clientHeight } = this.canvas;
    // From the lowest up; whatever would cover another moves above it.
    const placed = this.labels
      .map(({ label, at }) => ({ label, seen: at.clone().project(this.camera) }))
      .map(({ label, seen }) => ({
        label, hidden: seen.z > 1, x: ((seen.x + 1) / 2) * clientWidth, y: ((1 - seen.y) / 2) * clientHeight,
        width: label.offsetWidth, height: label.offsetHeight,
      }))
      .sort((a, b) => b.y - a.y);
    placed.forEach((one, i) => {
      for (const other of placed.slice(0, i)) {
        const beside = Math.abs(one.x - other.x) > (one.width + other.width) / 2;
        if (!beside && Math.abs(one.y - other.y) < other.height) one.y = other.y - other.height;
      }
      one.label.hidden = one.hidden;
      one.label.style.left = `${one.x}px`;
      one.label.style.top = `${one.y}px`;
    });
  }

  // Where things are, in metres: for tests of the page.
  places() {
    this.scene.updateMatrixWorld(true);
    const of = (object) => object.getWorldPosition(new THREE.Vector3()).toArray();
    return { parts: this.parts.map(of), hand: of(this.joints[this.joints.length - 1]) };
  }
}

