# Cuts in a scene: answers as text and frames, events, wrong cuts, records, and the example.
# shellcheck shell=bash disable=SC2317 # functions are called by name

need() {
  local tool
  for tool in "$@"; do
    command -v "$tool" >/dev/null || skip "no $tool"
  done
}

# ball.ela: a ball of 10 mm, held below.
ball() {
  exp2ela --primitive sphere:24x12 --size 10 --to obj >ball.obj
  exp2ela --bend --centrals 0 --fix 'z<-3' ball.obj -o ball.ela
}

scene() {
  printf '%s\n' 'object still ball.ela method=ffe' 'object moving ball.ela' 'emit shapes' 'emit forces' 'gravity 0 0 -981' \
    'force still "z>9" 0 0 20' 'instrument knife blade -6 0.5 14 -6 0.5 6' 'step 0.01' 'move knife 6 0.5 14 over 0.05' \
    'run 0.06 every 0.01' 'at 0.065 cut moving plane 0 0 4 0 0 1' 'step 0.01' 'cut still springs "z>8" "z<=8"' 'step 0.01' \
    'tear moving 0.4' 'restore still' 'step 0.01'
}

test_answers_tell_what_was_cut() {
  need ffe-run exp2ela
  ball
  scene >ball.scene
  ffe-run --events log.csv ball.scene >answers
  grep -qE '^cut still springs [0-9]+ doubled [1-9][0-9]* nodes [0-9]+$' answers || fail 'the blade cut nothing' "$(grep -c '' answers)"
  grep -qE '^part moving moving\.1 nodes [0-9]+$' answers || fail 'no part came off'
  grep -qE '^part still still\.1 nodes [0-9]+$' answers || fail 'no part of the springs came off'
  grep -qE '^restored still nodes' answers || fail 'not restored'
  # Triangles follow where a surface has changed, with nodes that there are.
  awk '$1 == "triangles" { name = $2; n = $3; most = 0
         for (i = 0; i < n; i++) { getline; for (k = 1; k <= 3; k++) if ($k > most) most = $k }
         largest[name] = most; ++told }
       $1 == "shapes" && largest[$2] >= $3 { bad = 1 }
       END { exit bad || told < 4 }' answers || fail 'a triangle names a node that is not there'
  grep -q '^0.065,cut,moving,' log.csv || fail 'the events do not tell the cut' "$(<log.csv)"
  grep -q ',severed,still,' log.csv || fail 'the events do not tell what the blade severed'
  grep -q ',part,moving,.*,moving.1,' log.csv || fail 'the events do not tell the part'
  # The same bytes for any number of threads, and from a record.
  ffe-run -j1 --record again.scene ball.scene | cmp - answers
  ffe-run -j2 again.scene | cmp - answers
}

test_frames_tell_the_same() {
  need ffe-run exp2ela python3
  ball
  scene >ball.scene
  ffe-run ball.scene >answers
  ffe-run --binary ball.scene >frames
  python3 - <<'P'
import struct
data, kinds, at = open('frames', 'rb').read(), {}, 0
nodes, largest = {}, {}
while at < len(data):
    magic, kind, thing, step, count = struct.unpack_from('<IIIQQ', data, at)
    assert magic == 0x46425747
    values = struct.unpack_from('<%dI' % count, data, at + 28)
    at += 28 + 4 * count
    kinds[kind] = kinds.get(kind, 0) + 1
    if kind == 11:
        largest[thing] = max(values, default=0)
    if kind == 0:
        nodes[thing] = count // 3
        assert largest.get(thing, 0) < nodes[thing]
text = [line.split()[0] for line in open('answers') if line[0].isalpha()]
for kind, word in (7, 'cut'), (8, 'part'), (9, 'loose'), (10, 'restored'), (11, 'triangles'), (0, 'shapes'):
    assert kinds.get(kind, 0) == text.count(word), (word, kinds)
P
}

