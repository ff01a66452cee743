/* Choose which objects collide.
 *
 * Each body, tool and blade has a category and a mask, which are sets of bits. Two objects collide if each has a category
 * in the mask of the other. Here one ball collides with the cloth and one passes through it.
 *
 * Output:
 *   ball of category 2: force upward
 *   ball of category 4: no force
 */
#include "../example.h"

#define CLOTH 1u
#define INSTRUMENT 2u
#define GHOST 4u

int main(void) {
  sinew_world *world = create_world(0.0f);
  const float size[2] = {0.2f, 0.1f};
  const uint32_t cells[2] = {20, 10};
  sinew_mesh *mesh;
  CHECK(sinew_mesh_create_cloth(size, cells, &mesh));
  sinew_body_def def = body_from_mesh(mesh);
  def.stiffness = 100.0f;
  def.node_mass = 1e-4f;
  def.node_damping = 1e-3f;
  def.collision_category = CLOTH;
  def.collision_mask = INSTRUMENT; /* a ghost is not in it */
  sinew_body_id cloth;
  CHECK(sinew_body_create(world, &def, &cloth));
  sinew_mesh_destroy(mesh);
  pin_below(world, cloth, 0, -0.099f);
  for (uint32_t row = 0; row < 11; row++) CHECK(sinew_body_pin(world, cloth, row * 21 + 20));

  sinew_tool_id balls[2];
  for (int i = 0; i < 2; i++) {
    sinew_tool_def ball;
    CHECK(sinew_tool_def_init(&ball, sizeof ball));
    ball.radius = 0.01f;
    ball.position[0] = i == 0 ? -0.04f : 0.04f;
    ball.position[1] = 0.02f;
    ball.collision_category = i == 0 ? INSTRUMENT : GHOST;
    ball.collision_mask = CLOTH;
    CHECK(sinew_tool_create(world, &ball, &balls[i]));
  }
  for (int step = 1; step <= 40; step++) {
    for (int i = 0; i < 2; i++) {
      const float position[3] = {i == 0 ? -0.04f : 0.04f, 0.02f - 0.0005f * (float)step, 0};
      CHECK(sinew_tool_set_pose(world, balls[i], position, NULL));
    }
    CHECK(sinew_world_step(world, 0.01f, NULL));
  }
  for (int i = 0; i < 2; i++) {
    float force[3], torque[3];
    CHECK(sinew_tool_get_wrench(world, balls[i], force, torque));
    const char *felt = force[1] > 0.001f ? "force upward" : force[1] == 0.0f ? "no force" : "force downward";
    printf("ball of category %u: %s\n", i == 0 ? INSTRUMENT : GHOST, felt);
  }
  sinew_world_destroy(world);
  return 0;
}
