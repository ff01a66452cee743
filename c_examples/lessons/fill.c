/* Fill a surface with tetrahedra.
 *
 * A closed surface, such as a segmented organ in an STL file, becomes a mesh of tetrahedra with a mean edge of your
 * choice. Keep the mesh: it has the rest positions and tetrahedra of the body, which an embedding needs.
 * Next: ../drawn.c fills a surface, makes the body and binds the surface in one call.
 *
 * Output:
 *   a surface without tetrahedra
 *   filled with tetrahedra: yes, all nodes within the surface's bounds: yes
 *   the organ weighs as much as its volume: yes
 */
#include "../example.h"

#define DENSITY 1000.0f /* kg/m^3 */

int main(void) {
  /* Yours comes from sinew_mesh_load, or from arrays in memory as here. Equal positions become one node. */
  const float h = 0.05f;
  const float positions[] = {-h, -h, -h, h, -h, -h, -h, h, -h, h, h, -h, -h, -h, h, h, -h, h, -h, h, h, h, h, h};
  const uint32_t triangles[] = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
  sinew_mesh *surface, *filled;
  sinew_mesh_view shape;
  shape.struct_size = sizeof shape;
  CHECK(sinew_mesh_create(positions, 8, triangles, 12, NULL, 0, &surface));
  CHECK(sinew_mesh_get_view(surface, &shape));
  printf("a surface %s tetrahedra\n", shape.tetrahedron_count == 0 ? "without" : "with");
  CHECK(sinew_mesh_create_filled(surface, 0.02f, &filled)); /* m: mean edge */
  sinew_mesh_destroy(surface);

  sinew_world *world = create_world(0.0f);
  sinew_body_def def = body_from_mesh(filled);
  def.material = SINEW_MATERIAL_TETRAHEDRA;
  def.young_modulus = 5000.0f;
  def.poisson_ratio = 0.4f;
  def.density = DENSITY;
  sinew_body_id organ;
  CHECK(sinew_body_create(world, &def, &organ));
  float low[3], high[3];
  CHECK(sinew_body_get_bounds(world, organ, low, high));
  int within = 1;
  for (int i = 0; i < 3; i++) within &= low[i] > -1.1f * h && high[i] < 1.1f * h;
  printf("filled with tetrahedra: %s, all nodes within the surface's bounds: %s\n", def.tetrahedron_count > 100 ? "yes" : "no",
         within ? "yes" : "no");

  float *masses = (float *)allocate(def.node_count, sizeof *masses), mass = 0;
  CHECK(sinew_body_get_masses(world, organ, masses, def.node_count));
  for (size_t i = 0; i < def.node_count; i++) mass += masses[i];
  printf("the organ weighs as much as its volume: %s\n", fabsf(mass / (DENSITY * 8 * h * h * h) - 1) < 0.05f ? "yes" : "no");
  free(masses);
  sinew_mesh_destroy(filled);
  sinew_world_destroy(world);
  return 0;
}
