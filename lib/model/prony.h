#pragma once
// Linear viscoelasticity of a material by a Prony series: the stress of a sudden strain that is
// held relaxes to
//
//   1 - Σ g_i (1 - exp(-t / tau_i))
//
// of what it was. Only the deviatoric part relaxes; viscous/solid_memory.h has the equations.

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::model {

struct PronyTerm {
  double share = 0; ///< g, of the sudden stress
  double time = 0;  ///< tau, s

  bool operator==(const PronyTerm&) const = default;
};

/// Of a word such as "prony:0.3@0.5,0.2@10", shares and times. \throw Error naming what is wrong
/// and what was expected; as check_prony
std::vector<PronyTerm> parse_prony(std::string_view text);

/// The word that parse_prony() reads as these terms, with the shortest numbers.
std::string prony_text(std::span<const PronyTerm> terms);

/// \throw Error unless there are at most 8 terms, shares are above 0 and at most 0.99 together, and
/// times are from 1e-6 to 1e9 s, ascending
void check_prony(std::span<const PronyTerm> terms);

/// Whether a word is one of these, right or wrong.
bool is_prony(std::string_view word);

} // namespace gewebe::model
