# scripts/check-includes sees each kind of wrong include, scripts/check-nan each way to lose a NaN.
# shellcheck shell=bash

check() { # FILE LINE...: complaints about a file with these lines
  mkdir -p "$(dirname "$1")"
  printf '%s\n' "${@:2}" >"$1"
  CHECK_ROOT=$PWD "$GEWEBE_ROOT/scripts/${script:-check-includes}" "$1" 2>&1
}
right() { check "$@" >said.txt || fail "complained about $*:" "$(<said.txt)"; }
wrong() { ! check "$@" >said.txt || fail "passed: $*"; }

test_directions() {
  right tools/a.cpp '#include "formats/stream/stream.h"' '#include "surface/x.h"' '#include "tools/cli/cli.h"' '#include "tools/run/x.h"'
  right tools/run/a.cpp '#include "formats/scene/x.h"' '#include "tools/cli/cli.h"'
  right formats/volume/a.cpp '#include "volume/grid.h"' '#include <openvdb/openvdb.h>'
  right lib/surface/a.cpp '#include "mesh/x.h"' '#include "base/x.h"' '#include "surface/x.h"' '#include <cmath>'
  right tests/unit/a.cpp '#include "mesh_fixtures.h"' '#include "scene/x.h"' '#include "tools/run/x.h"'
  wrong lib/volume/a.cpp '#include "surface/x.h"'
  wrong lib/model/a.cpp '#include "surface/x.h"'
  wrong lib/base/a.cpp '  #  include "volume/x.h"'
  wrong lib/model/a.cpp '#include "formats/stream/stream.h"'
  wrong formats/mesh/a.cpp '#include "formats/store/x.h"'
  wrong formats/mesh/a.cpp '#include "tools/cli/cli.h"'
  wrong tools/cli/a.cpp '#include "tools/run/x.h"'
  wrong lib/model/a.cpp '#include "x.h"'
  wrong lib/model/a.cpp '#include "tests/x.h"'
  wrong lib/another/a.cpp '#include "base/x.h"'
  wrong formats/a.cpp '#include "base/x.h"'
}

test_headers() {
  right lib/base/a.h '#pragma once' '#include <vector>' '#include "base/error.h"'
  right lib/volume/a_internal.h '#pragma once' '#include <openvdb/openvdb.h>'
  wrong lib/base/a.h '#pragma once' '#include <openvdb/openvdb.h>'
  wrong formats/mesh/a.h '#pragma once' '#include <nlohmann/json.hpp>'
  wrong lib/volume/a.h '#pragma once' '#include "volume/b_internal.h"'
  wrong lib/base/a.h '#include <vector>'
}

test_namespaces() {
  right lib/fem/a.h '#pragma once' 'namespace gewebe::fem {' 'struct A {};' '} // namespace gewebe::fem'
  right lib/fem/a.cpp 'namespace gewebe::fem {' 'namespace {' '} // namespace' '} // namespace gewebe::fem'
  right lib/fem/a.cpp 'namespace gewebe::fem::a {' '} // namespace gewebe::fem::a'
  right lib/fem/a.h '#pragma once' 'namespace gewebe::model {' 'class Model;' '} // namespace gewebe::model' '' 'namespace gewebe::fem {' '} // namespace gewebe::fem'
  right lib/base/a.cpp 'namespace gewebe {' '} // namespace gewebe'
  right formats/mesh/a.cpp 'namespace gewebe::formats {' '} // namespace gewebe::formats'
  right tools/run/a.cpp 'namespace gewebe::cli {' '} // namespace gewebe::cli'
  right tests/unit/a.cpp 'namespace gewebe::test {' '} // namespace gewebe::test'
  wrong lib/fem/a.cpp 'namespace gewebe {' '} // namespace gewebe'
  wrong lib/fem/a.cpp 'namespace gewebe::model {' 'int f() {' '} // namespace gewebe::model'
  wrong lib/base/a.cpp 'namespace gewebe::base {' 'int f() {' '} // namespace gewebe::base'
  wrong lib/fem/a.h '#pragma once' 'struct A {};'
  wrong formats/mesh/a.cpp 'namespace gewebe {' '} // namespace gewebe'
  wrong tools/run/a.cpp 'namespace gewebe {' '} // namespace gewebe'
}

test_installed_headers() {
  mkdir -p lib
  printf '%s\n' '# a comment' 'base/a.h' 'formats/mesh/b.h # another' >lib/PUBLIC
  right formats/mesh/b.h '#pragma once' '#include "base/a.h"' '#include <vector>'
  right lib/base/own.h '#pragma once' '#include "base/other.h"'
  right lib/base/a.cpp '#include "base/own.h"'
  wrong lib/base/a.h '#pragma once' '#include "base/own.h"'
  wrong formats/mesh/b.h '#pragma once' '#include "formats/stream/own.h"'
}

test_other_rules() {
  wrong lib/volume/a_avx2.cpp '#include <openvdb/openvdb.h>'
  wrong lib/volume/a_avx2.cpp '#include <vector>'
  wrong lib/model/a.cpp '#include <fstream>'
  wrong lib/model/a.cpp 'const char* x = std::getenv("X");'
}

