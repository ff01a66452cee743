/* Handle errors without ending the program.
 *
 * Every call returns a status; a failed call changes nothing. sinew_last_error returns the reason, with the name of the
 * argument. A program that must go on prints the reason and continues with what it has.
 *
 * Output:
 *   negative stiffness: SINEW_STATUS_INVALID_ARGUMENT
 *   missing file: SINEW_STATUS_IO
 *   destroyed body: SINEW_STATUS_STALE_ID
 *   cut without spare_nodes: SINEW_STATUS_UNSUPPORTED
 *   every failure has a reason: yes
 *   the world still steps: yes
 */
#include "../example.h"

static int reasons_given = 1;

/* Reports a failure and returns whether the call succeeded. A program would log the reason or show it. */
static int succeeded(sinew_status status, const char *what) {
  char reason[512];
  if (status == SINEW_STATUS_OK) return 1;
  if (sinew_last_error(reason, sizeof reason) <= 1) reasons_given = 0;
  printf("%s: %s\n", what, sinew_status_name(status));
  return 0;
}

int main(void) {
  sinew_world *world = create_world(9.81f);
  sinew_mesh *mesh = cloth_mesh(0.1f, 10);
  sinew_mesh *missing = NULL;

  sinew_body_def def = body_from_mesh(mesh);
  sinew_body_id cloth, other;
  def.node_mass = 1e-4f;
  def.stiffness = -1.0f;
  if (!succeeded(sinew_body_create(world, &def, &cloth), "negative stiffness")) {
    def.stiffness = 50.0f; /* correct it and try again */
    CHECK(sinew_body_create(world, &def, &cloth));
  }
  CHECK(sinew_body_create(world, &def, &other));

  if (!succeeded(sinew_mesh_load("no_such_file.obj", SINEW_MESH_FORMAT_AUTO, 1.0f, &missing), "missing file"))
    missing = NULL; /* go on without it; sinew_mesh_destroy accepts NULL */

  CHECK(sinew_body_destroy(world, other));
  succeeded(sinew_body_pin(world, other, 0), "destroyed body");

  const float start[6] = {0, -0.1f, -0.1f, 0, 0.1f, -0.1f}, end[6] = {0, -0.1f, 0.1f, 0, 0.1f, 0.1f};
  succeeded(sinew_body_cut(world, cloth, start, end, NULL), "cut without spare_nodes");

  printf("every failure has a reason: %s\n", reasons_given ? "yes" : "no");
  printf("the world still steps: %s\n", succeeded(sinew_world_step(world, 0.01f, NULL), "step") ? "yes" : "no");
  sinew_mesh_destroy(missing);
  sinew_mesh_destroy(mesh);
  sinew_world_destroy(world);
  return 0;
}
