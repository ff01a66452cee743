/* Whole bodies, several pins, filtered rays, settings that are read back, ids and user data: what they do, and what they refuse. */
#include "scene.h"

#define REFUSED(word, call)                                                    \
    do {                                                                       \
        char message_[512] = "";                                               \
        const sinew_status status_ = (call);                                   \
        sinew_last_error(message_, sizeof message_);                           \
        CHECK(status_ == SINEW_STATUS_INVALID_ARGUMENT);                       \
        if (strstr(message_, word) == NULL) {                                  \
            failures++;                                                        \
            fprintf(stderr, "%s:%d: \"%s\" does not name %s\n", __FILE__, __LINE__, message_, word); \
        }                                                                      \
    } while (0)

static const float not_a_number[4] = {NAN, 0, 0, 1}, zero[4] = {0, 0, 0, 0};
/* A quarter about z: x becomes y. */
static const float quarter[4] = {0, 0, 0.70710678f, 0.70710678f};

static sinew_mesh *a_block(void)
{
    static const float size[3] = {0.2f, 0.1f, 0.1f};
    static const uint32_t cells[3] = {4, 2, 2};
    sinew_mesh *mesh = NULL;
    MUST(sinew_mesh_create_block(size, cells, &mesh));
    return mesh;
}

static sinew_body_def of_mesh(const sinew_mesh *mesh)
{
    sinew_body_def def;
    MUST(sinew_body_def_init(&def, sizeof def));
    MUST(sinew_body_def_set_mesh(&def, mesh));
    def.node_mass = 0.01f;
    def.stiffness = 100;
    return def;
}

/* A definition that ends before its cells keeps what it had. */
static void older_definitions_refuse_cells(void)
{
    sinew_mesh *lattice = NULL;
    sinew_body_def def;
    const float *positions;
    static const uint32_t cells[3] = {2, 2, 2};
    char message[256];
    MUST(sinew_mesh_create_lattice(1, cells, &lattice));
    MUST(sinew_body_def_init(&def, offsetof(sinew_body_def, order)));
    positions = def.positions;
    CHECK(sinew_body_def_set_mesh(&def, lattice) == SINEW_STATUS_UNSUPPORTED);
    sinew_last_error(message, sizeof message);
    CHECK(strstr(message, "cells") != NULL && strstr(message, "struct_size") != NULL);
    CHECK(def.positions == positions);
    sinew_mesh_destroy(lattice);
}

/* A square of two triangles that share no vertex, a triangle without area, and a vertex that nothing uses. */
static void meshes_from_memory(void)
{
    static const float positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 5, 5, 5};
    static const uint32_t triangles[] = {0, 1, 2, 3, 4, 5, 1, 3, 2};
    static const uint32_t outside[] = {0, 1, 7};
    sinew_mesh *mesh = NULL;
    sinew_mesh_view view;
    view.struct_size = sizeof view;
    MUST(sinew_mesh_create(positions, 7, triangles, 3, NULL, 0, &mesh));
    MUST(sinew_mesh_get_view(mesh, &view));
    CHECK(view.node_count == 4 && view.triangle_count == 2 && view.vertex_count == 7);
    CHECK(view.welded_vertices == 2 && view.dropped_vertices == 1 && view.dropped_triangles == 1);
    CHECK(view.node_of_vertex[3] == view.node_of_vertex[1] && view.node_of_vertex[6] == SINEW_NO_NODE);
    sinew_mesh_destroy(mesh);
    mesh = NULL;
    REFUSED("positions", sinew_mesh_create(NULL, 7, triangles, 3, NULL, 0, &mesh));
    REFUSED("triangle", sinew_mesh_create(positions, 7, outside, 1, NULL, 0, &mesh));
    REFUSED("out", sinew_mesh_create(positions, 7, triangles, 3, NULL, 0, NULL));
    CHECK(mesh == NULL);
}

