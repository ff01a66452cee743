/* A walk through what moves: views, forces, pins, springs, energy, and a step that cannot be taken. */
#include "scene.h"

static void views_are_in_the_callers_order(void)
{
    /* Scattered, so that any reordering inside would show. */
    float positions[3 * 64];
    sinew_world *world = a_world(0.0f);
    sinew_body_def def;
    sinew_body_id body;
    sinew_vec3_view view;
    uint32_t springs[2 * 63], i;
    for (i = 0; i < 64; i++) {
        positions[3 * i] = (float)(i * 37 % 64);
        positions[3 * i + 1] = (float)(i * 11 % 64) - 20.0f;
        positions[3 * i + 2] = (float)(i * 53 % 64) + 5.0f;
    }
    for (i = 0; i < 63; i++) {
        springs[2 * i] = 63 - i;
        springs[2 * i + 1] = i * 29 % (63 - i);
    }
    MUST(sinew_body_def_init(&def, sizeof def));
    def.positions = positions;
    def.node_count = 64;
    def.node_mass = 1.0f;
    def.springs = springs;
    def.spring_count = 63;
    def.stiffness = 10.0f;
    MUST(sinew_body_create(world, &def, &body));
    for (i = 0; i < 2; i++) {
        size_t node;
        MUST(sinew_body_get_positions(world, body, &view));
        CHECK(view.count == 64 && view.stride >= sizeof(float[3]));
        for (node = 0; node < 64; node++) {
            CHECK_NEAR(node_of(view, node)[0], positions[3 * node], 1e-5);
            CHECK_NEAR(node_of(view, node)[1], positions[3 * node + 1], 1e-5);
            CHECK_NEAR(node_of(view, node)[2], positions[3 * node + 2], 1e-5);
        }
        steps(world, 0.01f, 1); /* at rest: still there after a step */
    }
    MUST(sinew_body_get_velocities(world, body, &view));
    CHECK(view.count == 64 && view.stride >= sizeof(float[3]));
    sinew_world_destroy(world);
}

static void a_fall_is_exact(void)
{
    sinew_world *world = a_world(-10.0f);
    const sinew_body_id body = loose_nodes(world, 2);
    sinew_energy energy;
    energy.struct_size = sizeof energy;
    steps(world, 0.01f, 50);
    CHECK_NEAR(position(world, body, 1, 1), -10.0 * 0.5 * 0.5 / 2, 1e-4);
    CHECK_NEAR(velocity(world, body, 1, 1), -10.0 * 0.5, 1e-4);
    CHECK_NEAR(position(world, body, 1, 0), 1.0, 1e-6);
    MUST(sinew_body_get_energy(world, body, &energy));
    CHECK_NEAR(energy.kinetic, 2 * 0.5 * 0.5 * 25.0, 1e-3);
    CHECK_NEAR(energy.gravitational, -2 * 0.5 * 10.0 * 1.25, 1e-3);
    CHECK(energy.elastic == 0.0);
    sinew_world_destroy(world);
}

/* Without damping, a force F over a step of h gives F h / m, and F h^2 / 2 m of way. */
static void a_force_lasts_one_step(void)
{
    const float force[3] = {0, 2, 0}, both[6] = {0, 1, 0, 0, 0, 3};
    const uint32_t nodes[2] = {1, 0};
    sinew_world *world = a_world(0.0f);
    const sinew_body_id body = loose_nodes(world, 3);
    const double h = 0.01, gained = 2 * h / 0.5;
    MUST(sinew_body_apply_force(world, body, 2, force));
    CHECK(velocity(world, body, 2, 1) == 0.0f);
    steps(world, 0.01f, 1);
    CHECK_NEAR(velocity(world, body, 2, 1), gained, 1e-6);
    CHECK_NEAR(position(world, body, 2, 1), gained * h / 2, 1e-7);
    steps(world, 0.01f, 1);
    CHECK_NEAR(velocity(world, body, 2, 1), gained, 1e-6);
    CHECK_NEAR(position(world, body, 2, 1), gained * h * 1.5, 1e-7);

    /* Forces on one node add up, whoever brings them; none is taken for another node's. */
    MUST(sinew_body_apply_force(world, body, 1, force));
    MUST(sinew_body_apply_forces(world, body, nodes, both, 2));
    MUST(sinew_body_apply_forces(world, body, NULL, NULL, 0));
    steps(world, 0.01f, 1);
    CHECK_NEAR(velocity(world, body, 1, 1), 3 * h / 0.5, 1e-6);
    CHECK_NEAR(velocity(world, body, 0, 2), 3 * h / 0.5, 1e-6);
    CHECK(velocity(world, body, 0, 1) == 0.0f);
    sinew_world_destroy(world);
}

