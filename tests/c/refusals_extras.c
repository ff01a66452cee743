/* What the functions beside the core refuse: meshes and pictures. */
#include "refusals.h"

static const float good_size[] = {1, 1, 1};
static const uint32_t good_cells[] = {2, 2, 2};

static void loading(void)
{
    int i;
    REFUSED(INVALID, "path", sinew_mesh_load(NULL, SINEW_MESH_FORMAT_AUTO, 1.0f, &out.mesh));
    REFUSED(INVALID, "out", sinew_mesh_load("there/is/no.obj", SINEW_MESH_FORMAT_AUTO, 1.0f, NULL));
    REFUSED(INVALID, "format", sinew_mesh_load("there/is/no.obj", 6, 1.0f, &out.mesh));
    REFUSED(INVALID, "format", sinew_mesh_load("there/is/no.obj", UINT32_MAX, 1.0f, &out.mesh));
    for (i = 0; i < OR_ZERO; i++)
        REFUSED(INVALID, "scale", sinew_mesh_load("there/is/no.obj", SINEW_MESH_FORMAT_AUTO, bad[i], &out.mesh));
    REFUSED(SINEW_STATUS_IO, "no.obj", sinew_mesh_load("there/is/no.obj", SINEW_MESH_FORMAT_AUTO, 1.0f, &out.mesh));
    REFUSED(SINEW_STATUS_IO, "no.vtk", sinew_mesh_load("there/is/no.vtk", SINEW_MESH_FORMAT_VTK, 1.0f, &out.mesh));
}

static void shapes(void)
{
    size_t i, axis;
    REFUSED(INVALID, "size", sinew_mesh_create_cloth(NULL, good_cells, &out.mesh));
    REFUSED(INVALID, "cells", sinew_mesh_create_cloth(good_size, NULL, &out.mesh));
    REFUSED(INVALID, "out", sinew_mesh_create_cloth(good_size, good_cells, NULL));
    REFUSED(INVALID, "size", sinew_mesh_create_block(NULL, good_cells, &out.mesh));
    REFUSED(INVALID, "cells", sinew_mesh_create_block(good_size, NULL, &out.mesh));
    REFUSED(INVALID, "out", sinew_mesh_create_block(good_size, good_cells, NULL));
    REFUSED(INVALID, "cells", sinew_mesh_create_lattice(0.1f, NULL, &out.mesh));
    REFUSED(INVALID, "out", sinew_mesh_create_lattice(0.1f, good_cells, NULL));
    REFUSED(INVALID, "out", sinew_mesh_create_organ(0.2f, 0.02f, NULL));
    for (axis = 0; axis < 3; axis++) {
        const uint32_t none[] = {0, UINT32_MAX};
        for (i = 0; i < OR_ZERO; i++) {
            if (axis < 2)
                REFUSED(INVALID, "size", sinew_mesh_create_cloth(spoiled(good_size, 2, axis, bad[i]), good_cells, &out.mesh));
            REFUSED(INVALID, "size", sinew_mesh_create_block(spoiled(good_size, 3, axis, bad[i]), good_cells, &out.mesh));
        }
        for (i = 0; i < 2; i++) {
            if (axis < 2)
                REFUSED(INVALID, "cells", sinew_mesh_create_cloth(good_size, renumbered(good_cells, 2, axis, none[i]), &out.mesh));
            REFUSED(INVALID, "cells", sinew_mesh_create_block(good_size, renumbered(good_cells, 3, axis, none[i]), &out.mesh));
            REFUSED(INVALID, "cells", sinew_mesh_create_lattice(0.1f, renumbered(good_cells, 3, axis, none[i]), &out.mesh));
        }
    }
    for (i = 0; i < OR_ZERO; i++) {
        REFUSED(INVALID, "edge", sinew_mesh_create_lattice(bad[i], good_cells, &out.mesh));
        REFUSED(INVALID, "length", sinew_mesh_create_organ(bad[i], 0.02f, &out.mesh));
        REFUSED(INVALID, "spacing", sinew_mesh_create_organ(0.2f, bad[i], &out.mesh));
    }
}

static void views(void)
{
    sinew_mesh *mesh = NULL;
    MUST(sinew_mesh_create_block(good_size, good_cells, &mesh));
    REFUSED(INVALID, "mesh", sinew_mesh_get_view(NULL, &out.mesh_view));
    REFUSED(INVALID, "out", sinew_mesh_get_view(mesh, NULL));
    REFUSES_RESULT_SIZES(sinew_mesh_view, offsetof(sinew_mesh_view, cells), mesh_view, sinew_mesh_get_view(mesh, &out.mesh_view));
    sinew_mesh_destroy(mesh);
    sinew_mesh_destroy(NULL);
}

static void presets(void)
{
    REFUSED(INVALID, "out", sinew_material_get_preset(SINEW_PRESET_LIVER, NULL));
    REFUSED(INVALID, "preset", sinew_material_get_preset(SINEW_PRESET_HEPATIC_ARTERY + 1, &out.preset));
    REFUSED(INVALID, "preset", sinew_material_get_preset(UINT32_MAX, &out.preset));
    REFUSES_RESULT_SIZES(sinew_material_preset, sizeof(sinew_material_preset), preset,
                         sinew_material_get_preset(SINEW_PRESET_LIVER, &out.preset));
}

