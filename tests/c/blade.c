/* A blade: it goes through a sheet that is held, feels what that costs, and comes out on the other side. */
#include "scene.h"

enum { N = 9 }; /* nodes along a side of 0.08 m */

static const double toughness = 0.05;

static sinew_body_id a_sheet(sinew_world *world, float toughness_of_it)
{
    float positions[3 * N * N], masses[N * N];
    uint32_t triangles[6 * (N - 1) * (N - 1)], *next = triangles, i;
    sinew_body_def def;
    sinew_body_id body = {0, 0};
    for (i = 0; i < N * N; i++) {
        positions[3 * i] = 0.01f * (float)(i % N);
        positions[3 * i + 1] = 0.0f;
        positions[3 * i + 2] = 0.01f * (float)(i / N);
        masses[i] = i / N == 0 || i / N == N - 1 ? 0.0f : 1e-3f;
        if (i % N < N - 1 && i / N < N - 1) {
            const uint32_t corners[6] = {i, i + N, i + 1, i + 1, i + N, i + N + 1};
            memcpy(next, corners, sizeof corners);
            next += 6;
        }
    }
    MUST(sinew_body_def_init(&def, sizeof def));
    CHECK(def.toughness == 0.0f);
    def.positions = positions;
    def.node_count = N * N;
    def.masses = masses;
    def.node_damping = 0.05f;
    def.stiffness = 200.0f;
    def.triangles = triangles;
    def.triangle_count = 2 * (N - 1) * (N - 1);
    def.spare_nodes = 400;
    def.toughness = toughness_of_it;
    MUST(sinew_body_create(world, &def, &body));
    return body;
}

/* The one body that a blade presses bears all of its force, near its edge. */
static void pressed(const sinew_world *world, sinew_blade_id blade, sinew_body_id sheet, const sinew_blade_report *report)
{
    sinew_contact contact;
    float place[3];
    size_t count = 77;
    int axis;
    MUST(sinew_blade_get_contacts(world, blade, NULL, 0, &count));
    CHECK(count == (report->force[0] != 0.0f));
    if (count != 1)
        return;
    MUST(sinew_blade_get_contacts(world, blade, &contact, 1, &count));
    MUST(sinew_blade_get_pose(world, blade, place, NULL));
    CHECK(memcmp(&contact.body, &sheet, sizeof sheet) == 0 && contact.nodes[0] == UINT32_MAX);
    for (axis = 0; axis < 3; axis++) {
        CHECK_NEAR(contact.force[axis], report->force[axis], 1e-6);
        CHECK_NEAR(contact.point[axis], place[axis], 0.01);
    }
}

static void a_stroke(float toughness_of_it, int steps_of_it)
{
    sinew_world *world = a_world(0);
    const sinew_body_id sheet = a_sheet(world, toughness_of_it);
    sinew_blade_def def;
    sinew_blade_id blade = {0, 0};
    sinew_blade_report report;
    double work = 0, told = 0, length = 0, largest = 0;
    uint32_t pieces = 0;
    size_t count;
    int step;
    MUST(sinew_blade_def_init(&def, sizeof def));
    CHECK(def.stiffness == 1000.0f && def.orientation[3] == 1.0f && def.collision_mask == UINT32_MAX);
    def.edge[1] = -0.02f, def.edge[4] = 0.02f;
    def.stiffness = 300.0f;
    def.position[0] = -0.005f, def.position[2] = 0.0423f;
    MUST(sinew_blade_create(world, &def, &blade));
    report.struct_size = sizeof report;
    for (step = 1; step <= steps_of_it; step++) {
        const float place[3] = {-0.005f + 0.1f * (float)step / (float)steps_of_it, 0, 0.0423f};
        MUST(sinew_blade_set_pose(world, blade, place, NULL));
        MUST(sinew_world_step(world, 1.0f / (float)steps_of_it, NULL));
        MUST(sinew_blade_get_report(world, blade, &report));
        CHECK(report.struct_size == sizeof report && report.status == SINEW_STATUS_OK);
        pressed(world, blade, sheet, &report);
        work -= (double)report.force[0] * 0.1 / steps_of_it;
        told += report.work;
        length += report.length;
        if (-(double)report.force[0] > largest) largest = -(double)report.force[0];
    }
    MUST(sinew_body_get_pieces(world, sheet, NULL, 0, &pieces));
    CHECK(pieces == 2);
    CHECK_NEAR(length, 0.08, 0.003);
    CHECK_NEAR(work, (double)toughness_of_it * length, 0.05 * (double)toughness_of_it * length);
    CHECK_NEAR(told, work, 1e-3 * work + 1e-9);
    CHECK(largest >= 0.9 * (double)toughness_of_it && largest <= 1.2 * (double)toughness_of_it);
    CHECK(report.force[0] == 0.0f && report.lag == 0.0); /* it is out */
    MUST(sinew_blade_destroy(world, blade));
    CHECK(sinew_blade_get_report(world, blade, &report) == SINEW_STATUS_STALE_ID);
    CHECK(sinew_blade_get_contacts(world, blade, NULL, 0, &count) == SINEW_STATUS_STALE_ID);
    sinew_world_destroy(world);
}

int main(void)
{
    a_stroke((float)toughness, 500);
    a_stroke(0.0f, 40);
    return checked("blades cut and feel");
}
