/* What is drawn of a body and not solved: a surface bound to it, and tissue made of a surface. */
#include "scene.h"

/* An octahedron with its faces divided and put on a ball: each triangle with corners of its own, as in an STL file. */
enum { PARTS = 16, TRIANGLES = 8 * PARTS * PARTS, VERTICES = 3 * TRIANGLES };

static float vertices[3 * VERTICES];
static uint32_t triangles[3 * TRIANGLES];

/* The corner i, j of a face whose corners are at 1 along the axes, some of them turned. */
static void corner(float *to, const float *sides, int i, int j, int turned)
{
    const float at[3] = {(float)i, (float)j, (float)(PARTS - i - j)};
    const float length = sqrtf(at[0] * at[0] + at[1] * at[1] + at[2] * at[2]);
    int axis;
    for (axis = 0; axis < 3; axis++)
        to[axis] = 0.05f * sides[axis] * at[turned ? (axis == 0 ? 1 : axis == 1 ? 0 : 2) : axis] / length;
}

static void make_ball(void)
{
    int face, i, j, half, k, count = 0;
    for (face = 0; face < 8; face++) {
        const float sides[3] = {face & 1 ? -1.0f : 1.0f, face & 2 ? -1.0f : 1.0f, face & 4 ? -1.0f : 1.0f};
        /* Outward, however many axes are turned. */
        const int turned = sides[0] * sides[1] * sides[2] < 0;
        for (i = 0; i < PARTS; i++)
            for (j = 0; i + j < PARTS; j++)
                for (half = 0; half < 2 && i + j + half < PARTS; half++) {
                    const int corners[2][3][2] = {{{i, j}, {i + 1, j}, {i, j + 1}}, {{i + 1, j}, {i + 1, j + 1}, {i, j + 1}}};
                    for (k = 0; k < 3; k++)
                        corner(&vertices[9 * count + 3 * k], sides, corners[half][k][0], corners[half][k][1], 0);
                    for (k = 0; k < 3; k++)
                        triangles[3 * count + k] = (uint32_t)(3 * count + (turned && k > 0 ? 3 - k : k));
                    count++;
                }
    }
    CHECK(count == TRIANGLES);
}

static void refused(sinew_status status, sinew_status expected, const char *word)
{
    char message[256];
    sinew_last_error(message, sizeof message);
    CHECK(status == expected);
    if (strstr(message, word) == NULL)
        printf("%s\n", message);
    CHECK(strstr(message, word) != NULL);
}

static sinew_body_def tissue(void)
{
    sinew_body_def def;
    MUST(sinew_body_def_init(&def, sizeof def));
    def.positions = vertices;
    def.node_count = VERTICES;
    def.triangles = triangles;
    def.triangle_count = TRIANGLES;
    def.material = SINEW_MATERIAL_TETRAHEDRA;
    def.young_modulus = 2e4f;
    def.poisson_ratio = 0.3f;
    def.density = 1000.0f;
    return def;
}

static float height(sinew_vec3_view view, size_t vertex)
{
    return ((const float *)((const char *)view.data + vertex * view.stride))[1];
}

