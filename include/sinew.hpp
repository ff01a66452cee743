// C++17 wrapper of sinew.h: RAII owners, return values and exceptions. It allocates nothing itself.
//
// - Owners (world, mesh, reader, haptic, detector, embedding) are move-only. After a move they are empty, and every call on them fails.
// - body, tool, blade and attachment are copyable ids with a pointer to their world. The world or destroy() destroys the object. Do not
//   use an id after the world was destroyed. The id of a destroyed object is refused, as in C.
// - Threads, units and lifetimes of views are as in sinew/base.h. Several threads can call const functions at the same
//   time. Other functions, and constructors of reader and haptic, need exclusive access to the world.
// - Errors throw sinew::error. Programs without exceptions define SINEW_ON_ERROR(status, message) before they include this file; it
//   must not return. To handle a status as a value, call the C function with get(), or with world() and id.
#ifndef SINEW_HPP
#define SINEW_HPP

#include "sinew.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <iterator>
#include <limits>
#include <type_traits>
#include <utility>

namespace sinew {

using vec3 = std::array<float, 3>;
using quat = std::array<float, 4>; // x y z w
constexpr float no_limit = std::numeric_limits<float>::infinity();

// An error with the message of the library, stored inside.
class error : public std::exception {
public:
  error(sinew_status status, const char *message) noexcept : status_(status) {
    std::size_t length = 0;
    for (; message[length] && length + 1 < sizeof message_; length++) message_[length] = message[length];
    message_[length] = 0;
  }
  const char *what() const noexcept override { return message_; }
  sinew_status status() const noexcept { return status_; }

private:
  sinew_status status_;
  char message_[512];
};

[[noreturn]] inline void fail(sinew_status status, const char *message) {
#ifdef SINEW_ON_ERROR
  SINEW_ON_ERROR(status, message);
#else
  throw error(status, message);
#endif
}

inline void check(sinew_status status) {
  if (status == SINEW_STATUS_OK) return;
  char message[512] = "";
  sinew_last_error(message, sizeof message);
  fail(status, message);
}

inline void expect(bool fits, const char *otherwise) {
  if (!fits) fail(SINEW_STATUS_INVALID_ARGUMENT, otherwise);
}

// A pointer and a count; converts from arrays and from types with data() and size().
template <class T> class span {
public:
  constexpr span() = default;
  constexpr span(T *data, std::size_t size) : data_(data), size_(size) {}
  template <class Items, class = std::enable_if_t<std::is_convertible_v<decltype(std::data(std::declval<Items &>())), T *>>>
  constexpr span(Items &&items) : data_(std::data(items)), size_(std::size(items)) {}
  constexpr T *data() const { return data_; }
  constexpr std::size_t size() const { return size_; }
  constexpr T *begin() const { return data_; }
  constexpr T *end() const { return data_ + size_; }
  constexpr T &operator[](std::size_t i) const { return data_[i]; }

private:
  T *data_ = nullptr;
  std::size_t size_ = 0;
};

// Borrowed vectors with a stride.
template <class View> struct vectors : View {
  std::size_t size() const { return this->count; }
  auto operator[](std::size_t i) const {
    return reinterpret_cast<decltype(View::data)>(reinterpret_cast<const char *>(this->data) + i * this->stride);
  }
};
using vec3_view = vectors<sinew_vec3_view>;
using dvec3_view = vectors<sinew_dvec3_view>;

// A definition, initialized with its defaults.
template <class Def, sinew_status (*Init)(Def *, std::size_t)> struct definition : Def {
  definition() : Def() { check(Init(this, sizeof(Def))); }
};
using debug_draw_def = definition<sinew_debug_draw, sinew_debug_draw_init>;
using world_def = definition<sinew_world_def, sinew_world_def_init>;
using body_def = definition<sinew_body_def, sinew_body_def_init>;
using equilibrium_def = definition<sinew_equilibrium_def, sinew_equilibrium_def_init>;
using tool_def = definition<sinew_tool_def, sinew_tool_def_init>;
using attachment_def = definition<sinew_attachment_def, sinew_attachment_def_init>;
using suture_def = definition<sinew_suture_def, sinew_suture_def_init>;
using blade_def = definition<sinew_blade_def, sinew_blade_def_init>;
using haptic_def = definition<sinew_haptic_def, sinew_haptic_def_init>;
using picture_def = definition<sinew_picture_def, sinew_picture_def_init>;
using detector_def = definition<sinew_detector_def, sinew_detector_def_init>;
using embedding_def = definition<sinew_embedding_def, sinew_embedding_def_init>;

// A struct that the library fills; its size is set.
template <class Report> Report sized() {
  Report report{};
  report.struct_size = sizeof report;
  return report;
}

template <class Raw, void (*Destroy)(Raw *)> class owner {
public:
  owner() = default;
  explicit owner(Raw *raw) noexcept : raw_(raw) {} // takes it over
  owner(owner &&other) noexcept : raw_(other.release()) {}
  owner &operator=(owner &&other) noexcept {
    if (this != &other) Destroy(std::exchange(raw_, other.release()));
    return *this;
  }
  ~owner() { Destroy(raw_); }
  Raw *get() const noexcept { return raw_; }
  Raw *release() noexcept { return std::exchange(raw_, nullptr); } // whoever has it destroys it
  explicit operator bool() const noexcept { return raw_ != nullptr; }

private:
  Raw *raw_ = nullptr;
};

// An object of a world, by its id.
template <class Id> class part {
public:
  part() = default;
  part(sinew_world *world, Id given) noexcept : id(given), world_(world) {}
  sinew_world *world() const noexcept { return world_; }
  Id id{};

private:
  sinew_world *world_ = nullptr;
};

struct wrench {
  vec3 force, torque; // N; N m
};
struct pose {
  vec3 position;
  quat orientation;
};
// Collision bits.
struct filter {
  std::uint32_t category, mask;
};
struct box {
  vec3 min, max; // m
};

class mesh : public owner<sinew_mesh, sinew_mesh_destroy> {
public:
  using owner::owner;
  static mesh load(const char *path, std::uint32_t format = 0, float scale = 1) {
    return made([&](auto out) { return sinew_mesh_load(path, format, scale, out); });
  }
  static mesh cloth(std::array<float, 2> size, std::array<std::uint32_t, 2> cells) {
    return made([&](auto out) { return sinew_mesh_create_cloth(size.data(), cells.data(), out); });
  }
  static mesh block(vec3 size, std::array<std::uint32_t, 3> cells) {
    return made([&](auto out) { return sinew_mesh_create_block(size.data(), cells.data(), out); });
  }
  static mesh lattice(float edge, std::array<std::uint32_t, 3> cells) {
    return made([&](auto out) { return sinew_mesh_create_lattice(edge, cells.data(), out); });
  }
  static mesh organ(float length, float spacing) {
    return made([&](auto out) { return sinew_mesh_create_organ(length, spacing, out); });
  }
  // Copies a mesh from memory, welded and cleaned.
  static mesh create(span<const float> positions, span<const std::uint32_t> triangles, span<const std::uint32_t> tetrahedra = {}) {
    return made([&](auto out) {
      return sinew_mesh_create(positions.data(), positions.size() / 3, triangles.data(), triangles.size() / 3, tetrahedra.data(),
                               tetrahedra.size() / 4, out);
    });
  }
  // Fills the closed surface of this mesh with tetrahedra.
  mesh filled(float spacing) const {
    return made([&](auto out) { return sinew_mesh_create_filled(get(), spacing, out); });
  }
  // Sets the nodes and elements of a definition to those of this mesh, which must outlive its use.
  void set(body_def &def) const { check(sinew_body_def_set_mesh(&def, get())); }
  sinew_mesh_view view() const {
    auto out = sized<sinew_mesh_view>();
    return check(sinew_mesh_get_view(get(), &out)), out;
  }

private:
  template <class Create> static mesh made(Create create) {
    sinew_mesh *raw = nullptr;
    return check(create(&raw)), mesh(raw);
  }
};

class attachment : public part<sinew_attachment_id> {
public:
  using part::part;
  void release() { check(sinew_attachment_release(world(), id)); }
  bool is_valid() const { return sinew_attachment_is_valid(world(), id) != 0; }
  vec3 force() const {
    vec3 out{};
    return check(sinew_attachment_get_force(world(), id, out.data())), out;
  }
  // For sutures:
  void set_length(float length) { check(sinew_suture_set_length(world(), id, length)); }
  sinew_suture_report suture_report() const {
    auto out = sized<sinew_suture_report>();
    return check(sinew_suture_get_report(world(), id, &out)), out;
  }
};

class tool : public part<sinew_tool_id> {
public:
  using part::part;
  void destroy() { check(sinew_tool_destroy(world(), id)); }
  bool is_valid() const { return sinew_tool_is_valid(world(), id) != 0; }
  void set_user_data(void *data) { check(sinew_tool_set_user_data(world(), id, data)); }
  void *user_data() const {
    void *out = nullptr;
    return check(sinew_tool_get_user_data(world(), id, &out)), out;
  }
  float friction() const {
    float out = 0;
    return check(sinew_tool_get_friction(world(), id, &out)), out;
  }
  float force_limit() const {
    float out = 0;
    return check(sinew_tool_get_force_limit(world(), id, &out)), out;
  }
  filter collision() const {
    filter out{};
    return check(sinew_tool_get_collision(world(), id, &out.category, &out.mask)), out;
  }
  void set_position(vec3 position) { check(sinew_tool_set_pose(world(), id, position.data(), nullptr)); }
  void set_pose(vec3 position, quat orientation) {
    check(sinew_tool_set_pose(world(), id, position.data(), orientation.data()));
  }
  void set_friction(float friction) { check(sinew_tool_set_friction(world(), id, friction)); }
  void set_force_limit(float limit) { check(sinew_tool_set_force_limit(world(), id, limit)); }
  void set_collision(std::uint32_t category, std::uint32_t mask) {
    check(sinew_tool_set_collision(world(), id, category, mask));
  }
  sinew::pose pose() const {
    sinew::pose out{};
    return check(sinew_tool_get_pose(world(), id, out.position.data(), out.orientation.data())), out;
  }
  sinew::pose target() const {
    sinew::pose out{};
    return check(sinew_tool_get_target(world(), id, out.position.data(), out.orientation.data())), out;
  }
  sinew_mass_properties mass_of_density(float density) const {
    auto out = sized<sinew_mass_properties>();
    return check(sinew_tool_get_mass_of_density(world(), id, density, &out)), out;
  }
  void set_mass(const sinew_mass_properties &mass) { check(sinew_tool_set_mass(world(), id, &mass)); }
  void make_kinematic() { check(sinew_tool_set_mass(world(), id, nullptr)); }
  sinew_mass_properties mass() const { // all zero where the tool is kinematic
    auto out = sized<sinew_mass_properties>();
    return check(sinew_tool_get_mass(world(), id, &out)), out;
  }
  void set_velocity(vec3 velocity, vec3 angular = {}) {
    check(sinew_tool_set_velocity(world(), id, velocity.data(), angular.data()));
  }
  vec3 velocity() const {
    vec3 out{};
    return check(sinew_tool_get_velocity(world(), id, out.data(), nullptr)), out;
  }
  vec3 angular_velocity() const {
    vec3 out{};
    return check(sinew_tool_get_velocity(world(), id, nullptr, out.data())), out;
  }
  void apply(const sinew::wrench &of) { check(sinew_tool_apply_wrench(world(), id, of.force.data(), of.torque.data())); }
  void teleport(vec3 position) { check(sinew_tool_teleport(world(), id, position.data(), nullptr)); }
  void teleport(vec3 position, quat orientation) {
    check(sinew_tool_teleport(world(), id, position.data(), orientation.data()));
  }
  template <class Pose, class = std::enable_if_t<std::is_same_v<Pose, sinew::pose>>> void teleport(const Pose &to) { // no braces
    teleport(to.position, to.orientation);
  }
  sinew::wrench wrench() const {
    sinew::wrench out{};
    return check(sinew_tool_get_wrench(world(), id, out.force.data(), out.torque.data())), out;
  }
  float force_error() const { // N
    float out = 0;
    return check(sinew_tool_get_force_error(world(), id, &out)), out;
  }
  std::size_t contacts(span<sinew_contact> into) const { // how many there are
    std::size_t count = 0;
    return check(sinew_tool_get_contacts(world(), id, into.data(), into.size(), &count)), count;
  }
};

class blade : public part<sinew_blade_id> {
public:
  using part::part;
  void destroy() { check(sinew_blade_destroy(world(), id)); }
  bool is_valid() const { return sinew_blade_is_valid(world(), id) != 0; }
  sinew::pose pose() const {
    sinew::pose out{};
    return check(sinew_blade_get_pose(world(), id, out.position.data(), out.orientation.data())), out;
  }
  std::size_t contacts(span<sinew_contact> into) const { // one for each body; how many there are
    std::size_t count = 0;
    return check(sinew_blade_get_contacts(world(), id, into.data(), into.size(), &count)), count;
  }
  void set_position(vec3 position) { check(sinew_blade_set_pose(world(), id, position.data(), nullptr)); }
  void set_pose(vec3 position, quat orientation) {
    check(sinew_blade_set_pose(world(), id, position.data(), orientation.data()));
  }
  void set_collision(std::uint32_t category, std::uint32_t mask) {
    check(sinew_blade_set_collision(world(), id, category, mask));
  }
  filter collision() const {
    filter out{};
    return check(sinew_blade_get_collision(world(), id, &out.category, &out.mask)), out;
  }
  sinew_blade_report report() const {
    auto out = sized<sinew_blade_report>();
    return check(sinew_blade_get_report(world(), id, &out)), out;
  }
};

class body : public part<sinew_body_id> {
public:
  using part::part;
  using nodes = span<const std::uint32_t>;
  using floats = span<const float>;
  void destroy() { check(sinew_body_destroy(world(), id)); }
  bool is_valid() const { return sinew_body_is_valid(world(), id) != 0; }
  void set_user_data(void *data) { check(sinew_body_set_user_data(world(), id, data)); }
  void *user_data() const { return viewed<void *>(sinew_body_get_user_data); }

