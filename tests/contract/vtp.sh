# VTK's surfaces, as VTK writes them.
# shellcheck shell=bash disable=SC2317 # functions are called by name

test_surfaces_of_vtk_however_it_writes_them() {
  python3 -c 'import vtk, numpy' 2>/dev/null || skip 'no VTK and numpy for python3'
  cat >in.py <<'P'
import subprocess
import gewebe, numpy, vtk
from vtk.util.numpy_support import vtk_to_numpy

def write(data, name, mode, packed, coded, header, order):
    w = vtk.vtkXMLPolyDataWriter(); w.SetInputData(data); w.SetFileName(name)
    w.SetDataMode(mode); w.SetCompressor(vtk.vtkZLibDataCompressor() if packed else None)
    w.SetEncodeAppendedData(coded); w.SetHeaderType(header); w.SetByteOrder(order); w.Write()

def read(name, *options):
    return gewebe.run(['exp2ela', '--centrals', '0', *options, '--to', 'ply', name]).mesh()

def triangles(data):
    """Of all its cells, by VTK itself."""
    cut = vtk.vtkTriangleFilter(); cut.SetInputData(data); cut.PassLinesOff(); cut.PassVertsOff(); cut.Update()
    return vtk_to_numpy(cut.GetOutput().GetPolys().GetConnectivityArray()).reshape(-1, 3)

def turned(rows):
    """Each from its least corner on, all sorted."""
    return sorted(tuple(numpy.roll(row, -int(numpy.argmin(row)))) for row in rows.tolist())

sphere = vtk.vtkSphereSource(); sphere.SetRadius(20); sphere.SetCenter(0.1, 5, 7); sphere.SetThetaResolution(16); sphere.SetPhiResolution(12)
sphere.SetOutputPointsPrecision(vtk.vtkAlgorithm.DOUBLE_PRECISION); sphere.Update()
strips = vtk.vtkStripper(); strips.SetInputData(sphere.GetOutput()); strips.Update()
assert strips.GetOutput().GetNumberOfStrips() > 0
files = 0
for kind, data in ('polygons', sphere.GetOutput()), ('strips', strips.GetOutput()):
    points, expected = vtk_to_numpy(data.GetPoints().GetData()), turned(triangles(data))
    assert len(expected) == 320 and points.dtype == numpy.float64
    for mode in 0, 1, 2:
        for packed in 0, 1:
            for coded in 0, 1:
                for header in 32, 64:
                    for order in 0, 1:
                        name = '%s_%d%d%d%d%d.vtp' % (kind, mode, packed, coded, header, order)
                        write(data, name, mode, packed, coded, header, order)
                        mesh = read(name)
                        assert turned(mesh.triangles) == expected, name
                        # Text of VTK has fewer digits.
                        assert abs(mesh.points - points).max() <= (1e-3 if mode == 0 else 0), name
                        files += 1
assert files == 96, files

# Quadrangles with texture, numbers of cells, a line and a vertex; points in Float32, which four sides have of their own.
cube = vtk.vtkCubeSource(); cube.SetXLength(2); cube.SetYLength(2); cube.SetZLength(2); cube.Update()
cube = cube.GetOutput()
lines = vtk.vtkCellArray(); lines.InsertNextCell(2, [0, 1]); verts = vtk.vtkCellArray(); verts.InsertNextCell(1, [0])
cube.SetLines(lines); cube.SetVerts(verts)
for name in 'part', 'material':
    a = vtk.vtkIntArray(); a.SetName(name)
    for k in range(8):
        a.InsertNextValue(7 if k < 2 else 0 if name == 'part' else k - 2)
    cube.GetCellData().AddArray(a)
write(cube, 'cube.vtp', 1, 1, 1, 64, 1)
mesh = read('cube.vtp')
assert len(mesh.points) == 8 and len(mesh.triangles) == 12, 'welded, as other formats are'
a, b, c = (mesh.points[mesh.triangles[:, k]] for k in range(3))
assert abs(numpy.einsum('ij,ij->', a, numpy.cross(b, c)) / 6 - 8) < 1e-12
face = mesh.elements['face']
assert face['texcoord'].shape == (12, 6) and set(face['texcoord'].ravel()) <= set(vtk_to_numpy(cube.GetPointData().GetTCoords()).ravel())
assert len(numpy.unique(face['texcoord'])) > 1
volume = gewebe.run('voxelize --voxel 0.25 cube.vtp', 'mc-opt').mesh()
assert abs(volume.points).max() < 1.2
drawn = subprocess.run(['emboss-render', '--backend', 'cpu', '--size', '32', 'cube.vtp', '-o', 'cube.png'])
assert drawn.returncode == 0

# What is not served is refused by name.
w = vtk.vtkXMLPolyDataWriter(); w.SetInputData(cube); w.SetFileName('lz4.vtp'); w.SetCompressorTypeToLZ4(); w.Write()
image = vtk.vtkImageData(); image.SetDimensions(2, 2, 2)
w = vtk.vtkXMLImageDataWriter(); w.SetInputData(image); w.SetFileName('image.vtp'); w.Write()
w = vtk.vtkXMLPolyDataWriter(); w.SetInputData(vtk.vtkPolyData()); w.SetFileName('empty.vtp'); w.Write()
for name, what in ('lz4.vtp', 'vtkLZ4DataCompressor'), ('image.vtp', 'expected <VTKFile type="PolyData">'), ('empty.vtp', ''):
    try:
        read(name)
    except gewebe.Error as error:
        assert what in str(error) and error.status == 1, error
    else:
        assert False, name
P
  python3 in.py
}
