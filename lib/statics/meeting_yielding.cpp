#include "statics/meeting_yielding.h"

#include "base/vector_at.h"
#include "statics/meeting_linear_internal.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace gewebe {

namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

// Of an edge.
constexpr double come_apart = 0.05;                ///< of what overlaps, a step
constexpr double keep_near = 0.1;                  ///< of what was touched
constexpr double same_gap = 1e-6, near_gap = 1e-5; ///< behind some turns
constexpr double fair_gap = surface_depth;
constexpr double same_place = 1e-8;
constexpr double next_to_nothing = 1e-4; ///< of the largest force
constexpr double is_none = 1e-12;        ///< of it: what solving for others leaves of a force

constexpr int max_turns = 40, turns_at_once = 8;
constexpr std::size_t max_new = 128; ///< pairs that join at once, the deepest
constexpr int max_asked = 8;         ///< times that triangles beyond the operator's nodes are met
constexpr int max_waits = 40;        ///< for instruments
constexpr double fold = 0.9;         ///< cosine of the angle from where on a node meets both sides

/// Whether a node that one triangle holds has passed another one that hangs together with that, at
/// an angle: it slid into a valley, or went through a ridge from one side to the other.
bool passed_beside(const SurfacePair& p, const SurfacePair& q) {
  return !p.edges && p.nodes != q.nodes && dot(p.normal, q.normal) < fold &&
         std::find_first_of(p.nodes.begin() + 1, p.nodes.end(), q.nodes.begin() + 1,
                            q.nodes.end()) != p.nodes.end();
}

} // namespace

class MeetingYielding::Work {
public:
  Work(Yielding& object, SurfacePairs& pairs, std::function<bool(std::uint32_t)> held,
       std::span<const double> was, std::vector<SurfacePush> kept, int most_turns);

  DelassusOperator delassus_operator(std::span<const std::uint32_t> nodes);
  bool push(std::span<const NodeTouch> touches, std::span<const Vec3> at);
  std::span<const double> shape() { return object_.shape(); }

  std::vector<NodeTouch> touches() const;
  std::vector<SurfacePush> kept() const;
  bool solved() const noexcept { return solved_; }
  TouchCounts counts() const;

private:
  using Key = decltype(std::declval<const SurfacePair&>().key());

  void begin();
  bool join(std::vector<SurfacePair> found, bool passed);
  void ask();
  void take_shape();
  void solve();
  bool gather_nodes();
  Eigen::VectorXd without_pairs() const;
  bool is_held(const SurfacePair& pair) const { return std::ranges::all_of(pair.nodes, held_); }
  double target_of(const SurfacePair& pair) const;
  double miss_of(std::span<const SurfacePush> pairs) const;
  void solve_linear(std::vector<SurfacePush>& pairs, const Eigen::VectorXd& base,
                    Eigen::VectorXd& x);

  Yielding& object_;
  SurfacePairs& pairs_;
  std::function<bool(std::uint32_t)> held_;
  std::vector<double> was_;
  std::vector<Vec3> was_at_;
  std::map<Key, double> overlaps_; ///< gaps when the step began

  std::vector<std::uint32_t> own_; ///< nodes that instruments may touch
  std::vector<SurfacePush> all_;   ///< by Key
  std::vector<std::uint32_t> nodes_, more_;
  DelassusOperator delassus_;     ///< of nodes_: own_, those of pairs, and more_
  std::vector<NodeTouch> pushed_; ///< by instruments, last
  std::vector<Vec3> at_;          ///< places of all nodes
  Eigen::VectorXd x_;             ///< of nodes_ under all forces
  bool begun_ = false, fresh_ = false, solved_ = true;
  int waits_ = 0, turns_ = 0, most_turns_ = 0;
  double left_ = 0; ///< of gaps, over an edge
};

