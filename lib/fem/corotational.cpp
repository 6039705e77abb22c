#include "fem/corotational.h"

#include "base/parallel.h"
#include "fem/assembly_blocks.h"
#include "fem/corotational_kernel_internal.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

namespace gewebe::fem {

namespace {

constexpr std::size_t grain = 128; // groups of a block, whose results are summed by themselves
// From where on other threads are worth it, see parallel_blocks_if.
constexpr std::size_t worth_threads = 4096;       // groups times nodes of an element
constexpr std::size_t worth_threads_turns = 1024; // sums of four nodes

/// Sums of what tetrahedra bring to their nodes: first by blocks of groups, whose sums stay in the
/// cache, then those of the blocks that a node is in, in order.
template <std::size_t Nodes>
struct NodeSums {
  std::vector<CorotationalPlaces<Nodes>> local; ///< number within the block
  std::vector<std::size_t> first;               ///< slot of each block, and of one more
  std::vector<std::size_t> start;               ///< of each node's slots, and of one more, in
  std::vector<std::uint32_t> slot;
  std::vector<double> sums; ///< of each slot

  void make(std::span<const CorotationalGroup<Nodes>> groups, std::size_t nodes) {
    local.resize(groups.size());
    start.assign(nodes + 1, 0);
    std::vector<std::uint32_t> node_of_slot, number(nodes, UINT32_MAX);
    for (std::size_t n = 0; n < groups.size(); ++n) {
      if (n % grain == 0)
        first.push_back(node_of_slot.size());
      for (std::size_t a = 0; a < Nodes; ++a)
        for (std::size_t lane = 0; lane < 4; ++lane) {
          const std::uint32_t i = groups[n].node[a][lane];
          if (number[i] == UINT32_MAX || number[i] < first.back()) {
            number[i] = static_cast<std::uint32_t>(node_of_slot.size());
            node_of_slot.push_back(i);
            ++start[i + 1];
          }
          local[n][a][lane] = static_cast<std::uint16_t>(number[i] - first.back());
        }
    }
    first.push_back(node_of_slot.size());
    std::partial_sum(start.begin(), start.end(), start.begin());
    std::vector<std::size_t> next(start.begin(), start.end() - 1);
    slot.resize(node_of_slot.size());
    for (std::size_t s = 0; s < node_of_slot.size(); ++s)
      slot[next[node_of_slot[s]]++] = static_cast<std::uint32_t>(s);
  }

  std::size_t nodes() const { return start.size() - 1; }

  /// Sums of `Width` numbers a node: block(begin, end, sums) adds those of groups [begin, end) to
  /// sums[Width · local number], done(node, sum) takes a node's.
  template <std::size_t Width, class Block, class Done>
  void sum(const Context& context, const Block& block, const Done& done) {
    if (sums.size() < Width * slot.size())
      sums.resize(Width * slot.size());
    const bool worth = Nodes * local.size() >= worth_threads;
    const auto sum_block = [&](std::size_t begin, std::size_t end) {
      const std::size_t b = begin / grain;
      std::fill(sums.begin() + static_cast<std::ptrdiff_t>(Width * first[b]),
                sums.begin() + static_cast<std::ptrdiff_t>(Width * first[b + 1]), 0.0);
      block(begin, end, sums.data() + Width * first[b]);
    };
    parallel_blocks_if(worth, context, local.size(), grain, sum_block);
    const auto sum_node = [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        std::array<double, Width> sum{};
        for (std::size_t k = start[i]; k < start[i + 1]; ++k)
          for (std::size_t c = 0; c < Width; ++c)
            sum[c] += sums[Width * slot[k] + c];
        done(i, sum);
      }
    };
    parallel_blocks_if(worth, context, nodes(), 2048, sum_node);
  }
};

template <std::size_t Nodes>
struct Groups {
  std::vector<CorotationalGroup<Nodes>> groups;
  using Strains = std::vector<CorotationalStrains<Nodes>>;
  std::shared_ptr<Strains> strains = std::make_shared<Strains>();
  std::shared_ptr<const Strains> before = strains; ///< shared with snapshots
  std::vector<CorotationalRotations> rotations;
  /// Rotations of nodes' elements times volumes, [9 k + entry][lane] of node 4 k + lane.
  std::vector<std::array<double[4], 9>> turns;
  NodeSums<Nodes> sums;
  double elastic = 0;
  bool remembered = false; ///< the last strains are `before`

