"""The cloth in Taichi: symplectic Euler; each node sums the springs to its 8 neighbors in the grid."""

import cloth as common

cloth = common.Cloth()
try:
    import taichi as ti
except ImportError:
    common.refuse("Taichi is not installed (pip install taichi)")

ti.init(arch=ti.cpu, cpu_max_num_threads=cloth.threads, offline_cache=False, log_level=ti.ERROR)
before = common.memory("VmRSS:")

side, dt = cloth.side, cloth.step
shape = (side, side)
x = ti.Vector.field(3, dtype=ti.f32, shape=shape)
v = ti.Vector.field(3, dtype=ti.f32, shape=shape)
x.from_numpy(cloth.positions())

neighbors = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)]
pull = dt * cloth.stiffness / cloth.node_mass


@ti.kernel
def step():
    for node in ti.grouped(x):
        if node[0] > 0:
            velocity = v[node] - ti.Vector([0.0, dt * cloth.gravity, 0.0])
            for i, j in ti.static(neighbors):
                other = node + ti.Vector([i, j])
                if 0 <= other[0] < side and 0 <= other[1] < side:
                    rest = ti.static(cloth.spacing * (i * i + j * j) ** 0.5)
                    d = x[other] - x[node]
                    velocity += pull * (1.0 - rest / d.norm()) * d
            v[node] = velocity
    for node in ti.grouped(x):
        if node[0] > 0:
            x[node] += dt * v[node]


common.serve(cloth, ".".join(map(str, ti.__version__)), before, step, x.to_numpy)
