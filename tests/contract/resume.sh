# A store that was interrupted while being made: what is finished is kept and checked, and the end is the same bytes.
# shellcheck shell=bash disable=SC2317 # functions are called by name

# ball.ela: some 1,600 nodes; ball COMMAND... makes ball.h5 of all its columns, one thread, so that there is time to kill it.
ball_model() { exp2ela --primitive sphere:56x28 --name ball -o ball.ela; }
ball() { "$@" ffe-precompute -j1 --columns all ball.ela -o ball.h5; }

# Kills it when LINES columns stand in the journal.
killed_at() { # LINES
  local pid
  ffe-precompute -j1 --columns all ball.ela -o ball.h5 &
  pid=$!
  while [[ ! -e ball.h5.part.log || $(wc -l <ball.h5.part.log) -lt $1 ]]; do
    kill -0 "$pid" 2>/dev/null || fail "it ended before $1 lines were in the journal"
  done
  kill -KILL "$pid"
  wait "$pid" 2>/dev/null || true
  [[ -e ball.h5.part && -e ball.h5.part.log ]] || fail 'nothing is kept'
}

killed_after() { # SECONDS
  ffe-precompute -j1 --columns all ball.ela -o ball.h5 &
  sleep "$1"
  kill -KILL $! 2>/dev/null || true # (timeout -s KILL dies before its child has)
  wait $! 2>/dev/null || true
}

nothing_left() {
  local left
  left=$(find . -name '*.part*' -o -name '.*.h5.*')
  [[ ! $left ]] || fail "left behind: $left"
}

test_killed_at_any_moment_it_continues() {
  ball_model
  ball env
  mv ball.h5 whole.h5
  echo old >ball.h5
  local moment time
  for moment in 30 400 900; do
    killed_at $moment
    [[ $(<ball.h5) == old ]] || fail 'the old store was touched'
  done
  for time in 0.02 0.05 0.11 0.17; do
    killed_after "$time"
    [[ $(head -c 3 ball.h5) == old || ! -e ball.h5.part ]] || fail 'the old store was touched'
  done
  [[ -e ball.h5.part ]] || killed_at 30
  ball env 2>message
  [[ ! -s message ]] || fail "$(<message)"
  cmp whole.h5 ball.h5 || fail 'another store than that of an undisturbed run'
  nothing_left
  # What was kept is said, and is most of it.
  killed_at 900
  ffe-precompute -v -j2 --columns all ball.ela -o ball.h5 --stats=stats.json 2>message
  grep -q 'ball.h5.part: the columns of [0-9]* nodes are taken up' message || fail "$(<message)"
  grep -qE '"kept_columns":(2[4-9]|[3-9][0-9])[0-9]{2},' stats.json || fail "$(<stats.json)"
  cmp whole.h5 ball.h5 || fail 'another store with other threads'
}

# What a kill could leave beside them would stay for ever.
test_only_the_part_and_its_journal_have_names() {
  has_strace || return 0
  local made
  ball_model
  strace -f -o trace -e trace=creat,open,openat,openat2,mkdir,mkdirat,link,linkat,symlink,symlinkat,mknod,mknodat \
    ffe-precompute -j1 --columns all ball.ela -o ball.h5
  # HDF5 opens its file again by the number that it has here.
  made=$(grep -E 'O_CREAT|creat\(|mkdir|link|mknod' trace | grep -vE 'O_TMPFILE|= -1 |readlink|"/proc/self/fd/' |
    sed 's/^[^"]*"//; s/".*//' | sort -u | tr '\n' ' ')
  [[ $made == 'ball.h5.part ball.h5.part.log ' ]] || fail "made: $made"
}

test_an_interrupt_keeps_what_is_finished() {
  ball_model
  ball env
  mv ball.h5 whole.h5
  local signal
  for signal in INT TERM HUP; do
    ball timeout -s $signal 0.15 >/dev/null 2>&1 || true
  done
  ball env
  cmp whole.h5 ball.h5 || fail 'another store after interrupts'
  nothing_left
}

