/* Contact as C programs see it: meshes as tools by each way of detection, where they press, what began and ceased to touch, where a
 * tool is, what its force may be, what meets what, and bodies that meet each other. */
#include "contract.h"
#include "scene.h"

enum { CUBE_NODES = 8, CUBE_TRIANGLES = 12 };
static const float half = 0.06f; /* m: of the cube's side, wider than the cloth and the blocks */
static const double cloth_weight = CLOTH_NODES * 1e-3 * 10;

/* The cube's corner i is at +half where i has the bit of the axis; its triangles look outward. */
static const uint32_t cube_triangles[3 * CUBE_TRIANGLES] = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                                            2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};

/* Where a tool's definition ended in 0.1, before it had a resolution, and a body's, before it had a thickness. */
enum { OLD_TOOL = sizeof(contract_tool_def), OLD_BODY = sizeof(contract_body_def) };

static sinew_tool_def cube_def(size_t size, uint32_t detection, float y)
{
    static float positions[3 * CUBE_NODES];
    sinew_tool_def def;
    uint32_t i;
    for (i = 0; i < 3 * CUBE_NODES; i++)
        positions[i] = i / 3 >> i % 3 & 1 ? half : -half;
    memset(&def, 0xA5, sizeof def);
    MUST(sinew_tool_def_init(&def, size));
    CHECK(def.struct_size == size);
    def.shape = SINEW_SHAPE_MESH;
    def.positions = positions;
    def.node_count = CUBE_NODES;
    def.triangles = cube_triangles;
    def.triangle_count = CUBE_TRIANGLES;
    def.detection = detection;
    def.position[1] = y;
    if (size == sizeof def) {
        CHECK(def.resolution == 0.0f && def.force_limit == INFINITY && def.collision_category == 1 && def.collision_mask == UINT32_MAX);
        def.resolution = 0.004f;
    }
    return def;
}

static sinew_tool_id tool_of(sinew_world *world, const sinew_tool_def *def)
{
    sinew_tool_id tool = {0, 0};
    MUST(sinew_tool_create(world, def, &tool));
    return tool;
}

static size_t contact_count(const sinew_world *world, sinew_tool_id tool)
{
    size_t count = 77;
    MUST(sinew_tool_get_contacts(world, tool, NULL, 0, &count));
    return count;
}

static void move_to(sinew_world *world, sinew_tool_id tool, float y)
{
    const float place[3] = {0, y, 0};
    MUST(sinew_tool_set_pose(world, tool, place, NULL));
}

/* Of a cloth that lies on a cube: where it presses is on the upper side, and all of that makes the force. */
static void contacts_are(const sinew_world *world, sinew_body_id cloth, sinew_tool_id cube, float top)
{
    static sinew_contact contacts[1024], few[2], untouched;
    const size_t expected = contact_count(world, cube);
    double sum[3] = {0, 0, 0};
    float force[3], torque[3];
    size_t count = 0, i;
    int axis;
    CHECK(expected > 3 && expected <= 1024);
    MUST(sinew_tool_get_contacts(world, cube, contacts, 1024, &count));
    CHECK(count == expected);
    memset(&untouched, 0xA5, sizeof untouched);
    few[1] = untouched;
    MUST(sinew_tool_get_contacts(world, cube, few, 1, &count));
    CHECK(count == expected && memcmp(few, contacts, offsetof(sinew_contact, force) + sizeof few->force) == 0 && memcmp(few + 1, &untouched, sizeof untouched) == 0);
    for (i = 0; i < expected && i < 1024; i++) {
        const sinew_contact *at = contacts + i;
        CHECK(memcmp(&at->body, &cloth, sizeof cloth) == 0);
        CHECK_NEAR(at->normal[1], 1.0, 1e-4);
        CHECK(fabsf(at->normal[0]) < 0.01f && fabsf(at->normal[2]) < 0.01f);
        CHECK_NEAR(at->point[1], top, 1e-4);
        CHECK_NEAR((double)at->weights[0] + at->weights[1] + at->weights[2], 1.0, 1e-5);
        for (axis = 0; axis < 3; axis++) {
            double point = 0;
            int corner;
            for (corner = 0; corner < 3; corner++) {
                CHECK(at->nodes[corner] < CLOTH_NODES && at->weights[corner] >= 0.0f);
                point += (double)at->weights[corner] * position(world, cloth, at->nodes[corner], axis);
            }
            CHECK_NEAR(at->point[axis], point, 1e-6);
            sum[axis] += at->force[axis];
        }
    }
    MUST(sinew_tool_get_wrench(world, cube, force, torque));
    for (axis = 0; axis < 3; axis++)
        CHECK_NEAR(force[axis], sum[axis], 0.02 * cloth_weight);
}

