#pragma once
// Files of VTK in XML with one piece: .vtu and .vtp. Its XML is that which VTK's writers make:
// elements with attributes, comments, declarations, no entities.

#include "base/error.h"
#include "formats/mesh/vtk_numbers.h"
#include "geometry/vec3.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::formats::vtk {

/// Cells by their nodes.
struct Cells {
  std::vector<std::int64_t> ends, nodes; ///< where each ends in `nodes`
  std::span<const std::int64_t> operator[](std::size_t cell) const {
    const auto begin = static_cast<std::size_t>(cell == 0 ? 0 : ends[cell - 1]);
    return std::span(nodes).subspan(begin, static_cast<std::size_t>(ends[cell]) - begin);
  }
};

/// Description of the piece in such a file. `bytes` and `name` outlive it.
class Piece {
public:
  /// Reads tags, no numbers. \param type "UnstructuredGrid" or "PolyData" \param sections whose
  /// arrays are requested, such as "Points" \throw Error with place, unless the file is whole, of
  /// that type and has one piece
  Piece(std::string_view bytes, const std::string& name, const char* type,
        std::initializer_list<std::string_view> sections);

  /// The piece's attribute of that name, such as "NumberOfPoints"; 0 if there is none. All are
  /// below 2^32 - 1.
  std::uint64_t count(std::string_view attribute) const;

  /// The array that a section calls its own for something, such as PointData's for "TCoords"; ""
  std::string active(const std::string& section, const std::string& what) const;

  /// The first array of a section by "Section/name", of points by "Points".
  const Array* find(const std::string& key) const; ///< or nullptr
  const Array& need(const std::string& key) const; ///< \throw Error if there is none
  std::string place(const Array& array) const;     ///< for messages

  /// The numbers of all points. \throw Error as reals
  std::vector<Vec3> points() const;
  /// \throw Error as vtk::integers
  std::vector<std::int64_t> integers(const Array& array, std::uint64_t count) const;
  std::vector<double> reals(const Array& array, std::uint64_t count) const;
  /// The cells of arrays `section`/offsets and /connectivity; nodes may be any numbers.
  /// \throw Error if one ends before it begins, and as above
  Cells cells(const std::string& section, std::uint64_t count) const;

private:
  friend class PieceReader;
  std::string_view bytes_;
  const std::string& name_;
  Encoding encoding_;
  std::map<std::string, Array> arrays_;
  std::map<std::string, std::uint64_t, std::less<>> counts_;
  std::map<std::string, std::string> active_; // by "Section/what"
};

/// The node's number. `fail` is called with what is wrong unless it is below `points`.
template <class Fail>
std::uint32_t node_number(std::int64_t node, std::uint64_t points, const Fail& fail) {
  if (node < 0 || static_cast<std::uint64_t>(node) >= points)
    fail("point " + std::to_string(node) + ", expected 0 to below " + std::to_string(points));
  return static_cast<std::uint32_t>(node);
}

/// Takes the corners of a cell of three or more points. \param place  of the cell, for messages
/// \throw Error of a file of this name if they are fewer, or a point is not below `points`
inline void take_corners(const std::string& name, const std::string& place,
                         std::span<const std::int64_t> nodes, std::uint64_t points,
                         std::vector<std::uint32_t>& corners) {
  const auto fail = [&](const std::string& problem) { throw Error(name, place + ": " + problem); };
  if (nodes.size() < 3)
    fail(std::to_string(nodes.size()) + " points, expected 3 or more");
  corners.clear();
  for (const std::int64_t node : nodes)
    corners.push_back(node_number(node, points, fail));
}

} // namespace gewebe::formats::vtk
