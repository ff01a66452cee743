/* A program's own memory: all that the library holds is the program's, aligned, freed as it was asked for, and back when the worlds
 * are gone. A build without the feature `allocator` refuses. tests/project/c_programs.rs runs this with both. */
#include "scene.h"

#include <pthread.h>
#include <stdint.h>

/* What the functions count; the library's threads call them too. */
static struct memory {
    pthread_mutex_t lock;
    size_t bytes, blocks, calls;
    size_t left;   /* bytes that there are */
    size_t skewed; /* by how much addresses miss their alignment */
    size_t wrong;  /* frees of what was asked for otherwise */
} memory;

/* Lies before each block. */
typedef struct head {
    void *whole;
    size_t size, alignment;
} head;

static void *allocate(void *context, size_t size, size_t alignment)
{
    struct memory *of = (struct memory *)context;
    unsigned char *whole, *block;
    CHECK(size > 0 && alignment > 0 && (alignment & (alignment - 1)) == 0);
    pthread_mutex_lock(&of->lock);
    of->calls++;
    whole = size > of->left ? NULL : (unsigned char *)malloc(size + 2 * alignment + sizeof(head));
    if (whole != NULL) {
        head about;
        of->left -= size;
        of->bytes += size;
        of->blocks++;
        block = whole + sizeof about;
        block += alignment - (uintptr_t)block % alignment + of->skewed;
        about.whole = whole;
        about.size = size;
        about.alignment = alignment;
        memcpy(block - sizeof about, &about, sizeof about);
        memset(block, 0xA5, size - of->skewed);
    }
    pthread_mutex_unlock(&of->lock);
    return whole == NULL ? NULL : block;
}

static void deallocate(void *context, void *block, size_t size, size_t alignment)
{
    struct memory *of = (struct memory *)context;
    head about;
    memcpy(&about, (unsigned char *)block - sizeof about, sizeof about);
    pthread_mutex_lock(&of->lock);
    of->calls++;
    of->wrong += about.size != size || about.alignment != alignment;
    of->left += size;
    of->bytes -= size;
    of->blocks--;
    pthread_mutex_unlock(&of->lock);
    memset(block, 0x5A, size - of->skewed);
    free(about.whole);
}

/* A world of two threads with a block that is pressed, cut, saved, loaded and read; returns what it held at most. */
static size_t a_session(void)
{
    static const float size[3] = {0.1f, 0.1f, 0.1f}, corner[3] = {0.03f, -1, -1}, far_corner[3] = {1, 1, 1};
    static const float start[6] = {-1, 0.013f, -1, -1, 0.013f, 1}, end[6] = {0.04f, 0.013f, -1, 0.04f, 0.013f, 1};
    static const uint32_t cells[3] = {6, 6, 6};
    const float down[3] = {0, 0.055f, 0};
    sinew_world_def of_world;
    sinew_body_def of_body;
    sinew_tool_def of_tool;
    sinew_cut_report cut;
    sinew_world *world = NULL, *twin = NULL;
    sinew_mesh *mesh;
    sinew_body_id body;
    sinew_tool_id tool;
    sinew_reader *reader;
    unsigned char *bytes;
    size_t snapshot, held, calls;
    int i;
    MUST(sinew_world_def_init(&of_world, sizeof of_world));
    of_world.thread_count = 2;
    MUST(sinew_world_create(&of_world, &world));
    MUST(sinew_mesh_create_block(size, cells, &mesh));
    MUST(sinew_body_def_init(&of_body, sizeof of_body));
    MUST(sinew_body_def_set_mesh(&of_body, mesh));
    of_body.node_mass = 1e-3f;
    of_body.node_damping = 1e-2f;
    of_body.stiffness = 100;
    of_body.spare_nodes = 2000;
    of_body.meets_bodies = 1;
    MUST(sinew_body_create(world, &of_body, &body));
    sinew_mesh_destroy(mesh);
    MUST(sinew_body_pin_box(world, body, corner, far_corner, NULL));
    MUST(sinew_tool_def_init(&of_tool, sizeof of_tool));
    of_tool.shape = SINEW_SHAPE_SPHERE;
    of_tool.radius = 0.02f;
    of_tool.position[1] = 0.08f;
    MUST(sinew_tool_create(world, &of_tool, &tool));
    MUST(sinew_reader_create(world, body, &reader));
    MUST(sinew_tool_set_pose(world, tool, down, NULL));
    MUST(sinew_world_step(world, 2e-3f, NULL));
    calls = memory.calls;
    for (i = 0; i < 5; i++)
        MUST(sinew_world_step(world, 2e-3f, NULL));
    CHECK(memory.calls == calls); /* a step asks for none */
    cut.struct_size = sizeof cut;
    MUST(sinew_body_cut(world, body, start, end, &cut));
    MUST(sinew_world_step(world, 2e-3f, NULL));
    MUST(sinew_world_get_snapshot_size(world, &snapshot));
    bytes = (unsigned char *)malloc(snapshot);
    if (bytes == NULL)
        exit(2);
    MUST(sinew_world_save_snapshot(world, bytes, snapshot));
    MUST(sinew_world_load_snapshot(bytes, snapshot, &of_world, &twin));
    free(bytes);
    MUST(sinew_world_step(twin, 2e-3f, NULL));
    held = memory.bytes;
    sinew_reader_destroy(reader);
    sinew_world_destroy(twin);
    sinew_world_destroy(world);
    return held;
}

