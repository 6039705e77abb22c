// integration=auto: what such a net chooses, when, and that a refused line or a failed step leaves
// it free as before, so that a record does the same again.

#include "fuzzed_scenes.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace gewebe::test {
namespace {

using Lines = std::vector<std::string>;

/// A shell that hangs as on a hinge behind a cut, so that it goes on elastodynamic.
const Lines hinged{"object a shell method=ffe integration=auto",
                   "cut a plane 0 7.071067811865475 7.071067811865475 0.8476 -1.446 1.264",
                   "force a 11 -16500 6564 -3599", "step 0"};

test::FuzzedRun served(const Lines& lines) {
  return test::run_fuzzed(lines, true, 1, "");
}

std::string fault(const Lines& lines) {
  test::FuzzedCounts seen;
  return test::fault_of_scene(lines, seen);
}

TEST(SceneIntegration, WhatACutMakesElastodynamicChooses) {
  // Both sides of the hinge are held where the cut ends, so that no contact parts them.
  const std::string refused =
      "error {}: nodes 17 of object a and 23 of object a stand at one place "
      "and are held there";
  const auto error = [&](char line) {
    std::string text = refused;
    return text.replace(text.find("{}"), 2, 1, line);
  };
  Lines lines = hinged;
  for (const char* line : {"contact a self", "method a ffe", "step 0.001"})
    lines.emplace_back(line);
  const test::FuzzedRun explicitly = served(lines);
  EXPECT_NE(explicitly.replies.find("loose a "), std::string::npos);
  EXPECT_NE(explicitly.replies.find(error('5')), std::string::npos) << explicitly.replies;
  EXPECT_NE(explicitly.replies.find("error 6: the stiffness matrix is singular"),
            std::string::npos) // and not: it may touch other surfaces
      << explicitly.replies;
  EXPECT_EQ(explicitly.errors, 2U) << explicitly.replies;
  EXPECT_EQ(fault(lines), "");

  lines.insert(lines.begin(), "timestep 10"); // for which explicit steps would be many
  const test::FuzzedRun implicitly = served(lines);
  EXPECT_NE(implicitly.replies.find("loose a "), std::string::npos);
  EXPECT_NE(implicitly.replies.find(error('6')), std::string::npos) << implicitly.replies;
  EXPECT_EQ(implicitly.errors, 2U) << implicitly.replies;
  EXPECT_EQ(fault(lines), "");
}

TEST(SceneIntegration, AStepThatFailsChoosesNothing) {
  const Lines lines{"object a free integration=auto",
                    "emit shapes",
                    "force a 5 1e300 0 0",
                    "step 0.001",
                    "timestep 10", // by which it chooses implicit steps
                    "force a 5 100 0 0",
                    "step 0.001",
                    "contact a self",
                    "step 0.001"};
  const test::FuzzedRun run = served(lines);
  EXPECT_EQ(run.errors, 1U) << run.replies;
  EXPECT_NE(run.replies.find("error 4: object a at "), std::string::npos) << run.replies;
  EXPECT_EQ(fault(lines), "");
}

TEST(SceneIntegration, AnAttachmentThatIsRefusedChoosesNothing) {
  const Lines lines{"object a sheet integration=implicit law=neo-hookean", // which no net has
                    "object b free integration=auto",
                    "emit shapes",
                    "attach a 29 b 5 100",
                    "force b 5 100 0 0",
                    "step 0.001",
                    "contact b self", // whatever it has chosen
                    "step 0.001"};
  const test::FuzzedRun run = served(lines);
  EXPECT_NE(run.replies.find("error 4: object a has no tetrahedra"), std::string::npos)
      << run.replies;
  EXPECT_EQ(run.errors, 1U) << run.replies;
  EXPECT_EQ(fault(lines), "");
}

TEST(SceneIntegration, AnAttachmentThatWaitsHasBothMoveAlikeFromThenOn) {
  const Lines lines{"object a sheet integration=implicit",
                    "object b free integration=auto",
                    "emit shapes",
                    "at 0.01 attach a 29 b 5 100",
                    "force b 5 100 0 0",
                    "step 0.001",
                    "contact b self",
                    "step 0.01"};
  const test::FuzzedRun run = served(lines);
  EXPECT_EQ(run.errors, 0U) << run.replies;
  EXPECT_EQ(fault(lines), "");
}

} // namespace
} // namespace gewebe::test
