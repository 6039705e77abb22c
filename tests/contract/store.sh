# Stiffness stores: what other programs read in them, equal bytes, refusals.
# shellcheck shell=bash disable=SC2317 # functions are called by name

# cube.ela: a cube of 2 mm whose lower corners are held.
held_cube() {
  cube >cube.off
  exp2ela --bend --fix 'z<0' --name cube cube.off -o cube.ela
  rm cube.off
}

test_h5py_reads_matrix_factor_and_columns() {
  local python
  python=$(python_with_h5py) || skip 'no h5py for python3'
  held_cube
  ffe-precompute --columns all cube.ela -o cube.h5
  cat >read.py <<'PYTHON'
import h5py, numpy
store = h5py.File("cube.h5", "r")["cube"]
p, i, x = (store["K"][name][:] for name in ("p", "i", "x"))
n = len(p) - 1
K = numpy.zeros((n, n))
for c in range(n):
    K[i[p[c]:p[c+1]], c] = K[c, i[p[c]:p[c+1]]] = x[p[c]:p[c+1]]
axis, columns = store["K/axis"][:], store["columns"]
C = columns["values"][:].reshape(-1, columns["values"].shape[2])[:, axis][axis]
assert n == store.attrs["order"] and n >= 12
assert abs(K @ C - numpy.eye(n)).max() < 1e-12, abs(K @ C - numpy.eye(n)).max()

l = {name: store["L"][name][:] for name in store["L"]}
L = numpy.zeros((n, n))
for k in range(len(l["super"]) - 1):
    rows = l["s"][l["pi"][k]:l["pi"][k+1]]
    own = range(l["super"][k], l["super"][k+1])
    L[numpy.ix_(rows, own)] = l["x"][l["px"][k]:l["px"][k+1]].reshape(len(own), len(rows)).T
L = numpy.tril(L)
assert abs(L @ L.T - K[numpy.ix_(l["Perm"], l["Perm"])]).max() < 1e-12 * abs(K).max()
K[0, 0] *= 1 + 1e-9 # the check can fail
assert not abs(K @ C - numpy.eye(n)).max() < 1e-12
PYTHON
  "$python" read.py || fail 'h5py reads something else'
  rm read.py cube.ela cube.h5
}

test_lists_of_64_bits_are_read_as_well() {
  local python
  python=$(python_with_h5py) || skip 'no h5py for python3'
  held_cube
  ffe-precompute --columns all cube.ela -o cube.h5
  cp cube.h5 wide.h5
  cat >widen.py <<'PYTHON'
import h5py, numpy

def crc32c(data):
    value = 0xFFFFFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ 0x82F63B78 * (value & 1)
    return value ^ 0xFFFFFFFF

with h5py.File("wide.h5", "r+") as file:
    for group, names in (("cube/K", "p i axis"), ("cube/L", "Perm ColCount super pi px s")):
        for name in names.split():
            old = file[group][name]
            assert old.dtype == numpy.uint32
            assert old.attrs["crc32c"] == crc32c(old[:].tobytes())
            wide = old[:].astype("<i8")
            del file[group][name]
            file[group][name] = wide
            file[group][name].attrs["crc32c"] = numpy.uint32(crc32c(wide.tobytes()))
PYTHON
  "$python" widen.py || fail 'lists can not be widened'
  (($(stat -c %s wide.h5) > $(stat -c %s cube.h5))) || fail 'nothing is wider'
  local store
  for store in cube wide; do
    printf 'object c cube.ela store=%s.h5\nforce c 5 1 2 3\ngravity 0 0 -9810\nstep 1\n' $store >"$store.scene"
    ffe-run "$store.scene" -o "$store.csv"
  done
  [[ -s cube.csv ]] || fail 'no answer'
  cmp cube.csv wide.csv
  ffe-precompute --info wide.h5 >/dev/null
}

