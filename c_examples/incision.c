/* A scalpel opens a sheet of skin that is stretched as skin is, and feels it; the wound gapes, and two sutures pull it together. Then it opens an
 * organ whose ends are pulled apart.
 *
 *   incision [-o DIRECTORY] [-n FRAMES]
 *
 * What is drawn here is a mesh of the program's own, which follows the list of changes alone: each new node gets what it carries, texture
 * coordinates on the skin and its place at rest on and in the organ, from what it lies between. Leaves incision_open.png, incision_sutured.png,
 * incision_organ.png and incision.csv in the directory. */
#include "example.h"

#define SIZE 0.12        /* m: a square */
#define CELLS 36         /* along a side */
#define STRETCH 1.08     /* of its length at rest, across the cut */
#define DENSITY 1.0      /* kg/m^2: a millimetre of tissue */
#define STIFFNESS 80.0   /* N/m per spring */
#define DAMPING 15.0     /* 1/s: how fast a free node loses its speed */
#define TOUGHNESS 0.1    /* J/m: 100 J/m^2 */
#define LENGTH 0.06      /* m: the way of the scalpel */
#define BITE 0.006       /* m: how far from the cut a suture holds */
#define CUT 1.0          /* s: the scalpel goes along, */
#define GAPE 0.5         /* s: the wound gapes, */
#define CLOSE 1.0        /* s: the sutures are tightened, */
#define HOLD 0.5         /* s: and hold */
#define SPARE 4000       /* nodes that cuts may add */

#define ORGAN 0.14       /* m: how long the organ is, along x */
#define SPACING 0.006    /* m: of its nodes */
#define PULL 1.15        /* of its length at rest, along x */
#define HELD 0.75        /* of half its length: what lies beyond is held */
#define DEEP 0.018       /* m: the cut, below the top */
#define WIDE 0.05        /* m: the cut, along z */
#define YOUNG 5000.0     /* Pa */
#define POISSON 0.35
#define ORGAN_DENSITY 1060.0 /* kg/m^3 */

static const double node_mass = DENSITY * (SIZE / CELLS) * (SIZE / CELLS);

/* What a renderer keeps. */
typedef struct drawing {
  uint64_t version;
  size_t per_node; /* how many numbers each node carries, */
  float *carried;  /* and these */
  size_t node_count;
  uint32_t *triangles;
  size_t triangle_count;
} drawing;

/* Held at its rim, wider along z than at rest. */
static sinew_body_id create_skin(sinew_world *world, const sinew_mesh_view *shape) {
  const float inside = (float)(0.499 * SIZE);
  float *masses = (float *)allocate(shape->node_count, sizeof *masses);
  float *stretched = (float *)allocate(3 * shape->node_count, sizeof *stretched);
  sinew_body_def def;
  sinew_body_id skin;
  size_t i;
  for (i = 0; i < shape->node_count; i++) {
    const float *p = shape->positions + 3 * i;
    memcpy(stretched + 3 * i, p, 3 * sizeof *p);
    stretched[3 * i + 2] *= (float)STRETCH;
    if (fabsf(p[0]) < inside && fabsf(p[2]) < inside) masses[i] = (float)node_mass; /* 0 is pinned for good */
  }
  CHECK(sinew_body_def_init(&def, sizeof def));
  def.positions = stretched;
  def.rest_positions = shape->positions;
  def.node_count = shape->node_count;
  def.triangles = shape->triangles;
  def.triangle_count = shape->triangle_count;
  def.masses = masses;
  def.node_damping = (float)(DAMPING * node_mass);
  def.stiffness = (float)STIFFNESS;
  def.spare_nodes = SPARE;
  def.toughness = (float)TOUGHNESS;
  CHECK(sinew_body_create(world, &def, &skin));
  free(masses), free(stretched);
  return skin;
}