/* The tetrahedra of a body made from a surface, and its rest positions. */
static void a_filled_mesh_is_what_a_surface_becomes(void)
{
    sinew_mesh *block = a_block(), *filled = NULL;
    sinew_world *world = a_world(0);
    sinew_mesh_view surface, view;
    sinew_vec3_view nodes;
    sinew_body_def def;
    sinew_body_id body;
    size_t i, axis;
    surface.struct_size = view.struct_size = sizeof view;
    MUST(sinew_mesh_get_view(block, &surface));
    MUST(sinew_mesh_create_filled(block, 0.04f, &filled));
    MUST(sinew_mesh_get_view(filled, &view));
    MUST(sinew_body_def_init(&def, sizeof def));
    def.positions = surface.positions;
    def.node_count = surface.node_count;
    def.triangles = surface.surface;
    def.triangle_count = surface.surface_triangle_count;
    def.node_mass = 0.01f;
    def.stiffness = 100;
    MUST(sinew_body_create_from_surface(world, &def, 0.04f, &body, NULL));
    MUST(sinew_body_get_positions(world, body, &nodes));
    CHECK(view.tetrahedron_count > 0 && view.node_count == nodes.count);
    for (i = 0; i < nodes.count && i < view.node_count; i++)
        for (axis = 0; axis < 3; axis++)
            CHECK(node_of(nodes, i)[axis] == view.positions[3 * i + axis]);
    REFUSED("surface", sinew_mesh_create_filled(NULL, 0.04f, &filled));
    REFUSED("spacing", sinew_mesh_create_filled(block, 0, &filled));
    sinew_mesh_destroy(filled);
    sinew_mesh_destroy(block);
    sinew_world_destroy(world);
}

static void a_definition_places_a_body(void)
{
    sinew_mesh *mesh = a_block();
    sinew_world *world = a_world(0);
    sinew_body_def def = of_mesh(mesh);
    sinew_body_id body = {0, 0};
    float low[3], high[3], before[2];
    CHECK(def.gravity_scale == 1 && def.orientation[3] == 1 && def.tetrahedron_count > 0 && def.triangles == NULL);
    def.position[0] = 1;
    memcpy(def.orientation, quarter, sizeof quarter);
    def.home_stiffness = 10;
    MUST(sinew_body_create(world, &def, &body));
    MUST(sinew_body_get_bounds(world, body, low, high));
    CHECK_NEAR(low[0], 0.95, 1e-6);
    CHECK_NEAR(high[0], 1.05, 1e-6);
    CHECK_NEAR(low[1], -0.1, 1e-6);
    CHECK_NEAR(high[1], 0.1, 1e-6);
    /* It is at rest there, by its anchor springs too. */
    before[0] = low[0];
    before[1] = high[1];
    steps(world, 0.01f, 20);
    MUST(sinew_body_get_bounds(world, body, low, high));
    CHECK_NEAR(low[0], before[0], 1e-6);
    CHECK_NEAR(high[1], before[1], 1e-6);
    memcpy(def.orientation, zero, sizeof zero);
    REFUSED("orientation", sinew_body_create(world, &def, &body));
    def.orientation[3] = 1;
    def.position[1] = NAN;
    REFUSED("position", sinew_body_create(world, &def, &body));
    def.position[1] = 0;
    def.gravity_scale = INFINITY;
    REFUSED("gravity_scale", sinew_body_create(world, &def, &body));
    REFUSED("mesh", sinew_body_def_set_mesh(&def, NULL));
    REFUSED("def", sinew_body_def_set_mesh(NULL, mesh));
    older_definitions_refuse_cells();
    sinew_mesh_destroy(mesh);
    sinew_world_destroy(world);
}

static void a_body_is_turned_and_moved(void)
{
    static const float speeds[6] = {2, 0, 0, 2, 0, 0}, up[3] = {0, 0, 5}, origin[3] = {0, 0, 0};
    sinew_world *world = a_world(0);
    const sinew_body_id body = loose_nodes(world, 2);
    uint64_t before = 0, after = 0;
    MUST(sinew_body_set_velocities(world, body, speeds, 2));
    MUST(sinew_body_transform(world, body, up, quarter, origin));
    CHECK_NEAR(position(world, body, 1, 0), 0, 1e-6);
    CHECK_NEAR(position(world, body, 1, 1), 1, 1e-6);
    CHECK_NEAR(position(world, body, 1, 2), 5, 1e-6);
    CHECK_NEAR(velocity(world, body, 1, 1), 2, 1e-6);
    /* About its middle, which stays: 0 0.5 5. */
    MUST(sinew_body_transform(world, body, NULL, quarter, NULL));
    CHECK_NEAR(position(world, body, 1, 0), -0.5, 1e-6);
    CHECK_NEAR(position(world, body, 1, 1), 0.5, 1e-6);
    MUST(sinew_world_get_state_hash(world, &before));
    REFUSED("translation", sinew_body_transform(world, body, not_a_number, NULL, NULL));
    REFUSED("rotation", sinew_body_transform(world, body, NULL, zero, NULL));
    REFUSED("rotation", sinew_body_transform(world, body, NULL, not_a_number, NULL));
    REFUSED("pivot", sinew_body_transform(world, body, NULL, NULL, not_a_number));
    MUST(sinew_world_get_state_hash(world, &after));
    CHECK(before == after);
    sinew_world_destroy(world);
}

