"""pyPBD: extended position-based springs, and position-based finite elements."""

from importlib.metadata import version

import numpy as np
import pypbd as pbd

import player
from player import model, settings, substeps

iterations = int(settings["iterations"])
step = model.frame / substeps
damping_factor = float(np.exp(-model.damping * step))

simulation = pbd.Simulation.getCurrent()
simulation.initDefault()
world = simulation.getModel()
count = len(model.positions)
if len(model.tetrahedra):
    world.addTetModel(list(model.positions), model.tetrahedra.flatten().tolist())
    for corners in model.tetrahedra.tolist():
        world.addFEMTetConstraint(*corners, model.young, model.poisson)
else:
    world.addLineModel(count, 0, list(model.positions), [], model.springs.flatten().tolist(), [0] * len(model.springs))
    for a, b in model.springs.tolist():
        world.addDistanceConstraint_XPBD(a, b, model.stiffness)
particles = world.getParticles()
for node, mass in enumerate(model.masses.tolist()):
    particles.setMass(node, mass)
for node in model.pinned.tolist():
    particles.setMass(node, 0.0)
controller = simulation.getTimeStep()
controller.setValueUInt(pbd.TimeStepController.NUM_SUB_STEPS, 1)
controller.setValueUInt(pbd.TimeStepController.MAX_ITERATIONS, iterations)
pbd.TimeManager.getCurrent().setTimeStepSize(step)
# Gravity cannot be set from Python; its default is that of every scene.
assert model.gravity == 9.81


def frame():
    for _ in range(substeps):
        controller.step(world)
        if damping_factor < 1:
            for node in range(count):
                particles.setVelocity(node, np.array(particles.getVelocity(node)) * damping_factor)


def positions():
    return np.array([particles.getPosition(node) for node in range(count)])


player.serve(version("pypbd"), frame, positions)
