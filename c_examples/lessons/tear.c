/* Pull a sheet until it tears.
 *
 * A body tears automatically if it has spare_nodes, most_tears and a limit: a strain or a force. Here a strip with a notch
 * is pulled by its ends. The tear starts at the notch and runs across the strip.
 *
 * Output:
 *   pieces: 1 before, 2 or more after: yes
 *   it tore after it was longer by at least 5 %: yes
 */
#include "../example.h"

#define COLUMNS 21u /* nodes along x; the sheet has 11 rows */

int main(void) {
  sinew_world *world = create_world(0.0f);
  const float size[2] = {0.2f, 0.1f};
  const uint32_t cells[2] = {COLUMNS - 1, 10};
  sinew_mesh *mesh;
  CHECK(sinew_mesh_create_cloth(size, cells, &mesh));
  sinew_body_def def = body_from_mesh(mesh);
  def.stiffness = 200.0f;
  def.node_mass = 1e-4f;
  def.node_damping = 2e-2f;
  def.spare_nodes = 1000;
  def.tear_strain = 0.3f; /* a spring that is 30 % longer tears */
  def.most_tears = 20;    /* per step */
  def.smallest_piece = 2e-4f; /* m^2: no smaller fragment tears off */
  sinew_body_id sheet;
  CHECK(sinew_body_create(world, &def, &sheet));
  sinew_mesh_destroy(mesh);

  /* A notch of 30 mm in the middle of one long side. */
  const float start[6] = {0.002f, -0.01f, -0.06f, 0.002f, 0.01f, -0.06f};
  const float end[6] = {0.002f, -0.01f, -0.02f, 0.002f, 0.01f, -0.02f};
  CHECK(sinew_body_cut(world, sheet, start, end, NULL));

  for (uint32_t row = 0; row < 11; row++) {
    CHECK(sinew_body_pin(world, sheet, row * COLUMNS));
    CHECK(sinew_body_pin(world, sheet, row * COLUMNS + COLUMNS - 1));
  }

  uint32_t before, pieces = 1;
  double stretch = 0;
  CHECK(sinew_body_get_pieces(world, sheet, NULL, 0, &before));
  for (int i = 1; i <= 300 && pieces == 1; i++) {
    for (uint32_t row = 0; row < 11; row++) { /* the right end moves by 0.5 mm per step */
      const float target[3] = {0.1f + 0.0005f * (float)i, 0.0f, -0.05f + 0.01f * (float)row};
      CHECK(sinew_body_move_pin(world, sheet, row * COLUMNS + COLUMNS - 1, target));
    }
    CHECK(sinew_world_step(world, 0.01f, NULL));
    CHECK(sinew_body_get_pieces(world, sheet, NULL, 0, &pieces));
    stretch = 0.0005 * i / 0.2;
  }
  printf("pieces: %u before, 2 or more after: %s\n", before, pieces >= 2 ? "yes" : "no");
  printf("it tore after it was longer by at least 5 %%: %s\n", stretch >= 0.05 ? "yes" : "no");
  sinew_world_destroy(world);
  return 0;
}
