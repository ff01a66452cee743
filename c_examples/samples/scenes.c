/* The list of scenes, how a scene starts, steps and ends, and what the scenes share. */
#include "scene.h"

sinew_status create_organ(sample *s);
sinew_status create_cloth(sample *s);
sinew_status create_cutting(sample *s);
sinew_status create_suturing(sample *s);
sinew_status create_pile(sample *s);
sinew_status create_haptics(sample *s);
sinew_status create_balloon(sample *s);
sinew_status create_tearing(sample *s);
sinew_status act_cutting(sample *s, float seconds);
sinew_status act_suturing(sample *s, float seconds);
sinew_status act_haptics(sample *s, float seconds);
sinew_status act_balloon(sample *s, float seconds);
sinew_status act_tearing(sample *s, float seconds);
sinew_status pointer_step(sample *s, float seconds);

#ifdef __cplusplus
extern "C" {
#endif
const sample_scene SAMPLE_SCENES[] = {
  {"organ", "Pull, press or cut the liver.", create_organ, NULL},
  {"cloth", "Pull the cloth off the ball, or cut it.", create_cloth, NULL},
  {"cutting", "A scalpel opens tissue under tension. Cut further.", create_cutting, act_cutting},
  {"suturing", "Threads close a wound. Pull at its sides.", create_suturing, act_suturing},
  {"pile", "Soft blocks and steel balls fall. Pull a block out.", create_pile, NULL},
  {"haptics", "A simulated hand strokes tissue and feels it at 1 kHz.", create_haptics, act_haptics},
  {"balloon", "Pressure lifts a weight. Cut the balloon.", create_balloon, act_balloon},
  {"tearing", "A notched sheet is pulled until it tears.", create_tearing, act_tearing},
};
const uint32_t SAMPLE_SCENE_COUNT = sizeof SAMPLE_SCENES / sizeof SAMPLE_SCENES[0];
#ifdef __cplusplus
}
#endif

sinew_status sample_start(sample *s, uint32_t scene, const sample_options *options) {
  const sample_options defaults = {SINEW_SOLVER_AUTO, SINEW_STORAGE_PACKED};
  sinew_world_def def;
  sinew_status status;
  memset(s, 0, sizeof *s);
  s->options = options == NULL ? defaults : *options;
  s->scene = scene < SAMPLE_SCENE_COUNT ? scene : 0;
  s->cut_depth = 0.03f;
  TRY(sinew_world_def_init(&def, sizeof def));
  TRY(sinew_world_create(&def, &s->world));
  status = SAMPLE_SCENES[s->scene].create(s);
  sinew_mesh_destroy(s->mesh);
  s->mesh = NULL;
  return status;
}

sinew_status sample_step(sample *s, float seconds) {
  const sample_scene *scene = &SAMPLE_SCENES[s->scene];
  TRY(pointer_step(s, seconds));
  if (scene->act != NULL) TRY(scene->act(s, seconds));
  TRY(sinew_world_step(s->world, seconds, NULL));
  s->time += seconds;
  return SINEW_STATUS_OK;
}

void sample_end(sample *s) {
  sinew_haptic_destroy(s->haptic);
  sinew_world_destroy(s->world);
  memset(s, 0, sizeof *s);
}

sinew_status scene_body(sample *s, sinew_body_def *def) {
  TRY(sinew_body_def_init(def, sizeof *def));
  TRY(sinew_body_def_set_mesh(def, s->mesh));
  def->solver = s->options.solver;
  def->storage = s->options.storage;
  if (def->storage == SINEW_STORAGE_FAST_LINK) def->springs_per_node = 64; /* room for what cuts add */
  def->spare_nodes = 20000;
  return SINEW_STATUS_OK;
}

void scene_tissue(sinew_body_def *def, float young_modulus, float spacing) {
  def->material = SINEW_MATERIAL_SPRINGS;
  def->young_modulus = young_modulus;
  def->volume_stiffness = 0.4f * young_modulus; /* it recovers from inversion */
  def->density = 1060.0f;
  def->node_damping = 20.0f * def->density * spacing * spacing * spacing; /* a motion halves in 1/30 s */
  def->mass_scaling = 0.05f;                                              /* fewer substeps */
}

static void set_color(float color[3], uint32_t rgb) {
  for (int i = 0; i < 3; i++) color[i] = (float)(rgb >> (16 - 8 * i) & 255) / 255.0f;
}

