/* What a body may be asked for beside its springs: home springs, bending, springs that stiffen, fibres, what it encloses; and what is
 * refused of it. */
#include "scene.h"

/* A tetrahedron of 1 m, 0.5 kg a node; its triangles turn about their edges. */
static const float CORNERS[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
static const uint32_t TETRAHEDRON[] = {0, 1, 2, 3};
static const uint32_t FACES[] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};

static sinew_body_def a_tetrahedron(void)
{
    sinew_body_def def;
    MUST(sinew_body_def_init(&def, sizeof def));
    def.positions = CORNERS, def.node_count = 4;
    def.tetrahedra = TETRAHEDRON, def.tetrahedron_count = 1;
    def.triangles = FACES, def.triangle_count = 4;
    def.node_mass = 0.5f;
    def.stiffness = 10.0f;
    return def;
}

static double elastic_energy(const sinew_body_def *def, float factor)
{
    sinew_world *world = a_world(0.0f);
    sinew_body_id body = {0, 0};
    sinew_energy energy;
    float positions[12];
    size_t i;
    MUST(sinew_body_create(world, def, &body));
    for (i = 0; i < 12; i++)
        positions[i] = factor * CORNERS[i];
    MUST(sinew_body_set_positions(world, body, positions, 4));
    energy.struct_size = sizeof energy;
    MUST(sinew_body_get_energy(world, body, &energy));
    sinew_world_destroy(world);
    return energy.elastic;
}

static void each_adds_the_energy_that_it_should(void)
{
    static const float along_x[] = {1, 0, 0}, homes[] = {0, 2, 2, 2}, fibres[] = {600};
    sinew_body_def def = a_tetrahedron();
    const double springs = elastic_energy(&def, 1.5f);
    CHECK_NEAR(springs, 0.5 * 10 * 0.25 * (3 * 1 + 3 * 2), 1e-5);
    def.home_stiffnesses = homes;
    CHECK_NEAR(elastic_energy(&def, 1.5f) - springs, 3 * 0.5 * 2 * 0.25, 1e-5);
    def = a_tetrahedron();
    def.spring_law = SINEW_SPRING_LAW_CUBIC;
    def.spring_cubic = 4.0f, def.spring_limit = 1.0f;
    CHECK_NEAR(elastic_energy(&def, 1.5f) - springs, 10.0 * 0.0625 * (3 * 1 + 3 * 2), 1e-5);
    def = a_tetrahedron();
    def.fibre_directions = along_x, def.fibre_stiffnesses = fibres;
    CHECK_NEAR(elastic_energy(&def, 1.5f) - springs, 600.0 / 6 / 2 * 0.25, 1e-4);
    def = a_tetrahedron();
    def.bending_stiffness = 3.0f;
    CHECK_NEAR(elastic_energy(&def, 1.0f), 0.0, 1e-9);
    CHECK(elastic_energy(&def, 1.5f) > springs);
}

static void a_cavity_is_told_pressed_and_opened(void)
{
    sinew_world *world = a_world(0.0f);
    sinew_body_def def = a_tetrahedron();
    sinew_body_id body = {0, 0}, plain = {0, 0};
    sinew_enclosed_report report;
    float positions[12];
    size_t i;
    /* Twice as wide it has eight times the volume of 1/6 m3. */
    const double springs = elastic_energy(&def, 2.0f);
    def.enclosed_stiffness = 60.0f, def.pressure = 12.0f;
    CHECK_NEAR(elastic_energy(&def, 2.0f) - springs, 30.0 / 6 * 49 - 12.0 / 6 * 7, 1e-3);
    MUST(sinew_body_create(world, &def, &body));
    for (i = 0; i < 12; i++)
        positions[i] = 2 * CORNERS[i];
    MUST(sinew_body_set_positions(world, body, positions, 4));
    report.struct_size = sizeof report;
    MUST(sinew_body_get_enclosed_report(world, body, &report));
    CHECK(report.cavity_count == 1);
    CHECK_NEAR(report.volume, 8.0 / 6, 1e-6);
    CHECK_NEAR(report.rest_volume, 1.0 / 6, 1e-6);
    CHECK_NEAR(report.pressure, 12.0 - 60 * 7, 1e-3);
    MUST(sinew_body_set_pressure(world, body, 500.0f));
    MUST(sinew_body_get_enclosed_report(world, body, &report));
    CHECK_NEAR(report.pressure, 500.0 - 60 * 7, 1e-3);
    CHECK(sinew_body_set_pressure(world, body, NAN) == SINEW_STATUS_INVALID_ARGUMENT);
    MUST(sinew_body_remove_spring(world, body, 1, 3));
    MUST(sinew_body_get_enclosed_report(world, body, &report));
    CHECK(report.cavity_count == 0 && report.volume == 0 && report.pressure == 0);
    def = a_tetrahedron();
    MUST(sinew_body_create(world, &def, &plain));
    MUST(sinew_body_get_enclosed_report(world, plain, &report));
    CHECK(report.cavity_count == 0);
    CHECK(sinew_body_set_pressure(world, plain, 1.0f) == SINEW_STATUS_INVALID_ARGUMENT);
    sinew_world_destroy(world);
}

/* What holds a pinned corner that was led away, after some steps. */
static double pull(sinew_body_def def, float place, int steps)
{
    sinew_world *world = a_world(0.0f);
    sinew_body_id body = {0, 0};
    float end[3] = {0, 0, 0}, force[3];
    def.solver = SINEW_SOLVER_IMPLICIT;
    MUST(sinew_body_create(world, &def, &body));
    end[0] = place;
    MUST(sinew_body_move_pin(world, body, 1, end));
    while (steps-- > 0)
        MUST(sinew_world_step(world, 0.001f, NULL));
    MUST(sinew_body_get_pin_force(world, body, 1, force));
    sinew_world_destroy(world);
    return force[0];
}

