// Where the camera stands: views that frame points computed from the data, or follow the end effector.

const VIEWS = {
  overview: { turn: -0.62, rise: 0.5 },
  top: { turn: 0, rise: 0.98 },
  follow: { turn: -0.62, rise: 0.42, apart: 0.62 },
};
// The share of the picture's half width and half height that the framed points may fill.
const FILL = 0.95;

// Number of frames at which the movements of an episode are examined.
const LOOKS_AT = 120;

// The points that a view must show, each with a radius: table and fixtures, and the parts and the arm wherever they
// move.
function framed(bodies, frames, pose) {
  bodies.scene.updateMatrixWorld(true);
  const still = [bodies.table, ...bodies.fixtures].flatMap((body) => inWorld(body, corners(body)));
  const middle = bodies.middle();
  const arm = [];
  const tool = [];
  const parts = [];
  for (let i = 0; i < LOOKS_AT && frames.count > 0; i++) {
    pose(frames.t[Math.floor((i * (frames.count - 1)) / (LOOKS_AT - 1))]);
    bodies.scene.updateMatrixWorld(true);
    for (const joint of bodies.joints) arm.push(joint.getWorldPosition(new THREE.Vector3()));
    tool.push(bodies.tool.getWorldPosition(new THREE.Vector3()));
    for (const part of bodies.parts) parts.push(part.getWorldPosition(new THREE.Vector3()));
  }
  // A part that fell to the floor or rolled away does not shrink the picture.
  const near = (point) => point.z > bodies.ground - 0.02 && point.distanceTo(middle) < 1.2;
  const round = (points, radius) => points.filter(near).map((at) => ({ at, radius }));
  const stand = { at: new THREE.Vector3(0, 0, bodies.ground), radius: 0.09 };
  // `table` are the points on and near the table; `arm` are the other points of the arm.
  return { table: [...round(still, 0), ...round(parts, 0.05), ...round(tool, 0.09)], arm: [...round(arm, 0.06), stand] };
}

// Puts the camera as near as all points allow, looking in the direction given by turn (from the line that leads from
// the arm's base over the table's middle) and rise (above the table), both in radians.
function fit(camera, points, middle, { turn, rise }) {
  const bearing = Math.atan2(middle.y, middle.x) + turn;
  const back = new THREE.Vector3(
    Math.cos(rise) * Math.cos(bearing), Math.cos(rise) * Math.sin(bearing), Math.sin(rise),
  );
  const right = new THREE.Vector3(-Math.sin(bearing), Math.cos(bearing), 0);
  const up = back.clone().cross(right);
  const tall = Math.tan((camera.fov * Math.PI) / 360) * FILL;
  const wide = tall * camera.aspect;
  // The four planes of the view, each pushed out until no point lies beyond it.
  const most = (axis, slope) => Math.max(...points.map(({ at, radius }) =>
    at.dot(axis) + slope * at.dot(back) + radius * Math.hypot(1, slope)));
  const side = [most(right, wide), most(right.clone().negate(), wide)];
  const height = [most(up, tall), most(up.clone().negate(), tall)];
  const away = Math.max((side[0] + side[1]) / (2 * wide), (height[0] + height[1]) / (2 * tall));
  const place = right.clone().multiplyScalar((side[0] - side[1]) / 2)
    .addScaledVector(up, (height[0] - height[1]) / 2).addScaledVector(back, away);
  return { place, back, apart: Math.max(away - middle.dot(back), 0.2) };
}

class Views {
  constructor(camera, controls, bodies, points, name = "overview") {
    Object.assign(this, { camera, controls, bodies, points, name, moved: false });
    this.touched = () => { this.moved = true; };
    controls.addEventListener("start", this.touched);
  }

  forget() {
    this.controls.removeEventListener("start", this.touched);
  }

  choose(name) {
    this.name = name;
    this.moved = false;
    this.place();
  }

  // Frames the view again. Once the reader has moved the camera, this happens only on request.
  place() {
    const { table, arm } = this.points;
    const view = VIEWS[this.name];
    if (this.name === "follow") {
      this.tool = this.bodies.tool.getWorldPosition(new THREE.Vector3());
      const { back } = fit(this.camera, table, this.bodies.middle(), view);
      // The same part of the scene stays visible in a narrow picture.
      const apart = view.apart / Math.min(this.camera.aspect, 1);
      this.set(this.tool.clone().addScaledVector(back, apart), this.tool);
      return;
    }
    const points = this.name === "top" ? table : [...table, ...arm];
    const { place, back, apart } = fit(this.camera, points, this.bodies.middle(), view);
    this.set(place, place.clone().addScaledVector(back, -apart));
  }

  set(place, target) {
    this.camera.position.copy(place);
    this.controls.target.copy(target);
    this.controls.update();
  }

  // Moves the camera with the end effector.
  follow() {
    if (this.name !== "follow" || !this.tool) return;
    const tool = this.bodies.tool.getWorldPosition(new THREE.Vector3());
    const by = tool.clone().sub(this.tool);
    this.tool = tool;
    this.set(this.camera.position.clone().add(by), this.controls.target.clone().add(by));
  }
}

