#include "demo.h"

#include "scenes.h"

#include <string.h>

/* Makes a function visible to the page. */
#ifdef __wasm__
#define EXPORT(name) __attribute__((export_name(#name)))
#else
#define EXPORT(name)
#endif

#define MOST_NODES 65536u /* of a body that is drawn */

static sample shown;

EXPORT(demo_scene_count) uint32_t demo_scene_count(void) { return SAMPLE_SCENE_COUNT; }

EXPORT(demo_scene_name) const char *demo_scene_name(uint32_t scene) { return SAMPLE_SCENES[scene].name; }

EXPORT(demo_scene_hint) const char *demo_scene_hint(uint32_t scene) { return SAMPLE_SCENES[scene].hint; }

EXPORT(demo_start) sinew_status demo_start(uint32_t scene, uint32_t solver) {
  const sample_options options = {solver, SINEW_STORAGE_PACKED};
  if (shown.world != NULL) sample_end(&shown);
  return sample_start(&shown, scene, &options);
}

EXPORT(demo_pointer)
sinew_status demo_pointer(uint32_t mode, float origin_x, float origin_y, float origin_z, float direction_x,
                          float direction_y, float direction_z, int down) {
  const float origin[3] = {origin_x, origin_y, origin_z}, direction[3] = {direction_x, direction_y, direction_z};
  return sample_pointer(&shown, (sample_mode)mode, origin, direction, down);
}

/* Frames 4 to 57 in three parts: pull, press and cut, each from left to right through the target. */
EXPORT(demo_stroke) sinew_status demo_stroke(uint32_t frame) {
  const uint32_t part = frame / 20, within = frame % 20;
  const float across = 0.004f * ((float)within - 10.0f);
  const float *eye = shown.eye, *target = shown.target;
  if (part >= SAMPLE_MODE_COUNT) return SINEW_STATUS_OK;
  return demo_pointer(part, eye[0], eye[1], eye[2], target[0] + across - eye[0], target[1] - eye[1],
                      target[2] - eye[2], within >= 4 && within < 18);
}

EXPORT(demo_step) sinew_status demo_step(void) { return sample_step(&shown, 1.0f / 60.0f); }

EXPORT(demo_hash) uint64_t demo_hash(void) {
  uint64_t hash = 0;
  sinew_world_get_state_hash(shown.world, &hash);
  return hash;
}

EXPORT(demo_error) const char *demo_error(void) {
  static char text[512];
  sinew_last_error(text, sizeof text);
  return text;
}

EXPORT(demo_text) const char *demo_text(void) { return shown.text; }

EXPORT(demo_camera) const float *demo_camera(void) {
  static float camera[6];
  memcpy(camera, shown.eye, sizeof shown.eye);
  memcpy(camera + 3, shown.target, sizeof shown.target);
  return camera;
}

EXPORT(demo_held) const float *demo_held(void) {
  static float position[3];
  float orientation[4];
  if (shown.pointer.tool.index1 == 0) return NULL;
  if (sinew_tool_get_pose(shown.world, shown.pointer.tool, position, orientation) != SINEW_STATUS_OK) return NULL;
  return position;
}

EXPORT(demo_get_body) const demo_body *demo_get_body(uint32_t index) {
  static float normals[3 * MOST_NODES];
  static demo_body body;
  sinew_vec3_view positions;
  sinew_triangle_view triangles;
  sinew_topology_changes changes;
  if (index >= shown.body_count) return NULL;
  changes.struct_size = sizeof changes;
  if (sinew_body_get_positions(shown.world, shown.bodies[index].id, &positions) != SINEW_STATUS_OK ||
      positions.count > MOST_NODES ||
      sinew_body_get_normals(shown.world, shown.bodies[index].id, normals, positions.count) != SINEW_STATUS_OK ||
      sinew_body_get_triangles(shown.world, shown.bodies[index].id, &triangles) != SINEW_STATUS_OK ||
      sinew_body_get_topology_changes(shown.world, shown.bodies[index].id, 0, &changes) != SINEW_STATUS_OK)
    return NULL;
  body.positions = positions.data;
  body.normals = normals;
  body.node_count = (uint32_t)positions.count;
  body.triangles = triangles.data;
  body.triangle_count = (uint32_t)triangles.count;
  body.version = (uint32_t)changes.version;
  memcpy(body.color, shown.bodies[index].color, sizeof body.color);
  return &body;
}

EXPORT(demo_get_tool) const demo_tool *demo_get_tool(uint32_t index) {
  static demo_tool tool;
  if (index >= shown.tool_count) return NULL;
  tool.shape = shown.tools[index].shape;
  memcpy(tool.size, shown.tools[index].size, sizeof tool.size);
  memcpy(tool.color, shown.tools[index].color, sizeof tool.color);
  if (sinew_tool_get_pose(shown.world, shown.tools[index].id, tool.position, tool.orientation) != SINEW_STATUS_OK)
    return NULL;
  return &tool;
}
