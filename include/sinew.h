/* sinew: soft tissue for programs that already have a loop.
 *
 * Units are SI: metres, kilograms, seconds, newtons, joules, radians. A vector is three packed
 * floats, x y z; a quaternion x y z w. Nodes are numbered and ordered as the caller gave them.
 *
 * Every function that can fail returns a sinew_status, writes its outputs only on SINEW_STATUS_OK
 * and, failed, changes nothing; sinew_last_error says in words what was wrong. What is refused
 * everywhere: NULL where it is not allowed, NaN and infinity, an index out of range, an unknown
 * constant, a negative mass or stiffness, a reserved field that is not zero, a struct_size that no
 * header of this or an earlier version gave the struct.
 *
 * const sinew_world *: any number of threads at once. sinew_world *: one thread, nobody else inside
 * that world. Two worlds share nothing. Handles made for the purpose (a reader) are the exception:
 * each is used by one thread, whatever another does to its world.
 *
 * A definition is filled by its init function, then changed, and read during the call only. What
 * the caller creates, the caller destroys; bodies and tools end with their world. A view is borrowed
 * and says how long it lives. Set struct_size to sizeof of the struct as this header declares it.
 *
 * Made by cbindgen from src/capi; do not edit. */

#ifndef SINEW_H
#define SINEW_H

#include <stddef.h>
#include <stdint.h>

/**
 * The first number of the version that this header is of.
 */
#define SINEW_VERSION_MAJOR 0

/**
 * The second.
 */
#define SINEW_VERSION_MINOR 1

/**
 * The third.
 */
#define SINEW_VERSION_PATCH 0

/**
 * All three: major << 16 | minor << 8 | patch.
 */
#define SINEW_VERSION (((SINEW_VERSION_MAJOR << 16) | (SINEW_VERSION_MINOR << 8)) | SINEW_VERSION_PATCH)

/**
 * uint32_t: the instructions that springs and nodes are worked on with. The widest that the processor offers.
 */
#define SINEW_KERNEL_BEST 0

/**
 * The same bits on every processor.
 */
#define SINEW_KERNEL_PORTABLE 1

/**
 * x86-64: AVX2 and FMA.
 */
#define SINEW_KERNEL_AVX2 2

/**
 * x86-64: AVX-512 F, BW, DQ and VL.
 */
#define SINEW_KERNEL_AVX512 3

/**
 * AArch64.
 */
#define SINEW_KERNEL_NEON 4

/**
 * The default: laid out for the processor.
 */
#define SINEW_STORAGE_PACKED 0

/**
 * A linked list per node, every link allocated on its own.
 */
#define SINEW_STORAGE_EFFICIENT 1

/**
 * One array, springs_per_node places per node.
 */
#define SINEW_STORAGE_FAST_LINK 2

/**
 * Per node, a chain of arrays of springs_per_node places.
 */
#define SINEW_STORAGE_DYNAMIC_BULK 3

/**
 * Explicit, as many substeps as it needs to be stable.
 */
#define SINEW_SOLVER_VERLET 0

/**
 * Stable at any step.
 */
#define SINEW_SOLVER_IMPLICIT 1

/**
 * The accurate reference: the equations of IMPLICIT, solved to the last digits that count; slow.
 */
#define SINEW_SOLVER_NEWTON 2

/**
 * Springs as they are given, or all of one stiffness.
 */
#define SINEW_MATERIAL_NONE 0

/**
 * Springs along the edges of the elements, as stiff as young_modulus asks for. Poisson's ratio is what they imply: 1/4 for
 * tetrahedra and cells, 1/3 in the plane for triangles.
 */
#define SINEW_MATERIAL_SPRINGS 1

/**
 * Tetrahedra as finite elements, St Venant and Kirchhoff's law with a signed volume term: of any Poisson's ratio from 0 to 0.49, right
 * up to compressions of some 20 % and stable beyond. There are no springs but those that are given. sinew_body_remove_spring takes
 * away the tetrahedra that have the edge, whether or not there is a spring along it.
 */
#define SINEW_MATERIAL_TETRAHEDRA 2

/**
 * The pull of a spring is stiffness times rest length times its strain e, the part by which it is longer than at rest.
 */
#define SINEW_SPRING_LAW_LINEAR 0

/**
 * Shaped like a J: instead of e, (exp(spring_steepness e) - 1) / spring_steepness for strains from 0 to spring_limit; linear beyond, as
 * stiff as there.
 */
#define SINEW_SPRING_LAW_EXPONENTIAL 1

/**
 * Instead of e, e + spring_quadratic e^2 + spring_cubic e^3 up to a strain of spring_limit; linear beyond, as stiff as there.
 */
#define SINEW_SPRING_LAW_CUBIC 2

/**
 * The axis x among those that a node is held along.
 */
#define SINEW_AXIS_X 1

/**
 * The axis y.
 */
#define SINEW_AXIS_Y 2

/**
 * The axis z.
 */
#define SINEW_AXIS_Z 4

/**
 * Healthy liver, E 5.4 kPa.
 */
#define SINEW_PRESET_LIVER 0

/**
 * Diseased liver, E 59.4 kPa.
 */
#define SINEW_PRESET_FIBROTIC_LIVER 1

/**
 * Hepatocellular carcinoma, E 70.2 kPa.
 */
#define SINEW_PRESET_LIVER_TUMOUR 2

/**
 * Stomach, E 1.9 kPa.
 */
#define SINEW_PRESET_STOMACH 3

/**
 * Gallbladder, E 255 kPa.
 */
#define SINEW_PRESET_GALLBLADDER 4

/**
 * Bile duct, E 498 kPa.
 */
#define SINEW_PRESET_BILE_DUCT 5

/**
 * Hepatic artery, E 630 kPa.
 */
#define SINEW_PRESET_HEPATIC_ARTERY 6

/**
 * A ball about the origin.
 */
#define SINEW_SHAPE_SPHERE 0

/**
 * A cylinder along y about the origin, with round caps.
 */
#define SINEW_SHAPE_CAPSULE 1

/**
 * The plane y = 0 with free space above.
 */
#define SINEW_SHAPE_PLANE 2

/**
 * A closed mesh.
 */
#define SINEW_SHAPE_MESH 3

/**
 * Exact distances, swept over the step.
 */
#define SINEW_DETECTION_EXACT 0

/**
 * Virtual rays cast through a depth buffer.
 */
#define SINEW_DETECTION_IMAGE_SPACE 1

/**
 * A sampled signed distance; for meshes alone.
 */
#define SINEW_DETECTION_DISTANCE_FIELD 2

/**
 * By the file's name: .obj .stl .vtk .msh .node .ele.
 */
#define SINEW_MESH_FORMAT_AUTO 0

/**
 * Wavefront OBJ.
 */
#define SINEW_MESH_FORMAT_OBJ 1

/**
 * STL, binary or ASCII.
 */
#define SINEW_MESH_FORMAT_STL 2

/**
 * VTK legacy: unstructured grids and polygonal data, ASCII or binary.
 */
#define SINEW_MESH_FORMAT_VTK 3

/**
 * Gmsh, versions 1, 2 and 4.1, ASCII.
 */
#define SINEW_MESH_FORMAT_GMSH 4

/**
 * TetGen: .node and .ele side by side, whichever is named.
 */
#define SINEW_MESH_FORMAT_TETGEN 5

/**
 * In node_of_vertex: the vertex was dropped.
 */
#define SINEW_NO_NODE UINT32_MAX

/**
 * From blue by a light grey, in the middle, to red: for values with a sign.
 */
#define SINEW_COLOURS_DIVERGING 0

/**
 * From a dark violet by green to a light yellow.
 */
#define SINEW_COLOURS_SEQUENTIAL 1

/**
 * By the intervals in which the ray of each pixel is inside a body: no edge is lost, and no point that is deeper than 0.71 pixels.
 */
#define SINEW_IMAGE_FORM_INTERVALS 0

/**
 * As its authors describe it (CInDeR; Halic et al., section 2.1): edges are drawn into a depth buffer, faces in front of them counted.
 * Of edges that share a pixel only the nearest is seen, edges shorter than a pixel or along the view are not drawn; no points, no
 * volume. For comparison.
 */
#define SINEW_IMAGE_FORM_COUNTED 1

/**
 * In `triangle`: none is named.
 */
#define SINEW_NO_TRIANGLE UINT32_MAX

/**
 * Finds what two bodies have in common, in memory of its own. It belongs to the caller; it changes no world, and may outlive it.
 *
 * As `const sinew_detector *` it may be used by any number of threads at once; as `sinew_detector *` by one, with nobody else inside.
 */
typedef struct sinew_detector sinew_detector;

/**
 * A fine surface, drawn, bound to a coarse body, simulated. It belongs to the caller, who uses it on one thread at a time; the body knows nothing of it
 * and pays nothing.
 */
typedef struct sinew_embedding sinew_embedding;

/**
 * The device's side of a tool of a world, for one thread, the device's own: it may tick while another thread steps the world, or uses it otherwise.
 */
typedef struct sinew_haptic sinew_haptic;

/**
 * A mesh: positions, triangles, tetrahedra and cells. It belongs to the caller, never changes, and may be read by any number of
 * threads at once.
 */
typedef struct sinew_mesh sinew_mesh;

/**
 * A reader of a body: the latest complete positions for one thread, without a lock, while another thread steps the world.
 *
 * It is the exception to the rule of threads: made by who has the world, it is then used by one thread at a time, any, whatever others do to the
 * world meanwhile, until its end; it outlives body and world. A thread more needs a reader more.
 */
typedef struct sinew_reader sinew_reader;

/**
 * A world: bodies and tools that are stepped together.
 *
 * As `const sinew_world *` it may be used by any number of threads at once; as `sinew_world *` by one, with nobody else
 * inside.
 */
typedef struct sinew_world sinew_world;

/**
 * The answer of every function that can fail: one of the `SINEW_STATUS_...`.
 */
typedef int32_t sinew_status;

/**
 * A part of a step, to be called once for every index that sinew_run_tasks was told, with the task_data it was given.
 */
typedef void (*sinew_task)(void *task_data, uint32_t index);

/**
 * Runs a step's tasks on the threads of a job system: calls task(task_data, index) once for every index from 0 to
 * count - 1, on any threads, in any order, even one after another, and returns when all of these calls have. Calling it
 * later than that is an error that is not found out.
 *
 * Calls that overlap share the work; each lasts until the step is taken, so that no more tasks should run at once than
 * there are cores free for them. The first to begin takes the step, wherever it runs; with none, the step is taken by
 * the caller's thread. Runs within sinew_world_step, and must not use the world.
 */
typedef void (*sinew_run_tasks)(void *context, sinew_task task, void *task_data, uint32_t count);

/**
 * How a world steps. Filled by sinew_world_def_init.
 */
typedef struct sinew_world_def {
  /**
   * Set by sinew_world_def_init.
   */
  size_t struct_size;
  /**
   * m/s^2; default 0 -9.81 0.
   */
  float gravity[3];
  /**
   * 1, the default: the caller's thread alone; 0: one per core; at most 256. Results are the same for every number. A
   * world's threads end with it, and sleep while it is not stepped or too small to share.
   */
  uint32_t thread_count;
  /**
   * 0, the default: as many as stability needs; n: exactly n per step, but for bodies of IMPLICIT and NEWTON near a tool,
   * whose substeps are of 1 ms at most there, or attached to a body, of 0.25 ms, and where a substep of theirs gains energy: then
   * they are cut again, to 4096 in all.
   */
  uint32_t substeps;
  /**
   * Default 1000; at least 1; a step that needs more is SINEW_STATUS_UNSTABLE. What IMPLICIT and NEWTON cut, as above, may be 4096
   * parts whatever this is; one that would take more of them, 4 s near a tool or 1 s attached to a body, is
   * SINEW_STATUS_UNSTABLE too.
   */
  uint32_t max_substeps;
  /**
   * m; 0, the default: off, as it is with fixed substeps; above 0, with substeps 0: a step's own position error stays below it.
   */
  float tolerance;
  /**
   * 0.
   */
  uint32_t reserved;
  /**
   * Nullable, the default: the world has threads of its own. Else these are used instead, thread_count tasks a step, 1:
   * never called; it is called by steps that are worth sharing, as long as the world lives.
   */
  sinew_run_tasks run_tasks;
  /**
   * What run_tasks is given; nullable.
   */
  void *tasks_context;
  /**
   * SINEW_KERNEL_...; default SINEW_KERNEL_BEST.
   */
  uint32_t kernel;
  /**
   * 0.
   */
  uint32_t reserved2;
} sinew_world_def;

/**
 * What a step did; filled on SINEW_STATUS_OK and SINEW_STATUS_UNSTABLE.
 */
typedef struct sinew_step_report {
  /**
   * Set by the caller.
   */
  size_t struct_size;
  /**
   * The most that any body took.
   */
  uint32_t substeps;
  /**
   * s: the longest explicit substep that is stable now, over all bodies; infinity: no limit, as for bodies of IMPLICIT and
   * NEWTON.
   */
  float stable_substep;
  /**
   * Bodies that would have become non-finite: put back as they were, the others stepped.
   */
  uint32_t bodies_restored;
  /**
   * m: how far a position of this step may be off; 0 where tolerance is off, infinity where the step is refused before there is
   * anything to compare.
   */
  float error_estimate;
  /**
   * Edges of surfaces that pass through other tissue, or through their own body's where it meets itself: what contact could not keep
   * apart. Those of another body in one that is closed come out again by themselves.
   */
  uint32_t crossings;
  /**
   * 0.
   */
  uint32_t reserved;
} sinew_step_report;

/**
 * What a body is made of. Filled by sinew_body_def_init; used only during sinew_body_create.
 */
