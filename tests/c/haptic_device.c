/* A device's driver beside a handle, as docs/guide/haptics.md shows it: a hand presses a cloth until both are at rest, and feels what it presses with. */
#include "scene.h"

enum { TICKS = 1500, TICKS_A_STEP = 16 };

static const double push = 0.2, mass = 0.05, calm = 2; /* N downwards, kg, N s/m */

/* In place of a device, and of the thread that steps the world. */
static struct {
    sinew_world *world;
    int ticks;
    double place, speed;
    float force[3], torque[3];
} hand;

static int driver_wait(void)
{
    if (hand.ticks % TICKS_A_STEP == 0)
        steps(hand.world, 0.016f, 1);
    return hand.ticks++ < TICKS;
}

static void driver_read(float position[3], float orientation[4], float velocity[3], float spin[3])
{
    static const float still[4] = {0, 0, 0, 1};
    memcpy(orientation, still, sizeof still);
    memcpy(position, still, 3 * sizeof *position);
    memcpy(velocity, still, 3 * sizeof *velocity);
    memcpy(spin, still, 3 * sizeof *spin);
    position[1] = (float)hand.place;
    velocity[1] = (float)hand.speed;
    if (hand.ticks == TICKS / 2)
        position[0] = NAN; /* a cable is loose: refused */
}

static void driver_write(const float force[3], const float torque[3])
{
    if (hand.ticks == TICKS / 2)
        CHECK(force[0] == 0.0f && force[1] == 0.0f && force[2] == 0.0f);
    memcpy(hand.force, force, sizeof hand.force);
    memcpy(hand.torque, torque, sizeof hand.torque);
    hand.speed += (force[1] - push - calm * hand.speed) / mass * 1e-3;
    hand.place += hand.speed * 1e-3;
}

static void feel(sinew_haptic *haptic) /* the device's thread */
{
    static const float nothing[3] = {0, 0, 0};
    float position[3], orientation[4], velocity[3], spin[3];
    sinew_haptic_report felt;
    felt.struct_size = sizeof felt;
    while (driver_wait()) { /* yours: until the next millisecond; 0: the device is disconnected */
        driver_read(position, orientation, velocity, spin); /* yours: m, x y z w, m/s, rad/s, in the world's axes */
        if (sinew_haptic_tick(haptic, position, orientation, velocity, spin, 1e-3f, &felt) == SINEW_STATUS_OK)
            driver_write(felt.force, felt.torque); /* yours: N, N m */
        else
            driver_write(nothing, nothing);
    }
}

int main(void)
{
    sinew_tool_def tool;
    sinew_haptic_def def;
    sinew_haptic *haptic;
    sinew_body_id cloth;
    uint32_t node;
    float pressed[3], turned[3];
    hand.world = a_world(0.0f);
    cloth = a_cloth(hand.world, STIFF);
    for (node = 0; node < CLOTH_NODES; node++)
        if (at_the_rim(node))
            MUST(sinew_body_pin(hand.world, cloth, node));
    hand.place = 0.022;
    MUST(sinew_tool_def_init(&tool, sizeof tool));
    tool.shape = SINEW_SHAPE_SPHERE;
    tool.radius = 0.02f;
    tool.position[1] = (float)hand.place;
    MUST(sinew_haptic_def_init(&def, sizeof def));
    MUST(sinew_tool_create(hand.world, &tool, &def.tool));
    MUST(sinew_haptic_create(hand.world, &def, &haptic));
    feel(haptic);
    CHECK(hand.place < 0.02 && hand.place > -0.02);
    CHECK(fabs(hand.speed) < 1e-3);
    CHECK_NEAR(hand.force[1], push, 0.01 * push);
    CHECK_NEAR(hand.force[0], 0.0, 0.01 * push);
    CHECK_NEAR(hand.force[2], 0.0, 0.01 * push);
    MUST(sinew_tool_get_wrench(hand.world, def.tool, pressed, turned));
    CHECK_NEAR(pressed[1], push, 0.01 * push);
    sinew_haptic_destroy(haptic);
    sinew_world_destroy(hand.world);
    return checked("a hand that presses a cloth feels what it presses with");
}
