# scripts/check-words sees words and sentences that readers stumble over, and its list of exceptions only shrinks.
# shellcheck shell=bash

words_of() { # FILE: findings
  CHECK_ROOT=$PWD "$GEWEBE_ROOT/scripts/check-words" --list "$1"
}
tree() {
  mkdir -p scripts man lib/a
  cp "$GEWEBE_ROOT/scripts/words" scripts/
  printf '%s\n' '.Sh DESCRIPTION' 'It reads a file.' >man/a.1
  echo 'It reads a file.' >README.md
  printf '%s\n' '/// Reads a file.' 'int read();' >lib/a/a.h
}

test_findings() {
  tree
  local long='One two three four five six seven eight nine ten eleven twelve thirteen fourteen fifteen sixteen seventeen eighteen'
  [[ ! $(words_of man/a.1)$(words_of README.md)$(words_of lib/a/a.h) ]] || fail 'plain sentences are findings'
  echo 'Whoever reads it wins.' >>man/a.1
  [[ $(words_of man/a.1) == "man/a.1:3: 'Whoever': "* ]] || fail 'a person in a page passes'
  printf '%s\n' '.Bd -literal' 'who' '.Ed' '.Sh SEE ALSO' 'who' >man/a.1
  [[ ! $(words_of man/a.1) ]] || fail 'literal text is a finding'
  printf '%s\n' '.Sh DESCRIPTION' "$long" "$long." >man/a.1
  [[ $(words_of man/a.1) == *'a sentence of 36 words'* ]] || fail 'a long sentence passes' "$(words_of man/a.1)"
  echo 'Of a result: its frames.' >README.md
  [[ $(words_of README.md) == *'subject, verb, object' ]] || fail 'an inverted sentence passes'
  # shellcheck disable=SC2016 # Markdown's code
  printf '%s\n' '`who`' '' '    who' '| who |' >README.md
  [[ ! $(words_of README.md) ]] || fail 'code of Markdown is a finding'
  printf '%s\n' 'int who; // whoever' 'auto text = "told the user"; // plain' >lib/a/a.h
  [[ $(words_of lib/a/a.h | wc -l) == 2 ]] || fail 'comment and message, no name:' "$(words_of lib/a/a.h)"
}

test_the_list_only_shrinks() {
  tree
  local check="$GEWEBE_ROOT/scripts/check-words"
  export CHECK_ROOT=$PWD
  printf '%s\n' '// who' '// nobody' >lib/a/a.h
  "$check" --update >said.txt || fail "$(<said.txt)"
  grep -qx '2 lib/a/a.h' scripts/words.exceptions || fail 'another list' "$(<scripts/words.exceptions)"
  "$check" >said.txt || fail 'what the list allows fails' "$(<said.txt)"
  # Moved code takes its findings along.
  mv lib/a/a.h lib/a/b.h
  "$check" >said.txt || fail 'moved code fails' "$(<said.txt)"
  # One more does not.
  echo '// who' >lib/a/c.h
  ! "$check" >said.txt || fail 'another finding passes'
  grep -q 'lib/a/c.h: 1, expected 0' said.txt || fail 'another complaint' "$(<said.txt)"
  ! "$check" --update >said.txt || fail 'the list grows'
  rm lib/a/c.h lib/a/b.h
  echo '// plain' >lib/a/a.h
  "$check" --update >said.txt || fail "$(<said.txt)"
  ! grep -v '^#' scripts/words.exceptions || fail 'the list keeps what is gone'
}
