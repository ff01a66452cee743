// Generated from include/sinew; do not edit. For ffi.cdef of cffi.
#define SINEW_VERSION_MAJOR 0
#define SINEW_VERSION_MINOR 2
#define SINEW_VERSION_PATCH 0
#define SINEW_NO_NODE 4294967295
#define SINEW_AXIS_X 1
#define SINEW_AXIS_Y 2
#define SINEW_AXIS_Z 4
#define SINEW_NO_TRIANGLE 4294967295
uint32_t sinew_version(void);
typedef enum sinew_status_code {
  SINEW_STATUS_OK = 0,
  SINEW_STATUS_INVALID_ARGUMENT = 1,
  SINEW_STATUS_STALE_ID = 2,
  SINEW_STATUS_CAPACITY = 3,
  SINEW_STATUS_OUT_OF_MEMORY = 4,
  SINEW_STATUS_UNSTABLE = 5,
  SINEW_STATUS_UNSUPPORTED = 6,
  SINEW_STATUS_IO = 7,
  SINEW_STATUS_INTERNAL = 8
} sinew_status_code;
typedef int32_t sinew_status;
const char *sinew_status_name(sinew_status status);
size_t sinew_last_error(char *buffer, size_t capacity);
typedef struct sinew_world sinew_world;
typedef struct sinew_body_id {
  uint32_t index1;
  uint32_t generation;
} sinew_body_id;
typedef struct sinew_tool_id {
  uint32_t index1;
  uint32_t generation;
} sinew_tool_id;
typedef struct sinew_blade_id {
  uint32_t index1;
  uint32_t generation;
} sinew_blade_id;
typedef struct sinew_attachment_id {
  uint32_t index1;
  uint32_t generation;
} sinew_attachment_id;
typedef struct sinew_vec3_view {
  const float *data;
  size_t count;
  size_t stride;
} sinew_vec3_view;
typedef struct sinew_dvec3_view {
  const double *data;
  size_t count;
  size_t stride;
} sinew_dvec3_view;
typedef struct sinew_triangle_view {
  const uint32_t *data;
  size_t count;
} sinew_triangle_view;
typedef enum sinew_detection {
  SINEW_DETECTION_EXACT = 0,
  SINEW_DETECTION_IMAGE_SPACE = 1,
  SINEW_DETECTION_DISTANCE_FIELD = 2
} sinew_detection;
typedef void (*sinew_task)(void *task_data, uint32_t index);
typedef void (*sinew_run_tasks)(void *context, sinew_task task, void *task_data, uint32_t count);
typedef enum sinew_kernel {
  SINEW_KERNEL_BEST = 0,
  SINEW_KERNEL_PORTABLE = 1,
  SINEW_KERNEL_AVX2 = 2,
  SINEW_KERNEL_AVX512 = 3,
  SINEW_KERNEL_NEON = 4
} sinew_kernel;
typedef struct sinew_world_def {
  size_t struct_size;
  float gravity[3];
  uint32_t thread_count;
  uint32_t substeps;
  uint32_t max_substeps;
  float tolerance;
  uint32_t reserved;
  sinew_run_tasks run_tasks;
  void *tasks_context;
  uint32_t kernel;
} sinew_world_def;
sinew_status sinew_world_def_init(sinew_world_def *def, size_t struct_size);
sinew_status sinew_world_create(const sinew_world_def *def, sinew_world **out);
void sinew_world_destroy(sinew_world *world);
typedef struct sinew_step_report {
  size_t struct_size;
  uint32_t substeps;
  float stable_substep;
  uint32_t bodies_restored;
  float error_estimate;
  uint32_t crossings;
  uint32_t limit;
  sinew_body_id limit_body;
  uint32_t limit_nodes[4];
  uint32_t limit_substeps;
  uint32_t work;
  uint32_t work_done;
  float residual;
  double lag;
  sinew_body_id substeps_body;
  sinew_body_id restored_body;
  sinew_body_id crossing_body;
} sinew_step_report;
sinew_status sinew_world_step(sinew_world *world, float dt, sinew_step_report *report);
sinew_status sinew_world_set_gravity(sinew_world *world, const float *gravity);
sinew_status sinew_world_get_gravity(const sinew_world *world, float *out_gravity);
sinew_status sinew_world_set_substeps(sinew_world *world, uint32_t substeps, uint32_t max_substeps);
sinew_status sinew_world_get_substeps(const sinew_world *world, uint32_t *out_substeps,
    uint32_t *out_max_substeps);
sinew_status sinew_world_get_time(const sinew_world *world, double *out_time, uint64_t *out_steps);
sinew_status sinew_world_get_state_hash(const sinew_world *world, uint64_t *out);
typedef struct sinew_mesh sinew_mesh;
typedef enum sinew_mesh_format {
  SINEW_MESH_FORMAT_AUTO = 0,
  SINEW_MESH_FORMAT_OBJ = 1,
  SINEW_MESH_FORMAT_STL = 2,
  SINEW_MESH_FORMAT_VTK = 3,
  SINEW_MESH_FORMAT_GMSH = 4,
  SINEW_MESH_FORMAT_TETGEN = 5
} sinew_mesh_format;
sinew_status sinew_mesh_load(const char *path, uint32_t format, float scale, sinew_mesh **out);
sinew_status sinew_mesh_create_cloth(const float *size, const uint32_t *cells, sinew_mesh **out);
sinew_status sinew_mesh_create_block(const float *size, const uint32_t *cells, sinew_mesh **out);
sinew_status sinew_mesh_create_lattice(float edge, const uint32_t *cells, sinew_mesh **out);
sinew_status sinew_mesh_create_organ(float length, float spacing, sinew_mesh **out);
sinew_status sinew_mesh_create(const float *positions, size_t node_count, const uint32_t *triangles,
    size_t triangle_count, const uint32_t *tetrahedra, size_t tetrahedron_count, sinew_mesh **out);
