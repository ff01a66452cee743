/* Press an organ with a ball and read the force.
 *
 * Start here: a mesh, a material from laboratory values, a body in its world, pins, a tool, and a loop of steps.
 * docs/tutorials/press_an_organ.md explains each part. Next: mesh_tool.c, cut.c.
 *
 * Output:
 *   the ball rests 6 mm deep
 *   the tissue pushes back with 0.5 N
 *   the pins carry that force: yes
 */
#include "../example.h"

int main(void) {
  sinew_world *world = create_world(0.0f); /* without gravity the organ keeps its shape until it is pressed */

  /* The mesh: a generated organ, 120 mm long. sinew_mesh_load reads yours from a file. */
  sinew_mesh *mesh;
  CHECK(sinew_mesh_create_organ(0.12f, 0.012f, &mesh));

  /* The material: finite elements with the values of a healthy liver. */
  sinew_material_preset liver;
  liver.struct_size = sizeof liver;
  CHECK(sinew_material_get_preset(SINEW_PRESET_LIVER, &liver));
  sinew_body_def def;
  CHECK(sinew_body_def_init(&def, sizeof def));
  CHECK(sinew_body_def_set_mesh(&def, mesh));
  def.material = SINEW_MATERIAL_TETRAHEDRA;
  def.young_modulus = liver.young_modulus; /* Pa */
  def.poisson_ratio = 0.4f;
  def.density = liver.density;             /* kg/m3 */
  def.retardation_time = 0.01f;            /* s: a little viscosity, so that the organ comes to rest */
  sinew_body_id organ;
  CHECK(sinew_body_create(world, &def, &organ));
  sinew_mesh_destroy(mesh);

  /* The support: nodes at the lower side are pinned. */
  sinew_vec3_view nodes;
  CHECK(sinew_body_get_positions(world, organ, &nodes));
  float low = 1, high = -1;
  for (size_t i = 0; i < nodes.count; i++) {
    const float *p = node(nodes, i);
    low = fminf(low, p[1]);
    if (hypotf(p[0], p[2]) < 0.008f) high = fmaxf(high, p[1]); /* the top of the organ in its middle */
  }
  pin_below(world, organ, 1, low + 0.006f);

  /* The tool: a ball above the middle. */
  sinew_tool_def tool_def;
  CHECK(sinew_tool_def_init(&tool_def, sizeof tool_def));
  tool_def.shape = SINEW_SHAPE_SPHERE;
  tool_def.radius = 0.01f;
  tool_def.position[1] = high + 0.011f;
  sinew_tool_id ball;
  CHECK(sinew_tool_create(world, &tool_def, &ball));

  /* The loop: move the ball, step, read. */
  float place[3] = {0, tool_def.position[1], 0}, force[3];
  for (int frame = 0; frame < 120; frame++) {
    if (frame < 35) place[1] -= 0.0002f; /* 12 mm/s, until it is 6 mm below the surface */
    CHECK(sinew_tool_set_pose(world, ball, place, NULL));
    CHECK(sinew_world_step(world, (float)FRAME, NULL));
  }
  CHECK(sinew_tool_get_wrench(world, ball, force, NULL)); /* N; the torque is not needed */

  double held = 0; /* along y */
  CHECK(sinew_body_get_positions(world, organ, &nodes));
  for (uint32_t i = 0; i < nodes.count; i++) {
    float pin[3];
    if (sinew_body_get_pin_force(world, organ, i, pin) == SINEW_STATUS_OK) held += pin[1];
  }
  printf("the ball rests %.0f mm deep\n", 1e3 * (high - (place[1] - 0.01f)));
  printf("the tissue pushes back with %.1f N\n", force[1]);
  printf("the pins carry that force: %s\n", fabs(held - force[1]) < 0.02 * force[1] ? "yes" : "no");
  sinew_world_destroy(world);
  return 0;
}
