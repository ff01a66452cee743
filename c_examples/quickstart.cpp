#include <sinew.hpp> // quickstart.c in C++17: objects are destroyed automatically, errors are exceptions
#include <cstdio>

int main() try {
  sinew::world world; // gravity along -y, one thread
  const auto mesh = sinew::mesh::cloth({0.2f, 0.2f}, {20, 20}); // m
  const auto shape = mesh.view();
  sinew::body_def cloth_def;
  cloth_def.positions = shape.positions, cloth_def.node_count = shape.node_count;
  cloth_def.triangles = shape.triangles, cloth_def.triangle_count = shape.triangle_count;
  cloth_def.node_mass = 1e-4f, cloth_def.node_damping = 1e-3f, cloth_def.stiffness = 100; // kg, N s/m, N/m
  auto cloth = world.create_body(cloth_def);
  for (const unsigned corner : {0u, 20u, 420u, 440u}) cloth.pin(corner);
  sinew::tool_def ball_def;
  ball_def.shape = SINEW_SHAPE_SPHERE, ball_def.radius = 0.02f, ball_def.position[1] = 0.03f;
  auto ball = world.create_tool(ball_def);
  float height = ball_def.position[1];
  for (int frame = 0; frame < 60; frame++, height -= 0.001f) {
    ball.set_position({0, height, 0});
    world.step(1.0f / 60);
  }
  const auto nodes = cloth.positions(); // borrowed, not copied
  std::printf("middle of the cloth at %.1f mm, force on the ball %.3f N\n", 1e3 * nodes[220][1], ball.wrench().force[1]);
} catch (const sinew::error &refused) {
  return std::puts(refused.what()), 1;
}
