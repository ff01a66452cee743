// sinew/compat_0_1.h: names and arguments of version 0.1, for one version more.
//
// Define SINEW_COMPAT_0_1 before you include sinew.h. What replaces each name is in
// docs/guide/migration.md.

#ifndef SINEW_COMPAT_0_1_H
#define SINEW_COMPAT_0_1_H

#include "attachment.h"
#include "cutting.h"
#include "diagnostics.h"
#include "haptics.h"
#include "material.h"
#include "more.h"
#include "query.h"
#include "snapshot.h"

// ---- Other names --------------------------------------------------------------------------------

#define sinew_body_rest_state sinew_body_solve_equilibrium
#define sinew_haptic_result sinew_haptic_report
#define sinew_mean_at_nodes sinew_util_average_to_nodes
#define sinew_rest_state_def sinew_equilibrium_def
#define sinew_rest_state_def_init sinew_equilibrium_def_init
#define sinew_rest_state_report sinew_equilibrium_report
#define sinew_tools_get_wrench sinew_world_get_total_wrench
#define sinew_world_get_slipped sinew_world_get_broken_attachments
// Fields.
#define begun has_begun
#define closed is_closed
#define converged has_converged

// ---- Other arguments ----------------------------------------------------------------------------

/// Creates a world from a snapshot.
static inline sinew_status sinew_compat_load_snapshot(const uint8_t *bytes, size_t size, uint32_t thread_count,
                                                      sinew_run_tasks run_tasks, void *tasks_context,
                                                      sinew_world **out) {
  sinew_world_def def;
  const sinew_status status = sinew_world_def_init(&def, sizeof def);
  def.thread_count = thread_count;
  def.run_tasks = run_tasks;
  def.tasks_context = tasks_context;
  return status != SINEW_STATUS_OK ? status : sinew_world_load_snapshot(bytes, size, &def, out);
}

#define sinew_world_load_snapshot(bytes, size, thread_count, run_tasks, tasks_context, out) \
  sinew_compat_load_snapshot(bytes, size, thread_count, run_tasks, tasks_context, out)
#define sinew_body_set_springs(world, body, pairs, count, stiffnesses, rest_lengths) \
  sinew_body_set_springs(world, body, pairs, stiffnesses, rest_lengths, count)
#define sinew_body_set_tear_limits(world, body, pairs, count, strains, forces) \
  sinew_body_set_tear_limits(world, body, pairs, strains, forces, count)

// ---- Attachments and sutures --------------------------------------------------------------------

/// Returns a definition of attachments of nodes, or of points where `nodes` is NULL.
static inline sinew_attachment_def sinew_compat_attachment(sinew_body_id body, const uint32_t *nodes,
                                                           const uint32_t *triangles, const float *weights,
                                                           size_t count, float force_limit) {
  sinew_attachment_def def;
  sinew_attachment_def_init(&def, sizeof def);
  def.body = body;
  def.count = count;
  def.nodes = nodes;
  def.triangles = triangles;
  def.weights = weights;
  def.force_limit = force_limit;
  return def;
}

/// Attaches nodes of a body to a tool.
static inline sinew_status sinew_body_attach_nodes(sinew_world *world, sinew_body_id body, const uint32_t *nodes,
                                                   size_t count, sinew_tool_id tool, float force_limit,
                                                   sinew_attachment_id *out) {
  sinew_attachment_def def = sinew_compat_attachment(body, nodes, NULL, NULL, count, force_limit);
  def.tool = tool;
  return sinew_attachment_create(world, &def, out);
}

/// Attaches one node of a body to a tool.
static inline sinew_status sinew_body_attach_node(sinew_world *world, sinew_body_id body, uint32_t node,
                                                  sinew_tool_id tool, float force_limit, sinew_attachment_id *out) {
  return sinew_body_attach_nodes(world, body, &node, 1, tool, force_limit, out);
}

/// Attaches surface points of a body to a tool.
static inline sinew_status sinew_body_attach_points(sinew_world *world, sinew_body_id body, const uint32_t *triangles,
                                                    const float *weights, size_t count, sinew_tool_id tool,
                                                    float force_limit, sinew_attachment_id *out) {
  sinew_attachment_def def = sinew_compat_attachment(body, NULL, triangles, weights, count, force_limit);
  def.tool = tool;
  return sinew_attachment_create(world, &def, out);
}

/// Attaches nodes of a body to nodes of a body.
static inline sinew_status sinew_body_attach_nodes_to_nodes(sinew_world *world, sinew_body_id body,
                                                            const uint32_t *nodes, size_t count, sinew_body_id other,
                                                            const uint32_t *other_nodes, float force_limit,
                                                            sinew_attachment_id *out) {
  sinew_attachment_def def = sinew_compat_attachment(body, nodes, NULL, NULL, count, force_limit);
  def.other = other;
  def.other_nodes = other_nodes;
  return sinew_attachment_create(world, &def, out);
}

/// Attaches nodes of a body to surface points of a body.
static inline sinew_status sinew_body_attach_nodes_to_points(sinew_world *world, sinew_body_id body,
                                                             const uint32_t *nodes, size_t count, sinew_body_id other,
                                                             const uint32_t *other_triangles,
                                                             const float *other_weights, float force_limit,
                                                             sinew_attachment_id *out) {
  sinew_attachment_def def = sinew_compat_attachment(body, nodes, NULL, NULL, count, force_limit);
  def.other = other;
  def.other_triangles = other_triangles;
  def.other_weights = other_weights;
  return sinew_attachment_create(world, &def, out);
}

/// Attaches surface points of a body to surface points of a body.
static inline sinew_status sinew_body_attach_points_to_points(sinew_world *world, sinew_body_id body,
                                                              const uint32_t *triangles, const float *weights,
                                                              size_t count, sinew_body_id other,
                                                              const uint32_t *other_triangles,
                                                              const float *other_weights, float force_limit,
                                                              sinew_attachment_id *out) {
  sinew_attachment_def def = sinew_compat_attachment(body, NULL, triangles, weights, count, force_limit);
  def.other = other;
  def.other_triangles = other_triangles;
  def.other_weights = other_weights;
  return sinew_attachment_create(world, &def, out);
}

/// Joins two surface points by a thread; `def` is nullable.
static inline sinew_status sinew_body_suture_points(sinew_world *world, sinew_body_id body, uint32_t triangle,
                                                    const float *weights, sinew_body_id other, uint32_t other_triangle,
                                                    const float *other_weights, const sinew_suture_def *def,
                                                    sinew_attachment_id *out) {
  sinew_surface_point points[2];
  for (int i = 0; i < 3; i++) {
    points[0].weights[i] = weights[i];
    points[1].weights[i] = other_weights[i];
    for (int side = 0; side < 2; side++) points[side].position[i] = points[side].normal[i] = 0;
  }
  points[0].struct_size = points[1].struct_size = sizeof points[0];
  points[0].distance = points[1].distance = 0;
  points[0].body = body;
  points[0].triangle = triangle;
  points[1].body = other;
  points[1].triangle = other_triangle;
  return sinew_suture_create(world, &points[0], &points[1], def, out);
}

#endif
