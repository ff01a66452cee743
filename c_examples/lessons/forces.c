/* Push tissue: forces, impulses, velocities, gravity.
 *
 * Forces act over the next step and are then gone; apply them again before each step. Impulses change velocities at
 * once. A cube of 27 nodes of 1 g floats in space here.
 *
 * Output:
 *   a force of 27 mN for 1 s: 1.00 m/s
 *   an impulse of 27 mN s against it: 0.00 m/s
 *   twice the gravity, times -0.5: 0.98 m/s upward after 0.1 s, 0.05 m/s with the wind
 *   set to rest and moved by 1 m: 1.00 m away
 */
#include "../example.h"

#define NODES 27u

/* The mean velocity of all nodes along an axis [m/s]. */
static float speed(const sinew_world *world, sinew_body_id body, int axis) {
  sinew_vec3_view velocities;
  float sum = 0;
  CHECK(sinew_body_get_velocities(world, body, &velocities));
  for (size_t i = 0; i < velocities.count; i++) sum += node(velocities, i)[axis];
  return sum / (float)velocities.count;
}

int main(void) {
  sinew_world *world = create_world(0.0f);
  const float size[3] = {0.1f, 0.1f, 0.1f};
  const uint32_t cells[3] = {2, 2, 2};
  sinew_mesh *mesh;
  CHECK(sinew_mesh_create_block(size, cells, &mesh));
  sinew_body_def def = body_from_mesh(mesh);
  def.stiffness = 50.0f;
  def.node_mass = 1e-3f;
  sinew_body_id cube;
  CHECK(sinew_body_create(world, &def, &cube));
  sinew_mesh_destroy(mesh);

  uint32_t all[NODES];
  float each[3 * NODES] = {0};
  for (uint32_t i = 0; i < NODES; i++) all[i] = i, each[3 * i] = 1e-3f;
  for (int step = 0; step < 60; step++) {
    CHECK(sinew_body_apply_forces(world, cube, all, each, NODES)); /* N; sinew_body_apply_force takes one node */
    CHECK(sinew_world_step(world, 1.0f / 60, NULL));
  }
  printf("a force of 27 mN for 1 s: %.2f m/s\n", speed(world, cube, 0));

  for (uint32_t i = 0; i < NODES; i++) each[3 * i] = -1e-3f;
  CHECK(sinew_body_apply_impulses(world, cube, all, each, NODES)); /* N s */
  printf("an impulse of 27 mN s against it: %.2f m/s\n", fabsf(speed(world, cube, 0)));

  /* Gravity of the world, and the factor of one body. */
  float gravity[3] = {0, -9.81f, 0}, scale;
  CHECK(sinew_world_set_gravity(world, gravity));
  CHECK(sinew_world_get_gravity(world, gravity));
  gravity[1] *= 2;
  CHECK(sinew_world_set_gravity(world, gravity));
  CHECK(sinew_body_set_gravity_scale(world, cube, -0.5f));
  CHECK(sinew_body_get_gravity_scale(world, cube, &scale));
  const float wind[3] = {0.5f, 0, 0};
  CHECK(sinew_body_set_acceleration(world, cube, wind)); /* m/s^2, beside gravity, until it is set again */
  CHECK(sinew_body_get_acceleration(world, cube, gravity));
  step_world(world, 0.01, 10);
  printf("twice the gravity, times %.1f: %.2f m/s upward after 0.1 s, %.2f m/s with the wind\n", scale, speed(world, cube, 1),
         speed(world, cube, 0));

  const float rest[3 * NODES] = {0}, shift[3] = {1, 0, 0};
  sinew_vec3_view nodes;
  float before[3];
  CHECK(sinew_body_set_velocities(world, cube, rest, NODES));
  CHECK(sinew_body_get_positions(world, cube, &nodes));
  memcpy(before, node(nodes, 0), sizeof before);
  CHECK(sinew_body_transform(world, cube, shift, NULL, NULL)); /* and a rotation, where it is not NULL */
  CHECK(sinew_body_get_positions(world, cube, &nodes));
  printf("set to rest and moved by 1 m: %.2f m away\n", distance(before, node(nodes, 0)));
  const float push[3] = {0, 1e-3f, 0};
  CHECK(sinew_body_apply_force(world, cube, 0, push));
  sinew_world_destroy(world);
  return 0;
}
