#pragma once
// Count of the memory that parallel work has allocated, checked against Context::max_memory.

#include "base/context.h"

#include <atomic>
#include <cstdint>
#include <utility>

namespace gewebe {

/// Number of bytes allocated by all threads, for work whose memory cannot be estimated before.
class MemoryAccount {
public:
  /// `what` names the result and must outlive the account.
  MemoryAccount(const Context& context, const char* what)
      : limit_(context.max_memory), what_(what) {}
  /// From any thread. \throw Error if the sum exceeds context.max_memory
  void add(std::uint64_t bytes);
  void remove(std::uint64_t bytes) noexcept { used_ -= bytes; }

private:
  std::uint64_t limit_;
  const char* what_;
  std::atomic<std::uint64_t> used_{0};
};

/// Part of a MemoryAccount that one container holds; it is removed when the container goes.
class MemoryShare {
public:
  MemoryShare() = default;
  explicit MemoryShare(MemoryAccount& account) : account_(&account) {}
  ~MemoryShare() {
    if (account_ != nullptr)
      account_->remove(bytes_);
  }
  MemoryShare(MemoryShare&& other) noexcept : account_(other.account_), bytes_(other.bytes_) {
    other.bytes_ = 0;
  }
  MemoryShare& operator=(MemoryShare&& other) noexcept {
    std::swap(account_, other.account_);
    std::swap(bytes_, other.bytes_);
    return *this;
  }
  MemoryShare(const MemoryShare&) = delete;
  MemoryShare& operator=(const MemoryShare&) = delete;

  /// Does nothing without an account. \throw Error beyond the limit
  void add(std::uint64_t bytes) {
    if (account_ == nullptr)
      return;
    account_->add(bytes);
    bytes_ += bytes;
  }

private:
  MemoryAccount* account_ = nullptr;
  std::uint64_t bytes_ = 0;
};

} // namespace gewebe
