# Clients that drive ffe-run by a socket: one at a time, one after the other, and none of them harms the scene.
# shellcheck shell=bash disable=SC2317 # functions are called by name

# organ.ela, a cube of 2 mm whose lower corners are held, and what clients are made of.
prepare() {
  command -v python3 >/dev/null || skip 'no python3'
  cube | exp2ela --format off --fix 'z<0' -o organ.ela
  cat >client.py <<'P'
import os, select, socket, struct, sys, time

class Client:
    def __init__(self, path='sock', waits=True):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(60)
        self.socket.connect(path)
        self.lines = self.socket.makefile('rb')
        if waits: self.greeting = self.line()
    def line(self):
        try: return self.lines.readline().decode()
        except ConnectionResetError: return ''
    def send(self, data):
        self.socket.sendall(data if isinstance(data, bytes) else data.encode())
    def ask(self, *lines):
        """The answer to each line, with its acknowledgement."""
        said = []
        for line in lines:
            self.send(line + '\n')
            said.append('')
            while True:
                more = self.line()
                assert more, 'the connection ended behind ' + line
                said[-1] += more
                if more.startswith(('ok ', 'error ')): break
        return said[0] if len(said) == 1 else said
    def close(self):
        self.lines.close()
        self.socket.close()

def driven(path='sock'):
    """A client that is let in: the one before may still be on its way out."""
    for _ in range(600):
        client = Client(path)
        if client.greeting.startswith('ready '): return client
        assert 'busy' in client.greeting, client.greeting
        client.close()
        time.sleep(0.05)
    raise SystemExit('the scene stays busy')
P
}

# Starts a server with these options; it listens when this returns.
listen() {
  ffe-run --serve --ack --listen sock "$@" 2>stderr.txt &
  server=$!
  trap 'kill -KILL "$server" 2>/dev/null || true' EXIT
  local k
  for ((k = 0; k < 600; ++k)); do
    [[ ! -S sock ]] || return 0
    kill -0 "$server" 2>/dev/null || fail 'it does not listen' "$(<stderr.txt)"
    sleep 0.05
  done
  fail 'it does not listen'
}
# Its status is this one, and its socket is gone.
ended() { # STATUS
  local status=0
  wait "$server" || status=$?
  [[ $status == "$1" ]] || fail "status $status, expected $1" "$(<stderr.txt)"
  [[ ! -e sock ]] || fail 'the socket is still there'
}

