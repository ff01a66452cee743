/* What two bodies have in common, as a detector finds it: volumes, depths and places that are known, in both forms and exactly; what is
 * open or was cut; what is refused. */
#include "scene.h"

enum { CORNERS = 8, FACES = 12 };

static const float PIXEL = 3e-4f;

/* Outward; corner i lies high along x, y and z by its bits 1, 2 and 4. */
static const uint32_t box_triangles[3 * FACES] = {0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4,
                                                  2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6};

/* A decimetre from the origin on, and what reaches 2 cm into it from high x on, wider than it. */
static const float cube_low[3] = {0, 0, 0}, cube_high[3] = {0.1f, 0.1f, 0.1f};
static const float wall_low[3] = {0.08f, -0.05f, -0.03f}, wall_high[3] = {0.28f, 0.15f, 0.13f};

/* Through the cube along z. */
static const float rod_low[3] = {0.03f, 0.06f, -0.1f}, rod_high[3] = {0.05f, 0.08f, 0.2f};

/* The same, inward. */
static const uint32_t box_inside_out[3 * FACES] = {0, 6, 4, 0, 2, 6, 1, 7, 3, 1, 5, 7, 0, 5, 1, 0, 4, 5,
                                                   2, 7, 6, 2, 3, 7, 0, 3, 2, 0, 1, 3, 4, 7, 5, 4, 6, 7};

static void corners_of(const float low[3], const float high[3], float *corners)
{
    int corner, axis;
    for (corner = 0; corner < CORNERS; corner++)
        for (axis = 0; axis < 3; axis++)
            corners[3 * corner + axis] = (corner >> axis & 1) ? high[axis] : low[axis];
}

static sinew_body_id a_surface(sinew_world *world, const float *nodes, size_t node_count, const uint32_t *triangles,
                               size_t triangle_count)
{
    sinew_body_def def;
    sinew_body_id body = {0, 0};
    MUST(sinew_body_def_init(&def, sizeof def));
    def.positions = nodes;
    def.node_count = node_count;
    def.node_mass = 0.1f;
    def.stiffness = 10.0f;
    def.triangles = triangles;
    def.triangle_count = triangle_count;
    def.spare_nodes = 40;
    MUST(sinew_body_create(world, &def, &body));
    return body;
}

static sinew_body_id a_box(sinew_world *world, const float low[3], const float high[3])
{
    float corners[3 * CORNERS];
    corners_of(low, high, corners);
    return a_surface(world, corners, CORNERS, box_triangles, FACES);
}

/* A sheet of two triangles in the plane x = 0.05 m, one of its corners in the cube. */
static sinew_body_id a_sheet(sinew_world *world)
{
    static const float nodes[12] = {0.05f, 0.02f, 0.03f, 0.05f, 0.2f, 0.03f, 0.05f, 0.2f, 0.24f, 0.05f, 0.02f, 0.24f};
    static const uint32_t triangles[6] = {0, 1, 2, 0, 2, 3};
    return a_surface(world, nodes, 4, triangles, 2);
}

static sinew_detector_def of(sinew_body_id first, sinew_body_id second, uint32_t detection)
{
    sinew_detector_def def;
    MUST(sinew_detector_def_init(&def, sizeof def));
    def.bodies[0] = first;
    def.bodies[1] = second;
    def.detection = detection;
    def.pixel = PIXEL;
    return def;
}

static sinew_detector *made(const sinew_world *world, const sinew_detector_def *def)
{
    sinew_detector *detector = NULL;
    MUST(sinew_detector_create(world, def, &detector));
    return detector;
}

static sinew_detector_report found(sinew_detector *detector, const sinew_world *world)
{
    sinew_detector_report report;
    report.struct_size = sizeof report;
    MUST(sinew_detector_find(detector, world, &report));
    return report;
}

static const sinew_point_inside *points_of(const sinew_detector *detector, uint32_t side, size_t expected)
{
    const sinew_point_inside *points = NULL;
    size_t count = SIZE_MAX;
    MUST(sinew_detector_get_points(detector, side, &points, &count));
    CHECK(count == expected);
    return points;
}

