#pragma once
// Objects of tests are compiled once, for programs with sanitizers and without.

extern "C" {
[[gnu::weak]] void __asan_init();
[[gnu::weak]] void __tsan_init();
}

namespace gewebe::test {

/// Whether a sanitizer watches the library: it takes several times as long, and terabytes of
/// address space.
inline bool under_sanitizers() {
  return &__asan_init != nullptr || &__tsan_init != nullptr;
}

} // namespace gewebe::test
