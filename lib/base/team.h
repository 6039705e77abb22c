#pragma once
// Threads that stay awake for many short loops one behind the other, such as those over the fronts
// on the way to the root of an elimination tree. A loop begins within less than a microsecond,
// where parallel_blocks() wakes threads for each one; and who has come late, or has lost its
// processor, is not waited for, but for the blocks that it has taken.

#include "base/context.h"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>

namespace gewebe {

class Team {
public:
  using Body = std::function<void(std::size_t begin, std::size_t end)>;

  /// Of the calling thread alone.
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

  static constexpr std::size_t line = 64; // of the cache: who waits reads one, who works another

  bool alone_ = true;
  /// The loop's number, times 2^32, and how many of its blocks nobody has taken. What a thread has
  /// read of a loop is of that loop if it gets to take one off.
  alignas(line) std::atomic<std::uint64_t> open_ = 0;
  std::atomic<const Body*> body_ = nullptr;
  std::atomic<std::size_t> count_ = 0, grain_ = 1;
  std::atomic<bool> ended_ = false;
  alignas(line) std::atomic<std::size_t> done_ = 0; ///< blocks of the loop
  std::mutex mutex_;
  std::exception_ptr failure_;
};

/// Calls `work` once, with a team of the context's threads or what the system gives. Others of the
/// team wait awake until the work ends.
/// \throw what work throws, Cancelled
void lead_team(const Context& context, const std::function<void(Team&)>& work);

} // namespace gewebe
