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

/// Of the blocks of W on and above the diagonal: sums of their numbers' squares. \param of_node
/// block of each node
MatrixXd squares_of(std::span<const std::uint32_t> of_node, std::uint32_t count,
                    const BentCompliance::Compliance& w) {
  std::vector<std::vector<Index>> rows(count);
  for (std::size_t i = 0; i < of_node.size(); ++i)
    for (Index a = 0; a < 3; ++a)
      rows[of_node[i]].push_back(3 * static_cast<Index>(i) + a);
  const std::size_t most = std::ranges::max(rows, {}, &std::vector<Index>::size).size();
  MatrixXd square = MatrixXd::Zero(count, count);
  // A column of each block in turn: one sum needn't wait for the other.
  for (std::size_t k = 0; k < most; ++k)
    for (std::uint32_t to = 0; to < count; ++to) {
      if (k >= rows[to].size())
        continue;
      const double* const column = w.col(rows[to][k]).data();
      for (std::uint32_t from = 0; from <= to; ++from) {
        double sum = square(from, to);
        for (const Index r : rows[from])
          sum += column[r] * column[r];
        square(from, to) = sum;
      }
    }
  return square;
}

VectorXd part_of(const VectorXd& all, std::span<const Index> rows) {
  VectorXd some(std::ssize(rows));
  for (std::size_t k = 0; k < rows.size(); ++k)
    some[static_cast<Index>(k)] = all[rows[k]];
  return some;
}

void set_part(VectorXd& all, std::span<const Index> rows, const VectorXd& some) {
  for (std::size_t k = 0; k < rows.size(); ++k)
    all[rows[k]] = some[static_cast<Index>(k)];
}

BentCompliance::Compliance map_of(const MatrixXd& w) {
  return {w.data(), w.rows(), w.cols()};
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
    const MatrixXd square = squares_of(parts.of_node, count, w);
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
  if (count < 2)
    return parts;
  parts.compliance.reserve(count);
  for (const std::vector<Index>& rows : parts.rows) {
    MatrixXd& own = parts.compliance.emplace_back(std::ssize(rows), std::ssize(rows));
    for (std::size_t c = 0; c < rows.size(); ++c) {
      const double* const from = w.col(rows[c]).data();
      double* const to = own.col(static_cast<Index>(c)).data();
      for (std::size_t r = 0; r < rows.size(); ++r)
        to[r] = from[rows[r]];
    }
  }
  return parts;
}

BentParts::BentParts(const BentCompliance::Compliance& w, std::vector<Turning> turning,
                     const ContactParts* parts)
    : w_(w), parts_(parts) {
  bent_.reserve(turning.size());
  for (std::size_t p = 0; p < turning.size(); ++p)
    bent_.emplace_back(parts != nullptr ? map_of(parts->compliance[p]) : w, std::move(turning[p]));
}

BentStart BentParts::start(const VectorXd& free, const VectorXd& held, const VectorXd& at) const {
  BentStart start{free, {}};
  if (parts_ == nullptr) {
    start.free += times(w_, held - bent_[0].turning(at));
    return start;
  }
  if (!held.isZero(0))
    start.free += times(w_, held);
  start.turns.resize(at.size());
  for (std::size_t p = 0; p < bent_.size(); ++p) {
    const VectorXd forces = bent_[p].turning(part_of(at, parts_->rows[p]));
    set_part(start.turns, parts_->rows[p], times(map_of(parts_->compliance[p]), forces));
  }
  return start;
}

VectorXd BentParts::without(const BentStart& start, const VectorXd& pushed) const {
  if (parts_ == nullptr) {
    MatrixXd all = start.free;
    bent_[0].apply(all);
    return all;
  }
  VectorXd all = start.free;
  const VectorXd moved = times(w_, pushed); // by all pushes
  MatrixXd some;
  for (std::size_t p = 0; p < bent_.size(); ++p) {
    const std::vector<Index>& rows = parts_->rows[p];
    VectorXd far = times(map_of(parts_->compliance[p]), part_of(pushed, rows));
    some.resize(far.size(), 1);
    for (Index k = 0; k < far.size(); ++k) {
      const Index row = rows[static_cast<std::size_t>(k)];
      far[k] = moved[row] - far[k];
      some(k, 0) = all[row] + far[k] - start.turns[row];
    }
    bent_[p].apply(some);
    for (Index k = 0; k < far.size(); ++k)
      all[rows[static_cast<std::size_t>(k)]] = some(k, 0) - far[k];
  }
  return all;
}

void BentParts::apply(MatrixXd& columns, std::span<const std::uint32_t> node, Index width) const {
  if (parts_ == nullptr)
    return bent_[0].apply(columns);
  std::vector<Index> own; // columns
  MatrixXd some;
  for (std::size_t p = 0; p < bent_.size(); ++p) {
    own.clear();
    for (std::size_t k = 0; k < node.size(); ++k)
      for (Index a = 0; a < width && parts_->of_node[node[k]] == p; ++a)
        own.push_back(width * static_cast<Index>(k) + a);
    if (own.empty())
      continue;
    const std::vector<Index>& rows = parts_->rows[p];
    some.resize(std::ssize(rows), std::ssize(own));
    for (Index c = 0; c < some.cols(); ++c) {
      const double* const from = columns.col(own[static_cast<std::size_t>(c)]).data();
      double* const to = some.col(c).data();
      for (std::size_t r = 0; r < rows.size(); ++r)
        to[r] = from[rows[r]];
    }
    bent_[p].apply(some);
    for (Index c = 0; c < some.cols(); ++c) {
      const double* const from = some.col(c).data();
      double* const to = columns.col(own[static_cast<std::size_t>(c)]).data();
      for (std::size_t r = 0; r < rows.size(); ++r)
        to[rows[r]] = from[r];
    }
  }
}

VectorXd BentParts::turning(const VectorXd& x) const {
  if (parts_ == nullptr)
    return bent_[0].turning(x);
  VectorXd all(x.size());
  for (std::size_t p = 0; p < bent_.size(); ++p)
    set_part(all, parts_->rows[p], bent_[p].turning(part_of(x, parts_->rows[p])));
  return all;
}

} // namespace gewebe
