/* An organ to be pulled, pressed and cut with the mouse, drawn by OpenGL out of the library's own memory.
 *
 *   viewer                in a window
 *   viewer -o DIRECTORY   by itself, unseen: plays what a hand would do, leaves pictures and tells what did not hold
 *
 * Left button: pull.  Right button: press with a ball.  Middle button, or left with Shift: cut.  Wheel: nearer.  Arrows: turn.
 * N: next scene.  S: next storage.  V: next solver.  R: the scene from its start.  Period: a single step.
 *  Space: stop and go.  Escape: end. */
#include "../../example.h"
#include "png.h"
#include <SDL.h>
#include <SDL_opengl.h>

#define WIDTH 1200
#define HEIGHT 800
#define LENGTH 0.2f      /* m: of the organ */
#define BALL 0.012f      /* m: radius */
#define DEEPEST 0.018f   /* m: how far the ball goes in */
#define TANGENT 0.27f    /* of half the vertical field of view */
#define CUT_DEPTH 0.03f  /* m: below the surface */

static const char *const STORAGES[] = {"PACKED", "EFFICIENT", "FAST LINK", "DYNAMIC BULK"};
static const char *const SOLVERS[] = {"VERLET", "IMPLICIT", "NEWTON"};

/* Scenes of one body each, in the order of the key N. */
typedef enum scene { ORGAN, CLOTH, TEARING, PRESSURE, SCENE_COUNT } scene;
static const char *const SCENES[] = {"ORGAN", "CLOTH", "TEARING", "PRESSURE"};

typedef enum deed { IDLE, PULLS, PRESSES, CUTS } deed;

static struct {
  sinew_world *world;
  sinew_mesh *mesh;
  sinew_body_id body;
  uint32_t storage, solver, scene;
  sinew_tool_id tool;            /* while something is held or pressed */
  sinew_attachment_id held;
  deed hand;
  int stopped, single, over; /* single: one step although stopped */
  float reach, depth;            /* m: from the eye to what the mouse met, and how far the ball is in */
  float turn, tilt, away;        /* rad, rad, m: the camera */
  float eye[3], axes[3][3];      /* its place; right, up, back */
  float last[3], last_reach;     /* the ray of the cut's last edge */
  float *normals;
  size_t room, triangles;
  double milliseconds, force;
  uint32_t cuts;
  char said[96];                 /* what was refused */
} view;

/* What a hand asks for may be refused; then it is told, and goes on. */
static int asked(sinew_status status) {
  char why[512] = "";
  if (status == SINEW_STATUS_OK) return 1;
  sinew_last_error(why, sizeof why);
  snprintf(view.said, sizeof view.said, "%.95s", why);
  return 0;
}

static void release(void) {
  const sinew_tool_id none = {0, 0};
  const sinew_attachment_id nothing = {0, 0};
  if (view.held.index1) asked(sinew_attachment_release(view.world, view.held));
  if (view.tool.index1) asked(sinew_tool_destroy(view.world, view.tool));
  view.tool = none, view.held = nothing, view.hand = IDLE;
}

/* The mesh of the scene: an organ of tetrahedra, or a cloth. */
static void create_mesh(void) {
  sinew_mesh_destroy(view.mesh);
  if (view.scene == CLOTH || view.scene == TEARING)
    view.mesh = cloth_mesh(LENGTH, 20);
  else
    CHECK(sinew_mesh_create_organ(LENGTH, 0.011f, &view.mesh));
}

/* Pins two opposite sides of a cloth, and pulls them apart by a part of its length. */
static void hang_cloth(float part) {
  sinew_vec3_view nodes;
  float *moved;
  size_t i;
  CHECK(sinew_body_get_positions(view.world, view.body, &nodes));
  moved = (float *)allocate(3 * nodes.count, sizeof *moved);
  for (i = 0; i < nodes.count; i++) {
    memcpy(moved + 3 * i, node(nodes, i), 3 * sizeof *moved);
    if (fabsf(moved[3 * i]) > 0.49f * LENGTH) CHECK(sinew_body_pin(view.world, view.body, (uint32_t)i));
    moved[3 * i] *= 1 + part;
  }
  CHECK(sinew_body_set_positions(view.world, view.body, moved, nodes.count));
  free(moved);
}

