// Strains skins that blades cut: random paths of a blade through surfaces of organs and a ball (the
// ball alone where there is no shared data), whole sweeps and sweeps in steps, five one behind the
// other in each skin. After each cut the skin must be closed, agree in orientation, have one fan at
// each point, and be as large as before. A cut that is refused leaves the skin as it is; the next
// one goes on with that. Tells how many are, and times. Argument: number of cuts (default 1000).

#include "base/error.h"
#include "cutting/cut_skin.h"
#include "mesh/check.h"
#include "tests/stress/cuts_argument.h"
#include "tests/unit/larger.h"
#include "tests/unit/mesh_fixtures.h"
#include "tests/unit/model_meshes.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace gewebe;

constexpr int cuts_of_skin = 5;

struct Body {
  std::string name;
  model::Skin skin;
};

void add(std::vector<Body>& all, const std::string& name, const TriangleMesh& mesh) {
  if (mesh.triangles.empty())
    return;
  const mesh::MeshReport report = mesh::examine_mesh(mesh);
  if (!report.closed() || !report.oriented() || !report.manifold()) {
    std::printf("%s is no closed surface, left out\n", name.c_str());
    return;
  }
  model::Skin skin;
  skin.points = mesh.points;
  skin.triangles = mesh.triangles;
  skin.tetrahedron.assign(mesh.points.size(), 0);
  skin.material.assign(mesh.triangles.size(), 0);
  all.push_back({name, std::move(skin)});
}

TriangleMesh mesh_of(const model::Skin& skin) {
  TriangleMesh mesh;
  mesh.points = skin.points;
  mesh.triangles = skin.triangles;
  return mesh;
}

class Chance {
public:
  explicit Chance(std::uint32_t seed) : random_(seed) {}
  double between(double low, double high) {
    return low + (high - low) * (static_cast<double>(random_()) / 4294967296.0);
  }
  std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(random_() % n); }
  Vec3 direction() {
    for (;;) {
      const Vec3 v{between(-1, 1), between(-1, 1), between(-1, 1)};
      if (norm(v) < 1 && norm(v) > 0.1)
        return v / norm(v);
    }
  }

private:
  std::mt19937 random_;
};

using Row = std::vector<Vec3>;

/// An edge that moves on and turns a little with each step.
std::vector<Row> sweep(const model::Skin& skin, double size, double cell, Chance& chance) {
  Vec3 at = skin.points[chance.below(static_cast<std::uint32_t>(skin.points.size()))];
  Vec3 forward = chance.direction(), edge = cross(forward, chance.direction());
  edge = edge / norm(edge) * (size * chance.between(0.03, 0.5));
  const double step = size * chance.between(0.01, 0.15), turn = chance.between(-0.3, 0.3);
  const std::uint32_t steps = 1 + chance.below(16);
  const auto count = static_cast<std::uint32_t>(std::ceil(2 * norm(edge) / cell));
  at = at - forward * (step * steps * chance.between(0, 1));
  std::vector<Row> rows;
  for (std::uint32_t n = 0; n <= steps; ++n) {
    Row& row = rows.emplace_back();
    for (std::uint32_t k = 0; k <= count; ++k)
      row.push_back(at + (2.0 * k / count - 1) * edge);
    const Vec3 normal = cross(edge, forward) / norm(edge);
    forward = forward + normal * turn;
    forward = forward / norm(forward);
    edge = edge + chance.direction() * (0.1 * norm(edge));
    at = at + forward * step;
  }
  return rows;
}

struct Totals {
  std::uint64_t cuts = 0, beside = 0, failed = 0;
  std::map<std::string, std::uint64_t> refused;
  double volume = 0; ///< largest relative change
  std::vector<double> times;
};

/// The end of the sheet.
Row cut_once(model::Skin& skin, const std::vector<Row>& rows, double cell, double volume,
             const std::string& name, Totals& totals) {
  ++totals.cuts;
  try {
    const std::clock_t start = std::clock();
    cutting::SkinCut cut = cutting::cut_skin(skin, cutting::strip_sheet(rows), cell, 3 * cell);
    totals.times.push_back(1000.0 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    const TriangleMesh mesh = mesh_of(cut.skin);
    const mesh::MeshReport report = mesh::examine_mesh(mesh);
    const double change = std::abs(signed_volume(mesh) / volume - 1);
    totals.volume = test::larger(totals.volume, change);
    if (!report.closed() || !report.oriented() || !report.manifold() || !(change < 1e-6)) {
      ++totals.failed;
      std::printf("%s: FAILED: %s%s%svolume off by %g\n", name.c_str(),
                  report.closed() ? "" : "open, ", report.oriented() ? "" : "turned, ",
                  report.manifold() ? "" : "no manifold, ", change);
      return rows.back();
    }
    if (cut.skin.triangles.size() == skin.triangles.size())
      ++totals.beside;
    skin = std::move(cut.skin);
    return std::move(cut.end);
  } catch (const Error& error) {
    ++totals.refused[error.what()];
    return rows.back();
  }
}

void strain(const Body& body, std::uint32_t seed, std::uint64_t cuts, Totals& totals) {
  Chance chance(seed);
  model::Skin skin = body.skin;
  Box3 box;
  for (const Vec3& p : skin.points)
    box.add(p);
  const double size = box.longest_side(), cell = size / 20,
               volume = signed_volume(mesh_of(body.skin));
  for (int n = 0; n < cuts_of_skin && totals.cuts < cuts; ++n) {
    std::vector<Row> rows = sweep(skin, size, cell, chance);
    const std::string name = body.name + " " + std::to_string(seed) + ", cut " + std::to_string(n);
    if (seed % 2 == 0) {
      (void)cut_once(skin, rows, cell, volume, name, totals);
      continue;
    }
    Row start = rows[0];
    for (std::size_t k = 1; k < rows.size() && totals.cuts < cuts; ++k)
      start = cut_once(skin, {start, rows[k]}, cell, volume, name, totals);
  }
}

int run(std::uint64_t cuts) {
  std::vector<Body> all;
  add(all, "ball", test::ball(5, 1, {0, 0, 0}));
  add(all, "liver", test::load_test_mesh("sofa_liver_smooth.obj"));
  add(all, "spleen", test::load_test_mesh("hubmap_F_spleen_uv.obj"));
  bool good = true;
  for (const Body& body : all) {
    Totals totals;
    const std::uint64_t each = cuts / all.size() + 1;
    for (std::uint32_t seed = 0; totals.cuts < each; ++seed)
      strain(body, seed, each, totals);
    std::ranges::sort(totals.times);
    const auto share = [&](double s) {
      return totals.times.empty() ? 0.0
                                  : totals.times[static_cast<std::size_t>(
                                        s * static_cast<double>(totals.times.size() - 1))];
    };
    std::printf("%s, %zu triangles: %llu cuts (%llu beside it), volume off by %.1e at most, "
                "%.1f ms median, %.1f ms p99 of processor time, %llu failed\n",
                body.name.c_str(), body.skin.triangles.size(),
                static_cast<unsigned long long>(totals.cuts),
                static_cast<unsigned long long>(totals.beside), totals.volume, share(0.5),
                share(0.99), static_cast<unsigned long long>(totals.failed));
    for (const auto& [what, count] : totals.refused)
      std::printf("  %llu refused: %s\n", static_cast<unsigned long long>(count), what.c_str());
    good = good && totals.failed == 0;
  }
  return good ? 0 : 1;
}

} // namespace

int main(int argc, char** argv) {
  return gewebe::test::stress_cuts("stress_skin", argc, argv, run);
}
