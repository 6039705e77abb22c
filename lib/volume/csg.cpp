#include "volume/csg.h"
// Based on: A. Ricci, A Constructive Geometry for Computer Graphics, 1973 (max, min and
// complement); G. Wyvill, C. McPheeters, B. Wyvill, Data structure for soft objects, 1986 (sums of
// densities).

#include "base/error.h"
#include "volume/grid_fold.h"
#include "volume/resample.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <optional>

namespace gewebe::volume {
namespace {

std::string number(double value) {
  std::array<char, 32> text{};
  (void)std::snprintf(text.data(), text.size(), "%.9g", value);
  return text.data();
}

// ---- what an operation does to values

// Written so that NaN becomes 0.
float at_least_0(float a) {
  return a > 0 ? a : 0.0f;
}
float clamp_01(float a) {
  return a > 0 ? (a < 1 ? a : 1.0f) : 0.0f;
}

bool is_sum(CsgOperation operation) {
  return operation == CsgOperation::add || operation == CsgOperation::subtract;
}

/// The first operand's value as the result so far.
float start_value(CsgOperation operation, float a) {
  return is_sum(operation) ? a : clamp_01(a);
}

/// Calls apply(f) with f(result so far, next operand's value).
template <class Apply>
void with_function(CsgOperation operation, Apply&& apply) {
  switch (operation) {
  case CsgOperation::add:
    return apply([](float x, float y) { return x + y; });
  case CsgOperation::subtract:
    return apply([](float x, float y) { return x - y; });
  case CsgOperation::unite:
    return apply([](float x, float y) { return std::max(x, clamp_01(y)); });
  case CsgOperation::intersect:
    return apply([](float x, float y) { return std::min(x, clamp_01(y)); });
  case CsgOperation::difference:
    return apply([](float x, float y) { return std::min(x, 1 - clamp_01(y)); });
  case CsgOperation::exclusive_or:
    return apply([](float x, float y) {
      const float b = clamp_01(y);
      return std::max(std::min(x, 1 - b), std::min(1 - x, b));
    });
  }
}

float next_value(CsgOperation operation, float a, float b) {
  with_function(operation, [&](auto&& function) { a = function(a, b); });
  return a;
}

bool fits(float a) {
  return a <= std::numeric_limits<float>::max();
}
[[noreturn]] void fail_range() {
  throw Error("the sum of the densities leaves the range of single precision");
}

float end_value(CsgOperation operation, float a) {
  if (is_sum(operation))
    a = at_least_0(a);
  if (!fits(a))
    fail_range();
  return a;
}

/// Folds a leaf.
void fold(CsgOperation operation, std::span<const BlockSource> sources, LeafValues& a) {
  const BlockSource& first = sources[0];
  for (std::size_t n = 0; n < a.size(); ++n)
    a[n] = start_value(operation, first.detail ? first.leaf.values[n] : first.constant);
  for (const BlockSource& source : sources.subspan(1))
    with_function(operation, [&](auto&& function) {
      if (source.detail)
        for (std::size_t n = 0; n < a.size(); ++n)
          a[n] = function(a[n], source.leaf.values[n]);
      else
        for (float& value : a)
          value = function(value, source.constant);
    });
  if (is_sum(operation))
    for (float& value : a)
      value = at_least_0(value);
  unsigned beyond = 0;
  for (const float value : a)
    beyond |= fits(value) ? 0U : 1U;
  if (beyond != 0)
    fail_range();
}

/// Whether a leaf has these values, active exactly where they aren't 0.
bool is_leaf(const LeafView& leaf, const LeafValues& values) {
  if (std::memcmp(leaf.values, values.data(), sizeof values) != 0)
    return false;
  std::array<std::uint64_t, 8> active{};
  for (std::size_t n = 0; n < values.size(); ++n)
    active[n / 64] |= static_cast<std::uint64_t>(values[n] != 0) << (n % 64);
  return std::memcmp(leaf.active, active.data(), sizeof active) == 0;
}

// ---- what may be combined

void check_operand(const CsgOperand& operand) {
  const GridInfo& info = operand.grid.info();
  if (info.level_set)
    throw Error(operand.name, "is a level set, expected a density volume");
  if (info.background != 0)
    throw Error(operand.name, "has the background " + number(info.background) + ", expected 0");
  if (!info.transform.is_cubic())
    throw Error(operand.name, "has " + info.transform.describe() + ", expected cubic voxels");
}

/// The band that the result has.
std::optional<double> common_band(CsgOperation operation, std::span<const CsgOperand> operands) {
  const CsgOperand* first = nullptr;
  for (const CsgOperand& operand : operands) {
    const std::optional<double>& band = operand.grid.info().band_isovalue;
    if (!band)
      continue;
    const std::string what = "is exact only near the isovalue " + number(*band);
    switch (operation) {
    case CsgOperation::add:
    case CsgOperation::subtract:
      throw Error(operand.name, what + ", expected a volume without band to add or subtract");
    case CsgOperation::difference:
    case CsgOperation::exclusive_or: // the complement is exact near 1 - v
      if (*band != 0.5)
        throw Error(operand.name, what + ", expected 0.5 or no band");
      break;
    case CsgOperation::unite:
    case CsgOperation::intersect:
      break;
    }
    if (first == nullptr)
      first = &operand;
    else if (*band != *first->grid.info().band_isovalue)
      throw Error("bands differ: " + first->name + " is exact near " +
                  number(*first->grid.info().band_isovalue) + ", " + operand.name + " near " +
                  number(*band) + ", expected one isovalue");
  }
  return first == nullptr ? std::nullopt : first->grid.info().band_isovalue;
}

/// Compares where there is something: in the box of the active voxels of both grids.
bool equal_lattices(const Grid& a, const Grid& b) {
  Int3 min{}, max{}, b_min{}, b_max{};
  const bool some = a.active_box(min, max);
  if (b.active_box(b_min, b_max))
    for (std::size_t n = 0; n < 3; ++n) {
      min[n] = some ? std::min(min[n], b_min[n]) : b_min[n];
      max[n] = some ? std::max(max[n], b_max[n]) : b_max[n];
    }
  return same_lattice(a.info().transform, b.info().transform, min, max);
}

/// Grids of all operands on the first one's lattice.
std::vector<Grid> on_one_lattice(const Context& context, std::vector<CsgOperand> operands,
                                 const CsgOptions& options, CsgReport& report) {
  const std::string first_name = operands[0].name;
  const GridInfo a = operands[0].grid.info();
  std::vector<Grid> grids;
  for (CsgOperand& operand : operands) {
    const GridInfo& b = operand.grid.info();
    if (a.isovalue != b.isovalue)
      throw Error("isovalues differ: " + first_name + " has " + number(a.isovalue) + ", " +
                  operand.name + " has " + number(b.isovalue) + ", expected equal ones");
    if (a.transform == b.transform || equal_lattices(grids[0], operand.grid)) {
      grids.push_back(std::move(operand.grid));
    } else if (options.resample) {
      grids.push_back(
          at(operand.name, [&] { return resample(context, operand.grid, a.transform); }));
      ++report.resampled;
    } else {
      throw Error("lattices differ: " + first_name + " has " + a.transform.describe() + ", " +
                  operand.name + " has " + b.transform.describe() +
                  ", expected equal ones or --resample");
    }
  }
  return grids;
}

// ---- combining

/// What is known of an operand's values beforehand.
struct Known {
  bool kept = false;         ///< alone it would be the result, leaf by leaf and tile by tile
  bool not_negative = false; ///< no value is below 0
};

Known known_of(const ValueSummary& values, CsgOperation operation) {
  const bool not_negative = values.min >= 0;
  return {not_negative && !std::signbit(values.min) && (is_sum(operation) || values.max <= 1) &&
              values.active_where_not_0 && values.varied_leaves,
          not_negative};
}

/// Decides a block from the operands that are constant in it, by the neutral and the absorbing
/// elements of the operations.
class Rule {
public:
  Rule(CsgOperation operation, std::vector<Known> known)
      : operation_(operation), known_(std::move(known)) {}