static void pins_of_many(void)
{
    static const uint32_t first[2] = {0, 1}, wrong[2] = {2, CLOTH_NODES};
    static const float low[3] = {-0.1f, -0.1f, -0.041f}, high[3] = {0.1f, 0.1f, -0.039f};
    sinew_world *world = a_world(-10);
    const sinew_body_id cloth = a_cloth(world, STIFF);
    float forces[3 * CLOTH_NODES], force[3], masses[CLOTH_NODES], normals[3 * CLOTH_NODES], mass = 0, held = 0;
    uint64_t before = 0, after = 0;
    size_t count = 0;
    uint32_t i;
    MUST(sinew_body_get_normals(world, cloth, normals, CLOTH_NODES));
    MUST(sinew_body_get_masses(world, cloth, masses, CLOTH_NODES));
    for (i = 0; i < CLOTH_NODES; i++) {
        CHECK_NEAR(normals[3 * i + 1], 1, 1e-6);
        mass += masses[i];
    }
    CHECK_NEAR(mass, CLOTH_NODES * 1e-3, 1e-6);
    MUST(sinew_world_get_state_hash(world, &before));
    REFUSED("nodes[1]", sinew_body_pin_nodes(world, cloth, wrong, 2));
    REFUSED("nodes[1]", sinew_body_unpin_nodes(world, cloth, wrong, 2));
    REFUSED("min", sinew_body_pin_box(world, cloth, high, low, &count));
    REFUSED("min", sinew_body_pin_box(world, cloth, NULL, high, &count));
    REFUSED("max", sinew_body_unpin_box(world, cloth, low, not_a_number, &count));
    REFUSED("forces", sinew_body_get_pin_forces(world, cloth, forces, CLOTH_NODES - 1));
    REFUSED("masses", sinew_body_get_masses(world, cloth, masses, 1));
    REFUSED("out_normals", sinew_body_get_normals(world, cloth, NULL, CLOTH_NODES));
    MUST(sinew_world_get_state_hash(world, &after));
    CHECK(before == after && count == 0);
    /* One edge of the cloth. */
    MUST(sinew_body_pin_box(world, cloth, low, high, &count));
    CHECK(count == SIDE);
    steps(world, 0.01f, 300);
    MUST(sinew_body_get_pin_forces(world, cloth, forces, CLOTH_NODES));
    for (i = 0; i < CLOTH_NODES; i++) {
        held += forces[3 * i + 1];
        if (i >= SIDE) {
            CHECK(forces[3 * i + 1] == 0);
            continue;
        }
        MUST(sinew_body_get_pin_force(world, cloth, i, force));
        CHECK(force[1] == forces[3 * i + 1]);
    }
    CHECK_NEAR(held, mass * 10, 0.05 * mass * 10); /* they carry it */
    MUST(sinew_body_unpin_nodes(world, cloth, first, 2));
    MUST(sinew_body_unpin_box(world, cloth, low, high, &count));
    CHECK(count == SIDE - 2);
    MUST(sinew_body_pin_nodes(world, cloth, first, 2));
    MUST(sinew_body_unpin_box(world, cloth, low, high, NULL));
    sinew_world_destroy(world);
}

