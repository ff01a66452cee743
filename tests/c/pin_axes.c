/* Nodes held along some axes: where they are led and how they fall, what holds them, what is refused. */
#include "scene.h"

static void a_node_on_a_rail_falls_along_it(void)
{
    sinew_world *world = a_world(-10.0f);
    const sinew_body_id body = loose_nodes(world, 2);
    const float up_and_away[3] = {7, 7, 2}, sideways[6] = {3, 0, 0, 0, 0, 0};
    float force[3];
    MUST(sinew_body_pin_axes(world, body, 0, SINEW_AXIS_X | SINEW_AXIS_Z));
    MUST(sinew_body_set_velocities(world, body, sideways, 2));
    CHECK(velocity(world, body, 0, 0) == 0.0f);
    MUST(sinew_body_pin_axes(world, body, 1, SINEW_AXIS_Y));
    steps(world, 0.01f, 10);
    CHECK_NEAR(position(world, body, 0, 1), -0.5 * 10 * 0.01, 1e-6);
    CHECK(position(world, body, 1, 1) == 0.0f);
    MUST(sinew_body_get_pin_force(world, body, 1, force));
    CHECK_NEAR(force[1], 0.5 * 10, 1e-5);
    CHECK(force[0] == 0.0f && force[2] == 0.0f);
    MUST(sinew_body_get_pin_force(world, body, 0, force));
    CHECK(force[0] == 0.0f && force[1] == 0.0f && force[2] == 0.0f);
    /* Led along z alone: x is another pin's, y is free. */
    MUST(sinew_body_pin_axes(world, body, 0, SINEW_AXIS_Z));
    MUST(sinew_body_move_pin(world, body, 0, up_and_away));
    steps(world, 0.1f, 1);
    CHECK(position(world, body, 0, 0) == 0.0f);
    CHECK(position(world, body, 0, 2) == 2.0f);
    CHECK_NEAR(velocity(world, body, 0, 2), 20.0, 1e-5);
    CHECK_NEAR(position(world, body, 0, 1), -0.5 * 10 * 0.04, 1e-6);
    sinew_world_destroy(world);
}

static void all_axes_are_a_pin_and_none_is_none(void)
{
    sinew_world *worlds[2];
    sinew_body_id bodies[2];
    int i;
    for (i = 0; i < 2; i++) {
        worlds[i] = a_world(-10.0f);
        bodies[i] = loose_nodes(worlds[i], 3);
        MUST(sinew_body_pin(worlds[i], bodies[i], 0));
    }
    MUST(sinew_body_pin(worlds[0], bodies[0], 1));
    MUST(sinew_body_pin_axes(worlds[1], bodies[1], 1, SINEW_AXIS_X | SINEW_AXIS_Y | SINEW_AXIS_Z));
    CHECK(hash_of(worlds[0]) == hash_of(worlds[1]));
    MUST(sinew_body_unpin(worlds[0], bodies[0], 1));
    CHECK(hash_of(worlds[0]) != hash_of(worlds[1]));
    MUST(sinew_body_pin_axes(worlds[1], bodies[1], 1, 0));
    CHECK(hash_of(worlds[0]) == hash_of(worlds[1]));
    for (i = 0; i < 2; i++)
        sinew_world_destroy(worlds[i]);
}

static void what_is_no_axis_is_refused(void)
{
    sinew_world *world = a_world(-10.0f);
    const sinew_body_id body = loose_nodes(world, 2);
    const uint64_t before = hash_of(world);
    char message[512];
    CHECK(sinew_body_pin_axes(world, body, 0, 9) == SINEW_STATUS_INVALID_ARGUMENT);
    sinew_last_error(message, sizeof message);
    CHECK(strstr(message, "axes is 9") != NULL);
    CHECK(sinew_body_pin_axes(world, body, 0, 0x80000001u) == SINEW_STATUS_INVALID_ARGUMENT);
    CHECK(sinew_body_pin_axes(world, body, 2, SINEW_AXIS_X) == SINEW_STATUS_INVALID_ARGUMENT);
    CHECK(hash_of(world) == before);
    sinew_world_destroy(world);
}

int main(void)
{
    a_node_on_a_rail_falls_along_it();
    all_axes_are_a_pin_and_none_is_none();
    what_is_no_axis_is_refused();
    return checked("nodes are held along the axes that were named");
}
