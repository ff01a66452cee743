/* What the scenes share: the way to pass on an error, and bodies and tools in one line each. */
#ifndef SINEW_SAMPLES_SCENE_H
#define SINEW_SAMPLES_SCENE_H

#include "scenes.h"
#include <math.h>
#include <string.h>

/* Returns from the function if a call failed. */
#define TRY(call)                                     \
  do {                                                \
    const sinew_status status_ = (call);              \
    if (status_ != SINEW_STATUS_OK) return status_;   \
  } while (0)

#ifdef __cplusplus
extern "C" {
#endif

/* Starts the definition of a body from s->mesh, with the chosen solver and storage, room for cuts and soft damping. */
sinew_status scene_body(sample *s, sinew_body_def *def);

/* Makes a definition that of tissue: springs of a Young's modulus [Pa], for nodes about `spacing` [m] apart. */
void scene_tissue(sinew_body_def *def, float young_modulus, float spacing);

/* Adds a body with a color 0xRRGGBB to the sample; it is then the last of s->bodies. */
sinew_status scene_add_body(sample *s, const sinew_body_def *def, uint32_t color);

/* Starts the definition of a tool of a shape and size (as in sample_tool) at a position [m]. */
sinew_status scene_tool(sinew_tool_def *def, uint32_t shape, float size_x, float size_y, float size_z, float x, float y,
                        float z);

/* Adds a tool with a color 0xRRGGBB to the sample; it is then the last of s->tools. */
sinew_status scene_add_tool(sample *s, const sinew_tool_def *def, uint32_t color);

/* Gives the last tool a density [kg/m^3]: from then on forces move it. */
sinew_status scene_make_dynamic(sample *s, float density);

/* Pins the nodes of a body whose coordinate along an axis (0 to 2) is between two values [m]. */
sinew_status scene_pin(sample *s, sinew_body_id body, int axis, float low, float high);

/* Moves the pinned nodes of the first body by a distance [m] along x, away from x = 0, during the next step. */
sinew_status scene_spread(sample *s, float distance);

/* Places the camera. */
void scene_camera(sample *s, float eye_x, float eye_y, float eye_z, float target_x, float target_y, float target_z);

/* Writes "NAME VALUE UNIT" with two decimals into the sample's text. */
void scene_say(sample *s, const char *name, double value, const char *unit);

/* 0 to 1 for t from 0 to 1, level at both ends: how a hand starts and stops. */
float scene_smooth(float t);

#ifdef __cplusplus
}
#endif

#endif
