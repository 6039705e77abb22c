# The test tools themselves: a wrong golden case fails, whatever it is that is wrong.
# shellcheck shell=bash disable=SC2016,SC1003 # the cases hold $ and \ of their own

golden() { # CASE LINE [EXPECTED CONTENT]: its status
  mkdir -p golden/in golden/expected
  printf '%s\n' "$1" >golden/cases
  [[ -z ${2-} ]] || printf '%s\n' "$2" >golden/expected/text
  GOLDEN=$PWD/golden "$GEWEBE_ROOT/tests/golden/run" one "${1%% *}" --config "$(basename "$BUILD")" >said.txt 2>&1 ||
    return $?
}
must_pass() { golden "negative-$1" "${2-}" || fail "a right case failed: $1" "$(<said.txt)"; }
must_fail() { # WORDS THAT THE COMPLAINT HOLDS, CASE...
  local words=$1
  shift
  ! golden "negative-$1" "${2-}" || fail "a wrong case passed: $1"
  grep -q "$words" said.txt || fail "another complaint than '$words':" "$(<said.txt)"
}

test_right_cases_pass() {
  must_pass 'a | 0 | text | echo hello' hello
  must_pass 'b | 0 | - | true'
  must_pass 'c | 0 | digest:00ff | echo "{\"digest\":\"00ff\"}" >&2; echo $RANDOM >/dev/null'
  must_pass 'd | 0 | text ~ x: warning: * | echo hello; echo "x: warning: empty" >&2' hello
  must_pass 'e | 1 | x: no | echo "x: no" >&2; exit 1'
  must_pass 'f | 2 | x: * [y] | echo "x: no [y]" >&2; exit 2'
  must_pass 'g | 0 | text | echo hello | cat > out.ply; cat out.ply' hello
  # A command in lines of its own.
  must_pass $'h | 0 | text | \\\n  echo hello > out.ply\n  for k in 1; do\n    cat out.ply\n  done' hello
  # A long message in a line of its own.
  must_pass $'i | 1 | \\ | \\\n  x: no\n  echo "x: no" >&2\n  exit 1'
  must_pass "j | 1 | \\ | \\"$'\n'"  x: $(printf '%0300d' 0)"$'\n  printf "x: %0300d\\n" 0 >&2; exit 1'
}

test_a_case_is_short() {
  local long k
  long=$(printf '%0200d' 0)
  must_fail 'cases:1: a line of more than 200 characters' "a | 0 | - | : $long"
  must_fail 'cases:3: a line of more than 200 characters' $'b | 0 | - | \\\n  :\n  : '"$long"
  must_fail 'cases:1: a line of more than 200 characters' "c | 1 | x: $long | exit 1"
  long=$'d | 0 | - | \\'
  for k in {1..12}; do long+=$'\n  : '$k; done
  must_pass "$long"
  must_fail 'cases:14: a case of more than 12 lines' "$long"$'\n  : 13'
}

test_wrong_cases_fail() {
  must_fail 'standard output differs' 'a | 0 | text | echo goodbye' hello
  must_fail 'standard output differs' $'a | 0 | text | \\\n  echo hello\n  echo goodbye' hello
  must_fail 'expected NAME' $'a | 0 | text | \\\n  echo hello\n\n  echo goodbye' hello
  must_fail 'does not exist' 'b | 0 | none | echo goodbye'
  must_fail 'wrote to standard output' 'c | 0 | - | echo goodbye'
  must_fail 'status 3, expected 0' 'd | 0 | - | exit 3'
  must_fail 'status 0, expected 1' 'e | 1 | x: no | echo "x: no" >&2'
  must_fail 'not silent' 'f | 0 | - | echo "x: note" >&2'
  must_fail 'not exactly one line' 'g | 1 | x: no | printf "x: no\nx: no\n" >&2; exit 1'
  must_fail 'not exactly one line' 'h | 1 | x: no | exit 1'
  must_fail 'differs from' 'i | 1 | x: no | echo "x: yes" >&2; exit 1'
  must_fail 'wrote to standard output' 'j | 1 | x: no | echo "x: no" | tee /dev/stderr; exit 1'
  must_fail 'left files' 'k | 1 | x: no | echo "x: no" >&2; touch out.ply; exit 1'
  must_fail 'left behind' 'l | 0 | - | touch .out.ply.a1b2'
  must_fail 'left behind' 'm | 0 | - | touch out.ply.tmp'
  must_fail 'left behind' 'n | 0 | - | touch $TMPDIR/x'
  must_fail 'digest 00ff, expected 00fe' 'o | 0 | digest:00fe | echo "{\"digest\":\"00ff\"}" >&2'
  must_fail 'status 1, expected 0' 'p | 0 | - | false | true'
  must_fail 'may not keep bytes\|needs the data' 'q | 0 | text | echo hello; : $SHARED' hello
}

