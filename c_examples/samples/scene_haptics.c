/* A simulated hand strokes tissue with a ball and feels it at 1 kHz.
 *
 * A program with a device ticks the haptic handle on the device's own thread. Here a step is preceded by its ticks. The
 * blue pen ends where the hand is, the ball is the tool: the tissue holds it back, and the hand feels the difference. */
#include "scene.h"

#define TICK 0.001f /* [s] */
#define PEN 0.03f   /* [m] half the length of the pen */

sinew_status create_haptics(sample *s);
sinew_status act_haptics(sample *s, float seconds);

/* Where the hand is: down into the tissue, then to and fro. */
static void hand_at(double time, float hand[3]) {
  const float down = scene_smooth((float)time);
  hand[0] = 0.035f * sinf(1.2f * (float)time) * down;
  hand[1] = 0.05f - 0.036f * down;
  hand[2] = 0.02f * sinf(2.1f * (float)time) * down;
}

sinew_status create_haptics(sample *s) {
  const float size[3] = {0.14f, 0.04f, 0.09f};
  const uint32_t cells[3] = {17, 5, 11};
  sinew_body_def def;
  sinew_tool_def ball, hand;
  sinew_haptic_def haptic;
  TRY(sinew_mesh_create_block(size, cells, &s->mesh));
  TRY(scene_body(s, &def));
  scene_tissue(&def, 5400.0f, 0.008f);
  TRY(scene_add_body(s, &def, 0xC98A6B));
  TRY(scene_pin(s, 1, -1, -0.019f));

  TRY(scene_tool(&ball, SINEW_SHAPE_SPHERE, 0.012f, 0, 0, 0, 0.05f, 0));
  TRY(scene_add_tool(s, &ball, 0xE3E8ED));
  TRY(sinew_haptic_def_init(&haptic, sizeof haptic));
  haptic.tool = s->tools[0].id;
  haptic.stiffness = 100.0f; /* [N/m] soft, so that the difference can be seen */
  haptic.force_limit = 3.0f; /* [N] what the device can exert */
  TRY(sinew_haptic_create(s->world, &haptic, &s->haptic));

  TRY(scene_tool(&hand, SINEW_SHAPE_CAPSULE, 0.003f, PEN, 0, 0, 0.05f + PEN, 0));
  hand.collision_mask = 0; /* it is only drawn */
  TRY(scene_add_tool(s, &hand, 0x4F9FD6));
  scene_camera(s, 0.11f, 0.15f, 0.22f, 0.0f, 0.0f, 0.0f);
  return SINEW_STATUS_OK;
}

sinew_status act_haptics(sample *s, float seconds) {
  sinew_haptic_report felt;
  float hand[3];
  felt.struct_size = sizeof felt;
  for (float t = TICK; t < seconds + TICK / 2; t += TICK) {
    hand_at(s->time + t, hand);
    TRY(sinew_haptic_tick(s->haptic, hand, NULL, NULL, NULL, TICK, &felt));
  }
  scene_say(s, "the hand feels", sqrt((double)felt.force[0] * felt.force[0] + felt.force[1] * felt.force[1] +
                                      felt.force[2] * felt.force[2]), "N");
  hand[1] += PEN;
  return sinew_tool_set_pose(s->world, s->tools[1].id, hand, NULL);
}
