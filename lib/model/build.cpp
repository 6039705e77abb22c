#include "model/build.h"

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/parallel.h"
#include "mesh/edges.h"
#include "mesh/face_ranges.h"
#include "model/check.h"
#include "model/usable_surface.h"
#include "text/number_text.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <tuple>
#include <utility>

// Based on: Van Gelder, Approximate Simulation of Elastic Membranes by Triangulated Spring Meshes,
// 1998.

namespace gewebe::model {

namespace {

constexpr std::size_t grain = 8192;
constexpr double lightest_node = 1e-3; // of the mean mass; lighter ones would rule the time step
constexpr double nodes_of_reference = 1000; // the net in which a central spring has F of an edge's
const double regular_net = std::sqrt(3.0) / 2; // ΣA / l² of equilateral triangles
constexpr std::size_t enough_samples = 8192;   // of a surface, for the places of its central nodes
constexpr double tiny = 1e-12;
constexpr double same_place =
    1e-9; // of a cluster's reach: a node there has no direction to its center

/// Of how many of [0, count) it is true.
template <class Test>
std::size_t counted(const Context& context, std::size_t count, const Test& test) {
  std::atomic<std::size_t> all = 0;
  parallel_blocks(context, count, 1 << 15, [&](std::size_t begin, std::size_t end) {
    std::size_t some = 0;
    for (std::size_t n = begin; n < end; ++n)
      some += test(n) ? 1 : 0;
    all += some;
  });
  return all;
}

class Builder {
public:
  Builder(const TriangleMesh& mesh, const BuildOptions& options, const Context& context)
      : mesh_(mesh), options_(options), context_(context) {
    context_.progress = nullptr; // steps are short and many
  }

  BuiltModel build() {
    use(usable_surface(mesh_, context_));
    model_.materials = options_.material.materials;
    if (model_.materials.empty())
      throw Error("no material, expected at least one");
    model_.name = model_.materials[0].name;
    for (Material& material : model_.materials) { // springs have none
      material.poisson.reset();
      material.law.reset();
      material.prony.clear();
    }
    areas_and_materials();
    surface_nodes();
    edge_springs();
    if (options_.bend)
      bending_springs();
    surface_.edges = {};
    if (options_.centrals > 0)
      central_nodes();
    if (options_.normals)
      normals();
    texture_coordinates();
    model_.triangles = std::move(surface_.triangles);
    check_model(model_, context_);
    return {std::move(model_), report_};
  }

private:
  void use(UsableSurface surface) {
    surface_ = std::move(surface);
    report_.degenerate_faces = surface_.degenerate_faces;
    report_.duplicate_faces = surface_.duplicate_faces;
    report_.isolated_points = surface_.isolated_points;
    const auto faces_in = [this](std::size_t edge) { return surface_.edges.around(edge).size(); };
    const std::size_t edges = surface_.edges.size();
    report_.boundary_edges =
        counted(context_, edges, [&](std::size_t e) { return faces_in(e) == 1; });
    report_.nonmanifold_edges =
        counted(context_, edges, [&](std::size_t e) { return faces_in(e) > 2; });
  }

  const Material& material(std::int32_t index) const {
    return model_.materials[static_cast<std::size_t>(index)];
  }

  void areas_and_materials() {
    const std::size_t count = surface_.triangles.size();
    area_vector_.resize(count);
    material_.resize(count);
    parallel_blocks(context_, count, grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t t = begin; t < end; ++t) {
        const Vec3 &a = point(surface_.triangles[t][0]), &b = point(surface_.triangles[t][1]),
                   &c = point(surface_.triangles[t][2]);
        area_vector_[t] = 0.5 * cross(b - a, c - a);
        if (mesh_.part.empty())
          continue;
        material_[t] = chosen_material(options_.material, mesh_.part[surface_.face_of_triangle[t]]);
      }
    });
  }

