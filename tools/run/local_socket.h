#pragma once
// A Unix stream socket by name: who listens, who may connect, and what is between them.

#include "formats/stream/descriptor.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace gewebe {

/// Listens at a path, that its owner alone may connect to. The path is gone at the end, as
/// formats/stream/removal.h has it.
class LocalListener {
public:
  /// In place of a socket that nobody listens on any more. \throw Error (place = path) if somebody
  /// does, something else is there, the name is too long or the folder can't be written
  explicit LocalListener(const std::string& path);
  ~LocalListener();
  LocalListener(const LocalListener&) = delete;
  LocalListener& operator=(const LocalListener&) = delete;

  int descriptor() const noexcept { return socket_.get(); }
  /// The next one that waits to be let in, if any; it does not block.
  Descriptor accept() const;

private:
  std::string path_;
  Descriptor socket_;
  std::uint64_t device_ = 0, file_ = 0; ///< of the path
  int removal_ = -1;
};

/// About a client of another user than this process's, "user NAME (ID) may not …"; nothing if it is
/// the same.
std::optional<std::string> foreign_peer(const Descriptor& client);

/// How a transfer ended that does not wait.
enum class Transfer { some, none_now, over };

/// Sends what the other end takes now, and removes it from `bytes`: some, or over where there is no
/// other end.
Transfer send_some(const Descriptor& to, std::string& bytes);
/// Appends what has come, up to `most` bytes. Over: no more will come.
Transfer receive_some(const Descriptor& from, std::string& bytes, std::size_t most);

} // namespace gewebe
