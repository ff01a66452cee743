/* Let bodies collide with each other.
 *
 * Bodies with meets_bodies keep each other apart; meets_itself does the same for the folds of one. The contacts of a
 * body tell where it touches others, and with what force. Here a soft cube lands on another, which stands on the ground.
 *
 * Output:
 *   before they meet: 0 contacts
 *   pairs of bodies that touch, by their events: 1
 *   at rest they touch: yes, only each other
 *   the lower cube carries the upper one: 0.64 N
 */
#include "../example.h"

static sinew_body_id create_cube(sinew_world *world, float height) {
  const float size[3] = {0.04f, 0.04f, 0.04f};
  const uint32_t cells[3] = {3, 3, 3};
  sinew_mesh *mesh;
  CHECK(sinew_mesh_create_block(size, cells, &mesh));
  sinew_body_def def = body_from_mesh(mesh);
  def.stiffness = 300.0f;
  def.node_mass = 1e-3f; /* 64 nodes: 64 g */
  def.damping_rate = 20.0f;
  def.meets_bodies = 1;
  def.contact_friction = 0.5f;
  def.position[1] = height;
  sinew_body_id cube;
  CHECK(sinew_body_create(world, &def, &cube));
  sinew_mesh_destroy(mesh);
  return cube;
}

int main(void) {
  sinew_world *world = create_world(10.0f);
  const sinew_body_id lower = create_cube(world, 0.0f), upper = create_cube(world, 0.05f);
  pin_below(world, lower, 1, -0.019f);

  sinew_contact contacts[256];
  size_t count;
  CHECK(sinew_body_get_contacts(world, upper, NULL, 0, &count)); /* how many there are */
  printf("before they meet: %u contacts\n", (unsigned)count);

  /* What began or ended to touch in each step. A body that sleeps goes on touching. */
  int touching = 0;
  for (int frame = 0; frame < 240; frame++) {
    sinew_body_contact_change changes[4];
    step_world(world, FRAME, 1);
    CHECK(sinew_world_get_body_contact_changes(world, changes, 4, &count));
    for (size_t i = 0; i < count && i < 4; i++) touching += changes[i].has_begun ? 1 : -1;
  }
  printf("pairs of bodies that touch, by their events: %d\n", touching);
  float carried = 0;
  int others = 0;
  CHECK(sinew_body_get_contacts(world, upper, contacts, 256, &count));
  for (size_t i = 0; i < count && i < 256; i++) {
    carried += contacts[i].force[1]; /* on the upper cube, N */
    others += !sinew_body_id_equals(contacts[i].body, lower);
  }
  printf("at rest they touch: %s, %s\n", count > 0 ? "yes" : "no", others == 0 ? "only each other" : "and something else");
  printf("the lower cube carries the upper one: %.2f N\n", carried);
  sinew_world_destroy(world);
  return 0;
}
