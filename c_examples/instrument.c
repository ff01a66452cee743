/* The jaws of a forceps stroke an organ, then grip its rim, lift it and let it go: what touches what, and what the hand would feel.
 *
 *   instrument [-o DIRECTORY] [-n FRAMES] [FILE [SCALE]]
 *
 * FILE is a jaw of your own, a closed surface (.stl .obj), SCALE what one of its units is in metres (1; 0.001 for millimetres). It has its
 * hinge in the origin, reaches along +z and meets the other, which is the same, turned over, at y = 0, lying below. Without a file a jaw is
 * made. Leaves instrument_stroke.png, _grip.png and _lift.png, with a dot where a jaw presses and a line along the force
 * on it, and instrument.csv in the directory. Fails where the jaws do not touch, hold or let go as they should. */
#include "example.h"

#define PI 3.14159265358979
#define ORGAN 0.1f        /* m: how long it is */
#define SPACING 0.005f    /* m: of its nodes */
#define BED 0.03f         /* m: left of this its underside is fixed to a bed, right of it it hangs free; */
#define BED_TOP -0.006f   /* m: how high the bed reaches */
#define DAMPING 1.6e-3f   /* N s/m: how a node is slowed down; the tissue comes to rest without swinging long */
#define FRICTION 0.3f     /* of the jaws */
#define DEPTH 0.0025f     /* m: how far the tips go in as they stroke */
#define GRIP 0.08f        /* N: what each jaw closes with */
#define LIFT 0.015f       /* m */
#define JAW 0.04          /* m: the length of a jaw that is made */
#define HOLDS 3           /* points that each jaw holds, */
#define NEAR 0.0015f      /* m: no further from it than this */

typedef struct quaternion { float xyzw[4]; } quaternion;

/* First b, then a. */
static quaternion turned(quaternion a, quaternion b) {
  const float *p = a.xyzw, *q = b.xyzw;
  const quaternion both = {{p[3] * q[0] + p[0] * q[3] + p[1] * q[2] - p[2] * q[1], p[3] * q[1] - p[0] * q[2] + p[1] * q[3] + p[2] * q[0],
                            p[3] * q[2] + p[0] * q[1] - p[1] * q[0] + p[2] * q[3], p[3] * q[3] - p[0] * q[0] - p[1] * q[1] - p[2] * q[2]}};
  return both;
}

static quaternion about(int axis, double angle) {
  quaternion made = {{0, 0, 0, 0}};
  made.xyzw[axis] = (float)sin(angle / 2), made.xyzw[3] = (float)cos(angle / 2);
  return made;
}

/* What lies at x = length, turned, from there. */
static void along_x(const float *from, quaternion q, double length, float to[3]) {
  const float *r = q.xyzw;
  to[0] = from[0] + (float)(length * (1 - 2 * (r[1] * r[1] + r[2] * r[2])));
  to[1] = from[1] + (float)(length * 2 * (r[0] * r[1] + r[3] * r[2]));
  to[2] = from[2] + (float)(length * 2 * (r[0] * r[2] - r[3] * r[1]));
}

/* How a forceps is held: it points along -x. */
typedef struct posture {
  float tip[3];               /* m: where its tips meet when it is closed */
  double tilt, roll, opening; /* rad: its tips down; about itself, at 0 one jaw is above the other; between the jaws */
} posture;

typedef struct forceps {
  sinew_tool_id jaws[2]; /* at roll 0 the upper and the lower */
  double length;
  sinew_attachment_id held[2 * HOLDS];
  size_t held_count;
} forceps;

static quaternion jaw_pose(posture held, double length, int jaw, float hinge[3]) {
  const quaternion frame = turned(about(1, PI), turned(about(2, -held.tilt), about(0, held.roll)));
  along_x(held.tip, frame, -length, hinge);
  return turned(turned(frame, about(2, (jaw ? -0.5 : 0.5) * held.opening)), about(0, jaw ? PI : 0));
}

