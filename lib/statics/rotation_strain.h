#pragma once
// The surface of a solid from rotations and strains.
//
// A small displacement u has at each place a rotation, axial vector curl u / 2, and a strain E.
// Frames turn by w, that rotation without its short waves; r is the rotation beyond w. As large
// rotations and strains in their frames, they prescribe the gradient R(w) (I + E + E² / 2 + [r]) of
// the places; the surface with the nearest gradients is found by a Poisson equation for each axis
// (Huang, Tong, Zhou, Bao, Desbrun, Interactive shape interpolation through controllable dynamic
// deformation, IEEE TVCG 17(7), 2011, in the volume). Here it is done on the surface alone: nothing
// pulls at a free surface, so that its normal stays at right angles and the tilt of the surface is
// the rotation. Against the same in the volume it changes displacements of a beam bent by 45
// degrees by 0.1 % of the largest. Faces are triangles of their corners; middles of quadratic
// elements' edges stand as far from the middle of the corners as they do under small strains,
// turned with the triangles at their edge.
//
// Differentiated and transposed, the map takes forces on the deformed surface back to forces on the
// one at rest that do the same work: what a load does in the local frames, lever arms included,
// for statics/rotation_warp.h.
//
// Without waves shorter than the body's volume over its surface, by a Helmholtz equation on the
// surface: of forces that all go through the surface, where the map has them, shorter ones would
// turn the surface with less work than the body's stiffness takes, however small the strain.
//
// Angles are sums of powers, good to rounding up to a quarter of a turn, to 1e-9 up to half of one,
// to 1e-5 up to a whole one. The same bytes everywhere.

#include "base/context.h"
#include "base/cpu.h"
#include "fem/assembly.h"
#include "geometry/vec3.h"
#include "linalg/factor.h"
#include "linalg/stiffness.h"
#include "tetrahedra/tet_mesh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace gewebe::statics {

struct TriangleGroup;
struct MiddleGroup;

class RotationStrain {
public:
  /// Costs the factors of two Laplacians, on the surface (three, if axes are fixed at different
  /// nodes) and inside, together a few hundredths of K's. \pre as solid_stiffness
  /// \throw Error if a part of the surface has no corner that is fixed along an axis, to be built
  /// from, as that of a cavity; Cancelled
  RotationStrain(const tetrahedra::TetMesh& mesh, std::span<const fem::SolidElement> elements,
                 std::span<const std::uint8_t> fixed, const Context& context = {});

  ~RotationStrain();
  RotationStrain(RotationStrain&&) noexcept;
  RotationStrain& operator=(RotationStrain&&) noexcept;

  /// The nodes of the surface, corners ascending, then middles ascending; everything below counts
  /// them in this order.
  const std::vector<std::uint32_t>& nodes() const noexcept { return nodes_; }
  std::size_t corners() const noexcept { return corners_; }
  static constexpr std::uint32_t none = UINT32_MAX;
  /// Where a node of the mesh stands among them, or none.
  const std::vector<std::uint32_t>& place() const noexcept { return place_; }

  /// Displacements of the surface from those of small strains. One pass over triangles, one
  /// solution of the surface's Laplacian. \pre spans have 3 entries for each node
  void deform(std::span<const double> local, std::span<const double> turning,
              std::span<double> u) const;

  /// y of forces f on the surface: the solution of the Laplacian at corners, f itself at middles;
  /// linear, once for each f.
  void spread(std::span<const double> f, std::span<double> y) const;
  /// The forces that do, under any change of `local`, the work that f = of spread's do under the
  /// change of deform(local). One pass over triangles. 0 on fixed axes is not promised.
  void take_back(std::span<const double> local, std::span<const double> turning,
                 std::span<const double> y, std::span<double> forces) const;

  /// The frames' w of each triangle under `local`, for what follows.
  std::vector<double> turning(std::span<const double> local) const;
  /// R at a node: of the mean w of its triangles, by their areas at corners.
  std::array<double, 9> rotation(std::span<const double> turning, std::uint32_t node) const;

  /// Loads of all 3 n axes of the mesh put on the surface: those inside move onto it as if the
  /// inside followed it harmonically, so that their sum and their work in any affine motion stay.
  std::vector<double> on_surface(std::span<const double> load) const;
  /// Displacements of all nodes of the mesh, where the inside follows those of the surface
  /// harmonically; 0 at nodes of no tetrahedron.
  std::vector<double> extend(std::span<const double> surface) const;

private:
  struct Triangle {
    std::array<std::uint32_t, 3> node{};
    std::array<Vec3, 2> gradient{}; ///< of the second and third shape function
    Vec3 normal;
    double area = 0;
  };
  struct Middle {
    std::uint32_t node = 0, a = 0, b = 0;
    std::array<std::uint32_t, 2> triangle{};
  };
  struct Laplacian {
    std::vector<std::int64_t> row; ///< of each node, or -1
    std::size_t order = 0;
    std::optional<linalg::Factor> factor; ///< none where no node is free
  };
  void solve(std::span<const double> f, std::span<double> y) const;
  void list_triangles(const tetrahedra::TetMesh& mesh, std::span<const std::uint8_t> fixed);
  void fill_surface_matrix(linalg::StiffnessMatrix& matrix, double stiffness, double mass) const;
  void factor_surface(std::span<const std::uint8_t> fixed, const Context& context);
  void factor_smoothing(std::span<const fem::SolidElement> elements, const Context& context);
  std::vector<double> smoothed(std::span<const double> of_triangles) const;

  std::vector<std::uint32_t> nodes_, place_;
  std::vector<Triangle> triangles_;
  std::vector<TriangleGroup> groups_; ///< the same
  std::vector<Middle> middles_;       ///< by their nodes
  std::vector<MiddleGroup> middle_groups_;
  std::size_t corners_ = 0;
  CpuLevel cpu_;
  std::vector<std::size_t> start_; ///< of each corner's triangles
  std::vector<std::uint32_t> at_;
  std::optional<linalg::Factor> smoothing_;
  std::vector<Laplacian> axes_;          ///< one for all axes, or one for each
  std::optional<linalg::Factor> inside_; ///< of the Laplacian on inner nodes, if there are any
  std::vector<std::int64_t> inner_row_;  ///< of each node of the mesh
  linalg::StiffnessMatrix between_;      ///< the whole Laplacian of the volume
};

} // namespace gewebe::statics
