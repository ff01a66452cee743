/* What is refused of attachments and of the wrench of several tools; and that they do what they should where they are not. */
#include "refusals.h"

static sinew_attachment_id bad_attachments[BAD_IDS], held;
static sinew_tool_id other;

/* One end of attachments: nodes, or points of a surface. */
typedef struct ends {
    const uint32_t *nodes, *triangles;
    const float *weights;
} ends;

static ends at_nodes(const uint32_t *nodes)
{
    ends made = {NULL, NULL, NULL};
    made.nodes = nodes;
    return made;
}

static ends at_points(const uint32_t *triangles, const float *weights)
{
    ends made = {NULL, NULL, NULL};
    made.triangles = triangles;
    made.weights = weights;
    return made;
}

/* A node, until the next call. */
static const uint32_t *one_of(uint32_t node)
{
    static uint32_t kept;
    kept = node;
    return &kept;
}

static sinew_attachment_def definition(sinew_body_id body, ends of, size_t count, float force_limit)
{
    sinew_attachment_def def;
    MUST(sinew_attachment_def_init(&def, sizeof def));
    def.body = body;
    def.count = count;
    def.nodes = of.nodes;
    def.triangles = of.triangles;
    def.weights = of.weights;
    def.force_limit = force_limit;
    return def;
}

static sinew_status to_tool(sinew_world *world, sinew_body_id body, ends of, size_t count, sinew_tool_id tool, float force_limit,
                            sinew_attachment_id *out)
{
    sinew_attachment_def def = definition(body, of, count, force_limit);
    def.tool = tool;
    return sinew_attachment_create(world, &def, out);
}

static sinew_status to_body(sinew_world *world, sinew_body_id body, ends of, size_t count, sinew_body_id second, ends others,
                            float force_limit, sinew_attachment_id *out)
{
    sinew_attachment_def def = definition(body, of, count, force_limit);
    def.other = second;
    def.other_nodes = others.nodes;
    def.other_triangles = others.triangles;
    def.other_weights = others.weights;
    return sinew_attachment_create(world, &def, out);
}

static sinew_surface_point point_of(sinew_body_id body, uint32_t triangle, const float *weights)
{
    sinew_surface_point point;
    memset(&point, 0, sizeof point);
    point.struct_size = sizeof point;
    point.body = body;
    point.triangle = triangle;
    memcpy(point.weights, weights, sizeof point.weights);
    return point;
}

static sinew_status suture(sinew_world *world, sinew_body_id body, uint32_t triangle, const float *weights, sinew_body_id second,
                           uint32_t other_triangle, const float *other_weights, const sinew_suture_def *def, sinew_attachment_id *out)
{
    const sinew_surface_point point = point_of(body, triangle, weights), other_point = point_of(second, other_triangle, other_weights);
    return sinew_suture_create(world, &point, &other_point, def, out);
}

static sinew_attachment_id attached(uint32_t node)
{
    sinew_attachment_id attachment = {0, 0};
    MUST(to_tool(the.world, the.body, at_nodes(&node), 1, the.tool, 0, &attachment));
    return attachment;
}

static void set_up_attachments(void)
{
    sinew_attachment_id replaced, gone;
    other = a_sphere();
    replaced = attached(4);
    MUST(sinew_attachment_release(the.world, replaced));
    held = attached(4);
    gone = attached(5);
    MUST(sinew_attachment_release(the.world, gone));
    FILL_BAD_IDS(bad_attachments, replaced, gone, held);
    MUST(sinew_world_get_state_hash(the.world, &the.hash));
}

