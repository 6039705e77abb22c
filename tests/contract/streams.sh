# Files and pipes, alike for every program (gewebe(7)).
# shellcheck shell=bash disable=SC2317 # functions are called by name

test_a_full_disk_is_status_1_and_one_line() {
  [[ -c /dev/full ]] || skip 'there is no /dev/full'
  local tool
  to_full() { "${words[@]}" >/dev/full; }
  for tool in $(programs); do
    sample "$tool"
    [[ $tool == ffe-precompute ]] || expect_failure 1 "$tool" to_full
    expect_failure 1 "$tool" "${words[@]}" -o /dev/full
  done
}

test_version_and_help_on_a_full_disk() {
  [[ -c /dev/full ]] || skip 'there is no /dev/full'
  local tool
  for tool in $(programs); do
    [[ $("$tool" --version) == *[0-9]* ]] || fail "$tool --version tells no number"
    expect_failure 1 "$tool" "$tool" --help >/dev/full
  done
}

test_output_to_devices_fifos_and_symlinks() {
  local tool
  for tool in $(filters); do
    sample "$tool"
    "${words[@]}" >direct
    "${words[@]}" -o /dev/null || fail "$tool -o /dev/null failed"
    [[ -c /dev/null ]] || fail "$tool replaced /dev/null"

    mkfifo fifo
    timeout 60 cat fifo >through &
    timeout 60 "${words[@]}" -o fifo || fail "$tool -o FIFO failed"
    wait $!
    [[ -p fifo ]] || fail "$tool replaced a FIFO"
    cmp direct through || fail "$tool wrote other bytes into a FIFO"

    mkdir -p folder
    echo old >folder/target
    chmod 640 folder/target
    ln -s folder/target link
    "${words[@]}" -o link || fail "$tool -o SYMLINK failed"
    [[ -L link ]] || fail "$tool replaced a symlink"
    cmp direct folder/target || fail "$tool wrote other bytes through a symlink"
    [[ $(stat -c %a folder/target) == 640 ]] || fail "$tool changed the file's mode"
    [[ $(ls -A folder) == target ]] || fail "$tool left files beside the target:" "$(ls -A folder)"

    (umask 027 && "${words[@]}" -o new) || fail "$tool -o NEW failed"
    [[ $(stat -c %a new) == 640 ]] || fail "$tool ignored the umask"
    rm -rf fifo through folder link new direct
  done
}

test_a_failure_leaves_the_old_file() {
  local tool target
  for tool in $(programs); do
    sample "$tool"
    target=$(target "$tool")
    echo old >"$target"
    : >empty
    words[-1]=empty
    expect_failure 1 "$tool" "${words[@]}" -o "$target"
    [[ $(<"$target") == old ]] || fail "$tool changed the output although it failed"
    rm -f "$target" empty in*
    [[ -z $(ls -A) ]] || fail "$tool left files:" "$(ls -A)"
  done
}

test_a_read_only_folder() {
  local tool run=()
  if [[ $(id -u) == 0 ]]; then
    # Root writes everywhere, unless it gives up that right.
    run=(setpriv "--bounding-set=-dac_override,-dac_read_search" --inh-caps=-all)
    "${run[@]}" true 2>/dev/null || skip 'root that cannot give up its rights'
  fi
  for tool in $(programs); do
    sample "$tool"
    mkdir -m 555 closed
    expect_failure 1 "$tool" "${run[@]}" "${words[@]}" -o "closed/$(target "$tool")"
    [[ -z $(ls -A closed) ]] || fail "$tool left files"
    rmdir closed
  done
}

test_an_interrupt_leaves_no_litter() {
  ulimit -c 0 # SIGQUIT
  local tool signal pid status
  for tool in $(programs); do
    sample "$tool"
    # The last operand is a pipe that never ends: the program waits in the midst of its work.
    words[-1]=-
    mkdir folder
    for signal in INT TERM HUP QUIT XCPU; do
      mkfifo never
      sleep 60 >never &
      local holder=$!
      # Background jobs of a script ignore SIGINT; env gives its default back.
      env --default-signal=INT,QUIT "${words[@]}" -o "folder/$(target "$tool")" <never 2>stderr.txt &
      pid=$!
      sleep 0.3
      kill -"$signal" "$pid"
      status=0
      wait "$pid" || status=$?
      ((status == 128 + $(kill -l "$signal"))) || fail "$tool ended with status $status on SIG$signal" "$(<stderr.txt)"
      kill "$holder"
      wait "$holder" 2>/dev/null || true
      [[ -z $(ls -A folder) ]] || fail "$tool left files on SIG$signal:" "$(ls -A folder)"
      rm never
    done
    rmdir folder
  done
}

