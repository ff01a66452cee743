// Draws bodies and tools with WebGL 2: one program, a key light with a highlight, light from the sky, a rim.

const VERTEX = `#version 300 es
layout(location = 0) in vec3 place;
layout(location = 1) in vec3 normal;
uniform mat4 view, model;
out vec3 at, turned;
void main() {
  vec4 world = model * vec4(place, 1.0);
  at = world.xyz;
  turned = mat3(model) * normal;
  gl_Position = view * world;
}`;

const FRAGMENT = `#version 300 es
precision highp float;
in vec3 at, turned;
uniform vec3 color, eye, target;
uniform float gloss, fade;
out vec4 pixel;
void main() {
  vec3 to_eye = normalize(eye - at);
  vec3 n = dot(turned, turned) > 0.0 ? normalize(turned) : normalize(cross(dFdx(at), dFdy(at)));
  if (dot(n, to_eye) < 0.0) n = -n;
  vec3 light = normalize(vec3(0.45, 0.8, 0.4));
  float around = dot(n, light);
  float lit = smoothstep(-0.35, 1.0, around); // light goes some way round in tissue
  float shine = pow(max(dot(n, normalize(light + to_eye)), 0.0), 60.0) * gloss;
  float rim = pow(1.0 - max(dot(n, to_eye), 0.0), 3.0);
  vec3 base = pow(color, vec3(2.2));
  vec3 sky = mix(vec3(0.10, 0.09, 0.11), vec3(0.36, 0.40, 0.46), 0.5 + 0.5 * n.y);
  vec3 sum = base * (sky + 1.15 * lit * vec3(1.0, 0.95, 0.88)) + shine + rim * gloss * 0.25 * base;
  float alpha = 1.0;
  if (fade > 0.0) { // the floor: a grid that ends in the background
    vec2 cell = abs(fract(at.xz / 0.05) - 0.5) / fwidth(at.xz / 0.05);
    sum *= mix(1.0, 0.85, clamp(min(cell.x, cell.y), 0.0, 1.0));
    alpha = smoothstep(fade, 0.2 * fade, distance(at, target));
  }
  pixel = vec4(pow(sum / (1.0 + 0.25 * sum), vec3(1.0 / 2.2)), 1.0) * alpha;
}`;

const [SPHERE, CAPSULE, PLANE, BOX] = [0, 1, 2, 4];
const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

// A sphere of a radius whose halves are apart: a capsule along y.
function round(radius, half) {
  const positions = [], normals = [], triangles = [], [rows, columns] = [24, 32];
  for (let row = 0; row <= rows; row++) {
    for (let column = 0; column <= columns; column++) {
      const [down, about] = [(Math.PI * row) / rows, (2 * Math.PI * column) / columns];
      const n = [Math.sin(down) * Math.cos(about), Math.cos(down), Math.sin(down) * Math.sin(about)];
      normals.push(...n);
      positions.push(radius * n[0], radius * n[1] + (row <= rows / 2 ? half : -half), radius * n[2]);
      const corner = row * (columns + 1) + column;
      if (row < rows && column < columns) {
        triangles.push(corner, corner + 1, corner + columns + 1, corner + 1, corner + columns + 2, corner + columns + 1);
      }
    }
  }
  return { positions, normals, triangles };
}

function box([x, y, z]) {
  const positions = [], normals = [], triangles = [], size = [x, y, z];
  for (let axis = 0; axis < 3; axis++) {
    for (const side of [-1, 1]) {
      const first = positions.length / 3;
      for (const [u, v] of [[-1, -1], [1, -1], [1, 1], [-1, 1]]) {
        const corner = [];
        corner[axis] = side * size[axis];
        corner[(axis + 1) % 3] = u * size[(axis + 1) % 3];
        corner[(axis + 2) % 3] = v * size[(axis + 2) % 3];
        positions.push(...corner);
        normals.push(...[0, 1, 2].map((other) => (other === axis ? side : 0)));
      }
      triangles.push(first, first + 1, first + 2, first, first + 2, first + 3);
    }
  }
  return { positions, normals, triangles };
}

