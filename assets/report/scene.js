// The objects of the 3-D view: table, fixtures, parts, arm, floor, lights and the places of states.
import * as THREE from "three";
import { OrbitControls } from "three/orbit";

// The looks of objects in every scene. The looks of parts and fixtures are in the data.
const LOOKS = {
  table: { colour: 0xb9a78c, roughness: 0.9 }, link: { colour: 0xf2f3f5, roughness: 0.5 },
  hand: { colour: 0x5d6b7a, roughness: 0.6 },
};
const FLOOR = { radius: 2.0, clear: 0.5, rings: 8, shaded: 0.85 };
const RING = { least: 0.016, wide: 0.006, thick: 0.0014, colour: 0x7b2d8b };
// Half the thickness of an area.
const SHEET_M = 0.0004;
const SHADOW = { pixels: 1024, half: 0.85, above: 2.2 };

function geometry(mesh) {
  const corners = new Float32Array(mesh.triangles.flat().flatMap((corner) => mesh.vertices[corner]));
  const shape = new THREE.BufferGeometry();
  shape.setAttribute("position", new THREE.BufferAttribute(corners, 3));
  shape.computeVertexNormals();
  shape.computeBoundingBox();
  return shape;
}

function solid(mesh, look) {
  const { colour: color, roughness } = look;
  const body = new THREE.Mesh(geometry(mesh), new THREE.MeshStandardMaterial({
    color, roughness, metalness: 0.1, shadowSide: THREE.DoubleSide,
  }));
  body.castShadow = true;
  body.receiveShadow = true;
  return body;
}

// The corners of an object's own bounding box, in its own frame.
function corners(object) {
  const { min, max } = object.geometry.boundingBox;
  return [0, 1, 2, 3, 4, 5, 6, 7].map((i) => new THREE.Vector3(i & 1 ? max.x : min.x, i & 2 ? max.y : min.y, i & 4 ? max.z : min.z));
}

const inWorld = (object, points) => points.map((point) => point.clone().applyMatrix4(object.matrixWorld));

// A place of a state, as far as it reaches: an area as a sheet below its objects, whose colours it must not tint, another place as an
// ellipsoid. That of a goal is less transparent and has a ring.
function placeOf(state, look) {
  const material = new THREE.MeshBasicMaterial({
    color: look.colour, transparent: true, opacity: state.goal ? 0.45 : 0.28, depthWrite: false,
  });
  const lengths = state.reach.map((length) => Math.max(length, 0.004));
  const group = new THREE.Group();
  const mesh = new THREE.Mesh(state.area ? new THREE.BoxGeometry(2, 2, 2) : new THREE.SphereGeometry(1, 24, 16), material);
  mesh.scale.set(...lengths);
  if (state.area) {
    // Not below the table.
    const { position: [, , height] } = state.mean;
    mesh.position.z = height > 0 ? Math.max(-lengths[2], 2 * SHEET_M - height) : -lengths[2];
    mesh.scale.z = SHEET_M;
  }
  group.add(mesh);
  if (state.goal) {
    const radius = Math.max(...lengths, RING.least) + RING.wide;
    const ring = new THREE.Mesh(new THREE.TorusGeometry(radius, RING.thick, 8, 48), new THREE.MeshBasicMaterial({ color: RING.colour }));
    group.add(ring);
  }
  group.position.set(...state.mean.position);
  return group;
}