static void a_cube_carries_a_cloth(size_t size, uint32_t detection)
{
    const float below = -0.006f - half, top = -0.005f;
    sinew_world *world = a_world(0.0f);
    const float down[3] = {0, -10, 0};
    const sinew_body_id cloth = a_cloth(world, SOFT);
    const sinew_tool_def def = cube_def(size, detection, below);
    const sinew_tool_id cube = tool_of(world, &def);
    sinew_contact_change change;
    float force[3], torque[3], pose[3], turned[4];
    size_t count = 77;
    int frame;
    MUST(sinew_tool_set_user_data(world, cube, &force));
    MUST(sinew_body_set_user_data(world, cloth, &torque));
    steps(world, 0.01f, 2);
    CHECK(contact_count(world, cube) == 0);
    MUST(sinew_world_get_contact_changes(world, NULL, 0, &count));
    CHECK(count == 0);

    MUST(sinew_world_set_gravity(world, down));
    move_to(world, cube, top - half);
    MUST(sinew_tool_get_pose(world, cube, pose, NULL));
    CHECK(pose[1] == below); /* it goes with the next step */
    steps(world, 0.01f, 1);
    MUST(sinew_tool_get_pose(world, cube, pose, turned));
    CHECK(pose[0] == 0.0f && pose[1] == top - half && pose[2] == 0.0f && turned[3] == 1.0f);
    MUST(sinew_tool_get_pose(world, cube, NULL, turned));
    memset(&change, 0xA5, sizeof change);
    for (frame = 0; frame < 20 && count == 0; frame++) { /* until the cloth has fallen so far */
        steps(world, 0.01f, 1);
        MUST(sinew_world_get_contact_changes(world, &change, 1, &count));
    }
    CHECK(count == 1 && change.has_begun == 1);
    CHECK(memcmp(&change.tool, &cube, sizeof cube) == 0 && memcmp(&change.body, &cloth, sizeof cloth) == 0);
    CHECK(change.tool_user_data == &force && change.body_user_data == &torque);
    steps(world, 0.01f, 30);
    MUST(sinew_world_get_contact_changes(world, NULL, 0, &count));
    CHECK(count == 0); /* it lies there */
    MUST(sinew_tool_get_wrench(world, cube, force, torque));
    CHECK_NEAR(force[0], 0.0, 0.01 * cloth_weight);
    CHECK_NEAR(force[1], -cloth_weight, 0.01 * cloth_weight);
    CHECK_NEAR(force[2], 0.0, 0.01 * cloth_weight);
    contacts_are(world, cloth, cube, top);

    move_to(world, cube, -0.5f);
    for (frame = 0; frame < 2 && count == 0; frame++) {
        steps(world, 0.01f, 1);
        MUST(sinew_world_get_contact_changes(world, &change, 1, &count));
    }
    CHECK(count == 1 && change.has_begun == 0 && memcmp(&change.tool, &cube, sizeof cube) == 0);
    CHECK(contact_count(world, cube) == 0);
    sinew_world_destroy(world);
}