MeetingYielding::Work::Work(Yielding& object, SurfacePairs& pairs,
                            std::function<bool(std::uint32_t)> held, std::span<const double> was,
                            std::vector<SurfacePush> kept, int most_turns)
    : object_(object), pairs_(pairs), held_(std::move(held)), was_(was.begin(), was.end()),
      was_at_(pairs.places_of(was)), all_(std::move(kept)), most_turns_(most_turns) {}

/// The step under the last forces, and who touches whom in it.
void MeetingYielding::Work::begin() {
  begun_ = true;
  (void)gather_nodes();
  delassus_ = object_.delassus_operator(nodes_);
  fresh_ = true;
  take_shape();
  for (SurfacePush& p : all_)
    pairs_.follow(p.pair, at_);
  std::erase_if(all_, [&](const SurfacePush& p) {
    return p.pair.apart || !(p.pair.gap < keep_near * pairs_.edge()) || is_held(p.pair);
  });
  std::vector<SurfacePair> found = pairs_.find(object_.shape(), was_, 0);
  if (std::ranges::any_of(
          found, [&](const SurfacePair& p) { return p.gap < -come_apart * pairs_.edge(); }))
    for (const SurfacePair& p : pairs_.find(was_, was_, 0))
      overlaps_[p.key()] = p.gap;
  if (!join(std::move(found), false))
    join(pairs_.find_passed(object_.shape(), was_, surface_depth * pairs_.edge()), true);
}

void MeetingYielding::Work::take_shape() {
  at_ = pairs_.places_of(object_.shape());
}

/// \param passed on their way, from where they were outside \return whether any is new
bool MeetingYielding::Work::join(std::vector<SurfacePair> found, bool passed) {
  bool joined = false;
  if (found.size() > max_new) {
    std::ranges::stable_sort(found, {}, &SurfacePair::gap);
    if (begun_)
      found.resize(max_new);
  }
  for (SurfacePair p : found) {
    if (is_held(p) || (!passed && !(p.gap < target_of(p) - surface_depth * pairs_.edge())))
      continue;
    const auto place_of = [&] {
      return std::ranges::lower_bound(all_, p.key(), {},
                                      [](const SurfacePush& push) { return push.pair.key(); });
    };
    const auto is_there = [&](const auto& at) {
      return at != all_.end() && at->pair.key() == p.key();
    };
    auto there = place_of();
    // Not of one surface: beside the front of a wound, where its walls meet at an angle, what keeps
    // a node in front of both would push one wall into the other.
    if (passed && is_there(there) && there->force != Vec3{} &&
        !pairs_.meetings()[p.meeting].itself() && passed_beside(there->pair, p)) {
      p.more = true;
      there = place_of();
    }
    if (is_there(there)) {
      // One that let go, as if beside, has passed nevertheless.
      if (passed && there->force == Vec3{}) {
        *there = {p, {}, true};
        joined = true;
      }
      continue;
    }
    all_.insert(there, {p, {}, passed});
    joined = true;
  }
  return joined;
}

/// \return whether it has more nodes than before
bool MeetingYielding::Work::gather_nodes() {
  std::vector<std::uint32_t> nodes = own_;
  nodes.insert(nodes.end(), more_.begin(), more_.end());
  for (const SurfacePush& p : all_) {
    nodes.insert(nodes.end(), p.pair.nodes.begin(), p.pair.nodes.end());
  }
  std::erase_if(nodes, held_);
  std::ranges::sort(nodes);
  nodes.erase(std::ranges::unique(nodes).begin(), nodes.end());
  const bool same = nodes == nodes_;
  nodes_ = std::move(nodes);
  return !same;
}

void MeetingYielding::Work::ask() {
  if (!gather_nodes() && fresh_)
    return;
  delassus_ = object_.delassus_operator(nodes_);
  fresh_ = true;
  take_shape();
}