static sinew_picture_def good_picture(void)
{
    sinew_picture_def def;
    MUST(sinew_picture_def_init(&def, sizeof def));
    def.width = 32;
    def.height = 24;
    return def;
}

#define PICTURE(word, change)                                                  \
    do {                                                                       \
        sinew_picture_def def = good_picture();                                \
        change;                                                                \
        REFUSED_WITH(INVALID, word, sinew_world_save_picture(the.world, &def, "must_not_be_written.png"), #change); \
    } while (0)

static void pictures(void)
{
    const sinew_picture_def good = good_picture();
    int i, axis;
    REFUSED(INVALID, "def", sinew_picture_def_init(NULL, sizeof(sinew_picture_def)));
    REFUSES_SIZES(sinew_picture_def, sizeof(sinew_picture_def), (void)0, sinew_picture_def_init(&out.picture_def, size));
    REFUSED(INVALID, "world", sinew_world_save_picture(NULL, &good, "must_not_be_written.png"));
    REFUSED(INVALID, "path", sinew_world_save_picture(the.world, &good, NULL));
    REFUSED(INVALID, "path", sinew_world_save_picture(the.world, NULL, NULL));
    REFUSED(SINEW_STATUS_IO, "no.png", sinew_world_save_picture(the.world, &good, "there/is/no.png"));
    REFUSES_SIZES(sinew_picture_def, sizeof(sinew_picture_def),
                  sinew_picture_def def = good_picture(); def.struct_size = size,
                  sinew_world_save_picture(the.world, &def, "must_not_be_written.png"));
    PICTURE("show_contacts", def.show_contacts = 2);
    PICTURE("show_contacts", def.show_contacts = UINT32_MAX);
    PICTURE("width", def.width = 0);
    PICTURE("width", def.width = 16385);
    PICTURE("height", def.height = 0);
    PICTURE("height", def.height = UINT32_MAX);
    for (i = 0; i < OR_ZERO; i++)
        PICTURE("field_of_view", def.field_of_view = bad[i]);
    PICTURE("field_of_view", def.field_of_view = 3.1415927f);
    for (i = 0; i < NOT_FINITE; i++)
        for (axis = 0; axis < 3; axis++) {
            PICTURE("eye", def.eye[axis] = bad[i]);
            PICTURE("target", def.target[axis] = bad[i]);
            PICTURE("up", def.up[axis] = bad[i]);
            PICTURE("direction", def.direction[axis] = bad[i]);
        }
    CHECK(fopen("must_not_be_written.png", "rb") == NULL);
}

static void queries(void)
{
    const float place[] = {0.1f, 0.2f, 0.3f}, none[] = {0, 0, 0};
    sinew_surface_point *point = &out.surface_point;
    size_t i, axis;
    REFUSED(INVALID, "world", sinew_world_cast_ray(NULL, place, place, 1.0f, point));
    REFUSED(INVALID, "origin", sinew_world_cast_ray(the.world, NULL, place, 1.0f, point));
    REFUSED(INVALID, "direction", sinew_world_cast_ray(the.world, place, NULL, 1.0f, point));
    REFUSED(INVALID, "direction", sinew_world_cast_ray(the.world, place, none, 1.0f, point));
    REFUSED(INVALID, "out", sinew_world_cast_ray(the.world, place, place, 1.0f, NULL));
    REFUSED(INVALID, "max_distance", sinew_world_cast_ray(the.world, place, place, -1.0f, point));
    REFUSED(INVALID, "world", sinew_world_find_nearest(NULL, place, 1.0f, point));
    REFUSED(INVALID, "point", sinew_world_find_nearest(the.world, NULL, 1.0f, point));
    REFUSED(INVALID, "out", sinew_world_find_nearest(the.world, place, 1.0f, NULL));
    REFUSED(INVALID, "max_distance", sinew_world_find_nearest(the.world, place, -1.0f, point));
    REFUSED(INVALID, "max_distance", sinew_world_cast_ray(the.world, place, place, NAN, point));
    REFUSED(INVALID, "max_distance", sinew_world_find_nearest(the.world, place, NAN, point));
    for (i = 0; i < NOT_FINITE; i++)
        for (axis = 0; axis < 3; axis++) {
            REFUSED(INVALID, "origin", sinew_world_cast_ray(the.world, spoiled(place, 3, axis, bad[i]), place, 1.0f, point));
            REFUSED(INVALID, "direction", sinew_world_cast_ray(the.world, place, spoiled(place, 3, axis, bad[i]), 1.0f, point));
            REFUSED(INVALID, "point", sinew_world_find_nearest(the.world, spoiled(place, 3, axis, bad[i]), 1.0f, point));
        }
    REFUSES_RESULT_SIZES(sinew_surface_point, sizeof(sinew_surface_point), surface_point,
                         sinew_world_cast_ray(the.world, place, place, 1.0f, point));
    REFUSES_RESULT_SIZES(sinew_surface_point, sizeof(sinew_surface_point), surface_point,
                         sinew_world_find_nearest(the.world, place, 1.0f, point));
}

int main(void)
{
    set_up();
    loading();
    shapes();
    views();
    presets();
    pictures();
    queries();
    return tear_down();
}
