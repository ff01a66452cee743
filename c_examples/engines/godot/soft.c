/* sinew for Godot 3: a GDNative library that GDScript calls by name, GDNative.call_native("standard_varcall", "soft_step", [...]).
 *
 * Of GDNative's interface it declares what it uses. Godot hands over a table of functions whose order is fixed for good by version 1.0 of
 * that interface (gdnative_api.json); each is named here by its place in it. */
#include "sinew.h"
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct variant { uint64_t words[3]; } variant;
typedef struct vector3 { float at[3]; } vector3;
typedef struct pool { void *data; } pool; /* a PoolVector3Array or a PoolIntArray */
typedef struct array array;
typedef struct access access;
typedef void (*function)(void);

typedef struct core {
  unsigned type, major, minor;
  const void *next;
  unsigned extension_count;
  const void **extensions;
  function functions[744];
} core;

typedef struct init_options {
  unsigned char in_editor;
  uint64_t hashes[3];
  function report_version_mismatch, report_loading_error;
  void *library;
  const core *api;
  const void *path;
} init_options;

static const core *godot;
#define GODOT(place, type) ((type)godot->functions[place])
#define NEW_INT GODOT(512, void (*)(variant *, int64_t))
#define NEW_REAL GODOT(513, void (*)(variant *, double))
#define NEW_INTS GODOT(531, void (*)(variant *, const pool *))
#define NEW_VECTORS GODOT(535, void (*)(variant *, const pool *))
#define AS_REAL GODOT(540, double (*)(const variant *))
#define AS_VECTOR GODOT(544, vector3 (*)(const variant *))
#define DESTROY GODOT(570, void (*)(variant *))
#define GET GODOT(333, variant (*)(const array *, int))
#define PRINT_ERROR GODOT(741, void (*)(const char *, const char *, const char *, int))

/* Of pool arrays, of ints and of vectors. */
enum {
  INTS_NEW = 171, INTS_RESIZE = 180, INTS_WRITE = 182, INTS_DESTROY = 186, INTS_POINTER = 300, INTS_WRITTEN = 302,
  VECTORS_NEW = 235, VECTORS_RESIZE = 244, VECTORS_WRITE = 246, VECTORS_DESTROY = 250, VECTORS_POINTER = 316, VECTORS_WRITTEN = 318
};

static struct { sinew_world *world; sinew_body_id cloth; sinew_tool_id ball; } soft;

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

static int asked(sinew_status status, const char *by) {
  char why[512] = "";
  if (status == SINEW_STATUS_OK) return 1;
  sinew_last_error(why, sizeof why);
  PRINT_ERROR(why, by, "soft.c", 0);
  return 0;
}

static variant number(double value) {
  variant out;
  NEW_REAL(&out, value);
  return out;
}

static variant answer(int right) {
  variant out;
  NEW_INT(&out, right ? 0 : 1);
  return out;
}

static vector3 vector_argument(const array *arguments, int i) {
  variant given = GET(arguments, i);
  const vector3 value = AS_VECTOR(&given);
  DESTROY(&given);
  return value;
}

static double number_argument(const array *arguments, int i) {
  variant given = GET(arguments, i);
  const double value = AS_REAL(&given);
  DESTROY(&given);
  return value;
}

/* A pool array of what `fill` writes, 12 bytes each for vectors, 4 for ints. */
static variant pool_of(size_t count, int vectors, void (*fill)(void *to, size_t count)) {
  pool made;
  variant out;
  access *writing;
  GODOT(vectors ? VECTORS_NEW : INTS_NEW, void (*)(pool *))(&made);
  GODOT(vectors ? VECTORS_RESIZE : INTS_RESIZE, void (*)(pool *, int))(&made, (int)count);
  writing = GODOT(vectors ? VECTORS_WRITE : INTS_WRITE, access *(*)(pool *))(&made);
  fill(GODOT(vectors ? VECTORS_POINTER : INTS_POINTER, void *(*)(const access *))(writing), count);
  GODOT(vectors ? VECTORS_WRITTEN : INTS_WRITTEN, void (*)(access *))(writing);
  if (vectors) NEW_VECTORS(&out, &made);
  else NEW_INTS(&out, &made);
  GODOT(vectors ? VECTORS_DESTROY : INTS_DESTROY, void (*)(pool *))(&made);
  return out;
}

static sinew_vec3_view nodes(void) {
  sinew_vec3_view view = {NULL, 0, 12};
  asked(sinew_body_get_positions(soft.world, soft.cloth, &view), "positions");
  return view;
}

static sinew_triangle_view triangles(void) {
  sinew_triangle_view view = {NULL, 0};
  asked(sinew_body_get_triangles(soft.world, soft.cloth, &view), "triangles");
  return view;
}

static const float *node(sinew_vec3_view view, size_t i) { return (const float *)((const char *)view.data + i * view.stride); }

static void fill_positions(void *to, size_t count) {
  const sinew_vec3_view view = nodes();
  size_t i;
  for (i = 0; i < count; i++) memcpy((vector3 *)to + i, node(view, i), sizeof(vector3));
}