test_clients_come_one_after_the_other() {
  prepare
  cat >drive.py <<'P'
from client import *
one = Client()
assert one.greeting == 'ready 0\n', one.greeting
print(''.join(one.ask('object o organ.ela', 'emit shapes', 'force o 6 0 0 3', 'step 0.25')), end='')
one.close()
two = driven()
assert two.greeting == 'ready 0.25\n', two.greeting
print(''.join(two.ask('objects', 'release o 6', 'nonsense', 'step 0.25', 'force p 6 0 0 1')), end='')
two.close()
three = driven()
print(''.join(three.ask('select o z>0', 'run 1 every 0.25', 'end')), end='')
assert three.line() == '', 'it speaks behind the end'
P
  listen --record run.scene --events events.csv --latencies latencies.csv -o run.h5
  [[ $(stat -c %a sock) == 600 ]] || fail "mode $(stat -c %a sock)"
  python3 drive.py >answers || fail 'a client fails' "$(<stderr.txt)"
  ended 1
  [[ $(<stderr.txt) == *"sock, client 2:3: 'nonsense' is no command"*'(the first of 2 errors)' ]] || fail "$(<stderr.txt)"
  grep -q ',error,.*"client 2 line 5: there is no object' events.csv || fail "$(<events.csv)"
  # Each has its own numbers, and the run is that of all lines together.
  [[ $(grep -oE '^(ok|error) [0-9]+' answers | tr '\n' ' ') == 'ok 1 ok 2 ok 3 ok 4 ok 1 ok 2 error 3 ok 4 error 5 ok 1 ok 2 ok 3 ' ]] || fail "$(<answers)"
  ffe-run run.scene -o again.h5 | cmp - <(sed -n '/^step/,/^done/p' answers)
  cmp run.h5 again.h5
  [[ $(wc -l <latencies.csv) == 5 ]] || fail "$(<latencies.csv)"
  rm -r ./*
}

test_a_scene_may_come_first() {
  prepare
  mkdir folder
  mv organ.ela folder
  printf '%s\n' 'object o organ.ela' 'step 0.25' >folder/start.scene
  listen folder/start.scene >answers
  python3 -c 'from client import *
c = driven()
assert c.greeting == "ready 0.25\n", c.greeting
c.ask("object p organ.ela", "displace p 6 0 0 0.1", "step", "end")' || fail "$(<stderr.txt)"
  ended 0
  [[ $(tail -2 answers) == $'done\nok 2' ]] || fail "$(<answers)"
  rm -r ./*
}

test_another_client_is_told_that_the_scene_is_busy() {
  prepare
  listen
  cat >drive.py <<'P'
from client import *
one = Client()
others = [Client() for _ in range(3)]
for other in others:
    assert other.greeting == 'error 0: busy, the scene has a client, expected none\n', other.greeting
    assert other.line() == '', 'it is not closed'
# Also while steps are computed.
one.send('object o organ.ela\nforce o 6 0 0 3\nrun 5 every 0.0001\n')
other = Client()
assert 'busy' in other.greeting, other.greeting
while one.line() != 'ok 3\n': pass
# A client that has said all it wants to say still reads, and nobody else is let in before it has.
one.send('run 8 every 0.001\n')
one.socket.shutdown(socket.SHUT_WR)
two = Client(waits=False)
assert not select.select([two.socket], [], [], 0.5)[0], two.line()
steps = 0
while True:
    line = one.line()
    steps += line.startswith('step ')
    if not line: break
assert steps == 3000, steps
assert two.line() == 'ready 8\n'
# Also while it looks after a line at the moment when one goes and another comes.
for i in range(300):
    two.send('# still here\n')
    two.socket.shutdown(socket.SHUT_WR)
    three = Client()
    assert three.greeting == 'ready 8\n', (i, three.greeting)
    two.close()
    two = three
two.ask('end')
P
  python3 drive.py || fail 'a client fails' "$(<stderr.txt)"
  ended 0
  rm -r ./*
}

test_binary_clients_are_greeted_in_frames() {
  prepare
  listen --binary
  cat >drive.py <<'P'
from client import *
def frame(s):
    head = b''
    while len(head) < 28: head += s.recv(28 - len(head))
    magic, kind, thing, step, count = struct.unpack('<IIIQQ', head)
    assert magic == 0x46425747
    body = b''
    while len(body) < 4 * count: body += s.recv(4 * count - len(body))
    return kind, step, body
def connected():
    s = socket.socket(socket.AF_UNIX); s.settimeout(60); s.connect('sock')
    return s
one = connected()
assert frame(one) == (3, 0, struct.pack('<d', 0))
two = connected()
kind, step, text = frame(two)
assert kind == 4 and text.startswith(b'error 0: busy'), text
one.sendall(b'object o organ.ela\nstep 0.5\n')
assert [frame(one) for _ in range(3)] == [(13, 0, struct.pack('<Q', 1)), (3, 1, struct.pack('<d', 0.5)), (13, 1, struct.pack('<Q', 2))]
one.close()
three = connected()
assert frame(three) == (3, 1, struct.pack('<d', 0.5))
three.sendall(b'end\n')
assert frame(three)[0] == 13
P
  python3 drive.py || fail 'a client fails' "$(<stderr.txt)"
  ended 0
  rm -r ./*
}

test_names_that_are_taken_are_refused() {
  prepare
  echo mine >sock
  expect_failure 1 ffe-run timeout 20 ffe-run --serve --listen sock
  [[ $(<sock) == mine ]] || fail 'a file was replaced'
  rm sock
  mkdir sock
  expect_failure 1 ffe-run timeout 20 ffe-run --serve --listen sock
  rmdir sock
  ln -s elsewhere sock
  expect_failure 1 ffe-run timeout 20 ffe-run --serve --listen sock
  rm sock
  expect_failure 1 ffe-run timeout 20 ffe-run --serve --listen no/sock
  expect_failure 1 ffe-run timeout 20 ffe-run --serve --listen "$(printf '%0120d' 0)"
  expect_failure 2 ffe-run ffe-run --listen sock
  [[ ! -e sock ]] || fail 'a socket was left'
  # One that is in use, whether it has a client or not; it takes no notice.
  listen
  timeout 20 ffe-run --serve --listen sock 2>second.txt && fail 'two listen there'
  [[ $(<second.txt) == 'ffe-run: sock: another program listens there, expected another name' ]] || fail "$(<second.txt)"
  cat >drive.py <<'P'
from client import *
import subprocess
c = driven()
c.ask('object o organ.ela')
assert subprocess.run(['ffe-run', '--serve', '--listen', 'sock'], stderr=subprocess.DEVNULL, timeout=20).returncode == 1
c.ask('step', 'end')
P
  python3 drive.py || fail "$(<stderr.txt)"
  ended 0
  # One that nobody listens on any more is replaced.
  listen
  kill -KILL "$server"
  wait "$server" 2>/dev/null || true
  [[ -S sock ]] || fail 'no socket was left by a killed run'
  local old
  old=$(stat -c %i sock)
  ffe-run --serve --ack --listen sock 2>stderr.txt &
  server=$!
  python3 - "$old" <<'P' || fail 'a stale socket is not replaced' "$(<stderr.txt)"
from client import *
for _ in range(600):
    try:
        c = Client()
        break
    except ConnectionRefusedError: time.sleep(0.05)
    except FileNotFoundError: time.sleep(0.05)
c.ask('object o organ.ela', 'step', 'end')
P
  ended 0
  rm -r ./*
}

test_signals_remove_the_socket() {
  prepare
  local signal status
  for signal in INT TERM HUP; do
    # A shell has what it starts in the background ignore SIGINT.
    env --default-signal=INT ffe-run --serve --ack --listen sock 2>stderr.txt &
    server=$!
    trap 'kill -KILL "$server" 2>/dev/null || true' EXIT
    python3 -c 'from client import *
for _ in range(600):
    if os.path.exists("sock"): break
    time.sleep(0.05)
driven().ask("object o organ.ela", "step")'
    kill "-$signal" "$server"
    status=0
    wait "$server" || status=$?
    ((status > 128)) || fail "$signal: status $status"
    [[ ! -e sock ]] || fail "$signal leaves the socket"
  done
  # What somebody else has put in its place stays.
  listen
  python3 -c 'from client import *
c = driven()
os.rename("sock", "old")
socket.socket(socket.AF_UNIX).bind("sock")
c.ask("object o organ.ela", "step", "end")'
  wait "$server" || fail "$(<stderr.txt)"
  [[ -S sock ]] || fail 'the socket of another was removed'
  rm -r ./*
}

# Between bind and listen a client would be refused: the path appears when the socket listens.
test_a_socket_that_is_there_listens() {
  prepare
  has_strace || skip 'no strace that may trace'
  strace -f -o /dev/null -e trace=listen -e inject=listen:delay_enter=1000000 ffe-run --serve --ack --listen sock 2>stderr.txt &
  server=$!
  trap 'kill -KILL "$server" 2>/dev/null || true' EXIT
  python3 -c 'from client import *
for _ in range(6000):
    if os.path.exists("sock"): break
    time.sleep(0.005)
driven().ask("object o organ.ela", "step", "end")' || fail 'a client is refused' "$(<stderr.txt)"
  ended 0
  [[ $(echo sock*) == 'sock*' ]] || fail 'left behind:' "$(echo sock*)"
  # A name as long as a name may be.
  local long
  long=$(printf '%0107d' 0)
  ffe-run --serve --ack --listen "$long" 2>stderr.txt &
  server=$!
  python3 - "$long" <<'P' || fail 'a client of a long name is refused' "$(<stderr.txt)"
from client import *
for _ in range(6000):
    try: driven(sys.argv[1]).ask("object o organ.ela", "step", "end")
    except (FileNotFoundError, ConnectionRefusedError): time.sleep(0.005); continue
    break
P
  ended 0
  rm -r ./*
}

test_a_client_that_dies_harms_nobody() {
  prepare
  listen --record run.scene -o run.h5
  cat >drive.py <<'P'
from client import *
c = Client()
c.ask('object o organ.ela', 'force o 6 0 0 3', 'emit shapes', 'step 0.01')
# Half a line, that would be a whole one: it is not carried out.
c.send('force o 6 0 0 3000')
c.close()
# Whole lines are, also of who does not wait for the answers.
c = driven(); c.send('force o 6 0 0 4\nforce o 6 0 0'); c.close()
c = driven()
assert c.ask('step 0.01').startswith('step 2 ')
# Gone in the midst of a run of many steps, which ends early: it would take hours.
c.send('run 1000 every 0.00001\n')
assert c.line().startswith('step ')
c.close()
c = driven()
assert c.ask('step 0.01').startswith('step '), 'no step'
time_ = float(c.ask('sync').split()[1])
assert 0.02 < time_ < 500, time_
# A client that is killed.
child = os.fork()
if child == 0:
    d = None
    c.send('step 0.01\nstep 0.01\nst')
    os.kill(os.getpid(), 9)
os.waitpid(child, 0)
c.close()
c = driven()
answers = c.ask('step 0.01', 'objects', 'end')
assert answers[1] == 'objects 1\no ela 12 12 0 awake\nok 2\n', answers
P
  python3 drive.py || fail 'a client fails' "$(<stderr.txt)"
  ended 1
  [[ $(<stderr.txt) == *'the client of these steps has disconnected' ]] || fail "$(<stderr.txt)"
  ! grep -q '^force .* 3000$' run.scene || fail 'half a line was carried out' # times may have these digits
  # What was done is what the record holds.
  ffe-run -q run.scene -o again.h5
  cmp run.h5 again.h5
  rm -r ./*
}

test_garbage_harms_nobody() {
  prepare
  listen
  cat >drive.py <<'P'
from client import *
c = Client()
c.ask('object o organ.ela', 'force o 6 0 0 3', 'step 0.01')
assert c.ask('st\0ep 0.01') == 'error 4: a zero byte, expected text\n'
assert c.ask('step 0.01 # \0 in a comment').startswith('step 2 ')
c.send(b'\xff\xfe\x00' * 1000 + b'\n')
assert c.line().startswith('error 6: ')
# Longer than a line may be, with and without its end.
c.send(b'x' * (2**24 + 100))
assert c.line() == 'error 7: a line of over 16 MiB, expected shorter ones\n'
c.send(b'x' * 100 + b'\n')
assert c.ask('step 0.01').startswith('step 3 ')
c.send(b'y' * (2**24 + 100))
c.line()
c.close()
c = driven()
c.send(os.urandom(2**20)) # and away, with what is answered unread
c.close()
c = driven()
answer = c.ask('step 0.01')
assert answer.startswith('step 4 0.04'), answer
c.ask('end')
P
  python3 drive.py || fail 'a client fails' "$(<stderr.txt)"
  ended 1
  rm -r ./*
}

test_a_client_that_never_reads_is_dropped() {
  prepare
  exp2ela --primitive sphere:96x64 --size 50 --fix 'z<-20' -o ball.ela
  listen --stats=stats.json
  cat >drive.py <<'P'
from client import *
c = Client()
c.ask('object o ball.ela', 'emit shapes')
before = time.time()
c.send('step 0\n' * 100 + 'force o near:0,0,50,5 0 0 9\n') # 40 MB of answers
time.sleep(1)
# Who waits is told that it is busy as long as there is hope.
assert 'busy' in Client().greeting
d = driven()
waited = time.time() - before
assert waited > 5, waited
# The connection is over; what was sent behind is not carried out.
steps = 0
while True:
    line = c.line()
    if not line: break
    steps += line.startswith('step ')
assert steps < 100, steps
assert d.ask('objects').split()[-3] == 'asleep'
d.ask('step 0', 'end')
P
  python3 drive.py || fail 'a client fails' "$(<stderr.txt)"
  ended 0
  [[ $(<stderr.txt) == 'ffe-run: warning: client 1 read nothing for 10 s while answers waited, it is dropped' ]] || fail "$(<stderr.txt)"
  rm -r ./*
}

test_other_users_are_refused_by_name() {
  prepare
  [[ $(id -u) == 0 ]] || skip 'not root, who alone can be somebody else'
  local name
  name=$(id -un 65534 2>/dev/null) || skip 'no user 65534'
  listen
  chmod 711 .
  chmod 666 client.py
  cat >drive.py <<'P'
import os, sys
sys.path.insert(0, '.')
from client import *
child = os.fork()
if child == 0:
    os.setgid(65534)
    os.setuid(65534)
    try:
        Client()
        os._exit(1) # the mode lets nobody in
    except PermissionError: os._exit(0)
assert os.waitpid(child, 0)[1] == 0, 'the mode lets others in'
os.chmod('sock', 0o666)
child = os.fork()
if child == 0:
    os.setgid(65534)
    os.setuid(65534)
    c = Client()
    good = c.greeting == 'error 0: user %s (65534) may not drive the scene, expected root (0)\n' % sys.argv[1] and c.line() == ''
    os._exit(0 if good else 1)
assert os.waitpid(child, 0)[1] == 0, 'another user is let in'
driven().ask('object o organ.ela', 'step', 'end')
P
  python3 drive.py "$name" || fail 'a client fails' "$(<stderr.txt)"
  ended 0
  [[ $(<stderr.txt) == "ffe-run: warning: user $name (65534) may not drive the scene, expected root (0)" ]] || fail "$(<stderr.txt)"
  rm -r ./*
}

test_a_client_without_a_descriptor_is_refused_by_name() {
  prepare
  listen
  cat >drive.py <<'P'
from client import *
import resource
server = int(sys.argv[1])
limits = resource.prlimit(server, resource.RLIMIT_NOFILE)
free = next(n for n in range(limits[0]) if not os.path.lexists('/proc/%d/fd/%d' % (server, n)))
used = lambda: sum(int(x) for x in open('/proc/%d/stat' % server).read().rsplit(')')[1].split()[11:13]) / os.sysconf('SC_CLK_TCK')
resource.prlimit(server, resource.RLIMIT_NOFILE, (free, limits[1]))
before = used()
for _ in range(3):
    c = Client()
    assert c.greeting == 'error 0: no file descriptor is left for a client, expected fewer open files or a higher limit: Too many open files\n', c.greeting
    assert c.line() == '', 'it is not closed'
    c.close()
    time.sleep(0.3)
assert used() - before < 0.3, 'it spins'
resource.prlimit(server, resource.RLIMIT_NOFILE, limits)
c = driven()
c.ask('object o organ.ela', 'force o 6 0 0 3', 'step 0.01')
# Another one is told what it always is.
free = next(n for n in range(limits[0]) if not os.path.lexists('/proc/%d/fd/%d' % (server, n)))
resource.prlimit(server, resource.RLIMIT_NOFILE, (free, limits[1]))
for _ in range(3): assert 'busy' in Client().greeting
assert c.ask('step 0.01').startswith('step 2 0.02')
# A file that can't be opened is the fault of its line.
assert 'Too many open files' in c.ask('object p organ.ela', 'nodes p')[1]
resource.prlimit(server, resource.RLIMIT_NOFILE, limits)
c.ask('nodes p', 'step 0.01', 'end')
P
  python3 drive.py "$server" || fail 'a client fails' "$(<stderr.txt)"
  ended 1
  [[ $(grep -c 'warning: no file descriptor is left' stderr.txt) == 3 ]] || fail "$(<stderr.txt)"
  rm -r ./*
}
