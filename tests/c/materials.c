/* Tissue by a laboratory's numbers: a body of cells pulled by a known force, its weight, presets, and shapes that C makes. */
#include "scene.h"

/* A bar of liver, 100 mm long and 20 mm thick, of cubes of 5 mm. */
static sinew_body_id a_bar_of_liver(sinew_world *world)
{
    const uint32_t cells[3] = {20, 4, 4};
    sinew_mesh *mesh;
    sinew_mesh_view shape;
    sinew_material_preset liver;
    sinew_body_def def;
    sinew_body_id body = {0, 0};
    shape.struct_size = sizeof shape, liver.struct_size = sizeof liver;
    MUST(sinew_mesh_create_lattice(0.005f, cells, &mesh));
    MUST(sinew_mesh_get_view(mesh, &shape));
    MUST(sinew_material_get_preset(SINEW_PRESET_LIVER, &liver));
    MUST(sinew_body_def_init(&def, sizeof def));
    def.positions = shape.positions, def.node_count = shape.node_count;
    def.cells = shape.cells, def.cell_count = shape.cell_count;
    def.material = SINEW_MATERIAL_SPRINGS;
    def.young_modulus = liver.young_modulus; /* 5400 Pa; Poisson's ratio is 1/4 */
    def.density = liver.density;             /* 1060 kg/m3, in place of node_mass */
    MUST(sinew_body_create(world, &def, &body));
    sinew_mesh_destroy(mesh);
    return body;
}

enum { ROW = 21, END = 5 * 5 };

static void a_bar_is_as_long_as_its_numbers_say(void)
{
    sinew_world *world = a_world(0.0f);
    const sinew_body_id body = a_bar_of_liver(world);
    const float area = 0.02f * 0.02f, strain = 0.004f;
    const float force = strain * 5400.0f * area / 16;
    size_t i;
    double length = 0, width;
    for (i = 0; i < END; i++) {
        /* Half of it at each edge of the end, and again at a corner. */
        const float share = (i % 5 % 4 ? 1.0f : 0.5f) * (i / 5 % 4 ? 1.0f : 0.5f);
        const float right[3] = {force * share, 0, 0}, left[3] = {-force * share, 0, 0};
        MUST(sinew_body_apply_force(world, body, (uint32_t)(i * ROW), left));
        MUST(sinew_body_apply_force(world, body, (uint32_t)(i * ROW + ROW - 1), right));
    }
    MUST(sinew_body_solve_equilibrium(world, body, NULL, NULL));
    for (i = 0; i < END; i++)
        length += (position(world, body, i * ROW + ROW - 1, 0) - position(world, body, i * ROW, 0)) / END;
    CHECK_NEAR((length / 0.1 - 1) / strain, 1.0, 0.01);
    width = position(world, body, 4 * ROW, 1) - position(world, body, 0, 1);
    CHECK_NEAR((1 - width / 0.02) / strain, 0.25, 0.005);
    sinew_world_destroy(world);
}

static void a_bar_weighs_as_its_density_says(void)
{
    sinew_world *world = a_world(-10.0f);
    const sinew_body_id body = a_bar_of_liver(world);
    double held = 0;
    uint32_t i;
    for (i = 0; i < ROW * END; i++)
        MUST(sinew_body_pin(world, body, i));
    steps(world, 0.001f, 1);
    for (i = 0; i < ROW * END; i++) {
        float force[3];
        MUST(sinew_body_get_pin_force(world, body, i, force));
        held += force[1];
    }
    CHECK_NEAR(held / (10.0 * 1060.0 * 0.1 * 0.02 * 0.02), 1.0, 1e-5);
    sinew_world_destroy(world);
}

static void presets_have_figures_and_sources(void)
{
    sinew_material_preset preset;
    uint32_t i;
    preset.struct_size = sizeof preset;
    for (i = 0; sinew_material_get_preset(i, &preset) == SINEW_STATUS_OK; i++) {
        CHECK(strlen(preset.name) > 0 && strstr(preset.source, "PMC") != NULL);
        CHECK(preset.young_modulus == 3.0f * preset.shear_modulus && preset.density > 0.0f);
    }
    CHECK(i == SINEW_PRESET_HEPATIC_ARTERY + 1);
}

static void a_lattice_shows_its_cells(void)
{
    const uint32_t cells[3] = {2, 3, 4};
    sinew_mesh *mesh;
    sinew_mesh_view view;
    view.struct_size = sizeof view;
    MUST(sinew_mesh_create_lattice(0.5f, cells, &mesh));
    MUST(sinew_mesh_get_view(mesh, &view));
    CHECK(view.cell_count == 24 && view.node_count == 60 && view.tetrahedron_count == 0 && view.is_closed == 1);
    CHECK(view.cells[0] == 0 && view.cells[1] == 1 && view.cells[2] == 3 && view.cells[4] == 12);
    CHECK(view.surface_triangle_count == 2 * 2 * (6 + 8 + 12) && view.triangle_count == view.surface_triangle_count);
    /* What an older program knows of it. */
    view.struct_size = offsetof(sinew_mesh_view, cells);
    view.cell_count = 7;
    MUST(sinew_mesh_get_view(mesh, &view));
    CHECK(view.cell_count == 7 && view.node_count == 60);
    sinew_mesh_destroy(mesh);
}

int main(void)
{
    a_bar_is_as_long_as_its_numbers_say();
    a_bar_weighs_as_its_density_says();
    presets_have_figures_and_sources();
    a_lattice_shows_its_cells();
    return checked("materials are what their numbers say");
}
