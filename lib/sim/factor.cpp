#include "sim/factor.h"

#include "base/error.h"
#include "sim/frontal_factor.h"
#include "sim/supernodal_solve_internal.h"

#include <cholmod.h>

#include <algorithm>
#include <cmath>
#include <dlfcn.h>
#include <mutex>
#include <string>

// Based on: Chen, Davis, Hager, Rajamanickam, Algorithm 887: CHOLMOD, Supernodal Sparse Cholesky
// Factorization and Update/Downdate, 2008.

namespace gewebe {

static_assert(sizeof(SuiteSparse_long) == sizeof(std::int64_t));

namespace {

/// CHOLMOD's parameters and workspace; each call that may run beside others has its own.
class Common {
public:
  Common() {
    (void)cholmod_l_start(&common_);
    common_.print = 0; // it warns on standard output
    common_.supernodal = CHOLMOD_SUPERNODAL;
    common_.final_asis = true; // supernodal stays supernodal
    common_.quick_return_if_not_posdef = true;
    common_.nmethods = 2; // the one that fills less
    common_.method[0].ordering = CHOLMOD_AMD;
    common_.method[1].ordering = CHOLMOD_METIS;
  }
  ~Common() { (void)cholmod_l_finish(&common_); }
  Common(const Common&) = delete;
  Common& operator=(const Common&) = delete;

  cholmod_common* get() noexcept { return &common_; }
  cholmod_common* operator->() noexcept { return &common_; }

  /// \throw what an error of CHOLMOD stands for; a pivot that isn't positive is none
  void check(const char* what) const {
    if (common_.status == CHOLMOD_OUT_OF_MEMORY)
      throw std::bad_alloc();
    if (common_.status == CHOLMOD_TOO_LARGE)
      throw Error(std::string(what) + ": the matrix is too large");
    if (common_.status < 0)
      throw Error(std::string(what) + " failed, status " + std::to_string(common_.status));
  }

private:
  cholmod_common common_{};
};

/// CHOLMOD's inner loops are those of whichever BLAS is installed, known only at run time. A
/// threaded one would fight with the threads that are here, and change bytes: it gets one thread.
/// OpenBLAS compiled without threads has no locks either and gives wrong numbers when two threads
/// call it (Debian's libopenblas0-serial does): factorisations take turns.
std::unique_lock<std::mutex> blas_turn() {
  static std::mutex mutex; // one for all, as the library behind it
  std::unique_lock turn(mutex);
  using Set = void (*)(int);
  if (void* const set = dlsym(RTLD_DEFAULT, "openblas_set_num_threads"); set != nullptr)
    reinterpret_cast<Set>(set)(1);
  return turn;
}

/// The matrix as CHOLMOD wants it, without a copy; it changes nothing in it.
cholmod_sparse sparse_view(const StiffnessMatrix& matrix) {
  cholmod_sparse a{};
  a.nrow = a.ncol = matrix.order();
  a.nzmax = matrix.row.size();
  a.p = const_cast<std::int64_t*>(matrix.column_start.data());
  a.i = const_cast<std::int64_t*>(matrix.row.data());
  a.x = const_cast<double*>(matrix.value.data());
  a.stype = -1; // the lower triangle
  a.itype = CHOLMOD_LONG;
  a.xtype = CHOLMOD_REAL;
  a.dtype = CHOLMOD_DOUBLE;
  a.sorted = a.packed = true;
  return a;
}

void check_cancelled(const Context& context) {
  if (context.cancelled && context.cancelled())
    throw Cancelled();
}

/// Bytes that a numeric factorisation takes beside the matrix: L, and the largest update.
double factor_bytes(const cholmod_factor& l) {
  return 8.0 * (static_cast<double>(l.xsize) + static_cast<double>(l.ssize) +
                static_cast<double>(l.maxcsize) + 8.0 * static_cast<double>(l.n));
}

template <class T>
std::span<const T> span_of(const void* array, std::size_t count) {
  return {static_cast<const T*>(array), count};
}

// ---- arrays from a file

void require(bool good, const char* what) {
  if (!good)
    throw Error(std::string("the factor is damaged: ") + what);
}

/// The rows of supernode k: its own columns first, then rows below them, ascending.
void check_supernode(const FactorData& d, std::size_t k, std::int64_t& longest) {
  const std::int64_t first = d.super[k], columns = d.super[k + 1] - first;
  const std::int64_t begin = d.pi[k], rows = d.pi[k + 1] - begin;
  require(rows >= columns, "a supernode has fewer rows than columns");
  longest = std::max(longest, rows - columns);
  std::int64_t block = 0;
  require(!__builtin_mul_overflow(rows, columns, &block) && d.px[k + 1] - d.px[k] == block,
          "the values of a supernode are not rows times columns");
  for (std::int64_t r = 0; r < rows; ++r) {
    const std::int64_t row = d.s[static_cast<std::size_t>(begin + r)];
    if (r < columns)
      require(row == first + r, "a supernode's first rows are not its columns");
    else
      require(row > d.s[static_cast<std::size_t>(begin + r - 1)] && row < d.order,
              "the rows of a supernode don't ascend");
  }
  const double* const x = d.x.data() + d.px[k];
  for (std::int64_t c = 0; c < columns; ++c)
    require(x[c * rows + c] > 0, "a pivot is not positive");
}

void check_bounds(const std::vector<std::int64_t>& starts, std::size_t entries, bool strictly,
                  const char* what) {
  require(starts.front() == 0 && starts.back() >= 0 &&
              static_cast<std::uint64_t>(starts.back()) == entries,
          what);
  for (std::size_t k = 1; k < starts.size(); ++k)
    require(strictly ? starts[k] > starts[k - 1] : starts[k] >= starts[k - 1], what);
}

void check_data(const FactorData& d) {
  require(d.order > 0 && d.order <= std::int64_t{1} << 40, "its order is out of range");
  const auto n = static_cast<std::size_t>(d.order);
  require(d.permutation.size() == n && d.column_count.size() == n, "its order contradicts itself");
  std::vector<bool> seen(n);
  for (const std::int64_t row : d.permutation) {
    require(row >= 0 && row < d.order && !seen[static_cast<std::size_t>(row)],
            "its permutation is none");
    seen[static_cast<std::size_t>(row)] = true;
  }
  for (const std::int64_t count : d.column_count)
    require(count >= 1 && count <= d.order, "a column's count is out of range");
  require(d.super.size() >= 2 && d.pi.size() == d.super.size() && d.px.size() == d.super.size(),
          "the number of its supernodes contradicts itself");
  check_bounds(d.super, n, true, "its supernodes don't divide its columns");
  check_bounds(d.pi, d.s.size(), true, "its supernodes don't divide its rows");
  check_bounds(d.px, d.x.size(), true, "its supernodes don't divide its values");
  std::int64_t longest = 1; // as CHOLMOD counts
  for (std::size_t k = 0; k + 1 < d.super.size(); ++k)
    check_supernode(d, k, longest);
  require(d.max_row_size == longest && d.max_column_size >= 0, "its largest sizes are wrong");
  require(std::all_of(d.x.begin(), d.x.end(), [](double value) { return std::isfinite(value); }),
          "a value is not finite");
}

} // namespace

NotPositiveDefinite::NotPositiveDefinite(std::size_t row)
    : Error("the stiffness matrix is not positive definite (row " + std::to_string(row) + ")"),
      row_(row) {}

/// Either CHOLMOD's own factor, or the arrays in `data`.
struct Factor::State {
  Common common;
  cholmod_factor* owned = nullptr;
  FactorData data;
  CpuLevel cpu;