/// Where the operator's nodes are without the pairs' forces.
VectorXd MeetingYielding::Work::without_pairs() const {
  const std::span<const Vec3> rest = pairs_.rest();
  const auto size = static_cast<Index>(3 * nodes_.size());
  VectorXd x(size);
  for (std::size_t k = 0; k < nodes_.size(); ++k)
    for (int a = 0; a < 3; ++a)
      x[static_cast<Index>(3 * k) + a] = rest[nodes_[k]][a] + vector_at(delassus_.free, k)[a];
  const Eigen::Map<const MatrixXd> w(delassus_.compliance.data(), size, size);
  for (const NodeTouch& t : pushed_) {
    const auto at = std::ranges::lower_bound(nodes_, t.node);
    if (at != nodes_.end() && *at == t.node)
      x += w.middleCols<3>(3 * (at - nodes_.begin())) * eigen(t.force);
  }
  return x;
}

/// The least gap that a pair may have.
double MeetingYielding::Work::target_of(const SurfacePair& pair) const {
  const auto known = overlaps_.find(pair.key());
  return known == overlaps_.end() ? 0 : std::min(0.0, known->second + come_apart * pairs_.edge());
}

/// Forces of pairs, whose points and normals stay.
void MeetingYielding::Work::solve_linear(std::vector<SurfacePush>& pairs, const VectorXd& base,
                                         VectorXd& x) {
  std::vector<Vec3> without(at_);
  for (std::size_t k = 0; k < nodes_.size(); ++k)
    without[nodes_[k]] = vec(base.segment<3>(static_cast<Index>(3 * k)));
  const std::vector<std::size_t> some = counting_pairs(pairs);
  std::vector<SurfacePush> looked;
  std::vector<Contact> contacts;
  for (const std::size_t k : some) {
    const SurfacePair& p = pairs[k].pair;
    const Vec3 here = between(p, without);
    contacts.push_back({static_cast<std::uint32_t>(looked.size()), p.normal,
                        dot(p.normal, here) - target_of(p), here - between(p, was_at_),
                        pairs_.meetings()[p.meeting].friction});
    looked.push_back(pairs[k]);
  }
  const MeetingColumns columns = columns_of_pairs(looked, nodes_, delassus_.compliance);
  solved_ = push_pairs(columns, contacts, looked) && solved_;
  for (SurfacePush& p : pairs)
    p.force = {};
  x = base;
  for (std::size_t k = 0; k < some.size(); ++k) {
    pairs[some[k]].force = looked[k].force;
    x += columns.moved.middleCols<3>(static_cast<Index>(3 * k)) * eigen(looked[k].force);
  }
}

/// How far gaps are from what the forces say, over an edge.
double MeetingYielding::Work::miss_of(std::span<const SurfacePush> pairs) const {
  double most = 0, largest = 0;
  for (const SurfacePush& p : pairs)
    largest = std::max(largest, norm(p.force));
  for (const SurfacePush& p : pairs) {
    const bool pushes = !(norm(p.force) <= is_none * largest);
    if (p.pair.apart && !pushes)
      continue;
    const double off = p.pair.gap - target_of(p.pair);
    const double miss = pushes ? std::abs(off) : std::max(0.0, -off);
    most = miss <= most ? most : miss;
  }
  return most / pairs_.edge();
}

/// Forces of all pairs, and where they put the operator's nodes.
void MeetingYielding::Work::solve() {
  for (int asked = 0; asked < max_asked; ++asked) {
    ask();
    const VectorXd base = without_pairs();
    double part = 1;
    for (int turn = 0;; ++turn) {
      for (SurfacePush& p : all_)
        if (!std::exchange(p.fresh, false))
          pairs_.follow(p.pair, at_);
      solved_ = true;
      solve_linear(all_, base, x_);
      ++turns_;
      std::vector<Vec3> there(at_);
      for (std::size_t k = 0; k < nodes_.size(); ++k)
        there[nodes_[k]] = vec(x_.segment<3>(static_cast<Index>(3 * k)));
      std::vector<SurfacePush> then(all_);
      for (SurfacePush& p : then)
        pairs_.follow(p.pair, there);
      left_ = miss_of(then);
      if (!(left_ > (turn < turns_at_once ? same_gap : near_gap)) || turn == max_turns ||
          turns_ >= most_turns_ || !solved_)
        break;
      part = turn < turns_at_once ? 1 : turn < 2 * turns_at_once ? 0.5 : 0.25;
      for (const std::uint32_t node : nodes_)
        at_[node] += part * (there[node] - at_[node]);
    }
    solved_ = solved_ && left_ <= fair_gap;
    // Triangles that nodes have come to, whose corners must give way too.
    bool beyond = false;
    for (const SurfacePush& p : all_)
      for (std::size_t c = 0; c < 4; ++c)
        if (p.pair.share[c] != 0 && !held_(p.pair.nodes[c]) &&
            !std::ranges::binary_search(nodes_, p.pair.nodes[c]))
          beyond = true;
    if (!beyond || turns_ >= most_turns_)
      return;
    more_ = nodes_; // none leaves again
  }
}