static void impulses_and_gravity(void)
{
    static const uint32_t nodes[2] = {1, 1};
    static const float impulses[6] = {0, 1, 0, 0, 1, 0}, bad[6] = {0, 1, 0, 0, NAN, 0};
    sinew_world *world = a_world(-10);
    const sinew_body_id body = loose_nodes(world, 2);
    float scale = 0, gravity[3];
    double time = 0;
    uint64_t count = 0;
    REFUSED("impulses[1]", sinew_body_apply_impulses(world, body, nodes, bad, 2));
    REFUSED("nodes", sinew_body_apply_impulses(world, body, NULL, impulses, 2));
    MUST(sinew_body_pin(world, body, 0));
    MUST(sinew_body_apply_impulses(world, body, nodes, impulses, 2));
    CHECK_NEAR(velocity(world, body, 1, 1), 2 / 0.5, 1e-5); /* twice 1 N s on 0.5 kg */
    CHECK(velocity(world, body, 0, 1) == 0);
    MUST(sinew_body_get_gravity_scale(world, body, &scale));
    CHECK(scale == 1);
    MUST(sinew_body_set_gravity_scale(world, body, 0.5f));
    REFUSED("gravity_scale", sinew_body_set_gravity_scale(world, body, NAN));
    MUST(sinew_body_get_gravity_scale(world, body, &scale));
    CHECK(scale == 0.5f);
    steps(world, 0.01f, 10);
    CHECK_NEAR(velocity(world, body, 1, 1), 4 - 0.5 * 10 * 0.1, 1e-5);
    CHECK_NEAR(position(world, body, 1, 1), 4 * 0.1 - 0.5 * 0.5 * 10 * 0.01, 1e-5);
    MUST(sinew_world_get_time(world, &time, &count));
    CHECK_NEAR(time, 0.1, 1e-7);
    CHECK(count == 10);
    MUST(sinew_world_get_time(world, NULL, NULL));
    MUST(sinew_world_get_gravity(world, gravity));
    CHECK(gravity[1] == -10);
    sinew_world_destroy(world);
}

static void rays_settings_and_ids(void)
{
    static const float from[3] = {0.003f, 1, 0.002f}, down[3] = {0, -2, 0};
    static int anything;
    sinew_world *world = a_world(0);
    const sinew_body_id cloth = a_cloth(world, SOFT), no_body = {0, 0};
    sinew_tool_id ball = {0, 0};
    sinew_tool_def def;
    sinew_ray_hit hit;
    float number = 0, force[3], torque[3];
    uint32_t category = 0, mask = 0;
    void *data = &anything;
    hit.struct_size = sizeof hit;
    MUST(sinew_tool_def_init(&def, sizeof def));
    def.radius = 0.1f;
    def.position[1] = 0.5f;
    def.collision_category = 4;
    def.friction = 0.25f;
    def.force_limit = 0;
    MUST(sinew_tool_create(world, &def, &ball));
    MUST(sinew_world_cast_ray_filtered(world, from, down, 2, 1, UINT32_MAX, &hit));
    CHECK(hit.tool.index1 == ball.index1 && hit.body.index1 == 0);
    CHECK_NEAR(hit.distance, 1 - 0.5 - 0.1, 1e-3);
    CHECK_NEAR(hit.normal[1], 1, 1e-2);
    MUST(sinew_world_cast_ray_filtered(world, from, down, 2, 1, 1, &hit));
    CHECK(hit.tool.index1 == 0 && hit.body.index1 == cloth.index1);
    CHECK_NEAR(hit.distance, 1, 1e-6);
    MUST(sinew_world_cast_ray_filtered(world, from, down, 2, 1, 2, &hit));
    CHECK(hit.tool.index1 == 0 && hit.body.index1 == 0);
    REFUSED("direction", sinew_world_cast_ray_filtered(world, from, zero, 2, 1, 1, &hit));
    REFUSED("max_distance", sinew_world_cast_ray_filtered(world, from, down, NAN, 1, 1, &hit));
    REFUSED("origin", sinew_world_cast_ray_filtered(world, NULL, down, 2, 1, 1, &hit));
    /* 0 is no limit, wherever there is one. */
    MUST(sinew_tool_get_force_limit(world, ball, &number));
    CHECK(isinf(number));
    MUST(sinew_tool_set_force_limit(world, ball, 3));
    MUST(sinew_tool_get_force_limit(world, ball, &number));
    CHECK(number == 3);
    MUST(sinew_tool_get_friction(world, ball, &number));
    CHECK(number == 0.25f);
    MUST(sinew_tool_get_collision(world, ball, &category, &mask));
    CHECK(category == 4 && mask == UINT32_MAX);
    MUST(sinew_body_get_collision(world, cloth, &category, &mask));
    CHECK(category == 1);
    MUST(sinew_body_get_pressure(world, cloth, &number));
    CHECK(number == 0);
    MUST(sinew_tool_get_wrench(world, ball, NULL, torque));
    MUST(sinew_tool_get_wrench(world, ball, force, NULL));
    REFUSED("out_mask", sinew_tool_get_collision(world, ball, &category, NULL));

    CHECK(sinew_body_is_valid(world, cloth) == 1 && sinew_body_is_valid(world, no_body) == 0);
    CHECK(sinew_body_is_valid(NULL, cloth) == 0 && sinew_tool_is_valid(world, ball) == 1);
    MUST(sinew_body_get_user_data(world, cloth, &data));
    CHECK(data == NULL);
    MUST(sinew_body_set_user_data(world, cloth, &anything));
    MUST(sinew_tool_set_user_data(world, ball, &anything));
    MUST(sinew_world_set_user_data(world, &anything));
    MUST(sinew_body_get_user_data(world, cloth, &data));
    CHECK(data == &anything);
    MUST(sinew_tool_get_user_data(world, ball, &data));
    CHECK(data == &anything);
    MUST(sinew_world_get_user_data(world, &data));
    CHECK(data == &anything);
    MUST(sinew_tool_destroy(world, ball));
    CHECK(sinew_tool_is_valid(world, ball) == 0);
    CHECK(sinew_tool_get_user_data(world, ball, &data) == SINEW_STATUS_STALE_ID);
    sinew_world_destroy(world);
}

