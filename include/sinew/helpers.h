// sinew/helpers.h: inline helpers, which are no part of the binary interface.

#ifndef SINEW_HELPERS_H
#define SINEW_HELPERS_H

#include "base.h"

static const sinew_body_id SINEW_NULL_BODY = {0, 0};              ///< Id of no body.
static const sinew_tool_id SINEW_NULL_TOOL = {0, 0};              ///< Id of no tool.
static const sinew_blade_id SINEW_NULL_BLADE = {0, 0};            ///< Id of no blade.
static const sinew_attachment_id SINEW_NULL_ATTACHMENT = {0, 0};  ///< Id of no attachment.

/// Returns 1 if two ids are equal, else 0.
static inline int sinew_body_id_equals(sinew_body_id a, sinew_body_id b) {
  return a.index1 == b.index1 && a.generation == b.generation;
}
/// Returns 1 if two ids are equal, else 0.
static inline int sinew_tool_id_equals(sinew_tool_id a, sinew_tool_id b) {
  return a.index1 == b.index1 && a.generation == b.generation;
}
/// Returns 1 if two ids are equal, else 0.
static inline int sinew_blade_id_equals(sinew_blade_id a, sinew_blade_id b) {
  return a.index1 == b.index1 && a.generation == b.generation;
}
/// Returns 1 if two ids are equal, else 0.
static inline int sinew_attachment_id_equals(sinew_attachment_id a, sinew_attachment_id b) {
  return a.index1 == b.index1 && a.generation == b.generation;
}

/// Returns the 3 floats of vector `i` of a view; `i` is below its count.
static inline const float *sinew_vec3_at(sinew_vec3_view view, size_t i) {
  return (const float *)((const char *)view.data + i * view.stride);
}

#endif
