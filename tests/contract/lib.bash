# What the contract tests share. Each test_NAME() of tests/contract/*.sh runs in an empty folder of its own under
# `bash -euo pipefail`: status 0 passes, 77 skips with its last line as the reason, anything else fails.
# $GEWEBE_ROOT is the repository, $BUILD the folder of the programs, $GEWEBE_SHARED the real data.
# shellcheck shell=bash

PATH=$BUILD:$PATH
# Debian's own Python, whose modules packages.txt lists, before one that stands earlier in the PATH.
[[ ! -x /usr/bin/python3 ]] || python3() { /usr/bin/python3 "$@"; }
# The module gewebe as it stands here; examples use it.
export PYTHONPATH=$GEWEBE_ROOT/python PYTHONDONTWRITEBYTECODE=1

fail() {
  printf '%s\n' "$@"
  exit 1
}
skip() {
  printf '%s\n' "$1"
  exit 77
}

# Says that a part of this test can't be done here, which counts as a skipped test: left_out WHAT IS ABSENT.
left_out() { printf '%s\n' "$1" >>"$GEWEBE_LEFT_OUT"; }
# For a part of a test: is there this program, this module of Python? If not, the part is left out.
has() { command -v "$1" >/dev/null || { left_out "no $1"; return 1; }; }
has_module() { python3 -c "import $1" 2>/dev/null || { left_out "no $1 for python3"; return 1; }; }
has_strace() { has strace && { strace -o /dev/null true 2>/dev/null || { left_out 'strace may not trace here'; return 1; }; }; }

# The names of our programs; gewebe, which starts the others, is none of them.
programs() {
  basename -s .cpp "$GEWEBE_ROOT"/tools/*.cpp | grep -vx gewebe
}

# Those whose result is a stream; the others write files by name (ffe-run's standard output is its replies).
filters() { programs | grep -v '^ffe-'; }

# A file name that the program writes its own kind to.
target() {
  case $1 in
    ffe-*) echo out.h5 ;;
    *) echo out ;;
  esac
}

# Runs the sample in `words` and leaves its result in FILE: result FILE.
result() {
  if [[ ${words[0]} == ffe-precompute ]]; then
    "${words[@]}" -o "$1.h5"
    mv "$1.h5" "$1"
  else
    "${words[@]}" >"$1"
  fi
}

# A run that must fail: expect_failure STATUS TOOL COMMAND... looks for the status and for one line `TOOL: …` alone.
expect_failure() {
  local expected=$1 tool=$2 status=0
  shift 2
  "$@" 2>stderr.txt || status=$?
  ((status == expected)) || fail "status $status, expected $expected: $*" "$(<stderr.txt)"
  [[ $(wc -l <stderr.txt) == 1 && $(<stderr.txt) == "$tool: "* ]] || fail "expected one line '$tool: …' from: $*" "$(<stderr.txt)"
  rm stderr.txt
}

# Input and options that let each program work: sample TOOL sets the array `words`, with files made in this folder.
# shellcheck disable=SC2034 # read by the callers
sample() {
  case $1 in
    metaball2vol)
      printf '0 0 0 4\n3 0 0 3\n' >in.particles
      words=(metaball2vol --voxel 0.5 in.particles)
      ;;
    voxelize)
      cube >in.off
      words=(voxelize --voxel 0.08 in.off)
      ;;
    csg)
      sample metaball2vol
      metaball2vol --voxel 0.5 in.particles -o in.vdb
      words=(csg add in.vdb in.vdb)
      ;;
    mc-opt)
      sample metaball2vol
      metaball2vol --voxel 0.5 in.particles -o in.vdb
      words=(mc-opt in.vdb)
      ;;
    exp2ela)
      cube >in.off
      words=(exp2ela in.off)
      ;;
    ffe-precompute)
      cube | exp2ela --format off --fix 'z<0' -o in.ela
      words=(ffe-precompute in.ela)
      ;;
    ffe-run)
      cube | exp2ela --format off -o in.ela
      printf '%s\n' 'object cube in.ela' 'emit forces' 'displace cube 0 0.1 0 0' step >in.scene
      words=(ffe-run in.scene)
      ;;
    emboss-render)
      cube >in.off
      words=(emboss-render --backend cpu --size 64 in.off)
      ;;
    *) fail "tests/contract/lib.bash has no sample for $1" ;;
  esac
}

# A cube of edge 2 around the origin, as OFF.
cube() {
  printf 'OFF\n8 12 0\n'
  printf '%s\n' '-1 -1 -1' '1 -1 -1' '1 1 -1' '-1 1 -1' '-1 -1 1' '1 -1 1' '1 1 1' '-1 1 1'
  printf '3 %s\n' '0 2 1' '0 3 2' '4 5 6' '4 6 7' '0 1 5' '0 5 4' '1 2 6' '1 6 5' '2 3 7' '2 7 6' '3 0 4' '3 4 7'
}

# A python3 that has h5py and numpy.
python_with_h5py() {
  local python
  for python in python3 /usr/bin/python3; do
    if "$python" -c 'import h5py, numpy' 2>/dev/null; then
      echo "$python"
      return
    fi
  done
  return 1
}