/* The body of the scene at its start, with this storage and solver. */
static void create_scene(void) {
  const int is_cloth = view.scene == CLOTH || view.scene == TEARING;
  sinew_body_def def;
  float low = 1, high = -1;
  size_t i;
  release();
  if (view.body.index1) CHECK(sinew_body_destroy(view.world, view.body));
  create_mesh();
  def = body_from_mesh(view.mesh);
  def.storage = view.storage;
  def.solver = view.solver;
  def.spare_nodes = 6000;
  def.mass_scaling = 0.05f;
  if (view.storage == SINEW_STORAGE_FAST_LINK) def.springs_per_node = 64; /* room for what cuts add */
  if (is_cloth) {
    def.node_mass = 1e-4f;
    def.node_damping = 2e-3f;
    def.stiffness = 50;
    if (view.scene == TEARING) def.tear_strain = 0.5f;
    if (view.scene == TEARING) def.most_tears = 4;
    CHECK(sinew_body_create(view.world, &def, &view.body));
    hang_cloth(view.scene == TEARING ? 0.2f : 0.0f);
  } else {
    def.material = SINEW_MATERIAL_SPRINGS;
    def.young_modulus = 6000;
    def.density = 1060;
    def.volume_stiffness = 2000;
    def.node_damping = 20 * 1060 * 1e-6f; /* 20 / s, of about a cubic centimeter each */
    if (view.scene == PRESSURE) def.pressure = 800;
    for (i = 0; i < def.node_count; i++) {
      low = fminf(low, def.positions[3 * i + 1]);
      high = fmaxf(high, def.positions[3 * i + 1]);
    }
    CHECK(sinew_body_create(view.world, &def, &view.body));
    pin_below(view.world, view.body, 1, low + 0.12f * (high - low));
  }
  view.cuts = 0;
}

static void place_camera(void) {
  const float s = sinf(view.turn), c = cosf(view.turn), u = sinf(view.tilt), w = cosf(view.tilt);
  const float axes[3][3] = {{c, 0, -s}, {-s * u, w, -c * u}, {s * w, u, c * w}};
  int i;
  memcpy(view.axes, axes, sizeof axes);
  for (i = 0; i < 3; i++) view.eye[i] = view.away * axes[2][i];
}

/* The ray through a pixel: from the eye, of unit length. */
static void ray_through(int x, int y, float ray[3]) {
  const float across = TANGENT * (2.0f * (float)x - WIDTH) / HEIGHT, up = TANGENT * (HEIGHT - 2.0f * (float)y) / HEIGHT;
  const float length = sqrtf(1 + across * across + up * up);
  int i;
  for (i = 0; i < 3; i++) ray[i] = (across * view.axes[0][i] + up * view.axes[1][i] - view.axes[2][i]) / length;
}

static void point_on(const float ray[3], float reach, float point[3]) {
  int i;
  for (i = 0; i < 3; i++) point[i] = view.eye[i] + reach * ray[i];
}

static int create_tool(const float place[3], float radius, uint32_t mask) {
  sinew_tool_def def;
  CHECK(sinew_tool_def_init(&def, sizeof def));
  def.shape = SINEW_SHAPE_SPHERE, def.radius = radius, def.collision_mask = mask, def.friction = 0.3f;
  memcpy(def.position, place, sizeof def.position);
  return asked(sinew_tool_create(view.world, &def, &view.tool));
}

