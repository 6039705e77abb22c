# Scenes from files and pipes, and the results of a run.
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

# pull.scene: its corner 6 is drawn away and let go.
pull() {
  organ
  printf '%s\n' "object organ organ.ela $1" 'emit forces' 'displace organ 6 0.01 0 0.02' 'step 0.01' \
    'at 0.015 release organ 6' 'run 0.03 every 0.01' >pull.scene
}

test_each_step_is_answered_at_once() {
  need ffe-run exp2ela
  organ
  local word number time line
  coproc SIMULATOR { ffe-run; }
  local pid=$SIMULATOR_PID out=${SIMULATOR[0]} in=${SIMULATOR[1]}
  echo 'object o organ.ela' >&"$in"
  for number in 1 2 3 4 5; do
    # The next line is sent only when this answer was read.
    echo 'step 0.25' >&"$in"
    read -rt 30 -u "$out" word line time || fail "no answer to step $number"
    [[ "$word $line" == "step $number" ]] || fail "answer $word $line $time to step $number"
    read -rt 30 -u "$out" line || fail 'no end of the answer'
    [[ $line == 'done' ]] || fail "expected done, got $line"
  done
  [[ $time == 1.25 ]] || fail "time $time, expected 1.25"
  echo 'emit shapes' >&"$in"
  printf 'step' >&"$in" # not a whole line yet: nothing may be answered
  ! read -rt 0.5 -u "$out" line || fail "half a line was answered: $line"
  echo ' 0.75' >&"$in"
  read -rt 30 -u "$out" word number time
  [[ "$word $number $time" == 'step 6 2' ]] || fail "answer $word $number $time"
  read -rt 30 -u "$out" line
  [[ $line == 'shapes o '* ]] || fail "expected shapes, got $line"
  eval "exec $in>&-"
  wait "$pid" || fail "status $?"
  rm organ.ela
}

test_the_same_scene_from_file_and_pipe_with_any_threads() {
  need ffe-run exp2ela
  local method
  for method in method=ffe method=ela; do
    pull "$method"
    ffe-run pull.scene >expected
    [[ $(grep -c '^step ' expected) == 3 ]] || fail 'expected three answers' "$(<expected)"
    ffe-run <pull.scene | cmp - expected
    ffe-run -j1 pull.scene | cmp - expected
    ffe-run -j2 pull.scene | cmp - expected
    # Its own folder counts for a file, not the working folder.
    mkdir folder
    (cd folder && ffe-run ../pull.scene | cmp - ../expected)
    rmdir folder
  done
  rm organ.ela pull.scene expected
}

test_a_wrong_line_ends_the_run_and_leaves_no_result() {
  need ffe-run exp2ela
  organ
  local line
  for line in 'cut organ 1 2' 'force organ 0 nan 0 0' 'force organ 999 0 0 1' 'displace organ 0 1 0 0' 'step -1' 'object x none.ela' \
    'object x organ.ela store=none.h5' 'force organ z>9 0 0 1' 'run 0 every 1' 'at 0 step' '"'; do
    printf '%s\n' 'object organ organ.ela' 'step' "$line" 'step' >in.scene
    echo old >out.h5
    expect_failure 1 ffe-run ffe-run --no-partial in.scene -o out.h5 >answers
    [[ $(<out.h5) == old ]] || fail "a result in spite of: $line"
    [[ $(grep -c '^step ' answers) == 1 ]] || fail "not one answer before: $line" "$(<answers)"
    [[ $(ffe-run in.scene 2>&1 >answers || true) == 'ffe-run: in.scene:3: '* ]] || fail "the line is not named: $line"
    [[ $(ls) == $'answers\nin.scene\norgan.ela\nout.h5' ]] || fail 'files were left:' "$(ls -A)"
  done
  rm answers in.scene organ.ela out.h5
}

test_results_are_equal_from_run_to_run() {
  need ffe-run exp2ela
  local method
  for method in method=ffe method=ela; do
    pull "$method"
    ffe-run -q -j1 pull.scene -o a.h5
    mkdir folder
    ffe-run -q -j2 pull.scene -o folder/a.h5
    cmp a.h5 folder/a.h5
    cmp a.xdmf folder/a.xdmf
    [[ $(ls -A folder) == $'a.h5\na.xdmf' ]] || fail 'other files:' "$(ls -A folder)"
    if has h5diff; then
      h5diff a.h5 folder/a.h5 || fail 'h5diff sees a difference'
      sed -i 's/0.02$/0.021/' pull.scene
      ffe-run -q pull.scene -o folder/a.h5
      ! h5diff a.h5 folder/a.h5 >/dev/null || fail 'h5diff sees nothing'
    fi
    ! grep -aq "$PWD" a.h5 a.xdmf || fail 'a path in the result'
    touch -d 2001-01-01 a.h5 a.xdmf
    sed -i 's/0.021$/0.02/' pull.scene
    ffe-run -q pull.scene -o a.h5 --keep-unchanged
    [[ $(stat -c %Y a.h5 a.xdmf | sort -u) == "$(date -d 2001-01-01 +%s)" ]] || fail 'equal results were written again'
    rm -r folder a.h5 a.xdmf pull.scene organ.ela
  done
}

