# The man pages say what the programs do.
# shellcheck shell=bash

options_of_help() { # TOOL: the options that --help shows, one a line, dashes kept
  "$1" --help | awk '/^ +-/ { sub(/^ +/, ""); sub(/[ [=].*/, ""); gsub(",", "\n"); print }' | sort
}
options_of_page() { # FILE: the options that its .It lines declare
  awk '
    /^\.It / {
      for (i = 2; i <= NF; ++i) {
        if ($i != "Fl") { long = 0; continue }
        if ($(i + 1) == "Fl") { ++i; long = 1 } else long = 0
        word = $(++i)
        sub(/=.*/, "", word)
        print (long ? "--" : "-") word
      }
    }' "$1" | sort
}

compare_options() { # HELP PAGE TOOL
  local difference
  difference=$(diff <(sort "$1") <(sort "$2")) || fail "man/$3.1 differs from $3 --help (<: only in help, >: only in the page):" "$difference"
}

test_options_stand_in_the_page_and_the_reverse() {
  local tool
  for tool in $(programs); do
    [[ -f $GEWEBE_ROOT/man/$tool.1 ]] || fail "man/$tool.1 is missing"
    options_of_help "$tool" >help.txt
    options_of_page "$GEWEBE_ROOT/man/$tool.1" >page.txt
    grep -qx -e --help help.txt || fail "$tool --help shows no options"
    compare_options help.txt page.txt "$tool"
  done
}

test_options_of_plot_stand_in_its_page() {
  printf '%s\n' '#!/bin/sh' 'exec gewebe plot "$@"' >plot
  chmod +x plot
  options_of_help ./plot >help.txt
  options_of_page "$GEWEBE_ROOT/man/gewebe-plot.1" >page.txt
  grep -qx -e --y help.txt || fail 'gewebe plot --help shows no options'
  compare_options help.txt page.txt gewebe-plot
}

test_a_missing_option_is_seen() {
  printf '%s\n' '.It Fl o , Fl Fl output Ar FILE' '.It Fl Fl stats Ns Op = Ns Ar FILE' '.It Fl Fl help' >page.1
  options_of_page page.1 >page.txt
  printf '%s\n' -o --output --stats --help >help.txt
  compare_options help.txt page.txt x
  printf '%s\n' --new >>help.txt
  ! (compare_options help.txt page.txt x) >/dev/null || fail 'an option missing in the page passed'
  printf '%s\n' '.It Fl Fl new' '.It Fl Fl gone' >>page.1
  options_of_page page.1 >page.txt
  ! (compare_options help.txt page.txt x) >/dev/null || fail 'an option missing in the help passed'
}

# The text of a page: `.Xr name 1` names a page of ours.
broken_references() { # FILE...
  awk '
    /^\.Xr / || / Xr / {
      for (i = 1; i < NF; ++i) if ($i == "Xr" || $i == ".Xr") print FILENAME, $(i + 1) "." $(i + 2)
    }' "$@" | while read -r page other; do
    [[ -f $GEWEBE_ROOT/man/$other ]] || echo "${page##*/} refers to $other, which does not exist"
  done
}

