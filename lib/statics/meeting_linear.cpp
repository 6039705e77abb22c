#include "statics/meeting_linear_internal.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

namespace gewebe {

namespace {

using Eigen::Index, Eigen::MatrixXd;

constexpr double immovable = 1e-12; ///< of the largest compliance
/// Of the largest compliance: pairs that could share a force anyhow, as corners of two triangles
/// that lie on each other, share it in one way: a proximal point, near the last forces, so that
/// nothing is left of it where these stay. More of it where less is not enough.
constexpr std::array shared{1e-5, 1e-4, 1e-3};
/// Of forces with friction, over the largest: what is looked for, and what counts as solved.
constexpr double sought = 1e-7, fair = 1e-4;

/// Calls visit(row of the operator's nodes, share) for nodes of a pair that give way.
template <class Visit>
void for_shares(const SurfacePair& p, std::span<const std::uint32_t> nodes, Visit&& visit) {
  for (std::size_t c = 0; c < 4; ++c) {
    const auto at = std::ranges::lower_bound(nodes, p.nodes[c]);
    if (p.share[c] != 0 && at != nodes.end() && *at == p.nodes[c])
      visit(3 * (at - nodes.begin()), p.share[c]);
  }
}

/// \param last their forces \param part of `shared`
bool push_near(const MeetingColumns& columns, std::span<const Contact> contacts,
               std::span<const SurfacePush> last, double part, std::span<SurfacePush> pairs) {
  MatrixXd w = columns.compliance;
  const double largest = w.diagonal().cwiseAbs().maxCoeff();
  const auto along = [&](const Contact& a, const Contact& b) {
    return eigen(a.normal).dot(
        w.block<3, 3>(3 * static_cast<Index>(a.node), 3 * static_cast<Index>(b.node)) *
        eigen(b.normal));
  };
  std::vector<Contact> some; // those that give way
  for (const Contact& c : contacts)
    if (along(c, c) > immovable * largest)
      some.push_back(c);
  w.diagonal().array() += part * largest;
  std::vector<Vec3> guess;
  for (Contact& c : some) {
    const Vec3 before = last[c.node].force, off = part * largest * before;
    c.gap -= dot(c.normal, off);
    c.slip -= off;
    guess.push_back(before);
  }
  for (SurfacePush& p : pairs)
    p.force = {};
  if (std::ranges::any_of(some, [](const Contact& c) { return c.friction > 0; })) {
    const ContactForces found = solve_contacts({w.data(), static_cast<std::size_t>(w.size())},
                                               pairs.size(), some, guess, sought);
    for (std::size_t i = 0; i < some.size(); ++i)
      pairs[some[i].node].force = found.force[i];
    return found.residual <= fair;
  }
  const auto count = static_cast<Index>(some.size());
  MatrixXd normal(count, count);
  std::vector<double> gap, start;
  for (std::size_t i = 0; i < some.size(); ++i) {
    for (std::size_t j = 0; j < some.size(); ++j)
      normal(static_cast<Index>(i), static_cast<Index>(j)) = along(some[i], some[j]);
    gap.push_back(some[i].gap);
    start.push_back(dot(guess[i], some[i].normal));
  }
  const PushForces found =
      solve_pushes({normal.data(), static_cast<std::size_t>(normal.size())}, gap, start);
  for (std::size_t i = 0; i < some.size(); ++i)
    pairs[some[i].node].force = found.push[i] * some[i].normal;
  return found.solved;
}

} // namespace

Vec3 between(const SurfacePair& pair, std::span<const Vec3> at) {
  Vec3 sum;
  for (std::size_t c = 0; c < 4; ++c)
    sum += pair.share[c] * at[pair.nodes[c]];
  return sum;
}

MeetingColumns columns_of_pairs(std::span<const SurfacePush> pairs,
                                std::span<const std::uint32_t> nodes,
                                std::span<const double> compliance) {
  const auto size = static_cast<Index>(3 * nodes.size());
  const auto count = static_cast<Index>(3 * pairs.size());
  const Eigen::Map<const MatrixXd> w(compliance.data(), size, size);
  MeetingColumns c{MatrixXd::Zero(size, count), MatrixXd::Zero(count, count)};
  for (std::size_t k = 0; k < pairs.size(); ++k)
    for_shares(pairs[k].pair, nodes, [&](Index row, double share) {
      c.moved.middleCols<3>(static_cast<Index>(3 * k)) += share * w.middleCols<3>(row);
    });
  for (std::size_t k = 0; k < pairs.size(); ++k)
    for_shares(pairs[k].pair, nodes, [&](Index row, double share) {
      c.compliance.middleRows<3>(static_cast<Index>(3 * k)) += share * c.moved.middleRows<3>(row);
    });
  c.compliance = (0.5 * (c.compliance + c.compliance.transpose())).eval();
  return c;
}

std::vector<std::size_t> counting_pairs(std::span<const SurfacePush> pairs) {
  std::vector<std::size_t> all;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> met;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const SurfacePair& p = pairs[k].pair;
    if (p.apart)
      continue;
    const auto corner = std::ranges::find(p.share, -1.0);
    if (!p.edges && corner != p.share.end()) {
      const std::uint32_t other = p.nodes[static_cast<std::size_t>(corner - p.share.begin())];
      if (!met.try_emplace(std::minmax(p.nodes[0], other), k).second)
        continue;
    }
    all.push_back(k);
  }
  return all;
}

bool push_pairs(const MeetingColumns& columns, std::span<const Contact> contacts,
                std::span<SurfacePush> pairs) {
  if (pairs.empty())
    return true;
  const std::vector<SurfacePush> last(pairs.begin(), pairs.end());
  for (const double part : shared)
    if (push_near(columns, contacts, last, part, pairs))
      return true;
  return false;
}

} // namespace gewebe