test_answers_that_depend_on_threads_or_processor_fail() {
  must_fail 'with -j2' 'a | 0 | text | echo $J' -j1
  must_fail 'with -j2' 'b | 0 | - | echo $J > out.ply'
  must_fail 'with -j2' 'c | 1 | x: * | echo "x: $J" >&2; exit 1'
  must_fail 'GLIBC_TUNABLES' 'd | 0 | text | echo "${GLIBC_TUNABLES-none}"' none
  must_fail 'GEWEBE_CPU=baseline' 'e | 0 | text | test "${GEWEBE_CPU-}" = baseline && echo yes || echo no' no
  must_fail 'OPENBLAS_CORETYPE=Prescott' 'i | 0 | text | test "${OPENBLAS_CORETYPE-}" = Prescott && echo yes || echo no' no
  ! grep -q ' avx512vl ' /proc/cpuinfo || {
    must_fail 'GEWEBE_CPU=avx2' 'f | 0 | text | test "${GEWEBE_CPU-}" = avx2 && echo yes || echo no' no
    must_fail 'OPENBLAS_CORETYPE=Haswell' 'j | 0 | text | test "${OPENBLAS_CORETYPE-}" = Haswell && echo yes || echo no' no
  }
  must_fail 'with' 'h | 0 | text | test "${GEWEBE_CPU-}" && echo 1 > out || echo 2 > out; echo hello' hello
}