typedef struct sinew_body_def {
  /**
   * Set by sinew_body_def_init.
   */
  size_t struct_size;
  /**
   * 3 node_count floats, m.
   */
  const float *positions;
  /**
   * Nullable: positions.
   */
  const float *rest_positions;
  /**
   * At least 1.
   */
  size_t node_count;
  /**
   * node_count floats, kg, at least 1e-37, or 0: pinned for good; nullable: node_mass for all. With IMPLICIT a body whose masses
   * over the square of a step's length are no finite floats is put back.
   */
  const float *masses;
  /**
   * node_count floats, N s/m: the gamma_i of m a = ... - gamma_i v; nullable: node_damping.
   */
  const float *node_dampings;
  /**
   * kg, at least 1e-37; no default. 0 where density gives each node its mass.
   */
  float node_mass;
  /**
   * N s/m; default 0.
   */
  float node_damping;
  /**
   * 2 spring_count node indices, each pair once; NULL: the edges of triangles, tetrahedra and cells, each once (then no
   * per-spring arrays); not NULL with spring_count 0: no springs.
   */
  const uint32_t *springs;
  /**
   * Springs given.
   */
  size_t spring_count;
  /**
   * spring_count floats, N/m; nullable: stiffness for all.
   */
  const float *stiffnesses;
  /**
   * spring_count floats, m; nullable: from the rest positions.
   */
  const float *rest_lengths;
  /**
   * spring_count floats, N s/m along the spring; nullable: spring_damping.
   */
  const float *spring_dampings;
  /**
   * N/m; default 0; 0 with SINEW_MATERIAL_TETRAHEDRA where no springs are given.
   */
  float stiffness;
  /**
   * N s/m; default 0; 0 with SINEW_MATERIAL_TETRAHEDRA where no springs are given.
   */
  float spring_damping;
  /**
   * 3 triangle_count node indices, outward by the right-hand rule; nullable: the boundary of the tetrahedra or cells is what
   * is drawn and touched.
   */
  const uint32_t *triangles;
  /**
   * Triangles given.
   */
  size_t triangle_count;
  /**
   * 4 tetrahedron_count node indices; nullable.
   */
  const uint32_t *tetrahedra;
  /**
   * Tetrahedra given.
   */
  size_t tetrahedron_count;
  /**
   * SINEW_STORAGE_...
   */
  uint32_t storage;
  /**
   * FAST_LINK: places of each node, SINEW_STATUS_CAPACITY where a node has more springs; DYNAMIC_BULK: places of each
   * array. 0, the default: chosen from the springs given, as many as the node with the most has, or what takes the
   * least memory. Other storages do not use it.
   */
  uint32_t springs_per_node;
  /**
   * SINEW_SOLVER_...
   */
  uint32_t solver;
  /**
   * 0.
   */
  uint32_t reserved;
  /**
   * IMPLICIT, NEWTON: 1, implicit Euler; 2, the second backward difference formula, which follows motion far better; 0, the
   * default: 2.
   */
  uint32_t order;
  /**
   * IMPLICIT, NEWTON: how often the equation of a step may be multiplied out while it is solved. IMPLICIT: each takes about as
   * long as a substep of VERLET; 0, the default: 1000. NEWTON: far longer; 0, the default: 100 000.
   * Where a tool or a tolerance cuts the step, a thirty-second of it for each part at least. At most 1 000 000.
   */
  uint32_t iterations;
  /**
   * IMPLICIT, NEWTON: what may be missing of the solution of a step's equation, as a part of what forces change in the step;
   * from 1e-6 to 1; 0, the default: 0.01, or 1e-6 with NEWTON.
   */
  float accuracy;
  /**
   * 0.
   */
  uint32_t reserved1;
  /**
   * VERLET: what part of the body's mass may be added, in all, to the nodes whose springs or elements would make substeps short,
   * as those of slivers are; from 0 to 1; 0: none; default 0.001. Mass is added where that saves a quarter of the substeps or
   * more, and no more than they need; never where the world's substeps are fixed or a tolerance is asked for. It is
   * inertia alone: weight, and the force on a pin, stay as they are. See sinew_solver_report.
   */
  float mass_scaling;
  /**
   * 0.
   */
  uint32_t reserved2;
  /**
   * 8 cell_count node indices: cubes of a lattice, corners numbered by bits, x 1, y 2, z 4; nullable. Their springs are their
   * edges and the diagonals of their faces.
   */
  const uint32_t *cells;
  /**
   * Cells given.
   */
  size_t cell_count;
  /**
   * SINEW_MATERIAL_...; NONE, the default: the four below are 0. Else it fills the tetrahedra or the cells, or where there are
   * none the triangles, as they are at rest, and gives each spring its stiffness: springs is NULL and stiffness 0 then, and
   * triangles beside tetrahedra or cells have no edges but theirs. Cells must be cubes of one size, within 0.001 and the
   * rounding of their corners' coordinates.
   */
  uint32_t material;
  /**
   * Young's modulus at small strains, Pa, above 0. Exact for cells and equilateral triangles; an irregular mesh is some 4 to 8 %
   * softer, one that is one or two tetrahedra thick far more.
   */
  float young_modulus;
  /**
   * SINEW_MATERIAL_SPRINGS: 0, the default, or what it implies within 0.001; SINEW_MATERIAL_TETRAHEDRA: from 0 to 0.49.
   */
  float poisson_ratio;
  /**
   * kg/m3, above 0: each node has its share of the mass of the elements about it (masses is NULL and node_mass 0 then, and
   * every node belongs to an element); 0, the default: masses or node_mass.
   */
  float density;
  /**
   * m: above 0 where the material fills triangles, else 0.
   */
  float thickness;
  /**
   * Pa: how tetrahedra resist a change of their volume, each by itself, and turn back where they are inside out; at least 0; 0, the
   * default: they do not. With 0.3 to 0.6 of Young's modulus a body of springs comes back to rest from anywhere. 0 with SINEW_MATERIAL_TETRAHEDRA, which keeps volume by itself.
   */
  float volume_stiffness;
  /**
   * node_count floats, N/m, at least 0: what draws each node back to its rest position, wherever the body is; nullable:
   * home_stiffness for all.
   */
  const float *home_stiffnesses;
  /**
   * N/m; default 0: nothing does.
   */
  float home_stiffness;
  /**
   * N m, at least 0: the flexural rigidity of the surface that triangles make; default 0: it bends freely. Of a sheet of Young's
   * modulus E, Poisson's ratio nu and thickness t it is E t^3 / (12 (1 - nu^2)). Each edge of two triangles turns back to its angle
   * at rest, whether the surface is flat or curved there; an edge of more triangles is refused. Exact where triangles are equilateral;
   * 5/6 of it along a side where they are squares that are cut alternately. sinew_body_remove_spring takes away the bending of
   * triangles that have the edge, whether or not there is a spring along it.
   */
  float bending_stiffness;
  /**
   * SINEW_SPRING_LAW_...; LINEAR, the default: the four below are 0. Springs that are added later are linear.
   */
  uint32_t spring_law;
  /**
   * EXPONENTIAL: above 0, at most 13.8 / spring_limit; else 0.
   */
  float spring_steepness;
  /**
   * CUBIC: any number whose square is at most 3 spring_cubic, so that longer springs pull more; else 0.
   */
  float spring_quadratic;
  /**
   * CUBIC: at least 0; else 0.
   */
  float spring_cubic;
  /**
   * EXPONENTIAL, CUBIC: above 0; else 0.
   */
  float spring_limit;
  /**
   * Pa, at least 0; default 0.
   */
  float fibre_stiffness;
  /**
   * 3 tetrahedron_count floats: the direction of each tetrahedron's fibres at rest, 1 long within 0.001, or 0: it has none;
   * nullable: there are none. Fibres pull where they are longer than at rest, by their stiffness times the part by which they are
   * longer, over the area across them at rest; they never push.
   */
  const float *fibre_directions;
  /**
   * tetrahedron_count floats, Pa, at least 0; nullable: fibre_stiffness for all.
   */
  const float *fibre_stiffnesses;
  /**
   * s, at least 0, at most 1e6: the viscosity of a dashpot beside each spring and each tetrahedron that is an element, over its stiffness;
   * default 0: there is none. Springs that are added later have none. VERLET takes substeps as short as a dashpot alone asks for: from
   * some hundredths of a second on IMPLICIT is the solver for it.
   */
  float retardation_time;
  /**
   * s, from 1e-9 to 1e6: that of a spring in a row with the dashpot, so that after a step of strain the stress relaxes as
   * E (1 + retardation_time / relaxation_time exp(-t / relaxation_time)): the standard linear solid. 0, the default: the dashpot acts
   * alone, which is Kelvin and Voigt's solid, and on tetrahedra of order 1 in the step. A body begins relaxed, and is
   * so where sinew_body_set_positions puts it.
   */
  float relaxation_time;
  /**
   * The strain from which springs, and rods of tetrahedra that are elements, yield, stretched or pressed, at least 0; default 0: they do
   * not. What is beyond it stays for good. Springs that yield have SINEW_SPRING_LAW_LINEAR; those that are added later do not yield.
   * Springs yield within a step; tetrahedra do where a substep of VERLET or a step of the other solvers ends: with those, a load that
   * deforms them further and further does so the more slowly the longer steps are.
   */
  float yield_strain;
  /**
   * By what part of its rest length it may become longer or shorter for good, above 0 and below 1 where yield_strain is given; default
   * 0.5. Beyond that it is elastic again.
   */
  float largest_set;
  /**
   * The strain of springs from which they are stiffer, at least 0; default 0: there is none. Springs that are added later have none.
   */
  float strain_limit;
  /**
   * How many times their stiffness is added beyond it, above 0, at most 1e6 where strain_limit is given; default 100.
   */
  float limit_stiffening;
  /**
   * Pa, at least 0: how the volume inside of a closed surface resists a change; default 0: it does not. The energy of each cavity of
   * volume V, V0 at rest, is enclosed_stiffness / 2 V0 (V/V0 - 1)^2 - pressure (V - V0). The surface is triangles, or where there are
   * none the boundary of the tetrahedra or cells; each of its parts that hang together by edges must be closed and have a volume. Each is a
   * cavity of its own, unless some are inside out, as the inner wall of a hollow organ is: then those alone are cavities.
   * sinew_body_remove_spring opens the cavities whose triangles have the edge, for good, and a cut those of which it divides or parts
   * triangles, however little: what is open is neither kept nor pressed. A cut beside a cavity leaves it.
   */
  float enclosed_stiffness;
  /**
   * Pa: by how much the pressure inside of a cavity that has its volume at rest is above that outside; below 0 it sucks; default 0. Without an
   * enclosed_stiffness it stays the same however large the cavity becomes. See sinew_body_set_pressure.
   */
  float pressure;
  /**
   * m, 0 to 1e9: what tools and other tissue keep off the surface; default 0.
   */
  float contact_thickness;
  /**
   * Coulomb coefficient with other tissue and with itself, at least 0; of two bodies that meet, the larger holds; default 0. With tools
   * the tool's own holds.
   */
  float contact_friction;
  /**
   * 1: it meets other bodies that have 1 here; 0, the default: it does not.
   */
  uint32_t meets_bodies;
  /**
   * 1: it meets itself; 0, the default: it does not. The two sides of a cut meet from then on, at no distance: they part freely, and rest against
   * each other where they are pressed together again; the rims of a sheet may slide over each other until they have parted.
   */
  uint32_t meets_itself;
  /**
   * How it and other bodies find each other: SINEW_DETECTION_EXACT, the default, or SINEW_DETECTION_IMAGE_SPACE, which one of two has to ask
   * for: then both are drawn in each substep along three axes where their boxes overlap, and what is seen near each other is compared
   * exactly. Itself it always meets exactly. SINEW_DETECTION_DISTANCE_FIELD is for rigid tools: SINEW_STATUS_UNSUPPORTED.
   */
  uint32_t contact_detection;
  /**
   * IMAGE_SPACE: m, the side of a pixel; 0, the default: half of the surface's mean edge. An image of a body of more than 2^24 pixels is
   * refused.
   */
  float contact_resolution;
  /**
   * The categories that it belongs to, a bit for each; default 1. It meets tools and bodies where each has a category that the other's
   * mask has.
   */
  uint32_t collision_category;
  /**
   * The categories that it meets, a bit for each; default 0xffffffff.
   */
  uint32_t collision_mask;
  /**
   * How many nodes cuts may add, of which room is made: some five for each triangle or tetrahedron that a blade passes through. 0, the default:
   * the body cannot be cut, and pays nothing for it. A surface that is to be cut is one of triangles turned one way all over, of which two at most
   * have an edge and those about a node hang together; a solid is one of tetrahedra of which those about a node hang together by faces at it,
   * and triangles are its boundary, if there are any. A body of springs alone loses those that a blade passes through, and needs no room: 1
   * will do. See sinew_body_cut.
   */
  uint32_t spare_nodes;
  /**
   * J/m, at least 0: what a blade (sinew_blade_create) spends for each metre of a cut, at rest: the fracture toughness of the material, J/m^2,
   * times the thickness of the surface. Of tetrahedra the toughness itself, J/m^2. Springs alone have none (SINEW_STATUS_UNSUPPORTED); default 0: it is cut for nothing.
   */
  float toughness;
  /**
   * The part of its rest length by which a spring may become longer, at least 0; 0, the default: any. A spring that a step has left beyond its
   * limits tears the surface, as sinew_body_cut cuts it, through that of its nodes which is pulled apart with the larger force, across that
   * force and as far as the next triangle (O'Brien, Hodgins 1999); where a cut ends in a triangle next to the spring, that goes on
   * instead. A solid tears at that of them about which the material is stretched more, across that and along faces of its tetrahedra; of
   * tetrahedra that are elements each edge has the limit of a spring. See sinew_body_set_tear_limits for single springs, and sinew_body_get_tear_report. A step in which something is
   * beyond its limits may allocate.
   */
  float tear_strain;
  /**
   * N, at least 0: how much a spring may pull; 0, the default: any amount. What a cut leaves of a spring bears its part. Edges of elements
   * have no such limit: SINEW_STATUS_UNSUPPORTED where a body has elements and no springs.
   */
  float tear_force;
  /**
   * The most tears in a step, those of the most loaded springs; 0, the default: the body does not tear, and pays nothing for it. Else
   * spare_nodes is above 0.
   */
  uint32_t most_tears;
  /**
   * m2, of solids m3, at least 0: a tear that would part a piece with less area or volume at rest is not made; default 0.
   */
  float smallest_piece;
  /**
   * m/s, at least 0: what is slower is at rest; 0, the default: the body never sleeps, and pays nothing for it. Else parts of it that have
   * been at rest for sleep_time, and on which no force acts that would make them as fast in that time, stand still and are not stepped
   * until a neighbour, a force, a pin, a tool, a cut or a changed property reaches them. Speed by time is about how far off their places
   * may be. Parts of the body sleep by themselves with SINEW_SOLVER_VERLET, where it is made of springs and elements alone and was not cut; else
   * all of it does or nothing. What meets other tissue or is sewn to it does not sleep. See sinew_body_get_awake_share.
   */
  float sleep_speed;
  /**
   * s, above 0: some times what the tissue takes to settle; default 0.5.
   */
  float sleep_time;
} sinew_body_def;

/**
 * A body: a plain value, all zero is "none".
 */
typedef struct sinew_body_id {
  /**
   * Which place, from 1.
   */
  uint32_t index1;
  /**
   * Which of the bodies that lived there.
   */
  uint32_t generation;
} sinew_body_id;

/**
 * Node i is at (const char *)data + i * stride, in the caller's order; valid until the next step, the next
 * set_positions, set_velocities or rest_state, the next change of topology of that body, or its end; in a sinew_frame as long
 * as that says.
 */
typedef struct sinew_vec3_view {
  /**
   * The first.
   */
  const float *data;
  /**
   * How many.
   */
  size_t count;
  /**
   * Bytes from one to the next.
   */
  size_t stride;
} sinew_vec3_view;

/**
 * What a cut did.
 */
typedef struct sinew_cut_report {
  /**
   * Set by the caller.
   */
  size_t struct_size;
  /**
   * Nodes that are new: copies of others, and points of the surface that are bound to nodes.
   */
  uint32_t new_nodes;
  /**
   * Triangles of the surface that are new.
   */
  uint32_t new_triangles;
  /**
   * Springs that are gone: taken away by the blade, or replaced by springs of copies.
   */
  uint32_t springs_removed;
  /**
   * How many more pieces the surface has.
   */
  uint32_t pieces_parted;
  /**
   * How long the cut is, in the rest shape, m; of tetrahedra on their skin.
   */
  double length;
  /**
   * Of tetrahedra: how large the faces are that have opened, in the rest shape, each on one of its sides, m².
   * A cell in which the cut ends holds: this can be less than what the blade swept.
   */
  double area;
} sinew_cut_report;

/**
 * Where a node that a cut added comes from: what it carries (texture coordinates, weights of a skin) follows by these weights.
 */
typedef struct sinew_new_node {
  /**
   * The new node: one more than that of the entry before.
   */
  uint32_t node;
  /**
   * Those that it lies between, each of a lower number than its own; those beyond the first may repeat it with weight 0. A copy has the
   * node that it was copied from alone.
   */
  uint32_t sources[3];
  /**
   * How much of each, at least 0, 1 in all.
   */
  float weights[3];
} sinew_new_node;

/**
 * An edge of the rim of a cut. Each edge that was cut is two of them, one on either side.
 */
typedef struct sinew_rim_edge {
  /**
   * Its ends, in the order in which its triangle has them.
   */
  uint32_t nodes[2];
  /**
   * The triangle of the surface that it is a side of.
   */
  uint32_t triangle;
} sinew_rim_edge;

/**
 * What has come, changed or gone. The lists are valid until the next change of topology of the body, or its end.
 */
typedef struct sinew_topology_changes {
  /**
   * Set by the caller.
   */
  size_t struct_size;
  /**
   * What the body's topology has now; to be asked with next time.
   */
  uint64_t version;
  /**
   * All new nodes, in the order of their numbers.
   */
  const struct sinew_new_node *nodes;
  /**
   * How many.
   */
  size_t node_count;
  /**
   * Triangles, by their places in sinew_body_get_triangles, whose corners changed or that are new; one may be named several times.
   */
  const uint32_t *triangles;
  /**
   * How many.
   */
  size_t triangle_count;
  /**
   * Springs that are gone, 2 removed_spring_count nodes: taken away by a blade or by hand, or replaced by springs of copies.
   */
  const uint32_t *removed_springs;
  /**
   * How many.
   */
  size_t removed_spring_count;
  /**
   * New edges of the rim, as they were when they came: later cuts may have split or renumbered them.
   */
  const struct sinew_rim_edge *rim;
  /**
   * How many.
   */
  size_t rim_count;
} sinew_topology_changes;

