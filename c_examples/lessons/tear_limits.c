/* Make a seam that tears before the rest.
 *
 * Limits of single springs take the place of the body's. Here a row of springs across a strip is weak, so that the strip
 * parts along it when it is pulled.
 *
 * Output:
 *   the seam: 11 springs tear at a strain of 10 %
 *   parted after it was longer by less than 12 %: yes
 *   pieces: 2
 */
#include "../example.h"

#define COLUMNS 21u /* nodes along x */
#define ROWS 11u

int main(void) {
  sinew_world *world = create_world(0.0f);
  const float size[2] = {0.2f, 0.1f};
  const uint32_t cells[2] = {COLUMNS - 1, ROWS - 1};
  sinew_mesh *mesh;
  CHECK(sinew_mesh_create_cloth(size, cells, &mesh));
  sinew_body_def def = body_from_mesh(mesh);
  def.stiffness = 200.0f;
  def.node_mass = 1e-4f;
  def.node_damping = 2e-2f;
  def.spare_nodes = 1000;
  def.tear_strain = 0.5f;
  def.most_tears = 20;
  sinew_body_id strip;
  CHECK(sinew_body_create(world, &def, &strip));
  sinew_mesh_destroy(mesh);

  uint32_t seam[2 * ROWS]; /* the springs along x right of the middle */
  float limits[ROWS];
  for (uint32_t row = 0; row < ROWS; row++) {
    seam[2 * row] = row * COLUMNS + COLUMNS / 2;
    seam[2 * row + 1] = seam[2 * row] + 1;
    limits[row] = 0.1f;
  }
  CHECK(sinew_body_set_tear_limits(world, strip, seam, limits, NULL, ROWS)); /* NULL: forces as they are */
  CHECK(sinew_body_get_tear_limits(world, strip, seam, ROWS, limits, NULL));
  printf("the seam: %u springs tear at a strain of %.0f %%\n", ROWS, 100 * limits[0]);

  for (uint32_t row = 0; row < ROWS; row++) {
    CHECK(sinew_body_pin(world, strip, row * COLUMNS));
    CHECK(sinew_body_pin(world, strip, row * COLUMNS + COLUMNS - 1));
  }
  sinew_tear_report report;
  report.struct_size = sizeof report;
  uint32_t pieces = 1, tears = 0;
  double stretch = 0;
  for (int i = 1; i <= 300 && pieces == 1; i++) {
    for (uint32_t row = 0; row < ROWS; row++) {
      const float target[3] = {0.1f + 0.0002f * (float)i, 0, -0.05f + 0.01f * (float)row};
      CHECK(sinew_body_move_pin(world, strip, row * COLUMNS + COLUMNS - 1, target));
    }
    CHECK(sinew_world_step(world, 0.01f, NULL));
    CHECK(sinew_body_get_tear_report(world, strip, &report)); /* of this step */
    tears += report.tears;
    CHECK(sinew_body_get_pieces(world, strip, NULL, 0, &pieces));
    stretch = 0.0002 * i / 0.2;
  }
  printf("parted after it was longer by less than 12 %%: %s\n", tears > 0 && stretch < 0.12 ? "yes" : "no");
  printf("pieces: %u\n", pieces);
  sinew_world_destroy(world);
  return 0;
}