sinew_status sinew_mesh_create_filled(const sinew_mesh *surface, float spacing, sinew_mesh **out);
void sinew_mesh_destroy(sinew_mesh *mesh);
typedef struct sinew_mesh_view {
  size_t struct_size;
  const float *positions;
  size_t node_count;
  const uint32_t *triangles;
  size_t triangle_count;
  const uint32_t *tetrahedra;
  size_t tetrahedron_count;
  const uint32_t *surface;
  size_t surface_triangle_count;
  const uint32_t *node_of_vertex;
  size_t vertex_count;
  size_t welded_vertices;
  size_t dropped_vertices;
  size_t dropped_triangles;
  size_t dropped_tetrahedra;
  size_t flipped_tetrahedra;
  uint32_t is_closed;
  const uint32_t *cells;
  size_t cell_count;
} sinew_mesh_view;
sinew_status sinew_mesh_get_view(const sinew_mesh *mesh, sinew_mesh_view *out);
typedef enum sinew_storage {
  SINEW_STORAGE_PACKED = 0,
  SINEW_STORAGE_EFFICIENT = 1,
  SINEW_STORAGE_FAST_LINK = 2,
  SINEW_STORAGE_DYNAMIC_BULK = 3
} sinew_storage;
typedef enum sinew_solver {
  SINEW_SOLVER_VERLET = 0,
  SINEW_SOLVER_IMPLICIT = 1,
  SINEW_SOLVER_NEWTON = 2,
  SINEW_SOLVER_AUTO = 3
} sinew_solver;
typedef enum sinew_material {
  SINEW_MATERIAL_NONE = 0,
  SINEW_MATERIAL_SPRINGS = 1,
  SINEW_MATERIAL_TETRAHEDRA = 2
} sinew_material;
typedef enum sinew_spring_law {
  SINEW_SPRING_LAW_LINEAR = 0,
  SINEW_SPRING_LAW_EXPONENTIAL = 1,
  SINEW_SPRING_LAW_CUBIC = 2
} sinew_spring_law;
typedef enum sinew_element_law {
  SINEW_ELEMENT_LAW_ST_VENANT_KIRCHHOFF = 0,
  SINEW_ELEMENT_LAW_NEO_HOOKEAN = 1,
  SINEW_ELEMENT_LAW_MOONEY_RIVLIN = 2
} sinew_element_law;
typedef struct sinew_body_def {
  size_t struct_size;
  const float *positions;
  const float *rest_positions;
  size_t node_count;
  const float *masses;
  const float *node_dampings;
  float node_mass;
  float node_damping;
  const uint32_t *springs;
  size_t spring_count;
  const float *stiffnesses;
  const float *rest_lengths;
  const float *spring_dampings;
  float stiffness;
  float spring_damping;
  const uint32_t *triangles;
  size_t triangle_count;
  const uint32_t *tetrahedra;
  size_t tetrahedron_count;
  uint32_t storage;
  uint32_t springs_per_node;
  uint32_t solver;
  uint32_t reserved;
  uint32_t order;
  uint32_t iterations;
  float accuracy;
  float mass_scaling;
  const uint32_t *cells;
  size_t cell_count;
  uint32_t material;
  float young_modulus;
  float poisson_ratio;
  float density;
  float thickness;
  float volume_stiffness;
  const float *home_stiffnesses;
  float home_stiffness;
  float bending_stiffness;
  uint32_t spring_law;
  float spring_steepness;
  float spring_quadratic;
  float spring_cubic;
  float spring_limit;
  float fibre_stiffness;
  const float *fibre_directions;
  const float *fibre_stiffnesses;
  float retardation_time;
  float relaxation_time;
  float yield_strain;
  float largest_set;
  float strain_limit;
  float limit_stiffening;
  float enclosed_stiffness;
  float pressure;
  float contact_thickness;
  float contact_friction;
  uint32_t meets_bodies;
  uint32_t meets_itself;
  uint32_t contact_detection;
  float contact_resolution;
  uint32_t collision_category;
  uint32_t collision_mask;
  uint32_t spare_nodes;
  float toughness;
  float tear_strain;
  float tear_force;
  uint32_t most_tears;
  float smallest_piece;
  float sleep_speed;
  float sleep_time;
  uint32_t element_law;
  float mooney_ratio;
  float position[3];
  float orientation[4];
  float gravity_scale;
  float damping_rate;
} sinew_body_def;
sinew_status sinew_body_def_init(sinew_body_def *def, size_t struct_size);
sinew_status sinew_body_create(sinew_world *world, const sinew_body_def *def, sinew_body_id *out);
sinew_status sinew_body_destroy(sinew_world *world, sinew_body_id body);
sinew_status sinew_body_get_positions(const sinew_world *world, sinew_body_id body,
    sinew_vec3_view *out);
sinew_status sinew_body_get_velocities(const sinew_world *world, sinew_body_id body,
    sinew_vec3_view *out);
sinew_status sinew_body_set_positions(sinew_world *world, sinew_body_id body,
    const float *positions, size_t node_count);