  // Rotates about the pivot, then translates; the default pivot is the center of the bounding box.
  void transform(vec3 translation, quat rotation = {0, 0, 0, 1}, const vec3 *pivot = nullptr) {
    check(sinew_body_transform(world(), id, translation.data(), rotation.data(), pivot ? pivot->data() : nullptr));
  }
  box bounds() const {
    box out{};
    return check(sinew_body_get_bounds(world(), id, out.min.data(), out.max.data())), out;
  }
  // Writes 3 floats for each node.
  void normals(span<float> into) const {
    expect(into.size() % 3 == 0, "3 floats for each node");
    check(sinew_body_get_normals(world(), id, into.data(), into.size() / 3));
  }
  void masses(span<float> into) const { check(sinew_body_get_masses(world(), id, into.data(), into.size())); }
  void apply_impulses(nodes at, floats impulses) {
    expect(impulses.size() == 3 * at.size(), "impulses: 3 floats for each node");
    check(sinew_body_apply_impulses(world(), id, at.data(), impulses.data(), at.size()));
  }
  void set_gravity_scale(float scale) { check(sinew_body_set_gravity_scale(world(), id, scale)); }
  float gravity_scale() const { return viewed<float>(sinew_body_get_gravity_scale); }
  void set_acceleration(vec3 acceleration) { check(sinew_body_set_acceleration(world(), id, acceleration.data())); }
  vec3 acceleration() const {
    vec3 out{};
    return check(sinew_body_get_acceleration(world(), id, out.data())), out;
  }
  std::size_t contacts(span<sinew_contact> into) const { // with bodies; how many there are
    std::size_t count = 0;
    return check(sinew_body_get_contacts(world(), id, into.data(), into.size(), &count)), count;
  }
  float pressure() const { return viewed<float>(sinew_body_get_pressure); }
  void set(const sinew_body_settings &settings) { check(sinew_body_set_settings(world(), id, &settings)); }
  sinew_body_settings settings() const { return reported<sinew_body_settings>(sinew_body_get_settings); }
  void set_node_damping(float damping) { check(sinew_body_set_node_damping(world(), id, damping)); }
  float node_damping(std::uint32_t node) const {
    float out = 0;
    return check(sinew_body_get_node_damping(world(), id, node, &out)), out;
  }
  filter collision() const {
    filter out{};
    return check(sinew_body_get_collision(world(), id, &out.category, &out.mask)), out;
  }
  void pin(nodes held) { check(sinew_body_pin_nodes(world(), id, held.data(), held.size())); }
  void unpin(nodes held) { check(sinew_body_unpin_nodes(world(), id, held.data(), held.size())); }
  std::size_t pin_box(vec3 min, vec3 max) { // how many nodes are pinned there
    std::size_t count = 0;
    return check(sinew_body_pin_box(world(), id, min.data(), max.data(), &count)), count;
  }
  std::size_t unpin_box(vec3 min, vec3 max) {
    std::size_t count = 0;
    return check(sinew_body_unpin_box(world(), id, min.data(), max.data(), &count)), count;
  }
  // Writes 3 floats for each node.
  void pin_forces(span<float> into) const {
    expect(into.size() % 3 == 0, "3 floats for each node");
    check(sinew_body_get_pin_forces(world(), id, into.data(), into.size() / 3));
  }

