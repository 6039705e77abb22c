# scripts/check-includes sees each kind of wrong include.
# shellcheck shell=bash

check() { # FILE LINE...: complaints about a file with these lines
  mkdir -p "$(dirname "$1")"
  printf '%s\n' "${@:2}" >"$1"
  CHECK_ROOT=$PWD "$GEWEBE_ROOT/scripts/check-includes" "$1" 2>&1
}
right() { check "$@" >said.txt || fail "complained about $*:" "$(<said.txt)"; }
wrong() { ! check "$@" >said.txt || fail "passed: $*"; }

test_directions() {
  right tools/a.cpp '#include "formats/stream.h"' '#include "surface/x.h"' '#include "tools/cli.h"'
  right formats/a.cpp '#include "volume/grid.h"' '#include <openvdb/openvdb.h>'
  right lib/model/a.cpp '#include "surface/x.h"' '#include "base/x.h"' '#include <cmath>'
  wrong lib/volume/a.cpp '#include "surface/x.h"'
  wrong lib/base/a.cpp '  #  include "volume/x.h"'
  wrong lib/model/a.cpp '#include "formats/stream.h"'
  wrong formats/a.cpp '#include "tools/cli.h"'
  wrong lib/model/a.cpp '#include "x.h"'
  wrong lib/model/a.cpp '#include "tests/x.h"'
}

test_public_headers() {
  right lib/base/a.h '#pragma once' '#include <vector>' '#include "base/vec3.h"'
  right lib/volume/a_internal.h '#pragma once' '#include <openvdb/openvdb.h>'
  wrong lib/base/a.h '#pragma once' '#include <openvdb/openvdb.h>'
  wrong formats/a.h '#pragma once' '#include <nlohmann/json.hpp>'
  wrong lib/volume/a.h '#pragma once' '#include "volume/b_internal.h"'
  wrong lib/base/a.h '#include <vector>'
}

test_other_rules() {
  wrong tools/a.cpp '#include <CLI/App.hpp>'
  right tools/cli.cpp '#include <CLI/App.hpp>'
  wrong lib/volume/a_avx2.cpp '#include <openvdb/openvdb.h>'
  wrong lib/volume/a_avx2.cpp '#include <vector>'
  wrong lib/model/a.cpp '#include <fstream>'
  wrong lib/model/a.cpp 'const char* x = std::getenv("X");'
}
