/* What is refused of springs and regions that are changed, of strain that is read, and of pictures of numbers. */
#include "refusals.h"

static const float rest[27] = {0, 0, 0, 1, 0, 0, 2, 0, 0, 0, 0, 1, 1, 0, 1, 2, 0, 1, 0, 0, 2, 1, 0, 2, 2, 0, 2};
static const float numbers[9] = {1, 1, 1, 1, 1, 1, 1, 1, 1};
static const uint32_t joined[] = {0, 1}, apart[] = {0, 8}, itself[] = {1, 1}, beyond[] = {0, 9};
static const uint32_t corners[] = {0, 1, 3, 4}, twice[] = {0, 1, 1, 4}, outside[] = {0, 1, 3, 9};

static void springs(void)
{
    const uint32_t *const bad_pairs[] = {apart, itself, beyond};
    const uint32_t two[] = {0, 1, 0, 8};
    int i;
    REFUSES_NO_BODY(sinew_body_get_spring_pairs(world, body, out.pairs, 1));
    REFUSED(INVALID, "out_pairs", sinew_body_get_spring_pairs(the.world, the.body, out.pairs, 1));
    REFUSED(INVALID, "out_pairs", sinew_body_get_spring_pairs(the.world, the.body, NULL, 16));
    REFUSES_NO_BODY(sinew_body_get_springs(world, body, joined, 1, out.numbers[0], out.numbers[1]));
    REFUSED(INVALID, "pairs", sinew_body_get_springs(the.world, the.body, NULL, 1, out.numbers[0], out.numbers[1]));
    REFUSES_NO_BODY(sinew_body_set_springs(world, body, joined, numbers, numbers, 1));
    REFUSED(INVALID, "pairs", sinew_body_set_springs(the.world, the.body, NULL, numbers, numbers, 1));
    REFUSES_NO_BODY(sinew_body_get_spring_strains(world, body, joined, numbers, 1, out.numbers[0]));
    REFUSED(INVALID, "out_strains", sinew_body_get_spring_strains(the.world, the.body, joined, numbers, 1, NULL));
    REFUSED(INVALID, "pairs[0]", sinew_body_get_spring_strains(the.world, the.body, beyond, numbers, 1, out.numbers[0]));
    for (i = 0; i < 3; i++) {
        REFUSED(INVALID, "pairs[0]", sinew_body_get_springs(the.world, the.body, bad_pairs[i], 1, out.numbers[0], NULL));
        REFUSED(INVALID, "pairs[0]", sinew_body_set_springs(the.world, the.body, bad_pairs[i], numbers, NULL, 1));
        REFUSED(INVALID, "pairs[0]", sinew_body_get_spring_strains(the.world, the.body, bad_pairs[i], NULL, 1, out.numbers[0]));
    }
    REFUSED(INVALID, "pairs[1]", sinew_body_set_springs(the.world, the.body, two, numbers, numbers, 2));
    REFUSED(INVALID, "pairs[1]", sinew_body_get_springs(the.world, the.body, two, 2, out.numbers[0], out.numbers[1]));
    for (i = 0; i < OR_NEGATIVE; i++) {
        REFUSED(INVALID, "stiffnesses[0]", sinew_body_set_springs(the.world, the.body, joined, &bad[i], numbers, 1));
        REFUSED(INVALID, "rest_lengths[0]", sinew_body_set_springs(the.world, the.body, joined, numbers, &bad[i], 1));
        REFUSED(INVALID, "rest_lengths[0]", sinew_body_get_spring_strains(the.world, the.body, joined, &bad[i], 1, out.numbers[0]));
    }
}

static void regions(void)
{
    int i;
    REFUSES_NO_BODY(sinew_body_scale_region(world, body, corners, 4, 2.0f, 1.0f));
    REFUSED(INVALID, "nodes", sinew_body_scale_region(the.world, the.body, NULL, 4, 2.0f, 1.0f));
    REFUSED(INVALID, "nodes[3]", sinew_body_scale_region(the.world, the.body, outside, 4, 2.0f, 1.0f));
    for (i = 0; i < OR_ZERO; i++) {
        if (i < OR_NEGATIVE)
            REFUSED(INVALID, "stiffness_factor", sinew_body_scale_region(the.world, the.body, corners, 4, bad[i], 1.0f));
        REFUSED(INVALID, "length_factor", sinew_body_scale_region(the.world, the.body, corners, 4, 1.0f, bad[i]));
    }
    REFUSED(INVALID, "stiffness", sinew_body_scale_region(the.world, the.body, corners, 4, 3e38f, 1.0f));
    REFUSED(INVALID, "rest length", sinew_body_scale_region(the.world, the.body, corners, 4, 1.0f, 3e38f));
}

