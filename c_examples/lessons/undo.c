/* Undo a cut with a snapshot.
 *
 * A snapshot holds a whole world as bytes. Loading it creates a new world that continues bitwise identically, with the
 * same ids. Save before each cut to offer undo.
 *
 * Output:
 *   pieces: 1, after the cut 2, after undo 1
 *   the state equals the one that was saved: yes
 */
#include "../example.h"

static uint32_t count_pieces(const sinew_world *world, sinew_body_id body) {
  uint32_t count;
  CHECK(sinew_body_get_pieces(world, body, NULL, 0, &count));
  return count;
}

int main(void) {
  sinew_world *world = create_world(9.81f);
  sinew_mesh *mesh = cloth_mesh(0.1f, 10);
  sinew_body_def def = body_from_mesh(mesh);
  def.stiffness = 50.0f;
  def.node_mass = 1e-4f;
  def.spare_nodes = 500;
  sinew_body_id sheet;
  CHECK(sinew_body_create(world, &def, &sheet));
  sinew_mesh_destroy(mesh);
  step_world(world, FRAME, 3);

  /* Save. */
  uint64_t saved_hash, hash;
  size_t size_of_snapshot;
  CHECK(sinew_world_get_state_hash(world, &saved_hash));
  CHECK(sinew_world_get_snapshot_size(world, &size_of_snapshot));
  uint8_t *bytes = (uint8_t *)allocate(size_of_snapshot, 1);
  CHECK(sinew_world_save_snapshot(world, bytes, size_of_snapshot));

  /* Cut, from before the sheet to beyond it; the sheet has fallen a little, so the edge is long. */
  const float start[6] = {0.003f, -0.5f, -0.06f, 0.003f, 0.5f, -0.06f};
  const float end[6] = {0.003f, -0.5f, 0.06f, 0.003f, 0.5f, 0.06f};
  const uint32_t whole = count_pieces(world, sheet);
  CHECK(sinew_body_cut(world, sheet, start, end, NULL));
  const uint32_t cut = count_pieces(world, sheet);
  step_world(world, FRAME, 3);

  /* Undo: load the snapshot as a new world, and destroy the old one. Readers and embeddings must be created again. */
  sinew_world *before;
  CHECK(sinew_world_load_snapshot(bytes, size_of_snapshot, NULL, &before));
  sinew_world_destroy(world);
  world = before;
  CHECK(sinew_world_get_state_hash(world, &hash));

  printf("pieces: %u, after the cut %u, after undo %u\n", whole, cut, count_pieces(world, sheet));
  printf("the state equals the one that was saved: %s\n", hash == saved_hash ? "yes" : "no");
  free(bytes);
  sinew_world_destroy(world);
  return 0;
}
