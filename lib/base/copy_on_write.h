#pragma once
// A value that its copies share until one of them is written.

#include <memory>
#include <utility>

namespace gewebe {

/// Copying costs a reference. Different copies may be used by different threads, but not written
/// while another thread makes or drops a copy of the same one. A moved-from one may only be
/// assigned to or destroyed.
template <class T>
class CopyOnWrite {
public:
  CopyOnWrite() : held_(std::make_shared<T>()) {}
  CopyOnWrite(T value) : held_(std::make_shared<T>(std::move(value))) {} // NOLINT: stands for it

  const T& operator*() const noexcept { return *held_; }
  const T* operator->() const noexcept { return held_.get(); }
  /// This copy alone has it from now on.
  T& write() {
    if (held_.use_count() != 1)
      held_ = std::make_shared<T>(*held_);
    return *held_;
  }
  /// As write, for who overwrites all of it: what it holds is anything.
  T& replace() {
    if (held_.use_count() != 1)
      held_ = std::make_shared<T>();
    return *held_;
  }

private:
  std::shared_ptr<T> held_;
};

} // namespace gewebe