static void blades_and_attachments(void)
{
    static const float place[3] = {1, 2, 3};
    const sinew_attachment_id nothing = {1, 1};
    sinew_world *world = a_world(0);
    sinew_blade_def def;
    sinew_blade_id blade = {0, 0};
    float at[3];
    uint32_t category = 0, mask = 0;
    CHECK(sinew_blade_is_valid(world, blade) == 0 && sinew_attachment_is_valid(world, nothing) == 0);
    MUST(sinew_blade_def_init(&def, sizeof def));
    def.edge[0] = 0.1f;
    memcpy(def.position, place, sizeof place);
    MUST(sinew_blade_create(world, &def, &blade));
    CHECK(sinew_blade_is_valid(world, blade) == 1);
    MUST(sinew_blade_get_pose(world, blade, at, NULL));
    CHECK(memcmp(at, place, sizeof place) == 0);
    MUST(sinew_blade_set_collision(world, blade, 2, 4));
    MUST(sinew_blade_get_collision(world, blade, &category, &mask));
    CHECK(category == 2 && mask == 4);
    REFUSED("out_mask", sinew_blade_get_collision(world, blade, &category, NULL));
    MUST(sinew_blade_destroy(world, blade));
    CHECK(sinew_blade_set_collision(world, blade, 2, 4) == SINEW_STATUS_STALE_ID);
    REFUSED("world", sinew_blade_set_collision(NULL, blade, 2, 4));
    sinew_world_destroy(world);
}

/* Times that are not below 0, and counts of a step of one body. */
static void profiles(void)
{
    sinew_world *world = a_world(0);
    sinew_mesh *mesh = a_block();
    sinew_body_def def = of_mesh(mesh);
    sinew_body_id body;
    sinew_profile profile;
    uint32_t is_on = 7;
    char message[256];
    memset(&profile, 0x5a, sizeof profile);
    profile.struct_size = sizeof profile;
    MUST(sinew_body_create(world, &def, &body));
    CHECK(sinew_world_get_profile(world, &profile) == SINEW_STATUS_UNSUPPORTED);
    sinew_last_error(message, sizeof message);
    CHECK(strstr(message, "sinew_world_set_profiling") != NULL);
    REFUSED("enabled", sinew_world_set_profiling(world, 2));
    REFUSED("world", sinew_world_set_profiling(NULL, 1));
    MUST(sinew_world_get_profiling(world, &is_on));
    CHECK(is_on == 0);
    MUST(sinew_world_set_profiling(world, 1));
    MUST(sinew_world_get_profiling(world, &is_on));
    CHECK(is_on == 1);
    REFUSED("out", sinew_world_get_profiling(world, NULL));
    REFUSED("world", sinew_world_get_profiling(NULL, &is_on));
    MUST(sinew_world_get_profile(world, &profile));
    CHECK(profile.step == 0 && profile.bodies == 0);
    MUST(sinew_world_step(world, 1e-3f, NULL));
    MUST(sinew_world_get_profile(world, &profile));
    CHECK(profile.step > 0 && profile.forces > 0 && profile.solver == 0);
    CHECK(profile.bodies == 1 && profile.substeps >= 1 && profile.tries == 1);
    REFUSED("out", sinew_world_get_profile(world, NULL));
    REFUSED("world", sinew_world_get_profile(NULL, &profile));
    profile.struct_size = 8;
    REFUSED("out->struct_size", sinew_world_get_profile(world, &profile));
    sinew_mesh_destroy(mesh);
    sinew_world_destroy(world);
}

