/* Find what two bodies have in common.
 *
 * A detector compares two surfaces and applies no forces: for planning, for checks of a segmentation, or for a contact
 * solver of your own. It returns the volume in common, the nodes of one body inside the other, the edges that enter it,
 * and in which directions nodes have to move to part the bodies.
 *
 * Output:
 *   overlap: 100 cm^3, out by 10 mm along -x
 *   nodes inside: yes, edges: yes
 *   against the gradient they part: yes
 */
#include "../example.h"

static sinew_body_id create_block(sinew_world *world, float center) {
  const float size[3] = {0.1f, 0.1f, 0.1f};
  const uint32_t cells[3] = {10, 10, 10};
  sinew_mesh *mesh;
  CHECK(sinew_mesh_create_block(size, cells, &mesh));
  sinew_body_def def = body_from_mesh(mesh);
  def.stiffness = 50.0f;
  def.node_mass = 1e-3f;
  def.position[0] = center; /* the body lies there from the start */
  sinew_body_id block;
  CHECK(sinew_body_create(world, &def, &block));
  sinew_mesh_destroy(mesh);
  return block;
}

int main(void) {
  sinew_world *world = create_world(0.0f);
  sinew_detector_def def;
  CHECK(sinew_detector_def_init(&def, sizeof def));
  def.bodies[0] = create_block(world, 0.0f);
  def.bodies[1] = create_block(world, 0.09f); /* 10 mm deep in the first */
  def.detection = SINEW_DETECTION_IMAGE_SPACE;
  def.pixel = 0.0005f; /* m */
  sinew_detector *detector;
  CHECK(sinew_detector_create(world, &def, &detector));

  sinew_detector_report report;
  report.struct_size = sizeof report;
  CHECK(sinew_detector_find(detector, world, &report)); /* as often as you like: it allocates nothing */
  printf("overlap: %.0f cm^3, out by %.0f mm along %s\n", 1e6 * report.volume, 1e3 * report.depth,
         report.normal[0] < -0.99f ? "-x" : "another direction");

  const sinew_point_inside *points;
  const sinew_edge_inside *edges;
  size_t point_count, edge_count;
  CHECK(sinew_detector_get_points(detector, 1, &points, &point_count)); /* side 1: nodes of the second body */
  CHECK(sinew_detector_get_edges(detector, 1, &edges, &edge_count));
  printf("nodes inside: %s, edges: %s\n", point_count > 50 ? "yes" : "no", edge_count > 50 ? "yes" : "no");

  /* How the volume grows with each node of the first body: most with those in the second, along +x. */
  sinew_dvec3_view gradient;
  CHECK(sinew_detector_get_gradient(detector, 0, &gradient));
  double sum = 0;
  for (size_t i = 0; i < gradient.count; i++)
    sum += ((const double *)(const void *)((const char *)gradient.data + i * gradient.stride))[0];
  printf("against the gradient they part: %s\n", sum > 0.009 ? "yes" : "no");
  sinew_detector_destroy(detector);
  sinew_world_destroy(world);
  return 0;
}