/* A block of 40 mm about the point, thrown along x; how its definition is as of an older header. */
static sinew_body_id a_block(sinew_world *world, size_t size, float x, float speed, uint32_t meets_bodies,
                             uint32_t detection)
{
    static const float extent[3] = {0.04f, 0.04f, 0.04f};
    static const uint32_t cells[3] = {3, 3, 3};
    sinew_mesh *mesh;
    sinew_mesh_view shape;
    sinew_body_def def;
    sinew_body_id body = {0, 0};
    float positions[3 * 64], velocities[3 * 64];
    size_t i;
    shape.struct_size = sizeof shape;
    MUST(sinew_mesh_create_block(extent, cells, &mesh));
    MUST(sinew_mesh_get_view(mesh, &shape));
    CHECK(shape.node_count == 64);
    for (i = 0; i < 3 * 64; i++) {
        positions[i] = shape.positions[i] + (i % 3 == 0 ? x : i % 3 == 1 ? 0.05f * x : 0.0f);
        velocities[i] = i % 3 == 0 ? speed : 0.0f;
    }
    memset(&def, 0xA5, sizeof def);
    MUST(sinew_body_def_init(&def, size));
    CHECK(def.struct_size == size);
    def.positions = positions;
    def.node_count = 64;
    def.node_mass = 1e-3f;
    def.node_damping = speed == 0.0f ? 0.05f : 0.0f;
    def.stiffness = 60.0f;
    def.triangles = shape.surface;
    def.triangle_count = shape.surface_triangle_count;
    def.tetrahedra = shape.tetrahedra;
    def.tetrahedron_count = shape.tetrahedron_count;
    if (size == sizeof def) {
        CHECK(def.meets_bodies == 0 && def.contact_thickness == 0.0f && def.contact_friction == 0.0f);
        CHECK(def.contact_detection == SINEW_DETECTION_EXACT && def.contact_resolution == 0.0f);
        def.meets_bodies = meets_bodies;
        def.contact_detection = detection;
        def.contact_thickness = meets_bodies ? 0.0005f : 0.0f;
    }
    MUST(sinew_body_create(world, &def, &body));
    MUST(sinew_body_set_velocities(world, body, velocities, 64));
    sinew_mesh_destroy(mesh);
    return body;
}

/* The end of a block along x, the lower or the upper. */
static double end_of(const sinew_world *world, sinew_body_id body, double sign)
{
    double end = -INFINITY;
    size_t i;
    for (i = 0; i < 64; i++)
        end = fmax(end, sign * position(world, body, i, 0));
    return sign * end;
}

/* Sent deep into a block with less force than that takes, a tool stops where the force is its limit. */
static void a_weak_tool_stops_short(uint32_t shape)
{
    const float limit = 0.25f, size = shape == SINEW_SHAPE_SPHERE ? 0.02f : half;
    const float way = shape == SINEW_SHAPE_SPHERE ? 5e-5f : 3e-5f; /* m a frame */
    sinew_world *world = a_world(0.0f);
    const sinew_body_id block = a_block(world, sizeof(sinew_body_def), 0.0f, 0.0f, 0, SINEW_DETECTION_EXACT);
    sinew_tool_def def = cube_def(sizeof def, SINEW_DETECTION_DISTANCE_FIELD, 0.0201f + size);
    sinew_tool_id tool;
    float force[3], torque[3], pose[3];
    uint32_t node;
    int frame;
    for (node = 0; node < 64; node++)
        if (position(world, block, node, 1) < -0.019f)
            MUST(sinew_body_pin(world, block, node));
    def.shape = shape;
    if (shape == SINEW_SHAPE_SPHERE) {
        def.radius = size;
        def.detection = SINEW_DETECTION_EXACT;
    }
    def.force_limit = limit;
    tool = tool_of(world, &def);
    for (frame = 1; frame <= 40; frame++) {
        move_to(world, tool, size + 0.02f - way * (float)frame);
        steps(world, 0.01f, 1);
    }
    MUST(sinew_tool_get_wrench(world, tool, force, torque));
    CHECK_NEAR(force[1], limit, 0.02 * limit);
    MUST(sinew_tool_get_pose(world, tool, pose, NULL));
    CHECK(pose[1] > size + 0.02f - 30 * way && pose[1] < size + 0.02f - 5 * way);
    sinew_world_destroy(world);
}