# Names that stand in stores of every kind, as h5dump lists them, and names that stand on the page are the same.
test_the_page_names_what_stands_in_a_store() {
  has h5dump || skip 'no h5dump'
  held_cube
  exp2ela --primitive sphere:8x6 --size 30 --solid --cell 20 --fix 'z<-20' --name solid -o solid.ela -q
  ffe-precompute --columns all solid.ela -o surface.h5
  ffe-precompute --columns all --rows all solid.ela -o all.h5
  ffe-precompute --columns all --compress 1e-3 solid.ela -o compressed.h5
  ffe-precompute --columns all cube.ela -o stage2.h5
  ffe-precompute --stage 2 --columns all --compress 1e-3 cube.ela -o stage2.h5
  ffe-precompute --columns all --shard 1/2 cube.ela -o part.h5
  ffe-precompute --columns 0,1 --method relax cube.ela -o relax.h5
  ffe-precompute --columns 0 --method relax-fixed --steps 9 cube.ela -o fixed.h5
  local store
  for store in *.h5; do
    h5dump -n 1 "$store" | sed -nE 's,^ *(group|dataset|attribute) +/(cube|solid)?/?,,p'
  done | tr / '\n' | grep . | LC_ALL=C sort -u >stand
  named() { # FILE: the page's names: items, words in the text, headings of groups
    sed -nE '/^\.Sh EXAMPLES/q
      s/^\.(It )?Ic (.*)/\2/p; s/^\.Ql ([^ ]*).*/\1/p; s/^\.Ss ([KL]|columns|compressed|stage2)(,.*)?$/\1/p' "$1" |
      sed 's/ Bq.*//' | tr -s ' ,.()' '\n' | grep . | LC_ALL=C sort -u
  }
  page() { named "$1" | diff - stand; }
  page "$GEWEBE_ROOT/man/stiffness_store.5" || fail 'the page names (<) other things than stand in stores (>)'
  sed '/^\.Ic bound$/d; /^\.It Ic bound/d' "$GEWEBE_ROOT/man/stiffness_store.5" >less
  ! page less >/dev/null || fail 'a name that is missing on the page is not seen'
  sed 's/^\.It Ic first/.It Ic firsts/' "$GEWEBE_ROOT/man/stiffness_store.5" >other
  ! page other >/dev/null || fail 'a name that no store has is not seen'
}

test_equal_models_make_equal_bytes() {
  held_cube
  ffe-precompute -j1 --columns surface cube.ela -o a.h5
  sleep 1.1 # a time stamp would show
  ffe-precompute -j2 --columns surface cube.ela -o b.h5
  cmp a.h5 b.h5 || fail 'other bytes from run to run'
  if has h5diff; then
    h5diff a.h5 b.h5 || fail 'h5diff sees a difference'
  fi
  sed 's/^\(0 1 e\) [^ ]*/\1 3/' cube.ela >stiffer.ela
  ffe-precompute --columns surface stiffer.ela -o b.h5
  ! cmp -s a.h5 b.h5 || fail 'another model made the same bytes'
  ffe-precompute --columns surface cube.ela -o b.h5
  touch -d 2001-01-01 b.h5
  ffe-precompute --keep-unchanged --columns surface cube.ela -o b.h5
  [[ $(date -r b.h5 +%Y) == 2001 ]] || fail '--keep-unchanged wrote the file'
  ! strings -a a.h5 2>/dev/null | grep -q "$PWD" || fail 'a path stands in the store'
  rm a.h5 b.h5 cube.ela stiffer.ela
}

test_what_is_no_file_is_refused() {
  held_cube
  mkfifo pipe
  expect_failure 2 ffe-precompute ffe-precompute cube.ela
  expect_failure 2 ffe-precompute ffe-precompute cube.ela -o -
  expect_failure 1 ffe-precompute ffe-precompute cube.ela -o /dev/null
  expect_failure 1 ffe-precompute ffe-precompute cube.ela -o pipe
  expect_failure 1 ffe-precompute ffe-precompute cube.ela -o .
  expect_failure 1 ffe-precompute ffe-precompute cube.ela -o none/x.h5
  rm pipe cube.ela
}

test_a_full_disk_leaves_nothing() {
  held_cube
  local blocks
  for blocks in 1 4 20; do
    # Beyond the limit writing fails, as on a full disk.
    expect_failure 1 ffe-precompute bash -c "ulimit -f $blocks; trap '' XFSZ; exec ffe-precompute --columns all cube.ela -o out.h5"
    [[ ! -e out.h5 ]] || fail 'a store was left behind'
  done
  rm cube.ela
}