function solid({ shape, size }) {
  if (shape === SPHERE) return round(size[0], 0);
  if (shape === CAPSULE) return round(size[0], size[1]);
  return shape === BOX ? box(size) : box([1, 0, 1]);
}

function pose([x, y, z, w], [px, py, pz]) {
  return [
    1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w), 0,
    2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w), 0,
    2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y), 0,
    px, py, pz, 1,
  ];
}

export class Drawing {
  constructor(canvas) {
    this.gl = canvas.getContext("webgl2", { antialias: true, alpha: true, premultipliedAlpha: true, preserveDrawingBuffer: true });
    if (!this.gl) throw new Error("this browser has no WebGL 2");
    const gl = this.gl;
    this.program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(this.program, shader);
    }
    gl.linkProgram(this.program);
    gl.useProgram(this.program);
    this.places = {};
    for (const name of ["view", "model", "color", "eye", "target", "gloss", "fade"]) {
      this.places[name] = gl.getUniformLocation(this.program, name);
    }
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.enable(gl.BLEND);
    this.bodies = [];
    this.solids = new Map();
  }

  // Forgets the meshes of the last scene.
  clear() {
    for (const mesh of [...this.bodies, ...this.solids.values()]) {
      this.gl.deleteVertexArray(mesh.array);
      mesh.buffers.forEach((buffer) => this.gl.deleteBuffer(buffer));
    }
    this.bodies = [];
    this.solids = new Map();
  }

  mesh() {
    const gl = this.gl;
    const mesh = { array: gl.createVertexArray(), buffers: [0, 1, 2].map(() => gl.createBuffer()), count: 0, version: -1 };
    gl.bindVertexArray(mesh.array);
    for (const attribute of [0, 1]) {
      gl.bindBuffer(gl.ARRAY_BUFFER, mesh.buffers[attribute]);
      gl.enableVertexAttribArray(attribute);
      gl.vertexAttribPointer(attribute, 3, gl.FLOAT, false, 0, 0);
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.buffers[2]);
    return mesh;
  }

  // Uploads a mesh; its triangles only when their version is another.
  upload(mesh, { positions, normals, triangles, version }) {
    const gl = this.gl;
    gl.bindVertexArray(mesh.array);
    [positions, normals].forEach((values, attribute) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, mesh.buffers[attribute]);
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.STREAM_DRAW);
    });
    if (mesh.version === version) return;
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, triangles, gl.DYNAMIC_DRAW);
    mesh.version = version;
    mesh.count = triangles.length;
  }

  draw(mesh, model, color, gloss, fade) {
    const gl = this.gl;
    gl.bindVertexArray(mesh.array);
    gl.uniformMatrix4fv(this.places.model, false, model);
    gl.uniform3fv(this.places.color, color);
    gl.uniform1f(this.places.gloss, gloss);
    gl.uniform1f(this.places.fade, fade);
    gl.drawElements(gl.TRIANGLES, mesh.count, gl.UNSIGNED_INT, 0);
  }

  frame(scene, camera) {
    const gl = this.gl, canvas = gl.canvas;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.uniformMatrix4fv(this.places.view, false, camera.matrix(canvas.width / canvas.height));
    gl.uniform3fv(this.places.eye, camera.eye());
    gl.uniform3fv(this.places.target, camera.target);
    const tools = scene.tools().sort((a, b) => (b.shape === PLANE) - (a.shape === PLANE));
    for (const tool of tools) {
      const key = `${tool.shape} ${tool.size}`;
      if (!this.solids.has(key)) {
        const made = solid(tool), mesh = this.mesh();
        this.upload(mesh, {
          positions: new Float32Array(made.positions),
          normals: new Float32Array(made.normals),
          triangles: new Uint32Array(made.triangles),
          version: 0,
        });
        this.solids.set(key, mesh);
      }
      const plane = tool.shape === PLANE;
      this.draw(this.solids.get(key), pose(tool.orientation, tool.position), tool.color, plane ? 0 : 0.5, plane ? 2.2 * camera.distance : 0);
    }
    for (let index = 0, body; (body = scene.body(index)); index++) {
      this.bodies[index] ??= this.mesh();
      this.upload(this.bodies[index], body);
      this.draw(this.bodies[index], IDENTITY, body.color, 0.35, 0);
    }
  }
}
