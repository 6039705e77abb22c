# What is left of runs that end early: partial results, logs, records.
# shellcheck shell=bash disable=SC2317 # functions are called by name

need() {
  local tool
  for tool in "$@"; do
    command -v "$tool" >/dev/null || skip "no $tool"
  done
}

# organ.ela: a cube of 2 mm whose lower corners are held. moves.scene: 30 steps of it.
moves() {
  cube >cube.off
  exp2ela --fix 'z<0' cube.off -o organ.ela
  rm cube.off
  { printf '%s\n' 'object o organ.ela' 'emit forces' 'displace o 6 0.1 0 0.2 over 0.2'; printf 'step 0.01%.0s\n' {1..30}; } >moves.scene
}

# Runs ffe-run on the 30 steps, from a pipe that stays open behind them: live OPTIONS... sets pid and holder.
live() {
  mkfifo lines
  env --default-signal=INT ffe-run lines "$@" >answers 2>stderr.txt &
  pid=$!
  { cat moves.scene; exec sleep 30; } >lines &
  holder=$!
  for _ in {1..100}; do
    [[ $(grep -c '^done' answers) == 30 ]] && break
    sleep 0.1
  done
}

# Ends it by a signal, and sets status.
end_by() {
  kill -"$1" "$pid"
  status=0
  wait "$pid" 2>/dev/null || status=$?
  kill "$holder"
  wait "$holder" 2>/dev/null || true
  rm lines
}

test_frames_of_runs_that_end_at_any_moment_are_kept() {
  need ffe-run exp2ela
  local python
  python=$(python_with_h5py) || skip 'no python3 with h5py and numpy'
  has prlimit || return 0
  "$python" "$GEWEBE_ROOT/tests/stress/frames" --moments 35 --steps 120 --formats h5,vtkhdf,csv,vtu,series >out.txt 2>&1 ||
    fail "$(grep -v vtkXdmf out.txt)"
  grep -q '^35 moments, 0 frames lost, 0 failed' out.txt || fail "$(<out.txt)"
  rm out.txt
}