  vec3_view positions() const { return viewed<vec3_view>(sinew_body_get_positions); }
  vec3_view velocities() const { return viewed<vec3_view>(sinew_body_get_velocities); }
  span<const std::uint32_t> triangles() const { // 3 for each
    const auto view = viewed<sinew_triangle_view>(sinew_body_get_triangles);
    return {view.data, 3 * view.count};
  }
  void set_positions(floats positions) { check(sinew_body_set_positions(world(), id, positions.data(), thirds(positions))); }
  void set_velocities(floats velocities) { check(sinew_body_set_velocities(world(), id, velocities.data(), thirds(velocities))); }
  void apply_force(std::uint32_t node, vec3 force) { check(sinew_body_apply_force(world(), id, node, force.data())); }
  void apply_forces(nodes at, floats forces) {
    expect(forces.size() == 3 * at.size(), "forces: 3 floats for each node");
    check(sinew_body_apply_forces(world(), id, at.data(), forces.data(), at.size()));
  }
  bool is_closed() const { return viewed<std::uint32_t>(sinew_body_is_closed) != 0; }
  void set_collision(std::uint32_t category, std::uint32_t mask) {
    check(sinew_body_set_collision(world(), id, category, mask));
  }

  void pin(std::uint32_t node) { check(sinew_body_pin(world(), id, node)); }
  void pin_axes(std::uint32_t node, std::uint32_t axes) { check(sinew_body_pin_axes(world(), id, node, axes)); }
  void unpin(std::uint32_t node) { check(sinew_body_unpin(world(), id, node)); }
  void move_pin(std::uint32_t node, vec3 to) { check(sinew_body_move_pin(world(), id, node, to.data())); }
  vec3 pin_force(std::uint32_t node) const {
    vec3 out{};
    return check(sinew_body_get_pin_force(world(), id, node, out.data())), out;
  }

