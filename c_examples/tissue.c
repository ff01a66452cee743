/* A liver by a laboratory's numbers is pressed between the table it lies on and a plate: its force, and how well it keeps its volume,
 * as springs and as finite elements.
 *
 *   tissue [-o DIRECTORY] [-n FRAMES] [FILE [SCALE]]
 *
 * FILE is a tetrahedral mesh (.vtk .msh .node), SCALE what one of its units is in metres (1; 0.001 for millimetres). Without a file an
 * organ is made. Leaves tissue_springs.png and tissue_tetrahedra.png, pressed as far as it goes, each with a _strain.png of how much
 * shorter the tissue is in the direction in which it is pressed most, and tissue.csv in the directory. */
#include "example.h"

#define DAMPING 2e-3f /* N s/m: how a node is slowed down; the tissue follows the plate without swinging */
#define DEPTH 0.3     /* of the thickness: how far the plate comes down */
#define PRESS 1.5     /* s: it comes down, */
#define HOLD 0.5      /* s: and stays */

typedef struct trial {
  const char *name, *picture, *strain_picture;
  uint32_t material;
  float poisson_ratio;
  sinew_world *world;
  sinew_body_id liver;
  sinew_tool_id plate;
  float force;
  double growth;
} trial;

/* Six times the volume of all tetrahedra, with nodes where `at` finds them. */
static double volume(const sinew_mesh_view *shape, sinew_vec3_view nodes) {
  double sum = 0;
  size_t i;
  int axis;
  for (i = 0; i < shape->tetrahedron_count; i++) {
    const uint32_t *corner = shape->tetrahedra + 4 * i;
    double edge[3][3];
    int j;
    for (j = 0; j < 3; j++) {
      for (axis = 0; axis < 3; axis++) {
        edge[j][axis] = (double)node(nodes, corner[j + 1])[axis] - node(nodes, corner[0])[axis];
      }
    }
    for (axis = 0; axis < 3; axis++) {
      const int y = (axis + 1) % 3, z = (axis + 2) % 3;
      sum += edge[0][axis] * (edge[1][y] * edge[2][z] - edge[1][z] * edge[2][y]);
    }
  }
  return sum;
}

/* A plane that looks along y, up or down. */
static sinew_tool_id create_plate(sinew_world *world, float height, int looks_down) {
  sinew_tool_def def;
  sinew_tool_id plate;
  CHECK(sinew_tool_def_init(&def, sizeof def));
  def.shape = SINEW_SHAPE_PLANE;
  def.position[1] = height;
  if (looks_down) def.orientation[0] = 1, def.orientation[3] = 0;
  CHECK(sinew_tool_create(world, &def, &plate));
  return plate;
}

static void create_trial(trial *made, const sinew_mesh_view *shape, const sinew_material_preset *tissue, float low, float high) {
  sinew_body_def def;
  sinew_vec3_view nodes;
  made->world = create_world(0);
  CHECK(sinew_body_def_init(&def, sizeof def));
  def.positions = shape->positions;
  def.node_count = shape->node_count;
  def.tetrahedra = shape->tetrahedra;
  def.tetrahedron_count = shape->tetrahedron_count;
  def.material = made->material;
  def.young_modulus = tissue->young_modulus;
  def.poisson_ratio = made->poisson_ratio;
  def.density = tissue->density;
  def.node_damping = DAMPING;
  CHECK(sinew_body_create(made->world, &def, &made->liver));
  create_plate(made->world, low, 0);
  made->plate = create_plate(made->world, high, 1);
  CHECK(sinew_body_get_positions(made->world, made->liver, &nodes));
  made->growth = 0;
}

static void step(trial *of, const sinew_mesh_view *shape, float height, double rest) {
  const float place[3] = {0, height, 0};
  float force[3], torque[3];
  sinew_vec3_view nodes;
  CHECK(sinew_tool_set_pose(of->world, of->plate, place, NULL));
  CHECK(sinew_world_step(of->world, (float)FRAME, NULL));
  CHECK(sinew_tool_get_wrench(of->world, of->plate, force, torque));
  CHECK(sinew_body_get_positions(of->world, of->liver, &nodes));
  of->force = force[1];
  of->growth = volume(shape, nodes) / rest - 1;
}

/* The tissue coloured by its smallest principal strain, from none to as much as the plate goes down. */
static void save_strain(const trial *of, const sinew_mesh_view *shape, const sinew_picture_def *picture, const char *directory) {
  sinew_strain *strains = (sinew_strain *)allocate(shape->tetrahedron_count, sizeof *strains);
  float *pressed = (float *)allocate(shape->tetrahedron_count, sizeof *pressed);
  float *at_nodes = (float *)allocate(shape->node_count, sizeof *at_nodes);
  char *path = path_in(directory, of->strain_picture);
  sinew_body_values values;
  size_t i;
  CHECK(sinew_body_get_tetrahedron_strains(of->world, of->liver, shape->positions, shape->node_count, shape->tetrahedra,
                                           shape->tetrahedron_count, strains));
  for (i = 0; i < shape->tetrahedron_count; i++) pressed[i] = -strains[i].smallest;
  CHECK(sinew_util_average_to_nodes(shape->tetrahedra, 4, pressed, shape->tetrahedron_count, at_nodes, shape->node_count));
  memset(&values, 0, sizeof values);
  values.body = of->liver, values.values = at_nodes, values.node_count = shape->node_count;
  values.high = (float)DEPTH, values.colours = SINEW_COLOURS_SEQUENTIAL;
  CHECK(sinew_world_save_picture_of_values(of->world, picture, &values, 1, path));
  free(path), free(at_nodes), free(pressed), free(strains);
}

