# What shells complete: the options of the programs, their words, and files.
# shellcheck shell=bash disable=SC2016 # zsh and fish expand

written() { # SHELL FILE
  mapfile -t all < <(programs && echo gewebe)
  "$GEWEBE_ROOT/scripts/completions" "$1" "$BUILD" "${all[@]}" >"$2"
}

# What bash proposes for the words of a command line, the last one in the making, in one line.
proposed() { # WORD...
  (
    COMP_WORDS=("$@")
    COMP_CWORD=$(($# - 1))
    _gewebe
    ((${#COMPREPLY[@]} == 0)) || printf '%s\n' "${COMPREPLY[@]}" | sort | paste -sd ' '
  )
}
expect_proposed() { # EXPECTED WORD...
  local found
  found=$(proposed "${@:2}")
  [[ $found == "$1" ]] || fail "${*:2}: bash proposes '$found', expected '$1'"
}

test_bash() {
  local tool option
  written bash gewebe.bash
  # shellcheck source=/dev/null
  . ./gewebe.bash
  rm gewebe.bash
  : >liver.vdb
  mkdir organs
  # Every option of every program, as --help has them.
  for tool in $(programs); do
    [[ $(complete -p "$tool") == *_gewebe* ]] || fail "nothing completes $tool"
    while read -r option; do
      [[ " $(proposed "$tool" "$option") " == *" $option "* ]] || fail "$tool $option is not proposed"
    done < <("$tool" --help | awk '/^ +-/ { sub(/^ +/, ""); sub(/[ [=].*/, ""); gsub(",", "\n"); print }')
  done
  expect_proposed '--materials --max-memory' mc-opt --ma
  expect_proposed 'corner mean' mc-opt --place ''
  expect_proposed 'mean' mc-opt --place m
  expect_proposed 'ply' mc-opt --to = pl # as bash takes --to=pl
  expect_proposed 'jones' voxelize --antialias j
  expect_proposed 'liver' exp2ela --material liv
  expect_proposed 'subtract' csg su
  expect_proposed 'liver.vdb' csg add liver.vdb li
  expect_proposed 'liver.vdb organs' mc-opt ''
  expect_proposed 'liver.vdb organs' mc-opt -o ''
  expect_proposed 'liver.vdb' metaball2vol --like l
  expect_proposed 'liver.vdb' emboss-render --texture 1 = l # as bash takes 1=l
  expect_proposed '' mc-opt --iso '' # a number
  expect_proposed 'liver.vdb organs' mc-opt --stats = ''
  expect_proposed 'mc-opt metaball2vol' gewebe m
  expect_proposed '--place' gewebe mc-opt --pl
  expect_proposed 'corner mean' gewebe mc-opt --place ''
  expect_proposed 'voxelize' gewebe help v
  expect_proposed '--size --stats' gewebe plot --s
  # That it can fail.
  ! (expect_proposed 'mean' mc-opt --place '') >/dev/null || fail 'another proposal passes'
}

# zsh as at a terminal: what stands there after two tabs, waited for until that is EXPECTED, or for six seconds.
listed_by_zsh() { # LINE EXPECTED
  TERM=vt100 zsh -f -c '
    zmodload zsh/zpty || exit 3
    zpty at zsh -f -i
    zpty -w at "fpath=($PWD/functions \$fpath); PS1=; autoload -Uz compinit; compinit -u -d $PWD/dump; unset zle_bracketed_paste; print rea\"\"dy"
    zpty -r at text "*ready*" >/dev/null
    sleep 0.5
    zpty -n -w at "$1"$'\''\t\t'\''
    for ((k = 0; k < 24; ++k)) {
      sleep 0.25
      while zpty -r -t at text; do all+=$text; done
      # Without what moves and colours.
      plain=$(print -r -- "$all" | tr -d "\000\r" | sed "s/\x1b\[[0-9;?]*[a-zA-Z]//g")
      [[ $plain != *"$2"* ]] || break
    }
    print -r -- "$plain"
    zpty -d at' - "$1" "$2"
}
test_zsh() {
  command -v zsh >/dev/null || skip 'no zsh'
  local text
  mkdir functions
  written zsh functions/_gewebe
  zsh -n functions/_gewebe || fail 'zsh does not read it'
  for_line() { # LINE EXPECTED
    text=$(listed_by_zsh "$1" "$2")
    [[ $text == *"$2"* ]] || fail "$1: zsh lists no '$2':" "$text"
  }
  for_line 'mc-opt --pl' '--place='
  for_line 'mc-opt --place ' 'corner  mean'
  for_line 'csg su' subtract
  for_line 'gewebe mc-opt --place ' 'corner  mean'
  for_line 'gewebe ' 'csg             -- '
  for_line 'gewebe plot --to ' 'ascii  svg'
  for_line 'mc-opt --' '--self-intersections  -- let --stats count'
  # That it can fail: another program's words.
  ! (for_line 'csg --pl' '--place=') >/dev/null || fail 'csg has --place'
}

test_fish() {
  command -v fish >/dev/null || skip 'no fish'
  local tool
  export HOME=$PWD XDG_CONFIG_HOME=$PWD/config XDG_DATA_HOME=$PWD/data
  mkdir -p config/fish/completions
  for tool in $(programs) gewebe; do
    "$GEWEBE_ROOT/scripts/completions" fish "$BUILD" "$tool" >"config/fish/completions/$tool.fish"
    fish -n "config/fish/completions/$tool.fish" || fail "fish does not read that of $tool"
  done
  by_fish() { fish -c "complete -C '$1'"; }
  [[ $(by_fish 'mc-opt --place ') == *corner*mean* ]] || fail 'no words' "$(by_fish 'mc-opt --place ')"
  [[ $(by_fish 'mc-opt --self') == --self-intersections*count* ]] || fail 'no option' "$(by_fish 'mc-opt --self')"
  [[ $(by_fish 'csg su') == *subtract* ]] || fail 'no operation' "$(by_fish 'csg su')"
  [[ $(by_fish 'gewebe meta') == metaball2vol* ]] || fail 'no program' "$(by_fish 'gewebe meta')"
  [[ $(by_fish 'gewebe mc-opt --self') == --self-intersections* ]] || fail 'nothing behind gewebe' "$(by_fish 'gewebe mc-opt --self')"
  [[ $(by_fish 'gewebe plot --ti') == --title* ]] || fail 'no option of plot' "$(by_fish 'gewebe plot --ti')"
}
