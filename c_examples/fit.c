/* Which tissue is it? A ball is pressed into a block and shaken; Young's modulus and the retardation time of the tissue
 * are found from its force, one world per candidate. With MPI the candidates are spread over all ranks, on however many
 * machines there are; without, one after another. Worlds have nothing in common, so nothing else is needed.
 *
 *   fit [-o DIRECTORY] [-n ROUNDS] [FILE]           or, built by `make mpi`:           mpirun fit_mpi ...
 *
 * FILE has the measured force in N, a number a line, one each millisecond of the motion below. Without one it is
 * measured on a tissue that is known, with 1 % of noise: then the answer is right within 5 %, or the program fails.
 * Leaves fit.png (measured: black, found: red) in the directory. */
#include "chart.h"
#ifdef WITH_MPI
#include <mpi.h>
#endif

#define KNOWN_YOUNG 7300.0 /* Pa: what is to be found, */
#define KNOWN_TIME 0.0042  /* s */
#define NOISE 0.01         /* of the largest force */
#define DENSITY 1060.0f    /* kg/m^3 */
#define RADIUS 0.01f       /* m: of the ball */
#define STEP 1e-3f         /* s */
#define STEPS 250          /* the ball goes in, */
#define PRESS 0.1          /* s */
#define DEPTH 0.003        /* m */
#define SHAKE 0.0008       /* m: then up and down by so much, */
#define RATE 12.0          /* 1/s: so often */
#define SIDE 5             /* candidates of each parameter in a round */
#define ROUNDS 6           /* each with candidates that are closer */
#define CLOSER 0.5
#define TURN 6.283185307179586

typedef struct tissue { double young, time; } tissue; /* Pa, s */

typedef struct trial { /* a candidate, and how far its force is from what was measured */
  double error;
  int candidate;
} trial;

/* How deep the ball is. */
static double depth_at(double t) {
  return DEPTH * smooth(t / PRESS) + (t > PRESS ? SHAKE * sin(TURN * RATE * (t - PRESS)) : 0);
}

/* What the ball feels in each step, N. */
static void press(const sinew_mesh_view *shape, tissue made_of, float *forces) {
  sinew_world *world = create_world(0);
  sinew_body_def def;
  sinew_body_id block;
  sinew_tool_def ball_def;
  sinew_tool_id ball;
  float top = -HUGE_VALF, low = HUGE_VALF, place[3] = {0, 0, 0};
  uint32_t i;
  int step;

  for (i = 0; i < shape->node_count; i++) {
    top = fmaxf(top, shape->positions[3 * i + 1]);
    low = fminf(low, shape->positions[3 * i + 1]);
  }
  CHECK(sinew_body_def_init(&def, sizeof def));
  def.positions = shape->positions;
  def.node_count = shape->node_count;
  def.tetrahedra = shape->tetrahedra;
  def.tetrahedron_count = shape->tetrahedron_count;
  def.material = SINEW_MATERIAL_TETRAHEDRA;
  def.poisson_ratio = 0.3f;
  def.density = DENSITY;
  def.young_modulus = (float)made_of.young;
  def.retardation_time = (float)made_of.time;
  def.solver = SINEW_SOLVER_IMPLICIT; /* a stiff dashpot would ask VERLET for short substeps */
  CHECK(sinew_body_create(world, &def, &block));
  for (i = 0; i < shape->node_count; i++) { /* it stands on its lower side */
    if (shape->positions[3 * i + 1] < low + 1e-6f) CHECK(sinew_body_pin(world, block, i));
  }
  CHECK(sinew_tool_def_init(&ball_def, sizeof ball_def));
  ball_def.shape = SINEW_SHAPE_SPHERE;
  ball_def.radius = RADIUS;
  ball_def.position[1] = top + RADIUS;
  CHECK(sinew_tool_create(world, &ball_def, &ball));
  for (step = 0; step < STEPS; step++) {
    float force[3], torque[3];
    place[1] = top + RADIUS - (float)depth_at((step + 1) * (double)STEP);
    CHECK(sinew_tool_set_pose(world, ball, place, NULL));
    CHECK(sinew_world_step(world, STEP, NULL));
    CHECK(sinew_tool_get_wrench(world, ball, force, torque));
    forces[step] = force[1];
  }
  sinew_world_destroy(world);
}

static double largest(const float *values) {
  double most = 0;
  int i;
  for (i = 0; i < STEPS; i++) most = fmax(most, values[i]);
  return most;
}

static double error_of(const float *found, const float *measured) {
  double sum = 0;
  int i;
  for (i = 0; i < STEPS; i++) sum += ((double)found[i] - measured[i]) * ((double)found[i] - measured[i]);
  return sqrt(sum / STEPS) / largest(measured);
}

