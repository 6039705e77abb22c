# What users expect of any program: --version with all that a report of a fault needs, one command that starts them all.
# shellcheck shell=bash disable=SC2154 # `words` is set by sample()

# The libraries that --version may tell, and their names for ldd.
declare -A library_of=([assimp]=assimp [CHOLMOD]=cholmod [HDF5]=hdf5_serial [libpng]=png16 [oneTBB]=tbb [OpenVDB]=openvdb [zlib]=z)

version_tells() { # TEXT NAME: the version, or nothing
  sed -n "s/^libraries:.* $2 \([0-9.]*\).*/\1/p" <<<"$1"
}
check_version() { # TOOL
  local text loaded name told
  text=$("$1" --version)
  [[ $(tail -1 <<<"$text") == 'kernels: '* && $text == "$1 (Gewebe) $(sed -n 's/^VERSION := //p' "$GEWEBE_ROOT/Makefile")"* ]] ||
    fail "$1 --version says:" "$text"
  [[ ! $commit || $(head -1 <<<"$text") == *", commit $commit" ]] || fail "$1 does not tell commit $commit:" "$text"
  # All that it loads of these, and no other.
  loaded=$(ldd "$BUILD/$1")
  for name in "${!library_of[@]}"; do
    told=$(version_tells "$text" "$name")
    if grep -q "^[[:space:]]*lib${library_of[$name]}[-.0-9_]*\.so" <<<"$loaded"; then
      [[ $told == *[0-9].[0-9]* ]] || fail "$1 loads $name and does not tell its version:" "$text"
    else
      [[ ! $told ]] || fail "$1 tells a $name that it does not load"
    fi
  done
}

test_version_tells_commit_libraries_and_kernels() {
  local tool commit version
  commit=$("$GEWEBE_ROOT/scripts/commit")
  # Those that were linked before the last commit tell an earlier one.
  for tool in $(programs) gewebe; do
    [[ ! $commit || $("$tool" --version) == *"commit $commit"* ]] || { left_out "$tool of another commit than $commit"; commit=; }
  done
  for tool in $(programs) gewebe; do
    check_version "$tool"
  done
  # It is that of the package.
  if command -v dpkg-query >/dev/null && version=$(dpkg-query -W -f '${Version}' libopenvdb10.0 2>/dev/null); then
    [[ $version == "$(version_tells "$(csg --version)" OpenVDB)-"* ]] || fail "the package is $version:" "$(csg --version)"
  fi
  [[ $(exp2ela --version) == *'CGAL 5.'* && $(csg --version) != *CGAL* ]] || fail 'who uses CGAL?' "$(exp2ela --version)"
  [[ $(GEWEBE_CPU=baseline csg --version) == *$'\nkernels: baseline' ]] || fail 'other kernels than GEWEBE_CPU says'
  # What this machine does not have is as good as its best.
  [[ $(GEWEBE_CPU=avx512 csg --version) == "$(env -u GEWEBE_CPU csg --version)" ]] || fail 'other kernels than the best of this machine'
  GEWEBE_CPU=x87 expect_failure 1 csg csg --version
}

# A copy of the folder without git, as `git archive` makes it, knows its commit; one that is neither knows none.
test_an_archive_knows_its_commit() {
  command -v git >/dev/null || skip 'no git'
  git -C "$GEWEBE_ROOT" rev-parse HEAD >/dev/null 2>&1 || skip 'no repository'
  git -C "$GEWEBE_ROOT" ls-files --error-unmatch scripts/commit >/dev/null 2>&1 || skip 'scripts/commit is in no commit yet'
  mkdir archive copy
  git -C "$GEWEBE_ROOT" archive HEAD scripts/commit .gitattributes | tar -x -C archive
  [[ $(archive/scripts/commit) ]] || fail 'an archive knows no commit'
  [[ $(git -C "$GEWEBE_ROOT" rev-parse HEAD) == "$(archive/scripts/commit)"* ]] || fail "another commit: $(archive/scripts/commit)"
  cp -r "$GEWEBE_ROOT/scripts" copy/
  [[ ! $(copy/scripts/commit) ]] || fail "a copy invents a commit: $(copy/scripts/commit)"
}

test_gewebe_starts_every_program() {
  local tool listed
  # The list has all programs, with the words of their pages.
  listed=$(gewebe --list | sed 's/  */ /')
  [[ $(cut -d ' ' -f 1 <<<"$listed" | sort) == "$(programs | sort)" ]] || fail 'gewebe --list is not all programs:' "$listed"
  for tool in $(programs); do
    grep -qxF "$tool $(sed -n 's/^\.Nd //p' "$GEWEBE_ROOT/man/$tool.1")" <<<"$listed" || fail "gewebe --list has other words than man/$tool.1"
    cmp <("$tool" --help) <(gewebe "$tool" --help) || fail "gewebe $tool is another"
    cmp <("$tool" --help) <(gewebe help "$tool") || fail "gewebe help $tool is another"
  done
  # Streams, messages and status are the program's.
  sample csg
  cmp <("${words[@]}") <(gewebe "${words[@]}") || fail 'another result'
  expect_failure 1 csg gewebe csg add nowhere.vdb nowhere.vdb
  expect_failure 2 csg gewebe csg --nothing
  # Where a manual stands beside the programs, `man` is asked to show the page.
  mkdir -p bin share/man/man5
  cp "$BUILD/gewebe" bin/
  cp "$GEWEBE_ROOT/man/gewebe_materials.5" share/man/man5/
  printf '#!/bin/sh\necho "$@"\n' >bin/man
  chmod +x bin/man
  [[ $(PATH=$PWD/bin:$PATH bin/gewebe help materials) == "-l $PWD/share/man/man5/gewebe_materials.5" ]] || fail 'it shows another page'
  # In the tree that the programs are built in, the pages of other things than programs are found.
  mkdir -p tree/build/release tree/man
  cp "$BUILD/gewebe" tree/build/release/
  touch tree/man/scene.5
  [[ $(PATH=$PWD/bin:$PATH tree/build/release/gewebe help scene) == "-l $PWD/tree/man/scene.5" ]] || fail 'the page of the tree is not shown'
  # What people look for has another name.
  expect_failure 2 gewebe gewebe convert
  [[ $(gewebe convert in.obj out.ply 2>&1 || true) == *"no program 'convert', but exp2ela --to KIND"* ]] || fail 'no advice'
  # It starts what stands beside it, not what the PATH holds.
  mkdir other
  printf '#!/bin/sh\necho other\n' >other/csg
  chmod +x other/csg
  [[ $(PATH=$PWD/other:$PATH gewebe csg --version) == *Gewebe* ]] || fail 'it took another csg'
  cp "$BUILD/gewebe" alone
  expect_failure 1 gewebe ./alone csg
  expect_failure 2 gewebe gewebe
  expect_failure 2 gewebe gewebe --nothing
  expect_failure 2 gewebe gewebe --list csg
  expect_failure 1 gewebe gewebe help nothing
  [[ $(gewebe mcopt 2>&1 || true) == *'did you mean mc-opt?'* ]] || fail 'no suggestion'
  [[ ! -c /dev/full ]] || expect_failure 1 gewebe gewebe --list >/dev/full
}

# Who cites Gewebe is told the version that the programs tell.
test_citation_is_of_this_version() {
  local version
  version=$(sed -n 's/^version: //p' "$GEWEBE_ROOT/CITATION.cff")
  [[ $version && $(csg --version) == "csg (Gewebe) $version"[,$'\n']* ]] || fail "CITATION.cff is of version '$version'" "$(csg --version)"
}
