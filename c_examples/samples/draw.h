/* Draws a sample with OpenGL 3.3 core. */
#ifndef SINEW_SAMPLES_DRAW_H
#define SINEW_SAMPLES_DRAW_H

#include "scenes.h"

#ifdef __cplusplus
extern "C" {
#endif

#define FIELD_OF_VIEW 0.6f /* [rad] vertical */

/* Where the picture is taken from. */
typedef struct draw_camera {
  float eye[3];                  /* [m] */
  float right[3], up[3], back[3];
} draw_camera;

/* Makes shaders and buffers; call it once, with a current OpenGL context. NULL, or what did not work. */
const char *draw_open(void);

/* Forgets what it knows of the bodies of an ended sample. */
void draw_reset(void);

/* Draws into the current framebuffer. `flags` is a sum of sinew_draw_flags. */
sinew_status draw_sample(const sample *s, const draw_camera *camera, int width, int height, uint32_t flags);

#ifdef __cplusplus
}
#endif

#endif
