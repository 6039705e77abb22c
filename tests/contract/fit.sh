# exp2ela --fit: Young's moduli from what a body was measured to do.
# shellcheck shell=bash disable=SC2317 # functions are called by name

# A ball held at its bottom, of some hundred quadratic tetrahedra.
ball() { # FILE OPTION...
  exp2ela --primitive sphere:16x12 --size 30 --solid --cell 12 --poisson 0.4 --fix 'z<-20 and surface' --name ball -o "$1" -q "${@:2}"
}

# measured: what ffe-run has a ball of 20 kPa do, at every fortieth node that can move.
measure() {
  ball truth.ela --young 20000
  printf '%s\n' 'object ball truth.ela method=ffe' 'emit shapes' 'gravity 0 -500 0' 'force ball z>25 0 0 -2000 total' step >scene
  ffe-run scene >shapes
  {
    printf '%s\n' '# a ball' 'gravity 0 -500 0' 'force z>25 0 0 -2000 total'
    awk 'BEGIN { n = 0 } FNR == NR { if ($1 == "nodes") want = $2; else if (want && n < want) { x[n] = $1; y[n] = $2; z[n++] = $3 } next }
      $1 == "shapes" { k = 0; seen = 1; next }
      seen && k < n { if (k % 40 == 0 && z[k] > -20) printf "measure %.9g %.9g %.9g %.9g %.9g %.9g\n", x[k], y[k], z[k], $1 - x[k], $2 - y[k], $3 - z[k]; ++k }' \
      truth.ela shapes
  } >measured
  (($(grep -c ^measure measured) > 15)) || fail "$(<measured)"
}

test_a_modulus_is_found_again() {
  measure
  ball start.ela --young 1000
  exp2ela -v --stats=stats --fit measured start.ela -o fitted.ela 2>said
  python3 - <<'END'
import json
fit = json.load(open('stats'))['fit']
young = fit['young']['generic']
assert abs(young['value'] / 20000 - 1) < 0.02, fit
assert young['interval'][0] < young['value'] < young['interval'][1], fit
assert fit['solves'] <= 10 and fit['residual'] < 0.02 * fit['measured'], fit
line = [l.split() for l in open('fitted.ela') if '"generic"' in l][0]
assert float(line[3]) == young['value'], line
END
  grep -q "Young's modulus" said || fail "$(<said)"
  # Nothing but the modulus changes.
  diff start.ela fitted.ela >changed || true
  (($(grep -c '^>' changed) == 1)) || fail "$(<changed)"
  # The bytes don't hang on the threads.
  exp2ela -j 1 --fit measured start.ela -o one.ela
  cmp one.ela fitted.ela
  # Straight from the surface.
  ball direct.ela --young 1000 --fit measured
  cmp direct.ela fitted.ela
}

test_the_damping_of_a_swing_is_found() {
  ball ball.ela
  awk 'BEGIN { for (k = 0; k < 100; ++k) { t = k / 100; print "swing", t, 3 + exp(-0.04 * 2 * 3.14159265 * 5 * t) * cos(2 * 3.14159265 * 5 * t) } }' >swing
  exp2ela --stats=stats --fit swing ball.ela -o same.ela
  python3 - <<'END'
import json
swing = json.load(open('stats'))['fit']['swing']
assert abs(swing['frequency'] - 5) < 0.01 and abs(swing['damping_ratio'] - 0.04) < 0.0005, swing
ratio, frequency = map(float, swing['damping'].split('@'))
assert abs(ratio - 0.04) < 0.0005 and abs(frequency - 5) < 0.01, swing
END
  cmp ball.ela same.ela
}

refused() { # MESSAGE LINE...
  printf '%s\n' "${@:2}" >bad
  local status=0
  exp2ela --fit bad ball.ela >/dev/null 2>said || status=$?
  ((status == 1)) || fail "status $status of: ${*:2}" "$(<said)"
  [[ $(wc -l <said) == 1 && $(<said) == "exp2ela: bad"*"$1"* ]] || fail "expected '$1'" "$(<said)"
}