static const sinew_edge_inside *edges_of(const sinew_detector *detector, uint32_t side, size_t expected)
{
    const sinew_edge_inside *edges = NULL;
    size_t count = SIZE_MAX;
    MUST(sinew_detector_get_edges(detector, side, &edges, &count));
    CHECK(count == expected);
    return edges;
}

/* What the volume changes by where all nodes of a body are moved. */
static void sum_of_gradient(const sinew_detector *detector, uint32_t side, size_t expected_count, double sum[3])
{
    sinew_dvec3_view view;
    size_t node;
    int axis;
    MUST(sinew_detector_get_gradient(detector, side, &view));
    CHECK(view.count == expected_count);
    sum[0] = sum[1] = sum[2] = 0;
    for (node = 0; node < view.count; node++)
        for (axis = 0; axis < 3; axis++)
            sum[axis] += ((const double *)(const void *)((const char *)view.data + node * view.stride))[axis];
}

/* Those of the cube that lie in the wall: the four corners at high x, the edges between them, and what of the others is beyond 0.08 m. */
static void check_the_cubes(const sinew_detector *detector, double depth_error, double place_error)
{
    const sinew_point_inside *points = points_of(detector, 0, 4);
    const sinew_edge_inside *edges = edges_of(detector, 0, 13);
    int i;
    for (i = 0; i < 4; i++) {
        CHECK(points[i].node == (uint32_t)(2 * i + 1));
        CHECK_NEAR(points[i].depth, 0.02, depth_error);
    }
    for (i = 0; i < 13; i++) {
        /* How far along x: from 0 to 1. */
        const double from = edges[i].nodes[0] & 1, to = edges[i].nodes[1] & 1;
        CHECK(edges[i].nodes[0] < CORNERS && edges[i].nodes[1] < CORNERS && from + to > 0);
        CHECK_NEAR(edges[i].entry, from < to ? 0.8 : 0.0, place_error);
        CHECK_NEAR(edges[i].exit, from > to ? 0.2 : 1.0, place_error);
    }
    /* Of the wall the diagonal of its face: through the cube from y = 0 to 0.1. */
    edges = edges_of(detector, 1, 1);
    CHECK_NEAR(edges[0].entry, 0.25, place_error);
    CHECK_NEAR(edges[0].exit, 0.75, place_error);
    points_of(detector, 1, 0);
}

