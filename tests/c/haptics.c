/* A haptic handle at the door: what is refused, by name and value, what is left out, which sizes are known, and who may end first. */
#include "check.h"

static const char *message(void)
{
    static char text[512];
    sinew_last_error(text, sizeof text);
    return text;
}

/* The call is refused as it should be, by a message with this in it. */
#define REFUSED(status, part, call)                                            \
    do {                                                                       \
        CHECK((call) == SINEW_STATUS_##status);                                \
        CHECK(strstr(message(), part) != NULL);                                \
    } while (0)

int main(void)
{
    const float here[3] = {0, 0, 0}, far_away[3] = {0, 2e9f, 0}, spin[3] = {0, NAN, 0}, none[4] = {0, 0, 0, 0};
    const float half_turn[4] = {0, 0, 3, 0};
    sinew_world_def world_def;
    sinew_tool_def tool_def;
    sinew_haptic_def def;
    union { sinew_haptic_report now; unsigned char bytes[sizeof(sinew_haptic_report) + 8]; } felt;
    sinew_haptic_contact contacts[1];
    sinew_world *world = NULL;
    sinew_haptic *haptic = NULL, *second = NULL;
    sinew_tool_id tool;
    size_t count = 7, i;

    MUST(sinew_world_def_init(&world_def, sizeof world_def));
    MUST(sinew_world_create(&world_def, &world));
    MUST(sinew_tool_def_init(&tool_def, sizeof tool_def));
    tool_def.shape = SINEW_SHAPE_SPHERE;
    tool_def.radius = 0.01f;
    MUST(sinew_tool_create(world, &tool_def, &tool));

    REFUSED(INVALID_ARGUMENT, "def", sinew_haptic_def_init(NULL, sizeof def));
    REFUSED(INVALID_ARGUMENT, "struct_size", sinew_haptic_def_init(&def, sizeof def - 1));
    REFUSED(INVALID_ARGUMENT, "struct_size", sinew_haptic_def_init(&def, sizeof def + 4));
    MUST(sinew_haptic_def_init(&def, sizeof def));
    REFUSED(STALE_ID, "tool", sinew_haptic_create(world, &def, &haptic)); /* no default */
    def.tool = tool;
    REFUSED(INVALID_ARGUMENT, "world", sinew_haptic_create(NULL, &def, &haptic));
    REFUSED(INVALID_ARGUMENT, "def", sinew_haptic_create(world, NULL, &haptic));
    REFUSED(INVALID_ARGUMENT, "out", sinew_haptic_create(world, &def, NULL));
    def.struct_size += 1;
    REFUSED(INVALID_ARGUMENT, "struct_size", sinew_haptic_create(world, &def, &haptic));
    def.struct_size -= 1;
    def.stiffness = -5;
    REFUSED(INVALID_ARGUMENT, "stiffness is -5", sinew_haptic_create(world, &def, &haptic));
    def.stiffness = 1000;
    CHECK(haptic == NULL);
    MUST(sinew_haptic_create(world, &def, &haptic));
    REFUSED(INVALID_ARGUMENT, "tool is ", sinew_haptic_create(world, &def, &second));
    REFUSED(INVALID_ARGUMENT, "haptic handle", sinew_tool_set_pose(world, tool, here, NULL));
    CHECK(second == NULL);

    memset(felt.bytes, 0xA5, sizeof felt.bytes);
    felt.now.struct_size = sizeof felt.now;
    REFUSED(INVALID_ARGUMENT, "haptic", sinew_haptic_tick(NULL, here, NULL, NULL, NULL, 1e-3f, &felt.now));
    REFUSED(INVALID_ARGUMENT, "position", sinew_haptic_tick(haptic, NULL, NULL, NULL, NULL, 1e-3f, &felt.now));
    REFUSED(INVALID_ARGUMENT, "position", sinew_haptic_tick(haptic, far_away, NULL, NULL, NULL, 1e-3f, &felt.now));
    REFUSED(INVALID_ARGUMENT, "orientation", sinew_haptic_tick(haptic, here, none, NULL, NULL, 1e-3f, &felt.now));
    REFUSED(INVALID_ARGUMENT, "velocity", sinew_haptic_tick(haptic, here, NULL, spin, NULL, 1e-3f, &felt.now));
    REFUSED(INVALID_ARGUMENT, "angular_velocity", sinew_haptic_tick(haptic, here, NULL, NULL, spin, 1e-3f, &felt.now));
    REFUSED(INVALID_ARGUMENT, "dt is -1", sinew_haptic_tick(haptic, here, NULL, NULL, NULL, -1, &felt.now));
    REFUSED(INVALID_ARGUMENT, "out", sinew_haptic_tick(haptic, here, NULL, NULL, NULL, 1e-3f, NULL));
    felt.now.struct_size = sizeof felt.now - 8;
    REFUSED(INVALID_ARGUMENT, "struct_size", sinew_haptic_tick(haptic, here, NULL, NULL, NULL, 1e-3f, &felt.now));
    felt.now.struct_size = sizeof felt.now;
    for (i = sizeof felt.now.struct_size; i < sizeof felt.bytes; i++)
        CHECK(felt.bytes[i] == 0xA5);
    REFUSED(INVALID_ARGUMENT, "haptic", sinew_haptic_get_contacts(NULL, contacts, 1, &count));
    REFUSED(INVALID_ARGUMENT, "out_count", sinew_haptic_get_contacts(haptic, contacts, 1, NULL));
    REFUSED(INVALID_ARGUMENT, "out_contacts", sinew_haptic_get_contacts(haptic, NULL, 1, &count));
    CHECK(count == 7);
    MUST(sinew_haptic_get_contacts(haptic, NULL, 0, &count));
    CHECK(count == 0);

    /* An orientation of any length, and as it was where it is left out: half a turn about z. */
    MUST(sinew_haptic_tick(haptic, here, half_turn, NULL, NULL, 1e-3f, &felt.now));
    CHECK_NEAR(fabs(felt.now.proxy_orientation[2]), 1, 1e-6);
    MUST(sinew_haptic_tick(haptic, here, NULL, NULL, NULL, 1e-3f, &felt.now));
    CHECK_NEAR(fabs(felt.now.proxy_orientation[2]), 1, 1e-6);
    CHECK(isinf(felt.now.age) && felt.now.version == 0 && !felt.now.is_over);
    for (i = sizeof felt.now; i < sizeof felt.bytes; i++)
        CHECK(felt.bytes[i] == 0xA5);

    /* A world may end first: the handle goes on alone. */
    sinew_world_destroy(world);
    MUST(sinew_haptic_tick(haptic, here, NULL, NULL, NULL, 1e-3f, &felt.now));
    CHECK(felt.now.is_over == 1);
    sinew_haptic_destroy(haptic);
    sinew_haptic_destroy(NULL);
    return checked("a haptic handle refuses by name and changes nothing then");
}
