// Compressed columns of elastic solids beside plain ones: size, error, the time to make them, and
// shapes under forces on a patch, over the number of surface nodes. Balls of tetrahedra, held at
// one end; with a mesh of tetrahedra as argument that one alone. An argument that is a number is
// the cell of a ball of radius 5, `all` gives columns rows for all nodes instead of the surface's.
//
// Writes CSV to standard output: nodes, nodes with rows, bound, and by each what its name says:
// MB as float32, MB compressed, share of float32, largest error over the bound (of 24 nodes'
// columns), seconds of solves, seconds of compression alone; for each number of forces milliseconds
// of a sum of plain columns of float32, and of compressed ones: medians of runs that take turns.

#include "base/error.h"
#include "columns/column_cache.h"
#include "columns/column_compression.h"
#include "columns/compliance_columns.h"
#include "fem/assembly.h"
#include "formats/tetrahedra/tet_file.h"
#include "linalg/factor.h"
#include "stuffing/stuffing.h"
#include "tests/bench/timing.h"
#include "tests/unit/larger.h"
#include "tests/unit/surface_scenes.h"
#include "tetrahedra/boundary.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <initializer_list>
#include <memory>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

using namespace gewebe;
using namespace gewebe::timing;

namespace {

struct Solid {
  tetrahedra::TetMesh mesh;
  std::vector<std::uint32_t> surface;
  linalg::StiffnessMatrix matrix;
  std::unique_ptr<linalg::Factor> factor;
  double norm = 0;
};

tetrahedra::TetMesh ball(double cell) {
  volume::GridInfo info;
  info.transform = volume::uniform_transform(cell);
  info.level_set = true;
  info.background = 9;
  const int reach = static_cast<int>(std::ceil(5 / cell)) + 3;
  return stuffing::stuff({},
                         scenes::sample(info, {-reach, -reach, -reach}, {reach, reach, reach},
                                        [&](int i, int j, int k) {
                                          return norm(Vec3{i * cell, j * cell, k * cell}) - 5;
                                        }),
                         {});
}

Solid solid_of(tetrahedra::TetMesh mesh) {
  Solid solid;
  solid.mesh = std::move(mesh);
  const std::vector<Vec3>& points = solid.mesh.points;
  Box3 box;
  for (const Vec3& p : points)
    box.add(p);
  std::vector<std::uint8_t> fixed(3 * points.size());
  for (std::size_t axis = 0; axis < fixed.size(); ++axis)
    fixed[axis] = points[axis / 3].x < box.min.x + 0.1 * box.size().x;
  const std::vector<fem::SolidMaterial> material{{5000, 0.45, 1e-3}};
  solid.matrix = fem::solid_stiffness(solid.mesh, fem::solid_elements(solid.mesh, material), fixed);
  solid.factor = std::make_unique<linalg::Factor>(solid.matrix, Context{});
  solid.norm = linalg::stiffness_norm(solid.matrix);
  solid.surface.resize(tetrahedra::boundary(solid.mesh).mesh.points.size());
  std::iota(solid.surface.begin(), solid.surface.end(), 0U); // they come first
  return solid;
}

/// Keeps columns of a few nodes as float32, and as they are.
class Patch final : public columns::ColumnSource, public columns::ColumnSink {
public:
  Patch(std::size_t rows, std::vector<std::uint32_t> nodes)
      : rows_(rows), nodes_(std::move(nodes)) {}
  std::size_t node_count() const override { return rows_; }
  const std::vector<std::uint32_t>& nodes() const override { return nodes_; }
  bool single() const override { return true; }
  void read(std::size_t k, std::span<double> out) const override {
    std::copy(kept_[k].begin(), kept_[k].end(), out.begin());
  }
  void write(std::size_t /*k*/, std::span<const double> columns, double /*residual*/) override {
    kept_.emplace_back(columns.begin(), columns.end());
  }

private:
  std::size_t rows_;
  std::vector<std::uint32_t> nodes_;
  std::vector<std::vector<double>> kept_;
};

/// Nodes around one of the surface.
std::vector<std::uint32_t> patch_of(const Solid& solid, std::size_t count) {
  std::vector<std::uint32_t> nodes = solid.surface;
  Vec3 tip{-HUGE_VAL, 0, 0};
  for (const std::uint32_t i : nodes)
    if (solid.mesh.points[i].x > tip.x)
      tip = solid.mesh.points[i];
  std::sort(nodes.begin(), nodes.end(), [&](std::uint32_t a, std::uint32_t b) {
    return norm(solid.mesh.points[a] - tip) < norm(solid.mesh.points[b] - tip);
  });
  nodes.resize(std::min(count, nodes.size()));
  std::sort(nodes.begin(), nodes.end());
  return nodes;
}

void bench(const Solid& solid, bool all_rows, std::initializer_list<double> bounds) {
  const std::size_t n = solid.mesh.points.size(), rows = all_rows ? n : solid.surface.size();
  const auto points = std::span(solid.mesh.points).first(rows);
  double solving = 0;
  const columns::ColumnMaker maker = [&](std::span<const std::uint32_t> nodes,
                                         columns::ColumnSink& sink) {
    double residual = 0;
    solving += milliseconds([&] {
      residual = columns::compliance_columns(solid.matrix, *solid.factor, solid.norm, nodes, {},
                                             sink, rows);
    });
    return residual;
  };
  const std::initializer_list<std::size_t> patches{1, 3, 10, 30, 100, 300};
  const std::vector<std::uint32_t> largest = patch_of(solid, 300);
  Patch plain(rows, largest);
  (void)maker(largest, plain);
  columns::ColumnCache cache(rows, &plain, {}, 4e9, false);
  cache.need(largest);
  for (const double relative : bounds) {
    solving = 0;
    columns::CompressedMade made;
    const double all = milliseconds(
        [&] { made = columns::compress_columns(points, solid.surface, relative, maker, {}); });
    double bytes = 0;
    for (const auto& chunk : made.chunks)
      bytes += static_cast<double>(chunk.size());
    const double bound = made.layout.bound;
    const auto columns = columns::compressed_columns(std::move(made), n);
    double worst = 0;
    std::vector<double> exact(9 * rows), read(9 * rows);
    for (std::size_t k = 0; k < 24; ++k) {
      plain.read(k * largest.size() / 24, exact);
      const auto at = std::lower_bound(columns->nodes().begin(), columns->nodes().end(),
                                       largest[k * largest.size() / 24]);
      columns->read(static_cast<std::size_t>(at - columns->nodes().begin()), read);
      for (std::size_t r = 0; r < read.size(); ++r) {
        worst = test::larger(worst, std::abs(read[r] - exact[r]));
      }
    }
    const double single = 36e-6 * static_cast<double>(solid.surface.size() * rows);
    std::printf("%zu,%zu,%g,%.1f,%.1f,%.4f,%.3f,%.1f,%.1f", n, rows, relative, single, bytes * 1e-6,
                bytes * 1e-6 / single, worst / bound, solving * 1e-3, (all - solving) * 1e-3);
    for (const std::size_t count : patches) {
      std::vector<contact::NodeVector> forces;
      for (const std::uint32_t node : patch_of(solid, count))
        forces.push_back({node, {1, 2, 3}});
      std::vector<double> u(3 * rows);
      const Context alone = with_threads(1);
      std::vector<double> of_plain, of_compressed;
      for (int run = 0; run < 31; ++run) {
        of_plain.push_back(processor_milliseconds([&] { (void)cache.add(forces, 0, alone, u); }));
        of_compressed.push_back(processor_milliseconds([&] { columns->add(forces, alone, u); }));
      }
      std::printf(",%.3f,%.3f", times_of(std::move(of_plain)).median,
                  times_of(std::move(of_compressed)).median);
    }
    std::printf("\n");
    std::fflush(stdout);
  }
}

} // namespace

int main(int argc, char** argv) {
  std::printf("nodes,row_nodes,bound,float32_mb,compressed_mb,share,error_over_bound,solve_s,"
              "compress_s");
  for (const int count : {1, 3, 10, 30, 100, 300})
    std::printf(",plain_%d_ms,compressed_%d_ms", count, count);
  std::printf("\n");
  std::vector<double> cells{1.4, 0.8, 0.55, 0.381};
  std::vector<std::string> meshes;
  bool all_rows = false;
  for (int i = 1; i < argc; ++i) {
    char* end = nullptr;
    const double cell = std::strtod(argv[i], &end);
    if (argv[i] == std::string("all"))
      all_rows = true;
    else if (*end != 0)
      meshes.emplace_back(argv[i]);
    else
      cells = {cell};
  }
  for (const std::string& name : meshes)
    at(name, [&] {
      formats::Input input(name);
      bench(solid_of(formats::read_tet_mesh(input, {})), all_rows, {1e-3, 1e-4, 1e-5});
    });
  for (std::size_t k = 0; meshes.empty() && k < cells.size(); ++k)
    bench(solid_of(ball(cells[k])), all_rows, {1e-3, 1e-4, 1e-5});
}
