/* Inflate a balloon.
 *
 * A closed surface with enclosed_stiffness or pressure encloses a cavity. sinew_body_set_pressure inflates it while the
 * world runs; the report returns its volume and pressure.
 *
 * Output:
 *   1 cavity
 *   pressure 0 Pa: volume as at rest
 *   pressure 500 Pa: volume larger
 *   pressure 1000 Pa: volume larger
 */
#include "../example.h"

int main(void) {
  sinew_world *world = create_world(0.0f);

  /* The surface of a block, as a mesh of its own: nodes inside, which no triangle uses, are left out. */
  const float size[3] = {0.1f, 0.1f, 0.1f};
  const uint32_t cells[3] = {6, 6, 6};
  sinew_mesh *solid, *surface;
  sinew_mesh_view shape;
  shape.struct_size = sizeof shape;
  CHECK(sinew_mesh_create_block(size, cells, &solid));
  CHECK(sinew_mesh_get_view(solid, &shape));
  CHECK(sinew_mesh_create(shape.positions, shape.node_count, shape.surface, shape.surface_triangle_count, NULL, 0, &surface));
  sinew_mesh_destroy(solid);

  sinew_body_def def = body_from_mesh(surface);
  def.stiffness = 200.0f;
  def.node_mass = 1e-4f;
  def.node_damping = 5e-3f;
  def.enclosed_stiffness = 1000.0f; /* Pa: resists a change of volume */
  sinew_body_id balloon;
  CHECK(sinew_body_create(world, &def, &balloon));
  sinew_mesh_destroy(surface);

  double last = 0;
  for (int pressure = 0; pressure <= 1000; pressure += 500) {
    sinew_enclosed_report report;
    report.struct_size = sizeof report;
    float set;
    CHECK(sinew_body_set_pressure(world, balloon, (float)pressure));
    CHECK(sinew_body_get_pressure(world, balloon, &set));
    step_world(world, FRAME, 60);
    CHECK(sinew_body_get_enclosed_report(world, balloon, &report));
    if (pressure == 0) printf("%u cavity\n", (unsigned)report.cavity_count);
    const double ratio = report.volume / report.rest_volume;
    printf("pressure %.0f Pa: volume %s\n", set,
           fabs(ratio - 1) < 1e-4 ? "as at rest" : report.volume > 1.01 * last ? "larger" : "not larger");
    last = report.volume;
  }
  sinew_world_destroy(world);
  return 0;
}
