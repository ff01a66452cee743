/* Settings that change after creation, the solver that was chosen, and steps of bounded work: what they do, and what they refuse. */
#include "scene.h"

#define REFUSED(expected, word, call)                                          \
    do {                                                                       \
        char message_[512] = "";                                               \
        const sinew_status status_ = (call);                                   \
        sinew_last_error(message_, sizeof message_);                           \
        CHECK(status_ == SINEW_STATUS_##expected);                             \
        if (strstr(message_, word) == NULL) {                                  \
            failures++;                                                        \
            fprintf(stderr, "%s:%d: \"%s\" does not name %s\n", __FILE__, __LINE__, message_, word); \
        }                                                                      \
    } while (0)

static void settings_are_read_back(void)
{
    sinew_world *world = a_world(-10);
    const sinew_body_id body = a_cloth(world, SOFT), none = {0, 0};
    const uint64_t before = hash_of(world);
    sinew_body_settings settings, bad;
    uint32_t first = 9, second = 9;
    float value = -1;

    settings.struct_size = sizeof settings;
    MUST(sinew_body_get_settings(world, body, &settings));
    CHECK(settings.contact_thickness == 0 && settings.contact_friction == 0 && settings.meets_bodies == 0);
    CHECK(settings.meets_itself == 0 && settings.sleep_speed == 0 && settings.sleep_time == 0.5f);
#define BAD(field, given, word)                                                \
    bad = settings;                                                            \
    bad.field = (given);                                                       \
    REFUSED(INVALID_ARGUMENT, word, sinew_body_set_settings(world, body, &bad))
    BAD(contact_thickness, -1, "contact_thickness is -1");
    BAD(contact_friction, NAN, "contact_friction");
    BAD(meets_bodies, 2, "meets_bodies is 2");
    BAD(meets_itself, 3, "meets_itself is 3");
    BAD(sleep_speed, -1, "sleep_speed is -1");
    BAD(sleep_time, 0, "sleep_time is 0");
    REFUSED(INVALID_ARGUMENT, "max_substeps is 0", sinew_world_set_substeps(world, 0, 0));
    REFUSED(INVALID_ARGUMENT, "node_damping is -1", sinew_body_set_node_damping(world, body, -1));
    REFUSED(INVALID_ARGUMENT, "node", sinew_body_get_node_damping(world, body, CLOTH_NODES, &value));
    REFUSED(INVALID_ARGUMENT, "world", sinew_world_set_substeps(NULL, 0, 1));
    REFUSED(INVALID_ARGUMENT, "world", sinew_world_get_substeps(NULL, &first, &second));
    REFUSED(INVALID_ARGUMENT, "settings", sinew_body_set_settings(world, body, NULL));
    REFUSED(INVALID_ARGUMENT, "out", sinew_body_get_settings(world, body, NULL));
    REFUSED(INVALID_ARGUMENT, "out", sinew_body_get_node_damping(world, body, 0, NULL));
    REFUSED(STALE_ID, "body", sinew_body_set_settings(world, none, &settings));
    REFUSED(STALE_ID, "body", sinew_body_get_settings(world, none, &settings));
    REFUSED(STALE_ID, "body", sinew_body_set_node_damping(world, none, 1));
    REFUSED(STALE_ID, "body", sinew_body_get_node_damping(world, none, 0, &value));
    CHECK(hash_of(world) == before && first == 9 && second == 9 && value == -1);

    MUST(sinew_world_set_substeps(world, 50, 60));
    MUST(sinew_world_get_substeps(world, &first, &second));
    CHECK(first == 50 && second == 60);
    MUST(sinew_world_get_substeps(world, NULL, NULL));
    MUST(sinew_world_set_substeps(world, 0, 1000));
    settings.contact_thickness = 0.002f;
    settings.contact_friction = 0.3f;
    settings.meets_bodies = settings.meets_itself = 1;
    settings.sleep_speed = 0.01f;
    settings.sleep_time = 0.25f;
    MUST(sinew_body_set_settings(world, body, &settings));
    memset(&bad, 0, sizeof bad);
    bad.struct_size = sizeof bad;
    MUST(sinew_body_get_settings(world, body, &bad));
    CHECK(memcmp(&bad, &settings, sizeof bad) == 0);
    MUST(sinew_body_set_node_damping(world, body, 0.05f));
    MUST(sinew_body_get_node_damping(world, body, 7, &value));
    CHECK_NEAR(value, 0.05, 1e-7);
    steps(world, 0.01f, 10);
    sinew_world_destroy(world);
}

static void the_solver_is_chosen(void)
{
    sinew_world *world = a_world(-10);
    sinew_body_def def;
    sinew_solver_report choice;
    sinew_step_report report;
    const sinew_body_id soft = a_cloth(world, SOFT), stiff = a_cloth(world, 1e6f);
    choice.struct_size = sizeof choice;
    report.struct_size = sizeof report;
    MUST(sinew_body_def_init(&def, sizeof def));
    CHECK(def.solver == SINEW_SOLVER_AUTO);
    MUST(sinew_body_get_solver_report(world, soft, &choice));
    CHECK(choice.solver == SINEW_SOLVER_VERLET && choice.auto_substeps > 0 && choice.auto_substeps <= 150);
    CHECK(choice.auto_step == 1.0f / 60);
    MUST(sinew_body_get_solver_report(world, stiff, &choice));
    CHECK(choice.solver == SINEW_SOLVER_IMPLICIT && choice.auto_substeps > 150);
    MUST(sinew_world_step(world, 1.0f / 60, &report));
    CHECK(report.limit == SINEW_LIMIT_NONE && report.limit_body.index1 == 0);
    CHECK(report.substeps_body.index1 == soft.index1 && report.restored_body.index1 == 0);
    /* A step that is too long names the body, what limits it and what helps. */
    MUST(sinew_world_set_substeps(world, 0, 1));
    REFUSED(UNSTABLE, "limited by the springs", sinew_world_step(world, 0.1f, &report));
    CHECK(report.limit == SINEW_LIMIT_SPRING && report.limit_body.index1 == soft.index1);
    CHECK(report.limit_nodes[0] != report.limit_nodes[1] && report.limit_substeps > 1);
    sinew_world_destroy(world);
}

static void work_is_bounded(void)
{
    sinew_world *world = a_world(-10);
    sinew_step_report report;
    uint64_t before;
    a_cloth(world, 5000);
    report.struct_size = sizeof report;
    before = hash_of(world);
    REFUSED(INVALID_ARGUMENT, "work is 0", sinew_world_step_with_budget(world, 0.1f, 0, NULL));
    REFUSED(INVALID_ARGUMENT, "dt is 0", sinew_world_step_with_budget(world, 0, 1, NULL));
    REFUSED(INVALID_ARGUMENT, "seconds is -1", sinew_world_step_within(world, 0.1f, -1, NULL));
    REFUSED(INVALID_ARGUMENT, "dt", sinew_world_step_within(world, NAN, 1, NULL));
    REFUSED(INVALID_ARGUMENT, "world", sinew_world_step_with_budget(NULL, 0.1f, 1, NULL));
    REFUSED(INVALID_ARGUMENT, "world", sinew_world_step_within(NULL, 0.1f, 1, NULL));
    REFUSED(INVALID_ARGUMENT, "world", sinew_world_drop_lag(NULL));
    MUST(sinew_world_set_substeps(world, 9, 9));
    REFUSED(UNSUPPORTED, "fixed substeps", sinew_world_step_with_budget(world, 0.1f, 1, NULL));
    MUST(sinew_world_set_substeps(world, 0, 1000));
    CHECK(hash_of(world) == before);

    MUST(sinew_world_step_with_budget(world, 0.1f, 3, &report));
    CHECK(report.work == 3 && report.work_done <= 3 && report.substeps <= 3 && report.lag > 0 && report.lag < 0.1);
    MUST(sinew_world_step_within(world, 0.01f, 0.001, &report));
    CHECK(report.work > 0 && report.work_done <= report.work);
    MUST(sinew_world_step_with_budget(world, 0.01f, 1000000, &report));
    CHECK(report.lag == 0);
    MUST(sinew_world_step(world, 0.01f, &report));
    CHECK(report.work == 0 && report.work_done == 0 && report.lag == 0);
    sinew_world_destroy(world);
}

int main(void)
{
    settings_are_read_back();
    the_solver_is_chosen();
    work_is_bounded();
    return checked("settings, the choice of a solver, and bounded work");
}
