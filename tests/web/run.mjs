// Runs the page's WebAssembly without a browser: steps every scene with the stroke of demo.h and prints the hash of its state.
//
//   node run.mjs sinew.wasm FRAMES
import { readFile } from "node:fs/promises";

const [path, frames] = process.argv.slice(2);
const { instance } = await WebAssembly.instantiate(await readFile(path), {});
const demo = instance.exports;

const text = (at) => {
  const bytes = new Uint8Array(demo.memory.buffer, at);
  return new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)));
};
const must = (status) => {
  if (status !== 0) throw new Error(`status ${status}: ${text(demo.demo_error())}`);
};

const AUTO = 3;
for (let scene = 0; scene < demo.demo_scene_count(); scene++) {
  must(demo.demo_start(scene, AUTO));
  const name = text(demo.demo_scene_name(scene));
  const start = performance.now();
  for (let frame = 0; frame < frames; frame++) {
    demo.demo_stroke(frame);
    must(demo.demo_step());
    console.log(name, frame, BigInt.asUintN(64, demo.demo_hash()).toString(16).padStart(16, "0"));
  }
  console.error(`${name}: ${((performance.now() - start) / frames).toFixed(2)} ms a frame`);
}