test_references_name_pages_that_exist() {
  local broken
  broken=$(broken_references "$GEWEBE_ROOT"/man/*.[1-9])
  [[ -z $broken ]] || fail "$broken"
  printf '.Xr nowhere 1 ,\n' >page.1
  [[ $(broken_references page.1) ]] || fail 'a reference to nowhere passed'
}

test_pages_are_clean_mdoc() {
  mandoc -Tlint -W warning "$GEWEBE_ROOT"/man/*.[1-9] || fail 'mandoc found faults'
}

# As Debian's man shows them in a terminal of 80 columns, where tables may not fit.
test_pages_fit_a_terminal() {
  { command -v man && command -v groff; } >/dev/null || skip 'no man of groff'
  shown() { LC_ALL=C.UTF-8 MANWIDTH=80 timeout 30 man --warnings -l "$1" 2>warnings >/dev/null && [[ ! -s warnings ]]; }
  local page
  for page in "$GEWEBE_ROOT"/man/*.[1-9]; do
    shown "$page" || fail "$page:" "$(<warnings)"
  done
  # That it can fail.
  printf '%s\n' '.Dd 1 January 2026' '.Dt A 1' .Os '.Sh NAME' '.Nm a' '.Nd b' '.Sh DESCRIPTION' \
    '.Bl -column "bladder, stretched" "1900 (1000 to 4100)" "shear waves, 127 people [5]" "gallbladder"' \
    '.It gall bladder Ta 250 Ta wall in tension [4] Ta Cm gallbladder' .El >wide.1
  ! shown wide.1 || fail 'a table that is too wide passes'
}

test_pages_have_their_sections() {
  local tool section
  for tool in $(programs); do
    for section in NAME SYNOPSIS DESCRIPTION OPTIONS '"\?EXIT STATUS"\?' EXAMPLES '"\?SEE ALSO"\?'; do
      grep -q "^\.Sh $section\$" "$GEWEBE_ROOT/man/$tool.1" || fail "man/$tool.1 has no section $section"
    done
    grep -q "^\.Nm $tool\$" "$GEWEBE_ROOT/man/$tool.1" || fail "man/$tool.1 does not name $tool"
    [[ $(mandoc -Tutf8 "$GEWEBE_ROOT/man/$tool.1") ]] || fail "man/$tool.1 does not render"
  done
  [[ -f $GEWEBE_ROOT/man/gewebe.7 ]] || fail 'man/gewebe.7 is missing'
}

# The defaults that --help shows, one `--option value` a line.
defaults_of_help() { # TOOL
  "$1" --help | awk '
    function tell() {
      if (match(text, /\(default [^;)]*/)) print option, substr(text, RSTART + 9, RLENGTH - 9)
    }
    /^ +-/ { tell(); text = ""; match($0, /--[a-z0-9-]+/); option = substr($0, RSTART, RLENGTH) }
    { line = $0; sub(/^ +/, "", line); text = text " " line }
    END { tell() }'
}
# Those of them that the option's paragraph in the page does not tell behind the word default, or just before it.
untold_defaults() { # FILE, defaults on standard input
  local option value
  while read -r option value; do
    awk -v option="${option#--}" '
      /^\.It Fl/ { here = 0; for (i = 2; i < NF; ++i) if ($i == "Fl" && $(i + 1) == "Fl" && $(i + 2) ~ "^" option "(=|$)") here = 1 }
      /^\.Sh/ { here = 0 }
      here { sub(/^\.(Cm|Ar|Sq|Pq|Fl) */, ""); print }' "$1" | tr '\n,;()' '     ' >paragraph
    { grep -q default paragraph && grep -qE -e "(^| )${value//,/ *}\.?( |\$)" paragraph; } || echo "$option ($value)"
  done
}
test_defaults_stand_in_the_page() {
  local tool untold
  for tool in $(programs); do
    defaults_of_help "$tool" >defaults
    grep -q -e '^--threads 0$' defaults || fail "$tool --help shows no default of --threads" "$(<defaults)"
    untold=$(untold_defaults "$GEWEBE_ROOT/man/$tool.1" <defaults)
    [[ -z $untold ]] || fail "man/$tool.1 does not tell the default of $untold"
  done
  # Another one is seen.
  printf '%s\n' '.It Fl Fl voxel Ar S' 'Edge; the default is 2.' '.It Fl Fl dim Ar N' 'The default is 1.' >page.1
  [[ ! $(echo '--voxel 2' | untold_defaults page.1) && $(echo '--voxel 1' | untold_defaults page.1) ]] ||
    fail 'a default that differs passes'
}

