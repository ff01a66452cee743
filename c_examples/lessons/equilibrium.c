/* Start in static equilibrium.
 *
 * A body that starts in its unloaded shape swings when gravity acts on it first. sinew_body_solve_equilibrium moves it to static
 * equilibrium under gravity, pins and forces in one call, before the first step.
 *
 * Output:
 *   found: the largest force left is below 1 mN
 *   it sags: yes
 *   movement in the next second: below 0.1 mm
 */
#include "../example.h"

int main(void) {
  sinew_world *world = create_world(9.81f);
  const float size[3] = {0.1f, 0.02f, 0.02f};
  const uint32_t cells[3] = {15, 3, 3};
  sinew_mesh *mesh;
  CHECK(sinew_mesh_create_block(size, cells, &mesh));
  sinew_body_def def = body_from_mesh(mesh);
  def.material = SINEW_MATERIAL_SPRINGS;
  def.young_modulus = 2e4f;
  def.density = 1000.0f;
  def.node_damping = 1e-3f;
  sinew_body_id beam;
  CHECK(sinew_body_create(world, &def, &beam));
  sinew_mesh_destroy(mesh);
  pin_below(world, beam, 0, -0.049f);

  sinew_equilibrium_def search;
  CHECK(sinew_equilibrium_def_init(&search, sizeof search));
  search.tolerance = 1e-7f; /* m */
  sinew_equilibrium_report report;
  report.struct_size = sizeof report;
  CHECK(sinew_body_solve_equilibrium(world, beam, &search, &report)); /* NULL in place of the definition: its defaults */
  printf("found: the largest force left is %s 1 mN\n", report.residual < 1e-3 ? "below" : "not below");

  sinew_vec3_view nodes;
  float corner[3];
  CHECK(sinew_body_get_positions(world, beam, &nodes));
  memcpy(corner, node(nodes, nodes.count - 1), sizeof corner);
  printf("it sags: %s\n", corner[1] < 0.009f ? "yes" : "no");

  step_world(world, FRAME, 60);
  CHECK(sinew_body_get_positions(world, beam, &nodes));
  const double moved = distance(node(nodes, nodes.count - 1), corner);
  printf("movement in the next second: %s 0.1 mm\n", moved < 1e-4 ? "below" : "not below");
  sinew_world_destroy(world);
  return 0;
}