  BlockDecision operator()(std::span<const BlockSource> sources) const {
    if (operation_ == CsgOperation::subtract && nothing_left(sources))
      return {Decided::constant, 0, 0};
    State state = first(sources[0]);
    for (std::size_t g = 1; g < sources.size(); ++g)
      state = sources[g].detail ? with_detail(state, g) : with_constant(state, sources[g].constant);
    if (state.kind == State::Kind::constant)
      return {Decided::constant, end_value(operation_, state.value), 0};
    if (state.kind == State::Kind::operand && known_[state.operand].kept)
      return {Decided::take, 0, state.operand};
    return {};
  }

private:
  /// The result so far.
  struct State {
    enum class Kind { constant, operand, unknown } kind = Kind::unknown;
    float value = 0;         ///< constant
    std::size_t operand = 0; ///< operand: equal to that one, limited as the operation does
  };
  using Kind = State::Kind;
  using Decided = BlockDecision::Kind;

  State first(const BlockSource& source) const {
    if (source.detail)
      return {Kind::operand, 0, 0};
    return {Kind::constant, start_value(operation_, source.constant), 0};
  }
  State with_constant(const State& state, float b) const {
    if (state.kind == Kind::constant)
      return {Kind::constant, next_value(operation_, state.value, b), 0};
    if (!is_sum(operation_))
      b = clamp_01(b);
    switch (operation_) {
    case CsgOperation::unite:
      if (b == 1)
        return {Kind::constant, 1, 0};
      break;
    case CsgOperation::intersect:
      if (b == 0)
        return {Kind::constant, 0, 0};
      return b == 1 ? state : State{};
    case CsgOperation::difference:
      if (b == 1)
        return {Kind::constant, 0, 0};
      break;
    case CsgOperation::add:
    case CsgOperation::subtract:
    case CsgOperation::exclusive_or:
      break;
    }
    return b == 0 ? state : State{};
  }
  State with_detail(const State& state, std::size_t operand) const {
    if (state.kind != Kind::constant)
      return {};
    const State its{Kind::operand, 0, operand};
    const float a = state.value;
    switch (operation_) {
    case CsgOperation::add:
    case CsgOperation::exclusive_or:
      return a == 0 ? its : State{};
    case CsgOperation::unite:
      return a == 1 ? state : a == 0 ? its : State{};
    case CsgOperation::intersect:
      return a == 0 ? state : a == 1 ? its : State{};
    case CsgOperation::difference:
      return a == 0 ? state : State{};
    case CsgOperation::subtract:
      break;
    }
    return {};
  }
  /// Of nothing no more is left, whatever is taken away.
  bool nothing_left(std::span<const BlockSource> sources) const {
    if (sources[0].detail || sources[0].constant > 0)
      return false;
    for (std::size_t g = 1; g < sources.size(); ++g)
      if (sources[g].detail ? !known_[g].not_negative : sources[g].constant < 0)
        return false;
    return true;
  }

