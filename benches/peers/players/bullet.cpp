// Scenes in Bullet, with the protocol of src/players/serve.rs. The measuring program compiles it if Bullet is
// installed.

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <BulletSoftBody/btDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableGravityForce.h>
#include <BulletSoftBody/btDeformableMassSpringForce.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btDeformableNeoHookeanForce.h>
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

namespace {

// Bullet's own solver fixes the number of Newton iterations per step.
struct Solver : btDeformableBodySolver {
    explicit Solver(int iterations) {
        if (iterations > 1) m_maxNewtonIterations = iterations, m_newtonTolerance = 0;
    }
};

struct Model {
    std::map<std::string, double> numbers;
    std::vector<btVector3> positions;
    std::vector<double> masses;
    std::vector<int> pinned, tetrahedra, springs, triangles;
    double ball[5] = {0, 0, 0, 0, 0};

    explicit Model(const char *path) {
        std::ifstream file(path);
        std::string name;
        double value;
        while (file >> name >> value) {
            const int count = int(value);
            auto read = [&](std::vector<int> &numbers, int width) {
                numbers.resize(std::size_t(count) * width);
                for (int &number : numbers) file >> number;
            };
            if (name == "nodes") {
                for (int node = 0; node < count; ++node) {
                    double x, y, z, mass;
                    file >> x >> y >> z >> mass;
                    positions.emplace_back(btScalar(x), btScalar(y), btScalar(z));
                    masses.push_back(mass);
                }
            } else if (name == "pinned") {
                read(pinned, 1);
            } else if (name == "tetrahedra") {
                read(tetrahedra, 4);
            } else if (name == "springs") {
                read(springs, 2);
            } else if (name == "triangles") {
                read(triangles, 3);
            } else if (name == "ball") {
                for (double &number : ball) file >> number;
            } else {
                numbers[name] = value;
            }
        }
    }
    double operator[](const char *name) const { return numbers.at(name); }
    double or_else(const char *name, double value) const { return numbers.count(name) ? numbers.at(name) : value; }
    int bodies() const { return int(or_else("bodies", 1)); }

