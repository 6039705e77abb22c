# `make install`, what it lays down, and `make uninstall`.
# shellcheck shell=bash

staged_make() { # GOAL PREFIX [VARIABLE=VALUE]
  "${MAKE:-make}" --no-print-directory -s -C "$GEWEBE_ROOT" "$1" config="$(basename "$BUILD")" DESTDIR="$PWD/stage" PREFIX="$2" "${@:3}" ||
    fail "make $1 failed"
}

# The example as a stranger makes it; its answers are those of the programs.
test_a_program_of_a_stranger() {
  local there=$PWD/stage/opt/gewebe
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  staged_make install /opt/gewebe
  export PKG_CONFIG_SYSROOT_DIR=$PWD/stage PKG_CONFIG_PATH=$there/lib/pkgconfig
  [[ $(pkg-config --modversion gewebe) == "$(sed -n 's/^VERSION := //p' "$GEWEBE_ROOT/Makefile")" ]] || fail 'another version in gewebe.pc'
  cp "$GEWEBE_ROOT"/examples/library/{Makefile,organ.cpp} .
  (unset MAKEFLAGS MAKELEVEL; make -s CXX="${CXX:-g++}" CXXFLAGS='-O1 -Wall -Wextra -Werror' organ) || fail 'the example does not compile'
  ./organ organ.ela pulled.ply >said || fail 'the example fails'
  # The model is what the programs make of the same particles, and its node goes where theirs does.
  printf '%s\n' '0 0 0 12' '9 0 0 10' >two.particles
  metaball2vol --voxel 1 two.particles | mc-opt - | exp2ela --name organ - -o expected.ela
  cmp organ.ela expected.ela || fail 'another model than that of the programs'
  printf '%s\n' 'object organ organ.ela method=ffe' 'emit shapes' 'force organ 0 0 0 1000' 'step' >pull.scene
  ffe-run pull.scene >answer
  [[ $(wc -w <said) == 3 ]] || fail "the example said: $(<said)"
  awk 'NR == FNR { split($0, a); next }
    next_line { for (k = 1; k <= 3; ++k) if (!(($k - a[k]) ^ 2 < 1e-12)) bad = 1; met = 1; next_line = 0 }
    /^shapes organ/ { next_line = 1 } END { exit bad || !met }' said answer ||
    fail "the node is at $(<said), not where ffe-run has it:" "$(head -5 answer)"
  [[ $(head -c 3 pulled.ply) == ply ]] || fail 'no surface was written'
}

test_installed_headers_stand_alone() {
  local header
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  staged_make install /opt/gewebe
  while read -r header; do
    echo "#include \"$header\""
  done < <(cd stage/opt/gewebe/include/gewebe && find . -name '*.h' | sort | sed 's|^\./||') >all.cpp
  [[ $(wc -l <all.cpp) == "$(grep -c '^[^#]' "$GEWEBE_ROOT/lib/PUBLIC")" ]] || fail 'others were installed than lib/PUBLIC lists:' "$(<all.cpp)"
  # Each for itself; together they would help each other.
  while read -r header; do
    echo "$header" | ${CXX:-g++} -std=c++20 -Wall -Wextra -Wshadow -Wconversion -Werror -fsyntax-only -I stage/opt/gewebe/include/gewebe -x c++ - ||
      fail "$header does not stand alone"
  done <all.cpp
}

test_uninstall_leaves_nothing() {
  local left
  staged_make install /opt/gewebe
  find stage -type f | sort >laid
  grep -q 'bin/' laid || fail 'no program was installed'
  grep -q 'lib/gewebe/gewebe-volume.so' laid || fail 'what reads volumes was not installed'
  metaball2vol --voxel 2 "$GEWEBE_ROOT"/tests/golden/in/five.particles | stage/opt/gewebe/bin/emboss-render --size 8 -o slice.png ||
    fail 'the installed program sees no volume'
  mv stage/opt/gewebe/lib/gewebe/gewebe-volume.so away.so
  metaball2vol --voxel 2 "$GEWEBE_ROOT"/tests/golden/in/five.particles >in.vdb
  expect_failure 1 emboss-render stage/opt/gewebe/bin/emboss-render in.vdb -o slice.png
  mv away.so stage/opt/gewebe/lib/gewebe/gewebe-volume.so
  grep -q 'share/man/man1/' laid || fail 'no man page was installed'
  grep -q 'lib/pkgconfig/gewebe.pc' laid || fail 'no gewebe.pc was installed'
  grep -q bash-completion/completions/gewebe laid || fail 'no completions were installed'
  ! grep -q _internal laid || fail 'an internal header was installed'
  staged_make uninstall /opt/gewebe
  [[ ! -d stage ]] || left=$(find stage -mindepth 1)
  [[ -z ${left-} ]] || fail 'left after uninstall:' "$left"
}

test_uninstall_leaves_what_is_not_ours() {
  mkdir -p stage/usr/local/bin stage/usr/local/include/other
  echo other >stage/usr/local/bin/other
  staged_make install /usr/local
  staged_make uninstall /usr/local
  [[ $(find stage -type f -o -type d -empty | sort | tr '\n' ' ') == 'stage/usr/local/bin/other stage/usr/local/include/other ' ]] ||
    fail 'uninstall left or took too much:' "$(find stage)"
}

loads() { # TOOL LIBRARY; no pipe into grep -q, which would end ldd early
  local libraries
  libraries=$(ldd "$BUILD/$1")
  grep -q "lib$2[-.0-9_]*\.so" <<<"$libraries"
}

# What it loads of the large libraries, by program: each must be there or absent, so that the test can see both.
test_programs_load_only_what_they_use() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  local tool library uses
  for tool in $(programs) gewebe; do
    case $tool in
      gewebe) uses=' ' ;;
      metaball2vol | csg) uses=' openvdb ' ;;
      voxelize | mc-opt) uses=' openvdb assimp ' ;;
      exp2ela) uses=' assimp hdf5_serial cholmod ' ;; # --fit and --accuracy solve, and scenes may have stores
      ffe-precompute | ffe-run) uses=' hdf5_serial cholmod ' ;;
      emboss-render) uses=' assimp hdf5_serial epoxy png ' ;;
      *) fail "what may $tool load?" ;;
    esac
    for library in openvdb assimp hdf5_serial cholmod epoxy png; do
      if [[ $uses == *" $library "* ]]; then
        loads "$tool" "$library" || fail "$tool does not load $library"
      else
        ! loads "$tool" "$library" || fail "$tool loads $library"
      fi
    done
  done
}