  void add_spring(std::uint32_t a, std::uint32_t b, float stiffness, float rest_length) {
    check(sinew_body_add_spring(world(), id, a, b, stiffness, rest_length));
  }
  void remove_spring(std::uint32_t a, std::uint32_t b) { check(sinew_body_remove_spring(world(), id, a, b)); }
  // Springs are pairs of two nodes each. One of two arrays of numbers can be empty: it is then not written, or not changed.
  void spring_pairs(span<std::uint32_t> into) const { // 2 for each spring of the storage report
    check(sinew_body_get_spring_pairs(world(), id, into.data(), halves(nodes(into.data(), into.size()))));
  }
  void springs(nodes pairs, span<float> stiffnesses, span<float> rest_lengths = {}) const {
    const auto count = halves(pairs, stiffnesses.size(), rest_lengths.size());
    check(sinew_body_get_springs(world(), id, pairs.data(), count, stiffnesses.data(), rest_lengths.data()));
  }
  void set_springs(nodes pairs, floats stiffnesses, floats rest_lengths = {}) {
    const auto count = halves(pairs, stiffnesses.size(), rest_lengths.size());
    check(sinew_body_set_springs(world(), id, pairs.data(), stiffnesses.data(), rest_lengths.data(), count));
  }
  void tear_limits(nodes pairs, span<float> strains, span<float> forces = {}) const {
    const auto count = halves(pairs, strains.size(), forces.size());
    check(sinew_body_get_tear_limits(world(), id, pairs.data(), count, strains.data(), forces.data()));
  }
  void set_tear_limits(nodes pairs, floats strains, floats forces = {}) {
    const auto count = halves(pairs, strains.size(), forces.size());
    check(sinew_body_set_tear_limits(world(), id, pairs.data(), strains.data(), forces.data(), count));
  }
  // Relative to these rest lengths, or to those of the springs if they are empty.
  void spring_strains(nodes pairs, span<float> into, floats rest_lengths = {}) const {
    const auto count = halves(pairs, into.size(), rest_lengths.size());
    check(sinew_body_get_spring_strains(world(), id, pairs.data(), rest_lengths.data(), count, into.data()));
  }
  void triangle_strains(floats rest_positions, nodes corners, span<sinew_strain> into) const {
    expect(corners.size() == 3 * into.size(), "corners: 3 nodes for each strain");
    check(sinew_body_get_triangle_strains(world(), id, rest_positions.data(), thirds(rest_positions), corners.data(), into.size(), into.data()));
  }
  void tetrahedron_strains(floats rest_positions, nodes corners, span<sinew_strain> into) const {
    expect(corners.size() == 4 * into.size(), "corners: 4 nodes for each strain");
    check(sinew_body_get_tetrahedron_strains(world(), id, rest_positions.data(), thirds(rest_positions), corners.data(), into.size(), into.data()));
  }
  void scale_region(nodes of, float stiffness_factor, float length_factor) {
    check(sinew_body_scale_region(world(), id, of.data(), of.size(), stiffness_factor, length_factor));
  }
  void set_pressure(float pressure) { check(sinew_body_set_pressure(world(), id, pressure)); }

