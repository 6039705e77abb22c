# A program that drives ffe-run line by line: nothing lost, wrong lines answered, records that replay, files read late.
# shellcheck shell=bash disable=SC2317 # functions are called by name

need() {
  local tool
  for tool in "$@"; do
    command -v "$tool" >/dev/null || skip "no $tool"
  done
}

# organ.ela: a cube of 2 mm whose lower corners are held.
organ() {
  cube >cube.off
  exp2ela --fix 'z<0' cube.off -o organ.ela
  rm cube.off
}

digest() { grep -o '"digest":"[0-9a-f]*"' "$1"; }

test_devices_are_no_models() {
  need ffe-run exp2ela
  organ
  mkfifo endless
  local status=0
  printf '%s\n' 'object a /dev/zero' 'object b /dev/null' 'object o organ.ela' 'displace o 6 0 0 0.01' 'step 0.01' |
    ffe-run --serve >answers 2>stderr.txt || status=$?
  [[ $status == 1 && $(grep -c '^error [12]: /dev/[a-z]*: is a device, expected a file or a pipe$' answers) == 2 &&
    $(grep -c '^step 1 0.01$' answers) == 1 ]] || fail "status $status" "$(<answers)"
  # A pipe is read, as long as it has an end.
  cat organ.ela >endless &
  printf '%s\n' 'object o endless' 'displace o 6 0 0 0.01' 'step 0.01' >piped.scene
  ffe-run piped.scene >piped
  wait
  tail -2 answers | cmp - piped
}

