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
    REFUSED(INVALID, "report", sinew_body_cut(the.world, the.body, start, end, &small));
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
    REFUSED(INVALID, "pieces", sinew_body_get_pieces(the.world, the.body, pieces, 8, &count));
    REFUSES_NO_BODY(sinew_body_get_node_mass(world, body, 0, &out.force[0]));
    REFUSED(INVALID, "node", sinew_body_get_node_mass(the.world, the.body, 9, &out.force[0]));
    REFUSED(INVALID, "out", sinew_body_get_node_mass(the.world, the.body, 0, NULL));
}

int main(void)
{
    set_up();
    cuts();
    reports();
    return tear_down();
}
