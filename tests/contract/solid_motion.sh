# Solids that move, by the programs alone: a measured beam, an organ that keeps its volume, what drives a scene.
# shellcheck shell=bash disable=SC2317 # functions are called by name

need() {
  local tool
  for tool in "$@"; do
    command -v "$tool" >/dev/null || skip "no $tool"
  done
}

# beam.mesh: 100 × 30 × 30 mm.
beam_mesh() {
  cat >beam.py <<'P'
from itertools import permutations
nx, ny, nz, h = 10, 3, 3, 10
number = lambda i, j, k: 1 + i + (nx + 1) * (j + (ny + 1) * k)
print('MeshVersionFormatted 2\nDimension 3\nVertices', (nx + 1) * (ny + 1) * (nz + 1))
for k in range(nz + 1):
    for j in range(ny + 1):
        for i in range(nx + 1):
            print(i * h, j * h, k * h, 0)
rows = []
for k in range(nz):
    for j in range(ny):
        for i in range(nx):
            for order in permutations(range(3)):
                at = [i, j, k]
                corners = [number(*at)]
                for axis in order:
                    at[axis] += 1
                    corners.append(number(*at))
                if (order[0] + 1) % 3 != order[1]:
                    corners[1], corners[2] = corners[2], corners[1]
                rows.append((*corners, 0))
print('Tetrahedra', len(rows))
for row in rows:
    print(*row)
print('End')
P
  python3 beam.py >beam.mesh
}

# A silicone beam swings at the frequency that was measured, within 5 %, and rests where its markers were, within 7 %.
test_a_silicone_beam_swings_and_rests_as_measured() {
  local python data=$GEWEBE_SHARED/data/eth_beam
  need ffe-run exp2ela
  [[ -d $data ]] || skip 'no data (scripts/data says where it comes from)'
  python=$(python_with_h5py) || skip 'no h5py for python3'
  beam_mesh
  cat >judge.py <<'P'
import csv, h5py, numpy, sys
folder = sys.argv[1]

def recording(name):
    with open(folder + '/' + name + '.csv') as f:
        rows = numpy.array([[float(x) for x in row] for row in list(csv.reader(f))[1:]])
    return rows[:, 0], rows[:, [1, 4, 7]] # up, of each marker

def frequency(t, z):
    k = numpy.flatnonzero((z[1:] < 0) != (z[:-1] < 0))
    at = t[k] + (t[k + 1] - t[k]) * z[k] / (z[k] - z[k + 1])
    assert len(at) > 5, at
    at = at[1:6] # the first swings, behind the release
    return (len(at) - 1) / (2 * (at[-1] - at[0]))

def run(name):
    with h5py.File(name + '.h5') as f:
        o = f['objects/beam']
        return f['time'][:], o['points'][:], o['displacement'][:]

frequencies, droops = [], []
for trial in 'ab':
    t, up = recording('gravity_' + trial)
    end = up[t > t[-1] - 0.5].mean(0)
    droops.append(up[0] - end)
    frequencies.append(frequency(t, up[:, 0] - end[0]))
measured = numpy.mean(frequencies)
droop = numpy.mean(droops, 0)
t, p, u = run('swing')
_, _, rest = run('rest')
node = lambda place: int(numpy.argmin(numpy.abs(p - numpy.array(place)).max(1)))
z = u[:, node((100, 15, 30)), 2]
got = frequency(t, z - rest[-1, node((100, 15, 30)), 2])
x = p + rest[-1]
across, upward = (x[node(b)] - x[node(a)] for a, b in (((100, 0, 15), (100, 30, 15)), ((100, 15, 0), (100, 15, 30))))
markers = (((100, 15, 30), (0, 6)), ((100, 0, 25), (-6, 0)), ((100, 30, 5), (6, 0)))
carried = [place[2] + b - (x[node(place)] + a * across / numpy.linalg.norm(across) + b * upward / numpy.linalg.norm(upward))[2]
           for place, (a, b) in markers]
print('frequency', got, 'measured', measured, 'droops', carried, 'measured', droop)
assert 7.5 < measured < 8, measured
assert abs(got / measured - 1) < 0.05
assert (abs(numpy.array(carried) / droop - 1) < 0.07).all()
P
  swing() { # Young's modulus
    exp2ela -q --young "$1" --poisson 0.499 --density 1.07e-3 --fix 'x<0.001' --name beam beam.mesh -o beam.ela
    printf '%s\n' 'object beam beam.ela damping=0.05@7.76' 'gravity 0 0 -9807.09' 'timestep 0.0025' 'run 0.6 every 0.005' |
      ffe-run -q - -o swing.h5
    printf '%s\n' 'object beam beam.ela damping=0.5@7.76' 'gravity 0 0 -9807.09' 'run 3 every 0.5' | ffe-run -q - -o rest.h5
  }
  swing 270000
  "$python" judge.py "$data" || fail 'it swings or rests otherwise'
  swing 310000
  ! "$python" judge.py "$data" >/dev/null 2>&1 || fail 'the check sees nothing'
}

