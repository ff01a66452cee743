/* Draw contacts, strain and boxes with your own renderer, and see where the time of a step goes.
 *
 * sinew_world_debug_draw calls back for each line, point and triangle. This program counts them; yours adds them to the
 * lines that it draws anyway.
 *
 * Output:
 *   pinned corners: 2 points
 *   box: 12 lines
 *   springs are drawn: yes
 *   the step was timed: yes, 1 body
 */
#include "../example.h"

typedef struct counts {
  int lines, points;
} counts;

static void draw_line(void *context, const float *points, uint32_t rgba) {
  (void)points; /* x y z of both ends */
  (void)rgba;   /* 0xRRGGBBAA */
  ((counts *)context)->lines++;
}

static void draw_point(void *context, const float *points, uint32_t rgba) {
  (void)points;
  (void)rgba;
  ((counts *)context)->points++;
}

static counts draw(const sinew_world *world, uint32_t flags) {
  counts drawn = {0, 0};
  sinew_debug_draw def;
  CHECK(sinew_debug_draw_init(&def, sizeof def));
  def.flags = flags;
  def.context = &drawn;
  def.draw_line = draw_line;
  def.draw_point = draw_point;
  CHECK(sinew_world_debug_draw(world, &def));
  return drawn;
}

int main(void) {
  sinew_world *world = create_world(9.81f);
  sinew_mesh *mesh = cloth_mesh(0.1f, 10);
  sinew_body_def def = body_from_mesh(mesh);
  def.stiffness = 50.0f;
  def.node_mass = 1e-4f;
  sinew_body_id cloth;
  CHECK(sinew_body_create(world, &def, &cloth));
  sinew_mesh_destroy(mesh);
  CHECK(sinew_body_pin(world, cloth, 0));
  CHECK(sinew_body_pin(world, cloth, 10));

  CHECK(sinew_world_set_profiling(world, 1));
  step_world(world, FRAME, 3);
  uint32_t is_profiled;
  CHECK(sinew_world_get_profiling(world, &is_profiled));
  printf("pinned corners: %d points\n", draw(world, SINEW_DRAW_PINS).points);
  printf("box: %d lines\n", draw(world, SINEW_DRAW_BOUNDS).lines);
  printf("springs are drawn: %s\n", draw(world, SINEW_DRAW_SPRINGS).lines > 100 ? "yes" : "no");

  sinew_profile profile;
  profile.struct_size = sizeof profile;
  CHECK(sinew_world_get_profile(world, &profile)); /* seconds by stage, of the last step */
  const int timed = is_profiled && profile.step > 0 && profile.forces > 0 && profile.forces < profile.step;
  printf("the step was timed: %s, %u body\n", timed ? "yes" : "no", (unsigned)profile.bodies);
  sinew_world_destroy(world);
  return 0;
}
