/* Bound the time of a step.
 *
 * A step with a budget does so much work and no more; what it did not reach is its lag, which later steps catch up. By
 * work the motion is the same on every machine; by time it fits into the frame.
 *
 * Output:
 *   4 units of work in a step of 1/60 s: lags behind
 *   caught up with more: yes
 *   within 1 s of time: no lag
 *   after dropping the lag: no lag
 *   simulated 42 steps, 0.68 s
 *   a cloth over a ball, 400 units of work in a step: off by less than 1 mm, force by less than 0.1 N
 */
#include "../example.h"

int main(void) {
  sinew_world *world = create_world(9.81f);
  sinew_mesh *mesh = cloth_mesh(0.1f, 20);
  sinew_body_def def = body_from_mesh(mesh);
  def.stiffness = 100.0f;
  def.node_mass = 1e-4f;
  def.solver = SINEW_SOLVER_VERLET; /* needs about 12 substeps for this */
  sinew_body_id cloth;
  CHECK(sinew_body_create(world, &def, &cloth));
  pin_below(world, cloth, 0, -0.049f);

  sinew_step_report report;
  report.struct_size = sizeof report;
  CHECK(sinew_world_step_with_budget(world, (float)FRAME, 4, &report));
  printf("4 units of work in a step of 1/60 s: %s\n", report.lag > 0 ? "lags behind" : "no lag");
  for (int step = 1; step < 20; step++) CHECK(sinew_world_step_with_budget(world, (float)FRAME, 100, &report));
  printf("caught up with more: %s\n", report.lag == 0 ? "yes" : "no");

  /* report.work is what to record for a bitwise replay with sinew_world_step_with_budget. */
  for (int step = 0; step < 20; step++) CHECK(sinew_world_step_within(world, (float)FRAME, 1.0, &report));
  printf("within 1 s of time: %s\n", report.lag == 0 ? "no lag" : "lags behind");

  CHECK(sinew_world_step_with_budget(world, (float)FRAME, 4, &report));
  CHECK(sinew_world_drop_lag(world)); /* the cloth is slow for once, instead of hurrying after the clock */
  CHECK(sinew_world_step_with_budget(world, (float)FRAME, 100, &report));
  printf("after dropping the lag: %s\n", report.lag == 0 ? "no lag" : "lags behind");

  double time;
  uint64_t steps;
  CHECK(sinew_world_get_time(world, &time, &steps));
  printf("simulated %u steps, %.2f s\n", (unsigned)steps, time);
  CHECK(sinew_body_destroy(world, cloth));

  /* IMPLICIT stops solving its equation instead, and says how far off that leaves it. */
  def.solver = SINEW_SOLVER_IMPLICIT;
  CHECK(sinew_body_create(world, &def, &cloth));
  sinew_mesh_destroy(mesh);
  sinew_tool_def tool_def;
  CHECK(sinew_tool_def_init(&tool_def, sizeof tool_def));
  tool_def.shape = SINEW_SHAPE_SPHERE;
  tool_def.radius = 0.02f;
  tool_def.position[1] = -0.025f;
  sinew_tool_id ball;
  CHECK(sinew_tool_create(world, &tool_def, &ball));
  for (int step = 0; step < 30; step++) CHECK(sinew_world_step_with_budget(world, (float)FRAME, 400, &report));
  float force_error;
  CHECK(sinew_tool_get_force_error(world, ball, &force_error));
  printf("a cloth over a ball, 400 units of work in a step: off by %s than 1 mm, force by %s than 0.1 N\n",
         report.residual < 1e-3f ? "less" : "more", force_error < 0.1f ? "less" : "more");
  sinew_world_destroy(world);
  return 0;
}
