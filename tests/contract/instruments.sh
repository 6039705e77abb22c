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