static void a_pin_holds_moves_and_lets_go(void)
{
    const float there[3] = {1, 2, 3}, pull[3] = {5, 0, 0};
    sinew_world *world = a_world(-10.0f);
    const sinew_body_id body = loose_nodes(world, 2);
    float force[3];
    int axis;
    MUST(sinew_body_pin(world, body, 1));
    MUST(sinew_body_apply_force(world, body, 1, pull));
    steps(world, 0.01f, 3);
    CHECK(position(world, body, 1, 0) == 1.0f && position(world, body, 1, 1) == 0.0f);
    CHECK(position(world, body, 0, 1) < 0.0f);

    MUST(sinew_body_move_pin(world, body, 1, there));
    CHECK(position(world, body, 1, 1) == 0.0f);
    steps(world, 0.01f, 1);
    for (axis = 0; axis < 3; axis++)
        CHECK_NEAR(position(world, body, 1, axis), there[axis], 1e-6);
    steps(world, 0.01f, 1);
    for (axis = 0; axis < 3; axis++)
        CHECK_NEAR(position(world, body, 1, axis), there[axis], 1e-6);
    MUST(sinew_body_get_pin_force(world, body, 1, force));
    CHECK_NEAR(force[1], 0.5 * 10, 1e-4);

    MUST(sinew_body_unpin(world, body, 1));
    steps(world, 0.01f, 1);
    CHECK_NEAR(velocity(world, body, 1, 1), -10 * 0.01, 1e-5);
    sinew_world_destroy(world);
}

/* Two masses hang from a node without mass: what holds it is their weight, and it can never be let go. */
static void a_pin_carries_what_hangs_from_it(void)
{
    const float positions[] = {0, 0, 0, 0, -1, 0, 0, -2, 0}, masses[] = {0, 0.3f, 0.2f};
    const uint32_t springs[] = {0, 1, 1, 2};
    sinew_world *world = a_world(-10.0f);
    sinew_body_def def;
    sinew_body_id body;
    sinew_energy energy;
    float force[3];
    MUST(sinew_body_def_init(&def, sizeof def));
    def.positions = positions;
    def.node_count = 3;
    def.masses = masses;
    def.node_damping = 1.0f;
    def.springs = springs;
    def.spring_count = 2;
    def.stiffness = 100.0f;
    MUST(sinew_body_create(world, &def, &body));
    steps(world, 0.01f, 2000);
    MUST(sinew_body_get_pin_force(world, body, 0, force));
    CHECK_NEAR(force[0], 0.0, 1e-5);
    CHECK_NEAR(force[1], 0.5 * 10, 1e-3);
    CHECK_NEAR(force[2], 0.0, 1e-5);
    CHECK(position(world, body, 0, 1) == 0.0f);
    CHECK_NEAR(position(world, body, 1, 1), -1.0 - 5.0 / 100, 1e-4);
    CHECK_NEAR(position(world, body, 2, 1), -2.0 - 5.0 / 100 - 2.0 / 100, 1e-4);
    energy.struct_size = sizeof energy;
    MUST(sinew_body_get_energy(world, body, &energy));
    CHECK_NEAR(energy.elastic, 0.5 * 100 * (0.05 * 0.05 + 0.02 * 0.02), 1e-4);
    CHECK_NEAR(energy.gravitational, -10 * (0.3 * 1.05 + 0.2 * 2.07), 1e-3);
    CHECK_NEAR(energy.kinetic, 0.0, 1e-6);
    sinew_world_destroy(world);
}