test_update_writes_what_changed() {
  mkdir -p golden/in golden/expected
  echo old >golden/expected/text
  printf '%s\n' '# head' 'a | 0 | text | echo new | cat' 'b | 0 | digest:0 | echo "{\"digest\":\"00ff\"}" >&2' \
    'c | 1 | x: old | echo "x: new" >&2; exit 1' 'd | 1 | x: * | echo "x: free" >&2; exit 1' \
    'm | 1 | \ | \' '  x: old' '  echo "x: new" >&2' '  exit 1' \
    'l | 0 | digest:0 | \' '  true' '  echo "{\"digest\":\"00ff\"}" >&2' >golden/cases
  update() { GOLDEN=$PWD/golden "$GEWEBE_ROOT/tests/golden/run" update --config "$(basename "$BUILD")"; }
  update >said.txt || fail 'update failed' "$(<said.txt)"
  [[ $(<golden/expected/text) == new ]] || fail 'expected/text was not written'
  grep -qxF 'b | 0 | digest:00ff | echo "{\"digest\":\"00ff\"}" >&2' golden/cases || fail 'the digest was not written'
  grep -qxF 'c | 1 | x: new | echo "x: new" >&2; exit 1' golden/cases || fail 'the message was not written'
  grep -xF -A 2 'm | 1 | \ | \' golden/cases | cmp - <(printf '%s\n' 'm | 1 | \ | \' '  x: new' '  echo "x: new" >&2') || fail 'a message in a line of its own was not written'
  tail -3 golden/cases | cmp - <(printf '%s\n' 'l | 0 | digest:00ff | \' '  true' '  echo "{\"digest\":\"00ff\"}" >&2') || fail 'a case of several lines was not kept'
  grep -qxF 'd | 1 | x: * | echo "x: free" >&2; exit 1' golden/cases || fail 'a pattern that holds was changed'
  [[ $(head -1 golden/cases) == '# head' ]] || fail 'the head was lost'
  [[ $(wc -l <said.txt) -ge 3 ]] || fail 'update did not say what changed:' "$(<said.txt)"
  cp golden/cases before
  [[ -z $(update) ]] || fail 'a second update is not silent'
  cmp golden/cases before
  # A status is never learned.
  echo 'e | 0 | - | exit 139' >golden/cases
  ! update >said.txt 2>&1 || fail 'update took a crash for the truth'
}

test_nothing_to_run_is_a_failure() {
  ! "$GEWEBE_ROOT/tests/run" --config no-such-build --test no-such-test >said.txt 2>&1 || fail 'no tests passed'
  [[ $(tail -1 said.txt) == '0 passed, 0 failed, 0 skipped' ]] || fail "$(<said.txt)"
  rm -rf "$GEWEBE_ROOT/build/no-such-build"
}

# A copy of the runner with tests of its own; the build holds no programs.
runner_of_its_own() {
  mkdir -p repo/tests/contract repo/tests/golden repo/build/release
  cp "$GEWEBE_ROOT/tests/run" repo/tests/
  cp "$GEWEBE_ROOT/tests/golden/run" repo/tests/golden/
  cp "$GEWEBE_ROOT/tests/contract/lib.bash" repo/tests/contract/
  : >repo/tests/golden/cases
  printf '%s\n' "$@" >repo/tests/contract/own.sh
}
own_run() { env -u GEWEBE_CHECK -u GEWEBE_UNIT_FILTER repo/tests/run --jobs 2 "$@" >said.txt 2>&1; }

test_skips_are_counted_and_can_be_run_alone() {
  runner_of_its_own 'test_whole() { :; }' 'test_part() { has no_such_program || true; }' \
    'test_data() { [[ -e $GEWEBE_SHARED/data ]] || skip "no data"; }'
  GEWEBE_SHARED=$PWD/none own_run || fail "$(<said.txt)"
  [[ $(tail -1 said.txt) == '2 passed, 0 failed, 2 skipped' ]] || fail "$(<said.txt)"
  grep -qxF 'skipped: contract own/part (in part): no no_such_program' said.txt || fail "$(<said.txt)"
  grep -qE '^  +[0-9.]+ s  contract own/whole$' said.txt || fail 'no seconds:' "$(<said.txt)"
  mkdir -p here/data
  GEWEBE_SHARED=$PWD/here own_run --skipped || fail "$(<said.txt)"
  [[ $(tail -1 said.txt) == '2 passed, 0 failed, 1 skipped' ]] || fail "$(<said.txt)"
  grep -q 'own/whole' said.txt && fail 'ran what had passed' "$(<said.txt)"
  own_run --test whole || fail "$(<said.txt)"
  own_run --skipped || fail "$(<said.txt)"
  [[ $(tail -1 said.txt) == '0 passed, 0 failed, 0 skipped' ]] || fail "$(<said.txt)"
}

test_two_runs_wait_for_each_other() {
  # shellcheck disable=SC2016 # the inner shell expands it
  runner_of_its_own 'test_alone() { mkdir "$GEWEBE_ROOT/running" || fail "two at once"; sleep 1; rmdir "$GEWEBE_ROOT/running"; }'
  env -u GEWEBE_CHECK repo/tests/run >first.txt 2>&1 &
  local first=$!
  sleep 0.3
  own_run || fail "$(<said.txt)"
  wait $first || fail "$(<first.txt)"
  cat first.txt said.txt | grep -q 'waits for another run' || fail 'nobody waited'
}

test_lists_of_the_sanitizers_name_tests() {
  local list pattern
  [[ -x $BUILD/unit ]] || skip "$BUILD/unit is not built"
  "$BUILD/unit" --gtest_list_tests | awk '/^[^ ]/ { suite = $1; next } /^ / { print suite $1 }' >names
  for list in slow threads; do
    while read -r pattern; do
      pattern=${pattern//./\\.}
      grep -q "^${pattern//\*/.*}\$" names || fail "tests/sanitize/$list: no test is $pattern"
    done < <(sed 's/ *#.*//; /^$/d' "$GEWEBE_ROOT/tests/sanitize/$list")
  done
}

test_no_expected_file_is_left_over() {
  local file
  for file in "$GEWEBE_ROOT"/tests/golden/expected/*; do
    [[ -e $file ]] || continue
    grep -qF "| ${file##*/} " "$GEWEBE_ROOT/tests/golden/cases" || fail "no case expects ${file##*/}"
  done
  for file in "$GEWEBE_ROOT"/tests/golden/in/scenes/*; do
    grep -qF "\$IN/scenes/${file##*/}" "$GEWEBE_ROOT/tests/golden/cases" || fail "no case runs ${file##*/}"
  done
}