  CsgOperation operation_;
  std::vector<Known> known_;
};

BlockDecision combine_leaf(CsgOperation operation, std::span<const BlockSource> sources,
                           LeafValues& values) {
  fold(operation, sources, values);
  if (std::all_of(values.begin(), values.end(), [&](float v) { return v == values[0]; }))
    return {BlockDecision::Kind::constant, values[0], 0};
  for (std::size_t g = 0; g < sources.size(); ++g)
    if (sources[g].detail && is_leaf(sources[g].leaf, values))
      return {BlockDecision::Kind::take, 0, g};
  return {};
}

} // namespace

const std::vector<std::string>& csg_operation_names() {
  static const std::vector<std::string> names{"add",       "subtract",   "union",
                                              "intersect", "difference", "xor"};
  return names;
}

CsgOperation csg_operation_from_name(std::string_view name) {
  const std::vector<std::string>& names = csg_operation_names();
  const auto it = std::find(names.begin(), names.end(), name);
  if (it == names.end()) {
    std::string expected;
    for (const std::string& n : names)
      expected += (expected.empty() ? "" : ", ") + n;
    throw UsageError("unknown operation '" + std::string(name) + "', expected one of " + expected);
  }
  return static_cast<CsgOperation>(it - names.begin());
}

Grid csg(const Context& context, CsgOperation operation, std::vector<CsgOperand> operands,
         const CsgOptions& options, CsgReport* report) {
  if (operands.size() < 2)
    throw Error("csg: " + std::to_string(operands.size()) + " volumes, expected at least 2");
  CsgReport local;
  CsgReport& r = report != nullptr ? *report : local;
  r = {};
  for (const CsgOperand& operand : operands)
    check_operand(operand);
  GridInfo info = operands[0].grid.info();
  info.band_isovalue = common_band(operation, operands);
  std::vector<Grid> grids = on_one_lattice(context, std::move(operands), options, r);
  std::vector<Known> known;
  for (const Grid& grid : grids)
    known.push_back(known_of(grid.summary(context), operation));
  FoldReport counts;
  Grid result = fold_grids(
      context, info, std::move(grids), Rule(operation, std::move(known)),
      [&](std::span<const BlockSource> sources, LeafValues& values) {
        return combine_leaf(operation, sources, values);
      },
      counts);
  r.leaves_computed = counts.leaves_computed;
  r.leaves_shared = counts.leaves_taken;
  r.leaves_constant = counts.leaves_constant;
  r.leaves_skipped = counts.leaves_skipped;
  r.tiles_combined = counts.tiles_combined;
  return result;
}

} // namespace gewebe::volume
