"""Steps a net of masses and springs with Taichi, as its own mass-spring examples do: one kernel over the springs with atomic
sums, one over the nodes; the same semi-implicit steps as ffe-run.

Usage: ela_taichi.py FILE STEP STEPS THREADS RUNS f32|f64   Prints the times in ms. FILE: node and spring counts (uint64), then per
node position, mass, drag, outer force, 1 where it moves (nine doubles), per spring ends, stiffness, damping, rest (five
doubles). The displacements (doubles) replace it. Status 3 if there is no Taichi.
"""

import os
import sys
import time

os.environ["ENABLE_TAICHI_HEADER_PRINT"] = "False"
os.environ["TI_LOG_LEVEL"] = "error"
try:
    import numpy
    import taichi
except ImportError:
    sys.exit(3)


def main():
    path, h, steps, threads, runs, precision = sys.argv[1], float(sys.argv[2]), *map(int, sys.argv[3:6]), sys.argv[6]
    real = taichi.f64 if precision == "f64" else taichi.f32
    out = os.dup(1)
    os.dup2(2, 1)  # it greets there
    taichi.init(arch=taichi.cpu, cpu_max_num_threads=threads, default_fp=real, log_level=taichi.ERROR)
    os.dup2(out, 1)
    nodes, springs = map(int, numpy.fromfile(path, numpy.uint64, 2))
    numbers = numpy.fromfile(path, numpy.float64, offset=16)
    node = numbers[: 9 * nodes].reshape(nodes, 9)
    spring = numbers[9 * nodes :].reshape(springs, 5)

    def field(values, type=real):
        shape = values.shape[:1]
        result = taichi.Vector.field(values.shape[1], type, shape) if values.ndim == 2 else taichi.field(type, shape)
        result.from_numpy(numpy.ascontiguousarray(values))
        return result

    start = node[:, 0:3]
    x, v, f = field(start), field(0 * start), field(0 * start)
    mass, drag, outer, moves = field(node[:, 3]), field(node[:, 4]), field(node[:, 5:8]), field(node[:, 8])
    ends = field(spring[:, 0:2].astype(numpy.int32), taichi.i32)
    stiffness, damping, rest = field(spring[:, 2]), field(spring[:, 3]), field(spring[:, 4])

    @taichi.kernel
    def step():
        for i in f:
            f[i] = outer[i] - drag[i] * v[i]
        for s in stiffness:
            i, j = ends[s][0], ends[s][1]
            d = x[j] - x[i]
            length = d.norm()
            n = d / length
            pull = (stiffness[s] * (length - rest[s]) + damping[s] * (v[j] - v[i]).dot(n)) * n
            f[i] += pull
            f[j] -= pull
        for i in f:
            v[i] += moves[i] * h / mass[i] * f[i]
            x[i] += h * v[i]

    step()
    times = []
    for _ in range(runs):
        x.from_numpy(start.astype(numpy.float64 if precision == "f64" else numpy.float32))
        v.fill(0)
        taichi.sync()
        begin = time.perf_counter()
        for _ in range(steps):
            step()
        taichi.sync()
        times.append(1000 * (time.perf_counter() - begin))
    (x.to_numpy().astype(numpy.float64) - start).tofile(path)
    print(*times)


main()
