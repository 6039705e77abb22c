# Which files a program opens, closes, replaces and leaves alone; and what it does when the system gives no more.
# shellcheck shell=bash disable=SC2317 # functions are called by name

# A square with a hole in it, which --rule winding voxelizes with a warning.
open_mesh() { printf 'OFF\n4 3 0\n0 0 0\n9 0 0\n0 9 0\n0 0 9\n3 0 2 1\n3 0 1 3\n3 0 3 2\n' >open.off; }

test_closed_streams_are_no_files() {
  local tool
  for tool in $(programs); do
    sample "$tool"
    "${words[@]}" -o "$(target "$tool")"
    mv "$(target "$tool")" whole
    "${words[@]}" -o "$(target "$tool")" <&- 2>&- || fail "$tool fails without standard error"
    cmp whole "$(target "$tool")" || fail "$tool wrote something else without standard error"
    rm -f "$(target "$tool")" whole out.xdmf
    words[-1]=-
    expect_failure 1 "$tool" "${words[@]}" -o "$(target "$tool")" <&-
  done
  for tool in $(filters) ffe-run; do
    sample "$tool"
    expect_failure 1 "$tool" "${words[@]}" >&-
  done
  open_mesh
  voxelize --rule winding --voxel 1 open.off -o warned.vdb 2>message
  [[ -s message ]] || fail 'nothing is warned of'
  voxelize --rule winding --voxel 1 open.off -o silent.vdb 2>&-
  cmp warned.vdb silent.vdb || fail 'a warning went into the volume'
}

# What OpenVDB says goes neither into the data nor beside our one line.
test_remarks_of_openvdb_are_errors() {
  sample mc-opt
  cp in.vdb newer.vdb
  printf '\xe1' | dd of=newer.vdb bs=1 seek=8 conv=notrunc 2>/dev/null
  expect_failure 1 mc-opt mc-opt newer.vdb >out
  [[ ! -s out ]] || fail 'something went to standard output:' "$(head -c 200 out)"
  local map
  map=$(grep -abo UniformScaleMap in.vdb | tail -1 | cut -d: -f1)
  [[ $map ]] || fail 'the volume has another map'
  printf '\2' | dd of=in.vdb bs=1 seek=$((map + 15 + 120)) conv=notrunc 2>/dev/null # buffers of its tree
  mc-opt in.vdb >out 2>message && fail 'a tree of two buffers is read'
  [[ $(<message) == "mc-opt: in.vdb: the grid's tree has several buffers, expected one" ]] || fail "$(<message)"
  [[ $(wc -l <message) == 1 && ! -s out ]] || fail 'more than one line' "$(<message)"
}

# Messages are UTF-8, whatever bytes a name or a value has.
test_bytes_that_are_no_text_are_escaped() {
  mc-opt --iso $'\xff\xc3\xa4' 2>message && fail 'bytes for a number are taken'
  [[ $(<message) == "mc-opt: --iso: '\\xffä' is no number" ]] || fail "$(<message)"
  mc-opt $'no\xe9\x1b[31m.vdb' 2>message && fail 'a file of no name is read'
  [[ $(<message) == 'mc-opt: no\xe9 [31m.vdb: cannot open: '* ]] || fail "$(<message)"
}

test_two_names_for_one_file_are_refused() {
  local tool input
  for tool in $(filters); do
    sample "$tool"
    input=${words[-1]}
    cp "$input" copy
    ln "$input" hard
    ln -s "$PWD/$input" soft
    for name in "$input" "./$input" hard soft; do
      expect_failure 1 "$tool" "${words[@]}" -o "$name" --to "$(kind_of "$tool")"
    done
    expect_failure 1 "$tool" "${words[@]}" -o out --stats=./out
    expect_failure 1 "$tool" "${words[@]}" -o out --stats="$input"
    cmp copy "$input" || fail "$tool changed its input"
    [[ ! -e out ]] || fail "$tool left an output"
    rm -f copy hard soft in*
  done
}
kind_of() {
  case $1 in
    metaball2vol | voxelize | csg) echo vdb ;;
    mc-opt) echo ply ;;
    exp2ela) echo ela ;;
    emboss-render) echo png ;;
  esac
}

