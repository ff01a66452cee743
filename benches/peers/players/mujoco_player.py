"""MuJoCo's flexible bodies: one body with three sliding joints per node."""

import math

import mujoco

import player
from player import model, settings, substeps


def xml():
    bodies, names = [], []
    pinned = set(model.pinned.tolist())
    for node, (position, mass) in enumerate(zip(model.positions, model.masses)):
        names.append(f"n{node}")
        x, y, z = map(repr, position.tolist())
        joints = "" if node in pinned else "".join(
            f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1")
        )
        bodies.append(
            f'<body name="n{node}" pos="{x} {y} {z}">{joints}'
            f'<inertial pos="0 0 0" mass="{float(mass)!r}" diaginertia="1e-6 1e-6 1e-6"/></body>'
        )
    if len(model.tetrahedra):
        dimension, elements = 3, model.tetrahedra
        law = f'<elasticity young="{model.young!r}" poisson="{model.poisson!r}" damping="0"/>'
    else:
        dimension, elements = 1, model.springs
        law = f'<edge stiffness="{model.stiffness!r}" damping="0"/>'
    geometry, contact = "", 'contype="0" conaffinity="0"'
    for x, y, z, radius, _ in model.ball:
        geometry = f'<geom type="sphere" size="{radius}" pos="{x} {y} {z}" condim="1"/>'
        contact = 'contype="1" conaffinity="1" condim="1"'
    elements = " ".join(map(str, elements.flatten().tolist()))
    return f"""<mujoco>
      <compiler boundmass="0" boundinertia="0"/>
      <option gravity="0 {-model.gravity!r} 0" timestep="{model.frame / substeps!r}" integrator="{settings['integrator']}"/>
      <size memory="2G"/>
      <worldbody>{geometry}{''.join(bodies)}</worldbody>
      <deformable>
        <flex name="body" dim="{dimension}" body="{' '.join(names)}" element="{elements}" radius="0.001">
          {law}<contact {contact} selfcollide="none"/>
        </flex>
      </deformable>
    </mujoco>"""


try:
    world = mujoco.MjModel.from_xml_string(xml())
except ValueError as error:
    player.refuse(f"MuJoCo does not take it: {error}")
data = mujoco.MjData(world)
W = mujoco.mjtWarning
# MuJoCo resets the scene after these warnings, so that nothing is left to compare.
FATAL = {W.mjWARN_INERTIA: False, W.mjWARN_BADQPOS: True, W.mjWARN_BADQVEL: True, W.mjWARN_BADQACC: True}
said = set()
mujoco.mj_forward(world, data)


damping_factor = math.exp(-model.damping * model.frame / substeps)


def frame():
    if damping_factor == 1:
        mujoco.mj_step(world, data, substeps)
    else:
        # Nodes cannot be damped against the world: velocities are scaled between steps.
        for _ in range(substeps):
            mujoco.mj_step(world, data)
            data.qvel *= damping_factor
    for kind, is_fatal in FATAL.items():
        if data.warning[kind].number and (is_fatal or kind not in said):
            said.add(kind)
            if is_fatal:
                player.refuse("it diverges")
            player.say("note", f"{settings['integrator']}, {substeps} steps a frame: {kind.name}")


player.serve(mujoco.__version__, frame, lambda: data.xpos[1:])
