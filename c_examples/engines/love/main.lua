-- The same block four times, softer to stiffer, falls on a ball: LuaJIT calls the library, LÖVE draws what it lends.
--
--   love c_examples/engines/love HEADER LIBRARY [PICTURE FRAMES]
--
-- The mouse leads the ball next to it. With PICTURE it runs so many frames by itself, leaves a picture and ends; what does not hold is an error.
local ffi = require "ffi"
local sinew, world, floor, blocks, ball_mesh
local picture, frames, frame = nil, nil, 0
local shader, time = nil, 0
local RADIUS, EDGE, CELLS, APART, DENSITY = 0.03, 0.01, {8, 6, 8}, 0.13, 1000 -- m, m, cells, m, kg/m^3
local YOUNG = {3e3, 6e3, 12e3, 30e3} -- Pa
local COLOURS = {{0.93, 0.38, 0.36}, {0.98, 0.74, 0.32}, {0.36, 0.72, 0.62}, {0.42, 0.55, 0.90}}

-- Vertices as the card reads them.
ffi.cdef "typedef struct { float place[3], normal[3]; } drawn_vertex;"
local FORMAT = {{"VertexPosition", "float", 3}, {"Normal", "float", 3}}

local SHADER = [[
  uniform mat4 camera;
  varying vec3 towards, place;
#ifdef VERTEX
  attribute vec3 Normal;
  vec4 position(mat4 _, vec4 vertex) {
    towards = Normal;
    place = vertex.xyz;
    return camera * vec4(vertex.xyz, 1.0);
  }
#endif
#ifdef PIXEL
  vec4 effect(vec4 colour, Image _, vec2 __, vec2 ___) {
    vec3 n = normalize(towards), sun = normalize(vec3(0.5, 0.9, 0.6));
    float lit = 0.38 + 0.62 * max(dot(n, sun), 0.0);
    float shine = pow(max(dot(n, normalize(sun + vec3(0.35, 0.35, 0.87))), 0.0), 40.0);
    float near = 0.75 + 0.25 * clamp(place.y / 0.05, 0.0, 1.0); // darker towards the floor
    return vec4(colour.rgb * lit * near + 0.25 * shine, 1.0);
  }
#endif
]]

local function sub(a, b) return {a[1] - b[1], a[2] - b[2], a[3] - b[3]} end
local function dot(a, b) return a[1] * b[1] + a[2] * b[2] + a[3] * b[3] end
local function cross(a, b) return {a[2] * b[3] - a[3] * b[2], a[3] * b[1] - a[1] * b[3], a[1] * b[2] - a[2] * b[1]} end
local function unit(a) local l = math.sqrt(dot(a, a)) return {a[1] / l, a[2] / l, a[3] / l} end

-- Rows of the matrix of a camera that looks from `eye` at `target`.
local function camera_from(eye, target, aspect)
  local back = unit(sub(eye, target))
  local right = unit(cross({0, 1, 0}, back))
  local up = cross(back, right)
  local f, near, far = 1 / math.tan(0.3), 0.05, 5
  local function row(axis, scale) return {scale * axis[1], scale * axis[2], scale * axis[3], -scale * dot(axis, eye)} end
  local depth = (far + near) / (far - near)
  local z = row(back, -depth)
  z[4] = z[4] - 2 * far * near / (far - near)
  -- LÖVE's canvases have y downwards.
  return {row(right, f / aspect), row(up, love.graphics.getCanvas() and -f or f), z, row(back, -1)}
end

local Drawn = {}
Drawn.__index = Drawn

-- A mesh on the card for `count` nodes and these triangles, 3 indices each, from 0.
function Drawn.new(count, triangles, triangle_count)
  local self = setmetatable({count = count, triangles = triangles, triangle_count = triangle_count}, Drawn)
  self.data = love.data.newByteData(count * ffi.sizeof "drawn_vertex")
  self.vertices = ffi.cast("drawn_vertex *", self.data:getFFIPointer())
  self.mesh = love.graphics.newMesh(FORMAT, count, "triangles", "stream")
  local map = {}
  for i = 0, 3 * triangle_count - 1 do map[i + 1] = triangles[i] + 1 end
  self.mesh:setVertexMap(map)
  return self
end

