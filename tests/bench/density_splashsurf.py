"""Times splashsurf's reconstruct_surface on particles of one radius.

Usage: density_splashsurf.py PARTICLES RADIUS CUBE VERTICES THREADS RUNS   Cubes of CUBE first, then of the size
that gives about VERTICES; prints the times in ms and the number of vertices. PARTICLES: float x y z.
Smoothing length 2 radii, other parameters as by default. Status 3 if there is no pysplashsurf.
"""

import os
import sys
import time

os.environ["RAYON_NUM_THREADS"] = sys.argv[5]
try:
    import numpy
    import pysplashsurf
except ImportError:
    sys.exit(3)


def vertices(result):
    mesh = result.mesh
    return len(mesh.vertices)


def main():
    points = numpy.fromfile(sys.argv[1], numpy.float32).reshape(-1, 3)
    radius, cube, wanted = float(sys.argv[2]), float(sys.argv[3]), int(sys.argv[4])

    def reconstruct():
        return pysplashsurf.reconstruct_surface(
            points,
            particle_radius=radius,
            smoothing_length=2 * radius,
            cube_size=cube,
            multi_threading=sys.argv[5] != "1",
        )

    for _ in range(4):
        count = vertices(reconstruct())
        if abs(count / wanted - 1) < 0.02:
            break
        cube *= (count / wanted) ** 0.5
    times = []
    for _ in range(int(sys.argv[6])):
        start = time.perf_counter()
        result = reconstruct()
        times.append(1000 * (time.perf_counter() - start))
    print(*times, vertices(result))


main()
