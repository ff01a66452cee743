/* A wound in stretched tissue gapes, and threads close it one after another.
 *
 * A suture joins two surface points and is shortened by the program. Points are found as the nearest ones to where the
 * needle goes in. */
#include "scene.h"

#define THREADS 5u
#define SPACING 0.016f   /* [m] between threads */
#define STRETCHING 0.5f  /* [s] the sides are pulled apart */
#define DRAW_TIME 0.8f   /* [s] to draw a thread in */

sinew_status create_suturing(sample *s);
sinew_status act_suturing(sample *s, float seconds);

sinew_status create_suturing(sample *s) {
  const float size[3] = {0.12f, 0.02f, 0.12f};
  const uint32_t cells[3] = {20, 3, 20};
  /* A blade's edge enters at one end of the wound and leaves at the other: from inside the tissue to above it. */
  const float start[6] = {0.001f, -0.004f, 0.042f, 0.001f, 0.02f, 0.042f};
  const float end[6] = {0.001f, -0.004f, -0.042f, 0.001f, 0.02f, -0.042f};
  sinew_body_def def;
  TRY(sinew_mesh_create_block(size, cells, &s->mesh));
  TRY(scene_body(s, &def));
  scene_tissue(&def, 5400.0f, 0.006f);
  TRY(scene_add_body(s, &def, 0xE0A98C));
  TRY(sinew_body_set_gravity_scale(s->world, s->bodies[0].id, 0)); /* nothing is below it */
  TRY(scene_pin(s, 0, -1, -0.059f));
  TRY(scene_pin(s, 0, 0.059f, 1));
  TRY(sinew_body_cut(s->world, s->bodies[0].id, start, end, NULL));
  s->cut_depth = 0.015f;
  scene_camera(s, 0.06f, 0.21f, 0.17f, 0.0f, 0.0f, 0.0f);
  return SINEW_STATUS_OK;
}

/* Puts thread k through both lips of the wound, as long as the wound is wide there. */
static sinew_status put_thread(sample *s, uint32_t k) {
  const float along = SPACING * ((float)k - 0.5f * (float)(THREADS - 1));
  const float left[3] = {-0.012f, 0.01f, along}, right[3] = {0.014f, 0.01f, along};
  sinew_surface_point a, b;
  sinew_suture_report report;
  a.struct_size = b.struct_size = sizeof a;
  report.struct_size = sizeof report;
  TRY(sinew_world_find_nearest(s->world, left, 0.05f, &a));
  TRY(sinew_world_find_nearest(s->world, right, 0.05f, &b));
  TRY(sinew_suture_create(s->world, &a, &b, NULL, &s->sutures[k]));
  TRY(sinew_suture_get_report(s->world, s->sutures[k], &report));
  s->suture_lengths[k] = report.distance;
  return SINEW_STATUS_OK;
}

sinew_status act_suturing(sample *s, float seconds) {
  if (s->time < STRETCHING) return scene_spread(s, 0.013f * seconds / STRETCHING);
  for (uint32_t k = 0; k < THREADS; k++) {
    const float since = (float)s->time - STRETCHING - 0.5f - 0.5f * DRAW_TIME * (float)k;
    if (since < 0) break;
    if (s->sutures[k].index1 == 0) TRY(put_thread(s, k));
    if (sinew_attachment_is_valid(s->world, s->sutures[k])) {
      const float part = 1.0f - 0.45f * scene_smooth(since / DRAW_TIME);
      TRY(sinew_suture_set_length(s->world, s->sutures[k], part * s->suture_lengths[k]));
    }
  }
  return SINEW_STATUS_OK;
}
