"""Meshes a dense volume by VTK's FlyingEdges3D or scikit-image's marching_cubes.

Usage: surface_quality_peers.py vtk|skimage FILE RUNS   Prints the times in ms. FILE: sizes as three int32, the
isovalue as double, values as float32, z fastest; overwritten by the mesh: two uint64 counts, points as double in
voxels, triangles as uint32. Status 3 if there is no such peer.
"""

import sys
import time

try:
    import numpy

    if sys.argv[1] == "vtk":
        import vtk
        from vtk.util import numpy_support
    else:
        from skimage import measure
except ImportError:
    sys.exit(3)


def flying_edges(values, isovalue):
    image = vtk.vtkImageData()
    image.SetDimensions(*values.shape)
    flat = numpy.ascontiguousarray(values.transpose(2, 1, 0)).ravel()
    image.GetPointData().SetScalars(numpy_support.numpy_to_vtk(flat, deep=True))

    def run():
        edges = vtk.vtkFlyingEdges3D()
        edges.SetInputData(image)
        edges.SetValue(0, isovalue)
        edges.ComputeNormalsOff()
        edges.ComputeGradientsOff()
        edges.ComputeScalarsOff()
        edges.Update()
        return edges.GetOutput()

    def arrays(poly):
        faces = numpy_support.vtk_to_numpy(poly.GetPolys().GetConnectivityArray()).reshape(-1, 3)
        return numpy_support.vtk_to_numpy(poly.GetPoints().GetData()), faces

    return run, arrays


def lewiner(values, isovalue):
    return lambda: measure.marching_cubes(values, isovalue)[:2], lambda mesh: mesh


def main():
    peer, path, runs = sys.argv[1], sys.argv[2], int(sys.argv[3])
    data = open(path, "rb").read()
    shape = numpy.frombuffer(data, numpy.int32, 3)
    isovalue = float(numpy.frombuffer(data, numpy.float64, 1, 12)[0])
    values = numpy.frombuffer(data, numpy.float32, -1, 20).reshape(shape).copy()
    run, arrays = (flying_edges if peer == "vtk" else lewiner)(values, isovalue)
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        mesh = run()
        times.append(1000 * (time.perf_counter() - start))
    points, faces = arrays(mesh)
    with open(path, "wb") as file:
        file.write(numpy.array([len(points), len(faces)], numpy.uint64).tobytes())
        file.write(points.astype(numpy.float64).tobytes())
        file.write(faces.astype(numpy.uint32).tobytes())
    print(*times)


main()
