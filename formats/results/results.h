#pragma once
// Results of a run: HDF5 with an XDMF beside it; gewebe_results(5). This header is what readers
// need.

#include "base/mesh.h"
#include "base/vec3.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace gewebe {

struct ResultIndex {
  std::vector<std::string> objects; ///< in the order of the scene
  std::vector<double> times;        ///< of the frames, s
};

/// \throw Error, place = path: missing, no HDF5, no result, truncated, of a newer version
ResultIndex read_result_index(const std::string& path);

/// An object's surface in one frame, as cuts have left it, and where its points were at rest.
/// Texture coordinates where the model had them. \throw Error, place = path; if there is no such
/// object or frame, naming what there is
struct ResultSurface {
  TriangleMesh mesh;                  ///< displaced points
  std::vector<Vec3> rest;             ///< as many
  std::vector<std::string> materials; ///< names, where the file has them
  bool there = true;                  ///< false: a part that came off later, the mesh is empty
};
ResultSurface read_result_surface(const std::string& path, const std::string& object,
                                  std::size_t frame);

} // namespace gewebe
