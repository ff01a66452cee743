/* An instrument's tip is pressed into an organ, held there and taken away (Halic et al., figure 7).
 *
 *   press [-o DIRECTORY] [-n FRAMES] [FILE [SCALE [AXIS]]]
 *
 * FILE is a tetrahedral mesh (.vtk .msh .node), SCALE what one of its units is in metres (1; 0.001 for millimetres), AXIS
 * the one that points up (y). Without a file an organ is made. It is pressed from above and fixed at its back.
 * Leaves press_before.png, press_during.png, press_after.png and the force curve press.csv in the directory. */
#include "example.h"

#define YOUNG 5400.0    /* Pa: liver */
#define DENSITY 1060.0  /* kg/m^3: liver */
#define DAMPING 20.0    /* 1/s: how fast a free node loses its speed; the tissue comes to rest without swinging */
#define BACK 0.5        /* cosine: a face is part of the back where its normal is closer than 60 degrees to straight down */
#define TIP 0.1         /* of the longest extent: the radius of the tip; at least the mean edge, which a coarse mesh needs */
#define DEPTH 0.6       /* of the radius: how far it goes in, */
#define DEEPEST 0.25    /* of the organ's thickness, at most */
#define CLEARANCE 0.5   /* of the radius: how far above the organ it starts and ends */
#define PRESS 1.0       /* s: the tip comes down, */
#define HOLD 0.5        /* s: stays, */
#define LEAVE 1.0       /* s: goes up again, */
#define REST 0.5        /* s: and the tissue comes to rest */

typedef struct bounds { float low[3], high[3]; } bounds;

static bounds find_bounds(const sinew_mesh_view *shape) {
  bounds box;
  size_t i;
  memcpy(box.low, shape->positions, sizeof box.low);
  memcpy(box.high, shape->positions, sizeof box.high);
  for (i = 0; i < 3 * shape->node_count; i++) {
    box.low[i % 3] = fminf(box.low[i % 3], shape->positions[i]);
    box.high[i % 3] = fmaxf(box.high[i % 3], shape->positions[i]);
  }
  return box;
}

static const float *position(const sinew_mesh_view *shape, uint32_t node) { return shape->positions + 3 * (size_t)node; }

/* The mean side of the surface's triangles. */
static double mean_edge(const sinew_mesh_view *shape) {
  const size_t corners = 3 * shape->surface_triangle_count;
  double sum = 0;
  size_t i;
  for (i = 0; i < corners; i++) {
    const uint32_t next = shape->surface[i % 3 == 2 ? i - 2 : i + 1];
    sum += distance(position(shape, shape->surface[i]), position(shape, next));
  }
  return sum / (double)corners;
}

/* Twice a triangle's area, as a vector along its normal. */
static void triangle_normal(const float *a, const float *b, const float *c, double normal[3]) {
  int i;
  for (i = 0; i < 3; i++) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    normal[i] = ((double)b[j] - a[j]) * ((double)c[k] - a[k]) - ((double)b[k] - a[k]) * ((double)c[j] - a[j]);
  }
}

/* How far b is from a, seen from above. */
static double aside(const float *a, const float *b, int up) {
  const int i = (up + 1) % 3, j = (up + 2) % 3;
  return hypot(a[i] - b[i], a[j] - b[j]);
}

static double tetrahedron_volume(const sinew_mesh_view *shape, const uint32_t *corner) {
  const float *a = position(shape, corner[0]), *d = position(shape, corner[3]);
  double normal[3], product = 0;
  int i;
  triangle_normal(a, position(shape, corner[1]), position(shape, corner[2]), normal);
  for (i = 0; i < 3; i++) product += normal[i] * ((double)d[i] - a[i]);
  return fabs(product) / 6;
}

/* A spring or a face of a tetrahedron, named by its nodes in rising order. */
typedef struct part {
  uint32_t nodes[3], opposite;
  double volume;
} part;

#define NONE UINT32_MAX

static part make_part(uint32_t a, uint32_t b, uint32_t c, uint32_t opposite, double volume) {
  part made;
  int i;
  made.nodes[0] = a, made.nodes[1] = b, made.nodes[2] = c, made.opposite = opposite, made.volume = volume;
  for (i = 0; i < 3; i++) { /* two neighbours in turn: 0 1, 1 2, 0 1 */
    uint32_t *pair = made.nodes + i % 2, first = pair[0];
    if (first > pair[1]) pair[0] = pair[1], pair[1] = first;
  }
  return made;
}

