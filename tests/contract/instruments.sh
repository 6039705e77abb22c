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
  ffe-run -q --events log.csv "$@" touch.scene >answers 2>told || fail "$(<told)"
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
