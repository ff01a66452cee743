/* Draws a sample with OpenGL 3.3 core.
 *
 * Node positions go from the library's view to the GPU without a copy between, and the library writes vertex normals
 * into the mapped buffer. Triangles are uploaded again only after a cut. */
#define GL_GLEXT_PROTOTYPES
#include "draw.h"
#include <SDL.h>
#include <SDL_opengl.h>
#include <math.h>
#include <string.h>

#define RINGS 24
#define SIDES 32
#define THREAD 0x282C5AFFu /* color of sutures where nothing else is drawn as lines */
#define LINE_ROOM 200000 /* corners of lines and points */

/* Buffers of a body, or of the shape of a tool. */
typedef struct shape {
  GLuint array, positions, normals, indices;
  GLsizei index_count;
  uint64_t version; /* of the body's topology */
  int is_filled;
} shape;

typedef struct corner {
  float position[3];
  uint8_t color[4];
} corner;

static struct {
  GLuint lit, plain;
  GLint lit_view, lit_model, lit_scale, lit_stretch, lit_color, lit_eye, lit_flat, plain_view;
  shape bodies[SAMPLE_BODIES], ball, box, plane;
  GLuint line_array, line_buffer;
} gl;

static struct {
  corner lines[LINE_ROOM], points[LINE_ROOM];
  GLsizei line_count, point_count;
} debug;

static const char LIT_VERTEX[] =
  "#version 330 core\n"
  "layout(location = 0) in vec3 position; layout(location = 1) in vec3 normal;\n"
  "uniform mat4 view, model; uniform vec3 scale; uniform float stretch;\n"
  "out vec3 world, away;\n"
  "void main() {\n"
  "  vec3 local = position * scale + vec3(0, stretch * sign(position.y), 0);\n" /* a stretched ball is a capsule */
  "  vec4 placed = model * vec4(local, 1);\n"
  "  world = placed.xyz; away = mat3(model) * normal; gl_Position = view * placed;\n"
  "}\n";

static const char LIT_FRAGMENT[] =
  "#version 330 core\n"
  "in vec3 world, away; out vec4 result;\n"
  "uniform vec3 color, eye; uniform float flatness;\n"
  "const vec3 sun = normalize(vec3(0.45, 1.0, 0.55)), fill = normalize(vec3(-0.8, 0.25, 0.5));\n"
  "void main() {\n"
  "  vec3 to_eye = normalize(eye - world), n = normalize(away + vec3(0, 1e-6, 0));\n"
  "  if (!gl_FrontFacing) n = -n;\n" /* both sides of a sheet */
  "  float key = max(0.0, 0.85 * dot(n, sun) + 0.15), soft = max(0.0, dot(n, fill));\n"
  "  vec3 sky = mix(vec3(0.30, 0.27, 0.26), vec3(0.52, 0.55, 0.60), 0.5 + 0.5 * n.y);\n"
  "  float shine = pow(max(0.0, dot(n, normalize(sun + to_eye))), 48.0);\n"
  "  float rim = pow(1.0 - max(0.0, dot(n, to_eye)), 4.0);\n"
  "  vec3 lit = color * (sky + 0.62 * key * vec3(1.0, 0.97, 0.92) + 0.16 * soft) + 0.20 * shine + 0.10 * rim;\n"
  "  lit = mix(lit, color, flatness);\n"
  "  float fade = flatness * smoothstep(0.25, 0.9, length(world.xz));\n" /* the floor ends in the background */
  "  result = vec4(mix(lit, vec3(0.90, 0.92, 0.94), fade), 1);\n"
  "}\n";

static const char PLAIN_VERTEX[] =
  "#version 330 core\n"
  "layout(location = 0) in vec3 position; layout(location = 1) in vec4 color;\n"
  "uniform mat4 view; out vec4 shade;\n"
  "void main() { shade = color; gl_Position = view * vec4(position, 1); gl_PointSize = 6.0; }\n";

static const char PLAIN_FRAGMENT[] =
  "#version 330 core\n"
  "in vec4 shade; out vec4 result;\n"
  "void main() { result = shade; }\n";