/* A bar that tapers to its tip, with teeth below. */
static sinew_tool_id make_jaw(sinew_world *world, sinew_tool_def *def) {
  enum { SECTIONS = 21, ROUND = 7 }; /* of it, and the corners of each: flat below and an arch above */
  float positions[3 * ROUND * SECTIONS];
  uint32_t triangles[3 * 2 * ROUND * SECTIONS], *corner = triangles, section, i;
  sinew_tool_id jaw;
  for (section = 0; section < SECTIONS; section++) {
    const double along = (double)section / (SECTIONS - 1), below = 0.003 * (1 - along) + (section % 2 == 0 ? 0 : 0.0008);
    const double width = 0.004 - 0.0015 * along, above = 0.007 - 0.005 * along;
    for (i = 0; i < ROUND; i++) {
      const double angle = PI * i / (ROUND - 1);
      float *p = positions + 3 * (section * ROUND + i);
      const uint32_t here = section * ROUND + i, beside = section * ROUND + (i + 1) % ROUND;
      p[0] = (float)(JAW * along);
      p[1] = (float)(below + (above - below) * sin(angle));
      p[2] = (float)(width * cos(angle));
      if (section + 1 < SECTIONS) {
        const uint32_t sides[6] = {here, here + ROUND, beside + ROUND, here, beside + ROUND, beside};
        memcpy(corner, sides, sizeof sides), corner += 6;
      }
    }
  }
  for (i = 1; i + 1 < ROUND; i++) {
    const uint32_t last = ROUND * (SECTIONS - 1), ends[6] = {0, i, i + 1, last, last + i + 1, last + i};
    memcpy(corner, ends, sizeof ends), corner += 6;
  }
  def->positions = positions, def->node_count = ROUND * SECTIONS;
  def->triangles = triangles, def->triangle_count = (size_t)(corner - triangles) / 3;
  CHECK(sinew_tool_create(world, def, &jaw));
  return jaw;
}

/* Both jaws, of the caller's mesh or of one made here. */
static forceps create_forceps(sinew_world *world, posture held, const options *chosen) {
  forceps made;
  sinew_tool_def def;
  sinew_mesh *mesh = NULL;
  sinew_mesh_view shape;
  float *turned_over = NULL;
  size_t i;
  int jaw;
  made.length = JAW, made.held_count = 0;
  CHECK(sinew_tool_def_init(&def, sizeof def));
  def.shape = SINEW_SHAPE_MESH;
  def.friction = FRICTION;
  if (chosen->argument_count > 0) {
    const double scale = chosen->argument_count > 1 ? atof(chosen->arguments[1]) : 1;
    shape.struct_size = sizeof shape;
    CHECK(sinew_mesh_load(chosen->arguments[0], SINEW_MESH_FORMAT_AUTO, (float)scale, &mesh));
    CHECK(sinew_mesh_get_view(mesh, &shape));
    turned_over = (float *)allocate(3 * shape.node_count, sizeof(float));
    for (made.length = 0, i = 0; i < shape.node_count; i++) {
      const float *from = shape.positions + 3 * i;
      turned_over[3 * i] = from[2], turned_over[3 * i + 1] = -from[1], turned_over[3 * i + 2] = from[0];
      made.length = fmax(made.length, from[2]);
    }
    def.positions = turned_over, def.node_count = shape.node_count;
    def.triangles = shape.surface, def.triangle_count = shape.surface_triangle_count;
  }
  for (jaw = 0; jaw < 2; jaw++) {
    const quaternion q = jaw_pose(held, made.length, jaw, def.position);
    memcpy(def.orientation, q.xyzw, sizeof q.xyzw);
    if (mesh != NULL) CHECK(sinew_tool_create(world, &def, made.jaws + jaw));
    else made.jaws[jaw] = make_jaw(world, &def);
  }
  sinew_mesh_destroy(mesh), free(turned_over);
  return made;
}

