/* A thread that was never refused anything is refused for want of memory, also of the C library's own: that is an answer, with its words. */
#include "c/check.h"
#include <errno.h>
#include <malloc.h>

void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *memory, size_t size);
void *__libc_memalign(size_t alignment, size_t size);

/* How many more times there is memory; below 0: always. */
static long left = -1;

static int is_short(void)
{
    if (left > 0)
        left--;
    return left == 0;
}

void *malloc(size_t size) { return is_short() ? NULL : __libc_malloc(size); }
void *calloc(size_t count, size_t size) { return is_short() ? NULL : __libc_calloc(count, size); }
/* What shrinks stays where it is. */
void *realloc(void *memory, size_t size)
{
    const int grows = size > malloc_usable_size(memory);
    return grows && is_short() ? NULL : __libc_realloc(memory, size);
}
int posix_memalign(void **out, size_t alignment, size_t size)
{
    if (is_short())
        return ENOMEM;
    *out = __libc_memalign(alignment, size);
    return 0;
}

int main(void)
{
    const float size[3] = {0.1f, 0.1f, 0.1f};
    const uint32_t cells[3] = {2, 2, 2};
    long requests;
    sinew_mesh *mesh;
    sinew_mesh_view shape;
    sinew_world_def world_def;
    sinew_body_def def;
    sinew_status status = SINEW_STATUS_OUT_OF_MEMORY;
    MUST(sinew_mesh_create_block(size, cells, &mesh));
    shape.struct_size = sizeof shape;
    MUST(sinew_mesh_get_view(mesh, &shape));
    MUST(sinew_world_def_init(&world_def, sizeof world_def));
    MUST(sinew_body_def_init(&def, sizeof def));
    def.positions = shape.positions, def.node_count = shape.node_count;
    def.triangles = shape.surface, def.triangle_count = shape.surface_triangle_count;
    def.node_mass = 1e-3f, def.stiffness = 20.0f;
    for (requests = 1; status != SINEW_STATUS_OK; requests++) {
        sinew_world *world;
        sinew_body_id body = {0, 0};
        sinew_embedding *drawn = NULL;
        char message[100] = "";
        MUST(sinew_world_create(&world_def, &world));
        left = requests;
        status = sinew_body_create_from_surface(world, &def, 0.03f, &body, &drawn);
        if (status != SINEW_STATUS_OK) {
            left = 0;
            CHECK(sinew_last_error(message, sizeof message) == sizeof "out of memory");
        }
        left = -1;
        CHECK(status == SINEW_STATUS_OK || (status == SINEW_STATUS_OUT_OF_MEMORY && strcmp(message, "out of memory") == 0));
        CHECK((body.index1 != 0) == (status == SINEW_STATUS_OK) && (drawn != NULL) == (status == SINEW_STATUS_OK));
        sinew_embedding_destroy(drawn);
        sinew_world_destroy(world);
    }
    CHECK(requests > 50);
    sinew_mesh_destroy(mesh);
    return checked("out_of_memory");
}