static int compare_parts(const void *left, const void *right) {
  const uint32_t *l = ((const part *)left)->nodes, *r = ((const part *)right)->nodes;
  int i;
  for (i = 0; i < 3; i++) {
    if (l[i] != r[i]) return l[i] < r[i] ? -1 : 1;
  }
  return 0;
}

/* What makes tissue of a mesh. */
typedef struct tissue {
  float *masses, *dampings, *stiffnesses;
  uint32_t *springs;
  size_t spring_count;
  double volume;
} tissue;

/* A tetrahedron of volume V gives a quarter of its mass to each of its corners. Its edges are springs, and so are the
 * braces that join the far corners of two tetrahedra across their common face: edges alone let them turn inside out.
 * To a spring of length L it gives a stiffness in proportion to V / L^2 (Van Gelder 1998: no stiff springs in slivers);
 * the sum of k L^2 over all springs is 6 E V, so that the body as a whole has Young's modulus E. */
static tissue create_tissue(const sinew_mesh_view *shape) {
  const size_t most = (6 + 2) * shape->tetrahedron_count; /* edges and braces */
  part *springs = (part *)allocate(most, sizeof *springs), *spring = springs;
  part *faces = (part *)allocate(4 * shape->tetrahedron_count, sizeof *faces), *face = faces, *next;
  double sum = 0;
  tissue made;
  size_t i, j, k, last;
  made.masses = (float *)allocate(shape->node_count, sizeof(float));
  made.dampings = (float *)allocate(shape->node_count, sizeof(float));
  made.stiffnesses = (float *)allocate(most, sizeof(float));
  made.springs = (uint32_t *)allocate(most, 2 * sizeof(uint32_t));
  made.volume = 0;

  for (i = 0; i < shape->tetrahedron_count; i++) {
    const uint32_t *corner = shape->tetrahedra + 4 * i;
    const double volume = tetrahedron_volume(shape, corner);
    made.volume += volume;
    for (j = 0; j < 4; j++) {
      made.masses[corner[j]] += (float)(DENSITY * volume / 4);
      *face++ = make_part(corner[(j + 1) % 4], corner[(j + 2) % 4], corner[(j + 3) % 4], corner[j], volume);
      for (k = 0; k < j; k++) *spring++ = make_part(corner[j], corner[k], NONE, NONE, volume);
    }
  }
  qsort(faces, (size_t)(face - faces), sizeof *faces, compare_parts);
  for (next = faces + 1; next < face; next++) {
    if (compare_parts(next - 1, next) != 0) continue;
    *spring++ = make_part(next[-1].opposite, next->opposite, NONE, NONE, next[-1].volume + next->volume);
  }
  last = (size_t)(spring - springs);
  qsort(springs, last, sizeof *springs, compare_parts);

  made.spring_count = 0;
  for (i = 0; i < last; i = j) { /* what lies on the same pair of nodes is one spring */
    const uint32_t *ends = springs[i].nodes;
    const double length = distance(position(shape, ends[0]), position(shape, ends[1]));
    double volume = 0;
    for (j = i; j < last && compare_parts(springs + i, springs + j) == 0; j++) volume += springs[j].volume;
    memcpy(made.springs + 2 * made.spring_count, ends, 2 * sizeof *ends);
    made.stiffnesses[made.spring_count++] = (float)(volume / (length * length));
    sum += volume;
  }
  for (i = 0; i < made.spring_count; i++) made.stiffnesses[i] *= (float)(6 * YOUNG * made.volume / sum);
  for (i = 0; i < shape->node_count; i++) made.dampings[i] = (float)DAMPING * made.masses[i];
  free(springs);
  free(faces);
  return made;
}

static void free_tissue(tissue *made) {
  free(made->masses);
  free(made->dampings);
  free(made->stiffnesses);
  free(made->springs);
}

/* Pins the corners of the surface's triangles that look away from the instrument: without mass they never move. */
static void fix_back(const sinew_mesh_view *shape, int up, float *masses) {
  size_t i, j;
  for (i = 0; i < shape->surface_triangle_count; i++) {
    const uint32_t *corner = shape->surface + 3 * i;
    double n[3];
    triangle_normal(position(shape, corner[0]), position(shape, corner[1]), position(shape, corner[2]), n);
    if (n[up] > -BACK * sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])) continue;
    for (j = 0; j < 3; j++) masses[corner[j]] = 0;
  }
}

