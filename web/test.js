// ?test: drives the page by pointer events without waiting for a clock, and writes what happened into the document.

export function test(page) {
  try {
    document.body.dataset.test = JSON.stringify(drive(page));
  } catch (error) {
    document.body.dataset.test = JSON.stringify({ error: String(error) });
  }
}

function drive({ scene, canvas, step, draw, camera }) {
  const box = canvas.getBoundingClientRect();
  const send = (type, x, y) =>
    canvas.dispatchEvent(new PointerEvent(type, { clientX: box.left + box.width * x, clientY: box.top + box.height * y, button: 0, bubbles: true }));
  const choose = (value) => (document.querySelector(`input[name=mode][value="${value}"]`).checked = true);
  const stroke = (from, to, frames) => {
    send("pointerdown", ...from);
    for (let frame = 0; frame <= frames; frame++) {
      const part = frame / frames;
      send("pointermove", from[0] + part * (to[0] - from[0]), from[1] + part * (to[1] - from[1]));
      step();
    }
  };
  // How far off the pointer's ray what it holds is, beside how far the pointer moved it.
  choose(0);
  stroke([0.5, 0.5], [0.5, 0.5], 1);
  const start = scene.held();
  send("pointerup", 0.5, 0.5);
  step();
  stroke([0.5, 0.5], [0.58, 0.42], 20);
  const held = scene.held(), eye = camera().eye();
  const ray = camera().ray(2 * 0.58 - 1, 1 - 2 * 0.42, box.width / box.height);
  const away = held.map((value, axis) => value - eye[axis]);
  const along = away.reduce((sum, value, axis) => sum + value * ray[axis], 0);
  const off = Math.hypot(...away.map((value, axis) => value - along * ray[axis]));
  const moved = Math.hypot(...held.map((value, axis) => value - start[axis]));
  const tip = scene.body(0).positions;
  let nearest = Infinity; // the tissue's, to what the pointer holds
  for (let i = 0; i < tip.length; i += 3) {
    nearest = Math.min(nearest, Math.hypot(tip[i] - held[0], tip[i + 1] - held[1], tip[i + 2] - held[2]));
  }
  send("pointerup", 0.58, 0.42);
  const before = scene.body(0).triangles.length / 3;
  choose(2);
  stroke([0.38, 0.56], [0.62, 0.48], 20);
  send("pointerup", 0.62, 0.48);
  step();
  const after = scene.body(0).triangles.length / 3;
  draw();
  const gl = canvas.getContext("webgl2"), pixels = new Uint8Array(4 * canvas.width * canvas.height);
  gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  const colors = new Set(new Uint32Array(pixels.buffer)).size;
  return { moved, off, nearest, before, after, colors };
}
