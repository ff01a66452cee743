/* Let gravity and tissue move a tool with a mass.
 *
 * A ball falls on a cloth that hangs at its corners, whose nodes have 0.1 kg each. Contact is solved for the ball and the nodes
 * together, so that a ball lighter than a node is not flung away. At rest the cloth carries the weight of the ball. Then a
 * force lifts the ball, as a motor or the joint of another engine would.
 *
 * Output:
 *   ball of 0.01 kg: rests, carried with its weight; lifted: off the cloth
 *   ball of 0.1 kg: rests, carried with its weight; lifted: off the cloth
 *   ball of 1 kg: rests, carried with its weight; lifted: off the cloth
 */
#include "../example.h"

static void drop(float mass) {
  sinew_world *world = create_world(9.81f);
  const float size[2] = {1.1f, 1.1f};
  const uint32_t cells[2] = {11, 11};
  sinew_mesh *mesh;
  CHECK(sinew_mesh_create_cloth(size, cells, &mesh));
  sinew_body_def def = body_from_mesh(mesh);
  def.node_mass = 0.1f;
  def.node_damping = 0.5f;
  def.stiffness = 1777.0f;
  def.spring_damping = 19.0f;
  sinew_body_id cloth;
  CHECK(sinew_body_create(world, &def, &cloth));
  sinew_mesh_destroy(mesh);
  const uint32_t corners[4] = {0, 11, 132, 143};
  for (int i = 0; i < 4; i++) CHECK(sinew_body_pin(world, cloth, corners[i]));

  sinew_tool_def tool;
  CHECK(sinew_tool_def_init(&tool, sizeof tool));
  tool.radius = 0.15f;
  tool.position[1] = 0.45f;
  sinew_tool_id ball;
  CHECK(sinew_tool_create(world, &tool, &ball));
  /* The shape gives the inertia for a density; the density of this ball is such that it has the mass. */
  sinew_mass_properties properties;
  properties.struct_size = sizeof properties;
  CHECK(sinew_tool_get_mass_of_density(world, ball, mass / 0.0141372f, &properties));
  CHECK(sinew_tool_set_mass(world, ball, &properties));
  CHECK(sinew_tool_get_mass(world, ball, &properties));
  const float thrown[3] = {0, -0.5f, 0}, spin[3] = {0, 1, 0};
  CHECK(sinew_tool_set_velocity(world, ball, thrown, spin)); /* m/s, rad/s */

  float position[3], velocity[3], force[3];
  for (int step = 0; step < 600; step++) CHECK(sinew_world_step(world, 1.0f / 60.0f, NULL));
  CHECK(sinew_tool_get_velocity(world, ball, velocity, NULL));
  CHECK(sinew_tool_get_wrench(world, ball, force, NULL));
  float weight = 9.81f * mass;
  printf("ball of %g kg: %s, %s; ", mass, velocity[1] < 0.01f && velocity[1] > -0.01f ? "rests" : "moves",
         force[1] > 0.97f * weight && force[1] < 1.03f * weight ? "carried with its weight" : "not carried");

  const float lift[3] = {0, 2 * weight, 0}, none[3] = {0, 0, 0};
  for (int step = 0; step < 30; step++) {
    CHECK(sinew_tool_apply_wrench(world, ball, lift, none)); /* for one step */
    CHECK(sinew_world_step(world, 1.0f / 60.0f, NULL));
  }
  CHECK(sinew_tool_get_pose(world, ball, position, NULL));
  CHECK(sinew_tool_get_wrench(world, ball, force, NULL));
  printf("lifted: %s\n", position[1] > 0.5f && force[1] == 0.0f ? "off the cloth" : "still on the cloth");
  sinew_world_destroy(world);
}

int main(void) {
  drop(0.01f);
  drop(0.1f);
  drop(1.0f);
  return 0;
}
