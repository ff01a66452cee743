// The scenes in WebAssembly: what demo.h exports, as JavaScript values. Arrays are views of its memory, not copies.

export async function load(url) {
  const response = await fetch(url);
  const { instance } = await WebAssembly.instantiate(await response.arrayBuffer(), {});
  const demo = instance.exports;
  const memory = () => demo.memory.buffer; // another object after the memory has grown
  const text = (at) => {
    const bytes = new Uint8Array(memory(), at);
    return new TextDecoder().decode(bytes.slice(0, bytes.indexOf(0)));
  };
  const floats = (at, count) => new Float32Array(memory(), at, count);
  const words = (at, count) => new Uint32Array(memory(), at, count);
  const must = (status) => {
    if (status !== 0) throw new Error(text(demo.demo_error()));
  };
  const each = (get, read) => {
    const list = [];
    for (let at; (at = get(list.length)) !== 0; ) list.push(read(at));
    return list;
  };

  const scenes = [];
  for (let scene = 0; scene < demo.demo_scene_count(); scene++) {
    scenes.push({ name: text(demo.demo_scene_name(scene)), hint: text(demo.demo_scene_hint(scene)) });
  }
  return {
    scenes,
    start: (scene, solver) => must(demo.demo_start(scene, solver)),
    step: () => must(demo.demo_step()),
    // A refused touch, such as of a pinned node, is no error of the page.
    point: (mode, origin, direction, down) => demo.demo_pointer(mode, ...origin, ...direction, down ? 1 : 0) === 0,
    hash: () => BigInt.asUintN(64, demo.demo_hash()).toString(16).padStart(16, "0"),
    text: () => text(demo.demo_text()),
    camera: () => {
      const places = floats(demo.demo_camera(), 6);
      return { eye: [...places.subarray(0, 3)], target: [...places.subarray(3)] };
    },
    held: () => {
      const at = demo.demo_held();
      return at === 0 ? null : [...floats(at, 3)];
    },
    // The normals of all bodies share their memory: use a body before asking for the next.
    body: (index) => {
      const at = demo.demo_get_body(index);
      if (at === 0) return null;
      const [positions, normals, nodes, triangles, count, version] = words(at, 6);
      return {
        positions: floats(positions, 3 * nodes),
        normals: floats(normals, 3 * nodes),
        triangles: words(triangles, 3 * count),
        version,
        color: [...floats(at + 24, 3)],
      };
    },
    tools: () =>
      each(demo.demo_get_tool, (at) => ({
        shape: words(at, 1)[0],
        size: [...floats(at + 4, 3)],
        color: [...floats(at + 16, 3)],
        position: [...floats(at + 28, 3)],
        orientation: [...floats(at + 40, 4)],
      })),
  };
}
