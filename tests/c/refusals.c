/* Everything that the contract says is refused, tried on every function that can be given it. */
#include "refusals.h"

static const float fine[] = {0, 0, 0};

/* ---- worlds ---- */

static sinew_world_def good_world(void)
{
    sinew_world_def def;
    MUST(sinew_world_def_init(&def, sizeof def));
    return def;
}

#define WORLD(status, word, change)                                            \
    do {                                                                       \
        sinew_world_def def = good_world();                                    \
        change;                                                                \
        REFUSED_WITH(status, word, sinew_world_create(&def, &out.world), #change); \
    } while (0)

static void world_definitions(void)
{
    const sinew_world_def good = good_world();
    int i, axis;
    REFUSED(INVALID, "def", sinew_world_def_init(NULL, sizeof(sinew_world_def)));
    REFUSES_SIZES(sinew_world_def, sizeof(contract_world_def), (void)0, sinew_world_def_init(&out.world_def, size));
    REFUSED(INVALID, "def", sinew_world_create(NULL, &out.world));
    REFUSED(INVALID, "out", sinew_world_create(&good, NULL));
    REFUSES_SIZES(sinew_world_def, sizeof(contract_world_def), sinew_world_def def = good_world(); def.struct_size = size,
                  sinew_world_create(&def, &out.world));
    WORLD(INVALID, "reserved", def.reserved = 1);
    WORLD(INVALID, "kernel", def.kernel = 5);
    WORLD(INVALID, "kernel", def.kernel = UINT32_MAX);
    WORLD(INVALID, "max_substeps", def.max_substeps = 0);
    WORLD(INVALID, "thread_count", def.thread_count = 257);
    WORLD(INVALID, "thread_count", def.thread_count = UINT32_MAX);
    for (i = 0; i < OR_NEGATIVE; i++)
        WORLD(INVALID, "tolerance", def.tolerance = bad[i]);
    for (i = 0; i < NOT_FINITE; i++)
        for (axis = 0; axis < 3; axis++)
            WORLD(INVALID, "gravity", def.gravity[axis] = bad[i]);
}

static void world_calls(void)
{
    int i;
    size_t axis;
    REFUSED(INVALID, "world", sinew_world_step(NULL, 0.01f, &out.step));
    for (i = 0; i < OR_ZERO; i++) {
        REFUSED(INVALID, "dt", sinew_world_step(the.world, bad[i], &out.step));
        REFUSED(INVALID, "dt", sinew_world_step(the.world, bad[i], NULL));
    }
    REFUSED(INVALID, "dt", sinew_world_step(the.world, -0.0f, &out.step));
    REFUSES_RESULT_SIZES(sinew_step_report, sizeof(contract_step_report), step,
                         sinew_world_step(the.world, 0.01f, &out.step));

    REFUSED(INVALID, "world", sinew_world_set_gravity(NULL, fine));
    REFUSED(INVALID, "gravity", sinew_world_set_gravity(the.world, NULL));
    for (i = 0; i < NOT_FINITE; i++)
        for (axis = 0; axis < 3; axis++)
            REFUSED(INVALID, "gravity", sinew_world_set_gravity(the.world, spoiled(fine, 3, axis, bad[i])));

    REFUSED(INVALID, "world", sinew_world_get_state_hash(NULL, &out.hash));
    REFUSED(INVALID, "out", sinew_world_get_state_hash(the.world, NULL));
}

/* ---- bodies ---- */

static const float four_nodes[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
static const float four_masses[] = {0, 0.1f, 0.2f, 0.1f};
static const float four_dampings[] = {0, 0.1f, 0, 0};
static const uint32_t five_springs[] = {0, 1, 1, 2, 2, 3, 0, 2, 1, 3};
static const uint32_t doubled_springs[] = {0, 1, 1, 2, 2, 3, 0, 2, 0, 1};
static const uint32_t reversed_springs[] = {0, 1, 1, 2, 2, 3, 0, 2, 1, 0};
static const float five_stiffnesses[] = {9, 0, 9, 9, 9};
static const float five_lengths[] = {1, 1.4f, 1.4f, 0, 1};
static const float five_dampings[] = {0, 0.1f, 0, 0, 0};
static const uint32_t four_triangles[] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
static const uint32_t one_tetrahedron[] = {0, 1, 2, 3};

/* Every array is given. */
static sinew_body_def good_body(void)
{
    sinew_body_def def;
    MUST(sinew_body_def_init(&def, sizeof def));
    def.positions = def.rest_positions = four_nodes;
    def.node_count = 4;
    def.masses = four_masses;
    def.node_dampings = four_dampings;
    def.springs = five_springs;
    def.spring_count = 5;
    def.stiffnesses = five_stiffnesses;
    def.rest_lengths = five_lengths;
    def.spring_dampings = five_dampings;
    def.triangles = four_triangles;
    def.triangle_count = 4;
    def.tetrahedra = one_tetrahedron;
    def.tetrahedron_count = 1;
    return def;
}

/* One value for all instead of an array wherever there is the choice; springs from the edges. */
static sinew_body_def plain_body(void)
{
    sinew_body_def def = good_body();
    def.rest_positions = def.masses = def.node_dampings = NULL;
    def.stiffnesses = def.rest_lengths = def.spring_dampings = NULL;
    def.springs = NULL;
    def.spring_count = 0;
    def.node_mass = 0.1f;
    def.stiffness = 10.0f;
    return def;
}

#define BODY_FROM(base, status, word, change)                                  \
    do {                                                                       \
        sinew_body_def def = base;                                             \
        change;                                                                \
        REFUSED_WITH(status, word, sinew_body_create(the.world, &def, &out.body), #change); \
    } while (0)
#define BODY(status, word, change) BODY_FROM(good_body(), status, word, change)
#define PLAIN_BODY(status, word, change) BODY_FROM(plain_body(), status, word, change)

/* An array of floats with one bad value, first and last; an array of indices with one that no node has. */
#define BODY_FLOATS(field, count, kinds)                                       \
    do {                                                                       \
        int kind_;                                                             \
        for (kind_ = 0; kind_ < (kinds); kind_++) {                            \
            BODY(INVALID, #field, def.field = spoiled(def.field, count, 0, bad[kind_])); \
            BODY(INVALID, #field, def.field = spoiled(def.field, count, (count) - 1, bad[kind_])); \
        }                                                                      \
    } while (0)
#define BODY_INDICES(field, count)                                             \
    do {                                                                       \
        BODY(INVALID, #field, def.field = renumbered(def.field, count, 0, 4)); \
        BODY(INVALID, #field, def.field = renumbered(def.field, count, (count) - 1, UINT32_MAX)); \
    } while (0)

/* The definitions that the cases spoil are good: refused, they would prove nothing. */
static void body_definitions_unspoiled(void)
{
    const sinew_world_def world_def = good_world();
    const sinew_body_def good = good_body(), plain = plain_body();
    sinew_world *world = NULL;
    sinew_body_id body;
    MUST(sinew_world_create(&world_def, &world));
    MUST(sinew_body_create(world, &good, &body));
    MUST(sinew_body_create(world, &plain, &body));
    sinew_world_destroy(world);
}

static void body_definitions(void)
{
    const sinew_body_def good = good_body();
    int i;
    REFUSED(INVALID, "def", sinew_body_def_init(NULL, sizeof(sinew_body_def)));
    REFUSES_SIZES(sinew_body_def, sizeof(contract_body_def), (void)0, sinew_body_def_init(&out.body_def, size));
    REFUSED(INVALID, "world", sinew_body_create(NULL, &good, &out.body));
    REFUSED(INVALID, "def", sinew_body_create(the.world, NULL, &out.body));
    REFUSED(INVALID, "out", sinew_body_create(the.world, &good, NULL));
    REFUSES_SIZES(sinew_body_def, sizeof(contract_body_def), sinew_body_def def = good_body(); def.struct_size = size,
                  sinew_body_create(the.world, &def, &out.body));
    BODY(INVALID, "reserved", def.reserved = 1);
    BODY(INVALID, "storage", def.storage = 4);
    BODY(INVALID, "storage", def.storage = UINT32_MAX);
    BODY(INVALID, "solver", def.solver = 4);
    BODY(INVALID, "solver", def.solver = UINT32_MAX);
    BODY(CAPACITY, "springs_per_node", def.storage = SINEW_STORAGE_FAST_LINK; def.springs_per_node = 1);
    BODY(INVALID, "order", def.order = 3);
    BODY(INVALID, "iterations", def.iterations = 1000001);
    BODY(INVALID, "accuracy", def.accuracy = 1e-7f);
    BODY(INVALID, "accuracy", def.accuracy = -0.1f);
    BODY(INVALID, "accuracy", def.accuracy = 2.0f);
    for (i = 0; i < NOT_FINITE; i++)
        BODY(INVALID, "accuracy", def.accuracy = bad[i]);
    BODY(INVALID, "mass_scaling", def.mass_scaling = -0.001f);
    BODY(INVALID, "mass_scaling", def.mass_scaling = 1.1f);
    for (i = 0; i < NOT_FINITE; i++)
        BODY(INVALID, "mass_scaling", def.mass_scaling = bad[i]);

    BODY(INVALID, "positions", def.positions = NULL);
    BODY(INVALID, "node_count", def.node_count = 0);
    BODY(INVALID, "positions", def.node_count = SIZE_MAX);
    BODY_FLOATS(positions, 12, NOT_FINITE);
    BODY_FLOATS(rest_positions, 12, NOT_FINITE);
    BODY_FLOATS(masses, 4, OR_NEGATIVE);
    BODY_FLOATS(node_dampings, 4, OR_NEGATIVE);
    for (i = 0; i < OR_ZERO; i++)
        PLAIN_BODY(INVALID, "node_mass", def.node_mass = bad[i]);
    for (i = 0; i < OR_NEGATIVE; i++)
        PLAIN_BODY(INVALID, "node_damping", def.node_damping = bad[i]);
}

static const float cube_nodes[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1};
static const uint32_t one_cell[] = {0, 1, 2, 3, 4, 5, 6, 7};
static const uint32_t mirrored_cell[] = {1, 0, 3, 2, 5, 4, 7, 6};

/* A cube by its numbers. */
static sinew_body_def tissue(void)
{
    sinew_body_def def;
    MUST(sinew_body_def_init(&def, sizeof def));
    def.positions = cube_nodes;
    def.node_count = 8;
    def.cells = one_cell;
    def.cell_count = 1;
    def.material = SINEW_MATERIAL_SPRINGS;
    def.young_modulus = 5000.0f;
    def.poisson_ratio = 0.25f;
    def.density = 1000.0f;
    return def;
}

#define TISSUE(status, word, change) BODY_FROM(tissue(), status, word, change)

static void materials(void)
{
    const sinew_world_def world_def = good_world();
    const sinew_body_def good = tissue();
    sinew_world *world = NULL;
    sinew_body_id body;
    int i;
    MUST(sinew_world_create(&world_def, &world));
    MUST(sinew_body_create(world, &good, &body));
    sinew_world_destroy(world);
    for (i = 0; i < OR_ZERO; i++)
        TISSUE(INVALID, "young_modulus", def.young_modulus = bad[i]);
    for (i = 0; i < OR_NEGATIVE; i++) {
        TISSUE(INVALID, "poisson_ratio", def.poisson_ratio = bad[i]);
        TISSUE(INVALID, "density", def.density = bad[i]);
        TISSUE(INVALID, "thickness", def.thickness = bad[i]);
    }
    TISSUE(INVALID, "material", def.material = UINT32_MAX);
    TISSUE(INVALID, "volume_stiffness is -1", def.volume_stiffness = -1);
    TISSUE(INVALID, "cells", def.cells = NULL);
    TISSUE(INVALID, "cells", def.cells = renumbered(def.cells, 8, 7, 8));
    TISSUE(INVALID, "cells", def.cells = renumbered(def.cells, 8, 7, 0));
    TISSUE(INVALID, "cells", def.cells = mirrored_cell);
    TISSUE(INVALID, "cells", def.positions = spoiled(def.positions, 24, 23, 1.01f));
    TISSUE(INVALID, "poisson_ratio", def.poisson_ratio = 0.45f);
    TISSUE(INVALID, "thickness", def.thickness = 0.001f);
    TISSUE(INVALID, "stiffness", def.stiffness = 1.0f);
    TISSUE(INVALID, "springs", def.springs = five_springs; def.spring_count = 5);
    TISSUE(INVALID, "node_mass", def.node_mass = 0.1f);
    TISSUE(INVALID, "node_mass", def.density = 0.0f);
    TISSUE(INVALID, "masses", def.masses = cube_nodes);
    TISSUE(INVALID, "material", def.cell_count = 0);
    TISSUE(INVALID, "tetrahedra", def.tetrahedra = one_tetrahedron; def.tetrahedron_count = 1);
    TISSUE(INVALID, "thickness", def.cell_count = 0; def.triangles = four_triangles; def.triangle_count = 4);
    /* Numbers without a material to belong to. */
    PLAIN_BODY(INVALID, "young_modulus", def.young_modulus = 5000.0f);
    PLAIN_BODY(INVALID, "poisson_ratio", def.poisson_ratio = 0.25f);
    PLAIN_BODY(INVALID, "density", def.density = 1000.0f);
    PLAIN_BODY(INVALID, "thickness", def.thickness = 0.001f);
}

static void bodies_springs_and_elements(void)
{
    int i;
    BODY_INDICES(springs, 10);
    BODY_INDICES(triangles, 12);
    BODY_INDICES(tetrahedra, 4);
    BODY(INVALID, "springs", def.springs = renumbered(def.springs, 10, 9, 1));
    PLAIN_BODY(INVALID, "triangles", def.triangles = renumbered(def.triangles, 12, 1, 0));
    PLAIN_BODY(INVALID, "tetrahedra", def.tetrahedra = renumbered(def.tetrahedra, 4, 3, 0));
    BODY(INVALID, "springs", def.springs = doubled_springs);
    BODY(INVALID, "springs", def.springs = reversed_springs);
    BODY_FLOATS(stiffnesses, 5, OR_NEGATIVE);
    BODY_FLOATS(rest_lengths, 5, OR_NEGATIVE);
    BODY_FLOATS(spring_dampings, 5, OR_NEGATIVE);
    for (i = 0; i < OR_NEGATIVE; i++) {
        PLAIN_BODY(INVALID, "stiffness", def.stiffness = bad[i]);
        PLAIN_BODY(INVALID, "spring_damping", def.spring_damping = bad[i]);
    }

    BODY(INVALID, "springs", def.spring_count = SIZE_MAX);
    BODY(INVALID, "triangles", def.triangle_count = SIZE_MAX);
    BODY(INVALID, "tetrahedra", def.tetrahedron_count = SIZE_MAX);
    PLAIN_BODY(INVALID, "springs", def.spring_count = 5);
    PLAIN_BODY(INVALID, "triangles", def.triangles = NULL);
    PLAIN_BODY(INVALID, "tetrahedra", def.tetrahedra = NULL);
    PLAIN_BODY(INVALID, "stiffnesses", def.stiffnesses = five_stiffnesses);
    PLAIN_BODY(INVALID, "rest_lengths", def.rest_lengths = five_lengths);
    PLAIN_BODY(INVALID, "spring_dampings", def.spring_dampings = five_dampings);
}

static const uint32_t no_nodes[] = {9, UINT32_MAX};

#define REFUSES_NO_NODE(word, call)                                            \
    do {                                                                       \
        int i_;                                                                \
        for (i_ = 0; i_ < 2; i_++) {                                           \
            const uint32_t node = no_nodes[i_];                                \
            REFUSED_WITH(INVALID, word, call, "no such node");                 \
        }                                                                      \
    } while (0)

static void forces(void)
{
    static const uint32_t nodes[] = {0, 4, 8};
    static const float three[9] = {0};
    int i;
    size_t axis;
    REFUSES_NO_BODY(sinew_body_apply_force(world, body, 8, fine));
    REFUSES_NO_NODE("node", sinew_body_apply_force(the.world, the.body, node, fine));
    REFUSED(INVALID, "force", sinew_body_apply_force(the.world, the.body, 8, NULL));
    for (i = 0; i < NOT_FINITE; i++)
        for (axis = 0; axis < 3; axis++)
            REFUSED(INVALID, "force", sinew_body_apply_force(the.world, the.body, 8, spoiled(fine, 3, axis, bad[i])));

    REFUSES_NO_BODY(sinew_body_apply_forces(world, body, nodes, three, 3));
    REFUSED(INVALID, "nodes", sinew_body_apply_forces(the.world, the.body, NULL, three, 3));
    REFUSED(INVALID, "forces", sinew_body_apply_forces(the.world, the.body, nodes, NULL, 3));
    REFUSED(INVALID, "nodes", sinew_body_apply_forces(the.world, the.body, nodes, three, SIZE_MAX));
    REFUSES_NO_NODE("nodes", sinew_body_apply_forces(the.world, the.body, renumbered(nodes, 3, 2, node), three, 3));
    for (i = 0; i < NOT_FINITE; i++) {
        REFUSED(INVALID, "forces", sinew_body_apply_forces(the.world, the.body, nodes, spoiled(three, 9, 0, bad[i]), 3));
        REFUSED(INVALID, "forces", sinew_body_apply_forces(the.world, the.body, nodes, spoiled(three, 9, 8, bad[i]), 3));
    }
}

static void positions_and_velocities(void)
{
    static const float nine[27] = {0};
    static const size_t counts[] = {0, 8, 10, SIZE_MAX};
    int i;
    REFUSES_NO_BODY(sinew_body_get_positions(world, body, &out.view));
    REFUSES_NO_BODY(sinew_body_get_velocities(world, body, &out.view));
    REFUSED(INVALID, "out", sinew_body_get_positions(the.world, the.body, NULL));
    REFUSED(INVALID, "out", sinew_body_get_velocities(the.world, the.body, NULL));

    REFUSES_NO_BODY(sinew_body_set_positions(world, body, nine, 9));
    REFUSES_NO_BODY(sinew_body_set_velocities(world, body, nine, 9));
    REFUSED(INVALID, "positions", sinew_body_set_positions(the.world, the.body, NULL, 9));
    REFUSED(INVALID, "velocities", sinew_body_set_velocities(the.world, the.body, NULL, 9));
    for (i = 0; i < 4; i++) {
        REFUSED(INVALID, "positions", sinew_body_set_positions(the.world, the.body, nine, counts[i]));
        REFUSED(INVALID, "velocities", sinew_body_set_velocities(the.world, the.body, nine, counts[i]));
    }
    for (i = 0; i < NOT_FINITE; i++) {
        REFUSED(INVALID, "positions", sinew_body_set_positions(the.world, the.body, spoiled(nine, 27, 0, bad[i]), 9));
        REFUSED(INVALID, "positions", sinew_body_set_positions(the.world, the.body, spoiled(nine, 27, 26, bad[i]), 9));
        REFUSED(INVALID, "velocities", sinew_body_set_velocities(the.world, the.body, spoiled(nine, 27, 0, bad[i]), 9));
        REFUSED(INVALID, "velocities", sinew_body_set_velocities(the.world, the.body, spoiled(nine, 27, 26, bad[i]), 9));
    }
}

static void pins(void)
{
    int i;
    size_t axis;
    REFUSES_NO_BODY(sinew_body_pin(world, body, 8));
    REFUSES_NO_BODY(sinew_body_pin_axes(world, body, 8, SINEW_AXIS_X));
    REFUSES_NO_BODY(sinew_body_unpin(world, body, 0));
    REFUSES_NO_BODY(sinew_body_move_pin(world, body, 0, fine));
    REFUSES_NO_BODY(sinew_body_get_pin_force(world, body, 0, out.force));
    REFUSES_NO_NODE("node", sinew_body_pin(the.world, the.body, node));
    REFUSES_NO_NODE("node", sinew_body_pin_axes(the.world, the.body, node, SINEW_AXIS_X));
    REFUSES_NO_NODE("node", sinew_body_unpin(the.world, the.body, node));
    REFUSES_NO_NODE("node", sinew_body_move_pin(the.world, the.body, node, fine));
    REFUSES_NO_NODE("node", sinew_body_get_pin_force(the.world, the.body, node, out.force));
    REFUSED(INVALID, "node", sinew_body_move_pin(the.world, the.body, 8, fine));
    REFUSED(INVALID, "node", sinew_body_get_pin_force(the.world, the.body, 8, out.force));
    REFUSED(INVALID, "node", sinew_body_unpin(the.world, the.body, 2)); /* without mass: pinned for good */
    REFUSED(INVALID, "node", sinew_body_pin_axes(the.world, the.body, 2, SINEW_AXIS_X));
    REFUSED(INVALID, "node", sinew_body_pin_axes(the.world, the.body, 2, 0));
    REFUSED(INVALID, "axes", sinew_body_pin_axes(the.world, the.body, 8, 8));
    REFUSED(INVALID, "position", sinew_body_move_pin(the.world, the.body, 0, NULL));
    REFUSED(INVALID, "force", sinew_body_get_pin_force(the.world, the.body, 0, NULL));
    for (i = 0; i < NOT_FINITE; i++)
        for (axis = 0; axis < 3; axis++)
            REFUSED(INVALID, "position", sinew_body_move_pin(the.world, the.body, 0, spoiled(fine, 3, axis, bad[i])));
}

static void springs(void)
{
    int i;
    REFUSES_NO_BODY(sinew_body_add_spring(world, body, 0, 8, 10.0f, 1.0f));
    REFUSES_NO_BODY(sinew_body_remove_spring(world, body, 0, 1));
    for (i = 0; i < 2; i++) {
        REFUSED(INVALID, "a", sinew_body_add_spring(the.world, the.body, no_nodes[i], 8, 10.0f, 1.0f));
        REFUSED(INVALID, "b", sinew_body_add_spring(the.world, the.body, 0, no_nodes[i], 10.0f, 1.0f));
        REFUSED(INVALID, "a", sinew_body_remove_spring(the.world, the.body, no_nodes[i], 1));
        REFUSED(INVALID, "b", sinew_body_remove_spring(the.world, the.body, 0, no_nodes[i]));
    }
    REFUSED(INVALID, "b", sinew_body_add_spring(the.world, the.body, 8, 8, 10.0f, 1.0f));
    REFUSED(INVALID, "spring", sinew_body_add_spring(the.world, the.body, 0, 1, 10.0f, 1.0f));
    REFUSED(INVALID, "spring", sinew_body_add_spring(the.world, the.body, 1, 0, 10.0f, 1.0f));
    REFUSED(INVALID, "spring", sinew_body_remove_spring(the.world, the.body, 0, 8));
    REFUSED(INVALID, "spring", sinew_body_remove_spring(the.world, the.body, 8, 8));
    for (i = 0; i < OR_NEGATIVE; i++)
        REFUSED(INVALID, "stiffness", sinew_body_add_spring(the.world, the.body, 0, 8, bad[i], 1.0f));
    for (i = 0; i < NOT_FINITE; i++)
        REFUSED(INVALID, "rest_length", sinew_body_add_spring(the.world, the.body, 0, 8, 10.0f, bad[i]));
}

static void body_reports(void)
{
    REFUSES_NO_BODY(sinew_body_destroy(world, body));
    REFUSES_NO_BODY(sinew_body_get_energy(world, body, &out.energy));
    REFUSES_NO_BODY(sinew_body_get_storage_report(world, body, &out.storage));
    REFUSES_NO_BODY(sinew_body_get_solver_report(world, body, &out.solver));
    REFUSES_NO_BODY(sinew_body_get_enclosed_report(world, body, &out.enclosed));
    REFUSED(INVALID, "out", sinew_body_get_energy(the.world, the.body, NULL));
    REFUSED(INVALID, "out", sinew_body_get_storage_report(the.world, the.body, NULL));
    REFUSED(INVALID, "out", sinew_body_get_solver_report(the.world, the.body, NULL));
    REFUSED(INVALID, "out", sinew_body_get_enclosed_report(the.world, the.body, NULL));
    REFUSES_RESULT_SIZES(sinew_energy, sizeof(contract_energy), energy,
                         sinew_body_get_energy(the.world, the.body, &out.energy));
    REFUSES_RESULT_SIZES(sinew_storage_report, sizeof(contract_storage_report), storage,
                         sinew_body_get_storage_report(the.world, the.body, &out.storage));
    REFUSES_RESULT_SIZES(sinew_enclosed_report, sizeof(sinew_enclosed_report), enclosed,
                         sinew_body_get_enclosed_report(the.world, the.body, &out.enclosed));
}

static void rest_states(void)
{
    sinew_equilibrium_def good;
    int i;
    MUST(sinew_equilibrium_def_init(&good, sizeof good));
    REFUSED(INVALID, "def", sinew_equilibrium_def_init(NULL, sizeof good));
    REFUSES_SIZES(sinew_equilibrium_def, sizeof(sinew_equilibrium_def), (void)0,
                  sinew_equilibrium_def_init(&out.rest_def, size));
    REFUSES_NO_BODY(sinew_body_solve_equilibrium(world, body, &good, &out.rest));
    REFUSES_NO_BODY(sinew_body_solve_equilibrium(world, body, NULL, NULL));
    REFUSES_SIZES(sinew_equilibrium_def, sizeof(sinew_equilibrium_def), sinew_equilibrium_def def = good; def.struct_size = size,
                  sinew_body_solve_equilibrium(the.world, the.body, &def, &out.rest));
    REFUSES_RESULT_SIZES(sinew_equilibrium_report, sizeof(sinew_equilibrium_report), rest,
                         sinew_body_solve_equilibrium(the.world, the.body, &good, &out.rest));
    for (i = 0; i < OR_NEGATIVE; i++) {
        sinew_equilibrium_def def = good;
        def.tolerance = bad[i];
        REFUSED(INVALID, "tolerance", sinew_body_solve_equilibrium(the.world, the.body, &def, &out.rest));
    }
}

/* ---- tools ---- */

static sinew_tool_def good_tool(uint32_t shape)
{
    sinew_tool_def def;
    MUST(sinew_tool_def_init(&def, sizeof def));
    def.shape = shape;
    def.radius = 0.1f;
    def.half_length = 0.2f;
    def.half_extents[0] = def.half_extents[1] = def.half_extents[2] = 0.1f;
    if (shape == SINEW_SHAPE_PLANE)
        def.radius = def.half_length = 0.0f;
    if (shape == SINEW_SHAPE_MESH) {
        def.positions = four_nodes;
        def.node_count = 4;
        def.triangles = four_triangles;
        def.triangle_count = 4;
    }
    return def;
}

#define TOOL(shape, status, word, change)                                      \
    do {                                                                       \
        sinew_tool_def def = good_tool(SINEW_SHAPE_##shape);                   \
        change;                                                                \
        REFUSED_WITH(status, word, sinew_tool_create(the.world, &def, &out.tool), #shape ": " #change); \
    } while (0)

static void tool_definitions_unspoiled(void)
{
    static const uint32_t shapes[] = {SINEW_SHAPE_SPHERE, SINEW_SHAPE_CAPSULE, SINEW_SHAPE_PLANE, SINEW_SHAPE_MESH,
                                      SINEW_SHAPE_BOX};
    const sinew_world_def world_def = good_world();
    sinew_world *world = NULL;
    sinew_tool_id tool;
    int i;
    MUST(sinew_world_create(&world_def, &world));
    for (i = 0; i < 5; i++) {
        const sinew_tool_def def = good_tool(shapes[i]);
        MUST(sinew_tool_create(world, &def, &tool));
    }
    sinew_world_destroy(world);
}

static void tool_definitions(void)
{
    const sinew_tool_def good = good_tool(SINEW_SHAPE_SPHERE);
    int i, axis;
    REFUSED(INVALID, "def", sinew_tool_def_init(NULL, sizeof(sinew_tool_def)));
    REFUSES_SIZES(sinew_tool_def, sizeof(contract_tool_def), (void)0, sinew_tool_def_init(&out.tool_def, size));
    REFUSED(INVALID, "world", sinew_tool_create(NULL, &good, &out.tool));
    REFUSED(INVALID, "def", sinew_tool_create(the.world, NULL, &out.tool));
    REFUSED(INVALID, "out", sinew_tool_create(the.world, &good, NULL));
    REFUSES_SIZES(sinew_tool_def, sizeof(contract_tool_def),
                  sinew_tool_def def = good_tool(SINEW_SHAPE_SPHERE); def.struct_size = size,
                  sinew_tool_create(the.world, &def, &out.tool));
    TOOL(SPHERE, INVALID, "reserved0", def.reserved0 = 1);
    TOOL(SPHERE, INVALID, "reserved", def.reserved = 1);
    TOOL(BOX, INVALID, "half_extents[0] is 0", def.half_extents[0] = 0.0f);
    TOOL(BOX, INVALID, "half_extents[1] is -1", def.half_extents[1] = -1.0f);
    TOOL(BOX, INVALID, "half_extents[2] is 10000000000", def.half_extents[2] = 1e10f);
    TOOL(SPHERE, INVALID, "shape", def.shape = 5);
    TOOL(SPHERE, INVALID, "shape", def.shape = UINT32_MAX);
    TOOL(SPHERE, INVALID, "detection", def.detection = 3);
    TOOL(SPHERE, INVALID, "detection", def.detection = UINT32_MAX);
    TOOL(PLANE, UNSUPPORTED, "detection", def.detection = SINEW_DETECTION_IMAGE_SPACE);
    TOOL(SPHERE, UNSUPPORTED, "detection", def.detection = SINEW_DETECTION_DISTANCE_FIELD);
    for (i = 0; i < OR_ZERO; i++) {
        TOOL(SPHERE, INVALID, "radius", def.radius = bad[i]);
        TOOL(CAPSULE, INVALID, "radius", def.radius = bad[i]);
    }
    for (i = 0; i < OR_NEGATIVE; i++) {
        TOOL(CAPSULE, INVALID, "half_length", def.half_length = bad[i]);
        TOOL(SPHERE, INVALID, "friction", def.friction = bad[i]);
        TOOL(PLANE, INVALID, "friction", def.friction = bad[i]);
    }
    for (i = 0; i < NOT_FINITE; i++) {
        for (axis = 0; axis < 3; axis++)
            TOOL(PLANE, INVALID, "position", def.position[axis] = bad[i]);
        for (axis = 0; axis < 4; axis++)
            TOOL(CAPSULE, INVALID, "orientation", def.orientation[axis] = bad[i]);
    }
    TOOL(CAPSULE, INVALID, "orientation", def.orientation[3] = 0.0f);
}

static void tool_calls(void)
{
    static const float upright[] = {0, 0, 0, 1}, nowhere[] = {0, 0, 0, 0};
    int i;
    size_t axis;
    REFUSES_NO_TOOL(sinew_tool_destroy(world, tool));
    REFUSES_NO_TOOL(sinew_tool_set_pose(world, tool, fine, upright));
    REFUSES_NO_TOOL(sinew_tool_get_wrench(world, tool, out.force, out.torque));
    REFUSES_NO_TOOL(sinew_tool_get_force_error(world, tool, out.force));
    REFUSED(INVALID, "position", sinew_tool_set_pose(the.world, the.tool, NULL, upright));
    REFUSED(INVALID, "orientation", sinew_tool_set_pose(the.world, the.tool, fine, nowhere));
    for (i = 0; i < NOT_FINITE; i++) {
        for (axis = 0; axis < 3; axis++)
            REFUSED(INVALID, "position", sinew_tool_set_pose(the.world, the.tool, spoiled(fine, 3, axis, bad[i]), NULL));
        for (axis = 0; axis < 4; axis++)
            REFUSED(INVALID, "orientation", sinew_tool_set_pose(the.world, the.tool, fine, spoiled(upright, 4, axis, bad[i])));
    }
}

int main(void)
{
    set_up();
    world_definitions();
    world_calls();
    body_definitions_unspoiled();
    body_definitions();
    bodies_springs_and_elements();
    materials();
    forces();
    positions_and_velocities();
    pins();
    springs();
    body_reports();
    rest_states();
    tool_definitions_unspoiled();
    tool_definitions();
    tool_calls();
    sinew_world_destroy(NULL);
    return tear_down();
}
