"""The cloth in NVIDIA Warp on the processor: symplectic Euler; each node sums the springs to its 8 neighbors."""

import cloth as common

cloth = common.Cloth()
try:
    import warp as wp
except ImportError:
    common.refuse("Warp is not installed (pip install warp-lang)")

wp.config.quiet = True
wp.init()


@wp.kernel
def kick(x: wp.array(dtype=wp.vec3), v: wp.array(dtype=wp.vec3), side: int, rest: float, pull: float, fall: float):
    node = wp.tid()
    row = node // side
    column = node % side
    if row > 0:
        here = x[node]
        velocity = v[node] - wp.vec3(0.0, fall, 0.0)
        for i in range(-1, 2):
            for j in range(-1, 2):
                inside = row + i >= 0 and row + i < side and column + j >= 0 and column + j < side
                if inside and (i != 0 or j != 0):
                    d = x[node + i * side + j] - here
                    length = rest
                    if i != 0 and j != 0:
                        length = rest * 1.41421356
                    velocity += pull * (1.0 - length / wp.length(d)) * d
        v[node] = velocity


@wp.kernel
def drift(x: wp.array(dtype=wp.vec3), v: wp.array(dtype=wp.vec3), side: int, dt: float):
    node = wp.tid()
    if node >= side:
        x[node] = x[node] + dt * v[node]


wp.load_module(device="cpu")
before = common.memory("VmRSS:")

side, dt = cloth.side, cloth.step
x = wp.array(cloth.positions().reshape(-1, 3), dtype=wp.vec3, device="cpu")
v = wp.zeros(side * side, dtype=wp.vec3, device="cpu")
pull = dt * cloth.stiffness / cloth.node_mass
kick_inputs = [x, v, side, cloth.spacing, pull, dt * cloth.gravity]
first = wp.launch(kick, dim=side * side, inputs=kick_inputs, device="cpu", record_cmd=True)
second = wp.launch(drift, dim=side * side, inputs=[x, v, side, dt], device="cpu", record_cmd=True)


def step():
    first.launch()
    second.launch()


common.serve(cloth, wp.__version__, before, step, lambda: x.numpy().reshape(side, side, 3))
