#include "tools/cli/mesh_size.h"

#include "text/rounded_text.h"

namespace gewebe::cli {

void warn_of_size(Run& run, const std::string& name, const TriangleMesh& mesh,
                  std::optional<double> voxel) {
  const double longest = bounding_box(mesh).longest_side();
  if (!(longest > 0))
    return;
  if (voxel && longest < 20 * *voxel)
    run.warn(name + ": the mesh is " + text::rounded_text(longest / *voxel) +
             " voxels long, expected 20 or more: a smaller voxel, or --unit if its numbers are not "
             "mm");
  else if (longest > 1000 || (!voxel && longest < 1))
    run.warn(name + ": the mesh is " + text::rounded_text(longest) +
             " mm long, expected an organ of 1 mm to 1 m: --unit says what its numbers mean");
}

} // namespace gewebe::cli