static void strains(void)
{
    REFUSES_NO_BODY(sinew_body_get_triangle_strains(world, body, rest, 9, corners, 1, &out.strain));
    REFUSES_NO_BODY(sinew_body_get_tetrahedron_strains(world, body, rest, 9, corners, 1, &out.strain));
    REFUSED(INVALID, "rest_positions", sinew_body_get_triangle_strains(the.world, the.body, NULL, 9, corners, 1, &out.strain));
    REFUSED(INVALID, "positions", sinew_body_get_triangle_strains(the.world, the.body, rest, 8, corners, 1, &out.strain));
    REFUSED(INVALID, "triangles", sinew_body_get_triangle_strains(the.world, the.body, rest, 9, NULL, 1, &out.strain));
    REFUSED(INVALID, "triangles[0]", sinew_body_get_triangle_strains(the.world, the.body, rest, 9, twice, 1, &out.strain));
    REFUSED(INVALID, "triangles[0]", sinew_body_get_triangle_strains(the.world, the.body, rest, 9, outside + 1, 1, &out.strain));
    REFUSED(INVALID, "out_strains", sinew_body_get_triangle_strains(the.world, the.body, rest, 9, corners, 1, NULL));
    REFUSED(INVALID, "rest_positions[2]", sinew_body_get_tetrahedron_strains(
        the.world, the.body, spoiled(rest, 27, 7, NAN), 9, corners, 1, &out.strain));
    REFUSED(INVALID, "tetrahedra[0]", sinew_body_get_tetrahedron_strains(the.world, the.body, rest, 9, twice, 1, &out.strain));
    REFUSED(INVALID, "tetrahedra[0]", sinew_body_get_tetrahedron_strains(the.world, the.body, rest, 9, outside, 1, &out.strain));
    REFUSED(INVALID, "out_strains", sinew_body_get_tetrahedron_strains(the.world, the.body, rest, 9, corners, 1, NULL));
    REFUSED(INVALID, "corners", sinew_util_average_to_nodes(corners, 1, numbers, 1, out.numbers[0], 9));
    REFUSED(INVALID, "corners", sinew_util_average_to_nodes(corners, 5, numbers, 1, out.numbers[0], 9));
    REFUSED(INVALID, "elements", sinew_util_average_to_nodes(NULL, 4, numbers, 1, out.numbers[0], 9));
    REFUSED(INVALID, "elements[0]", sinew_util_average_to_nodes(outside, 4, numbers, 1, out.numbers[0], 9));
    REFUSED(INVALID, "values", sinew_util_average_to_nodes(corners, 4, NULL, 1, out.numbers[0], 9));
    REFUSED(INVALID, "values[0]", sinew_util_average_to_nodes(corners, 4, bad, 1, out.numbers[0], 9));
    REFUSED(INVALID, "out_means", sinew_util_average_to_nodes(corners, 4, numbers, 1, NULL, 9));
}

static sinew_body_values good_values(void)
{
    sinew_body_values values;
    memset(&values, 0, sizeof values);
    values.body = the.body, values.values = numbers, values.node_count = 9, values.high = 1;
    return values;
}

#define VALUES(status, word, change)                                           \
    do {                                                                       \
        sinew_body_values values = good_values();                              \
        change;                                                                \
        REFUSED_WITH(status, word, sinew_world_save_picture_of_values(the.world, NULL, &values, 1, "must_not_be_drawn.png"), #change); \
    } while (0)

static void pictures(void)
{
    const sinew_body_values values = good_values();
    int i;
    REFUSED(INVALID, "world", sinew_world_save_picture_of_values(NULL, NULL, &values, 1, "must_not_be_drawn.png"));
    REFUSED(INVALID, "path", sinew_world_save_picture_of_values(the.world, NULL, &values, 1, NULL));
    REFUSED(INVALID, "coloured", sinew_world_save_picture_of_values(the.world, NULL, NULL, 1, "must_not_be_drawn.png"));
    for (i = 0; i < BAD_IDS; i++)
        VALUES(BAD_ID_STATUS(i), "body", values.body = the.bad_bodies[i]);
    VALUES(INVALID, "values", values.values = NULL);
    VALUES(INVALID, "values", values.node_count = 8);
    VALUES(INVALID, "values[1]", values.values = spoiled(numbers, 9, 1, INFINITY));
    VALUES(INVALID, "colours", values.colours = 2);
    VALUES(INVALID, "low", values.low = 1);
    for (i = 0; i < NOT_FINITE; i++) {
        VALUES(INVALID, "low", values.low = bad[i]);
        VALUES(INVALID, "high", values.high = bad[i]);
    }
    CHECK(fopen("must_not_be_drawn.png", "rb") == NULL);
}

int main(void)
{
    set_up();
    springs();
    regions();
    strains();
    pictures();
    return tear_down();
}