DelassusOperator MeetingYielding::Work::delassus_operator(std::span<const std::uint32_t> nodes) {
  own_.assign(nodes.begin(), nodes.end());
  if (!begun_)
    begin();
  std::erase_if(pushed_,
                [&](const NodeTouch& t) { return !std::ranges::binary_search(own_, t.node); });
  solve();
  // What the pairs that push hold together: along the normal, and where they stick.
  std::vector<SurfacePush> on;
  for (const std::size_t k : counting_pairs(all_))
    if (all_[k].force != Vec3{})
      on.push_back(all_[k]);
  const MeetingColumns columns = columns_of_pairs(on, nodes_, delassus_.compliance);
  MatrixXd ways = MatrixXd::Zero(static_cast<Index>(3 * on.size()), 0);
  for (std::size_t k = 0; k < on.size(); ++k) {
    const SurfacePush& p = on[k];
    const double friction = pairs_.meetings()[p.pair.meeting].friction;
    const Vec3 &n = p.pair.normal, drag = p.force - dot(p.force, n) * n;
    const bool sticks = friction > 0 && norm(drag) < (1 - 1e-6) * friction * dot(p.force, n);
    const Index from = ways.cols(), more = sticks ? 3 : 1;
    ways.conservativeResize(ways.rows(), from + more);
    ways.rightCols(more).setZero();
    if (sticks)
      ways.block<3, 3>(static_cast<Index>(3 * k), from).setIdentity();
    else
      ways.block<3, 1>(static_cast<Index>(3 * k), from) = eigen(n);
  }
  const auto size = static_cast<Index>(3 * nodes_.size());
  const auto count = static_cast<Index>(3 * own_.size());
  std::vector<Index> rows;
  for (const std::uint32_t node : own_)
    for (Index a = 0; a < 3; ++a)
      rows.push_back(3 * (std::ranges::lower_bound(nodes_, node) - nodes_.begin()) + a);
  const Eigen::Map<const MatrixXd> w(delassus_.compliance.data(), size, size);
  MatrixXd own = w(rows, rows);
  if (ways.cols() > 0) {
    const MatrixXd moved = (columns.moved * ways)(rows, Eigen::all);
    MatrixXd held = ways.transpose() * columns.compliance * ways;
    held.diagonal().array() += 1e-9 * held.diagonal().maxCoeff();
    const MatrixXd less = moved * held.llt().solve(moved.transpose());
    if (less.allFinite())
      own -= 0.5 * (less + less.transpose());
  }
  DelassusOperator result;
  result.nodes = own_;
  result.compliance.assign(own.data(), own.data() + own.size());
  VectorXd free(count);
  const std::span<const Vec3> rest = pairs_.rest();
  for (Index k = 0; k < count; ++k)
    free[k] = x_[rows[static_cast<std::size_t>(k)]] -
              rest[own_[static_cast<std::size_t>(k / 3)]][static_cast<int>(k % 3)];
  for (const NodeTouch& t : pushed_)
    free -= own.middleCols<3>(3 * (std::ranges::lower_bound(own_, t.node) - own_.begin())) *
            eigen(t.force);
  result.free.assign(free.data(), free.data() + free.size());
  return result;
}

