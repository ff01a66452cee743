/* include/sinew.h keeps the contract: constants, layouts and signatures at compile time; the version and the names of
 * statuses when it runs. EXPECTED_VERSION is the version of the crate. */
#include "check.h"
#include "contract.h"

#define HOLDS(condition) extern char holds[(condition) ? 1 : -1]

/* The comparison of two pointers does not compile where the types differ. */
#define FIELD(type, field)                                                     \
    HOLDS(offsetof(sinew_##type, field) == offsetof(contract_##type, field)    \
          && sizeof(&((sinew_##type *)0)->field == &((contract_##type *)0)->field) != 0)
#define GROWS_AT_ITS_END(type) HOLDS(sizeof(sinew_##type) >= sizeof(contract_##type))
#define NEVER_GROWS(type) HOLDS(sizeof(sinew_##type) == sizeof(contract_##type))

HOLDS(SINEW_STATUS_OK == 0);
HOLDS(SINEW_STATUS_INVALID_ARGUMENT == 1);
HOLDS(SINEW_STATUS_STALE_ID == 2);
HOLDS(SINEW_STATUS_CAPACITY == 3);
HOLDS(SINEW_STATUS_OUT_OF_MEMORY == 4);
HOLDS(SINEW_STATUS_UNSTABLE == 5);
HOLDS(SINEW_STATUS_UNSUPPORTED == 6);
HOLDS(SINEW_STATUS_IO == 7);
HOLDS(SINEW_STATUS_INTERNAL == 8);
HOLDS(SINEW_STORAGE_PACKED == 0);
HOLDS(SINEW_STORAGE_EFFICIENT == 1);
HOLDS(SINEW_STORAGE_FAST_LINK == 2);
HOLDS(SINEW_STORAGE_DYNAMIC_BULK == 3);
HOLDS(SINEW_SOLVER_VERLET == 0);
HOLDS(SINEW_SOLVER_IMPLICIT == 1);
HOLDS(SINEW_SOLVER_NEWTON == 2);
HOLDS(SINEW_SHAPE_SPHERE == 0);
HOLDS(SINEW_SHAPE_CAPSULE == 1);
HOLDS(SINEW_SHAPE_PLANE == 2);
HOLDS(SINEW_SHAPE_MESH == 3);
HOLDS(SINEW_DETECTION_EXACT == 0);
HOLDS(SINEW_DETECTION_IMAGE_SPACE == 1);
HOLDS(SINEW_DETECTION_DISTANCE_FIELD == 2);

/* A status is an int32_t, and a failed one is recognised by any compiler's switch. */
HOLDS(sizeof(sinew_status) == 4 && (sinew_status)-1 < 0);

#if SINEW_VERSION != EXPECTED_VERSION
#error "SINEW_VERSION is not the version of the crate"
#endif
HOLDS(SINEW_VERSION == ((SINEW_VERSION_MAJOR << 16) | (SINEW_VERSION_MINOR << 8) | SINEW_VERSION_PATCH));

NEVER_GROWS(body_id);
FIELD(body_id, index1);
FIELD(body_id, generation);
NEVER_GROWS(tool_id);
FIELD(tool_id, index1);
FIELD(tool_id, generation);
NEVER_GROWS(vec3_view);
FIELD(vec3_view, data);
FIELD(vec3_view, count);
FIELD(vec3_view, stride);

GROWS_AT_ITS_END(world_def);
FIELD(world_def, struct_size);
FIELD(world_def, gravity);
FIELD(world_def, thread_count);
FIELD(world_def, substeps);
FIELD(world_def, max_substeps);
FIELD(world_def, tolerance);
FIELD(world_def, reserved);

GROWS_AT_ITS_END(step_report);
FIELD(step_report, struct_size);
FIELD(step_report, substeps);
FIELD(step_report, stable_substep);
FIELD(step_report, bodies_restored);
FIELD(step_report, error_estimate);

GROWS_AT_ITS_END(body_def);
FIELD(body_def, struct_size);
FIELD(body_def, positions);
FIELD(body_def, rest_positions);
FIELD(body_def, node_count);
FIELD(body_def, masses);
FIELD(body_def, node_dampings);
FIELD(body_def, node_mass);
FIELD(body_def, node_damping);
FIELD(body_def, springs);
FIELD(body_def, spring_count);
FIELD(body_def, stiffnesses);
FIELD(body_def, rest_lengths);
FIELD(body_def, spring_dampings);
FIELD(body_def, stiffness);
FIELD(body_def, spring_damping);
FIELD(body_def, triangles);
FIELD(body_def, triangle_count);
FIELD(body_def, tetrahedra);
FIELD(body_def, tetrahedron_count);
FIELD(body_def, storage);
FIELD(body_def, springs_per_node);
FIELD(body_def, solver);
FIELD(body_def, reserved);

GROWS_AT_ITS_END(energy);
FIELD(energy, struct_size);
FIELD(energy, kinetic);
FIELD(energy, elastic);
FIELD(energy, gravitational);

GROWS_AT_ITS_END(storage_report);
FIELD(storage_report, struct_size);
FIELD(storage_report, node_count);
FIELD(storage_report, spring_count);
FIELD(storage_report, bytes_used);
FIELD(storage_report, bytes_reserved);

GROWS_AT_ITS_END(tool_def);
FIELD(tool_def, struct_size);
FIELD(tool_def, shape);
FIELD(tool_def, radius);
FIELD(tool_def, half_length);
FIELD(tool_def, reserved0);
FIELD(tool_def, positions);
FIELD(tool_def, node_count);
FIELD(tool_def, triangles);
FIELD(tool_def, triangle_count);
FIELD(tool_def, detection);
FIELD(tool_def, friction);
FIELD(tool_def, position);
FIELD(tool_def, orientation);
FIELD(tool_def, reserved);

/* Every function under its type; an assignment between other types does not compile. */
static const struct {
    uint32_t (*version)(void);
    const char *(*status_name)(sinew_status);
    size_t (*last_error)(char *, size_t);
    sinew_status (*world_def_init)(sinew_world_def *, size_t);
    sinew_status (*world_create)(const sinew_world_def *, sinew_world **);
    void (*world_destroy)(sinew_world *);
    sinew_status (*world_step)(sinew_world *, float, sinew_step_report *);
    sinew_status (*world_set_gravity)(sinew_world *, const float *);
    sinew_status (*world_get_state_hash)(const sinew_world *, uint64_t *);
    sinew_status (*body_def_init)(sinew_body_def *, size_t);
    sinew_status (*body_create)(sinew_world *, const sinew_body_def *, sinew_body_id *);
    sinew_status (*body_destroy)(sinew_world *, sinew_body_id);
    sinew_status (*body_apply_force)(sinew_world *, sinew_body_id, uint32_t, const float *);
    sinew_status (*body_apply_forces)(sinew_world *, sinew_body_id, const uint32_t *, const float *, size_t);
    sinew_status (*body_get_positions)(const sinew_world *, sinew_body_id, sinew_vec3_view *);
    sinew_status (*body_get_velocities)(const sinew_world *, sinew_body_id, sinew_vec3_view *);
    sinew_status (*body_set_positions)(sinew_world *, sinew_body_id, const float *, size_t);
    sinew_status (*body_set_velocities)(sinew_world *, sinew_body_id, const float *, size_t);
    sinew_status (*body_pin)(sinew_world *, sinew_body_id, uint32_t);
    sinew_status (*body_unpin)(sinew_world *, sinew_body_id, uint32_t);
    sinew_status (*body_move_pin)(sinew_world *, sinew_body_id, uint32_t, const float *);
    sinew_status (*body_get_pin_force)(const sinew_world *, sinew_body_id, uint32_t, float *);
    sinew_status (*body_add_spring)(sinew_world *, sinew_body_id, uint32_t, uint32_t, float, float);
    sinew_status (*body_remove_spring)(sinew_world *, sinew_body_id, uint32_t, uint32_t);
    sinew_status (*body_get_energy)(const sinew_world *, sinew_body_id, sinew_energy *);
    sinew_status (*body_get_storage_report)(const sinew_world *, sinew_body_id, sinew_storage_report *);
    sinew_status (*tool_def_init)(sinew_tool_def *, size_t);
    sinew_status (*tool_create)(sinew_world *, const sinew_tool_def *, sinew_tool_id *);
    sinew_status (*tool_destroy)(sinew_world *, sinew_tool_id);
    sinew_status (*tool_set_pose)(sinew_world *, sinew_tool_id, const float *, const float *);
    sinew_status (*tool_get_wrench)(const sinew_world *, sinew_tool_id, float *, float *);
} functions = {
    sinew_version,
    sinew_status_name,
    sinew_last_error,
    sinew_world_def_init,
    sinew_world_create,
    sinew_world_destroy,
    sinew_world_step,
    sinew_world_set_gravity,
    sinew_world_get_state_hash,
    sinew_body_def_init,
    sinew_body_create,
    sinew_body_destroy,
    sinew_body_apply_force,
    sinew_body_apply_forces,
    sinew_body_get_positions,
    sinew_body_get_velocities,
    sinew_body_set_positions,
    sinew_body_set_velocities,
    sinew_body_pin,
    sinew_body_unpin,
    sinew_body_move_pin,
    sinew_body_get_pin_force,
    sinew_body_add_spring,
    sinew_body_remove_spring,
    sinew_body_get_energy,
    sinew_body_get_storage_report,
    sinew_tool_def_init,
    sinew_tool_create,
    sinew_tool_destroy,
    sinew_tool_set_pose,
    sinew_tool_get_wrench,
};

/* Nine statuses, nine names; and an answer, never NULL, to what is no status. */
static void statuses_have_names(void)
{
    sinew_status a, b;
    for (a = SINEW_STATUS_OK; a <= SINEW_STATUS_INTERNAL; a++) {
        CHECK(functions.status_name(a) != NULL && functions.status_name(a)[0] != '\0');
        for (b = SINEW_STATUS_OK; b < a; b++)
            CHECK(strcmp(sinew_status_name(a), sinew_status_name(b)) != 0);
    }
    CHECK(sinew_status_name(-1) != NULL);
    CHECK(sinew_status_name(SINEW_STATUS_INTERNAL + 1000) != NULL);
    CHECK(sinew_status_name(INT32_MIN) != NULL && sinew_status_name(INT32_MAX) != NULL);
}

int main(void)
{
    CHECK(functions.version() == SINEW_VERSION);
    statuses_have_names();
    return checked("the header keeps the contract");
}
