// What is drawn: clouds, skeletons and matches in the axes of the target, drawn only when something
// changed.

import {
  AmbientLight, BufferAttribute, BufferGeometry, Color, ColorManagement, DirectionalLight, Group, InstancedMesh,
  LinearSRGBColorSpace, Matrix4, MeshLambertMaterial, PerspectiveCamera, Points, Quaternion, Scene as World,
  ShaderMaterial, SphereGeometry, Vector3, WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { LineMaterial } from 'three/addons/lines/LineMaterial.js';
import { LineSegments2 } from 'three/addons/lines/LineSegments2.js';
import { LineSegmentsGeometry } from 'three/addons/lines/LineSegmentsGeometry.js';
import { mix, viridis } from './colours.js';
import { decodeBytes, decodePoints, decodeValues } from './decode.js';

// Colours are given as they appear on the screen and pass through unchanged.
ColorManagement.enabled = false;

const VERTEX = `
attribute float residual;
attribute vec3 own;
uniform float size, residualScale;
uniform vec3 colour, ramp[9];
uniform int mode;
uniform vec2 haze;
varying vec3 shade;
varying float far;
void main() {
  vec4 place = modelViewMatrix * vec4(position, 1.0);
  gl_Position = projectionMatrix * place;
  gl_PointSize = size;
  float x = clamp(residual / residualScale, 0.0, 1.0) * 7.999;
  int i = int(x);
  shade = mode == 1 ? mix(ramp[i], ramp[i + 1], x - float(i)) : mode == 2 ? own : colour;
  far = clamp((-place.z - haze.x) / haze.y, 0.0, 1.0);
}`;

const FRAGMENT = `
uniform vec3 background;
varying vec3 shade;
varying float far;
void main() {
  vec2 d = gl_PointCoord - 0.5;
  float edge = dot(d, d);
  if (edge > 0.25) discard;
  gl_FragColor = vec4(mix(shade * (1.0 - 0.9 * edge), background, 0.62 * far), 1.0);
}`;

const matrixOf = (m) => new Matrix4().set(...m, 0, 0, 0, 1);

function quantile(values, q) {
  const sorted = Float32Array.from(values).sort();
  return sorted[Math.min(sorted.length - 1, Math.floor(q * sorted.length))] ?? 0;
}

// Towards the faces, edges and corners of a cube, and between them.
const DIRECTIONS = [];
for (let x = -2; x <= 2; x++) {
  for (let y = -2; y <= 2; y++) {
    for (let z = -2; z <= 2; z++) if (Math.max(Math.abs(x), Math.abs(y), Math.abs(z)) === 2) DIRECTIONS.push([x, y, z]);
  }
}

// Points farther out than this, in radii of nearly all of them, are strays.
const STRAY = 3;

/**
 * The points that a picture of a cloud must hold, and a ball around them: the outermost point in each direction, and at
 * most 3,000 spread over the list. A few strays do not make everything small: they are left out.
 */
function outline(position) {
  const step = 3 * Math.max(1, Math.floor(position.length / 9000));
  const points = [];
  for (let i = 0; i < position.length; i += step) points.push(new Vector3().fromArray(position, i));
  const middle = (axis) => {
    const values = points.map((p) => p[axis]);
    return (quantile(values, 0.02) + quantile(values, 0.98)) / 2;
  };
  const centre = new Vector3(middle('x'), middle('y'), middle('z'));
  const reach = STRAY * quantile(points.map((p) => p.distanceTo(centre)), 0.98);
  const near = points.filter((p) => p.distanceTo(centre) <= reach);
  for (const [x, y, z] of DIRECTIONS) {
    let [best, at] = [-Infinity, -1];
    for (let i = 0; i < position.length; i += 3) {
      const [a, b, c] = [position[i], position[i + 1], position[i + 2]];
      const along = x * a + y * b + z * c;
      if (along > best && Math.hypot(a - centre.x, b - centre.y, c - centre.z) <= reach) [best, at] = [along, i];
    }
    if (at >= 0) near.push(new Vector3().fromArray(position, at));
  }
  return { points: near, ball: { centre, radius: near.reduce((most, p) => Math.max(most, p.distanceTo(centre)), 0) } };
}

/** A ball that holds several balls. */
function around(balls) {
  const centre = new Vector3();
  for (const b of balls) centre.addScaledVector(b.centre, 1 / balls.length);
  return { centre, radius: Math.max(...balls.map((b) => b.centre.distanceTo(centre) + b.radius), 1e-9) };
}

export class Scene {
  /** Throws where there is no WebGL 2. */
  constructor(canvas, onFrame) {
    // Asked first, since three.js would complain on the console.
    if (!document.createElement('canvas').getContext('webgl2')) throw new Error('no WebGL 2');
    this.canvas = canvas;
    this.onFrame = onFrame;
    this.renderer = new WebGLRenderer({ canvas, antialias: true });
    this.renderer.outputColorSpace = LinearSRGBColorSpace;
    this.camera = new PerspectiveCamera(35, 1, 0.01, 100);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener('change', () => this.invalidate());
    this.world = new World();
    this.axes = new Group();
    const light = new DirectionalLight(0xffffff, 2.2);
    light.position.set(-0.4, 0.8, 1);
    this.camera.add(light);
    this.world.add(this.camera, this.axes, new AmbientLight(0xffffff, 1.4));
    this.haze = { value: [0, 1] };
    this.size = { value: 3 };
    this.residualScale = { value: 1 };
    this.background = { value: [1, 1, 1] };
    this.ramp = { value: [] };
  }

  cloudMaterial() {
    const { size, residualScale, haze, background, ramp } = this;
    const own = { colour: { value: [0, 0, 0] }, mode: { value: 0 } };
    return new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      uniforms: { size, residualScale, haze, background, ramp, ...own },
    });
  }

  cloud(position, values) {
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(position, 3));
    geometry.setAttribute('residual', new BufferAttribute(new Float32Array(position.length / 3), 1));
    geometry.setAttribute('own', new BufferAttribute(new Uint8Array(position.length), 3, true));
    const cloud = new Points(geometry, this.cloudMaterial());
    cloud.userData = values;
    cloud.matrixAutoUpdate = false;
    cloud.frustumCulled = false;
    return cloud;
  }

  /** Replaces what is shown. */
  load(pair) {
    for (const old of [...this.axes.children]) {
      this.axes.remove(old);
      old.geometry.dispose();
      old.material.dispose();
    }
    this.pair = pair;
    this.positions = { source: decodePoints(pair.source), target: decodePoints(pair.target) };
    const values = ({ colours, intensities }) => ({
      colours: colours && decodeBytes(colours),
      intensities: intensities && viridis(decodeBytes(intensities)),
    });
    this.target = this.cloud(this.positions.target, values(pair.target));
    this.source = this.cloud(this.positions.source, values(pair.source));
    this.ghost = this.cloud(this.positions.source, {});
    this.ghost.matrix = matrixOf(pair.before.matrix);
    const outlines = { source: outline(this.positions.source), target: outline(this.positions.target) };
    this.samples = { source: outlines.source.points, target: outlines.target.points };
    this.balls = { source: outlines.source.ball, target: outlines.target.ball };
    const found = matrixOf((pair.poses[0] ?? pair.before).matrix);
    this.radius = around([this.balls.target, this.moved(found)]).radius;
    this.skeletons = (pair.skeletons ?? []).map((skeleton) => this.skeleton(skeleton));
    this.matches = this.matchLines(pair.matches);
    this.axes.add(this.target, this.ghost, this.source, ...this.skeletons, this.matches);
    this.residuals = new Map();
  }

  moved(matrix) {
    const { centre, radius } = this.balls.source;
    return { centre: centre.clone().applyMatrix4(matrix), radius };
  }

  /** From the centre of the source before registration to that of the target. */
  distanceBefore() {
    return this.moved(this.ghost.matrix).centre.distanceTo(this.balls.target.centre);
  }

  skeleton({ points, radii }) {
    const material = new MeshLambertMaterial({ transparent: true, opacity: 0.55, depthWrite: false });
    const spheres = new InstancedMesh(new SphereGeometry(1, 24, 16), material, points.length);
    const one = new Matrix4();
    points.forEach((p, i) => {
      const r = radii[i] ?? 0.025 * this.radius;
      spheres.setMatrixAt(i, one.makeScale(r, r, r).setPosition(...p));
    });
    spheres.matrixAutoUpdate = false;
    spheres.frustumCulled = false;
    return spheres;
  }

  matchLines(matches) {
    const material = new LineMaterial({ vertexColors: true, linewidth: 1.6 });
    const lines = new LineSegments2(new LineSegmentsGeometry(), material);
    if (matches.length > 0) lines.geometry.setPositions(new Float32Array(6 * matches.length));
    lines.frustumCulled = false;
    return lines;
  }

  /** Puts the source at the share `t` of the way from the pose before to `pose`. */
  place(pose, t) {
    const parts = [this.pair.before, pose].map((p) => {
      const [at, turn] = [new Vector3(), new Quaternion()];
      matrixOf(p.matrix).decompose(at, turn, new Vector3());
      return { at, turn };
    });
    const turn = parts[0].turn.clone().slerp(parts[1].turn, t);
    const at = parts[0].at.clone().lerp(parts[1].at, t);
    this.source.matrix.compose(at, turn, new Vector3(1, 1, 1));
    if (this.skeletons.length > 0) this.skeletons[0].matrix.copy(this.source.matrix);
    if (this.pair.matches.length > 0) {
      const ends = this.pair.matches.flatMap((m) => [
        ...new Vector3(...m.source).applyMatrix4(this.source.matrix).toArray(),
        ...m.target,
      ]);
      this.matches.geometry.setPositions(new Float32Array(ends));
    }
    this.invalidate();
  }

  /** Takes the colours of the source from the distances of `pose`. */
  showResidual(pose) {
    if (!pose.residual) return;
    if (!this.residuals.has(pose)) this.residuals.set(pose, decodeValues(pose.residual));
    const attribute = this.source.geometry.attributes.residual;
    attribute.array.set(this.residuals.get(pose));
    attribute.needsUpdate = true;
  }

  /** By `colouring`: 'cloud' (one colour each), 'residual', 'colours' or 'intensities' (where a cloud has them). */
  paint(scheme, colouring, residualScale) {
    const byResidual = colouring === 'residual';
    this.background.value = scheme.background;
    this.ramp.value = scheme.ramp.flat();
    this.residualScale.value = Math.max(residualScale, Number.MIN_VALUE);
    this.renderer.setClearColor(new Color(...scheme.background));
    const set = (cloud, colour, residual) => {
      cloud.material.uniforms.colour.value = colour;
      const own = cloud.userData[colouring];
      if (own) {
        cloud.geometry.attributes.own.array.set(own);
        cloud.geometry.attributes.own.needsUpdate = true;
      }
      cloud.material.uniforms.mode.value = residual ? 1 : own ? 2 : 0;
    };
    set(this.target, byResidual ? scheme.neutral : scheme.target, false);
    set(this.source, scheme.source, byResidual);
    set(this.ghost, scheme.ghost, false);
    [scheme.source, scheme.target].forEach((colour, i) => this.skeletons[i]?.material.color.setRGB(...colour));
    const strongest = this.pair.matches[0]?.weight || 1;
    const colours = this.pair.matches.flatMap(({ weight }) => {
      const colour = mix(scheme.background, scheme.match, 0.3 + 0.7 * Math.max(0, weight / strongest));
      return [...colour, ...colour];
    });
    if (colours.length > 0) this.matches.geometry.setColors(new Float32Array(colours));
    this.invalidate();
  }

  show(layers) {
    this.ghost.visible = layers.ghost;
    this.source.visible = layers.source;
    this.target.visible = layers.target;
    for (const skeleton of this.skeletons) skeleton.visible = layers.skeletons && skeleton.count > 0;
    this.matches.visible = layers.matches && this.pair.matches.length > 0;
    this.invalidate();
  }

  /**
   * Points the camera at what is shown. At first, with `pose`: at the target and the source at that
   * pose, and at the source before if it is not so far away that the rest would be small.
   */
  fit(pose) {
    const placed = pose ? matrixOf(pose.matrix) : this.source.matrix;
    const balls = [this.balls.target, this.moved(placed), this.moved(this.ghost.matrix)];
    const before = pose ? around(balls).radius < 2 * this.radius : this.ghost.visible;
    this.axes.updateMatrixWorld();
    const shown = [...this.samples.target.map((p) => p.clone())];
    for (const matrix of before ? [placed, this.ghost.matrix] : [placed]) {
      shown.push(...this.samples.source.map((p) => p.clone().applyMatrix4(matrix)));
    }
    for (const p of shown) p.applyMatrix4(this.axes.matrixWorld);

    // In the camera's directions, so that the picture is filled whatever the shape.
    const back = this.camera.position.clone().sub(this.controls.target);
    if (!this.framed || back.lengthSq() === 0) back.set(0.55, 0.42, 1);
    this.framed = true;
    back.normalize();
    const right = new Vector3(0, 1, 0).cross(back).normalize();
    const up = back.clone().cross(right);
    const middle = (axis) => {
      const values = shown.map((p) => p.dot(axis));
      return axis.clone().multiplyScalar((quantile(values, 0) + quantile(values, 1)) / 2);
    };
    const centre = middle(right).add(middle(up)).add(middle(back));
    const slope = Math.tan((this.camera.fov / 2) * (Math.PI / 180));
    const away = shown.map((p) => {
      const d = p.sub(centre);
      return d.dot(back) + Math.max(Math.abs(d.dot(right)) / this.camera.aspect, Math.abs(d.dot(up))) / slope;
    });
    const distance = 1.12 * Math.max(quantile(away, 1), 1e-6 * this.radius);
    this.controls.target.copy(centre);
    this.camera.position.copy(centre).addScaledVector(back, distance);
    this.controls.update();
    this.invalidate();
  }

  /** Turns the axes so that `up` (such as 'z' or '-y') points up. */
  orient(up) {
    const turns = {
      x: [0, 0, 0.5], y: [0, 0, 0], z: [-0.5, 0, 0], '-x': [0, 0, -0.5], '-y': [1, 0, 0], '-z': [0.5, 0, 0],
    };
    this.axes.rotation.set(...turns[up].map((t) => t * Math.PI));
    this.invalidate();
  }

  turn(horizontally, vertically) {
    this.controls.rotateLeft(horizontally);
    this.controls.rotateUp(vertically);
    this.controls.update();
  }

  zoom(factor) {
    this.camera.position.sub(this.controls.target).multiplyScalar(factor).add(this.controls.target);
    this.controls.update();
    this.invalidate();
  }

  setPointSize(pixels) {
    this.pointSize = pixels;
    this.size.value = pixels * this.renderer.getPixelRatio();
    this.invalidate();
  }

  resize(width, height) {
    if (width < 1 || height < 1) return;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.setPointSize(this.pointSize ?? 3);
    this.draw(); // At once: a resized canvas is empty.
  }

  /** What is on the screen, as the address of a PNG. */
  snapshot() {
    this.draw(); // The canvas keeps nothing once it has been shown.
    return this.canvas.toDataURL('image/png');
  }

  invalidate() {
    this.pending ??= requestAnimationFrame(() => this.draw());
  }

  draw() {
    if (this.pending) cancelAnimationFrame(this.pending);
    this.pending = undefined;
    if (!this.pair) return;
    const distance = this.camera.position.distanceTo(this.controls.target);
    const placed = [this.source.matrix, this.ghost.matrix].map((m) => this.moved(m));
    const everything = 3 * around([this.balls.target, ...placed]).radius;
    this.camera.near = distance / 100;
    this.camera.far = distance + 2 * everything;
    this.camera.updateProjectionMatrix();
    this.haze.value = [distance - 0.9 * this.radius, 2.2 * this.radius];
    this.renderer.render(this.world, this.camera);
    this.onFrame();
  }
}