  explicit State(CpuLevel level) : cpu(level) {}
  ~State() { (void)cholmod_l_free_factor(&owned, common.get()); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  /// The numbers of `owned`. \pre it is this thread's turn
  void factorise(cholmod_sparse& a, const Context& context) {
    check_cancelled(context);
    (void)cholmod_l_factorize(&a, owned, common.get());
    common.check("the factorisation of the stiffness matrix");
    check_cancelled(context);
    if (owned->minor < a.nrow)
      throw NotPositiveDefinite(
          static_cast<std::size_t>(static_cast<const std::int64_t*>(owned->Perm)[owned->minor]));
  }
};

Factor::~Factor() = default;
Factor::Factor(Factor&&) noexcept = default;
Factor& Factor::operator=(Factor&&) noexcept = default;

Factor::Factor(const StiffnessMatrix& matrix, const Context& context)
    : state_(std::make_unique<State>(context.cpu)) {
  Common& common = state_->common;
  cholmod_sparse a = sparse_view(matrix);
  check_cancelled(context);
  const auto turn = blas_turn(); // METIS, with its one sequence of random numbers, needs it as well
  state_->owned = cholmod_l_analyze(&a, common.get());
  common.check("the analysis of the stiffness matrix");
  if (state_->owned == nullptr || state_->owned->is_super == 0)
    throw Error("the analysis of the stiffness matrix made no supernodes");
  require_memory(context, factor_bytes(*state_->owned), "the factor of the stiffness matrix");
  state_->factorise(a, context);
}

void Factor::renew(const StiffnessMatrix& matrix, const Context& context) {
  cholmod_sparse a = sparse_view(matrix);
  const auto turn = blas_turn();
  state_->factorise(a, context);
}

Factor::Factor(FactorData data, CpuLevel cpu) : state_(std::make_unique<State>(cpu)) {
  check_data(data);
  state_->data = std::move(data);
}

std::size_t Factor::order() const noexcept {
  return state_->owned != nullptr ? state_->owned->n : static_cast<std::size_t>(state_->data.order);
}

std::size_t Factor::entries() const noexcept {
  return state_->owned != nullptr ? state_->owned->xsize : state_->data.x.size();
}

FactorView Factor::view() const noexcept {
  FactorView v;
  if (state_->owned == nullptr) {
    const FactorData& d = state_->data;
    return {d.order,
            d.max_column_size,
            d.max_row_size,
            d.permutation,
            d.column_count,
            d.super,
            d.pi,
            d.px,
            d.s,
            d.x};
  }
  const cholmod_factor& l = *state_->owned;
  v.order = static_cast<std::int64_t>(l.n);
  v.max_column_size = static_cast<std::int64_t>(l.maxcsize);
  v.max_row_size = static_cast<std::int64_t>(l.maxesize);
  v.permutation = span_of<std::int64_t>(l.Perm, l.n);
  v.column_count = span_of<std::int64_t>(l.ColCount, l.n);
  v.super = span_of<std::int64_t>(l.super, l.nsuper + 1);
  v.pi = span_of<std::int64_t>(l.pi, l.nsuper + 1);
  v.px = span_of<std::int64_t>(l.px, l.nsuper + 1);
  v.s = span_of<std::int64_t>(l.s, l.ssize);
  v.x = span_of<double>(l.x, l.xsize);
  return v;
}

FactorData Factor::data() const {
  const FactorView v = view();
  const auto copy = [](auto span) { return std::vector(span.begin(), span.end()); };
  return {
      v.order,       v.max_column_size, v.max_row_size, copy(v.permutation), copy(v.column_count),
      copy(v.super), copy(v.pi),        copy(v.px),     copy(v.s),           copy(v.x)};
}

void Factor::solve_panel(std::vector<double>& x, std::size_t width) const {
  const FactorView v = view();
  const SupernodalArrays l{v.super.size() - 1, v.super.data(), v.pi.data(),
                           v.px.data(),        v.s.data(),     v.x.data()};
  std::vector<double> work(static_cast<std::size_t>(v.max_row_size) * panel_width);
  (state_->cpu == CpuLevel::baseline ? solve_supernodal_baseline
                                     : solve_supernodal_avx2)(l, x.data(), width, work.data());
}

void Factor::solve(std::span<const double> f, std::span<double> u, std::size_t columns) const {
  const std::span<const std::int64_t> permutation = view().permutation;
  const std::size_t n = order();
  std::vector<double> x;
  for (std::size_t first = 0; first < columns;) {
    const std::size_t count = std::min(most_units, columns - first), width = solve_width(count);
    x.assign(n * width, 0.0);
    for (std::size_t k = 0; k < n; ++k) {
      const double* const from = f.data() + first * n + static_cast<std::size_t>(permutation[k]);
      for (std::size_t j = 0; j < count; ++j)
        x[k * width + j] = from[j * n] + 0.0; // leaves no -0, whose sign zeros skipped would lose
    }
    solve_panel(x, width);
    for (std::size_t k = 0; k < n; ++k) {
      double* const to = u.data() + first * n + static_cast<std::size_t>(permutation[k]);
      for (std::size_t j = 0; j < count; ++j)
        to[j * n] = x[k * width + j];
    }
    first += count;
  }
}

std::size_t Factor::solve_units(std::span<const std::int64_t> places,
                                std::vector<double>& x) const {
  const std::size_t width = solve_width(std::max<std::size_t>(places.size(), 1));
  x.assign(order() * width, 0.0);
  for (std::size_t c = 0; c < places.size(); ++c)
    x[static_cast<std::size_t>(places[c]) * width + c] = 1;
  solve_panel(x, width);
  return width;
}

std::vector<std::uint32_t> elimination_order(const SpringGraph& graph) {
  // The graph of the nodes that can move, its lower triangle.
  std::vector<std::int64_t> start{0}, row, number(graph.axes.size(), -1);
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < graph.axes.size(); ++i)
    if (graph.axes[i] > 0) {
      number[i] = static_cast<std::int64_t>(nodes.size());
      nodes.push_back(i);
    }
  if (nodes.empty())
    return nodes;
  for (const std::uint32_t i : nodes) {
    const std::size_t first = row.size();
    row.push_back(number[i]);
    for (const auto& arm : graph.of(i))
      if (number[arm.node] > number[i])
        row.push_back(number[arm.node]);
    std::sort(row.begin() + static_cast<std::ptrdiff_t>(first), row.end());
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
  const auto turn = blas_turn(); // for METIS
  cholmod_factor* factor = cholmod_l_analyze(&a, common.get());
  common.check("the order of elimination");
  std::vector<std::uint32_t> order(nodes.size());
  for (std::size_t k = 0; k < order.size(); ++k)
    order[k] = nodes[static_cast<std::size_t>(static_cast<const std::int64_t*>(factor->Perm)[k])];
  (void)cholmod_l_free_factor(&factor, common.get());
  return order;
}

void solve_axes(const StiffnessMatrix& matrix, const Factor& factor, std::span<const double> f,
                std::span<double> u) {
  std::vector<double> rows(matrix.order()), solved(matrix.order());
  for (std::size_t r = 0; r < rows.size(); ++r)
    rows[r] = f[static_cast<std::size_t>(matrix.axis_of_row[r])];
  factor.solve(rows, solved);
  std::fill(u.begin(), u.end(), 0.0);
  for (std::size_t r = 0; r < rows.size(); ++r)
    u[static_cast<std::size_t>(matrix.axis_of_row[r])] = solved[r];
}

} // namespace gewebe
