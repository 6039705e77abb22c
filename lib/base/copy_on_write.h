#pragma once
// Copy-on-write value: copies share it until one of them is written.

#include <memory>
#include <utility>

namespace gewebe {

/// A copy costs a reference count. Different threads may use different copies, but must not write
/// one while another thread makes or drops a copy of it. A moved-from value may only be assigned to
/// or destroyed.
template <class T>
class CopyOnWrite {
public:
  CopyOnWrite() : held_(std::make_shared<T>()) {}
  CopyOnWrite(T value) : held_(std::make_shared<T>(std::move(value))) {} // NOLINT: stands for it

  const T& operator*() const noexcept { return *held_; }
  const T* operator->() const noexcept { return held_.get(); }
  /// Reference to a value that only this copy has from now on.
  T& write() {
    if (held_.use_count() != 1)
      held_ = std::make_shared<T>(*held_);
    return *held_;
  }
  /// As write, to overwrite the whole value: its present content is unspecified.
  T& replace() {
    if (held_.use_count() != 1)
      held_ = std::make_shared<T>();
    return *held_;
  }

private:
  std::shared_ptr<T> held_;
};

} // namespace gewebe
