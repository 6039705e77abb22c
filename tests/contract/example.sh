# The example of examples/myoma, as a user runs it.
# shellcheck shell=bash disable=SC2317 # functions are called by name

# What make runs, by the first words of its commands.
commands() { make | sed -n 's/^\([a-z][-a-z0-9]*\) .*/\1/p' | tr '\n' ' '; }

test_myoma_is_made_once_and_only_what_changed_again() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  local file
  unset MAKEFLAGS MAKELEVEL
  cp "$GEWEBE_ROOT"/examples/myoma/{Makefile,*.particles,*.scene,*.awk} .
  make >log 2>&1 || fail 'the example fails:' "$(tail -3 log)"
  [[ $(tail -1 log) == *"$PWD/before.png and $PWD/after.png" ]] || fail 'the last line does not say where the pictures are' "$(tail -1 log)"
  ! cmp -s before.png after.png || fail 'the pull is not to be seen'
  # The surface with its myomas is one closed part.
  exp2ela --stats=stats uterus.ply -o /dev/null
  grep -q '"components":1,"boundary_edges":0' stats || fail 'the organ is not one closed part' "$(<stats)"

  local did
  did=$(commands)
  [[ $did == '' ]] || fail "a second make runs: $did"

  # Another comment: the surface is looked at again, stays as it is, and nothing behind it is made.
  echo '# a comment' >>organ.particles
  did=$(commands)
  [[ $did == 'metaball2vol ' ]] || fail "a comment makes more than the surface: $did"
  did=$(commands)
  [[ $did == '' ]] || fail "after a comment another make runs: $did"

  sed -i 's/^-3 /-4 /' myoma.particles
  did=$(make | sed -n 's/.* -o \([a-z]*\.[a-z0-9]*\)$/\1/p' | sort | tr '\n' ' ')
  [[ $did == 'after.png before.png pull.h5 touch.csv uterus.ela uterus.h5 uterus.ply ' ]] || fail "a moved myoma makes: $did"

  make -s clean
  for file in *; do
    [[ $file == log || $file == stats || -e $GEWEBE_ROOT/examples/myoma/$file ]] || fail "clean left $file"
  done
}

# Every closed organ of the shared data goes from its file to a picture of its pulled shape.
organ() { # NAME UNIT
  local file=$GEWEBE_SHARED/data/$1 nodes size
  [[ -f $file ]] || skip "no $1"
  exp2ela --unit "$2" "$file" -o organ.ela
  # The five uppermost nodes are pulled up by a tenth of the height.
  nodes=$(awk '/^nodes/ { n = 1; next } /^[a-z]/ { n = 0 } n && $8 != "xyz" { print $3, k++ }' organ.ela | sort -k1,1gr | sed -n '1,5s/.* //p' | paste -sd,)
  size=$(awk '/^nodes/ { n = 1; next } /^[a-z]/ { n = 0 } n { if (!k++ || $3 < low) low = $3; if ($3 > high) high = $3 } END { print (high - low) / 10 }' organ.ela)
  ffe-precompute --columns "$nodes" organ.ela -o organ.h5
  printf '%s\n' 'object organ organ.ela store=organ.h5' "displace organ $nodes 0 0 $size" step >organ.scene
  ffe-run -q organ.scene -o run.h5
  emboss-render --backend cpu --shade 0.7 --size 256 --distance "$(awk "BEGIN { print 32 * $size }")" organ.ela -o before.ppm
  emboss-render --backend cpu --shade 0.7 --size 256 --distance "$(awk "BEGIN { print 32 * $size }")" run.h5 -o after.ppm
  ! cmp -s before.ppm after.ppm || fail "$1: the pull is not to be seen"
  # A picture of an organ has many shades.
  [[ $(od -An -v -tu1 -w3 -j15 after.ppm | sort -u | wc -l) -gt 100 ]] || fail "$1: the picture is nearly empty"
}
test_organ_liver() { organ sofa_liver_smooth.obj cm; }
test_organ_liver_coarse() { organ sofa_liver_coarse.obj cm; }
test_organ_liver_gallbladder_portal() { organ ts_liver_gallbladder_portal.dxf mm; }
test_organ_spleen() { organ hubmap_F_spleen_uv.obj m; }
test_organ_colon() { organ gca90_large_intestine_20k.stl mm; }

