/* A hand feels an organ: it ticks a thousand times a second on a thread of its own, while the world steps sixty times on another
 * and a third shows it.
 *
 *   haptics [-o DIRECTORY] [-n FRAMES] [FILE [SCALE]]
 *
 * FILE is a tetrahedral mesh (.vtk .msh .node), SCALE what one of its units is in metres. Without a file an organ is made. The hand is a mass on a
 * spring whose other end goes along a path: down into the organ, along it, up again. Once the world has a thread beside it; once it is stepped inside
 * each tick. Leaves haptics.png, the organ pressed, haptics_force.png, the force against time (dark: the local model, light: a step each tick; a line
 * for each second and newton), and haptics.csv in the directory. */
#include "chart.h"
#include <pthread.h>

#define YOUNG 5000.0     /* Pa */
#define DENSITY 1000.0   /* kg/m^3 */
#define DAMPING 20.0     /* 1/s */
#define BACK 0.3         /* of its thickness: what lies below is held */
#define TICK 1e-3        /* s */
#define STEP 0.016       /* s: of the world beside it, a little more than 60 a second */
#define HAND 0.1         /* kg */
#define GRIP 600.0       /* N/m: of the hand's own spring */
#define CALM 8.0         /* N s/m: and its damper */
#define DEPTH 0.008      /* m: how far the path leads into the organ, */
#define ALONG 0.01       /* m: and along it */
#define LIMIT 3.3        /* N: what a common desktop device can exert */

/* What a tick was like. */
typedef struct record {
  float force[3], place[3];
  float age, late, spent; /* s: how old the model was, how late the tick began, what processor time it took */
} record;

typedef struct bench {
  sinew_world *world;
  sinew_body_id organ;
  sinew_tool_id tool;
  sinew_haptic *haptic;
  float touch[3];      /* where the tool just touches */
  float radius;
  record *records;
  size_t tick_count;
  int steps_within;    /* whether each tick steps the world */
  size_t step_count;
  double slowest_step; /* s */
  sinew_reader *reader;
  size_t frames_read, frames_new;
} bench;

static void sleep_until(double time) {
  const double left = time - seconds_now();
  struct timespec pause;
  if (left <= 0) return;
  pause.tv_sec = (time_t)left;
  pause.tv_nsec = (long)(1e9 * (left - (double)pause.tv_sec));
  nanosleep(&pause, NULL);
}

