# `gewebe --makefile`, as a user runs it.
# shellcheck shell=bash disable=SC2317 # functions are called by name

test_standard_makefile() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  unset MAKEFLAGS MAKELEVEL
  local status=0 small='VOXEL=4 CELL=20 STEPS=2'
  gewebe --makefile >Makefile || fail 'no Makefile'
  # As it is, with a ball in place of an organ.
  # shellcheck disable=SC2086
  make -s $small >said 2>err || fail "$(<err)"
  head -c 4 organ.ply | grep -q ply || fail 'no surface'
  grep -q '<svg' force.svg || fail 'no curve'
  grep -q '<html' run.html || fail 'no page'
  # Depths count from the first frame with a contact.
  awk -F, 'NR == 1 { for (k = 1; k <= NF; ++k) column[$k] = k; next } { force = $column["ball.force [uN]"]; depth = $column["ball.depth [mm]"] }
    END { exit !(NR == 4 && force > 5000 && depth > 2.5 && depth < 2.6) }' run.csv || fail "$(<run.csv)"
  # What is there is not made again; another option makes what depends on it.
  touch -d '1 hour ago' organ.particles organ.options organ.vdb
  touch -d '50 minutes ago' organ.ply organ.ela press.scene run.h5 run.csv
  touch -d '40 minutes ago' force.svg run.html
  # shellcheck disable=SC2086
  make $small >said 2>&1 || fail "$(<said)"
  [[ $(find . -name 'run.[hc]*' -newermt '30 minutes ago') == '' ]] || fail 'made again' "$(<said)"
  # shellcheck disable=SC2086
  make -s $small DEPTH=2 run.csv >said 2>&1 || fail "$(<said)"
  awk -F, 'NR == 1 { for (k = 1; k <= NF; ++k) column[$k] = k; next } { depth = $column["ball.depth [mm]"] } END { exit !(depth > 1 && depth < 1.1) }' run.csv ||
    fail "$(<run.csv)"
  # A mesh and a label volume in its place; a label that is not there is an error, and the volume of before is out of date.
  cp organ.ply mesh.ply
  # shellcheck disable=SC2086
  make -s $small INPUT=mesh.ply organ.vdb >said 2>&1 || fail "$(<said)"
  cp "$GEWEBE_ROOT"/tests/golden/in/label.nrrd .
  make -s VOXEL=1 INPUT=label.nrrd LABEL=3 organ.vdb >said 2>&1 || fail "$(<said)"
  make -s VOXEL=1 INPUT=label.nrrd LABEL=99 organ.vdb >said 2>err || status=$?
  if ((status != 2)) || ! grep -q label err || [[ organ.vdb -nt organ.options ]]; then fail "status $status" "$(<err)"; fi
}
