/* The samples program: scenes of soft tissue to pull, press and cut.
 *
 *   samples [--scene NAME]                    in a window
 *   samples --offscreen FRAMES [--scene NAME] [--pointer pull|press|cut] [--width W] [--height H] [--out FILE.png]
 *                                             unseen; prints what happened and saves the last picture
 *   samples --offscreen FRAMES --apng --out FOLDER   saves all frames as an animated PNG
 *   samples --list                            names of the scenes
 *
 * Left button: pull.  Right button: press.  Middle button, or Shift and left: cut.  Wheel and arrows: camera.
 * N, P: next and previous scene.  R: restart.  V: solver.  S: storage.  Space: pause.  Period: a single step.
 * C: counters.  D: debug drawing.  F: recording to samples.sinew, on and off.  Escape: end. */
#include "../example.h"
#include "draw.h"
#include "png.h"
#include <SDL.h>
#define GL_GLEXT_PROTOTYPES
#include <SDL_opengl.h>

static const char *const SOLVERS[] = {"VERLET", "IMPLICIT", "NEWTON", "AUTO"};
static const char *const STORAGES[] = {"PACKED", "EFFICIENT", "FAST_LINK", "DYNAMIC_BULK"};
static const char *const MODES[] = {"pull", "press", "cut"};

static sample scene;

static struct {
  int width, height;
  uint32_t number; /* of the scene */
  sample_options options;
  float turn, tilt, distance; /* [rad, rad, m] the camera about the scene's target */
  draw_camera camera;
  sample_mode mode;
  int down, is_paused, single, counters, debug, is_recording, over;
  double milliseconds;
  char refused[128];
} app = {960, 640, 0, {SINEW_SOLVER_AUTO, SINEW_STORAGE_PACKED}, 0, 0, 0,
         {{0}, {0}, {0}, {0}}, SAMPLE_PULL, 0, 0, 0, 0, 0, 0, 0, 0, ""};

/* What a person asks for may be refused; the program tells it and goes on. */
static int asked(sinew_status status) {
  if (status != SINEW_STATUS_OK) sinew_last_error(app.refused, sizeof app.refused);
  return status == SINEW_STATUS_OK;
}

static void start(uint32_t number) {
  sample_end(&scene);
  draw_reset();
  app.number = number;
  app.refused[0] = 0;
  app.is_recording = 0;
  CHECK(sample_start(&scene, number, &app.options));
  CHECK(sinew_world_set_profiling(scene.world, 1));
  const float x = scene.eye[0] - scene.target[0], y = scene.eye[1] - scene.target[1];
  const float z = scene.eye[2] - scene.target[2];
  app.distance = sqrtf(x * x + y * y + z * z);
  app.turn = atan2f(x, z);
  app.tilt = asinf(y / app.distance);
}

static void place_camera(void) {
  const float s = sinf(app.turn), c = cosf(app.turn), u = sinf(app.tilt), w = cosf(app.tilt);
  const float right[3] = {c, 0, -s}, up[3] = {-s * u, w, -c * u}, back[3] = {s * w, u, c * w};
  memcpy(app.camera.right, right, sizeof right);
  memcpy(app.camera.up, up, sizeof up);
  memcpy(app.camera.back, back, sizeof back);
  for (int i = 0; i < 3; i++) app.camera.eye[i] = scene.target[i] + app.distance * back[i];
}

/* Passes the pointer at a pixel to the scene, and takes a step. */
static void step(int x, int y) {
  const float tangent = tanf(FIELD_OF_VIEW / 2) / (float)app.height;
  const float across = tangent * (float)(2 * x - app.width), up = tangent * (float)(app.height - 2 * y);
  const draw_camera *from = &app.camera;
  const double began = seconds_now();
  float ray[3];
  for (int i = 0; i < 3; i++) ray[i] = across * from->right[i] + up * from->up[i] - from->back[i];
  asked(sample_pointer(&scene, app.mode, from->eye, ray, app.down));
  if (!asked(sample_step(&scene, (float)FRAME))) app.is_paused = 1;
  app.milliseconds = 0.8 * app.milliseconds + 0.2 * 1e3 * (seconds_now() - began);
}