test_a_wrong_cut_changes_nothing() {
  need ffe-run exp2ela
  ball
  printf '%s\n' 'object b ball.ela method=ffe' 'force b "z>9" 0 0 20' 'emit shapes' 'step 0.01' >before
  printf '%s\n' 'cut b plane 0 0 99 0 0 1' 'cut b springs 0' 'cut b springs z<-3 all' 'cut c springs all' 'restore b' 'tear b -1' >wrong
  echo 'step 0.01' >after
  cat before after | ffe-run >calm
  ! cat before wrong after | ffe-run --serve >answers 2>stderr.txt || fail 'wrong lines and status 0'
  [[ $(grep -c '^error ' answers) == 6 ]] || fail 'not 6 errors:' "$(grep '^error' answers)"
  ! grep '^error' answers | grep -v 'expected' || fail 'an error that does not say what was expected'
  grep -v '^error ' answers | cmp - calm || fail 'a wrong cut changed something'
}

test_incision_opens_and_the_lobe_falls() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  need ffe-run exp2ela mc-opt metaball2vol emboss-render
  unset MAKEFLAGS MAKELEVEL
  cp "$GEWEBE_ROOT"/examples/incision/{Makefile,*.particles,*.scene,*.awk} .
  make VOXEL=6 LOOK='--backend cpu --shade 0.85 --size 128' >log 2>&1 || fail 'the example fails:' "$(tail -3 log)"
  ! cmp -s incision-1.png incision-2.png || fail 'the opening is not to be seen'
  ! cmp -s lobe-0.02.png lobe-0.14.png || fail 'the fall is not to be seen'
  grep -q '^part liver liver.1 ' lobe.answers || fail 'no lobe came off'
  make -s clean
}

# Where the skin passes through itself no curve parts it: the line says so and the scene goes on; without a skin, or as a
# net, the same body is cut there.
test_a_cut_where_the_surface_passes_through_itself() {
  need ffe-run exp2ela
  { echo 'object o two.ela'; printf 'cut o plane 4.5 0 0 1 0 0%s\n' '' ' along=faces'; printf '%s\n' 'step 0.01' 'cut o plane 1 0 0 1 0 0.1' 'step 0.01'; } >in.scene
  exp2ela -q --primitive sphere:32x20 --size 10 --to obj |
    awk '$1 == "v" { points[++n] = $2 " " $3 " " $4; x[n] = $2; y[n] = $3; z[n] = $4 }
      $1 == "f" { for (k = 2; k < 5; ++k) { split($k, a, "/"); f[3 * m + k] = a[1] } ++m }
      END { for (i = 1; i <= n; ++i) print "v", points[i]
        for (i = 1; i <= n; ++i) print "v", x[i] + 9, y[i] + 0.37, z[i] + 0.21
        for (b = 0; b <= n; b += n) for (t = 0; t < m; ++t) print "f", f[3 * t + 2] + b, f[3 * t + 3] + b, f[3 * t + 4] + b }' >two.obj
  local method
  exp2ela -q --solid --rule winding --cell 2 --unit mm --fix 'x<-4' two.obj -o two.ela
  for method in ffe ela; do
    sed "1s/$/ method=$method/" in.scene | ffe-run --serve >answers 2>message && fail 'a wrong line is none'
    [[ $(grep -c '^error [23]: object o: the skin can.t be cut there: ' answers) == 2 ]] || fail "$(<answers)"
    [[ $(grep '^error' answers | sed 's/.*expected //' | sort -u) == 'two sheets: another plane, or a model without its skin (exp2ela --no-skin)' ]] || fail "$(<answers)"
    [[ $(grep -c '^step ' answers) == 2 && $(grep -c '^cut o springs 0 doubled ' answers) == 1 ]] || fail 'it does not go on:' "$(<answers)"
  done
  # Elements alone, and the net: a result.
  exp2ela -q --solid --no-skin --rule winding --cell 2 --unit mm --fix 'x<-4' two.obj -o two.ela
  sed -i '3d' in.scene
  ffe-run --serve in.scene >answers || fail "$(<answers)"
  [[ $(grep -c '^cut o springs 0 doubled ' answers) == 2 ]] || fail "$(<answers)"
  exp2ela -q --unit mm --fix 'x<-4' two.obj -o two.ela
  ffe-run --serve in.scene >answers || fail "$(<answers)"
  [[ $(grep -c '^cut o springs ' answers) == 2 && $(grep -c '^part o o.1 ' answers) -ge 1 ]] || fail "$(<answers)"
}
