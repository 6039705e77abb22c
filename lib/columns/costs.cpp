#include "columns/costs.h"

#include <algorithm>
#include <cmath>

namespace gewebe::columns::costs {

std::size_t usual_entries(std::size_t axes) {
  return 70 * axes;
}

std::size_t nodes_worth_a_solve(std::size_t entries, std::size_t axes, bool single) {
  // A solve reads L twice, with little to do at a time; columns are read once, as fast as memory
  // gives them. Measured, 10,004 nodes, L of 2.1e6: a solve of 4 ms is worth 110 nodes' columns of
  // float64, 130 of float32.
  return std::max<std::size_t>(1, (single ? 6 : 5) * entries / (3 * axes));
}

std::size_t max_in_block(bool stored) {
  // The 1200 rows of 400 nodes take 12 MB, read twice per update. Columns that are not stored cost
  // three solves for each node; a fresh factor with axes held costs some dozens of solves.
  return stored ? 400 : 32;
}

bool compressed_pay(double numbers, std::size_t entries) {
  // A solve reads L twice, from memory; small integers take an eighth of that and are widened.
  return numbers <= 4 * static_cast<double>(entries);
}

bool columns_pay_for_shapes(std::size_t nodes, bool stored, int shapes) {
  // One node's columns cost as much as a solve; more of them pay when a second shape comes.
  return (stored || nodes <= max_in_block(false)) && (nodes == 1 || shapes > 1);
}

bool woodbury_pays(const CutCosts& cut) {
  // Microseconds: an operation of a front, and of a solve with eight right-hand sides at a time;
  // what a partial refactorisation and Woodbury do for each node, whatever is cut.
  constexpr double front_operation = 0.6e-4, solve_operation = 0.6e-4;
  constexpr double refactor_node = 0.3, woodbury_node = 0.3;
  // After Woodbury, contacts need columns; after a refactorisation, forward solves suffice.
  constexpr double contact_panels = 1;
  // Share of all operations that a cut affects; used until the first cut has been measured.
  constexpr double usual_reach = 0.3;
  // Each solution needs a pass over the low-rank part. Beyond this rank the pass doubles its cost.
  constexpr std::size_t max_rank = 48;
  const auto nodes = static_cast<double>(cut.nodes);
  const double reach = cut.reached > 0 ? cut.reached : usual_reach * cut.all_operations;
  const double refactor = nodes * refactor_node + reach * front_operation;
  // One right-hand side alone takes half of what eight do.
  const double panels = cut.rank <= 1 ? 0.5 : std::ceil(static_cast<double>(cut.rank) / 8);
  const double woodbury = nodes * woodbury_node + (panels + contact_panels) * 8 * solve_operation *
                                                      4 * static_cast<double>(cut.entries);
  return cut.rank <= max_rank && woodbury < refactor;
}

bool order_is_worn_out(double all_operations, double fresh_operations) {
  return !(all_operations < 1.6 * fresh_operations);
}

bool correcting_columns_pays(std::size_t columns, std::size_t axes, std::size_t entries,
                             std::size_t rank, int responses) {
  const auto solve = static_cast<double>(entries), ranks = static_cast<double>(rank),
             count = static_cast<double>(columns);
  const double respond = ranks * solve * responses;
  const double correct = count * (ranks + 8) * static_cast<double>(axes) / 2;
  return respond + correct <= count * solve;
}

} // namespace gewebe::columns::costs