# Every byte that a reader needs is under a checksum: flipped, --info --verify finds it or says what it said before.
test_a_flipped_bit_is_found() {
  held_cube
  ffe-precompute --columns all cube.ela -o whole.h5
  ffe-precompute --info --verify whole.h5 | tail -n +3 >whole.txt
  local size at byte found=0
  size=$(stat -c %s whole.h5)
  for ((at = 11; at < size; at += size / 60)); do
    cp whole.h5 store.h5
    byte=$(od -An -tu1 -j "$at" -N 1 whole.h5)
    printf '%b' "\\x$(printf %02x $((byte ^ 16)))" | dd of=store.h5 bs=1 seek="$at" conv=notrunc 2>/dev/null
    if ffe-precompute --info --verify store.h5 >store.txt 2>message; then
      tail -n +3 store.txt | cmp - whole.txt || fail "byte $at is wrong and nobody noticed"
    else
      grep -q '^ffe-precompute: store.h5: ' message || fail "byte $at: $(cat message)"
      found=$((found + 1))
    fi
  done
  ((found > 40)) || fail "only $found of 60 flipped bits were found"
  rm whole.h5 whole.txt store.h5 store.txt message cube.ela
}

test_damaged_and_foreign_stores_are_refused() {
  command -v ffe-run >/dev/null || skip 'no ffe-run'
  held_cube
  ffe-precompute --columns surface cube.ela -o whole.h5
  printf '%s\n' 'object cube cube.ela store=store.h5' 'force cube 6 0 0 1' step >scene
  cp whole.h5 store.h5
  ffe-run scene >/dev/null || fail 'the whole store is refused'
  local size at
  size=$(stat -c %s whole.h5)
  for at in 0 7 47 500 $((size / 2)) $((size - 1)); do
    head -c "$at" whole.h5 >store.h5
    expect_failure 1 ffe-run ffe-run scene
  done
  sed 's/^\(0 1 e\) [^ ]*/\1 3/' cube.ela | ffe-precompute -o store.h5
  expect_failure 1 ffe-run ffe-run scene
  rm -f store.h5
  expect_failure 1 ffe-run ffe-run scene
  rm whole.h5 scene cube.ela
}

# examples/store/displace.py: u = C f, and ffe-run by its factor, within 10 eps cond of each other.
test_the_python_example_agrees_with_ffe_run() {
  local python condition
  python=$(python_with_h5py) || skip 'no h5py for python3'
  exp2ela --primitive sphere:24x12 --name ball -o ball.ela
  ffe-precompute --columns 40,41,100 ball.ela -o columns.h5
  ffe-precompute ball.ela -o factor.h5
  "$python" "$GEWEBE_ROOT/examples/store/displace.py" columns.h5 ball 40 1e-3 0 2e-3 100 0 -1e-3 0 >u.txt
  printf '%s\n' 'object ball ball.ela store=factor.h5' 'force ball 40 1e-3 0 2e-3' 'force ball 100 0 -1e-3 0' 'emit shapes' step >scene
  ffe-run scene | awk '/^shapes /{ n = $3; next } n-- > 0' >shape.txt
  [[ $(wc -l <u.txt) == $(wc -l <shape.txt) ]] || fail 'another number of nodes'
  condition=$(ffe-precompute --info factor.h5 | sed -n 's/^ *condition //p')
  # Shapes are rest plus displacement: their rounding counts, too.
  awk '/^nodes /{ n = $2; next } n-- > 0 { print $1, $2, $3 }' ball.ela | paste -d' ' - u.txt shape.txt >all.txt
  compare() { # FACTOR on u
    awk -v condition="$condition" -v factor="$1" '
      function abs(x) { return x < 0 ? -x : x }
      { for (a = 1; a <= 3; ++a) {
          d = abs($a + factor * $(a + 3) - $(a + 6)); if (!(d <= worst)) worst = d
          if (abs($(a + 3)) > most) most = abs($(a + 3))
          if (abs($a) > size) size = abs($a)
        } }
      END { exit !(most > 0 && worst <= 10 * 2.2e-16 * condition * most + 4e-16 * size) }' all.txt
  }
  compare 1 || fail 'Python says something else'
  ! compare 1.000001 || fail 'the check sees nothing'
}

