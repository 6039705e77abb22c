# exp2ela --accuracy: meshes that are as accurate as was asked for.
# shellcheck shell=bash disable=SC2317 # functions are called by name

box() { # FILE X Y Z
  local x y z
  for z in 0 "$4"; do for y in 0 "$3"; do for x in 0 "$2"; do echo "v $x $y $z"; done; done; done >"$1"
  printf 'f %s\n' '1 3 4 2' '5 6 8 7' '1 2 6 5' '3 7 8 4' '1 5 7 3' '2 4 8 6' >>"$1"
}

# A bar of 100 x 20 x 20 mm with exact sides: cubes of 5 mm, six tetrahedra each, as Medit mesh.
exact_bar() {
  awk 'BEGIN {
    n = 20; m = 4
    print "MeshVersionFormatted 2\nDimension 3\nVertices\n" (n + 1) * (m + 1) * (m + 1)
    for (k = 0; k <= m; ++k) for (j = 0; j <= m; ++j) for (i = 0; i <= n; ++i) print 5 * i, 5 * j, 5 * k, 0
    print "Tetrahedra\n" 6 * n * m * m
    split("1 2 4 2 1 4 4 1 2 1 4 2 2 4 1 4 2 1", way, " ") # orders of the axes, odd ones turned below
    for (k = 0; k < m; ++k) for (j = 0; j < m; ++j) for (i = 0; i < n; ++i)
      for (t = 0; t < 6; ++t) {
        a = way[3 * t + 1]; b = way[3 * t + 2]
        p = at(i, j, k, 0); q = at(i, j, k, a); r = at(i, j, k, a + b); s = at(i, j, k, 7)
        if (a == 1 && b == 2 || a == 2 && b == 4 || a == 4 && b == 1) print p, q, r, s, 0
        else print p, r, q, s, 0
      }
    print "End"
  }
  function at(i, j, k, c) {
    return 1 + i + c % 2 + (n + 1) * (j + int(c / 2) % 2 + (m + 1) * (k + int(c / 4)))
  }'
}

# The largest displacement in mm, which is the tip's.
tip() { ffe-run -q --estimate load.scene | awk '/^estimate/ { print $5 / $3 }'; }

# The tip of a bar sinks as it does with elements that have its exact shape: those of a lattice lack its edges.
test_a_bar_bends_as_much_as_it_should() {
  box bar.obj 100 20 20
  exact_bar >bar.mesh
  printf '%s\n' 'object bar bar.ela method=ffe' 'force bar x>99.9 0 0 -1e3 total' step >load.scene
  exp2ela -q --young 10000 --poisson 0.3 --fix 'x<0.1' bar.mesh -o bar.ela
  local exact percent
  exact=$(tip)
  for percent in 10 2; do
    exp2ela --solid --cell 8 --young 10000 --poisson 0.3 --fix 'x<0.1' --accuracy $percent% --for load.scene bar.obj -o bar.ela 2>table
    echo "$exact $(tip)" | awk -v most=$percent '{ e = ($2 / $1 - 1) * 100; exit !(e < most && e > -most) }' ||
      fail "the tip sinks by $(tip) mm instead of $exact mm, --accuracy $percent%" "$(<table)"
  done
  # The table: a heading, then a row for each mesh.
  grep -qx 'exp2ela: round  tetrahedra  step  quantity  .* value  .* mesh  .* shape  .* seconds' table || fail 'no heading:' "$(<table)"
  awk '/^exp2ela: +[0-9]/ { n += 1; if ($2 != n || !($3 > last) || $5 " " $6 " " $7 != "displacement of bar") exit 1; last = $3 } END { exit n < 2 }' table ||
    fail 'other rows:' "$(<table)"
}

# Pressed by a ball as much as by Hertz's law, up to the block's own size.
test_a_finger_feels_what_it_should() {
  box block.obj 80 80 40
  printf '%s\n' 'object block block.ela method=ffe' 'instrument finger sphere 5 40 40 45.2' step 'move finger 40 40 44' step >press.scene
  local force
  exp2ela -q --solid --young 10000 --poisson 0.45 --fix 'z<0.1' --accuracy 5% --for press.scene block.obj -o block.ela --stats=stats
  force=$(grep -o '"accuracy_force":[0-9.]*' stats | cut -d: -f2)
  awk -v force="$force" 'BEGIN { hertz = 4 / 3 * 10000 / (1 - 0.45 ^ 2) * sqrt(5); e = force / hertz - 1; exit !(e > -0.05 && e < 0.05) }' ||
    fail "the force is $force, expected 37385 within 5 %"
}
