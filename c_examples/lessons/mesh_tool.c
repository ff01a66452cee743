/* Press a tool with a shape of its own into tissue.
 *
 * A mesh tool is any closed surface: load it with sinew_mesh_load, or make one. The tool reports its contacts and the
 * total force on it. Next: grasp.c holds the tissue that a tool touches.
 *
 * Output:
 *   the tool touches the block: yes
 *   contact forces and wrench agree: yes
 *   tissue pushes the tool up: yes
 */
#include "../example.h"

int main(void) {
  sinew_world *world = create_world(0.0f);

  /* Tissue: a block of 80 x 40 x 80 mm with the stiffness of a liver, pinned at its bottom. */
  const float size[3] = {0.08f, 0.04f, 0.08f};
  const uint32_t cells[3] = {8, 4, 8};
  sinew_mesh *mesh;
  CHECK(sinew_mesh_create_block(size, cells, &mesh));
  sinew_body_def def = body_from_mesh(mesh);
  def.material = SINEW_MATERIAL_SPRINGS;
  def.young_modulus = 5400.0f;
  def.density = 1060.0f;
  def.retardation_time = 0.005f;
  sinew_body_id block;
  CHECK(sinew_body_create(world, &def, &block));
  sinew_mesh_destroy(mesh);
  pin_below(world, block, 1, -0.019f);

  /* Tool: a small cube. Use `surface` of a mesh, which is closed and turned outward. */
  const float tool_size[3] = {0.02f, 0.02f, 0.02f};
  const uint32_t one[3] = {1, 1, 1};
  sinew_mesh_view shape;
  shape.struct_size = sizeof shape;
  CHECK(sinew_mesh_create_block(tool_size, one, &mesh));
  CHECK(sinew_mesh_get_view(mesh, &shape));
  sinew_tool_def tool_def;
  CHECK(sinew_tool_def_init(&tool_def, sizeof tool_def));
  tool_def.shape = SINEW_SHAPE_MESH;
  tool_def.positions = shape.positions;
  tool_def.node_count = shape.node_count;
  tool_def.triangles = shape.surface;
  tool_def.triangle_count = shape.surface_triangle_count;
  tool_def.position[1] = 0.035f; /* 5 mm above the block */
  tool_def.friction = 0.3f;
  sinew_tool_id tool;
  CHECK(sinew_tool_create(world, &tool_def, &tool));
  sinew_mesh_destroy(mesh);

  float position[3] = {0, 0.035f, 0}, force[3], torque[3];
  for (int i = 0; i < 50; i++) {
    position[1] -= 0.0002f; /* down by 10 mm in half a second */
    CHECK(sinew_tool_set_pose(world, tool, position, NULL));
    CHECK(sinew_world_step(world, 0.01f, NULL));
  }
  step_world(world, 0.01, 50); /* wait until the tissue rests */

  sinew_contact contacts[256];
  size_t count;
  CHECK(sinew_tool_get_contacts(world, tool, contacts, 256, &count));
  CHECK(sinew_tool_get_wrench(world, tool, force, torque));
  double sum = 0;
  for (size_t i = 0; i < count && i < 256; i++) sum += contacts[i].force[1];
  printf("the tool touches the block: %s\n", count > 0 ? "yes" : "no");
  printf("contact forces and wrench agree: %s\n", fabs(sum - force[1]) < 0.05 * fabs(force[1]) ? "yes" : "no");
  printf("tissue pushes the tool up: %s\n", force[1] > 0.05f ? "yes" : "no");
  sinew_world_destroy(world);
  return 0;
}