/* With so many numbers per node, of which the program sets those of nodes that are there. */
static drawing create_drawing(const sinew_world *world, sinew_body_id body, size_t node_count, size_t per_node) {
  sinew_triangle_view triangles;
  uint32_t max_nodes, max_triangles; /* what cuts may make of it: no list grows */
  drawing made;
  CHECK(sinew_body_get_triangles(world, body, &triangles));
  CHECK(sinew_body_get_max_counts(world, body, &max_nodes, &max_triangles));
  made.version = 0;
  made.per_node = per_node;
  made.node_count = node_count;
  made.carried = (float *)allocate(per_node * max_nodes, sizeof *made.carried);
  made.triangle_count = triangles.count;
  made.triangles = (uint32_t *)allocate(3 * max_triangles, sizeof *made.triangles);
  memcpy(made.triangles, triangles.data, 3 * triangles.count * sizeof *made.triangles);
  return made;
}

/* Takes over what has changed since the last time. */
static void follow(drawing *mine, const sinew_world *world, sinew_body_id body) {
  sinew_topology_changes changes;
  sinew_triangle_view triangles;
  size_t i, j, k;
  changes.struct_size = sizeof changes;
  CHECK(sinew_body_get_topology_changes(world, body, mine->version, &changes));
  CHECK(sinew_body_get_triangles(world, body, &triangles));
  for (i = 0; i < changes.node_count; i++) {
    const sinew_new_node *added = changes.nodes + i;
    float *carried = mine->carried + mine->per_node * added->node;
    for (j = 0; j < 3; j++) {
      const float *source = mine->carried + mine->per_node * added->sources[j];
      for (k = 0; k < mine->per_node; k++) carried[k] += added->weights[j] * source[k];
    }
  }
  for (i = 0; i < changes.triangle_count; i++) {
    memcpy(mine->triangles + 3 * changes.triangles[i], triangles.data + 3 * changes.triangles[i], 3 * sizeof *mine->triangles);
  }
  mine->version = changes.version;
  mine->node_count += changes.node_count;
  mine->triangle_count = triangles.count;
}

/* How much of the texture is drawn: all of it, whatever was cut. */
static double texture_area(const drawing *mine) {
  double sum = 0;
  size_t i;
  for (i = 0; i < mine->triangle_count; i++) {
    const uint32_t *corner = mine->triangles + 3 * i;
    const float *a = mine->carried + 2 * corner[0], *b = mine->carried + 2 * corner[1], *c = mine->carried + 2 * corner[2];
    sum += fabs(((double)b[0] - a[0]) * ((double)c[1] - a[1]) - ((double)b[1] - a[1]) * ((double)c[0] - a[0])) / 2;
  }
  return sum;
}

/* Volume that the render surface encloses at rest: all of it, whatever was cut. */
static double enclosed_volume(const drawing *mine) {
  double sum = 0;
  size_t i;
  for (i = 0; i < mine->triangle_count; i++) {
    const uint32_t *corner = mine->triangles + 3 * i;
    const float *a = mine->carried + 3 * corner[0], *b = mine->carried + 3 * corner[1], *c = mine->carried + 3 * corner[2];
    sum += a[0] * ((double)b[1] * c[2] - (double)b[2] * c[1]) + a[1] * ((double)b[2] * c[0] - (double)b[0] * c[2]) +
           a[2] * ((double)b[0] * c[1] - (double)b[1] * c[0]);
  }
  return sum / 6;
}

/* Where the scalpel is on its way, which is a little curved, and how far above the skin its edge's middle. */
static void place_of(double along, double height, float place[3]) {
  place[0] = (float)(LENGTH * (along - 0.5));
  place[1] = (float)height;
  place[2] = (float)(0.004 * sin(3 * along));
}

/* An upright edge, in the skin. */
static sinew_blade_id create_scalpel(sinew_world *world) {
  sinew_blade_def def;
  sinew_blade_id scalpel;
  CHECK(sinew_blade_def_init(&def, sizeof def));
  def.edge[1] = -0.05f, def.edge[4] = 0.05f;
  place_of(0, 0, def.position);
  CHECK(sinew_blade_create(world, &def, &scalpel));
  return scalpel;
}

