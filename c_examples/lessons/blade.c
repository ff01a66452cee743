/* Cut with a blade that meets resistance.
 *
 * A blade is an edge that moves with the poses you set, like the tip of a scalpel. Tissue with a toughness deforms until
 * the blade's force suffices, then opens. The work done is the toughness times the length of the cut.
 * Next: cut.c cuts without a force; haptics_min.c shows how a device renders forces.
 *
 * Output:
 *   cut 58 mm in 60 steps
 *   largest force 0.5 N; pressed the sheet: yes, and still does: yes
 *   it ended at z = 9 mm; there after its end: no
 *   work / (toughness * length) = 1.0
 */
#include "../example.h"

#define TOUGHNESS 0.5f /* J/m: fracture toughness [J/m^2] times the thickness of the sheet */

int main(void) {
  sinew_world *world = create_world(0.0f);
  sinew_mesh *mesh = cloth_mesh(0.1f, 20);
  sinew_body_def def = body_from_mesh(mesh);
  def.stiffness = 500.0f;
  def.node_mass = 1e-4f;
  def.node_damping = 2e-2f;
  def.spare_nodes = 2000; /* a blade needs about ten per triangle */
  def.toughness = TOUGHNESS;
  sinew_body_id sheet;
  CHECK(sinew_body_create(world, &def, &sheet));
  sinew_mesh_destroy(mesh);

  /* Pin the whole border. */
  for (uint32_t i = 0; i < 21; i++) {
    const uint32_t border[4] = {i, 420 + i, 21 * i, 21 * i + 20};
    for (int k = 0; k < 4; k++) CHECK(sinew_body_pin(world, sheet, border[k]));
  }

  /* The edge is upright and starts outside of the sheet. */
  sinew_blade_def blade_def;
  CHECK(sinew_blade_def_init(&blade_def, sizeof blade_def));
  blade_def.edge[1] = -0.01f;
  blade_def.edge[4] = 0.01f;
  blade_def.position[0] = 0.001f;
  blade_def.position[2] = -0.051f;
  sinew_blade_id blade;
  CHECK(sinew_blade_create(world, &blade_def, &blade));

  double work = 0, length = 0, largest = 0;
  int pressed = 0, touches = 0;
  float position[3] = {0.001f, 0.0f, -0.051f};
  for (int i = 0; i < 60; i++) {
    position[2] += 0.001f; /* 1 mm per step of 10 ms */
    CHECK(sinew_blade_set_pose(world, blade, position, NULL));
    CHECK(sinew_world_step(world, 0.01f, NULL));
    sinew_blade_report report;
    report.struct_size = sizeof report;
    CHECK(sinew_blade_get_report(world, blade, &report));
    size_t bodies;
    CHECK(sinew_blade_get_contacts(world, blade, NULL, 0, &bodies)); /* which bodies it presses, where and with what force */
    pressed += bodies > 0;
    sinew_body_contact_change change; /* of the one body there is */
    size_t changes;
    CHECK(sinew_world_get_body_contact_changes(world, &change, 1, &changes));
    if (changes > 0) touches = change.has_begun == 1;
    CHECK(report.status); /* a cut that fails does not fail the step */
    work += report.work;
    length += report.length;
    largest = fmax(largest, -report.force[2]);
  }
  /* The blade travels 60 mm: 1 mm outside of the sheet, and its cut lags behind by the deformation. */
  printf("cut %.0f mm in 60 steps\n", 1e3 * length);
  printf("largest force %.1f N; pressed the sheet: %s, and still does: %s\n", largest, pressed > 50 ? "yes" : "no", touches ? "yes" : "no");
  float reached[3];
  CHECK(sinew_blade_get_pose(world, blade, reached, NULL));
  CHECK(sinew_blade_destroy(world, blade)); /* what it has cut stays cut */
  printf("it ended at z = %.0f mm; there after its end: %s\n", 1e3 * reached[2], sinew_blade_is_valid(world, blade) ? "yes" : "no");
  printf("work / (toughness * length) = %.1f\n", work / (TOUGHNESS * length));
  sinew_world_destroy(world);
  return 0;
}