typedef struct drawing {
    int lines, points, triangles;
} drawing;

static void draw_line(void *context, const float *points, uint32_t rgba)
{
    CHECK(isfinite(points[0]) && isfinite(points[5]) && (rgba & 0xff) != 0);
    ((drawing *)context)->lines++;
}

static void draw_point(void *context, const float *points, uint32_t rgba)
{
    CHECK(isfinite(points[0]) && isfinite(points[2]) && (rgba & 0xff) != 0);
    ((drawing *)context)->points++;
}

static void draw_triangle(void *context, const float *points, uint32_t rgba)
{
    CHECK(isfinite(points[0]) && isfinite(points[8]) && (rgba & 0xff) != 0);
    ((drawing *)context)->triangles++;
}

static void debug_drawing(void)
{
    sinew_world *world = a_world(0);
    sinew_mesh *mesh = a_block();
    sinew_body_def def = of_mesh(mesh);
    sinew_body_id body;
    sinew_debug_draw draw, good;
    drawing drawn = {0, 0, 0};
    sinew_storage_report report;
    report.struct_size = sizeof report;
    MUST(sinew_body_create(world, &def, &body));
    MUST(sinew_body_pin(world, body, 0));
    MUST(sinew_body_get_storage_report(world, body, &report));
    MUST(sinew_debug_draw_init(&draw, sizeof draw));
    MUST(sinew_world_debug_draw(world, &draw));
    draw.context = &drawn;
    draw.draw_line = draw_line;
    draw.draw_point = draw_point;
    draw.draw_triangle = draw_triangle;
    MUST(sinew_world_debug_draw(world, &draw));
    CHECK(drawn.points == 1 && drawn.triangles == 0);
    CHECK(drawn.lines == (int)report.spring_count + 12);
    good = draw;
    draw.flags = SINEW_DRAW_BOUNDS;
    memset(&drawn, 0, sizeof drawn);
    MUST(sinew_world_debug_draw(world, &draw));
    CHECK(drawn.lines == 12 && drawn.points == 0);
    memset(&drawn, 0, sizeof drawn);
    draw.flags = 128;
    REFUSED("flags", sinew_world_debug_draw(world, &draw));
    draw = good;
    draw.full_strain = 0;
    REFUSED("full_strain", sinew_world_debug_draw(world, &draw));
    draw = good;
    draw.force_scale = -1;
    REFUSED("force_scale", sinew_world_debug_draw(world, &draw));
    draw = good;
    draw.normal_length = NAN;
    REFUSED("normal_length", sinew_world_debug_draw(world, &draw));
    REFUSED("def", sinew_world_debug_draw(world, NULL));
    REFUSED("world", sinew_world_debug_draw(NULL, &good));
    REFUSED("def", sinew_debug_draw_init(NULL, sizeof draw));
    CHECK(drawn.lines == 0 && drawn.points == 0 && drawn.triangles == 0);
    sinew_mesh_destroy(mesh);
    sinew_world_destroy(world);
}

/* The program runs in a folder of its own, or may leave a small file in the one for temporary files. */
static const char *recording_path(void)
{
    static char path[512];
    const char *folder = getenv("TMPDIR");
    snprintf(path, sizeof path, "%s/sinew_more_%p.recording", folder == NULL ? "/tmp" : folder, (void *)&path);
    return path;
}

