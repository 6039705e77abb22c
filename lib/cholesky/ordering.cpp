#include "cholesky/ordering.h"

#include "base/error.h"

#include <algorithm>
#include <cholmod.h>
#include <mutex>
#include <new>
#include <string>

// Based on: Karypis, Kumar, A Fast and High Quality Multilevel Scheme for Partitioning Irregular
// Graphs, 1998 (METIS); Amestoy, Davis, Duff, An Approximate Minimum Degree Ordering Algorithm,
// 1996 (AMD); Chen, Davis, Hager, Rajamanickam, Algorithm 887: CHOLMOD, 2008, which calls both.

namespace gewebe::cholesky {

static_assert(sizeof(SuiteSparse_long) == sizeof(std::int64_t));

namespace {

/// CHOLMOD's parameters and workspace.
class Common {
public:
  Common() {
    (void)cholmod_l_start(&common_);
    common_.print = 0;                       // it warns on standard output
    common_.supernodal = CHOLMOD_SIMPLICIAL; // only the order is needed
    common_.nmethods = 2;                    // the one that fills less
    common_.method[0].ordering = CHOLMOD_AMD;
    common_.method[1].ordering = CHOLMOD_METIS;
  }
  ~Common() { (void)cholmod_l_finish(&common_); }
  Common(const Common&) = delete;
  Common& operator=(const Common&) = delete;

  cholmod_common* get() noexcept { return &common_; }

  void check() const {
    if (common_.status == CHOLMOD_OUT_OF_MEMORY)
      throw std::bad_alloc();
    if (common_.status == CHOLMOD_TOO_LARGE)
      throw Error("the order of elimination: the matrix is too large");
    if (common_.status < 0)
      throw Error("the order of elimination failed, status " + std::to_string(common_.status));
  }

private:
  cholmod_common common_{};
};

/// METIS has one sequence of random numbers for all threads.
std::unique_lock<std::mutex> metis_turn() {
  static std::mutex mutex;
  return std::unique_lock(mutex);
}

} // namespace

std::vector<std::uint32_t> elimination_order(const BlockGraph& graph) {
  // The nodes with rows, the lower triangle.
  std::vector<std::int64_t> start{0}, row, number(graph.nodes(), -1);
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < graph.nodes(); ++i)
    if (graph.axes[i] > 0) {
      number[i] = static_cast<std::int64_t>(nodes.size());
      nodes.push_back(i);
    }
  if (nodes.empty())
    return nodes;
  for (const std::uint32_t i : nodes) {
    const std::size_t first = row.size();
    row.push_back(number[i]);
    for (const std::uint32_t j : graph.of(i))
      if (number[j] > number[i])
        row.push_back(number[j]);
    const auto begin = row.begin() + static_cast<std::ptrdiff_t>(first);
    std::sort(begin, row.end());
    row.erase(std::unique(begin, row.end()), row.end());
    start.push_back(static_cast<std::int64_t>(row.size()));
  }
  cholmod_sparse a{};
  a.nrow = a.ncol = nodes.size();
  a.nzmax = row.size();
  a.p = start.data();
  a.i = row.data();
  a.stype = -1;
  a.itype = CHOLMOD_LONG;
  a.xtype = CHOLMOD_PATTERN;
  a.dtype = CHOLMOD_DOUBLE;
  a.sorted = a.packed = true;
  Common common;
  const auto turn = metis_turn();
  cholmod_factor* factor = cholmod_l_analyze(&a, common.get());
  common.check();
  std::vector<std::uint32_t> order(nodes.size());
  for (std::size_t k = 0; k < order.size(); ++k)
    order[k] = nodes[static_cast<std::size_t>(static_cast<const std::int64_t*>(factor->Perm)[k])];
  (void)cholmod_l_free_factor(&factor, common.get());
  return order;
}

} // namespace gewebe::cholesky
