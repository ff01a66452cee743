/* With the portable kernel every system gives the same bits: packaging/others compares what this prints on each of them. Here: any number
 * of threads does. */
#include "scene.h"

static sinew_mesh_view view_of(const sinew_mesh *mesh)
{
    sinew_mesh_view view;
    view.struct_size = sizeof view;
    MUST(sinew_mesh_get_view(mesh, &view));
    return view;
}

static sinew_body_def body_of(sinew_mesh_view shape)
{
    sinew_body_def def;
    MUST(sinew_body_def_init(&def, sizeof def));
    def.positions = shape.positions, def.node_count = shape.node_count;
    def.triangles = shape.triangles, def.triangle_count = shape.triangle_count;
    def.tetrahedra = shape.tetrahedra, def.tetrahedron_count = shape.tetrahedron_count;
    return def;
}

static sinew_tool_id ball(sinew_world *world, float x)
{
    sinew_tool_def def;
    sinew_tool_id tool = {0, 0};
    MUST(sinew_tool_def_init(&def, sizeof def));
    def.shape = SINEW_SHAPE_SPHERE;
    def.radius = 0.02f;
    def.friction = 0.3f;
    def.position[0] = x, def.position[1] = 0.05f;
    MUST(sinew_tool_create(world, &def, &tool));
    return tool;
}

/* A curtain that is cut while a ball sinks into it: bending, springs that stiffen. */
static sinew_body_id a_curtain(sinew_world *world)
{
    static const float size[2] = {0.16f, 0.16f};
    static const uint32_t cells[2] = {12, 12};
    sinew_mesh *mesh = NULL;
    sinew_body_def def;
    sinew_body_id body = {0, 0};
    uint32_t i;
    MUST(sinew_mesh_create_cloth(size, cells, &mesh));
    def = body_of(view_of(mesh));
    def.node_mass = 2e-4f, def.node_damping = 1e-3f, def.stiffness = 200, def.spring_damping = 1e-3f;
    def.bending_stiffness = 1e-5f;
    def.spring_law = SINEW_SPRING_LAW_EXPONENTIAL, def.spring_steepness = 4, def.spring_limit = 0.3f;
    def.spare_nodes = 200;
    MUST(sinew_body_create(world, &def, &body));
    for (i = 0; i < 4; i++)
        MUST(sinew_body_pin(world, body, i % 2 * 12 + i / 2 * 156));
    sinew_mesh_destroy(mesh);
    return body;
}

/* A block of liver on its base, nearly incompressible, that relaxes. */
static void a_block(sinew_world *world)
{
    static const float size[3] = {0.08f, 0.04f, 0.08f};
    static const uint32_t cells[3] = {4, 2, 4};
    sinew_mesh *mesh = NULL;
    sinew_mesh_view shape;
    sinew_body_def def;
    sinew_body_id body = {0, 0};
    float moved[3 * 5 * 3 * 5];
    uint32_t i;
    MUST(sinew_mesh_create_block(size, cells, &mesh));
    shape = view_of(mesh);
    CHECK(shape.node_count == 5 * 3 * 5);
    for (i = 0; i < 3 * shape.node_count; i++)
        moved[i] = shape.positions[i] + (i % 3 == 0 ? 0.3f : 0);
    def = body_of(shape);
    def.positions = moved;
    def.material = SINEW_MATERIAL_TETRAHEDRA;
    def.young_modulus = 5400, def.poisson_ratio = 0.45f, def.density = 1060;
    def.retardation_time = 0.05f, def.relaxation_time = 0.1f;
    def.solver = SINEW_SOLVER_IMPLICIT;
    MUST(sinew_body_create(world, &def, &body));
    for (i = 0; i < shape.node_count; i++)
        if (moved[3 * i + 1] < -0.0199f)
            MUST(sinew_body_pin(world, body, i));
    sinew_mesh_destroy(mesh);
}

static uint64_t hash_with(uint32_t threads)
{
    static const float start[6] = {-0.1f, -0.1f, 0.03f, -0.1f, 0.1f, 0.03f}, end[6] = {0.02f, -0.1f, 0.031f, 0.02f, 0.1f, 0.031f};
    sinew_world_def def;
    sinew_world *world = NULL;
    sinew_body_id curtain;
    sinew_tool_id tools[2];
    sinew_cut_report cut;
    uint64_t hash;
    int frame, i;
    MUST(sinew_world_def_init(&def, sizeof def));
    def.thread_count = threads;
    def.kernel = SINEW_KERNEL_PORTABLE;
    MUST(sinew_world_create(&def, &world));
    curtain = a_curtain(world);
    a_block(world);
    tools[0] = ball(world, 0), tools[1] = ball(world, 0.3f);
    for (frame = 0; frame < 10; frame++) {
        const float place[2][3] = {{0.002f * frame, 0.02f - 0.005f * frame, 0}, {0.3f, 0.045f - 0.002f * frame, 0}};
        for (i = 0; i < 2; i++)
            MUST(sinew_tool_set_pose(world, tools[i], place[i], NULL));
        MUST(sinew_world_step(world, 1.0f / 60, NULL));
        if (frame == 5) {
            cut.struct_size = sizeof cut;
            MUST(sinew_body_cut(world, curtain, start, end, &cut));
            CHECK(cut.new_nodes > 0);
        }
    }
    for (i = 0; i < 2; i++) {
        float force[3], torque[3];
        MUST(sinew_tool_get_wrench(world, tools[i], force, torque));
        CHECK(force[1] > 0); /* both press */
    }
    hash = hash_of(world);
    sinew_world_destroy(world);
    return hash;
}

int main(void)
{
    char line[64];
    const uint64_t hash = hash_with(1);
    CHECK(hash_with(3) == hash);
    snprintf(line, sizeof line, "same_bits: %08lx%08lx", (unsigned long)(hash >> 32), (unsigned long)(hash & 0xffffffffu));
    return checked(line);
}
