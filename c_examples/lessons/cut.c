/* Cut a sheet in two.
 *
 * A body can be cut if its definition reserves spare_nodes. sinew_body_cut takes the edge of a blade where a stroke
 * starts and where it ends, and opens the surface between them. Next: blade.c feels the resistance.
 *
 * Output:
 *   cut 100 mm long
 *   pieces: 1 before, 2 after
 *   the loose half has fallen: yes
 */
#include "../example.h"

int main(void) {
  sinew_world *world = create_world(9.81f);

  /* A sheet in the plane y = 0; nodes at its left border are pinned. */
  sinew_mesh *mesh = cloth_mesh(0.1f, 10);
  sinew_body_def def = body_from_mesh(mesh);
  def.stiffness = 50.0f;      /* N/m */
  def.node_mass = 1e-4f;      /* kg */
  def.node_damping = 1e-3f;   /* N s/m */
  def.spare_nodes = 500;      /* room for what cuts add: about five per triangle */
  sinew_body_id sheet;
  CHECK(sinew_body_create(world, &def, &sheet));
  sinew_mesh_destroy(mesh);
  pin_below(world, sheet, 0, -0.049f);

  uint32_t before, after;
  CHECK(sinew_body_get_pieces(world, sheet, NULL, 0, &before));

  /* The edge stands upright and moves along z, 3 mm to the right of the middle: two end points, then two more. */
  const float start[6] = {0.003f, -0.02f, -0.06f, 0.003f, 0.02f, -0.06f};
  const float end[6] = {0.003f, -0.02f, 0.06f, 0.003f, 0.02f, 0.06f};
  sinew_cut_report report;
  report.struct_size = sizeof report;
  CHECK(sinew_body_cut(world, sheet, start, end, &report));
  CHECK(sinew_body_get_pieces(world, sheet, NULL, 0, &after));

  step_world(world, FRAME, 30);
  sinew_vec3_view nodes;
  CHECK(sinew_body_get_positions(world, sheet, &nodes));

  printf("cut %.0f mm long\n", 1e3 * report.length);
  printf("pieces: %u before, %u after\n", before, after);
  printf("the loose half has fallen: %s\n", node(nodes, 10)[1] < -0.3f ? "yes" : "no"); /* node 10: a right corner */
  sinew_world_destroy(world);
  return 0;
}
