/* What is drawn is not what is solved: tissue made of a fine render surface in one call, pressed by a ball, and drawn as it was made beside the
 * coarse body that is simulated. C99.
 *
 *   drawn [-o directory] [-n frames]     drawn.png, and on the standard output what it took */
#include "example.h"

/* The surface: rows and columns of a globe, with folds. */
enum { ROWS = 160, COLUMNS = 256, VERTICES = (ROWS - 1) * COLUMNS + 2, TRIANGLES = 2 * (ROWS - 1) * COLUMNS };

#define PI 3.14159265358979
#define SIZE 0.06f    /* m */
#define SPACING 0.011f
#define APART 0.16f   /* m, between what is drawn and what is solved */

static float vertices[3 * VERTICES];
static uint32_t triangles[3 * TRIANGLES];

/* A flattened ball with folds along its meridians, finer than what is solved. */
static void place(float *to, int row, int column) {
  const double down = PI * row / ROWS, around = 2 * PI * column / COLUMNS;
  const double fold = 1 + 0.035 * sin(down) * sin(down) * cos(18 * around + 5 * cos(3 * down));
  const double radius = SIZE * fold * (1 + 0.12 * cos(2 * around) * sin(down));
  to[0] = (float)(radius * sin(down) * cos(around));
  to[1] = (float)(0.7 * radius * cos(down));
  to[2] = (float)(radius * sin(down) * sin(around));
}

static uint32_t vertex(int row, int column) {
  if (row == 0) return 0;
  if (row == ROWS) return VERTICES - 1;
  return (uint32_t)(1 + (row - 1) * COLUMNS + column % COLUMNS);
}

static void make_surface(void) {
  uint32_t *next = triangles;
  int row, column;
  for (row = 0; row <= ROWS; row++)
    for (column = 0; column < COLUMNS; column++) place(&vertices[3 * vertex(row, column)], row, column);
  for (row = 0; row < ROWS; row++)
    for (column = 0; column < COLUMNS; column++) {
      const uint32_t a = vertex(row, column), b = vertex(row, column + 1);
      const uint32_t c = vertex(row + 1, column), d = vertex(row + 1, column + 1);
      if (row > 0) {
        *next++ = a, *next++ = b, *next++ = d;
      }
      if (row < ROWS - 1) {
        *next++ = a, *next++ = d, *next++ = c;
      }
    }
}

/* A body that stands where it is put, to be looked at. */
static void show(sinew_world *world, sinew_vec3_view places, sinew_triangle_view faces, float x) {
  sinew_body_def def;
  sinew_body_id body;
  float *positions = (float *)allocate(3 * places.count, sizeof *positions);
  size_t i;
  for (i = 0; i < places.count; i++) {
    memcpy(&positions[3 * i], node(places, i), 3 * sizeof *positions);
    positions[3 * i] += x;
  }
  CHECK(sinew_body_def_init(&def, sizeof def));
  def.positions = positions;
  def.node_count = places.count;
  def.node_mass = 1;
  def.triangles = faces.data;
  def.triangle_count = faces.count;
  CHECK(sinew_body_create(world, &def, &body));
  free(positions);
}

static void save(const sinew_world *tissue, sinew_body_id body, const sinew_embedding *drawn, const char *directory) {
  sinew_world *gallery = create_world(0);
  sinew_picture_def picture;
  sinew_vec3_view places;
  sinew_triangle_view faces;
  CHECK(sinew_embedding_get_positions(drawn, &places));
  CHECK(sinew_embedding_get_triangles(drawn, &faces));
  show(gallery, places, faces, APART / 2);
  CHECK(sinew_body_get_positions(tissue, body, &places));
  CHECK(sinew_body_get_triangles(tissue, body, &faces));
  show(gallery, places, faces, -APART / 2);
  CHECK(sinew_picture_def_init(&picture, sizeof picture));
  picture.width = 1400;
  picture.height = 700;
  picture.eye[1] = 0.22f;
  picture.eye[2] = 0.5f;
  picture.target[1] = -0.005f;
  picture.field_of_view = 0.35f;
  save_picture(gallery, &picture, directory, "drawn.png");
  sinew_world_destroy(gallery);
}

int main(int argc, char **argv) {
  const options chosen = read_options(argc, argv, 0);
  const int frames = chosen.frame_count > 0 ? chosen.frame_count : 90;
  sinew_world *world = create_world(9.81f);
  sinew_body_def def;
  sinew_body_id body;
  sinew_tool_def floor, ball;
  sinew_tool_id finger, ground;
  sinew_embedding *drawn;
  sinew_vec3_view places, normals;
  double start, made, stepped = 0, read = 0;
  int frame;
  make_surface();

  CHECK(sinew_body_def_init(&def, sizeof def));
  def.positions = vertices;
  def.node_count = VERTICES;
  def.triangles = triangles;
  def.triangle_count = TRIANGLES;
  def.material = SINEW_MATERIAL_SPRINGS;
  def.young_modulus = 8e3f;
  def.poisson_ratio = 0.25f;
  def.density = 1000;
  def.node_damping = 1e-2f;
  start = seconds_now();
  CHECK(sinew_body_create_from_surface(world, &def, SPACING, &body, &drawn));
  made = seconds_now() - start;

  CHECK(sinew_tool_def_init(&floor, sizeof floor));
  floor.shape = SINEW_SHAPE_PLANE;
  floor.position[1] = -0.7f * SIZE - 0.004f;
  floor.friction = 0.5f;
  CHECK(sinew_tool_create(world, &floor, &ground));
  CHECK(sinew_tool_def_init(&ball, sizeof ball));
  ball.shape = SINEW_SHAPE_SPHERE;
  ball.radius = 0.014f;
  ball.position[1] = 0.1f;
  CHECK(sinew_tool_create(world, &ball, &finger));

  for (frame = 0; frame < frames; frame++) {
    const double part = frame < frames / 3 ? 0 : (frame - frames / 3) / (2.0 * frames / 3);
    const float at[3] = {0.015f, (float)(0.06 - 0.032 * part), 0.02f};
    CHECK(sinew_tool_set_pose(world, finger, at, NULL));
    start = seconds_now();
    CHECK(sinew_world_step(world, (float)FRAME, NULL));
    stepped += seconds_now() - start;
    start = seconds_now();
    CHECK(sinew_embedding_update(drawn, world));
    CHECK(sinew_embedding_get_positions(drawn, &places));
    CHECK(sinew_embedding_get_normals(drawn, &normals));
    read += seconds_now() - start;
  }
  save(world, body, drawn, chosen.directory);

  CHECK(sinew_embedding_get_positions(drawn, &places));
  printf("%zu vertices are drawn, in one call made tissue in %.0f ms\n", places.count, 1e3 * made);
  CHECK(sinew_body_get_positions(world, body, &places));
  printf("%zu nodes are solved: %.2f ms a frame\n", places.count, 1e3 * stepped / frames);
  printf("positions and normals of what is drawn: %.2f ms a frame\n", 1e3 * read / frames);
  sinew_world_destroy(world);
  sinew_embedding_destroy(drawn);
  return 0;
}
