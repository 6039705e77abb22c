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
