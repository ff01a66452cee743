/* Render on another thread while the world steps.
 *
 * A reader gives its thread the latest complete positions of a body, without locks and without waiting. Create one
 * reader per reading thread. The views in a frame stay valid until the next read.
 *
 * Output:
 *   frames never went backward: yes
 *   the last frame shows step 200
 */
#include "../example.h"
#include <pthread.h>

typedef struct result {
  sinew_reader *reader;
  uint64_t last_step;
  int ordered;
} result;

static void *render(void *data) {
  result *seen = (result *)data;
  sinew_frame frame;
  frame.struct_size = sizeof frame;
  for (;;) {
    if (sinew_reader_read(seen->reader, &frame) != SINEW_STATUS_OK) return NULL;
    if (frame.step < seen->last_step) seen->ordered = 0;
    seen->last_step = frame.step;
    /* Draw frame.positions and frame.triangles here. */
    if (frame.is_over) return NULL; /* the world was destroyed: this was its last frame */
  }
}

int main(void) {
  sinew_world *world = create_world(9.81f);
  sinew_mesh *mesh = cloth_mesh(0.1f, 20);
  sinew_body_def def = body_from_mesh(mesh);
  def.stiffness = 50.0f;
  def.node_mass = 1e-4f;
  sinew_body_id cloth;
  CHECK(sinew_body_create(world, &def, &cloth));
  sinew_mesh_destroy(mesh);
  CHECK(sinew_body_pin(world, cloth, 0));

  result seen = {NULL, 0, 1};
  CHECK(sinew_reader_create(world, cloth, &seen.reader)); /* before the thread starts */
  pthread_t thread;
  if (pthread_create(&thread, NULL, render, &seen) != 0) fail("cannot start", "a thread");

  step_world(world, 0.002, 200);
  sinew_world_destroy(world); /* readers may outlive their world */
  pthread_join(thread, NULL);
  sinew_reader_destroy(seen.reader);

  printf("frames never went backward: %s\n", seen.ordered ? "yes" : "no");
  printf("the last frame shows step %u\n", (unsigned)seen.last_step);
  return 0;
}
