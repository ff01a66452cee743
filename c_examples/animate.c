/* Draws the frames of the animations in the README: cutting, grasping, and a force trace.
 *
 *   animate [-o DIRECTORY]
 *
 * `make -C c_examples animations` runs it and leaves cutting.png, grasping.png and force.png, animated PNG files, in
 * docs/images. */
#include "apng.h"

#define FRAMES 40
#define WIDTH 360
#define HEIGHT 270

static sinew_picture_def view(float x, float y, float z, float below) {
  sinew_picture_def picture;
  CHECK(sinew_picture_def_init(&picture, sizeof picture));
  picture.width = WIDTH;
  picture.height = HEIGHT;
  picture.eye[0] = x;
  picture.eye[1] = y;
  picture.eye[2] = z;
  picture.target[1] = below;
  return picture;
}

static void save_frame(const sinew_world *world, const sinew_picture_def *picture, const char *directory,
                       const char *scene, int frame) {
  char name[64];
  snprintf(name, sizeof name, "%s_%03d.png", scene, frame);
  save_picture(world, picture, directory, name);
}

static sinew_body_id create_block(sinew_world *world, float toughness) {
  const float size[3] = {0.12f, 0.03f, 0.08f};
  const uint32_t cells[3] = {24, 6, 16};
  sinew_mesh *mesh;
  sinew_body_id block;
  CHECK(sinew_mesh_create_block(size, cells, &mesh));
  sinew_body_def def = body_from_mesh(mesh);
  def.material = SINEW_MATERIAL_SPRINGS;
  def.young_modulus = 5400.0f;
  def.density = 1060.0f;
  def.solver = SINEW_SOLVER_IMPLICIT;
  def.retardation_time = 0.01f;
  def.volume_stiffness = 2700.0f;
  def.spare_nodes = toughness > 0 ? 40000 : 0;
  def.toughness = toughness;
  CHECK(sinew_body_create(world, &def, &block));
  sinew_mesh_destroy(mesh);
  return block;
}

static void pin_ends(sinew_world *world, sinew_body_id block) {
  sinew_vec3_view nodes;
  CHECK(sinew_body_get_positions(world, block, &nodes));
  for (size_t i = 0; i < nodes.count; i++)
    if (fabsf(node(nodes, i)[0]) > 0.059f) CHECK(sinew_body_pin(world, block, (uint32_t)i));
}

/* Moves the pinned ends apart by a part of the length of the block. */
static void stretch(sinew_world *world, sinew_body_id block, float part) {
  sinew_vec3_view nodes;
  CHECK(sinew_body_get_positions(world, block, &nodes));
  float *moved = (float *)allocate(3 * nodes.count, sizeof *moved);
  for (size_t i = 0; i < nodes.count; i++) {
    memcpy(moved + 3 * i, node(nodes, i), 3 * sizeof(float));
    moved[3 * i] *= 1.0f + part;
  }
  CHECK(sinew_body_set_positions(world, block, moved, nodes.count));
  free(moved);
}

/* A blade cuts a stretched block, which gapes. */
static void cutting(const char *directory) {
  sinew_world *world = create_world(0.0f);
  const sinew_body_id block = create_block(world, 20.0f);
  const sinew_picture_def picture = view(0.10f, 0.16f, 0.16f, 0.0f);
  sinew_blade_def blade_def;
  sinew_blade_id blade;
  pin_ends(world, block);
  stretch(world, block, 0.15f);
  CHECK(sinew_blade_def_init(&blade_def, sizeof blade_def));
  blade_def.edge[1] = 0.0f; /* from 15 mm below the top to above it */
  blade_def.edge[4] = 0.04f;
  blade_def.position[0] = 0.001f;
  blade_def.position[2] = -0.05f;
  CHECK(sinew_blade_create(world, &blade_def, &blade));
  for (int frame = 0; frame < FRAMES; frame++) {
    const double part = smooth(frame / 28.0);
    const float position[3] = {0.001f, 0.0f, (float)(-0.05 + 0.10 * part)};
    CHECK(sinew_blade_set_pose(world, blade, position, NULL));
    step_world(world, 0.02, 1);
    save_frame(world, &picture, directory, "cutting", frame);
  }
  sinew_world_destroy(world);
}

