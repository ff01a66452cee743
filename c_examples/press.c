/* An instrument's tip is pressed into an organ, held there and taken away (Halic et al., figure 7).
 *
 *   press [-o DIRECTORY] [-n FRAMES] [FILE [SCALE]]
 *
 * FILE is a tetrahedral mesh (.vtk .msh .node), SCALE what one of its units is in metres (1; 0.001 for millimetres);
 * without a file an organ is made. It is pressed along its thinnest axis, from above, and fixed at its back.
 * Leaves press_before.png, press_during.png, press_after.png and the force curve press.csv in the directory. */
#include "example.h"

#define YOUNG 5400.0    /* Pa: liver */
#define DENSITY 1060.0  /* kg/m^3: liver */
#define DAMPING 20.0    /* 1/s: how fast a free node loses its speed; the tissue comes to rest without swinging */
#define BACK 0.2        /* of the thickness: what lies lower is fixed */
#define TIP 0.1         /* of the longest extent: the radius of the tip */
#define DEPTH 0.25      /* of the thickness: how far it goes in */
#define CLEARANCE 0.5   /* of the radius: how far above the organ it starts and ends */
#define PRESS 1.0       /* s: the tip comes down, */
#define HOLD 0.5        /* s: stays, */
#define LEAVE 1.0       /* s: goes up again, */
#define REST 0.5        /* s: and the tissue comes to rest */

typedef struct bounds {
  float low[3], high[3];
  int thin, longest; /* axes */
} bounds;

static double extent(const bounds *box, int axis) { return (double)box->high[axis] - box->low[axis]; }

static bounds find_bounds(const sinew_mesh_view *shape) {
  bounds box;
  size_t i;
  int axis;
  memcpy(box.low, shape->positions, sizeof box.low);
  memcpy(box.high, shape->positions, sizeof box.high);
  for (i = 0; i < 3 * shape->node_count; i++) {
    box.low[i % 3] = fminf(box.low[i % 3], shape->positions[i]);
    box.high[i % 3] = fmaxf(box.high[i % 3], shape->positions[i]);
  }
  box.thin = 1; /* y where two are equal */
  box.longest = 0;
  for (axis = 0; axis < 3; axis++) {
    if (extent(&box, axis) < extent(&box, box.thin)) box.thin = axis;
    if (extent(&box, axis) > extent(&box, box.longest)) box.longest = axis;
  }
  return box;
}

static double tetrahedron_volume(const float *const p[4]) {
  double u[3], v[3], w[3];
  int i;
  for (i = 0; i < 3; i++) u[i] = p[1][i] - p[0][i], v[i] = p[2][i] - p[0][i], w[i] = p[3][i] - p[0][i];
  return fabs(u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) +
              u[2] * (v[0] * w[1] - v[1] * w[0])) / 6;
}

typedef struct edge { uint32_t a, b; float stiffness; } edge;

static int compare_edges(const void *left, const void *right) {
  const edge *l = (const edge *)left, *r = (const edge *)right;
  if (l->a != r->a) return l->a < r->a ? -1 : 1;
  return l->b < r->b ? -1 : l->b > r->b;
}

/* What makes tissue of a mesh. To its four corners a tetrahedron of volume V gives a quarter of its mass each; to its six
 * edges, which are the springs, a stiffness of E V / L^2 each (Van Gelder 1998), so that slivers make no stiff springs. */
typedef struct tissue {
  float *masses, *dampings, *stiffnesses;
  uint32_t *springs;
  size_t spring_count;
  double volume;
} tissue;