static void springs_come_and_go(void)
{
    sinew_world *world = a_world(0.0f);
    const sinew_body_id body = loose_nodes(world, 4);
    sinew_storage_report none, two, one;
    none.struct_size = two.struct_size = one.struct_size = sizeof none;
    MUST(sinew_body_get_storage_report(world, body, &none));
    CHECK(none.node_count == 4 && none.spring_count == 0);

    MUST(sinew_body_add_spring(world, body, 0, 1, 100.0f, -1.0f)); /* as long as it is: no force */
    MUST(sinew_body_add_spring(world, body, 3, 2, 100.0f, 0.5f));
    MUST(sinew_body_get_storage_report(world, body, &two));
    CHECK(two.spring_count == 2 && two.bytes_used > none.bytes_used && two.bytes_used <= two.bytes_reserved);
    steps(world, 0.001f, 1);
    CHECK_NEAR(velocity(world, body, 0, 0), 0.0, 1e-6);
    CHECK_NEAR(velocity(world, body, 1, 0), 0.0, 1e-6);
    CHECK_NEAR(velocity(world, body, 2, 0), 100 * 0.5 / 0.5 * 0.001, 1e-4);
    CHECK_NEAR(velocity(world, body, 3, 0), -100 * 0.5 / 0.5 * 0.001, 1e-4);

    MUST(sinew_body_remove_spring(world, body, 2, 3));
    MUST(sinew_body_get_storage_report(world, body, &one));
    CHECK(one.spring_count == 1 && one.bytes_used < two.bytes_used);
    {
        const float speed = velocity(world, body, 2, 0);
        steps(world, 0.001f, 5);
        CHECK(velocity(world, body, 2, 0) == speed);
    }
    MUST(sinew_body_add_spring(world, body, 2, 3, 100.0f, 0.5f)); /* the pair is free again */
    sinew_world_destroy(world);
}

static void full_rows_refuse(void)
{
    static const float positions[] = {0, 0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0};
    static const uint32_t springs[] = {0, 1, 1, 2};
    sinew_world *world = a_world(0.0f);
    sinew_storage_report before, after;
    sinew_body_def def;
    sinew_body_id body;
    uint64_t hash;
    MUST(sinew_body_def_init(&def, sizeof def));
    def.positions = positions;
    def.node_count = 4;
    def.node_mass = 0.5f;
    def.stiffness = 100.0f;
    def.springs = springs;
    def.spring_count = 2;
    def.storage = SINEW_STORAGE_FAST_LINK;
    def.springs_per_node = 2;
    MUST(sinew_body_create(world, &def, &body));
    hash = hash_of(world);
    before.struct_size = after.struct_size = sizeof before;
    MUST(sinew_body_get_storage_report(world, body, &before));
    CHECK(before.bytes_used == 2 * 2 * 12 && before.bytes_reserved == 4 * 2 * 12);
    CHECK(sinew_body_add_spring(world, body, 1, 3, 100.0f, 1.0f) == SINEW_STATUS_CAPACITY);
    CHECK(sinew_body_add_spring(world, body, 3, 1, 100.0f, 1.0f) == SINEW_STATUS_CAPACITY);
    MUST(sinew_body_get_storage_report(world, body, &after));
    CHECK(memcmp(&before, &after, sizeof before) == 0);
    CHECK(hash_of(world) == hash);
    MUST(sinew_body_remove_spring(world, body, 0, 1));
    MUST(sinew_body_add_spring(world, body, 3, 1, 100.0f, 1.0f)); /* the place is free again */
    steps(world, 0.001f, 1);
    CHECK(velocity(world, body, 3, 0) < 0.0f && velocity(world, body, 0, 0) == 0.0f);
    sinew_world_destroy(world);
}

static void positions_and_velocities_are_set_apart(void)
{
    const float places[] = {0, 5, 0, 1, 6, 0}, speeds[] = {1, 0, 0, 0, 2, 0};
    sinew_world *world = a_world(0.0f);
    const sinew_body_id body = loose_nodes(world, 2);
    MUST(sinew_body_pin(world, body, 0));
    MUST(sinew_body_set_velocities(world, body, speeds, 2));
    MUST(sinew_body_set_positions(world, body, places, 2));
    CHECK_NEAR(position(world, body, 0, 1), 5.0, 1e-6); /* pinned nodes move too */
    CHECK_NEAR(position(world, body, 1, 1), 6.0, 1e-6);
    CHECK(velocity(world, body, 1, 1) == 2.0f);
    steps(world, 0.1f, 1);
    CHECK_NEAR(position(world, body, 0, 0), 0.0, 1e-6);
    CHECK_NEAR(position(world, body, 0, 1), 5.0, 1e-6); /* and stay where they were put */
    CHECK_NEAR(position(world, body, 1, 1), 6.2, 1e-5);
    MUST(sinew_body_set_velocities(world, body, speeds, 2));
    CHECK_NEAR(position(world, body, 1, 1), 6.2, 1e-5);
    sinew_world_destroy(world);
}

