# VTK, Gmsh and TetGen read our tetrahedra, and we read theirs.
# shellcheck shell=bash disable=SC2317 # functions are called by name

# Our files: linear.* and quadratic.* in this folder; what is in other/ becomes other/NAME.node and .ele.
tet_files() {
  [[ -x $BUILD/unit ]] || skip "$BUILD/unit is not built"
  GEWEBE_TET_FILES=$PWD "$BUILD/unit" --gtest_filter=TetFile.ForOtherPrograms >log || fail "$(<log)"
}

# What the scripts below share: the mesh of TetGen's files, as a sorted list of (places of the nodes, material), where
# the corners of each are taken to one order, so that they may be numbered and turned in any way.
cat_script() {
  cat <<'END'
import struct, sys
MIDDLE = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))  # of the nodes 4 to 9, as VTK has them

def key(places, material):
    """Places of the nodes of one, in VTK's order; corners sorted, middles with them."""
    corners = sorted(range(4), key=lambda k: places[k])
    middles = []
    if len(places) == 10:
        at = {frozenset(e): places[4 + k] for k, e in enumerate(MIDDLE)}
        middles = [at[frozenset((corners[a], corners[b]))] for a, b in MIDDLE]
    return tuple(places[c] for c in corners) + tuple(middles), material

def rows(name):
    lines = [l.split('#')[0].split() for l in open(name)]
    return [l for l in lines if l]

def tetgen(stem):
    order = (0, 1, 2, 3, 6, 7, 9, 5, 8, 4)
    place = {int(r[0]): tuple(map(float, r[1:4])) for r in rows(stem + '.node')[1:]}
    head, *cells = rows(stem + '.ele')
    size, attributes = int(head[1]), int(head[2])
    return sorted(key([place[int(r[1 + k])] for k in order[:size]], int(float(r[-1])) if attributes else None) for r in cells)

def gmsh2(name):
    """Binary, version 2.2."""
    data = open(name, 'rb').read()
    at = data.index(b'$Nodes\n') + 7
    end = data.index(b'\n', at)
    count, at, place = int(data[at:end]), end + 1, {}
    for _ in range(count):
        number, *xyz = struct.unpack_from('<iddd', data, at)
        place[number], at = tuple(xyz), at + 28
    at = data.index(b'$Elements\n', at) + 10
    end = data.index(b'\n', at)
    count, at, cells = int(data[at:end]), end + 1, []
    nodes = {4: 4, 11: 10}
    while count > 0:
        kind, follow, tags = struct.unpack_from('<iii', data, at)
        at += 12
        for _ in range(follow):
            row = struct.unpack_from('<%di' % (1 + tags + nodes[kind]), data, at)
            at += 4 * len(row)
            n = [place[k] for k in row[1 + tags:]]
            if kind == 11:
                n[8], n[9] = n[9], n[8]
            cells.append(key(n, row[1] if row[1] else row[2]))
        count -= follow
    return sorted(cells)

def same(name, found, expected):
    assert len(found) == len(expected) > 0, (name, len(found), len(expected))
    for a, b in zip(found, expected):
        assert a == b, (name, a, b)
END
}

