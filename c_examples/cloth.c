/* An instrument's sphere sinks into a cloth that is pinned at its rim (Halic et al., figure 6).
 *
 *   cloth [-o DIRECTORY] [-n FRAMES]
 *
 * What the sphere pushes down is what the rim has to hold: the two forces are found in different ways and must agree.
 * Leaves cloth_before.png and cloth_during.png in the directory. */
#include "example.h"

#define SIZE 0.2        /* m: a square */
#define CELLS 40        /* along a side */
#define DENSITY 0.5     /* kg/m^2: half a millimetre of tissue */
#define STIFFNESS 60.0  /* N/m per spring: a Young's modulus of 0.14 MPa at that thickness, k = sqrt(3)/2 E t */
#define DAMPING 10.0    /* 1/s: how fast a free node loses its speed */
#define RADIUS 0.02     /* m: the sphere */
#define DEPTH 0.05      /* m: how far it goes below the plane of the rim */
#define SETTLE 0.5      /* s: the cloth sags under its own weight, the sphere waits above it, */
#define SINK 1.5        /* s: sinks, */
#define HOLD 1.0        /* s: stays */

static const double node_mass = DENSITY * (SIZE / CELLS) * (SIZE / CELLS);

/* Nodes of mass 0 are pinned for good: those at the rim. */
static float *create_masses(const sinew_mesh_view *shape) {
  const float inside = (float)(0.499 * SIZE);
  float *masses = (float *)allocate(shape->node_count, sizeof *masses);
  size_t i;
  for (i = 0; i < shape->node_count; i++) {
    const float *p = shape->positions + 3 * i;
    if (fabsf(p[0]) < inside && fabsf(p[2]) < inside) masses[i] = (float)node_mass;
  }
  return masses;
}

static sinew_body_id create_cloth(sinew_world *world, const sinew_mesh_view *shape, const float *masses) {
  sinew_body_def def;
  sinew_body_id cloth;
  CHECK(sinew_body_def_init(&def, sizeof def));
  def.positions = shape->positions;
  def.node_count = shape->node_count;
  def.triangles = shape->triangles; /* their edges are its springs */
  def.triangle_count = shape->triangle_count;
  def.masses = masses;
  def.node_damping = (float)(DAMPING * node_mass);
  def.stiffness = (float)STIFFNESS;
  CHECK(sinew_body_create(world, &def, &cloth));
  return cloth;
}

static sinew_tool_id create_sphere(sinew_world *world, double height) {
  sinew_tool_def def;
  sinew_tool_id sphere;
  CHECK(sinew_tool_def_init(&def, sizeof def));
  def.shape = SINEW_SHAPE_SPHERE;
  def.radius = (float)RADIUS;
  def.position[1] = (float)height;
  CHECK(sinew_tool_create(world, &def, &sphere));
  return sphere;
}

/* Where the sphere's centre is at a time. */
static double height_at(double t) {
  const double start = 1.5 * RADIUS, end = RADIUS - DEPTH;
  return start + (end - start) * smooth((t - SETTLE) / SINK);
}

/* What the rim holds beyond the cloth's own weight. */
static double rim_force(const sinew_world *world, sinew_body_id cloth, const float *masses, size_t node_count) {
  double held = 0;
  size_t i;
  for (i = 0; i < node_count; i++) {
    float pin[3];
    if (masses[i] > 0) {
      held -= 9.81 * masses[i];
    } else {
      CHECK(sinew_body_get_pin_force(world, cloth, (uint32_t)i, pin));
      held += pin[1];
    }
  }
  return held;
}

/* How far the deepest node is inside the sphere. */
static double depth_inside(sinew_vec3_view nodes, const float *centre) {
  double deepest = 0;
  size_t i;
  for (i = 0; i < nodes.count; i++) deepest = fmax(deepest, RADIUS - distance(node(nodes, i), centre));
  return deepest;
}

int main(int argc, char **argv) {
  const float size[2] = {SIZE, SIZE};
  const uint32_t cells[2] = {CELLS, CELLS};
  const float low[3] = {-SIZE / 2, -DEPTH, -SIZE / 2}, high[3] = {SIZE / 2, 2 * RADIUS, SIZE / 2};
  const options chosen = read_options(argc, argv, 0);
  const int frame_count = chosen.frame_count > 0 ? chosen.frame_count : (int)lround((SETTLE + SINK + HOLD) / FRAME);
  double pushed = 0, held = 0;
  int frame;
  sinew_mesh_view shape;
  sinew_mesh *mesh;
  sinew_world *world = create_world(9.81f);
  sinew_body_id cloth;
  sinew_tool_id sphere;
  sinew_picture_def picture;
  float *masses;

  CHECK(sinew_mesh_create_cloth(size, cells, &mesh));
  shape.struct_size = sizeof shape;
  CHECK(sinew_mesh_get_view(mesh, &shape));
  masses = create_masses(&shape);
  cloth = create_cloth(world, &shape, masses);
  sphere = create_sphere(world, height_at(0));
  picture = camera(low, high, 1);

  printf("a cloth of %d x %d cells, %.0f mm wide, pinned at its rim\n\n", CELLS, CELLS, 1e3 * SIZE);
  printf("depth: of the sphere's lowest point below the rim; rim: what the pins hold, less the cloth's weight;\n");
  printf("inside: how far the deepest node is in the sphere\n\n");
  printf("  time s   depth mm   sphere N      rim N   inside mm   substeps   ms/frame\n");
  for (frame = 1; frame <= frame_count; frame++) {
    const double time = frame * FRAME, started = seconds_now();
    const float place[3] = {0, (float)height_at(time), 0};
    float force[3], torque[3];
    double spent;
    sinew_step_report report;
    sinew_vec3_view nodes;

    report.struct_size = sizeof report;
    CHECK(sinew_tool_set_pose(world, sphere, place, NULL));
    CHECK(sinew_world_step(world, (float)FRAME, &report));
    CHECK(sinew_tool_get_wrench(world, sphere, force, torque));
    CHECK(sinew_body_get_positions(world, cloth, &nodes));
    spent = seconds_now() - started;

    pushed = force[1];
    held = rim_force(world, cloth, masses, shape.node_count);
    clear_progress();
    if (frame % 10 == 0) {
      printf("%8.2f%11.1f%11.4f%11.4f%12.3f%11u%11.2f\n", time, 1e3 * (RADIUS - place[1]), pushed, held,
             1e3 * depth_inside(nodes, place), (unsigned)report.substeps, 1e3 * spent);
    }
    if (frame == (int)lround(SETTLE / FRAME)) save_picture(world, &picture, chosen.directory, "cloth_before.png");
    show_progress(frame, frame_count);
  }
  clear_progress();
  save_picture(world, &picture, chosen.directory, "cloth_during.png");
  printf("\nat the end the sphere pushes with %.4f N, the rim holds %.4f N\n", pushed, held);

  free(masses);
  sinew_mesh_destroy(mesh);
  sinew_world_destroy(world);
  return 0;
}