  void make(const tetrahedra::TetMesh& mesh, std::span<const SolidElement> elements,
            const CorotationalNotes& notes) {
    groups.resize((elements.size() + 3) / 4);
    strains = std::make_shared<Strains>(notes.strains ? groups.size() : 0);
    before = std::make_shared<Strains>(*strains);
    rotations.resize(notes.frames ? groups.size() : 0);
    turns.resize((mesh.points.size() + 3) / 4);
    for (std::size_t k = 0; k < 4 * groups.size(); ++k) {
      const std::size_t t = std::min(k, elements.size() - 1), lane = k % 4;
      const SolidElement& e = elements[t];
      CorotationalGroup<Nodes>& g = groups[k / 4];
      for (std::size_t a = 0; a < Nodes; ++a)
        g.node[a][lane] = solid_node(mesh, t, a);
      for (std::size_t c = 0; c < 3; ++c)
        for (int i = 0; i < 3; ++i)
          g.gradient[c][i][lane] = e.gradient[c + 1][i];
      const bool real = k < elements.size();
      g.volume[lane] = real ? e.volume : 0;
      g.mu[lane] = e.material.mu;
      g.lambda[lane] = e.material.lambda;
      if constexpr (Nodes == 10)
        for (std::size_t c = 0; c < 6; ++c)
          g.flexibility[c][lane] = real ? e.bubble_flexibility[c] : 0;
    }
    sums.make(groups, mesh.points.size());
  }

  void note_all() {
    if (before->empty())
      before = std::make_shared<Strains>(groups.size());
    rotations.resize(groups.size());
  }

  double evaluate(CorotationalEvaluate<Nodes> kernel, std::span<const double> x,
                  const CorotationalWeights& weights, std::span<double> forces,
                  const Context& context, bool with_turns) {
    if (strains.use_count() != 1 || strains->size() != before->size())
      strains = std::make_shared<Strains>(before->size());
    std::vector<std::array<double, 2>> energy((groups.size() + grain - 1) / grain);
    const auto block = [&](std::size_t begin, std::size_t end, double* to) {
      std::array<CorotationalResult<Nodes>, corotational_together> results;
      std::array<double, 2>& sum = energy[begin / grain];
      for (std::size_t n = begin; n < end; n += corotational_together) {
        const std::size_t count = std::min(corotational_together, end - n);
        kernel(groups.data() + n, count,
               {x.data(), sums.local.data() + n, to, with_turns,
                before->empty() ? nullptr : before->data() + n,
                strains->empty() ? nullptr : strains->data() + n, weights},
               results.data());
        for (std::size_t k = 0; k < count; ++k) {
          for (std::size_t lane = 0; lane < 4; ++lane) {
            sum[0] += results[k].elastic[lane];
            sum[1] += results[k].damping[lane];
          }
          if (!rotations.empty())
            rotations[n + k] = results[k].rotation;
        }
      }
    };
    const auto force = [&](std::size_t i, const auto& sum) {
      std::copy_n(sum.begin(), 3, forces.begin() + static_cast<std::ptrdiff_t>(3 * i));
    };
    if (with_turns)
      sums.template sum<corotational_turned>(context, block, [&](std::size_t i, const auto& sum) {
        force(i, sum);
        for (std::size_t c = 0; c < 9; ++c)
          turns[i / 4][c][i % 4] = sum[3 + c];
      });
    else
      sums.template sum<corotational_force>(context, block, force);
    elastic = 0;
    double damping = 0;
    for (const auto& [of_elements, of_damping] : energy) {
      elastic += of_elements;
      damping += of_damping;
    }
    remembered = false;
    return weights.elastic * elastic + weights.damping * damping;
  }

  void remember() {
    if (remembered)
      return;
    std::shared_ptr<const Strains> last = std::move(strains);
    strains = std::const_pointer_cast<Strains>(std::exchange(before, std::move(last)));
    remembered = true;
  }