/* Liver that lies on a bed with its left, hanging at rest over the bed's end with its right. */
static sinew_body_id create_organ(sinew_world *world, const sinew_mesh_view *shape) {
  sinew_material_preset liver;
  sinew_body_def def;
  sinew_body_id organ;
  size_t i;
  liver.struct_size = sizeof liver;
  CHECK(sinew_material_get_preset(SINEW_PRESET_LIVER, &liver));
  CHECK(sinew_body_def_init(&def, sizeof def));
  def.positions = shape->positions, def.node_count = shape->node_count;
  def.tetrahedra = shape->tetrahedra, def.tetrahedron_count = shape->tetrahedron_count;
  def.material = SINEW_MATERIAL_TETRAHEDRA;
  def.young_modulus = liver.young_modulus, def.poisson_ratio = 0.3f, def.density = liver.density;
  def.node_damping = DAMPING;
  CHECK(sinew_body_create(world, &def, &organ));
  for (i = 0; i < shape->node_count; i++) {
    const float *p = shape->positions + 3 * i;
    if (p[0] < BED && p[1] < BED_TOP) CHECK(sinew_body_pin(world, organ, (uint32_t)i));
  }
  CHECK(sinew_body_solve_equilibrium(world, organ, NULL, NULL));
  return organ;
}

/* How high the tissue stands: what a ray from above meets first. */
static float height_at(const sinew_world *world, float x) {
  const float from[3] = {x, 1, 0}, down[3] = {0, -1, 0};
  sinew_surface_point met;
  met.struct_size = sizeof met;
  CHECK(sinew_world_cast_ray(world, from, down, 2, &met));
  if (met.body.index1 == 0) fail("no tissue below", "the instrument");
  return met.position[1];
}

/* Each jaw holds the tissue that is nearest to some points of its inner side. */
static void hold(sinew_world *world, forceps *of, sinew_body_id organ) {
  int jaw, i;
  for (jaw = 0; jaw < 2; jaw++) {
    uint32_t triangles[HOLDS];
    float weights[3 * HOLDS], hinge[3], point[3];
    sinew_attachment_def def;
    quaternion q;
    size_t count = 0;
    CHECK(sinew_tool_get_pose(world, of->jaws[jaw], hinge, q.xyzw));
    for (i = 0; i < HOLDS; i++) {
      sinew_surface_point found;
      found.struct_size = sizeof found;
      along_x(hinge, q, of->length * (0.97 - 0.07 * i), point);
      CHECK(sinew_world_find_nearest(world, point, NEAR, &found));
      if (found.body.index1 == 0) continue;
      triangles[count] = found.triangle;
      memcpy(weights + 3 * count++, found.weights, sizeof found.weights);
    }
    if (count == 0) fail("nothing between", jaw ? "the lower jaw and the tissue" : "the upper jaw and the tissue");
    CHECK(sinew_attachment_def_init(&def, sizeof def));
    def.body = organ;
    def.tool = of->jaws[jaw];
    def.count = count;
    def.triangles = triangles;
    def.weights = weights;
    CHECK(sinew_attachment_create(world, &def, of->held + of->held_count));
    of->held_count += count;
  }
}

static double weight_times_height(const sinew_world *world, sinew_body_id organ) {
  sinew_energy energy;
  energy.struct_size = sizeof energy;
  CHECK(sinew_body_get_energy(world, organ, &energy));
  return energy.gravitational;
}

static double between(double a, double b, double share) { return a + (b - a) * share; }

enum { COME, STROKE, LEAVE, TURN, REACH, CLOSE, RAISE, STAY, LET_GO, BACK, REST, PHASES };
static const struct { const char *name; double seconds; } phases[PHASES] = {
    {"come", 0.3}, {"stroke", 0.8}, {"leave", 0.2}, {"turn", 0.4}, {"reach", 0.3}, {"close", 0.6},
    {"lift", 0.8}, {"stay", 0.4}, {"let go", 0.3}, {"back", 0.3}, {"rest", 0.3}};

