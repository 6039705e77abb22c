// What can be drawn: meshes, models, frames of a run, tetrahedra.

#include "base/error.h"
#include "formats/model/ela.h"
#include "formats/results/results_writer.h"
#include "formats/tetrahedra/tet_file.h"
#include "model/build.h"
#include "model_meshes.h"
#include "scratch.h"
#include "tet_fixtures.h"
#include "tetrahedra/boundary.h"
#include "tools/render/surface_file.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <optional>
#include <utility>

namespace gewebe::test {
namespace {

model::Model ball_model() {
  TriangleMesh mesh = test::ball(1, 10);
  return model::build_model(mesh, {}, {}).model;
}

std::vector<shading::Surface> read(const std::string& path, cli::SurfaceReadOptions options,
                                   cli::SolidReport* solid = nullptr) {
  formats::Input input(path);
  options.kind = formats::input_kind(input.peek(4096), path, "");
  return cli::read_surfaces(input, options, {}, solid);
}

TEST(RenderSurfaceFile, ModelsAreDrawnWithoutTheirCentralNodes) {
  const model::Model model = ball_model();
  const ScratchFile file(".ela");
  std::ofstream(file.path()) << formats::ela_text(model);
  const std::vector<shading::Surface> surfaces = read(file.path(), {});
  ASSERT_EQ(surfaces.size(), 1U);
  EXPECT_EQ(surfaces[0].mesh.points.size(), model::surface_count(model));
  EXPECT_EQ(surfaces[0].mesh.triangles, model.triangles);
  EXPECT_TRUE(surfaces[0].rest.empty());
  cli::SurfaceReadOptions options;
  options.frame = 0;
  EXPECT_THROW((void)read(file.path(), options), UsageError);
  options = {};
  options.unit = "m";
  EXPECT_THROW((void)read(file.path(), options), UsageError);
}

TEST(RenderSurfaceFile, FramesOfARunComeWithTheirRest) {
  const model::Model model = ball_model();
  const std::size_t n = model.nodes.size();
  const ScratchFile file(".h5");
  {
    const std::unique_ptr<formats::ResultWriter> writer =
        formats::open_result(formats::Kind::hdf5, file.path(), {});
    writer->add_object("one", model);
    writer->add_object("two", model);
    for (int frame = 0; frame < 3; ++frame) {
      const std::vector<double> still(3 * n, 0.0), moved(3 * n, 0.5 * frame);
      const std::vector<formats::FrameObject> objects{{still, {}}, {moved, {}}};
      writer->add_frame(frame, objects);
    }
    writer->commit();
  }
  const std::vector<shading::Surface> last = read(file.path(), {});
  ASSERT_EQ(last.size(), 2U);
  EXPECT_EQ(last[0].mesh.points, last[0].rest);
  EXPECT_EQ(last[1].mesh.points[3], (last[1].rest[3] + Vec3{1, 1, 1}));
  cli::SurfaceReadOptions options;
  options.object = "two";
  options.frame = 1;
  const std::vector<shading::Surface> chosen = read(file.path(), options);
  ASSERT_EQ(chosen.size(), 1U);
  EXPECT_EQ(chosen[0].mesh.points[3], (chosen[0].rest[3] + Vec3{0.5, 0.5, 0.5}));
  options.frame = 3;
  EXPECT_THROW((void)read(file.path(), options), Error);
  options.frame = 1;
  options.object = "three";
  EXPECT_THROW((void)read(file.path(), options), Error);
  options = {};
  options.unit = "cm";
  EXPECT_THROW((void)read(file.path(), options), UsageError);
  // The picture fits the shape at rest, wherever the tissue went.
  EXPECT_EQ(shading::rest_box(last).max, shading::rest_box(chosen).max);
  const std::string path = file.path();
  (void)std::remove((path.substr(0, path.size() - 3) + ".xdmf").c_str());
}

// A file of each kind, given up with both of TetGen's.
class SolidFile {
public:
  SolidFile(const tetrahedra::TetMesh& mesh, formats::Kind kind, const std::string& suffix)
      : file_(suffix) {
    formats::Output::Options options;
    options.binary = formats::is_binary(kind);
    formats::Output output(file_.path(), options);
    formats::write_tet_mesh(output, mesh, kind, options);
    output.commit();
    if (kind == formats::Kind::tetgen)
      beside_ = file_.path().substr(0, file_.path().size() - suffix.size()) + ".ele";
  }
  ~SolidFile() {
    if (!beside_.empty())
      (void)std::remove(beside_.c_str());
  }
  SolidFile(const SolidFile&) = delete;
  SolidFile& operator=(const SolidFile&) = delete;
  const std::string& path() const { return file_.path(); }

private:
  ScratchFile file_;
  std::string beside_;
};

TEST(RenderSurfaceFile, TetrahedraAreDrawnByTheirBoundary) {
  const tetrahedra::TetMesh mesh = test::odd_tetrahedra(false, true);
  const TriangleMesh outside = tetrahedra::boundary(mesh).mesh;
  for (const auto& [kind, suffix] :
       {std::pair(formats::Kind::ply, ".ply"), std::pair(formats::Kind::vtu, ".vtu"),
        std::pair(formats::Kind::msh, ".msh"), std::pair(formats::Kind::msh4, ".msh"),
        std::pair(formats::Kind::medit, ".mesh"), std::pair(formats::Kind::tetgen, ".node")}) {
    const SolidFile file(mesh, kind, suffix);
    cli::SolidReport report;
    const std::vector<shading::Surface> surfaces = read(file.path(), {}, &report);
    ASSERT_EQ(surfaces.size(), 1U);
    EXPECT_EQ(surfaces[0].mesh.points, outside.points) << suffix;
    EXPECT_EQ(surfaces[0].mesh.triangles, outside.triangles);
    EXPECT_EQ(surfaces[0].mesh.material, outside.material);
    EXPECT_TRUE(surfaces[0].rest.empty() && surfaces[0].mesh.part.empty());
    EXPECT_EQ(report.tetrahedra, mesh.tetrahedra.size());
    EXPECT_EQ(report.curved_edges, 0U);
    cli::SurfaceReadOptions options;
    options.unit = "cm";
    EXPECT_EQ(read(file.path(), options)[0].mesh.points[3], outside.points[3] * 10);
    options.frame = 0;
    EXPECT_THROW((void)read(file.path(), options), UsageError);
  }
  tetrahedra::TetMesh quadratic = test::odd_tetrahedra(true, true);
  quadratic.points[quadratic.middles[0][0]] += Vec3{0, 0, 0.01};
  cli::SolidReport report;
  EXPECT_EQ(
      read(SolidFile(quadratic, formats::Kind::vtu, ".vtu").path(), {}, &report)[0].mesh.triangles,
      outside.triangles);
  EXPECT_EQ(report.curved_edges, 1U);
}

TEST(RenderSurfaceFile, TheCutIsAPartWithPointsOfItsOwn) {
  const SolidFile file(test::box_tetrahedra(2, 3, 4), formats::Kind::vtu, ".vtu");
  cli::SurfaceReadOptions options;
  options.clip = tetrahedra::ClipPlane{{0, 0, 1.5}, {0, 0, 2}};
  cli::SolidReport report;
  const TriangleMesh mesh = read(file.path(), options, &report)[0].mesh;
  check_mesh(mesh);
  EXPECT_EQ(report.tetrahedra, 144U);
  EXPECT_EQ(report.tetrahedra_cut, 36U);
  EXPECT_EQ(report.tetrahedra_removed, 72U);
  EXPECT_NEAR(report.cut_area, 6, 1e-14);
  ASSERT_EQ(mesh.part.size(), mesh.triangles.size());
  std::vector<int> parts(mesh.points.size());
  std::uint64_t cut = 0;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    cut += mesh.part[f] == 1 ? 1 : 0;
    for (const std::uint32_t corner : mesh.triangles[f]) {
      parts[corner] |= 1 << mesh.part[f];
      if (mesh.part[f] == 1) {
        EXPECT_NEAR(mesh.points[corner].z, 1.5, 1e-15);
      }
    }
  }
  EXPECT_EQ(report.cut_triangles, cut);
  for (const int of : parts)
    EXPECT_TRUE(of == 1 || of == 2) << of;
  options.clip = tetrahedra::ClipPlane{{0, 0, 1.5}, {0, 0, 0}};
  EXPECT_THROW((void)read(file.path(), options), Error);
  options.clip = tetrahedra::ClipPlane{{0, 0, 0}, {0, 0, 1}};
  EXPECT_THROW((void)read(file.path(), options), Error); // takes all away
  options.clip = tetrahedra::ClipPlane{{0, 0, 4}, {0, 0, 1}};
  EXPECT_EQ(read(file.path(), options, &report)[0].mesh.triangles.size(), 104U);
  EXPECT_EQ(report.tetrahedra_cut + report.tetrahedra_removed + report.cut_triangles, 0U);
  const ScratchFile model(".ela");
  std::ofstream(model.path()) << formats::ela_text(ball_model());
  EXPECT_THROW((void)read(model.path(), options), UsageError);
}

TEST(RenderSurfaceFile, BrokenTetrahedraAreNotDrawn) {
  tetrahedra::TetMesh mesh = test::box_tetrahedra(1, 1, 1);
  std::swap(mesh.tetrahedra[2][0], mesh.tetrahedra[2][1]);
  for (const auto& clip : {std::optional<tetrahedra::ClipPlane>(),
                           std::optional(tetrahedra::ClipPlane{{}, {0, 0, -1}})}) {
    cli::SurfaceReadOptions options;
    options.clip = clip;
    EXPECT_THROW((void)read(SolidFile(mesh, formats::Kind::vtu, ".vtu").path(), options), Error);
    EXPECT_THROW((void)read(SolidFile({}, formats::Kind::vtu, ".vtu").path(), options), Error);
  }
}

} // namespace
} // namespace gewebe::test