/**
 * Triangles of three nodes each, outward by the right-hand rule; valid until the next change of topology of the body, or its end.
 */
typedef struct sinew_triangle_view {
  /**
   * 3 `count` nodes.
   */
  const uint32_t *data;
  /**
   * How many triangles.
   */
  size_t count;
} sinew_triangle_view;

/**
 * What tore in the last step, and what did not; all 0 of a body that does not tear.
 */
typedef struct sinew_tear_report {
  /**
   * Set by the caller.
   */
  size_t struct_size;
  /**
   * Tears that were made.
   */
  uint32_t tears;
  /**
   * How many more pieces the surface has.
   */
  uint32_t pieces_parted;
  /**
   * Springs beyond their limits whose turn is to come: there were most_tears, one beside them, or nothing pulls their nodes apart.
   */
  uint32_t waiting;
  /**
   * Springs beyond their limits that would part a piece smaller than smallest_piece. They are tried again when the topology has changed.
   */
  uint32_t small_pieces;
  /**
   * Springs beyond their limits for whose tears there is no room: not as many spare nodes, FAST_LINK: no free place of a node, or no memory.
   * They are tried again when the topology has changed.
   */
  uint32_t no_room;
  /**
   * 0.
   */
  uint32_t reserved;
} sinew_tear_report;

/**
 * How a triangle or tetrahedron is strained, as a part of its lengths at rest: 0 wherever it is moved and turned, 0.1 where it is a
 * tenth longer. What has no area or volume at rest has no strain: 0.
 */
typedef struct sinew_strain {
  /**
   * Along the direction in which it is longest: the largest principal stretch, less 1.
   */
  float largest;
  /**
   * Along the direction in which it is shortest: the smallest principal stretch, less 1; from -1 on.
   */
  float smallest;
  /**
   * Of its area or volume: J - 1; below -1 for a tetrahedron that is inside out.
   */
  float growth;
} sinew_strain;

/**
 * J, at the time of the positions.
 */
typedef struct sinew_energy {
  /**
   * Set by the caller.
   */
  size_t struct_size;
  /**
   * Of the nodes that are free to move, with what mass_scaling adds to them.
   */
  double kinetic;
  /**
   * Springs and every other inner term, less the work that a constant pressure has done.
   */
  double elastic;
  /**
   * Zero at the origin.
   */
  double gravitational;
} sinew_energy;

/**
 * How much memory the springs of a body take.
 */
typedef struct sinew_storage_report {
  /**
   * Set by the caller.
   */
  size_t struct_size;
  /**
   * Nodes of the body.
   */
  size_t node_count;
  /**
   * Each counted once.
   */
  size_t spring_count;
  /**
   * By springs that exist.
   */
  size_t bytes_used;
  /**
   * From the allocator, with what is spare.
   */
  size_t bytes_reserved;
} sinew_storage_report;

/**
 * How a body's solver took the last step: not one that was refused, or for which the body was put back.
 */
typedef struct sinew_solver_report {
  /**
   * Set by the caller.
   */
  size_t struct_size;
  /**
   * IMPLICIT, NEWTON: how often the equations of the step were multiplied out; 0 for VERLET.
   */
  uint32_t iterations;
  /**
   * How far nodes may be from where the step's equation has them, m. IMPLICIT: root mean square by mass; above what rounding
   * allows only where `iterations` of the definition were not enough. NEWTON: the longest way of the last correction, of which
   * about a hundredth is left. What a shorter step would change is not in it. 0 for VERLET.
   */
  float error;
  /**
   * VERLET: by how much mass_scaling makes nodes heavier in all, kg.
   */
  double added_mass;
  /**
   * IMPLICIT, NEWTON: linearised equations that were solved; 0 for VERLET.
   */
  uint32_t solves;
  /**
   * IMPLICIT, NEWTON: 1 where every equation was solved as far as the definition asks or rounding allows, else 0; 0 for VERLET.
   */
  uint32_t converged;
} sinew_solver_report;

/**
 * What a body encloses: sums over the cavities that are closed; all 0 where its definition asks for neither enclosed_stiffness nor
 * pressure.
 */
typedef struct sinew_enclosed_report {
  /**
   * Set by the caller.
   */
  size_t struct_size;
  /**
   * Cavities that have not been cut open.
   */
  size_t cavity_count;
  /**
   * m3, at the time of the positions; negative where they are inside out.
   */
  double volume;
  /**
   * The same at rest.
   */
  double rest_volume;
  /**
   * Pa: by how much the pressure inside is above that outside; the mean by volume at rest.
   */
  double pressure;
} sinew_enclosed_report;

/**
 * A tissue's figures, from the literature, for young_modulus and density of a body. Single organs differ by more than the
 * digits suggest.
 */
typedef struct sinew_material_preset {
  /**
   * Set by the caller.
   */
  size_t struct_size;
  /**
   * What tissue it is, in English; static.
   */
  const char *name;
  /**
   * Where the figures are from; static.
   */
  const char *source;
  /**
   * Pa, as the source gives it.
   */
  float shear_modulus;
  /**
   * Pa: three times the shear modulus, since tissue hardly changes its volume.
   */
  float young_modulus;
  /**
   * kg/m3.
   */
  float density;
  /**
   * 0.
   */
  uint32_t reserved;
} sinew_material_preset;

/**
 * How a state of rest is looked for. Filled by sinew_rest_state_def_init.
 */
typedef struct sinew_rest_state_def {
  /**
   * Set by sinew_rest_state_def_init.
   */
  size_t struct_size;
  /**
   * How far a node may be from where it is at rest, as far as that can be told, m; 0, the default: a millionth of the body's
   * extent.
   */
  float tolerance;
  /**
   * The most products with the matrix of second derivatives; 0, the default: a million.
   */
  uint32_t iterations;
} sinew_rest_state_def;

/**
 * How a state of rest was found.
 */
typedef struct sinew_rest_state_report {
  /**
   * Set by the caller.
   */
  size_t struct_size;
  /**
   * Linearised equations that were solved.
   */
  uint32_t iterations;
  /**
   * Products with their matrices.
   */
  uint32_t products;
  /**
   * The largest force left on a node that is not pinned, before positions were rounded to float, N.
   */
  double residual;
  /**
   * How far a node may be from where it is at rest, before positions were rounded to float, m.
   */
  double error;
  /**
   * Of springs, gravity and forces, J, zero at the origin: before.
   */
  double energy_before;
  /**
   * After.
   */
  double energy_after;
} sinew_rest_state_report;

/**
 * What a tool is. Filled by sinew_tool_def_init; used only during sinew_tool_create.
 */
typedef struct sinew_tool_def {
  /**
   * Set by sinew_tool_def_init.
   */
  size_t struct_size;
  /**
   * SINEW_SHAPE_...: sphere about the origin, capsule along y, plane y = 0 with free space above.
   */
  uint32_t shape;
  /**
   * m, above 0, at most 1e9, as is the sum with `half_length`: sphere, capsule; no default.
   */
  float radius;
  /**
   * m, at least 0: capsule, between the centre and a cap's centre; with SINEW_DETECTION_IMAGE_SPACE at most 10 000 times `radius`.
   * What is touched is known to a ten millionth of it.
   */
  float half_length;
  /**
   * 0.
   */
  uint32_t reserved0;
  /**
   * Mesh: 3 node_count floats, closed, triangles outward.
   */
  const float *positions;
  /**
   * Nodes of the mesh.
   */
  size_t node_count;
  /**
   * 3 triangle_count node indices.
   */
  const uint32_t *triangles;
  /**
   * Triangles of the mesh.
   */
  size_t triangle_count;
  /**
   * SINEW_DETECTION_...
   */
  uint32_t detection;
  /**
   * Coulomb coefficient; default 0.
   */
  float friction;
  /**
   * Where it is at first, m, each within 1e9 of 0; default 0 0 0.
   */
  float position[3];
  /**
   * x y z w; default 0 0 0 1; normalised, zero is refused.
   */
  float orientation[4];
  /**
   * 0.
   */
  uint32_t reserved;
  /**
   * How fine an image or a distance field is, m: the side of a pixel or a cell; 0, the default: a 256th or a 96th of the mesh's longest
   * extent, or a fourth of the least where that is less. Refused where no ray or sample would lie within the mesh, by default where
   * fewer than two would along its least extent; and where an image would have more than 2^24 pixels or a field as many samples.
   * Memory: some 24 bytes for each pixel of 3 images, or 4 for each sample. Time: to draw the mesh 3 times, or as many exact distances
   * as there are samples, which takes minutes for 2^24 of a large mesh.
   */
  float resolution;
  /**
   * N, at least 0: the largest force that moves it; default infinity: it goes wherever it is sent. Where tissue resists with more it stops
   * short of its pose: see sinew_tool_get_pose.
   */
  float force_limit;
  /**
   * The categories that it belongs to, a bit for each; default 1. It meets bodies where each has a category that the other's
   * mask has.
   */
  uint32_t collision_category;
  /**
   * The categories that it meets, a bit for each; default 0xffffffff.
   */
  uint32_t collision_mask;
} sinew_tool_def;

/**
 * A tool: a plain value, all zero is "none".
 */
typedef struct sinew_tool_id {
  /**
   * Which place, from 1.
   */
  uint32_t index1;
  /**
   * Which of the tools that lived there.
   */
  uint32_t generation;
} sinew_tool_id;

/**
 * Where a tool pressed a body when the last step ended.
 */
typedef struct sinew_contact {
  /**
   * The body.
   */
  struct sinew_body_id body;
  /**
   * The node, the two of an edge or the three of a face that it pressed; the last is repeated.
   */
  uint32_t nodes[3];
  /**
   * The point of them, as weights; 0 where a node is repeated.
   */
  float weights[3];
  /**
   * The point, m.
   */
  float point[3];
  /**
   * Away from the tool, 1 long.
   */
  float normal[3];
  /**
   * On the tool, friction with it, N, in the last substep: where a step has several, the wrench is their mean.
   */
  float force[3];
} sinew_contact;

/**
 * A tool and a body that began or ceased to touch in the last step.
 */
typedef struct sinew_contact_change {
  /**
   * The tool.
   */
  struct sinew_tool_id tool;
  /**
   * The body.
   */
  struct sinew_body_id body;
  /**
   * 1: they touch now; 0: they do no longer.
   */
  uint32_t begun;
  /**
   * 0.
   */
  uint32_t reserved;
} sinew_contact_change;

/**
 * What a tool holds of a body, or a body of another: a plain value, all zero is "none".
 */
typedef struct sinew_attachment_id {
  /**
   * Which place, from 1.
   */
  uint32_t index1;
  /**
   * Which of the attachments that lived there.
   */
  uint32_t generation;
} sinew_attachment_id;

/**
 * What a suture is like. Filled by sinew_suture_def_init.
 */
typedef struct sinew_suture_def {
  /**
   * Set by sinew_suture_def_init.
   */
  size_t struct_size;
  /**
   * How long the thread is between its points while nothing pulls, m, at least 0; -1, the default: as long as they are apart.
   */
  float length;
  /**
   * By what force it is longer, N/m, above 0; infinity, the default: it does not stretch.
   */
  float stiffness;
  /**
   * The force at which it is pulled through the tissue, N, at least 0; 0, the default, or infinity: it holds whatever comes.
   */
  float force_limit;
  /**
   * 0.
   */
  uint32_t reserved0;
} sinew_suture_def;

/**
 * How a suture is now.
 */
typedef struct sinew_suture_report {
  /**
   * Set by the caller.
   */
  size_t struct_size;
  /**
   * How long its thread is while nothing pulls, m.
   */
  float length;
  /**
   * How far apart its points are, m: further than that where it pulls.
   */
  float distance;
  /**
   * What the thread stores, J; 0 where it does not stretch. That of bodies is without it.
   */
  double energy;
} sinew_suture_report;

/**
 * What a blade is. Filled by sinew_blade_def_init; used only during sinew_blade_create.
 */
typedef struct sinew_blade_def {
  /**
   * Set by sinew_blade_def_init.
   */
  size_t struct_size;
  /**
   * Both ends of the cutting edge about the blade's own origin, m, each coordinate within 1e9 of 0; not at one place; no default.
   */
  float edge[6];
  /**
   * N/m, above 0 and finite; default 1000: the force for each metre by which it is ahead of where tissue is cut, in each body. How blunt it is:
   * tissue of toughness T resists with some T, and gives way by T / stiffness first.
   */
  float stiffness;
  /**
   * The categories that it belongs to, a bit for each; default 1. It meets bodies where each has a category that the other's
   * mask has.
   */
  uint32_t collision_category;
  /**
   * The categories that it meets, a bit for each; default 0xffffffff.
   */
  uint32_t collision_mask;
  /**
   * Where it is at first, m, each within 1e9 of 0; default 0 0 0.
   */
  float position[3];
  /**
   * x y z w; default 0 0 0 1; normalised, zero is refused.
   */
  float orientation[4];
} sinew_blade_def;

/**
 * A blade: a plain value, all zero is "none".
 */
typedef struct sinew_blade_id {
  /**
   * Which place, from 1.
   */
  uint32_t index1;
  /**
   * Which of the blades that lived there.
   */
  uint32_t generation;
} sinew_blade_id;

/**
 * What a blade did in the last step, and what was done to it.
 */
typedef struct sinew_blade_report {
  /**
   * Set by the caller.
   */
  size_t struct_size;
  /**
   * The force on it, world axes, mean over the step, N.
   */
  float force[3];
  /**
   * The torque on it about its position, world axes, mean over the step, N m.
   */
  float torque[3];
  /**
   * What whoever moves it has spent on tissue in the step, J.
   */
  double work;
  /**
   * How long the cuts are that it made at the end of the step, at rest, m; of solids on their skin.
   */
  double length;
  /**
   * How far it is ahead of where tissue is cut, m: 0 where nothing is in its way.
   */
  double lag;
  /**
   * SINEW_STATUS_OK, or why what it went through was not cut: SINEW_STATUS_CAPACITY or SINEW_STATUS_OUT_OF_MEMORY. It is tried again with the
   * next step.
   */
  sinew_status status;
  /**
   * 0.
   */
  uint32_t reserved0;
  /**
   * Of solids: how large the faces are that have opened, at rest, m^2.
   * A cell in which a stroke ends holds: this can be less than what was swept and resisted.
   */
  double area;
} sinew_blade_report;

/**
 * How a device is coupled to a tool. Filled by sinew_haptic_def_init; used only during sinew_haptic_create.
 */
typedef struct sinew_haptic_def {
  /**
   * Set by sinew_haptic_def_init.
   */
  size_t struct_size;
  /**
   * The tool that the device leads; no default.
   */
  struct sinew_tool_id tool;
  /**
   * Of the spring between device and tool, N/m, above 0; default 1000. A device should stand it with its own sampling: about half of its damping,
   * N s/m, by the time between ticks, or less.
   */
  float stiffness;
  /**
   * The same for turning, N m/rad, at least a millionth of the stiffness at the lever, which is half of the tool's length; default 0: that stiffness.
   */
  float angular_stiffness;
  /**
   * Of the damper beside that spring, which acts where tissue resists; default 1: it damps device_mass on the spring critically. 0: what the loop
   * makes of energy is still damped away, but less surely.
   */
  float damping_ratio;
  /**
   * What the hand moves of the device, kg, above 0; default 0.05.
   */
  float device_mass;
  /**
   * The largest force, N, above 0; default infinity.
   */
  float force_limit;
  /**
   * The largest torque, N m, above 0; default infinity.
   */
  float torque_limit;
  /**
   * How fast the force may change, N/s, above 0; default infinity. A force that such a limit makes late gives a hand more than it took: the loop is
   * kept passive where it is not reached.
   */
  float force_rate_limit;
  /**
   * How fast the torque may change, N m/s, above 0; default infinity.
   */
  float torque_rate_limit;
  /**
   * A model that is older, s, above 0, is stale: force and torque go to 0 until there is a newer one; default 0.1.
   */
  float stale_after;
  /**
   * The time in which they do, or come back, s, above 0; default 0.1.
   */
  float ramp;
} sinew_haptic_def;