/* One substep allowed and a spring too stiff for it: refused, nothing moved, the force still waits. */
static void a_step_that_cannot_be_taken(void)
{
    const float pull[3] = {0, 1, 0};
    sinew_world_def def;
    sinew_world *world;
    sinew_body_id body;
    sinew_step_report report;
    uint64_t before;
    MUST(sinew_world_def_init(&def, sizeof def));
    def.gravity[1] = 0.0f;
    def.max_substeps = 1;
    MUST(sinew_world_create(&def, &world));
    body = loose_nodes(world, 2);
    MUST(sinew_body_add_spring(world, body, 0, 1, 1e5f, -1.0f)); /* omega 632 /s: 3.2 ms at most */
    MUST(sinew_body_apply_force(world, body, 1, pull));
    before = hash_of(world);
    memset(&report, 0, sizeof report);
    report.struct_size = sizeof report;
    CHECK(sinew_world_step(world, 0.1f, &report) == SINEW_STATUS_UNSTABLE);
    CHECK(report.stable_substep > 0.0f && report.stable_substep < 3.2e-3f);
    CHECK(hash_of(world) == before);
    CHECK(position(world, body, 1, 1) == 0.0f);
    CHECK(sinew_world_step(world, 0.1f, NULL) == SINEW_STATUS_UNSTABLE);
    report.struct_size = sizeof report;
    MUST(sinew_world_step(world, 1e-4f, &report));
    CHECK(report.substeps == 1);
    CHECK_NEAR(velocity(world, body, 1, 1), 1 / 0.5 * 1e-4, 1e-7);
    sinew_world_destroy(world);
}

static void the_report_counts_substeps(void)
{
    sinew_world_def def;
    sinew_world *world;
    sinew_body_id body;
    sinew_step_report report;
    MUST(sinew_world_def_init(&def, sizeof def));
    def.substeps = 7;
    MUST(sinew_world_create(&def, &world));
    body = loose_nodes(world, 2);
    report.struct_size = sizeof report;
    MUST(sinew_world_step(world, 0.01f, &report));
    CHECK(report.substeps == 7);
    CHECK(isinf(report.stable_substep) && report.stable_substep > 0); /* no spring, no limit */
    CHECK(report.bodies_restored == 0 && report.error_estimate == 0.0f);
    MUST(sinew_body_destroy(world, body));
    sinew_world_destroy(world);
}

static void worlds_share_nothing(void)
{
    const float pull[3] = {0, 1e-3f, 0};
    sinew_world *one = a_world(-9.81f), *two = a_world(-9.81f);
    const sinew_body_id a = a_cloth(one, SOFT), b = a_cloth(two, SOFT);
    const uint64_t start = hash_of(two);
    CHECK(hash_of(one) == start);
    MUST(sinew_body_apply_force(one, a, 7, pull));
    steps(one, 0.01f, 10);
    CHECK(hash_of(two) == start && hash_of(one) != start);
    MUST(sinew_body_apply_force(two, b, 7, pull));
    steps(two, 0.01f, 10);
    CHECK(hash_of(two) == hash_of(one)); /* bit for bit the same motion */
    sinew_world_destroy(one);
    steps(two, 0.01f, 1);
    sinew_world_destroy(two);
}

int main(void)
{
    views_are_in_the_callers_order();
    a_fall_is_exact();
    a_force_lasts_one_step();
    a_pin_holds_moves_and_lets_go();
    a_pin_carries_what_hangs_from_it();
    springs_come_and_go();
    full_rows_refuse();
    positions_and_velocities_are_set_apart();
    a_step_that_cannot_be_taken();
    the_report_counts_substeps();
    worlds_share_nothing();
    return checked("bodies move as the contract says");
}