sinew_status sinew_body_set_velocities(sinew_world *world, sinew_body_id body,
    const float *velocities, size_t node_count);
sinew_status sinew_body_get_triangles(const sinew_world *world, sinew_body_id body,
    sinew_triangle_view *out);
sinew_status sinew_body_is_closed(const sinew_world *world, sinew_body_id body, uint32_t *out);
sinew_status sinew_body_get_node_mass(const sinew_world *world, sinew_body_id body, uint32_t node,
    float *out);
sinew_status sinew_body_apply_force(sinew_world *world, sinew_body_id body, uint32_t node,
    const float *force);
sinew_status sinew_body_apply_forces(sinew_world *world, sinew_body_id body, const uint32_t *nodes,
    const float *forces, size_t count);
sinew_status sinew_body_pin(sinew_world *world, sinew_body_id body, uint32_t node);
sinew_status sinew_body_pin_axes(sinew_world *world, sinew_body_id body, uint32_t node,
    uint32_t axes);
sinew_status sinew_body_unpin(sinew_world *world, sinew_body_id body, uint32_t node);
sinew_status sinew_body_move_pin(sinew_world *world, sinew_body_id body, uint32_t node,
    const float *position);
sinew_status sinew_body_get_pin_force(const sinew_world *world, sinew_body_id body, uint32_t node,
    float *force);
sinew_status sinew_body_set_collision(sinew_world *world, sinew_body_id body, uint32_t category,
    uint32_t mask);
sinew_status sinew_body_get_collision(const sinew_world *world, sinew_body_id body,
    uint32_t *out_category, uint32_t *out_mask);
sinew_status sinew_body_wake(sinew_world *world, sinew_body_id body);
sinew_status sinew_body_get_awake_share(const sinew_world *world, sinew_body_id body, float *out);
typedef enum sinew_shape {
  SINEW_SHAPE_SPHERE = 0,
  SINEW_SHAPE_CAPSULE = 1,
  SINEW_SHAPE_PLANE = 2,
  SINEW_SHAPE_MESH = 3,
  SINEW_SHAPE_BOX = 4
} sinew_shape;
typedef struct sinew_tool_def {
  size_t struct_size;
  uint32_t shape;
  float radius;
  float half_length;
  uint32_t reserved0;
  const float *positions;
  size_t node_count;
  const uint32_t *triangles;
  size_t triangle_count;
  uint32_t detection;
  float friction;
  float position[3];
  float orientation[4];
  uint32_t reserved;
  float resolution;
  float force_limit;
  uint32_t collision_category;
  uint32_t collision_mask;
  float half_extents[3];
} sinew_tool_def;
sinew_status sinew_tool_def_init(sinew_tool_def *def, size_t struct_size);
sinew_status sinew_tool_create(sinew_world *world, const sinew_tool_def *def, sinew_tool_id *out);
sinew_status sinew_tool_destroy(sinew_world *world, sinew_tool_id tool);
sinew_status sinew_tool_set_pose(sinew_world *world, sinew_tool_id tool, const float *position,
    const float *orientation);
sinew_status sinew_tool_get_pose(const sinew_world *world, sinew_tool_id tool, float *out_position,
    float *out_orientation);
sinew_status sinew_tool_set_friction(sinew_world *world, sinew_tool_id tool, float friction);
sinew_status sinew_tool_get_friction(const sinew_world *world, sinew_tool_id tool, float *out);
sinew_status sinew_tool_set_force_limit(sinew_world *world, sinew_tool_id tool, float force_limit);
sinew_status sinew_tool_get_force_limit(const sinew_world *world, sinew_tool_id tool, float *out);
sinew_status sinew_tool_set_collision(sinew_world *world, sinew_tool_id tool, uint32_t category,
    uint32_t mask);
sinew_status sinew_tool_get_collision(const sinew_world *world, sinew_tool_id tool,
    uint32_t *out_category, uint32_t *out_mask);
sinew_status sinew_tool_get_wrench(const sinew_world *world, sinew_tool_id tool, float *force,
    float *torque);
typedef struct sinew_contact {
  sinew_body_id body;
  void *body_user_data;
  uint32_t nodes[3];
  float weights[3];
  float point[3];
  float normal[3];
  float force[3];
} sinew_contact;
sinew_status sinew_tool_get_contacts(const sinew_world *world, sinew_tool_id tool,
    sinew_contact *out_contacts, size_t capacity, size_t *out_count);
typedef struct sinew_material_preset {
  size_t struct_size;
  const char *name;
  const char *source;
  float shear_modulus;
  float young_modulus;
  float density;
} sinew_material_preset;
typedef enum sinew_preset {
  SINEW_PRESET_LIVER = 0,
  SINEW_PRESET_FIBROTIC_LIVER = 1,
  SINEW_PRESET_LIVER_TUMOUR = 2,
  SINEW_PRESET_STOMACH = 3,
  SINEW_PRESET_GALLBLADDER = 4,
  SINEW_PRESET_BILE_DUCT = 5,
  SINEW_PRESET_HEPATIC_ARTERY = 6
} sinew_preset;
sinew_status sinew_material_get_preset(uint32_t preset, sinew_material_preset *out);
sinew_status sinew_body_add_spring(sinew_world *world, sinew_body_id body, uint32_t a, uint32_t b,
    float stiffness, float rest_length);
sinew_status sinew_body_remove_spring(sinew_world *world, sinew_body_id body, uint32_t a,
    uint32_t b);
