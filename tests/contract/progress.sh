# How far a scene is, on standard error.
# shellcheck shell=bash disable=SC2317 # functions are called by name

need() {
  local tool
  for tool in "$@"; do
    command -v "$tool" >/dev/null || skip "no $tool"
  done
}

# swing.scene: 30 steps of 0.01 s of a cube of 2 mm whose lower corners are held.
swing() {
  cube >cube.off
  exp2ela --fix 'z<0' cube.off -o organ.ela
  rm cube.off
  { printf '%s\n' 'object o organ.ela method=ffe' 'force o 6 1e-7 0 0' 'timestep 0.01'; printf 'step%.0s\n' {1..10}; echo 'run 0.3 every 0.01'; } >swing.scene
}

# The last figures that were drawn in FILE: last_figures FILE
last_figures() {
  tr '\r' '\n' <"$1" | sed $'s/\x1b\\[K//g' | grep '^ffe-run .*frames' | tail -1
}

test_a_scene_shows_time_factor_frames_and_time_left() {
  need ffe-run exp2ela
  local figures
  swing
  ffe-run swing.scene >expected 2>stderr.txt
  [[ ! -s stderr.txt ]] || fail "progress where no terminal is: $(<stderr.txt)"
  ffe-run --progress never swing.scene >answers 2>stderr.txt
  [[ ! -s stderr.txt ]] || fail "progress though never: $(<stderr.txt)"
  ffe-run --progress always swing.scene >answers 2>stderr.txt
  cmp expected answers
  figures=$(last_figures stderr.txt) || fail "no figures: $(<stderr.txt)"
  [[ $figures =~ ^'ffe-run ['#+'] 100 %  0.3 of 0.3 s  '[0-9.e+]+' x real time  30 frames  0 s left'$ ]] || fail "figures: $figures"
  [[ $(tail -c 4 stderr.txt) == $'\r\x1b[K' ]] || fail 'the bar stays behind' "$(<stderr.txt)"
  ffe-run -q --progress always swing.scene -o run.h5 2>stderr.txt
  figures=$(last_figures stderr.txt) || fail "no figures: $(<stderr.txt)"
  [[ $figures == *'  31 frames  '* ]] || fail "with the frame before the first step: $figures"
  # An open file as standard input is read ahead, too.
  ffe-run --progress always <swing.scene >answers 2>stderr.txt
  cmp expected answers
  [[ $(last_figures stderr.txt) == *'0.3 of 0.3 s'*'30 frames'*left ]] || fail "standard input: $(<stderr.txt)"
  rm -f expected answers stderr.txt run.* organ.ela swing.scene
}

test_a_live_scene_has_no_time_left() {
  need ffe-run exp2ela
  local figures
  swing
  # shellcheck disable=SC2002 # a pipe is what is wanted
  cat swing.scene | ffe-run --progress always >answers 2>stderr.txt
  figures=$(last_figures stderr.txt) || fail "no figures: $(<stderr.txt)"
  [[ $figures =~ ^'ffe-run 0.3 s  '[0-9.e+]+' x real time  30 frames'$ ]] || fail "figures: $figures"
  rm answers stderr.txt organ.ela swing.scene
}

test_a_message_begins_its_own_line_beside_the_bar() {
  need ffe-run exp2ela
  local status=0
  swing
  sed 's/^run .*/step nonsense/' swing.scene >wrong.scene
  ffe-run --progress always wrong.scene >answers 2>stderr.txt || status=$?
  [[ $status == 1 ]] || fail "status $status"
  [[ $(<stderr.txt) == *' frame'*$'\r\x1b[Kffe-run: wrong.scene:14: '* ]] || fail "error: $(<stderr.txt)"
  status=0
  { cat swing.scene; echo 'at 1 force o 6 0 0 0'; } >late.scene
  ffe-run --progress always late.scene >answers 2>stderr.txt || status=$?
  [[ $status == 0 ]] || fail "status $status"
  [[ $(<stderr.txt) == *' frame'*$'\r\x1b[Kffe-run: warning: late.scene: '* ]] || fail "warning: $(<stderr.txt)"
  rm answers stderr.txt organ.ela ./*.scene
}

test_a_terminal_shows_progress_beside_whole_answers() {
  need ffe-run exp2ela
  has python3 || return 0
  local feeder
  swing
  mkfifo lines
  { cat swing.scene; sleep 1.2; printf 'step\n'; } >lines &
  feeder=$!
  python3 -c 'import pty; exit(pty.spawn(["ffe-run", "lines"]) >> 8)' >shown </dev/null || fail "status $?" "$(<shown)"
  wait "$feeder"
  [[ $(<shown) == *$'\rffe-run 0.31 s  '*' x real time  31 frames'$'\x1b[K\r\x1b[K' ]] || fail 'no progress' "$(<shown)"
  ffe-run swing.scene >expected
  [[ $(tr -d '\r' <shown | head -60 | grep -v x1b) == "$(<expected)"* ]] || fail 'answers' "$(<shown)"
  rm shown expected lines organ.ela swing.scene
}
