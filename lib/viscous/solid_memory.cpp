#include "viscous/solid_memory.h"

#include "base/parallel.h"
#include "fem/assembly_blocks.h"
#include "fem/hyperelastic.h"
#include "numeric/power.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace gewebe::viscous {

namespace {

// Elements from where on other threads are worth it, see parallel_blocks_if, and those of a block.
constexpr std::size_t worth = 128, together = 16;
constexpr double least_change = 1e-9; ///< of the largest stress
constexpr std::size_t most_points = 24;

/// (1 - exp(-x)) / x. \pre x >= 0
double mean_of_decay(double x) {
  if (x < 0.01)
    return 1 - x / 2 * (1 - x / 3 * (1 - x / 4 * (1 - x / 5 * (1 - x / 6))));
  return (1 - numeric::exponential(-x)) / x;
}

double product(const fem::SymmetricTensor& a, const fem::SymmetricTensor& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + 2 * (a[3] * b[3] + a[4] * b[4] + a[5] * b[5]);
}

double largest(const fem::SymmetricTensor& a) {
  double most = 0;
  for (const double value : a)
    most = std::max(most, std::abs(value));
  return most;
}

/// What an element adds to sums over all of them.
struct Sums {
  double beyond = 0, sudden = 0, change = 0, stress = 0;
};

} // namespace

SolidMemory::SolidMemory(const tetrahedra::TetMesh& mesh,
                         std::span<const fem::SolidMaterial> materials,
                         std::span<fem::SolidElement> elements)
    : mesh_(mesh), elements_(elements), points_(mesh.middles.empty() ? 1 : most_points) {
  for (const fem::SolidMaterial& m : materials) {
    Law& law = laws_.emplace_back();
    for (const model::PronyTerm& term : m.prony) {
      law.terms.push_back({.share = term.share, .time = term.time});
      law.rest -= term.share;
    }
  }
  for (std::size_t t = 0; t < elements.size(); ++t) {
    const std::size_t m = mesh.material.empty() ? 0 : static_cast<std::size_t>(mesh.material[t]);
    if (laws_[m].terms.empty())
      continue;
    parts_.push_back({.element = t, .law = m, .first = count_, .acting = acting_.size()});
    count_ += points_ * (1 + laws_[m].terms.size());
    acting_.resize(acting_.size() + points_);
  }
  restore({});
}

void SolidMemory::restore(const MemoryState& state) {
  if (empty())
    return;
  state_ = state;
  if (!state_.tensors)
    state_.tensors = std::make_shared<const std::vector<fem::SymmetricTensor>>(count_);
  begin(0);
}

void SolidMemory::begin(double h) {
  for (Law& law : laws_) {
    law.share = 1;
    for (Term& term : law.terms) {
      term.kept = numeric::exponential(-h / term.time);
      term.mean = mean_of_decay(h / term.time);
      law.share -= term.share * (1 - term.mean);
    }
  }
  recall();
}

/// Hands out A of the step.
void SolidMemory::recall() {
  for (const Part& part : parts_) {
    const Law& law = laws_[part.law];
    const fem::SymmetricTensor* from = state_.tensors->data() + part.first;
    for (std::size_t n = 0; n < points_; ++n, from += 1 + law.terms.size()) {
      fem::SymmetricTensor& a = acting_[part.acting + n];
      a.fill(0);
      for (std::size_t k = 0; k < law.terms.size(); ++k)
        for (std::size_t c = 0; c < a.size(); ++c)
          a[c] += law.terms[k].kept * from[1 + k][c] -
                  law.terms[k].share * law.terms[k].mean * from[0][c];
    }
    elements_[part.element].memory = {law.share, std::span(acting_).subspan(part.acting, points_)};
  }
}

void SolidMemory::end(std::span<const double> u, std::span<const Vec3> bubbles,
                      const Context& context) {
  auto next = std::make_shared<std::vector<fem::SymmetricTensor>>(*state_.tensors);
  std::vector<Sums> sums(parts_.size());
  const auto end_one = [&](const Part& part, Sums& sum) {
    const fem::SolidElement& element = elements_[part.element];
    std::array<Vec3, 10> of_nodes;
    const std::size_t count = fem::solid_nodes(mesh_);
    for (std::size_t a = 0; a < count; ++a) {
      const std::size_t axis = 3 * std::size_t{fem::solid_node(mesh_, part.element, a)};
      of_nodes[a] = {u[axis], u[axis + 1], u[axis + 2]};
    }
    std::array<fem::HyperelasticPointState, most_points> points;
    fem::point_states(element, std::span(of_nodes).first(count),
                      bubbles.empty() ? Vec3{} : bubbles[part.element], points);
    const Law& law = laws_[part.law];
    fem::SymmetricTensor* at = next->data() + part.first;
    for (std::size_t n = 0; n < points_; ++n, at += 1 + law.terms.size()) {
      const fem::HyperelasticPointState& q = points[n];
      const fem::SymmetricTensor before = at[0];
      if (q.is_sound)
        at[0] = q.stress;
      fem::SymmetricTensor sudden{}; // A of a sudden step from here
      double stored = 0;
      for (std::size_t k = 0; k < law.terms.size(); ++k) {
        const Term& term = law.terms[k];
        fem::SymmetricTensor& h = at[1 + k];
        fem::SymmetricTensor change;
        for (std::size_t c = 0; c < h.size(); ++c) {
          const double now = term.kept * h[c] + term.share * term.mean * (at[0][c] - before[c]);
          change[c] = now - h[c];
          h[c] = now;
          sudden[c] += now - term.share * at[0][c];
        }
        sum.change = std::max(sum.change, largest(change));
        stored += product(h, h) / (4 * term.share * element.material.mu);
      }
      sum.stress = std::max(sum.stress, largest(at[0]));
      const auto beyond = [&](double share, const fem::SymmetricTensor& a) {
        return q.weight * (stored - (share - law.rest) * q.energy - product(a, q.strain) / 2);
      };
      sum.beyond += beyond(law.share, acting_[part.acting + n]);
      sum.sudden += beyond(1, sudden);
    }
  };
  parallel_blocks_if(parts_.size() >= worth, context, parts_.size(), together,
                     [&](std::size_t begin, std::size_t end) {
                       for (std::size_t k = begin; k < end; ++k)
                         end_one(parts_[k], sums[k]);
                     });
  Sums all;
  for (const Sums& sum : sums) {
    all.beyond += sum.beyond;
    all.sudden += sum.sudden;
    all.change = std::max(all.change, sum.change);
    all.stress = std::max(all.stress, sum.stress);
  }
  beyond_ = all.beyond;
  state_ = {std::move(next), all.sudden, all.change <= least_change * all.stress};
  begin(0);
}

} // namespace gewebe::viscous
