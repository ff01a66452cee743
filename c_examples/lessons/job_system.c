/* Run the work of a step on your own job system.
 *
 * Set run_tasks in the definition of the world. The library calls it within sinew_world_step with a number of tasks;
 * return when all have run. Results are bitwise identical for any number of threads. A real job system keeps its
 * threads; this example starts new ones for brevity.
 *
 * Output:
 *   the job system ran tasks: yes
 *   same state as with one thread: yes
 */
#include "../example.h"
#include <pthread.h>

typedef struct job {
  sinew_task task;
  void *data;
  uint32_t index;
} job;

static void *run_job(void *data) {
  const job *mine = (const job *)data;
  mine->task(mine->data, mine->index);
  return NULL;
}

static void run_tasks(void *context, sinew_task task, void *task_data, uint32_t count) {
  pthread_t threads[2];
  job jobs[2];
  uint32_t started = 0;
  *(uint32_t *)context += count;
  for (; started < 2 && started + 1 < count; started++) { /* tasks 1 and 2 on threads, as far as those start */
    jobs[started].task = task;
    jobs[started].data = task_data;
    jobs[started].index = started + 1;
    if (pthread_create(&threads[started], NULL, run_job, &jobs[started]) != 0) break;
  }
  task(task_data, 0);
  for (uint32_t i = started + 1; i < count; i++) task(task_data, i);
  for (uint32_t i = 0; i < started; i++) pthread_join(threads[i], NULL);
}

static uint64_t simulate(const sinew_world_def *world_def) {
  sinew_world *world;
  CHECK(sinew_world_create(world_def, &world));
  const float size[3] = {0.2f, 0.2f, 0.2f};
  const uint32_t cells[3] = {24, 24, 24};
  sinew_mesh *mesh;
  CHECK(sinew_mesh_create_block(size, cells, &mesh));
  sinew_body_def def = body_from_mesh(mesh);
  def.material = SINEW_MATERIAL_SPRINGS;
  def.young_modulus = 5000.0f;
  def.density = 1000.0f;
  sinew_body_id block;
  CHECK(sinew_body_create(world, &def, &block));
  sinew_mesh_destroy(mesh);
  pin_below(world, block, 1, -0.099f);
  step_world(world, 0.002, 5);
  uint64_t hash;
  CHECK(sinew_world_get_state_hash(world, &hash));
  sinew_world_destroy(world);
  return hash;
}

int main(void) {
  uint32_t tasks_run = 0;
  sinew_world_def def;
  CHECK(sinew_world_def_init(&def, sizeof def));
  const uint64_t alone = simulate(&def); /* one thread, the default */
  def.thread_count = 3;                  /* tasks per step */
  def.run_tasks = run_tasks;
  def.tasks_context = &tasks_run;
  const uint64_t together = simulate(&def);
  printf("the job system ran tasks: %s\n", tasks_run > 0 ? "yes" : "no");
  printf("same state as with one thread: %s\n", alone == together ? "yes" : "no");
  return 0;
}