static void recordings(void)
{
    sinew_world *world = a_world(-9.81f);
    sinew_mesh *mesh = a_block();
    sinew_body_def def = of_mesh(mesh);
    sinew_body_id body;
    sinew_replay_report report;
    const char *path = recording_path();
    uint64_t steps = 77;
    int i;
    report.struct_size = sizeof report;
    MUST(sinew_body_create(world, &def, &body));
    REFUSED("world", sinew_world_stop_recording(world, &steps));
    CHECK(steps == 77);
    REFUSED("path", sinew_world_start_recording(world, NULL));
    REFUSED("world", sinew_world_start_recording(NULL, path));
    CHECK(sinew_world_start_recording(world, "no_such_folder/recording") == SINEW_STATUS_IO);
    MUST(sinew_world_start_recording(world, path));
    REFUSED("world", sinew_world_start_recording(world, path));
    for (i = 0; i < 10; i++) {
        MUST(sinew_body_pin(world, body, (uint32_t)i));
        MUST(sinew_world_step(world, 1e-3f, NULL));
    }
    MUST(sinew_world_stop_recording(world, &steps));
    CHECK(steps == 10);
    MUST(sinew_replay(path, 1, &report));
    CHECK(report.steps == 10 && report.first_difference == 0 && report.is_cut_short == 0);
    REFUSED("path", sinew_replay(NULL, 1, &report));
    REFUSED("out", sinew_replay(path, 1, NULL));
    REFUSED("thread_count", sinew_replay(path, 257, &report));
    CHECK(sinew_replay("no_such_recording", 1, &report) == SINEW_STATUS_IO);
    remove(path);
    sinew_mesh_destroy(mesh);
    sinew_world_destroy(world);
}

typedef struct heard {
    int count;
    uint32_t level;
    char message[512];
} heard;

static void hear(void *context, uint32_t level, const char *message)
{
    heard *it = (heard *)context;
    it->count++;
    it->level = level;
    snprintf(it->message, sizeof it->message, "%s", message);
}

/* A failed call is told of with the words of sinew_last_error, if its level was asked for. */
static void messages(void)
{
    sinew_world *world = a_world(0);
    heard it = {0, 0, ""};
    const float gravity[3] = {NAN, 0, 0};
    char last[512];
    uint32_t level = 7;
    sinew_log callback = hear;
    void *context = &it;
    REFUSED("level", sinew_set_log_callback(4, hear, &it));
    MUST(sinew_get_log_callback(&level, &callback, &context));
    CHECK(level == SINEW_LOG_OFF && callback == NULL && context == NULL);
    CHECK(sinew_world_set_gravity(world, gravity) == SINEW_STATUS_INVALID_ARGUMENT && it.count == 0);
    MUST(sinew_set_log_callback(SINEW_LOG_WARNING, hear, &it));
    MUST(sinew_get_log_callback(&level, &callback, &context));
    MUST(sinew_get_log_callback(NULL, NULL, NULL));
    CHECK(level == SINEW_LOG_WARNING && callback == hear && context == &it);
    MUST(sinew_world_step(world, 1e-3f, NULL));
    CHECK(it.count == 0);
    CHECK(sinew_world_set_gravity(world, gravity) == SINEW_STATUS_INVALID_ARGUMENT);
    sinew_last_error(last, sizeof last);
    CHECK(it.count == 1 && it.level == SINEW_LOG_ERROR && strcmp(it.message, last) == 0);
    MUST(sinew_set_log_callback(SINEW_LOG_FAULT, hear, &it));
    CHECK(sinew_world_set_gravity(world, gravity) == SINEW_STATUS_INVALID_ARGUMENT && it.count == 1);
    MUST(sinew_set_log_callback(SINEW_LOG_WARNING, NULL, NULL));
    CHECK(sinew_world_set_gravity(world, gravity) == SINEW_STATUS_INVALID_ARGUMENT && it.count == 1);
    sinew_world_destroy(world);
}

