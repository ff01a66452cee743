/* Draw a fine surface on a coarse body.
 *
 * An embedding binds each vertex of a render mesh to the body's tetrahedra. Simulate few nodes, update the embedding
 * after each step, and draw its positions and normals.
 *
 * Output:
 *   525 nodes move 12221 vertices
 *   vertices follow the body: yes
 *   normals have length 1: yes
 *   positions of yours draw it 1 m away: yes
 */
#include "../example.h"

int main(void) {
  sinew_world *world = create_world(9.81f);
  const float size[3] = {0.2f, 0.04f, 0.04f};

  /* The body: coarse tetrahedra, fixed at one end. */
  const uint32_t coarse_cells[3] = {20, 4, 4};
  sinew_mesh *coarse, *fine;
  CHECK(sinew_mesh_create_block(size, coarse_cells, &coarse));
  sinew_body_def def = body_from_mesh(coarse);
  def.material = SINEW_MATERIAL_SPRINGS;
  def.young_modulus = 2e4f;
  def.density = 1000.0f;
  sinew_body_id bar;
  CHECK(sinew_body_create(world, &def, &bar));
  pin_below(world, bar, 0, -0.099f);

  /* The render mesh: the same shape with more vertices. Yours comes from an artist. */
  const uint32_t fine_cells[3] = {100, 10, 10};
  sinew_mesh_view shape;
  shape.struct_size = sizeof shape;
  CHECK(sinew_mesh_create_block(size, fine_cells, &fine));
  CHECK(sinew_mesh_get_view(fine, &shape));
  sinew_embedding_def drawn_def;
  CHECK(sinew_embedding_def_init(&drawn_def, sizeof drawn_def));
  drawn_def.vertices = shape.positions;
  drawn_def.vertex_count = shape.node_count;
  drawn_def.triangles = shape.surface;
  drawn_def.triangle_count = shape.surface_triangle_count;
  drawn_def.tetrahedra = def.tetrahedra;
  drawn_def.tetrahedron_count = def.tetrahedron_count;
  sinew_embedding *drawn;
  CHECK(sinew_embedding_create(world, bar, &drawn_def, &drawn));
  printf("%u nodes move %u vertices\n", (unsigned)def.node_count, (unsigned)shape.node_count);
  sinew_mesh_destroy(coarse);
  sinew_mesh_destroy(fine);

  for (int frame = 0; frame < 15; frame++) {
    CHECK(sinew_world_step(world, (float)FRAME, NULL));
    CHECK(sinew_embedding_update(drawn, world)); /* then upload positions and normals */
  }

  sinew_vec3_view nodes, vertices, normals;
  CHECK(sinew_body_get_positions(world, bar, &nodes));
  CHECK(sinew_embedding_get_positions(drawn, &vertices));
  CHECK(sinew_embedding_get_normals(drawn, &normals));
  /* The last node and the last vertex are the same corner of the free end. */
  const double apart = distance(node(nodes, nodes.count - 1), node(vertices, vertices.count - 1));
  const float zero[3] = {0, 0, 0};
  const double length = distance(node(normals, normals.count - 1), zero);
  printf("vertices follow the body: %s\n", apart < 1e-5 && node(nodes, nodes.count - 1)[1] < 0.015f ? "yes" : "no");
  printf("normals have length 1: %s\n", fabs(length - 1) < 1e-5 ? "yes" : "no");

  /* Any positions: those of a reader's frame, or a blend of two steps. */
  const size_t count = 3 * nodes.count;
  float *shifted = (float *)allocate(count, sizeof *shifted);
  for (size_t i = 0; i < count; i++) shifted[i] = node(nodes, i / 3)[i % 3] + (i % 3 == 0 ? 1.0f : 0.0f);
  float corner[3];
  memcpy(corner, node(vertices, 0), sizeof corner);
  CHECK(sinew_embedding_update_from(drawn, shifted, nodes.count));
  CHECK(sinew_embedding_get_positions(drawn, &vertices));
  printf("positions of yours draw it 1 m away: %s\n", fabs(distance(node(vertices, 0), corner) - 1) < 1e-5 ? "yes" : "no");
  free(shifted);
  sinew_embedding_destroy(drawn);
  sinew_world_destroy(world);
  return 0;
}