/**
 * What a tick comes to.
 */
typedef struct sinew_haptic_result {
  /**
   * Set by the caller.
   */
  size_t struct_size;
  /**
   * On the device, world axes, N, until the next tick.
   */
  float force[3];
  /**
   * On the device, about its position, world axes, N m.
   */
  float torque[3];
  /**
   * Where the tool is to go, m: the device, but for what the spring between them is drawn out.
   */
  float proxy_position[3];
  /**
   * x y z w.
   */
  float proxy_orientation[4];
  /**
   * Contacts of the tool as the model was made: sinew_haptic_get_contacts.
   */
  uint32_t contact_count;
  /**
   * How long ago the device was where the model was made, s, by the ticks; infinity as long as there was none.
   */
  float age;
  /**
   * The steps of the world that were published for it.
   */
  uint64_t version;
  /**
   * What part of the model's forces is given: less than 1 where that was stale.
   */
  float gain;
  /**
   * 1: the tool, or its world, is gone.
   */
  uint32_t is_over;
  /**
   * What the coupling has lost of the energy that went through it, J: kept at 0 or above as far as damping can.
   */
  double lost;
} sinew_haptic_result;

/**
 * Where a tool pressed a body as the model of its handle was made.
 */
typedef struct sinew_haptic_contact {
  /**
   * The body.
   */
  struct sinew_body_id body;
  /**
   * The point, m.
   */
  float point[3];
  /**
   * Away from the tool, of unit length.
   */
  float normal[3];
  /**
   * How fast the tissue moves there, m/s.
   */
  float velocity[3];
  /**
   * On the tool, N.
   */
  float force[3];
} sinew_haptic_contact;

/**
 * What a mesh holds, and what was tidied; all borrowed from the mesh, valid until its end.
 */
typedef struct sinew_mesh_view {
  /**
   * Set by the caller.
   */
  size_t struct_size;
  /**
   * 3 node_count floats, m.
   */
  const float *positions;
  /**
   * Nodes; each is used.
   */
  size_t node_count;
  /**
   * 3 triangle_count node indices: what the file or the shape gives as triangles.
   */
  const uint32_t *triangles;
  /**
   * Triangles.
   */
  size_t triangle_count;
  /**
   * 4 tetrahedron_count node indices, of positive volume.
   */
  const uint32_t *tetrahedra;
  /**
   * Tetrahedra.
   */
  size_t tetrahedron_count;
  /**
   * 3 surface_triangle_count node indices, outward: the boundary of the tetrahedra or cells; without either the
   * triangles.
   */
  const uint32_t *surface;
  /**
   * Triangles of the surface.
   */
  size_t surface_triangle_count;
  /**
   * vertex_count node indices: for each vertex of the file its node, or SINEW_NO_NODE where it was dropped.
   */
  const uint32_t *node_of_vertex;
  /**
   * Vertices of the file; of a shape, its nodes.
   */
  size_t vertex_count;
  /**
   * Vertices that became one node with an earlier one.
   */
  size_t welded_vertices;
  /**
   * Points that nothing uses.
   */
  size_t dropped_vertices;
  /**
   * Collapsed or doubled.
   */
  size_t dropped_triangles;
  /**
   * Collapsed or doubled.
   */
  size_t dropped_tetrahedra;
  /**
   * Were inside out; two of their nodes were swapped.
   */
  size_t flipped_tetrahedra;
  /**
   * 1: every edge of the surface is used equally often in both directions; 0: it is open.
   */
  uint32_t closed;
  /**
   * 0.
   */
  uint32_t reserved;
  /**
   * 8 cell_count node indices: the cubes of a lattice, corners numbered by bits, x 1, y 2, z 4.
   */
  const uint32_t *cells;
  /**
   * Cells.
   */
  size_t cell_count;
} sinew_mesh_view;

/**
 * How a world is drawn. Filled by sinew_picture_def_init.
 */
typedef struct sinew_picture_def {
  /**
   * Set by sinew_picture_def_init.
   */
  size_t struct_size;
  /**
   * Pixels, 1 to 16384; default 1280.
   */
  uint32_t width;
  /**
   * Pixels, 1 to 16384; default 960.
   */
  uint32_t height;
  /**
   * Where the camera is, m.
   */
  float eye[3];
  /**
   * What it looks at, m; eye equal to target, the default: a view fitted to the bodies, from `direction`.
   */
  float target[3];
  /**
   * What is up in the picture; default 0 1 0.
   */
  float up[3];
  /**
   * For a fitted view: from the scene towards the camera; default 1 0.6 1.4.
   */
  float direction[3];
  /**
   * rad, vertical, above 0 and below pi; default 0.6.
   */
  float field_of_view;
  /**
   * 1: with the points where tools press bodies and the forces on the tools there; 0, the default: without.
   */
  uint32_t show_contacts;
} sinew_picture_def;

/**
 * A body that is coloured by a number for each of its nodes, such as strain or a force. Equal steps of a number look equally far apart.
 */
typedef struct sinew_body_values {
  /**
   * Which.
   */
  struct sinew_body_id body;
  /**
   * `node_count` floats, finite, in the caller's order.
   */
  const float *values;
  /**
   * The body's.
   */
  size_t node_count;
  /**
   * What has the first colour, as has what is below.
   */
  float low;
  /**
   * What has the last colour, as has what is above; above `low`.
   */
  float high;
  /**
   * SINEW_COLOURS_...
   */
  uint32_t colours;
  /**
   * 0.
   */
  uint32_t reserved;
} sinew_body_values;

/**
 * A point of a body's surface.
 */
typedef struct sinew_surface_point {
  /**
   * Set by the caller.
   */
  size_t struct_size;
  /**
   * The body it belongs to; all zero: nothing was found, and the rest is 0.
   */
  struct sinew_body_id body;
  /**
   * The triangle, in the order of the body's surface.
   */
  uint32_t triangle;
  /**
   * Of the triangle's corners, 1 in sum.
   */
  float weights[3];
  /**
   * m
   */
  float position[3];
  /**
   * The triangle's, outward, of unit length; 0 where it has no area.
   */
  float normal[3];
  /**
   * m: from where it was asked for.
   */
  float distance;
  /**
   * 0.
   */
  uint32_t reserved;
} sinew_surface_point;

/**
 * What a reader sees of a body: all of one moment. What it points to is valid, and stays as it is, until the next sinew_reader_read of the same
 * reader, or the reader's end.
 */
typedef struct sinew_frame {
  /**
   * Set by the caller.
   */
  size_t struct_size;
  /**
   * Where each node is, m, in the caller's order, with those that cuts have added.
   */
  struct sinew_vec3_view positions;
  /**
   * The triangles that were drawn then, as sinew_body_get_triangles gives them; they change with topology_version alone.
   */
  struct sinew_triangle_view triangles;
  /**
   * Above that of earlier frames; the same as long as nothing has moved the body.
   */
  uint64_t version;
  /**
   * What sinew_body_get_topology_changes told as `version` then.
   */
  uint64_t topology_version;
  /**
   * How many steps the world had taken.
   */
  uint64_t step;
  /**
   * The sum of their lengths, s.
   */
  double time;
  /**
   * 1: this reader did not read this frame before.
   */
  uint32_t is_new;
  /**
   * 1: the body, or its world, is no more: this is its last frame.
   */
  uint32_t is_over;
} sinew_frame;

/**
 * Which two bodies are compared, and how. Filled by sinew_detector_def_init; used only during sinew_detector_create.
 */
typedef struct sinew_detector_def {
  /**
   * Set by sinew_detector_def_init.
   */
  size_t struct_size;
  /**
   * The first and the second; no default. Both have triangles, tetrahedra or cells, and one at least has a closed surface.
   */
  struct sinew_body_id bodies[2];
  /**
   * SINEW_DETECTION_EXACT, the default: trees of triangles, refitted (the rest, but `bodies`, is not used then, and `thickness` 0); or
   * SINEW_DETECTION_IMAGE_SPACE: rays through the pixels of a parallel view. SINEW_DETECTION_DISTANCE_FIELD is for rigid
   * tools: SINEW_STATUS_UNSUPPORTED.
   */
  uint32_t detection;
  /**
   * SINEW_IMAGE_FORM_...; default SINEW_IMAGE_FORM_INTERVALS.
   */
  uint32_t form;
  /**
   * IMAGE_SPACE: m, the side of a pixel, above 0; no default. A 256th of a body's size finds all but a thousandth of its edges.
   */
  float pixel;
  /**
   * IMAGE_SPACE: along which to look, of any length; 0 0 0, the default: along the three axes, one after the other, and what any of them
   * sees counts. Depths are along the view: along three axes some 2 % of the size more than the shortest way out, along one 6 %.
   */
  float direction[3];
  /**
   * IMAGE_SPACE: room for so many pixels in an image, 1 to 2^24; default 2^18. A pair whose boxes overlap so far that it is not enough is
   * drawn with pixels of twice the size, and so on.
   */
  uint32_t pixels;
  /**
   * INTERVALS: room for so many crossings of rays with faces in an image of one body, at least 1; likewise; default 2^20. Both
   * defaults take some 18 MB.
   */
  uint32_t crossings;
  /**
   * IMAGE_SPACE: m, at least 0; default 0 0: how much further along the view than its faces each of the two counts as there, so that
   * thin parts are not missed; depths, and the volume that a view sees, are those of bodies that are so much thicker.
   */
  float thickness[2];
} sinew_detector_def;

/**
 * What a detector found, but for lists. Index 0 is of the first body, 1 of the second.
 */
typedef struct sinew_detector_report {
  /**
   * Set by the caller.
   */
  size_t struct_size;
  /**
   * INTERVALS: what both enclose, m^3, the mean over the views (Faure et al. 2008); 0 where one of them is open, and with COUNTED and
   * EXACT.
   */
  double volume;
  /**
   * The direction of unit length in which the first has to be moved so that the volume shrinks fastest; 0 where there is no volume.
   */
  float normal[3];
  /**
   * How far it has to be moved, were the volume to shrink so all the way, m.
   */
  float depth;
  /**
   * The largest pixel used, m: that asked for, or twice that and so on where there was not enough room; EXACT: 0.
   */
  float pixel;
  /**
   * Entries of sinew_detector_get_points.
   */
  uint32_t point_counts[2];
  /**
   * Entries of sinew_detector_get_edges.
   */
  uint32_t edge_counts[2];
  /**
   * Parts of edges inside that there was no room for: more than four an edge, on average.
   */
  uint32_t unlisted[2];
  /**
   * 1: the body is closed, so that the other can be inside of it; 0: it is open, or was cut open: nothing is found within it, and in image
   * space of itself edges alone. As sinew_body_is_closed, but that a detector made for an open body does not ask again.
   */
  uint32_t closed[2];
  /**
   * 0.
   */
  uint32_t reserved;
} sinew_detector_report;

/**
 * A node of a body that lies within the other.
 */
typedef struct sinew_point_inside {
  /**
   * The node.
   */
  uint32_t node;
  /**
   * IMAGE_SPACE: the triangle of the other's surface at the end of the way out; EXACT: SINEW_NO_TRIANGLE.
   */
  uint32_t triangle;
  /**
   * m: IMAGE_SPACE: the way out along the view, the shortest of those of several views; EXACT: how far the other's surface is.
   */
  float depth;
  /**
   * EXACT: the shortest way out, of unit length; IMAGE_SPACE: 0.
   */
  float normal[3];
} sinew_point_inside;

/**
 * A part of an edge of a body that lies within the other.
 */
typedef struct sinew_edge_inside {
  /**
   * From the first to the second.
   */
  uint32_t nodes[2];
  /**
   * Where it goes in, as a fraction of the edge; 0 where it begins inside.
   */
  float entry;
  /**
   * Where it comes out; 1 where it ends inside.
   */
  float exit;
  /**
   * IMAGE_SPACE: the longest of the ways out along the view, m, of several views the one that sees the least; COUNTED: from the edge to
   * the next face; EXACT: 0.
   */
  float depth;
} sinew_edge_inside;

/**
 * Vector i is at (const char *)data + i * stride; valid as long as what gave it says.
 */
typedef struct sinew_dvec3_view {
  /**
   * The first.
   */
  const double *data;
  /**
   * How many.
   */
  size_t count;
  /**
   * Bytes from one to the next.
   */
  size_t stride;
} sinew_dvec3_view;

/**
 * A surface that is drawn, and what of a body it goes with.
 */
typedef struct sinew_embedding_def {
  /**
   * Set by sinew_embedding_def_init.
   */
  size_t struct_size;
  /**
   * 3 vertex_count floats: where each vertex is while the body is where it is, m, within 1e9 m of the origin; no default.
   */
  const float *vertices;
  /**
   * At least 1.
   */
  size_t vertex_count;
  /**
   * 3 triangle_count vertices, outward by the right-hand rule: what normals come from; nullable: there are none.
   */
  const uint32_t *triangles;
  /**
   * Triangles.
   */
  size_t triangle_count;
  /**
   * 4 tetrahedron_count nodes: the tetrahedra of the body, as it was created with. Each vertex keeps its barycentric weights in the one that it
   * is in, or nearest to. Where the body has been cut or torn, those that it has now are taken instead. Nullable: each goes with the nearest
   * triangle that is drawn of the body, and keeps its distance from that.
   */
  const uint32_t *tetrahedra;
  /**
   * Tetrahedra.
   */
  size_t tetrahedron_count;
} sinew_embedding_def;

/**
 * Done.
 */
#define SINEW_STATUS_OK 0

/**
 * An argument is out of its range; nothing changed.
 */
#define SINEW_STATUS_INVALID_ARGUMENT 1

/**
 * The id is of something destroyed, or of nothing.
 */
#define SINEW_STATUS_STALE_ID 2

/**
 * A fixed-capacity storage is full.
 */
#define SINEW_STATUS_CAPACITY 3

/**
 * Memory could not be reserved; nothing changed.
 */
#define SINEW_STATUS_OUT_OF_MEMORY 4

/**
 * The step could not be taken, or the state of rest was not found: nothing moved, pending forces and poses stay pending.
 */
#define SINEW_STATUS_UNSTABLE 5

/**
 * Valid, but this build or this combination does not offer it.
 */
#define SINEW_STATUS_UNSUPPORTED 6

/**
 * A file could not be read or written.
 */
#define SINEW_STATUS_IO 7

/**
 * A fault inside the library; the world refuses further calls but destroy.
 */
#define SINEW_STATUS_INTERNAL 8

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * The version of the library that is linked: major << 16 | minor << 8 | patch; compare with SINEW_VERSION.
 */
uint32_t sinew_version(void);

/**
 * The name of a status, such as "SINEW_STATUS_OK"; never NULL, valid for ever.
 */
const char *sinew_status_name(sinew_status status);

/**
 * Writes the message of this thread's last failed call to `buffer`, cut where `capacity` bytes do not hold it, and ended
 * by NUL. `buffer` may be NULL where `capacity` is 0.
 *
 * Returns the bytes that the whole message needs, NUL included; 1, an empty message, where no call has failed.
 *
 * # Safety
 * `buffer` must be writable for `capacity` bytes.
 */
size_t sinew_last_error(char *buffer,
                        size_t capacity);

/**
 * Fills `def` with the defaults. `struct_size` is sizeof(sinew_world_def).
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT.
 *
 * # Safety
 * `def` is NULL or writable for `struct_size` bytes.
 */
sinew_status sinew_world_def_init(struct sinew_world_def *def, size_t struct_size);

/**
 * Creates an empty world, which the caller destroys with sinew_world_destroy.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_UNSUPPORTED (a thread could not be started, or the
 * processor does not offer the kernel),
 * SINEW_STATUS_OUT_OF_MEMORY.
 *
 * # Safety
 * `def` is NULL or a definition of the size that it states, with a `run_tasks` that keeps its word; `out` is NULL or
 * writable.
 */
sinew_status sinew_world_create(const struct sinew_world_def *def,
                                struct sinew_world **out);

/**
 * Destroys a world with all that is in it. NULL: nothing.
 *
 * # Safety
 * `world` is NULL or a world that is not destroyed and that nobody uses any more.
 */
