// A rigid ball of Bullet's falls onto a soft sheet of sinew's and comes to rest in it: one loop, forces both ways.
//
//   sheet [PICTURE]
//
// In each step Bullet says how fast the ball goes, sinew moves its tool along and says with what force the sheet met it, and Bullet gives the
// ball just that. What momentum the ball has got, gravity's aside, must be what the sheet has given; and in the end the ball's weight
// is what the sheet holds it with, and both weights what the rim bears.
#include <btBulletDynamicsCommon.h>
#include <sinew.hpp>

#include <cmath>
#include <cstdio>
#include <vector>

namespace {

constexpr float DT = 1.0f / 480, RADIUS = 0.03f, MASS = 0.15f, DROP = 0.12f; // s, m, kg, m
constexpr unsigned CELLS = 40;
constexpr float SIDE = 0.3f, GRAVITY = 9.81f; // m, m/s^2

// Bullet's side: a world with one ball in it, which has nothing to collide with.
struct RigidWorld {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
  btSphereShape shape{RADIUS};
  btRigidBody ball;

  explicit RigidWorld(float height) : ball(described(shape)) {
    world.setGravity({0, -GRAVITY, 0});
    btTransform place = btTransform::getIdentity();
    place.setOrigin({0.02f, height, 0.01f});
    ball.setWorldTransform(place);
    ball.setActivationState(DISABLE_DEACTIVATION);
    world.addRigidBody(&ball);
  }
  ~RigidWorld() { world.removeRigidBody(&ball); }

  static btRigidBody::btRigidBodyConstructionInfo described(btSphereShape &shape) {
    btVector3 inertia;
    shape.calculateLocalInertia(MASS, inertia);
    return {MASS, nullptr, &shape, inertia};
  }
};

sinew::vec3 plain(const btVector3 &v) { return {float(v.x()), float(v.y()), float(v.z())}; }
btVector3 bullet(const sinew::vec3 &v) { return {v[0], v[1], v[2]}; }

struct Sheet {
  sinew::world world;
  sinew::body body;
  sinew::tool ball;
  std::vector<std::uint32_t> rim;

  explicit Sheet(const btVector3 &place) {
    const auto mesh = sinew::mesh::cloth({SIDE, SIDE}, {CELLS, CELLS});
    const auto shape = mesh.view();
    sinew::body_def def;
    def.positions = shape.positions, def.node_count = shape.node_count;
    def.triangles = shape.triangles, def.triangle_count = shape.triangle_count;
    def.node_mass = 1e-4f, def.node_damping = 2e-3f, def.stiffness = 120;
    body = world.create_body(def);
    for (std::uint32_t i = 0; i < shape.node_count; i++) {
      const std::uint32_t row = i / (CELLS + 1), column = i % (CELLS + 1);
      if (row % CELLS == 0 || column % CELLS == 0) rim.push_back(i), body.pin(i);
    }
    sinew::tool_def led;
    led.shape = SINEW_SHAPE_SPHERE, led.radius = RADIUS, led.friction = 0.5f;
    const auto at = plain(place);
    for (int k = 0; k < 3; k++) led.position[k] = at[k];
    ball = world.create_tool(led);
  }

  // What the pins bear, N upwards.
  double borne() const {
    double sum = 0;
    for (const auto node : rim) sum += body.pin_force(node)[1];
    return sum;
  }

  double weight() const {
    double mass = 0;
    for (std::uint32_t i = 0; i < body.positions().size(); i++) mass += body.node_mass(i);
    return GRAVITY * mass;
  }
};

bool agree(const char *what, double a, double b, double within) {
  const bool fits = std::fabs(a - b) <= within;
  std::printf("%s: %.5g and %.5g%s\n", what, a, b, fits ? "" : ": they differ");
  return fits;
}

} // namespace

int main(int argc, char **argv) try {
  RigidWorld rigid(RADIUS + DROP);
  Sheet sheet(rigid.ball.getWorldTransform().getOrigin());
  sinew::vec3 impulse{};
  float hardest = 0, lowest = 1;
  const int steps = 6 * 480;
  for (int i = 0; i < steps; i++) {
    // Where the ball is about to be; the sheet meets it on the way, and it feels that in its next step.
    const btTransform &now = rigid.ball.getWorldTransform();
    const btVector3 to = now.getOrigin() + DT * rigid.ball.getLinearVelocity();
    const btQuaternion turn = now.getRotation();
    sheet.ball.set_pose(plain(to), {float(turn.x()), float(turn.y()), float(turn.z()), float(turn.w())});
    sheet.world.step(DT);
    const auto felt = sheet.ball.wrench();
    rigid.ball.applyCentralForce(bullet(felt.force));
    rigid.ball.applyTorque(bullet(felt.torque));
    rigid.world.stepSimulation(DT, 0);
    for (int k = 0; k < 3; k++) impulse[k] += DT * felt.force[k];
    hardest = std::fmax(hardest, felt.force[1]);
    lowest = std::fmin(lowest, float(rigid.ball.getWorldTransform().getOrigin().y()));
  }
  const float force = sheet.ball.wrench().force[1];
  std::printf("down to %.1f mm, at most %.2f N, at rest %.2f N\n", 1e3 * lowest, hardest, force);

  // Momentum: all that the ball has is gravity's and the sheet's.
  const double time = steps * double(DT), given = MASS * double(rigid.ball.getLinearVelocity().y()) + MASS * GRAVITY * time;
  bool right = agree("momentum, what the ball has taken up and the sheet has given, N s", given, impulse[1], 2e-3 * given);
  right &= agree("at rest, the force on the ball and its weight, N", force, MASS * GRAVITY, 0.02 * MASS * GRAVITY);
  right &= agree("at rest, what the rim bears and what ball and sheet weigh, N", std::fabs(sheet.borne()), MASS * GRAVITY + sheet.weight(),
                 0.02 * MASS * GRAVITY);
  right &= lowest < -0.01f && hardest > 2 * MASS * GRAVITY;
  if (!right) return 1;
  if (argc > 1) {
    sinew::picture_def picture;
    picture.show_contacts = 1;
    sheet.world.save_picture(picture, argv[1]);
  }
} catch (const sinew::error &refused) {
  std::fprintf(stderr, "%s\n", refused.what());
  return 1;
}