  sinew_cut_report cut(span<const float> start, span<const float> end) { // the edge, two points each, before and after
    expect(start.size() == 6 && end.size() == 6, "start, end: the 6 floats of an edge each");
    auto out = sized<sinew_cut_report>();
    return check(sinew_body_cut(world(), id, start.data(), end.data(), &out)), out;
  }
  sinew_topology_changes changes_since(std::uint64_t version) const {
    auto out = sized<sinew_topology_changes>();
    return check(sinew_body_get_topology_changes(world(), id, version, &out)), out;
  }
  std::uint32_t pieces(span<std::uint32_t> piece_of_node) const { // how many there are
    std::uint32_t count = 0;
    return check(sinew_body_get_pieces(world(), id, piece_of_node.data(), piece_of_node.size(), &count)), count;
  }
  std::array<std::uint32_t, 2> max_counts() const { // nodes and triangles after all cuts and tears
    std::array<std::uint32_t, 2> out{};
    return check(sinew_body_get_max_counts(world(), id, &out[0], &out[1])), out;
  }
  float node_mass(std::uint32_t node) const {
    float out = 0;
    return check(sinew_body_get_node_mass(world(), id, node, &out)), out;
  }

  float awake_share() const { return viewed<float>(sinew_body_get_awake_share); }
  void wake() { check(sinew_body_wake(world(), id)); }
  sinew_equilibrium_report solve_equilibrium(const equilibrium_def &def = {}) {
    auto out = sized<sinew_equilibrium_report>();
    return check(sinew_body_solve_equilibrium(world(), id, &def, &out)), out;
  }
  sinew_energy energy() const { return reported<sinew_energy>(sinew_body_get_energy); }
  sinew_storage_report storage_report() const { return reported<sinew_storage_report>(sinew_body_get_storage_report); }
  sinew_solver_report solver_report() const { return reported<sinew_solver_report>(sinew_body_get_solver_report); }
  sinew_enclosed_report enclosed_report() const { return reported<sinew_enclosed_report>(sinew_body_get_enclosed_report); }
  sinew_tear_report tear_report() const { return reported<sinew_tear_report>(sinew_body_get_tear_report); }