static uint32_t debug_flags(void) {
  const uint32_t all =
    SINEW_DRAW_CONTACTS | SINEW_DRAW_NORMALS | SINEW_DRAW_PINS | SINEW_DRAW_SPRINGS | SINEW_DRAW_BOUNDS;
  return SINEW_DRAW_ATTACHMENTS | (app.debug ? all : 0); /* threads are always drawn */
}

static void draw(void) {
  place_camera();
  CHECK(draw_sample(&scene, &app.camera, app.width, app.height, debug_flags()));
}

static void record(void) {
  uint64_t steps;
  if (app.is_recording) asked(sinew_world_stop_recording(scene.world, &steps));
  else if (!asked(sinew_world_start_recording(scene.world, "samples.sinew"))) return;
  app.is_recording = !app.is_recording;
}

static void key_down(SDL_Keycode key) {
  const uint32_t count = SAMPLE_SCENE_COUNT;
  switch (key) {
    case SDLK_n: start((app.number + 1) % count); break;
    case SDLK_p: start((app.number + count - 1) % count); break;
    case SDLK_r: start(app.number); break;
    case SDLK_v: app.options.solver = (app.options.solver + 1) % 4; start(app.number); break;
    case SDLK_s: app.options.storage = (app.options.storage + 1) % 4; start(app.number); break;
    case SDLK_SPACE: app.is_paused = !app.is_paused; break;
    case SDLK_PERIOD: app.is_paused = app.single = 1; break;
    case SDLK_c: app.counters = !app.counters; break;
    case SDLK_d: app.debug = !app.debug; break;
    case SDLK_f: record(); break;
    case SDLK_LEFT: app.turn -= 0.1f; break;
    case SDLK_RIGHT: app.turn += 0.1f; break;
    case SDLK_UP: app.tilt = fminf(1.5f, app.tilt + 0.1f); break;
    case SDLK_DOWN: app.tilt = fmaxf(-0.3f, app.tilt - 0.1f); break;
    case SDLK_ESCAPE: app.over = 1; break;
    default: break;
  }
}

static void handle(const SDL_Event *event) {
  switch (event->type) {
    case SDL_QUIT: app.over = 1; break;
    case SDL_KEYDOWN: key_down(event->key.keysym.sym); break;
    case SDL_MOUSEWHEEL: app.distance *= expf(-0.1f * (float)event->wheel.y); break;
    case SDL_MOUSEBUTTONUP: app.down = 0; break;
    case SDL_MOUSEBUTTONDOWN: {
      const int is_left = event->button.button == SDL_BUTTON_LEFT, is_shifted = (SDL_GetModState() & KMOD_SHIFT) != 0;
      app.mode = event->button.button == SDL_BUTTON_RIGHT ? SAMPLE_PRESS : is_left && !is_shifted ? SAMPLE_PULL : SAMPLE_CUT;
      app.down = 1;
      app.refused[0] = 0;
      break;
    }
    default: break;
  }
}

/* The title of the window: scene, choices, and what happens or what to try. */
static void show_title(SDL_Window *window) {
  char title[512], counters[128] = "";
  sinew_profile profile;
  profile.struct_size = sizeof profile;
  if (app.counters && asked(sinew_world_get_profile(scene.world, &profile)))
    snprintf(counters, sizeof counters, " | %.1f ms, %u substeps, %u + %u contacts", app.milliseconds,
             (unsigned)profile.substeps, (unsigned)profile.tool_contacts, (unsigned)profile.tissue_contacts);
  snprintf(title, sizeof title, "sinew samples: %s | %s, %s%s%s | %s", SAMPLE_SCENES[app.number].name,
           SOLVERS[app.options.solver], STORAGES[app.options.storage], app.is_recording ? " | recording" : "", counters,
           app.refused[0]   ? app.refused
           : scene.text[0]  ? scene.text
                            : SAMPLE_SCENES[app.number].hint);
  SDL_SetWindowTitle(window, title);
}