test_a_scene_destroys_nothing_that_it_reads() {
  sample ffe-run
  cp in.ela copy.ela
  cp in.scene copy.scene
  local arguments
  for arguments in '--events in.ela' '--events in.scene' '--record in.scene' '--record ./in.ela' '--latencies in.ela' \
    '-o run.h5 --events run.h5' '-o run.h5 --events ./run.xdmf' '-o run.h5 --record run.h5' '--events a --record a' '--stats=in.ela'; do
    # shellcheck disable=SC2086 # several words
    ffe-run $arguments in.scene >/dev/null 2>message && fail "accepted: $arguments"
    [[ $(wc -l <message) == 1 ]] || fail "$arguments:" "$(<message)"
    { cmp copy.ela in.ela && cmp copy.scene in.scene; } || fail "destroyed by $arguments"
  done
  printf '%s\n' 'object cube in.ela' 'emit model cube ./in.ela' >over.scene
  expect_failure 1 ffe-run ffe-run over.scene
  printf '%s\n' 'object cube in.ela' 'emit model cube over.scene' >over.scene
  expect_failure 1 ffe-run ffe-run over.scene
  printf '%s\n' 'object cube in.ela' 'emit model cube other.ela' 'emit model cube other.ela' >twice.scene
  ffe-run twice.scene || fail 'a model may be written again'
  cmp copy.ela in.ela || fail 'the model was replaced'
  [[ $(wc -l <over.scene) == 2 ]] || fail 'the scene was replaced'
}

test_a_part_of_somebody_else_is_left_alone() {
  sample ffe-run
  mv in.ela loose.ela
  sed -i 's/in.ela/loose.ela/' in.scene
  sample ffe-precompute
  local name
  for name in rec.scene out.h5; do
    local words=(ffe-run --record rec.scene in.scene)
    [[ $name == rec.scene ]] || words=(ffe-precompute --columns all in.ela -o out.h5)
    echo precious >victim
    ln -s victim $name.part
    expect_failure 1 "${words[0]}" "${words[@]}" >/dev/null
    [[ -L $name.part && $(<victim) == precious ]] || fail "${words[0]} followed $name.part"
    rm $name.part
    ln victim $name.part
    expect_failure 1 "${words[0]}" "${words[@]}" >/dev/null
    rm $name.part
    echo mine >$name.part
    expect_failure 1 "${words[0]}" "${words[@]}" >/dev/null
    [[ $(<$name.part) == mine && $(<victim) == precious && ! -e $name ]] || fail "${words[0]} took $name.part"
    rm $name.part
    "${words[@]}" >/dev/null || fail "${words[0]} fails without it"
    [[ ! -e $name.part ]] || fail "${words[0]} left $name.part"
  done
  # What a killed session recorded.
  rm rec.scene
  mkfifo lines
  ffe-run --serve --record rec.scene <lines >answers &
  exec 5>lines
  printf 'object cube loose.ela\n' >&5
  while [[ ! -s rec.scene.part ]]; do sleep 0.05; done
  kill -KILL $!
  wait $! 2>/dev/null || true
  exec 5>&-
  expect_failure 1 ffe-run ffe-run --record rec.scene in.scene >/dev/null
  [[ $(<rec.scene.part) == 'object cube loose.ela' ]] || fail 'the record of a killed session is lost'
}

# No more threads than the first: one does it all, or a program whose libraries need some says so in one line.
test_without_threads() {
  cat >none.c <<'END'
#include <errno.h>
int pthread_create(void *t, const void *a, void *(*f)(void *), void *x) { (void)t; (void)a; (void)f; (void)x; return EAGAIN; }
END
  gcc -shared -fPIC -w -o none.so none.c 2>/dev/null || skip 'no C compiler'
  local tool status
  for tool in $(programs); do
    sample "$tool"
    [[ $tool != ffe-precompute ]] || words+=(--columns all)
    result whole
    status=0
    LD_PRELOAD=$PWD/none.so "${words[@]}" -j4 -o "$(target "$tool")" 2>message || status=$?
    if ((status == 0)); then
      cmp whole "$(target "$tool")" || [[ $tool == ffe-run ]] || fail "$tool makes something else"
    else
      ((status == 1)) || fail "$tool: status $status" "$(<message)"
      [[ $(<message) == "$tool: no thread can be started"* && $(wc -l <message) == 1 ]] || fail "$(<message)"
    fi
    case $tool in
      exp2ela | ffe-* | emboss-render) ((status == 0)) || fail "$tool does not work in one thread" "$(<message)" ;;
    esac
    rm -f out* whole
  done
}