  attachment attach(std::uint32_t node, const tool &to, float force_limit = no_limit) {
    attachment_def def;
    def.nodes = &node, def.count = 1, def.tool = to.id, def.force_limit = force_limit;
    sinew_attachment_id made{};
    return attach(def, {&made, 1}), attachment(world(), made);
  }
  // Creates an attachment for each node and writes their ids to `out`; use them as sinew::attachment(world(), id).
  void attach(nodes held, const tool &to, span<sinew_attachment_id> out, float force_limit = no_limit) {
    attachment_def def;
    def.nodes = held.data(), def.count = held.size(), def.tool = to.id, def.force_limit = force_limit;
    attach(def, out);
  }
  void attach(nodes held, const body &other, nodes others, span<sinew_attachment_id> out, float force_limit = no_limit) {
    expect(held.size() == others.size(), "others: as many as there are nodes");
    attachment_def def;
    def.nodes = held.data(), def.count = held.size(), def.other = other.id, def.other_nodes = others.data();
    def.force_limit = force_limit;
    attach(def, out);
  }
  // Attaches nodes or points of this body to a tool or a body, by a definition.
  void attach(attachment_def def, span<sinew_attachment_id> out) {
    expect(out.size() == def.count, "out: as many as there are attachments");
    def.body = id;
    check(sinew_attachment_create(world(), &def, out.data()));
  }
  attachment suture(std::uint32_t triangle, vec3 weights, const body &other, std::uint32_t other_triangle, vec3 other_weights,
                    const suture_def &def = {}) {
    return suture(point(id, triangle, weights), point(other.id, other_triangle, other_weights), def);
  }
  // For points that rays and queries return.
  attachment suture(const sinew_surface_point &one, const sinew_surface_point &other, const suture_def &def = {}) {
    sinew_attachment_id made{};
    return check(sinew_suture_create(world(), &one, &other, &def, &made)), attachment(world(), made);
  }

private:
  std::size_t thirds(floats given) const {
    expect(given.size() % 3 == 0, "3 floats for each node");
    return given.size() / 3;
  }
  // The number of pairs; each array has as many numbers, or none.
  std::size_t halves(nodes pairs, std::size_t first = 0, std::size_t second = 0) const {
    const std::size_t count = pairs.size() / 2;
    expect(pairs.size() % 2 == 0, "pairs: 2 nodes each");
    expect((first == 0 || first == count) && (second == 0 || second == count), "a number for each pair");
    return count;
  }
  template <class Out, class Get> Out viewed(Get get) const {
    Out out{};
    return check(get(world(), id, &out)), out;
  }
  template <class Out, class Get> Out reported(Get get) const {
    auto out = sized<Out>();
    return check(get(world(), id, &out)), out;
  }
  static sinew_surface_point point(sinew_body_id body, std::uint32_t triangle, vec3 weights) {
    auto out = sized<sinew_surface_point>();
    out.body = body, out.triangle = triangle;
    for (std::size_t i = 0; i < 3; i++) out.weights[i] = weights[i];
    return out;
  }
};

// Access to a body from another thread.
class reader : public owner<sinew_reader, sinew_reader_destroy> {
public:
  reader() = default;
  explicit reader(const body &of) : owner(made(of)) {}
  sinew_frame read() {
    auto out = sized<sinew_frame>();
    return check(sinew_reader_read(get(), &out)), out;
  }

private:
  static sinew_reader *made(const body &of) {
    sinew_reader *raw = nullptr;
    return check(sinew_reader_create(of.world(), of.id, &raw)), raw;
  }
};

// A fine render surface bound to a coarse body.
class embedding : public owner<sinew_embedding, sinew_embedding_destroy> {
public:
  using owner::owner;
  embedding(const body &in, const embedding_def &def) : owner(made(in, def)) {}
  void update(const sinew_world *world) { check(sinew_embedding_update(get(), world)); }
  void update_from(span<const float> positions) {
    expect(positions.size() % 3 == 0, "3 floats for each node");
    check(sinew_embedding_update_from(get(), positions.data(), positions.size() / 3));
  }
  vec3_view positions() const { return viewed(sinew_embedding_get_positions); }
  vec3_view normals() { return viewed(sinew_embedding_get_normals); }
  span<const std::uint32_t> triangles() const { // 3 for each
    sinew_triangle_view view{};
    check(sinew_embedding_get_triangles(get(), &view));
    return {view.data, 3 * view.count};
  }

private:
  template <class Get> vec3_view viewed(Get read) const {
    vec3_view out{};
    return check(read(get(), &out)), out;
  }
  static sinew_embedding *made(const body &in, const embedding_def &def) {
    sinew_embedding *raw = nullptr;
    return check(sinew_embedding_create(in.world(), in.id, &def, &raw)), raw;
  }
};

// The device thread's access to a tool.
class haptic : public owner<sinew_haptic, sinew_haptic_destroy> {
public:
  haptic() = default;
  haptic(const tool &led, haptic_def def = {}) : owner(made(led, def)) {}
  sinew_haptic_report tick(const pose &device, vec3 velocity, vec3 angular_velocity, float dt) {
    auto out = sized<sinew_haptic_report>();
    check(sinew_haptic_tick(get(), device.position.data(), device.orientation.data(), velocity.data(), angular_velocity.data(), dt, &out));
    return out;
  }
  std::size_t contacts(span<sinew_haptic_contact> into) const {
    std::size_t count = 0;
    return check(sinew_haptic_get_contacts(get(), into.data(), into.size(), &count)), count;
  }

private:
  static sinew_haptic *made(const tool &led, haptic_def &def) {
    sinew_haptic *raw = nullptr;
    def.tool = led.id;
    return check(sinew_haptic_create(led.world(), &def, &raw)), raw;
  }
};

// The overlap of two bodies.
class detector : public owner<sinew_detector, sinew_detector_destroy> {
public:
  detector() = default;
  detector(const body &first, const body &second, detector_def def = {}) : owner(made(first, second, def)) {}
  sinew_detector_report find(const sinew_world *world) {
    auto out = sized<sinew_detector_report>();
    return check(sinew_detector_find(get(), world, &out)), out;
  }
  span<const sinew_point_inside> points(std::uint32_t side) const {
    return listed<sinew_point_inside>(sinew_detector_get_points, side);
  }
  span<const sinew_edge_inside> edges(std::uint32_t side) const {
    return listed<sinew_edge_inside>(sinew_detector_get_edges, side);
  }
  dvec3_view gradient(std::uint32_t side) const {
    dvec3_view out{};
    return check(sinew_detector_get_gradient(get(), side, &out)), out;
  }

private:
  template <class Item, class Get> span<const Item> listed(Get list, std::uint32_t side) const {
    const Item *items = nullptr;
    std::size_t count = 0;
    return check(list(get(), side, &items, &count)), span<const Item>(items, count);
  }
  static sinew_detector *made(const body &first, const body &second, detector_def &def) {
    sinew_detector *raw = nullptr;
    def.bodies[0] = first.id, def.bodies[1] = second.id;
    return check(sinew_detector_create(first.world(), &def, &raw)), raw;
  }
};

class world : public owner<sinew_world, sinew_world_destroy> {
public:
  explicit world(const world_def &def = {}) : owner(made(def)) {}
  explicit world(sinew_world *raw) noexcept : owner(raw) {}