static void boxes_have_a_volume_in_common(void)
{
    sinew_world *world = a_world(0.0f);
    const sinew_body_id cube = a_box(world, cube_low, cube_high), wall = a_box(world, wall_low, wall_high);
    sinew_detector_def def = of(cube, wall, SINEW_DETECTION_IMAGE_SPACE);
    sinew_detector *detector = made(world, &def);
    sinew_detector_report report;
    sinew_dvec3_view gradient;
    float corners[3 * CORNERS];
    double sum[3], before;
    int i;
    points_of(detector, 0, 0);
    edges_of(detector, 1, 0);
    sum_of_gradient(detector, 0, 0, sum);

    report = found(detector, world);
    /* A pixel more or less along each side of what is seen: 2 x 10 cm of 3 views. */
    CHECK_NEAR(report.volume, 0.02 * 0.1 * 0.1, 2e-4 * (PIXEL / 0.02 + 2 * PIXEL / 0.1));
    CHECK_NEAR(report.normal[0], -1.0, 1e-6);
    CHECK_NEAR(report.normal[1], 0.0, 1e-6);
    CHECK_NEAR(report.normal[2], 0.0, 1e-6);
    CHECK_NEAR(report.depth, 0.02, PIXEL);
    CHECK(report.pixel == PIXEL && report.is_closed[0] == 1 && report.is_closed[1] == 1);
    CHECK(report.point_counts[0] == 4 && report.point_counts[1] == 0);
    CHECK(report.edge_counts[0] == 13 && report.edge_counts[1] == 1);
    CHECK(report.unlisted[0] == 0 && report.unlisted[1] == 0 && report.struct_size == sizeof report);
    check_the_cubes(detector, 1e-6, 2 * PIXEL / 0.1);
    for (i = 0; i < 4; i++) /* Out through the wall's face at low x. */
        CHECK(points_of(detector, 0, 4)[i].triangle < 2);
    CHECK_NEAR(edges_of(detector, 1, 1)->depth, 0.02, 1e-6);
    for (i = 0; i < 2; i++) {
        sum_of_gradient(detector, (uint32_t)i, CORNERS, sum);
        CHECK_NEAR(sum[0], i == 0 ? 0.01 : -0.01, 0.01 * 4 * PIXEL / 0.1);
        CHECK_NEAR(sum[1], 0.0, 1e-12);
        CHECK_NEAR(sum[2], 0.0, 1e-12);
    }
    MUST(sinew_detector_get_gradient(detector, 0, &gradient));
    CHECK(gradient.data[0] == 0.0); /* The cube's face at low x bounds nothing. */

    /* It changes as its gradient says. */
    before = report.volume;
    corners_of(cube_low, cube_high, corners);
    for (i = 0; i < CORNERS; i++)
        corners[3 * i] -= 0.005f;
    MUST(sinew_body_set_positions(world, cube, corners, CORNERS));
    report = found(detector, world);
    CHECK_NEAR(before - report.volume, 0.01 * 0.005, 0.01 * 3 * PIXEL);
    CHECK_NEAR(report.depth, 0.015, PIXEL);
    /* And is gone where they are apart. */
    for (i = 0; i < CORNERS; i++)
        corners[3 * i] -= 0.02f;
    MUST(sinew_body_set_positions(world, cube, corners, CORNERS));
    report = found(detector, world);
    CHECK(report.volume == 0.0 && report.depth == 0.0f && report.normal[0] == 0.0f);
    points_of(detector, 0, 0);
    edges_of(detector, 0, 0);
    edges_of(detector, 1, 0);
    sum_of_gradient(detector, 0, CORNERS, sum);
    CHECK(sum[0] == 0.0);

    /* 5 mm apart, they meet where they count as 3 mm larger each, along the view. */
    sinew_detector_destroy(detector);
    def.direction[0] = 0.1f;
    def.thickness[0] = def.thickness[1] = 0.003f;
    detector = made(world, &def);
    report = found(detector, world);
    CHECK(report.edge_counts[0] >= 4);
    CHECK_NEAR(report.depth, 0.001, PIXEL);
    sinew_world_destroy(world);
    sinew_detector_destroy(detector); /* It may outlive the world. */
}

static void what_is_exact_is_found_in_images_within_a_pixel(void)
{
    sinew_world *world = a_world(0.0f);
    const sinew_body_id cube = a_box(world, cube_low, cube_high), wall = a_box(world, wall_low, wall_high);
    const sinew_detector_def def = of(cube, wall, SINEW_DETECTION_EXACT);
    sinew_detector *detector = made(world, &def);
    const sinew_detector_report report = found(detector, world);
    double sum[3];
    int i;
    check_the_cubes(detector, 1e-7, 1e-6);
    CHECK(report.point_counts[0] == 4 && report.edge_counts[0] == 13 && report.edge_counts[1] == 1);
    for (i = 0; i < 4; i++) {
        const sinew_point_inside *point = &points_of(detector, 0, 4)[i];
        CHECK(point->triangle == SINEW_NO_TRIANGLE);
        CHECK_NEAR(point->normal[0], -1.0, 1e-6);
    }
    CHECK(report.volume == 0.0 && report.depth == 0.0f && report.pixel == 0.0f);
    CHECK(report.is_closed[0] == 1 && report.is_closed[1] == 1);
    sum_of_gradient(detector, 0, 0, sum);
    sinew_detector_destroy(detector);
    sinew_world_destroy(world);
}

