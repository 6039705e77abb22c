#pragma once
// A body whose vertices all go where they must: an obstacle for others.

#include "contact/contact_body.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::contact {

class HeldBody final : public ContactBody {
public:
  /// \param from, to  positions of all vertices at the beginning and the end of the step
  HeldBody(std::vector<Vec3> from, std::vector<Vec3> to)
      : at_(std::move(from)), to_(std::move(to)) {}

  std::size_t vertex_count() const override { return at_.size(); }
  void positions(std::span<Vec3> x) override { std::ranges::copy(at_, x.begin()); }
  double linearise(std::span<const VertexForce> /*forces*/, std::span<Vec3> step) override {
    begin_ = at_;
    for (std::size_t k = 0; k < at_.size(); ++k)
      step[k] = to_[k] - at_[k];
    return 0;
  }
  void compliance(std::uint32_t /*vertex*/, std::span<const std::uint32_t> /*rows*/,
                  std::span<Block3> blocks) override {
    std::ranges::fill(blocks, Block3{});
  }
  void move(double share, std::span<const VertexForce> /*forces*/) override {
    for (std::size_t k = 0; k < at_.size(); ++k)
      at_[k] = share > 0 ? to_[k] + share * (begin_[k] - to_[k]) : to_[k];
  }
  bool is_led() const override { return at_ != to_; }
  bool is_linear() const override { return true; }
  double typical_force() const override { return 0; }

private:
  std::vector<Vec3> at_, to_, begin_;
};

} // namespace gewebe::contact
