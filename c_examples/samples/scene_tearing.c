/* A sheet with a notch is pulled apart until it tears.
 *
 * A body with tear_strain tears by itself, most easily where strain concentrates: at the end of the notch. */
#include "scene.h"

#define PULL_SPEED 0.03f /* [m/s] of each end */
#define PULL_TIME 2.5f   /* [s] */

sinew_status create_tearing(sample *s);
sinew_status act_tearing(sample *s, float seconds);

sinew_status create_tearing(sample *s) {
  const float size[2] = {0.2f, 0.14f};
  const uint32_t cells[2] = {40, 28};
  const float start[6] = {0.001f, -0.01f, 0.08f, 0.001f, 0.01f, 0.08f}; /* the edge that cuts the notch */
  const float end[6] = {0.001f, -0.01f, 0.045f, 0.001f, 0.01f, 0.045f};
  sinew_body_def def;
  TRY(sinew_mesh_create_cloth(size, cells, &s->mesh));
  TRY(scene_body(s, &def));
  def.node_mass = 5e-5f;
  def.node_damping = 4e-3f;
  def.stiffness = 100.0f;
  def.spring_damping = 5e-3f;
  def.bending_stiffness = 5e-6f;
  def.tear_strain = 0.35f;
  def.most_tears = 8;         /* in a step */
  def.smallest_piece = 1e-4f; /* [m^2] */
  TRY(scene_add_body(s, &def, 0x5B9A68));
  TRY(scene_pin(s, s->bodies[0].id, 0, -1, -0.099f));
  TRY(scene_pin(s, s->bodies[0].id, 0, 0.099f, 1));
  TRY(sinew_body_cut(s->world, s->bodies[0].id, start, end, NULL));
  s->cut_depth = 0.02f;
  scene_camera(s, 0.05f, 0.22f, 0.26f, 0.0f, 0.0f, 0.0f);
  return SINEW_STATUS_OK;
}

sinew_status act_tearing(sample *s, float seconds) {
  if (s->time > PULL_TIME) return SINEW_STATUS_OK;
  scene_say(s, "stretched by", 100 * 2 * PULL_SPEED * s->time / 0.2, "percent");
  return scene_spread(s, PULL_SPEED * seconds);
}
