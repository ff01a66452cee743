/* The hash that the refusals lean on: it sees everything that the next step depends on, and nothing else. */
#include "check.h"

static sinew_world *world;
static sinew_body_id body;
static sinew_tool_id tool;

static uint64_t hash(void)
{
    uint64_t value = 0;
    MUST(sinew_world_get_state_hash(world, &value));
    return value;
}

#define SEEN(call)                                                             \
    do {                                                                       \
        const uint64_t before_ = hash();                                       \
        MUST(call);                                                            \
        CHECK(hash() != before_ && #call);                                     \
    } while (0)
#define NOT_SEEN(call)                                                         \
    do {                                                                       \
        const uint64_t before_ = hash();                                       \
        MUST(call);                                                            \
        CHECK(hash() == before_ && #call);                                     \
    } while (0)

static const float corners[] = {0, 0, 0, 1, 0, 0, 1, 0, 1, 0, 0, 1};
static const float moved[] = {0, 0, 0, 1, 0, 0, 1, 0, 1, 0, 0, 1.5f};
static const float speeds[12] = {0, 0, 0, 0.1f};
static const uint32_t ring[] = {0, 1, 1, 2, 2, 3, 3, 0};

static sinew_body_def square(void)
{
    sinew_body_def def;
    MUST(sinew_body_def_init(&def, sizeof def));
    def.positions = corners;
    def.node_count = 4;
    def.node_mass = 0.1f;
    def.springs = ring;
    def.spring_count = 4;
    def.stiffness = 10.0f;
    return def;
}

static void set_up(void)
{
    sinew_world_def world_def;
    sinew_tool_def tool_def;
    const sinew_body_def body_def = square();
    MUST(sinew_world_def_init(&world_def, sizeof world_def));
    MUST(sinew_world_create(&world_def, &world));
    SEEN(sinew_body_create(world, &body_def, &body));
    MUST(sinew_tool_def_init(&tool_def, sizeof tool_def));
    tool_def.shape = SINEW_SHAPE_SPHERE;
    tool_def.radius = 0.1f;
    tool_def.position[1] = 1.0f;
    SEEN(sinew_tool_create(world, &tool_def, &tool));
}

static void what_is_seen(void)
{
    const float up[3] = {0, 1, 0}, over[3] = {0, 2, 0}, turned[4] = {0, 1, 0, 0}, weak[3] = {0, -1, 0};
    const sinew_body_def def = square();
    const uint32_t node = 1;
    sinew_body_id second;
    SEEN(sinew_body_apply_force(world, body, 2, up));
    SEEN(sinew_body_apply_forces(world, body, &node, up, 1));
    SEEN(sinew_body_set_positions(world, body, moved, 4));
    SEEN(sinew_body_set_velocities(world, body, speeds, 4));
    SEEN(sinew_body_pin(world, body, 0));
    SEEN(sinew_body_move_pin(world, body, 0, up));
    SEEN(sinew_body_pin_axes(world, body, 0, SINEW_AXIS_X));
    SEEN(sinew_body_pin_axes(world, body, 0, SINEW_AXIS_Y));
    SEEN(sinew_body_unpin(world, body, 0));
    SEEN(sinew_body_add_spring(world, body, 0, 2, 10.0f, -1.0f));
    SEEN(sinew_body_remove_spring(world, body, 0, 2));
    SEEN(sinew_tool_set_pose(world, tool, over, NULL));
    SEEN(sinew_tool_set_pose(world, tool, over, turned));
    SEEN(sinew_world_set_gravity(world, weak));
    SEEN(sinew_world_step(world, 0.01f, NULL));
    SEEN(sinew_body_create(world, &def, &second));
    SEEN(sinew_body_destroy(world, second));
    SEEN(sinew_tool_destroy(world, tool));
}

static void what_is_not(void)
{
    float force[3];
    sinew_vec3_view view;
    sinew_energy energy;
    sinew_storage_report report;
    energy.struct_size = sizeof energy;
    report.struct_size = sizeof report;
    MUST(sinew_body_pin(world, body, 0));
    NOT_SEEN(sinew_body_get_positions(world, body, &view));
    NOT_SEEN(sinew_body_get_velocities(world, body, &view));
    NOT_SEEN(sinew_body_get_pin_force(world, body, 0, force));
    NOT_SEEN(sinew_body_get_energy(world, body, &energy));
    NOT_SEEN(sinew_body_get_storage_report(world, body, &report));
}

int main(void)
{
    set_up();
    what_is_seen();
    what_is_not();
    sinew_world_destroy(world);
    return checked("the state hash sees what the next step depends on");
}