  void surface_nodes() {
    constexpr std::size_t more = 1024; // central nodes, which mostly are as few
    reserve_touched(context_, model_.nodes, surface_.point_of_node.size() + more);
    model_.nodes.resize(surface_.point_of_node.size());
    area_.resize(model_.nodes.size());
    tension_.resize(model_.nodes.size());
    const std::size_t triangles = surface_.triangles.size();
    std::vector<double> share(triangles); // of a triangle's mass, by corner
    parallel_blocks(context_, triangles, grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t t = begin; t < end; ++t) {
        const Material& m = material(material_[t]);
        share[t] = m.density * m.thickness * (norm(area_vector_[t]) / 3);
      }
    });
    const mesh::FaceRanges ranges(surface_.triangles, model_.nodes.size(), context_);
    parallel_blocks(
        context_, model_.nodes.size(), ranges.grain(), [&](std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) {
            model_.nodes[i].position = point(static_cast<std::uint32_t>(i));
            model_.nodes[i].material = -1;
          }
          ranges.for_each_block(begin, end, [&](std::size_t first, std::size_t stop, bool whole) {
            for (std::size_t t = first; t < stop; ++t)
              share_out(t, share[t], whole ? 0 : begin, whole ? SIZE_MAX : end);
          });
        });
    double total = 0;
    for (const double one : share)
      total += 3 * one;
    if (!options_.mass && !(total > 0 && std::isfinite(total)))
      throw Error(total == 0 ? "the surface has no area, expected some"
                             : "the surface's mass is not finite, expected smaller coordinates");
    const double floor = lightest_node * total / static_cast<double>(model_.nodes.size());
    report_.light_nodes =
        options_.mass ? 0 : counted(context_, model_.nodes.size(), [&](std::size_t i) {
          return model_.nodes[i].mass < floor;
        });
    parallel_blocks(context_, model_.nodes.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (Node& n : std::span(model_.nodes).subspan(begin, end - begin)) {
        n.mass = options_.mass ? *options_.mass : n.mass < floor ? floor : n.mass;
        n.drag = options_.drag_rate * n.mass;
      }
    });
  }

  /// Gives the corners of a triangle that are among nodes [begin, end) what they have of it.
  void share_out(std::size_t triangle, double mass, std::size_t begin, std::size_t end) {
    const Material& m = material(material_[triangle]);
    const double area = norm(area_vector_[triangle]) / 3;
    const double tension = area * options_.stiffness.value_or(regular_net * m.young * m.thickness);
    for (const std::uint32_t corner : surface_.triangles[triangle]) {
      if (corner < begin || corner >= end)
        continue;
      area_[corner] += area;
      tension_[corner] += tension;
      Node& n = model_.nodes[corner];
      n.mass += mass;
      if (n.material < 0)
        n.material = material_[triangle]; // of its first triangle
    }
  }

  /// c = 2 ζ √(k μ): ζ is the damping ratio of the two masses on this spring alone.
  double damping(const Node& a, const Node& b, double stiffness) const {
    const double ratio =
        (material(a.material).damping_ratio + material(b.material).damping_ratio) / 2;
    const double mass = a.fixed == fixed_all   ? b.mass
                        : b.fixed == fixed_all ? a.mass
                        : a.mass + b.mass > 0  ? a.mass * (b.mass / (a.mass + b.mass))
                                               : 0;
    return 2 * ratio * std::sqrt(stiffness * mass);
  }

  Spring spring(std::uint32_t i, std::uint32_t j, SpringKind kind, double stiffness) const {
    const Node &a = model_.nodes[i], &b = model_.nodes[j];
    return {i, j, kind, stiffness, damping(a, b, stiffness), norm(b.position - a.position)};
  }

  double edge_stiffness(std::size_t edge) const {
    if (options_.stiffness)
      return *options_.stiffness;
    const auto [i, j] = surface_.edges.ends[edge];
    const Vec3 d = point(j) - point(i);
    double sum = 0; // E h A
    for (const std::uint32_t corner : surface_.edges.around(edge)) {
      const Material& m = material(material_[corner / 3]);
      sum += m.young * m.thickness * norm(area_vector_[corner / 3]);
    }
    return sum / dot(d, d);
  }

  void edge_springs() {
    const mesh::EdgeTable& edges = surface_.edges;
    std::vector<Spring>& springs = model_.springs;
    springs.reserve((options_.bend ? 2 : 1) * edges.size() +
                    (options_.centrals > 0 ? model_.nodes.size() : 0));
    touch_pages(context_, springs.data(),
                (edges.size() + (options_.centrals > 0 ? model_.nodes.size() : 0)) *
                    sizeof(Spring));
    springs.resize(edges.size());
    parallel_blocks(context_, edges.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t e = begin; e < end; ++e) {
        const auto [i, j] = edges.ends[e];
        const Vec3 d = point(j) - point(i);
        if (dot(d, d) > 0)
          springs[e] = spring(i, j, SpringKind::edge, edge_stiffness(e));
      }
    });
    const auto has_no_length = [](const Spring& s) { return s.i == s.j; };
    report_.zero_length_edges =
        counted(context_, springs.size(), [&](std::size_t e) { return has_no_length(springs[e]); });
    if (report_.zero_length_edges > 0)
      std::erase_if(springs, has_no_length);
    report_.slack_springs =
        counted(context_, springs.size(), [&](std::size_t e) { return springs[e].stiffness == 0; });
  }

  void bending_springs() {
    const mesh::EdgeTable& edges = surface_.edges;
    using Across = std::array<std::uint32_t, 3>; // node, node, edge between
    std::vector<Across> across;
    for (std::uint32_t e = 0; e < edges.size(); ++e) {
      const auto around = edges.around(e);
      if (around.size() != 2)
        continue;
      const std::uint32_t a = surface_.triangles[around[0] / 3][around[0] % 3];
      const std::uint32_t b = surface_.triangles[around[1] / 3][around[1] % 3];
      across.push_back({std::min(a, b), std::max(a, b), e});
    }
    std::sort(across.begin(), across.end());
    std::size_t next = 0; // edge, for the merge
    for (std::size_t n = 0; n < across.size(); ++n) {
      const auto [i, j, edge] = across[n];
      const std::array<std::uint32_t, 2> ends{i, j};
      if (n > 0 && across[n - 1][0] == i && across[n - 1][1] == j)
        continue;
      while (next < edges.size() && edges.ends[next] < ends)
        ++next;
      if (next < edges.size() && edges.ends[next] == ends)
        continue;
      const Vec3 d = point(j) - point(i),
                 crossed = point(edges.ends[edge][1]) - point(edges.ends[edge][0]);
      if (!(dot(d, d) > 0 && dot(crossed, crossed) > 0))
        continue;
      model_.springs.push_back(
          spring(i, j, SpringKind::bend, options_.bend_factor * edge_stiffness(edge)));
    }
  }

  /// Appends the central nodes and the springs to them.
  void central_nodes() {
    const std::size_t surface_nodes = model_.nodes.size();
    const Components parts = components(model_);
    std::vector<std::size_t> first(parts.count + std::size_t{1});
    for (std::size_t i = 0; i < surface_nodes; ++i)
      ++first[parts.of_node[i] + std::size_t{1}];
    for (std::size_t c = 0; c < parts.count; ++c)
      first[c + 1] += first[c];
    std::vector<std::uint32_t> member(surface_nodes);
    std::vector<std::size_t> fill(first.begin(), first.end() - 1);
    for (std::uint32_t i = 0; i < surface_nodes; ++i)
      member[fill[parts.of_node[i]]++] = i;

    std::vector<Samples> samples(parts.count);
    std::vector<double> area(parts.count);
    for (std::uint32_t i = 0; i < surface_nodes; ++i)
      area[parts.of_node[i]] += area_[i];
    for (std::size_t t = 0; t < surface_.triangles.size(); ++t) {
      const std::uint32_t c = parts.of_node[surface_.triangles[t][0]];
      if (first[c + std::size_t{1}] - first[c] < enough_samples)
        add_samples(samples[c], t, area[c]);
    }
    std::vector<double> reach(surface_nodes); // of a node's cluster, squared
    std::vector<double> stiffness(surface_nodes);
    for (std::size_t c = 0; c < parts.count; ++c) {
      const std::span<const std::uint32_t> nodes{member.data() + first[c], first[c + 1] - first[c]};
      std::vector<Vec3> points;
      points.reserve(nodes.size());
      for (const std::uint32_t i : nodes) {
        points.push_back(model_.nodes[i].position);
        // Springs of F times an edge spring's at each node would hold a fine net more firmly than a
        // coarse one. F holds for a net of 1000 nodes, whose stiffness per area any net gets.
        if (area[c] > 0)
          stiffness[i] = options_.central_factor * nodes_of_reference * (tension_[i] / area[c]);
      }
      if (samples[c].points.empty()) {
        samples[c].points = points;
        samples[c].weights.reserve(nodes.size());
        for (const std::uint32_t i : nodes)
          samples[c].weights.push_back(area[c] > 0 ? std::max(area_[i], tiny * area[c]) : 1);
      }
      // A center with a single node would coincide with it, hence two nodes per center at least.
      const std::size_t max = std::max<std::size_t>(1, points.size() / 2);
      const std::size_t wanted =
          std::min<std::size_t>(static_cast<std::size_t>(options_.centrals), max);
      const Clusters places =
          cluster_points(samples[c].points, wanted, context_, samples[c].weights);
      samples[c] = {};
      add_cluster_nodes(nearest_clusters(points, places.centers, context_), points, nodes, reach);
    }
    central_springs(stiffness, reach);
  }

  struct Samples {
    std::vector<Vec3> points;
    std::vector<double> weights; ///< mm²
  };

  /// Centroids of parts of a triangle, so small that the surface of its component has thousands:
  /// the places of central nodes are the same then for few nodes as for many.
  void add_samples(Samples& samples, std::size_t triangle, double surface) const {
    const double area = norm(area_vector_[triangle]);
    if (!(area > 0))
      return;
    const int sides = static_cast<int>(
        std::ceil(std::sqrt(static_cast<double>(enough_samples) * (area / surface))));
    const Triangle& t = surface_.triangles[triangle];
    const Vec3 a = point(t[0]), u = (point(t[1]) - a) / sides, v = (point(t[2]) - a) / sides;
    const auto add = [&](double along, double across) {
      samples.points.push_back(a + along * u + across * v);
      samples.weights.push_back(area / (sides * sides));
    };
    for (int i = 0; i < sides; ++i)
      for (int j = 0; i + j < sides; ++j) {
        add(i + 1.0 / 3, j + 1.0 / 3);
        if (i + j + 1 < sides)
          add(i + 2.0 / 3, j + 2.0 / 3);
      }
  }

  void add_cluster_nodes(const Clusters& clusters, const std::vector<Vec3>& points,
                         std::span<const std::uint32_t> member, std::vector<double>& reach) {
    const std::size_t base = model_.nodes.size();
    std::vector<double> farthest(clusters.centers.size());
    for (const Vec3& center : clusters.centers) {
      Node n;
      n.position = center;
      n.fixed = options_.centrals_free ? fixed_none : fixed_all;
      n.material = -1;
      model_.nodes.push_back(n);
    }
    for (std::size_t p = 0; p < points.size(); ++p) {
      const std::uint32_t c = clusters.of_point[p];
      Node& node = model_.nodes[member[p]];
      Node& center = model_.nodes[base + c];
      node.central = static_cast<std::int32_t>(base + c);
      // In proportion to its springs, so that a free center is as quick as a surface node.
      center.mass += options_.central_factor * node.mass;
      if (center.material < 0)
        center.material = node.material;
      const Vec3 d = points[p] - center.position;
      farthest[c] = std::max(farthest[c], dot(d, d));
    }
    for (std::size_t p = 0; p < points.size(); ++p)
      reach[member[p]] = farthest[clusters.of_point[p]];
    for (std::size_t c = base; c < model_.nodes.size(); ++c)
      model_.nodes[c].drag = options_.drag_rate * model_.nodes[c].mass;
  }

  void central_springs(const std::vector<double>& stiffness, const std::vector<double>& reach) {
    const std::size_t before = model_.springs.size();
    model_.springs.resize(before + reach.size());
    parallel_blocks(context_, reach.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const auto center = static_cast<std::uint32_t>(model_.nodes[i].central);
        const Vec3 d = model_.nodes[center].position - model_.nodes[i].position;
        if (dot(d, d) > same_place * same_place * reach[i])
          model_.springs[before + i] =
              spring(static_cast<std::uint32_t>(i), center, SpringKind::central, stiffness[i]);
      }
    });
    const auto kept =
        std::remove_if(model_.springs.begin() + static_cast<std::ptrdiff_t>(before),
                       model_.springs.end(), [](const Spring& s) { return s.i == s.j; });
    model_.springs.erase(kept, model_.springs.end());
  }

  void normals() {
    model_.normals.resize(model_.nodes.size());
    for (std::size_t t = 0; t < surface_.triangles.size(); ++t)
      for (const std::uint32_t corner : surface_.triangles[t])
        model_.normals[corner] += area_vector_[t];
    for (Vec3& n : model_.normals) {
      const double length = norm(n);
      n = length > 0 ? n / length : Vec3{};
    }
  }

  void texture_coordinates() {
    if (mesh_.texcoords.empty())
      return;
    model_.texcoords.resize(surface_.face_of_triangle.size());
    parallel_blocks(
        context_, model_.texcoords.size(), 4096, [&](std::size_t begin, std::size_t end) {
          for (std::size_t t = begin; t < end; ++t) {
            const auto& from = mesh_.texcoords[surface_.face_of_triangle[t]];
            std::transform(from.begin(), from.end(), model_.texcoords[t].begin(), text::decimal_of);
          }
        });
  }

  const Vec3& point(std::uint32_t node) const { return mesh_.points[surface_.point_of_node[node]]; }

  const TriangleMesh& mesh_;
  const BuildOptions& options_;
  Context context_;
  UsableSurface surface_;
  std::vector<Vec3> area_vector_;      ///< per triangle, mm²
  std::vector<std::int32_t> material_; ///< per triangle
  std::vector<double> area_;           ///< per node, mm²: a third of its faces
  std::vector<double> tension_; ///< per node: area times an edge's stiffness in a regular net
  Model model_;
  BuildReport report_;
};

} // namespace

std::vector<BuildReport::Line> BuildReport::lines() const {
  return {{"isolated_points", isolated_points, "points without a face were left out"},
          {"degenerate_faces", degenerate_faces, "faces with equal corners were left out"},
          {"duplicate_faces", duplicate_faces, "faces that stand twice were left out"},
          {"zero_length_edges", zero_length_edges, "edges without length got no spring"},
          {"slack_springs", slack_springs, "edges between faces without area have stiffness 0"},
          {"light_nodes", light_nodes, nullptr},
          {"nonmanifold_edges", nonmanifold_edges, nullptr}};
}

double model_bytes(double points, double triangles, bool bend) {
  // The model, its edge table, and the springs once more while they are sorted.
  return 150 * points + (bend ? 420 : 300) * triangles;
}

BuiltModel build_model(const TriangleMesh& mesh, const BuildOptions& options,
                       const Context& context) {
  const double bytes = model_bytes(static_cast<double>(mesh.points.size()),
                                   static_cast<double>(mesh.triangles.size()), options.bend);
  const std::string what = "the model of " + std::to_string(mesh.triangles.size()) + " triangles";
  require_memory(context, bytes, what.c_str());
  return Builder(mesh, options, context).build();
}

} // namespace gewebe::model
