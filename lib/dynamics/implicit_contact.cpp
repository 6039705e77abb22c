#include "dynamics/implicit_contact.h"

#include "base/error.h"
#include "base/vector_at.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace gewebe {

namespace {

constexpr int max_parts = 10, max_rounds = 60;
constexpr double same_place = 1e-10; ///< of the smallest radius
constexpr double rounding = 1e-14;   ///< of the size
constexpr double slow = 0.2;         ///< contraction above which the matrix is made anew

std::vector<double> shape_of(std::span<const NodeMotion> motion) {
  std::vector<double> u;
  u.reserve(3 * motion.size());
  for (const NodeMotion& m : motion)
    u.insert(u.end(), {m.displacement.x, m.displacement.y, m.displacement.z});
  return u;
}

} // namespace

/// A step that gives way to forces of contact.
class ImplicitContact::Object final : public Yielding {
public:
  Object(ImplicitContact& all, const Step& step, std::span<NodeMotion> motion,
         std::span<const NodeTouch> touches, const Context& context)
      : all_(all), step_(step), before_(motion.begin(), motion.end()), motion_(motion),
        force_(sums_of_touches({touches.begin(), touches.end()})), context_(context) {
    double radius = HUGE_VAL;
    for (const auto& i : step.instruments)
      if (i)
        radius = std::min(radius, i->shape.radius);
    tolerance_ = std::max(same_place * radius, rounding * all.size_);
  }

  DelassusOperator delassus_operator(std::span<const std::uint32_t> nodes) override {
    if (!ready_)
      run();
    if (!all_.columns_ || all_.columns_of_ != all_.euler_.factorisations()) {
      const ImplicitEuler& euler = all_.euler_;
      const std::size_t axes = 3 * before_.size();
      all_.columns_.emplace(
          before_.size(), nullptr,
          [&euler, axes](std::span<const std::uint32_t> some, std::span<double> columns) {
            std::fill(columns.begin(), columns.end(), 0.0);
            for (std::size_t k = 0; k < some.size(); ++k)
              for (std::size_t a = 0; a < 3; ++a)
                columns[(3 * k + a) * axes + 3 * std::size_t{some[k]} + a] = 1;
            euler.respond(columns, 3 * some.size());
          },
          static_cast<double>(context_.max_memory) / 4, false);
      all_.columns_of_ = euler.factorisations();
    }
    if (nodes.size() > all_.columns_->capacity())
      throw Error("the columns of " + std::to_string(nodes.size()) +
                  " nodes in contact do not fit in memory, expected more of it or fewer contacts");
    all_.columns_->need(nodes);
    DelassusOperator delassus;
    delassus.nodes.assign(nodes.begin(), nodes.end());
    const std::size_t size = 3 * nodes.size();
    delassus.compliance.resize(size * size);
    for (std::size_t c = 0; c < size; ++c)
      for (std::size_t r = c; r < size; ++r)
        delassus.compliance[c * size + r] = delassus.compliance[r * size + c] =
            all_.columns_->entry(nodes[c / 3], static_cast<int>(c % 3),
                                 3 * std::size_t{nodes[r / 3]} + r % 3);
    for (const std::uint32_t node : nodes)
      for (int a = 0; a < 3; ++a)
        delassus.free.push_back(motion_[node].displacement[a]);
    for (const NodeTouch& t : force_) { // without these
      const auto k = static_cast<std::size_t>(std::lower_bound(nodes.begin(), nodes.end(), t.node) -
                                              nodes.begin());
      for (std::size_t r = 0; r < size; ++r)
        for (std::size_t a = 0; a < 3; ++a)
          delassus.free[r] -=
              delassus.compliance[(3 * k + a) * size + r] * t.force[static_cast<int>(a)];
    }
    nodes_ = delassus.nodes;
    return delassus;
  }