static void mouse_down(deed does, int x, int y) {
  float ray[3], place[3];
  sinew_surface_point met;
  release();
  ray_through(x, y, ray);
  met.struct_size = sizeof met;
  if (!asked(sinew_world_cast_ray(view.world, view.eye, ray, 10, &met))) return;
  view.reach = met.distance, view.depth = 0, view.said[0] = 0;
  memcpy(view.last, ray, sizeof ray), view.last_reach = met.body.index1 ? met.distance : view.away;
  if (does == CUTS) view.hand = CUTS; /* it may begin beside the organ */
  if (does == CUTS || met.body.index1 == 0) return;
  if (does == PRESSES) {
    point_on(ray, view.reach - 1.1f * BALL, place);
    if (create_tool(place, BALL, UINT32_MAX)) view.hand = PRESSES;
  } else if (create_tool(met.position, BALL / 4, 0)) { /* it touches nothing: it only holds */
    sinew_triangle_view triangles;
    const int nearest = met.weights[0] > met.weights[1] ? (met.weights[0] > met.weights[2] ? 0 : 2) : (met.weights[1] > met.weights[2] ? 1 : 2);
    CHECK(sinew_body_get_triangles(view.world, view.body, &triangles));
    if (asked(sinew_body_attach_node(view.world, view.body, triangles.data[3 * met.triangle + nearest], view.tool, INFINITY, &view.held))) {
      view.hand = PULLS;
    } else {
      release();
    }
  }
}

/* A blade's edge goes into the tissue along the ray of the mouse, and sweeps from ray to ray. */
static void cut_to(const float ray[3]) {
  sinew_surface_point met;
  sinew_cut_report report;
  float start[6], end[6];
  met.struct_size = sizeof met, report.struct_size = sizeof report;
  if (!asked(sinew_world_cast_ray(view.world, view.eye, ray, 10, &met))) return;
  if (met.body.index1) view.reach = met.distance;
  point_on(view.last, view.last_reach - CUT_DEPTH, start), point_on(view.last, view.last_reach + CUT_DEPTH, start + 3);
  point_on(ray, view.reach - CUT_DEPTH, end), point_on(ray, view.reach + CUT_DEPTH, end + 3);
  if (asked(sinew_body_cut(view.world, view.body, start, end, &report))) view.cuts++;
  memcpy(view.last, ray, sizeof view.last), view.last_reach = view.reach;
}

static void mouse_moved(int x, int y) {
  float ray[3];
  ray_through(x, y, ray);
  if (view.hand == CUTS && distance(ray, view.last) * view.reach > 0.004) cut_to(ray); /* not for every pixel */
}

static void key_down(SDL_Keycode key) {
  switch (key) {
    case SDLK_s: view.storage = (view.storage + 1) % 4, create_scene(); break;
    case SDLK_v: view.solver = (view.solver + 1) % 3, create_scene(); break;
    case SDLK_n: view.scene = (view.scene + 1) % SCENE_COUNT, create_scene(); break;
    case SDLK_PERIOD: view.stopped = view.single = 1; break;
    case SDLK_r: create_scene(); break;
    case SDLK_SPACE: view.stopped = !view.stopped; break;
    case SDLK_LEFT: view.turn -= 0.1f; break;
    case SDLK_RIGHT: view.turn += 0.1f; break;
    case SDLK_UP: view.tilt = fminf(1.4f, view.tilt + 0.1f); break;
    case SDLK_DOWN: view.tilt = fmaxf(-0.2f, view.tilt - 0.1f); break;
    case SDLK_ESCAPE: view.over = 1; break;
    default: break;
  }
}

static void handle(const SDL_Event *event) {
  switch (event->type) {
    case SDL_QUIT: view.over = 1; break;
    case SDL_KEYDOWN: key_down(event->key.keysym.sym); break;
    case SDL_MOUSEWHEEL: view.away *= expf(-0.1f * (float)event->wheel.y); break;
    case SDL_MOUSEMOTION: mouse_moved(event->motion.x, event->motion.y); break;
    case SDL_MOUSEBUTTONUP: release(); break;
    case SDL_MOUSEBUTTONDOWN: {
      const int button = event->button.button, cuts = button == SDL_BUTTON_MIDDLE || (button == SDL_BUTTON_LEFT && SDL_GetModState() & KMOD_SHIFT);
      mouse_down(cuts ? CUTS : button == SDL_BUTTON_RIGHT ? PRESSES : PULLS, event->button.x, event->button.y);
      break;
    }
    default: break;
  }
}