/* The triangle that is drawn at a place of the sheet at rest, by the texture, and its point there. */
static uint32_t point_at(const drawing *mine, double u, double v, float weights[3]) {
  size_t i;
  for (i = 0; i < mine->triangle_count; i++) {
    const uint32_t *corner = mine->triangles + 3 * i;
    double parts[3], whole = 0;
    int j;
    for (j = 0; j < 3; j++) {
      const float *a = mine->carried + 2 * corner[(j + 1) % 3], *b = mine->carried + 2 * corner[(j + 2) % 3];
      parts[j] = (a[0] - u) * (b[1] - v) - (a[1] - v) * (b[0] - u);
      whole += parts[j];
    }
    for (j = 0; j < 3; j++) weights[j] = (float)(parts[j] / whole);
    if (weights[0] >= 0 && weights[1] >= 0 && weights[2] >= 0) return (uint32_t)i;
  }
  fail("no triangle", "at a suture");
  return 0;
}

static sinew_attachment_id suture(sinew_world *world, sinew_body_id skin, const drawing *mine, double along) {
  const double x = LENGTH * (along - 0.5), z = 0.004 * sin(3 * along) / STRETCH;
  sinew_surface_point above, below;
  sinew_attachment_id made;
  above.struct_size = below.struct_size = sizeof above;
  above.body = below.body = skin;
  above.triangle = point_at(mine, x / SIZE + 0.5, (z + BITE) / SIZE + 0.5, above.weights);
  below.triangle = point_at(mine, x / SIZE + 0.5, (z - BITE) / SIZE + 0.5, below.weights);
  CHECK(sinew_suture_create(world, &above, &below, NULL, &made));
  return made;
}

