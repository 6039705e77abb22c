#pragma once
// What the readers and writers of tetrahedral meshes share.

#include "base/error.h"
#include "formats/mesh/ply_header.h"
#include "formats/mesh/text_words.h"
#include "formats/stream/pieces.h"
#include "formats/tetrahedra/tet_file.h"

#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace gewebe::formats::tet {

static_assert(std::endian::native == std::endian::little, "the codecs copy little-endian memory");

tetrahedra::TetMesh read_ply(std::string_view bytes, const std::string& name, TetReadStats& stats);
tetrahedra::TetMesh read_vtu(std::string_view bytes, const std::string& name, TetReadStats& stats);
tetrahedra::TetMesh read_msh(std::string_view bytes, const std::string& name, TetReadStats& stats);
tetrahedra::TetMesh read_vtk(std::string_view bytes, const std::string& name, TetReadStats& stats);
tetrahedra::TetMesh read_inp(std::string_view bytes, const std::string& name, TetReadStats& stats);
tetrahedra::TetMesh read_medit(std::string_view bytes, const std::string& name,
                               TetReadStats& stats);
void write_ply(const tetrahedra::TetMesh& mesh, const Sink& sink);
void write_vtu(const tetrahedra::TetMesh& mesh, const Sink& sink);
void write_vtk(const tetrahedra::TetMesh& mesh, const Sink& sink);
void write_inp(const tetrahedra::TetMesh& mesh, const Sink& sink);
void write_msh2(const tetrahedra::TetMesh& mesh, const Sink& sink);
void write_msh4(const tetrahedra::TetMesh& mesh, const Sink& sink);
void write_medit(const tetrahedra::TetMesh& mesh, const Sink& sink);
void write_node(const tetrahedra::TetMesh& mesh, const Sink& sink);
void write_ele(const tetrahedra::TetMesh& mesh, const Sink& sink);

/// VTK's types of cells.
inline constexpr int vtk_linear = 10, vtk_quadratic = 24;
/// Points, lines, triangles and polygons, which readers pass over.
bool is_lower_cell(std::int64_t type);
/// "hexahedra" and the like, for messages.
std::string refused_cell_name(std::int64_t type);

using ply::quoted;
using text::Words;

/// Which element has which order, and materials that come with every tetrahedron.
class Tetrahedra {
public:
  /// Adds one: 4 or 10 nodes, in our order. `fail` is called with what is wrong.
  template <class Fail>
  void add(std::span<const std::uint32_t> nodes, std::int64_t material, const Fail& fail) {
    if (!mesh.tetrahedra.empty() && (nodes.size() == 10) == mesh.middles.empty())
      fail("tetrahedra of 4 and of 10 nodes, expected one order");
    if (material < 0 || material > INT32_MAX)
      fail("material " + std::to_string(material) + ", expected 0 to " + std::to_string(INT32_MAX));
    mesh.tetrahedra.push_back({nodes[0], nodes[1], nodes[2], nodes[3]});
    if (nodes.size() == 10)
      mesh.middles.push_back({nodes[4], nodes[5], nodes[6], nodes[7], nodes[8], nodes[9]});
    mesh.material.push_back(static_cast<std::int32_t>(material));
  }
  /// Without materials if all are 0.
  tetrahedra::TetMesh take_unless_zero();

  tetrahedra::TetMesh mesh;
};

/// The nodes of one, corners then middles: 4 or 10.
class TetNodes {
public:
  TetNodes(const tetrahedra::TetMesh& mesh, std::size_t t) {
    for (std::size_t k = 0; k < 4; ++k)
      nodes_[k] = mesh.tetrahedra[t][k];
    if (mesh.middles.empty())
      return;
    size_ = 10;
    for (std::size_t k = 0; k < 6; ++k)
      nodes_[4 + k] = mesh.middles[t][k];
  }
  std::span<const std::uint32_t> in_order() const& { return {nodes_.data(), size_}; }
  std::span<const std::uint32_t> in_order() const&& = delete; // would dangle
  std::uint32_t operator[](std::size_t k) const { return nodes_[k]; }
  std::size_t size() const { return size_; }

private:
  std::array<std::uint32_t, 10> nodes_{};
  std::size_t size_ = 4;
};

} // namespace gewebe::formats::tet