static void run_window(SDL_Window *window) {
  while (!app.over) {
    SDL_Event event;
    int x, y, width, height;
    while (SDL_PollEvent(&event)) handle(&event);
    SDL_GetMouseState(&x, &y);
    SDL_GetWindowSize(window, &width, &height);
    app.width = width;
    app.height = height;
    place_camera();
    if (!app.is_paused || app.single) step(x, y);
    app.single = 0;
    draw();
    show_title(window);
    SDL_GL_SwapWindow(window);
  }
}

/* ---- Off screen ---- */

/* A framebuffer with four samples per pixel, and one to read from. */
static GLuint framebuffers[2];

static void create_framebuffers(void) {
  GLuint buffers[3];
  glGenFramebuffers(2, framebuffers);
  glGenRenderbuffers(3, buffers);
  for (int i = 0; i < 3; i++) {
    glBindRenderbuffer(GL_RENDERBUFFER, buffers[i]);
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, i < 2 ? 4 : 0, i == 1 ? GL_DEPTH_COMPONENT24 : GL_RGBA8, app.width,
                                     app.height);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffers[i / 2]);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, i == 1 ? GL_DEPTH_ATTACHMENT : GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER,
                              buffers[i]);
  }
}

static void save(const char *directory, const char *name) {
  uint8_t *pixels = (uint8_t *)allocate(3 * (size_t)app.width * (size_t)app.height, 1);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffers[0]);
  draw();
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffers[0]);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffers[1]);
  glBlitFramebuffer(0, 0, app.width, app.height, 0, 0, app.width, app.height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffers[1]);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, app.width, app.height, GL_RGB, GL_UNSIGNED_BYTE, pixels);
  png_save(directory, name, pixels, (uint32_t)app.width, (uint32_t)app.height);
  free(pixels);
}

static void count(size_t *nodes, size_t *triangles) {
  *nodes = *triangles = 0;
  for (uint32_t k = 0; k < scene.body_count; k++) {
    sinew_vec3_view positions;
    sinew_triangle_view surface;
    CHECK(sinew_body_get_positions(scene.world, scene.bodies[k].id, &positions));
    CHECK(sinew_body_get_triangles(scene.world, scene.bodies[k].id, &surface));
    *nodes += positions.count;
    *triangles += surface.count;
  }
}

/* Distance [m] of the node nearest to a point. */
static double nearest_node(const float point[3]) {
  double nearest = INFINITY;
  for (uint32_t k = 0; k < scene.body_count; k++) {
    sinew_vec3_view positions;
    CHECK(sinew_body_get_positions(scene.world, scene.bodies[k].id, &positions));
    for (size_t i = 0; i < positions.count; i++) nearest = fmin(nearest, distance(node(positions, i), point));
  }
  return nearest;
}

/* Plays frames, with the pointer down from the tenth on, and prints what it changed. */
static void run_offscreen(int frames, int has_pointer, const char *out, int is_animation) {
  const int middle = app.width / 2, level = app.height / 2, from = 10;
  size_t nodes, triangles, new_nodes, new_triangles;
  float begin[3] = {0}, end[3] = {0}, force[3] = {0}, torque[3];
  char name[64];
  create_framebuffers();
  place_camera();
  count(&nodes, &triangles);
  for (int frame = 0; frame < frames; frame++) {
    const int moved = frame < from ? 0 : frame - from;
    app.down = has_pointer && frame >= from;
    if (app.mode == SAMPLE_CUT) step(middle - 200 + 8 * moved, level + 10);
    else step(middle + 50, level + 10 - (app.mode == SAMPLE_PULL ? 2 * moved : 0));
    if (app.is_paused) fail("a step was refused:", app.refused);
    if (frame == from && scene.pointer.tool.index1) CHECK(sinew_tool_get_pose(scene.world, scene.pointer.tool, begin, NULL));
    snprintf(name, sizeof name, "%s_%03d.png", SAMPLE_SCENES[app.number].name, frame);
    if (is_animation) save(out, name);
  }
  count(&new_nodes, &new_triangles);
  printf("%s: %lu nodes, %lu triangles; then %lu, %lu\n", SAMPLE_SCENES[app.number].name, (unsigned long)nodes,
         (unsigned long)triangles, (unsigned long)new_nodes, (unsigned long)new_triangles);
  if (scene.pointer.tool.index1) {
    CHECK(sinew_tool_get_pose(scene.world, scene.pointer.tool, end, NULL));
    CHECK(sinew_tool_get_wrench(scene.world, scene.pointer.tool, force, torque));
    printf("pointer moved %.1f mm; nearest node %.1f mm; force %.4f N\n", 1e3 * distance(begin, end), 1e3 * nearest_node(end),
           sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2]));
  }
  if (app.refused[0]) printf("refused: %s\n", app.refused);
  if (is_animation) join_frames(out, SAMPLE_SCENES[app.number].name, (uint32_t)frames, 33);
  else save(out[0] == '/' ? "" : ".", out);
}

