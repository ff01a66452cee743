/* Each name and argument list of version 0.1 does what its replacement does. */
#define SINEW_COMPAT_0_1
#include "scene.h"

static sinew_body_id a_sheet(sinew_world *world)
{
    static const float size[2] = {0.1f, 0.1f};
    static const uint32_t cells[2] = {4, 4};
    sinew_mesh *mesh;
    sinew_body_def def;
    sinew_body_id body = {0, 0};
    MUST(sinew_mesh_create_cloth(size, cells, &mesh));
    MUST(sinew_body_def_init(&def, sizeof def));
    MUST(sinew_body_def_set_mesh(&def, mesh));
    def.node_mass = 1e-3f;
    def.stiffness = 100;
    def.spare_nodes = 100;
    def.most_tears = 1;
    MUST(sinew_body_create(world, &def, &body));
    sinew_mesh_destroy(mesh);
    return body;
}

static sinew_tool_id a_ball(sinew_world *world, float x)
{
    sinew_tool_def def;
    sinew_tool_id tool = {0, 0};
    MUST(sinew_tool_def_init(&def, sizeof def));
    def.radius = 0.01f;
    def.position[0] = x;
    def.position[1] = 0.05f;
    MUST(sinew_tool_create(world, &def, &tool));
    return tool;
}

static void releases(sinew_world *world, const sinew_attachment_id *ids, size_t count)
{
    size_t i;
    for (i = 0; i < count; i++)
        MUST(sinew_attachment_release(world, ids[i]));
}

static void attachments(sinew_world *world, sinew_body_id sheet, sinew_body_id other, sinew_tool_id tool)
{
    static const uint32_t nodes[2] = {12, 13}, others[2] = {1, 2}, triangles[2] = {20, 21}, other_triangles[2] = {0, 1};
    static const float weights[6] = {0.5f, 0.25f, 0.25f, 0.25f, 0.5f, 0.25f};
    sinew_attachment_id ids[2];
    size_t count = 7;
    sinew_suture_report report;
    MUST(sinew_body_attach_node(world, sheet, 12, tool, 0, ids));
    releases(world, ids, 1);
    MUST(sinew_body_attach_nodes(world, sheet, nodes, 2, tool, 0, ids));
    releases(world, ids, 2);
    MUST(sinew_body_attach_points(world, sheet, triangles, weights, 2, tool, 1e-9f, ids));
    MUST(sinew_world_step(world, 1e-3f, NULL));
    MUST(sinew_world_get_slipped(world, ids, 2, &count));
    CHECK(count == 2);
    MUST(sinew_body_attach_nodes_to_nodes(world, sheet, nodes, 2, other, others, 0, ids));
    releases(world, ids, 2);
    MUST(sinew_body_attach_nodes_to_points(world, sheet, nodes, 2, other, other_triangles, weights, 0, ids));
    releases(world, ids, 2);
    MUST(sinew_body_attach_points_to_points(world, sheet, triangles, weights, 2, other, other_triangles, weights, 0, ids));
    releases(world, ids, 2);
    MUST(sinew_body_suture_points(world, sheet, 20, weights, other, 1, weights + 3, NULL, ids));
    report.struct_size = sizeof report;
    MUST(sinew_suture_get_report(world, ids[0], &report));
    CHECK(report.length > 0);
    releases(world, ids, 1);
}

static void values(sinew_world *world, sinew_body_id sheet)
{
    static const uint32_t pair[2] = {12, 13};
    static const float ones[2] = {1, 1}, limit = 0.5f, stiffness = 70;
    float means[2] = {0, 0}, read = 0;
    MUST(sinew_body_set_springs(world, sheet, pair, 1, &stiffness, NULL));
    MUST(sinew_body_get_springs(world, sheet, pair, 1, &read, NULL));
    CHECK(read == stiffness);
    MUST(sinew_body_set_tear_limits(world, sheet, pair, 1, &limit, NULL));
    MUST(sinew_body_get_tear_limits(world, sheet, pair, 1, means, means + 1));
    CHECK(means[0] == limit && means[1] == 0);
    {
        static const uint32_t edge[2] = {0, 1};
        MUST(sinew_mean_at_nodes(edge, 2, ones, 1, means, 2));
        CHECK(means[0] == 1 && means[1] == 1);
    }
}

