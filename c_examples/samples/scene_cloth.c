/* A cloth falls on a ball.
 *
 * Triangles with a thickness and a bending stiffness are a sheet. The ball is a tool that nobody moves. */
#include "scene.h"

sinew_status create_cloth(sample *s);

sinew_status create_cloth(sample *s) {
  const float size[2] = {0.4f, 0.4f}; /* [m] */
  const uint32_t cells[2] = {40, 40};
  sinew_body_def def;
  sinew_tool_def ball, floor;
  TRY(sinew_mesh_create_cloth(size, cells, &s->mesh));
  TRY(scene_body(s, &def));
  def.node_mass = 5e-5f;          /* [kg] */
  def.node_damping = 2e-4f;       /* [N s/m] drag of the air */
  def.stiffness = 30.0f;          /* [N/m] */
  def.spring_damping = 2e-3f;     /* [N s/m] */
  def.bending_stiffness = 2e-6f;  /* [N m] */
  def.contact_thickness = 0.001f; /* [m] */
  def.position[1] = 0.12f;        /* [m] above the ball */
  TRY(scene_add_body(s, &def, 0x3E6FA8));

  TRY(scene_tool(&ball, SINEW_SHAPE_SPHERE, 0.09f, 0, 0, 0, 0.01f, 0));
  TRY(scene_add_tool(s, &ball, 0xD9A441));
  TRY(scene_tool(&floor, SINEW_SHAPE_PLANE, 0, 0, 0, 0, -0.1f, 0));
  TRY(scene_add_tool(s, &floor, 0x5D7F86));
  s->cut_depth = 0.02f;
  scene_camera(s, 0.30f, 0.35f, 0.55f, 0.0f, -0.01f, 0.0f);
  return SINEW_STATUS_OK;
}