test_ten_thousand_steps_in_lockstep_and_again_from_the_record() {
  need ffe-run exp2ela ffe-precompute python3
  organ
  ffe-precompute --columns all organ.ela -o organ.h5
  mkdir log
  cat >simulator.py <<'P'
import subprocess, sys
run = subprocess.Popen(['ffe-run', '--serve', '--record', 'log/run.scene', '--events', 'log/run.csv', '--stats=live.json'],
                       stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=open('stderr.txt', 'wb'), bufsize=0)
answers = open('answers', 'wb')
reader = open(run.stdout.fileno(), 'rb', closefd=False)
send = lambda text: run.stdin.write(text.encode())
send('object still organ.ela store=organ.h5\nobject moving organ.ela\nemit forces\n')
number = 3
wrong = ['displace still 6 0 nan 0', 'displace moving 0 0 0 1', 'step -1', 'cut still 3', 'release nobody all']
for k in range(1, 10001):
    if k % 500 == 0:  # answered at once
        send(wrong[k // 500 % 5] + '\n')
        number += 1
        line = reader.readline()
        assert line.startswith(b'error %d: ' % number), line
    send(['displace still 6 0.00%d 0 0.01' % (k % 83), 'displace moving 6,7,6 0.00%d 0 0' % (k % 97),  # a node named twice
          'force still 4 0 0 %d' % (k % 31), 'release moving all', ''][k % 5] + '\nstep 0.001\n')
    number += 2
    line = reader.readline()
    assert line.startswith(b'step %d ' % k), (k, line)
    while line != b'done\n':
        answers.write(line)
        line = reader.readline()
        assert line, k
    answers.write(line)
run.stdin.close()
assert reader.read() == b'', 'more than was asked for'
sys.exit(run.wait())
P
  local status=0
  python3 simulator.py || status=$?
  [[ $status == 1 && $(wc -l <stderr.txt) == 1 ]] || fail "status $status" "$(<stderr.txt)"
  grep -q '(the first of 20 errors)' stderr.txt || fail 'not 20 errors:' "$(<stderr.txt)"
  # Again, from the record: the same bytes and the same digest.
  ffe-run --stats=again.json log/run.scene | cmp - answers
  [[ $(digest live.json) == "$(digest again.json)" ]] || fail 'another digest' "$(<live.json)" "$(<again.json)"
  [[ $(grep -c ',error,' log/run.csv) == 20 && $(grep -c ',displace,' log/run.csv) == 4000 ]] || fail 'events were lost'
  # A record that is not the same is seen.
  sed -i '0,/displace still 6 0.00/s//displace still 6 0.01/' log/run.scene
  ! ffe-run log/run.scene | cmp -s - answers || fail 'another scene, the same answers'
  rm -r log simulator.py organ.ela organ.h5 answers stderr.txt live.json again.json
}

test_a_step_that_fails_is_taken_back() {
  need ffe-run exp2ela
  organ
  cube | exp2ela --format off --centrals 0 -o loose.ela
  printf '%s\n' 'object a organ.ela' 'object b organ.ela method=ffe' 'object c organ.ela integration=implicit' 'object d loose.ela method=ffe' 'emit shapes' \
    'force a 6 0 0 30' 'displace b 6 0.01 0 0 over 0.02' 'force c 6 0 0 30' 'step 0.005' 'force b 4 3 1 2' 'at 0.012 method b ela' >start
  printf '%s\n' 'force a 4 1e300 1e300 0' 'step 0.01' 'release a 4' 'force d 6 0 0 1' 'step 0.01' 'release d 6' >bomb
  printf '%s\n' 'force a 6 0 0 30' 'step 0.005' 'step 0.005' 'step 0.005' 'method a ffe' 'step 0.005' 'method a ela' 'step 0.005' >rest
  local status=0
  cat start bomb rest bomb rest | ffe-run --serve --record record.scene >live 2>stderr.txt || status=$?
  [[ $status == 1 && $(grep -c '^error ' live) == 4 ]] || fail "status $status" "$(grep ^error live)" "$(<stderr.txt)"
  [[ $(grep -c 'no longer finite' live) == 2 && $(grep -c 'object d at .* singular' live) == 2 ]] || fail "$(grep ^error live)"
  grep -v '^error ' live >answers
  ffe-run record.scene 2>/dev/null | cmp - answers
  # Without the steps that fail, the answers are the same.
  cat start rest rest | ffe-run >calm
  cmp answers calm
  rm organ.ela loose.ela start bomb rest live answers calm record.scene stderr.txt
}

test_a_step_with_instruments_in_contact_is_taken_back() {
  need ffe-run exp2ela
  organ
  cube | awk 'NR > 2 && NF == 3 { $1 += 50 } 1' | exp2ela --format off --centrals 0 -o loose.ela # away from the instruments
  local way status
  # A probe pushes two objects and a clip holds a node of each; the step that fails moves both and
  # withdraws one, or switches the methods.
  for way in 'at 0.0201 withdraw clip' 'at 0.0201 method still ela' 'at 0.0201 method moving ffe' 'at 0.0201 instrument probe sphere 2 1 1 3'; do
    printf '%s\n' 'object still organ.ela method=ffe' 'object moving organ.ela' 'object loose loose.ela' 'emit forces' 'emit shapes' \
      'emit instruments' 'instrument probe sphere 1 1 1 2.2 friction 0.3' 'instrument clip capsule 0.2 -3 0 2 -3 0 4' 'grasp still 4 clip' \
      'grasp moving 4 clip' 'move probe 1 1 1.9 over 0.01' 'move clip -3 0 2.05 over 0.01' 'run 0.02 every 0.005' >start
    printf '%s\n' "$way" 'move probe 1.3 1 1.8 over 0.01' 'force loose 6 1e300 1e300 0' 'step 0.005' 'release loose all' 'move probe 1.2 1 1.9 over 0.01' >bomb
    printf '%s\n' 'run 0.05 every 0.005' 'method still ela' 'step 0.005' 'method moving ffe' 'step 0.01' 'method still ffe' \
      'step 0.005' 'method moving ela' 'step 0.005' 'withdraw probe' 'step 0.005' >rest
    status=0
    cat start bomb rest | ffe-run --serve --record record.scene --stats=live.json >live 2>stderr.txt || status=$?
    [[ $status == 1 && $(grep -c '^error .* object loose at .* node 6 is under a force beyond single precision' live) == 1 && $(grep -c '^error ' live) == 1 ]] || fail "$way: status $status" "$(grep ^error live)" "$(<stderr.txt)"
    grep -v '^error ' live >answers
    ffe-run --stats=again.json record.scene 2>/dev/null | cmp - answers || fail "$way: another answer"
    [[ $(digest live.json) == "$(digest again.json)" ]] || fail "$way: another digest"
    grep -q '^probe .* [1-9]' answers || fail 'nothing is touched'
    # Another way of the probe is seen.
    sed -i '0,/move probe 1 1 1.9/s//move probe 1 1 1.91/' record.scene
    ! ffe-run record.scene 2>/dev/null | cmp -s - answers || fail 'another scene, the same answers'
  done
  rm organ.ela loose.ela start bomb rest live answers record.scene stderr.txt live.json again.json
}

test_only_what_is_touched_is_read() {
  need ffe-run exp2ela ffe-precompute
  organ
  ffe-precompute --columns all organ.ela -o organ.h5
  local k best=9999 TIMEFORMAT='%3U %3S' user system
  for k in {1..20}; do
    cp organ.ela "m$k.ela"
    cp organ.h5 "s$k.h5"
    case $((k % 3)) in
      0) echo "object o$k m$k.ela" ;;
      1) echo "object o$k m$k.ela method=ffe" ;;
      2) echo "object o$k m$k.ela store=s$k.h5" ;;
    esac
  done >in.scene
  printf '%s\n' 'emit forces' step 'displace o5 6 0 0 0.01' step 'method o7 ela' 'step 0.1' >>in.scene
  ffe-run --stats=out.json --rows node in.scene -o forces.csv >answers
  grep -q '"objects":20,"models_read":1,"stores_opened":1,' out.json || fail 'more was read:' "$(<out.json)"
  [[ $(wc -l <forces.csv) == 3 ]] || fail "$(<forces.csv)"
  if has_strace; then
    strace -f -o trace -e trace=open,openat,openat2 ffe-run in.scene >answers
    [[ $(grep -oE '"(m|s)[0-9]+\.(ela|h5)"' trace | sort -u) == $'"m5.ela"\n"s5.h5"' ]] || fail 'other files were opened:' "$(<trace)"
    rm trace
  fi
  # A result with all shapes needs all models, and the digest does not tell what was read.
  ffe-run --stats=all.json in.scene -q -o all.h5
  grep -q '"models_read":20,"stores_opened":1,' all.json || fail "$(<all.json)"
  [[ $(digest out.json) == "$(digest all.json)" ]] || fail 'another digest'
  # The others may even be broken, as long as nobody looks.
  for k in m1.ela m3.ela s8.h5 m8.ela; do
    echo broken >"$k"
  done
  ffe-run in.scene | cmp - answers
  # Of processor time, for others may be at work.
  for k in {1..10}; do
    read -r user system < <({ time ffe-run in.scene >/dev/null; } 2>&1)
    user=$((10#${user/./} + 10#${system/./}))
    ((user >= best)) || best=$user
  done
  [[ $(basename "$BUILD") != release ]] || ((best < 50)) || fail "it takes $best ms, expected under 50"
  rm ./*.ela ./*.h5 all.xdmf in.scene out.json all.json forces.csv answers
}

test_what_is_wrong_in_a_file_is_told_when_it_is_needed() {
  need ffe-run exp2ela ffe-precompute
  organ
  ffe-precompute --columns all organ.ela -o good.h5
  exp2ela --fix 'z<0 or 6' organ.ela -o other.ela
  ffe-precompute other.ela -o other.h5
  head -c 3000 good.h5 >cut.h5
  head -c 300 organ.ela >cut.ela
  # The last byte of the factor is another one.
  ffe-precompute organ.ela -o damaged.h5
  python3 - <<'P' || skip 'no python3'
import re
data = bytearray(open('damaged.h5', 'rb').read())
at = data.rfind(b'\x3f')  # the exponent of some number
for i in range(len(data) - 4000, len(data) - 1): data[i] ^= 0x01
open('damaged.h5', 'wb').write(data)
P
  printf '%s\n' 'object fine organ.ela store=good.h5' 'object missing organ.ela store=none.h5' 'object nothing none.ela' \
    'object other organ.ela store=other.h5' 'object cutstore organ.ela store=cut.h5' 'object cut cut.ela' 'object damaged organ.ela store=damaged.h5' \
    'displace other 6 0 0 0.01' step 'release other all' 'displace cutstore 6 0 0 0.01' step 'release cutstore all' 'displace cut 6 0 0 0.01' \
    'force damaged 6 0 0 1' step 'release damaged all' 'displace fine 6 0 0 0.01' 'step 0.25' >in.scene
  ffe-run --serve in.scene >answers 2>/dev/null && fail 'status 0'
  local number=0 expected line
  while read -r expected; do
    number=$((number + 1))
    line=$(sed -n "${number}p" answers)
    # shellcheck disable=SC2053 # a pattern
    [[ $line == $expected ]] || fail "answer $number: $line" "expected: $expected"
  done <<'P'
error 2: none.h5: cannot open: No such file or directory
error 3: none.ela: cannot open: No such file or directory
error 9: line 4: other.h5: is of another model: *
error 12: line 5: cut.h5: *
error 14: line 6: cut.ela:*
error 16: line 7: damaged.h5: *
step 1 0.25
done
P
  rm in.scene answers ./*.ela ./*.h5
}

test_a_killed_run_leaves_its_record() {
  need ffe-run exp2ela
  organ
  coproc SIMULATOR { exec ffe-run --record run.scene; }
  local pid=$SIMULATOR_PID out=${SIMULATOR[0]} in=${SIMULATOR[1]} line
  printf '%s\n' 'object o organ.ela' 'force o 6 0 0 3' 'step 0.5' 'step 0.25' >&"$in"
  while read -rt 30 -u "$out" line && [[ $line != 'step 2'* ]]; do :; done
  read -rt 30 -u "$out" line # done; the record has the line when the next one is read
  echo 'emit shapes' >&"$in"
  echo 'step 0' >&"$in"
  read -rt 30 -u "$out" line
  kill -KILL "$pid"
  wait "$pid" 2>/dev/null || true
  [[ ! -e run.scene && -s run.scene.part ]] || fail 'no part:' "$(ls -A)"
  [[ $(ffe-run run.scene.part | grep -c '^step') -ge 2 ]] || fail 'the part is no scene' "$(<run.scene.part)"
  mv run.scene.part kept.scene # no other run takes its name before
  # The next run begins anew.
  printf '%s\n' 'object o organ.ela' 'step' | ffe-run --record run.scene >answers
  [[ $(<run.scene) == $'object o organ.ela\nstep' && ! -e run.scene.part ]] || fail "$(<run.scene)"
  # A wrong line ends a run, and the record has what came before.
  printf '%s\n' 'object o organ.ela' 'step 2' nonsense step | ffe-run --record run.scene >answers 2>stderr.txt && fail 'status 0'
  [[ $(<run.scene) == $'object o organ.ela\nstep 2' ]] || fail "$(<run.scene)"
  rm organ.ela run.scene answers stderr.txt
}

test_a_simulator_that_goes_away_ends_it_quietly() {
  need ffe-run exp2ela
  organ
  local way
  { echo 'object o organ.ela'; echo 'emit shapes'; for _ in {1..20000}; do echo 'step 0.01'; echo 'wrong'; done; } >in.scene
  for way in --serve --binary; do
    { ffe-run --serve $way --record run.scene in.scene 2>stderr.txt || true; } | head -c 500 >answers
    [[ ! -s stderr.txt ]] || fail 'it spoke on a closed pipe:' "$(<stderr.txt)"
    [[ $(wc -c <answers) == 500 ]] || fail 'no answers'
    [[ ! -e run.scene && -s run.scene.part ]] || fail "$(ls -A)"
    rm run.scene.part
  done
  rm organ.ela in.scene answers stderr.txt
}

test_binary_frames_hold_the_numbers_of_the_text() {
  need ffe-run exp2ela
  python3 -c 'import struct' 2>/dev/null || skip 'no python3'
  organ
  printf '%s\n' 'object a organ.ela' 'object b organ.ela' 'emit forces' 'emit shapes' 'displace b 6,4 0.01 0 0' 'step 0.25' 'step -1' 'method b ffe' \
    'run 1 every 0.25' >in.scene
  ffe-run --serve in.scene >text 2>/dev/null && fail 'status 0'
  ffe-run --serve --binary in.scene >frames 2>/dev/null && fail 'status 0'
  cat >in.py <<'P'
import struct
data, at, lines = open('frames', 'rb').read(), 0, []
f32 = lambda x: struct.unpack('<f', struct.pack('<f', float(x)))[0]
names, nodes, step = 'ab', None, 1
pending = []  # of the answer under way
def flush(time):
    lines.append(f'step {step} {time:.17g}'); lines.extend(pending); lines.append('done'); pending.clear()
while at < len(data):
    magic, kind, thing, step, count = struct.unpack_from('<IIIQQ', data, at)
    assert magic == 0x46425747, (at, magic)
    body = data[at + 28:at + 28 + 4 * count]
    assert len(body) == 4 * count
    at += 28 + 4 * count
    values = struct.unpack(f'<{count}f', body)
    rows = [values[i:i + 3] for i in range(0, count, 3)]
    if kind == 0:
        pending.append(f'shapes {names[thing]} {len(rows)}'); pending += [' '.join(map(repr, r)) for r in rows]
    elif kind == 1:
        pending.append(f'forces {names[thing]} {len(rows)}')
        pending += [' '.join([str(n)] + list(map(repr, r))) for n, r in zip(nodes, rows)]
    elif kind == 2: nodes = struct.unpack(f'<{count}I', body)
    elif kind == 3: flush(struct.unpack('<d', body)[0])
    elif kind == 4: lines.append(body.rstrip(b'\0').decode().rstrip('\n'))
    elif kind == 5: pending.append(f'jump {names[thing]} {values[0]!r}')
    else: raise SystemExit(f'kind {kind}')
text = open('text').read().splitlines()
assert len(text) == len(lines), (len(text), len(lines))
for t, l in zip(text, lines):
    if t.startswith('error'): assert t == l; continue
    for x, y in zip(t.split(), l.split()):
        try: assert f32(x) == f32(y), (t, l)
        except ValueError: assert x == y, (t, l)
    assert len(t.split()) == len(l.split()), (t, l)
P
  python3 in.py
  printf '\125' | dd of=frames bs=1 seek=200 conv=notrunc status=none
  ! python3 in.py 2>/dev/null || fail 'changed frames were not seen'
  rm organ.ela in.scene in.py text frames
}

test_each_line_is_acknowledged_and_questions_change_nothing() {
  need ffe-run exp2ela
  organ
  printf '%s\n' 'object o organ.ela method=ffe' 'emit forces' 'displace o 6 0 0 0.01' 'step 0.25' '' 'nonsense' 'step 0.25' >in.scene
  awk '{ print; print "objects"; print "nodes o rest"; print "select o z>0"; print "select p all"; print "instruments" }' in.scene >asked.scene
  local status=0
  ffe-run --serve --ack --record asked.record --events asked.csv asked.scene >asked 2>stderr.txt || status=$?
  [[ $status == 1 && $(grep -cE '^(ok|error) ' asked) == 42 ]] || fail "status $status" "$(<asked)"
  # Each line once, in its turn.
  grep -E '^(ok|error) ' asked | sed 's/^[a-z]* \([0-9]*\).*/\1/' | cmp - <(seq 42) || fail 'not each line in its turn' "$(<asked)"
  [[ $(grep -c "^error [0-9]*: there is no object 'p', expected one of o$" asked) == 7 ]] || fail "$(grep ^error asked)"
  [[ $(grep -A 4 '^select o' asked | head -5 | tr '\n' ' ') == 'select o 4 4 5 6 7 ' ]] || fail "$(<asked)"
  # The run is the one that was not asked.
  ffe-run --serve --record calm.record --events calm.csv in.scene >calm 2>/dev/null || true
  sed -n '/^step/,/^done/p' calm >steps
  sed -n '/^step/,/^done/p' asked | cmp - steps
  cmp asked.record calm.record
  cmp <(grep -v ,error, asked.csv) <(grep -v ,error, calm.csv)
  expect_failure 2 ffe-run ffe-run --ack in.scene
  rm organ.ela in.scene asked.* calm.* asked calm steps
}

test_who_waits_awake_answers_the_same() {
  need ffe-run exp2ela python3
  organ
  printf '%s\n' 'object o organ.ela' 'displace o 6 0 0 0.01' 'step 0.01' 'step 0.01' end >in
  ffe-run --serve <in >asleep
  # shellcheck disable=SC2002 # a pipe, whose end comes
  cat in | ffe-run --serve --busy-wait | cmp - asleep
  expect_failure 2 ffe-run ffe-run --busy-wait in
  # Its processor is never at rest, by a pipe or a socket; without it is.
  python3 - <<'EOF'
import os, socket, subprocess, sys, time
def spent(run):
    with open(f'/proc/{run.pid}/stat') as file:
        words = file.read().rsplit(')', 1)[1].split()
    return (int(words[11]) + int(words[12])) / os.sysconf('SC_CLK_TCK')
def waits(words, awake, path=None):
    run = subprocess.Popen(['ffe-run', '--serve', *words], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    try:
        client = None
        if path:
            client = socket.socket(socket.AF_UNIX)
            while True:
                try:
                    client.connect(path)
                    break
                except OSError:
                    time.sleep(0.01)
            client.recv(4096)  # it is let in
        else:
            run.stdin.write(b'object o organ.ela\nobjects\n')
            run.stdin.flush()
            run.stdout.readline()
        before, start = spent(run), time.monotonic()
        while time.monotonic() - start < (60 if awake else 1) and spent(run) - before < 0.3:
            time.sleep(0.05)
        if (spent(run) - before >= 0.3) != awake:
            sys.exit(f'{words}: {spent(run) - before} s of its processor')
        if client:
            client.sendall(b'object o organ.ela\nend\n')
            client.close()
        else:
            run.stdin.close()
        if run.wait(20) != 0:
            sys.exit(f'{words}: status {run.returncode}')
    finally:
        run.kill()
waits([], False)
waits(['--busy-wait'], True)
waits(['--listen', 'door'], False, 'door')
waits(['--listen', 'door', '--busy-wait'], True, 'door')
EOF
}

test_answers_are_valid_utf8() {
  need ffe-run exp2ela
  cube | exp2ela --format off -o organ.ela
  { printf 'object a organ.ela\nselect a \xc3\xbcber\nselect a \xff\xc3\nb\xe2\x82\nselect a '; printf 'x\xc3\xbc%.0s' {1..60}; echo; } >in.scene
  ffe-run --serve in.scene >answers 2>/dev/null || true
  [[ $(grep -c '^error ' answers) == 4 ]] || fail "$(<answers)"
  iconv -f UTF-8 -t UTF-8 answers >/dev/null || fail 'not valid UTF-8:' "$(<answers)"
  grep -q "'ü" answers || fail 'a character is cut' "$(<answers)"
  rm organ.ela in.scene answers
}

test_a_pipe_is_no_node_list() {
  need ffe-run exp2ela
  cube | exp2ela --format off -o organ.ela
  mkfifo fifo
  printf '%s\n' 'object a organ.ela' 'force a @fifo 0 0 1' >in.scene
  ffe-run in.scene 2>stderr.txt & # never waits for who writes into it
  local pid=$! status=0
  for _ in {1..100}; do
    kill -0 "$pid" 2>/dev/null || break
    sleep 0.1
  done
  ! kill "$pid" 2>/dev/null || fail 'it waits for the pipe'
  wait "$pid" || status=$?
  ((status == 1)) || fail "status $status"
  [[ $(<stderr.txt) == 'ffe-run: in.scene:2: fifo: is no regular file, expected one' ]] || fail "$(<stderr.txt)"
  rm fifo organ.ela in.scene stderr.txt
}
