/* thread_count and run_tasks: whoever takes a step, and in whatever order its tasks run, the world ends up the same. */
#include "contract.h"
#include "scene.h"

#include <pthread.h>

enum { CLOTHS = 16, TASKS = 3 };

static int calls; /* of run_tasks */
static uint32_t asked;

static void in_order(void *context, sinew_task task, void *task_data, uint32_t count)
{
    uint32_t i;
    CHECK(context == &calls);
    calls++;
    asked = count;
    for (i = 0; i < count; i++)
        task(task_data, i);
}

static void in_reverse(void *context, sinew_task task, void *task_data, uint32_t count)
{
    CHECK(context == &calls);
    calls++;
    asked = count;
    while (count-- > 0)
        task(task_data, count);
}

static void not_at_all(void *context, sinew_task task, void *task_data, uint32_t count)
{
    CHECK(context == &calls);
    CHECK(task != NULL && task_data != NULL);
    calls++;
    asked = count;
}

typedef struct { sinew_task task; void *data; uint32_t index; } job;

static void *run_job(void *argument)
{
    const job *it = (const job *)argument;
    it->task(it->data, it->index);
    return NULL;
}

static void on_threads(void *context, sinew_task task, void *task_data, uint32_t count)
{
    pthread_t threads[TASKS];
    job jobs[TASKS];
    uint32_t i;
    CHECK(context == &calls);
    calls++;
    asked = count;
    if (count > TASKS)
        exit(2);
    for (i = 0; i < count; i++) {
        jobs[i].task = task;
        jobs[i].data = task_data;
        jobs[i].index = i;
        if (pthread_create(&threads[i], NULL, run_job, &jobs[i]) != 0)
            exit(2);
    }
    for (i = 0; i < count; i++)
        CHECK(pthread_join(threads[i], NULL) == 0);
}

static uint64_t hash_after_steps(uint32_t thread_count, sinew_run_tasks run_tasks, size_t struct_size)
{
    union { sinew_world_def now; unsigned char bytes[sizeof(sinew_world_def)]; } def;
    sinew_world *world = NULL;
    uint64_t hash;
    int i;
    memset(def.bytes, 0xA5, sizeof def.bytes); /* what an older program has behind its definition is not looked at */
    MUST(sinew_world_def_init(&def.now, struct_size));
    def.now.thread_count = thread_count;
    if (struct_size == sizeof def.now) {
        CHECK(def.now.run_tasks == NULL && def.now.tasks_context == NULL);
        def.now.run_tasks = run_tasks;
        def.now.tasks_context = &calls;
    }
    MUST(sinew_world_create(&def.now, &world));
    for (i = 0; i < CLOTHS; i++)
        a_cloth(world, (float)SOFT + (float)i);
    calls = 0;
    asked = 0;
    steps(world, 0.01f, 5);
    hash = hash_of(world);
    sinew_world_destroy(world);
    return hash;
}

int main(void)
{
    static const sinew_run_tasks systems[] = {in_order, in_reverse, not_at_all, on_threads};
    const size_t now = sizeof(sinew_world_def);
    const uint64_t alone = hash_after_steps(1, NULL, now);
    size_t i;
    CHECK(hash_after_steps(0, NULL, now) == alone);
    CHECK(hash_after_steps(2, NULL, now) == alone);
    CHECK(hash_after_steps(5, NULL, now) == alone);
    CHECK(hash_after_steps(2, NULL, sizeof(contract_world_def)) == alone);
    CHECK(calls == 0);
    for (i = 0; i < sizeof systems / sizeof systems[0]; i++) {
        CHECK(hash_after_steps(TASKS, systems[i], now) == alone);
        CHECK(calls == 5 && asked == TASKS);
        CHECK(hash_after_steps(1, systems[i], now) == alone);
        CHECK(calls == 0);
    }
    return checked("any number of threads, and any job system, gives the same bits");
}
