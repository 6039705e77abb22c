# What README and the pages show runs as it stands: pasted into a clean folder, in the order of the page.
# shellcheck shell=bash

# Splits the blocks of a page's EXAMPLES into files block.01, block.02 …; lines of .D1 are what the block before them prints: says.01 …
blocks_of_page() { # FILE
  awk '
    function start() { close(out); out = sprintf("block.%02d", ++n) }
    /^\.Sh / { inside = $2 == "EXAMPLES"; next }
    !inside { next }
    /^\.Dl / { if (!line) start(); line = 1; print substr($0, 5) > out; next }
    { line = 0 }
    /^\.D1 / { print substr($0, 5) > sprintf("says.%02d", n); next }
    /^\.Bd / { start(); block = 1; next }
    /^\.Ed/ { block = 0; next }
    block { print > out }' "$1"
  # The escapes of mdoc that stand in examples.
  local file
  for file in block.[0-9]* says.[0-9]*; do
    [[ ! -e $file ]] || sed -i -e 's/\\e/\\/g' -e 's/\\&//g' -e 's/\\-/-/g' -e "s/\\\\(aq/'/g" -e 's/\\(dq/"/g' "$file"
  done
}
# The same for README: paragraphs of its indented blocks that begin with one of our programs, or a shell's word before one.
blocks_of_readme() { # FILE
  awk -v programs=" $(programs | tr '\n' ' ')" '
    /^    / { text = text substr($0, 5) "\n"; next }
    { flush() }
    function flush(  first) {
      first = text
      sub(/[ \n].*/, "", first)
      if (index(programs, " " first " ") || first ~ /^(printf|echo|cat|cd|for|cp|mkdir|awk)$/) {
        close(out); out = sprintf("block.%02d", ++n); printf "%s", text > out
      }
      text = ""
    }
    END { flush() }' "$1"
}

# Runs the blocks in order, all in one folder; they may warn. One that calls a program of another's which is not here is left out.
paste_blocks() { # WHAT
  local block other program says
  set -- "$1" block.[0-9]*
  [[ -e ${2-} ]] || fail "$1 has no block to run"
  for block in "${@:2}"; do
    other=
    for program in ffmpeg python3 parallel; do
      grep -qw "$program" "$block" && ! command -v "$program" >/dev/null && other=$program
    done
    if [[ $other ]]; then
      left_out "$1: no $other for: $(head -1 "$block")"
      continue
    fi
    (cd paste && bash -euo pipefail "../$block" </dev/null) >out.txt 2>err.txt ||
      fail "$1: ends with status $?:" "$(<"$block")" "$(head -5 err.txt)"
    ! grep -v ': warning: ' err.txt >/dev/null || fail "$1: is not silent:" "$(<"$block")" "$(head -5 err.txt)"
    says=says.${block#block.}
    [[ ! -e $says ]] || cmp -s out.txt "$says" || fail "$1: does not print what the page says:" "$(<"$block")" "$(diff "$says" out.txt)"
  done
}

page() { # NAME.SECTION
  mkdir paste
  cp -r "$GEWEBE_ROOT/examples" paste/ # what an example reads and does not make stands there
  blocks_of_page "$GEWEBE_ROOT/man/$1"
  paste_blocks "$1"
}
for_release() { [[ $(basename "$BUILD") == release ]] || skip 'for config=release'; }

test_readme() {
  for_release
  mkdir paste
  cp -r "$GEWEBE_ROOT/examples" paste/
  blocks_of_readme "$GEWEBE_ROOT/README.md"
  paste_blocks README
}
test_metaball2vol() { for_release && page metaball2vol.1; }
test_voxelize() { for_release && page voxelize.1; }
test_csg() { for_release && page csg.1; }
test_mc_opt() { for_release && page mc-opt.1; }
test_exp2ela() { for_release && page exp2ela.1; }
test_ffe_precompute() { for_release && page ffe-precompute.1; }
test_ffe_run() { for_release && page ffe-run.1; }
test_emboss_render() { for_release && page emboss-render.1; }
test_gewebe() { for_release && page gewebe.7; }
test_gewebe_contact() { for_release && page gewebe-contact.7; }
test_gewebe_plot() { for_release && page gewebe-plot.1; }
test_gewebe_command() { for_release && page gewebe.1; }
test_gewebe_serve() { for_release && page gewebe_serve.5; }
test_gewebe_solids() { for_release && page gewebe-solids.7; }
test_gewebe_accuracy() { for_release && page gewebe-accuracy.7; }
test_gewebe_nets() { for_release && page gewebe-nets.7; }
test_gewebe_cutting() { for_release && page gewebe-cutting.7; }
test_scene() { for_release && page scene.5; }

test_each_page_of_a_program_is_pasted() {
  local tool
  for tool in $(programs); do
    grep -q "page $tool\.1;" "$GEWEBE_ROOT/tests/contract/pasted.sh" || fail "nothing runs the examples of man/$tool.1"
    blocks_of_page "$GEWEBE_ROOT/man/$tool.1"
    [[ -e block.01 ]] || fail "man/$tool.1 has no examples"
    rm block.*
  done
}

# That it can fail: an example whose file is not made, one that talks, and none at all.
test_a_broken_example_is_seen() {
  local text
  for text in 'exp2ela nowhere.obj -o out.ela' 'echo hello >&2'; do
    rm -rf paste block.*
    mkdir paste
    printf '%s\n' '.Sh EXAMPLES' 'Words:' '.Pp' '.Dl true' '.Bd -literal' 'true \e' '  && true' '.Ed' ".Dl $text" '.Sh SEE ALSO' >page.1
    blocks_of_page page.1
    [[ $(cat block.02) == $'true \\\n  && true' ]] || fail 'a block is read otherwise:' "$(cat block.02)"
    ! (paste_blocks page) >said.txt || fail "passed: $text"
    grep -qF "$text" said.txt || fail 'another complaint:' "$(<said.txt)"
  done
  rm block.*
  printf '%s\n' '.Sh EXAMPLES' '.Dl echo 3 mN' '.Pp' 'It prints' '.D1 4 mN' >page.1
  blocks_of_page page.1
  ! (paste_blocks page) >said.txt || fail 'passed: another output than the page says'
  grep -q 'does not print' said.txt || fail 'another complaint:' "$(<said.txt)"
  rm block.* says.*
  ! (paste_blocks page) >said.txt || fail 'a page without examples passed'
  printf '%s\n' 'Text' '' '    particles ─ metaball2vol' '' '    exp2ela nowhere.obj' '' '    make check' >readme.md
  blocks_of_readme readme.md
  [[ $(cat block.*) == 'exp2ela nowhere.obj' ]] || fail "README's blocks are read otherwise:" "$(cat block.*)"
}
