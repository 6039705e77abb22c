#include "solid/corotational.h"

#include "base/parallel.h"
#include "solid/assembly_internal.h"
#include "solid/corotational_kernel_internal.h"

#include <algorithm>
#include <array>
#include <utility>

namespace gewebe {

namespace {

constexpr std::size_t grain = 128; // groups, of which the energy is summed by itself

template <std::size_t Nodes>
struct Groups {
  std::vector<CorotationalGroup<Nodes>> groups;
  std::vector<CorotationalStrains<Nodes>> strains, before;
  std::vector<CorotationalResult<Nodes>> results;

  void make(const TetMesh& mesh, std::span<const SolidElement> elements) {
    groups.resize((elements.size() + 3) / 4);
    strains.resize(groups.size());
    before.resize(groups.size());
    results.resize(groups.size());
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
  }

  double evaluate(CorotationalEvaluate<Nodes> kernel, std::span<const double> x,
                  const CorotationalWeights& weights, const Context& context) {
    std::vector<double> energy((groups.size() + grain - 1) / grain);
    parallel_blocks(context, groups.size(), grain, [&](std::size_t begin, std::size_t end) {
      kernel(groups.data() + begin, end - begin, x.data(), before.data() + begin, weights,
             results.data() + begin, strains.data() + begin);
      double& sum = energy[begin / grain];
      for (std::size_t n = begin; n < end; ++n)
        for (const double e : results[n].energy)
          sum += e;
    });
    double sum = 0;
    for (const double e : energy)
      sum += e;
    return sum;
  }
};

} // namespace

struct CorotationalSolid::State {
  Groups<4> linear;
  Groups<10> quadratic;
  bool is_quadratic = false;
  std::size_t nodes = 0;
  std::vector<double> volume; ///< by element

  template <class Work>
  decltype(auto) with(const Work& work) {
    return is_quadratic ? work(quadratic) : work(linear);
  }
  template <class Work>
  decltype(auto) with(const Work& work) const {
    return is_quadratic ? work(quadratic) : work(linear);
  }
};

CorotationalSolid::~CorotationalSolid() = default;
CorotationalSolid::CorotationalSolid(CorotationalSolid&&) noexcept = default;
CorotationalSolid& CorotationalSolid::operator=(CorotationalSolid&&) noexcept = default;

CorotationalSolid::CorotationalSolid(const TetMesh& mesh, std::span<const SolidElement> elements)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.is_quadratic = !mesh.middles.empty();
  s.nodes = mesh.points.size();
  s.with([&](auto& of) { of.make(mesh, elements); });
  for (const SolidElement& e : elements)
    s.volume.push_back(e.volume);
}

double CorotationalSolid::evaluate(std::span<const double> x, const CorotationalWeights& weights,
                                   std::span<double> forces, const Context& context) {
  State& s = *state_;
  const CorotationalKernel& kernel = corotational_kernel(context.cpu);
  const double energy = s.is_quadratic ? s.quadratic.evaluate(kernel.quadratic, x, weights, context)
                                       : s.linear.evaluate(kernel.linear, x, weights, context);
  // In order, by one thread: the sums stay in its cache, where threads that each ask for the
  // elements of their nodes would wait for memory.
  std::ranges::fill(forces, 0.0);
  s.with([&](const auto& of) {
    for (std::size_t t = 0; t < s.volume.size(); ++t) {
      const auto& group = of.groups[t / 4];
      for (std::size_t a = 0; a < group.nodes; ++a) {
        double* const to = forces.data() + 3 * std::size_t{group.node[a][t % 4]};
        for (std::size_t c = 0; c < 3; ++c)
          to[c] += of.results[t / 4].force[3 * a + c][t % 4];
      }
    }
  });
  return energy;
}

void CorotationalSolid::remember() {
  state_->with([](auto& of) { of.before = of.strains; });
}

void CorotationalSolid::node_rotations(std::span<double> rotations, const Context& context) const {
  const State& s = *state_;
  const CorotationalKernel& kernel = corotational_kernel(context.cpu);
  std::vector<std::array<double[4], 9>> sums((s.nodes + 3) / 4);
  s.with([&](const auto& of) {
    for (std::size_t t = 0; t < s.volume.size(); ++t) {
      const auto& group = of.groups[t / 4];
      for (std::size_t a = 0; a < group.nodes; ++a) {
        const std::size_t i = group.node[a][t % 4];
        for (std::size_t c = 0; c < 9; ++c)
          sums[i / 4][c][i % 4] += s.volume[t] * of.results[t / 4].rotation[c][t % 4];
      }
    }
  });
  parallel_blocks(context, sums.size(), 256, [&](std::size_t begin, std::size_t end) {
    kernel.turn(sums[begin].data(), end - begin);
    for (std::size_t i = 4 * begin; i < std::min(4 * end, s.nodes); ++i)
      for (std::size_t c = 0; c < 9; ++c)
        rotations[9 * i + c] = sums[i / 4][c][i % 4];
  });
}

ElementFrame CorotationalSolid::frame(std::size_t t) const {
  ElementFrame frame;
  state_->with([&](const auto& of) {
    for (std::size_t c = 0; c < 9; ++c)
      frame.rotation[c] = of.results[t / 4].rotation[c][t % 4];
    for (std::size_t c = 0; c < 6; ++c)
      frame.stretch[c] = of.results[t / 4].stretch[c][t % 4];
  });
  return frame;
}

} // namespace gewebe