test_no_comparison_lets_a_nan_pass() {
  local script=check-nan
  right tests/unit/a.cpp 'worst = test::larger(worst, x);' 'const double b = std::max(c, d);' 'base = 1.0;'
  right tests/unit/a.cpp 't.i = std::min(i, j);' 'f({.i = std::min(i, j)});' 'for (int k = 0; k < std::min(k, n); ++k)'
  right tests/unit/a.cpp 'if (!(x <= worst))' '  worst = x;' 'if (p[i] > p[top])' '  top = i;' 'if (worst > 1)' '  y = 2;'
  right tests/unit/a.cpp '// worst = std::max(worst, x);'
  wrong tests/unit/a.cpp 'worst = std::max(worst, x);'
  wrong tests/unit/a.h '  row.least = std::fmin(row.least, x[k]);'
  wrong tests/bench/a.cpp 'worst = std::max(' '    worst, difference(a, b));'
  wrong tests/unit/a.cpp 'worst = std::max(std::abs(x), worst);'
  wrong tests/unit/a.cpp 'most = std::max({most, a, b});'
  wrong tests/unit/a.cpp 'for (int k = 0; k < 3; ++k)' '  range.max[k] = std::max<double>(range.max[k], p[k]);'
  wrong tests/stress/a.cpp 'worst = x > worst ? x : worst;'
  wrong tests/stress/a.cpp 'worst = worst < x ? x : worst;'
  wrong tests/unit/a.cpp 'if (norm(a[i] - b[i]) > worst)' '  worst = norm(a[i] - b[i]);'
  wrong tests/unit/a.cpp 'if (worst < x) {' '  worst = x;' '  at = i;' '}'
  find "$GEWEBE_ROOT/tests" -name '*.cpp' -o -name '*.h' | sed "s|^$GEWEBE_ROOT/||" >files.txt
  (cd "$GEWEBE_ROOT" && xargs "scripts/$script") <files.txt >said.txt 2>&1 || fail "$(<said.txt)"
}

test_no_name_is_defined_twice() {
  local script=check-names
  twice() { # HEADER-LINE SOURCE-LINE: whether a file passes beside a header
    mkdir -p lib/a
    printf '%s\n' 'namespace gewebe {' "$1" '} // namespace gewebe' >lib/a/a.h
    printf '%s\n' 'namespace gewebe {' "$2" '} // namespace gewebe' >lib/a/b.cpp
    CHECK_ROOT=$PWD "$GEWEBE_ROOT/scripts/check-names" lib/a/a.h "${@:3}" lib/a/b.cpp >said.txt 2>&1
  }
  twice 'struct Point {' 'struct Other {' || fail "$(<said.txt)"
  twice 'struct Point {' 'struct Point;' || fail "$(<said.txt)"
  twice 'inline int f(int a) {' 'inline int f(double a) {' || fail "$(<said.txt)"
  ! twice 'struct Point {' 'class Point final : public Base {' || fail 'a type in two files passed'
  ! twice 'inline int f(int a) {' 'inline int f(int a) {' || fail 'a function in two files passed'
  ! twice 'struct Point {' $'struct Point final\n    : public Base {' || fail 'a type whose bases are below passed'
  twice 'inline constexpr int count = 3;' 'constexpr int count = 3;' || fail "$(<said.txt)"
  ! twice 'inline constexpr int count = 3;' 'inline constexpr double count = 3;' || fail 'a variable in two files passed'
  twice $'template <class T>\nint f(T a) {' $'template <class T>\nint f(T a, int b) {' || fail "$(<said.txt)"
  ! twice $'template <class T>\nint f(T a) {' $'template <class T>\nint f(T a) {' || fail 'a function template in two files passed'
  # A program of its own.
  ! twice 'struct Point {' 'struct Point {' --alone || fail 'a type of a program and of a header passed'
  mkdir -p lib/b && cp lib/a/b.cpp lib/b/b.cpp
  twice 'struct Other {' 'struct Point {' --alone lib/b/b.cpp || fail "$(<said.txt)"
  ! twice 'struct Other {' 'struct Point {' lib/b/b.cpp || fail 'a type of two sources passed'
}

test_unity_units_have_no_clashes() {
  group() { # how many units a.cpp, which has LINE in an anonymous namespace, and b.cpp with b.h make
    printf '%s\n' 'namespace gewebe {' 'namespace {' "$1" '} // namespace' '} // namespace gewebe' >lib/a/a.cpp
    CHECK_ROOT=$PWD "$GEWEBE_ROOT/scripts/unity" units 2000 lib/a/a.cpp lib/a/b.cpp | wc -l
  }
  mkdir -p lib/a
  printf '%s\n' '#pragma once' 'namespace gewebe {' 'struct Hidden {' '  int member = 0;' '};' '} // namespace gewebe' >lib/a/b.h
  printf '%s\n' '#include "a/b.h"' 'namespace gewebe {' 'namespace {' 'int own(int local) {' '  return called(local);' '}' '} // namespace' \
    '} // namespace gewebe' >lib/a/b.cpp
  local line
  for line in 'int other(int a) {' 'double local(int a) {' 'using Vector = int;'; do
    [[ $(group "$line") == 1 ]] || fail "apart without need: $line"
  done
  # A name of the other file, a function that it would call, a type of a header that only the other file includes.
  for line in 'constexpr int first = 1, own = 2;' 'int own(double a) {' 'double called(double a) {' 'struct Hidden {' 'constexpr int Hidden = 1;'; do
    [[ $(group "$line") == 2 ]] || fail "in one unit: $line"
  done
  [[ $(<units/lib/a/lib-a-a.cpp) == '#include "lib/a/a.cpp"' ]] || fail "$(<units/lib/a/lib-a-a.cpp)"
  # What needs a library through a file beside the header that it includes.
  printf '%s\n' '#include <CGAL/Surface_mesh.h>' >lib/a/c_cgal.cpp
  printf '%s\n' '#pragma once' >lib/a/c.h
  printf '%s\n' '#include "a/c.h"' >>lib/a/b.cpp
  [[ $(group 'int other(int a) {') == 2 ]] || fail 'users of different libraries are in one unit'
}