  ElementFrame frame(std::size_t t) const {
    constexpr std::size_t points = CorotationalGroup<Nodes>::points;
    ElementFrame frame;
    for (std::size_t c = 0; c < 9; ++c)
      frame.rotation[c] = rotations[t / 4].value[c][t % 4];
    if (before->empty())
      return frame;
    const auto& of = (remembered ? *before : *strains)[t / 4].value;
    for (std::size_t c = 0; c < 6; ++c) { // the mean strain is that of the middle
      for (std::size_t p = 0; p < points; ++p)
        frame.stretch[c] += of[6 * p + c][t % 4] / points;
      frame.stretch[c] += c == 0 || c == 3 || c == 5 ? 1 : 0;
    }
    return frame;
  }
};

} // namespace

struct CorotationalSolid::State {
  Groups<4> linear;
  Groups<10> quadratic;
  std::vector<std::array<double[4], 9>> turning; ///< of node_rotations(), kept for its memory
  bool is_quadratic = false;
  std::size_t nodes = 0;

  template <class Work>
  decltype(auto) with(const Work& work) {
    return is_quadratic ? work(quadratic) : work(linear);
  }
};

CorotationalSolid::~CorotationalSolid() = default;
CorotationalSolid::CorotationalSolid(CorotationalSolid&&) noexcept = default;
CorotationalSolid& CorotationalSolid::operator=(CorotationalSolid&&) noexcept = default;

CorotationalSolid::CorotationalSolid(const tetrahedra::TetMesh& mesh,
                                     std::span<const SolidElement> elements,
                                     const CorotationalNotes& notes)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.is_quadratic = !mesh.middles.empty();
  s.nodes = mesh.points.size();
  s.with([&](auto& of) { of.make(mesh, elements, notes); });
}

double CorotationalSolid::evaluate(std::span<const double> x, const CorotationalWeights& weights,
                                   std::span<double> forces, const Context& context, bool turns) {
  State& s = *state_;
  const CorotationalKernel& kernel = corotational_kernel(context.cpu);
  return s.is_quadratic ? s.quadratic.evaluate(kernel.quadratic, x, weights, forces, context, turns)
                        : s.linear.evaluate(kernel.linear, x, weights, forces, context, turns);
}

double CorotationalSolid::elastic_energy() const noexcept {
  return state_->with([](const auto& of) { return of.elastic; });
}

void CorotationalSolid::remember() {
  state_->with([](auto& of) { of.remember(); });
}

std::shared_ptr<const void> CorotationalSolid::strains() const {
  return state_->with([](const auto& of) -> std::shared_ptr<const void> { return of.before; });
}

void CorotationalSolid::restore_strains(std::shared_ptr<const void> strains) {
  state_->with([&]<class Of>(Of& of) {
    of.before = std::static_pointer_cast<const typename Of::Strains>(std::move(strains));
    of.remembered = false;
  });
}

void CorotationalSolid::extend_strains(const std::shared_ptr<const void>& start, double factor) {
  state_->with([&]<class Of>(Of& of) {
    using Strains = typename Of::Strains;
    const Strains& from = *std::static_pointer_cast<const Strains>(start);
    auto extended = std::make_shared<Strains>(*of.before);
    for (std::size_t n = 0; n < from.size(); ++n)
      for (std::size_t c = 0; c < std::size((*extended)[n].value); ++c)
        for (std::size_t lane = 0; lane < 4; ++lane) {
          const double first = from[n].value[c][lane];
          double& value = (*extended)[n].value[c][lane];
          value = first + factor * (value - first);
        }
    of.before = std::move(extended);
    of.remembered = false;
  });
}

void CorotationalSolid::node_rotations(std::span<double> rotations, const Context& context) {
  State& s = *state_;
  const CorotationalKernel& kernel = corotational_kernel(context.cpu);
  auto& sums = s.turning;
  s.with([&](auto& of) { sums = of.turns; });
  const auto turn = [&](std::size_t begin, std::size_t end) {
    kernel.turn(sums[begin].data(), end - begin);
    for (std::size_t i = 4 * begin; i < std::min(4 * end, s.nodes); ++i)
      for (std::size_t c = 0; c < 9; ++c)
        rotations[9 * i + c] = sums[i / 4][c][i % 4];
  };
  parallel_blocks_if(sums.size() >= worth_threads_turns, context, sums.size(), 256, turn);
}

void CorotationalSolid::note_all() {
  state_->with([](auto& of) { of.note_all(); });
}

ElementFrame CorotationalSolid::frame(std::size_t t) const {
  return state_->with([&](const auto& of) { return of.frame(t); });
}

} // namespace gewebe::fem
