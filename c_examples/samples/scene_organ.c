/* A liver that rests on its pinned underside.
 *
 * Tetrahedra with the Young's modulus of liver become springs in one call. The solver chooses its own substeps. */
#include "scene.h"

sinew_status create_organ(sample *s);

sinew_status create_organ(sample *s) {
  sinew_body_def def;
  sinew_tool_def table;
  float low[3], high[3];
  TRY(sinew_mesh_create_organ(0.2f, 0.011f, &s->mesh));
  TRY(scene_body(s, &def));
  scene_tissue(&def, 6000.0f, 0.011f);
  TRY(scene_add_body(s, &def, 0xA8443A));
  TRY(sinew_body_get_bounds(s->world, s->bodies[0].id, low, high));
  TRY(scene_pin(s, s->bodies[0].id, 1, low[1], low[1] + 0.12f * (high[1] - low[1])));

  TRY(scene_tool(&table, SINEW_SHAPE_PLANE, 0, 0, 0, 0, low[1] - 0.001f, 0));
  TRY(scene_add_tool(s, &table, 0x5D7F86));
  scene_camera(s, 0.12f, 0.22f, 0.30f, 0.0f, 0.0f, 0.0f);
  return SINEW_STATUS_OK;
}
