# Programs that are not ours read what ours write.
# shellcheck shell=bash disable=SC2317 # functions are called by name

# What an awk script that knows only ela_expl(5) counts.
test_awk_reads_models() {
  exp2ela --bend --stats=stats "$GEWEBE_ROOT/tests/golden/in/cube.ply" -o in.ela
  count() { sed "s/.*\"$1\":\([0-9]*\).*/\1/" stats; }
  local expected
  expected="$(($(count nodes) + $(count centrals))) 18 $(count springs_b) $(count springs_c) 12"
  [[ $(awk -f "$GEWEBE_ROOT/tests/golden/ela_check.awk" in.ela) == "$expected" ]] ||
    fail "other counts than $expected:" "$(awk -f "$GEWEBE_ROOT/tests/golden/ela_check.awk" in.ela)"
  ! sed '/^springs/,$d' in.ela | awk -f "$GEWEBE_ROOT/tests/golden/ela_check.awk" >/dev/null || fail 'half a model passes'
  rm in.ela stats
}

test_vdb_print_reads_volumes() {
  command -v vdb_print >/dev/null || skip 'no vdb_print'
  metaball2vol --voxel 0.5 --stats=stats "$GEWEBE_ROOT/tests/golden/in/five.particles" -o in.vdb
  vdb_print -l in.vdb >listing
  local active
  active=$(sed -n 's/.*"active_voxels":\([0-9]*\).*/\1/p' stats)
  [[ $active -gt 50000 ]] || fail "only $active active voxels"
  grep -q 'Name: density' listing || fail 'no grid density' "$(<listing)"
  grep -q 'class: fog volume' listing || fail 'no fog volume' "$(<listing)"
  [[ $(sed -n 's/.*Number of active voxels: *//p' listing | tr -d ,) == "$active" ]] || fail "other count than $active" "$(<listing)"
  rm in.vdb stats listing
}

test_vtk_reads_meshes() {
  python3 -c 'import vtk' 2>/dev/null || skip 'no VTK for python3'
  metaball2vol --voxel 0.5 "$GEWEBE_ROOT/tests/golden/in/five.particles" | mc-opt -o in.ply
  exp2ela --to obj in.ply -o in.obj
  exp2ela --to stl in.ply -o in.stl
  cat >in.py <<'E2'
import vtk
for reader, name, points in ((vtk.vtkPLYReader, 'in.ply', 3889), (vtk.vtkOBJReader, 'in.obj', 3889), (vtk.vtkSTLReader, 'in.stl', 3889)):
    r = reader(); r.SetFileName(name); r.Update(); mesh = r.GetOutput()
    assert (mesh.GetNumberOfPoints(), mesh.GetNumberOfPolys()) == (points, 7774), (name, mesh.GetNumberOfPoints(), mesh.GetNumberOfPolys())
    edges = vtk.vtkFeatureEdges(); edges.SetInputData(mesh); edges.FeatureEdgesOff(); edges.Update()
    assert edges.GetOutput().GetNumberOfCells() == 0, name + ' is open'
    mass = vtk.vtkMassProperties(); mass.SetInputData(mesh)
    assert abs(mass.GetVolume() - 1400.65) < 0.1, mass.GetVolume()
E2
  python3 in.py
  rm in.py in.ply in.obj in.stl
}