-- Places from the library's own memory, `stride` bytes from one to the next, and normals from what they are now.
function Drawn:update(places, stride)
  local v = self.vertices
  local base = ffi.cast("const char *", places)
  for i = 0, self.count - 1 do
    local from = ffi.cast("const float *", base + i * stride)
    for k = 0, 2 do v[i].place[k], v[i].normal[k] = from[k], 0 end
  end
  for t = 0, 3 * self.triangle_count - 1, 3 do
    local a, b, c = v[self.triangles[t]], v[self.triangles[t + 1]], v[self.triangles[t + 2]]
    for k = 0, 2 do
      local i, j = (k + 1) % 3, (k + 2) % 3
      local n = (b.place[i] - a.place[i]) * (c.place[j] - a.place[j]) - (b.place[j] - a.place[j]) * (c.place[i] - a.place[i])
      a.normal[k], b.normal[k], c.normal[k] = a.normal[k] + n, b.normal[k] + n, c.normal[k] + n
    end
  end
  self.mesh:setVertices(self.data)
end

local function create_ball_mesh()
  local rings, sides = 24, 48
  local places = ffi.new("float[?]", 3 * (rings + 1) * sides)
  local triangles = ffi.new("uint32_t[?]", 6 * rings * sides)
  for i = 0, rings do
    for j = 0, sides - 1 do
      local a, b, at = math.pi * i / rings, 2 * math.pi * j / sides, 3 * (i * sides + j)
      places[at], places[at + 1], places[at + 2] = math.sin(a) * math.sin(b), math.cos(a), math.sin(a) * math.cos(b)
    end
  end
  local at = 0
  for i = 0, rings - 1 do
    for j = 0, sides - 1 do
      local a, b = i * sides + j, i * sides + (j + 1) % sides
      for _, corner in ipairs {a, a + sides, b + sides, a, b + sides, b} do triangles[at], at = corner, at + 1 end
    end
  end
  local drawn = Drawn.new((rings + 1) * sides, triangles, 2 * rings * sides)
  drawn.unit, drawn.moved = places, ffi.new("float[?]", 3 * (rings + 1) * sides)
  return drawn
end

local function create_body(shape, at, young)
  local def = sinew.define "body"
  local places = ffi.new("float[?]", 3 * shape.node_count)
  for i = 0, 3 * tonumber(shape.node_count) - 1 do places[i] = shape.positions[i] + at[i % 3 + 1] end
  def.positions, def.node_count, def.cells, def.cell_count = places, shape.node_count, shape.cells, shape.cell_count
  def.material, def.young_modulus, def.density = sinew.constants.SINEW_MATERIAL_SPRINGS, young, DENSITY
  def.node_damping = 0.01 -- N s/m
  local id = ffi.new "sinew_body_id[1]"
  sinew.call("body_create", world, def, id)
  return ffi.new("sinew_body_id", id[0]) -- a copy: the array goes
end

local function create_tool(shape, radius, x, y)
  local def, id = sinew.define "tool", ffi.new "sinew_tool_id[1]"
  def.shape, def.radius, def.position[0], def.position[1], def.friction = shape, radius, x, y, 0.4
  sinew.call("tool_create", world, def, id)
  return ffi.new("sinew_tool_id", id[0])
end

function love.load(arguments)
  local header, library
  header, library, picture, frames = unpack(arguments)
  frames = tonumber(frames)
  sinew = require "sinew"(header, library)
  world = sinew.create("world_create", "world", sinew.define "world")
  floor = {id = create_tool(sinew.constants.SINEW_SHAPE_PLANE, 0, 0, 0)}

  local mesh = sinew.create("mesh_create_lattice", "mesh", EDGE, ffi.new("uint32_t[3]", CELLS))
  local shape = ffi.new "sinew_mesh_view"
  shape.struct_size = ffi.sizeof(shape)
  sinew.call("mesh_get_view", mesh, shape)
  blocks = {}
  for i, young in ipairs(YOUNG) do
    local x = (i - 2.5) * APART
    blocks[i] = {
      home = x, ball = ffi.new("float[3]", x, RADIUS, 0), force = 0,
      id = create_body(shape, {x, 2 * RADIUS + 0.04, 0}, young),
      ball_id = create_tool(sinew.constants.SINEW_SHAPE_SPHERE, RADIUS, x, RADIUS),
      drawn = Drawn.new(tonumber(shape.node_count), shape.surface, tonumber(shape.surface_triangle_count)),
      mesh = mesh, -- which lends the triangles
    }
  end
  ball_mesh = create_ball_mesh()
  shader = love.graphics.newShader(SHADER)
end

-- The balls on their way: home, or where the mouse leads the one next to it.
local function lead()
  local w, h = love.graphics.getDimensions()
  local mx, my = love.mouse.getPosition()
  local x, y = (mx / w - 0.5) * 0.62, math.max(RADIUS, (0.8 - my / h) * 0.4)
  local most = 0.004 -- m a frame
  for _, block in ipairs(blocks) do
    local to_x, to_y = block.home, RADIUS
    if not picture and love.mouse.isDown(1) and math.abs(x - block.home) < APART / 2 then to_x, to_y = x, y end
    local p = block.ball
    p[0] = p[0] + math.max(-most, math.min(most, to_x - p[0]))
    p[1] = p[1] + math.max(-most, math.min(most, to_y - p[1]))
    sinew.call("tool_set_pose", world, block.ball_id, p, nil)
  end
