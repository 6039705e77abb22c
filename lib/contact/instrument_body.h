#pragma once
// An instrument in a step of contact: its vertices go to their targets, whatever stands in the way,
// or, under a virtual coupling, to where coupling and contact forces balance (contact/coupling.h).

#include "contact/contact_body.h"
#include "contact/instrument.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::contact {

class InstrumentBody final : public ContactBody {
public:
  /// \param corners  vertices at its own pose
  /// \param compliance  of a coupling, mm per 1e-6 N; 0: none, the pose is prescribed
  /// \param last  forces on the vertices in the last step
  InstrumentBody(std::vector<Vec3> corners, const Pose& from, const Pose& to, double compliance,
                 std::vector<VertexForce> last)
      : corners_(std::move(corners)), from_(from), to_(to), compliance_(compliance),
        last_(std::move(last)) {
    for (const Vec3& c : corners_)
      at_.push_back(from_(c));
  }

  std::size_t vertex_count() const override { return corners_.size(); }
  void positions(std::span<Vec3> x) override { std::ranges::copy(at_, x.begin()); }
  double linearise(std::span<const VertexForce> forces, std::span<Vec3> step) override {
    begin_ = at_;
    const Vec3 off = compliance_ * sum(forces);
    for (std::size_t k = 0; k < corners_.size(); ++k)
      step[k] = to_(corners_[k]) + off - begin_[k];
    return compliance_ > 0 ? dot(step[0], step[0]) / compliance_ : 0;
  }
  std::vector<VertexForce> last_forces() const override {
    return compliance_ > 0 ? last_ : std::vector<VertexForce>{};
  }
  void compliance(std::uint32_t /*vertex*/, std::span<const std::uint32_t> /*rows*/,
                  std::span<Block3> blocks) override {
    for (Block3& block : blocks)
      block = {compliance_, 0, 0, 0, compliance_, 0, 0, 0, compliance_};
  }
  void move(double share, std::span<const VertexForce> forces) override {
    force_ = sum(forces);
    for (std::size_t k = 0; k < corners_.size(); ++k) {
      const Vec3 target = to_(corners_[k]);
      at_[k] = target + compliance_ * force_ + share * (begin_[k] - target);
    }
  }
  bool is_linear() const override { return true; }
  bool is_rigid() const override { return true; }
  bool is_led() const override { return !(compliance_ > 0) && from_ != to_; }
  double typical_force() const override { return 0; }

  /// How far it stands from its target.
  Vec3 displacement() const { return compliance_ * force_; }

private:
  static Vec3 sum(std::span<const VertexForce> forces) {
    Vec3 all;
    for (const VertexForce& f : forces)
      all += f.force;
    return all;
  }

  std::vector<Vec3> corners_, at_, begin_;
  Pose from_, to_;
  double compliance_ = 0;
  std::vector<VertexForce> last_;
  Vec3 force_;
};

} // namespace gewebe::contact