    // One of several equal bodies.
    Model body(int index) const {
        Model single = *this;
        const int count = bodies(), size = int(positions.size()) / count;
        single.positions.assign(positions.begin() + index * size, positions.begin() + (index + 1) * size);
        single.masses.assign(masses.begin() + index * size, masses.begin() + (index + 1) * size);
        auto take = [&](std::vector<int> &to, const std::vector<int> &from) {
            const std::size_t width = from.size() / count;
            to.assign(from.begin() + index * width, from.begin() + (index + 1) * width);
            for (int &node : to) node -= index * size;
        };
        take(single.tetrahedra, tetrahedra);
        take(single.triangles, triangles);
        return single;
    }
};

double processor_seconds() {
    timespec time;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

// Each iteration removes this fraction of a link's stretch. All iterations together then move a single spring like an
// implicit Euler step of the same stiffness.
btScalar fraction_per_iteration(double stiffness, double step, double mass, int iterations) {
    const double ratio = stiffness * step * step / mass;
    return btScalar(1.0 - std::pow(1.0 - ratio / (1.0 + ratio), 1.0 / iterations));
}

btSoftBody *build(const Model &model, btSoftBodyWorldInfo &info, const std::string &kind, int iterations, double step) {
    std::vector<btScalar> masses(model.masses.begin(), model.masses.end());
    std::vector<bool> is_pinned(masses.size(), false);
    for (int node : model.pinned) {
        masses[node] = 0;  // A mass of 0 pins a node in Bullet.
        is_pinned[node] = true;
    }
    auto *body = new btSoftBody(&info, int(masses.size()), model.positions.data(), masses.data());
    btSoftBody::Material *free_links = body->m_materials[0], *pinned_links = body->appendMaterial();
    const bool links = kind == "links";
    if (links) {
        free_links->m_kLST = fraction_per_iteration(model["stiffness"], step, model.masses[0] / 2, iterations);
        pinned_links->m_kLST = fraction_per_iteration(model["stiffness"], step, model.masses[0], iterations);
    }
    for (std::size_t spring = 0; spring < model.springs.size(); spring += 2) {
        const int a = model.springs[spring], b = model.springs[spring + 1];
        body->appendLink(a, b, is_pinned[a] || is_pinned[b] ? pinned_links : free_links);
    }
    for (std::size_t corner = 0; corner < model.tetrahedra.size(); corner += 4) {
        const int *corners = &model.tetrahedra[corner];
        body->appendTetra(corners[0], corners[1], corners[2], corners[3]);
    }
    if (!model.tetrahedra.empty()) {
        body->m_tetraScratches.resize(body->m_tetras.size());
        body->m_tetraScratchesTn.resize(body->m_tetras.size());
        body->initializeDmInverse();
    }
    body->m_cfg.piterations = iterations;
    body->m_cfg.kDP = links ? btScalar(1 - std::exp(-model["damping"] * step)) : 0;
    body->m_cfg.drag = 0;
    for (std::size_t corner = 0; corner < model.triangles.size(); corner += 3)
        body->appendFace(model.triangles[corner], model.triangles[corner + 1], model.triangles[corner + 2]);
    body->getCollisionShape()->setMargin(btScalar(1e-3));
    body->m_cfg.kDF = btScalar(model.or_else("friction", 0));
    body->m_cfg.kCHR = 1;
    body->m_cfg.collisions = model.triangles.empty() ? 0
                             : links                 ? btSoftBody::fCollision::SDF_RS
                                                     : btSoftBody::fCollision::SDF_RD | btSoftBody::fCollision::SDF_RDN;
    if (model.bodies() > 1) {
        body->m_cfg.collisions |= btSoftBody::fCollision::VF_DD;
        body->initializeFaceTree();
    }
    body->m_dampingCoefficient = 0;
    body->m_sleepingThreshold = 0;
    body->setActivationState(DISABLE_DEACTIVATION);
    return body;
}

}  // namespace

int main(int count, char **arguments) {
    if (count < 3) return 2;
    const Model model(arguments[1]);
    std::map<std::string, std::string> settings;
    for (int argument = 3; argument < count; ++argument) {
        const std::string setting = arguments[argument];
        const std::size_t sign = setting.find('=');
        settings[setting.substr(0, sign)] = setting.substr(sign + 1);
    }
    const std::string kind = settings["kind"];
    const int substeps = std::atoi(settings["substeps"].c_str());
    const int iterations = settings.count("iterations") ? std::atoi(settings["iterations"].c_str()) : 1;
    const double step = model["frame"] / substeps;
    const btVector3 gravity(0, btScalar(-model["gravity"]), 0);

    btSoftBodyRigidBodyCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    btDbvtBroadphase broadphase;
    std::unique_ptr<btDeformableBodySolver> deformable_solver;
    std::unique_ptr<btSequentialImpulseConstraintSolver> solver;
    std::unique_ptr<btDiscreteDynamicsWorld> world;
    std::vector<std::unique_ptr<btDeformableLagrangianForce>> forces;
    std::vector<btSoftBody *> bodies;
    if (kind == "links") {
        solver = std::make_unique<btSequentialImpulseConstraintSolver>();
        auto owned = std::make_unique<btSoftRigidDynamicsWorld>(&dispatcher, &broadphase, solver.get(), &configuration);
        auto *soft = owned.get();
        world = std::move(owned);
        soft->setGravity(gravity);
        soft->getWorldInfo().m_gravity = gravity;
        soft->getWorldInfo().air_density = 0;
        soft->getWorldInfo().m_sparsesdf.setDefaultVoxelsz(btScalar(0.01));
        soft->getWorldInfo().m_sparsesdf.Reset();
        for (int index = 0; index < model.bodies(); ++index) {
            bodies.push_back(build(model.body(index), soft->getWorldInfo(), kind, iterations, step));
            soft->addSoftBody(bodies.back());
        }
    } else {
        deformable_solver = std::make_unique<Solver>(iterations);
        auto constraints = std::make_unique<btDeformableMultiBodyConstraintSolver>();
        constraints->setDeformableSolver(deformable_solver.get());
        auto owned = std::make_unique<btDeformableMultiBodyDynamicsWorld>(&dispatcher, &broadphase, constraints.get(),
                                                                          &configuration, deformable_solver.get());
        auto *soft = owned.get();
        world = std::move(owned);
        solver = std::move(constraints);
        soft->setGravity(gravity);
        soft->getWorldInfo().m_gravity = gravity;
        soft->getWorldInfo().m_sparsesdf.setDefaultVoxelsz(btScalar(0.01));
        soft->getWorldInfo().m_sparsesdf.Reset();
        for (int index = 0; index < model.bodies(); ++index) {
            bodies.push_back(build(model.body(index), soft->getWorldInfo(), kind, iterations, step));
            soft->addSoftBody(bodies.back());
        }
        auto add = [&](btDeformableLagrangianForce *force) {
            forces.emplace_back(force);
            for (btSoftBody *body : bodies) soft->addForce(body, force);
        };
        add(new btDeformableGravityForce(gravity));
        if (model.tetrahedra.empty()) {
            add(new btDeformableMassSpringForce(btScalar(model["stiffness"]), 0, false));
        } else {
            // Parameters of the law with the same moduli at small strains (Smith, de Goes, Kim 2018).
            const double mu = model["young"] / (2 * (1 + model["poisson"]));
            const double lambda = 2 * mu * model["poisson"] / (1 - 2 * model["poisson"]);
            add(new btDeformableNeoHookeanForce(btScalar(4.0 / 3.0 * mu), btScalar(lambda + 5.0 / 6.0 * mu), 0));
        }
        soft->setImplicit(kind == "implicit");
        // Without projection, the implicit solver of version 3.24 does not move any node.
        soft->setUseProjection(kind == "implicit");
    }
    btSphereShape sphere(btScalar(model.ball[3]));
    std::unique_ptr<btRigidBody> ball, ground;
    auto ball_after = [&](double frames) {
        const double drop = model.ball[4] * model["frame"] * std::fmin(frames, std::floor(2 * model["frames"] / 3));
        return btTransform(btQuaternion::getIdentity(),
                           btVector3(btScalar(model.ball[0]), btScalar(model.ball[1] - drop), btScalar(model.ball[2])));
    };
    if (model.ball[3] > 0) {
        ball = std::make_unique<btRigidBody>(0, nullptr, &sphere);
        ball->setFriction(0);
        ball->setWorldTransform(ball_after(0));
        ball->setCollisionFlags(ball->getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
        ball->setActivationState(DISABLE_DEACTIVATION);
        world->addRigidBody(ball.get());
    }
    btBoxShape box(btVector3(10, 1, 10));
    if (model.or_else("floor", 0) > 0) {
        ground = std::make_unique<btRigidBody>(0, nullptr, &box);
        ground->setFriction(btScalar(model["friction"]));
        ground->setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(0, -1, 0)));
        world->addRigidBody(ground.get());
    }
    std::printf("version %d.%02d\n", btGetVersion() / 100, btGetVersion() % 100);
    std::fflush(stdout);

