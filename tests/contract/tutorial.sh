# The tutorial, followed line by line: its commands in an empty folder, and what each block prints.
# shellcheck shell=bash

# Blocks of commands as 01.run, 02.run …, and what the commands before print as the 01.says of the same number.
blocks_of_tutorial() { # FILE
  awk '
    /^\.Bd -literal -offset indent$/ { out = sprintf("%02d.run", ++n); next }
    /^\.Bd -literal -offset indent-two$/ { out = sprintf("%02d.says", n); next }
    /^\.Ed/ { close(out); out = ""; next }
    out { print > out }' "$1"
  sed -i -e 's/\\e/\\/g' -e 's/\\&//g' [0-9]*.run
}
follow() {
  local block number
  mkdir folder
  for block in [0-9]*.run; do
    number=${block%.run}
    (cd folder && bash -euo pipefail "../$block" </dev/null) >"$number.out" 2>"$number.err" ||
      fail "block $number ends with status $?:" "$(<"$block")" "$(head -5 "$number.err")"
    [[ ! -s $number.err ]] || fail "block $number warns:" "$(<"$number.err")"
    [[ -e $number.says ]] || : >"$number.says"
    cmp "$number.out" "$number.says" || fail "block $number prints:" "$(<"$number.out")" 'expected:' "$(<"$number.says")"
  done
}

test_line_by_line() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  local picture runs says
  blocks_of_tutorial "$GEWEBE_ROOT/man/gewebe-tutorial.7"
  runs=(*.run) says=(*.says)
  ((${#runs[@]} > 7 && ${#says[@]} > 5)) || fail "hardly a block: ${runs[*]} ${says[*]}"
  follow
  for picture in folder/{pull,cut,press}.png; do
    [[ $(stat -c %s "$picture") -gt 10000 ]] || fail "$picture is empty"
  done
}

test_another_answer_is_seen() {
  printf '%s\n' '.Bd -literal -offset indent' 'echo 5 mN' '.Ed' '.Bd -literal -offset indent-two' '6 mN' '.Ed' >page.7
  blocks_of_tutorial page.7
  ! (follow) >said || fail 'another answer passes'
  rm -r folder 01.*
  printf '%s\n' '.Bd -literal -offset indent' 'echo warning >&2' '.Ed' >page.7
  blocks_of_tutorial page.7
  ! (follow) >said || fail 'a warning passes'
}
