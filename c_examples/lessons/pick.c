/* Find the object of yours under the mouse.
 *
 * A ray hits bodies and tools, as far as its category and mask allow. Each world, body and tool stores a pointer of
 * yours, which leads from what is hit to your own object. Keep ids for long: they tell when the object was destroyed.
 *
 * Output:
 *   all: the ball
 *   tissue alone: the liver
 *   after the ball has moved: the liver
 *   the ball is there: yes; after its end: no
 */
#include "../example.h"

#define TISSUE 1u
#define INSTRUMENT 2u

/* What your program knows of an object. */
typedef struct object {
  const char *name;
} object;

static const char *name_at(const sinew_world *world, uint32_t mask) {
  const float eye[3] = {0, 1, 0}, down[3] = {0, -1, 0};
  sinew_ray_hit hit;
  hit.struct_size = sizeof hit;
  CHECK(sinew_world_cast_ray_filtered(world, eye, down, 10, TISSUE | INSTRUMENT, mask, &hit));
  void *found = NULL;
  if (sinew_body_is_valid(world, hit.body)) CHECK(sinew_body_get_user_data(world, hit.body, &found));
  if (sinew_tool_is_valid(world, hit.tool)) CHECK(sinew_tool_get_user_data(world, hit.tool, &found));
  return found == NULL ? "nothing" : ((const object *)found)->name;
}

int main(void) {
  static object liver = {"the liver"}, ball = {"the ball"}, theatre = {"the operating theatre"};
  sinew_world *world = create_world(0.0f);
  CHECK(sinew_world_set_user_data(world, &theatre));

  sinew_mesh *mesh = cloth_mesh(0.1f, 10);
  sinew_body_def def = body_from_mesh(mesh);
  def.stiffness = 50.0f;
  def.node_mass = 1e-4f;
  def.collision_category = TISSUE;
  sinew_body_id body;
  CHECK(sinew_body_create(world, &def, &body));
  sinew_mesh_destroy(mesh);
  CHECK(sinew_body_set_user_data(world, body, &liver));

  sinew_tool_def tool_def;
  CHECK(sinew_tool_def_init(&tool_def, sizeof tool_def));
  tool_def.radius = 0.01f;
  tool_def.position[1] = 0.05f;
  tool_def.collision_category = INSTRUMENT;
  sinew_tool_id tool;
  CHECK(sinew_tool_create(world, &tool_def, &tool));
  CHECK(sinew_tool_set_user_data(world, tool, &ball));

  printf("all: %s\n", name_at(world, TISSUE | INSTRUMENT));
  printf("tissue alone: %s\n", name_at(world, TISSUE));
  const float aside[3] = {0.5f, 0.05f, 0};
  CHECK(sinew_tool_teleport(world, tool, aside, NULL)); /* without touching what lies between */
  printf("after the ball has moved: %s\n", name_at(world, TISSUE | INSTRUMENT));

  const uint32_t was_there = sinew_tool_is_valid(world, tool);
  CHECK(sinew_tool_destroy(world, tool));
  printf("the ball is there: %s; after its end: %s\n", was_there ? "yes" : "no", sinew_tool_is_valid(world, tool) ? "yes" : "no");
  void *found;
  CHECK(sinew_world_get_user_data(world, &found));
  sinew_world_destroy(world);
  return found == &theatre ? 0 : 1;
}
