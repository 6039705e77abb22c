# Parts of a store, and second stages.
# shellcheck shell=bash disable=SC2317 # functions are called by name

# a.ela and b.ela: a ball of some 300 nodes and a tube.
two_models() {
  exp2ela --primitive sphere:24x12 --name a -o a.ela
  exp2ela --primitive sphere:12x8 --bend --name b -o b.ela
}

test_parts_merged_are_the_whole() {
  two_models
  local precision part
  for precision in float64 float32; do
    ffe-precompute --columns all --precision $precision a.ela b.ela -o whole.h5
    for part in 1 2 3; do
      ffe-precompute --columns all --precision $precision --shard $part/3 a.ela b.ela -o $part.h5
    done
    ffe-precompute --info 2.h5 | grep -qx 'shard 2 of 3' || fail 'a part does not say what it is'
    (($(stat -c %s 2.h5) < $(stat -c %s whole.h5) / 2)) || fail 'a part is no part'
    ffe-precompute --merge --verify 3.h5 1.h5 2.h5 -o merged.h5
    cmp whole.h5 merged.h5 || fail "parts of $precision make other bytes"
    if has h5diff; then
      h5diff whole.h5 merged.h5 || fail 'h5diff sees a difference'
    fi
  done
  # Objects without columns are shared out whole.
  ffe-precompute a.ela b.ela -o whole.h5
  ffe-precompute --shard 1/2 a.ela b.ela -o 1.h5
  ffe-precompute --shard 2/2 a.ela b.ela -o 2.h5
  [[ $(ffe-precompute --info 2.h5 | grep ^object) == 'object b' ]] || fail 'the second part is not b'
  ffe-precompute --merge 1.h5 2.h5 -o merged.h5
  cmp whole.h5 merged.h5 || fail 'objects make other bytes'
}

test_parts_that_do_not_belong_together_are_refused() {
  two_models
  local part
  for part in 1 2 3; do
    ffe-precompute --columns all --shard $part/3 a.ela -o $part.h5
  done
  expect_failure 1 ffe-precompute ffe-precompute --merge 1.h5 2.h5 -o out.h5
  expect_failure 1 ffe-precompute ffe-precompute --merge 1.h5 3.h5 -o out.h5
  expect_failure 1 ffe-precompute ffe-precompute --merge 1.h5 2.h5 2.h5 -o out.h5
  sed 's/^\(0 1 e\) [^ ]*/\1 3/' a.ela | ffe-precompute --columns all --shard 2/3 -o other.h5
  ffe-precompute --merge 1.h5 other.h5 3.h5 -o out.h5 2>message && fail 'a part of another model is joined'
  grep -q "^ffe-precompute: other.h5: 'a' is of another model" message || fail "$(<message)"
  # One wrong byte in the columns of a part.
  dd if=/dev/urandom of=2.h5 bs=1 seek=$(($(stat -c %s 2.h5) / 2)) count=8 conv=notrunc 2>/dev/null
  expect_failure 1 ffe-precompute ffe-precompute --merge 1.h5 2.h5 3.h5 -o out.h5
  [[ ! -e out.h5 ]] || fail 'something was written'
}

# Twice the same node is no sum of parts, even where the columns agree.
test_parts_that_overlap_are_refused() {
  two_models
  ffe-precompute --columns all --shard 1/2 a.ela -o 1.h5
  ffe-precompute --columns 0-223 --shard 2/2 a.ela -o 2.h5
  ffe-precompute --merge 1.h5 2.h5 -o out.h5 2>message && fail 'parts that overlap are joined'
  grep -q "^ffe-precompute: 2.h5: 'a' has columns of node [0-9]* that another part has, too" message || fail "$(<message)"
  [[ $(wc -l <message) == 1 && ! -e out.h5 ]] || fail 'something was written' "$(<message)"
}

# Each column of either precision is checked when it is read.
test_a_wrong_byte_in_a_column_is_found() {
  exp2ela --primitive sphere:24x12 --name a -o a.ela
  local precision bytes
  for precision in float64 float32; do
    ffe-precompute --columns all --precision $precision a.ela -o store.h5
    bytes=$(stat -c %s store.h5)
    # The columns are most of the file; the lowest byte of a number in the middle.
    printf '\125' | dd of=store.h5 bs=1 seek=$((bytes / 2 / 8 * 8)) conv=notrunc 2>/dev/null
    printf '\252' | dd of=store.h5 bs=1 seek=$((bytes / 2 / 8 * 8 + 8)) conv=notrunc 2>/dev/null
    ffe-precompute --info --verify store.h5 >info 2>message && fail "a wrong $precision column is good"
    grep -q 'checksum' message || fail "$(<message)"
  done
}

test_a_second_stage_is_added() {
  two_models
  ffe-precompute --columns all a.ela b.ela -o store.h5
  ffe-precompute --columns all a.ela -o alone.h5
  cp store.h5 before.h5
  # Twice as stiff.
  awk '$3 == "e" || $3 == "c" { $4 *= 2 } 1' a.ela >stiff.ela
  ffe-precompute --stage 2 --columns 0-9 --verify stiff.ela -o store.h5
  ffe-precompute --info --verify store.h5 >info.txt
  [[ $(grep -c '^object' info.txt) == 3 ]] || fail "$(<info.txt)"
  grep -qx 'object a stage 2' info.txt || fail "$(<info.txt)"
  if has h5diff; then
    h5diff -q before.h5 store.h5 /b /b || fail 'b has changed'
    h5diff -q before.h5 store.h5 /a/K /a/K || fail 'the first stage has changed'
    h5diff -q before.h5 store.h5 /a/columns /a/columns || fail 'the first stage has changed'
    ! h5diff -q before.h5 store.h5 /a/K /a/stage2/K || fail 'the second stage is the first'
  fi
  printf '%s\n' 'object a a.ela store=store.h5' 'force a 9 0 0 1' step >scene
  ffe-run scene >/dev/null || fail 'the store is no longer read'
  # Again gives the same, and of another model, or none, nothing is taken.
  cp store.h5 twice.h5
  ffe-precompute --stage 2 --columns 0-9 stiff.ela -o twice.h5
  cmp store.h5 twice.h5 || fail 'the second time makes other bytes'
  exp2ela --primitive sphere:20x10 --name a -o other.ela
  expect_failure 1 ffe-precompute ffe-precompute --stage 2 other.ela -o store.h5
  exp2ela --primitive sphere:20x10 --name c -o other.ela
  expect_failure 1 ffe-precompute ffe-precompute --stage 2 other.ela -o store.h5
  cmp store.h5 twice.h5 || fail 'a refusal changed the store'
  expect_failure 1 ffe-precompute ffe-precompute --stage 2 stiff.ela -o none.h5
}

test_the_cluster_example_runs() {
  command -v parallel >/dev/null || skip 'no GNU parallel'
  parallel --version 2>/dev/null | grep -q 'GNU parallel' || skip 'no GNU parallel'
  cp -r "$GEWEBE_ROOT/examples/cluster" .
  make -s -C cluster compare || fail 'the example fails'
}
