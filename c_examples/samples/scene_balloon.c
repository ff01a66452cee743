/* A balloon under a weight is inflated, lifts it and lets it down again.
 *
 * A closed surface with enclosed_stiffness or pressure has a cavity. A cut opens it for good. */
#include "scene.h"

#define RADIUS 0.05f  /* [m] at rest */
#define CELLS 10u     /* along an edge of the cube that becomes the ball */
#define PRESSURE 900.0f /* [Pa] the most */

sinew_status create_balloon(sample *s);
sinew_status act_balloon(sample *s, float seconds);

/* The surface of a block, with its nodes moved onto a ball. Nodes inside are no part of a surface, and dropped. */
static sinew_status create_ball(sample *s) {
  const float size[3] = {2, 2, 2};
  const uint32_t cells[3] = {CELLS, CELLS, CELLS};
  float round[3 * (CELLS + 1) * (CELLS + 1) * (CELLS + 1)];
  sinew_mesh *block = NULL;
  sinew_mesh_view view;
  sinew_status status;
  view.struct_size = sizeof view;
  TRY(sinew_mesh_create_block(size, cells, &block));
  status = sinew_mesh_get_view(block, &view);
  for (size_t i = 0; i < view.node_count; i++) {
    const float *p = view.positions + 3 * i, x = p[0] * p[0], y = p[1] * p[1], z = p[2] * p[2];
    round[3 * i] = RADIUS * p[0] * sqrtf(1 - (y + z) / 2 + y * z / 3); /* evenly spread over the ball */
    round[3 * i + 1] = RADIUS * p[1] * sqrtf(1 - (z + x) / 2 + z * x / 3);
    round[3 * i + 2] = RADIUS * p[2] * sqrtf(1 - (x + y) / 2 + x * y / 3);
  }
  if (status == SINEW_STATUS_OK)
    status = sinew_mesh_create(round, view.node_count, view.surface, view.surface_triangle_count, NULL, 0, &s->mesh);
  sinew_mesh_destroy(block);
  return status;
}

sinew_status create_balloon(sample *s) {
  sinew_body_def def;
  sinew_tool_def floor, weight;
  TRY(create_ball(s));
  TRY(scene_body(s, &def));
  def.stiffness = 60.0f;      /* [N/m] */
  def.spring_damping = 0.01f; /* [N s/m] */
  def.node_mass = 5e-5f;      /* [kg] */
  def.node_damping = 2e-3f;   /* [N s/m] */
  def.pressure = 100.0f;      /* [Pa] */
  def.contact_thickness = 0.0005f;
  def.position[1] = RADIUS + 0.001f;
  TRY(scene_add_body(s, &def, 0xC2455D));

  TRY(scene_tool(&floor, SINEW_SHAPE_PLANE, 0, 0, 0, 0, 0, 0));
  floor.friction = 0.8f;
  TRY(scene_add_tool(s, &floor, 0x5D7F86));
  TRY(scene_tool(&weight, SINEW_SHAPE_BOX, 0.05f, 0.006f, 0.05f, 0, 2 * RADIUS + 0.01f, 0));
  weight.friction = 0.8f;
  TRY(scene_add_tool(s, &weight, 0xB08D57));
  TRY(scene_make_dynamic(s, 500.0f));
  s->cut_depth = 0.015f;
  scene_camera(s, 0.14f, 0.16f, 0.34f, 0.0f, 0.055f, 0.0f);
  return SINEW_STATUS_OK;
}

sinew_status act_balloon(sample *s, float seconds) {
  sinew_enclosed_report report;
  const double breath = 0.5 - 0.5 * cos(1.2 * (s->time + seconds));
  TRY(sinew_body_set_pressure(s->world, s->bodies[0].id, 100.0f + (PRESSURE - 100.0f) * (float)breath));
  report.struct_size = sizeof report;
  TRY(sinew_body_get_enclosed_report(s->world, s->bodies[0].id, &report));
  if (report.rest_volume > 0) scene_say(s, "volume", report.volume / report.rest_volume, "times that at rest");
  return SINEW_STATUS_OK;
}
