"""The Physics-Based Animation Toolkit: vertex block descent and extended position-based dynamics."""

from importlib.metadata import version

import numpy as np

import player
from player import model, settings, substeps

from pbatoolkit import _pbat

iterations = int(settings["iterations"])
step = model.frame / substeps
X = np.asfortranarray(model.positions.T)
T = np.asfortranarray(model.tetrahedra.T)
count = X.shape[1]
weight = np.zeros_like(X)
weight[1] = -model.gravity
weight[:, model.pinned] = 0
# The law's lambda for the same moduli at small strains.
lame = np.vstack([np.full(T.shape[1], model.mu), np.full(T.shape[1], model.lame_lambda + model.mu)])
damping_factor = np.exp(-model.damping * step)


def vbd():
    sim = _pbat.sim.vbd
    data = (
        sim.Data()
        .with_volume_mesh(X, T)
        .with_surface_mesh(np.zeros(0, dtype=np.int64), np.zeros((3, 0), dtype=np.int64))
        .with_velocity(np.zeros_like(X))
        .with_acceleration(np.asfortranarray(weight))
        .with_material(np.full(T.shape[1], 1.0), lame[0].copy(), lame[1].copy())
        .with_dirichlet_vertices(model.pinned)
        .with_initialization_strategy(sim.InitializationStrategy.Inertia)
        .construct()
    )
    data.m = model.masses.copy()
    return sim.Integrator(data)


def xpbd():
    sim = _pbat.sim.xpbd
    inverse = 1.0 / model.masses
    inverse[model.pinned] = 0
    from pbatoolkit.py.sim.xpbd import partition_mesh_constraints

    pointers, constraints = partition_mesh_constraints(X, T)[:2]
    edges = model.positions[model.tetrahedra]
    edges = edges[:, 1:] - edges[:, :1]
    volume = np.linalg.det(edges) / 6
    compliance = np.vstack([1 / (lame[0] * volume), 1 / (lame[1] * volume)]).flatten(order="F")
    data = (
        sim.Data()
        .with_volume_mesh(X, T)
        # The integrator requires a surface; this one has no contacts.
        .with_surface_mesh(np.arange(3), np.arange(3).reshape(3, 1))
        .with_velocity(np.zeros_like(X))
        .with_acceleration(np.asfortranarray(weight))
        .with_mass_inverse(inverse)
        .with_elastic_material(np.asfortranarray(lame))
        .with_compliance(compliance, sim.Constraint.StableNeoHookean)
        .with_damping(np.zeros(2 * T.shape[1]), sim.Constraint.StableNeoHookean)
        .with_partitions(list(map(int, pointers)), list(map(int, constraints)))
        .with_dirichlet_vertices(model.pinned)
        .construct()
    )
    return sim.Integrator(data)


integrator = vbd() if settings["kind"] == "vbd" else xpbd()


def frame():
    if damping_factor == 1:
        integrator.step(model.frame, iterations, substeps)
        return
    # There is no damping against the world: velocities are scaled between steps.
    for _ in range(substeps):
        integrator.step(step, iterations, 1)
        integrator.v = np.asfortranarray(integrator.v * damping_factor)


player.serve(version("pbatoolkit"), frame, lambda: np.array(integrator.x).T)