# Less and less memory: a result, or status 1 and one line, and nothing left behind. 127: the loader says it.
test_short_of_memory() {
  local tool limit status before
  for tool in $(programs); do
    sample "$tool"
    [[ $tool != mc-opt ]] || words+=(--resample 0.1)
    rm -f message
    before=$(ls -A)
    for limit in 4000 2000 1000 700 500 400 350 300 280 260 240 220 200 180 150 100; do
      status=0
      (ulimit -c 0 -v ${limit}000 && exec timeout 60 "${words[@]}" -o "$(target "$tool")") 2>message >/dev/null || status=$?
      ((status == 0 || status == 1 || status == 127)) || fail "$tool in $limit MB: status $status" "$(<message)"
      ((status == 0)) || [[ $(wc -l <message) == 1 ]] || fail "$tool in $limit MB:" "$(<message)"
      rm -f "$(target "$tool")" out.xdmf message
      [[ $(ls -A) == "$before" ]] || fail "$tool in $limit MB left:" "$(ls -A)"
    done
    rm -f in*
  done
}

test_out_of_memory_is_status_1() {
  [[ $BUILD != */sanitize ]] || skip 'a sanitizer takes the address space'
  printf 'OFF\n4 4 0\n0 0 0\n90 0 0\n0 90 0\n0 0 90\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n' >big.off
  voxelize --voxel 0.4 big.off -o big.vdb
  # It needs some 700 MB: whatever is refused, in a leaf or in a table, ends it alike.
  limited() { (ulimit -c 0 -v 400000 && mc-opt --resample 0.15 --max-memory 100G big.vdb -o big.ply); }
  expect_failure 1 mc-opt limited
  [[ ! -e big.ply ]] || fail 'there is a result'
}

test_a_file_too_large_is_a_full_disk() {
  local tool before
  for tool in $(programs); do
    sample "$tool"
    [[ $tool != csg && $tool != mc-opt ]] || metaball2vol --voxel 0.1 in.particles -o in.vdb
    before=$(ls -A)
    # The message goes through a pipe, for the limit holds for it, too.
    too_large() { (ulimit -f 0 && exec "${words[@]}" -o "$(target "$tool")") 2>&1 >/dev/null | cat >&2; }
    expect_failure 1 "$tool" too_large
    [[ $(ls -A) == "$before" ]] || fail "$tool left:" "$(ls -A)"
    rm -f in*
  done
}

test_side_files_stay_below_the_folder() {
  mkdir -p deep/er
  { head -c 14 /dev/zero && printf '\200\77' && head -c 12 /dev/zero && printf '\200\77' && head -c 6 /dev/zero; } >secret.bin
  truncate -s 36 secret.bin
  cp secret.bin deep/er/near.bin
  gltf() { printf '{"asset":{"version":"2.0"},"buffers":[{"byteLength":36,"uri":"%s"}],"bufferViews":[{"buffer":0,"byteLength":36}],"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}],"scene":0}' "$1"; }
  local name
  for name in ../secret.bin er/../../secret.bin "$PWD/secret.bin"; do
    gltf "$name" >deep/x.gltf
    exp2ela --to ply deep/x.gltf >out 2>message && fail "$name was read"
    grep -q "which is not in its own folder or below" message || fail "$(<message)"
    [[ $(wc -l <message) == 1 ]] || fail "$(<message)"
  done
  gltf er/near.bin >deep/x.gltf
  exp2ela --to ply deep/x.gltf >out || fail 'a file below the folder is refused'
  nrrd() { printf 'NRRD0004\ntype: uint8\ndimension: 3\nsizes: 3 3 4\nspacings: 1 1 1\nencoding: raw\ndata file: %s\n' "$1"; }
  head -c 36 /dev/zero | tr '\0' '\1' >secret.bin
  cp secret.bin deep/er/near.bin
  for name in ../secret.bin er/../../secret.bin "$PWD/secret.bin"; do
    nrrd "$name" >deep/x.nrrd
    expect_failure 1 voxelize voxelize --label 1 deep/x.nrrd >out
  done
  nrrd er/near.bin >deep/x.nrrd
  voxelize --label 1 deep/x.nrrd >out || fail 'a file below the folder is refused'
}