/* A tool grasps a block, lifts it and lets it go; the force on the tool is the trace. */
static void grasping(const char *directory, float *trace) {
  sinew_world *world = create_world(0.0f);
  const sinew_body_id block = create_block(world, 0.0f);
  const sinew_picture_def picture = view(0.08f, 0.10f, 0.22f, 0.015f);
  sinew_tool_def tool_def;
  sinew_tool_id tool;
  sinew_vec3_view nodes;
  sinew_attachment_def attachment;
  sinew_attachment_id held[64];
  uint32_t near_tool[64];
  size_t count = 0;
  pin_below(world, block, 1, -0.014f);
  CHECK(sinew_tool_def_init(&tool_def, sizeof tool_def));
  tool_def.shape = SINEW_SHAPE_CAPSULE;
  tool_def.radius = 0.005f;
  tool_def.half_length = 0.025f;
  tool_def.position[1] = 0.046f;
  CHECK(sinew_tool_create(world, &tool_def, &tool));
  CHECK(sinew_body_get_positions(world, block, &nodes));
  for (size_t i = 0; i < nodes.count && count < 64; i++) {
    const float tip[3] = {0, 0.016f, 0};
    if (node(nodes, i)[1] > 0.014f && distance(node(nodes, i), tip) < 0.011) near_tool[count++] = (uint32_t)i;
  }
  CHECK(sinew_attachment_def_init(&attachment, sizeof attachment));
  attachment.body = block;
  attachment.tool = tool;
  attachment.nodes = near_tool;
  attachment.count = count;
  CHECK(sinew_attachment_create(world, &attachment, held));
  for (int frame = 0; frame < FRAMES; frame++) {
    const float position[3] = {0, 0.046f + 0.02f * (float)smooth(frame / 20.0), 0};
    float force[3], torque[3];
    if (frame == 26)
      for (size_t i = 0; i < count; i++) CHECK(sinew_attachment_release(world, held[i]));
    CHECK(sinew_tool_set_pose(world, tool, position, NULL));
    CHECK(sinew_world_step(world, 0.02f, NULL));
    CHECK(sinew_tool_get_wrench(world, tool, force, torque));
    trace[frame] = -force[1];
    save_frame(world, &picture, directory, "grasping", frame);
  }
  sinew_world_destroy(world);
}

/* Adds a thick line from a to b in the plane z = 0, as two triangles with nodes of their own. */
static void add_line(float *positions, uint32_t *triangles, uint32_t line, const float a[2], const float b[2]) {
  const float thickness = 0.006f, length = hypotf(b[0] - a[0], b[1] - a[1]) + 1e-6f;
  const float aside[2] = {-thickness * (b[1] - a[1]) / length, thickness * (b[0] - a[0]) / length};
  const uint32_t corners[6] = {0, 1, 2, 0, 2, 3};
  for (int k = 0; k < 2; k++) {
    positions[12 * line + k] = a[k] - aside[k];
    positions[12 * line + 3 + k] = b[k] - aside[k];
    positions[12 * line + 6 + k] = b[k] + aside[k];
    positions[12 * line + 9 + k] = a[k] + aside[k];
  }
  for (int i = 0; i < 6; i++) triangles[6 * line + i] = 4 * line + corners[i];
}

/* Draws the first values of a trace over two axes, as a body that is a flat surface. */
static void draw_trace(const char *directory, const float *trace, int count, float largest) {
  static const float top[2] = {-0.62f, 0.42f}, origin[2] = {-0.62f, -0.42f}, right[2] = {0.62f, -0.42f};
  float positions[12 * (FRAMES + 2)] = {0}, points[FRAMES][2];
  uint32_t triangles[6 * (FRAMES + 2)], lines = 0;
  sinew_world *world = create_world(0.0f);
  sinew_picture_def picture = view(0.0f, 0.0f, 2.1f, 0.0f);
  sinew_body_def def;
  sinew_body_id body;
  add_line(positions, triangles, lines++, top, origin);
  add_line(positions, triangles, lines++, origin, right);
  for (int i = 0; i < count; i++) {
    points[i][0] = -0.6f + 1.2f * (float)i / (FRAMES - 1);
    points[i][1] = -0.4f + 0.8f * trace[i] / largest;
    if (i > 0) add_line(positions, triangles, lines++, points[i - 1], points[i]);
  }
  CHECK(sinew_body_def_init(&def, sizeof def));
  def.positions = positions;
  def.node_count = 4 * (size_t)lines;
  def.triangles = triangles;
  def.triangle_count = 2 * (size_t)lines;
  def.node_mass = 1.0f;
  CHECK(sinew_body_create(world, &def, &body));
  save_frame(world, &picture, directory, "force", count - 1);
  sinew_world_destroy(world);
}

int main(int argc, char **argv) {
  const options chosen = read_options(argc, argv, 0);
  float trace[FRAMES], largest = 0;
  cutting(chosen.directory);
  grasping(chosen.directory, trace);
  for (int i = 0; i < FRAMES; i++) largest = fmaxf(largest, trace[i]);
  for (int i = 0; i < FRAMES; i++) draw_trace(chosen.directory, trace, i + 1, largest);
  join_frames(chosen.directory, "cutting", FRAMES, 60);
  join_frames(chosen.directory, "grasping", FRAMES, 60);
  join_frames(chosen.directory, "force", FRAMES, 60);
  printf("largest force while grasping: %.2f N\n", largest);
  return 0;
}