static void edges_that_point_at_the_viewer_are_missed_where_edges_are_drawn(void)
{
    static const struct {
        uint32_t form;
        float direction[3];
        size_t found; /* at least; of two that are drawn into the same pixels only the nearer */
    } ways[] = {
        {SINEW_IMAGE_FORM_COUNTED, {0, 0, 1}, 0},
        {SINEW_IMAGE_FORM_COUNTED, {0, 0, -7}, 0},
        {SINEW_IMAGE_FORM_COUNTED, {1, 0, 0}, 2},
        {SINEW_IMAGE_FORM_COUNTED, {0, 0, 0}, 3},
        {SINEW_IMAGE_FORM_INTERVALS, {0, 0, 1}, 4},
        {SINEW_IMAGE_FORM_INTERVALS, {0, 0, 0}, 4},
    };
    sinew_world *world = a_world(0.0f);
    const sinew_body_id cube = a_box(world, cube_low, cube_high), rod = a_box(world, rod_low, rod_high);
    size_t way;
    for (way = 0; way < sizeof ways / sizeof *ways; way++) {
        sinew_detector_def def = of(cube, rod, SINEW_DETECTION_IMAGE_SPACE);
        sinew_detector *detector;
        sinew_detector_report report;
        const sinew_edge_inside *edges;
        size_t i, along = 0;
        double sum[3];
        def.form = ways[way].form;
        memcpy(def.direction, ways[way].direction, sizeof def.direction);
        detector = made(world, &def);
        report = found(detector, world);
        edges = edges_of(detector, 1, report.edge_counts[1]);
        CHECK(report.edge_counts[0] == 0);
        for (i = 0; i < report.edge_counts[1]; i++) {
            const uint32_t nodes = edges[i].nodes[0] ^ edges[i].nodes[1];
            CHECK_NEAR(edges[i].entry, 1.0 / 3, 2 * PIXEL / 0.3);
            CHECK_NEAR(edges[i].exit, 2.0 / 3, 2 * PIXEL / 0.3);
            along += nodes == 4;
        }
        if (ways[way].found == 0)
            CHECK(report.edge_counts[1] == 0);
        CHECK(along >= ways[way].found);
        if (def.form == SINEW_IMAGE_FORM_COUNTED) {
            CHECK(report.volume == 0.0 && report.point_counts[0] == 0 && report.point_counts[1] == 0);
            sum_of_gradient(detector, 1, 0, sum);
        } else {
            CHECK_NEAR(report.volume, 0.02 * 0.02 * 0.1, 4e-5 * (4 * PIXEL / 0.02));
        }
        sinew_detector_destroy(detector);
    }
    sinew_world_destroy(world);
}

static void an_open_body_gives_edges_alone(void)
{
    sinew_world *world = a_world(0.0f);
    const sinew_body_id sheet = a_sheet(world), cube = a_box(world, cube_low, cube_high);
    sinew_detector_def def = of(sheet, cube, SINEW_DETECTION_IMAGE_SPACE);
    sinew_detector *detector = made(world, &def);
    sinew_detector_report report = found(detector, world);
    const sinew_point_inside *point;
    double sum[3];
    CHECK(report.is_closed[0] == 0 && report.is_closed[1] == 1);
    CHECK(report.volume == 0.0 && report.point_counts[0] == 0 && report.point_counts[1] == 0);
    /* Two sides and the diagonal, from the corner that is inside. */
    CHECK(report.edge_counts[0] == 3 && report.edge_counts[1] == 0);
    CHECK(edges_of(detector, 0, 3)->nodes[0] == 0 && edges_of(detector, 0, 3)->entry == 0.0f);
    CHECK_NEAR(edges_of(detector, 0, 3)->exit, 0.08 / 0.18, PIXEL / 0.18);
    sum_of_gradient(detector, 0, 0, sum);
    sinew_detector_destroy(detector);

    def.detection = SINEW_DETECTION_EXACT;
    detector = made(world, &def);
    report = found(detector, world);
    CHECK(report.is_closed[0] == 0 && report.is_closed[1] == 1);
    CHECK(report.edge_counts[0] == 3 && report.edge_counts[1] == 0 && report.point_counts[1] == 0);
    point = points_of(detector, 0, 1);
    CHECK(point->node == 0);
    CHECK_NEAR(point->depth, 0.02, 1e-7);
    CHECK_NEAR(point->normal[1], -1.0, 1e-6);
    sinew_detector_destroy(detector);
    sinew_world_destroy(world);
}

