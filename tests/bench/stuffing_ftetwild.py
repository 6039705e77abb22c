"""Times fTetWild (pytetwild) on a closed surface.

Usage: stuffing_ftetwild.py SURFACE.off RESULT.mesh EDGE   EDGE is the length wanted, in the surface's unit. Prints the
time in ms, without reading and writing, and the MiB that it took at most. Status 3 if there is no pytetwild.
"""

import os
import resource
import sys
import time

try:
    import numpy
    import pytetwild
except ImportError:
    sys.exit(3)


def main():
    with open(sys.argv[1]) as file:
        lines = file.read().split("\n")
    points, faces, _ = map(int, lines[1].split())
    xyz = numpy.array([line.split() for line in lines[2 : 2 + points]], numpy.float64)
    corners = numpy.array([line.split()[1:] for line in lines[2 + points : 2 + points + faces]], numpy.int32)
    os.chdir(os.path.dirname(sys.argv[2]))  # it leaves a file there
    diagonal = numpy.linalg.norm(xyz.max(0) - xyz.min(0))
    peak = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    before = peak()
    start = time.perf_counter()
    nodes, tetrahedra = pytetwild.tetrahedralize(xyz, corners, edge_length_fac=float(sys.argv[3]) / diagonal, quiet=True)[:2]
    print(1000 * (time.perf_counter() - start), peak() - before)
    with open(sys.argv[2], "w") as file:
        file.write("MeshVersionFormatted 2\nDimension 3\nVertices\n%d\n" % len(nodes))
        for node in nodes:
            file.write("%.17g %.17g %.17g 0\n" % tuple(node))
        file.write("Tetrahedra\n%d\n" % len(tetrahedra))
        for corner in tetrahedra:
            file.write("%d %d %d %d 0\n" % tuple(int(c) + 1 for c in corner))
        file.write("End\n")


main()
