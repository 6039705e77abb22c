#include "compliance/forces_at.h"

#include "columns/costs.h"
#include "geometry/vector_at.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace gewebe::compliance {

namespace {

constexpr double contact_tolerance = 1e-6;
// Roundings of factors that follow their changes stay below 1000 times one.
constexpr std::uint64_t max_changes = 1000;

} // namespace

bool ForcesAt::cheaper(const contact::Load& now, std::size_t limit) const {
  const std::size_t m = now.displacement.size();
  if (limit != SIZE_MAX)
    return m <= limit;
  if (m > columns::costs::max_in_block(true))
    return false;
  const std::vector<std::uint32_t> nodes = nodes_of(now.displacement);
  return compliance_.fit(nodes) &&
         (m <= columns::costs::max_in_block(false) || compliance_.stored(nodes));
}

bool ForcesAt::join(std::uint32_t node) {
  Contact contact{node, {}};
  std::vector<ComplianceBlock> with;
  with.reserve(now_.contacts->size());
  for (const Contact& other : *now_.contacts)
    with.push_back(compliance_.block(node, other.node));
  const ComplianceBlock own = compliance_.block(node, node);
  std::vector<double> row;
  for (std::size_t a = 0; a < 3; ++a) {
    if (contact::is_fixed(model_, node, static_cast<int>(a)))
      continue;
    contact.axes.push_back(axis_of(node, static_cast<int>(a)));
    row.clear();
    for (std::size_t k = 0; k < now_.contacts->size(); ++k)
      for (const std::size_t axis : (*now_.contacts)[k].axes)
        row.push_back(with[k][a][axis % 3]);
    for (const std::size_t axis : contact.axes)
      row.push_back(own[a][axis % 3]);
    ContactBlock& block = now_.block.write();
    if (!block.append(row)) {
      block.remove(block.size() + 1 - contact.axes.size(), contact.axes.size() - 1);
      return false;
    }
  }
  now_.contacts.write().push_back(std::move(contact));
  ++now_.changes;
  return true;
}

void ForcesAt::leave_all() {
  now_.contacts = {};
  now_.block = {};
  now_.changes = 0;
  now_.modes = {};
}

/// Whether C_cc of these nodes is positive definite.
bool ForcesAt::take_nodes(const std::map<std::uint32_t, Vec3>& nodes) {
  std::size_t staying = 0;
  for (const Contact& c : *now_.contacts)
    staying += nodes.contains(c.node) ? 1 : 0;
  if (staying == now_.contacts->size() && staying == nodes.size())
    return true;
  now_.modes = {};
  if (2 * staying < now_.contacts->size() || now_.changes > max_changes)
    leave_all();
  now_.shapes = 0;
  compliance_.need_blocks(nodes_of(nodes));
  std::size_t row = 0;
  for (std::size_t k = 0; k < now_.contacts->size();) {
    const Contact& contact = (*now_.contacts)[k];
    if (nodes.contains(contact.node)) {
      row += contact.axes.size();
      ++k;
      continue;
    }
    now_.block.write().remove(row, contact.axes.size());
    std::vector<Contact>& contacts = now_.contacts.write();
    contacts.erase(contacts.begin() + static_cast<std::ptrdiff_t>(k));
    ++now_.changes;
  }
  for (const auto& entry : nodes) {
    const bool there = std::ranges::any_of(*now_.contacts,
                                           [&](const Contact& c) { return c.node == entry.first; });
    if (!there && !join(entry.first)) {
      leave_all();
      return false;
    }
  }
  return true;
}

std::vector<std::size_t> ForcesAt::axes() const {
  std::vector<std::size_t> all;
  for (const Contact& c : *now_.contacts)
    all.insert(all.end(), c.axes.begin(), c.axes.end());
  return all;
}

std::vector<contact::NodeVector> ForcesAt::by_node(std::span<const double> force) const {
  std::vector<contact::NodeVector> list;
  std::size_t row = 0;
  for (const Contact& c : *now_.contacts) {
    contact::NodeVector& f = list.emplace_back(contact::NodeVector{c.node, {}});
    for (const std::size_t axis : c.axes)
      f.value[static_cast<int>(axis % 3)] = force[row++];
  }
  std::sort(
      list.begin(), list.end(),
      [](const contact::NodeVector& a, const contact::NodeVector& b) { return a.node < b.node; });
  return list;
}

/// Whether it came out right.
bool ForcesAt::meet(const contact::Load& now) {
  if (!take_nodes(now.displacement))
    return false;
  const std::vector<std::size_t> where = axes();
  std::vector<double> wanted = answer_.at_blocks(now, where);
  double size = largest_size(wanted);
  for (std::size_t k = 0; k < where.size(); ++k) {
    const double d = now.displacement.at(
        static_cast<std::uint32_t>(where[k] / 3))[static_cast<int>(where[k] % 3)];
    size = std::max(size, std::abs(d));
    wanted[k] = d - wanted[k];
  }
  std::vector<double> f = wanted, back(wanted.size()), correction(wanted.size());
  now_.block->solve(f);
  double miss = 0;
  for (int round = 0; round < 2; ++round) { // once more where updates of the factor left error
    now_.block->multiply(f, back);
    for (std::size_t k = 0; k < back.size(); ++k)
      correction[k] = wanted[k] - back[k];
    miss = largest_size(correction);
    if (round == 1 || miss <= 1e-13 * size)
      break;
    now_.block->solve(correction);
    for (std::size_t k = 0; k < f.size(); ++k)
      f[k] += correction[k];
  }
  if (size > 0)
    miss /= size;
  if (!(miss <= contact_tolerance))
    return false;
  miss_ = std::max(miss_, miss);
  now_.question = std::move(wanted);
  now_.counted = false;
  now_.force = std::move(f);
  return true;
}

/// Combines earlier shapes of rigid motions, if this is a rigid motion. \return whether it is
bool ForcesAt::shape(const contact::Load& now, std::vector<double>& u) {
  if (now_.contacts->size() < columns::costs::worth_modes ||
      (now_.modes->size() == 0 && !now_.modes->open()))
    return false;
  std::vector<double> coefficients, rest;
  if (!now_.modes->express(*now_.question, coefficients, rest)) {
    if (!now_.modes->open()) {
      now_.modes.write().give_up();
      return false;
    }
    double square = 0;
    for (const double r : rest)
      square += r * r;
    const double length = std::sqrt(square);
    for (double& r : rest)
      r /= length;
    std::vector<double> f = rest, answer(compliance_.rows(), 0);
    now_.block->solve(f);
    compliance_.add(by_node(f), 0, answer);
    now_.modes.write().add(rest, std::move(answer));
    coefficients.push_back(length);
  }
  u = answer_.whole(now);
  now_.modes->answer(coefficients, u);
  return true;
}

} // namespace gewebe::compliance
