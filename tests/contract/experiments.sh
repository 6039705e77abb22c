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
