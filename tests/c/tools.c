/* Tools: the plane that carries a cloth, the sphere that a cloth carries, and a pose that is reached within the step. */
#include "scene.h"

static const double weight = CLOTH_NODES * 1e-3 * 10;

static sinew_tool_id a_tool(sinew_world *world, uint32_t shape, float y)
{
    sinew_tool_def def;
    sinew_tool_id tool = {0, 0};
    MUST(sinew_tool_def_init(&def, sizeof def));
    def.shape = shape;
    def.radius = def.half_length = shape == SINEW_SHAPE_PLANE ? 0.0f : 0.02f;
    def.position[1] = y;
    MUST(sinew_tool_create(world, &def, &tool));
    return tool;
}

static void wrench_of(const sinew_world *world, sinew_tool_id tool, float force[3], float torque[3])
{
    MUST(sinew_tool_get_wrench(world, tool, force, torque));
    CHECK(isfinite(force[0]) && isfinite(force[1]) && isfinite(force[2]));
    CHECK(isfinite(torque[0]) && isfinite(torque[1]) && isfinite(torque[2]));
}

static void a_plane_carries_the_weight(void)
{
    sinew_world *world = a_world(-10.0f);
    const sinew_body_id cloth = a_cloth(world, SOFT);
    const sinew_tool_id plane = a_tool(world, SINEW_SHAPE_PLANE, -0.005f);
    float force[3], torque[3];
    size_t node;
    wrench_of(world, plane, force, torque);
    CHECK(force[0] == 0.0f && force[1] == 0.0f && force[2] == 0.0f); /* nothing touched it yet */
    steps(world, 0.01f, 100);
    wrench_of(world, plane, force, torque);
    CHECK_NEAR(force[1], -weight, 0.01 * weight);
    CHECK_NEAR(force[0], 0.0, 0.01 * weight);
    CHECK_NEAR(force[2], 0.0, 0.01 * weight);
    for (node = 0; node < CLOTH_NODES; node++)
        CHECK_NEAR(position(world, cloth, node, 1), -0.005, 1e-3);

    MUST(sinew_tool_destroy(world, plane));
    steps(world, 0.01f, 10);
    CHECK(position(world, cloth, CLOTH_NODES / 2, 1) < -0.006f); /* without it, it falls on */
    sinew_world_destroy(world);
}

static void pin_the_rim(sinew_world *world, sinew_body_id cloth)
{
    uint32_t node;
    for (node = 0; node < CLOTH_NODES; node++)
        if (at_the_rim(node))
            MUST(sinew_body_pin(world, cloth, node));
}

/* The sphere's force upwards, the rim's, and the weight add up to nothing. */
static void a_cloth_carries_a_sphere(void)
{
    const float pressed[3] = {0, 0.01f, 0}, away[3] = {0, 0.5f, 0};
    sinew_world *world = a_world(-10.0f);
    const sinew_body_id cloth = a_cloth(world, STIFF);
    const sinew_tool_id sphere = a_tool(world, SINEW_SHAPE_SPHERE, 0.05f);
    const uint32_t centre = CLOTH_NODES / 2;
    float force[3], torque[3], pin[3];
    double rim = 0;
    uint32_t node;
    pin_the_rim(world, cloth);
    steps(world, 0.01f, 20);
    wrench_of(world, sphere, force, torque);
    CHECK(force[1] == 0.0f);

    MUST(sinew_tool_set_pose(world, sphere, pressed, NULL));
    steps(world, 0.01f, 1);
    CHECK(position(world, cloth, centre, 1) < 0.01f - 0.02f + 1e-3f); /* pushed down within that step */
    steps(world, 0.01f, 100);
    wrench_of(world, sphere, force, torque);
    for (node = 0; node < CLOTH_NODES; node++) {
        if (at_the_rim(node)) {
            MUST(sinew_body_get_pin_force(world, cloth, node, pin));
            rim += pin[1];
        } else {
            const double x = position(world, cloth, node, 0), y = position(world, cloth, node, 1) - 0.01,
                         z = position(world, cloth, node, 2);
            CHECK(sqrt(x * x + y * y + z * z) > 0.02 - 1e-3);
        }
    }
    CHECK(force[1] > 0.01f);
    CHECK_NEAR(rim - weight, force[1], 0.02 * force[1]); /* the rim holds cloth and sphere */
    CHECK_NEAR(torque[0], 0.0, 1e-3 * 0.02 * force[1]); /* nothing turns a sphere without friction */
    CHECK_NEAR(torque[1], 0.0, 1e-3 * 0.02 * force[1]);
    CHECK_NEAR(torque[2], 0.0, 1e-3 * 0.02 * force[1]);

    MUST(sinew_tool_set_pose(world, sphere, away, NULL));
    steps(world, 0.01f, 2);
    wrench_of(world, sphere, force, torque);
    CHECK(force[0] == 0.0f && force[1] == 0.0f && force[2] == 0.0f);
    sinew_world_destroy(world);
}

/* A quaternion counts by its direction: a long one lays the capsule down as the unit one does. */
static void orientations_are_normalised(void)
{
    const float place[3] = {0, 0.015f, 0};
    const float unit[4] = {0.70710678f, 0, 0, 0.70710678f}, lengthened[4] = {5, 0, 0, 5}, shortened[4] = {1e-3f, 0, 0, 1e-3f};
    const float *const same[3] = {unit, lengthened, shortened};
    int i;
    for (i = 0; i < 3; i++) {
        sinew_world *world = a_world(0.0f);
        const sinew_body_id cloth = a_cloth(world, STIFF);
        const sinew_tool_id capsule = a_tool(world, SINEW_SHAPE_CAPSULE, 0.1f);
        pin_the_rim(world, cloth);
        MUST(sinew_tool_set_pose(world, capsule, place, same[i]));
        steps(world, 0.01f, 40);
        CHECK_NEAR(position(world, cloth, CLOTH_NODES / 2, 1), -0.005, 1e-3); /* upright it would reach down to -0.025 */
        sinew_world_destroy(world);
    }
}

int main(void)
{
    a_plane_carries_the_weight();
    a_cloth_carries_a_sphere();
    orientations_are_normalised();
    return checked("tools press, carry and are carried");
}