static const char *add_shader(GLuint program, GLenum kind, const char *source) {
  static char log[512];
  const GLuint shader = glCreateShader(kind);
  GLint worked;
  glShaderSource(shader, 1, &source, NULL);
  glCompileShader(shader);
  glGetShaderiv(shader, GL_COMPILE_STATUS, &worked);
  if (!worked) glGetShaderInfoLog(shader, sizeof log, NULL, log);
  glAttachShader(program, shader);
  glDeleteShader(shader);
  return worked ? NULL : log;
}

static const char *create_program(GLuint *program, const char *vertex, const char *fragment) {
  const char *why;
  GLint worked;
  *program = glCreateProgram();
  if ((why = add_shader(*program, GL_VERTEX_SHADER, vertex)) != NULL) return why;
  if ((why = add_shader(*program, GL_FRAGMENT_SHADER, fragment)) != NULL) return why;
  glLinkProgram(*program);
  glGetProgramiv(*program, GL_LINK_STATUS, &worked);
  return worked ? NULL : "the shaders do not link";
}

static void create_shape(shape *s) {
  glGenVertexArrays(1, &s->array);
  glGenBuffers(1, &s->positions);
  glGenBuffers(1, &s->normals);
  glGenBuffers(1, &s->indices);
}

static void attribute(GLuint index, GLuint buffer, const void *data, size_t size, size_t stride) {
  glBindBuffer(GL_ARRAY_BUFFER, buffer);
  glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)size, data, GL_STREAM_DRAW);
  glVertexAttribPointer(index, 3, GL_FLOAT, GL_FALSE, (GLsizei)stride, NULL);
  glEnableVertexAttribArray(index);
}

static void fill_indices(shape *s, const uint32_t *indices, size_t count) {
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, s->indices);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, (GLsizeiptr)(count * sizeof *indices), indices, GL_STATIC_DRAW);
  s->index_count = (GLsizei)count;
}

static void fill_shape(shape *s, const float *positions, const float *normals, size_t node_count,
                       const uint32_t *indices, size_t index_count) {
  create_shape(s);
  glBindVertexArray(s->array);
  attribute(0, s->positions, positions, 12 * node_count, 12);
  attribute(1, s->normals, normals, 12 * node_count, 12);
  fill_indices(s, indices, index_count);
}

/* A ball of radius 1. Its equator is there twice, so that a capsule can part it. */
static void create_ball(void) {
  static float nodes[(RINGS + 2) * (SIDES + 1)][3];
  static uint32_t indices[6 * (RINGS + 1) * SIDES];
  size_t node = 0, count = 0;
  for (int ring = 0; ring < RINGS + 2; ring++) {
    const int step = ring <= RINGS / 2 ? ring : ring - 1;
    const float tilt = 3.14159265f * (float)step / RINGS, nudge = ring <= RINGS / 2 ? 1e-6f : -1e-6f;
    for (int side = 0; side <= SIDES; side++, node++) {
      const float turn = 6.2831853f * (float)side / SIDES;
      nodes[node][0] = sinf(tilt) * sinf(turn);
      nodes[node][1] = cosf(tilt) + (step == RINGS / 2 ? nudge : 0);
      nodes[node][2] = sinf(tilt) * cosf(turn);
      if (ring == RINGS + 1 || side == SIDES) continue;
      const uint32_t a = (uint32_t)node, b = a + SIDES + 1, quad[6] = {a, b, a + 1, a + 1, b, b + 1};
      memcpy(indices + count, quad, sizeof quad);
      count += 6;
    }
  }
  fill_shape(&gl.ball, nodes[0], nodes[0], node, indices, count);
}

