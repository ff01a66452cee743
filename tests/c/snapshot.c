/* A world to bytes and back: what was cut and is touched goes on to the bit, and what is no world is refused. */
#include "scene.h"

enum { STEPS = 40, SAVED = 17 };

static sinew_body_id body;
static sinew_tool_id tool;

static void refused(sinew_status status, sinew_status expected, const char *word)
{
    char message[512];
    sinew_last_error(message, sizeof message);
    CHECK(status == expected);
    if (strstr(message, word) == NULL)
        printf("%s\n", message);
    CHECK(strstr(message, word) != NULL);
}

/* A cloth that hangs by its rim, may be cut, and has a ball above it. */
static sinew_world *a_scene(void)
{
    sinew_world *world = a_world(-9.81f);
    float positions[3 * CLOTH_NODES];
    uint32_t triangles[6 * (SIDE - 1) * (SIDE - 1)], i, *next = triangles;
    sinew_body_def def;
    sinew_tool_def tool_def;
    for (i = 0; i < CLOTH_NODES; i++) {
        positions[3 * i] = 0.01f * (float)(i % SIDE) - 0.04f;
        positions[3 * i + 1] = 0.0f;
        positions[3 * i + 2] = 0.01f * (float)(i / SIDE) - 0.04f;
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
    def.stiffness = (float)SOFT;
    def.triangles = triangles;
    def.triangle_count = (size_t)(next - triangles) / 3;
    def.spare_nodes = 400;
    MUST(sinew_body_create(world, &def, &body));
    for (i = 0; i < CLOTH_NODES; i++)
        if (at_the_rim(i))
            MUST(sinew_body_pin(world, body, i));
    MUST(sinew_tool_def_init(&tool_def, sizeof tool_def));
    tool_def.shape = SINEW_SHAPE_SPHERE;
    tool_def.radius = 0.015f;
    tool_def.position[1] = 0.03f;
    MUST(sinew_tool_create(world, &tool_def, &tool));
    return world;
}

/* The ball comes down beside a cut that grows by 2 mm a step. */
static void step(sinew_world *world, int number)
{
    const float place[3] = {0.0f, 0.03f - 0.0008f * (float)number, 0.0f};
    MUST(sinew_tool_set_pose(world, tool, place, NULL));
    if (number >= 10 && number < 30) {
        const float x = 0.017f, from = -0.02f + 0.002f * (float)(number - 10), to = from + 0.002f;
        const float start[6] = {x, -0.1f, from, x, 0.1f, from}, end[6] = {x, -0.1f, to, x, 0.1f, to};
        MUST(sinew_body_cut(world, body, start, end, NULL));
    }
    MUST(sinew_world_step(world, 2e-3f, NULL));
}

static void compare(const sinew_world *a, const sinew_world *b)
{
    uint64_t hashes[2] = {0, 1};
    sinew_vec3_view views[2];
    size_t node;
    MUST(sinew_world_get_state_hash(a, &hashes[0]));
    MUST(sinew_world_get_state_hash(b, &hashes[1]));
    CHECK(hashes[0] == hashes[1]);
    MUST(sinew_body_get_positions(a, body, &views[0]));
    MUST(sinew_body_get_positions(b, body, &views[1]));
    CHECK(views[0].count == views[1].count);
    for (node = 0; node < views[0].count; node++)
        CHECK(memcmp(node_of(views[0], node), node_of(views[1], node), 3 * sizeof(float)) == 0);
}

static sinew_world *undo(sinew_world *world, const unsigned char *bytes, size_t size)
{
    sinew_world *before = NULL;
    MUST(sinew_world_load_snapshot(bytes, size, NULL, &before)); /* one thread, no job system */
    sinew_world_destroy(world);
    return before;
}

static unsigned char *save(const sinew_world *world, size_t *size)
{
    unsigned char *bytes;
    MUST(sinew_world_get_snapshot_size(world, size));
    bytes = (unsigned char *)malloc(*size);
    if (bytes != NULL)
        MUST(sinew_world_save_snapshot(world, bytes, *size));
    return bytes;
}

int main(void)
{
    sinew_world *world = a_scene(), *twin = NULL, *untouched = NULL;
    sinew_world_def def;
    unsigned char *bytes = NULL, *again;
    size_t size = 0, size_again = 0, at;
    int number;
    for (number = 0; number < STEPS; number++) {
        if (number == SAVED) {
            bytes = save(world, &size);
            CHECK(bytes != NULL);
            MUST(sinew_world_def_init(&def, sizeof def));
            def.thread_count = 2;
            MUST(sinew_world_load_snapshot(bytes, size, &def, &twin));
            compare(world, twin);
        }
        step(world, number);
        if (twin != NULL) {
            step(twin, number);
            compare(world, twin);
        }
    }
    /* What goes on alike is the same bytes. */
    MUST(sinew_world_get_snapshot_size(world, &size_again));
    again = (unsigned char *)malloc(2 * size_again);
    CHECK(again != NULL);
    MUST(sinew_world_save_snapshot(world, again, size_again));
    MUST(sinew_world_save_snapshot(twin, again + size_again, size_again));
    CHECK(memcmp(again, again + size_again, size_again) == 0);

    refused(sinew_world_save_snapshot(world, again, size_again - 1), SINEW_STATUS_INVALID_ARGUMENT, "size is");
    refused(sinew_world_save_snapshot(world, NULL, size_again), SINEW_STATUS_INVALID_ARGUMENT, "out_bytes");
    refused(sinew_world_save_snapshot(NULL, again, size_again), SINEW_STATUS_INVALID_ARGUMENT, "world");
    refused(sinew_world_get_snapshot_size(world, NULL), SINEW_STATUS_INVALID_ARGUMENT, "out");
    refused(sinew_world_load_snapshot(NULL, 4, NULL, &untouched), SINEW_STATUS_INVALID_ARGUMENT, "bytes");
    refused(sinew_world_load_snapshot(bytes, size, NULL, NULL), SINEW_STATUS_INVALID_ARGUMENT, "out");
    def.thread_count = 1000;
    refused(sinew_world_load_snapshot(bytes, size, &def, &untouched), SINEW_STATUS_INVALID_ARGUMENT, "thread_count");
    refused(sinew_world_load_snapshot(bytes, size - 1, NULL, &untouched), SINEW_STATUS_INVALID_ARGUMENT, "size is");
    refused(sinew_world_load_snapshot(bytes, 0, NULL, &untouched), SINEW_STATUS_INVALID_ARGUMENT, "header");
    for (at = 0; at < size; at += 1 + size / 500) {
        bytes[at] ^= 16;
        CHECK(sinew_world_load_snapshot(bytes, size, NULL, &untouched) != SINEW_STATUS_OK);
        bytes[at] ^= 16;
    }
    CHECK(untouched == NULL);

    /* What has happened since has not. */
    world = undo(world, bytes, size);
    for (number = SAVED; number < STEPS; number++)
        step(world, number);
    compare(world, twin);
    free(bytes);
    free(again);
    sinew_world_destroy(twin);
    sinew_world_destroy(world);
    return 0;
}
