#include <sinew.h> /* a ball sinks into a cloth that hangs by its corners */
#include <stdio.h>
#include <stdlib.h>

static void check(sinew_status status) {
  char why[256];
  if (status == SINEW_STATUS_OK) return;
  sinew_last_error(why, sizeof why), puts(why), exit(1);
}

int main(void) {
  sinew_world *world; sinew_world_def world_def;
  check(sinew_world_def_init(&world_def, sizeof world_def)); /* gravity along -y, one thread */
  check(sinew_world_create(&world_def, &world));
  const float size[2] = {0.2f, 0.2f}; const uint32_t cells[2] = {20, 20}; /* m */
  sinew_mesh *mesh; sinew_mesh_view shape; shape.struct_size = sizeof shape;
  check(sinew_mesh_create_cloth(size, cells, &mesh));
  check(sinew_mesh_get_view(mesh, &shape));
  sinew_body_id cloth; sinew_body_def body_def;
  check(sinew_body_def_init(&body_def, sizeof body_def));
  body_def.positions = shape.positions, body_def.node_count = shape.node_count;
  body_def.triangles = shape.triangles, body_def.triangle_count = shape.triangle_count;
  body_def.node_mass = 1e-4f, body_def.node_damping = 1e-3f, body_def.stiffness = 100; /* kg, N s/m, N/m */
  check(sinew_body_create(world, &body_def, &cloth)); /* its springs are the edges of its triangles */
  for (uint32_t i = 0; i < 4; i++) check(sinew_body_pin(world, cloth, i % 2 * 20 + i / 2 * 420));
  sinew_tool_id ball; sinew_tool_def tool_def; float place[3] = {0, 0.03f, 0}, force[3], torque[3];
  check(sinew_tool_def_init(&tool_def, sizeof tool_def));
  tool_def.shape = SINEW_SHAPE_SPHERE, tool_def.radius = 0.02f, tool_def.position[1] = place[1];
  check(sinew_tool_create(world, &tool_def, &ball));
  for (int frame = 0; frame < 60; frame++, place[1] -= 0.001f) {
    check(sinew_tool_set_pose(world, ball, place, NULL));
    check(sinew_world_step(world, 1.0f / 60, NULL));
  }
  sinew_vec3_view nodes; check(sinew_body_get_positions(world, cloth, &nodes)); /* borrowed, not copied */
  check(sinew_tool_get_wrench(world, ball, force, torque));
  const float *middle = nodes.data + 220 * nodes.stride / sizeof(float);
  printf("middle of the cloth at %.1f mm, force on the ball %.3f N\n", 1e3 * middle[1], force[1]);
  sinew_mesh_destroy(mesh), sinew_world_destroy(world);
}