/* What the hand holds follows the mouse; a sixtieth of a second goes by. */
static void step(int x, int y) {
  float ray[3], place[3], force[3] = {0, 0, 0}, torque[3];
  const double began = seconds_now();
  ray_through(x, y, ray);
  if (view.hand == PULLS || view.hand == PRESSES) {
    if (view.hand == PRESSES) view.depth = fminf(DEEPEST, view.depth + 0.0005f);
    point_on(ray, view.hand == PULLS ? view.reach : view.reach - BALL + view.depth, place);
    asked(sinew_tool_set_pose(view.world, view.tool, place, NULL));
  }
  if (!asked(sinew_world_step(view.world, (float)FRAME, NULL))) view.stopped = 1;
  view.milliseconds = 0.8 * view.milliseconds + 0.2 * 1e3 * (seconds_now() - began);
  if (view.tool.index1) asked(sinew_tool_get_wrench(view.world, view.tool, force, torque));
  view.force = sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2]);
}

/* Normals at the nodes, from the triangles as they lie now. */
static void find_normals(sinew_vec3_view nodes, sinew_triangle_view triangles) {
  size_t t;
  int i, k;
  if (nodes.count > view.room) {
    free(view.normals);
    view.room = nodes.count + nodes.count / 2;
    view.normals = (float *)allocate(3 * view.room, sizeof *view.normals);
  }
  memset(view.normals, 0, 3 * nodes.count * sizeof *view.normals);
  for (t = 0; t < 3 * triangles.count; t += 3) {
    const uint32_t *corner = triangles.data + t;
    const float *a = node(nodes, corner[0]), *b = node(nodes, corner[1]), *c = node(nodes, corner[2]);
    for (i = 0; i < 3; i++) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      const float n = (b[j] - a[j]) * (c[l] - a[l]) - (b[l] - a[l]) * (c[j] - a[j]);
      for (k = 0; k < 3; k++) view.normals[3 * corner[k] + (uint32_t)i] += n;
    }
  }
}

static void draw_ball(const float place[3], float radius) {
  const int rings = 24, sides = 36;
  int i, j, k;
  for (i = 0; i < rings; i++) {
    glBegin(GL_TRIANGLE_STRIP);
    for (j = 0; j <= sides; j++) {
      for (k = 0; k < 2; k++) {
        const double a = 3.14159265 * (i + 1 - k) / rings, b = 2 * 3.14159265 * j / sides;
        const float n[3] = {(float)(sin(a) * cos(b)), (float)cos(a), (float)(sin(a) * sin(b))};
        glNormal3fv(n), glVertex3f(place[0] + radius * n[0], place[1] + radius * n[1], place[2] + radius * n[2]);
      }
    }
    glEnd();
  }
}

/* Letters of 3 by 5 dots, a bit for each, from the upper left. */
static unsigned dots_of(char letter) {
  static const char *const known = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ.:-/";
  static const unsigned short dots[] = {
      31599, 11415, 29671, 29391, 23497, 31183, 31215, 29330, 31727, 31695, 11245, 27566, 14627, 27502, 31143, 31140, 14699, 23533, 29847, 4714,
      23469, 18727, 24557, 27501, 11114, 27556, 11089, 27565, 14478, 29842, 23407, 23402, 23549, 23213, 23186, 29351, 2, 1040, 448, 4772};
  const char *at = letter == 0 ? NULL : strchr(known, letter >= 'a' && letter <= 'z' ? letter - 'a' + 'A' : letter);
  return at ? dots[at - known] : 0;
}

static void write_text(const char *text, float x, float y, float dot) {
  glBegin(GL_QUADS);
  for (; *text; text++, x += 4 * dot) {
    const unsigned dots = dots_of(*text);
    int i;
    for (i = 0; i < 15; i++) {
      const float left = x + (float)(i % 3) * dot, top = y + (float)(i / 3) * dot;
      if (dots >> (14 - i) & 1) glVertex2f(left, top), glVertex2f(left + dot, top), glVertex2f(left + dot, top + dot), glVertex2f(left, top + dot);
    }
  }
  glEnd();
}