sinew_status sinew_body_get_spring_pairs(const sinew_world *world, sinew_body_id body,
    uint32_t *out_pairs, size_t count);
sinew_status sinew_body_get_springs(const sinew_world *world, sinew_body_id body,
    const uint32_t *pairs, size_t count, float *out_stiffnesses, float *out_rest_lengths);
sinew_status sinew_body_set_springs(sinew_world *world, sinew_body_id body, const uint32_t *pairs,
    const float *stiffnesses, const float *rest_lengths, size_t count);
sinew_status sinew_body_scale_region(sinew_world *world, sinew_body_id body, const uint32_t *nodes,
    size_t node_count, float stiffness_factor, float length_factor);
sinew_status sinew_body_set_pressure(sinew_world *world, sinew_body_id body, float pressure);
sinew_status sinew_body_get_pressure(const sinew_world *world, sinew_body_id body, float *out);
typedef struct sinew_enclosed_report {
  size_t struct_size;
  size_t cavity_count;
  double volume;
  double rest_volume;
  double pressure;
} sinew_enclosed_report;
sinew_status sinew_body_get_enclosed_report(const sinew_world *world, sinew_body_id body,
    sinew_enclosed_report *out);
typedef struct sinew_equilibrium_def {
  size_t struct_size;
  float tolerance;
  uint32_t iterations;
} sinew_equilibrium_def;
sinew_status sinew_equilibrium_def_init(sinew_equilibrium_def *def, size_t struct_size);
typedef struct sinew_equilibrium_report {
  size_t struct_size;
  uint32_t iterations;
  uint32_t products;
  double residual;
  double error;
  double energy_before;
  double energy_after;
} sinew_equilibrium_report;
sinew_status sinew_body_solve_equilibrium(sinew_world *world, sinew_body_id body,
    const sinew_equilibrium_def *def, sinew_equilibrium_report *out_report);
typedef struct sinew_surface_point {
  size_t struct_size;
  sinew_body_id body;
  uint32_t triangle;
  float weights[3];
  float position[3];
  float normal[3];
  float distance;
} sinew_surface_point;
sinew_status sinew_world_cast_ray(const sinew_world *world, const float *origin,
    const float *direction, float max_distance, sinew_surface_point *out);
sinew_status sinew_world_find_nearest(const sinew_world *world, const float *point,
    float max_distance, sinew_surface_point *out);
typedef enum sinew_image_form {
  SINEW_IMAGE_FORM_INTERVALS = 0,
  SINEW_IMAGE_FORM_COUNTED = 1
} sinew_image_form;
typedef struct sinew_detector_def {
  size_t struct_size;
  sinew_body_id bodies[2];
  uint32_t detection;
  uint32_t form;
  float pixel;
  float direction[3];
  uint32_t pixels;
  uint32_t crossings;
  float thickness[2];
} sinew_detector_def;
sinew_status sinew_detector_def_init(sinew_detector_def *def, size_t struct_size);
typedef struct sinew_detector sinew_detector;
sinew_status sinew_detector_create(const sinew_world *world, const sinew_detector_def *def,
    sinew_detector **out);
void sinew_detector_destroy(sinew_detector *detector);
typedef struct sinew_detector_report {
  size_t struct_size;
  double volume;
  float normal[3];
  float depth;
  float pixel;
  uint32_t point_counts[2];
  uint32_t edge_counts[2];
  uint32_t unlisted[2];
  uint32_t is_closed[2];
} sinew_detector_report;
sinew_status sinew_detector_find(sinew_detector *detector, const sinew_world *world,
    sinew_detector_report *out_report);
typedef struct sinew_point_inside {
  uint32_t node;
  uint32_t triangle;
  float depth;
  float normal[3];
} sinew_point_inside;
sinew_status sinew_detector_get_points(const sinew_detector *detector, uint32_t side,
    const sinew_point_inside **out_points, size_t *out_count);
typedef struct sinew_edge_inside {
  uint32_t nodes[2];
  float entry;
  float exit;
  float depth;
} sinew_edge_inside;
sinew_status sinew_detector_get_edges(const sinew_detector *detector, uint32_t side,
    const sinew_edge_inside **out_edges, size_t *out_count);
sinew_status sinew_detector_get_gradient(const sinew_detector *detector, uint32_t side,
    sinew_dvec3_view *out);
typedef struct sinew_attachment_def {
  size_t struct_size;
  sinew_body_id body;
  sinew_tool_id tool;
  sinew_body_id other;
  size_t count;
  const uint32_t *nodes;
  const uint32_t *triangles;
  const float *weights;
  const uint32_t *other_nodes;
  const uint32_t *other_triangles;
  const float *other_weights;
  float force_limit;
} sinew_attachment_def;
sinew_status sinew_attachment_def_init(sinew_attachment_def *def, size_t struct_size);
sinew_status sinew_attachment_create(sinew_world *world, const sinew_attachment_def *def,
    sinew_attachment_id *out_attachments);
typedef struct sinew_suture_def {
  size_t struct_size;
  float length;
  float stiffness;
  float force_limit;
} sinew_suture_def;
sinew_status sinew_suture_def_init(sinew_suture_def *def, size_t struct_size);
sinew_status sinew_suture_create(sinew_world *world, const sinew_surface_point *point,
    const sinew_surface_point *other_point, const sinew_suture_def *def, sinew_attachment_id *out);
