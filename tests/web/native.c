/* Steps every scene of the page natively with the portable kernel and the stroke of demo.h, and prints the hash of its state.
 *
 * Linked with --wrap=sinew_world_create. */
#include "demo.h"

#include <stdio.h>
#include <stdlib.h>

sinew_status __real_sinew_world_create(const sinew_world_def *def, sinew_world **out);
sinew_status __wrap_sinew_world_create(const sinew_world_def *def, sinew_world **out);

sinew_status __wrap_sinew_world_create(const sinew_world_def *def, sinew_world **out) {
  sinew_world_def portable = *def;
  portable.kernel = SINEW_KERNEL_PORTABLE;
  return __real_sinew_world_create(&portable, out);
}

static void must(sinew_status status) {
  if (status == SINEW_STATUS_OK) return;
  fprintf(stderr, "%s: %s\n", sinew_status_name(status), demo_error());
  exit(1);
}

int main(int count, char **words) {
  const uint32_t frames = count > 1 ? (uint32_t)atoi(words[1]) : 60;
  uint32_t scene, frame;
  for (scene = 0; scene < demo_scene_count(); scene++) {
    must(demo_start(scene, SINEW_SOLVER_AUTO));
    for (frame = 0; frame < frames; frame++) {
      demo_stroke(frame);
      must(demo_step());
      printf("%s %u %016llx\n", demo_scene_name(scene), frame, (unsigned long long)demo_hash());
    }
  }
  return 0;
}
