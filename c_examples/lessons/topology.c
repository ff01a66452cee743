/* Keep GPU buffers in step with a body that is cut.
 *
 * Allocate vertex and index buffers once: sinew_body_get_max_counts returns what cuts can come to. After each cut,
 * sinew_body_get_topology_changes lists the new nodes with the nodes they came from, and the triangles that changed.
 * The arrays stand for buffers: replace the assignments by glBufferSubData or your engine's update.
 *
 * Output:
 *   first upload: 121 vertices, 200 triangles
 *   after two cuts the buffers equal the body: yes
 */
#include "../example.h"

typedef struct buffers {
  uint32_t *indices;  /* 3 per triangle */
  float *coordinates; /* 2 texture coordinates per node */
  size_t triangle_count, node_count;
  uint64_t version; /* of the topology that the buffers show */
} buffers;

static void update(buffers *gpu, const sinew_world *world, sinew_body_id body) {
  sinew_topology_changes changes;
  sinew_triangle_view triangles;
  changes.struct_size = sizeof changes;
  CHECK(sinew_body_get_topology_changes(world, body, gpu->version, &changes));
  CHECK(sinew_body_get_triangles(world, body, &triangles));
  for (size_t i = 0; i < changes.node_count; i++) { /* sources always have lower numbers */
    const sinew_new_node *added = &changes.nodes[i];
    for (int k = 0; k < 6; k++) /* 3 sources, 2 coordinates each */
      gpu->coordinates[2 * added->node + k % 2] +=
        added->weights[k / 2] * gpu->coordinates[2 * added->sources[k / 2] + k % 2];
  }
  for (size_t i = 0; i < changes.triangle_count; i++) { /* only these triangles are uploaded again */
    const size_t first = 3 * (size_t)changes.triangles[i];
    memcpy(gpu->indices + first, triangles.data + first, 3 * sizeof(uint32_t));
  }
  gpu->node_count += changes.node_count;
  gpu->triangle_count = triangles.count;
  gpu->version = changes.version;
}

int main(void) {
  sinew_world *world = create_world(0.0f);
  sinew_mesh *mesh = cloth_mesh(0.1f, 10);
  sinew_body_def def = body_from_mesh(mesh);
  def.stiffness = 50.0f;
  def.node_mass = 1e-4f;
  def.spare_nodes = 1000;
  sinew_body_id sheet;
  CHECK(sinew_body_create(world, &def, &sheet));
  buffers gpu = {NULL, NULL, def.triangle_count, def.node_count, 0};
  uint32_t max_nodes, max_triangles;
  CHECK(sinew_body_get_max_counts(world, sheet, &max_nodes, &max_triangles));
  gpu.indices = (uint32_t *)allocate(3 * (size_t)max_triangles, sizeof(uint32_t));
  gpu.coordinates = (float *)allocate(2 * (size_t)max_nodes, sizeof(float));
  memcpy(gpu.indices, def.triangles, 3 * def.triangle_count * sizeof(uint32_t));
  for (size_t i = 0; i < 2 * def.node_count; i++) /* u from x, v from z */
    gpu.coordinates[i] = def.positions[3 * (i / 2) + 2 * (i % 2)] / 0.1f + 0.5f;
  printf("first upload: %u vertices, %u triangles\n", (unsigned)gpu.node_count, (unsigned)gpu.triangle_count);
  sinew_mesh_destroy(mesh);

  for (int cut = 0; cut < 2; cut++) {
    const float x = cut == 0 ? -0.013f : 0.022f;
    const float start[6] = {x, -0.01f, -0.03f, x, 0.01f, -0.03f};
    const float end[6] = {x, -0.01f, 0.06f, x, 0.01f, 0.06f};
    CHECK(sinew_body_cut(world, sheet, start, end, NULL));
    update(&gpu, world, sheet);
  }

  sinew_triangle_view triangles;
  sinew_vec3_view nodes;
  CHECK(sinew_body_get_triangles(world, sheet, &triangles));
  CHECK(sinew_body_get_positions(world, sheet, &nodes));
  const int same = gpu.node_count == nodes.count && gpu.triangle_count == triangles.count &&
                   memcmp(gpu.indices, triangles.data, 3 * triangles.count * sizeof(uint32_t)) == 0;
  printf("after two cuts the buffers equal the body: %s\n", same ? "yes" : "no");
  free(gpu.indices);
  free(gpu.coordinates);
  sinew_world_destroy(world);
  return 0;
}