static uint32_t number_of(const char *name, const char *what) {
  for (uint32_t k = 0; k < SAMPLE_SCENE_COUNT; k++)
    if (strcmp(what, "scene") == 0 && strcmp(name, SAMPLE_SCENES[k].name) == 0) return k;
  for (uint32_t k = 0; k < SAMPLE_MODE_COUNT; k++)
    if (strcmp(what, "pointer") == 0 && strcmp(name, MODES[k]) == 0) return k;
  fail("unknown name (how to call it: at the head of main.c):", name);
  return 0;
}

int main(int argc, char **argv) {
  const char *out = "samples.png";
  int frames = 0, has_pointer = 0, is_animation = 0;
  for (int i = 1; i < argc; i++) {
    const char *value = i + 1 < argc ? argv[i + 1] : "";
    if (strcmp(argv[i], "--list") == 0) {
      for (uint32_t k = 0; k < SAMPLE_SCENE_COUNT; k++) printf("%s: %s\n", SAMPLE_SCENES[k].name, SAMPLE_SCENES[k].hint);
      return 0;
    }
    if (strcmp(argv[i], "--apng") == 0) { is_animation = 1; continue; }
    if (strcmp(argv[i], "--scene") == 0) app.number = number_of(value, "scene");
    else if (strcmp(argv[i], "--pointer") == 0) app.mode = (sample_mode)number_of(value, "pointer"), has_pointer = 1;
    else if (strcmp(argv[i], "--offscreen") == 0) frames = atoi(value);
    else if (strcmp(argv[i], "--out") == 0) out = value;
    else if (strcmp(argv[i], "--width") == 0) app.width = atoi(value);
    else if (strcmp(argv[i], "--height") == 0) app.height = atoi(value);
    else fail("unknown argument (how to call it: at the head of main.c):", argv[i]);
    i++;
  }
  if (SDL_Init(SDL_INIT_VIDEO) != 0) fail("no display:", SDL_GetError());
  SDL_GL_SetAttribute(SDL_GL_CONTEXT_MAJOR_VERSION, 3);
  SDL_GL_SetAttribute(SDL_GL_CONTEXT_MINOR_VERSION, 3);
  SDL_GL_SetAttribute(SDL_GL_CONTEXT_PROFILE_MASK, SDL_GL_CONTEXT_PROFILE_CORE);
  SDL_GL_SetAttribute(SDL_GL_DEPTH_SIZE, 24);
  if (frames == 0) {
    SDL_GL_SetAttribute(SDL_GL_MULTISAMPLEBUFFERS, 1);
    SDL_GL_SetAttribute(SDL_GL_MULTISAMPLESAMPLES, 4);
  }
  SDL_Window *window = SDL_CreateWindow("sinew samples", SDL_WINDOWPOS_CENTERED, SDL_WINDOWPOS_CENTERED, app.width, app.height,
                                        SDL_WINDOW_OPENGL | (frames > 0 ? (Uint32)SDL_WINDOW_HIDDEN : (Uint32)SDL_WINDOW_RESIZABLE));
  SDL_GLContext context = window == NULL ? NULL : SDL_GL_CreateContext(window);
  if (context == NULL) fail("no OpenGL 3.3:", SDL_GetError());
  const char *why = draw_open();
  if (why != NULL) fail("cannot draw:", why);
  start(app.number);
  if (frames > 0) run_offscreen(frames, has_pointer, out, is_animation);
  else run_window(window);
  sample_end(&scene);
  SDL_GL_DeleteContext(context);
  SDL_DestroyWindow(window);
  SDL_Quit();
  return 0;
}
