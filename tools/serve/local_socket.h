#pragma once
// A Unix stream socket by name: listening, permissions, and connections.

#include "formats/stream/descriptor.h"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace gewebe::cli {

/// Listens at a path, that its owner alone may connect to. The path is gone at the end, as
/// formats/stream/removal.h has it.
class LocalListener {
public:
  /// Replaces a socket without a listener. \throw Error (place = path) if there is a
  /// listener, something else is there, the name is too long or the folder can't be written
  explicit LocalListener(const std::string& path);
  ~LocalListener();
  LocalListener(const LocalListener&) = delete;
  LocalListener& operator=(const LocalListener&) = delete;

  int descriptor() const noexcept { return socket_.get(); }
  struct Arrival {
    formats::Descriptor client{};
    /// Why it can't stay: no descriptor was left for it. It has one that is kept for this and must
    /// be closed before the next is accepted. "": it may stay
    std::string refusal{};
  };
  /// The next one that waits, if any; it does not block. \throw Error (place = path) if there is
  /// one that can't even be turned away
  Arrival accept();

private:
  std::string path_;
  formats::Descriptor socket_;
  formats::Descriptor spare_;           ///< reserve, to refuse a client when descriptors run out
  std::uint64_t device_ = 0, file_ = 0; ///< of the path
  int removal_ = -1;
};

/// About a client of another user than this process's, "user NAME (ID) may not …"; nothing if it is
/// the same.
std::optional<std::string> foreign_peer(const formats::Descriptor& client);

/// How a transfer ended that does not wait.
enum class Transfer { some, none_now, over };

/// Sends what the other end takes now, and removes it from `bytes`: some, or over where there is no
/// other end.
Transfer send_some(const formats::Descriptor& to, std::string& bytes);
/// What has come, up to the size of the buffer, which it is in. Over: no more will come.
struct Received {
  Transfer how = Transfer::none_now;
  std::string_view bytes{};
};
Received receive_some(const formats::Descriptor& from, std::span<char> buffer);

} // namespace gewebe::cli