static sinew_body_id create_organ(sinew_world *world, const sinew_mesh_view *shape, int up) {
  tissue made = create_tissue(shape);
  sinew_body_def def;
  sinew_body_id organ;
  size_t i, fixed = 0;

  fix_back(shape, up, made.masses);
  CHECK(sinew_body_def_init(&def, sizeof def));
  def.positions = shape->positions;
  def.node_count = shape->node_count;
  def.masses = made.masses;
  def.node_dampings = made.dampings;
  def.springs = made.springs;
  def.spring_count = made.spring_count;
  def.stiffnesses = made.stiffnesses;
  def.triangles = shape->surface; /* what the instrument meets and the picture shows */
  def.triangle_count = shape->surface_triangle_count;
  def.tetrahedra = shape->tetrahedra;
  def.tetrahedron_count = shape->tetrahedron_count;
  CHECK(sinew_body_create(world, &def, &organ));

  for (i = 0; i < shape->node_count; i++) fixed += made.masses[i] == 0;
  printf("%zu nodes, %zu of them fixed, %zu tetrahedra, %zu springs, %.1f cm^3, %.1f g\n", shape->node_count, fixed,
         shape->tetrahedron_count, made.spring_count, 1e6 * made.volume, 1e3 * DENSITY * made.volume);
  free_tissue(&made);
  return organ;
}

/* The centre of a tip that just touches the organ from above: over a triangle that lies high, level, near the middle. */
static void find_contact(const sinew_mesh_view *shape, const bounds *box, int up, double radius, float contact[3]) {
  double best = -HUGE_VAL;
  float middle[3];
  size_t i;
  int axis;
  for (axis = 0; axis < 3; axis++) middle[axis] = (box->low[axis] + box->high[axis]) / 2;
  for (i = 0; i < shape->surface_triangle_count; i++) {
    const float *a = position(shape, shape->surface[3 * i]), *b = position(shape, shape->surface[3 * i + 1]);
    const float *c = position(shape, shape->surface[3 * i + 2]);
    float centre[3];
    double n[3], level, merit;
    for (axis = 0; axis < 3; axis++) centre[axis] = (a[axis] + b[axis] + c[axis]) / 3;
    triangle_normal(a, b, c, n);
    level = n[up] / sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]); /* the cosine of its slope */
    merit = 2 * centre[up] - aside(centre, middle, up) + level * ((double)box->high[up] - box->low[up]);
    if (level <= 0 || merit <= best) continue;
    best = merit;
    memcpy(contact, centre, sizeof centre);
    contact[up] += (float)(radius / level);
  }
  for (i = 0; i < 3 * shape->surface_triangle_count; i++) { /* clear of what stands higher around it */
    const float *p = position(shape, shape->surface[i]);
    const double square = radius * radius - aside(p, contact, up) * aside(p, contact, up);
    if (square > 0) contact[up] = fmaxf(contact[up], p[up] + (float)sqrt(square));
  }
}

/* How far the tip is below its first contact at a time, from -clearance to depth and back. */
static double depth_at(double t, double clearance, double depth) {
  return (clearance + depth) * (smooth(t / PRESS) - smooth((t - PRESS - HOLD) / LEAVE)) - clearance;
}

static double farthest_moved(sinew_vec3_view nodes, const float *positions) {
  double farthest = 0;
  size_t i;
  for (i = 0; i < nodes.count; i++) farthest = fmax(farthest, distance(node(nodes, i), positions + 3 * i));
  return farthest;
}