# Killed at each write of some steps: before, in and behind the log of a checkpoint.
test_a_result_is_whole_at_each_moment_of_a_checkpoint() {
  need ffe-run exp2ela
  has_strace || return 0
  local python n kept=0
  python=$(python_with_h5py) || skip 'no python3 with h5py and numpy'
  moves
  ffe-run -q moves.scene -o whole.h5
  head -7 moves.scene >few.scene
  mkdir kept
  for ((n = 30; n < 62; ++n)); do
    strace -f -o trace -e trace=pwrite64 -e "inject=pwrite64:signal=KILL:when=$n" ffe-run few.scene -o run.h5 >answers 2>stderr.txt || true
    if ffe-run --recover run.h5 2>stderr.txt; then
      mv run.partial.h5 "kept/$(grep -c '^done' answers || true).$n.h5"
      rm run.partial.xdmf
      kept=$((kept + 1))
    fi
    rm -f trace .run* stderr.txt
    [[ ! -e run.h5 && ! -e run.partial.h5 ]] || fail "a result of a run that was killed at write $n"
  done
  ((kept >= 24)) || fail "$kept results of 32 were kept"
  "$python" - kept/*.h5 <<'END'
import sys, os, h5py, numpy
whole = h5py.File('whole.h5')
for path in sys.argv[1:]:
    answered = int(os.path.basename(path).split('.')[0])
    with h5py.File(path) as file:
        assert 'partial' in file.attrs, path
        frames = len(file['time'])
        assert answered <= frames <= answered + 1, (path, frames)
        def same(name, node):
            if isinstance(node, h5py.Dataset):
                assert numpy.array_equal(node[()], whole[name][:len(node)]), (path, name)
        file.visititems(same)
        assert len(file['objects/o/displacement']) == frames, path
END
  rm -r kept whole.h5 whole.xdmf organ.ela moves.scene few.scene answers
}

test_what_is_kept_is_said_and_the_old_result_stays() {
  need ffe-run exp2ela
  moves
  { cat moves.scene; echo 'cut nothing at all'; } >wrong.scene
  local kind
  for kind in h5 vtkhdf csv ply obj vtu; do
    echo old >run.$kind
    expect_failure 1 ffe-run ffe-run -q wrong.scene -o run.$kind
    ffe-run -q wrong.scene -o run.$kind 2>stderr.txt || true
    case $kind in
      h5 | vtkhdf) grep -q "^ffe-run: wrong.scene:34: .*; 31 frames up to 0.3 s kept in run.partial.$kind\$" stderr.txt ;;
      csv) grep -q '; 31 frames up to 0.3 s kept in run.partial.csv$' stderr.txt ;;
      *) grep -q "; the shape at 0.3 s kept in run.partial.$kind\$" stderr.txt ;;
    esac || fail "another message for $kind:" "$(<stderr.txt)"
    [[ $(<run.$kind) == old && -s run.partial.$kind ]] || fail "no partial $kind" "$(ls -A)"
    rm -f run.*"$kind" run.partial.xdmf
    expect_failure 1 ffe-run ffe-run -q --no-partial wrong.scene -o run.$kind
    [[ -z $(find . -name '*run*' -print -quit) ]] || fail "--no-partial leaves files for $kind:" "$(ls -A)"
  done
  # A name without a suffix, and a series, whose files are there already.
  ffe-run -q wrong.scene -o run 2>stderr.txt || true
  [[ -s run.partial && -s run.partial.xdmf ]] || fail "$(ls -A)"
  ffe-run -q wrong.scene -o run_%02d.vtu 2>stderr.txt || true
  grep -q '; 31 frames up to 0.3 s kept in run_%02d.vtu$' stderr.txt || fail "$(<stderr.txt)"
  [[ $(find . -name 'run_??.vtu' | wc -l) == 31 ]] || fail 'not 31 files'
  rm run*
  # To a pipe goes no half of a result.
  [[ -z $(ffe-run --to ply wrong.scene 2>stderr.txt) ]] || fail 'a shape on the pipe'
  # Before the first step there is nothing to keep.
  printf '%s\n' 'object o organ.ela' 'cut nothing at all' >wrong.scene
  ffe-run -q wrong.scene -o run.h5 2>stderr.txt || true
  ! grep -q kept stderr.txt || fail "$(<stderr.txt)"
  [[ $(ls -A) == $'moves.scene\norgan.ela\nstderr.txt\nwrong.scene' ]] || fail "$(ls -A)"
  rm moves.scene organ.ela stderr.txt wrong.scene
}

test_an_interrupt_keeps_frames_logs_and_record() {
  need ffe-run exp2ela
  moves
  local signal status pid holder
  for signal in INT TERM HUP; do
    live -o run.h5 --events run.events --record run.record --latencies run.latencies
    end_by "$signal"
    ((status == 128 + $(kill -l "$signal"))) || fail "status $status on SIG$signal" "$(<stderr.txt)"
    [[ $(<stderr.txt) == 'ffe-run: interrupted at 0.3 s: 31 frames kept in run.partial.h5' ]] || fail "SIG$signal:" "$(<stderr.txt)"
    [[ $(wc -l <run.record) == 33 && $(wc -l <run.latencies) == 31 ]] || fail 'the logs are not whole' "$(wc -l run.*)"
    grep -q ',displace,' run.events || fail 'no events'
    rm run.* answers stderr.txt
  done
  # Where there is nothing to keep it ends at once.
  live
  end_by TERM
  [[ $status == 143 && ! -s stderr.txt ]] || fail "status $status" "$(<stderr.txt)"
  rm answers stderr.txt organ.ela moves.scene
}

test_a_killed_run_is_recovered() {
  need ffe-run exp2ela
  moves
  local pid holder kind status
  for kind in h5 vtkhdf csv; do
    live -o run.$kind --events run.events --record run.record --latencies run.latencies
    cp stderr.txt live.txt
    expect_failure 1 ffe-run ffe-run --recover run.$kind # as long as it lives its frames are its own
    end_by KILL
    ffe-run --recover run.$kind -v --stats=run.stats 2>stderr.txt
    grep -q "frames up to [0-9.]* s kept in run.partial.$kind" stderr.txt || fail "$(<stderr.txt)"
    [[ -s run.partial.$kind && ! -e run.$kind ]] || fail "$(ls -A)"
    [[ $kind != h5 || $(grep -c '<Time ' run.partial.xdmf) -ge 30 ]] || fail 'other frames in the XDMF file'
    [[ $(wc -l <run.record.part) == 33 && $(wc -l <run.latencies.part) -ge 30 ]] || fail "$(wc -l run.*.part)"
    grep -q ',displace,' run.events.part || fail 'no events'
    [[ -z $(find . -name '.run*' -print -quit) ]] || fail 'left behind:' "$(ls -A)"
    expect_failure 1 ffe-run ffe-run --recover run.$kind
    # The next run writes its logs anew.
    rm run.record.part run.partial.*
    ffe-run -q moves.scene -o run.$kind --events run.events --latencies run.latencies
    [[ ! -e run.events.part && ! -e run.latencies.part && -s run.events ]] || fail "$(ls -A)"
    rm -f run.* answers live.txt stderr.txt
  done
  rm organ.ela moves.scene
}

test_a_full_disk_keeps_what_was_written() {
  need ffe-run exp2ela emboss-render prlimit
  exp2ela -q --primitive sphere:32x16 --size 30 --fix 'z<-10' -o organ.ela
  { printf '%s\n' 'object o organ.ela' 'displace o z>14 1 0 0 over 1'; printf 'step 0.01%.0s\n' {1..60}; } >moves.scene
  local old
  for old in '' old; do
    [[ -z $old ]] || echo "$old" >run.h5
    prlimit --fsize=400000 ffe-run -q moves.scene -o run.h5 --events run.events --record run.record 2>stderr.txt || true
    grep -q 'File too large; [0-9]* frames up to 0.[0-9]* s kept in run.partial.h5' stderr.txt || fail "$(<stderr.txt)"
    [[ $(cat run.h5 2>/dev/null) == "$old" ]] || fail 'the old result is gone'
    [[ -s run.events && -s run.record && ! -e run.xdmf ]] || fail "$(ls -A)"
    emboss-render -q --backend cpu --size 32 run.partial.h5 -o picture.png
    rm run.* picture.png stderr.txt
  done
  rm organ.ela moves.scene
}
