// The end of a scene, found before it runs.

#include "scratch.h"
#include "tools/run/scene_progress.h"

#include <gtest/gtest.h>

#include <fstream>
#include <optional>
#include <string>

namespace gewebe::test {
namespace {

double end_of(const std::string& scene) {
  const ScratchFile file(".scene");
  std::ofstream(file.path(), std::ios::binary) << scene;
  const std::optional<double> end = cli::find_scene_end(file.path());
  EXPECT_TRUE(end.has_value());
  return end.value_or(-1);
}

TEST(SceneEnd, AddsStepsAndRuns) {
  EXPECT_EQ(end_of(""), 0);
  EXPECT_DOUBLE_EQ(
      end_of("object o organ.ela\nstep 0.25\n  step 0.5 # comment\nrun 2 every 0.3\nstep 1"), 3);
  EXPECT_DOUBLE_EQ(end_of("run 2 every 0.3\nrun 1 every 0.1\n"), 2);
  EXPECT_DOUBLE_EQ(end_of("step 1\r\nend\r\nstep 1\r\n"), 1);
}

TEST(SceneEnd, StepsWithoutTimeTakeTheTimestepOfThen) {
  EXPECT_DOUBLE_EQ(end_of("step\nstep\nstep\n"), 0.05);
  EXPECT_DOUBLE_EQ(end_of("step 1\ntimestep 0.5\nstep\n"), 1.5);
  EXPECT_DOUBLE_EQ(end_of("at 1 timestep 0.5\ntimestep 0.25\nstep\nstep 0.75\nstep\nstep"), 2);
}

TEST(SceneEnd, PassesOverWrongAndLongLines) {
  EXPECT_DOUBLE_EQ(end_of("step 1\nstep -1\nstep nonsense\nstepp 7\nrun 5\nstep 1\n"), 2);
  const std::string list(1000000, '1');
  EXPECT_DOUBLE_EQ(end_of("step 1\nforce o " + list + " 1 0 0\nstep 1\n"), 2);
}

TEST(SceneEnd, IsUnknownWithoutARegularFile) {
  EXPECT_FALSE(cli::find_scene_end("/dev/null").has_value());
  EXPECT_FALSE(cli::find_scene_end("/nowhere/at/all.scene").has_value());
  EXPECT_FALSE(cli::find_scene_end("/").has_value());
}

} // namespace
} // namespace gewebe::test