/* Where the forceps is at the end of each phase until it closes: side by side its tips stroke, one above the other they grip. */
static void make_plan(const sinew_world *world, posture plan[PHASES]) {
  const float from = 0, to = 0.032f, beyond[3] = {1, 0, 0};
  sinew_surface_point rim;
  rim.struct_size = sizeof rim;
  CHECK(sinew_world_find_nearest(world, beyond, 2, &rim));
  plan[COME].tip[0] = from, plan[COME].tip[1] = height_at(world, from) - DEPTH, plan[COME].tip[2] = 0;
  plan[COME].tilt = 0.9, plan[COME].roll = PI / 2, plan[COME].opening = 0.4;
  plan[STROKE] = plan[COME], plan[STROKE].tip[0] = to, plan[STROKE].tip[1] = height_at(world, to) - DEPTH;
  plan[LEAVE] = plan[STROKE], plan[LEAVE].tip[1] += 0.015f;
  memcpy(plan[TURN].tip, rim.position, sizeof rim.position);
  plan[TURN].tilt = -0.2, plan[TURN].roll = 0, plan[TURN].opening = 0.7;
  plan[REACH] = plan[TURN];
  plan[TURN].tip[0] += 0.012f, plan[REACH].tip[0] -= 0.016f, plan[REACH].tip[1] += 0.003f;
  plan[CLOSE] = plan[REACH], plan[CLOSE].opening = 0.1;
}

/* Moves both jaws there over a frame. */
static void move(sinew_world *world, const forceps *of, posture held) {
  int jaw;
  for (jaw = 0; jaw < 2; jaw++) {
    float hinge[3];
    const quaternion q = jaw_pose(held, of->length, jaw, hinge);
    CHECK(sinew_tool_set_pose(world, of->jaws[jaw], hinge, q.xyzw));
  }
  CHECK(sinew_world_step(world, (float)FRAME, NULL));
}

/* The force and the torque on the upper jaw, the lower one and both, N and N m: on each about its hinge, on both about the origin. */
static void get_wrenches(const sinew_world *world, const forceps *of, float wrenches[3][6]) {
  const float origin[3] = {0, 0, 0};
  int jaw;
  for (jaw = 0; jaw < 2; jaw++) CHECK(sinew_tool_get_wrench(world, of->jaws[jaw], wrenches[jaw], wrenches[jaw] + 3));
  CHECK(sinew_world_get_total_wrench(world, of->jaws, 2, origin, wrenches[2], wrenches[2] + 3));
}

static void expect(int is_so, const char *what) {
  if (!is_so) fail("not as it should be:", what);
}

