/* Close a wound with a suture.
 *
 * A suture is a thread between two points of surfaces; it pulls and never pushes. Its length starts as the distance of
 * the points. Shorten it to draw the sides together. Points are surface triangles with three corner weights, as
 * sinew_world_find_nearest returns them.
 *
 * Output:
 *   gap before: 10.0 mm
 *   gap after: 1.0 mm
 *   the thread pulls with a force: yes
 *   torn out: 0
 */
#include "../example.h"

static void create_flap(sinew_world *world, float center) {
  const float size[2] = {0.05f, 0.05f};
  const uint32_t cells[2] = {10, 10};
  sinew_mesh *mesh;
  CHECK(sinew_mesh_create_cloth(size, cells, &mesh));
  sinew_body_def def = body_from_mesh(mesh);
  def.stiffness = 100.0f;
  def.node_mass = 1e-4f;
  def.node_damping = 1e-3f;
  float *moved = (float *)allocate(3 * def.node_count, sizeof *moved);
  for (size_t i = 0; i < 3 * def.node_count; i++) moved[i] = def.positions[i] + (i % 3 == 0 ? center : 0.0f);
  def.positions = moved;
  sinew_body_id flap;
  CHECK(sinew_body_create(world, &def, &flap));
  free(moved);
  sinew_mesh_destroy(mesh);
  for (uint32_t i = 0; i < 121; i++) /* pin the side that is far from the wound */
    if (i % 11 == (center < 0 ? 0u : 10u)) CHECK(sinew_body_pin(world, flap, i));
}

int main(void) {
  sinew_world *world = create_world(0.0f);
  create_flap(world, -0.03f);
  create_flap(world, 0.03f);

  /* The nearest surface points on the left and right of the wound, which is 10 mm wide. */
  const float near_left[3] = {-0.005f, 0, 0}, near_right[3] = {0.005f, 0, 0};
  sinew_surface_point a, b;
  a.struct_size = b.struct_size = sizeof a;
  CHECK(sinew_world_find_nearest(world, near_left, 0.01f, &a));
  CHECK(sinew_world_find_nearest(world, near_right, 0.01f, &b));

  sinew_suture_def thread;
  CHECK(sinew_suture_def_init(&thread, sizeof thread));
  thread.force_limit = 5.0f; /* N: with more it tears out */
  sinew_attachment_id suture;
  CHECK(sinew_suture_create(world, &a, &b, &thread, &suture));
  sinew_suture_report report;
  report.struct_size = sizeof report;
  CHECK(sinew_suture_get_report(world, suture, &report));
  printf("gap before: %.1f mm\n", 1e3 * report.distance);

  CHECK(sinew_suture_set_length(world, suture, 0.001f)); /* shortens over several steps, at most 0.25 m/s */
  step_world(world, FRAME, 60);
  CHECK(sinew_suture_get_report(world, suture, &report));
  printf("gap after: %.1f mm\n", 1e3 * report.distance);

  float force[3];
  CHECK(sinew_attachment_get_force(world, suture, force));
  printf("the thread pulls with a force: %s\n", force[0] > 0.01f ? "yes" : "no");
  size_t broken;
  CHECK(sinew_world_get_broken_attachments(world, NULL, 0, &broken)); /* in the last step */
  printf("torn out: %u\n", (unsigned)broken);
  sinew_world_destroy(world);
  return 0;
}
