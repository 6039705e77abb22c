"""Times vtkFlyingEdges3D with its threaded back end.

Usage: surface_vtk.py VALUES N ISOVALUE THREADS RUNS   Prints the times in ms and the number of points. VALUES: n³
floats, x runs fastest. Status 3 if there is no VTK.
"""

import sys
import time

try:
    import numpy
    import vtk
    from vtk.util import numpy_support
except ImportError:
    sys.exit(3)


def main():
    path, n, isovalue, threads, runs = sys.argv[1], int(sys.argv[2]), float(sys.argv[3]), *map(int, sys.argv[4:6])
    vtk.vtkSMPTools.SetBackend("STDThread")
    vtk.vtkSMPTools.Initialize(threads)
    values = numpy.fromfile(path, numpy.float32)
    image = vtk.vtkImageData()
    image.SetDimensions(n, n, n)
    image.GetPointData().SetScalars(numpy_support.numpy_to_vtk(values))
    times = []
    for _ in range(runs):
        filter = vtk.vtkFlyingEdges3D()
        filter.SetInputData(image)
        filter.SetValue(0, isovalue)
        filter.ComputeNormalsOff()
        filter.ComputeGradientsOff()
        filter.ComputeScalarsOff()
        start = time.perf_counter()
        filter.Update()
        times.append(1000 * (time.perf_counter() - start))
        points = filter.GetOutput().GetNumberOfPoints()
    print(*times, points)


main()
