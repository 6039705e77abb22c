# examples/experiments: measured bodies, and how they are scored.
# shellcheck shell=bash disable=SC2317 # functions are called by name

test_pdms_rod() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  [[ -d $GEWEBE_SHARED/data/pdms_cylinder ]] || skip 'no data (scripts/data says where it comes from)'
  unset MAKEFLAGS MAKELEVEL
  cp "$GEWEBE_ROOT"/examples/experiments/pdms-rod/{Makefile,score.awk} .
  make -s DATA="$GEWEBE_SHARED/data/pdms_cylinder" >said 2>err || fail "$(<err)"
  awk '/^distance/ { exit !($2 > 2.2 && $2 < 3.3) }' said || fail "$(<said)"
}

test_scores_refuse_other_tables() {
  local score=$GEWEBE_ROOT/examples/experiments/pdms-rod/score.awk
  printf 'x0,y0,z0,x,y,z\n0,0,0,0,0,0\n0,0,182,0,-116.25,129\n' | awk -f "$score" | grep -qx 'distance 1.00 mm' || fail 'another distance'
  printf 'x,y,z\n0,0,0\n' | expect_failure 1 score.awk awk -f "$score"
  printf 'x0,y0,z0,x,y,z\n0,0,0,0,0,0\n' | expect_failure 1 score.awk awk -f "$score"
}

test_silicone_beam() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  unset MAKEFLAGS MAKELEVEL
  cp "$GEWEBE_ROOT"/examples/experiments/silicone-beam/{Makefile,*.awk} .
  make -s >said 2>err || fail "$(<err)"
  awk '/^mean/ { mean[++n] = $2 + 0 }
    END { exit !(n == 2 && mean[1] > -0.5 && mean[1] < 0.5 && mean[2] > -6 && mean[2] < -3) }' said || fail "$(<said)"
}

test_scores_of_markers_turn_with_the_end() {
  local score=$GEWEBE_ROOT/examples/experiments/silicone-beam/score.awk n
  n=$(printf 'x0,y0,z0,x,y,z\n100,15,0,100,15,0\n100,15,30,130,15,0\n100,0,24,100,0,23\n100,30,6,100,30,5\n' |
    awk -v measured='36 1 1' -f "$score" | grep -c '+0.0 %') || true
  [[ $n == 4 ]] || fail "an end that is turned by 90 degrees: $n lines"
  printf 'x,y,z\n0,0,0\n' | expect_failure 1 score.awk awk -v measured='1 1 1' -f "$score"
  printf 'x0,y0,z0,x,y,z\n0,0,0,0,0,0\n' | expect_failure 1 score.awk awk -v measured='1 1 1' -f "$score"
}

test_uterus() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  unset MAKEFLAGS MAKELEVEL
  cp "$GEWEBE_ROOT"/examples/experiments/uterus/{Makefile,*.awk} .
  make -s CELLS='6 5 4' PULLED='4 3 2' >said 2>err || fail "$(<err)"
  awk '{ off = $NF == "%" ? $(NF - 1) + 0 : 1e9; low = /^tension/ ? 0 : 15; high = /^tension/ ? 20 : 35; good += off > low && off < high }
    END { exit !(NR == 4 && good == 4) }' said || fail "$(<said)"
}

test_scores_of_forces_need_all() {
  local score=$GEWEBE_ROOT/examples/experiments/uterus/score.awk
  printf '%s\n' test,displacement,force tension,2.12,16.94 tension,4.24,40.41 tension,6.36,108.25 indentation,1.26,24.62 >forces
  awk -f "$score" forces | grep -qx 'indentation 1.26 mm: 24.62 mN, measured 12.31 mN, +100.0 %' || fail 'another score'
  head -3 forces | expect_failure 1 score.awk awk -f "$score"
}