sinew_status sinew_suture_set_length(sinew_world *world, sinew_attachment_id suture, float length);
typedef struct sinew_suture_report {
  size_t struct_size;
  float length;
  float distance;
  double energy;
} sinew_suture_report;
sinew_status sinew_suture_get_report(const sinew_world *world, sinew_attachment_id suture,
    sinew_suture_report *out_report);
sinew_status sinew_attachment_release(sinew_world *world, sinew_attachment_id attachment);
sinew_status sinew_attachment_get_force(const sinew_world *world, sinew_attachment_id attachment,
    float *out_force);
sinew_status sinew_world_get_broken_attachments(const sinew_world *world,
    sinew_attachment_id *out_attachments, size_t capacity, size_t *out_count);
typedef struct sinew_cut_report {
  size_t struct_size;
  uint32_t new_nodes;
  uint32_t new_triangles;
  uint32_t springs_removed;
  uint32_t pieces_parted;
  double length;
  double area;
} sinew_cut_report;
sinew_status sinew_body_cut(sinew_world *world, sinew_body_id body, const float *start,
    const float *end, sinew_cut_report *out_report);
typedef struct sinew_new_node {
  uint32_t node;
  uint32_t sources[3];
  float weights[3];
} sinew_new_node;
typedef struct sinew_rim_edge {
  uint32_t nodes[2];
  uint32_t triangle;
} sinew_rim_edge;
typedef struct sinew_topology_changes {
  size_t struct_size;
  uint64_t version;
  const sinew_new_node *nodes;
  size_t node_count;
  const uint32_t *triangles;
  size_t triangle_count;
  const uint32_t *removed_springs;
  size_t removed_spring_count;
  const sinew_rim_edge *rim;
  size_t rim_count;
} sinew_topology_changes;
sinew_status sinew_body_get_topology_changes(const sinew_world *world, sinew_body_id body,
    uint64_t since_version, sinew_topology_changes *out);
sinew_status sinew_body_get_pieces(const sinew_world *world, sinew_body_id body,
    uint32_t *out_pieces, size_t node_count, uint32_t *out_piece_count);
sinew_status sinew_body_get_max_counts(const sinew_world *world, sinew_body_id body,
    uint32_t *out_max_nodes, uint32_t *out_max_triangles);
typedef struct sinew_blade_def {
  size_t struct_size;
  float edge[6];
  float stiffness;
  uint32_t collision_category;
  uint32_t collision_mask;
  float position[3];
  float orientation[4];
} sinew_blade_def;
sinew_status sinew_blade_def_init(sinew_blade_def *def, size_t struct_size);
sinew_status sinew_blade_create(sinew_world *world, const sinew_blade_def *def,
    sinew_blade_id *out);
sinew_status sinew_blade_destroy(sinew_world *world, sinew_blade_id blade);
sinew_status sinew_blade_set_pose(sinew_world *world, sinew_blade_id blade, const float *position,
    const float *orientation);
sinew_status sinew_blade_get_pose(const sinew_world *world, sinew_blade_id blade,
    float *out_position, float *out_orientation);
sinew_status sinew_blade_set_collision(sinew_world *world, sinew_blade_id blade, uint32_t category,
    uint32_t mask);
sinew_status sinew_blade_get_collision(const sinew_world *world, sinew_blade_id blade,
    uint32_t *out_category, uint32_t *out_mask);
typedef struct sinew_blade_report {
  size_t struct_size;
  float force[3];
  float torque[3];
  double work;
  double length;
  double lag;
  sinew_status status;
  double area;
} sinew_blade_report;
sinew_status sinew_blade_get_report(const sinew_world *world, sinew_blade_id blade,
    sinew_blade_report *out);
sinew_status sinew_body_set_tear_limits(sinew_world *world, sinew_body_id body,
    const uint32_t *pairs, const float *strains, const float *forces, size_t count);
sinew_status sinew_body_get_tear_limits(const sinew_world *world, sinew_body_id body,
    const uint32_t *pairs, size_t count, float *out_strains, float *out_forces);
typedef struct sinew_tear_report {
  size_t struct_size;
  uint32_t tears;
  uint32_t pieces_parted;
  uint32_t waiting;
  uint32_t small_pieces;
  uint32_t no_room;
} sinew_tear_report;
sinew_status sinew_body_get_tear_report(const sinew_world *world, sinew_body_id body,
    sinew_tear_report *out);
typedef struct sinew_haptic_def {
  size_t struct_size;
  sinew_tool_id tool;
  float stiffness;
  float angular_stiffness;
  float damping_ratio;
  float device_mass;
  float force_limit;
  float torque_limit;
  float force_rate_limit;
  float torque_rate_limit;
  float stale_after;
  float ramp;
} sinew_haptic_def;
sinew_status sinew_haptic_def_init(sinew_haptic_def *def, size_t struct_size);
typedef struct sinew_haptic sinew_haptic;
sinew_status sinew_haptic_create(sinew_world *world, const sinew_haptic_def *def,
    sinew_haptic **out);
void sinew_haptic_destroy(sinew_haptic *haptic);
typedef struct sinew_haptic_report {
  size_t struct_size;
  float force[3];
  float torque[3];
  float proxy_position[3];
  float proxy_orientation[4];
  uint32_t contact_count;
  float age;
  uint64_t version;
  float gain;
  uint32_t is_over;
  double lost;
} sinew_haptic_report;
sinew_status sinew_haptic_tick(sinew_haptic *haptic, const float *position,
    const float *orientation, const float *velocity, const float *angular_velocity, float dt,
    sinew_haptic_report *out);