int main(int argc, char **argv) {
  const options chosen = read_options(argc, argv, 3);
  const double scale = chosen.argument_count > 1 ? atof(chosen.arguments[1]) : 1;
  const int up = chosen.argument_count > 2 ? chosen.arguments[2][0] - 'x' : 1;
  const int all_frames = (int)lround((PRESS + HOLD + LEAVE + REST) / FRAME);
  const int frame_count = chosen.frame_count > 0 ? chosen.frame_count : all_frames;
  const int deepest_frame = (int)lround((PRESS + HOLD) / FRAME);
  double extent[3], radius, depth, peak = 0, total = 0, slowest = 0;
  int frame, axis;
  float contact[3];
  FILE *curve;
  bounds box, seen;
  sinew_mesh_view shape;
  sinew_mesh *mesh;
  sinew_world *world = create_world(0); /* the mesh is the organ as it lies among others, which carry its weight */
  sinew_body_id organ;
  sinew_tool_def tip_def;
  sinew_tool_id tip;
  sinew_picture_def picture;

  if (up < 0 || up > 2) fail("x, y or z, not", chosen.arguments[2]);
  if (chosen.argument_count > 0) {
    CHECK(sinew_mesh_load(chosen.arguments[0], SINEW_MESH_FORMAT_AUTO, (float)scale, &mesh));
    printf("%s, 1 unit = %g m: ", chosen.arguments[0], scale);
  } else {
    CHECK(sinew_mesh_create_organ(0.2f, 0.008f, &mesh));
    printf("an organ: ");
  }
  shape.struct_size = sizeof shape;
  CHECK(sinew_mesh_get_view(mesh, &shape));
  if (shape.tetrahedron_count == 0) fail("no tetrahedra in", chosen.arguments[0]);

  box = find_bounds(&shape);
  for (axis = 0; axis < 3; axis++) extent[axis] = (double)box.high[axis] - box.low[axis];
  printf("%.1f x %.1f x %.1f mm\n", 1e3 * extent[0], 1e3 * extent[1], 1e3 * extent[2]);
  organ = create_organ(world, &shape, up);
  radius = fmax(TIP * fmax(extent[0], fmax(extent[1], extent[2])), mean_edge(&shape));
  depth = fmin(DEPTH * radius, DEEPEST * extent[up]);
  find_contact(&shape, &box, up, radius, contact);

  CHECK(sinew_tool_def_init(&tip_def, sizeof tip_def));
  tip_def.shape = SINEW_SHAPE_SPHERE;
  tip_def.radius = (float)radius;
  memcpy(tip_def.position, contact, sizeof contact);
  tip_def.position[up] += (float)(CLEARANCE * radius);
  CHECK(sinew_tool_create(world, &tip_def, &tip));

  seen = box;
  seen.high[up] = contact[up] + (float)radius;
  picture = camera(seen.low, seen.high, up);
  save_picture(world, &picture, chosen.directory, "press_before.png");
  curve = create_file(chosen.directory, "press.csv");
  fprintf(curve, "time_s,depth_m,force_N,substeps,frame_ms\n");

  printf("a tip of %.1f mm radius goes in along -%c to %.1f mm\n\n", 1e3 * radius, "xyz"[up], 1e3 * depth);
  printf("  time s   depth mm    force N   moved mm   substeps   ms/frame\n");
  for (frame = 1; frame <= frame_count; frame++) {
    const double time = frame * FRAME, in = depth_at(time, CLEARANCE * radius, depth), started = seconds_now();
    float place[3], force[3], torque[3];
    double spent;
    sinew_step_report report;
    sinew_vec3_view nodes;

    memcpy(place, contact, sizeof place);
    place[up] -= (float)in;
    report.struct_size = sizeof report;
    CHECK(sinew_tool_set_pose(world, tip, place, NULL));
    CHECK(sinew_world_step(world, (float)FRAME, &report));
    CHECK(sinew_tool_get_wrench(world, tip, force, torque));
    CHECK(sinew_body_get_positions(world, organ, &nodes));
    spent = seconds_now() - started;

    total += spent;
    slowest = fmax(slowest, spent);
    peak = fmax(peak, force[up]);
    fprintf(curve, "%.6f,%.6f,%.6f,%u,%.3f\n", time, in, force[up], (unsigned)report.substeps, 1e3 * spent);
    clear_progress();
    if (frame % 10 == 0) {
      printf("%8.2f%11.2f%11.4f%11.2f%11u%11.2f\n", time, 1e3 * in, force[up],
             1e3 * farthest_moved(nodes, shape.positions), (unsigned)report.substeps, 1e3 * spent);
    }
    if (frame == deepest_frame) save_picture(world, &picture, chosen.directory, "press_during.png");
    show_progress(frame, frame_count);
  }
  clear_progress();
  save_picture(world, &picture, chosen.directory, "press_after.png");
  printf("\npeak force %.4f N at %.2f mm; %.2f ms per frame, %.2f the slowest: %.1f times real time\n", peak, 1e3 * depth,
         1e3 * total / frame_count, 1e3 * slowest, frame_count * FRAME / total);

  fclose(curve);
  sinew_mesh_destroy(mesh);
  sinew_world_destroy(world);
  return 0;
}