# What a page refers to stands under SEE ALSO too, all pages under that of gewebe(7), and it under theirs.
test_see_also_is_complete() {
  local page missing=''
  also() { sed -n '/^\.Sh SEE ALSO/,$ { s/^\.Xr \([^ ]*\) \([0-9]\).*/\1.\2/p; }' "$1" | sort -u; }
  for page in "$GEWEBE_ROOT"/man/*.[1-9]; do
    missing+=$(comm -13 <(also "$page") <({
      sed '/^\.Sh SEE ALSO/,$d' "$page" | sed -n 's/^\.\(.* \)\?Xr \([^ ]*\) \([0-9]\).*/\2.\3/p'
      [[ $page == */gewebe.7 ]] && (cd "$GEWEBE_ROOT"/man && printf '%s\n' ./*.[1-9] | sed 's|^./||')
      echo gewebe.7
    } | grep -vxF "${page##*/}" | sort -u) | sed "s|^|${page##*/}: |")
    grep -qx '.Os Gewebe' "$page" || missing+="${page##*/}: .Os Gewebe"
  done
  [[ -z $missing ]] || fail 'SEE ALSO lacks' "$missing"
}

test_readme_names_every_example() {
  local folder
  for folder in "$GEWEBE_ROOT"/examples/*/; do
    folder=$(basename "$folder")
    grep -qF "(examples/$folder)" "$GEWEBE_ROOT/README.md" || fail "README.md does not name examples/$folder"
  done
}

# Each preset stands in the table of gewebe-values(7), with its Young's modulus in kPa at the beginning of its row, or within the row's range.
untold_presets() { # FILE, presets on standard input
  local name density young
  while read -r name density young _; do
    grep -q "^\.It .* Ta Cm $name\$" "$1" || { echo "$name"; continue; }
    awk -v young="$young" -v name="$name" '
      $0 ~ " Ta Cm " name "$" { split($0, cell, " Ta "); n = split(cell[2], word, /[^0-9.]+/); low = high = word[1]; if (cell[2] ~ /^[0-9.]+ to /) high = word[2] }
      END { exit !(young >= 990 * low && young <= 1010 * high) }' "$1" || echo "$name ($density $young)"
  done
}
test_values_tell_the_presets() {
  local untold
  exp2ela --list-materials | sed 's/#.*//; /^ *$/d; /^generic/d' >presets
  [[ $(wc -l <presets) -gt 10 ]] || fail 'hardly any presets' "$(<presets)"
  untold=$(untold_presets "$GEWEBE_ROOT/man/gewebe-values.7" <presets)
  [[ -z $untold ]] || fail 'gewebe-values(7) lacks' "$untold"
  [[ $(echo 'bone 0.002 2e10 1 0' | untold_presets "$GEWEBE_ROOT/man/gewebe-values.7") == bone ]] || fail 'a preset that it lacks passes'
  [[ $(echo 'liver 0.001 7000 1 0' | untold_presets "$GEWEBE_ROOT/man/gewebe-values.7") == 'liver (0.001 7000)' ]] || fail 'another modulus passes'
}

# The manual as web pages: one for each page and an index, whose links all lead somewhere.
test_html_pages_are_linked() {
  local page
  "$GEWEBE_ROOT/scripts/html" pages
  for page in "$GEWEBE_ROOT"/man/*.[1-9]; do
    [[ -s pages/${page##*/}.html ]] || fail "no page for ${page##*/}"
    grep -qF "href=\"${page##*/}.html\"" pages/index.html || fail "the index lacks ${page##*/}"
  done
  "$GEWEBE_ROOT/scripts/html" --check pages >said || fail "$(<said)"
  # Links to a page and to a place that there are not are seen.
  echo '<a href="nowhere.1.html">' >>pages/csg.1.html
  ! "$GEWEBE_ROOT/scripts/html" --check pages >said || fail 'a link to nowhere passes'
  "$GEWEBE_ROOT/scripts/html" pages
  echo '<a href="#nowhere">' >>pages/csg.1.html
  ! "$GEWEBE_ROOT/scripts/html" --check pages >said || fail 'a link to no place passes'
  "$GEWEBE_ROOT/scripts/html" pages
  [[ $(grep -c '<img src=' pages/gewebe-tutorial.7.html) == 3 ]] || fail 'the tutorial lacks a picture'
  rm pages/cut.png
  ! "$GEWEBE_ROOT/scripts/html" --check pages >said || fail 'a picture that is not there passes'
}
