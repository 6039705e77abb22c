#include "tests/validate/node_contact.h"

#include "base/vector_at.h"
#include "contact/contact_solver.h"

#include <cstddef>
#include <cstdint>
#include <utility>

namespace gewebe::validate {

NodeContact::NodeContact(const Model& model, DelassusOperator compliance)
    : compliance_(std::move(compliance)), force_(compliance_.nodes.size()) {
  for (std::size_t k = 0; k < compliance_.nodes.size(); ++k)
    free_.push_back(model.nodes[compliance_.nodes[k]].position + vector_at(compliance_.free, k));
  at_ = free_;
}

Vec3 NodeContact::press(const Vec3& centre, double radius) {
  constexpr int turns = 100;
  const std::size_t m = free_.size();
  for (int turn = 0; turn < turns; ++turn) {
    std::vector<Contact> contacts;
    std::vector<Vec3> guess;
    for (std::uint32_t k = 0; k < m; ++k) {
      const Vec3 from = at_[k] - centre;
      if (!(norm(from) < 1.5 * radius) || !(norm(from) > 0))
        continue;
      const Vec3 n = from / norm(from);
      contacts.push_back({k, n, dot(n, free_[k] - centre) - radius, {}, 0});
      guess.push_back(force_[k]);
    }
    const ContactForces found = solve_contacts(compliance_.compliance, m, contacts, guess);
    force_.assign(m, {});
    at_ = free_;
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      force_[contacts[i].node] = found.force[i];
      for (std::size_t r = 0; r < 3 * m && found.force[i] != Vec3{}; ++r)
        for (std::size_t a = 0; a < 3; ++a)
          at_[r / 3][static_cast<int>(r % 3)] +=
              compliance_.compliance[(3 * std::size_t{contacts[i].node} + a) * 3 * m + r] *
              found.force[i][static_cast<int>(a)];
    }
  }
  Vec3 sum;
  for (const Vec3& f : force_)
    sum += f;
  return sum;
}

} // namespace gewebe::validate