test_stats_are_one_line_of_json_and_never_the_next_word() {
  local tool before
  for tool in $(programs); do
    sample "$tool"
    before=$(stat -c '%Y %s %i' "${words[-1]}")
    cp "${words[-1]}" copy
    # --stats right before an input: it must not swallow or overwrite it.
    words=("${words[0]}" "${words[@]:1:${#words[@]}-2}" --stats "${words[-1]}")
    result out 2>stderr.txt || fail "$tool --stats failed" "$(<stderr.txt)"
    [[ $(wc -l <stderr.txt) == 1 && $(<stderr.txt) == "{\"tool\":\"$tool\","*'}' ]] || fail "$tool --stats is not one line of JSON:" "$(<stderr.txt)"
    grep -q '"seconds":{' stderr.txt || fail "$tool --stats tells no seconds"
    grep -Eq '"digest":"[0-9a-f]{16}"' stderr.txt || fail "$tool --stats tells no digest"
    cmp copy "${words[-1]}"
    [[ $(stat -c '%Y %s %i' "${words[-1]}") == "$before" ]] || fail "$tool --stats touched its input"
    words=("${words[@]:0:${#words[@]}-2}" --stats=stats.json "${words[-1]}")
    result out2
    cmp out out2
    [[ $(wc -l <stats.json) == 1 ]] || fail "$tool --stats=FILE wrote no line"
    rm -f copy out out2 stderr.txt stats.json
  done
}

test_keep_unchanged_leaves_the_time_stamp() {
  local tool target
  for tool in $(programs); do
    sample "$tool"
    target=$(target "$tool")
    "${words[@]}" -o "$target"
    touch -d 2001-01-01 "$target"
    "${words[@]}" -o "$target" --keep-unchanged
    [[ $(stat -c %Y "$target") == "$(date -d 2001-01-01 +%s)" ]] || fail "$tool --keep-unchanged rewrote equal bytes"
    "${words[@]}" -o "$target"
    [[ $(stat -c %Y "$target") != "$(date -d 2001-01-01 +%s)" ]] || fail "$tool did not write without --keep-unchanged"
    rm "$target"
  done
}

test_a_reader_that_stops_early_ends_it_quietly() {
  local tool
  for tool in $(filters) ffe-run; do
    sample "$tool"
    { "${words[@]}" 2>stderr.txt || true; } | head -c 1 >/dev/null
    [[ ! -s stderr.txt ]] || fail "$tool spoke on a closed pipe:" "$(<stderr.txt)"
  done
}

# Volumes as they are: the content, and so what is made of it, is that of packed ones.
test_uncompressed_volumes_hold_the_same() {
  local digest
  echo '0 0 0 30' | metaball2vol --voxel 1 --stats=packed.json -o packed.vdb
  echo '0 0 0 30' | metaball2vol --voxel 1 -u --stats=plain.json >plain.vdb
  digest=$(grep -o '"digest":"[0-9a-f]*"' packed.json)
  [[ $digest && $digest == "$(grep -o '"digest":"[0-9a-f]*"' plain.json)" ]] || fail 'another digest' "$(<plain.json)"
  (($(stat -c %s plain.vdb) > $(stat -c %s packed.vdb))) || fail 'what is not packed is smaller'
  mc-opt packed.vdb -o packed.ply
  echo '0 0 0 30' | metaball2vol --voxel 1 --uncompressed | csg -u union packed.vdb - | mc-opt -o chain.ply
  cmp packed.ply chain.ply || fail 'the chain makes another mesh'
  voxelize --voxel 2 packed.ply -o a.vdb
  voxelize --voxel 2 -u packed.ply -o b.vdb
  ! cmp -s a.vdb b.vdb || fail 'voxelize -u packs'
  csg union a.vdb a.vdb -o a2.vdb
  csg union b.vdb b.vdb -o b2.vdb
  cmp a2.vdb b2.vdb || fail 'voxelize -u writes another content'
}
