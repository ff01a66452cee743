/* What is refused of contact: meshes that cannot be tools, what tools and bodies ask of it, and where its results would go. */
#include "refusals.h"

/* A tetrahedron, outward. */
static const float four_nodes[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
static const uint32_t four_triangles[] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
static const uint32_t inward[] = {0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2};

/* The same and one that passes through it. */
static const float eight_nodes[] = {0,    0,    0,    1,    0,    0,    0,    1,    0,    0,    0,    1,
                                    0.2f, 0.2f, 0.2f, 1.2f, 0.2f, 0.2f, 0.2f, 1.2f, 0.2f, 0.2f, 0.2f, 1.2f};
static const uint32_t eight_triangles[] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3, 4, 6, 5, 4, 5, 7, 4, 7, 6, 5, 6, 7};

static sinew_tool_def mesh_tool(uint32_t detection)
{
    sinew_tool_def def;
    MUST(sinew_tool_def_init(&def, sizeof def));
    def.shape = SINEW_SHAPE_MESH;
    def.detection = detection;
    def.positions = four_nodes;
    def.node_count = 4;
    def.triangles = four_triangles;
    def.triangle_count = 4;
    def.position[1] = 5.0f;
    return def;
}

static sinew_body_def cloth_def(void)
{
    sinew_body_def def;
    MUST(sinew_body_def_init(&def, sizeof def));
    def.positions = four_nodes;
    def.node_count = 4;
    def.node_mass = 0.1f;
    def.stiffness = 10.0f;
    def.triangles = four_triangles;
    def.triangle_count = 4;
    return def;
}