int main(int argc, char **argv) {
  const options chosen = read_options(argc, argv, 2);
  const double started = seconds_now();
  sinew_world *world = create_world(9.81f);
  sinew_mesh *mesh;
  sinew_mesh_view shape;
  sinew_body_id organ;
  posture plan[PHASES], last, now;
  forceps pair;
  sinew_picture_def picture;
  double drag = 0, squeeze = 0, height = 0, lifted = 0, carried = 0;
  int phase, frame = 0, part, i, touching = 0, touched[2] = {0, 0}, all_frames = 0;
  FILE *curve = create_file(chosen.directory, "instrument.csv");

  CHECK(sinew_mesh_create_organ(ORGAN, SPACING, &mesh));
  shape.struct_size = sizeof shape;
  CHECK(sinew_mesh_get_view(mesh, &shape));
  organ = create_organ(world, &shape);
  make_plan(world, plan);
  for (phase = 0; phase < PHASES; phase++) all_frames += (int)lround(phases[phase].seconds / FRAME);
  now = plan[COME], now.tip[1] += 0.012f;
  pair = create_forceps(world, now, &chosen);

  CHECK(sinew_picture_def_init(&picture, sizeof picture));
  picture.eye[0] = 0.115f, picture.eye[1] = 0.085f, picture.eye[2] = 0.09f, picture.target[0] = 0.04f, picture.target[1] = 0.002f;
  picture.field_of_view = 0.55f, picture.show_contacts = 1;
  fprintf(curve, "time_s,phase");
  for (i = 0; i < 18; i++) fprintf(curve, ",%s_%s_%c", i < 6 ? "upper" : i < 12 ? "lower" : "both", i % 6 < 3 ? "N" : "Nm", "xyz"[i % 3]);
  fprintf(curve, ",contacts,held\n");
  printf("force, N      upper jaw               lower jaw               both\n");
  printf("time s phase       x       y       z       x       y       z       x       y       z contacts held\n");

  for (phase = 0; phase < PHASES && (frame < chosen.frame_count || chosen.frame_count == 0); phase++) {
    const int frames = (int)lround(phases[phase].seconds / FRAME);
    if (phase > CLOSE) plan[phase] = now;
    if (phase == RAISE) hold(world, &pair, organ), height = weight_times_height(world, organ), plan[phase].tip[1] += LIFT;
    while (phase == LET_GO && pair.held_count > 0) CHECK(sinew_attachment_release(world, pair.held[--pair.held_count]));
    if (phase == LET_GO) plan[phase].opening = 0.7;
    if (phase == BACK) plan[phase].tip[0] += 0.03f;
    for (last = now, part = 1; part <= frames; part++) {
      const double share = smooth((double)part / frames);
      sinew_contact_change changes[4]; /* two jaws and one organ make two at most */
      float wrenches[3][6];
      size_t contacts[2], change_count;

      for (i = 0; i < 3; i++) now.tip[i] = (float)between(last.tip[i], plan[phase].tip[i], share);
      now.tilt = between(last.tilt, plan[phase].tilt, share), now.roll = between(last.roll, plan[phase].roll, share);
      if (phase != CLOSE || squeeze < GRIP) now.opening = between(last.opening, plan[phase].opening, share);
      move(world, &pair, now);
      get_wrenches(world, &pair, wrenches);
      for (i = 0; i < 2; i++) CHECK(sinew_tool_get_contacts(world, pair.jaws[i], NULL, 0, contacts + i));
      CHECK(sinew_world_get_contact_changes(world, changes, 4, &change_count));
      while (change_count-- > 0) touching += changes[change_count].has_begun ? 1 : -1;

      if (phase == STROKE) drag += -wrenches[2][0] / frames, touched[0] += contacts[0] > 0, touched[1] += contacts[1] > 0;
      if (phase == CLOSE) squeeze = fmin(wrenches[0][1], -wrenches[1][1]);
      if (phase == STAY) lifted = (weight_times_height(world, organ) - height) / LIFT, carried = -wrenches[2][1];
      if (phase == REST) expect(wrenches[2][0] == 0 && wrenches[2][1] == 0 && wrenches[2][2] == 0, "nothing presses the jaws in the end");
      if (phase == STROKE && part == frames / 2) save_picture(world, &picture, chosen.directory, "instrument_stroke.png");
      if (phase == CLOSE && part == frames) save_picture(world, &picture, chosen.directory, "instrument_grip.png");
      if (phase == STAY && part == frames) save_picture(world, &picture, chosen.directory, "instrument_lift.png");

      fprintf(curve, "%.4f,%s", ++frame * FRAME, phases[phase].name);
      for (i = 0; i < 18; i++) fprintf(curve, ",%.6f", wrenches[i / 6][i % 6]);
      fprintf(curve, ",%u,%u\n", (unsigned)(contacts[0] + contacts[1]), (unsigned)pair.held_count);
      clear_progress();
      if (part == frames / 2) {
        printf("%6.2f %-6s", frame * FRAME, phases[phase].name);
        for (i = 0; i < 9; i++) printf("%8.3f", wrenches[i / 3][i % 3]);
        printf("%9u%5u\n", (unsigned)(contacts[0] + contacts[1]), (unsigned)pair.held_count);
      }
      show_progress(frame, all_frames);
      if (frame == chosen.frame_count) break;
    }
  }
  clear_progress();
  printf("\nheld back with %.3f N on their way, closed with %.3f N each, carried %.3f N where %.3f N of weight was lifted; %.1f s\n", drag,
         squeeze, carried, lifted, seconds_now() - started);
  if (phase == PHASES) {
    expect(touched[0] > 0 && touched[1] > 0 && drag > 0, "both jaws touch what they stroke, which holds them back");
    expect(squeeze >= GRIP, "the jaws close on the rim");
    expect(lifted > 0 && carried >= lifted, "the jaws carry what they lift");
    expect(touching == 0, "what began to touch has ceased to");
  }
  fclose(curve);
  sinew_mesh_destroy(mesh);
  sinew_world_destroy(world);
  return 0;
}
