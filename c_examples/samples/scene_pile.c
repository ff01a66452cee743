/* Soft blocks and steel balls fall onto each other.
 *
 * Bodies collide with each other if both have meets_bodies. A tool with a mass is a rigid body: the balls push the blocks
 * and are pushed by them. Balls pass through each other. */
#include "scene.h"

sinew_status create_pile(sample *s);

sinew_status create_pile(sample *s) {
  static const uint32_t colors[] = {0xD9A441, 0x3E6FA8, 0xA8443A, 0x5B9A68};
  const float size[3] = {0.05f, 0.05f, 0.05f};
  const uint32_t cells[3] = {3, 3, 3};
  sinew_body_def def;
  sinew_tool_def floor, ball;
  TRY(sinew_mesh_create_block(size, cells, &s->mesh));
  for (uint32_t i = 0; i < 8; i++) {
    const float turn = 0.4f * (float)i;
    TRY(scene_body(s, &def));
    scene_tissue(&def, 15000.0f, 0.016f);
    def.spare_nodes = 2000;
    def.meets_bodies = 1;
    def.contact_friction = 0.5f;
    def.contact_thickness = 0.0005f;
    def.position[0] = 0.035f * cosf(2.4f * (float)i);
    def.position[1] = 0.03f + 0.058f * (float)i;
    def.position[2] = 0.035f * sinf(2.4f * (float)i);
    def.orientation[1] = sinf(turn);
    def.orientation[3] = cosf(turn);
    TRY(scene_add_body(s, &def, colors[i % 4]));
  }
  TRY(scene_tool(&floor, SINEW_SHAPE_PLANE, 0, 0, 0, 0, 0, 0));
  floor.friction = 0.6f;
  TRY(scene_add_tool(s, &floor, 0x5D7F86));
  for (uint32_t i = 0; i < 3; i++) {
    const float across = 0.03f * ((float)i - 1.0f);
    TRY(scene_tool(&ball, SINEW_SHAPE_SPHERE, 0.018f, 0, 0, across, 0.62f + 0.05f * (float)i, -across));
    TRY(scene_add_tool(s, &ball, 0x9AA4AE));
    TRY(scene_make_dynamic(s, 2000.0f));
  }
  scene_camera(s, 0.25f, 0.30f, 0.48f, 0.0f, 0.08f, 0.0f);
  return SINEW_STATUS_OK;
}