end

local function upward_force(tool)
  local f, torque = ffi.new "float[3]", ffi.new "float[3]"
  sinew.call("tool_get_wrench", world, tool, f, torque)
  return f[1]
end

function love.update()
  lead()
  local began = love.timer.getTime()
  sinew.call("world_step", world, 1 / 60, nil)
  time = 0.95 * time + 0.05 * 1000 * (love.timer.getTime() - began)
  for _, block in ipairs(blocks) do block.force = 0.9 * block.force + 0.1 * upward_force(block.ball_id) end
  frame = frame + 1
end

local function draw_scene()
  local w, h = love.graphics.getDimensions()
  love.graphics.clear(0.13, 0.14, 0.18, 1, true, 1)
  shader:send("camera", camera_from({0, 0.19, 0.54}, {0, 0.035, 0}, w / h))
  love.graphics.setShader(shader)
  love.graphics.setDepthMode("lequal", true)
  love.graphics.setColor(0.42, 0.44, 0.5)
  love.graphics.draw(floor.mesh)
  for i, block in ipairs(blocks) do
    for k = 0, 3 * ball_mesh.count - 1 do ball_mesh.moved[k] = block.ball[k % 3] + RADIUS * ball_mesh.unit[k] end
    ball_mesh:update(ball_mesh.moved, 12)
    love.graphics.setColor(0.85, 0.86, 0.9)
    love.graphics.draw(ball_mesh.mesh)
    love.graphics.flushBatch()
    local view = ffi.new "sinew_vec3_view"
    sinew.call("body_get_positions", world, block.id, view)
    block.drawn:update(view.data, tonumber(view.stride))
    love.graphics.setColor(COLOURS[i])
    love.graphics.draw(block.drawn.mesh)
  end
  love.graphics.setDepthMode()
  love.graphics.setShader()
  love.graphics.setColor(1, 1, 1)
  love.graphics.print(("LÖVE %d.%d, LuaJIT, %d nodes: %.1f ms a frame"):format(
    love._version_major, love._version_minor, #blocks * blocks[1].drawn.count, time), 20, 16, 0, 1.4)
  for i, block in ipairs(blocks) do
    love.graphics.setColor(COLOURS[i])
    love.graphics.printf(("%g kPa\n%.2f N on the ball"):format(YOUNG[i] / 1e3, -block.force),
      (0.5 + (i - 2.5) * 0.224) * w - 90, h - 70, 120, "center", 0, 1.5)
  end
end

-- What must hold when it is over: nothing is under the floor or within a ball, and these carry what the blocks weigh.
local function judge()
  local carried, weight = -upward_force(floor.id), 0
  for _, block in ipairs(blocks) do
    local view = ffi.new "sinew_vec3_view"
    sinew.call("body_get_positions", world, block.id, view)
    for i = 0, tonumber(view.count) - 1 do
      local p = ffi.cast("const float *", ffi.cast("const char *", view.data) + i * view.stride)
      local d = math.sqrt((p[0] - block.ball[0]) ^ 2 + (p[1] - block.ball[1]) ^ 2 + (p[2] - block.ball[2]) ^ 2)
      assert(p[1] > -1e-4, "a node is below the floor")
      assert(d > RADIUS - 1e-4, "a node is within the ball")
    end
    carried = carried - upward_force(block.ball_id)
    weight = weight + DENSITY * CELLS[1] * CELLS[2] * CELLS[3] * EDGE ^ 3 * 9.81
  end
  assert(math.abs(carried / weight - 1) < 0.05, ("%g N are carried of %g N"):format(carried, weight))
  print(("%d frames: %.1f ms each; %.2f N of weight, %.2f N carried"):format(frame, time, weight, carried))
end

function love.draw()
  if not floor.mesh then
    local corners = {}
    for i, corner in ipairs {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}} do corners[i] = {corner[1], 0, corner[2], 0, 1, 0} end
    floor.mesh = love.graphics.newMesh(FORMAT, corners, "fan", "static")
  end
  if picture and frame ~= frames then return end -- nobody looks
  draw_scene()
  if picture then
    judge()
    frames = nil
    love.graphics.captureScreenshot(function(image)
      local file = assert(io.open(picture, "wb"))
      file:write(image:encode "png":getString())
      file:close()
      love.event.quit()
    end)
  end
end

-- By itself, what is wrong ends the program and is told where it is read.
function love.errorhandler(message)
  io.stderr:write(tostring(message), "\n", debug.traceback(), "\n")
  return function() return 1 end
end
