# Solids for other solvers, and those of other programs: legacy VTK, Abaqus, FEBio.
# shellcheck shell=bash disable=SC2317 # functions are called by name

# Tetrahedra of two materials: in.vtu.
two_materials() {
  echo 0 0 0 8 | metaball2vol --voxel 1 -o whole.vdb
  echo 3 0 0 4 | metaball2vol --voxel 1 -o inner.vdb
  mc-opt -q --tets --cell 4 --materials inner.vdb whole.vdb -o in.vtu
}

# The model of a file, whatever its name: model FILE KIND.
model() { exp2ela -q --format "$2" --material 'liver,1=uterus' - <"$1"; }

test_formats_keep_tetrahedra_and_materials() {
  two_materials
  model in.vtu vtu >expected.ela
  grep -q uterus expected.ela || fail 'no second material'
  local kind
  for kind in vtk inp; do
    mc-opt -q --tets --cell 4 --materials inner.vdb whole.vdb -o in.$kind
    model in.$kind $kind >out.ela
    cmp out.ela expected.ela
  done
}

test_vtk_reads_and_writes_legacy_solids() {
  python3 -c 'import vtk, numpy' 2>/dev/null || skip 'no VTK and numpy for python3'
  two_materials
  mc-opt -q --tets --cell 4 --materials inner.vdb whole.vdb -o in.vtk
  python3 - <<'END'
import numpy, vtk
from vtk.util.numpy_support import vtk_to_numpy
xml = vtk.vtkXMLUnstructuredGridReader(); xml.SetFileName('in.vtu'); xml.Update()
legacy = vtk.vtkUnstructuredGridReader(); legacy.SetFileName('in.vtk'); legacy.ReadAllScalarsOn(); legacy.Update()
a, b = xml.GetOutput(), legacy.GetOutput()
assert a.GetNumberOfCells() == b.GetNumberOfCells() > 20
same = lambda x, y: (vtk_to_numpy(x) == vtk_to_numpy(y)).all()
assert same(a.GetPoints().GetData(), b.GetPoints().GetData())
assert same(a.GetCells().GetConnectivityArray(), b.GetCells().GetConnectivityArray())
assert same(a.GetCellData().GetArray('material'), b.GetCellData().GetArray('material'))

# The same with middles.
points, number = [a.GetPoint(n) for n in range(a.GetNumberOfPoints())], {}
q = vtk.vtkUnstructuredGrid()
cells = []
for c in range(a.GetNumberOfCells()):
    ids = [a.GetCell(c).GetPointId(k) for k in range(4)]
    for i, j in (0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3):
        edge = frozenset((ids[i], ids[j]))
        if edge not in number:
            number[edge] = len(points)
            points.append(tuple((x + y) / 2 for x, y in zip(points[ids[i]], points[ids[j]])))
        ids.append(number[edge])
    cells.append(ids)
p = vtk.vtkPoints(); p.SetDataTypeToDouble()
for place in points:
    p.InsertNextPoint(place)
q.SetPoints(p)
for ids in cells:
    q.InsertNextCell(24, 10, ids)
q.GetCellData().AddArray(a.GetCellData().GetArray('material'))

for order, grid in ('linear', a), ('quadratic', q):
    w = vtk.vtkXMLUnstructuredGridWriter(); w.SetInputData(grid); w.SetFileName(order + '.vtu'); w.Write()
    # All the ways in which it writes, with arrays of other kinds beside ours.
    for name, kind, parts in ('pressure', vtk.vtkFloatArray, 1), ('u', vtk.vtkDoubleArray, 3), ('n', vtk.vtkUnsignedCharArray, 2):
        for data, count in (grid.GetPointData(), grid.GetNumberOfPoints()), (grid.GetCellData(), grid.GetNumberOfCells()):
            array = kind(); array.SetName(name); array.SetNumberOfComponents(parts); array.SetNumberOfTuples(count); array.Fill(7)
            data.AddArray(array)
    grid.GetPointData().SetActiveScalars('pressure'); grid.GetPointData().SetActiveVectors('u')
    for binary in 0, 1:
        for version in 42, 51:
            for active in 'none', 'material':
                w = vtk.vtkUnstructuredGridWriter(); w.SetInputData(grid); w.SetFileName('%s_%d_%d_%s.vtk' % (order, binary, version, active))
                w.SetFileType(2 if binary else 1)
                w.SetFileVersion(version)
                grid.GetCellData().SetActiveScalars(None if active == 'none' else active)
                w.Write()
END
  local file order count=0
  for order in linear quadratic; do
    model $order.vtu vtu >$order.ela
    for file in "$order"_*.vtk; do
      model "$file" vtk >out.ela
      # Text of VTK has fewer digits.
      if [[ $file == *_1_5* || $file == *_1_4* ]]; then
        cmp out.ela $order.ela
      else
        [[ $(wc -l <out.ela) == $(wc -l <$order.ela) && $(grep -c uterus out.ela) == $(grep -c uterus $order.ela) ]] || fail "$file"
      fi
      ((++count))
    done
  done
  ((count == 16)) || fail "$count files"
}