/* A box from -1 to 1 with four nodes to each side. */
static void create_box(void) {
  float nodes[24][3], normals[24][3];
  uint32_t indices[36];
  memset(normals, 0, sizeof normals);
  for (uint32_t k = 0; k < 24; k++) {
    const uint32_t axis = k / 8, corner_bits = k % 4;
    const float side = k / 4 % 2 ? 1.0f : -1.0f;
    nodes[k][axis] = normals[k][axis] = side;
    nodes[k][(axis + 1) % 3] = corner_bits % 2 ? 1.0f : -1.0f;
    nodes[k][(axis + 2) % 3] = corner_bits / 2 ? 1.0f : -1.0f;
  }
  for (uint32_t k = 0; k < 36; k++) {
    static const uint32_t quad[6] = {0, 1, 2, 2, 1, 3};
    indices[k] = 4 * (k / 6) + quad[k % 6];
  }
  fill_shape(&gl.box, nodes[0], normals[0], 24, indices, 36);
}

static void create_plane(void) {
  static const float nodes[12] = {-1, 0, -1, -1, 0, 1, 1, 0, -1, 1, 0, 1};
  static const float normals[12] = {0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0};
  static const uint32_t indices[6] = {0, 1, 2, 2, 1, 3};
  fill_shape(&gl.plane, nodes, normals, 4, indices, 6);
}

const char *draw_open(void) {
  const char *why;
  if ((why = create_program(&gl.lit, LIT_VERTEX, LIT_FRAGMENT)) != NULL) return why;
  if ((why = create_program(&gl.plain, PLAIN_VERTEX, PLAIN_FRAGMENT)) != NULL) return why;
  gl.lit_view = glGetUniformLocation(gl.lit, "view");
  gl.lit_model = glGetUniformLocation(gl.lit, "model");
  gl.lit_scale = glGetUniformLocation(gl.lit, "scale");
  gl.lit_stretch = glGetUniformLocation(gl.lit, "stretch");
  gl.lit_color = glGetUniformLocation(gl.lit, "color");
  gl.lit_eye = glGetUniformLocation(gl.lit, "eye");
  gl.lit_flat = glGetUniformLocation(gl.lit, "flatness");
  gl.plain_view = glGetUniformLocation(gl.plain, "view");
  for (int k = 0; k < SAMPLE_BODIES; k++) create_shape(&gl.bodies[k]);
  create_ball();
  create_box();
  create_plane();
  glGenVertexArrays(1, &gl.line_array);
  glGenBuffers(1, &gl.line_buffer);
  glEnable(GL_DEPTH_TEST);
  glEnable(GL_MULTISAMPLE);
  glEnable(GL_PROGRAM_POINT_SIZE);
  glLineWidth(2);
  return NULL;
}

void draw_reset(void) {
  for (int k = 0; k < SAMPLE_BODIES; k++) gl.bodies[k].is_filled = 0;
}

/* Uploads the positions and normals of a body, and its triangles if a cut changed them. */
static sinew_status upload(const sample *s, uint32_t k) {
  const sinew_body_id body = s->bodies[k].id;
  shape *to = &gl.bodies[k];
  sinew_vec3_view nodes;
  sinew_triangle_view triangles;
  sinew_topology_changes changes;
  sinew_status status = sinew_body_get_positions(s->world, body, &nodes);
  changes.struct_size = sizeof changes;
  if (status == SINEW_STATUS_OK) status = sinew_body_get_triangles(s->world, body, &triangles);
  if (status == SINEW_STATUS_OK)
    status = sinew_body_get_topology_changes(s->world, body, to->is_filled ? to->version : 0, &changes);
  if (status != SINEW_STATUS_OK) return status;
  glBindVertexArray(to->array);
  attribute(0, to->positions, nodes.data, nodes.count * nodes.stride, nodes.stride);
  attribute(1, to->normals, NULL, 12 * nodes.count, 12);
  void *normals = glMapBufferRange(GL_ARRAY_BUFFER, 0, (GLsizeiptr)(12 * nodes.count), GL_MAP_WRITE_BIT);
  if (normals != NULL) status = sinew_body_get_normals(s->world, body, (float *)normals, nodes.count);
  glUnmapBuffer(GL_ARRAY_BUFFER);
  if (!to->is_filled || changes.version != to->version) fill_indices(to, triangles.data, 3 * triangles.count);
  to->version = changes.version;
  to->is_filled = 1;
  return status;
}

