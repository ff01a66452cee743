/* A body is read by two threads while a third steps its world, cuts it and ends it: every frame is of one moment; what is refused. */
#include "scene.h"

#include <pthread.h>

enum { STEPS = 200, CUT_AFTER = 100 };

struct found {
    uint64_t last_step, different;
};

static sinew_frame read_frame(sinew_reader *reader)
{
    sinew_frame frame;
    memset(&frame, 0, sizeof frame);
    frame.struct_size = sizeof frame;
    MUST(sinew_reader_read(reader, &frame));
    return frame;
}

/* The cloth falls flat: its nodes are at one height, which belongs to the step; points of the cut between them are but for rounding. */
static void look(const sinew_frame *frame, struct found *found)
{
    const double fallen = 0.5 * 10 * frame->time * frame->time;
    const float height = node_of(frame->positions, 0)[1];
    size_t i;
    for (i = 0; i < frame->positions.count; i++)
        found->different += !(fabs(node_of(frame->positions, i)[1] - height) <= (i < CLOTH_NODES ? 0 : 1e-9));
    for (i = 0; i < 3 * frame->triangles.count; i++)
        found->different += frame->triangles.data[i] >= frame->positions.count;
    found->different += !(fabs(height + fallen) <= 0.01 * fallen + 1e-6);
    found->different += !(fabs(frame->time - 1e-4 * (double)frame->step) <= 1e-6);
    found->different += (frame->topology_version > 0) != (frame->positions.count > CLOTH_NODES);
}

struct task {
    sinew_reader *reader;
    struct found found;
};

static void *read_to_the_end(void *given)
{
    struct task *const task = (struct task *)given;
    uint64_t version = 0;
    sinew_frame frame;
    do {
        frame = read_frame(task->reader);
        look(&frame, &task->found);
        task->found.different += frame.is_new ? frame.version <= version : frame.version != version;
        version = frame.version;
        sched_yield();
    } while (!frame.is_over);
    task->found.last_step = frame.step;
    sinew_reader_destroy(task->reader);
    return NULL;
}

/* As a_cloth is, to be cut, and not damped. */
static sinew_body_id a_cloth_to_cut(sinew_world *world)
{
    const float size[2] = {0.08f, 0.08f};
    const uint32_t cells[2] = {SIDE - 1, SIDE - 1};
    sinew_mesh *mesh;
    sinew_mesh_view shape;
    sinew_body_def def;
    sinew_body_id body = {0, 0};
    shape.struct_size = sizeof shape;
    MUST(sinew_mesh_create_cloth(size, cells, &mesh));
    MUST(sinew_mesh_get_view(mesh, &shape));
    MUST(sinew_body_def_init(&def, sizeof def));
    def.positions = shape.positions;
    def.node_count = shape.node_count;
    def.triangles = shape.triangles;
    def.triangle_count = shape.triangle_count;
    def.node_mass = 1e-3f;
    def.stiffness = SOFT;
    def.spare_nodes = 200;
    MUST(sinew_body_create(world, &def, &body));
    sinew_mesh_destroy(mesh);
    return body;
}

static void threads_read(void)
{
    const float start[6] = {0.003f, -1, -1, 0.003f, 1, -1}, end[6] = {0.003f, -1, 0.002f, 0.003f, 1, 0.002f};
    sinew_world *world = a_world(-10.0f);
    const sinew_body_id cloth = a_cloth_to_cut(world);
    struct task tasks[2];
    pthread_t threads[2];
    int i;
    memset(tasks, 0, sizeof tasks);
    for (i = 0; i < 2; i++) {
        MUST(sinew_reader_create(world, cloth, &tasks[i].reader));
        CHECK(pthread_create(&threads[i], NULL, read_to_the_end, &tasks[i]) == 0);
    }
    steps(world, 1e-4f, CUT_AFTER);
    MUST(sinew_body_cut(world, cloth, start, end, NULL));
    steps(world, 1e-4f, STEPS - CUT_AFTER);
    sinew_world_destroy(world);
    for (i = 0; i < 2; i++) {
        CHECK(pthread_join(threads[i], NULL) == 0);
        CHECK(tasks[i].found.different == 0);
        CHECK(tasks[i].found.last_step == STEPS);
    }
}

static void one_thread_reads(void)
{
    sinew_world *world = a_world(-10.0f);
    const sinew_body_id cloth = a_cloth(world, SOFT);
    sinew_reader *reader = NULL;
    sinew_frame frame;
    sinew_vec3_view own;
    uint64_t version;
    MUST(sinew_reader_create(world, cloth, &reader));
    frame = read_frame(reader);
    CHECK(frame.struct_size == sizeof frame && frame.is_new == 1 && frame.is_over == 0 && frame.step == 0);
    CHECK(frame.positions.count == CLOTH_NODES && frame.triangles.count == 2 * (SIDE - 1) * (SIDE - 1));
    version = frame.version;
    frame = read_frame(reader);
    CHECK(frame.is_new == 0 && frame.version == version);
    steps(world, 1e-3f, 3);
    frame = read_frame(reader);
    CHECK(frame.is_new == 1 && frame.version > version && frame.step == 3);
    MUST(sinew_body_get_positions(world, cloth, &own));
    CHECK(own.stride == frame.positions.stride && own.count == frame.positions.count);
    CHECK(own.data != frame.positions.data);
    CHECK(memcmp(own.data, frame.positions.data, own.count * own.stride) == 0);
    MUST(sinew_body_destroy(world, cloth));
    frame = read_frame(reader);
    CHECK(frame.is_new == 0 && frame.is_over == 1 && frame.positions.count == CLOTH_NODES);
    sinew_world_destroy(world);
    frame = read_frame(reader);
    CHECK(frame.is_over == 1 && frame.step == 3 && node_of(frame.positions, 80)[1] < 0);
    sinew_reader_destroy(reader);
}

static void says(sinew_status status, sinew_status expected, const char *word)
{
    char message[256];
    CHECK(status == expected);
    sinew_last_error(message, sizeof message);
    CHECK(strstr(message, word) != NULL);
}

static void refusals(void)
{
    sinew_world *world = a_world(-10.0f);
    const sinew_body_id cloth = a_cloth(world, SOFT), none = {0, 0};
    sinew_reader *reader = NULL;
    sinew_frame frame;
    says(sinew_reader_create(NULL, cloth, &reader), SINEW_STATUS_INVALID_ARGUMENT, "world");
    says(sinew_reader_create(world, cloth, NULL), SINEW_STATUS_INVALID_ARGUMENT, "out");
    says(sinew_reader_create(world, none, &reader), SINEW_STATUS_STALE_ID, "body");
    CHECK(reader == NULL);
    MUST(sinew_reader_create(world, cloth, &reader));
    frame.struct_size = sizeof frame;
    says(sinew_reader_read(NULL, &frame), SINEW_STATUS_INVALID_ARGUMENT, "reader");
    says(sinew_reader_read(reader, NULL), SINEW_STATUS_INVALID_ARGUMENT, "out");
    frame.struct_size = 8;
    says(sinew_reader_read(reader, &frame), SINEW_STATUS_INVALID_ARGUMENT, "struct_size");
    CHECK(read_frame(reader).is_new == 1); /* what was refused read nothing */
    sinew_reader_destroy(NULL);
    sinew_reader_destroy(reader);
    sinew_world_destroy(world);
}

int main(void)
{
    threads_read();
    one_thread_reads();
    refusals();
    return checked("threads read a body while it moves");
}