static void fill_normals(void *to, size_t count) {
  const sinew_vec3_view view = nodes();
  const sinew_triangle_view all = triangles();
  vector3 *normals = (vector3 *)to;
  size_t t;
  int i, k;
  memset(to, 0, count * sizeof *normals);
  for (t = 0; t < 3 * all.count; t += 3) {
    const float *a = node(view, all.data[t]), *b = node(view, all.data[t + 1]), *c = node(view, all.data[t + 2]);
    for (i = 0; i < 3; i++) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      const float n = (b[j] - a[j]) * (c[l] - a[l]) - (b[l] - a[l]) * (c[j] - a[j]);
      for (k = 0; k < 3; k++) normals[all.data[t + (size_t)k]].at[i] += n * 1e4f; /* Godot makes them 1 long, unless they are tiny */
    }
  }
}

/* Godot's triangles are seen from where they run clockwise. */
static void fill_triangles(void *to, size_t count) {
  const sinew_triangle_view all = triangles();
  size_t i;
  for (i = 0; i < count; i++) ((int32_t *)to)[i] = (int32_t)all.data[i - i % 3 + 2 - i % 3];
}

/* soft_create(ball: Vector3, radius: float): 0, or 1 and an error is printed. */
EXPORT variant soft_create(void *data, const array *arguments) {
  const vector3 place = vector_argument(arguments, 0);
  const float size[2] = {0.42f, 0.42f};
  const uint32_t cells[2] = {36, 36};
  sinew_world_def world;
  sinew_body_def cloth;
  sinew_tool_def ball;
  sinew_mesh *mesh = NULL;
  sinew_mesh_view shape;
  float *lifted = NULL;
  size_t i;
  int right;
  (void)data;
  shape.struct_size = sizeof shape;
  right = asked(sinew_world_def_init(&world, sizeof world), "world_def") && asked(sinew_world_create(&world, &soft.world), "world") &&
          asked(sinew_mesh_create_cloth(size, cells, &mesh), "mesh") && asked(sinew_mesh_get_view(mesh, &shape), "view") &&
          asked(sinew_body_def_init(&cloth, sizeof cloth), "body_def") && asked(sinew_tool_def_init(&ball, sizeof ball), "tool_def");
  right = right && (lifted = (float *)malloc(shape.node_count * sizeof(vector3))) != NULL;
  if (right) {
    ball.shape = SINEW_SHAPE_SPHERE, ball.radius = (float)number_argument(arguments, 1), ball.friction = 0.9f;
    memcpy(ball.position, place.at, sizeof ball.position);
    memcpy(lifted, shape.positions, shape.node_count * sizeof(vector3));
    for (i = 0; i < shape.node_count; i++) lifted[3 * i + 1] += place.at[1] + ball.radius + 0.03f;
    cloth.positions = lifted, cloth.node_count = shape.node_count;
    cloth.triangles = shape.triangles, cloth.triangle_count = shape.triangle_count;
    cloth.node_mass = 7e-5f, cloth.node_damping = 5e-4f, cloth.stiffness = 30, cloth.bending_stiffness = 2e-5f;
    cloth.contact_thickness = 0.002f;
    right = asked(sinew_body_create(soft.world, &cloth, &soft.cloth), "body") && asked(sinew_tool_create(soft.world, &ball, &soft.ball), "tool");
  }
  free(lifted), sinew_mesh_destroy(mesh);
  return answer(right);
}

EXPORT variant soft_destroy(void *data, const array *arguments) {
  (void)data, (void)arguments;
  sinew_world_destroy(soft.world), soft.world = NULL;
  return answer(1);
}

/* soft_step(dt: float, ball: Vector3): the upward force on the ball, N. */
EXPORT variant soft_step(void *data, const array *arguments) {
  const vector3 place = vector_argument(arguments, 1);
  float force[3] = {0, 0, 0}, torque[3];
  (void)data;
  asked(sinew_tool_set_pose(soft.world, soft.ball, place.at, NULL), "pose");
  asked(sinew_world_step(soft.world, (float)number_argument(arguments, 0), NULL), "step");
  asked(sinew_tool_get_wrench(soft.world, soft.ball, force, torque), "wrench");
  return number(force[1]);
}

EXPORT variant soft_positions(void *data, const array *arguments) {
  (void)data, (void)arguments;
  return pool_of(nodes().count, 1, fill_positions);
}

EXPORT variant soft_normals(void *data, const array *arguments) {
  (void)data, (void)arguments;
  return pool_of(nodes().count, 1, fill_normals);
}

EXPORT variant soft_triangles(void *data, const array *arguments) {
  (void)data, (void)arguments;
  return pool_of(3 * triangles().count, 0, fill_triangles);
}

/* What the cloth weighs, N. */
EXPORT variant soft_weight(void *data, const array *arguments) {
  double sum = 0;
  float mass = 0;
  uint32_t i;
  (void)data, (void)arguments;
  for (i = 0; i < nodes().count; i++) {
    asked(sinew_body_get_node_mass(soft.world, soft.cloth, i, &mass), "mass");
    sum += 9.81 * mass;
  }
  return number(sum);
}

/* A picture by sinew, where there is no display: the file that SINEW_PICTURE names. */
EXPORT variant soft_save_picture(void *data, const array *arguments) {
  const char *path = getenv("SINEW_PICTURE");
  sinew_picture_def picture;
  (void)data, (void)arguments;
  return answer(path != NULL && asked(sinew_picture_def_init(&picture, sizeof picture), "picture_def") &&
                asked(sinew_world_save_picture(soft.world, &picture, path), "picture"));
}

EXPORT void godot_gdnative_init(init_options *options) { godot = options->api; }
EXPORT void godot_gdnative_terminate(void *options) { (void)options; }