typedef struct sinew_haptic_contact {
  sinew_body_id body;
  float point[3];
  float normal[3];
  float velocity[3];
  float force[3];
} sinew_haptic_contact;
sinew_status sinew_haptic_get_contacts(const sinew_haptic *haptic,
    sinew_haptic_contact *out_contacts, size_t capacity, size_t *out_count);
typedef struct sinew_mass_properties {
  size_t struct_size;
  float mass;
  float center_of_mass[3];
  float inertia[6];
} sinew_mass_properties;
sinew_status sinew_tool_get_mass_of_density(const sinew_world *world, sinew_tool_id tool,
    float density, sinew_mass_properties *out);
sinew_status sinew_tool_set_mass(sinew_world *world, sinew_tool_id tool,
    const sinew_mass_properties *mass);
sinew_status sinew_tool_get_mass(const sinew_world *world, sinew_tool_id tool,
    sinew_mass_properties *out);
sinew_status sinew_tool_set_velocity(sinew_world *world, sinew_tool_id tool, const float *velocity,
    const float *angular_velocity);
sinew_status sinew_tool_get_velocity(const sinew_world *world, sinew_tool_id tool,
    float *out_velocity, float *out_angular_velocity);
sinew_status sinew_tool_apply_wrench(sinew_world *world, sinew_tool_id tool, const float *force,
    const float *torque);
sinew_status sinew_tool_teleport(sinew_world *world, sinew_tool_id tool, const float *position,
    const float *orientation);
typedef struct sinew_embedding_def {
  size_t struct_size;
  const float *vertices;
  size_t vertex_count;
  const uint32_t *triangles;
  size_t triangle_count;
  const uint32_t *tetrahedra;
  size_t tetrahedron_count;
} sinew_embedding_def;
sinew_status sinew_embedding_def_init(sinew_embedding_def *def, size_t struct_size);
typedef struct sinew_embedding sinew_embedding;
sinew_status sinew_embedding_create(const sinew_world *world, sinew_body_id body,
    const sinew_embedding_def *def, sinew_embedding **out);
void sinew_embedding_destroy(sinew_embedding *embedding);
sinew_status sinew_embedding_update(sinew_embedding *embedding, const sinew_world *world);
sinew_status sinew_embedding_update_from(sinew_embedding *embedding, const float *positions,
    size_t node_count);
sinew_status sinew_embedding_get_positions(const sinew_embedding *embedding, sinew_vec3_view *out);
sinew_status sinew_embedding_get_triangles(const sinew_embedding *embedding,
    sinew_triangle_view *out);
sinew_status sinew_embedding_get_normals(sinew_embedding *embedding, sinew_vec3_view *out);
sinew_status sinew_body_create_from_surface(sinew_world *world, const sinew_body_def *def,
    float spacing, sinew_body_id *out_body, sinew_embedding **out_embedding);
typedef struct sinew_reader sinew_reader;
sinew_status sinew_reader_create(sinew_world *world, sinew_body_id body, sinew_reader **out);
void sinew_reader_destroy(sinew_reader *reader);
typedef struct sinew_frame {
  size_t struct_size;
  sinew_vec3_view positions;
  sinew_triangle_view triangles;
  uint64_t version;
  uint64_t topology_version;
  uint64_t step;
  double time;
  uint32_t is_new;
  uint32_t is_over;
} sinew_frame;
sinew_status sinew_reader_read(sinew_reader *reader, sinew_frame *out);
sinew_status sinew_body_def_set_mesh(sinew_body_def *def, const sinew_mesh *mesh);
sinew_status sinew_body_transform(sinew_world *world, sinew_body_id body, const float *translation,
    const float *rotation, const float *pivot);
sinew_status sinew_body_get_bounds(const sinew_world *world, sinew_body_id body, float *out_min,
    float *out_max);
sinew_status sinew_body_get_normals(const sinew_world *world, sinew_body_id body,
    float *out_normals, size_t node_count);
sinew_status sinew_body_get_masses(const sinew_world *world, sinew_body_id body, float *out_masses,
    size_t node_count);
sinew_status sinew_body_apply_impulses(sinew_world *world, sinew_body_id body,
    const uint32_t *nodes, const float *impulses, size_t count);
sinew_status sinew_body_set_gravity_scale(sinew_world *world, sinew_body_id body, float scale);
sinew_status sinew_body_get_gravity_scale(const sinew_world *world, sinew_body_id body, float *out);
sinew_status sinew_body_set_acceleration(sinew_world *world, sinew_body_id body,
    const float *acceleration);
sinew_status sinew_body_get_acceleration(const sinew_world *world, sinew_body_id body, float *out);
sinew_status sinew_body_pin_nodes(sinew_world *world, sinew_body_id body, const uint32_t *nodes,
    size_t count);
sinew_status sinew_body_unpin_nodes(sinew_world *world, sinew_body_id body, const uint32_t *nodes,
    size_t count);
sinew_status sinew_body_pin_box(sinew_world *world, sinew_body_id body, const float *min,
    const float *max, size_t *out_count);
sinew_status sinew_body_unpin_box(sinew_world *world, sinew_body_id body, const float *min,
    const float *max, size_t *out_count);
sinew_status sinew_body_get_pin_forces(const sinew_world *world, sinew_body_id body,
    float *out_forces, size_t node_count);
