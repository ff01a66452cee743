/* What is refused of cuts, and of what tells what they changed. */
#include "refusals.h"

static const float start[6] = {0.5f, -1, -1, 0.5f, 1, -1}, end[6] = {0.5f, -1, 3, 0.5f, 1, 3};

static void cuts(void)
{
    sinew_cut_report small;
    REFUSES_NO_BODY(sinew_body_cut(world, body, start, end, NULL));
    REFUSED(INVALID, "start", sinew_body_cut(the.world, the.body, NULL, end, NULL));
    REFUSED(INVALID, "end", sinew_body_cut(the.world, the.body, start, NULL, NULL));
    small.struct_size = 1;
    REFUSED(INVALID, "out_report", sinew_body_cut(the.world, the.body, start, end, &small));
    REFUSED(UNSUPPORTED, "spare_nodes", sinew_body_cut(the.world, the.body, start, end, NULL));
}

static void reports(void)
{
    sinew_topology_changes changes;
    sinew_triangle_view triangles;
    uint32_t pieces[9], count;
    changes.struct_size = sizeof changes;
    REFUSES_NO_BODY(sinew_body_get_topology_changes(world, body, 0, &changes));
    REFUSED(INVALID, "out", sinew_body_get_topology_changes(the.world, the.body, 0, NULL));
    REFUSED(INVALID, "version", sinew_body_get_topology_changes(the.world, the.body, 1, &changes));
    REFUSES_NO_BODY(sinew_body_get_triangles(world, body, &triangles));
    REFUSED(INVALID, "out", sinew_body_get_triangles(the.world, the.body, NULL));
    REFUSES_NO_BODY(sinew_body_get_pieces(world, body, pieces, 9, &count));
    REFUSED(INVALID, "out_pieces", sinew_body_get_pieces(the.world, the.body, pieces, 8, &count));
    REFUSES_NO_BODY(sinew_body_get_max_counts(world, body, &pieces[0], &pieces[1]));
    REFUSES_NO_BODY(sinew_body_get_node_mass(world, body, 0, &out.force[0]));
    REFUSED(INVALID, "node", sinew_body_get_node_mass(the.world, the.body, 9, &out.force[0]));
    REFUSED(INVALID, "out", sinew_body_get_node_mass(the.world, the.body, 0, NULL));
}

static void blades(void)
{
    static const float upright[] = {0, 0, 0, 1}, nowhere[] = {0, 0, 0, 0}, place[] = {1, 2, 3};
    const sinew_blade_id none = {0, 0};
    sinew_blade_id blade = none, gone = none;
    sinew_blade_def usual;
    sinew_blade_report report;
    int i;
    MUST(sinew_blade_def_init(&usual, sizeof usual));
    REFUSED(INVALID, "def", sinew_blade_def_init(NULL, sizeof usual));
    REFUSED(INVALID, "edge", sinew_blade_create(the.world, &usual, &blade)); /* no default */
    usual.edge[5] = 1;
    REFUSED(INVALID, "world", sinew_blade_create(NULL, &usual, &blade));
    REFUSED(INVALID, "def", sinew_blade_create(the.world, NULL, &blade));
    REFUSED(INVALID, "out", sinew_blade_create(the.world, &usual, NULL));
    for (i = 0; i < OR_ZERO; i++) {
        sinew_blade_def def = usual;
        def.stiffness = bad[i];
        REFUSED(INVALID, "stiffness", sinew_blade_create(the.world, &def, &blade));
    }
    for (i = 0; i < NOT_FINITE; i++) {
        sinew_blade_def def = usual;
        def.edge[4] = bad[i];
        REFUSED(INVALID, "edge", sinew_blade_create(the.world, &def, &blade));
        def = usual;
        def.position[1] = bad[i];
        REFUSED(INVALID, "position", sinew_blade_create(the.world, &def, &blade));
    }
    CHECK(blade.index1 == 0 && blade.generation == 0);
    MUST(sinew_blade_create(the.world, &usual, &gone));
    MUST(sinew_blade_destroy(the.world, gone));
    MUST(sinew_blade_create(the.world, &usual, &blade));
    MUST(sinew_world_get_state_hash(the.world, &the.hash));
    report.struct_size = sizeof report;
    REFUSED(STALE, "blade", sinew_blade_set_pose(the.world, gone, place, NULL));
    REFUSED(STALE, "blade", sinew_blade_set_pose(the.world, none, place, NULL));
    REFUSED(STALE, "blade", sinew_blade_get_report(the.world, gone, &report));
    REFUSED(STALE, "blade", sinew_blade_destroy(the.world, gone));
    REFUSED(INVALID, "world", sinew_blade_set_pose(NULL, blade, place, NULL));
    REFUSED(INVALID, "world", sinew_blade_get_report(NULL, blade, &report));
    REFUSED(INVALID, "world", sinew_blade_destroy(NULL, blade));
    REFUSED(INVALID, "position", sinew_blade_set_pose(the.world, blade, NULL, upright));
    REFUSED(INVALID, "orientation", sinew_blade_set_pose(the.world, blade, place, nowhere));
    REFUSED(INVALID, "out", sinew_blade_get_report(the.world, blade, NULL));
    report.struct_size = 1;
    REFUSED(INVALID, "out", sinew_blade_get_report(the.world, blade, &report));
}

int main(void)
{
    set_up();
    cuts();
    reports();
    blades();
    return tear_down();
}