void sinew_world_destroy(struct sinew_world *world);

/**
 * Steps everything in the world by `dt` seconds, above 0. `report` may be NULL. Views of positions and velocities end.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT; SINEW_STATUS_UNSTABLE, where the step needs more substeps than max_substeps, or
 * than the world's fixed substeps: nothing has moved, pending forces and poses stay pending.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; `report` is NULL or writable for the size that it states.
 */
sinew_status sinew_world_step(struct sinew_world *world,
                              float dt,
                              struct sinew_step_report *report);

/**
 * Gives everything this acceleration, 3 floats, m/s^2, from the next step on.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; `gravity` is NULL or 3 floats.
 */
sinew_status sinew_world_set_gravity(struct sinew_world *world, const float *gravity);

/**
 * Writes a hash over everything that the next step depends on; to be compared within one version of the library.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `out` is NULL or writable.
 */
sinew_status sinew_world_get_state_hash(const struct sinew_world *world,
                                        uint64_t *out);

/**
 * Fills `def` with the defaults. `struct_size` is sizeof(sinew_body_def).
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT.
 *
 * # Safety
 * `def` is NULL or writable for `struct_size` bytes.
 */
sinew_status sinew_body_def_init(struct sinew_body_def *def, size_t struct_size);

/**
 * Creates a body; copies what `def` points to.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_CAPACITY
 * (FAST_LINK: a node has more springs than springs_per_node), SINEW_STATUS_OUT_OF_MEMORY.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; `def` is NULL or a definition of the size that it states, with arrays of
 * the lengths that it states; `out` is NULL or writable.
 */
sinew_status sinew_body_create(struct sinew_world *world,
                               const struct sinew_body_def *def,
                               struct sinew_body_id *out);

/**
 * Destroys a body. Views of its positions and velocities end.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses.
 */
sinew_status sinew_body_destroy(struct sinew_world *world, struct sinew_body_id body);

/**
 * Adds `force`, 3 floats, N, to what acts on a node: constant over the whole next step, cleared when that is
 * SINEW_STATUS_OK; nothing on a pinned node or one that a tool holds, nor along an axis along which a node is held.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID, SINEW_STATUS_OUT_OF_MEMORY.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; `force` is NULL or 3 floats.
 */
sinew_status sinew_body_apply_force(struct sinew_world *world,
                                    struct sinew_body_id body,
                                    uint32_t node,
                                    const float *force);

/**
 * Adds a force to what acts on each of `count` nodes, as sinew_body_apply_force does: `nodes` are `count` indices, of
 * which some may be equal, `forces` 3 `count` floats, N. Both may be NULL where `count` is 0.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID, SINEW_STATUS_OUT_OF_MEMORY; then no force is added.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; the arrays are NULL or as long as stated.
 */
sinew_status sinew_body_apply_forces(struct sinew_world *world,
                                     struct sinew_body_id body,
                                     const uint32_t *nodes,
                                     const float *forces,
                                     size_t count);

/**
 * Writes a view of where each node is, m. Nothing is copied; see sinew_vec3_view for how long it lives.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `out` is NULL or writable.
 */
sinew_status sinew_body_get_positions(const struct sinew_world *world,
                                      struct sinew_body_id body,
                                      struct sinew_vec3_view *out);

/**
 * Writes a view of how fast each node moves at the time of the positions, m/s; a pinned node as it was led in the last
 * step. The first call after a step works them out, which takes about as long as a substep; see sinew_vec3_view for how
 * long the view lives.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `out` is NULL or writable.
 */
sinew_status sinew_body_get_velocities(const struct sinew_world *world,
                                       struct sinew_body_id body,
                                       struct sinew_vec3_view *out);

/**
 * Writes 1 where a body's surface encloses something, so that others can be found within it and are led out, else 0: where it is not closed,
 * and from then on that sinew_body_remove_spring has taken away an edge of it.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `out` is NULL or writable.
 */
sinew_status sinew_body_is_closed(const struct sinew_world *world,
                                  struct sinew_body_id body,
                                  uint32_t *out);

/**
 * Has a body be of these categories and meet those of `mask`, a bit for each, from the next step on: see sinew_body_def. What of tools and
 * other bodies lies within it when they meet again is pushed out.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses.
 */
sinew_status sinew_body_set_collision(struct sinew_world *world,
                                      struct sinew_body_id body,
                                      uint32_t category,
                                      uint32_t mask);

/**
 * Puts all nodes at `positions`, 3 `node_count` floats, m. Velocities stay; pinned nodes move too; nothing is
 * swept. What tools hold they hold there.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where `node_count` is not the body's), SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; `positions` is NULL or as long as stated.
 */
sinew_status sinew_body_set_positions(struct sinew_world *world,
                                      struct sinew_body_id body,
                                      const float *positions,
                                      size_t node_count);

/**
 * Gives all nodes `velocities`, 3 `node_count` floats, m/s; pinned nodes keep theirs, as all do along axes along which they
 * are held.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where `node_count` is not the body's), SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; `velocities` is NULL or as long as stated.
 */
sinew_status sinew_body_set_velocities(struct sinew_world *world,
                                       struct sinew_body_id body,
                                       const float *velocities,
                                       size_t node_count);

/**
 * Holds a node where it is, from now on; nothing where it is held already.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where a tool holds the node), SINEW_STATUS_STALE_ID, SINEW_STATUS_OUT_OF_MEMORY.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses.
 */
sinew_status sinew_body_pin(struct sinew_world *world,
                            struct sinew_body_id body,
                            uint32_t node);

/**
 * Holds a node where it is along some axes, from now on, and along no others: a symmetry plane, a rail, a sliding support.
 * `axes` is a sum of SINEW_AXIS_X, SINEW_AXIS_Y and SINEW_AXIS_Z; all three are sinew_body_pin, 0 is sinew_body_unpin.
 * Along the others the node moves as a free one does, with its mass; velocities and forces that are given to it count
 * there alone.
 *
 * An axis along which it was held already stays as it is, and one that it is let go of goes on as it was led in the last
 * step. Where the axes change, what sinew_body_move_pin has asked of the node since the last step is forgotten, and so
 * are forces that act on it along an axis which is held now. A tool acts on it along its free axes alone; what it does
 * along the others the pin takes.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where `axes` has other bits, a tool holds the node, or it has no mass and is
 * pinned for good), SINEW_STATUS_STALE_ID, SINEW_STATUS_OUT_OF_MEMORY.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses.
 */
sinew_status sinew_body_pin_axes(struct sinew_world *world,
                                 struct sinew_body_id body,
                                 uint32_t node,
                                 uint32_t axes);

/**
 * Lets go of a node along all axes: it goes on as it was led in the last step; nothing where it is not held.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where a tool holds the node, or it has no mass and is pinned for good),
 * SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses.
 */
sinew_status sinew_body_unpin(struct sinew_world *world,
                              struct sinew_body_id body,
                              uint32_t node);

/**
 * Leads a pinned node on a straight line to `position`, 3 floats, m: there at the end of the next step; one that is held
 * along some axes alone along those.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where the node is not pinned, or a tool holds it), SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; `position` is NULL or 3 floats.
 */
sinew_status sinew_body_move_pin(struct sinew_world *world,
                                 struct sinew_body_id body,
                                 uint32_t node,
                                 const float *position);

/**
 * Writes what holds a pinned node against its springs and its weight, 3 floats, N, mean over the last step; 0 along axes
 * along which it is not held.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where the node is not pinned, or a tool holds it), SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `force` is NULL or writable for 3 floats.
 */
sinew_status sinew_body_get_pin_force(const struct sinew_world *world,
                                      struct sinew_body_id body,
                                      uint32_t node,
                                      float *force);

/**
 * Joins two nodes by a spring without damping: `stiffness` in N/m, `rest_length` in m, below 0: the current distance.
 * One spring per pair.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where the pair has a spring), SINEW_STATUS_STALE_ID,
 * SINEW_STATUS_CAPACITY (FAST_LINK: a node has no free place), SINEW_STATUS_OUT_OF_MEMORY.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses.
 */
sinew_status sinew_body_add_spring(struct sinew_world *world,
                                   struct sinew_body_id body,
                                   uint32_t a,
                                   uint32_t b,
                                   float stiffness,
                                   float rest_length);

/**
 * Makes the pressure of a body's cavities this, Pa, where they have their volumes at rest, from the next step on: see `pressure` of
 * sinew_body_def. A cavity that was cut open stays without. A body that is to be inflated later is created with a pressure or an
 * enclosed_stiffness.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where the body was created with neither), SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses.
 */
sinew_status sinew_body_set_pressure(struct sinew_world *world,
                                     struct sinew_body_id body,
                                     float pressure);

/**
 * Removes the spring between two nodes.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where there is none), SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses.
 */
sinew_status sinew_body_remove_spring(struct sinew_world *world,
                                      struct sinew_body_id body,
                                      uint32_t a,
                                      uint32_t b);

/**
 * Writes the two nodes of each spring, each spring once, the lower node first: `pairs` are 2 `count` indices, `count` how many springs
 * the body has (`spring_count` of sinew_body_get_storage_report). The order is the same until springs are added or removed.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where `count` is not the body's), SINEW_STATUS_STALE_ID, SINEW_STATUS_OUT_OF_MEMORY.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `pairs` is NULL or as long as stated.
 */
sinew_status sinew_body_get_spring_pairs(const struct sinew_world *world,
                                         struct sinew_body_id body,
                                         uint32_t *pairs,
                                         size_t count);

/**
 * Writes what the springs of `count` pairs of nodes are like now: `pairs` are 2 `count` indices; `stiffnesses`, N/m, and
 * `rest_lengths`, m, are `count` floats each, nullable. PACKED keeps rest lengths that come from positions merged where these are
 * rounded to the same.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where a pair has no spring), SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; the arrays are NULL or as long as stated, and do not overlap.
 */
sinew_status sinew_body_get_springs(const struct sinew_world *world,
                                    struct sinew_body_id body,
                                    const uint32_t *pairs,
                                    size_t count,
                                    float *stiffnesses,
                                    float *rest_lengths);

/**
 * Gives the springs of `count` pairs of nodes other stiffnesses, N/m, or rest lengths, m, or both: `pairs` are 2 `count` indices,
 * `stiffnesses` and `rest_lengths` `count` floats each, NULL: they stay. Damping stays, and the law by which springs stiffen. Of a
 * pair that is named more than once the last counts. Positions and velocities stay, so the energy changes by what the springs then
 * hold. It takes as long as the springs are many, however large the body.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where a pair has no spring), SINEW_STATUS_STALE_ID, SINEW_STATUS_OUT_OF_MEMORY; then no
 * spring is changed.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; the arrays are NULL or as long as stated.
 */
sinew_status sinew_body_set_springs(struct sinew_world *world,
                                    struct sinew_body_id body,
                                    const uint32_t *pairs,
                                    size_t count,
                                    const float *stiffnesses,
                                    const float *rest_lengths);

/**
 * Makes what lies between `node_count` nodes alone `stiffness_factor` times as stiff and `length_factor` times as long at rest, as
 * cautery stiffens and shrinks, and as tissue swells: springs of two of them, tetrahedra of SINEW_MATERIAL_TETRAHEDRA or with a
 * volume_stiffness with all corners among them, bending and fibres alike. Home springs become stiffer, and draw where they did. What
 * reaches beyond the region stays as it is, and so do masses, damping, positions and velocities: the body moves to its new shape by
 * itself.
 *
 * `stiffness_factor` is at least 0, `length_factor` above 0. Factors multiply those of calls before; a stiffness of 0 is for good, and
 * takes tetrahedra away. `nodes` may name a node more than once. It takes as long as the region is large.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where something would become so stiff, long or small that it is no number),
 * SINEW_STATUS_STALE_ID, SINEW_STATUS_OUT_OF_MEMORY; then nothing is changed.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; `nodes` is NULL or as long as stated.
 */
sinew_status sinew_body_scale_region(struct sinew_world *world,
                                     struct sinew_body_id body,
                                     const uint32_t *nodes,
                                     size_t node_count,
                                     float stiffness_factor,
                                     float length_factor);

/**
 * Cuts a body where a blade's edge passed from one place to another, while its nodes are where they are: `start` and `end` are the two
 * ends of the edge, 6 floats each, m. Between them it swept two triangles, which share the way from the first end at the start to the second at
 * the end. `report` is nullable; its struct_size is set by the caller.
 *
 * Where the blade crosses an edge of the surface, or ends within a triangle, there is a point of the surface from then on: one that is there, or on
 * an edge that is there, if it lies within 5 % of the shortest edge of the triangle that is simulated there, at rest. Between them the
 * surface is open; a cut that goes on where the last ended joins it. What is simulated stays as well shaped as it was: a triangle whose material
 * fell apart is copied for each piece, with nodes that are not drawn where its material is beyond the cut, and with its part of masses and
 * stiffnesses; copies share nodes where their material hangs together (Molino, Bao, Fedkiw 2004). Springs along no edge of a triangle are taken
 * away where the blade passed through them.
 *
 * Of tetrahedra the edges that the blade crosses are divided in the same way, and faces between points on its way open once one of their corners
 * parts: at the latest when a tetrahedron's last edge is crossed. What was inside is drawn from then on. A body of springs alone loses those
 * that the blade passed through.
 *
 * A sweep that begins just where the last of the body ended goes on with it: it begins where the tissue that the blade stood in has gone
 * meanwhile. A blade that stays in tissue that moves so leaves no bridges.
 *
 * Nodes keep their numbers, and new ones are numbered on: copies, which move as what they copied moved, and points of the surface between nodes,
 * which have no mass and go where their nodes go. Mass, momentum and energy stay what they were. What holds a node holds it where it is
 * drawn; copies of it beyond the cut are free, and have the mass of their material in the mean where it had none. It takes as long as the cut is
 * large, but with NEWTON, which is made anew. Positions and triangles that were lent before are stale; sinew_body_get_topology_changes tells what has changed.
 *
 * Terms beside springs go on in parts: home springs with those of the nodes' masses, what goes by springs with those, fibres with the tetrahedra, and hinges of
 * bending by area, where pieces of both triangles still share the edge. A hinge whose edge is cut along is gone, with its energy, and so is what a cavity had that is cut open.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID, SINEW_STATUS_UNSUPPORTED (spare_nodes was 0), SINEW_STATUS_CAPACITY (there are
 * not as many spare nodes left, or FAST_LINK: a node has no free place), SINEW_STATUS_OUT_OF_MEMORY; then nothing has changed.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; the arrays are NULL or as long as stated; `report` is NULL or writable for the size that it
 * states.
 */
sinew_status sinew_body_cut(struct sinew_world *world,
                            struct sinew_body_id body,
                            const float *start,
                            const float *end,
                            struct sinew_cut_report *report);

/**
 * Writes what has changed since a version of a body's topology: 0 when it was made, and what was told as `version` the last time.
 * `out->struct_size` is set by the caller. Nothing is copied, but for bodies that were not cut the lists are empty.
 *
 * A renderer that follows gives each new node what its sources carry, by their weights, and reads the triangles that are named again.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where the version is to come), SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `out` is NULL or writable for the size that it states.
 */
sinew_status sinew_body_get_topology_changes(const struct sinew_world *world,
                                             struct sinew_body_id body,
                                             uint64_t since_version,
                                             struct sinew_topology_changes *out);

/**
 * Writes a view of the triangles that are drawn and touched: those of the definition, or the boundary of its tetrahedra or cells, as cuts have
 * changed them. Nothing is copied.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `out` is NULL or writable.
 */
sinew_status sinew_body_get_triangles(const struct sinew_world *world,
                                      struct sinew_body_id body,
                                      struct sinew_triangle_view *out);

/**
 * Writes which piece each node belongs to, from 0 on, and how many there are: nodes hang together by springs, elements and the surface.
 * `pieces` are `count` numbers, as many as the body has nodes; nullable, as `piece_count` is. All nodes are looked at.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where `count` is not the body's), SINEW_STATUS_STALE_ID, SINEW_STATUS_OUT_OF_MEMORY.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `pieces` is NULL or as long as stated, `piece_count` NULL or writable.
 */
