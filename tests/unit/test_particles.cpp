// Particles as text, and the kinds of data.

#include "base/error.h"
#include "formats/mesh/particles_file.h"
#include "formats/stream/kind.h"

#include <gtest/gtest.h>

using namespace gewebe;

TEST(ParticlesFile, ReadsCommentsBlankLinesWeightsAndUnits) {
  const Particles particles = formats::read_particles(
      "# a\n\n 1 2 3 4\r\n\t-1e-3 +.5 0 2 -0.5 # removes\n5 6 7 8", "p", 10);
  ASSERT_EQ(particles.size(), 3U);
  EXPECT_EQ(particles[0].center, (Vec3{10, 20, 30}));
  EXPECT_EQ(particles[0].support_radius, 40);
  EXPECT_EQ(particles[0].weight, 1);
  EXPECT_EQ(particles[1].weight, -0.5);
}

TEST(ParticlesFile, RoundTripIsExact) {
  const Particles particles{{{0.1, 1.0 / 3, -1e-300}, 2.5e17, 1}, {{1, 2, 3}, 0.7, -1.0 / 7}};
  const Particles back = formats::read_particles(formats::write_particles(particles), "p");
  ASSERT_EQ(back.size(), 2U);
  for (std::size_t n = 0; n < 2; ++n) {
    EXPECT_EQ(back[n].center, particles[n].center);
    EXPECT_EQ(back[n].support_radius, particles[n].support_radius);
    EXPECT_EQ(back[n].weight, particles[n].weight);
  }
}

TEST(ParticlesFile, BadLinesAreNamed) {
  for (const char* bad :
       {"1 2 3", "1 2 3 0", "1 2 3 -4", "1 2 3 4 5 6", "1 2 x 4", "+-1 2 3 4", "nan 2 3 4",
        "1 2 3 inf", "1 2 3 4 nan", "0x1 2 3 4", "1,2,3,4", "1e999 0 0 1"}) {
    try {
      (void)formats::read_particles(std::string("1 2 3 4\n") + bad + "\n", "p");
      ADD_FAILURE() << bad;
    } catch (const Error& error) {
      EXPECT_EQ(error.place(), "p:2") << bad;
    }
  }
  EXPECT_THROW((void)formats::read_particles("# nothing\n", "p"), Error);
}

TEST(Kind, MagicBeatsTheNameAndTheNameBeatsTheSuffix) {
  EXPECT_EQ(formats::input_kind("ply\nformat", "a.obj", "stl"), formats::Kind::ply);
  EXPECT_EQ(formats::input_kind("solid", "a.obj", "stl"), formats::Kind::stl);
  EXPECT_EQ(formats::input_kind("solid", "dir.stl/a.OBJ", ""), formats::Kind::obj);
  EXPECT_EQ(formats::input_kind("solid", "dir.stl/a", ""), formats::Kind::unknown);
  EXPECT_EQ(formats::input_kind("# c\n\n ela_expl 1\n", "-", ""), formats::Kind::ela);
  EXPECT_EQ(formats::input_kind("ela_explicit", "-", ""), formats::Kind::unknown);
  EXPECT_THROW((void)formats::input_kind("x", "-", "doc"), UsageError);
  for (const formats::Kind kind : {formats::Kind::vdb, formats::Kind::ply, formats::Kind::rgb,
                                   formats::Kind::three_ds, formats::Kind::png})
    EXPECT_EQ(formats::kind_from_name(formats::kind_name(kind)), kind);
}

TEST(Kind, OutputKindFollowsToThenSuffixThenTool) {
  EXPECT_EQ(
      formats::output_kind("", "-", formats::Kind::ply, {formats::Kind::ply, formats::Kind::obj}),
      formats::Kind::ply);
  EXPECT_EQ(formats::output_kind("", "a.obj", formats::Kind::ply,
                                 {formats::Kind::ply, formats::Kind::obj}),
            formats::Kind::obj);
  EXPECT_EQ(formats::output_kind("mesh", "a.obj", formats::Kind::ply,
                                 {formats::Kind::ply, formats::Kind::obj}),
            formats::Kind::ply);
  EXPECT_EQ(formats::output_kind("", "a.out", formats::Kind::ply,
                                 {formats::Kind::ply, formats::Kind::obj}),
            formats::Kind::ply);
  EXPECT_THROW((void)formats::output_kind("", "a.vdb", formats::Kind::ply,
                                          {formats::Kind::ply, formats::Kind::obj}),
               UsageError);
  EXPECT_THROW((void)formats::output_kind("vdb", "a.ply", formats::Kind::ply,
                                          {formats::Kind::ply, formats::Kind::obj}),
               UsageError);
}