int main(int argc, char **argv) {
  const options chosen = read_options(argc, argv, 2);
  const double scale = chosen.argument_count > 1 ? atof(chosen.arguments[1]) : 1;
  const int all_frames = (int)lround((PRESS + HOLD) / FRAME);
  const int frame_count = chosen.frame_count > 0 ? chosen.frame_count : all_frames;
  trial trials[] = {
      {"springs", "tissue_springs.png", "tissue_springs_strain.png", SINEW_MATERIAL_SPRINGS, 0, NULL, {0, 0}, {0, 0}, 0, 0},
      {"tetrahedra", "tissue_tetrahedra.png", "tissue_tetrahedra_strain.png", SINEW_MATERIAL_TETRAHEDRA, 0.45f, NULL, {0, 0}, {0, 0}, 0, 0},
  };
  const size_t trial_count = sizeof trials / sizeof *trials;
  sinew_material_preset liver;
  sinew_mesh *mesh;
  sinew_mesh_view shape;
  sinew_vec3_view rest;
  sinew_picture_def picture;
  float low[3], high[3];
  double rest_volume, thickness, spent = 0;
  FILE *curve;
  size_t i;
  int frame;

  liver.struct_size = sizeof liver;
  CHECK(sinew_material_get_preset(SINEW_PRESET_LIVER, &liver));
  if (chosen.argument_count > 0) {
    CHECK(sinew_mesh_load(chosen.arguments[0], SINEW_MESH_FORMAT_AUTO, (float)scale, &mesh));
  } else {
    CHECK(sinew_mesh_create_organ(0.2f, 0.012f, &mesh));
  }
  shape.struct_size = sizeof shape;
  CHECK(sinew_mesh_get_view(mesh, &shape));
  if (shape.tetrahedron_count == 0) fail("no tetrahedra in", chosen.arguments[0]);
  memcpy(low, shape.positions, sizeof low);
  memcpy(high, shape.positions, sizeof high);
  for (i = 0; i < 3 * shape.node_count; i++) {
    low[i % 3] = fminf(low[i % 3], shape.positions[i]);
    high[i % 3] = fmaxf(high[i % 3], shape.positions[i]);
  }
  rest.data = shape.positions, rest.count = shape.node_count, rest.stride = 3 * sizeof(float);
  rest_volume = volume(&shape, rest);
  thickness = (double)high[1] - low[1];
  for (i = 0; i < trial_count; i++) create_trial(trials + i, &shape, &liver, low[1], high[1]);

  printf("%s: Young's modulus %.0f Pa, %.0f kg/m^3 (%s)\n", liver.name, liver.young_modulus, liver.density, liver.source);
  printf("%zu nodes, %zu tetrahedra, %.1f cm^3, %.1f mm thick; the plate goes down by %.1f mm\n\n", shape.node_count,
         shape.tetrahedron_count, 1e6 * fabs(rest_volume) / 6, 1e3 * thickness, 1e3 * DEPTH * thickness);
  printf("            springs, nu 0.25        tetrahedra, nu 0.45\n");
  printf("depth mm    force N   volume %%     force N   volume %%\n");
  curve = create_file(chosen.directory, "tissue.csv");
  fprintf(curve, "time_s,depth_m,springs_force_N,springs_volume_change,tetrahedra_force_N,tetrahedra_volume_change\n");
  for (frame = 1; frame <= frame_count; frame++) {
    const double depth = DEPTH * thickness * smooth(frame * FRAME / PRESS), started = seconds_now();
    for (i = 0; i < trial_count; i++) step(trials + i, &shape, (float)(high[1] - depth), rest_volume);
    spent += seconds_now() - started;
    fprintf(curve, "%.6f,%.6f,%.6f,%.6f,%.6f,%.6f\n", frame * FRAME, depth, trials[0].force, trials[0].growth, trials[1].force,
            trials[1].growth);
    clear_progress();
    if (frame % 10 == 0) {
      printf("%8.2f%11.4f%11.2f%12.4f%11.2f\n", 1e3 * depth, trials[0].force, 100 * trials[0].growth, trials[1].force,
             100 * trials[1].growth);
    }
    show_progress(frame, frame_count);
  }
  clear_progress();
  printf("\n%.2f ms a frame for both\n", 1e3 * spent / frame_count);

  picture = camera(low, high, 1);
  for (i = 0; i < trial_count; i++) {
    save_picture(trials[i].world, &picture, chosen.directory, trials[i].picture);
    save_strain(trials + i, &shape, &picture, chosen.directory);
    sinew_world_destroy(trials[i].world);
  }
  fclose(curve);
  sinew_mesh_destroy(mesh);
  return 0;
}
