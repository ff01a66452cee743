/* What is refused of tearing, and of what tells what tore. */
#include "refusals.h"

static const uint32_t joined[] = {0, 1}, apart[] = {0, 8};
static const float numbers[] = {0.1f};

static sinew_body_def cloth(void)
{
    static const float positions[] = {0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 1};
    static const uint32_t triangles[] = {0, 2, 1, 1, 2, 3};
    sinew_body_def def;
    MUST(sinew_body_def_init(&def, sizeof def));
    def.positions = positions;
    def.node_count = 4;
    def.node_mass = 0.1f;
    def.stiffness = 20.0f;
    def.triangles = triangles;
    def.triangle_count = 2;
    def.spare_nodes = 20;
    def.most_tears = 1;
    def.tear_strain = 0.1f;
    return def;
}

#define BODY(status, word, change)                                             \
    do {                                                                       \
        sinew_body_def def = cloth();                                          \
        change;                                                                \
        REFUSED_WITH(status, word, sinew_body_create(the.world, &def, &out.body), #change); \
    } while (0)

static void definitions(void)
{
    int i;
    for (i = 0; i < OR_NEGATIVE; i++) {
        BODY(INVALID, "tear_strain", def.tear_strain = bad[i]);
        BODY(INVALID, "tear_force", def.tear_force = bad[i]);
        BODY(INVALID, "smallest_piece", def.smallest_piece = bad[i]);
    }
    BODY(INVALID, "most_tears", def.most_tears = 0);
    BODY(INVALID, "spare_nodes", def.spare_nodes = 0);
}

/* Of cubes: they do not tear. */
static void of_cells(void)
{
    static const float corners[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1};
    static const uint32_t cell[] = {0, 1, 2, 3, 4, 5, 6, 7};
    sinew_body_def def = cloth();
    def.positions = corners;
    def.node_count = 8;
    def.triangles = NULL;
    def.triangle_count = 0;
    def.cells = cell;
    def.cell_count = 1;
    REFUSED_WITH(UNSUPPORTED, "most_tears", sinew_body_create(the.world, &def, &out.body), "cells");
}

static void calls(void)
{
    sinew_tear_report report;
    report.struct_size = sizeof report;
    REFUSES_NO_BODY(sinew_body_get_tear_report(world, body, &report));
    REFUSED(INVALID, "out", sinew_body_get_tear_report(the.world, the.body, NULL));
    report.struct_size = 1;
    REFUSED(INVALID, "out", sinew_body_get_tear_report(the.world, the.body, &report));
    REFUSES_NO_BODY(sinew_body_get_tear_limits(world, body, joined, 1, out.numbers[0], NULL));
    REFUSED(UNSUPPORTED, "most_tears", sinew_body_get_tear_limits(the.world, the.body, joined, 1, out.numbers[0], NULL));
    REFUSED(INVALID, "pairs", sinew_body_get_tear_limits(the.world, the.body, NULL, 1, NULL, out.numbers[0]));
    REFUSED(INVALID, "pairs[0]", sinew_body_get_tear_limits(the.world, the.body, apart, 1, NULL, out.numbers[0]));
    REFUSES_NO_BODY(sinew_body_set_tear_limits(world, body, joined, numbers, NULL, 1));
    REFUSED(UNSUPPORTED, "most_tears", sinew_body_set_tear_limits(the.world, the.body, joined, numbers, NULL, 1));
    REFUSED(INVALID, "pairs", sinew_body_set_tear_limits(the.world, the.body, NULL, numbers, NULL, 1));
    REFUSED(INVALID, "pairs[0]", sinew_body_set_tear_limits(the.world, the.body, apart, numbers, NULL, 1));
    REFUSED(INVALID, "strains[0]", sinew_body_set_tear_limits(the.world, the.body, joined, bad, NULL, 1));
    REFUSED(INVALID, "forces[0]", sinew_body_set_tear_limits(the.world, the.body, joined, NULL, bad, 1));
}

int main(void)
{
    set_up();
    definitions();
    of_cells();
    calls();
    return tear_down();
}
