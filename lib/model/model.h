#pragma once
// The deformable model: point masses, springs and triangles (report 3.1.3, object type ELA_EXPL).
//
// Units are mm, g, s: stiffness g/s² (1e-3 N/m), damping and drag g/s, stress Pa.
//
// Nodes 0 … S-1 are those of the surface (and of the interior, where there are tetrahedra), in mesh
// order; nodes S … N-1 are central nodes, to which surface nodes are tied so that the object moves
// and rotates as a whole. Invariants, which `check_model` verifies:
//   - there is a material and a node;
//   - every number is finite; names contain no `"`, `#` or control character;
//   - density, thickness > 0; young, damping ratio, mass, drag, stiffness, damping, rest >= 0;
//   - a material with a law has a Poisson's ratio, and check_law(law) passes;
//   - a node's material exists;
//   - a node's central is -1 or the index of a later node; the nodes named so are consecutive, and
//     their own central is -1;
//   - `normals`, `texcoords` are empty or complete: one normal per node (0 for central nodes), six
//     coordinates per triangle;
//   - a spring has i < j, springs ascend strictly by (kind, i, j), no pair occurs under two kinds;
//   - the ends of a spring have different positions;
//   - a spring of kind central joins a node to its own central node, other kinds join none;
//   - a triangle, or a tetrahedron, has different nodes, none of them a central node;
//   - a tetrahedron has a positive volume, and an existing material with a Poisson's ratio;
//   - all tetrahedra have middles, or none;
//   - a skin has points, each with an existing tetrahedron;
//   - its triangles have three different points, and an existing material;
//   - its `texcoords` are empty or complete.

#include "geometry/mesh.h"
#include "geometry/vec3.h"
#include "model/hyperelastic_law.h"
#include "model/prony.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::model {

struct Material {
  std::string name;
  double density = 1e-3;         ///< g/mm³
  double young = 1e4;            ///< Young's modulus, Pa
  double thickness = 1;          ///< of the wall that the surface stands for, mm
  double damping_ratio = 0.2;    ///< of a spring with its two masses; 1 is critical
  std::optional<double> poisson; ///< Poisson's ratio, 0 to below 1/2; springs do not use it
  /// Of large strains; springs and small strains do not use it. None: the law is left to the user
  /// of the model, see fem/solid_model.h.
  std::optional<HyperelasticLaw> law{};
  std::vector<PronyTerm> prony{}; ///< none: elastic

  bool operator==(const Material&) const = default;
};

/// Axes along which a node can't move, as a set.
enum FixedAxes : std::uint8_t {
  fixed_none = 0,
  fixed_x = 1,
  fixed_y = 2,
  fixed_z = 4,
  fixed_all = 7
};

/// "-", "x", "y", "xy", "z", "xz", "yz", "xyz" for the sets 0 … 7.
std::string_view fixed_axes_name(std::uint8_t fixed);
/// The set of that name, or nothing.
std::optional<std::uint8_t> fixed_axes_from_name(std::string_view name);

struct Node {
  Vec3 position;             ///< at rest, mm
  double mass = 0;           ///< g
  double drag = 0;           ///< force is -drag · velocity, g/s
  std::uint8_t fixed = 0;    ///< set of FixedAxes
  std::int32_t central = -1; ///< the central node that it belongs to, or -1
  std::int32_t material = 0;

  bool operator==(const Node&) const = default;
};

enum class SpringKind : std::uint8_t { edge, bend, central };

/// Pulls i towards j with stiffness (l - rest) + damping d(l)/dt.
struct Spring {
  std::uint32_t i = 0, j = 0; ///< i < j
  SpringKind kind = SpringKind::edge;
  double stiffness = 0; ///< g/s²
  double damping = 0;   ///< g/s
  double rest = 0;      ///< mm

  bool operator==(const Spring&) const = default;
};

