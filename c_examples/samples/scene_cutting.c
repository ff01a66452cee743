/* A scalpel opens a block of tissue under tension, which gapes.
 *
 * A blade is an edge that cuts where its poses take it, against the toughness of the tissue. The box that shows the
 * scalpel touches nothing. */
#include "scene.h"

#define TENSION 0.15f    /* how much the block is stretched */
#define STRETCHING 0.5f  /* [s] how long that takes */
#define EDGE_LOW 0.0f    /* [m] the edge reaches from half the depth to above the block */
#define EDGE_HIGH 0.04f

sinew_status create_cutting(sample *s);
sinew_status act_cutting(sample *s, float seconds);

/* The stroke: from the front to the back in two seconds, then up. */
static void scalpel_at(double time, float position[3]) {
  const float stroke = (float)time - STRETCHING;
  position[0] = 0.001f;
  position[1] = 0.06f * scene_smooth(stroke - 2.2f);
  position[2] = 0.048f - 0.085f * scene_smooth(0.5f * stroke);
}

sinew_status create_cutting(sample *s) {
  const float size[3] = {0.12f, 0.03f, 0.08f};
  const uint32_t cells[3] = {20, 5, 14};
  sinew_body_def def;
  sinew_tool_def scalpel;
  sinew_blade_def blade;
  TRY(sinew_mesh_create_block(size, cells, &s->mesh));
  TRY(scene_body(s, &def));
  scene_tissue(&def, 5400.0f, 0.006f);
  def.toughness = 20.0f; /* [J/m^2] */
  TRY(scene_add_body(s, &def, 0xC9615A));
  TRY(scene_pin(s, s->bodies[0].id, 0, -1, -0.059f));
  TRY(scene_pin(s, s->bodies[0].id, 0, 0.059f, 1));

  TRY(sinew_blade_def_init(&blade, sizeof blade));
  blade.edge[1] = EDGE_LOW;
  blade.edge[4] = EDGE_HIGH;
  scalpel_at(0, blade.position);
  TRY(sinew_blade_create(s->world, &blade, &s->blade));
  TRY(scene_tool(&scalpel, SINEW_SHAPE_BOX, 0.0006f, 0.02f, 0.005f, 0, 0, 0));
  scalpel.collision_mask = 0;
  memcpy(scalpel.position, blade.position, sizeof blade.position);
  scalpel.position[1] += 0.02f;
  TRY(scene_add_tool(s, &scalpel, 0xD5DCE3));
  s->cut_depth = 0.02f;
  scene_camera(s, 0.10f, 0.17f, 0.20f, 0.0f, 0.0f, 0.0f);
  return SINEW_STATUS_OK;
}

sinew_status act_cutting(sample *s, float seconds) {
  sinew_blade_report report;
  float position[3];
  if (s->time < STRETCHING) TRY(scene_spread(s, TENSION * 0.06f * seconds / STRETCHING));
  scalpel_at(s->time + seconds, position);
  TRY(sinew_blade_set_pose(s->world, s->blade, position, NULL));
  report.struct_size = sizeof report;
  TRY(sinew_blade_get_report(s->world, s->blade, &report));
  if (s->pointer.tool.index1 == 0) scene_say(s, "the blade feels", report.force[2], "N");
  position[1] += 0.02f;
  return sinew_tool_set_pose(s->world, s->tools[0].id, position, NULL);
}
