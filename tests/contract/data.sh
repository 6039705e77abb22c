# scripts/data: where the real organs come from, and whether they are there.
# shellcheck shell=bash

test_every_file_that_tests_name_is_told() {
  local name
  "$GEWEBE_ROOT/scripts/data" "$PWD" >said.txt || fail "status $?" "$(<said.txt)"
  ! grep -q ': there' said.txt || fail 'there is something in an empty folder' "$(<said.txt)"
  while read -r name; do
    grep -q "^$name: absent$" said.txt || fail "a test reads $name, of which scripts/data says nothing"
  done < <(grep -rhoE '\b(sofa|ts|hubmap|gca90|mcpro|eth)_[A-Za-z0-9_]+\.(obj|stl|dxf|png|nii\.gz|json)|malformed_(assimp|trimesh)|dxf_assimp|eth_beam|pdms_cylinder' \
    "$GEWEBE_ROOT"/tests/unit "$GEWEBE_ROOT"/tests/contract "$GEWEBE_ROOT"/tests/golden/cases | sort -u)
}

test_another_file_is_seen() {
  mkdir -p data/eth_beam
  echo 1 >data/mcpro_cells.json
  echo 1 >data/eth_beam/gravity_a.csv
  ! "$GEWEBE_ROOT/scripts/data" "$PWD" >said.txt || fail 'passed'
  [[ $(grep ': another file$' said.txt) == $'mcpro_cells.json: another file\neth_beam: another file' ]] || fail "$(<said.txt)"
}

test_what_is_there_is_right() {
  [[ -d $GEWEBE_SHARED/data ]] || skip 'no data (scripts/data says where it comes from)'
  "$GEWEBE_ROOT/scripts/data" "$GEWEBE_SHARED" >said.txt || fail 'other files:' "$(grep -A 3 ': another file' said.txt)"
}
