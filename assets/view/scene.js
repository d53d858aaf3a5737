// The scene of a live run: the replay of the report's page, with one frame that changes, and another hand that moves parts.

// A part that was taken away lies below this height, in metres.
const TAKEN_AWAY_M = -0.2;
// Distance from the pointer to the middle of a part that is taken by it, in pixels.
const GRABBED_PX = 12;
// From where a part comes back that this window has never seen, in metres.
const FROM_ABOVE_M = 0.05;

class LiveScene {
  constructor(section, outline, session) {
    const parts = outline.parts.length;
    this.frames = {
      count: 0, parts, t: new Float32Array(1), angles: new Float32Array(7), fingers: new Float32Array(2), poses: new Float32Array(7 * parts),
    };
    // The height of each part when it was last in the scene.
    Object.assign(this, { section, outline, session, replay: null, drag: null, heights: Array(parts).fill(FROM_ABOVE_M) });
    section.querySelectorAll("[data-view]").forEach((button) => button.addEventListener("click", () => {
      this.replay?.choose(button.dataset.view);
    }));
    // As the run calls them: the kind, and a number among the parts of this kind.
    const kinds = outline.parts.map((kind) => outline.kinds[kind].name);
    this.ids = kinds.map((kind, i) => `${kind}_${kinds.slice(0, i).filter((other) => other === kind).length}`);
    byId("part").replaceChildren(...this.ids.map((id) => make("option", id)));
    byId("grab").addEventListener("click", () => this.grab());
    byId("move").addEventListener("click", () => this.moveTyped());
    byId("remove").addEventListener("click", () => this.ask({ remove: { object: byId("part").value } }));
  }

  ask(wish) {
    this.session.send("do", { world: wish });
  }

  get grabbing() {
    return byId("grab").getAttribute("aria-pressed") === "true";
  }

  grab() {
    byId("grab").setAttribute("aria-pressed", String(!this.grabbing));
  }

  move(index, x, y) {
    const z = this.heights[index];
    this.ask({ move: { object: this.ids[index], position: [x, y, z].map((metres) => Number(metres.toFixed(6))) } });
  }

  moveTyped() {
    const numbers = byId("place").value.split(/[\s,]+/).filter(Boolean).map(Number);
    if (numbers.length !== 2 || !numbers.every(Number.isFinite)) {
      this.session.listeners.refused("the place needs two numbers in millimetres, x and y");
      return;
    }
    this.move(this.ids.indexOf(byId("part").value), numbers[0] / 1000, numbers[1] / 1000);
  }

  // The part whose middle is nearest to the pointer; -1 if none is near.
  nearest({ offsetX, offsetY }) {
    const far = this.replay.bodies.parts.slice(0, this.ids.length).map((part) => {
      const [x, y] = this.replay.project(part.position);
      return Math.hypot(x - offsetX, y - offsetY);
    });
    const least = Math.min(...far);
    return least <= GRABBED_PX ? far.indexOf(least) : -1;
  }

  ray({ offsetX, offsetY }) {
    return this.replay.ray(offsetX, offsetY);
  }

  // A part under the pointer is taken, follows on its height, and is put down where the pointer is released.
  listen() {
    const { canvas, controls } = this.replay;
    const over = (event) => {
      const plane = new THREE.Plane(new THREE.Vector3(0, 0, 1), -this.drag.z);
      return this.ray(event).ray.intersectPlane(plane, new THREE.Vector3());
    };
    canvas.addEventListener("pointerdown", (event) => {
      if (!this.grabbing || event.button !== 0) return;
      const parts = this.replay.bodies.parts.slice(0, this.ids.length);
      const [hit] = this.ray(event).intersectObjects(parts, true);
      // A part with a hole is also taken by the hole.
      const index = hit ? parts.indexOf(hit.object) : this.nearest(event);
      if (index < 0) return;
      // The picture does not turn with it.
      event.stopImmediatePropagation();
      controls.enabled = false;
      canvas.setPointerCapture(event.pointerId);
      this.drag = { index, z: this.heights[index], at: null };
      const begun = over(event);
      const { x, y } = parts[index].position;
      this.drag.off = begun ? [x - begun.x, y - begun.y] : [0, 0];
      byId("part").value = this.ids[index];
    }, { capture: true });
    canvas.addEventListener("pointermove", (event) => {
      const at = this.drag && over(event);
      if (!at) return;
      this.drag.at = [at.x + this.drag.off[0], at.y + this.drag.off[1]];
      this.show();
    });
    const drop = (event) => {
      const { drag } = this;
      if (!drag) return;
      this.drag = null;
      controls.enabled = true;
      if (event.type === "pointerup" && drag.at) this.move(drag.index, ...drag.at);
      this.show();
    };
    canvas.addEventListener("pointerup", drop);
    canvas.addEventListener("pointercancel", drop);
  }

  take({ poses }) {
    if (!poses.length) return;
    const { frames } = this;
    frames.angles.set(poses.slice(0, 7));
    frames.fingers.set(poses.slice(7, 9));
    frames.poses.set(poses.slice(9, 9 + 7 * frames.parts));
    this.heights = this.heights.map((last, i) => (frames.poses[7 * i + 2] > TAKEN_AWAY_M ? frames.poses[7 * i + 2] : last));
    frames.count = 1;
  }

  show() {
    if (this.frames.count === 0 || this.broken) return;
    try {
      // The camera frames the parts as they stand in the first frame.
      if (!this.replay) {
        this.replay = new Replay(this.section.querySelector(".view"), this.outline, this.frames, []);
        this.replay.named = (part) => this.ids[part].replaceAll("_", " ");
        this.listen();
        return;
      }
      const { drag, frames } = this;
      const held = drag?.at ? frames.poses.slice(7 * drag.index, 7 * drag.index + 2) : null;
      if (held) frames.poses.set(drag.at, 7 * drag.index);
      this.replay.show(0);
      if (held) frames.poses.set(held, 7 * drag.index);
    } catch (error) {
      this.broken = true;
      this.section.querySelector(".view").replaceChildren(make("p", `This browser cannot draw the 3-D view (${error.message}).`));
    }
  }
}