  bool push(std::span<const NodeTouch> touches, std::span<const Vec3> at) override {
    force_.assign(touches.begin(), touches.end());
    run();
    double miss = 0;
    for (std::size_t k = 0; k < at.size(); ++k) {
      const double error =
          norm(all_.model_.nodes[nodes_[k]].position + motion_[nodes_[k]].displacement - at[k]);
      miss = std::isnan(error) ? error : std::max(miss, error);
    }
    agreed_ = miss <= tolerance_;
    failed_ = failed_ || ++rounds_ == max_rounds;
    if (agreed_ || failed_)
      return true;
    if (!(miss <= slow * last_miss_))
      all_.euler_.refactor(motion_, context_);
    last_miss_ = miss;
    return false;
  }

  std::span<const double> shape() override {
    shape_ = shape_of(motion_);
    return shape_;
  }

  bool solved() const { return agreed_ && !failed_; }
  std::uint32_t worst() const { return worst_; }

private:
  void run() {
    std::vector<Vec3> outer(step_.outer.begin(), step_.outer.end());
    for (const NodeTouch& t : force_)
      outer[t.node] += t.force;
    if (!failed_)
      failed_ = !all_.euler_.solve(before_, motion_, outer, step_.held, step_.h, ready_, context_,
                                   worst_);
    ready_ = true;
  }

  ImplicitContact& all_;
  const Step& step_;
  std::vector<NodeMotion> before_;
  std::span<NodeMotion> motion_;
  std::vector<NodeTouch> force_;
  const Context& context_;
  std::vector<std::uint32_t> nodes_;
  std::vector<double> shape_;
  double tolerance_ = 0, last_miss_ = HUGE_VAL;
  int rounds_ = 0;
  bool ready_ = false, failed_ = false, agreed_ = false;
  std::uint32_t worst_ = 0;
};

ImplicitContact::ImplicitContact(const Model& model, ImplicitEuler& euler)
    : model_(model), euler_(euler), contact_(model, std::vector<double>(3 * model.nodes.size())) {
  Box3 box;
  for (const Node& node : model.nodes)
    box.add(node.position);
  size_ = box.longest_side();
}

/// \return whether it was solved
bool ImplicitContact::part(const Step& step, std::span<NodeMotion> motion,
                           std::vector<NodeTouch>& touches, const Context& context,
                           Result& result) {
  std::vector<std::optional<MovedInstrument>> moved;
  for (const auto& i : step.instruments)
    moved.push_back(i ? std::optional(MovedInstrument{i->shape, i->way.at(step.start),
                                                      i->way.at(step.start + step.h)})
                      : std::nullopt);
  std::erase_if(touches, [&](const NodeTouch& t) {
    return t.instrument >= moved.size() || !moved[t.instrument] || step.displaced.contains(t.node);
  });
  std::vector<double> shape = shape_of(motion);
  contact_.restart(shape, touches);
  Object object(*this, step, motion, touches, context);
  contact_.update(object, step.displaced, moved, shape);
  result.worst = object.worst();
  if (!object.solved())
    return false;
  result.exact = result.exact && contact_.solved();
  touches = contact_.touches();
  for (NodeTouch t : touches) {
    t.force *= step.h;
    result.impulses.push_back(t);
  }
  return true;
}

ImplicitContact::Result ImplicitContact::step(const Step& step, std::span<NodeMotion> motion,
                                              std::vector<NodeTouch>& touches,
                                              const Context& context) {
  const std::vector<NodeMotion> before(motion.begin(), motion.end());
  const std::vector<NodeTouch> touched = touches;
  Result result;
  for (int parts = 0, count = 1; parts < max_parts && !result.solved; ++parts, count *= 2) {
    std::copy(before.begin(), before.end(), motion.begin());
    touches = touched;
    result = {.solved = true, .impulses = {}};
    for (int k = 0; k < count && result.solved; ++k) {
      Step one = step;
      one.h = step.h / count;
      one.start = step.start + k * one.h;
      result.solved = part(one, motion, touches, context, result);
    }
  }
  return result;
}

} // namespace gewebe
