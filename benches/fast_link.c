/* The fast link storage of Halic, Kockara, Bayrak, Rowe and Chen (section 4), written for speed in C: one
 * array of links, node i's start at i * springs_per_node. It is the baseline for sinew, so it does no
 * unnecessary work: velocities are stored, gravity is the only load, a pinned node has an inverse mass of zero. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

struct vector {
  float x, y, z;
};

struct link {
  uint32_t neighbor;
  float stiffness;
  float rest_length;
};

struct fast_link {
  uint32_t node_count;
  uint32_t springs_per_node;
  struct vector *positions;
  struct vector *next_positions;
  struct vector *velocities;
  struct vector *forces;
  float *inverse_masses;
  uint32_t *link_counts;
  struct link *links;
};

void fast_link_destroy(struct fast_link *body) {
  if (body == NULL) return;
  free(body->positions);
  free(body->next_positions);
  free(body->velocities);
  free(body->forces);
  free(body->inverse_masses);
  free(body->link_counts);
  free(body->links);
  free(body);
}

static void add_link(struct fast_link *body, uint32_t node, uint32_t neighbor, float stiffness, float rest_length) {
  struct link *row = body->links + (size_t)node * body->springs_per_node;
  row[body->link_counts[node]++] = (struct link){neighbor, stiffness, rest_length};
}

/* Returns NULL if memory runs out or a node has more than springs_per_node springs. */
struct fast_link *fast_link_create(uint32_t node_count, uint32_t springs_per_node, const float *positions,
                                   const float *inverse_masses, size_t spring_count, const uint32_t *springs,
                                   const float *rest_lengths, float stiffness) {
  struct fast_link *body = calloc(1, sizeof *body);
  if (body == NULL) return NULL;
  body->node_count = node_count;
  body->springs_per_node = springs_per_node;
  body->positions = malloc(node_count * sizeof *body->positions);
  body->next_positions = malloc(node_count * sizeof *body->next_positions);
  body->velocities = calloc(node_count, sizeof *body->velocities);
  body->forces = calloc(node_count, sizeof *body->forces);
  body->inverse_masses = malloc(node_count * sizeof *body->inverse_masses);
  body->link_counts = calloc(node_count, sizeof *body->link_counts);
  body->links = calloc((size_t)node_count * springs_per_node, sizeof *body->links);
  if (!body->positions || !body->next_positions || !body->velocities || !body->forces || !body->inverse_masses ||
      !body->link_counts || !body->links) {
    fast_link_destroy(body);
    return NULL;
  }
  for (uint32_t i = 0; i < node_count; i++) {
    body->positions[i] = (struct vector){positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]};
    body->next_positions[i] = body->positions[i];
    body->inverse_masses[i] = inverse_masses[i];
  }
  for (size_t s = 0; s < spring_count; s++) {
    uint32_t a = springs[2 * s], b = springs[2 * s + 1];
    if (body->link_counts[a] == springs_per_node || body->link_counts[b] == springs_per_node) {
      fast_link_destroy(body);
      return NULL;
    }
    add_link(body, a, b, stiffness, rest_lengths[s]);
    add_link(body, b, a, stiffness, rest_lengths[s]);
  }
  return body;
}

const float *fast_link_positions(const struct fast_link *body) { return &body->positions->x; }

/* The force of a node's springs; each spring is computed at both of its ends. */
static inline __attribute__((always_inline)) struct vector row_force(const struct vector *restrict positions,
                                                                     const struct link *restrict row, uint32_t count,
                                                                     struct vector here) {
  struct vector force = {0.0f, 0.0f, 0.0f};
  for (uint32_t k = 0; k < count; k++) {
    struct vector there = positions[row[k].neighbor];
    float x = there.x - here.x, y = there.y - here.y, z = there.z - here.z;
    float length = sqrtf(x * x + y * y + z * z);
    float pull = row[k].stiffness * (length - row[k].rest_length) / length;
    force.x += pull * x;
    force.y += pull * y;
    force.z += pull * z;
  }
  return force;
}