sinew_status sinew_tool_get_target(const sinew_world *world, sinew_tool_id tool,
    float *out_position, float *out_orientation);
sinew_status sinew_world_get_total_wrench(const sinew_world *world, const sinew_tool_id *tools,
    size_t count, const float *point, float *out_force, float *out_torque);
sinew_status sinew_body_get_contacts(const sinew_world *world, sinew_body_id body,
    sinew_contact *out_contacts, size_t capacity, size_t *out_count);
sinew_status sinew_blade_get_contacts(const sinew_world *world, sinew_blade_id blade,
    sinew_contact *out_contacts, size_t capacity, size_t *out_count);
typedef struct sinew_contact_change {
  sinew_tool_id tool;
  sinew_body_id body;
  void *tool_user_data;
  void *body_user_data;
  uint32_t has_begun;
} sinew_contact_change;
sinew_status sinew_world_get_contact_changes(const sinew_world *world,
    sinew_contact_change *out_changes, size_t capacity, size_t *out_count);
typedef struct sinew_body_contact_change {
  sinew_body_id body;
  sinew_body_id other;
  sinew_blade_id blade;
  void *body_user_data;
  void *other_user_data;
  uint32_t has_begun;
} sinew_body_contact_change;
sinew_status sinew_world_get_body_contact_changes(const sinew_world *world,
    sinew_body_contact_change *out_changes, size_t capacity, size_t *out_count);
typedef struct sinew_ray_hit {
  size_t struct_size;
  sinew_body_id body;
  sinew_tool_id tool;
  uint32_t triangle;
  float weights[3];
  float position[3];
  float normal[3];
  float distance;
} sinew_ray_hit;
sinew_status sinew_world_cast_ray_filtered(const sinew_world *world, const float *origin,
    const float *direction, float max_distance, uint32_t category, uint32_t mask,
    sinew_ray_hit *out);
typedef struct sinew_body_settings {
  size_t struct_size;
  float contact_thickness;
  float contact_friction;
  uint32_t meets_bodies;
  uint32_t meets_itself;
  float sleep_speed;
  float sleep_time;
} sinew_body_settings;
sinew_status sinew_body_set_settings(sinew_world *world, sinew_body_id body,
    const sinew_body_settings *settings);
sinew_status sinew_body_get_settings(const sinew_world *world, sinew_body_id body,
    sinew_body_settings *out);
sinew_status sinew_body_set_node_damping(sinew_world *world, sinew_body_id body,
    float node_damping);
sinew_status sinew_body_get_node_damping(const sinew_world *world, sinew_body_id body,
    uint32_t node, float *out);
sinew_status sinew_world_step_with_budget(sinew_world *world, float dt, uint32_t work,
    sinew_step_report *report);
sinew_status sinew_world_step_within(sinew_world *world, float dt, double seconds,
    sinew_step_report *report);
sinew_status sinew_world_drop_lag(sinew_world *world);
sinew_status sinew_tool_get_force_error(const sinew_world *world, sinew_tool_id tool, float *out);
uint32_t sinew_body_is_valid(const sinew_world *world, sinew_body_id body);
uint32_t sinew_tool_is_valid(const sinew_world *world, sinew_tool_id tool);
uint32_t sinew_blade_is_valid(const sinew_world *world, sinew_blade_id blade);
uint32_t sinew_attachment_is_valid(const sinew_world *world, sinew_attachment_id attachment);
sinew_status sinew_world_set_user_data(sinew_world *world, void *user_data);
sinew_status sinew_world_get_user_data(const sinew_world *world, void **out);
sinew_status sinew_body_set_user_data(sinew_world *world, sinew_body_id body, void *user_data);
sinew_status sinew_body_get_user_data(const sinew_world *world, sinew_body_id body, void **out);
sinew_status sinew_tool_set_user_data(sinew_world *world, sinew_tool_id tool, void *user_data);
sinew_status sinew_tool_get_user_data(const sinew_world *world, sinew_tool_id tool, void **out);
sinew_status sinew_world_get_snapshot_size(const sinew_world *world, size_t *out);
sinew_status sinew_world_save_snapshot(const sinew_world *world, uint8_t *out_bytes, size_t size);
sinew_status sinew_world_load_snapshot(const uint8_t *bytes, size_t size,
    const sinew_world_def *def, sinew_world **out);
typedef struct sinew_energy {
  size_t struct_size;
  double kinetic;
  double elastic;
  double gravitational;
} sinew_energy;
sinew_status sinew_body_get_energy(const sinew_world *world, sinew_body_id body, sinew_energy *out);
typedef struct sinew_solver_report {
  size_t struct_size;
  uint32_t iterations;
  float error;
  double added_mass;
  uint32_t solves;
  uint32_t has_converged;
  uint32_t solver;
  uint32_t auto_substeps;
  float auto_step;
} sinew_solver_report;
sinew_status sinew_body_get_solver_report(const sinew_world *world, sinew_body_id body,
    sinew_solver_report *out);
typedef enum sinew_limit {
  SINEW_LIMIT_NONE = 0,
  SINEW_LIMIT_SPRING = 1,
  SINEW_LIMIT_ELEMENT = 2,
  SINEW_LIMIT_TERM = 3,
  SINEW_LIMIT_CAVITY = 4,
  SINEW_LIMIT_PARTS = 5,
  SINEW_LIMIT_TOLERANCE = 6
} sinew_limit;
typedef struct sinew_storage_report {
  size_t struct_size;
  size_t node_count;
  size_t spring_count;
  size_t bytes_used;
  size_t bytes_reserved;
} sinew_storage_report;
sinew_status sinew_body_get_storage_report(const sinew_world *world, sinew_body_id body,
    sinew_storage_report *out);