  sinew_step_report step(float dt) {
    auto out = sized<sinew_step_report>();
    return check(sinew_world_step(get(), dt, &out)), out;
  }
  sinew_step_report step_with_budget(float dt, std::uint32_t work) {
    auto out = sized<sinew_step_report>();
    return check(sinew_world_step_with_budget(get(), dt, work, &out)), out;
  }
  sinew_step_report step_within(float dt, double seconds) {
    auto out = sized<sinew_step_report>();
    return check(sinew_world_step_within(get(), dt, seconds, &out)), out;
  }
  void drop_lag() { check(sinew_world_drop_lag(get())); }
  void set_substeps(std::uint32_t substeps, std::uint32_t most) { check(sinew_world_set_substeps(get(), substeps, most)); }
  std::array<std::uint32_t, 2> substeps() const {
    std::array<std::uint32_t, 2> out{};
    return check(sinew_world_get_substeps(get(), &out[0], &out[1])), out;
  }
  void set_gravity(vec3 gravity) { check(sinew_world_set_gravity(get(), gravity.data())); }
  vec3 gravity() const {
    vec3 out{};
    return check(sinew_world_get_gravity(get(), out.data())), out;
  }
  double time() const {
    double out = 0;
    return check(sinew_world_get_time(get(), &out, nullptr)), out;
  }
  std::uint64_t step_count() const {
    std::uint64_t out = 0;
    return check(sinew_world_get_time(get(), nullptr, &out)), out;
  }
  void set_user_data(void *data) { check(sinew_world_set_user_data(get(), data)); }
  void *user_data() const {
    void *out = nullptr;
    return check(sinew_world_get_user_data(get(), &out)), out;
  }
  void set_profiling(bool enabled) { check(sinew_world_set_profiling(get(), enabled)); }
  bool profiling() const {
    std::uint32_t out = 0;
    return check(sinew_world_get_profiling(get(), &out)), out != 0;
  }
  sinew_profile profile() const { // of the last step, where profiling is on
    auto out = sized<sinew_profile>();
    return check(sinew_world_get_profile(get(), &out)), out;
  }
  void debug_draw(const debug_draw_def &def) const { check(sinew_world_debug_draw(get(), &def)); }
  void start_recording(const char *path) { check(sinew_world_start_recording(get(), path)); }
  std::uint64_t stop_recording() { // how many steps were recorded
    std::uint64_t out = 0;
    return check(sinew_world_stop_recording(get(), &out)), out;
  }
  sinew_ray_hit cast_ray(vec3 origin, vec3 direction, float max_distance, filter of) const { // of bodies and tools
    auto out = sized<sinew_ray_hit>();
    check(sinew_world_cast_ray_filtered(get(), origin.data(), direction.data(), max_distance, of.category, of.mask, &out));
    return out;
  }
  std::uint64_t state_hash() const {
    std::uint64_t out = 0;
    return check(sinew_world_get_state_hash(get(), &out)), out;
  }
  std::size_t snapshot_size() const {
    std::size_t out = 0;
    return check(sinew_world_get_snapshot_size(get(), &out)), out;
  }
  // Writes snapshot_size() bytes.
  void save_snapshot(span<std::uint8_t> bytes) const { check(sinew_world_save_snapshot(get(), bytes.data(), bytes.size())); }
  // Its bodies and tools are sinew::body(world.get(), id) and so on.
  // Uses the threads of the definition.
  static world load_snapshot(span<const std::uint8_t> bytes, const world_def &def = {}) {
    sinew_world *raw = nullptr;
    return check((sinew_world_load_snapshot)(bytes.data(), bytes.size(), &def, &raw)), world(raw); // no macro of compat_0_1.h
  }