bool MeetingYielding::Work::push(std::span<const NodeTouch> touches, std::span<const Vec3> at) {
  pushed_.assign(touches.begin(), touches.end());
  if (at.empty())
    own_.clear();
  const bool begins = !begun_;
  if (begins)
    begin();
  if (begins && all_.empty() && touches.empty()) // it ran as it is
    return true;
  solve();
  double miss = 0;
  for (std::size_t k = 0; k < own_.size(); ++k) {
    const Index row = 3 * (std::ranges::lower_bound(nodes_, own_[k]) - nodes_.begin());
    miss = std::max(miss, norm(vec(x_.segment<3>(row)) - at[k]));
  }
  if (miss > same_place * pairs_.edge() && waits_++ < max_waits)
    return false;
  waits_ = 0;
  std::vector<NodeTouch> all = this->touches();
  all.insert(all.begin(), touches.begin(), touches.end());
  std::vector<Vec3> there;
  for (std::size_t k = 0; k < nodes_.size(); ++k)
    there.push_back(vec(x_.segment<3>(static_cast<Index>(3 * k))));
  const bool agreed =
      object_.push(all, there) && !join(pairs_.find(object_.shape(), was_, 0), false) &&
      !join(pairs_.find_passed(object_.shape(), was_, surface_depth * pairs_.edge()), true);
  fresh_ = false;
  take_shape();
  if (turns_ < most_turns_)
    return agreed;
  solved_ = solved_ && agreed;
  return true;
}

std::vector<NodeTouch> MeetingYielding::Work::touches() const {
  std::vector<NodeTouch> all;
  for (const SurfacePush& p : all_) {
    if (p.force == Vec3{})
      continue;
    for (std::size_t c = 0; c < 4; ++c)
      if (p.pair.share[c] != 0)
        all.push_back({p.pair.nodes[c], other_surface, p.pair.share[c] * p.force});
  }
  return sums_of_touches(std::move(all));
}

std::vector<SurfacePush> MeetingYielding::Work::kept() const {
  double largest = 0;
  for (const SurfacePush& p : all_)
    largest = std::max(largest, norm(p.force));
  std::vector<SurfacePush> some;
  for (const SurfacePush& p : all_)
    if (norm(p.force) > next_to_nothing * largest ||
        (!p.pair.edges && !p.pair.more && !p.pair.apart && p.pair.gap < keep_near * pairs_.edge()))
      some.push_back(p);
  return some;
}

TouchCounts MeetingYielding::Work::counts() const {
  if (all_.empty())
    return {};
  const auto turns = static_cast<std::uint64_t>(turns_);
  return {1, turns, turns, solved_ ? 0U : 1U, solved_ ? left_ : 0};
}

MeetingYielding::MeetingYielding(Yielding& object, SurfacePairs& pairs,
                                 std::function<bool(std::uint32_t)> held,
                                 std::span<const double> was, std::vector<SurfacePush> kept,
                                 int most_turns)
    : work_(std::make_unique<Work>(object, pairs, std::move(held), was, std::move(kept),
                                   most_turns)) {}

MeetingYielding::~MeetingYielding() = default;

DelassusOperator MeetingYielding::delassus_operator(std::span<const std::uint32_t> nodes) {
  return work_->delassus_operator(nodes);
}
bool MeetingYielding::push(std::span<const NodeTouch> touches, std::span<const Vec3> at) {
  return work_->push(touches, at);
}
std::span<const double> MeetingYielding::shape() {
  return work_->shape();
}
std::vector<NodeTouch> MeetingYielding::touches() const {
  return work_->touches();
}
std::vector<SurfacePush> MeetingYielding::kept() const {
  return work_->kept();
}
bool MeetingYielding::solved() const noexcept {
  return work_->solved();
}
TouchCounts MeetingYielding::counts() const {
  return work_->counts();
}

} // namespace gewebe