static void springs_relax_yield_and_have_a_limit(void)
{
    static const float ends[] = {0, 0, 0, 1, 0, 0}, masses[] = {0, 0};
    static const uint32_t spring[] = {0, 1};
    sinew_body_def def, pair;
    MUST(sinew_body_def_init(&def, sizeof def));
    def.positions = ends, def.node_count = 2;
    def.masses = masses;
    def.springs = spring, def.spring_count = 1;
    def.stiffness = 10.0f;
    pair = def;
    CHECK_NEAR(pull(pair, 1.5f, 1), 5.0, 1e-5);
    /* E (1 + 2 exp(-t / 0.1 s)): three times as much at once but for what relaxes while it is led there, 2 (1 - exp(-0.01)) / 0.01 instead
       of 2; what is elastic in the end. */
    pair.retardation_time = 0.2f, pair.relaxation_time = 0.1f;
    CHECK_NEAR(pull(pair, 1.5f, 1), 5.0 * (1 + 1.9900332), 1e-4);
    CHECK_NEAR(pull(pair, 1.5f, 101), 5.0 * (1 + 1.9900332 * 0.36787944), 1e-4);
    CHECK_NEAR(pull(pair, 1.5f, 2000), 5.0, 1e-4);
    pair = def, pair.yield_strain = 0.2f;
    CHECK_NEAR(pull(pair, 1.5f, 2), 2.0, 1e-5);
    pair.largest_set = 0.1f;
    CHECK_NEAR(pull(pair, 1.5f, 2), 4.0, 1e-5);
    pair = def, pair.strain_limit = 0.25f, pair.limit_stiffening = 4.0f;
    CHECK_NEAR(pull(pair, 1.5f, 2), 15.0, 1e-5);
}

static void refused(sinew_body_def def, const char *name)
{
    sinew_world *world = a_world(0.0f);
    sinew_body_id body = {0, 0};
    char message[512];
    CHECK(sinew_body_create(world, &def, &body) == SINEW_STATUS_INVALID_ARGUMENT);
    sinew_last_error(message, sizeof message);
    CHECK(strstr(message, name) != NULL);
    sinew_world_destroy(world);
}

static void what_is_wrong_is_named(void)
{
    static const float too_long[] = {2, 0, 0};
    sinew_body_def def = a_tetrahedron();
    def.home_stiffness = -1.0f;
    refused(def, "home_stiffness");
    def = a_tetrahedron(), def.bending_stiffness = -1.0f;
    refused(def, "bending_stiffness");
    def = a_tetrahedron(), def.spring_law = 3;
    refused(def, "spring_law is 3");
    def = a_tetrahedron(), def.spring_steepness = 3.0f;
    refused(def, "spring_steepness is 3");
    def = a_tetrahedron(), def.spring_law = SINEW_SPRING_LAW_EXPONENTIAL, def.spring_cubic = 1.0f;
    refused(def, "spring_cubic is 1");
    def = a_tetrahedron(), def.element_law = 3;
    refused(def, "element_law is 3");
    def = a_tetrahedron(), def.element_law = SINEW_ELEMENT_LAW_NEO_HOOKEAN;
    refused(def, "element_law is SINEW_ELEMENT_LAW_NEO_HOOKEAN");
    def = a_tetrahedron(), def.mooney_ratio = 0.25f;
    refused(def, "mooney_ratio is 0.25");
    def = a_tetrahedron(), def.element_law = SINEW_ELEMENT_LAW_MOONEY_RIVLIN, def.mooney_ratio = 1.25f;
    refused(def, "mooney_ratio is 1.25");
    def = a_tetrahedron(), def.fibre_directions = too_long;
    refused(def, "fibre_directions[0]");
    def = a_tetrahedron(), def.fibre_stiffness = 5.0f;
    refused(def, "fibre_stiffness");
    def = a_tetrahedron(), def.retardation_time = -2.0f;
    refused(def, "retardation_time is -2");
    def = a_tetrahedron(), def.relaxation_time = 3.0f;
    refused(def, "relaxation_time is 3");
    def = a_tetrahedron(), def.yield_strain = -1.0f;
    refused(def, "yield_strain is -1");
    def = a_tetrahedron(), def.yield_strain = 0.1f, def.largest_set = 1.5f;
    refused(def, "largest_set is 1.5");
    def = a_tetrahedron(), def.strain_limit = -0.5f;
    refused(def, "strain_limit is -0.5");
    def = a_tetrahedron(), def.strain_limit = 0.1f, def.limit_stiffening = 0.0f;
    refused(def, "limit_stiffening is 0");
    def = a_tetrahedron(), def.enclosed_stiffness = -1.0f;
    refused(def, "enclosed_stiffness is -1");
    def = a_tetrahedron(), def.pressure = INFINITY;
    refused(def, "pressure");
    def = a_tetrahedron(), def.pressure = 5.0f, def.triangle_count = 3;
    refused(def, "pressure is 5 Pa, and the surface is not closed");
}

static void an_older_program_knows_none_of_it(void)
{
    sinew_body_def def = a_tetrahedron();
    def.bending_stiffness = -1.0f;
    def.pressure = NAN;
    def.struct_size = offsetof(sinew_body_def, order);
    CHECK_NEAR(elastic_energy(&def, 1.5f), 0.5 * 10 * 0.25 * 9, 1e-5);
}

int main(void)
{
    each_adds_the_energy_that_it_should();
    springs_relax_yield_and_have_a_limit();
    a_cavity_is_told_pressed_and_opened();
    what_is_wrong_is_named();
    an_older_program_knows_none_of_it();
    return checked("terms beside springs are what they say");
}
