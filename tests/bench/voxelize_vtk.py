"""Times vtkPolyDataToImageStencil on one thread.

Usage: voxelize_vtk.py MESH VOXEL RUNS   Prints the times in ms and the number of voxels inside (0 where
counting would need a large dense image). MESH: two uint64 counts, points as double x y z, triangles as
uint32 i j k. Status 3 if there is no VTK.
"""

import sys
import time

try:
    import numpy
    import vtk
    from vtk.util import numpy_support
except ImportError:
    sys.exit(3)


def poly_data(path):
    data = open(path, "rb").read()
    points_count, triangles_count = numpy.frombuffer(data, numpy.uint64, 2).astype(int)
    points = numpy.frombuffer(data, numpy.float64, 3 * points_count, 16).reshape(-1, 3)
    corners = numpy.frombuffer(data, numpy.uint32, 3 * triangles_count, 16 + 24 * points_count)
    cells = numpy.full((triangles_count, 4), 3, numpy.int64)
    cells[:, 1:] = corners.reshape(-1, 3)
    poly = vtk.vtkPolyData()
    array = vtk.vtkPoints()
    array.SetData(numpy_support.numpy_to_vtk(points, deep=True))
    poly.SetPoints(array)
    faces = vtk.vtkCellArray()
    faces.SetCells(triangles_count, numpy_support.numpy_to_vtkIdTypeArray(cells.ravel(), deep=True))
    poly.SetPolys(faces)
    return poly, points


def main():
    path, voxel, runs = sys.argv[1], float(sys.argv[2]), int(sys.argv[3])
    vtk.vtkSMPTools.Initialize(1)
    vtk.vtkMultiThreader.SetGlobalMaximumNumberOfThreads(1)
    poly, points = poly_data(path)
    low = numpy.floor(points.min(0) / voxel).astype(int) - 1
    high = numpy.ceil(points.max(0) / voxel).astype(int) + 1
    extent = [int(x) for pair in zip(low, high) for x in pair]
    times = []
    for _ in range(runs):
        stencil = vtk.vtkPolyDataToImageStencil()
        stencil.SetInputData(poly)
        stencil.SetOutputOrigin(0, 0, 0)
        stencil.SetOutputSpacing(voxel, voxel, voxel)
        stencil.SetOutputWholeExtent(extent)
        start = time.perf_counter()
        stencil.Update()
        times.append(1000 * (time.perf_counter() - start))
    inside = 0
    if numpy.prod(high - low + 1) < 2e8:
        image = vtk.vtkImageStencilToImage()
        image.SetInputConnection(stencil.GetOutputPort())
        image.SetOutputScalarTypeToUnsignedChar()
        image.Update()
        inside = int(numpy_support.vtk_to_numpy(image.GetOutput().GetPointData().GetScalars()).sum())
    print(*times, inside)


main()
