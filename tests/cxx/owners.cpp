// sinew.hpp: owned objects are destroyed once, in any order; errors carry their status and message; views and spans
// agree with C.
#include <sinew.hpp>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

static std::size_t allocations = 0;
void *operator new(std::size_t size) {
  allocations++;
  if (void *memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void *memory) noexcept { std::free(memory); }
void operator delete(void *memory, std::size_t) noexcept { std::free(memory); }

#define EXPECT(condition) expect_that((condition), #condition, __LINE__)
static void expect_that(bool holds, const char *what, int line) {
  if (holds) return;
  std::printf("line %d: %s\n", line, what);
  std::exit(1);
}

template <class Call> static sinew_status refused(Call call, const char *word) {
  try {
    call();
  } catch (const sinew::error &error) {
    EXPECT(std::strstr(error.what(), word) != nullptr);
    return error.status();
  }
  return SINEW_STATUS_OK;
}

template <class Owner> constexpr bool moves_only =
    std::is_nothrow_move_constructible_v<Owner> && !std::is_copy_constructible_v<Owner> && !std::is_copy_assignable_v<Owner>;
static_assert(moves_only<sinew::world> && moves_only<sinew::mesh> && moves_only<sinew::reader> && moves_only<sinew::haptic> &&
              moves_only<sinew::detector> && moves_only<sinew::embedding>);

static sinew::body_def solid(const sinew_mesh_view &shape) {
  sinew::body_def def;
  def.positions = shape.positions, def.node_count = shape.node_count;
  def.tetrahedra = shape.tetrahedra, def.tetrahedron_count = shape.tetrahedron_count;
  def.node_mass = 1e-3f, def.stiffness = 100, def.node_damping = 1e-3f;
  def.spare_nodes = 200;
  return def;
}

static void owners() {
  const auto mesh = sinew::mesh::block({0.1f, 0.1f, 0.1f}, {3, 3, 3});
  const auto shape = mesh.view();
  sinew::world world;
  const sinew_world *raw = world.get();
  auto first = world.create_body(solid(shape)), second = world.create_body(solid(shape));

  sinew::world moved = std::move(world); // its objects still belong to it
  EXPECT(moved.get() == raw && world.get() == nullptr);
  EXPECT(refused([&] { world.step(0.01f); }, "world") == SINEW_STATUS_INVALID_ARGUMENT);
  moved = std::move(*&moved); // self-assignment
  EXPECT(moved.get() == raw);

  sinew::tool_def ball;
  ball.shape = SINEW_SHAPE_SPHERE, ball.radius = 0.01f, ball.position[1] = 0.5f;
  auto tool = moved.create_tool(ball);
  sinew::haptic haptic(tool);
  sinew::reader reader(first);
  sinew::detector detector(first, second);
  sinew::embedding_def fine;
  fine.vertices = shape.positions, fine.vertex_count = shape.node_count;
  fine.triangles = shape.surface, fine.triangle_count = shape.surface_triangle_count;
  sinew::embedding drawn(first, fine);

  first.pin(0);
  const float before = first.positions()[5][1];
  const auto report = moved.step(0.01f);
  EXPECT(report.substeps >= 1);
  const float fallen = first.positions()[5][1] - before;
  EXPECT(fallen < 0 && fallen > -1e-3f * 9.81f); // at most g t^2
  const auto frame = reader.read();
  EXPECT(frame.step == 1 && frame.positions.data[3 * 5 + 1] == first.positions()[5][1]);
  drawn.update(moved.get());
  EXPECT(drawn.positions().size() == shape.node_count && std::fabs(drawn.positions()[5][1] - first.positions()[5][1]) < 1e-6f);
  EXPECT(drawn.triangles().size() == 3 * shape.surface_triangle_count && first.triangles().size() == drawn.triangles().size());
  detector.find(moved.get());
  EXPECT(detector.points(0).size() + detector.edges(0).size() > 0);
  const auto felt = haptic.tick(tool.pose(), {}, {}, 0.001f);
  EXPECT(felt.force[0] == 0);

  // The corner is fixed: the pin balances springs and weight.
  const auto weight = first.pin_force(0);
  EXPECT(std::isfinite(weight[1]));
  first.destroy();
  EXPECT(refused([&] { first.pin(0); }, "body") == SINEW_STATUS_STALE_ID);
  moved = sinew::world(); // destroys the old world and its remaining objects
  EXPECT(reader.read().is_over == 1);
}

static void spans() {
  sinew::world world;
  const auto mesh = sinew::mesh::block({0.1f, 0.1f, 0.1f}, {2, 2, 2});
  auto body = world.create_body(solid(mesh.view()));
  const std::vector<std::uint32_t> nodes = {1, 2};
  const float forces[] = {0, 1, 0, 0, 1, 0};
  body.apply_forces(nodes, forces);
  EXPECT(refused([&] { body.apply_forces(nodes, std::array<float, 3>{}); }, "3 floats") == SINEW_STATUS_INVALID_ARGUMENT);
  EXPECT(refused([&] { body.set_positions(std::array<float, 4>{}); }, "3 floats") == SINEW_STATUS_INVALID_ARGUMENT);
  EXPECT(refused([&] { body.apply_force(1, {NAN, 0, 0}); }, "force") == SINEW_STATUS_INVALID_ARGUMENT);
  world.set_gravity({});
  world.step(0.001f);
  sinew::vec3 momentum{};
  const auto velocities = body.velocities();
  for (std::uint32_t i = 0; i < velocities.size(); i++) momentum[1] += body.node_mass(i) * velocities[i][1];
  EXPECT(std::fabs(momentum[1] - 2e-3f) < 1e-5f); // 2 N for 1 ms
  const float start[] = {-1, 0.03f, -1, 1, 0.03f, -1}, end[] = {-1, 0.03f, 1, 1, 0.03f, 1};
  std::vector<std::uint32_t> pieces(body.positions().size());
  EXPECT(body.pieces(pieces) == 1);
  body.cut(start, end);
  pieces.resize(body.positions().size());
  EXPECT(body.pieces(pieces) == 2);
  std::vector<std::uint8_t> bytes(world.snapshot_size());
  world.save_snapshot(bytes);
  auto again = sinew::world::load_snapshot(bytes);
  world.step(0.001f), again.step(0.001f);
  EXPECT(world.state_hash() == again.state_hash());
  EXPECT(sinew::body(again.get(), body.id).positions().size() == body.positions().size());
  bytes.back() ^= 1;
  EXPECT(refused([&] { sinew::world::load_snapshot(bytes); }, "checksum") == SINEW_STATUS_INVALID_ARGUMENT);
}

// Arrays of equal length; some may be omitted.
static void springs() {
  sinew::world world;
  EXPECT(sinew::version() == SINEW_VERSION);
  EXPECT(std::string(sinew::status_name(SINEW_STATUS_OK)) == "SINEW_STATUS_OK");
  const auto mesh = sinew::mesh::cloth({0.1f, 0.1f}, {2, 2});
  const auto view = mesh.view();
  sinew::body_def def;
  mesh.set(def);
  def.node_mass = 1e-3f, def.stiffness = 20, def.spare_nodes = 50, def.most_tears = 1, def.tear_strain = 0.5f;
  auto body = world.create_body(def);
  const auto bounds = body.max_counts();
  EXPECT(bounds[0] == 9 + 50 && bounds[1] == 8 + 100);
  std::vector<std::uint32_t> pairs(2 * body.storage_report().spring_count);
  body.spring_pairs(pairs);
  const std::size_t count = pairs.size() / 2;
  EXPECT(count == 16);
  std::vector<float> stiffnesses(count), lengths(count), strains(count), forces(count, 1);
  body.springs(pairs, stiffnesses, lengths);
  EXPECT(stiffnesses[3] == 20 && lengths[3] > 0.04f);
  for (auto &length : lengths) length *= 0.5f;
  body.set_springs(pairs, {}, lengths);
  body.spring_strains(pairs, strains);
  EXPECT(std::fabs(strains[5] - 1) < 1e-5f);
  body.spring_strains(pairs, strains, std::vector<float>(count, 0.2f));
  EXPECT(strains[5] < 0);
  body.set_tear_limits(pairs, {}, forces);
  body.tear_limits(pairs, strains, lengths);
  EXPECT(strains[0] == 0.5f && lengths[0] == 1);
  EXPECT(refused([&] { body.springs(pairs, sinew::span<float>(lengths.data(), 1)); }, "each pair") == SINEW_STATUS_INVALID_ARGUMENT);
  std::vector<float> rest(view.positions, view.positions + 27);
  for (auto &coordinate : rest) coordinate *= 0.5f;
  const sinew::span<const std::uint32_t> triangles(view.triangles, 24);
  std::array<sinew_strain, 8> of_triangles{};
  body.triangle_strains(rest, triangles, of_triangles);
  EXPECT(std::fabs(of_triangles[7].largest - 1) < 1e-5f);
  std::array<float, 8> largest{};
  for (std::size_t i = 0; i < 8; i++) largest[i] = of_triangles[i].largest;
  std::array<float, 9> means{};
  sinew::average_to_nodes(triangles, 3, largest, means);
  EXPECT(std::fabs(means[4] - 1) < 1e-5f);

  const auto block = sinew::mesh::block({0.1f, 0.1f, 0.1f}, {1, 1, 1});
  const auto shape = block.view();
  auto filled = world.create_body(solid(shape));
  std::vector<sinew_strain> of_tetrahedra(shape.tetrahedron_count);
  filled.tetrahedron_strains({shape.positions, 3 * shape.node_count}, {shape.tetrahedra, 4 * shape.tetrahedron_count}, of_tetrahedra);
  EXPECT(std::fabs(of_tetrahedra[0].growth) < 1e-5f);
}

// Each node has its own attachment, and nothing is written beyond the array.
static void attachments() {
  sinew::world world;
  const auto mesh = sinew::mesh::block({0.1f, 0.1f, 0.1f}, {2, 2, 2});
  auto first = world.create_body(solid(mesh.view())), second = world.create_body(solid(mesh.view()));
  sinew::tool_def ball;
  ball.shape = SINEW_SHAPE_SPHERE, ball.radius = 0.01f, ball.position[1] = 1;
  auto tool = world.create_tool(ball);
  const std::array<std::uint32_t, 3> nodes = {0, 4, 8}, others = {1, 5, 7};
  std::array<sinew_attachment_id, 5> ids{};
  const sinew::span<sinew_attachment_id> out(&ids[1], nodes.size());
  first.attach(nodes, tool, out);
  EXPECT(ids[0].index1 == 0 && ids[4].index1 == 0);
  world.step(0.001f);
  float weight = 0;
  for (const auto &id : out) {
    sinew::attachment held(world.get(), id);
    weight += held.force()[1];
    held.release();
    EXPECT(refused([&] { held.release(); }, "attachment") == SINEW_STATUS_STALE_ID);
  }
  EXPECT(weight > 0.9f * 3 * 1e-3f * 9.81f); // at least the weight of the three nodes, initially
  first.attach(nodes, second, others, out);
  EXPECT(ids[0].index1 == 0 && ids[4].index1 == 0 && ids[1].index1 != 0 && ids[3].index1 != 0);
  first.attach(2, tool).release();
  EXPECT(refused([&] { first.attach(nodes, tool, ids); }, "out") == SINEW_STATUS_INVALID_ARGUMENT);
  EXPECT(refused([&] { first.attach(nodes, second, {}, out); }, "others") == SINEW_STATUS_INVALID_ARGUMENT);
}

static void poses() {
  sinew::world world;
  sinew::tool_def ball;
  ball.radius = 0.01f;
  auto tool = world.create_tool(ball);
  tool.set_position({0, 1, 0});
  tool.teleport({0, 2, 0}); // a position in braces is not a pose
  EXPECT(tool.pose().position[1] == 2);
  tool.teleport({0, 3, 0}, {0, 0, 0, 1});
  EXPECT(tool.pose().position[1] == 3);
  tool.teleport(sinew::pose{{0, 4, 0}, {0, 0, 0, 1}});
  EXPECT(tool.pose().position[1] == 4);
  sinew::blade_def edge;
  edge.edge[0] = 1;
  auto blade = world.create_blade(edge);
  blade.set_position({0, 1, 0});
  world.step(0.01f);
  EXPECT(blade.pose().position[1] == 1);
}

static void no_allocation_of_its_own() {
  sinew::world world;
  const auto mesh = sinew::mesh::cloth({0.1f, 0.1f}, {4, 4});
  const auto shape = mesh.view();
  sinew::body_def def;
  def.positions = shape.positions, def.node_count = shape.node_count;
  def.triangles = shape.triangles, def.triangle_count = shape.triangle_count;
  def.node_mass = 1e-3f, def.stiffness = 10;
  auto body = world.create_body(def);
  sinew::reader reader(body);
  for (int i = 0; i < 10; i++) world.step(0.01f), reader.read(), body.energy();
}

int main() {
  const std::size_t before = allocations;
  no_allocation_of_its_own();
  EXPECT(allocations == before);
  owners();
  spans();
  springs();
  attachments();
  poses();
  std::puts("ok");
}
