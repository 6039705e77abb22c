#include "model/check.h"

#include "base/error.h"
#include "text/number_text.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>

namespace gewebe::model {

namespace {

void require_not_negative(double value, const char* what) {
  if (!(value >= 0 && std::isfinite(value)))
    throw Error(std::string(what) + " is " + text::number_text(value) +
                ", expected a finite number, 0 or more");
}

void require_positive(double value, const char* what) {
  if (!(value > 0 && std::isfinite(value)))
    throw Error(std::string(what) + " is " + text::number_text(value) +
                ", expected a finite number above 0");
}

void require_finite(double value, const char* what) {
  if (!std::isfinite(value))
    throw Error(std::string(what) + " is " + text::number_text(value) +
                ", expected a finite number");
}

std::string pair(const Spring& s) {
  return std::to_string(s.i) + " " + std::to_string(s.j);
}

const char* kind_word(SpringKind kind) {
  return kind == SpringKind::edge ? "e" : kind == SpringKind::bend ? "b" : "c";
}

} // namespace

void check_name(const std::string& name) {
  for (const char c : name)
    if (c == '"' || c == '#' || (c >= 0 && c < 0x20) || c == 0x7f)
      throw Error("the name holds a quote, '#' or a control character, expected none");
}

void ModelChecker::name() const {
  check_name(model_.name);
}

void ModelChecker::material(std::size_t i) const {
  const Material& m = model_.materials[i];
  check_name(m.name);
  require_positive(m.density, "density");
  require_not_negative(m.young, "young");
  require_positive(m.thickness, "thickness");
  require_not_negative(m.damping_ratio, "damping ratio");
  if (m.poisson && !(*m.poisson >= 0 && *m.poisson < 0.5))
    throw Error("Poisson's ratio is " + text::number_text(*m.poisson) +
                ", expected 0 to below 0.5");
  if (m.law && !m.poisson)
    throw Error("a law without a Poisson's ratio, expected both");
  if (m.law)
    check_law(*m.law);
  if (!m.prony.empty() && !m.poisson)
    throw Error("a Prony series without a Poisson's ratio, expected both");
  check_prony(m.prony);
}

void ModelChecker::begin_nodes(std::size_t count) {
  if (model_.materials.empty())
    throw Error("0 materials, expected at least one");
  if (count == 0)
    throw Error("0 nodes, expected at least one");
  if (count > INT32_MAX)
    throw Error(std::to_string(count) + " nodes, expected at most " + std::to_string(INT32_MAX));
  node_count_ = first_central_ = count;
  named_.assign(count, false);
}

void ModelChecker::node(std::size_t i) {
  const Node& n = model_.nodes[i];
  for (int a = 0; a < 3; ++a)
    require_finite(n.position[a], "coordinate");
  require_not_negative(n.mass, "mass");
  require_not_negative(n.drag, "drag");
  if (n.fixed > fixed_all)
    throw Error("unknown fixed axes, expected a subset of x, y, z");
  require_material(n.material);
  if (n.central == -1)
    return;
  if (n.central < -1 || static_cast<std::size_t>(n.central) >= node_count_)
    throw Error("central " + std::to_string(n.central) + " does not exist, expected -1 or below " +
                std::to_string(node_count_));
  const auto central = static_cast<std::size_t>(n.central);
  if (i >= first_central_)
    throw Error("node " + std::to_string(i) +
                " is central or behind a central node, its central is " + std::to_string(central) +
                ", expected -1");
  if (central <= i)
    throw Error("central " + std::to_string(central) +
                " is no central node, expected one behind node " + std::to_string(i));
  named_[central] = true;
  if (central < first_central_)
    first_central_ = central;
}

void ModelChecker::all_nodes() const {
  for (std::size_t i = first_central_; i < node_count_; ++i)
    if (!named_[i])
      throw Error("node " + std::to_string(i) +
                  " stands among the central nodes but belongs to no " +
                  "node, expected central nodes last");
}

void ModelChecker::normal(std::size_t i) const {
  for (int a = 0; a < 3; ++a)
    require_finite(model_.normals[i][a], "normal");
}

void ModelChecker::springs(std::size_t begin, std::size_t end) const {
  std::size_t merge = 0;
  if (begin < end && model_.springs[begin].kind == SpringKind::bend) {
    const Spring& first = model_.springs[begin];
    const auto at = std::lower_bound(
        model_.springs.begin(), model_.springs.begin() + static_cast<std::ptrdiff_t>(begin), first,
        [](const Spring& a, const Spring& b) {
          return a.kind == SpringKind::edge && std::tie(a.i, a.j) < std::tie(b.i, b.j);
        });
    merge = static_cast<std::size_t>(at - model_.springs.begin());
  }
  for (std::size_t i = begin; i < end; ++i)
    spring(i, merge);
}

/// `merge` is the first edge spring that is not below the last bending spring.
void ModelChecker::spring(std::size_t i, std::size_t& merge) const {
  const Spring& s = model_.springs[i];
  const std::vector<Node>& nodes = model_.nodes;
  if (s.j >= nodes.size() || s.i >= nodes.size())
    throw Error("node " + std::to_string(std::max(s.i, s.j)) + " does not exist, expected 0 to " +
                std::to_string(nodes.size() - 1));
  if (s.i >= s.j)
    throw Error("spring " + pair(s) + ", expected the smaller node first");
  require_not_negative(s.stiffness, "stiffness");
  require_not_negative(s.damping, "damping");
  require_not_negative(s.rest, "rest length");
  const Vec3 d = nodes[s.j].position - nodes[s.i].position;
  const double square = dot(d, d);
  if (!(square > 0 && std::isfinite(square)))
    throw Error("the ends of spring " + pair(s) +
                (square > 0 ? " are too far apart" : " coincide") +
                ", expected a finite distance above 0");
  if (s.kind == SpringKind::central) {
    if (nodes[s.i].central < 0 || static_cast<std::uint32_t>(nodes[s.i].central) != s.j)
      throw Error("spring " + pair(s) + " of kind c, expected node " + std::to_string(s.i) +
                  " and its central node " + std::to_string(nodes[s.i].central));
  } else if (s.j >= first_central_) {
    throw Error("spring " + pair(s) + " of kind " + kind_word(s.kind) +
                " ends at a central node, expected surface nodes");
  }
  if (i > 0) {
    const Spring& before = model_.springs[i - 1];
    const auto key = std::tie(s.kind, s.i, s.j);
    const auto key_before = std::tie(before.kind, before.i, before.j);
    if (key == key_before)
      throw Error("spring " + pair(s) + " stands twice, expected once");
    if (key < key_before)
      throw Error("spring " + pair(s) + " of kind " + kind_word(s.kind) + " stands behind " +
                  pair(before) + " of kind " + kind_word(before.kind) +
                  ", expected kinds e, b, c and ascending nodes");
  }
  if (s.kind == SpringKind::bend) {
    const auto below = [&](const Spring& e) { return std::tie(e.i, e.j) < std::tie(s.i, s.j); };
    const auto is_edge = [&] {
      return merge < i && model_.springs[merge].kind == SpringKind::edge;
    };
    while (is_edge() && below(model_.springs[merge]))
      ++merge;
    if (is_edge() && model_.springs[merge].i == s.i && model_.springs[merge].j == s.j)
      throw Error("spring " + pair(s) + " is of kind e and of kind b, expected one");
  }
}

void ModelChecker::corners(std::span<const std::uint32_t> index) const {
  for (std::size_t a = 0; a < index.size(); ++a) {
    if (index[a] >= node_count_)
      throw Error("node " + std::to_string(index[a]) + " does not exist, expected 0 to " +
                  std::to_string(node_count_ - 1));
    if (index[a] >= first_central_)
      throw Error("corner " + std::to_string(index[a]) +
                  " is a central node, expected a surface node");
    for (std::size_t b = 0; b < a; ++b)
      if (index[a] == index[b])
        throw Error("corner " + std::to_string(index[a]) +
                    " stands twice, expected different corners");
  }
}

void ModelChecker::triangle(std::size_t i) const {
  corners(model_.triangles[i]);
}

void ModelChecker::texcoord(std::size_t i) const {
  for (const double value : model_.texcoords[i])
    require_finite(value, "texture coordinate");
}

void ModelChecker::tetrahedron(std::size_t i) const {
  const Tetrahedron& t = model_.tetrahedra[i];
  std::vector<std::uint32_t> nodes(t.begin(), t.end());
  if (!model_.middles.empty())
    nodes.insert(nodes.end(), model_.middles[i].begin(), model_.middles[i].end());
  corners(nodes);
  const std::int32_t material = model_.tetrahedron_material[i];
  require_material(material);
  const Material& m = model_.materials[static_cast<std::size_t>(material)];
  if (!m.poisson)
    throw Error("material " + std::to_string(material) + " has no Poisson's ratio, expected one");
  require_positive(m.young, "young of an element's material");
  const auto at = [&](std::size_t a) { return model_.nodes[t[a]].position; };
  const Vec3 p = at(1) - at(0), q = at(2) - at(0), r = at(3) - at(0);
  if (!(dot(cross(p, q), r) > 0))
    throw Error("the tetrahedron has no positive volume, expected its nodes in VTK's order");
}

void ModelChecker::skin_point(std::size_t i) const {
  for (int a = 0; a < 3; ++a)
    require_finite(model_.skin.points[i][a], "coordinate");
  const std::uint32_t follows = model_.skin.tetrahedron[i];
  if (follows >= model_.tetrahedra.size())
    throw Error("tetrahedron " + std::to_string(follows) + " does not exist, expected 0 to " +
                std::to_string(model_.tetrahedra.size() - 1));
}

void ModelChecker::skin_triangle(std::size_t i) const {
  const Triangle& t = model_.skin.triangles[i];
  for (std::size_t a = 0; a < t.size(); ++a) {
    if (t[a] >= model_.skin.points.size())
      throw Error("point " + std::to_string(t[a]) + " does not exist, expected 0 to " +
                  std::to_string(model_.skin.points.size() - 1));
    if (t[a] == t[(a + 1) % t.size()])
      throw Error("corner " + std::to_string(t[a]) + " stands twice, expected different corners");
  }
  require_material(model_.skin.material[i]);
}

void ModelChecker::skin_texcoord(std::size_t i) const {
  for (const double value : model_.skin.texcoords[i])
    require_finite(value, "texture coordinate");
}

void ModelChecker::require_material(std::int32_t material) const {
  if (material < 0 || static_cast<std::size_t>(material) >= model_.materials.size())
    throw Error("material " + std::to_string(material) + " does not exist, expected 0 to " +
                std::to_string(model_.materials.size() - 1));
}

} // namespace gewebe::model
