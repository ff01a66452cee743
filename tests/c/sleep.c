/* A body that sleeps: what its definition may say, how much of it is awake, what wakes it. */
#include "scene.h"

static float awake(const sinew_world *world, sinew_body_id body)
{
    float share = -1.0f;
    MUST(sinew_body_get_awake_share(world, body, &share));
    return share;
}

static void refused(sinew_status status, const char *word)
{
    char message[256];
    sinew_last_error(message, sizeof message);
    CHECK(status == SINEW_STATUS_INVALID_ARGUMENT);
    CHECK(strstr(message, word) != NULL);
}

int main(void)
{
    static const uint32_t springs[] = {0, 1, 1, 2};
    static const float places[] = {0, 0, 0, 0.01f, 0, 0, 0.02f, 0, 0}, push[3] = {0, -0.01f, 0};
    sinew_world *world = a_world(-10.0f);
    const sinew_body_id other = a_cloth(world, SOFT);
    sinew_body_def def;
    sinew_body_id body = {0, 0};
    sinew_step_report report;
    uint64_t hash;

    MUST(sinew_body_def_init(&def, sizeof def));
    CHECK(def.sleep_speed == 0.0f && def.sleep_time == 0.5f);
    def.positions = places;
    def.node_count = 3;
    def.springs = springs;
    def.spring_count = 2;
    def.node_mass = 1e-3f;
    def.node_damping = 0.02f;
    def.stiffness = SOFT;
    def.sleep_speed = -1.0f;
    refused(sinew_body_create(world, &def, &body), "sleep_speed is -1");
    def.sleep_speed = NAN;
    refused(sinew_body_create(world, &def, &body), "sleep_speed");
    def.sleep_speed = 1e-3f;
    def.sleep_time = 0.0f;
    refused(sinew_body_create(world, &def, &body), "sleep_time is 0");
    def.sleep_time = INFINITY;
    refused(sinew_body_create(world, &def, &body), "sleep_time is inf");
    def.sleep_time = 0.1f;
    MUST(sinew_body_create(world, &def, &body));
    MUST(sinew_body_pin(world, body, 0));
    MUST(sinew_body_pin(world, body, 2));
    MUST(sinew_body_destroy(world, other));

    CHECK(awake(world, body) == 1.0f);
    steps(world, 0.01f, 300);
    CHECK(awake(world, body) == 0.0f);
    hash = hash_of(world);
    report.struct_size = sizeof report;
    MUST(sinew_world_step(world, 0.01f, &report));
    CHECK(report.substeps == 0);
    CHECK(hash_of(world) == hash);
    /* It hangs as deep as a spring of 2 k is drawn out by its own weight, about: as a string does. */
    CHECK(position(world, body, 1, 1) < -1e-4f);

    MUST(sinew_body_apply_force(world, body, 1, push));
    CHECK(awake(world, body) == 1.0f);
    steps(world, 0.01f, 300);
    CHECK(awake(world, body) == 0.0f);
    MUST(sinew_body_wake(world, body));
    CHECK(awake(world, body) == 1.0f);

    refused(sinew_body_get_awake_share(world, body, NULL), "out is NULL");
    CHECK(sinew_body_wake(world, other) == SINEW_STATUS_STALE_ID);
    CHECK(sinew_body_wake(NULL, body) == SINEW_STATUS_INVALID_ARGUMENT);
    sinew_world_destroy(world);
    return checked("a body that rests is left alone until something reaches it");
}
