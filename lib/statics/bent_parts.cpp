#include "statics/bent_parts_internal.h"

#include "statics/contact_turns_internal.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace gewebe {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

namespace {

/// Of two parts' blocks between them over their own: less is far.
constexpr double far_apart = 0.1;

class Sets {
public:
  explicit Sets(std::size_t count) : of_(count) { std::iota(of_.begin(), of_.end(), 0U); }
  std::uint32_t find(std::uint32_t i) {
    while (of_[i] != i)
      i = of_[i] = of_[of_[i]];
    return i;
  }
  /// The least of both stands for them.
  void join(std::uint32_t a, std::uint32_t b) {
    a = find(a);
    b = find(b);
    of_[std::max(a, b)] = std::min(a, b);
  }
  /// Numbered as they first come. \return how many
  std::uint32_t number(std::vector<std::uint32_t>& of) {
    std::uint32_t count = 0;
    of.resize(of_.size());
    for (std::uint32_t i = 0; i < of_.size(); ++i)
      of[i] = find(i) == i ? count++ : of[find(i)];
    return count;
  }

private:
  std::vector<std::uint32_t> of_;
};

/// Whether one's forces move the other too much.
bool near(double between, double own, double other) {
  return !(between <= far_apart * far_apart * std::sqrt(own * other));
}

} // namespace

ContactParts parts_of(const ContactNodes& nodes, const BentCompliance::Compliance& w) {
  ContactParts parts;
  Sets linked(nodes.moving);
  for (const Facet& piece : nodes.pieces)
    for (const std::uint32_t i : piece)
      for (const std::uint32_t j : piece)
        if (i < j && j < nodes.moving)
          linked.join(i, j);
  std::uint32_t count = linked.number(parts.of_node);
  if (count > 1) {
    MatrixXd square = MatrixXd::Zero(count, count); // of the blocks of W
    for (Index c = 0; c < w.cols(); ++c)
      for (Index r = 0; r < w.rows(); ++r)
        square(parts.of_node[static_cast<std::size_t>(r / 3)],
               parts.of_node[static_cast<std::size_t>(c / 3)]) += w(r, c) * w(r, c);
    Sets together(count);
    for (std::uint32_t a = 0; a < count; ++a)
      for (std::uint32_t b = a + 1; b < count; ++b)
        if (near(square(a, b), square(a, a), square(b, b)))
          together.join(a, b);
    std::vector<std::uint32_t> of_part;
    count = together.number(of_part);
    for (std::uint32_t& part : parts.of_node)
      part = of_part[part];
  }
  parts.rows.resize(count);
  for (std::size_t i = 0; i < nodes.moving; ++i)
    for (Index a = 0; a < 3; ++a)
      parts.rows[parts.of_node[i]].push_back(3 * static_cast<Index>(i) + a);
  if (count > 1)
    for (const std::vector<Index>& rows : parts.rows)
      parts.compliance.emplace_back(w(rows, rows));
  return parts;
}

BentParts::BentParts(const BentCompliance::Compliance& w, std::vector<Index> rows, MatrixXd h)
    : w_(w) {
  bent_.emplace_back(w, std::move(rows), std::move(h));
}

BentParts::BentParts(const BentCompliance::Compliance& w, const std::vector<Index>& rows,
                     const MatrixXd& h, const ContactParts& parts)
    : w_(w), parts_(&parts) {
  bent_.reserve(parts.size());
  for (std::size_t p = 0; p < parts.size(); ++p) {
    std::vector<Index> own, from; // rows of the part on which forces turn: there, and in h
    for (Index k = 0; k < std::ssize(rows); ++k) {
      const Index row = rows[static_cast<std::size_t>(k)];
      if (parts.of_node[static_cast<std::size_t>(row / 3)] != p)
        continue;
      own.push_back(std::ranges::lower_bound(parts.rows[p], row) - parts.rows[p].begin());
      from.push_back(k);
    }
    const MatrixXd& some = parts.compliance[p];
    bent_.emplace_back(BentCompliance::Compliance(some.data(), some.rows(), some.cols()),
                       std::move(own), h(from, from));
  }
}

VectorXd BentParts::without(const VectorXd& free, const VectorXd& held, const VectorXd& at,
                            const VectorXd& pushed) const {
  if (parts_ == nullptr) {
    MatrixXd all = free;
    all += w_ * (held - bent_[0].turning(at));
    bent_[0].apply(all);
    return all;
  }
  VectorXd all = free;
  if (!held.isZero(0))
    all += w_ * held;
  const VectorXd moved = w_ * pushed; // by all pushes
  for (std::size_t p = 0; p < bent_.size(); ++p) {
    const std::vector<Index>& rows = parts_->rows[p];
    const MatrixXd& own = parts_->compliance[p];
    const VectorXd far = moved(rows) - own * pushed(rows);
    MatrixXd some = all(rows) + far - own * bent_[p].turning(at(rows));
    bent_[p].apply(some);
    all(rows) = some.col(0) - far;
  }
  return all;
}

void BentParts::apply(MatrixXd& columns, std::span<const std::uint32_t> node, Index width) const {
  if (parts_ == nullptr)
    return bent_[0].apply(columns);
  for (std::size_t p = 0; p < bent_.size(); ++p) {
    std::vector<Index> own;
    for (std::size_t k = 0; k < node.size(); ++k)
      for (Index a = 0; a < width && parts_->of_node[node[k]] == p; ++a)
        own.push_back(width * static_cast<Index>(k) + a);
    if (own.empty())
      continue;
    MatrixXd some = columns(parts_->rows[p], own);
    bent_[p].apply(some);
    columns(parts_->rows[p], own) = some;
  }
}

VectorXd BentParts::turning(const VectorXd& x) const {
  if (parts_ == nullptr)
    return bent_[0].turning(x);
  VectorXd all(x.size());
  for (std::size_t p = 0; p < bent_.size(); ++p)
    all(parts_->rows[p]) = bent_[p].turning(x(parts_->rows[p]));
  return all;
}

} // namespace gewebe
