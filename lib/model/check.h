#pragma once
// The invariants of model.h, checked element by element while a model is being filled.

#include "base/context.h"
#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace gewebe::model {

/// \throw Error if a model or a material can't have this name
void check_name(const std::string& name);

/// check_model (model.h) on several threads. \throw too Cancelled
void check_model(const Model& model, const Context& context);

/// Sections must be given in the order of ELA_EXPL. Each call checks element `i` of that section,
/// which must already be in the model, against everything before it. Every call throws Error
/// without a place.
class ModelChecker {
public:
  explicit ModelChecker(const Model& model) : model_(model) {}

  void name() const;
  void material(std::size_t i) const;
  /// Before the first node: `count` nodes will come, and indices are held against that.
  void begin_nodes(std::size_t count);
  void node(std::size_t i);
  /// After the last node.
  void all_nodes() const;
  void normal(std::size_t i) const;
  void spring(std::size_t i) { spring(i, merge_); }
  /// spring(i) for some, which may be checked side by side with others. All of them must be there.
  void springs(std::size_t begin, std::size_t end) const;
  void triangle(std::size_t i) const;
  void texcoord(std::size_t i) const;
  void tetrahedron(std::size_t i) const;
  void skin_point(std::size_t i) const;
  /// After the last point of the skin.
  void skin_triangle(std::size_t i) const;
  void skin_texcoord(std::size_t i) const;

private:
  void spring(std::size_t i, std::size_t& merge) const;
  void corners(std::span<const std::uint32_t> index) const;
  void require_material(std::int32_t material) const;

  const Model& model_;
  std::size_t node_count_ = 0;
  std::size_t first_central_ = 0; ///< node_count_ while there is none
  std::vector<bool> named_;       ///< per node: some node's central
  std::size_t merge_ = 0;         ///< see spring()
};

} // namespace gewebe::model