test_a_suffix_of_nobody_is_wrong_use() {
  local tool
  for tool in $(programs); do
    sample "$tool"
    expect_failure 2 "$tool" "${words[@]}" -o out.jpg
    expect_failure 2 "$tool" "${words[@]}" -o out.mkv
    expect_failure 2 "$tool" "${words[@]}" -o out.3mf
    [[ ! -e out.jpg && ! -e out.mkv && ! -e out.3mf ]] || fail "$tool wrote it"
  done
}

# Digits alone number files.
test_a_number_is_no_suffix() {
  local tool
  for tool in $(programs); do
    sample "$tool"
    "${words[@]}" -o out.001 >/dev/null || fail "$tool refuses it"
    [[ -e out.001 ]] || fail "$tool didn't write it"
    rm out.001
  done
}

# A small file that would be unpacked for minutes is refused by the size that its header tells.
test_a_packed_volume_is_refused_by_its_size() {
  { printf 'NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2000 2000 1000\nspacings: 1 1 1\nencoding: gzip\n\n' && head -c 1000000 /dev/zero | gzip; } >bomb.nrrd
  voxelize --label 1 --max-memory 2G bomb.nrrd >out 2>message && fail 'it is unpacked'
  [[ $(<message) == *'(--max-memory)' ]] || fail "$(<message)"
}

# Without a reader a FIFO would hold up the result, and a device keeps nothing: what is written beside a result is a regular file.
test_pipes_and_devices_are_no_files_beside_a_result() {
  local tool side
  mkfifo fifo
  for tool in $(programs); do
    sample "$tool"
    [[ $tool != ffe-precompute ]] || words+=(--columns all)
    for side in fifo /dev/full; do
      expect_failure 1 "$tool" timeout 60 "${words[@]}" "--stats=$side" -o "$(target "$tool")"
      [[ ! -e $(target "$tool") ]] || fail "$tool left its result"
    done
  done
  sample ffe-run
  for tool in --record --events --latencies; do
    for side in fifo /dev/full; do
      expect_refusal ffe-run "$side" timeout 60 ffe-run "$tool" "$side" in.scene -o out.h5
      [[ -z $(ls -A out* .out* ./*.part 2>/dev/null) ]] || fail "$tool left files"
    done
  done
  ffe-run in.scene --stats=/dev/null --record=/dev/null --events=/dev/null -o null.csv >answers || fail '/dev/null was refused'
  # Companions of a result.
  mkfifo run.xdmf mesh.node
  expect_refusal ffe-run run.xdmf timeout 60 ffe-run in.scene -o run.h5
  printf '0 0 0 4\n' | metaball2vol --voxel 1 -o in.vdb
  expect_refusal mc-opt mesh.node timeout 60 mc-opt --tets in.vdb -o mesh.ele
  [[ ! -e run.h5 && ! -e mesh.ele ]] || fail 'half a result'
  # A model that a scene writes.
  object=$(sed -n 's/^object \([^ ]*\) .*/\1/p' in.scene | head -1)
  { cat in.scene && echo "emit model $object fifo"; } >export.scene
  timeout 60 ffe-run export.scene >answers 2>message && fail "a model was written to a FIFO"
  grep -q 'fifo: is no regular file, expected one, or a new name' message || fail "$(<message)"
}

# As expect_failure 1, and FILE is what the message is about: expect_refusal TOOL FILE COMMAND...
expect_refusal() {
  local tool=$1 file=$2 status=0
  shift 2
  "$@" >answers 2>message || status=$?
  ((status == 1)) || fail "status $status, expected 1: $*" "$(<message)"
  [[ $(<message) == "$tool: $file: is no regular file, expected one, or a new name, beside the result" ]] || fail "$(<message)"
}

test_a_signal_ends_a_run_whose_pipe_has_no_reader() {
  local signal pid status
  sample ffe-run
  mkfifo fifo
  for signal in INT TERM HUP; do
    env --default-signal=INT timeout -s KILL 60 ffe-run in.scene --to csv -o fifo >answers 2>message &
    pid=$!
    while ! grep -qs 'done' answers; do sleep 0.05; done
    sleep 0.3
    kill -"$signal" "$(pgrep -P "$pid")"
    status=0
    wait "$pid" || status=$?
    ((status == 128 + $(kill -l "$signal"))) || fail "status $status on SIG$signal" "$(<message)"
  done
  # A reader that comes late has all of it.
  ffe-run in.scene --to csv -o fifo >answers &
  sleep 0.3
  cat fifo >late
  wait $!
  ffe-run in.scene --to csv -o whole >answers
  cmp late whole
}