static void nodes(void)
{
    const uint32_t good[] = {7, 8}, pinned[] = {8, 0}, massless[] = {8, 2}, beyond[] = {8, 9}, taken[] = {8, 4};
    const sinew_tool_id tool = the.tool;
    const sinew_body_id body = the.body;
    int i;
    REFUSES_NO_BODY(to_tool(world, body, at_nodes(good), 2, tool, 0, out.attachments));
    REFUSES_NO_TOOL(to_tool(world, body, at_nodes(good), 2, tool, 0, out.attachments));
    REFUSED(INVALID, "nodes[0]", to_tool(the.world, body, at_nodes(one_of(9)), 1, tool, 0, out.attachments));
    REFUSED(INVALID, "nodes[0]", to_tool(the.world, body, at_nodes(one_of(UINT32_MAX)), 1, tool, 0, out.attachments));
    REFUSED(INVALID, "nodes[0]", to_tool(the.world, body, at_nodes(one_of(0)), 1, tool, 0, out.attachments));
    REFUSED(INVALID, "nodes[0]", to_tool(the.world, body, at_nodes(one_of(2)), 1, tool, 0, out.attachments));
    REFUSED(INVALID, "nodes[0]", to_tool(the.world, body, at_nodes(one_of(4)), 1, other, 0, out.attachments));
    REFUSED(INVALID, "nodes", to_tool(the.world, body, at_nodes(NULL), 2, tool, 0, out.attachments));
    REFUSED(INVALID, "out_attachments", to_tool(the.world, body, at_nodes(good), 2, tool, 0, NULL));
    REFUSED(INVALID, "out_attachments", to_tool(the.world, body, at_nodes(good), SIZE_MAX, tool, 0, out.attachments));
    REFUSED(INVALID, "nodes[1]", to_tool(the.world, body, at_nodes(pinned), 2, tool, 0, out.attachments));
    REFUSED(INVALID, "nodes[1]", to_tool(the.world, body, at_nodes(massless), 2, tool, 0, out.attachments));
    REFUSED(INVALID, "nodes[1]", to_tool(the.world, body, at_nodes(beyond), 2, tool, 0, out.attachments));
    REFUSED(INVALID, "nodes[1]", to_tool(the.world, body, at_nodes(taken), 2, other, 0, out.attachments));
    for (i = 0; i < OR_NEGATIVE; i++)
        if (i != 1) /* infinity: no limit */
            REFUSED(INVALID, "force_limit", to_tool(the.world, body, at_nodes(good), 2, tool, bad[i], out.attachments));
}

static void points(void)
{
    /* Triangle 3 is 2 4 5, 0 is 0 3 1, 7 is 5 7 8. */
    static const float good[] = {0.5f, 0.25f, 0.25f, 0, 0.5f, 0.5f};
    const uint32_t free_ones[] = {7, 7}, pinned[] = {7, 0}, beyond[] = {7, 8};
    const sinew_tool_id tool = the.tool;
    const sinew_body_id body = the.body;
    size_t i, corner;
    REFUSES_NO_BODY(to_tool(world, body, at_points(free_ones, good), 2, tool, 0, out.attachments));
    REFUSES_NO_TOOL(to_tool(world, body, at_points(free_ones, good), 2, tool, 0, out.attachments));
    REFUSED(INVALID, "triangles", to_tool(the.world, body, at_points(NULL, good), 2, tool, 0, out.attachments));
    REFUSED(INVALID, "weights", to_tool(the.world, body, at_points(free_ones, NULL), 2, tool, 0, out.attachments));
    REFUSED(INVALID, "out_attachments", to_tool(the.world, body, at_points(free_ones, good), 2, tool, 0, NULL));
    REFUSED(INVALID, "triangles[1]", to_tool(the.world, body, at_points(beyond, good), 2, tool, 0, out.attachments));
    REFUSED(INVALID, "triangles[0]", to_tool(the.world, body, at_points(pinned + 1, good), 1, tool, 0, out.attachments));
    REFUSED(INVALID, "force_limit", to_tool(the.world, body, at_points(free_ones, good), 2, tool, -1, out.attachments));
    for (i = 0; i < OR_NEGATIVE; i++)
        for (corner = 0; corner < 6; corner++)
            REFUSED(INVALID, corner < 3 ? "weights[0]" : "weights[1]",
                    to_tool(the.world, body, at_points(free_ones, spoiled(good, 6, corner, bad[i])), 2, tool, 0, out.attachments));
    REFUSED(INVALID, "weights[0]",
            to_tool(the.world, body, at_points(free_ones, spoiled(good, 6, 0, 0.6f)), 2, tool, 0, out.attachments));
}

