#include "tools/cli/tool_list.h"

#include <algorithm>
#include <array>

namespace gewebe::cli {

namespace {

struct Tool {
  std::string_view name, what; ///< as its page has them
  std::array<ToolExample, 2> examples;
};
constexpr std::array tools{
    Tool{"metaball2vol",
         "turn particles into a volume of their density",
         {{{"a ball of radius 40 mm", "echo 0 0 0 80 | metaball2vol --voxel 4 -o organ.vdb"},
           {"a smaller one, in the same voxels",
            "echo 36 0 0 24 | metaball2vol --like organ.vdb -o myoma.vdb"}}}},
    Tool{"voxelize",
         "turn a closed triangle mesh, labels, a scan or contours into a volume",
         {{{"a mesh, in voxels of 2 mm",
            "exp2ela --primitive sphere:24x16 --to ply | voxelize --voxel 2 -o ball.vdb"},
           {"a mesh, in the voxels of another volume",
            "exp2ela --primitive sphere:24x16 --to ply | voxelize --like organ.vdb -o ball.vdb"}}}},
    Tool{"csg",
         "combine volumes",
         {{{"the sum of two volumes", "csg add organ.vdb myoma.vdb -o sick.vdb"},
           {"one without the other", "csg difference organ.vdb myoma.vdb -o rest.vdb"}}}},
    Tool{"mc-opt",
         "turn a volume into a closed triangle mesh of its isosurface, or into tetrahedra",
         {{{"a surface", "mc-opt --epsilon 0.3 sick.vdb -o sick.ply"},
           {"tetrahedra for ParaView", "mc-opt --tets --cell 10 sick.vdb -o sick.vtu"}}}},
    Tool{"exp2ela",
         "turn a mesh into a deformable model of springs or of finite elements",
         {{{"a solid of finite elements, held below z = -20 mm",
            "exp2ela --solid --material uterus --fix 'z<-20' sick.ply -o sick.ela"},
           {"a net of springs", "exp2ela --material uterus --fix 'z<-20' sick.ply -o net.ela"}}}},
    Tool{"ffe-precompute",
         "factorise the stiffness of a model and store it",
         {{{"the factor alone", "ffe-precompute --columns none sick.ela -o sick.h5"},
           {"what the store holds", "ffe-precompute --info sick.h5"}}}},
    Tool{"ffe-run",
         "simulate deformable objects, command by command",
         {{{"0.1 N on all nodes beyond x = 40 mm",
            "printf '%s\\n' 'object o sick.ela store=sick.h5' 'force o \"x>40\" 0 0 1e5 total' "
            "step > "
            "pull.scene"},
           {"the result as HDF5, with XDMF for ParaView", "ffe-run pull.scene -o run.h5"}}}},
    Tool{"emboss-render",
         "draw a mesh, tetrahedra, a model or a result with embossed textures, or a volume",
         {{{"a result, coloured by displacement",
            "emboss-render --field displacement run.h5 -o run.png"},
           {"a mesh as wireframe, from the right",
            "emboss-render --style wireframe --orbit 90,0 sick.ply -o wire.png"}}}},
};

/// Advice for a word that names no program.
struct Task {
  std::string_view word, how;
};
constexpr std::array tasks{
    Task{"convert", "exp2ela --to KIND writes a mesh or a model in another format"},
    Task{"mesh", "mc-opt makes a mesh of a volume"},
    Task{"tets", "mc-opt --tets and exp2ela --solid make tetrahedra"},
    Task{"volume", "voxelize and metaball2vol make volumes"},
    Task{"segment", "voxelize --label and --threshold make volumes of scans"},
    Task{"contour", "voxelize --contours makes volumes of contours in slices"},
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

std::span<const ToolExample> tool_examples(std::string_view name) {
  const auto* const found = std::ranges::find(tools, name, &Tool::name);
  return found == tools.end() ? std::span<const ToolExample>() : found->examples;
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

} // namespace gewebe::cli