static void open_skin(options chosen) {
  const float size[2] = {SIZE, SIZE};
  const uint32_t cells[2] = {CELLS, CELLS};
  const float low[3] = {-SIZE / 2, -0.01f, -SIZE / 2}, high[3] = {SIZE / 2, 0.01f, SIZE / 2};
  const int all_frames = (int)lround((CUT + GAPE + CLOSE + HOLD) / FRAME);
  const int frame_count = chosen.frame_count > 0 ? chosen.frame_count : all_frames;
  sinew_world *world = create_world(9.81f);
  sinew_attachment_id sutures[2];
  double wide[2] = {0, 0}, length = 0, work = 0, whole;
  int frame, suture_count = 0, i;
  sinew_mesh_view shape;
  sinew_mesh *mesh;
  sinew_body_id skin;
  sinew_blade_id scalpel;
  sinew_picture_def picture;
  drawing mine;
  FILE *table;

  CHECK(sinew_mesh_create_cloth(size, cells, &mesh));
  shape.struct_size = sizeof shape;
  CHECK(sinew_mesh_get_view(mesh, &shape));
  skin = create_skin(world, &shape);
  scalpel = create_scalpel(world);
  mine = create_drawing(world, skin, shape.node_count, 2);
  for (i = 0; i < (int)shape.node_count; i++) {
    mine.carried[2 * i] = (float)(shape.positions[3 * i] / SIZE + 0.5);
    mine.carried[2 * i + 1] = (float)(shape.positions[3 * i + 2] / SIZE + 0.5);
  }
  whole = texture_area(&mine);
  picture = camera(low, high, 1);
  table = create_file(chosen.directory, "incision.csv");
  fprintf(table, "time s,cut mm,nodes,triangles,width 1 mm,width 2 mm,force 1 N,force 2 N,scalpel N\n");

  printf("skin of %d x %d cells, %.0f mm wide, stretched by %.0f %% across the cut\n\n", CELLS, CELLS, 1e3 * SIZE,
         100 * (STRETCH - 1));
  printf("width: how far apart the points of the two sutures are; drawn: of the texture, by a mesh that follows the list of changes\n\n");
  printf("  time s   cut mm   nodes  triangles   width mm            force N             drawn\n");
  for (frame = 1; frame <= frame_count; frame++) {
    const double time = frame * FRAME;
    float forces[2] = {0, 0}, place[3];
    sinew_blade_report report;
    report.struct_size = sizeof report;
    /* At the end it is lifted out. */
    place_of(smooth(time / CUT), time < CUT + 2 * FRAME ? 0 : 0.2, place);
    CHECK(sinew_blade_set_pose(world, scalpel, place, NULL));
    if (suture_count == 0 && time > CUT + GAPE) {
      save_picture(world, &picture, chosen.directory, "incision_open.png");
      for (i = 0; i < 2; i++) sutures[i] = suture(world, skin, &mine, i == 0 ? 0.35 : 0.65);
      suture_count = 2;
    }
    for (i = 0; i < suture_count; i++) {
      /* A little shorter than the points were apart at rest: the edges of the wound lie on each other. */
      sinew_suture_report how;
      float force[3];
      how.struct_size = sizeof how;
      CHECK(sinew_suture_get_report(world, sutures[i], &how));
      wide[i] = how.distance;
      CHECK(sinew_suture_set_length(world, sutures[i],
                                    (float)(how.length + (1.9 * BITE - how.length) * smooth((time - CUT - GAPE) / CLOSE))));
      CHECK(sinew_attachment_get_force(world, sutures[i], force));
      forces[i] = sqrtf(force[0] * force[0] + force[1] * force[1] + force[2] * force[2]);
    }
    CHECK(sinew_world_step(world, (float)FRAME, NULL));
    CHECK(sinew_blade_get_report(world, scalpel, &report));
    length += report.length;
    work += report.work;
    follow(&mine, world, skin);
    clear_progress();
    fprintf(table, "%.4f,%.3f,%zu,%zu,%.3f,%.3f,%.4f,%.4f,%.4f\n", time, 1e3 * length, mine.node_count, mine.triangle_count, 1e3 * wide[0],
            1e3 * wide[1], (double)forces[0], (double)forces[1],
            sqrt((double)report.force[0] * report.force[0] + (double)report.force[2] * report.force[2]));
    if (frame % 10 == 0) {
      printf("%8.2f%9.1f%8zu%11zu%10.2f%8.2f%10.4f%10.4f%10.6f\n", time, 1e3 * length, mine.node_count, mine.triangle_count,
             1e3 * wide[0], 1e3 * wide[1], (double)forces[0], (double)forces[1], texture_area(&mine) / whole);
    }
    show_progress(frame, frame_count);
  }
  clear_progress();
  save_picture(world, &picture, chosen.directory, "incision_sutured.png");
  fclose(table);
  printf("\nthe scalpel's work is %.3f of the skin's toughness times the length that it cut", work / (TOUGHNESS * length));
  printf("\nat the end the mesh that follows the list draws %.6f of its texture\n", texture_area(&mine) / whole);

  free(mine.carried), free(mine.triangles);
  sinew_mesh_destroy(mesh);
  sinew_world_destroy(world);
}

/* Longer along x than at rest, and held at its ends. */
static sinew_body_id create_organ(sinew_world *world, const sinew_mesh_view *shape) {
  float *stretched = (float *)allocate(3 * shape->node_count, sizeof *stretched);
  sinew_body_def def;
  sinew_body_id organ;
  size_t i;
  for (i = 0; i < shape->node_count; i++) {
    memcpy(stretched + 3 * i, shape->positions + 3 * i, 3 * sizeof *stretched);
    stretched[3 * i] *= (float)PULL;
  }
  CHECK(sinew_body_def_init(&def, sizeof def));
  def.positions = stretched;
  def.rest_positions = shape->positions;
  def.node_count = shape->node_count;
  def.tetrahedra = shape->tetrahedra;
  def.tetrahedron_count = shape->tetrahedron_count;
  def.material = SINEW_MATERIAL_TETRAHEDRA;
  def.young_modulus = (float)YOUNG;
  def.poisson_ratio = (float)POISSON;
  def.density = (float)ORGAN_DENSITY;
  def.node_damping = 2e-3f;
  def.spare_nodes = SPARE;
  CHECK(sinew_body_create(world, &def, &organ));
  for (i = 0; i < shape->node_count; i++) {
    if (fabs(shape->positions[3 * i]) > HELD * ORGAN / 2) CHECK(sinew_body_pin(world, organ, (uint32_t)i));
  }
  free(stretched);
  return organ;
}