static void draw_words(size_t node_count) {
  char line[160];
  glDisable(GL_LIGHTING), glDisable(GL_DEPTH_TEST);
  glMatrixMode(GL_PROJECTION), glLoadIdentity(), glOrtho(0, WIDTH, HEIGHT, 0, -1, 1);
  glMatrixMode(GL_MODELVIEW), glLoadIdentity();
  glColor3f(0.92f, 0.94f, 0.96f);
  snprintf(line, sizeof line, "%s  %s  %s  %lu nodes", SCENES[view.scene], STORAGES[view.storage], SOLVERS[view.solver], (unsigned long)node_count);
  write_text(line, 24, 24, 3);
  snprintf(line, sizeof line, "%.1f ms   %.2f N   %u cuts", view.milliseconds, view.force, view.cuts);
  write_text(line, 24, 50, 3);
  glColor3f(1, 0.75f, 0.4f), write_text(view.said, 24, 76, 2);
  glColor3f(0.6f, 0.64f, 0.7f);
  write_text("left: pull   right: press   middle: cut   wheel   arrows   N: scene   S: storage   V: solver   R: reset", 24, HEIGHT - 32, 2);
}

static void draw(void) {
  const float near_plane = 0.05f, half = near_plane * TANGENT, sun[4] = {0.5f, 0.9f, 0.6f, 0}, sky[4] = {-0.7f, 0.1f, 0.4f, 0};
  const float dim[4] = {0.25f, 0.28f, 0.36f, 1}, shine[4] = {0.45f, 0.45f, 0.45f, 1}, dull[4] = {0.16f, 0.16f, 0.19f, 1};
  sinew_vec3_view nodes;
  sinew_triangle_view triangles;
  float matrix[16] = {0};
  int i, k;
  glClear(GL_DEPTH_BUFFER_BIT);
  glDisable(GL_LIGHTING), glDisable(GL_DEPTH_TEST);
  glMatrixMode(GL_PROJECTION), glLoadIdentity(), glMatrixMode(GL_MODELVIEW), glLoadIdentity();
  glBegin(GL_QUADS);
  glColor3f(0.10f, 0.11f, 0.14f), glVertex2f(-1, -1), glVertex2f(1, -1);
  glColor3f(0.24f, 0.27f, 0.33f), glVertex2f(1, 1), glVertex2f(-1, 1);
  glEnd();

  place_camera();
  glMatrixMode(GL_PROJECTION), glLoadIdentity();
  glFrustum(-half * WIDTH / HEIGHT, half * WIDTH / HEIGHT, -half, half, near_plane, 5);
  glMatrixMode(GL_MODELVIEW);
  for (i = 0; i < 3; i++) {
    for (k = 0; k < 3; k++) matrix[4 * k + i] = view.axes[i][k];
  }
  matrix[15] = 1;
  glLoadMatrixf(matrix), glTranslatef(-view.eye[0], -view.eye[1], -view.eye[2]);
  glEnable(GL_LIGHTING), glEnable(GL_DEPTH_TEST);
  glLightfv(GL_LIGHT0, GL_POSITION, sun), glLightfv(GL_LIGHT1, GL_POSITION, sky), glLightfv(GL_LIGHT1, GL_DIFFUSE, dim);
  glLightfv(GL_LIGHT0, GL_SPECULAR, shine), glLightModelfv(GL_LIGHT_MODEL_AMBIENT, dull);
  glMaterialfv(GL_FRONT_AND_BACK, GL_SPECULAR, shine), glMaterialf(GL_FRONT_AND_BACK, GL_SHININESS, 40);

  CHECK(sinew_body_get_positions(view.world, view.body, &nodes)); /* lent, and drawn from where they are */
  CHECK(sinew_body_get_triangles(view.world, view.body, &triangles));
  find_normals(nodes, triangles);
  view.triangles = triangles.count;
  glEnableClientState(GL_VERTEX_ARRAY), glEnableClientState(GL_NORMAL_ARRAY);
  glVertexPointer(3, GL_FLOAT, (GLsizei)nodes.stride, nodes.data), glNormalPointer(GL_FLOAT, 0, view.normals);
  glColor3f(0.72f, 0.26f, 0.22f), glEnable(GL_POLYGON_OFFSET_FILL), glPolygonOffset(1, 1);
  glDrawElements(GL_TRIANGLES, (GLsizei)(3 * triangles.count), GL_UNSIGNED_INT, triangles.data);
  glDisableClientState(GL_NORMAL_ARRAY), glDisable(GL_LIGHTING); /* the edges, faintly */
  glPolygonMode(GL_FRONT_AND_BACK, GL_LINE), glDepthFunc(GL_LEQUAL), glColor4f(0.2f, 0.02f, 0.02f, 0.18f);
  glDrawElements(GL_TRIANGLES, (GLsizei)(3 * triangles.count), GL_UNSIGNED_INT, triangles.data);
  glPolygonMode(GL_FRONT_AND_BACK, GL_FILL), glDisableClientState(GL_VERTEX_ARRAY), glEnable(GL_LIGHTING);
  if (view.tool.index1) {
    float place[3], turned[4];
    CHECK(sinew_tool_get_pose(view.world, view.tool, place, turned));
    glColor3f(0.75f, 0.8f, 0.86f), draw_ball(place, view.hand == PULLS ? BALL / 4 : BALL);
  }
  draw_words(nodes.count);
}

