/* Save time where tissue is at rest.
 *
 * Parts of a body that are slower than sleep_speed for sleep_time are not stepped until something affects them. One
 * large sheet is pushed at one end: only that end wakes.
 *
 * Output:
 *   awake at first: 100 %
 *   at rest: 0 %
 *   pushed at one end, some of it wakes: yes
 *   woken by hand: 100 %
 */
#include "../example.h"

static float awake(const sinew_world *world, sinew_body_id body) {
  float share;
  CHECK(sinew_body_get_awake_share(world, body, &share));
  return 100 * share;
}

int main(void) {
  sinew_world *world = create_world(0.0f);
  const float size[2] = {1.0f, 0.1f};
  const uint32_t cells[2] = {400, 40};
  sinew_mesh *mesh;
  CHECK(sinew_mesh_create_cloth(size, cells, &mesh));
  sinew_body_def def = body_from_mesh(mesh);
  def.stiffness = 20.0f;
  def.node_mass = 1e-4f;
  def.node_damping = 1e-2f;
  def.solver = SINEW_SOLVER_VERLET; /* the others sleep as a whole */
  def.sleep_speed = 1e-3f;          /* m/s */
  def.sleep_time = 0.1f;            /* s */
  sinew_body_id sheet;
  CHECK(sinew_body_create(world, &def, &sheet));
  sinew_mesh_destroy(mesh);
  printf("awake at first: %.0f %%\n", awake(world, sheet));

  step_world(world, FRAME, 30);
  printf("at rest: %.0f %%\n", awake(world, sheet));

  const float push[3] = {0, 1e-3f, 0}; /* N */
  CHECK(sinew_body_apply_force(world, sheet, 0, push));
  step_world(world, FRAME, 1);
  const float some = awake(world, sheet);
  printf("pushed at one end, some of it wakes: %s\n", some > 0 && some < 50 ? "yes" : "no");

  CHECK(sinew_body_wake(world, sheet));
  printf("woken by hand: %.0f %%\n", awake(world, sheet));
  sinew_world_destroy(world);
  return 0;
}
