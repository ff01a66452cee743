/* Numbers that are legal and extreme, in every place that takes one: an answer each time, never a fault, never a position,
 * velocity, force or energy that is not finite; and where the step is not taken, nothing has moved. */
#include "scene.h"

#include <float.h>

static const float extremes[] = {FLT_MAX, 1e30f, 1e10f, 1e-10f, 1e-30f, FLT_MIN, 1e-45f};
enum { EXTREMES = sizeof extremes / sizeof extremes[0] };

static sinew_world *world;
static sinew_body_id body;
static sinew_tool_id sphere;
static const char *where;
static float value;

#define SOUND(condition)                                                       \
    do {                                                                       \
        if (!(condition)) {                                                    \
            failures++;                                                        \
            fprintf(stderr, "%s:%d: with %s %g: not so: %s\n", __FILE__, __LINE__, where, (double)value, #condition); \
        }                                                                      \
    } while (0)

static int all_finite(const float *vector)
{
    return isfinite(vector[0]) && isfinite(vector[1]) && isfinite(vector[2]);
}

static void everything_is_finite(void)
{
    sinew_vec3_view positions, velocities;
    sinew_energy energy;
    float force[3], torque[3];
    size_t node;
    MUST(sinew_body_get_positions(world, body, &positions));
    MUST(sinew_body_get_velocities(world, body, &velocities));
    for (node = 0; node < positions.count; node++) {
        SOUND(all_finite(node_of(positions, node)));
        SOUND(all_finite(node_of(velocities, node)));
    }
    MUST(sinew_body_get_pin_force(world, body, 0, force));
    SOUND(all_finite(force));
    MUST(sinew_tool_get_wrench(world, sphere, force, torque));
    SOUND(all_finite(force) && all_finite(torque));
    energy.struct_size = sizeof energy;
    MUST(sinew_body_get_energy(world, body, &energy));
    SOUND(isfinite(energy.kinetic) && isfinite(energy.elastic) && isfinite(energy.gravitational));
}

static void steps_are_sound(float dt)
{
    int i;
    for (i = 0; i < 3; i++) {
        const uint64_t before = hash_of(world);
        const sinew_status status = sinew_world_step(world, dt, NULL);
        SOUND(status == SINEW_STATUS_OK || status == SINEW_STATUS_UNSTABLE);
        if (status == SINEW_STATUS_INTERNAL)
            exit(2);
        SOUND(status == SINEW_STATUS_OK || hash_of(world) == before);
        everything_is_finite();
    }
}

/* What may be said of a number that is legal by itself: taken, or refused for what it would lead to. */
static int taken(sinew_status status)
{
    SOUND(status == SINEW_STATUS_OK || status == SINEW_STATUS_INVALID_ARGUMENT);
    return status == SINEW_STATUS_OK;
}

/* A triangle whose node 0 is pinned, and a sphere that presses on it. Each definition is spoiled by the case. */
static float positions[9], rest_positions[9], masses[3], dampings[3], stiffnesses[3], lengths[3], spring_dampings[3];
static sinew_world_def world_def;
static sinew_tool_def tool_def;

static void reset(void)
{
    static const float corners[9] = {0, 0, 0, 1, 0, 0, 0, 0, -1};
    int i;
    memcpy(positions, corners, sizeof corners);
    memcpy(rest_positions, corners, sizeof corners);
    for (i = 0; i < 3; i++) {
        masses[i] = 0.1f;
        dampings[i] = 0.01f;
        stiffnesses[i] = 100.0f;
        lengths[i] = 1.0f;
        spring_dampings[i] = 0.01f;
    }
    MUST(sinew_world_def_init(&world_def, sizeof world_def));
    MUST(sinew_tool_def_init(&tool_def, sizeof tool_def));
    tool_def.shape = SINEW_SHAPE_CAPSULE;
    tool_def.radius = tool_def.half_length = 0.2f;
    tool_def.position[0] = 0.3f;
    tool_def.position[1] = 0.3f;
    tool_def.position[2] = -0.3f;
}

/* The scene of these definitions, where they are taken. */
static int begin(int with_lengths)
{
    static const uint32_t springs[6] = {0, 1, 1, 2, 2, 0}, triangle[3] = {0, 1, 2};
    sinew_body_def def;
    if (!taken(sinew_world_create(&world_def, &world)))
        return 0;
    MUST(sinew_body_def_init(&def, sizeof def));
    def.positions = positions;
    def.rest_positions = rest_positions;
    def.node_count = 3;
    def.masses = masses;
    def.node_dampings = dampings;
    def.springs = springs;
    def.spring_count = 3;
    def.stiffnesses = stiffnesses;
    def.rest_lengths = with_lengths ? lengths : NULL;
    def.spring_dampings = spring_dampings;
    def.triangles = triangle;
    def.triangle_count = 1;
    if (taken(sinew_body_create(world, &def, &body)) && taken(sinew_tool_create(world, &tool_def, &sphere))) {
        MUST(sinew_body_pin(world, body, 0));
        return 1;
    }
    sinew_world_destroy(world);
    return 0;
}

#define DEFINED(set)                                                           \
    do {                                                                       \
        int lengths_given;                                                     \
        where = #set;                                                          \
        for (lengths_given = 0; lengths_given < 2; lengths_given++) {          \
            reset();                                                           \
            set;                                                               \
            if (begin(lengths_given)) {                                        \
                steps_are_sound(0.01f);                                        \
                sinew_world_destroy(world);                                    \
            }                                                                  \
        }                                                                      \
    } while (0)

#define CALLED(call)                                                           \
    do {                                                                       \
        where = #call;                                                         \
        reset();                                                               \
        MUST((sinew_status)!begin(0));                                         \
        if (taken(call))                                                       \
            steps_are_sound(0.01f);                                            \
        sinew_world_destroy(world);                                            \
    } while (0)

static void definitions(void)
{
    DEFINED(world_def.gravity[1] = value);
    DEFINED(world_def.tolerance = value);
    DEFINED(positions[8] = value);
    DEFINED(positions[8] = -value; positions[4] = value);
    DEFINED(rest_positions[4] = value);
    DEFINED(masses[1] = value);
    DEFINED(masses[0] = masses[1] = masses[2] = value);
    DEFINED(dampings[1] = value);
    DEFINED(stiffnesses[1] = value);
    DEFINED(lengths[1] = value);
    DEFINED(spring_dampings[1] = value);
    DEFINED(tool_def.radius = value);
    DEFINED(tool_def.half_length = value);
    DEFINED(tool_def.friction = value);
    DEFINED(tool_def.position[1] = value);
    DEFINED(tool_def.orientation[0] = value; tool_def.orientation[3] = 0.0f);
}

static void calls(void)
{
    const float up[3] = {0, value, 0}, askew[9] = {0, 0, 0, 1, value, 0, 0, 0, -value}, turned[4] = {value, value, value, value};
    const float down[3] = {0.3f, -1.0f, -0.3f};
    CALLED(sinew_world_set_gravity(world, up));
    CALLED(sinew_body_apply_force(world, body, 1, up));
    CALLED(sinew_body_set_positions(world, body, askew, 3));
    CALLED(sinew_body_set_velocities(world, body, askew, 3));
    CALLED(sinew_body_move_pin(world, body, 0, up));
    CALLED((sinew_body_remove_spring(world, body, 0, 1), sinew_body_add_spring(world, body, 0, 1, value, 1.0f)));
    CALLED((sinew_body_remove_spring(world, body, 0, 1), sinew_body_add_spring(world, body, 0, 1, 10.0f, value)));
    CALLED(sinew_tool_set_pose(world, sphere, up, NULL));
    CALLED(sinew_tool_set_pose(world, sphere, down, turned));

    where = "dt";
    reset();
    MUST((sinew_status)!begin(0));
    steps_are_sound(value);
    sinew_world_destroy(world);
}

int main(void)
{
    int i;
    for (i = 0; i < EXTREMES; i++) {
        value = extremes[i];
        definitions();
        calls();
    }
    return checked("extreme numbers get an answer, and all stays finite");
}
