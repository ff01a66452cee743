/* Springs and regions changed and strain read while a body runs. */
#include "check.h"

#define NODES 27
#define LENGTH 0.02f

static sinew_mesh *mesh;
static sinew_mesh_view shape;

static sinew_body_id create_body(sinew_world *world, uint32_t material)
{
    sinew_body_def def;
    sinew_body_id body = {0, 0};
    MUST(sinew_body_def_init(&def, sizeof def));
    def.positions = shape.positions, def.node_count = shape.node_count;
    def.tetrahedra = shape.tetrahedra, def.tetrahedron_count = shape.tetrahedron_count;
    def.material = material, def.young_modulus = 3000.0f, def.density = 1000.0f, def.node_damping = 1e-2f;
    def.poisson_ratio = material == SINEW_MATERIAL_TETRAHEDRA ? 0.3f : 0.0f;
    MUST(sinew_body_create(world, &def, &body));
    return body;
}

static sinew_world *create_world(void)
{
    sinew_world_def def;
    sinew_world *world = NULL;
    MUST(sinew_world_def_init(&def, sizeof def));
    def.gravity[1] = 0.0f;
    MUST(sinew_world_create(&def, &world));
    return world;
}

/* A tumour swells and grows hard. */
static void swell(sinew_world *world, sinew_body_id organ, const uint32_t *nodes, size_t node_count)
{
    int frame;
    for (frame = 0; frame < 60; frame++) {
        MUST(sinew_body_scale_region(world, organ, nodes, node_count, 1.02f, 1.002f)); /* factors of each call multiply */
        MUST(sinew_world_step(world, 1.0f / 60, NULL));
    }
}

/* All of a free block swells: it is as much larger in the end, and strained by that against what it was. */
static void swelling(uint32_t material)
{
    sinew_world *world = create_world();
    sinew_body_id body = create_body(world, material);
    uint32_t nodes[NODES], i;
    sinew_strain strains[64];
    double factor = 1;
    for (i = 0; i < NODES; i++)
        nodes[i] = i;
    for (i = 0; i < 60; i++)
        factor *= 1.002f;
    swell(world, body, nodes, NODES);
    for (i = 0; i < 600; i++)
        MUST(sinew_world_step(world, 1.0f / 60, NULL));
    CHECK(shape.tetrahedron_count <= 64);
    MUST(sinew_body_get_tetrahedron_strains(world, body, shape.positions, shape.node_count, shape.tetrahedra,
                                            shape.tetrahedron_count, strains));
    for (i = 0; i < shape.tetrahedron_count; i++) {
        CHECK_NEAR(strains[i].largest, factor - 1, 1e-4);
        CHECK_NEAR(strains[i].smallest, factor - 1, 1e-4);
        CHECK_NEAR(strains[i].growth, factor * factor * factor - 1, 4e-4);
    }
    MUST(sinew_body_get_triangle_strains(world, body, shape.positions, shape.node_count, shape.surface, 48, strains));
    for (i = 0; i < 48; i++)
        CHECK_NEAR(strains[i].growth, factor * factor - 1, 3e-4);
    sinew_world_destroy(world);
}

static void springs(void)
{
    sinew_world *world = create_world();
    sinew_body_id body = create_body(world, SINEW_MATERIAL_SPRINGS);
    sinew_storage_report report;
    uint32_t *pairs;
    float *stiffnesses, *lengths, *strains, means[NODES];
    size_t count, i;
    report.struct_size = sizeof report;
    MUST(sinew_body_get_storage_report(world, body, &report));
    count = report.spring_count;
    pairs = (uint32_t *)calloc(2 * count, sizeof *pairs);
    stiffnesses = (float *)calloc(3 * count, sizeof *stiffnesses);
    lengths = stiffnesses + count, strains = lengths + count;
    MUST(sinew_body_get_spring_pairs(world, body, pairs, count));
    MUST(sinew_body_get_springs(world, body, pairs, count, stiffnesses, lengths));
    for (i = 0; i < count; i++) {
        CHECK(pairs[2 * i] < pairs[2 * i + 1] && pairs[2 * i + 1] < NODES);
        CHECK(stiffnesses[i] > 0 && lengths[i] > 0.4f * LENGTH);
        stiffnesses[i] *= 2, lengths[i] /= 1.25f;
    }
    MUST(sinew_body_set_springs(world, body, pairs, stiffnesses, NULL, count));
    MUST(sinew_body_set_springs(world, body, pairs, NULL, lengths, count));
    MUST(sinew_body_get_spring_strains(world, body, pairs, NULL, count, strains));
    for (i = 0; i < count; i++)
        CHECK_NEAR(strains[i], 0.25, 1e-5);
    MUST(sinew_util_average_to_nodes(pairs, 2, strains, count, means, NODES));
    for (i = 0; i < NODES; i++)
        CHECK_NEAR(means[i], 0.25, 1e-5);
    for (i = 0; i < count; i++)
        lengths[i] *= 1.25f;
    MUST(sinew_body_get_spring_strains(world, body, pairs, lengths, count, strains));
    for (i = 0; i < count; i++)
        CHECK_NEAR(strains[i], 0, 1e-5);
    MUST(sinew_body_get_springs(world, body, pairs, count, lengths, NULL));
    for (i = 0; i < count; i++)
        CHECK(lengths[i] == stiffnesses[i]);
    free(pairs);
    free(stiffnesses);
    sinew_world_destroy(world);
}

int main(void)
{
    const float size[] = {LENGTH, LENGTH, LENGTH};
    const uint32_t cells[] = {2, 2, 2};
    shape.struct_size = sizeof shape;
    MUST(sinew_mesh_create_block(size, cells, &mesh));
    MUST(sinew_mesh_get_view(mesh, &shape));
    CHECK(shape.node_count == NODES && shape.surface_triangle_count == 48);
    swelling(SINEW_MATERIAL_SPRINGS);
    swelling(SINEW_MATERIAL_TETRAHEDRA);
    springs();
    sinew_mesh_destroy(mesh);
    return checked("springs and regions change, and strain is read");
}
