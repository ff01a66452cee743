/* Look at a body when something seems wrong.
 *
 * Reports tell what a body is made of, how its solver did, and where it is strained; the log tells of refused calls
 * where they happen.
 *
 * Output:
 *   library and header have the same version: yes
 *   closed: yes; springs: 386
 *   the solver reached its accuracy: yes
 *   largest strain of the surface: 10 %
 *   the log: gravity is [0, NaN, 0]
 */
#include "../example.h"

static void log_message(void *context, uint32_t level, const char *message) {
  (void)context;
  if (level == SINEW_LOG_ERROR) printf("the log: %.*s\n", (int)strcspn(message, ":"), message);
}

int main(void) {
  printf("library and header have the same version: %s\n", sinew_version() == SINEW_VERSION ? "yes" : "no");
  sinew_world *world = create_world(0.0f);
  const float size[3] = {0.1f, 0.02f, 0.02f};
  const uint32_t cells[3] = {10, 2, 2};
  sinew_mesh *mesh;
  CHECK(sinew_mesh_create_block(size, cells, &mesh));
  sinew_body_def def = body_from_mesh(mesh);
  def.stiffness = 100.0f;
  def.node_mass = 1e-3f;
  def.node_damping = 0.1f;
  def.solver = SINEW_SOLVER_IMPLICIT;
  sinew_body_id bar;
  CHECK(sinew_body_create(world, &def, &bar));

  uint32_t is_closed;
  sinew_storage_report storage;
  storage.struct_size = sizeof storage;
  CHECK(sinew_body_is_closed(world, bar, &is_closed));
  CHECK(sinew_body_get_storage_report(world, bar, &storage));
  printf("closed: %s; springs: %u\n", is_closed ? "yes" : "no", (unsigned)storage.spring_count);

  step_world(world, FRAME, 1);
  sinew_solver_report solver;
  solver.struct_size = sizeof solver;
  CHECK(sinew_body_get_solver_report(world, bar, &solver));
  printf("the solver reached its accuracy: %s\n", solver.has_converged ? "yes" : "no");

  /* Stretched by a tenth along x. */
  float *stretched = (float *)allocate(3 * def.node_count, sizeof *stretched);
  for (size_t i = 0; i < 3 * def.node_count; i++) stretched[i] = def.positions[i] * (i % 3 == 0 ? 1.1f : 1.0f);
  CHECK(sinew_body_set_positions(world, bar, stretched, def.node_count));
  sinew_triangle_view surface;
  CHECK(sinew_body_get_triangles(world, bar, &surface));
  sinew_strain *strains = (sinew_strain *)allocate(surface.count, sizeof *strains);
  CHECK(sinew_body_get_triangle_strains(world, bar, def.positions, def.node_count, surface.data, surface.count, strains));
  float largest = 0;
  for (size_t i = 0; i < surface.count; i++) largest = fmaxf(largest, strains[i].largest);
  printf("largest strain of the surface: %.0f %%\n", 100 * largest);
  free(strains);
  free(stretched);
  sinew_mesh_destroy(mesh);

  const float gravity[3] = {0, NAN, 0};
  CHECK(sinew_set_log_callback(SINEW_LOG_WARNING, log_message, NULL));
  sinew_world_set_gravity(world, gravity); /* refused */
  sinew_log is;
  CHECK(sinew_get_log_callback(NULL, &is, NULL)); /* to set it back after one of your own */
  if (is != log_message) return 1;
  CHECK(sinew_set_log_callback(SINEW_LOG_OFF, NULL, NULL));
  sinew_world_destroy(world);
  return 0;
}