# Tissue without coordinates and texture files.
test_solid_is_lit_from_the_side_of_the_light() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  unset MAKEFLAGS MAKELEVEL
  mkdir solid lung cholecystectomy
  cp "$GEWEBE_ROOT"/examples/solid/Makefile solid
  cp "$GEWEBE_ROOT"/examples/lung/textures.awk lung
  cp "$GEWEBE_ROOT"/examples/cholecystectomy/liver.particles cholecystectomy
  make -s -C solid SIZE=64 >log 2>&1 || fail 'the example fails:' "$(tail -3 log)"
  ! cmp -s solid/liver.png solid/left.png || fail 'the light is not to be seen'
  make -s -C solid clean
  [[ $(ls solid) == Makefile ]] || fail 'clean left files' "$(ls solid)"
}

# A tumour inside is not to be seen from outside, and is where the organ is cut open.
test_solid_mesh_shows_its_tumour_where_it_is_cut() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  unset MAKEFLAGS MAKELEVEL
  mkdir solid-mesh cholecystectomy
  cp "$GEWEBE_ROOT"/examples/solid-mesh/{Makefile,tumour.particles} solid-mesh
  cp "$GEWEBE_ROOT"/examples/cholecystectomy/liver.particles cholecystectomy
  make -s -C solid-mesh SIZE=96 VOXEL=5 CELL=8 >log 2>&1 || fail 'the example fails:' "$(tail -3 log)"
  cd solid-mesh || fail 'no folder'
  # Of the looks of the organ and of the tumour, how many triangles have which.
  looks() { emboss-render --backend cpu --size 8 --color 1=1,1,0 --stats=stats "$@" solid.vtu -o /dev/null 2>/dev/null && sed 's/.*"triangles_by_look":\[\([0-9,]*\)\].*/\1/' stats; }
  [[ $(looks) == *[1-9]*,0 ]] || fail 'the tumour reaches the surface, or nothing is there' "$(looks)"
  # shellcheck disable=SC2046 # two words
  [[ $(looks $(sed -n 's/^CUT = //p' Makefile)) == *,[1-9][0-9]* ]] || fail 'the cut misses the tumour'
  ! cmp -s whole.png open.png || fail 'the cut is not to be seen'
  rm stats
  make -s clean
  [[ $(echo *) == 'Makefile tumour.particles' ]] || fail 'clean left files' "$(ls)"
}

# One organ by every filter, small: fractions keep its volume, pictures differ.
test_antialias_draws_every_filter() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  local file
  unset MAKEFLAGS MAKELEVEL
  mkdir antialias myoma
  cp "$GEWEBE_ROOT"/examples/myoma/organ.particles myoma
  cp "$GEWEBE_ROOT"/examples/antialias/Makefile antialias
  cd antialias || fail 'no folder'
  make DIM=24 >../log 2>&1 || fail 'the example fails:' "$(tail -3 ../log)"
  ! cmp -s none.png exact.png || fail 'grey values are not to be seen'
  # Fractions give the volume at any resolution, box:6 nearly, 0 and 1 do not.
  metaball2vol --voxel 0.5 ../myoma/organ.particles | mc-opt | voxelize --antialias exact --dim 48 --stats=fine.json - -o fine.vdb
  awk -F, -v whole="$(sed -n 's/.*"volume":\([-+.e0-9]*\).*/\1/p' fine.json)" '
    { error[$1] = $2 / whole - 1; if (error[$1] < 0) error[$1] = -error[$1] }
    END { exit !(error["exact"] < 1e-8 && error["box"] < 1e-3 && error["none"] > 1e-5) }' volumes.csv ||
    fail 'volumes are off' "$(<volumes.csv)"
  rm fine.json fine.vdb
  make -s clean
  for file in *; do
    [[ $file == Makefile ]] || fail "clean left $file"
  done
}