    // The deformable bodies have no damping against the world: velocities are scaled between steps.
    const btScalar damping_factor = kind == "links" ? btScalar(1) : btScalar(std::exp(-model["damping"] * step));
    std::FILE *file = std::fopen(arguments[2], "wb");
    double spent = 0;
    for (int frame = 0; frame < int(model["frames"]); ++frame) {
        const double start = processor_seconds();
        for (int substep = 0; substep < substeps; ++substep) {
            if (ball && model.ball[4] > 0) {
                const btTransform from = ball->getWorldTransform(), to = ball_after(frame + double(substep + 1) / substeps);
                ball->setLinearVelocity((to.getOrigin() - from.getOrigin()) / btScalar(step));
                ball->setWorldTransform(to);
            }
            world->stepSimulation(btScalar(step), 0);
            // Diverging bodies become ever slower in Bullet, so this is reported at once.
            for (btSoftBody *body : bodies)
                for (int node = 0; node < body->m_nodes.size(); ++node) {
                    if (!(body->m_nodes[node].m_v.length2() < btScalar(1e6))) {
                        std::printf("refused it diverges\n");
                        std::fflush(stdout);
                        std::_Exit(0);
                    }
                    if (damping_factor < 1) body->m_nodes[node].m_v *= damping_factor;
                }
        }
        spent += processor_seconds() - start;
        for (btSoftBody *body : bodies)
            for (int node = 0; node < body->m_nodes.size(); ++node) {
                const btVector3 &position = body->m_nodes[node].m_x;
                const double numbers[3] = {position.x(), position.y(), position.z()};
                std::fwrite(numbers, sizeof numbers, 1, file);
            }
        std::fflush(file);
        std::printf("frame %.9g\n", spent);
        std::fflush(stdout);
    }
    std::fclose(file);
    std::_Exit(0);
}
