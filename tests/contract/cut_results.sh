# What runs leave that cut objects: results, emitted models and their stores.
# shellcheck shell=bash disable=SC2317 # functions are called by name

# cut.scene: a ball is pulled, cut across its top, pulled again; run.h5 is its result, cut.ela the model behind the cut.
cut_scene() {
  echo 0 0 0 60 | metaball2vol --voxel 6 | mc-opt | exp2ela --bend --fix 'z<-15' --name ball -o ball.ela
  cat >cut.scene <<'S'
object ball ball.ela method=ffe
displace ball near:0,0,26,4 0 0 1
step
cut ball plane 8 0 0 1 0 0 z>10
step
emit model ball cut.ela
displace ball near:20,0,15,9 1 0 0
step
emit shapes
step
S
}

test_results_have_the_surface_of_each_frame() {
  cut_scene
  ffe-run cut.scene -o run.h5 >answers.txt
  grep -q '^cut ball ' answers.txt || fail "$(grep -v '^[-0-9]' answers.txt)"
  mkdir series
  ffe-run -q cut.scene -o series/run_%d.ply
  local k
  for k in 0 1 2 3 4; do
    grep -a '^element' series/run_$k.ply >>counts.txt
  done
  [[ $(sort -u counts.txt | grep -c vertex) == 2 ]] || fail "$(<counts.txt)"
  local python
  if python=$(python_with_h5py) || has_module h5py; then
    cat >in.py <<'P'
import h5py
with h5py.File('run.h5') as f:
    o = f['objects/ball']
    c = o['cuts/1']
    n, m = len(o['points']), len(c['points'])
    assert len(f['time']) == 5 and o['displacement'].shape == (2, n, 3) and c['displacement'].shape == (3, m, 3)
    assert c.attrs['first_frame'] == 2 and m > n and len(c['triangles']) == len(o['triangles'])
    assert (o['points'][:][c['origin'][:]] == c['points'][:]).all() and sorted(set(c['origin'][:])) == list(range(n))
P
    "$python" in.py || fail 'another layout'
    rm in.py
  fi
  if has_module 'vtk; vtk.vtkXdmfReader'; then
    cat >in.py <<'P'
import vtk
r = vtk.vtkXdmfReader(); r.SetFileName('run.xdmf'); r.UpdateInformation()
points = []
for time in r.GetOutputInformation(0).Get(vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS()):
    r.UpdateTimeStep(time)
    points.append(r.GetOutputDataObject(0).GetNumberOfPoints())
assert len(points) == 5 and points[0] == points[1] < points[2] == points[3] == points[4], points
P
    python3 in.py || fail 'VTK reads something else'
    rm in.py
  fi
  rm -r series ./*.ela ./*.scene ./*.txt run.h5 run.xdmf
}

test_an_emitted_model_answers_as_the_object_does() {
  cut_scene
  ffe-run cut.scene | awk '/^shapes/ { shapes = 1; next } /^[a-z]/ { shapes = 0 } shapes' >shapes.txt
  exp2ela cut.ela -o read.ela
  cmp cut.ela read.ela || fail 'it is not read back'
  ffe-precompute --columns 'z>15' ball.ela -o ball.h5
  ffe-precompute --update ball.h5 --before ball.ela cut.ela -o cut.h5 --verify --stats=stats.json
  grep -q '"rank":[1-9]' stats.json || fail "$(<stats.json)"
  local store
  for store in '' store=cut.h5; do
    printf '%s\n' "object ball cut.ela method=ffe $store" \
      'displace ball near:0,0,26,4 0 0 1' 'displace ball near:20,0,15,9 1 0 0' 'emit shapes' step >fresh.scene
    ffe-run fresh.scene | awk '/^shapes/ { shapes = 1; next } /^[a-z]/ { shapes = 0 } shapes' >fresh.txt
    paste shapes.txt fresh.txt | awk '
      NF != 6 { wrong = 1 }
      { for (a = 1; a <= 3; ++a) { d = $a - $(a + 3); if (d < 0) d = -d; if (!(d < 1e-7)) wrong = 1 } }
      END { exit wrong || NR < 100 }' || fail "the emitted model gives another shape $store"
  done
  rm ./*.ela ./*.scene ./*.txt ./*.h5 ./*.json
}

test_pictures_of_cut_frames() {
  cut_scene
  ffe-run -q cut.scene -o run.h5
  emboss-render --backend cpu --size 64 --shade 0.8 --view iso --frames all run.h5 -o f%d.ppm --stats=stats.json
  ! cmp -s f2.ppm f3.ppm || fail 'the wound does not show'
  emboss-render --backend cpu --size 64 --shade 0.8 --view iso --frame 1 run.h5 -o one.ppm
  cmp one.ppm f1.ppm || fail 'a frame alone is another picture'
  rm ./*.ela ./*.scene ./*.ppm run.h5 run.xdmf stats.json
}
