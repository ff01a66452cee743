/* Step at a fixed rate and draw at any rate.
 *
 * Frames of a screen are uneven; steps should not be. Collect the time of each frame, take as many fixed steps as fit,
 * and draw a blend of the last two states by the time that is left. Keep a copy of the previous positions, because a
 * step ends the views of them. The frame times here are an invented, uneven sequence.
 *
 * Output:
 *   27 frames, 120 steps of 5 ms
 *   the drawn node falls in every frame: yes
 *   error against free fall below 0.1 mm: yes
 */
#include "../example.h"

#define STEP 0.005      /* s */
#define MOST_STEPS 10   /* per frame: a long pause must not cause a flood of steps */
#define FALLEN(t) (0.5 * 9.81 * (t) * (t)) /* m: free fall from rest */

int main(void) {
  sinew_world *world = create_world(9.81f);
  const float position[3] = {0, 0, 0};
  sinew_body_def def;
  CHECK(sinew_body_def_init(&def, sizeof def));
  def.positions = position;
  def.node_count = 1; /* a single node in free fall, whose motion is known */
  def.node_mass = 1e-3f;
  sinew_body_id body;
  CHECK(sinew_body_create(world, &def, &body));

  const double frame_times[] = {0.016, 0.031, 0.017, 0.016, 0.035}; /* s, repeated */
  double left = 0, now = 0, drawn_before = 1, largest_error = 0;
  double previous = 0, current = 0; /* a real program copies all positions */
  int frames = 0, steps = 0, falls = 1;
  while (steps < 120) {
    const double frame_time = frame_times[frames++ % 5];
    left += fmin(frame_time, MOST_STEPS * STEP);
    now += frame_time;
    for (; left >= STEP && steps < 120; left -= STEP, steps++) {
      sinew_vec3_view nodes;
      previous = current;
      CHECK(sinew_world_step(world, (float)STEP, NULL));
      CHECK(sinew_body_get_positions(world, body, &nodes));
      current = node(nodes, 0)[1];
    }
    if (steps == 120) break;
    const double blend = left / STEP; /* 0: the previous state, 1: the current state */
    const double drawn = previous + blend * (current - previous);
    const double shown_time = now - STEP; /* what is drawn is one step old */
    largest_error = fmax(largest_error, fabs(drawn + FALLEN(shown_time)));
    if (drawn >= drawn_before) falls = 0;
    drawn_before = drawn;
  }
  printf("%d frames, %d steps of 5 ms\n", frames, steps);
  printf("the drawn node falls in every frame: %s\n", falls ? "yes" : "no");
  printf("error against free fall below 0.1 mm: %s\n", largest_error < 1e-4 ? "yes" : "no");
  sinew_world_destroy(world);
  return 0;
}
