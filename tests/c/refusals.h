/* What a refused call must be: the status that the contract names, a message that names the argument, no output written,
 * the world as it was. Every case of the refusal programs goes through REFUSED. */
#ifndef REFUSALS_H
#define REFUSALS_H

#include "check.h"
#include "contract.h"

#include <ctype.h>

#define INVALID SINEW_STATUS_INVALID_ARGUMENT
#define STALE SINEW_STATUS_STALE_ID
#define CAPACITY SINEW_STATUS_CAPACITY
#define UNSUPPORTED SINEW_STATUS_UNSUPPORTED

enum { BAD_IDS = 7 };

/* The world that nothing may change: a cloth in motion, a tool, and a force and a pose that wait for the next step. */
static struct {
    sinew_world *world;
    sinew_body_id body;             /* a cloth of 9 nodes; 0 is pinned, 2 has no mass, 8 is free; 0 and 1 are joined, 0 and 8 are not */
    sinew_tool_id tool;
    sinew_body_id bad_bodies[BAD_IDS];
    sinew_tool_id bad_tools[BAD_IDS];
    uint64_t hash;
    int refusals;
} the;

/* Where the calls would write, and what stands there. */
static struct outputs {
    sinew_world *world;
    sinew_body_id body;
    sinew_tool_id tool;
    sinew_vec3_view view;
    float force[3], torque[3];
    uint64_t hash;
    sinew_world_def world_def;
    sinew_body_def body_def;
    sinew_tool_def tool_def;
    sinew_step_report step;
    sinew_energy energy;
    sinew_storage_report storage;
    sinew_solver_report solver;
    sinew_enclosed_report enclosed;
    sinew_equilibrium_def rest_def;
    sinew_equilibrium_report rest;
    sinew_mesh *mesh;
    sinew_mesh_view mesh_view;
    sinew_surface_point surface_point;
    sinew_material_preset preset;
    sinew_picture_def picture_def;
    uint32_t pairs[2];
    float numbers[2][9];
    sinew_strain strain;
    sinew_attachment_id attachments[2];
    sinew_suture_def suture_def;
    sinew_attachment_def attachment_def;
    sinew_suture_report suture;
    sinew_contact contacts[2];
    sinew_contact_change changes[2];
    float position[3], orientation[4];
    uint32_t closed;
    size_t count;
} out, untouched;

/* Floats that are refused: the first three everywhere, a negative one often, zero sometimes. */
static const float bad[] = {NAN, INFINITY, -INFINITY, -1.0f, 0.0f};
enum { NOT_FINITE = 3, OR_NEGATIVE = 4, OR_ZERO = 5 };

/* Whether the word stands in the message, and not as a part of another. */
static inline int names(const char *message, const char *word)
{
    const char *at = message;
    while ((at = strstr(at, word)) != NULL) {
        const char before = at == message ? ' ' : at[-1], after = at[strlen(word)];
        if (!isalnum((unsigned char)before) && before != '_' && !isalnum((unsigned char)after) && after != '_')
            return 1;
        at++;
    }
    return 0;
}

/* Leaves an error message behind that does not hold this word, so that an old one is not taken for the new one. */
static inline void another_failure(const char *word)
{
    char message[512];
    sinew_world_create(NULL, NULL);
    sinew_last_error(message, sizeof message);
    if (names(message, word))
        sinew_body_apply_force(the.world, the.body, UINT32_MAX, NULL);
}

static inline void refused(sinew_status got, sinew_status expected, const char *word, const char *call, const char *change,
                           const char *file, int line)
{
    char message[512] = "";
    uint64_t hash = 0;
    sinew_last_error(message, sizeof message);
    the.refusals++;
    if (got == expected && names(message, word) && memcmp(&out, &untouched, sizeof out) == 0
        && sinew_world_get_state_hash(the.world, &hash) == SINEW_STATUS_OK && hash == the.hash)
        return;
    failures++;
    fprintf(stderr, "%s:%d: %s, with %s: ", file, line, call, change);
    if (got != expected)
        fprintf(stderr, "%s instead of %s", sinew_status_name(got), sinew_status_name(expected));
    else if (message[0] == '\0')
        fprintf(stderr, "no message");
    else if (!names(message, word))
        fprintf(stderr, "the message does not name \"%s\": %s", word, message);
    else if (memcmp(&out, &untouched, sizeof out) != 0)
        fprintf(stderr, "an output was written");
    else
        fprintf(stderr, "the world changed");
    fprintf(stderr, "\n");
    memcpy(&out, &untouched, sizeof out);
    if (sinew_world_get_state_hash(the.world, &hash) == SINEW_STATUS_OK)
        the.hash = hash;
}

