#pragma once
// The same solids by another program: scikit-fem, where $PYTHON (else python3) has it.

#include "tests/validate/checks.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace gewebe::validate {

enum class PeerElement {
  linear,
  plain, ///< quadratic displacements alone
  mixed, ///< with our bubble and pressure
};

struct PeerMatrix {
  std::vector<std::int64_t> column_start, row;
  std::vector<double> value; ///< of all axes, the lower triangle by columns
};

/// What it can tell beside displacements.
struct PeerWish {
  PeerMatrix* matrix = nullptr;      ///< filled where there is one
  std::optional<std::size_t> node{}; ///< a corner, whose stress is wanted
  std::array<double, 6> stress{};    ///< there: xx xy xz yy yz zz, the mean of its elements
};

/// Nothing where there is no scikit-fem. \throw Error if it is there and gives no answer
std::optional<Answer> solve_by_peer(const test::SolidCase& c, PeerElement element,
                                    PeerWish* wish = nullptr);
std::optional<Figure> figure_by_peer(const test::SolidCase& c, PeerElement element);

/// Why a check is skipped without it.
inline constexpr const char* no_peer = "no scikit-fem (PYTHON=… says which Python)";
/// "scikit-fem 12.0.2, …", or nothing where there is none.
std::string peer_name();

/// The largest difference of entries over the largest entry. \pre of all axes
double difference(const linalg::StiffnessMatrix& ours, const PeerMatrix& peers);

} // namespace gewebe::validate
