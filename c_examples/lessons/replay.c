/* Record steps, replay them and find the first difference.
 *
 * A recording holds the world at its first step, what calls changed before each step, and a hash of the state after
 * each. The replay takes the same steps and compares. Send a recording with a bug report.
 *
 * Output:
 *   recorded: 20 steps
 *   replayed: 20 steps, first difference: 0
 */
#include "../example.h"

int main(void) {
  const char *folder = getenv("TMPDIR");
  char path[512];
  snprintf(path, sizeof path, "%s/sinew_replay_%ld.recording", folder == NULL ? "/tmp" : folder, (long)getpid());

  sinew_world *world = create_world(9.81f);
  sinew_mesh *mesh = cloth_mesh(0.1f, 10);
  sinew_body_def def = body_from_mesh(mesh);
  def.stiffness = 50.0f;
  def.node_mass = 1e-4f;
  sinew_body_id cloth;
  CHECK(sinew_body_create(world, &def, &cloth));
  sinew_mesh_destroy(mesh);

  /* Whatever is done to the world between steps is in the recording. */
  uint64_t steps;
  CHECK(sinew_world_start_recording(world, path));
  for (uint32_t node = 0; node < 10; node++) {
    CHECK(sinew_body_pin(world, cloth, node));
    step_world(world, FRAME, 2);
  }
  CHECK(sinew_world_stop_recording(world, &steps)); /* fails if the disk was full; the steps were taken all the same */
  printf("recorded: %u steps\n", (unsigned)steps);
  sinew_world_destroy(world);

  /* The recording is enough: no world is needed. */
  sinew_replay_report report;
  report.struct_size = sizeof report;
  CHECK(sinew_replay(path, 1, &report));
  printf("replayed: %u steps, first difference: %u\n", (unsigned)report.steps, (unsigned)report.first_difference);
  remove(path);
  return 0;
}