/* Two meet where each has a category that the other's mask has. */
static void masks(uint32_t category, uint32_t mask, int meets)
{
    const float flat[] = {-0.05f, 0, -0.05f, 0.05f, 0, -0.05f, 0, 0, 0.05f};
    static const uint32_t triangle[] = {0, 2, 1};
    sinew_world *world = a_world(0.0f);
    sinew_body_def def;
    sinew_body_id body = {0, 0};
    sinew_tool_def cube = cube_def(sizeof cube, SINEW_DETECTION_EXACT, 0.01f + half);
    sinew_tool_id tool;
    float force[3], torque[3];
    MUST(sinew_body_def_init(&def, sizeof def));
    CHECK(def.collision_category == 1 && def.collision_mask == UINT32_MAX);
    def.positions = flat;
    def.node_count = 3;
    def.node_mass = 0.1f;
    def.stiffness = 100.0f;
    def.triangles = triangle;
    def.triangle_count = 1;
    def.collision_category = 2;
    def.collision_mask = 4;
    MUST(sinew_body_create(world, &def, &body));
    cube.collision_category = category;
    cube.collision_mask = mask;
    tool = tool_of(world, &cube);
    move_to(world, tool, half - 0.01f);
    steps(world, 0.01f, 1);
    MUST(sinew_tool_get_wrench(world, tool, force, torque));
    CHECK((contact_count(world, tool) > 0) == meets);
    CHECK((force[1] > 0.0f) == meets);
    CHECK((position(world, body, 2, 1) != 0.0f) == meets);
    sinew_world_destroy(world);
}

static void two_blocks(size_t size, uint32_t meet, uint32_t detection)
{
    sinew_world *world = a_world(0.0f);
    const sinew_body_id left = a_block(world, size, -0.03f, 0.5f, 1, SINEW_DETECTION_EXACT);
    const sinew_body_id right = a_block(world, size, 0.03f, -0.5f, meet, detection);
    double closest = INFINITY;
    uint32_t is_closed = 2;
    int frame;
    MUST(sinew_body_is_closed(world, right, &is_closed));
    CHECK(is_closed == 1);
    for (frame = 0; frame < 100; frame++) {
        steps(world, 0.002f, 1);
        closest = fmin(closest, end_of(world, right, -1) - end_of(world, left, 1));
    }
    if (meet) {
        CHECK(closest > -0.003); /* where a rim of one has nothing before it, it goes on a little */
        CHECK(end_of(world, right, -1) > end_of(world, left, 1) + 0.01); /* they bounced */
    } else {
        CHECK(end_of(world, right, 1) < end_of(world, left, -1)); /* they went through each other */
    }
    sinew_world_destroy(world);
}