static void nothing_is_within_what_was_cut_open(void)
{
    uint32_t detection;
    for (detection = SINEW_DETECTION_EXACT; detection <= SINEW_DETECTION_IMAGE_SPACE; detection++) {
        sinew_world *world = a_world(0.0f);
        const sinew_body_id cube = a_box(world, cube_low, cube_high), wall = a_box(world, wall_low, wall_high);
        const sinew_detector_def def = of(cube, wall, detection);
        sinew_detector *detector = made(world, &def), *other = NULL;
        sinew_detector_report report = found(detector, world);
        uint32_t closed = 1;
        double sum[3];
        CHECK(report.is_closed[0] == 1 && report.is_closed[1] == 1 && report.edge_counts[1] == 1);
        MUST(sinew_body_remove_spring(world, cube, 0, 1));
        MUST(sinew_body_is_closed(world, cube, &closed));
        CHECK(closed == 0);
        report = found(detector, world);
        CHECK(report.is_closed[0] == 0 && report.is_closed[1] == 1);
        CHECK(report.edge_counts[0] == 13 && report.edge_counts[1] == 0 && report.volume == 0.0);
        CHECK(report.point_counts[0] == (detection == SINEW_DETECTION_EXACT ? 4u : 0u));
        sum_of_gradient(detector, 1, 0, sum);
        MUST(sinew_body_remove_spring(world, wall, 2, 3));
        report = found(detector, world);
        CHECK(report.is_closed[0] == 0 && report.is_closed[1] == 0);
        CHECK(report.edge_counts[0] == 0 && report.edge_counts[1] == 0 && report.point_counts[0] == 0);
        CHECK(sinew_detector_create(world, &def, &other) == SINEW_STATUS_INVALID_ARGUMENT && other == NULL);
        sinew_detector_destroy(detector);
        sinew_world_destroy(world);
    }
}

static void pixels_grow_where_there_is_no_room_for_them(void)
{
    sinew_world *world = a_world(0.0f);
    const sinew_body_id cube = a_box(world, cube_low, cube_high), wall = a_box(world, wall_low, wall_high);
    sinew_detector_def def = of(cube, wall, SINEW_DETECTION_IMAGE_SPACE);
    sinew_detector *detector;
    sinew_detector_report report;
    def.pixels = 30000; /* 112 944 were needed */
    detector = made(world, &def);
    report = found(detector, world);
    CHECK(report.pixel == 2 * PIXEL);
    CHECK_NEAR(report.volume, 2e-4, 2e-4 * (2 * PIXEL / 0.02 + 4 * PIXEL / 0.1));
    sinew_detector_destroy(detector);
    sinew_world_destroy(world);
}

#define REFUSED(status, word, call)                                            \
    do {                                                                       \
        char message_[512];                                                    \
        sinew_world_create(NULL, NULL);                                        \
        CHECK((call) == (status));                                             \
        sinew_last_error(message_, sizeof message_);                           \
        if (strstr(message_, (word)) == NULL) {                                \
            failures++;                                                        \
            fprintf(stderr, "%s:%d: not about %s: %s\n", __FILE__, __LINE__, (word), message_); \
        }                                                                      \
    } while (0)
#define INVALID SINEW_STATUS_INVALID_ARGUMENT

#define REFUSED_DEF(status, word, change)                                      \
    do {                                                                       \
        sinew_detector_def def = of(cube, wall, SINEW_DETECTION_IMAGE_SPACE);  \
        sinew_detector *out = NULL;                                            \
        change;                                                                \
        REFUSED(status, word, sinew_detector_create(world, &def, &out));       \
        CHECK(out == NULL);                                                    \
    } while (0)

