#pragma once
// Cost model that selects the cheapest algorithm. It depends neither on the number of threads nor
// on the clock: a choice changes the last bits of results, and these are the same on every run and
// machine. The constants were measured by tests/bench (contact, cut, break_even) on one core with
// models of 10,000 nodes.

#include <cstddef>

namespace gewebe::columns::costs {

/// Estimated number of doubles of L, for a factor that is not loaded yet.
std::size_t usual_entries(std::size_t axes);

/// From this number of products on, several threads are faster than one.
inline constexpr std::size_t worth_threads = 1000000;

// ---- shapes

/// Number of nodes up to which the sum of their columns costs no more than a solve.
/// \param entries  doubles of L
/// \param single  whether the columns are float32
std::size_t nodes_worth_a_solve(std::size_t entries, std::size_t axes, bool single);

/// Whether a sum of compressed columns costs less than a solve.
/// \param numbers  values that the sum reads
/// \param entries  doubles of L
bool compressed_pay(double numbers, std::size_t entries);

/// Whether columns of nodes are the cheapest way to a shape, if their forces were computed from a
/// block of C.
/// \param nodes  their number
/// \param stored  whether all columns are stored or in memory
/// \param shapes  number of shapes with these nodes, this one included
bool columns_pay_for_shapes(std::size_t nodes, bool stored, int shapes);

/// From this number of nodes on, a check for rigid motion saves time.
inline constexpr std::size_t worth_modes = 6;

// ---- forces at displaced nodes

/// Number of displaced nodes up to which forces come from their block of C. For more nodes they
/// come from K with their axes held. \param stored  as above
std::size_t max_in_block(bool stored);

// ---- cuts

/// Sizes on which the update after a cut depends.
struct CutCosts {
  std::size_t nodes = 0;     ///< of the cut model
  std::size_t rank = 0;      ///< of the change since the factor was made
  std::size_t entries = 0;   ///< doubles of L
  double all_operations = 0; ///< of all fronts
  double reached = 0;        ///< operations of the last refactorisation; 0: there was none
};

/// Whether a Woodbury correction of the present factor is cheaper than a refactorisation of the
/// fronts that the cut reaches.
bool woodbury_pays(const CutCosts& cut);

/// Whether a new elimination order is due, because cuts have made the present one worse.
/// \param all_operations  of all fronts now
/// \param fresh_operations  of all fronts in a fresh order
bool order_is_worn_out(double all_operations, double fresh_operations);

/// Whether correcting columns of the previous model is cheaper than solving for them.
/// \param entries  doubles that a solve reads twice
/// \param rank  of the change
/// \param responses  number of its solves that are still to be done, in multiples of the rank
bool correcting_columns_pays(std::size_t columns, std::size_t axes, std::size_t entries,
                             std::size_t rank, int responses);

} // namespace gewebe::columns::costs