/* Whatever finds it. */
#define TOOL(status, word, change)                                             \
    do {                                                                       \
        uint32_t way_;                                                         \
        for (way_ = SINEW_DETECTION_EXACT; way_ <= SINEW_DETECTION_DISTANCE_FIELD; way_++) { \
            sinew_tool_def def = mesh_tool(way_);                              \
            change;                                                            \
            REFUSED_WITH(status, word, sinew_tool_create(the.world, &def, &out.tool), #change); \
        }                                                                      \
    } while (0)
#define BODY(status, word, change)                                             \
    do {                                                                       \
        sinew_body_def def = cloth_def();                                      \
        change;                                                                \
        REFUSED_WITH(status, word, sinew_body_create(the.world, &def, &out.body), #change); \
    } while (0)

/* The definitions that the cases spoil are good, and so is what lies at the end of a range. */
static void unspoiled(void)
{
    sinew_world_def world_def;
    sinew_world *world = NULL;
    sinew_body_def body_def = cloth_def();
    sinew_tool_id tool;
    sinew_body_id body;
    uint32_t way;
    MUST(sinew_world_def_init(&world_def, sizeof world_def));
    MUST(sinew_world_create(&world_def, &world));
    for (way = SINEW_DETECTION_EXACT; way <= SINEW_DETECTION_DISTANCE_FIELD; way++) {
        sinew_tool_def def = mesh_tool(way);
        MUST(sinew_tool_create(world, &def, &tool));
        def.force_limit = 0.0f;
        def.collision_category = def.collision_mask = 0;
        MUST(sinew_tool_create(world, &def, &tool));
    }
    MUST(sinew_body_create(world, &body_def, &body));
    body_def.meets_bodies = body_def.meets_itself = 1;
    body_def.contact_thickness = 0.01f;
    body_def.contact_friction = 0.3f;
    body_def.collision_category = body_def.collision_mask = 0;
    MUST(sinew_body_create(world, &body_def, &body));
    sinew_world_destroy(world);
}

static void meshes(void)
{
    size_t i, axis;
    TOOL(INVALID, "positions", def.positions = NULL);
    TOOL(INVALID, "triangles", def.triangles = NULL);
    TOOL(INVALID, "positions", def.node_count = SIZE_MAX);
    TOOL(INVALID, "triangles", def.triangle_count = SIZE_MAX);
    TOOL(INVALID, "triangles", def.triangle_count = 0);
    TOOL(INVALID, "triangles", def.triangles = NULL; def.triangle_count = 0);
    TOOL(INVALID, "triangle", def.node_count = 3);
    TOOL(INVALID, "triangle", def.triangles = renumbered(four_triangles, 12, 11, 4));
    TOOL(INVALID, "triangle", def.triangles = renumbered(four_triangles, 12, 0, UINT32_MAX));
    TOOL(INVALID, "area", def.triangles = renumbered(four_triangles, 12, 1, 0));
    TOOL(INVALID, "closed", def.triangle_count = 3);
    TOOL(INVALID, "closed", def.triangles = renumbered(four_triangles, 12, 11, 0));
    TOOL(INVALID, "inward", def.triangles = inward);
    TOOL(INVALID, "through", def.positions = eight_nodes; def.node_count = 8; def.triangles = eight_triangles; def.triangle_count = 8);
    for (i = 0; i < NOT_FINITE; i++)
        for (axis = 0; axis < 3; axis++)
            TOOL(INVALID, "position", def.positions = spoiled(four_nodes, 12, 9 + axis, bad[i]));
}

static void what_they_ask(void)
{
    int i;
    TOOL(INVALID, "detection", def.detection = 3);
    TOOL(INVALID, "reserved", def.reserved = 1);
    for (i = 0; i < OR_NEGATIVE; i++) {
        TOOL(INVALID, "resolution", def.resolution = bad[i]);
        TOOL(INVALID, "friction", def.friction = bad[i]);
        BODY(INVALID, "contact_thickness", def.contact_thickness = bad[i]);
        BODY(INVALID, "contact_friction", def.contact_friction = bad[i]);
        BODY(INVALID, "contact_resolution", def.contact_resolution = bad[i]);
        if (i != 1) /* infinity: no limit */
            TOOL(INVALID, "force_limit", def.force_limit = bad[i]);
    }
    BODY(INVALID, "meets_bodies", def.meets_bodies = 2);
    BODY(INVALID, "meets_itself", def.meets_itself = UINT32_MAX);
    BODY(INVALID, "contact_detection", def.contact_detection = 3);
    BODY(UNSUPPORTED, "contact_detection", def.contact_detection = SINEW_DETECTION_DISTANCE_FIELD);
}

/* A tool of the world is kinematic, a sphere. */
static void rigid_bodies(void)
{
    sinew_mass_properties mass;
    const float three[3] = {0, 1, 0};
    int i;
    mass.struct_size = sizeof mass;
    REFUSES_NO_TOOL(sinew_tool_get_mass_of_density(world, tool, 1.0f, &mass));
    REFUSED(INVALID, "out", sinew_tool_get_mass_of_density(the.world, the.tool, 1.0f, NULL));
    REFUSES_NO_TOOL(sinew_tool_get_mass(world, tool, &mass));
    REFUSED(INVALID, "out", sinew_tool_get_mass(the.world, the.tool, NULL));
    MUST(sinew_tool_get_mass_of_density(the.world, the.tool, 1000.0f, &mass));
    REFUSES_NO_TOOL(sinew_tool_set_mass(world, tool, &mass));
    REFUSES_NO_TOOL(sinew_tool_teleport(world, tool, three, NULL));
    REFUSED(INVALID, "position", sinew_tool_teleport(the.world, the.tool, NULL, NULL));
    REFUSES_NO_TOOL(sinew_tool_set_velocity(world, tool, three, three));
    REFUSED(INVALID, "velocity", sinew_tool_set_velocity(the.world, the.tool, NULL, three));
    REFUSED(INVALID, "angular_velocity", sinew_tool_set_velocity(the.world, the.tool, three, NULL));
    REFUSED(INVALID, "kinematic", sinew_tool_set_velocity(the.world, the.tool, three, three));
    REFUSES_NO_TOOL(sinew_tool_get_velocity(world, tool, out.force, out.torque));
    REFUSED(INVALID, "kinematic", sinew_tool_get_velocity(the.world, the.tool, out.force, out.torque));
    REFUSES_NO_TOOL(sinew_tool_apply_wrench(world, tool, three, three));
    REFUSED(INVALID, "force", sinew_tool_apply_wrench(the.world, the.tool, NULL, three));
    REFUSED(INVALID, "torque", sinew_tool_apply_wrench(the.world, the.tool, three, NULL));
    REFUSED(INVALID, "kinematic", sinew_tool_apply_wrench(the.world, the.tool, three, three));
    for (i = 0; i < OR_NEGATIVE; i++) {
        sinew_mass_properties bad_mass = mass;
        bad_mass.mass = bad[i];
        REFUSED(INVALID, "mass", sinew_tool_set_mass(the.world, the.tool, &bad_mass));
        REFUSED(INVALID, "density", sinew_tool_get_mass_of_density(the.world, the.tool, bad[i], &mass));
    }
    for (i = 0; i < NOT_FINITE; i++) {
        sinew_mass_properties bad_mass = mass;
        bad_mass.inertia[4] = bad[i];
        REFUSED(INVALID, "inertia", sinew_tool_set_mass(the.world, the.tool, &bad_mass));
        bad_mass = mass;
        bad_mass.center_of_mass[1] = bad[i];
        REFUSED(INVALID, "center_of_mass", sinew_tool_set_mass(the.world, the.tool, &bad_mass));
    }
    mass.struct_size = 4;
    REFUSED(INVALID, "struct_size", sinew_tool_set_mass(the.world, the.tool, &mass));
}

static void results(void)
{
    sinew_body_contact_change pairs[1];
    REFUSES_NO_TOOL(sinew_tool_get_contacts(world, tool, out.contacts, 2, &out.count));
    REFUSED(INVALID, "out_contacts", sinew_tool_get_contacts(the.world, the.tool, NULL, 2, &out.count));
    REFUSED(INVALID, "out_contacts", sinew_tool_get_contacts(the.world, the.tool, out.contacts, SIZE_MAX, &out.count));
    REFUSED(INVALID, "out_count", sinew_tool_get_contacts(the.world, the.tool, out.contacts, 2, NULL));
    REFUSED(INVALID, "world", sinew_world_get_body_contact_changes(NULL, pairs, 1, &out.count));
    REFUSED(INVALID, "out_changes", sinew_world_get_body_contact_changes(the.world, NULL, 1, &out.count));
    REFUSED(INVALID, "out_count", sinew_world_get_body_contact_changes(the.world, pairs, 1, NULL));
    REFUSED(INVALID, "world", sinew_world_get_contact_changes(NULL, out.changes, 2, &out.count));
    REFUSED(INVALID, "out_changes", sinew_world_get_contact_changes(the.world, NULL, 2, &out.count));
    REFUSED(INVALID, "out_changes", sinew_world_get_contact_changes(the.world, out.changes, SIZE_MAX, &out.count));
    REFUSED(INVALID, "out_count", sinew_world_get_contact_changes(the.world, out.changes, 2, NULL));
    REFUSES_NO_TOOL(sinew_tool_get_pose(world, tool, out.position, out.orientation));
    REFUSES_NO_BODY(sinew_body_is_closed(world, body, &out.closed));
    rigid_bodies();
    REFUSED(INVALID, "out", sinew_body_is_closed(the.world, the.body, NULL));
}

static void what_changes_while_it_runs(void)
{
    REFUSES_NO_BODY(sinew_body_set_collision(world, body, 1, 1));
    REFUSES_NO_TOOL(sinew_tool_set_collision(world, tool, 1, 1));
    REFUSES_NO_TOOL(sinew_tool_set_friction(world, tool, 0.5f));
    REFUSES_NO_TOOL(sinew_tool_set_force_limit(world, tool, 0.5f));
    REFUSED(INVALID, "friction", sinew_tool_set_friction(the.world, the.tool, -1.0f));
    REFUSED(INVALID, "friction", sinew_tool_set_friction(the.world, the.tool, NAN));
    REFUSED(INVALID, "force_limit", sinew_tool_set_force_limit(the.world, the.tool, -1.0f));
    REFUSED(INVALID, "force_limit", sinew_tool_set_force_limit(the.world, the.tool, NAN));
}

int main(void)
{
    set_up();
    unspoiled();
    meshes();
    what_they_ask();
    results();
    what_changes_while_it_runs();
    return tear_down();
}
