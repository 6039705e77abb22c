#include "integrator/secants_internal.h"

#include "integrator/motion_kernel_internal.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace gewebe::integrator {

void Secants::drop(std::size_t oldest) {
  for (std::size_t k = 0; k + oldest < count_; ++k) {
    std::swap(pairs_[k], pairs_[k + oldest]);
    Parts& by = by_older_[k] = by_older_[k + oldest];
    std::shift_left(by.begin(), by.end(), static_cast<std::ptrdiff_t>(oldest));
  }
  count_ -= oldest;
  earlier_ -= std::min(earlier_, oldest);
}

void Secants::forget_earlier() {
  drop(earlier_);
}

void Secants::add(const Numbers& moved, const Numbers& turned, const Context& context) {
  if (count_ == most)
    drop(1);
  if (pairs_[count_].use_count() != 1)
    pairs_[count_] = std::make_shared<Pair>();
  Pair& pair = *pairs_[count_];
  pair.moved.resize(moved.size());
  pair.turned.resize(moved.size());
  const MotionKernel& kernel = motion_kernel(context.cpu);
  const auto sums = sums_of_axes<most>(
      context, moved.size(), [&](std::size_t begin, std::size_t end, Parts& products) {
        for (std::size_t k = begin; k < end; ++k) {
          pair.moved[k] = static_cast<float>(moved[k]);
          pair.turned[k] = static_cast<float>(turned[k]);
        }
        for (std::size_t k = 0; k <= count_; ++k)
          products[k] =
              kernel.product(pairs_[k]->moved.data() + begin, turned.data() + begin, end - begin);
      });
  if (!(sums[count_] > 0 && std::isfinite(sums[count_])))
    return;
  pair.over = 1 / sums[count_];
  by_older_[count_] = sums;
  ++count_;
}

/// Takes from the gradient what the pairs answer for, newest first.
Secants::Parts Secants::remove(Numbers& gradient, const Context& context) const {
  if (count_ == 0)
    return {};
  const MotionKernel& kernel = motion_kernel(context.cpu);
  Parts parts = sums_of_axes<most>(
      context, gradient.size(), [&](std::size_t begin, std::size_t end, Parts& products) {
        for (std::size_t k = 0; k < count_; ++k)
          products[k] =
              kernel.product(pairs_[k]->moved.data() + begin, gradient.data() + begin, end - begin);
      });
  for (std::size_t k = count_; k-- > 0;) {
    for (std::size_t newer = k + 1; newer < count_; ++newer)
      parts[k] -= parts[newer] * by_older_[newer][k];
    parts[k] *= pairs_[k]->over;
  }
  parallel_blocks(context, gradient.size(), axes_grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = count_; k-- > 0;)
      kernel.increase(gradient.data() + begin, -parts[k], pairs_[k]->turned.data() + begin,
                      end - begin);
  });
  return parts;
}

/// Second loop of L-BFGS: corrects the direction by each pair, oldest first.
void Secants::restore(const Parts& first, Numbers& direction, const Context& context) const {
  if (count_ == 0)
    return;
  const MotionKernel& kernel = motion_kernel(context.cpu);
  Parts parts = sums_of_axes<most>(
      context, direction.size(), [&](std::size_t begin, std::size_t end, Parts& products) {
        for (std::size_t k = 0; k < count_; ++k)
          products[k] = kernel.product(pairs_[k]->turned.data() + begin, direction.data() + begin,
                                       end - begin);
      });
  for (std::size_t k = 0; k < count_; ++k) {
    for (std::size_t older = 0; older < k; ++older)
      parts[k] += parts[older] * by_older_[k][older];
    parts[k] = first[k] - pairs_[k]->over * parts[k];
  }
  parallel_blocks(context, direction.size(), axes_grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = 0; k < count_; ++k)
      kernel.increase(direction.data() + begin, parts[k], pairs_[k]->moved.data() + begin,
                      end - begin);
  });
}

} // namespace gewebe::integrator
