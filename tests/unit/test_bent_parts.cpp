#include "statics/bent_parts_internal.h"
#include "statics/contact_turns_internal.h"

#include <cstdint>
#include <gtest/gtest.h>
#include <random>
#include <vector>

namespace gewebe {
namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

constexpr std::size_t nodes_of_one = 4;

/// Two patches of four nodes, whose forces move the other by `between` of what they move their own,
/// and turn within their patch alone.
struct TwoPatches {
  ContactNodes nodes;
  MatrixXd w, h;
  std::vector<Index> turning; ///< rows of h
  std::mt19937 random{7};

  explicit TwoPatches(double between) {
    nodes.moving = 2 * nodes_of_one;
    for (std::uint32_t first : {0U, 4U})
      for (std::uint32_t k = 0; k < 2; ++k)
        nodes.pieces.push_back({first + k, first + k + 1, first + k + 2});
    const auto rows = static_cast<Index>(3 * nodes.moving), half = rows / 2;
    const MatrixXd some = matrix(rows, rows);
    w = MatrixXd::Identity(rows, rows) + 0.1 * (some + some.transpose());
    w.topRightCorner(half, half) *= between;
    w.bottomLeftCorner(half, half) *= between;
    for (Index r = 0; r < rows; ++r)
      if (r % half >= 3) // the first node of each turns nothing
        turning.push_back(r);
    const auto count = static_cast<Index>(turning.size());
    const MatrixXd any = matrix(count, count);
    h = 0.1 * (any + any.transpose());
    h.topRightCorner(count / 2, count / 2).setZero();
    h.bottomLeftCorner(count / 2, count / 2).setZero();
  }
  BentCompliance::Compliance map() const { return {w.data(), w.rows(), w.cols()}; }
  std::vector<Turning> whole() const { return {{turning, h}}; }
  std::vector<Turning> apart() const {
    const auto half = std::ssize(turning) / 2;
    const std::vector<Index> own(turning.begin(), turning.begin() + half);
    return {{own, h.topLeftCorner(half, half)}, {own, h.bottomRightCorner(half, half)}};
  }
  MatrixXd matrix(Index rows, Index columns) {
    std::uniform_real_distribution<double> in(-1, 1);
    return MatrixXd::NullaryExpr(rows, columns, [&] { return in(random); });
  }
  VectorXd vector() { return matrix(w.rows(), 1); }
  /// Where the nodes are under pushes.
  VectorXd under(const BentParts& bent, const BentStart& start, const VectorXd& last,
                 const VectorXd& pushes) const {
    MatrixXd columns = w;
    std::vector<std::uint32_t> node;
    for (std::uint32_t i = 0; i < nodes.moving; ++i)
      node.push_back(i);
    bent.apply(columns, node, 3);
    return bent.without(start, last) + columns * pushes;
  }
};

TEST(BentParts, AreOfPiecesThatMoveEachOtherByLittle) {
  const TwoPatches far(0.01), near(0.9);
  const ContactParts apart = parts_of(far.nodes, far.map());
  ASSERT_EQ(apart.size(), 2U);
  EXPECT_EQ(apart.of_node, (std::vector<std::uint32_t>{0, 0, 0, 0, 1, 1, 1, 1}));
  EXPECT_EQ(apart.compliance[1], MatrixXd(far.w.bottomRightCorner(12, 12)));
  EXPECT_EQ(parts_of(near.nodes, near.map()).size(), 1U);
  TwoPatches joined(0.01);
  joined.nodes.pieces.push_back({3, 4, 4});
  EXPECT_EQ(parts_of(joined.nodes, joined.map()).size(), 1U);
}

TEST(BentParts, AreTheWholeWhereNoneMovesTheOther) {
  TwoPatches patches(0);
  const ContactParts parts = parts_of(patches.nodes, patches.map());
  ASSERT_EQ(parts.size(), 2U);
  const BentParts whole(patches.map(), patches.whole()),
      apart(patches.map(), patches.apart(), &parts);
  const VectorXd free = patches.vector(), held = patches.vector(), at = patches.vector(),
                 last = patches.vector(), pushes = patches.vector();
  const VectorXd one = patches.under(whole, whole.start(free, held, at), last, pushes),
                 two = patches.under(apart, apart.start(free, held, at), last, pushes);
  EXPECT_LT((one - two).norm(), 1e-12 * one.norm());
  EXPECT_LT((whole.turning(at) - apart.turning(at)).norm(), 1e-12 * at.norm());
}

TEST(BentParts, ComeToRestWhereForcesPutTheNodes) {
  TwoPatches patches(0.2); // what is left out is not little
  ContactParts parts = parts_of(patches.nodes, patches.map());
  ASSERT_EQ(parts.size(), 2U);
  const BentParts apart(patches.map(), patches.apart(), &parts);
  const VectorXd free = patches.vector(), pushes = patches.vector(),
                 none = VectorXd::Zero(free.size());
  const VectorXd at = free + patches.w * pushes;
  const VectorXd again = patches.under(apart, apart.start(free, none, at), pushes, pushes);
  EXPECT_LT((again - at).norm(), 1e-12 * at.norm());
}

TEST(BentParts, LeaveLessOfWhatIsFartherAway) {
  const auto miss = [](double between) {
    TwoPatches patches(between);
    const ContactParts parts = parts_of(patches.nodes, patches.map());
    EXPECT_EQ(parts.size(), 2U);
    const BentParts whole(patches.map(), patches.whole()),
        apart(patches.map(), patches.apart(), &parts);
    const VectorXd free = patches.vector(), none = VectorXd::Zero(free.size()),
                   at = patches.vector(), last = patches.vector(), pushes = patches.vector();
    return (patches.under(whole, whole.start(free, none, at), last, pushes) -
            patches.under(apart, apart.start(free, none, at), last, pushes))
        .norm();
  };
  EXPECT_GT(miss(0.1), 1e-4);
  EXPECT_LT(miss(0.01), 0.2 * miss(0.1));
  EXPECT_LT(miss(0.001), 0.2 * miss(0.01));
}

} // namespace
} // namespace gewebe