static void equilibrium(sinew_world *world, sinew_body_id sheet)
{
    static const uint32_t corners[4] = {0, 4, 20, 24};
    sinew_rest_state_def def;
    sinew_rest_state_report report;
    MUST(sinew_body_pin_nodes(world, sheet, corners, 4));
    MUST(sinew_rest_state_def_init(&def, sizeof def));
    report.struct_size = sizeof report;
    MUST(sinew_body_rest_state(world, sheet, &def, &report));
    CHECK(report.iterations > 0);
}

static void fields(const sinew_world *world, sinew_body_id body)
{
    sinew_solver_report solver;
    sinew_contact_change change;
    sinew_mesh_view view;
    solver.struct_size = sizeof solver;
    MUST(sinew_body_get_solver_report(world, body, &solver));
    change.begun = 1;
    view.closed = 2;
    CHECK(solver.converged == solver.has_converged);
    CHECK(change.has_begun == 1);
    CHECK(view.is_closed == 2);
}

static void wrenches(sinew_world *world, const sinew_tool_id *tools)
{
    static const float point[3] = {0, 0, 0};
    sinew_haptic_def def;
    sinew_haptic *haptic;
    sinew_haptic_result felt;
    float force[3], torque[3];
    MUST(sinew_tools_get_wrench(world, tools, 2, point, force, torque));
    MUST(sinew_haptic_def_init(&def, sizeof def));
    def.tool = tools[0];
    MUST(sinew_haptic_create(world, &def, &haptic));
    felt.struct_size = sizeof felt;
    MUST(sinew_haptic_tick(haptic, point, NULL, NULL, NULL, 1e-3f, &felt));
    sinew_haptic_destroy(haptic);
}

static void snapshots(const sinew_world *world)
{
    sinew_world *twin = NULL;
    uint8_t *bytes;
    size_t size = 0;
    MUST(sinew_world_get_snapshot_size(world, &size));
    bytes = (uint8_t *)malloc(size);
    CHECK(bytes != NULL);
    MUST(sinew_world_save_snapshot(world, bytes, size));
    MUST(sinew_world_load_snapshot(bytes, size, 2, NULL, NULL, &twin));
    CHECK(sinew_world_load_snapshot(bytes, size, 1000, NULL, NULL, &twin) == SINEW_STATUS_INVALID_ARGUMENT);
    sinew_world_destroy(twin);
    free(bytes);
}

/* Of the helpers beside them. */
static void helpers(const sinew_world *world, sinew_body_id sheet, sinew_tool_id tool)
{
    const sinew_blade_id blade = SINEW_NULL_BLADE;
    const sinew_attachment_id attachment = SINEW_NULL_ATTACHMENT;
    sinew_vec3_view view;
    CHECK(sinew_body_is_valid(world, SINEW_NULL_BODY) == 0 && !sinew_body_id_equals(sheet, SINEW_NULL_BODY));
    CHECK(sinew_tool_is_valid(world, SINEW_NULL_TOOL) == 0 && sinew_tool_id_equals(tool, tool));
    CHECK(sinew_blade_is_valid(world, blade) == 0 && sinew_blade_id_equals(blade, SINEW_NULL_BLADE));
    CHECK(sinew_attachment_is_valid(world, attachment) == 0 && sinew_attachment_id_equals(attachment, SINEW_NULL_ATTACHMENT));
    MUST(sinew_body_get_positions(world, sheet, &view));
    CHECK(sinew_vec3_at(view, 0) == view.data && (const char *)sinew_vec3_at(view, 3) == (const char *)view.data + 3 * view.stride);
}

int main(void)
{
    sinew_world *world = a_world(-9.81f);
    const sinew_body_id sheet = a_sheet(world), other = a_sheet(world);
    sinew_tool_id tools[2];
    tools[0] = a_ball(world, 0);
    tools[1] = a_ball(world, 0.3f);
    attachments(world, sheet, other, tools[0]);
    values(world, sheet);
    equilibrium(world, sheet);
    fields(world, sheet);
    wrenches(world, tools);
    snapshots(world);
    helpers(world, sheet, tools[0]);
    sinew_world_destroy(world);
    return checked("names and arguments of 0.1 work with SINEW_COMPAT_0_1");
}
