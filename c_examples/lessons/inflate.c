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

  /* The surface of a block, without its inside. */
  const float size[3] = {0.1f, 0.1f, 0.1f};
  const uint32_t cells[3] = {6, 6, 6};
  sinew_mesh *mesh;
  sinew_mesh_view shape;
  shape.struct_size = sizeof shape;
  CHECK(sinew_mesh_create_block(size, cells, &mesh));
  CHECK(sinew_mesh_get_view(mesh, &shape));

  /* A surface must not have nodes inside, so keep those that triangles use and number them again. */
  float *positions = (float *)allocate(3 * shape.node_count, sizeof *positions);
  uint32_t *triangles = (uint32_t *)allocate(3 * shape.surface_triangle_count, sizeof *triangles);
  uint32_t *number = (uint32_t *)allocate(shape.node_count, sizeof *number); /* 0: not yet used */
  uint32_t count = 0;
  for (size_t i = 0; i < 3 * shape.surface_triangle_count; i++) {
    const uint32_t old = shape.surface[i];
    if (number[old] == 0) {
      memcpy(positions + 3 * (size_t)count, shape.positions + 3 * (size_t)old, 3 * sizeof(float));
      number[old] = ++count;
    }
    triangles[i] = number[old] - 1;
  }

  sinew_body_def def;
  CHECK(sinew_body_def_init(&def, sizeof def));
  def.positions = positions;
  def.node_count = count;
  def.triangles = triangles;
  def.triangle_count = shape.surface_triangle_count;
  def.stiffness = 200.0f;
  def.node_mass = 1e-4f;
  def.node_damping = 5e-3f;
  def.enclosed_stiffness = 1000.0f; /* Pa: resists a change of volume */
  sinew_body_id balloon;
  CHECK(sinew_body_create(world, &def, &balloon));
  free(positions);
  free(triangles);
  free(number);
  sinew_mesh_destroy(mesh);

  double last = 0;
  for (int pressure = 0; pressure <= 1000; pressure += 500) {
    sinew_enclosed_report report;
    report.struct_size = sizeof report;
    CHECK(sinew_body_set_pressure(world, balloon, (float)pressure));
    step_world(world, FRAME, 60);
    CHECK(sinew_body_get_enclosed_report(world, balloon, &report));
    if (pressure == 0) printf("%u cavity\n", (unsigned)report.cavity_count);
    const double ratio = report.volume / report.rest_volume;
    printf("pressure %d Pa: volume %s\n", pressure,
           fabs(ratio - 1) < 1e-4 ? "as at rest" : report.volume > 1.01 * last ? "larger" : "not larger");
    last = report.volume;
  }
  sinew_world_destroy(world);
  return 0;
}