sinew_status sinew_body_get_pieces(const struct sinew_world *world,
                                   struct sinew_body_id body,
                                   uint32_t *pieces,
                                   size_t count,
                                   uint32_t *piece_count);

/**
 * Writes the mass of a node, kg: 0 of one that is pinned for good, or bound to others.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `out` is NULL or writable.
 */
sinew_status sinew_body_get_node_mass(const struct sinew_world *world,
                                      struct sinew_body_id body,
                                      uint32_t node,
                                      float *out);

/**
 * Writes what tore in the last step of a body, and what did not. `out->struct_size` is set by the caller.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `out` is NULL or writable for the size that it states.
 */
sinew_status sinew_body_get_tear_report(const struct sinew_world *world,
                                        struct sinew_body_id body,
                                        struct sinew_tear_report *out);

/**
 * Gives the springs of `count` pairs of nodes, or edges of elements, other limits than tear_strain and tear_force of the definition: `pairs` are 2 `count` indices,
 * `strains` and `forces`, N, `count` floats each, at least 0, 0: any; NULL: they stay. Springs that are added later have none until they are given
 * some. Of a pair that is named more than once the last counts.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where a pair has neither), SINEW_STATUS_STALE_ID, SINEW_STATUS_UNSUPPORTED (most_tears was 0),
 * SINEW_STATUS_OUT_OF_MEMORY; then no limit is changed.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; the arrays are NULL or as long as stated.
 */
sinew_status sinew_body_set_tear_limits(struct sinew_world *world,
                                        struct sinew_body_id body,
                                        const uint32_t *pairs,
                                        size_t count,
                                        const float *strains,
                                        const float *forces);

/**
 * Writes the strain L/L0 - 1 of `count` pairs of nodes, 0 where L0 is 0: `pairs` are 2 `count` indices, `rest_lengths` `count` floats,
 * m, NULL: those of the springs that the pairs have (which takes longer), `strains` `count` floats.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where a pair has no spring and `rest_lengths` is NULL), SINEW_STATUS_STALE_ID,
 * SINEW_STATUS_OUT_OF_MEMORY.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; the arrays are NULL or as long as stated, and do not overlap.
 */
sinew_status sinew_body_get_spring_strains(const struct sinew_world *world,
                                           struct sinew_body_id body,
                                           const uint32_t *pairs,
                                           const float *rest_lengths,
                                           size_t count,
                                           float *strains);

/**
 * Writes the strain of `triangle_count` triangles of a body's nodes, any, such as those of its surface: `rest_positions` are 3
 * `node_count` floats, m, where its nodes are at rest, or were when strain is to be counted from; `triangles` 3 `triangle_count`
 * indices.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where `node_count` is not the body's), SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; the arrays are NULL or as long as stated, and do not overlap.
 */
sinew_status sinew_body_get_triangle_strains(const struct sinew_world *world,
                                             struct sinew_body_id body,
                                             const float *rest_positions,
                                             size_t node_count,
                                             const uint32_t *triangles,
                                             size_t triangle_count,
                                             struct sinew_strain *strains);

/**
 * Writes the strain of `tetrahedron_count` tetrahedra of a body's nodes, any: `rest_positions` as for sinew_body_get_triangle_strains,
 * `tetrahedra` 4 `tetrahedron_count` indices.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where `node_count` is not the body's), SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; the arrays are NULL or as long as stated, and do not overlap.
 */
sinew_status sinew_body_get_tetrahedron_strains(const struct sinew_world *world,
                                                struct sinew_body_id body,
                                                const float *rest_positions,
                                                size_t node_count,
                                                const uint32_t *tetrahedra,
                                                size_t tetrahedron_count,
                                                struct sinew_strain *strains);

/**
 * Writes for each of `node_count` nodes the mean of the values of its elements, 0 where it has none, as to draw strain with
 * sinew_world_save_picture_of_values: `elements` are `corners` `element_count` node indices, `corners` 2, 3 or 4, `values`
 * `element_count` floats, finite, `means` `node_count` floats.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_OUT_OF_MEMORY.
 *
 * # Safety
 * The arrays are NULL or as long as stated, and do not overlap.
 */
sinew_status sinew_mean_at_nodes(const uint32_t *elements,
                                 uint32_t corners,
                                 const float *values,
                                 size_t element_count,
                                 float *means,
                                 size_t node_count);

/**
 * Writes what part of a body's nodes is awake, 0 to 1: stepped. 1 for a body that never sleeps, 0 where all of it is at rest, and a step
 * costs next to nothing.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `out` is NULL or writable.
 */
sinew_status sinew_body_get_awake_share(const struct sinew_world *world,
                                        struct sinew_body_id body,
                                        float *out);

/**
 * Has all of a body be stepped again, until it has been at rest for as long as it takes: whatever reaches it does so by itself.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses.
 */
sinew_status sinew_body_wake(struct sinew_world *world,
                             struct sinew_body_id body);

/**
 * Writes the energy of a body. `out->struct_size` is set by the caller.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `out` is NULL or writable for the size that it states.
 */
sinew_status sinew_body_get_energy(const struct sinew_world *world,
                                   struct sinew_body_id body,
                                   struct sinew_energy *out);

/**
 * Writes how much memory the springs of a body take. `out->struct_size` is set by the caller.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `out` is NULL or writable for the size that it states.
 */
sinew_status sinew_body_get_storage_report(const struct sinew_world *world,
                                           struct sinew_body_id body,
                                           struct sinew_storage_report *out);

/**
 * Writes how a body's solver took the last step. `out->struct_size` is set by the caller.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `out` is NULL or writable for the size that it states.
 */
sinew_status sinew_body_get_solver_report(const struct sinew_world *world,
                                          struct sinew_body_id body,
                                          struct sinew_solver_report *out);

/**
 * Writes what a body encloses. `out->struct_size` is set by the caller.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `out` is NULL or writable for the size that it states.
 */
sinew_status sinew_body_get_enclosed_report(const struct sinew_world *world,
                                            struct sinew_body_id body,
                                            struct sinew_enclosed_report *out);

/**
 * Writes the figures of a tissue, `preset` being a SINEW_PRESET_...; they are numbered from 0 without a gap. Its texts are
 * static. `out->struct_size` is set by the caller.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT.
 *
 * # Safety
 * `out` is NULL or writable for the size that it states.
 */
sinew_status sinew_material_get_preset(uint32_t preset,
                                       struct sinew_material_preset *out);

/**
 * Fills `def` with the defaults. `struct_size` is sizeof(sinew_rest_state_def).
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT.
 *
 * # Safety
 * `def` is NULL or writable for `struct_size` bytes.
 */
sinew_status sinew_rest_state_def_init(struct sinew_rest_state_def *def, size_t struct_size);

/**
 * Moves the free nodes of a body, whatever its solver, to the nearest place downhill where it is at rest under gravity, its
 * pins where they are, and the forces applied since the last step, which stay pending. Velocities become zero, and
 * sinew_body_get_pin_force tells what holds the pins there. Views of the body's positions and velocities end. It is no step: it takes memory and may take seconds. Tools are not
 * taken into account. How a part that no pin holds lies and is turned as a whole is as it happens to be. `def` is nullable: the
 * defaults; `report` is nullable; `report->struct_size` is set by the caller.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where a part is pulled by a net force along an axis along which no pin holds it, and
 * so has no state of rest), SINEW_STATUS_STALE_ID, SINEW_STATUS_UNSTABLE (not found in the iterations allowed), SINEW_STATUS_OUT_OF_MEMORY; nothing
 * has changed then.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; `def` is NULL or a definition of the size that it states; `report` is NULL or
 * writable for the size that it states.
 */
sinew_status sinew_body_rest_state(struct sinew_world *world,
                                   struct sinew_body_id body,
                                   const struct sinew_rest_state_def *def,
                                   struct sinew_rest_state_report *report);

/**
 * Fills `def` with the defaults. `struct_size` is sizeof(sinew_tool_def).
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT.
 *
 * # Safety
 * `def` is NULL or writable for `struct_size` bytes.
 */
sinew_status sinew_tool_def_init(struct sinew_tool_def *def, size_t struct_size);

/**
 * Creates a tool; copies what `def` points to.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_UNSUPPORTED (DISTANCE_FIELD of a shape that is no mesh, IMAGE_SPACE of a plane),
 * SINEW_STATUS_OUT_OF_MEMORY.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; `def` is NULL or a definition of the size that it states, with arrays of
 * the lengths that it states; `out` is NULL or writable.
 */
sinew_status sinew_tool_create(struct sinew_world *world,
                               const struct sinew_tool_def *def,
                               struct sinew_tool_id *out);

/**
 * Destroys a tool. What is attached to it is let go.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses.
 */
sinew_status sinew_tool_destroy(struct sinew_world *world, struct sinew_tool_id tool);

/**
 * Moves a tool to `position`, 3 floats, m, over the next step, and turns it to `orientation`, x y z w, which may be
 * NULL: as it is. It goes straight and turns the shorter way, both evenly; tissue gives way. What of its way a tool of limited force has
 * not gone in that step is forgotten: it is sent again.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where a coordinate is further than 1e9 m from 0, the orientation is zero, or a haptic handle leads the
 * tool), SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; `position` is NULL or 3 floats, `orientation` NULL or 4.
 */
sinew_status sinew_tool_set_pose(struct sinew_world *world,
                                 struct sinew_tool_id tool,
                                 const float *position,
                                 const float *orientation);

/**
 * Gives a tool this Coulomb coefficient of friction, at least 0, from the next step on.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses.
 */
sinew_status sinew_tool_set_friction(struct sinew_world *world,
                                     struct sinew_tool_id tool,
                                     float friction);

/**
 * Has `force_limit`, N, at least 0 or infinity, be the largest force that moves a tool, from the next step on: see sinew_tool_def.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses.
 */
sinew_status sinew_tool_set_force_limit(struct sinew_world *world,
                                        struct sinew_tool_id tool,
                                        float force_limit);

/**
 * Has a tool be of these categories and meet those of `mask`, a bit for each, from the next step on: see sinew_tool_def. With mask 0 it
 * meets nothing; tissue that lies within it when it meets it again is pushed out.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses.
 */
sinew_status sinew_tool_set_collision(struct sinew_world *world,
                                      struct sinew_tool_id tool,
                                      uint32_t category,
                                      uint32_t mask);

/**
 * Writes where a tool is: its position, 3 floats, m, and its orientation, 4 floats, x y z w; either may be NULL. Where its force is
 * limited it may have stopped short of where it was sent.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `position` is NULL or writable for 3 floats, `orientation` for 4.
 */
sinew_status sinew_tool_get_pose(const struct sinew_world *world,
                                 struct sinew_tool_id tool,
                                 float *position,
                                 float *orientation);

/**
 * Writes where the last step led a tool: where it is, but for one of limited force. Either may be NULL, as for sinew_tool_get_pose. Sent there by
 * sinew_tool_set_pose step by step, it does the same in another world: so what a haptic handle did can be taken down and done again.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `position` is NULL or writable for 3 floats, `orientation` for 4.
 */
sinew_status sinew_tool_get_target(const struct sinew_world *world,
                                   struct sinew_tool_id tool,
                                   float *position,
                                   float *orientation);

/**
 * Writes the force, 3 floats, N, and the torque about its position, 3 floats, N m, on a tool: world axes, mean over the
 * last step.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `force` and `torque` are NULL or writable for 3 floats.
 */
sinew_status sinew_tool_get_wrench(const struct sinew_world *world,
                                   struct sinew_tool_id tool,
                                   float *force,
                                   float *torque);

/**
 * Writes where the tool pressed bodies when the last step ended, `capacity` of them at most, to `contacts`, which may be NULL where
 * that is 0, and how many there are to `count`.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `contacts` is NULL or writable for `capacity` of them; `count` is NULL or writable.
 */
sinew_status sinew_tool_get_contacts(const struct sinew_world *world,
                                     struct sinew_tool_id tool,
                                     struct sinew_contact *contacts,
                                     size_t capacity,
                                     size_t *count);

/**
 * Writes which tools and bodies began or ceased to touch in the last step, `capacity` of them at most, to `changes`, which may be NULL
 * where that is 0, and how many there are to `count`. With a tool or body that was destroyed nothing ceases.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `changes` is NULL or writable for `capacity` of them; `count` is NULL or writable.
 */
sinew_status sinew_world_get_contact_changes(const struct sinew_world *world,
                                             struct sinew_contact_change *changes,
                                             size_t capacity,
                                             size_t *count);

/**
 * Attaches a node of a body to a tool, as sinew_body_attach_nodes does.
 *
 * Errors: as there.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; `out` is NULL or writable.
 */
sinew_status sinew_body_attach_node(struct sinew_world *world,
                                    struct sinew_body_id body,
                                    uint32_t node,
                                    struct sinew_tool_id tool,
                                    float force_limit,
                                    struct sinew_attachment_id *out);

/**
 * Attaches `count` nodes of a body to a tool, each by an attachment of its own, whose ids are written to `out`: where they lie
 * they become part of the tool, which carries them along and turns them, exactly and whatever the solver, until
 * sinew_attachment_release. Their velocities become the tool's in the next step.
 *
 * What it takes to hold them, with their mass and what damps them, is part of the tool's wrench. The tool does not touch
 * them any more, nor edges and faces that have one of them. `force_limit`, N: an attachment ends with the step in which its
 * mean force was larger, and the node goes on as it was led (sinew_world_get_slipped); 0 or infinity: it holds whatever
 * comes.
 *
 * An attached node cannot be pinned. Its position can be set: then it is attached where it was put. One tool may hold a node
 * more than once; then each attachment has its share of the force. An attachment ends with its body and with its tool.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where a node is pinned, without mass or held by another tool),
 * SINEW_STATUS_STALE_ID, SINEW_STATUS_OUT_OF_MEMORY; then nothing is attached.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; the arrays are NULL or as long as stated.
 */
sinew_status sinew_body_attach_nodes(struct sinew_world *world,
                                     struct sinew_body_id body,
                                     const uint32_t *nodes,
                                     size_t count,
                                     struct sinew_tool_id tool,
                                     float force_limit,
                                     struct sinew_attachment_id *out);

/**
 * Attaches `count` points of a body's surface to a tool, each by an attachment of its own, whose ids are written to `out`.
 * `triangles` are their triangles' numbers: of those that the body was created with, or of the boundary of its tetrahedra or
 * cells; `weights` are 3 `count` parts of corners, at least 0 and 1 in sum.
 *
 * It is sinew_body_attach_nodes for the corners of each point's triangle, but those whose weight is 0. So the patch about the
 * point is bonded to the tool, and does not turn against it; a point on an edge holds the edge, one in a corner the node. An
 * attachment's force is that on all its corners. Points whose triangles share corners share what holds those, by their
 * weights.
 *
 * Errors: as there; SINEW_STATUS_INVALID_ARGUMENT also where there is no such triangle or weights are not as above.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; the arrays are NULL or as long as stated.
 */
sinew_status sinew_body_attach_points(struct sinew_world *world,
                                      struct sinew_body_id body,
                                      const uint32_t *triangles,
                                      const float *weights,
                                      size_t count,
                                      struct sinew_tool_id tool,
                                      float force_limit,
                                      struct sinew_attachment_id *out);

/**
 * Attaches `count` nodes of a body to as many nodes of another, or of the same, each pair by an attachment of its own, whose ids
 * are written to `out`. From the next step on the two are one point, whatever the solvers of the bodies; what is apart comes
 * together within some hundredths of a second, and no faster than at 0.25 m/s, however far that is. Each body may turn about the
 * point as it likes: what shall not turn takes three.
 *
 * The bodies take their substeps together, those of IMPLICIT and NEWTON of 0.25 ms at most. No momentum is made; nor is any angular
 * momentum, once the points have come together. Where both points are held by pins or tools along an axis nothing is done
 * along it. Nodes, edges and faces that share such a pair of points do not touch each other.
 *
 * `force_limit`, N: an attachment ends with the step in which its mean force was larger (sinew_world_get_slipped); 0 or infinity:
 * it holds whatever comes. sinew_attachment_get_force has the force on `body`; sinew_attachment_release lets go. An attachment
 * ends with either body.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where the two are one node), SINEW_STATUS_STALE_ID, SINEW_STATUS_OUT_OF_MEMORY;
 * then nothing is attached.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; the arrays are NULL or as long as stated.
 */