test_answers_and_results_go_where_they_should() {
  need ffe-run exp2ela
  pull method=ffe
  ffe-run pull.scene >answers
  ffe-run pull.scene -o out.csv | cmp - answers
  [[ -z $(ffe-run -q pull.scene -o quiet.csv) ]] || fail '-q with -o FILE answers'
  ffe-run -q pull.scene | cmp - answers
  ffe-run --to csv pull.scene | cmp - out.csv
  cmp out.csv quiet.csv
  ffe-run -q --rows node pull.scene -o out.csv
  [[ $(head -1 out.csv) == time,object,node,fx,fy,fz && $(wc -l <out.csv) == 2 ]] || fail 'other forces:' "$(<out.csv)"
  # The force of the answer, digit by digit.
  [[ $(sed -n 2p out.csv) == "0.01,organ,$(sed -n '3s/ /,/gp' answers)" ]] || fail 'forces differ' "$(<out.csv)" "$(<answers)"
  ffe-run --to ply pull.scene | exp2ela --to obj --format ply -o out.obj
  [[ $(grep -c '^v ' out.obj) == 8 ]] || fail 'not the 8 points of the surface'
  expect_failure 2 ffe-run ffe-run --to h5 pull.scene
  expect_failure 2 ffe-run ffe-run pull.scene -o out.vdb
  expect_failure 1 ffe-run ffe-run pull.scene --to h5 -o /dev/null
  [[ ! -e /dev/null.xdmf ]] || fail 'a file in /dev'
  mkfifo fifo
  expect_failure 1 ffe-run ffe-run pull.scene --to h5 -o fifo
  rm fifo answers out.csv quiet.csv out.obj pull.scene organ.ela
}

test_an_interrupt_leaves_neither_file_without_partial() {
  need ffe-run exp2ela
  organ
  local signal status pid
  for signal in INT TERM HUP; do
    mkdir folder
    mkfifo lines
    env --default-signal=INT ffe-run --no-partial lines -o folder/run.h5 >answers 2>stderr.txt &
    pid=$!
    { echo 'object o organ.ela'; echo 'step'; sleep 30; } >lines &
    local holder=$!
    for _ in {1..100}; do
      grep -q 'done' answers && break
      sleep 0.1
    done
    kill -"$signal" "$pid"
    status=0
    wait "$pid" || status=$?
    kill "$holder"
    wait "$holder" 2>/dev/null || true
    ((status == 128 + $(kill -l "$signal"))) || fail "status $status on SIG$signal" "$(<stderr.txt)"
    [[ -z $(ls -A folder) ]] || fail "files on SIG$signal:" "$(ls -A folder)"
    rm -r folder lines answers stderr.txt
  done
  rm organ.ela
}

test_a_reader_that_goes_away_ends_it_quietly() {
  need ffe-run exp2ela
  organ
  { echo 'object o organ.ela'; for _ in {1..20000}; do echo 'step 0.01'; done; } >in.scene
  { ffe-run in.scene 2>stderr.txt || true; } | head -n 3 >answers
  [[ ! -s stderr.txt ]] || fail 'it spoke on a closed pipe:' "$(<stderr.txt)"
  [[ $(<answers) == $'step 1 0.01\ndone\nstep 2 0.02' ]] || fail "$(<answers)"
  rm organ.ela in.scene answers stderr.txt
}

