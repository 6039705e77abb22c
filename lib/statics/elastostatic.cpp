#include "statics/elastostatic.h"

#include "base/copy_on_write.h"
#include "base/error.h"
#include "base/unique_number.h"
#include "columns/compressed_columns.h"
#include "compliance/compliance.h"
#include "compliance/forces_at.h"
#include "compliance/load_answer.h"
#include "fem/model_stiffness.h"
#include "geometry/vector_at.h"
#include "linalg/stiffness.h"
#include "statics/held_contacts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

namespace gewebe::statics {

struct Elastostatic::Past {
  /// The last load, its reactions, and its shape once it was read.
  struct Last {
    bool by_block = false; // how the load is met
    std::uint64_t id = 0;  // of the compliance with these nodes held
    CopyOnWrite<std::vector<std::uint32_t>> id_of{};
    CopyOnWrite<contact::Load> load{};
    CopyOnWrite<std::vector<contact::NodeVector>> forces{};
    CopyOnWrite<std::vector<double>> u{};     // of the rows that sums have
    CopyOnWrite<std::vector<double>> whole{}; // over all axes, where these are more
    CopyOnWrite<std::vector<double>> rough{}; // as u, within the tolerance
    bool shape_known = true, whole_known = false, rough_known = false;
    bool measured = true; // a shape under this load
  };

  compliance::Compliance::Past compliance;
  compliance::LoadAnswer::Past answer;
  compliance::ForcesAt::Past block;
  HeldContacts::Past held;
  Last last;
};

struct Elastostatic::State {
  const model::Model& model;
  Context context;
  ElastostaticOptions options;
  compliance::Compliance compliance;
  ElastostaticCounts counts;
  std::optional<double> norm; // of K, for backward errors
  std::optional<fem::StiffnessOperator> stiffness;
  compliance::LoadAnswer answer; // beside displacements
  compliance::ForcesAt block;
  HeldContacts held;
  Past::Last last;

  State(const model::Model& m, std::shared_ptr<compliance::ComplianceSource> s, const Context& c,
        const ElastostaticOptions& o)
      : model(m), context(without_progress(c)), options(o),
        compliance(m, std::move(s), c, o.tolerance > 0, o.may_be_free), answer(m, compliance),
        block(m, compliance, answer), held(m, context, compliance.is_free()) {
    last.u.write().resize(compliance.rows());
    if (compliance.is_free())
      stand_still({});
  }

  static Context without_progress(Context c) {
    c.progress = nullptr;
    return c;
  }

  // ---- the shape

  /// Less than the largest size of an entry of the shape.
  double min_size() {
    double size = 0;
    for (const auto& entry : last.load->displacement)
      for (int a = 0; a < 3; ++a)
        size = std::max(size, std::abs(entry.second[a]));
    if (size > 0 || last.load->force.empty())
      return size;
    if (!compliance.columns_pay(compliance::nodes_of(last.load->force)))
      return 0;
    std::vector<std::size_t> where;
    for (const auto& entry : last.load->force)
      for (int a = 0; a < 3; ++a)
        where.push_back(axis_of(entry.first, a));
    const double max = largest_size(answer.at(*last.load, where));
    return std::isfinite(max) ? max : 0;
  }

  /// \return whether nothing was left out
  bool make_shape(double tolerance, std::vector<double>& shape) {
    if (last.load->displacement.empty()) {
      // Where sums may leave something out, they are made for this load alone.
      if (tolerance > 0 && !answer.known(*last.load) &&
          compliance.columns_pay(compliance::nodes_of(last.load->force))) {
        add_outer(tolerance, shape);
        answer.note(*last.load);
        return false;
      }
      shape = answer.whole(*last.load);
      return true;
    }
    bool exact = true;
    if (!block.shape(*last.load, shape)) {
      const std::vector<std::uint32_t> nodes = compliance::nodes_of(last.load->displacement);
      const bool columns = !last.by_block || compliance.columns_for_shape(nodes, block.shapes());
      if (columns && (answer.known(*last.load) || compliance.columns_pay(nodes))) {
        shape = answer.whole(*last.load);
        compliance.add(*last.forces, tolerance * min_size(), shape);
        exact = tolerance == 0;
      } else {
        solve_all(shape);
      }
    }
    place_displaced(shape);
    return exact;
  }

