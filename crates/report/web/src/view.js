// The scene in three dimensions: turned by pointer or keys, cut by a plane, asked for the face under a point.

import {
  Box3, BufferAttribute, BufferGeometry, ColorManagement, DoubleSide, LinearSRGBColorSpace, LineBasicMaterial, LineLoop, LineSegments, Mesh,
  MeshBasicMaterial, PerspectiveCamera, Plane, Scene, Vector2, Vector3, WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';

// Colours are computed as they are to be shown.
ColorManagement.enabled = false;

/** The colour of sensors. */
const SENSOR = 0x00c896;
/** Seconds that a flight takes. */
const FLIGHT = 0.6;
/** Faces below this part of the mean radiosity are dark. */
const DARK = 1e-3;
/** How far corners stand out beyond their faces, as a part of the scene's size and at most of an edge: no light shines through where the corner of one
 * face is on the edge of another. */
const OVERLAP = 1e-4;
const OVERLAP_OF_EDGE = 0.1;
/** A step of a walk, as a part of the scene's size. */
const STEP = 0.03;

export class View {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas, result) {
    this.canvas = canvas;
    this.result = result;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.renderer.outputColorSpace = LinearSRGBColorSpace;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.setClearColor(0x262626);
    this.scene = new Scene();
    this.section = new Plane(new Vector3(1, 0, 0), Infinity);
    this.buildFaces();
    this.buildGrid();
    this.buildSensors();
    this.mark = new LineLoop(new BufferGeometry(), new LineBasicMaterial({ color: 0xff3300, depthTest: false }));
    this.mark.renderOrder = 2;
    this.mark.visible = false;
    this.scene.add(this.mark);
    this.camera = new PerspectiveCamera(result.facts.view.fov, 1, this.size * 5e-4, this.size * 20);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener('change', () => this.draw());
    canvas.addEventListener('wheel', (event) => {
      if (this.controls.rotateSpeed > 0) return;
      event.preventDefault();
      event.stopImmediatePropagation();
      this.walk(0, event.deltaY < 0 ? 1 : -1);
    }, { capture: true, passive: false });
    this.home();
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.resize();
  }

  /** Two triangles a face (one where it is a triangle), seen from their front; those of dark faces last. */
  orderFaces(places) {
    const { result } = this;
    const dark = this.darkFaces();
    const overlap = OVERLAP * new Box3().setFromArray(result.corners).getSize(new Vector3()).length();
    const grown = new Float32Array(12);
    let at = 0;
    for (const wanted of [false, true]) {
      for (let face = 0; face < result.size; face += 1) {
        if (dark[face] !== wanted) continue;
        grow(grown, result.corners.subarray(12 * face, 12 * face + 12), result.isTriangle(face) ? 3 : 4, overlap);
        for (let second = 1; second <= (result.isTriangle(face) ? 1 : 2); second += 1) {
          this.faceOf[at] = face;
          this.secondOf[at] = second;
          for (let corner = 0; corner < 3; corner += 1) {
            const which = corner === 0 ? 0 : second + corner - 1;
            for (let axis = 0; axis < 3; axis += 1) places[9 * at + 3 * corner + axis] = grown[3 * which + axis];
          }
          at += 1;
        }
      }
      if (!wanted) this.litCount = at;
    }
  }

  buildFaces() {
    const { result } = this;
    let count = 0;
    for (let face = 0; face < result.size; face += 1) count += result.isTriangle(face) ? 1 : 2;
    this.faceOf = new Uint32Array(count);
    // The corners of a triangle after its first: 1, 2 or 2, 3.
    this.secondOf = new Uint8Array(count);
    const places = new Float32Array(9 * count);
    this.orderFaces(places);
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(places, 3));
    this.bytes = new Uint8Array(places.length);
    this.paint = new BufferAttribute(this.bytes, 3, true);
    geometry.setAttribute('color', this.paint);
    geometry.computeBoundingSphere();
    this.centre = geometry.boundingSphere.center;
    this.size = geometry.boundingSphere.radius || 1;
    geometry.computeBoundingBox();
    this.box = geometry.boundingBox;
    this.geometry = geometry;
    // Dark faces stand back a little: in one plane with a lit face they are the inner layer.
    this.materials = [1, 8].map((back) => new MeshBasicMaterial({
      vertexColors: true, clippingPlanes: [], polygonOffset: true, polygonOffsetFactor: back, polygonOffsetUnits: back,
    }));
    this.groupFaces();
    this.renderer.localClippingEnabled = true;
    const mesh = new Mesh(geometry, this.materials);
    mesh.frustumCulled = false;
    this.scene.add(mesh);
  }

  /** Tells lit faces from dark ones, which come after them. */
  groupFaces() {
    const count = this.faceOf.length;
    this.geometry.clearGroups();
    this.geometry.addGroup(0, 3 * this.litCount, 0);
    this.geometry.addGroup(3 * this.litCount, 3 * (count - this.litCount), 1);
  }

  /** Shows a later result of the same scene: light has come to faces that were dark. */
  renew(result) {
    this.result = result;
    const { position } = this.geometry.attributes;
    this.orderFaces(position.array);
    position.needsUpdate = true;
    this.groupFaces();
  }

  buildGrid() {
    this.gridMaterial = new LineBasicMaterial({ color: 0x888888, transparent: true, opacity: 0.35, clippingPlanes: [] });
    this.grid = new LineSegments(new BufferGeometry(), this.gridMaterial);
    this.hasGrid = false;
    this.grid.visible = false;
    this.scene.add(this.grid);
  }

  /** The edges of faces from one to before another. */
  outlines(from, to) {
    const { result } = this;
    const lines = [];
    for (let face = from; face < to; face += 1) {
      const count = result.isTriangle(face) ? 3 : 4;
      for (let which = 0; which < count; which += 1) {
        lines.push(...result.corner(face, which), ...result.corner(face, (which + 1) % count));
      }
    }
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array(lines), 3));
    return geometry;
  }

  /** The cells of sensors, which one sees through, with their outlines. They are numbered after the faces. */
  buildSensors() {
    const { result } = this;
    this.sensors = null;
    if (result.sensors === null) return;
    const end = result.size + result.sensors.size;
    const places = [];
    this.sensorOf = [];
    for (let cell = result.size; cell < end; cell += 1) {
      for (const which of [0, 1, 2, 0, 2, 3]) places.push(...result.corner(cell, which));
      this.sensorOf.push(cell, cell);
    }
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array(places), 3));
    const glass = new MeshBasicMaterial({ color: SENSOR, transparent: true, opacity: 0.25, side: DoubleSide, depthWrite: false });
    this.sensors = new Mesh(geometry, glass);
    this.sensors.add(new LineSegments(this.outlines(result.size, end), new LineBasicMaterial({ color: SENSOR })));
    this.scene.add(this.sensors);
  }

  /** Shows or hides the sensors. */
  showSensors(shown) {
    this.sensors.visible = shown;
    this.draw();
  }

  /** Faces of sides that nothing lights: the outsides of walls. They are hidden from an eye outside of the scene, so that it looks in. */
  darkFaces() {
    const { result } = this;
    const brightest = new Float64Array(result.size);
    for (const channel of result.channels) {
      const [light, emitted] = ['radiosity', 'emittance'].map((name) => result.number(name + channel));
      for (let face = 0; face < result.size; face += 1) brightest[face] = Math.max(brightest[face], light[face] || 0, emitted[face] || 0);
    }
    const sides = result.surfaceSides();
    const [powers, areas] = [new Float64Array(result.size), new Float64Array(result.size)];
    let [power, area] = [0, 0];
    for (let face = 0; face < result.size; face += 1) {
      powers[sides[face]] += brightest[face] * result.area[face];
      areas[sides[face]] += result.area[face];
      power += brightest[face] * result.area[face];
      area += result.area[face];
    }
    const most = (DARK * power) / area;
    return Array.from(sides, (side) => powers[side] <= most * areas[side]);
  }

  /** Whether the eye is in the box around the scene. */
  isInside() {
    return this.box.containsPoint(this.camera.position);
  }

  /** Three bytes a face, or three for each of its four corners. */
  colour(bytes) {
    const corners = bytes.length === 12 * this.result.size;
    for (let at = 0; at < this.faceOf.length; at += 1) {
      const [face, second] = [this.faceOf[at], this.secondOf[at]];
      for (let corner = 0; corner < 3; corner += 1) {
        const which = corner === 0 ? 0 : second + corner - 1;
        const from = corners ? 12 * face + 3 * which : 3 * face;
        for (let c = 0; c < 3; c += 1) this.bytes[9 * at + 3 * corner + c] = bytes[from + c];
      }
    }
    this.paint.needsUpdate = true;
    this.draw();
  }

  /** Shows or hides the edges of patches. */
  showGrid(shown) {
    // Of many patches it takes long to make, and few ask for it.
    if (shown && !this.hasGrid) {
      this.grid.geometry = this.outlines(0, this.result.size);
      this.hasGrid = true;
    }
    this.grid.visible = shown;
    this.draw();
  }

  /** Cuts away what lies beyond a plane across an axis (0, 1, 2); `part` of the way along it. `null`: nothing. */
  cut(axis, part, flipped) {
    const planes = [];
    if (axis !== null) {
      const [low, high] = [this.box.min, this.box.max].map((corner) => corner.getComponent(axis));
      const sign = flipped ? 1 : -1;
      this.section.normal.set(0, 0, 0).setComponent(axis, sign);
      this.section.constant = -sign * (low + part * (high - low));
      planes.push(this.section);
    }
    for (const material of this.materials) material.clippingPlanes = planes;
    this.gridMaterial.clippingPlanes = planes;
    this.draw();
  }

  /** Back to the view of radiosity.png. */
  home() {
    this.stand(this.result.facts.view);
  }

  /** Looks from a place: eye, look_at, up, fov and size. */
  stand(view) {
    const { eye, look_at, up } = view;
    this.stood = view;
    this.camera.up.fromArray(up);
    this.camera.position.fromArray(eye);
    this.controls.target.fromArray(look_at);
    if (this.isInside()) {
      // In a room the pointer turns the head: what is turned about is right in front of the eye.
      const way = this.controls.target.clone().sub(this.camera.position).setLength(1e-3 * this.size);
      this.controls.target.copy(this.camera.position).add(way);
    }
    this.controls.rotateSpeed = this.isInside() ? -0.4 : 1;
    this.controls.update();
    this.resize();
  }

  /** Goes a step across the direction of view and ahead, level as one walks. */
  walk(across, ahead) {
    const { camera, controls } = this;
    const up = camera.up.clone().normalize();
    const way = controls.target.clone().sub(camera.position);
    const level = way.addScaledVector(up, -way.dot(up)).normalize();
    const step = level.clone().multiplyScalar(ahead).addScaledVector(level.clone().cross(up), across).multiplyScalar(STEP * this.size);
    camera.position.add(step);
    controls.target.add(step);
    controls.update();
    this.draw();
  }

  /** Turns about the target by angles in radians, and comes nearer by a factor; in a room, turns the head and walks. */
  turn(across, upward, nearer = 1) {
    const { camera, controls } = this;
    if (controls.rotateSpeed < 0) {
      if (nearer !== 1) this.walk(0, nearer > 1 ? 1 : -1);
      else this.turnHead(across, -upward);
      return;
    }
    const offset = camera.position.clone().sub(controls.target).divideScalar(nearer);
    offset.applyAxisAngle(camera.up.clone().normalize(), across);
    const side = offset.clone().cross(camera.up).normalize();
    const tilted = offset.clone().applyAxisAngle(side, upward);
    if (tilted.clone().cross(camera.up).length() > 0.05 * tilted.length()) offset.copy(tilted);
    camera.position.copy(controls.target).add(offset);
    controls.update();
    this.draw();
  }

  /** Turns the view about the eye. */
  turnHead(across, upward) {
    const { camera, controls } = this;
    const way = controls.target.clone().sub(camera.position).applyAxisAngle(camera.up.clone().normalize(), across);
    const tilted = way.clone().applyAxisAngle(way.clone().cross(camera.up).normalize(), upward);
    if (tilted.clone().cross(camera.up).length() > 0.05 * tilted.length()) way.copy(tilted);
    controls.target.copy(camera.position).add(way);
    controls.update();
    this.draw();
  }

  /** Flies to where a face is seen from its front, and marks it. */
  flyTo(face) {
    this.select(face);
    const corners = [0, 1, 2, 3].map((which) => new Vector3(...this.result.corner(face, which)));
    const centre = corners.reduce((sum, corner) => sum.add(corner), new Vector3()).divideScalar(4);
    const normal = corners[1].clone().sub(corners[0]).cross(corners[2].clone().sub(corners[0])).normalize();
    const reach = Math.max(...corners.map((corner) => corner.distanceTo(centre)));
    // Not straight on, so that the neighbourhood is seen.
    const lean = this.camera.up.clone().multiplyScalar(0.35).addScaledVector(normal, 1).normalize();
    const eye = centre.clone().addScaledVector(lean, Math.max(0.5 * this.size, 6 * reach));
    this.fly(eye, centre);
  }

  fly(eye, target) {
    this.controls.rotateSpeed = 1;
    const still = window.matchMedia('(prefers-reduced-motion: reduce)').matches;
    const from = [this.camera.position.clone(), this.controls.target.clone()];
    const began = performance.now();
    const step = (now) => {
      const part = still ? 1 : Math.min((now - began) / (1000 * FLIGHT), 1);
      const eased = part * part * (3 - 2 * part);
      this.camera.position.lerpVectors(from[0], eye, eased);
      this.controls.target.lerpVectors(from[1], target, eased);
      this.controls.update();
      this.draw();
      if (part < 1) requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  /** Marks a face; `null` takes the mark away. */
  select(face) {
    this.mark.visible = face !== null;
    if (face !== null) {
      const count = this.result.isTriangle(face) ? 3 : 4;
      const corners = Array.from({ length: count }, (_, which) => [...this.result.corner(face, which)]).flat();
      this.mark.geometry.setAttribute('position', new BufferAttribute(new Float32Array(corners), 3));
      this.mark.geometry.computeBoundingSphere();
    }
    this.draw();
  }

  /** The face seen at a point of the page, or the cell of a sensor that is in front of it, or null. */
  faceAt(x, y) {
    const frame = this.canvas.getBoundingClientRect();
    const point = new Vector2(((x - frame.left) / frame.width) * 2 - 1, 1 - ((y - frame.top) / frame.height) * 2);
    const origin = this.camera.position;
    const way = new Vector3(point.x, point.y, 0.5).unproject(this.camera).sub(origin).normalize();
    const met = nearest(this.geometry.attributes.position.array, this.shownFaces(), origin, way, this.materials[0].clippingPlanes[0]);
    if (!this.sensors?.visible) return met.found;
    const sensor = nearest(this.sensors.geometry.attributes.position.array, this.sensorOf, origin, way, null, true);
    return sensor.best <= met.best ? sensor.found : met.found;
  }

  /** The faces of the triangles that are drawn. */
  shownFaces() {
    return this.isInside() ? this.faceOf : this.faceOf.subarray(0, this.litCount);
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    // A stage that is narrower than the picture shows all of its width.
    const { fov, size } = this.stood;
    const shown = Math.max(1, size[0] / size[1] / this.camera.aspect);
    this.camera.fov = (2 * Math.atan(shown * Math.tan((fov * Math.PI) / 360)) * 180) / Math.PI;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  /** Draws in the next frame. */
  draw() {
    if (this.due) return;
    this.due = true;
    requestAnimationFrame(() => {
      this.due = false;
      this.geometry.setDrawRange(0, 3 * this.shownFaces().length);
      this.renderer.render(this.scene, this.camera);
    });
  }
}

/** The corners of a face, each moved outwards by `overlap` along both of its edges. */
function grow(grown, corners, count, overlap) {
  grown.set(corners);
  for (let which = 0; which < count; which += 1) {
    for (const other of [(which + 1) % count, (which + count - 1) % count]) {
      const [x, y, z] = [0, 1, 2].map((axis) => corners[3 * which + axis] - corners[3 * other + axis]);
      const length = Math.sqrt(x * x + y * y + z * z) || 1;
      const part = Math.min(overlap / length, OVERLAP_OF_EDGE);
      grown[3 * which] += part * x;
      grown[3 * which + 1] += part * y;
      grown[3 * which + 2] += part * z;
    }
  }
}

/** The nearest front (or side, where both count) that a ray meets on the side of the section that is shown (Möller and Trumbore 1997). */
function nearest(places, faceOf, origin, way, section, bothSides = false) {
  let [best, found] = [Infinity, null];
  for (let triangle = 0; triangle < faceOf.length; triangle += 1) {
    const at = 9 * triangle;
    const [ax, ay, az] = [places[at], places[at + 1], places[at + 2]];
    const [ux, uy, uz] = [places[at + 3] - ax, places[at + 4] - ay, places[at + 5] - az];
    const [vx, vy, vz] = [places[at + 6] - ax, places[at + 7] - ay, places[at + 8] - az];
    const [px, py, pz] = [way.y * vz - way.z * vy, way.z * vx - way.x * vz, way.x * vy - way.y * vx];
    const facing = ux * px + uy * py + uz * pz;
    const sign = bothSides && facing < 0 ? -1 : 1;
    const det = sign * facing;
    if (det <= 0) continue; // seen from the back, or edge-on
    const [tx, ty, tz] = [sign * (origin.x - ax), sign * (origin.y - ay), sign * (origin.z - az)];
    const u = tx * px + ty * py + tz * pz;
    if (u < 0 || u > det) continue;
    const [qx, qy, qz] = [ty * uz - tz * uy, tz * ux - tx * uz, tx * uy - ty * ux];
    const v = way.x * qx + way.y * qy + way.z * qz;
    if (v < 0 || u + v > det) continue;
    const distance = (vx * qx + vy * qy + vz * qz) / det;
    if (distance <= 0 || distance >= best) continue;
    if (section && section.distanceToPoint(new Vector3().copy(origin).addScaledVector(way, distance)) < 0) continue;
    [best, found] = [distance, faceOf[triangle]];
  }
  return { best, found };
}
