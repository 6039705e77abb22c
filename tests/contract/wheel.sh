# The wheel of `make wheel`, installed as a stranger does and tried; GEWEBE_WHEEL names one that is there already.
# shellcheck shell=bash disable=SC2317 # functions are called by name

# A folder `env` with the wheel in it, in which Debian's numpy and h5py are found.
install_wheel() {
  local wheel=${GEWEBE_WHEEL-} file
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  for file in patchelf strip dpkg-query; do command -v "$file" >/dev/null || skip "no $file"; done
  python3 -c 'import numpy' 2>/dev/null || skip 'no numpy for python3'
  python3 -c 'import wheel' 2>/dev/null || skip 'no wheel for python3 (python3-wheel)'
  python3 -c 'import ensurepip' 2>/dev/null || skip 'no ensurepip for python3 (python3-venv)'
  if [[ ! $wheel ]]; then
    "$GEWEBE_ROOT/scripts/wheel" "$BUILD" "$PWD" >log
    wheel=$(echo gewebe-*.whl)
  fi
  [[ $wheel == *"-py3-none-manylinux_$(getconf GNU_LIBC_VERSION | sed 's/glibc //; s/\./_/')_$(uname -m).whl" ]] || fail "another tag: $wheel"
  python3 -m venv --system-site-packages env
  env/bin/pip install -q --no-index --no-deps --disable-pip-version-check "$wheel"
  unset PYTHONPATH
  PATH=$PWD/env/bin:/usr/bin:/bin
}

# The examples of the page, one after the other in one folder.
try_page() {
  local block count=0
  awk '/^\.Sh /{ inside = $2 == "EXAMPLES" } inside && /^\.Bd /{ out = sprintf("block.%02d", ++n); next } /^\.Ed/{ out = "" } out { print > out }' "$1"
  sed -i -e 's/\\e/\\/g' -e 's/\\&//g' block.*
  for block in block.*; do
    (cd work && ../env/bin/python "../$block") >out 2>err || fail "$block ends with status $?" "$(<"$block")" "$(<err)"
    [[ ! -s err ]] || fail "$block is not silent" "$(<err)"
    count=$((count + 1))
  done
  ((count >= 3)) || fail "$count examples"
}

test_installed_it_does_what_it_says() {
  install_wheel
  local file loaded
  # Every library comes with it, but those of glibc and GCC.
  for file in env/bin/{csg,emboss-render,exp2ela,ffe-precompute,ffe-run,gewebe,mc-opt,metaball2vol,voxelize} env/lib/gewebe/*; do
    loaded=$(ldd "$file")
    ! grep 'not found' <<<"$loaded" || fail "$file lacks a library"
    ! awk '$2 == "=>" { print $3 }' <<<"$loaded" | grep -v "^$PWD/env/" |
      grep -vE '/(libc|libm|libdl|libresolv|libpthread|librt|libgcc_s|libstdc\+\+)\.so\.[0-9]+$' || fail "$file loads what is not in the wheel"
  done
  # All that stands in it has a licence beside it.
  [[ $(find env/lib -path '*gewebe-*.dist-info/licenses/*' -name 'lib*' | wc -l) -gt 30 && $(find env/lib -path '*licenses/LICENSE') ]] ||
    fail 'licences are missing'
  [[ -s env/share/man/man1/ffe-run.1 ]] || fail 'no manual'
  # A volume, which is read by what is loaded when one comes.
  echo '0 0 0 20' | metaball2vol --voxel 1 | emboss-render --backend cpu --size 32 -o slice.png
  mkdir work
  (cd work && GEWEBE_TEST_WHEEL=1 ../env/bin/python "$GEWEBE_ROOT/tests/wheel/test_gewebe.py") >log 2>&1 || fail "$(tail -30 log)"
  tail -3 log
  has_module h5py || return 0
  try_page "$GEWEBE_ROOT/man/gewebe_python.7"
}