/* The known tissue, with even noise: the same on every rank. */
static void measure_known(const sinew_mesh_view *shape, float *measured) {
  const tissue known = {KNOWN_YOUNG, KNOWN_TIME};
  uint32_t state = 12345;
  double most;
  int i;
  press(shape, known, measured);
  most = largest(measured);
  for (i = 0; i < STEPS; i++) {
    state = state * 1664525u + 1013904223u;
    measured[i] += (float)(most * NOISE * (2.0 * state / 4294967295.0 - 1));
  }
}

static void read_forces(const char *path, float *measured) {
  FILE *file = fopen(path, "r");
  int i;
  if (file == NULL) fail("cannot read", path);
  for (i = 0; i < STEPS; i++) {
    if (fscanf(file, "%f", measured + i) != 1 || !isfinite(measured[i])) fail("fewer forces than steps in", path);
  }
  fclose(file);
  if (!(largest(measured) > 0)) fail("no force presses on the ball in", path);
}

/* A candidate of a round: a grid about the middle, by factors. */
static tissue candidate_of(int candidate, tissue middle, double reach) {
  const double a = 2.0 * (candidate % SIDE) / (SIDE - 1) - 1, b = 2.0 * (candidate / SIDE) / (SIDE - 1) - 1;
  tissue made;
  made.young = middle.young * exp(a * reach);
  made.time = middle.time * exp(b * reach);
  return made;
}

int main(int argc, char **argv) {
  const float size[3] = {0.06f, 0.03f, 0.06f};
  const uint32_t cells[3] = {6, 3, 6};
  const colour black = {{0, 0, 0}}, red = {{214, 39, 40}};
  tissue best = {5000, 0.005}; /* to begin with */
  float measured[STEPS], found[STEPS];
  int rank = 0, ranks = 1, round, rounds, candidate, is_right = 1;
  double reach = log(4.0), began;
  options chosen;
  sinew_mesh *mesh;
  sinew_mesh_view shape;
  trial least = {HUGE_VAL, 0};

#ifdef WITH_MPI
  MPI_Init(&argc, &argv);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
#endif
  chosen = read_options(argc, argv, 1);
  rounds = chosen.frame_count > 0 ? chosen.frame_count : ROUNDS;
  CHECK(sinew_mesh_create_block(size, cells, &mesh));
  shape.struct_size = sizeof shape;
  CHECK(sinew_mesh_get_view(mesh, &shape));
  began = seconds_now();
  if (chosen.argument_count > 0) read_forces(chosen.arguments[0], measured);
  else measure_known(&shape, measured);

  if (rank == 0) {
    printf("%d candidates a round, %d rounds, %d rank%s\n\n", SIDE * SIDE, rounds, ranks, ranks == 1 ? "" : "s");
    printf("round   E in Pa   retardation in ms   error of force\n");
  }
  for (round = 0; round < rounds; round++, reach *= CLOSER) {
    trial mine = {HUGE_VAL, 0};
    for (candidate = rank; candidate < SIDE * SIDE; candidate += ranks) {
      double error;
      press(&shape, candidate_of(candidate, best, reach), found);
      error = error_of(found, measured);
      if (error < mine.error) mine.error = error, mine.candidate = candidate;
      if (rank == 0) show_progress(candidate, SIDE * SIDE);
    }
    least = mine;
#ifdef WITH_MPI
    MPI_Allreduce(&mine, &least, 1, MPI_DOUBLE_INT, MPI_MINLOC, MPI_COMM_WORLD);
#endif
    best = candidate_of(least.candidate, best, reach);
    if (rank == 0) {
      clear_progress();
      printf("%5d%10.0f%20.3f%15.2f %%\n", round + 1, best.young, 1e3 * best.time, 100 * least.error);
    }
  }

  if (rank == 0) {
    chart *drawn;
    const double height = 1.1 * largest(measured);
    press(&shape, best, found);
    drawn = new_chart(STEPS * (double)STEP, height);
    draw_curve(drawn, measured, STEPS, height, black);
    draw_curve(drawn, found, STEPS, height, red);
    save_chart(drawn, chosen.directory, "fit.png");
    printf("\n%d worlds of %u nodes, %d steps each, in %.1f s\n", rounds * SIDE * SIDE, (unsigned)shape.node_count, STEPS,
           seconds_now() - began);
    if (chosen.argument_count == 0 && rounds >= ROUNDS) {
      const double off = fmax(fabs(best.young / KNOWN_YOUNG - 1), fabs(best.time / KNOWN_TIME - 1));
      printf("known: %.0f Pa, %.3f ms; found again within %.1f %%\n", KNOWN_YOUNG, 1e3 * KNOWN_TIME, 100 * off);
      is_right = off < 0.05;
    }
  }
  sinew_mesh_destroy(mesh);
#ifdef WITH_MPI
  MPI_Finalize();
#endif
  return is_right ? EXIT_SUCCESS : EXIT_FAILURE;
}
