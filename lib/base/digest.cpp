#include "base/digest.h"

#include <xxhash.h>

#include <array>
#include <cstdio>
#include <new>

namespace gewebe {

struct Digest::State {
  State() : xxh(XXH3_createState()) {
    if (xxh == nullptr)
      throw std::bad_alloc();
    XXH3_64bits_reset(xxh);
  }
  ~State() { XXH3_freeState(xxh); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  XXH3_state_t* xxh;
};

Digest::Digest() : state_(std::make_unique<State>()) {}
Digest::~Digest() = default;
Digest::Digest(Digest&&) noexcept = default;
Digest& Digest::operator=(Digest&&) noexcept = default;

void Digest::add_bytes(const void* data, std::size_t size) {
  if (size > 0)
    XXH3_64bits_update(state_->xxh, data, size);
}

std::uint64_t Digest::value() const {
  return XXH3_64bits_digest(state_->xxh);
}

std::string Digest::hex() const {
  return digest_text(value());
}

std::string digest_text(std::uint64_t digest) {
  std::array<char, 17> text{};
  (void)std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(digest));
  return text.data();
}

} // namespace gewebe
