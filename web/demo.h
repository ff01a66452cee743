/* The samples as a page drives them: plain numbers and pointers, which JavaScript reads in WebAssembly's memory. */
#ifndef SINEW_WEB_DEMO_H
#define SINEW_WEB_DEMO_H

#include <sinew.h>

/* A body to draw. sinew.js reads these structs by their layout. */
typedef struct demo_body {
  const float *positions; /* [m] 3 * node_count */
  const float *normals;   /* 3 * node_count */
  uint32_t node_count;
  const uint32_t *triangles; /* 3 * triangle_count */
  uint32_t triangle_count;
  uint32_t version; /* another number when the triangles changed */
  float color[3];
} demo_body;

/* A tool to draw; shape and size as in sample_tool. */
typedef struct demo_tool {
  uint32_t shape;
  float size[3], color[3], position[3], orientation[4];
} demo_tool;

uint32_t demo_scene_count(void);
const char *demo_scene_name(uint32_t scene);
const char *demo_scene_hint(uint32_t scene);

/* Ends the scene that is shown and starts another with a sinew_solver value. */
sinew_status demo_start(uint32_t scene, uint32_t solver);

/* Tells the scene where the pointer is; as sample_pointer. Call it before demo_step. */
sinew_status demo_pointer(uint32_t mode, float origin_x, float origin_y, float origin_z, float direction_x,
                          float direction_y, float direction_z, int down);

/* The same with a fixed stroke across the scene, by the number of the frame: what tests compare between systems. */
sinew_status demo_stroke(uint32_t frame);

/* Advances the scene by 1/60 s. */
sinew_status demo_step(void);

/* The hash of everything that the next step depends on. */
uint64_t demo_hash(void);

/* The reason of the last failure, and the scene's line about what happens. */
const char *demo_error(void);
const char *demo_text(void);

/* 6 floats [m]: where the camera is and where it looks. */
const float *demo_camera(void);

/* Where the pointer holds the scene: 3 floats [m]; NULL if it holds nothing. */
const float *demo_held(void);

/* Bodies and tools; NULL beyond the last. What a call returns is valid until the next one, its arrays until the next step. */
const demo_body *demo_get_body(uint32_t index);
const demo_tool *demo_get_tool(uint32_t index);

#endif
