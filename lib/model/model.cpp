#include "model/model.h"

#include "base/digest.h"
#include "base/disjoint_sets.h"
#include "base/error.h"
#include "base/parallel.h"
#include "model/check.h"
#include "text/number_text.h"

#include <algorithm>
#include <cmath>
#include <string_view>

namespace gewebe::model {

namespace {

template <class Check>
void check_each(const char* what, std::size_t count, Check&& check) {
  for (std::size_t i = 0; i < count; ++i) {
    try {
      check(i);
    } catch (const Error& error) {
      throw Error(std::string(what) + " " + std::to_string(i) + ": " + error.what());
    }
  }
}

void require_size(const char* what, std::size_t size, std::size_t expected) {
  if (size != 0 && size != expected)
    throw Error(std::to_string(size) + " " + what + ", expected " + std::to_string(expected));
}

constexpr std::array<std::string_view, 8> axes_names{"-", "x", "y", "xy", "z", "xz", "yz", "xyz"};

} // namespace

std::string_view fixed_axes_name(std::uint8_t fixed) {
  return axes_names.at(fixed);
}

std::optional<std::uint8_t> fixed_axes_from_name(std::string_view name) {
  const auto* const found = std::find(axes_names.begin(), axes_names.end(), name);
  if (found == axes_names.end())
    return std::nullopt;
  return static_cast<std::uint8_t>(found - axes_names.begin());
}

namespace {

template <class CheckSprings>
void check_model(const Model& model, const CheckSprings& check_springs) {
  ModelChecker checker(model);
  checker.name();
  check_each("material", model.materials.size(), [&](std::size_t i) { checker.material(i); });
  checker.begin_nodes(model.nodes.size());
  check_each("node", model.nodes.size(), [&](std::size_t i) { checker.node(i); });
  checker.all_nodes();
  require_size("normals", model.normals.size(), model.nodes.size());
  check_each("normal", model.normals.size(), [&](std::size_t i) { checker.normal(i); });
  check_springs(checker);
  check_each("triangle", model.triangles.size(), [&](std::size_t i) { checker.triangle(i); });
  require_size("texcoords", model.texcoords.size(), model.triangles.size());
  check_each("texcoord", model.texcoords.size(), [&](std::size_t i) { checker.texcoord(i); });
  require_size("middles", model.middles.size(), model.tetrahedra.size());
  if (model.tetrahedron_material.size() != model.tetrahedra.size())
    throw Error(std::to_string(model.tetrahedron_material.size()) +
                " materials of tetrahedra, expected " + std::to_string(model.tetrahedra.size()));
  check_each("tetrahedron", model.tetrahedra.size(),
             [&](std::size_t i) { checker.tetrahedron(i); });
  const Skin& skin = model.skin;
  if (skin.tetrahedron.size() != skin.points.size())
    throw Error(std::to_string(skin.tetrahedron.size()) + " tetrahedra of the skin, expected " +
                std::to_string(skin.points.size()));
  check_each("skin", skin.points.size(), [&](std::size_t i) { checker.skin_point(i); });
  if (skin.points.empty() != skin.triangles.empty())
    throw Error("a skin of points or triangles alone, expected both");
  if (skin.material.size() != skin.triangles.size())
    throw Error(std::to_string(skin.material.size()) + " materials of the skin, expected " +
                std::to_string(skin.triangles.size()));
  check_each("skin_triangle", skin.triangles.size(),
             [&](std::size_t i) { checker.skin_triangle(i); });
  require_size("skin_texcoords", skin.texcoords.size(), skin.triangles.size());
  check_each("skin_texcoord", skin.texcoords.size(),
             [&](std::size_t i) { checker.skin_texcoord(i); });
}

} // namespace

void check_model(const Model& model) {
  check_model(model, [&](ModelChecker& checker) {
    check_each("spring", model.springs.size(), [&](std::size_t i) { checker.spring(i); });
  });
}

void check_model(const Model& model, const Context& context) {
  try {
    check_model(model, [&](ModelChecker& checker) {
      parallel_blocks(context, model.springs.size(), 1 << 14,
                      [&](std::size_t begin, std::size_t end) { checker.springs(begin, end); });
    });
  } catch (const Cancelled&) {
    throw;
  } catch (const Error&) {
    check_model(model); // names the first of them
    throw;
  }
}

std::size_t body_count(const Model& model) {
  std::size_t first = model.nodes.size();
  for (const Node& n : model.nodes)
    if (n.central >= 0)
      first = std::min(first, static_cast<std::size_t>(n.central));
  return first;
}

namespace {

/// One past the last corner of a triangle.
std::size_t corner_count(const Model& model) {
  std::size_t count = 0;
  for (const Triangle& triangle : model.triangles)
    for (const std::uint32_t corner : triangle)
      count = std::max(count, std::size_t{corner} + 1);
  return count;
}

/// One past the last node below `bodies` that no tetrahedron has.
std::size_t loose_count(const Model& model, std::size_t bodies) {
  std::vector<std::uint8_t> used(model.nodes.size());
  for (const Tetrahedron& t : model.tetrahedra)
    for (const std::uint32_t corner : t)
      used[corner] = 1;
  for (const EdgeMiddles& middles : model.middles)
    for (const std::uint32_t middle : middles)
      used[middle] = 1;
  while (bodies > 0 && used[bodies - 1] != 0)
    --bodies;
  return bodies;
}

} // namespace

NodeCounts node_counts(const Model& model) {
  const std::size_t bodies = body_count(model);
  if (model.tetrahedra.empty())
    return {bodies, bodies};
  return {std::max(corner_count(model), loose_count(model, bodies)), bodies};
}

std::size_t surface_count(const Model& model) {
  return node_counts(model).surface;
}

std::size_t spring_count(const Model& model, SpringKind kind) {
  // Springs are sorted by kind.
  const auto before = [](const Spring& s, SpringKind k) { return s.kind < k; };
  const auto behind = [](SpringKind k, const Spring& s) { return k < s.kind; };
  const auto begin = std::lower_bound(model.springs.begin(), model.springs.end(), kind, before);
  return static_cast<std::size_t>(std::upper_bound(begin, model.springs.end(), kind, behind) -
                                  begin);
}

Components components(const Model& model) {
  DisjointSets sets(model.nodes.size());
  for (const Spring& s : model.springs) {
    if (s.kind != SpringKind::edge)
      break;
    sets.join(s.i, s.j);
  }
  for (const Tetrahedron& t : model.tetrahedra)
    for (std::size_t a = 1; a < 4; ++a)
      sets.join(t[0], t[a]);
  for (std::size_t t = 0; t < model.middles.size(); ++t)
    for (const std::uint32_t middle : model.middles[t])
      sets.join(model.tetrahedra[t][0], middle);
  Components result;
  result.of_node.resize(model.nodes.size());
  const std::size_t bodies = body_count(model);
  for (std::uint32_t i = 0; i < bodies; ++i) {
    const std::uint32_t r = sets.find(i);
    result.of_node[i] = r == i ? result.count++ : result.of_node[r];
  }
  std::vector<bool> named(model.nodes.size());
  for (std::size_t i = 0; i < bodies; ++i) {
    if (model.nodes[i].central < 0)
      continue;
    const auto central = static_cast<std::size_t>(model.nodes[i].central);
    if (!named[central])
      result.of_node[central] = result.of_node[i];
    named[central] = true;
  }
  return result;
}

double total_mass(const Model& model) {
  const std::size_t bodies = body_count(model);
  double sum = 0;
  for (std::size_t i = 0; i < bodies; ++i)
    sum += model.nodes[i].mass;
  return sum;
}

namespace {

/// Σ w k and Σ w c + d of a node, as in safe_steps().
struct Pull {
  double stiffness = 0, braking = 0;
};

std::vector<Pull> node_pulls(const Model& model) {
  std::vector<Pull> pulls(model.nodes.size());
  const auto add = [&](std::uint32_t i, std::uint32_t other, const Spring& s) {
    const double weight = model.nodes[other].fixed == fixed_all ? 1 : 2;
    pulls[i].stiffness += weight * s.stiffness;
    pulls[i].braking += weight * s.damping;
  };
  for (const Spring& s : model.springs) {
    add(s.i, s.j, s);
    add(s.j, s.i, s);
  }
  for (std::size_t i = 0; i < pulls.size(); ++i)
    pulls[i].braking += model.nodes[i].drag;
  return pulls;
}

double node_step(const Node& node, const Pull& pull) {
  if (node.fixed == fixed_all || (pull.stiffness == 0 && pull.braking == 0))
    return HUGE_VAL;
  const double omega2 = pull.stiffness / node.mass, gamma = pull.braking / node.mass;
  // The same as (√(γ² + 4ω²) - γ)/ω², without its cancellation and its 0/0 at ω = 0.
  return node.mass > 0 ? 4 / (std::sqrt(gamma * gamma + 4 * omega2) + gamma) : 0;
}

} // namespace

std::vector<double> safe_steps(const Model& model) {
  const std::vector<Pull> pulls = node_pulls(model);
  std::vector<double> steps(pulls.size());
  for (std::size_t i = 0; i < steps.size(); ++i)
    steps[i] = node_step(model.nodes[i], pulls[i]);
  return steps;
}

double safe_step(const Model& model) {
  const std::vector<double> steps = safe_steps(model);
  return steps.empty() ? HUGE_VAL : *std::min_element(steps.begin(), steps.end());
}

void require_safe_step(const Model& model, double step) {
  const std::vector<double> steps = safe_steps(model);
  const auto min = std::min_element(steps.begin(), steps.end());
  if (min == steps.end() || *min >= step)
    return;
  throw Error("a step of " + text::number_text(step) + " s is beyond the safe step " +
              text::number_text(*min) + " s of node " + std::to_string(min - steps.begin()) +
              ", expected a shorter one or scaled masses");
}

std::size_t scale_masses(Model& model, double step) {
  const std::vector<Pull> pulls = node_pulls(model);
  std::size_t count = 0;
  for (std::size_t i = 0; i < pulls.size(); ++i) {
    Node& node = model.nodes[i];
    if (node_step(node, pulls[i]) >= step)
      continue;
    node.mass = (step * step * pulls[i].stiffness + 2 * step * pulls[i].braking) / 4;
    while (!(node_step(node, pulls[i]) >= step)) // rounding
      node.mass = std::nextafter(node.mass, HUGE_VAL);
    ++count;
  }
  return count;
}

std::string model_digest(const Model& model) {
  Digest digest;
  const auto add_name = [&](const std::string& name) {
    digest.add(static_cast<std::uint64_t>(name.size()));
    digest.add_bytes(name.data(), name.size());
  };
  const auto add_count = [&](std::size_t count) { digest.add(static_cast<std::uint64_t>(count)); };
  const auto add_values = [&](auto... value) {
    const double values[]{static_cast<double>(value)...};
    digest.add_bytes(values, sizeof values);
  };
  add_name(model.name);
  add_count(model.materials.size());
  for (const Material& m : model.materials) {
    add_name(m.name);
    add_values(m.density, m.young, m.thickness, m.damping_ratio);
  }
  // Indices fit a double exactly, which makes each record one block without padding.
  add_count(model.nodes.size());
  for (const Node& n : model.nodes)
    add_values(n.position.x, n.position.y, n.position.z, n.mass, n.drag, n.fixed, n.central,
               n.material);
  add_count(model.normals.size());
  for (const Vec3& n : model.normals)
    add_values(n.x, n.y, n.z);
  add_count(model.springs.size());
  for (const Spring& s : model.springs)
    add_values(s.i, s.j, static_cast<int>(s.kind), s.stiffness, s.damping, s.rest);
  add_count(model.triangles.size());
  digest.add(model.triangles);
  add_count(model.texcoords.size());
  digest.add(model.texcoords);
  add_count(model.tetrahedra.size());
  digest.add(model.tetrahedra);
  // What models of springs lack is not part of theirs.
  if (!model.tetrahedra.empty()) {
    add_count(model.middles.size());
    digest.add(model.middles);
    digest.add(model.tetrahedron_material);
    for (const Material& m : model.materials)
      add_values(m.poisson.value_or(-1));
    for (const Material& m : model.materials)
      if (m.law) { // else the digest stays what it was
        add_values(m.law->kind);
        digest.add_bytes(m.law->parameter.data(), sizeof m.law->parameter);
      }
    for (const Material& m : model.materials)
      for (const PronyTerm& term : m.prony)
        add_values(term.share, term.time);
  }
  if (const Skin& skin = model.skin; !skin.points.empty()) {
    add_count(skin.points.size());
    for (const Vec3& p : skin.points)
      add_values(p.x, p.y, p.z);
    digest.add(skin.tetrahedron);
    add_count(skin.triangles.size());
    digest.add(skin.triangles);
    digest.add(skin.material);
    add_count(skin.texcoords.size());
    digest.add(skin.texcoords);
  }
  return digest.hex();
}

namespace {

std::vector<std::array<float, 6>> single(const std::vector<std::array<double, 6>>& texcoords) {
  std::vector<std::array<float, 6>> result;
  result.reserve(texcoords.size());
  for (const auto& t : texcoords)
    std::transform(t.begin(), t.end(), result.emplace_back().begin(),
                   [](double value) { return static_cast<float>(value); });
  return result;
}

} // namespace

TriangleMesh surface_mesh(const Model& model) {
  TriangleMesh mesh;
  const std::size_t surface = surface_count(model);
  mesh.points.reserve(surface);
  for (std::size_t i = 0; i < surface; ++i)
    mesh.points.push_back(model.nodes[i].position);
  mesh.triangles = model.triangles;
  if (!model.normals.empty()) {
    mesh.normals.reserve(surface);
    for (std::size_t i = 0; i < surface; ++i) {
      const Vec3& n = model.normals[i];
      mesh.normals.push_back(
          {static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)});
    }
  }
  mesh.texcoords = single(model.texcoords);
  if (model.materials.size() > 1)
    for (const Triangle& t : model.triangles)
      mesh.material.push_back(model.nodes[t[0]].material);
  return mesh;
}

TriangleMesh shown_mesh(const Model& model) {
  const Skin& skin = model.skin;
  if (skin.points.empty())
    return surface_mesh(model);
  TriangleMesh mesh;
  mesh.points = skin.points;
  mesh.triangles = skin.triangles;
  mesh.texcoords = single(skin.texcoords);
  if (model.materials.size() > 1)
    mesh.material = skin.material;
  return mesh;
}

} // namespace gewebe::model
