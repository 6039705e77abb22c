# What judges contact from outside: it passes what is right, and fails what is not.
# shellcheck shell=bash disable=SC2317 # functions are called by name

textbook() { python3 "$GEWEBE_ROOT/tests/validate/textbook.py" "$@"; }

# A block under a plate, whose force is known; the same with answers that another program has changed.
test_textbook_scenes_tell_right_from_wrong() {
  command -v python3 >/dev/null || skip 'no python3'
  local status=0
  textbook --build "$BUILD" --only 'plate coarse order=1 dt=1/200' --page page >log 2>&1 || fail 'a plate on a block fails:' "$(tail -5 log)"
  [[ $(tail -1 log) == '1 passed, 0 failed, 0 skipped' ]] || fail 'the last line is' "$(tail -1 log)"
  grep -q '^| .*force over E A d / h | 1 | 1 | ± 0.005 | passed |$' page/README.md || fail 'the page lacks the force'

  mkdir programs
  ln -s "$BUILD/exp2ela" programs
  # Each instrument bears half more than it should, upwards.
  cat >programs/ffe-run <<END
#!/usr/bin/env bash
'$BUILD/ffe-run' "\$@" | awk '\$1 == "plate" && NF == 10 { \$7 *= 1.5 } { print }'
END
  chmod +x programs/ffe-run
  textbook --build programs --only 'plate coarse order=1 dt=1/200' >log 2>&1 || status=$?
  [[ $status == 1 ]] || fail "a wrong force gives the status $status" "$(tail -5 log)"
  grep -q 'sum of forces over their lengths; .* failed' log || fail 'forces that do not cancel are not told' "$(tail -5 log)"
}

# Surfaces that intersect, that only touch, and that are apart, by exact signs and by ipctk where it is installed.
test_textbook_finds_surfaces_that_intersect() {
  command -v python3 >/dev/null || skip 'no python3'
  python3 - "$GEWEBE_ROOT/tests/validate" <<'END' || fail 'the search for intersections is wrong'
import sys

sys.path.insert(0, sys.argv[1])
from random_contact import outside
from scene_runs import any_passes, box, has_intersections, turned

a = outside(*box((2, 2, 1), (2, 2, 1), (0, 0, 0)))
for height, spin, expected in ((1.0, 0, False), (1.0 - 1e-15, 17, True), (1 + 1e-12, 17, False), (0.5, 0, True), (-3, 30, False)):
    points, triangles = outside(*box((3, 3, 1), (1, 1, 1), (0.4, 0.3, height)))
    points = [turned(p, (0, 0, 1), spin / 10) for p in points]
    both = a[0] + points, a[1] + [tuple(n + len(a[0]) for n in t) for t in triangles], [0] * len(a[0]) + [1] * len(points)
    for search in (any_passes, has_intersections):
        found = search(*both, lambda i, j: i != j)
        if found != expected:
            sys.exit(f"{search.__name__} finds {found} at the height {height}, expected {expected}")
END
}