/* What a definition says of both ends. */
static void definitions(void)
{
    static const float good[] = {0.5f, 0.25f, 0.25f};
    static const uint32_t first = 0;
    const ends none = {NULL, NULL, NULL};
    sinew_attachment_def usual, def;
    MUST(sinew_attachment_def_init(&usual, sizeof usual));
    CHECK(usual.count == 0 && isinf(usual.force_limit) && usual.tool.index1 == 0 && usual.other.index1 == 0);
    REFUSED(INVALID, "def", sinew_attachment_def_init(NULL, sizeof usual));
    REFUSES_SIZES(sinew_attachment_def, sizeof(sinew_attachment_def), (void)0, sinew_attachment_def_init(&out.attachment_def, size));
    REFUSED(INVALID, "def", sinew_attachment_create(the.world, NULL, out.attachments));
    usual = definition(the.body, at_nodes(one_of(8)), 1, 0);
    REFUSES_SIZES(sinew_attachment_def, sizeof(sinew_attachment_def), sinew_attachment_def sized = usual; sized.struct_size = size,
                  sinew_attachment_create(the.world, &sized, out.attachments));
    REFUSED(STALE, "tool", sinew_attachment_create(the.world, &usual, out.attachments));
    def = usual;
    def.tool = the.tool;
    def.other = the.body;
    REFUSED(INVALID, "tool", sinew_attachment_create(the.world, &def, out.attachments));
    def.other.index1 = def.other.generation = 0;
    def.other_nodes = &first;
    REFUSED(INVALID, "tool", sinew_attachment_create(the.world, &def, out.attachments));
    def = usual;
    def.tool = the.tool;
    def.triangles = &first;
    REFUSED(INVALID, "nodes", sinew_attachment_create(the.world, &def, out.attachments));
    def.triangles = NULL;
    def.weights = good;
    REFUSED(INVALID, "nodes", sinew_attachment_create(the.world, &def, out.attachments));
    REFUSED(INVALID, "triangles", to_tool(the.world, the.body, none, 1, the.tool, 0, out.attachments));
    REFUSED(INVALID, "other_nodes", to_body(the.world, the.body, at_nodes(one_of(8)), 1, the.body, none, 0, out.attachments));
    MUST(to_tool(the.world, the.body, none, 0, the.tool, 0, NULL)); /* none at all */
}