test_vtk_writes_legacy_surfaces() {
  python3 -c 'import vtk, numpy' 2>/dev/null || skip 'no VTK and numpy for python3'
  python3 - <<'END'
import gewebe, numpy, vtk
from vtk.util.numpy_support import vtk_to_numpy
sphere = vtk.vtkSphereSource(); sphere.SetRadius(20); sphere.SetThetaResolution(16); sphere.SetPhiResolution(12)
sphere.SetOutputPointsPrecision(vtk.vtkAlgorithm.DOUBLE_PRECISION); sphere.Update()
strips = vtk.vtkStripper(); strips.SetInputData(sphere.GetOutput()); strips.Update()
assert strips.GetOutput().GetNumberOfStrips() > 0
turned = lambda rows: sorted(tuple(numpy.roll(row, -int(numpy.argmin(row)))) for row in rows.tolist())
files = 0
for data in sphere.GetOutput(), strips.GetOutput():
    cut = vtk.vtkTriangleFilter(); cut.SetInputData(data); cut.PassLinesOff(); cut.PassVertsOff(); cut.Update()
    expected = turned(vtk_to_numpy(cut.GetOutput().GetPolys().GetConnectivityArray()).reshape(-1, 3))
    for kind in 1, 2:
        for version in 42, 51:
            w = vtk.vtkPolyDataWriter(); w.SetInputData(data); w.SetFileName('in.vtk'); w.SetFileType(kind); w.SetFileVersion(version); w.Write()
            mesh = gewebe.run(['exp2ela', '--centrals', '0', '--to', 'ply', 'in.vtk']).mesh()
            assert turned(mesh.triangles) == expected
            assert abs(mesh.points - vtk_to_numpy(data.GetPoints().GetData())).max() <= (1e-3 if kind == 1 else 0)
            files += 1
assert files == 8
END
}

test_gmsh_writes_abaqus_and_legacy_vtk() {
  command -v gmsh >/dev/null || skip 'no gmsh'
  cat >in.geo <<'END'
SetFactory("OpenCASCADE");
Box(1) = {0, 0, 0, 1, 1, 1}; Sphere(2) = {0.5, 0.5, 0.5, 0.3};
BooleanFragments{ Volume{1}; Delete; }{ Volume{2}; Delete; }
Mesh.MeshSizeMax = 0.4;
END
  local order name
  for order in 1 2; do
    gmsh in.geo -3 -order $order -setnumber Mesh.SecondOrderLinear 1 -format inp -o in$order.inp >gmsh.log 2>&1 || fail "$(<gmsh.log)"
    gmsh in.geo -3 -order $order -setnumber Mesh.SecondOrderLinear 1 -format vtk -o in$order.vtk >gmsh.log 2>&1 || fail "$(<gmsh.log)"
    gmsh in.geo -3 -order $order -setnumber Mesh.SecondOrderLinear 1 -bin -format vtk -o bin$order.vtk >gmsh.log 2>&1 || fail "$(<gmsh.log)"
    for name in in$order.inp in$order.vtk bin$order.vtk; do
      # The unit cube in mm, of 1e-3 g per mm3.
      exp2ela -q "$name" --density 1e-3 -o out.ela --stats=stats
      awk -v m="$(sed -n 's/.*"total_mass":\([0-9.e-]*\).*/\1/p' stats)" 'BEGIN { exit !(m > 0.999e-3 && m < 1.001e-3) }' || fail "mass of $name" "$(<stats)"
    done
  done
}