test_stored_stiffness_gives_the_same_shape() {
  need ffe-run exp2ela ffe-precompute
  organ
  ffe-precompute organ.ela -o factor.h5
  ffe-precompute --columns all organ.ela -o columns.h5
  local store
  for store in method=ffe store=factor.h5 store=columns.h5; do
    pull "$store"
    sed -i 's/emit forces/emit forces\nemit shapes\nforce organ 4 1 2 3\ngravity 0 0 -9810/' pull.scene
    ffe-run --stats="$store.json" pull.scene | awk '{ for (i = 1; i <= NF; ++i) printf "%s ", $i + 0 == $i ? sprintf("%.6g", $i + 0 < 1e-9 && $i + 0 > -1e-9 ? 0 : $i) : $i; print "" }' >"$store.txt"
  done
  cmp method=ffe.txt store=factor.h5.txt
  cmp method=ffe.txt store=columns.h5.txt
  grep -q '"columns_read":2,' store=columns.h5.json || fail 'no columns were read' "$(<store=columns.h5.json)"
  grep -q '"columns_read":0,' store=factor.h5.json || fail 'columns were read' "$(<store=factor.h5.json)"
  # Of another model, cut off.
  exp2ela --fix 'z<0 or 6' organ.ela -o other.ela
  printf 'object o other.ela store=columns.h5\nforce o 4 0 0 1\nstep\n' >other.scene
  expect_failure 1 ffe-run ffe-run other.scene
  head -c 3000 columns.h5 >cut.h5
  printf 'object o organ.ela store=cut.h5\nforce o 4 0 0 1\nstep\n' >other.scene
  expect_failure 1 ffe-run ffe-run other.scene
  rm organ.ela other.ela pull.scene other.scene ./*.h5 ./*.json ./*.txt
}

test_stats_compute_no_residuals() {
  need ffe-run exp2ela
  pull method=ffe
  ffe-run pull.scene >plain.txt
  ffe-run --stats=stats.json pull.scene >stats.txt
  grep -q '"shapes":0,' stats.json || fail 'shapes for --stats alone' "$(<stats.json)"
  ffe-run --verify --stats=verified.json pull.scene >verified.txt
  cmp plain.txt stats.txt
  cmp plain.txt verified.txt
  ! grep -q '"backward_error"' stats.json || fail 'a residual without --verify' "$(<stats.json)"
  grep -q '"backward_error"' verified.json || fail 'no residual with --verify' "$(<verified.json)"
  rm organ.ela pull.scene ./*.txt ./*.json
}

test_h5py_reads_results() {
  local python
  need ffe-run exp2ela
  python=$(python_with_h5py) || skip 'no h5py for python3'
  pull method=ffe
  ffe-run -q pull.scene -o run.h5
  cat >in.py <<'P'
import h5py
with h5py.File('run.h5') as f:
    assert f.attrs['format'] in ('gewebe_results', b'gewebe_results') and f.attrs['version'] == 1
    o = f['objects/organ']
    u = o['displacement'][:]
    assert list(f['time']) == [0, 0.01, 0.02, 0.03], f['time'][:]
    assert abs(u[1, 6] - (0.01, 0, 0.02)).max() < 1e-8 and u[1, 6, 2] > 0.019, u[1, 6]
    assert not u[0].any() and not u[2].any() and o['points'].shape == u.shape[1:]
    assert list(o['forces/node']) == [6] and list(o['forces/frame']) == [1] and o['forces/force'][0, 2] > 0
    assert o['triangles'][:].max() < o.attrs['surface_nodes'] == 8 < len(o['points'])
P
  "$python" in.py
  rm in.py run.h5 run.xdmf pull.scene organ.ela
}

test_vtk_reads_results() {
  need ffe-run exp2ela
  python3 -c 'import vtk; vtk.vtkXdmfReader' 2>/dev/null || skip 'no VTK with XDMF for python3'
  pull method=ffe
  echo 'object second organ.ela' >>pull.scene
  echo 'step 0.01' >>pull.scene
  mkdir folder
  ffe-run -q pull.scene -o run.h5
  mv run.h5 run.xdmf folder # together
  cat >in.py <<'P'
import vtk
r = vtk.vtkXdmfReader(); r.SetFileName('folder/run.xdmf'); r.UpdateInformation()
steps = r.GetOutputInformation(0).Get(vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS())
assert steps == (0, 0.01, 0.02, 0.03, 0.04), steps
r.UpdateTimeStep(0.01)
blocks, it = [], r.GetOutputDataObject(0).NewIterator()
while not it.IsDoneWithTraversal():
    blocks.append(it.GetCurrentDataObject()); it.GoToNextItem()
assert len(blocks) == 2 and blocks[0].GetNumberOfCells() == 12, blocks
u = blocks[0].GetPointData().GetArray('displacement').GetTuple(6)
assert max(abs(a - b) for a, b in zip(u, (0.01, 0, 0.02))) < 1e-8, u
assert blocks[0].GetPoint(6) == (1, 1, 1), blocks[0].GetPoint(6)
P
  python3 in.py
  rm -r in.py folder pull.scene organ.ela
}

test_it_needs_none_of_the_heavy_libraries() {
  need ffe-run ldd
  ! ldd "$(command -v ffe-run)" | grep -E 'openvdb|assimp|epoxy|png|Imath' || fail 'ffe-run loads what it does not use'
}

test_emitted_models_are_read_back() {
  need ffe-run exp2ela
  pull method=ffe
  printf '%s\n' 'object o organ.ela method=ffe' 'emit model o copy.ela' 'displace o 6 0 0 1' step 'emit model o again.ela' >emit.scene
  mkdir folder
  (cd folder && ffe-run -q ../emit.scene --record ../folder/record.scene >/dev/null)
  cmp organ.ela copy.ela || fail 'another model'
  cmp organ.ela again.ela || fail 'the shape of a step stands in the model'
  [[ $(grep -c 'emit model o ../' folder/record.scene) == 2 ]] || fail "$(<folder/record.scene)"
  local line
  for line in 'emit model o organ.ela' 'emit model p copy.ela' 'emit model o' 'emit model o ""' 'emit model o none/copy.ela' \
    'at 1 emit model o x.ela' 'emit model o .'; do
    printf '%s\n' 'object o organ.ela method=ffe' "$line" >wrong.scene
    expect_failure 1 ffe-run ffe-run wrong.scene
  done
  cmp organ.ela copy.ela || fail 'a refusal wrote something'
  rm -r folder ./*.ela ./*.scene
}