/* Of the cloth to itself, or to another one like it. */
static void to_bodies(void)
{
    static const float good[] = {0.5f, 0.25f, 0.25f, 0, 0.5f, 0.5f};
    const uint32_t some[] = {7, 8}, others[] = {3, 5}, beyond[] = {8, 9}, same[] = {7, 5}, triangles[] = {7, 7}, first[] = {0, 0}, no_triangle[] = {7, 8};
    const sinew_body_id cloth = the.body;
    size_t i, corner;
    REFUSES_NO_BODY(to_body(world, body, at_nodes(some), 2, cloth, at_nodes(others), 0, out.attachments));
    REFUSES_NO_BODY(to_body(world, cloth, at_nodes(some), 2, body, at_nodes(others), 0, out.attachments));
    REFUSES_NO_BODY(to_body(world, body, at_nodes(some), 2, cloth, at_points(first, good), 0, out.attachments));
    REFUSES_NO_BODY(to_body(world, cloth, at_nodes(some), 2, body, at_points(first, good), 0, out.attachments));
    REFUSES_NO_BODY(to_body(world, body, at_points(triangles, good), 2, cloth, at_points(first, good), 0, out.attachments));
    REFUSES_NO_BODY(to_body(world, cloth, at_points(triangles, good), 2, body, at_points(first, good), 0, out.attachments));
    REFUSED(INVALID, "nodes", to_body(the.world, cloth, at_nodes(NULL), 2, cloth, at_nodes(others), 0, out.attachments));
    REFUSED(INVALID, "other_nodes", to_body(the.world, cloth, at_nodes(some), 2, cloth, at_nodes(NULL), 0, out.attachments));
    REFUSED(INVALID, "out_attachments", to_body(the.world, cloth, at_nodes(some), 2, cloth, at_nodes(others), 0, NULL));
    REFUSED(INVALID, "nodes[1]", to_body(the.world, cloth, at_nodes(beyond), 2, cloth, at_nodes(others), 0, out.attachments));
    REFUSED(INVALID, "other_nodes[1]", to_body(the.world, cloth, at_nodes(some), 2, cloth, at_nodes(beyond), 0, out.attachments));
    REFUSED(INVALID, "other_nodes[0]", to_body(the.world, cloth, at_nodes(some), 2, cloth, at_nodes(same), 0, out.attachments));
    REFUSED(INVALID, "nodes", to_body(the.world, cloth, at_nodes(NULL), 2, cloth, at_points(first, good), 0, out.attachments));
    REFUSED(INVALID, "other_triangles", to_body(the.world, cloth, at_nodes(some), 2, cloth, at_points(NULL, good), 0, out.attachments));
    REFUSED(INVALID, "other_weights", to_body(the.world, cloth, at_nodes(some), 2, cloth, at_points(first, NULL), 0, out.attachments));
    REFUSED(INVALID, "out_attachments", to_body(the.world, cloth, at_nodes(some), 2, cloth, at_points(first, good), 0, NULL));
    REFUSED(INVALID, "other_triangles[1]", to_body(the.world, cloth, at_nodes(some), 2, cloth, at_points(no_triangle, good), 0, out.attachments));
    REFUSED(INVALID, "triangles", to_body(the.world, cloth, at_points(NULL, good), 2, cloth, at_points(first, good), 0, out.attachments));
    REFUSED(INVALID, "weights", to_body(the.world, cloth, at_points(triangles, NULL), 2, cloth, at_points(first, good), 0, out.attachments));
    REFUSED(INVALID, "other_triangles", to_body(the.world, cloth, at_points(triangles, good), 2, cloth, at_points(NULL, good), 0, out.attachments));
    REFUSED(INVALID, "other_weights", to_body(the.world, cloth, at_points(triangles, good), 2, cloth, at_points(first, NULL), 0, out.attachments));
    REFUSED(INVALID, "out_attachments", to_body(the.world, cloth, at_points(triangles, good), 2, cloth, at_points(first, good), 0, NULL));
    REFUSED(INVALID, "triangles[1]", to_body(the.world, cloth, at_points(no_triangle, good), 2, cloth, at_points(first, good), 0, out.attachments));
    REFUSED(INVALID, "triangles[0]", to_body(the.world, cloth, at_points(triangles, good), 2, cloth, at_points(triangles, good), 0, out.attachments));
    for (i = 0; i < OR_NEGATIVE; i++) {
        if (i != 1) /* infinity: no limit */
            REFUSED(INVALID, "force_limit", to_body(the.world, cloth, at_nodes(some), 2, cloth, at_nodes(others), bad[i], out.attachments));
        for (corner = 0; corner < 6; corner++)
            REFUSED(INVALID, corner < 3 ? "other_weights[0]" : "other_weights[1]",
                    to_body(the.world, cloth, at_nodes(some), 2, cloth, at_points(first, spoiled(good, 6, corner, bad[i])), 0, out.attachments));
    }
}

