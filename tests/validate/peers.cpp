#include "tests/validate/peers.h"

#include "tests/bench/peer.h"
#include "tests/unit/larger.h"
#include "tests/unit/relative_difference.h"
#include "tests/validate/peer_folder.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <span>
#include <utility>

namespace gewebe::validate {

namespace {

const char* const script = "tests/validate/peer_skfem.py";

std::string first_line(const std::string& command) {
  FILE* const from = popen(command.c_str(), "r");
  std::string line;
  char part[256];
  if (from != nullptr && std::fgets(part, sizeof part, from) != nullptr)
    line = part;
  if (from != nullptr)
    (void)pclose(from);
  return line.substr(0, line.find('\n'));
}

} // namespace

std::string peer_name() {
  static const std::string name = [] {
    const char* const python = std::getenv("PYTHON");
    return first_line(std::string(python != nullptr ? python : "python3") +
                      " -c 'import scipy, skfem; text = \"scikit-fem \" + skfem.__version__\n"
                      "try: import sksparse; text += \", CHOLMOD by scikit-sparse \" + "
                      "sksparse.__version__\n"
                      "except ImportError: text += \", SuperLU by SciPy \" + scipy.__version__\n"
                      "print(text)' 2>/dev/null");
  }();
  return name;
}

std::optional<Answer> solve_by_peer(const test::SolidCase& c, PeerElement element, PeerWish* wish) {
  if (peer_name().empty())
    return {};
  const Folder folder;
  const tetrahedra::TetMesh& mesh = c.solid.mesh;
  std::vector<double> points, lame, given = c.given;
  for (const Vec3& p : mesh.points)
    points.insert(points.end(), {p.x, p.y, p.z});
  for (const fem::SolidElement& e : c.solid.elements)
    lame.insert(lame.end(), {e.material.lambda, e.material.mu});
  given.resize(c.load.size());
  std::vector<std::uint32_t> corners, middles;
  for (const Tetrahedron& t : mesh.tetrahedra)
    corners.insert(corners.end(), t.begin(), t.end());
  for (const EdgeMiddles& m : mesh.middles)
    middles.insert(middles.end(), m.begin(), m.end());
  write<double>(folder, "points.f64", points);
  write<double>(folder, "lame.f64", lame);
  write<double>(folder, "load.f64", c.load);
  write<double>(folder, "given.f64", given);
  write<std::uint32_t>(folder, "tetrahedra.u32", corners);
  write<std::uint32_t>(folder, "middles.u32", middles);
  write<std::uint8_t>(folder, "fixed.u8", c.solid.fixed);
  const char* const word = element == PeerElement::linear  ? " linear"
                           : element == PeerElement::plain ? " plain"
                                                           : " mixed";
  std::string command = std::string(script) + " " + folder.path.string() + word;
  if (wish != nullptr && wish->matrix != nullptr)
    command += " matrix";
  if (wish != nullptr && wish->node)
    command += " stress " + std::to_string(*wish->node);
  const std::vector<double> numbers = timing::numbers_of_script(command);
  if (numbers.size() != 5 || numbers[0] != static_cast<double>(c.solid.unknowns()))
    throw Error("the peer gave no answer: run " + std::string(script) + " by hand");
  Answer answer;
  answer.u = read<double>(folder, "u.f64");
  if (answer.u.size() != c.load.size())
    throw Error("the peer gave displacements of other nodes");
  answer.cost = {c.solid.unknowns(), numbers[1], numbers[2], numbers[3], 0};
  if (wish != nullptr && wish->matrix != nullptr)
    *wish->matrix = {read<std::int64_t>(folder, "column_start.i64"),
                     read<std::int64_t>(folder, "row.i64"), read<double>(folder, "value.f64")};
  if (wish != nullptr && wish->node) {
    const std::vector<double> stress = read<double>(folder, "stress.f64");
    if (stress.size() != wish->stress.size())
      throw Error("the peer gave no stress");
    std::ranges::copy(stress, wish->stress.begin());
  }
  return answer;
}

std::optional<Figure> figure_by_peer(const test::SolidCase& c, PeerElement element) {
  const std::optional<Answer> answer = solve_by_peer(c, element);
  if (!answer)
    return {};
  return Figure{c.read(c.solid, answer->u), answer->cost};
}

double difference(const linalg::StiffnessMatrix& ours, const PeerMatrix& peers) {
  if (peers.column_start.size() != ours.column_start.size())
    return HUGE_VAL;
  double most = 0, whole = 0;
  std::map<std::int64_t, double> column;
  const auto range = [](const std::vector<std::int64_t>& start, std::size_t c) {
    return std::pair(static_cast<std::size_t>(start[c]), static_cast<std::size_t>(start[c + 1]));
  };
  for (std::size_t c = 0; c < ours.order(); ++c) {
    column.clear();
    for (auto [k, end] = range(ours.column_start, c); k < end; ++k) {
      column[ours.row[k]] += ours.value[k];
      whole = test::larger(whole, std::abs(ours.value[k]));
    }
    for (auto [k, end] = range(peers.column_start, c); k < end; ++k)
      column[peers.row[k]] -= peers.value[k];
    for (const auto& [row, left] : column)
      most = test::larger(most, std::abs(left));
  }
  return most / whole;
}

namespace {

/// K of plain quadratic elements, which no solid of ours is made of: on all axes, by sums over
/// pairs of nodes.
linalg::StiffnessMatrix plain_stiffness(const test::Solid& solid) {
  std::vector<std::map<std::int64_t, double>> columns(solid.fixed.size());
  for (std::size_t t = 0; t < solid.elements.size(); ++t)
    for (std::size_t a = 0; a < 10; ++a)
      for (std::size_t b = 0; b < 10; ++b) {
        const fem::SolidBlock block = fem::plain_quadratic_block(solid.elements[t], a, b);
        for (std::size_t k = 0; k < 9; ++k) {
          const std::size_t row = 3 * std::size_t{solid.node(t, a)} + k / 3,
                            column = 3 * std::size_t{solid.node(t, b)} + k % 3;
          if (row >= column)
            columns[column][static_cast<std::int64_t>(row)] += block[k];
        }
      }
  linalg::StiffnessMatrix k;
  k.column_start.push_back(0);
  for (const auto& column : columns) {
    for (const auto& [row, value] : column) {
      k.row.push_back(row);
      k.value.push_back(value);
    }
    k.column_start.push_back(static_cast<std::int64_t>(k.row.size()));
    k.axis_of_row.push_back(static_cast<std::int64_t>(k.axis_of_row.size()));
  }
  return k;
}

/// K, and u where it is ours.
void compare(Section& section, PeerElement element, const std::string& name) {
  const std::string source =
      "Gustafsson, McBain, scikit-fem: a Python package for finite element assembly, JOSS 5(52), "
      "2020";
  if (peer_name().empty()) {
    section.checks.push_back(skipped("K and u, " + name, source, no_peer));
    return;
  }
  tetrahedra::TetMesh box = test::distorted_box();
  for (std::size_t t = 0; t < box.tetrahedra.size(); ++t)
    box.material.push_back(t % 3 == 0);
  test::SolidCase c{
      {std::move(box), element != PeerElement::linear, {{2500, 0.3, 1e-3}, {400, 0.499, 1e-3}}},
      {},
      {},
      {}};
  for (std::size_t axis = 0; axis < 3; ++axis)
    c.solid.hold(axis, [](const Vec3& p) { return p.x == 0; });
  const tetrahedra::TetBoundary faces = tetrahedra::boundary(c.solid.mesh);
  c.load = fem::traction_load(c.solid.mesh, faces,
                              c.solid.triangles(faces, [](const Vec3& p) { return p.x == 2; }),
                              {3, -5, 7});
  PeerMatrix matrix;
  PeerWish wish{&matrix};
  const auto theirs = solve_by_peer(c, element, &wish);
  Check check{"K, " + name, source, "the same", "", 0, 1e-10, {}, {}};
  if (element == PeerElement::plain) {
    check.error = difference(plain_stiffness(c.solid), matrix);
    check.figure = text_of(check.error, 2) + " apart";
    section.checks.push_back(check);
    return;
  }
  const Answer ours = solve(c);
  check.cost = ours.cost;
  check.error = difference(fem::solid_stiffness(c.solid.mesh, c.solid.elements), matrix);
  check.figure = text_of(check.error, 2) + " apart";
  section.checks.push_back(check);
  check.what = "u, " + name;
  check.error = test::relative_difference(ours.u, theirs->u);
  check.figure = text_of(check.error, 2) + " apart";
  section.checks.push_back(check);
}

} // namespace

Section peers() {
  Section section{"Equal elements of another program",
                  "scikit-fem builds the same matrix on the same mesh: of linear elements, of "
                  "plain quadratic ones, and of ours, whose weak form (quadratic displacements and "
                  "a bubble, discontinuous linear pressure) is written independently and "
                  "condensed. The mesh is a box of distorted tetrahedra of two materials, one "
                  "nearly incompressible, held on one side, under a traction on the other." +
                      (peer_name().empty() ? "" : " The peer on this page: " + peer_name() + "."),
                  {},
                  {}};
  compare(section, PeerElement::linear, "linear");
  compare(section, PeerElement::plain, "plain quadratic");
  compare(section, PeerElement::mixed, "quadratic with bubble and pressure");
  return section;
}

} // namespace gewebe::validate
