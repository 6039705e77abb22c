# Models against a count of others, and the example of examples/pull.
# shellcheck shell=bash disable=SC2317 # functions are called by name

# Reads 3D faces of a DXF file by their group codes, nothing else: nodes, edges and parts connected by edges, with
# points joined at equal position within a layer, or everywhere.
python_counts() { # FILE layer|all
  python3 - "$1" "$2" <<'PYTHON'
import struct, sys

lines = open(sys.argv[1]).read().split("\n")
pairs = [(int(lines[i]), lines[i + 1].strip()) for i in range(0, len(lines) - 1, 2)]
faces, face = [], None
for code, value in pairs:
    if code == 0:
        if face is not None:
            faces.append(face)
        face = {} if value == "3DFACE" else None
    elif face is not None:
        face[code] = value
number, edges, parent = {}, set(), []
def find(i):
    while parent[i] != i:
        i = parent[i]
    return i
def single(text):
    return struct.unpack("f", struct.pack("f", float(text)))[0]
for face in faces:
    corners = []
    for k in range(4):
        place = tuple(single(face[10 * axis + k]) for axis in (1, 2, 3))
        key = (face[8], place) if sys.argv[2] == "layer" else place
        if key not in number:
            parent.append(len(number))
            number[key] = len(number)
        if number[key] not in corners:
            corners.append(number[key])
    for a, b in zip(corners, corners[1:] + corners[:1]):
        edges.add((min(a, b), max(a, b)))
        x, y = sorted((find(a), find(b)))
        parent[y] = x
print(len(number), len(edges), sum(find(i) == i for i in range(len(parent))))
PYTHON
}
our_counts() { # FILE WELD
  exp2ela -q --centrals 0 --weld "$2" "$1" -o /dev/null --stats=stats.json
  sed 's/.*"nodes":\([0-9]*\),.*"springs_e":\([0-9]*\),.*"components":\([0-9]*\),.*/\1 \2 \3/' stats.json
}

test_springs_of_a_dxf_are_those_that_python_counts() {
  local file=$GEWEBE_SHARED/data/ts_liver_gallbladder_portal.dxf
  [[ -f $file ]] || skip 'no ts_liver_gallbladder_portal.dxf'
  command -v python3 >/dev/null || skip 'no python3'
  [[ $(our_counts "$file" auto) == '15696 47076 3' ]] || fail "other parts: $(our_counts "$file" auto)"
  [[ $(our_counts "$file" auto) == "$(python_counts "$file" layer)" ]] || fail "Python counts $(python_counts "$file" layer)"
  [[ $(our_counts "$file" all) == '15651 46982 1' ]] || fail "other counts of one part: $(our_counts "$file" all)"
  [[ $(our_counts "$file" all) == "$(python_counts "$file" all)" ]] || fail "Python counts $(python_counts "$file" all)"
}

# As a user runs it, small; and with the organ of the shared data, where it is.
pull() { # VARIABLE=VALUE...
  unset MAKEFLAGS MAKELEVEL
  mkdir -p pull
  cp "$GEWEBE_ROOT"/examples/pull/{Makefile,*.particles,*.scene} pull
  make -C pull LOOK='--backend cpu --shade 0.85 --size 160' "$@" >log 2>&1 || fail 'the example fails:' "$(tail -3 log)"
  ! cmp -s pull/organ-before.png pull/organ-after.png || fail 'the pull is not to be seen'
}
test_pull_shows_particles_and_organ() {
  local file
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  pull
  ! cmp -s pull/five-before.png pull/five-after.png || fail 'the pull is not to be seen'
  exp2ela --stats=stats.json pull/organ.ela -o /dev/null
  grep -q '"components":2,"boundary_edges":0' stats.json || fail 'not a liver and a gallbladder' "$(<stats.json)"
  make -s -C pull clean
  for file in pull/*; do
    [[ -e $GEWEBE_ROOT/examples/$file ]] || fail "clean left $file"
  done
}
test_pull_shows_the_liver_of_a_dxf() {
  local file=$GEWEBE_SHARED/data/ts_liver_gallbladder_portal.dxf
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  [[ -f $file ]] || skip 'no ts_liver_gallbladder_portal.dxf'
  pull organ-before.png organ-after.png ORGAN="$file" PICK='component:1 and y>228' PULL='0 50000000 -25000000' \
    LOBE='component:0 and x<-30' LIFT='-200000 0 500000' EYE=-200,540,80 TARGET=35,178,365
}