// A statement with the name of one reference in the place of any of its kind; behind it, if it names none.
function atReference(words, kind, name) {
  const any = `${/^[aeiou]/.test(kind) ? "an" : "a"} ${kind.replaceAll("_", " ")}`;
  const at = words.lastIndexOf(` ${any}`) + 1;
  const rest = words.slice(at + any.length);
  return at > 0 && /^($|[,.]| \(| that | is )/.test(rest) ? `${words.slice(0, at)}${name}${rest}` : `${words}, at ${name}`;
}

class Bodies {
  // `objects` are the parts and landmarks by id and kind; without them only states of the world frame are drawn.
  constructor(outline, states, objects = null, names = null) {
    this.scene = new THREE.Scene();
    const meshOf = (name) => outline.meshes.find((m) => JSON.stringify(m.body) === JSON.stringify(name));
    const add = (body, parent = this.scene) => {
      parent.add(body);
      return body;
    };
    this.table = add(solid(meshOf("table"), LOOKS.table));
    this.fixtures = outline.fixtures.map((look, fixture) => add(solid(meshOf({ fixture }), look)));
    this.parts = outline.parts.map((kind) => add(solid(meshOf({ kind }), outline.kinds[kind].look)));
    this.ground = this.table.geometry.boundingBox.min.z;
    this.addArm(outline, meshOf, add);
    this.addFloor();
    this.addLights();
    this.addLandmarks(objects);
    this.addStates(states, new Map(outline.kinds.map((kind) => [kind.name, kind.look])), names);
  }

  addArm(outline, meshOf, add) {
    // The physics has no body for the base because nothing can come near it.
    const stand = new THREE.MeshStandardMaterial({ color: LOOKS.hand.colour, roughness: LOOKS.hand.roughness });
    const height = 0.14 - this.ground;
    const base = add(new THREE.Mesh(new THREE.CylinderGeometry(0.075, 0.095, height, 32), stand));
    base.rotation.x = Math.PI / 2;
    base.position.z = this.ground + height / 2;
    base.castShadow = true;
    // Each joint's frame hangs in the frame before it and turns about its own z.
    let parent = this.scene;
    const last = outline.joints.length - 1;
    this.links = [];
    this.joints = outline.joints.map((pose, joint) => {
      const fixed = new THREE.Group();
      fixed.position.set(...pose.position);
      fixed.quaternion.set(...pose.orientation);
      const turning = new THREE.Group();
      this.links.push(add(solid(meshOf({ link: joint }), joint === last ? LOOKS.hand : LOOKS.link), turning));
      fixed.add(turning);
      parent.add(fixed);
      parent = turning;
      return turning;
    });
    const closing = new THREE.Vector3(...outline.closing);
    this.fingers = [0, 1].map((finger) => {
      const mesh = add(solid(meshOf({ finger }), LOOKS.hand), parent);
      return { mesh, along: closing.clone().multiplyScalar(finger === 0 ? 1 : -1) };
    });
    // Half a centimetre behind the fingertips, in the last link's frame.
    const tip = Math.max(...this.fingers.map(({ mesh }) => mesh.geometry.boundingBox.max.z));
    this.tool = new THREE.Object3D();
    this.tool.position.z = tip - 0.005;
    parent.add(this.tool);
  }

  // A disc that turns into the background, so that the floor has no edge, and the shadows on it. The disc is opaque and
  // neither is lit: they fill most of the picture, which is slow without a graphics card.
  addFloor() {
    const shape = new THREE.RingGeometry(0.001, FLOOR.radius, 48, FLOOR.rings);
    const shades = new Float32Array(3 * shape.attributes.position.count);
    shape.setAttribute("color", new THREE.BufferAttribute(shades, 3));
    this.floor = new THREE.Mesh(shape, new THREE.MeshBasicMaterial({ vertexColors: true }));
    this.shade = new THREE.Mesh(new THREE.CircleGeometry(FLOOR.shaded, 32), new THREE.ShadowMaterial({ depthWrite: false }));
    this.shade.receiveShadow = true;
    this.shade.renderOrder = -1;
    const middle = this.middle();
    this.floor.position.set(middle.x, middle.y, this.ground - 0.002);
    this.shade.position.set(0.7 * middle.x, middle.y, this.ground - 0.001);
    this.scene.add(this.floor, this.shade);
  }

  paintFloor(near, far) {
    const { position, color } = this.floor.geometry.attributes;
    for (let i = 0; i < position.count; i++) {
      const away = Math.hypot(position.getX(i), position.getY(i));
      const share = clamp((away - FLOOR.clear) / (FLOOR.radius - FLOOR.clear), 0, 1);
      const { r, g, b } = near.clone().lerp(far, share);
      color.setXYZ(i, r, g, b);
    }
    color.needsUpdate = true;
  }

  middle() {
    return this.table.geometry.boundingBox.getCenter(new THREE.Vector3());
  }

  addLights() {
    this.sky = new THREE.HemisphereLight(0xffffff, 0x9a8f80, 1.5);
    this.sun = new THREE.DirectionalLight(0xffffff, 2.0);
    const fill = new THREE.DirectionalLight(0xffffff, 0.5);
    fill.position.set(-0.6, 1.4, 1.0);
    const middle = this.middle().multiplyScalar(0.7);
    this.sun.position.copy(middle).add(new THREE.Vector3(0.7, -0.55, SHADOW.above));
    this.sun.target.position.copy(middle);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(SHADOW.pixels, SHADOW.pixels);
    Object.assign(this.sun.shadow.camera, {
      left: -SHADOW.half, right: SHADOW.half, top: SHADOW.half, bottom: -SHADOW.half, near: 0.5, far: 2 * SHADOW.above,
    });
    this.sun.shadow.bias = -0.0015;
    this.sun.shadow.normalBias = 0.006;
    this.scene.add(this.sky, this.sun, this.sun.target, fill);
  }

  // The frames in which states are given: the world, and each part and landmark by its kind.
  addLandmarks(objects) {
    this.states = [];
    this.references = (objects?.parts ?? []).map(({ id, kind }, i) => ({ id, kind, body: this.parts[i] }));
    for (const { id, kind, pose, on } of objects?.landmarks ?? []) {
      const body = new THREE.Group();
      body.position.set(...pose.position);
      body.quaternion.set(...pose.orientation);
      (this.parts[on] ?? this.scene).add(body);
      this.references.push({ id, kind, body });
    }
  }

  // Each place of a state, at least 8 mm wide, in the world or at each object that is its frame. The first place of a state at an
  // object has a label.
  addStates(states, looks, names) {
    this.anchors = [];
    const labelled = new Set();
    for (const state of states) {
      if (!state.mean || !state.reach) continue;
      const own = this.references.filter(({ kind }) => kind === state.frame);
      for (const { id, body } of state.frame ? own : [{ body: this.scene }]) {
        const look = looks.get(state.kind) ?? { colour: 0x777777 };
        const mesh = placeOf(state, look);
        body.add(mesh);
        this.states.push(mesh);
        const key = `${state.name} ${id ?? ""}`;
        if (labelled.has(key)) continue;
        labelled.add(key);
        const at = () => mesh.getWorldPosition(new THREE.Vector3());
        const words = names?.sayState(state.name) ?? state.name;
        const told = state.frame && own.length > 1 ? atReference(words, state.frame, names?.say(id) ?? id) : words;
        this.anchors.push({ name: `${state.goal ? "goal" : "state"}: ${told}`, goal: state.goal, colour: look.colour, at });
      }
    }
  }

  // Frees what the graphics card holds.
  dispose() {
    this.scene.traverse((object) => {
      object.geometry?.dispose();
      object.material?.dispose?.();
    });
    this.sun.shadow.map?.dispose();
  }

  // Light or dark surroundings.
  paint() {
    this.scene.background = new THREE.Color(theme.colours.sky || "#e9edf1");
    this.paintFloor(new THREE.Color(theme.colours.floor || "#d9dfe5"), this.scene.background);
    this.shade.material.opacity = theme.dark ? 0.45 : 0.22;
    this.sky.intensity = theme.dark ? 1.3 : 1.5;
  }
}

