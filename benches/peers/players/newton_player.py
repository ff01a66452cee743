"""Newton on NVIDIA Warp's processor backend: symplectic Euler, vertex block descent, extended position-based dynamics."""

import numpy as np

import player
from player import model, settings, substeps

import newton
import warp as wp

wp.config.quiet = True
wp.config.verify_fp = False
kind = settings["kind"]
iterations = int(settings.get("iterations", 1))
step = model.frame / substeps
damping_factor = float(np.exp(-model.damping * step))

builder = newton.ModelBuilder(up_axis=newton.Axis.Y, gravity=(0.0, -model.gravity, 0.0))
masses = model.masses.copy()
masses[model.pinned] = 0
for position, mass in zip(model.positions, masses):
    builder.add_particle(wp.vec3(*position), wp.vec3(0.0), float(mass), radius=1e-4)
# The parameters of each solver's law with the same moduli at small strains.
mu, lame_lambda = model.mu, model.lame_lambda
if kind == "semi-implicit":
    mu, lame_lambda = 4 / 3 * mu, lame_lambda + 5 / 6 * mu
for corners in model.tetrahedra.tolist():
    builder.add_tetrahedron(*corners, k_mu=mu, k_lambda=lame_lambda, k_damp=0.0)
for a, b in model.springs.tolist():
    builder.add_spring(a, b, model.stiffness, 0.0, 0)
for *center, radius, _ in model.ball:
    builder.add_shape_sphere(-1, xform=wp.transform(wp.vec3(*center), wp.quat_identity()), radius=radius)
if kind == "vbd":
    builder.color()
world = builder.finalize(device="cpu")
world.particle_max_velocity = 1e6
solver = {
    "semi-implicit": lambda: newton.solvers.SolverSemiImplicit(world, enable_tri_contact=False),
    "vbd": lambda: newton.solvers.SolverVBD(world, iterations=iterations),
    "xpbd": lambda: newton.solvers.SolverXPBD(world, iterations=iterations),
}[kind]()
now, later = world.state(), world.state()
control = world.control()
contacts = world.contacts() if len(model.ball) else None


@wp.kernel
def damp(v: wp.array(dtype=wp.vec3), damping_factor: float):
    v[wp.tid()] = v[wp.tid()] * damping_factor


def advance(count):
    global now, later
    for _ in range(count):
        now.clear_forces()
        if contacts:
            world.collide(now, contacts)
        solver.step(now, later, control, contacts, step)
        now, later = later, now
        if damping_factor < 1:
            wp.launch(damp, dim=len(masses), inputs=[now.particle_qd, damping_factor], device="cpu")


def warm_up():
    """Compiles the kernels and restarts."""
    global now, later
    advance(2)
    start = world.state()
    now.assign(start)
    later.assign(start)


player.serve(f"{newton.__version__}, Warp {wp.__version__}", lambda: advance(substeps), lambda: now.particle_q.numpy(), warm_up)
