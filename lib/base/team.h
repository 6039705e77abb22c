#pragma once
// Team of threads that stay awake for many short successive loops, such as those over the fronts
// near the root of an elimination tree. A loop begins within less than a microsecond, while
// parallel_blocks() wakes threads for each loop. A thread that is late, or has lost its processor,
// delays only the blocks that it has taken.

#include "base/context.h"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>

namespace gewebe {

/// Team of lead_team(), which owns it.
class Team {
public:
  using Body = std::function<void(std::size_t begin, std::size_t end)>;

  /// Creates a team of the calling thread alone.
  Team() = default;
  Team(const Team&) = delete;
  Team& operator=(const Team&) = delete;

  bool alone() const noexcept { return alone_; }

  /// As parallel_blocks(): blocks [0,grain), [grain,2 grain), … of [0,count), the first ones first.
  /// \pre grain > 0, fewer than 2^32 blocks; it is called by the work of lead_team() alone, not by
  /// a body; body touches nothing that another block writes.
  /// \throw what a body throws (one of them), once all have ended
  void blocks(std::size_t count, std::size_t grain, const Body& body);

private:
  friend void lead_team(const Context& context, const std::function<void(Team&)>& work);
  bool take();
  void help();
  void run(const Body& body, std::size_t begin, std::size_t end);

  static constexpr std::size_t line = 64; // of the cache: waiting and working use different lines

  bool alone_ = true;
  /// Number of the loop times 2^32, plus the number of its blocks that are not taken yet. If a
  /// thread succeeds in decrementing it, then the data that it has read belongs to that loop.
  alignas(line) std::atomic<std::uint64_t> open_ = 0;
  std::atomic<const Body*> body_ = nullptr;
  std::atomic<std::size_t> count_ = 0, grain_ = 1;
  std::atomic<bool> ended_ = false;
  alignas(line) std::atomic<std::size_t> done_ = 0; ///< blocks of the loop
  std::mutex mutex_;
  std::exception_ptr failure_;
};

/// Calls `work` once, with a team of the context's threads, or fewer if the system grants fewer.
/// The other threads of the team wait awake until the work ends.
/// \throw what work throws, Cancelled
void lead_team(const Context& context, const std::function<void(Team&)>& work);

} // namespace gewebe
