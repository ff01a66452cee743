/* Read and change single springs while the body runs.
 *
 * Each pair of nodes has one spring at most. Muscles contract by shorter rest lengths; damage is less stiffness; a spring
 * that is added holds two nodes together.
 *
 * Output:
 *   a chain of 4 springs of 20 mm, the first with 50 N/m
 *   with half the rest length: 10 mm long, strain below 1 %
 *   a ring has 5 springs, without one again 4
 */
#include "../example.h"

static size_t spring_count(const sinew_world *world, sinew_body_id body) {
  sinew_storage_report storage;
  storage.struct_size = sizeof storage;
  CHECK(sinew_body_get_storage_report(world, body, &storage));
  return storage.spring_count;
}

int main(void) {
  sinew_world *world = create_world(0.0f);
  const float positions[] = {0, 0, 0, 0.02f, 0, 0, 0.04f, 0, 0, 0.06f, 0, 0, 0.08f, 0, 0};
  const uint32_t springs[] = {0, 1, 1, 2, 2, 3, 3, 4};
  sinew_body_def def;
  CHECK(sinew_body_def_init(&def, sizeof def));
  def.positions = positions;
  def.node_count = 5;
  def.node_mass = 1e-3f;
  def.node_damping = 0.1f;
  def.springs = springs;
  def.spring_count = 4;
  def.stiffness = 50.0f;
  sinew_body_id chain;
  CHECK(sinew_body_create(world, &def, &chain));
  CHECK(sinew_body_pin(world, chain, 0));

  uint32_t pairs[8];
  float stiffnesses[4], lengths[4], strains[4];
  CHECK(sinew_body_get_spring_pairs(world, chain, pairs, 4));
  CHECK(sinew_body_get_springs(world, chain, pairs, 4, stiffnesses, lengths));
  printf("a chain of %u springs of %.0f mm, the first with %.0f N/m\n", (unsigned)spring_count(world, chain),
         1e3 * lengths[0], stiffnesses[0]);

  for (int i = 0; i < 4; i++) lengths[i] *= 0.5f;
  CHECK(sinew_body_set_springs(world, chain, pairs, NULL, lengths, 4)); /* NULL: the stiffnesses stay */
  step_world(world, FRAME, 120);
  CHECK(sinew_body_get_spring_strains(world, chain, pairs, NULL, 4, strains));
  sinew_vec3_view nodes;
  CHECK(sinew_body_get_positions(world, chain, &nodes));
  float largest = 0;
  for (int i = 0; i < 4; i++) largest = fmaxf(largest, fabsf(strains[i]));
  printf("with half the rest length: %.0f mm long, strain %s 1 %%\n", 1e3 * distance(node(nodes, 0), node(nodes, 1)),
         largest < 0.01f ? "below" : "not below");

  CHECK(sinew_body_add_spring(world, chain, 4, 0, 50.0f, -1.0f)); /* -1: as long as it is now */
  const size_t ring = spring_count(world, chain);
  CHECK(sinew_body_remove_spring(world, chain, 0, 4));
  printf("a ring has %u springs, without one again %u\n", (unsigned)ring, (unsigned)spring_count(world, chain));
  sinew_world_destroy(world);
  return 0;
}
