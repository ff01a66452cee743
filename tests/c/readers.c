/* Everything that takes a const world, from several threads at once: each finds what one thread alone finds. */
#include "scene.h"

#include <pthread.h>

static const sinew_world *the_world;
static sinew_body_id the_cloth;
static sinew_tool_id the_sphere;

enum { THREADS = 4 };

struct findings {
    float sum_of_positions, sum_of_velocities, pin[3], force[3], torque[3];
    double kinetic, elastic, gravitational;
    size_t spring_count;
    uint64_t hash;
};

/* Fills every byte, so that findings can be compared by memcmp. */
static void look(struct findings *found)
{
    sinew_energy energy;
    sinew_storage_report storage;
    size_t node;
    memset(found, 0, sizeof *found);
    energy.struct_size = sizeof energy;
    storage.struct_size = sizeof storage;
    for (node = 0; node < CLOTH_NODES; node++) {
        found->sum_of_positions += position(the_world, the_cloth, node, 1);
        found->sum_of_velocities += velocity(the_world, the_cloth, node, 1);
    }
    MUST(sinew_body_get_pin_force(the_world, the_cloth, 0, found->pin));
    MUST(sinew_tool_get_wrench(the_world, the_sphere, found->force, found->torque));
    MUST(sinew_body_get_energy(the_world, the_cloth, &energy));
    MUST(sinew_body_get_storage_report(the_world, the_cloth, &storage));
    found->kinetic = energy.kinetic;
    found->elastic = energy.elastic;
    found->gravitational = energy.gravitational;
    found->spring_count = storage.spring_count;
    found->hash = hash_of(the_world);
}

static void *look_often(void *expected)
{
    int round, different = 0;
    for (round = 0; round < 50; round++) {
        struct findings found;
        look(&found);
        different += memcmp(&found, expected, sizeof found) != 0;
    }
    return different == 0 ? NULL : expected;
}

int main(void)
{
    const float pressed[3] = {0, 0.01f, 0};
    sinew_world *world = a_world(-10.0f);
    sinew_tool_def def;
    struct findings alone;
    pthread_t threads[THREADS];
    int i, started = 0;
    the_cloth = a_cloth(world, SOFT);
    MUST(sinew_body_pin(world, the_cloth, 0));
    MUST(sinew_tool_def_init(&def, sizeof def));
    def.shape = SINEW_SHAPE_SPHERE;
    def.radius = 0.02f;
    def.position[1] = 0.03f;
    MUST(sinew_tool_create(world, &def, &the_sphere));
    MUST(sinew_tool_set_pose(world, the_sphere, pressed, NULL));
    steps(world, 0.01f, 1);
    the_world = world;

    look(&alone);
    CHECK(alone.sum_of_positions < 0 && alone.force[1] > 0);
    while (started < THREADS && pthread_create(&threads[started], NULL, look_often, &alone) == 0)
        started++;
    CHECK(started == THREADS);
    for (i = 0; i < started; i++) {
        void *differs = NULL;
        CHECK(pthread_join(threads[i], &differs) == 0);
        CHECK(differs == NULL);
    }
    sinew_world_destroy(world);
    return checked("threads that read find the same");
}
