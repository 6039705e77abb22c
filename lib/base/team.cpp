#include "base/team.h"

#include "base/parallel.h"

#include <algorithm>
#include <immintrin.h>
#include <thread>
#include <utility>

namespace gewebe {

namespace {

constexpr std::uint64_t loop = std::uint64_t{1} << 32, blocks_left = loop - 1;

/// Waits a little: awake for some 100 us, and then so that others may have the processor.
class Pause {
public:
  void wait() {
    if (++count_ < patience)
      _mm_pause();
    else
      std::this_thread::yield();
  }
  void restart() { count_ = 0; }

private:
  static constexpr int patience = 2000;
  int count_ = 0;
};

} // namespace

void Team::run(const Body& body, std::size_t begin, std::size_t end) {
  try {
    body(begin, end);
  } catch (...) {
    const std::lock_guard lock(mutex_);
    if (!failure_)
      failure_ = std::current_exception();
  }
}

/// A block of the loop that is open. \return whether there was one
bool Team::take() {
  std::uint64_t open = open_.load(std::memory_order_acquire);
  while ((open & blocks_left) != 0) {
    const Body* const body = body_.load(std::memory_order_relaxed);
    const std::size_t count = count_.load(std::memory_order_relaxed),
                      grain = grain_.load(std::memory_order_relaxed);
    if (!open_.compare_exchange_weak(open, open - 1, std::memory_order_acq_rel,
                                     std::memory_order_acquire))
      continue;
    const std::size_t block = (count + grain - 1) / grain - (open & blocks_left);
    run(*body, block * grain, std::min(count, (block + 1) * grain));
    done_.fetch_add(1, std::memory_order_release);
    return true;
  }
  return false;
}

void Team::help() {
  Pause pause;
  while (!ended_.load(std::memory_order_acquire))
    if (take())
      pause.restart();
    else
      pause.wait();
}

void Team::blocks(std::size_t count, std::size_t grain, const Body& body) {
  const std::size_t all = (count + grain - 1) / grain;
  if (alone_ || all < 2) {
    for (std::size_t begin = 0; begin < count; begin += grain)
      body(begin, std::min(count, begin + grain));
    return;
  }
  body_.store(&body, std::memory_order_relaxed);
  count_.store(count, std::memory_order_relaxed);
  grain_.store(grain, std::memory_order_relaxed);
  done_.store(0, std::memory_order_relaxed);
  const std::uint64_t last = open_.load(std::memory_order_relaxed) & ~blocks_left;
  open_.store(last + loop + all, std::memory_order_release);
  while (take()) {
  }
  for (Pause pause; done_.load(std::memory_order_acquire) < all;)
    pause.wait();
  if (failure_)
    std::rethrow_exception(std::exchange(failure_, nullptr));
}

void lead_team(const Context& context, const std::function<void(Team&)>& work) {
  Team team;
  const auto threads = static_cast<std::size_t>(thread_count(context));
  if (threads == 1) {
    work(team);
    return;
  }
  team.alone_ = false;
  std::atomic<bool> led = false;
  // The first thread to arrive leads, so that no thread waits for a leader that has not started
  // yet.
  Context quiet = context;
  quiet.progress = nullptr;
  parallel_blocks(quiet, threads, 1, [&](std::size_t, std::size_t) {
    if (led.exchange(true))
      return team.help();
    struct End {
      std::atomic<bool>& ended;
      ~End() { ended.store(true, std::memory_order_release); }
    };
    const End end{team.ended_};
    work(team);
  });
}

} // namespace gewebe
