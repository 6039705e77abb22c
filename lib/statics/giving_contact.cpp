#include "statics/giving_contact_internal.h"

#include <algorithm>
#include <array>
#include <utility>

namespace gewebe {

namespace {

constexpr std::uint32_t nobody = UINT32_MAX;

bool gives(const std::optional<MovedInstrument>& i) {
  return i && i->compliance > 0;
}

} // namespace

bool any_gives(std::span<const std::optional<MovedInstrument>> moved) {
  return std::ranges::any_of(moved, gives);
}

GivingContact::GivingContact(const ContactNodes& all,
                             std::span<const std::optional<MovedInstrument>> moved,
                             std::span<const Vec3> gave)
    : all_(all), moved_(moved) {
  giving_.push_back(nobody); // what stands where it must sees nodes as they are
  copies_.seen_by.resize(moved.size());
  for (std::uint32_t k = 0; k < moved.size(); ++k)
    if (gives(moved[k])) {
      copies_.seen_by[k] = static_cast<std::uint32_t>(giving_.size());
      giving_.push_back(k);
    }
  // By group the pieces that its instruments may meet, then copies of their corners: first those
  // that move.
  const auto count = static_cast<std::uint32_t>(giving_.size());
  std::vector<std::vector<std::uint32_t>> pieces(count), copy(count);
  for (std::uint32_t g = 0; g < count; ++g) {
    copy[g].assign(all.node.size(), nobody);
    for (std::uint32_t p = 0; p < all.pieces.size(); ++p) {
      Box3 own;
      for (const std::uint32_t i : all.pieces[p])
        own.add(all.was[i]);
      const bool meets = std::ranges::any_of(moved, [&](const auto& i) {
        const auto k = static_cast<std::size_t>(&i - moved.data());
        if (!i || copies_.seen_by[k] != g)
          return false;
        Box3 box = PlacedInstrument(i->shape, i->now).box();
        const Box3 before = PlacedInstrument(i->shape, i->before).box();
        box.add(before.min);
        box.add(before.max);
        return g == 0 || near(own, box, 2 * i->shape.radius + norm(gave[k]));
      });
      if (meets)
        pieces[g].push_back(p);
    }
  }
  for (const bool moving : {true, false}) {
    for (std::uint32_t g = 0; g < count; ++g)
      for (const std::uint32_t p : pieces[g])
        for (const std::uint32_t i : all.pieces[p])
          if ((g > 0 || i < all.moving) == moving && copy[g][i] == nobody) {
            copy[g][i] = static_cast<std::uint32_t>(of_.size());
            of_.push_back(i);
            seer_.push_back(g);
          }
    if (moving)
      copies_.moving = of_.size();
  }
  for (const std::uint32_t i : of_) {
    copies_.node.push_back(all.node[i]);
    copies_.was.push_back(all.was[i]);
    copies_.inward.push_back(all.inward[i]);
  }
  for (std::uint32_t g = 0; g < count; ++g)
    for (const std::uint32_t p : pieces[g]) {
      const Facet& f = all.pieces[p];
      copies_.pieces.push_back({copy[g][f[0]], copy[g][f[1]], copy[g][f[2]]});
      copies_.piece_seen_by.push_back(g);
    }
}

DelassusOperator GivingContact::delassus(const DelassusOperator& of_all) const {
  const std::size_t size = 3 * copies_.moving, from = 3 * all_.moving;
  DelassusOperator own;
  own.compliance.assign(size * size, 0);
  own.free.assign(size, 0);
  for (std::size_t c = 0; c < copies_.moving; ++c)
    for (std::size_t r = 0; r < copies_.moving; ++r) {
      const bool both = of_[c] < all_.moving && of_[r] < all_.moving;
      const double give =
          seer_[c] == seer_[r] && seer_[c] > 0 ? moved_[giving_[seer_[c]]]->compliance : 0;
      for (std::size_t b = 0; b < 3; ++b)
        for (std::size_t a = 0; a < 3; ++a)
          own.compliance[(3 * c + b) * size + 3 * r + a] =
              (both ? of_all.compliance[(std::size_t{3} * of_[c] + b) * from +
                                        std::size_t{3} * of_[r] + a]
                    : 0) +
              (a == b ? give : 0);
    }
  return own;
}

std::vector<Vec3> GivingContact::free(std::span<const Vec3> of_all) const {
  std::vector<Vec3> all;
  for (std::size_t c = 0; c < of_.size(); ++c) {
    all.push_back(of_all[of_[c]]);
    if (seer_[c] > 0) { // seen from where it is under what it was guessed to feel
      const MovedInstrument& i = *moved_[giving_[seer_[c]]];
      all.back() += i.compliance * i.pushed;
    }
  }
  return all;
}

std::vector<Vec3> GivingContact::gave(std::span<const TouchPair> pairs) const {
  std::vector<Vec3> all(moved_.size());
  for (std::size_t k = 0; k < all.size(); ++k)
    if (gives(moved_[k]))
      all[k] = -moved_[k]->compliance * moved_[k]->pushed;
  for (const TouchPair& p : pairs)
    if (gives(moved_[p.instrument]))
      all[p.instrument] -= moved_[p.instrument]->compliance * p.force;
  return all;
}

std::vector<Vec3> GivingContact::places(std::span<const Vec3> at, std::span<const Vec3> gave,
                                        const DelassusOperator& of_all, std::span<const Vec3> free,
                                        std::span<const TouchPair> pairs) const {
  std::vector<Vec3> all(free.begin(), free.begin() + static_cast<std::ptrdiff_t>(all_.moving));
  std::vector<bool> known(all_.moving);
  for (std::size_t c = 0; c < copies_.moving; ++c) // what stands where it must comes first
    if (const std::uint32_t i = of_[c]; i < all_.moving && !known[i]) {
      known[i] = true;
      all[i] = at[c] + (seer_[c] > 0 ? gave[giving_[seer_[c]]] : Vec3{});
    }
  for (std::size_t i = 0; i < all_.moving; ++i) { // what nobody sees
    if (known[i])
      continue;
    for (const TouchPair& p : pairs)
      for (std::size_t c = 0; c < 3; ++c)
        if (const std::uint32_t j = of_[p.piece[c]]; j < all_.moving && p.point.weights[c] > 0)
          for (std::size_t a = 0; a < 3; ++a)
            for (std::size_t b = 0; b < 3; ++b)
              all[i][static_cast<int>(a)] +=
                  of_all.compliance[(std::size_t{3} * j + b) * 3 * all_.moving + 3 * i + a] *
                  p.point.weights[c] * p.force[static_cast<int>(b)];
  }
  return all;
}

} // namespace gewebe
