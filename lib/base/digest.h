#pragma once
// XXH3-64 of decoded results in output order: the `digest` of --stats, and the UUID of volumes.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace gewebe {

/// 16 hexadecimal digits.
std::string digest_text(std::uint64_t digest);

class Digest {
public:
  Digest();
  ~Digest();
  Digest(Digest&&) noexcept;
  Digest& operator=(Digest&&) noexcept;

  void add_bytes(const void* data, std::size_t size);
  /// Adds the elements' bytes (no padding inside T, little-endian machine), not the count.
  template <class T>
  void add(std::span<const T> values) {
    add_bytes(values.data(), values.size_bytes());
  }
  template <class T>
  void add(const std::vector<T>& values) {
    add_bytes(values.data(), values.size() * sizeof(T));
  }
  void add(std::uint64_t value) { add_bytes(&value, sizeof value); }
  void add(double value) { add_bytes(&value, sizeof value); }

  std::uint64_t value() const;
  std::string hex() const;

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace gewebe