test_an_interrupt_says_that_the_next_run_goes_on() {
  ball_model
  local pid
  ffe-precompute -j1 --columns all ball.ela -o ball.h5 2>message &
  pid=$!
  while [[ ! -e ball.h5.part.log || $(wc -l <ball.h5.part.log) -lt 30 ]]; do
    kill -0 "$pid" 2>/dev/null || fail 'it ended before it was interrupted'
  done
  kill -TERM "$pid"
  wait "$pid" 2>/dev/null || true
  [[ $(<message) == 'ffe-precompute: interrupted, '*ball.h5.part' keeps the columns so far: the same command goes on from there' ]] ||
    fail "$(<message)"
  [[ -e ball.h5.part ]] || fail 'nothing is kept'
}

test_damage_in_what_is_kept_is_found() {
  ball_model
  ball env
  mv ball.h5 whole.h5
  killed_at 100
  # The columns of node 5 start behind those of the five before.
  local size row
  row=$((72 * $(sed -n 's/^nodes //p' ball.ela)))
  size=$(stat -c %s ball.h5.part)
  dd if=/dev/zero of=ball.h5.part bs=1 seek=$((size - 20 * row)) count=64 conv=notrunc 2>/dev/null
  ball env 2>message
  grep -qE '^ffe-precompute: warning: ball.h5.part: the columns of node [0-9]+ are damaged' message || fail "$(<message)"
  cmp whole.h5 ball.h5 || fail 'damage was kept'
  # A line that the kill cut short, and one that is wrong, count as none.
  killed_at 100
  sed -i '20s/ [0-9a-f]/ x/' ball.h5.part.log
  printf 'columns 0 99' >>ball.h5.part.log
  ball env
  cmp whole.h5 ball.h5 || fail 'a wrong line was believed'
}

test_unfinished_work_of_another_kind_is_refused() {
  ball_model
  killed_at 100
  cp ball.h5.part.log good.log
  sed -i 's/^\(0 1 e\) [^ ]*/\1 3/' ball.ela
  ffe-precompute --columns all ball.ela -o ball.h5 2>message && fail 'another model is taken up'
  grep -q "ball.h5.part: is unfinished work on another model: 'ball' (hash " message || fail "$(<message)"
  ball_model
  ffe-precompute --columns all --precision float32 ball.ela -o ball.h5 2>message && fail 'other options are taken up'
  grep -q "ball.h5.part: was begun with other options for 'ball'" message || fail "$(<message)"
  sed -i '1s/.*/part 2 44b0104e/' ball.h5.part.log
  ball env 2>message && fail 'a newer version is taken up'
  grep -qx 'ffe-precompute: ball.h5.part.log: is of version 2, expected 1' message || fail "$(<message)"
  sed -i '1s/.*/part 1/' ball.h5.part.log
  ball env 2>message && fail 'something else is taken up'
  grep -q '^ffe-precompute: ball.h5.part.log: is no journal' message || fail "$(<message)"
  cp good.log ball.h5.part.log
  ball env || fail 'the right arguments are refused'
  nothing_left
}

test_two_at_once_are_kept_apart() {
  ball_model
  ffe-precompute -j1 --columns all ball.ela -o ball.h5 &
  local pid=$!
  while [[ ! -e ball.h5.part.log ]]; do kill -0 "$pid" || fail 'it ended too early'; done
  expect_failure 1 ffe-precompute ball env
  wait "$pid" || fail 'the first one failed'
  ffe-precompute --info --verify ball.h5 >/dev/null
}

test_a_full_disk_keeps_the_old_store_and_what_is_finished() {
  ball_model
  ball env
  mv ball.h5 whole.h5
  echo old >ball.h5
  local kib
  for kib in 1 100 9000 20000 60000; do
    expect_failure 1 ffe-precompute bash -c "ulimit -f $kib; trap '' XFSZ; exec ffe-precompute -j1 --columns all ball.ela -o ball.h5"
    [[ $(<ball.h5) == old ]] || fail 'the old store was touched'
  done
  ball env
  cmp whole.h5 ball.h5 || fail 'another store after a full disk'
  nothing_left
}
