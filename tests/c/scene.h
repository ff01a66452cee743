/* Small scenes for the motion programs: a world, loose nodes, a square cloth. */
#ifndef SCENE_H
#define SCENE_H

#include "check.h"

static inline sinew_world *a_world(float gravity_y)
{
    sinew_world_def def;
    sinew_world *world = NULL;
    MUST(sinew_world_def_init(&def, sizeof def));
    def.gravity[1] = gravity_y;
    MUST(sinew_world_create(&def, &world));
    return world;
}

/* Up to four nodes in a row along x, 1 m apart, 0.5 kg each, joined by nothing. */
static inline sinew_body_id loose_nodes(sinew_world *world, size_t node_count)
{
    static const float positions[] = {0, 0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0};
    static const uint32_t no_springs[] = {0, 0};
    sinew_body_def def;
    sinew_body_id body = {0, 0};
    MUST(sinew_body_def_init(&def, sizeof def));
    def.positions = positions;
    def.node_count = node_count;
    def.node_mass = 0.5f;
    def.springs = no_springs;
    MUST(sinew_body_create(world, &def, &body));
    return body;
}

enum { SIDE = 9, CLOTH_NODES = SIDE * SIDE };

enum { SOFT = 50, STIFF = 500 }; /* N/m; hanging by its rim, the stiff cloth sags by a few millimetres */

/* A cloth in the plane y = 0 about the origin, 0.08 m wide, 1 g a node, springs from its triangles, facing up. */
static inline sinew_body_id a_cloth(sinew_world *world, float stiffness)
{
    float positions[3 * CLOTH_NODES];
    uint32_t triangles[6 * (SIDE - 1) * (SIDE - 1)];
    sinew_body_def def;
    sinew_body_id body = {0, 0};
    uint32_t i, *next = triangles;
    for (i = 0; i < CLOTH_NODES; i++) {
        positions[3 * i] = 0.01f * ((float)(i % SIDE) - (SIDE - 1) / 2);
        positions[3 * i + 1] = 0.0f;
        positions[3 * i + 2] = 0.01f * ((float)(i / SIDE) - (SIDE - 1) / 2);
        if (i % SIDE < SIDE - 1 && i / SIDE < SIDE - 1) {
            const uint32_t corners[6] = {i, i + SIDE, i + 1, i + 1, i + SIDE, i + SIDE + 1};
            memcpy(next, corners, sizeof corners);
            next += 6;
        }
    }
    MUST(sinew_body_def_init(&def, sizeof def));
    def.positions = positions;
    def.node_count = CLOTH_NODES;
    def.node_mass = 1e-3f;
    def.node_damping = 0.02f;
    def.stiffness = stiffness;
    def.triangles = triangles;
    def.triangle_count = (size_t)(next - triangles) / 3;
    MUST(sinew_body_create(world, &def, &body));
    return body;
}

static inline int at_the_rim(uint32_t node)
{
    const uint32_t column = node % SIDE, row = node / SIDE;
    return column == 0 || column == SIDE - 1 || row == 0 || row == SIDE - 1;
}

static inline const float *node_of(sinew_vec3_view view, size_t node)
{
    return (const float *)(const void *)((const char *)view.data + node * view.stride);
}

static inline float position(const sinew_world *world, sinew_body_id body, size_t node, int axis)
{
    sinew_vec3_view view;
    MUST(sinew_body_get_positions(world, body, &view));
    return node_of(view, node)[axis];
}

static inline float velocity(const sinew_world *world, sinew_body_id body, size_t node, int axis)
{
    sinew_vec3_view view;
    MUST(sinew_body_get_velocities(world, body, &view));
    return node_of(view, node)[axis];
}

static inline uint64_t hash_of(const sinew_world *world)
{
    uint64_t hash = 0;
    MUST(sinew_world_get_state_hash(world, &hash));
    return hash;
}

static inline void steps(sinew_world *world, float dt, int count)
{
    while (count-- > 0)
        MUST(sinew_world_step(world, dt, NULL));
}

#endif