  /// Under weight and given forces.
  void add_outer(double tolerance, std::vector<double>& shape) {
    const double allowed = tolerance > 0 ? tolerance * min_size() : 0;
    shape = answer.weight(last.load->gravity);
    shape.resize(compliance.rows(), 0);
    compliance.add(compliance::as_vectors(last.load->force), allowed, shape);
  }

  void solve_all(std::vector<double>& shape) {
    shape = all_forces();
    compliance.solve(shape);
    shape.resize(compliance.rows());
  }

  /// Displaced nodes stand where they must.
  void place_displaced(std::vector<double>& shape) const {
    for (const auto& [node, d] : last.load->displacement)
      for (int a = 0; a < 3; ++a)
        if (const std::size_t axis = axis_of(node, a); axis < shape.size())
          shape[axis] = d[a];
  }

  /// The load with what holds its displaced nodes.
  std::vector<double> all_forces() const {
    std::vector<double> f = compliance::forces_over_axes(model, *last.load);
    for (const contact::NodeVector& contact : *last.forces)
      for (int a = 0; a < 3; ++a)
        f[axis_of(contact.node, a)] += contact.value[a];
    return f;
  }

  static void require_finite(const std::vector<double>& shape) {
    std::array<double, 8> sum{}; // side by side: one behind the other waits for each addition
    std::size_t k = 0;
    for (; k + sum.size() <= shape.size(); k += sum.size())
      for (std::size_t l = 0; l < sum.size(); ++l)
        sum[l] += std::abs(shape[k + l]);
    for (; k < shape.size(); ++k)
      sum[0] += std::abs(shape[k]);
    if (!std::ranges::all_of(sum, [](double s) { return std::isfinite(s); }))
      throw Error("the shape is not finite, expected a smaller load");
  }

  bool all_rows() const { return compliance.rows() == compliance.axes(); }

  const std::vector<double>& need_whole() {
    if (all_rows()) {
      need_shape();
      return *last.u;
    }
    if (!last.whole_known) {
      std::vector<double>& whole = last.whole.replace();
      whole = all_forces();
      compliance.solve(whole);
      place_displaced(whole);
      require_finite(whole);
      last.whole_known = true;
    }
    return *last.whole;
  }

  void need_shape() {
    if (!last.shape_known)
      (void)make_new(0, last.u.replace());
    last.shape_known = true;
  }

  const std::vector<double>& need_rough() {
    if (options.tolerance > 0 && !last.shape_known && !last.rough_known) {
      last.rough_known = true;
      if (make_new(options.tolerance, last.rough.replace())) {
        std::swap(last.u, last.rough);
        last.shape_known = true;
      }
    }
    if (last.rough_known && !last.shape_known)
      return *last.rough;
    need_shape();
    return *last.u;
  }

  bool make_new(double tolerance, std::vector<double>& shape) {
    const bool exact = make_shape(tolerance, shape);
    ++counts.shapes;
    require_finite(shape);
    if (options.measure_error)
      measure(shape);
    return exact;
  }

  /// How far a shape is from another one at its rows, over the largest entry of that.
  static double distance(const std::vector<double>& shape, const std::vector<double>& other) {
    double worst = 0;
    for (std::size_t r = 0; r < shape.size(); ++r)
      worst = std::max(worst, std::abs(other[r] - shape[r]));
    const double size = largest_size(other);
    return size > 0 ? worst / size : 0;
  }

  /// The shape in another place: nothing that other answers come from changes.
  std::vector<double> make_aside(double tolerance) {
    std::vector<double> shape;
    if (compliance.at_hand(compliance::nodes_of(last.load->force)) &&
        compliance.at_hand(compliance::nodes_of(last.load->displacement))) {
      add_outer(last.load->displacement.empty() ? tolerance : 0, shape);
      if (!last.load->displacement.empty())
        compliance.add(*last.forces, tolerance > 0 ? tolerance * min_size() : 0, shape);
    } else {
      solve_all(shape);
    }
    place_displaced(shape);
    require_finite(shape);
    return shape;
  }

