# The example of examples/myoma, as a user runs it.
# shellcheck shell=bash disable=SC2317 # functions are called by name

# The commands that make would run, by their first words.
commands() { make -s -n | sed -n 's/^\([a-z][-a-z0-9]*\) .*/\1/p' | tr '\n' ' '; }

test_myoma_is_made_once_and_only_what_changed_again() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  local file
  cp "$GEWEBE_ROOT"/examples/myoma/{Makefile,*.particles,*.scene,*.awk} .
  make >log 2>&1 || fail 'the example fails:' "$(tail -3 log)"
  [[ $(tail -1 log) == *"$PWD/before.png and $PWD/after.png" ]] || fail 'the last line does not say where the pictures are' "$(tail -1 log)"
  cmp -s before.png after.png && fail 'the pull is not to be seen'
  # The surface with its myomas is one closed part.
  exp2ela --stats=stats uterus.ply -o /dev/null
  grep -q '"components":1,"boundary_edges":0' stats || fail 'the organ is not one closed part' "$(<stats)"

  touch -d '1 minute ago' ./*.particles ./*.scene ./*.awk
  [[ $(commands) == 'awk ' ]] || fail "a second make would run: $(commands)" # the line about the force

  # Another comment: the surface is looked at again, stays as it is, and nothing behind it is made.
  echo '# a comment' >>organ.particles
  make >log
  [[ $(grep -c . log) == 3 && $(head -1 log) == metaball2vol* ]] || fail 'a comment makes more than the surface:' "$(<log)"
  [[ $(commands) == 'awk ' ]] || fail "after a comment another make would run: $(commands)"

  sleep 0.01
  sed -i 's/^3 /4 /' myoma.particles
  make -n >log
  ! grep -q 'organ.particles\|voxelize\|tissue.awk' log || fail 'a moved myoma makes the organ again:' "$(<log)"
  [[ $(grep -c 'csg\|exp2ela\|ffe-precompute\|ffe-run\|emboss-render' log) == 7 ]] || fail 'a moved myoma must make seven things again:' "$(<log)"

  make -s clean
  for file in *; do
    [[ $file == log || $file == stats || -e $GEWEBE_ROOT/examples/myoma/$file ]] || fail "clean left $file"
  done
}

# Every closed organ of the shared data goes from its file to a picture of its pulled shape.
organ() { # NAME UNIT
  local file=$GEWEBE_SHARED/data/$1
  [[ -f $file ]] || skip "no $1"
  exp2ela --unit "$2" "$file" -o organ.ela
  ffe-precompute --columns 10,20,30,40,50 organ.ela -o organ.h5
  # Pulled by a tenth of its size along x.
  local size
  size=$(awk '/^nodes/ { n = $2; next } n-- > 0 { if (!seen++ || $1 < low) low = $1; if ($1 > high) high = $1 } END { print (high - low) / 10 }' organ.ela)
  printf '%s\n' 'object organ organ.ela store=organ.h5' "displace organ 10,20,30,40,50 $size 0 0" step >organ.scene
  ffe-run -q organ.scene -o run.h5
  emboss-render --backend cpu --size 256 --to ppm organ.ela -o before.ppm
  emboss-render --backend cpu --size 256 --to ppm run.h5 -o after.ppm
  cmp -s before.ppm after.ppm && fail "$1: the pull is not to be seen"
  # A picture of an organ covers a good part of it and is no single colour.
  [[ $(tail -c +16 after.ppm | od -An -v -tu1 -w3 | sort -u | head -100 | wc -l) == 100 ]] || fail "$1: the picture is nearly empty"
}
test_organ_liver() { organ sofa_liver_smooth.obj cm; }
test_organ_liver_coarse() { organ sofa_liver_coarse.obj cm; }
test_organ_liver_gallbladder_portal() { organ ts_liver_gallbladder_portal.dxf mm; }
test_organ_spleen() { organ hubmap_F_spleen_uv.obj m; }
test_organ_colon() { organ gca90_large_intestine_20k.stl mm; }