static void save(const char *directory, const char *name) {
  unsigned char *pixels = (unsigned char *)allocate(3 * WIDTH * HEIGHT, 1);
  char *path = path_in(directory, name);
  glPixelStorei(GL_PACK_ALIGNMENT, 1), glReadPixels(0, 0, WIDTH, HEIGHT, GL_RGB, GL_UNSIGNED_BYTE, pixels);
  if (!png_save(path, pixels, WIDTH, HEIGHT)) fail("cannot write", path);
  free(path), free(pixels);
}

/* By itself: events as a hand makes them. */
static struct { int x, y; const char *directory; } play;

static void push_button(Uint32 type, int button) {
  SDL_Event event;
  memset(&event, 0, sizeof event);
  event.type = type, event.button.button = (Uint8)button, event.button.x = play.x, event.button.y = play.y;
  SDL_PushEvent(&event);
}

static void push_key(SDL_Keycode key) {
  SDL_Event event;
  memset(&event, 0, sizeof event);
  event.type = SDL_KEYDOWN, event.key.keysym.sym = key;
  SDL_PushEvent(&event);
}

static void play_frames(int count, int dx, int dy) {
  SDL_Event event;
  while (count-- > 0) {
    if (dx || dy) {
      memset(&event, 0, sizeof event);
      event.type = SDL_MOUSEMOTION, event.motion.x = play.x += dx, event.motion.y = play.y += dy;
      SDL_PushEvent(&event);
    }
    while (SDL_PollEvent(&event)) handle(&event);
    step(play.x, play.y);
  }
  draw();
}

static void expect(int holds, const char *what) {
  if (!holds) fprintf(stderr, "%s\n", view.said), fail("does not hold:", what);
}

