/* The mouse in a scene: pull tissue, press it with a ball, or cut it.
 *
 * A ray finds the surface point below the mouse. Pulling attaches that point to a small tool that touches nothing, and
 * moves the tool. Pressing pushes a ball along the ray. Cutting sweeps an edge along the ray from one place to the next. */
#include "scene.h"

#define BALL 0.012f       /* [m] radius of the ball that presses */
#define HANDLE 0.003f     /* [m] radius of the tool that pulls */
#define DEEPEST 0.018f    /* [m] how far the ball goes in */
#define PRESS_SPEED 0.03f /* [m/s] */
#define CUT_STEP 0.004f   /* [m] a sweep of the edge is at least as long */
#define FAR 10.0f         /* [m] */

sinew_status pointer_step(sample *s, float seconds);

static void point_on_ray(const sample_pointer_state *p, float along, float point[3]) {
  for (int i = 0; i < 3; i++) point[i] = p->origin[i] + along * p->direction[i];
}

/* Creates the tool of the mouse. It collides with the categories of `mask`. */
static sinew_status create_tool(sample *s, float radius, const float position[3], uint32_t mask) {
  sinew_tool_def def;
  TRY(scene_tool(&def, SINEW_SHAPE_SPHERE, radius, 0, 0, position[0], position[1], position[2]));
  def.collision_mask = mask;
  TRY(scene_add_tool(s, &def, 0xC8D2DC));
  s->pointer.tool = s->tools[s->tool_count - 1].id;
  return SINEW_STATUS_OK;
}

static sinew_status let_go(sample *s) {
  const sinew_tool_id none = {0, 0}, tool = s->pointer.tool;
  s->pointer.down = 0;
  s->pointer.tool = none;
  if (tool.index1 == 0) return SINEW_STATUS_OK;
  s->tool_count--;
  return sinew_tool_destroy(s->world, tool); /* releases what is attached to it */
}

/* The blade's edge along the ray, from above the surface to below it. */
static void edge_on_ray(const sample *s, float edge[6]) {
  point_on_ray(&s->pointer, s->pointer.reach - s->cut_depth, edge);
  point_on_ray(&s->pointer, s->pointer.reach + s->cut_depth, edge + 3);
}

static sinew_status begin(sample *s) {
  sample_pointer_state *p = &s->pointer;
  sinew_surface_point hit;
  float start[3];
  hit.struct_size = sizeof hit;
  TRY(sinew_world_cast_ray(s->world, p->origin, p->direction, FAR, &hit));
  p->down = 1;
  p->depth = 0;
  if (hit.body.index1 != 0) p->reach = hit.distance;
  else p->reach = sqrtf((s->eye[0] - s->target[0]) * (s->eye[0] - s->target[0]) + /* a cut may begin beside tissue */
                        (s->eye[1] - s->target[1]) * (s->eye[1] - s->target[1]) +
                        (s->eye[2] - s->target[2]) * (s->eye[2] - s->target[2]));
  if (p->mode == SAMPLE_CUT) edge_on_ray(s, p->edge);
  if (hit.body.index1 == 0 || p->mode == SAMPLE_CUT) return SINEW_STATUS_OK;
  point_on_ray(p, p->mode == SAMPLE_PULL ? p->reach : p->reach - 1.1f * BALL, start);
  TRY(create_tool(s, p->mode == SAMPLE_PULL ? HANDLE : BALL, start, p->mode == SAMPLE_PULL ? 0 : UINT32_MAX));
  if (p->mode == SAMPLE_PULL) {
    sinew_attachment_def attachment;
    sinew_attachment_id held;
    TRY(sinew_attachment_def_init(&attachment, sizeof attachment));
    attachment.body = hit.body;
    attachment.tool = p->tool;
    attachment.count = 1;
    attachment.triangles = &hit.triangle;
    attachment.weights = hit.weights;
    TRY(sinew_attachment_create(s->world, &attachment, &held));
  }
  return SINEW_STATUS_OK;
}

/* Cuts every body that the edge swept since the last cut. */
static sinew_status cut(sample *s) {
  sample_pointer_state *p = &s->pointer;
  sinew_surface_point hit;
  float edge[6], moved = 0;
  hit.struct_size = sizeof hit;
  TRY(sinew_world_cast_ray(s->world, p->origin, p->direction, FAR, &hit));
  if (hit.body.index1 != 0) p->reach = hit.distance;
  edge_on_ray(s, edge);
  for (int i = 0; i < 3; i++) moved += (edge[3 + i] - p->edge[3 + i]) * (edge[3 + i] - p->edge[3 + i]);
  if (moved < CUT_STEP * CUT_STEP) return SINEW_STATUS_OK;
  for (uint32_t k = 0; k < s->body_count; k++) TRY(sinew_body_cut(s->world, s->bodies[k].id, p->edge, edge, NULL));
  memcpy(p->edge, edge, sizeof edge);
  return SINEW_STATUS_OK;
}

sinew_status sample_pointer(sample *s, sample_mode mode, const float origin[3], const float direction[3], int down) {
  sample_pointer_state *p = &s->pointer;
  const float length =
    sqrtf(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2]);
  if (p->down && (!down || mode != p->mode)) TRY(let_go(s));
  if (!down || !(length > 0)) return SINEW_STATUS_OK;
  for (int i = 0; i < 3; i++) {
    p->origin[i] = origin[i];
    p->direction[i] = direction[i] / length;
  }
  p->mode = mode;
  if (!p->down) {
    const sinew_status status = begin(s);
    if (status != SINEW_STATUS_OK) let_go(s); /* such as at a pinned point */
    return status;
  }
  return mode == SAMPLE_CUT ? cut(s) : SINEW_STATUS_OK;
}

/* Moves the tool of the mouse during the next step, and reports its force. */
sinew_status pointer_step(sample *s, float seconds) {
  sample_pointer_state *p = &s->pointer;
  float position[3], force[3], torque[3];
  if (p->tool.index1 == 0) return SINEW_STATUS_OK;
  if (p->mode == SAMPLE_PRESS) p->depth = fminf(DEEPEST, p->depth + PRESS_SPEED * seconds);
  point_on_ray(p, p->mode == SAMPLE_PULL ? p->reach : p->reach - BALL + p->depth, position);
  TRY(sinew_tool_get_wrench(s->world, p->tool, force, torque));
  scene_say(s, "force", sqrt((double)force[0] * force[0] + force[1] * force[1] + force[2] * force[2]), "N");
  return sinew_tool_set_pose(s->world, p->tool, position, NULL);
}
