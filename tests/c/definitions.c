/* Definitions and result structs of other sizes than the library's own: what an older program passes keeps working and
 * nothing is read or written behind it; and what an init function fills in. */
#include "check.h"
#include "contract.h"

/* A struct as an older program lays it out, with what happens to lie behind it. */
#define GUARDED(type)                                                          \
    union { sinew_##type now; unsigned char bytes[sizeof(sinew_##type) + 64]; }
#define BEHIND 0xA5

static int untouched_behind(const unsigned char *bytes, size_t size, size_t end)
{
    while (size < end)
        if (bytes[size++] != BEHIND)
            return 0;
    return 1;
}

#define FILLED(guarded, type)                                                  \
    do {                                                                       \
        memset((guarded).bytes, BEHIND, sizeof(guarded).bytes);                \
        CHECK(sinew_##type##_init(&(guarded).now, sizeof(contract_##type)) == SINEW_STATUS_OK); \
        CHECK((guarded).now.struct_size == sizeof(contract_##type));           \
        CHECK(untouched_behind((guarded).bytes, sizeof(contract_##type), sizeof(guarded).bytes)); \
    } while (0)

static const float three_nodes[] = {0, 0, 0, 1, 0, 0, 0, 0, 1};
static const uint32_t two_springs[] = {0, 1, 1, 2};

static sinew_world *world_of_the_oldest_definition(void)
{
    GUARDED(world_def) def;
    sinew_world *world = NULL;
    FILLED(def, world_def);
    CHECK(def.now.gravity[0] == 0.0f && def.now.gravity[1] == -9.81f && def.now.gravity[2] == 0.0f);
    CHECK(def.now.thread_count == 1);
    CHECK(def.now.substeps == 0);
    CHECK(def.now.max_substeps == 1000);
    CHECK(def.now.tolerance == 0.0f);
    CHECK(def.now.reserved == 0);
    MUST(sinew_world_create(&def.now, &world));
    return world;
}

static sinew_body_id body_of_the_oldest_definition(sinew_world *world)
{
    GUARDED(body_def) def;
    sinew_body_id body = {0, 0};
    FILLED(def, body_def);
    CHECK(def.now.positions == NULL && def.now.rest_positions == NULL && def.now.node_count == 0);
    CHECK(def.now.masses == NULL && def.now.node_dampings == NULL && def.now.node_damping == 0.0f);
    CHECK(def.now.springs == NULL && def.now.spring_count == 0);
    CHECK(def.now.stiffnesses == NULL && def.now.rest_lengths == NULL && def.now.spring_dampings == NULL);
    CHECK(def.now.spring_damping == 0.0f);
    CHECK(def.now.triangles == NULL && def.now.triangle_count == 0);
    CHECK(def.now.tetrahedra == NULL && def.now.tetrahedron_count == 0);
    CHECK(def.now.storage == SINEW_STORAGE_PACKED && def.now.springs_per_node == 0);
    CHECK(def.now.solver == SINEW_SOLVER_AUTO && def.now.reserved == 0);
    def.now.positions = three_nodes;
    def.now.node_count = 3;
    def.now.node_mass = 0.1f;
    def.now.springs = two_springs;
    def.now.spring_count = 2;
    def.now.stiffness = 10.0f;
    MUST(sinew_body_create(world, &def.now, &body));
    return body;
}

static void tool_of_the_oldest_definition(sinew_world *world)
{
    GUARDED(tool_def) def;
    sinew_tool_id tool = {0, 0};
    FILLED(def, tool_def);
    CHECK(def.now.positions == NULL && def.now.node_count == 0);
    CHECK(def.now.triangles == NULL && def.now.triangle_count == 0);
    CHECK(def.now.detection == SINEW_DETECTION_EXACT && def.now.friction == 0.0f);
    CHECK(def.now.position[0] == 0.0f && def.now.position[1] == 0.0f && def.now.position[2] == 0.0f);
    CHECK(def.now.orientation[0] == 0.0f && def.now.orientation[1] == 0.0f && def.now.orientation[2] == 0.0f);
    CHECK(def.now.orientation[3] == 1.0f);
    CHECK(def.now.reserved0 == 0 && def.now.reserved == 0);
    def.now.shape = SINEW_SHAPE_SPHERE;
    def.now.radius = 0.01f;
    def.now.position[1] = 5.0f;
    MUST(sinew_tool_create(world, &def.now, &tool));
}

static void oldest_result_structs(sinew_world *world, sinew_body_id body)
{
    GUARDED(step_report) step;
    GUARDED(energy) energy;
    GUARDED(storage_report) storage;

    memset(step.bytes, BEHIND, sizeof step.bytes);
    step.now.struct_size = sizeof(contract_step_report);
    CHECK(sinew_world_step(world, 1e-3f, &step.now) == SINEW_STATUS_OK);
    CHECK(step.now.struct_size == sizeof(contract_step_report));
    CHECK(step.now.substeps >= 1 && step.now.bodies_restored == 0);
    CHECK(step.now.stable_substep > 0.0f && step.now.error_estimate == 0.0f);
    CHECK(untouched_behind(step.bytes, sizeof(contract_step_report), sizeof step.bytes));

    memset(energy.bytes, BEHIND, sizeof energy.bytes);
    energy.now.struct_size = sizeof(contract_energy);
    CHECK(sinew_body_get_energy(world, body, &energy.now) == SINEW_STATUS_OK);
    CHECK(energy.now.struct_size == sizeof(contract_energy));
    CHECK(energy.now.kinetic > 0.0 && isfinite(energy.now.elastic) && isfinite(energy.now.gravitational));
    CHECK(untouched_behind(energy.bytes, sizeof(contract_energy), sizeof energy.bytes));

    memset(storage.bytes, BEHIND, sizeof storage.bytes);
    storage.now.struct_size = sizeof(contract_storage_report);
    CHECK(sinew_body_get_storage_report(world, body, &storage.now) == SINEW_STATUS_OK);
    CHECK(storage.now.struct_size == sizeof(contract_storage_report));
    CHECK(storage.now.node_count == 3 && storage.now.spring_count == 2);
    CHECK(storage.now.bytes_used > 0 && storage.now.bytes_used <= storage.now.bytes_reserved);
    CHECK(untouched_behind(storage.bytes, sizeof(contract_storage_report), sizeof storage.bytes));
}

/* A result struct of a newer header, or of which nobody set the size: it is refused, and nothing is written. */
static void newer_result_structs(sinew_world *world, sinew_body_id body)
{
    GUARDED(step_report) step;
    GUARDED(energy) energy;
    GUARDED(storage_report) storage;
#define NEWER(guarded, call)                                                   \
    memset((guarded).bytes, BEHIND, sizeof(guarded).bytes);                    \
    (guarded).now.struct_size = sizeof(guarded).now + 16;                      \
    CHECK((call) == SINEW_STATUS_INVALID_ARGUMENT);                            \
    CHECK((guarded).now.struct_size == sizeof(guarded).now + 16);              \
    CHECK(untouched_behind((guarded).bytes, sizeof(size_t), sizeof(guarded).bytes))
    NEWER(step, sinew_world_step(world, 1e-3f, &step.now));
    NEWER(energy, sinew_body_get_energy(world, body, &energy.now));
    NEWER(storage, sinew_body_get_storage_report(world, body, &storage.now));
}

/* The size that this header declares is accepted as well, and nothing beyond it is written. */
static void todays_sizes(void)
{
    GUARDED(world_def) world;
    GUARDED(body_def) body;
    GUARDED(tool_def) tool;
#define TODAY(guarded, type)                                                   \
    memset((guarded).bytes, BEHIND, sizeof(guarded).bytes);                    \
    CHECK(sinew_##type##_init(&(guarded).now, sizeof(guarded).now) == SINEW_STATUS_OK); \
    CHECK((guarded).now.struct_size == sizeof(guarded).now);                   \
    CHECK(untouched_behind((guarded).bytes, sizeof(guarded).now, sizeof(guarded).bytes))
    TODAY(world, world_def);
    TODAY(body, body_def);
    TODAY(tool, tool_def);
}

int main(void)
{
    sinew_world *world = world_of_the_oldest_definition();
    sinew_body_id body = body_of_the_oldest_definition(world);
    tool_of_the_oldest_definition(world);
    oldest_result_structs(world, body);
    newer_result_structs(world, body);
    todays_sizes();
    sinew_world_destroy(world);
    return checked("structs of the oldest sizes are accepted, and nothing behind them is touched");
}