/* Between two points of the cloth. */
static void sutures(void)
{
    static const float good[] = {0.5f, 0.25f, 0.25f}, off[] = {0.6f, 0.25f, 0.25f};
    const sinew_body_id cloth = the.body;
    sinew_attachment_id *to = out.attachments;
    sinew_suture_def usual;
    size_t i;
    const sinew_surface_point here = point_of(cloth, 7, good), there = point_of(cloth, 0, good);
    MUST(sinew_suture_def_init(&usual, sizeof usual));
    CHECK(usual.length == -1 && isinf(usual.stiffness) && isinf(usual.force_limit));
    REFUSED(INVALID, "def", sinew_suture_def_init(NULL, sizeof usual));
    REFUSES_SIZES(sinew_suture_def, sizeof(sinew_suture_def), (void)0, sinew_suture_def_init(&out.suture_def, size));
    REFUSES_NO_BODY(suture(world, body, 7, good, cloth, 0, good, &usual, to));
    REFUSES_NO_BODY(suture(world, cloth, 7, good, body, 0, good, NULL, to));
    REFUSES_SIZES(sinew_suture_def, sizeof(sinew_suture_def), sinew_suture_def def = usual; def.struct_size = size,
                  suture(the.world, cloth, 7, good, cloth, 0, good, &def, to));
    REFUSED(INVALID, "triangle", suture(the.world, cloth, 8, good, cloth, 0, good, &usual, to));
    REFUSED(INVALID, "other_triangle", suture(the.world, cloth, 7, good, cloth, 8, good, &usual, to));
    REFUSED(INVALID, "other_triangle", suture(the.world, cloth, 7, good, cloth, 7, good, &usual, to));
    REFUSED(INVALID, "point", sinew_suture_create(the.world, NULL, &there, &usual, to));
    REFUSED(INVALID, "other_point", sinew_suture_create(the.world, &here, NULL, &usual, to));
    REFUSED(INVALID, "weights", suture(the.world, cloth, 7, off, cloth, 0, good, &usual, to));
    REFUSED(INVALID, "out", suture(the.world, cloth, 7, good, cloth, 0, good, &usual, NULL));
    for (i = 0; i < OR_ZERO; i++) {
        sinew_suture_def def = usual;
        def.length = i == 3 ? -0.5f : bad[i];
        if (i != 4) /* 0 is a length */
            REFUSED(INVALID, "length", suture(the.world, cloth, 7, good, cloth, 0, good, &def, to));
        def = usual;
        def.stiffness = bad[i];
        if (i != 1) /* infinity: it does not stretch */
            REFUSED(INVALID, "stiffness", suture(the.world, cloth, 7, good, cloth, 0, good, &def, to));
        def = usual;
        def.force_limit = bad[i];
        if (i != 1 && i != 4) /* infinity and 0: no limit */
            REFUSED(INVALID, "force_limit", suture(the.world, cloth, 7, good, cloth, 0, good, &def, to));
        if (i != 4)
            REFUSED(INVALID, "other_weights",
                    suture(the.world, cloth, 7, good, cloth, 0, spoiled(good, 3, 1, bad[i]), &usual, to));
    }
    /* What is held by a tool is no suture. */
    REFUSES_RESULT_SIZES(sinew_suture_report, sizeof(sinew_suture_report), suture,
                         sinew_suture_get_report(the.world, held, &out.suture));
    for (i = 0; i < BAD_IDS; i++) {
        REFUSED(BAD_ID_STATUS(i), "attachment", sinew_suture_set_length(the.world, bad_attachments[i], 0));
        REFUSED(BAD_ID_STATUS(i), "attachment", sinew_suture_get_report(the.world, bad_attachments[i], &out.suture));
    }
    REFUSED(INVALID, "suture", sinew_suture_set_length(the.world, held, 0));
    REFUSED(INVALID, "suture", sinew_suture_get_report(the.world, held, &out.suture));
    REFUSED(INVALID, "out_report", sinew_suture_get_report(the.world, held, NULL));
    REFUSED(INVALID, "world", sinew_suture_set_length(NULL, held, 0));
    REFUSED(INVALID, "world", sinew_suture_get_report(NULL, held, &out.suture));
}

