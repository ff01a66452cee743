/* Grasp tissue, lift it and let it go.
 *
 * Attachments hold nodes on a tool; their forces are part of the tool's wrench. This is how a forceps holds tissue, and
 * how a mouse drags it. Next: suture.c joins tissue to tissue.
 *
 * Output:
 *   9 nodes attached
 *   lifted by 20.0 mm
 *   the tissue pulls the tool down: yes
 *   after release it springs back: yes
 */
#include "../example.h"

int main(void) {
  sinew_world *world = create_world(0.0f);
  const float size[3] = {0.08f, 0.02f, 0.08f};
  const uint32_t cells[3] = {8, 2, 8};
  sinew_mesh *mesh;
  CHECK(sinew_mesh_create_block(size, cells, &mesh));
  sinew_body_def def = body_from_mesh(mesh);
  def.material = SINEW_MATERIAL_SPRINGS;
  def.young_modulus = 5400.0f;
  def.density = 1060.0f;
  def.retardation_time = 0.01f;
  sinew_body_id tissue;
  CHECK(sinew_body_create(world, &def, &tissue));
  sinew_mesh_destroy(mesh);
  pin_below(world, tissue, 1, -0.009f);

  sinew_tool_def tool_def;
  CHECK(sinew_tool_def_init(&tool_def, sizeof tool_def));
  tool_def.radius = 0.003f;
  tool_def.position[1] = 0.0135f; /* half a millimeter above the tissue */
  sinew_tool_id tool;
  CHECK(sinew_tool_create(world, &tool_def, &tool));

  /* Attach the nodes on top that are within 15 mm of the tool. */
  sinew_vec3_view nodes;
  sinew_attachment_id held[16];
  uint32_t grasped[16];
  size_t count = 0;
  CHECK(sinew_body_get_positions(world, tissue, &nodes));
  for (size_t i = 0; i < nodes.count && count < 16; i++)
    if (node(nodes, i)[1] > 0.009f && distance(node(nodes, i), tool_def.position) < 0.015)
      grasped[count++] = (uint32_t)i;
  sinew_attachment_def attachment;
  CHECK(sinew_attachment_def_init(&attachment, sizeof attachment));
  attachment.body = tissue;
  attachment.tool = tool;
  attachment.nodes = grasped;
  attachment.count = count;
  CHECK(sinew_attachment_create(world, &attachment, held));
  printf("%u nodes attached\n", (unsigned)count);

  float position[3] = {0, 0.0135f, 0}, force[3], torque[3];
  const float before = node(nodes, grasped[0])[1];
  for (int i = 0; i < 40; i++) {
    position[1] += 0.0005f;
    CHECK(sinew_tool_set_pose(world, tool, position, NULL));
    CHECK(sinew_world_step(world, 0.01f, NULL));
  }
  CHECK(sinew_body_get_positions(world, tissue, &nodes)); /* the step ended the old view */
  printf("lifted by %.1f mm\n", 1e3 * (node(nodes, grasped[0])[1] - before));
  CHECK(sinew_tool_get_wrench(world, tool, force, torque));
  printf("the tissue pulls the tool down: %s\n", force[1] < -0.1f ? "yes" : "no");

  for (size_t i = 0; i < count; i++) CHECK(sinew_attachment_release(world, held[i]));
  CHECK(sinew_tool_destroy(world, tool));
  step_world(world, 0.01, 200);
  CHECK(sinew_body_get_positions(world, tissue, &nodes));
  printf("after release it springs back: %s\n", fabs(node(nodes, grasped[0])[1] - before) < 1e-3 ? "yes" : "no");
  sinew_world_destroy(world);
  return 0;
}
