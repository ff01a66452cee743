// The cloth in Bullet, with the protocol of src/protocol.rs. The measuring program compiles it if Bullet is installed.

#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <limits>
#include <string>
#include <vector>

# Each iteration removes this fraction of a link's stretch. All iterations together then move a single spring like an
# implicit Euler step of the same stiffness.
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

namespace {

struct Cloth {
    int side;
    double spacing, node_mass, stiffness, gravity, step;
};

constexpr int position_iterations = 4;

// Each iteration takes a share of a link's stretch away. The share with which all of them together move a lone spring
// as an implicit Euler step of the same stiffness would.
double fraction_per_iteration(const Cloth &cloth, double mass) {
    const double ratio = cloth.stiffness * cloth.step * cloth.step / mass;
    return 1.0 - std::pow(1.0 - ratio / (1.0 + ratio), 1.0 / position_iterations);
}

// The value of a line of /proc/self/status, in bytes.
long long memory(const char *name) {
    long long kibibytes = 0;
    char line[256];
    if (FILE *status = std::fopen("/proc/self/status", "r")) {
        while (std::fgets(line, sizeof line, status))
            if (std::strncmp(line, name, std::strlen(name)) == 0) kibibytes = std::atoll(line + std::strlen(name));
        std::fclose(status);
    }
    return kibibytes * 1024;
}

using Visit = std::function<void(int, int, bool straight)>;

void each_spring(int side, const Visit &visit) {
    for (int row = 0; row < side; ++row)
        for (int column = 0; column < side; ++column) {
            const int node = row * side + column;
            const bool right = column + 1 < side, below = row + 1 < side;
            if (right) visit(node, node + 1, true);
            if (below) visit(node, node + side, true);
            if (right && below) visit(node, node + side + 1, false);
            if (right && below) visit(node + 1, node + side, false);
        }
}

btSoftBody *build(const Cloth &cloth, btSoftBodyWorldInfo &info) {
    const int count = cloth.side * cloth.side;
    std::vector<btVector3> positions(count);
    std::vector<btScalar> masses(count, btScalar(cloth.node_mass));
    for (int node = 0; node < count; ++node) {
        const int row = node / cloth.side, column = node % cloth.side;
        positions[node].setValue(btScalar(column * cloth.spacing), 0, btScalar(row * cloth.spacing));
        if (row == 0) masses[node] = 0;  // A mass of 0 pins a node in Bullet.
    }
    auto *body = new btSoftBody(&info, count, positions.data(), masses.data());
    btSoftBody::Material *free_links = body->m_materials[0];
    free_links->m_kLST = btScalar(fraction_per_iteration(cloth, cloth.node_mass / 2));
    btSoftBody::Material *pinned_links = body->appendMaterial();
    pinned_links->m_kLST = btScalar(fraction_per_iteration(cloth, cloth.node_mass));
    body->m_links.reserve(4 * count);
    each_spring(cloth.side, [&](int a, int b, bool) {
        body->appendLink(a, b, a < cloth.side || b < cloth.side ? pinned_links : free_links);
    });
    body->m_cfg.piterations = position_iterations;
    body->m_cfg.kDP = 0;
    body->m_cfg.collisions = 0;
    body->setActivationState(DISABLE_DEACTIVATION);
    return body;
}

void report(const Cloth &cloth, const btSoftBody &body, long long before) {
    const long long resident = memory("VmRSS:"), peak = memory("VmHWM:");
    double sum = 0, max = -std::numeric_limits<double>::infinity(), height = 0;
    long long count = 0;
    each_spring(cloth.side, [&](int a, int b, bool straight) {
        const double rest = straight ? cloth.spacing : cloth.spacing * std::sqrt(2.0);
        const double stretch = (body.m_nodes[b].m_x - body.m_nodes[a].m_x).length() / rest - 1;
        sum += stretch;
        max = std::fmax(max, stretch);
        ++count;
    });
    for (int node = 0; node < body.m_nodes.size(); ++node) height += body.m_nodes[node].m_x.y();
    const double mean = sum / count;
    std::printf("{\"body_bytes\":%lld,\"peak_bytes\":%lld", resident - before, peak);
    if (std::isfinite(mean))
        std::printf(",\"mean_stretch\":%.9g,\"max_stretch\":%.9g,\"mean_height\":%.9g", mean, max,
                    height / body.m_nodes.size());
    std::printf("}\n");
}

}  // namespace

int main(int argument_count, char **arguments) {
    if (argument_count != 8) {
        std::fprintf(stderr, "bullet_cloth <threads> <side> <spacing> <node mass> <stiffness> <gravity> <step>\n");
        return 2;
    }
    auto number = [&](int index) { return std::atof(arguments[index]); };
    const Cloth cloth{std::atoi(arguments[2]), number(3), number(4), number(5), number(6), number(7)};
    if (std::atoi(arguments[1]) != 1) {
        std::printf("{\"refused\":\"one thread only\"}\n");
        return 0;
    }
    btSoftBodyRigidBodyCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    btSoftRigidDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
    const btVector3 gravity(0, btScalar(-cloth.gravity), 0);
    world.setGravity(gravity);
    world.getWorldInfo().m_gravity = gravity;
    const long long before = memory("VmRSS:");
    btSoftBody *body = build(cloth, world.getWorldInfo());
    world.addSoftBody(body);
    std::printf("{\"version\":\"%d.%02d\"}\n", btGetVersion() / 100, btGetVersion() % 100);
    std::fflush(stdout);

    char line[64];
    while (std::fgets(line, sizeof line, stdin)) {
        int steps = 0;
        if (std::sscanf(line, "steps %d", &steps) == 1) {
            std::printf("{\"milliseconds\":[");
            for (int step = 0; step < steps; ++step) {
                const auto start = std::chrono::steady_clock::now();
                world.stepSimulation(btScalar(cloth.step), 0);
                const std::chrono::duration<double, std::milli> taken = std::chrono::steady_clock::now() - start;
                std::printf(step == 0 ? "%.6f" : ",%.6f", taken.count());
            }
            std::printf("]}\n");
        } else {
            report(cloth, *body, before);
        }
        std::fflush(stdout);
    }
    world.removeSoftBody(body);
    delete body;
}