sinew_status scene_add_body(sample *s, const sinew_body_def *def, uint32_t color) {
  sample_body *body = &s->bodies[s->body_count];
  if (s->body_count == SAMPLE_BODIES) return SINEW_STATUS_CAPACITY;
  TRY(sinew_body_create(s->world, def, &body->id));
  set_color(body->color, color);
  s->body_count++;
  return SINEW_STATUS_OK;
}

sinew_status scene_tool(sinew_tool_def *def, uint32_t shape, float size_x, float size_y, float size_z, float x, float y,
                        float z) {
  TRY(sinew_tool_def_init(def, sizeof *def));
  def->shape = shape;
  def->friction = 0.3f;
  if (shape == SINEW_SHAPE_SPHERE || shape == SINEW_SHAPE_CAPSULE) def->radius = size_x;
  if (shape == SINEW_SHAPE_CAPSULE) def->half_length = size_y;
  if (shape == SINEW_SHAPE_BOX) {
    def->half_extents[0] = size_x;
    def->half_extents[1] = size_y;
    def->half_extents[2] = size_z;
  }
  def->position[0] = x;
  def->position[1] = y;
  def->position[2] = z;
  return SINEW_STATUS_OK;
}

sinew_status scene_add_tool(sample *s, const sinew_tool_def *def, uint32_t color) {
  sample_tool *tool = &s->tools[s->tool_count];
  if (s->tool_count == SAMPLE_TOOLS) return SINEW_STATUS_CAPACITY;
  TRY(sinew_tool_create(s->world, def, &tool->id));
  tool->shape = def->shape;
  memcpy(tool->size, def->half_extents, sizeof tool->size);
  if (def->shape != SINEW_SHAPE_BOX) {
    tool->size[0] = def->radius;
    tool->size[1] = def->half_length;
  }
  set_color(tool->color, color);
  s->tool_count++;
  return SINEW_STATUS_OK;
}

sinew_status scene_make_dynamic(sample *s, float density) {
  const sinew_tool_id tool = s->tools[s->tool_count - 1].id;
  sinew_mass_properties mass;
  mass.struct_size = sizeof mass;
  TRY(sinew_tool_get_mass_of_density(s->world, tool, density, &mass));
  return sinew_tool_set_mass(s->world, tool, &mass);
}

sinew_status scene_pin(sample *s, sinew_body_id body, int axis, float low, float high) {
  float least[3] = {-10, -10, -10}, most[3] = {10, 10, 10};
  least[axis] = low;
  most[axis] = high;
  return sinew_body_pin_box(s->world, body, least, most, NULL);
}

sinew_status scene_spread(sample *s, float distance) {
  const sinew_body_id body = s->bodies[0].id;
  sinew_vec3_view nodes;
  TRY(sinew_body_get_positions(s->world, body, &nodes));
  for (size_t i = 0; i < nodes.count; i++) {
    const float *node = (const float *)((const char *)nodes.data + i * nodes.stride);
    const float moved[3] = {node[0] + copysignf(distance, node[0]), node[1], node[2]};
    const sinew_status status = sinew_body_move_pin(s->world, body, (uint32_t)i, moved);
    if (status != SINEW_STATUS_OK && status != SINEW_STATUS_INVALID_ARGUMENT) return status; /* that one is not pinned */
  }
  return SINEW_STATUS_OK;
}

void scene_camera(sample *s, float eye_x, float eye_y, float eye_z, float target_x, float target_y, float target_z) {
  const float eye[3] = {eye_x, eye_y, eye_z}, target[3] = {target_x, target_y, target_z};
  memcpy(s->eye, eye, sizeof eye);
  memcpy(s->target, target, sizeof target);
}

void scene_say(sample *s, const char *name, double value, const char *unit) {
  char *text = s->text, digits[16];
  uint32_t hundredths = (uint32_t)(100 * fabs(value) + 0.5), count = 0;
  while (*name != 0) *text++ = *name++;
  *text++ = ' ';
  if (value < 0 && hundredths > 0) *text++ = '-';
  for (; count < 3 || hundredths > 0; hundredths /= 10) digits[count++] = (char)('0' + hundredths % 10);
  while (count > 0) {
    if (count == 2) *text++ = '.';
    *text++ = digits[--count];
  }
  *text++ = ' ';
  while (*unit != 0) *text++ = *unit++;
  *text = 0;
}

float scene_smooth(float t) {
  t = t < 0 ? 0 : t > 1 ? 1 : t;
  return t * t * (3 - 2 * t);
}