/* Across the organ, along z, from one end of the cut to the other, while the scalpel leans a little and its tip follows the top. */
static void cut_organ(sinew_world *world, sinew_body_id organ, double top, double from, double to, sinew_cut_report *report) {
  const double ends[2] = {from, to};
  float edges[2][6];
  int i;
  for (i = 0; i < 2; i++) {
    const float z = (float)(WIDE * (ends[i] - 0.5)), x = (float)(0.003 * sin(4 * ends[i]));
    edges[i][0] = edges[i][3] = x;
    edges[i][2] = edges[i][5] = z;
    edges[i][1] = (float)(top - DEEP), edges[i][4] = (float)(top + 0.02), edges[i][5] += 0.006f;
  }
  CHECK(sinew_body_cut(world, organ, edges[0], edges[1], report));
}

static void open_organ(options chosen) {
  const float low[3] = {-0.035f, -0.01f, -0.035f}, high[3] = {0.035f, 0.02f, 0.035f};
  const int all_frames = (int)lround((CUT + GAPE) / FRAME);
  const int frame_count = chosen.frame_count > 0 ? chosen.frame_count : all_frames;
  sinew_world *world = create_world(0); /* as if it lay in its place */
  double area = 0, top = 0, whole;
  sinew_mesh_view shape;
  sinew_mesh *mesh;
  sinew_body_id organ;
  sinew_picture_def picture = camera(low, high, 1);
  drawing mine;
  size_t i;
  int frame;

  CHECK(sinew_mesh_create_organ((float)ORGAN, (float)SPACING, &mesh));
  shape.struct_size = sizeof shape;
  CHECK(sinew_mesh_get_view(mesh, &shape));
  organ = create_organ(world, &shape);
  mine = create_drawing(world, organ, shape.node_count, 3);
  memcpy(mine.carried, shape.positions, 3 * shape.node_count * sizeof *mine.carried);
  for (i = 0; i < shape.node_count; i++) {
    if (fabs(shape.positions[3 * i]) < 0.02 && shape.positions[3 * i + 1] > top) top = shape.positions[3 * i + 1];
  }
  whole = enclosed_volume(&mine);
  printf("\nan organ of %zu tetrahedra, %.0f mm long, stretched by %.0f %%: a cut %.0f mm deep\n\n", shape.tetrahedron_count,
         1e3 * ORGAN, 100 * (PULL - 1), 1e3 * DEEP);
  printf("  time s  cut mm^2   nodes  triangles      drawn\n");
  for (frame = 1; frame <= frame_count; frame++) {
    const double time = frame * FRAME, before = smooth((time - FRAME) / CUT), now = smooth(time / CUT);
    sinew_cut_report report;
    report.struct_size = sizeof report;
    if (now > before) {
      cut_organ(world, organ, top, before, now, &report);
      area += report.area;
      follow(&mine, world, organ);
    }
    CHECK(sinew_world_step(world, (float)FRAME, NULL));
    clear_progress();
    if (frame % 10 == 0) {
      printf("%8.2f%10.1f%8zu%11zu%11.6f\n", time, 1e6 * area, mine.node_count, mine.triangle_count, enclosed_volume(&mine) / whole);
    }
    show_progress(frame, frame_count);
  }
  clear_progress();
  save_picture(world, &picture, chosen.directory, "incision_organ.png");
  printf("\nat the end the mesh that follows the list encloses %.6f of its volume at rest\n", enclosed_volume(&mine) / whole);
  free(mine.carried), free(mine.triangles);
  sinew_mesh_destroy(mesh);
  sinew_world_destroy(world);
}

int main(int argc, char **argv) {
  const options chosen = read_options(argc, argv, 0);
  open_skin(chosen);
  open_organ(chosen);
  return 0;
}