sinew_status sinew_body_get_spring_strains(const sinew_world *world, sinew_body_id body,
    const uint32_t *pairs, const float *rest_lengths, size_t count, float *out_strains);
typedef struct sinew_strain {
  float largest;
  float smallest;
  float growth;
} sinew_strain;
sinew_status sinew_body_get_triangle_strains(const sinew_world *world, sinew_body_id body,
    const float *rest_positions, size_t node_count, const uint32_t *triangles,
    size_t triangle_count, sinew_strain *out_strains);
sinew_status sinew_body_get_tetrahedron_strains(const sinew_world *world, sinew_body_id body,
    const float *rest_positions, size_t node_count, const uint32_t *tetrahedra,
    size_t tetrahedron_count, sinew_strain *out_strains);
sinew_status sinew_util_average_to_nodes(const uint32_t *elements, uint32_t corners,
    const float *values, size_t element_count, float *out_means, size_t node_count);
typedef struct sinew_picture_def {
  size_t struct_size;
  uint32_t width;
  uint32_t height;
  float eye[3];
  float target[3];
  float up[3];
  float direction[3];
  float field_of_view;
  uint32_t show_contacts;
} sinew_picture_def;
sinew_status sinew_picture_def_init(sinew_picture_def *def, size_t struct_size);
sinew_status sinew_world_save_picture(const sinew_world *world, const sinew_picture_def *def,
    const char *path);
typedef enum sinew_colours {
  SINEW_COLOURS_DIVERGING = 0,
  SINEW_COLOURS_SEQUENTIAL = 1
} sinew_colours;
typedef struct sinew_body_values {
  sinew_body_id body;
  const float *values;
  size_t node_count;
  float low;
  float high;
  uint32_t colours;
} sinew_body_values;
sinew_status sinew_world_save_picture_of_values(const sinew_world *world,
    const sinew_picture_def *def, const sinew_body_values *coloured, size_t count,
    const char *path);
sinew_status sinew_world_set_profiling(sinew_world *world, uint32_t enabled);
sinew_status sinew_world_get_profiling(const sinew_world *world, uint32_t *out);
typedef struct sinew_profile {
  size_t struct_size;
  double step;
  double plan;
  double forces;
  double solver;
  double broad_phase;
  double narrow_phase;
  double contact_solver;
  double publish;
  double cutting;
  uint64_t bodies;
  uint64_t sleeping_bodies;
  uint64_t tries;
  uint64_t substeps;
  uint64_t iterations;
  uint64_t candidates;
  uint64_t tool_contacts;
  uint64_t tissue_contacts;
} sinew_profile;
sinew_status sinew_world_get_profile(const sinew_world *world, sinew_profile *out);
typedef void (*sinew_draw)(void *context, const float *points, uint32_t rgba);
typedef enum sinew_draw_flags {
  SINEW_DRAW_CONTACTS = 1,
  SINEW_DRAW_NORMALS = 2,
  SINEW_DRAW_PINS = 4,
  SINEW_DRAW_ATTACHMENTS = 8,
  SINEW_DRAW_SPRINGS = 16,
  SINEW_DRAW_SLEEPING = 32,
  SINEW_DRAW_BOUNDS = 64
} sinew_draw_flags;
typedef struct sinew_debug_draw {
  size_t struct_size;
  uint32_t flags;
  float normal_length;
  float force_scale;
  float full_strain;
  void *context;
  sinew_draw draw_line;
  sinew_draw draw_point;
  sinew_draw draw_triangle;
} sinew_debug_draw;
sinew_status sinew_debug_draw_init(sinew_debug_draw *def, size_t struct_size);
sinew_status sinew_world_debug_draw(const sinew_world *world, const sinew_debug_draw *def);
sinew_status sinew_world_start_recording(sinew_world *world, const char *path);
sinew_status sinew_world_stop_recording(sinew_world *world, uint64_t *out_steps);
typedef struct sinew_replay_report {
  size_t struct_size;
  uint64_t steps;
  uint64_t first_difference;
  uint64_t recorded_hash;
  uint64_t replayed_hash;
  uint32_t is_cut_short;
} sinew_replay_report;
sinew_status sinew_replay(const char *path, uint32_t thread_count, sinew_replay_report *out);
typedef void (*sinew_log)(void *context, uint32_t level, const char *message);
typedef enum sinew_log_level {
  SINEW_LOG_OFF = 0,
  SINEW_LOG_FAULT = 1,
  SINEW_LOG_ERROR = 2,
  SINEW_LOG_WARNING = 3
} sinew_log_level;
sinew_status sinew_set_log_callback(uint32_t level, sinew_log callback, void *context);
sinew_status sinew_get_log_callback(uint32_t *out_level, sinew_log *out_callback,
    void **out_context);
typedef void *(*sinew_alloc)(void *context, size_t size, size_t alignment);
typedef void (*sinew_dealloc)(void *context, void *memory, size_t size, size_t alignment);
sinew_status sinew_set_allocator(sinew_alloc alloc, sinew_dealloc dealloc, void *context);
sinew_status sinew_get_allocator(sinew_alloc *out_alloc, sinew_dealloc *out_dealloc,
    void **out_context);