  /// A shape that can't be made is one that is wrong.
  void verify() {
    if (last.measured || !options.measure_error)
      return;
    try {
      measure(last.shape_known   ? *last.u
              : last.rough_known ? *last.rough
                                 : make_aside(options.tolerance));
    } catch (const Cancelled&) {
      throw;
    } catch (const Error&) {
      last.measured = true;
      counts.worst_shape.error = counts.backward_error = std::numeric_limits<double>::quiet_NaN();
    }
  }

  void measure(const std::vector<double>& shape) {
    last.measured = true;
    if (options.tolerance > 0 && !compliance.is_free())
      counts.shape_error = std::max(counts.shape_error, distance(shape, make_aside(0)));
    ShapeError error;
    if (!all_rows())
      error.error = distance(shape, need_whole());
    const std::vector<double>& over_axes = all_rows() ? shape : *last.whole;
    if (!norm) {
      norm = linalg::stiffness_norm(fem::stiffness_matrix(model));
      stiffness.emplace(model);
    }
    std::vector<double> product(over_axes.size(), 0);
    const std::vector<double> f = all_forces();
    stiffness->multiply(over_axes, product);
    double residual = 0, load_size = 0;
    for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
      for (int a = 0; a < 3; ++a)
        if (!contact::is_fixed(model, i, a)) {
          residual = std::max(residual, std::abs(product[axis_of(i, a)] - f[axis_of(i, a)]));
          load_size = std::max(load_size, std::abs(f[axis_of(i, a)]));
        }
    const double size = largest_size(over_axes), scale = *norm * size + load_size;
    if (scale > 0)
      error.error = std::max(error.error, residual / scale);
    if (size > 0) {
      const columns::EntryBound given = compliance.bound(compliance::as_vectors(last.load->force)),
                                found = compliance.bound(*last.forces);
      error.limit += (given.entry + found.entry) / size;
      error.relative = given.relative;
    }
    counts.backward_error = std::max(counts.backward_error, error.error);
    if (error.worse_than(counts.worst_shape))
      counts.worst_shape = error;
  }

  void update(const contact::Load& now) {
    ++counts.updates;
    if (now == *last.load) {
      ++counts.unchanged;
      return;
    }
    last.shape_known = last.whole_known = last.rough_known = last.measured = false;
    const auto before = std::exchange(last.forces, {});
    try {
      if (!now.displacement.empty())
        meet(now);
      else if (compliance.is_free())
        stand_still(now);
      double sum = 0;
      for (const contact::NodeVector& f : *last.forces)
        sum += std::abs(f.value.x) + std::abs(f.value.y) + std::abs(f.value.z);
      if (!std::isfinite(sum))
        throw Error("the contact forces are not finite, expected a smaller load");
    } catch (...) {
      last.forces = before;
      last.shape_known = last.whole_known = last.rough_known = last.measured = false;
      throw;
    }
    last.load.replace() = now;
    if (last.shape_known) {
      ++counts.shapes;
      if (options.measure_error)
        measure(*last.u);
    }
  }

  /// Free, and nothing acts on it.
  void stand_still(const contact::Load& now) {
    if (!now.empty())
      compliance.require_held();
    last.u.replace().assign(compliance.rows(), 0);
    last.whole.replace().assign(all_rows() ? 0 : compliance.axes(), 0);
    last.shape_known = last.whole_known = true;
  }

  void meet(const contact::Load& now) {
    if (!compliance.is_free() && block.cheaper(now, options.block_limit) && block.meet(now)) {
      last.forces = block.forces();
      last.by_block = true;
      return;
    }
    std::vector<double>& shape = (all_rows() ? last.u : last.whole).replace();
    last.forces = held.meet(now, shape);
    last.by_block = false;
    if (!all_rows()) {
      std::vector<double>& u = last.u.replace();
      u.assign(shape.begin(), shape.begin() + static_cast<std::ptrdiff_t>(compliance.rows()));
      last.whole_known = true;
    }
    last.shape_known = true;
  }

  // ---- contact

  std::uint64_t compliance_id(const contact::Load& now) {
    std::vector<std::uint32_t> nodes = compliance::nodes_of(now.displacement);
    if (last.id == 0 || nodes != *last.id_of) {
      last.id = unique_number();
      last.id_of = std::move(nodes);
    }
    return last.id;
  }

