/* Every function that takes a struct with a struct_size refuses a size that no header gave it, by the argument's name and that size, and
 * takes the right one then. tests/project/header.rs sees to it that none is left out. */
#include "check.h"

#include <stdint.h>

/* What a caller leaves there who forgets it: nothing, something small, what lay on the stack, a pointer. */
static const size_t unknown[] = {0, 1, 13, 4096, (size_t)0xA5A5A5A5A5A5A5A5, (size_t)0x7FFD12345678, SIZE_MAX};
enum { UNKNOWN = sizeof unknown / sizeof unknown[0] };

static void refused(sinew_status status, const char *name, size_t size, const char *call)
{
    char message[512] = "", expected[128];
    sinew_last_error(message, sizeof message);
    snprintf(expected, sizeof expected, "%s is %llu:", name, (unsigned long long)size);
    if (status == SINEW_STATUS_INVALID_ARGUMENT && strncmp(message, expected, strlen(expected)) == 0)
        return;
    failures++;
    fprintf(stderr, "%s: %s, \"%s\" instead of \"%s\"\n", call, sinew_status_name(status), message, expected);
}

/* A call that reads `set`, the struct_size of its argument `name`. */
#define SIZES(name, type, set, call)                                           \
    do {                                                                       \
        size_t i_;                                                             \
        for (i_ = 0; i_ < UNKNOWN + 2; i_++) {                                 \
            (set) = i_ < UNKNOWN ? unknown[i_] : sizeof(type) + (i_ == UNKNOWN ? 1 : 8); \
            refused((call), name, (set), #call);                               \
        }                                                                      \
        (set) = sizeof(type);                                                  \
        MUST(call);                                                            \
    } while (0)

/* A definition, filled by its function. */
#define DEFINITION(kind, def)                                                  \
    sinew_##kind##_def def;                                                    \
    do {                                                                       \
        size_t size_;                                                          \
        SIZES("struct_size", sinew_##kind##_def, size_, sinew_##kind##_def_init(&def, size_)); \
    } while (0)

static void take(sinew_body_def *def, const sinew_mesh_view *shape)
{
    def->positions = shape->positions;
    def->node_count = shape->node_count;
    def->tetrahedra = shape->tetrahedra;
    def->tetrahedron_count = shape->tetrahedron_count;
    def->node_mass = 1e-3f;
    def->stiffness = 500;
    def->spare_nodes = 4000;
}

int main(void)
{
    static const float size[3] = {0.1f, 0.1f, 0.1f}, from[3] = {0.013f, 1, 0.017f}, down[3] = {0, -1, 0};
    static const float start[6] = {0.31f, 0.01f, -0.2f, 0.31f, 0.2f, -0.2f}, end[6] = {0.31f, 0.01f, 0.2f, 0.31f, 0.2f, 0.2f};
    static const float weights[3] = {1, 0, 0};
    static const uint32_t cells[3] = {2, 2, 2};
    sinew_world *world;
    sinew_mesh *mesh;
    sinew_mesh_view shape;
    sinew_body_id body, other, filled;
    sinew_tool_id tool;
    sinew_blade_id blade;
    sinew_attachment_id suture;
    sinew_haptic *haptic;
    sinew_reader *reader;
    sinew_detector *detector;
    sinew_embedding *embedding;
    float far_away[3 * 27];
    size_t i;
    {
        DEFINITION(world, def);
        SIZES("def->struct_size", sinew_world_def, def.struct_size, sinew_world_create(&def, &world));
    }
    MUST(sinew_mesh_create_block(size, cells, &mesh));
    SIZES("out->struct_size", sinew_mesh_view, shape.struct_size, sinew_mesh_get_view(mesh, &shape));
    {
        DEFINITION(body, def);
        take(&def, &shape);
        SIZES("def->struct_size", sinew_body_def, def.struct_size, sinew_body_create(world, &def, &body));
        CHECK(shape.node_count == 27);
        for (i = 0; i < 3 * 27; i++)
            far_away[i] = shape.positions[i] + (i % 3 == 0 ? 0.3f : 0);
        def.positions = far_away;
        MUST(sinew_body_create(world, &def, &other));
        SIZES("def->struct_size", sinew_body_def, def.struct_size, sinew_body_def_set_mesh(&def, mesh));
        MUST(sinew_body_def_init(&def, sizeof def));
        def.positions = shape.positions;
        def.node_count = shape.node_count;
        def.triangles = shape.triangles;
        def.triangle_count = shape.triangle_count;
        def.node_mass = 1e-3f;
        def.stiffness = 50;
        SIZES("def->struct_size", sinew_body_def, def.struct_size,
              sinew_body_create_from_surface(world, &def, 0.05f, &filled, &embedding));
        sinew_embedding_destroy(embedding);
        MUST(sinew_body_destroy(world, filled));
    }
    {
        sinew_surface_point point;
        SIZES("out->struct_size", sinew_surface_point, point.struct_size, sinew_world_cast_ray(world, from, down, 2, &point));
        SIZES("out->struct_size", sinew_surface_point, point.struct_size, sinew_world_find_nearest(world, from, 2, &point));
    }
    {
        sinew_world_def def;
        sinew_world *twin;
        uint8_t *bytes;
        size_t size = 0;
        MUST(sinew_world_get_snapshot_size(world, &size));
        bytes = (uint8_t *)malloc(size);
        CHECK(bytes != NULL);
        MUST(sinew_world_save_snapshot(world, bytes, size));
        MUST(sinew_world_def_init(&def, sizeof def));
        SIZES("def->struct_size", sinew_world_def, def.struct_size, sinew_world_load_snapshot(bytes, size, &def, &twin));
        sinew_world_destroy(twin);
        free(bytes);
    }
    {
        sinew_profile profile;
        MUST(sinew_world_set_profiling(world, 1));
        SIZES("out->struct_size", sinew_profile, profile.struct_size, sinew_world_get_profile(world, &profile));
    }
    {
        sinew_debug_draw draw;
        SIZES("struct_size", sinew_debug_draw, draw.struct_size, sinew_debug_draw_init(&draw, draw.struct_size));
        MUST(sinew_debug_draw_init(&draw, sizeof draw));
        SIZES("def->struct_size", sinew_debug_draw, draw.struct_size, sinew_world_debug_draw(world, &draw));
    }
    {
        sinew_replay_report replay;
        const char *folder = getenv("TMPDIR");
        char path[512];
        snprintf(path, sizeof path, "%s/sinew_sizes_%p.recording", folder == NULL ? "/tmp" : folder, (void *)world);
        MUST(sinew_world_start_recording(world, path));
        MUST(sinew_world_stop_recording(world, NULL));
        SIZES("out->struct_size", sinew_replay_report, replay.struct_size, sinew_replay(path, 1, &replay));
        remove(path);
    }
    {
        sinew_ray_hit hit;
        SIZES("out->struct_size", sinew_ray_hit, hit.struct_size, sinew_world_cast_ray_filtered(world, from, down, 2, 1, 1, &hit));
    }
    {
        DEFINITION(embedding, def);
        def.vertices = shape.positions;
        def.vertex_count = shape.node_count;
        SIZES("def->struct_size", sinew_embedding_def, def.struct_size, sinew_embedding_create(world, body, &def, &embedding));
        sinew_embedding_destroy(embedding);
    }
    {
        DEFINITION(attachment, def);
        def.body = body;
        def.other = other;
        def.nodes = def.other_nodes = cells;
        def.count = 1;
        SIZES("def->struct_size", sinew_attachment_def, def.struct_size, sinew_attachment_create(world, &def, &suture));
        MUST(sinew_attachment_release(world, suture));
    }
    {
        DEFINITION(suture, def);
        sinew_suture_report report;
        sinew_surface_point point, other_point;
        memset(&point, 0, sizeof point);
        point.struct_size = sizeof point;
        memcpy(point.weights, weights, sizeof weights);
        other_point = point;
        point.body = body;
        other_point.body = other;
        SIZES("point->struct_size", sinew_surface_point, point.struct_size,
              sinew_suture_create(world, &point, &other_point, &def, &suture));
        MUST(sinew_attachment_release(world, suture));
        SIZES("def->struct_size", sinew_suture_def, def.struct_size,
              sinew_suture_create(world, &point, &other_point, &def, &suture));
        SIZES("out_report->struct_size", sinew_suture_report, report.struct_size, sinew_suture_get_report(world, suture, &report));
        MUST(sinew_attachment_release(world, suture));
    }
    {
        DEFINITION(detector, def);
        sinew_detector_report report;
        def.bodies[0] = body;
        def.bodies[1] = other;
        def.pixel = 0.01f;
        SIZES("def->struct_size", sinew_detector_def, def.struct_size, sinew_detector_create(world, &def, &detector));
        SIZES("out_report->struct_size", sinew_detector_report, report.struct_size, sinew_detector_find(detector, world, &report));
        sinew_detector_destroy(detector);
    }
    {
        DEFINITION(tool, def);
        def.shape = SINEW_SHAPE_SPHERE;
        def.radius = 0.01f;
        def.position[1] = 1;
        SIZES("def->struct_size", sinew_tool_def, def.struct_size, sinew_tool_create(world, &def, &tool));
        {
            sinew_mass_properties mass;
            SIZES("out->struct_size", sinew_mass_properties, mass.struct_size,
                  sinew_tool_get_mass_of_density(world, tool, 1000, &mass));
            SIZES("mass->struct_size", sinew_mass_properties, mass.struct_size, sinew_tool_set_mass(world, tool, &mass));
            SIZES("out->struct_size", sinew_mass_properties, mass.struct_size, sinew_tool_get_mass(world, tool, &mass));
            MUST(sinew_tool_set_mass(world, tool, NULL));
        }
    }
    {
        DEFINITION(haptic, def);
        sinew_haptic_report result;
        def.tool = tool;
        SIZES("def->struct_size", sinew_haptic_def, def.struct_size, sinew_haptic_create(world, &def, &haptic));
        SIZES("out->struct_size", sinew_haptic_report, result.struct_size,
              sinew_haptic_tick(haptic, from, NULL, NULL, NULL, 1e-3f, &result));
        sinew_haptic_destroy(haptic);
    }
    {
        DEFINITION(blade, def);
        sinew_blade_report report;
        def.edge[1] = 0.01f;
        def.position[1] = 1;
        SIZES("def->struct_size", sinew_blade_def, def.struct_size, sinew_blade_create(world, &def, &blade));
        SIZES("out->struct_size", sinew_blade_report, report.struct_size, sinew_blade_get_report(world, blade, &report));
    }
    {
        sinew_step_report report;
        sinew_frame frame;
        SIZES("report->struct_size", sinew_step_report, report.struct_size, sinew_world_step(world, 1e-3f, &report));
        SIZES("report->struct_size", sinew_step_report, report.struct_size,
              sinew_world_step_with_budget(world, 1e-3f, 100, &report));
        SIZES("report->struct_size", sinew_step_report, report.struct_size,
              sinew_world_step_within(world, 1e-3f, 1, &report));
        MUST(sinew_reader_create(world, body, &reader));
        SIZES("out->struct_size", sinew_frame, frame.struct_size, sinew_reader_read(reader, &frame));
        sinew_reader_destroy(reader);
    }
    {
        sinew_energy energy;
        sinew_storage_report storage;
        sinew_solver_report solver;
        sinew_body_settings settings;
        sinew_enclosed_report enclosed;
        sinew_tear_report torn;
        sinew_material_preset preset;
        SIZES("out->struct_size", sinew_energy, energy.struct_size, sinew_body_get_energy(world, body, &energy));
        SIZES("out->struct_size", sinew_storage_report, storage.struct_size, sinew_body_get_storage_report(world, body, &storage));
        SIZES("out->struct_size", sinew_solver_report, solver.struct_size, sinew_body_get_solver_report(world, body, &solver));
        SIZES("out->struct_size", sinew_body_settings, settings.struct_size, sinew_body_get_settings(world, body, &settings));
        SIZES("settings->struct_size", sinew_body_settings, settings.struct_size,
              sinew_body_set_settings(world, body, &settings));
        SIZES("out->struct_size", sinew_enclosed_report, enclosed.struct_size, sinew_body_get_enclosed_report(world, body, &enclosed));
        SIZES("out->struct_size", sinew_tear_report, torn.struct_size, sinew_body_get_tear_report(world, body, &torn));
        SIZES("out->struct_size", sinew_material_preset, preset.struct_size,
              sinew_material_get_preset(SINEW_PRESET_LIVER, &preset));
    }
    {
        static const uint32_t corners[4] = {0, 2, 6, 8};
        DEFINITION(equilibrium, def);
        sinew_equilibrium_report report;
        for (i = 0; i < 4; i++)
            MUST(sinew_body_pin(world, body, corners[i]));
        SIZES("def->struct_size", sinew_equilibrium_def, def.struct_size, sinew_body_solve_equilibrium(world, body, &def, NULL));
        SIZES("out_report->struct_size", sinew_equilibrium_report, report.struct_size, sinew_body_solve_equilibrium(world, body, NULL, &report));
    }
    {
        sinew_cut_report report;
        sinew_topology_changes changes;
        SIZES("out_report->struct_size", sinew_cut_report, report.struct_size, sinew_body_cut(world, other, start, end, &report));
        SIZES("out->struct_size", sinew_topology_changes, changes.struct_size,
              sinew_body_get_topology_changes(world, other, 0, &changes));
    }
    {
        DEFINITION(picture, def);
        const char *nowhere = "/nowhere/at/all.png";
        for (i = 0; i < UNKNOWN; i++) {
            def.struct_size = unknown[i];
            refused(sinew_world_save_picture(world, &def, nowhere), "def->struct_size", def.struct_size, "save_picture");
            refused(sinew_world_save_picture_of_values(world, &def, NULL, 0, nowhere), "def->struct_size", def.struct_size,
                    "save_picture_of_values");
        }
    }
    sinew_mesh_destroy(mesh);
    sinew_world_destroy(world);
    return checked("a struct_size that no header ever gave is refused everywhere");
}
