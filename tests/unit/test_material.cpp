#include "base/error.h"
#include "model/build.h"
#include "model/material.h"
#include "model/material_table.h"

#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

namespace gewebe::test {
namespace {

TEST(ModelMaterials, TheTableOfPresetsSaysWhatTheyAre) {
  EXPECT_EQ(model::parse_material_table(model::preset_table(), "presets"),
            model::material_presets());
  EXPECT_EQ(model::material_named("liver", model::material_presets()),
            (model::Material{"liver", 1.06e-3, 5500, 10, 0.2, 0.49}));
  EXPECT_EQ(model::BuildOptions{}.material.materials[0].name, "generic");
}

// A magnitude that is mistyped is seen: tissue is about as heavy as water, inflated lungs float,
// and its stiffness is between that of fat and of a stretched wall. Each says where its numbers
// come from in the lines before it.
TEST(ModelMaterials, PresetsAreTissue) {
  for (const model::Material& m : model::material_presets()) {
    const bool lung = m.name == "lung";
    EXPECT_TRUE(m.density > (lung ? 0.2e-3 : 0.9e-3) && m.density < (lung ? 0.4e-3 : 1.1e-3))
        << m.name;
    EXPECT_TRUE(m.young >= 3000 && m.young <= 2e6) << m.name;
    EXPECT_TRUE(m.poisson && *m.poisson > 0.4 && *m.poisson < 0.5) << m.name;
    const std::string_view table = model::preset_table();
    const std::size_t at = table.find("\n" + m.name + " ");
    ASSERT_NE(at, std::string_view::npos) << m.name;
    EXPECT_EQ(table[table.rfind('\n', at - 1) + 1], '#') << m.name;
  }
}

TEST(ModelMaterials, ATableReplacesAndAddsWhateverItsLineEnds) {
  for (const char* const end : {"", "\n", "\r\n", " # last"}) {
    const std::string more = std::string("# head\n\n generic 1 2 3 0\t\nbone 4 5e9 6 7 0.3") + end;
    const std::string merged = model::merged_tables(model::preset_table(), more);
    const std::vector<model::Material> all = model::parse_material_table(merged, "t");
    EXPECT_EQ(all.size(), model::material_presets().size() + 1);
    EXPECT_EQ(model::material_named("generic", all), (model::Material{"generic", 1, 2, 3, 0, {}}));
    EXPECT_EQ(model::material_named("bone", all), (model::Material{"bone", 4, 5e9, 6, 7, 0.3}));
    EXPECT_EQ(model::material_named("uterus", all),
              model::material_named("uterus", model::material_presets()));
    EXPECT_EQ(model::parse_material_choice("1=bone", all).materials[0].density, 1);
  }
}

TEST(ModelMaterials, ABadLineIsNamed) {
  for (const char* const bad :
       {"a 1 2 3", "a 1 2 3 4 5", "a 0 2 3 4", "a 1 -2 3 4", "a 1 2 inf 4", "a 1 2 3 -0.1",
        "a 1 2 3 x", "a 1e999 2 3 4", "a +1 2 3 4", "a,b 1 2 3 4", "ok 1 2 3 4"}) {
    try {
      (void)model::parse_material_table("ok 1 2 3 4\n# \n" + std::string(bad) + "\n", "t");
      ADD_FAILURE() << bad;
    } catch (const Error& error) {
      EXPECT_EQ(error.place(), "t:3") << bad;
    }
  }
  EXPECT_THROW((void)model::parse_material_table("", "t"), Error);
}

} // namespace
} // namespace gewebe::test