test_vtk_reads_our_tetrahedra_and_we_read_its() {
  python3 -c 'import vtk' 2>/dev/null || skip 'no VTK for python3'
  tet_files
  mkdir other
  { cat_script; cat <<'END'; } >ours.py
import vtk
from vtk.util.numpy_support import vtk_to_numpy

def cells(grid):
    p = [tuple(q) for q in vtk_to_numpy(grid.GetPoints().GetData()).tolist()]
    m = vtk_to_numpy(grid.GetCellData().GetArray('material'))
    out = []
    for c in range(grid.GetNumberOfCells()):
        ids = grid.GetCell(c).GetPointIds()
        out.append(key([p[ids.GetId(k)] for k in range(ids.GetNumberOfIds())], int(m[c])))
    return sorted(out)

for name in 'linear', 'quadratic':
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(name + '.vtu'); reader.Update()
    grid = reader.GetOutput()
    same(name, cells(grid), tetgen(name))
    assert grid.GetCell(0).GetClassName() == ('vtkTetra' if name == 'linear' else 'vtkQuadraticTetra')
    sizes = vtk.vtkCellSizeFilter(); sizes.SetInputData(grid); sizes.Update()
    volumes = vtk_to_numpy(sizes.GetOutput().GetCellData().GetArray('Volume'))
    assert volumes.min() > 0 and abs(volumes.sum() - 1.54) < 1e-9, volumes
    # The boundary, of a reader that knows no tetrahedra.
    ply = vtk.vtkPLYReader(); ply.SetFileName(name + '.ply'); ply.Update()
    edges = vtk.vtkFeatureEdges(); edges.SetInputData(ply.GetOutput()); edges.FeatureEdgesOff(); edges.Update()
    assert ply.GetOutput().GetNumberOfPolys() == 44 and edges.GetOutput().GetNumberOfCells() == 0
    mass = vtk.vtkMassProperties(); mass.SetInputData(ply.GetOutput())
    assert abs(mass.GetVolume() - 1.54) < 1e-5, mass.GetVolume()
    # All the ways in which it writes.
    for mode in 0, 1, 2:
        for packed in 0, 1:
            for coded in 0, 1:
                for header in 32, 64:
                    for order in 0, 1:
                        w = vtk.vtkXMLUnstructuredGridWriter(); w.SetInputData(grid)
                        w.SetFileName('other/%s_%d%d%d%d%d.vtu' % (name, mode, packed, coded, header, order))
                        w.SetDataMode(mode); w.SetCompressor(vtk.vtkZLibDataCompressor() if packed else None)
                        w.SetEncodeAppendedData(coded); w.SetHeaderType(header); w.SetByteOrder(order); w.Write()
END
  python3 ours.py
  tet_files
  { cat_script; cat <<'END'; } >theirs.py
import glob
names = glob.glob('other/*.vtu')
assert len(names) == 96, names
for name in names:
    found, expected = tetgen(name), tetgen(name[6:].split('_')[0])
    if 'msh1' in name: # has no names of groups, so material 0 keeps the number that Gmsh chose
        expected = free(expected, 3)
    if '_0' in name: # text, of fewer digits
        found = [(tuple(tuple(float('%.5g' % x) for x in p) for p in n), m) for n, m in found]
        expected = [(tuple(tuple(float('%.5g' % x) for x in p) for p in n), m) for n, m in expected]
    same(name, sorted(found), sorted(expected))
END
  python3 theirs.py
  rm -r other ./*.py log linear* quadratic*
}

test_gmsh_reads_our_tetrahedra_and_we_read_its() {
  command -v gmsh >/dev/null || skip 'no gmsh'
  tet_files
  mkdir other
  local name suffix
  for name in linear quadratic; do
    for suffix in msh 4.msh mesh; do
      gmsh $name.$suffix -0 -save -bin -format msh22 -o $name.$suffix.again.msh >gmsh.log 2>&1 || fail "$(<gmsh.log)"
    done
    gmsh $name.4.msh -0 -save -format msh1 -o other/${name}_text_msh1.msh >gmsh.log 2>&1 || fail "$(<gmsh.log)"
    for suffix in msh22 msh41; do
      gmsh $name.4.msh -0 -save -format $suffix -o other/${name}_text_$suffix.msh >gmsh.log 2>&1 || fail "$(<gmsh.log)"
      gmsh $name.4.msh -0 -save -bin -format $suffix -o other/${name}_$suffix.msh >gmsh.log 2>&1 || fail "$(<gmsh.log)"
    done
  done
  gmsh linear.mesh -0 -save -format mesh -o other/linear_text.mesh >gmsh.log 2>&1 || fail "$(<gmsh.log)"
  tet_files
  { cat_script; cat <<'END'; } >check.py
import glob
# Material 0 is an entity of Gmsh's choice; all else keeps its number.
def free(cells, zero):
    return sorted((n, zero if m == 0 else m) for n, m in cells)
for name in 'linear', 'quadratic':
    ours = tetgen(name)
    for suffix in 'msh', '4.msh':
        same(suffix, gmsh2('%s.%s.again.msh' % (name, suffix)), free(ours, 3))
    mesh = gmsh2(name + '.mesh.again.msh')
    same('mesh', sorted((n, 0) for n, m in mesh), sorted((n, 0) for n, m in ours))
def rounded(cells):
    return sorted((tuple(tuple(float('%.9g' % (x + 0.)) if abs(x) > 1e-12 else 0. for x in p) for p in n), m) for n, m in cells)
names = glob.glob('other/*.m*sh')
assert len(names) == 11, names
for name in names:
    found, expected = tetgen(name), tetgen(name[6:].split('_')[0])
    if 'msh1' in name: # has no names of groups, so material 0 keeps the number that Gmsh chose
        expected = free(expected, 3)
    same(name, *((rounded(found), rounded(expected)) if 'text' in name else (found, expected)))
END
  python3 check.py
  # A mesh of its own, with triangles and lines and two groups.
  cat >in.geo <<'END'
SetFactory("OpenCASCADE");
Box(1) = {0, 0, 0, 1, 1, 1}; Sphere(2) = {0.5, 0.5, 0.5, 0.3};
BooleanFragments{ Volume{1}; Delete; }{ Volume{2}; Delete; }
Mesh.MeshSizeMax = 0.4;
Physical Volume("inside", 5) = {2}; Physical Volume("outside", 9) = {1, 3}; Physical Surface("skin", 3) = {1:7};
END
  rm -r other
  mkdir other
  for name in msh22 msh41; do
    gmsh in.geo -3 -format $name -o other/$name.msh >gmsh.log 2>&1 || fail "$(<gmsh.log)"
    gmsh in.geo -3 -order 2 -bin -format $name -o other/${name}_2.msh >gmsh.log 2>&1 || fail "$(<gmsh.log)"
  done
  tet_files
  { cat_script; cat <<'END'; } >check.py
def volume(p):
    u, v, w = ([p[k][a] - p[0][a] for a in range(3)] for k in (1, 2, 3))
    return abs(u[0] * (v[1] * w[2] - v[2] * w[1]) - v[0] * (u[1] * w[2] - u[2] * w[1]) + w[0] * (u[1] * v[2] - u[2] * v[1])) / 6
for name in 'msh22', 'msh41', 'msh22_2', 'msh41_2':
    cells = tetgen('other/%s.msh' % name)
    assert {m for n, m in cells} == {5, 9}, name
    assert abs(sum(volume(n) for n, m in cells) - 1) < 1e-9, name
    ball = sum(volume(n) for n, m in cells if m == 5)
    assert 0.06 < ball < 0.1131, (name, ball)
END
  python3 check.py
  rm -r other in.geo check.py gmsh.log log linear* quadratic*
}

test_tetgen_reads_our_tetrahedra_and_we_read_its() {
  command -v tetgen >/dev/null || skip 'no tetgen'
  tet_files
  mkdir other
  tetgen -r linear.ele >log || fail "$(<log)"
  mv linear.1.node linear.1.ele other
  { cat_script; cat <<'END'; } >check.py
same('tetgen', tetgen('other/linear.1'), tetgen('linear'))
END
  python3 check.py
  # Quadratic ones of its own, of a cube of material 7: middles lie in the middle.
  cat >other/cube.poly <<'END'
8 3 0 0
1 0 0 0
2 1 0 0
3 1 1 0
4 0 1 0
5 0 0 1
6 1 0 1
7 1 1 1
8 0 1 1
6 0
1
4 1 2 3 4
1
4 5 6 7 8
1
4 1 2 6 5
1
4 2 3 7 6
1
4 3 4 8 7
1
4 4 1 5 8
0
1
1 0.5 0.5 0.5 7 0
END
  tetgen -pqa0.05Ao2 other/cube.poly >log || fail "$(<log)"
  rm other/*.poly other/*.face other/*.edge other/*.smesh 2>/dev/null || true
  cp other/cube.1.node cube.node
  cp other/cube.1.ele cube.ele
  tet_files
  { cat_script; cat <<'END'; } >check.py
cells = tetgen('other/cube.1.ele')
same('cube', cells, tetgen('cube'))
for n, m in cells:
    assert m == 7 and len(n) == 10
    for k, (a, b) in enumerate(MIDDLE):
        assert all(abs(2 * n[4 + k][x] - n[a][x] - n[b][x]) < 1e-12 for x in range(3)), n
END
  python3 check.py
  rm -r other check.py log cube* linear* quadratic*
}

# A disk that fills up, here a limit on sizes between those of the two files, leaves both files of TetGen as they were.
test_a_failure_leaves_neither_of_tetgens_files() {
  echo 0 0 0 6 | metaball2vol --voxel 1 -o in.vdb
  mc-opt --tets in.vdb -o in.node
  local small large name file
  small=$(stat -c %s in.node) large=$(stat -c %s in.ele)
  ((small < large - 2048)) || fail "sizes $small and $large"
  for name in out.node out.ele; do
    (ulimit -f $(((small + 1023) / 1024)) && expect_failure 1 mc-opt mc-opt --tets in.vdb -o $name)
    [[ -z $(find . -name '*out*') ]] || fail "-o $name left" "$(find .)"
    echo old >out.node
    echo older >out.ele
    (ulimit -f $(((small + 1023) / 1024)) && expect_failure 1 mc-opt mc-opt --tets in.vdb -o $name)
    [[ $(<out.node) == old && $(<out.ele) == older ]] || fail "-o $name changed a file"
    rm out.node out.ele
  done
  mc-opt --tets in.vdb -o out.ele
  for file in node ele; do
    cmp in.$file out.$file
  done
}