test_bad_data_is_named() {
  ball ball.ela
  local load='gravity 0 -9810 0' good='measure 0 0 29 - -0.5 -'
  refused 'no measurement' '# nothing'
  refused 'no measurement' "$load"
  refused ":2: 'gravty' is no word of measurements (did you mean gravity?)" '' 'gravty 0 0 1'
  refused ":2: no number, expected measure x y z dx dy dz" "$load" 'measure 1 2 3 4 5'
  refused ":2: no axis measured" "$load" 'measure 1 2 3 - - -'
  refused ":2: 'x' is no number" "$load" 'measure 1 2 3 x - -'
  refused ":2: 'nan' is not finite" "$load" 'measure 1 2 3 nan - -'
  refused ":2: surplus word '7'" "$load" "$good 7"
  refused ":3: the place is 70 mm off the body" "$load" "$good" 'measure 0 0 100 - 1 -'
  refused ":3: what is measured there is held" "$load" "$good" 'measure -6 -6 -28.6304045 - 1 -'
  refused ':2: what is measured goes against the loads' "$load" 'measure 0 0 29 - 0.5 -'
  refused ':3: what is measured goes against the loads, here the most' "$load" "$good" 'measure 0 0 28 - 20 -' "$good"
  refused 'the loads move nothing' "$good"
  refused "known 'liver' is no material" "$load" "$good" 'known liver'
  refused 'all materials are known' "$load" "$good" 'known generic'
  refused 'selects no node' 'force z>99 0 0 1' "$good"
  refused '3 samples of a swing' 'swing 0 1' 'swing 0.1 2' 'swing 0.2 1'
  exp2ela --primitive sphere:8x6 -o net.ela
  expect_failure 1 exp2ela exp2ela --fit bad net.ela -o out.ela
  expect_failure 1 exp2ela exp2ela --fit absent ball.ela -o out.ela
  expect_failure 2 exp2ela exp2ela --fit - - -o out.ela
  expect_failure 2 exp2ela exp2ela --fit bad --list-materials
}

test_what_is_off_by_more_than_chance_is_named() {
  measure
  ball ball.ela
  sed '9s/[^ ]*$/3/' measured >off
  exp2ela --fit off ball.ela -o fitted.ela 2>said
  [[ $(<said) == 'exp2ela: warning: off:9: is off by more than chance'* ]] || fail "$(<said)"
}

# Both trials under both loads; two swings, one without load and one with.
test_the_silicone_beam_has_the_modulus_of_those_who_measured_it() {
  local data=$GEWEBE_SHARED/data/eth_beam
  [[ -d $data ]] || skip 'no measured beam'
  python3 - "$data" <<'END'
import csv, sys
n, cell = (10, 3, 3), 10
index = lambda i, j, k: i + (n[0] + 1) * (j + (n[1] + 1) * k)
with open('beam.mesh', 'w') as out:
    points = [(i, j, k) for k in range(n[2] + 1) for j in range(n[1] + 1) for i in range(n[0] + 1)]
    print('MeshVersionFormatted 2\nDimension 3\nVertices\n%d' % len(points), file=out)
    for p in points:
        print(*(c * cell for c in p), 0, file=out)
    tets = []
    for i in range(n[0]):
        for j in range(n[1]):
            for k in range(n[2]):
                for a, b in ((0, 1), (1, 2), (2, 0), (1, 0), (2, 1), (0, 2)):
                    at, t = [i, j, k], [(i, j, k)]
                    for step in (a, b, 3 - a - b):
                        at[step] += 1
                        t.append(tuple(at))
                    even = (a, b) in ((0, 1), (1, 2), (2, 0))
                    t = [index(*p) for p in t]
                    tets.append(t if even else [t[0], t[2], t[1], t[3]])
    print('Tetrahedra\n%d' % len(tets), file=out)
    for t in tets:
        print(*(c + 1 for c in t), 1, file=out)
    print('End', file=out)
places = ((100, 15, 36), (100, -6, 24), (100, 36, 6))
for swing in 'gravity', 'load52':
    with open(swing, 'w') as out:
        for case, force in (('gravity', 0), ('load52', -510120)):
            print('case\ngravity 0 0 -9807.09', file=out)
            if force:
                print('force "x>99 and z>29"', 0, 0, force, 'total', file=out)
            for trial in 'ab':
                rows = [[float(v) for v in r] for r in list(csv.reader(open(f'{sys.argv[1]}/{case}_{trial}.csv')))[1:]]
                rest = [r for r in rows if r[0] > rows[-1][0] - 0.5]
                for m, place in enumerate(places):
                    print('measure', *place, '- -', sum(r[1 + 3 * m] for r in rest) / len(rest) - rows[0][1 + 3 * m], file=out)
                if case == swing and trial == 'a':
                    z = [r[1] for r in rows]
                    first = next(i for i in range(len(z)) if abs(z[i] - z[0]) > 0.5 * abs(z[-1] - z[0]))
                    for r in rows[first:first + 200]:
                        print('swing', r[0], r[1], file=out)
END
  local swing
  for swing in gravity load52; do
    exp2ela --young 20000 --poisson 0.499 --density 1.07e-3 --fix 'x<1' --fit $swing --stats=$swing.stats beam.mesh -o beam.ela
  done
  python3 - <<'END'
import json
for swing, frequency, ratio in ('gravity', 7.76, (0.04, 0.055)), ('load52', 4.37, (0.052, 0.064)):
    fit = json.load(open(swing + '.stats'))['fit']
    assert abs(fit['young']['generic']['value'] / 263824 - 1) < 0.05, fit
    assert fit['solves'] <= 10, fit
    assert abs(fit['swing']['frequency'] / frequency - 1) < 0.01, fit
    assert ratio[0] <= fit['swing']['damping_ratio'] <= ratio[1], fit
END
}
