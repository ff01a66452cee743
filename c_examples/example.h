/* Helpers that the examples share: errors, definitions from meshes, a clock, a progress line and cameras. POSIX, C99. */
#ifndef SINEW_EXAMPLE_H
#define SINEW_EXAMPLE_H

#define _POSIX_C_SOURCE 200112L /* before any other header */
#include "sinew.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define CHECK(call) check((call), #call)
#define FRAME (1.0 / 60.0) /* s: what a screen shows */

/* Ends the program if a call failed: which, how, and why in the library's own words. */
static inline void check(sinew_status status, const char *call) {
  char why[512] = "";
  if (status == SINEW_STATUS_OK) return;
  sinew_last_error(why, sizeof why);
  fprintf(stderr, "%s\n%s: %s\n", call, sinew_status_name(status), why);
  exit(EXIT_FAILURE);
}

static inline void fail(const char *why, const char *what) {
  fprintf(stderr, "%s %s\n", why, what);
  exit(EXIT_FAILURE);
}

static inline void *allocate(size_t count, size_t size) {
  void *memory = calloc(count, size);
  if (memory == NULL) fail("out of", "memory");
  return memory;
}

static inline double seconds_now(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Node i of a view: no copy, for any stride. */
static inline const float *node(sinew_vec3_view view, size_t i) {
  return (const float *)((const char *)view.data + i * view.stride);
}

static inline double distance(const float *a, const float *b) {
  const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return sqrt(x * x + y * y + z * z);
}

typedef struct options {
  const char *directory;      /* -o: where pictures and tables go */
  int frame_count;            /* -n: 0 where not given */
  const char *arguments[3];   /* the others */
  size_t argument_count;
} options;

static inline options read_options(int argc, char **argv, size_t most_arguments) {
  options chosen = {".", 0, {NULL, NULL, NULL}, 0};
  int i;
  for (i = 1; i < argc; i++) {
    if (strcmp(argv[i], "-o") == 0 && i + 1 < argc) chosen.directory = argv[++i];
    else if (strcmp(argv[i], "-n") == 0 && i + 1 < argc) chosen.frame_count = atoi(argv[++i]);
    else if (chosen.argument_count < most_arguments) chosen.arguments[chosen.argument_count++] = argv[i];
    else fail("not understood (how to call it: at the head of the source):", argv[i]);
  }
  return chosen;
}

/* A world whose gravity pulls along -y. */
static inline sinew_world *create_world(float gravity) {
  sinew_world_def def;
  sinew_world *world;
  CHECK(sinew_world_def_init(&def, sizeof def));
  def.gravity[1] = -gravity;
  CHECK(sinew_world_create(&def, &world));
  return world;
}

/* A square cloth in the plane y = 0, by its side [m] and the cells along it. */
static inline sinew_mesh *cloth_mesh(float side, uint32_t cell_count) {
  const float size[2] = {side, side};
  const uint32_t cells[2] = {cell_count, cell_count};
  sinew_mesh *mesh;
  CHECK(sinew_mesh_create_cloth(size, cells, &mesh));
  return mesh;
}

/* A body definition with the nodes and elements of a mesh. Keep the mesh until the body is created. */
static inline sinew_body_def body_from_mesh(const sinew_mesh *mesh) {
  sinew_body_def def;
  CHECK(sinew_body_def_init(&def, sizeof def));
  CHECK(sinew_body_def_set_mesh(&def, mesh));
  return def;
}

/* Pins the nodes whose coordinate along an axis (0 to 2) is below a limit [m]. Returns their number. */
static inline size_t pin_below(sinew_world *world, sinew_body_id body, int axis, float limit) {
  sinew_vec3_view nodes;
  size_t i, count = 0;
  CHECK(sinew_body_get_positions(world, body, &nodes));
  for (i = 0; i < nodes.count; i++) {
    if (node(nodes, i)[axis] >= limit) continue;
    CHECK(sinew_body_pin(world, body, (uint32_t)i));
    count++;
  }
  return count;
}

/* Takes a number of equal steps of dt [s]. */
static inline void step_world(sinew_world *world, double dt, int count) {
  for (; count > 0; count--) CHECK(sinew_world_step(world, (float)dt, NULL));
}

/* 0 to 1 and level at both ends: how an instrument starts and stops. */
static inline double smooth(double t) {
  t = t < 0 ? 0 : t > 1 ? 1 : t;
  return t * t * (3 - 2 * t);
}

/* One line, rewritten in place where a person watches; nothing goes into a file or a pipe. */
static inline void show_progress(int frame, int frame_count) {
  if (isatty(STDERR_FILENO)) fprintf(stderr, "\rframe %d of %d ", frame, frame_count);
}

static inline void clear_progress(void) {
  if (isatty(STDERR_FILENO)) fprintf(stderr, "\r\033[K");
}

/* directory/name, to be freed. */
static inline char *path_in(const char *directory, const char *name) {
  const size_t length = strlen(directory) + strlen(name) + 2;
  char *path = (char *)allocate(length, 1);
  snprintf(path, length, "%s/%s", directory, name);
  return path;
}

static inline FILE *create_file(const char *directory, const char *name) {
  char *path = path_in(directory, name);
  FILE *file = fopen(path, "wb");
  if (file == NULL) fail("cannot write", path);
  free(path);
  return file;
}

/* A camera that stays where it is from picture to picture: it sees all of the box, from its side and a little above. */
static inline sinew_picture_def camera(const float low[3], const float high[3], int up) {
  const double side = 0.45, above = 0.5, front = 1.0, distance_to_size = 1.4;
  const double step = distance_to_size * distance(low, high) / sqrt(side * side + above * above + front * front);
  sinew_picture_def picture;
  int i;
  CHECK(sinew_picture_def_init(&picture, sizeof picture));
#ifdef PICTURE_WIDTH /* Small ones where a large one takes minutes: under Valgrind. */
  picture.width = PICTURE_WIDTH, picture.height = 3 * PICTURE_WIDTH / 4;
#endif
  for (i = 0; i < 3; i++) {
    picture.target[i] = picture.eye[i] = (low[i] + high[i]) / 2;
    picture.up[i] = i == up ? 1.0f : 0.0f;
  }
  picture.eye[up] += (float)(above * step);
  picture.eye[(up + 1) % 3] += (float)(front * step);
  picture.eye[(up + 2) % 3] += (float)(side * step);
  return picture;
}

static inline void save_picture(const sinew_world *world, const sinew_picture_def *picture, const char *directory,
                                const char *name) {
  char *path = path_in(directory, name);
  CHECK(sinew_world_save_picture(world, picture, path));
  free(path);
}

#endif