static double processor_seconds(void) {
  struct timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Where the hand wants to be: from above down into the organ, along it and back, and up. */
static void path_at(const bench *it, double part, double place[3]) {
  const double in = smooth(part / 0.25) - smooth((part - 0.8) / 0.2), aside = smooth((part - 0.3) / 0.2) - smooth((part - 0.55) / 0.2);
  const double clear = 0.3 * it->radius;
  place[0] = it->touch[0] + ALONG * aside;
  place[1] = it->touch[1] + clear - (clear + DEPTH) * in;
  place[2] = it->touch[2];
}

/* The device's thread: a hand, and a tick each millisecond. */
static void *feel(void *given) {
  bench *it = (bench *)given;
  double place[3], speed[3] = {0, 0, 0}, wanted[3];
  const double started = seconds_now();
  size_t tick;
  int i;
  path_at(it, 0, place);
  for (tick = 0; tick < it->tick_count; tick++) {
    record *now = it->records + tick;
    sinew_haptic_report felt;
    const double due = started + (double)tick * TICK;
    float position[3], velocity[3];
    double began;
    sleep_until(due);
    now->late = (float)(seconds_now() - due);
    for (i = 0; i < 3; i++) position[i] = (float)place[i], velocity[i] = (float)speed[i];
    felt.struct_size = sizeof felt;
    began = processor_seconds();
    CHECK(sinew_haptic_tick(it->haptic, position, NULL, velocity, NULL, (float)TICK, &felt));
    if (it->steps_within) CHECK(sinew_world_step(it->world, (float)TICK, NULL));
    now->spent = (float)(processor_seconds() - began);
    now->age = felt.age;
    memcpy(now->force, felt.force, sizeof now->force);
    memcpy(now->place, position, sizeof now->place);
    path_at(it, (double)tick / (double)it->tick_count, wanted);
    for (i = 0; i < 3; i++) { /* the hand, pulled by its own spring and pushed by what it feels */
      const double pull = GRIP * (wanted[i] - place[i]) - CALM * speed[i] + felt.force[i];
      speed[i] += pull / HAND * TICK;
      place[i] += speed[i] * TICK;
    }
  }
  return NULL;
}

/* The world's thread: a step whenever it is time for one. */
static void *simulate(void *given) {
  bench *it = (bench *)given;
  double due = seconds_now();
  size_t step;
  for (step = 0; step < it->step_count; step++) {
    double began;
    sleep_until(due);
    began = seconds_now();
    CHECK(sinew_world_step(it->world, (float)STEP, NULL));
    it->slowest_step = fmax(it->slowest_step, seconds_now() - began);
    due = fmax(due + STEP, began);
  }
  return NULL;
}

/* A screen's thread: sixty times a second the newest positions, which here are only counted. */
static void *show(void *given) {
  bench *it = (bench *)given;
  const double started = seconds_now();
  const size_t frame_count = (size_t)((double)it->tick_count * TICK / FRAME);
  while (it->frames_read < frame_count) {
    sinew_frame frame;
    sleep_until(started + (double)it->frames_read * FRAME);
    frame.struct_size = sizeof frame;
    CHECK(sinew_reader_read(it->reader, &frame));
    it->frames_new += frame.is_new;
    it->frames_read++;
  }
  return NULL;
}

static void start_thread(pthread_t *thread, void *(*task)(void *), bench *it) {
  if (pthread_create(thread, NULL, task, it) != 0) fail("no", "thread");
}

/* An organ held at its back, and a ball above the middle of its top. */
static bench create_bench(const sinew_mesh_view *shape, float radius, size_t tick_count) {
  bench it;
  sinew_body_def def;
  sinew_tool_def tool;
  sinew_haptic_def coupling;
  float low[3], high[3];
  size_t i;
  memset(&it, 0, sizeof it);
  it.world = create_world(0);
  memcpy(low, shape->positions, sizeof low);
  memcpy(high, shape->positions, sizeof high);
  for (i = 0; i < 3 * shape->node_count; i++) {
    low[i % 3] = fminf(low[i % 3], shape->positions[i]);
    high[i % 3] = fmaxf(high[i % 3], shape->positions[i]);
  }
  CHECK(sinew_body_def_init(&def, sizeof def));
  def.positions = shape->positions;
  def.node_count = shape->node_count;
  def.tetrahedra = shape->tetrahedra;
  def.tetrahedron_count = shape->tetrahedron_count;
  def.triangles = shape->surface;
  def.triangle_count = shape->surface_triangle_count;
  def.material = SINEW_MATERIAL_SPRINGS;
  def.young_modulus = (float)YOUNG;
  def.density = (float)DENSITY;
  def.node_damping = (float)(DAMPING * DENSITY * 0.5 * (high[0] - low[0]) * (high[1] - low[1]) * (high[2] - low[2]) / (double)shape->node_count);
  CHECK(sinew_body_create(it.world, &def, &it.organ));
  for (i = 0; i < shape->node_count; i++) {
    if (shape->positions[3 * i + 1] < low[1] + BACK * (high[1] - low[1])) CHECK(sinew_body_pin(it.world, it.organ, (uint32_t)i));
  }
  it.radius = radius;
  for (i = 0; i < 3; i++) it.touch[i] = (low[i] + high[i]) / 2;
  it.touch[1] = low[1];
  for (i = 0; i < shape->node_count; i++) { /* clear of every node about the middle */
    const float *p = shape->positions + 3 * i;
    const double aside = hypot(p[0] - it.touch[0], p[2] - it.touch[2]);
    if (aside < radius) it.touch[1] = fmaxf(it.touch[1], p[1] + (float)sqrt(radius * radius - aside * aside));
  }
  CHECK(sinew_tool_def_init(&tool, sizeof tool));
  tool.shape = SINEW_SHAPE_SPHERE;
  tool.radius = radius;
  memcpy(tool.position, it.touch, sizeof tool.position);
  tool.position[1] += 0.3f * radius;
  CHECK(sinew_tool_create(it.world, &tool, &it.tool));
  CHECK(sinew_haptic_def_init(&coupling, sizeof coupling));
  coupling.force_limit = (float)LIMIT;
  coupling.tool = it.tool;
  CHECK(sinew_haptic_create(it.world, &coupling, &it.haptic));
  CHECK(sinew_reader_create(it.world, it.organ, &it.reader));
  it.tick_count = tick_count;
  it.step_count = (size_t)((double)tick_count * TICK / STEP);
  it.records = (record *)allocate(tick_count, sizeof *it.records);
  return it;
}

static void destroy_bench(bench *it) {
  sinew_reader_destroy(it->reader);
  sinew_haptic_destroy(it->haptic);
  sinew_world_destroy(it->world);
  free(it->records);
}

static int compare_floats(const void *left, const void *right) {
  const float l = *(const float *)left, r = *(const float *)right;
  return (l > r) - (l < r);
}

/* A line of a table: the values below which half lie, 99 %, 99.9 % and all. */
static void print_distribution(const char *what, float *values, size_t count, double unit) {
  qsort(values, count, sizeof *values, compare_floats);
  printf("  %-34s%10.3f%10.3f%10.3f%10.3f\n", what, values[count / 2] * unit, values[count * 99 / 100] * unit,
         values[count * 999 / 1000] * unit, values[count - 1] * unit);
}

static float length_of(const float *v) { return (float)sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

static void print_records(const bench *it, const float *empty) {
  float *values = (float *)allocate(it->tick_count, sizeof *values);
  size_t i, missed = 0, idle = 0;
  double peak = 0;
  printf("                                          half      99 %%    99.9 %%       all\n");
  for (i = 0; i < it->tick_count; i++) values[i] = it->records[i].spent;
  print_distribution(it->steps_within ? "tick and step, processor, us" : "tick, processor, us", values, it->tick_count, 1e6);
  for (i = 0; i < it->tick_count; i++) values[i] = it->records[i].late;
  print_distribution("tick begins late by, us", values, it->tick_count, 1e6);
  for (i = 0; i < it->tick_count; i++) values[i] = fminf(it->records[i].age, 1);
  print_distribution("age of the model, ms", values, it->tick_count, 1e3);
  for (i = 0; i < it->tick_count; i++) values[i] = i == 0 ? 0 : (float)distance(it->records[i].force, it->records[i - 1].force);
  print_distribution("change of the force, mN", values, it->tick_count, 1e3);
  for (i = 0; i < it->tick_count; i++) {
    missed += it->records[i].late > TICK;
    idle += empty[i] > TICK;
    peak = fmax(peak, length_of(it->records[i].force));
  }
  printf("  peak force %.3f N; %zu of %zu ticks began more than a tick late, %zu of an empty loop's\n", peak, missed, it->tick_count, idle);
  if (!it->steps_within) {
    printf("  beside it %zu steps of %.0f ms, the slowest took %.1f ms; a third thread read %zu frames, %zu of them new\n", it->step_count, 1e3 * STEP,
           1e3 * it->slowest_step, it->frames_read, it->frames_new);
  }
  free(values);
}

/* How late a loop is that does nothing. */
static void rest(float *late, size_t count) {
  const double started = seconds_now();
  size_t tick;
  for (tick = 0; tick < count; tick++) {
    sleep_until(started + (double)tick * TICK);
    late[tick] = (float)(seconds_now() - started - (double)tick * TICK);
  }
}

int main(int argc, char **argv) {
  const options chosen = read_options(argc, argv, 2);
  const size_t tick_count = chosen.frame_count > 0 ? (size_t)lround(chosen.frame_count * FRAME / TICK) : 3000;
  const colour dark = {{30, 60, 120}}, light = {{240, 150, 60}};
  float *empty = (float *)allocate(tick_count, sizeof *empty), *forces[2];
  double most = 0;
  sinew_mesh *mesh;
  sinew_mesh_view shape;
  chart *drawn;
  FILE *curve;
  size_t i;
  int round;

  if (chosen.argument_count > 0) {
    const double scale = chosen.argument_count > 1 ? atof(chosen.arguments[1]) : 1;
    CHECK(sinew_mesh_load(chosen.arguments[0], SINEW_MESH_FORMAT_AUTO, (float)scale, &mesh));
  } else {
    CHECK(sinew_mesh_create_organ(0.15f, 0.01f, &mesh));
  }
  shape.struct_size = sizeof shape;
  CHECK(sinew_mesh_get_view(mesh, &shape));
  printf("%zu nodes, %zu tetrahedra; %zu ticks of 1 ms\n", shape.node_count, shape.tetrahedron_count, tick_count);
  rest(empty, tick_count);
  curve = create_file(chosen.directory, "haptics.csv");
  fprintf(curve, "round,time_s,x_m,y_m,z_m,force_x_N,force_y_N,force_z_N,age_s,spent_s\n");
  for (round = 0; round < 2; round++) {
    bench it = create_bench(&shape, 0.015f, tick_count);
    pthread_t hand, world, screen;
    it.steps_within = round;
    printf("\n%s\n", round == 0 ? "the world on a thread beside the hand, felt through a local model" : "a step of the world in each tick");
    start_thread(&hand, feel, &it);
    if (round == 0) {
      start_thread(&world, simulate, &it);
      start_thread(&screen, show, &it);
      pthread_join(world, NULL);
      pthread_join(screen, NULL);
    }
    pthread_join(hand, NULL);
    print_records(&it, empty);
    forces[round] = (float *)allocate(tick_count, sizeof **forces);
    for (i = 0; i < tick_count; i++) {
      const record *now = it.records + i;
      forces[round][i] = length_of(now->force);
      most = fmax(most, forces[round][i]);
      fprintf(curve, "%d,%.3f,%.6f,%.6f,%.6f,%.5f,%.5f,%.5f,%.4f,%.7f\n", round, (double)i * TICK, now->place[0], now->place[1],
              now->place[2], now->force[0], now->force[1], now->force[2], now->age, now->spent);
    }
    if (round == 0) {
      float low[3], high[3];
      int axis;
      sinew_picture_def picture;
      for (axis = 0; axis < 3; axis++) low[axis] = it.touch[axis] - 0.07f, high[axis] = it.touch[axis] + 0.07f;
      low[1] -= 0.04f, high[1] -= 0.04f;
      picture = camera(low, high, 1);
      save_picture(it.world, &picture, chosen.directory, "haptics.png");
    }
    destroy_bench(&it);
  }
  fclose(curve);
  drawn = new_chart((double)tick_count * TICK, fmax(1.1 * most, 0.1));
  draw_curve(drawn, forces[1], tick_count, fmax(1.1 * most, 0.1), light);
  draw_curve(drawn, forces[0], tick_count, fmax(1.1 * most, 0.1), dark);
  save_chart(drawn, chosen.directory, "haptics_force.png");
  free(forces[0]), free(forces[1]), free(empty);
  sinew_mesh_destroy(mesh);
  return 0;
}
