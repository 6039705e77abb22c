#pragma once
// Objects that give way each for itself as one: the nodes of the first, then those of the second,
// and so on.

#include "statics/static_contact.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace gewebe {

class JoinedYielding final : public Yielding {
public:
  struct Part {
    std::unique_ptr<Yielding> object;
    std::uint32_t first = 0; ///< its first node in the whole
  };
  /// \param parts by ascending first nodes \param nodes of all
  JoinedYielding(std::vector<Part> parts, std::size_t nodes);

  DelassusOperator delassus_operator(std::span<const std::uint32_t> nodes) override;
  bool push(std::span<const NodeTouch> touches, std::span<const Vec3> at) override;
  /// Of all nodes; 0 where a part doesn't know its own.
  std::span<const double> shape() override;
  /// How many numbers of a part the last shape has.
  std::size_t known(std::size_t part) const { return known_[part]; }

private:
  std::uint32_t end_of(std::size_t part) const;

  std::vector<Part> parts_;
  std::uint32_t nodes_ = 0;
  std::vector<std::uint32_t> asked_; ///< nodes of the last operator
  std::vector<double> shape_;
  std::vector<std::size_t> known_;
};

/// What a part has of what is by ascending nodes of the whole, with its own numbers.
std::vector<NodeTouch> touches_of_part(std::span<const NodeTouch> touches, std::uint32_t first,
                                       std::uint32_t end);

} // namespace gewebe