sinew_status sinew_body_attach_nodes_to_nodes(struct sinew_world *world,
                                              struct sinew_body_id body,
                                              const uint32_t *nodes,
                                              size_t count,
                                              struct sinew_body_id other,
                                              const uint32_t *other_nodes,
                                              float force_limit,
                                              struct sinew_attachment_id *out);

/**
 * Attaches `count` nodes of a body to as many points of the surface of another, or of the same, as sinew_body_attach_nodes_to_nodes
 * does. Points are given as to sinew_body_attach_points, and no patch is bonded: the surface may turn about the point.
 *
 * Errors: as there; SINEW_STATUS_INVALID_ARGUMENT also where there is no such triangle or weights are not at least 0 and 1 in sum.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; the arrays are NULL or as long as stated.
 */
sinew_status sinew_body_attach_nodes_to_points(struct sinew_world *world,
                                               struct sinew_body_id body,
                                               const uint32_t *nodes,
                                               size_t count,
                                               struct sinew_body_id other,
                                               const uint32_t *other_triangles,
                                               const float *other_weights,
                                               float force_limit,
                                               struct sinew_attachment_id *out);

/**
 * Attaches `count` points of the surface of a body to as many points of that of another, or of the same, as
 * sinew_body_attach_nodes_to_points does.
 *
 * Errors: as there.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; the arrays are NULL or as long as stated.
 */
sinew_status sinew_body_attach_points_to_points(struct sinew_world *world,
                                                struct sinew_body_id body,
                                                const uint32_t *triangles,
                                                const float *weights,
                                                size_t count,
                                                struct sinew_body_id other,
                                                const uint32_t *other_triangles,
                                                const float *other_weights,
                                                float force_limit,
                                                struct sinew_attachment_id *out);

/**
 * Lets go of what is attached: it goes on as it was led in the last step.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID (also where it slipped, or a body or the tool is gone).
 *
 * # Safety
 * `world` is NULL or a world nobody else uses.
 */
sinew_status sinew_attachment_release(struct sinew_world *world,
                                      struct sinew_attachment_id attachment);

/**
 * Writes the force by which what it is attached to, a tool or a body, holds a body, on the tissue, 3 floats, N: world axes, mean
 * over the last step; 0 before the first. After sinew_body_rest_state it is that by which a tool holds the body at rest.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `force` is NULL or writable for 3 floats.
 */
sinew_status sinew_attachment_get_force(const struct sinew_world *world,
                                        struct sinew_attachment_id attachment,
                                        float *force);

/**
 * Writes to `count` how many attachments ended with the last step because it took more to hold them than their limit, and to
 * `out`, which has room for `capacity` and may be NULL where that is 0, the first of their ids. They are stale: to be
 * compared with those that were kept.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `out` is NULL or as long as stated; `count` is NULL or writable.
 */
sinew_status sinew_world_get_slipped(const struct sinew_world *world,
                                     struct sinew_attachment_id *out,
                                     size_t capacity,
                                     size_t *count);

/**
 * Writes the force, 3 floats, N, on `count` tools together, and the torque about `point`, 3 floats, m, 3 floats, N m: world
 * axes, mean over the last step. Of the two jaws of a forceps, say.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where a tool is named more than once), SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `tools` is NULL or as long as stated, `point` NULL or 3 floats; `force` and
 * `torque` are NULL or writable for 3 floats.
 */
sinew_status sinew_tools_get_wrench(const struct sinew_world *world,
                                    const struct sinew_tool_id *tools,
                                    size_t count,
                                    const float *point,
                                    float *force,
                                    float *torque);

/**
 * Fills `def` with the defaults. `struct_size` is sizeof(sinew_suture_def).
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT.
 *
 * # Safety
 * `def` is NULL or writable for `struct_size` bytes.
 */
sinew_status sinew_suture_def_init(struct sinew_suture_def *def, size_t struct_size);

/**
 * Sutures a point of the surface of a body to one of another, or of the same: a thread between them, which pulls them together where
 * they are further apart than it is long, and never pushes. Each may turn about its point as it likes. What the thread joins still
 * touches. A point is a triangle's number, as to sinew_body_attach_points, and 3 parts of its corners, at least 0 and 1 in sum.
 *
 * It is one of the attachments, with the id written to `out`: sinew_attachment_release cuts it, sinew_attachment_get_force has
 * the force on `body`, and one that is pulled through the tissue is among those of sinew_world_get_slipped: with the step in which
 * its mean force was larger than the definition's force_limit. It ends with either body. The bodies take their substeps together,
 * as with sinew_body_attach_points_to_points; no stiffness makes them shorter.
 *
 * A thread that is to be shorter than its points are apart is drawn in as with sinew_suture_set_length. No momentum is made; nor is
 * any angular momentum, unless points of a thread of next to no length pass each other. Nor is energy, but by drawing it in; what takes up
 * a thread that becomes taut within a substep is lost, as is some of what sways along a stiff one. `def` is nullable: the defaults.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where the two are one point), SINEW_STATUS_STALE_ID, SINEW_STATUS_OUT_OF_MEMORY;
 * then nothing is sutured.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; `weights` and `other_weights` are NULL or 3 floats; `def` is NULL or a definition of the
 * size that it states; `out` is NULL or writable.
 */
sinew_status sinew_body_suture_points(struct sinew_world *world,
                                      struct sinew_body_id body,
                                      uint32_t triangle,
                                      const float *weights,
                                      struct sinew_body_id other,
                                      uint32_t other_triangle,
                                      const float *other_weights,
                                      const struct sinew_suture_def *def,
                                      struct sinew_attachment_id *out);

/**
 * Tightens a suture, or gives it slack: its thread becomes so long, m, at least 0, evenly over the next step; where it is to become
 * shorter no faster than by 0.25 m/s, over as many steps as that takes.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where the attachment is no suture), SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses.
 */
sinew_status sinew_suture_set_length(struct sinew_world *world,
                                     struct sinew_attachment_id suture,
                                     float length);

/**
 * Writes how a suture is now; `report->struct_size` is set by the caller.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where the attachment is no suture), SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `report` is NULL or writable for the size that it states.
 */
sinew_status sinew_suture_get_report(const struct sinew_world *world,
                                     struct sinew_attachment_id suture,
                                     struct sinew_suture_report *report);

/**
 * Fills `def` with the defaults. `struct_size` is sizeof(sinew_blade_def).
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT.
 *
 * # Safety
 * `def` is NULL or writable for `struct_size` bytes.
 */
sinew_status sinew_blade_def_init(struct sinew_blade_def *def, size_t struct_size);

/**
 * Creates a blade: an edge that is moved by its pose, as tools are, cuts the bodies made for it (their definition's spare_nodes) as
 * sinew_body_cut does, and feels their toughness. It is an edge alone: what has a body needs a tool beside it.
 *
 * Tissue that the edge meets gives way until the edge is so far ahead, on the spring of the definition's stiffness, that this pulls as hard as the
 * tissue resists: by its toughness for each metre that is cut, at rest. From then on its proxy follows, at the end of each step, as far as
 * keeps both equal; so the work of the blade is the toughness times the length that is cut, or the area in solids, and what the spring stores (Mahvash,
 * Hayward 2001).
 * What pulls at the tissue through a step is what the blade feels: momentum is kept. An edge that goes along itself meets nothing, nor
 * does one that goes back through its cut.
 *
 * The cut is made where the proxy went, by a fifth of a triangle's shortest edge at a time and to its end where it leaves the tissue; so a triangle that
 * is passed through takes some ten spare_nodes. Tissue of toughness 0 is cut with each step, just where the edge went. Where a cut fails the
 * proxy stays and pulls on, as hard as the tissue resisted: the report's status tells; the step itself succeeds.
 *
 * Tissue that moves onto an edge is cut as if that had moved; a turn is followed in parts of half a radian.
 *
 * A body that a blade stands in takes its substeps as one that is attached does. A step in which a blade goes through tissue may allocate.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_OUT_OF_MEMORY.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; `def` is NULL or a definition of the size that it states; `out` is NULL or writable.
 */
sinew_status sinew_blade_create(struct sinew_world *world,
                                const struct sinew_blade_def *def,
                                struct sinew_blade_id *out);

/**
 * Destroys a blade. What it has cut stays.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses.
 */
sinew_status sinew_blade_destroy(struct sinew_world *world, struct sinew_blade_id blade);

/**
 * Moves a blade to `position`, 3 floats, m, over the next step, and turns it to `orientation`, x y z w, which may be NULL: as it is. It goes
 * straight and evenly.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where a coordinate is further than 1e9 m from 0 or the orientation is zero),
 * SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; `position` is NULL or 3 floats, `orientation` NULL or 4.
 */
sinew_status sinew_blade_set_pose(struct sinew_world *world,
                                  struct sinew_blade_id blade,
                                  const float *position,
                                  const float *orientation);

/**
 * Writes what a blade did and felt in the last step. `out->struct_size` is set by the caller.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `out` is NULL or writable for the size that it states.
 */
sinew_status sinew_blade_get_report(const struct sinew_world *world,
                                    struct sinew_blade_id blade,
                                    struct sinew_blade_report *out);

/**
 * Fills `def` with the defaults. `struct_size` is sizeof(sinew_haptic_def).
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT.
 *
 * # Safety
 * `def` is NULL or writable for `struct_size` bytes.
 */
sinew_status sinew_haptic_def_init(struct sinew_haptic_def *def, size_t struct_size);

/**
 * Lets a device lead a tool through a handle, which the caller destroys with sinew_haptic_destroy. The tool should be where the device is: the
 * first step leads it there. As long as there is the handle, sinew_tool_set_pose of the tool is refused: each step leads it to where the handle's
 * proxy was last, as sinew_tool_get_target tells. Each step costs the handle some microseconds.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where another handle leads the tool), SINEW_STATUS_STALE_ID, SINEW_STATUS_OUT_OF_MEMORY.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; `def` is NULL or a definition of the size that it states; `out` is NULL or writable.
 */
sinew_status sinew_haptic_create(struct sinew_world *world,
                                 const struct sinew_haptic_def *def,
                                 struct sinew_haptic **out);

/**
 * Destroys a handle, before its world or after. The tool is the world's again. NULL: nothing.
 *
 * # Safety
 * `haptic` is NULL or a handle that is not destroyed and that nobody uses any more.
 */
void sinew_haptic_destroy(struct sinew_haptic *haptic);

/**
 * Takes where the device is, 3 floats, m, and how it is turned, x y z w, `dt` seconds after the last tick, above 0 and at most 1, and writes what it
 * is to feel until the next. `orientation` may be NULL: as it was, at first as the tool. `velocity`, m/s, and `angular_velocity`, rad/s, 3 floats each,
 * world axes, may be NULL: as its way since the last tick says. `out->struct_size` is set by the caller.
 *
 * It waits for nothing, takes no lock and allocates nothing, whatever other threads do with the world. It takes some microseconds.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT: `out` is as it was, and the device should be given no force.
 *
 * # Safety
 * `haptic` is NULL or a handle nobody else uses; `position` is NULL or 3 floats, `orientation` NULL or 4, `velocity` and `angular_velocity` NULL or
 * 3; `out` is NULL or writable for the size that it states.
 */
sinew_status sinew_haptic_tick(struct sinew_haptic *haptic,
                               const float *position,
                               const float *orientation,
                               const float *velocity,
                               const float *angular_velocity,
                               float dt,
                               struct sinew_haptic_result *out);

/**
 * Writes the contacts of the tool as the model was made that the last tick used, up to `capacity`, and how many there are in all to `count`: at most
 * 32, of more the most pressed. `contacts` may be NULL with a capacity of 0. As sinew_haptic_tick it waits for nothing.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT.
 *
 * # Safety
 * `haptic` is NULL or a handle nobody else uses; `contacts` is NULL or writable for `capacity` contacts; `count` is NULL or writable.
 */
sinew_status sinew_haptic_get_contacts(const struct sinew_haptic *haptic,
                                       struct sinew_haptic_contact *contacts,
                                       size_t capacity,
                                       size_t *count);

/**
 * Reads a mesh from a file and makes it tidy: corners that lie together become one node, collapsed and doubled elements
 * and points that nothing uses are dropped, tetrahedra that are inside out are turned; the view counts it all. `path` is
 * UTF-8, `format` a SINEW_MESH_FORMAT_..., `scale` what one unit of the file is in m, above 0. The caller destroys the mesh
 * with sinew_mesh_destroy.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT; SINEW_STATUS_IO (missing, cut short, malformed, of another format, with indices
 * out of range or numbers that are not finite: the message names the line or byte); SINEW_STATUS_OUT_OF_MEMORY.
 *
 * # Safety
 * `path` is NULL or ends with NUL; `out` is NULL or writable.
 */
sinew_status sinew_mesh_load(const char *path,
                             uint32_t format,
                             float scale,
                             struct sinew_mesh **out);

/**
 * Makes a cloth in the plane y = 0 about the origin, up outward: `size` are its 2 extents along x and z, m, above 0,
 * `cells` its 2 numbers of cells, at least 1, of two triangles each. The caller destroys it with sinew_mesh_destroy.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_OUT_OF_MEMORY.
 *
 * # Safety
 * `size` is NULL or 2 floats, `cells` NULL or 2 numbers; `out` is NULL or writable.
 */
sinew_status sinew_mesh_create_cloth(const float *size,
                                     const uint32_t *cells,
                                     struct sinew_mesh **out);

/**
 * Makes a block of tetrahedra about the origin: `size` are its 3 extents, m, above 0, `cells` its 3 numbers of cells, at
 * least 1. The caller destroys it with sinew_mesh_destroy.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_OUT_OF_MEMORY.
 *
 * # Safety
 * `size` is NULL or 3 floats, `cells` NULL or 3 numbers; `out` is NULL or writable.
 */
sinew_status sinew_mesh_create_block(const float *size,
                                     const uint32_t *cells,
                                     struct sinew_mesh **out);

/**
 * Makes a lattice of cubes about the origin: `edge` is the length of theirs, m, above 0, `cells` their 3 numbers along the axes,
 * at least 1. The caller destroys it with sinew_mesh_destroy.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_OUT_OF_MEMORY.
 *
 * # Safety
 * `cells` is NULL or 3 numbers; `out` is NULL or writable.
 */
sinew_status sinew_mesh_create_lattice(float edge,
                                       const uint32_t *cells,
                                       struct sinew_mesh **out);

/**
 * Makes an organ, liver-like, of tetrahedra about the origin: `length` is its longest extent, along x, and `spacing` that
 * of its nodes, both m, above 0. Thin in y. The caller destroys it with sinew_mesh_destroy.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_OUT_OF_MEMORY.
 *
 * # Safety
 * `out` is NULL or writable.
 */
sinew_status sinew_mesh_create_organ(float length,
                                     float spacing,
                                     struct sinew_mesh **out);

/**
 * Writes a view of what a mesh holds; nothing is copied, all is valid until the mesh's end. `out->struct_size` is set by
 * the caller.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT.
 *
 * # Safety
 * `mesh` is NULL or a mesh that is not destroyed; `out` is NULL or writable for the size that it states.
 */
sinew_status sinew_mesh_get_view(const struct sinew_mesh *mesh,
                                 struct sinew_mesh_view *out);

/**
 * Destroys a mesh. NULL: nothing.
 *
 * # Safety
 * `mesh` is NULL or a mesh that is not destroyed and that nobody uses any more.
 */
void sinew_mesh_destroy(struct sinew_mesh *mesh);

/**
 * Fills `def` with the defaults. `struct_size` is sizeof(sinew_picture_def).
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT.
 *
 * # Safety
 * `def` is NULL or writable for `struct_size` bytes.
 */
sinew_status sinew_picture_def_init(struct sinew_picture_def *def, size_t struct_size);

/**
 * Draws all bodies and tools into a PNG file: the surface of a body, or its springs where it has none. `def` may be NULL:
 * the defaults. `path` is UTF-8; a file that exists is replaced, once the whole picture is written.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_IO, SINEW_STATUS_OUT_OF_MEMORY, SINEW_STATUS_UNSUPPORTED (a library
 * built without pictures).
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `def` is NULL or a definition of the size that it states; `path` is NULL or
 * ends with NUL.
 */