static void play_all(void) {
  int i;
  size_t before;
  play_frames(20, 0, 0);
  play.x = WIDTH * 11 / 20, play.y = HEIGHT * 9 / 20; /* pulled up by its middle */
  push_button(SDL_MOUSEBUTTONDOWN, SDL_BUTTON_LEFT), play_frames(40, 1, -4);
  expect(view.hand == PULLS && view.force > 0.1, "the organ is pulled and pulls");
  printf("pulled: %.2f N, %.1f ms a frame\n", view.force, view.milliseconds);
  save(play.directory, "viewer_pull.png");
  push_button(SDL_MOUSEBUTTONUP, SDL_BUTTON_LEFT), play_frames(30, 0, 0);
  expect(view.hand == IDLE && view.force == 0, "it has been let go");
  play.x = WIDTH * 10 / 20, play.y = HEIGHT * 9 / 20;
  push_button(SDL_MOUSEBUTTONDOWN, SDL_BUTTON_RIGHT), play_frames(60, 0, 0);
  expect(view.hand == PRESSES && view.force > 0.1, "the organ is pressed and presses back");
  printf("pressed: %.2f N, %.1f ms a frame\n", view.force, view.milliseconds);
  save(play.directory, "viewer_press.png");
  push_button(SDL_MOUSEBUTTONUP, SDL_BUTTON_RIGHT), play_frames(10, 0, 0);
  for (i = 0; i < 12; i++) { /* all storages, with all solvers */
    push_key(i % 4 == 3 ? SDLK_v : SDLK_s), play_frames(1, 0, 0);
    if (i % 4 == 3) push_key(SDLK_s), play_frames(1, 0, 0);
  }
  expect(view.storage == SINEW_STORAGE_PACKED && view.solver == SINEW_SOLVER_VERLET, "it has been through all of them");
  play_frames(10, 0, 0);
  before = view.triangles;
  play.x = WIDTH * 7 / 20, play.y = HEIGHT * 9 / 20;
  push_button(SDL_MOUSEBUTTONDOWN, SDL_BUTTON_MIDDLE), play_frames(40, 9, 0);
  push_button(SDL_MOUSEBUTTONUP, SDL_BUTTON_MIDDLE), play_frames(5, 0, 0);
  expect(view.cuts > 3 && view.triangles > before + 20, "the organ is cut");
  play.x = WIDTH * 10 / 20, play.y = HEIGHT * 17 / 40;
  push_button(SDL_MOUSEBUTTONDOWN, SDL_BUTTON_LEFT), play_frames(30, 0, -3);
  printf("cut %u times, %lu triangles, one lip pulled with %.2f N, %.1f ms a frame\n", view.cuts, (unsigned long)view.triangles, view.force,
         view.milliseconds);
  save(play.directory, "viewer_cut.png");
  push_button(SDL_MOUSEBUTTONUP, SDL_BUTTON_LEFT), play_frames(1, 0, 0);
  for (i = 1; i < SCENE_COUNT; i++) { /* the other scenes, pulled by their middle */
    char name[64];
    push_key(SDLK_n), play_frames(10, 0, 0);
    expect(view.scene == (uint32_t)i, "the next scene is shown");
    play.x = WIDTH / 2, play.y = HEIGHT / 2;
    push_button(SDL_MOUSEBUTTONDOWN, SDL_BUTTON_LEFT), play_frames(25, 0, -6);
    printf("%s: %.2f N, %lu triangles, %.1f ms a frame\n", SCENES[i], view.force, (unsigned long)view.triangles, view.milliseconds);
    snprintf(name, sizeof name, "viewer_scene_%d.png", i);
    save(play.directory, name);
    push_button(SDL_MOUSEBUTTONUP, SDL_BUTTON_LEFT), play_frames(1, 0, 0);
  }
  expect(!view.stopped && view.said[0] == 0, "nothing was refused");
}

int main(int argc, char **argv) {
  const options chosen = read_options(argc, argv, 0);
  const int alone = argc > 1;
  SDL_Window *window;
  SDL_GLContext context;
  if (SDL_Init(SDL_INIT_VIDEO) != 0) fail("no display:", SDL_GetError());
  SDL_GL_SetAttribute(SDL_GL_MULTISAMPLEBUFFERS, 1), SDL_GL_SetAttribute(SDL_GL_MULTISAMPLESAMPLES, 4);
  window = SDL_CreateWindow("sinew", SDL_WINDOWPOS_CENTERED, SDL_WINDOWPOS_CENTERED, WIDTH, HEIGHT,
                            SDL_WINDOW_OPENGL | (alone ? (Uint32)SDL_WINDOW_HIDDEN : 0u));
  context = window == NULL ? NULL : SDL_GL_CreateContext(window);
  if (context == NULL) fail("no OpenGL:", SDL_GetError());
  glEnable(GL_LIGHT0), glEnable(GL_LIGHT1), glEnable(GL_COLOR_MATERIAL), glEnable(GL_NORMALIZE), glEnable(GL_BLEND);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA), glLightModeli(GL_LIGHT_MODEL_TWO_SIDE, 1);

  view.turn = 0.4f, view.tilt = 0.6f, view.away = 0.5f;
  view.world = create_world(9.81f);
  create_scene();
  place_camera();
  if (alone) {
    play.directory = chosen.directory;
    play_all();
  }
  while (!alone && !view.over) {
    SDL_Event event;
    int x, y;
    while (SDL_PollEvent(&event)) handle(&event);
    SDL_GetMouseState(&x, &y);
    if (!view.stopped || view.single) step(x, y);
    view.single = 0;
    draw();
    SDL_GL_SwapWindow(window);
  }
  sinew_world_destroy(view.world), sinew_mesh_destroy(view.mesh), free(view.normals);
  SDL_GL_DeleteContext(context), SDL_DestroyWindow(window), SDL_Quit();
  return 0;
}