# Forces and displaced nodes together: the same shape and the same forces by columns, by the factor, and by an independent
# dense solution in Python of the matrix that stands in the store.
test_contact_by_columns_by_the_factor_and_by_python() {
  local python way
  python=$(python_with_h5py) || skip 'no h5py for python3'
  exp2ela --primitive sphere:24x12 --name ball -o ball.ela
  ffe-precompute --columns surface ball.ela -o columns.h5
  ffe-precompute ball.ela -o factor.h5
  for way in columns factor; do
    printf '%s\n' "object ball ball.ela store=$way.h5" 'force ball 40 1e-3 0 2e-3' 'displace ball 100 0 1e-4 2e-4' \
      'displace ball 101,102,130-139 1e-4 0 0' 'emit forces' 'emit shapes' step >scene
    ffe-run --verify scene >$way.txt
  done
  "$python" - columns.txt factor.txt <<'END' || fail 'Python says something else'
import sys, h5py, numpy
store = h5py.File("factor.h5")["ball"]
p, i, x, axis = (store["K"][name][:] for name in ("p", "i", "x", "axis"))
n = len(p) - 1
K = numpy.zeros((n, n))
for c in range(n):
    K[i[p[c]:p[c + 1]], c] = K[c, i[p[c]:p[c + 1]]] = x[p[c]:p[c + 1]]
row = {a: r for r, a in enumerate(axis)}
f, d = numpy.zeros(n), {}
for a, value in enumerate((1e-3, 0, 2e-3)):
    f[row[3 * 40 + a]] = value
for node in [100, 101, 102, *range(130, 140)]:
    for a, value in enumerate((0, 1e-4, 2e-4) if node == 100 else (1e-4, 0, 0)):
        d[row[3 * node + a]] = value
held = numpy.array(sorted(d))
free = numpy.setdiff1d(numpy.arange(n), held)
u = numpy.zeros(n)
u[held] = [d[r] for r in held]
u[free] = numpy.linalg.solve(K[numpy.ix_(free, free)], f[free] - K[numpy.ix_(free, held)] @ u[held])
force = K @ u - f
tolerance = 10 * 2.2e-16 * store.attrs["condition"]
lines = open("ball.ela").read().split("\n")
at = next(k for k, line in enumerate(lines) if line.startswith("nodes "))
count = int(lines[at].split()[1])
rest = numpy.array([[float(w) for w in line.split()[:3]] for line in lines[at + 1:at + 1 + count]])
full = numpy.zeros(3 * count)
full[axis] = u
for name in sys.argv[1:]:
    text = open(name).read().split("\n")
    at = next(k for k, line in enumerate(text) if line.startswith("shapes "))
    shape = numpy.array([[float(w) for w in line.split()] for line in text[at + 1:at + 1 + count]])
    off = abs(shape - rest - full.reshape(-1, 3)).max()
    assert off <= tolerance * abs(full).max() + 4e-16 * abs(rest).max(), (name, off)
    assert not abs(shape - rest - 1.001 * full.reshape(-1, 3)).max() <= tolerance * abs(full).max() + 4e-16 * abs(rest).max()
    for node in (100, 101, 135):  # exact to the rounding of the position
        want = (0, 1e-4, 2e-4) if node == 100 else (1e-4, 0, 0)
        assert abs(shape[node] - (rest[node] + want)).max() <= 1e-12 * 2e-4 + 2.3e-16 * abs(rest).max()
    at = next(k for k, line in enumerate(text) if line.startswith("forces "))
    told = {int(w[0]): [float(v) for v in w[1:]] for w in (line.split() for line in text[at + 1:at + 14])}
    assert len(told) == 13
    for node, value in told.items():
        off = abs(numpy.array(value) - [force[row[3 * node + a]] for a in range(3)]).max()
        assert off <= tolerance * abs(force).max(), (name, node, off)
END
}

# What the man page says of datasets and attributes is what h5dump shows.
test_h5dump_shows_what_the_page_says() {
  command -v h5dump >/dev/null || skip 'no h5dump'
  held_cube
  ffe-precompute --columns all cube.ela -o cube.h5
  ffe-precompute --stage 2 --columns none cube.ela -o cube.h5
  local word page=$GEWEBE_ROOT/man/stiffness_store.5
  h5dump -H -A 0 cube.h5 >header.txt
  for word in $(h5dump -H cube.h5 | sed -nE 's/.*(GROUP|DATASET|ATTRIBUTE) "([^"]*)".*/\2/p' | sort -u); do
    [[ $word == / || $word == cube ]] && continue
    grep -qw -e "$word" "$page" || fail "the page says nothing of '$word'"
  done
  for word in Perm ColCount super pi px s x p i axis nodes values crc32c bound; do
    grep -q "DATASET \"$word\"" header.txt || fail "there is no dataset $word"
  done
  [[ $(grep -c 'H5T_IEEE_F64LE' header.txt) -gt 3 ]] || fail 'no float64'
  ! grep -qE 'H5T_(IEEE|STD)_[A-Z0-9]*BE' header.txt || fail 'not little-endian'
}
