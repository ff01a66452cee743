/* An instrument's tip is pressed into an organ, held there and taken away (Halic et al., figure 7).
 *
 *   press [-o DIRECTORY] [-n FRAMES] [FILE [SCALE [AXIS]]]
 *
 * FILE is a tetrahedral mesh (.vtk .msh .node), SCALE the length of one of its units in meters (1; 0.001 for
 * millimeters), AXIS the axis that points up (y). Without a file an organ is made. Its lowest part is pinned.
 * Leaves press_before.png, press_during.png, press_after.png and the force curve press.csv in the directory. */
#include "example.h"

#define PRESS 1.0   /* s: the tip moves down */
#define HOLD 0.5    /* s: the tip stays */
#define LEAVE 1.0   /* s: the tip moves up */
#define REST 0.5    /* s: the tissue comes to rest */
#define LIVER 5400.0f /* Pa: Young's modulus; see sinew_material_get_preset */
#define PINNED 0.35f  /* fraction of the height, from below, that is pinned */

/* Depth of the tip below its start [m]. */
static double depth_at(double time, double total) {
  return total * (time < PRESS + HOLD ? smooth(time / PRESS) : 1 - smooth((time - PRESS - HOLD) / LEAVE));
}

int main(int argc, char **argv) {
  const options chosen = read_options(argc, argv, 3);
  const float scale = chosen.argument_count > 1 ? (float)atof(chosen.arguments[1]) : 1.0f;
  const int up = chosen.argument_count > 2 ? chosen.arguments[2][0] - 'x' : 1;
  const int all_frames = (int)lround((PRESS + HOLD + LEAVE + REST) / FRAME);
  const int frame_count = chosen.frame_count > 0 ? chosen.frame_count : all_frames;
  if (up < 0 || up > 2) fail("x, y or z, not", chosen.arguments[2]);

  /* The organ: a mesh, a material and pins. Gravity is off, because the mesh is the organ's shape under its weight. */
  sinew_world *world = create_world(0.0f);
  sinew_mesh *mesh;
  if (chosen.argument_count > 0)
    CHECK(sinew_mesh_load(chosen.arguments[0], SINEW_MESH_FORMAT_AUTO, scale, &mesh));
  else
    CHECK(sinew_mesh_create_organ(0.2f, 0.01f, &mesh));
  sinew_body_def def = body_from_mesh(mesh);
  if (def.tetrahedron_count == 0) fail("no tetrahedra in", chosen.arguments[0]);
  def.material = SINEW_MATERIAL_SPRINGS;
  def.young_modulus = LIVER;
  def.density = 1060.0f;              /* kg/m^3 */
  def.solver = SINEW_SOLVER_IMPLICIT; /* long steps; a fine mesh of viscous tissue needs many explicit substeps */
  def.retardation_time = 0.005f;      /* s: viscosity */
  def.volume_stiffness = 0.5f * LIVER;
  sinew_body_id organ;
  CHECK(sinew_body_create(world, &def, &organ));

  float low[3], high[3];
  memcpy(low, def.positions, sizeof low);
  memcpy(high, def.positions, sizeof high);
  for (size_t i = 0; i < 3 * def.node_count; i++) {
    low[i % 3] = fminf(low[i % 3], def.positions[i]);
    high[i % 3] = fmaxf(high[i % 3], def.positions[i]);
  }
  sinew_mesh_destroy(mesh);
  pin_below(world, organ, up, low[up] + PINNED * (high[up] - low[up]));

  /* The tip: a sphere above the middle of the organ, as far as a ray from above finds tissue. */
  const float size = high[(up + 1) % 3] - low[(up + 1) % 3] + high[(up + 2) % 3] - low[(up + 2) % 3];
  const float radius = 0.06f * size;
  float above[3], down[3] = {0, 0, 0};
  for (int axis = 0; axis < 3; axis++) above[axis] = 0.5f * (low[axis] + high[axis]);
  above[up] = high[up] + radius;
  down[up] = -1.0f;
  sinew_surface_point hit;
  hit.struct_size = sizeof hit;
  CHECK(sinew_world_cast_ray(world, above, down, size + high[up] - low[up], &hit));
  if (hit.body.index1 == 0) fail("nothing below", "the tip");

  sinew_tool_def tip_def;
  CHECK(sinew_tool_def_init(&tip_def, sizeof tip_def));
  tip_def.shape = SINEW_SHAPE_SPHERE;
  tip_def.radius = radius;
  memcpy(tip_def.position, hit.position, sizeof tip_def.position);
  tip_def.position[up] = high[up] + 1.5f * radius;
  sinew_tool_id tip;
  CHECK(sinew_tool_create(world, &tip_def, &tip));
  const double touch = tip_def.position[up] - hit.position[up] - radius; /* depth of the first contact, about */
  const double total = touch + 0.25 * (hit.position[up] - low[up]);

  high[up] += radius;
  const sinew_picture_def picture = camera(low, high, up);
  save_picture(world, &picture, chosen.directory, "press_before.png");
  FILE *curve = create_file(chosen.directory, "press.csv");
  fprintf(curve, "time_s,depth_m,force_N,substeps\n");
  printf("%u nodes; a tip of %.1f mm radius is pressed in by %.1f mm\n\n", (unsigned)def.node_count, 1e3 * radius,
         1e3 * (total - touch));
  printf("  time s   depth mm    force N   substeps\n");
  double peak = 0;
  for (int frame = 1; frame <= frame_count; frame++) {
    const double depth = depth_at(frame * FRAME, total);
    float position[3], force[3], torque[3];
    sinew_step_report report;
    report.struct_size = sizeof report;
    memcpy(position, tip_def.position, sizeof position);
    position[up] -= (float)depth;
    CHECK(sinew_tool_set_pose(world, tip, position, NULL));
    CHECK(sinew_world_step(world, (float)FRAME, &report));
    CHECK(sinew_tool_get_wrench(world, tip, force, torque));
    peak = fmax(peak, force[up]);
    fprintf(curve, "%.6f,%.6f,%.6f,%u\n", frame * FRAME, depth - touch, force[up], (unsigned)report.substeps);
    if (frame % 10 == 0)
      printf("%8.2f%11.2f%11.4f%11u\n", frame * FRAME, 1e3 * (depth - touch), force[up], (unsigned)report.substeps);
    if (frame == lround((PRESS + HOLD) / FRAME)) save_picture(world, &picture, chosen.directory, "press_during.png");
    show_progress(frame, frame_count);
  }
  clear_progress();
  save_picture(world, &picture, chosen.directory, "press_after.png");
  printf("\npeak force %.4f N\n", peak);
  fclose(curve);
  sinew_world_destroy(world);
  return 0;
}
