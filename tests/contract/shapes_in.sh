# ffe-run --shapes-in: shapes in a file that others map, as gewebe_serve(5) has it.
# shellcheck shell=bash disable=SC2317 # functions are called by name

# organ.ela, a cube of 2 mm whose lower corners are held; a reader; and a scene that is driven by a pipe.
prepare() {
  command -v python3 >/dev/null || skip 'no python3'
  cube | exp2ela --format off --fix 'z<0' -o organ.ela
  cat >shapes.py <<'P'
import mmap, os, struct, subprocess

class Shapes:
    def __init__(self, path='shapes'):
        self.file = open(path, 'rb')
        self.map()
        assert bytes(self.memory[:8]) == b'GWBSHAPE' and self.words[1] == 1, 'no file of shapes'
    def map(self):
        self.memory = memoryview(mmap.mmap(self.file.fileno(), 0, prot=mmap.PROT_READ))
        self.words = self.memory.cast('Q') # each is one load
    def read(self):
        """The last frame: sequence, step, time, generation, positions by name."""
        while True:
            sequence = self.words[3]
            if sequence == 0: return None
            place = 4 + 2 * (sequence % 2)
            at, most = self.words[place], self.words[place + 1]
            if at + most > len(self.memory):
                self.map()
                continue
            frame = bytes(self.memory[at:at + most])
            if self.words[2] < sequence + 2: break
        head = struct.unpack_from('<QQdQQQ', frame)
        assert head[0] == sequence, head
        shapes = {}
        for k in range(head[4]):
            name, length, positions, nodes = struct.unpack_from('<4Q', frame, 64 + 32 * k)
            assert positions % 64 == 0 and positions + 24 * nodes <= head[5] <= most
            shapes[frame[name:name + length].decode()] = struct.unpack_from('<%dd' % (3 * nodes), frame, positions)
        return *head[:4], shapes

class Run:
    def __init__(self, *options):
        self.process = subprocess.Popen(['ffe-run', '--serve', '--ack', '--shapes-in', 'shapes', *options],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    def ask(self, *lines):
        """Shapes by name, as the answers to these lines tell them."""
        shapes, self.said = {}, ''
        for line in lines:
            self.process.stdin.write(line + '\n')
            self.process.stdin.flush()
            while True:
                answer = self.process.stdout.readline()
                assert answer, 'it ended behind ' + line
                words = answer.split()
                if words[0] == 'shapes':
                    shapes[words[1]] = tuple(float(x) for _ in range(int(words[2])) for x in self.process.stdout.readline().split())
                else: self.said += answer
                if words[0] in ('ok', 'error'): break
        return shapes
P
}

test_shapes_are_those_of_the_answers() {
  prepare
  exp2ela --primitive tube:8x6 --size 10,40 --fix 'z<1 or z>39' -o tube.ela
  exp2ela --primitive sphere:12x8 --size 30 --solid --cell 12 --material liver --fix 'z<-9' -o solid.ela
  cat >in.py <<'P'
from shapes import *
bits = lambda shapes: {name: struct.pack('<%dd' % len(p), *p) for name, p in shapes.items()}
run = Run()
def compare(number, told):
    """The frame of this answer holds its shapes byte for byte."""
    sequence, step, time, generation, shapes = reader.read()
    assert (sequence, step) == (number, number), (sequence, step, number)
    assert list(shapes) == list(told), (list(shapes), list(told), run.said)
    assert bits(shapes) == bits(told), number
    return generation, time
run.ask('object o organ.ela')
reader = Shapes()
assert reader.read() is None, 'a frame before a step'
told = run.ask('object t tube.ela method=ffe', 'object s solid.ela', 'emit shapes', 'displace o 6 0.3 0 0.1 over 0.1',
               'force t near:10,0,20,5 900 0 0', 'force s z>10 0 0 5e5 total', 'step 0.02')
assert 'error' not in run.said, run.said
first, time = compare(1, told)
assert time == 0.02
for k in range(2, 20): assert compare(k, run.ask('step 0.003'))[0] == first, 'another generation'
# A new object, and a cut that takes a part off: both come with the next answer.
told = run.ask('object late organ.ela', 'step 0.01')
second, _ = compare(20, told)
assert second > first and list(told) == ['o', 't', 's', 'late']
told = run.ask('cut t plane 0 0 14 0 0 1', 'cut t plane 0 0 26 0 0 1', 'step 0.002')
third, _ = compare(21, told)
assert third > second and 't.1' in told, (second, third, list(told), run.said)
for k in range(22, 40):
    told = run.ask('step 0.003')
    assert compare(k, told)[0] == third
# A step that fails shows nothing.
run.ask('step -1')
assert run.said.startswith('error '), run.said
compare(39, told)
told = run.ask('restore t', 'step 0.001')
assert compare(40, told)[0] > third
# Objects that do not fit any more: the file has grown, readers map it anew.
before = os.path.getsize('shapes')
told = run.ask(*['object big%d tube.ela' % k for k in range(60)], 'step 0')
compare(41, told)
assert os.path.getsize('shapes') > before and len(reader.memory) > before
mode = os.stat('shapes').st_mode
assert mode & 0o777 == 0o600, oct(mode)
run.ask('end')
assert run.process.wait() == 1 and not os.path.exists('shapes')
P
  python3 in.py 2>stderr.txt || fail 'shapes differ' "$(<stderr.txt)"
  # They are there as well where no answer tells them.
  printf '%s\n' 'object o organ.ela' 'object p organ.ela method=ffe' 'force p 6 0 0 3' 'step 0.02' 'nodes p positions' 'nodes o positions' |
    ffe-run --serve --shapes-in shapes >answers || fail 'positions are refused' "$(<answers)"
  [[ $(grep -c '^nodes' answers) == 2 ]] || fail "$(<answers)"
  # A model that can't be read is the fault of its step, and no frame comes of it.
  echo broken >broken.ela
  printf '%s\n' 'object o organ.ela' 'step 0.02' 'object b broken.ela' 'step 0.02' |
    ffe-run --serve --shapes-in shapes >answers 2>stderr.txt && fail 'status 0'
  [[ $(<answers) == $'step 1 0.02\ndone\nerror 4: line 3: broken.ela:'* ]] || fail "$(<answers)"
}

test_names_that_are_taken_are_refused() {
  prepare
  printf '%s\n' 'object o organ.ela' 'step 0.01' end >in.scene
  local old
  expect_failure 2 ffe-run ffe-run --shapes-in shapes in.scene
  [[ ! -e shapes ]] || fail 'a file was made'
  echo mine >shapes
  expect_failure 1 ffe-run ffe-run --serve --shapes-in shapes in.scene
  [[ $(<shapes) == mine ]] || fail 'a file was replaced'
  : >shapes
  expect_failure 1 ffe-run ffe-run --serve --shapes-in shapes in.scene
  rm shapes
  ln -s elsewhere shapes
  expect_failure 1 ffe-run ffe-run --serve --shapes-in shapes in.scene
  [[ ! -e elsewhere ]] || fail 'a link was followed'
  rm shapes
  mkdir shapes
  expect_failure 1 ffe-run ffe-run --serve --shapes-in shapes in.scene
  rmdir shapes
  mkfifo shapes
  expect_failure 1 ffe-run timeout 20 ffe-run --serve --shapes-in shapes in.scene
  rm shapes
  expect_failure 1 ffe-run ffe-run --serve --shapes-in no/shapes in.scene
  expect_failure 1 ffe-run ffe-run --serve --shapes-in "$(printf '%0300d' 0)" in.scene
  # One name, two duties.
  expect_failure 1 ffe-run ffe-run --serve --shapes-in shapes --listen shapes in.scene
  [[ ! -e shapes ]] || fail 'it stays'
  # That of a run is its own as long as it lives, and of nobody when it was killed.
  coproc SIMULATOR { exec ffe-run --serve --ack --shapes-in shapes; }
  local pid=$SIMULATOR_PID out=${SIMULATOR[0]} in=${SIMULATOR[1]} line
  echo '# nothing' >&"$in"
  read -rt 60 -u "$out" line
  old=$(stat -c %i shapes)
  ffe-run --serve --shapes-in shapes in.scene 2>stderr.txt && fail 'two runs write there'
  [[ $(<stderr.txt) == 'ffe-run: shapes: another run has its shapes there, expected another name' ]] || fail "$(<stderr.txt)"
  kill -KILL "$pid"
  wait "$pid" 2>/dev/null || true
  [[ $(stat -c %i shapes) == "$old" ]] || fail 'no file of a killed run'
  ffe-run --serve --shapes-in shapes in.scene >answers || fail 'what a killed run has left is not replaced'
  [[ ! -e shapes ]] || fail 'it stays'
}

test_it_is_gone_with_the_run() {
  prepare
  local signal status line pid out in
  for signal in INT TERM HUP; do
    # A shell has what it starts in the background ignore SIGINT.
    coproc SIMULATOR { exec env --default-signal=INT ffe-run --serve --ack --shapes-in shapes; }
    pid=$SIMULATOR_PID out=${SIMULATOR[0]} in=${SIMULATOR[1]}
    echo 'object o organ.ela' >&"$in"
    read -rt 60 -u "$out" line
    [[ $line == 'ok 1' && -f shapes ]] || fail "no file: $line"
    kill "-$signal" "$pid"
    status=0
    wait "$pid" 2>/dev/null || status=$?
    ((status > 128)) || fail "$signal: status $status"
    [[ ! -e shapes ]] || fail "$signal leaves the file"
  done
  # What somebody else has put in its place stays.
  cat >in.py <<'P'
from shapes import *
run = Run()
run.ask('object o organ.ela', 'step')
os.rename('shapes', 'old')
open('shapes', 'w').write('mine')
run.ask('step', 'end')
assert run.process.wait() == 0
P
  python3 in.py || fail 'the run fails'
  [[ $(<shapes) == mine ]] || fail 'the file of another was removed'
}

test_a_full_disk_ends_the_run_by_name() {
  prepare
  command -v prlimit >/dev/null || skip 'no prlimit'
  local k
  { for k in {1..60}; do echo "object o$k organ.ela"; done; echo step; } >in.scene
  printf '%s\n' 'object o organ.ela' step >small.scene
  prlimit --fsize=16384 ffe-run --serve --shapes-in shapes small.scene >answers || fail 'a small one does not fit'
  prlimit --fsize=16384 ffe-run --serve --shapes-in shapes in.scene 2>stderr.txt >answers && fail 'status 0'
  [[ $(<stderr.txt) == 'ffe-run: shapes: cannot get larger: File too large' && ! -s answers ]] || fail "$(<stderr.txt)" "$(<answers)"
  [[ ! -e shapes ]] || fail 'it stays'
  expect_failure 1 ffe-run prlimit --fsize=1024 ffe-run --serve --shapes-in shapes small.scene
  [[ ! -e shapes ]] || fail 'it stays'
}
