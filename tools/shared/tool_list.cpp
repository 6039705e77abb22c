#include "tools/shared/tool_list.h"

#include <algorithm>
#include <array>

namespace gewebe {

namespace {

struct Tool {
  std::string_view name, what; ///< as its page has them
};
constexpr std::array tools{
    Tool{"metaball2vol", "turn particles into a volume of their density"},
    Tool{"voxelize", "turn a closed triangle mesh, labels or a scan into a volume"},
    Tool{"csg", "combine volumes"},
    Tool{"mc-opt",
         "turn a volume into a closed triangle mesh of its isosurface, or into tetrahedra"},
    Tool{"exp2ela", "turn a mesh into a deformable model of springs or of finite elements"},
    Tool{"ffe-precompute", "factorise the stiffness of a model and store it"},
    Tool{"ffe-run", "simulate deformable objects, command by command"},
    Tool{"emboss-render",
         "draw a mesh, tetrahedra, a model or a result with embossed textures, or a volume"},
};

/// What a word that names no program is done by.
struct Task {
  std::string_view word, how;
};
constexpr std::array tasks{
    Task{"convert", "exp2ela --to KIND writes a mesh or a model in another format"},
    Task{"mesh", "mc-opt makes a mesh of a volume"},
    Task{"tets", "mc-opt --tets and exp2ela --solid make tetrahedra"},
    Task{"volume", "voxelize and metaball2vol make volumes"},
    Task{"segment", "voxelize --label and --threshold make volumes of scans"},
    Task{"model", "exp2ela makes a model of a mesh"},
    Task{"simulate", "ffe-run simulates"},
    Task{"run", "ffe-run simulates"},
    Task{"render", "emboss-render draws"},
    Task{"view", "emboss-render draws"},
    Task{"draw", "emboss-render draws"},
};

} // namespace

bool is_tool(std::string_view name) {
  return std::ranges::find(tools, name, &Tool::name) != tools.end();
}

std::vector<std::string> tool_names() {
  std::vector<std::string> names;
  for (const Tool& tool : tools)
    names.emplace_back(tool.name);
  return names;
}

std::string tool_list() {
  std::string text;
  for (const Tool& tool : tools)
    (((text += tool.name) += std::string(16 - tool.name.size(), ' ')) += tool.what) += "\n";
  return text;
}

std::string_view way_to(std::string_view task) {
  const auto* const found = std::ranges::find(tasks, task, &Task::word);
  return found == tasks.end() ? std::string_view() : found->how;
}

} // namespace gewebe