#define REFUSED_WITH(status, word, call, change)                               \
    do {                                                                       \
        another_failure(word);                                                 \
        refused((call), (status), (word), #call, (change), __FILE__, __LINE__); \
    } while (0)
#define REFUSED(status, word, call) REFUSED_WITH(status, word, call, "what is written there")

/* A call on `world` and `body`, with no world and with every kind of body that is not there. */
#define REFUSES_NO_BODY(call)                                                  \
    do {                                                                       \
        int i_;                                                                \
        {                                                                      \
            sinew_world *const world = NULL;                                   \
            const sinew_body_id body = the.body;                               \
            REFUSED_WITH(INVALID, "world", call, "no world");                  \
        }                                                                      \
        for (i_ = 0; i_ < BAD_IDS; i_++) {                                     \
            sinew_world *const world = the.world;                              \
            const sinew_body_id body = the.bad_bodies[i_];                     \
            REFUSED_WITH(BAD_ID_STATUS(i_), "body", call, bad_id_names[i_]);   \
        }                                                                      \
    } while (0)

/* The same for a call on `world` and `tool`. */
#define REFUSES_NO_TOOL(call)                                                  \
    do {                                                                       \
        int i_;                                                                \
        {                                                                      \
            sinew_world *const world = NULL;                                   \
            const sinew_tool_id tool = the.tool;                               \
            REFUSED_WITH(INVALID, "world", call, "no world");                  \
        }                                                                      \
        for (i_ = 0; i_ < BAD_IDS; i_++) {                                     \
            sinew_world *const world = the.world;                              \
            const sinew_tool_id tool = the.bad_tools[i_];                      \
            REFUSED_WITH(BAD_ID_STATUS(i_), "tool", call, bad_id_names[i_]);   \
        }                                                                      \
    } while (0)

static const char *const bad_id_names[BAD_IDS] = {
    "id zero",       "an id whose place was given to another", "an id of something destroyed", "an index out of range",
    "all bits set", "a generation that was not yet", "an id of another world",
};
#define BAD_ID_STATUS(i) ((i) == BAD_IDS - 1 ? INVALID : STALE)

/* The same for a call on `world` and `attachment`, of which these are the bad ones. */
#define REFUSES_NO_ATTACHMENT(bad_attachments, good, call)                     \
    do {                                                                       \
        int i_;                                                                \
        {                                                                      \
            sinew_world *const world = NULL;                                   \
            const sinew_attachment_id attachment = (good);                     \
            REFUSED_WITH(INVALID, "world", call, "no world");                  \
        }                                                                      \
        for (i_ = 0; i_ < BAD_IDS; i_++) {                                     \
            sinew_world *const world = the.world;                              \
            const sinew_attachment_id attachment = (bad_attachments)[i_];      \
            REFUSED_WITH(BAD_ID_STATUS(i_), "attachment", call, bad_id_names[i_]); \
        }                                                                      \
    } while (0)

/* Sizes that no header ever gave the struct; the call may use `size`. */
#define REFUSES_EACH(sizes, count, set, call)                                  \
    do {                                                                       \
        size_t i_;                                                             \
        for (i_ = 0; i_ < (count); i_++) {                                     \
            const size_t size = (sizes)[i_];                                   \
            set;                                                               \
            REFUSED_WITH(INVALID, "struct_size", call, "a size it never had"); \
        }                                                                      \
    } while (0)
#define REFUSES_SIZES(type, oldest, set, call)                                 \
    do {                                                                       \
        const size_t sizes_[] = {0, 1, sizeof(size_t), (oldest) - 4, (oldest) - 1, sizeof(type) + 1, sizeof(type) + 8, SIZE_MAX}; \
        REFUSES_EACH(sizes_, sizeof sizes_ / sizeof sizes_[0], set, call);     \
    } while (0)
/* `result` is the output whose struct_size it is. */
#define REFUSES_RESULT_SIZES(type, oldest, result, call)                       \
    do {                                                                       \
        const size_t sizes_[] = {0, 1, sizeof(size_t), (oldest) - 4, (oldest) - 1, sizeof(type) + 1, sizeof(type) + 8, SIZE_MAX}; \
        REFUSES_EACH(sizes_, sizeof sizes_ / sizeof sizes_[0],                 \
                     out.result.struct_size = untouched.result.struct_size = size, call); \
        out.result.struct_size = untouched.result.struct_size = sizeof(type);  \
    } while (0)

/* A copy of the array with one value replaced, until the next call. */
static inline const float *spoiled(const float *array, size_t count, size_t at, float value)
{
    static float copy[32];
    memcpy(copy, array, count * sizeof *array);
    copy[at] = value;
    return copy;
}

static inline const uint32_t *renumbered(const uint32_t *array, size_t count, size_t at, uint32_t value)
{
    static uint32_t copy[32];
    memcpy(copy, array, count * sizeof *array);
    copy[at] = value;
    return copy;
}

static inline sinew_body_id a_cloth(void)
{
    static const float positions[] = {0, 0, 0, 1, 0, 0, 2, 0, 0, 0, 0, 1, 1, 0, 1, 2, 0, 1, 0, 0, 2, 1, 0, 2, 2, 0, 2};
    static const float masses[] = {0.1f, 0.1f, 0, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f};
    static const uint32_t triangles[] = {0, 3, 1, 1, 3, 4, 1, 4, 2, 2, 4, 5, 3, 6, 4, 4, 6, 7, 4, 7, 5, 5, 7, 8};
    sinew_body_def def;
    sinew_body_id body = {0, 0};
    MUST(sinew_body_def_init(&def, sizeof def));
    def.positions = positions;
    def.node_count = 9;
    def.masses = masses;
    def.stiffness = 20.0f;
    def.triangles = triangles;
    def.triangle_count = 8;
    MUST(sinew_body_create(the.world, &def, &body));
    MUST(sinew_body_pin(the.world, body, 0));
    return body;
}

static inline sinew_tool_id a_sphere(void)
{
    sinew_tool_def def;
    sinew_tool_id tool = {0, 0};
    MUST(sinew_tool_def_init(&def, sizeof def));
    def.shape = SINEW_SHAPE_SPHERE;
    def.radius = 0.25f;
    def.position[1] = 3.0f;
    MUST(sinew_tool_create(the.world, &def, &tool));
    return tool;
}

/* The ids that name nothing here, in the order of bad_id_names. The last is what the next world would give. */
#define FILL_BAD_IDS(ids, replaced, destroyed, alive)                          \
    do {                                                                       \
        memset(&(ids)[0], 0, sizeof (ids)[0]);                                 \
        (ids)[1] = (replaced);                                                 \
        (ids)[2] = (destroyed);                                                \
        (ids)[3] = (ids)[5] = (ids)[6] = (alive);                              \
        (ids)[3].index1 = 1000;                                                \
        memset(&(ids)[4], 0xFF, sizeof (ids)[4]);                              \
        (ids)[5].generation++;                                                 \
        (ids)[6].generation += 1u << 20;                                       \
    } while (0)

static inline void set_up(void)
{
    static const float force[3] = {0.5f, 0, 0}, place[3] = {0, 2.5f, 0};
    sinew_world_def def;
    sinew_body_id old_body, gone_body;
    sinew_tool_id old_tool, gone_tool;
    int frame;

    MUST(sinew_world_def_init(&def, sizeof def));
    MUST(sinew_world_create(&def, &the.world));

    old_body = a_cloth();
    MUST(sinew_body_destroy(the.world, old_body));
    the.body = a_cloth();
    gone_body = a_cloth();
    MUST(sinew_body_destroy(the.world, gone_body));
    FILL_BAD_IDS(the.bad_bodies, old_body, gone_body, the.body);

    old_tool = a_sphere();
    MUST(sinew_tool_destroy(the.world, old_tool));
    the.tool = a_sphere();
    gone_tool = a_sphere();
    MUST(sinew_tool_destroy(the.world, gone_tool));
    FILL_BAD_IDS(the.bad_tools, old_tool, gone_tool, the.tool);

    for (frame = 0; frame < 3; frame++)
        MUST(sinew_world_step(the.world, 0.01f, NULL));
    MUST(sinew_body_apply_force(the.world, the.body, 8, force));
    MUST(sinew_tool_set_pose(the.world, the.tool, place, NULL));
    MUST(sinew_world_get_state_hash(the.world, &the.hash));

    memset(&untouched, 0xA5, sizeof untouched);
    untouched.step.struct_size = sizeof untouched.step;
    untouched.energy.struct_size = sizeof untouched.energy;
    untouched.rest.struct_size = sizeof untouched.rest;
    untouched.preset.struct_size = sizeof untouched.preset;
    untouched.suture.struct_size = sizeof untouched.suture;
    untouched.storage.struct_size = sizeof untouched.storage;
    untouched.solver.struct_size = sizeof untouched.solver;
    untouched.enclosed.struct_size = sizeof untouched.enclosed;
    untouched.mesh_view.struct_size = sizeof untouched.mesh_view;
    untouched.surface_point.struct_size = sizeof untouched.surface_point;
    memcpy(&out, &untouched, sizeof out);
}

static inline int tear_down(void)
{
    sinew_world_destroy(the.world);
    printf("%d refusals: ", the.refusals);
    return checked("each with its status and its message, nothing written, nothing changed");
}

#endif
