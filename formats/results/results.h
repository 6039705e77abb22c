#pragma once
// Results of a run: HDF5 with an XDMF beside it; gewebe_results(5). This header is what readers
// need.

#include "contact/instrument.h"
#include "geometry/mesh.h"
#include "geometry/vec3.h"
#include "tetrahedra/tet_mesh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace gewebe::formats {

struct ResultIndex {
  std::vector<std::string> objects;     ///< in the order of the scene
  std::vector<std::string> instruments; ///< likewise; those of older files are not known
  std::vector<double> times;            ///< of the frames, s
};

/// \throw Error, place = path: missing, no HDF5, no result, truncated, of a newer version
ResultIndex read_result_index(const std::string& path);

/// An object's surface in one frame, as cuts have left it, and where its points were at rest: its
/// skin, if it has one and the caller requests it, else the surface of its nodes. Texture
/// coordinates where the model had them. \throw Error, place = path; if there is no such object or
/// frame, naming what there is
struct ResultSurface {
  TriangleMesh mesh;                  ///< displaced points
  std::vector<Vec3> rest;             ///< as many
  std::vector<std::string> materials; ///< names, where the file has them
  bool there = true;                  ///< false: a part that came off later, the mesh is empty
};
ResultSurface read_result_surface(const std::string& path, const std::string& object,
                                  std::size_t frame, bool skin = true);

/// An object's tetrahedra in one frame. A mesh that is displaced may have turned ones.
struct ResultSolid {
  tetrahedra::TetMesh mesh;           ///< displaced points: all nodes of the object
  std::vector<Vec3> rest;             ///< as many
  std::vector<std::string> materials; ///< names
  bool there = true;                  ///< false: a part that came off later, the mesh is empty
};
/// \throw Error as read_result_surface, and if the object has no tetrahedra
ResultSolid read_result_solid(const std::string& path, const std::string& object,
                              std::size_t frame);

/// An instrument in one frame. Its own point r stands at rotation r + place, row by row.
struct ResultInstrument {
  std::string name;
  contact::InstrumentKind kind = contact::InstrumentKind::sphere;
  double radius = 0, friction = 0;
  std::array<Vec3, 2> ends; ///< of its axis
  std::array<Vec3, 3> rotation;
  Vec3 place;
  Vec3 force, torque; ///< 1e-6 N, and 1e-9 N m about its place
  std::uint64_t touched = 0;
  /// Surface of a mesh instrument at its pose, and its normals in its own coordinates.
  TriangleMesh surface{};
};
/// Those that are there then, in the order of the scene, and of a kind that is known here.
/// \throw Error, place = path; if there is no such frame, a number is beyond 1e100, a
/// pose no rotation or a mesh without its surface
std::vector<ResultInstrument> read_result_instruments(const std::string& path, std::size_t frame);

/// The von Mises stress (Pa) at each point of read_result_surface() in one frame, at those of a
/// skin interpolated; none where the object is not there yet or has no stress then. \throw Error as
/// read_result_surface; if a value is not finite
std::vector<double> read_result_surface_stress(const std::string& path, const std::string& object,
                                               std::size_t frame);

/// The fields of a result: "displacement", its length in mm; "von-mises", the equivalent stress of
/// the mean tensor at a node in Pa, where the scene emitted stress.
const std::vector<std::string>& result_field_names();

/// The value of a field at each node of the object in one frame, central nodes too; none where it
/// is not there yet. \throw Error as read_result_surface, and if the object has no such field then;
/// if a value is not finite
std::vector<double> read_result_values(const std::string& path, const std::string& object,
                                       std::size_t frame, const std::string& field);

} // namespace gewebe::formats
