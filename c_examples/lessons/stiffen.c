/* Stiffen a region of tissue at run time.
 *
 * sinew_body_scale_region multiplies the stiffness and the rest length between given nodes. Use it for a coagulated
 * spot, a swelling or a contraction. The bar hangs down from its top; its lower half becomes four times as stiff.
 *
 * Output:
 *   extension of the stiffened half: 0.25 of what it was
 *   extension of the other half: 1.00 of what it was
 */
#include "../example.h"

static void measure(const sinew_world *world, sinew_body_id bar, double extension[2]) {
  sinew_vec3_view nodes;
  CHECK(sinew_body_get_positions(world, bar, &nodes));
  extension[0] = node(nodes, 1)[1] - node(nodes, 0)[1] - 0.05; /* the lower half */
  extension[1] = node(nodes, 2)[1] - node(nodes, 1)[1] - 0.05;
}

int main(void) {
  sinew_world *world = create_world(9.81f);

  /* Three nodes one above the other, with two springs of 50 mm. Regions of large meshes work the same. */
  const float positions[9] = {0, -0.1f, 0, 0, -0.05f, 0, 0, 0, 0};
  const uint32_t springs[4] = {0, 1, 1, 2};
  sinew_body_def def;
  CHECK(sinew_body_def_init(&def, sizeof def));
  def.positions = positions;
  def.node_count = 3;
  def.springs = springs;
  def.spring_count = 2;
  def.node_mass = 0.01f;
  def.node_damping = 0.3f;
  def.stiffness = 50.0f;
  sinew_body_id bar;
  CHECK(sinew_body_create(world, &def, &bar));
  CHECK(sinew_body_pin(world, bar, 2));

  double before[2], after[2];
  step_world(world, 0.01, 500);
  measure(world, bar, before);

  const uint32_t region[2] = {0, 1}; /* what lies between these nodes changes */
  CHECK(sinew_body_scale_region(world, bar, region, 2, 4.0f, 1.0f));
  step_world(world, 0.01, 500);
  measure(world, bar, after);

  printf("extension of the stiffened half: %.2f of what it was\n", after[0] / before[0]);
  printf("extension of the other half: %.2f of what it was\n", after[1] / before[1]);
  sinew_world_destroy(world);
  return 0;
}
