// Strains cuts of solids by blades: random paths of a blade through a liver, a spleen and balls
// (balls alone where there is no shared data), whole sweeps and sweeps in steps, ten one behind the
// other in each solid, some with a second material, displaced, or quadratic. What holds of
// every cut is in tests/unit/tet_cut_checks.h. Tells times of the cuts, how far walls miss the
// blade and what becomes of angles. Argument: number of cuts (default 1000).

#include "stuffing/stuffing.h"
#include "tests/stress/cuts_argument.h"
#include "tests/unit/larger.h"
#include "tests/unit/surface_scenes.h"
#include "tests/unit/tet_cut_checks.h"
#include "tests/unit/tet_organs.h"
#include "tetrahedra/order.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <random>
#include <string>
#include <vector>

namespace {

using namespace gewebe;

constexpr int cuts_of_solid = 10;

struct Body {
  std::string name;
  tetrahedra::TetMesh mesh;
};

std::vector<Body> bodies() {
  std::vector<Body> all;
  all.push_back({"balls", stuffing::stuff({}, scenes::metaballs(24, 7, 2.3), {})});
  all.push_back({"liver", test::organ_tetrahedra("sofa_liver_smooth.obj", 20)});
  all.push_back({"spleen", test::organ_tetrahedra("hubmap_F_spleen_uv.obj", 28)});
  std::erase_if(all, [](const Body& body) { return body.mesh.tetrahedra.empty(); });
  return all;
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

/// An edge that moves on and turns a little with each step.
TriangleMesh sweep(const tetrahedra::TetMesh& mesh, Chance& chance) {
  const Box3 box = tetrahedra::bounding_box(mesh);
  const double size = box.longest_side();
  Vec3 at = mesh.points[chance.below(static_cast<std::uint32_t>(mesh.points.size()))];
  Vec3 forward = chance.direction(), edge = cross(forward, chance.direction());
  edge = edge / norm(edge) * (size * chance.between(0.03, 0.5));
  const double step = size * chance.between(0.01, 0.15), turn = chance.between(-0.3, 0.3);
  const std::uint32_t steps = 1 + chance.below(16);
  at = at - forward * (step * steps * chance.between(0, 1));
  TriangleMesh blade;
  for (std::uint32_t n = 0; n <= steps; ++n) {
    blade.points.push_back(at - edge);
    blade.points.push_back(at + edge);
    if (n > 0) {
      const std::uint32_t p = 2 * n - 2;
      blade.triangles.push_back({p, p + 2, p + 1});
      blade.triangles.push_back({p + 2, p + 3, p + 1});
    }
    const Vec3 normal = cross(edge, forward) / norm(edge);
    forward = forward + normal * turn;
    forward = forward / norm(forward);
    edge = edge + chance.direction() * (0.1 * norm(edge));
    at = at + forward * step;
  }
  return blade;
}

struct Totals {
  std::uint64_t cuts = 0, empty = 0, failed = 0, separated = 0, walls = 0, split = 0;
  std::uint64_t moved = 0, kept = 0, folded = 0, opened = 0, rejoined = 0, doubled = 0;
  double least_before = 180, least_after = 180; ///< degrees from 0 and 180
  double largest_miss = 0;                      ///< of the solid's mean edge
  std::vector<double> times;                    ///< ms, of cuts that touch something
};

double least_margin(const tetrahedra::TetMesh& mesh) {
  double least = 180;
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
    least = test::smaller(least, test::least_margin(mesh, t));
  return least;
}

double mean_edge(const tetrahedra::TetMesh& mesh) {
  double sum = 0;
  for (const Tetrahedron& t : mesh.tetrahedra)
    for (const auto& edge : tetrahedra::tetrahedron_edges)
      sum += norm(mesh.points[t[edge[0]]] - mesh.points[t[edge[1]]]);
  return sum / (6 * static_cast<double>(mesh.tetrahedra.size()));
}

/// One cut of the mesh, which becomes what is left.
void cut_once(tetrahedra::TetMesh& mesh, const TriangleMesh& blade,
              const incision::BladeCutOptions& options, double edge, const std::string& name,
              Totals& totals) {
  const auto start = std::chrono::steady_clock::now();
  incision::TetCut cut = incision::cut_tetrahedra(mesh, blade, options);
  const double time =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  const std::string fault = test::fault_of(mesh, cut, options.least_angle);
  ++totals.cuts;
  if (!fault.empty()) {
    ++totals.failed;
    std::printf("%s: FAILED: %s\n", name.c_str(), fault.c_str());
  }
  const incision::BladeCutReport& report = cut.report;
  if (report.separated == 0)
    ++totals.empty;
  else
    totals.times.push_back(time);
  totals.separated += report.separated;
  totals.walls += cut.wall.size();
  totals.split += report.split;
  totals.moved += report.moved;
  totals.kept += report.kept;
  totals.folded += report.folded;
  totals.opened += report.opened;
  totals.rejoined += report.rejoined;
  totals.doubled += report.doubled;
  totals.largest_miss = test::larger(totals.largest_miss, report.largest_miss / edge);
  mesh = std::move(cut.mesh);
}

void strain(const Body& body, std::uint32_t seed, std::uint64_t cuts, Totals& totals) {
  Chance chance(seed);
  tetrahedra::TetMesh mesh = body.mesh;
  const double edge = mean_edge(mesh);
  if (seed % 3 == 0)
    for (const Tetrahedron& t : mesh.tetrahedra)
      mesh.material.push_back(norm(mesh.points[t[0]] - mesh.points[0]) > 6 * edge ? 1 : 0);
  if (seed % 4 == 3)
    tetrahedra::make_quadratic(mesh);
  for (int n = 0; n < cuts_of_solid && totals.cuts < cuts; ++n) {
    const TriangleMesh blade = sweep(mesh, chance);
    const std::string name = body.name + " " + std::to_string(seed) + ", cut " + std::to_string(n);
    incision::BladeCutOptions options;
    std::vector<Vec3> places;
    if (seed % 4 == 1) {
      const Vec3 bend = chance.direction() * 0.02;
      for (const Vec3& p : mesh.points)
        places.push_back(p + bend * (dot(p - mesh.points[0], p - mesh.points[0]) / (10 * edge)));
      options.places = places;
    }
    if (places.empty() && seed % 4 == 2)
      for (std::size_t quads = 1; 2 * quads <= blade.triangles.size() && totals.cuts < cuts;
           ++quads) {
        TriangleMesh so_far = blade;
        so_far.triangles.resize(2 * quads);
        cut_once(mesh, so_far, options, edge, name, totals);
      }
    else
      cut_once(mesh, blade, options, edge, name, totals);
  }
  totals.least_before = test::smaller(totals.least_before, least_margin(body.mesh));
  totals.least_after = test::smaller(totals.least_after, least_margin(mesh));
}

double share_of(std::vector<double>& times, double share) {
  if (times.empty())
    return 0;
  std::ranges::sort(times);
  return times[static_cast<std::size_t>(share * static_cast<double>(times.size() - 1))];
}

void tell(const Body& body, Totals& totals) {
  const auto number = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  std::printf(
      "%s, %zu tetrahedra: %llu cuts (%llu beside it), %llu tetrahedra separated, %llu "
      "split, %llu triangles of wall, %llu nodes doubled, %llu moved, %llu kept (missed by "
      "%.2f edges at most), %llu edges folded, %llu faces opened, %llu joined again; angles keep "
      "%.2f "
      "degrees from 0 and 180, %.2f before; %.2f ms median, %.2f ms p99 (%.4f ms a separated "
      "tetrahedron), %llu failed\n",
      body.name.c_str(), body.mesh.tetrahedra.size(), number(totals.cuts), number(totals.empty),
      number(totals.separated), number(totals.split), number(totals.walls), number(totals.doubled),
      number(totals.moved), number(totals.kept), totals.largest_miss, number(totals.folded),
      number(totals.opened), number(totals.rejoined), totals.least_after, totals.least_before,
      share_of(totals.times, 0.5), share_of(totals.times, 0.99),
      std::accumulate(totals.times.begin(), totals.times.end(), 0.0) /
          std::fmax(1, static_cast<double>(totals.separated)),
      number(totals.failed));
}

int run(std::uint64_t cuts) {
  const std::vector<Body> all = bodies();
  bool good = true;
  for (const Body& body : all) {
    Totals totals;
    for (std::uint32_t seed = 0; totals.cuts < cuts / all.size() + 1; ++seed)
      strain(body, seed, cuts / all.size() + 1, totals);
    tell(body, totals);
    good = good && totals.failed == 0;
  }
  return good ? 0 : 1;
}

} // namespace

int main(int argc, char** argv) {
  return gewebe::test::stress_cuts("stress_blade", argc, argv, run);
}
