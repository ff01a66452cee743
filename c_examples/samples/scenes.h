/* Scenes of the samples program: what they contain and what the mouse does to them.
 *
 * Pure C99 over sinew.h: no window, no files, no memory of its own. A program steps a sample, passes it the mouse as rays
 * and draws its bodies and tools. main.c and draw.c do that with SDL2 and OpenGL. */
#ifndef SINEW_SAMPLES_SCENES_H
#define SINEW_SAMPLES_SCENES_H

#include <sinew.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SAMPLE_BODIES 16
#define SAMPLE_TOOLS 16

/* Choices that hold for every scene. */
typedef struct sample_options {
  uint32_t solver;  /* a sinew_solver value */
  uint32_t storage; /* a sinew_storage value */
} sample_options;

/* What the mouse does while its button is down. */
typedef enum sample_mode { SAMPLE_PULL, SAMPLE_PRESS, SAMPLE_CUT, SAMPLE_MODE_COUNT } sample_mode;

/* A body to draw: sinew_body_get_positions and sinew_body_get_triangles have its surface. */
typedef struct sample_body {
  sinew_body_id id;
  float color[3];
} sample_body;

/* A tool to draw: sinew_tool_get_pose has its pose. */
typedef struct sample_tool {
  sinew_tool_id id;
  uint32_t shape; /* a sinew_shape value: SPHERE, CAPSULE, PLANE or BOX */
  float size[3];  /* [m] sphere: radius; capsule: radius, half length; box: half extents */
  float color[3];
} sample_tool;

/* What the mouse holds; see pointer.c. */
typedef struct sample_pointer_state {
  sample_mode mode;
  int down;                     /* 1 while the button is down */
  sinew_tool_id tool;           /* pull, press: the last of the sample's tools; none if nothing was hit */
  float origin[3];              /* [m] the ray of the last call */
  float direction[3];           /* of length 1 */
  float reach;                  /* [m] along the ray, to the surface where the button went down */
  float depth;                  /* [m] press: how far the ball is in */
  float edge[6];                /* [m] cut: the last place of the blade's edge */
} sample_pointer_state;

/* A running scene. Programs read it; only the functions below change it. */
typedef struct sample {
  sinew_world *world;
  sample_options options;
  uint32_t scene;
  double time;                  /* [s] since the start */
  sample_body bodies[SAMPLE_BODIES];
  uint32_t body_count;
  sample_tool tools[SAMPLE_TOOLS];
  uint32_t tool_count;
  float eye[3], target[3];      /* [m] a camera that frames the scene */
  float cut_depth;              /* [m] how far the mouse cuts in, from the surface */
  char text[96];                /* a line about what happens, such as a force */
  sample_pointer_state pointer;

  /* What single scenes keep. */
  sinew_mesh *mesh;             /* while a scene is created */
  sinew_blade_id blade;
  sinew_haptic *haptic;
  sinew_attachment_id sutures[8];
  float suture_lengths[8];      /* [m] when they were set */
} sample;

/* A scene: how it begins and what it does by itself before each step. */
typedef struct sample_scene {
  const char *name;
  const char *hint; /* what to try */
  sinew_status (*create)(sample *s);
  sinew_status (*act)(sample *s, float seconds); /* nullable */
} sample_scene;

extern const sample_scene SAMPLE_SCENES[];
extern const uint32_t SAMPLE_SCENE_COUNT;

/* Starts a scene, an index into SAMPLE_SCENES. `options` is nullable: AUTO and PACKED. End it with sample_end, also after
 * an error. */
sinew_status sample_start(sample *s, uint32_t scene, const sample_options *options);

/* Advances the scene, such as by 1/60 s. */
sinew_status sample_step(sample *s, float seconds);

/* Destroys all that the scene has. */
void sample_end(sample *s);

/* Tells the sample where the mouse is: a ray in the world, of any length, and whether the button is down. Call it once
 * per frame, before sample_step. */
sinew_status sample_pointer(sample *s, sample_mode mode, const float origin[3], const float direction[3], int down);

#ifdef __cplusplus
}
#endif

#endif
