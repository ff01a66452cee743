/* Hold tissue: several nodes, a box, or along some axes only.
 *
 * A pinned node stays where it is, or moves with sinew_body_move_pin. Pins along some axes let a node slide along the
 * others. The forces of the pins carry what they hold.
 *
 * Output:
 *   pinned: 11 nodes of the left side, 22 with the right
 *   the pins carry the weight: yes
 *   one side let go: 11 pins left, the middle falls: yes
 *   on rails it falls without moving along x or z: yes
 */
#include "../example.h"

#define SIDE 11u /* nodes along each side of the sheet */
#define NODES (SIDE * SIDE)

int main(void) {
  sinew_world *world = create_world(10.0f);
  sinew_mesh *mesh = cloth_mesh(0.1f, SIDE - 1);
  sinew_body_def def = body_from_mesh(mesh);
  def.stiffness = 100.0f;
  def.node_mass = 1e-4f;
  def.damping_rate = 20.0f; /* 1/s */
  sinew_body_id sheet;
  CHECK(sinew_body_create(world, &def, &sheet));
  sinew_mesh_destroy(mesh);

  /* A list of nodes, and all nodes in a box. */
  uint32_t left[SIDE];
  for (uint32_t i = 0; i < SIDE; i++) left[i] = SIDE * i;
  CHECK(sinew_body_pin_nodes(world, sheet, left, SIDE));
  const float low[3] = {0.049f, -1, -1}, high[3] = {1, 1, 1};
  size_t right = 0;
  CHECK(sinew_body_pin_box(world, sheet, low, high, &right));
  printf("pinned: %u nodes of the left side, %u with the right\n", SIDE, SIDE + (unsigned)right);

  step_world(world, FRAME, 120);
  float forces[3 * NODES], masses[NODES], carried = 0, weight = 0;
  CHECK(sinew_body_get_pin_forces(world, sheet, forces, NODES));
  CHECK(sinew_body_get_masses(world, sheet, masses, NODES));
  for (uint32_t i = 0; i < NODES; i++) carried += forces[3 * i + 1], weight += 10.0f * masses[i];
  printf("the pins carry the weight: %s\n", fabsf(carried - weight) < 0.02f * weight ? "yes" : "no");

  sinew_vec3_view nodes;
  CHECK(sinew_body_get_positions(world, sheet, &nodes));
  float before[3];
  memcpy(before, node(nodes, NODES / 2), sizeof before);
  CHECK(sinew_body_unpin_box(world, sheet, low, high, &right));
  step_world(world, FRAME, 10);
  CHECK(sinew_body_get_positions(world, sheet, &nodes));
  const int falls = node(nodes, NODES / 2)[1] < before[1] - 0.01f;
  printf("one side let go: %u pins left, the middle falls: %s\n", SIDE, falls ? "yes" : "no");

  /* All nodes on vertical rails: free along y. */
  CHECK(sinew_body_unpin_nodes(world, sheet, left, SIDE));
  for (uint32_t i = 0; i < NODES; i++) CHECK(sinew_body_pin_axes(world, sheet, i, SINEW_AXIS_X | SINEW_AXIS_Z));
  memcpy(before, node(nodes, 0), sizeof before);
  step_world(world, FRAME, 10);
  CHECK(sinew_body_get_positions(world, sheet, &nodes));
  const float *after = node(nodes, 0);
  const int slid = after[1] < before[1] - 0.01f && fabsf(after[0] - before[0]) < 1e-6f && fabsf(after[2] - before[2]) < 1e-6f;
  printf("on rails it falls without moving along x or z: %s\n", slid ? "yes" : "no");
  CHECK(sinew_body_unpin(world, sheet, 0)); /* one node, along all axes */
  sinew_world_destroy(world);
  return 0;
}