/* The compiler unrolls the case of eight neighbors, that of most nodes of a sheet. */
static inline __attribute__((always_inline)) struct vector spring_force(const struct vector *restrict positions,
                                                                        const struct link *restrict row, uint32_t count,
                                                                        struct vector here) {
  if (count == 8) return row_force(positions, row, 8, here);
  return row_force(positions, row, count, here);
}

/* Prefetches the first, middle and last neighbor of a later node: on a grid, one in each of the three rows. */
static inline void prefetch_neighbors(const struct vector *positions, const struct link *row, uint32_t count) {
  if (count == 0) return;
  __builtin_prefetch(&positions[row[0].neighbor]);
  __builtin_prefetch(&positions[row[count / 2].neighbor]);
  __builtin_prefetch(&positions[row[count - 1].neighbor]);
}

/* A node of inverse mass 0 is pinned: no force or gravity acts on it. */
static inline struct vector kicked(struct vector velocity, struct vector force, float inverse_mass, float gravity,
                                   float h) {
  float share = h * inverse_mass;
  velocity.x += share * force.x;
  velocity.y += share * force.y + (inverse_mass > 0.0f ? h * gravity : 0.0f);
  velocity.z += share * force.z;
  return velocity;
}

static inline struct vector drifted(struct vector position, struct vector velocity, float h) {
  return (struct vector){position.x + h * velocity.x, position.y + h * velocity.y, position.z + h * velocity.z};
}

/* Forces in one pass over the nodes, integration in another. */
static inline __attribute__((always_inline)) void two_passes(struct fast_link *body, float h, float gravity,
                                                             uint32_t ahead) {
  const struct vector *restrict positions = body->positions;
  struct vector *restrict forces = body->forces;
  uint32_t width = body->springs_per_node, count = body->node_count;
  for (uint32_t i = 0; i < count; i++) {
    if (ahead != 0 && i + ahead < count)
      prefetch_neighbors(positions, body->links + (size_t)(i + ahead) * width, body->link_counts[i + ahead]);
    forces[i] = spring_force(positions, body->links + (size_t)i * width, body->link_counts[i], positions[i]);
  }
  for (uint32_t i = 0; i < count; i++) {
    body->velocities[i] = kicked(body->velocities[i], forces[i], body->inverse_masses[i], gravity, h);
    body->positions[i] = drifted(body->positions[i], body->velocities[i], h);
  }
}

/* The same in one pass: new positions go to a second array, since neighbors still need the old ones. */
static inline __attribute__((always_inline)) void one_pass(struct fast_link *body, float h, float gravity,
                                                           uint32_t ahead) {
  const struct vector *restrict positions = body->positions;
  struct vector *restrict next = body->next_positions;
  struct vector *restrict velocities = body->velocities;
  uint32_t width = body->springs_per_node, count = body->node_count;
  for (uint32_t i = 0; i < count; i++) {
    if (ahead != 0 && i + ahead < count)
      prefetch_neighbors(positions, body->links + (size_t)(i + ahead) * width, body->link_counts[i + ahead]);
    struct vector force = spring_force(positions, body->links + (size_t)i * width, body->link_counts[i], positions[i]);
    velocities[i] = kicked(velocities[i], force, body->inverse_masses[i], gravity, h);
    next[i] = drifted(positions[i], velocities[i], h);
  }
  body->next_positions = body->positions;
  body->positions = next;
}

/* One Verlet step of h seconds under gravity along y; ahead: 0 (no prefetch), 8, 16, 24 or 32 nodes. */
void fast_link_step(struct fast_link *body, float h, float gravity, uint32_t ahead, uint32_t passes) {
#define STEP(distance) \
  case distance: \
    if (passes == 2) \
      two_passes(body, h, gravity, distance); \
    else \
      one_pass(body, h, gravity, distance); \
    break
  switch (ahead) {
    STEP(0);
    STEP(8);
    STEP(16);
    STEP(24);
    STEP(32);
  }
#undef STEP
}
