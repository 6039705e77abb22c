# Instruments in what a run leaves: events, results, pictures.
# shellcheck shell=bash disable=SC2317 # functions are called by name

# Two organs, by either method, a sphere that is pressed into one and a capsule that turns beside the other and holds a part of it;
# a blade; and a sphere that comes again as another. touch.scene, log.csv, answers.
touched() {
  exp2ela -q --primitive sphere:24x16 --size 50 --fix 'z<-20' -o ball.ela
  exp2ela -q --primitive sphere:16x12 --size 20 --to obj | awk '$1 == "v" { $2 += 90 } 1' | exp2ela -q --format obj --fix 'z<-8' -o nut.ela
  cat >touch.scene <<'S'
object ball ball.ela method=ffe
object nut nut.ela
emit instruments
instrument probe sphere 6 0 -0.5 60 friction 0.2
instrument clip capsule 2 110 0 2 110 0 14
grasp nut "x>106 and z>0" clip
move probe 1 2 49 over 0.1
at 0.055 move clip 112 0 2 turn 0 1 0 30 over 0.02
run 0.1 every 0.02
instrument knife blade 0 99 0 0 99 40
withdraw clip
step 0.02
at 0.13 instrument probe capsule 4.5 3 0 60 30 0 60
step 0.02
withdraw probe
step 0.02
S
  ffe-run --events log.csv "$@" touch.scene >answers 2>told || fail "$(<told)"
}

