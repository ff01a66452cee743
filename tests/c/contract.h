/* What programs written against the first header know: its structs under names of their own. Written by hand from the
 * contract and never from include/sinew.h, so that a field that moves, shrinks or changes its type is caught. */
#ifndef CONTRACT_H
#define CONTRACT_H

#include "sinew.h"

#include <stddef.h>
#include <stdint.h>

typedef struct { uint32_t index1; uint32_t generation; } contract_body_id;
typedef struct { uint32_t index1; uint32_t generation; } contract_tool_id;

typedef struct {
    size_t struct_size;
    float gravity[3];
    uint32_t thread_count;
    uint32_t substeps;
    uint32_t max_substeps;
    float tolerance;
    uint32_t reserved;
} contract_world_def;

typedef struct {
    size_t struct_size;
    uint32_t substeps;
    float stable_substep;
    uint32_t bodies_restored;
    float error_estimate;
} contract_step_report;

typedef struct {
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
} contract_body_def;

typedef struct { const float *data; size_t count; size_t stride; } contract_vec3_view;

typedef struct {
    size_t struct_size;
    double kinetic;
    double elastic;
    double gravitational;
} contract_energy;

typedef struct {
    size_t struct_size;
    size_t node_count;
    size_t spring_count;
    size_t bytes_used;
    size_t bytes_reserved;
} contract_storage_report;

typedef struct {
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
} contract_tool_def;

#endif