static void a_definition_is_refused_by_name(void)
{
    sinew_world *world = a_world(0.0f);
    const sinew_body_id cube = a_box(world, cube_low, cube_high), wall = a_box(world, wall_low, wall_high);
    const sinew_body_id sheet = a_sheet(world), bare = loose_nodes(world, 2), none = {0, 0};
    sinew_body_id inside_out;
    float corners[3 * CORNERS];
    corners_of(cube_low, cube_high, corners);
    inside_out = a_surface(world, corners, CORNERS, box_inside_out, FACES);
    REFUSED_DEF(SINEW_STATUS_UNSUPPORTED, "DISTANCE_FIELD", def.detection = SINEW_DETECTION_DISTANCE_FIELD);
    REFUSED_DEF(INVALID, "detection is 9", def.detection = 9);
    REFUSED_DEF(INVALID, "form is 2", def.form = 2);
    REFUSED_DEF(INVALID, "pixel is 0:", def.pixel = 0);
    REFUSED_DEF(INVALID, "pixel is -1:", def.pixel = -1);
    REFUSED_DEF(INVALID, "pixel is NaN:", def.pixel = NAN);
    REFUSED_DEF(INVALID, "direction is", def.direction[1] = NAN);
    REFUSED_DEF(INVALID, "direction is", def.direction[2] = INFINITY);
    REFUSED_DEF(INVALID, "pixels is 0", def.pixels = 0);
    REFUSED_DEF(INVALID, "pixels is 16777217", def.pixels = (1u << 24) + 1);
    REFUSED_DEF(INVALID, "crossings is 0", def.crossings = 0);
    REFUSED_DEF(INVALID, "thickness of body 1 is -1 m", def.thickness[1] = -1);
    REFUSED_DEF(INVALID, "thickness of body 0 is inf", def.thickness[0] = INFINITY);
    REFUSED_DEF(INVALID, "thickness of body 0 is 0.5 m", (def.detection = SINEW_DETECTION_EXACT, def.thickness[0] = 0.5f));
    REFUSED_DEF(INVALID, "itself", def.bodies[1] = cube);
    REFUSED_DEF(INVALID, "body 1: triangles", def.bodies[1] = bare);
    REFUSED_DEF(INVALID, "both are open", (def.bodies[0] = sheet, def.bodies[1] = a_sheet(world)));
    REFUSED_DEF(INVALID, "body 1: ", (def.detection = SINEW_DETECTION_EXACT, def.bodies[1] = inside_out));
    REFUSED_DEF(SINEW_STATUS_STALE_ID, "body", def.bodies[0] = none);
    REFUSED_DEF(INVALID, "struct_size is 8", def.struct_size = 8);
    {
        const sinew_detector_def def = of(cube, wall, SINEW_DETECTION_EXACT);
        sinew_detector_def def_out;
        sinew_detector *out = NULL;
        REFUSED(INVALID, "world", sinew_detector_create(NULL, &def, &out));
        REFUSED(INVALID, "def", sinew_detector_create(world, NULL, &out));
        REFUSED(INVALID, "out", sinew_detector_create(world, &def, NULL));
        REFUSED(INVALID, "def", sinew_detector_def_init(NULL, sizeof def));
        REFUSED(INVALID, "struct_size is 7", sinew_detector_def_init(&def_out, 7));
        CHECK(out == NULL);
    }
    sinew_world_destroy(world);
    sinew_detector_destroy(NULL);
}