test_events_tell_what_instruments_feel() {
  touched
  cat >in.py <<'P'
import csv
steps, time = {}, None
for line in open('answers'):
    words = line.split()
    if words[0] == 'step':
        time = words[2]
        steps[time] = {}
    elif len(words) == 10:
        steps[time][words[0]] = words[1:]
log = list(csv.DictReader(open('log.csv')))
assert all(None not in row and None not in row.values() for row in log), 'rows of another length'
felt = {}
for row in log:
    if row['what'] == 'felt':
        felt.setdefault(row['time'], {})[row['object']] = row
names = lambda prefix: [prefix + '_' + a for a in 'xyz']
assert list(felt) == list(steps), (list(felt), list(steps))
pushed = held = 0
for time, answer in steps.items():
    assert list(answer) == list(felt[time]), time
    for name, told in answer.items():
        row = felt[time][name]
        assert [row[k] for k in ['x', 'y', 'z'] + names('force') + names('torque')] == told, (time, name)
        push = any(float(x) for x in told[3:6])
        assert int(row['touched']) > 0 or not push, (time, name)
        pushed += push and name == 'probe'
        held += push and name == 'clip'
assert pushed > 2 and held > 2, (pushed, held)
felt = {round(float(time), 9): rows for time, rows in felt.items()}
# Where the commands have them.
number = lambda row, keys: [float(row[k]) for k in keys]
def near(a, b): return all(abs(x - y) < 1e-12 * 100 for x, y in zip(a, b))
quaternion = ['turn_w', 'turn_x', 'turn_y', 'turn_z']
at = felt[0.1]
assert number(at['probe'], 'xyz') == [1, 2, 49] == number(at['probe'], names('end')) and float(at['probe']['value']) == 6
assert at['probe']['text'] == 'sphere' and at['clip']['text'] == 'capsule'
s, c = 0.5, 3 ** 0.5 / 2  # of 30 degrees
assert near(number(at['clip'], 'xyz'), [112, 0, 2]) and near(number(at['clip'], names('end')), [112 + 12 * s, 0, 2 + 12 * c])
assert near(number(at['clip'], quaternion), [((1 + c) / 2) ** 0.5, 0, ((1 - c) / 2) ** 0.5, 0])
half = felt[0.06]['probe']  # of a smooth way of 0.1 s: x^2 (3 - 2 x) at x = 0.6
x = 0.6 * 0.6 * (3 - 1.2)
assert near(number(half, 'xyz'), [x, -0.5 + 2.5 * x, 60 - 11 * x]), half
assert list(felt[0.12]) == ['probe', 'knife']
assert felt[0.12]['knife']['text'] == 'blade' and float(felt[0.12]['knife']['value']) == 0
again = felt[0.14]['probe']
assert again['text'] == 'capsule' and float(again['value']) == 4.5 and number(again, names('end')) == [30, 0, 60]
# Commands tell it too, as they took effect.
of = lambda what, name: [r for r in log if r['what'] == what and r['object'] == name]
assert [r['text'] for r in of('instrument', 'probe')] == ['sphere', 'capsule']
assert number(of('instrument', 'clip')[0], names('end')) == [110, 0, 14]
move = of('move', 'clip')[0]
assert move['time'] == '0.055' and near(number(move, names('end')), number(at['clip'], names('end'))), move
assert len(of('withdraw', 'clip')) == 1
P
  python3 in.py
  rm in.py log.csv answers told touch.scene ./*.ela
}

test_results_hold_instruments() {
  local python
  python=$(python_with_h5py) || skip 'no h5py for python3'
  touched -o run.h5
  cat >in.py <<'P'
import h5py, numpy as np
import xml.etree.ElementTree as ET
steps = []
for line in open('answers'):
    words = line.split()
    if words[0] == 'step':
        steps.append((float(words[2]), {}))
    elif len(words) == 10:
        steps[-1][1][words[0]] = np.array([float(w) for w in words[1:]])
with h5py.File('run.h5') as f:
    assert f.attrs['version'] == 1 and list(f['time'][1:]) == [t for t, _ in steps]
    all = f['instruments']
    assert sorted(all, key=lambda name: all[name].attrs['order']) == ['probe', 'clip', 'knife']
    frames, touched = len(f['time']), 0
    for name in all:
        i, first = all[name], int(all[name].attrs['first_frame'])
        kind, radius, ends, pose = (i[k][:] for k in ['kind', 'radius', 'ends', 'pose'])
        assert {len(i[k]) for k in i if k != 'surfaces'} == {frames - first}, name
        for k in range(first, frames):
            row, told = k - first, steps[k - 1][1]
            assert (kind[row] > 0) == (name in told), (name, k)
            if name not in told:
                assert not any(i[a][row].any() for a in i if a != 'surfaces'), (name, k)
                continue
            assert (pose[row][:, 3] == told[name][:3]).all() and (ends[row][0] == told[name][:3]).all()
            assert (i['force'][row] == told[name][3:6]).all() and (i['torque'][row] == told[name][6:]).all(), (name, k)
            rotation = pose[row][:, :3]
            assert abs(rotation @ rotation.T - np.eye(3)).max() < 1e-14 and abs(np.linalg.det(rotation) - 1) < 1e-14
            touched += bool(i['touched'][row])
    assert touched > 5 and all['knife'].attrs['first_frame'] == 6 and all['probe'].attrs['first_frame'] == 1
    probe, clip = all['probe'], all['clip']
    assert list(probe['kind']) == [1, 1, 1, 1, 1, 1, 2, 0] and list(probe['radius']) == [6] * 6 + [4.5, 0]
    assert list(clip['kind']) == [2, 2, 2, 2, 2, 0, 0, 0] and all['knife']['kind'][0] == 3
    assert (probe['friction'][:6] == 0.2).all() and (probe['ends'][6] == [[3, 0, 60], [30, 0, 60]]).all()
    # The second end, which the rotation turned by 30 degrees about y.
    end = clip['pose'][4][:, :3] @ [0, 0, 12] + clip['pose'][4][:, 3]
    assert abs(end - clip['ends'][4][1]).max() < 1e-12 and abs(end - [118, 0, 2 + 12 * 0.75 ** 0.5]).max() < 1e-12, end

    # What XDMF shows: in each frame those that are there, each corner at the radius from the axis.
    series = ET.parse('run.xdmf').getroot().find('Domain/Grid')
    def rows(item):
        slab, array = item.findall('DataItem')
        start, stride, count = np.array(slab.text.split(), int).reshape(3, -1)
        file, path = array.text.split(':')
        assert file == 'run.h5' and list(f[path].shape) == [int(n) for n in array.get('Dimensions').split()], path
        assert (stride == 1).all() and [int(n) for n in item.get('Dimensions').split()] == list(count[1:])
        return f[path][tuple(slice(a, a + n) for a, n in zip(start, count))][0]
    shown = 0
    for k, frame in enumerate(series.findall('Grid')):
        grids = {g.get('Name')[11:]: g for g in frame.findall('Grid') if g.get('Name').startswith('instrument ')}
        assert sorted(grids) == (sorted(steps[k - 1][1]) if k else []), (k, list(grids))
        for name, grid in grids.items():
            row, points = k - int(all[name].attrs['first_frame']), rows(grid.find('Geometry/DataItem')).astype(float)
            a, b = all[name]['ends'][row]
            radius = all[name]['radius'][row] or np.linalg.norm(b - a) / 100
            t = np.clip((points - a) @ (b - a) / max((b - a) @ (b - a), 1e-300), 0, 1)
            off = np.linalg.norm(points - a - t[:, None] * (b - a), axis=1)
            assert abs(off - radius).max() < 1e-5, (name, k, off)
            t = f[grid.find('Topology/DataItem').text.split(':')[1]][:]
            p, q, r = points[t].transpose(1, 0, 2) - a
            volume = np.einsum('ij,ij', p, np.cross(q, r)) / 6
            exact = np.pi * radius ** 2 * (np.linalg.norm(b - a) + 4 / 3 * radius)
            assert 0.97 < volume / exact < 1, (name, k, volume / exact)
            force = [g for g in grid.findall('Attribute') if g.get('Name') == 'force'][0]
            assert (rows(force.find('DataItem')) == steps[k - 1][1][name][3:6]).all()
            shown += 1
    assert shown == 7 + 5 + 3, shown
P
  "$python" in.py
  # The same bytes from another number of threads, and none of it in a file without instruments.
  mkdir again
  ffe-run -q -j 1 touch.scene -o again/run.h5 2>/dev/null
  cmp run.h5 again/run.h5
  cmp run.xdmf again/run.xdmf
  printf '%s\n' 'object ball ball.ela' 'step 0.01' | ffe-run -q -o bare.h5
  ! "$python" -c 'import h5py; h5py.File("bare.h5")["instruments"]' 2>/dev/null || fail 'instruments where none are'
  rm -r in.py log.csv answers told touch.scene again ./*.ela ./*.h5 ./*.xdmf
}

test_vtk_reads_instruments() {
  python3 -c 'import vtk' 2>/dev/null || skip 'no VTK for python3'
  touched -o run_%d.vtu
  cat >in.py <<'P'
import csv, math, vtk
from vtk.util.numpy_support import vtk_to_numpy as array
felt = {}
for row in csv.DictReader(open('log.csv')):
    if row['what'] == 'felt':
        felt.setdefault(row['time'], {})[row['object']] = row
number = {'probe': -1, 'clip': -2, 'knife': -3}
for k, time in enumerate([None] + list(felt)):
    reader = vtk.vtkXMLUnstructuredGridReader(); reader.SetFileName(f'run_{k}.vtu'); reader.Update()
    grid = reader.GetOutput()
    of = array(grid.GetCellData().GetArray('object'))
    told = felt[time] if k else {}
    assert set(of) == {0, 1} | {number[name] for name in told}, (k, set(of))
    warp = vtk.vtkWarpVector(); warp.SetInputData(grid); warp.SetInputArrayToProcess(0, 0, 0, 0, 'displacement'); warp.Update()
    points = array(warp.GetOutput().GetPoints().GetData())
    cells = array(grid.GetCells().GetConnectivityArray()).reshape(-1, 3)
    for name, row in told.items():
        p = points[cells[of == number[name]].ravel()]
        a, b = ([float(row[c]) for c in names] for names in ('xyz', ['end_x', 'end_y', 'end_z']))
        radius = float(row['value']) or math.dist(a, b) / 100
        ab = [y - x for x, y in zip(a, b)]
        for q in p[::7]:
            t = sum((x - y) * z for x, y, z in zip(q, a, ab)) / (sum(z * z for z in ab) or 1)
            t = min(max(t, 0), 1)
            assert abs(math.dist(q, [x + t * z for x, z in zip(a, ab)]) - radius) < 1e-5, (k, name)
P
  python3 in.py
  rm in.py log.csv answers told touch.scene ./*.ela ./*.vtu
}


# What each pixel must be: red where a ray meets an instrument at its radius, and as bright as the angle of its own normal
# with the light has it. A ring of a pixel on both sides of the outline is free.
test_pictures_show_instruments_where_they_are() {
  python3 -c 'import numpy' 2>/dev/null || skip 'no numpy for python3'
  exp2ela -q --primitive sphere:16x12 --size 20 --fix 'z<-8' -o ball.ela
  cat >free.scene <<'S'
object ball ball.ela
instrument probe sphere 12 60 -10 50 friction 0.2
instrument clip capsule 4 -40 0 30 -40 0 60
move probe 90 -30 70 over 0.1
at 0.055 move clip -30 0 40 turn 1 1 0 70 over 0.02
run 0.1 every 0.05
instrument knife blade 60 0 0 99 20 -30
instrument probe capsule 3 60 -10 50 90 -10 50
step 0.05
withdraw clip
step 0.05
S
  ffe-run --events log.csv free.scene -o run.h5 >answers
  cat >in.py <<'P'
import csv, sys
import numpy as np
felt = {}
for row in csv.DictReader(open('log.csv')):
    if row['what'] == 'felt':
        felt.setdefault(row['time'], []).append(row)
n, eye, target, fov = 400, np.array([160., -300, 170]), np.array([20., 0, 30]), 30
light = np.array([-0.6, -0.64, 0.48])
back = (eye - target) / np.linalg.norm(eye - target)
right = np.cross([0, 0, 1], back); right /= np.linalg.norm(right)
up = np.cross(back, right)
half = np.tan(np.radians(fov / 2))
s = ((np.arange(n) + 0.5) / n * 2 - 1) * half
rays = right * s[None, :, None] - up * s[:, None, None] - back
rays /= np.linalg.norm(rays, axis=2)[:, :, None]
def core(ray, a, b):
    """How near each ray comes to the axis, and to which point of it."""
    across = lambda v: v - (v * ray).sum(axis=2)[:, :, None] * ray
    m, w = across(b - a), across(a - eye)
    t = np.clip(-(w * m).sum(axis=2) / np.maximum((m * m).sum(axis=2), 1e-300), 0, 1)[:, :, None]
    return np.linalg.norm(w + t * m, axis=2), a + t * (b - a)
seen = lit = 0
for k, time in enumerate([None] + list(felt)):
    data = open(sys.argv[1] % k, 'rb').read()
    picture = np.frombuffer(data[-3 * n * n:], np.uint8).reshape(n, n, 3).astype(float) / 255
    red = (picture[:, :, 0] > 0) & (picture[:, :, 1] == 0) & (picture[:, :, 2] == 0)
    inside, near = np.zeros((n, n), bool), np.zeros((n, n), bool)
    for row in felt[time] if k else []:
        number = lambda names: np.array([float(row[c]) for c in names])
        a, b, radius = number('xyz'), number(['end_x', 'end_y', 'end_z']), float(row['value'])
        radius = radius or np.linalg.norm(b - a) / 100
        d, p = core(rays, a, b)
        pixel = np.linalg.norm(p - eye, axis=2) * half * 2 / n
        mine = d < radius - pixel
        inside |= mine
        near |= abs(d - radius) <= pixel
        if (a == b).all():  # and how bright a sphere is
            sine, cosine = radius / np.linalg.norm(a - eye), (a - eye) @ -back / np.linalg.norm(a - eye)
            scale = n / 2 / half  # the cone of rays that meet it, cut by the picture's plane
            exact = np.pi * sine ** 2 * (1 - sine ** 2) ** 0.5 / (cosine ** 2 - sine ** 2) ** 1.5 * scale ** 2
            area, ring = (red & (d < radius + pixel)).sum(), 2 * (np.pi * exact) ** 0.5
            assert abs(area - exact) < 0.2 * ring, (k, area, exact, ring)
            along = (rays * (a - eye)).sum(axis=2)
            hit = eye + rays * (along - np.sqrt(np.maximum(radius ** 2 - d ** 2, 0)))[:, :, None]
            shade = np.maximum(((hit - a) / radius) @ light, 0) * 0.9 + 0.1
            inner = d < radius - 2 * pixel
            assert abs(picture[:, :, 0] - shade)[inner].max() < 3 / 255, (k, abs(picture[:, :, 0] - shade)[inner].max())
            lit += inner.sum()
    assert red[inside].all(), (k, (~red & inside).sum())
    assert not (red & ~inside & ~near).any(), (k, (red & ~inside & ~near).sum())
    seen += inside.sum()
assert seen > 6000 and lit > 2000, (seen, lit)
P
  local backend backends=(cpu)
  local look=(--frames all --size 400 --eye '160,-300,170' --target '20,0,30' --supersample 1 --shade 0.9 --fill 0
    --light-direction '-0.6,-0.64,0.48' --color '0,1,0' --background '0,0,1' --instrument-color '1,0,0')
  cube >in.off
  if emboss-render --plain --backend gl --size 8 in.off -o /dev/null 2>/dev/null; then
    backends+=(gl)
  else
    left_out 'no OpenGL'
  fi
  for backend in "${backends[@]}"; do
    emboss-render --backend "$backend" "${look[@]}" run.h5 -o "$backend-%d.ppm"
    python3 in.py "$backend-%d.ppm" || fail "by $backend"
  done
  # They are no part of what places the camera.
  emboss-render --backend cpu --frame 2 --stats=with.json --size 64 run.h5 -o with.png
  emboss-render --backend cpu --frame 2 --no-instruments --stats=none.json --size 64 run.h5 -o none.png
  place() { sed 's/.*\("eye":[^]]*\].*"light":[^]]*\]\).*/\1/' "$1"; }
  [[ $(place with.json) == "$(place none.json)" ]] || fail 'the camera moved' "$(<with.json)" "$(<none.json)"
  rm ./*.ppm run.h5
  touched -o run.h5
  # They are left out.
  emboss-render --backend cpu --no-instruments --plain --size 64 run.h5 --to ppm -o without.ppm
  emboss-render --backend cpu --object ball --frame 3 --stats=one.json --size 64 run.h5 --to ppm -o one.ppm
  grep -q '"surfaces":1,' one.json || fail "$(<one.json)"
  emboss-render --backend cpu --frame 3 --size 64 run.h5 -o with.png
  emboss-render --backend cpu --frame 3 --no-instruments --size 64 run.h5 -o none.png
  ! cmp -s with.png none.png || fail 'the instruments are not to be seen'
  # A texture on the organ stays as it was, and one of theirs is none.
  emboss-render --backend cpu --frame 3 --texture veins --uv-scale 30 --no-instruments --supersample 1 --size 128 run.h5 -o a.ppm
  emboss-render --backend cpu --frame 3 --texture veins --uv-scale 30 --instrument-color 1,0,0 --supersample 1 --size 128 run.h5 -o b.ppm
  python3 - <<'P'
a, b = (open(f, 'rb').read()[-3 * 128 * 128:] for f in ('a.ppm', 'b.ppm'))
other = [k for k in range(128 * 128) if a[3 * k:3 * k + 3] != b[3 * k:3 * k + 3]]
assert 20 < len(other) < 1000 and all(b[3 * k] > 2 * b[3 * k + 1] == 2 * b[3 * k + 2] for k in other), len(other)
P
  emboss-render --backend cpu --frame 3 --field displacement --size 64 run.h5 -o field.png
  expect_failure 2 emboss-render emboss-render --no-instruments --instrument-color 1,0,0 run.h5
  expect_failure 2 emboss-render emboss-render --no-instruments in.off
  rm -r in.py in.off log.csv answers told touch.scene free.scene ./*.ela ./*.h5 ./*.xdmf ./*.ppm ./*.png ./*.json
}