  /// Columns of these nodes and of displaced ones.
  void need_columns(const contact::Load& now, std::span<const std::uint32_t> nodes) {
    std::vector<std::uint32_t> all(nodes.begin(), nodes.end());
    for (const auto& entry : now.displacement)
      all.push_back(entry.first);
    if (!compliance.fit(all))
      throw Error("the columns of " + std::to_string(all.size()) +
                  " nodes in contact do not fit in memory, expected more of it or fewer contacts");
    compliance.need(all);
  }

  void compliance_blocks(const contact::Load& now, std::uint32_t node,
                         std::span<const std::uint32_t> rows,
                         std::span<std::array<double, 9>> blocks) {
    if (!now.displacement.empty())
      update(now);
    else
      compliance.require_held();
    if (now.displacement.empty() || last.by_block)
      need_columns(now, std::span(&node, 1));
    const auto put = [](const compliance::ComplianceBlock& from, std::array<double, 9>& to) {
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j)
          to[3 * i + j] = from[j][i];
    };
    if (!now.displacement.empty() && !last.by_block) {
      const columns::ColumnCache& columns = held.columns(std::span(&node, 1));
      for (std::size_t k = 0; k < rows.size(); ++k)
        for (std::size_t i = 0; i < 3; ++i)
          for (std::size_t j = 0; j < 3; ++j)
            blocks[k][3 * i + j] =
                columns.entry(node, static_cast<int>(j), 3 * std::size_t{rows[k]} + i);
      return;
    }
    for (std::size_t k = 0; k < rows.size(); ++k)
      put(compliance.column_block(node, rows[k]), blocks[k]);
    if (now.displacement.empty())
      return;
    // Held nodes do not move: C - C_ch C_hh^-1 C_hc.
    const std::vector<std::size_t> axes = block.axes();
    std::vector<double> given(axes.size());
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t h = 0; h < axes.size(); ++h)
        given[h] = compliance.entry(node, static_cast<int>(j), axes[h]);
      block.solve(given);
      for (std::size_t h = 0; h < axes.size(); ++h) {
        const auto of = static_cast<std::uint32_t>(axes[h] / 3);
        const auto axis = static_cast<int>(axes[h] % 3);
        for (std::size_t k = 0; k < rows.size(); ++k)
          for (std::size_t i = 0; i < 3; ++i)
            blocks[k][3 * i + j] -=
                given[h] * compliance.entry(of, axis, 3 * std::size_t{rows[k]} + i);
      }
    }
  }

  DelassusOperator delassus_operator(const contact::Load& now,
                                     std::span<const std::uint32_t> nodes) {
    update(now);
    const bool held_by_factor = !now.displacement.empty() && !last.by_block;
    if (!held_by_factor)
      compliance.require_held();
    if (!held_by_factor)
      need_columns(now, nodes); // rows of nodes inside, too
    DelassusOperator delassus{{nodes.begin(), nodes.end()}, {}, {}};
    const std::size_t size = 3 * nodes.size();
    delassus.compliance.resize(size * size);
    std::vector<std::array<double, 9>> blocks(nodes.size());
    std::vector<std::size_t> where;
    for (std::size_t c = 0; c < nodes.size(); ++c) {
      compliance_blocks(now, nodes[c], nodes, blocks);
      for (std::size_t k = 0; k < nodes.size(); ++k)
        for (std::size_t i = 0; i < 3; ++i)
          for (std::size_t j = 0; j < 3; ++j)
            delassus.compliance[(3 * c + j) * size + 3 * k + i] = blocks[k][3 * i + j];
      for (int a = 0; a < 3; ++a)
        where.push_back(axis_of(nodes[c], a));
    }
    if (held_by_factor) {
      const std::vector<double>& shape = need_whole();
      for (const std::size_t axis : where)
        delassus.free.push_back(shape[axis]);
      return delassus;
    }
    delassus.free = answer.at(now, where);
    if (now.displacement.empty())
      return delassus;
    const std::vector<std::size_t> axes = block.axes();
    for (std::size_t c = 0; c < size; ++c)
      for (std::size_t h = 0; h < axes.size(); ++h)
        delassus.free[c] +=
            block.force()[h] * compliance.entry(nodes[c / 3], static_cast<int>(c % 3), axes[h]);
    return delassus;
  }
};

