#pragma once
// What the ways to an answer cost, so that the cheapest is taken. None depends on the number of
// threads or on the clock: a choice changes the last bits of results, which are the same on every
// run and machine. The figures were measured by tests/bench (contact, cut, break_even) on one core
// with models of 10,000 nodes.

#include <cstddef>

namespace gewebe::costs {

/// Doubles of L, where the factor is not loaded yet.
std::size_t usual_entries(std::size_t axes);

/// Products from which on threads are worth to be woken.
inline constexpr std::size_t worth_threads = 1000000;

// ---- shapes

/// Nodes up to which the sum of their columns costs no more than a solve. \param entries doubles of
/// L \param single whether the columns are float32
std::size_t nodes_worth_a_solve(std::size_t entries, std::size_t axes, bool single);

/// Whether a sum of compressed columns costs less than a solve. \param numbers that it takes
/// \param entries doubles of L
bool compressed_pay(double numbers, std::size_t entries);

/// Whether columns of nodes whose forces came from blocks are to be had for a shape. \param nodes
/// how many \param stored whether all have columns, stored or in memory \param shapes how many were
/// asked for with these nodes, this one among them
bool columns_pay_for_shapes(std::size_t nodes, bool stored, int shapes);

/// Nodes from which on a rigid motion of them is worth to be found out.
inline constexpr std::size_t worth_modes = 6;

// ---- forces at displaced nodes

/// Displaced nodes up to which forces come from their block of C; beyond, from K with their axes
/// held. \param stored as above
std::size_t max_in_block(bool stored);

// ---- cuts

/// What is known when a cut has to be followed.
struct CutCosts {
  std::size_t nodes = 0;     ///< of the cut model
  std::size_t rank = 0;      ///< of the change since the factor was made
  std::size_t entries = 0;   ///< doubles of L
  double all_operations = 0; ///< of all fronts
  double reached = 0;        ///< operations of the last refactorisation; 0: there was none
};

/// Whether to take the factor that there is by Woodbury, rather than to refactor what the cut
/// reaches.
bool woodbury_pays(const CutCosts& cut);

/// Whether the order of elimination is to be found anew, for following cuts has made it worse.
/// \param all_operations of all fronts now \param fresh_operations as they were in a fresh order
bool order_is_worn_out(double all_operations, double fresh_operations);

/// Whether to correct columns of the model before rather than to solve for them.
/// \param entries doubles that a solve reads twice \param rank of the change \param responses
/// how many of its solves, in multiples of the rank, are still to be done
bool correcting_columns_pays(std::size_t columns, std::size_t axes, std::size_t entries,
                             std::size_t rank, int responses);

} // namespace gewebe::costs