int main(void)
{
    sinew_world *world = a_world(-10.0f);
    sinew_body_def def = tissue();
    sinew_body_id body = {0, 0};
    sinew_embedding *drawn = NULL, *again = NULL;
    sinew_embedding_def surface;
    sinew_vec3_view places, normals, moved, nodes;
    sinew_triangle_view skin;
    uint64_t hash, later;
    size_t vertex;
    make_ball();
    MUST(sinew_world_get_state_hash(world, &hash));

    /* What is refused changes nothing. */
    refused(sinew_body_create_from_surface(world, &def, 0.0f, &body, &drawn), SINEW_STATUS_INVALID_ARGUMENT, "spacing");
    refused(sinew_body_create_from_surface(world, &def, 0.01f, NULL, &drawn), SINEW_STATUS_INVALID_ARGUMENT, "out_body");
    refused(sinew_body_create_from_surface(NULL, &def, 0.01f, &body, &drawn), SINEW_STATUS_INVALID_ARGUMENT, "world");
    refused(sinew_body_create_from_surface(world, NULL, 0.01f, &body, &drawn), SINEW_STATUS_INVALID_ARGUMENT, "def");
    def.triangle_count--;
    refused(sinew_body_create_from_surface(world, &def, 0.01f, &body, &drawn), SINEW_STATUS_INVALID_ARGUMENT, "not closed");
    def = tissue();
    CHECK(body.index1 == 0 && drawn == NULL);
    MUST(sinew_world_get_state_hash(world, &later));
    CHECK(later == hash);

    /* From what is drawn to tissue that falls: every vertex of a free ball falls as its centre does. */
    MUST(sinew_body_create_from_surface(world, &def, 0.012f, &body, &drawn));
    MUST(sinew_body_get_positions(world, body, &nodes));
    CHECK(nodes.count > 100 && nodes.count < VERTICES);
    MUST(sinew_embedding_get_positions(drawn, &places));
    CHECK(places.count == VERTICES);
    for (vertex = 0; vertex < VERTICES; vertex++)
        CHECK(fabsf(height(places, vertex) - vertices[3 * vertex + 1]) < 1e-6f);
    steps(world, 0.01f, 10);
    CHECK(fabsf(height(places, 0) - vertices[1]) < 1e-6f); /* not yet */
    MUST(sinew_embedding_update(drawn, world));
    for (vertex = 0; vertex < VERTICES; vertex++)
        CHECK(fabsf(vertices[3 * vertex + 1] - height(places, vertex) - 0.05f) < 1e-5f);
    MUST(sinew_embedding_get_positions(drawn, &moved));
    CHECK(moved.data == places.data);
    /* Each corner of an STL file has one triangle: its normal, which looks away from the centre. */
    MUST(sinew_embedding_get_normals(drawn, &normals));
    CHECK(normals.count == VERTICES);
    for (vertex = 0; vertex < VERTICES; vertex++)
        CHECK(fabsf(height(normals, vertex) - vertices[3 * vertex + 1] / 0.05f) < 0.1f);

    MUST(sinew_embedding_get_triangles(drawn, &skin));
    CHECK(skin.count == TRIANGLES && memcmp(skin.data, triangles, sizeof triangles) == 0);

    /* A second surface of the same body, bound to the triangles that are drawn of it. */
    MUST(sinew_embedding_def_init(&surface, sizeof surface));
    CHECK(surface.struct_size == sizeof surface && surface.vertices == NULL);
    refused(sinew_embedding_create(world, body, &surface, &again), SINEW_STATUS_INVALID_ARGUMENT, "vertices");
    surface.vertices = places.data;
    surface.vertex_count = places.count;
    surface.triangle_count = 1;
    refused(sinew_embedding_create(world, body, &surface, &again), SINEW_STATUS_INVALID_ARGUMENT, "triangles");
    surface.triangle_count = 0;
    refused(sinew_embedding_create(world, body, NULL, &again), SINEW_STATUS_INVALID_ARGUMENT, "def");
    refused(sinew_embedding_create(world, body, &surface, NULL), SINEW_STATUS_INVALID_ARGUMENT, "out");
    MUST(sinew_embedding_create(world, body, &surface, &again));
    MUST(sinew_embedding_get_normals(again, &normals));
    CHECK(normals.count == 0);
    MUST(sinew_body_get_positions(world, body, &nodes));
    refused(sinew_embedding_update_from(again, nodes.data, nodes.count - 1), SINEW_STATUS_INVALID_ARGUMENT, "positions");
    MUST(sinew_embedding_update_from(again, nodes.data, nodes.count));
    MUST(sinew_embedding_get_positions(again, &moved));
    for (vertex = 0; vertex < VERTICES; vertex++)
        CHECK(fabsf(height(moved, vertex) - height(places, vertex)) < 1e-6f);

    /* NULL, and what is gone. */
    refused(sinew_embedding_update(NULL, world), SINEW_STATUS_INVALID_ARGUMENT, "embedding");
    refused(sinew_embedding_get_positions(NULL, &moved), SINEW_STATUS_INVALID_ARGUMENT, "embedding");
    refused(sinew_embedding_get_triangles(again, NULL), SINEW_STATUS_INVALID_ARGUMENT, "out");
    refused(sinew_embedding_get_normals(again, NULL), SINEW_STATUS_INVALID_ARGUMENT, "out");
    MUST(sinew_body_destroy(world, body));
    CHECK(sinew_embedding_update(drawn, world) == SINEW_STATUS_STALE_ID);
    CHECK(height(places, 0) < vertices[1]);
    sinew_world_destroy(world);
    MUST(sinew_embedding_get_normals(drawn, &normals));
    sinew_embedding_destroy(drawn);
    sinew_embedding_destroy(again);
    sinew_embedding_destroy(NULL);
    return checked("what is drawn goes with what is solved");
}
