# scripts/deps, with stand-ins for dpkg-query, apt-get, sudo and id.
# shellcheck shell=bash

stand_ins() {
  mkdir -p bin repo/scripts
  cp "$GEWEBE_ROOT/scripts/deps" repo/scripts
  printf '%s\n' '# comment' 'one build' 'two build,check' 'three check' 'four lint' >repo/packages.txt
  : >installed
  : >log
  # Knows what `installed` lists.
  cat >bin/dpkg-query <<'END'
#!/bin/bash
status=0
for word in "${@:4}"; do
  if grep -qx "$word" "$HERE/installed"; then echo "installed $word"; else status=1; fi
done
exit $status
END
  cat >bin/apt-get <<'END'
#!/bin/bash
echo "apt-get as ${AS-user} $DEBIAN_FRONTEND: $*" >>"$HERE/log"
[[ " $* " == *' update '* ]] && touch "$HERE/updated"
[[ " $* " == *' install '* ]] || exit 0
[[ -e $HERE/needs_update && ! -e $HERE/updated ]] && exit 100
for word in one two three four; do [[ " $* " == *" $word"* ]] && echo "$word" >>"$HERE/installed"; done
exit 0
END
  printf '%s\n' '#!/bin/bash' 'echo 1000' >bin/id
  local tool
  for tool in bash awk tr dirname env cat touch grep; do ln -s "$(command -v "$tool")" bin/; done
  chmod +x bin/*
  export HERE=$PWD
}
deps() { PATH=$HERE/bin repo/scripts/deps "$@"; }
sudo_stand_in() {
  printf '%s\n' '#!/bin/bash' 'AS=sudo exec "$@"' >bin/sudo
  chmod +x bin/sudo
}

test_nothing_missing_is_silent_and_offline() {
  stand_ins
  printf '%s\n' one two three >installed
  deps build check >said.txt 2>&1 || fail "status $?"
  [[ ! -s said.txt ]] || fail 'not silent:' "$(<said.txt)"
  [[ ! -s log ]] || fail 'called apt-get:' "$(<log)"
}

test_neither_root_nor_sudo_prints_the_line() {
  stand_ins
  echo two >installed
  local status=0
  deps build check >said.txt 2>stderr.txt || status=$?
  ((status == 1)) || fail "status $status, expected 1"
  [[ $(<said.txt) == 'apt-get install --no-install-recommends one three' ]] || fail "$(<said.txt)"
  [[ ! -s log ]] || fail 'called apt-get:' "$(<log)"
}

test_sudo_installs() {
  stand_ins
  sudo_stand_in
  touch needs_update
  deps build >said.txt 2>&1 || fail "status $?" "$(<said.txt)"
  [[ $(head -1 said.txt) == 'apt-get install --no-install-recommends one two' ]] || fail "$(<said.txt)"
  grep -q '^apt-get as sudo noninteractive: .*install --no-install-recommends one two$' log || fail "$(<log)"
  grep -q ' update$' log || fail 'did not fetch the lists' "$(<log)"
}

test_root_installs() {
  stand_ins
  printf '%s\n' '#!/bin/bash' 'echo 0' >bin/id
  deps lint >said.txt 2>&1 || fail "status $?" "$(<said.txt)"
  grep -q '^apt-get as user noninteractive: .*install --no-install-recommends four$' log || fail "$(<log)"
  deps lint >said.txt 2>&1
  [[ ! -s said.txt ]] || fail 'a second time is not silent'
}

test_an_unknown_set_is_an_error() {
  stand_ins
  ! deps biuld 2>said.txt || fail 'passed'
  grep -q "no set 'biuld'" said.txt
}

test_the_list_is_well_formed() {
  awk '!/^#/ && (NF != 2 || $2 !~ /^(build|check|lint|bench|fuzz|deb|wheel|ci)(,(build|check|lint|bench|fuzz|deb|wheel|ci))*$/) { print; bad = 1 } END { exit bad }' \
    "$GEWEBE_ROOT/packages.txt" || fail 'lines that name no set'
  [[ -z $(awk '!/^#/ { print $1 }' "$GEWEBE_ROOT/packages.txt" | sort | uniq -d) ]] || fail 'a package twice'
}

# The order in which make would do things; nothing is run.
test_goals_install_before_they_compile() {
  local goal first
  plan() { env -u MAKEFLAGS -u DEPS "${MAKE:-make}" -n --no-print-directory -C "$GEWEBE_ROOT" config=debug "$@" 2>/dev/null; }
  for goal in check lint; do
    # (Without pipes: make would die of SIGPIPE.)
    plan "$goal" BUILD="$PWD/fresh" LINT="$PWD/lint" >plan.txt || true
    first=$(grep -nE '^scripts/deps' plan.txt | cut -d: -f1 | sed -n 1p)
    [[ $first ]] || fail "make $goal does not install"
    ! head -n "$first" plan.txt | grep -E '(-c |clang-tidy-16|clang-format-16)' || fail "make $goal compiles first"
    plan "$goal" BUILD="$PWD/fresh" LINT="$PWD/lint" DEPS=no >plan.txt || true
    ! grep -q '^scripts/deps' plan.txt || fail "DEPS=no installs for $goal"
  done
  plan all BUILD="$PWD/fresh" >plan.txt
  ! grep -q '^scripts/deps' plan.txt || fail 'plain make installs'
}