static void refused(sinew_status status, sinew_status expected, const char *what)
{
    char message[256];
    sinew_last_error(message, sizeof message);
    CHECK(status == expected && strstr(message, what) != NULL);
}

int main(void)
{
    sinew_alloc is_allocate = NULL;
    sinew_dealloc is_deallocate = NULL;
    sinew_world_def def;
    sinew_world *world = NULL;
    sinew_status status;
    void *context = &def;
    size_t first, after_first, needed;

    pthread_mutex_init(&memory.lock, NULL);
    memory.left = SIZE_MAX;
    /* Nothing but the first request decides. */
    MUST(sinew_get_allocator(&is_allocate, &is_deallocate, &context));
    CHECK(is_allocate == NULL && is_deallocate == NULL && context == NULL);
    status = sinew_set_allocator(allocate, deallocate, &memory);
    if (status == SINEW_STATUS_UNSUPPORTED) {
        refused(status, SINEW_STATUS_UNSUPPORTED, "feature `allocator`");
        a_session();
        CHECK(memory.calls == 0);
        return checked("a build without the feature takes no allocator");
    }
    MUST(status);
    CHECK(memory.calls == 0);
    MUST(sinew_get_allocator(&is_allocate, &is_deallocate, &context));
    MUST(sinew_get_allocator(NULL, NULL, NULL));
    CHECK(is_allocate == allocate && is_deallocate == deallocate && context == &memory);

    first = a_session();
    after_first = memory.bytes;
    CHECK(first > 100000);
    printf("held %lu bytes, after the worlds %lu bytes in %lu blocks\n", (unsigned long)first, (unsigned long)memory.bytes,
           (unsigned long)memory.blocks);
    a_session();
    CHECK(memory.bytes == after_first && after_first == 0 && memory.wrong == 0);

    /* Too little memory, and such as is not aligned, is refused, and comes back. */
    MUST(sinew_world_def_init(&def, sizeof def));
    MUST(sinew_world_create(&def, &world));
    needed = memory.bytes;
    sinew_world_destroy(world);
    memory.left = needed / 2;
    CHECK(sinew_world_create(&def, &world) == SINEW_STATUS_OUT_OF_MEMORY);
    memory.left = SIZE_MAX / 2;
    memory.skewed = 1;
    CHECK(sinew_world_create(&def, &world) == SINEW_STATUS_OUT_OF_MEMORY);
    memory.skewed = 0;
    CHECK(memory.bytes == 0);
    MUST(sinew_world_create(&def, &world));
    sinew_world_destroy(world);
    CHECK(memory.bytes == 0 && memory.wrong == 0);

    /* Once it is set it stays; the message of a refused call is memory of its thread. */
    refused(sinew_set_allocator(allocate, deallocate, NULL), SINEW_STATUS_INVALID_ARGUMENT, "alloc");
    refused(sinew_set_allocator(NULL, deallocate, NULL), SINEW_STATUS_INVALID_ARGUMENT, "alloc is NULL");
    refused(sinew_set_allocator(allocate, NULL, NULL), SINEW_STATUS_INVALID_ARGUMENT, "dealloc is NULL");
    MUST(sinew_get_allocator(NULL, NULL, &context));
    CHECK(context == &memory && memory.blocks == 1);
    return checked("all memory is the program's");
}