/// Embedded surface: it follows the elements of a model in pictures and written shapes, without
/// forces in either direction. embedding/skin.h describes how a point follows.
struct Skin {
  std::vector<Vec3> points;                     ///< at rest, mm
  std::vector<std::uint32_t> tetrahedron;       ///< one per point: the element that it follows
  std::vector<Triangle> triangles;              ///< of its points, counter-clockwise from outside
  std::vector<std::int32_t> material;           ///< one per triangle
  std::vector<std::array<double, 6>> texcoords; ///< optional, per triangle s0 t0 s1 t1 s2 t2

  bool operator==(const Skin&) const = default;
};

struct Model {
  std::string name;
  std::vector<Material> materials;
  std::vector<Node> nodes;
  std::vector<Vec3> normals; ///< optional, one per node
  std::vector<Spring> springs;
  /// Counter-clockwise seen from outside; those of quadratic elements are four on each face, so
  /// that middles are corners of triangles.
  std::vector<Triangle> triangles;
  std::vector<std::array<double, 6>> texcoords; ///< optional, per triangle s0 t0 s1 t1 s2 t2
  std::vector<Tetrahedron> tetrahedra;          ///< optional: finite elements
  std::vector<EdgeMiddles> middles; ///< optional, one per tetrahedron: quadratic elements
  std::vector<std::int32_t> tetrahedron_material; ///< one per tetrahedron
  Skin skin;                                      ///< optional, where there are tetrahedra

  bool operator==(const Model&) const = default;
};

/// \throw Error naming the first element that breaks an invariant of this header
void check_model(const Model& model);

/// The nodes that are no central nodes: those of the surface, then those inside a solid. \pre the
/// invariants hold
std::size_t body_count(const Model& model);

/// Number S of the first nodes, among which all those of the surface are: of a model without
/// tetrahedra body_count(); else up to the last corner of a triangle and the last node that no
/// tetrahedron has, so that a model whose nodes inside don't come last has some of them among the
/// S. \pre the invariants hold
std::size_t surface_count(const Model& model);

/// Both counts, to compute them once.
struct NodeCounts {
  std::size_t surface = 0, body = 0;
};
NodeCounts node_counts(const Model& model);

/// Springs of one kind. \pre the invariants hold
std::size_t spring_count(const Model& model, SpringKind kind);

/// Connected component of each node, numbered from 0 by smallest node. Nodes joined by springs of
/// kind edge or by a tetrahedron share one. A central node has the component of the first node that
/// belongs to it.
struct Components {
  std::vector<std::uint32_t> of_node;
  std::uint32_t count = 0;
};
Components components(const Model& model);

/// Sum of the masses of the nodes that are no central nodes, g.
double total_mass(const Model& model);

/// For each node the largest step h in s of semi-implicit Euler with explicit damping for which
///
///   h² Σ w k + 2 h (Σ w c + d) <= 4 m,   that is   h = (√(γ² + 4ω²) - γ)/ω²
///
/// with ω² = Σ w k/m and γ = (Σ w c + d)/m; w is 2, and 1 for springs to nodes that are fixed along
/// all axes. A step is stable for the model at rest where 4 M - 2 h C - h² K is positive definite,
/// which by Gershgorin's theorem holds below the least of these. Infinite for nodes that can't move
/// or that nothing pulls or brakes, 0 where a movable node with springs has no mass.
std::vector<double> safe_steps(const Model& model);

/// The least of safe_steps().
double safe_step(const Model& model);

/// \throw Error naming the node whose safe step is the least, if it is below `step`
void require_safe_step(const Model& model, double step);

/// Raises the masses of the nodes whose safe step is below `step` so that it is `step`; drag and
/// damping stay. \return how many   \pre step > 0
std::size_t scale_masses(Model& model, double step);

/// XXH3-64 of the whole model in file order, 16 hexadecimal digits.
std::string model_digest(const Model& model);

/// The triangles of the model over its surface nodes (same indices), with normals and texture
/// coordinates where it has them, and face materials where it has several.
TriangleMesh surface_mesh(const Model& model);

/// Mesh of a model for pictures and written shapes: its embedded surface at rest, with the points
/// in their order, if it has one; else surface_mesh().
TriangleMesh shown_mesh(const Model& model);

} // namespace gewebe::model