# A liver at a Poisson's ratio of 0.49 sags by its weight, pressed from all sides, and keeps its volume within 1 %, inside as well, by either law.
test_a_liver_keeps_its_volume() {
  local python law data=$GEWEBE_SHARED/data/sofa_liver_smooth.obj
  need ffe-run exp2ela
  [[ -f $data ]] || skip 'no data (scripts/data says where it comes from)'
  python=$(python_with_h5py) || skip 'no h5py for python3'
  cat >judge.py <<'P'
import h5py, numpy, sys
with h5py.File('run.h5') as f:
    o = f['objects/liver']
    p, u, t = o['points'][:], o['displacement'][:], o['tetrahedra'][:]
def volumes(x):
    a, b, c, d = (x[t[:, k]] for k in range(4))
    return numpy.einsum('ij,ij->i', numpy.cross(b - a, c - a), d - a) / 6
rest = volumes(p)
size = (p.max(0) - p.min(0)).max()
most = max(numpy.abs(one).max() for one in u)
worst = max(abs(volumes(p + one).sum() / rest.sum() - 1) for one in u)
least = min(volumes(p + one).min() for one in u)
print(sys.argv[1], 'moves by', most / size, 'of its size, its volume by', worst, 'least tetrahedron', least)
assert most > 0.03 * size and worst < 0.01 and least > 0
P
  exp2ela -q --unit cm --solid --cell 9 --young 10000 --poisson 0.49 --fix 'x<-30' --name liver "$data" -o liver.ela
  for law in corotational neo-hookean; do
    printf '%s\n' "object liver liver.ela law=$law" 'gravity 0 0 -9810' 'pressure liver surface -200' 'timestep 0.01' 'run 0.4 every 0.02' | ffe-run -q - -o run.h5
    "$python" judge.py "$law" || fail "$law: another volume"
  done
  exp2ela -q --unit cm --solid --cell 9 --young 10000 --poisson 0.1 --fix 'x<-30' --name liver "$data" -o liver.ela
  printf '%s\n' 'object liver liver.ela' 'gravity 0 0 -9810' 'pressure liver surface -200' 'timestep 0.01' 'run 0.4 every 0.02' | ffe-run -q - -o run.h5
  ! "$python" judge.py '0.1' 2>/dev/null || fail 'the check sees nothing'
}

# organ.ela: a ball of 30 mm radius, held below.
held_organ() {
  exp2ela -q --primitive sphere:16x12 --size 30 --solid --cell 8 --young 5000 --poisson 0.45 --fix 'z<-20' --name organ -o organ.ela
}

# What is wrong is answered and changes nothing: the answers are those of the right lines alone.
test_wrong_lines_do_not_touch_a_solid_that_moves() {
  need ffe-run exp2ela
  held_organ
  cat >right <<'END'
object organ organ.ela damping=0.1@4
emit shapes
gravity 0 0 -9810
step 0.02
force organ z>25 100 0 0
instrument tongs sphere 3 0 0 36
step 0.02
displace organ near:30,0,0,8 1 0 2 over 0.05
step 0.02
step 0.04
release organ all
move tongs 0 0 30 over 0.02
step 0.04
method organ ffe
step 0.02
method organ ela
step 0.02
END
  awk '{ print }
    NR == 4 { print "force organ nobody 1 2 3"; print "cut organ plane 0 0 0 0 0 0"; print "displace organ 0 nan 0 0" }
    NR == 9 { print "object organ organ.ela"; print "attach organ 1 organ 2 100"; print "step -1"; print "force organ z>25 inf 0 0" }
    NR == 14 { print "grasp nothing organ all"; print "tear organ 3" }' right >mixed
  ffe-run -q --serve <right >expected || fail 'a right line is refused'
  ! ffe-run -q --serve <mixed >answers || fail 'status 0 with wrong lines'
  (($(grep -c '^error ' answers) >= 8)) || fail "$(grep -c '^error ' answers) errors"
  (($(grep -c '^step ' expected) == 7)) || fail 'steps are missing'
  grep -v '^error ' answers | cmp - expected || fail 'wrong lines change the motion'
}

# Displacements, stresses and times in HDF5 and VTU are those of the answers; what is held stays.
test_results_of_a_solid_that_moves() {
  local python
  need ffe-run exp2ela
  python=$(python_with_h5py) || skip 'no h5py for python3'
  held_organ
  printf '%s\n' 'object organ organ.ela damping=0.1@4' 'emit shapes' 'emit stress organ' 'gravity 0 0 -9810' 'run 0.1 every 0.02' >fall.scene
  ffe-run -q fall.scene >answers
  ffe-run -q fall.scene -o fall.h5 >/dev/null
  ffe-run -q fall.scene -o fall_%02d.vtu >/dev/null
  local frames=(fall_*.vtu)
  ((${#frames[@]} == $(grep -c '^step ' answers) + 1)) || fail "${#frames[@]} frames" # one at rest
  cat >judge.py <<'P'
import h5py, numpy
times = [float(line.split()[2]) for line in open('answers') if line.startswith('step ')]
with h5py.File('fall.h5') as f:
    t, o = f['time'][:], f['objects/organ']
    u, p = o['displacement'][:], o['points'][:]
    names = []
    o.visit(names.append)
assert list(t[-len(times):]) == times, (t, times)
held = p[:, 2] < -20
assert held.any() and not u[:, held].any()
sink = -u[-len(times):, :, 2].mean(1)
assert sink.min() > 0.5 and (numpy.diff(sink) < 0).any(), sink # it sags and swings back
assert any('mises' in name for name in names), names
lines = open('answers').read().splitlines()
at = max(k for k, line in enumerate(lines) if line.startswith('shape'))
shape = numpy.array([[float(x) for x in line.split()] for line in lines[at + 1 : at + 1 + len(p)]])
assert shape.shape == p.shape and abs(shape - (p + u[-1])).max() < 1e-4 * abs(p).max(), (shape[:2], p[0] + u[-1][0])
P
  "$python" judge.py || fail 'results tell something else'
}