/* What two bodies tell of each other: where they touch, and forces that carry the upper one. */
static void one_block_rests_on_another(uint32_t solver)
{
    static const float extent[3] = {0.04f, 0.04f, 0.04f};
    static const uint32_t cells[3] = {3, 3, 3};
    const double weight = 64 * 1e-3 * 10;
    static int names[2];
    sinew_world *world = a_world(-10.0f);
    sinew_body_id bodies[2];
    sinew_contact contacts[256];
    size_t count = 77, others = 0, i;
    uint32_t k, axis;
    for (k = 0; k < 2; k++) {
        sinew_mesh *mesh;
        sinew_body_def def;
        MUST(sinew_mesh_create_block(extent, cells, &mesh));
        MUST(sinew_body_def_init(&def, sizeof def));
        MUST(sinew_body_def_set_mesh(&def, mesh));
        def.node_mass = 1e-3f;
        def.node_damping = 0.02f;
        def.stiffness = 300;
        def.meets_bodies = 1;
        def.position[0] = 0.003f * (float)k;
        def.position[1] = 0.0401f * (float)k;
        def.solver = solver;
        MUST(sinew_body_create(world, &def, &bodies[k]));
        MUST(sinew_body_set_user_data(world, bodies[k], &names[k]));
        sinew_mesh_destroy(mesh);
    }
    for (k = 0; k < 64; k++)
        if (position(world, bodies[0], k, 1) < -0.019f)
            MUST(sinew_body_pin(world, bodies[0], k));
    MUST(sinew_body_get_contacts(world, bodies[1], NULL, 0, &count));
    CHECK(count == 0);
    steps(world, 0.005f, 150);
    for (k = 0; k < 2; k++) {
        double sum[3] = {0, 0, 0};
        MUST(sinew_body_get_contacts(world, bodies[k], contacts, 256, &count));
        CHECK(count >= 3 && count <= 256 && (k == 0 || count == others));
        others = count;
        for (i = 0; i < count && i < 256; i++) {
            const sinew_contact *it = &contacts[i];
            double at[3] = {0, 0, 0};
            CHECK(memcmp(&it->body, &bodies[1 - k], sizeof it->body) == 0 && it->body_user_data == &names[1 - k]);
            CHECK(it->normal[1] * (k == 0 ? 1.0f : -1.0f) > 0.9f); /* toward the other */
            for (axis = 0; axis < 3; axis++) {
                uint32_t corner;
                for (corner = 0; corner < 3; corner++)
                    at[axis] += it->weights[corner] * position(world, bodies[1 - k], it->nodes[corner], axis);
                CHECK_NEAR(at[axis], it->point[axis], 1e-6);
                sum[axis] += it->force[axis];
            }
            CHECK_NEAR(it->point[1], 0.02, 0.003);
        }
        CHECK_NEAR(sum[0], 0, 0.05 * weight);
        CHECK_NEAR(sum[1], k == 0 ? -weight : weight, 0.05 * weight);
        CHECK_NEAR(sum[2], 0, 0.05 * weight);
    }
    CHECK(sinew_body_get_contacts(world, bodies[0], contacts, 256, NULL) == SINEW_STATUS_INVALID_ARGUMENT);
    CHECK(sinew_body_get_contacts(world, bodies[0], NULL, 1, &count) == SINEW_STATUS_INVALID_ARGUMENT);
    MUST(sinew_body_destroy(world, bodies[0]));
    CHECK(sinew_body_get_contacts(world, bodies[0], contacts, 256, &count) == SINEW_STATUS_STALE_ID);
    MUST(sinew_body_get_contacts(world, bodies[1], contacts, 256, &count));
    CHECK(count == 0);
    sinew_world_destroy(world);
}

int main(void)
{
    one_block_rests_on_another(SINEW_SOLVER_VERLET);
    one_block_rests_on_another(SINEW_SOLVER_IMPLICIT);
    a_cube_carries_a_cloth(sizeof(sinew_tool_def), SINEW_DETECTION_EXACT);
    a_cube_carries_a_cloth(sizeof(sinew_tool_def), SINEW_DETECTION_IMAGE_SPACE);
    a_cube_carries_a_cloth(sizeof(sinew_tool_def), SINEW_DETECTION_DISTANCE_FIELD);
    a_cube_carries_a_cloth(OLD_TOOL, SINEW_DETECTION_EXACT);
    a_weak_tool_stops_short(SINEW_SHAPE_MESH);
    a_weak_tool_stops_short(SINEW_SHAPE_SPHERE);
    masks(4, 2, 1);
    masks(4 | 1, 2 | 1, 1);
    masks(4, 1, 0); /* the tool does not meet the body's kind, */
    masks(1, 2, 0); /* nor the body the tool's */
    masks(0, 0, 0);
    two_blocks(sizeof(sinew_body_def), 1, SINEW_DETECTION_EXACT);
    two_blocks(sizeof(sinew_body_def), 1, SINEW_DETECTION_IMAGE_SPACE); /* one of two asks for it */
    two_blocks(sizeof(sinew_body_def), 0, SINEW_DETECTION_EXACT);
    two_blocks(OLD_BODY, 0, SINEW_DETECTION_EXACT);
    return checked("tools and bodies meet as they are asked to");
}