static void draw_shape(const shape *s, const float model[16], const float scale[3], float stretch,
                       const float color[3], float flatness) {
  glUniformMatrix4fv(gl.lit_model, 1, GL_FALSE, model);
  glUniform3fv(gl.lit_scale, 1, scale);
  glUniform1f(gl.lit_stretch, stretch);
  glUniform3fv(gl.lit_color, 1, color);
  glUniform1f(gl.lit_flat, flatness);
  glBindVertexArray(s->array);
  glDrawElements(GL_TRIANGLES, s->index_count, GL_UNSIGNED_INT, NULL);
}

/* The matrix of a pose, by columns. */
static void pose_matrix(const float p[3], const float q[4], float m[16]) {
  const float x = q[0], y = q[1], z = q[2], w = q[3];
  const float rows[16] = {1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y), 0,
                          2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x), 0,
                          2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y), 0,
                          p[0], p[1], p[2], 1};
  memcpy(m, rows, sizeof rows);
}

/* a times b, by columns. */
static void multiply(const float a[16], const float b[16], float out[16]) {
  for (int i = 0; i < 16; i++) {
    out[i] = 0;
    for (int k = 0; k < 4; k++) out[i] += a[4 * k + i % 4] * b[4 * (i / 4) + k];
  }
}

/* Bodies and tools; those above a floor once more, flattened onto it as their shadows. */
static sinew_status draw_solids(const sample *s, const float *shadow, const float shade[3]) {
  static const float one[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, unit[3] = {1, 1, 1};
  for (uint32_t k = 0; k < s->body_count; k++)
    draw_shape(&gl.bodies[k], shadow ? shadow : one, unit, 0, shadow ? shade : s->bodies[k].color, shadow ? 1 : 0);
  for (uint32_t k = 0; k < s->tool_count; k++) {
    const sample_tool *tool = &s->tools[k];
    const int is_round = tool->shape == SINEW_SHAPE_SPHERE || tool->shape == SINEW_SHAPE_CAPSULE;
    const float *color = shadow ? shade : tool->color, same[3] = {tool->size[0], tool->size[0], tool->size[0]};
    float position[3], turned[4], model[16], flattened[16];
    if (tool->shape == SINEW_SHAPE_PLANE) continue;
    const sinew_status status = sinew_tool_get_pose(s->world, tool->id, position, turned);
    if (status != SINEW_STATUS_OK) return status;
    pose_matrix(position, turned, model);
    if (shadow) multiply(shadow, model, flattened);
    draw_shape(is_round ? &gl.ball : &gl.box, shadow ? flattened : model, is_round ? same : tool->size,
               tool->shape == SINEW_SHAPE_CAPSULE ? tool->size[1] : 0, color, shadow ? 1 : 0);
  }
  return SINEW_STATUS_OK;
}

/* A floor and the shadows on it, along the light of the shader. */
static sinew_status draw_floor(const sample *s) {
  static const float wide[3] = {3, 1, 3};
  for (uint32_t k = 0; k < s->tool_count; k++) {
    float position[3], turned[4], model[16], shade[3];
    if (s->tools[k].shape != SINEW_SHAPE_PLANE) continue;
    sinew_status status = sinew_tool_get_pose(s->world, s->tools[k].id, position, turned);
    if (status != SINEW_STATUS_OK) return status;
    pose_matrix(position, turned, model);
    for (int i = 0; i < 3; i++) shade[i] = 0.80f * s->tools[k].color[i];
    draw_shape(&gl.plane, model, wide, 0, s->tools[k].color, 1);
    const float h = position[1] + 2e-4f;
    const float shadow[16] = {1, 0, 0, 0, -0.45f, 0, -0.55f, 0, 0, 0, 1, 0, 0.45f * h, h, 0.55f * h, 1};
    status = draw_solids(s, shadow, shade);
    if (status != SINEW_STATUS_OK) return status;
  }
  return SINEW_STATUS_OK;
}

static void add_corner(corner *to, const float *position, uint32_t rgba) {
  memcpy(to->position, position, sizeof to->position);
  for (int i = 0; i < 4; i++) to->color[i] = (uint8_t)(rgba >> (24 - 8 * i));
}

static void add_line(void *context, const float *points, uint32_t rgba) {
  if (*(const uint32_t *)context == SINEW_DRAW_ATTACHMENTS) rgba = THREAD;
  if (debug.line_count + 2 > LINE_ROOM) return;
  for (int k = 0; k < 2; k++) add_corner(&debug.lines[debug.line_count++], points + 3 * k, rgba);
}

static void add_point(void *context, const float *points, uint32_t rgba) {
  (void)context;
  if (debug.point_count < LINE_ROOM) add_corner(&debug.points[debug.point_count++], points, rgba);
}

static void draw_corners(const corner *corners, GLsizei count, GLenum kind) {
  glBindVertexArray(gl.line_array);
  glBindBuffer(GL_ARRAY_BUFFER, gl.line_buffer);
  glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)((size_t)count * sizeof *corners), corners, GL_STREAM_DRAW);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof *corners, NULL);
  glVertexAttribPointer(1, 4, GL_UNSIGNED_BYTE, GL_TRUE, sizeof *corners, (void *)offsetof(corner, color));
  glEnableVertexAttribArray(0);
  glEnableVertexAttribArray(1);
  glDrawArrays(kind, 0, count);
}