/* An acceleration of a body moves it as gravity of the same size does, with each solver and to the last bit. */
static void accelerations(void)
{
    static const uint32_t solvers[] = {SINEW_SOLVER_VERLET, SINEW_SOLVER_IMPLICIT, SINEW_SOLVER_NEWTON};
    static const float pull[3] = {0, -10, 0}, none[3] = {0, 0, 0}, bad[3] = {0, INFINITY, 0};
    size_t i;
    for (i = 0; i < 3; i++) {
        sinew_world *worlds[2];
        sinew_mesh *mesh = a_block();
        sinew_body_def def = of_mesh(mesh);
        sinew_body_id bodies[2];
        float is[3] = {1, 1, 1};
        uint32_t node, k;
        def.solver = solvers[i];
        for (k = 0; k < 2; k++) {
            worlds[k] = a_world(k == 0 ? -10.0f : 0.0f);
            MUST(sinew_body_create(worlds[k], &def, &bodies[k]));
            MUST(sinew_body_pin(worlds[k], bodies[k], 0));
        }
        MUST(sinew_body_get_acceleration(worlds[1], bodies[1], is));
        CHECK(memcmp(is, none, sizeof is) == 0);
        MUST(sinew_body_set_acceleration(worlds[1], bodies[1], pull));
        REFUSED("acceleration", sinew_body_set_acceleration(worlds[1], bodies[1], bad));
        REFUSED("acceleration", sinew_body_set_acceleration(worlds[1], bodies[1], NULL));
        REFUSED("out", sinew_body_get_acceleration(worlds[1], bodies[1], NULL));
        MUST(sinew_body_get_acceleration(worlds[1], bodies[1], is));
        CHECK(memcmp(is, pull, sizeof is) == 0);
        for (k = 0; k < 2; k++)
            steps(worlds[k], 0.01f, 10);
        for (node = 0; node < 8; node++)
            for (k = 0; k < 3; k++)
                CHECK(position(worlds[0], bodies[0], node, k) == position(worlds[1], bodies[1], node, k));
        CHECK(position(worlds[1], bodies[1], 7, 1) < position(worlds[1], bodies[1], 0, 1) || velocity(worlds[1], bodies[1], 7, 1) != 0);
        sinew_mesh_destroy(mesh);
        sinew_world_destroy(worlds[0]);
        sinew_world_destroy(worlds[1]);
    }
}

/* damping_rate slows down light and heavy nodes alike, beside the drag of each. */
static void damping_rates(void)
{
    static const float positions[6] = {0, 0, 0, 1, 0, 0}, masses[2] = {0.1f, 10}, along[6] = {1, 0, 0, 1, 0, 0};
    static const uint32_t no_springs[2] = {0, 0};
    sinew_world *world = a_world(0);
    sinew_body_def def;
    sinew_body_id body;
    float drag = 0;
    MUST(sinew_body_def_init(&def, sizeof def));
    CHECK(def.damping_rate == 0);
    def.positions = positions;
    def.node_count = 2;
    def.masses = masses;
    def.springs = no_springs;
    def.node_damping = 0.1f;
    def.damping_rate = -1;
    REFUSED("damping_rate", sinew_body_create(world, &def, &body));
    def.damping_rate = NAN;
    REFUSED("damping_rate", sinew_body_create(world, &def, &body));
    def.damping_rate = 2;
    MUST(sinew_body_create(world, &def, &body));
    MUST(sinew_body_get_node_damping(world, body, 0, &drag));
    CHECK_NEAR(drag, 0.1 + 2 * 0.1, 1e-6);
    MUST(sinew_body_set_velocities(world, body, along, 2));
    steps(world, 0.01f, 50);
    CHECK_NEAR(velocity(world, body, 0, 0), exp(-(2 + 0.1 / 0.1) * 0.5), 1e-5);
    CHECK_NEAR(velocity(world, body, 1, 0), exp(-(2 + 0.1 / 10) * 0.5), 1e-5);
    sinew_world_destroy(world);
}

int main(void)
{
    accelerations();
    damping_rates();
    meshes_from_memory();
    a_filled_mesh_is_what_a_surface_becomes();
    a_definition_places_a_body();
    a_body_is_turned_and_moved();
    pins_of_many();
    impulses_and_gravity();
    rays_settings_and_ids();
    blades_and_attachments();
    profiles();
    debug_drawing();
    recordings();
    messages();
    return checked("whole bodies, several pins, rays, settings and user data");
}
