// The page: a list of scenes, a camera that orbits, a pointer that pulls, presses and cuts, and the loop.

import { Drawing } from "./draw.js";
import { load } from "./sinew.js";

const find = (name) => document.getElementById(name);
const add = (a, b, times = 1) => a.map((value, axis) => value + times * b[axis]);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const unit = (a) => a.map((value) => value / Math.hypot(...a));

const SLOPE = Math.tan(Math.PI / 8); // of half the angle of view
const FRAME = 1000 / 60; // ms

// Looks at a target from a distance, by two angles.
class Camera {
  constructor({ eye, target }) {
    const from = add(eye, target, -1);
    this.target = target;
    this.distance = Math.hypot(...from);
    this.turn = Math.atan2(from[0], from[2]);
    this.height = Math.asin(from[1] / this.distance);
  }
  eye() {
    const across = Math.cos(this.height);
    return add(this.target, [across * Math.sin(this.turn), Math.sin(this.height), across * Math.cos(this.turn)], this.distance);
  }
  axes() {
    const back = unit(add(this.eye(), this.target, -1)), right = unit(cross([0, 1, 0], back));
    return [right, cross(back, right), back];
  }
  orbit(x, y) {
    this.turn -= x;
    this.height = Math.min(1.5, Math.max(-0.2, this.height + y));
  }
  // World to clip space, column by column.
  matrix(aspect) {
    const eye = this.eye(), [r, u, b] = this.axes(), near = 0.05 * this.distance, far = 20 * this.distance;
    const x = 1 / (SLOPE * aspect), y = 1 / SLOPE, z = -(far + near) / (far - near), w = (-2 * far * near) / (far - near);
    return [
      x * r[0], y * u[0], z * b[0], -b[0],
      x * r[1], y * u[1], z * b[1], -b[1],
      x * r[2], y * u[2], z * b[2], -b[2],
      -x * dot(r, eye), -y * dot(u, eye), -z * dot(b, eye) + w, dot(b, eye),
    ];
  }
  // The direction of what is seen at a point of the canvas, -1 to 1 each.
  ray(x, y, aspect) {
    const [right, up, back] = this.axes();
    return unit(add(add(back.map((value) => -value), right, x * SLOPE * aspect), up, y * SLOPE));
  }
}

const canvas = find("canvas");
const scene = await load("sinew.wasm");
const drawing = new Drawing(canvas);
let camera, pointer = { x: 0, y: 0, down: false, orbits: false };
let paused = false, owed = 0, last = performance.now(), took = 0;

const mode = () => Number(document.querySelector("input[name=mode]:checked").value);
const say = (message) => (find("message").textContent = message);

function start() {
  const index = Number(find("scene").value);
  scene.start(index, Number(find("solver").value));
  drawing.clear();
  camera = new Camera(scene.camera());
  find("hint").textContent = scene.scenes[index].hint;
  [pointer.down, owed] = [false, 0];
  say("");
}

function step() {
  const ray = camera.ray(pointer.x, pointer.y, canvas.width / canvas.height);
  const begun = performance.now();
  scene.point(mode(), camera.eye(), ray, pointer.down);
  scene.step();
  took += 0.1 * (performance.now() - begun - took);
}

function draw() {
  const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((size) => Math.round(size * devicePixelRatio));
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  drawing.frame(scene, camera);
  find("text").textContent = scene.text();
  find("time").textContent = `${took.toFixed(1)} ms a step`;
}

// Fixed steps; time that the computer cannot keep up with is dropped.
function loop(now) {
  owed = paused ? 0 : Math.min(owed + now - last, 2 * FRAME);
  last = now;
  try {
    for (; owed >= FRAME; owed -= FRAME) step();
    draw();
  } catch (error) {
    say(`${error.message}. Press Restart.`);
    paused = true;
  }
  requestAnimationFrame(loop);
}

function move(event) {
  const box = canvas.getBoundingClientRect();
  const x = (2 * (event.clientX - box.left)) / box.width - 1, y = 1 - (2 * (event.clientY - box.top)) / box.height;
  if (pointer.orbits) camera.orbit(2 * (x - pointer.x), -1.5 * (y - pointer.y));
  [pointer.x, pointer.y] = [x, y];
}

canvas.addEventListener("pointerdown", (event) => {
  move(event);
  pointer.orbits = event.button === 2 || event.shiftKey || mode() === 3;
  pointer.down = !pointer.orbits;
  if (event.isTrusted) canvas.setPointerCapture(event.pointerId);
});
canvas.addEventListener("pointermove", move);
for (const name of ["pointerup", "pointercancel"]) {
  canvas.addEventListener(name, () => (pointer.down = pointer.orbits = false));
}
canvas.addEventListener("contextmenu", (event) => event.preventDefault());
canvas.addEventListener("wheel", (event) => {
  event.preventDefault();
  camera.distance *= Math.exp(0.001 * event.deltaY);
}, { passive: false });

scene.scenes.forEach(({ name }, index) => find("scene").add(new Option(name, index)));
find("scene").onchange = find("solver").onchange = find("restart").onclick = () => {
  paused = false;
  start();
};
find("pause").onclick = () => (paused = !paused);
find("step").onclick = () => {
  paused = true;
  step();
};
find("scene").value = new URLSearchParams(location.search).get("scene") ?? 0;
start();
if (new URLSearchParams(location.search).has("test")) {
  const { test } = await import("./test.js");
  draw();
  test({ scene, canvas, step, draw, camera: () => camera });
} else {
  requestAnimationFrame(loop);
}