sinew_status sinew_world_save_picture(const struct sinew_world *world,
                                      const struct sinew_picture_def *def,
                                      const char *path);

/**
 * The same with `count` bodies coloured by numbers, each body once; which numbers have which colours is in their `low` and `high`.
 *
 * Errors: those of sinew_world_save_picture, SINEW_STATUS_STALE_ID.
 *
 * # Safety
 * As for sinew_world_save_picture; `coloured` is NULL or as long as stated, with arrays of the lengths that they state.
 */
sinew_status sinew_world_save_picture_of_values(const struct sinew_world *world,
                                                const struct sinew_picture_def *def,
                                                const struct sinew_body_values *coloured,
                                                size_t count,
                                                const char *path);

/**
 * Writes the first point that a ray from `origin`, 3 floats, m, along `direction`, 3 floats of any length, meets on the surface of a
 * body within `max_distance`, m, at least 0, at the nodes' current places. `out->struct_size` is set by the caller; where nothing is
 * met out->body is all zero. What lies along a triangle does not meet it. Of equal distances the first body's lowest triangle is taken.
 * The first query near a body builds a tree over its surface, and the first after its nodes have moved refits it; others take a few us.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where the direction is zero), SINEW_STATUS_OUT_OF_MEMORY.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `origin` and `direction` are NULL or 3 floats; `out` is NULL or writable for
 * `out->struct_size` bytes.
 */
sinew_status sinew_world_cast_ray(const struct sinew_world *world,
                                  const float *origin,
                                  const float *direction,
                                  float max_distance,
                                  struct sinew_surface_point *out);

/**
 * Writes the point of the bodies' surfaces that is nearest to `point`, 3 floats, m, at the nodes' current places, no further than
 * `max_distance`, m, at least 0. `out->struct_size` is set by the caller; where there is none out->body is all zero. Of equal
 * distances the first body's lowest triangle is taken. It uses the same trees as sinew_world_cast_ray.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_OUT_OF_MEMORY.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `point` is NULL or 3 floats; `out` is NULL or writable for `out->struct_size` bytes.
 */
sinew_status sinew_world_find_nearest(const struct sinew_world *world,
                                      const float *point,
                                      float max_distance,
                                      struct sinew_surface_point *out);

/**
 * Creates a reader of a body, which the caller destroys with sinew_reader_destroy. No more than 126 of one body live at a time.
 *
 * Each step that moves the body shows it to its readers when it has been taken, and so does what moves or cuts it between steps, at once. A step
 * that is refused is never seen, nor one that is not complete. A body without readers takes no time or memory for them; one that has keeps two
 * copies of its positions more than it has readers, writes one of them each step, and copies its triangles when cuts or tears have changed them.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID, SINEW_STATUS_CAPACITY (126 readers), SINEW_STATUS_OUT_OF_MEMORY.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; `out` is NULL or writable.
 */
sinew_status sinew_reader_create(struct sinew_world *world,
                                 struct sinew_body_id body,
                                 struct sinew_reader **out);

/**
 * Destroys a reader, on any thread, before or after its body and its world. NULL: nothing.
 *
 * # Safety
 * `reader` is NULL or a reader that is not destroyed and that nobody uses any more.
 */
void sinew_reader_destroy(struct sinew_reader *reader);

/**
 * Writes the latest frame; `out->struct_size` is set by the caller. What the frame before pointed to ends. Nothing is copied, allocated or locked,
 * and nobody waits: it is the same frame again where there is none later.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT.
 *
 * # Safety
 * `reader` is NULL or a reader nobody else uses, whatever happens to the world; `out` is NULL or writable for the size that it states.
 */
sinew_status sinew_reader_read(struct sinew_reader *reader,
                               struct sinew_frame *out);

/**
 * Fills `def` with the defaults. `struct_size` is sizeof(sinew_detector_def).
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT.
 *
 * # Safety
 * `def` is NULL or writable for `struct_size` bytes.
 */
sinew_status sinew_detector_def_init(struct sinew_detector_def *def, size_t struct_size);

/**
 * Makes a detector for two bodies of a world, whether or not they meet each other there, and reserves its memory; nothing is looked for
 * yet. The caller destroys it with sinew_detector_destroy.
 *
 * The methods: Halic, Kockara, Bayrak, Rowe, Chen, section 2.1 (CInDeR), and Faure, Barbier, Allard, Falipou 2008 for volumes; EXACT: signed
 * distances by pseudonormals (Baerentzen, Aanaes 2005), from the closest of a tree of triangles.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also for one and the same body twice, a body without triangles, and two that are open or were cut
 * open; with EXACT for a closed one that is inside out, passes through itself, or has two nodes at the same place or a triangle along a line
 * where it is now), SINEW_STATUS_STALE_ID, SINEW_STATUS_UNSUPPORTED (SINEW_DETECTION_DISTANCE_FIELD), SINEW_STATUS_OUT_OF_MEMORY.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `def` is NULL or a definition of the size that it states; `out` is NULL or writable.
 */
sinew_status sinew_detector_create(const struct sinew_world *world,
                                   const struct sinew_detector_def *def,
                                   struct sinew_detector **out);

/**
 * Compares the two bodies where they are now: each is looked for in the other, where that is closed. Writes what was found to `report`,
 * whose struct_size is set by the caller; the lists are read with sinew_detector_get_points, sinew_detector_get_edges and
 * sinew_detector_get_gradient. In image space it allocates nothing, and takes a time linear in polygons and in the pixels covered.
 *
 * An open body gives edges alone in image space (and points with EXACT), and nothing is found within it. So it is with one that was cut open
 * since (sinew_body_is_closed): `report->closed` says so; where both were, nothing is found. Bodies are compared where they are: what passes
 * through a thin part between two calls is not seen. Whether a surface has come to pass through itself is not asked: EXACT is then not sure of
 * sides; in images a part that is inside out counts as outside.
 *
 * A world in which the two ids are of bodies with the same surfaces is as good as the one that the detector was made with.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where one of the bodies was destroyed, or has another surface, as in another world),
 * SINEW_STATUS_CAPACITY (a single ray passes more faces than `crossings`), SINEW_STATUS_OUT_OF_MEMORY (EXACT, which may allocate); then what
 * was found before stays.
 *
 * # Safety
 * `detector` is NULL or a detector nobody else uses; `world` is NULL or a world nobody changes; `report` is NULL or writable for the size
 * that it states.
 */
sinew_status sinew_detector_find(struct sinew_detector *detector,
                                 const struct sinew_world *world,
                                 struct sinew_detector_report *report);

/**
 * Writes where the nodes of a body that lie within the other are listed, in ascending order, those within a tetrahedral body and those on
 * no triangle among them, and how many there are: of the first body with `side` 0, of the second with 1. Empty before the first
 * sinew_detector_find, and with COUNTED; valid until the next, or the detector's end.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT.
 *
 * # Safety
 * `detector` is NULL or a detector nobody changes; `points` and `count` are NULL or writable.
 */
sinew_status sinew_detector_get_points(const struct sinew_detector *detector,
                                       uint32_t side,
                                       const struct sinew_point_inside **points,
                                       size_t *count);

/**
 * Writes where the parts of a body's edges that lie within the other are listed, by edge and along it, and how many there are: of the first
 * body with `side` 0, of the second with 1. Edges are those of the surface's triangles. Empty before the first sinew_detector_find; valid
 * until the next, or the detector's end.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT.
 *
 * # Safety
 * `detector` is NULL or a detector nobody changes; `edges` and `count` are NULL or writable.
 */
sinew_status sinew_detector_get_edges(const struct sinew_detector *detector,
                                      uint32_t side,
                                      const struct sinew_edge_inside **edges,
                                      size_t *count);

/**
 * Writes a view of how the volume changes with each node of a body, m^2, in the caller's order (Faure et al. 2008): of the first body with
 * `side` 0, of the second with 1. Moving nodes against it parts the bodies. Empty before the first sinew_detector_find, with COUNTED and EXACT,
 * and where one of the bodies is open: there is no volume then. Valid until the next sinew_detector_find, or the detector's end.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT.
 *
 * # Safety
 * `detector` is NULL or a detector nobody changes; `out` is NULL or writable.
 */
sinew_status sinew_detector_get_gradient(const struct sinew_detector *detector,
                                         uint32_t side,
                                         struct sinew_dvec3_view *out);

/**
 * Destroys a detector; what its lists and views show ends. NULL: nothing.
 *
 * # Safety
 * `detector` is NULL or a detector that is not destroyed and that nobody uses any more.
 */
void sinew_detector_destroy(struct sinew_detector *detector);

/**
 * Writes the defaults of the `struct_size` bytes that the caller compiled.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT.
 *
 * # Safety
 * `def` is NULL or writable for `struct_size` bytes.
 */
sinew_status sinew_embedding_def_init(struct sinew_embedding_def *def, size_t struct_size);

/**
 * Binds a fine surface to a body, where both are now, in a time as long as some hundred updates; copies what `def` points to. The caller destroys it
 * with sinew_embedding_destroy, before or after the body and its world. Of an affine motion of the body the surface takes part to within rounding,
 * where it is bound to tetrahedra.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where no tetrahedron has a volume, or nothing is drawn of the body), SINEW_STATUS_STALE_ID,
 * SINEW_STATUS_OUT_OF_MEMORY.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `def` is NULL or a definition of the size that it states, with arrays of the lengths that it states;
 * `out` is NULL or writable.
 */
sinew_status sinew_embedding_create(const struct sinew_world *world,
                                    struct sinew_body_id body,
                                    const struct sinew_embedding_def *def,
                                    struct sinew_embedding **out);

/**
 * Destroys an embedding; its views end. NULL: nothing.
 *
 * # Safety
 * `embedding` is NULL or an embedding that is not destroyed and that nobody uses any more.
 */
void sinew_embedding_destroy(struct sinew_embedding *embedding);

/**
 * Puts the vertices where the body is now, in the place where they are read. Nothing is allocated, but when the body has been cut or torn since:
 * then each vertex is bound to the copy on its side, and triangles that would reach across are left out of
 * sinew_embedding_get_triangles.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where the body has not the nodes that the vertices are bound to, as in a world that was saved before it was
 * cut), SINEW_STATUS_STALE_ID (the body is gone), SINEW_STATUS_OUT_OF_MEMORY, SINEW_STATUS_UNSUPPORTED (it has been cut or torn, and the vertices are
 * bound to the triangles of a body of tetrahedra, or not to all of the tetrahedra of which it was made). The vertices stay where they were then.
 *
 * # Safety
 * `embedding` is NULL or an embedding nobody else uses; `world` is NULL or the body's world, which nobody changes.
 */
sinew_status sinew_embedding_update(struct sinew_embedding *embedding,
                                    const struct sinew_world *world);

/**
 * The same with the body's nodes at `positions`, m, 3 node_count packed floats, such as a reader's frame has them: on any thread, whatever the world
 * does meanwhile.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also where the body had another number of nodes at the last sinew_embedding_update, which alone follows
 * cuts).
 *
 * # Safety
 * `embedding` is NULL or an embedding nobody else uses; `positions` is NULL or 3 `node_count` floats.
 */
sinew_status sinew_embedding_update_from(struct sinew_embedding *embedding,
                                         const float *positions,
                                         size_t node_count);

/**
 * Writes a view of where each vertex is, m, in the order given. It stays the same until the embedding's end; updates change what it shows.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT.
 *
 * # Safety
 * `embedding` is NULL or an embedding nobody changes; `out` is NULL or writable.
 */
sinew_status sinew_embedding_get_positions(const struct sinew_embedding *embedding,
                                           struct sinew_vec3_view *out);

/**
 * Writes a view of the triangles, in the order given, less those that reach across a cut. It changes with updates after cuts alone, and lives until then.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT.
 *
 * # Safety
 * `embedding` is NULL or an embedding nobody changes; `out` is NULL or writable.
 */
sinew_status sinew_embedding_get_triangles(const struct sinew_embedding *embedding,
                                           struct sinew_triangle_view *out);

/**
 * Works out the normals, where that was not done since the last update, and writes a view of them: of unit length, outward, the mean of a
 * vertex's triangles by area, 0 where that is 0; an empty view without triangles. The view lives like that of the positions.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT.
 *
 * # Safety
 * `embedding` is NULL or an embedding nobody else uses; `out` is NULL or writable.
 */
sinew_status sinew_embedding_get_normals(struct sinew_embedding *embedding,
                                         struct sinew_vec3_view *out);

/**
 * Makes a body of a closed surface, and binds the surface to it: tissue from what is drawn, in one call. `positions` and `triangles` of `def` are the
 * surface, outward, with vertices that may be repeated as in STL files; it is filled with tetrahedra whose edges are `spacing` metres long in the
 * mean (isosurface stuffing, Labelle and Shewchuk 2007), which are the nodes and elements of the body: its own surface follows the one given where that is
 * not finer than the spacing, and what is thinner than about half of it is lost. All else in `def` is as for sinew_body_create, with one value for
 * all nodes and springs. `out_embedding` is nullable; the caller destroys what it is given there.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (the surface is open or inside out; spacing is not above 0, too fine to count the nodes, or so coarse that
 * nothing is filled; tetrahedra, cells, springs, rest positions or lists of values are given), SINEW_STATUS_UNSUPPORTED as sinew_body_create,
 * SINEW_STATUS_CAPACITY, SINEW_STATUS_OUT_OF_MEMORY.
 *
 * # Safety
 * `world` is NULL or a world nobody else uses; `def` is NULL or a definition of the size that it states, with arrays of the lengths that it states;
 * `out_body` is NULL or writable, and so is `out_embedding`.
 */
sinew_status sinew_body_create_from_surface(struct sinew_world *world,
                                            const struct sinew_body_def *def,
                                            float spacing,
                                            struct sinew_body_id *out_body,
                                            struct sinew_embedding **out_embedding);

/**
 * How many bytes sinew_world_save_snapshot writes of the world as it is now.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_UNSUPPORTED (a haptic handle leads a tool; or more room is kept for what may come
 * than bytes can ask for).
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `out` is NULL or writable.
 */
sinew_status sinew_world_get_snapshot_size(const struct sinew_world *world,
                                           size_t *out);

/**
 * Writes the world as bytes, of which sinew_world_load_snapshot makes one that goes on just as this one does, to the bit: with bodies as
 * they were cut and torn, contacts, what is held and sewn, blades in mid stroke, forces applied for the next step, and ids, which name the
 * same things there. `size` is what sinew_world_get_snapshot_size tells. The bytes are the same for any number of threads.
 *
 * What is not of the world is not in them: threads, readers, detectors and embeddings, which are made again. They are for this version of
 * the library alone. A checksum tells whether they are as they were written, not who wrote them.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT (also another size), SINEW_STATUS_UNSUPPORTED as above.
 *
 * # Safety
 * `world` is NULL or a world nobody changes; `bytes` is NULL or as long as stated.
 */
sinew_status sinew_world_save_snapshot(const struct sinew_world *world,
                                       uint8_t *bytes,
                                       size_t size);

/**
 * Creates a world of the bytes that sinew_world_save_snapshot wrote, which the caller destroys with sinew_world_destroy. `thread_count`,
 * `run_tasks`, nullable, and `tasks_context` are as in sinew_world_def.
 *
 * It goes on to the bit where the processor offers the kernel that the world was stepped with; else SINEW_KERNEL_BEST is the best of this
 * one. What was cut short, has changed or never was a world is refused as a whole.
 *
 * Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_UNSUPPORTED (bytes of another version of the library; a thread could not be started,
 * or the processor does not offer the kernel that the world was created with), SINEW_STATUS_OUT_OF_MEMORY.
 *
 * # Safety
 * `bytes` is NULL or as long as stated; `run_tasks` is NULL or keeps its word, as long as the world lives; `out` is NULL or writable.
 */
sinew_status sinew_world_load_snapshot(const uint8_t *bytes,
                                       size_t size,
                                       uint32_t thread_count,
                                       sinew_run_tasks run_tasks,
                                       void *tasks_context,
                                       struct sinew_world **out);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* SINEW_H */