Elastostatic::Elastostatic(const model::Model& model,
                           std::shared_ptr<compliance::ComplianceSource> source,
                           const Context& context, const ElastostaticOptions& options)
    : state_(std::make_unique<State>(model, std::move(source), context, options)) {}
Elastostatic::~Elastostatic() = default;
Elastostatic::Elastostatic(Elastostatic&&) noexcept = default;

std::shared_ptr<const Elastostatic::Past> Elastostatic::past() const {
  const State& s = *state_;
  return std::make_shared<const Past>(
      Past{s.compliance.past(), s.answer.past(), s.block.past(), s.held.past(), s.last});
}

void Elastostatic::restore(const Past& past) {
  State& s = *state_;
  s.compliance.restore(past.compliance);
  s.answer.restore(past.answer);
  s.block.restore(past.block);
  s.held.restore(past.held);
  s.last = past.last;
}

void Elastostatic::update(const contact::Load& load) {
  state_->update(load);
}

std::span<const double> Elastostatic::displacement() {
  return state_->need_whole();
}

std::span<const double> Elastostatic::surface_displacement() {
  state_->need_shape();
  return *state_->last.u;
}

std::span<const double> Elastostatic::rough_surface() {
  return state_->need_rough();
}

void Elastostatic::verify() {
  state_->verify();
}

const std::vector<contact::NodeVector>& Elastostatic::contact_forces() const noexcept {
  return *state_->last.forces;
}

void Elastostatic::compliance_blocks(const contact::Load& load, std::uint32_t node,
                                     std::span<const std::uint32_t> rows,
                                     std::span<std::array<double, 9>> blocks) {
  state_->compliance_blocks(load, node, rows, blocks);
}

std::uint64_t Elastostatic::compliance_id(const contact::Load& load) {
  return state_->compliance_id(load);
}

DelassusOperator Elastostatic::delassus_operator(const contact::Load& load,
                                                 std::span<const std::uint32_t> nodes) {
  return state_->delassus_operator(load, nodes);
}

const columns::NodeClusters* Elastostatic::clusters() const noexcept {
  if (state_->compliance.is_free())
    return nullptr;
  const columns::CompressedColumns* const columns = state_->compliance.compressed_rows();
  return columns != nullptr ? &columns->layout().clusters : nullptr;
}

namespace {

/// What moves something: nodes without columns are fixed.
std::vector<contact::NodeVector> with_columns(const columns::CompressedColumns& columns,
                                              std::span<const contact::NodeVector> forces) {
  std::vector<contact::NodeVector> some;
  std::ranges::copy_if(forces, std::back_inserter(some),
                       [&](const contact::NodeVector& f) { return columns.has(f.node); });
  return some;
}

} // namespace

std::vector<double>
Elastostatic::displacement_of_clusters(std::span<const std::uint32_t> clusters,
                                       std::span<const contact::NodeVector> forces) {
  const columns::CompressedColumns& columns = *state_->compliance.compressed_rows();
  return columns.sum_at(clusters, with_columns(columns, forces), state_->context);
}

std::vector<double> Elastostatic::displacement_bounds(std::span<const contact::NodeVector> forces) {
  const columns::CompressedColumns& columns = *state_->compliance.compressed_rows();
  std::vector<double> bounds = columns.bounds(with_columns(columns, forces), state_->context);
  for (double& bound : bounds)
    bound *= std::numbers::sqrt3;
  return bounds;
}

void Elastostatic::prepare(std::span<const std::uint32_t> nodes) {
  state_->compliance.require_held();
  state_->compliance.prepare(nodes);
}

void Elastostatic::read_compressed() {
  state_->compliance.read_compressed();
}

bool Elastostatic::is_free() const noexcept {
  return state_->compliance.is_free();
}

ElastostaticCounts Elastostatic::counts() const noexcept {
  ElastostaticCounts counts = state_->counts;
  counts.solves = state_->compliance.solves() + state_->held.solves();
  counts.factors = state_->compliance.factors() + state_->held.factors();
  counts.contact_error = state_->block.largest_miss();
  counts.columns_read = state_->compliance.cache().columns_read();
  counts.terms = state_->compliance.cache().taken();
  counts.skipped = state_->compliance.cache().skipped();
  return counts;
}

} // namespace gewebe::statics