static void attachments(void)
{
    const float place[3] = {0, 0, 0};
    REFUSES_NO_ATTACHMENT(bad_attachments, held, sinew_attachment_release(world, attachment));
    REFUSES_NO_ATTACHMENT(bad_attachments, held, sinew_attachment_get_force(world, attachment, out.force));
    REFUSED(INVALID, "out_force", sinew_attachment_get_force(the.world, held, NULL));
    REFUSED(INVALID, "world", sinew_world_get_broken_attachments(NULL, out.attachments, 2, &out.count));
    REFUSED(INVALID, "out_attachments", sinew_world_get_broken_attachments(the.world, NULL, 2, &out.count));
    REFUSED(INVALID, "out_count", sinew_world_get_broken_attachments(the.world, out.attachments, 2, NULL));
    /* What is held cannot be pinned. */
    REFUSED(INVALID, "node", sinew_body_pin(the.world, the.body, 4));
    REFUSED(INVALID, "node", sinew_body_pin_axes(the.world, the.body, 4, SINEW_AXIS_Y));
    REFUSED(INVALID, "node", sinew_body_unpin(the.world, the.body, 4));
    REFUSED(INVALID, "node", sinew_body_move_pin(the.world, the.body, 4, place));
    REFUSED(INVALID, "node", sinew_body_get_pin_force(the.world, the.body, 4, out.force));
}

static void wrenches(void)
{
    static const float point[3] = {0, 1, 0};
    sinew_tool_id tools[2];
    int i;
    tools[0] = the.tool;
    tools[1] = other;
    REFUSED(INVALID, "world", sinew_world_get_total_wrench(NULL, tools, 2, point, out.force, out.torque));
    REFUSED(INVALID, "tools", sinew_world_get_total_wrench(the.world, NULL, 2, point, out.force, out.torque));
    REFUSED(INVALID, "point", sinew_world_get_total_wrench(the.world, tools, 2, NULL, out.force, out.torque));
    for (i = 0; i < NOT_FINITE; i++)
        REFUSED(INVALID, "point", sinew_world_get_total_wrench(the.world, tools, 2, spoiled(point, 3, 1, bad[i]), out.force, out.torque));
    for (i = 0; i < BAD_IDS; i++) {
        tools[1] = the.bad_tools[i];
        /* An id that was not yet is one of a tool by now. */
        if (tools[1].index1 != other.index1 || tools[1].generation != other.generation)
            REFUSED(BAD_ID_STATUS(i), "tool", sinew_world_get_total_wrench(the.world, tools, 2, point, out.force, out.torque));
    }
    tools[1] = the.tool;
    REFUSED(INVALID, "tools[1]", sinew_world_get_total_wrench(the.world, tools, 2, point, out.force, out.torque));
}