# Figure 3-3 of the report, a part of it: what snapping saves grows like epsilon.
test_reduction_is_linear() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  local file
  unset MAKEFLAGS MAKELEVEL
  cp "$GEWEBE_ROOT"/examples/reduction/{Makefile,*.awk,*.gnuplot} .
  make DIMS=32 SEEDS=8 all check >log 2>&1 || fail 'the example fails:' "$(tail -3 log)"
  awk -F, 'NR > 1 { ++n; if (!($3 > 0.85 && $3 < 0.95)) bad = 1 } END { exit bad || n != 2 }' fit.csv ||
    fail 'the slope is not about 0.9' "$(<fit.csv)"
  # A bend is seen.
  sed -i 's/^32,0.3,[^,]*/32,0.3,0.5/' reduction.csv
  ! make DIMS=32 SEEDS=8 check >log 2>&1 || fail 'a bent line passes'
  make -s clean
  for file in *; do
    [[ $file == log || -e $GEWEBE_ROOT/examples/reduction/$file ]] || fail "clean left $file"
  done
}

# Triangles before and after snapping: fewer, but the same outline.
test_wireframe_draws_fewer_triangles() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  local file
  unset MAKEFLAGS MAKELEVEL
  mkdir wireframe myoma
  cp "$GEWEBE_ROOT"/examples/myoma/*.particles myoma
  cp "$GEWEBE_ROOT"/examples/wireframe/{Makefile,*.awk,*.gnuplot} wireframe
  cd wireframe || fail 'no folder'
  make VOXELS=5 5-plain.faces 5-half.faces 5-regularized.faces >../log 2>&1 || fail 'the example fails:' "$(tail -3 ../log)"
  faces() { grep -c '^$' "5-$1.faces"; }
  (($(faces half) * 10 < $(faces plain) * 7)) || fail "$(faces half) of $(faces plain) faces after snapping"
  width() { awk 'NF { if ($1 < low) low = $1; if ($1 > high) high = $1 } END { print high - low }' "5-$1.faces"; }
  awk "BEGIN { r = $(width half) / $(width plain); exit !(r > 0.98 && r < 1.02) }" || fail 'another outline'
  make -s VOXELS=5 clean
  for file in *; do
    [[ -e $GEWEBE_ROOT/examples/wireframe/$file ]] || fail "clean left $file"
  done
}

# Figure 4-9's scene, coarse: closed organs, two thirds of the nodes elastostatic, a grasp that is seen, and no warning.
test_cholecystectomy_is_made_of_particles() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  local file organ
  unset MAKEFLAGS MAKELEVEL
  cp "$GEWEBE_ROOT"/examples/cholecystectomy/{Makefile,*.tube,*.awk,*.scene,*.materials,liver.particles} .
  make SCALE=1.5 FRAMES=12 >log 2>&1 || fail 'the example fails:' "$(tail -3 log)"
  sed -n 's/^[0-9]* nodes, \(.*\) % of them elastostatic\.$/\1/p' log | awk '{ ok = $1 > 60 && $1 < 72 } END { exit !ok }' ||
    fail "not about 66 % are elastostatic" "$(tail -2 log)"
  for organ in liver gallbladder ducts arteries intestine; do
    exp2ela --stats=stats $organ.ela -o /dev/null
    grep -q '"boundary_edges":0' stats || fail "$organ is not closed" "$(<stats)"
  done
  ! cmp -s before.png after.png || fail 'the grasp is not to be seen'
  rm log stats
  make -s SCALE=1.5 FRAMES=12 clean
  for file in *; do
    [[ -e $GEWEBE_ROOT/examples/cholecystectomy/$file ]] || fail "clean left $file"
  done
}

# Figure 3-10: the curve bends at F0, and displacements give back the forces of its points.
test_two_step_gives_back_its_forces() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  local file
  unset MAKEFLAGS MAKELEVEL
  cp "$GEWEBE_ROOT"/examples/two-step/{Makefile,*.awk,*.gnuplot} .
  make all check >log 2>&1 || fail 'the example fails:' "$(tail -3 log)"
  # Displacements at f0 and 2 f0: slopes C1 and C1 - C2, or C2, where C2 = C1/4.
  awk -F, '$1 == "first" { first[$2] = $5 } $1 != "first" && $1 != "second" { u[$1, $2] = $5 }
    END { c = first[20000]; two = (u["two", 40000] - u["two", 20000]) / c; series = (u["series", 40000] - u["series", 20000]) / c
      exit !(u["two", 20000] == c && two > 0.7499999 && two < 0.7500001 && series > 0.2499999 && series < 0.2500001) }' two-step.csv ||
    fail 'other slopes' "$(grep 0000, two-step.csv)"
  # A wrong force is seen.
  sed -i '$s/[^,]*$/1/' inverse.csv
  ! make check >log 2>&1 || fail 'a wrong force passes'
  make -s clean
  for file in *; do
    [[ $file == log || -e $GEWEBE_ROOT/examples/two-step/$file ]] || fail "clean left $file"
  done
}

# A sphere is drawn along a liver: it is pushed away by all that it touches, by either method.
test_instrument_is_drawn_along() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  local file method
  unset MAKEFLAGS MAKELEVEL
  cp "$GEWEBE_ROOT"/examples/instrument/{Makefile,draw.scene,liver.particles} .
  for method in ela ffe; do
    make VOXEL=6 METHOD=$method >log 2>&1 || fail "the example fails with $method:" "$(tail -3 log)"
    # Touched from the way down to the end; without friction's share the force is up.
    awk -F, 'NR > 1 { up += $7 > 0; down += $7 < 0 } END { exit !(up > 30 && down == 0) }' force.csv ||
      fail "$method: the sphere is not pushed up" "$(<force.csv)"
    ! cmp -s frame-0.png frame-20.png || fail 'the sphere is not to be seen'
    make -s clean
  done
  for file in *; do
    [[ $file == log || -e $GEWEBE_ROOT/examples/instrument/$file ]] || fail "clean left $file"
  done
}

# A liver under its weight: what fills a net keeps its volume, where the same net without loses a tenth of it.
test_gravity_is_borne_by_what_fills_a_net() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  local file
  unset MAKEFLAGS MAKELEVEL
  cp "$GEWEBE_ROOT"/examples/gravity/{Makefile,*.awk,*.scene,*.particles} .
  make SIZE=300x90 VOXEL=5 CELL=14 >log 2>&1 || fail 'the example fails:' "$(tail -3 log)"
  share() { sed -n "s/^$1: *\\([0-9.]*\\) % of its volume\$/\\1/p" log; }
  awk -v net="$(share net)" -v filled="$(share filled)" -v solid="$(share solid)" 'BEGIN {
    exit !(net > 60 && net < 96 && filled > 99 && filled < 101 && solid > 98 && solid < 101) }' ||
    fail 'other volumes' "$(tail -4 log)"
  ! cmp -s before.png after.png || fail 'the weight is not to be seen'
  make -s clean
  for file in *; do
    [[ $file == log || -e $GEWEBE_ROOT/examples/gravity/$file ]] || fail "clean left $file"
  done
}

# A wedge with a tumour: it comes off with its piece of skin, closed, and the tumour in it.
test_a_tumour_is_cut_out_with_a_margin() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  local file
  unset MAKEFLAGS MAKELEVEL
  mkdir resection cholecystectomy
  cp "$GEWEBE_ROOT"/examples/resection/{Makefile,*.awk,*.scene,*.particles} resection
  cp "$GEWEBE_ROOT"/examples/cholecystectomy/liver.particles cholecystectomy
  cd resection || fail 'no folder'
  make SIZE=200x140 VOXEL=4 CELL=11 >log 2>&1 || fail 'the example fails:' "$(tail -3 log)"
  read -r specimen tumour margin < <(sed -n 's/^specimen \([0-9.]*\) ml, tumour in it \([0-9.]*\) ml, margin \([0-9.]*\) mm$/\1 \2 \3/p' log)
  awk -v s="$specimen" -v t="$tumour" -v m="$margin" 'BEGIN {
    exit !(s > 125 && s < 140 && t > 6 && t < 7 && m > 4 && m < 7) }' || fail 'other volumes' "$(tail -2 log)"
  awk -f "$GEWEBE_ROOT/tests/golden/skin_check.awk" specimen.ela >volume || fail 'the specimen is open:' "$(cat volume)"
  ! cmp -s wound.png off.png || fail 'it is not lifted off'
  ! cmp -s off.png halves.png || fail 'it is not cut in two'
  make -s clean
  for file in *; do
    [[ $file == log || $file == volume || -e $GEWEBE_ROOT/examples/resection/$file ]] || fail "clean left $file"
  done
}

# The relief of two pictures, as what light adds to the same look without heights: their correlation.
rims() { # FLAT A B (PPMs)
  python3 - "$@" <<'END'
import sys
def values(name):
    head, rest = open(name, 'rb').read().split(b'255\n', 1)
    return rest
flat, a, b = map(values, sys.argv[1:])
x = [p - f for p, f in zip(a, flat)]
y = [p - f for p, f in zip(b, flat)]
# Where one of them is no change both are background, or dark.
both = [(u, v) for u, v in zip(x, y) if u or v]
assert len(both) > 20000, len(both)
mx, my = (sum(c) / len(both) for c in zip(*both))
sxy = sum((u - mx) * (v - my) for u, v in both)
print(round(100 * sxy / (sum((u - mx) ** 2 for u, v in both) * sum((v - my) ** 2 for u, v in both)) ** 0.5))
END
}
test_lung_light_from_the_other_side_swaps_the_rims() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  command -v python3 >/dev/null || skip 'no python3'
  local same opposite light
  unset MAKEFLAGS MAKELEVEL
  cp "$GEWEBE_ROOT"/examples/lung/{Makefile,*.particles,*.awk} .
  make SIZE=200 >log 2>&1 || fail 'the example fails:' "$(tail -3 log)"
  # The example's own commands, for pictures that can be read here, without heights and by another light.
  command_for() { make -n -B SIZE=200 "$1.png" | grep "^emboss-render.* -o $1.png" | sed "s/ -o $1.png/ -o $2.ppm/"; }
  eval "$(command_for left left); $(command_for right right)"
  eval "$(command_for left flat | sed 's/--structure [^ ]*//')"
  light=$(command_for left near)
  eval "${light/--light 900,400,0/--light 850,500,100}"
  opposite=$(rims flat.ppm left.ppm right.ppm)
  ((opposite < -30)) || fail "light from the other side: the rims correlate by $opposite %, expected below -30"
  # That it can fail: light that stays on its side.
  same=$(rims flat.ppm left.ppm near.ppm)
  ((same > 50)) || fail "light from the same side: the rims correlate by $same %, expected over 50"
  echo "rims: $opposite % from the other side, $same % from the same side"
}

# The pictures that the repository shows are those that the examples make: who changes an example makes its pictures again, looks
# at them, and writes down what belongs together. (That a change of the programs changes a picture, the tests above don't see.)
test_pictures_belong_to_their_examples() {
  cp -r "$GEWEBE_ROOT"/examples .
  cd examples || fail 'no folder'
  check() { sha256sum --quiet --check pictures.sums 2>&1 && ! unlisted | grep .; }
  unlisted() { comm -13 <(sed 's/^[^ ]*  //' pictures.sums | sort) <(printf '%s\n' */pictures/* */Makefile | sort); }
  check || fail 'make the example, look at its pictures, then:' "  cd examples && sha256sum \$(git ls-files '*/*') > pictures.sums"
  # Another scene is seen, and so is a picture that nobody wrote down.
  echo '# a comment' >>pull/pull.scene
  ! check >/dev/null || fail 'an example that changed passes'
  sed -i '$d' pull/pull.scene
  check || fail 'the example as it was does not pass'
  cp lung/pictures/lung.png lung/pictures/another.png
  ! check >/dev/null || fail 'a picture that nobody wrote down passes'
}