static tissue create_tissue(const sinew_mesh_view *shape) {
  static const int ends[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
  const size_t edge_count = 6 * shape->tetrahedron_count;
  edge *edges = (edge *)allocate(edge_count, sizeof *edges);
  tissue made;
  size_t i, j;
  made.masses = (float *)allocate(shape->node_count, sizeof(float));
  made.dampings = (float *)allocate(shape->node_count, sizeof(float));
  made.stiffnesses = (float *)allocate(edge_count, sizeof(float));
  made.springs = (uint32_t *)allocate(2 * edge_count, sizeof(uint32_t));
  made.spring_count = 0;
  made.volume = 0;

  for (i = 0; i < shape->tetrahedron_count; i++) {
    const uint32_t *corner = shape->tetrahedra + 4 * i;
    const float *p[4];
    double volume;
    for (j = 0; j < 4; j++) p[j] = shape->positions + 3 * (size_t)corner[j];
    volume = tetrahedron_volume(p);
    made.volume += volume;
    for (j = 0; j < 4; j++) made.masses[corner[j]] += (float)(DENSITY * volume / 4);
    for (j = 0; j < 6; j++) {
      const uint32_t a = corner[ends[j][0]], b = corner[ends[j][1]];
      const double length = distance(p[ends[j][0]], p[ends[j][1]]);
      edge *e = edges + 6 * i + j;
      e->a = a < b ? a : b;
      e->b = a < b ? b : a;
      e->stiffness = (float)(YOUNG * volume / (length * length));
    }
  }
  qsort(edges, edge_count, sizeof *edges, compare_edges);
  for (i = 0; i < edge_count; i++) { /* tetrahedra that share an edge add up */
    if (i == 0 || compare_edges(edges + i - 1, edges + i) != 0) {
      made.springs[2 * made.spring_count] = edges[i].a;
      made.springs[2 * made.spring_count + 1] = edges[i].b;
      made.spring_count++;
    }
    made.stiffnesses[made.spring_count - 1] += edges[i].stiffness;
  }
  for (i = 0; i < shape->node_count; i++) made.dampings[i] = (float)DAMPING * made.masses[i];
  free(edges);
  return made;
}

static void free_tissue(tissue *made) {
  free(made->masses);
  free(made->dampings);
  free(made->stiffnesses);
  free(made->springs);
}

static sinew_body_id create_organ(sinew_world *world, const sinew_mesh_view *shape, const bounds *box) {
  const float back = (float)(box->low[box->thin] + BACK * extent(box, box->thin));
  tissue liver = create_tissue(shape);
  size_t i, fixed = 0;
  sinew_body_def def;
  sinew_body_id organ;

  for (i = 0; i < shape->node_count; i++) {
    if (shape->positions[3 * i + (size_t)box->thin] > back) continue;
    liver.masses[i] = 0; /* pinned for good */
    fixed++;
  }
  CHECK(sinew_body_def_init(&def, sizeof def));
  def.positions = shape->positions;
  def.node_count = shape->node_count;
  def.masses = liver.masses;
  def.node_dampings = liver.dampings;
  def.springs = liver.springs;
  def.spring_count = liver.spring_count;
  def.stiffnesses = liver.stiffnesses;
  def.triangles = shape->surface; /* what the instrument meets and the picture shows */
  def.triangle_count = shape->surface_triangle_count;
  def.tetrahedra = shape->tetrahedra;
  def.tetrahedron_count = shape->tetrahedron_count;
  CHECK(sinew_body_create(world, &def, &organ));

  printf("%.1f x %.1f x %.1f mm, %.0f cm^3, %.0f g\n", 1e3 * extent(box, 0), 1e3 * extent(box, 1), 1e3 * extent(box, 2),
         1e6 * liver.volume, 1e3 * DENSITY * liver.volume);
  printf("%zu nodes, %zu of them fixed, %zu tetrahedra, %zu springs\n", shape->node_count, fixed,
         shape->tetrahedron_count, liver.spring_count);
  free_tissue(&liver);
  return organ;
}

/* The centre of a tip that just touches the organ from above, over a high point near the middle. */
static void find_contact(const sinew_mesh_view *shape, const bounds *box, double radius, float contact[3]) {
  const int up = box->thin, a = (up + 1) % 3, b = (up + 2) % 3;
  const float x = (box->low[a] + box->high[a]) / 2, y = (box->low[b] + box->high[b]) / 2;
  const size_t count = 3 * shape->surface_triangle_count;
  double best = -HUGE_VAL;
  size_t i;
  for (i = 0; i < count; i++) { /* the point to press: height counts twice what distance from the middle does */
    const float *p = shape->positions + 3 * (size_t)shape->surface[i];
    const double merit = 2 * p[up] - hypot(p[a] - x, p[b] - y);
    if (merit > best) best = merit, memcpy(contact, p, 3 * sizeof *p);
  }
  for (i = 0; i < count; i++) { /* how high a tip over it must be to clear the points around */
    const float *p = shape->positions + 3 * (size_t)shape->surface[i];
    const double aside = hypot(p[a] - contact[a], p[b] - contact[b]);
    if (aside < radius) contact[up] = fmaxf(contact[up], p[up] + (float)sqrt(radius * radius - aside * aside));
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
  const options chosen = read_options(argc, argv, 2);
  const double scale = chosen.argument_count > 1 ? atof(chosen.arguments[1]) : 1;
  const int all_frames = (int)lround((PRESS + HOLD + LEAVE + REST) / FRAME);
  const int frame_count = chosen.frame_count > 0 ? chosen.frame_count : all_frames;
  const int deepest_frame = (int)lround((PRESS + HOLD) / FRAME);
  double radius, depth, peak = 0, total = 0, slowest = 0;
  int frame, up;
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
  up = box.thin;
  organ = create_organ(world, &shape, &box);
  radius = TIP * extent(&box, box.longest);
  depth = DEPTH * extent(&box, up);
  find_contact(&shape, &box, radius, contact);

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