# Numbers of the deck are those of the model, as ela_expl(5) has them.
test_decks_have_nodes_materials_and_supports() {
  local order
  for order in 1 2; do
    exp2ela -q --solid --cell 5 --order $order --material liver --fix 'z<1' --fix-axes xz "$GEWEBE_ROOT/tests/golden/in/cube.ply" -o in.ela
    exp2ela -q in.ela -o out.feb
    exp2ela -q in.ela -o out.inp
    python3 - "$order" <<'END'
import sys, xml.etree.ElementTree as tree
root = tree.parse('out.feb').getroot()
assert root.tag == 'febio_spec' and root.get('version') == '4.0'
nodes = [tuple(map(float, n.text.split(','))) for n in root.iter('node')]
elements = [tuple(map(int, e.text.split(','))) for e in root.iter('elem')]
size = 4 if sys.argv[1] == '1' else 10
assert {len(e) for e in elements} == {size} and max(max(e) for e in elements) == len(nodes)
m = root.find('Material/material')
young, nu = float(m.find('E').text), float(m.find('v').text)
assert m.get('type') == 'isotropic elastic' and young > 0 and 0 <= nu < 0.5
sets = {s.get('name'): sorted(map(int, s.text.split(','))) for s in root.iter('NodeSet')}
assert sorted(sets) == ['fixed-x', 'fixed-z'] and sets['fixed-x'] == sets['fixed-z'] == [n + 1 for n, p in enumerate(nodes) if p[2] < 1], sets
assert [b.get('node_set') for b in root.iter('bc')] == ['fixed-x', 'fixed-z']
assert {d.get('name') for d in root.iter('SolidDomain')} == {e.get('name') for e in root.iter('Elements')}
det = lambda u, v, w: u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0]) + u[2] * (v[0] * w[1] - v[1] * w[0])
volume = 0
for e in elements:
    a, b, c, d = (nodes[n - 1] for n in e[:4])
    each = det(*(tuple(x - y for x, y in zip(q, a)) for q in (b, c, d))) / 6
    assert each > 0
    volume += each
assert abs(volume - 1000) < 1, volume
if size == 10: # middles lie between the corners in the order of both programs
    for e in elements:
        for k, (i, j) in enumerate(((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))):
            assert all(abs(2 * x - y - z) < 1e-9 for x, y, z in zip(nodes[e[4 + k] - 1], nodes[e[i] - 1], nodes[e[j] - 1])), e
# The same in the other deck.
lines = open('out.inp').read().upper().splitlines()
section, seen = '', {}
for line in lines:
    if line.startswith('*'):
        section = line.split(',')[0]
    else:
        seen.setdefault(section, []).append([w.strip() for w in line.split(',')])
assert [tuple(map(float, r[1:])) for r in seen['*NODE']] == nodes
assert [tuple(map(int, r[1:])) for r in seen['*ELEMENT']] == elements
assert [tuple(map(float, r)) for r in seen['*ELASTIC']] == [(young, nu)]
assert sorted((int(n), int(a)) for n, a, b in seen['*BOUNDARY'] if a == b) == sorted((n, a) for n in sets['fixed-x'] for a in (1, 3))
END
    # And back.
    exp2ela -q out.inp --order "$order" --material liver --fix 'z<1' --fix-axes xz -o again.ela
  done
}

# CalculiX stretches a bar by the force that the theory has.
test_calculix_solves_our_deck() {
  command -v ccx >/dev/null || skip 'no ccx'
  exp2ela -q --solid --cell 5 --order 2 --poisson 0 --young 1000 --fix 'z<0.01' --fix-axes z "$GEWEBE_ROOT/tests/golden/in/cube.ply" -o in.ela
  exp2ela -q in.ela --fix 'z<0.01' --fix-axes xyz -o deck.inp
  {
    cat deck.inp
    awk -F', *' '/^\*/ { s = $1 } s == "*NODE" && NF == 4 && $4 > 9.99 { if (!n++) print "*NSET, NSET=TOP"; print $1 }' deck.inp
    printf '%s\n' '*STEP' '*STATIC' '*BOUNDARY' 'TOP, 3, 3, 0.01' '*NODE PRINT, NSET=TOP, TOTALS=ONLY' RF '*END STEP'
  } >job.inp
  ccx job >log || fail "$(tail -20 log)"
  # E A e / L = 1000 Pa x 100 mm2 x 0.01 mm / 10 mm.
  awk '/total force/ { f = 1 } f && NF == 3 && $3 + 0 != 0 { found = 1; exit !($3 > 99.9 && $3 < 100.1) } END { if (!found) exit 1 }' job.dat || fail "$(<job.dat)"
}