/* A node is held, carried, let go and lost. */
static void use(void)
{
    static const float none[3] = {0, 0, 0}, somewhere[3] = {0.5f, 3, 0}, up[3] = {0, 2.9f, 0};
    const uint32_t triangles[] = {7};
    const float weights[] = {0, 0.5f, 0.5f};
    sinew_attachment_id point[1], weak, slipped[2];
    sinew_vec3_view view;
    float before[3], force[3], torque[3], more[3];
    size_t count = 7;
    MUST(to_tool(the.world, the.body, at_points(triangles, weights), 1, the.tool, INFINITY, point));
    MUST(sinew_attachment_get_force(the.world, held, force));
    CHECK(memcmp(force, none, sizeof none) == 0);
    MUST(sinew_body_get_positions(the.world, the.body, &view));
    memcpy(before, view.data + 3 * 4, sizeof before);
    /* The tool, which waits to go down by half a metre, goes down by a tenth. */
    MUST(sinew_tool_set_pose(the.world, the.tool, up, NULL));
    MUST(sinew_world_step(the.world, 0.01f, NULL));
    MUST(sinew_body_get_positions(the.world, the.body, &view));
    CHECK(fabsf(view.data[3 * 4 + 1] - (before[1] - 0.1f)) < 1e-5f && fabsf(view.data[3 * 4] - before[0]) < 1e-6f);
    MUST(sinew_attachment_get_force(the.world, held, force));
    MUST(sinew_attachment_get_force(the.world, point[0], more));
    MUST(sinew_world_get_total_wrench(the.world, &the.tool, 1, somewhere, out.force, torque));
    CHECK(force[1] != 0 && fabsf(out.force[1] + force[1] + more[1]) < 1e-4f * (fabsf(force[1]) + fabsf(more[1])));
    MUST(sinew_world_get_broken_attachments(the.world, NULL, 0, &count));
    CHECK(count == 0);
    MUST(sinew_attachment_release(the.world, held));
    MUST(sinew_attachment_release(the.world, point[0]));
    MUST(to_tool(the.world, the.body, at_nodes(one_of(8)), 1, the.tool, 1e-6f, &weak));
    MUST(sinew_world_step(the.world, 0.01f, NULL));
    MUST(sinew_world_get_broken_attachments(the.world, slipped, 2, &count));
    CHECK(count == 1 && memcmp(&slipped[0], &weak, sizeof weak) == 0);
    CHECK(sinew_attachment_release(the.world, weak) == SINEW_STATUS_STALE_ID);
    MUST(sinew_body_pin(the.world, the.body, 8));
    /* Two nodes of the cloth become one. */
    {
        const uint32_t one[] = {6}, two[] = {7};
        MUST(to_body(the.world, the.body, at_nodes(one), 1, the.body, at_nodes(two), 0, &weak));
        MUST(sinew_world_step(the.world, 0.01f, NULL));
        MUST(sinew_attachment_get_force(the.world, weak, force));
        CHECK(isfinite(force[0]) && force[0] * force[0] + force[1] * force[1] + force[2] * force[2] > 0);
        CHECK(sinew_body_solve_equilibrium(the.world, the.body, NULL, NULL) == SINEW_STATUS_INVALID_ARGUMENT);
        MUST(sinew_attachment_release(the.world, weak));
    }
    /* Two points of it are drawn together. */
    {
        const float first[] = {0.5f, 0.25f, 0.25f};
        sinew_suture_def def;
        sinew_suture_report report = {sizeof report, 0, 0, 0}, after = report;
        MUST(sinew_suture_def_init(&def, sizeof def));
        def.stiffness = 5;
        MUST(suture(the.world, the.body, 7, first, the.body, 4, first, &def, &weak));
        MUST(sinew_suture_get_report(the.world, weak, &report));
        CHECK(report.length == report.distance && report.length > 0 && report.energy < 1e-9);
        CHECK(sinew_suture_set_length(the.world, weak, -1) == SINEW_STATUS_INVALID_ARGUMENT);
        MUST(sinew_suture_set_length(the.world, weak, report.length - 0.002f));
        MUST(sinew_world_step(the.world, 0.01f, NULL));
        MUST(sinew_suture_get_report(the.world, weak, &after));
        CHECK(fabsf(after.length - (report.length - 0.002f)) < 1e-6f && after.distance < report.distance);
        MUST(sinew_attachment_get_force(the.world, weak, force));
        CHECK(force[0] * force[0] + force[1] * force[1] + force[2] * force[2] > 0);
        MUST(sinew_attachment_release(the.world, weak));
        CHECK(sinew_suture_get_report(the.world, weak, &after) == SINEW_STATUS_STALE_ID);
    }
}

int main(void)
{
    set_up();
    set_up_attachments();
    nodes();
    points();
    to_bodies();
    definitions();
    sutures();
    attachments();
    wrenches();
    use();
    return tear_down();
}