  body create_body(const body_def &def) {
    sinew_body_id made{};
    return check(sinew_body_create(get(), &def, &made)), body(get(), made);
  }
  std::pair<body, embedding> create_body_from_surface(const body_def &def, float spacing) {
    sinew_body_id made{};
    sinew_embedding *drawn = nullptr;
    check(sinew_body_create_from_surface(get(), &def, spacing, &made, &drawn));
    return {body(get(), made), embedding(drawn)};
  }
  tool create_tool(const tool_def &def) {
    sinew_tool_id made{};
    return check(sinew_tool_create(get(), &def, &made)), tool(get(), made);
  }
  blade create_blade(const blade_def &def) {
    sinew_blade_id made{};
    return check(sinew_blade_create(get(), &def, &made)), blade(get(), made);
  }

  sinew::wrench wrench(span<const sinew_tool_id> tools, vec3 about) const {
    sinew::wrench out{};
    check(sinew_world_get_total_wrench(get(), tools.data(), tools.size(), about.data(), out.force.data(), out.torque.data()));
    return out;
  }
  std::size_t contact_changes(span<sinew_contact_change> into) const {
    std::size_t count = 0;
    return check(sinew_world_get_contact_changes(get(), into.data(), into.size(), &count)), count;
  }
  std::size_t contact_changes(span<sinew_body_contact_change> into) const { // of bodies with each other and blades
    std::size_t count = 0;
    return check(sinew_world_get_body_contact_changes(get(), into.data(), into.size(), &count)), count;
  }
  std::size_t broken_attachments(span<sinew_attachment_id> into) const {
    std::size_t count = 0;
    return check(sinew_world_get_broken_attachments(get(), into.data(), into.size(), &count)), count;
  }
  sinew_surface_point cast_ray(vec3 origin, vec3 direction, float max_distance) const { // body.index1 is 0 where nothing is hit
    auto out = sized<sinew_surface_point>();
    return check(sinew_world_cast_ray(get(), origin.data(), direction.data(), max_distance, &out)), out;
  }
  sinew_surface_point find_nearest(vec3 point, float max_distance) const {
    auto out = sized<sinew_surface_point>();
    return check(sinew_world_find_nearest(get(), point.data(), max_distance, &out)), out;
  }
  void save_picture(const picture_def &def, const char *path) const { check(sinew_world_save_picture(get(), &def, path)); }
  void save_picture(const picture_def &def, span<const sinew_body_values> coloured, const char *path) const {
    check(sinew_world_save_picture_of_values(get(), &def, coloured.data(), coloured.size(), path));
  }

private:
  static sinew_world *made(const world_def &def) {
    sinew_world *raw = nullptr;
    return check(sinew_world_create(&def, &raw)), raw;
  }
};

// Sets the log callback, for messages up to a level from all threads; nullptr turns it off.
inline void set_log_callback(std::uint32_t level, sinew_log callback, void *context = nullptr) {
  check(sinew_set_log_callback(level, callback, context));
}
struct log_callback {
  std::uint32_t level;
  sinew_log callback;
  void *context;
};
inline log_callback get_log_callback() {
  log_callback out{};
  return check(sinew_get_log_callback(&out.level, &out.callback, &out.context)), out;
}

// Sets the allocator of the library, in a build with that feature; call it before any other function.
struct allocator {
  sinew_alloc alloc;
  sinew_dealloc dealloc;
  void *context;
};
inline void set_allocator(const allocator &of) { check(sinew_set_allocator(of.alloc, of.dealloc, of.context)); }
inline allocator get_allocator() { // nullptr: the system's
  allocator out{};
  return check(sinew_get_allocator(&out.alloc, &out.dealloc, &out.context)), out;
}

// Replays a recording, up to the first step whose state differs.
inline sinew_replay_report replay(const char *path, std::uint32_t thread_count = 1) {
  auto out = sized<sinew_replay_report>();
  return check(sinew_replay(path, thread_count, &out)), out;
}

inline std::uint32_t version() { return sinew_version(); } // of the library; SINEW_VERSION is that of the header
inline const char *status_name(sinew_status status) { return sinew_status_name(status); }

// For each node the mean over its elements, which have this number of corners.
inline void average_to_nodes(span<const std::uint32_t> elements, std::uint32_t corners, span<const float> values, span<float> into) {
  expect(elements.size() == corners * values.size(), "values: one for each element");
  check(sinew_util_average_to_nodes(elements.data(), corners, values.data(), values.size(), into.data(), into.size()));
}

inline sinew_material_preset material_preset(std::uint32_t preset) {
  auto out = sized<sinew_material_preset>();
  return check(sinew_material_get_preset(preset, &out)), out;
}

} // namespace sinew

#endif
