/* Change settings of bodies, tools and worlds while they run.
 *
 * Most fields of a definition hold for good; these can change between two steps, and each has a getter.
 *
 * Output:
 *   read back: friction 0.8, at most 5 N, drag 0.002 N s/m, 4 substeps
 *   categories: tool 2 meets 1, body 1 meets 2, blade 4 meets 0
 *   tissue: 5 mm thick, sleeps below 1 mm/s
 */
#include "../example.h"

int main(void) {
  sinew_world *world = create_world(0.0f);
  sinew_mesh *mesh = cloth_mesh(0.1f, 10);
  sinew_body_def def = body_from_mesh(mesh);
  def.stiffness = 100.0f;
  def.node_mass = 1e-4f;
  sinew_body_id sheet;
  CHECK(sinew_body_create(world, &def, &sheet));
  sinew_mesh_destroy(mesh);

  sinew_tool_def ball;
  sinew_tool_id tool;
  CHECK(sinew_tool_def_init(&ball, sizeof ball));
  ball.radius = 0.01f;
  ball.position[1] = 0.02f;
  CHECK(sinew_tool_create(world, &ball, &tool));
  sinew_blade_def edge;
  sinew_blade_id blade;
  CHECK(sinew_blade_def_init(&edge, sizeof edge));
  edge.edge[4] = 0.01f; /* its second end */
  edge.position[1] = 0.5f;
  CHECK(sinew_blade_create(world, &edge, &blade));

  float friction, limit, drag;
  uint32_t substeps, most;
  CHECK(sinew_tool_set_friction(world, tool, 0.8f));
  CHECK(sinew_tool_set_force_limit(world, tool, 5.0f)); /* N: what moves it; it stops where tissue resists with more */
  CHECK(sinew_body_set_node_damping(world, sheet, 0.002f));
  CHECK(sinew_world_set_substeps(world, 4, 1000)); /* exactly 4 per step; 0: as many as stability needs */
  CHECK(sinew_tool_get_friction(world, tool, &friction));
  CHECK(sinew_tool_get_force_limit(world, tool, &limit));
  CHECK(sinew_body_get_node_damping(world, sheet, 0, &drag));
  CHECK(sinew_world_get_substeps(world, &substeps, &most));
  printf("read back: friction %.1f, at most %.0f N, drag %.3f N s/m, %u substeps\n", friction, limit, drag, substeps);

  uint32_t is[6];
  CHECK(sinew_tool_set_collision(world, tool, 2, 1));
  CHECK(sinew_body_set_collision(world, sheet, 1, 2));
  CHECK(sinew_blade_set_collision(world, blade, 4, 0));
  CHECK(sinew_tool_get_collision(world, tool, &is[0], &is[1]));
  CHECK(sinew_body_get_collision(world, sheet, &is[2], &is[3]));
  CHECK(sinew_blade_get_collision(world, blade, &is[4], &is[5]));
  printf("categories: tool %u meets %u, body %u meets %u, blade %u meets %u\n", is[0], is[1], is[2], is[3], is[4], is[5]);

  /* Settings of a body are one struct: read it, change fields, write it. */
  sinew_body_settings settings;
  settings.struct_size = sizeof settings;
  CHECK(sinew_body_get_settings(world, sheet, &settings));
  settings.contact_thickness = 0.005f; /* m */
  settings.sleep_speed = 0.001f;       /* m/s */
  CHECK(sinew_body_set_settings(world, sheet, &settings));
  CHECK(sinew_body_get_settings(world, sheet, &settings));
  printf("tissue: %.0f mm thick, sleeps below %.0f mm/s\n", 1e3 * settings.contact_thickness, 1e3 * settings.sleep_speed);
  sinew_world_destroy(world);
  return 0;
}
