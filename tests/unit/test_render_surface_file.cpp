// What can be drawn: meshes, models, frames of a run.

#include "base/error.h"
#include "formats/model/ela.h"
#include "formats/results/results_writer.h"
#include "model/build.h"
#include "model_meshes.h"
#include "scratch.h"
#include "tools/render/surface_file.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>

namespace gewebe {
namespace {

Model ball_model() {
  TriangleMesh mesh = test::ball(1, 10);
  return build_model(mesh, {}, {}).model;
}

std::vector<Surface> read(const std::string& path, SurfaceReadOptions options) {
  Input input(path);
  options.kind = input_kind(input.peek(4096), path, "");
  return read_surfaces(input, options, {});
}

TEST(RenderSurfaceFile, ModelsAreDrawnWithoutTheirCentralNodes) {
  const Model model = ball_model();
  const ScratchFile file(".ela");
  std::ofstream(file.path()) << ela_text(model);
  const std::vector<Surface> surfaces = read(file.path(), {});
  ASSERT_EQ(surfaces.size(), 1U);
  EXPECT_EQ(surfaces[0].mesh.points.size(), surface_count(model));
  EXPECT_EQ(surfaces[0].mesh.triangles, model.triangles);
  EXPECT_TRUE(surfaces[0].rest.empty());
  SurfaceReadOptions options;
  options.frame = 0;
  EXPECT_THROW((void)read(file.path(), options), UsageError);
  options = {};
  options.unit = "m";
  EXPECT_THROW((void)read(file.path(), options), UsageError);
}

TEST(RenderSurfaceFile, FramesOfARunComeWithTheirRest) {
  const Model model = ball_model();
  const std::size_t n = model.nodes.size();
  const ScratchFile file(".h5");
  {
    const std::unique_ptr<ResultWriter> writer = open_result(Kind::hdf5, file.path(), {});
    writer->add_object("one", model);
    writer->add_object("two", model);
    for (int frame = 0; frame < 3; ++frame) {
      const std::vector<double> still(3 * n, 0.0), moved(3 * n, 0.5 * frame);
      const std::vector<FrameObject> objects{{still, {}}, {moved, {}}};
      writer->add_frame(frame, objects);
    }
    writer->commit();
  }
  const std::vector<Surface> last = read(file.path(), {});
  ASSERT_EQ(last.size(), 2U);
  EXPECT_EQ(last[0].mesh.points, last[0].rest);
  EXPECT_EQ(last[1].mesh.points[3], (last[1].rest[3] + Vec3{1, 1, 1}));
  SurfaceReadOptions options;
  options.object = "two";
  options.frame = 1;
  const std::vector<Surface> chosen = read(file.path(), options);
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
  EXPECT_EQ(rest_box(last).max, rest_box(chosen).max);
  const std::string path = file.path();
  (void)std::remove((path.substr(0, path.size() - 3) + ".xdmf").c_str());
}

} // namespace
} // namespace gewebe