static void a_search_is_refused_and_what_was_found_stays(void)
{
    sinew_world *world = a_world(0.0f), *twin = NULL, *strange = a_world(0.0f);
    const sinew_body_id cube = a_box(world, cube_low, cube_high), wall = a_box(world, wall_low, wall_high);
    sinew_detector_def def = of(cube, wall, SINEW_DETECTION_IMAGE_SPACE);
    sinew_detector *detector = made(world, &def), *narrow;
    sinew_detector_report report, untouched;
    const sinew_point_inside *points;
    const sinew_edge_inside *edges;
    sinew_dvec3_view view;
    size_t count = 77;
    double volume, sum[3];
    const float edge[12] = {0.03f, -1, -1, 0.03f, 1, -1, 0.03f, -1, 1, 0.03f, 1, 1};
    size_t size;
    uint8_t *bytes;
    volume = found(detector, world).volume;
    MUST(sinew_world_get_snapshot_size(world, &size));
    bytes = (uint8_t *)malloc(size);
    MUST(sinew_world_save_snapshot(world, bytes, size));
    MUST(sinew_world_load_snapshot(bytes, size, NULL, &twin));
    free(bytes);
    CHECK(found(detector, twin).volume == volume); /* The same bodies in every respect. */
    a_box(strange, cube_low, cube_high);
    a_box(strange, wall_low, wall_high);

    memset(&report, 0, sizeof report);
    report.struct_size = sizeof report;
    untouched = report;
    REFUSED(INVALID, "another world", sinew_detector_find(detector, strange, &report));
    REFUSED(INVALID, "detector", sinew_detector_find(NULL, world, &report));
    REFUSED(INVALID, "world", sinew_detector_find(detector, NULL, &report));
    REFUSED(INVALID, "out_report", sinew_detector_find(detector, world, NULL));
    report.struct_size = 8;
    REFUSED(INVALID, "struct_size is 8", sinew_detector_find(detector, world, &report));
    report.struct_size = sizeof report;
    MUST(sinew_body_destroy(world, wall));
    REFUSED(INVALID, "body 1 of the detector, of index1 2", sinew_detector_find(detector, world, &report));
    CHECK(memcmp(&report, &untouched, sizeof report) == 0);
    check_the_cubes(detector, 1e-6, 2 * PIXEL / 0.1);
    sum_of_gradient(detector, 0, CORNERS, sum);
    CHECK_NEAR(sum[0], 0.01, 0.01 * 4 * PIXEL / 0.1);
    /* Nor is what came in its place the one. */
    a_box(world, wall_low, wall_high);
    REFUSED(INVALID, "destroyed", sinew_detector_find(detector, world, &report));

    points = NULL;
    edges = NULL;
    memset(&view, 0, sizeof view);
    REFUSED(INVALID, "side is 2", sinew_detector_get_points(detector, 2, &points, &count));
    REFUSED(INVALID, "side is 2", sinew_detector_get_edges(detector, 2, &edges, &count));
    REFUSED(INVALID, "side is 4294967295", sinew_detector_get_gradient(detector, UINT32_MAX, &view));
    REFUSED(INVALID, "detector", sinew_detector_get_points(NULL, 0, &points, &count));
    REFUSED(INVALID, "detector", sinew_detector_get_edges(NULL, 0, &edges, &count));
    REFUSED(INVALID, "detector", sinew_detector_get_gradient(NULL, 0, &view));
    REFUSED(INVALID, "out_points", sinew_detector_get_points(detector, 0, NULL, &count));
    REFUSED(INVALID, "out_edges", sinew_detector_get_edges(detector, 0, NULL, &count));
    REFUSED(INVALID, "out_count", sinew_detector_get_points(detector, 0, &points, NULL));
    REFUSED(INVALID, "out_count", sinew_detector_get_edges(detector, 0, &edges, NULL));
    REFUSED(INVALID, "out", sinew_detector_get_gradient(detector, 0, NULL));
    CHECK(points == NULL && edges == NULL && view.data == NULL && count == 77);

    /* Not even the image of a single pixel has room for both faces of the cube. */
    def.crossings = 1;
    narrow = made(twin, &def);
    REFUSED(SINEW_STATUS_CAPACITY, "crossings", sinew_detector_find(narrow, twin, &report));
    CHECK(memcmp(&report, &untouched, sizeof report) == 0);
    edges_of(narrow, 0, 0);
    sinew_detector_destroy(narrow);
    MUST(sinew_body_cut(twin, cube, edge, edge + 6, NULL));
    REFUSED(INVALID, "another surface", sinew_detector_find(detector, twin, &report));
    sinew_detector_destroy(detector);
    sinew_world_destroy(world);
    sinew_world_destroy(twin);
    sinew_world_destroy(strange);
}

int main(void)
{
    boxes_have_a_volume_in_common();
    what_is_exact_is_found_in_images_within_a_pixel();
    edges_that_point_at_the_viewer_are_missed_where_edges_are_drawn();
    an_open_body_gives_edges_alone();
    nothing_is_within_what_was_cut_open();
    pixels_grow_where_there_is_no_room_for_them();
    a_definition_is_refused_by_name();
    a_search_is_refused_and_what_was_found_stays();
    return checked("what two bodies have in common is found");
}
