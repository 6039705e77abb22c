# examples/cohort, as a user runs it.
# shellcheck shell=bash disable=SC2317 # functions are called by name

test_every_organ_has_its_row() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  unset MAKEFLAGS MAKELEVEL
  local status=0 organs
  cp "$GEWEBE_ROOT"/examples/cohort/{Makefile,*.awk} .
  cp "$GEWEBE_ROOT/examples/gravity/liver.particles" .
  printf '0 0 0 60\n' >ball.particles
  cp "$GEWEBE_ROOT/tests/golden/in/open.ply" .
  metaball2vol --voxel 3 ball.particles | mc-opt -o ball.ply
  organs='liver=liver.particles ball=ball.particles mesh=ball.ply open=open.ply gone=gone.obj'
  # One that fails for another reason than its file is tried again.
  mkdir bin
  printf '#!/bin/sh\necho mc-opt: out of memory >&2\nexit 1\n' >bin/mc-opt
  chmod +x bin/mc-opt
  ! PATH=$PWD/bin:$PATH make ORGANS='ball=ball.particles' CELL=15 >said 2>err || fail 'a failure is none'
  grep -q '^ball failed: mc-opt: out of memory' err || fail "$(<err)"
  rm -r bin
  make ORGANS="$organs" CELL=15 >said 2>err || status=$?
  ((status == 2)) || fail "status $status" "$(<err)"
  cut -d, -f1 cohort.csv | paste -sd ' ' | grep -qx 'organ liver ball mesh open gone' || fail "$(<cohort.csv)"
  grep -q '^open,,,,,,,,,voxelize: open.ply: the mesh is open' cohort.csv || fail "$(<cohort.csv)"
  grep -q '^gone failed: there is no gone.obj' err || fail "$(<err)"
  # A ball of 30 mm, in coarse cells, by whichever way: its volume, below 113 cm3, its mass by the density of liver, a force.
  awk -F, '$1 == "ball" || $1 == "mesh" { if ($2 > 100 && $2 < 113 && $7 > 1.05 * $2 && $7 < 1.07 * $2 && $8 > 1 && $5 > 50) ++n } END { exit n != 2 }' cohort.csv ||
    fail "$(<cohort.csv)"
  # What is there is not made again; what failed is tried.
  touch -d '1 hour ago' liver.vdb ball.vdb mesh.vdb
  touch -d '2 hours ago' ./*.organ ./*.particles ball.ply
  rm err
  make ORGANS="${organs/gone=gone.obj/gone=ball.ply}" CELL=15 >said 2>err || status=$?
  grep -q '^gone,10[0-9]' cohort.csv || fail "$(<cohort.csv)"
  [[ $(find . -name '*.vdb' -newermt '30 minutes ago' | sort | paste -sd ' ') == ./gone.vdb ]] || fail 'made again' "$(ls -l ./*.vdb)"
  # Another particle is another organ.
  echo '0 0 20 60' >>ball.particles
  make ORGANS='ball=ball.particles' CELL=15 >said || fail "$(<said)"
  awk -F, '$1 == "ball" { exit !($2 > 120) }' cohort.csv || fail "$(<cohort.csv)"
  make -s clean ORGANS="$organs"
  rm said err
  [[ $(printf '%s\n' * | paste -sd ' ') == 'Makefile ball.particles ball.ply ends.awk liver.particles open.ply table.awk' ]] || fail "clean left $(printf '%s ' *)"
}

test_snakemake_makes_the_same_table() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  command -v snakemake >/dev/null || skip 'no snakemake'
  unset MAKEFLAGS MAKELEVEL
  local organs='ball=ball.particles mesh=ball.ply'
  cp "$GEWEBE_ROOT"/examples/cohort/{Makefile,Snakefile,*.awk} .
  printf '0 0 0 60\n' >ball.particles
  metaball2vol --voxel 3 ball.particles | mc-opt -o ball.ply
  make -s ORGANS="$organs" CELL=15 >said || fail "$(<said)"
  cut -d, -f1-8 cohort.csv >expected
  make -s clean ORGANS="$organs"
  snakemake -q -j2 --config organs="$organs" cell=15 >said 2>&1 || fail "$(<said)"
  cut -d, -f1-8 cohort.csv | cmp - expected || fail "$(<cohort.csv)"
  # Another cell is another organ; what fails is named, with what the program said.
  snakemake -q -j2 --config organs="$organs" cell=20 >said 2>&1 || fail "$(<said)"
  ! cut -d, -f1-8 cohort.csv | cmp -s - expected || fail 'another cell makes nothing'
  cp "$GEWEBE_ROOT/tests/golden/in/open.ply" .
  ! snakemake -q -j2 --config organs="open=open.ply" >said 2>&1 || fail 'a failure is none'
  grep -q 'voxelize: open.ply: the mesh is open' said || fail "$(<said)"
}
