/* Ids of another world are refused, of everything that has one; a world that a snapshot loads shares those of its own. */
#include "check.h"

typedef struct scene {
    sinew_world *world;
    sinew_body_id body;
    sinew_tool_id tool;
    sinew_blade_id blade;
    sinew_attachment_id attachment;
} scene;

static scene a_scene(void)
{
    static const float positions[] = {0, 0, 0, 1, 0, 0, 0, 0, 1};
    static const uint32_t triangle[] = {0, 2, 1}, node = 0;
    sinew_world_def world_def;
    sinew_body_def body_def;
    sinew_tool_def tool_def;
    sinew_blade_def blade_def;
    sinew_attachment_def attachment_def;
    scene made;
    MUST(sinew_world_def_init(&world_def, sizeof world_def));
    MUST(sinew_world_create(&world_def, &made.world));
    MUST(sinew_body_def_init(&body_def, sizeof body_def));
    body_def.positions = positions;
    body_def.node_count = 3;
    body_def.node_mass = 0.1f;
    body_def.stiffness = 10.0f;
    body_def.triangles = triangle;
    body_def.triangle_count = 1;
    MUST(sinew_body_create(made.world, &body_def, &made.body));
    MUST(sinew_tool_def_init(&tool_def, sizeof tool_def));
    tool_def.shape = SINEW_SHAPE_SPHERE;
    tool_def.radius = 0.1f;
    tool_def.position[1] = 3.0f;
    MUST(sinew_tool_create(made.world, &tool_def, &made.tool));
    MUST(sinew_blade_def_init(&blade_def, sizeof blade_def));
    blade_def.edge[0] = 5.0f;
    blade_def.edge[3] = 6.0f;
    MUST(sinew_blade_create(made.world, &blade_def, &made.blade));
    MUST(sinew_attachment_def_init(&attachment_def, sizeof attachment_def));
    attachment_def.body = made.body;
    attachment_def.nodes = &node;
    attachment_def.count = 1;
    attachment_def.tool = made.tool;
    MUST(sinew_attachment_create(made.world, &attachment_def, &made.attachment));
    return made;
}

static void refused(sinew_status status, const char *noun)
{
    char message[512];
    sinew_last_error(message, sizeof message);
    CHECK(status == SINEW_STATUS_INVALID_ARGUMENT);
    CHECK(strncmp(message, noun, strlen(noun)) == 0 && strstr(message, "belongs to another world") != NULL);
}

int main(void)
{
    const scene one = a_scene(), other = a_scene();
    sinew_world *loaded = NULL;
    sinew_world *worlds[2];
    uint64_t hashes[2];
    uint8_t *bytes;
    size_t size, i;
    float force[3];
    sinew_blade_report report;
    report.struct_size = sizeof report;

    refused(sinew_body_pin(one.world, other.body, 1), "body");
    refused(sinew_tool_get_wrench(one.world, other.tool, force, NULL), "tool");
    refused(sinew_blade_get_report(one.world, other.blade, &report), "blade");
    refused(sinew_attachment_get_force(one.world, other.attachment, force), "attachment");
    CHECK(!sinew_body_is_valid(one.world, other.body) && !sinew_tool_is_valid(one.world, other.tool));
    CHECK(!sinew_blade_is_valid(one.world, other.blade) && !sinew_attachment_is_valid(one.world, other.attachment));

    /* Equal worlds have equal hashes all the same. */
    MUST(sinew_world_get_state_hash(one.world, &hashes[0]));
    MUST(sinew_world_get_state_hash(other.world, &hashes[1]));
    CHECK(hashes[0] == hashes[1]);

    MUST(sinew_world_get_snapshot_size(one.world, &size));
    bytes = (uint8_t *)malloc(size);
    MUST(sinew_world_save_snapshot(one.world, bytes, size));
    MUST(sinew_world_load_snapshot(bytes, size, NULL, &loaded));
    free(bytes);
    worlds[0] = one.world;
    worlds[1] = loaded;
    for (i = 0; i < 2; i++) {
        MUST(sinew_body_pin(worlds[i], one.body, 1));
        MUST(sinew_tool_get_wrench(worlds[i], one.tool, force, NULL));
        MUST(sinew_blade_get_report(worlds[i], one.blade, &report));
        MUST(sinew_attachment_release(worlds[i], one.attachment));
        CHECK(sinew_attachment_release(worlds[i], one.attachment) == SINEW_STATUS_STALE_ID);
    }
    refused(sinew_body_pin(loaded, other.body, 1), "body");
    sinew_world_destroy(loaded);
    sinew_world_destroy(one.world);
    sinew_world_destroy(other.world);
    return checked("an id of another world is refused, in a loaded world it is not");
}
