#pragma once
// Instruments that give way to what they push (contact/coupling.h): the contact seen from each of
// them. There it stands still, and a node that it pushes moves by what the node and the instrument
// give way: W_ij + c between the copies i and j of nodes that it sees, W_ij between those of
// different instruments. So the turns of a contact (contact_turns_internal.h) need not know.

#include "base/vec3.h"
#include "contact/load.h"
#include "statics/contact_turns_internal.h"
#include "statics/static_contact.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace gewebe {

class GivingContact {
public:
  /// \param all of the contact, as the scene has it \param gave by instrument: how far each has
  /// given way so far, from MovedInstrument::now; only pieces near there are looked at
  GivingContact(const ContactNodes& all, std::span<const std::optional<MovedInstrument>> moved,
                std::span<const Vec3> gave);

  /// Copies of nodes, by what sees them; pieces between these.
  const ContactNodes& nodes() const noexcept { return copies_; }
  DelassusOperator delassus(const DelassusOperator& of_all) const;
  std::vector<Vec3> free(std::span<const Vec3> of_all) const;

  /// Number of a copy's node in `all`.
  std::uint32_t node(std::uint32_t copy) const { return of_[copy]; }
  /// How far each instrument gives way under these forces. \param pairs of copies
  std::vector<Vec3> gave(std::span<const TouchPair> pairs) const;
  /// Where the moving nodes are. \param at of the copies \param free of all
  std::vector<Vec3> places(std::span<const Vec3> at, std::span<const Vec3> gave,
                           const DelassusOperator& of_all, std::span<const Vec3> free,
                           std::span<const TouchPair> pairs) const;

private:
  const ContactNodes& all_;
  std::span<const std::optional<MovedInstrument>> moved_;
  ContactNodes copies_;
  std::vector<std::uint32_t> of_, seer_; ///< by copy: its node, the group that sees it
  std::vector<std::uint32_t> giving_;    ///< by group: the instrument; of the first one none
};

/// Whether any of them gives way.
bool any_gives(std::span<const std::optional<MovedInstrument>> moved);

} // namespace gewebe