static sinew_status draw_debug(const sample *s, uint32_t flags) {
  sinew_debug_draw def;
  sinew_status status = sinew_debug_draw_init(&def, sizeof def);
  def.flags = flags;
  def.context = &flags;
  def.draw_line = add_line;
  def.draw_point = add_point;
  debug.line_count = debug.point_count = 0;
  if (status == SINEW_STATUS_OK) status = sinew_world_debug_draw(s->world, &def);
  glDisable(GL_DEPTH_TEST); /* also what is inside tissue */
  draw_corners(debug.lines, debug.line_count, GL_LINES);
  draw_corners(debug.points, debug.point_count, GL_POINTS);
  glEnable(GL_DEPTH_TEST);
  return status;
}

sinew_status draw_sample(const sample *s, const draw_camera *camera, int width, int height, uint32_t flags) {
  const float near_plane = 0.01f, far_plane = 6, focus = 1 / tanf(FIELD_OF_VIEW / 2);
  const float *r = camera->right, *u = camera->up, *b = camera->back, *e = camera->eye;
  const float lens[16] = {focus * (float)height / (float)width, 0, 0, 0, 0, focus, 0, 0,
                          0, 0, (near_plane + far_plane) / (near_plane - far_plane), -1,
                          0, 0, 2 * near_plane * far_plane / (near_plane - far_plane), 0};
  const float look[16] = {r[0], u[0], b[0], 0, r[1], u[1], b[1], 0, r[2], u[2], b[2], 0,
                          -(r[0] * e[0] + r[1] * e[1] + r[2] * e[2]), -(u[0] * e[0] + u[1] * e[1] + u[2] * e[2]),
                          -(b[0] * e[0] + b[1] * e[1] + b[2] * e[2]), 1};
  float view[16];
  sinew_status status = SINEW_STATUS_OK;
  multiply(lens, look, view);
  glViewport(0, 0, width, height);
  glClearColor(0.90f, 0.92f, 0.94f, 1);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  for (uint32_t k = 0; k < s->body_count && status == SINEW_STATUS_OK; k++) status = upload(s, k);
  glUseProgram(gl.lit);
  glUniformMatrix4fv(gl.lit_view, 1, GL_FALSE, view);
  glUniform3fv(gl.lit_eye, 1, camera->eye);
  if (status == SINEW_STATUS_OK) status = draw_floor(s);
  if (status == SINEW_STATUS_OK) status = draw_solids(s, NULL, NULL);
  glUseProgram(gl.plain);
  glUniformMatrix4fv(gl.plain_view, 1, GL_FALSE, view);
  return status == SINEW_STATUS_OK ? draw_debug(s, flags) : status;
}
