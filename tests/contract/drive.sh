# The clients of examples/drive, as a user runs them.
# shellcheck shell=bash disable=SC2317 # functions are called by name

test_clients_in_c_and_python_find_the_same() {
  python3 -c 'import numpy' 2>/dev/null || skip 'no numpy for python3'
  command -v "${CC:-cc}" >/dev/null || skip 'no C compiler'
  local file
  unset MAKEFLAGS MAKELEVEL
  cp "$GEWEBE_ROOT"/examples/drive/{Makefile,drive.c,drive.py,README.md} .
  make PYTHON="$(python3 -c 'import sys; print(sys.executable)')" CC="${CC:-cc}" CFLAGS='-O1 -Wconversion -Werror' >log 2>&1 || fail 'the example fails:' "$(tail -5 log)"
  # What README shows is what comes out.
  sed -n 's/^    \([TPiAav].*\.\|.*,\)$/\1/p' README.md | cmp - c.figures || fail 'other figures' "$(<c.figures)"
  cmp c.figures python.figures || fail 'Python finds others' "$(<python.figures)"
  # The tool carries what came off: the masses of the rings between the cuts, and a part of those beside them.
  awk '$1 == "nodes" { n = $2; next } n-- > 0 { if ($3 > 28 && $3 < 52) inner += $4; if ($3 > 23 && $3 < 57) outer += $4 }
    END { print inner * 9810 / 1e6, outer * 9810 / 1e6 }' vessel.ela >weights
  awk 'NR == FNR { low = $1; high = $2; next } /carries/ { exit !($4 > low && $4 < high) }' weights c.figures ||
    fail 'another weight' "$(<weights)" "$(<c.figures)"
  [[ ! -e c.socket && ! -e c.shapes && ! -e python.socket ]] || fail "$(ls)"
  make -s clean
  for file in *; do
    [[ $file == log || $file == weights || -e $GEWEBE_ROOT/examples/drive/$file ]] || fail "clean left $file"
  done
}
